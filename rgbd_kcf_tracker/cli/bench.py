# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf bench``: how long every tracker takes for a frame, with one target or several."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from rgbd_kcf_tracker.cli.common import progress
from rgbd_kcf_tracker.cli.interrupts import interrupts
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.extras import require

if TYPE_CHECKING:
    from rgbd_kcf_tracker.evaluation.contenders import Contender
    from rgbd_kcf_tracker.evaluation.speed import Speed
    from rgbd_kcf_tracker.evaluation.speed_several import SpeedsOfSeveral
    from rgbd_kcf_tracker.evaluation.table import Table

NAME = 'bench'
HELP = "time every variant, and OpenCV's KCF and CSRT where installed, on the same frames"

SIZES = ('512x424:150', '960x540:100', '960x540:300', '960x540:480', '1920x1080:600')
"""sd, qhd and hd of the Kinect V2, and targets from small to as tall as the image."""
SIZE_OF_SEVERAL = '960x540:300'
"""For several targets: qhd and the height of a person at 3 m."""
FEWEST_FRAMES = 20
REFERENCE = 'opencv:csrt'
THREADS = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        '--variants',
        metavar='NAMES',
        help="comma-separated, also opencv:kcf and opencv:csrt (default: all variants and OpenCV's "
        'KCF and CSRT where this OpenCV has them)',
    )
    parser.add_argument(
        '--sizes',
        metavar='WxH:T,...',
        help=f'image sizes and heights of the target in pixels (default {",".join(SIZES)}; with '
        f'--targets {SIZE_OF_SEVERAL})',
    )
    parser.add_argument(
        '--targets',
        metavar='N',
        type=int,
        nargs='+',
        help='instead, follow that many people at once in a simulated scene in which all are in '
        'view, as in 1 2 4 8, and report what each further one costs (default variant: metric)',
    )
    parser.add_argument(
        '--lost',
        action='store_true',
        help='with --targets: all but the first run out of the image and stay away, and the time '
        'after that counts',
    )
    parser.add_argument(
        '--without-depth', action='store_true', help='with --targets: the same on colour alone'
    )
    parser.add_argument(
        '--frames', metavar='N', type=int, default=180, help='frames of each (default 180)'
    )
    parser.add_argument(
        '--soak',
        metavar='N',
        type=int,
        help='instead, run each over N frames at the first size and report the memory it holds',
    )
    parser.add_argument('--csv', action='store_true', help='print the tables as CSV')


def run(args: argparse.Namespace) -> int:
    """Time the trackers and print the tables."""
    # Before NumPy is imported: its libraries read them once.
    for name in THREADS:
        os.environ.setdefault(name, '1')
    from rgbd_kcf_tracker.evaluation.contenders import variant
    from rgbd_kcf_tracker.evaluation.speed import Setting, measure, soak
    from rgbd_kcf_tracker.evaluation.speed_several import Case, measure_several
    from rgbd_kcf_tracker.variants import DEFAULT_VARIANT

    sizes = args.sizes or (','.join(SIZES) if args.targets is None else SIZE_OF_SEVERAL)
    settings = [Setting(*_size(text)) for text in sizes.split(',')]
    for setting in settings:
        if setting.target_width > setting.width:
            raise ParameterError(
                f'size {setting}: the target is {setting.target_width} pixels wide, which do not '
                'fit into the image: give a smaller one'
            )
    if args.frames < FEWEST_FRAMES:
        raise ParameterError(f'--frames is {args.frames}: give at least {FEWEST_FRAMES}')
    if args.targets is not None:
        if args.soak is not None:
            raise ParameterError('give --targets or --soak, not both')
        if min(args.targets) < 1 or len(set(args.targets)) < len(args.targets):
            given = ' '.join(map(str, args.targets))
            raise ParameterError(f'--targets is {given}: give numbers from 1, each once')
        several = [variant(name.strip()) for name in (args.variants or DEFAULT_VARIANT).split(',')]
        reference = _contender(REFERENCE, variant)
        case = Case(args.lost, not args.without_depth)
        for setting in progress(settings, len(settings), NAME):
            speeds = measure_several(
                several,
                setting,
                args.targets,
                args.frames,
                case,
                reference,
                lambda: interrupts.asked,
            )
            _print(_tables_of_several(speeds), args.csv)
        return 0
    if args.lost or args.without_depth:
        raise ParameterError('--lost and --without-depth are of --targets: give it, as in 1 2 4 8')
    contenders = _contenders(args.variants, variant)
    if args.soak is not None:
        if args.soak < FEWEST_FRAMES:
            raise ParameterError(f'--soak is {args.soak}: give at least {FEWEST_FRAMES}')
        require('tools', 'bench --soak')
        for contender in progress(contenders, len(contenders), NAME):
            memory = soak(contender, settings[0], args.soak)
            held = ', '.join(f'{m:.0f}' for m in memory.samples)
            print(
                f'{contender.name}: {memory.frames} frames, MiB held {held}: '
                f'{memory.growth:+.1f} MiB from the first to the last',
                flush=True,
            )
        return 0
    for setting in progress(settings, len(settings), NAME):
        found = measure(contenders, setting, args.frames, lambda: interrupts.asked)
        _print([_table(str(setting), found)], args.csv)
    return 0


def _print(tables: list[Table], as_csv: bool) -> None:
    for table in tables:
        print(table.csv() if as_csv else f'{table.text()}\n', flush=True)


def _table(title: str, speeds: list[Speed]) -> Table:
    from rgbd_kcf_tracker.evaluation.table import Table

    reference = next((s.median() for s in speeds if s.contender == REFERENCE), None)
    rows = tuple(
        (
            s.contender,
            s.median(),
            s.p95(),
            s.searching_p95(),
            _ratio(s.median(), reference),
        )
        for s in speeds
    )
    columns = ('tracker', 'median ms', 'p95 ms', 'searching p95 ms', 'median / CSRT')
    return Table('speed', title, columns, rows, digits=2)


def _tables_of_several(measured: SpeedsOfSeveral) -> list[Table]:
    """By number of targets, and what each further one costs."""
    from rgbd_kcf_tracker.evaluation.table import Table

    csrt = measured.reference
    by_targets = tuple(
        (
            speed.contender,
            targets,
            speed.median(targets),
            speed.mean(targets),
            100 * speed.found[targets],
            _ratio(speed.median(targets), csrt),
        )
        for speed in measured.speeds
        for targets in speed.milliseconds
    )
    columns = ('tracker', 'targets', 'median ms', 'mean ms', 'found %', 'median / CSRT')
    further = tuple(
        (speed.contender, *costs, *(_ratio(cost, csrt) for cost in costs))
        for speed in measured.speeds
        for costs in [(speed.each_further(speed.median), speed.each_further(speed.mean))]
    )
    names = ('tracker', 'median ms', 'mean ms', 'median / CSRT', 'mean / CSRT')
    return [
        Table(
            'speed_targets', f'{measured.setting}, {measured.case}', columns, by_targets, digits=2
        ),
        Table('speed_further', 'each further target', names, further, digits=3),
    ]


def _ratio(value: float | None, reference: float | None) -> float | None:
    return value / reference if value is not None and reference else None


def _size(text: str) -> tuple[int, int, int]:
    try:
        image, target = text.strip().split(':')
        width, height = image.lower().split('x')
        size = int(width), int(height), int(target)
    except ValueError:
        raise ParameterError(
            f'size {text!r}: give WIDTHxHEIGHT:TARGET in pixels, as in 960x540:300'
        ) from None
    if size[0] < 64 or size[1] < 64 or not 12 <= size[2] <= size[1]:
        raise ParameterError(
            f'size {text!r}: the image must be at least 64x64, the target 12 pixels to its height'
        )
    return size


def _contenders(names: str | None, variant: Callable[[str], Contender]) -> list[Contender]:
    from rgbd_kcf_tracker.variants import VARIANTS

    if names is not None:
        return [variant(name.strip()) for name in names.split(',')]
    found = [variant(name) for name in VARIANTS]
    peers = (_contender(name, variant) for name in ('opencv:kcf', REFERENCE))
    return found + [peer for peer in peers if peer is not None]


def _contender(name: str, variant: Callable[[str], Contender]) -> Contender | None:
    """One of OpenCV's trackers, None where this OpenCV has it not."""
    try:
        return variant(name)
    except ParameterError as missing:
        print(f'left out: {missing}', file=sys.stderr)
        return None
