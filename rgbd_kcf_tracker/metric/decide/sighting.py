# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What one sighting tells of somebody: where he is, whether he can walk, and how he looks."""

from __future__ import annotations

import math

from rgbd_kcf_tracker.metric.decide.account import Account
from rgbd_kcf_tracker.metric.decide.visible_box import box_about
from rgbd_kcf_tracker.metric.identity.calm import Calm
from rgbd_kcf_tracker.metric.identity.gallery import ALL_SIDES, Gallery
from rgbd_kcf_tracker.metric.identity.person import TRAVELLED, Person
from rgbd_kcf_tracker.metric.identity.stature import Height
from rgbd_kcf_tracker.metric.identity.tally import Tally
from rgbd_kcf_tracker.metric.perceive.figures import AT_REST, came
from rgbd_kcf_tracker.metric.perceive.room import SETTLE
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.upright import HEADED, flat, person_sized, upright

SURE = 1.0
"""Log-odds by which a chosen one must be ahead of all others to be learned from, and others of him;
among these the likeliest is enough, for who is known by few views is hardly recognised."""
WHOLE = 0.2
"""Square metres of a figure from which its view is learned: about a head and a chest. Of less so
few of the slices show that others have them as well."""
PART_OF_ROOM = 0.3
"""Share of a silhouette that shows the room up to which it stands before it: outlines are mixed
with what is behind, and feet lie as near to the floor as its depth is uncertain."""
VACANT = 0.5
"""Share of a silhouette from which it stands where nobody did before, and not where somebody always
has: most of it."""
TENTH = 0.1
"""Seconds since the last sighting from which one counts as one: at 30 Hz three are."""
LEAP = 0.5
"""Metres from one sight to the next from which somebody was found, not followed: more than a part
of him is from another, and than he walks in a third of a second."""


def learn_sighting(
    account: Account, row: int, seen: Silhouette, index: int, sure: bool, trust: float
) -> None:
    """Learn of one person what a sighting tells.

    Args:
        account: of the frame.
        row: the person's, among its people.
        seen: the silhouette.
        index: of the sight that it is, -1 where it is no figure.
        sure: whether it is surely that person: else nothing but the place is learned.
        trust: log-odds that who has that person's number since he came back is he.
    """
    person, scene = account.people[row], account.scene
    place = account.place(seen)
    gone = account.time - person.seen_at
    if gone > 0:
        person.calm = _calm(account, person, seen)
        # What comes into view, or out from behind something, seems to walk as more of it shows.
        walks = scene.stood_for >= AT_REST or (not seen.cut.any and came(scene, seen))
        person.moved_to(place, account.time, walks)
    person.last, person.figure = seen, index >= 0
    walked = person.travelled > TRAVELLED
    weight = min(gone / TENTH, 1.0)
    # Before a camera that stands who has a person's shape may lie on something large; but a camera
    # may turn before a bare wall, and nothing tells.
    if scene.stood_for >= SETTLE and person.upright:
        if walked:  # he has come from where he was joined to it
            person.joined = Tally()
    elif index >= 0:
        joined = account.parts.joined[index]
        if joined is not None:
            person.joined.add(joined, weight, account.time)
    if index >= 0 and not person.chosen:
        is_flat = flat(scene.view, scene.elevation, seen, walked)
        if is_flat is not None:
            person.flat.add(is_flat, weight, account.time)
    if not sure or (scene.since is None and person.gallery.views):
        return
    person.area = max(person.area, seen.area)
    # What is small lies as near to the room as the room's depth is uncertain.
    # Before the room is known anything may seem to stand before it, but not walk.
    known = account.settled or walked
    if known and not person.mobile and seen.area > WHOLE:
        person.mobile = bool(seen.pixels(scene.before).mean() > 1 - PART_OF_ROOM)
    view = account.look(seen)
    all_sides = len(person.gallery.views) > ALL_SIDES
    if index >= 0 and row < len(account.odds):
        odds, looks = account.odds[:, index].tolist(), account.looks[:, index].tolist()
        ahead = SURE if person.chosen else 0.0
        rivals = [
            theirs + (SURE if other.chosen else ahead)
            for other, theirs in zip(account.people, odds, strict=False)
            if other is not person
        ]
        # His place may say that it is he, and his look that it is one who is not in view.
        here = {*account.owner, row}
        liker = max([0.0, *(look for n, look in enumerate(looks) if n not in here)])
        if odds[row] < max([ahead, *rivals]) or (all_sides and liker - looks[row] > SURE):
            return
    person.upright = (
        person.upright
        or (account.settled and person_sized(seen, view.top) and has_come(scene, seen))
        or upright(seen, scene.view.intrinsics, view.top)
    )
    alone = index < 0 or not account.sights[index].parted
    headed = not seen.cut.top or (seen.highest(scene.elevation) or 0.0) > HEADED
    # Where something nearer cuts somebody off, some of his pixels may be another's.
    apart = not (all_sides and (seen.cut.left or seen.cut.right))
    stands = person.gallery.stands(view.top, view.leans)
    whole = seen.area > WHOLE and headed and alone and apart and stands
    if whole and person.gallery.mixed:
        person.gallery = Gallery()
    if view.top is not None:
        height = Height(view.top, view.distance, account.time, person.walks)
        person.gallery.stature.learn(height, alone)
    if whole or not person.gallery.views:
        described = account.described(view, box_about(scene, seen))
        person.gallery.learn(described, account.time, trust)


def has_come(scene: Scene, seen: Silhouette) -> bool:
    """Whether a silhouette has come to where it is, and did not stand behind somebody before."""
    return seen.pixels(scene.vacant).mean() > VACANT and came(scene, seen)


def _calm(account: Account, person: Person, seen: Silhouette) -> Calm | None:
    """What somebody is found as elsewhere than he was, if that is calm.

    Who can be followed from where he was is he, however still he stands, and so is who stays where
    he was hidden; and things stay where they are put.
    """
    scene = account.scene
    if scene.motion is not None:
        return None
    if not person.upright or math.dist(account.place(seen), person.place) <= LEAP:
        # Who was a person by his shape alone may have been one figure with what he touched, and
        # who is one only as he was moved may be a chair.
        sure = person.chosen or (person.upright and person.travelled > TRAVELLED)
        if not sure and upright(seen, scene.view.intrinsics, account.look(seen).top):
            return None
        calm = person.calm
        if calm is not None and calm.holds(seen, scene.image):
            return calm
        if sure:
            return None
    return Calm(seen, scene.view, scene.image, account.time)
