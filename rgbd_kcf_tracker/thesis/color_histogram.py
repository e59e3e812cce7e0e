# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Kernel-weighted colour histograms of many regions at once, and how far apart they are.

Thesis section 5.3.1 and appendix D: each pixel counts for the colour bin that it falls in, the more
the nearer it lies to the region's centre (Epanechnikov profile), and histograms are compared by the
Bhattacharyya distance. A region is looked at on a fixed grid of points, whatever its size, so that
hundreds of particles cost a few array operations.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Float = npt.NDArray[np.floating[Any]]

_ROWS, _COLS = 14, 8


def epanechnikov(r: Float) -> Float:
    """The profile ``1 - r^2`` inside the unit circle, 0 outside (thesis section 5.3.1)."""
    weight: Float = np.where(r < 1, 1 - r**2, 0.0)
    return weight


def bhattacharyya_distance(p: Float, q: Float) -> Float:
    """``sqrt(1 - sum sqrt(p q))`` over the last axis: 0 for equal histograms, 1 for disjoint ones.

    The thesis says that a large distance means similar; by its own formula it is the small one.
    """
    coefficient = np.sqrt(p * q).sum(axis=-1)
    distance: Float = np.sqrt(np.clip(1 - coefficient, 0, 1))
    return distance


class ColorHistogram:
    """Makes histograms of image regions over a joint grid of colour bins.

    Args:
        bins: per channel; the histogram has ``bins ** 3`` entries.
    """

    def __init__(self, bins: int) -> None:
        self._bins = bins
        dy = (np.arange(_ROWS) + 0.5) / _ROWS * 2 - 1
        dx = (np.arange(_COLS) + 0.5) / _COLS * 2 - 1
        weight = epanechnikov(np.hypot(dy[:, None], dx[None, :]))
        row, col = np.nonzero(weight)
        # Offsets from the region's centre, in its full width and height.
        self._dy, self._dx = dy[row] / 2, dx[col] / 2
        self._weight = weight[row, col] / weight.sum()
        self._bin_of = (np.arange(256) * bins // 256).astype(np.int64)

    def __call__(self, color: npt.NDArray[np.uint8], regions: Float) -> npt.NDArray[np.float64]:
        """Histograms of regions, each summing to the weighted share of it inside the image.

        Args:
            color: ``(H, W, 3)`` uint8.
            regions: ``(n, 4)`` x, y, width, height in pixels.

        Returns:
            ``(n, bins ** 3)``.
        """
        x, y, width, height = (column[:, None] for column in np.asarray(regions, np.float64).T)
        rows = np.floor(y + height * (0.5 + self._dy)).astype(np.int64)
        cols = np.floor(x + width * (0.5 + self._dx)).astype(np.int64)
        inside = (rows >= 0) & (rows < color.shape[0]) & (cols >= 0) & (cols < color.shape[1])
        np.clip(rows, 0, color.shape[0] - 1, out=rows)
        np.clip(cols, 0, color.shape[1] - 1, out=cols)
        binned = self._bin_of[color[rows, cols]]
        size = self._bins**3
        index = (binned[..., 0] * self._bins + binned[..., 1]) * self._bins + binned[..., 2]
        index += np.arange(len(regions))[:, None] * size
        weights = np.where(inside, self._weight, 0.0)
        counts = np.bincount(index.ravel(), weights.ravel(), minlength=len(regions) * size)
        histograms: npt.NDArray[np.float64] = counts.astype(np.float64, copy=False)
        return histograms.reshape(len(regions), size)
