# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Everything the node says of a frame, each message made only if it is due or somebody listens."""

from __future__ import annotations

import importlib
from typing import Any

from geometry_msgs.msg import PointStamped, PolygonStamped
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image, RegionOfInterest
from std_msgs.msg import Bool, Header
from visualization_msgs.msg import Marker

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.recordings.overlay import draw_track
from rgbd_kcf_tracker.ros.messages import (
    detections_from_track,
    image_message,
    marker_from_track,
    polygon_from_box,
    position_from_track,
    roi_from_box,
)
from rgbd_kcf_tracker.track import Track

RESULT_DEPTH = 100
"""History of the result topics: three seconds at 30 Hz for a consumer that pauses."""
IMAGE_DEPTH = 2
MARKER_LIFETIME_S = 0.5
CLASS_ID = 'target'
NO_EVENTS = PublisherEventCallbacks(use_default_callbacks=False)
"""Each event that somebody could wait for costs the executor some 10 us with each message of any
topic; the defaults, two for each topic, only log a QoS that does not fit."""


def vision_messages() -> Any | None:
    """The module vision_msgs.msg, None where vision_msgs is not installed."""
    try:
        return importlib.import_module('vision_msgs.msg')
    except ImportError:
        return None


class TrackPublishers:
    """The result topics of a node, silent while it is not active."""

    def __init__(self, node: LifecycleNode) -> None:
        self._node = node
        self._vision = vision_messages()
        results, images = QoSProfile(depth=RESULT_DEPTH), QoSProfile(depth=IMAGE_DEPTH)
        self._all: list[Any] = []

        def publisher(kind: Any, topic: str, qos: QoSProfile) -> Any:
            made = node.create_lifecycle_publisher(kind, topic, qos, event_callbacks=NO_EVENTS)
            self._all.append(made)
            return made

        self._box = publisher(PolygonStamped, '~/box', results)
        self._occluded = publisher(Bool, '~/occluded', results)
        self._roi = publisher(RegionOfInterest, '~/roi', results)
        self._position = publisher(PointStamped, '~/position', results)
        self._marker = publisher(Marker, '~/marker', results)
        self._image = publisher(Image, '~/image_annotated', images)
        self._detections = (
            publisher(self._vision.Detection2DArray, '~/detections', results)
            if self._vision is not None
            else None
        )
        self._marked = False

    @property
    def image_wanted(self) -> bool:
        """Whether somebody subscribes to the annotated image."""
        return bool(self._image.get_subscription_count())

    def publish(self, header: Header, track: Track, size: tuple[int, int] | None) -> None:
        """The result of a frame, ``~/box`` last: who waits for it finds all others sent.

        Args:
            header: of the colour image, copied as it is.
            track: what the tracker says.
            size: width and height of the image, None where it could not be read.
        """
        self._occluded.publish(Bool(data=track.occluded))
        if track.box is not None and size is not None:
            roi = roi_from_box(track.box, *size)
            if roi is not None:
                self._roi.publish(roi)
        position = position_from_track(header, track)
        if position is not None:
            self._position.publish(position)
        if self._detections is not None and self._detections.get_subscription_count():
            self._detections.publish(detections_from_track(self._vision, header, track, CLASS_ID))
        self._box.publish(polygon_from_box(header, track.box))

    def publish_extras(
        self, header: Header, track: Track, frame: Frame, intrinsics: Intrinsics | None
    ) -> None:
        """What is for people to look at, after the result is out."""
        if self._marker.get_subscription_count() and (track.position is not None or self._marked):
            self._marker.publish(marker_from_track(header, track, intrinsics, MARKER_LIFETIME_S))
            self._marked = track.position is not None
        if self.image_wanted:
            self._image.publish(image_message(header, draw_track(frame.color, track), 'bgr8'))

    def destroy(self) -> None:
        """Take the topics down."""
        for made in self._all:
            self._node.destroy_lifecycle_publisher(made)
        self._all.clear()
