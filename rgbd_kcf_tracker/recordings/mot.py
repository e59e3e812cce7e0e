# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""MOT Challenge text: who is where in each frame, as ground truth and as a tracker's answer.

A line is ``frame,id,x,y,width,height,score,X,Y,Z``: frames from 1, pixels of the colour image as
everywhere here, metres in the camera's optical frame, -1 where unknown. Ground truth of MOT16 and
later has nine cells, ``frame,id,x,y,width,height,counts,class,visible share``.

Source: Leal-Taixe et al., "MOTChallenge 2015: Towards a Benchmark for Multi-Target Tracking", 2015;
Milan et al., "MOT16: A Benchmark for Multi-Object Tracking", 2016.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.outputs import FrameWriter, OutputFile
from rgbd_kcf_tracker.recordings.textfiles import read_lines
from rgbd_kcf_tracker.track import Track

Integers = npt.NDArray[np.int64]

MOT_FILE = 'mot.txt'
"""In a folder with a sequence: everyone in it."""

REGION_ID = -1
"""In ground truth: the box is no person but a region in which nothing is judged."""

PEDESTRIAN = 1
"""MOT Challenge's class of people on foot; all others are not counted."""

LARGEST = 2**53 - 1
"""Number of a frame or a person: beyond, not every whole number is a double."""

BARELY_VISIBLE = 0.4
"""In ground truth, a person of whom less shows is neither hit nor miss: their score is 0."""

_UNKNOWN = -1.0
_SHAPE = 'frame,id,x,y,width,height,score[,X,Y,Z]'


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Boxes of people with ids, one row each, in the order of frames and then of ids.

    Attributes:
        frames: ``(N,)`` index of the frame, from 0.
        ids: ``(N,)`` who; :data:`REGION_ID` for a region.
        boxes: ``(N, 4)`` ``x, y, width, height`` in pixels.
        scores: ``(N,)`` the tracker's score; of ground truth, 0 where the row does not count.
        shares: ``(N,)`` visible share, 0 to 1, NaN where unknown.
        positions: ``(N, 3)`` metres in the camera's optical frame, NaN where unknown.
    """

    frames: Integers
    ids: Integers
    boxes: FloatArray
    scores: FloatArray
    shares: FloatArray
    positions: FloatArray

    @classmethod
    def of(
        cls,
        frames: npt.ArrayLike,
        ids: npt.ArrayLike,
        boxes: npt.ArrayLike,
        scores: npt.ArrayLike | None = None,
        shares: npt.ArrayLike | None = None,
        positions: npt.ArrayLike | None = None,
    ) -> Sightings:
        """Sightings from columns in any order; scores are 1 and the rest unknown by default."""
        number = np.asarray(frames, np.int64).reshape(-1)
        count = len(number)
        who = np.asarray(ids, np.int64).reshape(count)
        order = np.lexsort((who, number))

        def column(values: npt.ArrayLike | None, width: int, default: float) -> FloatArray:
            shape = (count, width) if width else (count,)
            if values is None:
                return np.full(shape, default)
            return np.asarray(values, np.float64).reshape(shape)[order]

        return cls(
            number[order], who[order], column(boxes, 4, math.nan), column(scores, 0, 1.0),
            column(shares, 0, math.nan), column(positions, 3, math.nan),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.frames)

    def only(self, rows: npt.NDArray[np.bool_] | Integers) -> Sightings:
        """The rows that a mask or indices choose."""
        return Sightings(
            self.frames[rows], self.ids[rows], self.boxes[rows],
            self.scores[rows], self.shares[rows], self.positions[rows],
        )  # fmt: skip

    def box(self, row: int) -> Box:
        """The box of a row."""
        return Box(*self.boxes[row].tolist())


def read_mot(path: Path, length: int | None = None, regions: bool = False) -> Sightings:
    """Read MOT Challenge text.

    Args:
        path: of the file.
        length: number of frames of the recording, where it is known.
        regions: ground truth: rows with the id -1 are taken, as regions in which nothing is judged.

    Raises:
        RecordingError: naming file and line, for a line that is no sighting, a frame that the
            recording does not have, or an id that is twice in a frame.
    """
    rows: list[tuple[float, ...]] = []
    seen: dict[tuple[int, int], int] = {}
    for number, line in enumerate(read_lines(path), start=1):
        place = f'{path}, line {number}'
        row = _parse(place, line)
        frame, who = int(row[0]), int(row[1])
        if length is not None and frame >= length:
            raise RecordingError(
                f'{place}: frame {frame + 1}, but the recording has {length} frames'
            )
        if who == REGION_ID and not regions:
            raise RecordingError(f'{place}: id -1: these are detections; give each person an id')
        if who != REGION_ID:
            first = seen.setdefault((frame, who), number)
            if first != number:
                raise RecordingError(
                    f'{place}: id {who} is in frame {frame + 1} already, by line {first}'
                )
        rows.append(row)
    table = np.array(rows, np.float64).reshape(len(rows), 11)
    return Sightings.of(
        table[:, 0], table[:, 1], table[:, 2:6], table[:, 6], table[:, 7], table[:, 8:11]
    )


def _parse(place: str, line: str) -> tuple[float, ...]:
    """``frame from 0, id, x, y, width, height, score, share, X, Y, Z`` of a line."""
    cells = re.split(r'[,;\s]+', line.strip().strip(',;'))
    shown = repr(line.strip()[:60])
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        values = []
    if len(values) not in (7, 8, 9, 10):
        raise RecordingError(f'{place}: {shown} is no sighting: write {_SHAPE}')
    if not all(map(math.isfinite, values)):
        raise RecordingError(f'{place}: {shown}: a number is not finite; leave absent people out')
    frame, who, x, y, width, height, score = values[:7]
    if not (frame.is_integer() and 1 <= frame <= LARGEST):
        raise RecordingError(f'{place}: frame {cells[0]}: write whole numbers from 1 to {LARGEST}')
    if not (who.is_integer() and REGION_ID <= who <= LARGEST):
        raise RecordingError(f'{place}: id {cells[1]}: write whole numbers from 0 to {LARGEST}')
    if width <= 0 or height <= 0:
        raise RecordingError(f'{place}: a box of {width:g} x {height:g} pixels has no size')
    if max(abs(x), abs(y), width, height) > LARGEST:
        raise RecordingError(f'{place}: {shown}: the box is beyond {LARGEST} pixels')
    share = math.nan
    position = [math.nan] * 3
    if len(values) == 9:
        share = values[8]
        if values[7] != PEDESTRIAN:
            score = 0.0
    elif len(values) == 10 and values[7:] != [_UNKNOWN] * 3:
        position = values[7:]
    return frame - 1, who, x, y, width, height, score, share, *position


class MotWriter(FrameWriter):
    """Writes a tracker's answers as MOT Challenge text, each frame as it comes.

    A run that is interrupted leaves all frames up to then.

    Args:
        path: the file.
        overwrite: replace a file that is there.

    Raises:
        RecordingError: where it cannot be written, or is there already.
    """

    def __init__(self, path: str | os.PathLike[str], overwrite: bool = False) -> None:
        self.output = OutputFile(path, overwrite)

    def write_tracks(self, number: int, tracks: Mapping[int, Track]) -> None:
        """Write the boxes of frame ``number``, from 0; targets without a box have no line.

        Raises:
            RecordingError: where it cannot be written.
        """
        self.output.write(''.join(_track_lines(number, tracks)).encode())

    def close(self, whole: bool = True) -> None:
        """Close the file. One without a line stays: nobody was seen.

        Args:
            whole: all frames are written: only then does it replace another.

        Raises:
            RecordingError: where it cannot be written.
        """
        self.output.end(whole=whole, anything=True)


def mot_text(sightings: Sightings) -> str:
    """Rows as MOT Challenge text, without their visible shares."""
    s = sightings
    return ''.join(
        _format(int(f), int(i), b, c, None if math.isnan(p[0]) else p)
        for f, i, b, c, p in zip(
            s.frames, s.ids, s.boxes.tolist(), s.scores.tolist(), s.positions.tolist(),
            strict=True,
        )
    )  # fmt: skip


def _track_lines(number: int, tracks: Mapping[int, Track]) -> Iterator[str]:
    for who, track in sorted(tracks.items()):
        if track.box is not None:
            score = _UNKNOWN if math.isnan(track.score) else track.score
            yield _format(number, who, track.box.as_tuple(), score, track.position)


def _format(
    number: int, who: int, box: Iterable[float], score: float, position: Iterable[float] | None
) -> str:
    x, y, width, height = box
    cells = [
        *(_short(v, 3) for v in (x, y)),
        *(_size(v) for v in (width, height)),
        _short(score, 4),
        *(_short(v, 4) for v in ((_UNKNOWN,) * 3 if position is None else position)),
    ]
    return f'{number + 1},{who},{",".join(cells)}\n'


def _size(value: float) -> str:
    """Rounded as all else, but never to 0, which is no size and would be refused when read."""
    text = _short(value, 3)
    return repr(value) if text == '0' else text


def _short(value: float, digits: int) -> str:
    text = f'{value:.{digits}f}'.rstrip('0').rstrip('.')
    return '0' if text == '-0' else text
