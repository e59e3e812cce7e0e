# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The replay node, alone and with the tracker node, as separate processes over DDS."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

import rclpy
import replay_rig as rig
from bag_rig import (
    COLOR,
    DEPTH,
    INFO,
    ROS2,
    START_NS,
    Sent,
    camera_messages,
    make_frames,
    write_rosbag2,
)
from geometry_msgs.msg import PolygonStamped
from rclpy.node import Node

from rgbd_kcf_tracker import create_tracker
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.live.replay_settings import ReplayParameters
from rgbd_kcf_tracker.live.replay_source import ReplaySource
from rgbd_kcf_tracker.recordings import SequenceWriter, open_recording
from rgbd_kcf_tracker.recordings.images import decode_depth
from rgbd_kcf_tracker.recordings.messages import box_from_polygon
from rgbd_kcf_tracker.ros import replay_main
from rgbd_kcf_tracker.ros.messages import stamp_to_ns
from rgbd_kcf_tracker.ros.replay_node import check_report
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS

pytestmark = [pytest.mark.ros, pytest.mark.timeout(240)]


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rig.write_bag(tmp_path_factory.mktemp('replay') / 'walk.mcap')


def refusal(folder: Path, said: pytest.CaptureFixture[str], **parameters: object) -> str:
    """What a replay says that begins nothing, in this process: to start one takes seconds."""
    assert replay_main.main(rig.told('replay_main', folder, parameters)) == 2
    output = said.readouterr().err
    assert 'Traceback' not in output
    return output


@pytest.mark.parametrize('variant', sorted({'kcf', DEFAULT_VARIANT} & set(VARIANTS)))
def test_lockstep_gives_the_boxes_of_the_engine(bag: Path, tmp_path: Path, variant: str) -> None:
    """One box message for each pair, with the image's header, bit for bit the engine's box."""
    report = tmp_path / 'report.json'
    with (
        rig.Listener() as heard,
        rig.running_tracker(
            tmp_path, variant=variant, init_box=rig.box_text(rig.first_box()), queue_policy='all'
        ),
    ):
        heard.await_tracker()
        status, output = rig.run_replay(tmp_path, bag=str(bag), lockstep=True, report=str(report))
        assert status == 0, output
    figures = json.loads(report.read_text())
    count = len(rig.frames())
    assert figures['pairs'] == figures['answers'] == count
    assert figures['unanswered'] == figures['sent_again'] == 0

    with open_recording(bag) as recording:
        recorded = list(recording.frames())
    tracker = create_tracker(variant)
    tracks = [tracker.start(recorded[0], rig.first_box())]
    tracks += [tracker.update(frame) for frame in recorded[1:]]
    assert [stamp_to_ns(m.header.stamp) for m in heard.boxes] == [f.stamp_ns for f in recorded]
    assert {m.header.frame_id for m in heard.boxes} == {'camera_optical_frame'}
    for message, track in zip(heard.boxes, tracks, strict=True):
        corners = [(p.x, p.y) for p in message.polygon.points]
        if track.box is None:
            assert corners == []
            continue
        box = track.box
        expected = np.float32([(box.x, box.y), (box.right, box.y),
                               (box.right, box.bottom), (box.x, box.bottom)])  # fmt: skip
        np.testing.assert_array_equal(np.float32(corners), expected)


def test_at_camera_rate_with_a_live_tracker(bag: Path, tmp_path: Path) -> None:
    """30 Hz, nothing held back: the tracker keeps up."""
    report = tmp_path / 'report.json'
    with (
        rig.Listener() as heard,
        rig.running_tracker(
            tmp_path, variant='kcf', init_box=rig.box_text(rig.first_box()), queue_policy='all'
        ),
    ):
        heard.await_tracker()
        status, output = rig.run_replay(tmp_path, bag=str(bag), report=str(report))
        assert status == 0, output
        heard.await_each(len(rig.frames()), heard.boxes)
    figures = json.loads(report.read_text())
    count = len(rig.frames())
    assert figures['color_images'] == figures['depth_images'] == count
    assert figures['answers'] == len(heard.boxes) == count
    assert figures['seconds'] > (count - 1) / 30 * 0.95
    assert 0 < figures['latency_ms']['median'] < 1000
    boxes = [box_from_polygon(m.polygon.points) for m in heard.boxes]
    assert boxes[0] is not None
    assert boxes[0].iou(rig.first_box()) > 0.99


def test_pixels_and_stamps_arrive_as_recorded(bag: Path, tmp_path: Path) -> None:
    with rig.Listener(images=True, clock=True) as heard:
        status, output = rig.run_replay(tmp_path, bag=str(bag), rate=3.0)
        assert status == 0, output
        heard.await_each(len(rig.frames()), heard.colors, heard.depths, heard.infos)
    wanted = rig.frames()
    assert len(heard.colors) == len(heard.depths) == len(heard.infos) == len(wanted)
    assert len(heard.clock) > len(wanted)
    assert heard.clock == sorted(heard.clock)
    assert wanted[0].frame.stamp_ns <= heard.clock[0]
    assert heard.clock[-1] <= wanted[-1].frame.stamp_ns
    for made, color, depth, info in zip(
        wanted, heard.colors, heard.depths, heard.infos, strict=True
    ):
        assert stamp_to_ns(color.header.stamp) == stamp_to_ns(depth.header.stamp)
        assert stamp_to_ns(color.header.stamp) == made.frame.stamp_ns
        assert bytes(color.data) == made.frame.color.tobytes()
        assert info.k[0] == made.frame.intrinsics.fx
        np.testing.assert_allclose(
            np.nan_to_num(decode_depth(depth)), np.nan_to_num(made.frame.depth), atol=6e-4
        )


def test_start_topics_and_loop(bag: Path, tmp_path: Path) -> None:
    """From the middle, colour alone, round and round with the recorded stamps, until SIGTERM."""
    with rig.Listener(images=True) as heard:
        process = rig.start(
            'replay_main', folder=tmp_path, bag=str(bag), start=1.0, loop=True, rate=4.0,
            topics='/color/image', lockstep=False,
        )  # fmt: skip
        try:
            end = time.monotonic() + 30
            while len(heard.colors) < 40 and time.monotonic() < end:
                time.sleep(0.02)
            process.send_signal(signal.SIGTERM)
            began = time.monotonic()
            output, _ = process.communicate(timeout=10)
            assert time.monotonic() - began < 3.0
        finally:
            process.kill()
    assert process.returncode == 0, output
    assert 'Traceback' not in output
    stamps = [stamp_to_ns(m.header.stamp) for m in heard.colors]
    second = [f.frame.stamp_ns for f in rig.frames() if
              f.frame.stamp_ns - rig.frames()[0].frame.stamp_ns >= 1_000_000_000]  # fmt: skip
    assert stamps[: len(second)] == second
    assert stamps[len(second) : 2 * len(second)] == second
    assert not heard.depths


def test_remapping_moves_the_topics(bag: Path, tmp_path: Path) -> None:
    import subprocess
    import sys

    with rig.Listener(images=True) as heard:
        moved = tmp_path / 'moved.mcap'
        with rig.BagWriter(moved) as writer:  # kinect2_bridge's names
            for made in rig.frames()[:5]:
                writer.write_frame(made.frame)
        subprocess.run(
            [sys.executable, '-m', 'rgbd_kcf_tracker.ros.replay_main', '--ros-args',
             '-p', f'bag:={moved}', '-r', '/kinect2/qhd/image_color_rect:=/color/image',
             '-r', '/kinect2/qhd/image_depth_rect:=/depth/image'],
            check=True, timeout=60,
        )  # fmt: skip
        heard.await_each(5, heard.colors, heard.depths)
    assert len(heard.colors) == len(heard.depths) == 5
    assert heard.colors[0].header.frame_id == 'kinect2_rgb_optical_frame'


def test_a_sequence_folder_is_replayed_like_a_bag(tmp_path: Path) -> None:
    folder = tmp_path / 'sequence'
    with SequenceWriter(folder) as writer:
        for made in rig.frames()[:10]:
            writer.write(made.frame, made.visible, made.body)
    with pytest.raises(RgbdKcfError, match='ends before start, 60 s: it lasts'):
        ReplaySource(folder, ReplayParameters(start=60.0))
    with (
        rig.Listener() as heard,
        rig.running_tracker(
            tmp_path, variant='kcf', init_box=rig.box_text(rig.first_box()), queue_policy='all'
        ),
    ):
        heard.await_tracker()
        status, output = rig.run_replay(tmp_path, bag=str(folder), lockstep=True)
        assert status == 0, output
    assert '10 colour and 10 depth images; 10 of 10 answered' in output
    assert [stamp_to_ns(m.header.stamp) for m in heard.boxes] == [
        made.frame.stamp_ns for made in rig.frames()[:10]
    ]


def test_a_ros1_bag_is_replayed(shared_data: Path, tmp_path: Path) -> None:
    path = sorted((shared_data / 'bags').rglob('*.bag'))[0]
    with open_recording(path) as recording:
        count = len(recording)
        size = next(recording.frames()).color.shape
    with rig.running_tracker(
        tmp_path, queue_policy='all', variant='kcf', init_box='100,100,60,80'
    ), rig.Listener() as heard:  # fmt: skip
        status, output = rig.run_replay(tmp_path, bag=str(path), rate=0.0, wait_for_subscribers=0.5)
    assert status == 0, output
    assert f'{count} colour and {count} depth images' in output
    assert size[2] == 3
    assert heard.boxes == []  # the tracker listens to other names


def test_who_is_stopped_while_he_waits_has_sent_nothing(bag: Path, tmp_path: Path) -> None:
    process = rig.start('replay_main', folder=tmp_path, bag=str(bag), wait_for_subscribers=60.0)
    said = ''
    assert process.stdout is not None
    while 'waiting for a subscriber' not in said:
        said += process.stdout.readline()
    process.send_signal(signal.SIGINT)
    said += process.communicate(timeout=30)[0]
    assert process.returncode == 0
    assert 'stopped before anything was sent' in said
    assert 'replaying' not in said


def test_lockstep_without_a_tracker_says_what_is_missing(bag: Path, tmp_path: Path) -> None:
    status, output = rig.run_replay(tmp_path, bag=str(bag), lockstep=True, wait_for_subscribers=0.5)
    assert status == 2
    assert 'nobody subscribes to /color/image, /depth/image' in output
    assert '/tracker/box' in output


@pytest.mark.parametrize('lockstep', [True, False])
def test_trackers_of_another_name_are_pointed_out(
    bag: Path, tmp_path: Path, lockstep: bool
) -> None:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(os.environ['ROS_DOMAIN_ID']))
    node = Node('watcher', namespace='/left', context=context)
    node.create_publisher(PolygonStamped, '~/box', 10)
    try:
        status, output = rig.run_replay(
            tmp_path, bag=str(bag), rate=0.0, lockstep=lockstep, wait_for_subscribers=5.0
        )
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)
    assert status == (2 if lockstep else 0)
    assert 'set answer_topic, for there is /left/watcher/box' in output


@pytest.mark.parametrize(
    ('parameters', 'words'),
    [
        ({}, 'set the parameter bag'),
        ({'bag': 'no/such/file.mcap'}, 'no/such/file.mcap does not exist'),
        ({'rate': -1.0}, 'parameter rate is -1.0'),
        ({'rate': 'fast'}, "parameter rate is 'fast': it must be a number"),
        ({'speed': 1.0}, "unknown parameter 'speed'"),
        ({'bag': 'BAG', 'topics': '/nothing'}, 'has no topic /nothing'),
        ({'bag': 'BAG', 'topics': ['/color/image', '/nothing']}, 'has no topic /nothing.'),
        ({'bag': 'BAG', 'color_topic': '/nope'}, 'another as the parameter color_topic:=TOPIC'),
        ({'bag': 'BAG', 'color_topic': '/depth/image'}, '/depth/image cannot be both colour and'),
        ({'bag': 'BAG', 'info_topic': '/nope'}, 'give another as the parameter info_topic:=TOPIC'),
        ({'bag': 'BAG', 'start': 1e6, 'wait_for_subscribers': 1e3}, 'ends before start, 1e+06 s'),
    ],
)
@pytest.mark.usefixtures('_process')
def test_mistakes_are_named(
    bag: Path,
    tmp_path: Path,
    parameters: dict[str, object],
    words: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    given = {k: str(bag) if v == 'BAG' else v for k, v in parameters.items()}
    assert words in refusal(tmp_path, capfd, **(given or {'rate': 1.0}))


def test_a_report_never_replaces_the_recording_and_nothing_else_unasked(
    bag: Path, tmp_path: Path
) -> None:
    source = shutil.copy(bag, tmp_path / 'walk.mcap')
    (tmp_path / 'seq' / 'rgb').mkdir(parents=True)
    (tmp_path / 'seq' / 'groundtruth.txt').write_text('years of work')
    (tmp_path / 'way.json').symlink_to(source)
    (tmp_path / 'old.json').write_text('years of work')
    for recording, name, overwrite, words in (
        (source, 'walk.mcap', True, 'is the source itself'),
        (source, 'way.json', True, 'is the source itself'),
        (tmp_path / 'seq', 'seq/groundtruth.txt', True, 'is the source itself'),
        (tmp_path / 'seq', 'seq/new.json', False, 'lies inside the source'),
        (source, 'old.json', False, 'set overwrite to replace it'),
        (source, 'none/new.json', False, 'make it first'),
    ):
        with pytest.raises(RgbdKcfError, match=words):
            check_report(str(tmp_path / name), str(recording), overwrite)
    status, output = rig.run_replay(
        tmp_path, bag=str(source), report=str(source), overwrite=True, rate=0.0
    )
    assert status == 2, output
    assert 'is the source itself' in output
    assert source.read_bytes() == bag.read_bytes()
    for path in (tmp_path / 'seq' / 'groundtruth.txt', tmp_path / 'old.json'):
        assert path.read_text() == 'years of work'
    status, output = rig.run_replay(
        tmp_path, bag=str(source), report=str(tmp_path / 'old.json'), overwrite=True, rate=0.0,
        wait_for_subscribers=0.0,
    )  # fmt: skip
    assert status == 0, output
    assert json.loads((tmp_path / 'old.json').read_text())['color_images'] == len(rig.frames())


@pytest.mark.usefixtures('_process')
def test_bad_bags(bag: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Cut off, empty, no bag at all: what is whole goes out, the rest is said in words."""
    whole = bag.read_bytes()
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(whole[: len(whole) * 6 // 10])
    with rig.Listener(images=True) as heard:
        status, output = rig.run_replay(tmp_path, bag=str(cut), rate=0.0)
        heard.await_each(21, heard.colors)
    assert status == 0, output
    assert 'cut off' in output
    assert 20 < len(heard.colors) < len(rig.frames())
    for name, content, words in (
        ('empty.mcap', b'', 'is empty'),
        ('text.mcap', b'no bag at all', 'is no recording'),
        ('head.mcap', whole[:8], 'holds no messages'),
    ):
        path = tmp_path / name
        path.write_bytes(content)
        assert words in refusal(tmp_path, capfd, bag=str(path), wait_for_subscribers=0.0)


def test_from_the_middle_what_was_said_once_is_said_first(tmp_path: Path) -> None:
    """A tracker would know neither its camera nor where that is."""
    images = camera_messages(make_frames(6))
    (_, *after), middle = [s for s in images if s.topic == INFO], images[9].log_ns
    still = ROS2.types['tf2_msgs/msg/TFMessage']
    sent = [
        *(Sent('/tf_static', START_NS + at, still(transforms=[])) for at in (0, 1)),
        *(s for s in images if s not in after),
    ]
    path = write_rosbag2(tmp_path / 'bag', sent)
    with ReplaySource(path, ReplayParameters()) as source:
        start = (middle - START_NS) * 1e-9
        played = list(source.messages(start))
        assert [m.topic for m in played[:5]] == ['/tf_static'] * 2 + [INFO, COLOR, DEPTH]
        assert {m.time_ns for m in played[:4]} == {played[3].time_ns}
        assert len(list(source.messages())) == len(sent)


@pytest.mark.parametrize('compression', ['lz4', 'zstd'])
def test_compressed_chunks(tmp_path: Path, compression: str) -> None:
    path = rig.write_bag(tmp_path / 'packed.mcap', compression=compression)
    with rig.Listener(images=True) as heard:
        status, output = rig.run_replay(tmp_path, bag=str(path), rate=3.0)
        heard.await_each(len(rig.frames()), heard.colors)
    assert status == 0, output
    assert [bytes(m.data) for m in heard.colors] == [
        made.frame.color.tobytes() for made in rig.frames()
    ]


@pytest.mark.parametrize('policy', ['newest', 'all'])
def test_lockstep_goes_on_where_depth_is_late(tmp_path: Path, policy: str) -> None:
    """By 0.9 s: nothing is lost where the tracker takes all, and nothing is stuck where not."""
    path, report = tmp_path / 'late.mcap', tmp_path / 'report.json'
    with rig.BagWriter(path, rig.GENERIC) as bag:
        write = bag._writer.write
        written: list[tuple[int, str, object]] = []

        def keep(topic: str, message: object, at: int) -> None:
            late = 900_000_000 if topic == rig.GENERIC.depth else 0
            written.append((at + late, topic, message))

        bag._writer.write = keep
        for made in rig.frames():
            bag.write_frame(made.frame)
        for at, topic, message in sorted(written, key=lambda m: m[0]):
            write(topic, message, at)
    with (
        rig.Listener() as heard,
        rig.running_tracker(
            tmp_path, variant='kcf', init_box=rig.box_text(rig.first_box()), queue_policy=policy
        ),
    ):
        heard.await_tracker()
        status, output = rig.run_replay(tmp_path, bag=str(path), lockstep=True, report=str(report))
    assert status == 0, output
    figures, count = json.loads(report.read_text()), len(rig.frames())
    assert figures['pairs'] == figures['answers'] + figures['unanswered'] == count
    assert figures['sent_again'] == 0
    assert figures['seconds'] < 15
    assert figures['unanswered'] == 0 or policy == 'newest'


def test_lockstep_over_streams_of_different_rates(tmp_path: Path) -> None:
    """Depth with every third colour image, and colour at an odd offset: every image is answered."""
    path = tmp_path / 'rates.mcap'
    with rig.BagWriter(path, rig.GENERIC) as bag:
        for number, made in enumerate(rig.frames()[:30]):
            frame = made.frame
            if number % 3:
                frame = replace(frame, depth=None)
            bag.write_frame(frame)
    report = tmp_path / 'report.json'
    with (
        rig.Listener() as heard,
        rig.running_tracker(
            tmp_path, variant='kcf', init_box=rig.box_text(rig.first_box()), queue_policy='all'
        ),
    ):
        heard.await_tracker()
        status, output = rig.run_replay(tmp_path, bag=str(path), lockstep=True, report=str(report))
    assert status == 0, output
    figures = json.loads(report.read_text())
    assert (figures['color_images'], figures['depth_images']) == (30, 10)
    assert figures['pairs'] == figures['answers'] == 30
    assert figures['sent_again'] == 0
    assert [stamp_to_ns(m.header.stamp) for m in heard.boxes] == [
        made.frame.stamp_ns for made in rig.frames()[:30]
    ]
