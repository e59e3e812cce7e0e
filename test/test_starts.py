# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a box drawn about who is half hidden, or a click, starts on them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rgbd_kcf_tracker.bench import starts
from rgbd_kcf_tracker.cli.main import main


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('starts') / 'group'
    scene = ['--scenario', 'group_crossing', '--seed', '301', '--rate', '5', '--duration', '5']
    size = ['--size', '320x240', '--color-format', 'jpg']
    assert main(['simulate', str(folder), *scene, *size]) == 0
    return folder


@pytest.mark.parametrize(
    ('way', 'least'),
    [
        (starts.as_given, 0.8),
        (starts.badly(0.2, np.random.default_rng(1)), 0.7),
        (starts.clicked(np.random.default_rng(1)), 0.6),  # beside his outline he is no person
    ],
)
def test_everybody_in_every_nth_frame_is_started_on(
    recording: Path, way: starts.Pointing, least: float
):
    found = list(starts.starts(recording, 4, way))
    assert len(found) > 10
    for start in found:
        assert 0 < start.share <= 1
        assert 0.5 < start.distance < 8
    right = [
        s.taken is not None and abs(s.taken - s.distance) < starts.BODY
        for s in found
        if s.share > 0.9
    ]
    assert sum(right) > least * len(right) > 0


def test_starts_are_counted_by_what_they_are_on():
    one = starts.Start(0.5, 3.0, 3.1)
    found = [one, one, starts.Start(0.5, 3.0, 2.2), starts.Start(0.5, 3.0, float('nan'))]
    found += [starts.Start(0.5, 3.0, 4.0), *3 * [starts.Start(0.5, 3.0, None)]]
    assert starts.row('half', found) == ('half', 8, 37.5, 12.5, 12.5, 12.5)


def test_a_folder_that_does_not_say_who_is_how_far_off_is_refused_by_name(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    assert starts.main([str(tmp_path)]) == 2
    assert str(tmp_path) in capsys.readouterr().err
    away = tmp_path / 'away'
    away.mkdir()
    for part in ('rgb', 'depth'):
        (away / part).symlink_to(recording / part)
    lines = (recording / 'mot.txt').read_text().splitlines()
    unknown = [','.join([*line.split(',')[:7], '-1', '-1', '-1']) for line in lines]
    (away / 'mot.txt').write_text('\n'.join(unknown) + '\n')
    assert starts.main([str(away)]) == 2
    error = capsys.readouterr().err
    assert str(away) in error
    assert 'how far' in error


def test_the_command_prints_a_row_for_each_share(
    recording: Path, capsys: pytest.CaptureFixture[str]
):
    for way in ([], ['--points'], ['--off', '0.2']):
        assert starts.main([str(recording), '--every', '12', *way]) == 0
        said = capsys.readouterr().out
        assert '0.9 to 1.0' in said
        assert 'all' in said


@pytest.mark.parametrize('wrong', [['--off', '2'], ['--off', '-0.1'], ['--off', '0.1', '--points']])
def test_boxes_that_are_off_by_more_than_their_size_are_refused(wrong: list[str]):
    with pytest.raises(SystemExit) as error:
        starts.main(['folder', *wrong])
    assert error.value.code == 2
