# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One recording into another: any source as mcap, bags message by message and without loss."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, TypeVar

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.bag_writer import GENERIC, BagWriter, CameraTopics
from rgbd_kcf_tracker.recordings.bags import BagRecording
from rgbd_kcf_tracker.recordings.mcap_writer import (
    DEFAULT_COMPRESSION,
    McapWriter,
    definition_text,
)
from rgbd_kcf_tracker.recordings.rawbag import RawBag, typestore
from rgbd_kcf_tracker.recordings.recording import Recording
from rgbd_kcf_tracker.recordings.storage import Definition
from rgbd_kcf_tracker.recordings.topics import base_name

_POLICIES = {
    'reliability': {'0': 'system_default', '1': 'reliable', '2': 'best_effort'},
    'durability': {'0': 'system_default', '1': 'transient_local', '2': 'volatile'},
    'liveliness': {'0': 'system_default', '1': 'automatic', '3': 'manual_by_topic'},
}

T = TypeVar('T')
Progress = Callable[[Iterable[T], int], Iterable[T]]


def _no_progress(items: Iterable[Any], total: int) -> Iterable[Any]:
    return items


def output_topics(recording: Recording) -> tuple[CameraTopics, str]:
    """Topics and depth encoding for a bag written from a recording.

    A bag's own names stay, without the suffix of a compressed transport, as images are written raw;
    a folder gets the names that the tracker node listens to. See :meth:`CameraTopics.showing`.
    """
    if not isinstance(recording, BagRecording):
        return GENERIC, '16UC1'
    chosen = recording.topics
    topics = replace(
        GENERIC, color=base_name(chosen.color), frame_id=recording.frame_id() or GENERIC.frame_id
    )
    if chosen.depth is not None:
        topics = replace(topics, depth=base_name(chosen.depth))
    if chosen.info is not None:
        topics = replace(topics, info=chosen.info)
    else:
        topics = replace(topics, info=topics.color.rpartition('/')[0] + '/camera_info')
    metres = recording.depth_encoding().startswith('32FC1')
    return topics.showing(recording.intrinsics), '32FC1' if metres else '16UC1'


def write_recording(
    recording: Recording,
    path: str | os.PathLike[str],
    *,
    topics: CameraTopics = GENERIC,
    compression: str = DEFAULT_COMPRESSION,
    progress: Progress[Any] = _no_progress,
    overwrite: bool = False,
) -> int:
    """Decode all frames of a recording and write them, with its ground truth, as mcap.

    Returns:
        The number of frames.

    Raises:
        RecordingError: where one cannot be read or written.
    """
    truth, body = recording.groundtruth, recording.groundtruth_body
    topics = topics.showing(recording.intrinsics)
    count = 0
    with BagWriter(path, topics, compression=compression, overwrite=overwrite) as writer:
        for frame in progress(recording.frames(), len(recording)):
            writer.write_frame(frame)
            if truth is not None and count < len(truth):
                whole = body[count] if body is not None and count < len(body) else None
                writer.write_truth(frame, truth[count], whole)
            count += 1
    return count


def copy_bag(
    bag: RawBag,
    path: str | os.PathLike[str],
    *,
    compression: str = DEFAULT_COMPRESSION,
    progress: Progress[Any] = _no_progress,
    overwrite: bool = False,
) -> tuple[int, list[str]]:
    """Copy all messages of a bag into an mcap file, in the order of recording.

    Messages of ROS 2 are copied byte by byte; those of ROS 1 are put into ROS 2's serialisation,
    and left out where that cannot be read.

    Returns:
        The number of messages copied, and warnings about those that could not be.

    Raises:
        RecordingError: where the bag cannot be read on, or the file not be written.
    """
    warnings: list[str] = []
    translate: Any = _Passer(bag)
    if bag.ros1:  # brings all of rosbags
        from rgbd_kcf_tracker.recordings.ros1_translation import Ros1Translator

        translate = Ros1Translator(bag)
    total = sum(len(t) for t in bag.topics.values())
    count = 0
    refused: set[str] = set()
    with McapWriter(path, compression, overwrite) as writer:
        for topic, index in progress(bag.in_order(), total):
            if topic.type in refused:
                continue
            found = translate.type_of(topic.type)
            if found is None:
                refused.add(topic.type)
                warnings.append(
                    f'{topic.name} is left out: the bag does not say what {topic.type} is'
                )
                continue
            kind, definition = found
            try:
                data = translate.checked(topic.type, bag.read(topic, index))
            except RecordingError as error:
                warnings.append(f'message {index} of {topic.name} is left out: {error}')
                continue
            qos = _named(bag.qos.get(topic.name, ''))
            writer.write_raw(topic.name, kind, data, topic.log_ns[index], definition, qos)
            count += 1
    return count, warnings


def _named(qos: str) -> str:
    """Profiles with names for the numbers that rosbag2 wrote before Jazzy.

    An mcap file does not say which it holds, and without ``metadata.yaml`` Jazzy expects names.
    """

    def name(found: re.Match[str]) -> str:
        return f'{found[1]}: {_POLICIES[found[1]].get(found[2], found[2])}'

    return re.sub(rf'\b({"|".join(_POLICIES)}): (\d+)\b', name, qos)


class _Passer:
    """ROS 2 messages as they are, with the text of their type from the bag or from Jazzy."""

    def __init__(self, bag: RawBag) -> None:
        self._definitions = bag.definitions

    def type_of(self, kind: str) -> tuple[str, Definition] | None:
        if kind in self._definitions:
            return kind, self._definitions[kind]
        if kind in typestore().types:
            return kind, Definition('ros2msg', definition_text(kind))
        return None

    def checked(self, kind: str, data: bytes) -> bytes | memoryview:
        return data
