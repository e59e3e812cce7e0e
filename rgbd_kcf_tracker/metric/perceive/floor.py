# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The floor, found in a depth image, so that what stands on it comes apart from it.

Along a plane the inverse of depth is affine in the pixel: ``1/z = a u + b v + c``. The floor is the
plane below the camera under which (almost) nothing lies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView

MIN_UPRIGHT = 0.75
"""Cosine of the largest tilt between the camera's down axis and the floor's normal: 41 degrees,
steeper than a robot or a wall's camera looks that sees somebody from head to foot, and far from any
wall's 90."""
CAMERA_HEIGHT = (0.25, 3.5)
"""Metres the camera may stand above the floor: from a small robot's to one under a high ceiling."""
MIN_SHARE = 0.06
"""Least share of the sampled pixels that must lie on the floor: as little as shows between
furniture and people."""
BELOW = -2.5
"""Elevation, in units of the readings' noise, from which something lies below the floor: by chance
hardly a reading in a hundred does."""
TRIALS = 96
"""Planes through three readings that are tried: where a third of the readings are of the floor, all
three of one of them are with a probability of 97 %. Where none is found it is tried again some
frames later."""
SAMPLES = 600
"""Readings, of the lower two thirds of the view, on which planes are judged: the share of those on
a floor that just passes, :data:`MIN_SHARE`, is then known to one in a hundred. All of them would
cost some forty times as much."""


@dataclass(frozen=True, slots=True)
class Floor:
    """A plane in a view: ``1/z = a u + b v + c`` with the camera ``height`` metres above it.

    ``tilt`` is the sine of the angle by which the camera looks down.
    """

    a: float
    b: float
    c: float
    height: float
    tilt: float = 0.0

    def elevation(self, depth: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Metres above the floor of each pixel, ``(h, w)`` float32; ``height`` where depth is 0."""
        h, w = depth.shape
        rows = np.arange(h, dtype=np.float32)[:, None] * np.float32(self.b)
        columns = np.arange(w, dtype=np.float32)[None, :] * np.float32(self.a) + np.float32(self.c)
        above: npt.NDArray[np.float32] = rows + columns
        above *= depth
        np.subtract(np.float32(1.0), above, out=above)
        above *= np.float32(self.height)
        return above

    def forward(
        self, depth: npt.NDArray[np.float32], elevation: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.float32]:
        """Metres from the camera along the floor of each pixel, ``(h, w)`` float32.

        Of an upright body it is the same from head to feet, which depth is not where the camera
        looks down.
        """
        ahead: npt.NDArray[np.float32] = elevation - np.float32(self.height)
        ahead *= np.float32(self.tilt)
        ahead += depth
        ahead *= np.float32(1 / np.sqrt(1 - self.tilt**2))
        return ahead

    def ahead(self, k: Intrinsics) -> npt.NDArray[np.float64]:
        """Unit vector along the floor away from the camera, ``(3,)`` in the camera's frame."""
        down = np.array([self.a * k.fx, self.b * k.fy, self.c + self.a * k.cx + self.b * k.cy])
        down *= self.height
        level = np.array([0.0, 0.0, 1.0]) - down[2] * down
        return np.asarray(level / np.linalg.norm(level))

    def row_at(self, u: float, z: float) -> float:
        """Row in which the floor is seen in column ``u`` at depth ``z``."""
        return (1.0 / z - self.c - self.a * u) / self.b


def _height(plane: Sequence[float], k: Intrinsics) -> float:
    """Distance of the camera from a plane ``a, b, c``; NaN where no floor can be there."""
    a, b, c = plane
    across, down = a * k.fx, b * k.fy
    length = math.hypot(across, down, c + a * k.cx + b * k.cy)
    if length == 0 or down / length <= MIN_UPRIGHT:
        return math.nan
    return 1 / length if CAMERA_HEIGHT[0] < 1 / length < CAMERA_HEIGHT[1] else math.nan


class FloorFinder:
    """Finds the floor by sample consensus, then follows it from frame to frame by least squares."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._floor: Floor | None = None
        self._wait = 0

    def update(self, view: DepthView, learns: bool = True) -> Floor | None:
        """The floor of this view, or None where no plane passes for one.

        Args:
            view: the depth.
            learns: whether a floor that is known is fitted again.
        """
        if self._floor is not None and not learns:
            return self._floor
        h, w = view.shape
        flat = view.depth.reshape(-1)
        start = (h // 3) * w
        index = start + self._rng.integers(0, h * w - start, SAMPLES)
        z = flat[index].astype(np.float64)
        valid = z > 0
        index, z = index[valid], z[valid]
        if len(z) < 60:
            self._floor = None
            return None
        points: FloatArray = np.stack((index % w, index // w, np.ones(len(z))), axis=1)
        # In terms of these the distance from a plane is 1 - rays @ plane, in camera heights.
        rays: FloatArray = points * z[:, None]
        if self._floor is not None:
            f = self._floor
            self._floor = self._refined(np.array([f.a, f.b, f.c]), rays, z, view.intrinsics)
            if self._floor is not None:
                return self._floor
        if self._wait > 0:
            self._wait -= 1
            return None
        self._floor = self._searched(points, rays, z, view.intrinsics)
        if self._floor is None:
            self._wait = 5
        return self._floor

    def _searched(
        self, points: FloatArray, rays: FloatArray, z: FloatArray, k: Intrinsics
    ) -> Floor | None:
        triples = self._rng.integers(0, len(z), (TRIALS, 3))
        matrices = points[triples]
        regular = np.abs(np.linalg.det(matrices)) > 50.0
        if not regular.any():
            return None
        inverse = 1.0 / z[triples[regular]]
        planes = np.linalg.solve(matrices[regular], inverse[:, :, None])[:, :, 0]
        heights = np.array([_height(plane, k) for plane in planes.tolist()])
        planes = planes[np.isfinite(heights)]
        heights = heights[np.isfinite(heights)]
        if not len(planes):
            return None
        above = heights[:, None] * (1.0 - planes @ rays.T)
        width = _noise(z)
        on = (np.abs(above) < width).mean(axis=1)
        below = (above < BELOW * width).mean(axis=1)
        score = on - 2.0 * below
        best = int(np.argmax(score))
        if score[best] < MIN_SHARE:
            return None
        return self._refined(planes[best], rays, z, k)

    def _refined(
        self, plane: FloatArray, rays: FloatArray, z: FloatArray, k: Intrinsics
    ) -> Floor | None:
        """The plane fitted again to what lies on it, or None where too little does."""
        width = _noise(z)
        for _ in range(2):
            above = _height(plane.tolist(), k) * (1.0 - rays @ plane)
            on = np.abs(above) < width  # nowhere where the plane is no floor
            count = np.count_nonzero(on)
            if count < MIN_SHARE * len(z) or np.count_nonzero(above < BELOW * width) > 0.5 * count:
                return None
            # Weighted by depth, so that the fit is in metres rather than in inverse metres.
            a = rays[on]
            plane = np.linalg.solve(a.T @ a + 1e-9 * np.eye(3), a.sum(axis=0))
        height = _height(plane.tolist(), k)
        if math.isnan(height):
            return None
        a, b, c = plane.tolist()
        return Floor(a, b, c, height, (c + a * k.cx + b * k.cy) * height)


def _noise(z: FloatArray) -> FloatArray:
    """Metres by which readings of the floor lie beside it, ``(n,)``."""
    return 0.02 + 0.012 * z
