# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The depth about a target's centre, on a grid that does not depend on the target's size."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.frame import is_reading
from rgbd_kcf_tracker.geometry import Box

Depth = npt.NDArray[np.float32]

# Rows and columns of the grid: fine enough to trim by, few enough to cost nothing.
GRID = (24, 16)


def centre_patch(depth: Depth, box: Box, share: float) -> Depth:
    """Depth about the centre of a box (thesis section 4.1.3, figure 4.2 c).

    Args:
        depth: ``(H, W)`` metres, NaN for no reading.
        box: the target's.
        share: of the box's width and height that is looked at, 0 to 1.

    Returns:
        ``GRID`` metres; NaN where there is no reading, infinity outside the image: nothing near is
        there.
    """
    rows, inside_rows = _places(box.cy, box.height * share, GRID[0], depth.shape[0])
    cols, inside_cols = _places(box.cx, box.width * share, GRID[1], depth.shape[1])
    patch: Depth = depth[rows[:, None], cols]
    patch[~is_reading(patch)] = np.nan
    patch[~inside_rows] = np.inf
    patch[:, ~inside_cols] = np.inf
    return patch


def _places(
    middle: float, side: float, count: int, limit: int
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Pixels at the middles of ``count`` equal parts of a side, and which lie in the image."""
    place = np.floor(middle + side * ((np.arange(count) + 0.5) / count - 0.5))
    inside = (place >= 0) & (place < limit)
    return np.clip(place, 0, limit - 1).astype(np.intp), inside
