# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Scenarios in which the target is hidden for a while: behind things and people, or out of view."""

from __future__ import annotations

import numpy as np

from rgbd_kcf_tracker.simulation.room import chair
from rgbd_kcf_tracker.simulation.stage import Point, Stage, route, scenario
from rgbd_kcf_tracker.simulation.world import Actor, World


def _behind(
    stage: Stage, *, way_shares: list[float], width: float, at: float = 0.0,
    speed: tuple[float, float] = (0.8, 1.3), height: tuple[float, float] = (1.6, 2.1),
) -> tuple[list[Point], float, World]:  # fmt: skip
    """A cupboard before the path; the points of the path, its speed, and a scene without actors."""
    near, far = stage.uniform(1.7, 2.3), stage.uniform(2.9, 3.8)
    room = stage.room()
    stage.occluder(room, stage.x(at, near), near, width, stage.uniform(*height))
    side = stage.sign()
    slope = stage.uniform(-0.35, 0.35)  # the way leads a little nearer or farther
    points: list[Point] = []
    for share in way_shares:
        z = far + slope * share
        points.append((stage.x(at + share * side, z), z))
    return points, stage.uniform(*speed), stage.scene([], 1.0, room=room)


def _far_and_near(stage: Stage, low: float, high: float) -> tuple[float, float, int]:
    """Distances of a target and of somebody who hides it in passing, and a side."""
    stage.place_camera(0.75, 1.3)
    far = stage.uniform(low, high)
    return far, far * stage.uniform(0.33, 0.44), stage.sign()


@scenario('the target walks behind a cupboard, shelf or pile of boxes and comes out again')
def occlusion(stage: Stage) -> World:
    """The thesis's full occlusion."""
    points, speed, scene = _behind(
        stage, way_shares=[-0.75, 0.75, 0.75, -0.7], width=stage.uniform(0.8, 1.3),
        at=stage.uniform(-0.15, 0.15),
    )  # fmt: skip
    way = route(points, speed)
    scene.actors = [stage.walk(stage.person(), way), *stage.extras()]
    scene.duration_s = way[-1][0] + 0.5
    return scene


@scenario('the target goes behind a box and turns back: it comes out where it went in')
def turn_back(stage: Stage) -> World:
    """Hidden for a second or so, then out on the same side."""
    points, speed, scene = _behind(stage, way_shares=[-0.75, 0.0, 0.0, 0.0, -0.8],
                                   width=stage.uniform(0.9, 1.3))  # fmt: skip
    way = route(points, speed)
    scene.actors = [stage.walk(stage.person(), way), *stage.extras()]
    scene.duration_s = way[-1][0] + 0.8
    return scene


@scenario('the target stands behind a box for several seconds')
def long_occlusion(stage: Stage) -> World:
    """Hidden for 3 to 5 seconds, out on either side."""
    out = 0.8 * stage.sign()
    points, speed, scene = _behind(stage, way_shares=[-0.75, 0.0, out],
                                   width=stage.uniform(0.9, 1.3))  # fmt: skip
    there = route(points[:2], speed)
    pause = stage.uniform(2.5, 4.0)
    back = route(points[1:], speed, there[-1][0] + pause)
    scene.actors = [stage.walk(stage.person(), there + back), *stage.extras()]
    scene.duration_s = back[-1][0] + 1.5
    return scene


@scenario('the target is hidden a few frames after the start')
def early_occlusion(stage: Stage) -> World:
    """A fifth to half a second after the given box."""
    stage.place_camera(0.75, 1.3)
    far, near, side = stage.uniform(2.8, 3.5), stage.uniform(1.0, 1.25), stage.sign()
    x = stage.x(stage.uniform(-0.3, 0.3), far)
    meet = x * near / far
    speed = stage.uniform(1.2, 1.7)
    # where the passer-by's edge meets the target's edge, and before that the first free frames
    begin = meet - side * (speed * stage.uniform(0.2, 0.5) + 0.3 * near / far + 0.22)
    pause = stage.uniform(0.3, 1.2)
    there = route([(begin, near), (meet, near)], speed)
    back = route([(meet, near), (meet + side * 3.0, near)], speed, there[-1][0] + pause)
    target = stage.walk(
        stage.person(),
        [(0, x, far), (3, x, far), (5, x + 0.8 * side, far)],
        heading=[(0, 0.0), (3, 0.2), (3.4, 1.5 * side)],
    )
    return stage.scene([target, stage.walk(stage.tall_person(), there + back)], 5.5)


@scenario('the target and another person walk past each other, then one overtakes the other')
def crossing(stage: Stage) -> World:
    """The thesis's moving target and moving occluder."""
    far, near, side = _far_and_near(stage, 2.7, 3.8)
    speed = stage.uniform(0.7, 1.1)
    way = route([(stage.x(side * s, far), far) for s in (-0.7, 0.7, 0.7, -0.75)], speed)
    half, end = way[1][0], way[-1][0]
    # one comes towards the target, another goes the target's way a little faster
    first, second = stage.uniform(0.3, 0.7) * half, half + stage.uniform(0.4, 0.6) * (end - half)
    at = np.interp([first, second], [t for t, _, _ in way], [x for _, x, _ in way]) * near / far
    pace = -stage.uniform(0.7, 1.1) * side
    slow = speed * near / far * stage.uniform(1.3, 2.0) * -side
    others = [
        [(t - 4.0, float(x) - 4.0 * pace, near), (t + 4.0, float(x) + 4.0 * pace, near)]
        for t, x, pace in ((first, at[0], pace), (second, at[1], slow))
    ]
    cast: list[Actor] = [stage.walk(stage.person(), way)]
    cast += [stage.walk(stage.tall_person(), keys) for keys in others]
    return stage.scene([*cast, *stage.extras(0.3)], end + 0.5)


@scenario('somebody passes before a standing target, and back, and may stop there')
def passer_by(stage: Stage) -> World:
    """The thesis's standing target and moving occluder."""
    far, near, side = _far_and_near(stage, 2.6, 3.8)
    x = stage.x(stage.uniform(-0.3, 0.3), far)
    turn, meet = stage.uniform(-1, 1), x * near / far
    speed = stage.uniform(0.7, 1.2)
    out = stage.x(1.5, near)
    there = route([(-side * out, near), (meet, near)], speed, stage.uniform(-0.6, 0.4))
    pause = stage.uniform(0.3, 1.5) if stage.rng.uniform() < 0.5 else 0.0
    on = route([(meet, near), (side * out, near)], speed, there[-1][0] + pause)
    back = route([(side * out, near), (-side * out, near)], speed, on[-1][0] + 0.5)
    channels = {'spread': [(0.0, 0.0), (2.5, 0.0), (3.0, 0.35), (4.0, 0.0)]}
    cast: list[Actor] = [
        stage.walk(stage.person(), [(0, x, far)], heading=[(0, turn), (3, turn), (4, -turn)],
                   channels=channels),
        stage.walk(stage.tall_person(), there + on + back),
    ]  # fmt: skip
    return stage.scene([*cast, *stage.extras()], min(back[-1][0], 9.0))


@scenario('a hand-held camera, a walking target, and a passer-by who hides it')
def camera_occlusion(stage: Stage) -> World:
    """Camera motion and occlusion together."""
    far, near, side = _far_and_near(stage, 2.7, 3.6)
    way = route([(stage.x(side * s, far), far) for s in (-0.5, 0.5, 0.5, -0.4)],
                stage.uniform(0.6, 0.9))  # fmt: skip
    out = stage.x(1.6, near)
    begin = stage.uniform(0.1, 0.5) * way[-1][0]
    other = route([(side * out, near), (-side * out, near)], stage.uniform(0.7, 1.1), begin)
    cast: list[Actor] = [stage.walk(stage.person(), way), stage.walk(stage.tall_person(), other)]
    camera = stage.hand_held(stage.uniform(0.003, 0.01))
    return stage.scene(cast, min(way[-1][0] + 0.3, 8.0), camera=camera)


@scenario('a box on wheels is pushed before the standing target and stays for a while')
def behind_box(stage: Stage) -> World:
    """The thesis's occlusion by a box; who pushes it walks behind it."""
    far, near, side = stage.uniform(2.6, 3.4), stage.uniform(1.5, 2.0), stage.sign()
    x = stage.x(stage.uniform(-0.25, 0.25), far)
    meet = x * near / far
    wide, speed = stage.uniform(0.9, 1.2), stage.uniform(0.8, 1.2)
    points: list[Point] = [(meet - 2.8 * side, near), (meet, near), (meet, near), (meet, near),
                           (meet + side * 3.2, near)]  # fmt: skip
    way = route(points, speed)
    box = stage.pushed_box(way, (wide, stage.uniform(1.6, 1.9), 0.4),
                           str(stage.rng.choice(['cupboard', 'cardboard', 'wood'])))  # fmt: skip
    pusher = [(t, px - side * (wide / 2 + 0.4), pz) for t, px, pz in way]
    cast: list[Actor] = [
        stage.walk(stage.person(), [(0, x, far)], heading=[(0, stage.uniform(-1, 1))]),
        box,
        stage.walk(stage.person(), pusher, channels={'reach': [(0, 0.8)]}),
    ]
    return stage.scene([*cast, *stage.extras(0.3)], min(way[-1][0], 8.0))


@scenario('the target ducks behind an armchair close to the camera')
def behind_chair(stage: Stage) -> World:
    """The thesis's occlusion by a chair: partly while standing behind it, fully when ducking."""
    stage.camera_height, stage.pitch = stage.uniform(0.85, 1.0), 0.02
    near, far, side = stage.uniform(1.3, 1.6), stage.uniform(2.5, 3.0), stage.sign()
    room = stage.room()
    room.faces += stage.box_faces((0, near), (0.85, 0.55, 0.7), 'wood', turn=0.0)
    room.faces += stage.box_faces((0, near + 0.3), (0.85, stage.uniform(1.05, 1.15), 0.15), 'wood')
    if stage.rng.uniform() < 0.6:
        spot = np.array([stage.x(0.6 * side, near + 0.4), 0, near + 0.4])
        room.faces += chair(stage.rng, spot, stage.uniform(0, 6.28))
    points = route([(stage.x(-0.6 * side, far), far), (0.0, far)], stage.uniform(0.8, 1.1))
    arrive = points[-1][0]
    hide = stage.uniform(1.0, 2.0)
    leave = route([(0.0, far), (stage.x(0.65 * side, far), far)], 0.9, arrive + hide + 1.2)
    crouch = [(0, 0.0), (arrive, 0.0), (arrive + 0.6, 1.0), (arrive + 0.6 + hide, 1.0),
              (arrive + 1.2 + hide, 0.0)]  # fmt: skip
    actor = stage.walk(stage.person(), points + leave, channels={'crouch': crouch})
    return stage.scene([actor], leave[-1][0] + 0.6, room=room)


@scenario('the target steps behind a standing person and comes out on the other side')
def behind_person(stage: Stage) -> World:
    """The thesis's occlusion by a person who stands still."""
    stage.place_camera(0.75, 1.3)
    near, far, side = stage.uniform(1.5, 1.9), stage.uniform(2.8, 3.4), stage.sign()
    at = stage.uniform(-0.15, 0.15)
    points: list[Point] = [(stage.x(at + s * side, far), far) for s in (-0.65, 0, 0, 0.65)]
    way = route(points, stage.uniform(0.7, 1.0))
    cast: list[Actor] = [
        stage.walk(stage.person(), way),
        stage.walk(stage.tall_person(), [(0, stage.x(at, near), near)],
                   heading=[(0, stage.uniform(-3, 3))]),
    ]  # fmt: skip
    return stage.scene([*cast, *stage.extras(0.3)], way[-1][0] + 0.8)


@scenario('somebody walks so close before the target that the two touch')
def touching(stage: Stage) -> World:
    """A gap of 10 to 30 cm in depth: the surfaces join."""
    z, side = stage.uniform(2.3, 3.2), stage.sign()
    x = stage.x(stage.uniform(-0.2, 0.2), z)
    near = z - stage.uniform(0.42, 0.55)
    pause = stage.uniform(0.3, 1.0)
    there = route([(x - side * 1.9, near), (x - side * 0.02, near)], stage.uniform(0.7, 1.0), 0.4)
    back = route([(x - side * 0.02, near), (x + side * 2.2, near)], 0.9, there[-1][0] + pause)
    arrive, leave, ahead = there[-1][0], back[0][0], 1.5 * side
    facing = [(0.0, ahead), (arrive - 0.1, ahead), (arrive + 0.2, 0.0), (leave, 0.0)]
    facing.append((leave + 0.3, ahead))
    cast: list[Actor] = [
        stage.walk(stage.person(), [(0, x, z)], heading=[(0, stage.uniform(-0.8, 0.8))]),
        stage.walk(stage.person(), there + back, facing if stage.rng.uniform() < 0.6 else None),
    ]
    return stage.scene(cast, min(back[-1][0] + 0.4, 8.0))


@scenario('the target leaves the view and returns through the same edge')
def out_of_view(stage: Stage) -> World:
    """The thesis's out of view."""
    z, side = stage.uniform(2.2, 3.2), stage.sign()
    points: list[Point] = [(stage.x(side * s, z), z) for s in (-0.3, 1.4, 1.4, 1.4, -0.4)]
    way = route(points, stage.uniform(0.9, 1.3))
    return stage.scene([stage.walk(stage.person(), way), *stage.extras()], way[-1][0] + 0.5)


@scenario('the target leaves the view and returns through the other edge')
def other_edge(stage: Stage) -> World:
    """It passes behind the camera, unseen."""
    z, side = stage.uniform(2.2, 3.0), stage.sign()
    speed = stage.uniform(1.0, 1.4)
    first = route([(stage.x(side * s, z), z) for s in (-0.3, 1.5)], speed)
    t = first[-1][0]
    far = stage.uniform(2.0, 3.4)
    unseen = [(t + 0.3, stage.x(side * 1.6, z), -1.0), (t + 0.8, stage.x(-side * 1.6, far), -1.0)]
    last = route([(stage.x(side * s, far), far) for s in (-1.5, 0.3, 0.5)], speed, t + 1.1)
    return stage.scene(
        [stage.walk(stage.person(), first + unseen + last), *stage.extras()], last[-1][0] + 0.5
    )


@scenario('the target goes behind a box while somebody in the same clothes walks out')
def decoy(stage: Stage) -> World:
    """The lookalike comes out where the target is expected; the target follows later."""
    points, speed, scene = _behind(stage, way_shares=[-0.7, 0.0, 0.7],
                                   width=stage.uniform(1.0, 1.4))  # fmt: skip
    there = route(points[:2], speed)
    t = there[-1][0]
    wait = stage.uniform(1.2, 2.0)
    back = route(points[1:], speed, t + wait)
    target = stage.person()
    far = points[1][1] + 0.5
    exit_x = points[2][0] * far / points[2][1]
    other: list[Point] = [(points[1][0], far), (exit_x * 2.2, far)]
    cast: list[Actor] = [
        stage.walk(target, there + back),
        stage.walk(stage.person(stage.cast[0].nearly(stage.rng)), route(other, speed, t)),
    ]
    scene.actors, scene.duration_s = cast, back[-1][0] + 0.8
    return scene
