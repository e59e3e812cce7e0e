# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The tables of a report that are ours; those in the thesis's shape are in ``thesis_tables``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.evaluation.measured import Measured
from rgbd_kcf_tracker.evaluation.metrics import (
    calibration,
    longterm,
    otb,
    sensitivity,
)
from rgbd_kcf_tracker.evaluation.metrics.confusion import HIT_IOU, UNDETERMINED, Confusion
from rgbd_kcf_tracker.evaluation.metrics.presence import STRANGER_IOU
from rgbd_kcf_tracker.evaluation.table import Cell, Table

REAL, SIMULATED = 'real', 'simulated'


@dataclass(frozen=True, slots=True)
class Column:
    """A measure as tables show it: its heading, its value from 0 to 1 times ``scale``."""

    name: str
    heading: str
    scale: float = 100.0


OVERVIEW: tuple[Column, ...] = (
    Column('success', 'success %'),
    Column('success_auc', 'success AUC %'),
    Column('iou', 'IoU %'),
    Column('recall_of_absence', 'recall of absence %'),
    Column('strangers', 'strangers %'),
    Column('returns', 'returns %'),
    Column('tp', 'TP %'),
    Column('fp', 'FP %'),
    Column('fn', 'FN %'),
    Column('tn', 'TN %'),
    Column('precision_20px', 'P@20px %'),
    Column('otb_auc', 'OTB AUC %'),
    Column('center_error', 'centre error px', 1.0),
    Column('center_error_x', 'x px', 1.0),
    Column('center_error_y', 'y px', 1.0),
)

BY_SCENARIO: tuple[Column, ...] = (
    Column('success', 'success %'),
    Column('iou', 'IoU %'),
    Column('recall_of_absence', 'recall of absence %'),
    Column('strangers', 'strangers %'),
    Column('returns', 'returns %'),
    Column('tp', 'TP %'),
    Column('tn', 'TN %'),
    Column('precision_20px', 'P@20px %'),
)


PER_SEQUENCE: tuple[Column, ...] = (
    Column('success', 'success %'),
    Column('iou', 'IoU %'),
    Column('strangers', 'strangers %'),
    Column('returns', 'returns %'),
)


def overview(measured: Measured) -> Table:
    """Every measure of every tracker, mean over sequences, with a 95 % interval of success."""
    rows = []
    for tracker in measured.trackers:
        m = measured.mean(tracker)
        low, high = bootstrap_interval(
            measured.values(tracker, 'success'), measured.recordings(tracker)
        )
        rows.append(
            (
                tracker,
                *(scaled(getattr(m, c.name), c.scale) for c in OVERVIEW[:1]),
                '' if math.isnan(low) else f'{100 * low:.1f} to {100 * high:.1f}',
                *(scaled(getattr(m, c.name), c.scale) for c in OVERVIEW[1:]),
            )
        )
    headings = [c.heading for c in OVERVIEW]
    return Table(
        'overview',
        f'All measures, mean over {number(measured)}',
        ('tracker', headings[0], '95 % interval', *headings[1:]),
        tuple(rows),
        note='The interval is of the mean over sequences, those of one recording together '
        '(bootstrap).',
    )


def by_scenario(measured: Measured) -> list[Table]:
    """One table per measure: scenarios down, trackers across."""
    tables = []
    for column in BY_SCENARIO:
        rows: list[tuple[Cell, ...]] = []
        for scenario in measured.scenarios:
            count = sum(measured.infos[s].scenario == scenario for s in measured.sequences)
            means = (measured.mean(t, scenario) for t in measured.trackers)
            cells = (scaled(getattr(m, column.name), column.scale) for m in means)
            rows.append((scenario, count, *cells))
        total = (measured.mean(t) for t in measured.trackers)
        rows.append(
            (
                'all',
                len(measured.sequences),
                *(scaled(getattr(m, column.name), column.scale) for m in total),
            )
        )
        tables.append(
            Table(
                f'scenario_{column.name}',
                f'{column.heading} by scenario',
                ('scenario', 'sequences', *measured.trackers),
                tuple(rows),
            )
        )
    return tables


def by_sequence(measured: Measured) -> Table:
    """What counts most, of every tracker on every sequence."""
    columns = ['sequence', 'scenario', 'frames']
    columns += [f'{t}: {c.heading}' for t in measured.trackers for c in PER_SEQUENCE]
    rows = []
    for sequence in measured.sequences:
        cells: list[Cell] = []
        frames = 0
        for tracker in measured.trackers:
            m, r = measured.of(tracker, sequence), measured.result(tracker, sequence)
            frames = len(r.stamps_ns) if r else frames
            cells += [scaled(getattr(m, c.name), c.scale) if m else None for c in PER_SEQUENCE]
        rows.append((sequence, measured.infos[sequence].scenario, frames, *cells))
    return Table('sequences', 'Every sequence', tuple(columns), tuple(rows))


def ablation(measured: Measured, base: str) -> Table:
    """The variant, and what it loses without each of its ingredients."""
    columns = (
        'success',
        'iou',
        'recall_of_absence',
        'strangers',
        'returns',
        'tp',
        'precision_20px',
    )
    full = measured.mean(base)
    rows = []
    for tracker in measured.trackers:
        if tracker != base and not tracker.startswith(f'{base} without '):
            continue
        m = measured.mean(tracker)
        cells: list[Cell] = []
        for name in columns:
            cells.append(scaled(getattr(m, name), 100))
            if name in ('success', 'iou'):
                loss = getattr(m, name) - getattr(full, name)
                cells.append(None if tracker == base else scaled(loss, 100))
        rows.append((tracker, *cells))
    headings = (
        'success %', 'change', 'IoU %', 'change', 'recall of absence %', 'strangers %', 'returns %',
        'TP %', 'P@20px %',
    )  # fmt: skip
    return Table(
        f'ablation_{base}',
        f'What {base} loses without each ingredient, mean over {number(measured)}',
        ('tracker', *headings),
        tuple(rows),
        note='Each row switches one parameter use_... off; changes are in percentage points.',
    )


def otb_protocol(measured: Measured) -> Table | None:
    """OTB's own numbers, the first frame counted as the benchmark does; None elsewhere."""
    kept = [s for s in measured.sequences if measured.infos[s].kind == 'otb']
    if not kept:
        return None
    rows = []
    for tracker in measured.trackers:
        own = [r.frames for s in kept if (r := measured.result(tracker, s)) is not None]
        precision = [otb.precision_at_20(otb.precision_curve(f.error[f.there])) for f in own]
        auc = [otb.area_under_curve(otb.success_curve(f.overlap[f.there])) for f in own]
        means = (float(np.mean(values)) if values else None for values in (precision, auc))
        rows.append((tracker, len(own), *means))
    return Table(
        'otb',
        'OTB one-pass evaluation',
        ('tracker', 'sequences', 'precision at 20 px', 'AUC'),
        tuple(rows),
        digits=3,
        note='As the benchmark counts, the first frame included: to be held against its papers.',
    )


def confusion_cells(matrix: Confusion) -> tuple[Cell, ...]:
    """TP, FP, FN, TN in percent, or that they cannot be determined."""
    values = (matrix.tp, matrix.fp, matrix.fn, matrix.tn)
    return tuple(UNDETERMINED if v is None else 100 * v for v in values)


def long_term(measured: Measured) -> tuple[Table, dict[str, longterm.LongTerm]]:
    """Precision, recall and F-score from the published scores, and the curves behind them."""
    rows, curves = [], {}
    for tracker in measured.trackers:
        scored = [
            longterm.ScoredSequence(
                np.nan_to_num(r.counted.overlap), r.counted.score, int(r.counted.there.sum())
            )
            for r in measured.results
            if r.tracker == tracker
        ]
        curves[tracker] = result = longterm.evaluate(scored)
        cells = (result.precision, result.recall, result.f_score)
        rows.append((tracker, *(scaled(v, 100) for v in cells)))
    return Table(
        'long_term',
        'Long-term precision, recall and F-score',
        ('tracker', 'precision %', 'recall %', 'F-score %'),
        tuple(rows),
        note='At the threshold of the published score with the best F-score (Lukezic et al. 2018).',
        best='max',
    ), curves


@dataclass(frozen=True, slots=True, eq=False)
class Scored:
    """The published scores of one tracker on real or on simulated data, held against the truth."""

    reliability: calibration.Reliability
    on_target: calibration.Honesty


def reliability(measured: Measured) -> tuple[Table, dict[tuple[str, str], Scored]]:
    """Whether scores mean what they say, for real and simulated data apart.

    Returns:
        The table, and what is drawn of each tracker and kind of data (:data:`REAL`,
        :data:`SIMULATED`); trackers whose scores never vary are not among them.
    """
    found: dict[tuple[str, str], Scored] = {}
    rows: list[tuple[Cell, ...]] = []
    for tracker in measured.trackers:
        for data in (REAL, SIMULATED):
            own = [
                r.counted
                for r in measured.results
                if r.tracker == tracker and data == data_of(measured, r.sequence)
            ]
            if not own:
                continue
            scores = np.concatenate([c.score[c.said] for c in own])
            hits = np.concatenate([np.nan_to_num(c.overlap[c.said]) >= HIT_IOU for c in own])
            near = np.concatenate([np.nan_to_num(c.overlap[c.said]) >= STRANGER_IOU for c in own])
            if not len(scores) or scores.min() == scores.max():
                rows.append((tracker, data, len(scores), *[None] * (5 + calibration.BINS)))
                continue
            on_target = calibration.honesty(scores, near)
            right = calibration.honesty(scores, hits)
            binned = calibration.reliability(scores, hits)
            found[tracker, data] = Scored(binned, on_target)
            rows.append(
                (
                    tracker,
                    data,
                    len(scores),
                    on_target.sure,
                    scaled(on_target.sure_share, 100),
                    scaled(right.sure_share, 100),
                    scaled(binned.expected_error, 100),
                    binned.brier,
                    *(scaled(v, 100) for v in binned.hit_rate),
                )
            )
    edges = np.linspace(0.0, 1.0, calibration.BINS + 1)
    sure = f'of {calibration.SURE:g} and more'
    return Table(
        'reliability',
        'Reliability of scores: percent of boxes that are right, by published score',
        (
            'tracker', 'data', 'boxes', sure, f'{sure}: on the target %', f'{sure}: right %',
            'calibration error %', 'Brier', *(f'{a:.1f}-{b:.1f}' for a, b in pairwise(edges)),
        ),
        tuple(rows),
        digits=2,
        note=f'A box is right where its IoU with the visible target is at least {HIT_IOU}, and on '
        f'the target where it is at least {STRANGER_IOU}: else it is on a stranger. Trackers that '
        'publish no score have no row of numbers.',
    ), found  # fmt: skip


def data_of(measured: Measured, sequence: str) -> str:
    """Whether a sequence is real or simulated."""
    return SIMULATED if measured.infos[sequence].simulated else REAL


def bootstrap_interval(values: FloatArray, recordings: sensitivity.Labels) -> tuple[float, float]:
    """95 % interval of the mean over sequences; NaN below two recordings.

    Args:
        values: ``(Q,)``, NaN where a sequence has none.
        recordings: ``(Q,)`` which one each is of.
    """
    known = ~np.isnan(values)
    low, high = sensitivity.bootstrap(values[known][None], recordings[known])
    return float(low[0]), float(high[0])


def number(measured: Measured) -> str:
    """How many sequences, in words."""
    count = len(measured.sequences)
    return f'{count} sequence{"" if count == 1 else "s"}'


def scaled(value: float, scale: float) -> float | None:
    """``value`` times ``scale``, None for NaN."""
    return None if math.isnan(value) else value * scale
