# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Numbers that may have gone over to somebody else, and how that shows.

Where two pass each other, one hides the other or both are one figure, and places say little of who
is who; nor do they where somebody comes into view just where another was lost, or comes out beside
another who is hidden now himself. Afterwards places say much, and each is followed as whoever he
was taken for. Only the looks tell, over some sightings and by what was known before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.metric.identity.gallery import View
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.identity.tally import Tally

Likeness = npt.NDArray[np.float32]

NEAR = 1.0
"""Metres between two from which one may have been taken for the other: closer, arms touch and two
become one figure, and a step at 5 Hz (0.3 m each) may exchange their places."""
BEFORE = 1.0
"""Seconds before they came near from which on what was learned of them may be of the other: the
figure was of both before it was parted."""
AFTER = 5.0
"""Seconds for which it is watched who is who after they were near, or since one came back: at 1 Hz
five sightings, twice :data:`SIGHTINGS`. Later on what was learned since speaks for itself."""
MIXED_UP = 2.0
"""Log-odds (seven to one) from which two were taken for one another, as for a newcomer who is
somebody known, beyond what their places said against it while they were near. At 3 one of twins was
lost for a sixth of its scene, and everyone's returns fell from 86.3 to 84.7 %
(docs/experiments.md)."""
ANOTHER = 3.0
"""Log-odds (20 to 1) from which who came back is none of those who are known, and who goes on where
somebody was is one who is hidden: another side or another light may show of him."""
HIDDEN_FOR = 10.0
"""Seconds for which who was lost may come out under another's number: people stand together for as
long."""
SIGHTINGS = 2.5
"""Sightings, counted by how much showed, that must say so: each is where he was expected."""
SIGHTING = 0.1
"""Seconds after the last from which a sighting counts in full: sooner it shows nearly the same."""


class Followed(NamedTuple):
    """Somebody in view.

    Attributes:
        person: who he is taken for.
        place: ``(2,)`` metres across and along the floor.
        view: his look.
        column: of his sight.
        alike: ``(v, n)`` likeness of each of the ``n`` sights to each view of his gallery.
    """

    person: Person
    place: FloatArray
    view: View
    column: int
    alike: Likeness


class MixUp(NamedTuple):
    """Two who were taken for one another, and since when that may be, in seconds.

    ``second`` is None where somebody new was taken for ``first``, or somebody chosen, who is
    recognised by who follows him.
    """

    first: Person
    second: Person | None
    since: float


@dataclass
class _Doubt:
    """Sightings of who may be another.

    Attributes:
        since: seconds, from when on what was learned may be of another.
        last: seconds, when places last said little.
        against: log-odds against it by the places of then, at the least.
        said: log-odds of it by the looks.
    """

    since: float
    last: float
    against: float = math.inf
    said: Tally = field(default_factory=Tally)


class MixUps:
    """Watches all who came near each other or were lost for a moment."""

    def __init__(self) -> None:
        self._meetings: dict[tuple[int, int], _Doubt] = {}
        self._returns: dict[int, _Doubt] = {}
        self._hidden: dict[tuple[int, int], Tally] = {}
        self._time, self._counts = 0.0, 1.0

    def watch(
        self, here: Sequence[Followed], gone: Sequence[tuple[Person, Likeness]], time: float
    ) -> MixUp | None:
        """Take the next frame.

        Args:
            here: all in view, before this sight is learned.
            gone: those who are not, and of whom a view is known, each with the likeness to his
                views, as for those in view.
            time: seconds.

        Returns:
            Whose number went over to another, the first of them that is found.
        """
        self._meetings = {k: d for k, d in self._meetings.items() if time - d.last < AFTER}
        self._returns = {k: d for k, d in self._returns.items() if time - d.last < AFTER}
        self._counts = min(1.0, (time - self._time) / SIGHTING)
        found = (
            self._returned(here, time) or self._met(here, time) or self._came_out(here, gone, time)
        )
        self._time = time
        return found

    def _returned(self, here: Sequence[Followed], time: float) -> MixUp | None:
        found = None
        for one in here:
            number = one.person.number
            if one.person.chosen:  # he is recognised by who follows him
                continue
            if one.person.seen_at < self._time:
                self._returns[number] = _Doubt(self._time, time)
            doubt = self._returns.get(number)
            if doubt is None:
                continue
            odds = one.person.gallery.log_odds_before(
                doubt.since, one.view, one.alike[:, one.column]
            )
            if odds is None:
                continue
            doubt.said.add(-odds, self._counts * one.view.shows, time)
            if found is None and doubt.said.odds(SIGHTINGS) > ANOTHER:
                found = MixUp(one.person, None, doubt.since)
                del self._returns[number]
        return found

    def _met(self, here: Sequence[Followed], time: float) -> MixUp | None:
        if len(here) < 2:
            return None
        found = None
        places = np.stack([one.place for one in here])
        near = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1)) < NEAR
        for i, one in enumerate(here):
            for j, other in enumerate(here[:i]):
                numbers = sorted((one.person.number, other.person.number))
                key = numbers[0], numbers[1]
                if near[i, j]:
                    meeting = self._meetings.setdefault(key, _Doubt(time - BEFORE, time))
                    meeting.last = time
                    meeting.against = min(meeting.against, _by_places(one, other, time))
                doubt = self._meetings.get(key)
                if doubt is None:
                    continue
                crosswise = _crosswise(one, other, doubt.since)
                if crosswise is None:
                    continue
                odds, shows = crosswise
                doubt.said.add(odds, self._counts * shows, time)
                if found is None and doubt.said.odds(SIGHTINGS) > MIXED_UP + doubt.against:
                    found = MixUp(one.person, other.person, doubt.since)
                    del self._meetings[key]
        return found

    def _came_out(
        self, here: Sequence[Followed], gone: Sequence[tuple[Person, Likeness]], time: float
    ) -> MixUp | None:
        """Who has the number of somebody whom he came out beside, and who is hidden now himself."""
        near = {number for pair in self._meetings for number in pair}
        hidden = [each for each in gone if time - each[0].seen_at < HIDDEN_FOR]
        tallies: dict[tuple[int, int], Tally] = {}
        found = None
        for one in here:
            for other, alike in hidden if one.person.number in near else ():
                since = other.seen_at
                if other.out_of_reach(one.place, time):
                    continue
                taken = one.person.gallery.log_odds_before(
                    since, one.view, one.alike[:, one.column]
                )
                if taken is None:
                    continue
                odds = other.gallery.log_odds(one.view, float(np.fmax.reduce(alike[:, one.column])))
                key = one.person.number, other.number
                said = tallies[key] = self._hidden.get(key) or Tally()
                said.add(min(odds, odds - taken), self._counts * one.view.shows, time)
                if found is None and said.odds(SIGHTINGS) > ANOTHER:
                    found = MixUp(one.person, None if other.chosen else other, since)
                    del tallies[key]
        self._hidden = tallies
        return found


def _by_places(one: Followed, other: Followed, time: float) -> float:
    """Log-odds that each of two is where he was expected rather than where the other was."""
    places = np.stack((one.place, other.place))
    here, there = (each.person.place_log_odds(places, time) for each in (one, other))
    return max(0.0, float(here[0] + there[1] - here[1] - there[0]))


def _crosswise(one: Followed, other: Followed, since: float) -> tuple[float, float] | None:
    """Log-odds that each of two is whom the other is taken for, by what was known before.

    Returns:
        They, and how much showed of those whom they are of, 0 to 1; None where nothing was known.
    """
    crossed = straight = 0.0
    shows = []
    for known, seen in ((one, other), (other, one)):
        gallery = known.person.gallery
        odds = gallery.log_odds_before(since, seen.view, known.alike[:, seen.column])
        as_taken = gallery.log_odds_before(since, known.view, known.alike[:, known.column])
        if odds is not None and as_taken is not None:
            crossed += odds
            straight += as_taken
            shows.append(seen.view.shows)
    return (min(crossed, crossed - straight), sum(shows) / len(shows)) if shows else None
