# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Choosing the target without being told: the nearest person, looked for a few times a second."""

from __future__ import annotations

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.live.settings import NodeParameters, auto_init_range
from rgbd_kcf_tracker.metric.people import PersonFinder

PERIOD_NS = 180_000_000
"""Somewhat less than a fifth of a second, so that stamps may jitter."""


class AutoInit:
    """A choice (see :mod:`~rgbd_kcf_tracker.live.session`) that costs nothing most of the time.

    Args:
        settings: the node's parameters ``auto_init_*``.

    Raises:
        ParameterError: where nobody can be between their distances.
    """

    def __init__(self, settings: NodeParameters) -> None:
        self._finder = PersonFinder(*auto_init_range(settings))
        self._looked: int | None = None

    def __call__(self, frame: Frame) -> Box | None:
        """The nearest person, if there is one and it is time to look again."""
        if self._looked is not None and 0 <= frame.stamp_ns - self._looked < PERIOD_NS:
            return None
        self._looked = frame.stamp_ns
        return self._finder.nearest(frame)
