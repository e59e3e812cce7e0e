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

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.perceive.parting import BROAD, parted
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import UPPER, Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import Surfaces, surfaces_in
from rgbd_kcf_tracker.metric.perceive.upright import GROWN, child

JUMP, JUMP_PER_METRE = 0.06, 0.04
"""Depth step between two figures: limbs stand off the trunk farther than one surface may step."""
LEAST_PIXELS = 12
"""Pixels of the view, three by four, below which a piece is noise, too: beyond some 3.6 m these are
more than :data:`LEAST_PIECE`."""
LEAST_PIECE = 0.004
"""Square metres below which a piece is noise: a patch of some 6 cm, smaller than a hand."""
LEAST_AREA = 0.06
"""Square metres from which something is a figure, if it is all of somebody or more of it may be
hidden: about a head and a shoulder, or a child of four from the side (0.07). Else it is twice as
much."""
LEAST_HEIGHT = 0.35
LEAST_TOP = 0.6
"""Metres above the floor that a figure reaches: what is lower is no person, not even a seated
one."""
FLOATS = 1.3
"""Metres above the floor from which a figure under which nothing hides more of it is nobody, but a
piece of the ceiling: dark trousers may give no reading, and hips are at 0.9 m."""
DEPTH_STEP, DEPTH_STEP_PER_METRE = 0.25, 0.03
"""Metres in depth between two pieces of one person: an arm's reach, and the sensor's noise."""
SEATED, SHIN = 0.5, 0.45
"""Metres by which the shins of who sits are nearer than the rest of him, a thigh's length, and
above the floor where their middle is at the most: whoever else is nearer has a trunk."""
GAP_ABOVE, GAP_BESIDE = 0.35, 0.05
"""Metres between two pieces of one person, above each other, which a table's edge or an arm may
hide, and beside: a seam without a reading."""
WIDEST, TALLEST = 0.9, 2.2
"""Metres of a person with arms half spread, and of a tall one."""
UPRIGHT = 1.0
"""Metres of height of each of two pieces beside each other, together at least :data:`BROAD`, from
which they are two people: no limb is that tall."""
STAYS, FALL = 0.5, 0.35
"""Share of the smaller of the boxes about two outlines that both have where both are of one who
falls, and metres by which he has fallen from one frame to the next: at 3 m/s, at 10 Hz."""
LOW = 0.9
"""Metres above the floor below which heads side by side are none, but knees, or an arm."""
AT_REST = 1.0
"""Seconds for which a camera must have stood for what comes before the room to have come: one that
turns to and fro stands for a moment each time."""


@dataclass(frozen=True, slots=True, eq=False)
class Figure:
    """One person's silhouette, or what may be one.

    Attributes:
        seen: the silhouette.
        place: ``(2,)`` metres across and along the floor from the camera.
        parted: whether it was cut out of a figure of several, so that its outline is a guess.
    """

    seen: Silhouette
    place: FloatArray
    parted: bool


def depth_step(z: float) -> float:
    """Metres in depth between two pieces of one person at most, who is ``z`` metres away."""
    return DEPTH_STEP + DEPTH_STEP_PER_METRE * z


def find_figures(scene: Scene, expected: FloatArray, chosen: int = 0) -> list[Figure]:
    """The figures of a scene.

    People are ``expected`` at ``(n, 2)`` metres across and deep, the first ``chosen`` of them as
    they were chosen.
    """
    mask = scene.before & scene.standing
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    if not width:
        return []
    # Mostly few pixels stand before the room: only where they are is anything to be cut.
    part = slice(y, y + height), slice(x, x + width)
    pieces = surfaces_in(scene.view.depth[part], mask[part], JUMP, JUMP_PER_METRE)
    found: list[Figure] = []
    refused: list[Figure] = []
    above = np.full(len(pieces), np.inf)
    if scene.elevation is not None:
        above = pieces.means(scene.elevation[part])
    for members in _joined(scene, pieces, pieces.means(scene.forward[part]), above):
        member = np.zeros(len(pieces), np.bool_)
        member[members] = True
        left, top, whole = pieces.crop_of(member)
        left, top, parts = x + left, y + top, [whole]
        if not _has_lain_down(scene, left, top, whole):
            parts = parted(
                scene.view, scene.forward, scene.axes[0], left, top, whole, expected, chosen
            )
        for each in parts:
            seen = Silhouette.trimmed(scene.view, left, top, each, scene.rim)
            if seen is None:
                continue
            made = makes_figure(scene, seen)
            if made or (scene.lately and seen.area > LEAST_AREA):
                figure = Figure(seen, place_of(scene, seen), len(parts) > 1)
                (found if made else refused).append(figure)
    return found + _low(scene, found, refused)


def _joined(
    scene: Scene, pieces: Surfaces, ahead: FloatArray, above_floor: FloatArray
) -> list[npt.NDArray[np.intp]]:
    """Labels of the pieces that make one figure each, the largest first.

    Args:
        scene: of now.
        pieces: of what stands before the room.
        ahead: ``(n,)`` metres along the floor to their middles.
        above_floor: ``(n,)`` metres of these above it, infinite where no floor is known.
    """
    k = scene.view.intrinsics
    areas = pieces.areas(k)
    possible = (pieces.pixels >= LEAST_PIXELS) & (areas > LEAST_PIECE)
    possible[0] = False
    labels = np.flatnonzero(possible)
    labels = labels[np.argsort(-areas[labels], kind='stable')]
    groups: list[list[int]] = []
    extents: list[tuple[float, float, float, float, float, float]] = []
    for label in labels:
        left, top, width, height = (float(v) for v in pieces.boxes[label])
        right, bottom, depth = left + width, top + height, float(ahead[label])
        area = float(areas[label])
        for index, (x0, y0, x1, y1, z, total) in enumerate(extents):
            across, down = z / k.fx, z / k.fy
            shins = y1 <= top and above_floor[label] < SHIN and x0 <= (left + right) / 2 <= x1
            nearer = SEATED - DEPTH_STEP if shins else 0.0
            if not -depth_step(z) - nearer < depth - z < depth_step(z):
                continue
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


def _has_lain_down(scene: Scene, left: int, top: int, mask: Mask) -> bool:
    """Whether a mask is of one who was here, and so low that it is not of two beside each other."""
    rows, cols = mask.shape
    if not scene.lately or scene.elevation is None or rows >= cols:
        return False
    high = np.count_nonzero(mask & (scene.elevation[top : top + rows, left : left + cols] > LOW))
    if high >= (1 - UPPER) * np.count_nonzero(mask):
        return False
    here = Silhouette.trimmed(scene.view, left, top, mask, scene.rim)
    return here is not None and any(here.meets(each) for each in scene.lately)


def _low(scene: Scene, found: list[Figure], refused: list[Figure]) -> list[Figure]:
    """Of those that are no figures the one where each was who is in none, however low it is.

    Nor is he in a figure that is smaller and less where he was, as of who steps over him.
    """
    low: list[Figure] = []
    for before in scene.lately:
        is_in = [(share, each) for each in found if (share := _shared(before, each.seen)) > STAYS]
        most = max((share for share, _ in is_in), default=STAYS)
        least = max((each.seen.area for _, each in is_in), default=0.0)
        his = [
            each
            for each in refused
            if each not in low and each.seen.area > least and _shared(before, each.seen) > most
        ]
        if his:
            low.append(max(his, key=lambda each: each.seen.area))
    return low


def _shared(before: Silhouette, seen: Silhouette) -> float:
    """Share of the smaller of two boxes that both have, 0 to 1.

    That about where somebody was, or about that and as far below as he may have fallen, and a
    silhouette's: who lies already falls no deeper.
    """
    if abs(seen.depth - before.depth) > depth_step(before.depth):
        return 0.0
    rows, cols = before.mask.shape
    now = Box(seen.left, seen.top, seen.mask.shape[1], seen.mask.shape[0])
    was = (
        Box(before.left, before.top, cols, rows + fallen)
        for fallen in (0.0, FALL / before.height * rows)
    )
    return max(each.intersection(now) / min(each.area, now.area) for each in was)


def makes_figure(scene: Scene, seen: Silhouette) -> bool:
    """Whether a silhouette that stands before the room is large and high enough for a figure."""
    if seen.area < LEAST_AREA or seen.height < LEAST_HEIGHT:
        return False
    highest = seen.highest(scene.elevation)
    if seen.area < 2 * LEAST_AREA and not (seen.cut.any or child(seen, highest)):
        return False
    lowest = None if seen.cut.bottom else seen.lowest(scene.elevation)
    if lowest is not None and lowest > FLOATS:
        return False
    return highest is None or highest >= LEAST_TOP


def place_of(scene: Scene, seen: Silhouette) -> FloatArray:
    """Where a silhouette is, ``(2,)`` metres across and along the floor."""
    left, top, right, bottom = seen.metres
    middle = np.array([(left + right) / 2, (top + bottom) / 2, seen.depth])
    ahead = float(seen.pixels(scene.forward).mean())
    return np.array([scene.axes[0] @ middle, ahead])


def came(scene: Scene, seen: Silhouette) -> bool:
    """Whether what stands before the room has come there, as far as a camera that moved can tell.

    Furniture that it saw anew stands where something nearer, or farther, was known to be.
    """
    highest = seen.highest(scene.elevation) if scene.stood_for < AT_REST else None
    return highest is None or highest > GROWN
