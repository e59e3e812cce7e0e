# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""H.264 video that plays everywhere, written by the ffmpeg of imageio-ffmpeg."""

from __future__ import annotations

import contextlib
import math
import os
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import cast

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.overlay import draw_track, draw_tracks
from rgbd_kcf_tracker.recordings.results import cannot_write, prepare_output
from rgbd_kcf_tracker.track import Track

_SMALLEST_WIDTH = 640


class VideoWriter:
    """Writes pictures as mp4 (H.264, yuv420p). The first picture sets the size.

    ffmpeg runs in a session of its own: when this program dies, even by kill -9, its input ends and
    it closes the file properly.

    Args:
        path: the file, ending in ``.mp4`` or another suffix that ffmpeg knows. Missing folders are
            made.
        fps: frames per second.

    Raises:
        RecordingError: where it cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], fps: float = 30.0) -> None:
        self.path = Path(path)
        self.fps = min(max(fps, 0.1), 240.0)
        self._process: subprocess.Popen[bytes] | None = None
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 (closed by close)
        self._size = 0, 0
        prepare_output(self.path)
        try:
            self.path.open('ab').close()
        except OSError as error:
            raise RecordingError(cannot_write(self.path, error)) from None

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
            self._process.wait()
            raise RecordingError(self._failure()) from None

    def close(self) -> None:
        """End the video.

        Raises:
            RecordingError: where ffmpeg could not write it.
        """
        process, self._process = self._process, None
        if process is None:
            self._log.close()
            # Without a single picture there is no video: leave no empty file.
            with contextlib.suppress(OSError):
                if self.path.stat().st_size == 0:
                    self.path.unlink()
            return
        assert process.stdin is not None
        with contextlib.suppress(OSError):
            process.stdin.close()
        if process.wait() != 0:
            message = self._failure()
            self._log.close()
            raise RecordingError(message)
        self._log.close()

    def __enter__(self) -> VideoWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self.close()
        else:
            with contextlib.suppress(RecordingError):
                self.close()

    def _start(self, width: int, height: int) -> subprocess.Popen[bytes]:
        try:
            import imageio_ffmpeg

            program = imageio_ffmpeg.get_ffmpeg_exe()
        except (ImportError, RuntimeError) as error:
            raise RecordingError(
                f'{self.path} cannot be written: no ffmpeg ({error}); install imageio-ffmpeg'
            ) from None
        # yuv420p wants even sides.
        shape = 'pad=ceil(iw/2)*2:ceil(ih/2)*2'
        command = [
            program, '-hide_banner', '-loglevel', 'error', '-y',
            '-f', 'rawvideo', '-pix_fmt', 'bgr24', '-s', f'{width}x{height}', '-r', f'{self.fps:g}',
            '-i', '-', '-an', '-vf', shape, '-c:v', 'libx264', '-preset', 'veryfast', '-crf', '20',
            '-pix_fmt', 'yuv420p', '-movflags', '+faststart', os.fspath(self.path),
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

    def _failure(self) -> str:
        self._log.seek(0)
        lines = self._log.read().decode('utf-8', 'replace').strip().splitlines()
        return f'{self.path} cannot be written: ffmpeg says {lines[-1] if lines else "nothing"!r}'


def _enlarged(frame: Frame) -> tuple[npt.NDArray[np.uint8], int]:
    """The picture, and by how much it is enlarged: words and lines want more than a small one."""
    factor = max(1, math.ceil(_SMALLEST_WIDTH / frame.width))
    if factor == 1:
        return frame.color, 1
    return cast(
        'npt.NDArray[np.uint8]', cv2.resize(frame.color, None, fx=factor, fy=factor)
    ), factor


def _times(box: Box | None, factor: int) -> Box | None:
    if box is None:
        return None
    return Box(*(factor * value for value in box.as_tuple()))


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
