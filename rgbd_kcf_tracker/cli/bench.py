# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf bench``: how long every tracker takes for a frame."""

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

NAME = 'bench'
HELP = "time every variant, and OpenCV's KCF and CSRT where installed, on the same frames"

SIZES = ('512x424:150', '960x540:100', '960x540:300', '960x540:480', '1920x1080:600')
"""sd, qhd and hd of the Kinect V2, and targets from small to as tall as the image."""
FEWEST_FRAMES = 20
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
        default=','.join(SIZES),
        help=f'image sizes and heights of the target in pixels (default {",".join(SIZES)})',
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


def run(args: argparse.Namespace) -> int:
    """Time the trackers and print the tables."""
    # Before NumPy is imported: its libraries read them once.
    for name in THREADS:
        os.environ.setdefault(name, '1')
    from rgbd_kcf_tracker.evaluation.contenders import variant
    from rgbd_kcf_tracker.evaluation.speed import Setting, measure, soak
    from rgbd_kcf_tracker.evaluation.table import Table

    settings = [Setting(*_size(text)) for text in args.sizes.split(',')]
    if args.frames < FEWEST_FRAMES:
        raise ParameterError(f'--frames is {args.frames}: give at least {FEWEST_FRAMES}')
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
        speeds = measure(contenders, setting, args.frames, lambda: interrupts.asked)
        reference = next((s.median() for s in speeds if s.contender == 'opencv:csrt'), None)
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
        print(Table('speed', str(setting), columns, rows, digits=2).text())
        print(flush=True)
    return 0


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
    for name in ('opencv:kcf', 'opencv:csrt'):
        try:
            found.append(variant(name))
        except ParameterError as missing:
            print(f'left out: {missing}', file=sys.stderr)
    return found
