# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a published score means what it says: of the boxes scored 0.8, are 80 % right?

Source: Guo et al., "On Calibration of Modern Neural Networks", 2017 (reliability diagram, expected
calibration error); Brier, 1950.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray, Mask

BINS = 10

SURE = 0.9
"""From this score on a tracker says that it is sure."""

LIMITS: FloatArray = np.linspace(0.0, 1.0, 101)
"""Scores from which on the share of good boxes is drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class Honesty:
    """What boxes of a score and above are worth.

    Attributes:
        limits: ``(L,)`` scores.
        shares: ``(L,)`` of the boxes with at least that score, the share that is good; NaN where
            there is none.
        sure: number of boxes scored :data:`SURE` or more.
        sure_share: the share of them that is good, NaN without any.
    """

    limits: FloatArray
    shares: FloatArray
    sure: int
    sure_share: float


def honesty(scores: FloatArray, good: Mask, limits: FloatArray = LIMITS) -> Honesty:
    """Of the boxes of each score and above, the share that is good.

    Args:
        scores: ``(N,)`` score of each box given; NaN left out.
        good: ``(N,)`` whether the box is good.
        limits: ``(L,)`` scores at which the share is wanted.
    """
    known = ~np.isnan(scores)
    order = np.argsort(scores[known])
    s, g = scores[known][order], good[known][order].astype(np.float64)
    below = np.concatenate(([0.0], np.cumsum(g)))

    def share(at: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
        first = np.searchsorted(s, at, side='left')
        count = len(s) - first
        values = (below[-1] - below[first]) / np.maximum(count, 1)
        return count, np.where(count > 0, values, np.nan)

    count, at_sure = share(np.array([SURE]))
    return Honesty(limits, share(limits)[1], int(count[0]), float(at_sure[0]))


@dataclass(frozen=True, slots=True, eq=False)
class Reliability:
    """Boxes binned by score.

    Attributes:
        edges: ``(B + 1,)`` from 0 to 1; a bin holds its upper edge, the first one both.
        counts: ``(B,)`` boxes in each bin.
        mean_score: ``(B,)`` their mean score, NaN in an empty bin.
        hit_rate: ``(B,)`` share of them that are right, NaN in an empty bin.
        expected_error: mean distance of the two, weighted by counts; NaN without boxes.
        brier: mean squared distance of score and outcome (1 right, 0 wrong); NaN without boxes.
    """

    edges: FloatArray
    counts: npt.NDArray[np.int64]
    mean_score: FloatArray
    hit_rate: FloatArray
    expected_error: float
    brier: float


def reliability(
    scores: FloatArray, hits: Mask, bins: int = BINS, weights: FloatArray | None = None
) -> Reliability:
    """Reliability of the boxes' scores.

    Args:
        scores: ``(N,)`` score of each box given; values outside 0 to 1 are clipped, NaN left out.
        hits: ``(N,)`` whether the box is right.
        bins: number of equal bins.
        weights: ``(N,)`` how much each counts in all but ``counts``; alike by default.
    """
    known = ~np.isnan(scores)
    s, h = np.clip(scores[known], 0.0, 1.0), hits[known].astype(np.float64)
    w = np.ones(len(s)) if weights is None else weights[known]
    edges = np.linspace(0.0, 1.0, bins + 1)
    index = np.clip(np.ceil(s * bins).astype(np.int64) - 1, 0, bins - 1)
    counts = np.bincount(index, minlength=bins)
    empty = counts == 0
    weight = np.bincount(index, w, bins)
    some = np.where(empty, 1.0, weight)
    mean_score = np.where(empty, np.nan, np.bincount(index, w * s, bins) / some)
    hit_rate = np.where(empty, np.nan, np.bincount(index, w * h, bins) / some)
    if not len(s):
        return Reliability(edges, counts, mean_score, hit_rate, math.nan, math.nan)
    gap = np.nan_to_num(np.abs(mean_score - hit_rate))
    return Reliability(
        edges,
        counts,
        mean_score,
        hit_rate,
        expected_error=float(np.sum(gap * weight) / weight.sum()),
        brier=float(np.average((s - h) ** 2, weights=w)),
    )
