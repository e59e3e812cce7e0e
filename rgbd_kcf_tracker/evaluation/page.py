# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The page of a report: pictures as data in it, so that the one file can be sent about."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2

import rgbd_kcf_tracker
from rgbd_kcf_tracker.evaluation import plots, strips
from rgbd_kcf_tracker.evaluation.jobs import thumbnails_path, tracks_path, truth_path
from rgbd_kcf_tracker.evaluation.measured import Measured
from rgbd_kcf_tracker.evaluation.store import read_tracks, read_truth

STRIPS = 3
"""Sequences shown as best, and as worst."""

FIGURES = 100
"""Sequences of which the page shows the error over time: more, and no browser opens it."""

TEMPLATE = 'report.html.j2'


def render(content: Mapping[str, Any]) -> str:
    """The page as HTML."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader('rgbd_kcf_tracker.evaluation'),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(TEMPLATE).render(
        **content,
        version=rgbd_kcf_tracker.__version__,
    )


def strip_figures(
    folder: Path, measured: Measured, main: str, palette: Mapping[str, str]
) -> list[dict[str, str]]:
    """Pictures of the sequences that the main tracker does best and worst on, by success."""
    scored = [(m.success, s) for s in measured.sequences if (m := measured.of(main, s)) is not None]
    scored.sort()
    count = min(STRIPS, (len(scored) + 1) // 2)
    chosen = [('best', *pair) for pair in reversed(scored[len(scored) - count :])]
    chosen += [('worst', *pair) for pair in scored[: min(count, len(scored) - count)]]
    result = []
    for word, success, sequence in chosen:
        boxes = {
            t: read_tracks(tracks_path(folder, t, sequence)).boxes
            for t in measured.trackers
            if measured.result(t, sequence) is not None and not t.startswith(f'{main} without ')
        }
        own = measured.result(main, sequence)
        if own is None:
            continue
        info = measured.infos[sequence]
        data = strips.strip(
            thumbnails_path(folder, sequence, info.truth_key),
            info.thumbnail_scale,
            read_truth(truth_path(folder, sequence, info.truth_key)).visible,
            boxes,
            palette,
            main,
            interesting=(own.frames.ratio <= 0.5) | ~own.frames.there,
        )
        if data is not None:
            title = f'{word}: {sequence}, success {100 * success:.1f} %'
            result.append({'title': title, 'data': uri(data, 'jpeg')})
    return result


def sequence_figures(
    measured: Measured, main: str, palette: Mapping[str, str]
) -> list[dict[str, str]]:
    """Error over time of every sequence; of thousands, of those that the main tracker is worst on.

    In the order of the sequences.
    """
    scored = [(m.success, s) for s in measured.sequences if (m := measured.of(main, s)) is not None]
    drawn = set(measured.sequences)
    if len(drawn) > FIGURES:
        drawn = {s for _, s in sorted(scored)[:FIGURES]}
    result = []
    for sequence in [s for s in measured.sequences if s in drawn]:
        own = [r for t in measured.trackers if (r := measured.result(t, sequence)) is not None]
        result.append({'title': sequence, 'data': uri(plots.sequence_plot(own, palette))})
    return result


def uri(data: bytes, kind: str = 'png') -> str:
    """A picture as a data URI."""
    return f'data:image/{kind};base64,{base64.b64encode(data).decode()}'
