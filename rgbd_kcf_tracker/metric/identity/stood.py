# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A thing that stood still is most likely where it stood, however long the camera looked away."""

from __future__ import annotations

import math

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.metric.perceive.ego_motion import Lost
from rgbd_kcf_tracker.pose import Pose

CHOSEN_MOVING = 0.5
"""Probability that a thing moves, before it was seen for a while: it may or may not."""
STANDS = 0.3
"""Seconds of standing still after which that is a third: what moves shows it in half a second."""
OFF, OFF_SHARE = 0.05, 0.3
"""Metres, and shares of its width, by which what is seen of a thing that stands still is elsewhere:
another side, a part (of places all over its width the deviation is 0.29 of that). A quarter of a
metre whatever its size made the wall beside a mug the mug."""
DRIFT = 0.05
"""Metres by which the camera's own motion is off after each radian of turning and metre of way; on
``redkitchen`` it is off by 0.02 to 0.06 after 1.5 radians, at 5 to 30 frames a second. At 0.1 what
stood a third of a metre beside a thing was the thing once the camera had looked aside."""
STEADY = 1.0
"""Seconds in which a place is taken on from what is seen there: at 10 Hz a tenth of what one view
is off by."""
CARRIED_OFF, SUDDENLY, CARRYING = 0.1, 0.01, 3.0
"""Probability that somebody moves a thing while nobody looks, that it is elsewhere all at once
between two frames, and the seconds it takes to come over: what is carried off is seen to go."""
SURELY = 0.5
"""Metres to which its place must be known to tell a thing that stands from one that moves: less
than a stride. Of who comes in beside the depth image only the wall behind him is read."""
GAIN = 1.5
"""Log-odds of what is where it stood: few other things fit there, but what it stood on is there."""


class Stood:
    """Where a target stands that has not moved since it was chosen.

    Args:
        place: ``(3,)`` metres in the camera's frame.
        sigma: ``(3,)`` metres, its deviation.
        width: of the target, metres.

    Attributes:
        place: where it stands, ``(3,)`` metres in the camera's frame of now.
    """

    def __init__(self, place: FloatArray, sigma: FloatArray, width: float) -> None:
        self._off = self._for = self._unseen = 0.0
        self.point(place, sigma, width)
        self._known, self._carried = True, False

    def point(self, place: FloatArray, sigma: FloatArray, width: float) -> None:
        """Say the place of the same target by another point of it, as its upper edge."""
        self.place, self._vague = np.array(place, np.float64), float(sigma.max())
        self._size = OFF + OFF_SHARE * width

    def carried(self, motion: Pose | Lost | None, dt: float) -> None:
        """Keep the place in the world while the camera moves, ``dt`` seconds, as far as known."""
        self._unseen += dt
        if isinstance(motion, Lost):
            self.moves()  # or seems to
        elif motion is not None:
            self.place, self._carried = motion.of(self.place), True
            self._off += DRIFT * (motion.turn + motion.shift)

    def seen(self, place: FloatArray, sigma: FloatArray, dt: float) -> None:
        """Take where the target is, ``(3,)`` metres, each axis with its own deviation."""
        off = place - self.place
        if np.any(np.abs(off) > 3 * np.hypot(sigma, self._size + self._off)):
            self.moves()
        near, _ = self._likely(place, sigma)
        if near < 1:  # as likely anywhere else: that says nothing of where it stood
            return
        share = 1 - math.exp(-dt / STEADY)
        self.place += share * off
        self._vague += share * (float(sigma.max()) - self._vague)
        self._off *= 1 - share
        self._for += dt
        self._unseen = 0.0

    def moves(self) -> None:
        """The target is one that moves."""
        self._known = False

    @property
    def known(self) -> bool:
        """Whether the target has always stood still.

        It says nothing before the camera has moved: one that stands still sees what starts to move.
        """
        return self._carried and self._known and self._vague < SURELY

    def log_odds(self, place: FloatArray, sigma: FloatArray) -> float:
        """What a place says for its being the target, 0 where that is not known.

        Args:
            place: ``(3,)`` metres.
            sigma: ``(3,)`` metres, its deviation.
        """
        if not self.known:
            return 0.0
        near, moved = self._likely(place, sigma)
        return math.log((1 - moved) * near + moved)

    def _likely(self, place: FloatArray, sigma: FloatArray) -> tuple[float, float]:
        """How likely a place is if the target stands, against any other, and that it moved."""
        variance = np.square(sigma) + (self._size + self._off) ** 2 + self._vague**2
        near = math.exp(GAIN - 0.5 * float((np.square(place - self.place) / variance).sum()))
        still = 1 - math.exp(-self._for / STANDS)
        carried_off = CARRIED_OFF + (SUDDENLY - CARRIED_OFF) * math.exp(-self._unseen / CARRYING)
        moved = CHOSEN_MOVING + (carried_off - CHOSEN_MOVING) * still
        return near, moved
