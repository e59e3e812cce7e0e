# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What is lower than anybody and drives, and what is rolled away before somebody."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rgbd_kcf_tracker import create_tracker
from rgbd_kcf_tracker.simulation.build import kinect2_intrinsics
from rgbd_kcf_tracker.simulation.sequence import SimulatedSequence
from rgbd_kcf_tracker.simulation.stage import Stage
from rgbd_kcf_tracker.simulation.world import Actor

SIZE, RATE_HZ = (320, 240), 10.0


def shown(cast: Callable[[Stage, float], list[Actor]], seed: int, seconds: float) -> list[bool]:
    """Of the frames that show most of the first of a cast, who is followed, which have his box."""
    camera = kinect2_intrinsics(SIZE)
    stage = Stage(np.random.default_rng(seed), camera, SIZE)
    stage.place_camera(0.9, 1.4)
    scene = stage.scene(cast(stage, stage.uniform(2.5, 3.2)), seconds, room=stage.room((0, 1)))
    scene.people = (0,)
    offsets = [round(k * 1e9 / RATE_HZ) for k in range(round(seconds * RATE_HZ))]
    sequence = SimulatedSequence(scene, cast.__name__, seed, RATE_HZ, offsets, SIZE, camera)
    tracker, has = create_tracker('metric'), []
    for i, sample in enumerate(sequence):
        truth = sample.truths[1]
        if i == 0:
            assert truth.visible is not None
            tracker.start(sample.frame, truth.visible)
            continue
        box = tracker.update(sample.frame).box
        if truth.visible is not None and truth.visible_fraction > 0.8:
            has.append(box is not None and box.iou(truth.visible) > 0.5)
    return has


def robot_that_stops(stage: Stage, z: float) -> list[Actor]:
    left, right = stage.x(-0.4, z), stage.x(0.1, z)
    way = [(0, left, z), (1, left, z), (3, right, z), (9, right, z), (11, stage.x(0.5, z), z - 0.4)]
    return [stage.pushed_box(way, (0.45, stage.uniform(0.5, 0.58), 0.4), 'wood')]


def person_behind_a_board(stage: Stage, z: float) -> list[Actor]:
    way = [(0, -1.5, z), (0.5, -1.5, z), (2, -0.2, z), (6, -0.2, z), (8, -1.2, z)]
    turns = [(0, 1.5), (2, 1.5), (2.4, 0), (6, 0), (6.4, -1.5)]
    return [stage.walk(stage.person(), way, turns), _board(stage, z - 0.4, 1.8)]


def robot_behind_a_board(stage: Stage, z: float) -> list[Actor]:
    way = [(0, -1.5, z), (0.5, -1.5, z), (2, -0.2, z), (7, -0.2, z), (9, -1.2, z)]
    return [stage.pushed_box(way, (0.4, 0.55, 0.36), 'wood'), _board(stage, z - 0.45, 1.0)]


def _board(stage: Stage, z: float, high: float) -> Actor:
    """It stands there from the first frame on, and is rolled away."""
    way = [(0, 0.0, z), (3.5, 0.0, z), (4.7, 1.2, z), (9, 1.2, z)]
    return stage.pushed_box(way, (0.9, high, 0.06), 'wood')


@pytest.mark.parametrize('seed', [1, 2])
def test_a_robot_that_stops_is_no_part_of_the_room(seed: int):
    """After three seconds it was, and lost in full view until it drove on."""
    has = shown(robot_that_stops, seed, 11.0)
    assert len(has) > 90
    assert sum(has) > 0.95 * len(has)


@pytest.mark.parametrize('seed', [1, 2])
@pytest.mark.parametrize('cast', [person_behind_a_board, robot_behind_a_board])
def test_who_stands_behind_what_is_rolled_away_is_no_part_of_the_room(
    cast: Callable[[Stage, float], list[Actor]], seed: int
):
    """What showed behind it passed for the room: he was lost in full view until he walked on."""
    has = shown(cast, seed, 8.0)
    assert len(has) > 40
    assert sum(has) > 0.9 * len(has)
