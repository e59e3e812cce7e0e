# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Bags as recordings: frames in time order, colour with the depth that belongs to it."""

from __future__ import annotations

import statistics
from array import array
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Any

from rgbd_kcf_tracker.errors import ImageError, RecordingError, RgbdKcfError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.containers import JPEG, inspect, sniff
from rgbd_kcf_tracker.recordings.images import (
    COLOR_ENCODINGS,
    DEPTH_ENCODINGS,
    ColorImage,
    DepthImage,
    as_bytes,
    decode_color,
    decode_compressed_color,
    decode_compressed_depth,
    decode_depth,
)
from rgbd_kcf_tracker.recordings.messages import (
    box_from_polygon,
    intrinsics_from_info,
)
from rgbd_kcf_tracker.recordings.pairing import DEFAULT_TOLERANCE_S, Pair, StampPairer
from rgbd_kcf_tracker.recordings.rawbag import RawBag
from rgbd_kcf_tracker.recordings.recording import ReadOptions, RecordingInfo, StreamInfo
from rgbd_kcf_tracker.recordings.storage import Topic
from rgbd_kcf_tracker.recordings.textfiles import known
from rgbd_kcf_tracker.recordings.topics import ChosenTopics, ImageTopic, choose_topics

TRUTH_TOPICS = ('/groundtruth/visible', '/groundtruth/body')
_IMAGE, _COMPRESSED = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'
_INFO, _POLYGON = 'sensor_msgs/msg/CameraInfo', 'geometry_msgs/msg/PolygonStamped'
_WIDEST_S = 0.5
_JUMP_NS = 1_000_000_000

FramePair = Pair[int, int]


class BagRecording:
    """A :class:`Recording` of a bag of any format; see :class:`RawBag` for what opens.

    Raises:
        RecordingError: where it cannot be read or its topics are not clear.
    """

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self.path = path
        self.name = path.resolve().stem if path.is_file() else path.resolve().name
        self.bag = RawBag(path)
        self.warnings: list[str] = list(self.bag.warnings)
        try:
            self._images = look_at_images(self.bag)
            self.topics = self._choose(options)
            self._color = self.bag.topics[self.topics.color]
            self._depth = None if self.topics.depth is None else self.bag.topics[self.topics.depth]
            self._pairs = self._pair(options)
            self.intrinsics = options.intrinsics or self._read_intrinsics()
            self.groundtruth = self._read_truth(TRUTH_TOPICS[0])
            self.groundtruth_body = known(self._read_truth(TRUTH_TOPICS[1]))
        except BaseException:
            self.bag.close()
            raise
        self._warned: set[str] = set()

    def __len__(self) -> int:
        return len(self._pairs)

    def frames(self, start: int = 0, end: int | None = None) -> Iterator[Frame]:
        """See :meth:`Recording.frames`."""
        size: tuple[int, int] | None = None
        stop = len(self) if end is None else min(end, len(self))
        for number in range(max(start, 0), stop):
            pair = self._pairs[number]
            color = self._read_color(pair.color, number)
            if size is not None and color.shape[:2] != size:
                self._warn(
                    f'colour image changes from {size[1]}x{size[0]} to '
                    f'{color.shape[1]}x{color.shape[0]} at frame {number}'
                )
            size = color.shape[0], color.shape[1]
            depth = None if pair.depth is None else self._read_depth(pair.depth, number)
            try:
                yield Frame(color, depth, pair.stamp_ns, self.intrinsics)
            except ImageError as error:
                raise ImageError(
                    f'{self.path}, frame {number} ({self.topics.color} with {self.topics.depth}): '
                    f'{error}'
                ) from None

    def frame_id(self) -> str:
        """The coordinate frame of the colour images."""
        return str(self.bag.message(self._color, 0).header.frame_id) if len(self._color) else ''

    def depth_encoding(self) -> str:
        """Encoding of the depth images, as the message names it; '' without depth."""
        return next((i.encoding for i in self._images if i.name == self.topics.depth), '')

    def info(self) -> RecordingInfo:
        """See :meth:`Recording.info`."""
        stamps = [p.stamp_ns for p in self._pairs]
        truth = self.groundtruth
        return RecordingInfo(
            path=self.path,
            kind=self.bag.kind,
            frames=len(self),
            frames_with_depth=sum(p.depth is not None for p in self._pairs),
            duration_s=(max(stamps) - min(stamps)) / 1e9 if stamps else 0.0,
            rate_hz=_rate(stamps),
            streams=describe_streams(self.bag, self._images, self.topics),
            intrinsics=self.intrinsics,
            truth_frames=None if truth is None else sum(b is not None for b in truth),
            warnings=tuple(self.warnings),
        )

    def close(self) -> None:
        """See :meth:`Recording.close`."""
        self.bag.close()

    def __enter__(self) -> BagRecording:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _choose(self, options: ReadOptions) -> ChosenTopics:
        topics = self.bag.topics.values()
        return choose_topics(
            self._images,
            [t.name for t in topics if t.type == _INFO and len(t)],
            {t.name: f'{t.type}, {len(t)} messages' for t in topics},
            str(self.path),
            options.color_topic,
            options.depth_topic,
            options.info_topic,
        )

    def _pair(self, options: ReadOptions) -> list[FramePair]:
        color_stamps = self._stamps(self._color)
        if self._depth is None:
            depth_stamps = array('q')
        else:
            depth_stamps = self._stamps(self._depth)
            if (color_stamps is self._color.log_ns) != (depth_stamps is self._depth.log_ns):
                color_stamps, depth_stamps = self._color.log_ns, self._depth.log_ns
        events = _in_time_order(
            (color_stamps, self._color.log_ns),
            (depth_stamps, array('q') if self._depth is None else self._depth.log_ns),
        )
        tolerance = DEFAULT_TOLERANCE_S if options.tolerance_s is None else options.tolerance_s
        pairs, pairer = _run_pairer(events, tolerance)
        if options.tolerance_s is None and depth_stamps and all(p.depth is None for p in pairs):
            wider, wider_pairer = _run_pairer(events, _WIDEST_S)
            distances = [
                abs(p.depth_stamp_ns - p.stamp_ns) for p in wider if p.depth_stamp_ns is not None
            ]
            if distances:
                pairs, pairer = wider, wider_pairer
                self.warnings.append(
                    f'no depth image is within {tolerance * 1e3:g} ms of a colour image: paired '
                    f'up to {max(distances) / 1e6:.0f} ms apart (set the limit with --tolerance)'
                )
        self._warn_of_pairing(pairs, pairer)
        return pairs

    def _stamps(self, topic: Topic) -> array[int]:
        stamps = topic.stamp_ns
        if (len(stamps) > 1 and len(set(stamps)) == 1) or not any(stamps):
            self.warnings.append(
                f'{topic.name}: all stamps are {stamps[0] if stamps else 0}: '
                'the time of recording is taken'
            )
            return topic.log_ns
        return stamps

    def _warn_of_pairing(self, pairs: list[FramePair], pairer: StampPairer[int, int]) -> None:
        counts = pairer.counts
        if counts.jumps_back:
            self.warnings.append(
                f'time jumps back {counts.jumps_back} times in {self.topics.color}: '
                'frames stay in the order of recording there'
            )
        if counts.duplicates:
            self.warnings.append(
                f'{counts.duplicates} images have a stamp that was there before and are left out'
            )
        if self._depth is None:
            return
        alone = sum(p.depth is None for p in pairs)
        if alone:
            self.warnings.append(
                f'{alone} of {len(pairs)} colour images have no depth image near enough '
                'and are read without depth'
            )
        if counts.depth_alone:
            self.warnings.append(f'{counts.depth_alone} depth images belong to no colour image')

    def _read_color(self, index: int, number: int) -> ColorImage:
        try:
            msg = self.bag.message(self._color, index)
            return decode_compressed_color(msg) if _compressed(self._color) else decode_color(msg)
        except RgbdKcfError as error:
            where = f'{self.path}, frame {number} of {self.topics.color}'
            mend = ' (rgbd-kcf convert writes a bag without what cannot be read)'
            hint = mend if isinstance(error, RecordingError) else ''
            raise ImageError(f'{where}: {error}{hint}') from None

    def _read_depth(self, index: int, number: int) -> DepthImage | None:
        assert self._depth is not None
        try:
            msg = self.bag.message(self._depth, index)
            return decode_compressed_depth(msg) if _compressed(self._depth) else decode_depth(msg)
        except RgbdKcfError as error:
            if number == 0 or 'unknown depth encoding' in str(error):
                raise ImageError(
                    f'{self.path}, frame {number} of {self.topics.depth}: {error}'
                ) from None
            self._warn(f'frame {number} of {self.topics.depth} is read without depth: {error}')
            return None

    def _warn(self, text: str) -> None:
        if text not in self._warned:
            self._warned.add(text)
            self.warnings.append(text)

    def _read_intrinsics(self) -> Intrinsics | None:
        if self.topics.info is None:
            return None
        topic = self.bag.topics[self.topics.info]
        size = next(i.size for i in self._images if i.name == self.topics.color)
        try:
            msg = self.bag.message(topic, 0)
            found = intrinsics_from_info(msg)
        except RgbdKcfError as error:
            self.warnings.append(f'{topic.name}: {error}')
            return None
        told = int(msg.width), int(msg.height)
        if found is None:
            self.warnings.append(f'{topic.name} holds zeros: the camera is not calibrated')
        elif size is not None and all(told) and told != size:
            self.warnings.append(
                f'{topic.name} is for {told[0]}x{told[1]} images but these are '
                f'{size[0]}x{size[1]}: left out'
            )
            return None
        return found

    def _read_truth(self, name: str) -> list[Box | None] | None:
        topic = self.bag.topics.get(name)
        if topic is None or topic.type != _POLYGON or not len(topic):
            return None
        boxes: dict[int, Box | None] = {}
        for index, stamp in enumerate(topic.stamp_ns):
            try:
                boxes[stamp] = box_from_polygon(self.bag.message(topic, index).polygon.points)
            except RgbdKcfError as error:
                self.warnings.append(f'{name}: message {index} is left out: {error}')
        by_frame = [p.stamp_ns in boxes for p in self._pairs]
        last = max((i for i, there in enumerate(by_frame) if there), default=-1)
        if last < 0:
            self.warnings.append(f'{name}: its stamps are those of no colour image: left out')
            return None
        missing = by_frame[: last + 1].count(False)
        if missing:
            self.warnings.append(f'{name}: {missing} frames have no message: taken as absent')
        return [boxes.get(p.stamp_ns) for p in self._pairs[: last + 1]]


def describe_bag(path: Path, problem: str) -> RecordingInfo:
    """What is in a bag that gives no frames, and why it does not.

    Raises:
        RecordingError: where it is no bag or cannot be read.
    """
    bag = RawBag(path)
    try:
        logged = [t for topic in bag.topics.values() for t in topic.log_ns]
        return RecordingInfo(
            path=path,
            kind=bag.kind,
            frames=0,
            frames_with_depth=0,
            duration_s=(max(logged) - min(logged)) / 1e9 if logged else 0.0,
            rate_hz=None,
            streams=describe_streams(bag, look_at_images(bag), None),
            problem=problem,
            warnings=tuple(bag.warnings),
        )
    finally:
        bag.close()


def look_at_images(bag: RawBag) -> list[ImageTopic]:
    """:func:`look_at` for every image topic with messages."""
    return [
        look_at(bag, topic)
        for topic in bag.topics.values()
        if topic.type in (_IMAGE, _COMPRESSED) and len(topic)
    ]


def look_at(bag: RawBag, topic: Topic) -> ImageTopic:
    """What the first message of an image topic tells of it."""
    by_name = 'depth' if 'depth' in topic.name else 'color'
    try:
        msg = bag.message(topic, 0)
        if topic.type == _IMAGE:
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
    head = inspect(data)
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
                _rate(topic.log_ns),
                None if image is None else image.size,
                '' if image is None else image.encoding,
                roles.get(topic.name, ''),
            )
        )
    return tuple(streams)


def _compressed(topic: Topic) -> bool:
    return topic.type == _COMPRESSED


def _rate(stamps: Any) -> float | None:
    gaps = [b - a for a, b in pairwise(stamps) if b > a]
    return 1e9 / statistics.median(gaps) if gaps else None


def _run_pairer(
    events: list[tuple[bool, int, int]], tolerance_s: float
) -> tuple[list[FramePair], StampPairer[int, int]]:
    pairer: StampPairer[int, int] = StampPairer(tolerance_s, capacity=1000, max_wait_s=60.0)
    pairs: list[FramePair] = []
    for is_color, stamp, index in events:
        pairs += pairer.add_color(stamp, index) if is_color else pairer.add_depth(stamp, index)
    return pairs + pairer.flush(), pairer


def _in_time_order(
    color: tuple[array[int], array[int]], depth: tuple[array[int], array[int]]
) -> list[tuple[bool, int, int]]:
    """``(is colour, stamp, index)`` of both streams, by stamp between the jumps back of time.

    Messages that changed places while they were recorded are put right; where time jumps back (a
    bag of a bag that looped) what comes after stays after.
    """
    streams = []
    for is_color, (stamps, logged) in ((True, color), (False, depth)):
        segments = _segments(stamps)
        streams.append(
            [(segments[i], stamps[i], is_color, i, logged[i]) for i in range(len(stamps))]
        )
    counts = [stream[-1][0] if stream else None for stream in streams]
    events = streams[0] + streams[1]
    if None in counts or counts[0] == counts[1]:
        events.sort(key=lambda e: (e[0], e[1], e[2]))
    else:
        events.sort(key=lambda e: (e[4], e[2]))
    return [(is_color, stamp, index) for _, stamp, is_color, index, _ in events]


def _segments(stamps: array[int]) -> list[int]:
    segment, newest = 0, -(1 << 62)
    out = []
    for stamp in stamps:
        if stamp < newest - _JUMP_NS:
            segment += 1
            newest = stamp
        newest = max(newest, stamp)
        out.append(segment)
    return out
