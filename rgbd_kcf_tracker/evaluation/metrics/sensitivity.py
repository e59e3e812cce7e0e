# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Which parameters matter and which gains are noise, from scores of settings on sequences.

Scores are ``(S, Q)``: ``S`` settings on the same ``Q`` sequences. Chance is what comes out when
labels are dealt out anew (Fisher 1935, permutation tests); several tests at once are held against
Holm's (1979) bounds. Sequences of one recording, such as the people in it, are not independent:
they are drawn and dealt out together.
"""

from __future__ import annotations

from collections.abc import Sequence
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
        low, high: ``(V,)`` 95 % interval of these means, see :func:`bootstrap`.
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


def numbered(recordings: Sequence[str]) -> Labels:
    """``(Q,)`` which recording each sequence is of, counted from 0, by the names of these."""
    known = {name: number for number, name in enumerate(dict.fromkeys(recordings))}
    return np.array([known[name] for name in recordings], np.int64)


def effect(scores: FloatArray, labels: Labels, balanced: bool, recordings: Labels) -> Effect:
    """What the values of one parameter do.

    Args:
        scores: ``(S, Q)``, no NaN.
        labels: ``(S,)`` which of ``V`` values each setting has, every value at least once.
        balanced: True for a whole grid, in which each value meets all others alike: then values
            are dealt out anew within every recording, and chance is that of the recordings. False
            for settings drawn at random: then they are dealt out among settings, and chance is
            that of what else these settings have.
        recordings: ``(Q,)`` which one each sequence is of.
    """
    rng = np.random.default_rng(SEED)
    weights = (labels == np.arange(labels.max() + 1)[:, None]).astype(np.float64)
    counts = weights.sum(axis=1)
    by_value = weights @ scores / counts[:, None]  # (V, Q)
    found = _between(by_value.mean(axis=1), counts)
    overall = scores.mean(axis=1)
    total = float(np.var(overall))
    chance = np.empty(ROUNDS)
    _, own = np.unique(recordings, return_inverse=True)
    order = np.tile(np.arange(len(counts))[:, None], own.max() + 1)
    for i in range(ROUNDS):
        if balanced:
            dealt_out = rng.permuted(order, axis=0)[:, own]
            means = np.take_along_axis(by_value, dealt_out, axis=0).mean(axis=1)
        else:
            dealt = weights[:, rng.permutation(len(labels))]
            means = dealt @ overall / counts
        chance[i] = _between(means, counts)
    low, high = bootstrap(by_value, recordings)
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
        mean: over sequences.
        low, high: its 95 % interval, see :func:`bootstrap`.
        p: of a mean as far from 0 by chance (signs dealt out anew).
    """

    mean: float
    low: float
    high: float
    p: float


def gain(differences: FloatArray, recordings: Labels) -> Gain | None:
    """Whether a setting is better than another on independent recordings.

    Args:
        differences: ``(Q,)`` of the scores of the two.
        recordings: ``(Q,)`` which one each sequence is of.

    Returns:
        None where one of them is not known.
    """
    if np.isnan(differences).any():
        return None
    rng = np.random.default_rng(SEED)
    mean = float(differences.mean())
    _, own = np.unique(recordings, return_inverse=True)
    signs = rng.choice([-1.0, 1.0], (ROUNDS, own.max() + 1))[:, own]
    low, high = bootstrap(differences[None], recordings)
    p = _p(abs(mean), np.abs((signs * differences).mean(axis=1)))
    return Gain(mean, float(low[0]), float(high[0]), p)


def bootstrap(rows: FloatArray, recordings: Labels) -> tuple[FloatArray, FloatArray]:
    """95 % interval of each row's mean, recordings drawn anew with all of their columns.

    Args:
        rows: ``(R, Q)``, no NaN.
        recordings: ``(Q,)`` which one each column is of.

    Returns:
        ``(R,)`` each; NaN below two recordings, which say nothing of others.
    """
    numbers, sizes = np.unique(recordings, return_counts=True)
    if len(numbers) < 2:
        unknown = np.full(len(rows), np.nan)
        return unknown, unknown
    sums = rows @ (recordings[:, None] == numbers).astype(np.float64)
    rng = np.random.default_rng(SEED)
    drawn = rng.integers(len(numbers), size=(ROUNDS, len(numbers)))
    means = np.stack([sums[:, own].sum(axis=1) / sizes[own].sum() for own in drawn])
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
