# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Fits the weights by which ``metric`` decides, to candidates that it meets on benchmarks.

``python -m rgbd_kcf_tracker.evaluation.evidence_fit DATASET... [--rates 30,15,10,5]`` runs the
tracker, labels each candidate by its overlap with the truth, and prints the weights, how often they
decide rightly on scenarios that were left out of the fit, and how well their probabilities are
calibrated. What is printed goes into ``metric/decide/evidence.py``.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import itertools
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.errors import DatasetError, ParameterError, RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, Sequence, open_dataset
from rgbd_kcf_tracker.evaluation.datasets.base import Sample, at_rate, with_intrinsics
from rgbd_kcf_tracker.evaluation.passes import OnePass, run
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.decide.cues import Cue
from rgbd_kcf_tracker.metric.decide.evidence import WEIGHTS, Evidence
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.targets import MetricTracker

RIGHT, WRONG = 0.5, 0.3
"""Overlaps from which a candidate is the target, and below which it is not; between, left out."""
ASTRAY, BACK = 2, 8
"""Frames on something else after which a run teaches nothing, and on the target until it does."""
REAL_WEIGHT, SPARSE_WEIGHT = 4.0, 2.0
"""Weight of candidates from recordings, and of those at less than 20 Hz, against 30 Hz scenes."""
SPARSE_HZ = 20.0
OTHER_WEIGHT, OTHER_LOOK = 0.01, -4.2
"""Weight of the target's places with a thing of wholly other look there, and the log-odds of that
look: the least that a gallery says, a strange height included."""
RIDGE = 2e-5
FOLDS = 4
EDGES = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Examples:
    """Candidates: evidence, label 1 or 0, weight and scenario, ``(n,)`` each."""

    evidence: npt.NDArray[np.object_]
    labels: npt.NDArray[np.int64]
    weights: FloatArray
    groups: npt.NDArray[np.str_]

    @property
    def features(self) -> FloatArray:
        """The regression's inputs, further cues before the last, ``(n, k)``."""
        rows = []
        for evidence in self.evidence:
            *known, one = evidence.features()
            rows.append([*known, *(said.value for said in evidence.more), one])
        return np.array(rows, np.float64).reshape(len(rows), -1)

    def where(self, chosen: npt.NDArray[np.bool_]) -> Examples:
        """Those of them that are ``chosen``, ``(n,)`` bool."""
        return Examples(
            self.evidence[chosen], self.labels[chosen], self.weights[chosen], self.groups[chosen]
        )


class _Meetings:
    """Labels the candidates that a tracker has weighed, as long as it is not astray."""

    def __init__(self, tracker: MetricTracker, one: OnePass) -> None:
        self.evidence: list[Evidence] = []
        self.labels: list[int] = []
        self._tracker, self._one = tracker, one
        self._astray = self._back = 0

    def feed(self, sample: Sample) -> None:
        if len(self._one.tracks) < 2 or self._one.error:  # started, and nothing weighed yet
            return
        box = self._one.tracks[-1].box
        truths = [] if sample.visible is None else [sample.visible]
        if truths and sample.body is not None:
            truths.append(sample.body)
        if self._astray < ASTRAY:
            for candidate, place in self._tracker.weighed():
                overlap = max((place.iou(t) for t in truths), default=0.0)
                if not WRONG <= overlap <= RIGHT:
                    self.evidence.append(candidate.evidence)
                    self.labels.append(int(overlap > RIGHT))
        if box is None:
            return
        overlap = max((box.iou(t) for t in truths), default=0.0)
        if overlap < WRONG:
            self._astray, self._back = self._astray + 1, 0
        elif overlap > RIGHT:
            self._back += 1
            if self._astray < ASTRAY or self._back >= BACK:
                self._astray = 0


def meet(
    sequence: Sequence, rate: float | None, camera: Intrinsics | None, cues: tuple[Cue, ...] = ()
) -> Examples:
    """Run the tracker over a sequence and label every candidate that it weighs."""
    samples = sequence.open().samples
    if rate is not None:
        samples = at_rate(samples, rate)
    if camera is not None:
        samples = with_intrinsics(samples, camera)
    tracker = MetricTracker(MetricParameters(), cues)
    one = OnePass(tracker)
    met = _Meetings(tracker, one)
    run(itertools.dropwhile(lambda sample: sample.visible is None, samples), one, met)
    one.check()
    weight = REAL_WEIGHT if sequence.kind != 'sim' else 1.0
    if weight == 1.0 and rate is not None and rate < SPARSE_HZ:
        weight = SPARSE_WEIGHT
    count = len(met.labels)
    return Examples(
        np.array(met.evidence, np.object_),
        np.array(met.labels, np.int64),
        np.full(count, weight),
        np.full(count, sequence.scenario),
    )


def joined(parts: list[Examples]) -> Examples:
    """All examples in one.

    Raises:
        DatasetError: where there are no targets or nothing else among them.
    """
    whole = Examples(
        np.concatenate([p.evidence for p in parts]),
        np.concatenate([p.labels for p in parts]),
        np.concatenate([p.weights for p in parts]),
        np.concatenate([p.groups for p in parts]),
    )
    if len(np.unique(whole.labels)) < 2:
        raise DatasetError('the runs met no targets, or nothing else: give more sequences')
    return whole


def with_other_looks(examples: Examples) -> Examples:
    """The examples and, for each target, a thing of wholly other look at its place.

    It is hardly ever met, since mostly depth tells the two apart; but it must not pass.
    """
    alike = np.array([evidence.look > 0 for evidence in examples.evidence], np.bool_)
    good = examples.where((examples.labels == 1) & alike)
    other = np.array([_of_other_look(evidence) for evidence in good.evidence], np.object_)
    count = len(other)
    return joined(
        [
            examples,
            Examples(other, np.zeros(count, np.int64), np.full(count, OTHER_WEIGHT), good.groups),
        ]
    )


def _of_other_look(evidence: Evidence) -> Evidence:
    """The same place with another look; what is said of its figure holds the look too."""
    mine = evidence.mine
    if mine != 0:
        mine -= evidence.look - OTHER_LOOK
    return dataclasses.replace(evidence, look=OTHER_LOOK, mine=mine)


def fit(examples: Examples) -> FloatArray:
    """Weights of a logistic regression with a slight ridge, ``(k,)``."""
    features = examples.features
    scale = np.abs(features).max(axis=0) + 1e-9
    inputs = features / scale
    sign = np.where(examples.labels == 1, 1.0, -1.0)
    share = examples.weights / examples.weights.sum()

    def loss(w: FloatArray) -> tuple[float, FloatArray]:
        margin = sign * (inputs @ w)
        slope = share * sign / (1 + np.exp(margin))
        value = float((share * np.logaddexp(0, -margin)).sum() + RIDGE * (w[:-1] ** 2).sum())
        gradient = -(inputs * slope[:, None]).sum(axis=0)
        gradient[:-1] += 2 * RIDGE * w[:-1]
        return value, gradient

    found = minimize(
        loss, np.zeros(inputs.shape[1]), jac=True, method='L-BFGS-B', options={'maxiter': 3000}
    )
    weights: FloatArray = found.x / scale
    return weights


def probabilities(features: FloatArray, weights: FloatArray) -> FloatArray:
    """Of each example, ``(n,)``."""
    result: FloatArray = 1.0 / (1.0 + np.exp(-np.clip(features @ weights, -30, 30)))
    return result


def left_out(examples: Examples) -> list[float]:
    """Share decided rightly in each fold of scenarios by weights fitted to the others."""
    names = np.unique(examples.groups)
    shares = []
    for first in range(min(FOLDS, len(names))):
        test = np.isin(examples.groups, names[first::FOLDS])
        if test.all():
            continue
        weights = fit(with_other_looks(examples.where(~test)))
        decided = probabilities(examples.where(test).features, weights) > 0.5
        shares.append(float(np.mean(decided == (examples.labels[test] == 1))))
    return shares


def _made(name: str) -> Cue:
    """A cue by where its maker is.

    Raises:
        ParameterError: where there is none.
    """
    module, _, maker = name.partition(':')
    try:
        cue: Cue = getattr(importlib.import_module(module), maker)()
    except Exception as error:  # whatever somebody else's code may raise
        raise ParameterError(f'--cue {name}: {error}: give MODULE:NAME of a function') from None
    return cue


def rates(text: str) -> list[float]:
    """Of the command line; what is none makes ``argparse`` say so by this name."""
    return [float(rate) for rate in text.split(',')]


def camera(text: str) -> Intrinsics:
    """The same of ``FX,FY,CX,CY``."""
    return Intrinsics(*map(float, text.split(',')))


def main() -> int:
    """Print weights fitted to the data sets of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0] if __doc__ else None)
    parser.add_argument('dataset', nargs='+', help='as for rgbd-kcf evaluate: sim:all, a folder')
    parser.add_argument('--seeds', type=int, nargs='+', default=[1], help='of simulated scenes')
    parser.add_argument(
        '--rates', type=rates, default='30,15,10,5', metavar='HZ,HZ,...',
        help='frames per second of the scenes',
    )  # fmt: skip
    parser.add_argument('--fps', type=float, default=5.0, help='of image folders without stamps')
    parser.add_argument(
        '--intrinsics', type=camera, metavar='FX,FY,CX,CY',
        help='of recordings that do not have them',
    )  # fmt: skip
    parser.add_argument(
        '--cue',
        action='append',
        default=[],
        metavar='MODULE:NAME',
        help='a further cue: what makes one, called without arguments for each run',
    )
    args = parser.parse_args()
    cv2.setNumThreads(1)
    parts = []
    try:
        options = DatasetOptions(fps=args.fps, seeds=tuple(args.seeds))
        for name in args.dataset:
            path: str | Path = name if name.startswith('sim:') else Path(name)
            for sequence in open_dataset(str(path), options):
                simulated = sequence.kind == 'sim'
                for rate in args.rates if simulated else [None]:
                    cues = tuple(_made(name) for name in args.cue)
                    parts.append(meet(sequence, rate, None if simulated else args.intrinsics, cues))
                    print(f'{sequence.name}: {len(parts[-1].labels)} candidates', file=sys.stderr)
        examples = joined(parts)
    except RgbdKcfError as error:
        print(f'evidence_fit: error: {error}', file=sys.stderr)
        return 2
    features = examples.features
    weights = fit(with_other_looks(examples))
    print('weights:', ', '.join(f'{w:.3f}' for w in weights))
    further = [said.weight for said in examples.evidence[0].more]
    released = np.array([*WEIGHTS[:-1], *further, WEIGHTS[-1]])
    for label, values in (('released', released), ('fitted', weights)):
        chance = probabilities(features, values)
        share = np.mean((chance > 0.5) == (examples.labels == 1))
        print(f'{label}: {100 * share:.1f} % of {len(chance)} candidates decided rightly')
    print('scenarios left out:', ', '.join(f'{100 * s:.1f} %' for s in left_out(examples)))
    chance = probabilities(features, weights)
    for low, high in itertools.pairwise(EDGES):
        inside = (chance >= low) & (chance < high)
        if inside.any():
            right = 100 * np.mean(examples.labels[inside])
            print(
                f'probability {low:g} to {high:g}: {inside.sum()} candidates, {right:.0f} % right'
            )
    return 0


if __name__ == '__main__':
    sys.exit(main())
