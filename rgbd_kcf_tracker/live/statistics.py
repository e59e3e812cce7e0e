# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the node counts: received, processed, dropped, how long it took, and what went wrong."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The counts at one moment.

    Attributes:
        counts: all counters since the node was configured.
        recent: what was added to each since the last snapshot.
        seconds: time since the last snapshot.
        latency_ms: stamp to published result: mean, median, p99 and largest of the last images;
            empty where none was processed or stamps and clock have nothing to do with each other.
        work_ms: arrival of the pair to published result, likewise.
        last_error, error_age_s: the last fault in words, and how long ago.
        image_age_s: time since the last colour image came, None before the first.
        depth_age_s: likewise for depth.
    """

    counts: dict[str, int]
    recent: dict[str, int]
    seconds: float
    latency_ms: tuple[float, ...]
    work_ms: tuple[float, ...]
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
        self._latencies: deque[float] = deque(maxlen=self.window)
        self._work: deque[float] = deque(maxlen=self.window)

    def count(self, name: str, number: int = 1) -> None:
        """Add to a counter."""
        if number:
            with self._lock:
                self._counts[name] += number

    def set(self, name: str, number: int) -> None:
        """Take a counter that somebody else keeps."""
        with self._lock:
            self._counts[name] = number

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

    def processed(self, latency_ms: float, work_ms: float) -> None:
        """A pair was answered."""
        with self._lock:
            self._counts['processed'] += 1
            self._latencies.append(latency_ms)
            self._work.append(work_ms)

    def snapshot(self) -> Snapshot:
        """The counts now; the next snapshot's ``recent`` starts here."""
        with self._lock:
            now = time.monotonic()
            recent = self._counts - self._before
            snapshot = Snapshot(
                counts=dict(self._counts),
                recent=dict(recent),
                seconds=max(now - self._taken, 1e-6),
                latency_ms=_summary([v for v in self._latencies if -1e3 < v < 6e4]),
                work_ms=_summary(list(self._work)),
                last_error=self._last_error,
                error_age_s=_age(now, self._error_time),
                image_age_s=_age(now, self._image_time),
                depth_age_s=_age(now, self._depth_time),
            )
            self._before = self._counts.copy()
            self._taken = now
            return snapshot


def _age(now: float, then: float | None) -> float | None:
    return None if then is None else now - then


def _summary(values: list[float]) -> tuple[float, ...]:
    if not values:
        return ()
    median, p99 = np.percentile(values, (50, 99))
    return float(np.mean(values)), float(median), float(p99), max(values)
