# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf sweep``: try settings of parameters against each other, and say what is noise."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rgbd_kcf_tracker.cli.benchmarks import (
    add_data_options,
    check_report,
    checked,
    data_options,
    end,
    in_words,
    report_folder,
    run_jobs,
    run_options,
)
from rgbd_kcf_tracker.cli.common import add_overwrite_option, escaped
from rgbd_kcf_tracker.cli.interrupts import interrupts
from rgbd_kcf_tracker.cli.workers import add_worker_options, shard_of
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.extras import require

if TYPE_CHECKING:
    from rgbd_kcf_tracker.evaluation.datasets import Sequence as Benchmark

NAME = 'sweep'
HELP = 'try values of parameters on benchmarks, and say what matters and what is noise'

_EPILOG = """\
parameters ([VARIANT.]KEY, of one variant):
  KEY=LOW:HIGH:N      N values from LOW to HIGH; LOW:HIGH:N:log by equal factors
  KEY=LOW:HIGH        any value between, in a random search; five in a grid
  KEY=A,B,C           these values; a single one is set in every run
  KEY                 the parameter's own range, or true and false, or all its choices

examples:
  rgbd-kcf sweep sim:all --seeds 1-3 --param metric.acceptance=0.3:0.7:5 --report sweep/
  rgbd-kcf sweep data/ --search random --samples 100 --param metric.acceptance \\
      --param metric.acceleration=1:10:log --held-out 0.3 --report sweep/

Some of the sequences are held out: settings are chosen on the others, and the best are then held
against the default on these. Run again with the same --report to go on after an interruption, or
with more --samples to add to those there.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = _EPILOG
    parser.add_argument('dataset', nargs='+', metavar='DATASET', help='as evaluate takes them')
    parser.add_argument(
        '--report', required=True, type=Path, metavar='DIR', help='where the report goes'
    )
    group = parser.add_argument_group('search')
    group.add_argument(
        '--param', action='append', required=True, metavar='[VARIANT.]KEY[=SPEC]',
        help='a parameter and its values, see below; may be given again',
    )  # fmt: skip
    group.add_argument('--variant', metavar='NAME', help='the tracker (default: metric)')
    group.add_argument(
        '--search', choices=('grid', 'random'), default='grid',
        help='every combination of values (the default), or values drawn at random',
    )  # fmt: skip
    group.add_argument(
        '--samples', type=int, default=50, metavar='N',
        help='settings of a random search (default 50)',
    )  # fmt: skip
    group.add_argument(
        '--seed', type=int, default=0, metavar='N',
        help='of the search, and of which sequences are held out (default 0)',
    )  # fmt: skip
    group.add_argument(
        '--held-out', default='0.3', metavar='SHARE|DATASET',
        help='share of the recordings, or other data, on which nothing is chosen (default 0.3)',
    )  # fmt: skip
    group.add_argument(
        '--finalists', type=int, default=3, metavar='N',
        help='best settings that are run on held-out data (default 3)',
    )  # fmt: skip
    group.add_argument(
        '--measure', default='success', metavar='NAME',
        help='what is made better: success, iou, strangers, returns, recall_of_absence, '
        'precision_20px, ... (default success)',
    )  # fmt: skip
    add_data_options(parser)
    group = parser.add_argument_group('running')
    add_worker_options(group)
    add_overwrite_option(group, 'files in a DIR that holds other things than a report')


def run(args: argparse.Namespace) -> int:
    """Try the settings, then the best on held-out data, then write the report."""
    require('report', NAME)
    import dataclasses

    from rgbd_kcf_tracker.evaluation import sweep, sweep_tables
    from rgbd_kcf_tracker.evaluation.metrics import Measures
    from rgbd_kcf_tracker.evaluation.report import PAGE, Heading, write_sweep_report

    held_out = [] if _is_share(args.held_out) else [args.held_out]
    check_report(args.report, [*args.dataset, *held_out], args.overwrite)
    measures = [f.name for f in dataclasses.fields(Measures)]
    if args.measure not in measures:
        raise ParameterError(f'--measure {args.measure!r}: choose from {", ".join(measures)}')
    if args.finalists < 1:
        raise ParameterError(f'--finalists is {args.finalists}: give 1 or more')
    variant, axes = sweep.parse_axes(args.param, args.variant)
    settings = (
        sweep.grid(variant, axes)
        if args.search == 'grid'
        else sweep.random(variant, axes, args.samples, args.seed)
    )
    default = sweep.baseline(variant, axes)
    tried, held = _split(args)
    shard = shard_of(args)
    options = run_options(args)
    with report_folder(args.report):
        every = [default, *settings]
        if shard is not None:
            own = shard.of(tried)
            _, _, failures = run_jobs(args, own, [s.contender for s in every], options)
            print(
                f'part {shard}: {len(own)} of {len(tried)} sequences; bring the folders of all '
                'parts together, and run once more without --shard'
            )
            return end(failures)
        tried, _, failures = run_jobs(args, tried, [s.contender for s in every], options)
        if interrupts.asked:  # nothing can be said before all settings have run
            return end(failures)
        scores, tried_of = sweep_tables.scores(
            args.report, tried, every, options, args.measure, failures
        )
        sign = -1.0 if args.measure in sweep_tables.SMALLER_IS_BETTER else 1.0
        finalists = sweep_tables.best(scores, args.finalists, sign)
        last = [default, *(settings[i] for i in finalists)]
        held, _, more = run_jobs(args, held, [s.contender for s in last], options)
        failures += more
        if interrupts.asked:
            return end(failures)
        found = sweep_tables.Found(
            args.measure,
            tuple(axis for axis in axes if not axis.fixed),
            args.search == 'grid',
            default,
            tuple(settings),
            scores,
            tried_of,
            finalists,
            *sweep_tables.scores(args.report, held, last, options, args.measure, more),
        )
        words = f'{in_words(args)}; {args.search} search, seed {args.seed}'
        heading = Heading((*args.dataset, f'held out: {args.held_out}'), words)
        frames = sweep_tables.frames(args.report, [*tried, *held], options)
        tables = write_sweep_report(args.report, found, failures, heading, frames)
        for table in tables[:2]:
            print(f'{table.text()}\n')
        print(f'report: {escaped(str(args.report / PAGE))}')
        return end(failures)


def _split(args: argparse.Namespace) -> tuple[list[Benchmark], list[Benchmark]]:
    """Sequences to try settings on, and those held out."""
    from rgbd_kcf_tracker.evaluation import sweep
    from rgbd_kcf_tracker.evaluation.datasets import open_dataset

    options = data_options(args)
    sequences = [s for text in args.dataset for s in open_dataset(text, options)]
    if _is_share(args.held_out):
        return sweep.split(checked(args, sequences), float(args.held_out), args.seed)
    held = open_dataset(args.held_out, options)
    both = {s.name for s in sequences} & {s.name for s in held}
    if both:
        raise ParameterError(
            f'--held-out {args.held_out}: {sorted(both)[0]} is among the data, too: what is '
            'held out must not be chosen on'
        )
    checked(args, [*sequences, *held])
    return sequences, held


def _is_share(text: str) -> bool:
    """Whether ``--held-out`` is a number, and no data set."""
    try:
        float(text)
    except ValueError:
        return False
    return True
