# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What moves in a scene: people and their parts, boxes on wheels, balls, mugs and small animals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from rgbd_kcf_tracker.simulation import materials, textures
from rgbd_kcf_tracker.simulation.motion import Motion
from rgbd_kcf_tracker.simulation.people import Person
from rgbd_kcf_tracker.simulation.room import Face, draw_face
from rgbd_kcf_tracker.simulation.solids import Atlas, Layer, SolidList, Solids, Vector, render
from rgbd_kcf_tracker.simulation.walking import Visit
from rgbd_kcf_tracker.simulation.world import Viewpoint

Window = tuple[int, int, int, int]
_DOWN = np.array([0.0, 1.0, 0.0])

MOMENT = 0.01
"""Seconds to either side over which a velocity is taken: the step of the tabulated motions."""


def velocity_of(centre: Callable[[float], Vector], t: float) -> Vector:
    """Metres per second, ``(3,)``, of what is at ``centre`` at each time."""
    moved: Vector = (centre(t + MOMENT) - centre(t - MOMENT)) / (2 * MOMENT)
    return moved


@dataclass(frozen=True)
class PersonActor:
    """A person on their way; ``parts`` draws the ``'head'`` or the ``'body'`` alone."""

    person: Person
    motion: Motion
    parts: str = 'all'

    def draw(self, t: float, view: Viewpoint, window: Window, shade: bool) -> Layer | None:
        """See `Actor`."""
        solids = self.person.solids(self.motion.stance(t), self.parts)
        return render(solids.moved(view.rotation, view.place), self.person.atlas, view.camera,
                      window, view.light, shade)  # fmt: skip

    def centre(self, t: float) -> Vector:
        """See `Actor`."""
        high = 0.93 if self.parts == 'head' else 0.55
        crouch = 1 - 0.35 * self.motion.value('crouch', t)
        return np.array([self.motion.value('x', t), -high * crouch * self.person.height,
                         self.motion.value('z', t)])  # fmt: skip

    def shadow(self, t: float) -> float:
        """See `Actor`."""
        return 0.0 if self.parts == 'head' else 0.36


@dataclass(frozen=True)
class VisitorActor:
    """A person who comes and goes; while away, nothing is drawn.

    Attributes:
        person: who.
        visits: when they are there and how they move then, in order.
        wall: distance of the wall behind which nobody casts a shadow that is seen.
    """

    person: Person
    visits: tuple[Visit, ...]
    wall: float = math.inf

    def draw(self, t: float, view: Viewpoint, window: Window, shade: bool) -> Layer | None:
        """See `Actor`."""
        if not self.here(t):
            return None
        return PersonActor(self.person, self._motion(t)).draw(t, view, window, shade)

    def centre(self, t: float) -> Vector:
        """See `Actor`; while away, where they were last or will be first."""
        return self._centre(self._motion(t), t)

    def velocity(self, t: float) -> Vector:
        """Metres per second in the room: between two visits nobody walks."""
        return velocity_of(partial(self._centre, self._motion(t)), t)

    def _centre(self, motion: Motion, t: float) -> Vector:
        low = 1 - 0.3 * motion.value('sit', t)
        stance = motion.stance(t)
        back = 0.2 * stance.sit * self.person.height
        middle = np.array([
            stance.x - back * math.sin(stance.heading), -0.55 * low * self.person.height,
            stance.z + back * math.cos(stance.heading),
        ])  # fmt: skip
        if stance.lie == 0:
            return middle
        rotation, offset = stance.fallen(self.person.height)
        return rotation @ (middle - offset)

    def shadow(self, t: float) -> float:
        """See `Actor`."""
        return 0.36 if self.here(t) and self.centre(t)[2] < self.wall else 0.0

    def here(self, t: float) -> bool:
        """Whether they are there."""
        # the first visit is from before the start, the last goes on
        first, last = self.visits[0], self.visits[-1]
        if t < first.start:
            return first.start <= 0
        return any(v.start <= t <= v.end or (v is last and v.stays and t > v.end)
                   for v in self.visits)  # fmt: skip

    def _motion(self, t: float) -> Motion:
        visits = [v for v in self.visits if v.start <= t] or [self.visits[0]]
        return visits[-1].motion


@dataclass(frozen=True)
class FacesActor:
    """A box, chair or panel that is pushed about: faces about its own origin on the floor."""

    faces: tuple[Face, ...]
    motion: Motion
    height: float

    def draw(self, t: float, view: Viewpoint, window: Window, shade: bool) -> Layer | None:
        """See `Actor`."""
        place = np.array([self.motion.value('x', t), -self.motion.value('lift', t),
                          self.motion.value('z', t)])  # fmt: skip
        faces = [f.moved(view.rotation, view.place - place) for f in self.faces]
        box = self._box(faces, view, window)
        if box is None:
            return None
        x0, y0, x1, y1 = box
        color = np.zeros((y1 - y0, x1 - x0, 3), np.uint8)
        depth = np.full(color.shape[:2], np.inf, np.float32)
        for f in faces:
            draw_face(f, view.camera, color, depth, origin=(x0, y0))
        return Layer(x0, y0, depth, color) if np.isfinite(depth).any() else None

    @staticmethod
    def _box(faces: list[Face], view: Viewpoint, window: Window) -> Window | None:
        p = np.array([
            f.corner + a * f.across + b * f.down for f in faces for a in (0, 1) for b in (0, 1)
        ])  # fmt: skip
        if p[:, 2].max() < 0.2:
            return None
        z = np.maximum(p[:, 2], 0.2)
        u = view.camera.fx * p[:, 0] / z + view.camera.cx
        v = view.camera.fy * p[:, 1] / z + view.camera.cy
        x0, x1 = np.clip([u.min(), u.max() + 2], window[0], window[2]).astype(int)
        y0, y1 = np.clip([v.min(), v.max() + 2], window[1], window[3]).astype(int)
        return (int(x0), int(y0), int(x1), int(y1)) if x1 > x0 and y1 > y0 else None

    def centre(self, t: float) -> Vector:
        """See `Actor`."""
        lift = self.motion.value('lift', t)
        return np.array([self.motion.value('x', t), -lift - self.height / 2,
                         self.motion.value('z', t)])  # fmt: skip

    def shadow(self, t: float) -> float:
        """See `Actor`."""
        return 0.36 if self.motion.value('lift', t) < 0.1 else 0.0


@dataclass(frozen=True)
class ThingActor:
    """Any solids that follow a function of time.

    Attributes:
        atlas: their textures.
        shape: the solids in the world frame at a time.
        middle: of the thing, world frame.
        radius: of its shadow on the floor, 0 for what stands on something else.
    """

    atlas: Atlas
    shape: Callable[[float], Solids]
    middle: Callable[[float], Vector]
    radius: float = 0.0

    def draw(self, t: float, view: Viewpoint, window: Window, shade: bool) -> Layer | None:
        """See `Actor`."""
        solids = self.shape(t).moved(view.rotation, view.place)
        return render(solids, self.atlas, view.camera, window, view.light, shade)

    def centre(self, t: float) -> Vector:
        """See `Actor`."""
        return self.middle(t)

    def shadow(self, t: float) -> float:
        """See `Actor`: weaker the higher it flies."""
        return max(0.0, self.radius - 0.5 * max(0.0, -float(self.middle(t)[1]) - self.radius))


def ball(rng: np.random.Generator, motion: Motion, radius: float) -> ThingActor:
    """A ball that rolls and bounces along a motion (its ``lift`` is the height of its bottom)."""
    colors = [textures.random_color(rng, (0.5, 1), (0.4, 1)) for _ in range(3)]
    kind = str(rng.choice(['plain', 'stripes', 'dots', 'checks', 'two_tone', 'camouflage']))
    atlas = Atlas([textures.cloth(rng, 128, 192, kind, (colors[0], colors[1], colors[2]))])
    tilt = rng.uniform(0, 2 * np.pi)

    def middle(t: float) -> Vector:
        return np.array([motion.value('x', t), -radius - motion.value('lift', t),
                         motion.value('z', t)])  # fmt: skip

    def shape(t: float) -> Solids:
        roll = motion.value('phase', t) * 1.4 / (2 * math.pi) / radius + tilt
        course = motion.value('heading', t)
        ahead = np.array([math.sin(course), 0, -math.cos(course)])
        pole = math.cos(roll) * _DOWN + math.sin(roll) * ahead
        side = np.cross(_DOWN, ahead)
        out = SolidList()
        out.ellipsoid(middle(t), pole * radius, radius, radius, 0, side)
        return out.pack()

    return ThingActor(atlas, shape, middle, radius)


def mug(
    rng: np.random.Generator, place: Callable[[float], Vector],
    turn: Callable[[float], float] | None = None,
) -> ThingActor:  # fmt: skip
    """A mug; ``place`` is the middle of its bottom, world frame."""
    color = textures.random_color(rng, (0.0, 0.9), (0.3, 1.0))
    other = textures.random_color(rng, (0.3, 1), (0.3, 1))
    kind = str(rng.choice(['plain', 'logo', 'stripes', 'dots', 'two_tone']))
    atlas = Atlas([
        textures.cloth(rng, 96, 256, kind, (color, other, other)),
        materials.paint(rng, 32, 32, color),
        materials.paint(rng, 32, 32, (40, 60, 90)),
    ])  # fmt: skip
    height, radius = float(rng.uniform(0.085, 0.12)), float(rng.uniform(0.036, 0.046))

    def shape(t: float) -> Solids:
        angle = turn(t) if turn is not None else 0.4
        base = place(t)
        side = np.array([math.cos(angle), 0.0, math.sin(angle)])
        top = base - height * _DOWN
        out = SolidList()
        out.limb(top, base, radius, radius * 0.92, 0, side)
        out.ellipsoid(top + 0.004 * _DOWN, 0.004 * _DOWN, radius * 0.97, radius * 0.97, 2, side)
        out.ellipsoid(base, 0.004 * _DOWN, radius * 0.9, radius * 0.9, 1, side)
        handle = [
            base + side * (radius * a) - _DOWN * (height * b)
            for a, b in ((0.85, 0.85), (1.6, 0.78), (1.8, 0.5), (1.6, 0.25), (0.85, 0.15))
        ]
        across = np.cross(side, _DOWN)
        for a, b in pairwise(handle):
            out.limb(a, b, 0.006, 0.006, 1, across)
            out.ellipsoid(b, 0.006 * _DOWN, 0.006, 0.006, 1, side)
        return out.pack()

    return ThingActor(atlas, shape, lambda t: place(t) - _DOWN * height / 2)


def animal(rng: np.random.Generator, motion: Motion, scale: float = 1.0) -> ThingActor:
    """A dog or cat that trots along a motion; ``scale`` 1 is a dog 0.45 m high at the back."""
    fur = textures.HAIR[int(rng.integers(len(textures.HAIR)))]
    second = textures.HAIR[int(rng.integers(len(textures.HAIR)))]
    kind = str(rng.choice(['plain', 'camouflage', 'two_tone', 'dots']))
    atlas = Atlas([
        textures.cloth(rng, 128, 192, kind, (fur, second, (225, 225, 225))),
        textures.hair(rng, 64, 64, fur),
        textures.hair(rng, 64, 64, second),
    ])  # fmt: skip
    s = scale

    def middle(t: float) -> Vector:
        return np.array([motion.value('x', t), -0.36 * s, motion.value('z', t)])

    def shape(t: float) -> Solids:
        course, phase = motion.value('heading', t), motion.value('phase', t) * 2
        effort = min(motion.value('effort', t), 1.2)
        ahead = np.array([math.sin(course), 0, -math.cos(course)])
        side = np.array([math.cos(course), 0, math.sin(course)])
        body = middle(t) - _DOWN * 0.015 * s * math.sin(2 * phase) * effort
        out = SolidList()
        out.ellipsoid(body, ahead * 0.27 * s, 0.1 * s, 0.11 * s, 0, side)
        neck, skull = body + ahead * 0.2 * s - _DOWN * 0.06 * s, body + ahead * 0.33 * s
        skull = skull - _DOWN * 0.17 * s
        out.limb(neck, skull, 0.075 * s, 0.06 * s, 1, side)
        out.ellipsoid(skull, _DOWN * 0.075 * s, 0.07 * s, 0.08 * s, 1, side)
        out.ellipsoid(skull + ahead * 0.09 * s + _DOWN * 0.02 * s, ahead * 0.055 * s, 0.036 * s,
                      0.034 * s, 2, side)  # fmt: skip
        for sign in (-1, 1):
            ear = skull + side * 0.05 * s * sign - _DOWN * 0.06 * s
            out.ellipsoid(ear, -_DOWN * 0.045 * s, 0.022 * s, 0.015 * s, 2, side)
            for where, offset in ((0.18, 0.0), (-0.19, math.pi)):
                hip = body + ahead * where * s + side * 0.055 * s * sign + _DOWN * 0.04 * s
                swing = 0.55 * effort * math.sin(phase + offset + (0 if sign > 0 else math.pi))
                leg = math.cos(swing) * _DOWN + math.sin(swing) * ahead
                paw = hip + leg * 0.3 * s
                out.limb(hip, paw, 0.045 * s, 0.024 * s, 0, side)
                out.ellipsoid(paw, ahead * 0.04 * s, 0.028 * s, 0.024 * s, 2, side)
        tail = body - ahead * 0.25 * s - _DOWN * 0.04 * s
        wag = side * 0.08 * s * math.sin(9 * t)
        out.limb(
            tail, tail - ahead * 0.13 * s - _DOWN * 0.14 * s + wag, 0.025 * s, 0.012 * s, 1, side
        )
        return out.pack()

    return ThingActor(atlas, shape, middle, 0.36 * s)
