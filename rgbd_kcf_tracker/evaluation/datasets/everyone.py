# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings with the truth about everyone in view: ids, boxes, and how much of each shows.

The truth lies beside the images as MOT Challenge text (``mot.txt``, or ``gt/gt.txt`` as the
challenge has it), or as one ``groundtruth_PERSON.txt`` for each, with ``visible_PERSON.txt``. With
either, ``body_PERSON.txt`` has the whole body, where it is known (simulated scenes).
"""

from __future__ import annotations

import configparser
import dataclasses
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.datasets.base import (
    EVERYONE,
    Annotation,
    Opened,
    Sample,
    Sequence,
    group,
)
from rgbd_kcf_tracker.evaluation.datasets.folder import (
    people_files,
    read_fractions,
    read_frames,
)
from rgbd_kcf_tracker.evaluation.datasets.images import check_lengths, with_truth
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.files import is_there, read_text
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames, image_files
from rgbd_kcf_tracker.recordings.mot import BARELY_VISIBLE, MOT_FILE, read_mot
from rgbd_kcf_tracker.recordings.textfiles import CAMERA_INFO, INTRINSICS, read_boxes

IMAGE_FOLDERS = ('rgb', 'color', 'img1', 'img')
CHALLENGE_FILE = Path('gt') / 'gt.txt'
_INFO = 'seqinfo.ini'

People = dict[int, list[Annotation]]
"""Who is in each frame that has anybody, by index from 0."""


def is_sequence(path: Path) -> bool:
    """Whether a folder holds images and the truth about several people."""
    return image_folder(path) is not None and bool(_truth_files(path))


def find(path: Path, fps: float, named: bool = False) -> list[Sequence]:
    """The one recording of a folder; see :func:`~.base.group` for ``named``."""
    files = [*_truth_files(path), *sorted(path.glob('visible_*.txt'))]
    files += sorted(path.glob('body_*.txt'))
    names = (*IMAGE_FOLDERS, 'depth', 'timestamps.txt', INTRINSICS, CAMERA_INFO, _INFO)
    return [
        Sequence(
            name=path.name,
            scenario=group(path, named),
            kind=EVERYONE,
            open=partial(load, path, fps),
            identity=f'everyone:{fps}',
            content=(*files, *(path / name for name in names)),
            path=path,
        )
    ]


def load(path: Path, fps: float) -> Opened:
    """Open a recording with everyone in it; see :func:`read`."""
    warnings: list[str] = []
    frames, people = read(path, fps, warnings.append)

    def samples() -> Iterator[Sample]:
        nobody = [None] * len(frames)
        for number, sample in enumerate(with_truth(frames, nobody)):
            present = tuple(people.get(number, ()))
            yield dataclasses.replace(sample, people=present)

    known = any(p.body is not None for present in people.values() for p in present)
    return Opened(
        samples(), len(frames), total=len(frames), has_body=known, warnings=tuple(warnings)
    )


def read(
    path: Path, fps: float, warn: Callable[[str], None] | None = None
) -> tuple[ImageFrames, People]:
    """The frames of a recording, none of them decoded yet, and who is in them.

    Args:
        path: the recording.
        fps: frames per second, where it has no stamps.
        warn: see :func:`~.folder.read_frames`.

    Raises:
        DatasetError: where nobody is in it, or lines and images differ in number.
        RecordingError: for a file that cannot be read, or a line that is not as it should be.
    """
    folder = image_folder(path)
    if folder is None:
        raise DatasetError(f'{path} holds no images in {", ".join(IMAGE_FOLDERS)}')
    images = image_files(folder)
    truth = _truth_files(path)
    if not truth:
        raise DatasetError(
            f'{path} does not say who is where: expected {MOT_FILE}, {CHALLENGE_FILE} or '
            'groundtruth_PERSON.txt for each'
        )
    together = truth[0].name in (MOT_FILE, CHALLENGE_FILE.name)
    if together:
        people = _from_mot(truth[0], path, images, folder)
    else:
        people = _from_files(truth, images, folder)
    if not people:
        raise DatasetError(f'{truth[0]}: nobody is ever in view: nothing to measure against')
    return read_frames(path, images, _challenge_rate(path) or fps, warn), people


def _from_mot(path: Path, beside: Path, images: tuple[Path, ...], folder: Path) -> People:
    rows = read_mot(path, len(images), regions=True)
    bodies = {
        int(who): _bodies(beside / f'body_{who}.txt', images, folder) for who in set(rows.ids)
    }
    people: People = defaultdict(list)
    for row, (frame, who, score, share) in enumerate(
        zip(rows.frames, rows.ids, rows.scores, rows.shares, strict=True)
    ):
        shown = None if share != share else float(share)
        body = bodies[int(who)][frame]
        person = Annotation(int(who), rows.box(row), bool(score > 0), body, shown)
        people[int(frame)].append(person)
    return people


def _from_files(paths: list[Path], images: tuple[Path, ...], folder: Path) -> People:
    """A file for each person; ids are their names if all are numbers, else counted from 1."""
    people: People = defaultdict(list)
    names = [path.stem.removeprefix('groundtruth_') for path in paths]
    numbers = all(name.isascii() and name.isdigit() for name in names)
    for count, (name, path) in enumerate(zip(names, paths, strict=True), start=1):
        who = int(name) if numbers else count
        bodies = _bodies(path.with_name(f'body_{name}.txt'), images, folder)
        boxes = read_boxes(path)
        check_lengths(path, len(boxes), images, folder)
        shares: list[float] | None = None
        if is_there(_share_file(path)):
            shares = read_fractions(_share_file(path))
            check_lengths(_share_file(path), len(shares), images, folder)
        for frame, box in enumerate(boxes):
            if box is not None:
                share = None if shares is None else shares[frame]
                counts = share is None or share >= BARELY_VISIBLE
                people[frame].append(Annotation(who, box, counts, bodies[frame], share))
    return people


def _bodies(path: Path, images: tuple[Path, ...], folder: Path) -> list[Box | None]:
    """The whole body in each frame; None where it is not known."""
    if not is_there(path):
        return [None] * len(images)
    boxes = read_boxes(path)
    check_lengths(path, len(boxes), images, folder)
    return boxes


def image_folder(path: Path) -> Path | None:
    """The folder of a recording's colour images, by the first name that is there; None: none is."""
    return next((path / name for name in IMAGE_FOLDERS if (path / name).is_dir()), None)


def _truth_files(path: Path) -> list[Path]:
    for name in (path / MOT_FILE, path / CHALLENGE_FILE):
        if is_there(name):
            return [name]
    return people_files(path)


def _share_file(path: Path) -> Path:
    return path.with_name(path.name.replace('groundtruth', 'visible', 1))


def _challenge_rate(path: Path) -> float | None:
    """Frames per second as the challenge's ``seqinfo.ini`` states them."""
    if not is_there(path / _INFO):
        return None
    text = read_text(path / _INFO)
    info = configparser.ConfigParser(interpolation=None)
    try:
        info.read_string(text)
        rate = info.getfloat('Sequence', 'frameRate')
    except (ValueError, configparser.Error) as error:
        raise DatasetError(f'{path / _INFO}: no frameRate in [Sequence] ({error})') from None
    if not 0 < rate < 1e6:
        raise DatasetError(f'{path / _INFO}: frameRate is {rate:g}: give frames per second')
    return rate
