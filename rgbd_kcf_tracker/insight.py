# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a tracker knows after a frame beyond its answer, in one form for every tracker.

The one place outside the engines that knows their inside: page, pictures and the topic
``~/evidence`` go through it. Nothing is computed before somebody asks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.decide import evidence
from rgbd_kcf_tracker.metric.decide.arrivals import bounded
from rgbd_kcf_tracker.metric.identity.gallery import Gallery, View
from rgbd_kcf_tracker.metric.identity.hidden_cloud import HiddenCloud
from rgbd_kcf_tracker.metric.identity.tally import SUREST, logit
from rgbd_kcf_tracker.metric.perceive.colors import palette
from rgbd_kcf_tracker.metric.perceive.surfaces import surfaces_in
from rgbd_kcf_tracker.metric.targets import MetricTargets, MetricTracker
from rgbd_kcf_tracker.targets import TargetSet
from rgbd_kcf_tracker.thesis.depth_aware import DepthAwareTracker
from rgbd_kcf_tracker.thesis.kcf import KcfTracker
from rgbd_kcf_tracker.thesis.particle_filter import HEIGHT, WIDTH, X, Y
from rgbd_kcf_tracker.thesis.rgbd_pf import RgbdPfTracker
from rgbd_kcf_tracker.track import Tracker

Array = npt.NDArray[Any]

ONE_THING = 0.8
"""Overlap from which two silhouettes that were weighed are one thing, which was cut in two ways."""
ONE_BOX = 0.98
"""Likewise of the boxes that they would have given."""
LEAST_LOSS = -0.001
"""Log-odds lost to other candidates; less is what rounding leaves."""


@dataclass(frozen=True, slots=True, eq=False)
class Considered:
    """One thing that the tracker weighed.

    Attributes:
        box: the box that it would have given, pixels.
        probability: that it is the target.
        cues: log-odds by cue; their sum is the log-odds of ``probability``.
        mask: ``(h, w)`` bool of its pixels in the view; None where there are none.
    """

    box: Box
    probability: float
    cues: dict[str, float]
    mask: Array | None = None


@dataclass(frozen=True, slots=True)
class KnownView:
    """A view of a gallery, to look at; two are equal where the same is remembered.

    Attributes:
        colors: mean colour of each slice of the body from head to feet as the gallery remembers it,
            red, green and blue from 0 to 1; None where nothing of the slice shows.
        top: metres above the floor of the head's top; None where that is not known.
    """

    colors: tuple[tuple[float, float, float] | None, ...]
    top: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Insight:
    """What a tracker knows after a frame.

    Attributes:
        considered: best first, by what the regression says of them.
        particles: ``(n, 3)`` metres in the camera's frame, None where there are none.
        weights: ``(n,)``, of the particles.
        particle_pixels: ``(n, 2)`` middles in pixels of the image, of trackers without metres.
        surfaces: ``(h, w)`` int labels of the view, 0 is none; None where depth is not looked at.
        view_depth: ``(h, w)`` metres of the view, 0 for no reading.
        floor: ``(a, b, c)`` with ``1/z = a u + b v + c`` in pixels of the view; None where unknown.
        step: pixels of the image to one of the view.
        gallery: the views by which the target is known, the first one first.
        response: the correlation filter's highest in this frame, a cosine likeness for the thesis's
            trackers and against its own recent mean for ``metric``; None where it was not asked.
    """

    considered: tuple[Considered, ...] = ()
    particles: Array | None = None
    weights: Array | None = None
    particle_pixels: Array | None = None
    surfaces: Array | None = None
    view_depth: Array | None = None
    floor: tuple[float, float, float] | None = None
    step: int = 1
    gallery: tuple[KnownView, ...] = ()
    response: float | None = None


COMPUTED_BY: dict[str, tuple[Callable[..., Any], ...]] = {
    'surfaces': (surfaces_in,),
    'particles': (HiddenCloud.move, HiddenCloud.weigh),
    'considered': (evidence.probability, evidence.Evidence.features),
    'gallery': (View.of, Gallery.learn),
}
"""The functions of the engine that made what is shown."""


def insight_of(tracker: Tracker) -> Insight:
    """What a tracker knows after its last frame; empty for those that keep nothing."""
    if isinstance(tracker, MetricTracker):
        targets = tracker._targets
        return Insight() if targets is None else of_metric(targets, tracker._number)
    if isinstance(tracker, RgbdPfTracker) and tracker._model is not None:
        states = tracker._particles.states
        middles = states[:, [X, Y]] + states[:, [WIDTH, HEIGHT]] / 2
        weights = tracker._particles.weights.copy()
        return Insight(particle_pixels=middles, weights=weights, response=tracker.response)
    if isinstance(tracker, (KcfTracker, DepthAwareTracker)):
        return Insight(response=tracker.response)
    return Insight()


def insight_in(targets: TargetSet, number: int) -> Insight:
    """What a set knows of one of its targets after the last frame."""
    if targets.metric is not None:
        return of_metric(targets.metric, number)
    return insight_of(targets._trackers[number])


def of_metric(targets: MetricTargets, number: int) -> Insight:
    """What is known of one of several targets after the last frame."""
    account, follower = targets.account, targets._followers.get(number)
    person = targets.person(number) if follower is None else follower.person
    gallery = () if person is None else tuple(map(known_view, person.gallery.views))
    if follower is None:
        return Insight(gallery=gallery)
    response = follower.response
    if account is None:
        return Insight(gallery=gallery, response=response)
    scene, surface = account.scene, follower._surface
    considered: list[Considered] = []
    for candidate, box in follower.weighed():
        share = evidence.WEIGHTS * candidate.evidence.features()
        mask = candidate.seen.in_view(scene.view.shape)
        if any(
            _overlap(mask, other.mask) > ONE_THING or box.iou(other.box) > ONE_BOX
            for other in considered
        ):
            continue
        cues = {name: float(share[list(places)].sum()) for name, places in evidence.CUES}
        cues |= {said.name: said.share for said in candidate.evidence.more}
        alone = min(max(sum(cues.values()), -SUREST), SUREST)
        beside = logit(candidate.probability) - alone
        cues[evidence.OTHER_PLACES] = beside if beside < LEAST_LOSS else 0.0
        doubts = {} if considered else follower.doubts
        cues |= {
            cue: doubts.get(cue, 0.0) for cue in (evidence.SOMEBODY_NEW, evidence.KNOWN_BEFORE)
        }
        chance = bounded(float(candidate.probability), -sum(doubts.values()))
        considered.append(Considered(box, chance, cues, mask))
    cloud = surface._cloud if surface is not None else None
    half = surface.body.height / 2 if surface is not None else 0.0
    floor = scene.floor
    return Insight(
        considered=tuple(considered),
        # Where its head is, as the engine has it; shown where its middle is, as all else.
        particles=None if cloud is None else cloud._positions + np.array((0, half, 0)),
        weights=None if cloud is None else cloud._weights.copy(),
        surfaces=scene.surfaces.labels,
        view_depth=scene.view.depth,
        floor=None if floor is None else (floor.a, floor.b, floor.c),
        step=scene.view.step,
        gallery=gallery,
        response=response,
    )


def _overlap(one: Array, other: Array | None) -> float:
    """Common pixels of two masks against those of either."""
    either = np.count_nonzero(one | other)
    return np.count_nonzero(one & other) / either if either else 0.0


@lru_cache(maxsize=256)
def known_view(view: View) -> KnownView:
    """What is shown of a view, which never changes."""
    share = np.square(view.roots, dtype=np.float64).reshape(len(view.roots), -1)
    total = share.sum(axis=1, keepdims=True)
    rgb = (share @ palette()[:, ::-1] / np.where(total > 0, total, np.nan) / 255).tolist()
    colors = tuple(None if r != r else (r, g, b) for r, g, b in rgb)
    return KnownView(colors, view.top)
