# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Between one who tracks and many who look: the newest moment, and the last minute in figures.

Nothing queues. A browser that is slow gets the newest moment when it has drawn the one before; the
figures of the moments between go with it.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

HISTORY_S = 60.0
_MOST_ENTRIES = 6000


class Board:
    """The newest moment; one thread puts up, any number look."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._packet: tuple[dict[str, Any], dict[str, bytes]] | None = None
        self._number = 0
        self._entries: deque[tuple[int, dict[str, Any]]] = deque(maxlen=_MOST_ENTRIES)
        self._entry = 0
        self._epoch = 0
        self._watchers: set[Callable[[], None]] = set()

    @property
    def watched(self) -> bool:
        """Whether anybody looks."""
        return bool(self._watchers)

    def watch(self, wake: Callable[[], None]) -> None:
        """Have a function called, in the other's thread, whenever something new is put up."""
        with self._lock:
            self._watchers.add(wake)

    def unwatch(self, wake: Callable[[], None]) -> None:
        """Have it called no more."""
        with self._lock:
            self._watchers.discard(wake)

    def note(self, entry: Mapping[str, Any]) -> None:
        """Add the figures of a moment, with its time in seconds as ``t``."""
        with self._lock:
            self._entry += 1
            self._entries.append((self._entry, dict(entry)))
            latest = float(entry['t'])
            while self._entries and self._entries[0][1]['t'] < latest - HISTORY_S:
                self._entries.popleft()

    def rewind(self, entries: list[dict[str, Any]]) -> None:
        """Replace the figures, as when a recording is sought: browsers draw them anew."""
        with self._lock:
            self._epoch += 1
            self._entries.clear()
            for entry in entries:
                self._entry += 1
                self._entries.append((self._entry, entry))

    def show(self, header: dict[str, Any], blobs: dict[str, bytes]) -> None:
        """Put up the newest moment."""
        with self._lock:
            self._packet = (header, blobs)
            self._number += 1
            watchers = list(self._watchers)
        for wake in watchers:
            wake()

    def newer(self, than: int) -> int | None:
        """The number of the newest moment if it is newer than that one, else None."""
        with self._lock:
            return self._number if self._packet is not None and self._number > than else None

    def take(self, since: tuple[int, int]) -> tuple[int, tuple[int, int], Any, Any]:
        """The newest moment for one browser, with the figures that it has not got.

        Args:
            since: epoch and number of the last figures that it has; (-1, 0) for none.

        Returns:
            The moment's number, what to give as ``since`` next time, the header, the blobs.
        """
        with self._lock:
            assert self._packet is not None
            header, blobs = self._packet
            epoch, last = since
            fresh = epoch != self._epoch
            entries = [e for number, e in self._entries if fresh or number > last]
            header = {**header, 'entries': entries, 'anew': fresh}
            return self._number, (self._epoch, self._entry), header, blobs
