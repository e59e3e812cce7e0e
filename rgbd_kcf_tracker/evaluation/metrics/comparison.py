# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A run held against its ground truth, frame by frame: what every measure is taken from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.evaluation.metrics.boxes import Boxes, as_array, center_offset, iou, present


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """What a tracker said in each frame that counts, against what was there.

    Attributes:
        said: ``(N,)`` the tracker gave a box.
        there: ``(N,)`` the target shows.
        overlap: ``(N,)`` IoU, NaN where either box is missing.
        offset: ``(N, 2)`` predicted minus true centre in pixels, NaN where either is missing.
        score: ``(N,)`` the tracker's score, NaN without a box.
    """

    said: Mask
    there: Mask
    overlap: FloatArray
    offset: FloatArray
    score: FloatArray

    @property
    def error(self) -> FloatArray:
        """``(N,)`` centre error in pixels, NaN where either box is missing."""
        distance: FloatArray = np.hypot(self.offset[:, 0], self.offset[:, 1])
        return distance

    @property
    def ratio(self) -> FloatArray:
        """``(N,)`` Princeton's r_i: IoU where both boxes exist, 1 for neither, -1 for one alone."""
        ratio = np.where(self.said == self.there, self.overlap, -1.0)
        ratio[~self.said & ~self.there] = 1.0
        return ratio

    def __len__(self) -> int:
        return len(self.said)


def compare(
    predicted: Boxes,
    truth: Boxes,
    body: Boxes | None = None,
    scores: FloatArray | None = None,
    skip: int = 1,
) -> Comparison:
    """Hold a run against its ground truth.

    Args:
        predicted: the tracker's boxes in pixels, one for each of ``N`` frames.
        truth: as many of the visible part; whether the target is present is decided by these
            alone.
        body: boxes of the whole body, known on simulated scenes. In each frame a predicted box is
            then held against the one of the two that it overlaps more: a tracker may draw either.
        scores: ``(N,)``, the tracker's.
        skip: frames at the start that never count: 1, the given box, by default.

    Raises:
        DatasetError: where the numbers of frames differ.
    """
    said, there = present(predicted), present(truth)
    overlap, offset = iou(predicted, truth), center_offset(predicted, truth)
    if body is not None:
        whole = as_array(body)
        other = np.where(there, iou(predicted, whole), np.nan)
        better = np.nan_to_num(other, nan=-1.0) > np.nan_to_num(overlap, nan=-1.0)
        overlap = np.where(better, other, overlap)
        offset = np.where(better[:, None], center_offset(predicted, whole), offset)
    score = np.full(len(said), np.nan) if scores is None else np.asarray(scores, np.float64)
    score = np.where(said, score, np.nan)
    return Comparison(said[skip:], there[skip:], overlap[skip:], offset[skip:], score[skip:])
