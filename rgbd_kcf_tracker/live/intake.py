# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Receiving: messages in, captures out. Only stores, never decodes, so that it takes no time.

Pairing itself is the recordings' (:class:`StampPairer`), so that live and recorded images are
paired by one rule. What a live stream needs beyond it is here: stamps that say nothing (always the
same, mostly zero) are replaced by the arrival, a colour image waits only so long for its depth, and
the first ones wait for the camera_info that comes with them.
"""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from rgbd_kcf_tracker.live.processor import Camera, Capture
from rgbd_kcf_tracker.live.statistics import Statistics
from rgbd_kcf_tracker.recordings.images import as_bytes
from rgbd_kcf_tracker.recordings.messages import stamp_of
from rgbd_kcf_tracker.recordings.pairing import Pair, StampPairer

MISSES = 3
"""Colour images in a row without depth after which depth is not waited for any more."""
PATIENT_WAIT_S = 1.0
"""Least wait for depth where every pair counts and speed does not."""
HELD = 5


class StampRepair:
    """Stamps of one stream, those that say nothing replaced by the time of arrival."""

    def __init__(self) -> None:
        self._stamp: int | None = None
        self._repaired = 0
        self._arrival = 0
        self._data: Any = None

    def __call__(self, stamp_ns: int, arrival_ns: int, data: Any) -> int | None:
        """The stamp to pair by; None where the message is the last one over again."""
        repaired = stamp_ns
        if stamp_ns == self._stamp:
            if _same(data, self._data):
                return None
            repaired = self._repaired + max(arrival_ns - self._arrival, 1)
        self._stamp, self._data = stamp_ns, data
        self._repaired, self._arrival = repaired, arrival_ns
        return repaired


class LivePairer(StampPairer[Any, Any]):
    """A pairer that can be told that a message has waited long enough."""

    def release(self, stamp_ns: int) -> list[Pair[Any, Any]]:
        """Give out every colour message up to this stamp with what there is for it."""
        return [self._take(s, self._partner(s)) for s in sorted(self._colors) if s <= stamp_ns]

    def waiting_colors(self) -> frozenset[int]:
        """Stamps of the colour messages that wait."""
        return frozenset(self._colors)


class Intake:
    """Pairs the messages of the two image streams.

    Args:
        statistics: where to count.
        tolerance_s: of stamps within a pair.
        depth_wait_s: how long colour waits for depth.
        camera_info_wait_s: how long the first colour waits for intrinsics.
        patient: every pair counts (recordings, lock-step): wait longer rather than miss a partner.
    """

    def __init__(
        self,
        statistics: Statistics,
        *,
        tolerance_s: float,
        depth_wait_s: float,
        camera_info_wait_s: float,
        patient: bool,
    ) -> None:
        self._statistics = statistics
        # As recordings are paired where every pair counts: stamps alone decide, not the rate.
        self._pairer = (
            LivePairer(tolerance_s, capacity=1000, max_wait_s=60.0)
            if patient
            else LivePairer(tolerance_s)
        )
        self._wait_ns = round(depth_wait_s * 1e9)
        self._info_wait_ns = round(camera_info_wait_s * 1e9)
        self._patient = patient
        self._repair_color, self._repair_depth = StampRepair(), StampRepair()
        self._arrivals: dict[int, int] = {}
        self._misses = 0
        self._held: deque[Capture] = deque()
        self._hold_from: int | None = None
        self._holding = True
        self._camera: Camera | None = None
        self.info_expected = True
        self.depth_expected = True

    @property
    def idle(self) -> bool:
        """Whether nothing waits, so that :meth:`poll` has nothing to do."""
        return not self._arrivals and not self._held

    def camera_info(self, camera: Camera, arrival_ns: int) -> list[Capture]:
        """Take in what the camera says of itself; returns what waited for it."""
        self._camera = camera
        return self._release_held(arrival_ns)

    def color(self, message: Any, arrival_ns: int) -> list[Capture]:
        """Take in a colour message; returns the pairs that are now complete."""
        self._statistics.image_came()
        header_stamp = stamp_of(message)
        stamp = self._repair_color(header_stamp, arrival_ns, message.data)
        if stamp is None:
            self._statistics.count('duplicates')
            return []
        self._arrivals[stamp] = arrival_ns
        captures = self._captures(self._pairer.add_color(stamp, message), arrival_ns)
        return captures + self.poll(arrival_ns)

    def depth(self, message: Any, arrival_ns: int) -> list[Capture]:
        """Take in a depth message; returns the pairs that are now complete."""
        self._statistics.depth_came()
        header_stamp = stamp_of(message)
        stamp = self._repair_depth(header_stamp, arrival_ns, message.data)
        if stamp is None:
            self._statistics.count('duplicates')
            return []
        self._misses = 0
        return self._captures(self._pairer.add_depth(stamp, message), arrival_ns)

    def poll(self, now_ns: int) -> list[Capture]:
        """What has waited long enough; to be called every few hundredths of a second."""
        wait = self._present_wait_ns()
        overdue = [s for s, arrival in self._arrivals.items() if now_ns - arrival >= wait]
        captures: list[Capture] = []
        if overdue:
            captures = self._captures(self._pairer.release(max(overdue)), now_ns)
        if self._held and self._waited_for_info(now_ns):
            captures = self._release_held(now_ns) + captures
        return captures

    def _present_wait_ns(self) -> int:
        if not self.depth_expected:
            return 0
        if self._misses >= MISSES:
            return self._wait_ns if self._patient else 0
        least = round(PATIENT_WAIT_S * 1e9) if self._patient else 0
        return max(self._wait_ns, least)

    def _captures(self, pairs: list[Pair[Any, Any]], now_ns: int) -> list[Capture]:
        captures = []
        for pair in pairs:
            self._arrivals.pop(pair.stamp_ns, None)
            if pair.depth is None:
                self._misses += 1
                self._statistics.count('color_without_depth')
            captures.append(Capture(pair.color, pair.depth, self._camera, now_ns))
        self._forget_lost()
        counts = self._pairer.counts
        self._statistics.set('late', counts.late)
        self._statistics.set('repeated', counts.duplicates)
        self._statistics.set('depth_without_color', counts.depth_alone)
        if pairs:
            self._statistics.count('pairs', len(pairs))
        return self._hold(captures, now_ns) if self._holding else captures

    def _forget_lost(self) -> None:
        """Drop the arrivals of messages that the pairer did not keep (late, repeated)."""
        if len(self._arrivals) > self._pairer.waiting[0]:
            known = self._pairer.waiting_colors()
            self._arrivals = {s: a for s, a in self._arrivals.items() if s in known}

    def _hold(self, captures: list[Capture], now_ns: int) -> list[Capture]:
        """Keep the first captures until there are intrinsics, as long as that is worth it."""
        if not captures:
            return captures
        if self._camera is not None or not (self.info_expected or self._patient):
            return self._release_held(now_ns) + captures
        if self._hold_from is None:
            self._hold_from = now_ns
        self._held.extend(captures)
        if self._waited_for_info(now_ns) or (len(self._held) > HELD and not self._patient):
            return self._release_held(now_ns)
        return []

    def _waited_for_info(self, now_ns: int) -> bool:
        return self._hold_from is not None and now_ns - self._hold_from >= self._info_wait_ns

    def _release_held(self, now_ns: int) -> list[Capture]:
        self._holding = False
        held = [Capture(c.color, c.depth, self._camera, now_ns) for c in self._held]
        self._held.clear()
        return held


def _same(data: Any, other: Any) -> bool:
    one, two = as_bytes(data), as_bytes(other)
    return len(one) == len(two) and np.array_equal(
        np.frombuffer(one, np.uint8), np.frombuffer(two, np.uint8)
    )
