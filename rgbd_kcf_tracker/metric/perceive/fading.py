# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Who gets hard to tell from the room as he sits, leans or lies down in full view.

Depth alone says there that he has gone. But who was there a moment ago has not: about him the
colours that are not the room's tell him from it, however little nearer he is, and he is himself
however low he gets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import Mask
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette, together

STEP = 0.5
"""Seconds from one frame to the next at the most: in more nobody is where he was."""
FADES = 0.75
"""Share of somebody below which he fades, of the most that was seen of him, as a body turned
sideways has about as much, and of what was seen last."""
ABOUT = 5
"""Pixels of the view, a side of the square about one of his, in which more of him may show in the
next frame: some centimetres, and as many again in the one after."""


@dataclass(frozen=True, slots=True, eq=False)
class Lately:
    """Somebody who may still be where he was seen last.

    Attributes:
        seen: the silhouette.
        most: square metres, the most that was seen of him.
        missed: whether he was not found since.
    """

    seen: Silhouette
    most: float
    missed: bool

    def fades(self, hardly: Mask) -> bool:
        """Whether less of him shows than before.

        Args:
            hardly: ``(h, w)`` bool, pixels that show something unlike the room, and hardly nearer.
        """
        if self.missed or self.seen.area < FADES * self.most:
            return True
        mask = self.seen.mask
        hard = np.count_nonzero(hardly[self.seen.rows, self.seen.cols] & mask)
        return bool(hard > (1 - FADES) * np.count_nonzero(mask))


def around(lately: Sequence[Lately]) -> tuple[slice, slice]:
    """Rows and columns of a view that hold all of some, one at the least, and what is about them.

    See :data:`ABOUT`.
    """
    rows, cols = ([each.seen.rows for each in lately], [each.seen.cols for each in lately])
    (top, bottom), (left, right) = (
        (max(min(each.start for each in side) - ABOUT // 2, 0), max(each.stop for each in side))
        for side in (rows, cols)
    )
    return slice(top, bottom + ABOUT // 2), slice(left, right + ABOUT // 2)


def fading(lately: Sequence[Lately], hardly: Mask) -> Mask | None:
    """Where those were seen last who fade, ``(h, w)`` bool; None for nobody.

    Args:
        lately: all who may still be where they were.
        hardly: see :meth:`Lately.fades`.
    """
    who = [each.seen for each in lately if each.fades(hardly)]
    return together(who, hardly.shape) if who else None
