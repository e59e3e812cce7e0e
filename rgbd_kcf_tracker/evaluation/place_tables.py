# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The table of places in metres: errors, and whether the covariances mean what they say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rgbd_kcf_tracker.evaluation.metrics.ellipsoids import Place, coverage
from rgbd_kcf_tracker.evaluation.score_tables import scaled
from rgbd_kcf_tracker.evaluation.table import Cell, Table

_ASTRAY = 'Astray: the box, or the last before it was hidden, was on something else. '


def places_table(places: Mapping[tuple[str, str], Sequence[Place]]) -> Table | None:
    """A row for each tracker while the target is seen, hidden, and for both; None without places.

    Args:
        places: by tracker and sequence.
    """
    rows: list[tuple[Cell, ...]] = []
    for tracker in dict.fromkeys(tracker for tracker, _ in places):
        own = [place for (name, _), some in places.items() if name == tracker for place in some]
        for label, kept in (
            ('seen', [p for p in own if not p.hidden and not p.astray]),
            ('hidden', [p for p in own if p.hidden and not p.astray]),
            ('astray', [p for p in own if p.astray]),
            ('all', own),
        ):
            c = coverage(kept)
            if c.count:
                rows.append(
                    (
                        f'{tracker}, {label}', c.count, scaled(c.inside, 100),
                        scaled(c.error, 100), scaled(c.speed_inside, 100),
                        scaled(c.speed_error, 100),
                    )
                )  # fmt: skip
    if not rows:
        return None
    astray = any(place.astray for some in places.values() for place in some)
    return Table(
        'places',
        'Places in metres: true ones in the ellipsoid of 95 %',
        (
            'tracker', 'frames', 'places inside %', 'error cm', 'velocities inside %',
            'error cm/s',
        ),
        tuple(rows),
        note='Of the middle of the body, all frames of all sequences with a place and a covariance '
        f'alike. Calibrated covariances hold 95 %. {_ASTRAY if astray else ""}Errors are root mean '
        'squares.',
    )  # fmt: skip
