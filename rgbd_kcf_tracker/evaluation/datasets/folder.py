# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Our own folder layout: ``rgb/``, ``depth/``, and one ground truth, or one per annotated person.

People are annotated in a file each, ``groundtruth_PERSON.txt``, or together in ``mot.txt``, as MOT
Challenge text.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.errors import DatasetError, RecordingError
from rgbd_kcf_tracker.evaluation.datasets.base import (
    Opened,
    Sample,
    Sequence,
    broken,
    group,
    is_clear,
)
from rgbd_kcf_tracker.evaluation.datasets.images import (
    check_lengths,
    with_truth,
)
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.imagefiles import (
    ImageFrames,
    depths_beside,
    even_stamps,
    image_files,
)
from rgbd_kcf_tracker.recordings.mot import MOT_FILE, REGION_ID, read_mot
from rgbd_kcf_tracker.recordings.textfiles import (
    CAMERA_INFO,
    INTRINSICS,
    folder_intrinsics,
    read_boxes,
    read_lines,
    read_stamps,
)

TAIL_FRAMES = 15
"""Frames after a person was last seen that still count: the tracker must say that they are gone."""

_BODY = 'groundtruth_body.txt'
_PARTS = ('rgb', 'depth', _BODY, 'timestamps.txt', INTRINSICS, CAMERA_INFO)


def is_sequence(path: Path) -> bool:
    """Whether a folder is a sequence in our layout, annotated or not."""
    return (path / 'rgb').is_dir()


def find(path: Path, fps: float) -> list[Sequence]:
    """The targets of a folder.

    One per ``groundtruth_PERSON.txt``, else groundtruth.txt's, else one per id in ``mot.txt``.
    """
    people = people_files(path)
    if not people and not (path / 'groundtruth.txt').is_file() and (path / MOT_FILE).is_file():
        return _find_ids(path, fps)
    result = []
    for truth in people or [path / 'groundtruth.txt']:
        person = truth.stem.removeprefix('groundtruth').removeprefix('_')
        visible = path / (f'visible_{person}.txt' if person else 'visible.txt')
        files = (
            truth,
            visible,
            path / 'rgb',
            path / 'depth',
            _body_file(truth) if person else path / _BODY,
            path / 'timestamps.txt',
            path / INTRINSICS,
            path / CAMERA_INFO,
        )
        result.append(
            Sequence(
                name=f'{path.name}/{person}' if person else path.name,
                scenario=path.name if person else group(path),
                kind='folder',
                open=partial(load, path, truth, visible, bool(person), fps),
                identity=f'folder:{fps}',
                content=files,
                path=path,
            )
        )
    return result


def people_files(path: Path) -> list[Path]:
    """``groundtruth_PERSON.txt`` of each person, in the order of their names."""
    return sorted(p for p in path.glob('groundtruth_*.txt') if p.name != _BODY)


def _find_ids(path: Path, fps: float) -> list[Sequence]:
    """A sequence per id in ``mot.txt`` that is clearly in view at some time."""
    truth = path / MOT_FILE
    try:
        rows = read_mot(truth, regions=True)
    except RecordingError as error:
        return [broken(path, str(error))]
    clear = (rows.scores > 0) & (rows.ids != REGION_ID)
    files = (truth, path / 'rgb', path / 'depth', *(path / name for name in _PARTS[3:]))
    return [
        Sequence(
            name=f'{path.name}/{who}',
            scenario=path.name,
            kind='folder',
            open=partial(load_id, path, int(who), fps),
            identity=f'folder:{who}:{fps}',
            content=files,
            path=path,
        )
        for who in np.unique(rows.ids[clear])
    ]


def load_id(path: Path, who: int, fps: float) -> Opened:
    """Open one person of ``mot.txt``, as :func:`load` does one of several.

    A frame in which the person is barely visible (score 0) does not count.

    Raises:
        DatasetError: where the person is never clearly in view.
        RecordingError: for a file that cannot be read or a line that is no sighting.
    """
    images = image_files(path / 'rgb')
    rows = read_mot(path / MOT_FILE, len(images), regions=True)
    rows = rows.only(rows.ids == who)
    clear = rows.frames[rows.scores > 0]
    if not len(clear):
        raise DatasetError(f'{path / MOT_FILE}: id {who} is never clearly in view')
    boxes: list[Box | None] = [None] * len(images)
    judged = [True] * len(images)
    for row, frame in enumerate(rows.frames):
        boxes[frame] = rows.box(row)
        judged[frame] = bool(rows.scores[row] > 0)
    start, end = int(clear[0]), min(len(images), int(rows.frames[-1]) + TAIL_FRAMES + 1)
    frames = read_frames(path, images, fps)

    def samples() -> Iterator[Sample]:
        for number, sample in enumerate(with_truth(frames, boxes, None, None, start, end), start):
            yield dataclasses.replace(sample, judged=judged[number])

    return Opened(samples(), length=end - start, start=start, total=len(images))


def load(path: Path, truth_path: Path, visible_path: Path, person: bool, fps: float) -> Opened:
    """Open one target of a folder.

    It starts where the target is first clearly in view. A person among several ends
    :data:`TAIL_FRAMES` frames after they were last seen; a single target with the recording.

    Raises:
        DatasetError: where numbers of lines and images differ, or the target is never seen.
        RecordingError: for a file that cannot be read or a line that is no box.
    """
    images = image_files(path / 'rgb')
    if not truth_path.exists():
        raise DatasetError(f'{path} has no {truth_path.name}: nothing to measure against')
    boxes = read_boxes(truth_path)
    check_lengths(truth_path, len(boxes), images, path / 'rgb')
    body = None
    body_path = _body_file(truth_path) if person else path / _BODY
    if body_path.exists():
        body = read_boxes(body_path)
        check_lengths(body_path, len(body), images, path / 'rgb')
    fractions = None
    if visible_path.exists():
        fractions = read_fractions(visible_path)
        check_lengths(visible_path, len(fractions), images, path / 'rgb')

    seen = [i for i, box in enumerate(boxes) if box is not None]
    clear = [i for i in seen if is_clear(boxes[i], fractions[i] if fractions else None)]
    if not clear:
        raise DatasetError(
            f'{truth_path}: the target is never clearly in view: no box to start from'
        )
    start = clear[0]
    end = min(len(images), seen[-1] + TAIL_FRAMES + 1) if person else len(images)
    frames = read_frames(path, images, fps)
    return Opened(
        with_truth(frames, boxes, body, fractions, start, end),
        length=end - start,
        start=start,
        total=len(images),
        has_body=body is not None,
    )


def _body_file(truth_path: Path) -> Path:
    """``body_PERSON.txt`` beside ``groundtruth_PERSON.txt``."""
    return truth_path.with_name(truth_path.name.replace('groundtruth', 'body', 1))


def read_fractions(path: Path) -> list[float]:
    """The first number of each line: how much of the target shows, 0 to 1.

    Raises:
        DatasetError: naming the line without a number.
    """
    result = []
    for number, line in enumerate(read_lines(path), start=1):
        try:
            result.append(float(line.replace(',', ' ').split()[0]))
        except (ValueError, IndexError):
            raise DatasetError(
                f'{path}, line {number}: {line.strip()[:60]!r}: write the visible share, 0 to 1'
            ) from None
    return result


def read_frames(path: Path, images: tuple[Path, ...], fps: float) -> ImageFrames:
    """The frames of a folder: its images with what lies beside them.

    Raises:
        DatasetError: where the depth image or the stamp of a frame is missing.
        RecordingError: for a file that cannot be read.
    """
    depths: tuple[Path | None, ...] = ()
    if (path / 'depth').is_dir():
        depths = depths_beside(images, path / 'depth')
        lost = next((p for p, d in zip(images, depths, strict=True) if d is None), None)
        if lost is not None:
            raise DatasetError(f'{path / "depth"} has no image for {lost}: give each frame a depth')
    stamps = even_stamps(len(images), fps)
    stamps_path = path / 'timestamps.txt'
    if stamps_path.exists():
        stamps = tuple(read_stamps(stamps_path))
        check_lengths(stamps_path, len(stamps), images, path / 'rgb')
    intrinsics = folder_intrinsics(path)
    return ImageFrames(images, depths, stamps, intrinsics)
