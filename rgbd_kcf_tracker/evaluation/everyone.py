# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings in which everyone is followed: the loop, what it leaves on disk, and its scores.

In Python::

    (sequence,) = open_dataset('recording/', DatasetOptions(fps=5, everyone=True))
    followed = follow(targets, sequence.open().samples)   # targets: a TargetSet
    print(followed.score())
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Sequence as Items
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

import rgbd_kcf_tracker
from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.evaluation import boxfiles, passes
from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation, Sample, Sequence
from rgbd_kcf_tracker.evaluation.metrics.everyone import Everyone, score
from rgbd_kcf_tracker.evaluation.passes import Pass
from rgbd_kcf_tracker.evaluation.store import (
    left_by_a_run,
    read_json,
    slug,
    was_made_as,
    write_json,
)
from rgbd_kcf_tracker.evaluation.times import write_times
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.recordings.mot import Sightings, mot_text, read_mot
from rgbd_kcf_tracker.recordings.outputs import write_atomically
from rgbd_kcf_tracker.track import Track

__all__ = ['EveryoneResult', 'Followed', 'Targets', 'follow', 'score']


class Targets(Protocol):
    """What follows several targets at once; ``rgbd_kcf_tracker.TargetSet`` does.

    Attributes:
        everyone: give an id to each person that appears, without being told.
    """

    everyone: bool

    def update(self, frame: Frame) -> Mapping[int, Track]:
        """Follow all targets into ``frame``: the track of each id."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """A recording by a tracker of several targets.

    Attributes:
        truth: who was where.
        bodies: ``(N, 4)`` boxes of the whole bodies, NaN where unknown; None where none is known.
        tracks: what the tracker said.
        milliseconds: of each update; empty where the tracks come from a file.
    """

    truth: Sightings
    bodies: FloatArray | None
    tracks: Sightings
    milliseconds: tuple[float, ...] = ()

    def score(self) -> Everyone:
        """How good the tracker was."""
        return score(self.truth, self.tracks, self.bodies)


@dataclass(frozen=True, slots=True, eq=False)
class EveryoneResult:
    """The scores of one tracker on one recording."""

    tracker: str
    sequence: str
    scenario: str
    frames: int
    scores: Everyone


class EveryonePass(Pass[Targets, Mapping[int, Track]]):
    """A tracker of several targets, given frame after frame, nobody's box among them."""

    def _step(self, tracker: Targets, sample: Sample) -> Mapping[int, Track]:
        if not self.tracks:
            tracker.everyone = True
        return dict(tracker.update(sample.frame))


def follow(targets: Targets, samples: Iterable[Sample]) -> Followed:
    """Let ``targets`` follow everyone through samples of a sequence of kind EVERYONE.

    Raises:
        RgbdKcfError: as the tracker or the source does.
    """
    truth, one = _Truth(), EveryonePass(targets)
    passes.run(samples, truth, one)
    one.check()
    return Followed(
        truth.sightings(), truth.bodies(), sightings_of(one.tracks), tuple(one.milliseconds)
    )


def sightings_of(tracks: Iterable[Mapping[int, Track]]) -> Sightings:
    """The boxes of the tracks of each frame."""
    rows = [
        (frame, who, *track.box.as_tuple(), track.score, *(track.position or (np.nan,) * 3))
        for frame, everyone in enumerate(tracks)
        for who, track in everyone.items()
        if track.box is not None
    ]
    table = np.array(rows, np.float64).reshape(len(rows), 10)
    return Sightings.of(
        table[:, 0], table[:, 1], table[:, 2:6], table[:, 6], positions=table[:, 7:]
    )


class _Truth:
    """Collects the people of samples."""

    def __init__(self) -> None:
        self.numbers: list[int] = []
        self.stamps_ns: list[int] = []
        self._people: list[tuple[int, Annotation]] = []

    def feed(self, sample: Sample) -> None:
        self._people += [(len(self.numbers), person) for person in sample.people]
        self.numbers.append(sample.number)
        self.stamps_ns.append(sample.frame.stamp_ns)

    def sightings(self) -> Sightings:
        return self._rows([p.box.as_tuple() for _, p in self._people])

    def bodies(self) -> FloatArray | None:
        if all(p.body is None for _, p in self._people):
            return None
        nothing = (np.nan,) * 4
        return self._rows([p.body.as_tuple() if p.body else nothing for _, p in self._people]).boxes

    def _rows(self, boxes: Items[tuple[float, ...]]) -> Sightings:
        people = [p for _, p in self._people]
        return Sightings.of(
            [frame for frame, _ in self._people],
            [p.id for p in people],
            np.array(boxes, np.float64).reshape(len(people), 4),
            [float(p.counts) for p in people],
            [np.nan if p.share is None else p.share for p in people],
        )


def times_name(sequence: str) -> str:
    """What times are kept under: a single target's sequence may have the same name."""
    return f'everyone/{sequence}'


@dataclass(frozen=True, slots=True)
class Places:
    """Where the files of a run lie in a report's folder.

    Apart from those of single targets, of which one may have the same name.

    Attributes:
        folder: of the report.
        sequence: its name.
        key: of the truth, see :func:`rgbd_kcf_tracker.evaluation.jobs.truth_key`.
    """

    folder: Path
    sequence: str
    key: str

    @property
    def truth(self) -> Path:
        """Who was where."""
        return self.folder / 'truth' / 'everyone' / f'{slug(self.sequence)}.{self.key}.txt'

    @property
    def bodies(self) -> Path:
        """The same with boxes of the whole bodies; not there where none is known."""
        return self.truth.with_name(f'{slug(self.sequence)}.{self.key}.body.txt')

    def tracks(self, tracker: str) -> Path:
        """What a tracker said."""
        name = f'{slug(self.sequence)}.txt'
        return self.folder / 'results' / slug(tracker) / 'everyone' / name

    def meta(self, tracker: str) -> Path:
        """Key and times, written last, so it vouches for the rest."""
        return self.tracks(tracker).with_suffix('.json')


def run(
    sequence: Sequence,
    contenders: Items[Contender],
    folder: Path,
    samples: Iterator[Sample],
    keys: Mapping[str, str],
    truth_key: str,
    length: int | None = None,
) -> list[tuple[str, str]]:
    """Let each contender follow everyone, and write what came out.

    Args:
        sequence: of kind EVERYONE.
        contenders: variants, and MOT text of other trackers.
        folder: of the report.
        samples: of the sequence.
        keys: of each contender's run, by its name.
        truth_key: see :class:`Places`.
        length: frames of the recording, those that are not run included; None where unknown.

    Returns:
        Trackers that failed, and why.
    """
    runs = {c.name: EveryonePass(None if c.kind == 'boxes' else c.make_set()) for c in contenders}
    truth = _Truth()
    passes.run(samples, truth, *runs.values())
    if not truth.numbers:
        raise RgbdKcfError(f'{sequence.name} has no frames')
    places = Places(folder, sequence.name, truth_key)
    rows, bodies = truth.sightings(), truth.bodies()
    write_atomically(places.truth, mot_text(rows))
    if bodies is not None:
        known = ~np.isnan(bodies[:, 0])
        whole = Sightings.of(rows.frames[known], rows.ids[known], bodies[known])
        write_atomically(places.bodies, mot_text(whole))
    failed = []
    for contender in contenders:
        one = runs[contender.name]
        tracks = sightings_of(one.tracks)
        if contender.kind == 'boxes':
            try:
                tracks = _from_file(contender, sequence, truth.numbers, length)
            except RgbdKcfError as error:
                one.error = str(error)
        if one.error:
            failed.append((contender.name, one.error))
            continue
        write_atomically(places.tracks(contender.name), mot_text(tracks))
        write_json(
            places.meta(contender.name),
            {
                'key': keys[contender.name],
                'tracker': contender.name,
                'sequence': sequence.name,
                'version': rgbd_kcf_tracker.__version__,
                'frames': len(truth.numbers),
                'stamps_ns': truth.stamps_ns,
                'bodies': bodies is not None,
            },
        )
        write_times(folder, contender.name, times_name(sequence.name), one.milliseconds)
    return failed


def is_done(folder: Path, sequence: Sequence, tracker: str, key: str, truth_key: str) -> bool:
    """Whether the same run has been made."""
    places = Places(folder, sequence.name, truth_key)
    if not (places.truth.is_file() and places.tracks(tracker).is_file()):
        return False
    if not was_made_as(places.meta(tracker), key):
        return False
    return places.bodies.is_file() or not read_json(places.meta(tracker)).get('bodies')


def read(folder: Path, sequence: Sequence, tracker: str, truth_key: str) -> EveryoneResult:
    """The scores of a run that was made, from its files.

    Raises:
        RgbdKcfError: where a file is not as it was written.
    """
    places = Places(folder, sequence.name, truth_key)
    bodies = None
    with left_by_a_run():
        meta = read_json(places.meta(tracker))
        truth, tracks = read_mot(places.truth, regions=True), read_mot(places.tracks(tracker))
        whole = read_mot(places.bodies, regions=True) if meta['bodies'] else None
    if whole is not None:
        bodies = np.full(truth.boxes.shape, np.nan)
        row = {key: i for i, key in enumerate(zip(truth.frames, truth.ids, strict=True))}
        for key, box in zip(zip(whole.frames, whole.ids, strict=True), whole.boxes, strict=True):
            bodies[row[key]] = box
    followed = Followed(truth, bodies, tracks)
    return EveryoneResult(
        tracker, sequence.name, sequence.scenario, int(meta['frames']), followed.score()
    )


def _from_file(
    contender: Contender, sequence: Sequence, numbers: Items[int], length: int | None
) -> Sightings:
    """Another tracker's MOT text of the whole recording, cut to the frames that were run."""
    path = boxfiles.find_file(contender.target, sequence)
    tracks = read_mot(path, length)
    place = {number: index for index, number in enumerate(numbers)}
    kept = np.array([int(f) in place for f in tracks.frames], np.bool_)
    rows = tracks.only(kept)
    return Sightings.of(
        [place[int(f)] for f in rows.frames], rows.ids, rows.boxes, rows.scores, rows.shares,
        rows.positions,
    )  # fmt: skip
