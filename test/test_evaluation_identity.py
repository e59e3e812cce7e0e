# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether people are told apart: pairs, areas and probabilities, with descriptions made up here."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation import identity
from rgbd_kcf_tracker.evaluation.datasets import Sample
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation
from rgbd_kcf_tracker.evaluation.identity import Seen, Sighting, Views, all_pairs, look, pair
from rgbd_kcf_tracker.evaluation.metrics.separation import balanced_reliability, separation
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box


def test_area_is_the_probability_that_same_gets_more_than_different():
    probabilities = np.array([0.9, 0.4, 0.5, 0.4, 0.1])
    same = np.array([True, True, False, False, False])
    result = separation(probabilities, same)
    # 0.9 is above all three; 0.4 above one and level with one.
    assert result.area == pytest.approx((3 + 1.5) / 6)
    assert (result.same, result.different) == (2, 3)
    assert result.recognised == pytest.approx(1 / 2)
    assert result.taken == pytest.approx(1 / 3), 'a half counts as the same'


def test_without_pairs_of_a_kind_there_is_no_area():
    only = separation(np.array([0.9]), np.array([True]))
    assert math.isnan(only.area)
    assert math.isnan(only.taken)


def test_reliability_does_not_depend_on_how_many_others_there_are():
    probabilities = np.array([0.75] * 4 + [0.75] * 40)
    few = balanced_reliability(probabilities[:8], np.array([True, True, True, False] * 2))
    many = np.array([True] * 4 + [False] * 40)
    assert few.hit_rate[7] == pytest.approx(0.5), 'as many of each weigh the same'
    assert balanced_reliability(probabilities, many).hit_rate[7] == pytest.approx(0.5)
    assert few.counts[7] == 8
    assert few.expected_error == pytest.approx(0.25)


def picture(color: int, stamp_s: float) -> Frame:
    return Frame(np.full((20, 20, 3), color, np.uint8), None, round(stamp_s * 1e9))


BY_COLOR = Views(
    lambda frame, box: int(frame.color[int(box.y), int(box.x), 0]) or None,
    lambda a, b: 1 - abs(a - b) / 255,
)


def test_people_who_barely_show_and_regions_are_not_looked_at():
    box = Box(1, 1, 5, 5)
    people = (
        Annotation(1, box),
        Annotation(2, box, counts=False),
        Annotation(-1, box, counts=False),
    )
    dark = Sample(picture(0, 1), None, people=(Annotation(1, box),))
    seen = look('a', [Sample(picture(9, 0), None, people=people), dark], BY_COLOR)
    assert (seen.frames, seen.sightings) == (2, 2)
    assert [(v.person, v.frame, v.what) for v in seen.views] == [(1, 0, 9)]


def test_each_frame_is_shown_first_also_those_without_people():
    told = []
    views = Views(lambda frame, box: len(told), BY_COLOR.compare, lambda f: told.append(f.stamp_ns))
    empty, full = (
        Sample(picture(9, 0), None),
        Sample(picture(9, 1), None, people=(Annotation(1, Box(1, 1, 5, 5)),)),
    )
    found = look('a', [empty, full], views)
    assert told == [0, 1_000_000_000]
    assert [v.what for v in found.views] == [2]


def seen(name: str, *views: tuple[int, float, int]) -> Seen:
    """Views of ``(person, seconds, look)``."""
    made = tuple(Sighting(who, i, round(s * 1e9), what) for i, (who, s, what) in enumerate(views))
    return Seen(name, len(views), len(views), made)


def test_only_sightings_three_seconds_apart_are_compared():
    pairs = pair(seen('a', (1, 0, 10), (1, 2.9, 10), (1, 3, 10), (2, 6, 200)), None, BY_COLOR)
    assert [(a.frame, b.frame) for a, b in zip(pairs.left, pairs.right, strict=True)] == [
        (0, 2), (0, 3), (1, 3), (2, 3)]  # fmt: skip
    assert pairs.same.tolist() == [True, False, False, False]
    assert pairs.separation().area == 1


def test_views_of_the_same_people_are_known_by_their_names():
    one, two = seen('lab_cam1', (1, 0, 10)), seen('lab_cam2', (1, 9, 10), (2, 9, 90), (2, 1, 90))
    other = seen('hall_cam1', (1, 9, 10))
    names = [p.name for p in all_pairs([one, two, other], BY_COLOR)]
    assert names == ['lab_cam1', 'lab_cam2', 'hall_cam1', 'lab_cam1 to lab_cam2']
    across = all_pairs([one, two], BY_COLOR)[-1]
    assert across.same.tolist() == [True, False]


def test_a_person_seen_for_long_does_not_make_the_rest_vanish():
    long = seen('a', *((1, 10 * i, 10) for i in range(1000)), (2, 5, 90))
    pairs = pair(long, None, BY_COLOR)
    assert len({v.frame for v in pairs.left if v.person == 1}) == identity.MOST_VIEWS
    assert len(pairs.probability) < identity.MOST_VIEWS**2


def test_what_is_no_probability_is_refused():
    wrong = Views(BY_COLOR.describe, lambda a, b: math.nan)
    with pytest.raises(DatasetError, match='a: a comparison gave nan'):
        pair(seen('a', (1, 0, 10), (1, 9, 10)), None, wrong)


@pytest.fixture
def two_cameras(tmp_path: Path) -> Path:
    """Two people, one red and one blue, in two cameras at 1 Hz."""
    for camera in ('lab_cam1', 'lab_cam2'):
        folder = tmp_path / 'data' / camera / 'rgb'
        folder.mkdir(parents=True)
        lines = []
        for number in range(1, 9):
            image = np.full((40, 60, 3), 128, np.uint8)
            image[:, :20], image[:, 40:] = (200, 0, 0), (20, 0, 0)
            cv2.imwrite(str(folder / f'{number}.png'), image)
            lines += [f'{number},1,2,5,10,20,1,-1,-1,-1', f'{number},2,45,5,10,20,1,-1,-1,-1']
        (tmp_path / 'data' / camera / 'mot.txt').write_text('\n'.join(lines))
    return tmp_path / 'data'


def evaluate(*words: object) -> int:
    return main(['evaluate', *map(str, words)])


def test_the_command(two_cameras: Path, tmp_path: Path, monkeypatch, capsys):
    monkeypatch.setattr(identity, 'metric_views', lambda parameters: BY_COLOR)
    report = tmp_path / 'report'
    assert evaluate(two_cameras, '--identity', '--fps', 1, '--report', report) == 0
    assert 'area under ROC %' in capsys.readouterr().out
    with (report / 'tables' / 'identity.csv').open() as file:
        rows = {row['recording']: row for row in csv.DictReader(file)}
    assert list(rows) == ['lab_cam1', 'lab_cam2', 'lab_cam1 to lab_cam2', 'mean in one camera']
    # Of 8 frames, 15 pairs are three seconds apart; each gives a pair of each kind per two people.
    assert (rows['lab_cam1']['same pairs'], rows['lab_cam1']['different pairs']) == ('30', '30')
    assert rows['lab_cam1 to lab_cam2']['same pairs'] == '60'
    assert {row['area under ROC %'] for row in rows.values()} == {'100'}
    with (report / 'pairs.csv').open() as file:
        assert len(list(csv.DictReader(file))) == 60 + 60 + 120
    page = (report / 'index.html').read_text()
    assert 'id="identity"' in page
    assert 'Percent of pairs that are one person' in page
    assert evaluate(two_cameras, '--identity', '--fps', 1, '--report', report) == 0, 'our own'


def test_a_recording_that_fails_is_listed(two_cameras: Path, tmp_path: Path, monkeypatch, capsys):
    monkeypatch.setattr(identity, 'metric_views', lambda parameters: BY_COLOR)
    (two_cameras / 'lab_cam2' / 'mot.txt').write_text('1,2\n')
    report = tmp_path / 'report'
    assert evaluate(two_cameras, '--identity', '--fps', 1, '--report', report) == 1
    assert 'lab_cam2: ' in capsys.readouterr().err
    assert 'lab_cam1' in (report / 'tables.md').read_text()


def test_what_does_not_go_with_it(two_cameras: Path, tmp_path: Path, capsys):
    words = ('--identity', '--variants', 'metric', '--report', tmp_path / 'report')
    assert evaluate(two_cameras, *words) == 2
    assert '--variants means nothing with --identity' in capsys.readouterr().err


def test_parameters_of_metric_go_with_it(two_cameras: Path, tmp_path: Path, monkeypatch, capsys):
    """So a network can be measured by how well it tells people apart."""
    given = []
    monkeypatch.setattr(
        identity, 'metric_views', lambda parameters: given.append(parameters) or BY_COLOR
    )
    words = (two_cameras, '--identity', '--fps', 1, '--report', tmp_path / 'report', '--param')
    assert evaluate(*words, 'metric.embedding_even=0.4', '--param', 'embedding_steepness=9') == 0
    assert {(p.embedding_even, p.embedding_steepness) for p in given} == {(0.4, 9.0)}
    for wrong, said in (('kcf.padding=2', "the tracker is metric, not 'kcf'"), ('x=1', "'x'")):
        assert evaluate(*words, wrong) == 2
        assert said in capsys.readouterr().err
