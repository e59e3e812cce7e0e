# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings as a worse camera or hand gives them."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker.bench import spoilt
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, open_dataset
from rgbd_kcf_tracker.evaluation.datasets.base import Sample
from rgbd_kcf_tracker.geometry import Box


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A floor that goes from 1 to 7 m, with somebody in two of three frames."""
    folder = tmp_path / 'room'
    (folder / 'rgb').mkdir(parents=True)
    (folder / 'depth').mkdir()
    depth = np.broadcast_to(np.linspace(7000, 1000, 40).astype(np.uint16)[:, None], (40, 60))
    for number in range(3):
        color = np.full((40, 60, 3), (50 * number, 20, 20), np.uint8)
        cv2.imwrite(str(folder / 'rgb' / f'{number}.png'), color)
        cv2.imwrite(str(folder / 'depth' / f'{number}.png'), depth + number)
    (folder / 'mot.txt').write_text('1,7,3,5,10,20,1,0,0,3\n3,7,9,5,10,20,1,0,0,3\n')
    (folder / 'body_7.txt').write_text('3,5,10,30\n6,5,10,30\n9,5,10,30\n')
    return folder


def copied(recording: Path, tmp_path: Path, how: str) -> tuple[list[Sample], list[Sample]]:
    """What a recording and its copy hold."""
    out = tmp_path / 'out'
    line = [str(recording), '--fps', '5', '--intrinsics', '50,51,29,19', '--out', str(out)]
    assert spoilt.main([*line, '--how', how]) == 0
    before, after = (
        list(open_dataset(str(path), DatasetOptions(everyone=True, fps=5))[0].open().samples)
        for path in (recording, out / 'room')
    )
    return before, after


@pytest.mark.parametrize(('how', 'metres'), [('reach', 4.5), ('reach=3', 3.0)])
def test_what_is_farther_is_not_read_and_all_else_is_as_it_was(
    how: str, metres: float, recording: Path, tmp_path: Path
):
    before, after = copied(recording, tmp_path, how)
    assert [s.frame.stamp_ns for s in after] == [s.frame.stamp_ns for s in before]
    assert [s.people for s in after] == [s.people for s in before]
    for old, new in zip(before, after, strict=True):
        assert np.array_equal(old.frame.color, new.frame.color)
        there = np.isfinite(new.frame.depth) & (new.frame.depth > 0)
        assert np.array_equal(there, old.frame.depth <= metres)
        assert np.allclose(new.frame.depth[there], old.frame.depth[there])
    assert after[0].frame.intrinsics is not None
    assert after[0].frame.intrinsics.fy == 51


def test_frames_are_lost_and_the_others_keep_their_times(recording: Path, tmp_path: Path):
    before, after = copied(recording, tmp_path, 'lost=0.99')
    assert len(after) < len(before)
    times = [s.frame.stamp_ns for s in before]
    for new in after:
        old = before[times.index(new.frame.stamp_ns)]
        assert np.array_equal(old.frame.color, new.frame.color)
        assert old.people == new.people


def test_copies_in_which_nobody_is_left_are_said(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    (recording / 'mot.txt').write_text('3,7,9,5,10,20,1,0,0,3\n')
    assert spoilt.main([str(recording), '--out', str(tmp_path / 'o'), '--how', 'lost=0.99']) == 2
    assert capsys.readouterr().err == f'{tmp_path / "o" / "room"}: nobody is left in its frames\n'
    assert not (tmp_path / 'o' / 'room').exists(), 'it was in the way of the next run'
    assert spoilt.main([str(recording), '--out', str(tmp_path / 'o'), '--how', 'grey']) == 0


def test_a_copy_is_the_same_whatever_is_copied_beside_it(recording: Path, tmp_path: Path):
    other = tmp_path / 'another'
    shutil.copytree(recording, other)
    line = ['--fps', '5', '--how', 'holes=0.5']
    for number, folders in enumerate(([recording], [other, recording])):
        out = tmp_path / f'out{number}'
        assert spoilt.main([*map(str, folders), *line, '--out', str(out)]) == 0
    alone, beside, others = (
        (tmp_path / part / 'depth' / '000001.png').read_bytes()
        for part in ('out0/room', 'out1/room', 'out1/another')
    )
    assert alone == beside != others


@pytest.mark.parametrize('pixels', [1, 4])
def test_a_fringe_is_as_broad_as_it_is_said(pixels: int, recording: Path, tmp_path: Path):
    depth = np.full((40, 60), 4000, np.uint16)
    depth[10:30, 20:40] = 2000
    for path in (recording / 'depth').iterdir():
        cv2.imwrite(str(path), depth)
    _, after = copied(recording, tmp_path, f'fringe={pixels}')
    assert np.count_nonzero(after[0].frame.depth < 3) == (20 + pixels) ** 2


def test_whole_bodies_are_known_of_a_copy_too(recording: Path, tmp_path: Path):
    _, after = copied(recording, tmp_path, 'reach')
    (person,) = after[0].people
    assert person.body == Box(3, 5, 10, 30)
    (alone,) = open_dataset(str(tmp_path / 'out' / 'room'), DatasetOptions(fps=5))
    assert [s.body for s in alone.open().samples] == [Box(3, 5, 10, 30), None, Box(9, 5, 10, 30)]
    assert tmp_path / 'out' / 'room' / 'body_7.txt' in alone.content


@pytest.mark.parametrize('how', ['grey', 'holes=0.5', 'dark=60', 'fringe=4', 'shift=6'])
def test_what_is_spoilt_is_what_is_said(how: str, recording: Path, tmp_path: Path):
    before, after = copied(recording, tmp_path, how)
    old, new = before[1].frame, after[1].frame
    was, now = np.nan_to_num(old.depth), np.nan_to_num(new.depth)
    assert [s.people for s in after] == [s.people for s in before]
    if how == 'grey':
        assert np.ptp(new.color, axis=2).max() == 0 < np.ptp(old.color, axis=2).max()
    else:
        assert np.array_equal(old.color, new.color)
    if how == 'holes=0.5':
        assert np.mean(now == 0) == pytest.approx(0.5, abs=0.05)
        assert np.allclose(now[now > 0], was[now > 0])
    elif how == 'dark=60':
        assert not now.any(), 'the picture is darker than that'
    elif how == 'fringe=4':
        assert np.allclose(now[:-2], was[2:]), 'the floor is nearer below'
    elif how == 'shift=6':
        assert np.allclose(now[3:, 6:], was[:-3, :-6])
    else:
        assert np.array_equal(was, now)


@pytest.mark.parametrize(
    ('given', 'told'),
    [
        (['--how', 'reach=0'], 'above 0'),
        (['--how', 'reach=nan'], 'above 0'),
        (['--how', 'lost=1'], '0.99 at the most'),
        (['--how', 'lost=few'], 'lost=few'),
        (['--how', 'fringe=1.5'], 'whole number'),
        (['--how', 'better'], 'reach'),
        (['--how', 'grey', '--seed', '-1'], '--seed'),
        (['--how', 'grey', '--intrinsics', '1,2'], '1,2'),
    ],
)
def test_what_is_wrong_on_the_command_line_is_said(
    given: list[str], told: str, recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture
):
    with pytest.raises(SystemExit) as end:
        spoilt.main([str(recording), '--out', str(tmp_path / 'out'), *given])
    assert end.value.code == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


def test_a_copy_that_is_there_is_left_alone(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture
):
    (tmp_path / 'out' / 'room').mkdir(parents=True)
    line = [str(recording), '--how', 'grey', '--out', str(tmp_path / 'out')]
    assert spoilt.main(line) == 2
    assert 'is there already' in capsys.readouterr().err
    assert not list((tmp_path / 'out' / 'room').iterdir())


@pytest.mark.parametrize(
    ('how', 'box'), [('upper', (3, 5, 10, 10)), ('inner=0.6', (5, 9, 6, 12)), ('drawn', None)]
)
def test_who_is_drawn_otherwise_is_in_his_first_box(how: str, box, recording: Path, tmp_path: Path):
    before, after = copied(recording, tmp_path, how)
    (old,), (new,) = before[0].people, after[0].people
    assert new.id == old.id
    assert new.box != old.box
    if box is None:
        assert 0.5 < new.box.iou(old.box) < 1
    else:
        assert new.box.as_tuple() == pytest.approx(box)
        assert new.box.intersection(old.box) == pytest.approx(new.box.area)
    assert [s.people for s in after[1:]] == [s.people for s in before[1:]]
    for one, other in zip(before, after, strict=True):
        assert np.array_equal(one.frame.color, other.frame.color)
        assert np.array_equal(one.frame.depth, other.frame.depth, equal_nan=True)
