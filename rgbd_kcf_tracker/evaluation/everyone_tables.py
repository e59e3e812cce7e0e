# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The tables of recordings in which everyone is followed."""

from __future__ import annotations

from collections.abc import Sequence

from rgbd_kcf_tracker.evaluation.everyone import EveryoneResult
from rgbd_kcf_tracker.evaluation.metrics.calibration import SURE
from rgbd_kcf_tracker.evaluation.metrics.everyone import Everyone, mean
from rgbd_kcf_tracker.evaluation.score_tables import Column, scaled
from rgbd_kcf_tracker.evaluation.table import Cell, Table

COLUMNS: tuple[Column, ...] = (
    Column('hota', 'HOTA %'),
    Column('idf1', 'IDF1 %'),
    Column('mota', 'MOTA %'),
    Column('strangers', 'strangers %'),
    Column('sure', f'of {SURE:g} and more: on the target %'),
    Column('returns', 'returns %'),
    Column('det_a', 'DetA %'),
    Column('ass_a', 'AssA %'),
    Column('recall', 'recall %'),
    Column('precision', 'precision %'),
)
COUNTS = (
    ('switches', 'id switches'),
    ('misses', 'misses'),
    ('false_boxes', 'false boxes'),
    ('people', 'people'),
)


def overview(results: Sequence[EveryoneResult]) -> Table:
    """Every tracker: mean of the shares over recordings, sum of the counts."""
    trackers = list(dict.fromkeys(r.tracker for r in results))
    rows = []
    for tracker in trackers:
        own = [r for r in results if r.tracker == tracker]
        rows.append(
            (
                tracker,
                len(own),
                *_shares(mean(r.scores for r in own)),
                *(sum(int(getattr(r.scores, name)) for r in own) for name, _ in COUNTS),
            )
        )
    return Table(
        'everyone',
        'Everyone: every tracker',
        ('tracker', 'recordings', *_headings()),
        tuple(rows),
        note='Shares are means over recordings, each counting once; counts are sums. IDF1, MOTA '
        'and counts at IoU 0.5; HOTA over IoU 0.05 to 0.95. People of whom little shows are '
        'neither hit nor miss. Strangers: of all boxes, those on something else than the person '
        f'that their id was first on; of boxes with a score of {SURE:g} and more, those on that '
        'person. Returns: of the times a person was back for five frames or '
        'more, those in which the id from before is on them again.',
    )


def by_recording(results: Sequence[EveryoneResult]) -> Table:
    """Every tracker on every recording."""
    rows = tuple(
        (
            r.sequence,
            r.scenario,
            r.tracker,
            r.frames,
            *_shares(r.scores),
            *(int(getattr(r.scores, name)) for name, _ in COUNTS),
        )
        for r in sorted(results, key=lambda r: r.sequence)
    )
    return Table(
        'everyone_recordings',
        'Everyone: every recording',
        ('recording', 'scenario', 'tracker', 'frames', *_headings()),
        rows,
    )


def _shares(scores: Everyone) -> list[Cell]:
    return [scaled(getattr(scores, c.name), c.scale) for c in COLUMNS]


def _headings() -> list[str]:
    return [*(c.heading for c in COLUMNS), *(heading for _, heading in COUNTS)]
