# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Following the right one: boxes on strangers, and targets that are found again when they return.

A box on somebody else is the worst error that there is: a robot follows the wrong person.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.evaluation.metrics.confusion import HIT_IOU

STRANGER_IOU = 0.1
"""A box that overlaps the target by less is on something else."""

RETURN_FRAMES = 5
"""A target is back where it shows for this many frames on end."""

JUDGED_FROM = 2
"""Index of the first frame after a return that is judged: the third. Two are for recognising."""

HIT_SHARE = 0.5
"""Of the judged frames, at least this share must be hit."""


def strangers(overlap: FloatArray, said: Mask, there: Mask) -> float:
    """Of all frames, the share with a box on something else; NaN without frames.

    Args:
        overlap: ``(N,)`` IoU, NaN where either box is missing.
        said: ``(N,)`` a box was given.
        there: ``(N,)`` the target shows.
    """
    if not len(said):
        return math.nan
    near = there & (np.nan_to_num(overlap, nan=-1.0) >= STRANGER_IOU)
    return float(np.mean(said & ~near))


def returns(overlap: FloatArray, said: Mask, there: Mask) -> float:
    """Of the times the target came back for five frames or more, the share that was found.

    It is found if at least half of the frames from the third on are hit (IoU >= 0.5). NaN where the
    target never came back. The target shows before the first frame, as it is given then.

    Args:
        overlap: ``(N,)`` IoU, NaN where either box is missing.
        said: ``(N,)`` a box was given.
        there: ``(N,)`` the target shows.
    """
    if not len(said):
        return math.nan
    hit = said & there & (np.nan_to_num(overlap, nan=-1.0) >= HIT_IOU)
    found = []
    for start, stop in runs(np.diff(there.astype(np.int8)) != 0):
        if start and there[start] and stop - start >= RETURN_FRAMES:
            found.append(float(np.mean(hit[start + JUDGED_FROM : stop])) >= HIT_SHARE)
    return float(np.mean(found)) if found else math.nan


def runs(breaks: Mask) -> list[tuple[int, int]]:
    """Start and end of the pieces of ``N >= 1`` items, cut where ``(N - 1,)`` ``breaks`` is set."""
    edges = [0, *(np.flatnonzero(breaks) + 1).tolist(), len(breaks) + 1]
    return [(a, b) for a, b in pairwise(edges)]
