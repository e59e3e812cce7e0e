# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A report folder: one self-contained page, and the same numbers as CSV and JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rgbd_kcf_tracker
from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation import page, plot_style, plots, tables, thesis_tables
from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.jobs import Failure
from rgbd_kcf_tracker.evaluation.measured import Measured
from rgbd_kcf_tracker.evaluation.perframe import Collected, read_per_frame, write_per_frame
from rgbd_kcf_tracker.evaluation.store import slug, write_atomically, write_json
from rgbd_kcf_tracker.evaluation.table import Table

PAGE = 'index.html'
PER_FRAME = 'per_frame.csv'


@dataclass(frozen=True, slots=True)
class Heading:
    """What stands at the top of a report.

    Attributes:
        datasets: as the user gave them.
        options: in words.
        command: that was typed, or ''.
        ablated: names of variants whose ingredients were switched off in turn.
        eao_lengths: sequence lengths over which EAO is averaged, None for the typical ones.
    """

    datasets: tuple[str, ...]
    options: str = 'as they are'
    command: str = ''
    ablated: tuple[str, ...] = ()
    eao_lengths: tuple[int, int] | None = None


def write_report(
    folder: Path,
    collected: Collected,
    contenders: Sequence[Contender],
    failures: Sequence[Failure],
    heading: Heading,
) -> Measured:
    """Write ``per_frame.csv``, then everything else from that file.

    Returns:
        What was measured, for printing.

    Raises:
        DatasetError: where nothing could be measured.
    """
    write_per_frame(folder / PER_FRAME, collected.results)
    measured = Measured(read_per_frame(folder / PER_FRAME), collected.infos)
    _write_failures(folder / 'failures.txt', failures)
    if not measured.results:
        raise DatasetError(_why_nothing(failures))

    curves = plots.mean_curves(measured)
    long_term, long_curves = tables.long_term(measured)
    reliability, reliabilities = tables.reliability(measured)
    protocols = [t for t in (tables.otb_protocol(measured),) if t is not None]
    if collected.short_term:
        protocols.append(thesis_tables.short_term(collected.short_term, heading.eao_lengths))
    content: dict[str, Any] = {
        'overview': tables.overview(measured),
        'ablations': [tables.ablation(measured, name) for name in heading.ablated],
        'scenario_tables': tables.by_scenario(measured),
        'thesis_tables': thesis_tables.all_tables(measured),
        'protocols': protocols,
        'sequence_table': tables.by_sequence(measured),
        'long_term': long_term,
        'reliability': reliability,
    }
    every = _all_tables(content)
    for table in every:
        write_atomically(folder / 'tables' / f'{slug(table.key)}.csv', table.csv())
    write_atomically(
        folder / 'tables.md', '\n'.join(f'### {t.title}\n\n{t.markdown()}\n' for t in every)
    )
    numbers = _numbers(measured, every, curves, contenders, failures, heading)
    write_json(folder / 'report.json', numbers, indent=1)

    palette = plot_style.colors(measured.trackers)
    main = main_tracker(measured.trackers, contenders, heading.ablated)
    content |= {
        'curves': page.uri(plots.curve_plots(measured, curves)),
        'scenario_plot': page.uri(plots.scenario_plot(measured, main)),
        'long_term_plot': page.uri(plots.long_term_plot(long_curves)),
        'strips': page.strip_figures(folder, measured, main, palette),
        'sequence_plots': page.sequence_figures(measured, palette),
        'failures': failures,
        'unmeasured': collected.unmeasured,
        'main': main,
        'palette': palette,
        'title': f'Trackers on {_short(heading.datasets)}',
        'dataset': ', '.join(heading.datasets),
        'options': heading.options,
        'command': heading.command,
    }
    if reliabilities:
        content['reliability_plot'] = page.uri(plots.reliability_plot(reliabilities))
    if collected.short_term:
        content['eao_plot'] = page.uri(
            plots.expected_overlap_plot(collected.short_term, heading.eao_lengths)
        )
    write_atomically(folder / PAGE, page.render(measured, content))
    return measured


def main_tracker(
    measured: Sequence[str], contenders: Sequence[Contender], ablated: Sequence[str] = ()
) -> str:
    """The tracker whose best and worst sequences are shown.

    The one ablated, else ``metric``, else the last of our variants, else the last of all.
    """
    ours = [c.name for c in contenders if c.kind == 'variant']
    wanted = (*ablated, 'metric', *reversed(ours))
    return next((name for name in wanted if name in measured), measured[-1])


def _short(datasets: Sequence[str]) -> str:
    """Data sets by name, however long the command was."""
    names = ['simulated scenes' if d.startswith('sim:') else Path(d).name for d in datasets]
    names = list(dict.fromkeys(names))
    return ', '.join(names[:3]) + (f' and {len(names) - 3} more' if len(names) > 3 else '')


def _all_tables(content: Mapping[str, Any]) -> list[Table]:
    found: list[Table] = []
    for value in content.values():
        found += value if isinstance(value, list) else [value]
    return found


def _numbers(
    measured: Measured,
    every: Sequence[Table],
    curves: Mapping[str, Mapping[str, Any]],
    contenders: Sequence[Contender],
    failures: Sequence[Failure],
    heading: Heading,
) -> dict[str, Any]:
    return {
        'version': rgbd_kcf_tracker.__version__,
        'datasets': heading.datasets,
        'options': heading.options,
        'trackers': {
            c.name: {'kind': c.kind, 'target': c.target, **dict(c.overrides)} for c in contenders
        },
        'sequences': {
            name: {'scenario': i.scenario, 'kind': i.kind, 'categories': dict(i.categories)}
            for name, i in measured.infos.items()
        },
        'tables': {
            t.key: {'title': t.title, 'columns': t.columns, 'rows': t.rows, 'note': t.note}
            for t in every
        },
        'curves': curves,
        'failures': [
            {'sequence': f.sequence, 'tracker': f.tracker, 'reason': f.reason} for f in failures
        ],
    }


def _write_failures(path: Path, failures: Sequence[Failure]) -> None:
    if not failures:
        path.unlink(missing_ok=True)
        return
    lines = [f'{f.sequence} {f.tracker}'.strip() + f': {f.reason}' for f in failures]
    write_atomically(path, '\n\n'.join(lines) + '\n')


def _why_nothing(failures: Sequence[Failure]) -> str:
    if failures:
        return f'nothing was measured: {failures[0].sequence}: {failures[0].reason}'
    return 'nothing was measured: none of the sequences has ground truth'
