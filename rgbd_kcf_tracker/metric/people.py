# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Who could be followed: those in view of whom it is sure that they are people.

Everyone before the room is accounted for as while following (:class:`MetricTargets`). Who has had a
person's shape or has walked is chosen once they show whole, and as round as a body is: a cupboard,
a box that is pushed about or a life-size picture is as tall, but it is flat, fills its outline, or
never stands before the room. Where that is not sure there is nobody yet.
"""

from __future__ import annotations

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.decide.account import Sight
from rgbd_kcf_tracker.metric.decide.visible_box import outline_box
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.upright import rounded
from rgbd_kcf_tracker.metric.targets import MetricTargets

SIGHTINGS = 2
"""Frames in which somebody was seen, at the least."""
LEAST_TOP = 0.9
"""Metres of the head above the floor, at the least: a dog's is lower."""
LEAST_HEIGHT = 0.55
"""Metres that show, at the least: head to hips."""
ASPECT = 1.15
"""Height against width, at the least."""
FILL = (0.3, 0.8)
"""Share of the box that a body fills; a box or a cupboard fills more, a rack less."""


class PersonFinder:
    """Finds people in the frames of one stream, the nearest first.

    Args:
        near, far: range in metres in which to look.
    """

    def __init__(self, near: float = 0.5, far: float = 4.5) -> None:
        self._near, self._far = near, far
        self._targets = MetricTargets(MetricParameters())
        self._targets.everyone = True

    def nearest(self, frame: Frame) -> Box | None:
        """The nearest person in the next frame, None where nobody is surely one."""
        self._targets.update(frame)
        account = self._targets.account
        if account is None:
            return None
        found: list[Silhouette] = []
        for person, index in account.in_view.items():
            sight = account.sights[index]
            if not self._near < sight.seen.depth < self._far:
                continue
            sure = person.alive and person.sightings >= SIGHTINGS
            if sure and whole(account.scene, sight) and rounded(account.scene.view, sight.seen):
                found.append(sight.seen)
        if not found:
            return None
        nearest = min(found, key=lambda seen: seen.depth)
        return outline_box(account.scene, nearest).clipped(frame.width, frame.height)


def whole(scene: Scene, sight: Sight) -> bool:
    """Whether a sight shows somebody from head to hips and from side to side."""
    seen, top = sight.seen, scene.top(sight.seen)
    if sight.parted or seen.cut.left or seen.cut.top or seen.cut.right:
        return False
    if seen.height < max(LEAST_HEIGHT, ASPECT * seen.width):
        return False
    if top is not None and top < LEAST_TOP:
        return False
    return FILL[0] < seen.fill < FILL[1]
