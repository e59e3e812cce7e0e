# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a tracker says against what is there: counts, both confusion matrices, precision.

Source: thesis 3.3.4 (precision) and 4.3.1 (Tables 4.2 and 4.3, average precision). A hit is a box
that overlaps the visible target by at least :data:`HIT_IOU`; a box that misses a visible target is
a false positive, as is any box while the target is absent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.evaluation.metrics.boxes import Boxes, iou, present

HIT_IOU = 0.5
"""Overlap from which a box counts as correct (Everingham et al., PASCAL VOC, 2010)."""

UNDETERMINED = 'cannot be determined'
"""What the tables show where a matrix has no value (thesis 4.3.1)."""


@dataclass(frozen=True, slots=True)
class Counts:
    """Frames by what was said and what was there; adds up over sequences."""

    tp: int = 0
    fp: int = 0
    tn: int = 0
    fn: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            self.tp + other.tp, self.fp + other.fp, self.tn + other.tn, self.fn + other.fn
        )

    @property
    def total(self) -> int:
        """All frames."""
        return self.tp + self.fp + self.tn + self.fn


@dataclass(frozen=True, slots=True)
class Confusion:
    """Four shares, 0 to 1; None where the share cannot be determined."""

    tp: float | None
    fp: float | None
    tn: float | None
    fn: float | None


def count(predicted: Boxes, truth: Boxes, hit_iou: float = HIT_IOU) -> Counts:
    """Counts of one sequence."""
    return count_overlaps(iou(predicted, truth), present(predicted), present(truth), hit_iou)


def count_overlaps(
    overlaps: FloatArray, said: Mask, there: Mask, hit_iou: float = HIT_IOU
) -> Counts:
    """Counts of one sequence from ``(N,)`` IoU, where a box was given, where the target shows."""
    hit = said & there & (np.nan_to_num(overlaps, nan=-1.0) >= hit_iou)
    return Counts(
        tp=int(hit.sum()),
        fp=int((said & ~hit).sum()),
        tn=int((~said & ~there).sum()),
        fn=int((~said & there).sum()),
    )


def confusion_by_total(counts: Counts) -> Confusion:
    """Method 1: each count over all frames (Table 4.2).

    TN and FN cannot be determined for a tracker that never said the target was absent, and nothing
    can without frames.
    """
    total = counts.total
    if not total:
        return Confusion(None, None, None, None)
    spoke = counts.tn + counts.fn > 0
    return Confusion(
        tp=counts.tp / total,
        fp=counts.fp / total,
        tn=counts.tn / total if spoke else None,
        fn=counts.fn / total if spoke else None,
    )


def confusion_by_prediction(counts: Counts) -> Confusion:
    """Method 2: TP and FP over the frames with a box, TN and FN over those without (Table 4.3).

    A pair cannot be determined for a tracker that never gave a box, or never said absent.
    """
    boxes, absences = counts.tp + counts.fp, counts.tn + counts.fn
    return Confusion(
        tp=counts.tp / boxes if boxes else None,
        fp=counts.fp / boxes if boxes else None,
        tn=counts.tn / absences if absences else None,
        fn=counts.fn / absences if absences else None,
    )


def precision(counts: Counts) -> float:
    """TP / (TP + FP): when the tracker gives a box, how often it is right; NaN without boxes."""
    boxes = counts.tp + counts.fp
    return counts.tp / boxes if boxes else math.nan


def average_precision(scenes: Sequence[Counts]) -> float:
    """AP: mean of the scenes' precisions, each scene counting once (thesis 4.3.1).

    A scene without any box has no precision and does not count; NaN where none has.
    """
    values = [p for p in map(precision, scenes) if not math.isnan(p)]
    return float(np.mean(values)) if values else math.nan
