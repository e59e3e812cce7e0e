# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Which sight is whom: the log-odds of each, and the assignment that explains most of a frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import linear_sum_assignment

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.metric.decide.account import RECENT, SAME_AGAIN, Sight
from rgbd_kcf_tracker.metric.decide.arrivals import away
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


def log_odds(
    people: list[Person],
    scene: Scene,
    sights: list[Sight],
    time: float,
    against: float,
    joined: Callable[[tuple[Looks, ...]], Looks],
) -> tuple[FloatArray, FloatArray, list[Compared]]:
    """Of ``m`` people being ``n`` sights, by place, look and height.

    Args:
        people: all who are known.
        scene: of the frame.
        sights: in it.
        time: seconds.
        against: log-odds against any one of those who are away coming back just now.
        joined: :meth:`Looks.joined`, or what remembers what that gave.

    Returns:
        ``(m, n)`` log-odds, the same by the look and the height alone, and each of the sights held
        against all views of all of the people; nothing where there is none.
    """
    odds = np.zeros((len(people), len(sights)))
    looks = np.zeros_like(odds)
    compared: list[Compared] = []
    if not odds.size:
        return odds, looks, compared
    known = tuple(p.gallery.looks for p in people if p.gallery.looks is not None)
    best: list[list[list[float]]] = []
    if known:
        everyone = joined(known)
        compared = [Compared.of(sight.view, everyone) for sight in sights]
        starts = np.cumsum([0] + [len(each) for each in known[:-1]]).tolist()
        best = np.stack([each.of_each(starts) for each in compared], axis=1).tolist()
    rows = iter(best)
    places = np.array([s.place for s in sights])
    low = np.array([not came(scene, s.seen) for s in sights])
    for row, person in enumerate(people):
        likeness = next(rows) if person.gallery.looks is not None else None
        for column, sight in enumerate(sights):
            most = None if likeness is None else likeness[column]
            looks[row, column] = person.log_odds(sight.view, time, most)
        odds[row] = person.place_log_odds(places, time)
        gone = away(time - person.seen_at)
        if person.chosen:
            odds[row] += np.minimum(looks[row], OF_TWO + gone)
        else:
            odds[row] += looks[row] - (against + SAME_AGAIN) * gone
        grown = (person.gallery.stature.top or 0.0) > GROWN
        if grown and low.any() and time - person.seen_at > RECENT:
            odds[row, low] = NEW - 1  # nor does he come back as a desk
    return odds, looks, compared


def assigned(odds: FloatArray) -> list[int]:
    """For each of ``n`` sights who it is by the assignment that explains most, -1 for a newcomer.

    Args:
        odds: ``(m, n)``, of ``m`` people being them, see :func:`log_odds`.
    """
    owner = [-1] * odds.shape[1]
    rows, columns = linear_sum_assignment(-np.maximum(odds - NEW, 0))
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        if odds[row, column] > NEW:
            owner[column] = row
    return owner
