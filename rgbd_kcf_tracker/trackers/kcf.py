# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Placeholder until the filter lands."""

from __future__ import annotations

from dataclasses import dataclass

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import Parameters, parameter
from rgbd_kcf_tracker.trackers.track import Track, TrackState, require_inside


@dataclass(frozen=True)
class KcfParameters(Parameters):
    """Placeholder."""

    padding: float = parameter(1.5, 'Search window beyond the target.', minimum=0.1, maximum=10.0)


class KcfTracker:
    """Placeholder."""

    def __init__(self, parameters: KcfParameters) -> None:
        self._track = Track(None, TrackState.IDLE)

    def start(self, frame: Frame, box: Box) -> Track:
        """Placeholder."""
        require_inside(box, frame)
        self._track = Track(box, TrackState.TRACKING, 1.0)
        return self._track

    def update(self, frame: Frame) -> Track:
        """Placeholder."""
        return self._track
