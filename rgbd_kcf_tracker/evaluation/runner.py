# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Many sequences by many trackers, in parallel processes, going on where it was interrupted."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2

from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import Sequence
from rgbd_kcf_tracker.evaluation.jobs import (
    Failure,
    Job,
    RunOptions,
    is_done,
    run_job,
)
from rgbd_kcf_tracker.evaluation.pool import Report, run_parallel


def run(
    sequences: list[Sequence],
    contenders: list[Contender],
    folder: Path,
    options: RunOptions,
    report: Report = lambda done, name: None,
    stopped: Callable[[], bool] = lambda: False,
) -> list[Failure]:
    """Run every contender on every sequence that it has not run on yet.

    Args:
        sequences: what to run on.
        contenders: what to run.
        folder: where results go.
        options: how.
        report: is told of progress, the runs found done at first.
        stopped: is asked before each run whether to begin no more; those under way are finished.

    Returns:
        What failed; everything else is in ``folder``.
    """
    jobs: list[Job] = []
    for sequence in sequences:
        open_runs = tuple(
            c for c in contenders if options.fresh or not is_done(folder, sequence, c, options)
        )
        report(len(contenders) - len(open_runs), sequence.name)
        if not open_runs:
            continue
        if len(sequences) < options.jobs:  # too few sequences to keep all processes busy
            jobs.extend(Job(sequence, (c,), folder, options) for c in open_runs)
        else:
            jobs.append(Job(sequence, open_runs, folder, options))
    failures: list[Failure] = []
    if options.jobs <= 1:
        threads = cv2.getNumThreads()
        cv2.setNumThreads(1)
        try:
            for job in jobs:
                if stopped():
                    break
                failures.extend(run_job(job))
                report(len(job.contenders), job.sequence.name)
        finally:
            cv2.setNumThreads(threads)
    else:
        failures.extend(run_parallel(jobs, options.jobs, report, stopped))
    return failures
