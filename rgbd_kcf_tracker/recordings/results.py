# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A tracker's answers as a CSV file, a row per frame, or per frame and target."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Mapping

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.outputs import FrameWriter, OutputFile, cannot_write
from rgbd_kcf_tracker.track import Track

HEADER = ('frame', 'stamp_ns', 'x', 'y', 'width', 'height', 'state', 'score', 'depth_m')


def row(number: int, stamp_ns: int, track: Track) -> str:
    """The line of frame ``number``; cells are empty where there is no box."""
    cells = [str(number), str(stamp_ns), '', '', '', '', track.state.value, '', '']
    if track.box is not None:
        cells[2:6] = (f'{value:.4f}' for value in track.box.as_tuple())
        cells[7] = '' if math.isnan(track.score) else f'{track.score:.4f}'
        cells[8] = '' if track.depth is None else f'{track.depth:.4f}'
    return ','.join(cells)


class TrackCsvWriter(FrameWriter):
    """Writes ``frame,stamp_ns,x,y,width,height,state,score,depth_m``, each row as it comes.

    Boxes are in pixels with four decimals, score from 0 to 1, depth in metres; cells are empty
    where there is no box. A run that is interrupted leaves all rows up to then.

    Args:
        path: the file; ``-`` for standard output.
        overwrite: replace a file that is there.

    Attributes:
        output: the file; None for standard output.

    Raises:
        RecordingError: where it cannot be written, or is there already.
    """

    _header = ','.join(HEADER)

    def __init__(self, path: str | os.PathLike[str], overwrite: bool = False) -> None:
        self.output = None if os.fspath(path) == '-' else OutputFile(path, overwrite)
        self._frames = 0
        try:
            self._write(self._header)
        except BaseException:
            self.close(whole=False)
            raise

    def write_track(self, number: int, stamp_ns: int, track: Track) -> None:
        """Write the row of frame ``number``.

        Raises:
            RecordingError: where it cannot be written.
        """
        self._write(row(number, stamp_ns, track))
        self._frames += 1

    def close(self, whole: bool = True) -> None:
        """Close the file; one of no frame is removed.

        Args:
            whole: all rows are written: only then does it replace another.

        Raises:
            RecordingError: where it cannot be written.
        """
        if self.output is not None:
            self.output.end(whole=whole, anything=self._frames > 0)

    def _write(self, line: str) -> None:
        if self.output is not None:
            self.output.write(line.encode() + b'\n')
            return
        try:
            sys.stdout.write(line + '\n')
            sys.stdout.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise RecordingError(cannot_write('standard output', error)) from None


class TracksCsvWriter(TrackCsvWriter):
    """Writes the same of several targets: ``id`` comes first, and a row per frame and target."""

    _header = ','.join(('id', *HEADER))

    def write_tracks(self, number: int, stamp_ns: int, tracks: Mapping[int, Track]) -> None:
        """Write the rows of frame ``number``, in the order of ids.

        Raises:
            RecordingError: where it cannot be written.
        """
        for who, track in sorted(tracks.items()):
            self._write(f'{who},{row(number, stamp_ns, track)}')
        self._frames += 1
