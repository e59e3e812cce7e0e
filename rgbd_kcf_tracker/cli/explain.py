# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf explain``: pictures of what the trackers compute, step by step, on one frame."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

from rgbd_kcf_tracker.cli.common import (
    SOURCE_HELP,
    Warnings,
    add_overwrite_option,
    add_reading_options,
    add_scene_options,
    escaped,
    open_source,
    parse_box,
)
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.extras import require

NAME = 'explain'
HELP = 'show step by step, in pictures, how the trackers see one frame'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        'source', metavar='SOURCE', nargs='?', help=f'{SOURCE_HELP}; a simulated scene if left out'
    )
    parser.add_argument(
        '--output', metavar='DIR', required=True, help='folder for index.html and the pictures'
    )
    parser.add_argument(
        '--frame', metavar='N', type=int, help='the frame to explain (default: the tenth)'
    )
    parser.add_argument(
        '--init',
        metavar='X,Y,W,H',
        help="the target's box in the first frame (default: the first ground-truth box)",
    )
    parser.add_argument('--start', metavar='N', type=int, default=0, help='first frame (default 0)')
    parser.add_argument(
        '--variants',
        metavar='NAMES',
        default='kcf,rgbd,rgbd_pf,metric',
        help='trackers to explain, parted by commas (default: all)',
    )
    add_overwrite_option(parser, 'what is in DIR')
    add_scene_options(parser, seed=3)
    add_reading_options(parser)


def run(args: argparse.Namespace) -> int:
    """Run the trackers, draw, write."""
    require('report', NAME)
    from rgbd_kcf_tracker.recordings.outputs import check_outputs
    from rgbd_kcf_tracker.view.explain.book import VARIANTS, explain
    from rgbd_kcf_tracker.view.explain.page import PAGE, write_page
    from rgbd_kcf_tracker.view.sources import first_box

    variants = tuple(name.strip() for name in args.variants.split(',') if name.strip())
    for name in variants:
        if name not in VARIANTS:
            raise ParameterError(
                f'unknown variant {name!r} in --variants: choose from {", ".join(VARIANTS)}'
            )
    if not variants:
        raise ParameterError(f'no trackers: give --variants some of {", ".join(VARIANTS)}')
    folder = Path(args.output)
    check_outputs(
        {'--output': folder},
        [] if args.source is None else [args.source],
        args.overwrite,
        folders=('--output',),
    )
    given = None if args.init is None else parse_box(args.init)
    with open_source(args) as recording:
        warnings = Warnings(recording.warnings)
        warnings.show()
        start, box = first_box(recording, given, args.start)
        asked = min(start + 10, len(recording) - 1) if args.frame is None else args.frame
        chapters = explain(recording, start, box, asked, variants)
        warnings.show()
        title = f'Frame {asked} of {recording.name}, explained'
        written = write_page(folder, title, _command(), chapters, args.overwrite)
    count = sum(path.suffix == '.png' for path in written)
    print(escaped(f'{recording.name}: frame {asked} in {count} pictures; open {folder / PAGE}'))
    return 0


def _command() -> str:
    words = ['rgbd-kcf', *sys.argv[1:]] if sys.argv[1:2] == [NAME] else []
    return shlex.join(words)
