# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How a target has moved and grown from one image to the next, by the flow of its texture.

Corners on the target are found again by optical flow (Lucas and Kanade 1981, in pyramids); those
that the flow back does not bring to where they were are left out, and growth is the median over
pairs of them of how their distance has changed (Kalal et al., "Forward-Backward Error", ICPR 2010).
For targets whose depth is not known: near the camera and at few frames a second they grow by more
than a filter over scale covers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import Floats, Image
from rgbd_kcf_tracker.features.optical_flow import Points, followed
from rgbd_kcf_tracker.features.windows import resampled
from rgbd_kcf_tracker.metric.identity.appearance import MIN_MASK

Posterior = Callable[[Image], Floats]

SIDE, AROUND = 144, 3.0
"""Pixels along a side of the window in which the flow is looked for, and its side in units of the
target's root area: with its own size to spare on each side, the target is 48 pixels wide, as many
as corners of clothes need, and the cost the same at any resolution."""
LONGEST = 0.6
"""Share of a long target's longer side that counts as its root area at the least: the window is
then at least 1.8 times as long as it."""
INNER = 0.9
"""Share of the target's sides inside which corners are taken: at its rim other things show."""
CORNERS, QUALITY, DISTANCE = 60, 0.005, 3
"""Corners at the most, their strength against the strongest one's at the least (Shi and Tomasi,
CVPR 1994), and pixels between two. Clothes have little texture, so weak ones are taken as well, and
close together, as a target is some 48 pixels wide here; those that are none are left out by the
flow back. Sixty make 1770 pairs, which is enough for a median."""
BACK = 1.0
"""Pixels between a corner and where the flow forth and back takes it: what is farther off was found
on something else."""
LEAST_CORNERS, LEAST_SHARE = 8, 0.5
"""Corners that must agree, of fewer of which a median may be chance, and their share of all: no
other motion then has as many."""
AGREE = 2.0
"""Pixels from the common motion within which a corner agrees: a body bends, and its limbs go their
own way."""
LEAST_DISTANCE = 4.0
"""Pixels between two corners, along an axis, from which their distance tells of growth: nearer, the
error of a corner is more than anybody grows from frame to frame."""


@dataclass(frozen=True, slots=True)
class Flow:
    """How a target has moved.

    Attributes:
        dx, dy: of its middle in pixels of the image.
        growth: of its size, 1 for none.
    """

    dx: float
    dy: float
    growth: float


class TextureFlow:
    """The flow of one target's texture. Not to be shared between threads."""

    def __init__(self) -> None:
        self._last: Image | None = None
        self._mask: Image | None = None
        self._cx = self._cy = self._side = 0.0

    def keep(
        self, color: Image, cx: float, cy: float, width: float, height: float, posterior: Posterior
    ) -> None:
        """Take where the target is, for :meth:`since`.

        Args:
            color: ``(H, W, 3)`` uint8 BGR.
            cx: column of the target's middle in pixels.
            cy: row of it.
            width: of the target in pixels.
            height: likewise.
            posterior: how likely each pixel of an image is the target's.
        """
        side = AROUND * max(float(np.sqrt(width * height)), LONGEST * max(width, height))
        window = resampled(color, cx, cy, side, SIDE)
        zoom, middle = SIDE / side, SIDE / 2
        reach = 0.5 * INNER * zoom
        top, bottom = max(0, int(middle - reach * height)), int(middle + reach * height) + 1
        left, right = max(0, int(middle - reach * width)), int(middle + reach * width) + 1
        mask = np.zeros((SIDE, SIDE), np.uint8)
        mine = posterior(window[top:bottom, left:right]) > 0.5
        mask[top:bottom, left:right] = 255 * (mine if mine.mean() > MIN_MASK else 1)
        self._last, self._mask = cv2.cvtColor(window, cv2.COLOR_BGR2GRAY), mask
        self._cx, self._cy, self._side = cx, cy, side

    def forget(self) -> None:
        """Drop what :meth:`keep` took."""
        self._last = None

    def since(self, color: Image) -> Flow | None:
        """How the target has moved since :meth:`keep`, in pixels of the image.

        Args:
            color: ``(H, W, 3)`` uint8 BGR, of the size of that given to :meth:`keep`.

        Returns:
            None where the flow does not tell, or nothing is kept.
        """
        last = self._last
        if last is None:
            return None
        corners = cv2.goodFeaturesToTrack(last, CORNERS, QUALITY, DISTANCE, mask=self._mask)
        if corners is None or len(corners) < LEAST_CORNERS:
            return None
        window = resampled(color, self._cx, self._cy, self._side, SIDE)
        now = cv2.cvtColor(window, cv2.COLOR_BGR2GRAY)
        first, second = _forth_and_back(last, now, corners.reshape(-1, 2))
        least = max(LEAST_CORNERS, LEAST_SHARE * len(corners))
        if len(first) < least:
            return None
        growth = _growth(first, second)
        from_middle = first - np.float32(SIDE / 2)
        moved = second - first - (growth - 1) * from_middle
        shift = np.median(moved, axis=0)
        if np.count_nonzero(np.hypot(*(moved - shift).T) < AGREE) < LEAST_SHARE * len(first):
            return None
        dx, dy = shift * (self._side / SIDE)
        return Flow(float(dx), float(dy), growth)


def _forth_and_back(last: Image, now: Image, corners: Points) -> tuple[Points, Points]:
    """Corners that are found again, ``(n, 2)`` each, where they were and where they are."""
    found, _ = followed(last, now, corners)
    back, again = followed(now, last, found)
    good = again & (np.hypot(*(back - corners).T) < BACK)
    return corners[good], found[good]


def _growth(first: Points, second: Points) -> float:
    """Growth that both axes tell, the less of the two: who crouches comes no nearer."""
    i, j = np.triu_indices(len(first), 1)
    logs = []
    for before, after in zip((first[i] - first[j]).T, (second[i] - second[j]).T, strict=True):
        far = np.abs(before) > LEAST_DISTANCE
        if np.count_nonzero(far) < LEAST_CORNERS:
            return 1.0
        logs.append(float(np.log(max(float(np.median(after[far] / before[far])), 0.1))))
    across, down = logs
    return float(np.exp(min(across, down, key=abs))) if across * down > 0 else 1.0
