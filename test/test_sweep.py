# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Settings tried against each other: what is tried, and what is told from noise."""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import DatasetError, ParameterError
from rgbd_kcf_tracker.evaluation import sweep, sweep_tables
from rgbd_kcf_tracker.evaluation.datasets import Sequence, open_dataset
from rgbd_kcf_tracker.evaluation.metrics import sensitivity
from rgbd_kcf_tracker.parameters import describe
from rgbd_kcf_tracker.variants import VARIANTS

INFOS = {i.name: i for i in describe(VARIANTS['metric'].parameters)}
SMALL = ['--duration', '0.5', '--rate', '10', '--size', '320x180', '--jobs', '1']


def axis(text: str) -> sweep.Axis:
    (found,) = (a for a in sweep.parse_axes([text, 'most_candidates=3,4'])[1]
                if a.info.name != 'most_candidates')  # fmt: skip
    return found


# --- what is tried


@pytest.mark.parametrize(
    ('text', 'values'),
    [
        ('metric.acceptance=0.3:0.7:5', ('0.3', '0.4', '0.5', '0.6', '0.7')),
        ('acceptance=0.2,0.4', ('0.2', '0.4')),
        ('acceptance=0.4', ('0.4',)),
        ('particles=16:20:9', ('16', '17', '18', '19', '20')),
        ('acceleration=1:100:3:log', ('1', '10', '100')),
    ],
)
def test_values_of_a_parameter(text: str, values):
    assert axis(text).values == values


def test_a_parameter_alone_has_its_own_range():
    found = axis('acceptance')
    assert (found.low, found.high) == (INFOS['acceptance'].minimum, INFOS['acceptance'].maximum)
    assert len(found.values) == sweep.STEPS


@pytest.mark.parametrize(
    ('items', 'message'),
    [
        (['acceptance=0.3:7:5'], 'acceptance is 7'),
        (['acceptance=0.7:0.3'], 'LOW must be below HIGH'),
        (['acceptance=0.3:0.7:1'], 'N from 2'),
        (['acceptance=0.3:0.7:x'], 'give LOW:HIGH'),
        (['floor_margin=0:0.5:log'], 'LOW must be above 0'),
        (['nonsense=1,2'], "metric has no parameter 'nonsense'"),
        (['deep.acceptance=1,2'], "unknown variant 'deep'"),
        (['kcf.padding=1,2', 'metric.acceptance'], 'a sweep is of one variant'),
        (['acceptance=0.3', 'particles=64'], 'nothing to try'),
        (['acceptance', 'acceptance=0.3,0.4'], 'given twice'),
        (['acceptance='], 'give values'),
    ],
)
def test_a_search_that_cannot_be_is_refused(items, message: str):
    with pytest.raises(ParameterError, match=message):
        sweep.parse_axes(items)


def test_a_grid_has_every_combination_once():
    _, axes = sweep.parse_axes(['acceptance=0.3,0.5', 'particles=32,64,128', 'jump=0.05'])
    settings = sweep.grid('metric', axes)
    assert len({s.contender.name for s in settings}) == 6
    assert all(dict(s.contender.overrides)['jump'] == '0.05' for s in settings)
    default = sweep.baseline('metric', axes)
    assert dict(default.contender.overrides) == {'jump': '0.05'}
    _, axes = sweep.parse_axes(['acceptance=0.1:0.9:200', 'particles=16:9000:200'])
    with pytest.raises(ParameterError, match='40000 settings'):
        sweep.grid('metric', axes)


def test_a_random_search_is_the_same_for_a_seed_and_grows():
    _, axes = sweep.parse_axes(['acceptance', 'acceleration=1:10:log', 'particles=32,64'])
    few = [s.contender for s in sweep.random('metric', axes, 5, 3)]
    more = [s.contender for s in sweep.random('metric', axes, 9, 3)]
    assert more[:5] == few
    assert [s.contender for s in sweep.random('metric', axes, 5, 4)] != few
    values = [dict(s.overrides) for s in more]
    assert all(0.01 <= float(v['acceptance']) <= 0.99 for v in values)
    assert all(1 <= float(v['acceleration']) <= 10 for v in values)
    assert {v['particles'] for v in values} == {'32', '64'}


def test_of_every_scenario_the_same_share_is_held_out():
    sequences = open_dataset('sim:normal,occlusion,crowd:1-10')
    tried, held = sweep.split(sequences, 0.3, 0)
    assert len(held) == 9
    assert not {s.name for s in tried} & {s.name for s in held}
    assert all(sum(s.scenario == n for s in held) == 3 for n in ('normal', 'occlusion', 'crowd'))
    assert sweep.split(sequences, 0.3, 0) == (tried, held)
    assert sweep.split(sequences, 0.3, 1) != (tried, held)


def test_people_of_one_recording_are_not_parted():
    def person(recording: str, name: str) -> Sequence:
        return Sequence(
            f'{recording}/{name}', recording, 'folder', None, 'x', path=Path('/data', recording)
        )

    sequences = [person(f'r{i}', name) for i in range(4) for name in ('ann', 'bob')]
    tried, held = sweep.split(sequences, 0.5, 0)
    assert len(tried) == len(held) == 4
    assert not {s.path for s in tried} & {s.path for s in held}
    with pytest.raises(DatasetError, match='too few'):
        sweep.split(sequences[:2], 0.5, 0)
    with pytest.raises(ParameterError, match='between 0 and 1'):
        sweep.split(sequences, 1.5, 0)


# --- what is told from noise


def noisy(rng: np.random.Generator, settings: int, sequences: int) -> np.ndarray:
    return 0.6 + 0.2 * rng.normal(size=sequences) + 0.02 * rng.normal(size=(settings, sequences))


@pytest.mark.parametrize('balanced', [True, False])
def test_a_parameter_that_matters_is_told_from_one_that_does_not(balanced: bool):
    rng = np.random.default_rng(1)
    first, second = np.divmod(np.arange(25), 5)
    scores = noisy(rng, 25, 20) + 0.03 * first[:, None]
    strong = sensitivity.effect(scores, first, balanced, np.arange(20))
    weak = sensitivity.effect(scores, second, balanced, np.arange(20))
    assert strong.p < 0.01
    assert weak.p > 0.05
    assert strong.share > 0.9 > 0.1 > weak.share
    assert strong.span == pytest.approx(0.12, abs=0.02)
    assert np.all(strong.low < strong.means)
    assert np.all(strong.means < strong.high)


@pytest.mark.parametrize('balanced', [True, False])
def test_noise_is_taken_for_more_about_as_often_as_the_level_says(balanced: bool, monkeypatch):
    monkeypatch.setattr(sensitivity, 'ROUNDS', 200)
    rng = np.random.default_rng(2)
    labels = np.arange(12) % 3
    ps = [
        sensitivity.effect(noisy(rng, 12, 8), labels if balanced else rng.permutation(labels),
                           balanced, np.arange(8)).p
        for _ in range(120)
    ]  # fmt: skip
    assert 0.01 <= np.mean(np.array(ps) < 0.05) <= 0.10
    assert 0.4 < np.mean(ps) < 0.6


def test_a_parameter_that_does_nothing_has_p_1():
    scores = np.tile(np.linspace(0.2, 0.9, 7), (6, 1))
    one = sensitivity.effect(scores, np.arange(6) % 3, True, np.arange(7))
    assert (one.p, one.share, one.span) == (1.0, 0.0, 0.0)


def test_gains_on_few_and_on_many_sequences():
    rng = np.random.default_rng(3)
    many = sensitivity.gain(0.02 + 0.01 * rng.normal(size=30), np.arange(30))
    assert many is not None
    assert 0 < many.low < many.mean < many.high
    assert many.p < 0.01
    one = sensitivity.gain(np.array([0.5]), np.arange(1))
    assert one is not None
    assert one.p == 1.0, 'one sequence tells nothing'
    assert math.isnan(one.low), 'nor has it an interval'
    assert sensitivity.gain(np.zeros(5), np.arange(5)) == sensitivity.Gain(0.0, 0.0, 0.0, 1.0)
    assert sensitivity.gain(np.array([0.1, math.nan, 0.2]), np.arange(3)) is None


def test_people_of_one_recording_are_one_draw(monkeypatch):
    """Noise of three recordings is no gain and no effect, however many people are in each."""
    monkeypatch.setattr(sensitivity, 'ROUNDS', 200)
    rng = np.random.default_rng(4)
    recordings = sensitivity.numbered(['a'] * 6 + ['b'] * 6 + ['c'] * 6)
    assert recordings.tolist() == [0] * 6 + [1] * 6 + [2] * 6
    for _ in range(40):
        one = np.repeat(rng.normal(size=(9, 3)), 6, axis=1) + 0.3 * rng.normal(size=(9, 18))
        found = sensitivity.gain(one[0], recordings)
        assert found is not None
        assert found.p > 0.05, 'the smallest of three signs is a quarter'
    ps = [
        sensitivity.effect(np.repeat(rng.normal(size=(9, 3)), 6, axis=1), np.arange(9) % 3, True,
                           recordings).p
        for _ in range(60)
    ]  # fmt: skip
    assert np.mean(np.array(ps) < 0.05) <= 0.15


def test_whole_numbers_are_drawn_alike_the_ends_too():
    (info,) = (i for i in describe(VARIANTS['metric'].parameters) if i.name == 'seed')
    rng = np.random.default_rng(1)
    for log, low in ((False, 0), (True, 1)):
        drawn = [int(sweep.Axis(info, ('0', '4'), low, 4, log).draw(rng)) for _ in range(4000)]
        counts = np.bincount(drawn, minlength=5)[low:]
        assert set(drawn) == set(range(low, 5))
        if not log:
            assert counts.min() > 700


def test_holm_bounds():
    assert sensitivity.holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert sensitivity.holm([]) == []


def test_values_are_put_into_equally_full_bins():
    values = np.random.default_rng(0).uniform(size=50)
    labels = sensitivity.binned(values, 5)
    assert np.bincount(labels).tolist() == [10] * 5
    assert np.all(np.diff(labels[np.argsort(values)]) >= 0)
    assert sensitivity.binned(np.array([3.0, 1.0, 3.0]), 5).tolist() == [1, 0, 1]
    skewed = sensitivity.binned(np.array([1.0] * 20 + [2, 3, 4, 5, 6]), 3)
    assert set(skewed) == set(range(skewed.max() + 1)), 'no bin is empty'


def test_the_best_leave_out_settings_that_failed():
    tried = np.array([[0.5, 0.5], [0.9, np.nan], [0.6, 0.8], [0.4, 0.6], [0.7, 0.9]])
    assert sweep_tables.best(tried, 2, 1.0) == (3, 1)
    assert sweep_tables.best(tried, 2, -1.0) == (2, 1)
    assert sweep_tables.best(tried, 9, 1.0) == (3, 1, 2)


# --- the command


def test_a_sweep_from_the_command_line(tmp_path: Path, capsys):
    words = ['sweep', 'sim:normal,occlusion', '--seeds', '1-2', '--param',
             'kcf.padding=1.5,2.5', '--param', 'kcf.learning_rate=0.02,0.4', '--held-out', '0.5',
             '--finalists', '2', *SMALL]  # fmt: skip
    report = tmp_path / 'r'
    assert main([*words, '--report', str(report)]) == 0
    out = capsys.readouterr().out
    assert 'The best settings on 2 held-out sequences' in out
    assert 'What matters and what is noise' in out
    rows = list(csv.reader((report / 'settings.csv').open()))
    assert rows[0] == ['setting', 'padding', 'learning_rate', 'success', 'success_held_out']
    assert len(rows) == 1 + 1 + 4
    assert sum(bool(row[4]) for row in rows[1:]) == 3, 'the default and two finalists'
    assert len(list((report / 'results').iterdir())) == 5
    numbers = json.loads((report / 'report.json').read_text())
    assert set(numbers['tables']) == {'held_out', 'parameters', 'best_settings'}
    page = (report / 'index.html').read_text()
    assert 'What matters and what is noise' in page
    assert page.count('<img') == 1
    footer = page[page.index('<footer>') :]
    assert '<code>settings.csv</code>' in footer
    for name in re.findall(r'<code>([a-z_.]+)/?</code>', footer):
        assert (report / name).exists(), name

    before = {p: p.stat().st_mtime_ns for p in (report / 'results').rglob('*.csv')}
    assert main([*words, '--report', str(report)]) == 0
    assert {p: p.stat().st_mtime_ns for p in (report / 'results').rglob('*.csv')} == before
    # In two parts that share a folder, and a last call that joins them: the same bytes.
    for part in ('1/2', '2/2'):
        assert main([*words, '--shard', part, '--report', str(tmp_path / 's')]) == 0
    assert main([*words, '--report', str(tmp_path / 's')]) == 0
    for name in ('index.html', 'report.json', 'settings.csv', 'tables.md'):
        assert (tmp_path / 's' / name).read_bytes() == (report / name).read_bytes()


def test_where_every_run_fails_the_reason_is_told(tmp_path: Path, capsys):
    """It named a file of failures that is only written with the report."""
    data = tmp_path / 'data'
    assert main(['simulate', str(data), '--count', '2', *SMALL[:-2]]) == 0
    for image in data.glob('*/rgb/000002.png'):
        image.write_bytes(b'')
    words = ['sweep', str(data), '--report', str(tmp_path / 'out'), '--jobs', '1']
    assert main([*words, '--variant', 'kcf', '--param', 'padding=1:2:2']) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert 'nothing was measured: normal_' in error
    assert '000002.png' in error
    assert not (tmp_path / 'out').exists()


def test_the_report_is_not_written_into_data_that_are_held_out(tmp_path: Path, capsys):
    held = tmp_path / 'held'
    (held / 'rgb').mkdir(parents=True)
    words = ['sweep', 'sim:normal', '--param', 'acceptance', '--held-out', str(held)]
    assert main([*words, '--report', str(held / 'report'), '--overwrite']) == 2
    assert 'lies inside the source' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (['--param', 'acceptance=2:3:4'], 'acceptance is'),
        (['--param', 'acceptance', '--measure', 'beauty'], 'choose from success'),
        (['--param', 'acceptance', '--finalists', '0'], '--finalists is 0'),
        (['--param', 'acceptance', '--search', 'random', '--samples', '0'], '--samples is 0'),
        (['--param', 'acceptance', '--held-out', '2'], 'between 0 and 1'),
        (['--param', 'acceptance', '--held-out', 'sim:normal:1-9'], 'is among the data, too'),
        (['--param', 'acceptance', '--held-out', '/nowhere'], 'does not exist'),
        (['--param', 'acceptance', '--seeds', '1'], 'too few'),
    ],
)
def test_mistakes_are_told_before_any_work(tmp_path: Path, capsys, words, message: str):
    argv = ['sweep', 'sim:normal', '--seeds', '1-2', *words, '--report', str(tmp_path / 'r')]
    assert main(argv) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / 'r').exists()
