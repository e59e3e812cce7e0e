# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the topics of a bag hold, by a look at the first message of each."""

from __future__ import annotations

import statistics
from itertools import pairwise
from typing import Any

from rgbd_kcf_tracker.errors import ImageError, RgbdKcfError
from rgbd_kcf_tracker.recordings.containers import JPEG, MAX_SIDE, inspect, sniff
from rgbd_kcf_tracker.recordings.images import (
    COLOR_ENCODINGS,
    DEPTH_ENCODINGS,
    as_bytes,
    decode_compressed_depth,
)
from rgbd_kcf_tracker.recordings.rawbag import RawBag
from rgbd_kcf_tracker.recordings.recording import StreamInfo
from rgbd_kcf_tracker.recordings.storage import Topic
from rgbd_kcf_tracker.recordings.topics import ChosenTopics, ImageTopic, base_name

TRUTH_TOPICS = ('/groundtruth/visible', '/groundtruth/body')
IMAGE, COMPRESSED = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'
INFO, POLYGON = 'sensor_msgs/msg/CameraInfo', 'geometry_msgs/msg/PolygonStamped'


def look_at_images(bag: RawBag) -> list[ImageTopic]:
    """:func:`look_at` for every image topic with messages."""
    return [
        look_at(bag, topic)
        for topic in bag.topics.values()
        if topic.type in (IMAGE, COMPRESSED) and len(topic)
    ]


def look_at(bag: RawBag, topic: Topic) -> ImageTopic:
    """What the first message of an image topic tells of it."""
    by_name = role_by_name(topic.name)
    try:
        msg = bag.message(topic, 0)
        if topic.type == IMAGE:
            encoding = str(msg.encoding)
            role = (
                'color'
                if encoding in COLOR_ENCODINGS
                else 'depth'
                if encoding in DEPTH_ENCODINGS
                else by_name
            )
            return ImageTopic(topic.name, role, (int(msg.width), int(msg.height)), encoding)
        return _look_at_compressed(topic, msg, by_name)
    except RgbdKcfError:
        return ImageTopic(topic.name, by_name)


def role_by_name(name: str) -> str:
    """Depth where a name says so, but for colour below a camera's name that does."""
    own = '/'.join(base_name(name).rsplit('/', 2)[1:])
    says_color = 'depth' not in own and ('color' in own or 'rgb' in own)
    return 'color' if says_color or 'depth' not in name else 'depth'


def _look_at_compressed(topic: Topic, msg: Any, by_name: str) -> ImageTopic:
    text = str(msg.format)
    data = as_bytes(msg.data)
    kind = sniff(data)
    if kind is None:
        if 'theora' in topic.name or len(data) < 12:
            return ImageTopic(topic.name, '', None, text)
        size: tuple[int, int] | None = None
        try:
            shape = decode_compressed_depth(msg).shape
            size = shape[1], shape[0]
        except ImageError:
            pass
        return ImageTopic(topic.name, 'depth', size, text)
    head = inspect(data, MAX_SIDE**2)  # it is only looked at
    size = head.width, head.height
    if head.channels == 1 and head.bits in (16, 32):
        return ImageTopic(topic.name, 'depth', size, text)
    if kind == JPEG and by_name == 'depth':
        return ImageTopic(topic.name, '', size, f'{text} (JPEG, which spoils depth)')
    return ImageTopic(topic.name, 'color', size, text)


def describe_streams(
    bag: RawBag, images: list[ImageTopic], chosen: ChosenTopics | None
) -> tuple[StreamInfo, ...]:
    """All topics of a bag, for :meth:`Recording.info`."""
    looked = {i.name: i for i in images}
    roles: dict[str | None, str] = {}
    if chosen is not None:
        roles = {chosen.color: 'color', chosen.depth: 'depth', chosen.info: 'info'}
    roles |= dict.fromkeys(TRUTH_TOPICS, 'truth')
    streams = []
    for topic in bag.topics.values():
        image = looked.get(topic.name)
        streams.append(
            StreamInfo(
                topic.name,
                topic.type,
                len(topic),
                rate_of(topic.log_ns),
                None if image is None else image.size,
                '' if image is None else image.encoding,
                roles.get(topic.name, ''),
            )
        )
    return tuple(streams)


def rate_of(stamps: Any) -> float | None:
    """Median rate in Hz of stamps in nanoseconds; None where they do not rise."""
    gaps = [b - a for a, b in pairwise(stamps) if b > a]
    return 1e9 / statistics.median(gaps) if gaps else None
