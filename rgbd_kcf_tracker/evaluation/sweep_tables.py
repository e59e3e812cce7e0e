# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a sweep found: the best settings, which parameters matter, and what holds on other data."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence as Items
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.datasets.base import Sequence
from rgbd_kcf_tracker.evaluation.jobs import Failure, RunOptions, truth_key, truth_path, why_nothing
from rgbd_kcf_tracker.evaluation.measured import Measured
from rgbd_kcf_tracker.evaluation.metrics import sensitivity
from rgbd_kcf_tracker.evaluation.metrics.sensitivity import Labels
from rgbd_kcf_tracker.evaluation.perframe import collect
from rgbd_kcf_tracker.evaluation.store import read_truth
from rgbd_kcf_tracker.evaluation.sweep import Axis, Setting
from rgbd_kcf_tracker.evaluation.table import Cell, Table

SMALLER_IS_BETTER = frozenset(
    {'fp', 'fn', 'center_error', 'center_error_x', 'center_error_y', 'strangers'}
)
BINS = 5
"""Into so many parts, equally full, the values of a random search are put to be compared."""
SHOWN = 20
"""Settings in the table of the best."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The scores of a sweep.

    Attributes:
        measure: its name.
        axes: parameters that were tried; those with one value are left out.
        whole_grid: whether every combination was tried, instead of random ones.
        default: the setting that all others are held against.
        settings: the others.
        tried: ``(1 + S, Q)`` scores of the default and of the settings; NaN where one failed.
        tried_of: ``(Q,)`` which recording each sequence is of.
        finalists: indices of the best settings, which ran on held-out sequences too.
        held_out: ``(1 + F, H)`` scores of the default and the finalists there.
        held_out_of: ``(H,)`` which recording each sequence is of.
    """

    measure: str
    axes: tuple[Axis, ...]
    whole_grid: bool
    default: Setting
    settings: tuple[Setting, ...]
    tried: FloatArray
    tried_of: Labels
    finalists: tuple[int, ...]
    held_out: FloatArray
    held_out_of: Labels

    @property
    def sign(self) -> float:
        """1 where more is better, else -1."""
        return -1.0 if self.measure in SMALLER_IS_BETTER else 1.0

    @property
    def scale(self) -> float:
        """From scores to what tables show: shares are in percent."""
        return 1.0 if self.measure.startswith('center_error') else 100.0


def scores(
    folder: Path,
    sequences: Items[Sequence],
    settings: Items[Setting],
    options: RunOptions,
    measure: str,
    failures: Items[Failure] = (),
) -> tuple[FloatArray, Labels]:
    """What settings scored on sequences, from what their runs left.

    Args:
        folder: of the report.
        sequences: that were run.
        settings: that were run, the default first.
        options: of the runs.
        measure: which one is asked for.
        failures: of the runs: what is told where nothing was measured.

    Returns:
        ``(S, Q)`` scores, NaN where one failed, and ``(Q,)`` which recording each sequence is of.

    Raises:
        DatasetError: where nothing was measured, or no sequence has the measure.
    """
    rows, measured_any = [], []
    for one in settings:
        collected = collect(folder, sequences, [one.contender], options)
        measured = Measured(collected.results, collected.infos)
        own = [measured.of(one.contender.name, s.name) for s in sequences]
        measured_any.append(any(m is not None for m in own))
        rows.append([math.nan if m is None else float(getattr(m, measure)) for m in own])
    table = np.array(rows, np.float64).reshape(len(settings), len(sequences))
    kept = ~np.isnan(table[0])  # the default says where there is such a measure
    if not kept.any():
        default = settings[0].contender.name
        raise DatasetError(
            f'no sequence has {measure} of {default}: choose another --measure'
            if measured_any[0]
            else why_nothing([f for f in failures if f.tracker in ('', default)])
        )
    return table[:, kept], sensitivity.numbered([s.recording for s in sequences])[kept]


def frames(folder: Path, sequences: Items[Sequence], options: RunOptions) -> dict[str, int]:
    """Frames of each sequence that was run."""
    counts = {}
    for sequence in sequences:
        path = truth_path(folder, sequence.name, truth_key(sequence, options))
        if path.is_file():
            counts[sequence.name] = len(read_truth(path).stamps_ns)
    return counts


def best(tried: FloatArray, count: int, sign: float) -> tuple[int, ...]:
    """The best settings by mean score, those that failed anywhere left out.

    Args:
        tried: ``(1 + S, Q)`` scores of the default and of the settings; NaN where one failed.
        count: of settings at the most.
        sign: 1 where more is better, -1 where less is.

    Returns:
        Indices of settings, 0 to S - 1, the best first.
    """
    means = sign * tried[1:].mean(axis=1)  # NaN where one failed
    order = np.argsort(-np.where(np.isnan(means), -np.inf, means), kind='stable')
    return tuple(int(i) for i in order[:count] if not np.isnan(means[i]))


def all_tables(found: Found) -> list[Table]:
    """The tables of a sweep, the most telling first."""
    return [held_out(found), parameters(found), best_settings(found)]


def held_out(found: Found) -> Table:
    """The default and the finalists on sequences that took no part in choosing."""
    gains = [
        sensitivity.gain(found.held_out[i] - found.held_out[0], found.held_out_of)
        for i in _places(found)
    ]
    known = [gain for gain in gains if gain is not None]
    ps = iter(sensitivity.holm([gain.p for gain in known]))
    rows: list[tuple[Cell, ...]] = [
        (
            'default', *_values(found, found.default),
            found.scale * float(found.tried[0].mean()),
            found.scale * float(found.held_out[0].mean()), None, '', None, '',
        )
    ]  # fmt: skip
    for place, index, gain in zip(_places(found), found.finalists, gains, strict=True):
        one = found.settings[index]
        row: tuple[Cell, ...] = (
            one.contender.name, *_values(found, one),
            found.scale * float(found.tried[1 + index].mean()),
            found.scale * float(found.held_out[place].mean()),
        )  # fmt: skip
        if gain is None:
            rows.append((*row, None, '', None, 'failed here'))
            continue
        p = next(ps)
        told = 'not told from noise'
        if p < sensitivity.LEVEL:
            told = 'better' if found.sign * gain.mean > 0 else 'worse'
        interval = _interval(found, gain.low, gain.high)
        rows.append((*row, found.scale * gain.mean, interval, p, told))
    count = found.held_out.shape[1]
    return Table(
        'held_out',
        f'The best settings on {count} held-out sequence{"" if count == 1 else "s"}',
        (
            'setting', *_names(found), f'{found.measure}, tried on', f'{found.measure}, held out',
            'gain, held out', '95 % interval', 'p', 'verdict',
        ),
        tuple(rows),
        digits=3,
        note='The gain over the default on sequences that took no part in choosing: what is better '
        'where it was chosen and not here was luck. p is of a gain as far from 0 by chance (signs '
        'of the differences dealt out anew to recordings), held against the number of settings '
        '(Holm).',
        quoted='default',
    )  # fmt: skip


def parameters(found: Found) -> Table:
    """What each parameter does to the score, over all values of the others."""
    effects = [effect(found, axis) for axis in found.axes]
    ps = sensitivity.holm([e.p for _, e in effects])
    rows: list[tuple[Cell, ...]] = []
    for axis, (labels, one), p in zip(found.axes, effects, ps, strict=True):
        order = np.argsort(found.sign * one.means)
        rows.append(
            (
                axis.info.name, str(axis.info.default), labels[order[-1]], labels[order[0]],
                found.scale * one.span, 100 * one.share, p,
                'matters' if p < sensitivity.LEVEL else 'not told from noise',
            )
        )  # fmt: skip
    rows.sort(key=lambda row: -float(row[4] or 0))
    chance = (
        'its values are dealt out anew within each recording'
        if found.whole_grid
        else 'its values are dealt out anew among settings'
    )
    left = 100 * (1 - sum(e.share for _, e in effects))
    return Table(
        'parameters',
        'What matters and what is noise',
        (
            'parameter', 'default', 'best', 'worst', f'{found.measure}, best less worst',
            'share of variance %', 'p', 'verdict',
        ),
        tuple(rows),
        digits=3,
        note=f'Means over all settings with a value. p is of differences as large when {chance}, '
        f'held against the number of parameters (Holm). The shares leave {max(left, 0.0):.0f} % of '
        'the variance between settings to what parameters do together'
        + ('.' if found.whole_grid else ', and to values drawn by chance.'),
        quoted='',
    )  # fmt: skip


def best_settings(found: Found) -> Table:
    """The best settings where they were tried, beside the default."""
    rows: list[tuple[Cell, ...]] = [
        ('default', *_values(found, found.default), found.scale * float(found.tried[0].mean()),
         None, '')
    ]  # fmt: skip
    for index in best(found.tried, SHOWN, found.sign):
        difference = found.tried[1 + index] - found.tried[0]
        gain = sensitivity.gain(difference, found.tried_of)
        one = found.settings[index]
        rows.append(
            (
                one.contender.name, *_values(found, one),
                found.scale * float(found.tried[1 + index].mean()),
                None if gain is None else found.scale * gain.mean,
                '' if gain is None else _interval(found, gain.low, gain.high),
            )
        )  # fmt: skip
    failed = int(np.isnan(found.tried[1:]).any(axis=1).sum())
    count = found.tried.shape[1]
    note = f'Of {len(found.settings)} settings on {count} sequence{"" if count == 1 else "s"}.'
    if failed:
        note += f' {failed} failed on one of them or more and are in no table.'
    return Table(
        'best_settings',
        'The best settings where they were tried',
        ('setting', *_names(found), found.measure, 'gain', '95 % interval'),
        tuple(rows),
        digits=3,
        note=f'{note} The best of many is best by luck too: see the held-out sequences.',
        quoted='default',
    )


def effect(found: Found, axis: Axis) -> tuple[list[str], sensitivity.Effect]:
    """Labels of a parameter's values (or of ranges of them), and what they do."""
    kept = [i for i in range(len(found.settings)) if not np.isnan(found.tried[1 + i]).any()]
    if not kept:
        raise DatasetError('every setting failed: see failures.txt')
    texts = [found.settings[i].values[axis.info.name] for i in kept]
    table = found.tried[1:][kept]
    numeric = axis.info.type in (int, float)
    if numeric:
        values = np.array([float(t) for t in texts])
        which = sensitivity.binned(values, len(values) if found.whole_grid else BINS)
        groups = [values[which == n] for n in range(which.max() + 1)]
        labels = [
            f'{g.min():g}' if g.min() == g.max() else f'{g.min():.3g} to {g.max():.3g}'
            for g in groups
        ]
    else:
        labels = [v for v in axis.values if v in texts]
        which = np.array([labels.index(t) for t in texts], np.int64)
    # A grid of which settings failed is no whole grid any more.
    balanced = found.whole_grid and len(kept) == len(found.settings)
    return labels, sensitivity.effect(table, which, balanced, found.tried_of)


def settings_csv(found: Found) -> str:
    """Every setting: its values and its mean score, and where it was a finalist that there."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(('setting', *_names(found), found.measure, f'{found.measure}_held_out'))
    for index, one in enumerate([found.default, *found.settings]):
        held = ''
        if index == 0 or index - 1 in found.finalists:
            row = 0 if index == 0 else 1 + found.finalists.index(index - 1)
            held = f'{found.held_out[row].mean():.6g}'
        mean = found.tried[index].mean()
        shown = '' if np.isnan(mean) else f'{mean:.6g}'
        writer.writerow((one.contender.name, *_values(found, one), shown, held))
    return text.getvalue()


def _places(found: Found) -> range:
    return range(1, 1 + len(found.finalists))


def _names(found: Found) -> list[str]:
    return [axis.info.name for axis in found.axes]


def _values(found: Found, one: Setting) -> list[str]:
    return [one.values[name] for name in _names(found)]


def _interval(found: Found, low: float, high: float) -> str:
    if math.isnan(low):
        return ''
    return f'{found.scale * low:+.2f} to {found.scale * high:+.2f}'
