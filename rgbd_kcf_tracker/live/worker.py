# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One thread that does the slow work, so that receiving never waits for it."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar('T')


class Worker(Generic[T]):
    """Takes items one by one in its own thread: the newest, or all in order.

    Calls (:meth:`call`) run in the same thread, before the next item, so that what they change
    needs no lock.

    Args:
        work: does one item. It must not raise; what it raises goes to ``failed``.
        failed: told of an exception of ``work`` or of a call, in the worker's thread.
        keep: items kept waiting at most; 1 is "the newest".
        name: of the thread.
    """

    def __init__(
        self,
        work: Callable[[T], None],
        failed: Callable[[Exception], None],
        *,
        keep: int = 1,
        name: str = 'tracker',
    ) -> None:
        self._work = work
        self._failed = failed
        self._keep = keep
        self._items: deque[T] = deque()
        self._calls: deque[Callable[[], None]] = deque()
        self._condition = threading.Condition()
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, *items: T) -> int:
        """Hand over items without waiting; returns how many older ones had to make room.

        Items that come at once, because they waited for the same thing, do not displace each other.
        """
        dropped = 0
        with self._condition:
            if self._stopping:
                return 0
            keep = max(self._keep - len(items), 0)
            while len(self._items) > keep:
                self._items.popleft()
                dropped += 1
            self._items.extend(items)
            self._condition.notify()
        return dropped

    def call(self, function: Callable[[], None]) -> None:
        """Have a function called in the worker's thread, before the next item."""
        with self._condition:
            if not self._stopping:
                self._calls.append(function)
                self._condition.notify()

    def stop(self, timeout_s: float = 5.0) -> bool:
        """Drop what waits, let the item in work end, and join; True when the thread has ended."""
        with self._condition:
            self._stopping = True
            self._items.clear()
            self._calls.clear()
            self._condition.notify()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while True:
            with self._condition:
                while not (self._stopping or self._calls or self._items):
                    self._condition.wait()
                if self._stopping:
                    return
                call = self._calls.popleft() if self._calls else None
                item = None if call else self._items.popleft()
            try:
                if call is not None:
                    call()
                elif item is not None:
                    self._work(item)
            except Exception as error:  # the thread must outlive any fault of one frame
                self._failed(error)
            # Keep no reference while waiting: an image pair is 10 MB.
            call = item = None
