# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Fits what the cosine of a network's vectors says of people, beside their colours.

``python -m rgbd_kcf_tracker.evaluation.embedding_fit DATASET... --embedding FILE.onnx`` compares
the pairs of sightings that ``rgbd-kcf evaluate --identity`` compares, and prints the parameters
``embedding_even`` and ``embedding_steepness`` of ``metric`` for that network, with what the pairs
cost in bits (1 is that of knowing nothing) by colours alone and with the network.
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Mask
from rgbd_kcf_tracker.errors import DatasetError, RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, Sequence, open_dataset
from rgbd_kcf_tracker.evaluation.evidence_fit import camera
from rgbd_kcf_tracker.evaluation.identity import (
    Pairs,
    Seen,
    Sighting,
    Views,
    all_pairs,
    look,
    metric_views,
)
from rgbd_kcf_tracker.evaluation.jobs import RunOptions, as_asked
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.identity.gallery import (
    BESIDE_NETWORK,
    Looks,
    View,
    look_log_odds,
    similarity,
)
from rgbd_kcf_tracker.metric.parameters import MetricParameters

FEWEST = 30
"""Pairs of one person from which a line through the cosines is no chance."""
LEAST = 0.1
"""Steepness below which a network says nothing: from one end of cosines to the other 0.2."""


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """``n`` pairs of sightings.

    Attributes:
        cosine: ``(n,)`` of their vectors.
        alike: ``(n,)`` likeness of their colours, NaN where no part shows in both.
        area: ``(n,)`` square metres that show of both.
        same: ``(n,)`` whether they are of one person.
        weight: ``(n,)``, such that those of one and of two, and each recording, count alike.
    """

    cosine: FloatArray
    alike: FloatArray
    area: FloatArray
    same: Mask
    weight: FloatArray

    @classmethod
    def of(cls, several: list[Pairs]) -> Told:
        """What is known of pairs.

        Raises:
            DatasetError: where there are too few of one person, or none of two.
        """
        parts = [pairs for pairs in several if 0 < np.count_nonzero(pairs.same) < len(pairs.same)]
        count = sum(np.count_nonzero(pairs.same) for pairs in parts)
        if count < FEWEST:
            raise DatasetError(
                f'{count} pairs of sightings are of one person, three seconds apart, and with '
                f'others beside them: {FEWEST} are needed'
            )
        views = [(_view(a), _view(b)) for p in parts for a, b in zip(p.left, p.right, strict=True)]
        weight = [np.where(p.same, 1 / p.same.sum(), 1 / (~p.same).sum()) for p in parts]
        return cls(
            np.array([_vector(a) @ _vector(b) for a, b in views], np.float64),
            np.array([similarity(a, Looks.of([b]))[0] for a, b in views], np.float64),
            np.array([min(a.total, b.total) for a, b in views]),
            np.concatenate([p.same for p in parts]),
            np.concatenate(weight),
        )

    def odds(self, even: float = math.nan, steepness: float = 0.0) -> FloatArray:
        """Log-odds of being one person, ``(n,)``; by colours alone where ``even`` is NaN."""
        network = steepness * (self.cosine - even)
        return np.array(
            [
                0.0 if np.isnan(alike) else look_log_odds(alike, area, network=said)
                for alike, area, said in zip(self.alike, self.area, network, strict=True)
            ]
        )

    def bits(self, odds: FloatArray) -> float:
        """What log-odds ``(n,)`` cost in bits."""
        wrong = np.logaddexp(0, np.where(self.same, -odds, odds))
        return float(np.average(wrong, weights=self.weight) / np.log(2))


def _view(sighting: Sighting) -> View:
    assert isinstance(sighting.what, View)
    return sighting.what


def _vector(view: View) -> Floats:
    assert view.described is not None
    return view.described.vector


def fit(told: Told) -> tuple[float, float]:
    """Where cosines are even, and their steepness, by a line beside the colours' log-odds.

    How far the tracker believes it, for somebody above all, is no part of the fit.

    Raises:
        DatasetError: where the network says the opposite, or nothing.
    """
    colors = BESIDE_NETWORK * told.odds()

    def loss(line: FloatArray) -> float:
        return told.bits(colors + line[0] * told.cosine + line[1])

    steepness, start = minimize(loss, np.zeros(2), method='BFGS').x.tolist()
    if steepness < LEAST or not -1 < -start / steepness < 1:
        raise DatasetError('the network tells nothing of these people beside their colours')
    return -start / steepness, steepness


def _seen(sequence: Sequence, parameters: MetricParameters, camera: Intrinsics | None) -> Seen:
    """The people of a recording, described."""
    samples = as_asked(sequence.open().samples, sequence, RunOptions(intrinsics=camera))
    return look(sequence.name, samples, metric_views(parameters))


def main() -> int:
    """Print what was fitted to the data sets of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0] if __doc__ else None)
    parser.add_argument('dataset', nargs='+', help='as for rgbd-kcf evaluate --identity')
    parser.add_argument('--embedding', required=True, metavar='FILE', help='see metric.embedding')
    parser.add_argument('--fps', type=float, default=5.0, help='of image folders without stamps')
    parser.add_argument(
        '--intrinsics', type=camera, metavar='FX,FY,CX,CY',
        help='of recordings that do not have them',
    )  # fmt: skip
    args = parser.parse_args()
    try:
        parameters = MetricParameters(embedding=args.embedding)
        seen = []
        for name in args.dataset:
            for sequence in open_dataset(name, DatasetOptions(fps=args.fps, everyone=True)):
                seen.append(_seen(sequence, parameters, args.intrinsics))
        alone = Views(lambda frame, box: None, lambda first, second: 0.5)
        told = Told.of(all_pairs(seen, alone))
        even, steepness = fit(told)
    except RgbdKcfError as error:
        print(f'embedding_fit: error: {error}', file=sys.stderr)
        return 2
    print(f'embedding_even: {even:.2f}, embedding_steepness: {steepness:.1f}')
    print(
        f'{len(told.same)} pairs, {np.count_nonzero(told.same)} of them of one person: '
        f'{told.bits(told.odds()):.2f} bits by colours alone, '
        f'{told.bits(told.odds(even, steepness)):.2f} with the network'
    )
    return 0


if __name__ == '__main__':
    sys.exit(main())
