# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A target that depth tells from the rest goes on by its look alone while depth fails."""

from __future__ import annotations

from dataclasses import dataclass, replace

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.by_look import ByLook, Look
from rgbd_kcf_tracker.metric.gated_look import GatedLook
from rgbd_kcf_tracker.metric.parameters import MetricParameters

SOUGHT = 0.5
"""Seconds for which one that gets out of sight is sought by its colours alone: some frames at 5 Hz.
Later it may have left, and somebody else is like it."""
MOST_SURE = 0.8
"""Score of what nothing but the look tells, at the most: it is right less often than what depth
bears out (docs/experiments.md)."""


@dataclass(frozen=True, slots=True, eq=False)
class _Last:
    """Where depth showed the target last."""

    frame: Frame
    box: Box
    depth: float
    score: float


class Dark:
    """Follows a target from where depth showed it last. Nothing is begun while depth is there.

    Args:
        since: seconds of the frame in which the target was chosen.
        parameters: of the tracker.
    """

    def __init__(self, since: float, parameters: MetricParameters) -> None:
        self._since, self._parameters = since, parameters
        self._last: _Last | None = None
        self._gated: GatedLook | None = None

    def seen(self, frame: Frame, box: Box, depth: float, score: float) -> None:
        """Take a frame with depth in which the target was found, at ``depth`` metres."""
        self.forget()
        self._last = _Last(frame, box, depth, score)

    def forget(self) -> None:
        """It has not been found, or something that may be another: nothing is to go on."""
        self._last = self._gated = None

    @property
    def ready(self) -> bool:
        """Whether it is known from where to go on."""
        return self._last is not None

    @property
    def runs(self) -> bool:
        """Whether it is followed, or sought."""
        return self._gated is not None

    @property
    def most(self) -> float:
        """The highest score that it may have: none rises while nothing bears it out."""
        return 0.0 if self._last is None else min(self._last.score, MOST_SURE)

    @property
    def response(self) -> float | None:
        """The filter's in the last frame against its own recent mean, None without."""
        return None if self._gated is None else self._gated.response

    def depth(self, frame: Frame, box: Box) -> float:
        """Metres to the target in a box of a frame, by how much larger that is than its last."""
        assert self._last is not None
        was = self._last.box.height / self._last.frame.height  # images may have another size by now
        return self._last.depth * was / (box.height / frame.height)

    def step(self, frame: Frame, dt: float, turn: bool) -> Look | None:
        """Look for it in the next frame, which has no depth, ``dt`` seconds later.

        Args:
            frame: the frame.
            dt: seconds.
            turn: whether it may be searched for and learned from, and the look be begun.
        """
        if self._last is None or (self._gated is None and not turn):
            return None
        if self._gated is None:
            # By colours alone, as in the frames to come.
            before, box = replace(self._last.frame, depth=None), self._last.box
            look = ByLook(before, box, self._parameters)
            self._gated = GatedLook(look, None, box, self._since, self._parameters.seen_ratio)
        found = self._gated.step(frame, None, dt, turn).look
        if self._gated.unseen >= SOUGHT:
            self.forget()
        return found

    def settle(self) -> None:
        """Learn what no answer waits for; after each :meth:`step`, before the next."""
        if self._gated is not None:
            self._gated.settle()
