# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Who passes for the room though a target may be there, as that was not seen before.

What a camera that moves sees for the first time passes for the room, unless it has all of a
person's shape: not so who sits, or shows above a desk, when it turns back to him. So does what
shows when something is rolled away before a camera that stands. But it is remembered where a target
was, and how it looks. Of others it is not asked: among all who were ever taken for somebody are
pieces of furniture, which would come back as well (docs/experiments.md).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rgbd_kcf_tracker.metric.decide.account import MOST, look_of
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.perceive.figures import LEAST_AREA
from rgbd_kcf_tracker.metric.perceive.room import SETTLE
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette

THERE = 0.5
"""Metres from where somebody was seen last within which what shows may be he: half of what may be
hidden of him, and by what the camera's own motion is off after a turn."""
SHOWN = 0.6
"""Seconds since something left within which what it has shown is held against those who are away:
some frames at 5 Hz. Who is not he by then is the room."""
LIKE = 2.0
"""Log-odds of his look, seven to one, from which it is he and not what he stood before."""


def stayed(scene: Scene, people: Sequence[Person], time: float) -> list[Silhouette]:
    """What passes for the room where a target is that is not in view, and looks as it does.

    Before a camera that moved it is where he was seen last; before one that stands, what something
    shows that has just left. The places of ``people`` are as the camera stands now, at ``time`` in
    seconds.
    """
    away = [p for p in people if p.chosen and p.misses]
    if not away:
        return []
    moved = scene.stood_for <= SETTLE
    if not moved and scene.known_for.min() > SHOWN:
        return []
    sizes, surfaces = scene.sizes, scene.surfaces
    places = (scene.axes @ np.stack((sizes.x, sizes.y, surfaces.depth))).T
    possible = (sizes.area > LEAST_AREA) & ~scene.large
    possible[0] = False
    found = []
    for label in np.flatnonzero(possible).tolist():
        place = places[label]
        if moved:
            near = [p for p in away if np.hypot(*(p.place - place)) < THERE]
        else:
            near = [p for p in away if not p.out_of_reach(place, time)]
        if not near:
            continue
        seen = scene.silhouette(label)
        if not moved and np.median(seen.pixels(scene.known_for)) >= SHOWN:
            continue
        before = seen.pixels(scene.before)
        if np.count_nonzero(before) >= MOST * len(before):
            continue  # seen as a figure anyway
        view = look_of(scene, seen)
        if any(p.gallery.log_odds(view) > LIKE for p in near):
            found.append(seen)
    return found
