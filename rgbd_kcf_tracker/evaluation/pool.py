# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Jobs in parallel processes, where one that kills its process takes no other with it."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context

import cv2

from rgbd_kcf_tracker.evaluation.jobs import Failure, Job, run_job

Report = Callable[[int, str], None]
"""Called with the number of runs that are done and the sequence's name."""

_THREADS = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMEXPR_NUM_THREADS')


def run_parallel(
    jobs: list[Job],
    count: int,
    report: Report,
    stopped: Callable[[], bool] = lambda: False,
) -> list[Failure]:
    """Run jobs in processes; one that kills its process (out of memory, say) fails alone.

    Args:
        jobs: to run.
        count: processes.
        report: is told of each that is done.
        stopped: is asked whether to begin no more; those under way are finished.
    """
    failures: list[Failure] = []
    suspects: list[Job] = []
    waiting = list(jobs)
    while waiting and not stopped():
        waiting, broken = _run_pool(waiting, count, report, stopped, failures)
        suspects.extend(broken)
    for job in suspects:
        if stopped():
            break
        _, broken = _run_pool([job], 1, report, stopped, failures)
        for lost in broken:
            failures.append(
                Failure(lost.sequence.name, '', 'the process died: out of memory, or a crash')
            )
            report(len(lost.contenders), lost.sequence.name)
    return failures


def _run_pool(
    jobs: list[Job],
    count: int,
    report: Report,
    stopped: Callable[[], bool],
    failures: list[Failure],
) -> tuple[list[Job], list[Job]]:
    """Returns the jobs that were not begun, and those that ran when the pool broke."""
    with _single_threaded():
        pool = ProcessPoolExecutor(
            count, mp_context=get_context('spawn'), initializer=_start_worker
        )
        running: dict[Future[list[Failure]], Job] = {}
        waiting = list(reversed(jobs))
        broken: list[Job] = []
        try:
            while (waiting or running) and not broken:
                while waiting and len(running) < count and not stopped():
                    job = waiting.pop()
                    with _interrupts_for_us():
                        running[pool.submit(run_job, job)] = job
                if not running:
                    break
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    job = running.pop(future)
                    try:
                        failures.extend(future.result())
                        report(len(job.contenders), job.sequence.name)
                    except BrokenProcessPool:
                        broken.append(job)
            broken.extend(running.values())
        except BaseException:
            for process in list((pool._processes or {}).values()):
                process.terminate()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
    return list(reversed(waiting)), broken


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Processes started inside get one BLAS thread each: they share the cores already."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, '1'))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def _interrupts_for_us() -> Iterator[None]:
    """Processes started inside are never reached by Ctrl-C, which is the parent's to handle."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _start_worker() -> None:
    cv2.setNumThreads(1)
