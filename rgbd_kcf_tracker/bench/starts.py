# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a box drawn about who is half hidden starts on them, or on who is nearer.

    python -m rgbd_kcf_tracker.bench.starts people/*_13[1-6]/ --every 12

draws the box of what shows of everybody into every twelfth frame of simulated recordings, each time
as the first that the tracker sees, and holds the depth of what it takes for the target against that
of the person. Where depth tells nothing the look is followed: that is no error yet. With
``--points`` a point somewhere about the middle of that box is clicked on instead; with ``--off``
the box is drawn as badly as ``bench.spoilt --how drawn`` draws it.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rgbd_kcf_tracker.bench.spoilt import drawn_badly
from rgbd_kcf_tracker.errors import BoxError, DatasetError, RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets import everyone
from rgbd_kcf_tracker.evaluation.datasets.folder import read_fractions
from rgbd_kcf_tracker.evaluation.table import Cell, Table
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.pointing import target_at
from rgbd_kcf_tracker.metric.targets import MetricTargets
from rgbd_kcf_tracker.recordings.mot import MOT_FILE, read_mot

BODY, NOISE_PER_METRE = 0.35, 0.02
"""Metres in depth between a person's middle and what shows of them, and by how much that grows with
each metre of distance."""
SHARES = (0.0, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.01)
"""Visible shares between which starts are counted together."""
COLUMNS = (
    'visible share',
    'starts',
    'refused, %',
    'by look alone, %',
    'on who is nearer, %',
    'farther, %',
)
OFF = 0.15
"""Share of a box's size by which clicks deviate from its middle: nearly all lie in it."""


class Start(NamedTuple):
    """One start: how much of the person shows, their distance and that of what was taken.

    In metres; ``taken`` is NaN where depth told nothing, and None where the start was refused.
    """

    share: float
    distance: float
    taken: float | None


Pointing = Callable[[Frame, Box], Box | None]
"""How somebody whose box is given is pointed out to the tracker: the box that it gets, or None
where that is refused."""


def as_given(_: Frame, box: Box) -> Box:
    """The box itself."""
    return box


def clicked(rng: np.random.Generator) -> Pointing:
    """A click somewhere about the middle, by :data:`OFF`."""

    def way(frame: Frame, box: Box) -> Box | None:
        right, down = (OFF * rng.standard_normal(2)).tolist()
        try:
            return target_at(frame, box.cx + right * box.width, box.cy + down * box.height)
        except BoxError:
            return None

    return way


def badly(share: float, rng: np.random.Generator) -> Pointing:
    """A box that is off by a share of its size."""
    return lambda frame, box: drawn_badly(box, share, rng).clipped(frame.width, frame.height)


def starts(folder: Path, every: int, way: Pointing = as_given) -> Iterator[Start]:
    """All starts in a recording.

    Args:
        folder: the recording.
        every: frames from one start to the next.
        way: how people are pointed out.

    Raises:
        RgbdKcfError: where it cannot be read, or does not say how far off anybody is.
    """
    frames, _ = everyone.read(folder, 30.0)
    truth = read_mot(folder / MOT_FILE, len(frames))
    if not np.isfinite(truth.positions[:, 2]).any():
        raise DatasetError(f'{folder / MOT_FILE} does not say how far off anybody is')
    shares = {
        who: read_fractions(folder / f'visible_{who}.txt') for who in np.unique(truth.ids).tolist()
    }
    for who, known in shares.items():
        if len(known) < len(frames):
            raise DatasetError(
                f'{folder}: visible_{who}.txt has {len(known)} of {len(frames)} lines'
            )
    for number in range(every // 2, len(frames), every):
        frame = frames.frame(number)
        for at in np.flatnonzero((truth.frames == number) & (truth.scores > 0)).tolist():
            share = shares[int(truth.ids[at])][number]
            distance = float(truth.positions[at, 2])
            yield Start(share, distance, _taken(frame, way(frame, truth.box(at))))


def _taken(frame: Frame, box: Box | None) -> float | None:
    """Metres to what is taken for the target; NaN where depth tells nothing, None for nothing."""
    if box is None:
        return None
    targets = MetricTargets(MetricParameters())
    depth = targets.started(targets.add(frame, box)).depth
    return np.nan if depth is None else depth


def row(label: str, found: Sequence[Start]) -> tuple[Cell, ...]:
    """A row of the table."""
    refused = np.array([start.taken is None for start in found])
    taken = np.array([start.taken for start in found], np.float64)  # of None NaN
    distance = np.array([start.distance for start in found])
    off = taken - distance
    far = BODY + NOISE_PER_METRE * distance
    look = np.isnan(taken) & ~refused
    return (
        label,
        len(found),
        *(float(100 * n.mean()) for n in (refused, look, off < -far, off > far)),
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and print a table; status 2 where a recording cannot be read."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.starts',
        description=(__doc__ or '').split('\n')[0],
    )
    parser.add_argument(
        'folders', nargs='+', type=Path, metavar='FOLDER', help='simulated, of several people'
    )
    parser.add_argument('--every', type=int, default=12, help='frames from one start to the next')
    how = parser.add_mutually_exclusive_group()
    how.add_argument('--points', action='store_true', help='click on them instead')
    how.add_argument(
        '--off', type=float, metavar='SHARE', help='boxes are off by that of their size'
    )
    args = parser.parse_args(argv)
    if args.every < 1:
        parser.error('--every must be 1 or more')
    if args.off is not None and not 0 < args.off <= 1:
        parser.error('--off must be above 0 and at most 1')
    rng = np.random.default_rng(1)
    way = clicked(rng) if args.points else as_given
    if args.off is not None:
        way = badly(args.off, rng)
    try:
        found = [start for folder in args.folders for start in starts(folder, args.every, way)]
    except RgbdKcfError as error:
        print(error, file=sys.stderr)
        return 2
    bands = [
        (low, high, [start for start in found if low <= start.share < high])
        for low, high in itertools.pairwise(SHARES)
    ]
    rows = [row(f'{low:.1f} to {min(high, 1.0):.1f}', some) for low, high, some in bands if some]
    if found:
        rows.append(row('all', found))
    print(Table('starts', 'Who a start is on', COLUMNS, tuple(rows)).text())
    return 0


if __name__ == '__main__':
    sys.exit(main())
