# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf evaluate``: run trackers on benchmarks and write a report."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rgbd_kcf_tracker.cli.common import (
    add_overwrite_option,
    counter,
    parse_assignments,
    parse_intrinsics,
    progress,
)
from rgbd_kcf_tracker.cli.interrupts import EXIT_INTERRUPTED, interrupts
from rgbd_kcf_tracker.errors import ParameterError, RecordingError, RgbdKcfError
from rgbd_kcf_tracker.extras import require

if TYPE_CHECKING:
    from rgbd_kcf_tracker.evaluation.contenders import Contender
    from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions
    from rgbd_kcf_tracker.evaluation.datasets import Sequence as Benchmark
    from rgbd_kcf_tracker.evaluation.jobs import Failure, RunOptions
    from rgbd_kcf_tracker.evaluation.report import Heading

NAME = 'evaluate'
HELP = 'run trackers on benchmarks or simulated scenes and write a report'

EXIT_FAILURES = 1
"""Exit code where the report was written but some runs failed."""

_EPILOG = """\
data sets:
  DIR                 a sequence folder, or a folder of them: our own layout, OTB, VOT, CDTB,
                      DepthTrack or Princeton, found out by their file names; or a bag with truth
  sim:all             every simulated scene of one target, sim:people those of several people;
                      sim:occlusion,crowd some; sim:all:1-5 with these seeds

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

Ctrl-C finishes the runs under way and reports what there is; pressed again it stops at once. Run
again with the same --report to go on, or to add trackers.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = _EPILOG
    parser.add_argument('dataset', nargs='+', metavar='DATASET', help='see below')
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
    group = parser.add_argument_group('data')
    group.add_argument(
        '--kind', default='auto', metavar='KIND',
        help='format, where it cannot be told by the names: folder, otb, vot, cdtb, depthtrack, '
        'princeton, recording',
    )  # fmt: skip
    group.add_argument(
        '--sequences', metavar='A,B', help='only sequences whose name holds one of these'
    )
    group.add_argument(
        '--fps', type=float, default=30.0, metavar='F',
        help='rate of folders that do not state theirs (default 30)',
    )  # fmt: skip
    group.add_argument(
        '--rate', type=float, metavar='HZ',
        help='render scenes at this rate, and thin recordings out to it (5, 15, 30)',
    )  # fmt: skip
    group.add_argument('--no-depth', action='store_true', help='give the trackers colour alone')
    group.add_argument(
        '--intrinsics', metavar='FX,FY,CX,CY',
        help="camera of recordings in pixels, instead of their own",
    )  # fmt: skip
    group.add_argument(
        '--seeds', default='1', metavar='N', help='seeds of simulated scenes: 3, 1-5 (default 1)'
    )
    group.add_argument('--scenarios', metavar='A,B', help='only these simulated scenarios')
    group.add_argument(
        '--duration',
        type=float,
        metavar='S',
        help='of simulated scenes (default: their own)',
    )
    group.add_argument(
        '--size', default='960x540', metavar='WxH', help='of simulated images (default 960x540)'
    )
    group = parser.add_argument_group('running')
    group.add_argument(
        '--jobs', type=int, metavar='N', help='parallel processes (default: one per core)'
    )
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
    from rgbd_kcf_tracker.evaluation.export import export
    from rgbd_kcf_tracker.evaluation.perframe import collect
    from rgbd_kcf_tracker.evaluation.report import PAGE, write_report
    from rgbd_kcf_tracker.evaluation.tables import overview

    if args.everyone:
        _refuse(args, '--everyone', ('short_term', 'eao_lengths', 'export'))
    _check_report(args)
    if args.identity:
        return _identity(args)
    contenders, ablated = _contenders(args)
    eao_lengths = _lengths(args.eao_lengths)
    sequences = _distinct([s for text in args.dataset for s in open_dataset(text, _data(args))])
    jobs = _default_jobs() if args.jobs is None else args.jobs
    if jobs < 1:
        raise ParameterError(f'--jobs is {jobs}: give 1 or more')
    options = _run_options(args, jobs)
    _make_report_folder(args.report)
    failures = _run(sequences, contenders, args.report, options)
    if args.everyone:
        return _report_everyone(args, sequences, contenders, options, failures)
    collected = collect(args.report, sequences, contenders, options)
    for form in args.export:
        export(args.report, sequences, contenders, options, form)
    heading = _heading(args, ablated, eao_lengths)
    if not collected.results and collected.unmeasured:
        print(f'{len(collected.unmeasured)} sequences were run; none has ground truth to measure')
    elif collected.results or not interrupts.asked:
        measured = write_report(args.report, collected, contenders, failures, heading)
        print(overview(measured).text())
        print(f'\nreport: {args.report / PAGE}')
    return _end(failures)


def _end(failures: Sequence[Failure]) -> int:
    """List what failed; returns the exit code."""
    _list_failures(failures)
    if interrupts.asked:
        print('stopped; the same command goes on from here', file=sys.stderr)
        return EXIT_INTERRUPTED
    return EXIT_FAILURES if failures else 0


def _refuse(args: argparse.Namespace, mode: str, names: Sequence[str]) -> None:
    """Options that mean nothing in a mode, rather than leaving them out silently."""
    for name in names:
        if getattr(args, name):
            option = '--' + name.replace('_', '-')
            raise ParameterError(f'{option} means nothing with {mode}: leave one of them out')


def _identity(args: argparse.Namespace) -> int:
    from rgbd_kcf_tracker.evaluation import identity
    from rgbd_kcf_tracker.evaluation.datasets import open_dataset
    from rgbd_kcf_tracker.evaluation.jobs import Failure, as_asked
    from rgbd_kcf_tracker.evaluation.report import PAGE, write_identity_report

    options = ('everyone', 'variants', 'boxes', 'param', 'ablate', 'jobs', 'fresh')
    _refuse(args, '--identity', (*options, 'short_term', 'eao_lengths', 'export'))
    sequences = _distinct([s for text in args.dataset for s in open_dataset(text, _data(args))])
    _make_report_folder(args.report)
    seen, failures = [], []
    for sequence in sequences:
        try:
            samples = as_asked(sequence.open().samples, sequence, _run_options(args, 1))
            frames = progress(samples, None, sequence.name)
            seen.append(identity.look(sequence.name, frames, identity.metric_views()))
        except RgbdKcfError as error:
            failures.append(Failure(sequence.name, '', str(error)))
    pairs = identity.all_pairs(seen, identity.metric_views())
    table = write_identity_report(args.report, pairs, failures, _heading(args))
    print(table.text())
    print(f'\nreport: {args.report / PAGE}')
    return _end(failures)


def _run_options(args: argparse.Namespace, jobs: int) -> RunOptions:
    from rgbd_kcf_tracker.evaluation.jobs import RunOptions

    return RunOptions(
        rate_hz=args.rate,
        use_depth=not args.no_depth,
        short_term=args.short_term,
        jobs=jobs,
        fresh=args.fresh,
        intrinsics=None if args.intrinsics is None else parse_intrinsics(args.intrinsics),
    )


def _report_everyone(
    args: argparse.Namespace,
    sequences: list[Benchmark],
    contenders: list[Contender],
    options: RunOptions,
    failures: list[Failure],
) -> int:
    from rgbd_kcf_tracker.evaluation import everyone
    from rgbd_kcf_tracker.evaluation.jobs import is_done
    from rgbd_kcf_tracker.evaluation.report import PAGE, write_everyone_report

    results = [
        everyone.read(args.report, sequence, contender.name)
        for sequence in sequences
        for contender in contenders
        if is_done(args.report, sequence, contender, options)
    ]
    if results or not interrupts.asked:
        table = write_everyone_report(args.report, results, contenders, failures, _heading(args))
        print(table.text())
        print(f'\nreport: {args.report / PAGE}')
    return _end(failures)


def _heading(
    args: argparse.Namespace,
    ablated: Sequence[str] = (),
    eao_lengths: tuple[int, int] | None = None,
) -> Heading:
    from rgbd_kcf_tracker.evaluation.report import Heading

    words = ' '.join(['rgbd-kcf', *map(shlex.quote, sys.argv[1:])]) if len(sys.argv) > 1 else ''
    return Heading(tuple(args.dataset), _in_words(args), words, tuple(ablated), eao_lengths)


def _run(
    sequences: list[Benchmark], contenders: list[Contender], folder: Path, options: RunOptions
) -> list[Failure]:
    from rgbd_kcf_tracker.evaluation.runner import run as run_all

    notice = 'the runs under way are finished, then it stops; Ctrl-C again stops at once'
    with counter(len(sequences) * len(contenders), 'run') as report, interrupts.held(notice):
        return run_all(sequences, contenders, folder, options, report, lambda: interrupts.asked)


def _contenders(args: argparse.Namespace) -> tuple[list[Contender], list[str]]:
    from rgbd_kcf_tracker.evaluation import contenders
    from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS

    if args.variants is not None:
        names = _words(args.variants)
    else:
        ours = [DEFAULT_VARIANT] if args.everyone else list(VARIANTS)
        names = [] if args.boxes and not args.ablate else ours
    overrides = _overrides(args.param, names)
    found, ablated = [], []
    for name in names:
        base = contenders.variant(name, overrides.get(name))
        found.append(base)
        if args.everyone:
            base.make_set()  # tried out, so that an error comes at once
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


def _data(args: argparse.Namespace) -> DatasetOptions:
    from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions
    from rgbd_kcf_tracker.evaluation.datasets.simulated import parse_seeds

    if args.rate is not None and not 0.1 <= args.rate <= 1000:
        raise ParameterError(f'--rate is {args.rate:g} Hz: give 0.1 to 1000')
    return DatasetOptions(
        kind=args.kind,
        fps=args.fps,
        seeds=tuple(parse_seeds(args.seeds)),
        scenarios=tuple(_words(args.scenarios or '')),
        rate_hz=args.rate,
        duration_s=args.duration,
        size=_size(args.size),
        names=tuple(_words(args.sequences or '')),
        everyone=args.everyone or args.identity,
    )


def _size(text: str) -> tuple[int, int]:
    width, by, height = text.lower().partition('x')
    if not by or not width.isdigit() or not height.isdigit():
        raise ParameterError(f'--size {text!r}: give WIDTHxHEIGHT, such as 960x540')
    return int(width), int(height)


def _lengths(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    low, dash, high = text.partition('-')
    if not (dash and low.isdigit() and high.isdigit() and 0 < int(low) <= int(high)):
        raise ParameterError(f'--eao-lengths {text!r}: give LOW-HIGH, such as 108-371')
    return int(low), int(high)


def _distinct(sequences: list[Benchmark]) -> list[Benchmark]:
    """Refuse two sequences of one name: their results would lie in one file."""
    from rgbd_kcf_tracker.evaluation.store import slug

    seen: dict[str, Benchmark] = {}
    for sequence in sequences:
        other = seen.setdefault(slug(sequence.name), sequence)
        if other is not sequence:
            raise ParameterError(
                f'two sequences are named {sequence.name} ({other.path} and {sequence.path}): '
                'measure them in two runs, or rename one'
            )
    return sequences


def _in_words(args: argparse.Namespace) -> str:
    parts = []
    if args.rate is not None:
        parts.append(f'{args.rate:g} Hz')
    if args.no_depth:
        parts.append('without depth')
    if args.intrinsics is not None:
        parts.append(f'camera {args.intrinsics}')
    if any(text.startswith('sim:') for text in args.dataset):
        parts.append(f'seeds {args.seeds} where none are given, {args.size}')
    parts.extend(args.param)
    return ', '.join(parts) or 'none'


def _list_failures(failures: Sequence[Failure]) -> None:
    if not failures:
        return
    print(f'\n{len(failures)} failed:', file=sys.stderr)
    for failure in failures:
        last = failure.reason.strip().splitlines()[-1]
        tracker = f' ({failure.tracker})' if failure.tracker else ''
        print(f'  {failure.sequence}{tracker}: {last}', file=sys.stderr)


def _check_report(args: argparse.Namespace) -> None:
    """Refuse a folder that lies in the data, or holds other things than a report."""
    from rgbd_kcf_tracker.evaluation.datasets.simulated import PREFIX
    from rgbd_kcf_tracker.evaluation.report import REPORT_NAMES
    from rgbd_kcf_tracker.recordings.outputs import check_outputs

    sources = [text for text in args.dataset if not text.startswith(PREFIX)]
    check_outputs({'--report': args.report}, sources, overwrite=True, folders=('--report',))
    try:
        held = set(os.listdir(args.report)) if args.report.exists() else set()
    except OSError as error:
        raise RecordingError(f'{args.report} cannot be read: {error.strerror or error}') from None
    if 'results' not in held and held - REPORT_NAMES and not args.overwrite:
        raise RecordingError(
            f'{args.report} is there already, and is no report: give another name, or add '
            '--overwrite to write into it'
        )


def _make_report_folder(folder: Path) -> None:
    from rgbd_kcf_tracker.recordings.outputs import cannot_write, make_folder

    make_folder(folder)
    try:
        probe = folder / '.write'
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise RecordingError(cannot_write(folder, error)) from None


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(',') if word.strip()]


def _default_jobs() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on this system
        return os.cpu_count() or 1
