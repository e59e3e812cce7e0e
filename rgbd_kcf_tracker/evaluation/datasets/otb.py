# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""OTB: ``img/0001.jpg`` and ``groundtruth_rect.txt`` with 1-based boxes.

Source: Wu, Lim and Yang, "Object Tracking Benchmark", PAMI 2015, and its data set's folders. Some
sequences are annotated only in part, and their first line does not go with their first image; which
images belong to them is in :data:`RANGES`.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.datasets.base import Opened, Sequence
from rgbd_kcf_tracker.evaluation.datasets.images import (
    check_lengths,
    shifted,
    with_truth,
)
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames, even_stamps, image_files
from rgbd_kcf_tracker.recordings.textfiles import read_boxes

ORIGIN = 1
IMAGE_FOLDERS = ('img', 'rgb')
RANGES: dict[str, tuple[int, int]] = {
    'david': (300, 770),
    'football1': (1, 74),
    'freeman3': (1, 460),
    'freeman4': (1, 283),
    'diving': (1, 215),
    'blurcar1': (247, 988),
    'blurcar3': (3, 359),
    'blurcar4': (18, 397),
}
"""First and last image, by number, of the sequences that are annotated in part."""


def is_sequence(path: Path) -> bool:
    """Whether a folder is an OTB sequence by its own names."""
    return (path / 'img').is_dir() and any(path.glob('groundtruth_rect*.txt'))


def find(path: Path, fps: float) -> list[Sequence]:
    """The sequences of one OTB folder: one, or two where it has two targets (Jogging, Skating2)."""
    files = sorted(path.glob('groundtruth_rect*.txt')) or [path / 'groundtruth.txt']
    files = [f for f in files if f.exists() and f.stat().st_size > 0] or files[:1]
    result = []
    for file in files:
        target = file.stem.removeprefix('groundtruth_rect').removeprefix('groundtruth').strip('.')
        name = f'{path.name}-{target}' if target else path.name
        result.append(
            Sequence(
                name=name,
                scenario=path.parent.name or 'otb',
                kind='otb',
                open=partial(load, path, file, fps),
                identity=f'otb:{path.name}:{fps}',
                content=(file, *(path / n for n in IMAGE_FOLDERS)),
                origin=ORIGIN,
                path=path,
            )
        )
    return result


def load(path: Path, truth_path: Path, fps: float) -> Opened:
    """Open one target.

    Raises:
        DatasetError: where images are missing, or lines and images differ in number.
        RecordingError: for a line that is no box.
    """
    folder = next((path / n for n in IMAGE_FOLDERS if (path / n).is_dir()), path / IMAGE_FOLDERS[0])
    images = image_files(folder)
    boxes = [shifted(box, -ORIGIN) for box in read_boxes(truth_path)]
    annotated = RANGES.get(path.name.lower())
    if annotated is not None and len(boxes) != len(images):
        first, last = annotated
        images = tuple(p for p in images if p.stem.isdecimal() and first <= int(p.stem) <= last)
        if len(boxes) != len(images) and len(boxes) >= last:  # annotated from the first image on
            boxes = boxes[first - 1 : last]
    check_lengths(truth_path, len(boxes), images, folder)
    if not boxes or boxes[0] is None:
        raise DatasetError(f'{truth_path}, line 1: no box to start from')
    frames = ImageFrames(images, (), even_stamps(len(images), fps))
    return Opened(with_truth(frames, boxes), len(images))
