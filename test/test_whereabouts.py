# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where targets are in space and where they walk, in whatever frame."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rgbd_kcf_tracker import Box, Intrinsics, Track, TrackState
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.recordings.bag_types import BAG_TYPES
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages
from rgbd_kcf_tracker.recordings.whereabouts import UNKNOWN_HEADING, Walks

CAMERA = Intrinsics(500, 500, 320, 240)
BOX = Box(300, 200, 50, 150)
MAKE = TrackMessages(BAG_TYPES)
HEADER = MAKE.header(5, 'camera')
SECOND = 1_000_000_000
# A level camera's optical frame in a frame with x ahead, y left, z up.
LEVEL = Rotation.from_matrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])


def seen(
    position: tuple[float, float, float] = (0.0, 0.0, 3.0),
    velocity: tuple[float, float, float] | None = None,
    sigma: float = 0.1,
    number: int = 0,
) -> Track:
    certain = None if velocity is None else tuple(np.diag([sigma**2] * 3).ravel())
    return Track(
        BOX, TrackState.TRACKING, 0.9, position[2], position, number, velocity,
        covariance=tuple(np.diag([0.01, 0.02, 0.09]).ravel()), velocity_covariance=certain,
    )  # fmt: skip


def test_forward_is_along_the_walk_and_kept_while_standing() -> None:
    walks = Walks()
    where = walks.update([seen()], 0)[0]
    assert where.forward == pytest.approx((0, 0, 1))  # away from the camera
    assert where.heading_sigma == UNKNOWN_HEADING
    where = walks.update([seen(velocity=(-1.0, 0.4, 0.0))], SECOND)[0]
    assert where.forward == pytest.approx((-1, 0, 0))  # level, whatever it goes up or down
    assert where.heading_sigma == pytest.approx(0.1, rel=0.01)
    where = walks.update([seen(velocity=(0.05, 0.0, 0.1))], 2 * SECOND)[0]
    assert where.forward == pytest.approx((-1, 0, 0))
    assert where.heading_sigma == UNKNOWN_HEADING
    where = walks.update([seen(velocity=(1.0, 0.0, 0.0), sigma=2.0)], 3 * SECOND)[0]
    assert where.forward == pytest.approx((-1, 0, 0))  # not sure enough
    assert walks.update([], 4 * SECOND) == {}
    assert walks.update([seen()], 5 * SECOND)[0].forward == pytest.approx((0, 0, 1))


def test_hidden_targets_are_predicted_and_age() -> None:
    walks = Walks()
    hidden = Track(None, TrackState.OCCLUDED, id=4, predicted=(1.0, 0.0, 3.0))
    assert walks.update([hidden], 0)[4].hidden_s == math.inf
    walks.update([seen(number=4)], SECOND)
    where = walks.update([hidden], 3 * SECOND)[4]
    assert (where.predicted, where.hidden_s) == (True, 2.0)
    assert where.size is None
    assert MAKE.position(HEADER, where) is None
    assert walks.update([Track(None, TrackState.LOST, id=4)], 4 * SECOND) == {}
    assert walks.update([hidden], 5 * SECOND)[4].hidden_s == 4.0
    broken = Track(BOX, TrackState.TRACKING, 1.0, None, (math.nan, 0.0, 1.0))
    assert walks.update([broken], 6 * SECOND) == {}


def test_who_is_seen_and_not_read_is_predicted_and_does_not_age() -> None:
    unread = Track(BOX, TrackState.TRACKING, 0.9, None, id=4, predicted=(1.0, 0.0, 3.0))
    where = Walks().update([unread], SECOND, CAMERA)[4]
    assert (where.predicted, where.hidden_s, where.size) == (True, 0.0, None)
    assert where.position == pytest.approx(unread.predicted)
    assert MAKE.position(HEADER, where) is None


def test_a_camera_that_turns_does_not_turn_what_stands() -> None:
    """A base turns left by 10 degrees a frame while somebody stops."""
    walks = Walks()
    velocity: tuple[float, float, float] | None = (1.0, 0.0, 0.0)
    for number in range(5):
        base = Rotation.from_euler('z', 10 * number, degrees=True)
        pose = Pose((base * LEVEL).as_matrix(), np.array([0.5, 0.2 * number, 1.2]))
        person = pose.inverse.of(np.array([3.0, 1.0, 1.0]))
        x, y, z = (float(v) for v in person)
        where = walks.update([seen((x, y, z), velocity)], number * SECOND, CAMERA, pose)[0]
        velocity = None
        fixed = where.seen_from(pose)
        assert fixed.position == pytest.approx((3.0, 1.0, 1.0))
        assert fixed.forward == pytest.approx((0, -1, 0))
        assert fixed.trail == pytest.approx(np.tile([3.0, 1.0, 1.0], (number + 1, 1)))
        assert where.up == pytest.approx((0, -1, 0))
    assert walks.update([seen()], 9 * SECOND, CAMERA)[0].forward == pytest.approx((0, 0, 1))


def test_messages_in_another_frame_are_the_same_place() -> None:
    """What the pose messages say in the camera's frame and in the base's is one thing."""
    base = Pose((Rotation.from_euler('y', 20, degrees=True) * LEVEL).as_matrix(), np.ones(3))
    track = seen((0.4, 0.1, 2.5), (0.3, 0.0, 0.8))
    here = Walks().update([track], 0, CAMERA)[0]
    there = here.seen_from(base)
    point = MAKE.position(HEADER, there).point
    assert (point.x, point.y, point.z) == pytest.approx(base.of(np.array([0.4, 0.1, 2.5])))
    pose = MAKE.pose(HEADER, there).pose.orientation
    axes = Rotation.from_quat([pose.x, pose.y, pose.z, pose.w]).as_matrix()
    assert axes[:, 2] == pytest.approx((0, 0, 1))
    walk = base.rotation @ np.array([0.3, 0.0, 0.8])
    assert axes[:2, 0] == pytest.approx(walk[:2] / np.hypot(*walk[:2]))
    both = MAKE.pose_with_covariance(HEADER, there).pose.covariance.reshape(6, 6)
    turn = base.rotation
    assert both[:3, :3] == pytest.approx(turn @ np.diag([0.01, 0.02, 0.09]) @ turn.T)
    assert both[5, 5] == pytest.approx(there.heading_sigma**2)
    assert np.linalg.eigvalsh(both)[0] > 0
    twist = MAKE.twist(HEADER, there).twist
    linear = twist.twist.linear
    assert (linear.x, linear.y, linear.z) == pytest.approx(turn @ np.array([0.3, 0.0, 0.8]))
    assert np.linalg.eigvalsh(twist.covariance.reshape(6, 6))[0] > 0
    marker = MAKE.marker(HEADER, there)
    assert (marker.scale.x, marker.scale.y) == pytest.approx((0.25, 0.75))
    turned = marker.pose.orientation
    assert Rotation.from_quat(
        [turned.x, turned.y, turned.z, turned.w]
    ).as_matrix() == pytest.approx(turn)


def test_what_is_not_known_is_not_said() -> None:
    track = Track(BOX, TrackState.TRACKING, 0.9, 3.0, (0.0, 0.0, 3.0))
    where = Walks().update([track], 0)[0]
    assert MAKE.pose_with_covariance(HEADER, where) is None
    assert MAKE.twist(HEADER, where) is None
    assert MAKE.marker(HEADER, where).action == 2
    assert MAKE.pose(HEADER, where).pose.position.z == 3.0


def test_quaternions_are_those_of_scipy() -> None:
    turns = [*Rotation.random(200, random_state=1)]
    turns += [Rotation.from_rotvec(math.pi * axis) for axis in np.eye(3)]  # w is 0
    turns += [Rotation.from_rotvec([0.0, 0.0, 0.0]), Rotation.from_rotvec([3.1, 0.01, 0.0])]
    for turn in turns:
        x, y, z, w = (float(v) for v in turn.as_quat())
        pose = Pose.from_quaternion((x, y, z, w), (1.0, 2.0, 3.0))
        assert pose.rotation == pytest.approx(turn.as_matrix(), abs=1e-12)
        again = Rotation.from_quat(pose.quaternion)
        assert (again * turn.inv()).magnitude() < 1e-7
    with pytest.raises(ParameterError, match='has the length 0'):
        Pose.from_quaternion((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(ParameterError, match='length nan'):
        Pose.from_quaternion((math.nan, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    for far in (-1e10, 1.7e308, math.inf):
        with pytest.raises(ParameterError, match=r'is farther than 1e\+09 m'):
            Pose.from_quaternion((0.0, 0.0, 0.0, 1.0), (0.0, far, 0.0))
    with pytest.raises(ParameterError, match='not finite'):
        Pose.from_quaternion((0.0, 0.0, 0.0, 1.0), (0.0, math.nan, 0.0))
