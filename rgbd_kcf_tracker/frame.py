# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One moment of the camera: what a source makes and a tracker takes."""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import ImageError
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.pose import Pose

NEAREST_M, FARTHEST_M = (float(np.float32(mm) * np.float32(0.001)) for mm in (1, 65535))
"""The least and the most metres that are a reading: what 16 bits of millimetres can say, as which
most cameras send depth. Float depth of a damaged message, of other units or of another byte order
says anything, up to 3e38."""


def is_reading(depth: npt.NDArray[np.float32]) -> npt.NDArray[np.bool_]:
    """Which pixels of a depth image, or of a part of it, are readings.

    Args:
        depth: float32 metres of any shape; NaN, infinity and whatever else it may hold are none.
    """
    with np.errstate(invalid='ignore'):  # a signalling NaN
        good: npt.NDArray[np.bool_] = depth >= np.float32(NEAREST_M)
        good &= depth <= np.float32(FARTHEST_M)
    return good


def _plain(image: npt.NDArray[Any], name: str, nothing: np.generic) -> npt.NDArray[Any]:
    """An image as an array that is of no other kind, with ``nothing`` where it is masked."""
    if type(image) is np.ndarray:
        return image
    if isinstance(image, np.ma.MaskedArray):
        filled: npt.NDArray[Any] = image.filled(nothing) if image.dtype == nothing.dtype else image
        return np.asarray(filled)
    if isinstance(image, np.ndarray):
        return np.asarray(image)
    if not hasattr(image, 'ndim'):
        raise ImageError(f'{name} image is a {type(image).__name__}: give an array')
    return image  # one that is only read where it is looked at


def unregistered(depth: tuple[int, ...], color: tuple[int, int]) -> str:
    """What is wrong where depth and colour have different sizes, ``(width, height)`` each."""
    return (
        f'depth is {depth[0]}x{depth[1]} but colour is {color[0]}x{color[1]}: '
        'register the depth to the colour image first'
    )


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Colour, registered depth, stamp and camera of one moment.

    Attributes:
        color: ``(H, W, 3)`` uint8, BGR.
        depth: ``(H, W)`` float32 metres along the optical axis, registered to ``color``, NaN where
            there is no reading; None where the camera gave no depth for this moment. What
            :func:`is_reading` refuses counts as no reading.
        stamp_ns: time of exposure in whole nanoseconds.
        intrinsics: of the colour image, or None where unknown.
        pose: of the camera's optical frame in a fixed frame, or None where unknown.
        camera: its name, where there are several.

    Raises:
        ImageError: where a shape or type is not as above.

    What is masked, as :mod:`numpy.ma` does, counts as no reading.
    """

    color: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32] | None = None
    stamp_ns: int = 0
    intrinsics: Intrinsics | None = None
    pose: Pose | None = None
    camera: str = ''

    def __post_init__(self) -> None:
        color = _plain(self.color, 'colour', np.uint8(0))
        object.__setattr__(self, 'color', color)
        try:
            object.__setattr__(self, 'stamp_ns', operator.index(self.stamp_ns))
        except TypeError:
            raise ImageError(f'stamp_ns is {self.stamp_ns!r}: give whole nanoseconds') from None
        if color.ndim != 3 or color.shape[2] != 3 or color.dtype != np.uint8 or color.size == 0:
            raise ImageError(
                f'colour image is {color.shape} {color.dtype}: '
                'expected (height, width, 3) uint8 BGR'
            )
        if self.depth is None:
            return
        depth = _plain(self.depth, 'depth', np.float32(np.nan))
        object.__setattr__(self, 'depth', depth)
        if depth.dtype != np.float32 or depth.ndim != 2:
            raise ImageError(
                f'depth image is {depth.shape} {depth.dtype}: '
                'expected (height, width) float32 metres'
            )
        if depth.shape != color.shape[:2]:
            raise ImageError(unregistered(depth.shape[::-1], (self.width, self.height)))

    @property
    def width(self) -> int:
        """Columns of the colour image."""
        return int(self.color.shape[1])

    @property
    def height(self) -> int:
        """Rows of the colour image."""
        return int(self.color.shape[0])

    def seconds_since(self, stamp_ns: int, least: float, most: float) -> float:
        """Seconds since an earlier stamp, as a tracker may take them.

        Args:
            stamp_ns: nanoseconds.
            least: for a clock that stood still or went back.
            most: for a pause or a clock that jumped.
        """
        return min(max((self.stamp_ns - stamp_ns) * 1e-9, least), most)

    def position(self, box: Box, depth: float | None) -> tuple[float, float, float] | None:
        """Metres in the camera's frame of the middle of a box at a depth.

        None where the depth is None, the camera is unknown, or its lens shows nothing there.
        """
        if depth is None or self.intrinsics is None:
            return None
        # A box counts pixels by their edges, a camera by their middles.
        place = self.intrinsics.deproject(box.cx - 0.5, box.cy - 0.5, depth)
        return place if all(math.isfinite(v) for v in place) else None
