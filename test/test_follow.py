# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Following: when it is asked for, and that it is stopped; by the contract of Nav2's FollowObject.

The action is in no wheel: a stand-in of it, and of its server, keeps the contract of the public
source (nav2_msgs/action/FollowObject.action; opennav_following): a goal names a topic of poses or a
frame, the server subscribes to it, and ends with FAILED_TO_DETECT_OBJECT where no pose comes.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml
from test_launch import PROJECT, launch_modules, started  # noqa: F401  (a fixture)

from rgbd_kcf_tracker.errors import ParameterError, RgbdKcfError
from rgbd_kcf_tracker.live.following import Following, FollowParameters

FAILED_TO_DETECT_OBJECT = 902


# -- the decision: no ROS -------------------------------------------------------------------------


def following(**values: Any) -> Following:
    return Following(FollowParameters(**values))


def test_it_begins_with_a_target_in_sight_and_ends_without_one() -> None:
    one = following(give_up_after=5.0, silent_after=1.0)
    assert not one.to_begin(0.0)
    assert one.reason_to_stop(0.0) == 'the tracker is silent'
    one.answer(0.1, seen=False, hidden=False)
    assert one.reason_to_stop(0.2) == 'there is no target'
    one.answer(0.3, seen=True, hidden=False)
    assert one.to_begin(0.4)
    # hidden: what follows goes on, but nothing new is begun
    one.answer(0.5, seen=False, hidden=True)
    assert one.reason_to_stop(0.6) == ''
    assert not one.to_begin(0.6)
    for tenth in range(6, 60):
        one.answer(tenth / 10, seen=False, hidden=True)
    assert one.reason_to_stop(5.31).startswith('the target is out of sight for 5 s')
    # reset, by somebody who sees that it is the wrong one: at once
    one.answer(6.0, seen=True, hidden=False)
    assert one.reason_to_stop(6.1) == ''
    one.answer(6.2, seen=False, hidden=False)
    assert one.reason_to_stop(6.2) == 'there is no target'


def test_a_silent_tracker_stops_the_robot() -> None:
    one = following(silent_after=1.0)
    one.answer(0.0, seen=True, hidden=False)
    assert one.to_begin(0.9)
    assert one.reason_to_stop(1.1) == 'the tracker is silent'


def test_who_gives_up_at_once_follows_while_the_target_is_in_sight() -> None:
    one = following(give_up_after=0.0)
    one.answer(0.0, seen=True, hidden=False)
    assert one.to_begin(0.03)
    one.answer(0.04, seen=False, hidden=True)
    assert one.reason_to_stop(0.05) == 'the target is out of sight for 0 s'


def test_after_an_end_it_waits_before_it_asks_again() -> None:
    one = following(retry_after=2.0)
    one.answer(0.0, seen=True, hidden=False)
    one.ended(0.1)
    one.answer(1.0, seen=True, hidden=False)
    assert not one.to_begin(1.0)
    one.answer(2.2, seen=True, hidden=False)
    assert one.to_begin(2.2)


def test_after_the_target_was_dropped_it_waits_before_it_follows_the_next() -> None:
    """Where the tracker chooses by itself it was the same one, a fifth of a second later."""
    one = following(retry_after=2.0)
    one.answer(0.0, seen=True, hidden=False)
    one.answer(1.0, seen=False, hidden=False)
    assert one.reason_to_stop(1.0) == 'there is no target'
    one.answer(1.2, seen=True, hidden=False)
    assert not one.to_begin(1.2)
    one.answer(3.1, seen=True, hidden=False)
    assert one.to_begin(3.1)


def test_unasked_nothing_is_followed() -> None:
    one = following(automatic=False)
    one.answer(0.0, seen=True, hidden=False)
    assert not one.to_begin(0.1)
    one.asked = True
    assert one.to_begin(0.1)
    with pytest.raises(ParameterError):
        FollowParameters(give_up_after=-1.0)


# -- the launch file ------------------------------------------------------------------------------


def start_follow(**given: str) -> dict[str, Any]:
    actions = started('follow.launch.py', **given)
    return {a.named.get('executable', type(a).__name__): a for a in actions}


def test_the_launch_file_starts_tracker_server_and_who_asks(launch_modules: None) -> None:  # noqa: F811
    actions = start_follow(namespace='robot', name='eyes', cmd_vel='cmd_vel_nav', automatic='no')
    assert set(actions) == {
        'IncludeLaunchDescription', 'follow', 'opennav_following', 'lifecycle_manager',
    }  # fmt: skip
    include = actions['IncludeLaunchDescription']
    assert include.values[0].values[0].endswith('launch/tracker.launch.py')
    assert dict(include.named['launch_arguments'])['name'] == 'eyes'
    server = actions['opennav_following'].named
    assert (server['name'], server['remappings']) == (
        'following_server', [('cmd_vel', 'cmd_vel_nav')],
    )  # fmt: skip
    file, own = actions['follow'].named['parameters']
    assert (own['tracker'], own['automatic']) == ('eyes', False)
    assert {a.named.get('namespace', 'robot') for a in actions.values()} == {'robot'}
    assert set(start_follow(server='false')) == {'IncludeLaunchDescription', 'follow'}
    content = yaml.safe_load(Path(file).read_text(encoding='utf-8'))
    (managed,) = content['/**/lifecycle_manager_following']['ros__parameters']['node_names']
    assert f'/**/{managed}' in content
    FollowParameters(**content['/**/follow']['ros__parameters'])


def test_without_the_following_server_nothing_is_started(
    launch_modules: None,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Launch ends without what it has started by then, the tracker, which would live on."""
    packages = sys.modules['ament_index_python.packages']
    installed = {'nav2_lifecycle_manager': '/opt/ros/jazzy'}
    monkeypatch.setattr(packages, 'get_packages_with_prefixes', lambda: installed)
    with pytest.raises(ParameterError, match=r'install ros-\w+-opennav-following, or .*server:='):
        start_follow()
    assert set(start_follow(server='false')) == {'IncludeLaunchDescription', 'follow'}


def test_the_server_waits_longer_than_the_tracker_predicts_and_stops_before_it_is_told() -> None:
    content = yaml.safe_load((PROJECT / 'config' / 'follow.yaml').read_text(encoding='utf-8'))
    server = content['/**/following_server']['ros__parameters']
    assert server['desired_distance'] == 1.5
    assert server['controller']['use_collision_detection'] is False, 'the server refuses to start'
    assert server['detection_timeout'] < FollowParameters().give_up_after


# -- the node and a stand-in server, over DDS -----------------------------------------------------


class Future:
    """As rclpy's: a result and who waits for it."""

    def __init__(self) -> None:
        self._result: Any = None
        self._done = False
        self._callbacks: list[Callable[[Any], None]] = []

    def set_result(self, result: Any) -> None:
        self._result, self._done = result, True
        for callback in self._callbacks:
            callback(self)

    def done(self) -> bool:
        return self._done

    def result(self) -> Any:
        if isinstance(self._result, Exception):
            raise self._result
        return self._result

    def add_done_callback(self, callback: Callable[[Any], None]) -> None:
        self._callbacks.append(callback)
        if self._done:
            callback(self)


class FollowObject:
    """Stands for the action: what a goal has."""

    class Goal:
        __slots__ = ('max_duration', 'pose_topic', 'tracked_frame')

        def __init__(self) -> None:
            self.pose_topic = self.tracked_frame = ''
            self.max_duration: Any = None


class Handle:
    """Of one goal."""

    def __init__(self, server: Server, accepted: bool) -> None:
        self.server, self.accepted = server, accepted
        self.ended = Future()

    def get_result_async(self) -> Future:
        return self.ended

    def cancel_goal_async(self) -> Future:
        self.server.cancelled += 1
        self.server.end(self, 0, '')
        return Future()


class Server:
    """Stands for client and server of the action, on a real topic of poses."""

    def __init__(self) -> None:
        self.ready = True
        self.refuse = self.late = self.mute = False
        self.goals: list[Any] = []
        self.unanswered: list[tuple[Any, Handle, Future]] = []
        self.cancelled = 0
        self.active: Handle | None = None
        self.node: Any = None
        self.poses: list[Any] = []
        self.topic = ''

    def __call__(self, node: Any, kind: Any, name: str) -> Server:
        assert kind is FollowObject
        self.node, self.name = node, name
        return self

    def server_is_ready(self) -> bool:
        return self.ready

    def send_goal_async(self, goal: Any) -> Future:
        assert goal.pose_topic or goal.tracked_frame, 'the server would end at once'
        assert goal.max_duration.sec >= 0
        self.goals.append(goal)
        answer, handle = Future(), Handle(self, not self.refuse)
        if self.mute:
            self.unanswered.append((goal, handle, answer))
        elif self.late:
            self.node.create_timer(0.2, lambda: self.accept(goal, handle, answer))
        else:
            self.accept(goal, handle, answer)
        return answer

    def accept(self, goal: Any, handle: Handle, answer: Future) -> None:
        from geometry_msgs.msg import PoseStamped

        if answer.done():
            return
        if handle.accepted:
            assert self.active is None, 'two goals at once'
            self.active, self.topic = handle, goal.pose_topic
            self.node.create_subscription(PoseStamped, goal.pose_topic, self.poses.append, 1)
        answer.set_result(handle)

    def end(self, handle: Handle, code: int, text: str) -> None:
        if self.active is handle:
            self.active = None
        handle.ended.set_result(
            SimpleNamespace(result=SimpleNamespace(error_code=code, error_msg=text))
        )


@contextmanager
def running(server: Server, **values: Any) -> Iterator[tuple[Any, Any]]:
    pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

    import rclpy
    from ros_rig import overrides, spinning

    from rgbd_kcf_tracker.ros.follow_node import FollowNode

    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(os.environ['ROS_DOMAIN_ID']))
    node = FollowNode(
        action=FollowObject, client=server, context=context,
        parameter_overrides=overrides(values),
    )  # fmt: skip
    camera = rclpy.create_node('camera_and_tracker', context=context)
    try:
        with spinning(node, camera):
            yield node, camera
    finally:
        node.destroy_node()
        camera.destroy_node()
        rclpy.shutdown(context=context)


class FakeTracker:
    """Answers as the tracker node does: first occluded, last the box; and the pose."""

    def __init__(self, node: Any) -> None:
        from geometry_msgs.msg import Point32, PolygonStamped, PoseStamped
        from std_msgs.msg import Bool

        self._point, self._polygon, self._bool, self._pose = (
            Point32, PolygonStamped, Bool, PoseStamped,
        )  # fmt: skip
        self.occluded = node.create_publisher(Bool, '/tracker/occluded', 10)
        self.box = node.create_publisher(PolygonStamped, '/tracker/box', 10)
        self.pose = node.create_publisher(PoseStamped, '/tracker/pose', 10)

    def say(self, seen: bool, hidden: bool = False) -> None:
        if seen:
            self.pose.publish(self._pose())
        self.occluded.publish(self._bool(data=hidden))
        message = self._polygon()
        if seen:
            message.polygon.points = [self._point(x=float(i % 2)) for i in range(4)]
        self.box.publish(message)

    def until(
        self, condition: Callable[[], bool], seen: bool, hidden: bool = False, s: float = 20.0
    ) -> None:
        end = time.monotonic() + s
        while not condition():
            assert time.monotonic() < end, 'waited in vain'
            self.say(seen, hidden)
            time.sleep(0.02)


@pytest.mark.ros
@pytest.mark.timeout(120)
def test_a_target_is_followed_while_it_is_there_and_no_longer() -> None:
    server = Server()
    with running(server, give_up_after=0.6, retry_after=0.3, max_duration=90.5) as (node, camera):
        tracker = FakeTracker(camera)
        tracker.until(lambda: server.active is not None, seen=True)
        (goal,) = server.goals
        assert (goal.pose_topic, server.name) == ('/tracker/pose', 'follow_object')
        assert (goal.max_duration.sec, goal.max_duration.nanosec) == (90, 500_000_000)
        tracker.until(lambda: len(server.poses) > 3, seen=True)
        # hidden for a moment: it goes on
        begun = time.monotonic()
        tracker.until(lambda: time.monotonic() - begun > 0.3, seen=False, hidden=True)
        assert server.active is not None
        # for long: the robot is told to stop, and follows again when he is back
        tracker.until(lambda: server.cancelled == 1, seen=False, hidden=True)
        tracker.until(lambda: server.active is not None, seen=True)
        # reset, for it was the wrong one
        tracker.until(lambda: server.cancelled == 2, seen=False)
        # the server gives up by itself: it is asked again, not at once
        tracker.until(lambda: server.active is not None, seen=True)
        asked = len(server.goals)
        assert server.active is not None
        server.end(server.active, FAILED_TO_DETECT_OBJECT, 'Failed object detection')
        assert len(server.goals) == asked
        tracker.until(lambda: server.active is not None, seen=True)
        # a tracker that falls silent
        end = time.monotonic() + 20
        while server.active is not None:
            assert time.monotonic() < end
            time.sleep(0.05)
        assert not node.active


@pytest.mark.ros
@pytest.mark.timeout(120)
def test_a_tracker_that_does_not_answer_is_told_once(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """It followed nobody for ever, and did not say that its tracker has another name."""
    from rgbd_kcf_tracker.ros import follow_node

    monkeypatch.setattr(follow_node, 'SILENCE_S', 0.5)
    said = ''

    def until_said(what: str) -> None:
        nonlocal said
        end = time.monotonic() + 20
        while what not in said:
            assert time.monotonic() < end, said
            time.sleep(0.05)
            said += capfd.readouterr().err

    with running(Server()) as (node, camera):
        until_said('nobody publishes /tracker/box: is the tracker running')
        tracker = FakeTracker(camera)
        tracker.until(lambda: node.active, seen=True)
        until_said('no answer on /tracker/box: is the tracker active')
        time.sleep(1.2)
    said += capfd.readouterr().err
    assert said.count('/tracker/box') == 2


@pytest.mark.ros
@pytest.mark.timeout(120)
def test_a_server_that_is_not_there_or_refuses_and_a_node_that_ends() -> None:
    from std_srvs.srv import Trigger

    server = Server()
    server.ready = False
    with running(server, automatic=False, retry_after=0.2) as (node, camera):
        tracker = FakeTracker(camera)
        begun = time.monotonic()
        tracker.until(lambda: time.monotonic() - begun > 0.5, seen=True)
        assert not server.goals
        client = camera.create_client(Trigger, '/follow/start')
        tracker.until(client.service_is_ready, seen=True)
        assert client.call(Trigger.Request(), timeout_sec=10).success
        begun = time.monotonic()
        tracker.until(lambda: time.monotonic() - begun > 0.4, seen=True)
        assert not server.goals
        server.ready, server.refuse = True, True
        tracker.until(lambda: len(server.goals) >= 2, seen=True)
        assert server.active is None
        server.refuse = False
        tracker.until(lambda: server.active is not None, seen=True)
        assert (
            camera.create_client(Trigger, '/follow/stop')
            .call(Trigger.Request(), timeout_sec=10)
            .success
        )
        assert server.cancelled == 1
        node.following.asked = True
        tracker.until(lambda: server.active is not None, seen=True)
    assert server.active is None, 'a node that ends leaves the robot driving'


@pytest.mark.ros
@pytest.mark.timeout(120)
def test_a_goal_that_is_accepted_while_the_node_ends_is_taken_back() -> None:
    server = Server()
    server.late = True
    with running(server) as (_, camera):
        tracker = FakeTracker(camera)
        tracker.until(lambda: bool(server.goals), seen=True)
    assert server.cancelled == 1
    assert server.active is None


@pytest.mark.ros
@pytest.mark.timeout(120)
def test_a_server_that_died_is_asked_again_when_it_is_back() -> None:
    """Neither answer nor result of a dead server ever comes: its futures stay pending."""
    from std_msgs.msg import Bool
    from std_srvs.srv import Trigger

    server = Server()
    with running(server, retry_after=0.3) as (node, camera):
        tracker = FakeTracker(camera)
        tracker.until(lambda: server.active is not None, seen=True)
        server.ready, server.active = False, None
        tracker.until(lambda: not node.active, seen=True)
        start = camera.create_client(Trigger, '/follow/start')
        tracker.until(start.service_is_ready, seen=True)
        answer = start.call(Trigger.Request(), timeout_sec=10)
        assert answer.message == 'not yet: no server has follow_object'
        assert server.cancelled == 0
        # It may have been the way to it alone, and it drives on: that goal is cancelled first.
        server.ready = True
        tracker.until(lambda: server.active is not None, seen=True)
        assert server.cancelled == 1
        # One that is back before DDS noticed that the first one died.
        camera.create_publisher(Bool, '/follow_object/_action/status', 1)
        tracker.until(lambda: server.cancelled == 2, seen=True)
        tracker.until(lambda: server.active is not None, seen=True)
        # Before it answered.
        server.mute = True
        server.end(server.active, FAILED_TO_DETECT_OBJECT, 'Failed object detection')
        tracker.until(lambda: bool(server.unanswered), seen=True)
        server.ready = False
        tracker.until(lambda: not node.active, seen=True)
        server.ready, server.mute = True, False
        tracker.until(lambda: server.active is not None, seen=True)
        server.unanswered.clear()
    assert server.active is None


@pytest.mark.ros
@pytest.mark.timeout(120)
def test_a_goal_that_is_accepted_too_late_is_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")
    from rgbd_kcf_tracker.ros import follow_node

    monkeypatch.setattr(follow_node, 'ASKING_S', 0.3)
    server = Server()
    server.mute = True
    with running(server, retry_after=0.2) as (node, camera):
        tracker = FakeTracker(camera)
        tracker.until(lambda: len(server.unanswered) == 2, seen=True)
        node.create_timer(0.0, lambda: server.accept(*server.unanswered[0]))
        tracker.until(lambda: server.cancelled == 1, seen=True)
        assert server.active is None


def test_without_the_action_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")
    from rgbd_kcf_tracker.ros import follow_node

    for home in follow_node.HOMES:
        monkeypatch.setitem(sys.modules, home, None)
    with pytest.raises(RgbdKcfError, match='opennav-following'):
        follow_node.action_type()
    monkeypatch.setitem(
        sys.modules, follow_node.HOMES[1], SimpleNamespace(FollowObject=FollowObject)
    )
    assert follow_node.action_type() is FollowObject


@pytest.mark.ros
def test_the_parameter_file_reaches_the_node_in_any_namespace() -> None:
    rclpy = pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")
    for namespace in ('', 'robot'):
        context = rclpy.Context()
        file = str(PROJECT / 'config' / 'follow.yaml')
        rclpy.init(
            args=['--ros-args', '--params-file', file],
            context=context,
            domain_id=int(os.environ['ROS_DOMAIN_ID']),
        )
        node = rclpy.create_node(
            'follow',
            namespace=namespace,
            context=context,
            automatically_declare_parameters_from_overrides=True,
        )
        try:
            assert node.get_parameter('give_up_after').value == 5.0
        finally:
            node.destroy_node()
            rclpy.shutdown(context=context)
