# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A recording as serialised messages in their recorded order.

The messages of a ROS 2 bag go out as they were recorded, byte for byte; those of a ROS 1 bag are
put into ROS 2's serialisation. A sequence folder gives what ``rgbd-kcf convert`` would write.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.live.replay_message import Message, Role
from rgbd_kcf_tracker.live.replay_settings import ReplayParameters
from rgbd_kcf_tracker.recordings.bag_types import BAG_TYPES
from rgbd_kcf_tracker.recordings.bag_writer import GENERIC
from rgbd_kcf_tracker.recordings.bags import BagRecording
from rgbd_kcf_tracker.recordings.encoding import encode_color, encode_depth
from rgbd_kcf_tracker.recordings.rawbag import RawBag, typestore
from rgbd_kcf_tracker.recordings.recording import NO_DEPTH, Closing, ReadOptions
from rgbd_kcf_tracker.recordings.sequences import SequenceFolder, is_sequence_folder
from rgbd_kcf_tracker.recordings.storage import Topic
from rgbd_kcf_tracker.recordings.topics import SameTopicError
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages

if TYPE_CHECKING:
    from rgbd_kcf_tracker.recordings.ros1_translation import Ros1Translator

FOLDER_TOPICS = GENERIC
"""Where the images of a sequence folder go: the tracker's own names, which need no remapping."""
_MAKE = TrackMessages(BAG_TYPES)
_IMAGE, _INFO = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CameraInfo'
NEVER_REPLAYED = ('/clock', '/rosout', '/parameter_events')


@dataclass(frozen=True, slots=True)
class SourceTopic:
    """A topic of a recording: its name, its type as ``package/msg/Name``, its message count."""

    name: str
    type: str
    count: int


class ReplaySource(Closing):
    """Opens a recording for replay. Use it in a ``with`` block.

    Args:
        path: the recording.
        parameters: which topics, and how a sequence folder is read.

    Attributes:
        name: of the recording, for people.
        topics: what is replayed.
        color_topic, depth_topic, info_topic: the camera; None where there is no such topic.
        warnings: what was odd.

    Raises:
        RecordingError: where it cannot be opened, holds nothing that is asked for, or ends before
            it is to start.
    """

    def __init__(self, path: Path, parameters: ReplayParameters) -> None:
        if not path.exists():
            raise RecordingError(f'{path} does not exist: give a recording as the parameter bag')
        self.warnings: list[str] = []
        options = ReadOptions(
            color_topic=parameters.color_topic or None,
            depth_topic=parameters.depth_topic or None,
            info_topic=parameters.info_topic or None,
            fps=parameters.fps,
        )
        self._messages: _BagMessages | _FolderMessages
        if path.is_dir() and is_sequence_folder(path):
            self._messages = _FolderMessages(path, options)
        else:
            named = (parameters.color_topic, parameters.depth_topic, parameters.info_topic)
            self._messages = _BagMessages(path, options, any(named) or parameters.lockstep)
        self.warnings += self._messages.warnings
        self.name = path.resolve().name
        self.color_topic = self._messages.color_topic
        self.info_topic = self._messages.info_topic
        self.depth_topic = self._messages.depth_topic
        try:
            self.topics = self._chosen_topics(path, parameters)
            seconds = self._messages.seconds(frozenset(t.name for t in self.topics))
            if parameters.start > seconds:
                raise RecordingError(
                    f'{path} ends before start, {parameters.start:g} s: it lasts {seconds:.1f} s'
                )
        except BaseException:
            self._messages.close()
            raise
        # An image that is not published cannot be answered.
        published = {t.name for t in self.topics}
        if self.color_topic not in published:
            self.color_topic = None
        if self.depth_topic not in published:
            self.depth_topic = None
        if self.info_topic not in published:
            self.info_topic = None

    def __len__(self) -> int:
        return sum(t.count for t in self.topics)

    def _chosen_topics(self, path: Path, parameters: ReplayParameters) -> tuple[SourceTopic, ...]:
        present = {t.name: t for t in self._messages.topics if t.count}
        listing = ', '.join(f'{t.name} ({t.type}, {t.count})' for t in present.values())
        if not present:
            raise RecordingError(f'{path} holds no messages: nothing to replay')
        wanted = parameters.topic_list()
        for name in wanted:
            if name not in present:
                raise RecordingError(f'{path} has no topic {name}. Its topics: {listing}')
        if wanted:
            return tuple(present[name] for name in wanted)
        answers = parameters.answer_topic.rpartition('/')[0]
        left_out = [
            name
            for name in present
            if name in NEVER_REPLAYED or (answers and name.startswith(answers + '/'))
        ]
        if left_out:
            self.warnings.append(
                f'left out, because other nodes publish them: {", ".join(left_out)} '
                '(name them in topics to replay them)'
            )
        chosen = tuple(t for name, t in present.items() if name not in left_out)
        if not chosen:
            raise RecordingError(f'{path} holds nothing that a camera publishes: {listing}')
        return chosen

    def messages(self, start_s: float = 0.0) -> Iterator[Message]:
        """All messages from ``start_s`` seconds after the first, in recorded order.

        Ahead of them comes what holds on and may have been said only before: ``/tf_static``, and
        the last CameraInfo of each camera.

        Raises:
            RecordingError: where the recording cannot be read on.
        """
        return self._messages.read(frozenset(t.name for t in self.topics), start_s)

    def first_info(self) -> Message | None:
        """The first message of the camera's CameraInfo topic."""
        if self.info_topic is None:
            return None
        return next(self._messages.read(frozenset({self.info_topic}), 0.0), None)

    def close(self) -> None:
        """Close the files."""
        self._messages.close()


class _BagMessages:
    """Messages of a bag of any format."""

    def __init__(self, path: Path, options: ReadOptions, camera_needed: bool) -> None:
        self.color_topic: str | None = None
        self.depth_topic: str | None = None
        self.info_topic: str | None = None
        self._recording: BagRecording | None = None
        self.warnings: list[str] = []
        self._open(path, options, camera_needed)
        self._bag: RawBag
        if self._recording is None:
            self._bag = RawBag(path)
        else:
            self._bag = self._recording.bag
            if self._recording.topics.depth is None and options.depth_topic is None:
                told = set(self._bag.warnings)
                self.warnings += [w for w in self._recording.warnings if w not in told]
            self.color_topic = self._recording.topics.color
            self.depth_topic = self._recording.topics.depth
            self.info_topic = self._recording.topics.info
        self.warnings += self._bag.warnings
        self._translate: Ros1Translator | None = None
        if self._bag.ros1:  # brings all of rosbags
            from rgbd_kcf_tracker.recordings.ros1_translation import Ros1Translator

            self._translate = Ros1Translator(self._bag)
        self.topics = []
        for topic in self._bag.topics.values():
            kind = self._kind(topic)
            if kind is None:
                self.warnings.append(
                    f'{topic.name} is left out: the bag does not say what {topic.type} is'
                )
            else:
                self.topics.append(SourceTopic(topic.name, kind, len(topic)))

    def _open(self, path: Path, options: ReadOptions, camera_needed: bool) -> None:
        """Find the camera as the command line does; a bag without one is replayed all the same."""
        try:
            self._recording = BagRecording(path, options)
            return
        except RecordingError as error:
            named = options.depth_topic is not None or isinstance(error, SameTopicError)
            if camera_needed and named:
                raise
            problem = str(error)
        try:
            alone = dataclasses.replace(options, depth_topic=NO_DEPTH)
            self._recording = BagRecording(path, alone)
            self.warnings.append(f'colour without depth: {problem}')
        except RecordingError:
            if camera_needed:
                raise RecordingError(problem) from None
            self.warnings.append(f'replayed as it is, without waiting for answers: {problem}')

    def _kind(self, topic: Topic) -> str | None:
        """The type that goes out, None where it is not known."""
        if self._translate is None:
            return topic.type
        found = self._translate.type_of(topic.type)
        return None if found is None else found[0]

    def seconds(self, names: frozenset[str]) -> float:
        """From the first to the last message of some topics."""
        logged = [t.log_ns for t in self._bag.topics.values() if t.name in names and len(t)]
        return (max(map(max, logged)) - min(map(min, logged))) * 1e-9

    def read(self, names: frozenset[str], start_s: float) -> Iterator[Message]:
        first: int | None = None
        holding: dict[tuple[str, int], tuple[Topic, int]] = {}
        for topic, index in self._bag.in_order(names):
            time_ns = topic.log_ns[index]
            if first is None:
                first = time_ns
            if (time_ns - first) * 1e-9 < start_s:
                if topic.name.endswith('/tf_static'):  # each of its own frames
                    holding[topic.name, index] = topic, index
                elif self._kind(topic) == _INFO:
                    holding[topic.name, 0] = topic, index
                continue
            for before in holding.values():
                yield self._message(*before, time_ns)
            holding.clear()
            yield self._message(topic, index, time_ns)

    def _message(self, topic: Topic, index: int, time_ns: int) -> Message:
        data: Any = self._bag.read(topic, index)
        if self._translate is not None:
            try:
                data = bytes(self._translate.data(topic.type, data))
            except RecordingError as error:
                raise RecordingError(
                    f'{self._bag.path}: message {index} of {topic.name}: {error}'
                ) from None
        return Message(topic.name, time_ns, data, self._role(topic.name), topic.stamp_ns[index])

    def _role(self, name: str) -> Role:
        if name == self.color_topic:
            return Role.COLOR
        return Role.DEPTH if name == self.depth_topic else Role.OTHER

    def close(self) -> None:
        if self._recording is not None:
            self._recording.close()
        else:
            self._bag.close()


class _FolderMessages:
    """Messages made of the frames of a sequence folder."""

    warnings: list[str]

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self._recording = SequenceFolder(path, options)
        self.warnings = self._recording.warnings
        info = self._recording.info()
        self._seconds = info.duration_s
        self.color_topic: str | None = FOLDER_TOPICS.color
        self.depth_topic = FOLDER_TOPICS.depth if info.frames_with_depth else None
        self.info_topic = None if info.intrinsics is None else FOLDER_TOPICS.info
        counts = (
            (self.info_topic, _INFO, info.frames),
            (self.color_topic, _IMAGE, info.frames),
            (self.depth_topic, _IMAGE, info.frames_with_depth),
        )
        self.topics = [SourceTopic(name, kind, n) for name, kind, n in counts if name is not None]

    def seconds(self, names: frozenset[str]) -> float:
        """From the first to the last message of some topics: all come with every frame."""
        del names
        return self._seconds

    def read(self, names: frozenset[str], start_s: float) -> Iterator[Message]:
        first: int | None = None
        for frame in self._recording.frames():
            if first is None:
                first = frame.stamp_ns
            if (frame.stamp_ns - first) * 1e-9 < start_s:
                continue
            for topic, kind, role, message in self._of_frame(frame):
                if topic in names:
                    data = bytes(typestore(False).serialize_cdr(message, kind))
                    yield Message(topic, frame.stamp_ns, data, role, frame.stamp_ns)

    def _of_frame(self, frame: Frame) -> Iterator[tuple[str, str, Role, Any]]:
        head = _MAKE.header(frame.stamp_ns, FOLDER_TOPICS.frame_id)
        if frame.intrinsics is not None:
            info = _MAKE.camera_info(head, frame.width, frame.height, frame.intrinsics)
            yield FOLDER_TOPICS.info, _INFO, Role.OTHER, info
        yield FOLDER_TOPICS.color, _IMAGE, Role.COLOR, _MAKE.image(head, encode_color(frame.color))
        if frame.depth is not None:
            yield (
                FOLDER_TOPICS.depth,
                _IMAGE,
                Role.DEPTH,
                _MAKE.image(head, encode_depth(frame.depth)),
            )

    def close(self) -> None:
        self._recording.close()
