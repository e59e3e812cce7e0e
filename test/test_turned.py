# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings in a mirror and backwards."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker.bench import turned
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, Sample, open_dataset

FRAMES, WIDTH = 5, 60
CAMERA = '50,50,20,19.5'


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Brighter to the right and from frame to frame, with somebody who walks to the right."""
    folder = tmp_path / 'room'
    (folder / 'rgb').mkdir(parents=True)
    (folder / 'depth').mkdir()
    across = np.broadcast_to(np.arange(WIDTH), (40, WIDTH))
    for number in range(FRAMES):
        color = np.repeat(across[..., None], 3, axis=2) + 20 * number
        cv2.imwrite(str(folder / 'rgb' / f'{number}.png'), color.astype(np.uint8))
        depth = (1000 + 10 * across + number).astype(np.uint16)
        cv2.imwrite(str(folder / 'depth' / f'{number}.png'), depth)
    (folder / 'mot.txt').write_text(
        ''.join(f'{n},7,{3 * n},5,10,20,{int(n != 4)},0,0,3\n' for n in range(1, 5))
    )
    bodies = (f'{3 * n},5,10,30\n' for n in range(1, FRAMES + 1))
    (folder / 'body_7.txt').write_text(''.join(bodies))
    return folder


def samples_of(copy: Path) -> list[Sample]:
    (sequence,) = open_dataset(str(copy), DatasetOptions(everyone=True))
    return list(sequence.open().samples)


def test_copies_are_mirrored_and_backwards(recording: Path, tmp_path: Path):
    out = tmp_path / 'out'
    line = [str(recording), '--fps', '5', '--intrinsics', CAMERA, '--out', str(out)]
    assert turned.main(line) == 0
    names = ['back_room', 'mirror_back_room', 'mirror_room']
    assert sorted(path.name for path in out.iterdir()) == names
    for name in names:
        samples = samples_of(out / name)
        mirror, back = 'mirror' in name, 'back' in name
        order = range(FRAMES)[:: -1 if back else 1]
        at = WIDTH - 1 - 8 if mirror else 8
        assert [int(s.frame.color[0, at, 0]) for s in samples] == [20 * n + 8 for n in order]
        assert [round(1000 * float(s.frame.depth[0, at])) for s in samples] == [
            1080 + n for n in order
        ]
        seconds = [s.frame.stamp_ns * 1e-9 for s in samples]
        assert seconds == pytest.approx(0.2 * np.arange(FRAMES))
        lefts = [[p.box.x for p in s.people] for s in samples]
        there = [3 * (n + 1) for n in order if n < 4]
        assert [x for each in lefts for x in each] == [
            WIDTH - x - 10 if mirror else x for x in there
        ]
        assert [len(each) for each in lefts] == [int(n < 4) for n in order]
        bodies = [(p.body.x, p.body.height) for s in samples for p in s.people]
        assert bodies == [(x, 30) for each in lefts for x in each]
        assert [p.counts for s in samples for p in s.people] == [n != 3 for n in order if n < 4]
        assert samples[0].frame.intrinsics is not None
        assert samples[0].frame.intrinsics.cx == (WIDTH - 1 - 20 if mirror else 20)


def test_of_every_few_frames_copies_have_one(recording: Path, tmp_path: Path):
    out = tmp_path / 'out'
    line = [str(recording), '--fps', '5', '--every', '2', '--out', str(out)]
    assert turned.main(line) == 0
    ways = ['back', 'mirror', 'mirror_back', 'same']
    assert sorted(path.name for path in out.iterdir()) == sorted(
        f'{way}_{phase}_room' for way in ways for phase in (0, 1)
    )
    samples = samples_of(out / 'back_1_room')
    assert [int(s.frame.color[0, 0, 0]) for s in samples] == [60, 20]
    assert samples[1].frame.stamp_ns == pytest.approx(4e8)


def test_what_cannot_be_turned_is_said(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = ['--out', str(tmp_path / 'out')]
    assert turned.main([str(recording), *out]) == 0
    assert turned.main([str(recording), *out]) == 2
    assert 'is there already' in capsys.readouterr().err
    assert turned.main([str(recording), '--out', str(recording / 'out')]) == 2
    other = ['--out', str(tmp_path / 'other')]
    assert turned.main([str(recording), '--every', '6', *other]) == 2
    assert 'nobody is left' in capsys.readouterr().err
    for wrong in (['--fps', '0'], ['--every', '0'], ['--intrinsics', '1,2']):
        with pytest.raises(SystemExit):
            turned.main([str(recording), *wrong, *other])
    lens = {
        'width': WIDTH, 'height': 40, 'distortion_model': 'plumb_bob', 'D': [0.1, 0, 0, 0, 0],
        'K': [50, 0, 20, 0, 50, 19.5, 0, 0, 1],
    }  # fmt: skip
    (recording / 'camera_info.json').write_text(json.dumps(lens))
    assert turned.main([str(recording), *other]) == 2
    assert 'rectify' in capsys.readouterr().err
    (recording / 'camera_info.json').unlink()
    (recording / 'depth' / '3.png').unlink()
    assert turned.main([str(recording), *other]) == 2
    assert 'depth' in capsys.readouterr().err
