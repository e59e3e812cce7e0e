# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Bags as recordings: frames in time order, colour with the depth that belongs to it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rgbd_kcf_tracker.errors import ImageError, RecordingError, RgbdKcfError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.bag_cameras import BagCameras
from rgbd_kcf_tracker.recordings.bag_pairing import pair_topics
from rgbd_kcf_tracker.recordings.bag_topics import (
    COMPRESSED,
    INFO,
    POLYGON,
    TRUTH_TOPICS,
    describe_streams,
    look_at_images,
    rate_of,
)
from rgbd_kcf_tracker.recordings.images import (
    ColorImage,
    DepthImage,
    EncodingError,
    decode_color,
    decode_compressed_color,
    decode_compressed_depth,
    decode_depth,
)
from rgbd_kcf_tracker.recordings.messages import box_from_polygon
from rgbd_kcf_tracker.recordings.rawbag import RawBag
from rgbd_kcf_tracker.recordings.recording import (
    NO_DEPTH,
    WITHOUT_DEPTH,
    Closing,
    ReadOptions,
    RecordingInfo,
    once,
)
from rgbd_kcf_tracker.recordings.refused import RefusedReadings
from rgbd_kcf_tracker.recordings.storage import Topic
from rgbd_kcf_tracker.recordings.textfiles import known
from rgbd_kcf_tracker.recordings.topics import ChosenTopics, base_name, choose_topics


class BagRecording(Closing):
    """A :class:`Recording` of a bag of any format; see :class:`RawBag` for what opens.

    Raises:
        RecordingError: where it cannot be read or its topics are not clear.
    """

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self.path = path
        self.name = path.resolve().stem if path.is_file() else path.resolve().name
        self._max_pixels = options.max_pixels
        self.bag = RawBag(path)
        self.warnings: list[str] = list(self.bag.warnings)
        self._warn = once(self.warnings)
        try:
            self._images = look_at_images(self.bag)
            self.topics = self._choose(options)
            if self.topics.depth is None and options.depth_topic != NO_DEPTH:
                self.warnings.append('no depth was recorded: read as colour alone')
            self._color = self.bag.topics[self.topics.color]
            self._depth = None if self.topics.depth is None else self.bag.topics[self.topics.depth]
            self._pairs, told = pair_topics(self._color, self._depth, options.tolerance_s)
            self.warnings += told
            self._cameras = None if options.intrinsics else self._open_cameras(options.rectified)
            self.intrinsics = options.intrinsics
            if self._cameras is not None:
                size = next(i.size for i in self._images if i.name == self.topics.color)
                self.intrinsics = self._cameras.first_for(size)
            self.groundtruth = self._read_truth(TRUTH_TOPICS[0])
            self.groundtruth_body = known(self._read_truth(TRUTH_TOPICS[1]))
        except BaseException:
            self.bag.close()
            raise

    def __len__(self) -> int:
        return len(self._pairs)

    def frames(self, start: int = 0, end: int | None = None) -> Iterator[Frame]:
        """See :meth:`Recording.frames`."""
        odd = RefusedReadings()
        try:
            yield from self._frames(start, end, odd)
        finally:
            odd.tell(self._warn)

    def _frames(self, start: int, end: int | None, odd: RefusedReadings) -> Iterator[Frame]:
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
            depth = None if pair.depth is None else self._read_depth(pair.depth, number, odd)
            camera = self.intrinsics
            if self._cameras is not None:
                logged = self._color.log_ns[pair.color]
                camera = self._cameras.of(logged, (size[1], size[0]), number)
            try:
                yield Frame(color, depth, pair.stamp_ns, camera)
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
            rate_hz=rate_of(stamps),
            streams=describe_streams(self.bag, self._images, self.topics),
            intrinsics=self.intrinsics,
            truth_frames=None if truth is None else sum(b is not None for b in truth),
            warnings=tuple(self.warnings),
        )

    def close(self) -> None:
        """See :meth:`Recording.close`."""
        self.bag.close()

    def _choose(self, options: ReadOptions) -> ChosenTopics:
        topics = self.bag.topics.values()
        return choose_topics(
            self._images,
            [t.name for t in topics if t.type == INFO and len(t)],
            {name: f'in {form!r}, not in cdr: left out' for name, form in self.bag.left_out.items()}
            | {t.name: f'{t.type}, {len(t)} messages' for t in topics},
            str(self.path),
            options.color_topic,
            options.depth_topic,
            options.info_topic,
        )

    def _read_color(self, index: int, number: int) -> ColorImage:
        data: bytes | None = None
        try:
            data = self.bag.read(self._color, index)
            msg = self.bag.deserialize(self._color, data, index)
            decode = decode_compressed_color if _compressed(self._color) else decode_color
            return decode(msg, self._max_pixels)
        except RgbdKcfError as error:
            where = f'{self.path}, frame {number} of {self.topics.color}'
            mend = ' (rgbd-kcf convert writes a bag without what cannot be read)'
            # Messages of ROS 2 are copied as they are, whatever is in them.
            mends = isinstance(error, RecordingError) and (data is None or self.bag.ros1)
            hint = mend if mends else ''
            raise ImageError(f'{where}: {error}{hint}') from None

    def _read_depth(self, index: int, number: int, odd: RefusedReadings) -> DepthImage | None:
        assert self._depth is not None
        try:
            msg = self.bag.message(self._depth, index)
            decode = decode_compressed_depth if _compressed(self._depth) else decode_depth
            return decode(msg, self._max_pixels, odd.of(f'frame {number} of {self.topics.depth}'))
        except RgbdKcfError as error:
            if isinstance(error, EncodingError):
                raise ImageError(
                    f'{self.path}, frame {number} of {self.topics.depth}: {error}'
                ) from None
            self._warn(f'frame {number} of {self.topics.depth} is {WITHOUT_DEPTH}: {error}')
            return None

    def _open_cameras(self, rectified: str) -> BagCameras | None:
        if self.topics.info is None:
            return None
        topic, pictures = self.bag.topics[self.topics.info], base_name(self.topics.color)
        return BagCameras(self.bag, topic, pictures, rectified, self._warn)

    def _read_truth(self, name: str) -> list[Box | None] | None:
        topic = self.bag.topics.get(name)
        if topic is None or topic.type != POLYGON or not len(topic):
            return None
        by_stamp: dict[int, list[tuple[int, int]]] = {}
        for number, pair in enumerate(self._pairs):
            logged = self._color.log_ns[pair.color]
            by_stamp.setdefault(pair.stamp_ns, []).append((logged, number))
        boxes: dict[int, Box | None] = {}
        for index, (stamp, log_ns) in enumerate(zip(topic.stamp_ns, topic.log_ns, strict=True)):
            if stamp not in by_stamp:
                continue
            # A stamp comes again where time jumps back.
            _, frame = min(by_stamp[stamp], key=lambda there: abs(there[0] - log_ns))
            try:
                boxes[frame] = box_from_polygon(self.bag.message(topic, index).polygon.points)
            except RgbdKcfError as error:
                self.warnings.append(f'{name}: message {index} is left out: {error}')
        if not boxes:
            self.warnings.append(f'{name}: its stamps are those of no colour image: left out')
            return None
        last = max(boxes)
        missing = last + 1 - len(boxes)
        if missing:
            self.warnings.append(f'{name}: {missing} frames have no message: taken as absent')
        return [boxes.get(number) for number in range(last + 1)]


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


def _compressed(topic: Topic) -> bool:
    return topic.type == COMPRESSED
