# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Who still stands where he stood when a camera that turned away turns back.

What a camera that moves sees for the first time passes for the room, unless it has all of a
person's shape: not so who sits, or shows above a desk. But it is remembered where a target stood.
Of others it is not asked: among all who were ever taken for somebody are pieces of furniture, which
would come back as well (docs/experiments.md).
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
LIKE = 1.0
"""Log-odds of his look, nearly three to one, from which it is he and not what he stood before."""


def stayed(scene: Scene, people: Sequence[Person]) -> list[Silhouette]:
    """What passes for the room where a target stood that is not in view, and looks as it does.

    The places of ``people`` are as the camera stands now.
    """
    away = [p for p in people if p.chosen and p.misses and p.gallery.views]
    if not away or scene.stood_for > SETTLE:
        return []
    sizes, surfaces = scene.sizes, scene.surfaces
    places = (scene.axes @ np.stack((sizes.x, sizes.y, surfaces.depth))).T
    possible = (sizes.area > LEAST_AREA) & ~scene.large
    possible[0] = False
    found = []
    for label in np.flatnonzero(possible).tolist():
        near = [p for p in away if np.hypot(*(p.place - places[label])) < THERE]
        if not near:
            continue
        seen = scene.silhouette(label)
        before = seen.pixels(scene.before)
        if np.count_nonzero(before) >= MOST * len(before):
            continue  # seen as a figure anyway
        view = look_of(scene, seen)
        if any(p.gallery.log_odds(view) > LIKE for p in near):
            found.append(seen)
    return found
