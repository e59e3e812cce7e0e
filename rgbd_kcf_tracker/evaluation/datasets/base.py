# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a benchmark sequence is to the runner, whatever format it lies in.

A :class:`Sequence` is small, can be sent to another process, and is opened only where it runs, so a
broken one fails alone. Opened, it gives :class:`Sample` after :class:`Sample`: a frame and what is
true of it.
"""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rgbd_kcf_tracker.errors import DatasetError, ParameterError, RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.files import listing
from rgbd_kcf_tracker.recordings.pairing import JUMP_BACK_S

CLEAR_FRACTION = 0.5
"""A target is clearly in view where at least this share of it shows."""

EVERYONE = 'everyone'
"""Kind of a sequence in which everyone is followed, instead of one target."""
NO_SCENARIO = '-'
"""Scenario of recordings that belong to none."""
BROKEN = 'broken'
"""Kind of a sequence that cannot be read."""


class UnreadableError(DatasetError):
    """A folder cannot be read."""


@dataclass(frozen=True, slots=True)
class Annotation:
    """Somebody in a frame.

    Attributes:
        id: who; -1 for a region in which nothing is judged.
        box: of the visible part.
        counts: False where they are neither hit nor miss, because too little of them shows.
        body: box of the whole person where known (simulated scenes), else None.
        share: visible share, 0 to 1, None where unknown.
    """

    id: int
    box: Box
    counts: bool = True
    body: Box | None = None
    share: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One frame and its truth.

    Attributes:
        frame: colour, depth, stamp.
        visible: box of the visible part, None where the target is absent.
        body: box of the whole target where known (simulated scenes), else None.
        fraction: how much of the target shows, 0 to 1, None where unknown.
        judged: False where the truth leaves open what is right: the frame does not count.
        people: everyone, of a sequence of kind :data:`EVERYONE`.
        number: of the frame in the recording, from 0; :class:`Opened` gives it.
        position: of the middle of the target's body, ``(x, y, z)`` metres in the camera's optical
            frame, None where unknown.
        velocity: of the same over the ground, in metres per second along the same axes.
    """

    frame: Frame
    visible: Box | None
    body: Box | None = None
    fraction: float | None = None
    judged: bool = True
    people: tuple[Annotation, ...] = ()
    number: int = 0
    position: tuple[float, float, float] | None = None
    velocity: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """A sequence that is being read.

    Attributes:
        samples: in time order, to be gone through once.
        length: number of samples, None where unknown before the end.
        start: index of the first sample among the frames of the recording.
        total: frames of the recording, those before and after the samples included.
        annotated: False where only the first box is known (Princeton's test set): it can be run,
            and its results written for submission, but not measured.
        has_body: whether ``body`` boxes are given.
        warnings: what was odd.
    """

    samples: Iterable[Sample]
    length: int | None = None
    start: int = 0
    total: int | None = None
    annotated: bool = True
    has_body: bool = False
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        samples = enumerate(self.samples, self.start)
        numbered = (dataclasses.replace(sample, number=number) for number, sample in samples)
        object.__setattr__(self, 'samples', numbered)


@dataclass(frozen=True, slots=True)
class Sequence:
    """A sequence that can be opened.

    Attributes:
        name: unique within a run.
        scenario: the group it belongs to in tables.
        kind: format it lies in: folder, otb, vot, princeton, sim or recording; or everyone.
        open: opens it; made with :func:`functools.partial` so that it can be pickled.
        identity: changes whenever other frames or another truth would come out of the same files.
        content: files and folders that it is read from.
        digest: of what is in them, where it is known already.
        categories: Princeton's splits, as far as known.
        origin: pixel coordinate of the first column and row in the data set's files, 0 or 1.
        path: where it lies; None for simulated scenes.
        recording: which one it is of; several people of one are a sequence each. By default of
            what lies at ``path``, or its own.
    """

    name: str
    scenario: str
    kind: str
    open: Callable[[], Opened] = field(compare=False)
    identity: str
    content: tuple[Path, ...] = ()
    digest: str = ''
    categories: Mapping[str, str] = field(default_factory=dict)
    origin: int = 0
    path: Path | None = None
    recording: str = ''

    def __post_init__(self) -> None:
        if not self.recording:
            own = self.name if self.path is None else str(self.path)
            object.__setattr__(self, 'recording', own)
        # Names of files need not be UTF-8, those in tables do.
        for field_name in ('name', 'scenario'):
            text = getattr(self, field_name).encode('utf-8', 'surrogateescape')
            text = text.decode('utf-8', 'backslashreplace')
            object.__setattr__(self, field_name, text)


def broken(path: Path, reason: str) -> Sequence:
    """A sequence that cannot be read: it fails when it is run, and ends no other."""
    return Sequence(
        path.name, path.parent.name, BROKEN, functools.partial(_fail, reason), reason, path=path
    )


def _fail(reason: str) -> Opened:
    raise DatasetError(reason)


def without_depth(samples: Iterable[Sample]) -> Iterator[Sample]:
    """The samples as a colour camera gives them."""
    for sample in samples:
        yield dataclasses.replace(sample, frame=dataclasses.replace(sample.frame, depth=None))


def with_intrinsics(samples: Iterable[Sample], intrinsics: Intrinsics) -> Iterator[Sample]:
    """The samples as another camera's."""
    for sample in samples:
        frame = dataclasses.replace(sample.frame, intrinsics=intrinsics)
        yield dataclasses.replace(sample, frame=frame)


def at_rate(samples: Iterable[Sample], rate_hz: float) -> Iterator[Sample]:
    """The samples thinned out to at most ``rate_hz``, by their stamps.

    The first always stays, and so does the first after time jumped back.

    Raises:
        ParameterError: for a rate that is not above 0.
    """
    if not rate_hz > 0:
        raise ParameterError(f'rate is {rate_hz:g} Hz: it must be above 0')
    period = 1e9 / rate_hz
    due: float | None = None
    last = 0
    for sample in samples:
        stamp = sample.frame.stamp_ns
        if stamp < last - JUMP_BACK_S * 1e9:
            due = None
        last = stamp
        # A tenth of a period early is on time: stamps are rounded, and cameras jitter.
        if due is not None and stamp < due - period / 10:
            continue
        # The grid of due times stays while frames come in time, so that the mean rate holds.
        due = stamp + period if due is None or stamp > due + period else due + period
        yield sample


def from_first_view(samples: Iterable[Sample]) -> Iterator[Sample]:
    """The samples from the first in which the target is clearly in view."""
    started = False
    for sample in samples:
        started = started or is_clear(sample.visible, sample.fraction)
        if started:
            yield sample


def is_clear(box: Box | None, fraction: float | None) -> bool:
    """Whether the target shows, and at least :data:`CLEAR_FRACTION` of it where that is known."""
    return box is not None and (fraction is None or fraction >= CLEAR_FRACTION)


def entries(path: Path) -> list[Path]:
    """What is in a folder, hidden things left out.

    Raises:
        UnreadableError: where it cannot be read.
    """
    try:
        return listing(path)
    except RecordingError as error:
        raise UnreadableError(str(error)) from None


def group(path: Path, named: bool = False) -> str:
    """The scenario that a recording's name or place tells.

    ``occlusion_3`` belongs to ``occlusion``, as ``rgbd-kcf simulate`` names its scenes; any other
    recording to the folder of the data set that it lies in.

    Args:
        path: the recording.
        named: it was named itself, so that its folder says nothing, and a report that is made
            again elsewhere is the same.
    """
    numbered = re.fullmatch(r'(.+)_\d+', path.stem)
    if numbered:
        return numbered[1]
    return NO_SCENARIO if named else path.resolve().parent.name
