# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Following a target by its look, as far as depth has nothing against it.

What the look finds is gated by what depth tells there, until a surface, or somebody new who is one,
can be followed instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Floats
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.by_look import UNSURE, ByLook, Look, as_near
from rgbd_kcf_tracker.metric.decide.account import SMALL, Account
from rgbd_kcf_tracker.metric.decide.parts import FIRST
from rgbd_kcf_tracker.metric.decide.visible_box import box_about
from rgbd_kcf_tracker.metric.drawn import Drawn, unlike
from rgbd_kcf_tracker.metric.identity.elsewhere import MIDDLE
from rgbd_kcf_tracker.metric.identity.stood import Stood
from rgbd_kcf_tracker.metric.initialisation import LOCK_IOU, SAME_OUTLINE, whole_of
from rgbd_kcf_tracker.metric.newcomers import Newcomers
from rgbd_kcf_tracker.metric.perceive.depth_view import NEAREST, DepthView
from rgbd_kcf_tracker.metric.perceive.ego_motion import Lost
from rgbd_kcf_tracker.metric.perceive.figures import DEPTH_STEP
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.upright import TOP

LOOK_OFF, LOOK_OFF_SHARE = 0.03, 0.15
"""Metres, and shares of its width, by which the middle of a box found by look is off the target's:
cells of the filter are a tenth of it, and depth is that of any of its sides."""
ABOUT = 1.5
"""Times its size that the surroundings of a box are in which depth is read of what has none: a
quarter of it on each side, where what holds or carries it shows."""
ELSEWHERE = 0.0
"""Log-odds, by where it stood, below which a look is that of something else, as it is less likely
there than anywhere. At -1 another chair was it once the camera's own way was less sure."""
RELOCK_FRAMES = 3
"""Frames on end in which what the look finds must be a surface to go over to it."""
IS_ROOM = 0.6
"""Share of a box's middle that shows the room from which it is taken to be no more than that: of a
thin target's box up to half shows what is behind."""
NEWCOMER = 1.5
"""Seconds after the last look at a target without a surface in which somebody new may be it: the
next frame at 1 Hz, late ones as well; afterwards anybody may have come."""
READ = 0.5
"""Share of a box's middle that has depth from which depth tells what is there: half, since what has
no reading may be the target."""


@dataclass(frozen=True, slots=True)
class Gated:
    """What a frame says of a target that is followed by its look.

    Attributes:
        look: where it is found, None where it is hidden.
        stood: log-odds of that place by where the target stood; 0 where that is not known.
        onto: the box of what is to be followed by its surface from now on, None for nothing.
    """

    look: Look | None
    stood: float
    onto: Box | None


class GatedLook:
    """Follows one target by its look.

    Args:
        look: that follows it.
        account: of the frame in which it was chosen; None where that has no depth.
        box: the target in it.
        since: seconds of that frame.
        seen_ratio: see :class:`MetricParameters`.

    Attributes:
        stood: where the target stands; None where that is not known.
        drawn: who it is, where it is somebody whom depth does not show, or not apart; else None.
    """

    def __init__(
        self, look: ByLook, account: Account | None, box: Box, since: float, seen_ratio: float
    ) -> None:
        self._look, self._seen_ratio = look, seen_ratio
        about = frozenset[int]() if account is None else _people_about(account, box)
        self._newcomers = Newcomers(account, box, since, about)
        self._agreed, self._followed = 0, True
        self._mobile = self._carried = False
        self._began: tuple[tuple[slice, slice], Floats] | None = None
        self._last: Box | None = box
        self._at: FloatArray | None = None
        self.stood: Stood | None = None
        self.drawn: Drawn | None = None
        if account is not None:
            if look.unread or _tall(account.scene, box, look):
                self.drawn = Drawn.of(account, box, look)
            self._mobile = account.settled and room_share(account, box) < 1 - IS_ROOM
            part = _part(account.scene, box)
            self._began = part, account.scene.view.depth[part].copy()
            at = _place(account.scene.view, box, look.last_depth)
            if look.last_depth is not None and at is not None:
                self.stood, self._at = Stood(*at), at[0]

    @property
    def unseen(self) -> float:
        """Seconds since the target was last found."""
        return self._look.unseen

    def others(self, account: Account) -> set[int]:
        """Numbers of those who were there before the target was chosen, or seen beside it."""
        before = {p.number for p in account.people if self._newcomers.was_there(p)}
        return before | self._newcomers.beside

    def step(self, frame: Frame, account: Account | None, dt: float, turn: bool) -> Gated:
        """Look for the target in the next ``frame``, ``dt`` seconds later.

        Args:
            frame: the frame.
            account: what it shows, None where it has no depth.
            dt: seconds.
            turn: whether it may be searched for and learned from.
        """
        if account is not None:
            self._carried |= account.scene.motion is not None
            self._mobile |= self._has_gone(account)
            if self.stood is not None:
                self.stood.carried(account.scene.way, dt)
        self._followed = self.unseen == 0
        look, stood = self._look.step(frame, dt, turn, self._expected(account)), 0.0
        if account is not None:  # in the pixels of now, which the step above has gone over to
            self._last = self._carry(account.scene)
        if look is not None and account is not None and self._refused(account, look):
            self._look.refuse(frame, look)
            look = None
        if look is not None:
            self._look.take(frame, look, dt)
            at = None if account is None else _place(account.scene.view, look.box, look.depth)
            self._at = None if at is None else at[0]
            if at is not None:
                place, sigma, width = at
                if self.stood is None:
                    self.stood = Stood(place, sigma, width)
                self.stood.seen(place, sigma, dt)
                stood = self.stood.log_odds(place, sigma)
            if account is not None:
                self._newcomers.keep(account, look.box)
            self._carried = False
        onto = None
        # He came at some time since the frame before, that is in time where that was.
        in_time = self.unseen - dt < NEWCOMER
        # What is not where the target stood may be followed, but is not what it is known by.
        if stood < 0:
            self._agreed = 0
        elif account is not None and in_time:
            onto = self._onto(account, look, dt)
        return Gated(look, stood, onto)

    @property
    def response(self) -> float | None:
        """The filter's in the last frame against its recent mean, None where it was not asked."""
        return self._look.response

    def settle(self) -> None:
        """Learn what no answer waits for; after each :meth:`step`, before the next."""
        self._look.settle()

    def _carry(self, scene: Scene) -> Box | None:
        """Where the target was found last, as the image shows that place now."""
        if isinstance(scene.way, Lost):
            self._at = None
        elif scene.way is not None and self._at is not None:
            self._at = scene.way.of(self._at)
        if self._at is None or not self._carried:
            return self._look.last_box
        return self._about(scene.view, self._at)

    def _near_last(self, box: Box) -> bool:
        return self._last is not None and box.intersection(self._last) > 0

    def _expected(self, account: Account | None) -> Box | None:
        """Where in the image the target is that has always stood still, if that is known."""
        if account is None or self.stood is None or not self.stood.known:
            return None
        view = account.scene.view
        box = self._about(view, self.stood.place)
        shows = box is not None and box.over(view.step).clipped(*view.shape[::-1])
        return box if shows else None

    def _about(self, view: DepthView, place: FloatArray) -> Box | None:
        """The target's box about a place, ``(3,)`` metres; None beside the camera or behind it."""
        x, y, z = place.tolist()
        if z < NEAREST:
            return None
        across, down = view.place(x, y, z)
        last = self._look.last_box
        return Box.from_center(across * view.step, down * view.step, last.width, last.height)

    def _refused(self, account: Account, look: Look) -> bool:
        """Whether depth says that what is found is not the target."""
        # Where depth does not show it either, a look that has become unlike is something else;
        # but depth says nothing of what has no reading.
        silent = look.depth is None and self._look.last_depth is None
        changed = look.ratio < self._seen_ratio and not silent
        changed &= not (
            look.stands_out or self._goes_on(account, look) or self._stands_there(account, look)
        )
        reasons = (self._stands, self._taken, self._far, self._stood_elsewhere, self._unlike)
        return changed or any(refused(account, look) for refused in reasons)

    def _goes_on(self, account: Account, look: Look) -> bool:
        """Whether depth shows something as near as the target was a frame ago, before the room."""
        near = self._followed and as_near(look.depth, self._look.last_depth)
        if not near or not self._near_last(look.box):
            return False
        before = account.scene.before[_part(account.scene, look.box)]
        stands = np.count_nonzero(before) >= (1 - IS_ROOM) * before.size > 0
        return bool(stands or not account.settled)

    def _stands_there(self, account: Account, look: Look) -> bool:
        """Whether what is found is where the target stood in the world, as near as it stood."""
        expected = self._expected(account)
        if expected is None or look.depth is None or look.box.intersection(expected) == 0:
            return False
        return self._stood_odds(account, look) > 0

    def _stood_elsewhere(self, account: Account, look: Look) -> bool:
        """Whether what is found elsewhere is not where the target, which does not move, stood."""
        followed = self._followed and self._near_last(look.box)
        return not followed and self._stood_odds(account, look) < ELSEWHERE

    def _stood_odds(self, account: Account, look: Look) -> float:
        """What a place says by where the target stood, 0 where that is not known."""
        at = _place(account.scene.view, look.box, look.depth)
        return 0.0 if self.stood is None or at is None else self.stood.log_odds(*at[:2])

    def _stands(self, account: Account, look: Look) -> bool:
        """Whether a target that can move by itself would be what has always stood there."""
        return self._mobile and room_share(account, look.box) > IS_ROOM

    def _has_gone(self, account: Account) -> bool:
        """Whether the room shows where the target was chosen, before anything was known of it."""
        scene = account.scene
        if scene.motion is not None:
            self._began = None
        if self._began is None or not account.settled:
            return False
        part, began = self._began
        now = scene.view.depth[part]
        if now.shape != began.shape:
            return False
        gone = (began > 0) & (now > began + DEPTH_STEP) & scene.still[part]
        return bool(np.count_nonzero(gone) > (1 - IS_ROOM) * gone.size)

    def _unlike(self, account: Account, look: Look) -> bool:
        """Whether what has no reading looks unlike who was drawn: it is what he stood before."""
        if self.drawn is None or not self.drawn.telling or look.depth is not None:
            return False
        return unlike(self.drawn.gallery, account.scene, look.box, self._look)

    def _taken(self, account: Account, look: Look) -> bool:
        """Whether a box shows somebody else: who was there before, or beside, or looks unlike."""
        pixels = account.parts.kinds[_part(account.scene, look.box)]
        index = account.sight_among(account.parts.counted(pixels.ravel()))
        if index < 0:
            return False
        # A thing may be handed over to whoever stands beside it; somebody is not somebody else.
        drawn = self.drawn
        if drawn is not None and drawn.unlike(account.sights[index].view):
            return True
        owner = account.owner_of(index)
        held = drawn is None and _area(account.scene.view, look) < SMALL
        if owner is None or held:
            return False
        beside = owner.chosen or owner.number in self._newcomers.beside
        return self._newcomers.was_there(owner) or (drawn is not None and beside)

    def _far(self, account: Account, look: Look) -> bool:
        """Whether a box elsewhere than the target was is no figure, though depth tells of it.

        What fits in the hands is no figure anywhere: carried, it is a part of one, and wherever it
        is put down it stands before the room.
        """
        box = look.box
        if self._carried or not account.settled or self._near_last(box):
            return False
        part = _part(account.scene, box)
        depth = account.scene.view.depth[part]
        if np.count_nonzero(depth) < READ * depth.size:
            return False
        if _area(account.scene.view, look) < SMALL:
            return bool(np.count_nonzero(account.scene.before[part]) < (1 - IS_ROOM) * depth.size)
        outlines = (box_about(account.scene, s.seen) for s in account.sights)
        return all(outline.iou(box) < LOCK_IOU for outline in outlines)

    def _may_have_gone(self, look: Look | None) -> bool:
        """Whether what is found may be what the target has stood before, which depth cannot say."""
        return look is not None and self._look.unread and look.depth is None and look.ratio < UNSURE

    def _onto(self, account: Account, look: Look | None, dt: float) -> Box | None:
        """The box of a surface that has borne out the look, or of somebody new who is there."""
        if self.stood is None or not self.stood.known:  # what stands still does not come
            unseen = dt if self._may_have_gone(look) else self.unseen
            newcomer = self._newcomers.find(account, self._look, look, unseen, self.drawn)
            if newcomer is not None:
                return newcomer
        if look is None:
            self._agreed = 0
            return None
        self._agreed = self._agreed + 1 if _agrees(account, look.box) else 0
        return look.box if self._agreed >= RELOCK_FRAMES else None


def _agrees(account: Account, box: Box) -> bool:
    """Whether a box is that of a whole surface, which is no other target."""
    whole = whole_of(account, box)
    if whole is None or box_about(account.scene, whole).iou(box) <= SAME_OUTLINE:
        return False
    owner = account.owner_of(account.sight_of(whole))
    return owner is None or not owner.chosen


def _part(scene: Scene, box: Box) -> tuple[slice, slice]:
    """Rows and columns of the view that the middle of a box covers."""
    return scene.view.part(box.scaled(MIDDLE))


def _tall(scene: Scene, box: Box, look: ByLook) -> bool:
    """Whether what a box shows is as tall as somebody, who touches what stands beside him."""
    if look.last_depth is None:
        return False
    k = scene.view.intrinsics
    tall = box.height / scene.view.step * look.last_depth / k.fy
    return TOP[0] < tall < TOP[1]


def _place(
    view: DepthView, box: Box, depth: float | None
) -> tuple[FloatArray, FloatArray, float] | None:
    """Where the middle of what was found is, ``(3,)`` metres, how surely, and its width there.

    What has no reading itself is about as deep as what is read beside it, as far as that agrees.
    None where nothing is.
    """
    spread = 0.0
    if depth is None:
        read = view.depth[view.part(box.scaled(ABOUT))]
        read = read[read > 0]
        if not read.size:
            return None
        low, depth, high = np.percentile(read, (16, 50, 84)).tolist()
        spread = (high - low) / 2
    place = np.array(view.metres(box.cx / view.step, box.cy / view.step, depth))
    width = box.width / view.step * depth / view.intrinsics.fx
    aside = np.abs(place) / depth * spread
    return place, np.hypot(LOOK_OFF + LOOK_OFF_SHARE * width, aside), width


def _area(view: DepthView, look: Look) -> float:
    """Square metres of what was found, seen from the camera; infinite where it has no reading."""
    k = view.intrinsics
    pixels = look.box.area / view.step**2
    return math.inf if look.depth is None else pixels * look.depth**2 / (k.fx * k.fy)


def _people_about(account: Account, box: Box) -> frozenset[int]:
    """Numbers of all of whom something shows in a box: the target may be any of them."""
    kinds = np.unique(account.parts.kinds[_part(account.scene, box)])
    owners = (account.owner_of(kind - FIRST) for kind in kinds.tolist() if kind >= FIRST)
    return frozenset(owner.number for owner in owners if owner is not None)


def room_share(account: Account, box: Box) -> float:
    """Share of the middle of a box that shows the room."""
    part = account.scene.still[_part(account.scene, box)]
    return float(part.mean()) if part.size else 0.0
