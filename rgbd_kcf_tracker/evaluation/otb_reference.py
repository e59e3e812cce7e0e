# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How faithful our ``kcf`` is: its OTB precision beside that of the published KCF boxes.

    python -m rgbd_kcf_tracker.evaluation.otb_reference DIR

``DIR`` holds OTB sequences, each a folder with ``rgb/``, ``groundtruth.txt`` and
``results/KCF_GaussHog.txt``, boxes in MATLAB's 1-based pixels.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import DatasetError, RgbdKcfError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.files import MAX_IMAGE, read_file
from rgbd_kcf_tracker.recordings.images import decode_color_bytes
from rgbd_kcf_tracker.recordings.textfiles import read_lines
from rgbd_kcf_tracker.variants import create_tracker

REFERENCE = 'KCF_GaussHog'
PIXELS = 20.0

Boxes = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Comparison:
    """One sequence's precision at 20 px, of our tracker and of the published boxes."""

    sequence: str
    frames: int
    ours: float
    published: float


def precision(boxes: Boxes, truth: Boxes, pixels: float = PIXELS) -> float:
    """Share of frames whose centre is at most ``pixels`` from the truth's, the first included.

    That is OTB's measure, as published; the package's other tables leave the first frame out.

    Args:
        boxes: ``(n, 4)`` x, y, width, height.
        truth: ``(n, 4)``, likewise.
        pixels: radius that still counts.
    """
    centers = boxes[:, :2] + boxes[:, 2:] / 2
    true_centers = truth[:, :2] + truth[:, 2:] / 2
    error = np.hypot(*(centers - true_centers).T)
    return float(np.mean(error <= pixels))


def read_boxes(path: Path) -> Boxes:
    """Boxes of an OTB file, ``(n, 4)``, separated by commas, tabs or spaces.

    Raises:
        DatasetError: naming file and line, where a line is no box.
    """
    rows = []
    for number, line in enumerate(read_lines(path), start=1):
        if not line.strip():
            continue
        try:
            row = [float(value) for value in line.replace(',', ' ').split()]
        except ValueError:
            row = []
        if len(row) != 4:
            raise DatasetError(f'{path}, line {number}: expected x,y,width,height, got {line!r}')
        rows.append(row)
    if not rows:
        raise DatasetError(f'{path} holds no boxes')
    return np.array(rows)


def track_boxes(images: Sequence[Path], first: Box) -> Boxes:
    """Boxes of our ``kcf`` over images, ``(n, 4)`` in 0-based pixels.

    Raises:
        DatasetError: for an image that cannot be read.
    """
    tracker = create_tracker('kcf')
    rows = []
    for index, path in enumerate(images):
        try:
            frame = Frame(decode_color_bytes(memoryview(read_file(path, MAX_IMAGE))))
        except RgbdKcfError as error:
            raise DatasetError(f'{path} is not an image that can be read: {error}') from None
        track = tracker.start(frame, first) if index == 0 else tracker.update(frame)
        rows.append((track.box or first).as_tuple())
    return np.array(rows)


def compare(folder: Path) -> Comparison:
    """Track one sequence and hold it against its published boxes.

    Raises:
        DatasetError: where the folder is not as the module's docstring says.
    """
    truth = read_boxes(folder / 'groundtruth.txt')
    published = read_boxes(folder / 'results' / f'{REFERENCE}.txt')
    if len(published) != len(truth):
        raise DatasetError(
            f'{folder}: {len(published)} published boxes but {len(truth)} of ground truth'
        )
    images = sorted(p for p in (folder / 'rgb').glob('*') if p.suffix in ('.jpg', '.png'))
    if len(images) < len(truth):
        raise DatasetError(f'{folder / "rgb"}: {len(images)} images for {len(truth)} boxes')
    # MATLAB counts pixels from 1.
    first = Box(truth[0, 0] - 1, truth[0, 1] - 1, truth[0, 2], truth[0, 3])
    ours = track_boxes(images[: len(truth)], first) + np.array([1, 1, 0, 0])
    return Comparison(folder.name, len(truth), precision(ours, truth), precision(published, truth))


def comparisons(root: Path) -> Iterator[Comparison]:
    """Each sequence below ``root`` that has published boxes, in order of name, as it is done.

    Raises:
        DatasetError: where there is none, or one is broken.
    """
    folders = sorted(p.parent.parent for p in root.glob(f'*/results/{REFERENCE}.txt'))
    if not folders:
        raise DatasetError(
            f'{root} holds no sequence with results/{REFERENCE}.txt: give a folder of OTB sequences'
        )
    for folder in folders:
        yield compare(folder)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; the exit status is 2 for bad input."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.evaluation.otb_reference',
        description=f'Precision at {PIXELS:g} px of kcf beside the published {REFERENCE} boxes.',
    )
    parser.add_argument('root', type=Path, metavar='DIR', help='folder of OTB sequences')
    root = parser.parse_args(arguments).root
    done = []
    print(f'{"sequence":<16}{"frames":>8}{"ours":>8}{"published":>11}{"difference":>12}')
    try:
        for row in comparisons(root):
            done.append(row)
            print(_line(row.sequence, str(row.frames), row.ours, row.published), flush=True)
    except RgbdKcfError as error:
        print(f'error: {error}', file=sys.stderr)
        return 2
    ours = float(np.mean([row.ours for row in done]))
    published = float(np.mean([row.published for row in done]))
    print(_line('mean', '', ours, published))
    return 0


def _line(name: str, frames: str, ours: float, published: float) -> str:
    return f'{name:<16}{frames:>8}{ours:>8.3f}{published:>11.3f}{ours - published:>+12.3f}'


if __name__ == '__main__':
    sys.exit(main())
