# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Several targets at once, each with an id and a name."""

from __future__ import annotations

from collections.abc import Mapping

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import Parameters
from rgbd_kcf_tracker.track import Track, Tracker
from rgbd_kcf_tracker.variants import create_tracker
from rgbd_kcf_tracker.view.insight import Insight, insight_of

MOST = 16
"""Targets at once: each costs as much as the first."""


class Targets:
    """Follows each target by a tracker of its own.

    Args:
        variant: of the trackers.
        parameters: of the variant; None for the released defaults.
    """

    def __init__(self, variant: str, parameters: Parameters | None = None) -> None:
        self._variant, self._parameters = variant, parameters
        self._trackers: dict[int, Tracker] = {}

    def add(self, number: int, frame: Frame, box: Box) -> Track:
        """Follow what is in ``box`` under an id.

        Raises:
            BoxError: where the box lies outside the image.
            ParameterError: where there are too many targets already.
        """
        if len(self._trackers) >= MOST and number not in self._trackers:
            raise ParameterError(f'{MOST} targets are followed already: remove one first')
        tracker = create_tracker(self._variant, self._parameters)
        track = tracker.start(frame, box)
        self._trackers[number] = tracker
        return track

    def remove(self, number: int) -> None:
        """Follow it no more."""
        self._trackers.pop(number, None)

    def update(self, frame: Frame) -> dict[int, Track]:
        """Where each target is in the next frame."""
        return {number: tracker.update(frame) for number, tracker in self._trackers.items()}

    def insights(self) -> Mapping[int, Insight]:
        """What each tracker knows after the last frame."""
        return {number: insight_of(tracker) for number, tracker in self._trackers.items()}

    def __len__(self) -> int:
        return len(self._trackers)

    def __contains__(self, number: int) -> bool:
        return number in self._trackers
