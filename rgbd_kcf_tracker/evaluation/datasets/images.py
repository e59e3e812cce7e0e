# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Sequences of image files with annotations of one line per image."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import DatasetError, ImageError
from rgbd_kcf_tracker.evaluation.datasets.base import Sample
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.containers import inspect
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames, missing_number, unnumbered
from rgbd_kcf_tracker.recordings.images import Refused, metres_from_mm


def with_truth(
    frames: ImageFrames,
    visible: Sequence[Box | None],
    body: Sequence[Box | None] | None = None,
    fractions: Sequence[float] | None = None,
    start: int = 0,
    end: int | None = None,
) -> Iterator[Sample]:
    """Frames ``start`` up to and without ``end`` with their truth, which is indexed alike."""
    for i in range(start, len(frames) if end is None else end):
        yield Sample(
            frames.frame(i),
            visible[i],
            body[i] if body is not None else None,
            fractions[i] if fractions is not None else None,
        )


def unrotate(depth: npt.NDArray[np.uint16]) -> npt.NDArray[np.uint16]:
    """Millimetres from Princeton's depth images, which are rotated left by three bits."""
    # In 32 bits, so that no NumPy promotes the shift to the left while another lets it wrap.
    wide = depth.astype(np.uint32)
    return (((wide >> 3) | (wide << 13)) & 0xFFFF).astype(np.uint16)


def check_lengths(truth_path: Path, lines: int, images: Sequence[Path], folder: Path) -> None:
    """Refuse annotations that do not go with the images, one line each.

    Raises:
        DatasetError: naming file, line, and the first image that is missing from the numbering, or
            that has no number.
    """
    if lost := unnumbered(images):
        raise DatasetError(f'{lost}: which line of {truth_path} is its? Number it, or take it out')
    if lines == len(images):
        return
    gap = missing_number(images, lines)
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


def shifted(box: Box | None, by: float) -> Box | None:
    """``box`` moved by ``by`` pixels in x and y."""
    return None if box is None else box.moved(by, by)


def princeton_depth(
    data: memoryview, max_pixels: int, _refused: Refused | None = None
) -> npt.NDArray[np.float32]:
    """Metres of a depth file as Princeton stores it, see :func:`unrotate`.

    Raises:
        ImageError: where it is none.
    """
    head = inspect(data, max_pixels)
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint16 or image.ndim != 2:
        raise ImageError(f'{head.name} of {head.bits} bits: expected a 16-bit depth image')
    return metres_from_mm(unrotate(image))
