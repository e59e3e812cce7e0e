# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""MCAP files, with or without index, whole or cut off.

The records are those of the MCAP specification (mcap.dev/spec). Chunks that are not compressed are
never read as a whole: the scan skips from message to message.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Generator, Iterator
from functools import lru_cache
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.records import Channel, Schema

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.compression import Unpacker, unpack
from rgbd_kcf_tracker.recordings.files import open_file
from rgbd_kcf_tracker.recordings.storage import CACHED_CHUNKS, HEAD, Definition, Scanned, Where

MAGIC = b'\x89MCAP0\r\n'
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0F
_FOOTER = struct.Struct('<BQQQI')
_FOOTER_BEGIN = struct.pack('<BQ', 0x02, 20)
_RECORD = struct.Struct('<BQ')
_MESSAGE_HEAD = struct.Struct('<HIQQ')
_CHUNK_HEAD = struct.Struct('<QQQI')


class _File:
    """Bytes of a file by position, without a buffer of its own."""

    def __init__(self, path: Path) -> None:
        self._file = open_file(path)
        self.size = os.fstat(self._file.fileno()).st_size

    def read(self, at: int, length: int) -> bytes:
        self._file.seek(at)
        return self._file.read(length) or b''

    def close(self) -> None:
        self._file.close()


class _Memory:
    """Bytes of an unpacked chunk by position."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self.size = len(data)

    def read(self, at: int, length: int) -> bytes:
        return self._data[at : at + length]


class McapStorage:
    """A :class:`Storage` of one ``.mcap`` file.

    Raises:
        RecordingError: where the file cannot be opened or is no MCAP file.
    """

    ros1 = False

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, str] = {}
        self.definitions: dict[str, Definition] = {}
        self.left_out: dict[str, str] = {}
        self.qos: dict[str, str] = {}
        self.unusable = 0
        self.warnings: list[str] = []
        self._schemas: dict[int, str] = {}
        # None of one that is left out.
        self._channels: dict[int, tuple[str, str] | None] = {}
        # Place of a packed chunk: method, place of its data, their length, unpacked length, CRC.
        self._chunks: dict[int, tuple[str, int, int, int, int]] = {}
        self._unpacked = lru_cache(CACHED_CHUNKS)(self._unpack)
        self._file = _File(path)
        magic = self._file.read(0, len(MAGIC))
        if magic != MAGIC:
            self._file.close()
            if not magic:
                raise RecordingError(f'{path} is empty: nothing was recorded')
            raise RecordingError(f'{path} is no MCAP file: it does not begin as one')

    def scan(self) -> Iterator[Scanned]:
        """See :meth:`Storage.scan`."""
        self._read_summary()
        at, end = len(MAGIC), self._file.size
        while at + _RECORD.size <= end:
            opcode, length = _RECORD.unpack(self._file.read(at, _RECORD.size))
            body = at + _RECORD.size
            at = body + length
            if opcode == _DATA_END:
                if self._file.read(end - len(MAGIC), len(MAGIC)) == MAGIC:
                    return
                break
            if opcode == _CHUNK:
                yield from self._chunk(body, length)
            elif opcode == 0:
                break
            elif at <= end:
                scanned = self._record(opcode, self._file, body, length, None)
                if scanned is not None:
                    yield scanned
        self.warnings.append(
            f'{self.path} was cut off or not closed: all whole messages in it are read'
        )

    def _read_summary(self) -> None:
        """Schemas and channels as a closed file repeats them at its end.

        Mostly they stand in the first chunk alone, and damage there would cost all messages.
        """
        end = self._file.size - len(MAGIC) - _FOOTER.size
        if end < len(MAGIC):
            return
        foot = self._file.read(end, _FOOTER.size + len(MAGIC))
        if not foot.startswith(_FOOTER_BEGIN) or not foot.endswith(MAGIC):
            return
        at = _FOOTER.unpack_from(foot)[2]
        while len(MAGIC) <= at <= end - _RECORD.size:
            opcode, length = _RECORD.unpack(self._file.read(at, _RECORD.size))
            body = at + _RECORD.size
            at = body + length
            # What no summary holds: the place of it is wrong.
            if at > end or opcode in (0, _MESSAGE, _CHUNK, _DATA_END):
                return
            if opcode in (_SCHEMA, _CHANNEL):
                self._describe(opcode, self._file.read(body, length))

    def _warn(self, text: str) -> None:
        """Say it once, however often the file repeats what it is about."""
        if text not in self.warnings:
            self.warnings.append(text)

    def read(self, where: Where) -> bytes:
        """See :meth:`Storage.read`."""
        chunk, at, length = where
        data = self._file.read(at, length) if chunk < 0 else self._unpacked(chunk)[at : at + length]
        if len(data) != length:
            raise RecordingError(f'{self.path} is damaged, or became shorter while it was read')
        return data

    def close(self) -> None:
        """See :meth:`Storage.close`."""
        self._file.close()
        self._unpacked.cache_clear()

    def _record(
        self,
        opcode: int,
        source: _File | _Memory | Unpacker,
        body: int,
        length: int,
        chunk: int | None,
    ) -> Scanned | None:
        if opcode == _MESSAGE:
            return self._message(source, body, length, chunk)
        if opcode in (_SCHEMA, _CHANNEL):
            self._describe(opcode, source.read(body, length))
        return None

    def _message(
        self, source: _File | _Memory | Unpacker, body: int, length: int, chunk: int | None
    ) -> Scanned | None:
        start = _MESSAGE_HEAD.size
        head = source.read(body, min(start + HEAD, length))
        channel, _, log_ns, _ = _MESSAGE_HEAD.unpack_from(head.ljust(start))
        if len(head) < start or channel not in self._channels:
            self.unusable += 1
            return None
        known = self._channels[channel]
        if known is None:
            return None
        where = (-1 if chunk is None else chunk, body + start, length - start)
        return Scanned(*known, log_ns, head[start:], where)

    def _chunk(self, body: int, length: int) -> Iterator[Scanned]:
        available = min(length, self._file.size - body)
        cut_off = available < length  # of which the scan warns
        damaged = f'{self.path}: the chunk at byte {body} is damaged, and read up to there'
        head = self._file.read(body, min(available, _CHUNK_HEAD.size + 64))
        try:
            _, _, size, crc = _CHUNK_HEAD.unpack_from(head)
            (name_length,) = struct.unpack_from('<I', head, _CHUNK_HEAD.size)
            at = _CHUNK_HEAD.size + 4 + name_length
            method = head[_CHUNK_HEAD.size + 4 : at].decode('ascii')
            (packed,) = struct.unpack_from('<Q', head, at)
        except (struct.error, UnicodeDecodeError):
            if not cut_off:
                self.warnings.append(damaged)
            return
        data = body + at + 8
        whole = packed <= available - at - 8
        packed = min(packed, available - at - 8)
        if method == '':
            whole = yield from self._inside(self._file, data, data + packed, None)
            if not whole and not cut_off:
                self.warnings.append(damaged)
            return
        self._chunks[body] = (method, data, packed, size, crc)
        try:
            memory: _Memory | Unpacker
            if whole:
                # Of the last message, mostly an image, the first bytes will do.
                memory = Unpacker(method, self._file.read(data, packed), size)
            else:
                memory = _Memory(self._unpacked(body))
            whole = yield from self._inside(memory, 0, memory.size, body)
            if not whole and not cut_off:
                self.warnings.append(damaged)
        except RecordingError as error:
            self.warnings.append(f'{damaged}: {error}')

    def _inside(
        self, source: _File | _Memory | Unpacker, at: int, end: int, chunk: int | None
    ) -> Generator[Scanned, None, bool]:
        """The messages of a chunk; whether it holds whole records up to its end."""
        while at < end:
            head = source.read(at, _RECORD.size)
            if len(head) < _RECORD.size:
                return False
            opcode, length = _RECORD.unpack(head)
            body = at + _RECORD.size
            at = body + length
            # No record is empty, but packed zeros would be millions of them in a few bytes.
            if at > end or opcode == 0 or length == 0:
                return False
            scanned = self._record(opcode, source, body, length, chunk)
            if scanned is not None:
                yield scanned
        return True

    def _describe(self, opcode: int, data: bytes) -> None:
        stream = ReadDataStream(BytesIO(data))
        try:
            if opcode == _SCHEMA:
                schema = Schema.read(stream)
                self._schemas[schema.id] = schema.name
                if schema.data:
                    text = schema.data.decode('utf-8', 'replace')
                    self.definitions[schema.name] = Definition(schema.encoding, text)
                return
            channel = Channel.read(stream)
        except Exception:
            self._warn(f'{self.path}: a damaged description of a topic is left out')
            return
        if channel.message_encoding != 'cdr':
            self.left_out[channel.topic] = channel.message_encoding
            self._warn(
                f'{self.path}: topic {channel.topic} is in {channel.message_encoding!r}, '
                'not in cdr, and is left out'
            )
            self._channels[channel.id] = None
            return
        kind = self._schemas.get(channel.schema_id, '')
        self._channels[channel.id] = (channel.topic, kind)
        self.topics[channel.topic] = kind
        if profiles := channel.metadata.get('offered_qos_profiles'):
            self.qos[channel.topic] = profiles

    def _unpack(self, chunk: int) -> bytes:
        method, at, length, size, crc = self._chunks[chunk]
        data = unpack(method, self._file.read(at, length), size)
        # A chunk that was cut off is shorter, and what there is of it is taken.
        if crc and len(data) == size and zlib.crc32(data) != crc:
            raise RecordingError(f'{self.path}: the chunk at byte {chunk} is damaged (wrong CRC)')
        return data
