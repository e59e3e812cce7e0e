# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Numbers that may have gone over to somebody else, and how that shows.

Where somebody comes into view just where another was lost, or comes out beside another who is
hidden now himself, places say little of who is who. Afterwards they say much, and each is followed
as whoever he was taken for. Only the looks tell, over some sightings and by what was known before.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Floats
from rgbd_kcf_tracker.metric.identity.gallery import View
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
        alike: ``(v, n, 2)`` likeness of each of the ``n`` sights to each view of his gallery, see
            :meth:`~rgbd_kcf_tracker.metric.identity.gallery.Compared.likeness`.
    """

    person: Person
    place: FloatArray
    view: View
    column: int
    alike: Floats


class MixUp(NamedTuple):
    """Two who were taken for one another, and since when that may be, in seconds.

    ``second`` is None where somebody new was taken for ``first``, or somebody chosen, who is
    recognised by who follows him.
    """

    first: Person
    second: Person | None
    since: float


class _Return(NamedTuple):
    """One who came back, and the log-odds of his looks that he is another.

    Attributes:
        since: seconds of the frame before, from when on what was learned may be of another.
        at: seconds of his return.
    """

    since: float
    at: float
    another: Tally


class MixUps:
    """Watches all who came near each other or were lost for a moment."""

    def __init__(self) -> None:
        self._near: dict[int, float] = {}
        self._returns: dict[int, _Return] = {}
        self._hidden: dict[tuple[int, int], Tally] = {}
        self._time, self._counts = 0.0, 1.0

    def watch(
        self, here: Sequence[Followed], gone: Sequence[tuple[Person, Floats]], time: float
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
        self._near |= dict.fromkeys(_near(here), time)
        self._near = {n: last for n, last in self._near.items() if time - last < AFTER}
        self._returns = {n: back for n, back in self._returns.items() if time - back.at < AFTER}
        self._counts = min(1.0, (time - self._time) / SIGHTING)
        found = self._returned(here, time) or self._came_out(here, gone, time)
        self._time = time
        return found

    def _returned(self, here: Sequence[Followed], time: float) -> MixUp | None:
        found = None
        for one in here:
            number = one.person.number
            if one.person.chosen:  # he is recognised by who follows him
                continue
            if one.person.seen_at < self._time:
                self._returns[number] = _Return(self._time, time, Tally())
            back = self._returns.get(number)
            if back is None:
                continue
            odds = one.person.gallery.log_odds_before(
                back.since, one.view, one.alike[:, one.column]
            )
            if odds is None:
                continue
            back.another.add(-odds, self._counts * one.view.shows, time)
            if found is None and back.another.odds(SIGHTINGS) > ANOTHER:
                found = MixUp(one.person, None, back.since)
                del self._returns[number]
        return found

    def _came_out(
        self, here: Sequence[Followed], gone: Sequence[tuple[Person, Floats]], time: float
    ) -> MixUp | None:
        """Who has the number of somebody whom he came out beside, and who is hidden now himself."""
        hidden = [(who, alike) for who, alike in gone if time - who.seen_at < HIDDEN_FOR]
        tallies: dict[tuple[int, int], Tally] = {}
        found = None
        for one in here:
            for other, alike in hidden if one.person.number in self._near else ():
                since = other.seen_at
                if other.out_of_reach(one.place, time):
                    continue
                taken = one.person.gallery.log_odds_before(
                    since, one.view, one.alike[:, one.column]
                )
                if taken is None:
                    continue
                odds = other.gallery.log_odds(
                    one.view, np.fmax.reduce(alike[:, one.column]).tolist()
                )
                key = one.person.number, other.number
                said = tallies[key] = self._hidden.get(key) or Tally()
                said.add(min(odds, odds - taken), self._counts * one.view.shows, time)
                if found is None and said.odds(SIGHTINGS) > ANOTHER:
                    found = MixUp(one.person, None if other.chosen else other, since)
                    del tallies[key]
        self._hidden = tallies
        return found


def _near(here: Sequence[Followed]) -> list[int]:
    """Numbers of those who are near somebody else."""
    places = np.array([one.place for one in here]).reshape(-1, 2)
    apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    near = np.count_nonzero(apart < NEAR, axis=1) > 1  # everybody is near himself
    return [here[i].person.number for i in np.flatnonzero(near).tolist()]
