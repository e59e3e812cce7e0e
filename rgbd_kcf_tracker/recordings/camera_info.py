# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a ``sensor_msgs/CameraInfo`` says of the pictures of a topic; from rclpy, a bag or a file.

The message describes the whole sensor: ``K`` and the distortion ``D`` of what the lens shows, ``P``
of the rectified picture, all at full resolution. What arrives may be a window of it (``roi``), and
binned. Whether it is rectified is not in the message but in the topic's name: by the message's
documentation ``image_rect`` and ``image_rect_color`` are, ``image_raw``, ``image`` and
``image_color`` are not.

Source: the comments of ``sensor_msgs/CameraInfo`` and ``RegionOfInterest``, REP 104; where these
leave it open, as image_geometry and image_proc do it, who make rectified pictures: the window of a
rectified picture is that of the raw one (``do_rectify`` changes nothing), and the principal point
is divided by the binning like any length.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from rgbd_kcf_tracker.errors import ImageError, RgbdKcfError
from rgbd_kcf_tracker.geometry import CAMERA_PX, Intrinsics

if TYPE_CHECKING:
    from rgbd_kcf_tracker.lens import Lens

AUTO, YES, NO = 'auto', 'yes', 'no'
RECTIFIED = (AUTO, YES, NO)
"""What can be said of a topic: whether its pictures are rectified, or to go by its name."""
PLUMB_BOB, RATIONAL, EQUIDISTANT = 'plumb_bob', 'rational_polynomial', 'equidistant'
_RECT = re.compile(r'(^|[/_])rect(ified)?([/_]|$)')


class Camera(NamedTuple):
    """The camera of the pictures that arrive.

    Attributes:
        intrinsics: of these pictures.
        width, height: of these pictures, 0 for any.
        sensor: ``(width, height)`` of the whole sensor, where that is another.
    """

    intrinsics: Intrinsics
    width: int
    height: int
    sensor: tuple[int, int] | None = None

    def misfit(self, width: int, height: int) -> str:
        """Why this is not the camera of pictures of that size, in words; '' where it is."""
        if not self.width or not self.height or (self.width, self.height) == (width, height):
            return ''
        part = ''
        if self.sensor is not None:
            part = f' (by roi and binning, of {self.sensor[0]}x{self.sensor[1]})'
        return f'is for {self.width}x{self.height} images{part} but these are {width}x{height}'


def is_rectified(topic: str) -> bool:
    """Whether the pictures of a topic are rectified, by its name."""
    return _RECT.search(topic) is not None


def unrectified(topic: str) -> str:
    """The name of a topic without what says that its pictures are rectified.

    >>> unrectified('/kinect2/qhd/image_color_rect'), unrectified('/rgb/image_rect_color')
    ('/kinect2/qhd/image_color', '/rgb/image_color')
    """
    return _RECT.sub(lambda found: found[3] and ('/' if '/' in found[0] else '_'), topic)


def camera_from_info(msg: Any, topic: str = '', rectified: str = AUTO) -> Camera | None:
    """The camera of a topic's pictures.

    Args:
        msg: a CameraInfo of ROS 2 or ROS 1 (``k`` or ``K``); fields that it lacks are taken as 0.
        topic: of the pictures, for ``auto``.
        rectified: ``yes``, ``no``, or ``auto`` to go by the topic's name.

    Returns:
        The camera; None for an uncalibrated one, where ``K`` and ``P`` are zero. A rectified
        picture has ``P``, any other ``K`` and the lens; where one is zero, the other is taken.

    Raises:
        ImageError: where the numbers are no camera (negative, infinite, too few), the window is
            not on the sensor, or the distortion is of a model that is not known.
    """
    k, p = _numbers(msg, 'k', 9), _numbers(msg, 'p', 12)
    straight = is_rectified(topic) if rectified == AUTO else rectified == YES
    from_k, from_p = (k[0], k[4], k[2], k[5]), (p[0], p[5], p[2], p[6])
    has_k, has_p = bool(k[0] or k[4]), bool(p[0] or p[5])
    if not has_k and not has_p:
        return None
    use_p = has_p and (straight or not has_k)
    lens = None if use_p or straight else _lens(msg)
    sensor = _whole(msg, 'width'), _whole(msg, 'height')
    left, top, width, height, binning = _window(msg, sensor)
    across, down = binning
    fx, fy, cx, cy = from_p if use_p else from_k
    try:
        intrinsics = Intrinsics(
            fx / across, fy / down, (cx - left) / across, (cy - top) / down, lens=lens
        )
    except RgbdKcfError as error:
        raise ImageError(f'camera_info is no camera: {error}') from None
    least, most = CAMERA_PX
    if min(fx, fy) < least or max(fx, fy, abs(cx), abs(cy)) > most:
        raise ImageError(
            f'camera_info is no camera: it states fx={fx:g} fy={fy:g} cx={cx:g} cy={cy:g} pixels'
        )
    reduced = (width, height) != sensor
    return Camera(intrinsics, width, height, sensor if reduced else None)


def model_of(lens: Lens | None) -> tuple[str, tuple[float, ...]]:
    """``distortion_model`` and ``D`` of a lens."""
    if lens is None:
        return PLUMB_BOB, (0.0,) * 5
    if lens.fisheye:
        return EQUIDISTANT, lens.coefficients
    return RATIONAL if len(lens.coefficients) >= 8 else PLUMB_BOB, lens.coefficients


def _field(msg: Any, name: str, default: Any) -> Any:
    return getattr(msg, name, getattr(msg, name.upper(), default))


def _numbers(msg: Any, name: str, count: int) -> Sequence[float]:
    values: Any = _field(msg, name, ())
    try:
        numbers = [float(v) for v in values]
    except (OverflowError, TypeError, ValueError):
        numbers = []
    if len(numbers) != count:
        raise ImageError('camera_info has no 3x3 K and 3x4 P: leave it out or calibrate')
    return numbers


def _whole(msg: Any, name: str) -> int:
    value = getattr(msg, name, 0)
    try:
        whole = int(value)
    except (TypeError, ValueError, OverflowError):
        whole = -1
    if whole < 0:
        raise ImageError(f'camera_info has {name} {value!r}: give a whole number')
    return whole


def _window(msg: Any, sensor: tuple[int, int]) -> tuple[int, int, int, int, tuple[int, int]]:
    """Left and top of the pictures on the sensor, their size when binned, and the binning."""
    across, down = (max(_whole(msg, f'binning_{axis}'), 1) for axis in 'xy')
    roi: Any = getattr(msg, 'roi', None)
    left, top, wide, high = (_whole(roi, n) for n in ('x_offset', 'y_offset', 'width', 'height'))
    # All zero says the whole sensor; some drivers leave the size out of a window, too.
    width, height = wide or max(sensor[0] - left, 0), high or max(sensor[1] - top, 0)
    known = all(sensor)
    if known and (left + width > sensor[0] or top + height > sensor[1] or not width or not height):
        raise ImageError(
            f'camera_info has a roi of {wide}x{high} at {left},{top} that is not on its '
            f'{sensor[0]}x{sensor[1]} sensor'
        )
    if not known and not (wide and high):
        return left, top, 0, 0, (across, down)
    if width < across or height < down:
        raise ImageError(
            f'camera_info has a binning of {across}x{down} of {width}x{height} pixels: that leaves '
            'none'
        )
    return left, top, width // across, height // down, (across, down)


def _lens(msg: Any) -> Lens | None:
    """The lens of a raw picture, None for one without distortion."""
    given: Any = _field(msg, 'd', ())
    model = str(getattr(msg, 'distortion_model', '') or '')
    try:
        values = tuple(float(v) for v in given)
    except (OverflowError, TypeError, ValueError):
        raise ImageError('camera_info has a D that is no list of numbers') from None
    if not any(values):
        return None
    if not all(math.isfinite(v) for v in values):
        raise ImageError('camera_info has distortion coefficients that are not finite')
    if model not in (PLUMB_BOB, RATIONAL, EQUIDISTANT):
        raise ImageError(
            f'camera_info has a distortion of the model {model!r}, which is not known: use '
            f'rectified images, or {PLUMB_BOB}, {RATIONAL} or {EQUIDISTANT}'
        )
    from rgbd_kcf_tracker.lens import Lens

    try:
        return Lens(values, model == EQUIDISTANT)
    except RgbdKcfError as error:
        raise ImageError(f'camera_info is no camera: {error}') from None
