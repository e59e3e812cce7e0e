# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How long updates took, apart from the report: times are of a machine, results are not."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.store import left_by_a_run, read_json, slug, write_json
from rgbd_kcf_tracker.evaluation.table import Table

FILE = 'times.csv'


def times_path(folder: Path, tracker: str, sequence: str) -> Path:
    """Where the times of a tracker on a sequence lie."""
    return folder / 'times' / slug(tracker) / f'{slug(sequence)}.json'


def write_times(folder: Path, tracker: str, sequence: str, milliseconds: Sequence[float]) -> None:
    """Keep the time of each update, and what it ran on; nothing where nothing was run."""
    if milliseconds:
        write_json(
            times_path(folder, tracker, sequence),
            {
                'machine': platform.node(),
                'processor': processor(),
                'milliseconds': [round(ms, 3) for ms in milliseconds],
            },
        )


def read_times(folder: Path, tracker: str, sequence: str) -> list[float]:
    """Milliseconds of each update, the start first; empty where none were kept."""
    try:
        kept = read_json(times_path(folder, tracker, sequence))
        return [float(ms) for ms in kept['milliseconds']]
    except (DatasetError, KeyError, TypeError, ValueError):
        return []


def times_table(folder: Path, runs: Iterable[tuple[str, str]]) -> Table:
    """Times per tracker and kind of processor, over the (tracker, sequence) pairs of a report."""
    found: dict[tuple[str, str], list[list[float]]] = {}
    for tracker, sequence in runs:
        path = times_path(folder, tracker, sequence)
        if not path.is_file():
            continue
        with left_by_a_run():
            kept = read_json(path)
        key = tracker, str(kept.get('processor', ''))
        found.setdefault(key, []).append(read_times(folder, tracker, sequence)[1:])
    rows = []
    for (tracker, kind), times in found.items():
        ms = np.concatenate(times)
        median, p95 = np.percentile(ms, [50, 95]).tolist() if len(ms) else (None, None)
        rows.append((tracker, kind, len(times), len(ms), median, p95))
    return Table(
        'times',
        'Milliseconds of one update on one core, taken while other processes may have run',
        ('tracker', 'processor', 'sequences', 'updates', 'median ms', 'p95 ms'),
        tuple(rows),
        digits=2,
    )


@cache
def processor() -> str:
    """The kind of processor, as far as the system says."""
    try:
        text = Path('/proc/cpuinfo').read_text(encoding='utf-8', errors='replace')
        for line in text.splitlines():
            if line.startswith('model name'):
                return ' '.join(line.partition(':')[2].split())
    except OSError:
        pass
    return platform.processor() or platform.machine()
