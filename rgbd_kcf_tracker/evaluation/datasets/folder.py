# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Our own folder layout: ``rgb/``, ``depth/``, and one ground truth, or one per annotated person.

The colour images may lie in ``color/`` or ``img/``, too, as in other layouts: where this one is
asked for, or a file that only it has lies beside them.

People are annotated in a file each, ``groundtruth_PERSON.txt``, or together in ``mot.txt``, as MOT
Challenge text.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
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
from rgbd_kcf_tracker.recordings.files import is_there
from rgbd_kcf_tracker.recordings.imagefiles import (
    ImageFrames,
    image_files,
    size_of,
)
from rgbd_kcf_tracker.recordings.mot import MOT_FILE, REGION_ID, read_mot
from rgbd_kcf_tracker.recordings.sequences import (
    COLOR_FOLDERS,
    color_folder,
    folder_depths,
    folder_stamps,
)
from rgbd_kcf_tracker.recordings.textfiles import (
    CAMERA_INFO,
    INTRINSICS,
    folder_intrinsics,
    read_boxes,
    read_lines,
)

TAIL_FRAMES = 15
"""Frames after a person was last seen that still count: the tracker must say that they are gone."""

_BODY = 'groundtruth_body.txt'
_PARTS = ('timestamps.txt', INTRINSICS, CAMERA_INFO)
"""Files that no other layout has."""


def is_sequence(path: Path, asked: bool = False) -> bool:
    """Whether a folder is a sequence in our layout, annotated or not.

    Args:
        path: the folder.
        asked: this layout is asked for.
    """
    colors = color_folder(path)
    if colors is None or asked or colors.name == COLOR_FOLDERS[0]:
        return colors is not None
    # VOT's own file says whose it is, whatever the user has put beside it.
    return not (path / 'sequence').is_file() and any((path / n).is_file() for n in _PARTS)


def find(path: Path, fps: float, named: bool = False) -> list[Sequence]:
    """The targets of a folder.

    One per ``groundtruth_PERSON.txt``, else groundtruth.txt's, else one per id in ``mot.txt``. See
    :func:`~.base.group` for ``named``.
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
            _colors(path),
            path / 'depth',
            _body_file(truth) if person else path / _BODY,
            *(path / name for name in _PARTS),
        )
        result.append(
            Sequence(
                name=f'{path.name}/{person}' if person else path.name,
                scenario=path.name if person else group(path, named),
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
    files = (truth, _colors(path), path / 'depth', *(path / name for name in _PARTS))
    return [
        Sequence(
            name=f'{path.name}/{who}',
            scenario=path.name,
            kind='folder',
            open=partial(load_id, path, int(who), fps),
            identity=f'folder:{who}:{fps}',
            content=(*files, path / f'body_{who}.txt'),
            path=path,
        )
        for who in np.unique(rows.ids[clear])
    ]


def load_id(path: Path, who: int, fps: float) -> Opened:
    """Open one person of ``mot.txt``, as :func:`load` does one of several.

    A frame in which the person is barely visible (score 0) does not count. The whole body is in
    ``body_ID.txt``, where it is known.

    Raises:
        DatasetError: where the person is never clearly in view.
        RecordingError: for a file that cannot be read or a line that is no sighting.
    """
    images = image_files(_colors(path))
    rows = read_mot(path / MOT_FILE, len(images), regions=True)
    rows = rows.only(rows.ids == who)
    clear = rows.frames[rows.scores > 0]
    if not len(clear):
        raise DatasetError(f'{path / MOT_FILE}: id {who} is never clearly in view')
    body = _read_bodies(path / f'body_{who}.txt', images)
    boxes: list[Box | None] = [None] * len(images)
    judged = [True] * len(images)
    for row, frame in enumerate(rows.frames):
        boxes[frame] = rows.box(row)
        judged[frame] = bool(rows.scores[row] > 0)
    start, end = int(clear[0]), min(len(images), int(rows.frames[-1]) + TAIL_FRAMES + 1)
    warnings: list[str] = []
    frames = read_frames(path, images, fps, warnings.append)

    def samples() -> Iterator[Sample]:
        for number, sample in enumerate(with_truth(frames, boxes, body, None, start, end), start):
            yield dataclasses.replace(sample, judged=judged[number])

    return Opened(
        samples(),
        length=end - start,
        start=start,
        total=len(images),
        has_body=body is not None,
        warnings=tuple(warnings),
    )


def load(path: Path, truth_path: Path, visible_path: Path, person: bool, fps: float) -> Opened:
    """Open one target of a folder.

    It starts where the target is first clearly in view. A person among several ends
    :data:`TAIL_FRAMES` frames after they were last seen; a single target with the recording.

    Raises:
        DatasetError: where numbers of lines and images differ, or the target is never seen.
        RecordingError: for a file that cannot be read or a line that is no box.
    """
    images = image_files(_colors(path))
    if not is_there(truth_path):
        raise DatasetError(f'{path} has no {truth_path.name}: nothing to measure against')
    boxes = read_boxes(truth_path)
    check_lengths(truth_path, len(boxes), images, images[0].parent)
    body = _read_bodies(_body_file(truth_path) if person else path / _BODY, images)
    fractions = None
    if is_there(visible_path):
        fractions = read_fractions(visible_path)
        check_lengths(visible_path, len(fractions), images, images[0].parent)

    seen = [i for i, box in enumerate(boxes) if box is not None]
    clear = [i for i in seen if is_clear(boxes[i], fractions[i] if fractions else None)]
    if not clear:
        raise DatasetError(
            f'{truth_path}: the target is never clearly in view: no box to start from'
        )
    start = clear[0]
    end = min(len(images), seen[-1] + TAIL_FRAMES + 1) if person else len(images)
    warnings: list[str] = []
    frames = read_frames(path, images, fps, warnings.append)
    return Opened(
        with_truth(frames, boxes, body, fractions, start, end),
        length=end - start,
        start=start,
        total=len(images),
        has_body=body is not None,
        warnings=tuple(warnings),
    )


def _colors(path: Path) -> Path:
    """The folder of colour images."""
    return color_folder(path) or path / COLOR_FOLDERS[0]


def _body_file(truth_path: Path) -> Path:
    """``body_PERSON.txt`` beside ``groundtruth_PERSON.txt``."""
    return truth_path.with_name(truth_path.name.replace('groundtruth', 'body', 1))


def _read_bodies(path: Path, images: tuple[Path, ...]) -> list[Box | None] | None:
    """The whole body in each frame; None where there is no such file."""
    if not is_there(path):
        return None
    bodies = read_boxes(path)
    check_lengths(path, len(bodies), images, images[0].parent)
    return bodies


def read_fractions(path: Path) -> list[float]:
    """The first number of each line: how much of the target shows, 0 to 1.

    Raises:
        DatasetError: naming the line without such a number.
    """
    result = []
    for number, line in enumerate(read_lines(path), start=1):
        try:
            share = float(line.replace(',', ' ').split()[0])
            if not 0 <= share <= 1:
                raise ValueError
            result.append(share)
        except (ValueError, IndexError):
            raise DatasetError(
                f'{path}, line {number}: {line.strip()[:60]!r}: write the visible share, 0 to 1'
            ) from None
    return result


def read_frames(
    path: Path,
    images: tuple[Path, ...],
    fps: float,
    warn: Callable[[str], None] | None = None,
) -> ImageFrames:
    """The frames of a folder: its images with what lies beside them.

    Args:
        path: the folder.
        images: its colour images.
        fps: their rate where it has no ``timestamps.txt``.
        warn: is told in words what is odd; None: a depth image that is missing is an error.

    Raises:
        DatasetError: where the depth image of a frame is missing.
        RecordingError: for a file that cannot be read, or the stamp of a frame is missing.
    """
    depths = folder_depths(path, images, warn or (lambda text: None))
    if warn is None and None in depths:
        lost = images[depths.index(None)]
        raise DatasetError(f'{path / "depth"} has no image for {lost}: give each frame a depth')
    stamps = folder_stamps(path, images, fps, warn or (lambda text: None))
    camera = folder_intrinsics(path, lambda: size_of(images[0]), warn)
    return ImageFrames(images, depths, stamps, camera)
