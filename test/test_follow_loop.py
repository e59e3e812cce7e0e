# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A closed loop: a simulated robot with a simulated camera drives by what the tracker says.

Who drives here is a few lines that stand for Nav2's Following Server: towards the target's pose,
1.5 m short of it, and not at all without a pose.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.simulation import kinect2_intrinsics
from rgbd_kcf_tracker.simulation.motion import CameraMotion
from rgbd_kcf_tracker.simulation.sequence import SimulatedFrame, SimulatedSequence
from rgbd_kcf_tracker.simulation.stage import Stage, route
from rgbd_kcf_tracker.track import Track
from rgbd_kcf_tracker.variants import create_tracker

SIZE = (320, 180)
RATE = 10.0
DISTANCE = 1.5
FASTEST, FASTEST_TURN = 1.2, 1.2
HEIGHT = 1.0


@dataclass
class Robot:
    """A differential drive on the floor; its camera looks ahead."""

    x: float = 0.0
    z: float = 0.0
    yaw: float = 0.0

    def drive(self, linear: float, turn: float, dt: float) -> None:
        self.yaw += turn * dt
        self.x += math.sin(self.yaw) * linear * dt
        self.z += math.cos(self.yaw) * linear * dt

    @property
    def turned(self) -> np.ndarray:
        """From the room to the camera."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])

    @property
    def place(self) -> np.ndarray:
        return np.array([self.x, -HEIGHT, self.z])

    @property
    def pose(self) -> Pose:
        return Pose(self.turned.T, self.place)


@dataclass(frozen=True)
class OnBoard(CameraMotion):
    """The camera of a robot, wherever that is now."""

    robot: Robot = field(default_factory=Robot)

    @property
    def fixed(self) -> bool:
        return False

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        return self.robot.turned, self.robot.place


def world(robot: Robot) -> SimulatedSequence:
    """Somebody walks through a room; two others cross between him and who is behind him."""
    camera = kinect2_intrinsics(SIZE)
    stage = Stage(np.random.default_rng(12), camera, SIZE)
    stage.depth, stage.half_width = 9.0, 4.5
    speed = 0.6
    walk = route([(0.0, 1.9), (0.3, 4.6), (2.2, 5.4)], speed)
    target = stage.walk(stage.person(), walk)

    def crossing(at: float, pace: float, gap: float) -> list[tuple[float, float, float]]:
        """Past the line from the robot to the target, ``gap`` metres before him."""
        times, xs, zs = (np.array(v) for v in zip(*walk, strict=True))
        x, z = np.interp(at, times, xs), np.interp(at, times, zs) - gap
        return [(at - 3.0, x - 3.0 * pace, z), (at + 3.0, x + 3.0 * pace, z)]

    others = [
        stage.walk(stage.tall_person(), crossing(2.6, 0.9, 0.85)),
        stage.walk(stage.tall_person(), crossing(5.4, -0.7, 0.85)),
    ]
    scene = stage.scene(
        [target, *others],
        walk[-1][0],
        room=stage.room((0, 1)),
        camera=OnBoard(HEIGHT, 0.0, robot=robot),
    )
    offsets = [round(k * 1e9 / RATE) for k in range(int(scene.duration_s * RATE))]
    return SimulatedSequence(scene, 'follow', 3, RATE, offsets, SIZE, camera)


def velocity(where: tuple[float, float, float] | None) -> tuple[float, float]:
    """What stands for the Following Server: metres and radians per second towards a place."""
    if where is None:
        return 0.0, 0.0
    x, _, z = where
    bearing = math.atan2(x, z)
    ahead = (math.hypot(x, z) - DISTANCE) * 1.5
    linear = min(max(ahead, 0.0), FASTEST) * max(math.cos(bearing), 0.0)
    return linear, min(max(2.0 * bearing, -FASTEST_TURN), FASTEST_TURN)


def told(track: Track) -> tuple[float, float, float] | None:
    """What ``~/pose`` says: where the target is seen, or for a while believed to be."""
    return track.predicted if track.box is None else track.position


@dataclass
class Ride:
    """What happened on the way."""

    distances: list[float] = field(default_factory=list)
    hidden: list[bool] = field(default_factory=list)
    strangers: list[int] = field(default_factory=list)

    def note(self, moment: SimulatedFrame, box: Box | None) -> None:
        x, _, z = moment.truth.position
        self.distances.append(math.hypot(x, z))
        self.hidden.append(moment.visible is None)
        if box is not None and moment.visible is not None and not box.intersection(moment.visible):
            self.strangers.append(len(self.hidden) - 1)

    def went_well(self, robot: Robot) -> None:
        gone = [i for i in range(1, len(self.hidden)) if self.hidden[i] and not self.hidden[i - 1]]
        assert len(gone) == 2, gone
        assert not self.strangers
        settled = self.distances[int(2.0 * RATE) :]
        assert min(settled) > DISTANCE - 0.4, min(settled)
        assert max(settled) < DISTANCE + 0.7, max(settled)
        assert robot.z > 2.0


def test_a_robot_keeps_its_distance_behind_somebody_through_two_occlusions() -> None:
    robot, ride = Robot(), Ride()
    sequence = world(robot)
    tracker = create_tracker('metric')
    track: Track | None = None
    for index in range(len(sequence)):
        moment = sequence[index]
        frame = replace(moment.frame, pose=robot.pose)
        if track is None:
            assert moment.visible is not None
            track = tracker.start(frame, moment.visible)
        else:
            track = tracker.update(frame)
        ride.note(moment, track.box)
        robot.drive(*velocity(told(track)), 1 / RATE)
    ride.went_well(robot)
    assert track is not None
    assert track.box is not None


@pytest.mark.ros
@pytest.mark.timeout(180)
def test_the_same_with_the_node_over_dds() -> None:
    """What drives hears the node alone, which is not told how the camera moves."""
    pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")
    from geometry_msgs.msg import PoseStamped
    from ros_rig import Rig, running_node
    from sensor_msgs.msg import CameraInfo

    robot, ride = Robot(), Ride()
    sequence = world(robot)
    k = sequence.intrinsics
    rig = Rig()
    heard: list[Any] = []
    rig.node.create_subscription(PoseStamped, '/tracker/pose', heard.append, 10)
    try:
        with running_node(rig):
            info = CameraInfo(header=rig.header(0), width=SIZE[0], height=SIZE[1])
            info.k = [k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0]
            for index in range(len(sequence)):
                moment = sequence[index]
                depth = moment.frame.depth
                assert depth is not None
                before = len(heard)
                if index == 0:
                    assert moment.visible is not None
                    rig.send_init(moment.visible)
                    # Who listens to the pose, and whose camera it is, may be known a picture later.
                    for again in range(2):
                        rig.info.publish(info)
                        rig.send_images(again, moment.frame.color, depth)
                        with contextlib.suppress(AssertionError):
                            rig.wait(lambda: len(heard) > 0, timeout=5.0)
                            break
                else:
                    rig.info.publish(info)
                    rig.send_images(3 * index, moment.frame.color, depth)
                box = rig.box()
                ride.note(moment, box)
                # Seen, or believed to be there: a pose a picture. None comes for long absences.
                if box is not None or sum(ride.hidden[-20:]) < 20:
                    rig.wait(lambda before=before: len(heard) > before, what='pose')
                p = heard[-1].pose.position if len(heard) > before else None
                robot.drive(*velocity(None if p is None else (p.x, p.y, p.z)), 1 / RATE)
    finally:
        rig.close()
    ride.went_well(robot)
