# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The default tracker: the thesis's ideas carried out in metres.

Depth cuts the scene into surfaces with a place and a size; colour, place and what was seen beside
the target say which of them it is (:mod:`~rgbd_kcf_tracker.metric.by_surface`); where depth says
nothing of the target a correlation filter follows its look
(:mod:`~rgbd_kcf_tracker.metric.by_look`).
"""

from __future__ import annotations

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.by_look import ByLook, Look
from rgbd_kcf_tracker.metric.by_surface import BySurface, Candidate
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.scene import Scene, SceneReader
from rgbd_kcf_tracker.track import Track, TrackState, require_inside

SHORTEST_STEP = 1e-3
LONGEST_STEP = 5.0
"""Seconds between two frames; stamps that stand still or jump are taken as these."""
ATTEND = 1.0
"""Seconds after which the look of a target followed by its surface is learned again."""
BLIND = 0.25
"""Share of the expected body without a reading from which depth says nothing of it."""
SUREST_LOOK = 0.9
"""Score of a box found by look at full response: on colour alone about nine of ten are right."""
RELOCK_IOU = 0.7
RELOCK_FRAMES = 3
"""Overlap of what the look finds with a surface, and for how long, to go over to the surface."""


class MetricTracker:
    """Follows one target by its surface, and by its look where there is none.

    Args:
        parameters: see :class:`MetricParameters`.
    """

    def __init__(self, parameters: MetricParameters) -> None:
        self._parameters = parameters
        self._surface: BySurface | None = None
        self._look: ByLook | None = None
        self._reader: SceneReader | None = None
        self._scene: Scene | None = None
        self._stamp_ns = 0
        self._hidden_for = 0.0
        self._agreed = 0

    def weighed(self) -> list[tuple[Candidate, Box]]:
        """What was weighed in the last frame, best first, and the box each would have given.

        Empty while the target is followed by its look.
        """
        if self._surface is None or self._scene is None:
            return []
        return [(c, self._surface.box(self._scene, c)) for c in self._surface.candidates]

    def start(self, frame: Frame, box: Box) -> Track:
        """See :meth:`~rgbd_kcf_tracker.track.Tracker.start`."""
        require_inside(box, frame)
        p = self._parameters
        self._reader = SceneReader(p.view_width, p.jump, p.jump_per_metre, p.floor_margin, p.seed)
        self._stamp_ns = frame.stamp_ns
        self._hidden_for = 0.0
        self._agreed = 0
        self._surface = None
        scene = self._reader.read(frame) if p.use_surfaces else None
        if scene is not None:
            self._lock(scene, box)
        self._look = ByLook(frame, box, p) if p.use_look or self._surface is None else None
        return self._tracked(frame, box, 1.0, self._depth_of_surface())

    def update(self, frame: Frame) -> Track:
        """See :meth:`~rgbd_kcf_tracker.track.Tracker.update`."""
        if self._reader is None:
            return Track(None, TrackState.IDLE)
        dt = (frame.stamp_ns - self._stamp_ns) * 1e-9
        dt = min(max(dt, SHORTEST_STEP), LONGEST_STEP)
        self._stamp_ns = frame.stamp_ns
        scene = self._reader.read(frame) if self._parameters.use_surfaces else None
        self._scene = scene
        if self._surface is None:
            track = self._by_look(frame, scene, dt)
        else:
            track = self._by_surface(frame, scene, dt, self._surface)
        self._hidden_for = 0.0 if track.box is not None else self._hidden_for + dt
        return track

    # -- by surface -------------------------------------------------------------------------------

    def _lock(self, scene: Scene, box: Box) -> None:
        seen = BySurface.surface_of(scene, box)
        if seen is not None:
            self._surface = BySurface(scene, seen, self._parameters)

    def _depth_of_surface(self) -> float | None:
        return float(self._surface.motion.position[2]) if self._surface is not None else None

    def _by_surface(
        self, frame: Frame, scene: Scene | None, dt: float, surface: BySurface
    ) -> Track:
        if scene is None:
            surface.motion.predict(dt)
            return self._glance(frame, None, dt, surface)
        found = surface.step(scene, dt)
        if found is None:
            return self._glance(frame, scene, dt, surface)
        box = surface.take(scene, found, dt)
        if self._look is not None and not found.seen.cut.any:
            self._look.attend(frame, box, dt, ATTEND)
        return self._tracked(frame, box, found.probability, found.seen.depth)

    def _glance(self, frame: Frame, scene: Scene | None, dt: float, surface: BySurface) -> Track:
        """Where depth shows nothing of the target, see whether its look is where it should be."""
        assert self._reader is not None
        view = scene.view if scene is not None else self._reader.last_view
        if self._look is not None and view is not None:
            box = surface.expected_box(view)
            blind = scene is None or surface.without_depth(scene) > BLIND
            if blind and box is not None and box.clipped(frame.width, frame.height) is not None:
                look = self._look.glance(frame, box, dt)
                if look is not None:
                    surface.seen_elsewhere(view, look.box)
                    return self._tracked(frame, look.box, _score(look), look.depth)
        surface.miss(scene, dt)
        return self._hidden(dt)

    # -- by look ----------------------------------------------------------------------------------

    def _by_look(self, frame: Frame, scene: Scene | None, dt: float) -> Track:
        assert self._look is not None
        look = self._look.step(frame, dt)
        if look is None:
            self._agreed = 0
            return self._hidden(dt)
        if scene is not None:
            self._agree(scene, look.box)
        return self._tracked(frame, look.box, _score(look), look.depth)

    def _agree(self, scene: Scene, box: Box) -> None:
        """Go over to the surface once one has borne out the look for some frames."""
        seen = BySurface.surface_of(scene, box)
        if seen is not None and BySurface.outline(scene, seen).iou(box) > RELOCK_IOU:
            self._agreed += 1
            if self._agreed >= RELOCK_FRAMES:
                self._lock(scene, box)
        else:
            self._agreed = 0

    # -- answers ----------------------------------------------------------------------------------

    def _hidden(self, dt: float) -> Track:
        lost = self._hidden_for + dt > self._parameters.lost_after
        return Track(None, TrackState.LOST if lost else TrackState.OCCLUDED)

    def _tracked(self, frame: Frame, box: Box, score: float, depth: float | None) -> Track:
        position = None
        if depth is not None and frame.intrinsics is not None:
            position = frame.intrinsics.deproject(box.cx, box.cy, depth)
        return Track(box, TrackState.TRACKING, score, depth, position)


def _score(look: Look) -> float:
    """Probability that a box found by look is right, from the response against its mean."""
    return float(min(max(look.ratio, 0.0), SUREST_LOOK))
