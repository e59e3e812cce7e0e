# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Options, progress and records of the commands that run many jobs."""

from __future__ import annotations

import argparse
import contextlib
import json
import platform
import shlex
import sys
import time
from collections.abc import Sequence
from datetime import datetime, timezone
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rgbd_kcf_tracker.batch.shards import Shard
from rgbd_kcf_tracker.errors import ParameterError, RecordingError

if TYPE_CHECKING:
    from rgbd_kcf_tracker.batch.workers import Workers

RECORD = 'runs.jsonl'
WORKER_OPTIONS = ('jobs', 'cluster', 'shard')
NOTICE = 'the runs under way are finished, then it stops; Ctrl-C again stops at once'
EXIT_FAILURES = 1
"""Exit code where some runs failed, and what the others gave was written."""
_LINE_EVERY_S = 30.0


def add_worker_options(parser: argparse._ArgumentGroup) -> None:
    """Declare the options that say where jobs run."""
    parser.add_argument(
        '--jobs', type=int, metavar='N', help='processes of this machine (default: one per core)'
    )
    parser.add_argument(
        '--cluster', metavar='WHERE',
        help='run on a Dask cluster: tcp://HOST:PORT of its scheduler, or its scheduler file '
        "(needs pip install 'rgbd_kcf_tracker[cluster]')",
    )  # fmt: skip
    parser.add_argument(
        '--shard', metavar='I/N',
        help='do only part I of N, as in a SLURM array or a CI matrix; parts are counted from 1',
    )  # fmt: skip


def open_workers(
    args: argparse.Namespace, needs: Sequence[Path] = (), writes: Sequence[Path] = ()
) -> Workers:
    """The workers that were asked for, to be used in a ``with`` block.

    Args:
        args: with the options of :func:`add_worker_options`.
        needs: paths that workers must have.
        writes: folders that workers must be able to write.

    Raises:
        ParameterError: for options that cannot be.
        WorkersError: where there are no such workers, or one of them cannot do the work.
    """
    from rgbd_kcf_tracker.batch.workers import cores, local

    if args.jobs is not None and args.jobs < 1:
        raise ParameterError(f'--jobs is {args.jobs}: give 1 or more')
    if args.cluster is None:
        return local(cores() if args.jobs is None else args.jobs)
    if args.jobs is not None:
        raise ParameterError('--jobs is of this machine: leave it out with --cluster')
    from rgbd_kcf_tracker.batch.cluster import Cluster

    return Cluster(args.cluster, needs, writes)


def shard_of(args: argparse.Namespace) -> Shard | None:
    """The part that was asked for, None for all.

    Raises:
        ParameterError: where there is no such part.
    """
    return None if args.shard is None else Shard.parse(args.shard)


class Progress:
    """How much is done, how fast it goes and how long it takes, on standard error.

    A bar on a terminal; in a log a line now and then. What was done before does not count as speed.

    Args:
        total: of what is to be done.
        unit: its name.
    """

    def __init__(self, total: int, unit: str) -> None:
        self._bar: Any = None
        if sys.stderr.isatty() and find_spec('tqdm') is not None:
            from tqdm import tqdm

            self._bar = tqdm(total=total, unit=unit, leave=False, smoothing=0)
        self._total, self._unit = total, unit
        self._done = self._before = 0
        self._began = self._told = time.monotonic()

    def report(self, count: int, name: str, found: bool = False) -> None:
        """So many more are done, of this name; ``found`` where they were done before."""
        self._done += count
        self._before += count if found else 0
        now = time.monotonic()
        if self._bar is not None:
            self._bar.initial = self._before
            self._bar.set_postfix_str(name, refresh=False)
            self._bar.update(count)
        elif now - self._told > _LINE_EVERY_S:
            self._told = now
            print(self.line(now), file=sys.stderr, flush=True)

    def line(self, now: float) -> str:
        """Where it stands, in one line."""
        rate = (self._done - self._before) / max(now - self._began, 1e-9)
        text = f'{self._done} of {self._total} {self._unit}s, {rate:.3g} {self._unit}s/s'
        if rate > 0:
            left = round((self._total - self._done) / rate)
            text += f', {left // 3600}:{left // 60 % 60:02}:{left % 60:02} left'
        return text

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()
        if isinstance(error, KeyboardInterrupt):
            print('stopped; the same command goes on from here', file=sys.stderr)


def record(folder: Path, workers: str, **more: object) -> None:
    """Note in the folder what was run when, where and with what; the report tells only results."""
    from rgbd_kcf_tracker.batch.environment import environment
    from rgbd_kcf_tracker.recordings.files import refuse_special

    own = environment()
    line = {
        'date': datetime.now(timezone.utc).isoformat(timespec='seconds'),
        'command': ' '.join(['rgbd-kcf', *map(shlex.quote, sys.argv[1:])]),
        'machine': platform.node(),
        'workers': workers,
        'version': own.version,
        'code': own.code,
        'libraries': dict(own.libraries),
        **more,
    }
    path = folder / RECORD
    refuse_special(path)
    try:
        with path.open('a', encoding='utf-8') as file:
            file.write(json.dumps(line) + '\n')
    except OSError as error:
        with contextlib.suppress(OSError):
            if not path.stat().st_size:  # the disk is full, and it was made just now
                path.unlink()
        raise RecordingError(f'{path} cannot be written: {error.strerror or error}') from None
