# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What moves before a camera that stands still, told by colour alone.

Where depth says nothing, the backdrop is what has looked the same for some frames while the target
was elsewhere. What differs from it moves, and the piece of that which lies in the target's box is
the target with its arms and legs, which a filter's box of fixed proportions cuts off. What that
piece becomes is the target, whatever it looks like, and so is what comes out where it went. Nothing
is said of what the target has covered since it was chosen, nor once the camera has moved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats, Image, Mask
from rgbd_kcf_tracker.geometry import Box, mask_box
from rgbd_kcf_tracker.metric.perceive.depth_view import closed, grown, in_box, part_in
from rgbd_kcf_tracker.metric.perceive.ego_motion import (
    CREPT,
    LEAST_CORNERS,
    changed,
    corners_between,
    stands,
)

Posterior = Callable[[Image], Floats]

DIFFERS = 14
"""Levels of a channel by which a pixel differs from the backdrop. Of a picture made small by means
over areas, noise is a level or two; a shadow is more, and belongs to who casts it as well as any
rule of colour tells it from dark clothes."""
SAME = DIFFERS // 2
"""Levels up to which a pixel has not changed from one frame to the next: half, so that what creeps
by less than :data:`DIFFERS` in a frame is not learned."""
STABLE = 2
"""Frames in a row without a change after which a pixel is the backdrop: at the pace of a walk none
of somebody's clothes but the plainest stays alike for longer."""
SETTLED = 1.0
"""Seconds without a change after which what differs is the backdrop although no outline tells the
target from it: it was taken for the backdrop while something passed. Of who walks, no clothes stay
where they are for so long."""
CREEPS = 2.0
"""Pixels by which the camera has crept in :data:`CREPT` at the most: from one picture to the next
it moves by a part of a pixel then, and some pictures later every edge differs from the backdrop.
What has moved by more is somebody who passes."""
MARGIN = 1.15
"""Sides of the box, in units of the target's, inside which nothing is learned unless its outline is
known: an arm or a foot sticks out by so much."""
ASIDE, HIGH = 1.2, 1.8
"""Of the part of the picture in which the outline is sought: how much wider than the box, in the
box's heights, and how many times as high. Arms stretched out are as wide as somebody is high, and
the box may have stayed behind."""
LIT = 4
"""Every so many pixels tell of the light: some thousand, enough for a median."""
LEAST_KNOWN = 0.5
"""Share of the pixels between the box's side and the outline that must be known for the box to end
at the outline: most of them."""
OTHERS = 0.15
"""Share of a piece that was another's a frame ago from which two have met: some of it is where the
other had his arm or his shadow."""
GROWN = 1.4
"""Times its area when it was alone above which a piece is still two who have met: two people are
twice as much, and who stretches out an arm has a tenth more."""
TWO = 2.0
"""Times the area of as much of the box as it fills from which a piece is more than one person: who
spreads his arms has a tenth more."""
PARTED = 20
"""Frames in which two who have met may part again, the one hidden by the other between: as long as
somebody takes to pass before another at the pace of a walk and 10 Hz."""
MOSTLY_TOLD = 0.5
"""Share of an outline that must differ from the backdrop for its colours to be the target's own."""
WHOLE = 0.85
"""Times the filter's height from which an outline is all of the target, not a part that shows."""
SPECK = 4
"""Pixels of a piece below which it is noise."""
SLIVER = 0.03
"""Share of an outline up to which a part that only what is not known joins to it is not of it."""
GOES_ON = 0.3
"""Share of the smaller of two pieces in which both must lie for one to be what the other was a
picture ago: of who walks at 10 Hz it is more than half."""
COMES_OUT = 1.5
"""Sides, in units of the last box, inside which comes out who was hidden there: who comes out
elsewhere may be another who was behind the same thing."""
LEAPT = 0.6
"""Share of its area from which a target that is gone by the next picture was not hidden by what
stands still, but has leapt: at 10 Hz nobody is behind a door's post in less than two."""
AS_LARGE = 1.3
"""Times, or parts of, the target's area of a piece that may be the target that has leapt."""


@dataclass(frozen=True, slots=True)
class Outline:
    """The piece of a picture that moves and is the target.

    Attributes:
        box: about it, in pixels of the picture; where the backdrop is not known, the end of the box
            that was asked about.
        cx: column of the middle of those of its pixels that differ from the backdrop.
        told: share of these among all, 0 to 1; the others are the target's by their colours.
    """

    box: Box
    cx: float
    told: float


@dataclass(frozen=True, slots=True)
class Piece:
    """The piece of a picture that moves and is the target by where it was.

    Attributes:
        box: about it, in pixels of the picture.
        share: its area, in units of the target's own.
        alike: how likely its colours are the target's, in units of the target's own.
    """

    box: Box
    share: float
    alike: float


class Backdrop:
    """The colours of what stands still behind one target. Not to be shared between threads.

    Args:
        image: ``(h, w, 3)`` uint8 BGR, the first picture, made small by means over areas.
        box: the target in it, in its pixels.

    Attributes:
        met: whether in the last picture the target and somebody else were one piece, of which the
            target's part is not known.
    """

    def __init__(self, image: Image, box: Box) -> None:
        self._start(image, cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), box)

    def _start(self, image: Image, gray: Image, box: Box) -> None:
        shape = image.shape[:2]
        self._last, self._gray, self._colors = image, gray, image.astype(np.float32)
        self._known, none = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
        self._differs = self._others = self._appeared = self._body = self._was = none
        self._pieces = _pieces(none)
        self._likely = self._share = self._fill = 0.0
        self._told = False
        self._same, self._same_for = np.zeros(shape, np.uint8), np.zeros(shape, np.float32)
        self._area = self._may_part = 0
        self.met = False
        self._mine = in_box(image.shape, box.scaled(MARGIN))
        self._anchor, self._unasked = gray, 0.0

    def see(self, image: Image, box: Box, dt: float) -> None:
        """Take the next picture.

        Args:
            image: ``(h, w, 3)`` uint8 BGR; of another size, all starts again.
            box: where the target last was.
            dt: seconds since the last picture.
        """
        gray = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        self.met = False
        around = in_box(image.shape, box.scaled(MARGIN))
        if (
            image.shape != self._last.shape
            or self._camera_moved(gray, ~around)
            or self._crept(gray, ~around, dt)
        ):
            self._start(image, gray, box)
            return
        self._same += self._same < 255
        self._same_for += np.float32(dt)
        changed_now = cv2.absdiff(image, self._last).max(axis=2) > SAME
        self._same[changed_now] = self._same_for[changed_now] = 0
        self._follow_light(image)
        apart = cv2.absdiff(image, cv2.convertScaleAbs(self._colors)).max(axis=2)
        self._part_in_pieces(self._known & (apart > DIFFERS))
        # Until an outline tells the target from the rest, all that moves may be a part of it.
        self._mine = (self._differs & (self._same_for < SETTLED)) | around
        self._last, self._gray = image, gray

    def learn(self, box: Box) -> None:
        """Take what has not changed for the backdrop, but for the target, which is in ``box``."""
        mine = self._take(box)
        self._others = self._differs & ~mine
        self._appeared = np.zeros_like(mine)

    def miss(self, box: Box) -> None:
        """Take what has not changed for the backdrop; the target, last in ``box``, is hidden."""
        self._take(box)

    def outline(self, box: Box, posterior: Posterior) -> Outline | None:
        """The target's outline in the last picture.

        Args:
            box: where it is by its look.
            posterior: how likely each pixel of an image is the target's by its colour.

        Returns:
            None where nothing moves there, two have met who cannot be told apart, or it is more
            than one person.
        """
        width, height = box.width + ASIDE * box.height, HIGH * box.height
        part = part_in(self._last.shape, Box.from_center(box.cx, box.cy, width, height))
        known, differs = self._known[part], self._differs[part]
        rows, cols = part
        b = box.moved(-cols.start, -rows.start)
        own, about = (part_in(known.shape, each) for each in (b, b.scaled(MARGIN)))
        body = differs.copy()
        likely = posterior(self._last[part][own])
        body[own] |= ~known[own] & (likely > 0.5)
        if not self._told and body[own].any():
            self._likely, self._fill = float(likely[body[own]].mean()), float(body[own].mean())
        if not differs.any():
            return None
        # What goes on behind what the target has covered is a piece of it.
        pieces = _pieces(closed(body | ~known))
        inside = pieces.overlap(about)
        if not inside.any():
            return None
        mine = inside > 0.5 * pieces.areas
        mine[int(np.argmax(inside))] = True
        body &= pieces.mask(mine)
        # A sliver beyond what is not known is what something that passed has left there.
        parts = _pieces(closed(body))
        body &= parts.mask(parts.areas > SLIVER * np.count_nonzero(body))
        bounds = mask_box(body)
        if bounds is None:
            return None
        self.met = self._meets(body, self._others[part])
        if self.met or np.count_nonzero(body) > TWO * self._fill * b.area > 0:
            return None
        self._mine[:] = False
        self._mine[part] = grown(body)
        end = _ended(bounds, b, known)
        told = body & differs
        columns = np.count_nonzero(told, axis=0)
        area = int(columns.sum())
        middle = columns @ np.arange(len(columns)) / max(area, 1) + 0.5
        self._body = np.zeros_like(self._mine)
        self._body[part] = told
        mostly = area > MOSTLY_TOLD * np.count_nonzero(body)
        if mostly and WHOLE < end.height / b.height < 1 / WHOLE:
            self._told = True
            self._likely = _mean(posterior, self._last[part], told)
            self._fill = area / b.area
        self._share = area / max(1.0, self._fill * b.area)
        return Outline(
            end.moved(cols.start, rows.start),
            float(middle) + cols.start,
            area / int(np.count_nonzero(body)),
        )

    def follow(self, box: Box, posterior: Posterior) -> Piece | None:
        """What the target's piece has become in the last picture, or has come out as.

        Args:
            box: all of it, where it was last.
            posterior: how likely each pixel of an image is the target's by its colour.

        Returns:
            None where there is no such piece, or somebody else is in it.
        """
        if not self._fill or not self._likely:
            return None
        areas, whole = self._pieces.areas, max(1.0, self._fill * box.area)
        was = int(np.count_nonzero(self._was))
        mine = self._pieces.overlap(self._was) > GOES_ON * np.minimum(areas, was)
        if not mine.any():
            about = in_box(self._last.shape, box.scaled(COMES_OUT))
            covered = grown(~self._known & about)
            mine = self._pieces.overlap(covered | (self._appeared & about)) > 0
            if self._share > LEAPT:
                larger = areas / whole
                mine |= np.maximum(larger, 1 / np.maximum(larger, 1e-9)) < AS_LARGE
            mine &= self._pieces.overlap(self._others) <= OTHERS * areas
            if not mine.any():
                return None
            largest = int(np.argmax(np.where(mine, areas, 0)))
            mine = np.arange(len(areas)) == largest
        body = self._pieces.mask(mine)
        area = int(np.count_nonzero(body))
        bounds = mask_box(body)
        if bounds is None or np.count_nonzero(body & self._others) > OTHERS * area:
            return None
        self._body, self._share = body, area / whole
        return Piece(bounds, self._share, _mean(posterior, self._last, body) / self._likely)

    # -- parts ------------------------------------------------------------------------------------

    def _part_in_pieces(self, differs: Mask) -> None:
        """Part what differs into pieces, and carry over whose these are."""
        before = grown(self._differs)
        pieces = self._pieces = _pieces(differs)
        self._differs = pieces.mask(pieces.areas > 0)
        others = pieces.overlap(self._others) > OTHERS * pieces.areas
        new = (pieces.overlap(before) == 0) & ~pieces.at_edge
        self._appeared = pieces.mask((new | (pieces.overlap(self._appeared) > 0)) & ~others)
        self._others = pieces.mask(others)
        self._was, self._body = self._body, np.zeros_like(self._body)

    def _take(self, box: Box) -> Mask:
        """Learn what has not changed, but for what may be the target's; the latter is returned."""
        within = in_box(self._last.shape, box.scaled(MARGIN))
        mine = self._mine | within
        self._same[within] = self._same_for[within] = 0
        still = (self._same >= STABLE) & ~mine
        np.copyto(self._colors, self._last, where=still[:, :, None])
        self._known |= still
        return mine

    def _camera_moved(self, gray: Image, outside: Mask) -> bool:
        """Whether the camera has moved, or nothing tells that it has not."""
        if not changed(self._gray, gray, outside):
            return False
        corners = corners_between(self._gray, gray, outside)
        return corners is None or not stands(self._gray, gray, *corners)

    def _crept(self, gray: Image, outside: Mask, dt: float) -> bool:
        """Whether the camera has moved since it was last asked, by too little for any picture."""
        self._unasked += dt
        if self._unasked < CREPT:
            return False
        anchor, self._anchor, self._unasked = self._anchor, gray, 0.0
        corners = corners_between(anchor, gray, outside)
        if corners is None:
            return False
        first, second = corners
        slow = np.abs(second - first).max(axis=1) < CREEPS
        enough = np.count_nonzero(slow) >= LEAST_CORNERS
        return bool(enough) and not stands(anchor, gray, first[slow], second[slow])

    def _follow_light(self, image: Image) -> None:
        """Light that changes changes all alike: the median pixel is what it was."""
        now = image[::LIT, ::LIT].astype(np.float32) + 1
        gain = np.median(now / (self._colors[::LIT, ::LIT] + 1), axis=(0, 1))
        self._colors *= gain.astype(np.float32)

    def _meets(self, body: Mask, others: Mask) -> bool:
        """Whether a piece is the target and somebody else whom it has met."""
        area = int(np.count_nonzero(body))
        if np.count_nonzero(body & grown(others)) > OTHERS * area:
            self._may_part = PARTED
        if self._may_part and area > GROWN * self._area:
            return True
        self._may_part = max(0, self._may_part - 1)
        if not self._may_part:
            self._area = area
        return False


@dataclass(frozen=True, slots=True)
class _Pieces:
    """The connected pieces of a mask, but for specks.

    Attributes:
        labels: ``(h, w)`` int32, of each pixel 0 or the number of its piece.
        areas: ``(n,)`` pixels of each piece, 0 of what is none.
        at_edge: ``(n,)`` whether it reaches the picture's edge.
    """

    labels: npt.NDArray[np.int32]
    areas: npt.NDArray[np.int64]
    at_edge: Mask

    def overlap(self, there: Mask | tuple[slice, slice]) -> npt.NDArray[np.int64]:
        """Pixels of each piece in a mask, or in rows and columns, ``(n,)``."""
        inside = np.bincount(self.labels[there].ravel(), minlength=len(self.areas))
        return np.where(self.areas > 0, inside, 0)

    def mask(self, those: Mask) -> Mask:
        """Where the pieces chosen by ``those``, ``(n,)``, are."""
        return (those & (self.areas > 0))[self.labels]


def _pieces(mask: Mask) -> _Pieces:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    left, top, width, height, areas = stats.T.astype(np.int64)
    rows, cols = mask.shape
    edge = (left == 0) | (top == 0) | (left + width == cols) | (top + height == rows)
    areas = np.where(areas >= SPECK, areas, 0)
    areas[0] = 0
    return _Pieces(labels, areas, edge)


def _mean(posterior: Posterior, image: Image, mask: Mask) -> float:
    """Mean probability of the pixels of a mask, of which there is one at least."""
    return float(posterior(image[mask][:, None]).mean())


def _ended(outline: Box, box: Box, known: Mask) -> Box:
    """The outline's box, but for sides inside of ``box`` that lie in what is not known."""
    left, top, right, bottom = outline.x, outline.y, outline.right, outline.bottom
    if left > box.x and not _mostly(known, box.x, box.y, left, box.bottom):
        left = box.x
    if right < box.right and not _mostly(known, right, box.y, box.right, box.bottom):
        right = box.right
    if top > box.y and not _mostly(known, left, box.y, right, top):
        top = box.y
    if bottom < box.bottom and not _mostly(known, left, bottom, right, box.bottom):
        bottom = box.bottom
    return Box.from_corners(left, top, right, bottom)


def _mostly(known: Mask, left: float, top: float, right: float, bottom: float) -> bool:
    part = known[part_in(known.shape, Box.from_corners(left, top, right, bottom))]
    return part.size > 0 and float(part.mean()) > LEAST_KNOWN
