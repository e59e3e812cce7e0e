# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The head of a JPEG, PNG or TIFF: its size, told before any pixel is decoded.

A file of a hundred bytes can claim 60000 x 60000 pixels, and an image library would allocate them.
So the head is read here first, and a claim that is too large, or larger than the bytes could ever
unpack to, is refused.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from rgbd_kcf_tracker.errors import ImageError

PNG, JPEG, TIFF = 'PNG', 'JPEG', 'TIFF'

MAX_PIXELS = 1 << 24
"""Largest image that is read unless another limit is given: 16.8 million pixels.

Azure Kinect's 4096x3072 is the largest colour image of an RGB-D camera. A picture of four times as
many pixels takes seconds to unpack, from a message of a few kB.
"""
MAX_SIDE = 1 << 16
MOST_SCANS = 100
"""Scans of a JPEG image, each of which goes through all of it: encoders make some ten, and a file
could hold any number of empty ones."""

_PNG_SIGNATURE = b'\x89PNG\r\n\x1a\n'
_JPEG_SIGNATURE = b'\xff\xd8\xff'
_TIFF_SIGNATURES = (b'II*\x00', b'MM\x00*')
_PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}
# Pixels that one byte of data can stand for at most: deflate and LZW stay below 1100 and 1400
# bytes a byte; JPEG spends at least a bit on each 8x8 block, of which sampling leaves one in two.
_PNG_RATIO, _JPEG_RATIO, _TIFF_RATIO = 1100, 1024, 1400
_SLACK = 1 << 16


@dataclass(frozen=True, slots=True)
class Container:
    """What the head of a compressed image says: sizes in pixels, bits per channel."""

    name: str
    width: int
    height: int
    channels: int
    bits: int


def sniff(data: memoryview) -> str | None:
    """Which of :data:`PNG`, :data:`JPEG`, :data:`TIFF` the first bytes announce, or None."""
    head = bytes(data[:8])
    if head == _PNG_SIGNATURE:
        return PNG
    if head[:3] == _JPEG_SIGNATURE:
        return JPEG
    if head[:4] in _TIFF_SIGNATURES:
        return TIFF
    return None


def check_size(width: int, height: int, what: str, max_pixels: int = MAX_PIXELS) -> None:
    """Refuse an image without pixels or with unbelievably many.

    Raises:
        ImageError: naming ``what``.
    """
    if width <= 0 or height <= 0:
        raise ImageError(f'{what} is {width}x{height}: it has no pixels')
    if width > MAX_SIDE or height > MAX_SIDE or width * height > max_pixels:
        raise ImageError(
            f'{what} claims {width}x{height} pixels: more than {max_pixels} are not read '
            '(max_pixels sets the limit)'
        )


def inspect(data: memoryview, max_pixels: int = MAX_PIXELS) -> Container:
    """Read and check the head of a compressed image.

    Raises:
        ImageError: where the data is of no known kind, cut off, or claims an unbelievable size.
    """
    kind = sniff(data)
    if kind is None:
        raise ImageError(
            f'compressed image of {len(data)} bytes is neither JPEG, PNG nor TIFF '
            f'(it starts with {bytes(data[:8]).hex() or "nothing"})'
        )
    try:
        container, unpacked, ratio = {PNG: _png, JPEG: _jpeg, TIFF: _tiff}[kind](data, max_pixels)
    except (struct.error, IndexError, OverflowError):
        raise ImageError(f'{kind} image of {len(data)} bytes is cut off in its head') from None
    check_size(container.width, container.height, f'{kind} image', max_pixels)
    if unpacked > ratio * len(data) + _SLACK:
        raise ImageError(
            f'{kind} image of {len(data)} bytes claims {container.width}x{container.height} '
            'pixels: so few bytes cannot hold them'
        )
    return container


def _png(data: memoryview, max_pixels: int) -> tuple[Container, int, int]:
    length, kind, width, height, bits, color = struct.unpack_from('>I4sIIBB', data, 8)
    if kind != b'IHDR' or length != 13 or color not in _PNG_CHANNELS:
        raise ImageError('PNG image is damaged in its head')
    _walk_chunks(data)
    channels = _PNG_CHANNELS[color]
    # Grey of 1, 2 or 4 bits is widened to 8 by the decoder.
    stored = width * height * channels * bits // 8
    return Container(PNG, width, height, channels, max(bits, 8)), stored, _PNG_RATIO


def _walk_chunks(data: memoryview) -> None:
    """Refuse a PNG with a chunk that is longer than the data: a decoder may allocate its length."""
    at = len(_PNG_SIGNATURE)
    while at + 12 <= len(data):
        length, kind = struct.unpack_from('>I4s', data, at)
        at += 12 + length
        if kind == b'IEND':
            return
        if kind == b'acTL':
            raise ImageError('PNG image is animated: only still images are read')
    raise ImageError(f'PNG image of {len(data)} bytes is cut off')


def _jpeg(data: memoryview, max_pixels: int) -> tuple[Container, int, int]:
    position = 2
    while True:
        while data[position] != 0xFF:
            position += 1
        while data[position] == 0xFF:
            position += 1
        marker = data[position]
        position += 1
        if marker == 0xD9 or marker == 0xDA:
            raise ImageError('JPEG image has no size in its head')
        if marker == 0x01 or 0xD0 <= marker <= 0xD8:
            continue
        (length,) = struct.unpack_from('>H', data, position)
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            bits, height, width, channels = struct.unpack_from('>BHHB', data, position + 2)
            break
        position += max(length, 2)
    if bytes(data).count(b'\xff\xda') > MOST_SCANS:
        raise ImageError(f'JPEG image has more than {MOST_SCANS} scans')
    if bytes(data[-64:]).find(b'\xff\xd9') < 0 and bytes(data).rfind(b'\xff\xd9') < 0:
        raise ImageError(f'JPEG image of {len(data)} bytes is cut off')
    return Container(JPEG, width, height, channels, bits), width * height, _JPEG_RATIO


_TIFF_TYPES = {1: 'B', 3: 'H', 4: 'I'}


def _tiff(data: memoryview, max_pixels: int) -> tuple[Container, int, int]:
    order = '<' if data[0] == ord('I') else '>'
    (offset,) = struct.unpack_from(order + 'I', data, 4)
    (count,) = struct.unpack_from(order + 'H', data, offset)
    tags: dict[int, int] = {}
    for entry in range(count):
        at = offset + 2 + 12 * entry
        tag, kind, number = struct.unpack_from(order + 'HHI', data, at)
        if kind not in _TIFF_TYPES or number == 0:
            continue
        size = {'B': 1, 'H': 2, 'I': 4}[_TIFF_TYPES[kind]]
        where = at + 8
        if size * number > 4:
            (where,) = struct.unpack_from(order + 'I', data, where)
        (tags[tag],) = struct.unpack_from(order + _TIFF_TYPES[kind], data, where)
    width, height = tags.get(256, 0), tags.get(257, 0)
    channels, bits = tags.get(277, 1), tags.get(258, 1)
    # A tile may be larger than the image, and the decoder allocates whole tiles.
    for side in (tags.get(322, 1), tags.get(323, 1)):
        if side > MAX_SIDE:
            raise ImageError(f'TIFF image claims a tile of {side} pixels')
    check_size(
        max(tags.get(322, 1), 1), max(tags.get(323, 1), 1), 'tile of a TIFF image', max_pixels
    )
    if channels > 4 or bits > 64:
        raise ImageError(f'TIFF image claims {channels} channels of {bits} bits')
    stored = width * height * channels * bits // 8
    return Container(TIFF, width, height, channels, bits), stored, _TIFF_RATIO
