# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where the camera is when a picture is taken, and whether what is told of that can be believed."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Any, Protocol

from rgbd_kcf_tracker.pose import Pose

FASTEST, SLACK = 5.0, 0.1
"""Metres per second, and metres more, from picture to picture beyond which a pose has jumped."""
FASTEST_TURN, SLACK_TURN = 8.0, 0.1
"""Radians per second, and radians more, likewise."""
SEEN_SHIFT, SEEN_TURN = 0.01, math.radians(0.3)
"""Metres or radians from one picture to the next from which the camera is seen to move."""
TOLD_SHARE = 0.1
"""Share of that below which a told motion is none."""
JUDGED, CONTRADICTED, CLEARED = 10, 8, 2
"""Pictures that are looked back on; of these, so many must contradict the poses for them to be
disbelieved, and no more than so many for them to be believed again."""


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """The camera's poses at one picture.

    Attributes:
        fixed: in the frame that does not move, for the tracker; None where unknown.
        target: in the frame in which results go out; None where that is unknown, or is the
            camera's own.
    """

    fixed: Pose | None = None
    target: Pose | None = None


class CameraPlaces(Protocol):
    """Tells where the camera is; the node's asks TF."""

    def at(self, header: Any) -> Places:
        """The poses at the time of a picture, by its header."""
        ...

    def judged(self, places: Places, seems: Pose | None) -> Places:
        """The poses that can be believed, once the picture has been looked at.

        Args:
            places: as told by :meth:`at`.
            seems: how the camera seems to have moved since the last picture, None for not at all.
        """
        ...

    def forget(self) -> None:
        """The stamps went back: what was told before does not count any more."""
        ...


class PoseWatch:
    """Refuses poses that jump: a base cannot, but whoever localises it may change his mind."""

    def __init__(self) -> None:
        self._last: tuple[Pose, int] | None = None

    def jump(self, pose: Pose, stamp_ns: int) -> str:
        """What is impossible about a pose after the one before, in words; empty for nothing.

        After a jump the new pose is the one before.
        """
        last, self._last = self._last, (pose, stamp_ns)
        if last is None:
            return ''
        moved = last[0].after(pose.inverse)
        shift, turn = moved.shift, moved.turn
        seconds = abs(stamp_ns - last[1]) * 1e-9
        if shift > FASTEST * seconds + SLACK:
            return f'jumped by {shift:.2f} m in {seconds:.2f} s'
        if turn > FASTEST_TURN * seconds + SLACK_TURN:
            return f'jumped by {math.degrees(turn):.0f} degrees in {seconds:.2f} s'
        return ''

    def forget(self) -> None:
        """Begin anew."""
        self._last = None


class Standstill:
    """Notices a camera that is seen to move while its told pose in a fixed frame stands still."""

    def __init__(self) -> None:
        self._last: Pose | None = None
        self._seen: deque[bool] = deque(maxlen=JUDGED)
        self.noticed = False

    def update(self, pose: Pose | None, seems: Pose | None) -> bool:
        """Take a picture's told pose and seen motion; whether the poses are to be disbelieved."""
        last, self._last = self._last, pose
        if pose is not None and last is not None:
            told = last.after(pose.inverse)
            moving = seems is not None and (seems.shift > SEEN_SHIFT or seems.turn > SEEN_TURN)
            moves = told.shift > TOLD_SHARE * SEEN_SHIFT or told.turn > TOLD_SHARE * SEEN_TURN
            self._seen.append(moving and not moves)
        count = sum(self._seen)
        self.noticed = count >= CONTRADICTED or (self.noticed and count > CLEARED)
        return self.noticed
