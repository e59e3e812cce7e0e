# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""From a pair of messages to published results: what the worker's thread does for each pair.

A message is whatever has the fields of its type; no ROS is needed to make one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

from rgbd_kcf_tracker.errors import ImageError, RgbdKcfError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.insight import Insight
from rgbd_kcf_tracker.live.answer import Answer
from rgbd_kcf_tracker.live.frozen import COLOR_AFTER_NS, LEAST_IMAGES, FrozenDepth, Repeated
from rgbd_kcf_tracker.live.places import CameraPlaces, Places
from rgbd_kcf_tracker.live.session import IDLE, Choice, Session
from rgbd_kcf_tracker.live.settings import RAW
from rgbd_kcf_tracker.live.statistics import Statistics, Times
from rgbd_kcf_tracker.live.timeline import Instant, Timeline
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.recordings.camera_info import Camera
from rgbd_kcf_tracker.recordings.containers import MAX_PIXELS
from rgbd_kcf_tracker.recordings.images import (
    ColorImage,
    DepthImage,
    decode_color,
    decode_compressed_color,
    decode_compressed_depth,
    defer_depth,
)
from rgbd_kcf_tracker.recordings.messages import stamp_of
from rgbd_kcf_tracker.recordings.refused import NO_METRES
from rgbd_kcf_tracker.track import Track, TrackState
from rgbd_kcf_tracker.variants import VARIANTS


@dataclass(frozen=True, slots=True, eq=False)
class Capture:
    """A colour message, its depth message if it has one, and when the pair was complete.

    Attributes:
        color: ``sensor_msgs/Image`` or ``CompressedImage``.
        depth: likewise, or None.
        camera: as known at that time, or None.
        arrival_ns: on the monotonic clock.
    """

    color: Any
    depth: Any | None
    camera: Camera | None
    arrival_ns: int


class Publishers(Protocol):
    """Where the results of a frame go; the node's are the topics."""

    @property
    def image_wanted(self) -> bool:
        """Whether somebody looks at the annotated image."""
        ...

    def publish(self, answer: Answer) -> None:
        """The result of a pair."""
        ...

    def publish_extras(self, answer: Answer) -> None:
        """What is for people to look at, after the result is out."""
        ...


SHORTEST_LOOP = 10
"""Images between two jumps back that make a loop; fewer are a fault of the stamps, as of two
publishers, and nothing begins anew."""


def in_picture(track: Track, frame: Frame) -> Track:
    """The track with the part of its box that lies in the picture; hidden where no part does."""
    box = track.box
    if box is None:
        return track
    shown = box.clipped(frame.width, frame.height)
    if shown == box:
        return track
    if shown is None:
        return replace(track, box=None, state=TrackState.OCCLUDED, score=0.0)
    return replace(track, box=shown)


@dataclass(frozen=True, slots=True, eq=False)
class _Answered:
    """The newest pair, its time and where the camera was, as far as that is known."""

    capture: Capture
    time_ns: int
    pose: Pose | None


class Processor:
    """Decodes what is needed, asks the session, publishes, counts.

    Args:
        session: the target.
        publishers: where results go.
        statistics: where counts go.
        now_ns: the node's clock, for the age of a result.
        fault: told of each fault by kind and in words.
        color_transport, depth_transport: how the images are packed.
        places: where the camera is, None where nobody tells.
        max_pixels: of the largest image that is read.
    """

    def __init__(
        self,
        session: Session,
        publishers: Publishers,
        statistics: Statistics,
        now_ns: Callable[[], int],
        fault: Callable[[str, str], None],
        *,
        color_transport: str = RAW,
        depth_transport: str = RAW,
        places: CameraPlaces | None = None,
        max_pixels: int = MAX_PIXELS,
    ) -> None:
        self.session = session
        self._publishers = publishers
        self._statistics = statistics
        self._now_ns = now_ns
        self._fault = fault
        self._places = places
        self._timeline = Timeline()
        self._repeated, self._frozen = Repeated(), FrozenDepth()
        self._last: _Answered | None = None
        self._frame_id: str | None = None
        self._restarts = self._steady = 0
        self.on_restart: Callable[[], None] | None = None
        self._decode_color: Callable[[Any], ColorImage] = partial(
            decode_color if color_transport == RAW else decode_compressed_color,
            max_pixels=max_pixels,
        )
        self._decode_depth: Callable[..., DepthImage] = partial(
            defer_depth if depth_transport == RAW else decode_compressed_depth,
            max_pixels=max_pixels,
        )

    def __call__(self, capture: Capture) -> None:
        """Answer one pair: there is a result for every pair, whatever is wrong with it."""
        begun = time.monotonic_ns()
        header = capture.color.header
        moment = self._timeline.advance(stamp_of(capture.color), capture.arrival_ns)
        self._notice(header, moment)
        session, image_wanted = self.session, self._publishers.image_wanted
        frame: Frame | None = None
        track = IDLE
        others: tuple[Track, ...] = ()
        insights: Callable[[], Mapping[int, Insight]] | None = None
        places = Places()
        decoded = begun
        if session.needs_frame or image_wanted:
            frame = self.frame(capture, moment.time_ns)
            decoded = time.monotonic_ns()
            track = self._unseen()
            if frame is not None:
                try:
                    if self._places is not None:
                        places = self._places.at(header)
                        frame = replace(frame, pose=places.fixed)
                    track = in_picture(session.process(frame), frame)
                    others = tuple(in_picture(other, frame) for other in session.others)
                    insights = session.insights
                    self._tell_lens(frame, (track, *others))
                    if self._places is not None:
                        places = self._places.judged(places, session.camera_motion)
                except Exception as error:  # a bug in a tracker must not leave a pair unanswered
                    places = Places()
                    self._fault(
                        'internal_errors', f'internal error: {type(error).__name__}: {error}'
                    )
                if self._places is not None and places.fixed is None:
                    frame = replace(frame, pose=None)
        tracked = time.monotonic_ns()
        answer = Answer(
            header,
            track,
            moment.time_ns,
            frame,
            others,
            places.target,
            session.asked_for,
            insights,
        )
        self._publishers.publish(answer)
        published = time.monotonic_ns()
        latency = (self._now_ns() - stamp_of(capture.color)) / 1e6
        work = (published - capture.arrival_ns) / 1e6
        self._statistics.processed(
            Times(
                latency=latency,
                work=work,
                transport=latency - work,
                waiting=(begun - capture.arrival_ns) / 1e6,
                decode=(decoded - begun) / 1e6,
                track=(tracked - decoded) / 1e6,
                publish=(published - tracked) / 1e6,
            )
        )
        self._last = _Answered(capture, moment.time_ns, None if frame is None else frame.pose)
        if frame is not None:
            try:
                session.settle()
            except Exception as error:  # likewise
                self._fault('internal_errors', f'internal error: {type(error).__name__}: {error}')
            self._publishers.publish_extras(answer)

    def _tell_lens(self, frame: Frame, tracks: Iterable[Track]) -> None:
        """Say why there is no position where everything for one is known."""
        lens = frame.intrinsics is not None and frame.intrinsics.lens is not None
        if lens and any(t.box and t.depth is not None and t.position is None for t in tracks):
            self._fault(
                'bad_camera_info',
                'the lens of camera_info cannot be taken out at the target: there is no position',
            )

    def _unseen(self) -> Track:
        """The answer where nothing can be seen: no box, and the target is as it was."""
        last = self.session.track
        hidden = last.state is not TrackState.IDLE
        return Track(None, TrackState.OCCLUDED, id=last.id) if hidden else IDLE

    def choose(self, choice: Choice, oldest_s: float) -> None:
        """Start on the newest image, or the next one where the newest is old or shows nothing."""
        self.session.choose(choice)
        self._start_at_once(oldest_s)

    def add(self, choice: Choice, oldest_s: float) -> None:
        """Likewise for a target beside the others."""
        self.session.add(choice)
        self._start_at_once(oldest_s)

    def _start_at_once(self, oldest_s: float) -> None:
        if self._last is None or not self.session.due:
            return
        last = self._last
        if (time.monotonic_ns() - last.capture.arrival_ns) / 1e9 <= oldest_s:
            with self.session.charged():
                frame = self.frame(last.capture, last.time_ns)
            if frame is not None:
                self.session.start_as_asked(replace(frame, pose=last.pose))

    def frame(self, capture: Capture, time_ns: int) -> Frame | None:
        """The pair as a frame; without depth where that cannot be used; None without a picture."""
        try:
            color = self._decode_color(capture.color)
        except ImageError as error:
            self._fault('bad_color', f'colour image cannot be read: {error}')
            return None
        another = self._repeated.take(capture.color.data, time_ns)
        long = self._repeated.lasted_ns >= COLOR_AFTER_NS
        if another and long and self._repeated.images >= LEAST_IMAGES:
            self._statistics.count('frozen_color')
        depth: DepthImage | None = None
        if capture.depth is not None and self._depth_wanted():
            depth = self._readable_depth(capture.depth, color, time_ns)
        return Frame(color, depth, time_ns, self._fitting(capture.camera, color))

    def _fitting(self, camera: Camera | None, color: ColorImage) -> Intrinsics | None:
        """The intrinsics, if they are for images of this size."""
        if camera is None:
            return None
        height, width = color.shape[:2]
        misfit = camera.misfit(width, height)
        if misfit:
            self._fault('bad_camera_info', f'camera_info {misfit}: it is left out')
            return None
        return camera.intrinsics

    def _depth_wanted(self) -> bool:
        uses = VARIANTS[self.session.variant].uses_depth
        return uses or self.session.choosing

    def _readable_depth(self, message: Any, color: ColorImage, time_ns: int) -> DepthImage | None:
        refused: list[int] = []
        try:
            depth = self._decode_depth(message, refused=refused.append)
            Frame(color, depth)
        except RgbdKcfError as error:
            self._fault('bad_depth', f'depth image cannot be used: {error}')
            return None
        frozen = self._frozen(message.data, color, time_ns)
        # One pixel in 256 is enough to tell an empty image from a sparse one, and metres.
        sample = depth[::16, ::16]
        if not (sample > 0).any() and not (depth > 0).any():
            self._fault(
                'empty_depth',
                'depth image has no reading at all: is the sensor covered, or its 32FC1 no metres?',
            )
        elif frozen:
            self._fault(
                'frozen_depth',
                'the depth driver repeats one image: restart it; until then colour alone counts',
            )
            return None
        elif refused:
            self._fault('odd_depth', f'depth image has numbers that are {NO_METRES}')
        return depth

    def _notice(self, header: Any, moment: Instant) -> None:
        self._steady += 1
        loop = moment.restarted and self._steady >= SHORTEST_LOOP
        # A bag that loops is no fault: it is said once, and counted.
        if moment.jumped and not (loop and self._restarts > 0):
            self._fault(
                'time_jumps',
                'stamps jumped: a looping bag (then this is said once), a camera clock that '
                'was set, or two publishers?',
            )
        if moment.restarted:
            self._restarts, self._steady = self._restarts + 1, 0
            self._statistics.count('restarts')
            if self._places is not None:
                self._places.forget()
            if loop and self.on_restart is not None:
                self.on_restart()
        if self._frame_id is not None and header.frame_id != self._frame_id:
            self._fault(
                'frame_id_changes',
                f'frame_id changed from {self._frame_id!r} to {header.frame_id!r}',
            )
        self._frame_id = header.frame_id
