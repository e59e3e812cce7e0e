# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The replay node: a recording on the wire, as if its camera were there."""

from __future__ import annotations

import importlib
import json
import os
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import PolygonStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from rgbd_kcf_tracker.errors import ParameterError, RecordingError
from rgbd_kcf_tracker.live.replay_lockstep import Answers
from rgbd_kcf_tracker.live.replay_message import Message
from rgbd_kcf_tracker.live.replay_pacing import Pacer
from rgbd_kcf_tracker.live.replay_player import Player
from rgbd_kcf_tracker.live.replay_settings import ReplayParameters
from rgbd_kcf_tracker.live.replay_source import ReplaySource
from rgbd_kcf_tracker.live.stopping import Stopping
from rgbd_kcf_tracker.parameters import describe
from rgbd_kcf_tracker.recordings.outputs import check_outputs, write_file
from rgbd_kcf_tracker.ros.messages import stamp_from_ns, stamp_to_ns
from rgbd_kcf_tracker.ros.names import full_name
from rgbd_kcf_tracker.ros.parameters import DECLARE_OVERRIDES, declare_all

SETTLE_S = 0.3
"""From the moment that both sides know of each other to the first image: discovery is one-sided."""
NEWS_PERIOD_S = 5.0


class ReplayNode(Node):
    """Publishes a recording; all that it is told is read when it starts.

    Raises:
        ParameterError: for a parameter that is unknown, of the wrong type or out of range, or a
            name that is none.
    """

    def __init__(self) -> None:
        super().__init__('replay', **DECLARE_OVERRIDES)
        self.parameters = self._read_parameters()
        if self.parameters.answer_topic:
            full_name(self, 'answer_topic', self.parameters.answer_topic, '/tracker/box')
        self._publishers_by_topic: dict[str, Any] = {}
        self._clock_publisher: Any = None
        self._answers: Answers | None = None
        if self.parameters.clock:
            qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
            self._clock_publisher = self.create_publisher(Clock, '/clock', qos)

    def _read_parameters(self) -> ReplayParameters:
        infos = {info.name: info for info in describe(ReplayParameters)}
        declare_all(self, infos, lambda _: True)
        return ReplayParameters(**{name: self.get_parameter(name).value for name in infos})

    def run(self, stop: Stopping) -> None:
        """Replay as the parameters say; returns at the end or soon after ``stop`` is set.

        Raises:
            RecordingError: where the recording cannot be opened or read, or holds no messages, or
                the report cannot be written.
            ParameterError: where nobody listens in lock-step, a topic is not in the recording, or
                the report is there already.
        """
        parameters = self.parameters
        if not parameters.bag:
            raise ParameterError('no recording given: set the parameter bag, as in -p bag:=FILE')
        if parameters.report:
            check_report(parameters.report, parameters.bag, parameters.overwrite)
        try:
            source = ReplaySource(Path(parameters.bag), parameters)
        except RecordingError as error:
            raise RecordingError(as_parameters(str(error))) from None
        with source:
            for warning in source.warnings:
                self.get_logger().warning(as_parameters(warning))
            self._advertise(source)
            answers = Answers(source.depth_topic is not None, parameters.pair_tolerance)
            if parameters.answer_topic and source.color_topic is not None:
                self._answers = answers
                self.create_subscription(
                    PolygonStamped, parameters.answer_topic, self._on_answer, QoSProfile(depth=100)
                )
            elif parameters.lockstep:
                raise ParameterError(
                    f'lockstep needs an answer_topic and a colour topic in {parameters.bag}'
                )
            self._await_subscribers(source, stop)
            if stop.is_set():
                self.get_logger().info('stopped before anything was sent')
            else:
                self._play(source, answers, stop)

    def _advertise(self, source: ReplaySource) -> None:
        parameters = self.parameters
        for topic in source.topics:
            kind = message_class(topic.type)
            if kind is None:
                self.get_logger().warning(
                    f'{topic.name} is not replayed: {topic.type} is not installed'
                )
                continue
            qos = QoSProfile(depth=parameters.qos_depth)
            if parameters.reliability == 'best_effort':
                qos.reliability = ReliabilityPolicy.BEST_EFFORT
            if topic.name.endswith('/tf_static'):
                qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
            self._publishers_by_topic[topic.name] = self.create_publisher(kind, topic.name, qos)
        if not self._publishers_by_topic:
            raise RecordingError(f'{parameters.bag} holds no topic that can be replayed')

    def _on_answer(self, message: PolygonStamped) -> None:
        if self._answers is not None:
            self._answers.answered(stamp_to_ns(message.header.stamp))

    def _await_subscribers(self, source: ReplaySource, stop: Stopping) -> None:
        """Wait until the images are heard, and in lock-step until the tracker can answer."""
        parameters = self.parameters
        names = [n for n in (source.color_topic, source.depth_topic) if n is not None]
        publishers = [self._publishers_by_topic[n] for n in names if n in self._publishers_by_topic]
        if not publishers:
            publishers = list(self._publishers_by_topic.values())[:1]

        def heard() -> bool:
            if not all(p.get_subscription_count() for p in publishers):
                return False
            return not parameters.lockstep or bool(self.count_publishers(parameters.answer_topic))

        topics = ', '.join(p.topic_name for p in publishers)
        deadline = time.monotonic() + parameters.wait_for_subscribers
        news = time.monotonic() + 1.0
        while not heard():
            now = time.monotonic()
            if now >= deadline:
                if parameters.lockstep:
                    raise ParameterError(
                        f'nobody subscribes to {topics} and answers on {parameters.answer_topic}: '
                        + (self._answer_hint() or 'start the tracker with its inputs remapped')
                    )
                if parameters.wait_for_subscribers:
                    self.get_logger().warning(f'nobody subscribes to {topics}: playing anyway')
                return
            if now >= news:
                self.get_logger().info(f'waiting for a subscriber to {topics}')
                news = now + NEWS_PERIOD_S
            if stop.wait(0.02):
                return
        stop.wait(SETTLE_S)

    def _answer_hint(self) -> str:
        """Where trackers of another name or namespace answer, if that is not the answer_topic."""
        if self.count_publishers(self.parameters.answer_topic):
            return ''
        kind = 'geometry_msgs/msg/PolygonStamped'
        heard = [
            name
            for name, types in self.get_topic_names_and_types()
            if kind in types and name.endswith('/box') and self.count_publishers(name)
        ]
        return f'set answer_topic, for there is {", ".join(sorted(heard))}' if heard else ''

    def _play(self, source: ReplaySource, answers: Answers, stop: Stopping) -> None:
        parameters = self.parameters
        info = source.first_info() if parameters.lockstep else None
        player = Player(
            self._send,
            Pacer(0.0 if parameters.lockstep else parameters.rate),
            answers,
            lockstep=parameters.lockstep,
            answer_timeout_s=parameters.answer_timeout,
            info=info,
            tick=self._tick,
            warn=self.get_logger().warning,
        )
        self.get_logger().info(
            f'replaying {source.name}: {len(source)} messages, '
            + ', '.join(p.topic_name for p in self._publishers_by_topic.values())
        )
        if info is not None:
            # Drivers send it with every image; a recording may hold it after the images that a
            # tracker answers only with it.
            self._send(info)
        started = time.monotonic()
        while player.play(source.messages(parameters.start), stop) and parameters.loop:
            pass
        seconds = time.monotonic() - started
        if not stop.is_set():
            # The last images may still be on their way, and their answers too.
            for publisher in self._publishers_by_topic.values():
                if parameters.reliability == 'reliable':
                    publisher.wait_for_all_acked(Duration(seconds=1))
            if self._answers is not None and self.count_publishers(parameters.answer_topic):
                answers.drain(1.0, stop)
        answers.give_up()
        figures = figures_of(player, answers, seconds)
        self.get_logger().info(summary(figures))
        hint = self._answer_hint() if parameters.answer_topic and not figures['answers'] else ''
        if hint:
            self.get_logger().warning(f'no answers on {parameters.answer_topic}: {hint}')
        if parameters.report:
            text = json.dumps(figures, indent=2) + '\n'
            write_file(parameters.report, text.encode(), parameters.overwrite)

    def _send(self, message: Message) -> None:
        publisher = self._publishers_by_topic.get(message.topic)
        if publisher is not None:
            publisher.publish(message.data)

    def _tick(self, time_ns: int) -> None:
        if self._clock_publisher is not None:
            self._clock_publisher.publish(Clock(clock=stamp_from_ns(time_ns)))


def as_parameters(text: str) -> str:
    """What readers say of the command line's options, as the node and launch files take them."""
    text = re.sub(r'--(color|depth|info)-topic (/\S+|none)', r'the parameter \1_topic:=\2', text)
    return re.sub(r'--(color|depth|info)-topic', r'the parameter \1_topic:=TOPIC', text)


def message_class(name: str) -> Any | None:
    """The class of a message type such as ``sensor_msgs/msg/Image``, None where not installed."""
    package, _, rest = name.partition('/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), rest.removeprefix('msg/'))
    except (ImportError, AttributeError, ValueError):
        return None


def figures_of(player: Player, answers: Answers, seconds: float) -> dict[str, Any]:
    """The figures of a run, as the report holds them; times in milliseconds, rates in Hz."""
    progress = player.progress
    figures: dict[str, Any] = {
        'messages': progress.messages,
        'color_images': progress.colors,
        'depth_images': progress.depths,
        'pairs': answers.pairs,
        'answers': answers.heard,
        'unanswered': answers.unanswered,
        'sent_again': progress.repeated,
        'rounds': progress.rounds,
        'seconds': round(seconds, 3),
        'rate_hz': round(progress.colors / seconds, 2) if seconds > 0 else None,
        'latency_ms': None,
    }
    if answers.latencies_s:
        milliseconds = np.asarray(answers.latencies_s) * 1e3
        p50, p95, p99 = np.percentile(milliseconds, [50, 95, 99])
        figures['latency_ms'] = {
            'median': round(float(p50), 2),
            'p95': round(float(p95), 2),
            'p99': round(float(p99), 2),
            'max': round(float(milliseconds.max()), 2),
        }
    return figures


def summary(figures: dict[str, Any]) -> str:
    """The figures of a run in one line."""
    text = (
        f'{figures["messages"]} messages in {figures["seconds"]:.1f} s, '
        f'{figures["color_images"]} colour and {figures["depth_images"]} depth images'
    )
    latency = figures['latency_ms']
    if latency is None:
        return text + ', no answers heard'
    return (
        f'{text}; {figures["answers"]} of {figures["pairs"]} answered, '
        f'latency median {latency["median"]:.1f} ms, p99 {latency["p99"]:.1f} ms'
    )


def check_report(report: str, bag: str, overwrite: bool) -> None:
    """Refuse, before anything is replayed, a report that must not or cannot be written.

    Raises:
        RecordingError: where it cannot be, is the recording or lies in it.
        ParameterError: where it is there already.
    """
    check_outputs({'report': report}, [bag], overwrite=True)
    if os.path.exists(report) and not overwrite:
        raise ParameterError(
            f'report {report} is there already: give another name, or set overwrite to replace it, '
            'as in -p overwrite:=true'
        )
