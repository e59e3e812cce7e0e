# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""H.264 video that plays everywhere, written by ffmpeg."""

from __future__ import annotations

import contextlib
import errno
import math
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import cast

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import MissingExtraError, RecordingError
from rgbd_kcf_tracker.extras import how_to_get
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.outputs import (
    FrameWriter,
    OutputFile,
    check_outputs,
    moved_into_place,
)
from rgbd_kcf_tracker.recordings.overlay import draw_track, draw_tracks
from rgbd_kcf_tracker.track import Track

SUFFIXES = ('.mp4', '.m4v', '.mov', '.mkv')

_SMALLEST_WIDTH, _LARGEST_HEIGHT = 640, 4096
_QUIET = ['-hide_banner', '-loglevel', 'error', '-y']
_DISK_ERRORS = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO})
"""Which ffmpeg may not put into words, but ends with, as 256 less their number."""
# In pieces of a second, each complete in itself: a full disk or a kill loses the last one alone.
_IN_PIECES = ['-movflags', '+empty_moov+default_base_moof', '-frag_duration', '1000000']
_IN_ONE = ['-c', 'copy', '-movflags', '+faststart']


def require_video(path: str | os.PathLike[str]) -> None:
    """Refuse a name of no video that is written, and a machine without ffmpeg.

    Raises:
        RecordingError: naming the suffixes.
        MissingExtraError: saying what to install.
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise RecordingError(f'{path} must end in {", ".join(SUFFIXES)}: these are written')
    _ffmpeg(Path(path))


class VideoWriter(FrameWriter):
    """Writes pictures as mp4 (H.264, yuv420p). The first picture sets the size.

    ffmpeg runs in a session of its own: when this program dies, even by kill -9, its input ends and
    it closes the file properly. The file grows in pieces that can be played while it does, and is
    put into one when it is closed, if the disk has room for that.

    Args:
        path: the file, ending in one of :data:`SUFFIXES`.
        fps: frames per second.
        overwrite: replace a file that is there.

    Attributes:
        output: the file.

    Raises:
        RecordingError: where it cannot be written, is there already, or ffmpeg is missing.
    """

    def __init__(
        self, path: str | os.PathLike[str], fps: float = 30.0, overwrite: bool = False
    ) -> None:
        self.path = Path(path)
        check_outputs({'video': self.path}, overwrite=overwrite)
        require_video(self.path)
        self.output = OutputFile(self.path, overwrite)
        self.output.file.close()  # ffmpeg opens it by its name
        self.fps = min(max(fps, 0.1), 240.0)
        self._process: subprocess.Popen[bytes] | None = None
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 (closed by close)
        self._size = 0, 0

    def write_track(
        self, frame: Frame, track: Track, truth: Box | None = None, caption: str = ''
    ) -> None:
        """Write a frame with the tracker's answer, and the truth as a thin line, drawn on it."""
        image, factor = _enlarged(frame)
        track = replace(track, box=_times(track.box, factor))
        self.write(draw_track(image, track, truth=_times(truth, factor), caption=caption))

    def write_tracks(self, frame: Frame, tracks: Mapping[int, Track], caption: str = '') -> None:
        """Write a frame with the boxes of several targets drawn on it."""
        image, factor = _enlarged(frame)
        larger = {who: replace(t, box=_times(t.box, factor)) for who, t in tracks.items()}
        self.write(draw_tracks(image, larger, caption=caption))

    def write(self, image: npt.NDArray[np.uint8]) -> None:
        """Write a ``(H, W, 3)`` uint8 BGR picture; one of another size is fitted into the first's.

        Raises:
            RecordingError: where ffmpeg cannot be run or stops.
        """
        height, width = image.shape[:2]
        if self._process is None:
            self._size = width, height
            self._process = self._start(width, height)
        if (width, height) != self._size:
            image = _fitted(image, self._size)
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(np.ascontiguousarray(image).data)
        except (BrokenPipeError, OSError):
            raise RecordingError(self._failure(self._process.wait())) from None

    def close(self, whole: bool = True) -> None:
        """End the video; one without a picture is removed.

        Args:
            whole: all pictures are written: only then does it replace another.

        Raises:
            RecordingError: where ffmpeg could not write it.
        """
        process, self._process = self._process, None
        failure = ''
        if process is not None:
            assert process.stdin is not None
            with contextlib.suppress(OSError):
                process.stdin.close()
            if process.wait() != 0:
                failure = self._failure(process.returncode)
        self._log.close()
        place = self.output.place
        anything = place.exists() and place.stat().st_size > 0
        if anything and not failure:
            self._put_together(place)
        self.output.end(whole=whole and not failure, anything=anything)
        if failure:
            raise RecordingError(failure)

    def _put_together(self, place: Path) -> None:
        """The pieces as one, the index first; where that fails, they stay as they are."""
        if place.suffix.lower() == '.mkv':
            return
        failures = RecordingError, subprocess.CalledProcessError
        with contextlib.suppress(*failures), moved_into_place(place) as one:
            subprocess.run(
                [_ffmpeg(self.path), *_QUIET, '-i', os.fspath(place), *_IN_ONE, os.fspath(one)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                check=True,
            )
            shutil.copymode(place, one)

    def _start(self, width: int, height: int) -> subprocess.Popen[bytes]:
        # yuv420p wants even sides.
        shape = 'pad=ceil(iw/2)*2:ceil(ih/2)*2'
        command = [
            _ffmpeg(self.path), *_QUIET,
            '-f', 'rawvideo', '-pix_fmt', 'bgr24', '-s', f'{width}x{height}', '-r', f'{self.fps:g}',
            '-i', '-', '-an', '-vf', shape, '-c:v', 'libx264', '-preset', 'veryfast', '-crf', '20',
            '-pix_fmt', 'yuv420p', *([] if self.path.suffix.lower() == '.mkv' else _IN_PIECES),
            os.fspath(self.output.place),
        ]  # fmt: skip
        try:
            return subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=self._log,
                start_new_session=True,
            )
        except OSError as error:
            raise RecordingError(f'{self.path} cannot be written: ffmpeg: {error}') from None

    def _failure(self, code: int) -> str:
        self._log.seek(0)
        lines = self._log.read().decode('utf-8', 'replace').strip().splitlines()
        # The first line tells the cause, behind the part of ffmpeg in brackets.
        said = lines[0].rpartition('] ')[2] if lines else ''
        if code == -signal.SIGXFSZ:
            said = os.strerror(errno.EFBIG)
        elif not said and 256 - code in _DISK_ERRORS:
            said = os.strerror(256 - code)
        return f'{self.path} cannot be written: ffmpeg says {said or f"nothing ({code})"!r}'


def _ffmpeg(path: Path) -> str:
    """The program of imageio-ffmpeg, or else the system's."""
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        found = shutil.which('ffmpeg')
    if found is None:
        raise MissingExtraError(f'{path} cannot be written without ffmpeg: {how_to_get("video")}')
    return found


def _enlarged(frame: Frame) -> tuple[npt.NDArray[np.uint8], int]:
    """The picture, and by how much it is enlarged: words and lines want more than a small one."""
    factor = min(math.ceil(_SMALLEST_WIDTH / frame.width), _LARGEST_HEIGHT // frame.height)
    factor = max(1, factor)
    if factor == 1:
        return frame.color, 1
    return cast(
        'npt.NDArray[np.uint8]', cv2.resize(frame.color, None, fx=factor, fy=factor)
    ), factor


def _times(box: Box | None, factor: int) -> Box | None:
    return None if box is None else box.stretched(factor, factor)


def _fitted(image: npt.NDArray[np.uint8], size: tuple[int, int]) -> npt.NDArray[np.uint8]:
    """``image`` scaled into ``(width, height)`` with black about it."""
    width, height = size
    factor = min(width / image.shape[1], height / image.shape[0])
    inner = max(1, round(image.shape[1] * factor)), max(1, round(image.shape[0] * factor))
    small = cv2.resize(image, inner, interpolation=cv2.INTER_AREA)
    out = np.zeros((height, width, 3), np.uint8)
    left, top = (width - inner[0]) // 2, (height - inner[1]) // 2
    out[top : top + inner[1], left : left + inner[0]] = small
    return out
