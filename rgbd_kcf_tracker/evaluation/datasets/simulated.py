# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Simulated scenes as a data set: ``sim:SCENARIO[:SEED[-SEED]]``, ``sim:all``, ``sim:people``."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence as Items
from functools import partial

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.datasets.base import (
    EVERYONE,
    Annotation,
    Opened,
    Sample,
    Sequence,
)
from rgbd_kcf_tracker.recordings.mot import BARELY_VISIBLE
from rgbd_kcf_tracker.simulation import SCENARIOS, check_request, expand_names, simulate

PREFIX = 'sim:'
MOST_SEEDS = 10_000
"""At once, of all scenes hundreds of thousands."""


def find(
    text: str,
    seeds: Items[int],
    scenarios: Items[str] = (),
    rate_hz: float = 30.0,
    duration_s: float | None = None,
    size: tuple[int, int] = (960, 540),
    everyone: bool = False,
) -> list[Sequence]:
    """The scenes that ``text`` names.

    Args:
        text: ``sim:all``, ``sim:occlusion``, ``sim:occlusion:3``, ``sim:all:1-5``,
            ``sim:normal,crowd:2``.
        seeds: where ``text`` names none.
        scenarios: leave out all others; empty for none.
        rate_hz: frames per second.
        duration_s: length of each scene, None for its own.
        size: of the images, width and height in pixels.
        everyone: in which everyone is followed, instead of the target.

    Raises:
        DatasetError: for an unknown scenario or a seed that is no number.
        ParameterError: for a rate, length or size that no scene can have.
    """
    names, _, seed_text = text.removeprefix(PREFIX).partition(':')
    chosen = expand_names(name.strip() for name in names.split(','))
    for name in (*chosen, *scenarios):
        if name not in SCENARIOS:
            raise DatasetError(
                f'unknown scenario {name!r}: choose from all, people, {", ".join(SCENARIOS)}'
            )
    if scenarios:
        chosen = [name for name in chosen if name in scenarios]
    found = [
        (name, seed)
        for name in chosen
        for seed in (parse_seeds(seed_text, f'{text}: seeds') if seed_text else seeds)
    ]
    for name, seed in found:  # every mistake before anything is run
        check_request(name, seed, rate_hz, duration_s, size)
    return [
        Sequence(
            name=f'{name}/{seed}',
            scenario=name,
            kind=EVERYONE if everyone else 'sim',
            open=partial(
                load_everyone if everyone else load, name, seed, rate_hz, duration_s, size
            ),
            identity=f'sim:{name}:{seed}:{rate_hz}:{duration_s}:{size}',
        )
        for name, seed in found
    ]


def parse_seeds(text: str, option: str = '--seeds') -> list[int]:
    """Seeds of ``3``, ``1-5`` or ``1,4,7-9``.

    Args:
        text: that was given.
        option: by which it was given, for the error.

    Raises:
        DatasetError: where the text is none of these, or names more than :data:`MOST_SEEDS`.
    """
    ranges: list[range] = []
    try:
        for part in text.split(','):
            first, dash, last = part.partition('-')
            ranges.append(range(int(first), int(last if dash else first) + 1))
        if not all(ranges):
            raise ValueError
    except ValueError:
        raise DatasetError(f'{option} {text!r}: give numbers like 3, 1-5 or 1,4,7-9') from None
    if sum(seeds.stop - seeds.start for seeds in ranges) > MOST_SEEDS:
        raise DatasetError(f'{option} {text!r}: give no more than {MOST_SEEDS} seeds')
    return list(dict.fromkeys(seed for seeds in ranges for seed in seeds))


def load(
    scenario: str, seed: int, rate_hz: float, duration_s: float | None, size: tuple[int, int]
) -> Opened:
    """Render one scene, frame by frame as it is read."""
    scene = simulate(scenario, seed=seed, rate_hz=rate_hz, duration_s=duration_s, size=size)

    def samples() -> Iterator[Sample]:
        for number, moment in enumerate(scene):
            yield Sample(
                moment.frame,
                moment.visible,
                moment.body,
                moment.visible_fraction,
                position=moment.truth.position,
                velocity=scene.velocity(number),
            )

    return Opened(samples(), len(scene), has_body=True)


def load_everyone(
    scenario: str, seed: int, rate_hz: float, duration_s: float | None, size: tuple[int, int]
) -> Opened:
    """Render one scene with the truth about everyone in it.

    Raises:
        DatasetError: where the scene tells of its target alone.
    """
    scene = simulate(scenario, seed=seed, rate_hz=rate_hz, duration_s=duration_s, size=size)
    if len(scene.people) < 2:
        raise DatasetError(
            f'the scenario {scenario} tells where its target is, and of nobody else: '
            'choose one of several people'
        )

    def samples() -> Iterator[Sample]:
        for moment in scene:
            people = tuple(
                Annotation(
                    who, truth.shown, truth.visible_fraction >= BARELY_VISIBLE, truth.body,
                    truth.visible_fraction,
                )
                for who, truth in moment.truths.items()
                if truth.shown is not None
            )  # fmt: skip
            yield Sample(moment.frame, None, people=people)

    return Opened(samples(), len(scene), has_body=True)
