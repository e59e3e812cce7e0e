# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The managed node: its states, its parameters while running, its files of parameters."""

from __future__ import annotations

import contextlib
import gc
import os
import threading
import time
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

import rclpy
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from onnx_files import average_pool
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter
from ros_rig import Rig, box_text, overrides, running_node, scene, tracker_process
from std_srvs.srv import Trigger

from rgbd_kcf_tracker.bench.generated import outdated
from rgbd_kcf_tracker.bench.rig import resident_mb
from rgbd_kcf_tracker.live.settings import READ_ONLY, all_parameters
from rgbd_kcf_tracker.live.worker import Worker
from rgbd_kcf_tracker.ros.tracker_node import TrackerNode
from rgbd_kcf_tracker.track import TrackState

pytestmark = pytest.mark.ros

PROJECT = Path(__file__).resolve().parent.parent


def call(rig: Rig, kind: Any, name: str, request: Any) -> Any:
    client = rig.node.create_client(kind, name)
    assert client.wait_for_service(20), f'nobody offers {name}'
    # A server that has not yet found where to answer drops the answer (one-sided discovery): what
    # only asks is asked again.
    for _ in range(11 if kind is GetState else 0):
        answer = client.call_async(request)
        with contextlib.suppress(AssertionError):
            rig.wait(answer.done, timeout=5.0)
            return answer.result()
    answer = client.call_async(request)
    rig.wait(answer.done, what=name)
    return answer.result()


def change(rig: Rig, transition: int) -> bool:
    request = ChangeState.Request()
    request.transition.id = transition
    return bool(call(rig, ChangeState, '/tracker/change_state', request).success)


def state(rig: Rig) -> int:
    return int(call(rig, GetState, '/tracker/get_state', GetState.Request()).current_state.id)


def set_parameter(rig: Rig, name: str, value: Any) -> Any:
    parameter = Parameter(name, value=value).to_parameter_msg()
    request = SetParameters.Request(parameters=[parameter])
    return call(rig, SetParameters, '/tracker/set_parameters', request).results[0]


def test_without_autostart_it_waits_for_the_manager(rig: Rig) -> None:
    with running_node(rig, autostart=False, queue_policy='all', init_box=box_text(0)) as node:
        assert state(rig) == State.PRIMARY_STATE_UNCONFIGURED
        assert node.count_subscribers('/color/image') == 0
        assert change(rig, Transition.TRANSITION_CONFIGURE)
        assert state(rig) == State.PRIMARY_STATE_INACTIVE
        assert node.count_subscribers('/color/image') == 0
        assert change(rig, Transition.TRANSITION_ACTIVATE)
        rig.await_listener(node)
        rig.play(range(5))
        assert rig.box().iou(scene(4)[2]) > 0.6
        # The target outlives a pause.
        assert change(rig, Transition.TRANSITION_DEACTIVATE)
        rig.send(5)
        time.sleep(0.2)
        assert len(rig.boxes) == 5
        values = rig.fresh_values()
        assert (values['message'], values['state']) == ('inactive', 'TRACKING')
        node.statistics._image_time -= 3600
        assert change(rig, Transition.TRANSITION_ACTIVATE)
        # For as long as it did not listen no image could come: that is no fault of the camera.
        assert node.statistics.snapshot().image_age_s < 1800
        rig.await_listener(node)
        rig.play(range(6, 9))
        assert rig.box().iou(scene(8)[2]) > 0.6
        # Cleaned up and configured again, it starts from its parameters.
        assert change(rig, Transition.TRANSITION_DEACTIVATE)
        assert change(rig, Transition.TRANSITION_CLEANUP)
        assert state(rig) == State.PRIMARY_STATE_UNCONFIGURED
        assert set_parameter(rig, 'init_box', box_text(20)).successful
        assert change(rig, Transition.TRANSITION_CONFIGURE)
        assert change(rig, Transition.TRANSITION_ACTIVATE)
        rig.await_listener(node)
        rig.play(range(20, 23))
        assert rig.box().iou(scene(22)[2]) > 0.6
        assert change(rig, Transition.TRANSITION_ACTIVE_SHUTDOWN)
        assert state(rig) == State.PRIMARY_STATE_FINALIZED


def test_a_request_that_does_not_fit_the_state_is_refused_and_survived(rig: Rig) -> None:
    with running_node(rig, queue_policy='all'):
        assert not change(rig, Transition.TRANSITION_CONFIGURE)
        assert not change(rig, 250)
        rig.play(range(2))
        assert state(rig) == State.PRIMARY_STATE_ACTIVE


def test_hundreds_of_lifecycle_cycles(ros_domain: int) -> None:
    """Memory, threads and topics are what they were, and it still works."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=ros_domain)
    node = TrackerNode(context=context, parameter_overrides=overrides({'autostart': False}))

    def cycle() -> None:
        for step in (
            node.trigger_configure,
            node.trigger_activate,
            node.trigger_deactivate,
            node.trigger_cleanup,
        ):
            assert step().name == 'SUCCESS'

    def counted() -> tuple[int, ...]:
        return (
            len(list(node.publishers)),
            len(list(node.subscriptions)),
            len(list(node.services)),
            len(list(node.timers)),
            threading.active_count(),
            len(os.listdir('/proc/self/fd')),
        )

    for _ in range(100):
        cycle()
    gc.collect()
    before, memory = counted(), resident_mb(os.getpid())
    for _ in range(200):
        cycle()
    gc.collect()
    assert counted() == before
    assert resident_mb(os.getpid()) - memory < 5
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_an_activation_that_fails_leaves_nothing_that_listens(ros_domain: int) -> None:
    """The images of an inactive node went on, and more of them with each attempt."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=ros_domain)
    wrong = 'qos_overrides./color/camera_info.subscription.reliability'
    settings = overrides({'autostart': False, wrong: 'bogus'})
    node = TrackerNode(context=context, parameter_overrides=settings)
    try:
        assert node.trigger_configure().name == 'SUCCESS'
        before = sorted(s.topic_name for s in node.subscriptions)
        for _ in range(2):
            assert node.trigger_activate().name != 'SUCCESS'
            assert sorted(s.topic_name for s in node.subscriptions) == before
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def test_a_worker_that_is_stuck_shares_nothing_with_its_successor(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_work, gate = threading.Event(), threading.Event()
    monkeypatch.setattr(Worker.stop, '__defaults__', (0.2,))
    with running_node(rig, queue_policy='all', init_box=box_text(0)) as node:
        rig.play(range(3))
        session, update = node._session, node._session._targets.update
        node._session._targets.update = lambda frame: (
            in_work.set() or (gate.wait(30) and update(frame))
        )
        rig.send(3)
        assert in_work.wait(30)
        assert change(rig, Transition.TRANSITION_DEACTIVATE)
        assert set_parameter(rig, 'variant', 'kcf').successful
        # Its image is still in work, with the session that a new worker would use.
        assert not change(rig, Transition.TRANSITION_ACTIVATE)
        assert state(rig) == State.PRIMARY_STATE_INACTIVE
        assert change(rig, Transition.TRANSITION_CLEANUP)
        assert change(rig, Transition.TRANSITION_CONFIGURE)
        assert change(rig, Transition.TRANSITION_ACTIVATE)
        assert node._session is not session
        rig.await_listener(node)
        rig.play(range(6, 9))
        gate.set()
        rig.play(range(9, 12))
        assert rig.box() is not None
        assert node._session.variant == 'kcf'


def test_what_was_asked_before_deactivation_is_done(rig: Rig) -> None:
    in_work = threading.Event()
    with running_node(rig, queue_policy='all', init_box=box_text(0)) as node:
        rig.play(range(2))
        targets = node._session._targets
        update = targets.update
        targets.update = lambda frame: in_work.set() or time.sleep(0.3) or update(frame)
        rig.send(2)
        assert in_work.wait(30)
        assert set_parameter(rig, 'variant', 'kcf').successful
        client = rig.node.create_client(Trigger, '/tracker/reset')
        assert client.wait_for_service(20)
        client.call_async(Trigger.Request())
        assert change(rig, Transition.TRANSITION_DEACTIVATE)
        assert change(rig, Transition.TRANSITION_ACTIVATE)
        assert node._session.variant == 'kcf'
        assert node._session.track.state is TrackState.IDLE


def test_a_reset_is_answered_in_every_state(rig: Rig) -> None:
    """Calls that came while the node was cleaned up were never answered."""
    with running_node(rig) as node:
        client = rig.node.create_client(Trigger, '/tracker/reset')
        assert call(rig, Trigger, '/tracker/reset', Trigger.Request()).success
        assert change(rig, Transition.TRANSITION_DEACTIVATE)
        assert client.wait_for_service(20)
        take_down = node._take_down

        def slowly() -> None:
            answers.extend(client.call_async(Trigger.Request()) for _ in range(5))
            time.sleep(0.3)  # they arrive meanwhile
            take_down()

        answers: list[Any] = []
        node._take_down = slowly
        assert change(rig, Transition.TRANSITION_CLEANUP)
        rig.wait(lambda: all(answer.done() for answer in answers), 20, 'an answer to each')
        assert {answer.result().success for answer in answers} == {False}
        assert answers[0].result().message == 'the node is unconfigured: it has no target'


def test_nothing_of_a_destroyed_node_is_found(rig: Rig) -> None:
    # What is left of one hides the services of the next of that name from whoever asks for them.
    with running_node(rig) as node:
        assert state(rig) == State.PRIMARY_STATE_ACTIVE
        services = [service.service_name for service in node.services]
    assert '/tracker/change_state' in services
    rig.wait(lambda: not any(map(rig.node.count_services, services)), 20, 'its services to go')


def test_parameters_are_described(rig: Rig) -> None:
    with running_node(rig):
        names = [info.name for info in all_parameters()]
        request = DescribeParameters.Request(names=names)
        answer = call(rig, DescribeParameters, '/tracker/describe_parameters', request)
        for info, described in zip(all_parameters(), answer.descriptors, strict=True):
            assert described.description.startswith(info.description)
            assert described.read_only == (info.name in READ_ONLY)
            if info.type is float and info.minimum is not None:
                assert described.floating_point_range[0].from_value == info.minimum
            if info.choices:
                assert all(choice in described.additional_constraints for choice in info.choices)


def test_parameters_while_running(rig: Rig) -> None:
    with running_node(rig, queue_policy='all', init_box=box_text(0)) as node:
        rig.play(range(3))
        refused = set_parameter(rig, 'kcf.padding', 1e6)
        assert not refused.successful
        assert 'padding' in refused.reason
        assert not set_parameter(rig, 'variant', 'magic').successful
        assert 'choose one of' in set_parameter(rig, 'variant', 'magic').reason
        assert not set_parameter(rig, 'queue_policy', 'newest').successful
        assert not set_parameter(rig, 'kcf.padding', 'wide').successful
        assert not set_parameter(rig, 'init_box', '1,2,3').successful
        # An integer is taken for a double, and it reaches the tracker.
        assert set_parameter(rig, 'kcf.padding', 2).successful
        assert node.get_parameter('kcf.padding').value == 2.0
        rig.play(range(3, 6))
        assert rig.box().iou(scene(5)[2]) > 0.6
        assert set_parameter(rig, 'init_box', [float(v) for v in scene(6)[2].as_tuple()]).successful
        rig.play([6])
        assert rig.box().as_tuple() == scene(6)[2].as_tuple()


def test_a_file_that_is_no_network_is_refused_and_blocks_nothing(rig: Rig, tmp_path: Path) -> None:
    junk, network = tmp_path / 'junk.onnx', tmp_path / 'means.onnx'
    junk.write_text('no network')
    network.write_bytes(average_pool())
    with running_node(rig, variant='kcf') as node:
        for name, value, reason in (
            ('metric.embedding', str(junk), 'cannot run'),
            ('metric.embedding', str(network), ''),
            ('metric.lost_after', 9.0, ''),
            ('metric.embedding', str(junk), 'cannot run'),
            ('metric.embedding', '', ''),
            ('variant', 'metric', ''),
        ):
            (result,) = node.set_parameters([Parameter(name, value=value)])
            assert (result.successful, reason in result.reason) == (not reason, True)
        rig.wait(lambda: node._session.variant == 'metric')
        assert node._session._parameters.lost_after == 9.0
        assert 'rejected_requests' not in node.statistics.snapshot().counts


def test_a_pair_is_set_in_any_order(rig: Rig) -> None:
    """As `ros2 param load` does, one by one; while nobody can be between them, that is said."""
    with running_node(rig, auto_init=True) as node:
        session = node._session
        assert set_parameter(rig, 'auto_init_far', 0.4).successful
        said = rig.fresh_values()
        assert (
            'auto_init_near is 0.5 and auto_init_far 0.4: nobody is between' in said['last_error']
        )
        assert session._auto is None
        # As long as nobody can be found, that lasts, unlike what went wrong once.
        assert node._state(node.statistics.snapshot()).auto_init_fault == said['last_error']
        assert set_parameter(rig, 'auto_init_near', 0.2).successful
        rig.wait(lambda: session._auto is not None)
        assert node._state(node.statistics.snapshot()).auto_init_fault == ''
        assert rig.fresh_values()['rejected_requests'] == '1'


def test_integers_for_doubles_and_lists_for_boxes_are_taken(rig: Rig) -> None:
    """Each of these crashes a plain rclpy node."""
    with running_node(rig, queue_policy='all', kcf__padding=2, init_box=[1, 2, 3, 4]) as node:
        assert node.get_parameter('kcf.padding').value == 2.0
        assert node.get_parameter('init_box').value == '1,2,3,4'
        # While it runs, too; and what is wrong with them is not their type.
        for name, value, reason in (
            ('kcf.padding', 3, ''),
            ('init_box', [5, 6, 7, 8], ''),
            ('kcf.padding', 11, 'out of range'),
            ('init_box', [1, 2, 3], "'1,2,3' is not four numbers"),
        ):
            (result,) = node.set_parameters([Parameter(name, value=value)])
            assert (result.successful, reason in result.reason) == (not reason, True)
        assert node.get_parameter('kcf.padding').value == 3.0


def test_a_parameter_that_nobody_declared_is_named(rig: Rig) -> None:
    """rclpy itself names it "[]"."""
    with running_node(rig) as node:
        refused = set_parameter(rig, 'kcf.paddding', 3.0)
        assert not refused.successful
        assert "unknown parameter 'kcf.paddding': did you mean 'kcf.padding'?" in refused.reason
        assert set_parameter(rig, 'use_sim_time', False).successful
        node.declare_parameter('later', 1)
        assert set_parameter(rig, 'later', 2).successful


def test_two_of_one_name_are_told(rig: Rig) -> None:
    """Who listened had the answers of both, in turn, and nobody said a word."""
    with running_node(rig, queue_policy='all', init_box=box_text(0)):
        rig.play([0])
        assert 'somebody else' not in rig.fresh_values()['message']
        with running_node(rig):
            rig.play([1])
            told = 'somebody else publishes /tracker/box, too'
            rig.wait(lambda: told in rig.values().get('message', ''), 10.0, told)
        rig.wait(lambda: told not in rig.values()['message'], 10.0, 'its end')


def test_generated_files_are_up_to_date() -> None:
    assert outdated(PROJECT) == [], 'run python -m rgbd_kcf_tracker.bench.generated'


def test_shipped_file_of_parameters_is_taken(rig: Rig, tmp_path: Path) -> None:
    text = (PROJECT / 'config' / 'tracker.yaml').read_text(encoding='utf-8')
    assert 'stale_after: 2.0' in text
    changed = tmp_path / 'tracker.yaml'
    changed.write_text(text.replace('stale_after: 2.0', 'stale_after: 1.25'), encoding='utf-8')
    with tracker_process(
        *('--params-file', str(changed), '-r', '__ns:=/left', '-r', '__node:=watcher')
    ):
        request = DescribeParameters.Request(names=['stale_after'])
        call(rig, DescribeParameters, '/left/watcher/describe_parameters', request)
        rig.wait(lambda: any(d.name == '/left/watcher: tracker' for d in rig.diagnostics))
        assert 'bad_parameters' not in rig.values()
        answer = call(
            rig,
            GetParameters,
            '/left/watcher/get_parameters',
            GetParameters.Request(names=['stale_after']),
        )
        assert answer.values[0].double_value == 1.25
