# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Long-term tracking: precision, recall and F-score from the scores that the tracker publishes.

Source: Lukezic et al., "Now you see me: evaluating performance in long-term visual tracking", 2018;
CDTB and DepthTrack use the same, with thresholds drawn from all of a tracker's scores.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.evaluation.metrics.boxes import Boxes, iou, present

RESOLUTION = 100
"""Number of thresholds at most, the two infinite ones included."""


@dataclass(frozen=True, slots=True, eq=False)
class ScoredSequence:
    """One sequence's boxes with the tracker's certainty.

    Attributes:
        overlaps: ``(N,)`` IoU; 0 where either box is missing.
        scores: ``(N,)`` certainty of the box; NaN where the tracker gave none.
        visible: number of frames in which the target shows.
    """

    overlaps: FloatArray
    scores: FloatArray
    visible: int


@dataclass(frozen=True, slots=True, eq=False)
class LongTerm:
    """Precision and recall over thresholds, and the best F-score with its precision and recall."""

    thresholds: FloatArray
    precisions: FloatArray
    recalls: FloatArray
    precision: float
    recall: float
    f_score: float


def scored(predicted: Boxes, scores: FloatArray, truth: Boxes) -> ScoredSequence:
    """A sequence's overlaps and scores.

    Args:
        predicted: the tracker's boxes, ``N`` of them.
        scores: ``(N,)``, of which those count where there is a predicted box.
        truth: ``N`` boxes.
    """
    return ScoredSequence(
        overlaps=np.nan_to_num(iou(predicted, truth), nan=0.0),
        scores=np.where(present(predicted), np.asarray(scores, np.float64), np.nan),
        visible=int(present(truth).sum()),
    )


def score_thresholds(scores: FloatArray, resolution: int = RESOLUTION) -> FloatArray:
    """Infinity, then the scores or their quantiles downwards, then minus infinity.

    Args:
        scores: ``(N,)``, NaN where there is no box.
        resolution: number of thresholds at the most.

    Returns:
        ``(T,)`` descending.
    """
    ordered = np.unique(scores[~np.isnan(scores)])[::-1]
    if len(ordered) > resolution - 2:
        chosen = np.linspace(0, len(ordered) - 1, resolution - 2).round().astype(np.int64)
        ordered = ordered[chosen]
    thresholds: FloatArray = np.concatenate(([np.inf], ordered, [-np.inf]))
    return thresholds


def precision_recall(
    sequence: ScoredSequence, thresholds: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Precision and recall of one sequence at each threshold.

    Precision is the mean overlap of the boxes whose score is at least the threshold (1 without
    any), recall their summed overlap over the number of frames in which the target shows.

    Args:
        sequence: the boxes and their scores; the target shows in some frame.
        thresholds: ``(T,)``.

    Returns:
        ``(T,)`` each, 0 to 1.
    """
    kept = sequence.scores[:, None] >= thresholds[None, :]  # NaN is never kept
    boxes = kept.sum(axis=0)
    overlap = (sequence.overlaps[:, None] * kept).sum(axis=0)
    precisions: FloatArray = np.where(boxes > 0, overlap / np.maximum(boxes, 1), 1.0)
    recalls: FloatArray = overlap / sequence.visible
    return precisions, recalls


def evaluate(sequences: Sequence[ScoredSequence], resolution: int = RESOLUTION) -> LongTerm:
    """Mean precision and recall over sequences at common thresholds, and the best F-score.

    Sequences in which the target never shows have no recall, and do not count.
    """
    sequences = [s for s in sequences if s.visible]
    if not sequences:
        empty = np.zeros(0)
        return LongTerm(empty, empty, empty, math.nan, math.nan, math.nan)
    thresholds = score_thresholds(np.concatenate([s.scores for s in sequences]), resolution)
    curves = [precision_recall(s, thresholds) for s in sequences]
    precisions: FloatArray = np.mean([c[0] for c in curves], axis=0)
    recalls: FloatArray = np.mean([c[1] for c in curves], axis=0)
    sums = precisions + recalls
    f = np.where(sums > 0, 2 * precisions * recalls / np.where(sums > 0, sums, 1.0), 0.0)
    best = int(np.argmax(f))
    return LongTerm(
        thresholds,
        precisions,
        recalls,
        float(precisions[best]),
        float(recalls[best]),
        float(f[best]),
    )
