# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Which parameters matter and which gains are noise, from scores of settings on sequences.

Scores are ``(S, Q)``: ``S`` settings on the same ``Q`` sequences. Chance is what comes out when
labels are dealt out anew (Fisher 1935, permutation tests); several tests at once are held against
Holm's (1979) bounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray

Labels = npt.NDArray[np.int64]

ROUNDS = 2000
"""Times that labels are dealt out anew: the smallest p is one in this many."""

LEVEL = 0.05
"""A p below it is taken for more than chance."""

SEED = 0


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """What one parameter does to the mean score.

    Attributes:
        means: ``(V,)`` mean score at each of its values, over all else.
        low, high: ``(V,)`` 95 % interval of these means over sequences (bootstrap).
        share: of the variance between settings that its values explain, 0 to 1.
        p: of a share as large by chance.
    """

    means: FloatArray
    low: FloatArray
    high: FloatArray
    share: float
    p: float

    @property
    def span(self) -> float:
        """Best less worst mean."""
        return float(np.ptp(self.means))


def effect(scores: FloatArray, labels: Labels, balanced: bool) -> Effect:
    """What the values of one parameter do.

    Args:
        scores: ``(S, Q)``, no NaN.
        labels: ``(S,)`` which of ``V`` values each setting has, every value at least once.
        balanced: True for a whole grid, in which each value meets all others alike: then values
            are dealt out anew within every sequence, and chance is that of the sequences. False
            for settings drawn at random: then they are dealt out among settings, and chance is
            that of what else these settings have.
    """
    rng = np.random.default_rng(SEED)
    weights = (labels == np.arange(labels.max() + 1)[:, None]).astype(np.float64)
    counts = weights.sum(axis=1)
    by_value = weights @ scores / counts[:, None]  # (V, Q)
    found = _between(by_value.mean(axis=1), counts)
    overall = scores.mean(axis=1)
    total = float(np.var(overall))
    chance = np.empty(ROUNDS)
    for i in range(ROUNDS):
        if balanced:
            means = rng.permuted(by_value, axis=0).mean(axis=1)
        else:
            dealt = weights[:, rng.permutation(len(labels))]
            means = dealt @ overall / counts
        chance[i] = _between(means, counts)
    low, high = bootstrap(by_value)
    return Effect(
        by_value.mean(axis=1),
        low,
        high,
        min(1.0, found / total) if total > 0 else 0.0,
        _p(found, chance),
    )


@dataclass(frozen=True, slots=True)
class Gain:
    """By how much a setting is better than another.

    Attributes:
        mean: over independent sequences.
        low, high: its 95 % interval.
        p: of a mean as far from 0 by chance (signs dealt out anew).
    """

    mean: float
    low: float
    high: float
    p: float


def gain(differences: FloatArray) -> Gain | None:
    """Whether a setting is better than another on independent sequences.

    Args:
        differences: ``(Q,)`` of the scores of the two.

    Returns:
        None where one of them is not known.
    """
    if np.isnan(differences).any():
        return None
    rng = np.random.default_rng(SEED)
    mean = float(differences.mean())
    signs = rng.choice([-1.0, 1.0], (ROUNDS, len(differences)))
    low, high = bootstrap(differences[None])
    p = _p(abs(mean), np.abs((signs * differences).mean(axis=1)))
    return Gain(mean, float(low[0]), float(high[0]), p)


def bootstrap(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """95 % interval of each row's mean, its ``Q`` columns drawn anew."""
    rng = np.random.default_rng(SEED)
    columns = rows.shape[1]
    drawn = rng.integers(columns, size=(ROUNDS, columns))
    means = np.stack([rows[:, own].mean(axis=1) for own in drawn])
    low, high = np.percentile(means, [2.5, 97.5], axis=0)
    return low, high


def holm(ps: list[float]) -> list[float]:
    """The p values held against each other being tested too."""
    order = np.argsort(ps, kind='stable')
    adjusted = np.empty(len(ps))
    before = 0.0
    for rank, index in enumerate(order):
        before = max(before, min(1.0, (len(ps) - rank) * ps[index]))
        adjusted[index] = before
    return [float(p) for p in adjusted]


def binned(values: FloatArray, bins: int) -> Labels:
    """Which of up to ``bins`` equally full bins each value is in, none of them empty."""
    distinct = np.unique(values)
    if len(distinct) <= bins:
        return np.searchsorted(distinct, values).astype(np.int64)
    edges = np.quantile(values, np.linspace(0, 1, bins + 1)[1:-1])
    _, labels = np.unique(np.searchsorted(edges, values, side='right'), return_inverse=True)
    return labels.astype(np.int64)


def _between(means: FloatArray, counts: FloatArray) -> float:
    """Variance between values, each counting as often as there are settings with it."""
    middle = np.average(means, weights=counts)
    return float(np.average((means - middle) ** 2, weights=counts))


def _p(found: float, chance: FloatArray) -> float:
    """Share of chances that are as large, the one found among them."""
    # Sums in another order differ in their last digits.
    return float((1 + np.sum(chance >= found * (1 - 1e-9))) / (1 + len(chance)))
