# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How tall somebody is, by the height of the head above the floor.

Heights at large tell of stooping and sitting more than of who it is. Who walks stands upright: of
real people nine tenths of these heights lie within 4 cm of their median (docs/metric.md). So does
who is higher than anybody sits. Nobody is taller than that.
"""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Iterable
from operator import attrgetter
from statistics import fmean, median
from typing import NamedTuple

SIGMA = 0.07
"""Metres by which the height of one person's head differs between two sightings: gait, hair, and a
floor that is a little out of true."""
SPREAD = 0.1 * math.sqrt(2)
"""Metres by which the heights of two people differ, as adults' have a standard deviation of 10 cm.
"""
ANY = 1 / (math.sqrt(2 * math.pi) * SPREAD)
"""Share of all people's heads in each metre of height, where somebody's is: a mean over them."""
STOOPED = 0.7
"""Share of sightings whose height says nothing: who stoops or sits, a head that is half hidden. At
1 Hz heights of real people hardly tell who it is at all (docs/figures.md)."""
SEATED, LOWER = 0.55, 0.05
"""Share of somebody's height from which that is so: on a chair one is three quarters as high as
when standing, on one's knees or bent over somewhat less (at 0.62 who was half hidden was refused);
and the share of sightings with the head lower than that."""
STEP, SLOPE = 0.03, 0.05
"""Metres by which two heights of one who walks differ, from step to step, and for each metre
between the distances at which they were seen, as a floor of which little shows is out of true."""
A_STEP = 5
"""Heights of one step, which are no surer than one: ten a second of two steps a second."""
NEAREST, OF_LATE = 7, 1.0
"""Heights, seen at about the same distance, that one is held against, and seconds of whose heights
it is told how tall somebody walks now: those are of a step or two, and most of them are right."""
RARELY = 0.01
"""Share of those who came back who are not as tall as they were: a hat, a load, another floor. As
long as little is known it is more, half a height of as many as are known."""
CHANGED, HIDDEN = 0.09, 0.1
"""Metres by which nobody's height changes while he walks, three times :data:`STEP`: it is another
who comes out beside him, or else his head is hidden, as in a tenth of the sightings of people who
pass each other."""
STANDS = 1.4
"""Metres from which a head is of somebody who stands: who sits on a chair is lower."""
LOWEST = 1.2
"""Metres from which a height is remembered of one who does not walk: lower ones are of who crawls
or bends down, or of an arm."""
TOLD, AGAIN = 3, 0.08
"""Heights of somebody upright from which it is known how tall he is, and seconds from one of them
to the next: sooner it is the same step, and ten a second are as many as are learned."""
NEWEST, UPRIGHT = 25, 40
"""Heights that are remembered: the newest, some seconds, so that a stoop does not stay; and of who
is upright the first and the newest, so that a mistake of some seconds does not replace all."""


class Height(NamedTuple):
    """A head's height above the floor and the distance at which it was seen, in metres.

    ``time`` is when, in seconds, and ``walks`` whether it is of one who walks.
    """

    top: float
    distance: float
    time: float
    walks: bool = False

    @property
    def upright(self) -> bool:
        """Whether it is of one who stands upright, as far as can be told."""
        return self.walks or self.top > STANDS


class HeightOdds(NamedTuple):
    """What a height says of who it is of.

    Attributes:
        odds: log-odds that it is of the same person.
        tall: the same by how tall he is alone; None where nothing tells that.
    """

    odds: float
    tall: float | None = None


class Tilt(NamedTuple):
    """How far the floor is out of true: metres that heights grow by with each metre of distance.

    ``sigma`` is the standard deviation of ``slope``.
    """

    slope: float = 0.0
    sigma: float = SLOPE

    @classmethod
    def told_by(cls, everybody: Iterable[Stature]) -> Tilt:
        """As those tell who were seen near and far, each as tall here as there."""
        squared = along = 0.0
        for each in everybody:
            squared, along = squared + each.spread[0], along + each.spread[1]
        known = (STEP / SLOPE) ** 2 + squared / A_STEP
        return cls(along / A_STEP / known, STEP / math.sqrt(known))


LEVEL = Tilt()
"""Of a floor of which nobody has told."""


class Stature:
    """The heights by which one is known.

    Attributes:
        top: median of the newest in metres, None where none is known.
        spread: sums over the heights of one upright of the squared deviation of their distance from
            its mean, and of that times theirs.
    """

    def __init__(self) -> None:
        self.top: float | None = None
        self.spread = 0.0, 0.0
        self._newest: list[Height] = []
        self._upright: list[Height] = []
        self._by_distance: list[Height] = []

    def learn(self, height: Height, alone: bool = True) -> None:
        """Take a height; what is not surely of one person ``alone`` tells not how tall he is."""
        upright = self._upright
        again = upright and height.time - upright[-1].time < AGAIN
        if alone and height.upright and not again:
            upright = [*upright, height]
        newest = [*self._newest, height] if height.top > LOWEST else self._newest
        self._set(newest, upright)

    def walking_top(self, time: float) -> float | None:
        """How tall somebody has walked in the last second before ``time``; None if not enough."""
        late = [h.top for h in self._upright if h.walks and time - h.time < OF_LATE]
        return _upper(late) if len(late) >= TOLD else None

    def log_odds(
        self,
        top: float | None,
        distance: float,
        walking_top: float | None = None,
        before: float = math.inf,
        tilt: Tilt = LEVEL,
    ) -> HeightOdds:
        """Log-odds that a head's height is the person's rather than anybody's.

        Nobody is taller than upright, and who walks is as tall; others may stoop or sit. A height
        that fits says little, as most people are about as tall.

        Args:
            top: metres above the floor, None where it is not known.
            distance: metres at which it was seen.
            walking_top: metres, how tall who is there has walked of late, see :meth:`walking_top`.
            before: how tall he is is told by what was learned before, in seconds.
            tilt: of the floor.
        """
        odds = height_log_odds(top, self.top)
        changed = False
        if walking_top is not None:
            changed = top is not None and abs(top - walking_top) > CHANGED
            top = top if changed else walking_top
        known = self._by_distance
        if before < math.inf:
            known = [each for each in known if each.time < before]
        if top is None or len(known) < TOLD:
            return HeightOdds(odds)
        here = bisect(known, distance, key=_distance)
        around = known[max(here - NEAREST, 0) : here + NEAREST]
        nearest = sorted(around, key=lambda each: abs(each.distance - distance))[:NEAREST]
        apart = abs(nearest[len(nearest) // 2].distance - distance)
        sigma = math.hypot(STEP * math.sqrt(1 + 1 / len(nearest)), tilt.sigma * apart)
        here_as = [h.top + tilt.slope * (distance - h.distance) for h in nearest]
        off = top - _upper(here_as)
        if walking_top is None and off < -2 * sigma:
            return HeightOdds(odds)
        same, other = _normal(off, sigma), _normal(off, math.hypot(sigma, SPREAD))
        otherwise = max(HIDDEN if changed else RARELY, 0.5 / len(known))
        tall = math.log((1 - otherwise) * same / other + otherwise)
        return HeightOdds(min(tall, odds), tall)

    def take(self, other: Stature) -> None:
        """Take all that another has, which has turned out to be of the same person."""
        self._set(
            sorted(self._newest + other._newest, key=_time),
            sorted(self._upright + other._upright, key=_time),
        )

    def taken_back(self, since: float) -> Stature:
        """Take back what was learned from ``since`` on, in seconds."""
        late = Stature()
        late._set(*([h for h in each if h.time >= since] for each in (self._newest, self._upright)))
        self._set(*([h for h in each if h.time < since] for each in (self._newest, self._upright)))
        return late

    def copy(self) -> Stature:
        """The same heights; what either learns from now on is its own."""
        same = Stature()
        same._set(self._newest, self._upright)
        return same

    def _set(self, newest: list[Height], upright: list[Height]) -> None:
        self._newest = newest[-NEWEST:]
        more = max(len(upright) - UPRIGHT, 0)
        self._upright = upright[: UPRIGHT // 2] + upright[UPRIGHT // 2 + more :]
        self._by_distance = sorted(self._upright, key=_distance)
        if self._upright:
            # What is lower by as much as two people differ is of who stoops, or of a hidden head.
            span = self._by_distance[-1].distance - self._by_distance[0].distance
            least = _upper([h.top for h in self._upright]) - SPREAD - SLOPE * span
            self._by_distance = [h for h in self._by_distance if h.top > least]
            mean = fmean(h.distance for h in self._by_distance)
            self.spread = (
                sum((h.distance - mean) ** 2 for h in self._by_distance),
                sum((h.distance - mean) * h.top for h in self._by_distance),
            )
        else:
            self.spread = 0.0, 0.0
        self.top = float(median(h.top for h in self._newest)) if newest else None


def height_log_odds(top: float | None, known: float | None) -> float:
    """Log-odds that a head's height above the floor is the person's rather than anybody's."""
    if top is None or known is None:
        return 0.0
    stooped = STOOPED if top > SEATED * known else LOWER
    return math.log((1 - STOOPED) * _normal(top - known, SIGMA) / ANY + stooped)


def _upper(tops: list[float]) -> float:
    """How tall who had these heights is: their upper quartile, as a head seldom seems too high."""
    return sorted(tops)[3 * (len(tops) - 1) // 4]


def _normal(x: float, sigma: float) -> float:
    return math.exp(-0.5 * (x / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))


_time, _distance = attrgetter('time'), attrgetter('distance')
