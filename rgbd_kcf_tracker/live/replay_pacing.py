# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""When each message of a recording is due on the wall clock."""

from __future__ import annotations

import time
from collections.abc import Callable

from rgbd_kcf_tracker.live.stopping import Stopping

CLOCK_PERIOD_S = 0.01
"""Recorded time is announced at least this often while waiting: 100 Hz."""


class Pacer:
    """Keeps the recorded gaps, divided by ``rate``.

    The schedule is absolute, so that small delays do not add up. Who falls behind catches up, but
    not by more than ``patience_s``: then the schedule starts anew from the message at hand, as a
    camera does not send a minute of images at once.

    Args:
        rate: 2 is twice as fast as recorded; 0 is as fast as possible.
        patience_s: how far behind the schedule may fall before it starts anew.
        now: the wall clock in seconds, monotonic.
    """

    def __init__(
        self,
        rate: float,
        patience_s: float = 1.0,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._rate = rate
        self._patience_s = patience_s
        self._now = now
        self._origin: tuple[float, int] | None = None
        self._pause_ns = 0
        self.restarts = 0

    def due(self, time_ns: int) -> float:
        """Wall-clock time at which the message recorded at ``time_ns`` is due."""
        now = self._now()
        if self._rate == 0:
            self._origin = (now, time_ns)
            return now
        if self._origin is None:
            self._origin = (now + self._pause_ns * 1e-9 / self._rate, time_ns)
            return self._origin[0]
        wall, recorded_ns = self._origin
        due = wall + (time_ns - recorded_ns) * 1e-9 / self._rate
        if now - due > self._patience_s:
            self._origin = (now, time_ns)
            self.restarts += 1
            return now
        return due

    def left(self, time_ns: int) -> float:
        """Seconds until the message recorded at ``time_ns`` is due."""
        return self.due(time_ns) - self._now()

    def recorded(self) -> int | None:
        """The recorded time that it is now; None before the first message."""
        if self._origin is None:
            return None
        wall, recorded_ns = self._origin
        return recorded_ns + int((self._now() - wall) * self._rate * 1e9)

    def reset(self, pause_ns: int = 0) -> None:
        """Start anew at the next message, after a pause in recorded time."""
        self._origin, self._pause_ns = None, pause_ns

    def wait(self, time_ns: int, stop: Stopping, tick: Callable[[int], None] | None = None) -> bool:
        """Wait until the message recorded at ``time_ns`` is due; False when ``stop`` was set.

        Args:
            time_ns: recorded time of the message.
            stop: ends the wait.
            tick: told the recorded time every :data:`CLOCK_PERIOD_S` while waiting.
        """
        due = self.due(time_ns)
        while (left := due - self._now()) > 0:
            if stop.wait(min(left, CLOCK_PERIOD_S)):
                return False
            recorded = self.recorded()
            if tick is not None and recorded is not None:
                tick(min(recorded, time_ns))
        return not stop.is_set()
