# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Numbers that may have gone over to somebody else, and how that shows.

Where somebody comes into view just where another was lost, or comes out beside another who is
hidden now himself, or where one figure turns out to be two people, places say little of who is who.
Afterwards they say much, and each is followed as whoever he was taken for. Only the looks tell,
over some sightings and by what was known before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.metric.identity.gallery import Compared, View
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.identity.tally import Tally

NEAR = 1.0
"""Metres between two from which one may have been taken for the other: closer, arms touch and two
become one figure, and a step at 5 Hz (0.3 m each) may exchange their places."""
AFTER = 5.0
"""Seconds for which it is watched who is who after they were near, or since one came back: at 1 Hz
five sightings, twice :data:`SIGHTINGS`. Later on what was learned since speaks for itself."""
ANOTHER = 3.0
"""Log-odds (20 to 1) from which who came back is none of those who are known, and who goes on where
somebody was is one who is hidden: another side or another light may show of him."""
HIDDEN_FOR = 10.0
"""Seconds for which who was lost may come out under another's number: people stand together for as
long."""
ALL_BUT_OUT = 0.1
"""Square metres of somebody at the end of what is seen below which whatever shows there next may be
another: less than anybody new shows (:data:`~.crowd.NEW_AREA`)."""
ONE_FIGURE = 1.0
"""Seconds for which two who meet are one figure, of which one is followed and which is learned as
he: as long as two who pass each other, a shoulder's breadth apart, overlap at a walk."""
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
        compared: it, held against all views of all who are known; None where there is none.
        mine: which of these are of his gallery.
    """

    person: Person
    place: FloatArray
    view: View
    compared: Compared | None
    mine: slice


class MixUp(NamedTuple):
    """Two who were taken for one another, and since when that may be, in seconds.

    ``second`` is None where somebody new was taken for ``first``, or somebody chosen, who is
    recognised by who follows him.
    """

    first: Person
    second: Person | None
    since: float


class _Watched(NamedTuple):
    """One who came back, or one figure that turned out to be two people.

    Attributes:
        since: seconds, from when on what was learned may be of another.
        at: seconds of the first frame that showed him again, or two.
        another: log-odds, by looks, that he is another, or that the newcomer is he.
    """

    since: float
    at: float
    another: Tally


class MixUps:
    """Watches all who came near each other or were lost for a moment."""

    def __init__(self) -> None:
        self._near: dict[int, float] = {}
        self._returns: dict[int, _Watched] = {}
        self._hidden: dict[tuple[int, int], Tally] = {}
        self._parted: dict[tuple[int, int], _Watched] = {}
        self._time, self._counts = 0.0, 1.0

    def watch(
        self, here: Sequence[Followed], gone: Sequence[tuple[Person, slice]], time: float
    ) -> MixUp | None:
        """Take the next frame.

        Args:
            here: all in view, before this sight is learned.
            gone: those who are not, and of whom a view is known, each with which are his.
            time: seconds.

        Returns:
            Whose number went over to another, the first of them that is found.
        """
        self._near |= dict.fromkeys(_near(here), time)
        self._near = {n: last for n, last in self._near.items() if time - last < AFTER}
        self._returns = {n: back for n, back in self._returns.items() if time - back.at < AFTER}
        self._counts = min(1.0, (time - self._time) / SIGHTING)
        found = (
            self._returned(here, time)
            or self._came_out(here, gone, time)
            or self._parts(here, time)
        )
        self._time = time
        return found

    def _returned(self, here: Sequence[Followed], time: float) -> MixUp | None:
        found = None
        for one in here:
            number = one.person.number
            if one.person.chosen:  # he is recognised by who follows him
                continue
            if one.person.seen_at < self._time or _all_but_out(one.person):
                self._returns[number] = _Watched(self._time, time, Tally())
            back = self._returns.get(number)
            if back is None:
                continue
            odds = _by_before(one, one, back.since)
            if odds is None:
                continue
            back.another.add(-odds, self._counts * one.view.shows, time)
            if found is None and back.another.odds(SIGHTINGS) > ANOTHER:
                found = MixUp(one.person, None, back.since)
                del self._returns[number]
        return found

    def _came_out(
        self, here: Sequence[Followed], gone: Sequence[tuple[Person, slice]], time: float
    ) -> MixUp | None:
        """Who has the number of somebody whom he came out beside, and who is hidden now himself."""
        hidden = [(who, his) for who, his in gone if time - who.seen_at < HIDDEN_FOR]
        tallies: dict[tuple[int, int], Tally] = {}
        found = None
        for one in here:
            for other, his in hidden if one.person.number in self._near else ():
                since = other.seen_at
                if other.out_of_reach(one.place, time):
                    continue
                taken = _by_before(one, one, since)
                if taken is None or one.compared is None:
                    continue
                alike = np.fmax.reduce(one.compared.likeness[his]).tolist()
                odds = other.gallery.log_odds(one.view, alike)
                key = one.person.number, other.number
                said = tallies[key] = self._hidden.get(key) or Tally()
                said.add(min(odds, odds - taken), self._counts * one.view.shows, time)
                if found is None and said.odds(SIGHTINGS) > ANOTHER:
                    found = MixUp(one.person, None if other.chosen else other, since)
                    del tallies[key]
        self._hidden = tallies
        return found

    def _parts(self, here: Sequence[Followed], time: float) -> MixUp | None:
        """Who came out of somebody's figure, and is he whom that other has been taken for since."""
        self._parted = {k: each for k, each in self._parted.items() if time - each.at < AFTER}
        in_view = {one.person.number: one for one in here}
        for new in here:
            if new.person.first_seen != self._time or new.person.chosen:
                continue
            for one in here:
                person = one.person
                beside = math.dist(person.place, new.person.place) < NEAR
                if beside and person.seen_at == self._time and person.first_seen < self._time:
                    since = self._time - ONE_FIGURE
                    key = person.number, new.person.number
                    self._parted[key] = _Watched(since, self._time, Tally())
        for key, (since, _, another) in list(self._parted.items()):
            if not in_view.keys() >= set(key):
                continue
            one, new = (in_view[number] for number in key)
            if new.person.chosen:
                continue
            odds, taken = (_by_before(one, each, since) for each in (new, one))
            if odds is None or taken is None:
                continue
            shows = min(one.view.shows + new.view.shows, 1.0)
            another.add(min(odds, odds - taken), self._counts * shows, time)
            if another.odds(SIGHTINGS) > ANOTHER:
                del self._parted[key]
                return MixUp(one.person, new.person, since)
        return None


def _by_before(one: Followed, seen: Followed, since: float) -> float | None:
    """Log-odds that somebody in view is one of them, by what was known of him before ``since``.

    None where nothing was, or where he cannot be compared: in who lies nothing is where it was.
    """
    gallery, compared = one.person.gallery, seen.compared
    if compared is None or not gallery.stands(seen.view.top, seen.view.leans):
        return None
    return gallery.log_odds_before(since, seen.view, compared.likeness[one.mine])


def _all_but_out(person: Person) -> bool:
    """Whether hardly anything of somebody showed at the end of what is seen."""
    return person.last is not None and person.last.ends.any and person.last.area < ALL_BUT_OUT


def _near(here: Sequence[Followed]) -> list[int]:
    """Numbers of those who are near somebody else."""
    if len(here) < 2:
        return []
    places = np.stack([one.place for one in here])
    apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    near = np.count_nonzero(apart < NEAR, axis=1) > 1  # everybody is near himself
    return [here[i].person.number for i in np.flatnonzero(near).tolist()]
