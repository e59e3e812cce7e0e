# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Princeton Tracking Benchmark: r_i, success rate R and its eleven categories.

Source: thesis 4.2.1; Song and Xiao, "Tracking Revisited using RGBD Camera: Unified Benchmark and
Baselines", ICCV 2013.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.errors import DatasetError

THRESHOLDS: FloatArray = np.linspace(0.0, 1.0, 21)
"""Overlaps at which the success rate is drawn: 0, 0.05, ..., 1."""

CATEGORIES: dict[str, tuple[str, ...]] = {
    'target type': ('human', 'animal', 'rigid'),
    'target size': ('large', 'small'),
    'movement': ('slow', 'fast'),
    'occlusion': ('yes', 'no'),
    'motion type': ('passive', 'active'),
}
"""The benchmark's five splits of its sequences: eleven categories, as in thesis Table 4.1."""


def success_rate(ratios: FloatArray, threshold: float = 0.5) -> float:
    """R: share of frames with ``r_i > threshold``; NaN without frames."""
    return float(np.mean(ratios > threshold)) if len(ratios) else float('nan')


def success_curve(ratios: FloatArray, thresholds: FloatArray = THRESHOLDS) -> FloatArray:
    """R at each threshold; NaN without frames."""
    if not len(ratios):
        return np.full(len(thresholds), np.nan)
    rates: FloatArray = np.mean(ratios[:, None] > thresholds[None, :], axis=0)
    return rates


def by_category(
    rates: Mapping[str, float], categories: Mapping[str, Mapping[str, str]]
) -> dict[str, dict[str, float]]:
    """Mean success rate of each category, and of all, each sequence counting once.

    Every number comes from the same per-sequence rates, so in each split the categories' means,
    weighted by their numbers of sequences, give the overall mean.

    Args:
        rates: success rate of each sequence; NaN, where no frame counts, is left out.
        categories: of each sequence, the value of each split (keys of :data:`CATEGORIES`).

    Returns:
        For each split a mean per category (NaN where no sequence has it), and
        ``{'all': {'all': mean}}``.

    Raises:
        DatasetError: where a sequence lacks a split or has a value that is no category of it.
    """
    values: dict[str, dict[str, list[float]]] = {
        split: {name: [] for name in names} for split, names in CATEGORIES.items()
    }
    for sequence, rate in rates.items():
        for split, names in CATEGORIES.items():
            name = categories.get(sequence, {}).get(split)
            if name not in names:
                raise DatasetError(
                    f'sequence {sequence}: {split} is {name!r}: give one of {", ".join(names)}'
                )
            values[split][name].append(rate)
    result = {
        split: {name: _mean(v) for name, v in names.items()} for split, names in values.items()
    }
    result['all'] = {'all': _mean(list(rates.values()))}
    return result


def _mean(values: list[float]) -> float:
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float('nan')
