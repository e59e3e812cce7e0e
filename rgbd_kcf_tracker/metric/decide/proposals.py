# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Which parts of a scene might be the target.

Surfaces mostly are whole things, but not always: a person who leans on a wall is one surface with
it, and one behind a pole is two. So surfaces are proposed as they are, cut to where the target is
expected, narrowed to its width, and gathered with the pieces around them; what is right is decided
by the evidence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.decide.parts import Others
from rgbd_kcf_tracker.metric.identity.body import Body, Placed
from rgbd_kcf_tracker.metric.perceive.depth_view import NEAREST, part_in
from rgbd_kcf_tracker.metric.perceive.figures import LEAST_PIXELS
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import surfaces_in

LEAST_SHARE = 0.06
"""Area of a proposed surface against the target's, at the least: about a head against all of a
person, which is what shows of somebody behind a cupboard."""
MOST_SHARE = 3.0
"""Area of a proposed surface against the target's, at the most: two who touch are twice as large,
and a size that is known from one side may be half as large again."""
TOO_LARGE = 1.7
"""Area against the target's from which a surface is taken for the target and something else: arms
and a bag add less than half, somebody else beside it as much again."""
MIXED = 0.2
"""Share of its pixels that are others' from which likewise: more than lie along an outline, where
two mix."""


@dataclass(frozen=True, slots=True)
class Expectation:
    """Where the target is expected, ``(3,)`` metres each.

    Attributes:
        position: of the body's reference point.
        sigma: its standard deviations.
        reach: distances within which surfaces are considered at all.
    """

    position: FloatArray
    sigma: FloatArray
    reach: FloatArray


def propose(
    scene: Scene, body: Body, expected: Expectation, others: Others, most: int
) -> list[Silhouette]:
    """Surfaces within reach, as they are and cut to the target.

    Args:
        scene: of now.
        body: the target.
        expected: where it is expected.
        others: pixels known not to be it.
        most: largest number of whole surfaces to propose, the nearest to ``expected`` first.
    """
    sizes = scene.sizes
    z = scene.surfaces.depth
    across = np.abs(sizes.x - expected.position[0]) / (expected.reach[0] + body.width)
    down = np.abs(sizes.y - expected.position[1] - body.height / 2)
    down /= expected.reach[1] + body.height / 2
    ahead = np.abs(z - expected.position[2]) / (expected.reach[2] + 0.15)
    away = np.maximum(np.maximum(across, down), ahead)
    possible = (scene.surfaces.pixels >= LEAST_PIXELS) & (away < 1)
    possible &= (sizes.area > LEAST_SHARE * body.area) & (sizes.area < MOST_SHARE * body.area)
    possible[0] = False
    labels = np.flatnonzero(possible)
    if len(labels) > most:
        labels = labels[np.argsort(away[labels])[:most]]
    found = [scene.silhouette(int(label)) for label in labels]
    found += _split(scene, body, expected, others)
    narrow = (_narrowed(scene, body, seen, expected, others) for seen in found)
    return found + [seen for seen in narrow if seen is not None]


def _split(scene: Scene, body: Body, expected: Expectation, others: Others) -> list[Silhouette]:
    """Cut the expected target out of surfaces that are more than the target."""
    view = scene.view
    k = view.intrinsics
    x, y, z = expected.position.tolist()
    if z < NEAREST:
        return []
    area = scene.sizes.area
    large = area > TOO_LARGE * body.area
    mixed = (area > body.area) & ~large
    mixed[0] = False
    for label in np.flatnonzero(mixed).tolist():
        large[label] = others.share(scene.silhouette(label)) > MIXED
    large[0] = False
    if not large.any():
        return []
    beside = min(2 * expected.sigma[0] + 0.15, 0.5) + 0.65 * body.width
    above = min(2 * expected.sigma[1] + 0.15, 0.5)
    reach = Box.from_corners(
        *view.place(x - beside, y - above, z), *view.place(x + beside, y + body.height + above, z)
    )
    part = part_in(view.shape, reach)
    depth = view.depth[part]
    if min(depth.shape) < 3:
        return []
    mask = large[scene.surfaces.labels[part]]
    mask &= np.abs(depth - np.float32(z)) < 0.25 + 2 * min(expected.sigma[2], 0.3)
    mask &= ~others.within(*part)
    if np.count_nonzero(mask) < LEAST_PIXELS:
        return []
    pieces = surfaces_in(
        depth, mask, 0.5 * scene.surfaces.jump, 0.5 * scene.surfaces.jump_per_metre
    )
    found = []
    enough = (pieces.pixels >= LEAST_PIXELS) & (pieces.areas(k) >= 0.1 * body.area)
    enough[0] = False
    for label in np.flatnonzero(enough).tolist():
        u, v, piece = pieces.crop(label)
        left, top = part[1].start + u, part[0].start + v
        found.append(Silhouette.of(view, left, top, piece, 0, scene.rim))
    return found


def _narrowed(
    scene: Scene, body: Body, seen: Silhouette, expected: Expectation, others: Others
) -> Silhouette | None:
    """The part of a too wide silhouette that most likely is the target, by colour and place."""
    k = scene.view.intrinsics
    wanted = body.width * 1.1
    if not body.width_known or seen.width < 1.3 * wanted:
        return None
    if seen.area < TOO_LARGE * body.area and others.share(seen) < MIXED:
        return None
    cols = max(2, round(wanted * k.fx / seen.depth))
    codes = scene.codes[seen.rows, seen.cols]
    odds = body.odds_of(codes, seen, scene.view, float(expected.position[1]))
    odds[~seen.mask] = 0
    odds -= np.float32(0.5) * others.within(seen.rows, seen.cols)
    profile = np.convolve(odds.sum(axis=0), np.ones(cols), 'valid')
    middle = seen.left + np.arange(len(profile)) + cols / 2
    x = (middle - 0.5 - k.cx) * seen.depth / k.fx
    pixels = max(20.0, np.count_nonzero(seen.mask) / seen.mask.shape[1] * cols)
    spread = expected.sigma[0] ** 2 + 0.1**2
    score = 6 * profile / pixels - 0.5 * np.square(x - expected.position[0]) / spread
    first = int(np.argmax(score))
    part = seen.mask[:, first : first + cols]
    return Silhouette.trimmed(scene.view, seen.left + first, seen.top, part, scene.rim)


def gathered(
    scene: Scene, body: Body, seen: Silhouette, placed: Placed, others: Others
) -> Silhouette | None:
    """A silhouette with the pieces that lie within the body that it belongs to.

    Returns:
        None where there is nothing to add.
    """
    view, surfaces = scene.view, scene.surfaces
    rows, cols = seen.mask.shape
    half = 0.6 * max(body.width, seen.width)
    x, y, _ = placed.position.tolist()
    height = max(body.height, seen.height)
    left, top = view.place(x - half, y - 0.15 * height, seen.depth)
    right, bottom = view.place(x + half, y + 1.05 * height, seen.depth)
    left, right = min(left, seen.left), max(right, seen.left + cols)
    if seen.label == 0:
        # A part cut out of something larger is not to be joined with the rest of that again.
        left, right = max(left, seen.left - 1), min(right, seen.left + cols + 1)
    boxes = surfaces.boxes
    inside = (boxes[:, 0] >= left) & (boxes[:, 0] + boxes[:, 2] <= right)
    inside &= (boxes[:, 1] >= top) & (boxes[:, 1] + boxes[:, 3] <= bottom)
    inside &= np.abs(surfaces.depth - seen.depth) < 0.2 + 0.02 * seen.depth
    inside &= surfaces.pixels >= 3
    inside[0] = False
    inside[seen.label] = False
    for label in np.flatnonzero(inside).tolist():
        inside[label] = others.share(scene.silhouette(label)) < 0.5
    more = boxes[inside]
    if not len(more):
        return None
    x0, y0 = min(seen.left, int(more[:, 0].min())), min(seen.top, int(more[:, 1].min()))
    x1 = max(seen.left + cols, int((more[:, 0] + more[:, 2]).max()))
    y1 = max(seen.top + rows, int((more[:, 1] + more[:, 3]).max()))
    mask = inside[surfaces.labels[y0:y1, x0:x1]]
    mask[seen.top - y0 : seen.top - y0 + rows, seen.left - x0 : seen.left - x0 + cols] |= seen.mask
    return Silhouette.of(view, x0, y0, mask, seen.label, scene.rim)
