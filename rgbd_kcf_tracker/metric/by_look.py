# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Following a target by its look alone, for where depth does not tell it from the rest.

A masked correlation filter finds it; its response against its own recent mean says whether it is
there (the relative test of OTR, Kart et al. 2019, which needs no absolute threshold). Scale comes
from depth where there is any on the target, else from a filter over scale.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import Floats, Image, Mask
from rgbd_kcf_tracker.frame import Frame, is_reading
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.metric.identity.appearance import Appearance, Sighting, share_after
from rgbd_kcf_tracker.metric.identity.elsewhere import Elsewhere
from rgbd_kcf_tracker.metric.identity.flow import TextureFlow
from rgbd_kcf_tracker.metric.identity.relief import Relief
from rgbd_kcf_tracker.metric.identity.scale_filter import SCALE_STEP, ScaleFilter
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.backdrop import Backdrop
from rgbd_kcf_tracker.metric.perceive.colors import view_image
from rgbd_kcf_tracker.metric.perceive.depth_view import grown, median_depth

LARGE_STEP = 0.08
"""Seconds between frames in which a target may leave the window, and from which other places are
looked at as well: where that was done at smaller steps, too, other players were found in two OTB
sequences."""
UNSURE = 0.7
"""Share of the mean response below which the look alone is not enough: other places are looked at
too after a :data:`LARGE_STEP`, and a leap of depth is not believed. A little above ``seen_ratio``,
for what is well alike needs no check."""
BETTER = 0.25
"""Share of the mean response by which another place must be better than where the target was
expected: others in like clothes respond nearly as much, and mostly it is where it was."""
SCALE_RATE = 0.025
"""Share of a new sample in the filter over scale, for each :data:`~.identity.appearance.FRAME`, as
in the paper of that filter (Danelljan et al., BMVC 2014)."""
SCALE_TIME = 0.1
"""Seconds in which the size follows depth: some frames at 30 Hz, so that one odd reading hardly
counts, and at once at 10 Hz and less."""
SCALE_RANGE = (0.1, 10.0)
"""Times its first size that a target is at the least and at the most: a Kinect v2 sees from 0.5 to
4.5 m, and so shows the same thing at most nine times as large. It keeps a lost size from running
off."""
SAME_HEIGHT, LIKE_FILTER = 1.25, 1.4
"""Times, or parts of, the height of the last box and of the filter's that an outline is high at the
most: who sits down or comes near is outlined all along at 5 Hz and more. What is higher by more is
the person who carries the target, and the target a part of him."""
OFF_MIDDLE = 0.25
"""Share of the filter's width by which its middle may be off that of what moves: arms and legs move
the latter so far; from there the filter has stayed behind."""
TOLD, WELL_TOLD = 0.3, 0.5
"""Share of an outline's pixels that differ from the backdrop from which the filter is brought to
its middle, and to its height: less is an arm."""
OUTLINE_TIME = 0.45
"""Seconds in which the filter follows the outline's height: longer than a step, shorter than it
takes to sit down."""
LEAST_SHARE = 0.3
"""Share of the target's area below which what moves where it was is not shown as the target: a head
and shoulders are more, a hand and what casts a shadow less."""
ALIKE = 0.9
"""Times the target's own of how likely the colours of what moves are its: a part of somebody is as
likely as the whole of him, within a tenth."""
SEARCH_WIDTH = 240
"""Columns of the image in which colours are searched, about those of the view of depth: it costs
the same at any resolution."""
PEAKS = 2
"""Places in the image that are looked at besides where the target was lost. Each costs as much as
a look at the target itself, and the cost is to be the same whatever the image shows."""
SAME_DEPTH = 0.15
"""Share by which depth may change while the look is unsure. Who comes nearer at 1.5 m/s does so by
that much in a tenth of a second at one metre; more of it is mostly somebody who passes before."""
COMES = 2.0
"""Metres a second by which it may have come nearer or gone away besides while it was not seen: at a
brisk walk."""
CARRIED = 1.0
"""Seconds without a look after which it may have been carried anywhere."""
BORNE_OUT = 0.75
"""Share of ``hidden_ratio`` below which what is as near as the target was is not it, either: what
is turned in a hand looks like itself again in less than a second."""


@dataclass(frozen=True, slots=True)
class Look:
    """Where a target was found by its look.

    Attributes:
        box: in pixels.
        ratio: the filter's response against its own recent mean.
        peak: the response.
        depth: of the target in metres, None where there is no reading on it.
        moved: whether it is told by what moves alone, as it looks like something else.
        stands_out: whether it stands out in depth where the target can have got to.
    """

    box: Box
    ratio: float
    peak: float
    depth: float | None
    moved: bool = False
    stands_out: bool = False


class ByLook:
    """Follows one target from frame to frame.

    Args:
        frame: the first.
        box: the target in it.
        parameters: of the tracker.

    Attributes:
        response: the filter's in the last look against its own recent mean.
        last_box: where the target was found last, in pixels of the newest image.
        last_depth: metres that were read on it there, None where there was no reading.
        unseen: seconds since then.
    """

    def __init__(self, frame: Frame, box: Box, parameters: MetricParameters) -> None:
        self._parameters = parameters
        self.response: float | None = None
        self._cx, self._cy, self._scale = box.cx, box.cy, 1.0
        self._appearance = Appearance(
            frame.color,
            box,
            cells=parameters.cells,
            padding=parameters.padding,
            sigma=parameters.label_sigma,
            rate=parameters.learning_rate,
            color_share=parameters.color_share,
            masked=parameters.use_mask,
        )
        self._scales = ScaleFilter(box.width, box.height)
        self._scales.learn(frame.color, box.cx, box.cy, box.width, box.height, 1.0)
        self._first_depth = self._depth = depth_in(frame, box)
        self._elsewhere = Elsewhere()
        self._relief = Relief.of(frame, box)
        self._small = _small(frame)
        self._elsewhere.keep(self._small, box.over(_step_of(frame)))
        self._flow = TextureFlow()
        self.last_box = box
        self._backdrop: Backdrop | None = None
        if self._depthless(frame):
            self._backdrop = Backdrop(_averaged(frame), box.over(_step_of(frame)))
        self._keep(frame)
        self._size_of_image, self._zoom = (frame.width, frame.height), 1.0
        self._hidden = False
        self.unseen, self._velocity = 0.0, (0.0, 0.0)
        self.last_depth = self._depth
        self._sure = self._scale, self._depth
        self._turn = True
        self._unlearned = 0.0
        self._put_off: Callable[[], None] | None = None

    def step(
        self, frame: Frame, dt: float, turn: bool = True, expected: Box | None = None
    ) -> Look | None:
        """Look for the target in the next frame, ``dt`` seconds later.

        Args:
            frame: the frame.
            dt: seconds.
            turn: whether it may be searched for in the image, and learned from. Without, it is
                looked at where it is expected, and one that is hidden not at all.
            expected: where it is in the image if it stands still in the world; None where that is
                not known.

        Returns:
            Where it is, or None where it is hidden. :meth:`take` or :meth:`refuse` must follow
            where it is not.
        """
        parameters = self._parameters
        self._follow_size(frame)
        self._turn = turn
        self.unseen += dt
        if self._hidden and not turn:
            return None
        self._small = _small(frame)
        if self._backdrop is not None:
            self._backdrop.see(_averaged(frame), self.last_box.over(_step_of(frame)), dt)
        if self._hidden:
            stands = None if expected is None else self._there(frame, expected)
            sighting = stands or self._ahead(frame, self._searched(frame, None))
            self._hidden = stands is None and sighting.ratio < self._enough(frame, sighting)
        else:
            if self._depthless(frame):
                self._flow_on(frame)
            at = self._cx, self._cy
            there = at if expected is None else (expected.cx, expected.cy)
            sighting = self._look_at(frame, *there)
            if there != at and sighting.ratio < UNSURE:  # or it has begun to move
                moved = self._look_at(frame, *at)
                sighting = max(sighting, moved, key=lambda each: each.ratio)
            sighting = self._ahead(frame, sighting)
            if turn and dt > LARGE_STEP and sighting.ratio < UNSURE:
                other = self._searched(frame, sighting)
                if other.ratio > max(sighting.ratio + BETTER, self._enough(frame, other)):
                    sighting = other
            self._hidden = sighting.ratio < parameters.hidden_ratio and not (
                sighting.ratio > BORNE_OUT * parameters.hidden_ratio
                and as_near(depth_in(frame, self._box_at(sighting)), self._depth)
            )
        self.response = sighting.ratio
        if self._hidden:
            look = self._moving(frame)
            if look is None:
                self._lose(frame)
                return None
            self._hidden = False
            return look
        look = self._found(frame, sighting, dt, self._stands_out(frame, sighting))
        return self._outlined(frame, look, dt)

    def take(self, frame: Frame, look: Look, dt: float) -> None:
        """Have :meth:`settle` learn from what :meth:`step` found."""
        # What looks unlike, or is nearer, may be another, whose size and way are not the target's.
        goes_on = look.depth is None or as_near(look.depth, self.last_depth)
        self._velocity = 0.0, 0.0
        if goes_on and self.unseen:
            across, down = look.box.cx - self.last_box.cx, look.box.cy - self.last_box.cy
            self._velocity = across / self.unseen, down / self.unseen
        self.last_box, self.unseen = look.box, 0.0
        if goes_on and look.ratio > self._parameters.seen_ratio:
            self._sure = self._scale, self._depth
            self._relief = Relief.of(frame, look.box)
        self.last_depth = look.depth
        self._put_off = partial(self._taken, frame, look, dt)

    def _taken(self, frame: Frame, look: Look, dt: float) -> None:
        if not look.moved and (self._backdrop is None or not self._backdrop.met):
            self._believed(frame, look, dt)
        if self._backdrop is not None:
            self._backdrop.learn(look.box.over(_step_of(frame)))
        self._keep(frame)

    def _believed(self, frame: Frame, look: Look, dt: float) -> None:
        if look.ratio <= self._parameters.seen_ratio:
            self._appearance.remember_peak(look.peak, 0.3 * dt)
            return
        self._unlearned += dt
        if self._turn:
            at = frame.color, self._cx, self._cy
            self._appearance.learn(*at, self._scale, self._unlearned)
            self._scales.learn(*at, *self._size, share_after(SCALE_RATE, self._unlearned))
            self._unlearned = 0.0
        self._appearance.remember_peak(look.peak, dt)
        self._elsewhere.keep(self._small, look.box.over(_step_of(frame)))

    def glance(self, frame: Frame, box: Box, dt: float, goes_on: bool) -> Look | None:
        """Look only about where the target is expected.

        Args:
            frame: the frame.
            box: where.
            dt: seconds since the last frame.
            goes_on: whether it was seen in that: it may turn then and look less like itself.

        Returns:
            None where it is not seen.
        """
        self._follow_size(frame)
        self._place(box)
        sighting = self._appearance.look(frame.color, self._cx, self._cy, self._scale)
        self.response = sighting.ratio
        parameters = self._parameters
        if sighting.ratio < (parameters.hidden_ratio if goes_on else parameters.seen_ratio):
            return None
        # Nothing bears out that this is the target: it is not learned from.
        return self._found(frame, sighting, dt)

    def attend(self, frame: Frame, box: Box, dt: float, interval: float) -> None:
        """Have :meth:`settle` learn from a target found by other means, every ``interval``."""
        self._unlearned += dt
        if self._unlearned < interval:
            return
        self._put_off = partial(self._attended, frame, box, self._unlearned)
        self._unlearned = 0.0

    def settle(self) -> None:
        """Learn what :meth:`take` or :meth:`attend` put off; to be called before the next frame."""
        put_off, self._put_off = self._put_off, None
        if put_off is not None:
            put_off()

    def _attended(self, frame: Frame, box: Box, seconds: float) -> None:
        self._follow_size(frame)
        self._place(box)
        self._appearance.attend(frame.color, self._cx, self._cy, self._scale, seconds)
        self._depth = depth_in(frame, box) or self._depth

    @property
    def unread(self) -> bool:
        """Whether depth showed nothing of the target when it was chosen."""
        return self._first_depth is None

    def own(self, image: Image) -> Floats:
        """Probability of each pixel's colour to be the target's and not of what is around it.

        Args:
            image: ``(h, w, 3)`` uint8 BGR.
        """
        self.settle()
        return self._appearance.posterior(image)

    def refuse(self, frame: Frame, look: Look) -> None:
        """What :meth:`step` found is something else: the target is hidden."""
        self._hidden = True
        self._elsewhere.refuse(self._small, look.box.over(_step_of(frame)))
        self._lose(frame)

    def _lose(self, frame: Frame) -> None:
        self._flow.forget()
        self._cx, self._cy = self.last_box.cx, self.last_box.cy
        if self._first_depth is not None:  # a leap of depth before was to what hides it
            self._scale, self._depth = self._sure
        if self._backdrop is not None:
            self._backdrop.miss(self.last_box.over(_step_of(frame)))

    def _follow_size(self, frame: Frame) -> None:
        """Carry the target over to a stream whose image size has changed."""
        size = frame.width, frame.height
        if size == self._size_of_image:
            return
        across, down = size[0] / self._size_of_image[0], size[1] / self._size_of_image[1]
        self._size_of_image = size
        self._flow.forget()
        self._elsewhere.forget()
        self._cx, self._cy = self._cx * across, self._cy * down
        self.last_box = self.last_box.stretched(across, down)
        zoom = float(np.sqrt(across * down))
        self._zoom *= zoom
        self._scale = _in_range(self._scale * zoom)
        scale, depth = self._sure
        self._sure = _in_range(scale * zoom), depth

    def _depthless(self, frame: Frame) -> bool:
        """Whether depth tells nothing of the target's size."""
        return frame.depth is None or self.unread

    def _keep(self, frame: Frame) -> None:
        if self._depthless(frame):
            self._flow.keep(
                frame.color, self._cx, self._cy, *self._size, self._appearance.posterior
            )
        else:
            self._flow.forget()

    def _flow_on(self, frame: Frame) -> None:
        """Expect the target where its texture has gone, at the size to which that has grown."""
        flow = self._flow.since(frame.color)
        if flow is None:
            return
        self._cx = float(np.clip(self._cx + flow.dx, 0, frame.width))
        self._cy = float(np.clip(self._cy + flow.dy, 0, frame.height))
        # What the filter over scale resolves is left to it: the flow's small errors add up.
        if abs(flow.growth - 1) > SCALE_STEP - 1:
            self._scale = _in_range(self._scale * flow.growth)

    def _place(self, box: Box) -> None:
        self._flow.forget()
        self._hidden = False
        self._cx, self._cy = box.cx, box.cy
        self._scale = _in_range(box.height / self._appearance.height)

    @property
    def _size(self) -> tuple[float, float]:
        return self._appearance.width * self._scale, self._appearance.height * self._scale

    def _look_at(self, frame: Frame, cx: float, cy: float) -> Sighting:
        """Look about a place; what stood there while the target was elsewhere is not seen."""
        possible = self._possible(frame, cx, cy)
        sighting = self._appearance.look(frame.color, cx, cy, self._scale, possible)
        if self._elsewhere.unchanged(self._small, self._box_at(sighting).over(_step_of(frame))):
            return dataclasses.replace(sighting, peak=0.0, ratio=0.0)
        return sighting

    def _possible(self, frame: Frame, cx: float, cy: float) -> Mask | None:
        """The cells of a window about ``cx, cy`` about which something is as near as the target.

        Those without a reading are, too. None where its own depth is not known.
        """
        if frame.depth is None or self._depth is None:
            return None
        columns, rows = self._appearance.cells(cx, cy, self._scale)
        u = np.clip(columns, 0, frame.width - 1).astype(np.intp)
        v = np.clip(rows, 0, frame.height - 1).astype(np.intp)
        depth = frame.depth[np.ix_(v, u)]
        depth = np.where(is_reading(depth), depth, np.float32(np.nan))
        off = np.abs(depth - np.float32(self._depth))
        near = ~(off > SAME_DEPTH * self._depth + COMES * self.unseen)
        return grown(near)

    def _ahead(self, frame: Frame, sighting: Sighting) -> Sighting:
        """What is found, or what is where the target is if it has gone on as before, if likelier.

        It is looked for there for a moment, where what was found is not surely the target.
        """
        if sighting.ratio >= UNSURE or self.unseen > CARRIED:
            return sighting
        across, down = (each * self.unseen for each in self._velocity)
        ahead = self._look_at(frame, self.last_box.cx + across, self.last_box.cy + down)
        if ahead.ratio <= max(sighting.ratio, self._parameters.hidden_ratio):
            return sighting
        # Who passes where a target would be is not it, as far as depth can tell.
        return ahead if self._depthless(frame) or self._stands_out(frame, ahead) else sighting

    def _enough(self, frame: Frame, sighting: Sighting) -> float:
        """The response against its mean from which what is found elsewhere is the target."""
        parameters = self._parameters
        stands_out = self._stands_out(frame, sighting)
        return parameters.hidden_ratio if stands_out else parameters.seen_ratio

    def _stands_out(self, frame: Frame, sighting: Sighting) -> bool:
        """Whether what is found stands out in depth, where the target can have got to.

        What is carried looks less like itself before something else.
        """
        if self._depth is None or self.unseen > CARRIED or not self._relief.stands_out:
            return False
        box = self._box_at(sighting)
        depth = depth_in(frame, box)
        if depth is None:
            return False
        camera = frame.intrinsics or Intrinsics.guess(frame.width, frame.height)
        aside = math.hypot(box.cx - self._cx, box.cy - self._cy) * depth / camera.fx
        in_reach = math.hypot(aside, depth - self._depth) < COMES * self.unseen
        return in_reach and Relief.of(frame, box).stands_out

    @property
    def _box(self) -> Box:
        return Box.from_center(self._cx, self._cy, *self._size)

    def _box_at(self, sighting: Sighting) -> Box:
        return Box.from_center(sighting.cx, sighting.cy, *self._size)

    def _there(self, frame: Frame, expected: Box) -> Sighting | None:
        """What is where a hidden target stands, if depth bears out that it is still there.

        It need not look as much like itself there as anywhere else.
        """
        found = self._look_at(frame, expected.cx, expected.cy)
        enough = found.ratio >= self._parameters.hidden_ratio
        still = enough and self._relief.left_in(Relief.of(frame, self._box_at(found)))
        return found if still else None

    def _searched(self, frame: Frame, best: Sighting | None) -> Sighting:
        """Look where it was lost, then where in the image the colours fit best.

        The cost is the same whatever the image shows: a fixed number of windows is looked into.
        """
        if best is None:
            best = self._look_at(frame, self._cx, self._cy)
            if best.ratio > self._parameters.seen_ratio:
                return best
        step = _step_of(frame)
        posterior = self._appearance.posterior(self._small)
        # Windows larger than the image show no more of it than all.
        width, height = (
            min(max(1, round(side / step)), most)
            for side, most in zip(self._size, self._small.shape[1::-1], strict=True)
        )
        inner, outer = (
            cv2.boxFilter(posterior, -1, (w | 1, h | 1), borderType=cv2.BORDER_REPLICATE)
            for w, h in ((width, height), (2 * width, 2 * height))
        )
        contrast = inner - np.float32(0.7) * outer
        for _ in range(PEAKS):
            row, col = (int(i) for i in np.unravel_index(np.argmax(contrast), contrast.shape))
            found = self._look_at(frame, (col + 0.5) * step, (row + 0.5) * step)
            if found.ratio > best.ratio:
                best = found
            contrast[
                max(0, row - height) : row + height + 1, max(0, col - width) : col + width + 1
            ] = -np.inf
        return best

    def _found(self, frame: Frame, sighting: Sighting, dt: float, stands_out: bool = False) -> Look:
        self._cx = float(np.clip(sighting.cx, 0, frame.width))
        self._cy = float(np.clip(sighting.cy, 0, frame.height))
        depth = depth_in(frame, self._box)
        self._rescale(frame, depth, sighting, dt)
        return Look(self._box, sighting.ratio, sighting.peak, depth, stands_out=stands_out)

    def _moving(self, frame: Frame) -> Look | None:
        """The target by what moves where it was: something hides a part of it, or it has turned."""
        if self._backdrop is None:
            return None
        step = _step_of(frame)
        piece = self._backdrop.follow(self._box.over(step), self._appearance.posterior)
        if piece is None or piece.share < LEAST_SHARE or piece.alike < ALIKE:
            return None
        box = piece.box.over(1 / step)
        width, height = self._size
        if box.height > SAME_HEIGHT * height:
            return None
        # It is expected where the piece is a part of it, with the least step.
        left, right = sorted((box.right - width / 2, box.x + width / 2))
        top, bottom = sorted((box.bottom - height / 2, box.y + height / 2))
        self._cx = min(max(self._cx, left), right)
        self._cy = min(max(self._cy, top), bottom)
        return Look(box, self._parameters.hidden_ratio, 0.0, None, moved=True)

    def _outlined(self, frame: Frame, look: Look, dt: float) -> Look:
        """What the look has found, with arms and legs where they show before what stands still."""
        if self._backdrop is None:
            return look
        step, filtered = _step_of(frame), look.box
        outline = self._backdrop.outline(filtered.over(step), self._appearance.posterior)
        if outline is None:
            return look
        box = outline.box.over(1 / step)
        change, apart = box.height / self.last_box.height, box.height / filtered.height
        if max(change, 1 / change) > SAME_HEIGHT or max(apart, 1 / apart) > LIKE_FILTER:
            return look
        if outline.told > TOLD:
            off, most = outline.cx * step - self._cx, OFF_MIDDLE * filtered.width
            self._cx += off - float(np.clip(off, -most, most))
        # Of what the image cuts off, nothing tells how high it is.
        if outline.told > WELL_TOLD and box.y > step and box.bottom < frame.height - step:
            share = 1 - float(np.exp(-dt / OUTLINE_TIME))
            self._scale = _in_range(self._scale * apart**share)
            self._cy += share * (box.cy - filtered.cy)
        return dataclasses.replace(look, box=box)

    def _rescale(self, frame: Frame, depth: float | None, sighting: Sighting, dt: float) -> None:
        """Follow the size: by depth where it is known, else by the look."""
        if self._first_depth and self._depth and depth and 0.5 < depth / self._depth < 2:
            if as_near(depth, self._depth) or sighting.ratio > UNSURE:
                self._depth = depth
            wanted = np.log(self._first_depth / self._depth * self._zoom / self._scale)
            self._scale *= float(np.exp(np.clip(wanted, -0.3, 0.3) * min(1, dt / SCALE_TIME)))
        else:
            self._scale *= self._scales.factor(frame.color, self._cx, self._cy, *self._size)
        self._scale = _in_range(self._scale)


def _in_range(scale: float) -> float:
    return float(np.clip(scale, *SCALE_RANGE))


def _step_of(frame: Frame) -> int:
    return max(1, min(round(frame.width / SEARCH_WIDTH), frame.height))


def _averaged(frame: Frame) -> Image:
    """A frame's colours, about as small as :func:`_small` has them, each the mean of its place."""
    step = _step_of(frame)
    cols, rows = max(1, frame.width // step), max(1, frame.height // step)
    whole = frame.color[: rows * step, : cols * step]
    image: Image = cv2.resize(whole, (cols, rows), interpolation=cv2.INTER_AREA)
    return image


def _small(frame: Frame) -> Image:
    """Every so many pixels of a frame's colours, about ``SEARCH_WIDTH`` columns."""
    return view_image(frame.color, _step_of(frame))


def as_near(depth: float | None, other: float | None) -> bool:
    """Whether two depths are both known and as good as the same."""
    if depth is None or other is None:
        return False
    return abs(depth / other - 1) < SAME_DEPTH


def depth_in(frame: Frame, box: Box) -> float | None:
    """Median depth in the middle of a box in metres, None where most of it has no reading."""
    depth = median_depth(frame, box.scaled(0.5))
    return None if math.isnan(depth) else depth
