# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Depth cut into surfaces: connected pixels between which depth does not jump."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Mask
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView

_BESIDE = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Surfaces:
    """The surfaces of a view; row ``i`` of each array is the surface labelled ``i``, 0 is none.

    Attributes:
        labels: ``(h, w)`` int32.
        boxes: ``(n, 4)`` int32 left, top, width, height in pixels of the view.
        pixels: ``(n,)`` int32 number of pixels.
        depth: ``(n,)`` float32 mean depth in metres.
        jump, jump_per_metre: the depth step at which they were cut.
        runs: ``(m,)`` index of the first pixel, in the flattened view, of each run of pixels of one
            label in a row: of some ten pixels each.
    """

    labels: npt.NDArray[np.int32]
    boxes: npt.NDArray[np.int32]
    pixels: npt.NDArray[np.int32]
    depth: Floats
    jump: float
    jump_per_metre: float
    runs: npt.NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.pixels)

    def areas(self, k: Intrinsics) -> FloatArray:
        """Square metres of each surface as seen from a camera, ``(n,)``."""
        z = self.depth.astype(np.float64)
        return self.pixels * z * z / (k.fx * k.fy)

    def crop(self, label: int) -> tuple[int, int, Mask]:
        """Left and top of one surface, and which pixels right and below of there are of it."""
        left, top, width, height = self.boxes[label].tolist()
        return left, top, self.labels[top : top + height, left : left + width] == label

    def crop_of(self, those: Mask) -> tuple[int, int, Mask]:
        """The same of all of some surfaces, ``(n,)`` bool, one at the least."""
        boxes = self.boxes[those]
        left, top = boxes[:, :2].min(axis=0).tolist()
        right, bottom = (boxes[:, :2] + boxes[:, 2:]).max(axis=0).tolist()
        return left, top, those[self.labels[top:bottom, left:right]]

    def means(self, values: Floats) -> FloatArray:
        """Mean over each surface of an image, ``(h, w)``; ``(n,)``, 0 where there is no pixel."""
        return _means(values, self.labels, self.runs, self.pixels)


@dataclass(frozen=True, slots=True)
class Sizes:
    """Places and sizes of all surfaces in metres, seen from the camera, ``(n,)`` each."""

    area: FloatArray
    x: FloatArray
    y: FloatArray
    width: FloatArray
    height: FloatArray

    @classmethod
    def of(cls, surfaces: Surfaces, k: Intrinsics) -> Sizes:
        """Measure every surface of a view with intrinsics ``k``."""
        z = surfaces.depth.astype(np.float64)
        boxes = surfaces.boxes
        return cls(
            surfaces.areas(k),
            (boxes[:, 0] + (boxes[:, 2] - 1) / 2 - k.cx) * z / k.fx,
            (boxes[:, 1] + (boxes[:, 3] - 1) / 2 - k.cy) * z / k.fy,
            boxes[:, 2] * z / k.fx,
            boxes[:, 3] * z / k.fy,
        )


def standing(view: DepthView, elevation: Floats | None, margin: float) -> Mask:
    """Pixels with a reading that do not belong to the floor, ``(h, w)`` bool.

    Args:
        view: the depth.
        elevation: metres above the floor, or None where no floor is known.
        margin: metres above the floor up to which a pixel counts as floor, at one metre's distance;
            it grows with the square root of depth as the sensor's noise takes its toll.
    """
    valid = view.depth > 0
    if elevation is not None:
        valid &= elevation > margin * np.sqrt(np.maximum(view.depth, 1.0))
    return valid


def surfaces_in(depth: Floats, mask: Mask, jump: float, jump_per_metre: float) -> Surfaces:
    """Label the connected pixels of ``mask`` between which depth jumps by no more than allowed.

    Args:
        depth: ``(h, w)`` float32 metres.
        mask: ``(h, w)`` bool, the pixels to label.
        jump: metres two neighbours may differ, at no distance.
        jump_per_metre: by how much that grows with each metre of depth.
    """
    limit = depth * np.float32(1 + jump_per_metre)
    limit += np.float32(jump)
    np.copyto(limit, np.float32(np.inf), where=~mask)
    # A jump takes the farther pixel away, so the nearer surface keeps its outline whole.
    keep = depth <= cv2.erode(limit, _BESIDE)
    keep &= mask
    # Diagonal neighbours across a removed pixel must not join: 4-connectivity.
    count, labels = cv2.connectedComponents(keep.view(np.uint8), connectivity=4, ltype=cv2.CV_32S)
    # By runs: OpenCV's own statistics of connected components, and the sums of depth, go from pixel
    # to pixel and take twice as long.
    width = labels.shape[1]
    flat = labels.ravel()
    ends = np.empty(flat.size, np.bool_)
    np.not_equal(flat[1:], flat[:-1], out=ends[:-1])
    ends[width - 1 :: width] = True
    stop = np.flatnonzero(ends) + 1
    start = np.concatenate(([0], stop[:-1]))
    label = flat[start]
    row, left = np.divmod(start, width)
    right = left + (stop - start)
    boxes = np.zeros((count, 4), np.int32)
    first, last = np.full(count, width), np.zeros(count, np.intp)
    np.minimum.at(first, label, left)
    np.maximum.at(last, label, right)
    boxes[:, 0], boxes[:, 2] = first, last - first
    boxes[label[::-1], 1] = row[::-1]  # rows ascend, and the last that is written stays
    boxes[label, 3] = row + 1
    boxes[:, 3] -= boxes[:, 1]
    pixels = np.bincount(label, stop - start, count).astype(np.int32)
    means = _means(depth, labels, start, pixels).astype(np.float32)
    return Surfaces(labels, boxes, pixels, means, jump, jump_per_metre, start)


def _means(
    values: Floats,
    labels: npt.NDArray[np.int32],
    runs: npt.NDArray[np.intp],
    pixels: npt.NDArray[np.int32],
) -> FloatArray:
    """See :meth:`Surfaces.means`."""
    sums = np.add.reduceat(values.ravel(), runs)
    return np.bincount(labels.ravel()[runs], sums, len(pixels)) / np.maximum(pixels, 1)
