# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where the middle of a body is said to be, how sure that is, and the measure of it."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from people_rig import COLS, ROWS, Someone, picture

from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.evaluation.metrics.ellipsoids import (
    LIMIT,
    NO_COVARIANCE,
    Place,
    coverage,
    place_of,
)
from rgbd_kcf_tracker.evaluation.place_tables import places_table
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.lens import Lens
from rgbd_kcf_tracker.metric.identity.body import Body, Placed
from rgbd_kcf_tracker.metric.identity.hidden_cloud import HiddenCloud
from rgbd_kcf_tracker.metric.identity.middle import HALF_CHEST, Belief, MiddleFilter, sighted
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.silhouette import Rim, Silhouette
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.simulation import simulate
from rgbd_kcf_tracker.track import Track, TrackState
from rgbd_kcf_tracker.variants import create_tracker

CAMERA = Intrinsics(200, 200, 120, 80)
RIM = Rim(0, 0, 0, 0)


def shown(depth: np.ndarray, left: int, top: int, mask: np.ndarray) -> tuple[DepthView, Silhouette]:
    view = DepthView(depth.astype(np.float32), 1, CAMERA)
    return view, Silhouette.of(view, left, top, mask, 1, RIM)


def ball(radius: float, z: float) -> tuple[DepthView, Silhouette]:
    """A ball straight ahead of the camera, before a wall."""
    rows, cols = np.mgrid[:160, :240]
    across, down = (cols - CAMERA.cx) / CAMERA.fx * z, (rows - CAMERA.cy) / CAMERA.fy * z
    away = across**2 + down**2
    inside = away < radius**2
    depth = np.where(inside, z - np.sqrt(np.clip(radius**2 - away, 0, None)), 5.0)
    r, c = np.flatnonzero(inside.any(1)), np.flatnonzero(inside.any(0))
    crop = inside[r[0] : r[-1] + 1, c[0] : c[-1] + 1]
    return shown(depth, int(c[0]), int(r[0]), crop)


def test_the_middle_of_a_ball_is_behind_its_surface_and_that_of_a_board_is_not() -> None:
    for radius in (0.1, 0.2):
        found = sighted(*ball(radius, 2.0))
        assert found is not None
        # behind a large ball only as far as behind a chest
        behind = min(0.7 * radius, HALF_CHEST) - 0.7 * radius
        assert found.position == pytest.approx([0, 0, 2.0 + behind], abs=0.025)
    depth = np.full((160, 240), 5.0)
    depth[50:90, 110:150] = 2.0
    flat = sighted(*shown(depth, 110, 50, np.ones((40, 40), np.bool_)))
    assert flat is not None
    assert flat.position == pytest.approx([0.095, -0.105, 2.0], abs=0.006)


def walk(
    rate: float, noise: float, seconds: float = 6.0, speed: float = 1.0
) -> tuple[MiddleFilter, np.ndarray]:
    """A filter that was told of somebody who walks across, and where he is at the end."""
    rng = np.random.default_rng(3)
    middle = MiddleFilter()
    place = np.array([0.0, 0.0, 3.0])
    for _ in range(round(seconds * rate)):
        middle.predict(1 / rate)
        place = place + np.array([speed / rate, 0, 0])
        middle.placed(place + noise * rng.standard_normal(3), np.zeros(3))
    return middle, place


@pytest.mark.parametrize('rate', [5.0, 30.0])
def test_place_and_velocity_of_a_walker_at_any_rate(rate: float) -> None:
    middle, place = walk(rate, 0.01)
    found = middle.belief()
    assert found is not None
    assert found.position == pytest.approx(place, abs=0.03)
    assert found.velocity == pytest.approx([1.0, 0.0, 0.0], abs=0.15)
    other = walk(15.0, 0.01)[0].belief()
    assert other is not None
    assert np.diag(found.velocity_covariance) == pytest.approx(
        np.diag(other.velocity_covariance), rel=0.35
    )


def test_more_frames_do_not_make_lasting_errors_smaller() -> None:
    found = walk(30.0, 0.0, seconds=60.0)[0].belief()
    assert found is not None
    assert np.sqrt(np.diag(found.covariance)).min() > 0.02


def test_a_camera_that_turns_takes_the_place_along() -> None:
    middle, _ = walk(10.0, 0.0)
    angle = 0.3
    turn = np.array(
        [[math.cos(angle), 0, -math.sin(angle)], [0, 1, 0], [math.sin(angle), 0, math.cos(angle)]]
    )
    before = middle.belief()
    middle.predict(1e-6, Pose(turn, np.array([0.1, 0.0, 0.0])))
    after = middle.belief()
    assert before is not None
    assert after is not None
    assert after.position == pytest.approx(turn @ before.position + [0.1, 0, 0], abs=1e-4)
    assert after.velocity == pytest.approx(turn @ before.velocity, abs=1e-4)


def test_what_is_believed_of_a_hidden_target_is_positive_definite_whatever_is_left() -> None:
    middle, _ = walk(10.0, 0.0)
    cloud = HiddenCloud(
        np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), 16, np.random.default_rng(1)
    )
    cloud._positions[:] = cloud._positions[0]
    cloud._velocities[:] = 0.0
    found = middle.hidden(cloud)
    for spread in (found.covariance, found.velocity_covariance):
        assert np.linalg.eigvalsh(spread).min() > 0


def test_a_lens_is_taken_out_of_place_velocity_and_covariance() -> None:
    lens = Lens((-0.2, 0.05, 0.0, 0.0, 0.0))
    camera = Intrinsics(500, 500, 320, 240, lens=lens)
    true = np.array([0.9, -0.4, 3.0])
    pinhole = Intrinsics(500, 500, 320, 240)

    def as_shown(point: np.ndarray) -> np.ndarray:
        return np.array(pinhole.deproject(*camera.project(*point), point[2]))

    speed, step = np.array([0.8, 0.1, -0.5]), 1e-4
    seen_speed = (as_shown(true + step * speed) - as_shown(true - step * speed)) / (2 * step)
    belief = Belief(as_shown(true), seen_speed, np.eye(3) * 0.01, np.eye(3) * 0.01)
    told = belief.through(lens)
    assert told is not None
    assert told.position == pytest.approx(true, abs=1e-6)
    assert told.velocity == pytest.approx(speed, abs=1e-3)
    assert np.linalg.eigvalsh(told.covariance).min() > 0
    assert belief.through(None) is belief
    # no ray of the lens comes from there, and what is behind the camera is in no picture
    for place in ([30.0, 0.0, 3.0], [0.0, 0.0, -1.0], [math.nan, 0.0, 3.0]):
        moved = dataclasses.replace(belief, position=np.array(place))
        assert moved.through(Lens((-0.3, 0.0, 0.0, 0.0, 0.0))) is None


def test_part_of_a_body_is_placed_by_what_is_remembered_of_the_whole() -> None:
    depth = np.full((160, 240), 5.0)
    depth[30:150, 100:140] = 2.0
    whole = shown(depth, 100, 30, np.ones((120, 40), np.bool_))
    body = Body(whole[1])
    middle = MiddleFilter()
    left, top, right, _ = whole[1].metres
    place = Placed(np.array([(left + right) / 2, top, 2.0]), np.full(3, 0.05), 1.0)
    middle.seen(*whole, place, body)
    before = middle.belief()
    nearer = depth.copy()
    nearer[80:160, 60:200] = 1.0
    part = shown(nearer, 100, 30, np.ones((50, 40), np.bool_))
    assert part[1].cut.bottom
    for _ in range(20):
        middle.predict(0.1)
        middle.seen(*part, place, body)
    after = middle.belief()
    assert before is not None
    assert after is not None
    assert after.position == pytest.approx(before.position, abs=0.02)
    assert after.covariance[1, 1] > before.covariance[1, 1]


# -- tracks ---------------------------------------------------------------------------------------


def followed(predict_for: float) -> list[Track]:
    scene = simulate('long_occlusion', 502, rate_hz=10, size=(480, 270))
    tracker = create_tracker('metric', MetricParameters(predict_for=predict_for))
    tracks: list[Track] = []
    for moment in scene:
        if not tracks and moment.visible is None:
            continue
        if not tracks:
            tracks.append(tracker.start(moment.frame, moment.visible))
        else:
            tracks.append(tracker.update(moment.frame))
    return tracks


def test_a_prediction_ends_after_its_time_and_everything_told_is_positive_definite() -> None:
    tracks = followed(1.0)
    since, ended = 0, False
    for track in tracks:
        since = 0 if track.box is not None else since + 1
        if track.box is None:
            assert (track.predicted is not None) == (since <= 10)
            ended = ended or since > 10
        for spread in (track.covariance, track.velocity_covariance):
            assert (spread is None) == (track.covariance is None)
            if spread is not None:
                assert np.linalg.eigvalsh(np.array(spread).reshape(3, 3)).min() > 0
    assert ended
    assert any(track.predicted is not None for track in tracks)
    boxes = [track.box for track in followed(0.0)]
    assert boxes == [track.box for track in tracks]


def test_without_intrinsics_nothing_is_said_in_metres() -> None:
    scene = simulate('normal', 3, rate_hz=10, duration_s=0.5, size=(320, 180))
    tracker = create_tracker('metric')
    for number, moment in enumerate(scene):
        frame = dataclasses.replace(moment.frame, intrinsics=None)
        if number == 0:
            assert moment.visible is not None
            track = tracker.start(frame, moment.visible)
        else:
            track = tracker.update(frame)
        assert track.position is None
        assert track.covariance is None
        assert track.velocity is None
        assert track.predicted is None
    empty = np.full((180, 320), np.nan, np.float32)
    blank = Frame(np.zeros((180, 320, 3), np.uint8), empty, frame.stamp_ns + 10**8)
    assert tracker.update(blank).predicted is None


# -- the measure ----------------------------------------------------------------------------------


def test_a_calibrated_covariance_holds_95_percent() -> None:
    rng = np.random.default_rng(7)
    shape = rng.standard_normal((3, 3))
    spread = shape @ shape.T + 0.1 * np.eye(3)
    root = np.linalg.cholesky(spread)
    places = []
    for _ in range(4000):
        true = root @ rng.standard_normal(3)
        speed = root @ rng.standard_normal(3) * 2
        track = Track(
            Box(0, 0, 1, 1),
            TrackState.TRACKING,
            position=(0.0, 0.0, 0.0),
            velocity=(0.0, 0.0, 0.0),
            covariance=tuple(spread.ravel()),
            velocity_covariance=tuple(spread.ravel()),
        )
        place = place_of(track, tuple(true), tuple(speed))
        assert place is not None
        places.append(place)
    found = coverage(places)
    assert found.inside == pytest.approx(0.95, abs=0.015)
    # errors of twice the deviation: 41.8 % of a chi variable of three lie below half of 2.795
    assert found.speed_inside == pytest.approx(0.418, abs=0.03)
    assert found.error == pytest.approx(np.sqrt(np.trace(spread)), rel=0.05)


def test_what_was_not_said_does_not_count_and_what_is_no_covariance_holds_nothing() -> None:
    hidden = Track(None, TrackState.OCCLUDED)
    assert place_of(hidden, (0, 0, 1), None) is None
    told = dataclasses.replace(hidden, predicted=(0.0, 0.0, 1.0), covariance=(0.0,) * 9)
    place = place_of(told, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    assert place is not None
    assert (place.hidden, place.distance) == (True, NO_COVARIANCE)
    assert json.loads(json.dumps(place.distance)) > LIMIT, 'a report keeps it'
    assert place_of(told, None, None) is None
    assert math.isnan(coverage([]).inside)
    assert math.isnan(coverage([place]).speed_inside)
    assert places_table({}) is None
    table = places_table(
        {
            ('a', 's'): [
                place,
                Place(False, False, 0.1, LIMIT / 2, 0.2, LIMIT * 2),
                Place(False, True, 9.0, 99.0),
            ]
        }
    )
    assert table is not None
    assert [row[0] for row in table.rows] == ['a, seen', 'a, hidden', 'a, astray', 'a, all']
    assert table.rows[0][2:] == (100.0, pytest.approx(10.0), 0.0, pytest.approx(20.0))
    assert 'Astray: ' in table.note
    table = places_table({('a', 's'): [place]})
    assert table is not None
    assert 'Astray' not in table.note, 'of which there is no row'


def test_the_truth_of_a_velocity_is_that_of_the_places() -> None:
    scene = simulate('camera_motion', 4, rate_hz=30, duration_s=1.0, size=(160, 90))
    places = []
    for index in range(len(scene)):
        rotation, place = scene.camera_pose(index)
        places.append(rotation @ np.array(scene.truth(index).position) + place)
    for index in (5, 15, 25):
        rotation, _ = scene.camera_pose(index)
        over_ground = (places[index + 1] - places[index - 1]) * 15
        assert rotation @ np.array(scene.velocity(index)) == pytest.approx(over_ground, abs=0.05)


def test_a_report_says_how_many_places_lie_inside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / 'report'
    assert main([
        'evaluate', 'sim:occlusion', '--seeds', '3', '--rate', '5', '--size', '320x180',
        '--variants', 'metric,kcf', '--jobs', '1', '--report', str(report),
    ]) == 0  # fmt: skip
    said = capsys.readouterr().out
    assert 'Places in metres' in said
    assert 'metric, seen' in said
    assert 'metric, hidden' in said
    assert 'kcf, seen' not in said
    assert (report / 'tables' / 'places.csv').is_file()
    assert 'Places in metres' in (report / 'index.html').read_text(encoding='utf-8')


@pytest.mark.parametrize('depth', [True, False])
def test_a_hidden_target_may_be_the_farther_off_the_longer_it_is_not_read(depth: bool) -> None:
    tracker = create_tracker('metric', MetricParameters(use_look=False))
    one, spreads = Someone(0.1, 3.0), []
    for i in range(20):
        frame = picture([one], 0.1 * i)
        if i >= 6:  # a board over all of it
            frame = dataclasses.replace(frame, depth=np.full((ROWS, COLS), 0.8, np.float32))
        if i >= 8 and not depth:
            frame = dataclasses.replace(frame, depth=None)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
        if i >= 7:
            spreads.append(float(np.sqrt(np.trace(np.reshape(track.covariance, (3, 3))))))
    assert spreads[-1] > 2 * spreads[0]
    assert (np.diff(spreads) > 0).mean() > 0.8
