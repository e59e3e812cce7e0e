# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Digests of files by what is in them, so that copies elsewhere count as the same.

A digest is kept in the user's cache folder for as long as no file's size or times have changed: a
data set is read through once, and a later run only looks at its folders.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import stat
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.files import read_text, walk
from rgbd_kcf_tracker.recordings.outputs import write_atomically

MISSING = '-'
"""Instead of the digest of a file that cannot be read."""

_CHUNK = 1 << 20
_SETTLED_S = 2.0
"""A file that was changed less long ago could change again without another time of change."""


def files_digest(paths: Sequence[Path]) -> str:
    """Digest of files and of folders with all that is in them, hidden files left out.

    Args:
        paths: in an order that means something; one that is missing is part of the digest. Only
            their last names count, not where they lie. A file that cannot be read counts as
            missing, and is told when it is used.
    """
    files = [entry for path in paths for entry in _files(path)]
    cache = _Cache(files)
    result = cache.read()
    if result is None:
        digest, whole = hashlib.sha256(), True
        for name, path, _ in files:
            held = MISSING
            try:
                held = _file_digest(path) if path else MISSING
            except OSError:
                whole = False
            digest.update(_bytes(f'{name}\0{held}\0'))
        result = digest.hexdigest()[:32]
        if whole:  # what cannot be read now may be readable soon
            cache.write(result)
    return result


_Entry = tuple[str, Path | None, os.stat_result | None]


def _files(path: Path) -> Iterator[_Entry]:
    """Name within the digest, place and state of a file, or of the files in a folder."""
    if os.path.isdir(path):  # unlike Path's, it is no error where nothing may be asked
        for folder, subfolders, names in walk(path):
            subfolders[:] = sorted(n for n in subfolders if not n.startswith('.'))
            for name in sorted(n for n in names if not n.startswith('.')):
                file = Path(folder, name)
                yield _entry(f'{path.name}/{file.relative_to(path).as_posix()}', file)
    else:
        yield _entry(path.name, path)
        log = path.with_name(f'{path.name}-wal')
        if os.path.isfile(log):  # of a database, which is read with it
            yield _entry(log.name, log)


def _entry(name: str, path: Path) -> _Entry:
    """Only of files is the content read: a pipe would be waited for, and is refused when used."""
    try:
        state = path.stat()
    except OSError:
        state = None
    return name, path if state is not None and stat.S_ISREG(state.st_mode) else None, state


def _bytes(names: str) -> bytes:
    """Names of files need not be UTF-8."""
    return names.encode(errors='surrogateescape')


def _file_digest(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open('rb', buffering=0) as file:
        while chunk := file.read(_CHUNK):
            digest.update(chunk)
    return digest.hexdigest()


class _Cache:
    """The digest that was found for the same files in the same state; a file for each."""

    def __init__(self, files: Sequence[_Entry]) -> None:
        state = [
            (name, *(() if stat is None else (stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns)))
            for name, _, stat in files
        ]
        places = [str(path) if path is None else os.path.abspath(path) for _, path, _ in files]
        self._state = hashlib.sha256(json.dumps(state).encode()).hexdigest()
        self._newest = max((s.st_ctime_ns for _, _, s in files if s is not None), default=0)
        folder = os.environ.get('XDG_CACHE_HOME') or os.path.expanduser('~/.cache')
        name = hashlib.sha256(_bytes('\0'.join(places))).hexdigest()[:32]
        self._path = Path(folder, 'rgbd_kcf_tracker', 'digests', name[:2], f'{name}.json')

    def read(self) -> str | None:
        try:
            kept = json.loads(read_text(self._path))
            return str(kept['digest']) if kept['state'] == self._state else None
        except (RecordingError, RecursionError, ValueError, KeyError, TypeError):
            return None

    def write(self, digest: str) -> None:
        if time.time_ns() - self._newest < _SETTLED_S * 1e9:
            return
        with contextlib.suppress(RecordingError):  # no home, or a full disk: nothing is kept
            write_atomically(self._path, json.dumps({'state': self._state, 'digest': digest}))
