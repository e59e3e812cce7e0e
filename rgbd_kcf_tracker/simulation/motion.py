# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Motion in continuous time: figures along way points, and the camera in its hand or on its stand.

Everything is a function of seconds alone: a scene sampled at 5 Hz shows the same world as at
30 Hz, only less often.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from rgbd_kcf_tracker.simulation.people import Stance
from rgbd_kcf_tracker.simulation.solids import Vector

Keys = Sequence[tuple[float, float]]
_STEP = 0.01  # seconds between tabulated states


def _smooth(values: Vector, sigma_s: float) -> Vector:
    """Gaussian smoothing along time with the ends held."""
    sigma = sigma_s / _STEP
    if sigma < 0.5:
        return values
    reach = math.ceil(3 * sigma)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    padded = np.pad(values, reach, mode='edge')
    return np.convolve(padded, kernel / kernel.sum(), mode='valid')


def _keyed(t: Vector, keys: Keys, sigma_s: float) -> Vector:
    times, values = np.array(keys, float).T
    return _smooth(np.interp(t, times, values), sigma_s)


class Motion:
    """A figure's way through the room.

    Args:
        points: ``(seconds, x, z)`` way points; it stands still before the first and after the last,
            but for its ``heading`` and ``channels``.
        heading: ``(seconds, radians)``; without it the figure looks where it goes.
        stride: metres per two steps.
        corner_s: smoothing of corners and of starting and stopping.
        channels: further keys by `Stance` field (``crouch``, ``spread``, ``reach``, ``sit``,
            ``lie``, ``on``), or ``lift``.
        phase: of the gait at the start.
    """

    def __init__(
        self, points: Sequence[tuple[float, float, float]], *, heading: Keys | None = None,
        stride: float = 1.4, corner_s: float = 0.18, phase: float = 0.0,
        channels: Mapping[str, Keys] | None = None,
    ) -> None:  # fmt: skip
        points = [(float(t), float(x), float(z)) for t, x, z in points]
        self._start = min(points[0][0], 0.0) - 1.0
        ends = [points[-1][0], *(keys[-1][0] for keys in [heading or (), *(channels or {}).values()]
                                 if len(keys))]  # fmt: skip
        t = np.arange(self._start, max(ends) + 2.0, _STEP)
        x = _keyed(t, [(p[0], p[1]) for p in points], corner_s)
        z = _keyed(t, [(p[0], p[2]) for p in points], corner_s)
        vx, vz = np.gradient(x, _STEP), np.gradient(z, _STEP)
        speed = np.hypot(vx, vz)
        if heading is None:
            course = np.arctan2(vx, -vz)
            moving = np.flatnonzero(speed > 0.15)
            if moving.size:  # hold the course while standing
                last = np.searchsorted(moving, np.arange(len(t)), side='right') - 1
                course = np.unwrap(course[moving[np.maximum(last, 0)]])
            else:
                course = np.zeros_like(t)
            turn = _smooth(course, 0.2)
        else:
            turn = _keyed(t, heading, 0.15)
        self._table = {
            'x': x, 'z': z, 'heading': turn, 'effort': _smooth(np.minimum(speed / 1.4, 2.0), 0.1),
            'phase': phase + 2 * np.pi * np.cumsum(speed) * _STEP / stride,
        }  # fmt: skip
        for name, keys in (channels or {}).items():
            self._table[name] = _keyed(t, keys, 0.3 if name == 'lie' else 0.12)

    def value(self, name: str, t: float, default: float = 0.0) -> float:
        """One tabulated quantity at ``t`` seconds."""
        table = self._table.get(name)
        if table is None:
            return default
        place = min(max((t - self._start) / _STEP, 0.0), len(table) - 1.001)
        i = int(place)
        return float(table[i] + (place - i) * (table[i + 1] - table[i]))

    def stance(self, t: float) -> Stance:
        """The whole stance at ``t`` seconds."""
        v = self.value
        return Stance(
            v('x', t), v('z', t), v('heading', t), v('phase', t), v('effort', t), v('crouch', t),
            v('spread', t), v('reach', t), v('sit', t), v('lie', t), v('on', t),
        )  # fmt: skip


@dataclass(frozen=True)
class CameraMotion:
    """Where the camera stands and looks.

    Attributes:
        height: metres above the floor.
        pitch: radians downwards.
        pan: ``(seconds, radians)`` keys of a slow pan to the right.
        slide: ``(seconds, metres)`` keys of a move to the right.
        shake: amplitude of the hand's shake, radians.
        waves: frequency in hertz and phase of each wave of the shake, ``(5, n, 2)``.
        way: of what carries it, ``(n, 4)`` seconds, metres to the right and ahead, and radians to
            the right; None where it stays.
    """

    height: float
    pitch: float
    pan: Keys = ()
    slide: Keys = ()
    shake: float = 0.0
    waves: Vector = field(default_factory=lambda: np.zeros((5, 0, 2)))
    way: Vector | None = None

    @property
    def fixed(self) -> bool:
        """Whether it never moves."""
        return not self.pan and not self.slide and self.shake == 0 and self.way is None

    def at(self, t: float) -> tuple[Vector, Vector]:
        """Rotation (world to camera) and position at ``t`` seconds."""
        wave = np.zeros(5)
        if self.shake:
            f, p = self.waves[..., 0], self.waves[..., 1]
            wave = (np.sin(2 * np.pi * f * t + p) / (0.4 + f)).sum(axis=1) * self.shake
        x = z = course = 0.0
        if self.way is not None:
            x, z, course = (float(np.interp(t, self.way[:, 0], v)) for v in self.way[:, 1:].T)
        yaw = course + _eased(t, self.pan) + wave[0]
        pitch, roll = self.pitch + wave[1], 0.6 * wave[2]
        cy, sy, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
        cr, sr = math.cos(roll), math.sin(roll)
        turn = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
        nod = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
        tilt = np.array([[cr, sr, 0], [-sr, cr, 0], [0, 0, 1]])
        place = np.array([x + _eased(t, self.slide) + wave[3], -self.height + wave[4], z])
        return tilt @ nod @ turn, place


def _eased(t: float, keys: Keys) -> float:
    """Keys joined by smooth steps."""
    if not keys:
        return 0.0
    for (t0, a), (t1, b) in pairwise(keys):
        if t <= t1:
            s = min(max((t - t0) / (t1 - t0), 0.0), 1.0)
            return a + (b - a) * s * s * (3 - 2 * s)
    return keys[-1][1]


def hand_waves(rng: np.random.Generator) -> Vector:
    """The waves of a hand's shake: 0.3 to 4 Hz."""
    waves = np.empty((5, 6, 2))
    waves[..., 0] = rng.uniform(0.3, 4.0, (5, 6))
    waves[..., 1] = rng.uniform(0, 2 * np.pi, (5, 6))
    return waves
