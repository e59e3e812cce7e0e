# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Somebody whom depth does not show, or not apart, known by the box that was drawn about him."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.by_look import SAME_DEPTH, ByLook
from rgbd_kcf_tracker.metric.decide.account import STATURE, Account
from rgbd_kcf_tracker.metric.identity.gallery import LEAST_PIXELS, SLICES, Gallery, View
from rgbd_kcf_tracker.metric.perceive.depth_view import part_in
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Sides, Silhouette

NARROW, BROAD = 6.0, 1.8
"""Widths of a box that it is high at the most and at the least, as boxes about people who stand or
walk are: others are about things, or parts of somebody, whose colours lie elsewhere."""
OWN = 0.5
"""Probability from which a pixel's colour is rather his than that of what is around him."""
ABOUT, TOUCHED = 1.1, 0.05
"""Size of a box with a rim in which others may touch who is in it, and the share of it from which
somebody before him is read there."""
FEW = 100
"""Pixels of the view of a box below which what it shows is mostly rim, mixed with what is behind:
five by twenty, of which half are not."""
UNLIKE = -1.0
"""Log-odds below which what a look has found, where depth does not tell, is something else: so are
nine of ten boxes on walls and doors beyond depth's reach, and hardly any on people
(docs/experiments.md)."""


def view_in(scene: Scene, box: Box, look: ByLook, depth: float | None = None) -> View | None:
    """How somebody looks of whom depth shows nothing: the pixels in a box that have his colours.

    What is read there at another depth is what he stands before.

    Looks are counted from the head down in metres, so that they can be compared with those of
    whoever depth shows: of single views of real people that is nearly as telling as their outlines
    in depth (docs/experiments.md).

    Args:
        scene: of the frame.
        box: about him, in pixels of the image.
        look: that follows him.
        depth: metres; None where that is not known: then as far off as who is of mean height.

    Returns:
        None where that cannot be said: his head is not in the image, or it is not known how far off
        he is as he does not show from head to feet.
    """
    view, k = scene.view, scene.view.intrinsics
    b = box.over(view.step)
    rows, cols = view.part(box)
    tall = rows.stop - rows.start
    if tall < SLICES or b.y == 0:  # a box that ends where the image does was cut off there
        return None
    if depth is None:
        whole = rows.start > 0 and rows.stop < view.shape[0]
        if not whole or not BROAD * box.width < box.height < NARROW * box.width:
            return None
        depth = STATURE * k.fy / tall
    mask = look.own(scene.image[rows, cols]) > OWN
    read = view.depth[rows, cols]
    mask &= (read == 0) | (np.abs(read - depth) < SAME_DEPTH * depth)
    if np.count_nonzero(mask) < LEAST_PIXELS:
        return None
    seen = Silhouette(cols.start, rows.start, mask, 0, depth, 0.0, Sides(), Sides(), (0.0,) * 4)
    return View.of(view, scene.codes, seen, None, max(-b.y, 0.0) * depth / k.fy)


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """Who a box is drawn about where depth shows nothing, or nobody apart from what is there.

    Attributes:
        gallery: how he looks.
        place: ``(2,)`` metres across and along the floor, were he of mean height.
        whole: whether the box ends where he does, and not where depth's view does or another
            stands before him.
        telling: whether others can be told from him: what depth shows at his place is not he, and
            he shows large enough.
    """

    gallery: Gallery
    place: FloatArray
    whole: bool
    telling: bool

    @classmethod
    def of(cls, account: Account, box: Box, look: ByLook) -> Drawn | None:
        """Take what a box of a frame shows; None where :func:`view_in` gives nothing."""
        scene = account.scene
        seen = view_in(scene, box, look)
        if seen is None:
            return None
        view, b = scene.view, box.over(scene.view.step)
        middle = view.metres(b.cx, b.cy, STATURE * view.intrinsics.fy / b.height)
        # What stands before him is read, and hides a part of him.
        about = scene.before[part_in(view.shape, b.scaled(ABOUT))]
        alone = np.count_nonzero(about) < TOUCHED * about.size
        whole = bool(alone) and not scene.ends(box).any
        telling = look.unread and b.area >= FEW
        known = Gallery.of(account.described(seen, box), account.time)
        return cls(known, scene.axes @ np.array(middle), whole, telling)

    def unlike(self, view: View) -> bool:
        """Whether a figure does not look as he does: said if all of him was drawn, and large."""
        return self.whole and self.telling and self.gallery.log_odds(view) < UNLIKE


def unlike(
    gallery: Gallery, scene: Scene, box: Box, look: ByLook, depth: float | None = None
) -> bool:
    """Whether what a box shows does not look as who is known.

    Args:
        gallery: his looks.
        scene: of the frame.
        box: in pixels of the image.
        look: that follows him.
        depth: metres; None where that is not known, see :func:`view_in`: where that gives nothing,
            nothing speaks against him.
    """
    seen = view_in(scene, box, look, depth)
    return seen is not None and gallery.log_odds(seen) < UNLIKE
