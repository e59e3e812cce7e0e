# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The tracker as a managed node: wiring only, the work is done elsewhere.

Callbacks store (:mod:`~rgbd_kcf_tracker.live.intake`); one worker thread decodes, tracks and
publishes (:mod:`~rgbd_kcf_tracker.live.processor`). Unconfigured the node only reports diagnostics;
inactive it holds tracker and topics; active it also listens.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo
from std_srvs.srv import Trigger

from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.live.intake import Intake
from rgbd_kcf_tracker.live.processor import Capture, Processor
from rgbd_kcf_tracker.live.session import Session, warm_up
from rgbd_kcf_tracker.live.settings import ALL, NodeParameters
from rgbd_kcf_tracker.live.statistics import Snapshot, Statistics
from rgbd_kcf_tracker.live.story import Allowance
from rgbd_kcf_tracker.live.worker import Worker
from rgbd_kcf_tracker.recordings.camera_info import camera_from_info
from rgbd_kcf_tracker.ros.diagnostics import NodeState, diagnostics_message
from rgbd_kcf_tracker.ros.parameters import DECLARE_OVERRIDES, ParameterServer
from rgbd_kcf_tracker.ros.private import release_lifecycle_services
from rgbd_kcf_tracker.ros.publishers import NO_EVENTS, TrackPublishers
from rgbd_kcf_tracker.ros.requests import REJECTED, Requests, auto_init_fault
from rgbd_kcf_tracker.ros.subscriptions import (
    CAMERA_INFO,
    COLOR,
    DEPTH,
    REQUESTS,
    Subscriptions,
)
from rgbd_kcf_tracker.ros.transforms import Transforms
from rgbd_kcf_tracker.variants import VARIANTS

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
POLL_PERIOD_S = 0.025
DIAGNOSTICS_PERIOD_S = 1.0
SOURCES = {
    'bad_color': COLOR,
    'bad_depth': DEPTH,
    'empty_depth': DEPTH,
    'odd_depth': DEPTH,
    'frozen_depth': DEPTH,
    'bad_camera_info': CAMERA_INFO,
}
"""The inputs of which faults of these kinds are."""
MOST_WORDS = 500
"""Characters that are said of a fault."""
LOG_PERIOD_S = 5.0
MOST_REFUSALS, REFUSALS_A_SECOND = 10, 2.0
"""Refused requests that are answered on the log at once, and for good."""
CATCH_UP = 3
"""Pairs that wait beside the newest where tracking is fast and was held up: a tenth of a second."""


class TrackerNode(LifecycleNode):
    """Follows one target in the images of one camera.

    Args:
        name: of the node.
        options: passed on to rclpy's node (``parameter_overrides``, ``namespace``, ...).

    Raises:
        ParameterError: where it is started with an unknown parameter or a value out of range.
    """

    def __init__(self, name: str = 'tracker', **options: Any) -> None:
        super().__init__(name, **DECLARE_OVERRIDES, **options)
        self.statistics = Statistics()
        self._session: Session | None = None
        self._processor: Processor | None = None
        self._requests: Requests | None = None
        self._outputs: TrackPublishers | None = None
        self._worker: Worker[Capture] | None = None
        self._intake: Intake | None = None
        self._inputs: Subscriptions | None = None
        self._transforms: Transforms | None = None
        self._refusals = Allowance(MOST_REFUSALS, REFUSALS_A_SECOND)
        self._logged: dict[str, float] = {}
        self._topics: dict[str, str] = {}
        self._unheard: set[str] = set()
        self._unheard_told: set[str] = set()
        try:
            self._parameters_server = ParameterServer(self, self._parameters_changed)
        except RgbdKcfError:
            super().destroy_node()
            raise
        self._settings = self._parameters_server.node_parameters()
        # Diagnostics speak in every lifecycle state, so theirs is a plain publisher.
        self._diagnostics = Node.create_publisher(
            self, DiagnosticArray, '/diagnostics', 10, event_callbacks=NO_EVENTS
        )
        # Timers on the node's own clock would stand still while recorded time does.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._diagnostics_timer = self.create_timer(
            DIAGNOSTICS_PERIOD_S, self._publish_diagnostics, clock=steady
        )
        self._poll_timer = self.create_timer(POLL_PERIOD_S, self._poll, clock=steady)
        self._poll_timer.cancel()
        # In every state, too: a call that waits while its service goes never has an answer.
        self.create_service(Trigger, '~/reset', self._reset)
        self._answer_impossible_transitions()

    def _answer_impossible_transitions(self) -> None:
        """Refuse a transition that does not fit the state; rclpy raises and leaves no answer."""
        service = self._own_service(ChangeState)
        change = service.callback

        def guarded(request: Any, response: Any) -> Any:
            try:
                return change(request, response)
            except Exception as error:  # RCLError, which rclpy does not export
                self.get_logger().warning(f'transition {request.transition.id} refused: {error}')
                response.success = False
                return response

        service.callback = guarded

    def _lifecycle(self) -> str:
        """Label of the lifecycle state, as anybody may ask for it: rclpy's only public way."""
        answer = self._own_service(GetState).callback(GetState.Request(), GetState.Response())
        return str(answer.current_state.label)

    def _own_service(self, kind: Any) -> Any:
        return next(service for service in self.services if service.srv_type is kind)

    @property
    def settings(self) -> NodeParameters:
        """The node's own parameters as they stand."""
        return self._settings

    def autostart(self) -> None:
        """Configure and activate without a lifecycle manager.

        Raises:
            RgbdKcfError: where that fails.
        """
        if self.trigger_configure() != SUCCESS or self.trigger_activate() != SUCCESS:
            raise RgbdKcfError(self.statistics.snapshot().last_error)

    # --- lifecycle -------------------------------------------------------------------------------

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make the tracker and the topics of its results."""
        try:
            settings = self._settings = self._parameters_server.node_parameters()
            self._session = Session(
                settings.variant,
                self._parameters_server.variant_parameters(settings.variant),
                self._refused,
                tell=self.get_logger().info,
            )
            self._session.everyone = settings.follow_everyone
            self._session.most = settings.max_targets
            warm_up(settings.variant)
            self._outputs = TrackPublishers(self, lambda: self._settings)
            if settings.target_frame or settings.fixed_frame:
                self._transforms = Transforms(self, settings, self._fault)
            self._processor = Processor(
                self._session,
                self._outputs,
                self.statistics,
                lambda: int(self.get_clock().now().nanoseconds),
                self._fault,
                color_transport=settings.color_transport,
                depth_transport=settings.depth_transport,
                places=self._transforms,
                max_pixels=settings.max_pixels,
            )
            self._requests = Requests(
                self._processor, lambda: self._settings, self._in_worker, self._fault
            )
            self._requests.from_parameters(frozenset({'init_box', 'auto_init'}))
        except Exception as error:  # rclpy would hide it
            self._cannot(f'cannot configure: {_first_line(error)}')
            self._take_down()
            return FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Listen to the camera and start the worker."""
        if self._processor is None or self._requests is None:
            return FAILURE
        if self._worker is not None and not self._worker.ended:
            self._cannot(
                'cannot activate: the tracker is still busy with an image from before; try again, '
                'or clean up'
            )
            return FAILURE
        settings = self._settings
        try:
            patient = settings.queue_policy == ALL
            self._intake = Intake(
                self.statistics,
                tolerance_s=settings.pair_tolerance,
                depth_wait_s=settings.depth_wait,
                camera_info_wait_s=settings.camera_info_wait,
                patient=patient,
                queue_size=settings.queue_size,
            )
            self._worker = Worker(
                self._processor,
                self._worker_failed,
                keep=settings.queue_size if patient else 1,
                catch_up=0 if patient else CATCH_UP,
            )
            self._inputs = Subscriptions(
                self,
                settings,
                color=self._on_color,
                depth=self._on_depth,
                camera_info=self._on_camera_info,
                init=self._requests.init,
                init_point=self._requests.init_point,
                add=self._requests.add,
                remove=self._requests.remove,
            )
        except Exception as error:  # rclpy would hide it
            self._cannot(f'cannot activate: {_first_line(error)}')
            self._stop_listening()
            return FAILURE
        # Known to the worker, too, which may have an image in work when the inputs have gone.
        self._topics = {kind: self._inputs.topic(name) for kind, name in SOURCES.items()}
        self.statistics.listening()
        self.get_logger().info(f'variant {settings.variant} listens to {self._inputs.describe()}')
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop listening; the target and its model are kept."""
        self._stop_listening()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Forget everything but the parameters."""
        self._take_down()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop for good."""
        self._stop_listening()
        self._take_down()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Back to unconfigured, from where the node can be configured again."""
        self._stop_listening()
        self._take_down()
        return super().on_error(state)

    def destroy_node(self) -> None:
        """Stop the worker before the topics go, and leave nothing behind that others find."""
        self._stop_listening()
        super().destroy_node()
        release_lifecycle_services(self)

    def _stop_listening(self) -> None:
        self._poll_timer.cancel()
        if self._inputs is not None:
            self._inputs.destroy()
            self._inputs = None
        if self._worker is not None and not self._worker.stop():
            self.get_logger().error('the tracker is still busy with an image: left behind')
        self._intake = None

    def _take_down(self) -> None:
        if self._outputs is not None:
            self._outputs.destroy()
            self._outputs = None
        if self._transforms is not None:
            self._transforms.destroy()
            self._transforms = None
        # A worker that is still busy keeps the session that it has; the next one is another.
        self._session = self._processor = self._requests = self._worker = None

    # --- receiving: store only -------------------------------------------------------------------

    def _on_color(self, message: Any) -> None:
        if self._intake is not None:
            if not self._intake.depth_expected and self._inputs is not None:
                # A camera that has just come up: what was so a second ago would cost its first
                # images their depth.
                self._intake.depth_expected = self._inputs.publishers()[DEPTH] > 0
            self._hand_over(self._intake.color(message, time.monotonic_ns()))

    def _on_depth(self, message: Any) -> None:
        if self._intake is not None:
            self._hand_over(self._intake.depth(message, time.monotonic_ns()))

    def _on_camera_info(self, message: CameraInfo) -> None:
        if self._intake is None or self._inputs is None:
            return
        try:
            camera = camera_from_info(
                message, self._inputs.topic(COLOR), self._settings.color_rectified
            )
        except RgbdKcfError as error:
            self._fault('bad_camera_info', f'camera_info cannot be used: {error}')
            return
        if camera is not None:
            self._hand_over(self._intake.camera_info(camera, time.monotonic_ns()))

    def _poll(self) -> None:
        if self._intake is not None:
            self._hand_over(self._intake.poll(time.monotonic_ns()))

    def _hand_over(self, captures: list[Capture]) -> None:
        if self._worker is None or self._intake is None:
            return
        if captures:
            self.statistics.count('dropped', self._worker.submit(*captures))
        # The timer runs only while something waits.
        if self._intake.idle:
            self._poll_timer.cancel()
        elif self._poll_timer.is_canceled():
            self._poll_timer.reset()

    # --- requests --------------------------------------------------------------------------------

    def _parameters_changed(self, names: frozenset[str]) -> None:
        self._settings = self._parameters_server.node_parameters()
        if self._requests is not None:
            self._requests.from_parameters(names)
        variant = self._settings.variant
        session = self._session
        if session is not None and any(n == 'variant' or '.' in n for n in names):
            parameters = self._parameters_server.variant_parameters(variant)
            self._in_worker('configure', lambda: session.configure(variant, parameters))
        if session is not None and 'follow_everyone' in names:
            wanted = self._settings.follow_everyone
            self._in_worker('everyone', lambda: setattr(session, 'everyone', wanted))
        if session is not None and 'max_targets' in names:
            most = self._settings.max_targets
            self._in_worker('most', lambda: setattr(session, 'most', most))

    def _reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._requests is not None:
            return self._requests.reset(request, response)
        response.success = False
        response.message = f'the node is {self._lifecycle()}: it has no target'
        return response

    def _in_worker(self, kind: str, function: Callable[[], None]) -> None:
        if self._worker is not None:
            self._worker.call(kind, function)
        else:
            function()

    # --- reporting -------------------------------------------------------------------------------

    def _worker_failed(self, error: Exception) -> None:
        self._fault('internal_errors', f'internal error: {type(error).__name__}: {error}')

    def _cannot(self, text: str) -> None:
        self.statistics.error('failed_transitions', text)
        self.get_logger().error(text)

    def _refused(self, text: str) -> None:
        """Count a request that cannot be met, and say it: who asked waits for the answer."""
        self.statistics.error(REJECTED, text)
        if self._refusals.allowed():
            self.get_logger().warning(text)

    def _fault(self, kind: str, text: str) -> None:
        """Count a fault and say it, each kind every few seconds at most; refusals always."""
        if kind in self._topics:
            text = f'{self._topics[kind]}: {text}'
        if len(text) > MOST_WORDS:  # an encoding or a model in a message may be of any length
            text = f'{text[:MOST_WORDS]} ...'
        if kind == REJECTED:
            self._refused(text)
            return
        self.statistics.error(kind, text)
        now = time.monotonic()
        if now - self._logged.get(kind, -LOG_PERIOD_S) >= LOG_PERIOD_S:
            self._logged[kind] = now
            self.get_logger().warning(text)

    def _publish_diagnostics(self) -> None:
        snapshot = self.statistics.snapshot()
        state = self._state(snapshot)
        self._tell_unheard(set(state.unheard.values()))
        self._diagnostics.publish(
            diagnostics_message(self.get_clock().now().to_msg(), state, snapshot)
        )

    def _tell_unheard(self, now: set[str]) -> None:
        """Warn of what was so the last time, too: of a new publisher not all is known at once.

        Once each, as it lasts until somebody mends it; again where it was mended meanwhile.
        """
        lasting = now & self._unheard
        for why in sorted(lasting - self._unheard_told):
            self.get_logger().warning(why)
        self._unheard, self._unheard_told = now, lasting

    def _unheard_now(self, snapshot: Snapshot) -> dict[str, str]:
        """Why nothing comes on inputs on which somebody publishes, and who answers beside us."""
        if self._session is None or self._inputs is None or self._intake is None:
            return {}
        ages = {COLOR: snapshot.image_age_s}
        if VARIANTS[self._session.variant].uses_depth:
            ages[DEPTH] = snapshot.depth_age_s
        oldest = self._settings.stale_after
        silent = [*REQUESTS, *(n for n, age in ages.items() if age is None or age > oldest)]
        if not self._intake.camera_known:
            silent.append(CAMERA_INFO)
        found = {name: self._inputs.unheard(name) for name in silent}
        answers = self.resolve_topic_name('~/box')
        if self.count_publishers(answers) > 1:
            found['~/box'] = (
                f'somebody else publishes {answers}, too: does another tracker run under this '
                'name, or is one replayed?'
            )
        return {name: why for name, why in found.items() if why}

    def _state(self, snapshot: Snapshot) -> NodeState:
        name = self.get_fully_qualified_name()
        lifecycle = self._lifecycle()
        session, wired = self._session, self._inputs
        if session is None:
            return NodeState(name, lifecycle)
        publishers = dict.fromkeys((COLOR, DEPTH, CAMERA_INFO), 0)
        if wired is not None and self._intake is not None:
            publishers = wired.publishers()
            self._intake.depth_expected = publishers[DEPTH] > 0
            self._intake.info_expected = publishers[CAMERA_INFO] > 0
        return NodeState(
            name=name,
            lifecycle=lifecycle,
            variant=session.variant,
            track=session.track.state,
            topic=wired.topic(COLOR) if wired is not None else '',
            depth_topic=wired.topic(DEPTH) if wired is not None else '',
            publishers=publishers[COLOR],
            depth_publishers=publishers[DEPTH],
            stale_after=self._settings.stale_after,
            uses_depth=VARIANTS[session.variant].uses_depth,
            depth_fault=self._intake.fit.fault if self._intake is not None else '',
            auto_init_fault=auto_init_fault(self._settings),
            unheard=self._unheard_now(snapshot),
        )


def _first_line(error: Exception) -> str:
    """What an error says, on one line; rclpy's may say nothing, or list its own arguments."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
