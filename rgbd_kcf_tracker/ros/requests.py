# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What users ask of the node: take this target, choose one, drop it.

What searches the picture for a target is imported when it is first asked for: most nodes are told.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import TYPE_CHECKING

from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import RegionOfInterest
from std_msgs.msg import UInt32
from std_srvs.srv import Trigger

from rgbd_kcf_tracker.errors import ParameterError, RgbdKcfError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.live.processor import Processor
from rgbd_kcf_tracker.live.session import Choice
from rgbd_kcf_tracker.live.settings import RESTART, NodeParameters, auto_init_range, parse_box
from rgbd_kcf_tracker.ros.messages import box_from_roi

if TYPE_CHECKING:
    from rgbd_kcf_tracker.live.auto_init import AutoInit

CHOICE = 'choice'
REJECTED = 'rejected_requests'
"""The kind of fault that a request is which cannot be met."""


def auto_init_fault(settings: NodeParameters) -> str:
    """Why ``auto_init`` finds nobody, in words; empty where it may, or is off."""
    if not settings.auto_init:
        return ''
    try:
        auto_init_range(settings)
    except ParameterError as error:
        return f'auto_init: {error}'
    return ''


class Requests:
    """Turns messages and parameters into choices for the session, in the worker's thread.

    Args:
        processor: whose session it is.
        settings: the node's parameters as they stand.
        in_worker: has a function called in the worker's thread; the last of its kind counts.
        fault: told of a request that cannot be met, by kind and in words.
    """

    def __init__(
        self,
        processor: Processor,
        settings: Callable[[], NodeParameters],
        in_worker: Callable[[str, Callable[[], None]], None],
        fault: Callable[[str, str], None],
    ) -> None:
        self._processor, self._session = processor, processor.session
        self._settings, self._in_worker, self._fault = settings, in_worker, fault
        self._numbers = itertools.count()
        processor.on_restart = self._on_restart

    def init(self, message: RegionOfInterest) -> None:
        """``~/init``: a box in the newest image."""
        box = self._box('~/init', message)
        if box is not None:
            self._choose(lambda _: box)

    def add(self, message: RegionOfInterest) -> None:
        """``~/add``: a box in the newest image, to be followed beside the others."""
        box = self._box('~/add', message)
        if box is not None:
            oldest_s = self._settings().stale_after
            # Each counts, not the newest alone.
            kind = f'add {next(self._numbers)}'
            self._in_worker(kind, lambda: self._processor.add(lambda _: box, oldest_s))

    def remove(self, message: UInt32) -> None:
        """``~/remove``: the id of a target that was chosen or added."""
        number = int(message.data)
        self._in_worker(f'remove {number}', lambda: self._session.remove(number))

    def _box(self, topic: str, message: RegionOfInterest) -> Box | None:
        try:
            return box_from_roi(message)
        except RgbdKcfError as error:
            self._fault(REJECTED, f'{topic}: {error}')
            return None

    def init_point(self, message: PointStamped) -> None:
        """``~/init_point``: a pixel of the newest image."""
        from rgbd_kcf_tracker.metric.pointing import target_at

        u, v = float(message.point.x), float(message.point.y)
        self._choose(lambda frame: target_at(frame, u, v))

    def reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """``~/reset``: drop the target."""
        dropped = self._session.following
        self._in_worker('reset', self._session.reset)
        response.message = 'target dropped' if dropped else 'there was no target'
        response.success = True
        return response

    def from_parameters(self, names: frozenset[str]) -> None:
        """Do what parameters of these names ask for."""
        if 'init_box' in names:
            box = parse_box(self._settings().init_box)
            if box is not None:
                self._in_worker(CHOICE, lambda: self._session.choose(lambda _: box))
        if any(name.startswith('auto_init') for name in names):
            settings = self._settings()
            auto: AutoInit | None = None
            if settings.auto_init:
                from rgbd_kcf_tracker.live.auto_init import AutoInit

                if fault := auto_init_fault(settings):
                    self._fault(REJECTED, fault)
                else:
                    auto = AutoInit(settings)
            again = settings.auto_init_again
            self._in_worker('auto_init', lambda: self._session.choose_by_itself(auto, again))

    def _choose(self, choice: Choice) -> None:
        oldest_s = self._settings().stale_after
        self._in_worker(CHOICE, lambda: self._processor.choose(choice, oldest_s))

    def _on_restart(self) -> None:
        """The stamps went back for good, as a loop does (in the worker's thread).

        Where no parameter would choose anybody again, who was chosen is kept.
        """
        settings = self._settings()
        box: Box | None = parse_box(settings.init_box)
        chooses = settings.auto_init and not auto_init_fault(settings)
        if settings.on_time_jump != RESTART or (box is None and not chooses):
            return
        self._session.reset()
        if box is not None:
            self._session.choose(lambda _: box)
