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
    with pytest.raises(SystemExit):
        paused.main([*line, '--keep', '0'])
