# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Boxes as arrays, and how two of them agree: overlap and distance of centres."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.geometry import Box

Boxes = Sequence[Box | None] | FloatArray
"""One box per frame: a sequence with None, or an ``(N, 4)`` array with NaN, where there is none."""


def as_array(boxes: Boxes) -> FloatArray:
    """Boxes as ``(N, 4)`` float64 ``x, y, width, height`` in pixels, NaN where there is none.

    A row that is not finite, or whose width or height is not positive, counts as no box.

    Raises:
        DatasetError: where an array is not ``(N, 4)``.
    """
    if isinstance(boxes, np.ndarray):
        if boxes.ndim != 2 or boxes.shape[1] != 4:
            raise DatasetError(f'boxes have shape {boxes.shape}: expected (frames, 4)')
        rows = boxes.astype(np.float64)
        bad = ~np.isfinite(rows).all(axis=1) | (rows[:, 2] <= 0) | (rows[:, 3] <= 0)
        rows[bad] = np.nan
        return rows
    rows = np.full((len(boxes), 4), np.nan)
    for row, box in zip(rows, boxes, strict=True):
        if box is not None:
            row[:] = box.as_tuple()
    return rows


def present(boxes: Boxes) -> Mask:
    """``(N,)``: where there is a box."""
    there: Mask = ~np.isnan(as_array(boxes)[:, 0])
    return there


def iou(predicted: Boxes, truth: Boxes) -> FloatArray:
    """``(N,)`` intersection over union, 0 to 1, NaN where either box is missing (thesis 3.3.3)."""
    a, b = _pair(predicted, truth)
    far = np.minimum(a[:, :2] + a[:, 2:], b[:, :2] + b[:, 2:])
    near = np.maximum(a[:, :2], b[:, :2])
    common = np.prod(np.maximum(far - near, 0.0), axis=1)
    union = np.prod(a[:, 2:], axis=1) + np.prod(b[:, 2:], axis=1) - common
    ratio: FloatArray = common / union
    return ratio


def center_offset(predicted: Boxes, truth: Boxes) -> FloatArray:
    """``(N, 2)`` centre of the prediction minus centre of the truth, x and y in pixels.

    NaN where either box is missing (thesis 3.3.2).
    """
    a, b = _pair(predicted, truth)
    offset: FloatArray = (a[:, :2] + a[:, 2:] / 2) - (b[:, :2] + b[:, 2:] / 2)
    return offset


def center_error(predicted: Boxes, truth: Boxes) -> FloatArray:
    """``(N,)`` distance of the centres in pixels, NaN where a box is missing (thesis 3.3.1)."""
    offset = center_offset(predicted, truth)
    error: FloatArray = np.hypot(offset[:, 0], offset[:, 1])
    return error


def _pair(predicted: Boxes, truth: Boxes) -> tuple[FloatArray, FloatArray]:
    a, b = as_array(predicted), as_array(truth)
    if len(a) != len(b):
        raise DatasetError(
            f'{len(a)} predicted boxes against {len(b)} of the ground truth: '
            'give one of each per frame'
        )
    return a, b
