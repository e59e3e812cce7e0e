# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The demo, shortened, and what it stands on."""

from __future__ import annotations

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from rgbd_kcf_tracker import Box, Track, TrackState
from rgbd_kcf_tracker.bench import demo
from rgbd_kcf_tracker.bench.demo_pictures import CELL_WIDTH, chosen, contact_sheet, thumbnail
from rgbd_kcf_tracker.recordings import open_recording
from rgbd_kcf_tracker.recordings.rawbag import RawBag
from rgbd_kcf_tracker.ros import transport

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.ros
@pytest.mark.timeout(180)
def test_demo_leaves_what_it_promises(tmp_path: Path) -> None:
    """Two seconds, small, with an empty home folder."""
    home, dest = tmp_path / 'home', tmp_path / 'demo'
    home.mkdir()
    environment = {**os.environ, 'HOME': str(home)}
    environment.pop('ROS_LOG_DIR', None)
    done = subprocess.run(
        [sys.executable, '-m', 'rgbd_kcf_tracker.bench.demo', str(dest), '--seconds', '2',
         '--size', '320x180', '--variant', 'kcf'],
        env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=150, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert list(home.iterdir()) == []
    table = dict(re.findall(r'^(\w[\w ,>.]*?) {2,}(\S+ ?[%Hzms]*) +\S+', done.stdout, re.MULTILINE))
    assert table['frames sent'].strip() == table['frames answered'].strip() == '60'
    success = float(table['success, IoU > 0.5'].rstrip(' %'))
    assert 30 < success <= 100
    assert 'simulate' in done.stderr
    assert 'lock-step' in done.stderr
    for name in ('recording.mcap', 'tracker.mcap', 'boxes.csv', 'tracked.mp4', 'contact_sheet.png'):
        assert (dest / name).stat().st_size > 0
        assert name in done.stdout
    assert f'rgbd-kcf view {dest / "recording.mcap"} --variant kcf' in done.stdout

    with open_recording(dest / 'recording.mcap') as recording:
        stamps = [frame.stamp_ns for frame in recording.frames()]
        truth = recording.groundtruth
    rows = list(csv.DictReader((dest / 'boxes.csv').open()))
    assert [int(row['stamp_ns']) for row in rows] == stamps
    assert truth is not None
    first = Box(*(float(rows[0][k]) for k in ('x', 'y', 'width', 'height')))
    assert first.iou(truth[0]) > 0.99
    video = cv2.VideoCapture(str(dest / 'tracked.mp4'))
    assert int(video.get(cv2.CAP_PROP_FRAME_COUNT)) == 60
    page = cv2.imread(str(dest / 'contact_sheet.png'))
    assert page is not None
    assert page.std() > 20
    bag = RawBag(dest / 'tracker.mcap')
    assert len(bag.topics['/tracker/box']) == len(bag.topics['/tracker/state']) == 60
    assert list(bag.topics['/tracker/box'].log_ns) == stamps
    bag.close()


def test_demo_names_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    done = subprocess.run(
        [sys.executable, '-m', 'rgbd_kcf_tracker.bench.demo', str(tmp_path / 'file' / 'demo')],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert 'cannot be written' in done.stderr
    assert 'Traceback' not in done.stderr


@pytest.mark.parametrize(
    'words', [['--size', '3'], ['--rate', 'nan'], ['--scenario', 'nix'], ['--seconds', '0']]
)
def test_what_the_demo_refuses_leaves_nothing(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It left a folder, and the corrected command said that it was there already."""
    assert demo.main([str(tmp_path / 'dm'), *words]) == 1
    assert capsys.readouterr().err.startswith('demo: ')
    assert not (tmp_path / 'dm').exists()


def test_demo_replaces_nothing_unasked(tmp_path: Path) -> None:
    mine = tmp_path / 'log' / 'mine.txt'
    mine.parent.mkdir()
    mine.write_text('years of work')
    done = subprocess.run(
        [sys.executable, '-m', 'rgbd_kcf_tracker.bench.demo', str(tmp_path)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert '--overwrite' in done.stderr
    assert 'Traceback' not in done.stderr
    assert [p for p in tmp_path.rglob('*') if p.is_file()] == [mine]


def test_contact_sheet_shows_right_wrong_and_hidden() -> None:
    picture = np.full((180, 320, 3), 90, np.uint8)
    box = Box(100, 40, 50, 100)
    tracks = [
        Track(box, TrackState.TRACKING, 0.9),
        Track(None, TrackState.OCCLUDED),
        Track(Box(0, 0, 20, 20), TrackState.TRACKING, 0.9),
        None,
    ]
    truth = [box, None, box, box]
    cells = [
        thumbnail(picture, t or Track(None, TrackState.IDLE), b, 'x')
        for t, b in zip(tracks, truth, strict=True)
    ]
    assert all(cell.shape[1] == CELL_WIDTH for cell in cells)
    page = contact_sheet(cells, 'title', 'subtitle', tracks, truth, 2.0)
    colors = {tuple(int(v) for v in c) for c in page[-110:-60].reshape(-1, 3)}
    assert {(90, 190, 80), (60, 175, 250), (70, 70, 230)} <= colors


@pytest.mark.parametrize('count', [1, 5, 12, 300])
def test_chosen_frames_cover_the_run(count: int) -> None:
    numbers = chosen(count)
    assert numbers[0] == 0
    assert numbers[-1] == count - 1
    assert len(set(numbers)) == len(numbers) == min(12, count)


def test_segment_fits_the_shared_memory() -> None:
    megabyte = 1 << 20
    assert transport.segment_size(8 << 30) == 32 * megabyte
    assert transport.segment_size(64 * megabyte) == 16 * megabyte
    assert transport.segment_size(0) == 4 * megabyte


def test_where_nothing_can_be_written_the_profile_is_taken_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a container that is read-only, and has little shared memory."""
    (tmp_path / 'file').write_text('')
    monkeypatch.setattr(transport.tempfile, 'gettempdir', lambda: str(tmp_path / 'file'))
    monkeypatch.setattr(transport, 'SHM', tmp_path / 'none')
    assert transport.fitting_profile() == transport.profile_path()


def test_profile_is_loaded_unless_the_user_has_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(transport.tempfile, 'gettempdir', lambda: str(tmp_path))
    monkeypatch.setattr(transport, 'SHM', tmp_path / 'none')  # no shared memory at all
    monkeypatch.delenv('RMW_IMPLEMENTATION', raising=False)
    monkeypatch.setenv(transport.PROFILE_VARIABLE, 'mine.xml')
    transport.ensure_image_transport()
    assert os.environ[transport.PROFILE_VARIABLE] == 'mine.xml'
    monkeypatch.setenv(transport.PROFILE_VARIABLE, '')
    monkeypatch.setenv('RMW_IMPLEMENTATION', 'rmw_cyclonedds_cpp')
    transport.ensure_image_transport()
    assert os.environ[transport.PROFILE_VARIABLE] == ''
    monkeypatch.delenv('RMW_IMPLEMENTATION')
    transport.ensure_image_transport()
    text = Path(os.environ[transport.PROFILE_VARIABLE]).read_text(encoding='utf-8')
    assert f'<segment_size>{4 << 20}</segment_size>' in text
    shipped = (ROOT / 'config' / 'fastdds.xml').read_text(encoding='utf-8')
    assert re.sub(r'segment_size>\d+', '', text) == re.sub(r'segment_size>\d+', '', shipped)
