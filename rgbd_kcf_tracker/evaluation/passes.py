# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One sequence, several trackers: the loop that everything measured comes from.

The sequence is read (or rendered) once, and every tracker gets the same frames, turn by turn; what
else is to be kept of them is handed in as well.
"""

from __future__ import annotations

import io
import math
import time
import traceback
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import cv2
import numpy as np
import numpy.typing as npt

import rgbd_kcf_tracker
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets.base import Sample
from rgbd_kcf_tracker.evaluation.metrics import vot
from rgbd_kcf_tracker.evaluation.metrics.ellipsoids import Triple
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.track import Track, Tracker, TrackState

T = TypeVar('T')
A = TypeVar('A')

THUMBNAIL_WIDTH = 320
THUMBNAILS = 24
_NO_BOX = Track(None, TrackState.IDLE)


def trace() -> str:
    """Where the exception that is handled came from; the same wherever the package lies."""
    home = f'{Path(rgbd_kcf_tracker.__file__).parent.parent}/'
    return traceback.format_exc().strip().replace(home, '')


class Sink(Protocol):
    """What takes the frames of a sequence, one after the other."""

    def feed(self, sample: Sample) -> None:
        """Take one more."""
        ...


def run(samples: Iterable[Sample], *sinks: Sink) -> None:
    """The loop: each frame, once it is read or rendered, goes to all ``sinks`` in their order."""
    for sample in samples:
        for sink in sinks:
            sink.feed(sample)


@dataclass(eq=False)
class Pass(ABC, Generic[T, A]):
    """A tracker that is given frame after frame.

    Attributes:
        tracker: what is run; None where the answers come from a file.
        tracks: its answers, one per frame.
        milliseconds: of each call.
        error: why it stopped, empty while it runs.
    """

    tracker: T | None
    tracks: list[A] = field(default_factory=list)
    milliseconds: list[float] = field(default_factory=list)
    error: str = ''

    def feed(self, sample: Sample) -> None:
        """Give the tracker one more frame; an exception stops this tracker, not the run."""
        if self.error or self.tracker is None:
            return
        try:
            before = time.perf_counter()
            answer = self._step(self.tracker, sample)
            self.milliseconds.append((time.perf_counter() - before) * 1000)
            self.tracks.append(answer)
        except RgbdKcfError as error:
            self.error = f'frame {len(self.tracks)}: {error}'
        except Exception:
            self.error = f'frame {len(self.tracks)}: {trace()}'

    def check(self) -> None:
        """Raise what stopped it, if anything did.

        Raises:
            RgbdKcfError: saying in which frame, and why.
        """
        if self.error:
            raise RgbdKcfError(self.error)

    @abstractmethod
    def _step(self, tracker: T, sample: Sample) -> A:
        """The answer to one frame."""


class OnePass(Pass[Tracker, Track]):
    """A tracker started once, on the first frame, and left alone."""

    def _step(self, tracker: Tracker, sample: Sample) -> Track:
        if self.tracks:
            return tracker.update(sample.frame)
        if sample.visible is None:
            raise RgbdKcfError('the first frame has no box')
        return tracker.start(sample.frame, sample.visible)


@dataclass(eq=False)
class WithRestarts(OnePass):
    """A tracker under VOT's short-term protocol: started again a few frames after each failure.

    Frames in which the target is absent, or that are not judged, are gone through, but neither fail
    nor count.

    Attributes:
        codes: a :class:`vot.Code` per frame.
        overlaps: IoU with the visible part or the whole body, whichever is more; NaN if absent.
    """

    codes: list[vot.Code] = field(default_factory=list)
    overlaps: list[float] = field(default_factory=list)
    _running: bool = False
    _wait: int = 0

    def run(self) -> vot.ShortTermRun:
        """What the measures take: the frames in which the target shows."""
        overlaps = np.array(self.overlaps, np.float64)
        there = ~np.isnan(overlaps)
        return vot.ShortTermRun(np.array(self.codes, np.int64)[there], overlaps[there])

    def _step(self, tracker: Tracker, sample: Sample) -> Track:
        box = sample.visible if sample.judged else None
        self._wait = max(0, self._wait - 1)
        track, code, overlap = _NO_BOX, vot.Code.SKIPPED, math.nan if box is None else 0.0
        if not self._running:
            if box is not None and self._wait == 0:
                track, code, overlap = tracker.start(sample.frame, box), vot.Code.START, 1.0
                self._running = True
        else:
            track = tracker.update(sample.frame)
            code = vot.Code.TRACKED
            if box is not None:
                overlap = _best_overlap(track.box, box, sample.body)
                if overlap <= 0:
                    code, self._running, self._wait = vot.Code.FAILURE, False, vot.SKIP
        self.codes.append(code)
        self.overlaps.append(overlap)
        return track


def _best_overlap(box: Box | None, visible: Box, body: Box | None) -> float:
    if box is None:
        return 0.0
    return max(box.iou(visible), box.iou(body) if body is not None else 0.0)


@dataclass(slots=True)
class Notes:
    """Notes what is true of the frames of a sequence, one entry per frame.

    Attributes:
        size: width and height of the last image.
        stamps_ns: of the frames.
        numbers: of the frames in the recording, from 0.
        visible, bodies, fractions, judged, positions, velocities: see :class:`Sample`.
    """

    size: tuple[int, int] = (0, 0)
    stamps_ns: list[int] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    visible: list[Box | None] = field(default_factory=list)
    bodies: list[Box | None] = field(default_factory=list)
    fractions: list[float | None] = field(default_factory=list)
    judged: list[bool] = field(default_factory=list)
    positions: list[Triple | None] = field(default_factory=list)
    velocities: list[Triple | None] = field(default_factory=list)

    def feed(self, sample: Sample) -> None:
        """Note one more."""
        self.size = sample.frame.width, sample.frame.height
        self.stamps_ns.append(sample.frame.stamp_ns)
        self.numbers.append(sample.number)
        self.visible.append(sample.visible)
        self.bodies.append(sample.body)
        self.fractions.append(sample.fraction)
        self.judged.append(sample.judged)
        self.positions.append(sample.position)
        self.velocities.append(sample.velocity)


class Thumbnails:
    """Small pictures of a sequence, evenly spread, whatever its length turns out to be."""

    def __init__(self, most: int = THUMBNAILS) -> None:
        self._most = most
        self._step = 1
        self._kept: dict[int, bytes] = {}
        self._index = 0
        self.scale = 1.0

    def feed(self, sample: Sample) -> None:
        """Keep the frame's picture if it falls on the grid; the grid widens when it is full."""
        frame = sample.frame
        if self._index % self._step == 0:
            self.scale = min(1.0, THUMBNAIL_WIDTH / frame.width)
            size = [max(1, round(side * self.scale)) for side in (frame.width, frame.height)]
            small: npt.NDArray[np.uint8] = np.asarray(
                cv2.resize(frame.color, size, interpolation=cv2.INTER_AREA), np.uint8
            )
            done, data = cv2.imencode('.jpg', small, [cv2.IMWRITE_JPEG_QUALITY, 80])
            if done:
                self._kept[self._index] = data.tobytes()
            if len(self._kept) > 2 * self._most:
                self._step *= 2
                self._kept = {k: v for k, v in self._kept.items() if k % self._step == 0}
        self._index += 1

    @property
    def pictures(self) -> dict[int, bytes]:
        """JPEG data by frame index."""
        return self._kept

    def archive(self) -> bytes:
        """The pictures as one zip file, which depends on them alone."""
        data = io.BytesIO()
        with zipfile.ZipFile(data, 'w', zipfile.ZIP_STORED) as file:
            for index, picture in self._kept.items():
                file.writestr(zipfile.ZipInfo(f'{index:06d}.jpg'), picture)
        return data.getvalue()


def read_thumbnails(path: Path) -> dict[int, bytes]:
    """JPEG data by frame index out of a :meth:`Thumbnails.archive`; empty where there is none."""
    try:
        with zipfile.ZipFile(path) as file:
            return {int(Path(name).stem): file.read(name) for name in sorted(file.namelist())}
    except (OSError, ValueError, zipfile.BadZipFile):
        return {}
