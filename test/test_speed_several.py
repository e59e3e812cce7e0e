# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The measurement of what each further target costs; how fast anything is, is not tested."""

from __future__ import annotations

import csv
import io

import pytest

from rgbd_kcf_tracker import Frame, TargetSet, Track
from rgbd_kcf_tracker.bench import scaling
from rgbd_kcf_tracker.cli import bench
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.evaluation.contenders import variant
from rgbd_kcf_tracker.evaluation.speed import Setting
from rgbd_kcf_tracker.evaluation.speed_several import (
    Case,
    SpeedOfSeveral,
    measure_several,
    side_by_side,
)

SMALL = Setting(256, 144, 80)


def test_everyone_is_in_view_all_the_time() -> None:
    people = 8
    scene = side_by_side(Setting(960, 540, 300), people, 40)
    for index in (0, 20, 39):
        truths = scene.truths(index)
        assert sorted(truths) == list(range(1, people + 1))
        for truth in truths.values():
            assert truth.visible_fraction > 0.8
            assert truth.visible is not None
            assert truth.visible.height == pytest.approx(300, rel=0.15)
    assert scene.truths(0)[1].visible != scene.truths(20)[1].visible


def test_all_but_the_first_are_gone_where_lost_ones_are_timed() -> None:
    people, case = 8, Case(lost=True)
    scene = side_by_side(Setting(960, 540, 300), people, case.untimed + 30, case.lost)
    for index in range(case.untimed, len(scene), 10):
        seen = {number for number, truth in scene.truths(index).items() if truth.visible}
        assert seen == {1}
    assert sum(truth.visible is not None for truth in scene.truths(0).values()) == people


def test_too_many_targets_are_refused() -> None:
    with pytest.raises(ParameterError, match='at most 8'):
        side_by_side(Setting(960, 540, 300), 9, 20)


def test_each_further_is_the_slope_over_the_numbers_of_targets() -> None:
    # Medians 4.2, 5.0 and 6.6, means 5, 6 and 8; one slow frame counts in the mean alone.
    speed = SpeedOfSeveral(
        'x', {1: (4.0, 4.2, 6.8), 2: (5.0, 5.0, 8.0), 4: (6.6, 6.6, 10.8)}, {1: 1, 2: 1, 4: 1}
    )
    assert speed.median(2) == 5.0
    assert speed.each_further(speed.median) == pytest.approx(0.8)
    assert speed.each_further(speed.mean) == pytest.approx(1.0)


def test_one_number_of_targets_has_no_slope() -> None:
    speed = SpeedOfSeveral('x', {2: (5.0,)}, {2: 1.0})
    assert speed.each_further(speed.median) is None


def test_every_number_of_targets_is_timed_on_every_frame() -> None:
    several = [variant('metric'), variant('kcf')]
    measured = measure_several(several, SMALL, (1, 3), 6, reference=variant('kcf'))
    assert [speed.contender for speed in measured.speeds] == ['metric', 'kcf']
    for speed in measured.speeds:
        assert {n: len(spent) for n, spent in speed.milliseconds.items()} == {1: 5, 3: 5}
        assert speed.found == {1: 1.0, 3: 1.0}
    assert measured.reference is not None


def test_what_lost_targets_cost_is_of_the_time_when_they_have_gone() -> None:
    case = Case(lost=True)
    measured = measure_several([variant('metric')], SMALL, (1, 3), case.untimed + 4, case)
    (speed,) = measured.speeds
    assert {n: len(spent) for n, spent in speed.milliseconds.items()} == {1: 4, 3: 4}
    assert speed.found[1] == 1.0
    assert speed.found[3] == pytest.approx(1 / 3)
    with pytest.raises(ParameterError, match=f'give more than {case.untimed}'):
        measure_several([variant('metric')], SMALL, (1, 3), case.untimed, case)


@pytest.mark.parametrize('depth', [True, False])
def test_trackers_are_given_depth_or_none(depth: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[bool] = []
    update = TargetSet.update

    def noting(targets: TargetSet, frame: Frame) -> dict[int, Track]:
        given.append(frame.depth is not None)
        return update(targets, frame)

    monkeypatch.setattr(TargetSet, 'update', noting)
    measured = measure_several([variant('kcf')], SMALL, (1, 2), 3, Case(depth=depth))
    assert given == [depth] * 4
    assert str(measured.case).endswith('without depth') != depth


def test_a_measurement_that_was_stopped_at_once_has_no_times() -> None:
    measured = measure_several([variant('kcf')], SMALL, (1, 2), 6, stopped=lambda: True)
    (speed,) = measured.speeds
    assert speed.median(1) is None
    assert speed.each_further(speed.mean) is None


def test_bench_reports_by_number_of_targets_and_what_each_further_one_costs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench, 'THREADS', ())
    words = ['bench', '--targets', '1', '2', '--sizes', '256x144:80', '--frames', '20']
    assert main([*words, '--variants', 'kcf', '--csv']) == 0
    by_targets, further = capsys.readouterr().out.strip().split('\n\n')
    rows = list(csv.DictReader(io.StringIO(by_targets)))
    assert [(row['tracker'], row['targets']) for row in rows] == [('kcf', '1'), ('kcf', '2')]
    (row,) = csv.DictReader(io.StringIO(further))
    first, second = (float(each['median ms']) for each in rows)
    assert float(row['median ms']) == pytest.approx(second - first, abs=1e-3)


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (['--targets', '0', '1'], '--targets is 0 1'),
        (['--targets', '2', '2'], '--targets is 2 2'),
        (['--targets', '2', '--soak', '30'], 'not both'),
        (['--targets', '20'], 'at most 8'),
        (['--lost'], 'of --targets'),
        (['--without-depth'], 'of --targets'),
        (['--targets', '2', '--lost', '--frames', '30'], 'give more than'),
        (['--sizes', '64x400:400'], 'the target is 152 pixels wide'),
    ],
)
def test_wrong_targets_are_answered_in_a_sentence(
    words: list[str],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(bench, 'THREADS', ())
    assert main(['bench', *words]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    'words',
    [['--scenes', 'nix'], ['--duration', '0'], ['--jobs-each', '0'], ['--job', 'nan']],
)
def test_what_scaling_cannot_measure_is_refused(words: list[str]) -> None:
    with pytest.raises(SystemExit, match='2'):
        scaling.main(words)
