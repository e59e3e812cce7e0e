# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the tracker publishes, kept as it came over the wire."""

from __future__ import annotations

import math
import threading
from contextlib import suppress
from pathlib import Path

import rclpy
from geometry_msgs.msg import PointStamped, PolygonStamped
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import RegionOfInterest
from std_msgs.msg import Bool

from rgbd_kcf_tracker.recordings.mcap_writer import McapWriter
from rgbd_kcf_tracker.recordings.messages import box_from_polygon
from rgbd_kcf_tracker.ros.messages import stamp_to_ns
from rgbd_kcf_tracker.track import Track, TrackState

TRACKER = '/tracker'
_KINDS = {
    'box': (PolygonStamped, 'geometry_msgs/msg/PolygonStamped'),
    'occluded': (Bool, 'std_msgs/msg/Bool'),
    'roi': (RegionOfInterest, 'sensor_msgs/msg/RegionOfInterest'),
    'position': (PointStamped, 'geometry_msgs/msg/PointStamped'),
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
        """The answers by the stamp of their image, as far as the topics tell.

        ``~/occluded`` carries no stamp; it comes once for each ``~/box``, in the same order. The
        score is NaN, since no topic of the standard messages says it.
        """
        boxes = [deserialize_message(raw, PolygonStamped) for raw in self._raw['box']]
        hidden = [deserialize_message(raw, Bool).data for raw in self._raw['occluded']]
        hidden += [False] * (len(boxes) - len(hidden))
        places = {}
        for raw in self._raw['position']:
            message = deserialize_message(raw, PointStamped)
            point = message.point
            places[stamp_to_ns(message.header.stamp)] = (point.x, point.y, point.z)
        tracks = {}
        for message, occluded in zip(boxes, hidden, strict=False):
            stamp = stamp_to_ns(message.header.stamp)
            box = box_from_polygon(message.polygon.points)
            if box is None:
                state = TrackState.OCCLUDED if occluded else TrackState.IDLE
                tracks[stamp] = Track(None, state)
                continue
            place = places.get(stamp)
            depth = None if place is None else place[2]
            tracks[stamp] = Track(box, TrackState.TRACKING, math.nan, depth, place)
        return tracks

    def write(self, path: Path) -> None:
        """Write the messages as a bag; those without a stamp get that of the box beside them."""
        stamps = [
            stamp_to_ns(deserialize_message(raw, PolygonStamped).header.stamp)
            for raw in self._raw['box']
        ]
        last = stamps[-1] if stamps else 0
        entries: list[tuple[int, str, bytes]] = []
        for name, messages in self._raw.items():
            with_box = iter(self._stamps_with_box(stamps))
            for index, raw in enumerate(messages):
                if name == 'roi':
                    stamp = next(with_box, last)
                elif name == 'position':
                    stamp = stamp_to_ns(deserialize_message(raw, PointStamped).header.stamp)
                else:
                    stamp = stamps[index] if index < len(stamps) else last
                entries.append((stamp, name, raw))
        with McapWriter(path, overwrite=True) as bag:
            for stamp, name, raw in sorted(entries, key=lambda e: (e[0], e[1])):
                bag.write_raw(f'{TRACKER}/{name}', _KINDS[name][1], bytes(raw), stamp)

    def _stamps_with_box(self, stamps: list[int]) -> list[int]:
        tracks = self.tracks()
        return [s for s in stamps if tracks[s].box is not None]

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
