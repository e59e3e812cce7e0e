# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Figures: what stands before the room, cut into one silhouette for each person.

Pieces above each other are joined (a desk, an arm or a seam without a reading cuts a person in
two), and what is too wide for one person is parted: at the places where people are expected, else
between heads (sub-clustering by heads is Munaro and Menegatti's, Autonomous Robots 37, 2014).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import Surfaces, surfaces_in

FloatArray = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

JUMP, JUMP_PER_METRE = 0.06, 0.04
"""Depth step between two figures: limbs stand off the trunk farther than one surface may step."""
LEAST_PIXELS = 12
LEAST_PIECE = 0.004
"""Square metres below which a piece is noise."""
LEAST_AREA = 0.06
"""Square metres from which something is a figure: about a head and a shoulder."""
LEAST_HEIGHT = 0.35
LEAST_TOP = 0.6
"""Metres above the floor that a figure reaches: what is lower is no person, not even a seated
one."""
DEPTH_STEP, DEPTH_STEP_PER_METRE = 0.25, 0.03
"""Metres in depth between two pieces of one person: an arm's reach, and the sensor's noise."""
GAP_ABOVE, GAP_BESIDE = 0.35, 0.05
"""Metres between two pieces of one person, above each other and beside."""
WIDEST, TALLEST = 0.9, 2.2
"""Metres of a person with arms half spread, and of a tall one."""
BREADTH = 0.4
"""Metres between the heads of two people side by side, at the least."""
BROAD = BREADTH + 0.25
"""Metres from which a figure may be two people: those, and half a shoulder's width on each side."""
UPRIGHT = 1.0
"""Metres of height of each of two pieces beside each other, together at least :data:`BROAD`, from
which they are two people: no limb is that tall."""
VALLEY = 0.08
"""Metres by which the outline must fall between two heads."""
HEAD_BELOW = 0.5
"""Metres by which one head may be below another in one figure."""
REACH_ACROSS, REACH_DEEP = 0.2, 0.15
"""Half of a person's breadth and depth in metres: the scales in which pixels are nearest to one."""
APART = 0.28
"""Metres between the middles of two people, at the least."""
EVERY = 3
"""One in so many pixels is enough to tell where the middles of people are."""
LEAST_SHARE = 0.15
"""Share of a figure's pixels below which a part of it is not somebody."""


@dataclass(frozen=True, slots=True, eq=False)
class Figure:
    """One person's silhouette, or what may be one.

    Attributes:
        seen: the silhouette.
        top: metres above the floor of its upper end; None where no floor is known or it is cut off.
        place: ``(2,)`` metres across and along the floor from the camera.
        parted: whether it was cut out of a figure of several, so that its outline is a guess.
    """

    seen: Silhouette
    top: float | None
    place: FloatArray
    parted: bool


def find_figures(scene: Scene, expected: FloatArray) -> list[Figure]:
    """The figures of a scene.

    Args:
        scene: of now.
        expected: ``(n, 2)`` metres across and deep, where people are expected.
    """
    mask = scene.before & scene.standing
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    if not width:
        return []
    # Mostly few pixels stand before the room: only where they are is anything to be cut.
    part = slice(y, y + height), slice(x, x + width)
    pieces = surfaces_in(scene.view.depth[part], mask[part], JUMP, JUMP_PER_METRE)
    found: list[Figure] = []
    for members in _joined(scene, pieces, scene.forward[part]):
        boxes = pieces.boxes[members]
        left, top = int(boxes[:, 0].min()), int(boxes[:, 1].min())
        right, bottom = (boxes[:, :2] + boxes[:, 2:]).max(axis=0)
        crop = pieces.labels[top:bottom, left:right]
        member = np.zeros(len(pieces), np.bool_)
        member[members] = True
        parts = _parted(scene, part[1].start + left, part[0].start + top, member[crop], expected)
        for part_left, part_top, silhouette in parts:
            figure = _figure(scene, part_left, part_top, silhouette, len(parts) > 1)
            if figure is not None:
                found.append(figure)
    return found


def _joined(
    scene: Scene, pieces: Surfaces, forward: npt.NDArray[np.float32]
) -> list[npt.NDArray[np.intp]]:
    """Labels of the pieces that make one figure each, the largest first."""
    k = scene.view.intrinsics
    areas = pieces.areas(k)
    possible = (pieces.pixels >= LEAST_PIXELS) & (areas > LEAST_PIECE)
    possible[0] = False
    labels = np.flatnonzero(possible)
    labels = labels[np.argsort(-areas[labels], kind='stable')]
    ahead = pieces.means(forward)
    groups: list[list[int]] = []
    extents: list[tuple[float, float, float, float, float, float]] = []
    for label in labels:
        left, top, width, height = (float(v) for v in pieces.boxes[label])
        right, bottom, depth = left + width, top + height, float(ahead[label])
        area = float(areas[label])
        for index, (x0, y0, x1, y1, z, total) in enumerate(extents):
            if abs(depth - z) > DEPTH_STEP + DEPTH_STEP_PER_METRE * z:
                continue
            across, down = z / k.fx, z / k.fy
            beside = (max(left, x0) - min(right, x1)) * across
            above = (max(top, y0) - min(bottom, y1)) * down
            wide = (max(right, x1) - min(left, x0)) * across
            tall = (max(bottom, y1) - min(top, y0)) * down
            two = wide > BROAD and min(height, y1 - y0) * down > UPRIGHT
            if (
                not two
                and beside < GAP_BESIDE
                and above < GAP_ABOVE
                and wide < max(WIDEST, (x1 - x0) * across + 0.1)
                and tall < TALLEST
            ):
                groups[index].append(int(label))
                both = total + area
                extents[index] = (
                    min(left, x0),
                    min(top, y0),
                    max(right, x1),
                    max(bottom, y1),
                    (z * total + depth * area) / both,
                    both,
                )
                break
        else:
            groups.append([int(label)])
            extents.append((left, top, right, bottom, depth, area))
    return [
        np.array(group)
        for group, extent in zip(groups, extents, strict=True)
        if extent[5] > LEAST_AREA
    ]


def _parted(
    scene: Scene, left: int, top: int, mask: Mask, expected: FloatArray
) -> list[tuple[int, int, Mask]]:
    """A figure's mask, or the masks of the people that it is made of, each with its corner."""
    k = scene.view.intrinsics
    rows, cols = mask.shape
    depth = scene.view.depth[top : top + rows, left : left + cols]
    ahead = scene.forward[top : top + rows, left : left + cols]
    z = float(depth[mask].mean())
    columns = np.arange(left, left + cols) + 0.5 - k.cx
    seeds = expected
    if len(seeds):
        u = seeds[:, 0] * k.fx / np.maximum(seeds[:, 1], 0.2) + k.cx - left
        margin = 0.1 * k.fx / z
        inside = (u > -margin) & (u < cols + margin)
        if np.count_nonzero(inside) > 1:
            near, far = np.percentile(ahead[mask], (5, 95))
            inside &= (seeds[:, 1] > near - 0.3) & (seeds[:, 1] < far + 0.3)
        seeds = seeds[inside]
    if len(seeds) < 2:
        if cols * z / k.fx < BROAD:
            return [(left, top, mask)]
        seeds = _heads(mask, depth, ahead, columns, top - k.cy, k.fx, k.fy)
        if len(seeds) < 2:
            return [(left, top, mask)]
    v, u_ = np.nonzero(mask)
    reach = np.array([REACH_ACROSS, REACH_DEEP])
    points = np.stack((columns[u_] * depth[v, u_] / k.fx, ahead[v, u_]), axis=1) / reach
    seeds = seeds / reach
    some = points[::EVERY]
    for _ in range(3):
        owner = _nearest(some, seeds)
        count = np.bincount(owner, minlength=len(seeds))
        keep = count > LEAST_SHARE * len(some) / len(seeds)
        if not keep.all():
            seeds = seeds[keep]
            if len(seeds) < 2:
                return [(left, top, mask)]
            continue
        sums = [np.bincount(owner, some[:, axis]) for axis in (0, 1)]
        seeds = np.stack(sums, axis=1) / count[:, None]
    apart = np.hypot(*((seeds[:, None] - seeds[None]) * reach).transpose(2, 0, 1))
    if (apart[np.triu_indices(len(seeds), 1)] < APART).any():
        return [(left, top, mask)]
    owner = _nearest(points, seeds)
    parts = []
    for index in range(len(seeds)):
        part = np.zeros_like(mask)
        mine = owner == index
        if not mine.any():
            continue
        part[v[mine], u_[mine]] = True
        y0, x0 = int(v[mine].min()), int(u_[mine].min())
        y1, x1 = int(v[mine].max()) + 1, int(u_[mine].max()) + 1
        parts.append((left + x0, top + y0, part[y0:y1, x0:x1]))
    return parts


def _nearest(points: FloatArray, seeds: FloatArray) -> npt.NDArray[np.intp]:
    """Index of the seed ``(m, 2)`` that is nearest to each point ``(n, 2)``, ``(n,)``."""
    away = np.square(seeds).sum(axis=1) - 2 * (points @ seeds.T)
    return np.asarray(away.argmin(axis=1))


def _heads(
    mask: Mask,
    depth: npt.NDArray[np.float32],
    ahead: npt.NDArray[np.float32],
    columns: npt.NDArray[np.float64],
    above: float,
    fx: float,
    fy: float,
) -> FloatArray:
    """Where the heads in a wide mask are, ``(n, 2)`` metres across and deep."""
    has = np.asarray(mask.any(axis=0))
    first = mask.argmax(axis=0)
    sums = np.where(mask, depth, 0).sum(axis=0)
    z = np.where(has, sums / np.maximum(mask.sum(axis=0), 1), np.nan)
    tall = -(first + above) * z / fy
    across = columns * z / fx
    wide = max(1, int(0.1 * fx / float(np.nanmean(z))))
    filled = np.where(has, tall, np.nanmin(tall) - 1)
    smooth = np.convolve(np.pad(filled, wide, mode='edge'), np.full(2 * wide + 1, 1.0), 'valid')
    smooth /= 2 * wide + 1
    heads: list[int] = []
    highest = float(smooth[has].max())
    for column in np.argsort(-smooth, kind='stable'):
        if not has[column]:
            continue
        if smooth[column] < highest - HEAD_BELOW:
            break
        if all(
            abs(across[column] - across[head]) > BREADTH
            and smooth[min(column, head) : max(column, head) + 1].min()
            < min(smooth[column], smooth[head]) - VALLEY
            for head in heads
        ):
            heads.append(int(column))
    deep = np.where(mask, ahead, 0).sum(axis=0) / np.maximum(mask.sum(axis=0), 1)
    return np.stack((across[heads], deep[heads]), axis=1)


def _figure(scene: Scene, left: int, top: int, mask: Mask, parted: bool) -> Figure | None:
    seen = Silhouette.of(scene.view, left, top, mask, 0, scene.rim)
    if not makes_figure(scene, seen):
        return None
    highest = None if seen.cut.top else seen.highest(scene.elevation)
    return Figure(seen, highest, place_of(scene, seen), parted)


def makes_figure(scene: Scene, seen: Silhouette) -> bool:
    """Whether a silhouette that stands before the room is large and high enough for a figure."""
    cut_off = seen.cut.any
    if seen.area < (LEAST_AREA if cut_off else 2 * LEAST_AREA) or seen.height < LEAST_HEIGHT:
        return False
    highest = seen.highest(scene.elevation)
    return highest is None or highest >= LEAST_TOP


def place_of(scene: Scene, seen: Silhouette) -> FloatArray:
    """Where a silhouette is, ``(2,)`` metres across and along the floor."""
    left, _, right, _ = seen.metres
    ahead = float(scene.forward[seen.rows, seen.cols][seen.mask].mean())
    return np.array([(left + right) / 2, ahead])
