# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether what was taken for somebody stirs: who stands or sits does, furniture does not."""

from __future__ import annotations

import numpy as np

from rgbd_kcf_tracker.arrays import Image
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette

CHANGED = 20
"""Levels of 255 by which a pixel has changed: three deviations of the difference of two readings of
a camera's noise, of about 5 levels."""
STIRS = 0.05
"""Share of the pixels that have changed from which somebody stirs. Of real people who stand or sit
9.5 % at the least have changed a second later, of simulated ones 4 %, of furniture 1 % in the
median (docs/experiments.md)."""
SAME_OUTLINE = 0.7
"""Share of the smaller of two outlines that lies in the other where both are of what stands."""
NEARER = 0.3
"""Metres by which what hid some of it then was nearer, as two people are who pass each other."""
CALM_FOR, CALM_SIGHTS = 2.0, 2
"""Seconds, and sights after the first, after which what has not stirred is furniture: each second
says so by ten to one."""


class Calm:
    """What was found elsewhere than somebody had been followed to, until it stirs.

    Args:
        seen: the first sight of it.
        view: the depth then.
        image: ``(h, w, 3)`` its colours.
        time: seconds.

    Attributes:
        since: seconds of the first sight.
    """

    def __init__(self, seen: Silhouette, view: DepthView, image: Image, time: float) -> None:
        self._seen, self._depth, self._image = seen, view.depth, image
        self._sights = 0
        self.since = time

    def holds(self, seen: Silhouette, image: Image) -> bool:
        """Take the next sight; whether it has not stirred."""
        if image.shape != self._image.shape:
            return False
        smaller = min(np.count_nonzero(each.mask) for each in (self._seen, seen))
        if np.count_nonzero(self._seen.common(seen)) < SAME_OUTLINE * smaller:
            return False
        # Where it ends is told by what was beside it, but not by what hid it then.
        then = self._depth[seen.rows, seen.cols]
        free = seen.mask & ((then == 0) | (then > seen.depth - NEARER))
        before, now = (each[seen.rows, seen.cols][free] for each in (self._image, image))
        off = np.abs(now.astype(np.int16) - before).max(axis=1)
        if not off.any():  # a camera that repeats its picture shows nothing new
            return True
        self._sights += 1
        return bool(np.count_nonzero(off > CHANGED) < STIRS * len(off))

    def long(self, time: float) -> bool:
        """Whether it has been so for so long that it is furniture."""
        return self._sights >= CALM_SIGHTS and time - self.since >= CALM_FOR
