# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What was seen beside a thing that is followed: it is something else when they cross.

People are told from each other by the account of everyone; what is lower than anybody has no part
in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.metric.identity.body import Placed
from rgbd_kcf_tracker.metric.identity.motion import MotionFilter
from rgbd_kcf_tracker.pose import Pose

NEAR, NEAR_PER_SECOND = 0.2, 1.5
"""Metres from where a neighbour is expected within which it is found, and more for each second
since the last frame: by how much a place is unsure, and the speed of whatever drives in a room."""
FORGET = 1.0
"""Seconds without a sight after which it is not known any more where a neighbour is."""
NOWHERE = 1e3
"""What it costs to take a neighbour for what it cannot be: more than all others together."""


@dataclass(eq=False)
class _Neighbour:
    motion: MotionFilter
    missed: float = 0.0


class Neighbours:
    """Those of one target.

    Args:
        speed: metres per second, of the unknown first velocity of each.
        acceleration: metres per second squared, see :class:`MotionFilter`.
    """

    def __init__(self, speed: float, acceleration: float) -> None:
        self._speed, self._acceleration = speed, acceleration
        self._known: list[_Neighbour] = []

    def predict(self, dt: float, moved: Pose | None) -> None:
        """Go on by ``dt`` seconds; ``moved`` is as for :meth:`MotionFilter.carried`, or None."""
        for each in self._known:
            if moved is not None:
                each.motion.carried(moved)
            each.motion.predict(dt)

    def find(self, places: Sequence[Placed], target: FloatArray, dt: float) -> list[int]:
        """Which of the places of a frame, ``dt`` seconds after the last, are those of neighbours.

        Each is where it is expected, and nearer to that than to the ``target``, ``(3,)`` metres.
        """
        found: list[int] = []
        for each in self._known:
            each.missed += dt
        if self._known and places:
            at = np.stack([each.position for each in places])
            expected = np.stack([each.motion.position for each in self._known])
            away = _on_floor(at - expected[:, None])
            possible = away < np.minimum(NEAR + NEAR_PER_SECOND * dt, _on_floor(at - target))
            rows, columns = linear_sum_assignment(np.where(possible, away, NOWHERE))
            for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
                if possible[row, column]:
                    found.append(column)
                    neighbour, place = self._known[row], places[column]
                    neighbour.motion.correct(place.position, place.sigma)
                    neighbour.missed = 0.0
        self._known = [each for each in self._known if each.missed < FORGET]
        return found

    def meet(self, places: Iterable[Placed]) -> None:
        """Take what is seen beside the target and is no neighbour yet."""
        for place in places:
            motion = MotionFilter(place.position, place.sigma, self._speed, self._acceleration)
            self._known.append(_Neighbour(motion))


def _on_floor(away: FloatArray) -> FloatArray:
    """How far that is across and ahead, ``(..., 3)`` metres to ``(...)``."""
    return np.asarray(np.hypot(away[..., 0], away[..., 2]))
