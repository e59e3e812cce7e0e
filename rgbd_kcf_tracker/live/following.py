# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""When a robot is to follow the target, and when not: needs no ROS.

Who drives is the action server; it follows the target's pose as long as there is one, and a little
longer. Here is decided whether it is to drive at all.
"""

from __future__ import annotations

from dataclasses import dataclass

from rgbd_kcf_tracker.parameters import Parameters, parameter


@dataclass(frozen=True)
class FollowParameters(Parameters):
    """Parameters of the follow node."""

    tracker: str = parameter('tracker', 'Name of the tracker node, with its namespace.')
    pose_topic: str = parameter(
        '', "Topic of the target's pose, as the action server is told; empty for the tracker's."
    )
    action: str = parameter('follow_object', 'Name of the FollowObject action.')
    automatic: bool = parameter(
        True, 'Follow a target as soon as there is one; else wait for ~/start.'
    )
    give_up_after: float = parameter(
        5.0,
        'Time without sight of the target after which the robot is told to stop.',
        unit='s',
        minimum=0.0,
        maximum=600.0,
    )
    silent_after: float = parameter(
        1.0,
        'Time without an answer of the tracker after which the robot is told to stop.',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )
    retry_after: float = parameter(
        2.0,
        'Time after the action was refused or has ended by itself, or the target was dropped, '
        'before it is asked for again.',
        unit='s',
        minimum=0.1,
        maximum=600.0,
    )
    max_duration: float = parameter(
        0.0,
        'Longest time of following, told to the action server; 0 for no end.',
        unit='s',
        minimum=0.0,
        maximum=86400.0,
    )


class Following:
    """Whether the target is to be followed now.

    Args:
        parameters: see :class:`FollowParameters`.

    Attributes:
        asked: whether somebody wants it followed.
    """

    def __init__(self, parameters: FollowParameters) -> None:
        self._parameters = parameters
        self.asked = parameters.automatic
        self._answered: float | None = None
        self._seen: float | None = None
        self._ended: float | None = None
        self._visible = False

    def answer(self, now_s: float, seen: bool, hidden: bool) -> None:
        """Note an answer of the tracker.

        Args:
            now_s: seconds, of a clock that only rises.
            seen: there is a box.
            hidden: there is a target, but no box.
        """
        self._answered, self._visible = now_s, seen
        if seen:
            self._seen = now_s
        elif not hidden:
            if self._seen is not None:  # who drops it wants the robot to stand for a while
                self._ended = now_s
            self._seen = None

    def ended(self, now_s: float) -> None:
        """Note that the action has ended."""
        self._ended = now_s

    def to_begin(self, now_s: float) -> bool:
        """Whether the action is to be asked for: the target is in sight, and it is time."""
        if self._ended is not None and now_s - self._ended < self._parameters.retry_after:
            return False
        return self._visible and not self.reason_to_stop(now_s)

    def reason_to_stop(self, now_s: float) -> str:
        """Why the target is not to be followed, in words; '' where it is."""
        if not self.asked:
            return 'nobody asks for it'
        if self._answered is None or now_s - self._answered > self._parameters.silent_after:
            return 'the tracker is silent'
        if self._seen is None:
            return 'there is no target'
        if not self._visible and now_s - self._seen > self._parameters.give_up_after:
            return f'the target is out of sight for {self._parameters.give_up_after:g} s'
        return ''
