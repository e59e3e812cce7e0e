# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Several targets under the ids of the page, which outlive the set that follows them.

When a parameter changes the run goes on with another set, but a target keeps its id and its name.
"""

from __future__ import annotations

from collections.abc import Mapping

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import Parameters
from rgbd_kcf_tracker.targets import TargetSet
from rgbd_kcf_tracker.track import Track
from rgbd_kcf_tracker.view.insight import Insight, insight_in

MOST = 16
"""Targets at once."""


class Targets:
    """A :class:`~rgbd_kcf_tracker.targets.TargetSet` with the ids of the page.

    Args:
        variant: of the trackers.
        parameters: of the variant; None for the released defaults.
    """

    def __init__(self, variant: str, parameters: Parameters | None = None) -> None:
        self._set = TargetSet(variant, parameters)
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
        inner = self._ids[number] = self._set.add(frame, box)
        return self._set.started(inner)

    def remove(self, number: int) -> None:
        """Follow it no more."""
        inner = self._ids.pop(number, None)
        if inner is not None and inner not in self._ids.values():
            self._set.remove(inner)

    def update(self, frame: Frame) -> dict[int, Track]:
        """Where each target is in the next frame."""
        tracks = self._set.update(frame)
        return {number: tracks[inner] for number, inner in self._ids.items()}

    def insights(self) -> Mapping[int, Insight]:
        """What is known of each after the last frame."""
        return {number: insight_in(self._set, inner) for number, inner in self._ids.items()}

    def __len__(self) -> int:
        return len(self._ids)

    def __contains__(self, number: int) -> bool:
        return number in self._ids
