# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Sequences of image files with annotations of one line per image."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import DatasetError, ImageError, RecordingError
from rgbd_kcf_tracker.evaluation.datasets.base import Sample
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.containers import inspect
from rgbd_kcf_tracker.recordings.files import MAX_IMAGE, read_file
from rgbd_kcf_tracker.recordings.images import (
    decode_color_bytes,
    decode_depth_bytes,
    metres_from_mm,
)
from rgbd_kcf_tracker.recordings.textfiles import natural_key

IMAGE_SUFFIXES = frozenset({'.png', '.jpg', '.jpeg', '.tif', '.tiff'})


@dataclass(frozen=True, slots=True)
class ImageFrames:
    """Frames from image files.

    Attributes:
        colors: one file per frame.
        depths: the same, None where a frame has no depth; empty where none has.
        stamps_ns: one per frame.
        intrinsics: of the colour camera.
        rotated_depth: depth is stored as Princeton stores it, see :func:`unrotate`.
    """

    colors: tuple[Path, ...]
    depths: tuple[Path | None, ...]
    stamps_ns: tuple[int, ...]
    intrinsics: Intrinsics | None = None
    rotated_depth: bool = False

    def frame(self, index: int) -> Frame:
        """Frame ``index``.

        Raises:
            DatasetError: for a file that is missing or no image, naming it.
        """
        color_path = self.colors[index]
        depth_path = self.depths[index] if self.depths else None
        try:
            color = decode_color_bytes(memoryview(_bytes(color_path)))
        except ImageError as error:
            raise DatasetError(f'{color_path}: {error}') from None
        try:
            depth = None if depth_path is None else self._depth(depth_path)
            return Frame(color, depth, self.stamps_ns[index], self.intrinsics)
        except ImageError as error:
            raise DatasetError(f'{depth_path or color_path}: {error}') from None

    def _depth(self, path: Path) -> npt.NDArray[np.float32]:
        data = memoryview(_bytes(path))
        return _princeton_depth(data) if self.rotated_depth else decode_depth_bytes(data)

    def samples(
        self,
        visible: Sequence[Box | None],
        body: Sequence[Box | None] | None = None,
        fractions: Sequence[float] | None = None,
        start: int = 0,
        end: int | None = None,
    ) -> Iterator[Sample]:
        """Frames ``start`` up to and without ``end`` with their truth, which is indexed alike."""
        for i in range(start, len(self.colors) if end is None else end):
            yield Sample(
                self.frame(i),
                visible[i],
                body[i] if body is not None else None,
                fractions[i] if fractions is not None else None,
            )


def unrotate(depth: npt.NDArray[np.uint16]) -> npt.NDArray[np.uint16]:
    """Millimetres from Princeton's depth images, which are rotated left by three bits."""
    # In 32 bits, so that no NumPy promotes the shift to the left while another lets it wrap.
    wide = depth.astype(np.uint32)
    return (((wide >> 3) | (wide << 13)) & 0xFFFF).astype(np.uint16)


def image_files(folder: Path) -> tuple[Path, ...]:
    """The images in a folder in the order of their numbers.

    Raises:
        DatasetError: where the folder cannot be read or holds no image.
    """
    try:
        found = [p for p in folder.iterdir() if p.suffix.lower() in IMAGE_SUFFIXES]
    except OSError as error:
        raise DatasetError(f'{folder} cannot be read: {error.strerror or error}') from None
    if not found:
        raise DatasetError(f'{folder} holds no images (PNG, JPEG or TIFF)')
    return tuple(sorted(found, key=lambda p: natural_key(p.name)))


def even_stamps(count: int, fps: float) -> tuple[int, ...]:
    """Stamps in nanoseconds of ``count`` frames at ``fps``, from 0."""
    return tuple(round(i * 1e9 / fps) for i in range(count))


def check_lengths(truth_path: Path, lines: int, images: Sequence[Path], folder: Path) -> None:
    """Refuse annotations that do not go with the images, one line each.

    Raises:
        DatasetError: naming file, line, and the first image that is missing from the numbering.
    """
    if lines == len(images):
        return
    gap = missing_number(images)
    hint = f'; {gap} is missing' if gap else ''
    if lines > len(images):
        raise DatasetError(
            f'{truth_path}, line {len(images) + 1}: {lines} lines for the {len(images)} images in '
            f'{folder}{hint}: give one line per image'
        )
    raise DatasetError(
        f'{truth_path}, line {lines}: the file ends here, but {folder} has {len(images)} images'
        f'{hint}: give one line per image'
    )


def missing_number(images: Sequence[Path]) -> Path | None:
    """The first file that a gap in the images' numbering leaves out; None without a gap."""
    if not images or not all(p.stem.isdigit() for p in images):
        return None
    for before, after in itertools.pairwise(images):
        number = int(before.stem) + 1
        if int(after.stem) != number:
            return before.with_name(f'{number:0{len(before.stem)}d}{before.suffix}')
    return None


def shifted(box: Box | None, by: float) -> Box | None:
    """``box`` moved by ``by`` pixels in x and y."""
    return None if box is None else box.moved(by, by)


def _princeton_depth(data: memoryview) -> npt.NDArray[np.float32]:
    head = inspect(data)
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint16 or image.ndim != 2:
        raise ImageError(f'{head.name} of {head.bits} bits: expected a 16-bit depth image')
    return metres_from_mm(unrotate(image))


def _bytes(path: Path) -> bytes:
    try:
        return read_file(path, MAX_IMAGE)
    except RecordingError as error:
        raise DatasetError(str(error)) from None
