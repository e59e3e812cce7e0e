# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The per-frame file: one row per tracker, sequence and frame, from which every number is taken.

Tables, curves and Princeton's splits are all computed from the rows of this one file, so they agree
with each other, and anybody can compute them again.
"""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.categories import derive
from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import Sequence
from rgbd_kcf_tracker.evaluation.jobs import (
    RunOptions,
    is_done,
    meta_path,
    tracks_path,
    truth_key,
    truth_path,
)
from rgbd_kcf_tracker.evaluation.metrics import Comparison, Measures, compare, measure
from rgbd_kcf_tracker.evaluation.metrics.ellipsoids import Place
from rgbd_kcf_tracker.evaluation.metrics.vot import ShortTermRun
from rgbd_kcf_tracker.evaluation.store import (
    left_by_a_run,
    read_json,
    read_tracks,
    read_truth,
)
from rgbd_kcf_tracker.recordings.outputs import moved_into_place

HEADER = (
    'tracker', 'sequence', 'frame', 'stamp_ns', 'there', 'said', 'iou', 'dx_px', 'dy_px', 'ratio',
    'score', 'visible_fraction', 'judged',
)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """One tracker on one sequence, every frame from the given box on.

    Attributes:
        tracker: its name.
        sequence: its name.
        stamps_ns: one per frame.
        frames: the comparison with the truth, the first frame included.
        fraction: ``(N,)`` visible share, NaN where unknown.
        judged: ``(N,)`` False where the truth leaves open what is right: the frame does not count.
    """

    tracker: str
    sequence: str
    stamps_ns: tuple[int, ...]
    frames: Comparison
    fraction: FloatArray
    judged: Mask

    @property
    def counted(self) -> Comparison:
        """The frames that count: all that are judged but the first."""
        f, keep = self.frames, self.judged.copy()
        keep[:1] = False
        return Comparison(
            f.said[keep], f.there[keep], f.overlap[keep], f.offset[keep], f.score[keep]
        )

    def measures(self) -> Measures:
        """All measures of the frames that count."""
        return measure(self.counted)


@dataclass(frozen=True, slots=True)
class Info:
    """What is known of a sequence beside its frames.

    Attributes:
        name: as in :class:`Result`.
        scenario: its group.
        kind: its format.
        categories: Princeton's splits.
        derived: whether the categories are by our criteria.
        image_size: width and height.
        thumbnail_scale: of the pictures kept.
        simulated: whether whole bodies are known, as they are of simulated scenes alone.
        truth_key: of the files of its truth and pictures.
        recording: which one it is of; empty for one of its own.
    """

    name: str
    scenario: str
    kind: str
    categories: Mapping[str, str] = field(default_factory=dict)
    derived: bool = True
    image_size: tuple[int, int] = (0, 0)
    thumbnail_scale: float = 1.0
    simulated: bool = False
    truth_key: str = ''
    recording: str = ''


@dataclass(frozen=True, slots=True)
class Collected:
    """Everything a report is made of.

    Attributes:
        results: per tracker and sequence.
        infos: per sequence.
        short_term: runs with re-initialisation, per tracker and sequence.
        unmeasured: sequences that were run but have no ground truth.
        places: in metres against the truth, per tracker and sequence, where both are known.
    """

    results: list[Result]
    infos: dict[str, Info]
    short_term: dict[tuple[str, str], ShortTermRun]
    unmeasured: list[str]
    places: dict[tuple[str, str], list[Place]] = field(default_factory=dict)


def collect(
    folder: Path, sequences: Iterable[Sequence], contenders: list[Contender], options: RunOptions
) -> Collected:
    """Read what a run left in ``folder``; what failed, or was run otherwise, is not there."""
    collected = Collected([], {}, {}, [])
    for sequence in sequences:
        for contender in contenders:
            if is_done(folder, sequence, contender, options):
                key = truth_key(sequence, options)
                _collect_one(collected, folder, sequence, contender, key)
    return collected


def _collect_one(
    collected: Collected, folder: Path, sequence: Sequence, contender: Contender, key: str
) -> None:
    path = tracks_path(folder, contender.name, sequence.name)
    with left_by_a_run():
        meta = read_json(meta_path(path))
        if not meta['annotated']:
            if sequence.name not in collected.unmeasured:
                collected.unmeasured.append(sequence.name)
            return
        place = truth_path(folder, sequence.name, key)
        truth, tracks = read_truth(place), read_tracks(path)
        if len(truth.visible) != len(tracks.boxes):
            cut = place if len(truth.visible) < len(tracks.boxes) else path
            raise DatasetError(
                f'{cut} was cut off: {place} has {len(truth.visible)} frames, {path} '
                f'{len(tracks.boxes)}'
            )
    size = int(meta['image_size'][0]), int(meta['image_size'][1])
    own = dict(sequence.categories)
    collected.infos[sequence.name] = Info(
        sequence.name,
        sequence.scenario,
        sequence.kind,
        own or derive(truth, size, sequence.scenario),
        not own,
        size,
        float(meta['thumbnail_scale']),
        truth.body is not None,
        key,
        sequence.recording,
    )
    frames = compare(tracks.boxes, truth.visible, truth.body, tracks.scores, skip=0)
    collected.results.append(
        Result(contender.name, sequence.name, truth.stamps_ns, frames, truth.fraction, truth.judged)
    )
    if meta.get('places'):
        collected.places[contender.name, sequence.name] = [
            Place(bool(hidden), bool(astray), *(math.nan if v is None else v for v in numbers))
            for hidden, astray, *numbers in meta['places']
        ]
    if 'short_term' in meta:
        run = meta['short_term']
        overlaps = np.array(run['run_overlaps'], np.float64)
        codes = np.array(run['run_codes'], np.int64)
        collected.short_term[contender.name, sequence.name] = ShortTermRun(codes, overlaps)


def write_per_frame(path: Path, results: Iterable[Result]) -> None:
    """Write the file; numbers to six digits, empty cells where there is none."""
    with (
        moved_into_place(path) as temporary,
        temporary.open('w', encoding='utf-8', newline='') as file,
    ):
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(HEADER)
        for r in results:
            f = r.frames
            ratio = f.ratio
            for i, stamp in enumerate(r.stamps_ns):
                numbers = (f.overlap[i], *f.offset[i], ratio[i], f.score[i], r.fraction[i])
                writer.writerow(
                    (
                        r.tracker, r.sequence, i, stamp, int(f.there[i]), int(f.said[i]),
                        *('' if math.isnan(v) else f'{v:.6g}' for v in numbers),
                        int(r.judged[i]),
                    )
                )  # fmt: skip


def read_per_frame(path: Path) -> list[Result]:
    """Read the file back.

    Raises:
        DatasetError: naming the line that is none.
    """
    results: list[Result] = []
    try:
        with path.open(encoding='utf-8', newline='') as file:
            reader = csv.reader(file)
            if tuple(next(reader, ())) != HEADER:
                raise DatasetError(f'{path}, line 1: the header must be {",".join(HEADER)}')
            # One run after the other, so that the text of only one is held.
            for _, own in itertools.groupby(_checked(reader, path), key=lambda row: row[:2]):
                results.append(_result(path, list(own)))
    except OSError as error:
        raise DatasetError(f'{path} cannot be read: {error.strerror or error}') from None
    return results


def _checked(rows: Iterable[list[str]], path: Path) -> Iterator[list[str]]:
    for number, row in enumerate(rows, start=2):
        if len(row) != len(HEADER):
            raise DatasetError(f'{path}, line {number}: {len(row)} cells, not {len(HEADER)}')
        yield row


def _result(path: Path, rows: list[list[str]]) -> Result:
    tracker, sequence = rows[0][:2]
    try:
        stamps = tuple(int(row[3]) for row in rows)
        table = np.array([[float(v) if v else np.nan for v in row[4:]] for row in rows])
    except ValueError as error:
        raise DatasetError(f'{path}, {tracker} on {sequence}: {error}') from None
    frames = Comparison(
        said=table[:, 1] == 1,
        there=table[:, 0] == 1,
        overlap=table[:, 2],
        offset=table[:, 3:5],
        score=table[:, 6],
    )
    return Result(tracker, sequence, stamps, frames, table[:, 7], table[:, 8] != 0)
