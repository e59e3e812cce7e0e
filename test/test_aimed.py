# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings as a camera would have taken them that looks elsewhere."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker.bench import aimed
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, Sample, open_dataset
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation
from rgbd_kcf_tracker.geometry import Box, Intrinsics

CAMERA = Intrinsics(150.0, 150.0, 99.5, 74.5)
WIDTH, HEIGHT = 200, 150
PLANE = np.array([0.1, 0.3, 0.9])
"""A wall: ``PLANE @ p`` is 3 at each point ``p`` of it, metres in the recording's camera."""


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A wall, as bright as it is far to the right, with somebody in the middle, in 4 frames."""
    folder = tmp_path / 'room'
    for part in ('rgb', 'depth'):
        (folder / part).mkdir(parents=True)
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = np.stack(
        ((columns - CAMERA.cx) / CAMERA.fx, (rows - CAMERA.cy) / CAMERA.fy, np.ones(rows.shape))
    )
    depth = np.rint(3000 / np.tensordot(PLANE, rays, 1)).astype(np.uint16)
    color = np.repeat(columns[..., None].astype(np.uint8), 3, axis=2)
    for number in range(4):
        cv2.imwrite(str(folder / 'rgb' / f'{number}.png'), color)
        cv2.imwrite(str(folder / 'depth' / f'{number}.png'), depth)
    (folder / 'mot.txt').write_text(''.join(f'{n},7,85,40,30,60,1,0,0,3\n' for n in range(1, 5)))
    return folder


LINE = ('--fps', '5', '--intrinsics', '150,150,99.5,74.5')


def samples_of(copy: Path) -> list[Sample]:
    (sequence,) = open_dataset(str(copy), DatasetOptions(everyone=True))
    return list(sequence.open().samples)


def test_a_camera_that_turns_sees_the_same_wall_in_metres(recording: Path, tmp_path: Path):
    out = tmp_path / 'out'
    assert aimed.main([str(recording), *LINE, '--period', '8', '--out', str(out)]) == 0
    names = ['left_room', 'right_room', 'turning_room']
    assert sorted(path.name for path in out.iterdir()) == names
    for name in ('left', 'right', 'turning'):
        samples = samples_of(out / f'{name}_room')
        assert len(samples) == 4
        for index, sample in enumerate(samples):
            half = WIDTH / 2 / CAMERA.fx
            reach = np.arctan(half) - np.arctan(aimed.WIDTH * half)
            side = {'left': -reach, 'right': reach}.get(name)
            aim = aimed.turning(index / 8, reach) if side is None else (side, 0.0, 0.0)
            frame = sample.frame
            k = frame.intrinsics
            assert k is not None
            assert frame.depth is not None
            shown = np.isfinite(frame.depth)
            assert shown.mean() > 0.98, 'no ray leaves the recording but at the corners'
            v, u = np.nonzero(shown)
            z = frame.depth[v, u].astype(np.float64)
            points = np.stack(((u - k.cx) * z / k.fx, (v - k.cy) * z / k.fy, z))
            there = aimed.rotation(aim) @ points
            assert PLANE @ there == pytest.approx(np.full(len(z), 3.0), abs=0.02)
            column = there[0] / there[2] * CAMERA.fx + CAMERA.cx
            row = there[1] / there[2] * CAMERA.fy + CAMERA.cy
            inside = (column > 0) & (column < WIDTH - 1) & (row > 0) & (row < HEIGHT - 1)
            assert np.abs(frame.color[v, u, 0] - column)[inside].max() < 1.0


def test_people_are_where_they_are_seen_and_gone_where_they_are_not(
    recording: Path, tmp_path: Path
):
    out = tmp_path / 'out'
    assert aimed.main([str(recording), *LINE, '--out', str(out)]) == 0
    for name in ('left_room', 'right_room'):
        (person,) = samples_of(out / name)[0].people
        # What is as bright as the middle of the picture was lies in the middle of the box.
        row = samples_of(out / name)[0].frame.color[int(person.box.cy), :, 0]
        assert np.abs(int(np.abs(row.astype(int) - 100).argmin()) - person.box.cx) < 1.5
    view = aimed.View(CAMERA, (WIDTH, HEIGHT), (-0.25, 0.0, 0.0))
    here = view.seen(Annotation(7, Box(20.0, 40.0, 30.0, 60.0)))
    assert here is not None
    assert here.counts
    whole = view.seen(Annotation(7, Box(20.0, 40.0, 30.0, 20.0), body=Box(20.0, 40.0, 30.0, 60.0)))
    assert whole is not None
    assert whole.body == here.box
    assert view.seen(Annotation(7, Box(170.0, 40.0, 30.0, 60.0))) is None
    edge = view.width + (CAMERA.cx - view.camera.cx) - 38  # a fifth of them shows there
    some = view.seen(Annotation(7, Box(edge - 8.0, 40.0, 40.0, 60.0)))
    assert some is not None
    assert not some.counts
    assert some.box.right == view.width


def test_what_cannot_be_aimed_is_said(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = ['--out', str(tmp_path / 'out')]
    assert aimed.main([str(recording), *out]) == 2
    assert 'give --intrinsics' in capsys.readouterr().err
    assert aimed.main([str(recording), *LINE, *out]) == 0
    assert aimed.main([str(recording), *LINE, *out]) == 2
    assert 'is there already' in capsys.readouterr().err
    (recording / 'mot.txt').write_text('1,7,0,40,12,60,1,0,0,3\n')  # at the left end alone
    some = tmp_path / 'some'
    assert aimed.main([str(recording), *LINE, '--out', str(some)]) == 0
    assert 'right_room: left out' in capsys.readouterr().out
    assert [path.name for path in some.iterdir()] == ['left_room']
    far = [str(recording), '--fps', '5', '--intrinsics', '150,150,9000,74.5']
    assert aimed.main([*far, '--out', str(tmp_path / 'none')]) == 2
    assert 'shows nobody to any of these cameras' in capsys.readouterr().err
    assert not (tmp_path / 'none').exists()
    for wrong in (['--period', '2'], ['--fps', '0'], ['--intrinsics', '1,2']):
        with pytest.raises(SystemExit, match='2'):
            aimed.main([str(recording), *LINE, *wrong, *out])
