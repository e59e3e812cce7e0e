# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf evaluate``: run trackers on benchmarks and write a report."""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rgbd_kcf_tracker.cli.benchmarks import (
    USUAL,
    add_data_options,
    check_report,
    checked,
    data_options,
    end,
    in_words,
    report_folder,
    run_jobs,
    run_options,
    words,
)
from rgbd_kcf_tracker.cli.common import (
    add_overwrite_option,
    escaped,
    parse_assignments,
    progress,
    refuse,
    tracker_parameters,
)
from rgbd_kcf_tracker.cli.interrupts import interrupts
from rgbd_kcf_tracker.cli.workers import WORKER_OPTIONS, add_worker_options, record, shard_of
from rgbd_kcf_tracker.errors import ParameterError, RgbdKcfError
from rgbd_kcf_tracker.extras import require

if TYPE_CHECKING:
    from rgbd_kcf_tracker.evaluation.contenders import Contender
    from rgbd_kcf_tracker.evaluation.datasets import Sequence as Benchmark
    from rgbd_kcf_tracker.evaluation.parts import Whole
    from rgbd_kcf_tracker.evaluation.report import Heading
    from rgbd_kcf_tracker.parameters import Parameters

NAME = 'evaluate'
HELP = 'run trackers on benchmarks or simulated scenes and write a report'

_OF_ONE_TARGET = ('short_term', 'eao_lengths', 'export')
_OF_MERGE = ('merge', 'dataset', 'report', 'overwrite', 'run')

_EPILOG = """\
data sets:
  DIR                 a sequence folder, or a folder of them: our own layout, OTB, VOT, CDTB,
                      DepthTrack or Princeton, found out by their file names; or a bag with truth
  sim:all             every simulated scene; sim:occlusion,crowd some; sim:all:1-5 with these seeds

trackers:
  --variants          kcf, rgbd, rgbd_pf, metric, and OpenCV's opencv:kcf, opencv:csrt, opencv:mil
  --boxes NAME=PATH   boxes in files: a folder, or a path with {sequence} in it; with --everyone
                      MOT Challenge text

examples:
  rgbd-kcf evaluate sim:all --seeds 1-3 --report report/
  rgbd-kcf evaluate data/otb --kind otb --variants kcf,opencv:mil --report report/
  rgbd-kcf evaluate data/otb --kind otb --boxes 'KCF=data/otb/{sequence}/results/KCF.txt' \\
      --report report/
  rgbd-kcf evaluate sim:all --variants metric --ablate --report report/
  rgbd-kcf evaluate MOT17/train --everyone --boxes 'SORT=sort/' --report report/
  rgbd-kcf evaluate recordings/ --identity --report report/

  rgbd-kcf evaluate data/ --shard 3/16 --report part3/      (each machine another part)
  rgbd-kcf evaluate --merge part*/ --report report/
  rgbd-kcf evaluate data/ --cluster tcp://HOST:8786 --report report/

Ctrl-C finishes the runs under way and reports what there is; pressed again it stops at once. Run
again with the same --report to go on, or to add trackers.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = _EPILOG
    parser.add_argument('dataset', nargs='*', metavar='DATASET', help='see below')
    parser.add_argument(
        '--report', required=True, type=Path, metavar='DIR', help='where the report goes'
    )
    group = parser.add_argument_group('trackers')
    group.add_argument('--variants', metavar='A,B', help='trackers to run (default: all of ours)')
    group.add_argument(
        '--boxes', action='append', default=[], metavar='NAME=PATH',
        help="another tracker's boxes; may be given again",
    )  # fmt: skip
    group.add_argument(
        '--param', action='append', default=[], metavar='[VARIANT.]KEY=VALUE',
        help='a parameter other than its default; may be given again',
    )  # fmt: skip
    group.add_argument(
        '--everyone', action='store_true',
        help='follow everyone in view, nobody given, in recordings with the truth about several '
        'people: HOTA, IDF1, MOTA, id switches',
    )  # fmt: skip
    group.add_argument(
        '--identity', action='store_true',
        help='no tracking: how well people are told apart by their look, in recordings with the '
        'truth about several people',
    )  # fmt: skip
    group.add_argument(
        '--ablate', action='store_true',
        help='also run each variant with every parameter use_... off in turn',
    )  # fmt: skip
    add_data_options(parser)
    group = parser.add_argument_group('running')
    add_worker_options(group)
    group.add_argument(
        '--merge', nargs='+', type=Path, default=[], metavar='DIR',
        help='join the parts that --shard left in these folders, and write the report of all',
    )  # fmt: skip
    group.add_argument(
        '--short-term', action='store_true',
        help="also run VOT's protocol with re-initialisation (takes twice as long)",
    )  # fmt: skip
    group.add_argument(
        '--eao-lengths', metavar='LOW-HIGH',
        help='sequence lengths over which EAO is averaged: 108-371 for VOT2015, 46-291 for VOT2019 '
        '(default: the typical lengths of the sequences)',
    )  # fmt: skip
    group.add_argument(
        '--fresh', action='store_true', help='run again what the report folder already holds'
    )
    group.add_argument(
        '--export', action='append', default=[], choices=('princeton', 'vot'),
        help='also write results as this benchmark takes them',
    )  # fmt: skip
    add_overwrite_option(group, 'files in a DIR that holds other things than a report')


def run(args: argparse.Namespace) -> int:
    """Run everything that is not done yet, then write the report; returns the exit code."""
    require('report', NAME)
    from rgbd_kcf_tracker.evaluation.datasets import open_dataset
    from rgbd_kcf_tracker.evaluation.parts import Whole, write_part

    if args.merge:
        return _merge(args)
    if not args.dataset:
        raise ParameterError('no data: give DATASET, or --merge DIR... to join parts')
    if args.everyone:
        refuse(args, 'with --everyone', ('kind', *_OF_ONE_TARGET), usual=USUAL)
    check_report(args.report, args.dataset, args.overwrite)
    if args.identity:
        return _identity(args)
    if not args.short_term:
        refuse(args, 'without --short-term', ('eao_lengths',), 'add it, or leave this out')
    contenders, ablated = _contenders(args)
    eao_lengths = _lengths(args.eao_lengths)
    read = data_options(args, everyone=args.everyone or args.identity)
    sequences = checked(args, [s for text in args.dataset for s in open_dataset(text, read)])
    options = run_options(args, args.short_term, args.fresh)
    shard = shard_of(args)
    own = sequences if shard is None else shard.of(sequences)
    with report_folder(args.report):
        own, contenders, failures = run_jobs(args, own, contenders, options)
        heading = _heading(args, ablated, eao_lengths)
        whole = Whole(
            own, contenders, options, heading, failures, tuple(args.export), args.everyone
        )
        if shard is None:
            return _report(args.report, whole)
        if interrupts.asked:  # it is no part until all of it has run
            return end(failures)
        write_part(args.report, shard, sequences, whole)
    print(f'part {shard}: {len(own)} of {len(sequences)} sequences; join all parts with --merge')
    return end(failures)


def _merge(args: argparse.Namespace) -> int:
    """Join parts, and write the report of the whole."""
    from rgbd_kcf_tracker.evaluation.parts import join
    from rgbd_kcf_tracker.recordings.outputs import check_held

    if args.dataset:
        raise ParameterError('--merge takes the folders of parts alone: their data is known')
    others = [name for name in vars(args) if name not in _OF_MERGE]
    refuse(args, 'with --merge', others, 'it is of the parts, leave it out', USUAL)
    check_report(args.report, (), args.overwrite)
    # The report may be one of the parts, or lie in one; of the others nothing is written to.
    whose = Path(os.path.realpath(args.report))
    apart = [p for p in args.merge if not whose.is_relative_to(os.path.realpath(p))]
    check_held(args.report, apart)
    with report_folder(args.report):
        whole = join(args.merge, args.report)
        record(args.report, 'parts joined', parts=[str(place) for place in args.merge])
        return _report(args.report, whole)


def _report(folder: Path, whole: Whole) -> int:
    with interrupts.held('the report is written, then it stops'):
        return _report_everyone(folder, whole) if whole.everyone else _report_one(folder, whole)


def _report_one(folder: Path, whole: Whole) -> int:
    from rgbd_kcf_tracker.evaluation.export import export
    from rgbd_kcf_tracker.evaluation.perframe import collect
    from rgbd_kcf_tracker.evaluation.place_tables import places_table
    from rgbd_kcf_tracker.evaluation.report import PAGE, write_report
    from rgbd_kcf_tracker.evaluation.score_tables import overview

    collected = collect(folder, whole.sequences, whole.contenders, whole.options)
    for form in whole.exports:
        export(folder, whole.sequences, whole.contenders, whole.options, form)
    if not collected.results and collected.unmeasured:
        print(f'{len(collected.unmeasured)} sequences were run; none has ground truth to measure')
    elif collected.results or not interrupts.asked:
        measured = write_report(folder, collected, whole.contenders, whole.failures, whole.heading)
        print(overview(measured).text())
        places = places_table(collected.places)
        if places is not None:
            print(f'\n{places.text()}')
        times = _write_times(folder, [(r.tracker, r.sequence) for r in collected.results])
        print(f'\n{times}\n\nreport: {escaped(str(folder / PAGE))}')
    return end(whole.failures)


def _identity(args: argparse.Namespace) -> int:
    from rgbd_kcf_tracker.evaluation.datasets import open_dataset

    options = ('everyone', 'variants', 'boxes', 'ablate', 'fresh', *WORKER_OPTIONS)
    refuse(args, 'with --identity', ('kind', *options, *_OF_ONE_TARGET), usual=USUAL)
    read = data_options(args, everyone=args.everyone or args.identity)
    sequences = checked(args, [s for text in args.dataset for s in open_dataset(text, read)])
    parameters = tracker_parameters(args, 'metric')
    with report_folder(args.report):
        return _compare(args, sequences, parameters)


def _compare(
    args: argparse.Namespace, sequences: Sequence[Benchmark], parameters: Parameters
) -> int:
    from rgbd_kcf_tracker.evaluation import identity
    from rgbd_kcf_tracker.evaluation.jobs import Failure, as_asked
    from rgbd_kcf_tracker.evaluation.report import PAGE, write_identity_report

    seen, failures = [], []
    for sequence in sequences:
        try:
            samples = as_asked(sequence.open().samples, sequence, run_options(args))
            frames = progress(samples, None, sequence.name)
            seen.append(identity.look(sequence.name, frames, identity.metric_views(parameters)))
        except RgbdKcfError as error:
            failures.append(Failure(sequence.name, '', str(error)))
    record(args.report, 'one process', failures=len(failures))
    pairs = identity.all_pairs(seen, identity.metric_views(parameters))
    table = write_identity_report(args.report, pairs, failures, _heading(args))
    print(table.text())
    print(f'\nreport: {escaped(str(args.report / PAGE))}')
    return end(failures)


def _report_everyone(folder: Path, whole: Whole) -> int:
    from rgbd_kcf_tracker.evaluation import everyone
    from rgbd_kcf_tracker.evaluation.jobs import is_done, truth_key
    from rgbd_kcf_tracker.evaluation.report import PAGE, write_everyone_report

    results = [
        everyone.read(folder, sequence, contender.name, truth_key(sequence, whole.options))
        for sequence in whole.sequences
        for contender in whole.contenders
        if is_done(folder, sequence, contender, whole.options)
    ]
    if results or not interrupts.asked:
        table = write_everyone_report(
            folder, results, whole.contenders, whole.failures, whole.heading
        )
        print(table.text())
        times = _write_times(
            folder, [(r.tracker, everyone.times_name(r.sequence)) for r in results]
        )
        print(f'\n{times}\n\nreport: {escaped(str(folder / PAGE))}')
    return end(whole.failures)


def _write_times(folder: Path, runs: Sequence[tuple[str, str]]) -> str:
    """The table of times, which is no part of the report, as text too."""
    from rgbd_kcf_tracker.evaluation.times import FILE, times_table
    from rgbd_kcf_tracker.recordings.outputs import write_atomically

    table = times_table(folder, runs)
    write_atomically(folder / FILE, table.csv())
    return table.text()


def _heading(
    args: argparse.Namespace,
    ablated: Sequence[str] = (),
    eao_lengths: tuple[int, int] | None = None,
) -> Heading:
    from rgbd_kcf_tracker.evaluation.report import Heading

    return Heading(tuple(args.dataset), in_words(args), tuple(ablated), eao_lengths)


def _contenders(args: argparse.Namespace) -> tuple[list[Contender], list[str]]:
    from rgbd_kcf_tracker.evaluation import contenders
    from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS

    if args.variants is not None:
        names = words(args.variants)
    else:
        ours = [DEFAULT_VARIANT] if args.everyone else list(VARIANTS)
        names = [] if args.boxes and not args.ablate else ours
    overrides = _overrides(args.param, names)
    found, ablated = [], []
    for name in names:
        base = contenders.variant(name, overrides.get(name))
        found.append(base)
        if args.everyone:
            base.make_set().everyone = True  # tried out, so that an error comes at once
        if args.ablate and (base.kind == 'variant' and contenders.switches(base)):
            found.extend(contenders.ablations(base))
            ablated.append(base.name)
    if args.ablate and not ablated:
        raise ParameterError(
            f'--ablate: none of {", ".join(names) or "no variants"} has a parameter use_... to '
            'switch off'
        )
    found.extend(contenders.boxes(text) for text in args.boxes)
    if not found:
        raise ParameterError('no trackers: give --variants or --boxes')
    return contenders.unique(found), ablated


def _overrides(items: Sequence[str], variants: Sequence[str]) -> dict[str, dict[str, str]]:
    """Parameters per variant; a key without a variant is for all that have it."""
    from rgbd_kcf_tracker.parameters import describe
    from rgbd_kcf_tracker.variants import VARIANTS

    known = {
        name: {info.name for info in describe(VARIANTS[name].parameters)}
        for name in variants
        if name in VARIANTS
    }
    result: dict[str, dict[str, str]] = {name: {} for name in known}
    for key, value in parse_assignments(items).items():
        variant, dot, name = key.rpartition('.')
        owners = [variant] if dot else [v for v, names in known.items() if key in names]
        if dot and variant not in known:
            raise ParameterError(f'--param {key}: {variant!r} is not among the variants run')
        if not owners:
            raise ParameterError(f'--param {key}: none of {", ".join(known)} has this parameter')
        for owner in owners:
            result[owner][name] = value
    return result


def _lengths(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    found = re.fullmatch(r'([0-9]{1,9})-([0-9]{1,9})', text)
    if found is None or not 0 < int(found[1]) <= int(found[2]):
        raise ParameterError(f'--eao-lengths {text[:60]!r}: give LOW-HIGH, such as 108-371')
    return int(found[1]), int(found[2])
