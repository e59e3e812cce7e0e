# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a lens does to straight lines, and how to take it out of a position."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import ParameterError

Points = npt.NDArray[np.float64]

STEPS = 12
"""Newton steps that take the lens out of a point: they double the digits, from a start within the
picture, and end early."""
EXACT = 1e-9
WRONG = 1e-4
"""Distances on the plane one metre ahead: where the steps may end, and from where on they have
found nothing (a twentieth of a pixel of a Kinect's colour camera)."""
NUDGE = 1e-6
ALONG = (0.25, 0.5, 0.75, 1.0)
"""Shares of the way to a point at which the model must not have folded."""


@dataclass(frozen=True, slots=True)
class Lens:
    """Distortion, on the plane one metre ahead of the camera.

    Attributes:
        coefficients: as OpenCV takes them: 4, 5, 8, 12 or 14 numbers (Brown's model and its
            rational extension, ``plumb_bob`` and ``rational_polynomial`` of CameraInfo), or 4 of
            the fisheye model.
        fisheye: whether they are of the fisheye model (``equidistant``).

    Raises:
        ParameterError: where they are of no such number or not finite.

    Source: the models as OpenCV's documentation of calib3d gives them.
    """

    coefficients: tuple[float, ...]
    fisheye: bool = False

    def __post_init__(self) -> None:
        counts = (4,) if self.fisheye else (4, 5, 8, 12, 14)
        if len(self.coefficients) not in counts:
            wanted = ' or '.join(str(count) for count in counts)
            raise ParameterError(
                f'a lens has {len(self.coefficients)} distortion coefficients: give {wanted}'
            )
        if not all(math.isfinite(c) for c in self.coefficients):
            raise ParameterError('a lens has distortion coefficients that are not finite')

    def bent(self, points: npt.ArrayLike) -> Points:
        """Where the lens shows points ``(n, 2)`` of the plane one metre ahead."""
        points = np.asarray(points, np.float64)
        if not len(points):
            return points.reshape(0, 2)
        if self.fisheye:
            radius = np.maximum(np.hypot(points[:, 0], points[:, 1]), 1e-12)
            angle = np.arctan(radius)
            k1, k2, k3, k4 = self.coefficients
            square = angle * angle
            power = 1 + square * (k1 + square * (k2 + square * (k3 + square * k4)))
            result: Points = points * (angle * power / radius)[:, None]
            return result
        ahead = np.column_stack([points, np.ones(len(points))])
        still = np.zeros(3)
        shown, _ = cv2.projectPoints(ahead, still, still, np.eye(3), np.array(self.coefficients))
        return np.asarray(shown, np.float64).reshape(-1, 2)

    def straightened(self, points: npt.ArrayLike) -> Points:
        """The points ``(n, 2)`` that the lens shows at these; NaN where it shows none there."""
        points = np.asarray(points, np.float64)
        if not len(points):
            return points.reshape(0, 2)
        found = self._guessed(points)
        with np.errstate(all='ignore'):
            for _ in range(STEPS):
                lack = points - self.bent(found)
                if np.nanmax(np.abs(lack), initial=0.0) < EXACT:
                    break
                a, b, c, d = self._slopes(found)
                area = a * d - b * c
                step = np.column_stack([d * lack[:, 0] - b * lack[:, 1],
                                        a * lack[:, 1] - c * lack[:, 0]])  # fmt: skip
                found = found + step / area[:, None]
            good = np.abs(points - self.bent(found)).max(axis=1) < WRONG
            # Beyond where the model folds back it shows another point at the same place.
            for share in ALONG:
                a, b, c, d = self._slopes(share * found)
                good &= a * d - b * c > 0
        return np.where(good[:, None], found, np.nan)

    def _guessed(self, points: Points) -> Points:
        shown = points[:, None, :]
        coefficients = np.array(self.coefficients)
        if self.fisheye:
            found = cv2.fisheye.undistortPoints(shown, np.eye(3), coefficients)
        else:
            found = cv2.undistortPoints(shown, np.eye(3), coefficients)
        result = np.asarray(found, np.float64).reshape(-1, 2)
        return np.where(np.isfinite(result), result, points)

    def _slopes(self, points: Points) -> tuple[Points, Points, Points, Points]:
        """Derivatives of :meth:`bent`: of x by x and y, of y by x and y."""
        x, y = np.array([NUDGE, 0.0]), np.array([0.0, NUDGE])
        by_x = (self.bent(points + x) - self.bent(points - x)) / (2 * NUDGE)
        by_y = (self.bent(points + y) - self.bent(points - y)) / (2 * NUDGE)
        return by_x[:, 0], by_y[:, 0], by_x[:, 1], by_y[:, 1]
