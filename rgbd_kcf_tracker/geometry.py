# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Boxes and the pinhole camera: the two pieces of geometry that everything else speaks in."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from rgbd_kcf_tracker.errors import BoxError, ParameterError

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from rgbd_kcf_tracker.lens import Lens


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
                raise BoxError(f'box {name} is {value}: it must be finite')
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

    def over(self, step: float) -> Box:
        """The box in an image of which every ``step``-th pixel is taken."""
        return Box(self.x / step, self.y / step, self.width / step, self.height / step)

    def stretched(self, across: float, down: float) -> Box:
        """The box in the same image when that has become wider and higher by these factors."""
        return Box(self.x * across, self.y * down, self.width * across, self.height * down)

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
        union = self.area + other.area - common
        return common / union if union > 0 else 0.0

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


def mask_box(mask: npt.NDArray[np.bool_]) -> Box | None:
    """The smallest box around the set pixels of ``(h, w)`` bool; None where there are none."""
    (rows,), (cols,) = mask.any(axis=1).nonzero(), mask.any(axis=0).nonzero()
    if rows.size == 0:
        return None
    return Box.from_corners(float(cols[0]), float(rows[0]), cols[-1] + 1.0, rows[-1] + 1.0)


CAMERA_PX = (1e-3, 1e7)
"""Least and largest focal length, and largest principal point, in pixels, that a camera may state:
a thousandth of what an image of one pixel has, and a hundred times the longest lens's."""
RECKONABLE_PX = (1e-6, 1e10)
"""The same of any :class:`Intrinsics`, those of reduced images too: beyond, squares and quotients
in metres leave the numbers."""


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole camera: focal lengths and principal point in pixels, and its lens.

    The camera frame is the optical one of REP-103: z forward, x right, y down. What looks at
    surfaces may leave the lens out; what tells a position in metres must not.

    Attributes:
        fx, fy, cx, cy: pixels; pixel 0 has its middle at 0.
        lens: of a picture that was not rectified; None for one without distortion.

    Raises:
        ParameterError: where a value is not within :data:`RECKONABLE_PX`.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    lens: Lens | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        for name in ('fx', 'fy', 'cx', 'cy'):
            value = float(getattr(self, name))
            if not abs(value) <= RECKONABLE_PX[1]:
                raise ParameterError(
                    f'intrinsics {name} is {value:g}: give pixels, {RECKONABLE_PX[1]:g} at most'
                )
            object.__setattr__(self, name, value)
        if min(self.fx, self.fy) < RECKONABLE_PX[0]:
            raise ParameterError(
                f'intrinsics fx={self.fx:g} fy={self.fy:g}: focal lengths must be '
                f'{RECKONABLE_PX[0]:g} pixels or more'
            )

    @classmethod
    def guess(cls, width: int, height: int) -> Intrinsics:
        """A camera of 60 degrees across, for where none is known (Kinect class: 57 to 70)."""
        focal = width / (2 * math.tan(math.radians(30)))
        return cls(focal, focal, (width - 1) / 2, (height - 1) / 2)

    def project(self, x: float, y: float, z: float) -> tuple[float, float]:
        """Pixel of a point in metres, ``z > 0``.

        Far aside, where a lens shows nothing, its model may fold back into the picture.
        """
        across, down = x / z, y / z
        if self.lens is not None:
            across, down = (float(v) for v in self.lens.bent([(across, down)])[0])
        return self.fx * across + self.cx, self.fy * down + self.cy

    def deproject(self, u: float, v: float, z: float) -> tuple[float, float, float]:
        """Point in metres of pixel ``u, v`` at depth ``z``; NaN where the lens shows nothing."""
        if self.lens is None:
            return (u - self.cx) * z / self.fx, (v - self.cy) * z / self.fy, z
        shown = (u - self.cx) / self.fx, (v - self.cy) / self.fy
        across, down = (float(value) for value in self.lens.straightened([shown])[0])
        return across * z, down * z, z
