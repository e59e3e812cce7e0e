# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What can be measured: our variants, OpenCV's trackers, and boxes that lie in files."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import cv2

import rgbd_kcf_tracker
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.evaluation.store import slug
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import describe, files_named, with_overrides
from rgbd_kcf_tracker.track import Track, Tracker, TrackState, require_inside
from rgbd_kcf_tracker.variants import VARIANTS, create_tracker, default_parameters

OPENCV_PREFIX = 'opencv:'
OPENCV_TRACKERS = {'kcf': 'TrackerKCF', 'csrt': 'TrackerCSRT', 'mil': 'TrackerMIL'}
SWITCH_PREFIX = 'use_'
"""Boolean parameters that begin so switch an ingredient on and off."""


@dataclass(frozen=True, slots=True)
class Contender:
    """A tracker in a benchmark.

    Attributes:
        name: as it stands in tables.
        kind: 'variant', 'opencv' or 'boxes'.
        target: the variant, OpenCV's tracker, or the pattern of the files of boxes.
        overrides: parameters that differ from the defaults, as text.
        files: digests of files of boxes by sequence, as far as they are known.
    """

    name: str
    kind: str
    target: str
    overrides: tuple[tuple[str, str], ...] = ()
    files: tuple[tuple[str, str], ...] = field(default=(), compare=False)

    @property
    def identity(self) -> str:
        """Changes whenever the tracker would behave otherwise by its parameters."""
        values: Any = ''
        if self.kind == 'variant':
            parameters = self.parameters()
            values = dataclasses.asdict(parameters)
            # Where a file lies is of a machine: its content is in the key of a run.
            values |= dict.fromkeys(files_named(parameters), '')
        elif self.kind == 'opencv':
            values = cv2.__version__
        return json.dumps([self.kind, self.source, values], sort_keys=True)

    @property
    def source(self) -> str:
        """The variant, or OpenCV's tracker; of boxes nothing: where files lie is of a machine."""
        return '' if self.kind == 'boxes' else self.target

    def make(self) -> Tracker:
        """A new tracker.

        Raises:
            ParameterError: where OpenCV's tracker is not installed, or a parameter is wrong.
        """
        if self.kind == 'variant':
            return create_tracker(self.target, self.parameters())
        if self.kind == 'opencv':
            return OpenCvTracker(self.target)
        raise ParameterError(f'{self.name} is read from files, not run')

    def make_set(self) -> Any:
        """A new ``TargetSet``, which follows several targets.

        Raises:
            ParameterError: where the tracker follows one target only, or a parameter is wrong.
        """
        if self.kind != 'variant':
            raise ParameterError(f'{self.name} follows one target: it cannot follow everyone')
        return rgbd_kcf_tracker.TargetSet(  # type: ignore[attr-defined]
            self.target, self.parameters()
        )

    def parameters(self) -> Any:
        """The parameters of a variant, overrides applied."""
        return with_overrides(default_parameters(self.target), dict(self.overrides))


class OpenCvTracker:
    """One of OpenCV's own trackers behind our two methods; colour only.

    Where it says that it has lost the target there is no box; only KCF and CSRT ever do.

    Raises:
        ParameterError: for another name, or where this OpenCV has no such tracker.
    """

    def __init__(self, name: str) -> None:
        if name not in OPENCV_TRACKERS:
            raise ParameterError(
                f'unknown OpenCV tracker {name!r}: choose one of {", ".join(OPENCV_TRACKERS)}'
            )
        self._factory = _opencv_factory(OPENCV_TRACKERS[name])
        if self._factory is None:
            raise ParameterError(
                f'opencv:{name} is not in this OpenCV ({cv2.__version__}): install '
                'opencv-contrib-python-headless in place of opencv-python-headless'
            )
        self._tracker: Any = None

    def start(self, frame: Frame, box: Box) -> Track:
        """Take the target in ``box``.

        Raises:
            BoxError: where the box lies wholly outside the image.
        """
        require_inside(box, frame)
        inside = box.clipped(frame.width, frame.height) or box
        self._tracker = self._factory() if self._factory is not None else None
        x, y, width, height = (round(v) for v in inside.as_tuple())
        self._tracker.init(frame.color, (x, y, max(width, 1), max(height, 1)))
        return Track(box, TrackState.TRACKING, 1.0)

    def update(self, frame: Frame) -> Track:
        """Follow the target into ``frame``."""
        if self._tracker is None:
            return Track(None, TrackState.IDLE)
        found, (x, y, width, height) = self._tracker.update(frame.color)
        if not found or width <= 0 or height <= 0:
            return Track(None, TrackState.OCCLUDED)
        return Track(Box(x, y, width, height), TrackState.TRACKING, 1.0)


def variant(name: str, overrides: Mapping[str, str] | None = None) -> Contender:
    """One of our variants, or ``opencv:NAME``; tried out here, so that an error comes at once.

    Raises:
        ParameterError: for an unknown name or parameter, or where OpenCV's tracker is missing.
    """
    if name.startswith(OPENCV_PREFIX):
        contender = Contender(name, 'opencv', name.removeprefix(OPENCV_PREFIX))
    else:
        if name not in VARIANTS:
            known = ', '.join([*VARIANTS, *(OPENCV_PREFIX + n for n in OPENCV_TRACKERS)])
            raise ParameterError(f'unknown variant {name!r}: choose from {known}')
        given = dict(sorted((overrides or {}).items()))
        label = ' '.join([name, *(f'{k}={v}' for k, v in given.items())])
        files = files_named(with_overrides(default_parameters(name), given))
        contender = Contender(label, 'variant', name, tuple((given | files).items()))
    contender.make()
    return contender


def boxes(text: str) -> Contender:
    """A tracker whose boxes lie in files: ``NAME=PATTERN``, with ``{sequence}`` in the pattern.

    Raises:
        ParameterError: where the text is not so.
    """
    name, equals, pattern = text.partition('=')
    if not equals or not name or not pattern:
        raise ParameterError(
            f'boxes {text!r}: give NAME=FOLDER or NAME=PATTERN with {{sequence}} in it'
        )
    return Contender(name, 'boxes', os.path.abspath(pattern))


def switches(base: Contender) -> list[str]:
    """The parameters ``use_...`` of a variant that are on: its ingredients."""
    current = base.parameters()
    return [
        info.name
        for info in describe(VARIANTS[base.target].parameters)
        if info.type is bool and info.name.startswith(SWITCH_PREFIX) and getattr(current, info.name)
    ]


def ablations(base: Contender) -> list[Contender]:
    """The variant with each of its switches off in turn."""
    given = dict(base.overrides)
    return [
        dataclasses.replace(
            base,
            name=f'{base.name} without {name.removeprefix(SWITCH_PREFIX)}',
            overrides=tuple(sorted({**given, name: 'false'}.items())),
        )
        for name in switches(base)
    ]


def unique(contenders: Iterable[Contender]) -> list[Contender]:
    """The contenders in order, each name once.

    Raises:
        ParameterError: where two different ones have one name.
    """
    result: dict[str, Contender] = {}
    for contender in contenders:
        other = result.setdefault(slug(contender.name), contender)
        if other != contender:
            raise ParameterError(
                f'two trackers are named {other.name!r} and {contender.name!r}: their results '
                'would lie in one place, rename one'
            )
    return list(result.values())


def _opencv_factory(name: str) -> Any:
    for module in (cv2, getattr(cv2, 'legacy', None)):
        for maker in (getattr(module, f'{name}_create', None), getattr(module, name, None)):
            if maker is not None:
                return getattr(maker, 'create', maker)
    return None
