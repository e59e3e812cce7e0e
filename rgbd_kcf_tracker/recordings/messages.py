# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What other messages than images and cameras mean: boxes, stamps; from rclpy or from rosbags."""

from __future__ import annotations

from typing import Any

from rgbd_kcf_tracker.geometry import Box


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


def stamp_of(msg: Any) -> int:
    """Nanoseconds of a message's header."""
    stamp = msg.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
