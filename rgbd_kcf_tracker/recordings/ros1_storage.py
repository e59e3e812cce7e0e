# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""ROS 1 bags (format 2.0), with or without index, whole or cut off.

The format is that of wiki.ros.org/Bags/Format/2.0: records of a header (named fields) and data;
chunk records hold connection and message records, as they are or packed with bz2 or lz4.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.compression import unpack
from rgbd_kcf_tracker.recordings.files import open_file
from rgbd_kcf_tracker.recordings.storage import (
    CACHED_CHUNKS,
    HEAD,
    NANOSECONDS,
    Definition,
    Scanned,
    Where,
    ros2_type,
)

MAGIC = b'#ROSBAG V2.0\n'
_MESSAGE, _BAG, _CHUNK, _CONNECTION = 2, 3, 5, 7
_U32 = struct.Struct('<I')
_MAX_HEADER = 1 << 20

Fields = dict[bytes, bytes]


class Ros1Storage:
    """A :class:`Storage` of one ``.bag`` file.

    Raises:
        RecordingError: where the file cannot be opened or is no ROS 1 bag.
    """

    ros1 = True

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, str] = {}
        self.definitions: dict[str, Definition] = {}
        self.left_out: dict[str, str] = {}
        self.qos: dict[str, str] = {}
        self.unusable = 0
        self.warnings: list[str] = []
        self._connections: dict[int, tuple[str, str]] = {}
        # Place of a packed chunk's data: method, their length, unpacked length.
        self._chunks: dict[int, tuple[str, int, int]] = {}
        self._unpacked = lru_cache(CACHED_CHUNKS)(self._unpack)
        self._file = open_file(path)
        self._size = os.fstat(self._file.fileno()).st_size
        magic = self._at(0, len(MAGIC))
        if magic != MAGIC:
            self._file.close()
            if not magic:
                raise RecordingError(f'{path} is empty: nothing was recorded')
            raise RecordingError(f'{path} is no ROS 1 bag of format 2.0: it does not begin as one')

    def scan(self) -> Iterator[Scanned]:
        """See :meth:`Storage.scan`."""
        at = len(MAGIC)
        indexed = False
        while at < self._size:
            record = self._header(None, at, self._size)
            if record is None:
                break
            fields, body, length = record
            operation = _operation(fields)
            whole = body + length <= self._size
            if operation == _BAG and not indexed:
                index = int.from_bytes(fields.get(b'index_pos', b''), 'little')
                indexed = index > 0
                self._read_index(index)
            elif operation == _CHUNK:
                yield from self._chunk(fields, body, length)
            elif whole:
                scanned = self._record(None, operation, fields, body, length)
                if scanned is not None:
                    yield scanned
            if not whole:
                break
            at = body + length
        else:
            if indexed:
                return
        self.warnings.append(
            f'{self.path} was cut off or not closed: all whole messages in it are read'
        )

    def _read_index(self, at: int) -> None:
        """Connections as a closed bag repeats them: damage of their first chunk costs no topic."""
        while len(MAGIC) <= at < self._size:
            record = self._header(None, at, self._size)
            if record is None or _operation(record[0]) != _CONNECTION:
                return
            fields, body, length = record
            at = body + length
            if at <= self._size:
                self._connect(fields, self._at(body, length))

    def read(self, where: Where) -> bytes:
        """See :meth:`Storage.read`."""
        chunk, at, length = where
        data = self._at(at, length) if chunk < 0 else self._unpacked(chunk)[at : at + length]
        if len(data) != length:
            raise RecordingError(f'{self.path} became shorter while it was read')
        return data

    def close(self) -> None:
        """See :meth:`Storage.close`."""
        self._file.close()
        self._unpacked.cache_clear()

    def _at(self, position: int, length: int) -> bytes:
        self._file.seek(position)
        return self._file.read(length) or b''

    def _header(self, memory: bytes | None, at: int, end: int) -> tuple[Fields, int, int] | None:
        """Fields of the record at a place, place and length of its data; None if there is none."""

        def get(position: int, length: int) -> bytes:
            if memory is None:
                return self._at(position, length)
            return memory[position : position + length]

        if at + 4 > end:
            return None
        # Almost every header fits into the first bytes: one read instead of three.
        first = get(at, 192)
        (length,) = _U32.unpack_from(first)
        if length > _MAX_HEADER or at + length + 8 > end:
            return None
        raw = first if len(first) >= length + 8 else get(at, length + 8)
        fields: Fields = {}
        position = 4
        while position < 4 + length:
            (size,) = _U32.unpack_from(raw, position)
            name, equals, value = raw[position + 4 : position + 4 + size].partition(b'=')
            if not equals or position + 4 + size > 4 + length:
                return None
            fields[name] = value
            position += 4 + size
        # Every record says what it is; packed zeros would be millions that do not.
        if b'op' not in fields:
            return None
        (data,) = _U32.unpack_from(raw, 4 + length)
        return fields, at + length + 8, data

    def _record(
        self, chunk: int | None, operation: int, fields: Fields, body: int, length: int
    ) -> Scanned | None:
        memory = None if chunk is None else self._unpacked(chunk)
        if operation == _CONNECTION:
            data = self._at(body, length) if memory is None else memory[body : body + length]
            self._connect(fields, data)
            return None
        if operation != _MESSAGE:
            return None
        connection = self._connections.get(int.from_bytes(fields.get(b'conn', b''), 'little'))
        if connection is None or len(fields.get(b'time', b'')) != 8:
            self.unusable += 1
            return None
        seconds, nanoseconds = struct.unpack('<II', fields[b'time'])
        size = min(HEAD, length)
        head = self._at(body, size) if memory is None else memory[body : body + size]
        where = (-1 if chunk is None else chunk, body, length)
        return Scanned(*connection, seconds * NANOSECONDS + nanoseconds, head, where)

    def _chunk(self, fields: Fields, body: int, length: int) -> Iterator[Scanned]:
        method = fields.get(b'compression', b'none').decode('ascii', 'replace')
        memory: bytes | None = None
        chunk: int | None = None
        cut_off = body + length > self._size  # of which the scan warns
        length = min(length, self._size - body)
        at, end = body, body + length
        if method != 'none':
            size = int.from_bytes(fields.get(b'size', b''), 'little')
            self._chunks[body] = (method, length, size)
            chunk = body
            try:
                memory = self._unpacked(body)
            except RecordingError as error:
                self.warnings.append(f'{self.path}: a chunk at byte {body} is left out: {error}')
                return
            at, end = 0, len(memory)
        while at < end:
            record = self._header(memory, at, end)
            if record is None or record[1] + record[2] > end:
                if not cut_off:
                    self.warnings.append(
                        f'{self.path}: the chunk at byte {body} is damaged, and read up to there'
                    )
                return
            inner, start, size = record
            scanned = self._record(chunk, _operation(inner), inner, start, size)
            if scanned is not None:
                yield scanned
            at = start + size

    def _connect(self, fields: Fields, data: bytes) -> None:
        info: Fields = {}
        position = 0
        while position + 4 <= len(data):
            (size,) = _U32.unpack_from(data, position)
            name, _, value = data[position + 4 : position + 4 + size].partition(b'=')
            info[name] = value
            position += 4 + size
        topic = fields.get(b'topic', b'').decode('utf-8', 'replace')
        kind = ros2_type(info.get(b'type', b'').decode('utf-8', 'replace'))
        number = int.from_bytes(fields.get(b'conn', b''), 'little')
        self._connections[number] = (topic, kind)
        self.topics[topic] = kind
        text = info.get(b'message_definition', b'').decode('utf-8', 'replace')
        if text:
            self.definitions[kind] = Definition('ros1msg', text)

    def _unpack(self, chunk: int) -> bytes:
        method, length, size = self._chunks[chunk]
        return unpack(method, self._at(chunk, length), size)


def _operation(fields: Fields) -> int:
    return int.from_bytes(fields.get(b'op', b'\0'), 'little')
