# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The target and who follows it: what was asked of the tracker, applied at the right frame.

Plain Python, one thread: the node's worker calls it; tests call it directly.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.parameters import Parameters
from rgbd_kcf_tracker.track import Track, TrackState
from rgbd_kcf_tracker.variants import create_tracker

Choice = Callable[[Frame], 'Box | None']
"""Finds the target in a frame: None to look again in the next. May raise an RgbdKcfError."""

IDLE = Track(None, TrackState.IDLE)
REQUESTS_SHARE = 0.2
"""Share of the time that may go into starting on targets: a storm of requests leaves the rest."""
REQUESTS_CREDIT_S = 0.3
"""So much of it is saved up: a few requests in a row are met at once."""


_warm: set[str] = set()


def warm_up(variant: str) -> None:
    """Have a variant run once, so that its lazy imports and caches do not delay a live frame."""
    if variant in _warm:
        return
    _warm.add(variant)
    rng = np.random.default_rng(0)
    color = rng.integers(0, 255, (120, 160, 3), np.uint8)
    depth = np.full((120, 160), 3.0, np.float32)
    depth[40:90, 60:90] = 2.0
    tracker = create_tracker(variant)
    camera = Intrinsics.guess(160, 120)
    tracker.start(Frame(color, depth, 0, camera), Box(60, 40, 30, 50))
    for step in range(1, 4):
        tracker.update(Frame(color, depth, step * 33_333_333, camera))


class Session:
    """One tracker, its target, and what waits for the next frame.

    Args:
        variant: name of the tracker.
        parameters: of that variant.
        report: told what went wrong with a request, in words for the user.
        now: the wall clock in seconds, monotonic.
    """

    def __init__(
        self,
        variant: str,
        parameters: Parameters,
        report: Callable[[str], None],
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._variant, self._parameters = variant, parameters
        self._wanted = (variant, parameters)
        self._tracker = create_tracker(variant, parameters)
        self._report = report
        self._choice: Choice | None = None
        self._auto: Choice | None = None
        self._auto_again = False
        self._now = now
        self._credit_s, self._credited = REQUESTS_CREDIT_S, now()
        self.track = IDLE

    @property
    def variant(self) -> str:
        """Name of the tracker at work."""
        return self._variant

    @property
    def needs_frame(self) -> bool:
        """Whether the next frame's pixels matter: a target is followed or to be chosen."""
        return self.choosing or self.track.state is not TrackState.IDLE

    @property
    def choosing(self) -> bool:
        """Whether a target is to be chosen in the next frame."""
        return self.due or self._auto_due()

    @property
    def due(self) -> bool:
        """Whether a target was asked for, and its turn has come."""
        if self._choice is None:
            return False
        now = self._now()
        saved = self._credit_s + (now - self._credited) * REQUESTS_SHARE
        self._credit_s, self._credited = min(saved, REQUESTS_CREDIT_S), now
        return self._credit_s > 0

    def choose_by_itself(self, auto: Choice | None, again: bool = False) -> None:
        """Ask ``auto`` for a target whenever there is none.

        Args:
            auto: None: wait to be told.
            again: also when the target is lost.
        """
        self._auto, self._auto_again = auto, again

    def _auto_due(self) -> bool:
        state = self.track.state
        lost = state is TrackState.LOST and self._auto_again
        return self._auto is not None and (state is TrackState.IDLE or lost)

    def choose(self, choice: Choice) -> None:
        """Take the target that ``choice`` finds, from the next frame on, for what was asked before.

        Where requests come so fast that starting takes more than :data:`REQUESTS_SHARE` of the
        time, the newest waits for its turn.
        """
        self._choice = choice

    def start_as_asked(self, frame: Frame) -> bool:
        """Start on this frame, if that was asked; True where there is a new target."""
        choice = self._choice
        if not self.due or choice is None:
            return False
        self._choice = None
        begun = self._now()
        try:
            box = choice(frame)
            if box is None:
                self._choice = choice
            return box is not None and self.start(frame, box)
        except RgbdKcfError as error:
            self._report(str(error))
            return False
        finally:
            self._credit_s -= self._now() - begun

    def start(self, frame: Frame, box: Box) -> bool:
        """Take this target; where that fails, the one that is followed is kept, and it is said."""
        variant, parameters = self._wanted
        tracker = create_tracker(variant, parameters)
        try:
            track = tracker.start(frame, box)
        except RgbdKcfError as error:
            self._report(str(error))
            return False
        self._variant, self._parameters = variant, parameters
        self._tracker, self.track = tracker, track
        return True

    def reset(self) -> None:
        """Drop the target and whatever was asked."""
        self._choice = None
        self.track = IDLE
        self._variant, self._parameters = self._wanted
        self._tracker = create_tracker(*self._wanted)

    def configure(self, variant: str, parameters: Parameters) -> None:
        """Use another tracker or other parameters, as soon as no hidden target would be lost."""
        self._wanted = (variant, parameters)
        if self.track.state is TrackState.IDLE:
            choice = self._choice
            self.reset()
            self._choice = choice

    def process(self, frame: Frame) -> Track:
        """Follow the target into the next frame, or start on it."""
        if self.start_as_asked(frame):
            return self.track
        if self._choice is None and self._auto is not None and self._auto_due():
            found = self._auto(frame)
            if found is not None and self.start(frame, found):
                return self.track
        if self.track.state is not TrackState.IDLE:
            self.track = self._tracker.update(frame)
            self._take_over(frame)
        return self.track

    def _take_over(self, frame: Frame) -> None:
        box = self.track.box
        if self._wanted == (self._variant, self._parameters) or box is None:
            return
        if box.clipped(frame.width, frame.height) is None:
            return
        track = self.track
        if self.start(frame, box):
            self.track = track
        else:
            self._wanted = (self._variant, self._parameters)
