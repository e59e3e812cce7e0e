# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What stands still: the farthest that was seen steadily along each pixel, and what is before it.

Whatever is nearer than the room is somebody, or something that was moved. The room is learned while
it is used: a place that turns out to be farther was hidden by somebody, and what comes to stand
still and belongs to nobody becomes part of the room.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

DepthArray = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]

NOISE = 0.08
NOISE_PER_SQUARE_METRE = 0.012
"""Metres by which readings of the same place differ: three deviations of a structured-light
camera's noise, which grows with the square of depth (Khoshelham and Elberink 2012), and the shift
of outlines between depth and colour."""
BLIND_FRAMES = 3
"""Frames without a reading after which a pixel is known to have none: a reading there is new."""
BLEND = 0.1
"""Share of a new reading in the room's depth."""
SETTLE = 3.0
"""Seconds for which something that is nobody's must have stood still to become part of the room."""
LEAP, LEAP_PER_SECOND = 0.2, 1.5
"""Metres by which the depth of a person goes up from one frame to the next at the most; where it
goes up by more he has gone, and what shows is the room behind him."""


def tolerance(depth: DepthArray) -> DepthArray:
    """Metres by which a reading may differ from another of the same place, ``(h, w)``."""
    allowed: DepthArray = np.square(depth)
    allowed *= np.float32(NOISE_PER_SQUARE_METRE)
    allowed += np.float32(NOISE)
    return allowed


class Room:
    """The room as one view sees it.

    Attributes:
        depth: ``(h, w)`` float32 metres of the room, 0 where it is not known.
        before: ``(h, w)`` bool, the pixels of the last frame that show something before the room.
    """

    def __init__(self) -> None:
        self.depth: DepthArray = np.zeros((0, 0), np.float32)
        self.before: Mask = np.zeros((0, 0), np.bool_)
        self._farther: DepthArray = self.depth
        self._front: DepthArray = self.depth
        self._blind: npt.NDArray[np.uint8] = np.zeros((0, 0), np.uint8)
        self._still: DepthArray = self.depth
        self._still_for: DepthArray = self.depth

    def restart(self, depth: DepthArray, somebody: Mask) -> None:
        """Take a first view, ``(h, w)`` metres, all of which is room but ``somebody``."""
        self.depth = np.where(somebody, np.float32(0), depth)
        self.before = somebody & (depth > 0)
        self._farther = np.zeros_like(depth)
        self._blind = np.where(somebody, np.uint8(BLIND_FRAMES), np.uint8(0))
        self._still, self._still_for = np.zeros_like(depth), np.zeros_like(depth)
        self._front = np.where(somebody, depth, np.float32(0))

    def open(self, somebody: Mask, depth: DepthArray) -> None:
        """Take pixels, ``(h, w)`` bool, out of the room: they turned out to be somebody."""
        self.depth[somebody] = 0
        self._blind[somebody] = BLIND_FRAMES
        self._front[somebody] = depth[somebody]
        self.before |= somebody & (depth > 0)

    def update(self, depth: DepthArray, dt: float, somebody: Mask | None) -> None:
        """Compare the next view with the room and learn from it.

        Args:
            depth: ``(h, w)`` metres, 0 where there is no reading; of the size of the first.
            dt: seconds since the last.
            somebody: ``(h, w)`` bool, pixels that belonged to somebody in the last view, who may
                stand still for as long as he likes; None for nobody.
        """
        valid = depth > 0
        known = self.depth > 0
        allowed = tolerance(depth)
        nearer = self.depth - depth
        both = valid & known
        before = both & (nearer > allowed)
        open_ = valid & ~known & (self._blind >= BLIND_FRAMES)
        leap = np.float32(LEAP + LEAP_PER_SECOND * min(dt, 1.0)) + allowed
        left = open_ & (self._front > 0) & (depth > self._front + leap)
        open_ &= ~left
        before |= open_
        np.copyto(self._front, depth, where=open_)
        farther = both & (nearer < -allowed)
        again = farther & (np.abs(depth - self._farther) <= allowed)
        same = both & ~before & ~farther
        self.depth[same] -= np.float32(BLEND) * nearer[same]
        self.depth[again] = depth[again]
        self._farther = np.where(farther, depth, np.float32(0))
        self._blind[left] = 0
        unknown = ~known
        fresh = unknown & valid & ~before
        self.depth[fresh] = depth[fresh]
        unknown &= ~valid
        self._blind[unknown] = np.minimum(self._blind[unknown], 250) + 1
        self.before = before
        self._settle(depth, dt, allowed, somebody)

    def _settle(
        self, depth: DepthArray, dt: float, allowed: DepthArray, somebody: Mask | None
    ) -> None:
        still = self.before & (np.abs(depth - self._still) <= np.float32(0.5) * allowed)
        if somebody is not None:
            still &= ~somebody
        self._still = np.where(self.before & ~still, depth, self._still)
        self._still_for += np.float32(dt)
        self._still_for *= still
        settled = self._still_for > SETTLE
        if settled.any():
            self.depth[settled] = depth[settled]
            self.before &= ~settled
