# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How several people walk through a room at once: each has a plan, and they make way for another.

A plan is a list of `Go`, `Stay` and `Away`. `rehearse` lets everybody carry out theirs, in steps
of 50 ms, around the furniture and past each other, and gives each person's visits: the times in
which they are there at all. Plain Python floats, so that the outcome is the same everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TypeAlias

from rgbd_kcf_tracker.simulation.floorplan import FloorPlan, Point
from rgbd_kcf_tracker.simulation.motion import Motion

_STEP = 0.05  # seconds
_TURN = 2.8  # radians a second at most
_SPACE = 0.5  # metres between two middles that walkers would like to keep
_TOUCH = 0.41  # metres that they never undercut
_PATIENCE = 4.0  # seconds beyond the time a free way takes, after which one squeezes through


@dataclass(frozen=True, slots=True)
class Go:
    """Walk to a place, around the furniture, or straight to it."""

    to: Point
    straight: bool = False


@dataclass(frozen=True, slots=True)
class Stay:
    """Stand, sit or lie for a while.

    Attributes:
        seconds: how long.
        facing: radians, None to look on as before.
        sit: 1 to sit down.
        lie: 1 to lie down.
        on: metres above the floor of what they lie on.
        reach: 0 to 1, right hand held up.
    """

    seconds: float
    facing: float | None = None
    sit: float = 0.0
    reach: float = 0.0
    lie: float = 0.0
    on: float = 0.0


@dataclass(frozen=True, slots=True)
class Away:
    """Be gone for a while, then appear at a place that the camera does not see."""

    seconds: float
    back_at: Point


Action: TypeAlias = 'Go | Stay | Away'


@dataclass(frozen=True)
class Walker:
    """Somebody with a plan.

    Attributes:
        start: where they are at first.
        facing: radians at first.
        plan: what they do, one thing after the other; at its end they stand.
        speed: metres a second.
        stride: metres per two steps.
        sway: phase in radians of the small movements of somebody who stands.
    """

    start: Point
    facing: float
    plan: Sequence[Action]
    speed: float
    stride: float
    sway: float = 0.0


@dataclass(frozen=True)
class Visit:
    """A time in which somebody is there; with ``stays``, until the end of all and beyond."""

    start: float
    end: float
    motion: Motion
    stays: bool = False


@dataclass
class _State:
    """A walker at one moment."""

    walker: Walker
    x: float
    z: float
    heading: float
    vx: float = 0.0
    vz: float = 0.0
    step: int = -1
    until: float = math.inf
    way: list[Point] = field(default_factory=list)
    here: bool = True
    squeezes: bool = False
    record: list[tuple[float, ...]] = field(default_factory=list)
    visits: list[list[tuple[float, ...]]] = field(default_factory=list)

    @property
    def action(self) -> Action | None:
        plan = self.walker.plan
        return plan[self.step] if 0 <= self.step < len(plan) else None

    def leave(self) -> None:
        if self.record:
            self.visits.append(self.record)
        self.record, self.here = [], False


def rehearse(walkers: Sequence[Walker], plan: FloorPlan, seconds: float) -> list[list[Visit]]:
    """Let everybody carry out their plans; each one's visits, in the order of ``walkers``."""
    states = [_State(w, *w.start, w.facing) for w in walkers]
    for k in range(math.ceil(seconds / _STEP) + 1):
        t = k * _STEP
        for state in states:
            _decide(state, plan, t)
        wishes = [_wish(state, states) for state in states]
        for state, (vx, vz) in zip(states, wishes, strict=True):
            _move(state, vx, vz, plan)
        _part(states)
        for state in states:
            if state.here:
                action = state.action
                stay = action if isinstance(action, Stay) else Stay(0)
                rests = stay.sit or stay.lie
                dx, dz, turn = _sway(t, state.walker.sway, 0.3 if rests else 1.0)
                place = t, state.x + dx, state.z + dz, state.heading + turn
                state.record.append((*place, stay.sit, stay.reach, stay.lie, stay.on))
    return [
        [
            *(_visit(record, state.walker.stride) for record in state.visits if len(record) > 3),
            *([_visit(state.record, state.walker.stride, True)] if len(state.record) > 3 else []),
        ]
        for state in states
    ]


def _sway(t: float, phase: float, amount: float) -> tuple[float, float, float]:
    """Nobody stands quite still: a centimetre or two, and a few degrees."""
    slow, slower = math.sin(1.9 * t + phase), math.sin(0.8 * t + 2.3 * phase)
    return (
        amount * (0.008 * slow + 0.012 * slower),
        amount * 0.012 * math.sin(1.3 * t + 1.7 * phase),
        amount * (0.05 * slower + 0.03 * math.sin(2.7 * t + phase)),
    )


def _decide(state: _State, plan: FloorPlan, t: float) -> None:
    """Go on to the next thing as soon as one is done."""
    while state.step < len(state.walker.plan):
        action = state.action
        if isinstance(action, Go):
            state.squeezes = t > state.until
            if state.way:
                return
        elif action is not None and t < state.until:
            return
        if isinstance(action, Away):
            (state.x, state.z), state.vx, state.vz = action.back_at, 0.0, 0.0
            state.here = True
        state.step += 1
        state.squeezes = False
        action = state.action
        if isinstance(action, Go):
            here = (state.x, state.z)
            state.way = [action.to] if action.straight else plan.way(here, action.to)
            length = sum(math.dist(a, b) for a, b in pairwise([here, *state.way]))
            state.until = t + length / state.walker.speed + _PATIENCE
            if len(state.record) == 0:
                state.heading = _course(state.way[0][0] - state.x, state.way[0][1] - state.z)
        elif action is not None:
            state.until = t + action.seconds
            if isinstance(action, Away):
                state.leave()


def _course(dx: float, dz: float) -> float:
    return math.atan2(dx, -dz)


def _wish(state: _State, states: Sequence[_State]) -> tuple[float, float]:
    """The velocity that somebody would like to have now."""
    action = state.action
    if not state.here or not isinstance(action, Go) or not state.way:
        return 0.0, 0.0
    dx, dz = state.way[0][0] - state.x, state.way[0][1] - state.z
    left = math.hypot(dx, dz)
    taken = len(state.way) == 1 and left < 1.2 * _SPACE and any(
        other is not state and other.here and not isinstance(other.action, Go)
        and math.dist(state.way[0], (other.x, other.z)) < 0.8 * _SPACE
        for other in states
    )  # fmt: skip
    if taken or left < (0.08 if len(state.way) == 1 else 0.3):
        state.way.pop(0)
        return _wish(state, states)
    speed = state.walker.speed
    if len(state.way) == 1:
        speed *= min(1.0, 0.2 + left / 0.5)
    ux, uz = dx / left, dz / left
    vx, vz = ux * speed, uz * speed
    for other in states:
        if other is state or not other.here or state.squeezes:
            continue
        rx, rz = other.x - state.x, other.z - state.z
        gap = math.hypot(rx, rz)
        if gap > 4.0 or gap < 1e-6:
            continue
        if gap < _SPACE:  # too close: step back
            vx -= rx / gap * (_SPACE - gap) * 5
            vz -= rz / gap * (_SPACE - gap) * 5
        sx, sz = ux * speed - other.vx, uz * speed - other.vz
        square = sx * sx + sz * sz
        if square < 1e-4:
            continue
        meet = (rx * sx + rz * sz) / square  # seconds until they are nearest
        if not 0 < meet < 2.5 or (gap > left and math.hypot(other.vx, other.vz) < 0.1):
            continue
        nearest = math.hypot(rx - sx * meet, rz - sz * meet)
        if nearest < _SPACE + 0.2:
            aside = ux * rz - uz * rx  # positive: the other is to one side; go to the other
            sign = -1.0 if aside > 0 else 1.0
            strength = 1.3 * speed * (1 - nearest / (_SPACE + 0.2)) * (1 - meet / 2.5)
            vx += -uz * sign * strength
            vz += ux * sign * strength
    limit = 1.3 * state.walker.speed / max(math.hypot(vx, vz), 1e-9)
    return (vx * limit, vz * limit) if limit < 1 else (vx, vz)


def _move(state: _State, vx: float, vz: float, plan: FloorPlan) -> None:
    """One step towards a wished velocity."""
    if not state.here:
        return
    state.vx += (vx - state.vx) * _STEP / 0.25
    state.vz += (vz - state.vz) * _STEP / 0.25
    action = state.action
    if not isinstance(action, Go):
        state.vx = state.vz = 0.0
    state.x += state.vx * _STEP
    state.z += state.vz * _STEP
    if isinstance(action, Go) and not (action.straight or state.squeezes):
        for f in plan.footprints:
            f = f.grown(plan.reach - 0.03)
            if f.holds(state.x, state.z):
                state.x, state.z = f.pushed_out(state.x, state.z)
    facing = action.facing if isinstance(action, Stay) else None
    if math.hypot(state.vx, state.vz) > 0.25:
        facing = _course(state.vx, state.vz)
    if facing is not None:
        turn = (facing - state.heading + math.pi) % (2 * math.pi) - math.pi
        state.heading += min(max(turn * 0.35, -_TURN * _STEP), _TURN * _STEP)


def _part(states: Sequence[_State]) -> None:
    """Nobody walks through another: who walks is set back where two overlap."""
    for i, a in enumerate(states):
        for b in states[:i]:
            if not (a.here and b.here) or a.squeezes or b.squeezes:
                continue
            dx, dz = a.x - b.x, a.z - b.z
            gap = math.hypot(dx, dz)
            lack = _TOUCH - gap
            movers = [s for s in (a, b) if isinstance(s.action, Go)]
            if lack <= 0 or gap < 1e-6 or not movers:
                continue
            for s in movers:
                sign = 1 if s is a else -1
                s.x += sign * dx / gap * lack / len(movers)
                s.z += sign * dz / gap * lack / len(movers)


def _visit(record: list[tuple[float, ...]], stride: float, stays: bool = False) -> Visit:
    t, x, z, heading, *stances = (list(c) for c in zip(*record, strict=True))
    channels = {
        name: list(zip(t, values, strict=True))
        for name, values in zip(('sit', 'reach', 'lie', 'on'), stances, strict=True)
        if any(values)
    }
    motion = Motion(list(zip(t, x, z, strict=True)), heading=list(zip(t, heading, strict=True)),
                    stride=stride, corner_s=0.1, channels=channels)  # fmt: skip
    return Visit(t[0], t[-1], motion, stays)
