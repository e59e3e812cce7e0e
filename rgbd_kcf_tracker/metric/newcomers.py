# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Who has come into sight where a target without a surface was, and may be it.

Of a target that comes in at the image's edge, or from behind something, only a part was chosen;
depth often begins some way inside of the image.
"""

from __future__ import annotations

import math

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.by_look import ByLook, Look, as_near
from rgbd_kcf_tracker.metric.decide.account import STATURE, Account
from rgbd_kcf_tracker.metric.decide.sighting import WHOLE
from rgbd_kcf_tracker.metric.decide.visible_box import box_about
from rgbd_kcf_tracker.metric.drawn import Drawn
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Sides

NEWCOMER_AREA = 0.1
"""Square metres of him, at the least: a head and shoulders; less is a piece of anything."""
COVERED = 0.6
"""Share of a newcomer's outline that lies in the target's box, at the least: more than half, so
that it is not he who stands beside it, but not all, as he may have moved on by a part of his
width."""
LEAST_SHOWN = 0.2
"""Times the area of the target's box that a newcomer's outline has, at the least: a head and
shoulders of somebody in view from head to foot. Less is a strip of the room that was hidden."""
MOST_TALLER = 2.0
"""Times the height of the target's box, where neither end of that is the image's, that a newcomer's
outline has at the most: what hid half of somebody may have gone. Who is larger is nearer, and
passes before the target, unless that has come nearer since it was chosen."""
WALK, WALKED = 1.4, 0.5
"""Metres a second by which that box reaches farther to both sides once the look is lost, and for
how many seconds: depth shows somebody in a doorway when he has taken a step out of it."""
NEAREST = 0.5
"""Metres from which a Kinect v2 reads depth."""
LIKELY = 0.6
"""Mean probability of his pixels' colours to be the target's, at the least: 0.5 is that of colours
which were never seen."""


class Newcomers:
    """Tells who is new from those who were there, or beside the target, before.

    Args:
        account: of the frame in which the target was chosen; None where that has no depth.
        box: the target in it.
        since: seconds of that frame.
        about: numbers of those of whom something showed in the box: it may be any of them.

    Attributes:
        beside: numbers of those who were seen beside it.
    """

    def __init__(
        self, account: Account | None, box: Box, since: float, about: frozenset[int]
    ) -> None:
        self._since, self._height, self._about = since, box.height, about
        self._pixels = None if account is None else _pixels(account.scene)
        self.beside: set[int] = set()
        self._ends = Sides() if account is None else account.scene.ends(box)

    def was_there(self, person: Person) -> bool:
        """Whether somebody was there before the target was chosen, and is not the target."""
        return person.first_seen <= self._since and person.number not in self._about

    def keep(self, account: Account, box: Box) -> None:
        """Take where the target is: all who show beside it are others, whoever passes it later."""
        self.beside |= {
            person.number
            for person, index in account.in_view.items()
            if box_about(account.scene, account.sights[index].seen).intersection(box) == 0
        }

    def find(
        self,
        account: Account,
        look: ByLook,
        found: Look | None,
        unseen: float,
        drawn: Drawn | None = None,
    ) -> Box | None:
        """The outline of who is likeliest the target by colours and place, None for nobody.

        Args:
            account: of the frame.
            look: of the target.
            found: what it has found in the frame, None for nothing.
            unseen: seconds since it was last surely found.
            drawn: who it is, where it is somebody of whom depth showed nothing.
        """
        best, likest, last = None, 0.0, look.last_box
        cut = account.scene.ends(last)
        tallest = max(MOST_TALLER * last.height, self._grown(account))
        if cut.top or cut.bottom:
            tallest = math.inf
        for index, sight in enumerate(account.sights):
            person = account.owner_of(index)
            if person is not None and person.chosen:  # another target
                continue
            if person is not None and (self.was_there(person) or person.number in self.beside):
                continue
            if drawn is not None and drawn.unlike(sight.view):
                continue
            seen, scene = sight.seen, account.scene
            outline = box_about(scene, seen)
            shown, least = _to_side(outline, seen.ends, scene), outline.area
            in_part = (seen.ends.left and self._ends.left) or (seen.ends.right and self._ends.right)
            # Of who was too far off to be read, perhaps a part was chosen, and the look does not
            # tell how large he gets as he comes nearer.
            if found is not None and look.unread and as_near(found.depth, seen.depth):
                in_part = in_part or (person is not None and person.upright)
            if in_part:
                least = min(shown.area, last.area)
            # Who has taken a step shows whole: a first piece of him is little to know him by.
            reach = last if seen.area < WHOLE else _reach(last, scene, seen.depth, unseen)
            if (
                seen.area < NEWCOMER_AREA
                or shown.area < LEAST_SHOWN * last.area
                or shown.height > tallest
                or shown.intersection(reach) < COVERED * least
            ):
                continue
            # Somebody else may come in before the target: he has other colours.
            colored = float(look.own(scene.image[seen.rows, seen.cols])[seen.mask].mean())
            likely = colored * shown.intersection(reach) / least
            if colored >= LIKELY and likely > likest:
                best, likest = outline, likely
        return best

    def _grown(self, account: Account) -> float:
        """How high a person may be by now, in pixels, who has walked to the camera all the while.

        He was as high as the box in which he was chosen.
        """
        pixels = _pixels(account.scene)
        first = STATURE * (self._pixels or pixels) / self._height
        return STATURE * pixels / max(first - WALK * (account.time - self._since), NEAREST)


def _pixels(scene: Scene) -> float:
    """Pixels of the image that a metre is high at one metre's distance."""
    return scene.view.intrinsics.fy * scene.view.step


def _reach(last: Box, scene: Scene, depth: float, unseen: float) -> Box:
    """Where a target at that depth may have walked to from its last box."""
    pixels = scene.view.intrinsics.fx * scene.view.step / depth
    step = WALK * min(unseen, WALKED) * pixels
    return Box(last.x - step, last.y, last.width + 2 * step, last.height)


def _to_side(outline: Box, ends: Sides, scene: Scene) -> Box:
    """An outline that ends where depth does, up to the image's own end."""
    left = 0.0 if ends.left else outline.x
    right = float(scene.view.shape[1] * scene.view.step) if ends.right else outline.right
    return Box.from_corners(left, outline.y, right, outline.bottom)
