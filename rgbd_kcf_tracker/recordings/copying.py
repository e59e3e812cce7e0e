# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One recording into another: any source as mcap, bags message by message and without loss."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, TypeVar

from rgbd_kcf_tracker.recordings.bag_writer import GENERIC, BagWriter, CameraTopics
from rgbd_kcf_tracker.recordings.bags import BagRecording
from rgbd_kcf_tracker.recordings.mcap_writer import McapWriter
from rgbd_kcf_tracker.recordings.rawbag import RawBag, typestore
from rgbd_kcf_tracker.recordings.recording import Recording
from rgbd_kcf_tracker.recordings.storage import Definition, Topic
from rgbd_kcf_tracker.recordings.topics import base_name

T = TypeVar('T')
Progress = Callable[[Iterable[T], int], Iterable[T]]


def _no_progress(items: Iterable[Any], total: int) -> Iterable[Any]:
    return items


def output_topics(recording: Recording) -> tuple[CameraTopics, str]:
    """Topics and depth encoding for a bag written from a recording.

    A bag's own names stay, without the suffix of a compressed transport, as images are written raw;
    a folder gets the names that the tracker node listens to.
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
    return topics, '32FC1' if metres else '16UC1'


def write_recording(
    recording: Recording,
    path: str | os.PathLike[str],
    *,
    topics: CameraTopics = GENERIC,
    compression: str = 'none',
    progress: Progress[Any] = _no_progress,
) -> int:
    """Decode all frames of a recording and write them, with its ground truth, as mcap.

    Returns:
        The number of frames.

    Raises:
        RecordingError: where one cannot be read or written.
    """
    truth, body = recording.groundtruth, recording.groundtruth_body
    count = 0
    with BagWriter(path, topics, compression=compression) as writer:
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
    compression: str = 'none',
    progress: Progress[Any] = _no_progress,
) -> tuple[int, list[str]]:
    """Copy all messages of a bag into an mcap file, in the order of recording.

    Messages of ROS 2 are copied byte by byte; those of ROS 1 are put into ROS 2's serialisation.

    Returns:
        The number of messages copied, and warnings about those that could not be.

    Raises:
        RecordingError: where the bag cannot be read on, or the file not be written.
    """
    warnings: list[str] = []
    translate = _Translator(bag, warnings)
    total = sum(len(t) for t in bag.topics.values())
    count = 0
    with McapWriter(path, compression) as writer:
        for topic, index in progress(bag.in_order(), total):
            definition = translate.definition(topic)
            if definition is None:
                continue
            data = translate.data(topic, bag.read(topic, index), index)
            if data is None:
                continue
            writer.write_raw(topic.name, topic.type, data, topic.log_ns[index], definition)
            count += 1
    return count, warnings


class _Translator:
    """Finds the text of each type for ROS 2, and turns ROS 1 messages into CDR."""

    def __init__(self, bag: RawBag, warnings: list[str]) -> None:
        self._bag = bag
        self._warnings = warnings
        self._definitions: dict[str, Definition | None] = {}
        self._store = typestore(bag.ros1)

    def definition(self, topic: Topic) -> Definition | None:
        """Text of the topic's type, or None (and a warning, once) where nothing is known of it."""
        if topic.type not in self._definitions:
            self._definitions[topic.type] = found = self._find(topic.type)
            if found is None:
                self._warnings.append(
                    f'{topic.name} is left out: the bag does not say what {topic.type} is'
                )
        return self._definitions[topic.type]

    def data(self, topic: Topic, data: bytes, index: int) -> bytes | memoryview | None:
        """The message in CDR, or None (and a warning) where it is damaged."""
        if not self._bag.ros1:
            return data
        try:
            translated: bytes | memoryview = self._store.ros1_to_cdr(data, topic.type)
            return translated
        except Exception as error:  # a hostile message makes the library raise anything
            self._warnings.append(f'message {index} of {topic.name} is left out: {error}')
            return None

    def _find(self, kind: str) -> Definition | None:
        known = self._bag.definitions.get(kind)
        if known is not None and known.encoding in ('ros2msg', 'ros2idl'):
            return known
        jazzy = typestore()
        if kind in jazzy.types:
            return Definition('ros2msg', str(jazzy.generate_msgdef(kind, ros_version=2)[0]))
        if known is None:
            return None
        try:
            from rosbags.typesys import get_types_from_msg

            if kind not in self._store.types:
                found = get_types_from_msg(known.text, kind)
                self._store.register({k: v for k, v in found.items() if k not in self._store.types})
            return Definition('ros2msg', str(self._store.generate_msgdef(kind, ros_version=2)[0]))
        except Exception:  # whatever the library says of a text that is no definition
            return None
