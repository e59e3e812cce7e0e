# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Several targets under the ids of the page, which outlive the set that follows them.

When a parameter changes the run goes on with another set, but a target keeps its id and its name.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.insight import Insight, insight_in
from rgbd_kcf_tracker.parameters import Parameters
from rgbd_kcf_tracker.targets import TargetSet
from rgbd_kcf_tracker.track import Track

MOST = 16
"""Targets at once."""
SAME = 0.5
"""Overlap from which somebody whom nobody chose is the one who had that box under another set."""


def follows_everyone(variant: str) -> bool:
    """Whether a variant can follow people whom nobody chose."""
    return TargetSet(variant).metric is not None


class PageTargets:
    """A :class:`~rgbd_kcf_tracker.targets.TargetSet` with the ids of the page.

    Args:
        variant: of the trackers.
        parameters: of the variant; None for the released defaults.
        everyone: whether people whom nobody chose are followed too.
        numbers: ids for those who are new.

    Raises:
        ParameterError: where everyone is to be followed and the variant cannot.
    """

    def __init__(
        self,
        variant: str,
        parameters: Parameters | None = None,
        everyone: bool = False,
        numbers: Iterator[int] | None = None,
    ) -> None:
        self._set = TargetSet(variant, parameters)
        self._set.everyone = everyone
        self._numbers = itertools.count(1) if numbers is None else numbers
        self._ids: dict[int, int] = {}
        """Of the page's ids those within the set; two may be one person."""
        self._chosen: set[int] = set()
        self._present: tuple[int, ...] = ()
        """Ids of those whom the last frame told of."""

    @property
    def everyone(self) -> bool:
        """Whether people whom nobody chose are followed too."""
        return self._set.everyone

    @everyone.setter
    def everyone(self, value: bool) -> None:
        self._set.everyone = value

    @property
    def chosen(self) -> frozenset[int]:
        """Ids of those who were asked for."""
        return frozenset(self._chosen)

    def add(self, frame: Frame, box: Box, number: int | None = None) -> tuple[int, Track]:
        """Follow what is in ``box``; ``frame`` is the last that was given, or the next.

        Args:
            frame: the image.
            box: the target, pixels.
            number: the id to follow it under; the one that it has, or a new one, if left out.

        Returns:
            The id, and the track of this frame.

        Raises:
            BoxError: where the box lies outside the image.
            ParameterError: where there are too many targets already.
        """
        if len(self) >= MOST and number not in self:
            raise ParameterError(f'{MOST} targets are followed already: remove one first')
        inner = self._set.add(frame, box)
        if number is None:
            number = self._number_of(inner)
        self._ids[number] = inner
        self._chosen.add(number)
        return number, self._set.started(inner)

    def remove(self, number: int) -> None:
        """Follow it no more; with everyone it goes on as one whom nobody chose."""
        if number not in self._chosen:
            return
        self._chosen.discard(number)
        inner = self._ids[number]
        if not self.everyone:
            del self._ids[number]
        if inner not in (self._ids[other] for other in self._chosen):
            self._set.remove(inner)

    def update(self, frame: Frame) -> dict[int, Track]:
        """Where each is in the next frame: those who were asked for, then the others."""
        tracks = self._set.update(frame)
        found = {number: tracks[self._ids[number]] for number in self._ids if number in self}
        taken = {self._ids[number] for number in found}
        for inner, track in tracks.items():
            if inner not in taken:
                found[self._number_of(inner)] = track
        self._present = tuple(found)
        return found

    def resume(self, tracks: dict[int, Track], before: Mapping[int, Track]) -> dict[int, Track]:
        """Give those whom nobody chose the ids that they had in the same frame under another set.

        Args:
            tracks: of this set, the last that :meth:`update` gave.
            before: of the other set.
        """
        renamed: dict[int, Track] = {}
        for number, track in tracks.items():
            name = number
            if number not in self and number not in before and track.box is not None:
                for other, old in before.items():
                    free = other not in self and other not in renamed
                    if free and old.box is not None and old.box.iou(track.box) > SAME:
                        name = other
                        self._ids[name] = self._ids.pop(number)
                        break
            renamed[name] = track
        self._present = tuple(renamed)
        return renamed

    def insights(self) -> Mapping[int, Insight]:
        """What is known of each after the last frame."""
        known = {*self._present, *self._chosen}
        return {n: insight_in(self._set, inner) for n, inner in self._ids.items() if n in known}

    def _number_of(self, inner: int) -> int:
        """The id of somebody of the set, a new one where there is none."""
        for number, known in self._ids.items():
            if known == inner:
                return number
        number = next(self._numbers)
        self._ids[number] = inner
        return number

    def __len__(self) -> int:
        return len(self._chosen)

    def __contains__(self, number: object) -> bool:
        return number in self._chosen
