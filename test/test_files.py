# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What is named as a source and is none: an error at once that names it, whatever it is."""

from __future__ import annotations

import os
import shutil
import socket
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pytest
from bag_rig import CAMERA, camera_messages, make_frames, write_mcap, write_rosbag2

from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import DatasetError, ImageError, RecordingError
from rgbd_kcf_tracker.evaluation.datasets import open_dataset
from rgbd_kcf_tracker.evaluation.store import read_tracks
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import ReadOptions, SequenceWriter, files, open_recording
from rgbd_kcf_tracker.recordings.textfiles import read_boxes

FRAMES = make_frames(4)
INIT = ['--init', '10,8,20,30']

pytestmark = pytest.mark.timeout(60)


def write_folder(path: Path) -> Path:
    with SequenceWriter(path) as writer:
        for frame in FRAMES:
            writer.write(frame, Box(10, 8, 20, 30))
    return path


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert main([str(w) for w in words]) == 2
    lines = [li for li in capsys.readouterr().err.splitlines() if not li.startswith('warning: ')]
    assert len(lines) == 1
    assert lines[0].startswith('rgbd-kcf: error: ')
    return lines[0]


def commands(source: Path, out: Path) -> list[list[str]]:
    """Everything that reads a source."""
    return [
        ['info', str(source)],
        ['info', str(source), '--check'],
        ['track', str(source), *INIT, '--output', str(out / 'a.csv')],
        ['convert', str(source), str(out / 'a.mcap')],
        ['evaluate', str(source), '--variants', 'kcf', '--report', str(out / 'report')],
    ]


# -- no files ----------------------------------------------------------------------------------


@pytest.mark.parametrize('kind', ['pipe', 'socket', 'device', 'loop', 'lost link', 'nothing'])
def test_what_is_no_file_is_refused_and_not_waited_for(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / 'out').mkdir()
    source = tmp_path / 'source.mcap'
    says = {
        'pipe': 'is a named pipe', 'socket': 'is a socket', 'device': 'is a device',
        'loop': 'links lead in a circle', 'lost link': 'leads to nothing',
        'nothing': 'does not exist',
    }[kind]  # fmt: skip
    with closing(socket.socket(socket.AF_UNIX)) as server:
        if kind == 'pipe':
            os.mkfifo(source)
        elif kind == 'socket':
            server.bind(str(source))
        elif kind == 'device':
            source.symlink_to('/dev/zero')
        elif kind == 'loop':
            source.symlink_to(source)
        elif kind == 'lost link':
            source.symlink_to(tmp_path / 'nowhere')
        for words in commands(source, tmp_path / 'out'):
            error = refused(capsys, *words)
            assert says in error, words
            assert str(source) in error
    assert list((tmp_path / 'out').iterdir()) == []


def test_a_zero_byte_is_in_no_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """No shell can pass one, but programs and files of parameters can."""
    with pytest.raises(RecordingError, match='no name of a file'):
        open_recording('a\0b')
    source = write_folder(tmp_path / 'source')
    assert 'no name of a file' in refused(capsys, 'track', source, '--output', 'a\0b.csv')


@pytest.mark.parametrize(
    'name',
    ['rgb/000002.png', 'depth/000002.png', 'groundtruth.txt', 'timestamps.txt', 'intrinsics.json'],
)
def test_a_pipe_in_a_sequence_is_named(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_folder(tmp_path / 'seq')
    (source / name).unlink()
    os.mkfifo(source / name)
    (tmp_path / 'out').mkdir()
    for words in commands(source, tmp_path / 'out')[1:]:
        code = main(words)
        captured = capsys.readouterr()
        assert code in (1, 2), words
        assert 'is a named pipe' in captured.err + captured.out, words


@pytest.mark.parametrize('plugin', ['MCAP', 'SQLITE3'])
def test_a_pipe_in_a_bag_is_named(
    plugin: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_rosbag2(tmp_path / 'bag', camera_messages(FRAMES), plugin)
    (source / 'metadata.yaml').unlink()
    os.mkfifo(source / 'metadata.yaml')
    assert main(['info', str(source)]) == 0
    assert 'cannot be understood' in capsys.readouterr().out
    storage = next(p for p in source.iterdir() if p.suffix in ('.mcap', '.db3'))
    storage.unlink()
    os.mkfifo(storage)
    assert 'is a named pipe' in refused(capsys, 'info', source)


@pytest.mark.parametrize('name', ['runs.jsonl', 'results/kcf/source.json'])
def test_a_pipe_in_a_report_is_not_waited_for(name: str, tmp_path: Path) -> None:
    words = ['evaluate', str(write_folder(tmp_path / 'source')), '--variants', 'kcf', '--jobs', '1']
    words += ['--report', str(tmp_path / 'report')]
    assert main(words) == 0
    path = tmp_path / 'report' / name
    path.unlink()
    os.mkfifo(path)
    code = main(words)
    assert code == (2 if name == 'runs.jsonl' else 0)
    assert path.is_fifo() == bool(code), 'a result is made anew'


@pytest.mark.parametrize('text', ['[' * 100_000, '[]', '\0', ''])
def test_what_a_run_noted_may_be_damaged(text: str, tmp_path: Path) -> None:
    words = ['track', str(write_folder(tmp_path / 'source')), '--jobs', '1', *INIT]
    words += ['--variant', 'kcf', '--output', str(tmp_path / 'out')]
    assert main(words) == 0
    note = tmp_path / 'out' / '.done' / 'source.json'
    kept = note.read_text()
    note.write_text(text)
    assert main([*words, '--overwrite']) == 0
    assert note.read_text() == kept


def test_files_larger_than_can_be_are_not_read(
    tmp_path: Path,
) -> None:
    path = tmp_path / 'a.txt'
    with path.open('wb') as file:
        file.truncate(files.MAX_TEXT + 1)
    with pytest.raises(RecordingError, match='more than 268435456 are not read'):
        read_boxes(path)


# -- names -------------------------------------------------------------------------------------


@pytest.mark.parametrize('kind', ['folder', 'mcap', 'MCAP', 'SQLITE3'])
def test_names_that_are_not_utf_8_work_and_are_told(
    kind: str, tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    place = tmp_path / os.fsdecode(b'caf\xe9')
    place.mkdir()
    source = place / os.fsdecode(b'th\xe9')
    if kind == 'folder':
        write_folder(source)
    elif kind == 'mcap':
        write_mcap(source, camera_messages(FRAMES))
    else:
        write_rosbag2(tmp_path / 'bag', camera_messages(FRAMES), kind)
        shutil.move(tmp_path / 'bag', source)
    out = {name: str(place / f'{source.name}.{name}') for name in ('csv', 'mp4', 'mcap')}
    words = ['track', str(source), *INIT, '--variant', 'kcf', '--output', out['csv']]
    assert main([*words, '--video', out['mp4'], '--bag', out['mcap']]) == 0
    for path in out.values():
        assert Path(path).stat().st_size > 100
    assert main(['info', str(source)]) == 0
    assert main(['info', str(source), '--json']) == 0
    assert main(['convert', str(source), str(place / 'b.mcap')]) == 0
    if kind == 'folder':
        report = str(place / 'report')
        words = ['evaluate', str(source), '--variants', 'kcf', '--jobs', '1', '--report', report]
        assert main(words) == 0
    capfdbinary.readouterr()
    said = subprocess.run(
        [sys.executable, '-m', 'rgbd_kcf_tracker.cli.main', 'info', str(source) + '.none'],
        capture_output=True,
        env=os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)},
        check=False,
    )
    assert said.returncode == 2
    assert b'th\\udce9.none does not exist' in said.stderr


def test_names_of_sequences_do_not_hang_on_the_locale() -> None:
    code = """
import dataclasses, pathlib
from rgbd_kcf_tracker.evaluation.datasets.base import broken
print(ascii(dataclasses.replace(broken(pathlib.Path('a/th\\udcc3\\udca9'), '')).name))
"""
    plain = {'LC_ALL': 'C', 'PYTHONUTF8': '0', 'PYTHONCOERCECLOCALE': '0'}
    said = subprocess.run(
        [sys.executable, '-c', code],
        capture_output=True,
        env=os.environ | plain | {'PYTHONPATH': os.pathsep.join(sys.path)},
        check=True,
    )
    assert said.stdout == b"'th\\xe9'\n"


@pytest.mark.parametrize('kind', ['folder', 'MCAP', 'SQLITE3'])
def test_what_macos_leaves_beside_files_is_not_read(kind: str, tmp_path: Path) -> None:
    source = tmp_path / 'walk'
    if kind == 'folder':
        write_folder(source)
    else:
        write_rosbag2(source, camera_messages(FRAMES), kind)
    for path in [p for p in source.rglob('*') if p.is_file()]:
        path.with_name(f'._{path.name}').write_bytes(b'\0\5\x16\7\0\2\0\0Mac OS X        ')
    with open_recording(source) as recording:
        assert len(list(recording.frames())) == len(FRAMES)


# -- ground truth ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    'line',
    [
        '1,nan,3,4', 'inf,2,3,4', '1,2,3,-inf', 'nan,nan,nan,4',
        '1,2,-3,4', '1,2,3,-4', '1,2,3,4,5', '1,2,3,4,5,6,7', '1,2,nan,4,5,6,7,8',
        '1,2,1e300,4', '-1e10,2,3,4', '1,2,3,4,5,6,7,2e9', '1,,2,3,4',
    ],
)  # fmt: skip
def test_what_is_no_box_is_an_error_that_names_the_line(
    line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_folder(tmp_path / 'seq')
    truth = source / 'groundtruth.txt'
    lines = truth.read_text().splitlines()
    truth.write_text('\n'.join([lines[0], 'nan,nan,nan,nan', line, lines[3]]))
    assert f'groundtruth.txt, line 3: {line!r} is no box' in refused(capsys, 'track', source)
    (sequence,) = open_dataset(str(source))
    with pytest.raises(RecordingError, match='line 3'):
        sequence.open()
    truth.write_text('\n'.join([lines[0], 'nan,nan,nan,nan', '0,0,0,0', lines[3]]))
    assert [box is None for box in read_boxes(truth)] == [False, True, True, False]


def test_half_a_box_in_a_file_of_tracks_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    head = 'frame,stamp_ns,x,y,width,height,state,score,depth_m'
    path.write_text(f'{head}\n0,0,1,2,3,4,tracking,0.5,\n1,1,1,2,,4,tracking,0.5,\n')
    with pytest.raises(DatasetError, match=r'line 3: .* a box lacks one'):
        read_tracks(path)


# -- images ------------------------------------------------------------------------------------


def test_images_larger_than_any_camera_are_refused_unless_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_folder(tmp_path / 'seq')
    shutil.rmtree(source / 'depth')
    big = np.zeros((8000, 8000), np.uint8)
    _, data = cv2.imencode('.png', big, [int(cv2.IMWRITE_PNG_COMPRESSION), 1])
    (source / 'rgb' / '000001.png').write_bytes(data.tobytes())
    error = refused(capsys, 'track', source)
    assert '8000x8000 pixels: more than 16777216 are not read (max_pixels sets the limit)' in error
    with open_recording(source, ReadOptions(max_pixels=8000 * 8000)) as recording:
        assert next(recording.frames(0, 1)).width == 8000
    with open_recording(source) as recording, pytest.raises(ImageError, match='8000x8000'):
        next(recording.frames(0, 1))
    assert 'max_pixels is 0' in refused(capsys, 'track', source, '--max-pixels', '0')


# -- cameras -----------------------------------------------------------------------------------


@pytest.mark.parametrize('letter', ['K', 'k'])
def test_camera_info_beside_a_sequence_is_read(
    letter: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_folder(tmp_path / 'seq')
    (source / 'intrinsics.json').unlink()
    info = source / 'camera_info.json'
    info.write_text(f'{{"width": 64, "{letter}": [70, 0, 31, 0, 71, 22, 0, 0, 1]}}')
    assert main(['info', str(source)]) == 0
    assert 'fx 70.00  fy 71.00' in capsys.readouterr().out
    (sequence,) = open_dataset(str(source))
    camera = next(iter(sequence.open().samples)).frame.intrinsics
    assert camera is not None
    assert camera.fx == 70
    for text, words in (
        ('', 'line 1 is no JSON'),
        ('[]', 'it is no JSON object'),
        ('{}', 'K is missing'),
        ('{"K": 5}', 'camera_info has no 3x3 K'),
        ('{"K": [0, 0]}', 'camera_info has no 3x3 K'),
        (f'{{"K": [1{"0" * 400}, 0, 31, 0, 71, 22, 0, 0, 1]}}', 'camera_info has no 3x3 K'),
        ('{"K": [70, 0, 31, 0, 71, 22, 0, 0, 1], "roi": 5}', 'roi is no JSON object'),
        ('{"K": [70, 0, 31, 0, 71, 22, 0, 0, 1], "rectified": "false"}', "rectified is 'false'"),
        ('[' * 100_000, 'it is nested too deeply'),
    ):
        info.write_text(text)
        assert f'camera_info.json holds no camera ({words}' in refused(capsys, 'info', source)
    # our own file goes before it
    (source / 'intrinsics.json').write_text('{"fx": 60, "fy": 61, "cx": 31.5, "cy": 23.5}')
    with open_recording(source) as recording:
        assert recording.intrinsics == CAMERA


def test_a_camera_for_images_of_another_size_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As in a bag: its metres would be wrong by the ratio."""
    source = write_folder(tmp_path / 'seq')
    (source / 'intrinsics.json').unlink()
    info = source / 'camera_info.json'
    info.write_text('{"width": 1920, "height": 1080, "K": [1000, 0, 960, 0, 1000, 540, 0, 0, 1]}')
    with open_recording(source) as recording:
        assert recording.intrinsics is None
        (warning,) = recording.warnings
    assert warning.startswith('camera_info.json is for 1920x1080 images but these are ')
    (sequence,) = open_dataset(str(source))
    assert next(iter(sequence.open().samples)).frame.intrinsics is None


def test_a_database_with_a_log_is_read_and_left_as_it_is(tmp_path: Path) -> None:
    """A bag whose recorder was killed: SQLite would tidy up in its folder."""
    folder = write_rosbag2(tmp_path / 'bag', camera_messages(FRAMES), 'SQLITE3')
    (storage,) = folder.glob('*.db3')
    with closing(sqlite3.connect(storage)) as database:
        database.execute('PRAGMA journal_mode=WAL')
        database.execute('UPDATE messages SET timestamp = timestamp + 1')
        database.commit()
        copy = tmp_path / 'copy'
        shutil.copytree(folder, copy)
    assert any(p.name.endswith('-wal') for p in copy.iterdir())
    before = {p.name: p.read_bytes() for p in copy.iterdir()}
    with open_recording(copy) as recording:
        assert len(list(recording.frames())) == len(FRAMES)
    assert {p.name: p.read_bytes() for p in copy.iterdir()} == before
