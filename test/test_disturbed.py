# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Disturbed copies of recordings."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker.bench import disturbed


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    folder = tmp_path / 'room'
    (folder / 'rgb').mkdir(parents=True)
    (folder / 'depth').mkdir()
    depth = np.full((40, 60), 3000, np.uint16)
    depth[:, :20] = 0
    for number in range(3):
        cv2.imwrite(str(folder / 'rgb' / f'{number}.png'), np.full((40, 60, 3), 120, np.uint8))
        cv2.imwrite(str(folder / 'depth' / f'{number}.png'), depth)
    (folder / 'mot.txt').write_text('1,1,5,5,10,20,1,0,0,3\n')
    return folder


def test_a_copy_has_other_light_and_noise_and_the_same_truth(recording: Path, tmp_path: Path):
    assert disturbed.main([str(recording), '--out', str(tmp_path / 'out'), '--copies', '2']) == 0
    means = []
    for name in ('1_room', '2_room'):
        copy = tmp_path / 'out' / name
        assert (copy / 'mot.txt').read_text() == (recording / 'mot.txt').read_text()
        colors = [cv2.imread(str(copy / 'rgb' / f'{n}.png')).astype(float) for n in range(3)]
        assert 1 < np.std(colors[1] - colors[0]) < 3 * disturbed.COLOR_NOISE
        means.append([color.mean() for color in colors])
        depth = cv2.imread(str(copy / 'depth' / '0.png'), cv2.IMREAD_UNCHANGED)
        assert depth.dtype == np.uint16
        assert not depth[:, :20].any()
        assert np.std(depth[:, 20:] / 1000) == pytest.approx(9 * disturbed.DEPTH_NOISE, rel=0.1)
    assert np.ptp(means[0]) < 1, 'the light of one copy is the same throughout'
    assert abs(means[0][0] - means[1][0]) > 1


def test_the_truth_of_the_challenges_own_folders_is_kept(recording: Path, tmp_path: Path):
    (recording / 'gt').mkdir()
    (recording / 'mot.txt').rename(recording / 'gt' / 'gt.txt')
    assert disturbed.main([str(recording), '--out', str(tmp_path / 'out'), '--copies', '1']) == 0
    copy = tmp_path / 'out' / '1_room'
    assert (copy / 'gt' / 'gt.txt').read_text() == (recording / 'gt' / 'gt.txt').read_text()


def test_nothing_is_written_over_and_what_is_no_recording_is_said(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = tmp_path / 'out'
    assert disturbed.main([str(recording), '--out', str(out), '--copies', '1']) == 0
    assert disturbed.main([str(recording), '--out', str(out), '--copies', '1']) == 2
    assert '1_room' in capsys.readouterr().err
    assert disturbed.main([str(recording), '--out', str(recording / 'out')]) == 2
    assert 'lies inside the source' in capsys.readouterr().err
    empty = tmp_path / 'empty'
    empty.mkdir()
    assert disturbed.main([str(empty), '--out', str(out)]) == 2
    assert 'holds no folders of colour and depth' in capsys.readouterr().err
    (recording / 'rgb' / '1.png').write_bytes(b'no image')
    assert disturbed.main([str(recording), '--out', str(tmp_path / 'other')]) == 2
    assert (
        '1.png: compressed image of 8 bytes is neither JPEG, PNG nor TIFF'
        in capsys.readouterr().err
    )
    assert not list((tmp_path / 'other').iterdir()), 'half a copy is none'
