# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Everyone in view, explained together: each figure is somebody known, or somebody new."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.identity.gallery import View
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.perceive.figures import Figure, find_figures
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.upright import upright

FloatArray = npt.NDArray[np.float64]

NEW = 0.0
"""Log-odds of being somebody known from which a figure is not somebody new."""
SURE = 1.0
"""Log-odds by which an identity must be ahead of all others to be learned from."""
ALONE = 0.35
"""Metres beside a figure in which nobody else may be, for its view to be learned."""
WHOLE = 0.2
"""Square metres of a figure from which its view is learned."""
NEW_AREA = 0.12
"""Square metres of a figure from which it is somebody new."""
RECENT = 0.6
"""Seconds after the last sight for which a figure is parted where somebody is expected."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """A figure with its look."""

    figure: Figure
    view: View


@dataclass(slots=True, eq=False)
class Account:
    """How a frame is explained.

    Attributes:
        sights: what stands before the room, ``n`` of them.
        people: all who are known, ``m`` of them.
        odds: ``(m, n)`` log-odds of each being each.
        owner: for each sight the index among ``people``, or -1.
    """

    sights: list[Sight]
    people: list[Person]
    odds: FloatArray
    owner: list[int] = field(default_factory=list)

    def somebody(self, shape: tuple[int, int]) -> npt.NDArray[np.bool_]:
        """The pixels of those who are surely people, ``(h, w)`` bool: they may stand still."""
        mask = np.zeros(shape, np.bool_)
        for sight, owner in zip(self.sights, self.owner, strict=True):
            if owner >= 0 and self.people[owner].alive:
                seen = sight.figure.seen
                mask[seen.rows, seen.cols] |= seen.mask
        return mask


class Crowd:
    """Gives everyone who stands before the room an identity and keeps it.

    Attributes:
        people: all who are known.
    """

    def __init__(self) -> None:
        self.people: list[Person] = []
        self._next = 1

    def step(self, scene: Scene, time: float) -> Account:
        """Explain the next frame at ``time`` seconds."""
        expected = np.array([p.expected(time) for p in self.people if time - p.seen_at < RECENT])
        figures = find_figures(scene, expected.reshape(-1, 2))
        sights = [Sight(f, View.of(scene.view, scene.lab, f.seen, f.top)) for f in figures]
        account = Account(sights, list(self.people), self._odds(sights, time))
        self._assign(account)
        self._learn(account, scene.view.intrinsics, time)
        return account

    def _odds(self, sights: list[Sight], time: float) -> FloatArray:
        odds = np.zeros((len(self.people), len(sights)))
        if not odds.size:
            return odds
        places = np.stack([s.figure.place for s in sights])
        for row, person in enumerate(self.people):
            odds[row] = person.place_log_odds(places, time)
            for column, sight in enumerate(sights):
                odds[row, column] += person.gallery.log_odds(sight.view)
        return odds

    def _assign(self, account: Account) -> None:
        account.owner = [-1] * len(account.sights)
        if not account.odds.size:
            return
        rows, columns = linear_sum_assignment(-np.maximum(account.odds - NEW, 0))
        for row, column in zip(rows, columns, strict=True):
            if account.odds[row, column] > NEW:
                account.owner[column] = int(row)

    def _learn(self, account: Account, k: Intrinsics, time: float) -> None:
        places = [s.figure.place for s in account.sights]
        for column, sight in enumerate(account.sights):
            row = account.owner[column]
            if row < 0:
                if sight.figure.seen.area < NEW_AREA:
                    continue
                person = Person(self._next, places[column], time)
                self._next += 1
                self.people.append(person)
                account.owner[column] = len(account.people)
                account.people.append(person)
                sure = True
            else:
                person = account.people[row]
                person.moved_to(places[column], time)
                others = np.delete(account.odds[:, column], row)
                rival = max(0.0, float(others.max())) if len(others) else 0.0
                sure = account.odds[row, column] - rival > SURE
            if not sure:
                continue
            figure = sight.figure
            person.upright |= upright(figure.seen, k, figure.top)
            if sight.view.top is not None and sight.view.top > 1.2:
                person.gallery.learn_height(sight.view.top)
            alone = all(
                other is places[column]
                or abs(other[0] - places[column][0]) > ALONE
                for other in places
            )
            whole = figure.seen.area > WHOLE and not figure.seen.cut.top and alone
            if whole or not person.gallery.views:
                person.gallery.learn(sight.view)
