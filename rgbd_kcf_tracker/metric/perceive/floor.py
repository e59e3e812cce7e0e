# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The floor, found in a depth image, so that what stands on it comes apart from it.

Along a plane the inverse of depth is affine in the pixel: ``1/z = a u + b v + c``. The floor is the
plane below the camera under which (almost) nothing lies.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray, Floats
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.ego_motion import Lost
from rgbd_kcf_tracker.pose import Pose

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
STRIDE = 3
"""Pixels of the view between two readings on which planes are judged, in its lower two thirds: some
three thousand in all. With 600 drawn by chance the height of a camera that stood still came out up
to 8 cm apart from frame to frame (`group_cam2`), with these 3 cm."""
LEAST = 60
"""Readings from which a plane is looked for: a fiftieth of those."""
REACH = 4
"""Pixels of the view to each side over which a surface's slope is measured: at 4 m its noise is
some degrees, and the gap between two desks shows several of such windows."""
EVEN = 0.02
"""Bend of a surface within that reach, relative to its depth, up to which it is even: as sloped as
a floor is, twice the noise at 4 m."""
TRIALS = 96
"""Slopes that are tried as planes: where even a twentieth of those that may be a floor's are, five
are among them. Where none is found it is tried again some frames later."""
CLOSER = (1.0, 0.7, 0.5)
"""Rounds of fitting, and the noise up to which a reading lies on the floor in each: the lowest few
centimetres of a wall or a chair leg are on it in the first, and would tilt it."""
PASSES = 1.2
"""Seconds for which a floor is kept of which too little shows: somebody passes near the camera in
one. Kept for good, a worktop was the floor of a kitchen (`redkitchen`), and things on it were lost.
"""
BEST = 5
"""Planes that are fitted again, the best first, until one passes."""
SEARCH_AGAIN = 0.2
"""Seconds after which a floor is looked for again where none was found, as a hundred planes are
tried: in less time a camera has seen little new."""


@dataclass(frozen=True, slots=True)
class Floor:
    """A plane in a view: ``1/z = a u + b v + c`` with the camera ``height`` metres above it.

    ``tilt`` is the sine of the angle by which the camera looks down.
    """

    a: float
    b: float
    c: float
    height: float
    tilt: float

    def elevation(self, depth: Floats) -> Floats:
        """Metres above the floor of each pixel, ``(h, w)`` float32; ``height`` where depth is 0."""
        h, w = depth.shape
        rows = np.arange(h, dtype=np.float32)[:, None] * np.float32(self.b)
        columns = np.arange(w, dtype=np.float32)[None, :] * np.float32(self.a) + np.float32(self.c)
        above: Floats = rows + columns
        above *= depth
        np.subtract(np.float32(1.0), above, out=above)
        above *= np.float32(self.height)
        return above

    def forward(self, depth: Floats, elevation: Floats) -> Floats:
        """Metres from the camera along the floor of each pixel, ``(h, w)`` float32.

        Of an upright body it is the same from head to feet, which depth is not where the camera
        looks down.
        """
        ahead: Floats = elevation - np.float32(self.height)
        ahead *= np.float32(self.tilt)
        ahead += depth
        ahead *= np.float32(1 / np.sqrt(1 - self.tilt**2))
        return ahead

    @classmethod
    def of(cls, plane: FloatArray, k: Intrinsics) -> Floor | None:
        """The floor with ``a, b, c``, ``(3,)``; None where none can be there."""
        height = float(_heights(plane[None], k)[0])
        if math.isnan(height):
            return None
        a, b, c = plane.tolist()
        return cls(a, b, c, height, (c + a * k.cx + b * k.cy) * height)

    def plane(self, k: Intrinsics) -> FloatArray:
        """The numbers ``(3,)`` with which ``plane @ p = 1`` on the floor, in the camera's frame."""
        return np.array([self.a * k.fx, self.b * k.fy, self.c + self.a * k.cx + self.b * k.cy])

    def carried(self, motion: Pose, k: Intrinsics) -> Floor | None:
        """The floor as a camera shows it that has moved, None where none can be for it.

        Args:
            motion: the pose of the last camera's frame in that of now.
            k: of the view.
        """
        turned = motion.rotation @ self.plane(k)
        above = float(1 + turned @ motion.translation)  # in camera heights
        if above <= 0:
            return None
        x, y, z = (turned / above).tolist()
        a, b = x / k.fx, y / k.fy
        return self.of(np.array([a, b, z - a * k.cx - b * k.cy]), k)

    def axes(self, k: Intrinsics) -> FloatArray:
        """Unit vectors along the floor, ``(2, 3)`` in the camera's frame: to the right, and ahead.

        They are at right angles to each other however the camera rolls.
        """
        x, y, z = (self.height * self.plane(k)).tolist()
        # Ahead is the optical axis without what of it points down, and right is at right angles.
        ahead = (-z * x, -z * y, 1 - z * z)
        length = math.sqrt(ahead[0] ** 2 + ahead[1] ** 2 + ahead[2] ** 2)
        i, j, m = (each / length for each in ahead)
        return np.array([[y * m - z * j, z * i - x * m, x * j - y * i], [i, j, m]])

    def row_at(self, u: float, z: float) -> float:
        """Row in which the floor is seen in column ``u`` at depth ``z``."""
        return (1.0 / z - self.c - self.a * u) / self.b


def _heights(planes: FloatArray, k: Intrinsics) -> FloatArray:
    """Distance of the camera from planes ``(n, 3)``, NaN where no floor can be there, ``(n,)``."""
    a, b, c = planes.T
    across, down = a * k.fx, b * k.fy
    length = np.sqrt(across**2 + down**2 + (c + a * k.cx + b * k.cy) ** 2)
    least, most = (1 / height for height in reversed(CAMERA_HEIGHT))
    floor = (length > least) & (length < most) & (down > MIN_UPRIGHT * length)
    return np.where(floor, 1 / np.where(floor, length, 1.0), np.nan)


class FloorFinder:
    """Finds the floor by consensus, then follows it from frame to frame by least squares.

    Where furniture leaves little of it, three readings drawn by chance are hardly ever all of the
    floor. One is enough where the slope about it is known: each even patch is a plane to be tried.
    """

    def __init__(self) -> None:
        self._floor: Floor | None = None
        self._wait = 0.0
        self._hidden = 0.0

    def update(
        self,
        view: DepthView,
        seconds: float = 0.0,
        learns: bool = True,
        motion: Pose | Lost | None = None,
    ) -> Floor | None:
        """The floor of this view, or None where no plane passes for one.

        A floor that is known is where it was, however little of it shows, for as long as somebody
        passes and it is known how the camera has moved.

        Args:
            view: the depth.
            seconds: since the last view.
            learns: whether a floor that is known is fitted again.
            motion: the pose of the last view's camera in that of now; None where it stood still.
        """
        self._hidden = math.inf if isinstance(motion, Lost) else self._hidden + seconds
        if isinstance(motion, Pose) and self._floor is not None:
            self._floor = self._floor.carried(motion, view.intrinsics)
        if self._floor is not None and not learns and not isinstance(motion, Lost):
            return self._floor
        h = view.shape[0]
        top = h // 3 + REACH
        here, above, below = (
            _inverse(view, top + off, max(h - REACH + off, 0)) for off in (0, -REACH, REACH)
        )
        # Where a surface is even, its inverse depth rises by the same to both sides: along the foot
        # of a wall or a chair it does not, and the floor would be tilted by what stands on it.
        even = ~(np.abs(above + below - 2 * here) >= EVEN * here)
        v, u = np.nonzero(even & (here > 0))
        if len(v) < LEAST:
            if self._hidden > PASSES:
                self._floor = None
            return self._floor
        z = 1 / here[v, u].astype(np.float64)
        v, u = top + STRIDE * v, REACH + STRIDE * u
        points: FloatArray = np.stack((u, v, np.ones(len(z))), axis=1)
        # In terms of these the distance from a plane is 1 - rays @ plane, in camera heights.
        rays: FloatArray = points * z[:, None]
        if self._floor is not None:
            known = self._floor
            plane = np.array([known.a, known.b, known.c])
            self._floor = self._refined(plane, rays, z, view.intrinsics)
            if self._floor is not None:
                self._hidden = 0.0
            elif self._hidden <= PASSES:
                under = known.height * (1.0 - rays @ plane) < BELOW * _noise(z)
                if np.count_nonzero(under) < MIN_SHARE * len(z):
                    self._floor = known
            if self._floor is not None:
                return self._floor
        self._wait -= seconds
        if self._wait > 0:
            return None
        self._floor = self._searched(view, u, v, rays)
        self._hidden = 0.0
        if self._floor is None:
            self._wait = SEARCH_AGAIN
        return self._floor

    def _searched(
        self, view: DepthView, u: npt.NDArray[np.intp], v: npt.NDArray[np.intp], rays: FloatArray
    ) -> Floor | None:
        k, z = view.intrinsics, rays[:, 2]
        inverse = np.full(view.shape, np.nan)
        np.divide(1, view.depth, out=inverse, where=view.depth > 0)
        a = (inverse[v, u + REACH] - inverse[v, u - REACH]) / (2 * REACH)
        b = (inverse[v + REACH, u] - inverse[v - REACH, u]) / (2 * REACH)
        planes = np.stack((a, b, 1 / z - a * u - b * v), axis=1)
        heights = _heights(planes, k)
        found = np.flatnonzero(np.isfinite(heights))
        if not len(found):
            return None
        found = found[np.unique(np.linspace(0, len(found) - 1, TRIALS).astype(np.intp))]
        planes, heights = planes[found], heights[found]
        off = heights[:, None] * (1.0 - planes @ rays.T)
        width = _noise(z)
        on = (np.abs(off) < width).mean(axis=1)
        under = (off < BELOW * width).mean(axis=1)
        score = on - 2.0 * under
        for best in np.argsort(-score)[:BEST]:
            floor = self._refined(planes[best], rays, z, k)
            if floor is not None:
                return floor
        return None

    def _refined(
        self, plane: FloatArray, rays: FloatArray, z: FloatArray, k: Intrinsics
    ) -> Floor | None:
        """The plane fitted again to what lies on it, or None where too little does."""
        width = _noise(z)
        for closer in CLOSER:
            above = _heights(plane[None], k)[0] * (1.0 - rays @ plane)
            on = np.abs(above) < closer * width  # nowhere where the plane is no floor
            count = np.count_nonzero(on)
            if closer == 1:
                under = np.count_nonzero(above < BELOW * width)
                if count < MIN_SHARE * len(z) or under > 0.5 * count:
                    return None
            # Weighted by depth, so that the fit is in metres rather than in inverse metres.
            a = rays[on]
            plane = np.linalg.solve(a.T @ a + 1e-9 * np.eye(3), a.sum(axis=0))
        return Floor.of(plane, k)


def _inverse(view: DepthView, first: int, end: int) -> Floats:
    """Inverse depth of every few pixels of some rows, NaN where there is no reading."""
    depth = view.depth[first:end:STRIDE, REACH : max(view.shape[1] - REACH, 0) : STRIDE]
    return np.divide(1, depth, out=np.full_like(depth, np.nan), where=depth > 0)


def _noise(z: FloatArray) -> FloatArray:
    """Metres by which readings of the floor lie beside it, ``(n,)``: of a Kinect, seen flat."""
    return 0.02 + 0.012 * z
