# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""People: random bodies and clothes, and the stance of a walking, turning, crouching figure.

World frame: x right, y down, z forward, metres; the floor is y = 0. A heading of 0 looks towards -z
(at the camera), and grows towards +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.simulation.solids import Atlas, SolidList, Solids, Vector
from rgbd_kcf_tracker.simulation.wardrobe import (
    EXTRA,
    FOREARM,
    HAIR,
    HAND,
    HEAD,
    NECK,
    SHIN,
    SHIRT,
    SHOE,
    SLEEVE,
    THIGH,
    Wardrobe,
)

BACK = 0.08
"""From the middle of a body to its back, in its heights."""


@dataclass(frozen=True, slots=True)
class Stance:
    """Where a person stands and what they do, at one moment.

    Attributes:
        x: metres to the right.
        z: metres forward.
        heading: radians.
        phase: of the gait, radians; a stride (two steps) is 2 pi.
        effort: 0 standing to 1 walking at 1.4 m/s; up to 2 running.
        crouch: 0 upright to 1 squatting.
        spread: 0 arms down to 1 arms out to the sides.
        reach: 0 to 1, right hand held up in front.
        sit: 0 upright to 1 sitting: the feet stay at ``x, z``, the pelvis is behind them.
        lie: 0 upright to 1 lying on the back, the feet at ``x, z``.
        on: metres above the floor of what they lie on.
    """

    x: float
    z: float
    heading: float = 0.0
    phase: float = 0.0
    effort: float = 0.0
    crouch: float = 0.0
    spread: float = 0.0
    reach: float = 0.0
    sit: float = 0.0
    lie: float = 0.0
    on: float = 0.0

    def fallen(self, height: float) -> tuple[Vector, Vector]:
        """Rotation and offset by which somebody who stands, ``height`` tall, comes to lie.

        A point ``p`` goes to ``rotation @ (p - offset)``.
        """
        angle = 0.5 * math.pi * self.lie
        feet = np.array([self.x, 0.0, self.z])
        side, up, forward = self.axes
        back = math.cos(angle) * up - math.sin(angle) * forward
        belly = math.cos(angle) * forward + math.sin(angle) * up
        rotation = np.outer(side, side) + np.outer(back, up) + np.outer(belly, forward)
        rests = feet + up * (BACK * height * math.sin(angle) + self.on * self.lie)
        return rotation, feet - rotation.T @ rests

    @property
    def axes(self) -> tuple[Vector, Vector, Vector]:
        """Unit vectors to the left, up and ahead of somebody upright."""
        sin, cos = math.sin(self.heading), math.cos(self.heading)
        return np.array([cos, 0, sin]), np.array([0, -1.0, 0]), np.array([sin, 0, -cos])


@dataclass(frozen=True)
class Person:
    """A body and its clothes.

    Attributes:
        height: metres.
        build: 0.85 slim to 1.2 broad.
        atlas: textures by the indices above.
        skirt: knee-length skirt or coat instead of trousers' outline.
        long_hair: hair down to the shoulders.
        hat: 0 none, 1 cap.
        backpack: wears one.
        bag: ``'hand'`` or ``'shoulder'`` for one carried on the left, empty for none.
    """

    height: float
    build: float
    atlas: Atlas
    skirt: bool = False
    long_hair: bool = False
    hat: bool = False
    backpack: bool = False
    bag: str = ''

    def solids(self, stance: Stance, parts: str = 'all') -> Solids:
        """The figure in the world frame; ``parts`` is ``'all'``, ``'head'`` or ``'body'``."""
        solids = _Figure(self, stance).build(parts)
        return solids.moved(*stance.fallen(self.height)) if stance.lie > 0 else solids

    def hand(self, stance: Stance) -> Vector:
        """Where the right hand is, world frame."""
        hand = _Figure(self, stance).arm(1)[2]
        if stance.lie == 0:
            return hand
        rotation, offset = stance.fallen(self.height)
        return rotation @ (hand - offset)


def random_person(
    rng: np.random.Generator, like: Wardrobe | None = None, child: bool = False
) -> tuple[Person, Wardrobe]:
    """A person at random, or another person in (nearly) the same clothes.

    Args:
        rng: source of randomness.
        like: clothes to wear.
        child: 1.0 to 1.4 m tall.
    """
    wardrobe = like if like is not None else Wardrobe.random(rng)
    height = rng.uniform(1.0, 1.4) if child else rng.normal(1.72, 0.09)
    height = float(np.clip(height, 1.0, 1.98))
    person = Person(
        height, float(rng.uniform(0.88, 1.15)), wardrobe.tailor(rng), wardrobe.skirt,
        wardrobe.long_hair, wardrobe.hat, wardrobe.backpack,
    )  # fmt: skip
    return person, wardrobe


class _Figure:
    """Joint positions of a person in a stance, then the solids around them."""

    def __init__(self, person: Person, stance: Stance) -> None:
        self.person, self.stance = person, stance
        self.side, self.up, self.forward = stance.axes
        h = person.height
        self.unit = h
        self.width = h * person.build
        amplitude = 0.48 * min(stance.effort, 1.5)
        swing = math.sin(stance.phase)
        self.legs = []
        for sign in (-1, 1):
            thigh = -sign * amplitude * swing + 1.5 * stance.crouch + 1.5 * stance.sit
            knee = 0.12 * min(stance.effort, 1) + 1.9 * amplitude * max(
                0.0, math.cos(stance.phase) * float(-sign)
            )
            knee += 2.55 * stance.crouch + 1.5 * stance.sit
            self.legs.append((thigh, thigh - knee))
        length = 0.245 * h
        reach = max(length * (math.cos(a) + math.cos(b)) for a, b in self.legs)
        self.lean = (
            0.05 * stance.effort + 0.55 * stance.crouch + 0.35 * math.sin(math.pi * stance.sit)
        )
        self.trunk = math.cos(self.lean) * self.up + math.sin(self.lean) * self.forward
        floor = np.array([stance.x, 0.0, stance.z])
        self.pelvis = floor + self.up * (reach + 0.04 * h) - self.forward * 0.2 * h * stance.crouch
        if stance.sit > 0:
            self.pelvis = self.pelvis - self.forward * length * math.sin(1.5 * stance.sit)
        self.chest = self.pelvis + self.trunk * 0.29 * h
        twist = 0.18 * min(stance.effort, 1.2) * swing
        self.shoulder_side = math.cos(twist) * self.side + math.sin(twist) * self.forward

    def _sagittal(self, angle: float) -> Vector:
        return -math.cos(angle) * self.up + math.sin(angle) * self.forward

    def arm(self, sign: int) -> tuple[Vector, Vector, Vector, Vector]:
        """Shoulder, elbow and wrist of the left (-1) or right (1) arm, and its local side axis."""
        stance, h = self.stance, self.unit
        shoulder = self.chest + self.shoulder_side * (-sign * 0.105 * self.width)
        swing = 0.55 * min(stance.effort, 1.6) * math.sin(stance.phase) * sign
        bend = 0.15 + 0.35 * min(stance.effort, 2.0)
        reach = stance.reach if sign > 0 else 0.0
        swing = (1 - reach) * swing + 0.9 * reach + 0.4 * stance.crouch
        bend = (1 - reach) * bend + 1.2 * reach
        away = 0.1 + 1.45 * stance.spread
        out = self.shoulder_side * float(-sign)
        level = math.cos(away) * -self.up + math.sin(away) * out
        turn = math.cos(away) if stance.spread > 0 else 1.0
        upper = math.cos(swing * turn) * level + math.sin(swing * turn) * self.forward
        fore_angle = swing * turn + bend * (1 - 0.8 * stance.spread)
        fore = math.cos(fore_angle) * level + math.sin(fore_angle) * self.forward
        elbow = shoulder + upper * 0.17 * h
        axis = math.cos(away) * out + math.sin(away) * self.up
        return shoulder, elbow, elbow + fore * 0.15 * h, axis * float(-sign)

    def build(self, parts: str) -> Solids:
        """All solids of the figure, or of its head or of the rest."""
        out = SolidList()
        if parts in ('all', 'head'):
            self._head(out)
        if parts in ('all', 'body'):
            self._trunk(out)
            for sign in (-1, 1):
                self._arm(out, sign)
                self._leg(out, sign)
            if self.person.bag:
                self._bag(out)
        return out.pack()

    def _bag(self, out: SolidList) -> None:
        h = self.unit
        if self.person.bag == 'hand':
            wrist = self.arm(-1)[2]
            middle = wrist - self.up * 0.14 * h
            out.limb(wrist - self.up * 0.03 * h, middle, 0.012 * h, 0.03 * h, EXTRA, self.forward)
            out.ellipsoid(middle, -self.up * 0.07 * h, 0.09 * h, 0.035 * h, EXTRA, self.forward)
            return
        hip = self.pelvis + self.side * 0.115 * self.width - self.up * 0.01 * h
        out.ellipsoid(hip, -self.up * 0.08 * h, 0.085 * h, 0.04 * h, EXTRA, self.forward)
        across = self.chest - self.shoulder_side * 0.07 * self.width + self.trunk * 0.03 * h
        for ahead in (0.075, -0.075):  # the strap, before and behind
            middle = 0.5 * (hip + across) + self.forward * ahead * self.width
            out.limb(across, middle, 0.009 * h, 0.009 * h, EXTRA, self.forward)
            out.limb(middle, hip, 0.009 * h, 0.009 * h, EXTRA, self.forward)

    def _head(self, out: SolidList) -> None:
        h = self.unit
        grow = 1.0 if h > 1.5 else 1.15
        head = self.chest + self.trunk * 0.105 * h * grow + self.forward * 0.012 * h
        down = -0.068 * h * grow * self.up
        out.ellipsoid(head, down, 0.047 * h * grow, 0.056 * h * grow, HEAD, self.side)
        back = head + self.up * 0.012 * h - self.forward * 0.014 * h
        out.ellipsoid(back, down * 0.93, 0.05 * h * grow, 0.051 * h * grow, HAIR, self.side)
        if self.person.long_hair:
            out.limb(back, back - self.up * 0.1 * h - self.forward * 0.012 * h, 0.051 * h,
                     0.058 * h, HAIR, self.side, 0.75)  # fmt: skip
        if self.person.hat:
            top = head + self.up * 0.035 * h
            out.ellipsoid(top, down * 0.62, 0.054 * h, 0.062 * h, EXTRA, self.side)
            brim = top + self.forward * 0.05 * h
            out.ellipsoid(brim, -0.008 * h * self.up, 0.045 * h, 0.05 * h, EXTRA, self.side)

    def _trunk(self, out: SolidList) -> None:
        h, w, side = self.unit, self.width, self.side
        out.limb(self.chest, self.chest + self.trunk * 0.07 * h, 0.03 * w, 0.027 * w, NECK, side)
        top = self.chest + self.trunk * 0.03 * h
        out.limb(top, self.pelvis, 0.098 * w, 0.086 * w, SHIRT, self.shoulder_side, 0.62)
        out.ellipsoid(self.chest - self.trunk * 0.02 * h, -self.trunk * 0.062 * h, 0.118 * w,
                      0.062 * w, SLEEVE, self.shoulder_side)  # fmt: skip
        hip = -self.trunk * 0.058 * h
        out.ellipsoid(self.pelvis - self.trunk * 0.005 * h, hip, 0.092 * w, 0.066 * w, THIGH, side)
        if self.person.skirt:
            low = self.pelvis + self._sagittal(self.stance.crouch) * 0.24 * h
            out.limb(self.pelvis, low, 0.088 * w, 0.12 * w, EXTRA, side, 0.75)
        if self.person.backpack:
            pack = self.chest - self.trunk * 0.09 * h - self.forward * 0.085 * w
            out.ellipsoid(pack, -self.trunk * 0.13 * h, 0.085 * w, 0.055 * w, EXTRA, side)

    def _arm(self, out: SolidList, sign: int) -> None:
        w = self.width
        shoulder, elbow, wrist, axis = self.arm(sign)
        fore = wrist - elbow
        fore /= np.linalg.norm(fore)
        ball = 0.034 * w
        out.ellipsoid(shoulder, (elbow - shoulder) * 0.2, ball, ball, SLEEVE, axis)
        out.limb(shoulder, elbow, 0.032 * w, 0.025 * w, SLEEVE, axis)
        out.ellipsoid(elbow, fore * 0.025 * w, 0.025 * w, 0.025 * w, FOREARM, axis)
        out.limb(elbow, wrist, 0.025 * w, 0.018 * w, FOREARM, axis)
        out.ellipsoid(wrist + fore * 0.035 * self.unit, fore * 0.048 * self.unit, 0.022 * w,
                      0.015 * w, HAND, axis)  # fmt: skip

    def _leg(self, out: SolidList, sign: int) -> None:
        h, w, side = self.unit, self.width, self.side
        thigh_angle, shin_angle = self.legs[0 if sign < 0 else 1]
        hip = self.pelvis + side * (-sign * 0.046 * w)
        knee = hip + self._sagittal(thigh_angle) * 0.245 * h
        shin = self._sagittal(shin_angle)
        ankle = knee + shin * 0.245 * h
        out.limb(hip, knee, 0.05 * w, 0.036 * w, THIGH, side)
        out.ellipsoid(knee, shin * 0.036 * w, 0.036 * w, 0.037 * w, SHIN, side)
        out.limb(knee, ankle, 0.035 * w, 0.024 * w, SHIN, side)
        pitch = 0.5 * shin_angle if self.stance.crouch < 0.3 else 0.0
        toe = math.cos(pitch) * self.forward + math.sin(pitch) * self.up
        foot = ankle - self.up * 0.012 * h + toe * 0.045 * h
        sole = np.cross(toe, side)
        sole = sole if sole[1] > 0 else -sole
        out.ellipsoid(foot, sole * 0.026 * h, 0.028 * w, 0.08 * h, SHOE, side)
