# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Princeton Tracking Benchmark: ``frames.mat``, ``rgb/r-STAMP-ID.png``, ``depth/d-STAMP-ID.png``.

Source: Song and Xiao, ICCV 2013, and the data set's folders. Depth images are rotated left by three
bits; ``frames.mat`` pairs colour and depth and holds their stamps (microseconds) and the camera.
The five validation sequences have ``NAME.txt`` with a box per frame, ``nan`` while hidden; the 95
others have only ``init.txt``: they can be run and written for submission, not measured.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import DatasetError, ParameterError
from rgbd_kcf_tracker.evaluation.datasets.base import Opened, Sequence
from rgbd_kcf_tracker.evaluation.datasets.images import check_lengths, princeton_depth, with_truth
from rgbd_kcf_tracker.evaluation.metrics.princeton import CATEGORIES
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.recordings.files import is_there
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames
from rgbd_kcf_tracker.recordings.textfiles import read_boxes, read_lines

MAT_FILES = ('framesNEW.mat', 'frames.mat')
"""The first that is there is taken: framesNEW.mat is DS-KCF's better pairing of the same images."""

CATEGORIES_FILE = 'categories.csv'
_PARTS = ('init.txt', 'rgb', 'depth')
_FLAGS = 1
"""Numbers after a box: whether the target is occluded, which the box says, too."""


def is_sequence(path: Path) -> bool:
    """Whether a folder is a Princeton sequence."""
    return any((path / name).is_file() for name in MAT_FILES)


def find(path: Path, categories: Mapping[str, Mapping[str, str]]) -> Sequence:
    """One sequence folder, with its categories where they are known."""
    truth = path / f'{path.name}.txt'
    return Sequence(
        name=path.name,
        scenario=path.parent.name or 'princeton',
        kind='princeton',
        open=partial(load, path),
        identity='princeton',
        content=(truth, _mat(path), *(path / n for n in _PARTS)),
        categories=categories.get(path.name, {}),
        path=path,
    )


def read_categories(path: Path) -> dict[str, dict[str, str]]:
    """Categories per sequence from ``categories.csv``; empty where there is none.

    The header is ``sequence`` and the five splits, see
    :data:`rgbd_kcf_tracker.evaluation.metrics.princeton.CATEGORIES`.

    Raises:
        DatasetError: naming the line where a split is missing or no category of it.
    """
    if not is_there(path):
        return {}
    result: dict[str, dict[str, str]] = {}
    for number, row in enumerate(csv.DictReader(read_lines(path)), start=2):
        own = {}
        for split, names in CATEGORIES.items():
            value = (row.get(split) or '').strip().lower()
            if value not in names:
                raise DatasetError(
                    f'{path}, line {number}: {split} is {value!r}: give one of {", ".join(names)}'
                )
            own[split] = value
        result[(row.get('sequence') or '').strip()] = own
    return result


def load(path: Path) -> Opened:
    """Open a sequence.

    Raises:
        DatasetError: where ``frames.mat`` is not as it should be, images are missing, or numbers
            differ.
    """
    frames, folders = _frames(path)
    for file in (*frames.colors, *frames.depths):
        if file is not None and not file.is_file():
            raise DatasetError(f'{file} is missing: {_mat(path)} names it')
    count = len(frames.colors)
    truth_path, init_path = path / f'{path.name}.txt', path / 'init.txt'
    if is_there(truth_path):
        boxes = read_boxes(truth_path, _FLAGS)
        check_lengths(truth_path, len(boxes), frames.colors, folders)
        annotated = True
    elif is_there(init_path):
        first = read_boxes(init_path, _FLAGS)
        boxes = [*first[:1], *[None] * (count - 1)]
        annotated = False
    else:
        raise DatasetError(
            f'{path} has neither {truth_path.name} nor init.txt: no box to start from'
        )
    if not any(box is not None for box in boxes):
        raise DatasetError(f'{truth_path if annotated else init_path}: no line holds a box')
    return Opened(with_truth(frames, boxes), count, annotated=annotated)


def _whole_numbers(values: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    """Stamps and numbers of frames, which MATLAB may keep as doubles.

    Raises:
        ValueError: for NaN, or a number that is too large to be one.
    """
    # Beyond, not every whole number is a double.
    if not (np.abs(values.astype(np.float64)) < 2**53).all():
        raise ValueError('a stamp or number of a frame is none')
    return values.astype(np.int64)


def _mat(path: Path) -> Path:
    return next((path / n for n in MAT_FILES if (path / n).is_file()), path / MAT_FILES[-1])


def _frames(path: Path) -> tuple[ImageFrames, Path]:
    from scipy.io import loadmat  # slow to import, and only needed here

    file = _mat(path)
    try:
        content = loadmat(file, squeeze_me=True, struct_as_record=False)
    except Exception as error:  # SciPy raises many kinds on a file that is damaged
        raise DatasetError(f'{file} cannot be read: {error}') from None
    info: Any = next((v for k, v in content.items() if not k.startswith('__')), None)
    try:
        arrays = {
            name: _whole_numbers(np.atleast_1d(np.asarray(getattr(info, name))))
            for name in ('imageTimestamp', 'imageFrameID', 'depthTimestamp', 'depthFrameID')
        }
        camera = np.asarray(getattr(info, 'K', np.full((3, 3), np.nan)), np.float64)
        count = int(getattr(info, 'length', len(arrays['imageTimestamp'])))
    except (AttributeError, TypeError, ValueError, OverflowError) as error:
        raise DatasetError(
            f'{file} is not as Princeton writes it ({error}): it needs imageTimestamp, '
            'imageFrameID, depthTimestamp and depthFrameID'
        ) from None
    short = min(len(a) for a in arrays.values())
    if short < count:
        raise DatasetError(f'{file} has {short} stamps for {count} frames')
    pick = {name: values[:count].tolist() for name, values in arrays.items()}
    colors = tuple(
        path / 'rgb' / f'r-{stamp}-{number}.png'
        for stamp, number in zip(pick['imageTimestamp'], pick['imageFrameID'], strict=True)
    )
    depths = tuple(
        path / 'depth' / f'd-{stamp}-{number}.png'
        for stamp, number in zip(pick['depthTimestamp'], pick['depthFrameID'], strict=True)
    )
    try:
        intrinsics = Intrinsics(camera[0, 0], camera[1, 1], camera[0, 2], camera[1, 2])
    except (ParameterError, IndexError):
        intrinsics = None
    stamps = tuple(stamp * 1000 for stamp in pick['imageTimestamp'])
    frames = ImageFrames(colors, depths, stamps, intrinsics, read_depth=princeton_depth)
    return frames, path / 'rgb'
