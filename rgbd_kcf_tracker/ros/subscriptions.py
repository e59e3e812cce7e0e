# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The topics that the tracker node listens to, and with what quality of service."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from geometry_msgs.msg import PointStamped
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from std_msgs.msg import UInt32

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.live.settings import ALL, AUTO, RAW, RELIABLE, NodeParameters
from rgbd_kcf_tracker.parameters import describe
from rgbd_kcf_tracker.ros.parameters import coerced, unknown
from rgbd_kcf_tracker.ros.unheard import unheard

COLOR, DEPTH, CAMERA_INFO = 'color/image', 'depth/image', 'color/camera_info'
REQUESTS = ('~/init', '~/init_point', '~/add', '~/remove')
REQUEST_DEPTH = 10
ROS_TOPICS = ('/clock.', '/parameter_events.', '/rosout.')
"""Of rclpy's own, which may have overrides too."""
NO_EVENTS = SubscriptionEventCallbacks(use_default_callbacks=False)
"""They cost time with each message (see publishers), and diagnostics say what is silent."""


class Subscriptions:
    """All subscriptions of an active node.

    Compressed images are sought where image_transport puts them: beside the raw topic, whatever
    that is remapped to.

    Args:
        node: whose they are.
        settings: transports and QoS.
        color, depth, camera_info, init, init_point, add, remove: called with each message.

    Raises:
        ParameterError: where colour and depth would be one topic, or an override of QoS cannot be.
    """

    def __init__(
        self,
        node: Node,
        settings: NodeParameters,
        *,
        color: Callable[[Any], None],
        depth: Callable[[Any], None],
        camera_info: Callable[[Any], None],
        init: Callable[[Any], None],
        init_point: Callable[[Any], None],
        add: Callable[[Any], None],
        remove: Callable[[Any], None],
    ) -> None:
        self._node, self._settings = node, settings
        self._all: dict[str, Any] = {}
        transports = {COLOR: settings.color_transport, DEPTH: settings.depth_transport}
        names = {
            topic: topic if transport == RAW else f'{node.resolve_topic_name(topic)}/{transport}'
            for topic, transport in transports.items()
        }
        one, other = map(node.resolve_topic_name, names.values())
        if one == other:
            raise ParameterError(
                f'{COLOR} and {DEPTH} are both {one}: remap each to a topic of its own'
            )
        overriding = QoSOverridingOptions.with_default_policies()
        _check_overrides(node, (one, other, node.resolve_topic_name(CAMERA_INFO)))
        try:
            for topic, callback in ((COLOR, color), (DEPTH, depth)):
                self._all[topic] = node.create_subscription(
                    Image if transports[topic] == RAW else CompressedImage,
                    names[topic],
                    callback,
                    image_qos(settings),
                    event_callbacks=NO_EVENTS,
                    qos_overriding_options=overriding,
                )
            self._all[CAMERA_INFO] = node.create_subscription(
                CameraInfo,
                CAMERA_INFO,
                camera_info,
                image_qos(settings),
                event_callbacks=NO_EVENTS,
                qos_overriding_options=overriding,
            )
            for request, kind, callback in zip(
                REQUESTS,
                (RegionOfInterest, PointStamped, RegionOfInterest, UInt32),
                (init, init_point, add, remove),
                strict=True,
            ):
                self._all[request] = node.create_subscription(
                    kind, request, callback, REQUEST_DEPTH, event_callbacks=NO_EVENTS
                )
        except BaseException:  # as for a wrong override: an inactive node hears no image
            self.destroy()
            raise

    def topic(self, name: str) -> str:
        """The full name of an input after remapping."""
        return str(self._all[name].topic_name)

    def publishers(self) -> dict[str, int]:
        """How many publish on each input."""
        names = COLOR, DEPTH, CAMERA_INFO
        return {name: self._node.count_publishers(self.topic(name)) for name in names}

    def unheard(self, name: str) -> str:
        """Why a publisher of an input is not heard, and what mends it; empty where all are."""
        made = self._all[name]
        if not self._node.count_publishers(made.topic_name):
            return ''
        if name in REQUESTS:
            return unheard(self._node, made, 'publish that', 'publish it reliable')
        cure_type = f'remap {name}'
        if name != CAMERA_INFO:
            cure_type += f', or set {name.partition("/")[0]}_transport'
        cure = 'reliability:=best_effort'
        if made.qos_profile.reliability != image_qos(self._settings).reliability:
            cure = f'qos_overrides.{made.topic_name}.subscription.{cure}'
        return unheard(self._node, made, cure_type, f'set {cure}')

    def describe(self) -> str:
        """The image topics, for the log."""
        return f'{self.topic(COLOR)} and {self.topic(DEPTH)}'

    def destroy(self) -> None:
        """Listen no more."""
        for made in self._all.values():
            self._node.destroy_subscription(made)
        self._all.clear()


def _check_overrides(node: Node, topics: Iterable[str]) -> None:
    """Warn of overrides that nobody reads, and refuse what rclpy refuses without naming it."""
    depth = next(info for info in describe(NodeParameters) if info.name == 'qos_depth')
    policies = {'depth': depth}
    for policy, kind in (('history', HistoryPolicy), ('reliability', ReliabilityPolicy)):
        words = tuple(word for word in kind.short_keys() if word != 'unknown')
        policies[policy] = replace(depth, type=str, minimum=None, maximum=None, choices=words)
    prefix = 'qos_overrides'
    known = {
        name: replace(info, name=name)
        for topic in topics
        for policy, info in policies.items()
        for name in (f'{prefix}.{topic}.subscription.{policy}',)
    }
    for rest in node.get_parameters_by_prefix(prefix):
        name = f'{prefix}.{rest}'
        if name in known:
            coerced(known[name], node.get_parameter(name).value)
        elif not rest.startswith(ROS_TOPICS):
            node.get_logger().warning(unknown(name, known))


def image_qos(settings: NodeParameters) -> QoSProfile:
    """QoS of the image subscriptions: best effort hears reliable and best-effort publishers."""
    wanted = settings.reliability
    reliable = wanted == RELIABLE or (wanted == AUTO and settings.queue_policy == ALL)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=settings.qos_depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
    )
