# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Pixels into image messages: the counterpart of :mod:`images`, for writers, benches and tests.

The functions give the fields of the message as a plain object, from which rosbags' and rclpy's are
filled, and which the decoders take as it is.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import ImageError
from rgbd_kcf_tracker.frame import is_reading
from rgbd_kcf_tracker.recordings import rvl
from rgbd_kcf_tracker.recordings.images import ColorImage, DepthImage

# REP-118 and compressed_depth_image_transport: quantisation and range of inverse depth.
_PNG_LEVEL = 1
_QUANTIZATION = 100.0
_INVERSE_DEPTH = 1
DEPTH_MAX_M = 10.0

_FROM_BGR: dict[str, int | None] = {
    'bgr8': None,
    '8UC3': None,
    'rgb8': cv2.COLOR_BGR2RGB,
    'bgra8': cv2.COLOR_BGR2BGRA,
    'rgba8': cv2.COLOR_BGR2RGBA,
    'mono8': cv2.COLOR_BGR2GRAY,
}


@dataclass(frozen=True, slots=True)
class RawImage:
    """The fields of ``sensor_msgs/Image`` but its header; ``data`` is flat uint8."""

    height: int
    width: int
    encoding: str
    is_bigendian: int
    step: int
    data: npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class PackedImage:
    """The fields of ``sensor_msgs/CompressedImage`` but its header; ``data`` is flat uint8."""

    format: str
    data: npt.NDArray[np.uint8]


def encode_color(color: ColorImage, encoding: str = 'bgr8', padding: int = 0) -> RawImage:
    """A picture as a raw image.

    Args:
        color: ``(H, W, 3)`` uint8 BGR.
        encoding: bgr8, 8UC3, rgb8, bgra8, rgba8 or mono8.
        padding: bytes after each row.

    Raises:
        ImageError: for another encoding.
    """
    if encoding not in _FROM_BGR:
        raise ImageError(f'cannot write colour as {encoding!r}: choose {", ".join(_FROM_BGR)}')
    conversion = _FROM_BGR[encoding]
    pixels: Any = color if conversion is None else cv2.cvtColor(color, conversion)
    return _raw(pixels, encoding, False, padding)


def encode_depth(
    depth: DepthImage, encoding: str = '16UC1', bigendian: bool = False, padding: int = 0
) -> RawImage:
    """A depth image as a raw image.

    Args:
        depth: ``(H, W)`` float32 metres, NaN where there is no reading.
        encoding: 16UC1 (millimetres, 0 for no reading) or 32FC1 (metres, NaN).
        bigendian: write big-endian numbers.
        padding: bytes after each row.

    Raises:
        ImageError: for another encoding.
    """
    if encoding == '16UC1':
        values: Any = millimetres(depth)
    elif encoding == '32FC1':
        values = depth
    else:
        raise ImageError(f'cannot write depth as {encoding!r}: choose 16UC1 or 32FC1')
    if bigendian:
        values = values.astype(values.dtype.newbyteorder('>'))
    return _raw(values, encoding, bigendian, padding)


def encode_compressed_color(
    color: ColorImage, codec: str = 'jpeg', quality: int = 90
) -> PackedImage:
    """A picture as compressed_image_transport packs it.

    Args:
        color: ``(H, W, 3)`` uint8 BGR.
        codec: 'jpeg' or 'png', which loses nothing.
        quality: of a JPEG, 0 to 100.
    """
    if codec == 'png':
        return PackedImage('bgr8; png compressed bgr8', _imencode('.png', color, _PNG_PARAMETERS))
    flags = [int(cv2.IMWRITE_JPEG_QUALITY), quality]
    return PackedImage('bgr8; jpeg compressed bgr8', _imencode('.jpg', color, flags))


def encode_compressed_depth(
    depth: DepthImage,
    encoding: str = '16UC1',
    codec: str = 'png',
    depth_max_m: float = DEPTH_MAX_M,
) -> PackedImage:
    """A depth image as compressed_depth_image_transport packs it.

    Args:
        depth: ``(H, W)`` float32 metres, NaN where there is no reading.
        encoding: 16UC1 (lossless to the millimetre) or 32FC1 (16-bit inverse depth).
        codec: 'png' or 'rvl'.
        depth_max_m: farthest depth that 32FC1 keeps.
    """
    a = b = 0.0
    if encoding == '16UC1':
        values = millimetres(depth)
    else:
        a = _QUANTIZATION * (_QUANTIZATION + 1)
        b = 1 - a / depth_max_m
        with np.errstate(invalid='ignore'):
            far = ~(is_reading(depth) & (depth < depth_max_m))
            inverse = np.rint(a / depth + b)
        values = np.where(far, 0, np.clip(np.nan_to_num(inverse), 0, 65535)).astype(np.uint16)
    head = struct.pack('<iff', _INVERSE_DEPTH, a, b)
    if codec == 'rvl':
        body = rvl.encode(values)
    else:
        body = _imencode('.png', values, _PNG_PARAMETERS).tobytes()
    return PackedImage(f'{encoding}; compressedDepth {codec}', np.frombuffer(head + body, np.uint8))


def encode_bare_depth(depth: DepthImage, codec: str = 'tiff') -> PackedImage:
    """A depth image as kinect2_bridge packs it: 16-bit millimetres, 'tiff' or 'png', no header."""
    suffix, flags = ('.png', _PNG_PARAMETERS) if codec == 'png' else ('.tiff', [])
    return PackedImage(f'16UC1; {codec} compressed', _imencode(suffix, millimetres(depth), flags))


def millimetres(depth: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.uint16]:
    """Metres as whole millimetres, 0 for no reading and for what 16 bits cannot hold."""
    with np.errstate(invalid='ignore', over='ignore'):
        scaled = np.rint(depth * np.float32(1000))
        good = (scaled > 0) & (scaled < 65536)
    return np.where(good, scaled, 0).astype(np.uint16)


_PNG_PARAMETERS = [int(cv2.IMWRITE_PNG_COMPRESSION), _PNG_LEVEL]


def _imencode(suffix: str, image: Any, flags: list[int]) -> npt.NDArray[np.uint8]:
    done, data = cv2.imencode(suffix, image, flags)
    if not done:
        raise ImageError(f'image of {image.shape} {image.dtype} cannot be packed as {suffix}')
    flat: npt.NDArray[np.uint8] = data.reshape(-1)
    return flat


def _raw(pixels: Any, encoding: str, bigendian: bool, padding: int) -> RawImage:
    pixels = np.ascontiguousarray(pixels)
    height, width = pixels.shape[:2]
    rows = pixels.view(np.uint8).reshape(height, -1)
    if padding:
        rows = np.pad(rows, ((0, 0), (0, padding)))
    step = int(rows.shape[1])
    return RawImage(height, width, encoding, int(bigendian), step, rows.reshape(-1))
