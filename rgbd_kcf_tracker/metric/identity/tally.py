# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Log-odds, and what several sightings of the same say together."""

from __future__ import annotations

import math

SUREST = 30.0
"""Log-odds beyond which nothing is surer: ten to the thirteenth to one, about the last that a
double tells from certainty."""

ENOUGH = 1.5
"""Sightings, counted by how much showed, from which they are believed: more than any one of them,
which may be of a mixed outline."""
IN_ALL = 2.0
"""The same of all sightings of who may have been here before, however long ago, from which he is
recognised: two that show all of him. Of late alone it would depend on how often the camera looks:
of somebody slim, seen from the side, five frames a second would never be enough."""
LATELY = 1.5
"""Seconds after which a sighting says a third of what it said: at first often little of somebody
shows, or somebody else beside him, and a number may have gone over from one to another."""
GLIMPSE = 0.5
"""Sightings, counted the same way, of which less is believed less: mixed outlines are mostly of
those of whom little shows."""
AGAIN = 0.25
"""What twice as many sightings say more, as a share of what one says: little, as those that follow
each other show nearly the same."""


def logit(probability: float) -> float:
    """Log-odds of a probability, at most :data:`SUREST` either way."""
    least = math.exp(-SUREST)
    return math.log(max(probability, least) / max(1.0 - probability, least))


class Tally:
    """Log-odds that sightings gave, of which those of late and those that show more count more.

    Attributes:
        last: seconds of the last of them, minus infinity before the first.
    """

    def __init__(self) -> None:
        self._total = self._count = 0.0
        self.last = -math.inf

    def add(self, odds: float, weight: float, time: float) -> None:
        """Take a sighting.

        Args:
            odds: log-odds.
            weight: how much showed, 0 to 1: a part that is seen past somebody else has colours of
                his as well.
            time: seconds; what was seen before counts less.
        """
        kept = math.exp((self.last - time) / LATELY)
        self._total = kept * self._total + weight * odds
        self._count = kept * self._count + weight
        self.last = time

    @property
    def mean(self) -> float | None:
        """Mean log-odds; None where nothing was seen."""
        return self._total / self._count if self._count > 0 else None

    @property
    def enough(self) -> bool:
        """Whether so many sightings count that they are believed."""
        return self._count >= ENOUGH

    @property
    def believed(self) -> float:
        """Log-odds by all of them, less where less than a glimpse was seen."""
        return self.odds() * min(1.0, self._count / GLIMPSE)

    def odds(self, enough: float = 0.0) -> float:
        """Log-odds by all of them; 0 where they count less than ``enough``.

        Sightings of one walk say little more than one of them: that two people wear the same does
        not change from frame to frame.
        """
        mean = self.mean
        if mean is None or self._count < enough:
            return 0.0
        return mean * (1 + AGAIN * math.log2(max(self._count, 1.0)))


class Heard(Tally):
    """What sightings say of being somebody who is known, by the look and the height.

    How tall somebody is shows after some steps, and was true of him before: what heights said until
    then is forgotten, and only those that tell it count from then on.
    """

    def __init__(self) -> None:
        super().__init__()
        self._heights, self._told = Tally(), False
        self._in_all = 0.0

    def hear(self, odds: float, weight: float, time: float, *, height: float, told: bool) -> None:
        """Take a sighting.

        Args:
            odds: log-odds by the look and the height.
            weight: how much showed, see :meth:`Tally.add`.
            time: seconds.
            height: what of them is by the height.
            told: whether that tells how tall he is.
        """
        self._in_all += weight
        self.add(odds - height, weight, time)
        if told and not self._told:
            self._heights, self._told = Tally(), True
        if told or not self._told:
            self._heights.add(height, weight, time)

    @property
    def enough(self) -> bool:
        """Whether so much was seen in all that it is believed."""
        return self._in_all >= IN_ALL

    @property
    def recognised(self) -> float:
        """Log-odds by all of them as far as they are believed; 0 before enough was seen."""
        return self.believed if self.enough else 0.0

    @property
    def mean(self) -> float | None:
        """Mean log-odds of the looks and the heights; None where nothing was seen."""
        mean = super().mean
        return None if mean is None else mean + (self._heights.mean or 0.0)
