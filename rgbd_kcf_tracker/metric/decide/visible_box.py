# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The box of what shows of a body, with what the depth sensor did not see of it added."""

from __future__ import annotations

import numpy as np

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.identity.body import Body
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette

FOOT = 0.2
"""Metres above the floor up to which a body is taken to stand on it: feet and ankles lie too near
to the floor to be told from it."""
FOOT_SHARE = 0.2
"""The same as a share of what shows: a ball that bounces has no feet."""
RIM = 2
"""Columns without a reading from which the depth image is narrower than the colour image: one or
two may lack one along any image's edge."""
SLIMMEST = 0.4
"""Width of a body against its height, at the least, where it has never been seen whole: somebody
whose arms hang down."""
LIKE = 0.25
"""Share of a column's pixels in the body's colours down to which it is taken to go on: between arm
and trunk shows as much of what is behind. At 0.18 and 0.35 the means over the real walks are the
same."""


def box_about(scene: Scene, seen: Silhouette) -> Box:
    """The box about a silhouette in pixels of the image."""
    step = scene.view.step
    rows, cols = seen.mask.shape
    return Box(seen.left * step, seen.top * step, cols * step, rows * step)


def outline_box(scene: Scene, seen: Silhouette) -> Box:
    """The box of a silhouette in pixels of the image, of whose body nothing more is known.

    See :func:`visible_box`.
    """
    body, top = Body(seen), seen.metres[1]
    if any(_at_rim(scene, seen)):
        body.learn_colors(seen, scene, top, 0.0)
        wide = seen.mask.shape[1]
        about = seen.rows, slice(max(seen.left - wide, 0), seen.cols.stop + wide)
        body.learn_around(seen, scene, about, None)
    return visible_box(scene, body, seen, top)


def _at_rim(scene: Scene, seen: Silhouette) -> tuple[bool, bool]:
    """Whether a silhouette ends at its left, and at its right, where only colour goes on."""
    rim, end = scene.rim, scene.view.shape[1] - scene.rim.right
    return (
        rim.left > RIM and seen.left <= rim.left + RIM,
        rim.right > RIM and seen.cols.stop >= end - RIM,
    )


def _foot(scene: Scene, seen: Silhouette) -> float:
    """Row of the view in which a silhouette ends, feet included, as far as the view goes."""
    rows, cols = seen.mask.shape
    bottom = float(seen.top + rows)
    if scene.floor is not None and not seen.cut.bottom:
        foot = scene.floor.row_at(seen.left + cols / 2, seen.depth)
        missing = (foot - bottom) * seen.depth / scene.view.intrinsics.fy
        if 0 < missing < min(FOOT, FOOT_SHARE * seen.height):
            return min(foot, float(scene.view.shape[0]))
    return bottom


def visible_box(scene: Scene, body: Body, seen: Silhouette, top: float) -> Box:
    """The box of a silhouette in pixels of the image.

    Feet, which go with the floor when that is taken out, are added down to the floor; and where the
    depth image ends before the colour image does, the columns that go on in the body's colours.
    The body's upper edge is at ``top`` metres.
    """
    cols = seen.mask.shape[1]
    left, right = float(seen.left), float(seen.left + cols)
    bottom = _foot(scene, seen)
    goes_on = _at_rim(scene, seen)
    if goes_on[0]:
        left -= _beyond_rim(scene, body, seen, top, -1)
    if goes_on[1]:
        right += _beyond_rim(scene, body, seen, top, 1)
    step = scene.view.step
    return Box.from_corners(left * step, seen.top * step, right * step, bottom * step)


def _beyond_rim(scene: Scene, body: Body, seen: Silhouette, top: float, way: int) -> int:
    """Columns by which the body goes on where depth has ended but colour has not."""
    most = max(body.width, SLIMMEST * body.height)
    cols = seen.mask.shape[1]
    limit = int(most * scene.view.intrinsics.fx / seen.depth) - cols + 2
    if limit <= 0:
        return 0
    first = seen.left + cols if way > 0 else max(0, seen.left - limit)
    last = min(first + limit, scene.view.shape[1]) if way > 0 else seen.left
    if first >= last:
        return 0
    codes = scene.codes[seen.rows, first:last][:, ::way]
    odds = body.odds_of(codes, seen, scene.view, top)
    like = np.convolve((odds > 0).mean(axis=0), np.ones(3) / 3, 'same')
    ends = np.flatnonzero(like < LIKE)
    return int(ends[0]) if len(ends) else codes.shape[1]
