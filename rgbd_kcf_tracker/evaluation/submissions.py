# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Results in the forms that Princeton's server and the VOT toolkit take."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.recordings.outputs import write_atomically


def write_princeton(path: Path, boxes: FloatArray) -> None:
    """One line per frame: ``x1,y1,x2,y2,state``; ``NaN,NaN,NaN,NaN,1`` where the target is hidden.

    Corners are those of the box in the data set's coordinates, right and bottom exclusive, so that
    width and height come back as they were.
    """
    lines = []
    for x, y, width, height in boxes:
        if np.isnan(x):
            lines.append('NaN,NaN,NaN,NaN,1')
        else:
            lines.append(f'{x:.3f},{y:.3f},{x + width:.3f},{y + height:.3f},0')
    write_atomically(path, '\n'.join(lines) + '\n')


def write_vot(
    folder: Path,
    sequence: str,
    boxes: FloatArray,
    scores: FloatArray,
    milliseconds: Sequence[float],
    codes: Sequence[int] | None = None,
) -> None:
    """``SEQUENCE/SEQUENCE_001.txt`` with the toolkit's ``_confidence.value`` and ``_time.value``.

    Args:
        folder: of one tracker and experiment, for instance ``results/metric/longterm``.
        sequence: its name in the data set.
        boxes: ``(N, 4)``; NaN (no box) is written as the code 0. The first frame is the start, 1.
        scores: ``(N,)``, 0 without a box.
        milliseconds: time of each update; written in seconds.
        codes: of a run with re-initialisation: 0, 1 and 2 replace the box.
    """
    lines = []
    for index, box in enumerate(boxes):
        code = codes[index] if codes is not None else (1 if index == 0 else 3)
        if code in (0, 1, 2):
            lines.append(str(int(code)))
        elif np.isnan(box[0]):
            lines.append('0')
        else:
            lines.append(','.join(f'{v:.3f}' for v in box))
    stem = f'{sequence}_001'
    place = folder / sequence
    confidence = np.nan_to_num(scores, nan=0.0)
    write_atomically(place / f'{stem}_confidence.value', _column(confidence.tolist()))
    write_atomically(place / f'{stem}_time.value', _column([ms / 1000 for ms in milliseconds]))
    write_atomically(place / f'{stem}.txt', '\n'.join(lines) + '\n')


def _column(values: Sequence[float]) -> str:
    return '\n'.join(f'{v:.6f}' for v in values) + '\n'
