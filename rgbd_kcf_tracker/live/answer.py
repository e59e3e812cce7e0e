# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the pipeline says of one pair of images, for whoever publishes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.insight import Insight
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.track import Track


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The answer to one pair.

    Attributes:
        header: of the colour image, as it came.
        track: of the chosen target.
        time_ns: the pair's time in nanoseconds, which only rises.
        place: the camera's pose in the frame in which results go out; None where that is unknown,
            or is the camera's own.
        others: tracks of the other targets that are followed.
        frame: what was seen; None where it was not looked at or could not be read.
        asked_for: ids of those of the tracks whom somebody chose or added.
        insights: computes what is known of each by id, until the next pair is taken; None where
            nothing was tracked.
    """

    header: Any
    track: Track
    time_ns: int
    frame: Frame | None = None
    others: tuple[Track, ...] = ()
    place: Pose | None = None
    asked_for: frozenset[int] = frozenset()
    insights: Callable[[], Mapping[int, Insight]] | None = None

    @property
    def tracks(self) -> tuple[Track, ...]:
        """All that is followed, the chosen one first."""
        return (self.track, *self.others)
