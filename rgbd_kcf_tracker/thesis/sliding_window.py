# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The sliding window over the search space, all of its patches in one batch (thesis figure 4.8).

The search space is horizontal and grows with the target's width. Windows lie whole cells apart, so
the features of the strip that they cover are computed once and cut into windows.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.features.hog import Features
from rgbd_kcf_tracker.thesis.correlation import Sample


def search_span(
    width: float, span: float, hidden_s: float, speed: float, image_width: float
) -> float:
    """How far to either side the window slides, in pixels.

    Args:
        width: of the target, pixels.
        span: in target widths, while the target is seen.
        hidden_s: seconds since it was last seen.
        speed: target widths per second that a hidden target may move.
        image_width: beyond which there is nothing to find.
    """
    # Whole widths more, so that the strip of features has few sizes.
    return min((span + math.ceil(speed * hidden_s)) * width, image_width)


def window_starts(reach_cells: int, step_cells: int) -> npt.NDArray[np.int64]:
    """Offsets of the windows from the middle one, symmetric about 0.

    Args:
        reach_cells: that no window is farther from the middle one than, in cells.
        step_cells: from one window to the next, in cells.

    Returns:
        ``(2 * (reach_cells // step_cells) + 1,)`` in cells, ascending.
    """
    steps = reach_cells // step_cells
    return np.arange(-steps, steps + 1, dtype=np.int64) * step_cells


def step_in_cells(step: float, cell: float) -> int:
    """A step in pixels as whole cells, at least one."""
    return max(math.floor(step / cell + 0.5), 1)


def windows(
    strip: Features, taper: npt.NDArray[np.float32], offsets: npt.NDArray[np.int64]
) -> Sample:
    """The tapered windows of a strip of features as one stack.

    Args:
        strip: ``(channels, rows, cols)``, the middle window in its middle.
        taper: ``(rows, window cols)``.
        offsets: in cells, from :func:`window_starts`.
    """
    cols = taper.shape[1]
    middle = (strip.shape[2] - cols) // 2
    every = np.lib.stride_tricks.sliding_window_view(strip, cols, axis=2)
    stack = np.moveaxis(every[:, :, middle + offsets], 2, 0) * taper
    return Sample.of(np.ascontiguousarray(stack, np.float32))
