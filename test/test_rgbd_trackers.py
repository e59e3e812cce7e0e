# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

from __future__ import annotations

import dataclasses
import itertools
import tracemalloc
from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from rgbd_kcf_tracker import Box, Frame, Intrinsics, RgbdKcfError, Track, TrackState, create_tracker
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.thesis import at_once
from rgbd_kcf_tracker.thesis.rgbd import RgbdParameters
from rgbd_kcf_tracker.thesis.rgbd_pf import RgbdPfParameters
from rgbd_kcf_tracker.variants import default_parameters

VARIANTS = ['rgbd', 'rgbd_pf']
WIDTH, HEIGHT = 480, 270
CAMERA = Intrinsics(270, 270, 240, 135)
TARGET = (36, 100)


def texture(
    height: int, width: int, seed: int, tint: tuple[int, int, int] = (255, 255, 255)
) -> npt.NDArray[np.uint8]:
    noise = np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)
    smooth = cv2.GaussianBlur(noise, (0, 0), 2.0)
    full = np.asarray(cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX), np.float32)
    return (full * np.array(tint, np.float32) / 255).astype(np.uint8)


ROOM = texture(HEIGHT, WIDTH, 1)
PERSON = texture(TARGET[1], TARGET[0], 2, (255, 120, 60))
PILLAR = texture(HEIGHT, 70, 3, (90, 255, 90))


def paste(
    color: npt.NDArray[np.uint8],
    depth: npt.NDArray[np.float32],
    patch: npt.NDArray[np.uint8],
    x: int,
    y: int,
    z: float,
) -> None:
    height, width = patch.shape[:2]
    x0, x1 = max(x, 0), min(x + width, WIDTH)
    y0, y1 = max(y, 0), min(y + height, HEIGHT)
    if x1 > x0 and y1 > y0:
        color[y0:y1, x0:x1] = patch[y0 - y : y1 - y, x0 - x : x1 - x]
        depth[y0:y1, x0:x1] = z


def frame(
    x: float,
    index: int,
    hz: float = 30,
    z: float = 3.0,
    pillar: int | None = None,
    pillar_z: float = 1.8,
    with_depth: bool = True,
) -> Frame:
    color = ROOM.copy()
    depth = np.full((HEIGHT, WIDTH), 5.0, np.float32)
    paste(color, depth, PERSON, round(x), 90, z)
    if pillar is not None:
        paste(color, depth, PILLAR, pillar, 0, pillar_z)
    depth += np.random.default_rng(index).normal(0, 0.01, depth.shape).astype(np.float32)
    return Frame(color, depth if with_depth else None, round(index * 1e9 / hz), CAMERA)


def box(x: float) -> Box:
    return Box(round(x), 90, *TARGET)


def walk_behind_pillar(hz: float) -> Iterator[tuple[Frame, Box, float]]:
    """A walk at 80 px/s behind a pillar at 200 to 270, and the share of the person that shows."""
    for index in range(round(4.0 * hz)):
        x = 60 + 80 * index / hz
        hidden = max(0.0, min(x + TARGET[0], 270) - max(x, 200)) / TARGET[0]
        yield frame(x, index, hz, pillar=200), box(x), 1 - hidden


@pytest.mark.parametrize('hz', [30, 10, 5])
@pytest.mark.parametrize('variant', VARIANTS)
def test_says_hidden_behind_a_pillar_and_finds_again(variant: str, hz: float) -> None:
    tracker = create_tracker(variant)
    before, hidden, after = [], [], []
    for index, (now, truth, shown) in enumerate(walk_behind_pillar(hz)):
        track = tracker.start(now, truth) if index == 0 else tracker.update(now)
        if shown == 1 and truth.x < 200:
            before.append(track.box is not None and track.box.iou(truth) > 0.6)
        elif shown <= 0.1:
            hidden.append(track.occluded and track.box is None)
        elif shown == 1 and truth.x > 300:
            after.append(track.box is not None and track.box.iou(truth) > 0.6)
    assert np.mean(before) == 1
    assert np.mean(hidden) > 0.9
    assert np.mean(after) > 0.8


@pytest.mark.parametrize('variant', VARIANTS)
def test_a_standing_target_and_a_passer_by(variant: str) -> None:
    tracker = create_tracker(variant)
    tracker.start(frame(200, 0), box(200))
    states = []
    for index in range(1, 90):
        pillar = -80 + 8 * index
        track = tracker.update(frame(200, index, pillar=pillar))
        states.append(track.state)
        # Fully covered from 166 to 200.
        if 170 <= pillar <= 196:
            assert track.box is None
    assert states[0] is states[-1] is TrackState.TRACKING
    assert track.box is not None
    assert track.box.iou(box(200)) > 0.9
    changes = sum(a is not b for a, b in itertools.pairwise(states))
    assert changes <= 4


@pytest.mark.parametrize('hz', [5, 30])
@pytest.mark.parametrize('variant', VARIANTS)
def test_walking_towards_the_camera_is_not_occlusion(variant: str, hz: float) -> None:
    tracker = create_tracker(variant)
    tracker.start(frame(200, 0, hz), box(200))
    for index in range(1, round(hz)):
        track = tracker.update(frame(200, index, hz, z=3.0 - 1.5 * index / hz))
        assert track.state is TrackState.TRACKING
        assert track.depth == pytest.approx(3.0 - 1.5 * index / hz, abs=0.1)


@pytest.mark.parametrize('variant', VARIANTS)
def test_depth_and_position_are_the_targets(variant: str) -> None:
    tracker = create_tracker(variant)
    first = tracker.start(frame(200, 0), box(200))
    assert first.box == box(200)
    assert first.depth == pytest.approx(3.0, abs=0.05)
    track = tracker.update(frame(202, 1))
    assert track.position is not None
    assert track.position == pytest.approx((-22 * 3 / 270, 5 * 3 / 270, 3.0), abs=0.06)
    blind = create_tracker(variant)
    track = blind.start(frame(200, 0, with_depth=False), box(200))
    assert track.depth is None
    assert track.position is None


@pytest.mark.parametrize('variant', VARIANTS)
def test_a_target_that_leaves_the_view_is_absent_until_it_returns(variant: str) -> None:
    tracker = create_tracker(variant)
    tracker.start(frame(380, 0), box(380))
    absent, back = [], []
    for index in range(1, 150):
        # Out to the right, away for a second, and in again.
        x = 380 + 3 * min(index, 50) - 3 * max(index - 80, 0)
        track = tracker.update(frame(x, index))
        if x >= WIDTH + 5:
            absent.append(track.box is None)
        if index > 135:
            back.append(track.box is not None and track.box.iou(box(x)) > 0.5)
    assert np.mean(absent) > 0.7
    assert np.mean(back) > 0.8


@pytest.mark.parametrize('variant', VARIANTS)
def test_nothing_is_learned_while_hidden(variant: str) -> None:
    tracker = create_tracker(variant)
    tracker.start(frame(200, 0), box(200))
    for index in range(1, 10):
        tracker.update(frame(200, index))
    for index in range(10, 60):
        assert tracker.update(frame(200, index, pillar=183)).box is None
    track = tracker.update(frame(200, 60))
    assert track.state is TrackState.TRACKING
    assert track.score > 0.8


@pytest.mark.parametrize('variant', VARIANTS)
def test_a_long_time_hidden_is_lost(variant: str) -> None:
    tracker = create_tracker(variant, default_parameters(variant).replace(lost_after=2.0))
    tracker.start(frame(200, 0), box(200))
    tracker.update(frame(200, 1))
    states = [tracker.update(frame(200, i, hz=10, pillar=183)).state for i in range(2, 40)]
    assert states[5] is TrackState.OCCLUDED
    assert states[-1] is TrackState.LOST
    # Looked for everywhere now: found where it could not have been a moment ago.
    found: list[Track] = [tracker.update(frame(400, i, hz=10, pillar=183)) for i in range(40, 60)]
    assert found[-1].box is not None
    assert found[-1].box.iou(box(400)) > 0.6


@pytest.mark.parametrize('variant', VARIANTS)
def test_who_is_hidden_is_lost_in_time_although_stamps_went_back(variant: str) -> None:
    """As in a loop: until the clock had caught up it was hidden for no time at all."""
    tracker = create_tracker(variant, default_parameters(variant).replace(lost_after=2.0))
    states = []
    for i in range(42):
        seen = frame(200, 600 + i, hz=10, pillar=None if i < 2 else 183)
        if i > 6:
            seen = dataclasses.replace(seen, stamp_ns=seen.stamp_ns - 50_000_000_000)
        track = tracker.start(seen, box(200)) if i == 0 else tracker.update(seen)
        states.append(track.state)
    assert states[10] is TrackState.OCCLUDED
    assert states[-1] is TrackState.LOST


@pytest.mark.parametrize('variant', VARIANTS)
def test_without_depth_it_follows_by_look_alone(variant: str) -> None:
    tracker = create_tracker(variant)
    tracker.start(frame(100, 0, with_depth=False), box(100))
    for index in range(1, 30):
        track = tracker.update(frame(100 + 4 * index, index, with_depth=False))
        assert track.box is not None
        assert track.box.iou(box(100 + 4 * index)) > 0.7


@pytest.mark.parametrize('variant', VARIANTS)
@pytest.mark.parametrize('absurd', [3e38, 1e12, 1e-30])
@pytest.mark.filterwarnings('error::RuntimeWarning')
def test_depth_that_no_camera_measures_is_none(variant: str, absurd: float) -> None:
    tracks = []
    for odd in (absurd, np.nan):
        tracker = create_tracker(variant)
        tracker.start(frame(60, 0), box(60))
        for index in range(1, 6):
            shown = frame(60 + 2 * index, index)
            assert shown.depth is not None
            shown.depth[:, ::3] = odd
            tracks.append(tracker.update(shown))
    assert tracks[:5] == tracks[5:]


@pytest.mark.parametrize(
    ('variant', 'greedy'),
    [
        ('rgbd', {'search_span': 20.0, 'search_step': 0.02, 'padding': 4.0}),
        ('rgbd_pf', {'particles': 500, 'color_bins': 32}),
    ],
)
def test_memory_does_not_grow_with_windows_or_particles(
    variant: str, greedy: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = []
    for most in (at_once.MOST_AT_ONCE, 1 << 40):
        monkeypatch.setattr(at_once, 'MOST_AT_ONCE', most)
        tracker = create_tracker(variant, default_parameters(variant).replace(**greedy))
        tracker.start(frame(60, 0), box(60))
        tracks = [tracker.update(frame(62, 1))]
        tracemalloc.start()
        try:
            tracks.append(tracker.update(frame(64, 2)))
            answers.append((tracks, tracemalloc.get_traced_memory()[1]))
        finally:
            tracemalloc.stop()
    (tracks, peak), (others, before) = answers
    assert tracks == others
    assert peak < 40e6 < 150e6 < before


@pytest.mark.parametrize('variant', VARIANTS)
def test_depth_that_comes_and_goes(variant: str) -> None:
    tracker = create_tracker(variant)
    tracker.start(frame(100, 0, with_depth=False), box(100))
    for index in range(1, 40):
        track = tracker.update(frame(100 + 4 * index, index, with_depth=index % 3 > 0))
        assert track.box is not None
        assert track.box.iou(box(100 + 4 * index)) > 0.7


@pytest.mark.parametrize('variant', VARIANTS)
def test_the_same_input_gives_the_same_output_bit_for_bit(variant: str) -> None:
    runs = []
    used = create_tracker(variant)
    used.start(frame(10, 0), box(10))
    used.update(frame(20, 1))
    for tracker in (used, create_tracker(variant)):
        runs.append(
            [
                tracker.start(now, truth) if index == 0 else tracker.update(now)
                for index, (now, truth, _) in enumerate(walk_behind_pillar(10))
            ]
        )
    assert runs[0] == runs[1]


@pytest.mark.parametrize('variant', VARIANTS)
@pytest.mark.parametrize(
    'first',
    [
        Box(-20, 100, 40, 80),
        Box(-50, -50, 700, 500),
        Box(100, 100, 12, 12),
        Box(100, 100, 40, 1),
        Box(100, 100, 1, 60),
        Box(478, 268, 1.5, 1.5),
    ],
)
def test_boxes_and_images_of_every_kind(variant: str, first: Box) -> None:
    tracker = create_tracker(variant)
    assert tracker.update(frame(0, 0)).state is TrackState.IDLE
    tracker.start(frame(100, 0), first)
    for index in range(1, 4):
        tracker.update(frame(100 + 9 * index, index))
    blank = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    nothing = np.full((HEIGHT, WIDTH), np.nan, np.float32)
    tracker.update(Frame(blank, nothing, 10**9))
    # A stamp that goes back, another size, and back again.
    tracker.update(frame(100, 0))
    larger = frame(100, 40)
    tracker.update(Frame(np.repeat(np.repeat(larger.color, 2, 0), 2, 1), None, 2 * 10**9))
    tracker.update(Frame(np.zeros((7, 900, 3), np.uint8), np.zeros((7, 900), np.float32), 10**10))
    tracker.update(frame(100, 90))


@pytest.mark.parametrize('variant', VARIANTS)
def test_a_stream_that_changes_size_is_followed_on(variant: str) -> None:
    tracker = create_tracker(variant)
    tracker.start(frame(100, 0), box(100))
    for index in range(1, 30):
        x = 100 + 4 * index
        now = frame(x, index)
        if index > 10:
            assert now.depth is not None
            color = cv2.resize(now.color, (2 * WIDTH, 2 * HEIGHT))
            depth = np.repeat(np.repeat(now.depth, 2, 0), 2, 1)
            now = Frame(color, depth, now.stamp_ns)
        track = tracker.update(now)
        assert track.box is not None
        scale = 2 if index > 10 else 1
        truth = Box(scale * x, scale * 90, scale * TARGET[0], scale * TARGET[1])
        assert track.box.iou(truth) > 0.7


@pytest.mark.parametrize('variant', VARIANTS)
def test_bad_input_is_refused(variant: str) -> None:
    with pytest.raises(RgbdKcfError, match='outside'):
        create_tracker(variant).start(frame(0, 0), Box(900, 0, 5, 5))
    with pytest.raises(ParameterError, match='depth_threshold'):
        default_parameters(variant).replace(depth_threshold=-1.0)


def test_the_thesis_thresholds_are_the_defaults() -> None:
    assert RgbdParameters().detect_threshold == 0.5
    assert RgbdPfParameters().accept_threshold == 0.6
    assert RgbdPfParameters().hold_threshold == 0.3
