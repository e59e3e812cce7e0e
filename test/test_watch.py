# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Looking into functions while they run."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from rgbd_kcf_tracker.view.watch import Watch, name_of


def doubled(values: np.ndarray) -> np.ndarray:
    twice = 2 * values
    values += 100  # what was given is kept as it came in
    return twice


class Counter:
    def __init__(self) -> None:
        self.totals = np.zeros(1)

    def add(self, amount: float) -> float:
        self.totals += amount
        if amount < 0:
            raise ValueError(amount)
        return float(self.totals[0])


def test_arguments_variables_and_results_are_kept_as_they_were() -> None:
    values = np.arange(3.0)
    with Watch(doubled) as seen:
        result = doubled(values)
    result[:] = 0
    call = seen.last(doubled)
    np.testing.assert_array_equal(call.given['values'], [0, 1, 2])
    np.testing.assert_array_equal(call.found['values'], [100, 101, 102])
    np.testing.assert_array_equal(call.found['twice'], [0, 2, 4])
    np.testing.assert_array_equal(call.value, [0, 2, 4])


def test_the_state_of_an_object_is_kept_before_and_after() -> None:
    counter = Counter()
    with Watch(Counter.add) as seen:
        counter.add(2)
        counter.add(3)
    first, second = seen.of(Counter.add)
    assert (first.given['self']['totals'][0], first.found['self']['totals'][0]) == (0, 2)
    assert (second.given['self']['totals'][0], second.value) == (2, 5)


def test_only_what_is_named_is_kept_and_only_inside_the_block() -> None:
    with Watch(doubled) as seen:
        Counter().add(1)
    doubled(np.zeros(1))
    assert seen.by_function() == {}
    with pytest.raises(LookupError, match='test_watch:doubled'):
        seen.last(doubled)


def test_another_profiler_is_given_its_place_back() -> None:
    events = []
    before = sys.getprofile()
    sys.setprofile(lambda *event: events.append(event))
    try:
        mine = sys.getprofile()
        with pytest.raises(ValueError, match='-1'), Watch(Counter.add):
            Counter().add(-1)
        assert sys.getprofile() is mine
    finally:
        sys.setprofile(before)


def test_names_are_those_of_the_thesis_page() -> None:
    from rgbd_kcf_tracker.thesis.kcf import KcfModel

    assert name_of(KcfModel.sample) == 'thesis.kcf:KcfModel.sample'
