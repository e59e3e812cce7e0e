# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What is known not to be the target, because it was seen beside it.

A lookalike cannot be told by its look, but it can by its past: while the target is in sight all
else is not it, and stays that as long as it can be followed from frame to frame. Three memories
serve this: the pixels of the last frame (for high frame rates), what stands still (and comes into
sight again when somebody has passed before it), and the surfaces of the last frame as things with
place, size and colour (for low frame rates, where people step farther than their own width).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import Surfaces

FloatArray = npt.NDArray[np.float64]
DepthArray = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]

DEPTH_NOISE = 0.06
DEPTH_NOISE_PER_METRE = 0.02
WALKING = 1.2
"""Metres per second by which a bystander's depth may change between two frames."""
STATIC_NOISE = 0.05
STATIC_AGE = 0.35
"""Seconds for which something must have stood still to be remembered behind a passer-by."""
REACH = 0.12
REACH_PER_SECOND = 1.0
COLOR_REACH = 14.0
SIZE_REACH = 0.5
"""How far a bystander's place (metres), mean colour (Lab) and log area move between two frames."""
NEAR_TARGET = 0.25
"""Metres in depth within which pixels beside the target may be a piece of it."""
MARGIN = 3
SPREAD = 0.5
"""Share of known pixels from which the whole surface is taken to be known."""


class Bystanders:
    """The memories of one target's surroundings. Call :meth:`compare`, then :meth:`remember`.

    After :meth:`compare`:

    Attributes:
        known: ``(h, w)`` bool, pixels that show what is known not to be the target.
        share: ``(n,)`` of each surface's pixels, the share that is known, 0 to 1.
        kin: ``(n,)`` how well each surface fits to one that was known, 0 to 1.
    """

    def __init__(self) -> None:
        self.known: Mask = np.zeros((0, 0), np.bool_)
        self.share: FloatArray = np.zeros(0)
        self.kin: FloatArray = np.zeros(0)
        self._last: DepthArray | None = None
        self._static: DepthArray | None = None
        self._age: DepthArray = np.zeros((0, 0), np.float32)
        self._facts: FloatArray = np.zeros((0, 7))
        self._others: FloatArray = np.zeros((0, 7))
        self._dt = 0.0

    def compare(
        self, view: DepthView, surfaces: Surfaces, lab: npt.NDArray[np.uint8], dt: float
    ) -> None:
        """Recognise in a new frame what is known. ``lab`` is ``(h, w, 3)`` CIE Lab of the view."""
        self._dt = dt
        depth = view.depth
        count = len(surfaces)
        self._facts = _facts(view, surfaces, lab)
        if self._last is None or self._static is None or self._last.shape != depth.shape:
            self._last, self._static = None, None
            self.known = np.zeros(depth.shape, np.bool_)
            self.share, self.kin = np.zeros(count), np.zeros(count)
            return
        tolerance = depth * np.float32(DEPTH_NOISE_PER_METRE)
        tolerance += np.float32(DEPTH_NOISE + WALKING * min(dt, 0.3))
        known = np.abs(depth - self._last) < tolerance
        known &= self._last > 0
        tolerance += np.float32(STATIC_NOISE - DEPTH_NOISE - WALKING * min(dt, 0.3))
        static = np.abs(depth - self._static) < tolerance
        static &= self._age > STATIC_AGE
        known |= static
        self.known = known
        total = np.bincount(surfaces.labels[known], minlength=count)
        self.share = total / np.maximum(surfaces.pixels, 1)
        self.kin = self._kinship(min(dt, 0.4))

    def _kinship(self, dt: float) -> FloatArray:
        if not len(self._others):
            return np.zeros(len(self._facts))
        reach = REACH + REACH_PER_SECOND * dt
        scale = np.array([reach, 1.5 * reach, reach, *[COLOR_REACH] * 3, SIZE_REACH])
        steps = (self._facts[:, None] - self._others[None]) / scale
        result: FloatArray = np.exp(-0.5 * np.square(steps).sum(axis=2).min(axis=1))
        return result

    def of(self, silhouette: Silhouette, surfaces: Surfaces) -> tuple[float, float]:
        """Share of a silhouette's pixels that are known, and how well it fits a known thing."""
        known = self.known[silhouette.rows, silhouette.cols][silhouette.mask]
        label = silhouette.label
        if label == 0:
            labels = surfaces.labels[silhouette.rows, silhouette.cols][silhouette.mask]
            label = int(np.bincount(labels).argmax())
        return float(known.mean()), float(self.kin[label])

    def beside(self, rows: slice, cols: slice) -> Mask:
        """Pixels of a crop that showed something else than the target in the last frame."""
        if self._last is None:
            return np.zeros((rows.stop - rows.start, cols.stop - cols.start), np.bool_)
        result: Mask = self._last[rows, cols] > 0
        return result

    def remember(
        self,
        view: DepthView,
        surfaces: Surfaces,
        target: Silhouette | None,
        body: tuple[slice, slice],
        possible: Mask,
        least_area: float,
    ) -> None:
        """Take what this frame shows, once it is known where in it the target is.

        Args:
            view: as given to :meth:`compare`.
            surfaces: likewise.
            target: the target, or None where it is hidden: then only what was known stays known.
            body: rows and columns in which the whole body is expected: what is there at the
                target's depth may be a piece of it that was not found.
            possible: ``(n,)`` bool, surfaces that might be the hidden target coming out: they do
                not become known for touching something that is.
            least_area: square metres below which a surface is no thing to be followed.
        """
        depth = view.depth
        if target is not None:
            other = depth > 0
            other[target.rows, target.cols] &= ~target.mask
            around = (
                slice(
                    max(0, min(target.rows.start, body[0].start) - MARGIN),
                    max(target.rows.stop, body[0].stop) + MARGIN,
                ),
                slice(
                    max(0, min(target.cols.start, body[1].start) - MARGIN),
                    max(target.cols.stop, body[1].stop) + MARGIN,
                ),
            )
            other[around] &= np.abs(depth[around] - target.depth) > NEAR_TARGET
            seen = np.bincount(surfaces.labels[other], minlength=len(surfaces))
            things = seen > 0.7 * surfaces.pixels
        else:
            spread = (self.share > SPREAD) & ~possible
            other = spread[surfaces.labels] | self.known
            things = ((self.kin > 0.4) | (self.share > SPREAD)) & ~possible
        self._last = np.where(other, depth, np.float32(0))
        self._remember_static(depth, other, target is not None)
        things &= (surfaces.pixels > 12) & (self._facts[:, 6] > np.log(least_area))
        things[0] = False
        self._others = self._facts[things]

    def _remember_static(self, depth: DepthArray, other: Mask, sure: bool) -> None:
        if self._static is None:
            self._static = np.where(other, depth, np.float32(0))
            self._age = np.zeros_like(depth)
            return
        tolerance = STATIC_NOISE + DEPTH_NOISE_PER_METRE * depth
        farther = depth - self._static
        same = other & (np.abs(farther) < tolerance)
        self._age[same] += np.float32(min(self._dt, 0.5))
        if sure:
            fresh = other & ((farther > tolerance) | (self._static == 0))
            np.copyto(self._static, depth, where=fresh)
            self._age[fresh] = 0


def _facts(view: DepthView, surfaces: Surfaces, lab: npt.NDArray[np.uint8]) -> FloatArray:
    """Place of the upper edge's middle (metres), mean Lab colour and log area, ``(n, 7)``."""
    count = len(surfaces)
    k = view.intrinsics
    flat = surfaces.labels.ravel()
    pixels = np.maximum(surfaces.pixels, 1)
    z = surfaces.depth.astype(np.float64)
    boxes = surfaces.boxes
    facts = np.empty((count, 7))
    facts[:, 0] = (boxes[:, 0] + boxes[:, 2] / 2 - k.cx) * z / k.fx
    facts[:, 1] = (boxes[:, 1] - k.cy) * z / k.fy
    facts[:, 2] = z
    for axis in range(3):
        sums = np.bincount(flat, weights=lab[:, :, axis].ravel(), minlength=count)
        facts[:, 3 + axis] = sums / pixels
    facts[:, 6] = np.log(np.maximum(surfaces.areas(k), 1e-6))
    return facts
