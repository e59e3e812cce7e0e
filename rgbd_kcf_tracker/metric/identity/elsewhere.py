# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a place looked like while the target was at another: if it still does, it is not there."""

from __future__ import annotations

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import Image, Mask
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.perceive.depth_view import in_box, part_in

MIDDLE = 0.6
"""Share of a box's sides that is looked at: at its rim other things show."""
OUTSIDE = 0.5
"""Share of it that lies beside where the target was, from which it tells anything: the greater part
of it."""
UNCHANGED, SAME_COLOR = 0.75, 16
"""Share of these pixels, and levels of their colours, from which a place has not changed: of a
person's box up to half shows what is behind."""


class Elsewhere:
    """Pictures that tell where the target was not.

    The first and the last in which it was surely seen somewhere else, and the last in which what
    was found was something else.

    The camera must stand still for them to say anything: where it has moved, a place has changed,
    and nothing is refused.
    """

    def __init__(self) -> None:
        # Each with the pixels of which it tells that the target was not there.
        self._kept: list[tuple[Image, Mask]] = []
        self._refused: list[tuple[Image, Mask]] = []

    def keep(self, image: Image, box: Box) -> None:
        """Take a picture, ``(h, w, 3)`` uint8 BGR, and where the target is in it, in its pixels."""
        self._kept = [*self._kept[:1], (image, ~in_box(image.shape, box))]
        self._refused = []

    def refuse(self, image: Image, box: Box) -> None:
        """Take a picture of which a box shows something else than the target.

        Args:
            image: ``(h, w, 3)`` uint8 BGR.
            box: in its pixels.
        """
        self._refused = [(image, in_box(image.shape, box))]

    def forget(self) -> None:
        """Drop all: the camera has moved."""
        self._kept, self._refused = [], []

    def unchanged(self, image: Image, box: Box) -> bool:
        """Whether a box shows what was there while the target was elsewhere.

        Args:
            image: ``(h, w, 3)`` uint8 BGR, of now.
            box: in its pixels.
        """
        part = part_in(image.shape, box.scaled(MIDDLE))
        pictures = self._kept + self._refused
        return any(_same(image, then, part, there) for then, there in pictures)


def _same(now: Image, then: Image, part: tuple[slice, slice], there: Mask) -> bool:
    """Whether a part of a picture shows what it showed, as far as ``there`` tells of it."""
    if then.shape != now.shape:
        return False
    there = there[part]
    if np.count_nonzero(there) <= OUTSIDE * there.size:
        return False
    change = cv2.absdiff(now[part], then[part]).max(axis=2)[there]
    return float(np.mean(change < SAME_COLOR)) > UNCHANGED
