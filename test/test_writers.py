# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What is written: CSV, video, drawings, and the tracker's topics in a bag."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from bag_rig import CAMERA, assert_same_frames, make_frames
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from rgbd_kcf_tracker.errors import MissingExtraError, ParameterError, RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import (
    KINECT2_HD,
    KINECT2_SD,
    BagWriter,
    ReadOptions,
    TrackCsvWriter,
    VideoWriter,
    draw_track,
    open_recording,
    video,
)
from rgbd_kcf_tracker.recordings.encoding import millimetres
from rgbd_kcf_tracker.recordings.messages import tracks_of_state
from rgbd_kcf_tracker.track import Track, TrackState

SEEN = Track(Box(10.25, 8.5, 20, 30.125), TrackState.TRACKING, 0.875, 2.5, (0.1, -0.2, 2.5))
HIDDEN = Track(None, TrackState.OCCLUDED, 0.0, 2.5)


def test_csv_rows(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    with TrackCsvWriter(path) as writer:
        writer.write_track(0, 123, Track(None, TrackState.IDLE))
        writer.write_track(1, 456, SEEN)
        writer.write_track(2, 789, HIDDEN)
        writer.write_track(3, 999, dataclasses.replace(SEEN, depth=None))
        # Each row is there as soon as it is written.
        assert len(path.read_text().splitlines()) == 5
    assert path.read_text().splitlines() == [
        'frame,stamp_ns,x,y,width,height,state,score,depth_m',
        '0,123,,,,,idle,,',
        '1,456,10.2500,8.5000,20.0000,30.1250,tracking,0.8750,2.5000',
        '2,789,,,,,occluded,,',
        '3,999,10.2500,8.5000,20.0000,30.1250,tracking,0.8750,',
    ]


def unwritable(tmp_path: Path) -> Path:
    """A folder that cannot be made, for root too: its parent is a file."""
    (tmp_path / 'file').write_text('')
    return tmp_path / 'file' / 'folder'


@pytest.mark.parametrize('make', [TrackCsvWriter, VideoWriter, BagWriter])
def test_output_that_cannot_be_written(make: Any, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r'out\.x cannot be written'):
        make(unwritable(tmp_path) / 'out.x')
    with pytest.raises(RecordingError, match='is a folder'):
        make(tmp_path)
    with pytest.raises(RecordingError, match=r'there is no folder .*new: make it first'):
        make(tmp_path / 'new' / 'out.mp4')
    assert [p.name for p in tmp_path.iterdir()] == ['file']


@pytest.mark.skipif(os.geteuid() == 0, reason='root may write anywhere')
def test_a_folder_without_write_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(RecordingError, match='Permission denied'):
        TrackCsvWriter(tmp_path / 'a.csv')


FILL_THE_DISK = """
import resource, sys
import numpy as np
from pathlib import Path
from bag_rig import make_frames
from test_writers import SEEN
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings import BagWriter, SequenceWriter, TrackCsvWriter, VideoWriter
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
frames = make_frames(60, (8, 6))
noise = np.random.default_rng(3).integers(0, 256, (480, 640, 3)).astype(np.uint8)
name = sys.argv[1]
try:
    if name.endswith('csv'):
        with TrackCsvWriter(name) as out:
            for number in range(10_000):
                out.write_track(number, number, SEEN)
    elif name.endswith('mcap'):
        with BagWriter(name) as out:
            for frame in frames:
                out.write_frame(frame)
    elif name.endswith('mp4'):
        with VideoWriter(name) as out:
            for number in range(200):
                out.write(np.roll(noise, number, 1))
    else:
        with SequenceWriter(name) as out:
            for frame in frames:
                out.write(frame)
except RecordingError as error:
    print(error)
"""


@pytest.mark.parametrize(
    ('name', 'limit'), [('a.csv', 2000), ('a.mcap', 20_000), ('a.mp4', 700_000), ('a', 400)]
)
def test_what_was_written_before_a_disk_is_full_stays(
    name: str, limit: int, tmp_path: Path
) -> None:
    """The limit on the size of files stands for the disk."""
    path = tmp_path / name
    said = subprocess.run(
        [sys.executable, '-c', FILL_THE_DISK, str(path), str(limit)],
        env=os.environ | {'PYTHONPATH': os.pathsep.join([*sys.path, os.path.dirname(__file__)])},
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    assert 'File too large' in said.stdout, said
    assert str(path) in said.stdout
    assert 'Traceback' not in said.stderr
    assert [p.name for p in tmp_path.iterdir()] == [name]
    if name == 'a':
        with open_recording(path) as recording:
            assert len(list(recording.frames())) == recording.info().frames_with_depth > 10
            assert recording.warnings == []
        assert not list(path.rglob('*.part'))
    elif name == 'a.csv':
        assert len(path.read_text().splitlines()) > 20
    elif name == 'a.mcap':
        with open_recording(path) as recording:
            assert len(list(recording.frames())) > 2
    elif name == 'a.mp4':
        assert len(frames_of(path)) > 20


def test_devices_are_no_outputs() -> None:
    with pytest.raises(RecordingError, match='is a device'):
        TrackCsvWriter('/dev/null')


# -- bag ---------------------------------------------------------------------------------------


def test_bag_holds_the_images_and_the_topics_of_the_tracker(tmp_path: Path) -> None:
    frames = make_frames(3)
    with BagWriter(tmp_path / 'a.mcap', KINECT2_HD, annotate=True) as writer:
        for frame, track in zip(frames, (SEEN, HIDDEN, SEEN), strict=True):
            writer.write_frame(frame)
            writer.write_track(frame, track)
    with open_recording(tmp_path / 'a.mcap') as recording:
        assert_same_frames(list(recording.frames()), frames)
    found: dict[str, list[Any]] = {}
    with (tmp_path / 'a.mcap').open('rb') as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for item in reader.iter_decoded_messages():
            found.setdefault(item.channel.topic, []).append(item.decoded_message)
    with AnyReader([tmp_path / 'a.mcap']) as other:
        assert other.message_count == sum(len(messages) for messages in found.values())
    assert {name: len(messages) for name, messages in found.items()} == {
        '/kinect2/hd/image_color_rect': 3,
        '/kinect2/hd/image_depth_rect': 3,
        '/kinect2/hd/camera_info': 3,
        '/tracker/box': 3,
        '/tracker/occluded': 3,
        '/tracker/roi': 2,
        '/tracker/position': 2,
        '/tracker/marker': 3,
        '/tracker/markers': 3,
        '/tracker/annotations': 3,
        '/tracker/camera_info': 3,
        '/tracker/state': 3,
        '/tracker/pose': 2,
        '/tracker/image_annotated/compressed': 3,
    }
    color = found['/kinect2/hd/image_color_rect'][0]
    assert (color.encoding, color.header.frame_id) == ('bgr8', 'kinect2_rgb_optical_frame')
    box, hidden, _ = found['/tracker/box']
    assert [(p.x, p.y) for p in box.polygon.points] == [
        (10.25, 8.5), (30.25, 8.5), (30.25, 38.625), (10.25, 38.625)
    ]  # fmt: skip
    assert (box.header.stamp.sec, box.header.stamp.nanosec) == (
        color.header.stamp.sec,
        color.header.stamp.nanosec,
    )
    assert box.header.frame_id == color.header.frame_id
    assert not hidden.polygon.points
    assert [m.data for m in found['/tracker/occluded']] == [False, True, False]
    roi = found['/tracker/roi'][0]
    assert (roi.x_offset, roi.y_offset, roi.width, roi.height) == (10, 8, 21, 31)
    point = found['/tracker/position'][0].point
    assert (point.x, point.y, point.z) == (0.1, -0.2, 2.5)
    marker, gone, _ = found['/tracker/marker']
    assert (marker.action, gone.action) == (0, 2)
    assert marker.scale.x == pytest.approx(20 * 2.5 / CAMERA.fx)
    assert marker.scale.y == pytest.approx(30.125 * 2.5 / CAMERA.fy)
    ((seen,), (hidden,)) = (tracks_of_state(found['/tracker/state'][i]) for i in (0, 1))
    assert (seen.state, seen.box, seen.position) == (SEEN.state, SEEN.box, SEEN.position)
    assert (hidden.state, hidden.box) == (HIDDEN.state, None)
    overlay, nothing, _ = found['/tracker/annotations']
    assert [(p.x, p.y) for p in overlay.points[0].points] == [
        (p.x, p.y) for p in box.polygon.points
    ]
    assert overlay.texts[0].text == f'{SEEN.id} tracking {SEEN.score:.2f}'
    assert not nothing.points
    info = found['/kinect2/hd/camera_info'][0]
    assert info.k == found['/tracker/camera_info'][0].k
    assert list(info.k) == [60, 0, 31.5, 0, 61, 23.5, 0, 0, 1]
    packed = np.frombuffer(found['/tracker/image_annotated/compressed'][0].data, np.uint8)
    assert cv2.imdecode(packed, cv2.IMREAD_COLOR).shape == (48, 64, 3)


def test_bag_brings_the_types_that_ros_does_not_have(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'a.mcap') as writer:
        writer.write_track(make_frames(1)[0], SEEN)
    with (tmp_path / 'a.mcap').open('rb') as file:
        summary = make_reader(file).get_summary()
    schema = next(s for s in summary.schemas.values() if 'ImageAnnotations' in s.name)
    assert (schema.name, schema.encoding) == ('foxglove_msgs/msg/ImageAnnotations', 'ros2msg')
    for kind in ('Point2', 'Color', 'PointsAnnotation', 'TextAnnotation', 'CircleAnnotation'):
        assert f'MSG: foxglove_msgs/{kind}' in schema.data.decode()


def test_layout_for_foxglove_shows_what_bags_hold(tmp_path: Path) -> None:
    """Every topic and path in config/foxglove.json is in a bag of track --bag."""
    text = (Path(__file__).parent.parent / 'config' / 'foxglove.json').read_text()
    layout = json.loads(text)
    frame = make_frames(1)[0]
    moving = dataclasses.replace(
        SEEN, velocity=(0.1, 0.0, 0.5), covariance=(1.0,) * 9, velocity_covariance=(1.0,) * 9
    )
    with BagWriter(tmp_path / 'a.mcap') as writer:
        writer.write_frame(frame)
        writer.write_track(frame, moving)
    with AnyReader([tmp_path / 'a.mcap']) as bag:
        kinds = {c.topic: (c, bag.deserialize(raw, c.msgtype)) for c, _, raw in bag.messages()}
    named = set(re.findall(r'"(/[^"]+)"', text))
    assert len(named) >= 8
    for path in named:
        topic, *fields = path.split('.')
        message = kinds[topic][1]
        for name in fields:
            name, _, index = name.partition('[')
            message = getattr(message, name)
            message = message[int(index[:-1])] if index else message
    panels = set(layout['configById'])
    assert panels == set(re.findall(r'"(?:first|second)": "([^"]+)"', text))


def test_configuration_for_rviz_names_topics_of_the_tracker() -> None:
    path = Path(__file__).parent.parent / 'config' / 'tracker.rviz'
    displays = yaml.safe_load(path.read_text())['Visualization Manager']['Displays']
    topics = {d['Topic']['Value'] for d in displays if 'Topic' in d}
    assert topics == {'/tracker/image_annotated', '/tracker/markers', '/tracker/pose'}


def test_bag_in_metres_keeps_every_depth(tmp_path: Path) -> None:
    frame = make_frames(1)[0]
    depth = np.full((48, 64), 1.23456789, np.float32)
    depth[0, 0] = np.nan
    frame = dataclasses.replace(frame, depth=depth)
    path = tmp_path / 'a.mcap'
    with BagWriter(path, KINECT2_SD, depth_encoding='32FC1', compression='lz4') as writer:
        writer.write_frame(frame)
    with open_recording(path) as recording:
        assert_same_frames(list(recording.frames()), [frame])


@pytest.mark.parametrize('stamp_ns', [5, -5_000_000_000])
def test_colour_alone_is_written_and_read(stamp_ns: int, tmp_path: Path) -> None:
    """Also before 1970: a clock that was not set, or of a simulator."""
    frame = Frame(make_frames(1)[0].color, None, stamp_ns)
    with BagWriter(tmp_path / 'a.mcap') as writer:
        writer.write_frame(frame)
    with open_recording(tmp_path / 'a.mcap') as recording:
        assert_same_frames(list(recording.frames()), [frame])
        assert recording.warnings == ['no depth was recorded: read as colour alone']
    with open_recording(tmp_path / 'a.mcap', ReadOptions(depth_topic='none')) as recording:
        assert recording.warnings == []  # asked for


@pytest.mark.parametrize('without', [(), (2, 3)])
def test_time_that_jumps_back_stays_in_the_order_written(
    without: tuple[int, ...], tmp_path: Path
) -> None:
    """Twice the same stamps, each frame with its depth, camera, truth and track; none is lost.

    Depth that is missing about the jump does not show it.
    """
    step = 2_000_000_000
    frames = [
        dataclasses.replace(frame, stamp_ns=(number % 3) * step)
        for number, frame in enumerate(make_frames(6))
    ]
    for number in without:
        frames[number] = dataclasses.replace(frames[number], depth=None)
    boxes = [Box(number + 1, 2, 3, 4) for number in range(5)]
    with BagWriter(tmp_path / 'a.mcap') as writer:
        for number, frame in enumerate(frames):
            writer.write_frame(frame)
            if number < len(boxes):
                writer.write_truth(frame, boxes[number])
            writer.write_track(frame, SEEN)
    with AnyReader([tmp_path / 'a.mcap']) as bag:
        logged = [t for c, t, _ in bag.messages() if c.topic.endswith('image_color_rect')]
    assert logged == [0, step, 2 * step, 2 * step + 1, 3 * step + 1, 4 * step + 1]
    with open_recording(tmp_path / 'a.mcap') as recording:
        assert_same_frames(list(recording.frames()), frames)
        assert recording.groundtruth == boxes


def test_choices_are_checked(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match='compression'):
        BagWriter(tmp_path / 'a.mcap', compression='gzip')
    with pytest.raises(ParameterError, match='depth encoding'):
        BagWriter(tmp_path / 'a.mcap', depth_encoding='8UC1')


def test_millimetres() -> None:
    depth = np.array([[np.nan, 0, -1, 0.0004, 0.0006, 1.2344, 65.535, 65.6, np.inf]], np.float32)
    assert millimetres(depth).tolist() == [[0, 0, 0, 0, 1, 1234, 65535, 0, 0]]


# -- drawing and video -------------------------------------------------------------------------


@pytest.mark.parametrize('size', [(1, 1), (3, 2), (64, 48), (1920, 1080)])
@pytest.mark.parametrize(
    'box',
    [None, Box(-5, -5, 20, 20), Box(1e12, 5, 5, 5), Box(-1e9, -1e9, 3e9, 3e9), Box(0, 0, 0.1, 0.1)],
)
def test_drawing_never_fails_and_leaves_the_picture(size: tuple[int, int], box: Any) -> None:
    image = np.full((size[1], size[0], 3), 90, np.uint8)
    image.flags.writeable = False
    track = HIDDEN if box is None else dataclasses.replace(SEEN, box=box)
    out = draw_track(image, track, truth=box, caption='frame 5')
    assert out.shape == image.shape
    assert out.flags.writeable
    assert np.all(image == 90)


def test_box_is_drawn_where_it_is() -> None:
    image = np.zeros((480, 640, 3), np.uint8)
    out = draw_track(image, Track(Box(100, 200, 50, 60), TrackState.TRACKING, 1.0))
    rows, columns = np.nonzero(out[100:].any(axis=2))
    assert abs(columns.min() - 100) <= 3
    assert abs(columns.max() - 149) <= 3
    assert abs(rows.min() + 100 - 200) <= 3
    assert abs(rows.max() + 100 - 259) <= 3


def frames_of(path: Path) -> list[Any]:
    video = cv2.VideoCapture(str(path))
    frames = []
    while True:
        good, image = video.read()
        if not good:
            return frames
        frames.append(image)


def streams_of(path: Path) -> str:
    import imageio_ffmpeg

    program = imageio_ffmpeg.get_ffmpeg_exe()
    return subprocess.run(
        [program, '-hide_banner', '-i', str(path)], capture_output=True, text=True, check=False
    ).stderr


def test_video_is_h264_that_plays_everywhere(tmp_path: Path) -> None:
    """Odd sides, a size that changes, and a rate of its own."""
    path = tmp_path / 'a.mp4'
    with VideoWriter(path, 5) as writer:
        for number in range(10):
            shape = (481, 641, 3) if number < 7 else (240, 640, 3)
            writer.write(np.full(shape, 20 * number, np.uint8))
    frames = frames_of(path)
    assert len(frames) == 10
    assert frames[0].shape == (482, 642, 3)
    assert abs(int(frames[5][200, 200, 0]) - 100) < 8
    assert abs(int(frames[9][240, 200, 0]) - 180) < 8
    assert int(frames[9][5, 200, 0]) < 8
    text = streams_of(path)
    assert 'h264' in text
    assert 'yuv420p' in text
    assert '5 fps' in text


def test_video_without_a_picture_leaves_no_file(tmp_path: Path) -> None:
    with VideoWriter(tmp_path / 'a.mp4'):
        pass
    assert list(tmp_path.iterdir()) == []


def test_video_of_an_unknown_kind_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r'a\.xyz must end in \.mp4'):
        VideoWriter(tmp_path / 'a.xyz')
    assert list(tmp_path.iterdir()) == []


def test_video_without_ffmpeg_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, 'imageio_ffmpeg', None)
    monkeypatch.setenv('PATH', str(tmp_path))
    with pytest.raises(MissingExtraError, match=r'rgbd_kcf_tracker\[video\].*apt install ffmpeg'):
        VideoWriter(tmp_path / 'a.mp4')
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_of_which_ffmpeg_says_nothing_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / 'ffmpeg'
    program.write_text(f'#!/bin/sh\nexit {256 - errno.ENOSPC}\n')
    program.chmod(0o755)
    monkeypatch.setattr(video, '_ffmpeg', lambda _: os.fspath(program))
    writer = VideoWriter(tmp_path / 'a.mp4')
    with pytest.raises(RecordingError, match=r'a\.mp4 cannot be written: .*No space left'), writer:
        writer.write(np.zeros((48, 64, 3), np.uint8))


@pytest.mark.parametrize('size', [(320, 240), (640, 360), (640, 480)])
def test_the_box_keeps_its_colour_in_small_videos(size: tuple[int, int], tmp_path: Path) -> None:
    """H.264 keeps one colour for four pixels: a line must be wider than that, or it turns grey."""
    rng = np.random.default_rng(5)
    color = cv2.resize(rng.integers(0, 256, (12, 16, 3)).astype(np.uint8), size)
    frame = Frame(color, None, 0)
    box = Box(size[0] // 4, size[1] // 4, size[0] // 2, size[1] // 2)
    with VideoWriter(tmp_path / 'a.mp4') as writer:
        for _ in range(10):
            writer.write_track(
                frame, Track(box, TrackState.TRACKING, 0.9), Box(*box.as_tuple()).moved(7, 7)
            )
    shown = frames_of(tmp_path / 'a.mp4')[5]
    factor = shown.shape[1] // size[0]
    row = shown[round(box.y * factor + box.height * factor / 2), :, :].astype(int)
    line = row[round(box.x * factor) - 4 : round(box.x * factor) + 4]
    green = [p[1] - max(p[0], p[2]) for p in line]
    assert sum(value > 80 for value in green) >= 2, line


@pytest.mark.parametrize('shape', [(40, 1), (1, 1700)])
def test_pictures_of_any_shape_become_a_video(shape: tuple[int, int], tmp_path: Path) -> None:
    """One pixel wide, it was enlarged to more rows than H.264 has."""
    frame = Frame(np.zeros((*shape, 3), np.uint8), None, 0)
    with VideoWriter(tmp_path / 'a.mp4') as writer:
        for _ in range(3):
            writer.write_track(frame, Track(Box(0, 0, 1, 1), TrackState.TRACKING, 0.9), None)
    assert len(frames_of(tmp_path / 'a.mp4')) == 3


WRITE_VIDEO = """
import sys
import numpy as np
from rgbd_kcf_tracker.recordings import VideoWriter
with VideoWriter(sys.argv[1]) as writer:
    for number in range(10**9):
        writer.write(np.full((48, 64, 3), number % 250, np.uint8))
        if number == 60:
            print(number, flush=True)
"""


def test_video_is_whole_after_kill_9(tmp_path: Path) -> None:
    path = tmp_path / 'a.mp4'
    process = subprocess.Popen(
        [sys.executable, '-c', WRITE_VIDEO, str(path)],
        stdout=subprocess.PIPE,
        env=os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)},
    )
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGKILL)
    process.wait()
    # ffmpeg, which goes on by itself, holds standard output no longer than it needs to finish.
    for _ in range(200):
        if 'Video:' in streams_of(path):
            break
        time.sleep(0.05)
    assert len(frames_of(path)) > 0
