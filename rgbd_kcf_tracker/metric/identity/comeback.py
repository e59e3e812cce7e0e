# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Is who came back really the target? Held against what was known of it before it went.

Who is followed is where he was a moment ago, and what is learned of him is like him, whoever he is:
neither bears out who he is. Only his looks by the views from before the absence do, and so does
that nobody else in view has them more.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from rgbd_kcf_tracker.metric.identity.gallery import View
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.identity.tally import Heard, logit

BORNE_OUT = 2.0
"""Log-odds (seven to one) from which whoever was beside him since the return is not the target, as
much as it takes to give an old number to a newcomer
(:data:`~rgbd_kcf_tracker.metric.decide.account.SAME_AGAIN`)."""
EVEN = 0.5
"""Probability below which who came back is rather somebody else than the target: no box is shown of
him."""
DOUBTED = 0.4
"""Probability below which no box is shown any more of who came back, though he is followed on, as
his looks may yet bear him out: 3 to 2 against him, not even odds, as he was shown from those on and
looks a little otherwise in each frame."""
DISOWNED = 0.25
"""Probability that who came back is the target, by looks alone or with what his place said then,
below which he is somebody else after all: 3 to 1, as he was taken once already, on more than
this."""
AGAIN = 0.15
"""Seconds after which somebody is looked at again: nobody looks otherwise before."""


@dataclass(frozen=True, slots=True)
class Likely:
    """How likely who came back is the target, 0 to 1.

    Attributes:
        looks: by his looks, beside all in view and all others who are known.
        rival: how likely another in view is the target, the likeliest of whom enough was seen.
        score: beside anybody new as well.
    """

    looks: float
    rival: float
    score: float


class Comeback:
    """One return of a target, or of anybody else who was known, who may be somebody else.

    Args:
        person: he, as he was known before.
        time: seconds of the return.
        against: log-odds against anybody coming back just then.
        place: whether these are what his place says, as of one who was hidden for a moment: then it
            counts with his looks when it is asked whether he is somebody else after all.

    Attributes:
        since: seconds of the return.
        left: seconds of the last sight before it.
        known: the views and heights from before.
        met: numbers of those who had been seen beside the target.
        likely: what was heard last; None before anything was.
        trust: log-odds that what is learned of him is of the target, as it was settled last.
    """

    def __init__(self, person: Person, time: float, against: float, place: bool = False) -> None:
        self.since, self.left = time, person.seen_at
        self.known, self.met = person.gallery.copy(), frozenset(person.met)
        self.likely: Likely | None = None
        self.trust = math.inf
        self._new, self._place = math.exp(against), place
        self._mine, self._others = Heard(), dict[int, Heard]()

    def hear(
        self,
        view: View | None,
        others: dict[int, View],
        known: float,
        time: float,
        followed: Collection[int] = (),
    ) -> Likely:
        """Take a frame, and say whether who came back is the target.

        Args:
            view: of who came back; None where he is not seen.
            others: of all in view who may be the target as well, by their numbers. Of these one is
                looked at in each frame, who was looked at longest ago.
            known: odds that he is somebody else who is known, see
                :meth:`~rgbd_kcf_tracker.metric.decide.account.Account.as_others`.
            time: seconds.
            followed: numbers of those others who are followed themselves: nobody's rivals, as the
                target is not found again in them.
        """
        if view is not None:
            self._look(self._mine, view, time)
        for number in others:
            self._others.setdefault(number, Heard())
        if others:
            number = min(others, key=lambda each: self._others[each].last)
            self._look(self._others[number], others[number], time)
        mine = math.exp(self.odds)
        either, rival = mine, 0.0  # each may be the target, or none of them
        for number in others:
            heard = self._others[number]
            odds = heard.mean or 0.0
            if odds > 0:
                either += math.exp(odds)
                if heard.enough and number not in followed:
                    rival = max(rival, math.exp(odds))
        self.likely = Likely(
            looks=mine / (1.0 + known + either),
            rival=rival / (1.0 + either),
            score=mine / (self._new + known + either),
        )
        return self.likely

    def settle(self, person: Person) -> None:
        """What was learned of somebody since is his as surely as it was he who came back."""
        if self.likely is not None:
            self.trust = logit(self.likely.score)
            person.gallery.doubt(self.since, self.trust)

    def _look(self, heard: Heard, view: View, time: float) -> None:
        if time - heard.last >= AGAIN and self.known.stands(view.top, view.leans):
            self.known.hear(heard, self.known.log_odds(view), view, time)

    @property
    def enough(self) -> bool:
        """Whether enough was seen of who came back to believe his looks."""
        return self._mine.enough

    @property
    def denied(self) -> bool:
        """Whether who came back is somebody else after all."""
        likely = self.likely
        if likely is None:
            return False
        if self._place and likely.score < DISOWNED:
            return True
        return likely.looks < max(DISOWNED, likely.rival)

    @property
    def doubted(self) -> bool:
        """Whether who came back is so likely somebody else that no box of him is shown."""
        return self.likely is not None and self.likely.score < DOUBTED

    @property
    def odds(self) -> float:
        """Log-odds that who came back is the target, by his looks alone, of late.

        That many sightings say the same says little more: that two people wear the same does not
        change from frame to frame.
        """
        return self._mine.mean or 0.0

    @property
    def borne_out(self) -> bool:
        """Whether his looks say that he is the target."""
        return self.odds > BORNE_OUT
