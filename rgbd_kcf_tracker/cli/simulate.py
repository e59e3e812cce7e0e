# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf simulate``: record simulated scenes as bags or sequence folders."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rgbd_kcf_tracker.errors import ParameterError, RecordingError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rgbd_kcf_tracker.simulation import SimulatedFrame, SimulatedSequence

NAME = 'simulate'
HELP = 'record simulated scenes with exact ground truth'
_EPILOG = """\
examples:
  rgbd-kcf simulate --list
  rgbd-kcf simulate walk.mcap --scenario occlusion --seed 3
  rgbd-kcf simulate walk/ --scenario fast_motion --rate 5
  rgbd-kcf simulate scenes/ --scenario all --seed 100 --count 2
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = _EPILOG
    parser.add_argument(
        'dest',
        nargs='?',
        type=Path,
        metavar='DEST',
        help='a file that ends in .mcap, or a sequence folder; with several scenes, the folder in '
        'which each gets its own (SCENARIO_SEED)',
    )
    parser.add_argument(
        '--scenario',
        action='append',
        metavar='NAME',
        help="what happens (default: normal); may be given again; 'all' for every scenario",
    )
    parser.add_argument(
        '--seed', type=int, default=0, metavar='N', help='of everything random (default: 0)'
    )
    parser.add_argument(
        '--count',
        type=int,
        default=1,
        metavar='N',
        help='record this many seeds, counted up from --seed (default: 1)',
    )
    parser.add_argument(
        '--rate', type=float, default=30.0, metavar='HZ', help='frames per second (default: 30)'
    )
    parser.add_argument(
        '--duration',
        type=float,
        metavar='S',
        help="seconds (default: the scene's own length, 4 to 10)",
    )
    parser.add_argument(
        '--size',
        default='960x540',
        metavar='WxH',
        help='of the colour image (default: 960x540, the qhd of kinect2_bridge)',
    )
    parser.add_argument(
        '--format',
        choices=('mcap', 'folder'),
        help='of each scene when there are several (default: folder)',
    )
    parser.add_argument('--overwrite', action='store_true', help='replace what is at DEST')
    parser.add_argument('--list', action='store_true', help='list the scenarios and stop')
    parser.add_argument('--quiet', action='store_true', help='no progress bar')


def run(args: argparse.Namespace) -> int:
    """Record what was asked for."""
    from rgbd_kcf_tracker.simulation import SCENARIOS, check_request, simulate

    if args.list:
        width = max(map(len, SCENARIOS))
        for scenario in SCENARIOS.values():
            print(f'{scenario.name:{width}}  {scenario.description}')
        return 0
    if args.dest is None:
        raise ParameterError('DEST is missing: name an .mcap file or a folder to write (or --list)')
    if args.count < 1:
        raise ParameterError(f'--count is {args.count}: give 1 or more')
    names: list[str] = args.scenario or ['normal']
    if 'all' in names:
        names = list(SCENARIOS)
    size = _parse_size(args.size)
    for name in names:  # find every mistake before anything is written
        check_request(name, args.seed, args.rate, args.duration, size)
    seeds = range(args.seed, args.seed + args.count)
    if len(names) * len(seeds) == 1:
        if args.format == 'mcap' and args.dest.suffix != '.mcap':
            raise ParameterError(f'--format mcap, but {args.dest} does not end in .mcap')
        _prepare(args.dest, args.overwrite)
        sequence = simulate(names[0], args.seed, args.rate, args.duration, size)
        _record(sequence, args.dest, args.quiet)
        return 0
    if args.dest.suffix == '.mcap':
        raise ParameterError(
            f'{args.dest} is one file for {len(names) * len(seeds)} scenes: name a folder'
        )
    suffix = '.mcap' if args.format == 'mcap' else ''
    for name in names:
        for seed in seeds:
            dest = args.dest / f'{name}_{seed}{suffix}'
            _prepare(dest, args.overwrite)
            _record(simulate(name, seed, args.rate, args.duration, size), dest, args.quiet)
    return 0


def _parse_size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition('x')
    if not (cross and width.strip().isdecimal() and height.strip().isdecimal()):
        raise ParameterError(f'--size is {text!r}: give WIDTHxHEIGHT, such as 960x540')
    return int(width), int(height)


def _prepare(dest: Path, overwrite: bool) -> None:
    """Make sure that nothing is overwritten unasked, and that the parent folder is there."""
    occupied = dest.is_file() or (dest.is_dir() and any(dest.iterdir()))
    if occupied and not overwrite:
        raise RecordingError(f'{dest} exists already: choose another name, or add --overwrite')
    if occupied and dest.is_dir():
        if not (dest / 'rgb').is_dir():
            raise RecordingError(f'{dest} is a folder but no sequence: it will not be replaced')
        shutil.rmtree(dest)
    elif occupied:
        dest.unlink()
    try:
        dest.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f'cannot create {dest.parent}: {error.strerror}') from error


def _record(sequence: SimulatedSequence, dest: Path, quiet: bool) -> None:
    """Render a sequence and write it, frame by frame."""
    from tqdm import tqdm

    title = f'{sequence.scenario} (seed {sequence.seed})'
    bar = tqdm(
        sequence,
        total=len(sequence),
        desc=title,
        unit='frame',
        disable=quiet,
        file=sys.stderr,
        mininterval=0.5,
    )
    frames: Iterable[SimulatedFrame] = bar
    hidden = 0
    with _writer(dest) as write:
        for simulated in frames:
            write(simulated)
            hidden += simulated.visible is None
    print(
        f'{dest}: {title}, {len(sequence)} frames at {sequence.rate_hz:g} Hz, '
        f'target hidden in {hidden}'
    )


def _writer(dest: Path) -> AbstractContextManager[Callable[[SimulatedFrame], None]]:
    return _bag(dest) if dest.suffix == '.mcap' else _folder(dest)


@contextmanager
def _bag(dest: Path) -> Iterator[Callable[[SimulatedFrame], None]]:
    from rgbd_kcf_tracker.recordings import BagWriter

    with BagWriter(dest) as bag:

        def write(simulated: SimulatedFrame) -> None:
            bag.write_frame(simulated.frame)
            bag.write_truth(simulated.frame, simulated.visible, simulated.body)

        yield write


@contextmanager
def _folder(dest: Path) -> Iterator[Callable[[SimulatedFrame], None]]:
    from rgbd_kcf_tracker.recordings import SequenceWriter

    with SequenceWriter(dest) as folder:

        def write(simulated: SimulatedFrame) -> None:
            folder.write(simulated.frame, simulated.visible, simulated.body)

        yield write
