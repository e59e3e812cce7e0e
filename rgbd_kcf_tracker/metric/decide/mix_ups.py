# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Two who came near each other, and may have been taken for one another since.

Where they pass, one hides the other or both are one figure, and places say little of who is who.
Afterwards places say much of it, and each is followed as whoever he was taken for; only their looks
tell, over some sightings, and by what was known of them before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.metric.identity.gallery import WHOLE_AREA, View
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.identity.tally import Tally

FloatArray = npt.NDArray[np.float64]
Likeness = npt.NDArray[np.float32]

NEAR = 1.0
"""Metres between two from which one may have been taken for the other."""
BEFORE = 1.0
"""Seconds before they came near from which on what was learned of them may be of the other: the
figure was of both before it was parted."""
AFTER = 5.0
"""Seconds after they were near for which it is watched who is who."""
MIXED_UP, ENOUGH = 2.0, 2.5
"""Log-odds from which they were taken for one another, as for a newcomer who is somebody known; and
sightings, counted by how much showed, that must say so, for each is where he was expected."""


class Followed(NamedTuple):
    """Somebody in view.

    Attributes:
        person: who he is taken for.
        place: ``(2,)`` metres across and along the floor.
        view: his look.
        column: of his sight.
        views: where the views of his gallery are among those of all.
    """

    person: Person
    place: FloatArray
    view: View
    column: int
    views: slice


class MixUp(NamedTuple):
    """Two who were taken for one another, and since when that may be, in seconds."""

    first: Person
    second: Person
    since: float


@dataclass
class _Meeting:
    since: float
    last: float
    said: Tally = field(default_factory=Tally)


class MixUps:
    """Watches all who came near each other."""

    def __init__(self) -> None:
        self._meetings: dict[tuple[int, int], _Meeting] = {}

    def watch(self, here: Sequence[Followed], alike: Likeness, time: float) -> MixUp | None:
        """Take the next frame.

        Args:
            here: all in view.
            alike: ``(v, n)`` likeness of each of ``n`` sights to each of the ``v`` known views.
            time: seconds.

        Returns:
            Two of them who were taken for one another, the first that are found; they are watched
            no longer.
        """
        self._meetings = {k: m for k, m in self._meetings.items() if time - m.last < AFTER}
        if len(here) < 2:
            return None
        places = np.stack([one.place for one in here])
        near = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1)) < NEAR
        found = None
        for i, one in enumerate(here):
            for j, other in enumerate(here[:i]):
                key = (other.person.number, one.person.number)
                key = (min(key), max(key))
                meeting = self._meetings.get(key)
                if near[i, j]:
                    if meeting is None:
                        meeting = self._meetings[key] = _Meeting(time - BEFORE, time)
                    meeting.last = time
                if meeting is None:
                    continue
                crosswise = _crosswise(one, other, alike, meeting.since)
                if crosswise is None:
                    continue
                meeting.said.add(*crosswise, time)
                if found is None and meeting.said.odds(ENOUGH) > MIXED_UP:
                    found = MixUp(one.person, other.person, meeting.since)
                    del self._meetings[key]
        return found


def _crosswise(
    one: Followed, other: Followed, alike: Likeness, since: float
) -> tuple[float, float] | None:
    """Log-odds that each of two is whom the other is taken for, by what was known before.

    Returns:
        They, and how much showed of those whom they are of, 0 to 1; None where nothing was known.
    """
    crossed = straight = 0.0
    shows = []
    for known, seen in ((one, other), (other, one)):
        gallery = known.person.gallery
        odds = gallery.log_odds_before(since, seen.view, alike[known.views, seen.column])
        as_taken = gallery.log_odds_before(since, known.view, alike[known.views, known.column])
        if odds is not None and as_taken is not None:
            crossed += odds
            straight += as_taken
            shows.append(min(1.0, seen.view.total / WHOLE_AREA))
    return (min(crossed, crossed - straight), sum(shows) / len(shows)) if shows else None
