# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a drawn box has chosen: the figure, or the surface or part of one, that it is about."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.by_surface import BySurface
from rgbd_kcf_tracker.metric.decide.account import SMALL, Account
from rgbd_kcf_tracker.metric.decide.proposals import MOST_SHARE, propose
from rgbd_kcf_tracker.metric.decide.visible_box import box_about
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette

LOCK_IOU = 0.5
"""Overlap of the given box with a surface's from which the surface is taken for the target: from
which a box counts as right in the benchmarks, too (PASCAL VOC)."""
SAME_OUTLINE = 0.7
"""Overlap of two outlines from which they are of one thing and not of a part of it. At 0.35 a mug
in a hand became the person, at 0.5 a face the body below it (docs/metric.md)."""
PART_IOU, INSIDE = 0.35, 0.9
"""The same of a figure of which so much lies in the box: limbs or a side of it are missing."""
LEAST_FILL = 0.5
"""Share of the given box that a surface fills of which the box shows only a part: the greater part
of it, or the box is about something else."""
SCATTERED, OWN, THICK = 0.06, 0.7, 0.4
"""Share of the given box that the scattered readings of a target fill, at the least; share of a
piece that lies in the box from which it is the target's; and metres between the target's readings,
arms and a far reading's noise included."""
CENTRED = 0.125
"""Share of the target's scattered readings in the middle quarter of the box, at the least: half of
what lies there of readings all over it. Of real and simulated starts 0.19 to 0.52 do."""
OUTSIDE = 0.1
"""Share of the given box by which a silhouette may stick out of it on each side: boxes are drawn no
better by hand, and outlines in depth lie beside those in colour. What is farther out is somebody
else who touches the target, or what it stands on."""


def surface_of(account: Account, box: Box, parameters: MetricParameters) -> Silhouette | None:
    """The figure or surface that a box of the image is drawn about, None where none fits."""
    scene = account.scene
    whole = whole_of(account, box)
    if whole is not None:
        return _within(scene, whole, box)
    piece = _piece_of(scene, box)
    if piece is not None and _found_again(account, piece, parameters):
        return piece
    return _scattered(scene, box)


def whole_of(account: Account, box: Box) -> Silhouette | None:
    """The figure or surface as large as a box, with what of it lies beside the box as well."""
    figure = _figure_of(account, box)
    if figure is not None:
        return figure
    scene = account.scene
    rows, cols = scene.view.shape
    b = box.over(scene.view.step).clipped(cols, rows)
    if b is None:
        return None
    boxes = scene.surfaces.boxes.astype(np.float64)
    across = np.minimum(boxes[:, 0] + boxes[:, 2], b.right) - np.maximum(boxes[:, 0], b.x)
    down = np.minimum(boxes[:, 1] + boxes[:, 3], b.bottom) - np.maximum(boxes[:, 1], b.y)
    common = np.clip(across, 0, None) * np.clip(down, 0, None)
    iou = common / (boxes[:, 2] * boxes[:, 3] + b.area - common)
    iou[0] = 0
    # A wall behind may fill the box as well: it must be the surface that the box shows.
    iou *= _shown(scene, box) > 0
    label = int(np.argmax(iou))
    return scene.silhouette(label) if iou[label] >= LOCK_IOU else None


def _piece_of(scene: Scene, box: Box) -> Silhouette | None:
    """The part of a surface that a box shows: two who touch are one surface."""
    shown = _shown(scene, box)
    total = shown.sum()
    shown[0] = 0
    label = int(np.argmax(shown))
    large = scene.surfaces.pixels[label] > MOST_SHARE * total
    if large or shown[label] < max(1.0, LEAST_FILL * total):
        return None
    part = _within(scene, scene.silhouette(label), box)
    return part if box_about(scene, part).iou(box) >= LOCK_IOU else None


def _found_again(account: Account, piece: Silhouette, parameters: MetricParameters) -> bool:
    """Whether the very frame in which a piece was chosen offers it, as the next would have to.

    Who touches somebody is told from him, a head not from what it is a part of.
    """
    scene = account.scene
    nobody = Person(0, account.place(piece), account.time)
    followed = BySurface(account, piece, nobody, parameters)
    found = propose(
        scene,
        followed.body,
        followed.expected(0.0),
        account.others(nobody),
        parameters.most_candidates,
    )
    outline = box_about(scene, piece)
    return any(box_about(scene, seen).iou(outline) > SAME_OUTLINE for seen in found)


def _shown(scene: Scene, box: Box) -> npt.NDArray[np.intp]:
    """``(k,)`` how many pixels of each surface a box shows."""
    b, (rows, cols) = box.over(scene.view.step), scene.view.shape
    x0, x1 = np.clip((math.floor(b.x), math.ceil(b.right)), 0, cols)
    y0, y1 = np.clip((math.floor(b.y), math.ceil(b.bottom)), 0, rows)
    labels = scene.surfaces.labels[y0:y1, x0:x1]
    return np.bincount(labels.ravel(), minlength=len(scene.surfaces))


def _figure_of(account: Account, box: Box) -> Silhouette | None:
    """The figure that a box is drawn about, of which limbs may be missing."""
    figures = [sight.figure.seen for sight in account.sights]
    if not figures:
        return None
    outlines = [box_about(account.scene, seen) for seen in figures]
    overlaps = [outline.iou(box) for outline in outlines]
    best = int(np.argmax(overlaps))
    inside = box.intersection(outlines[best]) > INSIDE * outlines[best].area
    return figures[best] if overlaps[best] >= (PART_IOU if inside else LOCK_IOU) else None


def _scattered(scene: Scene, box: Box) -> Silhouette | None:
    """The few readings of somebody far off, or of whom little shows, that a box is drawn about.

    They stand before the room at about one depth, and belong to nothing that goes on beside it.
    """
    step, (rows, cols) = scene.view.step, scene.view.shape
    x0, x1 = max(0, round(box.x / step)), min(cols, round(box.right / step))
    y0, y1 = max(0, round(box.y / step)), min(rows, round(box.bottom / step))
    part = slice(y0, y1), slice(x0, x1)
    mine = scene.standing[part].copy()
    if np.count_nonzero(mine) < SCATTERED * mine.size:
        return None
    labels = scene.surfaces.labels[part]
    inside = np.bincount(labels[mine], minlength=len(scene.surfaces))
    inside[0] = scene.surfaces.pixels[0]  # pieces too small to be surfaces
    mine &= (inside > OWN * scene.surfaces.pixels)[labels]
    depth = scene.view.depth[part]
    if not mine.any():
        return None
    layers, readings = np.unique((depth[mine] / THICK).astype(np.intp), return_counts=True)
    # Behind the target the same gap may show more.
    nearest = int(layers[np.argmax(readings > 0.5 * readings.max())])
    mine &= np.abs(depth - (nearest + 0.5) * THICK) < THICK
    if np.count_nonzero(mine) < SCATTERED * mine.size:
        return None
    # Where the middle of the box shows something nearer, they are of what is behind the target.
    nearer = scene.standing[part] & (depth < (nearest - 0.5) * THICK)
    down, across = mine.shape[0] // 4, mine.shape[1] // 4
    middle = np.s_[down : mine.shape[0] - down, across : mine.shape[1] - across]
    own = np.count_nonzero(mine[middle])
    if np.count_nonzero(nearer[middle]) > own:
        return None
    # So they are where the middle shows nothing: of the target, then, there is no reading at all.
    if own < CENTRED * np.count_nonzero(mine):
        return None
    seen = Silhouette.trimmed(scene.view, x0, y0, mine, scene.rim)
    if seen is None:
        return None
    # What little depth there is of a small thing in a hand may be the hand's.
    if seen.width * seen.height < SMALL or box_about(scene, seen).iou(box) < LOCK_IOU:
        return None
    return seen


def _within(scene: Scene, seen: Silhouette, box: Box) -> Silhouette:
    """The part of a silhouette in the box that was drawn: what sticks out is something else."""
    step, margin = scene.view.step, OUTSIDE
    spare_x, spare_y = margin * box.width, margin * box.height
    x0 = max(seen.left, int((box.x - spare_x) / step))
    x1 = min(seen.cols.stop, int((box.right + spare_x) / step) + 1)
    y0 = max(seen.top, int((box.y - spare_y) / step))
    y1 = min(seen.rows.stop, int((box.bottom + spare_y) / step) + 1)
    if (x0, x1, y0, y1) == (seen.left, seen.cols.stop, seen.top, seen.rows.stop):
        return seen
    part = seen.mask[y0 - seen.top : y1 - seen.top, x0 - seen.left : x1 - seen.left]
    return Silhouette.trimmed(scene.view, x0, y0, part, scene.rim) or seen
