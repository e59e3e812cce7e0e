# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How one frame is explained: whose each sight is, and what that says of any silhouette."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.decide.arrivals import RETURN, away, is_new
from rgbd_kcf_tracker.metric.decide.parts import FIRST, ROOM, Others, Parts
from rgbd_kcf_tracker.metric.identity.calm import Calm
from rgbd_kcf_tracker.metric.identity.describer import Describer
from rgbd_kcf_tracker.metric.identity.gallery import SUREST_PART, Compared, View
from rgbd_kcf_tracker.metric.identity.person import COAST, FALLS, TRAVELLED, Person
from rgbd_kcf_tracker.metric.perceive.fading import Lately
from rgbd_kcf_tracker.metric.perceive.figures import Figure, place_of
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette, together
from rgbd_kcf_tracker.metric.perceive.upright import HEADED

SMALL = 0.1
"""Square metres of a thing up to which it may be part of somebody's figure: what fits in the hands
or lies at the feet, as a bag or a ball, and less than anybody's half hidden body."""
STATURE = 1.7
"""Metres of a person of mean height: most differ from it by less than half a slice of a view."""
SEATED = 1.35
"""Metres above the floor of the head of who sits, at the most, and of the shoulders of who stands,
at the least: of what ends below, beside the end of depth, nothing tells whether it is a head."""
UPPER = 3
"""Rows that are a silhouette's upper end: a shoulder rises up to the end of depth, a head is
round."""
STEP, STEP_PER_SECOND = 0.3, 1.0
"""Metres in depth by which somebody's pixels differ, about an arm's reach, and metres a second
that they may have moved on since the last sight: a walk."""
NEW_SCORE = 0.5
"""Score of somebody who has just come into view: nothing is known of him to hold him against, and
even odds claim nothing."""
SAME = 0.8
"""Share of a figure's area from which a silhouette that is part of it looks as it does: hardly a
slice of it is missing then, and its look is not computed again."""
MOST = 0.5
"""Share of a silhouette's pixels from which it is taken to be the same as a figure, and of the
figure's area: more than half, so that it is never the same as two."""
SAME_AGAIN = 0.5
"""Log-odds beyond those against coming back, and ahead of anybody else, at which somebody is one
who was here before, by one sight or by several: a number given to a stranger is worse than one more
number. With those that are against it at first they are seven to one; less is never enough for a
number, however many come back."""
REUNION, PAUSE = 1.0, 3.0
"""Seconds of absence after which somebody who was chosen is recognised by more than his place; and
the same where hardly a frame was taken meanwhile, as by a slow camera. Within a second a walker
goes on as before; and a camera that gives 0.9 images a second instead of one is not to find
everybody away, as it did at 0.97."""
MISSES = 2
"""Frames in which somebody was not found that are no chance: one may be blurred, or lost on the
way."""
RECENT = 0.6
"""Seconds after the last sight for which a figure is parted where somebody is expected: some frames
at 5 Hz. By then a walker may be a metre from there, and who is not there is not to cut another."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight(Figure):
    """A figure with its look."""

    view: View = field(kw_only=True)


@dataclass(frozen=True, slots=True)
class Claim:
    """What the others in view say of a candidate: see :class:`~.evidence.Evidence`."""

    look: float
    mine: float
    rival: float
    assigned: int
    room: float


@dataclass(eq=False)
class Account:
    """How a frame is explained.

    Attributes:
        scene: what it shows.
        time: seconds.
        sights: what stands before the room, ``n`` of them.
        people: all who are known, ``m`` of them.
        odds: ``(m, n)`` log-odds of each being each.
        looks: ``(m, n)`` the part of the look and the height in them.
        settled: whether the room has been seen for long enough to tell what stands before it.
        against: log-odds against any one of those who are away coming back just now.
        sure: how likely those who came back are whom they were taken for, 0 to 1, by their numbers.
        owner: for each sight the index among ``people``, or -1.
        verdict: the same as the frame explains itself best, who was chosen and is away included.
        describer: of what else the frame shows; None without a network.
    """

    scene: Scene
    time: float
    sights: list[Sight]
    people: list[Person]
    odds: FloatArray
    looks: FloatArray
    settled: bool
    against: float
    sure: Mapping[int, float]
    owner: list[int] = field(default_factory=list)
    verdict: list[int] = field(default_factory=list)
    describer: Describer | None = None
    _places: dict[Silhouette, FloatArray] = field(default_factory=dict)

    @cached_property
    def parts(self) -> Parts:
        """Which of the sights, or the room, each pixel shows."""
        return Parts(self.scene, [sight.seen for sight in self.sights])

    @property
    def in_view(self) -> dict[Person, int]:
        """Whoever a sight of the frame is of, and the index of that."""
        return {self.people[row]: index for index, row in enumerate(self.owner) if row >= 0}

    def owner_of(self, index: int) -> Person | None:
        """Whoever a sight is of; None for nobody, as for no sight, -1."""
        row = self.owner[index] if index >= 0 else -1
        return self.people[row] if row >= 0 else None

    @property
    def calm(self) -> list[tuple[Person, Calm, Silhouette]]:
        """Those in view who have not stirred for so long that they are furniture, and where."""
        return [
            (person, person.calm, person.last)
            for person in self.people
            if person.seen_at == self.time and person.last is not None
            if person.calm is not None and person.calm.long(self.time)
        ]

    @property
    def unmoved(self) -> list[tuple[Person, Silhouette]]:
        """Those in view whom nobody chose and who have never walked, and where they are."""
        return [
            (person, self.sights[index].seen)
            for person, index in self.in_view.items()
            if not person.chosen and person.travelled < TRAVELLED
        ]

    def against_chosen(self, person: Person) -> float:
        """:attr:`against` of who was chosen: he is waited for, however many others come.

        What looks can say is bounded, so this is, too: else he would be somebody new for good.
        """
        return min(self.against, SUREST_PART) * away(self.time - person.seen_at)

    def was_away(self, person: Person) -> bool:
        """Whether somebody has been absent for so long that his place says little."""
        return absent(self.time - person.seen_at, person.misses)

    def place(self, seen: Silhouette) -> FloatArray:
        """Where a silhouette is, ``(2,)`` metres across and along the floor."""
        place = self._places.get(seen)
        if place is None:
            place = self._places[seen] = place_of(self.scene, seen)
        return place

    def probability(self, person: Person, index: int) -> float:
        """That a sight is of one of the people rather than of any other, 0 to 1."""
        row = self.people.index(person)
        if row >= len(self.odds):
            return NEW_SCORE
        odds = self.odds[:, index]
        total = 1.0 + float(np.exp(np.delete(odds, row)).sum())
        here = float(1 / (1 + total * np.exp(-odds[row])))
        return here * self.sure.get(person.number, 1.0)

    def sight_of(self, seen: Silhouette) -> int:
        """Index of the sight that most of a silhouette's pixels belong to, -1 for none."""
        return self.sight_among(self.parts.counts(seen))

    def sight_among(self, counts: list[int]) -> int:
        """The same of some pixels, of which :meth:`Parts.counted` gave ``counts``."""
        most = max(counts[FIRST:], default=0)
        return counts.index(most, FIRST) - FIRST if most > MOST * sum(counts) else -1

    def figure_of(self, seen: Silhouette) -> int:
        """Index of the sight that a silhouette is, and not only a part of; -1 for none."""
        index = self.sight_of(seen)
        if index >= 0 and seen.area < MOST * self.sights[index].seen.area:
            return -1
        return index

    def look(self, seen: Silhouette) -> View:
        """The look of any silhouette of the frame."""
        for sight in self.sights:
            if sight.seen.same(seen):
                return sight.view
        view = look_of(self.scene, seen)
        index = self.sight_of(seen)
        if index < 0 or self.sights[index].parted:
            return view
        whole = self.sights[index].view  # a part of whom it describes, and who walks there
        return replace(
            view, described=whole.described, walking_top=whole.walking_top, tilt=whole.tilt
        )

    def described(self, view: View, box: Box) -> View:
        """A view with what a network says of its box, if there is one and it has not yet."""
        if self.describer is None or view.described is not None:
            return view
        return self.describer.described([view], [box])[0]

    def _is_nearly(self, seen: Silhouette, index: int) -> bool:
        """Whether hardly anything of a sight is missing in a silhouette that is part of it."""
        return index >= 0 and SAME < self.sights[index].seen.area / seen.area < 1 / SAME

    def claim(self, person: Person, seen: Silhouette) -> Claim:
        """What all that is known of the frame says of a silhouette being somebody known before."""
        row = self.people.index(person)
        # A small thing is no figure, but may be in the hands or at the feet of one.
        small = person.area < SMALL
        index = -1 if small else self.sight_of(seen)
        look = None
        stranger = self.stranger(person, index)
        if stranger is not None:
            look = stranger.resemblance(person.number)
        if look is None and self._is_nearly(seen, index):
            look = float(self.looks[row, index])
        if look is None:
            look = person.log_odds(self.look(seen), self.time)
        rival = mine = 0.0
        assigned = 0 if person.figure and not small else 1
        if index >= 0:
            assigned = 0
            if stranger is not None and self.likest(stranger) is person:
                assigned = 1
            elif self.verdict[index] >= 0:
                assigned = 1 if self.verdict[index] == row else -1
            mine = float(self.odds[row, index])
            for other, odds in zip(self.people, self.odds[:, index].tolist(), strict=False):
                if other.number in person.met:
                    rival = max(rival, odds)
        return Claim(look, mine, rival, assigned, self._room_beside(person, seen))

    def as_others(self, person: Person, index: int) -> float:
        """Odds that a sight is one of the others who are known, by its looks; 0 for no sight.

        As :attr:`against` is, they are against any one of those who are away coming back: whoever
        is known comes back as seldom as the person does.
        """
        total = 0.0
        for row, other in enumerate(self.people[: len(self.looks)] if index >= 0 else []):
            if other is person or other.gallery.looks is None:
                continue
            look: float | None = float(self.looks[row, index])
            if row in self.owner:
                if row != self.owner[index]:  # he is elsewhere
                    continue
                # That somebody looks as he has since he came tells nothing of who he is.
                view = self.sights[index].view
                alike = Compared.of(view, other.gallery.looks).likeness
                came = self.time if self.was_away(other) else other.came
                look = other.gallery.log_odds_before(came, view, alike)
            if look is not None:
                total += math.exp(look) * self._is_another(other, person)
        return total

    def _is_another(self, other: Person, person: Person) -> float:
        """How likely somebody known is not a person who had gone, under another number, 0 to 1."""
        alike = other.resemblance(person.number)
        if alike is None or other.chosen or other.number in person.met:
            return 1.0
        return is_new(alike, self.against)

    def room_share(self, seen: Silhouette) -> float:
        """Share of a silhouette's pixels that show the room, 0 to 1."""
        counts = self.parts.counts(seen)
        return counts[ROOM] / sum(counts)

    def _room_beside(self, person: Person, seen: Silhouette) -> float:
        """Share of a silhouette that stood still while the person was seen elsewhere, 0 to 1."""
        share = self.room_share(seen)
        last = person.last
        if person.mobile or share == 0:
            return share
        if last is None:
            return 0.0
        # What the outline of the last sight holds, about as deep, may have been the person.
        there, depth = (last.rows, last.cols), self.scene.view.depth
        step = STEP + STEP_PER_SECOND * min(self.time - person.seen_at, RECENT)
        mine = seen.in_view(depth.shape)[there] & (np.abs(depth[there] - last.depth) < step)
        return share * (1.0 - np.count_nonzero(mine) / np.count_nonzero(seen.mask))

    def others(self, person: Person, room: bool = True) -> Others:
        """The pixels that are surely not a person's.

        They belong to somebody who was seen beside him, or are the room, if that counts, where he
        is no part of it.
        """
        met = [False] * len(self.sights)
        for other, index in self.in_view.items():
            met[index] = other.number in person.met and person.area >= SMALL
        return Others(self.parts, [False, room and person.mobile, *met])

    def stranger(self, person: Person, index: int) -> Person | None:
        """Who a sight is taken for, if that may be ``person`` under another number.

        That is somebody who was never seen beside him.
        """
        other = self.owner_of(index)
        if other is None or other is person or other.chosen or other.number in person.met:
            return None
        return other

    def likest(self, newcomer: Person, surely: bool = False) -> Person | None:
        """Who of those that went away before a newcomer came he seems to be, if one of them.

        Args:
            newcomer: the newcomer.
            surely: whether by enough to give him that one's number: a first sighting alone seldom
                tells, what several say together does.
        """
        # Who once came back unrecognised is known twice: it is the first that he is.
        alike = [
            (
                newcomer.resembles(person.number, surely)
                + math.log(is_new(person.again, self.against)),
                index,
            )
            for index, person in enumerate(self.people)
            if person.number not in newcomer.met
            and (person.chosen or person.seen_at < newcomer.first_seen)
        ]
        alike.sort(reverse=True)
        (odds, index), *others = alike or [(0.0, -1)]
        if index < 0 or (others and others[0][0] > odds - SAME_AGAIN):
            return None
        person = self.people[index]
        # Who was chosen is waited for, however many others come.
        return person if odds >= (RETURN if person.chosen else self.against) else None

    def lately(self) -> list[Lately]:
        """Those who were followed until a moment ago and may still be there, or fall from there."""
        return [
            Lately(person.last, person.area, person.misses > 0)
            for person in self.people
            if person.last is not None and person.alive and (person.figure or person.upright)
            if self.time - person.seen_at <= (COAST if person.hidden else FALLS)
        ]

    def somebody(self, targets: Iterable[Silhouette] = ()) -> Mask:
        """The pixels of ``targets`` and of those who are surely people, ``(h, w)`` bool.

        They may stand still for as long as they like.
        """
        people = (self.sights[n].seen for p, n in self.in_view.items() if p.alive)
        return together([*people, *targets], self.scene.view.shape)


def look_of(scene: Scene, seen: Silhouette) -> View:
    """The look of a silhouette, counted from where the head would be if it is out of sight.

    That is where the image ends below it, or depth does beside the upper end of what shows.
    """
    highest, above = seen.highest(scene.elevation), 0.0
    top = None if seen.cut.top else highest
    ends, upper = seen.ends, seen.mask[:UPPER]
    beside = (ends.left and upper[:, 0].any()) or (ends.right and upper[:, -1].any())
    if ends.top or beside:
        top = None
        least, most = (0.0, HEADED) if ends.top else (SEATED, STATURE)
        if highest is not None and least < highest < most:
            above = STATURE - highest
    leans = bool(beside) and not ends.top and highest is not None and highest < SEATED
    return View.of(scene.view, scene.codes, seen, top, above, leans)


def absent(gone: float, misses: int) -> bool:
    """Whether who was seen ``gone`` seconds ago was away, and not only missed by a slow camera.

    ``misses`` frames have shown nothing of him since.
    """
    return gone > (REUNION if misses >= MISSES else PAUSE)
