# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Boxes and the pinhole camera: the two pieces of geometry that everything else speaks in."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rgbd_kcf_tracker.errors import BoxError, ParameterError

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


@dataclass(frozen=True, slots=True)
class Box:
    """An axis-aligned box in pixels of the colour image.

    ``x, y`` is the top-left corner, 0-based; the box covers ``[x, x + width)`` by
    ``[y, y + height)``. All four are floats. The box may lie partly or wholly outside the image.

    Raises:
        BoxError: where a value is not finite, or width or height is not positive.
    """

    x: float
    y: float
    width: float
    height: float

    def __post_init__(self) -> None:
        for name in ('x', 'y', 'width', 'height'):
            value = float(getattr(self, name))
            if not math.isfinite(value):
                raise BoxError(f'box {name} is {value}: give four finite numbers x,y,width,height')
            object.__setattr__(self, name, value)
        if self.width <= 0 or self.height <= 0:
            raise BoxError(
                f'box {self.width:g} x {self.height:g} has no size: '
                'width and height must be above 0'
            )

    @classmethod
    def from_center(cls, cx: float, cy: float, width: float, height: float) -> Box:
        """The box of that size whose centre is ``cx, cy``."""
        return cls(cx - width / 2, cy - height / 2, width, height)

    @classmethod
    def from_corners(cls, left: float, top: float, right: float, bottom: float) -> Box:
        """The box between two corners, right and bottom exclusive."""
        return cls(left, top, right - left, bottom - top)

    @property
    def cx(self) -> float:
        """Column of the centre."""
        return self.x + self.width / 2

    @property
    def cy(self) -> float:
        """Row of the centre."""
        return self.y + self.height / 2

    @property
    def right(self) -> float:
        """Column just past the box."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """Row just past the box."""
        return self.y + self.height

    @property
    def area(self) -> float:
        """Width times height, in square pixels."""
        return self.width * self.height

    def scaled(self, factor: float) -> Box:
        """The box about the same centre with both sides times ``factor``."""
        return Box.from_center(self.cx, self.cy, self.width * factor, self.height * factor)

    def moved(self, dx: float, dy: float) -> Box:
        """The box shifted by ``dx, dy`` pixels."""
        return Box(self.x + dx, self.y + dy, self.width, self.height)

    def intersection(self, other: Box) -> float:
        """Area that both boxes cover, in square pixels."""
        w = min(self.right, other.right) - max(self.x, other.x)
        h = min(self.bottom, other.bottom) - max(self.y, other.y)
        return max(w, 0.0) * max(h, 0.0)

    def iou(self, other: Box) -> float:
        """Intersection over union, 0 to 1."""
        common = self.intersection(other)
        return common / (self.area + other.area - common)

    def clipped(self, width: int, height: int) -> Box | None:
        """The part inside a ``width`` x ``height`` image, or None where no part is inside."""
        left, top = max(self.x, 0.0), max(self.y, 0.0)
        right, bottom = min(self.right, float(width)), min(self.bottom, float(height))
        if right <= left or bottom <= top:
            return None
        return Box.from_corners(left, top, right, bottom)

    def as_tuple(self) -> tuple[float, float, float, float]:
        """``(x, y, width, height)``."""
        return self.x, self.y, self.width, self.height


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole camera without distortion: focal lengths and principal point in pixels.

    The camera frame is the optical one of REP-103: z forward, x right, y down.

    Raises:
        ParameterError: where a value is not finite or a focal length is not positive.
    """

    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        for name in ('fx', 'fy', 'cx', 'cy'):
            value = float(getattr(self, name))
            if not math.isfinite(value):
                raise ParameterError(f'intrinsics {name} is {value}: give finite pixels')
            object.__setattr__(self, name, value)
        if self.fx <= 0 or self.fy <= 0:
            raise ParameterError(
                f'intrinsics fx={self.fx:g} fy={self.fy:g}: focal lengths must be above 0'
            )

    @classmethod
    def guess(cls, width: int, height: int) -> Intrinsics:
        """A camera of 60 degrees across, for where none is known (Kinect class: 57 to 70)."""
        focal = width / (2 * math.tan(math.radians(30)))
        return cls(focal, focal, (width - 1) / 2, (height - 1) / 2)

    def project(self, x: float, y: float, z: float) -> tuple[float, float]:
        """Pixel of a point in metres, ``z > 0``."""
        return self.fx * x / z + self.cx, self.fy * y / z + self.cy

    def deproject(self, u: float, v: float, z: float) -> tuple[float, float, float]:
        """Point in metres of pixel ``u, v`` at depth ``z``."""
        return (u - self.cx) * z / self.fx, (v - self.cy) * z / self.fy, z


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
        import numpy as np  # boxes are read by commands that start without it

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

    def after(self, other: Pose) -> Pose:
        """This pose followed by another: of this frame in the one that ``other`` leads to."""
        return Pose(
            other.rotation @ self.rotation, other.rotation @ self.translation + other.translation
        )

    @property
    def inverse(self) -> Pose:
        """The other frame's place in this one."""
        return Pose(self.rotation.T, -self.rotation.T @ self.translation)

    def of(self, points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Points of this frame in the other, ``(..., 3)`` metres."""
        moved: npt.NDArray[np.float64] = points @ self.rotation.T + self.translation
        return moved
