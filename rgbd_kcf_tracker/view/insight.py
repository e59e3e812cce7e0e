# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a tracker knows after a frame beyond its answer, in one form for every tracker.

The one place of ``view`` that knows the inside of ``metric``: pictures and page go through it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.decide import evidence
from rgbd_kcf_tracker.metric.identity.hidden_cloud import HiddenCloud
from rgbd_kcf_tracker.metric.perceive.surfaces import cut
from rgbd_kcf_tracker.metric.tracker import MetricTracker
from rgbd_kcf_tracker.thesis.particle_filter import HEIGHT, WIDTH, X, Y
from rgbd_kcf_tracker.thesis.rgbd_pf import RgbdPfTracker
from rgbd_kcf_tracker.track import Tracker

Array = npt.NDArray[Any]

CUES = (
    ('place', (0, 1, 2)),
    ('colour', (3, 4)),
    ('seen beside it', (5, 6, 12, 13)),
    ('size', (7, 8, 9, 14)),
    ('time hidden', (10, 11)),
    ('should be in sight', (15,)),
    ('left the image', (16,)),
    ('to begin with', (17,)),
)
"""What the regression's inputs are about, by their places in it."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Insight:
    """What a tracker knows after a frame.

    Attributes:
        considered: best first.
        particles: ``(n, 3)`` metres in the camera's frame, None where there are none.
        weights: ``(n,)``, of the particles.
        particle_pixels: ``(n, 2)`` middles in pixels of the image, of trackers without metres.
        surfaces: ``(h, w)`` int labels of the view, 0 is none; None where depth is not looked at.
        view_depth: ``(h, w)`` metres of the view, 0 for no reading.
        floor: ``(a, b, c)`` with ``1/z = a u + b v + c`` in pixels of the view; None where unknown.
        step: pixels of the image to one of the view.
    """

    considered: tuple[Considered, ...] = ()
    particles: Array | None = None
    weights: Array | None = None
    particle_pixels: Array | None = None
    surfaces: Array | None = None
    view_depth: Array | None = None
    floor: tuple[float, float, float] | None = None
    step: int = 1


def insight_of(tracker: Tracker) -> Insight:
    """What a tracker knows after its last frame; empty for those that keep nothing."""
    if isinstance(tracker, MetricTracker):
        return _of_metric(tracker)
    if isinstance(tracker, RgbdPfTracker) and tracker._model is not None:
        states = tracker._particles.states
        middles = states[:, [X, Y]] + states[:, [WIDTH, HEIGHT]] / 2
        return Insight(particle_pixels=middles, weights=tracker._particles.weights.copy())
    return Insight()


COMPUTED_BY: dict[str, tuple[Callable[..., Any], ...]] = {
    'surfaces': (cut,),
    'particles': (HiddenCloud.step,),
    'considered': (evidence.probability, evidence.Evidence.features),
}
"""The functions of the engine that made what is shown."""


def _of_metric(tracker: MetricTracker) -> Insight:
    scene, surface = tracker._scene, tracker._surface
    if scene is None:
        return Insight()
    considered = []
    for candidate, box in tracker.weighed():
        share = evidence.WEIGHTS * candidate.evidence.features()
        seen = candidate.seen
        mask = np.zeros(scene.view.shape, bool)
        rows, cols = seen.mask.shape
        mask[seen.top : seen.top + rows, seen.left : seen.left + cols] = seen.mask
        cues = {name: float(share[list(places)].sum()) for name, places in CUES}
        considered.append(Considered(box, float(candidate.probability), cues, mask))
    cloud = surface._cloud if surface is not None else None
    floor = scene.floor
    return Insight(
        considered=tuple(considered),
        particles=None if cloud is None else cloud._positions.copy(),
        weights=None if cloud is None else cloud._weights.copy(),
        surfaces=scene.surfaces.labels,
        view_depth=scene.view.depth,
        floor=None if floor is None else (floor.a, floor.b, floor.c),
        step=scene.view.step,
    )
