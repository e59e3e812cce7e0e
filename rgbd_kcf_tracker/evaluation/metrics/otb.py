# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Object Tracking Benchmark: precision and success curves with their exact binning.

Source: Wu, Lim and Yang, "Online Object Tracking: A Benchmark", CVPR 2013, and the bins of its
toolkit: 21 overlap thresholds compared with ``>``, 51 pixel thresholds compared with ``<=``.
"""

from __future__ import annotations

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask

OVERLAP_THRESHOLDS: FloatArray = np.arange(21) / 20.0
"""0, 0.05, ..., 1."""

PIXEL_THRESHOLDS: FloatArray = np.arange(51, dtype=np.float64)
"""0, 1, ..., 50 pixels."""

PRECISION_BIN = 20
"""The bin whose value stands for the whole precision curve: 20 pixels."""


def success_curve(overlaps: FloatArray) -> FloatArray:
    """``(21,)`` share of frames whose IoU is above each threshold.

    Args:
        overlaps: ``(N,)`` IoU of the frames that count; NaN (no box) is never above.
    """
    return _shares(np.nan_to_num(overlaps, nan=-1.0)[:, None] > OVERLAP_THRESHOLDS, 21)


def precision_curve(errors: FloatArray) -> FloatArray:
    """``(51,)`` share of frames whose centre error is at most each threshold.

    Args:
        errors: ``(N,)`` centre error in pixels of the frames that count; NaN (no box) is outside.
    """
    return _shares(np.nan_to_num(errors, nan=np.inf)[:, None] <= PIXEL_THRESHOLDS, 51)


def area_under_curve(curve: FloatArray) -> float:
    """AUC as the benchmark takes it: the mean of the curve's values.

    Args:
        curve: ``(T,)`` shares of frames, 0 to 1.

    Returns:
        0 to 1, NaN where no frame counts.
    """
    return float(np.mean(curve))


def precision_at_20(curve: FloatArray) -> float:
    """The precision curve's value at 20 pixels."""
    return float(curve[PRECISION_BIN])


def _shares(passed: Mask, size: int) -> FloatArray:
    if not len(passed):
        return np.full(size, np.nan)
    shares: FloatArray = np.mean(passed, axis=0)
    return shares
