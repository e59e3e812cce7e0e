# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""VOT short-term protocol, with re-initialisation: accuracy, robustness, expected average overlap.

A tracker starts on the ground truth; where its overlap falls to 0 it has failed, and is started
again a few frames later. Source: Kristan et al., "The Visual Object Tracking VOT2015 challenge
results" (protocol, accuracy, robustness, EAO), and the definitions of the challenge's toolkit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray

BURN_IN = 10
"""Frames from each start, the start included, that accuracy leaves out."""

SKIP = 5
"""A failed tracker starts again this many frames after the failure."""

SENSITIVITY = 30
"""Length in frames over which the reliability is stated (robustness axis of the AR plot)."""


class Code(IntEnum):
    """What a frame of a run with re-initialisation is; numbers as in the challenge's files."""

    SKIPPED = 0
    START = 1
    FAILURE = 2
    TRACKED = 3


@dataclass(frozen=True, slots=True, eq=False)
class ShortTermRun:
    """One sequence under the protocol.

    Attributes:
        codes: ``(N,)`` a :class:`Code` per frame.
        overlaps: ``(N,)`` IoU with the ground truth; only where the code is TRACKED does it count.
    """

    codes: npt.NDArray[np.int64]
    overlaps: FloatArray


@dataclass(frozen=True, slots=True)
class Fragment:
    """Overlaps from a start (left out) up to the failure (left out) or the sequence's end."""

    overlaps: FloatArray
    failed: bool


def accuracy(run: ShortTermRun, burn_in: int = BURN_IN) -> float:
    """Mean overlap of the tracked frames beyond the burn-in after each start; NaN where none is."""
    counted = run.codes == Code.TRACKED
    for start in np.flatnonzero(run.codes == Code.START):
        counted[start : start + burn_in] = False
    return float(np.mean(run.overlaps[counted])) if counted.any() else math.nan


def failures(run: ShortTermRun) -> int:
    """Robustness of one sequence: how often the tracker failed."""
    return int(np.sum(run.codes == Code.FAILURE))


def mean_accuracy(runs: Sequence[ShortTermRun], burn_in: int = BURN_IN) -> float:
    """Accuracy over sequences, weighted by their lengths; NaN where no frame counts."""
    values = np.array([accuracy(run, burn_in) for run in runs])
    lengths = np.array([len(run.codes) for run in runs], np.float64)
    known = ~np.isnan(values)
    return float(np.average(values[known], weights=lengths[known])) if known.any() else math.nan


def mean_robustness(runs: Sequence[ShortTermRun]) -> float:
    """Mean number of failures per sequence; NaN without sequences."""
    return float(np.mean([failures(run) for run in runs])) if runs else math.nan


def reliability(runs: Sequence[ShortTermRun], length: int = SENSITIVITY) -> float:
    """Probability of tracking ``length`` frames on: ``exp(-length * failures per frame)``."""
    frames = sum(len(run.codes) for run in runs)
    if not frames:
        return math.nan
    return math.exp(-length * sum(failures(run) for run in runs) / frames)


def fragments(run: ShortTermRun) -> list[Fragment]:
    """The run cut at its failures, without the starts, failures and skipped frames."""
    result = []
    for start in np.flatnonzero(run.codes == Code.START):
        rest = run.codes[start + 1 :]
        ends = np.flatnonzero(rest != Code.TRACKED)
        stop = int(ends[0]) if len(ends) else len(rest)
        failed = bool(len(ends)) and rest[stop] == Code.FAILURE
        result.append(Fragment(run.overlaps[start + 1 : start + 1 + stop], failed))
    return result


def expected_overlap_curve(runs: Sequence[ShortTermRun], length: int | None = None) -> FloatArray:
    """Expected average overlap of sequences of each length.

    A fragment that failed is drawn out with zeros to any length; one that reached the end of its
    sequence counts only up to its own length.

    Args:
        runs: the sequences.
        length: longest length asked for; by default that of the longest fragment.

    Returns:
        ``(length,)``: entry ``n - 1`` is the mean overlap expected over the first ``n`` frames
        after a start; NaN where no fragment says.
    """
    pieces = [piece for run in runs for piece in fragments(run)]
    longest = max((len(piece.overlaps) for piece in pieces), default=0)
    size = longest if length is None else length
    total, count = np.zeros(size), np.zeros(size)
    lengths = np.arange(1, size + 1)
    for piece in pieces:
        padded = np.zeros(size)
        own = min(len(piece.overlaps), size)
        padded[:own] = piece.overlaps[:own]
        reach = size if piece.failed else own
        total[:reach] += (np.cumsum(padded) / lengths)[:reach]
        count[:reach] += 1
    with np.errstate(invalid='ignore'):
        curve: FloatArray = total / count
    return curve


def typical_lengths(lengths: Sequence[int]) -> tuple[int, int]:
    """The range about the commonest sequence length that holds half of all lengths.

    As VOT2015 chooses it: a kernel density estimate of the lengths, cut at the density level above
    which half of its mass lies.

    Raises:
        ValueError: without lengths.
    """
    if not lengths:
        raise ValueError('no lengths')
    shortest, longest = min(lengths), max(lengths)
    if shortest == longest:
        return shortest, longest
    grid = np.arange(1, 2 * longest + 1)
    bandwidth = float(np.std(lengths, ddof=1)) * len(lengths) ** -0.2  # Scott's rule
    distance = (grid[:, None] - np.asarray(lengths, np.float64)[None, :]) / bandwidth
    density = np.exp(-(distance**2) / 2).sum(axis=1)
    density /= density.sum()
    low = high = int(np.argmax(density))
    mass = density[low]
    while mass < 0.5:
        left = density[low - 1] if low > 0 else -1.0
        right = density[high + 1] if high + 1 < len(grid) else -1.0
        if left >= right:
            low -= 1
        else:
            high += 1
        mass += max(left, right)
    return int(grid[low]), int(grid[high])


def expected_average_overlap(
    runs: Sequence[ShortTermRun], low: int | None = None, high: int | None = None
) -> float:
    """EAO: mean of the curve over lengths ``low`` to ``high``, both included; NaN without runs.

    The challenge fixes the lengths for its own sequences (108 to 371 in VOT2015, 46 to 291 in
    VOT2019). Without them :func:`typical_lengths` of the given sequences are taken.
    """
    if not runs:
        return math.nan
    typical = typical_lengths([len(run.codes) for run in runs])
    low = typical[0] if low is None else low
    high = typical[1] if high is None else high
    part = expected_overlap_curve(runs, max(high, low))[low - 1 : high]
    part = part[~np.isnan(part)]
    return float(np.mean(part)) if len(part) else math.nan
