# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Bags of every format: whole, compressed, without index, cut off, killed, empty, and no bags."""

from __future__ import annotations

import bz2
import dataclasses
import os
import re
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import time
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_rig import (
    CAMERA,
    COLOR,
    DEPTH,
    INFO,
    ROS2,
    SIZE,
    START_NS,
    STEP_NS,
    Sent,
    assert_same_frames,
    camera_info,
    camera_messages,
    header,
    image,
    make_frames,
    write_mcap,
    write_ros1,
    write_rosbag2,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer as PlainMcapWriter
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from rgbd_kcf_tracker.errors import ImageError, RecordingError, RgbdKcfError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.live.prefetch import prefetched
from rgbd_kcf_tracker.live.replay_settings import ReplayParameters
from rgbd_kcf_tracker.live.replay_source import ReplaySource
from rgbd_kcf_tracker.recordings import (
    BagWriter,
    CameraTopics,
    ReadOptions,
    SequenceWriter,
    open_recording,
)
from rgbd_kcf_tracker.recordings.copying import copy_bag
from rgbd_kcf_tracker.recordings.encoding import (
    encode_bare_depth,
    encode_color,
    encode_compressed_color,
    encode_compressed_depth,
    encode_depth,
)
from rgbd_kcf_tracker.recordings.mcap_writer import McapWriter, definition_text
from rgbd_kcf_tracker.recordings.rawbag import RawBag
from rgbd_kcf_tracker.recordings.storage import Definition

FRAMES = make_frames()


def read(path: Path, options: ReadOptions | None = None) -> tuple[list[Frame], list[str]]:
    with open_recording(path, options) as recording:
        frames = list(recording.frames())
        assert len(frames) == len(recording)
        return frames, recording.warnings


def without_metadata(folder: Path) -> Path:
    (folder / 'metadata.yaml').unlink()
    return folder


def sequence_folder(folder: Path, frames: list[Frame]) -> Path:
    with SequenceWriter(folder) as writer:
        for frame in frames:
            writer.write(frame, Box(1, 2, 3, 4))
    return folder


WRITERS: dict[str, Any] = {
    'mcap': lambda p, s: write_mcap(p / 'a.mcap', s),
    'mcap lz4': lambda p, s: write_mcap(p / 'a.mcap', s, 'lz4'),
    'mcap zstd': lambda p, s: write_mcap(p / 'a.mcap', s, 'zstd'),
    'folder mcap': lambda p, s: write_rosbag2(p / 'a', s),
    'folder mcap, no metadata': lambda p, s: without_metadata(write_rosbag2(p / 'a', s)),
    'folder mcap, messages packed': lambda p, s: write_rosbag2(p / 'a', s, compression='MESSAGE'),
    'folder mcap, file packed': lambda p, s: write_rosbag2(p / 'a', s, compression='FILE'),
    'file in a folder': lambda p, s: next(write_rosbag2(p / 'a', s).glob('*.mcap')),
    'folder sqlite3': lambda p, s: write_rosbag2(p / 'a', s, 'SQLITE3'),
    'folder sqlite3, no metadata': lambda p, s: without_metadata(
        write_rosbag2(p / 'a', s, 'SQLITE3')
    ),
    'folder sqlite3, messages packed': lambda p, s: write_rosbag2(p / 'a', s, 'SQLITE3', 'MESSAGE'),
    'folder sqlite3, file packed': lambda p, s: write_rosbag2(p / 'a', s, 'SQLITE3', 'FILE'),
    'db3': lambda p, s: next(write_rosbag2(p / 'a', s, 'SQLITE3').glob('*.db3')),
    'ROS 1': lambda p, s: write_ros1(p / 'a.bag', s),
    'ROS 1 bz2': lambda p, s: write_ros1(p / 'a.bag', s, 'BZ2'),
    'ROS 1 lz4': lambda p, s: write_ros1(p / 'a.bag', s, 'LZ4'),
}


@pytest.mark.parametrize('kind', WRITERS)
def test_every_format_gives_the_same_frames(kind: str, tmp_path: Path) -> None:
    path = WRITERS[kind](tmp_path, camera_messages(FRAMES))
    frames, warnings = read(path)
    assert_same_frames(frames, FRAMES)
    assert [w for w in warnings if 'no metadata.yaml' not in w] == []
    assert bool(warnings) == ('no metadata' in kind)


@pytest.mark.parametrize('kind', WRITERS)
def test_every_format_is_read_on_in_another_thread(kind: str, tmp_path: Path) -> None:
    """As replay and the page do: no SQLite bag could be replayed, or shown."""
    bag = RawBag(WRITERS[kind](tmp_path, camera_messages(FRAMES)))
    with prefetched(bag.read(topic, index) for topic, index in bag.in_order()) as ahead:
        assert len(list(ahead)) == 3 * len(FRAMES)
    bag.close()


@pytest.mark.parametrize('kind', WRITERS)
def test_every_format_converts_to_an_mcap_that_others_read(kind: str, tmp_path: Path) -> None:
    sent = camera_messages(FRAMES)
    bag = RawBag(WRITERS[kind](tmp_path, sent))
    count, warnings = copy_bag(bag, tmp_path / 'out.mcap', compression='zstd')
    bag.close()
    assert (count, warnings) == (len(sent), [])
    assert_same_frames(read(tmp_path / 'out.mcap')[0], FRAMES)
    with (tmp_path / 'out.mcap').open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        messages = [(c.topic, m.log_time) for _, c, m in reader.iter_messages()]
    assert messages == [(s.topic, s.log_ns) for s in sent]


def test_part_of_a_recording(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / 'a.mcap', camera_messages(FRAMES))
    with open_recording(path) as recording:
        assert_same_frames(list(recording.frames(2, 4)), FRAMES[2:4])
        assert_same_frames(list(recording.frames(4, 99)), FRAMES[4:])
        assert list(recording.frames(3, 3)) == []


def test_a_bag_in_several_files_is_one(tmp_path: Path) -> None:
    sent = camera_messages(FRAMES)
    (tmp_path / 'a').mkdir()
    # Ten comes after nine, whatever the order of letters.
    write_mcap(tmp_path / 'a' / 'a_9.mcap', sent[:7])
    write_mcap(tmp_path / 'a' / 'a_10.mcap', sent[7:])
    assert_same_frames(read(tmp_path / 'a')[0], FRAMES)


def test_types_that_ros_2_lacks_or_changed_come_along_from_ros_1(tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    text = 'Header header\nstring name\nfloat64[] values\ntime due\nmy_msgs/Part[] parts\n'
    store.register(get_types_from_msg(text, 'my_msgs/msg/Thing'))
    store.register(get_types_from_msg('uint8 KIND=3\nbool good\nduration age', 'my_msgs/msg/Part'))
    # The name that tf had before tf2.
    text = 'geometry_msgs/TransformStamped[] transforms'
    store.register(get_types_from_msg(text, 'tf/msg/tfMessage'))
    t = store.types
    when = t['builtin_interfaces/msg/Time'](5, 6)
    head = t['std_msgs/msg/Header'](1, when, 'here')
    part = t['my_msgs/msg/Part'](True, t['builtin_interfaces/msg/Duration'](7, 8))
    thing = t['my_msgs/msg/Thing'](head, 'thing', np.array([1.5, 2.5]), when, [part])
    place = t['geometry_msgs/msg/Transform'](
        t['geometry_msgs/msg/Vector3'](1, 2, 3), t['geometry_msgs/msg/Quaternion'](0, 0, 0, 1)
    )
    tf = t['tf/msg/tfMessage']([t['geometry_msgs/msg/TransformStamped'](head, 'b', place)])
    empty = t['std_msgs/msg/ColorRGBA'](0, 0, 0, 1)
    pose = t['geometry_msgs/msg/Pose'](t['geometry_msgs/msg/Point'](1, 2, 3), place.rotation)
    age = t['builtin_interfaces/msg/Duration'](1, 2)
    marker = t['visualization_msgs/msg/Marker'](
        head, 'ns', 4, 1, 0, pose, place.translation, empty, age, False, [], [], 'words', '', False
    )
    with Ros1Writer(tmp_path / 'a.bag') as writer:
        for number, message in enumerate((thing, tf, marker)):
            kind = message.__msgtype__
            connection = writer.add_connection(f'/t{number}', kind, typestore=store)
            writer.write(connection, number, store.serialize_ros1(message, kind))
    bag = RawBag(tmp_path / 'a.bag')
    assert copy_bag(bag, tmp_path / 'a.mcap') == (3, [])
    bag.close()
    with AnyReader([tmp_path / 'a.mcap']) as reader:
        copied = [(c.topic, c.msgtype, raw) for c, _, raw in reader.messages()]
        found = [reader.deserialize(raw, kind) for _, kind, raw in copied]
    with ReplaySource(tmp_path / 'a.bag', ReplayParameters()) as source:
        kinds = {topic.name: topic.type for topic in source.topics}
        assert [(m.topic, kinds[m.topic], m.data) for m in source.messages()] == copied
    assert found[0].name == 'thing'
    assert list(found[0].values) == [1.5, 2.5]
    assert (found[0].header.frame_id, found[0].due.sec, found[0].due.nanosec) == ('here', 5, 6)
    assert (found[0].parts[0].good, found[0].parts[0].age.sec) == (True, 7)
    assert found[1].transforms[0].transform.translation.z == 3
    assert (found[2].text, found[2].pose.position.y, found[2].texture_resource) == ('words', 2, '')


@pytest.mark.parametrize('policy', ['transient_local', '1'])
@pytest.mark.parametrize('kind', ['mcap', 'sqlite3'])
def test_convert_keeps_the_qos_of_topics(kind: str, policy: str, tmp_path: Path) -> None:
    """Without it, a replayed /tf_static no longer reaches those who come late."""
    qos = f'- history: 1\n  depth: 1\n  durability: {policy}\n'
    if kind == 'mcap':
        path = tmp_path / 'a.mcap'
        with McapWriter(path) as writer:
            for s in camera_messages(FRAMES):
                data = ROS2.serialize_cdr(s.message, s.type)
                writer.write_raw(
                    s.topic, s.type, data, s.log_ns, qos=qos if s.topic == INFO else ''
                )
    else:
        path = WRITERS['db3'](tmp_path, camera_messages(FRAMES))
        with closing(sqlite3.connect(path)) as opened:
            opened.execute('UPDATE topics SET offered_qos_profiles = ? WHERE name = ?', (qos, INFO))
            opened.commit()
    bag = RawBag(path)
    copy_bag(bag, tmp_path / 'out.mcap')
    bag.close()
    with (tmp_path / 'out.mcap').open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    found = {c.topic: c.metadata['offered_qos_profiles'] for c in summary.channels.values()}
    assert found.pop(INFO) == '- history: 1\n  depth: 1\n  durability: transient_local\n'
    assert set(found.values()) <= {'', '[]'}


def test_messages_of_a_second_type_of_a_topic_are_told(tmp_path: Path) -> None:
    sent = camera_messages(FRAMES)
    (tmp_path / 'a').mkdir()
    write_mcap(tmp_path / 'a' / 'a_0.mcap', sent)
    infos = [dataclasses.replace(s, topic=COLOR) for s in sent if s.topic == INFO]
    write_mcap(tmp_path / 'a' / 'a_1.mcap', infos)
    bag = RawBag(tmp_path / 'a')
    bag.close()
    assert len(bag.topics[COLOR]) == 6
    (warning,) = (w for w in bag.warnings if 'left out' in w)
    assert f'6 messages of {COLOR} are left out' in warning


# -- encodings through a bag -------------------------------------------------------------------


@pytest.mark.parametrize('bag', ['mcap', 'ROS 1'])
@pytest.mark.parametrize(
    'depth',
    ['16UC1', '32FC1', 'bigendian', 'compressedDepth png', 'compressedDepth rvl', 'png', 'tiff'],
)
@pytest.mark.parametrize('color', ['rgb8', 'bgra8', 'png'])
def test_encodings_through_a_bag(color: str, depth: str, bag: str, tmp_path: Path) -> None:
    sent = []
    for f in FRAMES[:2]:
        assert f.depth is not None
        if color == 'png':
            packed: Any = encode_compressed_color(f.color, 'png')
            sent.append(Sent(COLOR + '/compressed', f.stamp_ns, image(f.stamp_ns, packed)))
        else:
            packed = encode_color(f.color, color, padding=4)
            sent.append(Sent(COLOR, f.stamp_ns, image(f.stamp_ns, packed)))
        topic = DEPTH
        if depth in ('16UC1', '32FC1'):
            packed = encode_depth(f.depth, depth, padding=8)
        elif depth == 'bigendian':
            packed = encode_depth(f.depth, bigendian=True)
        elif depth in ('png', 'tiff'):
            packed, topic = encode_bare_depth(f.depth, depth), DEPTH + '/compressed'
        else:
            packed = encode_compressed_depth(f.depth, codec=depth.split()[1])
            topic = DEPTH + '/compressedDepth'
        sent.append(Sent(topic, f.stamp_ns, image(f.stamp_ns, packed)))
    frames, _ = read(WRITERS[bag](tmp_path, sent))
    assert_same_frames(frames, [dataclasses.replace(f, intrinsics=None) for f in FRAMES[:2]])


def test_unknown_encoding_names_topic_and_encoding(tmp_path: Path) -> None:
    sent = camera_messages(FRAMES)
    for s in sent:
        if s.topic == COLOR:
            s.message.encoding = 'bayer_grbg8'
    path = write_mcap(tmp_path / 'a.mcap', sent)
    with pytest.raises(ImageError, match=f'frame 0 of {COLOR}.*bayer_grbg8.*readable are bgr8'):
        read(path)
    sent = camera_messages(FRAMES)
    for s in sent:
        if s.topic == DEPTH:
            s.message.encoding = '16SC1'
    path = write_mcap(tmp_path / 'b.mcap', sent)
    with pytest.raises(ImageError, match=f'frame 0 of {DEPTH}.*16SC1.*readable are 16UC1'):
        read(path)


def test_depth_of_another_size_says_what_to_do(tmp_path: Path) -> None:
    frames = make_frames(2)
    small = make_frames(2, (32, 24))
    sent = camera_messages(frames, depth=None) + camera_messages(small, color='/x')
    sent = [s for s in sent if s.topic != '/x']
    path = write_mcap(tmp_path / 'a.mcap', sent)
    with pytest.raises(ImageError, match=r'depth is 32x24 but colour is 64x48: register'):
        read(path)


def test_size_may_change_on_the_way(tmp_path: Path) -> None:
    frames = make_frames(6)
    frames[3:] = [
        dataclasses.replace(f, stamp_ns=g.stamp_ns)
        for f, g in zip(make_frames(6, (32, 24))[3:], frames[3:], strict=True)
    ]
    path = write_mcap(tmp_path / 'a.mcap', camera_messages(frames))
    found, warnings = read(path)
    assert_same_frames(found, frames)
    assert any('changes from 64x48 to 32x24 at frame 3' in w for w in warnings)


def test_metres_that_no_camera_measures_are_counted_once(tmp_path: Path) -> None:
    frames = make_frames(3)
    sent = camera_messages(frames, depth=None)
    for number, frame in enumerate(frames):
        assert frame.depth is not None
        metres = frame.depth.copy()
        metres[0, : 4 * number] = 1e20
        raw = image(frame.stamp_ns, encode_depth(metres, '32FC1'))
        sent.append(Sent(DEPTH, frame.stamp_ns, raw))
    found, warnings = read(write_mcap(tmp_path / 'a.mcap', sent))
    assert all(np.isnan(f.depth[0, : 4 * n]).all() for n, f in enumerate(found))
    assert warnings == [
        f'12 numbers in 2 depth images, first in frame 1 of {DEPTH}, are not between 0.001 and '
        '65.535 metres: taken as no reading'
    ]


def test_one_damaged_depth_image_costs_its_depth_only(tmp_path: Path) -> None:
    sent = camera_messages(FRAMES)
    for number in (0, 2):
        damaged = [s for s in sent if s.topic == DEPTH][number]
        damaged.message.data = damaged.message.data[:100]
    frames, warnings = read(write_mcap(tmp_path / 'a.mcap', sent))
    assert [f.depth is None for f in frames] == [True, False, True, False, False, False]
    assert any('frame 2' in w and 'cut off' in w for w in warnings)


def test_one_damaged_message_of_a_bag_with_packed_messages_costs_that_one(tmp_path: Path) -> None:
    folder = write_rosbag2(tmp_path / 'a', camera_messages(FRAMES), 'SQLITE3', 'MESSAGE')
    with closing(sqlite3.connect(next(folder.glob('*.db3')))) as base, base:
        base.execute(
            "UPDATE messages SET data = x'0011223344' WHERE id = (SELECT m.id FROM messages m "
            'JOIN topics t ON m.topic_id = t.id WHERE t.name = ? LIMIT 1 OFFSET 2)', (COLOR,),
        )  # fmt: skip
    with open_recording(folder) as recording:
        frames = recording.frames()
        assert_same_frames([next(frames), next(frames)], FRAMES[:2])
        with pytest.raises(ImageError, match=rf'{folder}: message 2 of {COLOR}: zstd .*convert'):
            next(frames)
    bag = RawBag(folder)
    count, warnings = copy_bag(bag, tmp_path / 'mended.mcap')
    bag.close()
    assert (count, len(warnings)) == (3 * len(FRAMES) - 1, 1)
    assert_same_frames(read(tmp_path / 'mended.mcap')[0], FRAMES[:2] + FRAMES[3:])


def test_convert_is_advised_where_it_mends_alone(tmp_path: Path) -> None:
    """It copies messages of ROS 2 byte by byte, those that are not what they are called too."""
    path = tmp_path / 'a.mcap'
    with McapWriter(path, 'none') as writer:
        for s in camera_messages(FRAMES):
            data = bytes(ROS2.serialize_cdr(s.message, s.type))
            kept = data[:60] if s.topic == COLOR else data
            definition = Definition('ros2msg', definition_text(s.type))
            writer.write_raw(s.topic, s.type, kept, s.log_ns, definition)
    with open_recording(path) as recording, pytest.raises(ImageError, match='is no') as told:
        next(recording.frames())
    assert 'rgbd-kcf convert' not in str(told.value)


def test_a_damaged_colour_image_is_named(tmp_path: Path) -> None:
    sent = camera_messages(FRAMES)
    damaged = [s for s in sent if s.topic == COLOR][2]
    damaged.message.data = damaged.message.data[:100]
    with pytest.raises(ImageError, match=f'frame 2 of {COLOR}.*cut off'):
        read(write_mcap(tmp_path / 'a.mcap', sent))


# -- time --------------------------------------------------------------------------------------


def test_messages_out_of_order_are_put_right(tmp_path: Path) -> None:
    sent = camera_messages(FRAMES)
    order = [1, 0, 4, 2, 3, 5, 8, 7, 6, 11, 9, 10, 12, 17, 13, 14, 16, 15]
    shuffled = [dataclasses.replace(sent[i], log_ns=START_NS + n) for n, i in enumerate(order)]
    frames, warnings = read(write_mcap(tmp_path / 'a.mcap', shuffled))
    assert_same_frames(frames, FRAMES)
    assert warnings == [
        '/camera/depth/image_raw: 1 images were recorded after later ones: put in order'
    ]


def test_each_frame_has_the_camera_that_was_told_last(tmp_path: Path) -> None:
    """As live: the first alone was read, zeros that a driver sends at first for good."""
    frames = [dataclasses.replace(f, intrinsics=None) for f in FRAMES]
    sent = camera_messages(frames, info=None)

    def told(at: int, fx: float) -> Sent:
        stamp = frames[at].stamp_ns
        camera = dataclasses.replace(CAMERA, fx=fx) if fx else CAMERA
        message = camera_info(header(stamp, 'optical'), *SIZE, camera)
        if not fx:
            message.k, message.p = np.zeros(9), np.zeros(12)
        return Sent(INFO, stamp + 1_000_000, message)

    zeros, one, other = (told(0, 0.0), told(1, 0.0)), told(2, 30.0), told(4, 40.0)
    path = write_mcap(tmp_path / 'a.mcap', sorted([*sent, *zeros, one, other], key=_logged))
    with open_recording(path) as recording:
        assert recording.intrinsics is not None
        seen = [f.intrinsics.fx for f in recording.frames() if f.intrinsics is not None]
        again = [f.intrinsics.fx for f in recording.frames(3, 5) if f.intrinsics is not None]
        late, changes = recording.warnings
    assert seen == [30.0] * 4 + [40.0] * (len(frames) - 4)
    assert again == [30.0, 40.0]
    assert late == f'{INFO} holds zeros: the camera is not calibrated: that of message 2 is taken'
    assert changes.startswith(f'{INFO}: the camera changes, at frame 4 from fx=30')


def _logged(message: Sent) -> int:
    return message.log_ns


def test_messages_twice_are_read_once(tmp_path: Path) -> None:
    sent = [s for s in camera_messages(FRAMES) for _ in range(2)]
    frames, warnings = read(write_mcap(tmp_path / 'a.mcap', sent))
    assert_same_frames(frames, FRAMES)
    assert any('12 images have a stamp that was there before' in w for w in warnings)


def test_time_that_jumps_back_starts_afresh(tmp_path: Path) -> None:
    """A bag that looped while it was recorded: the second round comes after the first."""
    frames = [
        dataclasses.replace(f, stamp_ns=START_NS + n * 400_000_000) for n, f in enumerate(FRAMES)
    ]
    once = camera_messages(frames)
    length = once[-1].log_ns - once[0].log_ns + STEP_NS
    again = [dataclasses.replace(s, log_ns=s.log_ns + length) for s in once]
    found, warnings = read(write_mcap(tmp_path / 'a.mcap', once + again))
    assert_same_frames(found, frames + frames)
    assert any('jumps back 1 time' in w for w in warnings)


def test_rates_may_differ(tmp_path: Path) -> None:
    depths = 0
    sent = []
    for s in camera_messages(FRAMES):
        if s.topic == DEPTH:
            depths += 1
            if depths % 2 == 0:
                continue
        sent.append(s)
    frames, warnings = read(write_mcap(tmp_path / 'a.mcap', sent))
    assert [f.depth is not None for f in frames] == [True, False] * 3
    assert any('3 of 6 colour images have no depth' in w for w in warnings)


def test_stamps_that_say_nothing_give_way_to_the_time_of_recording(tmp_path: Path) -> None:
    sent = camera_messages(FRAMES)
    for s in sent:
        s.message.header.stamp.sec = s.message.header.stamp.nanosec = 0
    frames, warnings = read(write_mcap(tmp_path / 'a.mcap', sent))
    assert [f.stamp_ns for f in frames] == [f.stamp_ns + 2_000_000 for f in FRAMES]
    assert all(f.depth is not None for f in frames)
    assert any('the time of recording is taken' in w for w in warnings)


def test_nearest_stamp_within_the_tolerance(tmp_path: Path) -> None:
    sent = camera_messages(FRAMES)
    for s in sent:
        if s.topic == DEPTH:
            s.message.header.stamp.nanosec += 7_000_000
    path = write_mcap(tmp_path / 'a.mcap', sent)
    assert_same_frames(read(path)[0], FRAMES)
    frames, _ = read(path, ReadOptions(tolerance_s=0.005))
    assert all(f.depth is None for f in frames)


def test_slow_shots_are_paired_widely_with_a_warning(tmp_path: Path) -> None:
    sent = camera_messages(FRAMES[:1])
    sent[2].message.header.stamp.nanosec += 200_000_000
    path = write_mcap(tmp_path / 'a.mcap', sent)
    frames, warnings = read(path)
    assert frames[0].depth is not None
    assert any('paired up to 200 ms apart' in w for w in warnings)
    assert read(path, ReadOptions(tolerance_s=0.02))[0][0].depth is None


# -- what is no bag, empty, or damaged ---------------------------------------------------------


@pytest.mark.parametrize('name', ['a.mcap', 'a.bag', 'a.db3', 'a.txt'])
def test_a_file_that_is_no_bag(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b'hello, this is a letter and no recording')
    with pytest.raises(RecordingError, match=f'{name} is no recording'):
        read(tmp_path / name)
    (tmp_path / name).write_bytes(b'')
    with pytest.raises(RecordingError, match=f'{name} is empty'):
        read(tmp_path / name)


def test_what_is_not_there_or_holds_nothing(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match='does not exist'):
        read(tmp_path / 'missing.mcap')
    (tmp_path / 'empty').mkdir()
    with pytest.raises(RecordingError, match='holds neither'):
        read(tmp_path / 'empty')
    (tmp_path / 'several').mkdir()
    for name in ('a.bag', 'b.bag'):
        (tmp_path / 'several' / name).touch()
    with pytest.raises(RecordingError, match='name one of them'):
        read(tmp_path / 'several')


@pytest.mark.parametrize('kind', ['mcap', 'folder sqlite3', 'ROS 1'])
def test_an_empty_bag_lists_what_it_has(kind: str, tmp_path: Path) -> None:
    path = WRITERS[kind](tmp_path, [])
    with pytest.raises(RecordingError, match=r'no colour topic.*no topics at all'):
        read(path)


@pytest.mark.parametrize('kind', ['mcap', 'sqlite3'])
def test_topics_that_are_not_in_cdr_are_listed_as_left_out(kind: str, tmp_path: Path) -> None:
    if kind == 'mcap':
        path = tmp_path / 'web.mcap'
        with path.open('wb') as file:
            writer = PlainMcapWriter(file)
            writer.start(profile='ros2')
            schema = writer.register_schema('sensor_msgs/msg/Image', 'jsonschema', b'{}')
            channel = writer.register_channel(COLOR, 'json', schema)
            writer.add_message(channel, START_NS, b'{}', START_NS)
            writer.finish()
    else:
        path = WRITERS['folder sqlite3'](tmp_path, camera_messages(make_frames(1)))
        (database,) = path.glob('*.db3')
        with closing(sqlite3.connect(database)) as opened:
            opened.execute("UPDATE topics SET serialization_format = 'json'")
            opened.commit()
    with pytest.raises(RecordingError, match=rf"{COLOR} \(in 'json', not in cdr: left out\)"):
        read(path)
    bag = RawBag(path)
    bag.close()
    assert sum("'json'" in w for w in bag.warnings) == (1 if kind == 'mcap' else 3)


@pytest.mark.parametrize(
    'text',
    [
        ': : {{{ not yaml',
        'rosbag2_bagfile_information: {relative_file_paths: 5}',
        'rosbag2_bagfile_information: {relative_file_paths: a.mcap}',
    ],
)
def test_metadata_that_lies_is_left_out(text: str, tmp_path: Path) -> None:
    folder = write_rosbag2(tmp_path / 'a', camera_messages(FRAMES))
    (folder / 'metadata.yaml').write_text(text)
    frames, warnings = read(folder)
    assert_same_frames(frames, FRAMES)
    assert any('cannot be understood' in w for w in warnings)


def test_a_file_that_metadata_names_is_missing(tmp_path: Path) -> None:
    folder = write_rosbag2(tmp_path / 'a', camera_messages(FRAMES))
    text = (folder / 'metadata.yaml').read_text().replace('a.mcap', 'b.mcap')
    (folder / 'metadata.yaml').write_text(text)
    frames, warnings = read(folder)
    assert_same_frames(frames, FRAMES)
    assert any('names b.mcap, which is not there' in w for w in warnings)
    (folder / 'a.mcap').unlink()
    with pytest.raises(RecordingError, match=r'none of the files .* names: b\.mcap$'):
        read(folder)


@pytest.mark.timeout(20)
@pytest.mark.parametrize(
    'made',
    [
        'CREATE VIEW Messages AS WITH RECURSIVE r(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM r) '
        'SELECT i AS id, 1 AS topic_id, i AS timestamp, zeroblob(10) AS data FROM r',
        'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, '
        'data BLOB GENERATED ALWAYS AS (zeroblob(900000000)))',
    ],
)
def test_a_database_that_computes_its_messages_is_refused(made: str, tmp_path: Path) -> None:
    """A few bytes of it could be messages without end."""
    path = WRITERS['db3'](tmp_path, camera_messages(FRAMES))
    with closing(sqlite3.connect(path)) as database, database:
        database.execute('ALTER TABLE messages RENAME TO old')
        database.execute(made)
        if 'TABLE' in made:
            database.execute('INSERT INTO messages SELECT id, topic_id, timestamp FROM old')
    with pytest.raises(RecordingError, match='its messages is computed, not recorded'):
        open_recording(path)


def test_a_database_that_was_never_checkpointed(tmp_path: Path) -> None:
    """rosbag2 was killed: the messages are in the write-ahead log beside the file."""
    path = WRITERS['db3'](tmp_path, camera_messages(FRAMES))
    database = sqlite3.connect(path)
    database.execute('PRAGMA journal_mode=WAL')
    database.execute('PRAGMA wal_autocheckpoint=0')
    rows = database.execute('SELECT * FROM messages').fetchall()
    database.execute('DELETE FROM messages')
    database.commit()
    database.execute('PRAGMA wal_checkpoint(TRUNCATE)')
    database.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', rows)
    database.commit()
    killed = tmp_path / 'killed'
    killed.mkdir()
    for name in (path.name, path.name + '-wal'):
        shutil.copy(path.with_name(name), killed / name)
    database.close()
    for folder in (killed / path.name, killed):
        frames, _ = read(folder)
        assert_same_frames(frames, FRAMES)


CUTS = ['mcap', 'mcap lz4', 'mcap zstd', 'ROS 1', 'ROS 1 bz2', 'ROS 1 lz4']


def many_messages() -> list[Sent]:
    return camera_messages(make_frames(8))


@pytest.mark.parametrize('kind', CUTS)
def test_a_bag_cut_off_anywhere_gives_what_is_whole(kind: str, tmp_path: Path) -> None:
    """At any byte: no crash, only good messages, and never fewer from a longer file."""
    sent = many_messages()
    path = WRITERS[kind](tmp_path, sent)
    data = path.read_bytes()
    expected = make_frames(8)
    counts = []
    cut = tmp_path / f'cut{path.suffix}'
    for length in range(20, len(data), len(data) // 41):
        cut.write_bytes(data[:length])
        bag = RawBag(cut)
        counts.append(sum(len(t) for t in bag.topics.values()))
        assert any('cut off or not closed' in w for w in bag.warnings)
        assert not any(w.endswith('read up to there') for w in bag.warnings)
        bag.close()
        if counts[-1] >= 3:
            frames, warnings = read(cut)
            full = frames if frames[-1].depth is not None else frames[:-1]
            assert_same_frames(full, expected[: len(full)])
            assert any('cut off or not closed' in w for w in warnings)
    assert counts == sorted(counts)
    assert counts[0] == 0
    # bz2 packs 900 kB into one block, of which a part gives nothing.
    assert counts[-1] >= (0 if kind == 'ROS 1 bz2' else len(sent) // 2)


def test_an_uncompressed_bag_gives_every_whole_message(tmp_path: Path) -> None:
    """Also those in a chunk whose end is missing."""
    for kind in ('mcap', 'ROS 1'):
        path = WRITERS[kind](tmp_path, many_messages())
        bag = RawBag(path)
        ends = []
        for topic, index in bag.in_order():
            _, _, at, length = topic.places[4 * index : 4 * index + 4]
            ends.append(at + length)
        bag.close()
        data = path.read_bytes()
        for end in ends[1::5]:
            for length in (end - 1, end):
                path.write_bytes(data[:length])
                bag = RawBag(path)
                found = sum(len(t) for t in bag.topics.values())
                bag.close()
                assert found == sum(e <= length for e in ends)


def test_text_that_no_reader_of_ros2_takes_is_not_copied(tmp_path: Path) -> None:
    """ROS 1 lets a frame be named by any bytes; rclpy raises where they are no UTF-8."""
    path = write_ros1(tmp_path / 'a.bag', camera_messages(make_frames(3)))
    data = path.read_bytes()
    at = data.index(b'optical')
    path.write_bytes(data[:at] + b'\xd3' + data[at + 1 :])
    bag = RawBag(path)
    count, warnings = copy_bag(bag, tmp_path / 'b.mcap')
    total = sum(len(t) for t in bag.topics.values())
    bag.close()
    assert count == total - 1
    assert sum('is left out' in w for w in warnings) == 1
    written = RawBag(tmp_path / 'b.mcap')
    assert sum(written.message(t, i) is not None for t, i in written.in_order()) == count
    written.close()


def test_a_cut_off_database_gives_what_is_whole(tmp_path: Path) -> None:
    path = WRITERS['db3'](tmp_path, many_messages())
    data = path.read_bytes()
    counts = []
    for length in range(1000, len(data), len(data) // 40):
        path.write_bytes(data[:length])
        counts.append(0)
        with suppress(RecordingError):
            frames, warnings = read(path)
            whole = [f for f in frames if f.depth is not None]
            assert_same_frames(whole, make_frames(8)[: len(whole)])
            assert any('cut off' in w for w in warnings)
            counts[-1] = len(whole)
    assert counts == sorted(counts)
    assert counts[-1] >= 6


def test_convert_mends_a_bag_that_was_cut_off(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / 'a.mcap', many_messages())
    path.write_bytes(path.read_bytes()[:60000])
    frames, _ = read(path)
    bag = RawBag(path)
    copy_bag(bag, tmp_path / 'mended.mcap')
    bag.close()
    mended, warnings = read(tmp_path / 'mended.mcap')
    assert_same_frames(mended, frames)
    assert not any('cut off' in w for w in warnings)


@pytest.mark.parametrize('kind', ['mcap lz4', 'mcap zstd'])
def test_a_damaged_chunk_costs_what_is_in_it(kind: str, tmp_path: Path) -> None:
    """An error names the frame; convert leaves the chunk out."""
    frames = make_frames(8, (320, 240))
    path = WRITERS[kind](tmp_path, camera_messages(frames))
    data = bytearray(path.read_bytes())
    # Noise cannot be packed and stands there as it is.
    at = data.index(frames[3].color.tobytes()[100_000:100_016])
    data[at : at + 2000] = bytes(2000)
    path.write_bytes(data)
    with pytest.raises(ImageError, match=r'frame \d of .*rgbd-kcf convert writes a bag without'):
        read(path)
    bag = RawBag(path)
    count, warnings = copy_bag(bag, tmp_path / 'mended.mcap')
    bag.close()
    assert 18 <= count < 24
    assert any('is left out' in w for w in warnings)
    found, _ = read(tmp_path / 'mended.mcap')
    whole = [f for f in found if f.depth is not None]
    assert len(whole) >= 5
    by_stamp = {f.stamp_ns: f for f in frames}
    assert_same_frames(whole, [by_stamp[f.stamp_ns] for f in whole])


@pytest.mark.parametrize(
    ('kind', 'packed'), [('mcap zstd', b'\x28\xb5\x2f\xfd'), ('ROS 1 lz4', b'\x04\x22\x4d\x18')]
)
def test_a_damaged_first_chunk_costs_no_other(kind: str, packed: bytes, tmp_path: Path) -> None:
    """The topics stand in the first chunk and, where the file was closed, at its end once more."""
    frames = make_frames(8, (320, 240))
    path = WRITERS[kind](tmp_path, camera_messages(frames))
    path.write_bytes(path.read_bytes().replace(packed, bytes(4), 1))
    bag = RawBag(path)
    count, _ = copy_bag(bag, tmp_path / 'mended.mcap')
    assert sum('chunk at byte' in w for w in bag.warnings) == 1
    bag.close()
    assert 15 <= count < 24


@pytest.mark.parametrize('place', [0, 8, 100, 1 << 40, (1 << 64) - 1])
def test_a_summary_that_is_elsewhere_does_no_harm(place: int, tmp_path: Path) -> None:
    path = write_mcap(tmp_path / 'a.mcap', camera_messages(FRAMES))
    data = path.read_bytes()
    path.write_bytes(data[:-28] + place.to_bytes(8, 'little') + data[-20:])
    assert read(path)[1] == []
    path = write_ros1(tmp_path / 'a.bag', camera_messages(FRAMES))
    begin, name, rest = path.read_bytes().partition(b'index_pos=')
    path.write_bytes(begin + name + place.to_bytes(8, 'little') + rest[8:])
    assert_same_frames(read(path)[0], FRAMES)


@pytest.mark.parametrize('kind', ['mcap', 'ROS 1'])
def test_a_damaged_record_in_a_chunk_is_told(kind: str, tmp_path: Path) -> None:
    """A record that claims more than its chunk holds; what stands before it is read."""
    path = WRITERS[kind](tmp_path, camera_messages(FRAMES))
    bag = RawBag(path)
    _, _, at, _ = bag.topics[COLOR].places[8:12]
    bag.close()
    data = bytearray(path.read_bytes())
    # The highest byte of the length before the head of the message, or before its data.
    data[at - (23 if kind == 'mcap' else 1)] = 0x7F
    path.write_bytes(data)
    bag = RawBag(path)
    bag.close()
    assert 0 < len(bag.topics[COLOR]) < len(FRAMES)
    (warning,) = bag.warnings
    assert re.search(r'the chunk at byte \d+ is damaged, and read up to there$', warning)


@pytest.mark.parametrize(
    'damage',
    [
        "UPDATE messages SET timestamp = 'noon' WHERE id = 2",
        "UPDATE messages SET timestamp = x'00ff' WHERE id = 2",
        'UPDATE messages SET timestamp = 1e300 WHERE id = 2',
        "UPDATE messages SET data = 'text' WHERE id = 2",
        'UPDATE messages SET data = 5 WHERE id = 2',
        'UPDATE messages SET topic_id = 99 WHERE id = 2',
        "UPDATE messages SET topic_id = 'text' WHERE id = 2",
        f"UPDATE topics SET name = x'00ff' WHERE name = '{INFO}'",
    ],
)
def test_rows_of_a_wrong_type_are_told(damage: str, tmp_path: Path) -> None:
    """SQLite takes any value in any column: such messages were left out without a word."""
    path = WRITERS['db3'](tmp_path, camera_messages(FRAMES))
    with closing(sqlite3.connect(path)) as database, database:
        database.execute(damage)
    bag = RawBag(path)
    bag.close()
    lost = 3 * len(FRAMES) - sum(map(len, bag.topics.values()))
    assert lost == (6 if 'topics' in damage else 1)
    assert bag.warnings == [
        f'{path}: {lost} messages are left out: they are damaged, or of no topic that it holds'
    ]


@pytest.mark.parametrize(
    ('kind', 'field', 'wrong'),
    [('ROS 1', b'time=', b'tame='), ('ROS 1', b'conn=', b'conn=\x63'), ('mcap', b'', b'\x63')],
)
def test_messages_of_no_topic_and_of_no_time_are_told(
    kind: str, field: bytes, wrong: bytes, tmp_path: Path
) -> None:
    path = WRITERS[kind](tmp_path, camera_messages(FRAMES))
    bag = RawBag(path)
    _, _, at, _ = bag.topics[COLOR].places[8:12]
    bag.close()
    data = bytearray(path.read_bytes())
    # In MCAP the number of the channel is the first of what stands before a message.
    place = data.rindex(field, 0, at) if field else at - 22
    data[place : place + len(wrong)] = wrong
    path.write_bytes(data)
    bag = RawBag(path)
    bag.close()
    assert sum(map(len, bag.topics.values())) == 3 * len(FRAMES) - 1
    assert bag.warnings == [
        f'{path}: 1 messages are left out: they are damaged, or of no topic that it holds'
    ]


@pytest.mark.parametrize('kind', ['mcap', 'ROS 1'])
def test_packed_zeros_are_no_records(kind: str, tmp_path: Path) -> None:
    """A file of 1 kB claimed millions of empty records, and was looked through for minutes."""
    size = 1 << 24
    packed = bz2.compress(bytes(size))
    if kind == 'mcap':
        length = struct.pack('<Q', len(packed))
        body = struct.pack('<QQQIL', 0, 0, size, 0, 3) + b'bz2' + length + packed
        chunk = struct.pack('<BQ', 6, len(body)) + body
        data = b'\x89MCAP0\r\n' + chunk
    else:
        values = (b'op=\5', b'compression=bz2', b'size=' + struct.pack('<L', size))
        head = b''.join(struct.pack('<L', len(v)) + v for v in values)
        chunk = struct.pack('<L', len(head)) + head + struct.pack('<L', len(packed)) + packed
        data = b'#ROSBAG V2.0\n' + chunk
    path = tmp_path / 'a'
    path.write_bytes(data)
    bag = RawBag(path)
    bag.close()
    assert any(w.endswith('is damaged, and read up to there') for w in bag.warnings)


def test_missing_index(tmp_path: Path) -> None:
    """The summary of an mcap, or the index of a ROS 1 bag, is taken away."""
    path = write_mcap(tmp_path / 'a.mcap', camera_messages(FRAMES))
    with path.open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    end = max(c.chunk_start_offset + c.chunk_length for c in summary.chunk_indexes)
    path.write_bytes(path.read_bytes()[:end])
    assert_same_frames(read(path)[0], FRAMES)
    path = write_ros1(tmp_path / 'a.bag', camera_messages(FRAMES))
    data = bytearray(path.read_bytes())
    at = data.index(b'index_pos=') + len(b'index_pos=')
    end = int.from_bytes(data[at : at + 8], 'little')
    data[at : at + 8] = bytes(8)
    path.write_bytes(data[:end])
    frames, warnings = read(path)
    assert_same_frames(frames, FRAMES)
    assert any('not closed' in w for w in warnings)


_SOURCES = {
    kind: camera_messages(make_frames(2, (16, 12)))
    for kind in ('mcap', 'mcap zstd', 'ROS 1', 'db3')
}


@settings(
    max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.sampled_from(sorted(_SOURCES)),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), max_size=8),
    st.booleans(),
)
def test_damaged_bytes_never_crash_the_reader(
    tmp_path_factory: pytest.TempPathFactory,
    kind: str,
    changes: list[tuple[float, int]],
    early: bool,
) -> None:
    """Frames, or an error of ours; whatever the damage."""
    folder = tmp_path_factory.mktemp('bag')
    path = WRITERS[kind](folder, _SOURCES[kind])
    data = bytearray(path.read_bytes())
    for place, value in changes:
        data[16 + int(place * ((1000 if early else len(data)) - 17))] = value
    path.write_bytes(data)
    with suppress(RgbdKcfError), open_recording(path) as recording:
        for frame in recording.frames():
            frame.color.sum()


def test_a_database_whose_column_of_ids_is_damaged_is_read_by_its_rows(tmp_path: Path) -> None:
    path = WRITERS['db3'](tmp_path, _SOURCES['db3'])
    before, _, after = path.read_bytes().partition(b'CREATE TABLE messages')
    path.write_bytes(before + b'CREATE TABLE messages' + after.replace(b'PRIMARY', b'PRI ARY', 1))
    with open_recording(path) as recording:
        assert len(list(recording.frames())) == 2


WRITE_FOR_EVER = """
import sys
import dataclasses
from bag_rig import make_frames
from rgbd_kcf_tracker.recordings import BagWriter, KINECT2_QHD
from rgbd_kcf_tracker.track import Track, TrackState
from rgbd_kcf_tracker.geometry import Box

frames = make_frames(3)
with BagWriter(sys.argv[1], KINECT2_QHD, compression=sys.argv[2]) as writer:
    for number in range(10**9):
        base = frames[number % 3]
        frame = dataclasses.replace(base, stamp_ns=base.stamp_ns + number * 10**9)
        writer.write_frame(frame)
        writer.write_track(frame, Track(Box(number, 1, 2, 3), TrackState.TRACKING, 0.5))
        print(number, flush=True)
"""


@pytest.mark.parametrize('compression', ['none', 'zstd'])
@pytest.mark.parametrize('after_s', [0.0, 0.05, 0.33])
def test_what_was_written_is_there_after_kill_9(
    compression: str, after_s: float, tmp_path: Path
) -> None:
    path = tmp_path / 'a.mcap'
    process = subprocess.Popen(
        [sys.executable, '-c', WRITE_FOR_EVER, str(path), compression],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {'PYTHONPATH': os.pathsep.join([*sys.path, str(Path(__file__).parent)])},
    )
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(after_s)
    process.send_signal(signal.SIGKILL)
    numbers = process.stdout.read().split()
    process.wait()
    reported = 1 + (int(numbers[-1]) if numbers else 0)
    bases = make_frames(3)
    with open_recording(path) as recording:
        frames = list(recording.frames())
        assert any('cut off or not closed' in w for w in recording.warnings)
    assert reported <= len(frames) <= reported + 1
    for number, frame in enumerate(frames[:reported]):
        base = bases[number % 3]
        assert frame.stamp_ns == base.stamp_ns + number * 10**9
        assert np.array_equal(frame.color, base.color)
        assert np.array_equal(frame.depth, base.depth, equal_nan=True)
    bag = RawBag(path)
    assert len(bag.topics['/tracker/box']) >= reported
    bag.close()


# -- cameras, ground truth ---------------------------------------------------------------------


def test_intrinsics_of_the_recording_or_given(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / 'a.mcap', camera_messages(FRAMES))
    with open_recording(path) as recording:
        assert recording.intrinsics == CAMERA
    other = dataclasses.replace(CAMERA, fx=99.0)
    assert read(path, ReadOptions(intrinsics=other))[0][0].intrinsics == other


def test_camera_info_that_is_none(tmp_path: Path) -> None:
    for change, words in (
        ({'k': np.zeros(9), 'p': np.zeros(12)}, 'not calibrated'),
        ({'k': np.full(9, -5.0)}, 'no camera'),
        ({'k': np.full(9, np.nan)}, 'no camera'),
        ({'width': 1920, 'height': 1080}, 'is for 1920x1080 images'),
    ):
        sent = camera_messages(FRAMES)
        for s in sent:
            if s.topic == INFO:
                for name, value in change.items():
                    setattr(s.message, name, value)
        frames, warnings = read(write_mcap(tmp_path / 'a.mcap', sent))
        assert frames[0].intrinsics is None
        assert any(words in w for w in warnings), warnings


def test_ground_truth_of_a_bag_is_that_of_the_folder(tmp_path: Path) -> None:
    boxes = [
        None,
        Box(367.8, 163.3, 33.8, 40.2),
        Box(0.123, 5, 6.1, 7),
        None,
        Box(1, 2, 3, 4),
        None,
    ]
    bodies = [Box(0, 0, 60, 40)] * 5 + [None]
    topics = CameraTopics(COLOR, DEPTH, INFO, 'optical')
    with BagWriter(tmp_path / 'a.mcap', topics) as bag, SequenceWriter(tmp_path / 'a') as folder:
        for frame, box, body in zip(FRAMES, boxes, bodies, strict=True):
            bag.write_frame(frame)
            bag.write_truth(frame, box, body)
            folder.write(frame, box, body)
    for path in (tmp_path / 'a.mcap', tmp_path / 'a'):
        with open_recording(path) as recording:
            assert recording.groundtruth == boxes
            assert recording.groundtruth_body == bodies
            assert_same_frames(list(recording.frames()), FRAMES)
            info = recording.info()
            assert (info.frames, info.frames_with_depth, info.truth_frames) == (6, 6, 3)
            assert info.rate_hz == pytest.approx(30, abs=0.1)


def test_info_of_a_bag(tmp_path: Path) -> None:
    with open_recording(write_mcap(tmp_path / 'a.mcap', camera_messages(FRAMES))) as recording:
        info = recording.info()
    streams = {s.name: s for s in info.streams}
    assert streams[COLOR].role == 'color'
    assert (streams[DEPTH].size, streams[DEPTH].encoding) == (SIZE, '16UC1')
    assert streams[INFO].count == 6
    assert info.intrinsics == CAMERA


# -- real bags ---------------------------------------------------------------------------------


def test_the_real_ros_1_bags_open(shared_data: Path, tmp_path: Path) -> None:
    paths = sorted((shared_data / 'bags' / 'hero' / 'bags').glob('*.bag'))
    assert len(paths) == 5
    with open_recording(shared_data / 'bags' / 'hero') as converted:
        expected = list(converted.frames())
    for path, other in zip(paths, expected, strict=True):
        (frame,), _ = read(path)
        assert np.array_equal(frame.color, other.color)
        assert frame.depth is not None
        assert other.depth is not None
        assert np.nanmax(np.abs(frame.depth - other.depth)) < 0.001
        assert frame.intrinsics is not None
        assert frame.intrinsics.fx == pytest.approx(537.03, abs=0.01)
        bag = RawBag(path)
        assert copy_bag(bag, tmp_path / f'{path.stem}.mcap') == (3, [])
        bag.close()
        assert_same_frames(read(tmp_path / f'{path.stem}.mcap')[0], [frame])
