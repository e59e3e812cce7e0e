# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings whose depth ends at some metres."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker.bench import reach
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, open_dataset


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A floor that goes from 1 to 7 m, with somebody in two of three frames."""
    folder = tmp_path / 'room'
    (folder / 'rgb').mkdir(parents=True)
    (folder / 'depth').mkdir()
    depth = np.broadcast_to(np.linspace(7000, 1000, 40).astype(np.uint16)[:, None], (40, 60))
    for number in range(3):
        color = np.full((40, 60, 3), 50 * number, np.uint8)
        cv2.imwrite(str(folder / 'rgb' / f'{number}.png'), color)
        cv2.imwrite(str(folder / 'depth' / f'{number}.png'), depth + number)
    (folder / 'mot.txt').write_text('1,7,3,5,10,20,1,0,0,3\n3,7,9,5,10,20,1,0,0,3\n')
    return folder


@pytest.mark.parametrize('metres', [4.5, 3.0])
def test_what_is_farther_is_not_read_and_all_else_is_as_it_was(
    metres: float, recording: Path, tmp_path: Path
):
    out = tmp_path / 'out'
    given = [] if metres == 4.5 else ['--reach', str(metres)]
    line = [str(recording), '--fps', '5', '--intrinsics', '50,51,29,19', '--out', str(out), *given]
    assert reach.main(line) == 0
    before, after = (
        list(open_dataset(str(path), DatasetOptions(everyone=True, fps=5))[0].open().samples)
        for path in (recording, out / 'room')
    )
    assert [s.frame.stamp_ns for s in after] == [s.frame.stamp_ns for s in before]
    assert [s.people for s in after] == [s.people for s in before]
    for old, new in zip(before, after, strict=True):
        assert np.array_equal(old.frame.color, new.frame.color)
        there = np.isfinite(new.frame.depth) & (new.frame.depth > 0)
        assert np.array_equal(there, old.frame.depth <= metres)
        assert np.allclose(new.frame.depth[there], old.frame.depth[there])
    assert after[0].frame.intrinsics is not None
    assert after[0].frame.intrinsics.fy == 51


@pytest.mark.parametrize(
    ('given', 'told'),
    [
        (['--reach', '0'], '--reach'),
        (['--reach', 'nan'], '--reach'),
        (['--intrinsics', '1,2'], '1,2'),
    ],
)
def test_what_is_wrong_on_the_command_line_is_said(
    given: list[str], told: str, recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture
):
    with pytest.raises(SystemExit) as end:
        reach.main([str(recording), '--out', str(tmp_path / 'out'), *given])
    assert end.value.code == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


def test_a_copy_that_is_there_is_left_alone(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture
):
    (tmp_path / 'out' / 'room').mkdir(parents=True)
    assert reach.main([str(recording), '--out', str(tmp_path / 'out')]) == 2
    assert 'is there already' in capsys.readouterr().err
    assert not list((tmp_path / 'out' / 'room').iterdir())
