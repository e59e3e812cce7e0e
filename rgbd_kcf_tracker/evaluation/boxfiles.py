# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Boxes that another tracker left in files, in the forms that benchmarks publish them.

- ours: the CSV of ``rgbd-kcf track``;
- plain: ``x,y,width,height[,score]`` per line, in the data set's own pixel coordinates;
- Princeton: ``x1,y1,x2,y2,state`` per line, for Princeton's sequences;
- VOT: a region per line, ``1`` where it was started, with ``NAME_confidence.value`` beside it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence as Items
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.datasets.base import Opened, Sequence
from rgbd_kcf_tracker.evaluation.datasets.vot import parse_region
from rgbd_kcf_tracker.evaluation.store import read_tracks, slug
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.messages import LARGEST
from rgbd_kcf_tracker.recordings.textfiles import box_of_region, box_or_none, read_lines
from rgbd_kcf_tracker.track import Track, TrackState

_SUFFIXES = ('.csv', '.txt')


def find_file(pattern: str, sequence: Sequence) -> Path:
    """The file of a sequence's boxes.

    Args:
        pattern: a path with ``{sequence}`` in it, or a folder that holds ``SEQUENCE.csv``,
            ``SEQUENCE.txt`` or the VOT toolkit's ``SEQUENCE/SEQUENCE_001.txt``.
        sequence: whose name is looked for, slashes as they are or as underscores.

    Raises:
        DatasetError: where there is no such file, naming those that were tried.
    """
    names = list(dict.fromkeys((sequence.name, slug(sequence.name))))
    if '{sequence}' in pattern:
        tried = [Path(pattern.replace('{sequence}', name)) for name in names]
    else:
        folder = Path(pattern)
        tried = [folder / f'{name}{suffix}' for name in names for suffix in _SUFFIXES]
        tried += [folder / name / f'{name}_001.txt' for name in names]
    for path in tried:
        if path.is_file():
            return path
    raise DatasetError(
        f'no boxes for {sequence.name}: tried {", ".join(map(str, tried))}; '
        'name their folder, or a path with {sequence} in it'
    )


def read(path: Path, sequence: Sequence, opened: Opened, numbers: Items[int]) -> list[Track]:
    """One track per frame that is measured.

    Args:
        path: of the boxes.
        sequence: gives the kind and the origin of pixel coordinates.
        opened: gives the length of the recording.
        numbers: those of the measured frames in the recording, from 0.

    Raises:
        DatasetError: naming file and line where a line is no box or there are too few or too many.
    """
    rows = _read_rows(path, sequence)
    frames = len(numbers)
    total = opened.length if opened.total is None else opened.total
    if len(rows) == total and total != frames:
        rows = [rows[number] for number in numbers]
    if len(rows) != frames:
        line = min(len(rows), frames) + (2 if _is_ours(path) else 1)
        wanted = f'{frames}' if total in (None, frames) else f'{frames} or {total}'
        raise DatasetError(
            f'{path}, line {line}: {len(rows)} boxes for {sequence.name}, which has {wanted} '
            'frames: give one line per frame'
        )
    tracks = [
        Track(box, TrackState.TRACKING, score) if box else Track(None, TrackState.OCCLUDED)
        for box, score in rows
    ]
    return tracks


def _is_ours(path: Path) -> bool:
    lines = read_lines(path)
    return bool(lines) and lines[0].startswith('frame,')


def _read_rows(path: Path, sequence: Sequence) -> list[tuple[Box | None, float]]:
    lines = read_lines(path)
    if lines and lines[0].startswith('frame,'):
        tracks = read_tracks(path)
        return [
            (box_or_none(*box), 1.0 if math.isnan(score) else float(score))
            for box, score in zip(tracks.boxes.tolist(), tracks.scores, strict=True)
        ]
    scores = _confidence(path, len(lines))
    rows: list[tuple[Box | None, float]] = []
    for number, line in enumerate(lines, start=1):
        try:
            box, score = _parse(line.strip(), sequence)
        except ValueError:
            raise DatasetError(
                f'{path}, line {number}: {line.strip()[:60]!r} is no box: write x,y,width,height '
                f'(nan,nan,nan,nan where absent), at most {LARGEST:.0f} pixels'
            ) from None
        known = scores is not None and not np.isnan(scores[number - 1])
        rows.append((box, float(scores[number - 1]) if scores is not None and known else score))
    return rows


def _parse(line: str, sequence: Sequence) -> tuple[Box | None, float]:
    values = [] if line.startswith('m') else [float(v) for v in re.split(r'[,;\s]+', line)]
    if len(values) != 5:
        box = parse_region(line)
        return (None if box is None else box.moved(-sequence.origin, -sequence.origin)), 1.0
    a, b, c, d, last = values
    if sequence.kind == 'princeton':  # two corners, and whether the target is hidden
        return box_of_region([a, b, c - a, d - b]), 1.0
    box = box_of_region([a - sequence.origin, b - sequence.origin, c, d])
    return box, 1.0 if math.isnan(last) else last


def _confidence(path: Path, lines: int) -> list[float] | None:
    beside = path.with_name(f'{path.stem}_confidence.value')
    if not beside.is_file():
        return None
    values = []
    for number, line in enumerate(read_lines(beside), start=1):
        try:
            values.append(float(line) if line.strip() else math.nan)
        except ValueError:
            raise DatasetError(f'{beside}, line {number}: {line[:60]!r} is no number') from None
    if len(values) != lines:
        raise DatasetError(
            f'{beside}, line {min(len(values), lines) + 1}: {len(values)} scores for the {lines} '
            f'lines of {path.name}'
        )
    return values
