# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf track`` over many recordings: a file each, and a table of all."""

from __future__ import annotations

import argparse
import contextlib
import csv
import glob
import hashlib
import json
import os
import sys
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rgbd_kcf_tracker.cli.common import escaped
from rgbd_kcf_tracker.cli.interrupts import EXIT_INTERRUPTED, interrupts
from rgbd_kcf_tracker.cli.workers import (
    EXIT_FAILURES,
    NOTICE,
    RECORD,
    WORKER_OPTIONS,
    Progress,
    add_worker_options,
    open_workers,
    record,
    shard_of,
)
from rgbd_kcf_tracker.errors import ParameterError, RecordingError, RgbdKcfError
from rgbd_kcf_tracker.extras import require

if TYPE_CHECKING:
    from rgbd_kcf_tracker.batch.shards import Shard

EPILOG = """\
several recordings:
  SOURCE may be given again and may be a glob, also '**'; --list reads more. --output then names a
  folder, and --mot, --video and --bag folders too: each recording has its file NAME.csv, NAME.txt,
  NAME.mp4, NAME.mcap there. --output gets a table of all rows (tracks.csv or tracks.parquet) and
  sources.csv, a row per recording, with those that failed. Run again to go on after an
  interruption.

examples:
  rgbd-kcf track walk.mcap --output walk.csv --video walk.mp4
  rgbd-kcf track 'day/**/*.mcap' --all --output tracks/ --table parquet --jobs 8
  rgbd-kcf track --list bags.txt --output tracks/ --cluster tcp://HOST:8786
"""

KINDS = {'output': '.csv', 'mot': '.txt', 'video': '.mp4', 'bag': '.mcap'}
"""Options that name a file, or here a folder, and how the files in it end."""

TABLES = ('csv', 'parquet')
SOURCES = 'sources.csv'
_DONE = '.done'
_STATES = ('tracking', 'occluded', 'lost')
_OPTIONS = (
    'init', 'all', 'variant', 'param', 'start', 'end', 'color_topic', 'depth_topic', 'info_topic',
    'tolerance', 'fps', 'intrinsics', 'rectified', 'max_pixels',
)  # fmt: skip
"""Options that decide what comes out of a recording, as far as this command has them."""


@dataclass(frozen=True, slots=True)
class TrackJob:
    """One recording.

    Attributes:
        source: its path.
        name: of its files.
        options: of the command, with this recording's source and files.
        key: changes whenever something else would come out.
    """

    source: str
    name: str
    options: dict[str, Any]
    key: str = ''


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of many recordings."""
    group = parser.add_argument_group('several recordings')
    group.add_argument(
        '--list', metavar='FILE', help='more sources, one per line; - for standard input'
    )
    group.add_argument(
        '--table', choices=TABLES, help='form of the table of all recordings (default csv)'
    )
    add_worker_options(group)


def is_asked(args: argparse.Namespace) -> bool:
    """Whether a command is about many recordings, be it that there is only one of them."""
    named = (args.list, args.table, *(getattr(args, name) for name in WORKER_OPTIONS))
    return (
        len(args.source) != 1
        or any(value is not None for value in named)
        or _is_glob(args.source[0])
    )


def run(args: argparse.Namespace) -> int:
    """Follow targets through all recordings that are not done yet; returns the exit code."""
    _check_parameters(args)  # first: --param takes a SOURCE behind it, which would be missed
    require('batch', 'track of several recordings')
    from rgbd_kcf_tracker.recordings.outputs import check_outputs

    sources = _sources(args)
    folders = _folders(args)
    jobs = [
        _job(args, source, name, folders)
        for source, name in zip(sources, _names(sources), strict=True)
    ]
    shard = shard_of(args)
    own = jobs if shard is None else shard.of(jobs)
    if args.table == 'parquet':
        require('parquet', '--table parquet')
    read = [*sources, *([args.list] if args.list and args.list != '-' else [])]
    for kind, folder in folders.items():  # each alone: they may be one
        check_outputs({f'--{kind}': folder}, read, overwrite=True, folders=(f'--{kind}',))
    with _made(list(folders.values())):
        return _run_in(args, folders, jobs, own, shard, read)


def _run_in(
    args: argparse.Namespace,
    folders: dict[str, Path],
    jobs: list[TrackJob],
    own: list[TrackJob],
    shard: Shard | None,
    read: list[str],
) -> int:
    """Follow through recordings, into folders that are there; returns the exit code."""
    from rgbd_kcf_tracker.batch.loop import run_all

    tables = [folders['output'] / name for name in (SOURCES, f'tracks.{args.table or TABLES[0]}')]
    _refuse_to_write(own, [*tables, folders['output'] / RECORD], read)
    needs = list(dict.fromkeys(Path(job.source).parent for job in own))
    with open_workers(args, needs, list(folders.values())) as workers:
        named = list(_named(args).values())
        own = _identified(own, None if args.cluster is None else workers, named)
        todo = [job for job in own if not _is_done(folders['output'], job)]
        if not args.overwrite:
            _refuse_to_replace(todo, tables, {job.name for job in jobs})
        rows: dict[str, dict[str, Any]] = {}
        with Progress(len(own), 'recording') as progress, interrupts.held(NOTICE):
            progress.report(len(own) - len(todo), '', found=True)
            for done in run_all(_follow, todo, workers, stopped=lambda: interrupts.asked):
                name = done.item.name
                if done.result is None:
                    rows[name] = {'error': _reason(done.error)}
                else:
                    _keep(folders['output'], done.item, done.result)
                progress.report(1, name)
        record(folders['output'], workers.describe(), failures=len(rows))
    if interrupts.asked:
        print('stopped; the same command goes on from here', file=sys.stderr)
        return EXIT_INTERRUPTED
    if shard is not None:
        print(
            f'part {shard}: {len(own)} of {len(jobs)} recordings; once all parts are there, run '
            'once more without --shard for the tables'
        )
    else:
        _write_tables(folders['output'], own, rows, args.table or TABLES[0])
    for name, row in rows.items():
        print(escaped(f'{name}: {row["error"]}'), file=sys.stderr)
    print(escaped(f'{len(own) - len(rows)} of {len(own)} recordings are in {folders["output"]}'))
    return EXIT_FAILURES if rows else 0


@contextlib.contextmanager
def _made(folders: Sequence[Path]) -> Iterator[None]:
    """Make folders; those made here go where an error leaves nothing in them.

    Raises:
        RecordingError: where one cannot be made.
    """
    from rgbd_kcf_tracker.recordings.outputs import make_folder

    new = [folder for folder in dict.fromkeys(folders) if not folder.exists()]
    try:
        for folder in folders:
            make_folder(folder)
        yield
    except RgbdKcfError:
        for folder in new:
            with contextlib.suppress(OSError):  # it holds something, or was not made
                folder.rmdir()
        raise


# --- what is asked for


def _is_glob(text: str) -> bool:
    return glob.has_magic(text) and not os.path.exists(text)


def _sources(args: argparse.Namespace) -> list[str]:
    """Paths of all recordings, each once.

    Raises:
        RecordingError: for a path that is not there, a pattern without a match, or a list that
            cannot be read.
    """
    from rgbd_kcf_tracker.recordings.textfiles import natural_key

    found: list[str] = []
    for text in [*args.source, *(_listed(args.list) if args.list else [])]:
        if _is_glob(text):
            matches = sorted(glob.glob(text, recursive=True), key=natural_key)
            if not matches:
                raise RecordingError(f'{text} matches nothing')
            found += matches
        elif os.path.exists(text):
            found.append(text)
        else:
            raise RecordingError(f'{text} does not exist')
    if not found:
        raise RecordingError('no recordings: give SOURCE, or --list FILE with one per line')
    # Workers elsewhere stand in other folders.
    return list(dict.fromkeys(os.path.abspath(path) for path in found))


def _listed(place: str) -> list[str]:
    from rgbd_kcf_tracker.recordings.files import read_text

    try:
        text = sys.stdin.read() if place == '-' else read_text(Path(place))
    except UnicodeDecodeError:
        raise RecordingError('standard input is not text') from None
    lines = (line.strip() for line in text.splitlines())
    return [line for line in lines if line and not line.startswith('#')]


def _names(sources: Sequence[str]) -> list[str]:
    """A short name for each: the last part of its path, and as many more as tell it apart."""
    from rgbd_kcf_tracker.evaluation.store import slug

    places = [Path(source) for source in sources]
    parts = [p.with_name(p.stem).parts[1:] if p.name else ('recording',) for p in places]
    names = ['' for _ in parts]
    for length in range(1, max(map(len, parts)) + 1):
        taken = [slug('_'.join(own[-length:])) for own in parts]
        for i, name in enumerate(taken):
            if not names[i] and taken.count(name) == 1 and name not in names:
                names[i] = name
    for i, name in enumerate(names):  # walk.mcap beside walk/, say
        if not name:
            names[i] = slug('_'.join(Path(sources[i]).parts[1:]))
    if len(set(names)) < len(names):
        twice = next(s for s, n in zip(sources, names, strict=True) if names.count(n) > 1)
        raise ParameterError(f'{twice}: another source would have the same file: rename one')
    return names


def _folders(args: argparse.Namespace) -> dict[str, Path]:
    from rgbd_kcf_tracker.recordings.outputs import refuse_standard_output

    if args.output is None or args.output == '-':
        raise ParameterError('several recordings: give the folder for their files as --output DIR')
    given = {kind: getattr(args, kind) for kind in KINDS}
    for kind, path in given.items():
        if path:
            refuse_standard_output(f'--{kind}', path)
            _refuse_file_name(kind, path)
    return {kind: Path(os.path.abspath(path)) for kind, path in given.items() if path}


def _refuse_file_name(kind: str, path: str) -> None:
    """Refuse the name of a file for what would be a folder, unless it is one.

    Raises:
        ParameterError: for such a name.
    """
    if path.endswith(KINDS[kind]) and not os.path.isdir(path):
        raise ParameterError(
            f'--{kind} {path} would be a folder, as it is with several recordings, --list, '
            f'--table, --jobs, --cluster or --shard: give a name without {KINDS[kind]}, or one '
            'SOURCE and none of these'
        )


def _job(args: argparse.Namespace, source: str, name: str, folders: dict[str, Path]) -> TrackJob:
    options = {key: value for key, value in vars(args).items() if key != 'run'}
    options |= dict.fromkeys(KINDS)
    for kind, folder in folders.items():
        inner = 'tracks' if kind == 'output' else ''
        options[kind] = str(folder / inner / f'{name}{KINDS[kind]}')
    return TrackJob(source, name, options | {'source': source})


def _check_parameters(args: argparse.Namespace) -> None:
    """Mistakes that every recording would stumble on are told once, before any of them."""
    from rgbd_kcf_tracker.cli import track
    from rgbd_kcf_tracker.cli.common import parse_box, read_options

    track.make_follower(args)
    # A file is named from the root on, for who runs elsewhere.
    files = _named(args)
    others = [s for s in args.param if s.partition('=')[0].rpartition('.')[2] not in files]
    args.param = others + [f'{name}={path}' for name, path in files.items()]
    for text in args.init:
        parse_box(text)
    read_options(args)


def _named(args: argparse.Namespace) -> dict[str, str]:
    """Files that the tracker's parameters name."""
    from rgbd_kcf_tracker.cli.common import tracker_parameters
    from rgbd_kcf_tracker.parameters import files_named
    from rgbd_kcf_tracker.variants import DEFAULT_VARIANT

    return files_named(tracker_parameters(args, args.variant or DEFAULT_VARIANT))


# --- one recording


def _identified(jobs: list[TrackJob], workers: Any, named: list[str]) -> list[TrackJob]:
    """The jobs with their keys: content of the recording, options, code and libraries.

    Args:
        jobs: the jobs.
        workers: who reads the recordings; None for this process.
        named: files that the tracker's parameters name.
    """
    from rgbd_kcf_tracker.batch.content import files_digest
    from rgbd_kcf_tracker.batch.digests import digests
    from rgbd_kcf_tracker.batch.environment import environment
    from rgbd_kcf_tracker.cli import track

    content = digests({job.name: (Path(job.source),) for job in jobs}, workers)
    read = [Path(track.__file__), *map(Path, named)]
    code = [environment().digest, files_digest(read)]
    found = []
    for job in jobs:
        options = {name: job.options[name] for name in _OPTIONS if name in job.options}
        kinds = [kind for kind in KINDS if job.options[kind]]
        text = json.dumps([content[job.name], code, options, kinds], sort_keys=True)
        found.append(replace(job, key=hashlib.sha256(text.encode()).hexdigest()[:24]))
    return found


def _files(job: TrackJob) -> list[Path]:
    return [Path(job.options[kind]) for kind in KINDS if job.options[kind]]


def _done_path(folder: Path, job: TrackJob) -> Path:
    return folder / _DONE / f'{job.name}.json'


def _is_done(folder: Path, job: TrackJob) -> bool:
    kept = _kept(folder, job)
    return kept.get('key') == job.key and all(path.is_file() for path in _files(job))


def _kept(folder: Path, job: TrackJob) -> dict[str, Any]:
    """What is known of a recording that was done, nothing where it was not."""
    from rgbd_kcf_tracker.recordings.files import read_text

    try:
        kept = json.loads(read_text(_done_path(folder, job)))
        return kept if isinstance(kept, dict) else {}
    except (RecordingError, RecursionError, ValueError):
        return {}


def _note_begun(job: TrackJob) -> None:
    """Before a file has its name: where what follows fails, the next run knows it for its own."""
    from rgbd_kcf_tracker.recordings.outputs import write_atomically

    note = {'begun': job.key, 'files': [str(path) for path in _files(job)]}
    folder = Path(job.options['output']).parents[1]
    write_atomically(_done_path(folder, job), json.dumps(note) + '\n')


def _was_begun(folder: Path, job: TrackJob, path: Path) -> bool:
    kept = _kept(folder, job)
    return kept.get('begun') == job.key and str(path) in kept.get('files', ())


def _refuse_to_write(jobs: Sequence[TrackJob], others: Sequence[Path], read: list[str]) -> None:
    """Refuse what is read, or lies in it, whatever may be replaced."""
    from rgbd_kcf_tracker.recordings.outputs import check_outputs

    named = {f'--output, its {path.name}:': path for path in others}
    for job in jobs:
        for kind in KINDS:
            if job.options[kind]:
                named[f'--{kind} for {job.name}:'] = Path(job.options[kind])
    # A folder that is not there yet lies in one that was looked at.
    there = {name: path for name, path in named.items() if path.parent.exists()}
    check_outputs(there, read, overwrite=True)


def _refuse_to_replace(
    jobs: Sequence[TrackJob], tables: Sequence[Path], names: Collection[str]
) -> None:
    """Refuse to replace what no earlier run of the same command wrote.

    Args:
        jobs: whose files will be written.
        tables: of all recordings, :data:`SOURCES` first.
        names: of all recordings: tables of others are of another command.
    """
    folder = tables[0].parent
    there = [
        path
        for job in jobs
        for path in _files(job)
        if path.exists() and not _was_begun(folder, job, path)
    ]
    if not ((folder / RECORD).exists() and _names_in(tables[0]) <= set(names)):
        there += [path for path in tables if path.exists()]
    if there:
        more = f' and {len(there) - 1} more' if len(there) > 1 else ''
        raise RecordingError(
            f'{there[0]}{more} would be replaced, made with other options, another version, from '
            'another recording or by something else: give another folder, or add --overwrite'
        )


def _names_in(sources: Path) -> set[str]:
    """The recordings in a table of them; '' among them where it is none."""
    from rgbd_kcf_tracker.recordings.files import open_text

    try:
        with open_text(sources) as file:
            return {row.get('name') or '' for row in csv.DictReader(file)}
    except (OSError, RecordingError, ValueError, csv.Error):
        return {''}


def _follow(job: TrackJob) -> dict[str, Any]:
    """Follow through one recording; its files get their names when they are whole."""
    from rgbd_kcf_tracker.cli import track
    from rgbd_kcf_tracker.recordings.outputs import clear_dead_parts, part_of

    wanted = {kind: Path(job.options[kind]) for kind in KINDS if job.options[kind]}
    parts = {kind: part_of(path) for kind, path in wanted.items()}
    for path in wanted.values():
        path.parent.mkdir(parents=True, exist_ok=True)
        clear_dead_parts(path)
    options = job.options | {kind: str(path) for kind, path in parts.items()}
    try:
        outcome = track.follow(argparse.Namespace(**options), watched=False)
        _note_begun(job)
        for kind, path in wanted.items():
            parts[kind].replace(path)
    finally:
        for path in parts.values():
            path.unlink(missing_ok=True)
    m = outcome.measures
    return {
        'frames': outcome.frames,
        'targets': outcome.targets,
        **{state: outcome.states.get(state, 0) for state in _STATES},
        'success': None if m is None else round(m.success, 6),
        'iou': None if m is None else round(m.iou, 6),
        'strangers': None if m is None else round(m.strangers, 6),
        'warnings': len(outcome.warnings),
    }


def _keep(folder: Path, job: TrackJob, result: dict[str, Any]) -> None:
    from rgbd_kcf_tracker.recordings.outputs import write_atomically

    write_atomically(_done_path(folder, job), json.dumps({'key': job.key, **result}) + '\n')


def _reason(error: Exception | None) -> str:
    if isinstance(error, RgbdKcfError):
        return str(error)
    if isinstance(error, OSError):
        from rgbd_kcf_tracker.recordings.files import why

        return f'{error.filename}: {why(error)}' if error.filename else why(error)
    return f'{type(error).__name__}: {error}'


# --- all recordings


def _write_tables(
    folder: Path, jobs: Sequence[TrackJob], failed: dict[str, dict[str, Any]], form: str
) -> None:
    from rgbd_kcf_tracker.recordings.rowfiles import join_csv, write_rows

    header = ('name', 'source', 'frames', 'targets', *_STATES, 'success', 'iou', 'strangers',
              'warnings', 'error')  # fmt: skip
    rows = []
    for job in jobs:
        known = failed.get(job.name) or _kept(folder, job)
        row = {'name': job.name, 'source': job.source, **known}
        rows.append(['' if row.get(k) is None else row[k] for k in header])
    write_rows(folder / SOURCES, header, rows)
    tracks = {job.name: Path(job.options['output']) for job in jobs if job.name not in failed}
    join_csv(tracks, folder / f'tracks.{form}')
