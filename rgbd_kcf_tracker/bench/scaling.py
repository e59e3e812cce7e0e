# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What more processes bring, and what the one that hands out jobs costs.

    python -m rgbd_kcf_tracker.bench.scaling

First real jobs on processes of this machine. Then a Dask cluster of more workers than cores, whose
jobs wait instead of computing and bring back as many bytes as a real one: so the cost of handing
out, of bringing back and of writing is seen, as a large cluster has it. Needs the extra
``cluster``.
"""

from __future__ import annotations

import argparse
import functools
import math
import os
import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from rgbd_kcf_tracker.batch.cluster import Cluster
from rgbd_kcf_tracker.batch.loop import run_all
from rgbd_kcf_tracker.batch.transport import Packed, unpack
from rgbd_kcf_tracker.batch.workers import LocalPool, Workers, cores
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.evaluation.contenders import variant
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, open_dataset
from rgbd_kcf_tracker.evaluation.jobs import Failure, Job, RunOptions, run_job
from rgbd_kcf_tracker.evaluation.table import Table


@dataclass(frozen=True, slots=True)
class Memory:
    """Resident memory of the process that ran a job, in MiB, at its most."""

    peak: float


@dataclass(frozen=True, slots=True)
class Idle:
    """A job that computes nothing.

    Attributes:
        number: which one.
        seconds: that it takes.
        bytes: that it brings back, in four files.
    """

    number: int
    seconds: float
    bytes: int


def idle(job: Idle) -> Packed[None]:
    """Wait, and bring back random bytes."""
    time.sleep(job.seconds)
    size = job.bytes // 4
    return Packed(None, tuple((f'{kind}/{job.number}.bin', os.urandom(size)) for kind in 'abcd'))


def real(job: Job) -> Packed[tuple[list[Failure], Memory]]:
    """A job of an evaluation, with the memory that it needed."""
    parcel = run_job(job)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Packed((parcel.result, Memory(peak)), parcel.files)


def measure_processes(counts: Sequence[int], scenes: str, seconds: float) -> tuple[Table, int]:
    """Time an evaluation on so many processes.

    Returns:
        The table, and how many bytes a job brings back.
    """
    sequences = open_dataset(scenes, DatasetOptions(duration_s=seconds))
    contender, options = variant('metric'), RunOptions()
    jobs = [Job(sequence, (contender,), options) for sequence in sequences]
    rows: list[tuple[int, float, float, float, float]] = []
    brought = 0
    for count in counts:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        with LocalPool(count) as pool, TemporaryDirectory() as folder:
            warm = [Idle(-i, 0.5, 0) for i in range(count)]
            list(run_all(idle, warm, pool))  # processes start once, however many jobs there are
            began, own = time.perf_counter(), time.process_time()
            peaks = []
            for done in run_all(real, jobs, pool):
                if done.result is None:
                    raise RuntimeError(f'{done.item.sequence.name}: {done.error}')
                brought = max(brought, sum(len(data) for _, data in done.result.files))
                failures, memory = unpack(done.result, Path(folder))
                if failures:
                    raise RuntimeError(failures[0].reason)
                peaks.append(memory.peak)
            spent, own = time.perf_counter() - began, time.process_time() - own
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        worked = after.ru_utime + after.ru_stime - used.ru_utime - used.ru_stime
        rows.append((count, spent, worked, own, max(peaks)))
    first = rows[0][0] * rows[0][1]
    return Table(
        'processes',
        f'{len(jobs)} scenes of {seconds:g} s by metric, on {cores()} cores',
        (
            'processes', 'seconds', 'efficiency %', 'CPU s of the processes', 'CPU s beside them',
            'peak MiB of a process',
        ),
        tuple(
            (f'{count}', spent, 100 * first / (spent * count), worked, own, peak)
            for count, spent, worked, own, peak in rows
        ),
    ), brought  # fmt: skip


def measure_cluster(counts: Sequence[int], jobs_each: int, seconds: float, size: int) -> Table:
    """Time jobs that wait on a cluster of so many workers."""
    import distributed

    rows = []
    for count in counts:
        with (
            distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=False,
                protocol='tcp',
                dashboard_address=':0',
            ) as cluster,
            Cluster(cluster.scheduler_address) as workers,
        ):
            total = count * jobs_each
            jobs = [Idle(i, seconds, size) for i in range(total)]
            wall, cpu = _timed(functools.partial(_drain, jobs, workers))
        ideal = jobs_each * seconds
        rows.append((f'{count}', total, wall, 100 * ideal / wall, total / wall, 1e3 * cpu / total))
    return Table(
        'cluster',
        f'Jobs of {seconds:g} s that bring back {size // 1024} KiB, workers in one process',
        ('workers', 'jobs', 'seconds', 'efficiency %', 'jobs/s', 'CPU ms per job'),
        tuple(rows),
        digits=1,
        note='CPU of client, scheduler and workers together, the making of the bytes included.',
    )


def measure_coordinator(sizes: Sequence[int], jobs_each: int) -> Table:
    """What a job costs the process that hands it out, the scheduler in it; workers are others."""
    import distributed

    rows = []
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=':0'
        ) as cluster,
        Cluster(cluster.scheduler_address) as workers,
    ):
        _drain([Idle(-i, 0.0, 0) for i in range(20)], workers)  # all is imported and connected
        for size in sizes:
            jobs = [Idle(i, 0.0, size) for i in range(jobs_each)]
            wall, cpu = _timed(functools.partial(_drain, jobs, workers))
            rows.append((f'{size // 1024}', jobs_each / wall, 1e3 * cpu / jobs_each))
    return Table(
        'coordinator',
        'Jobs that do nothing: client and scheduler in one process, two workers',
        ('KiB per job', 'jobs/s', 'CPU ms per job'),
        tuple(rows),
        digits=1,
    )


def _drain(jobs: Sequence[Idle], workers: Workers) -> None:
    with TemporaryDirectory() as folder:
        for done in run_all(idle, jobs, workers):
            if done.result is None:
                raise RuntimeError(f'{done.error}')
            unpack(done.result, Path(folder))


def _timed(work: Callable[[], None]) -> tuple[float, float]:
    """Seconds, and seconds of CPU of this process."""
    began, spent = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - began, time.process_time() - spent


def counts(text: str) -> list[int]:
    """Whole numbers above 0, as in ``1,2,4``; a ValueError for anything else."""
    numbers = [int(part) for part in text.split(',')]
    if min(numbers) < 1:
        raise ValueError(text)
    return numbers


def main(argv: Sequence[str] | None = None) -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description='what more workers bring, and what they cost')
    parser.add_argument('--processes', type=counts, default=[1, 2], metavar='N,...')
    parser.add_argument('--workers', type=counts, default=[4, 16, 64], metavar='N,...')
    parser.add_argument('--scenes', default='sim:normal,occlusion,crossing,clutter:1-2')
    parser.add_argument('--duration', type=float, default=3.0, metavar='S')
    parser.add_argument('--jobs-each', type=int, default=10, metavar='N')
    parser.add_argument('--job', type=float, default=2.0, metavar='S', help='of a waiting job')
    args = parser.parse_args(argv)
    if args.jobs_each < 1 or not 0 < args.job < math.inf:
        parser.error('--jobs-each must be 1 or more, and --job a number above 0')
    try:
        processes, brought = measure_processes(args.processes, args.scenes, args.duration)
    except RgbdKcfError as error:
        parser.error(str(error))
    print(f'{processes.text()}\na job brings back {brought / 1024:.0f} KiB\n')
    print(measure_coordinator([0, brought], 300).text() + '\n')
    print(measure_cluster(args.workers, args.jobs_each, args.job, brought).text())
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
