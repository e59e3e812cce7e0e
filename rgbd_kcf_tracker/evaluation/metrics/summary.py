# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The measures of every table: one definition each, from one :class:`Comparison` per sequence.

A table's mean is over sequences, each counting once. A measure that a sequence does not have
(recall of absence where the target never leaves, TN of a tracker that never says absent) is NaN and
does not count in the mean.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.evaluation.metrics import confusion, otb, presence, princeton
from rgbd_kcf_tracker.evaluation.metrics.boxes import Boxes
from rgbd_kcf_tracker.evaluation.metrics.comparison import Comparison, compare
from rgbd_kcf_tracker.evaluation.metrics.means import mean_of

PRECISION_PX = 20.0


@dataclass(frozen=True, slots=True)
class Measures:
    """One sequence, or the mean of several; shares from 0 to 1, NaN where there is no value.

    Attributes:
        success: Princeton's R at 0.5.
        success_auc: mean of Princeton's R over its 21 thresholds.
        iou: mean IoU over the frames in which the target shows, 0 where there is no box.
        recall_of_absence: of the frames in which the target is absent, the share without a box.
        strangers: of all frames, the share with a box on something else.
        returns: of the times the target came back, the share in which it was found.
        tp, fp, tn, fn: the thesis's confusion matrix by method 2.
        precision: TP / (TP + FP), the thesis's 'precision' and part of its average precision.
        precision_20px: of the frames in which the target shows, the share with a box whose centre
            is within 20 pixels.
        otb_auc: area under the OTB success curve over the frames in which the target shows.
        center_error: mean distance of the centres in pixels where both boxes exist.
        center_error_x, center_error_y: means of its absolute x and y parts.
    """

    success: float
    success_auc: float
    iou: float
    recall_of_absence: float
    strangers: float
    returns: float
    tp: float
    fp: float
    tn: float
    fn: float
    precision: float
    precision_20px: float
    otb_auc: float
    center_error: float
    center_error_x: float
    center_error_y: float


NAMES: tuple[str, ...] = tuple(field.name for field in dataclasses.fields(Measures))


def measure(comparison: Comparison) -> Measures:
    """All measures of one sequence."""
    c = comparison
    counts = confusion.count_overlaps(c.overlap, c.said, c.there)
    matrix = confusion.confusion_by_prediction(counts)
    ratios = c.ratio
    return Measures(
        success=princeton.success_rate(ratios, 0.5),
        success_auc=float(np.mean(princeton.success_curve(ratios))),
        iou=_mean(np.nan_to_num(c.overlap[c.there])),
        recall_of_absence=_mean(~c.said[~c.there]),
        strangers=presence.strangers(c.overlap, c.said, c.there),
        returns=presence.returns(c.overlap, c.said, c.there),
        tp=_or_nan(matrix.tp),
        fp=_or_nan(matrix.fp),
        tn=_or_nan(matrix.tn),
        fn=_or_nan(matrix.fn),
        precision=confusion.precision(counts),
        precision_20px=_mean(np.nan_to_num(c.error[c.there], nan=np.inf) <= PRECISION_PX),
        otb_auc=otb.area_under_curve(otb.success_curve(c.overlap[c.there])),
        center_error=_mean(_known(c.error)),
        center_error_x=_mean(np.abs(_known(c.offset[:, 0]))),
        center_error_y=_mean(np.abs(_known(c.offset[:, 1]))),
    )


def measure_boxes(predicted: Boxes, truth: Boxes, body: Boxes | None = None) -> Measures:
    """All measures of one run: :func:`compare` without the first frame, then :func:`measure`."""
    return measure(compare(predicted, truth, body))


def mean(measures: Iterable[Measures]) -> Measures:
    """Mean over sequences, each counting once; a NaN does not count."""
    return mean_of(Measures, measures)


def _mean(values: FloatArray | Mask) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _known(values: FloatArray) -> FloatArray:
    known: FloatArray = values[~np.isnan(values)]
    return known


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
