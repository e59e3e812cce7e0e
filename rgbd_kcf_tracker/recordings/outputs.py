# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Files and folders that are written: never a source, nothing replaced unasked, nothing lost.

A new file is written in its place, so that all there is of it can be read while it grows and after
a kill. One that replaces another is written beside it, as ``NAME.part.SUFFIX``, and takes its name
when it is whole: until then, and after an interruption, the old one stays as it was. Files are told
apart by device and inode, not by their paths: hard links, symbolic links and file systems that know
no case give one file many names.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import logging
import os
import secrets
import shutil
import stat
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, TypeVar

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.files import NO_NAME, kind_of, walk, why

T = TypeVar('T')
W = TypeVar('W', bound='FrameWriter')
_LOG = logging.getLogger(__name__)

Identity = tuple[int, int]
"""Device and inode."""

_PART, _TOKEN = '.part-', 8
_DEAD_S = 3600.0
"""Seconds after which a part that nobody writes to is of a process that died."""
_STANDARD_OUTPUT = ('/dev/stdout', '/dev/fd/1', '/proc/self/fd/1')
_BESIDE = ('-wal', '-shm', '-journal')
"""What SQLite keeps beside a database, by the end of its name."""


def check_outputs(
    outputs: Mapping[str, str | os.PathLike[str]],
    sources: Sequence[str | os.PathLike[str]] = (),
    overwrite: bool = False,
    folders: Collection[str] = (),
) -> None:
    """Refuse, before anything is done, what must not or cannot be written.

    Args:
        outputs: paths by the names of their options, which the messages say.
        sources: what is read: files, or folders with all that lies in them. A file of a rosbag2
            folder stands for the folder.
        overwrite: whether files that are there may be replaced; sources never are.
        folders: the options whose paths are folders.

    Raises:
        RecordingError: for an output that is a source or lies in one, is there already, is no
            regular file, is standard output, lies in a folder that does not exist, or is another
            output, too.
    """
    places: dict[str, tuple[Path, Path, os.stat_result | None]] = {}
    for option, given in outputs.items():
        refuse_standard_output(option, given)
        target = _target(Path(given))
        _check_place(Path(given), target)
        if option not in folders:
            _refuse_slash(given)
        places[option] = Path(given), target, _stat(target)
    parts = list(dict.fromkeys(part for source in sources for part in _parts(source)))
    read = _read_among([there for *_, there in places.values() if there is not None], parts)
    around = _finder(parts)
    seen: dict[tuple[Identity, str], str] = {}
    for option, (path, target, there) in places.items():
        name = f'{option} {path}'
        if there is not None and _identity(there) in read:
            raise RecordingError(f'{name} is the source itself: give another name')
        if source := around(target.parent):
            raise RecordingError(
                f'{name} lies inside the source {source}: give a name outside of it'
            )
        if there is None:
            folder = _stat(target.parent)
            assert folder is not None  # _check_place has seen it
            key = _identity(folder), target.name
        else:
            key = _identity(there), ''
            if option in folders:
                _check_folder(path, there)
                if not overwrite and os.listdir(target):
                    raise RecordingError(_is_there(path))
            else:
                _check_replaceable(path, there, overwrite)
        if key in seen:
            raise RecordingError(f'{name} is {seen[key]}, too: give each its own file')
        seen[key] = name


def refuse_standard_output(option: str, given: str | os.PathLike[str]) -> None:
    """Refuse what stands for standard output where a file of its own is written.

    Raises:
        RecordingError: where it does.
    """
    name = os.fspath(given)
    if name == '-' or name in _STANDARD_OUTPUT:
        here = ' (./- where it is called so)' if name == '-' else ''
        raise RecordingError(
            f'{option} {name} would be standard output, which takes the rows of track alone, as '
            f'--output -: give the name of a file{here}'
        )


def check_held(folder: Path, sources: Sequence[str | os.PathLike[str]]) -> None:
    """Refuse a folder to write into in which a source, or what lies in one, has another name.

    A link that leads elsewhere, to a larger disk perhaps, may be there.

    Args:
        folder: which may not be there yet.
        sources: as :func:`check_outputs` takes them; what is named there may lie in the folder.

    Raises:
        RecordingError: naming the link.
    """
    parts = list(dict.fromkeys(part for source in sources for part in _parts(source)))
    links = list(_links_in(folder, {_own_place(part) for part in parts}))
    if not links:  # which is so but for accidents: no source need be looked through
        return
    there = [found for path in links if (found := _stat(_target(path))) is not None]
    read, around = _read_among(there, parts), _finder(parts)
    for path in links:
        target = _target(path)
        found = _stat(target)
        if source := around(target.parent):
            raise RecordingError(f'{path} leads into the source {source}: remove this link')
        if found is not None and _identity(found) in read:
            raise RecordingError(f'{path} is the source itself by another name: remove it')


def make_folder(path: Path) -> None:
    """A folder to write into; it may be there. The folder that it lies in must be.

    Raises:
        RecordingError: where it cannot be made.
    """
    target = _target(path)
    _check_place(path, target)
    try:
        target.mkdir(exist_ok=True)
    except OSError as error:
        raise RecordingError(cannot_write(path, error)) from None


class OutputFile:
    """A file that is written; see the module for where.

    Args:
        path: the file; its folder must be there.
        overwrite: replace a file that is there, when this one is whole.

    Attributes:
        path: as it was given.
        place: where it is written until :meth:`end`.
        file: open for writing.

    Raises:
        RecordingError: where it cannot be written, or is there already.
    """

    def __init__(self, path: str | os.PathLike[str], overwrite: bool = False) -> None:
        self.path = Path(path)
        self._target = _target(self.path)
        _check_place(self.path, self._target)
        _refuse_slash(path)
        there = _stat(self._target)
        mode = 0o666
        try:
            if there is None:
                self.place = self._target
                number = _create(self.place, mode)
            else:
                _check_replaceable(self.path, there, overwrite)
                self.place, number = _first_free(self._target, lambda p: _create(p, mode))
                os.fchmod(number, stat.S_IMODE(there.st_mode))
        except FileExistsError:
            raise RecordingError(_is_there(self.path)) from None
        except OSError as error:
            raise RecordingError(cannot_write(self.path, error)) from None
        self.file: BinaryIO = os.fdopen(number, 'wb')
        self._ended = False

    def write(self, data: bytes) -> None:
        """Write bytes and hand them to the system: from here on a kill loses none of them.

        Raises:
            RecordingError: where they cannot be written.
        """
        try:
            self.file.write(data)
            self.file.flush()
        except OSError as error:
            raise RecordingError(cannot_write(self.path, error)) from None

    def end(self, *, whole: bool, anything: bool) -> None:
        """Close the file and put it in its place, or leave nothing where there is nothing in it.

        Args:
            whole: it is finished: only then does it replace another.
            anything: it holds what is worth keeping.

        Raises:
            RecordingError: where that cannot be done.
        """
        if self._ended:
            return
        self._ended = True
        replaces = self.place != self._target
        try:
            try:
                if anything and not self.file.closed:
                    self.file.flush()
                    if whole and replaces:
                        os.fsync(self.file.fileno())  # or a power cut leaves neither old nor new
                    if not os.fstat(self.file.fileno()).st_nlink:
                        raise RecordingError(f'{self.path} was removed while it was written')
            finally:
                with contextlib.suppress(OSError):  # a full disk was told when it was written
                    self.file.close()
            if not anything:
                self.place.unlink(missing_ok=True)
            elif whole and replaces:
                self.place.replace(self._target)
            elif replaces:
                _tell_kept(self.path, self.place)
        except OSError as error:
            raise RecordingError(cannot_write(self.path, error)) from None


def write_file(path: str | os.PathLike[str], data: bytes, overwrite: bool = False) -> None:
    """Write a file that is in memory; see :class:`OutputFile`.

    Raises:
        RecordingError: where it cannot be written, or is there already.
    """
    output = OutputFile(path, overwrite)
    try:
        output.write(data)
    except BaseException:
        output.end(whole=False, anything=False)
        raise
    output.end(whole=True, anything=True)


class OutputFolder:
    """A folder that is written; see the module for where.

    Args:
        path: the folder; it may be there while it is empty. The folder that it lies in must be.
        known: names that a folder may hold to be replaced, * for any letters: one with others is
            not of our making.
        overwrite: replace a folder that is there, when this one is whole.

    Attributes:
        path: as it was given.
        place: where it is written until :meth:`end`.

    Raises:
        RecordingError: where it cannot be written, or is there already.
    """

    def __init__(
        self, path: str | os.PathLike[str], known: Collection[str], overwrite: bool = False
    ) -> None:
        self.path = Path(path)
        self._target = _target(self.path)
        self._known, self._ended = known, False
        _check_place(self.path, self._target)
        there = _stat(self._target)
        self._made = there is None
        try:
            if there is None:
                self.place = self._target
                self.place.mkdir()
                return
            _check_folder(self.path, there)
            held = sorted(os.listdir(self._target))
            if not held:
                self.place = self._target
                return
            if not overwrite:
                raise RecordingError(_is_there(self.path))
            self._refuse_others(self._target)
            self.place, _ = _first_free(self._target, os.mkdir)
        except OSError as error:
            raise RecordingError(cannot_write(self.path, error)) from None

    def end(self, *, whole: bool, anything: bool) -> None:
        """Put the folder in its place; see :meth:`OutputFile.end`."""
        if self._ended:
            return
        self._ended = True
        replaces = self.place != self._target
        try:
            if not anything:
                for held in self.place.iterdir():
                    shutil.rmtree(held) if held.is_dir() else held.unlink()
                if self._made or replaces:
                    self.place.rmdir()
            elif whole and replaces:
                old, _ = _first_free(self._target, os.mkdir)
                self._target.rename(old)
                try:
                    self._refuse_others(old)  # what somebody put there meanwhile
                except RecordingError:
                    old.rename(self._target)
                    _tell_kept(self.path, self.place)
                    raise
                self.place.rename(self._target)
                shutil.rmtree(old)
            elif replaces:
                _tell_kept(self.path, self.place)
        except OSError as error:
            raise RecordingError(cannot_write(self.path, error)) from None

    def _refuse_others(self, folder: Path) -> None:
        """Refuse a folder in which something is that we did not write."""
        known = self._known
        held = sorted(os.listdir(folder))
        others = [name for name in held if not any(fnmatchcase(name, k) for k in known)]
        if others:
            raise RecordingError(
                f'{self.path} holds {", ".join(others[:3])}, which we did not write: '
                'it is not replaced'
            )


def _tell_kept(path: Path, place: Path) -> None:
    _LOG.warning('%s is left as it was; what was written of the new one is %s', path, place)


class FrameWriter(ABC):
    """What is written frame by frame. Use it in a ``with`` block, or :meth:`close` it."""

    @abstractmethod
    def close(self, whole: bool = True) -> None:
        """Finish what was written; nothing is left where there is nothing in it.

        Args:
            whole: all is written: only then does it replace another.

        Raises:
            RecordingError: where it cannot be written.
        """

    def __enter__(self: W) -> W:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self.close()
            return
        with contextlib.suppress(RecordingError):  # the error before says more
            self.close(whole=False)


def part_of(path: Path) -> Path:
    """A hidden name beside ``path``, with its ending, that no other process takes."""
    return path.with_name(f'{_PART}{secrets.token_hex(_TOKEN // 2)}-{path.name}')


def clear_dead_parts(path: Path) -> None:
    """Remove what :func:`part_of` named beside ``path`` and nobody goes on writing."""
    with contextlib.suppress(OSError):
        for there in path.parent.iterdir():
            mine = (
                there.name.startswith(_PART)
                and there.name[len(_PART) + _TOKEN :] == f'-{path.name}'
            )
            if mine and time.time() - there.stat().st_mtime > _DEAD_S:
                there.unlink()


@contextlib.contextmanager
def moved_into_place(path: Path) -> Iterator[Path]:
    """Another name for a file to be written, which gets its own when it is whole.

    Unlike :class:`OutputFile` it is whole whenever it is there. Its folder is made.

    Raises:
        RecordingError: where it cannot be written.
    """
    temporary = part_of(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise RecordingError(cannot_write(path, error)) from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


def write_atomically(path: Path, data: str | bytes) -> None:
    """Write a file that is in memory with :func:`moved_into_place`.

    Raises:
        RecordingError: where it cannot be written.
    """
    if isinstance(data, str):  # names of files need not be UTF-8
        data = data.encode('utf-8', 'backslashreplace')
    with moved_into_place(path) as temporary:
        temporary.write_bytes(data)


def cannot_write(path: object, error: OSError) -> str:
    """The message for a failed write."""
    return f'{path} cannot be written: {why(error)}'


def _target(path: Path) -> Path:
    """The path with its links followed, so that a link is not replaced but what it stands for.

    Raises:
        RecordingError: where no file can have this name.
    """
    try:
        return Path(os.path.realpath(path))
    except ValueError:
        raise RecordingError(f'{path} {NO_NAME}') from None


def _check_place(path: Path, target: Path) -> None:
    """Refuse a path whose folder is not there: a mistyped one would be made."""
    try:
        if not stat.S_ISDIR(os.stat(target.parent).st_mode):
            raise NotADirectoryError(20, os.strerror(20))
    except FileNotFoundError:
        raise RecordingError(
            f'{path} cannot be written: there is no folder {path.parent}: make it first'
        ) from None
    except OSError as error:
        raise RecordingError(cannot_write(path, error)) from None


def _refuse_slash(given: str | os.PathLike[str]) -> None:
    """Refuse what by its end is the name of a folder."""
    if os.fspath(given).endswith(os.sep):
        raise RecordingError(f'{given} is the name of a folder: give the name of a file')


def _check_folder(path: Path, there: os.stat_result) -> None:
    if not stat.S_ISDIR(there.st_mode):
        what = 'a file' if stat.S_ISREG(there.st_mode) else kind_of(there.st_mode)
        raise RecordingError(f'{path} is {what}: give the name of a folder')


def _check_replaceable(path: Path, there: os.stat_result, overwrite: bool) -> None:
    if not stat.S_ISREG(there.st_mode):
        raise RecordingError(f'{path} is {kind_of(there.st_mode)}: give the name of a file')
    if not overwrite:
        raise RecordingError(_is_there(path))


def _is_there(path: Path) -> str:
    return f'{path} is there already: give another name, or add --overwrite to replace it'


def _first_free(target: Path, make: Callable[[Path], T]) -> tuple[Path, T]:
    """The first name beside ``target`` that is free, and what ``make`` gave for it."""
    for number in itertools.count(1):
        part = '.part' if number == 1 else f'.part{number}'
        path = target.with_name(f'{target.stem}{part}{target.suffix}')
        with contextlib.suppress(FileExistsError):
            return path, make(path)
    raise AssertionError('unreachable')


def _create(path: Path, mode: int) -> int:
    return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)


def _stat(path: Path | str) -> os.stat_result | None:
    """Of what is there; None where nothing is.

    Raises:
        RecordingError: where that cannot be told.
    """
    try:
        return os.stat(path)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise RecordingError(cannot_write(path, error)) from None


def _identity(there: os.stat_result) -> Identity:
    return there.st_dev, there.st_ino


def _parts(source: str | os.PathLike[str]) -> Iterator[str]:
    """A source, and the rosbag2 folder that it is a file of: another file there alters the bag."""
    path = os.fspath(source)
    yield path
    if os.path.isfile(path):
        for name in (path, os.path.realpath(path)):
            folder = os.path.dirname(name) or os.curdir
            if os.path.exists(os.path.join(folder, 'metadata.yaml')):
                yield folder


def _finder(sources: Sequence[str]) -> Callable[[Path], str | None]:
    """Tells of a folder which of the sources it is, or lies in at any depth."""
    roots: dict[Identity, str] = {}
    for source in sources:
        with contextlib.suppress(OSError):  # it is not there: opening it says so
            roots[_identity(os.stat(source))] = source

    @functools.cache
    def find(folder: Path) -> str | None:
        with contextlib.suppress(OSError):
            if (found := roots.get(_identity(os.stat(folder)))) is not None:
                return found
        return None if folder.parent == folder else find(folder.parent)

    return find


def _own_place(path: str | os.PathLike[str]) -> str:
    """A path whose folder is told without links, though it may be a link itself."""
    folder, name = os.path.split(os.path.abspath(path))
    return os.path.join(os.path.realpath(folder), name)


def _links_in(folder: Path, but: set[str]) -> Iterator[Path]:
    """What a folder holds, at any depth, that may have another name: by links of either kind.

    What lies at one of the places ``but`` is left out.
    """
    for place, subfolders, names in walk(folder):
        inside = [name for name in subfolders if _own_place(os.path.join(place, name)) not in but]
        for path in (Path(place, name) for name in (*inside, *names)):
            with contextlib.suppress(OSError):  # it went meanwhile
                there = path.lstat()
                linked = stat.S_ISLNK(there.st_mode) or (
                    stat.S_ISREG(there.st_mode) and there.st_nlink > 1
                )
                if linked and _own_place(path) not in but:
                    yield path
        subfolders[:] = inside


def _read_among(outputs: Sequence[os.stat_result], sources: Sequence[str]) -> set[Identity]:
    """Those of the outputs that are sources, or files in them."""
    among = {_identity(there) for there in outputs}
    files = any(not stat.S_ISDIR(there.st_mode) for there in outputs)
    return {i for source in sources for i in _identities(source, files) if i in among}


def _identities(path: str, files: bool) -> Iterator[Identity]:
    """Of a source, and of all files in it where they are asked for."""
    for name in (path, *(path + end for end in _BESIDE)):
        with contextlib.suppress(OSError):
            yield _identity(os.stat(name))
    if not files:
        return
    for folder, _, names in walk(path):
        for name in names:
            with contextlib.suppress(OSError):
                yield _identity(os.stat(os.path.join(folder, name)))
