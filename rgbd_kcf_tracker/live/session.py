# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The target and who follows it: what was asked of the tracker, applied at the right frame.

Plain Python, one thread: the node's worker calls it; tests call it directly.
"""

from __future__ import annotations

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
    """

    def __init__(self, variant: str, parameters: Parameters, report: Callable[[str], None]) -> None:
        self._variant, self._parameters = variant, parameters
        self._wanted = (variant, parameters)
        self._tracker = create_tracker(variant, parameters)
        self._report = report
        self._choice: Choice | None = None
        self._auto: Choice | None = None
        self._auto_again = False
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
        return self._choice is not None or self._auto_due()

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

    def choose(self, choice: Choice | None) -> None:
        """Take the target that ``choice`` finds, from the next frame on; None waits no more."""
        self._choice = choice

    def start(self, frame: Frame, choice: Choice) -> bool:
        """Take the target that ``choice`` finds in ``frame``, if it finds one there.

        A choice that fails leaves the target that is followed, if any, and is reported.
        """
        try:
            box = choice(frame)
            if box is None:
                return False
            variant, parameters = self._wanted
            tracker = create_tracker(variant, parameters)
            track = tracker.start(frame, box)
        except RgbdKcfError as error:
            self._report(str(error))
            self._choice = None
            return False
        self._variant, self._parameters = variant, parameters
        self._tracker, self.track, self._choice = tracker, track, None
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
        choice = self._choice
        if choice is None and self._auto_due():
            choice = self._auto
        if choice is not None and self.start(frame, choice):
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
        if self.start(frame, lambda _: box):
            self.track = track
        else:
            self._wanted = (self._variant, self._parameters)
