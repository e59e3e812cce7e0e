# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The page over a running tracker: a node of its own that only listens and asks.

It subscribes to the images, and to why the tracker decides as it does, while somebody looks, and to
nothing larger than answers in words while nobody does, in another process than the tracker, which
neither waits for it nor knows of it.
"""

from __future__ import annotations

import queue
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from std_msgs.msg import UInt32

from rgbd_kcf_tracker.errors import ParameterError, RgbdKcfError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.live.settings import RAW
from rgbd_kcf_tracker.metric.pointing import target_at
from rgbd_kcf_tracker.parameters import describe
from rgbd_kcf_tracker.recordings.camera_info import Camera, camera_from_info
from rgbd_kcf_tracker.recordings.evidence_messages import evidence_of
from rgbd_kcf_tracker.recordings.images import (
    decode_color,
    decode_compressed_color,
    decode_compressed_depth,
    decode_depth,
)
from rgbd_kcf_tracker.recordings.messages import stamp_of, tracks_of_state
from rgbd_kcf_tracker.recordings.pairing import DEFAULT_TOLERANCE_S
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages
from rgbd_kcf_tracker.ros.messages import ROS_TYPES
from rgbd_kcf_tracker.ros.names import tracker_topics
from rgbd_kcf_tracker.ros.parameters import DECLARE_OVERRIDES, declare_all
from rgbd_kcf_tracker.ros.subscriptions import CAMERA_INFO, COLOR, DEPTH
from rgbd_kcf_tracker.variants import default_parameters
from rgbd_kcf_tracker.view.commands import Command
from rgbd_kcf_tracker.view.live_page import (
    EVERYONE,
    LivePage,
    ViewerParameters,
    node_parameter,
)

LIGHT = QoSProfile(depth=20, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Of answers in words: a page that is late shows the newest."""
POLL_S, SETTINGS_S = 0.05, 2.0
"""Between two looks at what the browsers ask, and at the tracker's settings."""
LINGER_S = 3.0
"""Seconds after the last browser has gone in which the images are still listened to."""
PAIR_NS = round(DEFAULT_TOLERANCE_S * 1e9)
"""Between the stamps of an image and its depth at the most. A page shows what there is: it waits
for no pair to be sure, as a :class:`StampPairer` does."""
_MAKE = TrackMessages(ROS_TYPES)
HELD = 6
"""Images that are kept for their partner and their answer."""


class ViewerNode(Node):
    """Listens to a tracker node for the page.

    Args:
        options: passed on to rclpy's node.

    Attributes:
        page: what the server serves.
        settings: the parameters, read once.

    Raises:
        ParameterError: for a parameter that cannot be.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__('viewer', **options, **DECLARE_OVERRIDES)
        infos = {info.name: info for info in describe(ViewerParameters)}
        declare_all(self, infos, lambda _: True)
        self.settings = ViewerParameters(**{name: self.get_parameter(name).value for name in infos})
        tracker = tracker_topics(self, self.settings.tracker)
        # Its full name, as diagnostics and messages to people have it.
        self._tracker = self.resolve_topic_name(f'{tracker}/state').removesuffix('/state')
        self.page = LivePage(self._tracker.lstrip('/'), self.settings.rate)
        told: Any = self._on_state  # what DDS says of a message is not in rclpy's types
        self.create_subscription(DiagnosticArray, f'{tracker}/state', told, LIGHT)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        self._init = self.create_publisher(RegionOfInterest, f'{tracker}/init', 10)
        self._add = self.create_publisher(RegionOfInterest, f'{tracker}/add', 10)
        self._remove = self.create_publisher(UInt32, f'{tracker}/remove', 10)
        self._remote = AsyncParameterClient(self, tracker)
        self._evidence = f'{tracker}/evidence'
        self._looked_at: list[Any] = []
        self._depths: dict[int, Any] = {}
        self._colors: dict[int, Any] = {}
        # Those that waited for their depth in vain: while there are any, no other waits.
        self._alone: dict[int, Any] = {}
        self._camera: Camera | None = None
        self._unwatched = 0.0
        self._number = 0  # of the last answer, as its publisher counts
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(POLL_S, self._poll, clock=steady)
        self.create_timer(SETTINGS_S, self._ask_settings, clock=steady)

    # -- what comes -------------------------------------------------------------------------------

    def _on_state(self, message: DiagnosticArray, info: Mapping[str, Any]) -> None:
        # Who is configured anew publishes anew, within less time than diagnostics take to tell.
        number = info['publication_sequence_number'] or 0  # None where DDS tells none
        if 0 < number <= self._number:
            self.page.begin_anew()
        self._number = number
        with suppress(RgbdKcfError):  # of somebody else's
            self.page.answer(stamp_of(message), tracks_of_state(message))
        self._show_what_is_due()

    def _on_evidence(self, message: DiagnosticArray) -> None:
        with suppress(RgbdKcfError):  # of somebody else's
            self.page.evidence(stamp_of(message), evidence_of(message))
        self._show_what_is_due()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name.partition(':')[0].strip('/ ') == self._tracker.strip('/'):
                self.page.figures({pair.key: pair.value for pair in status.values})

    def _on_info(self, message: CameraInfo) -> None:
        try:
            camera = camera_from_info(
                message, self.resolve_topic_name(COLOR), self.settings.color_rectified
            )
        except RgbdKcfError:
            return
        if camera is not None:
            self._camera = camera

    def _on_color(self, message: Any) -> None:
        self._hold(self._colors, message)
        # Else its own comes, while that of the one before may be near enough.
        if self._alone or not self._depths:
            self._show_what_is_due()

    def _on_depth(self, message: Any) -> None:
        self._hold(self._depths, message)
        missed = [s for s in self._alone if abs(s - stamp_of(message)) <= PAIR_NS]
        if missed:  # it comes again: that image is shown once more, and the next ones wait
            self._colors = {missed[-1]: self._alone[missed[-1]]} | self._colors
        self._show_what_is_due()

    @staticmethod
    def _hold(held: dict[int, Any], message: Any) -> None:
        held[stamp_of(message)] = message
        if len(held) > HELD:
            del held[next(iter(held))]

    # -- what is shown ----------------------------------------------------------------------------

    def _poll(self) -> None:
        self._listen_or_not()
        while True:
            try:
                command = self.page.commands.get_nowait()
            except queue.Empty:
                break
            try:
                self._carry_out(command)
            except RgbdKcfError as error:
                self.page.say(str(error))
        self._show_what_is_due()

    def _listen_or_not(self) -> None:
        """Subscribe to what is large when somebody looks, and no more a while after all have gone.

        That is the images, and why the tracker decided as it did.
        """
        if self.page.board.watched:
            self._unwatched = 0.0
            if not self._looked_at:
                self._listen()
            return
        self._unwatched += POLL_S
        if self._looked_at and self._unwatched >= LINGER_S:
            for made in self._looked_at:
                self.destroy_subscription(made)
            self._looked_at.clear()
            for held in (self._colors, self._depths, self._alone):
                held.clear()

    def _listen(self) -> None:
        qos = QoSProfile(
            history=HistoryPolicy.KEEP_LAST, depth=2, reliability=ReliabilityPolicy.BEST_EFFORT
        )
        for topic, transport, callback in (
            (COLOR, self.settings.color_transport, self._on_color),
            (DEPTH, self.settings.depth_transport, self._on_depth),
        ):
            kind, name = (Image, topic)
            if transport != RAW:
                kind, name = CompressedImage, f'{self.resolve_topic_name(topic)}/{transport}'
            self._looked_at.append(self.create_subscription(kind, name, callback, qos))
        self._looked_at += [
            self.create_subscription(CameraInfo, CAMERA_INFO, self._on_info, qos),
            self.create_subscription(DiagnosticArray, self._evidence, self._on_evidence, LIGHT),
        ]

    def _show_what_is_due(self) -> None:
        if self._colors and self.page.due():
            self._show()

    def _show(self) -> None:
        """The newest image that has its depth and its answer; the newest of all where none has."""
        paired = [s for s in self._colors if self._depth_of(s) is not None]
        answered = [s for s in paired or self._colors if self.page.complete(s)]
        if not answered and self.page.answering and len(self._colors) < HELD:
            return  # its answer may still come
        stamp = max(answered or paired or self._colors)
        depth = self._depth_of(stamp)
        color = self._colors[stamp]
        if depth is not None:
            self._alone.clear()
        elif self._depths:
            if not self._alone and len(self._colors) < HELD:
                return  # its depth may still come
            self._hold(self._alone, color)
        for held in list(self._colors):  # those that came later may be answered for the next moment
            del self._colors[held]
            if held == stamp:
                break
        raw = self.settings.color_transport == RAW
        try:
            image = decode_color(color) if raw else decode_compressed_color(color)
        except RgbdKcfError as error:
            self.page.say(f'colour image cannot be read: {error}')
            return
        self.page.image(self._frame(image, depth, stamp), stamp)

    def _depth_of(self, stamp: int) -> Any:
        nearest = min(self._depths, key=lambda s: abs(s - stamp), default=None)
        return None if nearest is None or abs(nearest - stamp) > PAIR_NS else self._depths[nearest]

    def _frame(self, color: Any, depth: Any, stamp: int) -> Frame:
        height, width = color.shape[:2]
        camera = None
        if self._camera is not None and not self._camera.misfit(width, height):
            camera = self._camera.intrinsics
        if depth is not None:
            raw = self.settings.depth_transport == RAW
            try:
                metres = decode_depth(depth) if raw else decode_compressed_depth(depth)
                return Frame(color, metres, stamp, camera)
            except RgbdKcfError as error:
                self.page.say(f'depth image cannot be used: {error}')
        return Frame(color, None, stamp, camera)

    # -- what is asked ----------------------------------------------------------------------------

    def _carry_out(self, command: Command) -> None:
        values = command.values
        if command.do == 'box':
            box = Box(*(values[name] for name in ('x', 'y', 'width', 'height')))
            self._request(self._add, self._region(box))
        elif command.do == 'point':
            if self.page.frame is None:
                raise ParameterError('no picture has come yet')
            box = target_at(self.page.frame, values['x'], values['y'])
            self._request(self._add, self._region(box))
        elif command.do == 'follow':
            # A new choice of one who is followed already keeps its id.
            self._request(self._init, self._region(self.page.box_of(values['id'])))
        elif command.do == 'remove':
            if not 0 <= values['id'] < 2**32:
                raise ParameterError(f'there is no target {values["id"]}')
            self._request(self._remove, UInt32(data=values['id']))
        elif command.do == 'rename':
            self.page.rename(values['id'], values['name'])
        elif command.do == 'everyone':
            self._set([Parameter(EVERYONE, value=values['value'])])
        elif command.do in ('variant', 'parameter'):
            name, value = node_parameter(command, self.page.variant)
            self._set([Parameter(name, value=value)])
        elif command.do == 'defaults':
            variant = self.page.variant
            defaults = default_parameters(variant)
            self._set(
                [
                    Parameter(f'{variant}.{i.name}', value=getattr(defaults, i.name))
                    for i in describe(type(defaults))
                ]
            )
        else:
            raise ParameterError(f'{command.do} is for recordings: this is live')

    def _region(self, box: Box) -> RegionOfInterest:
        """A box as the tracker takes it: the part of it that lies in the picture.

        Raises:
            ParameterError: where there is no picture, or no part of the box lies in it.
        """
        frame = self.page.frame
        if frame is None:
            raise ParameterError('no picture has come yet')
        region = _MAKE.region(box, frame.width, frame.height)
        if region is None:
            raise ParameterError('that box lies outside the picture')
        return region

    def _request(self, publisher: Any, message: Any) -> None:
        self._require(publisher.get_subscription_count() > 0)
        publisher.publish(message)

    def _require(self, heard: bool) -> None:
        """Say on the page that nobody hears what is asked there."""
        if not heard:
            raise ParameterError(f'{self._tracker} does not answer: is it running?')

    def _set(self, parameters: list[Parameter]) -> None:
        self._require(self._remote.services_are_ready())
        self._remote.set_parameters(parameters, callback=self._was_set)

    def _was_set(self, future: Any) -> None:
        refused = [r.reason for r in future.result().results if not r.successful]
        if refused:
            self.page.say(refused[0])
        self._ask_settings()

    def _ask_settings(self) -> None:
        """Ask the tracker for its parameters while somebody looks."""
        if not self.page.board.watched or not self._remote.services_are_ready():
            return
        variant = self.page.variant
        names = ['variant', EVERYONE]
        names += [f'{variant}.{i.name}' for i in describe(type(default_parameters(variant)))]

        def told(future: Any) -> None:
            told_values = future.result().values
            if len(told_values) == len(names):
                self.page.values = {
                    name: parameter_value_to_python(value)
                    for name, value in zip(names, told_values, strict=True)
                }

        self._remote.get_parameters(names, callback=told)
