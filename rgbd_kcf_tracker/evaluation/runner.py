# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Many sequences by many trackers, on any workers, going on where it was interrupted."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path

from rgbd_kcf_tracker.batch.digests import digests
from rgbd_kcf_tracker.batch.loop import Done, run_all
from rgbd_kcf_tracker.batch.transport import Packed, unpack
from rgbd_kcf_tracker.batch.workers import Workers, as_workers
from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import Sequence
from rgbd_kcf_tracker.evaluation.jobs import (
    Failure,
    Job,
    RunOptions,
    boxes_digest,
    is_done,
    run_job,
)

MOST_TOGETHER = 8
"""Trackers that share the frames of a sequence in one job: each holds memory until its end."""

Report = Callable[[int, str, bool], None]
"""Called with a number of runs that are done, their sequence, and whether they were found done."""


def identify(
    sequences: list[Sequence],
    contenders: list[Contender],
    workers: Workers | Executor | None = None,
    report: Callable[[str], None] = lambda name: None,
) -> tuple[list[Sequence], list[Contender]]:
    """Put the digests of what is in the files into sequences and contenders.

    Without this, each question for a run's key asks for them again.

    Args:
        sequences: as :func:`open_dataset` finds them.
        contenders: those with boxes in files get these files' digests.
        workers: where the files are read, which may be many; None for threads of this process.
        report: is told the name of each sequence that was read through.
    """
    known = None if workers is None else as_workers(workers)
    content = digests({s.name: s.content for s in sequences if s.content}, known, report)
    found = [replace(s, digest=content[s.name]) if s.content else s for s in sequences]
    return found, [
        replace(c, files=tuple((s.name, boxes_digest(s, c)) for s in found))
        if c.kind == 'boxes'
        else c
        for c in contenders
    ]


def run(
    sequences: list[Sequence],
    contenders: list[Contender],
    folder: Path,
    options: RunOptions,
    report: Report = lambda done, name, found: None,
    workers: Workers | Executor | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> list[Failure]:
    """Run every contender on every sequence that it has not run on yet.

    What fails is tried again, once; the same files come out wherever the jobs run.

    Args:
        sequences: what to run on, as :func:`identify` gives them.
        contenders: what to run.
        folder: where results go; only this process writes there.
        options: how.
        report: is told of progress.
        workers: where jobs run: any executor, None for this process.
        stopped: is asked before each job whether to begin no more; those under way are finished.

    Returns:
        What failed, in the order of sequences and contenders; everything else is in ``folder``.

    Raises:
        WorkersError: where the workers are lost; what came back until then is in ``folder``.
    """
    chosen = as_workers(workers)
    todo: list[tuple[Sequence, tuple[Contender, ...]]] = []
    for sequence in sequences:
        missing = tuple(
            c for c in contenders if options.fresh or not is_done(folder, sequence, c, options)
        )
        report(len(contenders) - len(missing), sequence.name, True)
        if missing:
            todo.append((sequence, missing))
    failures = _Failures()
    jobs = _split(todo, chosen.slots(), options) if todo else []
    for done in run_all(run_job, jobs, chosen, _failed_part, stopped=stopped):
        if done.result is not None:
            unpack(done.result, folder)
        failures.note(done)
        settled = len(done.item.contenders) - (len(done.rest.contenders) if done.rest else 0)
        report(settled, done.item.sequence.name, False)
    return failures.ordered(sequences, contenders)


def _split(
    todo: list[tuple[Sequence, tuple[Contender, ...]]], slots: int, options: RunOptions
) -> list[Job]:
    """Jobs of a sequence each; of a part of its trackers where there are fewer than slots."""
    parts = -(-slots // len(todo))
    jobs = []
    for sequence, contenders in todo:
        size = min(MOST_TOGETHER, -(-len(contenders) // parts))
        jobs += [
            Job(sequence, contenders[i : i + size], options)
            for i in range(0, len(contenders), size)
        ]
    return jobs


def _failed_part(job: Job, parcel: Packed[list[Failure]]) -> Job | None:
    """The same job for those that failed; None where none did."""
    failed = {f.tracker for f in parcel.result}
    rest = tuple(c for c in job.contenders if c.name in failed or '' in failed)
    return replace(job, contenders=rest) if rest else None


@dataclass
class _Failures:
    """The last failure of each run; one that succeeds after all is none."""

    _kept: dict[tuple[str, str], Failure] = field(default_factory=dict)

    def note(self, done: Done[Job, Packed[list[Failure]]]) -> None:
        name = done.item.sequence.name
        if done.rest is not None:
            return
        if done.result is not None:
            found: Iterable[Failure] = done.result.result
        else:
            found = [Failure(name, '', f'{done.error}')]
        for failure in found:
            # A sequence that fails for several jobs, each of a part of the trackers, fails once.
            self._kept[name, failure.tracker] = failure

    def ordered(self, sequences: list[Sequence], contenders: list[Contender]) -> list[Failure]:
        names = ['', *(c.name for c in contenders)]
        keys = ((s.name, tracker) for s in sequences for tracker in names)
        return [self._kept[key] for key in keys if key in self._kept]
