# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the thesis's trackers computed in the frames that its pictures show.

Each tracker is run over the recording as ``rgbd-kcf track`` runs it, with a
:class:`~rgbd_kcf_tracker.view.watch.Watch` on the functions that the pictures are about.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from rgbd_kcf_tracker.features.hog import HogExtractor
from rgbd_kcf_tracker.features.labels import gaussian_labels
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.thesis import (
    centre_patch,
    color_histogram,
    correlation,
    particle_filter,
    sliding_window,
    window,
)
from rgbd_kcf_tracker.thesis.correlation import CorrelationFilter
from rgbd_kcf_tracker.thesis.depth_aware import DepthAwareTracker
from rgbd_kcf_tracker.thesis.depth_patch import DepthPatch
from rgbd_kcf_tracker.thesis.kcf import KcfModel, KcfTracker, WindowGeometry
from rgbd_kcf_tracker.thesis.particle_filter import ParticleFilter
from rgbd_kcf_tracker.thesis.rgbd import RgbdTracker
from rgbd_kcf_tracker.thesis.rgbd_pf import RgbdPfTracker
from rgbd_kcf_tracker.track import Track, Tracker
from rgbd_kcf_tracker.variants import create_tracker
from rgbd_kcf_tracker.view.watch import Call, Watch

MOST_AHEAD = 900
"""Frames past the one explained in which an occlusion is looked for: half a minute at 30 Hz."""

SETTLED_S = 0.5
"""Seconds after which a target that was hidden is taken to be so in full."""

# Imported by name elsewhere, so taken from where they are defined.
GAUSSIAN = correlation._gaussian
RESPOND = CorrelationFilter.respond
LEARN = CorrelationFilter.learn
HOG = HogExtractor.__call__
SAMPLE = KcfModel.sample
DIFFERENCE = DepthPatch.diff_at_centre
SEARCH = RgbdTracker._search

FILTER_PARTS = (
    gaussian_labels,
    correlation.cosine_window,
    correlation.peak,
    window.gray_window,
    WindowGeometry.of,
    KcfModel.place,
    KcfTracker.update,
    GAUSSIAN,
    RESPOND,
    LEARN,
    HOG,
    SAMPLE,
)
DEPTH_PARTS = (
    centre_patch.centre_patch,
    sliding_window.search_span,
    DepthAwareTracker._occlusion_status,
    RgbdTracker._partly_visible,
    DIFFERENCE,
    SEARCH,
    GAUSSIAN,
)
PARTICLE_PARTS = (
    color_histogram.ColorHistogram.__call__,
    color_histogram.bhattacharyya_distance,
    particle_filter.normal_likelihood,
    ParticleFilter.initialise,
    ParticleFilter.scatter,
    ParticleFilter.predict,
    ParticleFilter.update,
    ParticleFilter.resample,
    ParticleFilter.estimate,
    RgbdPfTracker._begin,
)


@dataclass(frozen=True, eq=False)
class Moment:
    """One frame, what the tracker said of it, and the calls that led there.

    Attributes:
        number: of the frame in the recording.
        frame: the images.
        track: the tracker's answer.
        calls: by function, in order.
    """

    number: int
    frame: Frame
    track: Track
    calls: dict[str, list[Call]] = field(repr=False)

    def of(self, function: str) -> list[Call]:
        """The calls of a function, named as in :func:`~rgbd_kcf_tracker.view.watch.name_of`."""
        return self.calls.get(function, [])


@dataclass(frozen=True, eq=False)
class FilterMoments:
    """The frames in which ``kcf`` is explained: training, and the frame asked for."""

    first: Moment
    asked: Moment
    geometry: WindowGeometry
    box: Box


@dataclass(frozen=True, eq=False)
class DepthMoments:
    """The frames in which ``rgbd`` is explained.

    Attributes:
        seen: the frame asked for, or the last before it in which the target was seen.
        partly: the frame of one spell of occlusion in which most was hidden of a target still seen.
        hiding: the first frame in which it counts as hidden.
        adjusted: the frame up to ``hiding`` in which most was cut off the edges of the patch.
        hidden: a frame of that spell in which the target has been hidden for a while.
        readings: frame, state, response and D_diff of every frame.
    """

    seen: Moment | None
    partly: Moment | None
    hiding: Moment | None
    hidden: Moment | None
    adjusted: Moment | None
    readings: list[tuple[int, str, float, float]]


@dataclass(frozen=True, eq=False)
class ParticleMoments:
    """The frames in which ``rgbd_pf`` is explained: the first, and one with resampling."""

    first: Moment
    asked: Moment


def _run(
    tracker: Tracker, frames: Iterable[tuple[int, Frame]], box: Box, watch: Watch
) -> Iterator[Moment]:
    started = False
    for number, frame in frames:
        watch.clear()
        with watch:
            track = tracker.update(frame) if started else tracker.start(frame, box)
        started = True
        yield Moment(number, frame, track, watch.by_function())


def explain_filter(frames: Iterable[tuple[int, Frame]], box: Box, asked: int) -> FilterMoments:
    """Run ``kcf`` from its first frame to the one asked for."""
    first: Moment | None = None
    geometry: WindowGeometry | None = None
    moment: Moment | None = None
    for moment in _run(create_tracker('kcf'), frames, box, Watch(*FILTER_PARTS)):
        if first is None:
            first = moment
            geometry = moment.of('thesis.kcf:WindowGeometry.of')[0].value
        if moment.number >= asked:
            break
    assert first is not None
    assert moment is not None
    assert geometry is not None
    return FilterMoments(first, moment, geometry, box)


def explain_depth(frames: Iterable[tuple[int, Frame]], box: Box, asked: int) -> DepthMoments:
    """Run ``rgbd`` to the frame asked for, and on until an occlusion has come and gone."""
    seen = partly = hiding = hidden = adjusted = None
    hiding_ns = 0
    readings = []
    was_seen = False
    over = False
    for moment in _run(create_tracker('rgbd'), frames, box, Watch(*DEPTH_PARTS)):
        searches = moment.of('thesis.rgbd:RgbdTracker._search')
        if not searches:  # the first frame: nothing is searched
            was_seen = True
            continue
        response = float(searches[-1].value[0].response)
        differences = [
            c.value for c in moment.of('thesis.depth_patch:DepthPatch.diff_at_centre') if c.value
        ]
        value = differences[-1].value if differences else float('nan')
        readings.append((moment.number, moment.track.state.value, response, value))
        is_seen = moment.track.box is not None
        if is_seen and moment.number <= asked:
            seen = moment
        if not over:
            if is_seen and hidden is not None and moment.number > asked:
                over = True
            elif is_seen and hidden is not None:
                # Back again before the frame asked for: a later spell may lie nearer to it.
                partly = hiding = hidden = None
            if is_seen and hidden is None:
                partly = moment if _hides_more(moment, partly) else partly
                adjusted = moment if _cut_off(moment) > _cut_off(adjusted) else adjusted
            if not is_seen:
                if was_seen or hiding is None:
                    hiding, hiding_ns = moment, moment.frame.stamp_ns
                if (moment.frame.stamp_ns - hiding_ns) * 1e-9 <= SETTLED_S:
                    hidden = moment
        was_seen = is_seen
        if moment.number >= asked and (over or moment.number > asked + MOST_AHEAD):
            break
    return DepthMoments(seen, partly, hiding, hidden, adjusted, readings)


def _response(moment: Moment) -> float:
    return float(moment.of('thesis.rgbd:RgbdTracker._search')[-1].value[0].response)


def _cut_off(moment: Moment | None) -> int:
    """Rows and columns that the depth patch lost at its edges in a frame."""
    if moment is None:
        return 0
    sizes = [
        call.found['size'].shape[0] + call.found['size'].shape[1]
        - (call.value.rows.stop - call.value.rows.start)
        - (call.value.cols.stop - call.value.cols.start)
        for call in moment.of('thesis.depth_patch:DepthPatch.diff_at_centre')[-1:]
        if call.value is not None
    ]  # fmt: skip
    return max(sizes, default=0)


def _hides_more(moment: Moment, other: Moment | None) -> bool:
    """Whether a target that is seen is covered more than in another frame, by its response."""
    return other is None or _response(moment) < _response(other)


def explain_particles(frames: Iterable[tuple[int, Frame]], box: Box, asked: int) -> ParticleMoments:
    """Run ``rgbd_pf`` to the frame asked for, or the next in which the particles are resampled."""
    first: Moment | None = None
    chosen: Moment | None = None
    for moment in _run(create_tracker('rgbd_pf'), frames, box, Watch(*PARTICLE_PARTS)):
        if first is None:
            first = moment
            continue
        weighed = bool(moment.of('thesis.particle_filter:ParticleFilter.update'))
        if moment.number <= asked or chosen is None:
            chosen = moment
        if moment.number >= asked and weighed and _resampled(moment):
            chosen = moment
            break
        if moment.number > asked + MOST_AHEAD:
            break
    assert first is not None
    return ParticleMoments(first, chosen or first)


def _resampled(moment: Moment) -> bool:
    calls = moment.of('thesis.particle_filter:ParticleFilter.resample')
    return any(bool(np.asarray(call.value)) for call in calls)
