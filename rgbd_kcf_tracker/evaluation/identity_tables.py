# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The tables of the measure of identity, and the file with every pair."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from rgbd_kcf_tracker.evaluation.identity import APART_S, MOST_VIEWS, Pairs
from rgbd_kcf_tracker.evaluation.metrics.calibration import Reliability
from rgbd_kcf_tracker.evaluation.metrics.separation import balanced_reliability
from rgbd_kcf_tracker.evaluation.score_tables import scaled
from rgbd_kcf_tracker.evaluation.table import Cell, Table

PAIRS_HEADER = (
    'recording', 'frame', 'id', 'other_recording', 'other_frame', 'other_id', 'same', 'probability',
)  # fmt: skip


def overview(pairs: Sequence[Pairs]) -> Table:
    """A row for each recording and each pair of cameras, and the mean of each kind."""
    rows = [_row(p) for p in pairs]
    for label, across in (('mean in one camera', False), ('mean between cameras', True)):
        own = [p.separation() for p in pairs if p.across == across]
        if len(own) > 1:
            means = (_mean([getattr(s, n) for s in own]) for n in ('area', 'recognised', 'taken'))
            rows.append(
                (
                    label, None, None, None, sum(s.same for s in own),
                    sum(s.different for s in own), *means,
                )
            )  # fmt: skip
    return Table(
        'identity',
        'The same person or another: pairs of sightings',
        (
            'recording', 'people', 'sightings', 'described %', 'same pairs', 'different pairs',
            'area under ROC %', 'recognised %', 'taken for another %',
        ),
        tuple(rows),
        note=f'Sightings at least {APART_S:g} s apart, of people of whom enough shows, at most '
        f'{MOST_VIEWS} of each in a recording. Recognised: same pairs with a probability of a half '
        'or more; taken for another: different pairs with as much.',
    )  # fmt: skip


def calibration(pairs: Sequence[Pairs]) -> tuple[Table, dict[str, Reliability]]:
    """Whether the probability means what it says, of all pairs in one camera and between two."""
    rows: list[tuple[Cell, ...]] = []
    found: dict[str, Reliability] = {}
    for label, across in (('in one camera', False), ('between cameras', True)):
        own = [p for p in pairs if p.across == across and len(p.probability)]
        if not own:
            continue
        same = np.concatenate([p.same for p in own])
        table = balanced_reliability(np.concatenate([p.probability for p in own]), same)
        found[label] = table
        rates = (scaled(v, 100) for v in table.hit_rate)
        rows.append((label, len(same), scaled(table.expected_error, 100), table.brier, *rates))
    edges = np.linspace(0.0, 1.0, 11)
    return Table(
        'identity_calibration',
        'Percent of pairs that are one person, by the probability given',
        (
            'pairs', 'number', 'calibration error %', 'Brier',
            *(f'{a:.1f}-{b:.1f}' for a, b in pairwise(edges)),
        ),
        tuple(rows),
        digits=2,
        note='Pairs of one person and pairs of two weigh the same in all, as if every second pair '
        'were of one.',
    ), found  # fmt: skip


def pairs_csv(pairs: Sequence[Pairs]) -> str:
    """Every pair, frames from 0."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(PAIRS_HEADER)
    for p in pairs:
        names = p.seen[0].recording, p.seen[-1].recording
        for a, b, probability in zip(p.left, p.right, p.probability, strict=True):
            same = int(a.person == b.person)
            writer.writerow(
                (names[0], a.frame, a.person, names[1], b.frame, b.person, same,
                 f'{probability:.6g}')
            )  # fmt: skip
    return text.getvalue()


def _row(pairs: Pairs) -> tuple[Cell, ...]:
    s = pairs.separation()
    wanted = sum(seen.sightings for seen in pairs.seen)
    described = sum(len(seen.views) for seen in pairs.seen)
    people = {v.person for seen in pairs.seen for v in seen.views}
    return (
        pairs.name,
        len(people),
        wanted,
        100 * described / wanted if wanted else None,
        s.same,
        s.different,
        scaled(s.area, 100),
        scaled(s.recognised, 100),
        scaled(s.taken, 100),
    )


def _mean(values: Sequence[float]) -> float | None:
    """In percent."""
    known = [v for v in values if not np.isnan(v)]
    return 100 * float(np.mean(known)) if known else None
