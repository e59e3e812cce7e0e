# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The command line as a user meets it: options, outputs, errors, exit codes."""

from __future__ import annotations

import csv
import dataclasses
import fcntl
import json
import os
import signal
import struct
import subprocess
import sys
import termios
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from bag_rig import CAMERA, COLOR, DEPTH, camera_messages, make_frames, write_mcap, write_ros1

from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import SequenceWriter, open_recording
from rgbd_kcf_tracker.variants import VARIANTS

SQUARE = 40


def moving_square(count: int = 12, depth: bool = True) -> list[tuple[Frame, Box]]:
    """A textured square that goes right by 3 pixels a frame, nearer than its background."""
    rng = np.random.default_rng(3)
    background = cv2.GaussianBlur(rng.integers(0, 256, (120, 160, 3), np.uint8), (9, 9), 3)
    target = cv2.resize(rng.integers(0, 256, (8, 8, 3), np.uint8), (SQUARE, SQUARE))
    made = []
    for number in range(count):
        x, y = 30 + 3 * (number % 28), 40
        color = background.copy()
        color[y : y + SQUARE, x : x + SQUARE] = target
        metres = np.full((120, 160), 3.0, np.float32)
        metres[y : y + SQUARE, x : x + SQUARE] = 1.5
        frame = Frame(color, metres if depth else None, number * 33_333_333, CAMERA)
        made.append((frame, Box(x, y, SQUARE, SQUARE)))
    return made


def write_folder(path: Path, **options: Any) -> Path:
    with SequenceWriter(path) as writer:
        for frame, box in moving_square(**options):
            writer.write(frame, box)
    return path


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(tmp_path_factory.mktemp('square') / 'square')


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline='') as file:
        return list(csv.DictReader(file))


def fails(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The one line that the command fails with."""
    assert main([str(a) for a in arguments]) == 2
    captured = capsys.readouterr()
    lines = [line for line in captured.err.splitlines() if not line.startswith('warning: ')]
    assert len(lines) == 1, captured.err
    assert lines[0].startswith('rgbd-kcf: error: ')
    assert captured.out == ''
    return lines[0]


# -- track -------------------------------------------------------------------------------------


def test_track_writes_csv_video_and_bag(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = {name: tmp_path / f'out.{name}' for name in ('csv', 'mp4', 'mcap')}
    arguments = ['track', str(folder), '--variant', 'kcf', '--output', str(out['csv'])]
    code = main([*arguments, '--video', str(out['mp4']), '--bag', str(out['mcap'])])
    assert code == 0
    summary = capsys.readouterr().out
    assert summary.startswith('square: 12 frames with kcf: 12 tracking; ')
    assert str(out['csv']) in summary
    assert 'success 1.000' in summary
    found = rows(out['csv'])
    assert [int(r['frame']) for r in found] == list(range(12))
    assert [int(r['stamp_ns']) for r in found] == [n * 33_333_333 for n in range(12)]
    assert all(r['state'] == 'tracking' for r in found)
    for row, (_, box) in zip(found, moving_square(), strict=True):
        assert float(row['x']) == pytest.approx(box.x, abs=3)
    video = cv2.VideoCapture(str(out['mp4']))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 12
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(30, abs=0.1)
    with open_recording(out['mcap']) as recording:
        assert len(recording) == 12
        assert recording.groundtruth == [box for _, box in moving_square()]


@pytest.mark.parametrize('variant', list(VARIANTS))
def test_folder_and_bag_give_the_same_boxes(variant: str, folder: Path, tmp_path: Path) -> None:
    assert main(['convert', str(folder), str(tmp_path / 'a.mcap')]) == 0
    for name, source in (('folder', folder), ('bag', tmp_path / 'a.mcap')):
        output = str(tmp_path / f'{name}.csv')
        assert main(['track', str(source), '--variant', variant, '--output', output]) == 0
    text = (tmp_path / 'folder.csv').read_text()
    assert text == (tmp_path / 'bag.csv').read_text()
    assert text.count('tracking') == 12


@pytest.mark.parametrize('variant', list(VARIANTS))
def test_colour_alone_works_for_every_variant(variant: str, tmp_path: Path) -> None:
    """A folder without depth, as OTB's are."""
    source = write_folder(tmp_path / 'a', depth=False)
    (source / 'intrinsics.json').unlink()
    output = tmp_path / 'a.csv'
    assert main(['track', str(source), '--variant', variant, '--output', str(output)]) == 0
    last = rows(output)[-1]
    assert last['state'] == 'tracking'
    assert float(last['x']) == pytest.approx(30 + 33, abs=6)
    assert last['depth_m'] == ''
    bag = tmp_path / 'a.mcap'
    assert main(['convert', str(source), str(bag)]) == 0
    again = tmp_path / 'b.csv'
    arguments = ['track', str(bag), '--variant', variant, '--output', str(again)]
    assert main([*arguments, '--depth-topic', 'none']) == 0
    assert again.read_text() == output.read_text()


def test_part_of_the_frames_from_a_given_box(folder: Path, tmp_path: Path) -> None:
    output = tmp_path / 'a.csv'
    arguments = ['track', str(folder), '--start', '3', '--end', '7', '--init', '39,40,40,40']
    assert main([*arguments, '--output', str(output)]) == 0
    found = rows(output)
    assert [int(r['frame']) for r in found] == [3, 4, 5, 6]
    assert [float(found[0][k]) for k in ('x', 'y', 'width', 'height')] == [39, 40, 40, 40]


def test_a_box_that_begins_left_of_the_image(folder: Path, tmp_path: Path) -> None:
    """A number with a minus is no option, however it is given."""
    for number, init in enumerate((['--init', '-10,40,60,40'], ['--init=-10,40,60,40'])):
        output = tmp_path / f'{number}.csv'
        words = ['track', str(folder), *init, '--intrinsics', '525,525,-3,.5', '--end', '3']
        assert main([*words, '--variant', 'kcf', '--output', str(output)]) == 0
        assert rows(output)[0]['x'] == '-10.0000'


def test_rows_before_the_first_box_are_idle(tmp_path: Path) -> None:
    source = write_folder(tmp_path / 'a')
    text = (source / 'groundtruth.txt').read_text().splitlines()
    text[:2] = ['nan,nan,nan,nan'] * 2
    (source / 'groundtruth.txt').write_text('\n'.join(text))
    assert main(['track', str(source), '--output', str(tmp_path / 'a.csv')]) == 0
    found = rows(tmp_path / 'a.csv')
    assert [r['state'] for r in found[:3]] == ['idle', 'idle', 'tracking']
    assert (found[0]['x'], found[0]['score']) == ('', '')


def test_csv_on_standard_output(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['track', str(folder), '--output', '-', '--end', '2']) == 0
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 3
    assert 'square: 2 frames' in captured.err


def test_rate_and_intrinsics_of_a_folder(tmp_path: Path) -> None:
    source = write_folder(tmp_path / 'a')
    (source / 'timestamps.txt').unlink()
    (source / 'intrinsics.json').unlink()
    bag = tmp_path / 'a.mcap'
    options = ['--fps', '5', '--intrinsics', '100,101,50,51']
    assert main(['track', str(source), '--bag', str(bag), *options]) == 0
    with open_recording(bag) as recording:
        assert recording.info().rate_hz == pytest.approx(5)
        assert recording.intrinsics is not None
        assert recording.intrinsics.fy == 101


def test_bag_of_a_bag_keeps_its_names_and_metres(tmp_path: Path) -> None:
    sent = camera_messages([f for f, _ in moving_square()])
    source = write_ros1(tmp_path / 'a.bag', sent)
    bag = tmp_path / 'out.mcap'
    assert main(['track', str(source), '--init', '30,40,40,40', '--bag', str(bag)]) == 0
    with open_recording(bag) as recording:
        streams = {s.name: s for s in recording.info().streams}
        assert streams[COLOR].role == 'color'
        assert streams[DEPTH].role == 'depth'
        assert '/tracker/box' in streams


@pytest.mark.filterwarnings('error::RuntimeWarning')
def test_depth_that_is_no_metres_is_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_folder(tmp_path / 'a')
    images = sorted((source / 'depth').iterdir())
    for path in images[1:3]:
        depth = np.full((120, 160), 2.0, np.float32)
        depth[:3, 0] = 3e38, 2000, 1e-30
        cv2.imwrite(str(path.with_suffix('.tiff')), depth)
        path.unlink()
    outputs = (['--output', str(tmp_path / 'a.csv')], ['--bag', str(tmp_path / 'b.mcap')])
    for command in (
        ['convert', str(source), str(tmp_path / 'a.mcap')],
        *(['track', str(source), '--variant', 'kcf', *output] for output in outputs),
    ):
        assert main(command) == 0
        (line,) = capsys.readouterr().err.splitlines()
        assert '6 numbers in 2 depth images' in line
        assert f'{images[1].with_suffix(".tiff")}, are not between 0.001 and 65.535 metres' in line


# -- bad input ---------------------------------------------------------------------------------


def test_bad_values_say_what_to_write(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    track = ('track', folder)
    for empty in (('--output', ''), ('--output=',)):  # a variable of the shell that is not set
        assert 'what follows --output is empty' in fails(capsys, *track, *empty)
    assert 'what follows info is empty' in fails(capsys, 'info', '')
    assert 'X,Y,W,H' in fails(capsys, *track, '--init', '1,2,3')
    assert 'X,Y,W,H' in fails(capsys, *track, '--init', 'a,b,c,d')
    for box, why in (
        ('10,10,0,5', 'has no size'),
        ('10,10,-4,5', 'has no size'),
        ('nan,10,4,5', 'must be finite'),
    ):
        said = fails(capsys, *track, '--init', box)
        assert f'--init {box!r}' in said
        assert why in said
    assert 'lies outside the 160x120' in fails(capsys, *track, '--init', '500,10,20,20')
    assert 'lies outside' in fails(capsys, *track, '--init', '-50,10,20,20')
    assert 'reaches too far' in fails(capsys, *track, '--init', '10,10,4294967246,20')
    assert 'reaches too far' in fails(capsys, *track, '--init', '-1e9,-1e9,2e9,2e9')
    assert 'FX,FY,CX,CY' in fails(capsys, *track, '--intrinsics', '5,5')
    assert 'focal' in fails(capsys, *track, '--intrinsics', '0,5,5,5')
    assert 'choose one of' in fails(capsys, *track, '--variant', 'magic')
    assert 'unknown parameter' in fails(capsys, *track, '--param', 'magic=1')
    assert 'padding' in fails(capsys, *track, '--variant', 'kcf', '--param', 'padding=-5')
    assert 'padding' in fails(capsys, *track, '--variant', 'kcf', '--param', 'padding=wide')
    assert 'key=value' in fails(capsys, *track, '--param', 'padding')
    # As for `evaluate` a key may name the tracker.
    kcf = *track, '--variant', 'kcf', '--param'
    assert 'padding' in fails(capsys, *kcf, 'kcf.padding=-5')
    assert "the tracker is kcf, not 'metric'" in fails(capsys, *kcf, 'metric.view_width=200')
    assert "the tracker is kcf, not ''" in fails(capsys, *kcf, '.view_width=200')
    assert 'frames 0 to 11' in fails(capsys, *track, '--start', '12')
    assert 'above --start 5' in fails(capsys, *track, '--start', '5', '--end', '5')
    for fps in ('0', '-5', '1e-300', 'inf', 'nan'):
        assert 'fps is' in fails(capsys, *track, '--fps', fps)
    for tolerance in ('-1', '1e308'):
        assert 'give 0 to 3600' in fails(capsys, *track, '--tolerance', tolerance)
    assert list(tmp_path.iterdir()) == []


def test_a_box_outside_the_image_leaves_no_files(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ('track', folder, '--init', '500,10,20,20', '--output', tmp_path / 'a.csv')
    fails(capsys, *arguments, '--bag', tmp_path / 'a.mcap', '--video', tmp_path / 'a.mp4')
    assert list(tmp_path.iterdir()) == []


def test_success_is_only_told_of_the_target_of_the_ground_truth(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(['track', str(folder), '--init', '100,5,40,30']) == 0
    assert 'success' not in capsys.readouterr().out


def test_bad_sources(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in (['track'], ['info'], ['convert']):
        dest = [tmp_path / 'out.mcap'] if command == ['convert'] else []
        assert 'does not exist' in fails(capsys, *command, tmp_path / 'none', *dest)
        (tmp_path / 'letter.mcap').write_text('Dear reader, this is no recording.')
        assert 'is no recording' in fails(capsys, *command, tmp_path / 'letter.mcap', *dest)
        # Fails to be read as on a disk that fails.
        assert '/proc/self/mem cannot be read: Input' in fails(
            capsys, *command, '/proc/self/mem', *dest
        )


def test_no_box_at_all(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write_folder(tmp_path / 'a')
    (source / 'groundtruth.txt').write_text('nan,nan,nan,nan\n' * 12)
    assert 'no box from frame 0 to 11: give the target as --init' in fails(capsys, 'track', source)
    (source / 'groundtruth.txt').unlink()
    assert 'has no ground truth: give the target as --init' in fails(capsys, 'track', source)


def test_topics_that_are_missing_or_too_many(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frames = make_frames(2)
    source = write_mcap(tmp_path / 'b.mcap', camera_messages(frames, info=None)[1::2])
    error = fails(capsys, 'track', source)
    assert 'no colour topic' in error
    assert DEPTH in error
    sent = camera_messages(frames) + camera_messages(frames, '/b/color/image', '/b/depth/image')
    source = write_mcap(tmp_path / 'c.mcap', sent)
    error = fails(capsys, 'track', source)
    assert '2 cameras' in error
    assert '--color-topic /b/color/image --depth-topic /b/depth/image' in error
    arguments = ['track', str(source), '--color-topic', '/b/color/image', '--init', '5,5,30,30']
    assert main(arguments) == 0


def test_depth_of_another_size(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write_folder(tmp_path / 'a')
    cv2.imwrite(str(source / 'depth' / '000001.png'), np.ones((60, 80), np.uint16))
    error = fails(capsys, 'track', source)
    assert 'depth is 80x60 but colour is 160x120: register' in error


def test_outputs_that_cannot_be(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / 'file').write_text('')
    for option, name in (('--output', 'a.csv'), ('--video', 'a.mp4'), ('--bag', 'a.mcap')):
        path = tmp_path / 'file' / 'sub' / name
        assert f'{name} cannot be written' in fails(capsys, 'track', folder, option, path)
    source = tmp_path / 'in.mcap'
    assert main(['convert', str(folder), str(source)]) == 0
    before = source.read_bytes()
    capsys.readouterr()
    assert 'is the source itself' in fails(capsys, 'track', source, '--bag', source)
    assert 'is the source itself' in fails(capsys, 'convert', source, source)
    assert 'must end in .mcap' in fails(capsys, 'convert', source, tmp_path / 'a.bag')
    assert '--table parquet' in fails(capsys, 'track', source, '--output', tmp_path / 'a.parquet')
    for option, name in (
        ('--output', 'a.mp4'), ('--output', 'a.MCAP'), ('--mot', 'a.mkv'), ('--mot', 'a.bag'),
    ):  # fmt: skip
        error = fails(capsys, 'track', source, option, tmp_path / name)
        assert f'{option} {tmp_path / name} would be' in error
    for name in ('a.bag', 'a.db3', 'a'):
        error = fails(capsys, 'track', source, '--bag', tmp_path / name)
        assert f'--bag {tmp_path / name} must end in .mcap' in error
    assert source.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ['file', 'in.mcap']


def test_stream_whose_size_changes_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With a warning, all outputs, and a row for each frame."""
    frames = [f for f, _ in moving_square()]
    for number in range(6, 12):
        frame = frames[number]
        assert frame.depth is not None
        frames[number] = dataclasses.replace(
            frame,
            color=np.ascontiguousarray(frame.color[:100, :140]),
            depth=np.ascontiguousarray(frame.depth[:100, :140]),
        )
    source = write_mcap(tmp_path / 'a.mcap', camera_messages(frames))
    out = [f'{tmp_path}/out.{end}' for end in ('csv', 'mp4', 'mcap')]
    arguments = ['track', str(source), '--init', '30,40,40,40', '--output', out[0], '--overwrite']
    for variant in VARIANTS:
        options = ['--variant', variant, '--video', out[1], '--bag', out[2]]
        assert main([*arguments, *options]) == 0
        assert 'changes from 160x120 to 140x100 at frame 6' in capsys.readouterr().err
        assert len(rows(Path(out[0]))) == 12


# -- convert, info, main -----------------------------------------------------------------------


def test_convert_of_a_bag_refuses_options_that_choose_in_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It copies all that is in it: an option passed over would be taken for obeyed."""
    source, copy = tmp_path / 'a.mcap', tmp_path / 'b.mcap'
    assert main(['simulate', str(source), '--size', '160x90', '--duration', '0.2']) == 0
    capsys.readouterr()
    for option in (
        ['--depth-topic', 'none'], ['--color-topic', '/other'], ['--max-pixels', '9'],
        ['--camera', 'kinect2_hd'],
    ):  # fmt: skip
        assert main(['convert', str(source), str(copy), *option]) == 2
        assert f'{option[0]} means nothing for a bag' in capsys.readouterr().err
        assert not copy.exists()


def test_convert_a_bag_that_was_cut_off(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write_mcap(tmp_path / 'a.mcap', camera_messages(make_frames(6)))
    source.write_bytes(source.read_bytes()[:50_000])
    assert main(['convert', str(source), str(tmp_path / 'b.mcap'), '--compression', 'lz4']) == 0
    captured = capsys.readouterr()
    assert 'was cut off or not closed' in captured.err
    assert 'messages of 3 topics' in captured.out
    assert main(['info', str(tmp_path / 'b.mcap')]) == 0
    assert 'warning' not in capsys.readouterr().out


def test_convert_with_names_of_kinect2_bridge(folder: Path, tmp_path: Path) -> None:
    bag = tmp_path / 'a.mcap'
    assert main(['convert', str(folder), str(bag), '--camera', 'kinect2_qhd']) == 0
    with open_recording(bag) as recording:
        names = {s.name for s in recording.info().streams}
    assert '/kinect2/qhd/image_color_rect' in names


def test_info(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['info', str(folder)]) == 0
    text = capsys.readouterr().out
    assert 'frames        12 (12 with depth), 0.4 s, 30.0 Hz' in text
    assert 'fx 60.00  fy 61.00' in text
    assert 'ground truth  12 frames' in text
    source = write_mcap(tmp_path / 'a.mcap', camera_messages(make_frames(3)))
    assert main(['info', str(source), '--json']) == 0
    info = json.loads(capsys.readouterr().out)
    assert info['frames'] == 3
    roles = {s['name']: s['role'] for s in info['streams']}
    assert roles[COLOR] == 'color'
    several = write_folder(tmp_path / 'several', count=3)
    (several / 'groundtruth.txt').unlink()
    (several / 'mot.txt').write_text('1,1,2,2,5,5,1\n1,2,9,2,5,5,1\n3,-1,9,2,5,5,1\n')
    assert main(['info', str(several)]) == 0
    assert 'ground truth  1 frames with a box' in capsys.readouterr().out
    (several / 'mot.txt').write_text('1,1,2\n')
    assert main(['info', str(several)]) == 0
    assert 'mot.txt, line 1' in capsys.readouterr().out
    source = write_mcap(tmp_path / 'b.mcap', camera_messages(make_frames(3), depth=None))
    assert main(['info', str(source)]) == 0
    assert 'warning: no depth was recorded: read as colour alone' in capsys.readouterr().out
    unregistered = write_folder(tmp_path / 'unregistered', count=3)
    (image,) = unregistered.glob('depth/000001.*')
    depth = cv2.imread(str(image), cv2.IMREAD_UNCHANGED)
    cv2.imwrite(str(image), depth[:-4, :-8])
    assert main(['info', str(unregistered)]) == 0
    high, wide = depth.shape
    told = f'warning: depth is {wide - 8}x{high - 4} but colour is {wide}x{high}: register'
    assert told in capsys.readouterr().out
    source = write_mcap(tmp_path / 'c.mcap', camera_messages(make_frames(3), info=None)[1::2])
    assert main(['info', str(source)]) == 0
    text = capsys.readouterr().out
    assert 'cannot be tracked as it is' in text
    assert DEPTH in text


def test_warnings_are_not_endless(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write_folder(tmp_path / 'a', count=28)
    for path in sorted((source / 'depth').iterdir())[1:]:
        path.write_bytes(b'no image')
    assert main(['track', str(source), '--variant', 'kcf']) == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 21
    assert 'further warnings are not shown' in lines[-1]
    assert main(['info', str(source), '--check']) == 1
    assert capsys.readouterr().out.count('read without depth') == 27


def test_control_characters_of_names_do_not_reach_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sent = [
        dataclasses.replace(s, topic=f'{s.topic}\x1b[2J\n') for s in camera_messages(make_frames(2))
    ]
    source = write_mcap(tmp_path / 'a.mcap', sent)
    assert main(['info', str(source)]) == 0
    said = capsys.readouterr().out
    assert f'{COLOR}\\x1b[2J\\n ' in said
    assert '\x1b' not in said
    error = fails(capsys, 'track', source, '--color-topic', '/none')
    assert f'{COLOR}\\x1b[2J\\n ' in error
    assert '\x1b' not in error


def test_info_checks_every_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write_folder(tmp_path / 'a')
    assert main(['info', str(source), '--check']) == 0
    assert 'checked       12 frames, 0 damaged' in capsys.readouterr().out
    (source / 'rgb' / '000004.png').write_bytes(b'no image')
    (source / 'depth' / '000006.png').write_bytes(b'no image')
    assert main(['info', str(source), '--check']) == 1
    text = capsys.readouterr().out
    assert 'checked       12 frames, 2 damaged' in text
    assert text.count('damaged: ') == 2
    assert '000006.png' in text
    assert main(['info', str(source), '--check', '--json']) == 1
    check = json.loads(capsys.readouterr().out)['check']
    assert (check['frames'], len(check['damaged']), check['warnings']) == (12, 2, [])


def test_a_bag_whose_depth_cannot_be_read_does_not_pass_the_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sent = camera_messages(make_frames(3))
    depth = next(s for s in sent if s.topic == DEPTH)
    depth.message.data = depth.message.data[:100]
    source = write_mcap(tmp_path / 'a.mcap', sent)
    assert main(['info', str(source), '--check']) == 1
    assert 'checked       3 frames, 1 damaged' in capsys.readouterr().out


ENVIRONMENT = os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)}


def program(*arguments: object) -> list[str]:
    return [sys.executable, '-m', 'rgbd_kcf_tracker.cli.main', *map(str, arguments)]


def run_program(*arguments: object, **options: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        program(*arguments),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
        **options,
    )


def test_program_prints_help_version_and_usage() -> None:
    process = run_program('--help')
    out, _ = process.communicate()
    assert process.returncode == 0
    for name in ('track', 'evaluate', 'convert', 'info', 'simulate', 'bench'):
        assert f'\n    {name} ' in out
    process = run_program('--version')
    assert process.communicate()[0].startswith('rgbd-kcf ')
    process = run_program('dance')
    _, err = process.communicate()
    assert process.returncode == 2
    assert 'dance' in err


def test_interrupted_run_leaves_good_files(tmp_path: Path) -> None:
    """Ctrl-C: exit code 130, no traceback, and every file opens."""
    source = write_folder(tmp_path / 'long', count=40)
    images = sorted((source / 'rgb').iterdir())
    for number in range(41, 1500):
        for image in (images[number % 40], source / 'depth' / images[number % 40].name):
            os.link(image, image.with_name(f'{number:06d}.png'))
    (source / 'timestamps.txt').unlink()
    out = {end: tmp_path / f'out.{end}' for end in ('csv', 'mp4', 'mcap')}
    process = run_program(
        'track', source, '--init', '30,40,40,40', '--output', out['csv'],
        '--video', out['mp4'], '--bag', out['mcap'], '--variant', 'kcf', start_new_session=True
    )  # fmt: skip
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        if out['csv'].exists() and len(out['csv'].read_text().splitlines()) > 30:
            break
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.strip().splitlines()[-1] == 'rgbd-kcf: interrupted'
    assert 'Traceback' not in err
    count = len(rows(out['csv']))
    assert 30 <= count < 1499
    with open_recording(out['mcap']) as recording:
        assert abs(len(recording) - count) <= 1
        assert recording.warnings == []
    assert cv2.VideoCapture(str(out['mp4'])).get(cv2.CAP_PROP_FRAME_COUNT) >= 20


def test_progress_is_shown_on_a_terminal_only(folder: Path) -> None:
    main_end, terminal = os.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack('HHHH', 24, 80, 0, 0))
    process = subprocess.Popen(
        [sys.executable, '-m', 'rgbd_kcf_tracker.cli.main', 'track', str(folder)],
        stdout=subprocess.PIPE,
        stderr=terminal,
        env=os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)},
    )
    os.close(terminal)
    shown = b''
    with suppress(OSError):  # the terminal is gone with the process
        while part := os.read(main_end, 4096):
            shown += part
    os.close(main_end)
    out, _ = process.communicate()
    assert process.returncode == 0
    assert b'/12 [' in shown
    assert out.startswith(b'square: 12 frames')


def test_closed_pipe_is_no_traceback(folder: Path) -> None:
    process = run_program('track', folder, '--output', '-')
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    err = process.stderr.read()
    process.wait()
    assert process.returncode != 0
    assert 'Traceback' not in err


@pytest.mark.parametrize('closed', ['<&-', '>&-', '2>&-', '<&- >&- 2>&-'])
def test_a_standard_stream_that_is_closed_is_no_output_file(
    closed: str, folder: Path, tmp_path: Path
) -> None:
    # A file that is opened takes the number of a closed stream, and whatever is printed with it.
    table, bag = tmp_path / 'boxes.csv', tmp_path / 'boxes.mcap'
    words = ['track', str(folder), '--variant', 'kcf', '--output', str(table), '--bag', str(bag)]
    run = ['sh', '-c', f'exec "$@" {closed}', 'sh', *program(*words)]
    ended = subprocess.run(run, env=ENVIRONMENT, capture_output=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, b'')
    assert len(table.read_text().splitlines()) == 13
    assert main(['info', str(bag), '--check']) == 0


def test_a_table_is_not_computed_for_a_standard_output_that_is_closed(folder: Path) -> None:
    run = ['sh', '-c', 'exec "$@" >&-', 'sh', *program('track', str(folder), '--output', '-')]
    ended = subprocess.run(run, env=ENVIRONMENT, capture_output=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr == (
        b'rgbd-kcf: error: --output - is standard output, which is closed: give a file\n'
    )


@pytest.mark.parametrize('unbuffered', ['', '1'])
@pytest.mark.parametrize('words', [('track', '--help'), ('--version',), ('info', '{folder}')])
def test_help_and_answers_that_cannot_be_written_are_told(
    words: tuple[str, ...], unbuffered: str, folder: Path
) -> None:
    with open('/dev/full', 'wb') as full:
        ended = subprocess.run(
            program(*(word.format(folder=folder) for word in words)),
            env=ENVIRONMENT | {'PYTHONUNBUFFERED': unbuffered},
            stdout=full, stderr=subprocess.PIPE, check=False,
        )  # fmt: skip
    assert ended.returncode == 2
    assert ended.stderr.startswith(b'rgbd-kcf: error: standard output, ')
    assert ended.stderr.count(b'\n') == 1


def test_standard_output_that_knows_no_letter_gets_its_number(folder: Path, tmp_path: Path) -> None:
    there = tmp_path / 'no ASCII: \u00fc'
    there.symlink_to(folder)
    ended = subprocess.run(
        program('info', str(there)),
        env=ENVIRONMENT | {'PYTHONIOENCODING': 'ascii'},
        capture_output=True,
        check=True,
    )
    assert ended.stdout.startswith(str(there).encode('ascii', 'backslashreplace'))


def test_a_working_folder_that_is_gone_is_told(folder: Path, tmp_path: Path) -> None:
    gone = tmp_path / 'gone'
    gone.mkdir()
    run = ['sh', '-c', 'cd "$0" && rmdir "$0" && exec "$@"', str(gone)]
    ended = subprocess.run(
        [*run, *program('track', folder, '--output', 'boxes.csv')],
        env=ENVIRONMENT, capture_output=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 2
    assert b'started in is gone' in ended.stderr


# -- real recordings ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('name', 'variant', 'fps', 'start', 'end'),
    [('redkitchen', 'metric', 30, 0, 20), ('filinha', 'kcf', 5, 60, 80)],
)
def test_real_recordings_give_the_same_boxes_from_folder_and_bag(
    name: str, variant: str, fps: int, start: int, end: int, shared_data: Path, tmp_path: Path
) -> None:
    """Part of each, by links, as the bag of a whole one is half a gigabyte."""
    whole, source = shared_data / 'rgbd' / name, tmp_path / name
    for kind in ('rgb', 'depth'):
        (source / kind).mkdir(parents=True)
        for path in sorted((whole / kind).iterdir())[start:end]:
            (source / kind / path.name).symlink_to(path)
    truth = (whole / 'groundtruth.txt').read_text().splitlines()[start:end]
    (source / 'groundtruth.txt').write_text('\n'.join(truth))
    bag = tmp_path / 'a.mcap'
    assert main(['convert', str(source), str(bag), '--fps', str(fps)]) == 0
    for number, path in enumerate((source, bag)):
        output = str(tmp_path / f'{number}.csv')
        options = ['--fps', str(fps), '--variant', variant]
        assert main(['track', str(path), '--output', output, *options]) == 0
    assert (tmp_path / '0.csv').read_text() == (tmp_path / '1.csv').read_text()
    assert 'tracking' in (tmp_path / '0.csv').read_text()


@pytest.mark.parametrize(
    'words',
    [
        ['evaluate', 'sim:normal', '--size', '\u00b2x3'],
        ['evaluate', 'sim:normal', '--size', f'{"9" * 5000}x540'],
        ['evaluate', 'sim:normal', '--short-term', '--eao-lengths', '\u00b2-3'],
        ['simulate', 'x.mcap', '--size', f'{"9" * 5000}x540'],
    ],
)
def test_digits_that_are_no_number_are_refused(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = ['--report', str(tmp_path / 'r')] if words[0] == 'evaluate' else []
    assert main([*words, *report]) == 2
    assert words[-2] in capsys.readouterr().err


def test_behind_two_dashes_nothing_is_an_option(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['info', '--', '-5.mcap']) == 2
    assert '-5.mcap does not exist' in capsys.readouterr().err
