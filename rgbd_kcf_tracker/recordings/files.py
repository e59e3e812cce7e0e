# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Files that are read: only regular ones, never waited for, and never larger than they may be.

Opening a named pipe waits until somebody writes, and a device may never end. So whatever is read is
opened here, and is refused where it is neither a file nor a folder.
"""

from __future__ import annotations

import errno
import io
import os
import stat
from collections.abc import Iterator
from io import FileIO
from pathlib import Path
from typing import Any

from rgbd_kcf_tracker.errors import RecordingError

MAX_TEXT = 1 << 28
"""Largest text file that is read, in bytes: boxes of four million frames."""
MAX_IMAGE = 1 << 29
"""Largest image file that is read, in bytes: more than the largest image takes unpacked."""

NO_NAME = 'is no name of a file: a zero byte is in it'

_KINDS = (
    (stat.S_ISFIFO, 'a named pipe'),
    (stat.S_ISSOCK, 'a socket'),
    (stat.S_ISCHR, 'a device'),
    (stat.S_ISBLK, 'a device'),
    (stat.S_ISDIR, 'a folder'),
)


def require_source(path: str | os.PathLike[str]) -> None:
    """Refuse what is neither a file nor a folder, without opening it.

    Raises:
        RecordingError: where it does not exist, cannot be reached, or is a pipe, socket or device.
    """
    mode = _stat(Path(path)).st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise RecordingError(f'{path} is {kind_of(mode)}: give a file or a folder')


class _File(FileIO):
    """Says which file it is where a disk fails."""

    def read(self, size: int | None = -1, /) -> Any:
        try:
            return super().read(size)
        except OSError as error:
            raise RecordingError(cannot_read(self.name, error)) from None


def _open(path: str, _: int) -> int:
    return os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)


def open_file(path: Path) -> FileIO:
    """A regular file to read, without a buffer; its ``read`` raises as this does.

    Raises:
        RecordingError: where it cannot be opened or is no regular file.
    """
    # Looked at before it is opened: to open a device can have effects.
    _require_file(path, _stat(path).st_mode)
    try:
        file = _File(path, 'r', opener=_open)
    except OSError as error:
        raise RecordingError(cannot_read(path, error)) from None
    try:
        _require_file(path, os.fstat(file.fileno()).st_mode)
    except BaseException:
        file.close()
        raise
    return file


def is_there(path: Path) -> bool:
    """Whether a folder names this file, so that it is read or refused, and not passed over.

    A link that leads to nothing counts: what stands for the file was not fetched, or its disk is
    not there, and what it would say is not to be guessed.
    """
    return os.path.lexists(path)


def read_file(path: Path, most: int) -> bytes:
    """All bytes of a regular file.

    Args:
        path: the file.
        most: bytes that it may have.

    Raises:
        RecordingError: where it cannot be read, is no regular file, or is larger.
    """
    with open_file(path) as file:
        try:
            size = os.fstat(file.fileno()).st_size
            if size > most:
                raise RecordingError(f'{path} has {size} bytes: more than {most} are not read')
            # As many as there were, also where the file grows meanwhile.
            parts: list[bytes] = []
            while size > 0 and (part := file.read(size)):
                parts.append(part)
                size -= len(part)
        except OSError as error:
            raise RecordingError(cannot_read(path, error)) from None
    return parts[0] if len(parts) == 1 else b''.join(parts)


def open_text(path: Path) -> io.TextIOWrapper:
    """A regular text file in UTF-8 to read line by line, its line ends as they are.

    Raises:
        RecordingError: where it cannot be opened or is no regular file.
    """
    return io.TextIOWrapper(io.BufferedReader(open_file(path)), encoding='utf-8', newline='')


def read_text(path: Path) -> str:
    """A text file in UTF-8, with or without a byte-order mark.

    Raises:
        RecordingError: where it cannot be read as text.
    """
    try:
        return read_file(path, MAX_TEXT).decode('utf-8-sig')
    except UnicodeDecodeError:
        raise RecordingError(f'{path} is not a text file') from None


def listing(folder: Path) -> list[Path]:
    """What is in a folder, in no order, without hidden files.

    Where macOS copies to a foreign disk, it puts a hidden ``._NAME`` beside every file.

    Raises:
        RecordingError: where it cannot be read.
    """
    try:
        return [path for path in folder.iterdir() if not path.name.startswith('.')]
    except OSError as error:
        raise RecordingError(cannot_read(folder, error)) from None


def kind_of(mode: int) -> str:
    """What a file that is no regular one is, in words."""
    return next((words for test, words in _KINDS if test(mode)), 'no file')


def cannot_read(path: object, error: OSError) -> str:
    """The message for a failed read."""
    return f'{path} cannot be read: {why(error)}'


def why(error: OSError) -> str:
    """The system's reason in words."""
    if error.errno == errno.ELOOP:
        return 'its links lead in a circle'
    return error.strerror or str(error)


def _stat(path: Path) -> os.stat_result:
    try:
        return os.stat(path)
    except FileNotFoundError:
        missing = 'leads to nothing: it is a link' if path.is_symlink() else 'does not exist'
        raise RecordingError(f'{path} {missing}') from None
    except OSError as error:
        raise RecordingError(cannot_read(path, error)) from None
    except ValueError:
        raise RecordingError(f'{path} {NO_NAME}') from None


def refuse_special(path: Path) -> None:
    """Refuse what is there and is no regular file, before anything waits for it.

    Raises:
        RecordingError: where it is none, or a link that leads to nothing.
    """
    if is_there(path):
        _require_file(path, _stat(path).st_mode)


def _require_file(path: Path, mode: int) -> None:
    if not stat.S_ISREG(mode):
        raise RecordingError(f'{path} is {kind_of(mode)}: it must be a file')


def walk(path: str | os.PathLike[str]) -> Iterator[tuple[str, list[str], list[str]]]:
    """As :func:`os.walk`, but through links too, and once into each folder: links lead in circles.

    What is taken out of the second list is not entered.
    """
    seen: set[tuple[int, int]] = set()

    def is_new(folder: str) -> bool:
        try:
            state = os.stat(folder)
        except OSError:  # it went meanwhile
            return False
        identity = state.st_dev, state.st_ino
        new = identity not in seen
        seen.add(identity)
        return new

    is_new(os.fspath(path))
    for folder, subfolders, names in os.walk(path, followlinks=True):
        yield folder, subfolders, names
        subfolders[:] = [name for name in subfolders if is_new(os.path.join(folder, name))]
