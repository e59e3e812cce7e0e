# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Which sight is whom: the log-odds of each, and the assignment that explains most of a frame."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.metric.decide.account import RECENT, SAME_AGAIN, Sight
from rgbd_kcf_tracker.metric.decide.arrivals import away
from rgbd_kcf_tracker.metric.decide.mix_ups import Likeness
from rgbd_kcf_tracker.metric.identity.gallery import Compared, Looks
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.perceive.figures import came
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.upright import GROWN

NEW = 0.0
"""Log-odds of being somebody known from which a figure is not somebody new: even ones, as both are
weighed in what they are made of already."""
OF_TWO = 3.0
"""Log-odds that a look gives at most to who was chosen and was seen a moment ago, one more once he
is away: a drawn box may hold two things, and what shows of one of them alone is more like both than
the other is."""


class Association:
    """Weighs everyone who is known for each sight, by place, look and height."""

    def __init__(self) -> None:
        self._known: list[Looks] = []
        self._everyone: Looks | None = None

    def log_odds(
        self, people: list[Person], scene: Scene, sights: list[Sight], time: float, against: float
    ) -> tuple[FloatArray, FloatArray, Likeness]:
        """Of ``m`` people being ``n`` sights.

        Args:
            people: all who are known.
            scene: of the frame.
            sights: in it.
            time: seconds.
            against: log-odds against any one of those who are away coming back just now.

        Returns:
            ``(m, n)`` log-odds, the same by the look and the height alone, and ``(v, n)`` likeness
            to each known view.
        """
        odds = np.zeros((len(people), len(sights)))
        looks = np.zeros_like(odds)
        alike = np.zeros((0, len(sights)), np.float32)
        if not odds.size:
            return odds, looks, alike
        known = [p.gallery.looks for p in people if p.gallery.looks is not None]
        best: list[list[float]] = []
        if known:
            everyone = self._joined(known)
            compared = [Compared.of(sight.view, everyone) for sight in sights]
            alike = np.array([each.similarity() for each in compared]).T
            starts = np.cumsum([0] + [len(each) for each in known[:-1]]).tolist()
            best = np.array([each.of_each(starts) for each in compared]).T.tolist()
        rows = iter(best)
        places = np.array([s.figure.place for s in sights])
        low = np.array([not came(scene, s.figure.seen) for s in sights])
        for row, person in enumerate(people):
            likeness = next(rows) if person.gallery.looks is not None else None
            for column, sight in enumerate(sights):
                most = None if likeness is None else likeness[column]
                looks[row, column] = person.gallery.log_odds(sight.view, most)
            odds[row] = person.place_log_odds(places, time)
            gone = away(time - person.seen_at)
            if person.chosen:
                odds[row] += np.minimum(looks[row], OF_TWO + gone)
            else:
                odds[row] += looks[row] - (against + SAME_AGAIN) * gone
            if low.any() and time - person.seen_at > RECENT and (person.gallery.top or 0.0) > GROWN:
                odds[row, low] = NEW - 1  # nor does he come back as a desk
        return odds, looks, alike

    def _joined(self, known: list[Looks]) -> Looks:
        """All of some looks, which mostly are the same as in the frame before."""
        last = self._known
        if (
            self._everyone is None
            or len(known) != len(last)
            or any(now is not before for now, before in zip(known, last, strict=True))
        ):
            self._known, self._everyone = known, Looks.joined(known)
        return self._everyone


def assigned(odds: FloatArray, sights: int) -> list[int]:
    """For each sight who it is by the assignment that explains most, -1 for somebody new."""
    owner = [-1] * sights
    if odds.size:
        rows, columns = linear_sum_assignment(-np.maximum(odds - NEW, 0))
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
            if odds[row, column] > NEW:
                owner[column] = row
    return owner
