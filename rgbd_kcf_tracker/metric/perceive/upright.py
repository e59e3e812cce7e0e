# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a silhouette has the shape of a person: a head on shoulders, upright, of human size.

For a person who has not moved yet nothing else tells them from furniture.
"""

from __future__ import annotations

from statistics import median

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.silhouette import Rim, Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import Surfaces

HEIGHT = (0.6, 2.1)
"""Metres from the head down to what shows: half of a small person to all of a tall one."""
TOP = (0.9, 2.15)
"""Metres of the head's top above the floor."""
WIDTH = (0.25, 1.0)
HEAD = (0.03, 0.2)
SHOULDERS = (0.3, 0.5)
"""Metres below the top between which the head is measured, and the shoulders."""
HEAD_WIDTH = (0.09, 0.34)
SHOULDER_WIDTH = (0.26, 0.8)
BROADER = 1.35
"""Shoulders against head, at the least."""
SLIM = 0.85
"""Width against height, at the most, where nothing is cut off below."""
FILL = 0.45
"""Share of the box that a body fills, at the least: a rack or a plant fills less."""
LENGTH = (1.2, 0.8)
"""Metres of a person whose shape is not told: whole, and cut off above or below."""
BROADER_SIDEWAYS, TALL, NARROW = 1.1, 1.2, 0.45
"""The same of somebody seen from the side, who must show 1.2 m and be no wider than 45 % of it."""


def upright(seen: Silhouette, k: Intrinsics, top: float | None) -> bool:
    """Whether a silhouette may be a person, seen from head to hips at least.

    Args:
        seen: the silhouette.
        k: of the view.
        top: metres of its upper end above the floor, None where no floor is known.
    """
    if seen.cut.top or not HEIGHT[0] <= seen.height <= HEIGHT[1]:
        return False
    if not WIDTH[0] <= seen.width <= WIDTH[1]:
        return False
    if top is not None and not TOP[0] <= top <= TOP[1]:
        return False
    if not seen.cut.bottom and seen.width > SLIM * seen.height:
        return False
    if seen.area < FILL * seen.width * seen.height:
        return False
    pixel = seen.depth / k.fx
    per_row = k.fy / seen.depth
    wide = np.count_nonzero(seen.mask, axis=1) * pixel
    head = wide[int(HEAD[0] * per_row) : max(int(HEAD[1] * per_row), 1)]
    rows = slice(int(SHOULDERS[0] * per_row), max(int(SHOULDERS[1] * per_row), 1))
    shoulders = wide[rows]
    if not len(head) or not len(shoulders):
        return False
    head_width, shoulder_width = float(median(head.tolist())), float(median(shoulders.tolist()))
    if not HEAD_WIDTH[0] <= head_width <= HEAD_WIDTH[1]:
        return False
    if not SHOULDER_WIDTH[0] <= shoulder_width <= SHOULDER_WIDTH[1]:
        return False
    sideways = seen.height >= TALL and seen.width <= NARROW * seen.height
    return shoulder_width >= (BROADER_SIDEWAYS if sideways else BROADER) * head_width


def person_sized(seen: Silhouette) -> bool:
    """Whether a silhouette has the breadth and length of a person, if not the shape.

    That is enough for what has come to stand before a room that is known: somebody too near to the
    camera for his head to show, or who stoops.
    """
    cut_off = seen.cut.any
    return (
        LENGTH[cut_off] <= seen.height <= HEIGHT[1]
        and WIDTH[0] <= seen.width <= WIDTH[1]
        and seen.area >= FILL * seen.width * seen.height
    )


def upright_people(
    view: DepthView,
    surfaces: Surfaces,
    elevation: npt.NDArray[np.float32] | None,
    rim: Rim,
) -> npt.NDArray[np.bool_]:
    """The pixels of all surfaces that have the shape of a person, ``(h, w)`` bool.

    Args:
        view: the depth.
        surfaces: what stands on the floor.
        elevation: ``(h, w)`` metres above the floor, None where none is known.
        rim: of the view.
    """
    k = view.intrinsics
    z = surfaces.depth.astype(np.float64)
    tall = surfaces.boxes[:, 3] * z / k.fy
    wide = surfaces.boxes[:, 2] * z / k.fx
    possible = (tall >= HEIGHT[0]) & (tall <= HEIGHT[1]) & (wide >= WIDTH[0]) & (wide <= WIDTH[1])
    possible[0] = False
    member = np.zeros(len(surfaces), np.bool_)
    for label in np.flatnonzero(possible):
        left, upper, width, height = (int(v) for v in surfaces.boxes[label])
        mask = surfaces.labels[upper : upper + height, left : left + width] == label
        seen = Silhouette.of(view, left, upper, mask, int(label), rim)
        member[label] = upright(seen, k, seen.highest(elevation))
    people: npt.NDArray[np.bool_] = member[surfaces.labels]
    return people
