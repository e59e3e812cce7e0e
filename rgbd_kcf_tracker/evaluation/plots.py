# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Plots of a report, each as the bytes of a PNG file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.evaluation import plot_style
from rgbd_kcf_tracker.evaluation.measured import Measured
from rgbd_kcf_tracker.evaluation.metrics import otb, princeton, vot
from rgbd_kcf_tracker.evaluation.metrics.calibration import SURE, Reliability
from rgbd_kcf_tracker.evaluation.metrics.longterm import LongTerm
from rgbd_kcf_tracker.evaluation.metrics.sensitivity import Effect
from rgbd_kcf_tracker.evaluation.perframe import Result
from rgbd_kcf_tracker.evaluation.score_tables import REAL, SIMULATED, Scored

ERROR_CAP_PX = 150.0
"""Centre errors are drawn up to here, as in the thesis's Figure 3.3."""

_ABSENT, _PARTLY = '#c9ccd1', '#eceef1'


def mean_curves(measured: Measured) -> dict[str, dict[str, FloatArray]]:
    """Per tracker the mean curves over sequences: OTB success and precision, Princeton's R."""
    curves: dict[str, dict[str, FloatArray]] = {}
    for tracker in measured.trackers:
        own = [r.counted for r in measured.results if r.tracker == tracker]
        shown = [c for c in own if c.there.any()]
        curves[tracker] = {
            'success': _mean([otb.success_curve(c.overlap[c.there]) for c in shown], 21),
            'precision': _mean([otb.precision_curve(c.error[c.there]) for c in shown], 51),
            'princeton': _mean([princeton.success_curve(c.ratio) for c in own if len(c)], 21),
        }
    return curves


def curve_plots(measured: Measured, curves: Mapping[str, Mapping[str, FloatArray]]) -> bytes:
    """Success over IoU, precision over pixels, and Princeton's R over its thresholds."""
    figure = plot_style.figure(12.5, 4.2)
    panels = (
        ('success', otb.OVERLAP_THRESHOLDS, 'IoU threshold', 'OTB success plot'),
        ('precision', otb.PIXEL_THRESHOLDS, 'centre error threshold (px)', 'OTB precision plot'),
        ('princeton', princeton.THRESHOLDS, 'overlap threshold', "Princeton's R"),
    )
    strokes = plot_style.strokes(measured.trackers)
    for index, (key, xs, label, title) in enumerate(panels):
        axes = figure.add_subplot(1, 3, index + 1)
        for tracker in measured.trackers:
            ys = curves[tracker][key]
            value = ys[otb.PRECISION_BIN] if key == 'precision' else np.mean(ys)
            axes.plot(xs, ys, **strokes[tracker], lw=1.8, label=f'{tracker} [{value:.3f}]')
        axes.set(xlabel=label, title=title, ylim=(0, 1.02), xlim=(xs[0], xs[-1]))
        if index == 0:
            axes.set_ylabel('share of frames')
        plot_style.tidy(axes)
        legend_title = 'at 20 px' if key == 'precision' else 'area under curve'
        axes.legend(fontsize=7.5, title=legend_title, title_fontsize=7.5, frameon=False)
    return plot_style.png(figure)


def scenario_plot(measured: Measured, main: str) -> bytes:
    """Success by scenario: one row per scenario, one dot per tracker, sorted by the main one."""
    palette = plot_style.colors(measured.trackers)
    markers = plot_style.markers(measured.trackers)
    figure = plot_style.figure(8.5, 0.9 + 0.3 * len(measured.scenarios))
    axes = figure.add_subplot()
    means = {
        (t, s): 100 * measured.mean(t, s).success
        for t in measured.trackers
        for s in measured.scenarios
    }
    order = sorted(measured.scenarios, key=lambda s: means[main, s])
    for y, scenario in enumerate(order):
        values = [means[t, scenario] for t in measured.trackers]
        axes.plot([min(values), max(values)], [y, y], color='#d5d8dc', lw=3, zorder=1)
        for tracker, value in zip(measured.trackers, values, strict=True):
            label = tracker if y == 0 else None
            axes.scatter(
                value, y, s=34, color=palette[tracker], marker=markers[tracker], zorder=2,
                label=label,
            )  # fmt: skip
    axes.set_yticks(range(len(order)), order)
    axes.set(xlim=(-1, 101), xlabel='success % (Princeton, 0.5)', ylim=(-0.7, len(order) - 0.3))
    plot_style.tidy(axes)
    axes.legend(
        fontsize=8, frameon=False, loc='lower center', bbox_to_anchor=(0.5, 1.0),
        ncols=min(5, len(measured.trackers)),
    )  # fmt: skip
    return plot_style.png(figure)


def long_term_plot(curves: Mapping[str, LongTerm]) -> bytes:
    """Precision over recall while the score's threshold falls."""
    figure = plot_style.figure(5.2, 4.2)
    axes = figure.add_subplot()
    strokes, palette = plot_style.strokes(list(curves)), plot_style.colors(list(curves))
    for tracker, c in curves.items():
        label = f'{tracker} [F {c.f_score:.3f}]'
        axes.plot(c.recalls, c.precisions, **strokes[tracker], lw=1.8, label=label)
        axes.plot(c.recall, c.precision, 'o', color=palette[tracker], ms=6)
    axes.set(
        xlabel='recall', ylabel='precision', xlim=(0, 1), ylim=(0, 1.02),
        title='Long-term precision and recall',
    )  # fmt: skip
    plot_style.tidy(axes)
    axes.legend(fontsize=8, frameon=False)
    return plot_style.png(figure)


def reliability_plot(found: Mapping[tuple[str, str], Scored]) -> bytes:
    """Share of right boxes over published score, and how many boxes have that score."""
    palette = plot_style.colors(list(dict.fromkeys(tracker for tracker, _ in found)))
    panels = [
        (f'{tracker}, {data} data', scored.reliability, palette[tracker])
        for (tracker, data), scored in found.items()
    ]
    return _calibration(panels, 'score', 'boxes')


def pairs_plot(found: Mapping[str, Reliability]) -> bytes:
    """Share of pairs of one person over the probability given."""
    palette = plot_style.colors(list(found))
    return _calibration([(n, t, palette[n]) for n, t in found.items()], 'probability', 'pairs')


def _calibration(panels: Sequence[tuple[str, Reliability, str]], across: str, what: str) -> bytes:
    columns = min(4, len(panels))
    rows = -(-len(panels) // columns)
    figure = plot_style.figure(3.1 * columns + 0.4, 3.2 * rows)
    for index, (name, table, color) in enumerate(panels):
        axes = figure.add_subplot(rows, columns, index + 1)
        centers = (table.edges[:-1] + table.edges[1:]) / 2
        share = table.counts / max(1, table.counts.sum())
        axes.bar(centers, share, width=0.096, color=_ABSENT, label=f'share of {what}')
        axes.plot([0, 1], [0, 1], '--', color='#888888', lw=1)
        known = table.counts > 0
        axes.plot(
            table.mean_score[known], table.hit_rate[known], 'o-', color=color, ms=4,
            label=f'right {what}',
        )  # fmt: skip
        axes.set(xlim=(0, 1), ylim=(0, 1.02), xlabel=across)
        axes.set_title(f'{name}\nerror {table.expected_error:.3f}', fontsize=9)
        plot_style.tidy(axes)
        if index == 0:
            axes.legend(  # below, as the curve may be anywhere
                fontsize=7, frameon=False, ncols=2, loc='upper left', bbox_to_anchor=(0, -0.2),
                borderaxespad=0,
            )  # fmt: skip
    return plot_style.png(figure)


def honesty_plot(found: Mapping[tuple[str, str], Scored]) -> bytes:
    """Of the boxes of a score and above, the share on the target; real and simulated data apart."""
    figure = plot_style.figure(5.2, 3.6)
    axes = figure.add_subplot()
    palette = plot_style.colors(list(dict.fromkeys(tracker for tracker, _ in found)))
    lines = {REAL: '-', SIMULATED: '--'}
    for (tracker, data), scored in found.items():
        curve = scored.on_target
        axes.plot(
            curve.limits, curve.shares, lines[data], color=palette[tracker], lw=1.8,
            label=f'{tracker}, {data} data',
        )  # fmt: skip
    axes.axvline(SURE, color='#888888', lw=0.8, ls=':')
    low = least_shown(scored.on_target.shares for scored in found.values())
    axes.set(
        xlim=(0, 1), ylim=(low, 1 + 0.02 * (1 - low)), xlabel='score and above',
        ylabel='boxes on the target', title='What a score is worth',
    )  # fmt: skip
    plot_style.tidy(axes)
    axes.legend(fontsize=8, frameon=False, loc='lower left')
    return plot_style.png(figure)


def least_shown(curves: Iterable[FloatArray]) -> float:
    """Where an axis of shares is to begin, so that curves near 1 can be told apart."""
    shown = [curve[~np.isnan(curve)] for curve in curves]
    return min([0.9, *(math.floor(10 * float(curve.min())) / 10 for curve in shown if curve.size)])


def expected_overlap_plot(
    runs: Mapping[tuple[str, str], vot.ShortTermRun], lengths: tuple[int, int] | None = None
) -> bytes:
    """VOT's expected average overlap over sequence length, the averaged lengths shaded."""
    figure = plot_style.figure(5.2, 3.6)
    axes = figure.add_subplot()
    trackers = list(dict.fromkeys(t for t, _ in runs))
    strokes = plot_style.strokes(trackers)
    for tracker in trackers:
        own = [run for (t, _), run in runs.items() if t == tracker]
        longest = max(len(r.codes) for r in own)
        curve = vot.expected_overlap_curve(own, longest)
        axes.plot(np.arange(1, longest + 1), curve, **strokes[tracker], lw=1.8, label=tracker)
        low, high = lengths or vot.typical_lengths([len(r.codes) for r in own])
        if tracker == trackers[0]:
            axes.axvspan(low, max(high, low + 1), color=_PARTLY, zorder=0)
    axes.set(
        xlabel='sequence length (frames)', ylabel='expected average overlap', ylim=(0, 1.02),
        title='VOT: expected average overlap',
    )  # fmt: skip
    plot_style.tidy(axes)
    axes.legend(fontsize=8, frameon=False)
    return plot_style.png(figure)


def sequence_plot(results: Sequence[Result], palette: Mapping[str, str]) -> bytes:
    """Centre error and IoU over time, frames without the target shaded."""
    first = results[0]
    seconds = (np.array(first.stamps_ns, np.float64) - first.stamps_ns[0]) / 1e9
    figure = plot_style.figure(9.5, 3.4)
    error_axes = figure.add_subplot(2, 1, 1)
    iou_axes = figure.add_subplot(2, 1, 2, sharex=error_axes)
    absent = ~first.frames.there
    partly = ~absent & (np.nan_to_num(first.fraction, nan=1.0) < 0.5)
    for axes in (error_axes, iou_axes):
        _shade(axes, seconds, absent, _ABSENT)
        _shade(axes, seconds, partly, _PARTLY)
        plot_style.tidy(axes)
    strokes = plot_style.strokes(list(palette))
    for row, r in enumerate(results):
        c, color, stroke = r.frames, palette[r.tracker], strokes[r.tracker]
        error_axes.plot(
            seconds, np.minimum(c.error, ERROR_CAP_PX), **stroke, lw=1.2, label=r.tracker
        )
        shown = np.where(c.there, np.nan_to_num(c.overlap), np.nan)
        iou_axes.plot(seconds, shown, **stroke, lw=1.2)
        false = c.said & ~c.there
        iou_axes.plot(
            seconds[false], np.full(false.sum(), -0.07 - 0.07 * row), '|', color=color, ms=4, mew=1
        )
    iou_axes.axhline(0.5, color='#888888', lw=0.8, ls=':')
    error_axes.set(ylabel='centre error (px)', ylim=(0, ERROR_CAP_PX * 1.03))
    error_axes.tick_params(labelbottom=False)
    error_axes.legend(
        fontsize=7.5, frameon=False, ncols=min(6, len(results)), loc='lower left',
        bbox_to_anchor=(0, 0.98), borderaxespad=0.2,
    )  # fmt: skip
    iou_axes.set(
        ylabel='IoU', xlabel='time (s)', ylim=(-0.07 * (len(results) + 1), 1.03),
        xlim=(seconds[0], max(seconds[-1], seconds[0] + 1e-3)), yticks=(0, 0.5, 1),
    )  # fmt: skip
    return plot_style.png(figure, 90)


def _shade(axes: Axes, seconds: FloatArray, mask: Mask, color: str) -> None:
    if not mask.any():
        return
    step = float(np.median(np.diff(seconds))) if len(seconds) > 1 else 1.0
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    for start, stop in edges.reshape(-1, 2):
        axes.axvspan(seconds[start] - step / 2, seconds[stop - 1] + step / 2, color=color, lw=0)


def _mean(curves: Sequence[FloatArray], size: int) -> FloatArray:
    mean: FloatArray = np.mean(curves, axis=0) if curves else np.full(size, np.nan)
    return mean


def effect_plots(
    effects: Sequence[tuple[str, Sequence[str], Effect]], measure: str, scale: float
) -> bytes:
    """Mean score at each value of each parameter, with its interval over sequences."""
    columns = min(4, len(effects))
    rows = -(-len(effects) // columns)
    figure = plot_style.figure(max(4.5, 3.4 * columns), 2.9 * rows)
    for index, (name, labels, effect) in enumerate(effects):
        axes = figure.add_subplot(rows, columns, index + 1)
        xs = np.arange(len(labels))
        axes.fill_between(xs, scale * effect.low, scale * effect.high, color='#cfe2f3', lw=0)
        axes.plot(xs, scale * effect.means, color=plot_style.PALETTE[0], marker='o', ms=4, lw=1.6)
        axes.set_xticks(xs, labels, rotation=30, ha='right')
        axes.set(title=name, ylabel=measure if index % columns == 0 else '')
        axes.title.set_fontsize(9)
        plot_style.tidy(axes)
    return plot_style.png(figure)
