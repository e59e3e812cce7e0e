# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a track's covariances mean what they say: of 100 true places, 95 in the 95 % ellipsoid.

A place is in it where its squared Mahalanobis distance is below the 95 % quantile of the
chi-squared distribution with three degrees of freedom (Mahalanobis, 1936).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.track import Track

LIMIT = 7.814728
"""95 % of a chi-squared variable of three degrees of freedom lie below."""
NO_COVARIANCE = 1e12
"""Squared Mahalanobis distance of what was told with none: beyond any limit, and kept by JSON."""
Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Place:
    """What a track said of place and velocity, against the truth.

    Attributes:
        hidden: whether it said so of a target that it did not see.
        astray: whether the box, or the last before it was hidden, was on something else than the
            target: no covariance says that.
        error: metres from the true place.
        distance: squared Mahalanobis distance of the true place.
        speed_error: metres per second from the true velocity; NaN where none was said.
        speed_distance: its squared Mahalanobis distance; NaN likewise.
    """

    hidden: bool
    astray: bool
    error: float
    distance: float
    speed_error: float = math.nan
    speed_distance: float = math.nan


@dataclass(frozen=True, slots=True)
class Coverage:
    """Of some places, the share in the ellipsoids; NaN where there is none.

    Attributes:
        count: places.
        inside: share of the true places in the ellipsoid of 95 %.
        error: root mean square in metres.
        speed_inside: share of the true velocities in theirs.
        speed_error: root mean square in metres per second.
    """

    count: int
    inside: float
    error: float
    speed_inside: float
    speed_error: float


def place_of(
    track: Track, position: Triple | None, velocity: Triple | None, astray: bool = False
) -> Place | None:
    """A track against the truth; None where it said no place with a covariance, or none is true."""
    told = track.place
    if position is None or told is None or track.covariance is None:
        return None
    distance, error = _distance(told, position, track.covariance)
    place = Place(track.box is None, astray, error, distance)
    if velocity is None or track.velocity is None or track.velocity_covariance is None:
        return place
    speed_distance, speed_error = _distance(track.velocity, velocity, track.velocity_covariance)
    return Place(place.hidden, astray, error, distance, speed_error, speed_distance)


def coverage(places: Sequence[Place]) -> Coverage:
    """Shares and errors of places."""
    speeds = [p for p in places if not math.isnan(p.speed_distance)]
    return Coverage(
        len(places),
        _share([p.distance for p in places]),
        _root_mean_square([p.error for p in places]),
        _share([p.speed_distance for p in speeds]),
        _root_mean_square([p.speed_error for p in speeds]),
    )


def _distance(told: Triple, true: Triple, covariance: Sequence[float]) -> tuple[float, float]:
    """Squared Mahalanobis distance and length of an error; see :data:`NO_COVARIANCE`."""
    error = np.subtract(told, true)
    spread: FloatArray = np.array(covariance, np.float64).reshape(3, 3)
    length = float(np.linalg.norm(error))
    try:
        root = np.linalg.cholesky(spread)
    except np.linalg.LinAlgError:
        return NO_COVARIANCE, length
    return float(np.square(np.linalg.solve(root, error)).sum()), length


def _share(distances: Sequence[float]) -> float:
    return float(np.mean(np.array(distances) < LIMIT)) if distances else math.nan


def _root_mean_square(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else math.nan
