# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Decompression that trusts no size and gives what a cut-off stream still holds."""

from __future__ import annotations

import bz2
from io import BytesIO
from pathlib import Path
from typing import Any

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.files import open_file

MAX_UNPACKED = 1 << 28
"""Largest chunk or message that is unpacked, in bytes; a few kB of zstd can claim as much."""
_WINDOW = 1 << 27


def unpack(method: str, data: bytes, expected: int | None = None) -> bytes:
    """``data`` decompressed; as much as there is, where it is cut off.

    Args:
        method: '', 'none', 'zstd', 'lz4' (frame format) or 'bz2'.
        data: compressed bytes.
        expected: number of bytes that should come out, where known.

    Raises:
        RecordingError: for an unknown method, damaged data, or more than :data:`MAX_UNPACKED`.
    """
    if method in ('', 'none'):
        return data
    limit = MAX_UNPACKED if expected is None else expected
    if limit > MAX_UNPACKED:
        raise RecordingError(f'a chunk claims {limit} bytes: more than {MAX_UNPACKED} are not read')
    try:
        if method == 'zstd':
            return _unzstd(data, limit)
        if method == 'lz4':
            import lz4.frame  # type: ignore[import-untyped]

            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=limit))
        if method == 'bz2':
            return bz2.BZ2Decompressor().decompress(data, max_length=limit)
    except RecordingError:
        raise
    except ImportError as error:
        raise RecordingError(
            f'{method} compression needs the Python package {error.name}: install it'
        ) from None
    except Exception as error:
        raise RecordingError(f'{method} data is damaged: {error}') from None
    raise RecordingError(f'compression {method!r} is not known: zstd, lz4 and bz2 are')


class Unpacker:
    """Compressed bytes as unpacked ones, unpacked only as far as they are asked for.

    Args:
        method: 'zstd', 'lz4' or 'bz2'.
        data: compressed bytes, all of them.
        size: number of bytes that should come out.
    """

    def __init__(self, method: str, data: bytes, size: int) -> None:
        if not 0 <= size <= MAX_UNPACKED:
            raise RecordingError(
                f'a chunk claims {size} bytes: more than {MAX_UNPACKED} are not read'
            )
        self.size = size
        self._buffer = bytearray()
        self._file = _open(method, data)

    def read(self, at: int, length: int) -> bytes:
        """``length`` bytes from ``at``; fewer at the end.

        Raises:
            RecordingError: where the data is damaged.
        """
        end = min(at + length, self.size)
        try:
            while len(self._buffer) < end:
                part = self._file.read(min(end - len(self._buffer), 1 << 20))
                if not part:
                    break
                self._buffer += part
        except Exception as error:
            raise RecordingError(f'packed data is damaged: {error}') from None
        return bytes(self._buffer[at:end])


def _open(method: str, data: bytes) -> Any:
    if method == 'zstd':
        import zstandard

        unpacker: Any = zstandard.ZstdDecompressor(max_window_size=_WINDOW)
        return unpacker.stream_reader(data, read_across_frames=True)
    if method == 'lz4':
        import lz4.frame

        return lz4.frame.LZ4FrameFile(BytesIO(data))
    if method == 'bz2':
        return bz2.BZ2File(BytesIO(data))
    raise RecordingError(f'compression {method!r} is not known: zstd, lz4 and bz2 are')


def _unzstd(data: bytes, limit: int) -> bytes:
    import zstandard

    unpacker: Any = zstandard.ZstdDecompressor(max_window_size=_WINDOW)
    try:
        # The one-call function is twice as fast, but allocates what the frame's own head claims.
        if 0 < zstandard.frame_content_size(data) <= limit:
            return bytes(unpacker.decompress(data, allow_extra_data=False))
    except zstandard.ZstdError:
        pass  # cut off, or several frames
    reader = unpacker.stream_reader(data, read_across_frames=True)
    parts: list[bytes] = []
    left = limit
    while left > 0:
        try:
            part = reader.read(min(left, 1 << 24))
        except zstandard.ZstdError:
            if not parts:
                raise
            break
        if not part:
            break
        parts.append(part)
        left -= len(part)
    return parts[0] if len(parts) == 1 else b''.join(parts)


def unpack_file(source: Path, target: Path) -> None:
    """Decompress a zstd file into another file, as much of it as there is.

    Raises:
        RecordingError: where it cannot be read or is damaged at once.
    """
    import zstandard

    try:
        with open_file(source) as packed, target.open('wb') as file:
            reader: Any = zstandard.ZstdDecompressor(max_window_size=_WINDOW).stream_reader(packed)
            try:
                while part := reader.read(1 << 22):
                    file.write(part)
            except zstandard.ZstdError as error:
                if not file.tell():
                    raise RecordingError(f'{source} is damaged: {error}') from None
    except OSError as error:
        raise RecordingError(f'{source} cannot be unpacked: {error.strerror or error}') from None
