# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What other messages than images mean: cameras, boxes, stamps; from rclpy or from rosbags."""

from __future__ import annotations

from typing import Any

from rgbd_kcf_tracker.errors import ImageError, RgbdKcfError
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.track import Track, TrackState


def intrinsics_from_info(msg: Any) -> Intrinsics | None:
    """The pinhole camera of a ``sensor_msgs/CameraInfo``.

    Args:
        msg: with ``k`` and ``p`` (ROS 2) or ``K`` and ``P`` (ROS 1).

    Returns:
        The intrinsics in ``K``, or in ``P`` where that is zero; None for an uncalibrated camera,
        where both are.

    Raises:
        ImageError: where the numbers are no camera (negative, infinite, too few).
    """
    k: Any = msg.k if hasattr(msg, 'k') else getattr(msg, 'K', ())
    p: Any = msg.p if hasattr(msg, 'p') else getattr(msg, 'P', ())
    try:
        from_k = tuple(float(k[i]) for i in (0, 4, 2, 5))
        from_p = tuple(float(p[i]) for i in (0, 5, 2, 6))
    except (IndexError, TypeError, ValueError):
        raise ImageError('camera_info has no 3x3 K and 3x4 P: leave it out or calibrate') from None
    values = from_k if from_k[0] or from_k[1] else from_p
    if not values[0] and not values[1]:
        return None
    try:
        return Intrinsics(*values)
    except RgbdKcfError as error:
        raise ImageError(f'camera_info is no camera: {error}') from None


def box_from_polygon(points: Any) -> Box | None:
    """The box around the points of a ``geometry_msgs/Polygon``; None without points.

    Points are float32, so the box is rounded to thousandths of a pixel, which they hold exactly.
    """
    if not len(points):
        return None
    xs = [round(float(p.x), 3) for p in points]
    ys = [round(float(p.y), 3) for p in points]
    width, height = round(max(xs) - min(xs), 3), round(max(ys) - min(ys), 3)
    return Box(min(xs), min(ys), width, height)


BOX_KEYS = ('x', 'y', 'width', 'height')
POSITION_KEYS = ('position_x', 'position_y', 'position_z')
PREDICTED_KEY = 'predicted'


def tracks_of_state(msg: Any) -> list[Track]:
    """The targets of a ``~/state``, the chosen one first.

    Raises:
        RgbdKcfError: where it is no such message.
    """
    return [_track_of(status) for status in msg.status]


def _track_of(status: Any) -> Track:
    values = {pair.key: pair.value for pair in status.values}
    try:
        box = place = None
        if BOX_KEYS[0] in values:
            box = Box(*(float(values[name]) for name in BOX_KEYS))
        if POSITION_KEYS[0] in values:
            x, y, z = (float(values[name]) for name in POSITION_KEYS)
            place = (x, y, z)
        predicted = values.get(PREDICTED_KEY) == 'true'
        return Track(
            box,
            TrackState(status.message),
            float(values['score']),
            None if place is None or predicted else place[2],
            None if predicted else place,
            int(values['id']),
            predicted=place if predicted else None,
        )
    except (KeyError, ValueError, RgbdKcfError) as error:
        raise RgbdKcfError(f'{status.name!r} is no state of a target: {error}') from None


def stamp_of(msg: Any) -> int:
    """Nanoseconds of a message's header."""
    return header_stamp(msg.header)


def header_stamp(header: Any) -> int:
    """Nanoseconds of a header."""
    stamp = header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
