# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Small recordings for tests, in every format, written by other libraries than our reader."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.recordings.bag_types import BAG_TYPES
from rgbd_kcf_tracker.recordings.encoding import PackedImage, RawImage, encode_color, encode_depth
from rgbd_kcf_tracker.recordings.images import metres_from_mm
from rgbd_kcf_tracker.recordings.mcap_writer import McapWriter
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages

ROS1 = get_typestore(Stores.ROS1_NOETIC)
ROS2 = get_typestore(Stores.ROS2_JAZZY)
START_NS = 1_700_000_000_000_000_000
STEP_NS = 33_333_333
SIZE = (64, 48)
CAMERA = Intrinsics(60.0, 61.0, 31.5, 23.5)
COLOR, DEPTH, INFO = (
    '/camera/color/image_raw',
    '/camera/depth/image_raw',
    '/camera/color/camera_info',
)


@dataclass(frozen=True)
class Sent:
    """A message, where and when."""

    topic: str
    log_ns: int
    message: Any

    @property
    def type(self) -> str:
        return str(self.message.__msgtype__)


def make_frames(count: int = 6, size: tuple[int, int] = SIZE) -> list[Frame]:
    """Frames that differ from each other, depth with holes."""
    rng = np.random.default_rng(11)
    frames = []
    for number in range(count):
        color = rng.integers(0, 256, (size[1], size[0], 3)).astype(np.uint8)
        depth = rng.integers(500, 8000, (size[1], size[0])).astype(np.uint16)
        depth[rng.random(depth.shape) < 0.2] = 0
        stamp = START_NS + number * STEP_NS
        frames.append(Frame(color, metres_from_mm(depth), stamp, CAMERA))
    return frames


MAKE = TrackMessages(BAG_TYPES)
header, camera_info = MAKE.header, MAKE.camera_info


def image(stamp_ns: int, packed: RawImage | PackedImage, frame_id: str = 'optical') -> Any:
    """The ROS 2 message of an encoded image."""
    head = header(stamp_ns, frame_id)
    if isinstance(packed, PackedImage):
        return MAKE.compressed_image(head, packed)
    return MAKE.image(head, packed)


def camera_messages(
    frames: list[Frame],
    color: str = COLOR,
    depth: str | None = DEPTH,
    info: str | None = INFO,
) -> list[Sent]:
    """What a camera driver would send of the frames, depth a little after colour."""
    sent = []
    for frame in frames:
        stamp = frame.stamp_ns
        if info is not None:
            message = camera_info(header(stamp, 'optical'), frame.width, frame.height, CAMERA)
            sent.append(Sent(info, stamp + 1_000_000, message))
        sent.append(Sent(color, stamp + 2_000_000, image(stamp, encode_color(frame.color))))
        if depth is not None and frame.depth is not None:
            sent.append(Sent(depth, stamp + 3_000_000, image(stamp, encode_depth(frame.depth))))
    return sent


def write_mcap(path: Path, sent: list[Sent], compression: str = 'none') -> Path:
    """A single mcap file."""
    if not sent:  # ours leaves no empty file
        with path.open('wb') as file:
            empty = Writer(file)
            empty.start(profile='ros2')
            empty.finish()
        return path
    with McapWriter(path, compression, overwrite=True) as writer:
        for s in sent:
            writer.write(s.topic, s.message, s.log_ns)
    return path


def write_rosbag2(
    folder: Path, sent: list[Sent], plugin: str = 'MCAP', compression: str = 'NONE'
) -> Path:
    """A rosbag2 folder, written by rosbags."""
    writer = Ros2Writer(folder, version=9, storage_plugin=StoragePlugin[plugin])
    writer.set_compression(CompressionMode[compression], CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for s in sent:
            if s.topic not in connections:
                connections[s.topic] = writer.add_connection(s.topic, s.type, typestore=ROS2)
            data = ROS2.serialize_cdr(s.message, s.type)
            writer.write(connections[s.topic], s.log_ns, data)
    return folder


def write_ros1(path: Path, sent: list[Sent], compression: str | None = None) -> Path:
    """A ROS 1 bag, written by rosbags."""
    writer = Ros1Writer(path)
    if compression is not None:
        writer.set_compression(Ros1Writer.CompressionFormat[compression])
    with writer:
        connections: dict[str, Any] = {}
        for s in sent:
            if s.topic not in connections:
                connections[s.topic] = writer.add_connection(s.topic, s.type, typestore=ROS1)
            data = ROS2.cdr_to_ros1(ROS2.serialize_cdr(s.message, s.type), s.type)
            writer.write(connections[s.topic], s.log_ns, data)
    return path


def assert_same_frames(found: list[Frame], expected: list[Frame]) -> None:
    """Pixels, depth, stamps and cameras are equal."""
    assert [f.stamp_ns for f in found] == [f.stamp_ns for f in expected]
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one.color, other.color)
        assert (one.depth is None) == (other.depth is None)
        if one.depth is not None and other.depth is not None:
            assert np.array_equal(one.depth, other.depth, equal_nan=True)
        assert one.intrinsics == other.intrinsics
