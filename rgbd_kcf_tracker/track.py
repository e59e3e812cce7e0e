# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a tracker says of one frame, and the contract that every tracker keeps."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from rgbd_kcf_tracker.errors import BoxError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box


class TrackState(Enum):
    """Where the target is, as far as the tracker knows."""

    IDLE = 'idle'
    """No target was given."""
    TRACKING = 'tracking'
    """The target is seen: there is a box."""
    OCCLUDED = 'occluded'
    """Hidden and expected back near where it went: no box."""
    LOST = 'lost'
    """Given up looking near, searching everywhere: no box."""


@dataclass(frozen=True, slots=True)
class Track:
    """A tracker's answer to one frame.

    Attributes:
        box: where the visible part of the target is, in pixels; None unless ``state`` is TRACKING.
        state: see :class:`TrackState`.
        score: how sure the tracker is that ``box`` is right, 0 to 1; 0 without a box.
        depth: distance of the target along the optical axis in metres; None where unknown.
        position: ``(x, y, z)`` of the target in metres in the camera's optical frame (REP-103: z
            forward, x right, y down); None where depth or intrinsics are unknown. ``metric`` gives
            the middle of the body, half its thickness behind the surface that is seen, the thesis's
            variants the surface at the middle of the box.
        id: of the target among several; 0 where there is only one.
        velocity: ``(x, y, z)`` over the ground in metres per second in the same frame; None where
            unknown.
        covariance: of the position or the predicted position, ``(3, 3)`` row by row in square
            metres, positive definite; None where unknown.
        predicted: where the middle of a target that is not seen, or on which depth shows nothing,
            is believed to be, ``(x, y, z)`` in metres; None with a position, and where nothing is
            known, or not any more.
        velocity_covariance: ``(3, 3)`` row by row in square metres per square second; None where
            the velocity is.
    """

    box: Box | None
    state: TrackState
    score: float = 0.0
    depth: float | None = None
    position: tuple[float, float, float] | None = None
    id: int = 0
    velocity: tuple[float, float, float] | None = None
    covariance: tuple[float, ...] | None = None
    predicted: tuple[float, float, float] | None = None
    velocity_covariance: tuple[float, ...] | None = None

    @property
    def place(self) -> tuple[float, float, float] | None:
        """Where the target is, or else is believed to be, as far as that is known."""
        return self.predicted if self.position is None else self.position

    @property
    def occluded(self) -> bool:
        """True while a target is followed but not seen; what goes out on ``~/occluded``."""
        return self.state in (TrackState.OCCLUDED, TrackState.LOST)


class Tracker(Protocol):
    """The two-method contract: start on a box, then one update per frame, in time order."""

    def start(self, frame: Frame, box: Box) -> Track:
        """Take the target in ``box`` of ``frame``, forgetting any other.

        Returns the track of this first frame: the given box, or, with ``metric``, all of
        somebody who was drawn by half or badly.

        Raises:
            BoxError: where the box lies outside the image; see :func:`require_inside`.
        """
        ...

    def update(self, frame: Frame) -> Track:
        """Follow the target into ``frame``. Never raises for what the picture shows.

        Before :meth:`start`, the answer is IDLE. A frame of another size than the first is taken
        as a restart of the stream: the tracker goes on with what it remembers where it can.
        The images must stay as they are until the next frame is answered: where that has no depth,
        a look may be learned from this one.
        """
        ...


def require_inside(box: Box, frame: Frame) -> None:
    """Refuse a first box that shows nothing of the image, or reaches absurdly far out of it.

    This is the one bound on the sizes of what a tracker makes for its target: a box that passes is
    at least a pixel and at most three images wide and high.

    Raises:
        BoxError: where no whole pixel of the box lies inside the frame, or it reaches further out
            of the image than that is wide or high.
    """
    inside = box.clipped(frame.width, frame.height)
    if inside is None or inside.width < 1 or inside.height < 1:
        raise BoxError(_refusal(box, frame, 'lies outside'))
    left, top = -box.x, -box.y
    right, bottom = box.right - frame.width, box.bottom - frame.height
    if max(left, right) > frame.width or max(top, bottom) > frame.height:
        raise BoxError(_refusal(box, frame, 'reaches too far out of'))


def _refusal(box: Box, frame: Frame, what: str) -> str:
    return (
        f'box {box.x:g},{box.y:g},{box.width:g},{box.height:g} {what} the '
        f'{frame.width}x{frame.height} image: give x,y,width,height in pixels of the colour image'
    )
