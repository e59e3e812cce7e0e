# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a correlation filter reads in a square window of the image."""

from __future__ import annotations

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import Floats, Image
from rgbd_kcf_tracker.features.hog import CELL_SIZE, HogExtractor

COLOR_WEIGHT = 0.4
"""Most that a colour channel can be: as much as one of the orientations, which are half the sum of
four values cut off at 0.2, so that colour and shape count alike."""
CHROMA_SLOPE = 0.05
"""Of the tanh over chroma, for each of its 8-bit levels from grey. Twenty levels are three quarters
of the most that it gives: clothes have little tint, and a vivid one is not to outweigh all else."""
COLOR_CHANNELS = 5
"""Lightness, and two for each axis of chroma: a filter's channel tells how much there is of a
colour, so that the two ends of an axis, as red and green, need one each."""


class PatchFeatures:
    """HOG and colour of windows of one size. Not to be shared between threads.

    Args:
        cells: along a side of the window.
    """

    def __init__(self, cells: int) -> None:
        self.cells = cells
        self.pixels = cells * CELL_SIZE
        self._hog = HogExtractor(self.pixels, self.pixels)
        line = np.sin(np.pi * (np.arange(cells) + 0.5) / cells) ** 2
        self._window = np.outer(line, line).astype(np.float32)
        self._chroma = np.tanh((np.arange(256) - 128.0) * CHROMA_SLOPE).astype(np.float32)

    def __call__(self, window: Image) -> Floats:
        """The features of a ``(pixels, pixels, 3)`` window, ``(31 + 5, cells, cells)`` float32.

        31 channels of fHOG; lightness, and the positive and negative parts of the two chroma axes
        of CIE Lab, which saturate so that a vivid colour does not outweigh all else; all of it
        under a cosine window.
        """
        hog = self._hog(cv2.cvtColor(window, cv2.COLOR_BGR2GRAY))
        small = cv2.resize(window, (self.cells, self.cells), interpolation=cv2.INTER_AREA)
        lab = cv2.cvtColor(small, cv2.COLOR_BGR2LAB)
        features = np.empty((len(hog) + COLOR_CHANNELS, self.cells, self.cells), np.float32)
        features[: len(hog)] = hog
        color = features[len(hog) :]
        np.multiply(lab[:, :, 0], np.float32(1 / 255), out=color[0])
        color[0] -= np.float32(0.5)
        for axis in (1, 2):
            chroma = self._chroma[lab[:, :, axis]]
            np.maximum(chroma, 0, out=color[2 * axis - 1])
            np.maximum(-chroma, 0, out=color[2 * axis])
        color *= np.float32(COLOR_WEIGHT)
        features *= self._window
        return features
