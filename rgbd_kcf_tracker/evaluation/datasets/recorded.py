# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Bags with ground truth on ``/groundtruth/visible`` and ``/groundtruth/body``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.datasets.base import Opened, Sample, Sequence, entries, group
from rgbd_kcf_tracker.recordings import open_recording
from rgbd_kcf_tracker.recordings.recording import ReadOptions
from rgbd_kcf_tracker.recordings.storage import BAG_SUFFIXES

RECORDING = 'recording'
"""Kind of a sequence that is a bag."""


def is_sequence(path: Path) -> bool:
    """Whether a path is a bag: a file that is named as one, or a rosbag2 folder."""
    if path.is_file():
        return path.suffix in BAG_SUFFIXES
    return (path / 'metadata.yaml').is_file() or (path.is_dir() and _is_split(path))


def is_named(path: Path) -> bool:
    """Whether a file that was named itself is a bag, whatever its name.

    Raises:
        RecordingError: where it cannot be read.
    """
    from rgbd_kcf_tracker.recordings.rawbag import is_bag_file  # slow to import

    return path.is_file() and is_bag_file(path)


def _is_split(folder: Path) -> bool:
    """Whether all bags in a folder are files of one: rosbag2 names them by it, and numbers them.

    Others are a recording each, as a data set has them.
    """
    names = [path.name.removesuffix('.zstd') for path in entries(folder)]
    bags = [name for name in names if name.endswith(BAG_SUFFIXES)]
    part = re.compile(rf'{re.escape(folder.name)}_[0-9]+\.(mcap|db3)')
    kinds = {found[1] if (found := part.fullmatch(name)) else None for name in bags}
    return len(kinds) == 1 and None not in kinds


def find(path: Path, options: ReadOptions, named: bool = False) -> Sequence:
    """One bag; see :func:`~.base.group` for ``named``."""
    return Sequence(
        name=path.stem,
        scenario=group(path, named),
        kind=RECORDING,
        open=partial(load, path, options),
        identity=f'recording:{options}',
        content=(path,),
        path=path,
    )


def load(path: Path, options: ReadOptions) -> Opened:
    """Open a bag.

    Raises:
        DatasetError: where it holds no ground truth.
        RecordingError: where it cannot be read.
    """
    with open_recording(path, options) as recording:
        truth = recording.groundtruth
        if truth is None or not any(box is not None for box in truth):
            raise DatasetError(
                f'{path} holds no ground truth: record /groundtruth/visible with it, '
                'or measure a folder with groundtruth.txt'
            )
        return Opened(
            _samples(path, options),
            min(len(truth), len(recording)),
            has_body=recording.groundtruth_body is not None,
            warnings=tuple(recording.warnings),
        )


def _samples(path: Path, options: ReadOptions) -> Iterator[Sample]:
    with open_recording(path, options) as recording:
        truth, body = recording.groundtruth or [], recording.groundtruth_body
        for index, frame in enumerate(recording.frames(0, len(truth))):
            whole = body[index] if body is not None and index < len(body) else None
            yield Sample(frame, truth[index], whole)
