# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Which rows of a cut-off SQLite file are whole.

SQLite reads pages beyond the end of a file as zeros, so a cut-off image would come back half black
and without an error. Here the pages of each row are looked up in the file itself, by the format in
sqlite.org/fileformat2.html.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from rgbd_kcf_tracker.recordings.files import open_file

_LEAF, _INTERIOR = 13, 5


def has_log(path: Path) -> bool:
    """Whether a write-ahead log with something in it lies beside the database."""
    try:
        return path.with_name(path.name + '-wal').stat().st_size > 0
    except OSError:
        return False


def is_cut_off(path: Path) -> bool:
    """Whether the file is shorter than its own head says (and no write-ahead log has the rest)."""
    if has_log(path):
        return False
    with open_file(path) as file:
        head = file.read(100)
    if len(head) < 100:
        return True
    (pages,) = struct.unpack_from('>I', head, 28)
    return bool(path.stat().st_size < pages * _page_size(head))


def whole_rows(path: Path, root: int) -> Iterator[int]:
    """Row ids, rising, of the table with root page ``root`` whose pages are all in the file."""
    with open_file(path) as file:
        pages = _Pages(file, path.stat().st_size)
        yield from pages.rows(root)


class _Pages:
    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file = file
        head = file.read(100)
        self._size = _page_size(head)
        self._usable = self._size - head[20]
        self._count = size // self._size

    def rows(self, root: int) -> Iterator[int]:
        stack, seen = [root], set()
        while stack:
            number = stack.pop()
            # A damaged file may lead in circles.
            if not 1 <= number <= self._count or number in seen:
                continue
            seen.add(number)
            page = self._page(number)
            start = 100 if number == 1 else 0
            kind = page[start]
            (cells,) = struct.unpack_from('>H', page, start + 3)
            head = start + (12 if kind == _INTERIOR else 8)
            if kind not in (_LEAF, _INTERIOR) or head + 2 * cells > len(page):
                continue
            places = struct.unpack_from(f'>{cells}H', page, head)
            if kind == _INTERIOR:
                children = [struct.unpack_from('>I', page + bytes(4), p)[0] for p in places]
                children += struct.unpack_from('>I', page, start + 8)
                stack += reversed(children)
                continue
            for place in places:
                row = self._row(page, place)
                if row is not None:
                    yield row

    def _row(self, page: bytes, place: int) -> int | None:
        """Id of the row in a leaf's cell, None where a page of it is missing."""
        try:
            length, place = _varint(page, place)
            row, place = _varint(page, place)
            local = self._local(length)
            if local == length:
                return row
            (following,) = struct.unpack_from('>I', page, place + local)
            left = length - local
            while left > 0:
                if not 1 <= following <= self._count:
                    return None
                self._file.seek((following - 1) * self._size)
                (following,) = struct.unpack('>I', self._file.read(4))
                left -= self._usable - 4
        except (struct.error, IndexError):
            return None
        return row

    def _local(self, length: int) -> int:
        """How much of a row's bytes lies in its leaf page."""
        most = self._usable - 35
        if length <= most:
            return length
        least = (self._usable - 12) * 32 // 255 - 23
        part = least + (length - least) % (self._usable - 4)
        return part if part <= most else least

    def _page(self, number: int) -> bytes:
        self._file.seek((number - 1) * self._size)
        return self._file.read(self._size)


def _page_size(head: bytes) -> int:
    (size,) = struct.unpack_from('>H', head, 16)
    return 65536 if size == 1 else max(int(size), 512)


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for place in range(9):
        byte = data[at + place]
        if place == 8:
            return value << 8 | byte, at + 9
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, at + place + 1
    raise AssertionError('unreachable')
