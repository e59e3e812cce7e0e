# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a place looked like while the target was at another: if it still does, it is not there."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.perceive.depth_view import part_of

Image = npt.NDArray[np.uint8]

MIDDLE = 0.6
"""Share of a box's sides that is looked at: at its rim other things show."""
OUTSIDE = 0.5
"""Share of it that lies beside where the target was, from which it tells anything."""
UNCHANGED, SAME_COLOR = 0.75, 16
"""Share of these pixels, and levels of their colours, from which a place has not changed: of a
person's box up to half shows what is behind."""


class Elsewhere:
    """Pictures in which the target was surely seen, the first and the last, and where it was.

    The camera must stand still for them to say anything: where it has moved, a place has changed,
    and nothing is refused.
    """

    def __init__(self) -> None:
        self._kept: list[tuple[Image, Box]] = []

    def keep(self, image: Image, box: Box) -> None:
        """Take a picture, ``(h, w, 3)`` uint8 BGR, and where the target is in it, in its pixels."""
        self._kept = [*self._kept[:1], (image, box)]

    def forget(self) -> None:
        """Drop all: the camera has moved."""
        self._kept = []

    def unchanged(self, image: Image, box: Box) -> bool:
        """Whether a box shows what was there while the target was elsewhere.

        Args:
            image: ``(h, w, 3)`` uint8 BGR, of now.
            box: in its pixels.
        """
        part = _part(image, box.scaled(MIDDLE))
        now = image[part]
        for then, place in self._kept:
            if then.shape != image.shape or not now.size:
                continue
            elsewhere = np.ones(image.shape[:2], np.bool_)
            elsewhere[_part(image, place)] = False
            there = elsewhere[part]
            if np.count_nonzero(there) <= OUTSIDE * there.size:
                continue
            change = cv2.absdiff(now, then[part]).max(axis=2)[there]
            if float(np.mean(change < SAME_COLOR)) > UNCHANGED:
                return True
        return False


def _part(image: Image, box: Box) -> tuple[slice, slice]:
    """Rows and columns that a box covers."""
    return part_of(image.shape, box.x, box.y, box.right, box.bottom)
