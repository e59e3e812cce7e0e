# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a person is told from others by the look: pairs of sightings, held against their ids.

What is measured is handed in: a function that describes a sighting, and one that gives the
probability that two descriptions are of one person.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.datasets.base import Sample
from rgbd_kcf_tracker.evaluation.metrics.separation import Separation, separation
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import Parameters

APART_S = 3.0
"""Sightings nearer in time are too alike to say anything."""

MOST_VIEWS = 40
"""Sightings of one person in one recording that are compared, spread evenly: pairs go with the
square of their number, and neighbours in time say little new."""

SAME_FIGURE_IOU = 0.5
"""A figure that the tracker found is the one of the ground truth from this overlap on."""

_CAMERA = re.compile(r'(.+)_cam\w+')


@dataclass(frozen=True, slots=True)
class Views:
    """How sightings are described and compared.

    Attributes:
        describe: of a frame and a box in it; None where nothing can be said of the sighting.
        compare: probability that two descriptions are of one person, 0 to 1.
        watch: is told of each frame before its people are described, in time order: what describes
            may learn the room from it. Take new views for each recording where it does.
    """

    describe: Callable[[Frame, Box], object | None]
    compare: Callable[[Any, Any], float]
    watch: Callable[[Frame], object] = lambda frame: None


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """A sighting that could be described."""

    person: int
    frame: int
    stamp_ns: int
    what: object


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """The sightings of one recording.

    Attributes:
        recording: its name.
        frames: how many it has.
        sightings: how many were to be described.
        views: those that could be.
    """

    recording: str
    frames: int
    sightings: int
    views: tuple[Sighting, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Sightings compared, of one recording or from one camera to another.

    Attributes:
        name: of the recording, or of both.
        across: from one camera to another.
        seen: the recordings.
        left: ``(N,)`` the first of each pair, from the first recording.
        right: ``(N,)`` the second, from the last recording.
        probability: ``(N,)`` that both are one person.
    """

    name: str
    across: bool
    seen: tuple[Seen, ...]
    left: tuple[Sighting, ...]
    right: tuple[Sighting, ...]
    probability: FloatArray

    @property
    def same(self) -> Mask:
        """``(N,)`` whether both are one person."""
        pairs = zip(self.left, self.right, strict=True)
        return np.array([a.person == b.person for a, b in pairs], np.bool_)

    def separation(self) -> Separation:
        """How well the pairs are told apart."""
        return separation(self.probability, self.same)


def metric_views(parameters: Parameters | None = None) -> Views:
    """How the ``metric`` tracker describes and compares people; new ones for a recording.

    Args:
        parameters: of ``metric``; None for the released defaults.
    """
    from rgbd_kcf_tracker.metric.decide.visible_box import outline_box
    from rgbd_kcf_tracker.metric.identity.gallery import same_person
    from rgbd_kcf_tracker.metric.parameters import MetricParameters
    from rgbd_kcf_tracker.metric.targets import MetricTargets

    parameters = parameters or MetricParameters()
    assert isinstance(parameters, MetricParameters)
    targets = MetricTargets(parameters)
    targets.everyone = True

    def describe(frame: Frame, box: Box) -> object | None:
        """The look of the figure that is in the box, if one is."""
        account = targets.account
        if account is None:
            return None
        near = [outline_box(account.scene, s.seen).iou(box) for s in account.sights]
        best = max(range(len(near)), key=near.__getitem__, default=-1)
        return account.sights[best].view if best >= 0 and near[best] >= SAME_FIGURE_IOU else None

    return Views(describe, same_person, targets.update)


def look(recording: str, samples: Iterable[Sample], views: Views) -> Seen:
    """Describe the people of a recording wherever enough of them shows.

    Args:
        recording: its name.
        samples: of a sequence of kind EVERYONE.
        views: how.
    """
    found: list[Sighting] = []
    count = frames = 0
    for number, sample in enumerate(samples):
        frames += 1
        views.watch(sample.frame)
        for person in sample.people:
            if not person.counts:
                continue
            count += 1
            what = views.describe(sample.frame, person.box)
            if what is not None:
                found.append(Sighting(person.id, number, sample.frame.stamp_ns, what))
    return Seen(recording, frames, count, tuple(found))


def pair(seen: Seen, other: Seen | None, views: Views) -> Pairs:
    """Compare the sightings of a recording, or of two that show the same people.

    Raises:
        DatasetError: where a comparison is no probability.
    """
    first = _spread(seen.views)
    together = (
        itertools.combinations(first, 2)
        if other is None
        else itertools.product(first, _spread(other.views))
    )
    pairs = [(a, b) for a, b in together if abs(a.stamp_ns - b.stamp_ns) >= APART_S * 1e9]
    name = seen.recording if other is None else f'{seen.recording} to {other.recording}'
    values = np.array([views.compare(a.what, b.what) for a, b in pairs], np.float64)
    if not np.all((values >= 0) & (values <= 1)):
        bad = next(v for v in values.tolist() if not 0 <= v <= 1)
        raise DatasetError(f'{name}: a comparison gave {bad}, which is no probability')
    return Pairs(
        name,
        other is not None,
        (seen,) if other is None else (seen, other),
        tuple(a for a, _ in pairs),
        tuple(b for _, b in pairs),
        values,
    )


def all_pairs(seen: Sequence[Seen], views: Views) -> list[Pairs]:
    """Each recording in itself, then those that show the same people, by :func:`same_people`."""
    result = [pair(one, None, views) for one in seen]
    result += [
        pair(a, b, views)
        for a, b in itertools.combinations(seen, 2)
        if same_people(a.recording, b.recording)
    ]
    return result


def same_people(one: str, other: str) -> bool:
    """Whether two recordings show the same people with the same ids, by their names.

    So do ``NAME_cam1`` and ``NAME_cam2``.
    """
    a, b = _CAMERA.fullmatch(one), _CAMERA.fullmatch(other)
    return a is not None and b is not None and a[1] == b[1]


def _spread(views: Sequence[Sighting]) -> list[Sighting]:
    """At most :data:`MOST_VIEWS` of each person, evenly spread."""
    kept = []
    for person in dict.fromkeys(v.person for v in views):
        own = [v for v in views if v.person == person]
        step = max(1, math.ceil(len(own) / MOST_VIEWS))
        kept += own[::step]
    return kept
