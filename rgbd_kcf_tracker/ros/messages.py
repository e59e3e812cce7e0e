# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Between ROS messages and our types: nothing here knows of nodes or topics.

Reading images and cameras is not here: the recordings and the node share
:mod:`rgbd_kcf_tracker.recordings.images` and :mod:`rgbd_kcf_tracker.recordings.messages`, so that a
bag and a live camera give the same frames.
"""

from __future__ import annotations

import array
import math
from typing import Any

import numpy as np
import numpy.typing as npt
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Point32, PointStamped, PolygonStamped
from sensor_msgs.msg import Image, RegionOfInterest
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from rgbd_kcf_tracker.errors import BoxError
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.track import Track

NANOSECONDS = 1_000_000_000


def stamp_to_ns(stamp: Time) -> int:
    """Nanoseconds since the epoch of a message's stamp."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def stamp_from_ns(stamp_ns: int) -> Time:
    """The stamp of a time in nanoseconds."""
    return Time(sec=stamp_ns // NANOSECONDS, nanosec=stamp_ns % NANOSECONDS)


def box_from_roi(roi: RegionOfInterest) -> Box:
    """The box that a region of interest names.

    Raises:
        BoxError: where the region has no size.
    """
    if roi.width == 0 or roi.height == 0:
        raise BoxError(
            f'region of interest {roi.width}x{roi.height} has no size: '
            'set x_offset, y_offset, width and height in pixels of the colour image'
        )
    return Box(float(roi.x_offset), float(roi.y_offset), float(roi.width), float(roi.height))


def roi_from_box(box: Box, width: int, height: int) -> RegionOfInterest | None:
    """The whole pixels of the ``width`` x ``height`` image that a box covers; None where none."""
    left, top = max(math.floor(box.x), 0), max(math.floor(box.y), 0)
    right, bottom = min(math.ceil(box.right), width), min(math.ceil(box.bottom), height)
    if right <= left or bottom <= top:
        return None
    return RegionOfInterest(x_offset=left, y_offset=top, width=right - left, height=bottom - top)


def polygon_from_box(header: Header, box: Box | None) -> PolygonStamped:
    """Four corners in pixels, clockwise from the top left; no points where there is no box."""
    message = PolygonStamped(header=header)
    if box is not None:
        message.polygon.points = [
            Point32(x=x, y=y, z=0.0)
            for x, y in (
                (box.x, box.y),
                (box.right, box.y),
                (box.right, box.bottom),
                (box.x, box.bottom),
            )
        ]
    return message


def position_from_track(header: Header, track: Track) -> PointStamped | None:
    """Where the target is in the camera's optical frame, in metres; None while that is unknown."""
    if track.box is None or track.position is None or not np.all(np.isfinite(track.position)):
        return None
    x, y, z = track.position
    return PointStamped(header=header, point=Point(x=float(x), y=float(y), z=float(z)))


def marker_from_track(
    header: Header, track: Track, intrinsics: Intrinsics | None, lifetime_s: float
) -> Marker:
    """A box round the target for RViz, or the order to remove it while there is none.

    Its width and height are the box's at the target's depth. Its extent along the optical axis
    cannot be seen from one side: it is drawn as wide as the narrower side, half a metre at most.
    """
    marker = Marker(header=header, ns='target', id=0, type=Marker.CUBE)
    position = position_from_track(header, track)
    if position is None or intrinsics is None or track.box is None:
        marker.action = Marker.DELETE
        return marker
    marker.action = Marker.ADD
    marker.pose.position = position.point
    marker.pose.orientation.w = 1.0
    z = position.point.z
    width = max(track.box.width * z / intrinsics.fx, 0.01)
    height = max(track.box.height * z / intrinsics.fy, 0.01)
    marker.scale.x, marker.scale.y = width, height
    marker.scale.z = min(width, height, 0.5)
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = 0.1, 0.8, 0.3, 0.5
    whole = int(lifetime_s)
    marker.lifetime = Duration(sec=whole, nanosec=int((lifetime_s - whole) * NANOSECONDS))
    return marker


def detections_from_track(types: Any, header: Header, track: Track, class_id: str) -> Any:
    """A ``vision_msgs/Detection2DArray``: one detection, or none while there is no box.

    Args:
        types: the module ``vision_msgs.msg``, which is not always installed.
        header: of the colour image.
        track: what the tracker says of it.
        class_id: what stands as class and id of the target.
    """
    message = types.Detection2DArray(header=header)
    if track.box is None:
        return message
    detection = types.Detection2D(header=header, id=class_id)
    detection.bbox.center.position.x = track.box.cx
    detection.bbox.center.position.y = track.box.cy
    detection.bbox.center.theta = 0.0
    detection.bbox.size_x = track.box.width
    detection.bbox.size_y = track.box.height
    result = types.ObjectHypothesisWithPose()
    result.hypothesis.class_id = class_id
    result.hypothesis.score = float(track.score)
    if track.position is not None:
        place = result.pose.pose.position
        place.x, place.y, place.z = (float(v) for v in track.position)
    detection.results = [result]
    message.detections = [detection]
    return message


def image_message(header: Header, image: npt.NDArray[Any], encoding: str) -> Image:
    """An image message of a ``(H, W)`` or ``(H, W, C)`` array, rows without padding.

    The data go through a local array('B'), whose assignment takes no copy: 0.3 ms at 1920x1080
    where a memoryview takes 170 ms and an ndarray 300 ms.
    """
    image = np.ascontiguousarray(image)
    data = array.array('B')
    data.frombytes(image.data.cast('B'))
    message = Image(header=header, encoding=encoding)
    message.height, message.width = int(image.shape[0]), int(image.shape[1])
    message.is_bigendian = 0
    message.step = int(image.strides[0])
    message.data = data
    return message
