# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A small ONNX file, written by hand so that no test needs a network of anybody's."""

from __future__ import annotations


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _field(number: int, value: bytes | str | int) -> bytes:
    """One field of a protocol buffer: a whole number, or what has a length."""
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    data = value.encode() if isinstance(value, str) else value
    return _varint(number << 3 | 2) + _varint(len(data)) + data


def _tensor(name: str, shape: tuple[int, ...]) -> bytes:
    dims = b''.join(_field(1, _field(1, size)) for size in shape)
    kind = _field(1, _field(1, 1) + _field(2, dims))  # floats of that shape
    return _field(1, name) + _field(2, kind)


def _whole_numbers(name: str, values: tuple[int, ...]) -> bytes:
    listed = b''.join(_field(8, value) for value in values)
    return _field(1, name) + listed + _field(20, 7)


def average_pool(height: int = 256, width: int = 128, cell: int = 64) -> bytes:
    """A network that gives the mean colours of square cells, ``(1, 3, rows, cols)``."""
    node = b''.join(
        (
            _field(1, 'picture'),
            _field(2, 'means'),
            _field(4, 'AveragePool'),
            _field(5, _whole_numbers('kernel_shape', (cell, cell))),
            _field(5, _whole_numbers('strides', (cell, cell))),
        )
    )
    graph = b''.join(
        (
            _field(1, node),
            _field(2, 'mean_colours'),
            _field(11, _tensor('picture', (1, 3, height, width))),
            _field(12, _tensor('means', (1, 3, height // cell, width // cell))),
        )
    )
    return _field(1, 7) + _field(7, graph) + _field(8, _field(2, 11))
