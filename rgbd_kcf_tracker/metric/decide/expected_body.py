# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""All of a body where it is expected, and how much of it the camera should see there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Floats
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.perceive.depth_view import NEAREST, DepthView, part_in
from rgbd_kcf_tracker.metric.perceive.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class ExpectedBody:
    """A body, of which something may hide a part.

    Attributes:
        position: of the middle of its upper edge, ``(3,)`` metres in the camera's frame.
        width, height: of all of it, metres.
    """

    position: FloatArray
    width: float
    height: float

    def sides(self, view: DepthView) -> tuple[float, float, float, float]:
        """Left, top, right, bottom in pixels of the view."""
        x, y, z = self.position.tolist()
        half = self.width / 2
        return (*view.place(x - half, y, z), *view.place(x + half, y + self.height, z))

    def _inside(self, scene: Scene) -> tuple[Floats, float]:
        """Depth where it is expected, and the pixels it would have if none were outside."""
        box = self.box(scene.view)
        if box is None:
            return np.zeros((0, 0), np.float32), 1.0
        shown = box.over(scene.view.step)
        return scene.view.depth[part_in(scene.view.shape, shown)], max(1.0, shown.area)

    def visible(self, scene: Scene) -> float:
        """Share of it that nothing nearer, no hole and no image edge hides."""
        depth, total = self._inside(scene)
        return np.count_nonzero(depth > self.position[2] - 0.15) / total

    def outside(self, scene: Scene) -> float:
        """Share of it that lies beyond the left and right edges of the image."""
        if self.position[2] < NEAREST:
            return 1.0
        left, _, right, _ = self.sides(scene.view)
        first, last = scene.rim.left, scene.view.shape[1] - scene.rim.right
        inside = min(right, last) - max(left, first)
        return min(max(1.0 - inside / max(right - left, 1.0), 0.0), 1.0)

    def unread(self, scene: Scene) -> float:
        """Share of it, as far as it lies in the image, that has no reading."""
        depth, total = self._inside(scene)
        if depth.size < 0.2 * total:
            return 0.0
        return 1.0 - np.count_nonzero(depth) / depth.size

    def as_deep(self, scene: Scene) -> float:
        """Share of it where something is as far off, by less than the step between two surfaces."""
        depth, total = self._inside(scene)
        z = float(self.position[2])
        step = scene.surfaces.jump + scene.surfaces.jump_per_metre * z
        return np.count_nonzero(np.abs(depth - z) < step) / total

    def box(self, view: DepthView) -> Box | None:
        """The box about it in pixels of the image; None where it is too near to have one."""
        if self.position[2] < NEAREST:
            return None
        left, top, right, bottom = (v * view.step for v in self.sides(view))
        return Box.from_corners(left, top, max(right, left + 1), max(bottom, top + 1))
