# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Scenarios of depth trouble, of targets that are no people, and of shape changes one by one."""

from __future__ import annotations

import math

import numpy as np

from rgbd_kcf_tracker.simulation.actors import FacesActor, PersonActor, animal, ball, mug
from rgbd_kcf_tracker.simulation.motion import CameraMotion, Keys, Motion, hand_waves
from rgbd_kcf_tracker.simulation.room import table
from rgbd_kcf_tracker.simulation.scenarios_basic import stroll
from rgbd_kcf_tracker.simulation.solids import Vector
from rgbd_kcf_tracker.simulation.stage import Point, Stage, route, scenario
from rgbd_kcf_tracker.simulation.world import Actor, World


def _walk_with_passer(stage: Stage) -> tuple[list[Actor], float]:
    """A stroll, and somebody who crosses nearer to the camera once."""
    way = stroll(stage, stage.uniform(0.6, 1.1), 2, z=(2.4, 3.6))
    duration = min(way[-1][0] + 0.5, 7.5)
    near, side = stage.uniform(1.5, 2.0), stage.sign()
    other: list[Point] = [(stage.x(1.4 * side, near), near), (stage.x(-1.4 * side, near), near)]
    begin = stage.uniform(0.1, 0.5) * duration
    return [
        stage.walk(stage.person(), way),
        stage.walk(stage.person(), route(other, stage.uniform(0.9, 1.3), begin)),
    ], duration


@scenario('the target gives no depth reading for seconds, as in sunlight or behind glass')
def missing_depth(stage: Stage) -> World:
    """Depth goes and comes back while the target is seen all the time but for a passer-by."""
    cast, duration = _walk_with_passer(stage)
    first = stage.uniform(0.1, 0.3) * duration
    spans = [(first, first + stage.uniform(1.5, 3.0))]
    if stage.rng.uniform() < 0.3:
        spans = [(0.0, duration + 10)]
    return stage.scene(cast, duration, sensor=stage.sensor(no_target_depth=tuple(spans)))


@scenario('a camera without depth')
def no_depth(stage: Stage) -> World:
    """Colour alone, with one passer-by."""
    cast, duration = _walk_with_passer(stage)
    return stage.scene(cast, duration, sensor=stage.sensor(has_depth=False))


@scenario('depth registered three to six pixels beside the colour')
def misregistered(stage: Stage) -> World:
    """A calibration that has slipped."""
    cast, duration = _walk_with_passer(stage)
    shift = (stage.sign() * int(stage.rng.integers(3, 7)), int(stage.rng.integers(-3, 4)))
    return stage.scene(cast, duration, sensor=stage.sensor(shift=shift))


@scenario('depth taken 30 to 70 ms later than the colour')
def late_depth(stage: Stage) -> World:
    """Unsynchronised cameras: a walker's depth runs ahead of the colour."""
    cast, duration = _walk_with_passer(stage)
    return stage.scene(cast, duration, sensor=stage.sensor(delay_s=stage.uniform(0.03, 0.07)))


@scenario('many holes and strong noise in the depth')
def holes(stage: Stage) -> World:
    """A tenth of the readings is missing."""
    cast, duration = _walk_with_passer(stage)
    sensor = stage.sensor(holes=stage.uniform(0.06, 0.15), depth_noise=stage.uniform(1.5, 2.5))
    return stage.scene(cast, duration, sensor=sensor)


@scenario('the target walks beyond the reliable range of the depth camera, 4 to 7 m away')
def far(stage: Stage) -> World:
    """Readings fall out with distance."""
    stage.depth = stage.uniform(7.2, 8.5)
    stage.half_width = stage.uniform(0.5, 0.8) * stage.depth
    points: list[Point] = []
    for share, z in ((-0.4, 3.8), (0.1, 5.2), (0.4, 6.6), (-0.3, 6.2), (-0.1, 4.2)):
        points.append((stage.x(share, z), z + stage.uniform(-0.3, 0.3)))
    way = route(points, stage.uniform(1.1, 1.5))
    return stage.scene([stage.walk(stage.person(), way)], min(way[-1][0] + 0.3, 9.0))


@scenario('a person turns about on the spot')
def turning(stage: Stage) -> World:
    """Once or twice around, at 1 to 3 m."""
    z = stage.uniform(1.0, 3.0)
    x, full = stage.x(stage.uniform(-0.3, 0.3), z), 2 * math.pi * stage.sign()
    begin = stage.uniform(-0.5, 0.5)
    heading = [(0.0, begin), (0.5, begin), (3.5, begin + full), (4.2, begin + full),
               (5.5, begin + 0.5 * full)]  # fmt: skip
    points = [(0.0, x, z), (2.0, x + 0.1, z), (5.0, x - 0.1, z + 0.1)]
    return stage.scene([stage.walk(stage.person(), points, heading)], 6.0)


@scenario('a person crouches and stands up, twice, and walks on')
def crouch(stage: Stage) -> World:
    """The height halves within a second."""
    z, side = stage.uniform(1.8, 3.2), stage.sign()
    x = stage.x(-0.3 * side, z)
    points = [(0.0, x, z), (4.4, x, z), (6.0, x + 1.3 * side, z)]
    keys = [(0.0, 0.0), (0.6, 0.0), (1.2, 1.0), (2.0, 1.0), (2.5, 0.0), (3.0, 0.0), (3.5, 0.8),
            (3.9, 0.8), (4.4, 0.0)]  # fmt: skip
    turn = stage.uniform(-1.5, 1.5)
    heading = [(0.0, turn), (4.2, turn), (4.7, 1.5 * side)]
    actor = stage.walk(stage.person(), points, heading, {'crouch': keys})
    return stage.scene([actor], 6.2)


@scenario('a person raises and lowers the arms')
def arms_out(stage: Stage) -> World:
    """The width triples and falls back."""
    z = stage.uniform(1.6, 3.2)
    x = stage.x(stage.uniform(-0.35, 0.35), z)
    keys = [(0.0, 0.0), (0.8, 0.0), (1.3, 1.0), (2.2, 1.0), (2.7, 0.0), (3.4, 0.0), (3.8, 1.2),
            (4.6, 0.9), (5.2, 0.0)]  # fmt: skip
    turn = stage.uniform(-0.7, 0.7)
    heading = [(0.0, turn), (2.6, turn), (3.4, turn + stage.uniform(-1, 1))]
    points = [(0.0, x, z), (2.5, x, z), (5.5, x * 0.5, z + 0.4)]
    return stage.scene([stage.walk(stage.person(), points, heading, {'spread': keys})], 6.0)


@scenario('a mug on a table before a moving hand-held camera; it leaves the view and returns')
def mug_hand_held(stage: Stage) -> World:
    """Small object, moving camera, other things on the table."""
    rng, side = stage.rng, stage.sign()
    z = stage.uniform(0.85, 1.2)
    room = stage.room()
    desk = table(rng, np.array([0.0, 0.0, z + 0.1]), float(rng.normal(0, 0.1)))
    room.faces += desk
    top = min(float(f.corner[1]) for f in desk)
    spot = np.array([stage.uniform(-0.15, 0.15), top, z - stage.uniform(0.0, 0.1)])
    cast: list[Actor] = [mug(rng, lambda t: spot, lambda t: 0.4)]
    for share in (-0.36, 0.34):
        other = np.array([share + stage.uniform(-0.06, 0.06), top, z + stage.uniform(0.0, 0.2)])
        if rng.uniform() < 0.6:
            cast.append(mug(rng, lambda t, other=other: other))  # type: ignore[misc]
        else:
            size = (stage.uniform(0.1, 0.2), stage.uniform(0.08, 0.2), 0.12)
            cast.append(FacesActor(
                tuple(stage.box_faces((0, 0), size, 'cardboard')),
                Motion([(0, other[0], other[2])], channels={'lift': [(0, -top)]}), size[1],
            ))  # fmt: skip
    away = stage.uniform(1.15, 1.3) * side
    keys = [(0.0, 0.0), (1.2, 0.2 * side), (2.4, -0.15 * side), (3.6, away), (4.2, away),
            (5.4, 0.1 * side), (6.6, -0.2 * side)]  # fmt: skip
    slide = [(0.0, 0.0), (3.0, stage.uniform(-0.2, 0.2)), (6.5, stage.uniform(-0.2, 0.2))]
    height = -top + stage.uniform(0.3, 0.5)
    camera = CameraMotion(height, stage.uniform(0.3, 0.42), keys, slide,
                          shake=stage.uniform(0.004, 0.012), waves=hand_waves(rng))  # fmt: skip
    return stage.scene(cast, 6.8, room=room, camera=camera)


@scenario('a ball rolls and bounces between two people and behind a box')
def ball_game(stage: Stage) -> World:
    """Small, fast, turning."""
    rng, side = stage.rng, stage.sign()
    stage.pitch = stage.uniform(0.12, 0.22)
    z = stage.uniform(2.2, 3.0)
    room = stage.room()
    near = z - stage.uniform(0.4, 0.7)
    room.faces += stage.box_faces((stage.x(0.1 * side, near), near),
                                  (stage.uniform(0.3, 0.45), stage.uniform(0.4, 0.6), 0.3),
                                  'cardboard')  # fmt: skip
    ends: list[Point] = [(stage.x(s * side, z), z) for s in (-0.55, 0.6)]
    points = route([*ends, ends[1], *ends[::-1], ends[0], *ends], stage.uniform(1.2, 2.0), 0.4)
    times = np.arange(0, points[-1][0], 0.03)
    bounce, period = stage.uniform(0.0, 0.45), stage.uniform(0.5, 0.8)
    phase = times / period % 1
    lift = [
        (float(t), float(v)) for t, v in zip(times, 4 * bounce * phase * (1 - phase), strict=True)
    ]
    actor = ball(rng, Motion(points, channels={'lift': lift}), stage.uniform(0.09, 0.16))
    cast: list[Actor] = [actor]
    for x, sign in ((ends[0][0], -1), (ends[1][0], 1)):
        cast.append(stage.walk(stage.person(), [(0, x + 0.35 * side * sign, z + 0.15)],
                               heading=[(0, -1.4 * sign * side)]))  # fmt: skip
    return stage.scene(cast, min(points[-1][0] + 0.4, 8.0), room=room)


@scenario('a dog or cat trots about on the floor and behind a chair or box')
def small_animal(stage: Stage) -> World:
    """Low, close to the floor."""
    rng, side = stage.rng, stage.sign()
    stage.pitch = stage.uniform(0.15, 0.25)
    z = stage.uniform(2.0, 2.8)
    room = stage.room()
    near = z - stage.uniform(0.5, 0.7)
    room.faces += stage.box_faces((stage.x(0.05, near), near), (stage.uniform(0.6, 0.9), 0.7, 0.3))
    points: list[Point] = [(stage.x(side * s, z + stage.uniform(-0.2, 0.4)), z)
                           for s in (-0.55, -0.3, 0.55, 0.5, -0.5)]  # fmt: skip
    way = route(points, stage.uniform(0.7, 1.3))
    scale = stage.uniform(0.65, 1.2)
    pet = animal(rng, Motion(way, stride=0.7 * scale), scale)
    cast: list[Actor] = [pet]
    if rng.uniform() < 0.5:
        cast.append(stage.bystander((3.2, 4.2), (-0.7, 0.7)))
    return stage.scene(cast, min(way[-1][0] + 0.4, 8.0), room=room)


@scenario('a face close to the camera; somebody passes, the head moves and turns')
def face(stage: Stage) -> World:
    """The target is the head alone."""
    person = stage.person()
    z = stage.uniform(0.75, 1.05)
    stage.camera_height = person.height * 0.93 + stage.uniform(-0.06, 0.06)
    stage.pitch = stage.uniform(-0.03, 0.05)
    sway = stage.uniform(0.1, 0.25) * stage.sign()
    points = [(0.0, 0.0, z), (1.0, sway, z), (2.5, -sway, z + 0.15), (4.0, sway, z + 0.3),
              (6.0, 0.0, z)]  # fmt: skip
    turn = stage.uniform(0.6, 1.1) * stage.sign()
    heading: Keys = [(0.0, 0.0), (1.2, turn), (2.6, -turn), (4.5, 0.4 * turn), (6.0, 0.0)]
    motion = Motion(points, heading=heading)
    cast: list[Actor] = [PersonActor(person, motion, 'head'), PersonActor(person, motion, 'body')]
    if stage.rng.uniform() < 0.6:
        t0, side = stage.uniform(2.0, 3.0), stage.sign()
        other: list[Point] = [(0.75 * side, 0.62), (-0.75 * side, 0.62)]
        cast.append(stage.walk(stage.person(), route(other, 1.1, t0)))
    cast.append(stage.bystander((2.5, 4.0), (-0.6, 0.6)))
    return stage.scene(cast, 6.0)


@scenario('a mug carried about in the hand of a walking person')
def carried_mug(stage: Stage) -> World:
    """A small target that moves with somebody bigger."""
    person = stage.person()
    side = stage.sign()
    z = stage.uniform(1.5, 2.0)
    apart = [stage.uniform(-0.2, 0.2) for _ in range(4)]
    speed = stage.uniform(0.5, 0.8)
    reach: dict[str, Keys] = {'reach': [(0, 1.0)]}
    hand = person.hand(Motion([(0, 0, 0)], channels=reach).stance(0))
    rim, ahead = 0.08 - float(hand[1]), 0.1 - float(hand[2])
    # Somebody tall stands farther from a low camera, or one that looks down, but in the room.
    z = max(z, min(ahead + stage.shown_from(rim), stage.depth - 1.0))
    points: list[Point] = [
        (stage.x(side * s, z + d), z) for s, d in zip((-0.45, 0.4, 0.45, -0.4), apart, strict=True)
    ]
    way = route(points, speed)
    heading: Keys = [(0.0, 0.5), (2.0, -0.4), (4.0, 0.6), (6.0, 0.0)]
    actor = stage.walk(person, way, heading, reach)

    def place(t: float) -> Vector:
        stance = actor.motion.stance(t)
        forward = np.array([math.sin(stance.heading), 0.0, -math.cos(stance.heading)])
        held: Vector = person.hand(stance) + forward * 0.1 + np.array([0, 0.02, 0])
        return held

    cup = mug(stage.rng, place, lambda t: 2.2 + actor.motion.value('heading', t))
    return stage.scene([cup, actor], min(way[-1][0] + 0.4, 7.0))
