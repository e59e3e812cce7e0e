# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Scenarios of several people, each with an id: they come and go, meet, and are taken for another."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from rgbd_kcf_tracker.simulation.actors import VisitorActor
from rgbd_kcf_tracker.simulation.floorplan import Point
from rgbd_kcf_tracker.simulation.hall import Exit, Hall
from rgbd_kcf_tracker.simulation.motion import CameraMotion, hand_waves
from rgbd_kcf_tracker.simulation.people import Person
from rgbd_kcf_tracker.simulation.scene import Actor, Gain, Scene
from rgbd_kcf_tracker.simulation.stage import Stage, scenario
from rgbd_kcf_tracker.simulation.walking import Action, Away, Go, Stay, Walker, rehearse

LONG_S = 45.0
ABSENCE_S = (6.0, 25.0)


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

    def stay(self, seconds: float, facing: float | None = None, **pose: float) -> None:
        """Stand or sit there."""
        self.actions.append(Stay(seconds, facing, **pose))
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

    def do_something(self) -> None:
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
            self.go(hall.spot())
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

    def walker(self, space: float = 0.5) -> Walker:
        """With the plan as it is now."""
        stride = 0.8 * self.person.height * self.stage.uniform(0.92, 1.1)
        return Walker(self.start, self.facing, tuple(self.actions), self.speed, stride, space)


def _come_and_go(
    stage: Stage, people: list[Person], seconds: float = LONG_S
) -> tuple[Hall, list[_Diary]]:
    """Everybody leaves the view at least once and comes back elsewhere."""
    hall = Hall(stage)
    diaries = [_Diary(hall, person) for person in people]
    at_first = int(stage.rng.integers(2, 4))
    for k, diary in enumerate(diaries):
        if k < at_first:
            spot = hall.spot((1.9, 3.8), 0.65)
            for _ in range(20):
                if all(math.dist(spot, d.start) > 0.9 for d in diaries[:k]):
                    break
                spot = hall.spot((1.9, 3.8), 0.65)
            if k > 0 and hall.seats and stage.rng.uniform() < 0.35:
                seat = hall.seats.pop()
                diary.begin(seat.feet)
                diary.facing = seat.facing
                diary.stay(stage.uniform(3.0, 9.0), sit=1.0)
                diary.stay(0.6)
                diary.go(seat.front, straight=True)
            else:
                diary.begin(spot)
                if k == 0 or stage.rng.uniform() < 0.65:
                    diary.look_about(stage.uniform(2.0, 6.0))
        else:
            diary.enter_late(hall.other_exit(None), stage.uniform(0.5, 7.0))
        until = diary.now + stage.uniform(2.0, 9.0)
        first = True
        while diary.now < seconds:
            while diary.now < until:
                diary.do_something()
            away = stage.uniform(*ABSENCE_S)
            latest = seconds - 6.0 - diary.now
            if first:
                away = max(ABSENCE_S[0], min(away, latest))
            elif away > latest:  # nobody would see them come back
                until = seconds if stage.rng.uniform() < 0.6 else until
                if until < seconds:
                    diary.leave(hall.other_exit(diary.left_by))
                    break
                continue
            out = hall.other_exit(None)
            diary.leave(out)
            # they are out of sight a little before and after
            diary.come_back(hall.other_exit(out.name), max(away - 1.2, 0.5))
            until, first = diary.now + stage.uniform(4.0, 11.0), False
    return hall, diaries


def _scene(
    stage: Stage, hall: Hall, diaries: list[_Diary], seconds: float, space: float = 0.5,
    camera: CameraMotion | None = None, light: Callable[[float], Gain] | None = None,
) -> Scene:  # fmt: skip
    """Let them carry out their plans."""
    visits = rehearse([diary.walker(space) for diary in diaries], hall.plan, seconds)
    cast: list[Actor] = [
        VisitorActor(diary.person, tuple(each), stage.depth)
        for diary, each in zip(diaries, visits, strict=True)
    ]
    scene = stage.scene(cast, seconds, room=hall.room, camera=camera, light=light)
    scene.people = tuple(range(len(cast)))
    return scene


def _people(stage: Stage, low: int, high: int) -> list[Person]:
    return [stage.person() for _ in range(int(stage.rng.integers(low, high + 1)))]


@scenario('4 to 6 people leave the view through the sides or a door and come back elsewhere')
def comers(stage: Stage) -> Scene:
    """Absences of 6 to 25 s."""
    hall, diaries = _come_and_go(stage, _people(stage, 4, 6))
    return _scene(stage, hall, diaries, LONG_S)


@scenario('as comers; two wear the same clothes and differ in height and build alone')
def comers_twins(stage: Stage) -> Scene:
    """The first is one of them."""
    people = _people(stage, 4, 6)
    short, tall = stage.uniform(1.55, 1.66), stage.uniform(1.79, 1.92)
    slim, broad = stage.uniform(0.88, 0.96), stage.uniform(1.04, 1.14)
    if stage.rng.uniform() < 0.5:
        short, tall, slim, broad = tall, short, broad, slim
    people[0] = replace(people[0], height=short, build=slim)
    people[1] = replace(people[0], height=tall, build=broad)
    order = [0, *(1 + int(k) for k in stage.rng.permutation(len(people) - 1))]
    hall, diaries = _come_and_go(stage, [people[k] for k in order])
    return _scene(stage, hall, diaries, LONG_S)


@scenario('as comers; the light falls or changes its colour while somebody is away')
def comers_dusk(stage: Stage) -> Scene:
    """Over seconds, or at once as with a lamp; the exposure makes up for a part of it."""
    hall, diaries = _come_and_go(stage, _people(stage, 4, 6))
    return _scene(stage, hall, diaries, LONG_S, light=_dusk(stage, LONG_S))


def _dusk(stage: Stage, seconds: float) -> Callable[[float], Gain]:
    """The light's gain over time."""
    begin = stage.uniform(0.25, 0.5) * seconds
    lasts = 0.05 if stage.rng.uniform() < 0.4 else stage.uniform(2.0, 8.0)
    level = stage.uniform(0.3, 0.6)
    tint = stage.uniform(0.1, 0.22) * stage.sign()
    kind = stage.rng.uniform()
    if kind < 0.3:
        level = stage.uniform(0.85, 1.1)  # the white balance alone
    elif kind < 0.55:
        tint *= 0.2  # the light alone

    def light(t: float) -> Gain:
        s = min(max((t - begin) / lasts, 0.0), 1.0)
        s = s * s * (3 - 2 * s)
        g = level**s
        return g * (1 - tint * s), g, g * (1 + tint * s)

    return light
