# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Bags with ground truth on ``/groundtruth/visible`` and ``/groundtruth/body``."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.datasets.base import Opened, Sample, Sequence, group
from rgbd_kcf_tracker.recordings import open_recording
from rgbd_kcf_tracker.recordings.recording import ReadOptions

SUFFIXES = ('.mcap', '.bag', '.db3')
RECORDING = 'recording'
"""Kind of a sequence that is a bag."""


def is_sequence(path: Path) -> bool:
    """Whether a path is a bag: a file, or a rosbag2 folder."""
    return path.suffix in SUFFIXES if path.is_file() else (path / 'metadata.yaml').is_file()


def find(path: Path, options: ReadOptions) -> Sequence:
    """One bag."""
    return Sequence(
        name=path.stem,
        scenario=group(path),
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
