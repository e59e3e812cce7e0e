# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Frames written as a sequence folder."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, TextIO

import cv2
import numpy.typing as npt

from rgbd_kcf_tracker.errors import ParameterError, RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.encoding import millimetres
from rgbd_kcf_tracker.recordings.results import cannot_write, open_for_writing
from rgbd_kcf_tracker.recordings.textfiles import format_box

CLEARLY_VISIBLE = 0.4
"""Below this share of a person, ``mot.txt`` marks the box as neither hit nor miss."""


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


class SequenceWriter:
    """Writes ``rgb/``, ``depth/`` (16-bit PNG, millimetres) and the text files beside them.

    Lines are written with their images, so an interrupted run leaves a sequence that can be read.

    Args:
        folder: is made; it may be there, but must not hold images yet.
        color_format: 'png', or 'jpg' where size matters more than the last bit.

    Raises:
        RecordingError: where it cannot be written, or holds images already.
        ParameterError: for another format.
    """

    def __init__(self, folder: str | os.PathLike[str], color_format: str = 'png') -> None:
        if color_format not in ('png', 'jpg'):
            raise ParameterError(f'colour format is {color_format!r}: choose png or jpg')
        self.folder = Path(folder)
        self._suffix = color_format
        self._files: dict[str, TextIO] = {}
        self._count = 0
        try:
            (self.folder / 'rgb').mkdir(parents=True, exist_ok=True)
            if any((self.folder / 'rgb').iterdir()):
                raise RecordingError(f'{self.folder} holds a sequence already: give another folder')
        except OSError as error:
            raise RecordingError(cannot_write(self.folder, error)) from None

    def write(
        self,
        frame: Frame,
        visible: Box | None = None,
        body: Box | None = None,
        visible_fraction: float | None = None,
    ) -> None:
        """Write a frame and what is true of it.

        Args:
            frame: the next frame.
            visible: box of the visible part, None where absent.
            body: box of the whole body, None where not known.
            visible_fraction: visible share, 0 to 1; written where it is given.

        Raises:
            RecordingError: where it cannot be written.
        """
        self._count += 1
        name = f'{self._count:06d}'
        self._write_image(self.folder / 'rgb' / f'{name}.{self._suffix}', frame.color)
        if frame.depth is not None:
            if not (self.folder / 'depth').exists():
                (self.folder / 'depth').mkdir()
            self._write_image(self.folder / 'depth' / f'{name}.png', millimetres(frame.depth))
        if self._count == 1 and frame.intrinsics is not None:
            camera = frame.intrinsics
            values = {k: getattr(camera, k) for k in ('fx', 'fy', 'cx', 'cy')}
            with open_for_writing(self.folder / 'intrinsics.json') as file:
                file.write(json.dumps(values, indent=2) + '\n')
        self._write_line('timestamps.txt', str(frame.stamp_ns))
        self._write_line('groundtruth.txt', format_box(visible))
        self._write_line('groundtruth_body.txt', format_box(body))
        if visible_fraction is not None:
            self._write_line('visible.txt', f'{visible_fraction:.4f}')

    def write_people(self, people: Mapping[int, PersonTruth]) -> None:
        """Write where everybody is in the frame that was written last.

        A person ``7`` gets a line in ``groundtruth_7.txt``, ``body_7.txt`` and ``visible_7.txt``
        (visible share, distance in millimetres); who shows gets one in ``mot.txt``, MOT Challenge
        text: ``frame,id,x,y,width,height,conf,X,Y,Z``, frames from 1, the box of what shows, the
        position in metres in the camera's optical frame. ``conf`` is 1, or 0 where less than
        `CLEARLY_VISIBLE` of the person shows.

        Args:
            people: by id; give the same ids with every frame.

        Raises:
            RecordingError: where it cannot be written.
        """
        rows = []
        for person, truth in people.items():
            self._write_line(f'groundtruth_{person}.txt', format_box(truth.visible))
            self._write_line(f'body_{person}.txt', format_box(truth.body))
            seen = truth.shown is not None
            distance = truth.position[2] * 1000 if seen else 0
            self._write_line(f'visible_{person}.txt',
                             f'{truth.visible_fraction:.4f},{distance:.0f}')  # fmt: skip
            if truth.shown is not None:
                clear = int(truth.visible_fraction >= CLEARLY_VISIBLE)
                place = ','.join(f'{metres:.3f}' for metres in truth.position)
                rows.append(f'{self._count},{person},{format_box(truth.shown)},{clear},{place}\n')
        self._write_line('mot.txt', ''.join(rows), end='')

    def close(self) -> None:
        """Close the files."""
        for file in self._files.values():
            file.close()

    def __enter__(self) -> SequenceWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _write_line(self, name: str, line: str, end: str = '\n') -> None:
        if name not in self._files:
            self._files[name] = open_for_writing(self.folder / name)
        try:
            self._files[name].write(line + end)
            self._files[name].flush()
        except OSError as error:
            raise RecordingError(cannot_write(self.folder / name, error)) from None

    def _write_image(self, path: Path, image: npt.NDArray[Any]) -> None:
        flags = (
            [int(cv2.IMWRITE_PNG_COMPRESSION), 1]
            if path.suffix == '.png'
            else [int(cv2.IMWRITE_JPEG_QUALITY), 95]
        )
        done, data = cv2.imencode(path.suffix, image, flags)
        try:
            if not done:
                raise OSError('image cannot be encoded')
            path.write_bytes(data.tobytes())
        except OSError as error:
            raise RecordingError(cannot_write(path, error)) from None
