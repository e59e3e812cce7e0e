# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A track as ROS messages of rosbags' typestore: the same that the tracker node publishes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.camera_info import model_of
from rgbd_kcf_tracker.recordings.mcap_writer import types
from rgbd_kcf_tracker.track import Track

_MARKER_LIFETIME_NS = 500_000_000


def header(stamp_ns: int, frame_id: str) -> Any:
    """``std_msgs/Header``."""
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    time = types()['builtin_interfaces/msg/Time'](seconds, nanoseconds)
    return types()['std_msgs/msg/Header'](time, frame_id)


def polygon(head: Any, box: Box | None) -> Any:
    """``geometry_msgs/PolygonStamped``: four corners in pixels, none where there is no box."""
    point = types()['geometry_msgs/msg/Point32']
    points = []
    if box is not None:
        corners = ((box.x, box.y), (box.right, box.y), (box.right, box.bottom), (box.x, box.bottom))
        points = [point(x, y, 0.0) for x, y in corners]
    return types()['geometry_msgs/msg/PolygonStamped'](
        head, types()['geometry_msgs/msg/Polygon'](points)
    )


def region(track: Track, width: int, height: int) -> Any | None:
    """``sensor_msgs/RegionOfInterest`` of whole pixels; None where no box is in the image."""
    box = None if track.box is None else track.box.clipped(width, height)
    if box is None:
        return None
    left, top = math.floor(box.x), math.floor(box.y)
    right, bottom = math.ceil(box.right), math.ceil(box.bottom)
    return types()['sensor_msgs/msg/RegionOfInterest'](left, top, bottom - top, right - left, False)


def position(head: Any, track: Track) -> Any | None:
    """``geometry_msgs/PointStamped`` in metres, optical frame; None where it is unknown."""
    if track.box is None or track.position is None or not np.all(np.isfinite(track.position)):
        return None
    point = types()['geometry_msgs/msg/Point'](*(float(v) for v in track.position))
    return types()['geometry_msgs/msg/PointStamped'](head, point)


def marker(head: Any, track: Track, intrinsics: Intrinsics | None) -> Any:
    """``visualization_msgs/Marker``: a box about the target, or its removal."""
    kinds = types()
    cls = kinds['visualization_msgs/msg/Marker']
    vector, point = kinds['geometry_msgs/msg/Vector3'], kinds['geometry_msgs/msg/Point']
    place = position(head, track)
    action, at, size = cls.DELETE, point(0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0)
    if place is not None and intrinsics is not None and track.box is not None:
        action, at = cls.ADD, place.point
        width = max(track.box.width * at.z / intrinsics.fx, 0.01)
        height = max(track.box.height * at.z / intrinsics.fy, 0.01)
        size = vector(width, height, min(width, height, 0.5))
    empty = kinds['sensor_msgs/msg/CompressedImage'](header(0, ''), '', np.zeros(0, np.uint8))
    return cls(
        header=head,
        ns='target',
        id=0,
        type=cls.CUBE,
        action=action,
        pose=kinds['geometry_msgs/msg/Pose'](
            at, kinds['geometry_msgs/msg/Quaternion'](0.0, 0.0, 0.0, 1.0)
        ),
        scale=size,
        color=kinds['std_msgs/msg/ColorRGBA'](0.1, 0.8, 0.3, 0.5),
        lifetime=kinds['builtin_interfaces/msg/Duration'](0, _MARKER_LIFETIME_NS),
        frame_locked=False,
        points=[],
        colors=[],
        texture_resource='',
        texture=empty,
        uv_coordinates=[],
        text='',
        mesh_resource='',
        mesh_file=kinds['visualization_msgs/msg/MeshFile']('', np.zeros(0, np.uint8)),
        mesh_use_embedded_materials=False,
    )


def camera_info(head: Any, width: int, height: int, intrinsics: Intrinsics) -> Any:
    """``sensor_msgs/CameraInfo`` of the camera of images as they are: not rectified any more."""
    model, coefficients = model_of(intrinsics.lens)
    fx, fy, cx, cy = intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy
    return types()['sensor_msgs/msg/CameraInfo'](
        header=head,
        height=height,
        width=width,
        distortion_model=model,
        d=np.array(coefficients, np.float64),
        k=np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1], np.float64),
        r=np.eye(3).reshape(-1),
        p=np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], np.float64),
        binning_x=0,
        binning_y=0,
        roi=types()['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False),
    )
