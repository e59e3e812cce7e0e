# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Scenarios of several people, each with an id, who come and go, meet, and cross."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from rgbd_kcf_tracker.simulation.actors import VisitorActor
from rgbd_kcf_tracker.simulation.driving import drive_behind
from rgbd_kcf_tracker.simulation.floorplan import Point
from rgbd_kcf_tracker.simulation.hall import DOOR, Exit, Hall
from rgbd_kcf_tracker.simulation.motion import CameraMotion, Keys, hand_waves
from rgbd_kcf_tracker.simulation.people import Person
from rgbd_kcf_tracker.simulation.stage import Stage, scenario
from rgbd_kcf_tracker.simulation.walking import Action, Away, Go, Stay, Visit, Walker, rehearse
from rgbd_kcf_tracker.simulation.world import Actor, Gain, World

LONG_S = 45.0
AT_HOME_S = 40.0
ABSENCE_S = (6.0, 25.0)
PAN_SPEED = math.radians(23)
several = partial(scenario, several=True)


class _Diary:
    """The plan of one person while it is written, and about when each thing happens."""

    def __init__(self, hall: Hall, person: Person) -> None:
        self.hall, self.stage, self.person = hall, hall.stage, person
        self.speed = self.stage.uniform(0.75, 1.35)
        self.actions: list[Action] = []
        self.start: Point = (0.0, 0.0)
        self.facing = self.stage.uniform(-math.pi, math.pi)
        self.place: Point = (0.0, 0.0)
        self.now = 0.0
        self.left_by: str | None = None

    def begin(self, at: Point) -> None:
        """Stand in view at first."""
        self.start = self.place = at

    def go(self, to: Point, straight: bool = False) -> None:
        """Walk there."""
        self.actions.append(Go(to, straight))
        self.now += 1.15 * math.dist(self.place, to) / self.speed + 0.2
        self.place = to

    def stay(self, seconds: float, facing: float | None = None, **stance: float) -> None:
        """Stand or sit there."""
        self.actions.append(Stay(seconds, facing, **stance))
        self.now += seconds

    def look_about(self, seconds: float) -> None:
        """Stand, turn to something, and perhaps to something else."""
        facing = self.stage.uniform(-math.pi, math.pi)
        if self.stage.rng.uniform() < 0.4:
            self.stay(seconds / 2, facing)
            facing += self.stage.uniform(-2.0, 2.0)
            seconds /= 2
        reach = 0.9 if self.stage.rng.uniform() < 0.15 else 0.0
        self.stay(seconds, facing, reach=reach)

    def do_something(self, share: float = 0.75) -> None:
        """Walk to some place in view and perhaps stay there for a while."""
        stage, hall = self.stage, self.hall
        chance = stage.rng.uniform()
        if chance < 0.2 and hall.seats:
            seat = hall.seats.pop()
            self.go(seat.front)
            self.go(seat.feet, straight=True)
            self.stay(0.9, seat.facing)
            self.stay(stage.uniform(2.5, 7.0), seat.facing, sit=1.0)
            self.stay(0.6, seat.facing)
            self.go(seat.front, straight=True)
        elif chance < 0.45 and hall.niches:
            niche = hall.niches.pop(int(stage.rng.integers(len(hall.niches))))
            self.go(niche.front)
            self.go(niche.place, straight=True)
            self.stay(stage.uniform(1.5, 5.0), stage.uniform(-1.5, 1.5))
            self.go(niche.front, straight=True)
        else:
            self.go(hall.spot(share=share))
            if stage.rng.uniform() < 0.6:
                self.look_about(stage.uniform(0.8, 3.5))

    def leave(self, by: Exit) -> None:
        """Walk out of the view."""
        self.go(by.inside)
        self.go(by.outside)
        self.left_by = by.name

    def come_back(self, by: Exit, after: float) -> None:
        """Appear somewhere else after a time, and walk into the view."""
        self.actions.append(Away(after, by.outside))
        self.place = by.outside
        self.now += after
        self.go(by.inside)

    def enter_late(self, by: Exit, at: float) -> None:
        """Not there at first."""
        self.start = by.outside
        self.come_back(by, at)

    def wait_until(self, time: float, facing: float | None = None, **stance: float) -> None:
        """Stand there until about a time."""
        if time > self.now:
            self.stay(time - self.now, facing, **stance)

    def walker(self) -> Walker:
        """With the plan as it is now."""
        stride = 0.8 * self.person.height * self.stage.uniform(0.92, 1.1)
        return Walker(self.start, self.facing, tuple(self.actions), self.speed, stride,
                      sway=self.stage.uniform(0, 2 * math.pi))  # fmt: skip


def _hall(stage: Stage) -> Hall:
    """A hall, seen from a table, a robot or the top of a cupboard."""
    stage.place_camera(0.8, 2.1)
    return Hall(stage)


def _apart(place: Point, others: list[Point]) -> bool:
    """Whether somebody there neither touches nor hides others, seen from the camera."""
    return all(
        math.dist(place, other) > 0.9 and abs(place[0] / place[1] - other[0] / other[1]) > 0.25
        for other in others
    )


def _least_hiding(places: list[Point], taken: list[Point]) -> Point:
    """The place of somebody who hides the target, the first of the others, least."""
    if not taken:
        return min(places, key=lambda place: place[1])  # before the furniture

    def gaps(place: Point) -> tuple[float, float]:
        beside = [abs(place[0] / place[1] - x / z) for x, z in taken]
        return min(beside[0], 0.25), min(beside)

    return max(places, key=gaps)


def _begin(diary: _Diary, others: list[_Diary], seat: bool) -> None:
    """Stand, walk or perhaps sit in view at first."""
    stage, hall = diary.stage, diary.hall
    if seat and hall.seats and stage.rng.uniform() < 0.4:
        seat_ = hall.seats.pop()
        diary.begin(seat_.feet)
        diary.facing = seat_.facing
        diary.stay(stage.uniform(3.0, 9.0), sit=1.0)
        diary.stay(0.6)
        diary.go(seat_.front, straight=True)
        return
    taken, tried = [d.start for d in others], []
    spot = hall.spot((1.9, 3.8), 0.65)
    for _ in range(60):
        clear = bool(others) or hall.in_sight(spot)  # the target, who is the first, is
        if clear and _apart(spot, taken):
            break
        tried.append(spot)
        spot = hall.spot((1.9, 3.8), 0.65)
    else:  # any place will do from which the target is seen
        if not (_apart(spot, taken[:1]) if taken else hall.in_sight(spot)):
            spot = _least_hiding(tried, taken)
    diary.begin(spot)
    if stage.rng.uniform() < 0.7:
        diary.look_about(stage.uniform(2.0, 6.0))


def _come_and_go(hall: Hall, people: list[Person], seconds: float) -> list[_Diary]:
    """Everybody leaves the view at least once and comes back elsewhere."""
    stage = hall.stage
    diaries = [_Diary(hall, person) for person in people]
    at_first = int(stage.rng.integers(2, 4))
    # spread over time, so that the view is never empty for long
    latest = seconds - 20.0
    leaving = [4.0 + (latest - 4.0) * (k + stage.uniform(0.1, 0.9)) / len(people)
               for k in range(len(people))]  # fmt: skip
    order = [int(k) for k in stage.rng.permutation(len(people))]
    for k, diary in enumerate(diaries):
        if k < at_first:
            _begin(diary, diaries[:k], seat=k > 0)
        else:
            diary.enter_late(hall.other_exit(None), stage.uniform(0.5, 7.0))
        until = max(leaving[order[k]], diary.now + 2.0)
        returned = False
        while diary.now < seconds:
            while diary.now < until:
                diary.do_something()
            away = stage.uniform(*ABSENCE_S)
            left = seconds - 12.0 - diary.now  # to be seen again for some seconds
            if not returned:
                away = max(ABSENCE_S[0], min(away, left))
            elif away > left:  # nobody would see them come back
                if until >= seconds or stage.rng.uniform() < 0.6:
                    until = seconds
                    continue
                diary.leave(hall.other_exit(None))
                break
            out = hall.other_exit(None)
            diary.leave(out)
            # they are out of sight a little before and after
            diary.come_back(hall.other_exit(out.name), max(away - 1.2, 0.5))
            until, returned = diary.now + stage.uniform(4.0, 11.0), True
    return diaries


def _scene(
    hall: Hall, diaries: list[_Diary], seconds: float,
    camera: CameraMotion | Callable[[list[list[Visit]]], CameraMotion] | None = None,
    light: Callable[[list[list[Visit]]], Callable[[float], Gain]] | None = None,
) -> World:  # fmt: skip
    """Let them carry out their plans; ``camera`` and ``light`` may depend on where they are."""
    stage = hall.stage
    visits = rehearse([diary.walker() for diary in diaries], hall.plan, seconds)
    if callable(camera):
        camera = camera(visits)
    cast: list[Actor] = [
        VisitorActor(diary.person, tuple(each), stage.depth)
        for diary, each in zip(diaries, visits, strict=True)
    ]
    scene = stage.scene(cast, seconds, room=hall.room, camera=camera,
                        light=light(visits) if light else None)  # fmt: skip
    scene.people = tuple(range(len(cast)))
    return scene


def _people(stage: Stage, low: int, high: int) -> list[Person]:
    """Some people, a few of whom carry a bag."""
    people = []
    for _ in range(int(stage.rng.integers(low, high + 1))):
        person = stage.person()
        bag = str(stage.rng.choice(['', '', '', 'hand', 'shoulder']))
        people.append(replace(person, bag=bag))
    return people


@several('4 to 6 people leave the view through the sides or a door and come back elsewhere')
def comers(stage: Stage) -> World:
    """Absences of 6 to 25 s."""
    hall = _hall(stage)
    return _scene(hall, _come_and_go(hall, _people(stage, 4, 6), LONG_S), LONG_S)


@several('as comers; two wear the same clothes and differ in height and build alone')
def comers_twins(stage: Stage) -> World:
    """The first is one of them."""
    people = _people(stage, 4, 6)
    short, tall = stage.uniform(1.55, 1.66), stage.uniform(1.79, 1.92)
    slim, broad = stage.uniform(0.88, 0.96), stage.uniform(1.04, 1.14)
    if stage.rng.uniform() < 0.5:
        short, tall, slim, broad = tall, short, broad, slim
    people[0] = replace(people[0], height=short, build=slim)
    people[1] = replace(people[0], height=tall, build=broad)
    order = [0, *(1 + int(k) for k in stage.rng.permutation(len(people) - 1))]
    hall = _hall(stage)
    return _scene(hall, _come_and_go(hall, [people[k] for k in order], LONG_S), LONG_S)


@several('as comers; the light falls or changes its colour while the target is away')
def comers_dusk(stage: Stage) -> World:
    """Over seconds, or at once as with a lamp; the exposure has made up for what it can."""
    hall = _hall(stage)
    diaries = _come_and_go(hall, _people(stage, 4, 6), LONG_S)
    return _scene(hall, diaries, LONG_S, light=lambda visits: _dusk(stage, visits[0]))


def _dusk(stage: Stage, visits: list[Visit]) -> Callable[[float], Gain]:
    """The light's gain over time; it changes between two visits."""
    away, back = visits[0].end, visits[1].start if len(visits) > 1 else visits[0].end + 6.0
    lasts = 0.05 if stage.rng.uniform() < 0.4 else stage.uniform(0.4, 1.0) * (back - away)
    begin = stage.uniform(away, max(away, back - lasts))
    level, tint = stage.uniform(0.38, 0.62), stage.uniform(0.1, 0.2) * stage.sign()
    kind = stage.rng.uniform()
    if kind < 0.3:
        level = stage.uniform(0.85, 1.1)  # the white balance alone
    elif kind < 0.55:
        tint *= 0.2  # the brightness alone

    def light(t: float) -> Gain:
        s = min(max((t - begin) / lasts, 0.0), 1.0)
        s = s * s * (3 - 2 * s)
        g = level**s
        return g * (1 - tint * s), g, g * (1 + tint * s)

    return light


@several('the target leaves for 30 s and comes back in another place; others remain')
def reunion(stage: Stage) -> World:
    """Perhaps a stranger enters meanwhile, where the target left."""
    hall = _hall(stage)
    diaries = [_Diary(hall, person) for person in _people(stage, 3, 5)]
    target, *others = diaries
    _begin(target, [], seat=False)
    target.do_something()
    out = hall.other_exit(None)
    target.leave(out)
    left_at = target.now
    target.come_back(hall.other_exit(out.name), 30.0 - 1.2)
    seconds = target.now + stage.uniform(6.0, 9.0)
    while target.now < seconds:
        target.do_something()
    for k, other in enumerate(others):
        if k == 0 and stage.rng.uniform() < 0.6:
            other.enter_late(out, left_at + stage.uniform(0.5, 6.0))
        else:
            _begin(other, diaries[: k + 1], seat=True)
        while other.now < seconds:
            other.do_something()
    return _scene(hall, diaries, seconds)


@several('a group crosses, stands together, touches, and walks on side by side')
def group_crossing(stage: Stage) -> World:
    """Nobody leaves for long; everybody hides everybody."""
    hall = _hall(stage)
    diaries = [_Diary(hall, person) for person in _people(stage, 4, 6)]
    pace = stage.uniform(0.8, 1.15)
    z, side = stage.uniform(2.3, 3.2), stage.sign()
    for k, diary in enumerate(diaries):  # from both sides, at distances of a shoulder's width
        diary.speed = pace * stage.uniform(0.92, 1.08)
        sign = side * (-1) ** k
        far = z + (k - 0.5 * len(diaries)) * stage.uniform(0.25, 0.4)
        if k < 4:
            diary.begin((stage.x(sign * stage.uniform(0.45, 0.75), far), far))
            diary.facing = stage.uniform(-math.pi, math.pi)
            diary.wait_until(stage.uniform(0.8, 1.6))
        else:
            diary.enter_late(hall.other_exit(None), stage.uniform(0.5, 2.0))
        diary.go((stage.x(-sign * stage.uniform(0.45, 0.7), far), far))
        diary.stay(stage.uniform(0.2, 1.0))
    meet = hall.spot((2.2, 3.2), 0.4)
    together = max(diary.now for diary in diaries) + 3.0
    ring = 0.25 / math.sin(math.pi / len(diaries))  # shoulder to shoulder
    for k, diary in enumerate(diaries):
        angle = 2 * math.pi * (k + 0.3) / len(diaries)
        ahead = (math.sin(angle), math.cos(angle))
        diary.go((meet[0] + ring * ahead[0], meet[1] + ring * ahead[1]))
        facing = math.atan2(-ahead[0], ahead[1])
        diary.wait_until(together, facing)
        diary.stay(stage.uniform(1.0, 2.0), facing, reach=0.9 * (stage.rng.uniform() < 0.4))
        diary.stay(stage.uniform(0.5, 2.5), facing)
    away = max(diary.now for diary in diaries)
    for first in range(0, len(diaries), 2):  # in pairs, hand in hand as it were
        pair = diaries[first : first + 2]
        goals = [hall.spot((1.9, 3.8), 0.65) for _ in range(3)]
        for k, diary in enumerate(pair):
            diary.speed = pair[0].speed
            diary.wait_until(away + 0.6 * first)
            for goal in goals:
                diary.go((goal[0] + 0.46 * k, goal[1]))
            diary.look_about(2.0)
    seconds = min(max(diary.now for diary in diaries), 32.0)
    return _scene(hall, diaries, seconds)


@several('people at home sit on a sofa, lie on a mattress, fall, leave, and come back')
def at_home(stage: Stage) -> World:
    """Who sits back or lies is hardly before what is under them, and no taller than a dog."""
    stage.place_camera(0.8, 2.1)
    hall = Hall(stage, (0, 2), rests=True)
    diaries = [_Diary(hall, person) for person in _people(stage, 3, 4)]
    for k, diary in enumerate(diaries):
        if k == 0:
            _begin(diary, [], seat=False)
        else:
            diary.enter_late(hall.other_exit(None), stage.uniform(1.0, 6.0) * k)
        while diary.now < AT_HOME_S:
            _rest(diary)
            if stage.rng.uniform() < 0.4:
                diary.do_something()
            if stage.rng.uniform() < 0.3:
                out = hall.other_exit(None)
                diary.leave(out)
                diary.come_back(hall.other_exit(out.name), stage.uniform(4.0, 10.0))
    return _scene(hall, diaries, AT_HOME_S)


def _rest(diary: _Diary) -> None:
    """Sit down on a sofa or lie down on a mattress that nobody has had yet; or fall."""
    stage, hall = diary.stage, diary.hall
    if hall.rests and stage.rng.uniform() < 0.8:
        seat = hall.rests.pop(int(stage.rng.integers(len(hall.rests))))
        stance = {'lie': 1.0, 'on': seat.height} if seat.height else {'sit': 1.0}
        diary.go(seat.front)
        diary.go(seat.feet, straight=True)
        diary.stay(0.9, seat.facing)
        diary.stay(stage.uniform(4.0, 9.0), seat.facing, **stance)
        diary.stay(1.2, seat.facing)
        diary.go(seat.front, straight=True)
        return
    diary.go(hall.spot((1.9, 3.8), 0.6))
    diary.stay(stage.uniform(0.3, 1.0), stage.uniform(-math.pi, math.pi))
    diary.stay(stage.uniform(3.0, 8.0), lie=1.0)
    diary.stay(1.5)


@several('a camera turns to and fro at 23 degrees a second among people who stand, sit and walk')
def lookaround(stage: Stage) -> World:
    """They leave the view because the camera does."""
    hall = _hall(stage)
    diaries = [_Diary(hall, person) for person in _people(stage, 3, 5)]
    seconds = stage.uniform(20.0, 26.0)
    for k, diary in enumerate(diaries):
        if k == len(diaries) - 1 and stage.rng.uniform() < 0.5:
            diary.enter_late(hall.exit(DOOR), stage.uniform(1.0, 8.0))
        else:
            _begin(diary, diaries[:k], seat=k > 0)
        if stage.rng.uniform() < 0.3:  # stays where they are
            diary.look_about(stage.uniform(5.0, 15.0))
        while diary.now < seconds:
            diary.do_something(share=1.1)
    keys, t, angle = [(0.0, 0.0), (stage.uniform(0.8, 1.5), 0.0)], 0.0, 0.0
    side = stage.sign()
    while keys[-1][0] < seconds:
        t, angle = keys[-1]
        to = side * stage.uniform(0.35, 0.7)
        # the middle of a smooth turn is half again as fast as its mean
        t += 1.5 * abs(to - angle) / PAN_SPEED
        keys += [(t, to), (t + stage.uniform(0.4, 1.5), to)]
        side = -side
    shake = stage.uniform(0.002, 0.006) if stage.rng.uniform() < 0.5 else 0.0
    camera = CameraMotion(stage.camera_height, stage.pitch, keys, shake=shake,
                          waves=hand_waves(stage.rng))  # fmt: skip
    return _scene(hall, diaries, seconds, camera=camera)


@several('a robot drives behind the target through a long hall, past people who come, cross, stand')
def following(stage: Stage) -> World:
    """The camera is on the robot; others pass between the two, overtake, and come towards them."""
    stage.place_camera(0.7, 1.3)
    hall = Hall(stage, (0, 1), depth=(13.0, 17.0), half_width=(2.6, 3.6))
    diaries = [_Diary(hall, person) for person in _people(stage, 4, 6)]
    target, *others = diaries
    target.speed = stage.uniform(0.7, 1.05)
    target.begin((stage.uniform(-0.3, 0.3), stage.uniform(1.8, 2.4)))
    target.stay(stage.uniform(1.0, 2.0))
    seen_at = [(target.now, target.place[1])]
    while target.place[1] < stage.depth - 2.6:
        ahead = min(target.place[1] + stage.uniform(1.5, 3.5), stage.depth - 1.8)
        target.go((stage.uniform(-0.6, 0.6), ahead))
        seen_at.append((target.now, ahead))
        if stage.rng.uniform() < 0.4:
            target.look_about(stage.uniform(0.5, 2.5))
            seen_at.append((target.now, ahead))
    target.stay(2.0)
    parts = [_come_towards, _cross_behind, _overtake, _stand_about]
    for k, other in enumerate(others):
        chosen = k if stage.rng.uniform() < 0.8 else int(stage.rng.integers(len(parts)))
        parts[chosen % len(parts)](other, seen_at, target.speed)

    def on_robot(visits: list[list[Visit]]) -> CameraMotion:
        walk = visits[0][0].motion
        way = drive_behind(
            lambda t: (walk.value('x', t), walk.value('z', t)), stage.uniform(1.9, 2.5), target.now
        )
        return CameraMotion(stage.camera_height, stage.pitch, shake=stage.uniform(0.001, 0.003),
                            waves=hand_waves(stage.rng), way=way)  # fmt: skip

    return _scene(hall, diaries, target.now, camera=on_robot)


def _beside_the_way(stage: Stage) -> float:
    """Metres to the right of somebody who is not run over."""
    return stage.sign() * stage.uniform(1.15, stage.half_width - 0.9)


def _come_towards(diary: _Diary, _: Keys, __: float) -> None:
    """Walk past the two."""
    stage = diary.stage
    x = _beside_the_way(stage)
    diary.begin((x, stage.uniform(5.5, stage.depth - 1.5)))
    diary.wait_until(stage.uniform(0.0, 4.0))
    diary.go((x, 1.0))
    diary.go((x, -1.5))


def _cross_behind(diary: _Diary, target_at: Keys, target_speed: float) -> None:
    """Walk from one wall to the other just behind the target, before the robot."""
    stage, side = diary.stage, diary.stage.sign()
    wall, ahead = stage.half_width - 0.7, stage.uniform(3.5, stage.depth - 4.0)
    times, places = zip(*target_at, strict=True)
    passed = float(np.interp(ahead, places, times)) + stage.uniform(0.2, 1.0) / target_speed
    diary.begin((side * wall, ahead))
    diary.wait_until(passed - 0.9 * wall / diary.speed)
    diary.go((-side * wall, ahead + stage.uniform(-0.3, 0.3)))
    diary.look_about(30.0)


def _overtake(diary: _Diary, _: Keys, target_speed: float) -> None:
    """Come from behind, faster, and walk on before the target."""
    stage, side = diary.stage, diary.stage.sign()
    diary.speed = target_speed * stage.uniform(1.25, 1.5)
    diary.begin((side * 1.2, -1.2))
    diary.wait_until(stage.uniform(1.0, 6.0))
    diary.go((side * stage.uniform(1.1, 1.3), 5.0))
    diary.go((side * stage.uniform(0.7, 1.2), 9.0))
    diary.go((stage.uniform(-0.5, 0.5), stage.depth - 1.2))
    diary.look_about(20.0)


def _stand_about(diary: _Diary, _: Keys, __: float) -> None:
    """Stand by the way."""
    diary.begin((_beside_the_way(diary.stage), diary.stage.uniform(3.0, diary.stage.depth - 2.0)))
    diary.look_about(60.0)
