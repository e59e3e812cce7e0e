# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Taking the camera's own doing out of the colours: exposure, white balance, and a change of light.

What stands still has the same colours as before; by how much they seem to have changed, each
channel for itself (von Kries), is what has happened to all.
"""

from __future__ import annotations

from functools import reduce

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import Floats, Image, Mask

DARKEST, BRIGHTEST = 12, 243
"""Values between which a channel is neither noise nor saturated."""
LEAST_PIXELS = 60
"""Pixels of the room, at every fifth row and column, from which the light is told: enough that its
median is no chance of one thing that moved."""
STRIDE = 5
"""Rows and columns of which one is read: more than a thousand pixels remain of the view, which is
enough for a median, and neither light nor a camera without colours is told by a single pixel."""
UNCHANGED = 0.02
"""Gain up to which nothing is done: a fraction of one of the levels that colours are told apart
by."""
LARGEST_GAIN = 8.0
"""Three stops of exposure: in a picture that is darker yet, most lies below :data:`DARKEST` and
comes out in steps of eight levels, so that its colours tell nothing."""


class Light:
    """The light of a stream against that of its first frame.

    Attributes:
        gain: ``(3,)`` by which blue, green and red are multiplied.
    """

    def __init__(self) -> None:
        self.gain = np.ones(3)
        self._mean = np.ones(3)
        self._first: Floats | None = None
        self._table: Image | None = None

    def restart(self) -> None:
        """Forget what the room looked like, but not the light: the camera looks elsewhere."""
        self._first = None

    def steadied(self, image: Image, still: Mask, learns: bool = True) -> Image:
        """An image ``(h, w, 3)`` BGR in the light of the first.

        Args:
            image: of the view's size.
            still: ``(h, w)`` bool, the pixels that show the room.
            learns: whether the light is measured whether or not it seems to have changed.
        """
        mean = np.array(cv2.mean(image)[:3]) + 1.0
        if learns or np.abs(mean / self._mean - 1).max() > UNCHANGED:
            self._mean = mean
            self._measure(image, still)
        return self.as_before(image)

    def as_before(self, image: Image) -> Image:
        """An image in the light of the first, if the light is as it was measured last."""
        if self._table is None:
            return image
        result: Image = cv2.LUT(image, self._table)
        return result

    def _measure(self, image: Image, still: Mask) -> None:
        small = image[::STRIDE, ::STRIDE].astype(np.float32)
        if self._first is None:
            self._first = small * self.gain.astype(np.float32)
        else:
            low = reduce(cv2.min, cv2.split(cv2.min(small, self._first)))
            high = reduce(cv2.max, cv2.split(cv2.max(small, self._first)))
            usable = (low > DARKEST) & (high < BRIGHTEST) & still[::STRIDE, ::STRIDE]
            if np.count_nonzero(usable) >= LEAST_PIXELS:
                ratio = np.ascontiguousarray((self._first[usable] / small[usable]).T)
                gain = np.median(ratio, axis=1)  # along memory, in half the time
                self.gain = np.clip(gain, 1 / LARGEST_GAIN, LARGEST_GAIN).astype(np.float64)
                changed = np.abs(self.gain - 1).max() >= UNCHANGED
                levels = np.clip(np.arange(256)[:, None] * self.gain, 0, 255)
                self._table = levels.astype(np.uint8)[None] if changed else None
