# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""RVL, the lossless depth codec of compressed_depth_image_transport, without a loop over pixels.

Format (A. D. Wilson, "Fast Lossless Depth Image Compression", ISS 2017, and the transport's own
frame): uint32 columns, uint32 rows, then little-endian 32-bit words filled with 4-bit nibbles from
the high end. A number is stored three bits per nibble, low bits first, the nibble's top bit saying
that more follow. The stream is: length of a run of zeros, length of a run of non-zeros, then for
each of these the zig-zag coded difference to the last non-zero pixel; and again.
"""

from __future__ import annotations

import struct

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import ImageError
from rgbd_kcf_tracker.recordings.containers import MAX_PIXELS, check_size

_SIZE = struct.Struct('<II')


def decode(data: memoryview, max_pixels: int = MAX_PIXELS) -> npt.NDArray[np.uint16]:
    """``(H, W)`` uint16 of an RVL stream with its size in front.

    Raises:
        ImageError: for a stream that is cut off, or whose runs leave the image.
    """
    if len(data) < _SIZE.size:
        raise ImageError('RVL depth is cut off in its head')
    width, height = _SIZE.unpack_from(data)
    check_size(width, height, 'RVL depth image', max_pixels)
    pixels = width * height
    numbers = _unpack(data[_SIZE.size :])
    deltas = np.zeros(pixels, np.int32)
    filled = np.zeros(pixels, np.bool_)
    position = at = 0
    total = len(numbers)
    while position < pixels:
        if at >= total:
            raise ImageError(f'RVL depth {width}x{height} is cut off after {position} pixels')
        position += int(numbers[at])
        run = int(numbers[at + 1]) if at + 1 < total else 0
        at += 2
        if position + run > pixels or at + run > total or (run == 0 and position < pixels):
            raise ImageError(f'RVL depth {width}x{height} is damaged: a run leaves the image')
        deltas[position : position + run] = numbers[at : at + run]
        filled[position : position + run] = True
        position += run
        at += run
    coded = deltas[filled]
    values = np.cumsum((coded >> 1) ^ -(coded & 1), dtype=np.int64)
    if values.size and (values.min() < 0 or values.max() > 0xFFFF):
        raise ImageError(f'RVL depth {width}x{height} is damaged: a value leaves 16 bits')
    out = np.zeros(pixels, np.uint16)
    out[filled] = values
    return out.reshape(height, width)


def encode(image: npt.NDArray[np.uint16]) -> bytes:
    """RVL stream, size in front, of a ``(H, W)`` uint16 image."""
    height, width = image.shape
    flat = np.ascontiguousarray(image).reshape(-1)
    present = flat != 0
    edges = np.flatnonzero(np.diff(present.view(np.int8), prepend=0, append=0))
    starts, ends = edges[::2], edges[1::2]
    values = flat[present].astype(np.int64)
    difference = np.diff(values, prepend=0)
    coded = ((difference << 1) ^ (difference >> 63)).astype(np.uint32)
    before = np.concatenate(([0], ends))
    gaps = np.concatenate((starts, [flat.size])) - before
    runs = ends - starts
    # numbers = gap, run, run's values, gap, run, ... and a last gap and empty run if zeros end it
    sizes = np.concatenate((runs, [0]))
    offsets = np.cumsum(np.concatenate(([0], sizes[:-1] + 2)))
    numbers = np.zeros(int(offsets[-1]) + 2, np.uint32)
    is_head = np.zeros(len(numbers), np.bool_)
    numbers[offsets] = gaps
    numbers[offsets + 1] = sizes
    is_head[offsets] = is_head[offsets + 1] = True
    numbers[~is_head] = coded
    if gaps[-1] == 0:
        numbers = numbers[:-2]
    return _SIZE.pack(width, height) + _pack(numbers)


def _unpack(data: memoryview) -> npt.NDArray[np.int64]:
    """The numbers in a stream of nibbles."""
    words = np.frombuffer(data[: len(data) // 4 * 4], '<u4')
    octets = words.astype('>u4').view(np.uint8)
    nibbles = np.empty(octets.size * 2, np.uint8)
    np.right_shift(octets, 4, out=nibbles[::2])
    np.bitwise_and(octets, 15, out=nibbles[1::2])
    ends = np.flatnonzero(nibbles < 8)
    if not ends.size:
        return np.zeros(0, np.int64)
    nibbles = nibbles[: ends[-1] + 1]
    starts = np.empty_like(ends)
    starts[0] = 0
    starts[1:] = ends[:-1] + 1
    lengths = ends - starts + 1
    if int(lengths.max()) > 11:
        raise ImageError('RVL depth is damaged: a number is longer than 32 bits')
    numbers = (nibbles[starts] & 7).astype(np.int64)
    more = np.flatnonzero(lengths > 1)
    place = 1
    while more.size:
        numbers[more] |= (nibbles[starts[more] + place] & 7).astype(np.int64) << (3 * place)
        place += 1
        more = more[lengths[more] > place]
    return numbers


def _pack(numbers: npt.NDArray[np.uint32]) -> bytes:
    """The stream of nibbles that holds ``numbers``, filled up to whole words."""
    wide = numbers.astype(np.int64)
    lengths = np.ones(len(wide), np.int64)
    for place in range(1, 11):
        lengths += wide >= 1 << (3 * place)
    starts = np.concatenate(([0], np.cumsum(lengths)[:-1]))
    total = int(lengths.sum())
    nibbles = np.zeros((total + 7) // 8 * 8, np.uint8)
    for place in range(int(lengths.max(initial=0))):
        here = np.flatnonzero(lengths > place)
        digits = (wide[here] >> (3 * place)) & 7
        nibbles[starts[here] + place] = digits | np.where(lengths[here] > place + 1, 8, 0)
    octets = (nibbles[::2] << 4) | nibbles[1::2]
    return octets.view('>u4').astype('<u4').tobytes()
