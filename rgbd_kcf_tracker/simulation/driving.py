# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A robot that drives behind somebody, with a camera on it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.simulation.floorplan import Point
from rgbd_kcf_tracker.simulation.solids import Vector

_STEP = 0.02  # seconds


@dataclass(frozen=True, slots=True)
class Robot:
    """What a robot on wheels can do, in metres, radians and seconds.

    Attributes:
        speed, turn: at the most.
        speeds_up, brakes, turns_up: how fast these change.
        keenness: speed for each metre that it is too far away, turn for each radian beside, times
            this.
    """

    speed: float = 1.3
    turn: float = 1.2
    speeds_up: float = 0.8
    brakes: float = 1.5
    turns_up: float = 3.0
    keenness: float = 1.5


def drive_behind(
    target: Callable[[float], Point], distance: float, seconds: float, robot: Robot | None = None
) -> Vector:
    """The way of a robot that turns towards somebody and keeps a distance; it never backs up.

    Args:
        target: their place, metres to the right and ahead, at a time.
        distance: metres.
        seconds: how long.
        robot: what it can do.

    Returns:
        ``(n, 4)`` seconds, metres to the right and ahead, and radians to the right.
    """
    robot = robot or Robot()
    x = z = course = speed = turn = 0.0
    way = []
    for k in range(math.ceil(seconds / _STEP) + 2):
        t = k * _STEP
        way.append((t, x, z, course))
        right, ahead = target(t)
        gap = math.hypot(right - x, ahead - z)
        beside = math.remainder(math.atan2(right - x, ahead - z) - course, 2 * math.pi)
        wanted = min(max(robot.keenness * (gap - distance), 0.0), robot.speed)
        speed += min(max(wanted - speed, -robot.brakes * _STEP), robot.speeds_up * _STEP)
        wanted = min(max(robot.keenness * beside, -robot.turn), robot.turn)
        turn += min(max(wanted - turn, -robot.turns_up * _STEP), robot.turns_up * _STEP)
        course += turn * _STEP
        x += speed * math.sin(course) * _STEP
        z += speed * math.cos(course) * _STEP
    return np.array(way)
