# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What somebody points at: the person, or else the connected surface, at one pixel."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rgbd_kcf_tracker.arrays import Floats, Mask
from rgbd_kcf_tracker.errors import BoxError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.decide.visible_box import outline_box
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.figures import find_figures
from rgbd_kcf_tracker.metric.perceive.floor import FloorFinder
from rgbd_kcf_tracker.metric.perceive.scene import Scene, SceneReader
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import standing, surfaces_in
from rgbd_kcf_tracker.metric.perceive.upright import (
    HEIGHT,
    LENGTH,
    SLIM,
    SOLID,
    SPARSE,
    rounded,
    upright,
)

VIEW_WIDTH = 480
"""Columns in which surfaces are looked for: a mug at two metres is still fifteen wide."""
NEAREST = 0.02
"""How far from the pixel a reading is accepted, as a share of the image's width."""
BAND_M, BAND_SHARE = 0.25, 0.05
"""Half the depth a surface may span round the pixel: an arm's length, and the sensor's noise."""
JUMP_M, JUMP_SHARE = 0.03, 0.02
"""Metres, and share of depth, by which depth jumps between two surfaces. Less than in the view of
all (0.04 and 0.03), whose pixels lie twice as far apart on a slope; what is pointed at may be as
small as a mug that stands near something else."""
FLOOR_MARGIN_M = 0.04
"""Metres above the floor up to which a reading is the floor's: its noise some metres away, and less
than most things are tall."""
LARGEST_SHARE = 0.6
"""Share of the image that the surface's box covers at the most: more is a wall, or so near that the
rest of the image is no room to follow it in."""
LARGEST_M = 2.5
"""Metres of the widest and tallest that is followed: nobody is as tall, and walls are larger."""
REACH = 3
"""Rows up and down over which a surface's slope is measured."""
LEVEL_SHARE = 0.4
"""A surface is level where its height falls by less than this share of an upright one's."""
TABLE_SHARE = 0.7
"""Area of the box without what is level, against that with it, below which what is pointed at
stands on a table: a box alone loses little but its lid, one on a table most."""
LEAST_PIXELS = 30
"""Pixels of the view, at the least: six by five, a mug at five metres. Of less the outline is as
unsure as the thing is large."""


def target_at(frame: Frame, u: float, v: float) -> Box:
    """The box round what is seen at a pixel of the colour image: the person, else the surface.

    Args:
        frame: with depth.
        u: column.
        v: row.

    Raises:
        BoxError: where the pixel is outside the image, has no depth, or belongs to a surface that
            is a speck, fills the image, or is as large as a wall.
    """
    if not (math.isfinite(u) and math.isfinite(v)) or not (
        0 <= u < frame.width and 0 <= v < frame.height
    ):
        raise BoxError(f'point {u:g},{v:g} lies outside the {frame.width}x{frame.height} image')
    view = DepthView.of(frame, VIEW_WIDTH)
    if view is None:
        raise BoxError('a point needs depth to become a box, and there is none: give a box instead')
    return _person_at(frame, u, v) or _surface_at(frame, view, u, v)


def _person_at(frame: Frame, u: float, v: float) -> Box | None:
    """The outline of the person at a pixel, None where nobody is told from the rest.

    An arm before somebody, a leg or what he wears may be a surface of its own.
    """
    p = MetricParameters()
    scene = SceneReader(p.view_width, p.jump, p.jump_per_metre, p.floor_margin).read(frame, 0.0)
    if scene is None:
        return None
    row, column = int(v / scene.view.step), int(u / scene.view.step)
    at = slice(row, row + 1), slice(column, column + 1)
    near = slice(max(row - 1, 0), row + 2), slice(max(column - 1, 0), column + 2)
    # Whoever points beside an outline means it, if the room is all that is there.
    large = scene.large[scene.surfaces.labels[at]]
    where = near if (large | ~scene.standing[at]).all() else at
    # Who is seen from his side has no such shape, and his shoulder cuts him off from his head.
    stands = replace(scene, before=scene.standing & ~scene.large[scene.surfaces.labels])
    for those, is_person in ((scene, _has_shape), (stands, _has_size)):
        for figure in find_figures(those, np.zeros((0, 2))):
            seen = figure.seen
            if seen.in_view(scene.view.shape)[where].any() and is_person(scene, seen):
                return outline_box(scene, seen).clipped(frame.width, frame.height)
    return None


def _has_shape(scene: Scene, seen: Silhouette) -> bool:
    return upright(seen, scene.view.intrinsics, scene.top(seen))


def _has_size(scene: Scene, seen: Silhouette) -> bool:
    """Whether something has a body's size, fills its box as one, and is as round."""
    slim = LENGTH[0] <= seen.height <= HEIGHT[1] and seen.width < SLIM * seen.height
    return slim and SPARSE < seen.fill < SOLID and rounded(scene.view, seen)


def _surface_at(frame: Frame, view: DepthView, u: float, v: float) -> Box:
    """The box round the connected surface at a pixel; raises as :func:`target_at`."""
    # The view's pixels are those in the middle of each step.
    half = view.step // 2
    row, column = _nearest(view.depth > 0, (v - half) / view.step, (u - half) / view.step)
    if row < 0:
        raise BoxError(f'there is no depth reading near point {u:g},{v:g}: point elsewhere')
    depth = float(view.depth[row, column])
    near = np.abs(view.depth - np.float32(depth)) < BAND_M + BAND_SHARE * depth
    near &= view.depth > 0
    floor = FloorFinder().update(view)
    elevation = None if floor is None else floor.elevation(view.depth)
    upright = standing(view, elevation, FLOOR_MARGIN_M)
    if upright[row, column]:
        near &= upright
    found = _connected(view, near, row, column)
    # What stands on a table is joined to it: without what is level, it comes apart.
    steep = ~_level(view, elevation)
    if steep[row, column]:
        alone = _connected(view, near & steep, row, column)
        if alone is not None and (found is None or alone.area < TABLE_SHARE * found.area):
            found = alone
    box = None if found is None else found.clipped(frame.width, frame.height)
    if box is None:
        raise BoxError(f'the surface at point {u:g},{v:g} is only a speck: point at its middle')
    if box.area > LARGEST_SHARE * frame.width * frame.height:
        raise BoxError(
            f'the surface at point {u:g},{v:g} fills the image: point at the target, or give a box'
        )
    k = view.intrinsics
    wide, tall = box.width * depth / (k.fx * view.step), box.height * depth / (k.fy * view.step)
    if max(wide, tall) > LARGEST_M:
        raise BoxError(
            f'the surface at point {u:g},{v:g} is {wide:.1f} m wide and {tall:.1f} m high, a wall '
            'or the like: point at the target, or give a box'
        )
    return box


def _connected(view: DepthView, mask: Mask, row: int, column: int) -> Box | None:
    """Box in the colour image of the part of ``mask`` that is connected to a pixel of the view."""
    surfaces = surfaces_in(view.depth, mask, JUMP_M, JUMP_SHARE)
    row, column = _nearest(surfaces.labels > 0, row, column)
    label = int(surfaces.labels[row, column]) if row >= 0 else 0
    if label == 0 or surfaces.pixels[label] < LEAST_PIXELS:
        return None
    return Box(*(float(side) * view.step for side in surfaces.boxes[label]))


def _level(view: DepthView, elevation: Floats | None) -> Mask:
    """Pixels of surfaces that lie rather than stand: down the image, their height hardly falls."""
    if elevation is None:
        rows = np.arange(view.shape[0], dtype=np.float32)[:, None]
        elevation = view.depth * ((view.intrinsics.cy - rows) / np.float32(view.intrinsics.fy))
    fall = np.zeros(view.shape, np.float32)
    fall[REACH:-REACH] = elevation[: -2 * REACH] - elevation[2 * REACH :]
    upright_fall = view.depth * np.float32(2 * REACH / view.intrinsics.fy)
    level: Mask = fall < LEVEL_SHARE * upright_fall
    return level


def _nearest(mask: Mask, row: float, column: float) -> tuple[int, int]:
    """Row and column of the set pixel nearest to a place, (-1, -1) where none is near."""
    reach = max(math.ceil(NEAREST * mask.shape[1]), 1)
    top, left = max(int(row) - reach, 0), max(int(column) - reach, 0)
    part = mask[top : int(row) + reach + 1, left : int(column) + reach + 1]
    rows, columns = np.nonzero(part)
    if not len(rows):
        return -1, -1
    distance = (rows + top - row) ** 2 + (columns + left - column) ** 2
    best = int(np.argmin(distance))
    return int(rows[best]) + top, int(columns[best]) + left
