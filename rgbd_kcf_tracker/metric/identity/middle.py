# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where the middle of a body is and how it moves, with covariances that can be relied on.

The motion filter that looks for the target follows the middle of its upper edge, on the surface,
with deviations that are wide enough never to lose it. What is told to others is this: the middle of
the body, half its thickness behind the surface, and deviations by which 95 of 100 true places lie
in the ellipsoid of 95 %. ``rgbd-kcf evaluate`` on simulated scenes measures that they do.

Errors are of two kinds. Those that are new with each frame are filtered out; those that stay for a
stride or for good (limbs that move the outline, half the thickness, the share of the height) are
not, however many frames are seen, so their variance is added to what the filter believes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.lens import Lens
from rgbd_kcf_tracker.metric.identity.body import Body, Placed
from rgbd_kcf_tracker.metric.identity.hidden_cloud import HiddenCloud
from rgbd_kcf_tracker.metric.identity.motion import MotionFilter
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.pose import Pose

HALF_CHEST = 0.11
"""Metres from a person's front to the axis: half of a chest, which is 0.2 to 0.25 m deep."""
ROUND = 2.0
"""Metres from the middle depth of a round thing's surface to its axis, for each metre between the
middle depth and that of the ninth tenth: 1.8 for a ball, 2.0 for a cylinder."""
NOISE, NOISE_PER_SQUARE_METRE = 0.0012, 0.0011
"""Metres of a depth reading's deviation at no distance, and more for each square metre of depth, of
time-of-flight cameras of the Kinect's kind (docs/simulation.md)."""
PERSON_HEIGHT = 0.9
SLENDER = 1.3
"""Metres of height, and times its width, from which a body is taken for a person's: a child of
three is as tall, and dogs and chairs are lower or broader."""
PERSON_MIDDLE, MIDDLE = 0.45, 0.5
"""Share of the height from the top to the middle: a person's centre of mass is at 0.55 of the
stature, a thing's in the middle."""
ADULT, ADULT_SIGMA, ADULT_WIDTH = 1.65, 0.2, 0.3
"""Metres of the height of people, its deviation, and the width from which a body whose ends were
never seen is taken for a person's."""
THING_SIGMA = 0.25
"""The deviation of the height of another such body, as a share of what was seen: half as large
again as it seems is two of them."""
NEAREST, NUDGE = 0.05, 1e-4
"""Metres ahead from which a lens can be taken out, nearer than any camera sees, and the slope over
which its effect is taken: so small that a lens is even over it, and large against rounding."""
LASTING = np.array([0.023, 0.044, 0.027])
"""Metres of the errors that stay: across, down, ahead. These and the following are such that true
places and velocities lie in the ellipsoids as often as they should, see above."""
FRESH = np.array([0.0185, 0.0185, 0.014])
"""Metres of the errors that are new after :data:`FRESH_TIME`."""
FRESH_TIME = 0.1
"""Seconds in which limbs move the outline anew: frames that come faster say no more."""
OUTLINE = np.array([1.2, 1.0, 0.3])
"""Shares of the deviations of a part's place (:class:`Placed`) by which the middle of a body that
is partly hidden is less sure: depth is known nearly as well as of any."""
LASTING_SPEED = np.array([0.07, 0.055, 0.055])
"""Metres per second that limbs move the outline about a body."""
WALKING = np.array([0.62, 0.28, 0.62])
"""Metres per second squared and square root of a hertz: white noise in the acceleration of somebody
who walks, turns and stops."""
SETTLE_TIME = 0.5
"""Seconds in which the place of the middle in the outline is learned: about a step, in which the
arms go from one side to the other."""
FIRST_SPEED = np.array([1.0, 0.2, 1.0])
"""Metres per second of somebody whose motion is not known yet: a walk (1.4 m/s) in some direction
over the floor, and hardly up or down."""


@dataclass(frozen=True, slots=True)
class Belief:
    """Where the middle of a target is believed to be, in the camera's optical frame.

    Attributes:
        position: metres.
        velocity: metres per second.
        covariance: of the position, ``(3, 3)`` in square metres.
        velocity_covariance: ``(3, 3)`` in square metres per square second.
    """

    position: FloatArray
    velocity: FloatArray
    covariance: FloatArray
    velocity_covariance: FloatArray

    def through(self, lens: Lens | None) -> Belief | None:
        """Where that is, if the camera was taken for one without its lens.

        None where the lens shows no such place, or a number is not finite.
        """
        told = self
        if lens is not None:
            x, y, z = self.position
            if z < NEAREST:
                return None
            slope = [(x / z, y / z)]
            nudged = np.array(slope) + NUDGE * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
            straight = lens.straightened(nudged)
            across, down = straight[0]
            # Derivatives of the straightened slopes by the slopes, then of places by places.
            slopes = np.column_stack([straight[1] - straight[2], straight[3] - straight[4]])
            slopes /= 2 * NUDGE
            turn = np.eye(3)
            turn[:2, :2] = slopes
            turn[:2, 2] = (across, down) - slopes @ np.array(slope[0])
            told = Belief(
                np.array([across * z, down * z, z]),
                turn @ self.velocity,
                turn @ self.covariance @ turn.T,
                turn @ self.velocity_covariance @ turn.T,
            )
        numbers = (told.position, told.velocity, told.covariance, told.velocity_covariance)
        return told if math.isfinite(sum(float(n.sum()) for n in numbers)) else None


class MiddleFilter:
    """Follows the middle of one body."""

    def __init__(self) -> None:
        self._motion: MotionFilter | None = None
        self._offset = np.zeros(3)
        self._step = self._down_sigma = 0.0

    def predict(self, dt: float, moved: Pose | None = None) -> None:
        """Go on by ``dt`` > 0 seconds; ``moved`` is the last camera's pose in that of now."""
        if self._motion is None:
            return
        if moved is not None:
            self._motion.carried(moved)
            self._offset = moved.rotation @ self._offset
        # White noise in the acceleration, so that any rate of frames gives the same.
        self._motion.predict(dt, dt**-0.5)
        self._step += dt

    def forget(self) -> None:
        """The target has come back elsewhere: what it was doing says nothing of what it does."""
        self._motion = None

    def seen(self, view: DepthView, seen: Silhouette, placed: Placed, body: Body) -> None:
        """Take in a silhouette that was found to be the target.

        Args:
            view: the depth.
            seen: the silhouette.
            placed: where it puts the body.
            body: the target's.
        """
        person, down, self._down_sigma = _middle_below(body)
        if not seen.cut.any or self._motion is None:
            # Where part of it is hidden, its place tells where the rest is.
            middle = _middle(view, seen)
            if not person:
                down = float(middle[1] - placed.position[1])
            elif not seen.cut.any:
                down = PERSON_MIDDLE * seen.height  # who crouches is less high than he is known for
            middle[1] = placed.position[1] + down
            learned = middle - placed.position
            share = 1.0 if self._motion is None else 1 - np.exp(-self._step / SETTLE_TIME)
            self._offset = self._offset + share * (learned - self._offset)
            if not seen.cut.any:
                self._measured(middle, np.zeros(3))
                return
        if person:
            self._offset[1] = down
        self.placed(placed.position, placed.sigma * OUTLINE)

    def placed(self, place: FloatArray, sigma: FloatArray) -> None:
        """Take in where the body's reference point was found, as :class:`Placed` has it.

        Args:
            place: ``(3,)`` metres.
            sigma: ``(3,)`` metres, by how much less it is known than where the whole body shows.
        """
        self._measured(place + self._offset, sigma)

    def _measured(self, middle: FloatArray, sigma: FloatArray) -> None:
        fresh = np.hypot(FRESH, sigma)
        step, self._step = max(self._step, 1e-3), 0.0
        if self._motion is None:
            self._motion = MotionFilter(middle, fresh, FIRST_SPEED, WALKING)
        else:
            self._motion.correct(middle, fresh * max(1.0, FRESH_TIME / step) ** 0.5)

    def belief(self) -> Belief | None:
        """Of a target that is seen; None before it was."""
        motion = self._motion
        if motion is None:
            return None
        return Belief(
            motion.position,
            motion.velocity,
            np.diag(np.square(motion.sigma) + self._lasting),
            np.diag(np.square(motion.speed_sigma) + np.square(LASTING_SPEED)),
        )

    def hidden(self, cloud: HiddenCloud) -> Belief:
        """Of a target that is hidden, by the particles of where it may be."""
        position, covariance = cloud.believed
        velocity, velocity_covariance = cloud.believed_velocity
        return Belief(
            position + self._offset,
            velocity,
            covariance + np.diag(self._lasting),
            velocity_covariance + np.diag(np.square(LASTING_SPEED)),
        )

    @property
    def _lasting(self) -> FloatArray:
        """Square metres of the errors that stay."""
        lasting: FloatArray = np.square(LASTING) + np.array([0.0, self._down_sigma**2, 0.0])
        return lasting


def sighted(view: DepthView, seen: Silhouette) -> Belief | None:
    """Where somebody is of whom nothing is known but one silhouette."""
    left, top, right, _ = seen.metres
    sides, ends = seen.cut.left or seen.cut.right, seen.cut.top or seen.cut.bottom
    place = np.array([(left + right) / 2, top, seen.depth])
    sigma = THING_SIGMA * np.array([seen.width * sides, seen.height * ends, 0.0])
    where = MiddleFilter()
    where.seen(view, seen, Placed(place, sigma, 1.0), Body(seen))
    return where.belief()


def in_metres(belief: Belief | None, frame: Frame) -> Belief | None:
    """A belief as the camera of the frame has it; None where that is unknown."""
    if belief is None or frame.intrinsics is None:
        return None
    return belief.through(frame.intrinsics.lens)


def triple(values: FloatArray) -> tuple[float, float, float]:
    """A ``(3,)`` array as a track has it."""
    x, y, z = values.tolist()
    return x, y, z


def row_by_row(values: FloatArray) -> tuple[float, ...]:
    """A ``(3, 3)`` array as a track has it."""
    return tuple(values.ravel().tolist())


def _middle(view: DepthView, seen: Silhouette) -> FloatArray:
    """The middle of an outline, ``(3,)`` metres, on the body's axis behind it."""
    rows, columns = seen.mask.sum(axis=1), seen.mask.sum(axis=0)
    count = float(columns.sum())
    row = seen.top + float(rows @ np.arange(len(rows))) / count
    column = seen.left + float(columns @ np.arange(len(columns))) / count
    depth = seen.pixels(view.depth)
    half, most = len(depth) // 2, int(0.9 * (len(depth) - 1))
    ordered = np.partition(depth, (half, most))
    surface, back = float(ordered[half]), float(ordered[most])
    noise = 1.28 * (NOISE + NOISE_PER_SQUARE_METRE * surface * surface)
    relief = max((back - surface) ** 2 - noise**2, 0.0) ** 0.5
    ahead = surface + min(HALF_CHEST, ROUND * relief)
    k = view.intrinsics
    return np.array([(column - k.cx) / k.fx * ahead, (row - k.cy) / k.fy * ahead, ahead])


def _middle_below(body: Body) -> tuple[bool, float, float]:
    """Whether a body is a person's, metres from its top to its middle, and their deviation."""
    person = body.height > max(PERSON_HEIGHT, SLENDER * body.width)
    if body.height_known:
        return person, (PERSON_MIDDLE if person else MIDDLE) * body.height, 0.0
    if body.width < ADULT_WIDTH:
        return person, MIDDLE * body.height, THING_SIGMA * body.height
    return True, PERSON_MIDDLE * max(body.height, ADULT), PERSON_MIDDLE * ADULT_SIGMA
