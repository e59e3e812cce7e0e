# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A correlation filter that may only look where the target is.

A filter learned from a window sees the background of every cyclic shift as well. Holding it to the
target's silhouette lets the window be large, so that a target may move far between two frames,
without the background being learned. The constraint and its solution by the alternating direction
method of multipliers are those of Lukezic et al., "Discriminative Correlation Filter with Channel
and Spatial Reliability" (CVPR 2017), section 3.2.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import fft

from rgbd_kcf_tracker.arrays import Floats
from rgbd_kcf_tracker.features.labels import gaussian_labels

Spectrum = npt.NDArray[np.complex64]

PENALTY = 5.0
PENALTY_GROWTH = 3.0
PENALTY_MAX = 20.0
"""Weight of the constraint in the solver's first round, by how much it grows from round to round,
and the most that it becomes: those of Lukezic et al. (CVPR 2017, section 3.2) and of their
program."""
ROUNDS = 3
"""Rounds of the solver for each sample: in the last of them that weight is at its most."""
SPARSITY = 0.01
"""Weight of the filter's own size against its fit, that of the same paper; it keeps what the window
does not tell small."""


def spectrum_of(features: Floats) -> Spectrum:
    """What the filter reads of windowed features, ``(channels, size, size)``."""
    spectrum: Spectrum = fft.rfft2(features)
    return spectrum


class MaskedFilter:
    """The filter over ``(channels, size, size)`` features and what it learned.

    Args:
        size: cells along a side of the window.
        sigma: width of the wanted response in cells.
    """

    def __init__(self, size: int, sigma: float) -> None:
        self.size = size
        labels = gaussian_labels((size, size), sigma, np.float32)
        self._label = np.conj(fft.rfft2(labels)).astype(np.complex64)
        self._filter: Spectrum = np.zeros(1, np.complex64)
        self._weights: Floats = np.zeros(1, np.float32)

    def _solved(self, spectrum: Spectrum, mask: Floats) -> Spectrum:
        shape = (self.size, self.size)
        power = (spectrum.real**2 + spectrum.imag**2).astype(np.float32)
        cross = spectrum * self._label
        penalty = np.float32(PENALTY)
        slack = np.float32(SPARSITY)
        # NumPy divides a complex number by a real one several times slower than it multiplies.
        first = fft.irfft2(cross * (1 / (power + slack * penalty)), s=shape)
        masked = fft.rfft2(first * mask)
        multiplier = np.zeros_like(cross)
        for _ in range(ROUNDS):
            free = cross + penalty * masked
            free -= multiplier
            free *= 1 / (power + penalty)
            spatial = fft.irfft2(penalty * free + multiplier, s=shape)
            spatial *= mask / (slack + penalty)
            masked = fft.rfft2(spatial)
            multiplier += penalty * (free - masked)
            penalty = np.float32(min(PENALTY_MAX, PENALTY_GROWTH * float(penalty)))
        result: Spectrum = masked.astype(np.complex64)
        return result

    def learn(self, spectrum: Spectrum, mask: Floats, rate: float) -> None:
        """Take one sample: windowed features with the target in the middle, and its mask.

        Args:
            spectrum: of the features, see :func:`spectrum_of`.
            mask: ``(size, size)`` 0 to 1, where the filter may be other than 0.
            rate: share of the sample in what is remembered; 1 for the first.
        """
        solved = self._solved(spectrum, mask)
        response = fft.irfft2(np.conj(solved) * spectrum, s=(self.size, self.size))
        weights = np.maximum(response.reshape(len(response), -1).max(axis=1), 0)
        weights /= max(float(weights.sum()), 1e-9)
        r = np.float32(rate)
        self._filter = (1 - r) * self._filter + r * solved
        self._weights = (1 - r) * self._weights + r * weights

    def response(self, spectrum: Spectrum) -> Floats:
        """How much each shift of the window looks like the target, ``(size, size)``, cyclic.

        Element 0, 0 stands for the window's middle. About 1 at the peak where all is as learned.

        Args:
            spectrum: as for :meth:`learn`.
        """
        product = np.einsum('chw,c->hw', np.conj(self._filter) * spectrum, self._weights)
        result: Floats = fft.irfft2(product, s=(self.size, self.size))
        return result
