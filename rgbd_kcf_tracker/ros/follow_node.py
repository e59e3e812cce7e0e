# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Asks Nav2's Following Server to follow the target, and to stop: a node that drives nothing."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import PolygonStamped
from rclpy.action import ActionClient
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.live.following import Following, FollowParameters
from rgbd_kcf_tracker.parameters import describe
from rgbd_kcf_tracker.ros.names import full_name, tracker_topics
from rgbd_kcf_tracker.ros.parameters import DECLARE_OVERRIDES, declare_all
from rgbd_kcf_tracker.ros.unheard import unheard

PERIOD_S = 0.1
SAY_AGAIN_S = 10.0
SILENCE_S = 3.0
"""Seconds without an answer after which it is said why: a tracker takes two to start."""
ASKING_S = 5.0
"""Seconds for which the server may think about a goal."""
ANSWER_S = 0.5
"""Seconds for which a node that ends waits to be told whether its goal was accepted."""
HOMES = ('nav2_msgs.action', 'opennav_following_msgs.action')
"""Packages that have had the action FollowObject, the newer first."""


def action_type() -> Any:
    """The action ``FollowObject``, wherever it is installed.

    Raises:
        RgbdKcfError: where it is not.
    """
    for home in HOMES:
        try:
            return import_module(home).FollowObject
        except (ImportError, AttributeError):
            continue
    raise RgbdKcfError(
        f'no action FollowObject in {" or ".join(HOMES)}: install Nav2 with its Following Server '
        '(sudo apt install ros-$ROS_DISTRO-navigation2 ros-$ROS_DISTRO-opennav-following)'
    )


class FollowNode(Node):
    """Listens to a tracker, and keeps one goal of the action alive while its target is there.

    Args:
        action: the action's type, None for that which is installed.
        client: makes the client of the action; rclpy's by default.
        options: passed on to rclpy's node.

    Raises:
        ParameterError: for a parameter that cannot be.
        RgbdKcfError: where the action is not installed.
    """

    def __init__(
        self,
        action: Any = None,
        client: Callable[[Node, Any, str], Any] = ActionClient,
        **options: Any,
    ) -> None:
        super().__init__('follow', **options, **DECLARE_OVERRIDES)
        infos = {info.name: info for info in describe(FollowParameters)}
        declare_all(self, infos, lambda _: True)
        given = {name: self.get_parameter(name).value for name in infos}
        self.settings = FollowParameters(**given)
        self.following = Following(self.settings)
        tracker = tracker_topics(self, self.settings.tracker)
        self.pose_topic = full_name(
            self, 'pose_topic', self.settings.pose_topic or f'{tracker}/pose', '/tracker/pose'
        )
        full_name(self, 'action', self.settings.action, '/follow_object')
        self._type = action_type() if action is None else action
        self._client = client(self, self._type, self.settings.action)
        self._status_topic = self.resolve_topic_name(f'{self.settings.action}/_action/status')
        self._servers: frozenset[tuple[int, ...]] = frozenset()
        self._goal: Any = None
        self._revoked: Any = None
        self._asking: Any = None
        self._asked_at = 0.0
        self._unanswered: set[Any] = set()
        self._said: tuple[str, float] = '', 0.0
        self._hidden = False
        light = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        # Of one answer, the box comes last.
        self.create_subscription(Bool, f'{tracker}/occluded', self._on_occluded, light)
        self._boxes = self.create_subscription(
            PolygonStamped, f'{tracker}/box', self._on_box, light
        )
        # None once it is said that no answer comes.
        self._heard_at: float | None = time.monotonic()
        self.create_service(Trigger, '~/start', self._start)
        self.create_service(Trigger, '~/stop', self._stop)
        self.create_timer(PERIOD_S, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def active(self) -> bool:
        """Whether the action server follows for us, or was asked to."""
        return self._asking is not None or self._goal is not None

    # -- what comes -------------------------------------------------------------------------------

    def _on_occluded(self, message: Bool) -> None:
        self._hidden = bool(message.data)

    def _on_box(self, message: PolygonStamped) -> None:
        self._heard_at = now = time.monotonic()
        self.following.answer(now, len(message.polygon.points) > 0, self._hidden)

    def _tell_silence(self, now: float) -> None:
        """Say once that no answer of the tracker comes, and what mends it."""
        if self._heard_at is None or now - self._heard_at < SILENCE_S:
            return
        self._heard_at, topic = None, self._boxes.topic_name
        if not self.count_publishers(topic):
            why = f'nobody publishes {topic}: is the tracker running, does the parameter tracker '
            why += 'name it with its namespace?'
        else:
            why = unheard(self, self._boxes, 'set the parameter tracker', '') or (
                f'no answer on {topic}: is the tracker active, do its images come? See /diagnostics'
            )
        self.get_logger().warning(why)

    def _start(self, request: Any, response: Any) -> Any:
        self.following.asked = True
        reason = self.following.reason_to_stop(time.monotonic())
        if not reason and not self._client.server_is_ready():
            reason = f'no server has {self.settings.action}'
        response.success = True
        response.message = f'not yet: {reason}' if reason else 'following'
        return response

    def _stop(self, request: Any, response: Any) -> Any:
        self.following.asked = False
        self._tick()
        response.success, response.message = True, 'stopped'
        return response

    # -- the goal ---------------------------------------------------------------------------------

    def _tick(self) -> None:
        now = time.monotonic()
        self._tell_silence(now)
        ready = self._client.server_is_ready()
        if self.active and not (ready and self._servers == self._servers_now()):
            # Neither its answer nor its result would ever come. If only the way to it was cut, it
            # may drive still: it is told to stop when it is back.
            self._revoked = self._goal
            self._ended('the server is gone')
        elif self._asking is not None and now - self._asked_at > ASKING_S:
            self._ended(f'the server has not answered for {ASKING_S:g} s')
        if self._revoked is not None and ready:
            self._revoked.cancel_goal_async()
            self._revoked = None
        reason = self.following.reason_to_stop(now)
        if self._goal is not None and reason:
            self._cancel(reason)
        elif not self.active and self.following.to_begin(now):
            self._begin()

    def _servers_now(self) -> frozenset[tuple[int, ...]]:
        """Who has the action: of a server that died, DDS knows for seconds after it came back."""
        infos = self.get_publishers_info_by_topic(self._status_topic)
        return frozenset(tuple(info.endpoint_gid) for info in infos)

    def _begin(self) -> None:
        if not self._client.server_is_ready():
            self._say(f'the target could be followed, but no server has {self.settings.action}')
            return
        goal = self._type.Goal()
        goal.pose_topic = self.pose_topic
        seconds = self.settings.max_duration
        goal.max_duration = Duration(sec=int(seconds), nanosec=int(seconds % 1 * 1e9))
        self._servers, self._asked_at = self._servers_now(), time.monotonic()
        self._asking = self._client.send_goal_async(goal)
        self._unanswered.add(self._asking)
        self._asking.add_done_callback(self._answered)

    def _answered(self, future: Any) -> None:
        self._unanswered.discard(future)
        late = future is not self._asking
        try:
            goal = future.result()
        except Exception as error:  # rclpy has no common class for what a server can do
            if not late:
                self._ended(f'the action server failed: {error}')
            return
        if late:
            if goal.accepted:  # nobody would stop it
                goal.cancel_goal_async()
            return
        self._asking = None
        if not goal.accepted:
            self._ended('the action server refused to follow')
            return
        self._goal = goal
        self._say(f'following {self.pose_topic}')
        goal.get_result_async().add_done_callback(lambda result: self._finished(goal, result))
        self._tick()  # the target may have gone while it was asked

    def _finished(self, goal: Any, future: Any) -> None:
        if goal is not self._goal:
            return
        try:
            result = future.result().result
            code = int(getattr(result, 'error_code', 0))
            text = str(getattr(result, 'error_msg', ''))
        except Exception as error:
            code, text = -1, str(error)
        self._ended(f'following ended with error {code}: {text}' if code else 'following ended')

    def _cancel(self, reason: str) -> None:
        goal, self._goal = self._goal, None
        goal.cancel_goal_async()
        self._say(f'the robot is to stop: {reason}')
        # The target may be seen again at once: then it is followed at once.

    def _ended(self, text: str) -> None:
        self._goal = self._asking = None
        self.following.ended(time.monotonic())
        self._say(text)

    def _say(self, text: str) -> None:
        """On the log, the same not over and over."""
        now, (last, at) = time.monotonic(), self._said
        if text != last or now - at > SAY_AGAIN_S:
            self._said = text, now
            self.get_logger().info(text)

    def destroy_node(self) -> None:
        """Have the robot stop before the node goes."""
        # Who accepts later would follow with nobody to stop it.
        if self._unanswered or self._revoked is not None:
            self.following.asked = False
            executor = SingleThreadedExecutor(context=self.context)
            executor.add_node(self)
            end = time.monotonic() + ANSWER_S
            while (self._unanswered or self._revoked is not None) and time.monotonic() < end:
                executor.spin_once(timeout_sec=0.05)
            executor.shutdown(timeout_sec=0.0)
        if self._goal is not None:
            self._cancel('the follow node ends')
        super().destroy_node()
