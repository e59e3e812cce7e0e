# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Several targets at once, each with an id that the page gives."""

from __future__ import annotations

from collections.abc import Mapping

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.targets import MetricTargets
from rgbd_kcf_tracker.parameters import Parameters
from rgbd_kcf_tracker.track import Track, Tracker
from rgbd_kcf_tracker.variants import create_tracker, default_parameters
from rgbd_kcf_tracker.view.insight import Insight, insight_of, of_metric

MOST = 16
"""Targets at once."""


class Targets:
    """Follows several: ``metric`` accounts for all together, of the others each by a tracker.

    Args:
        variant: of the trackers.
        parameters: of the variant; None for the released defaults.
    """

    def __init__(self, variant: str, parameters: Parameters | None = None) -> None:
        self._variant = variant
        self._parameters = default_parameters(variant) if parameters is None else parameters
        self._trackers: dict[int, Tracker] = {}
        self._together: MetricTargets | None = None
        if isinstance(self._parameters, MetricParameters):
            self._together = MetricTargets(self._parameters)
        self._ids: dict[int, int] = {}
        """Of the page's ids those within the set; two may be one person."""

    def add(self, number: int, frame: Frame, box: Box) -> Track:
        """Follow what is in ``box`` under an id; ``frame`` is the last that was given, or the next.

        Raises:
            BoxError: where the box lies outside the image.
            ParameterError: where there are too many targets already.
        """
        if len(self) >= MOST and number not in self:
            raise ParameterError(f'{MOST} targets are followed already: remove one first')
        if self._together is not None:
            inner = self._together.add(frame, box)
            self._ids[number] = inner
            return self._together.started(inner)
        tracker = create_tracker(self._variant, self._parameters)
        track = tracker.start(frame, box)
        self._trackers[number] = tracker
        return track

    def remove(self, number: int) -> None:
        """Follow it no more."""
        self._trackers.pop(number, None)
        inner = self._ids.pop(number, None)
        if self._together is not None and inner is not None and inner not in self._ids.values():
            self._together.remove(inner)

    def update(self, frame: Frame) -> dict[int, Track]:
        """Where each target is in the next frame."""
        if self._together is not None:
            tracks = self._together.update(frame)
            return {number: tracks[inner] for number, inner in self._ids.items()}
        return {number: tracker.update(frame) for number, tracker in self._trackers.items()}

    def insights(self) -> Mapping[int, Insight]:
        """What is known of each after the last frame."""
        together = self._together
        if together is not None:
            return {number: of_metric(together, inner) for number, inner in self._ids.items()}
        return {number: insight_of(tracker) for number, tracker in self._trackers.items()}

    def __len__(self) -> int:
        return len(self._trackers) + len(self._ids)

    def __contains__(self, number: int) -> bool:
        return number in self._trackers or number in self._ids
