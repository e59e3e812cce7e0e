# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where a target that cannot be seen may be.

Particles in metres, that die where the camera sees that there is nothing.

The thesis (section 5.3) carries particles in pixels with a box; here they carry position and
velocity in metres and seconds, so that the frame rate does not matter, and the absence of the
target is evidence too: what is left lies behind something, in a hole of the depth image, or out of
view.
"""

from __future__ import annotations

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.features.sampling import effective_size, systematic_resample
from rgbd_kcf_tracker.metric.identity.person import BEYOND
from rgbd_kcf_tracker.metric.perceive.depth_view import NEAREST, DepthView
from rgbd_kcf_tracker.pose import Pose

TURN_TIME = np.array([1.2, 0.25, 1.2])
"""Seconds in which a hidden target's velocity is forgotten: it may stop or turn; up and down it
does not go on for long."""
ROAM = np.array([0.9, 0.15, 0.9])
"""Metres per second, across, down and ahead, of the velocity that comes instead: along the floor
together 1.3, nearly a walk (1.4 m/s), and hardly any up or down."""
EMPTY_TIME = 0.12
"""Seconds in which the weight of such a particle falls to a third: some frames at 30 Hz, as one may
have a wrong reading or a gap between the legs, and nearly at once at 5 Hz."""
KERNEL = 0.2
"""Metres of the kernel that makes a density of the particles: about half of a body's width, so that
some hundreds of them leave no holes where somebody may be."""


class HiddenCloud:
    """The particles of one disappearance.

    Args:
        position: ``(3,)`` metres, the reference point of the target when it was last predicted.
        velocity: ``(3,)`` metres per second.
        position_sigma: ``(3,)`` metres.
        speed_sigma: ``(3,)`` metres per second.
        count: number of particles.
        rng: source of randomness.
    """

    def __init__(
        self,
        position: FloatArray,
        velocity: FloatArray,
        position_sigma: FloatArray,
        speed_sigma: FloatArray,
        count: int,
        rng: np.random.Generator,
    ) -> None:
        self._rng = rng
        self._positions = position + position_sigma * rng.standard_normal((count, 3))
        spread = np.maximum(speed_sigma, 0.3 * ROAM)
        self._velocities = velocity + spread * rng.standard_normal((count, 3))
        self._weights = np.full(count, 1.0 / count)

    def carried(self, motion: Pose) -> None:
        """Keep the places in the world: ``motion`` is the last camera's pose in that of now."""
        self._positions = motion.of(self._positions)
        self._velocities = self._velocities @ motion.rotation.T

    def move(self, dt: float) -> None:
        """Go on by ``dt`` seconds."""
        keep = np.exp(-dt / TURN_TIME)
        noise = ROAM * np.sqrt(1 - keep**2)
        turned = noise * self._rng.standard_normal(self._velocities.shape)
        ahead = self._positions[:, 2] >= NEAREST
        # Exactly as far as what is forgotten at that rate goes, however long the step.
        self._positions += TURN_TIME * (1 - keep) * self._velocities + turned * (dt / 2)
        self._velocities *= keep
        self._velocities += turned
        # What a camera that turned away has behind it is where it is.
        z = self._positions[:, 2]
        np.maximum(z, NEAREST, out=z, where=ahead)

    def weigh(self, dt: float, view: DepthView, middle: float) -> None:
        """Weigh by what the camera sees.

        Args:
            dt: seconds for which it has seen that.
            view: the depth of now.
            middle: metres from the reference point down to the middle of the target.
        """
        self._weights *= np.where(self._seen_empty(view, middle), np.exp(-dt / EMPTY_TIME), 1.0)
        total = self._weights.sum()
        if total < 1e-12:
            self._weights[:] = 1.0 / len(self._weights)
            return
        self._weights /= total
        count = len(self._weights)
        if effective_size(self._weights) < 0.5 * count:
            kept = systematic_resample(self._weights, self._rng)
            self._positions, self._velocities = self._positions[kept], self._velocities[kept]
            self._weights = np.full(count, 1.0 / count)

    def _seen_empty(self, view: DepthView, middle: float) -> Mask:
        """Particles past which the camera sees."""
        k = view.intrinsics
        rows, cols = view.shape
        x, y, z = self._positions.T
        ahead = z >= NEAREST
        z = np.maximum(z, NEAREST)
        u = np.rint(x * k.fx / z + k.cx)
        v = np.rint((y + middle) * k.fy / z + k.cy)
        inside = ahead & (u >= 0) & (u < cols) & (v >= 0) & (v < rows)
        row, column = np.clip(v, 0, rows - 1), np.clip(u, 0, cols - 1)
        seen = view.depth[row.astype(np.intp), column.astype(np.intp)]
        empty: Mask = inside & (seen > z + BEYOND)
        return empty

    @property
    def believed(self) -> tuple[FloatArray, FloatArray]:
        """Weighted mean position, ``(3,)`` metres, and its covariance, ``(3, 3)``."""
        return self._moments(self._positions)

    @property
    def believed_velocity(self) -> tuple[FloatArray, FloatArray]:
        """Weighted mean velocity, ``(3,)`` metres per second, and its covariance, ``(3, 3)``."""
        return self._moments(self._velocities)

    def _moments(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        mean: FloatArray = self._weights @ values
        away = values - mean
        covariance: FloatArray = (self._weights[:, None] * away).T @ away
        return mean, covariance

    def distance(self, position: FloatArray, sigma: FloatArray) -> float:
        """How far a place is from where the target may be; 0 is amid all particles.

        Minus twice the log of the particles' kernel density, relative to a kernel's height.

        Args:
            position: ``(3,)`` metres.
            sigma: ``(3,)`` metres, deviation of the place itself.
        """
        width = np.square(sigma) + KERNEL**2
        exponent = -0.5 * (np.square(self._positions - position) / width).sum(axis=1)
        density = float(self._weights @ np.exp(exponent))
        return -2.0 * float(np.log(density + 1e-12))
