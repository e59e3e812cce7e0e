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

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.errors import DatasetError, RgbdKcfError
from rgbd_kcf_tracker.evaluation import boxfiles
from rgbd_kcf_tracker.evaluation.datasets import otb
from rgbd_kcf_tracker.evaluation.metrics.boxes import as_array, center_error
from rgbd_kcf_tracker.evaluation.metrics.otb import precision_at_20, precision_curve
from rgbd_kcf_tracker.evaluation.passes import Notes, OnePass, run
from rgbd_kcf_tracker.variants import create_tracker

REFERENCE = 'KCF_GaussHog'
FPS = 30.0
"""Of the sequences, which state no stamps; ``kcf`` does not look at the time."""


@dataclass(frozen=True)
class Comparison:
    """One sequence's precision at 20 px, of our tracker and of the published boxes."""

    sequence: str
    frames: int
    ours: float
    published: float


def boxes_of(folder: Path) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Boxes of our ``kcf``, published and true, ``(n, 4)`` each, in 0-based pixels.

    Raises:
        DatasetError: where the folder is not as the module's docstring says.
        RgbdKcfError: where a file cannot be read.
    """
    sequence = otb.find(folder, FPS)[0]
    opened = sequence.open()
    truth, one = Notes(), OnePass(create_tracker('kcf'))
    run(opened.samples, truth, one)
    one.check()
    path = folder / 'results' / f'{REFERENCE}.txt'
    published = boxfiles.read(path, sequence, opened, range(len(truth.visible)))
    ours, theirs = ([track.box for track in tracks] for tracks in (one.tracks, published))
    return as_array(ours), as_array(theirs), as_array(truth.visible)


def compare(folder: Path) -> Comparison:
    """Track one sequence and hold it against its published boxes, the first frame included.

    That is OTB's measure, as published; the package's other tables leave the first frame out.

    Raises:
        RgbdKcfError: as :func:`boxes_of`.
    """
    ours, published, truth = boxes_of(folder)
    shares = [
        precision_at_20(precision_curve(center_error(boxes, truth))) for boxes in (ours, published)
    ]
    return Comparison(folder.name, len(truth), *shares)


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
        description=f'Precision at 20 px of kcf beside the published {REFERENCE} boxes.',
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
