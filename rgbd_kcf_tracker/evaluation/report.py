# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A report folder: one self-contained page, and the same numbers as CSV and JSON."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rgbd_kcf_tracker
from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation import (
    everyone_tables,
    identity_tables,
    page,
    plot_style,
    plots,
    score_tables,
    sweep_tables,
    thesis_tables,
)
from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import EVERYONE
from rgbd_kcf_tracker.evaluation.everyone import EveryoneResult
from rgbd_kcf_tracker.evaluation.identity import Pairs
from rgbd_kcf_tracker.evaluation.jobs import Failure, why_nothing
from rgbd_kcf_tracker.evaluation.measured import Measured
from rgbd_kcf_tracker.evaluation.perframe import Collected, read_per_frame, write_per_frame
from rgbd_kcf_tracker.evaluation.place_tables import places_table
from rgbd_kcf_tracker.evaluation.store import read_json, slug, write_json
from rgbd_kcf_tracker.evaluation.table import Table
from rgbd_kcf_tracker.recordings.outputs import write_atomically

PAGE = 'index.html'
PER_FRAME = 'per_frame.csv'
NUMBERS = 'report.json'
BEGUN_NAMES = frozenset({'parts', 'results', 'thumbs', 'times', 'truth'})
"""What a report folder may hold before its runs are recorded in it."""


@dataclass(frozen=True, slots=True)
class Heading:
    """What stands at the top of a report.

    Attributes:
        datasets: as the user gave them.
        options: in words.
        ablated: names of variants whose ingredients were switched off in turn.
        eao_lengths: sequence lengths over which EAO is averaged, None for the typical ones.
    """

    datasets: tuple[str, ...]
    options: str = 'as they are'
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
        raise DatasetError(why_nothing(failures))
    if not any(len(result.counted.said) for result in measured.results):
        raise DatasetError(
            'nothing was measured: there is no frame to judge after the first, in which the '
            'target is given'
        )

    curves = plots.mean_curves(measured)
    long_term, long_curves = score_tables.long_term(measured)
    reliability, reliabilities = score_tables.reliability(measured)
    protocols = [t for t in (score_tables.otb_protocol(measured),) if t is not None]
    if collected.short_term:
        protocols.append(thesis_tables.short_term(collected.short_term, heading.eao_lengths))
    content: dict[str, Any] = {
        'overview': score_tables.overview(measured),
        'ablations': [score_tables.ablation(measured, name) for name in heading.ablated],
        'scenario_tables': score_tables.by_scenario(measured),
        'thesis_tables': thesis_tables.all_tables(measured),
        'protocols': protocols,
        'sequence_table': score_tables.by_sequence(measured),
        'long_term': long_term,
        'reliability': reliability,
        'places': places_table(collected.places),
    }
    every = _all_tables(content)
    _write_tables(folder, every)
    numbers = _numbers(every, contenders, failures, heading) | {
        'sequences': {
            name: {'scenario': i.scenario, 'kind': i.kind, 'categories': dict(i.categories)}
            for name, i in measured.infos.items()
        },
        'curves': curves,
    }
    write_json(folder / NUMBERS, numbers, indent=1)

    palette = plot_style.colors(measured.trackers)
    main = main_tracker(measured.trackers, contenders, heading.ablated)
    content |= {
        'curves': page.uri(plots.curve_plots(measured, curves)),
        'scenario_plot': page.uri(plots.scenario_plot(measured, main)),
        'long_term_plot': page.uri(plots.long_term_plot(long_curves)),
        'strips': page.strip_figures(folder, measured, main, palette),
        'sequence_plots': page.sequence_figures(measured, main, palette),
        'unmeasured': collected.unmeasured,
        'main': main,
    }
    if reliabilities:
        content['reliability_plot'] = page.uri(plots.reliability_plot(reliabilities))
        content['honesty_plot'] = page.uri(plots.honesty_plot(reliabilities))
    if collected.short_term:
        content['eao_plot'] = page.uri(
            plots.expected_overlap_plot(collected.short_term, heading.eao_lengths)
        )
    frames = {r.sequence: len(r.stamps_ns) for r in measured.results}
    content |= _head(heading, failures, palette, frames)
    write_atomically(folder / PAGE, page.render(content))
    return measured


def write_everyone_report(
    folder: Path,
    results: Sequence[EveryoneResult],
    contenders: Sequence[Contender],
    failures: Sequence[Failure],
    heading: Heading,
) -> Table:
    """Write the report of recordings in which everyone was followed.

    Returns:
        The overview, for printing.

    Raises:
        DatasetError: where nothing could be measured.
    """
    _write_failures(folder / 'failures.txt', failures)
    if not results:
        raise DatasetError(why_nothing(failures))
    every = [everyone_tables.overview(results), everyone_tables.by_recording(results)]
    _write_tables(folder, every)
    numbers = _numbers(every, contenders, failures, heading) | {
        'sequences': {r.sequence: {'scenario': r.scenario, 'kind': EVERYONE} for r in results},
    }
    write_json(folder / NUMBERS, numbers, indent=1)
    palette = plot_style.colors(list(dict.fromkeys(r.tracker for r in results)))
    content = {'everyone': every} | _head(
        heading, failures, palette, {r.sequence: r.frames for r in results}
    )
    write_atomically(folder / PAGE, page.render(content))
    return every[0]


def write_identity_report(
    folder: Path, pairs: Sequence[Pairs], failures: Sequence[Failure], heading: Heading
) -> Table:
    """Write the report of how well people are told apart.

    Returns:
        The overview, for printing.

    Raises:
        DatasetError: where nothing could be measured.
    """
    _write_failures(folder / 'failures.txt', failures)
    if not any(len(p.probability) for p in pairs):
        raise DatasetError(
            why_nothing(failures) if failures else 'no two sightings could be compared'
        )
    calibration, reliabilities = identity_tables.calibration(pairs)
    every = [identity_tables.overview(pairs), calibration]
    _write_tables(folder, every)
    write_atomically(folder / 'pairs.csv', identity_tables.pairs_csv(pairs))
    frames = {s.recording: s.frames for p in pairs for s in p.seen}
    write_json(folder / NUMBERS, _numbers(every, (), failures, heading), indent=1)
    content = {
        'identity': every,
        'identity_plot': page.uri(plots.pairs_plot(reliabilities)),
    } | _head(heading, failures, {}, frames)
    write_atomically(folder / PAGE, page.render(content))
    return every[0]


def write_sweep_report(
    folder: Path,
    found: sweep_tables.Found,
    failures: Sequence[Failure],
    heading: Heading,
    frames: Mapping[str, int],
) -> list[Table]:
    """Write the report of a sweep.

    Args:
        folder: of the report.
        found: what came out.
        failures: runs that failed.
        heading: what stands at the top.
        frames: of each sequence, those held out included.

    Returns:
        Its tables, for printing.
    """
    _write_failures(folder / 'failures.txt', failures)
    every = sweep_tables.all_tables(found)
    _write_tables(folder, every)
    write_atomically(folder / 'settings.csv', sweep_tables.settings_csv(found))
    contenders = [found.default.contender, *(found.settings[i].contender for i in found.finalists)]
    write_json(folder / NUMBERS, _numbers(every, contenders, failures, heading), indent=1)
    effects = [(axis.info.name, *sweep_tables.effect(found, axis)) for axis in found.axes]
    shown = f'{found.measure} %' if found.scale == 100 else f'{found.measure} px'
    content = {
        'sweep': every,
        'sweep_plot': page.uri(plots.effect_plots(effects, shown, found.scale)),
    } | _head(heading, failures, {}, frames)
    write_atomically(folder / PAGE, page.render(content))
    return every


def main_tracker(
    measured: Sequence[str], contenders: Sequence[Contender], ablated: Sequence[str] = ()
) -> str:
    """The tracker whose best and worst sequences are shown.

    The one ablated, else ``metric``, else the last of our variants, else the last of all.
    """
    ours = [c.name for c in contenders if c.kind == 'variant']
    wanted = (*ablated, 'metric', *reversed(ours))
    return next((name for name in wanted if name in measured), measured[-1])


def _head(
    heading: Heading,
    failures: Sequence[Failure],
    palette: Mapping[str, str],
    frames: Mapping[str, int],
) -> dict[str, Any]:
    """What stands at the top and at the end of every page; frames by sequence."""
    return {
        'failures': failures,
        'palette': palette,
        'trackers': list(palette),
        'sequences': len(frames),
        'frames': sum(frames.values()),
        'title': f'Trackers on {_short(heading.datasets)}',
        'dataset': ', '.join(heading.datasets),
        'options': heading.options,
    }


def _write_tables(folder: Path, every: Sequence[Table]) -> None:
    keys = {table.key for table in every}
    for key in _keys_before(folder) - keys:
        with contextlib.suppress(OSError):
            (folder / 'tables' / _file_of(key)).unlink()
    for table in every:
        write_atomically(folder / 'tables' / _file_of(table.key), table.csv())
    write_atomically(
        folder / 'tables.md', '\n'.join(f'### {t.title}\n\n{t.markdown()}\n' for t in every)
    )


def _file_of(key: str) -> str:
    return f'{slug(key)}.csv'


def _keys_before(folder: Path) -> set[str]:
    """The tables of the report that lies in a folder: others there are not ours."""
    try:
        return set(read_json(folder / NUMBERS)['tables'])
    except (DatasetError, KeyError, TypeError):
        return set()


def _short(datasets: Sequence[str]) -> str:
    """Data sets by name, however long the command was."""
    names = ['simulated scenes' if d.startswith('sim:') else Path(d).name for d in datasets]
    names = list(dict.fromkeys(names))
    return ', '.join(names[:3]) + (f' and {len(names) - 3} more' if len(names) > 3 else '')


def _all_tables(content: Mapping[str, Any]) -> list[Table]:
    found: list[Table] = []
    for value in content.values():
        if value is not None:
            found += value if isinstance(value, list) else [value]
    return found


def _numbers(
    every: Sequence[Table],
    contenders: Sequence[Contender],
    failures: Sequence[Failure],
    heading: Heading,
) -> dict[str, Any]:
    return {
        'version': rgbd_kcf_tracker.__version__,
        'datasets': heading.datasets,
        'options': heading.options,
        'trackers': {
            c.name: {'kind': c.kind, 'target': c.source, **dict(c.overrides)} for c in contenders
        },
        'tables': {
            t.key: {'title': t.title, 'columns': t.columns, 'rows': t.rows, 'note': t.note}
            for t in every
        },
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
