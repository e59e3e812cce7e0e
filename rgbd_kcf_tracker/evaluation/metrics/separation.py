# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How well a comparison of two sightings tells one person from another.

Source of the area under the ROC curve: Hanley and McNeil, "The Meaning and Use of the Area under a
Receiver Operating Characteristic (ROC) Curve", 1982: the probability that a pair of the same person
gets more than a pair of two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import mannwhitneyu

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.evaluation.metrics.calibration import Reliability, reliability

HALF = 0.5
"""From this probability on a pair is taken for one person."""


@dataclass(frozen=True, slots=True)
class Separation:
    """Pairs of sightings; shares from 0 to 1, NaN where there is no pair of the kind.

    Attributes:
        same: number of pairs of one person.
        different: number of pairs of two.
        area: under the ROC curve, a tie counting half.
        recognised: of the pairs of one person, the share with a probability of a half or more.
        taken: of the pairs of two, the share with a probability of a half or more.
    """

    same: int
    different: int
    area: float
    recognised: float
    taken: float


def separation(probabilities: FloatArray, same: Mask) -> Separation:
    """How well probabilities part pairs of one person from pairs of two.

    Args:
        probabilities: ``(N,)`` that a pair is one person, 0 to 1.
        same: ``(N,)`` whether it is.
    """
    one, two = probabilities[same], probabilities[~same]
    area = math.nan
    if len(one) and len(two):
        area = float(mannwhitneyu(one, two).statistic) / (len(one) * len(two))
    return Separation(len(one), len(two), area, _above(one), _above(two))


def balanced_reliability(probabilities: FloatArray, same: Mask) -> Reliability:
    """Whether the probabilities mean what they say, were every second pair of one person.

    How many pairs of two there are depends on how many people a recording has, which says nothing
    of the comparison: so both kinds weigh the same in all.
    """
    weights = np.where(same, 1 / max(int(same.sum()), 1), 1 / max(int((~same).sum()), 1))
    return reliability(probabilities, same, weights=weights)


def _above(values: FloatArray) -> float:
    return float(np.mean(values >= HALF)) if len(values) else math.nan
