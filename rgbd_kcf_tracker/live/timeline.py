# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Time is judged here: one that only moves forward, out of stamps that may not.

Cameras send stamps that are zero, equal, jump back (a bag that loops) or are years ahead (a clock
not set). Headers of results always copy what the camera sent; this is the time that the tracker is
given. As long as stamps behave, it is the stamp itself. Before images are paired, stamps that say
nothing are replaced (:class:`StampRepair`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rgbd_kcf_tracker.recordings.images import as_bytes
from rgbd_kcf_tracker.recordings.storage import NANOSECONDS

LARGEST_STEP_NS = 60 * NANOSECONDS
"""A step forward that is larger than the time since the last image by more than this is taken for a
wrong stamp or a new recording, not for a pause."""
LEAST_STEP_NS = 1_000_000
"""Time goes on by this much at the least where a stamp does not."""
PACE_NS, STILL = (5_000_000, 100_000_000), 3
"""Between two pictures of a camera, and how many that are all the same and have one stamp must have
come so until they count: that camera has no clock and sees what stands still. Copies come at once,
or after longer, as a replay in lock-step sends an image again until it is answered."""

SPARSE = 1009
"""Of so many bytes one is compared first: a prime number, so that they lie in all columns."""


@dataclass(frozen=True, slots=True)
class Instant:
    """One image's place in time.

    Attributes:
        time_ns: rising strictly; equal to the stamps until the first fault in them.
        jumped: the stamps left their course here: back, or ahead by a minute more than went by.
        restarted: they went back for good, as a loop does; not the return from one wrong stamp.
    """

    time_ns: int
    jumped: bool = False
    restarted: bool = False


class Timeline:
    """Turns stamps into rising time; steps that cannot be right are taken from the arrival."""

    def __init__(self) -> None:
        self._time: int | None = None
        self._stamp = 0
        self._arrival = 0
        self._before_jump: tuple[int, int] | None = None  # the stamp, and its arrival

    def advance(self, stamp_ns: int, arrival_ns: int) -> Instant:
        """The instant of an image.

        Args:
            stamp_ns: of its header.
            arrival_ns: when it came, on any clock that never goes back.
        """
        if self._time is None:
            self._time, self._stamp, self._arrival = stamp_ns, stamp_ns, arrival_ns
            return Instant(stamp_ns)
        step = stamp_ns - self._stamp
        waited = max(arrival_ns - self._arrival, LEAST_STEP_NS)
        jumped = restarted = False
        if not 0 < step <= waited + LARGEST_STEP_NS:
            jumped = step != 0
            restarted = step < 0 and not self._returns(stamp_ns, arrival_ns)
            self._before_jump = (self._stamp, self._arrival) if step > 0 else None
            step = min(waited, LARGEST_STEP_NS)
        elif self._before_jump is not None:
            self._before_jump = None  # two images on the new course: it is the course now
        self._time += step
        self._stamp, self._arrival = stamp_ns, arrival_ns
        return Instant(self._time, jumped, restarted)

    def _returns(self, stamp_ns: int, arrival_ns: int) -> bool:
        """Whether the stamps go on as before the last one, however long a pause there was."""
        if self._before_jump is None:
            return False
        stamp, arrival = self._before_jump
        return 0 < stamp_ns - stamp <= arrival_ns - arrival + LARGEST_STEP_NS


class StampRepair:
    """Stamps of one stream, those that say nothing replaced by the time of arrival.

    A stamp that comes again with another picture stands still: from then on it is the time of its
    first arrival, and what follows it is as much later as it comes later. Streams that are to be
    paired must agree on that first arrival, as none of them tells whether it missed some images.
    Of a clock that was seen to go on each stream counts for itself: there equal stamps do tell what
    belongs together, however late a stream is.

    Args:
        standing: when the stamps that stand still came first, shared by the streams of one camera.
            There is one for each stream at most, as it is dropped when its stream goes on.
    """

    def __init__(self, standing: dict[int, int]) -> None:
        self._standing = standing
        self._stamp: int | None = None
        self._goes_on = False
        self._first = self._came = self._paced = 0
        self._repaired = 0
        self._data: Any = None

    def __call__(self, stamp_ns: int, arrival_ns: int, data: Any) -> int | None:
        """The stamp to pair by; None where the message is the last one over again."""
        gap, self._came = arrival_ns - self._came, arrival_ns
        if stamp_ns == self._stamp:
            if same_bytes(data, self._data):
                self._paced = self._paced + 1 if PACE_NS[0] <= gap < PACE_NS[1] else 0
                if self._paced <= STILL:
                    return None
            first = self._standing.setdefault(stamp_ns, self._first)
            if not self._goes_on:
                self._first = first
            repaired = max(stamp_ns + arrival_ns - self._first, self._repaired + 1)
        else:
            repaired = self._next(stamp_ns, arrival_ns)
        self._stamp, self._data, self._repaired = stamp_ns, data, repaired
        return repaired

    def _next(self, stamp_ns: int, arrival_ns: int) -> int:
        """Take up a stamp that is not the last one."""
        self._paced, self._first, self._goes_on = 0, arrival_ns, False
        if self._stamp is not None:
            self._standing.pop(self._stamp, None)
            self._goes_on = 0 < stamp_ns - self._stamp <= LARGEST_STEP_NS
        if not self._goes_on:
            self._first = self._standing.get(stamp_ns, arrival_ns)
        elif 0 <= self._repaired - stamp_ns < PACE_NS[1]:
            return self._repaired + 1  # what repeated the stamp before was late by so much
        return stamp_ns + arrival_ns - self._first


def same_bytes(data: Any, other: Any) -> bool:
    """Whether two messages are the same to the last bit; mostly a few of their bytes tell."""
    one, two = (np.frombuffer(as_bytes(d), np.uint8) for d in (data, other))
    if len(one) != len(two) or not np.array_equal(one[::SPARSE], two[::SPARSE]):
        return False
    return np.array_equal(one, two)
