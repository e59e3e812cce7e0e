# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A part of a depth view that may be a body: its pixels, its place, and what cuts it off."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from operator import or_
from typing import NamedTuple, TypeVar

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats, Mask
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView, grown

Scalar = TypeVar('Scalar', bound=np.generic)

NEARER = 0.1
NEARER_PER_METRE = 0.03
"""Metres by which what lies beside a silhouette must be nearer to be hiding more of it: more than
the relief of a body and the noise of far readings."""
RING = 2
"""Pixels of the view beyond the outline in which something nearer is looked for: one beyond the
seam that often lies between two surfaces."""
CUT_SHARE = 0.3
"""Share of one side's outline beside which something nearer must lie for that side to be cut. At
0.21 everyone's MOTA was 1.6 points lower, at 0.42 walks at 1 Hz were (docs/experiments.md)."""
UPPER = 0.98
"""Share of a silhouette's pixels that lie below its upper end: the topmost may be noise."""


class Rim(NamedTuple):
    """Columns and rows at the edges of a view in which there never is a reading.

    A registered depth image often covers less than the colour image.
    """

    left: int = 0
    top: int = 0
    right: int = 0
    bottom: int = 0

    @classmethod
    def of(cls, view: DepthView) -> Rim:
        """The rim of one view."""
        valid = (view.depth > 0).view(np.uint8)
        rows, cols = view.shape
        across = np.flatnonzero(
            cv2.reduce(valid, 0, cv2.REDUCE_SUM, dtype=cv2.CV_32S) > 0.02 * rows
        )
        down = np.flatnonzero(cv2.reduce(valid, 1, cv2.REDUCE_SUM, dtype=cv2.CV_32S) > 0.02 * cols)
        if not len(across) or not len(down):
            return cls()
        return cls(
            int(across[0]), int(down[0]), int(cols - 1 - across[-1]), int(rows - 1 - down[-1])
        )

    def common(self, other: Rim) -> Rim:
        """What is rim in both: holes come and go, the rim stays."""
        return Rim(*map(min, self, other))

    def reached(
        self, left: float, top: float, right: float, bottom: float, view: DepthView
    ) -> Sides:
        """At which sides what lies between these pixels reaches the end of what a view sees."""
        rows, cols = view.shape
        return Sides(
            left <= 1 + self.left,
            top <= 1 + self.top,
            right >= cols - 1 - self.right,
            bottom >= rows - 1 - self.bottom,
        )


class Sides(NamedTuple):
    """Something for each side of a silhouette."""

    left: bool = False
    top: bool = False
    right: bool = False
    bottom: bool = False

    @property
    def any(self) -> bool:
        """True where it holds for one side at least."""
        return True in self


@dataclass(frozen=True, slots=True, eq=False)
class Silhouette:
    """Some pixels of a view, with the crop that holds them.

    Attributes:
        left, top: column and row of the crop in the view.
        mask: ``(h, w)`` bool, the pixels within the crop; every edge of the crop has one.
        label: the surface that it is as a whole, 0 where it is part of one or of several.
        depth: mean depth in metres.
        area: in square metres, seen from the camera.
        ends: the sides at which it reaches the end of what the camera sees.
        cut: the sides on which something nearer, or that end, may hide more of it.
        metres: left, top, right and bottom in metres of the camera's frame, at ``depth``.
    """

    left: int
    top: int
    mask: Mask
    label: int
    depth: float
    area: float
    ends: Sides
    cut: Sides
    metres: tuple[float, float, float, float]

    def pixels(self, image: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
        """Those of an image of the view's shape that it covers, ``(n,)``."""
        return image[self.rows, self.cols][self.mask]

    def in_view(self, shape: tuple[int, int]) -> Mask:
        """Its pixels in a view of a shape, ``(h, w)`` bool."""
        return together([self], shape)

    def highest(self, elevation: Floats | None) -> float | None:
        """Metres above the floor of the upper end, None where no floor is known.

        Args:
            elevation: ``(h, w)`` of the view, metres, or None.
        """
        return None if elevation is None else _upper_end(self.pixels(elevation))

    def lowest(self, elevation: Floats | None) -> float | None:
        """Metres above the floor of the lower end, None where no floor is known; see `highest`."""
        return None if elevation is None else -_upper_end(-self.pixels(elevation))

    def same(self, other: Silhouette) -> bool:
        """Whether another silhouette of the same view has the same pixels."""
        return self is other or (
            self.left == other.left
            and self.top == other.top
            and self.mask.shape == other.mask.shape
            and bool(np.array_equal(self.mask, other.mask))
        )

    def common(self, other: Silhouette) -> Mask:
        """Which pixels of the other's crop both have, ``(h, w)`` bool of that crop."""
        shared = np.zeros_like(other.mask)
        y0, y1 = max(self.top, other.top), min(self.rows.stop, other.rows.stop)
        x0, x1 = max(self.left, other.left), min(self.cols.stop, other.cols.stop)
        if y0 < y1 and x0 < x1:
            theirs = np.s_[y0 - other.top : y1 - other.top, x0 - other.left : x1 - other.left]
            mine = self.mask[y0 - self.top : y1 - self.top, x0 - self.left : x1 - self.left]
            shared[theirs] = mine & other.mask[theirs]
        return shared

    def meets(self, other: Silhouette) -> bool:
        """Whether another silhouette of the same view shares a pixel with it."""
        return bool(self.common(other).any())

    @property
    def rows(self) -> slice:
        """Rows of the view that the crop covers."""
        return slice(self.top, self.top + self.mask.shape[0])

    @property
    def cols(self) -> slice:
        """Columns of the view that the crop covers."""
        return slice(self.left, self.left + self.mask.shape[1])

    @property
    def width(self) -> float:
        """Metres across."""
        return self.metres[2] - self.metres[0]

    @property
    def height(self) -> float:
        """Metres from top to bottom."""
        return self.metres[3] - self.metres[1]

    @property
    def fill(self) -> float:
        """Share of its box that it fills, 0 to 1."""
        return self.area / (self.width * self.height)

    @classmethod
    def of(
        cls, view: DepthView, left: int, top: int, mask: Mask, label: int, rim: Rim
    ) -> Silhouette:
        """Measure the pixels of ``mask``, a crop at ``left, top`` of the view.

        Args:
            view: the depth.
            left: column of the crop.
            top: row of the crop.
            mask: ``(h, w)`` bool with at least one pixel in each outer row and column.
            label: of the surface, or 0.
            rim: of the view, where an outline is cut off as at the image's edge.
        """
        rows, cols = mask.shape
        depth = view.depth[top : top + rows, left : left + cols]
        z = float(depth[mask].mean())
        k = view.intrinsics
        ends = rim.reached(left, top, left + cols, top + rows, view)
        cut = Sides(*map(or_, _hidden_sides(view, left, top, mask, z), ends))
        x0, y0, _ = view.metres(left, top, z)
        x1, y1, _ = view.metres(left + cols, top + rows, z)
        area = float(np.count_nonzero(mask)) * z * z / (k.fx * k.fy)
        return cls(left, top, mask, label, z, area, ends, cut, (x0, y0, x1, y1))

    @classmethod
    def trimmed(
        cls, view: DepthView, left: int, top: int, mask: Mask, rim: Rim
    ) -> Silhouette | None:
        """A part of one, or of several: its crop is made no larger than its pixels, see :meth:`of`.

        None where the mask has no pixel.
        """
        rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        if not len(rows):
            return None
        part = mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
        return cls.of(view, left + int(cols[0]), top + int(rows[0]), part, 0, rim)


def together(those: Iterable[Silhouette], shape: tuple[int, ...]) -> Mask:
    """The pixels of some in a view of a shape, ``(h, w)`` bool."""
    mask = np.zeros(shape, np.bool_)
    for seen in those:
        mask[seen.rows, seen.cols] |= seen.mask
    return mask


def _upper_end(values: Floats) -> float:
    """The 98th percentile of ``(n,)``: ``np.percentile`` takes five times as long."""
    place = UPPER * (len(values) - 1)
    low = int(place)
    high = min(low + 1, len(values) - 1)
    ordered = np.partition(values, (low, high))
    share = place - low
    step = ordered[high] - ordered[low]
    return float(ordered[low] + step * share if share < 0.5 else ordered[high] - step * (1 - share))


def _hidden_sides(view: DepthView, left: int, top: int, mask: Mask, z: float) -> Sides:
    """The sides along which something nearer lies."""
    rows, cols = mask.shape
    height, width = view.shape
    y0, x0 = max(0, top - RING), max(0, left - RING)
    y1, x1 = min(height, top + rows + RING), min(width, left + cols + RING)
    around = view.depth[y0:y1, x0:x1]
    nearer = around < z - (NEARER + NEARER_PER_METRE * z)
    nearer &= around > 0
    if not nearer.any():
        return Sides()
    body = np.zeros(nearer.shape, np.bool_)
    body[top - y0 : top - y0 + rows, left - x0 : left - x0 + cols] = mask
    outside = ~body
    nearer &= outside
    # Between two surfaces there often is a seam without a reading.
    nearer = grown(nearer) & outside

    def hidden(to: tuple[slice, slice], of: tuple[slice, slice]) -> bool:
        """Along the side on which the pixels ``to`` lie beyond those ``of`` the body."""
        hiding = int(np.count_nonzero(nearer[to] & body[of]))
        return hiding > 0 and hiding > CUT_SHARE * int(np.count_nonzero(outside[to] & body[of]))

    first, last = np.s_[:-RING], np.s_[RING:]
    return Sides(
        hidden(np.s_[:, first], np.s_[:, last]),
        hidden(np.s_[first, :], np.s_[last, :]),
        hidden(np.s_[:, last], np.s_[:, first]),
        hidden(np.s_[last, :], np.s_[first, :]),
    )
