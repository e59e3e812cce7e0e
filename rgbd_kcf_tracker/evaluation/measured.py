# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Results with their measures, grouped by tracker, sequence and scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.evaluation.metrics import Measures, confusion, mean, sensitivity
from rgbd_kcf_tracker.evaluation.metrics.confusion import Counts
from rgbd_kcf_tracker.evaluation.metrics.sensitivity import Labels
from rgbd_kcf_tracker.evaluation.perframe import Info, Result


class Measured:
    """Results with their measures, grouped in the ways tables need.

    Args:
        results: of all trackers and sequences.
        infos: per sequence.
    """

    def __init__(self, results: Sequence[Result], infos: Mapping[str, Info]) -> None:
        self.results = list(results)
        self.infos = dict(infos)
        self.trackers = list(dict.fromkeys(r.tracker for r in self.results))
        self.sequences = list(dict.fromkeys(r.sequence for r in self.results))
        self.scenarios = list(dict.fromkeys(self.infos[s].scenario for s in self.sequences))
        self._measures = {(r.tracker, r.sequence): r.measures() for r in self.results}
        self._by_key = {(r.tracker, r.sequence): r for r in self.results}

    def of(self, tracker: str, sequence: str) -> Measures | None:
        """A tracker's measures on a sequence, None where it failed."""
        return self._measures.get((tracker, sequence))

    def result(self, tracker: str, sequence: str) -> Result | None:
        """A tracker's frames of a sequence, None where it failed."""
        return self._by_key.get((tracker, sequence))

    def mean(self, tracker: str, scenario: str | None = None) -> Measures:
        """Mean over the sequences, or those of a scenario, each counting once."""
        return mean(
            m
            for (name, sequence), m in self._measures.items()
            if name == tracker and scenario in (None, self.infos[sequence].scenario)
        )

    def values(self, tracker: str, name: str) -> FloatArray:
        """One measure of each sequence."""
        found = [getattr(m, name) for (t, _), m in self._measures.items() if t == tracker]
        return np.array(found, np.float64)

    def recordings(self, tracker: str) -> Labels:
        """Which recording each sequence is of, see :func:`sensitivity.numbered`."""
        own = [s for t, s in self._measures if t == tracker]
        return sensitivity.numbered([self.infos[s].recording or s for s in own])

    def counts(self, tracker: str, keep: Callable[[Info], bool] = lambda _: True) -> list[Counts]:
        """Counts of each sequence that is kept."""
        return [
            confusion.count_overlaps(r.counted.overlap, r.counted.said, r.counted.there)
            for r in self.results
            if r.tracker == tracker and keep(self.infos[r.sequence])
        ]
