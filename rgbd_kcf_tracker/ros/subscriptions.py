# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The topics that the tracker node listens to, and with what quality of service."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PointStamped
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from std_msgs.msg import UInt32

from rgbd_kcf_tracker.live.settings import ALL, AUTO, RAW, RELIABLE, NodeParameters

COLOR, DEPTH, CAMERA_INFO = 'color/image', 'depth/image', 'color/camera_info'
REQUEST_DEPTH = 10
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
        self._node = node
        overriding = QoSOverridingOptions.with_default_policies()
        self._topics: dict[str, str] = {}
        self._all: list[Any] = []
        for topic, transport, callback in (
            (COLOR, settings.color_transport, color),
            (DEPTH, settings.depth_transport, depth),
        ):
            kind: Any = Image
            name = topic
            if transport != RAW:
                kind = CompressedImage
                name = f'{node.resolve_topic_name(topic)}/{transport}'
            made = node.create_subscription(
                kind,
                name,
                callback,
                image_qos(settings),
                event_callbacks=NO_EVENTS,
                qos_overriding_options=overriding,
            )
            self._topics[topic] = made.topic_name
            self._all.append(made)
        info = node.create_subscription(
            CameraInfo,
            CAMERA_INFO,
            camera_info,
            image_qos(settings),
            event_callbacks=NO_EVENTS,
            qos_overriding_options=overriding,
        )
        self._topics[CAMERA_INFO] = info.topic_name
        self._all.append(info)
        for kind, request, callback in (
            (RegionOfInterest, '~/init', init),
            (PointStamped, '~/init_point', init_point),
            (RegionOfInterest, '~/add', add),
            (UInt32, '~/remove', remove),
        ):
            self._all.append(
                node.create_subscription(
                    kind, request, callback, REQUEST_DEPTH, event_callbacks=NO_EVENTS
                )
            )

    def topic(self, name: str) -> str:
        """The full name of an input after remapping."""
        return self._topics[name]

    def publishers(self) -> dict[str, int]:
        """How many publish on each input."""
        return {name: self._node.count_publishers(topic) for name, topic in self._topics.items()}

    def describe(self) -> str:
        """The image topics, for the log."""
        return f'{self._topics[COLOR]} and {self._topics[DEPTH]}'

    def destroy(self) -> None:
        """Listen no more."""
        for made in self._all:
            self._node.destroy_subscription(made)
        self._all.clear()


def image_qos(settings: NodeParameters) -> QoSProfile:
    """QoS of the image subscriptions: best effort hears reliable and best-effort publishers."""
    wanted = settings.reliability
    reliable = wanted == RELIABLE or (wanted == AUTO and settings.queue_policy == ALL)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=settings.qos_depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
    )
