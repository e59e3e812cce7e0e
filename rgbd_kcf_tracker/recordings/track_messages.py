# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A track as ROS messages: the one description of what the node publishes and bags hold.

What makes the messages is handed in, see :mod:`~rgbd_kcf_tracker.recordings.message_types`: rclpy's
classes for publishers, rosbags' for bags.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.recordings.camera_info import model_of
from rgbd_kcf_tracker.recordings.encoding import PackedImage, RawImage
from rgbd_kcf_tracker.recordings.message_types import MessageTypes
from rgbd_kcf_tracker.recordings.messages import (
    BOX_KEYS,
    POSITION_KEYS,
    PREDICTED_KEY,
    target_name,
)
from rgbd_kcf_tracker.recordings.storage import NANOSECONDS
from rgbd_kcf_tracker.recordings.whereabouts import Whereabouts
from rgbd_kcf_tracker.track import Track

MARKER_LIFETIME_NS = 500_000_000
"""After which a viewer takes away what nobody renews."""
CLASS_ID = 'target'
"""What stands as the class of a detection: the tracker does not know what it follows."""
TILT_VARIANCE = math.radians(10) ** 2
"""Square radians by which a target may lean, and by which "up" may be wrong in a camera's frame."""
TURNING_VARIANCE = math.pi**2
"""Square radians per second: nothing is known of how fast a target turns."""


class TrackMessages:
    """Fills messages from tracks.

    Args:
        types: makes the messages.

    Attributes:
        types: likewise.
    """

    def __init__(self, types: MessageTypes) -> None:
        self.types, self._make = types, types.make

    def header(self, stamp_ns: int, frame_id: str) -> Any:
        """``std_msgs/Header``.

        Raises:
            RecordingError: for a stamp beyond the 32 bits of seconds that it has.
        """
        seconds, nanoseconds = divmod(stamp_ns, NANOSECONDS)
        if not -(1 << 31) <= seconds < 1 << 31:
            raise RecordingError(
                f'the stamp {stamp_ns} ns is beyond the seconds that a ROS message holds'
            )
        stamp = self._make('builtin_interfaces/msg/Time', sec=seconds, nanosec=nanoseconds)
        return self._make('std_msgs/msg/Header', stamp=stamp, frame_id=frame_id)

    def state(self, header: Any, tracks: Sequence[Track]) -> Any:
        """``diagnostic_msgs/DiagnosticArray``: all that is known of each target, one stamp for it.

        Read again by :func:`~rgbd_kcf_tracker.recordings.messages.tracks_of_state`.

        Args:
            header: of the colour image: box and position are in its frame.
            tracks: the chosen target first.
        """
        make = self._make
        array = make('diagnostic_msgs/msg/DiagnosticArray', header=header)
        for number, track in enumerate(tracks):
            status = make(
                'diagnostic_msgs/msg/DiagnosticStatus',
                name=target_name(number, track),
                message=track.state.value,
                values=[
                    make('diagnostic_msgs/msg/KeyValue', key=key, value=value)
                    for key, value in _values(track)
                ],
            )
            status.level = status.WARN if track.occluded else status.OK
            array.status.append(status)
        return array

    # -- in the picture ---------------------------------------------------------------------------

    def polygon(self, header: Any, box: Box | None) -> Any:
        """``geometry_msgs/PolygonStamped``: four corners in pixels, clockwise from the top left.

        No points where there is no box.
        """
        points = []
        if box is not None:
            points = [
                self._make('geometry_msgs/msg/Point32', x=x, y=y, z=0.0)
                for x, y in (
                    (box.x, box.y),
                    (box.right, box.y),
                    (box.right, box.bottom),
                    (box.x, box.bottom),
                )
            ]
        polygon = self._make('geometry_msgs/msg/Polygon', points=points)
        return self._make('geometry_msgs/msg/PolygonStamped', header=header, polygon=polygon)

    def occluded(self, track: Track) -> Any:
        """``std_msgs/Bool``."""
        return self._make('std_msgs/msg/Bool', data=track.occluded)

    def region(self, box: Box | None, width: int, height: int) -> Any | None:
        """``sensor_msgs/RegionOfInterest``: the whole pixels of the image that a box covers.

        None where it covers none.
        """
        inside = None if box is None else box.clipped(width, height)
        if inside is None:
            return None
        left, top = math.floor(inside.x), math.floor(inside.y)
        right, bottom = math.ceil(inside.right), math.ceil(inside.bottom)
        if right <= left or bottom <= top:
            return None
        return self._make(
            'sensor_msgs/msg/RegionOfInterest',
            x_offset=left,
            y_offset=top,
            width=right - left,
            height=bottom - top,
        )

    def detections(self, header: Any, tracks: Iterable[Track]) -> Any:
        """``vision_msgs/Detection2DArray``: one for each target that has a box, with its id."""
        make, found = self._make, []
        for track in tracks:
            if track.box is None:
                continue
            box = track.box
            position = make('vision_msgs/msg/Point2D', x=box.cx, y=box.cy)
            center = make('vision_msgs/msg/Pose2D', position=position, theta=0.0)
            found.append(
                make(
                    'vision_msgs/msg/Detection2D',
                    header=header,
                    id=str(track.id),
                    results=[self._hypothesis(track)],
                    bbox=make(
                        'vision_msgs/msg/BoundingBox2D',
                        center=center,
                        size_x=box.width,
                        size_y=box.height,
                    ),
                )
            )
        return make('vision_msgs/msg/Detection2DArray', header=header, detections=found)

    # -- in space ---------------------------------------------------------------------------------

    def position(self, header: Any, where: Whereabouts | None) -> Any | None:
        """``geometry_msgs/PointStamped`` in metres; None where the target is not read."""
        if where is None or where.predicted:
            return None
        return self._make(
            'geometry_msgs/msg/PointStamped', header=header, point=self.point(where.position)
        )

    def pose(self, header: Any, where: Whereabouts) -> Any:
        """``geometry_msgs/PoseStamped``: x forward along the walk, z up."""
        return self._make(
            'geometry_msgs/msg/PoseStamped', header=header, pose=self.pose_of(where.heading)
        )

    def pose_with_covariance(self, header: Any, where: Whereabouts) -> Any | None:
        """``geometry_msgs/PoseWithCovarianceStamped``; None where the covariance is unknown."""
        if where.covariance is None:
            return None
        return self._make(
            'geometry_msgs/msg/PoseWithCovarianceStamped',
            header=header,
            pose=self._uncertain_pose(where.heading, where),
        )

    def twist(self, header: Any, where: Whereabouts) -> Any | None:
        """``geometry_msgs/TwistWithCovarianceStamped``; None where the velocity is unknown.

        The velocity is over the ground, along the axes of the header's frame.
        """
        if where.velocity is None or where.velocity_covariance is None:
            return None
        make = self._make
        twist = make('geometry_msgs/msg/Twist', linear=self.vector(where.velocity))
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = where.velocity_covariance
        covariance[3:, 3:] = TURNING_VARIANCE * np.eye(3)
        return make(
            'geometry_msgs/msg/TwistWithCovarianceStamped',
            header=header,
            twist=make(
                'geometry_msgs/msg/TwistWithCovariance', twist=twist, covariance=covariance.ravel()
            ),
        )

    def detections3d(self, header: Any, wheres: Iterable[Whereabouts]) -> Any:
        """``vision_msgs/Detection3DArray``: one for each target that is seen, with its id.

        The box is in metres, its axes those of the camera; the pose is that of the target.
        """
        make, found = self._make, []
        for where in wheres:
            if where.size is None:
                continue
            hypothesis = self._hypothesis(where.track)
            if where.covariance is not None:
                hypothesis.pose = self._uncertain_pose(where.heading, where)
            else:
                hypothesis.pose.pose = self.pose_of(where.heading)
            box = make(
                'vision_msgs/msg/BoundingBox3D',
                center=self.pose_of(Pose(where.camera.rotation, where.position)),
                size=self.vector(where.size),
            )
            found.append(
                make(
                    'vision_msgs/msg/Detection3D',
                    header=header,
                    id=str(where.track.id),
                    results=[hypothesis],
                    bbox=box,
                )
            )
        return make('vision_msgs/msg/Detection3DArray', header=header, detections=found)

    def transform(self, header: Any, child: str, where: Whereabouts) -> Any:
        """``geometry_msgs/TransformStamped`` of the frame ``child``: x along the walk, z up."""
        pose = self.pose_of(where.heading)
        return self._make(
            'geometry_msgs/msg/TransformStamped',
            header=header,
            child_frame_id=child,
            transform=self._make(
                'geometry_msgs/msg/Transform',
                translation=self.vector(where.position),
                rotation=pose.orientation,
            ),
        )

    def marker(self, header: Any, where: Whereabouts | None) -> Any:
        """``visualization_msgs/Marker``: a box about the target, or the order to remove it.

        Its extent along the optical axis cannot be seen from one side: it is drawn as wide as the
        narrower side, half a metre at most.
        """
        make = self._make
        marker = make('visualization_msgs/msg/Marker', header=header, ns='target', id=0)
        marker.type = marker.CUBE
        marker.pose.orientation.w = 1.0
        if where is None or where.size is None:
            marker.action = marker.DELETE
            return marker
        marker.action = marker.ADD
        marker.pose = self.pose_of(Pose(where.camera.rotation, where.position))
        marker.scale = self.vector(where.size)
        marker.color = make('std_msgs/msg/ColorRGBA', r=0.1, g=0.8, b=0.3, a=0.5)
        marker.lifetime = make('builtin_interfaces/msg/Duration', nanosec=MARKER_LIFETIME_NS)
        return marker

    # -- the camera -------------------------------------------------------------------------------

    def camera_info(self, header: Any, width: int, height: int, intrinsics: Intrinsics) -> Any:
        """``sensor_msgs/CameraInfo`` of the camera of images as they are: not rectified."""
        model, coefficients = model_of(intrinsics.lens)
        fx, fy, cx, cy = intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy
        return self._make(
            'sensor_msgs/msg/CameraInfo',
            header=header,
            height=height,
            width=width,
            distortion_model=model,
            d=np.array(coefficients, np.float64),
            k=np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1], np.float64),
            r=np.eye(3).reshape(-1),
            p=np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], np.float64),
        )

    def image(self, header: Any, raw: RawImage) -> Any:
        """``sensor_msgs/Image``."""
        return self._make(
            'sensor_msgs/msg/Image',
            header=header,
            height=raw.height,
            width=raw.width,
            encoding=raw.encoding,
            is_bigendian=raw.is_bigendian,
            step=raw.step,
            data=self.types.octets(raw.data),
        )

    def compressed_image(self, header: Any, packed: PackedImage) -> Any:
        """``sensor_msgs/CompressedImage``."""
        return self._make(
            'sensor_msgs/msg/CompressedImage',
            header=header,
            format=packed.format,
            data=self.types.octets(packed.data),
        )

    # -- parts ------------------------------------------------------------------------------------

    def _hypothesis(self, track: Track) -> Any:
        make = self._make
        hypothesis = make(
            'vision_msgs/msg/ObjectHypothesis', class_id=CLASS_ID, score=float(track.score)
        )
        return make('vision_msgs/msg/ObjectHypothesisWithPose', hypothesis=hypothesis)

    def point(self, at: FloatArray) -> Any:
        """``geometry_msgs/Point`` of ``(3,)`` metres."""
        x, y, z = (float(v) for v in at)
        return self._make('geometry_msgs/msg/Point', x=x, y=y, z=z)

    def vector(self, of: FloatArray) -> Any:
        """``geometry_msgs/Vector3`` of ``(3,)``, in whatever unit the field has."""
        x, y, z = (float(v) for v in of)
        return self._make('geometry_msgs/msg/Vector3', x=x, y=y, z=z)

    def pose_of(self, pose: Pose) -> Any:
        """``geometry_msgs/Pose``."""
        x, y, z, w = pose.quaternion
        return self._make(
            'geometry_msgs/msg/Pose',
            position=self.point(pose.translation),
            orientation=self._make('geometry_msgs/msg/Quaternion', x=x, y=y, z=z, w=w),
        )

    def _uncertain_pose(self, pose: Pose, where: Whereabouts) -> Any:
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = where.covariance
        along = np.outer(where.up, where.up)
        covariance[3:, 3:] = where.heading_sigma**2 * along + TILT_VARIANCE * (np.eye(3) - along)
        return self._make(
            'geometry_msgs/msg/PoseWithCovariance',
            pose=self.pose_of(pose),
            covariance=covariance.ravel(),
        )


def _values(track: Track) -> Iterator[tuple[str, str]]:
    """What a state says of a target, by name: pixels and metres to a thousandth."""
    yield 'id', str(track.id)
    yield 'score', f'{track.score:.4f}'
    if track.box is not None:
        for name, value in zip(BOX_KEYS, track.box.as_tuple(), strict=True):
            yield name, f'{value:.3f}'
    if track.place is not None:
        for name, metres in zip(POSITION_KEYS, track.place, strict=True):
            yield name, f'{metres:.3f}'
        yield PREDICTED_KEY, 'true' if track.position is None else 'false'
