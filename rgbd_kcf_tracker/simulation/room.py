# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Rooms: textured walls, floor and furniture as flat faces, plants as solids, with true depth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.simulation import materials, textures
from rgbd_kcf_tracker.simulation.solids import NEAR, Atlas, SolidList, Solids, Vector
from rgbd_kcf_tracker.simulation.textures import Texture


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """A textured parallelogram: ``corner + u * across + v * down`` for u, v in [0, 1]."""

    corner: Vector
    across: Vector
    down: Vector
    pyramid: tuple[Texture, ...]

    def moved(self, rotation: Vector, offset: Vector) -> Face:
        """The same face after ``p -> rotation @ (p - offset)``."""
        return Face(
            rotation @ (self.corner - offset), rotation @ self.across, rotation @ self.down,
            self.pyramid,
        )  # fmt: skip


def face(
    corner: Vector, across: Vector, down: Vector, texture: Texture, light: float = 1.0
) -> Face:
    """Make a face with its texture's levels of detail; ``light`` darkens or brightens it."""
    if light != 1.0:
        texture = cv2.convertScaleAbs(texture, alpha=light)
    levels = [texture]
    while min(levels[-1].shape[:2]) > 24:
        levels.append(cv2.pyrDown(levels[-1]))
    return Face(np.asarray(corner, float), np.asarray(across, float), np.asarray(down, float),
                tuple(levels))  # fmt: skip


def box_faces(
    centre: Vector, size: tuple[float, float, float], turn: float, skin: list[Texture]
) -> list[Face]:
    """The five visible faces of an upright box.

    Args:
        centre: of its bottom, world frame.
        size: width, height and depth in metres.
        turn: radians about the vertical.
        skin: textures of the sides in turn; the top takes the last.
    """
    c, s = np.cos(turn), np.sin(turn)
    ex, ez = np.array([c, 0, s]) * size[0], np.array([-s, 0, c]) * size[2]
    down = np.array([0.0, size[1], 0.0])
    top = np.asarray(centre, float) - down
    sides = [
        (top - ex / 2 - ez / 2, ex, 1.0),
        (top + ex / 2 - ez / 2, ez, 0.82),
        (top + ex / 2 + ez / 2, -ex, 0.7),
        (top - ex / 2 + ez / 2, -ez, 0.9),
    ]
    faces = [
        face(corner, across, down, skin[i % len(skin)], light)
        for i, (corner, across, light) in enumerate(sides)
    ]
    faces.append(face(top - ex / 2 - ez / 2, ex, ez, skin[-1], 1.12))
    return faces


def _clip_near(points: Vector) -> Vector:
    """The part of a polygon beyond the near plane."""
    out = []
    for p, q in zip(points, np.roll(points, -1, axis=0), strict=True):
        if p[2] >= NEAR:
            out.append(p)
        if (p[2] >= NEAR) != (q[2] >= NEAR):
            out.append(p + (q - p) * (NEAR - p[2]) / (q[2] - p[2]))
    return np.array(out)


def draw_face(
    f: Face, camera: Intrinsics, color: npt.NDArray[np.uint8], depth: npt.NDArray[np.float32],
    origin: tuple[int, int] = (0, 0),
) -> None:  # fmt: skip
    """Draw a face given in the camera's frame into colour and depth where it is nearest.

    Args:
        f: the face.
        camera: pinhole camera.
        color: ``(h, w, 3)`` picture or window of it.
        depth: ``(h, w)`` metres, inf where empty.
        origin: picture coordinates of the window's first pixel.
    """
    quad = np.array(
        [f.corner, f.corner + f.across, f.corner + f.across + f.down, f.corner + f.down]
    )
    polygon = _clip_near(quad)
    if len(polygon) < 3:
        return
    normal = np.cross(f.across, f.down)
    offset = float(normal @ f.corner)
    if abs(offset) < 1e-9:
        return
    uv = polygon[:, :2] / polygon[:, 2:] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    uv -= origin
    height, width = depth.shape
    x0, y0 = np.clip(np.floor(uv.min(0)), 0, (width, height)).astype(int)
    x1, y1 = np.clip(np.ceil(uv.max(0)) + 1, 0, (width, height)).astype(int)
    if x1 <= x0 or y1 <= y0:
        return
    mask = np.zeros((y1 - y0, x1 - x0), np.uint8)
    corners = np.clip((uv - (x0, y0)) * 16, -(1 << 20), 1 << 20)
    cv2.fillConvexPoly(mask, np.round(corners).astype(np.int32), 255, cv2.LINE_8, 4)
    cols = (np.arange(x0, x1) + origin[0] - camera.cx) / camera.fx
    rows = (np.arange(y0, y1) + origin[1] - camera.cy) / camera.fy
    inverse = (normal[0] / offset * cols).astype(np.float32) + (
        (normal[1] * rows + normal[2]) / offset
    ).astype(np.float32)[:, None]
    window = np.s_[y0:y1, x0:x1]
    z = np.divide(1, inverse, out=np.full_like(inverse, np.inf), where=inverse > 1e-3)
    hit = (mask > 0) & (z < depth[window])
    if not hit.any():
        return
    k = np.array([[camera.fx, 0, camera.cx - origin[0] - x0],
                  [0, camera.fy, camera.cy - origin[1] - y0], [0, 0, 1]])  # fmt: skip
    area = cv2.contourArea(uv.astype(np.float32))
    level, levels = 0, len(f.pyramid)
    while level + 1 < levels and f.pyramid[level].shape[0] * f.pyramid[level].shape[1] > 2.2 * area:
        level += 1
    texture = f.pyramid[level]
    th, tw = texture.shape[:2]
    mapping = k @ np.stack([f.across / tw, f.down / th, f.corner], axis=1)
    picture = cv2.warpPerspective(
        texture,
        mapping,
        (x1 - x0, y1 - y0),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    select = hit.view(np.uint8)
    cv2.copyTo(picture, select, color[window])
    np.copyto(depth[window], z, where=hit)


@dataclass
class Room:
    """What stands still: faces, and plants as solids."""

    faces: list[Face] = field(default_factory=list)
    plants: list[tuple[Solids, Atlas]] = field(default_factory=list)


def random_room(
    rng: np.random.Generator, depth: float, half_width: float, clutter: int, height: float = 2.7
) -> Room:
    """A room seen from z = 0 towards +z.

    Args:
        rng: source of randomness.
        depth: distance of the back wall in metres.
        half_width: of the side walls from x = 0.
        clutter: how many pieces of furniture stand along the walls.
        height: of the ceiling.
    """
    room = Room()
    near = -2.0
    x = np.array([1.0, 0, 0])
    y = np.array([0, 1.0, 0])
    z = np.array([0, 0, 1.0])
    wide, deep = 2 * half_width, depth - near
    wall = materials.wallpaper(rng, 512, 1400)
    side = wall if rng.uniform() < 0.6 else materials.wallpaper(rng, 512, 1400)
    top_left = -half_width * x - height * y
    ceiling = materials.ceiling(rng, 512, 512)
    room.faces = [
        face(top_left + depth * z, wide * x, height * y, wall),
        face(top_left + near * z, deep * z, height * y, side, float(rng.uniform(0.75, 1))),
        face(top_left + wide * x + depth * z, -deep * z, height * y, side,
             float(rng.uniform(0.75, 1))),
        face(-half_width * x + depth * z, wide * x, -deep * z, materials.floor(rng, 1024, 1024)),
        face(top_left + near * z, wide * x, deep * z, ceiling),
    ]  # fmt: skip
    back = room.faces[0]  # the wall behind the camera is the same, for a camera that turns about
    room.faces.append(Face(top_left + wide * x + near * z, -back.across, back.down, back.pyramid))
    for _ in range(int(rng.integers(1, 5))):
        w, h = rng.uniform(0.4, 1.6), rng.uniform(0.4, 1.2)
        left = rng.uniform(-half_width, half_width - w)
        corner = left * x - rng.uniform(h + 0.6, max(h + 0.7, 2.3)) * y + (depth - 0.02) * z
        room.faces.append(face(corner, w * x, h * y, materials.poster(rng, 256, int(256 * w / h))))
    for _ in range(clutter):
        add_furniture(rng, room, depth, half_width)
    return room


def add_furniture(rng: np.random.Generator, room: Room, depth: float, half_width: float) -> None:
    """Put a cupboard, box, table, chair or plant along a wall."""
    against = rng.choice(['back', 'back', 'left', 'right'])
    if against == 'back':
        spot = np.array(
            [rng.uniform(-0.85, 0.85) * half_width, 0.0, depth - rng.uniform(0.35, 0.7)]
        )
    else:
        x = (half_width - rng.uniform(0.3, 0.6)) * (-1 if against == 'left' else 1)
        spot = np.array([x, 0.0, rng.uniform(0.55, 0.95) * depth])
    turn = float(rng.normal(0, 0.15))
    kind = rng.choice(['cupboard', 'cupboard', 'box', 'table', 'chair', 'plant'])
    if kind == 'cupboard':
        make = materials.FURNITURE[int(rng.integers(len(materials.FURNITURE)))]
        size = (rng.uniform(0.6, 1.5), rng.uniform(0.7, 2.1), rng.uniform(0.35, 0.6))
        room.faces += box_faces(
            spot, size, turn, [make(rng, 320, 320), materials.wood(rng, 128, 128)]
        )
    elif kind == 'box':
        for level in range(int(rng.integers(1, 4))):
            side = rng.uniform(0.3, 0.6)
            lower = spot - np.array([rng.uniform(-0.05, 0.05), 0.35 * level, 0])
            room.faces += box_faces(
                lower, (side, 0.35, side), turn + float(rng.normal(0, 0.2)),
                [materials.cardboard(rng, 160, 160)],
            )  # fmt: skip
    elif kind == 'table':
        room.faces += table(rng, spot, turn)
    elif kind == 'chair':
        room.faces += chair(rng, spot + np.array([0, 0, -0.2]), float(rng.uniform(0, 6.28)))
    else:
        room.plants.append(plant(rng, spot))


def table(rng: np.random.Generator, spot: Vector, turn: float) -> list[Face]:
    """A table with four legs."""
    w, d, h = rng.uniform(0.8, 1.5), rng.uniform(0.5, 0.8), rng.uniform(0.68, 0.78)
    wood = [materials.wood(rng, 128, 256)]
    faces = box_faces(spot - np.array([0, h - 0.04, 0]), (w, 0.04, d), turn, wood)
    return faces + _legs(spot, w, d, h - 0.04, turn, wood)


def chair(rng: np.random.Generator, spot: Vector, turn: float) -> list[Face]:
    """A chair with seat, back and four legs."""
    color = textures.random_color(rng)
    cloth = [textures.cloth(rng, 96, 96, 'plain', (color, color, color))]
    w, d, h = 0.46, 0.46, 0.46
    faces = box_faces(spot - np.array([0, h - 0.06, 0]), (w, 0.06, d), turn, cloth)
    shift = np.array([-np.sin(turn), 0, np.cos(turn)]) * (d / 2 - 0.02)
    back = rng.uniform(0.4, 0.6)
    faces += box_faces(spot + shift - np.array([0, h, 0]), (w, back, 0.04), turn, cloth)
    return faces + _legs(spot, w, d, h - 0.06, turn, [materials.wood(rng, 64, 64)])


def sofa(rng: np.random.Generator, spot: Vector, turn: float) -> tuple[list[Face], float, float]:
    """A sofa; its faces, metres ahead of its middle of the feet of who sits there, and 0.

    Whoever sits there sinks in by some centimetres.
    """
    color = textures.random_color(rng, (0.1, 0.6), (0.15, 0.8))
    skin = [textures.cloth(rng, 160, 160, 'plain', (color, color, color))]
    wide, deep, high = rng.uniform(1.4, 2.0), 0.5, rng.uniform(0.4, 0.46)
    back, arms = rng.uniform(0.8, 0.95), rng.uniform(0.55, 0.65)
    across = np.array([math.cos(turn), 0, math.sin(turn)]) * (wide / 2 + 0.08)
    behind = np.array([-math.sin(turn), 0, math.cos(turn)]) * (deep / 2 + 0.09)
    faces = box_faces(spot, (wide, high, deep), turn, skin)
    faces += box_faces(spot + behind, (wide, back, 0.18), turn, skin)
    for side in (-1, 1):
        faces += box_faces(spot + side * across, (0.16, arms, deep + 0.1), turn, skin)
    return faces, deep / 2 - 0.04, 0.0


def mattress(
    rng: np.random.Generator, spot: Vector, turn: float
) -> tuple[list[Face], float, float]:
    """A mattress on the floor; its faces, where feet are as of a :func:`sofa`, and its height."""
    colors = tuple(textures.random_color(rng, (0.0, 0.5), (0.4, 0.95)) for _ in range(3))
    kind = str(rng.choice(['plain', 'stripes', 'checks']))
    skin = [textures.cloth(rng, 256, 256, kind, (colors[0], colors[1], colors[2]))]
    wide, high, long = rng.uniform(0.9, 1.2), rng.uniform(0.15, 0.3), rng.uniform(1.9, 2.1)
    return box_faces(spot, (wide, high, long), turn, skin), long / 2 - 0.1, high


def _legs(
    spot: Vector, w: float, d: float, h: float, turn: float, skin: list[Texture]
) -> list[Face]:
    c, s = np.cos(turn), np.sin(turn)
    faces: list[Face] = []
    for i in (-1, 1):
        for j in (-1, 1):
            x, z = i * (w / 2 - 0.03), j * (d / 2 - 0.03)
            place = spot + np.array([c * x - s * z, 0, s * x + c * z])
            faces += box_faces(place, (0.045, h, 0.045), turn, skin)[:4]
    return faces


def plant(rng: np.random.Generator, spot: Vector) -> tuple[Solids, Atlas]:
    """A pot with leaves."""
    out = SolidList()
    x, y = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    h = rng.uniform(0.25, 0.45)
    out.limb(spot - h * y, spot, 0.19, 0.13, 0, x)
    for _ in range(int(rng.integers(10, 18))):
        angle, lift = rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 1.0)
        away = np.array([np.cos(angle), -lift * 1.6, np.sin(angle)])
        away *= rng.uniform(0.15, 0.35) / np.linalg.norm(away)
        centre = spot - h * y + away * rng.uniform(1.0, 2.2)
        out.ellipsoid(centre, away, rng.uniform(0.04, 0.09), 0.015, 1, np.cross(away, x + 0.3 * y))
    green = (rng.uniform(30, 70), rng.uniform(90, 150), rng.uniform(40, 90))
    pot = textures.random_color(rng, (0.2, 0.7), (0.3, 0.8))
    atlas = Atlas([materials.paint(rng, 64, 64, pot), textures.hair(rng, 64, 64, green)])
    return out.pack(), atlas
