# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A hall for several people: a doorway, room beside the view, things in the middle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from rgbd_kcf_tracker.simulation import materials
from rgbd_kcf_tracker.simulation.floorplan import FloorPlan, Footprint, Point, footprint
from rgbd_kcf_tracker.simulation.room import (
    Face,
    Room,
    add_furniture,
    box_faces,
    chair,
    face,
    mattress,
    random_room,
    sofa,
    table,
)
from rgbd_kcf_tracker.simulation.stage import Stage
from rgbd_kcf_tracker.simulation.textures import Texture

HEIGHT = 2.7
_SIDES = ('left', 'right')
DOOR = 'door'


@dataclass(frozen=True, slots=True)
class Exit:
    """A way out of the view.

    Attributes:
        name: ``'left'``, ``'right'`` or ``'door'``.
        inside: the last place in view.
        outside: where nobody is seen.
    """

    name: str
    inside: Point
    outside: Point


@dataclass(frozen=True, slots=True)
class Seat:
    """A chair, sofa or mattress.

    Attributes:
        feet: where those of somebody who sits or lies there are.
        front: from where they come.
        facing: radians, where they look.
        height: metres above the floor of what they lie on.
    """

    feet: Point
    front: Point
    facing: float
    height: float = 0.0


@dataclass(frozen=True, slots=True)
class Niche:
    """A place to stand beside a thing of the same depth, and where one comes from."""

    front: Point
    place: Point


class Hall:
    """A random hall around a stage's camera, with a doorway in the wall at the back.

    Args:
        stage: source of randomness; its ``depth`` and ``half_width`` are set.
        things: fewest and one more than most pieces that stand in the middle.
        depth: metres to the wall at the back, least and most.
        half_width: metres to the walls at the sides, least and most.
        rests: whether there are sofas and a mattress.
    """

    def __init__(
        self, stage: Stage, things: tuple[int, int] = (2, 5),
        depth: tuple[float, float] = (4.7, 6.2), half_width: tuple[float, float] = (4.3, 5.4),
        rests: bool = False,
    ) -> None:  # fmt: skip
        self.stage = stage
        rng = stage.rng
        stage.depth = stage.uniform(*depth)
        stage.half_width = stage.uniform(*half_width)
        self.room = random_room(rng, stage.depth, stage.half_width, 0, HEIGHT)
        self.plan = FloorPlan()
        self.seats: list[Seat] = []
        self.niches: list[Niche] = []
        self.rests: list[Seat] = []
        farthest = stage.half_width - 0.9
        door = stage.x(stage.uniform(-0.6, 0.6), stage.depth)
        self.door = min(max(door, -farthest), farthest)
        self._door_width = stage.uniform(0.95, 1.2)
        self._open_door()
        if rests:
            self._to_rest()
        for _ in range(int(rng.integers(3, 8))):
            self._along_walls()
        for _ in range(int(rng.integers(*things))):
            self._in_the_middle()

    def exit(self, name: str) -> Exit:
        """A way out on a side, at a random distance, or through the door."""
        stage = self.stage
        if name == DOOR:
            inner = -1 if self.door > 0 else 1
            return Exit(name, (self.door, stage.depth - 0.45),
                        (self.door + inner * 1.35, stage.depth + 0.75))  # fmt: skip
        sign = -1 if name == 'left' else 1
        # a camera that looks down sees feet farther out than heads
        along, lower = math.cos(stage.pitch), stage.camera_height * max(math.sin(stage.pitch), 0.0)
        far = ((stage.half_width - 1.2) / stage.half_tan - lower) / along
        for _ in range(20):
            z = stage.uniform(0.95, min(far, 3.6))
            inside, outside = stage.x(0.85, z), stage.x(1.0, z * along + lower) + 0.75
            if self.plan.free(sign * inside, z) and self.plan.free(sign * outside, z):
                break
        return Exit(name, (sign * inside, z), (sign * outside, z))

    def other_exit(self, than: str | None) -> Exit:
        """A way in or out that is another than the one named."""
        names = [name for name in (*_SIDES, DOOR) if name != than]
        return self.exit(str(self.stage.rng.choice(names)))

    def spot(self, z: tuple[float, float] = (1.6, 4.2), share: float = 0.75) -> Point:
        """A free place in view."""
        stage = self.stage
        x = far = 0.0
        for _ in range(40):
            far = stage.uniform(z[0], min(z[1], stage.depth - 0.7))
            x = stage.x(stage.uniform(-share, share), far)
            if self.plan.free(x, far, 0.38):
                break
        return x, far

    def in_sight(self, place: Point) -> bool:
        """Whether no furniture stands between the camera and somebody there."""
        return not any(f.grown(0.1).cut_by((0.0, 0.0), place) for f in self.plan.footprints[2:])

    def _open_door(self) -> None:
        """Cut the wall at the back, and build what is seen behind it."""
        stage, room = self.stage, self.room
        rng, depth, half = stage.rng, stage.depth, stage.half_width
        left, right = self.door - self._door_width / 2, self.door + self._door_width / 2
        high = stage.uniform(2.02, 2.15)
        wall = room.faces[0]
        walls = [_part(wall, half, box) for box in (
            (-half, left, 0, HEIGHT), (right, half, 0, HEIGHT), (left, right, high, HEIGHT),
        )]  # fmt: skip
        pictures = [f for f in room.faces[6:] if not _beside(f, left - 0.1, right + 0.1)]
        back, thick = depth + stage.uniform(1.6, 2.4), 0.12
        light = stage.uniform(0.5, 0.95)
        x, y, z = np.eye(3)
        paper = materials.wallpaper(rng, 256, 512)
        ground = room.faces[3].pyramid[0] if rng.uniform() < 0.5 else materials.floor(rng, 512, 512)
        jamb = materials.paint(rng, 64, 32, tuple(float(c) for c in rng.uniform(60, 235, 3)))  # type: ignore[arg-type]
        beyond = [
            face(np.array([self.door - 5, -HEIGHT, back]), 10 * x, HEIGHT * y, paper, light),
            face(np.array([self.door - 5, 0, back]), 10 * x, -(back - depth) * z, ground, light),
            face(np.array([left, -high, depth]), thick * z, high * y, jamb, light),
            face(np.array([right, -high, depth]), thick * z, high * y, jamb, light),
            face(np.array([left, -high, depth]), (right - left) * x, thick * z, jamb, light),
        ]
        outer = right if self.door > 0 else left
        if rng.uniform() < 0.6:  # the door leaf stands open into the corridor
            hinge = np.array([outer, 0.0, depth + 0.12 + self._door_width / 2])
            leaf = materials.cabinet(rng, 256, 128)
            beyond += box_faces(hinge, (0.04, high, self._door_width), 0.0, [leaf])
        room.faces[:] = [*walls, *room.faces[1:6], *beyond, *pictures]
        self.plan.footprints += [
            Footprint(-half - 1, depth, left, depth + thick),
            Footprint(right, depth, half + 1, depth + thick),
        ]

    def _along_walls(self) -> None:
        """A piece of furniture along a wall, unless it stands in somebody's way."""
        piece = Room()
        add_furniture(self.stage.rng, piece, self.stage.depth, self.stage.half_width)
        self._place(piece)

    def _in_the_middle(self) -> None:
        """A bin, table, chair, cupboard or pile of boxes that stands free, and where one stands."""
        stage = self.stage
        rng = stage.rng
        x, z = self.spot((2.3, 4.0), 0.7)
        spot = np.array([x, 0.0, z])
        turn = float(rng.normal(0, 0.2))
        piece = Room()
        kind = str(rng.choice(['bin', 'table', 'chair', 'chair', 'cupboard', 'boxes']))
        if kind == 'bin':
            skin = [materials.paint(rng, 96, 64, tuple(float(c) for c in rng.uniform(20, 200, 3)))]  # type: ignore[arg-type]
            size = (stage.uniform(0.3, 0.45), stage.uniform(0.55, 1.0), stage.uniform(0.3, 0.45))
            piece.faces += box_faces(spot, size, turn, skin)
        elif kind == 'table':
            piece.faces += table(rng, spot, turn)
        elif kind == 'chair':
            turn = stage.uniform(-1.6, 1.6)
            piece.faces += chair(rng, spot, turn)
        elif kind == 'cupboard':
            size = (stage.uniform(0.5, 1.1), stage.uniform(0.8, 1.7), stage.uniform(0.3, 0.5))
            piece.faces += stage.box_faces((x, z), size, str(rng.choice(['cupboard', 'shelf'])))
        else:
            for level in range(int(rng.integers(1, 4))):
                side = stage.uniform(0.4, 0.6)
                piece.faces += box_faces(spot - np.array([0, 0.35 * level, 0]), (side, 0.35, side),
                                         turn + float(rng.normal(0, 0.15)),
                                         [materials.cardboard(rng, 160, 160)])  # fmt: skip
        print_ = self._place(piece)
        if print_ is None:
            return
        if kind == 'chair':
            ahead = (math.sin(turn), -math.cos(turn))
            front = (x + 0.75 * ahead[0], z + 0.75 * ahead[1])
            if self.plan.free(*front):
                feet = (x + 0.42 * ahead[0], z + 0.42 * ahead[1])
                self.seats.append(Seat(feet, front, turn))
            return
        for side in (-1, 1):
            edge = print_.x0 if side < 0 else print_.x1
            niche = Niche(
                (edge + side * 0.55, z - 0.1), (edge + side * stage.uniform(0.2, 0.32), z)
            )
            if self.plan.free(*niche.front):
                self.niches.append(niche)

    def _to_rest(self) -> None:
        """Two sofas and a mattress, as far as there is a place for them."""
        stage = self.stage
        for make in (sofa, mattress, sofa):
            for _ in range(60):
                z = stage.uniform(2.3, min(stage.depth - 1.0, 4.3))
                x = stage.x(stage.uniform(-0.7, 0.7), z)
                turn = stage.uniform(-0.9, 0.9) + (math.pi / 2 if make is mattress else 0.0)
                faces, reach, height = make(stage.rng, np.array([x, 0.0, z]), turn)
                ahead = (math.sin(turn), -math.cos(turn))
                feet, front = ((x + d * ahead[0], z + d * ahead[1]) for d in (reach, reach + 0.6))
                if self.plan.free(*front) and self._place(Room(faces)) is not None:
                    self.rests.append(Seat(feet, front, turn, height))
                    break

    def _place(self, piece: Room) -> Footprint | None:
        """Take a piece into the room where it is in nobody's way."""
        points = [
            (float(p[0]), float(p[2]))
            for f in piece.faces for p in (f.corner, f.corner + f.across, f.corner + f.down,
                                           f.corner + f.across + f.down)
        ]  # fmt: skip
        points += [
            (float(o[0]) + s, float(o[2]) + s)
            for solids, _ in piece.plants for o in solids.origin for s in (-0.1, 0.1)
        ]  # fmt: skip
        mine = footprint(points)
        door = Footprint(self.door - 0.9, self.stage.depth - 1.4, self.door + 0.9, 99.0)
        near = Footprint(-9.0, -9.0, 9.0, 1.5)
        kept = [door, near, *(f.grown(0.7) for f in self.plan.footprints[2:])]
        fronts = [niche.front for niche in self.niches]
        fronts += [seat.front for seat in (*self.seats, *self.rests)]
        kept += [footprint([front]).grown(0.3) for front in fronts]
        if any(mine.meets(k) for k in kept):
            return None
        self.room.faces += piece.faces
        self.room.plants += piece.plants
        self.plan.footprints.append(mine)
        return mine


def _beside(f: Face, left: float, right: float) -> bool:
    """Whether a picture on the wall reaches into a strip."""
    x0 = float(f.corner[0])
    x1 = x0 + float(f.across[0])
    return min(x0, x1) < right and max(x0, x1) > left


def _part(wall: Face, half: float, box: tuple[float, float, float, float]) -> Face:
    """The part of the back wall between two columns and two heights, in metres."""
    x0, x1, low, high = box
    texture: Texture = wall.pyramid[0]
    rows, cols = texture.shape[:2]
    c0, c1 = (round((x + half) / (2 * half) * cols) for x in (x0, x1))
    r0, r1 = (round((HEIGHT - h) / HEIGHT * rows) for h in (high, low))
    cut = np.ascontiguousarray(texture[r0 : max(r1, r0 + 1), c0 : max(c1, c0 + 1)])
    if min(cut.shape[:2]) < 8:
        cut = np.asarray(cv2.resize(cut, (max(8, cut.shape[1]), max(8, cut.shape[0]))), np.uint8)
    corner = np.array([x0, -high, float(wall.corner[2])])
    return face(corner, np.array([x1 - x0, 0, 0]), np.array([0, high - low, 0.0]), cut)
