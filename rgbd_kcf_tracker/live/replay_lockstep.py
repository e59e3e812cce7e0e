# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Which colour images a tracker must still answer, and how long each answer took.

A tracker answers each pair of colour and depth with one message that carries the colour image's
stamp. In lock-step the next message waits until nothing is left to answer, so no queue on the way
ever overflows and a run does not depend on the machine's speed.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable

from rgbd_kcf_tracker.live.stopping import Stopping
from rgbd_kcf_tracker.recordings.pairing import (
    DEFAULT_TOLERANCE_S,
    Pair,
    StampPairer,
    patient_pairer,
)

AHEAD = 30
"""Colour images that may be under way without being due: depth a second late, at 30 Hz."""
AT_ONCE, PERIOD_S = 4, 1 / 30
"""Of these so many go out at once, fewer than a tracker's subscription holds; then at 30 Hz."""
REMEMBERED = 1024
"""Answers that are waited for at most when nobody answers at all."""
LATENCIES = 100_000
"""Latencies that are kept for the report: of an hour at 30 Hz, in 3 MB for any number of loops."""


class Answers:
    """Matches what was sent with what came back. Safe to use from several threads.

    Pairs are decided by the pairer that a tracker with ``queue_policy`` all has: a pair of unequal
    stamps is known to be one only when later images have come, and to wait for its answer earlier
    would be to wait for ever. Where depth has stopped, the tracker gives up waiting for it by the
    wall clock, and :data:`AHEAD` holds the images back until then.

    Answers come in the order of the images: one that a tracker has passed over (with
    ``queue_policy`` newest it takes the newest that waits) is not waited for, and counts as
    unanswered.

    Args:
        has_depth: without a depth topic each colour image is answered alone.
        tolerance_s: largest difference between the stamps of a pair, as the tracker has it.
        now: the wall clock in seconds, monotonic.

    Attributes:
        pairs: how many answers were due so far.
        latencies_s: from the sending of the colour image to its answer, of the last answers.
        heard: how many answers came in all.
        unanswered: answers that were given up.
    """

    def __init__(
        self,
        has_depth: bool,
        tolerance_s: float = DEFAULT_TOLERANCE_S,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._has_depth = has_depth
        self._pairer: StampPairer[float, None] = patient_pairer(tolerance_s)
        self._now = now
        self._changed = threading.Condition()
        self._due: dict[int, float] = {}
        self._early: dict[int, float] = {}
        self._undecided: dict[int, float] = {}
        self._reached = -math.inf
        self.pairs = 0
        self.latencies_s: deque[float] = deque(maxlen=LATENCIES)
        self.heard = 0
        self.unanswered = 0

    def sent_color(self, stamp_ns: int) -> None:
        """A colour image is about to go out."""
        with self._changed:
            now = self._now()
            if self._has_depth:
                self._expect(self._pairer.add_color(stamp_ns, now))
                # Time that jumped back may have decided on another image of this stamp.
                if stamp_ns in self._pairer.waiting_colors:
                    self._undecided[stamp_ns] = now
            else:
                self._expect([Pair(stamp_ns, now, None, None)])

    def sent_depth(self, stamp_ns: int) -> None:
        """A depth image is about to go out."""
        with self._changed:
            self._expect(self._pairer.add_depth(stamp_ns, None))

    def sent_all(self) -> None:
        """Nothing more will come: images without a partner are answered alone."""
        with self._changed:
            self._expect(self._pairer.flush())

    def answered(self, stamp_ns: int) -> None:
        """The tracker has answered the colour image of this stamp."""
        with self._changed:
            sent = self._due.pop(stamp_ns, None)
            self._changed.notify_all()
            if sent is not None:
                self._hear(self._now() - sent)
            else:
                sent = self._undecided.get(stamp_ns)
                # The tracker may decide sooner, when the depth image never arrived.
                self._early[stamp_ns] = self._now()
                while len(self._early) > REMEMBERED:
                    del self._early[next(iter(self._early))]
            if sent is not None:
                self._pass_over(sent)

    def _hear(self, latency_s: float) -> None:
        self.latencies_s.append(latency_s)
        self.heard += 1

    def _pass_over(self, before: float) -> None:
        """Wait no longer for what was sent before an image that has its answer."""
        self._reached = max(self._reached, before)
        passed = [stamp for stamp, sent in self._due.items() if sent < before]
        for stamp in passed:
            del self._due[stamp]
        self.unanswered += len(passed)

    def wait(self, timeout_s: float, stop: Stopping) -> bool:
        """Wait until everything due is answered; False after ``timeout_s`` or when stopped.

        Also waits, as long at most, while too much is under way that may be due later.
        """
        deadline = self._now() + timeout_s
        with self._changed:
            while self._due:
                left = deadline - self._now()
                if left <= 0 or stop.is_set():
                    return False
                self._changed.wait(min(left, 0.1))
            if self._under_way() > AT_ONCE and not stop.is_set():
                self._changed.wait(min(PERIOD_S, timeout_s))
            while self._under_way() > AHEAD and self._now() < deadline and not stop.is_set():
                self._changed.wait(0.1)
        return True

    def drain(self, quiet_s: float, stop: Stopping) -> bool:
        """Wait as long as answers still come; False where some are missing after ``quiet_s``."""
        seen = -1
        while seen != self.heard and not stop.is_set():
            seen = self.heard
            if self.wait(quiet_s, stop):
                return True
        return False

    def give_up(self) -> list[int]:
        """Wait no longer for what is unanswered; returns its stamps."""
        with self._changed:
            stamps = list(self._due)
            self._due.clear()
            self.unanswered += len(stamps)
            return stamps

    def _under_way(self) -> int:
        sent = self._undecided
        waiting = self._pairer.waiting_colors - self._early.keys()
        return sum(sent[stamp] >= self._reached for stamp in waiting)

    def _expect(self, pairs: Iterable[Pair[float, None]]) -> None:
        for pair in pairs:
            self.pairs += 1
            self._undecided.pop(pair.stamp_ns, None)
            answered_at = self._early.pop(pair.stamp_ns, None)
            if answered_at is not None and answered_at >= pair.color:
                self._hear(answered_at - pair.color)
                continue
            if pair.color < self._reached:
                self.unanswered += 1
                continue
            self._due[pair.stamp_ns] = pair.color
            while len(self._due) > REMEMBERED:
                del self._due[next(iter(self._due))]
                self.unanswered += 1
