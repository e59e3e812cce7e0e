# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A simulated room in which nobody is: things on tables, which a hand-held camera turns past."""

from __future__ import annotations

import math

import numpy as np

from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.simulation.actors import FacesActor, ThingActor, ball, mug
from rgbd_kcf_tracker.simulation.motion import CameraMotion, Motion, hand_waves
from rgbd_kcf_tracker.simulation.room import chair
from rgbd_kcf_tracker.simulation.sequence import SimulatedSequence
from rgbd_kcf_tracker.simulation.stage import Stage

SIZE = (640, 480)
FOCAL = 525.0
"""Pixels: a Kinect v1's, which shows more of small things than the wide qhd."""
SECONDS, RATE_HZ = 12.0, 10.0
TURN = 0.75
"""Radians to either side that the camera turns: a table goes out of view, and comes back."""
TURN_S = 3.0
"""Seconds of a turn from one side to the other, half a radian a second."""
BEARINGS = (-0.6, 0.0, 0.6)
"""Radians to the right at which tables stand."""


def furnished(
    seed: int, size: tuple[int, int] = SIZE, rate_hz: float = RATE_HZ, seconds: float = SECONDS
) -> SimulatedSequence:
    """A room with three tables, on each a mug and another thing, and a chair beside two of them.

    Args:
        seed: of all that is random.
        size: width and height of the picture.
        rate_hz: frames a second.
        seconds: of the recording.
    """
    rng = np.random.default_rng([seed, 91])
    focal = FOCAL * size[0] / SIZE[0]
    camera = Intrinsics(focal, focal, size[0] / 2, size[1] / 2)
    stage = Stage(rng, camera, size)
    room = stage.room()
    things: list[FacesActor | ThingActor] = []
    for bearing in BEARINGS:
        far, high = stage.uniform(1.5, 2.2), stage.uniform(0.65, 0.8)
        x, z = far * math.sin(bearing), far * math.cos(bearing)
        room.faces += stage.box_faces((x, z), (1.0, high, 0.5), 'wood', -bearing)
        side = stage.sign() * stage.uniform(0.15, 0.25)
        along = np.array([math.cos(bearing), 0.0, -math.sin(bearing)])
        middle = np.array([x, -high, z])
        things.append(_standing_mug(stage, middle + side * along))
        things.append(_another(stage, middle - side * along))
        if bearing:
            spot = np.array([1.6 * x, 0.0, 1.25 * z])
            turn = stage.uniform(-math.pi, math.pi)
            seat = chair(rng, np.zeros(3), turn)
            things.append(FacesActor(tuple(seat), Motion([(0, spot[0], spot[2])]), 0.9))
    side = stage.sign()
    pan = [(0.0, 0.0), (1.0, 0.0)]
    while pan[-1][0] < seconds:
        turned = abs(side * TURN - pan[-1][1]) / (2 * TURN)
        pan.append((pan[-1][0] + TURN_S * turned, side * TURN))
        pan.append((pan[-1][0] + 0.5, side * TURN))
        side = -side
    stage.camera_height, stage.pitch = stage.uniform(1.2, 1.5), stage.uniform(0.25, 0.35)
    slide = [(0.0, 0.0), (seconds, stage.uniform(-0.4, 0.4))]
    motion = CameraMotion(
        stage.camera_height, stage.pitch, pan, slide, shake=0.01, waves=hand_waves(rng)
    )
    scene = stage.scene(things, seconds, room=room, camera=motion)
    scene.people = tuple(range(len(things)))
    offsets = [round(k * 1e9 / rate_hz) for k in range(round(seconds * rate_hz))]
    return SimulatedSequence(scene, 'things', seed, rate_hz, offsets, size, camera)


def _standing_mug(stage: Stage, place: np.ndarray) -> ThingActor:
    turn = stage.uniform(-math.pi, math.pi)
    return mug(stage.rng, lambda _: place, lambda _: turn)


def _another(stage: Stage, place: np.ndarray) -> FacesActor | ThingActor:
    """A box, a ball or a second mug."""
    kind = str(stage.rng.choice(['box', 'ball', 'mug']))
    if kind == 'mug':
        return _standing_mug(stage, place)
    x, y, z = place.tolist()
    motion = Motion([(0, x, z)], channels={'lift': [(0.0, -y)]})
    if kind == 'ball':
        return ball(stage.rng, motion, stage.uniform(0.05, 0.11))
    size = (stage.uniform(0.12, 0.35), stage.uniform(0.1, 0.3), stage.uniform(0.05, 0.2))
    skin = str(stage.rng.choice(['cardboard', 'shelf', 'cupboard']))
    return FacesActor(tuple(stage.box_faces((0, 0), size, skin)), motion, size[1])
