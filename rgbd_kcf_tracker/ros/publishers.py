# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Everything the node says of a frame, each message made only while somebody listens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile

from rgbd_kcf_tracker.live.answer import Answer
from rgbd_kcf_tracker.live.settings import ALL, OFF, NodeParameters
from rgbd_kcf_tracker.recordings.encoding import encode_compressed_color
from rgbd_kcf_tracker.recordings.evidence_messages import evidence_array
from rgbd_kcf_tracker.recordings.foxglove import ANNOTATIONS, image_annotations
from rgbd_kcf_tracker.recordings.messages import header_stamp
from rgbd_kcf_tracker.recordings.overlay import draw_track, draw_tracks
from rgbd_kcf_tracker.recordings.track_markers import TrackMarkers
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages
from rgbd_kcf_tracker.recordings.whereabouts import Walks
from rgbd_kcf_tracker.ros.messages import ROS_TYPES, image_message
from rgbd_kcf_tracker.ros.transforms import TargetFrames

RESULT_DEPTH = 100
"""History of the result topics: three seconds at 30 Hz for a consumer that pauses."""
IMAGE_DEPTH = 2
EVIDENCE_DEPTH = 10
"""History of what is for people to look at: some kilobytes each."""
NO_EVENTS = PublisherEventCallbacks(use_default_callbacks=False)
"""Each event that somebody could wait for costs the executor some 10 us with each message of any
topic; the defaults, two for each topic, only log a QoS that does not fit."""

TOPICS = {
    'state': 'diagnostic_msgs/msg/DiagnosticArray',
    'box': 'geometry_msgs/msg/PolygonStamped',
    'occluded': 'std_msgs/msg/Bool',
    'roi': 'sensor_msgs/msg/RegionOfInterest',
    'position': 'geometry_msgs/msg/PointStamped',
    'pose': 'geometry_msgs/msg/PoseStamped',
    'pose_with_covariance': 'geometry_msgs/msg/PoseWithCovarianceStamped',
    'twist': 'geometry_msgs/msg/TwistWithCovarianceStamped',
    'marker': 'visualization_msgs/msg/Marker',
    'markers': 'visualization_msgs/msg/MarkerArray',
    'camera_info': 'sensor_msgs/msg/CameraInfo',
}
OPTIONAL = {
    'detections': 'vision_msgs/msg/Detection2DArray',
    'detections3d': 'vision_msgs/msg/Detection3DArray',
    'annotations': ANNOTATIONS,
}
"""Of packages that are not in every ROS 2."""
ANNOTATED, COMPRESSED = 'image_annotated', 'image_annotated/compressed'
EVIDENCE = {'evidence': 'diagnostic_msgs/msg/DiagnosticArray'}
PICTURES = {ANNOTATED: 'sensor_msgs/msg/Image', COMPRESSED: 'sensor_msgs/msg/CompressedImage'}
IN_PICTURE = {'state', 'box', 'occluded', 'roi', 'camera_info'}
IN_SPACE = frozenset(TOPICS) - IN_PICTURE | {'detections3d'}


class TrackPublishers:
    """The result topics of a node, silent while it is not active.

    Args:
        node: whose they are.
        settings: gives the parameters as they stand: in which frame results go out, how long a
            prediction is a pose, and who becomes a TF frame.

    Raises:
        ParameterError: where they need what is not installed.
    """

    def __init__(self, node: LifecycleNode, settings: Callable[[], NodeParameters]) -> None:
        self._node = node
        self._settings, fixed = settings, settings()
        self._frame_id, self._everyones_frames = fixed.target_frame, fixed.publish_tf == ALL
        self._frames = TargetFrames(node, fixed) if fixed.publish_tf != OFF else None
        self._make = TrackMessages(ROS_TYPES)
        self._walks = Walks()
        self._markers = TrackMarkers(self._make)
        self._marked = False
        self._all: dict[str, Any] = {}
        for topic, kind in TOPICS.items():
            self._create(topic, kind, RESULT_DEPTH)
        for topic, kind in EVIDENCE.items():
            self._create(topic, kind, EVIDENCE_DEPTH)
        for topic, kind in PICTURES.items():
            self._create(topic, kind, IMAGE_DEPTH)
        for topic, kind in OPTIONAL.items():
            package = kind.partition('/')[0]
            if not ROS_TYPES.has(package):
                continue
            try:
                self._create(topic, kind, RESULT_DEPTH)
            except Exception as error:  # whatever loading a package that is half there may raise
                node.get_logger().warning(f'~/{topic} is left out: {package} is broken: {error}')

    def _create(self, topic: str, kind: str, depth: int) -> None:
        self._all[topic] = self._node.create_lifecycle_publisher(
            ROS_TYPES.type(kind), f'~/{topic}', QoSProfile(depth=depth), event_callbacks=NO_EVENTS
        )

    def wanted(self, *topics: str) -> bool:
        """Whether somebody subscribes to one of these topics."""
        return any(
            topic in self._all and self._all[topic].get_subscription_count() for topic in topics
        )

    @property
    def image_wanted(self) -> bool:
        """Whether somebody subscribes to the annotated image."""
        return self.wanted(*PICTURES)

    def publish(self, answer: Answer) -> None:
        """The result of a frame, ``~/box`` last: who waits for it finds all others sent."""
        header, track, frame, make = answer.header, answer.track, answer.frame, self._make
        if self.wanted('state'):
            self._send('state', make.state(header, answer.tracks))
        if self.wanted('occluded'):
            self._send('occluded', make.occluded(track))
        if frame is not None and self.wanted('roi'):
            self._send('roi', make.region(track.box, frame.width, frame.height))
        if self.wanted('detections'):
            self._send('detections', make.detections(header, answer.tracks))
        if self._frames is not None or self.wanted(*IN_SPACE):
            self._publish_in_space(answer)
        self._send('box', make.polygon(header, track.box))

    def _publish_in_space(self, answer: Answer) -> None:
        frame, make = answer.frame, self._make
        wheres = self._walks.update(
            answer.tracks,
            answer.time_ns,
            None if frame is None else frame.intrinsics,
            None if frame is None else frame.pose,
        )
        header = answer.header
        if self._frame_id not in ('', header.frame_id):
            if answer.place is None:
                return  # better nothing than something in a wrong frame
            header = make.header(header_stamp(header), self._frame_id)
            wheres = {who: where.seen_from(answer.place) for who, where in wheres.items()}
        where = wheres.get(answer.track.id)
        if self.wanted('detections3d'):
            self._send('detections3d', make.detections3d(header, wheres.values()))
        if self.wanted('marker') and (where is not None or self._marked):
            self._send('marker', make.marker(header, where))
            self._marked = where is not None
        if self.wanted('markers'):
            self._send('markers', self._markers.array(header, wheres.values()))
        near = {
            who: where
            for who, where in wheres.items()
            if where.hidden_s <= self._settings().pose_prediction
        }
        if self._frames is not None:
            if not self._everyones_frames:
                near = {who: w for who, w in near.items() if who == answer.track.id}
            camera = answer.header.frame_id
            self._frames.send(make, header, near.values(), answer.track.id, camera)
        if where is None:
            return
        if self.wanted('position'):
            self._send('position', make.position(header, where))
        if self.wanted('pose_with_covariance'):
            self._send('pose_with_covariance', make.pose_with_covariance(header, where))
        if self.wanted('twist'):
            self._send('twist', make.twist(header, where))
        if self.wanted('pose') and answer.track.id in near:
            self._send('pose', make.pose(header, where))

    def publish_extras(self, answer: Answer) -> None:
        """What is for people to look at, after the result is out."""
        header, frame, make = answer.header, answer.frame, self._make
        if frame is None:
            return
        if answer.insights is not None and self.wanted('evidence'):
            known, asked_for = answer.insights(), answer.asked_for
            message = evidence_array(ROS_TYPES, header, answer.tracks, known, asked_for)
            self._send('evidence', message)
        if self.wanted('annotations'):
            self._send('annotations', image_annotations(ROS_TYPES, header, answer.tracks))
        if frame.intrinsics is not None and self.wanted('camera_info'):
            info = make.camera_info(header, frame.width, frame.height, frame.intrinsics)
            self._send('camera_info', info)
        if not self.image_wanted:
            return
        if answer.others:
            tracks = {track.id: track for track in answer.tracks if track.id}
            picture = draw_tracks(frame.color, tracks)
        else:
            picture = draw_track(frame.color, answer.track)
        if self.wanted(ANNOTATED):
            self._send(ANNOTATED, image_message(header, picture, 'bgr8'))
        if self.wanted(COMPRESSED):
            quality = self._settings().jpeg_quality
            packed = encode_compressed_color(picture, quality=quality)
            self._send(COMPRESSED, make.compressed_image(header, packed))

    def _send(self, topic: str, message: Any | None) -> None:
        if message is not None:
            self._all[topic].publish(message)

    def destroy(self) -> None:
        """Take the topics down."""
        for made in self._all.values():
            self._node.destroy_lifecycle_publisher(made)
        self._all.clear()
        if self._frames is not None:
            self._frames.destroy()
