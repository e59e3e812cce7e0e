# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A thing that stood still is most likely where it stood, however long the camera looked away."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.metric.perceive.ego_motion import Lost
from rgbd_kcf_tracker.pose import Pose

FloatArray = npt.NDArray[np.float64]

CHOSEN_MOVING = 0.5
"""Probability that a thing moves, before it was seen for a while: it may or may not."""
STANDS = 0.3
"""Seconds of standing still after which that is a third: what moves shows it in half a second."""
OFF = 0.25
"""Metres by which what is seen of a thing that stands still is elsewhere: another side, a part."""
DRIFT = 0.1
"""Metres by which the camera's own motion is off after each radian of turning and metre of way; on
``redkitchen`` it is off by 0.02 to 0.06 after 1.5 radians, at 5 to 30 frames a second."""
STEADY = 1.0
"""Seconds in which a place is taken on from what is seen there."""
CARRIED_OFF = 0.1
"""Probability that somebody moves a thing while nobody looks."""
GAIN = 1.5
"""Log-odds of what is where it stood: few other things fit there, but what it stood on is there."""


class Stood:
    """Where a target stands that has not moved since it was chosen.

    Args:
        place: ``(3,)`` metres in the camera's frame.
    """

    def __init__(self, place: FloatArray) -> None:
        self._place = np.array(place, np.float64)
        self._off = self._for = 0.0
        self._known, self._carried = True, False

    def carried(self, motion: Pose | Lost | None) -> None:
        """Keep the place in the world while the camera moves, as far as that is known."""
        if isinstance(motion, Lost):
            self.moves()  # or seems to
        elif motion is not None:
            self._place, self._carried = motion.of(self._place), True
            turned, _ = cv2.Rodrigues(motion.rotation)
            way = float(np.linalg.norm(turned)) + float(np.linalg.norm(motion.translation))
            self._off += DRIFT * way

    def seen(self, place: FloatArray, sigma: FloatArray, dt: float) -> None:
        """Take where the target is, ``(3,)`` metres, each axis with its own deviation."""
        off = place - self._place
        if np.any(np.abs(off) > 3 * np.hypot(sigma, OFF + self._off)):
            self.moves()
        share = 1 - math.exp(-dt / STEADY)
        self._place += share * off
        self._off *= 1 - share
        self._for += dt

    def moves(self) -> None:
        """The target is one that moves."""
        self._known = False

    @property
    def known(self) -> bool:
        """Whether the target has always stood still.

        It says nothing before the camera has moved: one that stands still sees what starts to move.
        """
        return self._carried and self._known

    def log_odds(self, place: FloatArray, sigma: FloatArray) -> float:
        """What a place says for its being the target, 0 where that is not known.

        Args:
            place: ``(3,)`` metres.
            sigma: ``(3,)`` metres, its deviation.
        """
        if not self.known:
            return 0.0
        variance = np.square(sigma) + (OFF + self._off) ** 2
        near = math.exp(GAIN - 0.5 * float((np.square(place - self._place) / variance).sum()))
        moved = CARRIED_OFF + (CHOSEN_MOVING - CARRIED_OFF) * math.exp(-self._for / STANDS)
        return math.log((1 - moved) * near + moved)
