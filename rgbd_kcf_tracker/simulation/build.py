# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Make a simulated sequence by the name of its scenario."""

from __future__ import annotations

import math
import zlib
from numbers import Integral, Real

import numpy as np

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.simulation import (  # noqa: F401  (importing them registers them)
    scenarios_basic,
    scenarios_occlusion,
    scenarios_people,
    scenarios_special,
)
from rgbd_kcf_tracker.simulation.sequence import SimulatedSequence
from rgbd_kcf_tracker.simulation.stage import SCENARIOS, Stage

QHD = (960, 540)


def kinect2_intrinsics(size: tuple[int, int]) -> Intrinsics:
    """A Kinect V2's colour camera at a width: 1081 pixels of focal length at 1920 columns."""
    focal = 540.68 * size[0] / 960
    return Intrinsics(focal, focal, (size[0] - 1) / 2, (size[1] - 1) / 2)


def check_request(
    scenario: str, seed: int, rate_hz: float, duration_s: float | None, size: tuple[int, int]
) -> None:
    """Check the arguments of `simulate`.

    Raises:
        ParameterError: where a name is unknown, or a number none or out of range.
    """
    for name, given, kind in (
        ('seed', seed, Integral), ('rate', rate_hz, Real),
        ('duration', 0.0 if duration_s is None else duration_s, Real),
    ):  # fmt: skip
        if not isinstance(given, kind):
            whole = 'whole ' if kind is Integral else ''
            raise ParameterError(f'{name} is {given!r}: give a {whole}number')
    if len(size) != 2 or not all(isinstance(side, Integral) for side in size):
        raise ParameterError(f'size is {size!r}: give width and height in whole pixels')
    if scenario not in SCENARIOS:
        raise ParameterError(
            f'unknown scenario {scenario!r}: choose one of {", ".join(sorted(SCENARIOS))}'
        )
    if seed < 0:
        raise ParameterError(f'seed is {seed}: give a number of 0 or above')
    if not (math.isfinite(rate_hz) and 0.1 <= rate_hz <= 1000):
        raise ParameterError(f'rate is {rate_hz:g} Hz: give 0.1 to 1000')
    if duration_s is not None and not (math.isfinite(duration_s) and 0 < duration_s <= 3600):
        raise ParameterError(f'duration is {duration_s:g} s: give above 0 and at most 3600')
    if not (64 <= size[0] <= 4096 and 48 <= size[1] <= 4096):
        raise ParameterError(f'size is {size[0]}x{size[1]}: give 64x48 to 4096x4096')


def simulate(
    scenario: str, seed: int = 0, rate_hz: float = 30.0, duration_s: float | None = None,
    size: tuple[int, int] = QHD, irregular: bool = False,
) -> SimulatedSequence:  # fmt: skip
    """Set up a scene; its frames are rendered when asked for.

    Args:
        scenario: a name in `SCENARIOS`.
        seed: of everything random; the same seed shows the same world at any rate.
        rate_hz: frames per second.
        duration_s: seconds to record, one frame at the least; by default the scene's own length.
            Past that everybody goes to the end of their way and stands still there; with several
            people nobody has planned any more.
        size: width and height of the picture in pixels.
        irregular: stamps that vary by some tenths of the interval, lost frames and gaps, as of a
            camera on a busy machine.

    Raises:
        ParameterError: where a name is unknown, or a number none or out of range.
    """
    check_request(scenario, seed, rate_hz, duration_s, size)
    camera = kinect2_intrinsics(size)
    key = [seed, zlib.crc32(scenario.encode())]
    rng = np.random.default_rng(key)
    scene = SCENARIOS[scenario].build(Stage(rng, camera, size))
    length = scene.duration_s if duration_s is None else duration_s
    offsets_ns = [round(k * 1e9 / rate_hz) for k in range(max(1, round(length * rate_hz)))]
    if irregular:
        offsets_ns = _disturbed(offsets_ns, rate_hz, np.random.default_rng([*key, 1]))
    return SimulatedSequence(scene, scenario, seed, rate_hz, offsets_ns, size, camera)


def _disturbed(offsets_ns: list[int], rate_hz: float, rng: np.random.Generator) -> list[int]:
    """Late stamps, one frame in twenty lost, and two gaps of 0.2 to 0.6 s."""
    times = np.array(offsets_ns, float)
    times[1:] += rng.uniform(0, 0.4e9 / rate_hz, len(times) - 1)
    keep = rng.uniform(size=len(times)) > 0.05
    for start in rng.uniform(0.1, 0.9, 2) * times[-1]:
        keep &= ~((times >= start) & (times < start + rng.uniform(0.2e9, 0.6e9)))
    keep[[0, -1]] = True
    return [round(t) for t in times[keep]]
