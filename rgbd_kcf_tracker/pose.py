# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where one frame is in another."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import ParameterError

FARTHEST = 1e9
"""Metres: beyond is no frame of a robot, and what is reckoned with it overflows."""


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A frame's place in another: a point ``p`` of it is ``rotation @ p + translation`` there.

    Attributes:
        rotation: ``(3, 3)`` float64.
        translation: ``(3,)`` float64 metres.

    Raises:
        ParameterError: where the numbers are not finite or the matrix is no rotation.
    """

    rotation: npt.NDArray[np.float64]
    translation: npt.NDArray[np.float64]

    def __post_init__(self) -> None:
        rotation = np.array(self.rotation, np.float64)
        translation = np.array(self.translation, np.float64)
        if rotation.shape != (3, 3) or translation.shape != (3,):
            raise ParameterError(
                f'pose has a rotation {rotation.shape} and a translation {translation.shape}: '
                'give (3, 3) and (3,)'
            )
        if not (np.isfinite(rotation).all() and np.isfinite(translation).all()):
            raise ParameterError('pose has numbers that are not finite')
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-3 or np.linalg.det(rotation) < 0:
            raise ParameterError('pose has a matrix that is no rotation: give an orthonormal one')
        object.__setattr__(self, 'rotation', rotation)
        object.__setattr__(self, 'translation', translation)

    @classmethod
    def from_quaternion(
        cls, quaternion: tuple[float, float, float, float], translation: tuple[float, float, float]
    ) -> Pose:
        """The pose that ROS writes as a quaternion ``(x, y, z, w)`` and metres.

        Raises:
            ParameterError: where the quaternion is not of length 1, as one that was never set is,
                or the place is farther than :data:`FARTHEST`.
        """
        length = float(np.linalg.norm(quaternion))
        if not abs(length - 1.0) < 1e-2:
            raise ParameterError(
                f'quaternion {quaternion} has the length {length:g}: a rotation has 1'
            )
        if max(map(abs, translation)) > FARTHEST:
            raise ParameterError(f'translation {translation} is farther than {FARTHEST:g} m')
        x, y, z, w = (value / length for value in quaternion)
        matrix = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        return cls(np.array(matrix), np.array(translation, np.float64))

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """The rotation as ROS writes it: ``(x, y, z, w)``."""
        # By the largest of the four, which is never near zero (Shepperd 1978).
        m = self.rotation.tolist()
        trace = m[0][0] + m[1][1] + m[2][2]
        first = max(range(3), key=lambda axis: m[axis][axis])
        turned = [0.0, 0.0, 0.0, 0.0]
        if trace >= m[first][first]:
            turned[3] = 1 + trace
            for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                turned[a] = m[c][b] - m[b][c]
        else:
            second, third = (first + 1) % 3, (first + 2) % 3
            turned[first] = 1 + 2 * m[first][first] - trace
            turned[second] = m[second][first] + m[first][second]
            turned[third] = m[third][first] + m[first][third]
            turned[3] = m[third][second] - m[second][third]
        length = math.sqrt(sum(value * value for value in turned))
        x, y, z, w = (value / length for value in turned)
        return x, y, z, w

    def after(self, other: Pose) -> Pose:
        """This pose followed by another: of this frame in the one that ``other`` leads to."""
        return Pose(
            other.rotation @ self.rotation, other.rotation @ self.translation + other.translation
        )

    @property
    def inverse(self) -> Pose:
        """The other frame's place in this one."""
        return Pose(self.rotation.T, -self.rotation.T @ self.translation)

    @property
    def shift(self) -> float:
        """Metres from one frame's origin to the other's."""
        return float(np.linalg.norm(self.translation))

    @property
    def turn(self) -> float:
        """Radians between the two frames."""
        cosine = (float(np.trace(self.rotation)) - 1) / 2
        return math.acos(min(max(cosine, -1.0), 1.0))

    def of(self, points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Points of this frame in the other, ``(..., 3)`` metres."""
        moved: npt.NDArray[np.float64] = points @ self.rotation.T + self.translation
        return moved
