# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Somebody in view: where he is, how he moves, and how he looks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Floats
from rgbd_kcf_tracker.metric.identity.calm import Calm
from rgbd_kcf_tracker.metric.identity.gallery import Gallery, View
from rgbd_kcf_tracker.metric.identity.tally import Heard, Tally
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.pose import Pose

PLACE_SIGMA = 0.18
"""Metres by which the middle of a silhouette differs from the person's place: half a chest in
depth, and to the side half of what an arm or a half hidden body moves it."""
WALKING = 0.8
"""Metres a second by which a person's next place is unknown: about half of a walk (1.4 m/s), as who
walks may stop, and who stands may go. Chosen with the real people at 1 Hz among others
(docs/experiments.md)."""
WALKS = 0.4
"""Metres a second from which a person walks: more than those who stand seem to move."""
STEADY = 0.7
"""Share of that for one who has been followed for some frames and was just seen."""
COAST = 1.2
"""Seconds for which a person goes on as before: from one frame to the next at 1 Hz, and a little
more, as cameras are late. At 0.6 of that second places fell short of where walkers were."""
SLOW, STANDS, SWAYING = 0.25, 0.7, 0.4
"""Metres a second below which a person stands, the probability that he goes on standing, and metres
a second by which his next place is unknown if he does."""
TURNED = 0.5
"""Probability that who was missed, and may still be behind what hid him, has stopped or turned
round meanwhile rather than gone on: even, as nothing was seen of it."""
VELOCITY_TIME = 0.3
"""Seconds after which a velocity is two thirds of what the sightings since then tell: two frames at
5 Hz, since one alone may be off by as much as a step."""
RECENT = 1.5
"""Seconds between two sightings that tell a velocity: successive ones at 1 Hz, late ones as well;
in more of them somebody has turned."""
ROOM_AREA = 16.0
"""Square metres of floor that a camera sees: a stranger may be anywhere in it."""
FASTEST, MISPLACED = 3.0, 0.8
"""Metres a second at which nobody walks, and metres by which the places of two parts of one person
differ."""
FORGET = 3.0
"""Seconds after which two thirds of where somebody was is forgotten: by then a walker has crossed
what a camera sees (:data:`ROOM_AREA`)."""
TRAVELLED = 0.5
"""Metres that a thing which was moved, or the noise of one, does not travel."""
BEYOND, EMPTY = 0.3, 0.5
"""Metres behind the last sight of somebody at which the camera sees past its place, as a body is
0.2 to 0.25 m deep and far readings are off by some centimetres, and the share of its outline where
it does so if it has gone."""
JOINED = 0.3
"""Share of an outline that is joined to something large, from which it is of a piece of that and
not of somebody: of real and simulated people one sighting in five hundred has it, of pieces of
walls more than half."""
FLAT = 0.5
"""Share of the sightings as something flat from which it is flat: most of them."""
FALLS = 0.6
"""Seconds without a sight in which somebody falls, at the most: some frames at 5 Hz."""
ANYWHERE = 0.02
"""Probability that somebody just seen is anywhere by now (mistaken before, or hidden): of some
fifty boxes one is on something else."""

_OF_NOW = (
    *('place', 'velocity', 'seen_at', 'came', 'misses', 'last', 'calm', 'hidden', 'figure'),
    *('joined', 'flat'),
)
"""Attributes that go along with who is seen where he turns out to be somebody else."""


class Person:
    """One identity.

    Args:
        number: its id.
        place: ``(2,)`` metres across and deep, see Figure.place.
        time: seconds.
        chosen: whether somebody asked to follow it.

    Attributes:
        seen_at: seconds, the last sight.
        came: seconds, the first sight since it was last away.
        sightings: how often it was seen.
        misses: frames since then that showed nothing of it.
        mobile: whether it was seen before a room that is known: what stands still is not it.
        area: square metres, the most that was seen of it.
        entered: whether it was first seen at the edge of what the camera sees.
        last: the silhouette of the last sight, None where the camera has moved since, or where
            depth showed nothing of it.
        hidden: whether it may still stand there, as nothing beyond that place has shown since.
        upright: whether it ever had the shape of a person.
        figure: whether it was a figure when it was last seen, and not a thing too small for one.
        calm: what it was found as elsewhere than where it had been, until that stirs.
        met: numbers of those who were seen at the same time, or too far off for him to have walked
            there, and so are surely somebody else.
        travelled: metres, the farthest from where it was first seen.
        joined: the shares of its outline where it is joined to something large. Before a camera
            that stands nothing is added of what has had a person's shape, and none is kept of who
            has walked as well.
        flat: 1 for each sighting as something flat, 0 for others that tell, see
            :func:`~rgbd_kcf_tracker.metric.perceive.upright.flat`; none of who was chosen.
        again: log-odds that it is one of those who had gone before it came, by its looks alone, see
            :class:`~rgbd_kcf_tracker.metric.decide.arrivals.Arrival`.
    """

    def __init__(self, number: int, place: FloatArray, time: float, chosen: bool = False) -> None:
        self.number, self.chosen = number, chosen
        self.place, self.velocity = place.copy(), np.zeros(2)
        self.first_place, self.travelled = place.copy(), 0.0
        self.seen_at = self.first_seen = self.came = time
        self.sightings, self.misses = 1, 0
        self.upright = self.mobile = self.entered = self.figure = False
        self.hidden = True
        self.met: set[int] = set()
        self.last: Silhouette | None = None
        self.calm: Calm | None = None
        self.area, self.again = 0.0, -math.inf
        self.joined, self.flat = Tally(), Tally()
        self._resembles: dict[int, Heard] = {}
        self.gallery = Gallery()

    @property
    def alive(self) -> bool:
        """Whether this is surely somebody and not a thing that was moved or a door that opened."""
        if self.chosen:
            return True
        # What goes on beside it is something that it is a piece of, as of a wall.
        apart = not self.joined.enough or (self.joined.mean or 0.0) <= JOINED
        flat = (self.flat.mean or 0.0) > FLAT
        return (self.upright or self.travelled > TRAVELLED) and apart and not flat

    @property
    def walks(self) -> bool:
        """Whether it was walking when it was last seen."""
        return self.sightings > 2 and float(np.hypot(*self.velocity)) >= WALKS

    def log_odds(self, view: View, time: float, alike: Sequence[float] | None = None) -> float:
        """Log-odds that a view at ``time`` is of this person, see :meth:`Gallery.log_odds`."""
        return 0.0 if self.lies(view.top, time, view.leans) else self.gallery.log_odds(view, alike)

    def lies(self, top: float | None, time: float, leans: bool = False) -> bool:
        """Whether this person, followed until a moment ago, would have to lie to be seen so.

        Later on what is as low is no part of him.

        Args:
            top: metres above the floor of what is seen; None where that is not known.
            time: seconds.
            leans: see :attr:`View.leans`.
        """
        return not self.gallery.stands(top, leans) and time - self.seen_at <= FALLS

    def expected(self, time: float) -> FloatArray:
        """Where it is by now, ``(2,)`` metres."""
        ahead: FloatArray = self.place + self.velocity * min(time - self.seen_at, COAST)
        return ahead

    def place_log_odds(self, places: FloatArray, time: float) -> FloatArray:
        """Log-odds, ``(n,)``, of being at ``places`` ``(n, 2)`` rather than anybody else."""
        gone = time - self.seen_at
        steady = STEADY if self.sightings > 2 and gone < COAST else 1.0
        variance = PLACE_SIGMA**2 + (WALKING * steady * min(gone, FORGET)) ** 2
        anywhere = max(ANYWHERE, 1 - float(np.exp(-((gone / FORGET) ** 2))))
        walks = _density(places, self.expected(time), variance)
        if self.misses and self.hidden:
            variance = PLACE_SIGMA**2 + (WALKING * min(gone, FORGET)) ** 2
            turned = _density(places, self.place, variance)
            walks = (1 - TURNED) * walks + TURNED * turned
        walks = (1 - anywhere) * walks * ROOM_AREA + anywhere
        stands = self._stands(gone)
        if stands == 0:
            return np.log(walks)
        swayed = PLACE_SIGMA**2 + (SWAYING * min(gone, COAST)) ** 2
        still = _density(places, self.place, swayed)
        return np.log(stands * still * ROOM_AREA + (1 - stands) * walks)

    def _stands(self, gone: float) -> float:
        """Probability that it still stands where it was seen ``gone`` seconds ago."""
        if self.sightings <= 2 or np.hypot(*self.velocity) > SLOW:
            return 0.0
        if gone < COAST:
            return STANDS
        # What hides somebody mostly passes; who has left shows by his empty place.
        return STANDS * float(np.exp(-gone / FORGET)) if self.hidden else 0.0

    def placed(self, place: FloatArray, time: float) -> None:
        """Take where it is, ``(2,)`` metres, by other means: depth shows nothing of it."""
        self.place, self.seen_at, self.misses = place, time, 0
        self.last, self.hidden = None, True

    def missed(self, depth: Floats) -> None:
        """Take a frame in which it was not found, ``(h, w)`` metres, 0 where nothing is read."""
        self.misses += 1
        if self.last is None or not self.hidden:
            return
        there = self.last.pixels(depth)
        past = int(np.count_nonzero(there > self.last.depth + BEYOND))
        self.hidden = past < EMPTY * len(there)
        if not self.hidden:  # what goes away is no furniture
            self.calm = None

    def out_of_reach(self, place: FloatArray, time: float) -> bool:
        """Whether it cannot have got to ``place``, ``(2,)`` metres, since it was last seen."""
        distance = float(np.hypot(*(place - self.place)))
        return distance > MISPLACED + FASTEST * (time - self.seen_at)

    def meet(self, other: Person) -> None:
        """Remember for both that they are surely not the same, see :attr:`met`."""
        self.met.add(other.number)
        other.met.add(self.number)

    def resembled(self, other: Person, odds: float, view: View, time: float) -> None:
        """Take log-odds of a view of this one, at ``time`` in seconds, to be of another.

        The ``other`` is not in view.
        """
        heard = self._resembles.setdefault(other.number, Heard())
        other.gallery.hear(heard, odds, view, time)

    def resemblance(self, other: int) -> float | None:
        """Mean log-odds of looking like another, in the sightings of late; None for none."""
        return self._resembles[other].mean if other in self._resembles else None

    def resembles(self, other: int, surely: bool = True) -> float:
        """Log-odds of looking like another, by all sightings of late; 0 where there are none.

        ``surely``: so that the one is given the number of the other, see :attr:`Heard.recognised`.
        """
        heard = self._resembles.get(other)
        if heard is None:
            return 0.0
        return heard.recognised if surely else heard.odds()

    def forget(self, other: int) -> None:
        """Drop what is remembered of another, who is no more."""
        self.met.discard(other)
        self._resembles.pop(other, None)

    def seen_before(self, new: Mapping[int, float]) -> float:
        """Log-odds of being any of some who had gone, rather than somebody new, by looks alone.

        Args:
            new: for the number of each, how likely he was new himself when he came, 0 to 1; else
                he is one of the others once more.
        """
        same = sum(
            share * math.exp(self._resembles[number].believed)
            for number, share in new.items()
            if number in self._resembles and number not in self.met
        )
        return math.log(same) if same > 0 else -math.inf

    def become(self, newcomer: Person) -> None:
        """Go on as somebody who has turned out to be the same."""
        if newcomer.seen_at > self.seen_at:
            vars(self).update(newcomer._of_now())
        self.sightings += newcomer.sightings
        self.area = max(self.area, newcomer.area)
        self.upright |= newcomer.upright
        self.mobile |= newcomer.mobile
        self.met |= newcomer.met
        self.travelled = max(self.travelled, newcomer.travelled)
        self.gallery.take(newcomer.gallery)

    def exchange(self, other: Person, since: float) -> None:
        """Go on as each other: the two turned out to have been taken for one another.

        Args:
            other: the other.
            since: seconds; what was learned of their looks from then on goes along.
        """
        of_now = self._of_now()
        vars(self).update(other._of_now())
        vars(other).update(of_now)
        mine, his = self.gallery.taken_back(since), other.gallery.taken_back(since)
        self.gallery.take(his)
        other.gallery.take(mine)
        self._resembles, other._resembles = {}, {}
        self.again = other.again = -math.inf

    def _of_now(self) -> dict[str, object]:
        return {name: getattr(self, name) for name in _OF_NOW}

    def carried(self, motion: Pose, axes: FloatArray, now: FloatArray) -> None:
        """Keep the place and the velocity in the world while the camera moves.

        Args:
            motion: the pose of the last camera's frame in that of now, in metres.
            axes: of places so far, ``(2, 3)``, see :attr:`~.perceive.scene.Scene.axes`.
            now: those from now on.
        """
        self.last, self.hidden = None, False
        turned = now @ motion.rotation @ axes.T
        # The floor of two frames differs by some noise, and no place is to grow by that.
        turn = math.atan2(turned[1, 0] - turned[0, 1], turned[0, 0] + turned[1, 1])
        cos, sin = math.cos(turn), math.sin(turn)
        turned = np.array([[cos, -sin], [sin, cos]])
        shift = now @ motion.translation
        self.place = turned @ self.place + shift
        self.first_place = turned @ self.first_place + shift
        self.velocity = turned @ self.velocity

    def moved_to(self, place: FloatArray, time: float, walks: bool = True) -> None:
        """Take a sight of it.

        Args:
            place: ``(2,)`` metres.
            time: seconds.
            walks: whether the step there may be its own.
        """
        gone = time - self.seen_at
        if 0 < gone < RECENT:
            new = 1 - np.exp(-gone / VELOCITY_TIME)
            self.velocity += new * ((place - self.place) / gone - self.velocity)
        elif gone > 0:
            self.velocity = np.zeros(2)
        self.place = place.copy()
        self.seen_at, self.hidden = time, True
        self.misses = 0
        self.sightings += 1
        if walks:
            self.travelled = max(self.travelled, float(np.hypot(*(place - self.first_place))))


def _density(places: FloatArray, place: FloatArray, variance: float) -> FloatArray:
    """Of somebody about ``place`` at each of ``places``, ``(n, 2)``, to the square metre, ``(n,)``.

    ``variance`` is that along either axis, in square metres.
    """
    squared: FloatArray = np.square(places - place).sum(axis=1)
    return np.exp(-0.5 * squared / variance) / (2 * np.pi * variance)
