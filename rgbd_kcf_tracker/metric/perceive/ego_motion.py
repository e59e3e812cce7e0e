# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How the camera itself has moved from one view to the next, told from what stands still.

Corners of the last image are found again in the next by optical flow (Lucas and Kanade 1981, in
pyramids); their depth makes them points, and the motion is the one that projects these points to
where they are found now: least squares over six numbers, by Gauss and Newton, with weights that
leave out whoever walks (Cauchy's).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray, Image, Mask
from rgbd_kcf_tracker.features.optical_flow import followed
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView, grown
from rgbd_kcf_tracker.pose import Pose

Points = npt.NDArray[np.floating]

NEAREST = 0.05
"""Metres ahead of the camera at the least, so that a wild motion divides by nothing."""
CHANGED = 14
CHANGED_SHARE = 0.06
"""Grey values by which a pixel must change to have changed, and the share of such pixels from which
the camera may have moved; sensor noise stays below, and so does one person walking."""
CORNERS = 90
CORNER_QUALITY, CORNER_DISTANCE = 0.01, 6
"""Corners at the most, their strength against the strongest one's at the least (Shi and Tomasi,
CVPR 1994), and pixels of the view between two. A motion has six unknowns and each corner gives two
equations, so ninety are plenty even where half are on somebody; the distance spreads them over the
view, as one poster would not tell a turn from a step aside."""
CELL = 24
"""Pixels of a side of the squares of the view that speak with one voice, however many corners each
has: about a tenth of its width, so that a checked shirt says no more than the wall around it."""
BESIDE = 2
"""Pixels beside what may move by itself within which no corner is taken: half the square about a
corner that makes it one, and a pixel by which outlines are off."""
LEAST_CORNERS = 12
LEAST_AGREEING = 0.4
"""Corners that must agree on a motion for it to be believed, four times as many equations as it has
unknowns, and their share of all: people may fill half of the view, and where it shows hardly
anything, noise has corners, too."""
AGREE = 1.5
"""Pixels of the view within which a corner agrees: flow is good to a part of one, and a corner's
depth may be that of either side of an edge."""
ITERATIONS = 8
"""Rounds of fitting. In the first four the pixels within which a corner counts fall from 4 to 0.7,
so that those on somebody who walks come to count little; four more at that settle the motion."""
FAR = 4.0
"""Pixels of the view by which corners move before a camera that turns fast: from standing still the
fit of :data:`ITERATIONS` hardly finds that, as it begins with this scale."""
PACE, SHORTEST = 1.0, 0.03
"""Metres a second at which a camera is mostly carried or driven at the most, of which its step is
taken to be a deviation; and seconds that it has for that at the least, whatever the stamps say."""
STILL, LEAST_STILL = 0.3, 0.35
"""Pixels of flow up to which a corner stands still, and their share of the view from which the
camera does: somebody may have stepped before the others."""
MANY, HARDLY = 36, 0.05
"""Corners from which, and the share of them that stands still below which, the camera has moved for
good, also where depth agrees, as before a wall."""
CREPT, FORGOTTEN = 0.3, 0.6
"""Seconds after which it is asked whether a camera that seems to stand has crept, and seconds for
which the picture is kept with which that is told: a robot that drives through a hall at the pace of
a walk moves what is ahead by a part of a pixel a frame, and in half a second by some."""
ASKED = 0.08
"""Seconds after which it is asked at once where the picture has changed: at 30 Hz a camera that
turns by half a radian a second hardly changes it from one frame to the next."""
FAST = 0.045
"""Seconds between frames below which that is asked after the answer, and told a frame later."""
STANDS = 3.0
"""Seconds for which that is asked in every frame once it has crept."""
CREEPS, CREEPING = 0.7, 0.15
"""Pixels by which a corner has moved for good, thrice what flow is uncertain by, and the share of
the view in which corners must have, as the motion tells: what is far ahead of a robot hardly moves.
That corners agree is little where the motion is as small: those that stand still do, too."""
LEAST_CREEPING = LEAST_CORNERS // 2
"""Corners of these at the least: as many equations as a motion has unknowns, twice."""


@dataclass(frozen=True, slots=True)
class Lost:
    """The camera has moved, and nothing tells how.

    Attributes:
        surely: whether the picture says so for good: of many corners hardly any is where it was.
    """

    surely: bool = False


@dataclass(slots=True)
class _Anchor:
    """A picture from which a camera has not moved, as far as is known.

    Attributes:
        gray: ``(h, w)`` uint8.
        view: the depth.
        others: ``(h, w)`` bool, pixels that show what may move by itself.
        age: seconds since.
        corners: ``(n, 2)`` float32 of what stands there; None until they are looked for.
    """

    gray: Image
    view: DepthView
    others: Mask
    age: float = 0.0
    corners: Points | None = None


class EgoMotion:
    """Tells the motion of one stream's camera."""

    def __init__(self) -> None:
        self._gray: Image | None = None
        self._view: DepthView | None = None
        self._anchor: _Anchor | None = None
        self._asks = False
        self._unasked = 0.0
        self._since_crept = math.inf

    def update(
        self, image: Image, view: DepthView, others: Mask, seconds: float
    ) -> Pose | Lost | None:
        """The motion since the last view: the pose of the last camera's frame in that of now.

        Args:
            image: ``(h, w, 3)`` BGR at the view's resolution.
            view: the depth.
            others: ``(h, w)`` bool, pixels of the last view that showed what may move by itself.
            seconds: since the last view.

        Returns:
            None where the camera stands still, or creeps by less than can be told yet: that is
            told later, of all the time since it stood.
        """
        gray = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        last, last_view = self._gray, self._view
        self._gray, self._view = gray, view
        self._asks = False
        if last is None or last_view is None or last.shape != gray.shape:
            self._anchor = None
            return None
        motion = _told(last, last_view, gray, others, seconds) if changed(last, gray) else None
        self._since_crept += seconds
        self._unasked += seconds
        if motion is not None:
            self._anchor = None
            return motion
        if self._anchor is None or self._anchor.age > FORGOTTEN:
            self._anchor = _Anchor(last, last_view, others)
            self._unasked = seconds
        self._anchor.age += seconds
        stood = self._since_crept > STANDS
        if stood and self._unasked < CREPT and not self._turns(gray, others):
            return None
        if stood and seconds < FAST:
            self._asks = True
            return None
        self._unasked = 0.0
        crept = _crept(self._anchor, gray)
        if crept is not None:
            self._anchor, self._since_crept = None, 0.0
        return crept

    def _turns(self, gray: Image, others: Mask) -> bool:
        """Whether a camera seems to have moved since it stood, though from no frame to the next."""
        if self._anchor is None or self._unasked < ASKED:
            return False
        return changed(self._anchor.gray, gray, ~(self._anchor.others | others))

    def settle(self) -> None:
        """Ask whether a camera that stood creeps, so that the next :meth:`update` tells how far.

        Apart from it where frames come fast, as an answer need not wait for that.
        """
        if not self._asks or self._anchor is None or self._gray is None:
            return
        self._asks, self._unasked = False, 0.0
        if _crept(self._anchor, self._gray) is not None:
            self._since_crept = 0.0


def changed(last: Image, gray: Image, among: Mask | None = None) -> bool:
    """Whether so much of a picture has changed that its camera may have moved.

    Args:
        last: ``(h, w)`` uint8, the picture before.
        gray: that of now.
        among: ``(h, w)`` bool, the pixels that are asked; all without.
    """
    change = cv2.absdiff(gray[::2, ::2], last[::2, ::2])
    asked = change.size if among is None else np.count_nonzero(among[::2, ::2])
    least = max(CHANGED_SHARE * asked, 1)
    # Where so few change at all, fewer do beyond what most of the picture does.
    if np.count_nonzero(change > CHANGED) < min(least, change.size / 2):
        return False
    # A change of light changes all alike and is no motion.
    change = cv2.absdiff(change, np.full_like(change, upper_median(change)))
    moved = change > CHANGED
    if among is not None:
        moved &= among[::2, ::2]
    return bool(np.count_nonzero(moved) >= least)


def corners_between(last: Image, gray: Image, usable: Mask) -> tuple[Points, Points] | None:
    """Corners of a picture, and where they are in the next, ``(n, 2)`` each.

    Args:
        last: ``(h, w)`` uint8, the picture before.
        gray: that of now.
        usable: ``(h, w)`` bool, where corners are taken.

    Returns:
        None where there are too few.
    """
    corners = _corners(last, usable)
    if len(corners) < LEAST_CORNERS:
        return None
    found, good = followed(last, gray, corners)
    return corners[good], found[good]


def _corners(gray: Image, usable: Mask) -> Points:
    """The strongest corners of a picture, ``(n, 2)`` float32, where they are usable."""
    corners = cv2.goodFeaturesToTrack(
        gray, CORNERS, CORNER_QUALITY, CORNER_DISTANCE, mask=usable.astype(np.uint8) * 255
    )
    return np.zeros((0, 2), np.float32) if corners is None else corners.reshape(-1, 2)


def stands(last: Image, gray: Image, first: Points, second: Points) -> bool:
    """Whether the camera stands still, by where corners are in two pictures.

    A camera that sets its exposure anew, as somebody steps before it, moves every corner by a part
    of a pixel: they are followed once more in the light of the first picture.

    Args:
        last: ``(h, w)`` uint8, the picture before.
        gray: that of now.
        first: ``(n, 2)`` the corners in that before.
        second: ``(n, 2)`` where they are now.
    """
    if _still(first, second):
        return True
    if len(first) < LEAST_CORNERS:
        return False
    few = np.s_[::4, ::4]
    gain = float(np.median(last[few] / np.maximum(gray[few], 1.0)))
    found, good = followed(last, cv2.convertScaleAbs(gray, alpha=gain), first.astype(np.float32))
    return _still(first[good], found[good])


def _still(first: Points, second: Points) -> bool:
    still = _stood(first, second)
    return int(np.count_nonzero(still)) >= LEAST_CORNERS and _share(still, first) >= LEAST_STILL


def _stood(first: Points, second: Points) -> Mask:
    """Which corners are where they were, ``(n,)`` bool."""
    stood: Mask = np.abs(second - first).max(axis=1) < STILL
    return stood


def upper_median(values: Image) -> int:
    """The upper median: of bytes, counting them is a quarter of the time of ``np.median``."""
    below = np.bincount(values.ravel(), minlength=256).cumsum()
    return int(np.searchsorted(below, values.size // 2, side='right'))


def _told(
    last: Image, last_view: DepthView, gray: Image, others: Mask, seconds: float
) -> Pose | Lost | None:
    corners = corners_between(last, gray, _usable(last_view, others))
    if corners is None or len(corners[0]) < LEAST_CORNERS:
        return Lost()
    first, second = (points.astype(np.float64) for points in corners)
    if stands(last, gray, first, second):
        return None
    motion = _agreed(first, second, last_view, seconds)
    if motion is None:
        stood = int(np.count_nonzero(_stood(first, second)))
        lost = Lost(surely=len(first) >= MANY and stood < HARDLY * len(first))
        # What has left the view is found anywhere, and from there nothing leads back.
        back, found = followed(gray, last, second.astype(np.float32))
        leads = found & (np.abs(back - first).max(axis=1) < AGREE)
        first, second = first[leads], second[leads]
        motion = _agreed(first, second, last_view, seconds)
        if motion is None:
            return lost
    # Else what moved is somebody, or too little of it is known yet.
    return motion if _bears_out(motion, first, second, last_view) else None


def _crept(anchor: _Anchor, gray: Image) -> Pose | None:
    """The motion since a picture where corners that have moved for good bear it out."""
    if anchor.corners is None:
        anchor.corners = _corners(anchor.gray, _usable(anchor.view, anchor.others))
    if len(anchor.corners) < LEAST_CORNERS:
        return None
    found, good = followed(anchor.gray, gray, anchor.corners)
    first, second = anchor.corners[good].astype(np.float64), found[good].astype(np.float64)
    if not _have_moved(_lengths(second - first) > CREEPS, first):
        return None
    motion = _agreed(first, second, anchor.view, anchor.age)
    agreed = motion is not None and _bears_out(motion, first, second, anchor.view)
    return motion if agreed else None


def _bears_out(motion: Pose, first: FloatArray, second: FloatArray, view: DepthView) -> bool:
    """Whether corners that have moved for good bear a motion out, more than others deny it.

    Args:
        motion: of the camera.
        first: ``(n, 2)`` the corners in the picture before.
        second: ``(n, 2)`` where they are now.
        view: the depth before.
    """
    off = _lengths(_projected(motion.of(_points(first, view)), view.intrinsics) - second)
    moved = _lengths(second - first)
    told, denied = (moved > CREEPS) & (off < 0.5 * moved), (off > CREEPS) & (moved < 0.5 * off)
    return _have_moved(told, first) and _share(told, first) > _share(denied, first)


def _have_moved(which: Mask, corners: FloatArray) -> bool:
    """Whether there are enough corners that have moved for good."""
    return int(np.count_nonzero(which)) >= LEAST_CREEPING and _share(which, corners) >= CREEPING


def _share(which: Mask, corners: Points) -> float:
    """Share of the view, as far as it has corners, that some of its corners stand for, 0 to 1.

    Args:
        which: ``(n,)`` bool, those.
        corners: ``(n, 2)`` all of them.
    """
    across, down = (corners / CELL).astype(np.intp).T
    cell = down * (across.max(initial=0) + 1) + across
    weights = 1 / np.bincount(cell)[cell]
    return float(weights[which].sum() / weights.sum())


def _usable(view: DepthView, others: Mask) -> Mask:
    """Pixels, ``(h, w)`` bool, that have depth and lie beside nothing that may move by itself."""
    return (view.depth > 0) & ~grown(others, 2 * BESIDE + 1)


def _lengths(steps: FloatArray) -> FloatArray:
    """Of steps of ``(n, 2)`` pixels, ``(n,)``."""
    lengths: FloatArray = np.hypot(*steps.T)
    return lengths


def _points(pixels: FloatArray, view: DepthView) -> FloatArray:
    """Pixels of a view, ``(n, 2)``, as points of its camera in metres, ``(n, 3)``."""
    k = view.intrinsics
    z = view.depth[pixels[:, 1].astype(int), pixels[:, 0].astype(int)].astype(np.float64)
    return np.stack(((pixels[:, 0] - k.cx) * z / k.fx, (pixels[:, 1] - k.cy) * z / k.fy, z), axis=1)


def _projected(points: FloatArray, k: Intrinsics) -> FloatArray:
    """Points in metres, ``(n, 3)``, as pixels, ``(n, 2)``."""
    x, y, z = points.T
    z = np.maximum(z, NEAREST)
    return np.stack((x * k.fx / z + k.cx, y * k.fy / z + k.cy), axis=1)


def _agreed(first: FloatArray, second: FloatArray, view: DepthView, seconds: float) -> Pose | None:
    """The motion that most corners agree on, None where they are not enough.

    It is fitted from standing still, and where they have gone far also from the turn that most of
    them tell: from either a fit may end where only some agree.

    Args:
        first: ``(n, 2)`` the corners in the picture before.
        second: ``(n, 2)`` where they are now.
        view: the depth before.
        seconds: between the two.
    """
    if len(first) < LEAST_CORNERS:
        return None
    points, k = _points(first, view), view.intrinsics
    starts = [np.zeros(3)]
    right, down = np.median(second - first, axis=0).tolist()
    if math.hypot(right, down) > FAR:
        starts.append(np.array([-down / k.fy, right / k.fx, 0.0]))
    least, most = max(LEAST_CORNERS, LEAST_AGREEING * len(points)), 0
    best: Pose | None = None
    for start in starts:
        motion = _fitted(points, second, k, start, seconds)
        off = _lengths(_projected(motion.of(points), k) - second)
        agreeing = int(np.count_nonzero(off < AGREE))
        if agreeing >= least and agreeing > most:
            best, most = motion, agreeing
    return best


def _fitted(
    points: FloatArray, pixels: FloatArray, k: Intrinsics, start: FloatArray, seconds: float
) -> Pose:
    """The motion that projects points ``(n, 3)`` to pixels ``(n, 2)``, from a first turn on.

    Before a wall alone a step aside is as good as a turn: it is the likelier the smaller it is.
    """
    rotation, shift = cv2.Rodrigues(start)[0], np.zeros(3)
    scale, prior = FAR, np.zeros(6)
    for _ in range(ITERATIONS):
        x, y, z = rotation @ points.T + shift[:, None]
        near = 1 / np.maximum(z, NEAREST)
        x, y, zero = x * near, y * near, np.zeros_like(near)
        across, down = k.fx * x + k.cx - pixels[:, 0], k.fy * y + k.cy - pixels[:, 1]
        weight = 1 / (1 + (across**2 + down**2) / scale**2)
        # Of the projection by a small turn (three) and shift (three) of the moved points.
        du = k.fx * np.stack((-x * y, 1 + x**2, -y, near, zero, -x * near), axis=1)
        dv = k.fy * np.stack((-1 - y**2, x * y, x, zero, near, -y * near), axis=1)
        jacobian = np.concatenate((du, dv))
        weights = np.concatenate((weight, weight))
        residual = np.concatenate((across, down))
        weighted = (jacobian * weights[:, None]).T
        prior[3:] = (scale / (PACE * max(seconds, SHORTEST))) ** 2
        pull = weighted @ residual + prior * np.concatenate((np.zeros(3), shift))
        step = np.linalg.solve(weighted @ jacobian + np.diag(prior + 1e-6), -pull)
        turn, _ = cv2.Rodrigues(step[:3])
        rotation = turn @ rotation
        shift = turn @ shift + step[3:]
        scale = max(0.7, scale * 0.6)
    return Pose(rotation, shift)
