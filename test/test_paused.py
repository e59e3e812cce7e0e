# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings in which the camera pauses."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker.bench import paused
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, open_dataset

FRAMES = 12


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    folder = tmp_path / 'room'
    (folder / 'rgb').mkdir(parents=True)
    (folder / 'depth').mkdir()
    for number in range(FRAMES):
        gray = np.full((40, 60, 3), 10 * number, np.uint8)
        cv2.imwrite(str(folder / 'rgb' / f'{number:02d}.png'), gray)
        cv2.imwrite(str(folder / 'depth' / f'{number:02d}.png'), np.full((40, 60), 3000, np.uint16))
    (folder / 'mot.txt').write_text(
        ''.join(f'{n},{2 if n > 8 else 1},{n},5,10,20,{int(n != 4)},0,0,3\n' for n in range(3, 13))
    )
    return folder


def test_a_copy_leaves_frames_out_and_time_goes_on(recording: Path, tmp_path: Path):
    out = tmp_path / 'out'
    line = [str(recording), '--fps', '5', '--keep', '3', '--cut', '4', '--step', '2']
    assert paused.main([*line, '--seconds', '20', '--out', str(out)]) == 0
    # The first three frames show nobody but the third, and of the last copy one is left.
    assert sorted(path.name for path in out.iterdir()) == ['000_room', '002_room', '004_room']
    (copy,) = open_dataset(str(out / '002_room'), DatasetOptions(everyone=True))
    samples = list(copy.open().samples)
    kept = [2, 3, 4, 9, 10, 11]
    assert [int(s.frame.color[0, 0, 0]) for s in samples] == [10 * n for n in kept]
    seconds = np.diff([s.frame.stamp_ns for s in samples]) * 1e-9
    assert seconds == pytest.approx([0.2, 0.2, 21.0, 0.2, 0.2])
    assert [[p.id for p in s.people] for s in samples] == [[1], [1], [1], [2], [2], [2]]
    assert [s.people[0].box.x for s in samples] == [n + 1 for n in kept]
    assert [s.people[0].counts for s in samples] == [True, False, True, True, True, True]


def test_frames_from_anywhere_else_follow_and_time_goes_on(recording: Path, tmp_path: Path):
    out = tmp_path / 'out'
    line = [str(recording), '--fps', '5', '--keep', '3', '--cut', '1', '--step', '4', '--anywhere']
    assert paused.main([*line, '--seconds', '20', '--out', str(out)]) == 0
    # Each of three stretches that show somebody before each of the others.
    pairs = ['000_004', '000_008', '004_000', '004_008', '008_000', '008_004']
    assert sorted(path.name for path in out.iterdir()) == [f'{pair}_room' for pair in pairs]
    (copy,) = open_dataset(str(out / '004_000_room'), DatasetOptions(everyone=True))
    samples = list(copy.open().samples)
    kept = [4, 5, 6, 0, 1, 2]
    assert [int(s.frame.color[0, 0, 0]) for s in samples] == [10 * n for n in kept]
    seconds = np.diff([s.frame.stamp_ns for s in samples]) * 1e-9
    assert seconds == pytest.approx([0.2, 0.2, 20.0, 0.2, 0.2])
    assert [[p.id for p in s.people] for s in samples] == [[1], [1], [1], [], [], [1]]
    tight = [*line, '--cut', '7', '--out', str(tmp_path / 'none')]
    assert paused.main(tight) == 2, 'no two stretches are so far apart'


def test_nothing_is_written_over_and_what_has_no_depth_is_said(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    line = [str(recording), '--keep', '3', '--cut', '4', '--out', str(tmp_path / 'out')]
    assert paused.main(line) == 0
    assert paused.main(line) == 2
    assert '000_room is there already' in capsys.readouterr().err
    assert paused.main([str(recording), '--out', str(recording / 'out')]) == 2
    assert 'lies inside the source' in capsys.readouterr().err
    for path in (recording / 'depth').iterdir():
        path.unlink()
    (recording / 'depth').rmdir()
    assert paused.main([str(recording), '--out', str(tmp_path / 'other')]) == 2
    assert 'holds no depth images' in capsys.readouterr().err
    for wrong in (['--keep', '0'], ['--fps', 'inf'], ['--fps', 'nan'], ['--seconds', '-1']):
        with pytest.raises(SystemExit):
            paused.main([*line, *wrong])


def test_what_no_copy_can_be_made_of_is_said(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    """It ended with nothing written and status 0, and without truth in a traceback."""
    out = ['--out', str(tmp_path / 'out')]
    assert paused.main([str(recording), '--keep', '500', *out]) == 2
    assert 'of 12 frames no 500 show somebody' in capsys.readouterr().err
    (recording / 'mot.txt').unlink()
    assert paused.main([str(recording), *out]) == 2
    assert 'does not say who is where: expected mot.txt' in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


def test_depth_is_that_of_the_image_beside_it(recording: Path, tmp_path: Path):
    cv2.imwrite(str(recording / 'depth' / '000.png'), np.full((40, 60), 9000, np.uint16))
    for path in (recording / 'depth').glob('??.png'):
        cv2.imwrite(str(path), np.full((40, 60), 1000 + int(path.stem), np.uint16))
    out = tmp_path / 'out'
    assert paused.main([str(recording), '--keep', '3', '--cut', '4', '--out', str(out)]) == 0
    copied = sorted((out / '000_room' / 'depth').iterdir())
    millimetres = [int(cv2.imread(str(p), cv2.IMREAD_UNCHANGED)[0, 0]) for p in copied]
    assert millimetres == [1000 + n for n in (0, 1, 2, 7, 8, 9, 10, 11)]
