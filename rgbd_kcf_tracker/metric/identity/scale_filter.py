# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How much larger or smaller the target has become, from its look alone.

A correlation filter over scale: Danelljan et al., "Accurate Scale Estimation for Robust Visual
Tracking" (BMVC 2014), section 3.2. For targets whose depth is not known.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from scipy import fft

from rgbd_kcf_tracker.arrays import Floats, Image
from rgbd_kcf_tracker.features.hog import CELL_SIZE, CHANNELS, HogExtractor
from rgbd_kcf_tracker.features.labels import gaussian_labels
from rgbd_kcf_tracker.features.windows import sampled

SCALE_STEP = 1.02
"""Factor between two sizes, as in the paper: finer ones cannot be told apart."""
COUNT = 17
"""Sizes, half of the paper's 33 and half of the time: up to 17 % larger or smaller from one frame
to the next, which covers at 10 Hz who comes at 1.5 m/s and is farther than 1.1 m."""
AREA = 512.0
"""Pixels to which the target is brought for each size, as in the program of the paper's authors:
the outline is what tells the size, and it shows there."""
REGULARIZATION = 0.01
"""Added to the energy of all samples, as in the paper: the filter is not to answer to frequencies
that hardly occur."""


class ScaleFilter:
    """A filter over ``COUNT`` sizes about the last one.

    Args:
        width: of the target in pixels when it was first seen.
        height: likewise.
    """

    def __init__(self, width: float, height: float) -> None:
        aspect = width / height
        self._rows = max(2, round(np.sqrt(AREA / aspect) / CELL_SIZE)) * CELL_SIZE
        self._cols = max(2, round(np.sqrt(AREA * aspect) / CELL_SIZE)) * CELL_SIZE
        self._hog = HogExtractor(self._rows * COUNT, self._cols)
        steps = np.arange(COUNT) - COUNT // 2
        self._factors = SCALE_STEP ** steps.astype(float)
        label = gaussian_labels((COUNT,), 0.25 * np.sqrt(COUNT))
        self._label = np.conj(fft.rfft(label)).astype(np.complex64)
        self._window = np.hanning(COUNT + 2)[1:-1].astype(np.float32)
        self._numerator: npt.NDArray[np.complex64] = np.zeros(1, np.complex64)
        self._denominator: Floats = np.zeros(1, np.float32)

    def _spectrum(
        self, color: Image, cx: float, cy: float, width: float, height: float
    ) -> npt.NDArray[np.complex64]:
        rows, cols = color.shape[:2]
        reach = 0.5 * self._factors[-1] * max(width, height) + 4
        left, top = int(np.clip(cx - reach, 0, cols - 1)), int(np.clip(cy - reach, 0, rows - 1))
        right = int(np.clip(cx + reach + 1, left + 1, cols))
        bottom = int(np.clip(cy + reach + 1, top + 1, rows))
        gray = cv2.cvtColor(np.ascontiguousarray(color[top:bottom, left:right]), cv2.COLOR_BGR2GRAY)
        shrink = max(1.0, min(width / self._cols, height / self._rows) / 1.5)
        if shrink > 1.3:
            size = (max(1, round(gray.shape[1] / shrink)), max(1, round(gray.shape[0] / shrink)))
            fx, fy = size[0] / gray.shape[1], size[1] / gray.shape[0]
            gray = cv2.resize(gray, size, interpolation=cv2.INTER_AREA)
        else:
            fx = fy = 1.0
        stack = np.empty((self._rows * COUNT, self._cols), np.uint8)
        u, v = (cx - left) * fx, (cy - top) * fy
        for i, factor in enumerate(self._factors):
            scale = self._cols / (width * factor * fx), self._rows / (height * factor * fy)
            stack[i * self._rows : (i + 1) * self._rows] = sampled(
                gray, u, v, scale, (self._cols, self._rows)
            )
        cells = (self._rows // CELL_SIZE, self._cols // CELL_SIZE)
        hog = self._hog(stack).reshape(CHANNELS, COUNT, *cells)
        samples = hog.transpose(0, 2, 3, 1).reshape(-1, COUNT) * self._window
        result: npt.NDArray[np.complex64] = fft.rfft(samples, axis=1).astype(np.complex64)
        return result

    def learn(
        self, color: Image, cx: float, cy: float, width: float, height: float, rate: float
    ) -> None:
        """Take one sample of the target, centred at ``cx, cy`` with that size in pixels.

        ``rate`` is its share in what is remembered, 1 for the first.
        """
        spectrum = self._spectrum(color, cx, cy, width, height)
        energy = (spectrum.real**2 + spectrum.imag**2).sum(axis=0)
        r = np.float32(rate)
        self._numerator = self._numerator + r * (self._label * spectrum - self._numerator)
        self._denominator = self._denominator + r * (energy - self._denominator)

    def factor(self, color: Image, cx: float, cy: float, width: float, height: float) -> float:
        """By how much the target's size has changed from ``width`` x ``height``."""
        spectrum = self._spectrum(color, cx, cy, width, height)
        match = (np.conj(self._numerator) * spectrum).sum(axis=0)
        response = fft.irfft(match / (self._denominator + REGULARIZATION), n=COUNT)
        return float(self._factors[int(np.argmax(fft.fftshift(response)))])
