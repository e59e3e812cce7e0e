# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A scene: a room, actors, a camera and light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.simulation.motion import CameraMotion
from rgbd_kcf_tracker.simulation.room import Room
from rgbd_kcf_tracker.simulation.sensor import SensorOptions
from rgbd_kcf_tracker.simulation.solids import Layer, Lighting, Vector

Gain = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """The camera at one moment."""

    camera: Intrinsics
    rotation: Vector
    place: Vector
    light: Lighting


class Actor(Protocol):
    """Something that moves."""

    def draw(
        self, t: float, view: Viewpoint, window: tuple[int, int, int, int], shade: bool
    ) -> Layer | None:
        """The actor alone at ``t`` seconds, in the window ``left, top, right, bottom``."""

    def centre(self, t: float) -> Vector:
        """A point in its middle, world frame, metres."""

    def shadow(self, t: float) -> float:
        """Radius of its shadow on the floor in metres, 0 for none."""


def steady_light(_: float) -> Gain:
    """Light that never changes."""
    return 1.0, 1.0, 1.0


@dataclass
class World:
    """All there is to record.

    Attributes:
        room: what stands still.
        actors: what moves, the target first.
        people: places in ``actors`` of those whose truth is told, the target first: id 1, 2, ...
        camera: its motion.
        duration_s: natural length.
        sensor: the camera's flaws.
        light: BGR gain at a time in seconds, the automatic exposure included.
        sun: direction to the light, world frame.
    """

    room: Room
    actors: list[Actor]
    camera: CameraMotion
    duration_s: float
    sensor: SensorOptions = field(default_factory=SensorOptions)
    light: Callable[[float], Gain] = steady_light
    sun: Vector = field(default_factory=lambda: np.array([-0.4, -0.8, -0.45]))
    people: tuple[int, ...] = (0,)
