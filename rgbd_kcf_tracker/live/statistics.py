# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the node counts: received, processed, dropped, how long it took, and what went wrong."""

from __future__ import annotations

import math
import threading
import time
from collections import Counter, deque
from dataclasses import dataclass, field
from typing import NamedTuple


class Times(NamedTuple):
    """Where the time of one answer went, in milliseconds.

    Attributes:
        latency: stamp to published result, by the node's clock.
        work: complete pair to published result.
        transport: stamp to complete pair: the camera, DDS, and the wait for the depth image.
        waiting: complete pair to the worker's turn.
        decode, track, publish: the worker's steps.
    """

    latency: float
    work: float
    transport: float
    waiting: float
    decode: float
    track: float
    publish: float


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The counts at one moment.

    Attributes:
        counts: all counters since the node was configured.
        recent: what was added to each since the last snapshot.
        seconds: time since the last snapshot.
        times_ms: mean, median, p99 and largest of the last images, by the fields of
            :class:`Times`; empty where none was processed, or where stamps and clock have nothing
            to do with each other.
        last_error, error_age_s: the last fault in words, and how long ago.
        image_age_s: time since the last colour image came, or since the node began to listen again
            after it; None before the first.
        depth_age_s: likewise for depth.
    """

    counts: dict[str, int]
    recent: dict[str, int]
    seconds: float
    times_ms: dict[str, tuple[float, ...]]
    last_error: str
    error_age_s: float | None
    image_age_s: float | None
    depth_age_s: float | None


@dataclass
class Statistics:
    """Counters that the executor's thread and the worker share."""

    window: int = 300
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _counts: Counter[str] = field(default_factory=Counter)
    _before: Counter[str] = field(default_factory=Counter)
    _taken: float = field(default_factory=time.monotonic)
    _last_error: str = ''
    _error_time: float | None = None
    _image_time: float | None = None
    _depth_time: float | None = None

    def __post_init__(self) -> None:
        self._times: deque[Times] = deque(maxlen=self.window)

    def count(self, name: str, number: int = 1) -> None:
        """Add to a counter."""
        if number:
            with self._lock:
                self._counts[name] += number

    def listening(self) -> None:
        """The node begins to hear images: nothing could come for as long as it did not."""
        with self._lock:
            now = time.monotonic()
            self._image_time = None if self._image_time is None else now
            self._depth_time = None if self._depth_time is None else now

    def image_came(self) -> None:
        """A colour image was received."""
        with self._lock:
            self._counts['color_received'] += 1
            self._image_time = time.monotonic()

    def depth_came(self) -> None:
        """A depth image was received."""
        with self._lock:
            self._counts['depth_received'] += 1
            self._depth_time = time.monotonic()

    def error(self, kind: str, text: str) -> None:
        """Something went wrong: counted by kind, the last one kept in words."""
        with self._lock:
            self._counts[kind] += 1
            self._last_error = text
            self._error_time = time.monotonic()

    def processed(self, times: Times) -> None:
        """A pair was answered."""
        with self._lock:
            self._counts['processed'] += 1
            self._times.append(times)

    def snapshot(self) -> Snapshot:
        """The counts now; the next snapshot's ``recent`` starts here."""
        with self._lock:
            now = time.monotonic()
            times = list(self._times)
            snapshot = Snapshot(
                counts=dict(self._counts),
                recent=dict(self._counts - self._before),
                seconds=max(now - self._taken, 1e-6),
                times_ms={},
                last_error=self._last_error,
                error_age_s=_age(now, self._error_time),
                image_age_s=_age(now, self._image_time),
                depth_age_s=_age(now, self._depth_time),
            )
            self._before = self._counts.copy()
            self._taken = now
        # Out of the lock, for which the worker would wait.
        for name, values in zip(Times._fields, zip(*times, strict=True), strict=False):
            snapshot.times_ms[name] = _summary(sorted(v for v in values if -1e3 < v < 6e4))
        return snapshot


def _age(now: float, then: float | None) -> float | None:
    return None if then is None else now - then


def _summary(values: list[float]) -> tuple[float, ...]:
    """Mean, median, p99 and largest of ascending values.

    NumPy takes five times as long over a few hundred, while which no image is worked on.
    """
    if not values:
        return ()
    last = len(values) - 1
    median, p99 = (values[round(share * last)] for share in (0.5, 0.99))
    return math.fsum(values) / len(values), median, p99, values[-1]
