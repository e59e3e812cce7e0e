# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Tables in the shape of the thesis's, with its own numbers as rows of their own beside ours."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from rgbd_kcf_tracker.evaluation import thesis
from rgbd_kcf_tracker.evaluation.measured import Measured
from rgbd_kcf_tracker.evaluation.metrics import confusion, princeton, vot
from rgbd_kcf_tracker.evaluation.perframe import Info
from rgbd_kcf_tracker.evaluation.score_tables import confusion_cells, scaled
from rgbd_kcf_tracker.evaluation.table import Cell, Table

_SPLITS = tuple(princeton.CATEGORIES.items())
_NOT_OURS = (
    'The thesis measured other recordings: compare the order of the trackers, not the numbers.'
)


def all_tables(measured: Measured) -> list[Table]:
    """Every table in the thesis's shape that the sequences allow."""
    tables = [table_3_2(measured, t) for t in measured.trackers]
    tables.append(table_4_1(measured))
    tables.append(table_4_5(measured))
    tables += [t for t in matrices(measured) if t.rows]
    return tables


def table_3_2(measured: Measured, tracker: str) -> Table:
    """Precision of one tracker: data sets (seeds, subjects) down, scenarios across."""
    columns: dict[str, list[float]] = {s: [] for s in measured.scenarios}
    for sequence in measured.sequences:
        m = measured.of(tracker, sequence)
        if m is not None:
            columns[measured.infos[sequence].scenario].append(m.precision)
    longest = max((len(v) for v in columns.values()), default=0)
    rows: list[tuple[Cell, ...]] = [
        (f'data set {i + 1}', *(_at(values, i) for values in columns.values()))
        for i in range(longest)
    ]
    rows.append(('average', *(_mean(values) for values in columns.values())))
    known = [thesis.PRECISION_BY_SCENARIO.get(s) for s in columns]
    if tracker == 'kcf' and any(v is not None for v in known):
        rows.append(('thesis: KCF, average', *known))
    return Table(
        f'table_3_2_{tracker}',
        f'Precision of {tracker} per scenario (as Table 3.2)',
        ('', *columns),
        tuple(rows),
        digits=3,
        note=f'TP / (TP + FP), a hit being IoU at least {confusion.HIT_IOU}. {_NOT_OURS}',
    )


def table_4_1(measured: Measured) -> Table:
    """Princeton success rate by its eleven categories, all from the per-frame file."""
    rows: list[tuple[Cell, ...]] = []
    categories = {name: info.categories for name, info in measured.infos.items()}
    for tracker in measured.trackers:
        rates = {
            r.sequence: princeton.success_rate(r.counted.ratio)
            for r in measured.results
            if r.tracker == tracker
        }
        table = princeton.by_category(rates, categories)
        cells = [
            table[split][name] for split, names in princeton.CATEGORIES.items() for name in names
        ]
        rows.append((tracker, *(scaled(v, 100) for v in (*cells, table['all']['all']))))
    rows += [(name, *values, None) for name, values in thesis.PRINCETON.items()]
    # One without a frame that counts has no rate, whoever tracks.
    counted = {r.sequence for r in measured.results if len(r.counted)}
    numbers = [
        sum(categories[sequence].get(split) == name for sequence in counted)
        for split, names in _SPLITS
        for name in names
    ]
    rows.append(('number of sequences', *numbers, len(counted)))
    derived = any(info.derived for info in measured.infos.values())
    note = 'R at 0.5, each sequence counting once. '
    if derived:
        note += 'Categories by our own criteria (see docs/evaluation.md). '
    headings = ['human', 'animal', 'rigid', 'large', 'small', 'slow', 'fast']
    headings += ['occluded', 'not occluded', 'passive', 'active', 'all']
    return Table(
        'table_4_1',
        'Princeton success rate % by category (as Table 4.1)',
        ('tracker', *headings),
        tuple(rows),
        note=note + _NOT_OURS + " The thesis's own row is not self-consistent: its splits give "
        'overall rates from 40.6 to 48.7.',
        quoted='thesis',
    )


def table_4_5(measured: Measured) -> Table:
    """Average precision: mean of the scenes' precisions."""
    rows: list[tuple[Cell, ...]] = [
        (tracker, scaled(confusion.average_precision(measured.counts(tracker)), 100))
        for tracker in measured.trackers
    ]
    rows += list(thesis.AVERAGE_PRECISION.items())
    return Table(
        'table_4_5', 'Average precision (as Table 4.5)', ('tracker', 'AP %'), tuple(rows), digits=2,
        note=_NOT_OURS,
    )  # fmt: skip


def matrices(measured: Measured) -> list[Table]:
    """Confusion matrices: all sequences (both methods), occluded (5.1) and fast targets (5.2)."""
    by_total, by_prediction = confusion.confusion_by_total, confusion.confusion_by_prediction
    title = 'Confusion matrix by method'
    return [
        _matrix(
            measured, 'confusion_method_1', f'{title} 1, all sequences', by_total,
            lambda i: True, {},
        ),
        _matrix(
            measured, 'figure_4_14', f'{title} 2, all sequences (as Figure 4.14)', by_prediction,
            lambda i: True, thesis.KINECT_CONFUSION,
        ),
        _matrix(
            measured, 'table_5_1', f'{title} 2, occluded targets (as Table 5.1)', by_prediction,
            lambda i: i.categories.get('occlusion') == 'yes', thesis.OCCLUSION_CONFUSION,
        ),
        _matrix(
            measured, 'table_5_2', f'{title} 2, fast targets (as Table 5.2)', by_prediction,
            lambda i: i.categories.get('movement') == 'fast', thesis.FAST_CONFUSION,
        ),
    ]  # fmt: skip


def short_term(
    runs: Mapping[tuple[str, str], vot.ShortTermRun], lengths: tuple[int, int] | None = None
) -> Table:
    """VOT's accuracy, robustness and EAO (as Tables 3.4 and 3.5)."""
    rows: list[tuple[Cell, ...]] = []
    for tracker in dict.fromkeys(t for t, _ in runs):
        own = [run for (t, _), run in runs.items() if t == tracker]
        low, high = lengths or vot.typical_lengths([len(r.codes) for r in own])
        values = (
            vot.expected_average_overlap(own, low, high),
            vot.mean_accuracy(own),
            vot.mean_robustness(own),
            vot.reliability(own),
        )
        cells = (None if math.isnan(v) else v for v in values)
        rows.append((tracker, *cells, f'{low} to {high}'))
    return Table(
        'vot_short_term',
        'VOT short-term protocol with re-initialisation (as Tables 3.4 and 3.5)',
        ('tracker', 'EAO', 'accuracy', 'robustness (failures)', 'reliability', 'EAO lengths'),
        tuple(rows),
        digits=3,
        note='Frames in which the target is absent neither fail nor count. Saying "hidden" while '
        'some of the target shows is a failure here: the protocol knows no occlusion.',
    )


def _matrix(
    measured: Measured,
    key: str,
    title: str,
    method: Callable[[confusion.Counts], confusion.Confusion],
    keep: Callable[[Info], bool],
    quoted: Mapping[str, tuple[float | None, ...]],
) -> Table:
    kept = sum(keep(info) for info in measured.infos.values())
    rows: list[tuple[Cell, ...]] = []
    if kept:
        for tracker in measured.trackers:
            total = sum(measured.counts(tracker, keep), confusion.Counts())
            rows.append((tracker, *confusion_cells(method(total))))
        for name, values in quoted.items():
            rows.append((name, *(confusion.UNDETERMINED if v is None else v for v in values)))
    return Table(
        key,
        title,
        ('tracker', 'TP %', 'FP %', 'FN %', 'TN %'),
        tuple(rows),
        digits=2,
        note=f'Frames of {kept} sequence{"" if kept == 1 else "s"} pooled. '
        f'{_NOT_OURS if quoted else ""}'.strip(),
    )


def _at(values: list[float], index: int) -> float | None:
    return None if index >= len(values) or math.isnan(values[index]) else values[index]


def _mean(values: list[float]) -> float | None:
    known = [v for v in values if not math.isnan(v)]
    return float(np.mean(known)) if known else None
