# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the commands share that run trackers on benchmarks."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rgbd_kcf_tracker.cli.common import add_topic_options, escaped, parse_intrinsics, parse_size
from rgbd_kcf_tracker.cli.interrupts import EXIT_INTERRUPTED, interrupts
from rgbd_kcf_tracker.cli.workers import (
    EXIT_FAILURES,
    NOTICE,
    RECORD,
    Progress,
    open_workers,
    record,
)
from rgbd_kcf_tracker.errors import ParameterError, RecordingError, RgbdKcfError

DEFAULT_FPS = 30.0
_BEFORE_RESULTS = {RECORD, 'failures.txt', 'per_frame.csv'}
"""What a report folder holds before the first result."""

if TYPE_CHECKING:
    from rgbd_kcf_tracker.evaluation.contenders import Contender
    from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions
    from rgbd_kcf_tracker.evaluation.datasets import Sequence as Benchmark
    from rgbd_kcf_tracker.evaluation.jobs import Failure, RunOptions


def add_data_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options that say what data is and how it is read."""
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
        '--fps', type=float, default=DEFAULT_FPS, metavar='F',
        help='rate of folders that do not state theirs (default 30)',
    )  # fmt: skip
    group.add_argument(
        '--rate', type=float, metavar='HZ',
        help='render scenes at this rate, and thin recordings out to it (5, 15, 30)',
    )  # fmt: skip
    add_topic_options(group)
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


def data_options(args: argparse.Namespace, everyone: bool = False) -> DatasetOptions:
    """The options of :func:`add_data_options` as data sets take them.

    Raises:
        ParameterError: for a value that cannot be.
    """
    from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions
    from rgbd_kcf_tracker.evaluation.datasets.simulated import parse_seeds

    if args.rate is not None and not 0.1 <= args.rate <= 1000:
        raise ParameterError(f'--rate is {args.rate:g} Hz: give 0.1 to 1000')
    return DatasetOptions(
        kind=args.kind,
        fps=args.fps,
        seeds=tuple(parse_seeds(args.seeds)),
        scenarios=tuple(words(args.scenarios or '')),
        rate_hz=args.rate,
        duration_s=args.duration,
        size=parse_size(args.size),
        names=tuple(words(args.sequences or '')),
        everyone=everyone,
        color_topic=args.color_topic,
        depth_topic=args.depth_topic,
        info_topic=args.info_topic,
    )


def run_options(
    args: argparse.Namespace, short_term: bool = False, fresh: bool = False
) -> RunOptions:
    """How runs are made, by the options of :func:`add_data_options` and what a command has more."""
    from rgbd_kcf_tracker.evaluation.jobs import RunOptions

    return RunOptions(
        rate_hz=args.rate,
        use_depth=not args.no_depth,
        short_term=short_term,
        fresh=fresh,
        intrinsics=None if args.intrinsics is None else parse_intrinsics(args.intrinsics),
    )


_OF_SCENES = {'seeds': '1', 'scenarios': None, 'duration': None, 'size': '960x540'}
"""Options of simulated scenes, and what they are where not given."""

USUAL = {'kind': 'auto', 'fps': DEFAULT_FPS, **_OF_SCENES}
"""Options of :func:`add_data_options` as they are where not given."""


def checked(args: argparse.Namespace, sequences: list[Benchmark]) -> list[Benchmark]:
    """Sequences as they can be measured.

    Raises:
        ParameterError: where two have one name, for their results would lie in one file, or where
            an option of :func:`add_data_options` chooses nothing.
    """
    from rgbd_kcf_tracker.evaluation.datasets.simulated import PREFIX
    from rgbd_kcf_tracker.evaluation.store import slug

    for name in words(args.sequences or ''):
        if not any(name in sequence.name for sequence in sequences):
            raise ParameterError(f'--sequences: none has {name!r} in its name')
    if all(sequence.path is not None for sequence in sequences):
        scenes = not sequences or any(text.startswith(PREFIX) for text in args.dataset)
        if args.scenarios and scenes:
            raise ParameterError(
                f'--scenarios {args.scenarios}: none of these is among the simulated scenes of '
                'DATASET'
            )
        for option, usual in _OF_SCENES.items():
            if getattr(args, option) != usual:
                raise ParameterError(f'--{option} means nothing without simulated scenes')
    seen: dict[str, Benchmark] = {}
    for sequence in sequences:
        other = seen.setdefault(slug(sequence.name), sequence)
        if other is not sequence:
            raise ParameterError(
                f'two sequences are named {sequence.name} ({other.path} and {sequence.path}): '
                'measure them in two runs, or rename one'
            )
    return sequences


def run_jobs(
    args: argparse.Namespace,
    sequences: list[Benchmark],
    contenders: list[Contender],
    options: RunOptions,
) -> tuple[list[Benchmark], list[Contender], list[Failure]]:
    """Run all on the workers that were asked for.

    Returns:
        Sequences and contenders with their digests, and what failed.
    """
    from rgbd_kcf_tracker.evaluation.runner import identify
    from rgbd_kcf_tracker.evaluation.runner import run as run_all

    with open_workers(args, _needs(sequences, contenders)) as workers:
        # On a cluster, files are read where they are run: many machines read faster.
        readers = None if args.cluster is None else workers
        sequences, contenders = identify(sequences, contenders, readers)
        total = len(sequences) * len(contenders)
        with Progress(total, 'run') as progress, interrupts.held(NOTICE):
            failures = run_all(
                sequences, contenders, args.report, options, progress.report, workers,
                lambda: interrupts.asked,
            )  # fmt: skip
        record(args.report, workers.describe(), failures=len(failures))
    return sequences, contenders, failures


def _needs(sequences: Sequence[Benchmark], contenders: Sequence[Contender]) -> list[Path]:
    """Folders that whoever runs the sequences must have."""
    places = [s.path.parent for s in sequences if s.path is not None]
    boxes = [Path(c.target.partition('{sequence}')[0]) for c in contenders if c.kind == 'boxes']
    return list(dict.fromkeys([*places, *(p if p.is_dir() else p.parent for p in boxes)]))


def in_words(args: argparse.Namespace) -> str:
    """What is other than usual, for the head of a report."""
    parts = []
    if args.kind != 'auto':
        parts.append(f'read as {args.kind}')
    if args.sequences is not None:
        parts.append(f'only sequences named {args.sequences}')
    if args.scenarios is not None:
        parts.append(f'only the scenarios {args.scenarios}')
    if args.fps != DEFAULT_FPS:
        parts.append(f'{args.fps:g} Hz where a folder states none')
    for role in ('color', 'depth', 'info'):
        topic = getattr(args, f'{role}_topic')
        if topic is not None:
            parts.append(f'{role} topic {topic}')
    if args.rate is not None:
        parts.append(f'{args.rate:g} Hz')
    if args.no_depth:
        parts.append('without depth')
    if args.intrinsics is not None:
        parts.append(f'camera {args.intrinsics}')
    if any(text.startswith('sim:') for text in args.dataset):
        parts.append(f'seeds {args.seeds} where none are given, {args.size}')
        if args.duration is not None:
            parts.append(f'scenes of {args.duration:g} s')
    parts.extend(args.param)
    return ', '.join(parts) or 'none'


def list_failures(failures: Sequence[Failure]) -> None:
    """Name what failed, on standard error."""
    if not failures:
        return
    print(f'\n{len(failures)} failed:', file=sys.stderr)
    for failure in failures:
        last = failure.reason.strip().splitlines()[-1]
        tracker = f' ({failure.tracker})' if failure.tracker else ''
        print(escaped(f'  {failure.sequence}{tracker}: {last}'), file=sys.stderr)


def end(failures: Sequence[Failure]) -> int:
    """List what failed; returns the exit code."""
    list_failures(failures)
    if interrupts.asked:
        print('stopped; the same command goes on from here', file=sys.stderr)
        return EXIT_INTERRUPTED
    return EXIT_FAILURES if failures else 0


def check_report(folder: Path, datasets: Sequence[str], overwrite: bool) -> None:
    """Refuse a folder that lies in the data, holds links to it, or other things than a report.

    Raises:
        RecordingError: where it does.
    """
    from rgbd_kcf_tracker.evaluation.datasets.simulated import PREFIX
    from rgbd_kcf_tracker.evaluation.report import BEGUN_NAMES
    from rgbd_kcf_tracker.recordings.outputs import check_held, check_outputs

    sources = [text for text in datasets if not text.startswith(PREFIX)]
    check_outputs({'--report': folder}, sources, overwrite=True, folders=('--report',))
    try:
        held = set(os.listdir(folder)) if folder.exists() else set()
    except OSError as error:
        raise RecordingError(f'{folder} cannot be read: {error.strerror or error}') from None
    if RECORD not in held and held - BEGUN_NAMES and not overwrite:
        raise RecordingError(
            f'{folder} is there already, and is no report: give another name, or add '
            '--overwrite to write into it'
        )
    check_held(folder, sources)


@contextlib.contextmanager
def report_folder(folder: Path) -> Iterator[None]:
    """A folder for a report; one made here goes where an error leaves no result in it.

    Raises:
        RecordingError: where it cannot be written.
    """
    made = not folder.exists()
    _make_report_folder(folder)
    try:
        yield
    except RgbdKcfError:
        with contextlib.suppress(OSError):
            if made and set(os.listdir(folder)) <= _BEFORE_RESULTS:
                for name in _BEFORE_RESULTS:
                    (folder / name).unlink(missing_ok=True)
                folder.rmdir()
        raise


def _make_report_folder(folder: Path) -> None:
    """Make a folder for a report.

    Raises:
        RecordingError: where it cannot be written.
    """
    from rgbd_kcf_tracker.recordings.outputs import cannot_write, make_folder

    make_folder(folder)
    try:
        probe = folder / '.write'
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise RecordingError(cannot_write(folder, error)) from None


def words(text: str) -> list[str]:
    """The words between commas."""
    return [word.strip() for word in text.split(',') if word.strip()]
