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
import dataclasses
import sys
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Mask
from rgbd_kcf_tracker.errors import DatasetError, RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, open_dataset
from rgbd_kcf_tracker.evaluation.datasets.base import with_intrinsics
from rgbd_kcf_tracker.evaluation.evidence_fit import camera
from rgbd_kcf_tracker.evaluation.identity import Pairs, Sighting, all_pairs, look, metric_views
from rgbd_kcf_tracker.metric.identity.gallery import BESIDE_NETWORK, Gallery, View
from rgbd_kcf_tracker.metric.parameters import MetricParameters


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """``n`` pairs of sightings.

    Attributes:
        cosine: ``(n,)`` of their vectors.
        colors: ``(n,)`` log-odds of being one person by their colours alone.
        same: ``(n,)`` whether they are.
        weight: ``(n,)``, such that those of one and of two, and each recording, count alike.
    """

    cosine: FloatArray
    colors: FloatArray
    same: Mask
    weight: FloatArray

    @classmethod
    def of(cls, several: list[Pairs]) -> Compared:
        """What is known of pairs.

        Raises:
            DatasetError: where none has pairs of one person, and others.
        """
        parts = [pairs for pairs in several if 0 < np.count_nonzero(pairs.same) < len(pairs.same)]
        if not parts:
            raise DatasetError('nobody is seen twice, three seconds apart, and another beside him')
        cosine, colors, weight = [], [], []
        for pairs in parts:
            for left, right in zip(pairs.left, pairs.right, strict=True):
                first, second = _view(left), _view(right)
                cosine.append(float(_vector(first) @ _vector(second)))
                undescribed = dataclasses.replace(second, described=None)
                colors.append(Gallery.of(first, 0.0).log_odds(undescribed))
            weight.append(np.where(pairs.same, 1 / pairs.same.sum(), 1 / (~pairs.same).sum()))
        same = np.concatenate([pairs.same for pairs in parts])
        return cls(np.array(cosine), np.array(colors), same, np.concatenate(weight))

    def bits(self, odds: FloatArray) -> float:
        """What log-odds cost in bits."""
        wrong = np.logaddexp(0, np.where(self.same, -odds, odds))
        return float(np.average(wrong, weights=self.weight) / np.log(2))


def _view(sighting: Sighting) -> View:
    assert isinstance(sighting.what, View)
    return sighting.what


def _vector(view: View) -> Floats:
    assert view.described is not None
    return view.described.vector


def fit(pairs: Compared) -> tuple[float, float, float]:
    """Where cosines are even, their steepness, and what the pairs cost with them."""

    def loss(line: FloatArray) -> float:
        return pairs.bits(BESIDE_NETWORK * pairs.colors + line[0] * pairs.cosine + line[1])

    found = minimize(loss, np.zeros(2), method='BFGS')
    steepness, start = found.x.tolist()
    return -start / steepness, steepness, float(found.fun)


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
                samples = sequence.open().samples
                if args.intrinsics is not None:
                    samples = with_intrinsics(samples, args.intrinsics)
                seen.append(look(sequence.name, samples, metric_views(parameters)))
        pairs = Compared.of(all_pairs(seen, metric_views()))
    except RgbdKcfError as error:
        print(f'embedding_fit: error: {error}', file=sys.stderr)
        return 2
    even, steepness, bits = fit(pairs)
    print(f'embedding_even: {even:.2f}, embedding_steepness: {steepness:.1f}')
    print(
        f'{len(pairs.same)} pairs, {np.count_nonzero(pairs.same)} of them of one person: '
        f'{pairs.bits(pairs.colors):.2f} bits by colours alone, {bits:.2f} with the network'
    )
    return 0


if __name__ == '__main__':
    sys.exit(main())
