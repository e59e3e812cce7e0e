# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""SQLite files of rosbag2 (``.db3``)."""

from __future__ import annotations

import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.files import open_file
from rgbd_kcf_tracker.recordings.sqlite_pages import has_log, is_cut_off, whole_rows
from rgbd_kcf_tracker.recordings.storage import HEAD, Definition, Scanned, Where

MAGIC = b'SQLite format 3\0'
# Byte of the head that is 2 where reading needs the write-ahead log.
_LOGGED = 19
_TABLES = ('topics', 'messages', 'message_definitions')
# Of a column, as `PRAGMA table_xinfo` tells it: where, and what, says that it is computed.
_HIDDEN, _GENERATED = 6, (2, 3)
# A damaged file has text that is no UTF-8, and numbers that are none, too.
_ERRORS = (sqlite3.Error, UnicodeError, ValueError, OverflowError)


class SqliteStorage:
    """A :class:`Storage` of one ``.db3`` file.

    Raises:
        RecordingError: where the file cannot be opened or is no rosbag2 database.
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
        self._copy: tempfile.TemporaryDirectory[str] | None = None
        with open_file(path) as file:
            head = file.read(_LOGGED + 1)
        if not head.startswith(MAGIC):
            if not head:
                raise RecordingError(f'{path} is empty: nothing was recorded')
            raise RecordingError(f'{path} is no SQLite bag: it does not begin as one')
        try:
            self._database = self._connect(logged=head[_LOGGED:] == b'\2')
        except BaseException:
            self._drop_copy()
            raise

    def _connect(self, logged: bool) -> sqlite3.Connection:
        place = self.path.resolve()
        modes: tuple[str, ...] = ('mode=ro', 'immutable=1')
        if logged:
            # SQLite would make files beside a database with a write-ahead log, or change them.
            modes = ('immutable=1',)
            if has_log(self.path):
                place, modes = self._copied(), ('mode=ro',)
        name = quote(os.fsencode(place))
        for mode in modes:
            try:
                # Who replays or shows a bag opens it in one thread, and reads on in another.
                database = sqlite3.connect(f'file:{name}?{mode}', uri=True, check_same_thread=False)
                computed = _computed(database)
            except _ERRORS as error:
                reason = error
                continue
            if computed:
                database.close()
                raise RecordingError(
                    f'{self.path} is no rosbag2 database: its {computed} is computed, not recorded'
                )
            return database
        raise RecordingError(f'{self.path} cannot be read: {reason}')

    def _copied(self) -> Path:
        """The database and its log in a folder of ours."""
        try:
            self._copy = tempfile.TemporaryDirectory(prefix='rgbd_kcf_')
            place = Path(self._copy.name) / 'copy.db3'
            for end in ('', '-wal'):
                source = self.path.with_name(self.path.name + end)
                with open_file(source) as old, Path(f'{place}{end}').open('wb') as new:
                    shutil.copyfileobj(old, new, 1 << 22)
        except OSError as error:
            raise RecordingError(
                f'{self.path} has a write-ahead log, so a copy is read, which cannot be made in '
                f'{tempfile.gettempdir()}: {error.strerror or error}: set TMPDIR'
            ) from None
        return place

    def _drop_copy(self) -> None:
        if self._copy is not None:
            self._copy.cleanup()
            self._copy = None

    def scan(self) -> Iterator[Scanned]:
        """See :meth:`Storage.scan`."""
        try:
            rows = self._database.execute('SELECT id, name, type, serialization_format FROM topics')
            names: dict[int, tuple[str, str] | None] = {}
            for number, name, kind, form in rows:
                if not (isinstance(name, str) and isinstance(kind, str)):
                    continue
                if form != 'cdr':
                    self.left_out[name] = str(form)
                    self.warnings.append(f'{self.path}: topic {name} is in {form!r}: left out')
                    names[number] = None
                    continue
                names[number] = (name, kind)
                self.topics[name] = kind
        except _ERRORS as error:
            raise RecordingError(f'{self.path} is no rosbag2 database: {error}') from None
        self._read_definitions()
        self._read_qos()
        try:
            for number, topic, log_ns, length, data in self._rows():
                # SQLite takes a value of any type in any column.
                if topic in names and isinstance(data, bytes) and isinstance(log_ns, int):
                    if known := names[topic]:
                        yield Scanned(*known, log_ns, data, (-1, number, length))
                else:
                    self.unusable += 1
        except _ERRORS as error:
            self.warnings.append(
                f'{self.path} is damaged or was cut off ({error}): '
                'the messages before that place are read'
            )

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        # The rowid is the id, and is a number even where damage has made that another column.
        columns = f'SELECT rowid, topic_id, timestamp, length(data), substr(data, 1, {HEAD})'
        if not is_cut_off(self.path):
            yield from self._database.execute(f'{columns} FROM messages ORDER BY rowid')
            return
        self.warnings.append(f'{self.path} was cut off: all whole messages in it are read')
        query = "SELECT rootpage FROM sqlite_master WHERE name = 'messages'"
        root = self._database.execute(query).fetchone()
        for number in whole_rows(self.path, int(root[0]) if root else 0):
            yield from self._database.execute(f'{columns} FROM messages WHERE rowid = ?', (number,))

    def _read_definitions(self) -> None:
        query = 'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
        try:
            for kind, encoding, text in self._database.execute(query):
                if isinstance(text, str) and isinstance(encoding, str) and text:
                    self.definitions[kind] = Definition(encoding, text)
        except _ERRORS:
            return  # the table is there from Iron on

    def _read_qos(self) -> None:
        try:
            for name, text in self._database.execute(
                'SELECT name, offered_qos_profiles FROM topics'
            ):
                if isinstance(text, str) and text and name in self.topics:
                    self.qos[name] = text
        except _ERRORS:
            return  # the column is there from Foxy on

    def read(self, where: Where) -> bytes:
        """See :meth:`Storage.read`."""
        try:
            row = self._database.execute(
                'SELECT data FROM messages WHERE rowid = ?', (where[1],)
            ).fetchone()
        except _ERRORS as error:
            raise RecordingError(f'{self.path} cannot be read on: {error}') from None
        if row is None or not isinstance(row[0], bytes):
            raise RecordingError(f'{self.path} changed while it was read')
        return bytes(row[0])

    def close(self) -> None:
        """See :meth:`Storage.close`."""
        self._database.close()
        self._drop_copy()


def _computed(database: sqlite3.Connection) -> str:
    """Which of a bag's tables is a view, or has a column of a formula; '' where none is.

    What is computed has no end that the size of the file would set.
    """
    for table in _TABLES:
        rows = database.execute(
            'SELECT rootpage FROM sqlite_master '
            "WHERE lower(name) = ? AND type IN ('table', 'view')",
            (table,),
        )
        if any(not root for (root,) in rows):  # it has no page in the file
            return table
        columns = database.execute(f'PRAGMA table_xinfo({table})')
        if any(column[_HIDDEN] in _GENERATED for column in columns):
            return table
    return ''
