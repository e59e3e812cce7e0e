# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a silhouette has the shape of a person: a head on shoulders, upright, of human size.

For a person who has not moved yet nothing else tells them from furniture.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from statistics import median

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Mask
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.parting import BROAD, parted
from rgbd_kcf_tracker.metric.perceive.silhouette import Rim, Silhouette, together
from rgbd_kcf_tracker.metric.perceive.surfaces import Sizes, Surfaces

HEIGHT = (0.6, 2.1)
"""Metres from the head down to what shows: half of a small person to all of a tall one."""
TOP = (1.0, 2.15)
"""Metres of the head's top above the floor: from a child of four, or somebody who sits and stoops,
to a tall one. The backs of chairs reach up to 0.9 m, and their seats look like shoulders."""
WIDTH = (0.25, 1.0)
"""Metres of one person's width: a chest seen from its side, with an arm before it, to arms half
spread."""
SLIMMEST = 0.15
"""The same, at the least, of what has a head or a neck: a slim chest seen from its side."""
GROUP = 2.5
"""Metres of people who touch, at the most."""
HEAD = (0.03, 0.2)
NECK = (0.18, 0.34)
SHOULDERS = (0.3, 0.5)
TRUNK = (0.3, 0.8)
"""Metres below the top between which the head is measured, and the rest. A head is some 0.22 m
from crown to chin, and shoulders begin some 0.3 m below the crown; the topmost 3 cm are hair and
noise. Neck and shoulders overlap, for people differ and stoop."""
HEAD_WIDTH = (0.09, 0.34)
SHOULDER_WIDTH, TRUNK_WIDTH = 0.26, 0.13
"""Metres from one side to the other, of a head at the least and at the most, and of the others at
the least. A head is 0.15 m wide and 0.2 m deep: less where hair gives no reading, more with a hood
and the blur of depth at an outline. Shoulders are 0.35 to 0.5 m wide, less half turned; a trunk is
0.2 m deep from the side."""
BROADER = 1.35
"""Shoulders against head, at the least: seen from the front they are twice as broad, half turned
less."""
SLENDER, STOUTER = 0.75, 0.8
"""Neck against head, at the most, and trunk against head, at the least."""
SLIM = 0.85
"""Width against height, at the most, where nothing is cut off below: arms half spread; what is as
broad as high is furniture."""
FILL = 0.45
"""Share of the box that a body fills, at the least: a rack or a plant fills less."""
GROWN = 1.3
"""Metres above the floor of the top of whoever is told from furniture that was there before:
chairs, and desks with what stands on them, end below."""
NEAR = 0.4
"""Metres of a head and shoulders, all that a camera may show of who passes close to it: less is a
strip of anything."""
HEADED = 1.45
"""Metres above the floor of a figure's upper end from which its head shows, even where the image
or something nearer begins there."""
OFF_PLANE, OFF_PLANE_PER_SQUARE_METRE = 0.01, 0.001
"""Metres by which a body's surface lies off a plane, in the median of its pixels: twice what a
pushed box shows, and beyond the noise of a structured-light camera, of which two thirds of a
deviation, 0.001 times the square of depth, is the same of a wall (Khoshelham and Elberink 2012)."""
FITS, PIXELS, OUTLIER = 3, 600, 4.0
"""Rounds of fitting the plane, pixels for it, and medians beyond which one is not fitted to."""
SPARSE, SOLID = 0.3, 0.7
"""Shares of the box that a flat thing fills, at the most and at the least: a wall of which readings
come and go a quarter, a door's leaf nine tenths, in the median, and real people 0.55."""
HEAD_CAME = 0.5
"""Share of a head that stands before the room from which it has come there: most of it."""
CHILD, FEET = 0.8, 0.25
"""Metres that show of a child of four, who is 1.05 m tall, at the least, and above the floor where
that begins at the most: feet are as near to the floor as its height is uncertain."""
LENGTH = (1.2, 0.8)
"""Metres of a person whose shape is not told: whole, a child of seven, and cut off above or below,
as much as from head to hips."""


def upright(seen: Silhouette, k: Intrinsics, top: float | None) -> bool:
    """Whether a silhouette may be a person, seen from head to hips at least.

    Args:
        seen: the silhouette.
        k: of the view.
        top: metres of its upper end above the floor, None where no floor is known.
    """
    if seen.cut.top or not HEIGHT[0] <= seen.height <= HEIGHT[1]:
        return False
    if not SLIMMEST <= seen.width <= WIDTH[1]:
        return False
    if top is not None and not TOP[0] <= top <= TOP[1]:
        return False
    wide = np.count_nonzero(seen.mask, axis=1) * (seen.depth / k.fx)
    per_row = k.fy / seen.depth
    return _shouldered(seen, wide, per_row) or _necked(seen, wide, per_row)


def _shouldered(seen: Silhouette, wide: FloatArray, per_row: float) -> bool:
    """Whether it has shoulders that are broader than its head: somebody seen from the front."""
    if not seen.cut.bottom and seen.width > SLIM * seen.height:
        return False
    if seen.fill < FILL:
        return False
    head, shoulders = _rows(wide, HEAD, per_row), _rows(wide, SHOULDERS, per_row)
    head_width, shoulder_width = float(median(head.tolist())), float(median(shoulders.tolist()))
    if not HEAD_WIDTH[0] <= head_width <= HEAD_WIDTH[1]:
        return False
    return shoulder_width >= max(SHOULDER_WIDTH, BROADER * head_width)


def _necked(seen: Silhouette, wide: FloatArray, per_row: float) -> bool:
    """Whether it is tall and has a neck: somebody seen from any side, whatever the arms do."""
    if seen.height < LENGTH[0]:
        return False
    head, neck, trunk = (_rows(wide, rows, per_row) for rows in (HEAD, NECK, TRUNK))
    head_width, trunk_width = float(head.max()), float(median(trunk.tolist()))
    if not HEAD_WIDTH[0] <= head_width <= HEAD_WIDTH[1]:
        return False
    # A cap's brim or a nose makes no head broader than the trunk.
    if trunk_width < max(TRUNK_WIDTH, STOUTER * float(median(head.tolist()))):
        return False
    return float(neck.min()) <= SLENDER * head_width


def _rows(wide: FloatArray, below: tuple[float, float], per_row: float) -> FloatArray:
    """Widths of the rows that lie so many metres below the top, of one at least."""
    first = int(below[0] * per_row)
    return wide[first : max(int(below[1] * per_row), first + 1)]


def person_sized(seen: Silhouette, top: float | None) -> bool:
    """Whether a silhouette has the breadth and length of a person, if not the shape.

    That is enough for what has come to stand before a room that is known: somebody too near to the
    camera for his head to show, or for more than that, or who stoops. ``top`` is as of
    :func:`upright`.
    """
    if not WIDTH[0] <= seen.width <= WIDTH[1]:
        return False
    cut = seen.cut
    goes_on_below = cut.bottom and not (cut.top or cut.left or cut.right)
    headed = top is not None and HEADED < top <= TOP[1]
    if goes_on_below and headed and seen.height > NEAR:
        return True
    return LENGTH[cut.any] <= seen.height <= HEIGHT[1] and seen.fill >= FILL


def rounded(view: DepthView, seen: Silhouette) -> bool:
    """Whether a silhouette's surface is no plane, as a body's is not and a picture's is."""
    rows, cols = np.nonzero(seen.mask)
    some = slice(None, None, max(1, len(rows) // PIXELS))
    rows, cols = rows[some], cols[some]
    z = view.depth[seen.rows, seen.cols][rows, cols].astype(np.float64)
    pixels = np.stack((cols, rows, np.ones(len(z))), axis=1)
    fitted = np.ones(len(z), np.bool_)
    off = z
    for _ in range(FITS):
        # Along a plane the inverse of depth is affine in the pixel; weighted, to fit in metres.
        plane, *_ = np.linalg.lstsq(
            pixels[fitted] * z[fitted, None], np.ones(fitted.sum()), rcond=None
        )
        off = np.abs(1 - z * (pixels @ plane)) * z
        fitted = off <= OUTLIER * np.median(off)
    return bool(np.median(off) > OFF_PLANE + OFF_PLANE_PER_SQUARE_METRE * seen.depth**2)


def child(seen: Silhouette, top: float | None) -> bool:
    """Whether a silhouette is all of somebody small, if of anybody: nothing hides more of it.

    ``top`` is as of :func:`upright`.
    """
    if seen.cut.any or top is None or not seen.height > CHILD or top >= GROWN:
        return False
    return top - seen.height < FEET and seen.fill > SPARSE


def flat(view: DepthView, elevation: Floats | None, seen: Silhouette, walks: bool) -> bool | None:
    """Whether a silhouette is a door's leaf, or some readings of a wall, and has no person's shape.

    None where too little shows to tell: a part of who walks may be as flat, but fills his box as
    they do not.

    Args:
        view: the depth.
        elevation: ``(h, w)`` metres above the floor, None where none is known.
        seen: the silhouette.
        walks: whether it has walked some way.
    """
    if seen.height < LENGTH[1]:
        return None
    if rounded(view, seen) or upright(seen, view.intrinsics, seen.highest(elevation)):
        return False
    return None if walks and seen.cut.any and SPARSE < seen.fill < SOLID else True


@dataclass(frozen=True, slots=True, eq=False)
class UprightPeople:
    """What has a person's shape: pixels of a view.

    Attributes:
        mask: ``(h, w)`` bool, of all.
        tall: ``(h, w)`` bool, of those alone whose surface is no wider than one of them, as long as
            a child of seven and higher than furniture: of what stands in a room, little else is.
    """

    mask: Mask
    tall: Mask


@dataclass(frozen=True, slots=True, eq=False)
class Shapes:
    """What stands on the floor of a view, of which some may have a person's shape.

    Attributes:
        view: the depth.
        surfaces: what stands on the floor.
        sizes: of these.
        elevation: ``(h, w)`` metres above the floor, None where none is known.
        forward: ``(h, w)`` metres along the floor.
        right: ``(3,)`` unit vector along it to the right, in the camera's frame.
        rim: of the view.
    """

    view: DepthView
    surfaces: Surfaces
    sizes: Sizes
    elevation: Floats | None
    forward: Floats
    right: FloatArray
    rim: Rim
    _silhouettes: dict[int, Silhouette] = field(default_factory=dict)

    def upright(self, whole: bool = False) -> UprightPeople:
        """All surfaces and parts of them that have a person's shape.

        Args:
            whole: whether only those count of which both sides show: of a wall or a cupboard any
                strip may be seen.
        """
        view, k = self.view, self.view.intrinsics
        tall, wide = self.sizes.height, self.sizes.width
        possible = (tall >= HEIGHT[0]) & (tall <= HEIGHT[1]) & (wide >= SLIMMEST)
        possible[0] = False
        one = wide <= WIDTH[1]
        # Two chairs beside each other have two heads as well.
        several = (tall >= LENGTH[0]) & (wide > BROAD) & (wide <= GROUP)
        people, tall_ones = list[Silhouette](), list[Silhouette]()
        for label in np.flatnonzero(possible & (one | several)).tolist():
            found = []
            if one[label]:
                single = self.silhouette(label)
                found = [single] if upright(single, k, single.highest(self.elevation)) else []
            if not found and several[label]:
                crop = self.surfaces.crop(label)
                parts = parted(view, self.forward, self.right, *crop)
                parts = parts if len(parts) > 1 else []
                cut = [Silhouette.trimmed(view, *crop[:2], part, self.rim) for part in parts]
                found = [
                    part
                    for part in cut
                    if part is not None
                    if part.height >= LENGTH[0] and upright(part, k, part.highest(self.elevation))
                ]
            for seen in found:
                if whole and (seen.ends.left or seen.ends.right):
                    continue
                people.append(seen)
                if one[label] and seen.height >= LENGTH[0]:
                    top = seen.highest(self.elevation)
                    if top is None or top > GROWN:
                        tall_ones.append(seen)
        return UprightPeople(together(people, view.shape), together(tall_ones, view.shape))

    def stirring(self, moved: Mask, before: Mask) -> Mask:
        """Who stood still from the first view on, as the room does, until he turned.

        His head is where it was: what has a person's shape only together with somebody who has come
        is a thing beside that one.

        Args:
            moved: ``(n,)`` bool, the surfaces of which some has.
            before: ``(h, w)`` bool, pixels that show something before the room.

        Returns:
            His pixels, ``(h, w)`` bool.
        """
        tall, wide, people = self.sizes.height, self.sizes.width, list[Silhouette]()
        possible = moved & (tall >= HEIGHT[0]) & (tall <= HEIGHT[1])
        for label in np.flatnonzero(possible & (wide >= SLIMMEST) & (wide <= WIDTH[1])).tolist():
            seen = self.silhouette(label)
            # Of what goes on at a side any strip may be seen.
            if seen.ends.left or seen.ends.right or seen.cut.left or seen.cut.right:
                continue
            head = seen.mask[: max(int(HEAD[1] * self.view.intrinsics.fy / seen.depth), 1)]
            if before[seen.rows, seen.cols][: len(head)][head].mean() > HEAD_CAME:
                continue
            if upright(seen, self.view.intrinsics, seen.highest(self.elevation)):
                people.append(seen)
        return together(people, self.view.shape)

    def silhouette(self, label: int) -> Silhouette:
        """One surface as a silhouette; the same for whoever asks."""
        seen = self._silhouettes.get(label)
        if seen is None:
            left, upper, mask = self.surfaces.crop(label)
            seen = Silhouette.of(self.view, left, upper, mask, label, self.rim)
            self._silhouettes[label] = seen
        return seen
