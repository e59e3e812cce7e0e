# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Frames written as a sequence folder."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Mapping
from io import FileIO
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy.typing as npt

from rgbd_kcf_tracker.errors import ParameterError, RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.camera_info import model_of
from rgbd_kcf_tracker.recordings.encoding import millimetres
from rgbd_kcf_tracker.recordings.mot import BARELY_VISIBLE, MOT_FILE, Sightings, mot_text
from rgbd_kcf_tracker.recordings.outputs import FrameWriter, OutputFolder, cannot_write, part_of
from rgbd_kcf_tracker.recordings.textfiles import (
    CAMERA_INFO,
    INTRINSICS,
    LAST_STAMP_NS,
    format_box,
)

_FILES = (
    'rgb',
    'depth',
    INTRINSICS,
    CAMERA_INFO,
    'timestamps.txt',
    'groundtruth.txt',
    'groundtruth_body.txt',
    'visible.txt',
    MOT_FILE,
    'groundtruth_*.txt',
    'body_*.txt',
    'visible_*.txt',
)


class PersonTruth(Protocol):
    """Where one of several people is in a frame."""

    @property
    def shown(self) -> Box | None:
        """Box of all that shows, however little."""

    @property
    def visible(self) -> Box | None:
        """Box of the visible part, None where the person counts as absent."""

    @property
    def body(self) -> Box | None:
        """Box of the whole body."""

    @property
    def visible_fraction(self) -> float:
        """Visible share, 0 to 1."""

    @property
    def position(self) -> tuple[float, float, float]:
        """In the camera's optical frame, metres."""


class SequenceWriter(FrameWriter):
    """Writes ``rgb/``, ``depth/`` (16-bit PNG, millimetres) and the text files beside them.

    Lines are written with their images, so a run that is interrupted or killed leaves a sequence
    that can be read; one that was to replace another leaves it beside that.

    Args:
        folder: is made; it may be there, but must be empty.
        color_format: 'png', or 'jpg' where size matters more than the last bit.
        overwrite: replace a sequence that is there.

    Attributes:
        output: the folder.

    Raises:
        RecordingError: where it cannot be written, or holds something already.
        ParameterError: for another format.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        color_format: str = 'png',
        overwrite: bool = False,
    ) -> None:
        if color_format not in ('png', 'jpg'):
            raise ParameterError(f'colour format is {color_format!r}: choose png or jpg')
        self.output = OutputFolder(folder, _FILES, overwrite)
        self._suffix = color_format
        self._files: dict[str, FileIO] = {}
        self._count = 0
        self._closed = False
        self._make('rgb')

    def write(
        self,
        frame: Frame,
        visible: Box | None = None,
        body: Box | None = None,
        visible_fraction: float | None = None,
        people: Mapping[int, PersonTruth] | None = None,
    ) -> None:
        """Write a frame and what is true of it.

        A person ``7`` gets a line in ``groundtruth_7.txt``, ``body_7.txt`` and ``visible_7.txt``
        (visible share, distance in millimetres); who shows gets one in ``mot.txt``, MOT Challenge
        text, with the box of what shows and the score 0 where less than
        :data:`~rgbd_kcf_tracker.recordings.mot.BARELY_VISIBLE` of the person shows, else 1.

        Args:
            frame: the next frame.
            visible: box of the visible part, None where absent.
            body: box of the whole body, None where not known.
            visible_fraction: visible share, 0 to 1; written where it is given.
            people: everybody by id, the same ids with every frame; None where it is not known.

        Raises:
            RecordingError: where it cannot be written.
        """
        if self._closed:
            raise RecordingError(f'{self.output.path} is closed: nothing more can be written to it')
        if not 0 <= frame.stamp_ns < LAST_STAMP_NS:
            raise RecordingError(
                f'{self.output.path} cannot hold the stamp {frame.stamp_ns} ns: '
                f'timestamps.txt takes 0 to {LAST_STAMP_NS - 1}'
            )
        name = f'{self._count + 1:06d}'
        sizes = {key: file.tell() for key, file in self._files.items()}
        images: dict[str, Path] = {}
        try:
            self._write_image(images, f'rgb/{name}.{self._suffix}', frame.color)
            if frame.depth is not None:
                self._make('depth')
                self._write_image(images, f'depth/{name}.png', millimetres(frame.depth))
            if self._count == 0 and frame.intrinsics is not None:
                self._write_camera(frame, frame.intrinsics)
            self._write_line('groundtruth.txt', format_box(visible))
            self._write_line('groundtruth_body.txt', format_box(body))
            if visible_fraction is not None:
                self._write_line('visible.txt', f'{visible_fraction:.4f}')
            if people is not None:
                self._write_people(people)
            # Last what makes it a frame, so that a kill leaves all of it or none.
            self._write_line('timestamps.txt', str(frame.stamp_ns))
            for image, part in images.items():
                self._show(image, part)
        except BaseException:
            self._take_back(images, sizes)
            raise
        self._count += 1

    def close(self, whole: bool = True) -> None:
        """Close the files; a folder without a frame is removed.

        Args:
            whole: all frames are written: only then does it replace another.

        Raises:
            RecordingError: where it cannot be written.
        """
        self._closed = True
        files, self._files = self._files, {}
        for file in files.values():
            with contextlib.suppress(OSError):  # a full disk was told when it was written
                file.close()
        self.output.end(whole=whole, anything=self._count > 0)

    def _write_camera(self, frame: Frame, camera: Intrinsics) -> None:
        """``intrinsics.json``, or ``camera_info.json`` where it has a lens."""
        if camera.lens is None:
            values = {k: getattr(camera, k) for k in ('fx', 'fy', 'cx', 'cy')}
            self._write_line(INTRINSICS, json.dumps(values, indent=2))
            return
        model, coefficients = model_of(camera.lens)
        fields = {
            'width': frame.width,
            'height': frame.height,
            'distortion_model': model,
            'D': coefficients,
            'K': [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0],
        }
        self._write_line(CAMERA_INFO, json.dumps(fields, indent=2))

    def _write_people(self, people: Mapping[int, PersonTruth]) -> None:
        shown = {who: truth for who, truth in people.items() if truth.shown is not None}
        for who, truth in people.items():
            distance = truth.position[2] * 1000 if who in shown else 0
            self._write_line(f'groundtruth_{who}.txt', format_box(truth.visible))
            self._write_line(f'body_{who}.txt', format_box(truth.body))
            self._write_line(f'visible_{who}.txt', f'{truth.visible_fraction:.4f},{distance:.0f}')
        rows = Sightings.of(
            [self._count] * len(shown),
            list(shown),
            [truth.shown.as_tuple() for truth in shown.values() if truth.shown is not None],
            [float(truth.visible_fraction >= BARELY_VISIBLE) for truth in shown.values()],
            positions=[truth.position for truth in shown.values()],
        )
        self._write(MOT_FILE, mot_text(rows))

    def _show(self, name: str, part: Path) -> None:
        try:
            part.rename(self.output.place / name)
        except OSError as error:
            raise RecordingError(cannot_write(self.output.path / name, error)) from None

    def _take_back(self, images: dict[str, Path], sizes: dict[str, int]) -> None:
        """Leave no half of a frame."""
        for image, part in images.items():
            for path in (self.output.place / image, part):
                with contextlib.suppress(OSError):
                    path.unlink()
        for key, file in self._files.items():
            with contextlib.suppress(OSError):
                file.seek(file.truncate(sizes.get(key, 0)))

    def _make(self, name: str) -> None:
        try:
            (self.output.place / name).mkdir(exist_ok=True)
        except OSError as error:
            raise RecordingError(cannot_write(self.output.path / name, error)) from None

    def _write_line(self, name: str, line: str) -> None:
        self._write(name, f'{line}\n')

    def _write(self, name: str, text: str) -> None:
        try:
            if name not in self._files:
                self._files[name] = (self.output.place / name).open('xb', buffering=0)
            data = text.encode()
            while data:  # a disk that gets full takes a part
                data = data[self._files[name].write(data) :]
        except OSError as error:
            raise RecordingError(cannot_write(self.output.path / name, error)) from None

    def _write_image(self, images: dict[str, Path], name: str, image: npt.NDArray[Any]) -> None:
        images[name] = part = part_of(self.output.place / name)
        suffix = name[-4:]
        flags = (
            [int(cv2.IMWRITE_PNG_COMPRESSION), 1]
            if suffix == '.png'
            else [int(cv2.IMWRITE_JPEG_QUALITY), 95]
        )
        done, data = cv2.imencode(suffix, image, flags)
        try:
            if not done:
                raise OSError('image cannot be encoded')
            part.write_bytes(data.tobytes())
        except OSError as error:
            raise RecordingError(cannot_write(self.output.path / name, error)) from None
