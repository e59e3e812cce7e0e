# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Scenarios without full occlusion: the thesis's first four, and how targets move and look."""

from __future__ import annotations

import math

from rgbd_kcf_tracker.simulation.motion import CameraMotion, hand_waves
from rgbd_kcf_tracker.simulation.room import add_furniture
from rgbd_kcf_tracker.simulation.stage import Point, Stage, route, scenario
from rgbd_kcf_tracker.simulation.world import Actor, Gain, World


def stroll(
    stage: Stage, speed: float, legs: int, z: tuple[float, float] = (2.2, 3.8), wide: float = 0.65
) -> list[tuple[float, float, float]]:
    """To and fro inside the picture."""
    side = stage.sign()
    points: list[Point] = []
    for i in range(legs + 1):
        far = stage.uniform(*z)
        points.append((stage.x(side * stage.uniform(0.45, 1.0) * wide * (-1) ** i, far), far))
    return route(points, speed)


@scenario('one person walks to and fro in an ordinary room')
def normal(stage: Stage) -> World:
    """The thesis's normal case."""
    way = stroll(stage, stage.uniform(0.6, 1.3), int(stage.rng.integers(2, 4)), z=(1.7, 4.3))
    return stage.scene(
        [stage.walk(stage.person(), way), *stage.extras(0.3)], min(way[-1][0] + 0.5, 8.0)
    )


@scenario('a cluttered room and people standing behind the target')
def clutter(stage: Stage) -> World:
    """The thesis's background clutter."""
    room = stage.room((9, 14))
    for _ in range(4):
        add_furniture(stage.rng, room, stage.depth, stage.half_width)
    way = stroll(stage, stage.uniform(0.6, 1.1), 2, z=(2.0, 3.2))
    cast: list[Actor] = [stage.walk(stage.person(), way)]
    cast += [stage.bystander((3.9, 4.8), (-0.8, 0.8)) for _ in range(int(stage.rng.integers(1, 4)))]
    return stage.scene(cast, min(way[-1][0] + 0.5, 8.0), room=room)


@scenario('a person crouches, spreads the arms and turns about')
def deformation(stage: Stage) -> World:
    """The thesis's deformation: shape changes on the spot and while walking."""
    z = stage.uniform(2.0, 3.2)
    x0 = stage.x(stage.uniform(-0.4, 0.1), z)
    points = [(0, x0, z), (2.5, x0, z), (4.0, x0 + 0.8, z + 0.2), (8.0, x0 + 0.8, z + 0.2)]
    crouch = [(0, 0), (0.8, 0), (1.5, 0.9), (2.0, 0.9), (2.6, 0), (6.2, 0), (6.8, 0.6), (7.5, 0)]
    spread = [(0, 0), (4.2, 0), (4.8, 1), (5.6, 1), (6.2, 0)]
    turn = stage.uniform(-0.8, 0.8)
    heading = [(0, turn), (2.6, turn), (3, 1.4), (4, 1.2), (4.4, 0), (5.4, 0.2), (7, 6.3)]
    actor = stage.walk(stage.person(), points, heading, {'crouch': crouch, 'spread': spread})
    return stage.scene([actor], 7.5)


@scenario('a person jogs and changes direction quickly')
def motion(stage: Stage) -> World:
    """The thesis's fast motion."""
    way = stroll(stage, stage.uniform(1.8, 2.6), 4, wide=0.8)
    return stage.scene(
        [stage.walk(stage.person(), way), *stage.extras(0.3)], min(way[-1][0] + 0.4, 8.0)
    )


@scenario('a person runs across the view within about a second, with motion blur, and back')
def fast_motion(stage: Stage) -> World:
    """Steps of up to a fortieth of the picture's width between frames at 30 Hz."""
    z, side = stage.uniform(2.4, 3.6), stage.sign()
    left, right = stage.x(-0.72 * side, z), stage.x(0.72 * side, z + stage.uniform(-0.4, 0.4))
    dash = stage.uniform(0.75, 1.1)
    points = [(0, left, z), (0.7, left, z), (0.7 + dash, right, z), (2.0 + dash, right, z),
              (2.0 + 2 * dash, left, z), (3.2 + 2 * dash, left, z),
              (3.2 + 3 * dash, right, z)]  # fmt: skip
    actor = stage.walk(stage.person(), points)
    sensor = stage.sensor(exposure_s=stage.uniform(0.015, 0.028))
    return stage.scene([actor, *stage.extras(0.3)], 3.8 + 3 * dash, sensor=sensor)


@scenario('a person walks towards the camera at 1.5 m/s, from 5 m to 0.8 m')
def approach(stage: Stage) -> World:
    """The size grows sixfold."""
    far, near = stage.uniform(4.6, 5.2), stage.uniform(0.8, 1.0)
    far = min(far, stage.depth - 0.6)
    start, end = stage.x(stage.uniform(-0.4, 0.4), far), stage.x(stage.uniform(-0.25, 0.25), near)
    speed = stage.uniform(1.3, 1.6)
    way = route([(start, far), (start, far), (end, near)], speed)
    cast = [stage.walk(stage.person(), way), *stage.extras(0.3)]
    return stage.scene(cast, way[-1][0] + 1.0)


@scenario('a person walks away from the camera at 1.5 m/s, from 0.9 m to 5 m')
def recede(stage: Stage) -> World:
    """The size shrinks sixfold."""
    far, near = min(stage.uniform(4.6, 5.2), stage.depth - 0.6), stage.uniform(0.9, 1.2)
    start, end = stage.x(stage.uniform(-0.2, 0.2), near), stage.x(stage.uniform(-0.4, 0.4), far)
    way = route([(start, near), (start, near), (end, far)], stage.uniform(1.3, 1.6))
    actor = stage.walk(stage.person(), way, None)
    return stage.scene([actor], way[-1][0] + 1.0)


@scenario('the light changes suddenly, twice; the automatic exposure follows slowly')
def light_change(stage: Stage) -> World:
    """A lamp goes off or on between two frames, its colour with it."""
    way = stroll(stage, stage.uniform(0.7, 1.2), 3)
    duration = min(way[-1][0] + 0.4, 7.5)
    first, second = duration * stage.uniform(0.2, 0.35), duration * stage.uniform(0.55, 0.7)
    level = stage.uniform(0.3, 0.5) if stage.rng.uniform() < 0.7 else stage.uniform(1.5, 1.8)
    tint = stage.uniform(-0.18, 0.18)
    settle = stage.uniform(0.8, 2.0)

    def light(t: float) -> Gain:
        dark = first <= t < second
        lamp = level if dark else 1.0
        if t < first:
            exposure = 1.0
        elif dark:  # the exposure makes up for two thirds of the change
            exposure = (1 / level) ** (0.65 * (1 - math.exp(-(t - first) / settle)))
        else:
            peak = (1 / level) ** (0.65 * (1 - math.exp(-(second - first) / settle)))
            exposure = 1 + (peak - 1) * math.exp(-(t - second) / settle)
        g = lamp * exposure
        return g * (1 - tint * dark), g, g * (1 + tint * dark)

    cast = [stage.walk(stage.person(), way), *stage.extras(0.3)]
    return stage.scene(cast, duration, light=light)


@scenario('the camera shakes in a hand or pans slowly while the target walks')
def camera_motion(stage: Stage) -> World:
    """The whole picture moves."""
    way = stroll(stage, stage.uniform(0.6, 1.2), 2, wide=0.5)
    duration = min(way[-1][0] + 0.5, 7.0)
    pan = stage.uniform(0.12, 0.3) * stage.sign()
    keys = [(0.0, -pan / 2), (duration * 0.5, pan / 2), (duration, -pan / 2)]
    shake = stage.uniform(0.004, 0.012) if stage.rng.uniform() < 0.7 else 0.0
    camera = CameraMotion(stage.camera_height, stage.pitch, keys, shake=shake,
                          waves=hand_waves(stage.rng))  # fmt: skip
    return stage.scene(
        [stage.walk(stage.person(), way), *stage.extras(0.3)], duration, camera=camera
    )


@scenario('the target is cut by the border of the picture, close to the camera')
def border(stage: Stage) -> World:
    """Legs below the picture, then half the body beyond a side."""
    z, side = stage.uniform(1.1, 1.6), stage.sign()
    x = [stage.x(side * s, z) for s in (0.1, 0.85, 0.2, -0.9, -0.2)]
    speed = stage.uniform(0.5, 0.9)
    points: list[Point] = [(x[0], z), (x[1], z), (x[1], z), (x[2], z + 0.3), (x[3], z), (x[4], z)]
    way = route(points, speed)
    return stage.scene([stage.walk(stage.person(), way)], min(way[-1][0], 8.0))


@scenario('a crowd of people walks about; some pass before the target')
def crowd(stage: Stage) -> World:
    """Four to six others at all distances."""
    way = stroll(stage, stage.uniform(0.6, 1.0), 2, z=(2.6, 3.4))
    duration = min(way[-1][0] + 0.5, 8.0)
    cast: list[Actor] = [stage.walk(stage.person(), way)]
    for i in range(int(stage.rng.integers(4, 7))):
        near = i < 2
        z = stage.uniform(1.7, 2.3) if near else stage.uniform(3.0, 4.8)
        side = stage.sign()
        wall = stage.half_width - 0.4  # before which they turn
        ends = [
            (min(max(stage.x(side * s, z + stage.uniform(-0.2, 0.4)), -wall), wall), z)
            for s in (-1.5, 1.5)
        ]
        begin = stage.uniform(0.15, 0.5) * duration if near else stage.uniform(-2, 1)
        other = route([*ends, *ends[::-1]], stage.uniform(0.8, 1.4), begin)
        cast.append(stage.walk(stage.person(child=stage.rng.uniform() < 0.15), other))
    return stage.scene(cast, duration)


@scenario('people in the same clothes stand about and cross the target')
def lookalike(stage: Stage) -> World:
    """The lookalike wears the same outfit, or nearly the same."""
    target = stage.person()
    clothes = stage.cast[0]
    if stage.rng.uniform() < 0.6:
        clothes = clothes.nearly(stage.rng)
    z = stage.uniform(2.4, 3.2)
    side = stage.sign()
    points: list[Point] = [(stage.x(s * side, z), z) for s in (-0.65, 0.6, 0.6, -0.4)]
    way = route(points, stage.uniform(0.7, 1.0))
    other_z = z + stage.uniform(0.5, 0.9) * stage.sign()
    ends: list[Point] = [(stage.x(s * side, other_z), other_z) for s in (0.7, -0.6, -0.6, 0.5)]
    cast: list[Actor] = [
        stage.walk(target, way),
        stage.walk(stage.person(clothes), route(ends, stage.uniform(0.7, 1.0))),
    ]
    if stage.rng.uniform() < 0.5:
        far = stage.uniform(3.8, 4.5)
        cast.append(stage.walk(stage.person(clothes), [(0, stage.x(stage.uniform(-0.5, 0.5), far),
                                                        far)]))  # fmt: skip
    return stage.scene(cast, min(way[-1][0] + 0.4, 8.0))
