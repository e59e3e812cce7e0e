# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Settings of parameters that are tried against each other: a grid, or a seeded random search."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from collections.abc import Sequence as Items
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.errors import DatasetError, ParameterError
from rgbd_kcf_tracker.evaluation.contenders import Contender, variant
from rgbd_kcf_tracker.evaluation.datasets.base import Sequence
from rgbd_kcf_tracker.parameters import ParameterInfo, describe, parsed
from rgbd_kcf_tracker.variants import VARIANTS

STEPS = 5
"""Values of a range in a grid where their number is not given."""

MOST_SETTINGS = 10_000
"""A grid larger than this is a mistake; a random search finds as much with less."""

_DIGITS = 6


@dataclass(frozen=True, slots=True)
class Axis:
    """A parameter and the values that it may take.

    Attributes:
        info: the parameter.
        values: as text, in order; of a range those of a grid.
        low, high: of a range from which random values are drawn; NaN where only ``values`` are.
        log: whether a range is gone through by factors instead of steps.
    """

    info: ParameterInfo
    values: tuple[str, ...]
    low: float = math.nan
    high: float = math.nan
    log: bool = False

    @property
    def fixed(self) -> bool:
        """Whether there is nothing to try."""
        return len(self.values) == 1

    def draw(self, rng: np.random.Generator) -> str:
        """One value at random."""
        if math.isnan(self.low):
            return self.values[int(rng.integers(len(self.values)))]
        # Whole numbers stand for all that is rounded to them, the ends too.
        spare = 0.49 if self.info.type is int else 0.0
        low, high = self.low - spare, self.high + spare
        if self.log:
            return _text(self.info, math.exp(rng.uniform(math.log(low), math.log(high))))
        return _text(self.info, float(rng.uniform(low, high)))


@dataclass(frozen=True, slots=True)
class Setting:
    """Values of all parameters that are tried, by name, and the tracker that has them."""

    values: Mapping[str, str]
    contender: Contender


def parse_axes(items: Iterable[str], name: str | None = None) -> tuple[str, list[Axis]]:
    """The variant and the parameters that ``[VARIANT.]KEY[=SPEC]`` name.

    SPEC is ``LOW:HIGH``, ``LOW:HIGH:N``, either with ``:log`` behind, or values ``A,B,C``; without
    one, the parameter's own range, or all that it can be.

    Args:
        items: as they are typed.
        name: the variant, where no item names it.

    Raises:
        ParameterError: for an unknown variant or parameter, a value out of its range, a range that
            is none, or parameters of two variants.
    """
    split = [item.partition('=') for item in items]
    named = [key.rpartition('.') for key, _, _ in split]
    variants = list(dict.fromkeys(v for v, dot, _ in named if dot)) or [name or 'metric']
    if len(variants) > 1 or (name is not None and variants != [name]):
        raise ParameterError(
            f'parameters of {" and ".join(dict.fromkeys([*variants, *([name] if name else [])]))}: '
            'a sweep is of one variant'
        )
    if variants[0] not in VARIANTS:
        raise ParameterError(f'unknown variant {variants[0]!r}: choose from {", ".join(VARIANTS)}')
    infos = {info.name: info for info in describe(VARIANTS[variants[0]].parameters)}
    axes: dict[str, Axis] = {}
    for (_, _, key), (_, equals, spec) in zip(named, split, strict=True):
        if key not in infos:
            raise ParameterError(
                f'{variants[0]} has no parameter {key!r}: choose from {", ".join(sorted(infos))}'
            )
        if key in axes:
            raise ParameterError(f'--param {key} is given twice')
        axes[key] = _axis(infos[key], spec.strip() if equals else None)
    if all(axis.fixed for axis in axes.values()):
        raise ParameterError('nothing to try: give --param KEY=LOW:HIGH:N, or KEY=A,B,C')
    return variants[0], list(axes.values())


def _axis(info: ParameterInfo, spec: str | None) -> Axis:
    if spec is None:
        if info.type is bool:
            return Axis(info, ('false', 'true'))
        if info.choices:
            return Axis(info, info.choices)
        if info.type is str or info.minimum is None or info.maximum is None:
            raise ParameterError(f'--param {info.name} has no range of its own: give LOW:HIGH:N')
        return _range(info, float(info.minimum), float(info.maximum), STEPS, False)
    if ':' not in spec or info.type is str:
        texts = [t.strip() for t in spec.split(',') if t.strip()]
        if not texts:
            raise ParameterError(f'--param {info.name}={spec}: give values, as in A,B,C')
        for text in texts:
            parsed(info, text)
        return Axis(info, tuple(dict.fromkeys(texts)))
    parts = spec.split(':')
    log = parts[-1] == 'log'
    parts = parts[:-1] if log else parts
    try:
        low, high = float(parts[0]), float(parts[1])
        steps = int(parts[2]) if len(parts) == 3 else STEPS
        if len(parts) > 3:
            raise ValueError
    except (ValueError, IndexError):
        raise ParameterError(
            f'--param {info.name}={spec}: give LOW:HIGH, LOW:HIGH:N, or A,B,C'
        ) from None
    if not low < high or not 2 <= steps <= MOST_SETTINGS:
        raise ParameterError(
            f'--param {info.name}={spec}: LOW must be below HIGH, and N from 2 to {MOST_SETTINGS}'
        )
    if log and low <= 0:
        raise ParameterError(f'--param {info.name}={spec}: with log, LOW must be above 0')
    return _range(info, low, high, steps, log)


def _range(info: ParameterInfo, low: float, high: float, steps: int, log: bool) -> Axis:
    if info.type is bool:
        raise ParameterError(f'--param {info.name}: it is true or false, and has no range')
    grid = np.geomspace(low, high, steps) if log else np.linspace(low, high, steps)
    values = tuple(dict.fromkeys(_text(info, float(v)) for v in grid))
    for text in (values[0], values[-1]):
        parsed(info, text)
    return Axis(info, values, low, high, log)


def _text(info: ParameterInfo, value: float) -> str:
    return str(round(value)) if info.type is int else f'{value:.{_DIGITS}g}'


def grid(variant_name: str, axes: Items[Axis]) -> list[Setting]:
    """Every combination of values.

    Raises:
        ParameterError: where there are too many, or one cannot be.
    """
    count = math.prod(len(axis.values) for axis in axes)
    if count > MOST_SETTINGS:
        raise ParameterError(
            f'{count} settings: try fewer values, or --search random --samples 200'
        )
    names = [axis.info.name for axis in axes]
    return [
        setting(variant_name, dict(zip(names, values, strict=True)))
        for values in itertools.product(*(axis.values for axis in axes))
    ]


def random(variant_name: str, axes: Items[Axis], samples: int, seed: int) -> list[Setting]:
    """Settings drawn at random; more samples of one seed begin with the same.

    Raises:
        ParameterError: for a number of samples that cannot be.
    """
    if not 1 <= samples <= MOST_SETTINGS:
        raise ParameterError(f'--samples is {samples}: give 1 to {MOST_SETTINGS}')
    found: dict[str, Setting] = {}
    for index in range(samples):
        rng = np.random.default_rng([seed, index])
        one = setting(variant_name, {axis.info.name: axis.draw(rng) for axis in axes})
        found.setdefault(one.contender.name, one)
    return list(found.values())


def baseline(variant_name: str, axes: Items[Axis]) -> Setting:
    """The defaults, but for parameters that have one value given."""
    values = {a.info.name: a.values[0] if a.fixed else str(a.info.default) for a in axes}
    fixed = {a.info.name: a.values[0] for a in axes if a.fixed}
    return Setting(values, _named(variant(variant_name, fixed), variant_name))


def setting(variant_name: str, values: Mapping[str, str]) -> Setting:
    """A setting, named after its values so that it is the same in every run."""
    digest = hashlib.sha256(json.dumps(sorted(values.items())).encode()).hexdigest()[:8]
    return Setting(values, _named(variant(variant_name, values), f'{variant_name}.{digest}'))


def _named(contender: Contender, name: str) -> Contender:
    return Contender(name, contender.kind, contender.target, contender.overrides)


def split(
    sequences: Items[Sequence], share: float, seed: int
) -> tuple[list[Sequence], list[Sequence]]:
    """Sequences to try settings on, and those held out.

    Of every scenario the same share is held out; targets of one recording stay together.

    Raises:
        ParameterError: for a share that is not between 0 and 1.
        DatasetError: where one of the two would be empty.
    """
    if not 0 < share < 1:
        raise ParameterError(f'--held-out {share:g}: give a share between 0 and 1, or a data set')
    recordings: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for sequence in sequences:
        recordings[sequence.scenario][sequence.recording].append(sequence.name)
    rng = np.random.default_rng(seed)
    ranked: list[tuple[float, str, list[str]]] = []
    for scenario in recordings.values():
        order = rng.permutation(len(scenario))
        for place, (own, names) in zip(order, scenario.items(), strict=True):
            ranked.append(((place + 0.5) / len(scenario), own, names))
    ranked.sort(key=lambda item: item[:2])  # the first of each scenario, then the second of each
    wanted = round(share * len(ranked))
    held = {name for _, _, names in ranked[:wanted] for name in names}
    tried = [s for s in sequences if s.name not in held]
    if not held or not tried:
        raise DatasetError(
            f'{len(ranked)} recordings are too few to hold {share:g} of them out: give more, or '
            'other data as --held-out DATASET'
        )
    return tried, [s for s in sequences if s.name in held]
