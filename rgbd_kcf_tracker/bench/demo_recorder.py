# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the tracker publishes, kept as it came over the wire."""

from __future__ import annotations

import threading
from contextlib import suppress
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import (
    PointStamped,
    PolygonStamped,
    PoseStamped,
    PoseWithCovarianceStamped,
    TwistWithCovarianceStamped,
)
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from rgbd_kcf_tracker.recordings.mcap_writer import McapWriter
from rgbd_kcf_tracker.recordings.messages import stamp_of, tracks_of_state
from rgbd_kcf_tracker.track import Track

TRACKER = '/tracker'
_KINDS = {
    'state': (DiagnosticArray, 'diagnostic_msgs/msg/DiagnosticArray'),
    'box': (PolygonStamped, 'geometry_msgs/msg/PolygonStamped'),
    'position': (PointStamped, 'geometry_msgs/msg/PointStamped'),
    'pose': (PoseStamped, 'geometry_msgs/msg/PoseStamped'),
    'pose_with_covariance': (
        PoseWithCovarianceStamped,
        'geometry_msgs/msg/PoseWithCovarianceStamped',
    ),
    'twist': (TwistWithCovarianceStamped, 'geometry_msgs/msg/TwistWithCovarianceStamped'),
}


class Recorder:
    """Subscribes to the tracker's topics in a thread; use it in a ``with`` block."""

    def __init__(self) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = Node('recorder', context=self._context)
        self._raw: dict[str, list[bytes]] = {name: [] for name in _KINDS}
        self._subscriptions = [
            self._node.create_subscription(
                kind, f'{TRACKER}/{name}', self._raw[name].append, QoSProfile(depth=1000), raw=True
            )
            for name, (kind, _) in _KINDS.items()
        ]
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name='recorder', daemon=True)
        self._thread.start()

    @property
    def hears_tracker(self) -> bool:
        """Whether every topic has found its publisher."""
        return all(s.get_publisher_count() for s in self._subscriptions)

    @property
    def count(self) -> int:
        """Answers so far."""
        return len(self._raw['box'])

    def tracks(self) -> dict[int, Track]:
        """The answers by the stamp of their image."""
        states = [deserialize_message(raw, DiagnosticArray) for raw in self._raw['state']]
        return {stamp_of(state): tracks_of_state(state)[0] for state in states}

    def write(self, path: Path) -> None:
        """Write the messages as a bag, each at its own stamp."""
        entries = [
            (stamp_of(deserialize_message(raw, _KINDS[name][0])), name, raw)
            for name, messages in self._raw.items()
            for raw in messages
        ]
        with McapWriter(path, overwrite=True) as bag:
            for stamp, name, raw in sorted(entries, key=lambda e: e[:2]):
                bag.write_raw(f'{TRACKER}/{name}', _KINDS[name][1], bytes(raw), stamp)

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self._executor.spin()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown(timeout_sec=2.0)
        self._thread.join(2.0)
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)
