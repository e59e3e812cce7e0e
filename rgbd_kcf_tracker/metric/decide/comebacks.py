# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether those who came back, and whom nobody chose, are whom they were taken for."""

from __future__ import annotations

import math
from collections.abc import Iterable

from rgbd_kcf_tracker.metric.decide.account import Account
from rgbd_kcf_tracker.metric.identity.comeback import Comeback
from rgbd_kcf_tracker.metric.identity.person import Person


class Comebacks:
    """The last return of each."""

    def __init__(self) -> None:
        self._comebacks: dict[int, Comeback] = {}

    @property
    def sure(self) -> dict[int, float]:
        """How likely each is whom he was taken for, 0 to 1, by numbers."""
        return {n: each.likely.score for n, each in self._comebacks.items() if each.likely}

    def trust(self, person: Person) -> float:
        """Log-odds that what is learned of somebody is his."""
        comeback = self._comebacks.get(person.number)
        return math.inf if comeback is None or person.chosen else comeback.trust

    def add(self, person: Person, since: float, against: float) -> None:
        """Somebody whom nobody chose came back, at ``since`` seconds."""
        if person.number in self._comebacks:
            self._comebacks[person.number].settle(person)
        self._comebacks[person.number] = Comeback(person, since, against)

    def drop(self, person: Person) -> None:
        """What was learned of somebody since he came back has gone over to another."""
        self._comebacks.pop(person.number, None)

    def hear(self, account: Account, people: Iterable[Person]) -> None:
        """Hear how those of all who are known look in a frame, by what was known before."""
        if not self._comebacks:
            return
        in_view = account.in_view
        here = {p.number: p for p in people if not p.chosen}
        self._comebacks = {n: each for n, each in self._comebacks.items() if n in here}
        for number, comeback in self._comebacks.items():
            person = here[number]
            if person in in_view:
                view = account.sights[in_view[person]].view
                known = account.as_others(person, in_view[person])
                comeback.hear(view, {}, known, account.time)
                if comeback.enough:
                    comeback.settle(person)
