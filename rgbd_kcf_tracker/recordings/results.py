# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A tracker's answers as a CSV file, a row per frame."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from types import TracebackType
from typing import TextIO

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.track import Track

HEADER = ('frame', 'stamp_ns', 'x', 'y', 'width', 'height', 'state', 'score', 'depth_m')


class TrackCsvWriter:
    """Writes ``frame,stamp_ns,x,y,width,height,state,score,depth_m``, each row as it comes.

    Boxes are in pixels with four decimals, score from 0 to 1, depth in metres; cells are empty
    where there is no box. A run that is interrupted leaves all rows up to then.

    Args:
        path: the file; ``-`` for standard output. Missing folders are made.

    Raises:
        RecordingError: where it cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = os.fspath(path)
        self._file: TextIO = sys.stdout if self.path == '-' else open_for_writing(Path(path))
        self._write(','.join(HEADER))

    def write_track(self, number: int, stamp_ns: int, track: Track) -> None:
        """Write the row of frame ``number``.

        Raises:
            RecordingError: where it cannot be written.
        """
        self._write(','.join(track_cells(number, stamp_ns, track)))

    def close(self) -> None:
        """Close the file."""
        if self._file is not sys.stdout:
            self._file.close()

    def __enter__(self) -> TrackCsvWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _write(self, line: str) -> None:
        try:
            self._file.write(line + '\n')
            self._file.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise RecordingError(cannot_write(self.path, error)) from None


def track_cells(number: int, stamp_ns: int, track: Track) -> list[str]:
    """The cells of a row, one for each word of :data:`HEADER`."""
    cells = [str(number), str(stamp_ns), '', '', '', '', track.state.value, '', '']
    if track.box is not None:
        cells[2:6] = (f'{value:.4f}' for value in track.box.as_tuple())
        cells[7] = '' if math.isnan(track.score) else f'{track.score:.4f}'
        cells[8] = '' if track.depth is None else f'{track.depth:.4f}'
    return cells


def open_for_writing(path: Path) -> TextIO:
    """A text file to write, its folders made where they are missing.

    Raises:
        RecordingError: where it cannot be written.
    """
    prepare_output(path)
    try:
        return path.open('w', encoding='utf-8', newline='\n')
    except OSError as error:
        raise RecordingError(cannot_write(path, error)) from None


def prepare_output(path: Path) -> None:
    """Make the folder that ``path`` shall lie in.

    Raises:
        RecordingError: where that cannot be, or ``path`` is a folder itself.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(cannot_write(path, error)) from None
    if path.is_dir():
        raise RecordingError(f'{path} is a folder: give the name of a file')


def cannot_write(path: object, error: OSError) -> str:
    """The message for a failed write."""
    return f'{path} cannot be written: {error.strerror or error}'
