# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Tables, plots and the page, and the command that makes them."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
import re
import shutil
import zipfile
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.io import savemat

from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.evaluation import plots, score_tables, strips, thesis, thesis_tables
from rgbd_kcf_tracker.evaluation.categories import derive
from rgbd_kcf_tracker.evaluation.measured import Measured
from rgbd_kcf_tracker.evaluation.metrics import calibration, compare, princeton, vot
from rgbd_kcf_tracker.evaluation.perframe import Info, Result, read_per_frame, write_per_frame
from rgbd_kcf_tracker.evaluation.store import Truth
from rgbd_kcf_tracker.evaluation.table import Table
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import Parameters, parameter
from rgbd_kcf_tracker.track import Track, TrackState
from rgbd_kcf_tracker.variants import VARIANTS, Variant

TRUTH = Box(10, 10, 20, 20)
AWAY = Box(200, 100, 20, 20)
SPLITS = tuple(princeton.CATEGORIES)
HIDDEN = dict(zip(SPLITS, ('human', 'large', 'slow', 'yes', 'active'), strict=True))
FAST = dict(zip(SPLITS, ('rigid', 'small', 'fast', 'no', 'passive'), strict=True))


def result(tracker: str, sequence: str, said, there, score: float = 0.8) -> Result:
    frames = compare(said, there, scores=np.full(len(said), score), skip=0)
    count = len(said)
    stamps = tuple(i * 100_000_000 for i in range(count))
    return Result(
        tracker, sequence, stamps, frames, np.full(count, np.nan), np.ones(count, np.bool_)
    )


@pytest.fixture
def results() -> list[Result]:
    """Two sequences: in the first the target hides for two of five frames, in the second never."""
    hides = [TRUTH, TRUTH, None, None, TRUTH]
    return [
        result('kcf', 'a', [TRUTH, TRUTH, AWAY, AWAY, AWAY], hides),
        result('rgbd', 'a', [TRUTH, TRUTH, None, None, TRUTH.moved(1, 0)], hides),
        result('kcf', 'b', [TRUTH] * 3, [TRUTH] * 3),
        result('rgbd', 'b', [TRUTH, TRUTH, None], [TRUTH] * 3),
    ]


@pytest.fixture
def measured(results: list[Result]) -> Measured:
    infos = {
        'a': Info('a', 'occlusion', 'sim', HIDDEN),
        'b': Info('b', 'motion', 'sim', FAST),
    }
    return Measured(results, infos)


def cells(table: Table, label: str) -> dict[str, object]:
    (row,) = [r for r in table.rows if r[0] == label]
    return dict(zip(table.columns, row, strict=True))


def test_per_frame_file_gives_back_the_same_measures(tmp_path: Path, results: list[Result]):
    path = tmp_path / 'per_frame.csv'
    write_per_frame(path, results)
    again = read_per_frame(path)
    assert len(path.read_text().splitlines()) == 1 + 5 + 5 + 3 + 3
    for one, two in zip(results, again, strict=True):
        for a, b in zip(_values(one), _values(two), strict=True):
            assert a == pytest.approx(b, nan_ok=True, rel=1e-5)


def _values(r: Result) -> list[float]:
    m = r.measures()
    return [getattr(m, name) for name in m.__slots__]


def test_per_frame_file_that_is_damaged_is_named(tmp_path: Path, results: list[Result]):
    path = tmp_path / 'per_frame.csv'
    write_per_frame(path, results)
    text = path.read_text()
    path.write_text(text + 'kcf,a,1\n')
    with pytest.raises(Exception, match=r'per_frame.csv, line 18: 3 cells'):
        read_per_frame(path)


def test_overview_is_the_mean_over_sequences(measured: Measured):
    row = cells(score_tables.overview(measured), 'rgbd')
    assert row['success %'] == pytest.approx(100 * (1 + 0.5) / 2)
    assert row['recall of absence %'] == pytest.approx(100), 'only one sequence has absence'
    assert row['TN %'] == pytest.approx(50), '2 of 2, and 0 of 1'
    assert cells(score_tables.overview(measured), 'kcf')['TN %'] is None


def test_scenario_tables(measured: Measured):
    success = score_tables.by_scenario(measured)[0]
    assert cells(success, 'occlusion')['kcf'] == pytest.approx(25)
    assert cells(success, 'motion')['kcf'] == pytest.approx(100)
    assert cells(success, 'all')['kcf'] == pytest.approx(62.5)


def test_table_3_2_has_scenarios_across_and_the_thesis_below(measured: Measured):
    table = thesis_tables.table_3_2(measured, 'kcf')
    assert table.columns == ('', 'occlusion', 'motion')
    assert cells(table, 'data set 1')['occlusion'] == pytest.approx(1 / 4)
    assert cells(table, 'average')['motion'] == 1
    assert cells(table, 'thesis: KCF, average')['occlusion'] == 0.7008


def test_table_4_1_splits_agree_with_the_overall(measured: Measured):
    table = thesis_tables.table_4_1(measured)
    row = cells(table, 'kcf')
    assert row['occluded'] == pytest.approx(25)
    assert row['not occluded'] == pytest.approx(100)
    assert row['animal'] is None
    assert row['all'] == pytest.approx((row['human'] + row['rigid']) / 2)
    assert cells(table, 'thesis: RGB-D KCF')['occluded'] == 47
    assert cells(table, 'number of sequences')['human'] == 1


def test_a_sequence_without_a_frame_that_counts_is_left_out_of_table_4_1(
    results: list[Result],
):
    alone = [dataclasses.replace(r, sequence='c', judged=np.zeros(3, bool)) for r in results[2:]]
    infos = {
        'a': Info('a', 'occlusion', 'sim', HIDDEN),
        'b': Info('b', 'motion', 'sim', FAST),
        'c': Info('c', 'motion', 'sim', FAST),
    }
    table = thesis_tables.table_4_1(Measured([*results, *alone], infos))
    assert cells(table, 'kcf')['not occluded'] == pytest.approx(100)
    assert cells(table, 'kcf')['all'] == pytest.approx(62.5)
    number = cells(table, 'number of sequences')
    assert (number['not occluded'], number['all']) == (1, 2)


def test_tables_4_5_5_1_and_5_2(measured: Measured):
    ap = cells(thesis_tables.table_4_5(measured), 'kcf')['AP %']
    assert ap == pytest.approx(100 * (1 / 4 + 1) / 2)
    by_key = {t.key: t for t in thesis_tables.matrices(measured)}
    hidden = by_key['table_5_1']
    assert cells(hidden, 'kcf')['TP %'] == pytest.approx(25)
    assert cells(hidden, 'kcf')['TN %'] == 'cannot be determined'
    assert cells(hidden, 'rgbd')['TN %'] == pytest.approx(100)
    assert cells(hidden, 'thesis: RGB-D-PF')['TP %'] == 74.07
    assert cells(by_key['table_5_2'], 'rgbd')['FN %'] == pytest.approx(100)
    assert cells(by_key['confusion_method_1'], 'rgbd')['TP %'] == pytest.approx(100 * 3 / 6)


def test_quoted_rows_of_the_thesis_add_up():
    for rows in (thesis.KINECT_CONFUSION, thesis.OCCLUSION_CONFUSION, thesis.FAST_CONFUSION):
        for tp, fp, fn, tn in rows.values():
            assert tp + fp == pytest.approx(100)
            assert fn is None or fn + tn == pytest.approx(100)


def test_the_thesis_row_of_table_4_1_is_not_self_consistent():
    """Weights that fit published rows: KCF's splits agree with each other, the thesis's do not."""
    weights = ((0.43, 0.19, 0.38), (0.41, 0.59), (0.31, 0.69), (0.575, 0.425), (0.29, 0.71))

    def spread(row: tuple[float, ...]) -> float:
        means, start = [], 0
        for share in weights:
            means.append(float(np.dot(share, row[start : start + len(share)])))
            start += len(share)
        return max(means) - min(means)

    assert spread(thesis.PRINCETON['thesis: KCF']) < 1
    assert spread(thesis.PRINCETON['thesis: RGB-D KCF']) > 7


def test_ablation_table_shows_what_is_lost(results: list[Result]):
    renamed = [
        dataclasses.replace(r, tracker='kcf without hog') if r.tracker == 'kcf' else r
        for r in results
    ]
    infos = {n: Info(n, 's', 'sim', HIDDEN) for n in ('a', 'b')}
    table = score_tables.ablation(Measured(renamed, infos), 'rgbd')
    assert [row[0] for row in table.rows] == ['rgbd']
    other = [
        dataclasses.replace(r, tracker='rgbd without depth') if r.tracker == 'kcf' else r
        for r in results
    ]
    table = score_tables.ablation(Measured(other, infos), 'rgbd')
    change = {row[0]: row[2] for row in table.rows}
    assert change == {'rgbd': None, 'rgbd without depth': pytest.approx(62.5 - 75)}


def test_otb_table_counts_the_first_frame_as_the_benchmark_does(results: list[Result]):
    infos = {n: Info(n, 'otb', 'otb', HIDDEN) for n in ('a', 'b')}
    table = score_tables.otb_protocol(Measured(results, infos))
    assert cells(table, 'kcf')['precision at 20 px'] == pytest.approx((2 / 3 + 1) / 2)
    assert (
        score_tables.otb_protocol(Measured(results, {n: Info(n, 's', 'sim') for n in 'ab'})) is None
    )


def test_a_tracker_without_an_otb_sequence_has_no_otb_numbers(results: list[Result]):
    infos = {'a': Info('a', 'otb', 'otb', HIDDEN), 'b': Info('b', 's', 'sim', HIDDEN)}
    table = score_tables.otb_protocol(Measured(results[1:], infos))
    assert cells(table, 'kcf') == {
        'tracker': 'kcf', 'sequences': 0, 'precision at 20 px': None, 'AUC': None
    }  # fmt: skip


def test_short_term_table():
    run = vot.ShortTermRun(np.array([1, *[3] * 19]), np.array([1.0, *[0.6] * 19]))
    table = thesis_tables.short_term({('kcf', 'a'): run, ('kcf', 'b'): run})
    row = cells(table, 'kcf')
    assert row['accuracy'] == pytest.approx(0.6)
    assert row['robustness (failures)'] == 0


def test_scores_that_never_vary_have_no_reliability(measured: Measured):
    table, found = score_tables.reliability(measured)
    assert found == {}
    assert cells(table, 'kcf')['Brier'] is None


def test_scores_that_are_infinite_never_vary(results: list[Result]):
    endless = [
        result(r.tracker, r.sequence, [TRUTH] * 3, [TRUTH] * 3, math.inf) for r in results[2:]
    ]
    table, found = score_tables.reliability(
        Measured(endless, {'b': Info('b', 'motion', 'sim', FAST)})
    )
    assert found == {}
    assert cells(table, 'kcf')['Brier'] is None


def test_scores_on_real_and_simulated_data_apart():
    good, bad = [TRUTH] * 4, [TRUTH, AWAY, AWAY, TRUTH]
    runs = [
        result('metric', 'a', good, [TRUTH] * 4, 0.95),
        result('metric', 'a2', bad, [TRUTH] * 4, 0.5),
        result('metric', 'b', bad, [TRUTH] * 4, 0.9),
        result('metric', 'b2', good, [TRUTH] * 4, 0.3),
    ]
    kinds = {'a': 'sim', 'a2': 'sim', 'b': 'folder', 'b2': 'recording'}
    infos = {n: Info(n, 's', kind, HIDDEN, simulated=kind == 'sim') for n, kind in kinds.items()}
    table, found = score_tables.reliability(Measured(runs, infos))
    assert list(found) == [('metric', 'real'), ('metric', 'simulated')]
    real, simulated = (dict(zip(table.columns, row, strict=True)) for row in table.rows)
    sure = 'of 0.9 and more'
    assert (real['data'], real['boxes'], real[sure]) == ('real', 6, 3)
    assert real[f'{sure}: on the target %'] == pytest.approx(100 / 3)
    assert simulated[f'{sure}: on the target %'] == simulated[f'{sure}: right %'] == 100
    assert len(plots.honesty_plot(found)) > 1000
    curves = [np.array([0.34, 1.0, np.nan]), np.array([0.999, 1.0])]
    assert [plots.least_shown(curves[i:]) for i in (0, 1)] == [0.3, 0.9]
    assert plots.least_shown([np.full(3, np.nan)]) == 0.9, 'scores below 0, as of other trackers'
    assert len(plots.reliability_plot(found)) > 1000


def test_a_legend_lies_on_no_curve(monkeypatch: pytest.MonkeyPatch):
    figures = []
    monkeypatch.setattr(plots.plot_style, 'png', figures.append)
    table = calibration.reliability(np.linspace(0.05, 0.95, 10), np.ones(10, bool))
    plots.pairs_plot({'a': table, 'b': table})
    figures[0].canvas.draw()
    first = figures[0].axes[0]
    legend = first.get_legend().get_window_extent()
    assert legend.y0 >= 0, 'and is not cut off'
    assert legend.y1 < first.xaxis.label.get_window_extent().y0


def test_interval_of_the_mean():
    values = np.array([0.4, 0.5, 0.6, 0.5] * 20)
    low, high = score_tables.bootstrap_interval(values, np.arange(80))
    assert 0.47 < low < 0.5 < high < 0.53
    assert math.isnan(score_tables.bootstrap_interval(np.array([0.4]), np.arange(1))[0])
    # Twenty people in each of four recordings are four draws, not eighty.
    together = score_tables.bootstrap_interval(values, np.arange(80) % 4)
    assert together == pytest.approx(score_tables.bootstrap_interval(values[:4], np.arange(4)))
    one = np.zeros(80, np.int64)
    assert all(math.isnan(v) for v in score_tables.bootstrap_interval(values, one))


def test_tables_as_csv_text_and_markdown():
    table = Table('k', 'Title', ('tracker', 'a %'), (('x', 1.25), ('thesis: y', None)), best='max')
    assert table.csv() == 'tracker,a %\nx,1.25\nthesis: y,\n'
    assert table.text().splitlines() == [
        'Title',
        'tracker    a %',
        'x          1.2',
        'thesis: y    -',
    ]
    assert table.markdown().splitlines()[1] == '| --- | ---: |'
    two = Table('k', 't', ('tracker', 'a'), (('x', 1.0), ('y', 2.0), ('thesis', 9.0)), best='max')
    assert [two.is_best(row, 1) for row in two.rows] == [False, True, False]
    piped = Table('k', 't', ('tracker', 'a|b'), (('x|y', 1.0),))
    assert piped.markdown().splitlines() == [
        '| tracker | a\\|b |',
        '| --- | ---: |',
        '| x\\|y | 1.0 |',
    ]
    nothing = Table('k', 't', ('tracker', 'a'), (('x', math.nan), ('y', 2.0)), best='max')
    assert nothing.csv() == 'tracker,a\nx,\ny,2\n'
    assert nothing.cells()[1] == ['x', '-']
    assert not any(nothing.is_best(row, 1) for row in nothing.rows), 'one alone is not the best'


def truth_of(boxes: list[tuple[float, ...]], fraction: float = 1.0, hz: float = 10.0) -> Truth:
    stamps = tuple(round(i * 1e9 / hz) for i in range(len(boxes)))
    count = len(boxes)
    whole = np.ones(count, np.bool_)
    return Truth(stamps, np.array(boxes, np.float64), None, np.full(count, fraction), whole)


def test_categories_by_our_own_criteria():
    still = truth_of([(0, 0, 20, 20)] * 5)
    assert derive(still, (100, 100), 'normal') == dict(
        zip(SPLITS, ('human', 'large', 'slow', 'no', 'active'), strict=True)
    )
    assert derive(still, (1000, 1000), 'small_animal')['target size'] == 'small'
    assert derive(still, (100, 100), 'small_animal')['target type'] == 'animal'
    assert derive(still, (100, 100), 'ball_game')['motion type'] == 'passive'
    quick = truth_of([(5.0 * i, 0, 20, 20) for i in range(9)])  # 50 px/s, 2.5 sizes a second
    assert derive(quick, (100, 100), 'x')['movement'] == 'fast'
    assert derive(truth_of([(0, 0, 9, 9)] * 3, 0.3), (99, 99), 'x')['occlusion'] == 'yes'
    gone = truth_of([(0, 0, 9, 9), (np.nan,) * 4, (0, 0, 9, 9)])
    assert derive(gone, (99, 99), 'x')['occlusion'] == 'yes'


def test_strips_choose_frames_spread_out_and_interesting():
    kept = np.arange(0, 100, 2)
    wrong = np.zeros(100, bool)
    wrong[40:50] = True
    chosen = strips.choose(kept, wrong)
    assert len(chosen) == strips.FRAMES
    assert chosen[0] == 0
    assert chosen[-1] == 98
    assert sum(40 <= i < 50 for i in chosen) >= 3
    assert strips.choose(np.arange(3), wrong) == [0, 1, 2]


def test_a_strip_fits_pictures_of_several_sizes_and_truth_far_outside(tmp_path: Path):
    with zipfile.ZipFile(tmp_path / 'p.zip', 'w') as file:
        for number, shape in enumerate([(60, 80), (40, 120), (30, 40)]):
            picture = np.full((*shape, 3), 90, np.uint8)
            file.writestr(f'{number}.jpg', cv2.imencode('.jpg', picture)[1].tobytes())
    truth = np.array([[10, 10, 2e8, 40], [10, -1e300, 20, 2e300], [1e300, 5, 20, 20]])
    drawn = strips.strip(
        tmp_path / 'p.zip', 1.0, truth, {'kcf': truth}, {'kcf': '#00ff00'}, 'kcf', np.zeros(3, bool)
    )
    sheet = cv2.imdecode(np.frombuffer(drawn, np.uint8), cv2.IMREAD_COLOR)
    assert sheet.shape == (90, 3 * (180 + 4) - 4, 3), 'the largest height and width for each'
    # The line of the first truth goes to the right edge of its picture, at 1.5 times its size.
    assert np.ptp(sheet[10:20, 60:118].astype(int), axis=(0, 1)).min() > 60


def write_scene(path: Path, frames: int, shift: int) -> None:
    """A folder in our layout: a patch walks over a wall and is gone for a while."""
    rng = np.random.default_rng(shift)
    wall = cv2.resize(rng.integers(0, 255, (12, 16, 3), np.uint8), (160, 120))
    patch = cv2.resize(rng.integers(0, 255, (6, 4, 3), np.uint8), (30, 40))
    lines = []
    (path / 'rgb').mkdir(parents=True)
    for i in range(frames):
        image, x = wall.copy(), 20 + shift * i
        gone = 8 <= i < 11
        if not gone:
            image[50:90, x : x + 30] = patch
        lines.append('nan,nan,nan,nan' if gone else f'{x},50,30,40')
        cv2.imwrite(str(path / 'rgb' / f'{i:06d}.png'), image)
    (path / 'groundtruth.txt').write_text('\n'.join(lines) + '\n')


class Page(HTMLParser):
    """Collects the page's pictures, tables and outside links."""

    def __init__(self) -> None:
        super().__init__()
        self.images: list[str] = []
        self.links: list[str] = []
        self.tables = 0

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.tables += tag == 'table'
        if tag == 'img':
            self.images.append(values['src'])
        self.links += [v for k, v in attrs if k in ('src', 'href') and v]


@pytest.fixture
def scenes(tmp_path: Path) -> Path:
    write_scene(tmp_path / 'data' / 'walk_1', 16, 2)
    write_scene(tmp_path / 'data' / 'walk_2', 16, 3)
    return tmp_path / 'data'


def test_the_command_writes_a_page_that_stands_alone(scenes: Path, tmp_path: Path, capsys):
    report = tmp_path / 'report'
    good = ''.join(f'{20 + 2 * i},50,30,40\n' for i in range(16))
    (tmp_path / 'walk_1.txt').write_text(good)
    (tmp_path / 'walk_2.txt').write_text(good)
    truth = scenes / 'walk_2' / 'groundtruth.txt'
    shutil.copy(truth, truth.with_name('groundtruth_body.txt'))
    code = main([
        'evaluate', str(scenes), '--variants', 'kcf', '--boxes', f'peer={tmp_path}', '--jobs', '1',
        '--short-term', '--eao-lengths', '3-9', '--report', str(report),
        '--export', 'vot', '--export', 'princeton',
    ])  # fmt: skip
    assert code == 0
    printed = capsys.readouterr().out
    assert 'kcf' in printed
    assert str(report / 'index.html') in printed

    html = (report / 'index.html').read_text()
    page = Page()
    page.feed(html)
    assert page.tables >= 12
    assert all(link.startswith(('data:', '#')) for link in page.links), 'nothing from outside'
    assert len(page.images) >= 8
    numbers = json.loads((report / 'report.json').read_text())
    with (report / 'tables' / 'overview.csv').open() as file:
        rows = {row['tracker']: row for row in csv.DictReader(file)}
    overview = numbers['tables']['overview']
    for row in overview['rows']:
        value = row[overview['columns'].index('success %')]
        assert float(rows[row[0]]['success %']) == pytest.approx(value, rel=1e-5)
        assert re.search(rf'<td[^>]*>{value:.1f}</td>', html)
    assert '| kcf |' in (report / 'tables.md').read_text()
    scored = numbers['tables']['reliability']['rows']
    apart = [('kcf', 'real'), ('kcf', 'simulated'), ('peer', 'real'), ('peer', 'simulated')]
    assert [tuple(row[:2]) for row in scored] == apart, 'a simulated scene was taken for a real one'
    assert set(numbers['sequences']) == {'walk_1', 'walk_2'}
    assert numbers['sequences']['walk_1']['scenario'] == 'walk'
    assert (report / 'submission' / 'vot' / 'kcf' / 'baseline' / 'walk_1').is_dir()

    measured = Measured(
        read_per_frame(report / 'per_frame.csv'),
        {n: Info(n, 'walk', 'folder', HIDDEN) for n in ('walk_1', 'walk_2')},
    )
    assert cells(score_tables.overview(measured), 'peer')['success %'] == pytest.approx(
        float(rows['peer']['success %']), rel=1e-5
    )


@dataclass(frozen=True)
class ToyParameters(Parameters):
    use_motion: bool = parameter(True, 'Move with the patch.')
    use_luck: bool = parameter(True, 'Changes nothing.')
    use_magic: bool = parameter(False, 'Off by default.')
    speed: float = parameter(2.0, 'Pixels per frame.')


class ToyTracker:
    """Moves its box by a constant, or leaves it where it was."""

    def __init__(self, parameters: ToyParameters) -> None:
        self.step = parameters.speed if parameters.use_motion else 0.0

    def start(self, frame, box):
        self.box = box
        return Track(box, TrackState.TRACKING, 1.0)

    def update(self, frame):
        self.box = self.box.moved(self.step, 0)
        return Track(self.box, TrackState.TRACKING, 0.5)


def test_ablation_switches_each_ingredient_off_in_turn(
    scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
):
    monkeypatch.setitem(VARIANTS, 'toy', Variant('toy', 'a toy', ToyParameters, ToyTracker))
    report = tmp_path / 'report'
    words = ['evaluate', str(scenes), '--sequences', 'walk_1', '--variants', 'toy,kcf', '--ablate']
    assert main([*words, '--param', 'toy.speed=2', '--jobs', '1', '--report', str(report)]) == 0
    (path,) = (report / 'tables').glob('ablation_*.csv')
    with path.open() as file:
        rows = list(csv.reader(file))[1:]
    names = [row[0] for row in rows]
    base = 'toy speed=2'
    assert names == [base, f'{base} without motion', f'{base} without luck']
    success, change = ([row[i] for row in rows] for i in (1, 2))
    assert float(success[0]) > float(success[1]) + 20
    assert float(change[1]) == pytest.approx(float(success[1]) - float(success[0]), abs=1e-3)
    assert (change[0], float(change[2])) == ('', 0)
    assert f'What {base} loses without each ingredient' in (report / 'index.html').read_text()
    assert 'without motion' in capsys.readouterr().out


def test_princetons_test_set_is_run_and_written_but_not_measured(tmp_path: Path, capsys):
    path = tmp_path / 'data' / 'cafe_occ1'
    for folder, letter in (('rgb', 'r'), ('depth', 'd')):
        (path / folder).mkdir(parents=True)
        for i in range(3):
            image = np.full((60, 80), 8000 + 100 * i, np.uint16)
            if letter == 'r':
                image = np.random.default_rng(1).integers(0, 255, (60, 80, 3), np.uint8)
            cv2.imwrite(str(path / folder / f'{letter}-{i}-{i}.png'), image)
    numbers = {f'{k}{w}': [0, 1, 2] for k in ('image', 'depth') for w in ('Timestamp', 'FrameID')}
    savemat(path / 'frames.mat', {'frames': {'length': 3, **numbers}})
    (path / 'init.txt').write_text('20,10,20,30\n')
    report = tmp_path / 'report'
    words = ['evaluate', str(tmp_path / 'data'), '--variants', 'kcf', '--jobs', '1']
    assert main([*words, '--report', str(report), '--export', 'princeton']) == 0
    assert 'none has ground truth' in capsys.readouterr().out
    lines = (report / 'submission' / 'princeton' / 'kcf' / 'cafe_occ1.txt').read_text().splitlines()
    assert lines[0] == '20.000,10.000,40.000,40.000,0'
    assert len(lines) == 3


def test_the_command_lists_what_failed_and_goes_on(scenes: Path, tmp_path: Path, capsys):
    truth = scenes / 'walk_1' / 'groundtruth.txt'
    truth.write_text('1,1,5,5\n')
    report = tmp_path / 'report'
    code = main(
        ['evaluate', str(scenes), '--variants', 'kcf', '--jobs', '1', '--report', str(report)]
    )
    assert code == 1
    error = capsys.readouterr().err
    assert '1 failed' in error
    assert f'{truth}, line 1' in error
    html = (report / 'index.html').read_text()
    assert 'walk_1' in html
    assert 'line 1: the file ends here' in html
    assert 'walk_1' in (report / 'failures.txt').read_text()


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (['nowhere'], 'nowhere does not exist'),
        (['sim:nothing'], "unknown scenario 'nothing'"),
        (['sim:normal', '--variants', 'deep'], "unknown variant 'deep'"),
        (['sim:normal', '--param', 'nothing=1'], 'has this parameter'),
        (['sim:normal', '--variants', 'kcf', '--param', 'metric.x=1'], 'not among the variants'),
        (['sim:normal', '--jobs', '0'], '--jobs is 0'),
        (['sim:normal', '--rate', '0'], '--rate is 0 Hz'),
        (['sim:normal', '--size', 'big'], '--size'),
        (['sim:normal', '--size', '16x16'], 'size is 16x16: give 64x48'),
        (['sim:normal', '--duration', '-1'], 'duration is -1 s'),
        (['sim:normal', '--seeds', 'x'], 'seeds'),
        (['sim:normal', '--boxes', 'x'], 'NAME=FOLDER'),
        (['sim:normal', '--short-term', '--eao-lengths', '9-3'], "'9-3': give LOW-HIGH"),
        (['sim:normal', '--eao-lengths', '3-9'], 'means nothing without --short-term: add it'),
        (['--merge', 'p', '--variants', 'kcf'], '--variants means nothing with --merge'),
        (['--merge', 'p', '--fresh'], '--fresh means nothing with --merge'),
        (['--merge', 'p', '--fps', '20'], '--fps means nothing with --merge'),
        (['--merge', 'p'], 'p holds no part'),
        (['x', '--identity', '--kind', 'otb'], '--kind means nothing with --identity'),
        (['sim:occlusion', '--scenarios', 'normal'], '--scenarios normal: none of these is among'),
        (['sim:normal', '--variants', 'kcf', '--ablate'], '--ablate'),
        (['sim:normal', 'sim:normal'], 'two sequences are named normal/1'),
    ],
)
def test_bad_options_are_told_without_a_traceback(words, message, tmp_path: Path, capsys):
    assert main(['evaluate', *words, '--report', str(tmp_path / 'r')]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert 'Traceback' not in error
    assert not (tmp_path / 'r').exists()


def test_a_folder_in_which_nothing_was_measured_goes_if_it_was_made_for_it(
    scenes: Path, tmp_path: Path, capsys
):
    for name in ('walk_1', 'walk_2'):
        (scenes / name / 'groundtruth.txt').write_text('1,1,5,5\n')
    words = ['evaluate', str(scenes), '--variants', 'kcf', '--jobs', '1', '--report']
    assert main([*words, str(tmp_path / 'new')]) == 2
    error = capsys.readouterr().err
    assert all(name in error for name in ('nothing was measured', 'walk_1', 'walk_2'))
    assert not (tmp_path / 'new').exists()
    (tmp_path / 'old').mkdir()
    assert main([*words, str(tmp_path / 'old')]) == 2
    assert (tmp_path / 'old' / 'failures.txt').exists()


def test_a_recording_of_one_frame_measures_nothing(tmp_path: Path, capsys):
    write_scene(tmp_path / 'one', 1, 2)
    words = ['evaluate', str(tmp_path / 'one'), '--variants', 'kcf', '--jobs', '1', '--report']
    assert main([*words, str(tmp_path / 'report')]) == 2
    assert 'nothing was measured: there is no frame to judge after' in capsys.readouterr().err


def test_tables_of_the_report_before_go_and_nothing_else(scenes: Path, tmp_path: Path):
    report = tmp_path / 'report'
    words = ['evaluate', str(scenes), '--variants', 'kcf', '--jobs', '1', '--report', str(report)]
    assert main([*words, '--short-term']) == 0
    tables = {path.name for path in (report / 'tables').iterdir()}
    assert 'vot_short_term.csv' in tables
    (report / 'tables' / 'notes.csv').write_text('mine')
    assert main(words) == 0
    left = {path.name for path in (report / 'tables').iterdir()}
    assert left == tables - {'vot_short_term.csv'} | {'notes.csv'}


def test_options_that_change_the_data_stand_in_the_report(scenes: Path, tmp_path: Path):
    report = tmp_path / 'report'
    code = main([
        'evaluate', str(scenes), 'sim:normal', '--variants', 'kcf', '--jobs', '1', '--kind',
        'folder', '--sequences', 'walk_1,normal', '--scenarios', 'normal', '--fps', '20',
        '--rate', '5', '--duration', '0.8', '--size', '320x180', '--report', str(report),
    ])  # fmt: skip
    assert code == 0
    options = json.loads((report / 'report.json').read_text())['options']
    for word in ('folder', 'named walk_1,normal', 'scenarios normal', '20 Hz', '5 Hz', '0.8 s'):
        assert word in options
    assert options in (report / 'index.html').read_text()


@pytest.mark.parametrize(
    ('option', 'value', 'words'),
    [
        ('--sequences', 'walk_1,wlak_2', "none has 'wlak_2' in its name"),
        ('--size', '320x180', '--size means nothing without simulated scenes'),
        ('--seeds', '1-3', '--seeds means nothing without simulated scenes'),
    ],
)
def test_options_that_choose_nothing(
    option: str, value: str, words: str, scenes: Path, tmp_path: Path, capsys
):
    report = str(tmp_path / 'report')
    assert main(['evaluate', str(scenes), option, value, '--report', report]) == 2
    assert words in capsys.readouterr().err


def test_a_report_folder_that_cannot_be_written(scenes: Path, tmp_path: Path, capsys):
    (tmp_path / 'file').write_text('')
    words = ['evaluate', str(scenes), '--variants', 'kcf', '--report', str(tmp_path / 'file')]
    assert main(words) == 2
    assert 'is a file: give the name of a folder' in capsys.readouterr().err
