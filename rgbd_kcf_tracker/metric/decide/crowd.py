# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Everyone who is remembered: each figure of the next frame is one of them, or somebody new."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection
from functools import lru_cache
from itertools import accumulate, pairwise, starmap, zip_longest

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.metric.decide.account import (
    MISSES,
    RECENT,
    REUNION,
    SAME_AGAIN,
    Account,
    Sight,
    look_of,
)
from rgbd_kcf_tracker.metric.decide.arrivals import RETURN, Arrival, Arrivals, is_new
from rgbd_kcf_tracker.metric.decide.association import NEW, assigned, log_odds
from rgbd_kcf_tracker.metric.decide.comebacks import Comebacks
from rgbd_kcf_tracker.metric.decide.mix_ups import Followed, MixUps
from rgbd_kcf_tracker.metric.decide.sighting import WHOLE, learn_sighting
from rgbd_kcf_tracker.metric.decide.stayed import stayed
from rgbd_kcf_tracker.metric.decide.visible_box import box_about
from rgbd_kcf_tracker.metric.identity.calm import Calm
from rgbd_kcf_tracker.metric.identity.comeback import Comeback
from rgbd_kcf_tracker.metric.identity.describer import Describer
from rgbd_kcf_tracker.metric.identity.gallery import Compared, Gallery, Looks
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.identity.stature import LEVEL, Tilt
from rgbd_kcf_tracker.metric.perceive.ego_motion import Lost
from rgbd_kcf_tracker.metric.perceive.figures import UPRIGHT, Figure, find_figures
from rgbd_kcf_tracker.metric.perceive.parting import APART
from rgbd_kcf_tracker.metric.perceive.room import SETTLE
from rgbd_kcf_tracker.metric.perceive.scene import CAMERA_AXES, Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.upright import TOP, child
from rgbd_kcf_tracker.pose import Pose

NEW_AREA = 0.12
"""Square metres of a figure from which it is somebody new: a head and shoulders, twice the least
that is a figure, for arms and legs that come apart from somebody are no people."""
HEAD_LEVEL = 1.1
"""Metres above the floor where the heads of people who sit begin: what reaches as high, before a
room that is known and at a distance from everybody else, is somebody new however little of him
shows beside a monitor or the image's end. From 1.0 m on real people are the same, from 1.3 m on
those who sit are left out."""
BESIDE = 0.5
"""Metres between two who are surely two, and not a person and a piece of the same: about a
shoulder's breadth, as no piece of somebody lies farther from his middle."""
TOGETHER = 0.15
"""Metres between the middles of two sights that are pieces of one person: less than any chest is
thick, so that no two stand as near."""
SAME_COLUMNS = 0.5
"""Share of the narrower of two silhouettes in whose columns both are, below which they are of two
who stand beside each other: arms overlap, trunks do not."""
STRIP = 0.15
"""Metres of a figure beside the part of it that was chosen from which that is somebody else, where
it is taller than any limb: boxes are not drawn as narrow."""
PARTING = 2.0
"""Seconds after which what was learned of somebody who was chosen as one of two who touch counts,
mixed as it is, if no view of him alone has taken its place: better than nothing."""
MOST_PEOPLE = 48
"""People who are remembered beside the chosen ones; who was seen longest ago is forgotten. It
bounds time and memory, and is more than come by in most rooms."""
STEP = 0.4
"""Metres from where somebody who walks is expected within which a sight may be his: a step."""
SETTLED = 3
"""Frames after which the room is known: as many as tell that a pixel has no reading
(:data:`~.perceive.room.BLIND_FRAMES`), so that before it anything may seem to be new."""
HELD = -2
"""Owner of a sight that may be a target which was not found: nobody new is made of it."""


class Crowd:
    """Gives everyone who stands before the room an identity and keeps it.

    Args:
        first: number of the first.
        describer: of everybody in the frame that is explained next; None without a network.

    Attributes:
        next: number of whoever comes next.
        people: all who are known.
        time: seconds of the last frame.
    """

    def __init__(self, first: int = 1, describer: Describer | None = None) -> None:
        self._describer = describer
        self.people: list[Person] = []
        self.time = 0.0
        self.next = first
        self._frames = 0
        self._shape = 0, 0
        self._axes = CAMERA_AXES
        self._mix_ups = MixUps()
        self._arrivals = Arrivals()
        self._comebacks = Comebacks()
        # Who is known, and how he looks, is mostly the same as in the frame before.
        self._joined = lru_cache(maxsize=1)(Looks.joined)

    def welcome(self, place: FloatArray, time: float, chosen: bool = False) -> Person:
        """Somebody new at ``place``, ``(2,)`` metres."""
        others = [p for p in self.people if not p.chosen]
        # Who has just come may not have shown yet that he is somebody.
        others.sort(key=lambda p: (self.time - p.seen_at < RECENT, p.alive, p.seen_at))
        for forgotten in others[: max(len(others) - MOST_PEOPLE + 1, 0)]:
            if forgotten.alive:
                self._arrivals.forgotten += is_new(forgotten.again, self._arrivals.last)
            self.forget(forgotten)
        person = Person(self.next, place, time, chosen)
        self.next += 1
        self.people.append(person)
        return person

    def chosen(self, account: Account, seen: Silhouette, since: float) -> Person:
        """Whoever a silhouette of the frame shows, as one who is to be followed from now on.

        He has been followed by other means since ``since``, in seconds: who was welcomed meanwhile
        is he.
        """
        person = self._chosen(account, seen, since)
        self._introduce(account, {person.number: seen})
        return person

    def _chosen(self, account: Account, seen: Silhouette, since: float) -> Person:
        index = account.figure_of(seen)
        person = account.owner_of(index)
        rest = [] if index < 0 else beside(account.scene, account.sights[index].seen, seen)
        if person is not None and person.chosen and _is_beside(seen, person, account.time):
            # Three who touch may be two figures: the middle one, who was chosen, has half of each.
            other = self._claimed_at(account, seen, person)
            if other is not None:
                return other
            person, index = None, -1
        if person is not None:
            if rest and person.first_seen == account.time:
                other = self._claimed_at(account, seen, person)
                if other is not None:
                    return other
                if not person.chosen and person in self.people:
                    # Nobody: he was made of two, and looks like both.
                    self.forget(person)
            elif account.time == person.seen_at or (
                since < person.first_seen and not person.chosen
            ):
                person.chosen = True
                self._welcome_beside(account, person, rest)
                return person
        for again in account.people:  # what was chosen in this frame and is no figure, once more
            last = again.last if again.seen_at == account.time else None
            if last is not None and last.same(seen):
                again.chosen = True
                return again
        person = self._welcome_as(account, seen, index, chosen=True)
        person.gallery.mixed = bool(rest)
        self._welcome_beside(account, person, rest)
        return person

    def _new_at(self, account: Account, seen: Silhouette, but: Person) -> Person | None:
        """Who else was welcomed in this very frame where a silhouette is."""
        place = account.place(seen)
        for person in self.people:
            near = math.dist(person.place, place) < APART
            if near and person is not but and person.first_seen == account.time:
                return person
        return None

    def _claimed_at(self, account: Account, seen: Silhouette, but: Person) -> Person | None:
        """The same, chosen from now on; None where it was already."""
        other = self._new_at(account, seen, but)
        if other is None or other.chosen:
            return None
        other.chosen = True
        return other

    def _welcome_beside(self, account: Account, person: Person, beside: list[Silhouette]) -> None:
        for piece in beside:
            if self._new_at(account, piece, person) is None:
                self._welcome_as(account, piece, -1).meet(person)

    def _welcome_as(
        self, account: Account, seen: Silhouette, index: int, chosen: bool = False
    ) -> Person:
        """Somebody new, who is a silhouette of the frame and the sight of that index, or -1."""
        person, row = self.welcome(account.place(seen), account.time, chosen), len(account.people)
        account.people.append(person)
        if index >= 0:
            account.owner[index] = row
        self._see(account, row, seen, index)
        return person

    def chosen_unseen(
        self, gallery: Gallery, place: FloatArray, left: float, met: Collection[int]
    ) -> Person:
        """Somebody who is to be followed and is away, of whom depth never showed anything.

        Args:
            gallery: how he looks.
            place: where he may have been, ``(2,)`` metres.
            left: seconds, when he was last seen by other means.
            met: numbers of those who are somebody else.
        """
        person = self.welcome(place, left, chosen=True)
        person.gallery = gallery.copy()
        person.misses, person.figure = MISSES, True
        person.area = gallery.largest
        for other in self.people:
            if other.number in met:
                other.meet(person)
        return person

    def forget(self, person: Person) -> None:
        """He was nobody, or is known by another number: nobody remembers this one."""
        self.people.remove(person)
        for other in self.people:
            other.forget(person.number)

    def explain(
        self, scene: Scene, time: float, opens: Callable[[Silhouette], None] | None = None
    ) -> Account:
        """Explain the next frame, at ``time`` in seconds; :meth:`learn` must follow.

        ``opens`` takes what turns out to be somebody out of the room.
        """
        self.time = time
        self._frames += 1
        if isinstance(scene.motion, Lost) or scene.view.shape != self._shape:
            # The pixels of before are no places in this picture, and the room begins anew, with
            # whoever has no person's shape.
            self._shape, self._frames, self._mix_ups = scene.view.shape, 1, MixUps()
            for person in self.people:
                person.mobile, person.last, person.hidden = False, None, False
        if isinstance(scene.motion, Pose):
            for person in self.people:
                person.carried(scene.motion, self._axes, scene.axes)
        self._axes = scene.axes
        for person in self.people:
            person.gallery.mixed &= time - person.first_seen < PARTING
        if opens is not None:
            for seen in stayed(scene, self.people, time):
                opens(seen)
        recent = [p for p in self.people if time - p.seen_at < RECENT]
        recent.sort(key=lambda p: not p.chosen)
        expected = np.array([p.expected(time) for p in recent]).reshape(-1, 2)
        figures = find_figures(scene, expected, sum(p.chosen for p in recent))
        sights = self._sights(scene, figures, time)
        # Before a camera that moves the floor is another one in each frame.
        still = scene.stood_for >= SETTLE
        tilt = Tilt.told_by(p.gallery.stature for p in self.people) if still else LEVEL
        sights = [_in_step(sight, recent, expected, time, tilt) for sight in sights]
        account, compared = self._explained(scene, sights, time)
        mixed_up = self._mix_ups.watch(*_followed(account, compared), time)
        if mixed_up is not None:
            self._exchange(*mixed_up)
            account, _ = self._explained(scene, sights, time)
        for column, row in enumerate(account.owner):
            if row >= 0:
                self._compare(account, row, column)
        return account

    def _exchange(self, person: Person, other: Person | None, since: float) -> None:
        """Who has somebody's number since ``since`` is another, or None for somebody new."""
        if other is None:
            other = self.welcome(person.place, since)
        person.exchange(other, since)
        for each in self.people:  # who came after that was seen beside the other alone
            if each is not other and each.first_seen >= since and each.number in person.met:
                each.met.discard(person.number)
                person.met.discard(each.number)
                each.meet(other)
        self._comebacks.drop(person)
        self._comebacks.drop(other)

    def _sights(self, scene: Scene, figures: list[Figure], time: float) -> list[Sight]:
        """The look of each figure, described where there is a network."""
        views = [look_of(scene, figure.seen) for figure in figures]
        if self._describer is not None and (scene.motion is not None or not figures):
            self._describer.forget()
        if self._describer is not None and figures:
            boxes = [box_about(scene, figure.seen) for figure in figures]
            places = np.stack([figure.place for figure in figures])
            views = self._describer.everybody(views, boxes, places, time)
        return [
            Sight(each.seen, each.place, each.parted, view=view)
            for each, view in zip(figures, views, strict=True)
        ]

    def _explained(
        self, scene: Scene, sights: list[Sight], time: float
    ) -> tuple[Account, list[Compared]]:
        """The account, and each of its sights held against all views, if there are any."""
        against = self._arrivals.against(
            Arrival(time - p.seen_at, p.again) for p in self.people if p.alive
        )
        odds, looks, compared = log_odds(self.people, scene, sights, time, against, self._joined)
        account = Account(
            scene,
            time,
            sights,
            list(self.people),
            odds,
            looks,
            self._frames > SETTLED,
            against,
            self._comebacks.sure,
            describer=self._describer,
        )
        account.verdict = assigned(odds)
        # Whoever was chosen and has been away comes back as a stranger first, until his looks have
        # borne out over some sightings who he is.
        missed = [p.chosen and account.was_away(p) for p in self.people]
        account.owner = list(account.verdict)
        if any(missed):
            odds_of_here = np.where(np.array(missed)[:, None], NEW - 1, odds)
            for column, row in enumerate(account.verdict):
                if row >= 0 and missed[row]:
                    # Nor is that sight anybody's who was seen beside him.
                    met = [person.number in self.people[row].met for person in self.people]
                    odds_of_here[met, column] = NEW - 1
            account.owner = assigned(odds_of_here)
        return account, compared

    def _compare(self, account: Account, row: int, column: int) -> None:
        """Compare a sight of one person with those who have been away since he came."""
        newcomer = account.people[row]
        view = account.sights[column].view
        for other, person in enumerate(account.people[: len(account.looks)]):
            if other == row or person.number in newcomer.met:
                continue
            if person.chosen:
                missed = account.was_away(person)
            else:
                missed = person.seen_at < newcomer.first_seen
            if missed:
                look = float(account.looks[other, column])
                newcomer.resembled(person, look, view, account.time)
        if not newcomer.chosen:
            new = {p.number: is_new(p.again, account.against) for p in account.people}
            newcomer.again = newcomer.seen_before(new)

    def learn(
        self, account: Account, targets: dict[int, Silhouette | None], unsure: Collection[int] = ()
    ) -> None:
        """Take what was seen.

        Args:
            account: of the frame.
            targets: where those who are followed by other means were found, by their numbers; None
                where they were not: nobody else's sight of them counts.
            unsure: numbers of those of them who may be somebody else this time: nothing but the
                place is learned from that.
        """
        people, time = account.people, account.time
        for row, person in enumerate(people):
            if person.number not in targets:
                continue
            account.owner = [HELD if owner == row else owner for owner in account.owner]
            seen = targets[person.number]
            if seen is None:
                continue
            index = account.figure_of(seen)
            if index >= 0:
                # The number under which it was known while it was not recognised.
                double = account.stranger(person, index)
                if double in self.people:
                    person.gallery.stature.take(double.gallery.stature)
                    self.forget(double)
                account.owner[index] = row
            self._see(account, row, seen, index, person.number not in unsure)
        for column, sight in enumerate(account.sights):
            row = account.owner[column]
            if row == HELD:
                account.owner[column] = -1
            elif row < 0:
                small = sight.seen.area < NEW_AREA and not _stands_apart(account, column)
                if small or _is_piece(account, column):
                    continue
                newcomer = self._welcome_as(account, sight.seen, column)
                newcomer.entered = sight.seen.ends.any
                for other in people if account.scene.motion is None else ():
                    if other.seen_at < time and other.out_of_reach(newcomer.place, time):
                        other.meet(newcomer)
                self._compare(account, len(people) - 1, column)
            elif people[row].number not in targets:
                self._see(account, row, sight.seen, column)
        for person in people:
            if person.seen_at < time:
                person.missed(account.scene.view.depth)
        self._introduce(account, {n: None if n in unsure else s for n, s in targets.items()})
        self._reunite(account)
        self._comebacks.hear(account, self.people)

    def _reunite(self, account: Account) -> None:
        """Give newcomers the number of whom they have turned out to be.

        So are those who went meanwhile, where those who came later tell that people come back here.
        """
        for newcomer in list(account.people):
            if newcomer.chosen or newcomer.again < account.against + SAME_AGAIN:
                continue
            person = account.likest(newcomer, surely=True)
            if person is None or person.chosen:  # he is recognised by who follows him
                continue
            # Who has become another in this frame is neither any more.
            if newcomer not in self.people or person not in self.people:
                continue
            if newcomer.resembles(person.number) < max(account.against, RETURN) + SAME_AGAIN:
                continue
            self._arrivals.returned(newcomer.first_seen - person.seen_at)
            self._comebacks.add(person, newcomer.first_seen, account.against)
            row = account.people.index(newcomer)
            account.owner = [
                account.people.index(person) if each == row else each for each in account.owner
            ]
            person.become(newcomer)
            self.forget(newcomer)

    def _introduce(self, account: Account, targets: dict[int, Silhouette | None]) -> None:
        """Remember who was seen beside whom: they are surely not the same."""
        seen_now: list[tuple[Person, FloatArray]] = []
        for person, index in account.in_view.items():
            sight = account.sights[index]
            if person.number in targets or sight.parted or sight.seen.area <= WHOLE:
                continue
            seen_now.append((person, sight.place))
        for person in account.people:
            seen = targets.get(person.number)
            if seen is not None:
                seen_now.append((person, account.place(seen)))
        known = {person.number for person in self.people}  # of some others are forgotten by now
        seen_now = [each for each in seen_now if each[0].number in known]
        for person, place in seen_now:
            for other, there in seen_now:
                if np.hypot(*(place - there)) > BESIDE:
                    person.met.add(other.number)

    def disown(self, person: Person, comeback: Comeback) -> None:
        """Who was taken for somebody since a return gets a number of his own."""
        other = self.welcome(person.place, comeback.since)
        person.exchange(other, comeback.left)  # his heights are from before he was recognised
        person.gallery = comeback.known
        person.seen_at, person.misses, person.figure = comeback.left, MISSES, True
        for each in self.unmeet(person, comeback):
            each.meet(other)

    def is_furniture(self, person: Person, calm: Calm) -> None:
        """What somebody was found as turns out to be furniture: he is where nobody knows."""
        person.calm = person.last = None
        person.mobile = True
        person.gallery.taken_back(calm.since)
        person.seen_at, person.misses, person.hidden = calm.since, MISSES, False

    def unmeet(self, person: Person, comeback: Comeback) -> list[Person]:
        """Those who were seen beside somebody since a return may be he himself; gives them."""
        beside = [each for each in self.people if each.number in person.met - comeback.met]
        person.met = {each.number for each in self.people} & comeback.met
        for each in beside:
            each.met.discard(person.number)
        return beside

    def _see(
        self, account: Account, row: int, seen: Silhouette, index: int, sure: bool = True
    ) -> None:
        """Take one sighting of one person."""
        person = account.people[row]
        gone = account.time - person.seen_at
        # Who was missed only once may have been away, too: how surely, the time says.
        if person.misses and gone > REUNION:
            self._arrivals.returned(gone)
        if account.was_away(person):
            person.came = account.time
            if person.gallery.views and not person.chosen:
                self._comebacks.add(person, person.came, account.against)
        trust = self._comebacks.trust(person)
        learn_sighting(account, row, seen, index, sure, trust)


def _in_step(
    sight: Sight, people: list[Person], expected: FloatArray, time: float, tilt: Tilt
) -> Sight:
    """A sight, and how tall who is there has walked of late; they are ``expected`` ``(n, 2)``."""
    walking_top = None
    if people:
        off = np.hypot(*(expected - sight.place).T)
        nearest = int(off.argmin())
        if off[nearest] < STEP:
            walking_top = people[nearest].gallery.stature.walking_top(time)
    view = dataclasses.replace(sight.view, walking_top=walking_top, tilt=tilt)
    return dataclasses.replace(sight, view=view)


def _followed(
    account: Account, compared: list[Compared]
) -> tuple[list[Followed], list[tuple[Person, slice]]]:
    """Those in view who are known, and those who are not in view, for :class:`MixUps`.

    Args:
        account: of the frame.
        compared: its sights, see :func:`~.association.log_odds`.
    """
    ends = accumulate((len(person.gallery.views) for person in account.people), initial=0)
    views = list(starmap(slice, pairwise(ends)))
    here = [
        Followed(account.people[row], sight.place, sight.view, held, views[row])
        for row, sight, held in zip_longest(account.owner, account.sights, compared)
        if row >= 0
    ]
    gone = [
        (person, views[row])
        for row, person in enumerate(account.people)
        if row not in account.owner and person.alive and person.gallery.views
    ]
    return here, gone


def _stands_apart(account: Account, column: int) -> bool:
    """Whether a sight, if small, is all of somebody or up to his head, apart from all others."""
    sight = account.sights[column]
    top = account.scene.top(sight.seen)
    if top is None or not (child(sight.seen, top) or top > HEAD_LEVEL) or top >= TOP[1]:
        return False
    others = (s.place for n, s in enumerate(account.sights) if n != column)
    apart = all(np.hypot(*(sight.place - place)) > BESIDE for place in others)
    return account.settled and not sight.parted and apart


def _is_piece(account: Account, column: int) -> bool:
    """Whether a sight is where somebody else's is: a piece of him that has just come into view."""
    place = account.sights[column].place
    return any(
        row >= 0 and np.hypot(*(place - other.place)) < TOGETHER
        for row, other in zip(account.owner, account.sights, strict=True)
    )


def _is_beside(seen: Silhouette, person: Person, time: float) -> bool:
    """Whether a silhouette is mostly on one side of where a person shows at a time."""
    last = person.last
    if last is None or person.seen_at != time:
        return False
    common = min(seen.cols.stop, last.cols.stop) - max(seen.left, last.left)
    narrow = min(seen.mask.shape[1], last.mask.shape[1])
    return bool(common < SAME_COLUMNS * narrow)


def beside(scene: Scene, figure: Silhouette, seen: Silhouette) -> list[Silhouette]:
    """Who else a figure holds of which only a part was chosen: what stands on its sides."""
    found = []
    for left, right in ((figure.left, seen.left), (seen.cols.stop, figure.cols.stop)):
        piece = figure.mask[:, max(left - figure.left, 0) : max(right - figure.left, 0)]
        one = Silhouette.trimmed(scene.view, left, figure.top, piece, scene.rim)
        if one is not None and one.width > STRIP and one.height > UPRIGHT:
            found.append(one)
    return found
