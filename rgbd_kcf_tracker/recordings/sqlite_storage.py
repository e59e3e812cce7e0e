# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""SQLite files of rosbag2 (``.db3``)."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.sqlite_pages import is_cut_off, whole_rows
from rgbd_kcf_tracker.recordings.storage import HEAD, Definition, Scanned, Where

MAGIC = b'SQLite format 3\0'
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
        self.warnings: list[str] = []
        try:
            with path.open('rb') as file:
                magic = file.read(len(MAGIC))
        except OSError as error:
            raise RecordingError(f'{path} cannot be read: {error.strerror or error}') from None
        if magic != MAGIC:
            if not magic:
                raise RecordingError(f'{path} is empty: nothing was recorded')
            raise RecordingError(f'{path} is no SQLite bag: it does not begin as one')
        self._database = self._connect()

    def _connect(self) -> sqlite3.Connection:
        # With a write-ahead log, in a folder that is not writable, it opens only as immutable.
        name = quote(str(self.path.resolve()))
        for mode in ('mode=ro', 'immutable=1'):
            try:
                database = sqlite3.connect(f'file:{name}?{mode}', uri=True)
                database.execute('SELECT count(*) FROM sqlite_master').fetchone()
                return database
            except _ERRORS as error:
                reason = error
        raise RecordingError(f'{self.path} cannot be read: {reason}')

    def scan(self) -> Iterator[Scanned]:
        """See :meth:`Storage.scan`."""
        try:
            rows = self._database.execute('SELECT id, name, type, serialization_format FROM topics')
            names: dict[int, tuple[str, str]] = {}
            for number, name, kind, form in rows:
                if not (isinstance(name, str) and isinstance(kind, str)):
                    continue
                if form != 'cdr':
                    self.warnings.append(f'{self.path}: topic {name} is in {form!r}: left out')
                    continue
                names[number] = (name, kind)
                self.topics[name] = kind
        except _ERRORS as error:
            raise RecordingError(f'{self.path} is no rosbag2 database: {error}') from None
        self._read_definitions()
        try:
            for number, topic, log_ns, length, data in self._rows():
                if topic in names and isinstance(data, bytes) and isinstance(log_ns, int):
                    yield Scanned(*names[topic], log_ns, data, (-1, number, length))
        except _ERRORS as error:
            self.warnings.append(
                f'{self.path} is damaged or was cut off ({error}): '
                'the messages before that place are read'
            )

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        columns = f'SELECT id, topic_id, timestamp, length(data), substr(data, 1, {HEAD})'
        if not is_cut_off(self.path):
            yield from self._database.execute(f'{columns} FROM messages ORDER BY id')
            return
        self.warnings.append(f'{self.path} was cut off: all whole messages in it are read')
        query = "SELECT rootpage FROM sqlite_master WHERE name = 'messages'"
        root = self._database.execute(query).fetchone()
        for number in whole_rows(self.path, int(root[0]) if root else 0):
            yield from self._database.execute(f'{columns} FROM messages WHERE id = ?', (number,))

    def _read_definitions(self) -> None:
        query = 'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
        try:
            for kind, encoding, text in self._database.execute(query):
                if isinstance(text, str) and isinstance(encoding, str) and text:
                    self.definitions[kind] = Definition(encoding, text)
        except _ERRORS:
            return  # the table is there from Iron on

    def read(self, where: Where) -> bytes:
        """See :meth:`Storage.read`."""
        try:
            row = self._database.execute(
                'SELECT data FROM messages WHERE id = ?', (where[1],)
            ).fetchone()
        except _ERRORS as error:
            raise RecordingError(f'{self.path} cannot be read on: {error}') from None
        if row is None or not isinstance(row[0], bytes):
            raise RecordingError(f'{self.path} changed while it was read')
        return bytes(row[0])

    def close(self) -> None:
        """See :meth:`Storage.close`."""
        self._database.close()
