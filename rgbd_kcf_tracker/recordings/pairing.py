# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Colour and depth messages brought together by their stamps, live or from a recording.

Exact first: two messages of one stamp belong together at once (kinect2_bridge, RealSense with
``enable_sync``). Else a colour image gets the nearest depth within the tolerance, decided as soon
as both streams have moved on so far that nothing nearer can come. A depth image is given to one
colour image at most.

Buffers are bounded. A stamp that was seen before is a duplicate and is dropped; a stamp that lies
far before the newest one means that time jumped back (a bag that loops, a restarted driver): what
waits is given out, and pairing starts afresh.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

C = TypeVar('C')
D = TypeVar('D')

DEFAULT_TOLERANCE_S = 0.02
"""Well under the 33 ms between frames at 30 Hz, and above the jitter of unsynchronised streams."""


JUMP_BACK_S = 1.0
"""Seconds by which what is older than the newest has not changed places with it, but was taken
before time jumped back: no stream's messages overtake each other by so much."""


def rising(stamps: Iterable[int]) -> tuple[int, ...]:
    """Stamps in nanoseconds, each at least one after that before, but where time jumps back.

    >>> rising([5, 5, 7, 6, 9])
    (5, 6, 7, 8, 9)
    """
    told: list[int] = []
    for stamp in stamps:
        if told and told[-1] - JUMP_BACK_S * 1e9 <= stamp <= told[-1]:
            stamp = told[-1] + 1
        told.append(stamp)
    return tuple(told)


@dataclass(frozen=True, slots=True)
class Pair(Generic[C, D]):
    """A colour message with its depth, or without one.

    Attributes:
        stamp_ns: of the colour message.
        color: the message that was given to :meth:`StampPairer.add_color`.
        depth: the depth message, or None where none came near enough.
        depth_stamp_ns: its stamp, or None.
        restarted: time jumped back before this pair.
    """

    stamp_ns: int
    color: C
    depth: D | None
    depth_stamp_ns: int | None
    restarted: bool = False


@dataclass(slots=True)
class PairingCounts:
    """What a :class:`StampPairer` has seen since it was made.

    Attributes:
        color, depth: messages taken in.
        exact, nearest: pairs of equal stamp, and pairs within the tolerance.
        color_alone, depth_alone: messages that found no partner.
        duplicates: messages whose stamp had been seen on their stream.
        late: messages older than what was already given out.
        jumps_back: times that the clock went back.
        overflow: messages given up because a buffer was full.
    """

    color: int = 0
    depth: int = 0
    exact: int = 0
    nearest: int = 0
    color_alone: int = 0
    depth_alone: int = 0
    duplicates: int = 0
    late: int = 0
    jumps_back: int = 0
    overflow: int = 0


class StampPairer(Generic[C, D]):
    """Pairs two streams by stamp. Each ``add`` returns the pairs that are now decided, in order.

    Every colour message comes out exactly once (unless it is a duplicate or late), with depth or,
    after the depth stream has passed it, without. Pairs come out in rising order of stamp between
    two jumps back.

    Args:
        tolerance_s: largest distance of stamps within a pair, seconds; 0 for equal stamps only.
        capacity: messages held per stream.
        patience_s: how far the depth stream must be past a colour message before that goes out
            alone; above 0 for streams whose messages change places on the way.
        max_wait_s: how far the colour stream may run ahead of a colour message that waits.
        jump_back_s: a message so much older than the newest is a jump back, not a late message.
        by_rate: give out a pair within the tolerance at once where, at the rates seen so far, no
            nearer partner will come; else stamps alone decide.
        depth_capacity: depth messages held, where that is another number.
    """

    def __init__(
        self,
        tolerance_s: float = DEFAULT_TOLERANCE_S,
        capacity: int = 30,
        patience_s: float = 0.0,
        max_wait_s: float = 0.5,
        jump_back_s: float = JUMP_BACK_S,
        by_rate: bool = True,
        depth_capacity: int | None = None,
    ) -> None:
        self.tolerance_ns = round(tolerance_s * 1e9)
        self.capacity = max(capacity, 1)
        self.depth_capacity = self.capacity if depth_capacity is None else max(depth_capacity, 1)
        self.patience_ns = round(patience_s * 1e9)
        self.max_wait_ns = round(max_wait_s * 1e9)
        self.jump_back_ns = round(jump_back_s * 1e9)
        self.by_rate = by_rate
        self.counts = PairingCounts()
        self._colors: dict[int, C] = {}
        self._depths: dict[int, D] = {}
        self._color_clock = _Clock()
        self._depth_clock = _Clock()
        self._last_out: int | None = None
        self._used_depths: dict[int, None] = {}
        self._restarted = False

    def add_color(self, stamp_ns: int, color: C) -> list[Pair[C, D]]:
        """Take in a colour message; returns the pairs now decided."""
        self.counts.color += 1
        out: list[Pair[C, D]] = []
        if self._color_clock.went_back(stamp_ns, self.jump_back_ns):
            self.counts.jumps_back += 1
            out = self._give_out_all()
            self._drop_depths_after(stamp_ns + self.jump_back_ns)
            self._color_clock = _Clock()
            self._last_out = None
            self._restarted = True
        if stamp_ns in self._colors or stamp_ns == self._last_out:
            self.counts.duplicates += 1
            return out
        if self._last_out is not None and stamp_ns < self._last_out:
            self.counts.late += 1
            return out
        self._colors[stamp_ns] = color
        self._color_clock.tick(stamp_ns)
        return out + self._decide()

    def add_depth(self, stamp_ns: int, depth: D) -> list[Pair[C, D]]:
        """Take in a depth message; returns the pairs now decided."""
        self.counts.depth += 1
        out: list[Pair[C, D]] = []
        if self._depth_clock.went_back(stamp_ns, self.jump_back_ns):
            # Colour that waits from before the jump gets no more depth; what came after it stays.
            out = self._give_out_all(after=stamp_ns + self.jump_back_ns)
            self._drop_depths_after(stamp_ns + self.jump_back_ns)
            self._depth_clock = _Clock()
            self._used_depths.clear()
        if stamp_ns in self._depths or stamp_ns in self._used_depths:
            self.counts.duplicates += 1
            return out
        self._depths[stamp_ns] = depth
        self._depth_clock.tick(stamp_ns)
        out += self._decide()
        while len(self._depths) > self.depth_capacity:
            del self._depths[min(self._depths)]
            self.counts.depth_alone += 1
            self.counts.overflow += 1
        return out

    def release(self, stamp_ns: int) -> list[Pair[C, D]]:
        """Give out every colour message up to this stamp with what there is for it by now."""
        return [self._take(s, self._partner(s)) for s in sorted(self._colors) if s <= stamp_ns]

    def flush(self) -> list[Pair[C, D]]:
        """Give out all that waits, as at the end of both streams."""
        out = self._give_out_all()
        self.counts.depth_alone += len(self._depths)
        self._depths.clear()
        self._used_depths.clear()
        return out

    @property
    def waiting(self) -> tuple[int, int]:
        """Colour and depth messages held at the moment."""
        return len(self._colors), len(self._depths)

    @property
    def waiting_colors(self) -> frozenset[int]:
        """Stamps of the colour messages that wait."""
        return frozenset(self._colors)

    def _decide(self) -> list[Pair[C, D]]:
        out: list[Pair[C, D]] = []
        while self._colors:
            stamp = min(self._colors)
            partner = self._partner(stamp)
            if not self._settled(stamp, partner):
                if len(self._colors) <= self.capacity:
                    break
                self.counts.overflow += 1
            out.append(self._take(stamp, partner))
        return out

    def _partner(self, stamp: int) -> int | None:
        """Stamp of the depth that fits best, leaving to other colour messages what is theirs."""
        if stamp in self._depths:
            return stamp
        best: int | None = None
        for depth in self._depths:
            distance = abs(depth - stamp)
            if distance > self.tolerance_ns or depth in self._colors:
                continue
            if best is not None and distance >= abs(best - stamp):
                continue
            if all(abs(depth - other) >= distance for other in self._colors):
                best = depth
        return best

    def _settled(self, stamp: int, partner: int | None) -> bool:
        """Whether nothing that may still come could change the colour message's partner."""
        if partner == stamp:
            return True
        newest_color, newest_depth = self._color_clock.newest, self._depth_clock.newest
        if newest_color is not None and newest_color - stamp >= self.max_wait_ns:
            return True
        # A depth far ahead is from before a jump back, or has a wrong stamp: it passes nothing.
        passed = newest_depth is not None and (
            stamp + self.patience_ns < newest_depth < stamp + self.jump_back_ns
        )
        if partner is None:
            return passed
        clock, seen = self._depth_clock, passed
        if partner > stamp:
            clock, seen = self._color_clock, newest_color is not None and newest_color >= partner
        return seen or (self.by_rate and 2 * abs(partner - stamp) < clock.shortest_gap)

    def _take(self, stamp: int, partner: int | None) -> Pair[C, D]:
        color = self._colors.pop(stamp)
        depth: D | None = None
        if partner is None:
            self.counts.color_alone += 1
        else:
            depth = self._depths.pop(partner)
            if partner == stamp:
                self.counts.exact += 1
            else:
                self.counts.nearest += 1
            self._used_depths[partner] = None
            if len(self._used_depths) > 2 * self.capacity:
                del self._used_depths[next(iter(self._used_depths))]
        self._last_out = stamp
        for old in [d for d in self._depths if d < stamp - self.tolerance_ns]:
            del self._depths[old]
            self.counts.depth_alone += 1
        restarted, self._restarted = self._restarted, False
        return Pair(stamp, color, depth, partner, restarted)

    def _give_out_all(self, after: int | None = None) -> list[Pair[C, D]]:
        out = []
        for stamp in sorted(self._colors):
            if after is None or stamp > after:
                out.append(self._take(stamp, self._partner(stamp)))
        return out

    def _drop_depths_after(self, stamp: int) -> None:
        for depth in [d for d in self._depths if d > stamp]:
            del self._depths[depth]
            self.counts.depth_alone += 1


def patient_pairer(
    tolerance_s: float = DEFAULT_TOLERANCE_S, depth_capacity: int | None = None
) -> StampPairer[C, D]:
    """The pairer for where every pair counts and time does not: recordings, and lock-step.

    Stamps alone decide, however late one stream is: the tracker, the replay node that waits for its
    answers, and the reader of recordings must agree on what is a pair.

    Args:
        tolerance_s: see :class:`StampPairer`.
        depth_capacity: depth messages held; fewer where they are the images themselves.
    """
    return StampPairer(
        tolerance_s,
        capacity=1000,
        max_wait_s=60.0,
        by_rate=False,
        depth_capacity=depth_capacity,
    )


class _Clock:
    """Newest stamp of a stream, and the shortest of its last few steps."""

    __slots__ = ('_gaps', 'newest')

    def __init__(self) -> None:
        self.newest: int | None = None
        self._gaps: deque[int] = deque(maxlen=5)

    def went_back(self, stamp: int, by: int) -> bool:
        return self.newest is not None and stamp < self.newest - by

    def tick(self, stamp: int) -> None:
        if self.newest is None:
            self.newest = stamp
        elif stamp > self.newest:
            self._gaps.append(stamp - self.newest)
            self.newest = stamp

    @property
    def shortest_gap(self) -> float:
        return min(self._gaps, default=float('inf'))
