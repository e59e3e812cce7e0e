# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How far a thing stands out before what is beside it: where it is taken away, that is gone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.perceive.depth_view import median_depth

LEAST, MOST = 0.04, 0.1
"""Metres by which a thing stands out at the least, four times the noise of depth at two metres; and
beyond which it does not matter how far away what is beside it is, which changes with the view."""
LEFT = 0.4
"""Share of that, at the least, that is left of what still stands there, seen from elsewhere or with
a box that is a little off; nothing is left where it has been taken away."""
MIDDLE = 0.5
"""Share of a box's sides in which its own depth is read: at its rim other things show."""
APART, WIDE = 0.2, 0.4
"""Shares of a box's width that the strips beside it are off it, as boxes are drawn, and wide."""


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """How much nearer the middle of a box is than what is beside it.

    Attributes:
        sides: ``(2,)`` metres, on its left and on its right; nan where that has no reading.

    >>> known = Relief(np.array([0.2, np.nan]))
    >>> known.left_in(Relief(np.array([0.15, 0.0]))), known.left_in(Relief(np.array([0.0, 0.0])))
    (True, False)
    >>> known.left_in(Relief(np.array([np.nan, 0.0]))) is None
    True
    >>> known.stands_out, Relief(np.array([0.01, np.nan])).stands_out
    (True, False)
    """

    sides: FloatArray

    @classmethod
    def of(cls, frame: Frame, box: Box) -> Relief:
        """What a box of a frame, in pixels, shows."""
        rows, wide = box.scaled(MIDDLE), WIDE * box.width
        starts = (box.x - APART * box.width - wide, box.right + APART * box.width)
        beside = [median_depth(frame, Box(x, rows.y, wide, rows.height)) for x in starts]
        return cls(np.array(beside) - median_depth(frame, rows))

    @property
    def stands_out(self) -> bool:
        """Whether it is nearer than what is beside it on some side."""
        return bool(np.any(self.sides > LEAST))

    def left_in(self, now: Relief) -> bool | None:
        """Whether a box still shows what stood out so on some side, None where nothing tells."""
        stood_out = self.sides > LEAST
        least, left = LEFT * np.minimum(self.sides[stood_out], MOST), now.sides[stood_out]
        if np.any(left >= least):
            return True
        return False if left.size and np.all(left < least) else None
