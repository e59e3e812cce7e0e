# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What happens to the target, in words for people: each turn once, and not each flicker."""

from __future__ import annotations

import time
from collections.abc import Callable

from rgbd_kcf_tracker.track import Track, TrackState

SETTLED_NS = 500_000_000
"""Nanoseconds for which a target must be hidden, or seen again, before it is worth a word."""


def taken(track: Track, how: str = 'taken') -> str:
    """The words for a new target."""
    assert track.box is not None
    box = ','.join(f'{value:.0f}' for value in track.box.as_tuple())
    return f'target {track.id} {how}: box {box}{_away(track)}'


def _away(track: Track) -> str:
    return '' if track.depth is None else f', {track.depth:.1f} m away'


class Story:
    """Tells when the chosen target is hidden, lost and found again.

    Args:
        tell: told in words.
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell
        self._told = TrackState.IDLE
        self._turned: tuple[TrackState, int] | None = None

    def restart(self, track: Track | None = None) -> None:
        """There is another target, or none."""
        self._told = TrackState.IDLE if track is None else track.state
        self._turned = None

    def follow(self, track: Track, stamp_ns: int) -> None:
        """Take the chosen target's track of a frame; stamps only rise."""
        state = track.state
        if state in (self._told, TrackState.IDLE):
            self._turned = None
            return
        if self._turned is None or self._turned[0] is not state:
            self._turned = (state, stamp_ns)
        # Given up looking near is itself long after the target was seen last.
        if state is not TrackState.LOST and stamp_ns - self._turned[1] < SETTLED_NS:
            return
        if state is TrackState.TRACKING:
            words = f'found again{_away(track)}'
        else:
            words = 'occluded' if state is TrackState.OCCLUDED else 'lost: searched for everywhere'
        self._told, self._turned = state, None
        self._tell(f'target {track.id} {words}')


class Allowance:
    """Says how often something may be said: so many at once, then so many a second.

    Args:
        most: at once.
        a_second: saved up to that many.
        now: seconds on a clock that only rises.
    """

    def __init__(
        self, most: int, a_second: float, now: Callable[[], float] = time.monotonic
    ) -> None:
        self._most, self._a_second, self._now = most, a_second, now
        self._left, self._at = float(most), now()

    def allowed(self) -> bool:
        """Whether it may be said now, which uses it up."""
        now = self._now()
        saved = self._left + (now - self._at) * self._a_second
        self._left, self._at = min(saved, self._most), now
        if self._left < 1:
            return False
        self._left -= 1
        return True
