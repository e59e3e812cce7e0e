# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Several targets at once, each with an id of its own."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.decide.cues import Cue
from rgbd_kcf_tracker.metric.identity.embedding import Embedding
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.pointing import target_at
from rgbd_kcf_tracker.metric.targets import MetricTargets
from rgbd_kcf_tracker.parameters import Parameters
from rgbd_kcf_tracker.track import Track, Tracker
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, create_tracker, fitting_parameters


class TargetSet:
    """Follows targets that come and go, and with ``metric`` everyone in view.

    With ``metric`` what a frame shows is perceived once for all, and everyone is accounted for
    together; the other variants run a tracker for each target.

    Args:
        variant: name of the tracker.
        parameters: its parameters, None for the released defaults.
        cues: further ones for the verdict of ``metric``.
        embedding: describes people for ``metric``, instead of the network that its parameters name.

    Raises:
        ParameterError: for an unknown variant, parameters of another one, a network that cannot be
            run, or cues or an embedding with another than ``metric``.

    Example:
        >>> targets = TargetSet('metric')
        >>> targets.everyone = True
        >>> targets.update(frame)  # doctest: +SKIP
        {1: Track(...), 2: Track(...)}
    """

    def __init__(
        self,
        variant: str = DEFAULT_VARIANT,
        parameters: Parameters | None = None,
        cues: Sequence[Cue] = (),
        embedding: Embedding | None = None,
    ) -> None:
        self._variant = variant
        self._parameters = fitting_parameters(variant, parameters)
        self._cues = cues
        self._together: MetricTargets | None = None
        if isinstance(self._parameters, MetricParameters):
            self._together = MetricTargets(self._parameters, cues, embedding=embedding)
        elif cues or embedding is not None:
            raise ParameterError(f'variant {variant} knows no cues and no embedding: use metric')
        self._trackers: dict[int, Tracker] = {}
        self._started: dict[int, Track] = {}
        self._next = 1

    def anew(self) -> TargetSet:
        """The same with nobody in it; what was read from files is not read again."""
        embedding = None if self._together is None else self._together.embedding
        return TargetSet(self._variant, self._parameters, self._cues, embedding)

    @property
    def everyone(self) -> bool:
        """Whether people whom nobody chose get ids and tracks too; only ``metric`` can."""
        return self._together is not None and self._together.everyone

    @everyone.setter
    def everyone(self, value: bool) -> None:
        if self._together is None:
            if value:
                raise ParameterError(
                    f'variant {self._variant} follows chosen targets only: '
                    'use metric to follow everyone'
                )
            return
        self._together.everyone = value

    @property
    def metric(self) -> MetricTargets | None:
        """The engine of ``metric``, for looking at what it saw; None with another variant."""
        return self._together

    def add(self, frame: Frame, box: Box) -> int:
        """Follow what is in ``box`` of ``frame``: the last that was given, or the next.

        Returns:
            Its id, which no other gets while the set lives. With ``metric`` an id is somebody's:
            what is followed already keeps it, and a person has it again after :meth:`remove`.

        Raises:
            BoxError: where no whole pixel of the box lies inside the frame.
        """
        if self._together is not None:
            return self._together.add(frame, box)
        tracker = create_tracker(self._variant, self._parameters)
        track = tracker.start(frame, box)
        number = self._next
        self._next += 1
        self._trackers[number] = tracker
        self._started[number] = dataclasses.replace(track, id=number)
        return number

    def add_point(self, frame: Frame, u: float, v: float) -> int:
        """Follow what is seen at a pixel of ``frame``, which must have depth.

        Raises:
            BoxError: where nothing that could be followed is there.
        """
        return self.add(frame, target_at(frame, u, v))

    def remove(self, number: int) -> None:
        """No longer follow the target of that id.

        Raises:
            KeyError: where there is none.
        """
        if self._together is not None:
            self._together.remove(number)
            return
        del self._trackers[number], self._started[number]

    def started(self, number: int) -> Track:
        """The track of the frame in which a target was added.

        Raises:
            KeyError: where there is none of that id.
        """
        if self._together is not None:
            return self._together.started(number)
        return self._started[number]

    def update(self, frame: Frame) -> dict[int, Track]:
        """Follow all into the next frame, in time order; their tracks by id.

        Never raises for what the picture shows. Images stay as they are for as long as
        :meth:`Tracker.update` says.
        """
        if self._together is not None:
            return self._together.update(frame)
        return {
            number: dataclasses.replace(tracker.update(frame), id=number)
            for number, tracker in self._trackers.items()
        }

    def __len__(self) -> int:
        """Targets that were chosen and not removed."""
        return len(self._together if self._together is not None else self._trackers)
