# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Why the tracker decided as it did, as ``~/evidence``: what is said of it, and how it is read.

A ``diagnostic_msgs/DiagnosticArray`` like ``~/state``, in which numbers are written out: a status
for each target, and after it one for each candidate that was weighed for it. Masks and the depth
that was looked at stay with the tracker: boxes tell candidates apart.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.insight import Array, Considered, Insight, KnownView
from rgbd_kcf_tracker.recordings.message_types import MessageTypes
from rgbd_kcf_tracker.recordings.messages import BOX_KEYS, number, numbers, target_name
from rgbd_kcf_tracker.track import Track

MOST_TARGETS = 64
MOST_CONSIDERED = 6
"""Candidates of a target, the likeliest ones."""
MOST_PARTICLES = 300
"""Particles of a target, every second, third and so on of more."""
MOST_VIEWS, MOST_OF_OTHERS = 16, 1
"""Views of those who were asked for, more than any gallery has, and of the others."""
MOST_CUES, LONGEST_CUE, MOST_SLICES = 32, 40, 32
LONGEST_VALUE = 40 * MOST_PARTICLES
"""Letters of the longest value that is read: all particles, with room to spare."""
_CUE, _VIEW = 'cue ', 'view_'
_COLOR = re.compile('#[0-9a-f]{6}')
_NONE = '-'


@dataclass(frozen=True, slots=True, eq=False)
class TargetEvidence:
    """What the wire tells of one target beyond its state.

    Attributes:
        insight: what the tracker knows, without masks, surfaces and depth.
        asked_for: whether somebody chose or added it; False for those followed with everyone.
        velocity: metres per second in the camera's frame; None where unknown.
        covariance: of the position or the predicted one, ``(3, 3)`` row by row; None where unknown.
    """

    insight: Insight
    asked_for: bool = True
    velocity: tuple[float, float, float] | None = None
    covariance: tuple[float, ...] | None = None


def evidence_array(
    types: MessageTypes,
    header: Any,
    tracks: Iterable[Track],
    insights: Mapping[int, Insight],
    asked_for: Collection[int],
) -> Any:
    """``diagnostic_msgs/DiagnosticArray``: what is known of each target, and why.

    Read again by :func:`evidence_of`.

    Args:
        types: makes the messages.
        header: of the colour image.
        tracks: the chosen target first; those without an insight are left out.
        insights: by id.
        asked_for: ids of those whom somebody chose or added.
    """
    array = types.make('diagnostic_msgs/msg/DiagnosticArray', header=header)
    told = [track for track in tracks if track.id in insights][:MOST_TARGETS]
    for row, track in enumerate(told):
        insight, name = insights[track.id], target_name(row, track)
        values = _of_target(track, insight, track.id in asked_for)
        array.status.append(_status(types, name, track.state.value, values))
        for place, candidate in enumerate(insight.considered[:MOST_CONSIDERED], start=1):
            values = _of_candidate(track.id, candidate)
            array.status.append(_status(types, f'{name} candidate_{place}', 'candidate', values))
    return array


def _status(types: MessageTypes, name: str, message: str, values: Iterable[tuple[str, str]]) -> Any:
    make = types.make
    status = make(
        'diagnostic_msgs/msg/DiagnosticStatus',
        name=name,
        message=message,
        values=[make('diagnostic_msgs/msg/KeyValue', key=k, value=v) for k, v in values],
    )
    status.level = status.OK
    return status


def _of_target(track: Track, insight: Insight, asked_for: bool) -> Iterator[tuple[str, str]]:
    yield 'id', str(track.id)
    yield 'asked_for', 'true' if asked_for else 'false'
    if insight.response is not None:
        yield 'response', f'{insight.response:.4f}'
    if insight.floor is not None:
        a, b, c = insight.floor
        yield 'floor', _written((a / insight.step, b / insight.step, c), '.6g')
    if track.velocity is not None:
        yield 'velocity', _written(track.velocity, '.3f')
    if track.covariance is not None:
        yield 'covariance', _written(track.covariance, '.6g')
    if insight.weights is not None:
        if insight.particles is not None and track.occluded:
            yield 'particles', _particles(insight.particles, insight.weights, '.2f')
        if insight.particle_pixels is not None:
            yield 'particle_pixels', _particles(insight.particle_pixels, insight.weights, '.1f')
    views = insight.gallery[: MOST_VIEWS if asked_for else MOST_OF_OTHERS]
    for place, view in enumerate(views, start=1):
        top = _NONE if view.top is None else f'{view.top:.2f}'
        yield f'{_VIEW}{place}', ' '.join((top, *(hex_color(c) or _NONE for c in view.colors)))


def _of_candidate(number: int, candidate: Considered) -> Iterator[tuple[str, str]]:
    yield 'id', str(number)
    yield 'probability', f'{candidate.probability:.4f}'
    for name, value in zip(BOX_KEYS, candidate.box.as_tuple(), strict=True):
        yield name, f'{value:.2f}'
    for name, value in candidate.cues.items():
        yield _CUE + name, f'{value:.3f}'


def hex_color(color: tuple[float, float, float] | None) -> str:
    """A colour as '#rrggbb'; '' for none."""
    if color is None:
        return ''
    return '#' + ''.join(f'{round(255 * v):02x}' for v in color)


def _written(values: Iterable[float], digits: str) -> str:
    return ' '.join(format(float(v), digits) for v in values)


def thinned(places: Array, weights: Array) -> tuple[Array, Array]:
    """Every so many of particles that are too many to send.

    Args:
        places: ``(n, d)`` of the particles, three metres or two pixels each.
        weights: ``(n,)``, at least 0.

    Returns:
        ``(m, d)`` places and ``(m,)`` weights whose sum is 1, ``m`` at most
        :data:`MOST_PARTICLES`.
    """
    step = max(1, -(-len(places) // MOST_PARTICLES))
    kept = weights[::step]
    total = float(kept.sum())
    return places[::step], kept / total if total > 0 else np.full(len(kept), 1 / len(kept))


def _particles(places: Array, weights: Array, digits: str) -> str:
    """Places and shares of the heaviest, one particle after the other."""
    places, weights = thinned(places, weights)
    rows = np.column_stack((places, weights / weights.max()))
    row = ' '.join(['%' + digits] * places.shape[1] + ['%.3f'])
    return ' '.join([row] * len(rows)) % tuple(rows.ravel().tolist())


# -- reading -------------------------------------------------------------------------------------


def evidence_of(msg: Any) -> dict[int, TargetEvidence]:
    """The targets of a ``~/evidence`` by id.

    Whoever sends it is not trusted: what is given back is finite and bounded.

    Raises:
        RgbdKcfError: where it is no such message.
    """
    if len(msg.status) > MOST_TARGETS * (1 + MOST_CONSIDERED):
        raise RgbdKcfError(f'{len(msg.status)} statuses are more than an evidence has')
    found: dict[int, TargetEvidence] = {}
    weighed: dict[int, list[Considered]] = {}
    for status in msg.status:
        try:
            values = {pair.key: pair.value for pair in _bounded(status.values)}
            who = int(values['id'])
            if 'probability' in values:
                weighed[who].append(_candidate(values))
            elif who in found:
                raise ValueError(f'target {who} comes twice')
            else:
                found[who], weighed[who] = _target(values), []
            if len(weighed[who]) > MOST_CONSIDERED:
                raise ValueError(f'more than {MOST_CONSIDERED} candidates')
        except (KeyError, ValueError, RgbdKcfError) as error:
            name = str(status.name)[:80]
            raise RgbdKcfError(f'{name!r} is no evidence of a target: {error}') from None
    return {
        who: replace(told, insight=replace(told.insight, considered=tuple(weighed[who])))
        for who, told in found.items()
    }


def _bounded(pairs: Sequence[Any]) -> Sequence[Any]:
    if len(pairs) > MOST_CUES + MOST_VIEWS:
        raise ValueError(f'{len(pairs)} values')
    if any(len(pair.value) > LONGEST_VALUE for pair in pairs):
        raise ValueError(f'a value of more than {LONGEST_VALUE} letters')
    return pairs


def _target(values: Mapping[str, str]) -> TargetEvidence:
    floor, velocity = _triple(values, 'floor'), _triple(values, 'velocity')
    particles, weights = _read_particles(values, 'particles', 3)
    pixels, shares = _read_particles(values, 'particle_pixels', 2)
    if particles is not None and pixels is not None:
        raise ValueError('particles in metres and in pixels')
    keys = [f'{_VIEW}{place}' for place in range(1, MOST_VIEWS + 1)]
    return TargetEvidence(
        Insight(
            particles=particles,
            weights=shares if weights is None else weights,
            particle_pixels=pixels,
            floor=floor,
            gallery=tuple(_view(values[key]) for key in keys if key in values),
            response=number(values['response']) if 'response' in values else None,
        ),
        values['asked_for'] == 'true',
        velocity,
        numbers(values['covariance'], 9) if 'covariance' in values else None,
    )


def _triple(values: Mapping[str, str], key: str) -> tuple[float, float, float] | None:
    if key not in values:
        return None
    x, y, z = numbers(values[key], 3)
    return x, y, z


def _candidate(values: Mapping[str, str]) -> Considered:
    probability = number(values['probability'])
    if not 0 <= probability <= 1:
        raise ValueError(f'probability {probability:g}')
    cues = {
        key[len(_CUE) :][:LONGEST_CUE]: number(value)
        for key, value in values.items()
        if key.startswith(_CUE)
    }
    return Considered(Box(*(number(values[name]) for name in BOX_KEYS)), probability, cues)


def _view(text: str) -> KnownView:
    top, *colors = text.split()
    if len(colors) > MOST_SLICES:
        raise ValueError(f'{len(colors)} slices')
    return KnownView(
        tuple(None if color == _NONE else _rgb(color) for color in colors),
        None if top == _NONE else number(top),
    )


def _rgb(color: str) -> tuple[float, float, float]:
    if _COLOR.fullmatch(color) is None:
        raise ValueError(f'{color[:20]!r} is no colour')
    red, green, blue = bytes.fromhex(color[1:])
    return red / 255, green / 255, blue / 255


def _read_particles(
    values: Mapping[str, str], key: str, places: int
) -> tuple[Array | None, Array | None]:
    if key not in values:
        return None, None
    given = values[key].split()
    count = len(given) // (places + 1)
    if not 0 < count <= MOST_PARTICLES:
        raise ValueError(f'{len(given)} numbers are no {key}')
    rows = np.reshape(numbers(values[key], count * (places + 1)), (count, places + 1))
    weights = rows[:, -1]
    if weights.min() < 0 or not weights.sum() > 0:
        raise ValueError(f'{key} without weight')
    return rows[:, :-1], weights / weights.sum()
