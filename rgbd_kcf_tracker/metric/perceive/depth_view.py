# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A frame's depth image at the resolution in which surfaces are looked for."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import Floats, Mask
from rgbd_kcf_tracker.frame import Frame, is_reading
from rgbd_kcf_tracker.geometry import Box, Intrinsics

NEAREST = 0.2
"""Metres before the camera from which anything is seen: nothing is read nearer."""
SAMPLES = 24
"""Readings along the shorter side of a part of the image: some hundreds are enough for a median,
and a target that fills the image costs no more."""
MOST = 0.6
"""Share of the pixels of a part of the image that have a reading, from which these are taken to be
of what it shows: where most have none, that may reflect nothing, and they be another's."""


def part_in(shape: tuple[int, ...], box: Box) -> tuple[slice, slice]:
    """Rows and columns of all pixels that a box touches, as far as they are in an image."""
    rows, cols = shape[:2]
    return (
        slice(math.floor(min(max(box.y, 0), rows)), math.ceil(min(max(box.bottom, 0), rows))),
        slice(math.floor(min(max(box.x, 0), cols)), math.ceil(min(max(box.right, 0), cols))),
    )


def in_box(shape: tuple[int, ...], box: Box) -> Mask:
    """The pixels of an image that a box touches, ``(h, w)`` bool."""
    inside = np.zeros(shape[:2], np.bool_)
    inside[part_in(shape, box)] = True
    return inside


def grown(mask: Mask, side: int = 3) -> Mask:
    """A mask and the squares of ``side`` pixels about each of its own, ``(h, w)`` bool."""
    wider: Mask = cv2.dilate(mask.view(np.uint8), np.ones((side, side), np.uint8)).view(np.bool_)
    return wider


def closed(mask: Mask, side: int = 3) -> Mask:
    """A mask without gaps narrower than ``side`` pixels, ``(h, w)`` bool."""
    square = np.ones((side, side), np.uint8)
    filled: Mask = cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_CLOSE, square).view(np.bool_)
    return filled


def median_depth(frame: Frame, box: Box) -> float:
    """Median depth in a box of a frame in metres, nan where most of it has no reading."""
    if frame.depth is None:
        return math.nan
    part = frame.depth[part_in(frame.depth.shape, box)]
    step = max(1, min(part.shape) // SAMPLES)
    depth = part[::step, ::step]
    valid = depth[is_reading(depth)]
    return float(np.median(valid)) if valid.size > MOST * depth.size else math.nan


def _viewed(frame: Frame, width: int) -> tuple[int, Intrinsics]:
    """The step of a view of a frame at about ``width`` columns, and its intrinsics."""
    step = max(1, min(round(frame.width / width), frame.height // 2))
    k, half = frame.intrinsics or Intrinsics.guess(frame.width, frame.height), step // 2
    return step, Intrinsics(k.fx / step, k.fy / step, (k.cx - half) / step, (k.cy - half) / step)


@dataclass(frozen=True, slots=True, eq=False)
class DepthView:
    """Every ``step``-th pixel of a depth image.

    Attributes:
        depth: ``(h, w)`` float32 metres, 0 where there is no reading (so that comparisons need no
            mask and raise no warning).
        step: pixels of the colour image per pixel of the view, in both directions.
        intrinsics: of the view, that is the colour image's divided by ``step``.
    """

    depth: Floats
    step: int
    intrinsics: Intrinsics

    @classmethod
    def of(cls, frame: Frame, width: int) -> DepthView | None:
        """The view of a frame at about ``width`` columns, or None for a frame without depth.

        Holes of a single pixel are filled from the pixel half a step away. Without intrinsics a
        camera of 60 degrees is assumed: sizes are then in the same wrong metre everywhere, which
        is all the tracker needs. An image of a single row or column shows no surface: None.
        """
        if frame.depth is None or min(frame.width, frame.height) < 2:
            return None
        step, intrinsics = _viewed(frame, width)
        half = step // 2
        depth = np.array(frame.depth[half::step, half::step])
        missing = ~is_reading(depth)
        found = frame.depth[::step, ::step][: depth.shape[0], : depth.shape[1]][missing]
        found[~is_reading(found)] = 0.0
        depth[missing] = found
        return cls(depth, step, intrinsics)

    def at(self, frame: Frame, width: int) -> DepthView:
        """The same for a frame of another size without depth: what was read is not in it."""
        step, intrinsics = _viewed(frame, width)
        rows, cols = (len(range(step // 2, side, step)) for side in (frame.height, frame.width))
        if (step, (rows, cols)) == (self.step, self.shape):
            return self
        return DepthView(np.zeros((rows, cols), np.float32), step, intrinsics)

    def part(self, box: Box) -> tuple[slice, slice]:
        """Rows and columns of the view that a box of the image touches."""
        return part_in(self.shape, box.over(self.step))

    def metres(self, across: float, down: float, depth: float) -> tuple[float, float, float]:
        """Where a place of the view is, in metres of the camera's frame.

        Args:
            across: columns from the view's left edge: a box counts pixels by their edges, a camera
                by their middles.
            down: rows from its upper edge.
            depth: metres.
        """
        return self.intrinsics.deproject(across - 0.5, down - 0.5, depth)

    def place(self, x: float, y: float, depth: float) -> tuple[float, float]:
        """Columns from the view's left edge, and rows from its upper one, of a place in metres."""
        k = self.intrinsics
        return x * k.fx / depth + k.cx + 0.5, y * k.fy / depth + k.cy + 0.5

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.depth.shape[0], self.depth.shape[1]
