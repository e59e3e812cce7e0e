# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How long a tracker of several targets takes for a frame, by how many it follows.

In one simulated scene as many people as the most targets stand side by side, all in view all the
time, and step from side to side; of them one is followed, or two, and so on, turn by turn on the
same frames. What a frame shows is thus the same for all counts, and the slope of the times over
the counts is the cost of each further target. The same can be asked of targets that are lost, all
but one having gone away, and of targets without depth.
"""

from __future__ import annotations

import dataclasses
import gc
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation, Sample
from rgbd_kcf_tracker.evaluation.passes import OnePass, Pass, run
from rgbd_kcf_tracker.evaluation.speed import RATE, SEED, Setting
from rgbd_kcf_tracker.simulation.build import kinect2_intrinsics
from rgbd_kcf_tracker.simulation.motion import CameraMotion
from rgbd_kcf_tracker.simulation.sequence import SimulatedSequence
from rgbd_kcf_tracker.simulation.stage import Stage
from rgbd_kcf_tracker.targets import TargetSet
from rgbd_kcf_tracker.track import Track

STATURE = 1.7
"""Metres of a person, about; with the asked height in pixels it gives the distance."""
LANE = 0.64
"""Metres of the scene's breadth for each person, at the least: arms and a step."""
STEP_ASIDE = 0.08
"""Metres that a person steps to either side."""
DEEP = 0.25
"""Metres by which every other person stands farther away."""
BEHIND = 1.5
"""Metres from the people to the wall, at the least."""
LEAVE, GONE = 0.5, 2.0
"""Seconds at which those who are to be lost begin to run, once they have been learned, and at which
they have gone: nobody runs faster than about 4 m/s."""


@dataclass(frozen=True, slots=True)
class Case:
    """What is asked of several targets.

    Attributes:
        lost: whether all but the first run out of the image and stay away; what is timed is then
            the time after that. Else all are in view all the time.
        depth: whether there is depth.
    """

    lost: bool = False
    depth: bool = True

    def __str__(self) -> str:
        gone = ', all but the first gone' if self.lost else ''
        return f'people{gone}{"" if self.depth else ", without depth"}'

    @property
    def untimed(self) -> int:
        """Frames before those that are timed: the start, or until all have gone."""
        return math.ceil(GONE * RATE) if self.lost else 1


def side_by_side(
    setting: Setting, people: int, count: int, lost: bool = False
) -> SimulatedSequence:
    """A scene of people who step from side to side, each in a lane of their own.

    Args:
        setting: size of the image, and about the height of a person in it, in pixels.
        people: how many.
        count: frames.
        lost: whether all but the first run out of the image.

    Raises:
        ParameterError: where so many do not fit beside each other.
    """
    size = setting.width, setting.height
    camera = kinect2_intrinsics(size)
    far = STATURE * camera.fy / setting.target
    lane = setting.width * far / camera.fx / people
    if lane < LANE:
        most = int(setting.width * far / camera.fx / LANE)
        raise ParameterError(
            f'{people} targets of {setting.target} pixels do not fit beside each other into '
            f'{setting.width} columns: at most {most} do; give fewer targets or smaller ones'
        )
    stage = Stage(np.random.default_rng(SEED), camera, size)
    stage.depth = max(stage.depth, far + DEEP + BEHIND)
    stage.half_width = max(stage.half_width, lane * people / 2 + BEHIND)
    seconds = count / RATE
    actors = []
    for k in range(people):
        x, z = (k + 0.5 - people / 2) * lane, far + DEEP * (k % 2)
        times = np.arange(0.0, seconds + 1.0, 0.6) + 0.07 * k
        way = [(t, x + STEP_ASIDE * (-1) ** (i + k), z) for i, t in enumerate(times)]
        if lost and k > 0:
            # Away from the first: none of them is to be taken for him.
            outside = setting.width / 2 * z / camera.fx + LANE
            way = [point for point in way if point[0] < LEAVE]
            way += [(LEAVE, x, z), (GONE, outside, z)]
        facing = [(0.0, stage.uniform(-math.pi, math.pi))]
        actors.append(stage.walk(stage.person(), way, heading=facing))
    high = 0.55 * STATURE
    scene = stage.scene(actors, seconds, camera=CameraMotion(high, 0.0))
    scene.people = tuple(range(people))
    offsets = [round(k * 1e9 / RATE) for k in range(count)]
    return SimulatedSequence(scene, 'side by side', SEED, RATE, offsets, size, camera)


def _samples(scene: SimulatedSequence, depth: bool) -> Iterator[Sample]:
    for simulated in scene:
        frame = simulated.frame if depth else dataclasses.replace(simulated.frame, depth=None)
        people = tuple(
            Annotation(number, truth.visible)
            for number, truth in simulated.truths.items()
            if truth.visible is not None
        )
        yield Sample(frame, simulated.visible, people=people)


class _SeveralPass(Pass[TargetSet, dict[int, Track]]):
    """A tracker of several targets, given the first so many people of the first frame."""

    def __init__(self, targets: TargetSet, count: int) -> None:
        super().__init__(targets)
        self.count = count

    def _step(self, tracker: TargetSet, sample: Sample) -> dict[int, Track]:
        if self.tracks:
            return tracker.update(sample.frame)
        for person in sample.people[: self.count]:
            tracker.add(sample.frame, person.box)
        return {}


@dataclass(frozen=True, slots=True)
class SpeedOfSeveral:
    """Milliseconds a frame of one tracker by how many targets it follows.

    Attributes:
        contender: its name.
        milliseconds: of each timed frame, by number of targets.
        found: share of its answers to these with a box, 0 to 1, by number of targets.
    """

    contender: str
    milliseconds: dict[int, tuple[float, ...]]
    found: dict[int, float]

    def median(self, targets: int) -> float | None:
        """Median with so many targets, None where no frame was timed."""
        spent = self.milliseconds[targets]
        return float(np.median(spent)) if spent else None

    def mean(self, targets: int) -> float | None:
        """Mean likewise, which counts what is done once in a while."""
        spent = self.milliseconds[targets]
        return float(np.mean(spent)) if spent else None

    def each_further(self, measure: Callable[[int], float | None]) -> float | None:
        """Slope of a line through :meth:`median` or :meth:`mean`; None below two numbers."""
        points = [(n, ms) for n in self.milliseconds if (ms := measure(n)) is not None]
        if len(points) < 2:
            return None
        counts, times = zip(*points, strict=True)
        return float(np.polyfit(counts, times, 1)[0])


@dataclass(frozen=True, slots=True)
class SpeedsOfSeveral:
    """What was measured in one setting.

    Attributes:
        setting: the sizes.
        case: what was asked.
        speeds: of each tracker.
        reference: median of another tracker of one target on the same frames, None without.
    """

    setting: Setting
    case: Case
    speeds: tuple[SpeedOfSeveral, ...]
    reference: float | None


def measure_several(
    contenders: Sequence[Contender],
    setting: Setting,
    targets: Sequence[int],
    count: int,
    case: Case = Case(),
    reference: Contender | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> SpeedsOfSeveral:
    """Time ``count`` frames of one setting, all trackers and numbers of targets turn by turn.

    One thread, and an end when asked for, as :func:`~rgbd_kcf_tracker.evaluation.speed.measure`.

    Args:
        contenders: variants.
        setting: sizes.
        targets: how many are to be followed, each number once.
        count: frames, more than are not timed.
        case: what happens in them.
        reference: a tracker that follows one target on the same frames.
        stopped: whether to end early.

    Raises:
        ParameterError: where so many people do not fit, a contender follows one target only, or no
            frame would be timed.
    """
    if count <= case.untimed:
        raise ParameterError(f'{count} frames of {case}: give more than {case.untimed}')
    several = {c.name: {n: _SeveralPass(c.make_set(), n) for n in targets} for c in contenders}
    others = [] if reference is None else [OnePass(reference.make())]
    passes = [one for each in several.values() for one in each.values()]
    samples = _samples(side_by_side(setting, max(targets), count, case.lost), case.depth)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    gc.collect()
    try:
        run(itertools.takewhile(lambda _: not stopped(), samples), *passes, *others)
    finally:
        cv2.setNumThreads(threads)
    checks = [one.check for one in passes] + [one.check for one in others]
    for check in checks:
        check()
    speeds = tuple(
        SpeedOfSeveral(
            name,
            {n: tuple(one.milliseconds[case.untimed :]) for n, one in each.items()},
            {n: _found(one.tracks[case.untimed :]) for n, one in each.items()},
        )
        for name, each in several.items()
    )
    spent = [ms for one in others for ms in one.milliseconds[case.untimed :]]
    return SpeedsOfSeveral(setting, case, speeds, float(np.median(spent)) if spent else None)


def _found(answers: Sequence[dict[int, Track]]) -> float:
    boxes = [track.box for tracks in answers for track in tracks.values()]
    return sum(box is not None for box in boxes) / max(len(boxes), 1)
