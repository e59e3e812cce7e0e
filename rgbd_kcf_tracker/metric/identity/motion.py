# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where a target in metres goes next: constant velocity with white-noise acceleration."""

from __future__ import annotations

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.pose import Pose


class MotionFilter:
    """A Kalman filter over position and velocity in metres and seconds, axis by axis.

    The three axes do not mix (the noise is isotropic enough), so the covariance is three 2 x 2
    matrices rather than one of 6 x 6.

    Args:
        position: ``(3,)`` metres.
        position_sigma: metres, one for all axes or ``(3,)``.
        speed_sigma: metres per second, likewise, of the unknown first velocity.
        acceleration: metres per second squared, likewise, of the process noise.
    """

    def __init__(
        self,
        position: FloatArray,
        position_sigma: float | FloatArray,
        speed_sigma: float | FloatArray,
        acceleration: float | FloatArray,
    ) -> None:
        self.position = np.array(position, dtype=np.float64)
        self.velocity = np.zeros(3)
        self._p00 = np.square(np.full(3, position_sigma, dtype=np.float64))
        self._p01 = np.zeros(3)
        self._p11 = np.square(np.full(3, speed_sigma, dtype=np.float64))
        self._noise = np.square(np.full(3, acceleration, dtype=np.float64))

    @property
    def sigma(self) -> FloatArray:
        """Standard deviation of the position, ``(3,)`` metres."""
        return np.sqrt(self._p00)

    @property
    def speed_sigma(self) -> FloatArray:
        """Standard deviation of the velocity, ``(3,)`` metres per second."""
        return np.sqrt(self._p11)

    def predict(self, dt: float, noise: float = 1.0) -> None:
        """Move on by ``dt`` seconds, with ``noise`` times the acceleration."""
        q = self._noise * (noise**2 * dt**2)
        self.position = self.position + self.velocity * dt
        self._p00 = self._p00 + (2 * dt) * self._p01 + (dt * dt) * self._p11 + q * (dt**2 / 4)
        self._p01 = self._p01 + dt * self._p11 + q * (dt / 2)
        self._p11 = self._p11 + q

    def carried(self, motion: Pose) -> None:
        """Keep the place in the world: ``motion`` is the last camera's pose in that of now."""
        self.position = motion.of(self.position)
        self.velocity = motion.rotation @ self.velocity

    def correct(self, position: FloatArray, sigma: FloatArray) -> None:
        """Take a measured position, ``(3,)`` metres, each axis with its own deviation."""
        innovation = position - self.position
        total = self._p00 + sigma**2
        gain0, gain1 = self._p00 / total, self._p01 / total
        self.position = self.position + gain0 * innovation
        self.velocity = self.velocity + gain1 * innovation
        p01 = self._p01
        self._p00 = (1 - gain0) * self._p00
        self._p11 = self._p11 - gain1 * p01
        self._p01 = (1 - gain0) * p01
