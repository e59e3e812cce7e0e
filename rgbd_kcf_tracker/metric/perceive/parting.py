# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Several people who touch, taken apart: where they are expected, under each head, or by depth."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Mask
from rgbd_kcf_tracker.metric.perceive.depth_view import NEAREST, DepthView

BREADTH = 0.4
"""Metres between the heads of two people side by side, at the least: shoulders are about as
broad."""
BROAD = BREADTH + 0.25
"""Metres from which a figure may be two people: those, and half a shoulder's width on each side."""
VALLEY = 0.08
"""Metres by which the outline must fall between two heads: a third of the 0.22 m from crown to
chin, as the smoothed outline keeps no more of a narrow gap."""
HEAD_BELOW = 0.5
"""Metres by which one head may be below another in one figure: a child's, or that of somebody who
sits."""
REACH_ACROSS, REACH_DEEP = 0.2, 0.15
"""Half of a person's breadth and depth in metres: the scales in which pixels are nearest to one."""
BEHIND = 0.35
"""Metres along the floor between the middles of two people one behind the other who are told by
that alone: more than anybody leans."""
IN_TWO = 0.85
"""Share of the variance of depth that is between two bodies; 0.75 for what is evenly spread, as an
arm or the side of a table that leads from near to far."""
TALL = 1.0
"""Metres of height of each of the two: no limb and no chair is as tall."""
BINS = 24
"""Steps in which depth is divided to tell the two."""
APART = 0.28
"""Metres between the middles of two people, at the least: a chest is 0.25 m deep."""
APART_KNOWN = 0.2
"""The same of people who were chosen, and so are surely several: who hug show the sides that they
turn away from each other."""
EVERY = 3
"""One in so many pixels is enough to tell where the middles of people are."""
LEAST_SHARE = 0.15
"""Share of a figure's pixels, against an equal part of it for each, below which a part of it is not
somebody: an arm."""
NOBODY = np.zeros((0, 2))
"""Where people are expected while nobody is."""


def parted(
    view: DepthView,
    forward: Floats,
    right: FloatArray,
    left: int,
    top: int,
    mask: Mask,
    expected: FloatArray = NOBODY,
    chosen: int = 0,
) -> list[Mask]:
    """A mask, or the masks of the people that it is made of, with the same corner.

    Args:
        view: the depth.
        forward: ``(h, w)`` metres along the floor.
        right: ``(3,)`` unit vector along it to the right, in the camera's frame.
        left: column of the mask's corner in the view.
        top: its row.
        mask: ``(rows, cols)`` of somebody, or of several who touch.
        expected: ``(n, 2)`` metres across and deep, where people are expected.
        chosen: how many of these, the first of them, were chosen.
    """
    k = view.intrinsics
    rows, cols = mask.shape
    depth = view.depth[top : top + rows, left : left + cols]
    ahead = forward[top : top + rows, left : left + cols]
    z = float(depth[mask].mean())
    narrow = cols * z / k.fx < BROAD
    far = _farther(mask, ahead, z / k.fy)
    columns = np.arange(left, left + cols) - k.cx
    lines = np.arange(top, top + rows) - k.cy
    # Where the camera rolls, who stands upright is tilted in the picture.
    x_of, y_of = right[0] / k.fx, right[1] / k.fy
    seeds, least = expected, APART
    if len(seeds):
        u = seeds[:, 0] / np.maximum(seeds[:, 1], NEAREST) - lines[rows // 2] * y_of
        u = u / x_of + k.cx - left
        margin = 0.1 * k.fx / z
        inside = (u > -margin) & (u < cols + margin)
        if np.count_nonzero(inside) > 1:
            first, last = np.percentile(ahead[mask], (5, 95))
            inside &= (seeds[:, 1] > first - 0.3) & (seeds[:, 1] < last + 0.3)
        seeds = seeds[inside]
        if len(seeds) > 1 and not inside[chosen:].any():
            least = APART_KNOWN
    if len(seeds) < 2 and not narrow:
        seeds = _heads(mask, depth, ahead, columns, lines[0], x_of, y_of, k.fy)
    if len(seeds) < 2 and far is None:
        return [mask]
    v, u_ = np.nonzero(mask)
    reach = np.array([REACH_ACROSS, REACH_DEEP])
    across = (columns[u_] * x_of + lines[v] * y_of) * depth[v, u_]
    if len(seeds) < 2 and far is not None:
        of_far = far[v, u_]
        seeds = np.array(
            [[part[which].mean() for part in (across, ahead[v, u_])] for which in (~of_far, of_far)]
        )
    points = np.stack((across, ahead[v, u_]), axis=1) / reach
    seeds = seeds / reach
    some = points[::EVERY]
    while True:
        seeds, count = _settled(some, seeds)
        if len(seeds) < 2:
            return [mask]
        apart = np.hypot(*((seeds[:, None] - seeds[None]) * reach).transpose(2, 0, 1))
        apart[np.tril_indices(len(seeds))] = np.inf
        nearest = np.unravel_index(int(apart.argmin()), apart.shape)
        if apart[nearest] >= least:
            break
        # Two who cannot be told apart are one, and the others are still somebody else.
        seeds = np.delete(seeds, min(nearest, key=lambda n: count[n]), axis=0)
    owner = _nearest(points, seeds)
    parts = []
    for index in range(len(seeds)):
        part = np.zeros_like(mask)
        part[mask] = owner == index
        parts.append(part)
    return parts


def _farther(mask: Mask, ahead: Floats, metres: float) -> Mask | None:
    """Of two people one behind the other the pixels of the farther, None where it is but one.

    Args:
        mask: ``(rows, cols)``.
        ahead: ``(rows, cols)`` metres along the floor.
        metres: of height to the row.
    """
    if len(mask) * metres < TALL:
        return None
    values, least = ahead[::EVERY][mask[::EVERY]], LEAST_SHARE / 2
    if float(values.var()) < least * (1 - least) * BEHIND**2:  # that of the least part, so far off
        return None
    # The threshold on both sides of which depth varies least (Otsu, 1979). Once in order, their
    # percentiles and histogram take a quarter of the time of NumPy's.
    values.sort()
    total = len(values)
    near, far = np.interp(np.array((0.05, 0.95)) * (total - 1), np.arange(total), values)
    edges = np.linspace(near, far, BINS + 1)
    nearer = np.searchsorted(values, edges[1:-1])
    count = np.diff(np.concatenate(([0], nearer, [total])))
    middle = (edges[1:] + edges[:-1]) / 2
    mean = float(count @ middle) / total
    off = nearer * mean - np.cumsum(count * middle)[:-1]
    apart = off * total / np.maximum(nearer * (total - nearer), 1)
    between = off * apart
    best = int(between.argmax())
    if apart[best] < BEHIND or between[best] < IN_TWO * float(count @ np.square(middle - mean)):
        return None
    behind: Mask = mask & (ahead > edges[best + 1])
    for each in (behind, mask & ~behind):
        rows = np.flatnonzero(each.any(axis=1))
        if not len(rows) or (rows[-1] + 1 - rows[0]) * metres < TALL:
            return None
    return behind


def _settled(points: FloatArray, seeds: FloatArray) -> tuple[FloatArray, npt.NDArray[np.intp]]:
    """The middles of what is nearest to each of the seeds, and how many points that are.

    Seeds with next to nothing are left out.
    """
    count = np.zeros(len(seeds), np.intp)
    for _ in range(3):
        owner = _nearest(points, seeds)
        count = np.bincount(owner, minlength=len(seeds))
        keep = count > LEAST_SHARE * len(points) / len(seeds)
        if not keep.all():
            seeds, count = seeds[keep], count[keep]
            if len(seeds) < 2:
                break
            continue
        sums = [np.bincount(owner, points[:, axis]) for axis in (0, 1)]
        seeds = np.stack(sums, axis=1) / count[:, None]
    return seeds, count


def _nearest(points: FloatArray, seeds: FloatArray) -> npt.NDArray[np.intp]:
    """Index of the seed ``(m, 2)`` that is nearest to each point ``(n, 2)``, ``(n,)``."""
    away = np.square(seeds).sum(axis=1) - 2 * (points @ seeds.T)
    return np.asarray(away.argmin(axis=1))


def _heads(
    mask: Mask,
    depth: Floats,
    ahead: Floats,
    columns: FloatArray,
    above: float,
    x_of: float,
    y_of: float,
    fy: float,
) -> FloatArray:
    """Where the heads in a wide mask are, ``(n, 2)`` metres across and deep."""
    has = np.asarray(mask.any(axis=0))
    first = mask.argmax(axis=0)
    sums = np.where(mask, depth, 0).sum(axis=0)
    z = np.where(has, sums / np.maximum(mask.sum(axis=0), 1), np.nan)
    tall = -(first + above) * z / fy
    across = (columns * x_of + (first + above) * y_of) * z
    wide = max(1, int(0.1 / x_of / float(np.nanmean(z))))
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
