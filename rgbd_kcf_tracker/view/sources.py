# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where frames come from: a recording, or a simulated scene that reads like one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import overload

from rgbd_kcf_tracker.errors import BoxError, RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings import Recording, RecordingInfo
from rgbd_kcf_tracker.recordings.recording import Closing
from rgbd_kcf_tracker.simulation import SimulatedSequence, Truth, simulate


class _Boxes(Sequence['Box | None']):
    """A box of each frame, made when it is asked for: all of them together take seconds."""

    def __init__(self, count: int, of: Callable[[int], Box | None]) -> None:
        self._numbers, self._of = range(count), of

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> Box | None: ...
    @overload
    def __getitem__(self, index: slice) -> list[Box | None]: ...
    def __getitem__(self, index: int | slice) -> Box | list[Box | None] | None:
        numbers = self._numbers[index]
        return self._of(numbers) if isinstance(numbers, int) else [self._of(n) for n in numbers]


class SimulatedRecording(Closing):
    """A simulated scene as a :class:`~rgbd_kcf_tracker.recordings.Recording`.

    Args:
        scenario: a name in :data:`~rgbd_kcf_tracker.simulation.SCENARIOS`.
        seed: of everything random.
        rate_hz: frames per second.
        size: width and height in pixels.
        duration_s: of the scene; its own length if left out.

    Raises:
        ParameterError: for an unknown scenario, or a value out of range.
    """

    def __init__(
        self,
        scenario: str,
        seed: int = 0,
        rate_hz: float = 30.0,
        size: tuple[int, int] = (960, 540),
        duration_s: float | None = None,
    ) -> None:
        self._sequence: SimulatedSequence = simulate(scenario, seed, rate_hz, duration_s, size)
        self.name = f'{scenario}_{seed}'
        self.path = Path(self.name)
        self.intrinsics: Intrinsics | None = self._sequence.intrinsics
        self.warnings: list[str] = []
        self._truths: dict[int, Truth] = {}
        self.groundtruth = _Boxes(len(self), lambda index: self._truth(index).visible)
        self.groundtruth_body = _Boxes(len(self), lambda index: self._truth(index).body)

    def __len__(self) -> int:
        return len(self._sequence)

    def frames(self, start: int = 0, end: int | None = None) -> Iterator[Frame]:
        """The frames from ``start`` up to and without ``end``, rendered as they are read."""
        stop = len(self) if end is None else min(end, len(self))
        for index in range(start, stop):
            shown = self._sequence[index]
            self._truths[index] = shown.truth
            yield shown.frame

    def _truth(self, index: int) -> Truth:
        if index not in self._truths:
            self._truths[index] = self._sequence.truth(index)
        return self._truths[index]

    def info(self) -> RecordingInfo:
        """What is in the scene."""
        count = len(self)
        return RecordingInfo(
            path=self.path,
            kind='simulated scene',
            frames=count,
            frames_with_depth=count,
            duration_s=(self._sequence.stamp_ns(count - 1) - self._sequence.stamp_ns(0)) * 1e-9,
            rate_hz=self._sequence.rate_hz,
            streams=(),
            intrinsics=self.intrinsics,
            truth_frames=count,
        )

    def close(self) -> None:
        """Nothing is open."""


def first_box(recording: Recording, given: Box | None, start: int = 0) -> tuple[int, Box]:
    """The frame to start on and the target's box in it: the given one, else the ground truth's.

    Raises:
        RecordingError: where there are no frames from ``start`` on.
        BoxError: where no box is known.
    """
    if not 0 <= start < len(recording):
        raise RecordingError(
            f'{recording.path} has frames 0 to {len(recording) - 1}: there is no frame {start}'
        )
    if given is not None:
        return start, given
    truth = recording.groundtruth or ()
    for number in range(start, len(truth)):
        if (box := truth[number]) is not None:
            return number, box
    raise BoxError(
        f'{recording.path} has no ground truth: give the target as --init X,Y,W,H '
        f'(pixels in frame {start})'
    )
