# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How long a tracker takes for a frame, tracking and searching apart, and what memory it holds.

All contenders see the same frames turn by turn, so that a machine that slows down slows all of
them: ratios hold where single times do not. The scene is plain and exact: a textured figure that
sways before a textured wall, and for a third of the time a board that hides it.
"""

from __future__ import annotations

import gc
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import Sample
from rgbd_kcf_tracker.evaluation.passes import OnePass, run
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics

RATE = 30.0
WALL, FIGURE, BOARD = 4.0, 2.5, 1.5
"""Metres from the camera."""
ASPECT = 0.38
"""Width of the figure against its height."""
PERIOD = 90
HIDDEN = (55, 85)
"""Frames of each period in which the board stands before the figure."""
SEED = 7


@dataclass(frozen=True, slots=True)
class Setting:
    """Size of the image and of the target in it, in pixels."""

    width: int
    height: int
    target: int

    @property
    def target_width(self) -> int:
        """How wide the target is, in pixels."""
        return max(4, round(self.target * ASPECT))

    def __str__(self) -> str:
        return f'{self.width}x{self.height}, target {self.target} px'


class SpeedScene:
    """The frames of one setting.

    Args:
        setting: sizes in pixels; the target must fit into the image.
    """

    def __init__(self, setting: Setting) -> None:
        rng = np.random.default_rng(SEED)
        self._setting = setting
        self._wall = _texture(rng, setting.height, setting.width, 24)
        tall, wide = setting.target, setting.target_width
        self._figure = _texture(rng, tall, wide, 6)
        outline = np.zeros((tall, wide), np.uint8)
        cv2.ellipse(
            outline,
            (wide // 2, tall // 8),
            (max(1, wide // 5), max(1, tall // 8)),
            0,
            0,
            360,
            1,
            -1,
        )
        cv2.rectangle(outline, (0, tall // 4), (wide - 1, tall - 1), 1, -1)
        self._outline = outline.astype(np.bool_)
        focal = setting.width * 0.5625
        self._intrinsics = Intrinsics(focal, focal, setting.width / 2, setting.height / 2)

    def box(self, index: int) -> Box:
        """The whole figure in frame ``index``."""
        tall, wide = self._outline.shape
        free = max(0, self._setting.width - 3 * wide)
        phase = 2 * np.pi * (index % PERIOD) / PERIOD
        left = (self._setting.width - wide) / 2 + 0.15 * free * np.sin(phase)
        top = (self._setting.height - tall) / 2
        return Box(round(left), round(top), wide, tall)

    def hidden(self, index: int) -> bool:
        """True while the board stands before the figure."""
        return HIDDEN[0] <= index % PERIOD < HIDDEN[1]

    def frame(self, index: int) -> Frame:
        """Frame ``index``; a new picture each time."""
        color = self._wall.copy()
        depth = np.full(color.shape[:2], WALL, np.float32)
        box = self.box(index)
        rows = slice(int(box.y), int(box.bottom))
        cols = slice(int(box.x), int(box.right))
        color[rows, cols][self._outline] = self._figure[self._outline]
        depth[rows, cols][self._outline] = FIGURE
        if self.hidden(index):
            margin = int(box.width * 0.3)
            board = np.s_[
                max(0, int(box.y) - margin) :,
                max(0, int(box.x) - margin) : int(box.right) + margin,
            ]
            color[board] = (96, 128, 144)
            depth[board] = BOARD
        return Frame(color, depth, round(index * 1e9 / RATE), self._intrinsics)

    def frames(self, count: int) -> Iterator[Frame]:
        """The first ``count`` frames."""
        return (self.frame(i) for i in range(count))


def _texture(
    rng: np.random.Generator, height: int, width: int, grain: int
) -> npt.NDArray[np.uint8]:
    coarse = rng.integers(
        0, 256, (max(2, height // grain), max(2, width // grain), 3), dtype=np.uint8
    )
    fine = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.ascontiguousarray(fine, dtype=np.uint8)


@dataclass(frozen=True, slots=True)
class Speed:
    """Milliseconds a frame of one contender in one setting.

    Attributes:
        contender: its name.
        setting: the sizes.
        tracking: of frames answered with a box, in milliseconds.
        searching: of frames answered without one.
    """

    contender: str
    setting: Setting
    tracking: list[float] = field(default_factory=list)
    searching: list[float] = field(default_factory=list)

    def median(self) -> float | None:
        """Median while tracking."""
        return float(np.median(self.tracking)) if self.tracking else None

    def p95(self) -> float | None:
        """95th percentile while tracking."""
        return float(np.percentile(self.tracking, 95)) if self.tracking else None

    def searching_p95(self) -> float | None:
        """95th percentile while searching."""
        return float(np.percentile(self.searching, 95)) if self.searching else None


def measure(
    contenders: list[Contender],
    setting: Setting,
    count: int,
    stopped: Callable[[], bool] = lambda: False,
) -> list[Speed]:
    """Time ``count`` frames of one setting, the contenders turn by turn on each frame.

    One thread: OpenCV's own threads are switched off for the time. Asked by ``stopped`` before each
    frame to end early, it answers with the times it has.
    """
    scene = SpeedScene(setting)
    passes = [OnePass(contender.make()) for contender in contenders]
    samples = (Sample(frame, scene.box(index)) for index, frame in enumerate(scene.frames(count)))
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    gc.collect()
    try:
        run(itertools.takewhile(lambda _: not stopped(), samples), *passes)
    finally:
        cv2.setNumThreads(threads)
    return [_speed(c.name, setting, one) for c, one in zip(contenders, passes, strict=True)]


def _speed(name: str, setting: Setting, one: OnePass) -> Speed:
    one.check()
    speed = Speed(name, setting)
    answers = itertools.islice(zip(one.tracks, one.milliseconds, strict=True), 1, None)
    for track, spent in answers:  # the first is the start
        (speed.searching if track.box is None else speed.tracking).append(spent)
    return speed


@dataclass(frozen=True, slots=True)
class Memory:
    """Resident memory of the process in MiB over a long run, at even intervals.

    The first sample is taken after a tenth of the frames, when all that is kept has been made.
    """

    contender: str
    frames: int
    samples: tuple[float, ...]

    @property
    def growth(self) -> float:
        """MiB between the first and the last sample."""
        return self.samples[-1] - self.samples[0]


def soak(contender: Contender, setting: Setting, count: int, samples: int = 10) -> Memory:
    """Run one contender over ``count`` frames and watch the process's memory."""
    import psutil

    scene = SpeedScene(setting)
    # One period, made beforehand, with the stamps of each turn put in anew.
    period = [scene.frame(i) for i in range(PERIOD)]
    tracker = contender.make()
    tracker.start(period[0], scene.box(0))
    process = psutil.Process()
    seen = []
    for index in range(1, count):
        frame = period[index % PERIOD]
        stamp = round(index * 1e9 / RATE)
        tracker.update(Frame(frame.color, frame.depth, stamp, frame.intrinsics))
        if index % max(1, count // samples) == 0:
            seen.append(process.memory_info().rss / 2**20)
    return Memory(contender.name, count, tuple(seen))
