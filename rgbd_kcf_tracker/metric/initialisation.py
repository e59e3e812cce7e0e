# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a drawn box has chosen: the figure, or the surface or part of one, that it is about."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.by_surface import BySurface
from rgbd_kcf_tracker.metric.decide.account import SMALL, Account
from rgbd_kcf_tracker.metric.decide.crowd import beside
from rgbd_kcf_tracker.metric.decide.proposals import MOST_SHARE, propose
from rgbd_kcf_tracker.metric.decide.visible_box import box_about
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.figures import DEPTH_STEP, UPRIGHT, depth_step
from rgbd_kcf_tracker.metric.perceive.parting import BEHIND, BROAD
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.upright import HEIGHT, LENGTH, TOP, person_sized, upright

LOCK_IOU = 0.5
"""Overlap of the given box with a surface's from which the surface is taken for the target: from
which a box counts as right in the benchmarks, too (PASCAL VOC)."""
SAME_OUTLINE = 0.7
"""Overlap of two outlines from which they are of one thing and not of a part of it. At 0.35 a mug
in a hand became the person, at 0.5 a face the body below it (docs/experiments.md)."""
PART_IOU, INSIDE = 0.35, 0.9
"""The same of a figure of which so much lies in the box: limbs or a side of it are missing."""
LEAST_FILL = 0.5
"""Share of what is read in the given box that is a surface's of which the box shows only a part:
most of it, or the box is about something else."""
SCATTERED, THICK = 0.06, 0.4
"""Share of the given box that the scattered readings of a target fill, at the least; and metres
between the target's readings, arms and a far reading's noise included."""
OWN, MOST_DEPTHS = 0.7, 4
"""Share of a piece that lies in the box from which it may be the target's, as outlines in depth and
in colour differ; and at how many pieces' depths it is looked for, the largest first: who is half
hidden is cut into two or three."""
NOISE = 3
"""Pixels of a piece from which it counts: of fewer, single readings, any noise makes some."""
LEAST_BESIDE = 0.25
"""How much of who is half hidden a box shows at the least, against the largest that it shows of
anything no larger than a person: of less there is more between somebody's arms and legs."""
SOMEBODY_FARTHER = 0.1
"""Share of the given box that shows somebody farther than what fills most of it, or of its middle,
from which that may hide whom the box is about: less is seen between somebody's arms and legs."""
LEAST_TOLD = 0.5
"""Share of the given box's columns that depth reaches from which these tell what it is about: most
of it. In a third of one about somebody who came in, a strip of who stood behind him showed."""
MOSTLY = 0.5
"""Share of the box's middle without a reading from which it is that of a target without any, and of
one that shows somebody from which he is meant."""
CENTRED = 0.125
"""Share of the target's scattered readings in the middle quarter of the box, at the least: half of
what lies there of readings all over it. Of real and simulated starts 0.19 to 0.52 do."""
ABOVE, LIKEWISE = 0.1, 0.7
"""Share of the height of a box in which it is seen whether what the box shows goes on above: less
than a head; and how densely, against what is in the box, something as far is read there then."""
MEANT_IOU = 0.15
"""Overlap with a person of a box by which he is meant though it fits nothing: a trunk has 0.18 and
more, and boxes that are off by a fifth of their size mostly 0.25. Of 400 starts on people as they
are drawn in recordings none that finds nothing overlaps anybody by so much."""
SIZE_IOU = 0.2
"""The same of what has a person's size only, cut off by the image's end: a box half as broad and
high has 0.25. A cupboard and the table that it stands on, at the image's end, had 0.17."""
HEAD = 0.075
"""Square metres of a box about somebody's head, with hair and whatever little it is too large, at
the most: faces have up to 0.045. Of so little a face may be meant, or what is held in a hand."""
LEAST_MEANT, MOST_ELSE, AS_WELL = 0.1, 0.5, 0.5
"""Share of the middle of such a box that he fills at least, where it shows nobody else who may be
meant; how much of such others it may show, against that; and how well it must fit another's outline
for that, against his: who fits less than half as well is not meant."""
OUTSIDE = 0.1
"""Share of the given box by which a silhouette may stick out of it on each side: boxes are drawn no
better by hand, and outlines in depth lie beside those in colour. What is farther out is somebody
else who touches the target, or what it stands on."""


def surface_of(account: Account, box: Box, parameters: MetricParameters) -> Silhouette | None:
    """The figure or surface that a box of the image is drawn about, None where none fits."""
    scene = account.scene
    told = _told(scene, box)
    whole = whole_of(account, box)
    behind = _pieces_in(scene, told, 0.0 if whole is None else _fit(box_about(scene, whole), told))
    if whole is not None:
        return behind or _within(scene, whole, box)
    # Seen from their sides people have no person's shape, and shoulders hide their necks.
    half = _pieces_in(scene, Box(told.x, told.y, told.width, 2 * told.height), 0.0)
    if half is not None and LENGTH[0] <= half.height <= HEIGHT[1]:
        return half
    piece = _piece_of(scene, told)
    if piece is not None and _found_again(account, piece, parameters):
        return piece
    behind = behind or _scattered(scene, told)
    apart = piece is not None and (_one_of_two(scene, piece, told) or _apart_in_depth(scene, piece))
    return behind or (piece if apart else _meant(account, box))


def whole_of(account: Account, box: Box) -> Silhouette | None:
    """The figure or surface as large as a box, with what of it lies beside the box as well."""
    scene = account.scene
    box = _told(scene, box)
    figure = _figure_of(account, box)
    if figure is not None:
        return figure
    iou = _overlaps_of(scene, box)
    # A wall behind may fill the box as well: it must be the surface that the box shows.
    iou *= _shown(scene, box) > 0
    label = int(np.argmax(iou))
    return scene.silhouette(label) if iou[label] >= LOCK_IOU else None


def _overlaps_of(scene: Scene, box: Box) -> FloatArray:
    """``(k,)`` overlap of a box with that of each surface, 0 of what is none."""
    rows, cols = scene.view.shape
    b = box.over(scene.view.step).clipped(cols, rows)
    boxes = scene.surfaces.boxes.astype(np.float64)
    if b is None:
        return np.zeros(len(boxes))
    across = np.minimum(boxes[:, 0] + boxes[:, 2], b.right) - np.maximum(boxes[:, 0], b.x)
    down = np.minimum(boxes[:, 1] + boxes[:, 3], b.bottom) - np.maximum(boxes[:, 1], b.y)
    common = np.clip(across, 0, None) * np.clip(down, 0, None)
    iou: FloatArray = common / (boxes[:, 2] * boxes[:, 3] + b.area - common)
    iou[0] = 0
    return iou


def _told(scene: Scene, box: Box) -> Box:
    """A box without the columns that depth does not reach; as it is where hardly any others are."""
    step = scene.view.step
    left = max(box.x, scene.rim.left * step)
    right = min(box.right, (scene.view.shape[1] - scene.rim.right) * step)
    if right - left < LEAST_TOLD * box.width:
        return box
    return Box.from_corners(left, box.y, right, box.bottom)


def _fit(outline: Box, box: Box) -> float:
    """How well an outline is what a box is drawn about, 0 to 1.

    What sticks out of the box counts twice: parts of a target may be hidden or have no reading, but
    nobody draws a box through the middle of it.
    """
    common = outline.intersection(box)
    return (common / outline.area) ** 2 * (common / box.area)


def _pieces_in(scene: Scene, box: Box, least: float) -> Silhouette | None:
    """The pieces of one depth that lie in a box and fit it best: somebody who is half hidden.

    Args:
        scene: of now.
        box: the box.
        least: how well they must fit it, see :func:`_fit`.
    """
    surfaces = scene.surfaces
    shown = _shown(scene, box)
    whole = (shown > OWN * surfaces.pixels) & (shown >= NOISE)
    whole[0] = False
    enough = max(SCATTERED * shown.sum(), LEAST_BESIDE * _largest_shown(scene, shown))
    best = None
    labels = np.flatnonzero(whole)
    for label in labels[np.argsort(-shown[labels])[:MOST_DEPTHS]].tolist():
        z = float(surfaces.depth[label])
        pieces = whole & (np.abs(surfaces.depth - z) < depth_step(z))
        if shown[pieces].sum() < enough:
            continue
        seen = Silhouette.trimmed(scene.view, *surfaces.crop_of(pieces), scene.rim)
        if seen is None or seen.width * seen.height < SMALL:
            continue
        outline = box_about(scene, seen)
        fit = _fit(outline, box)
        if fit > least and fits(outline, box) and not _of_background(scene, seen, box):
            best, least = _within(scene, seen, box), fit
    return best


def _of_background(scene: Scene, seen: Silhouette, box: Box) -> bool:
    """Whether the middle of a box shows that a silhouette is of what is behind the target.

    Mostly it has no reading there then, and next to nothing of the silhouette, or shows more of
    something large before it: the target may be a part of that, as who touches a wall. Or it shows
    through a door and goes on above the box.
    """
    if _through_an_opening(scene, seen, box):
        return True
    middle = scene.view.part(box.scaled(0.5))
    depth = scene.view.depth[middle]
    own = np.count_nonzero(seen.in_view(scene.view.shape)[middle])
    if np.count_nonzero(depth == 0) > MOSTLY * depth.size:
        return bool(own < CENTRED * np.count_nonzero(seen.mask))
    nearer = scene.standing[middle] & (depth < seen.depth - DEPTH_STEP)
    nearer &= scene.large[scene.surfaces.labels[middle]]
    return bool(np.count_nonzero(nearer) > own)


def _through_an_opening(scene: Scene, seen: Silhouette, box: Box) -> bool:
    """Whether a silhouette between two nearer things goes on above a box, and shows as densely."""
    if not (seen.cut.left and seen.cut.right):
        return False
    b = box.over(scene.view.step)
    top = max(math.ceil(b.y), 0)
    band = np.s_[max(top - math.ceil(ABOVE * b.height), 0) : top, seen.cols]
    z = seen.depth
    as_far = np.abs(scene.view.depth[band] - z) < depth_step(z)
    return bool(np.count_nonzero(as_far) > LIKEWISE * seen.mask.mean() * as_far.size)


def _piece_of(scene: Scene, box: Box) -> Silhouette | None:
    """The part of a surface that a box shows: two who touch are one surface."""
    shown = _shown(scene, box)
    total = shown.sum()
    shown[0] = 0
    label = int(np.argmax(shown))
    large = scene.surfaces.pixels[label] > MOST_SHARE * total
    read = np.count_nonzero(scene.view.depth[scene.view.part(box)])
    if large or shown[label] < max(1.0, LEAST_FILL * read):
        return None
    part = _within(scene, scene.silhouette(label), box)
    return part if box_about(scene, part).iou(box) >= LOCK_IOU else None


def _one_of_two(scene: Scene, piece: Silhouette, box: Box) -> bool:
    """Whether what stands beside a piece, as one surface with it, is somebody or something else.

    From the next frame on the two are parted where they stand. Where the box shows somebody farther
    as well, that one may be meant, half hidden by one of them.
    """
    own = piece.in_view(scene.view.shape)
    whole = scene.silhouette(int(scene.surfaces.labels[own][0]))
    if whole.width < BROAD or piece.height < UPRIGHT or not beside(scene, whole, piece):
        return False
    part = scene.view.part(box)
    labels = scene.surfaces.labels[part]
    farther = scene.view.depth[part] > piece.depth + DEPTH_STEP
    farther &= (labels > 0) & ~scene.large[labels] & ~own[part]
    return bool(np.count_nonzero(farther) < SOMEBODY_FARTHER * farther.size)


def _apart_in_depth(scene: Scene, piece: Silhouette) -> bool:
    """Whether the rest of its surface is too far from a piece that is larger than a head.

    So is a chair from somebody behind it who touches it.
    """
    if piece.width * piece.height < HEAD:
        return False
    own = piece.in_view(scene.view.shape)
    rest = (scene.surfaces.labels == scene.surfaces.labels[own][0]) & ~own
    ahead = scene.forward
    return rest.any() and abs(float(ahead[rest].mean()) - float(ahead[own].mean())) > BEHIND


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
    labels = scene.surfaces.labels[scene.view.part(box)]
    return np.bincount(labels.ravel(), minlength=len(scene.surfaces))


def _largest_shown(scene: Scene, shown: npt.NDArray[np.intp]) -> int:
    """How many pixels a box shows of what it shows most of, and what is no larger than a person."""
    small = ~scene.large
    small[0] = False
    return int(shown[small].max(initial=0))


def _figure_of(account: Account, box: Box) -> Silhouette | None:
    """The figure that a box is drawn about, of which limbs may be missing."""
    figures = [sight.seen for sight in account.sights]
    if not figures:
        return None
    outlines = [box_about(account.scene, seen) for seen in figures]
    best = int(np.argmax([outline.iou(box) for outline in outlines]))
    return figures[best] if fits(outlines[best], box) else None


def fits(outline: Box, box: Box) -> bool:
    """Whether an outline may be what a box is drawn about, of which limbs may be missing."""
    inside = box.intersection(outline) > INSIDE * outline.area
    return outline.iou(box) >= (PART_IOU if inside else LOCK_IOU)


def _scattered(scene: Scene, box: Box) -> Silhouette | None:
    """The few readings of somebody far off, or of whom little shows, that a box is drawn about.

    They stand before the room at about one depth, and belong to nothing that goes on beside it.
    """
    part = rows, cols = scene.view.part(box)
    mine = scene.standing[part].copy()
    labels = scene.surfaces.labels[part]
    inside = np.bincount(labels[mine], minlength=len(scene.surfaces))
    inside[0] = scene.surfaces.pixels[0]  # pieces too small to be surfaces
    mine &= (inside > INSIDE * scene.surfaces.pixels)[labels]
    depth = scene.view.depth[part]
    if not mine.any():
        return None
    layers, readings = np.unique((depth[mine] / THICK).astype(np.intp), return_counts=True)
    # Behind the target the same gap may show more.
    nearest = int(layers[np.argmax(readings > 0.5 * readings.max())])
    mine &= np.abs(depth - (nearest + 0.5) * THICK) < THICK
    # Of what fills most of the box the rim is scattered, too.
    most = _largest_shown(scene, _shown(scene, box))
    if np.count_nonzero(mine) < max(SCATTERED * mine.size, LEAST_BESIDE * most):
        return None
    seen = Silhouette.trimmed(scene.view, cols.start, rows.start, mine, scene.rim)
    if seen is None or _of_background(scene, seen, box):
        return None
    # What little depth there is of a small thing in a hand may be the hand's.
    overlap = box_about(scene, seen).iou(box)
    if seen.width * seen.height < SMALL or overlap < LOCK_IOU:
        return None
    # Who is nearer and fits the box as well is meant, rather than what shows past him.
    as_well = (_overlaps_of(scene, box) > AS_WELL * overlap)[labels]
    nearer = as_well & (depth < seen.depth - DEPTH_STEP)
    return None if np.count_nonzero(nearer) > np.count_nonzero(mine) else seen


def _meant(account: Account, box: Box) -> Silhouette | None:
    """The person who is meant by a box about half of him, or by one that is drawn badly.

    Where the middle of the box shows something nearer than he, something small behind him or
    something without a reading, that may be meant.
    """
    scene, k = account.scene, account.scene.view.intrinsics
    large = box.over(scene.view.step).area / (k.fx * k.fy)
    best, most = None, MEANT_IOU
    for seen in _people(account, box):
        overlap = box_about(scene, seen).iou(box)
        if overlap > most and large * seen.depth**2 > HEAD and _in_the_middle(scene, seen, box):
            best, most = seen, overlap
    return best


def _people(account: Account, box: Box) -> Iterator[Silhouette]:
    """What has the shape of a person; or the size, of what the image's ends cut off."""
    scene = account.scene
    for index, sight in enumerate(account.sights):
        owner = account.owner_of(index)
        known = owner is not None and owner.upright
        if known or upright(sight.seen, scene.view.intrinsics, sight.view.top):
            yield sight.seen
    for label in np.flatnonzero(_overlaps_of(scene, box) > SIZE_IOU).tolist():
        seen = scene.silhouette(label)
        top = account.look(seen).top
        low = top is not None and top < TOP[0]
        if seen.cut.any and not low and person_sized(seen, top):
            yield seen


def _in_the_middle(scene: Scene, seen: Silhouette, box: Box) -> bool:
    """Whether the middle of a box shows mostly a silhouette, or nobody else who may be meant.

    That is who is half hidden behind him, or who stands before him as much in the box as he does;
    and of whom there is no reading. A wall behind him is not, nor is who comes in from the side.
    """
    middle = scene.view.part(box.scaled(0.5))
    own = seen.in_view(scene.view.shape)[middle]
    depth, labels = scene.view.depth[middle], scene.surfaces.labels[middle]
    beyond = depth > seen.depth + DEPTH_STEP
    room = scene.large[labels] & beyond | ~scene.standing[middle] & (depth > 0)
    aside = _overlaps_of(scene, box) < AS_WELL * box_about(scene, seen).iou(box)
    aside[0] = False
    farther = ~own & ~room & beyond
    other = ~own & ~room & ~beyond & ~aside[labels]
    shows, hides = np.count_nonzero(own), np.count_nonzero(farther) >= SOMEBODY_FARTHER * own.size
    alone = shows > LEAST_MEANT * own.size and np.count_nonzero(other) < MOST_ELSE * shows
    return bool((alone and not hides) or shows > MOSTLY * own.size)


def _within(scene: Scene, seen: Silhouette, box: Box) -> Silhouette:
    """The part of a silhouette in the box that was drawn: what sticks out is something else.

    Of what is larger than anybody, and goes on beyond what a box may be off by, so is the margin.
    """
    view = scene.view
    mask = seen.in_view(view.shape)
    rows, cols = view.part(box.scaled(1 + 2 * OUTSIDE))
    if np.count_nonzero(mask[rows, cols]) == np.count_nonzero(seen.mask):
        return seen
    if seen.label > 0 and scene.large[seen.label]:
        rows, cols = view.part(box)
    return Silhouette.trimmed(view, cols.start, rows.start, mask[rows, cols], scene.rim) or seen
