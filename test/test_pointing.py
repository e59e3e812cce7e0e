# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Choosing a target by a click, on simulated scenes and on real people."""

from __future__ import annotations

import math
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker import Box, Frame, Intrinsics
from rgbd_kcf_tracker.errors import BoxError
from rgbd_kcf_tracker.metric.pointing import target_at
from rgbd_kcf_tracker.simulation import simulate

CAMERA = Intrinsics(540, 540, 320, 240)


def blocks(*things: tuple[Box, float]) -> Frame:
    """Flat things before a wall at 4 m."""
    rng = np.random.default_rng(1)
    depth = np.full((480, 640), 4.0, np.float32)
    for box, distance in sorted(things, key=lambda t: -t[1]):
        x, y, width, height = (round(v) for v in box.as_tuple())
        depth[y : y + height, x : x + width] = distance
    color = rng.integers(0, 255, (480, 640, 3), np.uint8)
    return Frame(color, depth, 0, CAMERA)


@pytest.mark.parametrize('place', [(130, 150), (101, 101), (159, 259), (130, 250)])
def test_a_click_anywhere_on_a_thing_gives_the_thing(place: tuple[int, int]) -> None:
    thing = Box(100, 100, 60, 160)
    frame = blocks((thing, 2.0), (Box(165, 100, 100, 200), 2.6))
    assert target_at(frame, *place).iou(thing) > 0.9


def test_a_click_on_the_last_column_of_a_thing_gives_the_thing() -> None:
    """A view's pixels are the middles of its steps: the next one to the edge is the thing's."""
    color = np.random.default_rng(1).integers(0, 255, (1080, 1920, 3), np.uint8)
    depth = np.full((1080, 1920), 4.0, np.float32)
    depth[300:800, 800:1000] = 2.0
    frame = Frame(color, depth, 0, Intrinsics(1620, 1620, 960, 540))
    assert target_at(frame, 999, 500).iou(Box(800, 300, 200, 500)) > 0.9


def test_a_click_into_a_hole_takes_what_is_round_it() -> None:
    thing = Box(100, 100, 60, 160)
    frame = blocks((thing, 2.0))
    frame.depth[170:180, 125:135] = np.nan
    assert target_at(frame, 130, 175).iou(thing) > 0.9


@pytest.mark.parametrize(
    ('u', 'v', 'words'),
    [
        (-1, 10, 'outside the 640x480 image'),
        (640, 10, 'outside the 640x480 image'),
        (math.nan, 10, 'outside'),
        (600, 20, 'fills the image'),
        (300, 400, 'no depth reading'),
        (400, 300, 'speck'),
    ],
)
def test_a_click_that_gives_no_target_says_why(u: float, v: float, words: str) -> None:
    frame = blocks((Box(398, 298, 4, 4), 2.0))
    frame.depth[350:450, 250:350] = np.nan
    with pytest.raises(BoxError, match=words):
        target_at(frame, u, v)


def test_a_click_on_a_piece_of_wall_is_refused() -> None:
    """It fills no more than a third of the image, and is three metres wide."""
    frame = blocks((Box(0, 260, 640, 220), 2.0), (Box(0, 0, 200, 260), 3.0))
    with pytest.raises(BoxError, match=r'3\.3 m wide and 1\.9 m high, a wall'):
        target_at(frame, 420, 100)


def test_a_click_without_depth_says_what_to_do() -> None:
    with pytest.raises(BoxError, match='give a box instead'):
        target_at(Frame(np.zeros((480, 640, 3), np.uint8)), 10, 10)


@pytest.mark.parametrize('scenario', ['normal', 'passer_by', 'mug_hand_held'])
def test_clicks_on_simulated_targets(scenario: str) -> None:
    overlaps = []
    for moment in islice(simulate(scenario, seed=4, rate_hz=3), 8):
        if moment.visible is not None and moment.visible_fraction > 0.95:
            truth = moment.visible
            overlaps.append(target_at(moment.frame, truth.cx, truth.y + truth.height * 0.4))
            overlaps[-1] = overlaps[-1].iou(truth)
    assert len(overlaps) >= 3
    assert np.median(overlaps) > 0.6


@pytest.mark.parametrize('seed', [505, 508])
def test_a_click_on_a_leg_or_an_arm_gives_the_person(seed: int) -> None:
    """A leg behind the other, or a bag before somebody, is a surface of its own."""
    moment = next(iter(simulate('comers', seed=seed, rate_hz=1, size=(640, 480))))
    people = [truth.visible for truth in moment.truths.values() if truth.visible_fraction == 1]
    overlaps = []
    for box in people:
        for across, down in ((0.5, 0.4), (0.5, 0.6), (0.6, 0.5), (0.4, 0.8)):
            where = box.x + across * box.width, box.y + down * box.height
            overlaps.append(target_at(moment.frame, *where).iou(box))
    assert len(overlaps) >= 8
    assert min(overlaps) > 0.6


def real_frames(folder: Path, step: int) -> list[tuple[int, Frame]]:
    camera = Intrinsics(534.29, 534.75, 309.57, 243.07)
    found = []
    for path in sorted((folder / 'rgb').iterdir())[::step]:
        depth = cv2.imread(str(folder / 'depth' / f'{path.stem}.png'), cv2.IMREAD_UNCHANGED)
        metres = np.where(depth > 0, depth / 1000, np.nan).astype(np.float32)
        index = int(path.stem)
        found.append((index, Frame(cv2.imread(str(path)), metres, 0, camera)))
    return found


def test_clicks_on_real_people(shared_data: Path) -> None:
    folder = shared_data / 'rgbd' / 'filinha'
    frames = real_frames(folder, 4)
    truths = [np.loadtxt(path, delimiter=',', ndmin=2) for path in folder.glob('groundtruth_*.txt')]
    first = int(min((folder / 'rgb').iterdir()).stem)
    clicked = people = 0
    for number, frame in frames:
        rows = [truth[number - first] for truth in truths]
        boxes = [Box(*row) for row in rows if np.isfinite(row).all() and row[2] > 0]
        for other in boxes:
            people += 1
            clicked += target_at(frame, other.cx, other.y + 0.35 * other.height).iou(other) > 0.5
    assert clicked > 0.85 * people
