# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Colour of a silhouette, band by band from its top to its bottom."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats, Mask
from rgbd_kcf_tracker.metric.perceive.colors import CODES, smoothed

BANDS = 4
"""Horizontal bands of a body: about head, chest, hips and legs of a person."""


def band_histograms(codes: npt.NDArray[np.int32], mask: Mask, top: float, height: float) -> Floats:
    """Smoothed counts of colour codes in each band, ``(BANDS, CODES)`` float32.

    Args:
        codes: ``(h, w)`` of the crop around the silhouette.
        mask: ``(h, w)`` bool, the silhouette.
        top: row of the crop in which the whole body begins (may be outside the crop).
        height: rows of the whole body.
    """
    band = bands_of_rows(codes.shape[0], top, height)
    index = (codes + (band * CODES)[:, None])[mask]
    counts = np.bincount(index, minlength=BANDS * CODES).astype(np.float32)
    return smoothed(counts.reshape(BANDS, CODES))


def bands_of_rows(count: int, top: float, height: float) -> npt.NDArray[np.int32]:
    """Band of each of ``count`` rows of a crop in which a body begins at row ``top``."""
    rows = np.arange(count, dtype=np.float32) + 0.5 - top
    band: npt.NDArray[np.int32] = np.clip(rows * (BANDS / max(height, 1.0)), 0, BANDS - 1).astype(
        np.int32
    )
    return band


def band_similarity(counts: Floats, model: Floats) -> float:
    """Bhattacharyya coefficient of the bands, weighted by how many pixels ``counts`` has in each.

    Args:
        counts: ``(BANDS, CODES)`` of a candidate.
        model: ``(BANDS, CODES)`` of the target, each row summing to 1 (or 0 where never seen).

    Returns:
        0 to 1; 0 where no band of the candidate has been seen on the target.
    """
    total = counts.sum(axis=1)
    known = (total > 0) & (model.sum(axis=1) > 0)
    if not known.any():
        return 0.0
    common = np.sqrt(counts[known] * model[known]).sum(axis=1) / np.sqrt(total[known])
    return float((common * total[known]).sum() / total[known].sum())
