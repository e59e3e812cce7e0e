# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a run leaves on the disk: one file of tracks per tracker and sequence, one of truth.

Every file is written whole under another name and then moved into place, so that an interrupted run
leaves only good files, and goes on where it stopped.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.errors import DatasetError, RecordingError, RgbdKcfError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.files import cannot_read, open_text, read_text
from rgbd_kcf_tracker.recordings.outputs import write_atomically
from rgbd_kcf_tracker.recordings.results import HEADER
from rgbd_kcf_tracker.recordings.results import row as track_row
from rgbd_kcf_tracker.recordings.textfiles import box_or_none
from rgbd_kcf_tracker.track import Track

TRUTH_HEADER = (
    'frame', 'stamp_ns', 'x', 'y', 'width', 'height',
    'body_x', 'body_y', 'body_width', 'body_height', 'visible_fraction', 'judged',
)  # fmt: skip


MENDED_BY = 'delete the file and run again'
"""What mends a damaged file of a run: what is not there is made anew."""


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """A tracker's answers to ``N`` frames: boxes ``(N, 4)``, states, scores ``(N,)``."""

    boxes: FloatArray
    states: tuple[str, ...]
    scores: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What is true of one sequence.

    Attributes:
        stamps_ns: one per frame.
        visible: ``(N, 4)``, NaN where absent.
        body: ``(N, 4)`` or None where not known.
        fraction: ``(N,)`` visible share, NaN where unknown.
        judged: ``(N,)`` False where the truth leaves open what is right.
    """

    stamps_ns: tuple[int, ...]
    visible: FloatArray
    body: FloatArray | None
    fraction: FloatArray
    judged: Mask


@contextmanager
def left_by_a_run() -> Iterator[None]:
    """Errors of reading inside are of files that a run left, and say what to do with them.

    Raises:
        DatasetError: for each.
    """
    try:
        yield
    except RgbdKcfError as error:
        raise DatasetError(f'{error}: {MENDED_BY}') from None


def slug(name: str) -> str:
    """A name as a file's: other characters than letters, digits, dots and dashes replaced.

    Letters of any script stay, with the marks that belong to them.
    """
    kept = (c if c in '.=-' or unicodedata.category(c)[0] in 'LMN' else '_' for c in name)
    return re.sub('_+', '_', ''.join(kept)).strip('._') or '_'


def write_json(path: Path, value: Any, indent: int | None = None) -> None:
    """JSON with NaN as null."""
    write_atomically(path, json.dumps(_plain(value), indent=indent, allow_nan=False) + '\n')


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object.

    Raises:
        DatasetError: where it cannot be read.
    """
    try:
        value = json.loads(read_text(path))
    except RecordingError as error:
        raise DatasetError(str(error)) from None
    except (RecursionError, ValueError):
        raise DatasetError(f'{path} is no JSON') from None
    if not isinstance(value, dict):
        raise DatasetError(f'{path} holds no JSON object')
    return value


def was_made_as(path: Path, key: str) -> bool:
    """Whether the JSON beside a result says that it was made so; False where there is none."""
    try:
        return bool(read_json(path).get('key') == key)
    except DatasetError:
        return False


def write_tracks(path: Path, stamps_ns: Sequence[int], tracks: Sequence[Track]) -> None:
    """One row per frame, as ``rgbd-kcf track --output`` writes them."""
    pairs = zip(stamps_ns, tracks, strict=True)
    rows = [track_row(i, stamp, track) for i, (stamp, track) in enumerate(pairs)]
    write_atomically(path, '\n'.join([','.join(HEADER), *rows]) + '\n')


def read_tracks(path: Path) -> Tracks:
    """A file of tracks.

    Raises:
        DatasetError: naming the line that is none.
    """
    rows = _rows(path, HEADER[:8])
    boxes, scores, states = np.full((len(rows), 4), np.nan), np.full(len(rows), np.nan), []
    for index, row in enumerate(rows):
        try:
            boxes[index] = [_number(row[k]) for k in ('x', 'y', 'width', 'height')]
            scores[index] = _number(row['score'])
            box_or_none(*boxes[index])  # half a box is none
        except ValueError:
            raise DatasetError(
                f'{path}, line {index + 2}: a cell is no number, or a box lacks one'
            ) from None
        states.append(row['state'])
    return Tracks(boxes, tuple(states), scores)


def write_truth(
    path: Path,
    stamps_ns: Sequence[int],
    visible: Sequence[Box | None],
    body: Sequence[Box | None] | None,
    fraction: Sequence[float | None],
    judged: Sequence[bool],
) -> None:
    """One row per frame; empty cells where there is nothing."""
    whole = body if body is not None else [None] * len(visible)
    rows = [
        (i, stamp, *_cells(v), *_cells(b), '' if f is None else f'{f:.4f}', int(j))
        for i, (stamp, v, b, f, j) in enumerate(
            zip(stamps_ns, visible, whole, fraction, judged, strict=True)
        )
    ]
    write_atomically(path, _csv(TRUTH_HEADER, rows))


def read_truth(path: Path) -> Truth:
    """A file of truth.

    Raises:
        DatasetError: naming the line that is none.
    """
    rows = _rows(path, TRUTH_HEADER)
    try:
        table = np.array(
            [[_number(row[k]) for k in TRUTH_HEADER[2:]] for row in rows], np.float64
        ).reshape(len(rows), len(TRUTH_HEADER) - 2)
        stamps = tuple(int(row['stamp_ns']) for row in rows)
    except (TypeError, ValueError):  # TypeError: the row ends before its stamp
        raise DatasetError(f'{path}: a cell is no number') from None
    body = table[:, 4:8]
    whole = None if np.isnan(body).all() else body
    return Truth(stamps, table[:, :4], whole, table[:, 8], table[:, 9] != 0)


def _csv(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


def _rows(path: Path, needed: Sequence[str]) -> list[dict[str, str]]:
    try:
        with open_text(path) as file:
            reader = csv.DictReader(file)
            missing = [name for name in needed if name not in (reader.fieldnames or ())]
            if missing:
                raise DatasetError(f'{path}, line 1: the header lacks {", ".join(missing)}')
            return list(reader)
    except OSError as error:
        raise DatasetError(cannot_read(path, error)) from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise DatasetError(f'{path} is no CSV: {error}') from None


def _cells(box: Box | None) -> tuple[str, ...]:
    return ('',) * 4 if box is None else tuple(f'{v:.3f}' for v in box.as_tuple())


def _number(text: str | None) -> float:
    return float(text) if text else math.nan


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (np.integer, np.floating)):
        value = value.item()
    if isinstance(value, float):
        return round(value, 6) if math.isfinite(value) else None
    return value
