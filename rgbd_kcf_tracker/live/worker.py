# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One thread that does the slow work, so that receiving never waits for it."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Generic, TypeVar

T = TypeVar('T')


FAST = 0.7
"""Share of the time between two items that one may take where there is time to catch up."""
REMEMBERED = 15
"""Items of which the typical time is the median: half a second at 30 Hz."""


class Typical:
    """The median of the last values: one that was held up does not count."""

    def __init__(self) -> None:
        self._last: deque[float] = deque(maxlen=REMEMBERED)

    def add(self, value: float) -> None:
        """Take one more."""
        self._last.append(value)

    @property
    def value(self) -> float | None:
        """The median, None until there are enough."""
        if len(self._last) < REMEMBERED:
            return None
        return sorted(self._last)[REMEMBERED // 2]


class Worker(Generic[T]):
    """Takes items one by one in its own thread: the newest, or all in order.

    Calls (:meth:`call`) run in the same thread, between items, so that what they change needs no
    lock. Of calls of one kind that wait, only the last runs; so neither calls nor items can keep
    the other from their turn.

    Args:
        work: does one item. It must not raise; what it raises goes to ``failed``.
        failed: told of an exception of ``work`` or of a call, in the worker's thread.
        keep: items kept waiting at most; 1 is "the newest".
        catch_up: as many more wait until items are known to be worked off slower than they come, so
            that none is lost where the work, or the whole process, was held up once: by the first
            item, which mostly takes longest, as by any other.
        name: of the thread.
    """

    def __init__(
        self,
        work: Callable[[T], None],
        failed: Callable[[Exception], None],
        *,
        keep: int = 1,
        catch_up: int = 0,
        name: str = 'tracker',
    ) -> None:
        self._work = work
        self._failed = failed
        self._keep, self._catch_up = keep, catch_up
        self._work_s, self._period_s = Typical(), Typical()
        self._came_s: float | None = None
        self._items: deque[T] = deque()
        self._calls: dict[str, Callable[[], None]] = {}
        self._condition = threading.Condition()
        self._stopping = self._ended = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether nothing that was given to this worker is still in work."""
        with self._condition:
            return self._ended

    def submit(self, *items: T) -> int:
        """Hand over items without waiting; returns how many older ones had to make room.

        Items that come at once, because they waited for the same thing, do not displace each other.
        """
        dropped = 0
        with self._condition:
            if self._stopping:
                return 0
            keep = max(self._most() - len(items), 0)
            while len(self._items) > keep:
                self._items.popleft()
                dropped += 1
            self._items.extend(items)
            self._condition.notify()
        return dropped

    def _most(self) -> int:
        now = time.monotonic()
        if self._came_s is not None:
            self._period_s.add(now - self._came_s)
        self._came_s = now
        work, period = self._work_s.value, self._period_s.value
        slow = work is not None and period is not None and work > FAST * period
        return self._keep if slow else self._keep + self._catch_up

    def call(self, kind: str, function: Callable[[], None]) -> None:
        """Have a function called in the worker's thread, before the next item.

        It takes the place of a call of the same kind that still waits. Once the thread has ended,
        the function is called here and now.
        """
        with self._condition:
            if not self._ended:
                self._calls.pop(kind, None)  # its successor comes after what was asked in between
                self._calls[kind] = function
                self._condition.notify()
                return
        self._guarded(function)

    def stop(self, timeout_s: float = 5.0) -> bool:
        """Drop the items that wait, and join; True when the thread has ended.

        The item in work is finished, and so are all calls: who asked for something gets it.
        """
        with self._condition:
            self._stopping = True
            self._items.clear()
            self._condition.notify()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout_s)
        return self.ended

    def _run(self) -> None:
        while True:
            with self._condition:
                while not (self._stopping or self._calls or self._items):
                    self._condition.wait()
                calls, self._calls = self._calls, {}
                if self._stopping and not calls:
                    self._ended = True
                    return
            for call in calls.values():
                self._guarded(call)
            with self._condition:
                if not self._items:
                    continue
                item = self._items.popleft()
            begun = time.monotonic()
            self._guarded(partial(self._work, item))
            with self._condition:
                self._work_s.add(time.monotonic() - begun)
            # Keep no reference while waiting: an image pair is 10 MB.
            del item

    def _guarded(self, function: Callable[[], None]) -> None:
        try:
            function()
        except Exception as error:  # the thread must outlive any fault of one frame
            self._failed(error)
