# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How somebody looks, remembered as a few views, and the probability that two sightings are one.

A view is a histogram of colour codes for each slice of the body, counted in metres down from the
top of the head, so that it does not change with distance (colour in height slices is the common
root of the hand-made descriptors, as of Lisanti et al., "Person re-identification by iterative
re-weighted sparse ranking", 2015). Views are compared slice by slice by the Bhattacharyya
coefficient, at the shift of lightness that fits best: the same shirt is brighter near the window.
Where a network describes people as well (:mod:`~.embedding`), a view has its vector, too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import Floats
from rgbd_kcf_tracker.metric.identity.embedding import Described
from rgbd_kcf_tracker.metric.identity.stature import (
    LEVEL,
    SEATED,
    HeightOdds,
    Stature,
    Tilt,
    height_log_odds,
)
from rgbd_kcf_tracker.metric.identity.tally import Heard
from rgbd_kcf_tracker.metric.perceive.colors import CODES, LIGHTNESS, TINTS, ColorCodes, smoothed
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.upright import child

SLICES, SLICE = 9, 0.2
"""Slices of a body and their height in metres: 1.8 m, the last also holds what is below."""
COLORFUL = 2.0
"""By how much a colour weighs more with each level that it is away from grey: half of all people
wear dark grey, so that it says little of who it is."""
HEAD_WEIGHT = 0.3
"""Weight of the first slice: hair and skin are much the same on all."""
DIMMER = (0, 1, -1, 2, -2)
DIMMER_COST = 0.01
"""Shifts of lightness, in levels, at which two views are compared, and what each level costs:
little, so that it only says which of two is more alike that are alike but for their light."""
MOST_ROWS = 640
"""Rows of views that are multiplied at once: of more, OpenBLAS shares a product out to threads, and
on a busy computer these wait for each other far longer than the product takes."""
LEAST_SLICE = 0.004
"""Square metres of a slice from which its colours are compared: a patch of some 6 cm; less is
mostly rim."""
LEAST_PIXELS = 30
"""Pixels left of a silhouette without its rim, where colours are mixed with the background's: of
fewer the rim is taken, too, as they would hardly fill the colours that are told apart."""

STEEPNESS, EVEN, EVEN_PER_VIEW = 20.0, 0.62, 0.03
"""Of the logistic curve from similarity to the log-odds of being the same person, where it is even
for one view, and by how much more with each doubling of their number (the best of many is more
alike, whosever they are); fitted on real and simulated people (docs/figures.md)."""
EVEN_GREY = 0.84
"""Where it is even before a camera without colour: there all are more alike by as much. Fitted on
the same people without their colours, as is the steepness, which comes out the same."""
NETWORK_PER_VIEW, NETWORK_SAME, BESIDE_NETWORK = 0.36, 0.25, 0.75
"""What a network's log-odds lose with each doubling of the views, the most that they say for
somebody, since those whom it confuses look alike in all, and the share of the colours' log-odds
that is left beside them, as both see the same clothes: chosen among others on real people
(docs/experiments.md)."""
SUREST_SAME, SUREST_OTHER, SUREST_PART = 4.0, -4.0, 3.0
"""Log-odds that looks alone can give: two people may wear the same, and one may turn round; and the
most that the least part can say for somebody, as more things look like a small one."""
ONE_SIDE, ALL_SIDES = 0.7, 4
"""Share of :data:`SUREST_OTHER` that a single view can say, for there is another side to everybody;
and the further views from which all sides are known."""
WHOLE_AREA, TELLING_AREA, PART = 0.3, 0.1, 0.4
"""Square metres of a view in which all of somebody shows, and from which he is told by what shows
of him as well as by all (docs/figures.md): a head and shoulders; and the share of that which the
least part says. Against somebody only all of him says all: what is seen past something has some of
its colours, and slices that are counted from there."""
_FROM_GREY = np.hypot(*np.meshgrid(*[np.arange(TINTS) - TINTS // 2] * 2, indexing='ij'))
_COLOR_WEIGHT = np.sqrt(1 + COLORFUL * _FROM_GREY).astype(np.float32)
_SLICE_WEIGHT = np.array([HEAD_WEIGHT] + [1.0] * (SLICES - 1), np.float32)


@dataclass(frozen=True, eq=False)
class View:
    """One sighting of somebody's look.

    Attributes:
        roots: ``(SLICES, LIGHTNESS, TINTS * TINTS)`` float32, square roots of the weighted
            histograms, each slice of length 1, or 0 where nothing of it shows.
        area: ``(SLICES,)`` float32 square metres that show.
        color: ``(SLICES,)`` float32, how colourful each slice is, at least 1.
        top: metres above the floor of the head's top, None where it is hidden or no floor known.
        grey: whether the camera sees no colours.
        described: how a network describes it; None where there is none, or it was not asked.
        leans: whether the head is out of sight to the side, and what shows ends below where it is
            when somebody stands: whose height is known leans or falls out of the image.
        distance: metres at which it was seen.
        of_child: whether it is all of somebody small.
        walking_top: metres, how tall who is there has walked of late; None where nobody has.
        tilt: of the floor above which the top is.
    """

    roots: Floats
    area: Floats
    color: Floats
    top: float | None
    grey: bool = False
    described: Described | None = None
    leans: bool = False
    distance: float = 0.0
    of_child: bool = False
    walking_top: float | None = None
    tilt: Tilt = LEVEL

    @classmethod
    def of(
        cls,
        view: DepthView,
        codes: ColorCodes,
        seen: Silhouette,
        top: float | None,
        above: float = 0.0,
        leans: bool = False,
    ) -> View:
        """The look of a silhouette.

        Args:
            view: the depth that the silhouette is of.
            codes: of the view's colours.
            seen: the silhouette.
            top: metres above the floor of its top, or None.
            above: metres of him that are above the silhouette, where that is known.
            leans: see :attr:`View.leans`.
        """
        mask = seen.mask.view(np.uint8)
        inner = cv2.erode(mask, np.ones((3, 3), np.uint8), borderValue=0)
        mask = inner if np.count_nonzero(inner) >= LEAST_PIXELS else mask
        down = np.float32(above / SLICE) + (
            np.arange(len(mask), dtype=np.float32) + 0.5
        ) * np.float32(seen.depth / view.intrinsics.fy / SLICE)
        part = np.minimum(down.astype(np.int32), SLICES - 1)[:, None] * CODES
        parts = (codes[seen.rows, seen.cols] + part)[mask.view(np.bool_)]
        counts = np.bincount(parts, minlength=SLICES * CODES).astype(np.float32)
        cube = smoothed(counts.reshape(SLICES, CODES)).reshape(SLICES, LIGHTNESS, TINTS, TINTS)
        pixels = cube.reshape(SLICES, -1).sum(axis=1)
        cube /= np.maximum(pixels, 1)[:, None, None, None]
        roots = np.sqrt(cube)
        roots *= _COLOR_WEIGHT
        color = np.sqrt(np.square(roots).reshape(SLICES, -1).sum(axis=1))
        roots /= np.maximum(color, 1e-6)[:, None, None, None]
        k = view.intrinsics
        area = pixels * np.float32(seen.depth**2 / (k.fx * k.fy))
        return cls(
            roots.reshape(SLICES, LIGHTNESS, -1),
            area.astype(np.float32),
            np.maximum(color, 1).astype(np.float32),
            top,
            codes.grey,
            leans=leans,
            distance=float(seen.depth),
            of_child=child(seen, top),
        )

    @cached_property
    def total(self) -> float:
        """Square metres that show."""
        return float(self.area.sum())

    @property
    def shows(self) -> float:
        """How much of somebody shows, 0 to 1: :data:`WHOLE_AREA` is all."""
        return min(1.0, self.total / WHOLE_AREA)


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """Several views stacked, for comparing one with all of them at once.

    Attributes:
        roots: ``(SLICES, n * LIGHTNESS, TINTS * TINTS)``.
        area, color: ``(n, SLICES)``.
        most: ``(n, 2)`` float32, how alike a slice of each counts at the most, and the log-odds of
            its vector: as much as it is trusted to be of whom it is taken for, see
            :meth:`Gallery.doubt`.
        vectors: ``(n, d)``, of a network; NaN for views without, and of no columns if none has one.
    """

    roots: Floats
    area: Floats
    color: Floats
    most: Floats
    vectors: Floats

    def __len__(self) -> int:
        return len(self.area)

    @classmethod
    def of(cls, views: Sequence[View], trust: Sequence[float] = ()) -> Looks:
        """Stack at least one view.

        ``trust`` are log-odds that each is of whom it is taken for; none for all that surely are.
        """
        even = _even(len(views), views[0].grey)
        trusted = np.array(trust, np.float32) if trust else np.full(len(views), np.inf, np.float32)
        return cls(
            np.concatenate([v.roots for v in views], axis=1),
            np.stack([v.area for v in views]),
            np.stack([v.color for v in views]),
            np.stack([np.float32(even) + trusted / np.float32(STEEPNESS), trusted], axis=1),
            _stacked([_NONE if v.described is None else v.described.vector[None] for v in views]),
        )

    @classmethod
    def joined(cls, looks: Sequence[Looks]) -> Looks:
        """Stack at least one stack."""
        return cls(
            np.concatenate([each.roots for each in looks], axis=1),
            np.concatenate([each.area for each in looks]),
            np.concatenate([each.color for each in looks]),
            np.concatenate([each.most for each in looks]),
            _stacked([each.vectors for each in looks]),
        )


_NONE = np.zeros((1, 0), np.float32)


def _stacked(vectors: list[Floats]) -> Floats:
    """Those of each, ``(n, d)``, or ``(n, 0)`` where there are none, below each other."""
    size = max(each.shape[1] for each in vectors)
    return np.concatenate(
        [
            each if each.shape[1] == size else np.full((len(each), size), np.nan, np.float32)
            for each in vectors
        ]
    )


_DIAGONALS = np.stack([np.eye(LIGHTNESS, k=k).ravel() for k in DIMMER], axis=1).astype(np.float32)
"""Sums of a product of levels by levels along the diagonals that are the shifts."""
_COST = (DIMMER_COST * np.abs(DIMMER)).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Compared:
    """A view held against ``n`` others, slice by slice.

    Attributes:
        weight: ``(n, SLICES)`` float32, how much each slice says: by how much of it shows, how
            colourful it is and :data:`HEAD_WEIGHT`; 0 where it does not show in both.
        alike: ``(n, SLICES, len(DIMMER))`` float32 likeness at each shift of lightness, 0 to 1.
        most: ``(n, 1)`` float32, up to which that counts, see :attr:`Looks.most`.
        network: ``(n,)`` float32 log-odds of being the same person by the vectors alone, NaN where
            either has none.
    """

    weight: Floats
    alike: Floats
    most: Floats
    network: Floats

    @classmethod
    def of(cls, view: View, looks: Looks) -> Compared:
        """Hold a view against several."""
        common = np.minimum(looks.area, view.area)
        weight = np.sqrt(common) * (_SLICE_WEIGHT * view.color) * looks.color
        weight[common < LEAST_SLICE] = 0
        # All levels of one against all of the other; the shifts are the diagonals of that.
        cross = np.empty((SLICES, len(looks) * LIGHTNESS, LIGHTNESS), np.float32)
        for first in range(0, cross.shape[1], MOST_ROWS):
            rows = np.s_[:, first : first + MOST_ROWS]
            np.matmul(looks.roots[rows], view.roots.transpose(0, 2, 1), out=cross[rows])
        alike = (cross.reshape(SLICES, len(looks), -1) @ _DIAGONALS).transpose(1, 0, 2)
        return cls(weight, alike, looks.most[:, :1], _network(view, looks))

    def similarity(self) -> Floats:
        """How alike the view is in its colours to each of the others, ``(n,)``, 0 to 1.

        The mean over the slices that show in both, at the best of the shifts of lightness; NaN
        where there is none, so that nothing is known.
        """
        return _best(self.weight, self.alike)

    @property
    def _trusted(self) -> Floats:
        return np.minimum(self.alike, self.most[..., None])

    @cached_property
    def likeness(self) -> Floats:
        """``(n, 2)``: :meth:`similarity` and :attr:`network` of each, as far as it is trusted."""
        return np.stack([_best(self.weight, self._trusted), self.network], axis=1)

    def of_each(self, starts: Sequence[int]) -> Floats:
        """The :attr:`likeness` of the view to each of several people, ``(p, 2)``: to his best view.

        NaN where no slice of his shows in both, or no view of his has a vector, so that nothing is
        known.

        What one view of somebody does not show is as in whichever other one of his fits best, in
        the same light: who showed above a desk has not the trousers of anybody.

        Args:
            starts: where the views of each begin, those of the first at 0.
        """
        most = np.maximum.reduceat(self.weight, starts, axis=0)
        shows = self.weight > 0
        trusted = self._trusted
        best = np.maximum.reduceat(trusted * shows[..., None], starts, axis=0)
        whose = np.repeat(np.arange(len(starts)), np.diff([*starts, len(shows)]))
        weight = np.where(shows, self.weight, most[whose])
        alike = np.where(shows[..., None], trusted, best[whose])
        found = np.maximum.reduceat(_best(weight, alike), starts)
        return np.stack([found, np.fmax.reduceat(self.network, starts)], axis=1)


def _network(view: View, looks: Looks) -> Floats:
    """See :attr:`Compared.network`."""
    described = view.described
    if described is None or not looks.vectors.shape[1]:
        return np.full(len(looks), np.nan, np.float32)
    cosines = looks.vectors @ described.vector
    odds = (cosines - np.float32(described.even)) * np.float32(described.steepness)
    least: Floats = np.minimum(odds, looks.most[:, 1])
    return least


def _best(weight: Floats, alike: Floats) -> Floats:
    total = weight.sum(axis=1, keepdims=True)
    share = weight / np.maximum(total, 1e-9)
    mean = (share[:, None, :] @ alike)[:, 0] - _COST
    best: Floats = np.maximum(mean.max(axis=1), 0)
    best[total[:, 0] == 0] = np.nan
    return best


def similarity(view: View, looks: Looks) -> Floats:
    """How alike a view is to each of several, see :meth:`Compared.similarity`."""
    return Compared.of(view, looks).similarity()


def _even(views: int, grey: bool) -> float:
    """Likeness to the most alike of so many views that says nothing."""
    return (EVEN_GREY if grey else EVEN) + EVEN_PER_VIEW * math.log2(views)


def look_log_odds(
    alike: float,
    area: float,
    views: int = 1,
    grey: bool = False,
    network: float = math.nan,
    whole: float = WHOLE_AREA,
) -> float:
    """Log-odds that a view is of the person, from its likeness to the most alike view of his.

    Args:
        alike: see :func:`similarity`, no NaN.
        area: square metres that show of the view, or of the largest that it was compared with,
            whichever is less.
        views: how many views of his it was compared with.
        grey: whether the camera sees no colours.
        network: see :attr:`Compared.network`.
        whole: square metres that show of all of the person, less of a child than of others.
    """
    odds = STEEPNESS * (alike - _even(views, grey))
    if not math.isnan(network):
        odds = BESIDE_NETWORK * odds
        odds += min(network - NETWORK_PER_VIEW * math.log2(views), NETWORK_SAME)
    least = SUREST_OTHER * (ONE_SIDE + (1 - ONE_SIDE) * min(1.0, (views - 1) / ALL_SIDES))
    telling = TELLING_AREA * min(1.0, whole / WHOLE_AREA)
    told = min(1.0, area / (telling if odds > 0 else WHOLE_AREA))
    most = SUREST_PART + (SUREST_SAME - SUREST_PART) * told
    return min(max(odds, least), most) * (PART + (1 - PART) * told)


def same_person(first: View, second: View) -> float:
    """Probability that two sightings show the same person, 0 to 1; 0.5 where they say nothing."""
    look = Gallery.of(second, 0.0).log_odds(first)
    odds = look + height_log_odds(first.top, second.top)
    return float(1 / (1 + np.exp(-odds)))


MOST_VIEWS = 14
"""Views of one person: some sides, near and far, in some lights; more bring nothing and cost."""
NOVEL = 0.9
"""Likeness to the nearest view from which a new one adds nothing. At 0.63 sides are missing, and
everyone's IDF1 was 3 points lower; with all taken it was the same (docs/experiments.md)."""
SURER = 0.5
"""Log-odds by which a new view is surer than one that it adds nothing to, from which it takes its
place: with less it would in every frame of a return that is borne out little by little."""


@dataclass(frozen=True, slots=True, eq=False)
class _Learned:
    """A view, the seconds when it was seen, and the log-odds that it is of this person.

    Attributes:
        before: what it has taken the place of.
    """

    view: View
    time: float
    trust: float = math.inf
    before: tuple[_Learned, ...] = ()

    def says_more(self, other: _Learned) -> bool:
        """Whether it says more than one of the same look: surer, or of all of him, not a part."""
        if self.trust < other.trust:
            return False
        all_of_him = self.view.total >= WHOLE_AREA > other.view.total
        return all_of_him or self.trust > other.trust + SURER


class Gallery:
    """The views by which one is known, and the height of the head.

    Attributes:
        views: the first and the newest.
        looks: the same stacked, None while there is none.
        stature: the heights of the head.
        largest: square metres of the view that shows most, 0 while there is none.
        mixed: whether the only view is of a piece cut out of two who touched, so that it shows
            something of either: it speaks against nobody until a view of one alone takes its place.
    """

    def __init__(self) -> None:
        self.mixed = False
        self.views: list[View] = []
        self.looks: Looks | None = None
        self.stature = Stature()
        self._learned: list[_Learned] = []
        self.largest, self._area_of_all = 0.0, WHOLE_AREA

    @property
    def whole(self) -> bool:
        """Whether one of the views shows all of him."""
        return self.largest >= WHOLE_AREA

    def stands(self, top: float | None, leans: bool = False) -> bool:
        """Whether who is as high as ``top`` metres may stand or sit, and not lie or crawl.

        In who lies, or leans out of the image (:attr:`View.leans`), nothing is where it is in who
        stands: no view of him can be compared.
        """
        if self.stature.top is None:
            return True
        return not leans and (top is None or top > SEATED * self.stature.top)

    def log_odds(self, view: View, alike: Sequence[float] | None = None) -> float:
        """Log-odds that a view is of the same person; 0 while the gallery is empty.

        ``alike`` is its likeness to the person, where that is known, see :meth:`Compared.of_each`.
        """
        if self.looks is not None and alike is None:
            alike = Compared.of(view, self.looks).of_each([0])[0].tolist()
        return self._log_odds(view, alike, len(self.views))

    def log_odds_before(self, time: float, view: View, alike: Floats) -> float | None:
        """The same by what was learned before ``time``, in seconds; None where nothing was.

        ``alike`` is the view's :attr:`~Compared.likeness` to each of the gallery, ``(n, 2)``.
        """
        old = alike[np.array([each.time for each in self._learned]) < time]
        if not len(old):
            return None
        return self._log_odds(view, np.fmax.reduce(old).tolist(), len(old), time)

    def hear(self, heard: Heard, odds: float, view: View, time: float) -> None:
        """Tell of a view that is of the same person by ``odds``, and what of that is its height."""
        height = self._height_log_odds(view)
        told = height.tall is not None
        heard.hear(odds, view.shows**2, time, height=height.odds, told=told)

    def _height_log_odds(self, view: View, before: float = math.inf) -> HeightOdds:
        return self.stature.log_odds(view.top, view.distance, view.walking_top, before, view.tilt)

    def _log_odds(
        self, view: View, alike: Sequence[float] | None, views: int, before: float = math.inf
    ) -> float:
        odds = self._height_log_odds(view, before).odds
        if alike is None or math.isnan(alike[0]):
            return odds
        area = min(view.total, self.largest)
        look = look_log_odds(alike[0], area, views, view.grey, alike[1], self._area_of_all)
        return odds + (max(look, 0.0) if self.mixed else look)

    @classmethod
    def of(cls, view: View, time: float) -> Gallery:
        """One that knows a view, seen at ``time`` in seconds."""
        gallery = cls()
        gallery.learn(view, time)
        return gallery

    def learn(self, view: View, time: float, trust: float = math.inf) -> None:
        """Take a view of this person, where it shows something new, more of it, or more surely.

        It was seen at ``time`` in seconds, and is of this person by log-odds of ``trust``.
        """
        self._learn(_Learned(view, time, trust))

    def _learn(self, new: _Learned) -> None:
        learned = self._learned
        if self.looks is not None:
            alike = similarity(new.view, self.looks) > NOVEL
            twins = [each for each, is_twin in zip(learned, alike.tolist(), strict=True) if is_twin]
            if not all(new.says_more(each) for each in twins):
                return
            new = replace(new, before=tuple(replace(each, before=()) for each in twins))
            learned = [each for each in learned if each not in twins]
            if len(learned) >= MOST_VIEWS:
                del learned[self._most_redundant()]
        self._set_learned([*learned, new])

    def restore(self, known: Gallery) -> None:
        """Have what was known before again, where what was learned since has taken its place."""
        for each in known._learned:
            if each not in self._learned:
                self._learn(each)

    def doubt(self, since: float, odds: float) -> None:
        """What was learned from ``since`` on, in seconds, is of this person by ``odds`` at most.

        Who is like a view is this person no surer than the view itself is of him.
        """
        if any(each.time >= since and each.trust > odds for each in self._learned):
            self._set_learned(
                [
                    replace(each, trust=min(each.trust, odds)) if each.time >= since else each
                    for each in self._learned
                ]
            )

    def take(self, other: Gallery) -> None:
        """Take all that another gallery has, which has turned out to be of the same person."""
        for each in other._learned:
            self._learn(each)
        self.stature.take(other.stature)

    def copy(self) -> Gallery:
        """The same views and heights; what either learns from now on is its own."""
        same = Gallery()
        same.mixed = self.mixed
        same._set_learned(list(self._learned))
        same.stature = self.stature.copy()
        return same

    def taken_back(self, since: float) -> Gallery:
        """Take back what was learned from ``since`` on, in seconds: it was of somebody else."""
        late = Gallery()
        late._set_learned([_Learned(e.view, e.time) for e in self._learned if e.time >= since])
        # What has taken another's place gives it back.
        before = [(each,) if each.time < since else each.before for each in self._learned]
        self._set_learned([each for those in before for each in those if each.time < since])
        late.stature = self.stature.taken_back(since)
        return late

    def _set_learned(self, learned: list[_Learned]) -> None:
        self._learned, self.views = learned, [each.view for each in learned]
        trust = [each.trust for each in learned]
        self.looks = Looks.of(self.views, trust) if learned else None
        self.largest = max((view.total for view in self.views), default=0.0)
        small = (view.total for view in self.views if view.of_child)
        self._area_of_all = max(small, default=WHOLE_AREA)

    def _most_redundant(self) -> int:
        """Of those least trusted the one most alike another, the older of two.

        Never the first, which is what was chosen.
        """
        assert self.looks is not None
        likeness = np.nan_to_num(np.stack([similarity(v, self.looks) for v in self.views]))
        np.fill_diagonal(likeness, 0)
        most = likeness.max(axis=1).tolist()
        rest = range(1, len(self.views))
        return min(rest, key=lambda n: (self._learned[n].trust, -most[n], n))
