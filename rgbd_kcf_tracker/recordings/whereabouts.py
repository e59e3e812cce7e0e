# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where targets are in space, and where each of them walks: what tracks alone do not say."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.track import Track, TrackState

WALKING = 0.3
"""Metres per second from which a target's velocity says where it faces; one that stands sways."""
CERTAIN = 1.0
"""Standard deviations of the velocity that it must exceed as well: else any side is as likely."""
UNKNOWN_HEADING = math.pi / math.sqrt(3)
"""Standard deviation in radians of a heading of which nothing is known (all are alike likely)."""
TRAIL_S, TRAIL_STEP_S = 5.0, 0.1
"""Seconds of the way that are kept, and between its points."""
POSE_PREDICTION_S = 2.0
"""Seconds for which somebody hidden may be taken to walk on as before: long enough for a pillar."""
THICKEST = 0.5
"""Metres that a target reaches along the optical axis at most: one side cannot show it."""
_UP = np.array([0.0, 0.0, 1.0])
_IMAGE_UP = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class Whereabouts:
    """One target in space, in some frame.

    Attributes:
        track: what the tracker says.
        position: ``(3,)`` metres; where it is seen, or believed to be.
        predicted: whether it is only believed to be there.
        hidden_s: seconds since it was seen last, infinite where it never was.
        forward: ``(3,)`` horizontal unit vector along its walk: the last there was while it stands,
            away from the camera before it has walked.
        up: ``(3,)`` unit vector.
        heading_sigma: standard deviation of ``forward`` in radians.
        velocity: ``(3,)`` metres per second; None where unknown.
        covariance, velocity_covariance: ``(3, 3)``; None where unknown.
        size: ``(3,)`` metres of the box along the camera's x, y and z axes; None while it is hidden
            or not read, or the camera's intrinsics are unknown.
        camera: the camera's pose in the frame.
        trail: ``(n, 3)`` metres, where it was within the last seconds, oldest first.
    """

    track: Track
    position: FloatArray
    predicted: bool
    hidden_s: float
    forward: FloatArray
    up: FloatArray
    heading_sigma: float
    velocity: FloatArray | None
    covariance: FloatArray | None
    velocity_covariance: FloatArray | None
    size: FloatArray | None
    camera: Pose
    trail: FloatArray

    def seen_from(self, frame: Pose) -> Whereabouts:
        """The same in another frame, whose z axis points up.

        Args:
            frame: of this frame in the other.
        """
        turn = frame.rotation
        return replace(
            self,
            position=frame.of(self.position),
            forward=_level(turn @ self.forward, _UP),
            up=_UP,
            velocity=None if self.velocity is None else turn @ self.velocity,
            covariance=None if self.covariance is None else turn @ self.covariance @ turn.T,
            velocity_covariance=(
                None
                if self.velocity_covariance is None
                else turn @ self.velocity_covariance @ turn.T
            ),
            camera=self.camera.after(frame),
            trail=frame.of(self.trail),
        )

    @property
    def heading(self) -> Pose:
        """The target's own frame: x forward along the walk, z up."""
        left = np.cross(self.up, self.forward)
        return Pose(np.stack((self.forward, left, self.up), axis=1), self.position)


@dataclass(slots=True)
class _Walk:
    """What is remembered of one target, in the fixed frame or else in the camera's."""

    seen_ns: int | None = None
    forward: FloatArray | None = None
    trail: deque[tuple[int, FloatArray]] = field(default_factory=deque)


class Walks:
    """Remembers where targets walked, from frame to frame.

    Headings and trails are kept in the fixed frame where the camera's pose is known, so that a
    camera that turns does not turn them; without it the camera is taken to stand level and still.
    """

    def __init__(self) -> None:
        self._walks: dict[int, _Walk] = {}
        self._posed = False

    def update(
        self,
        tracks: Iterable[Track],
        stamp_ns: int,
        intrinsics: Intrinsics | None = None,
        pose: Pose | None = None,
    ) -> dict[int, Whereabouts]:
        """Where the targets of one frame are, by id, in the camera's optical frame.

        Args:
            tracks: of this frame; who is not among them is forgotten.
            stamp_ns: nanoseconds, rising from frame to frame.
            intrinsics: of the camera.
            pose: of the camera in a fixed frame whose z axis points up.
        """
        if self._posed != (pose is not None):
            for walk in self._walks.values():
                walk.forward = None
                walk.trail.clear()
            self._posed = pose is not None
        walks: dict[int, _Walk] = {}
        found: dict[int, Whereabouts] = {}
        for track in tracks:
            if track.state is TrackState.IDLE:
                continue
            walk = walks[track.id] = self._walks.get(track.id) or _Walk()
            if track.box is not None:
                walk.seen_ns = stamp_ns
            where = _where(track, walk, stamp_ns, intrinsics, pose)
            if where is not None:
                found[track.id] = where
        self._walks = walks
        return found


def _where(
    track: Track, walk: _Walk, stamp_ns: int, intrinsics: Intrinsics | None, pose: Pose | None
) -> Whereabouts | None:
    place = track.place
    if place is None or not np.isfinite(place).all():
        return None
    position = np.array(place, np.float64)
    fixed = pose if pose is not None else Pose(np.eye(3), np.zeros(3))
    up = _IMAGE_UP if pose is None else pose.rotation.T @ _UP
    velocity = _finite(track.velocity, (3,))
    velocity_covariance = _finite(track.velocity_covariance, (3, 3))
    sigma = UNKNOWN_HEADING
    if velocity is not None:
        level = velocity - (velocity @ up) * up
        speed = float(np.linalg.norm(level))
        unsure = 0.0
        if velocity_covariance is not None:
            unsure = math.sqrt(max(float(np.linalg.eigvalsh(velocity_covariance)[-1]), 0.0))
        if speed > max(WALKING, CERTAIN * unsure):
            walk.forward = fixed.rotation @ (level / speed)
            sigma = math.atan2(unsure, speed)
    away = position if walk.forward is None else fixed.rotation.T @ walk.forward
    hidden_s = math.inf if walk.seen_ns is None else max(stamp_ns - walk.seen_ns, 0) * 1e-9
    _extend(walk.trail, stamp_ns, fixed.of(position))
    return Whereabouts(
        track=track,
        position=position,
        predicted=track.position is None,
        hidden_s=hidden_s,
        forward=_level(away, up),
        up=up,
        heading_sigma=sigma,
        velocity=velocity,
        covariance=_finite(track.covariance, (3, 3)),
        velocity_covariance=velocity_covariance,
        size=_size(track, intrinsics),
        camera=Pose(np.eye(3), np.zeros(3)),
        trail=fixed.inverse.of(np.array([point for _, point in walk.trail])),
    )


def _extend(trail: deque[tuple[int, FloatArray]], stamp_ns: int, point: FloatArray) -> None:
    """Add where a target is now; the newest point moves on until it is a step from the last."""
    if len(trail) > 1 and trail[-1][0] - trail[-2][0] < TRAIL_STEP_S * 1e9:
        trail.pop()
    trail.append((stamp_ns, point))
    while stamp_ns - trail[0][0] > TRAIL_S * 1e9:
        trail.popleft()


def _size(track: Track, intrinsics: Intrinsics | None) -> FloatArray | None:
    """Metres of a box at the target's depth: across, down, and, as far as that is known, along."""
    if track.box is None or track.position is None or intrinsics is None:
        return None
    z = abs(track.position[2])
    across = max(track.box.width * z / intrinsics.fx, 0.01)
    down = max(track.box.height * z / intrinsics.fy, 0.01)
    return np.array([across, down, min(across, down, THICKEST)])


def _finite(values: tuple[float, ...] | None, shape: tuple[int, ...]) -> FloatArray | None:
    if values is None:
        return None
    array = np.array(values, np.float64)
    return array.reshape(shape) if np.isfinite(array).all() else None


def _level(direction: FloatArray, up: FloatArray) -> FloatArray:
    """The horizontal unit vector nearest a direction; some other where it points up or down."""
    for candidate in (direction, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])):
        level: FloatArray = candidate - (candidate @ up) * up
        length = float(np.linalg.norm(level))
        if length > 1e-6:
            return level / length
    raise AssertionError('two axes cannot both be vertical')
