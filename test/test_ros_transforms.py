# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Results in other frames, and targets as frames: TF that fits, and TF that must not be believed.

With the real tf2_ros where it is installed. It is not on the package index: elsewhere a stand-in
carries single transforms over the same topics.
"""

from __future__ import annotations

import importlib
import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from ros_rig import FRAME_ID, PERIOD_NS, START_NS, Rig, box_text, running_node, scene, stamp_of
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, RegionOfInterest
from stand_ins import tf2_ros

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.live.settings import NodeParameters
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.recordings.messages import stamp_of as stamp
from rgbd_kcf_tracker.ros.messages import stamp_from_ns
from rgbd_kcf_tracker.simulation import kinect2_intrinsics, simulate

pytestmark = pytest.mark.ros

REAL = importlib.util.find_spec('tf2_ros') is not None
TF_MESSAGE = importlib.import_module('tf2_msgs.msg').TFMessage if REAL else TransformStamped

# The optical frame in one with x ahead, y left, z up, 1.2 m above the ground.
MOUNTED = Pose(np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]), np.array([0.1, 0.0, 1.2]))


class Base:
    """A robot's TF."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._moving = rig.node.create_publisher(TF_MESSAGE, '/tf', 100)
        self._still = rig.node.create_publisher(TF_MESSAGE, '/tf_static', latched)

    def listened(self) -> None:
        both = (self._moving, self._still)
        self._rig.wait(lambda: all(p.get_subscription_count() for p in both), what='TF listener')

    def mount(self, pose: Pose = MOUNTED) -> None:
        self.fix('base_link', pose)

    def fix(self, parent: str, pose: Pose) -> None:
        """The camera, as it always is in a frame."""
        self._still.publish(packed(transform(parent, FRAME_ID, 0, pose)))

    def stand(self, stamp_ns: int, x: float = 0.0, turn: float = 0.0) -> None:
        rotation = Rotation.from_euler('z', turn, degrees=True).as_matrix()
        pose = Pose(rotation, np.array([x, 0.0, 0.0]))
        self._moving.publish(packed(transform('odom', 'base_link', stamp_ns, pose)))


def packed(transform: TransformStamped) -> Any:
    return TF_MESSAGE(transforms=[transform]) if REAL else transform


def unpacked(message: Any) -> list[TransformStamped]:
    return list(message.transforms) if REAL else [message]


def transform(parent: str, child: str, stamp_ns: int, pose: Pose) -> TransformStamped:
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id, made.header.stamp = parent, stamp_from_ns(stamp_ns)
    shift, turn = made.transform.translation, made.transform.rotation
    shift.x, shift.y, shift.z = (float(v) for v in pose.translation)
    turn.x, turn.y, turn.z, turn.w = pose.quaternion
    return made


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    if not REAL:
        monkeypatch.setitem(sys.modules, 'tf2_ros', tf2_ros())
    made = Rig()
    yield made
    made.close()


def settled(rig: Rig, node: Any, frame: str, stamp_ns: int = 0) -> None:
    """Until the node knows the camera in a frame, up to a time."""
    ask = node._transforms._buffer.lookup_transform_core

    def known() -> bool:
        with suppress(Exception):
            return stamp(ask(frame, FRAME_ID, Time())) >= stamp_ns
        return False

    rig.wait(known, what=f'{frame} in TF')


def test_results_go_out_in_the_base(rig: Rig) -> None:
    poses: list[PoseStamped] = []
    rig.node.create_subscription(PoseStamped, '/tracker/pose', poses.append, 100)
    base = Base(rig)
    with running_node(
        rig, queue_policy='all', init_box=box_text(), target_frame='base_link'
    ) as node:
        base.listened()
        base.mount()
        settled(rig, node, 'base_link')
        rig.wait(lambda: node._outputs.wanted('pose'))
        rig.play(range(6))
        rig.wait(lambda: len(poses) >= 6)
    at = rig.positions[-1]
    assert at.header.frame_id == 'base_link'
    assert at.header.stamp == rig.boxes[-1].header.stamp
    assert rig.boxes[-1].header.frame_id == FRAME_ID
    assert at.point.x == pytest.approx(2.1, abs=0.05)
    assert at.point.z == pytest.approx(1.2 - (119.5 - 120) * 2 / 290, abs=0.1)
    assert poses[-1].header == at.header
    turn = poses[-1].pose.orientation
    axes = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
    assert axes[:, 2] == pytest.approx((0, 0, 1))


def test_a_frame_that_nobody_publishes_pauses_what_is_in_it_and_nothing_else(rig: Rig) -> None:
    with running_node(rig, queue_policy='all', init_box=box_text(), target_frame='map') as node:
        rig.play(range(5))
        values = rig.fresh_values()
        assert rig.box().iou(scene(4)[2]) > 0.6
        assert rig.positions == []
        assert int(values['tf_missing']) == 5
        assert values['last_error'].endswith("outputs in 'map' pause")
        base = Base(rig)
        base.listened()
        base.fix('map', MOUNTED)
        settled(rig, node, 'map')
        rig.play([5])
        rig.wait(lambda: len(rig.positions) == 1, what='a position')
        assert rig.positions[0].header.frame_id == 'map'


def test_late_tf_pauses_and_a_little_late_is_waited_for(rig: Rig) -> None:
    base = Base(rig)
    with running_node(
        rig, queue_policy='all', init_box=box_text(), target_frame='odom', tf_wait=0.5
    ) as node:
        base.listened()
        base.mount()
        base.stand(stamp_of(0) - 5_000_000_000)
        base.stand(stamp_of(0))
        settled(rig, node, 'odom', stamp_of(0))
        rig.play([0])
        rig.wait(lambda: len(rig.positions) == 1)
        # TF stands 4 s behind: nothing in odom, at once and not after tf_wait.
        late = 120
        rig.play([late])
        assert len(rig.positions) == 1
        assert rig.box().iou(scene(late)[2]) > 0.6
        values = rig.fresh_values()
        assert int(values['tf_late']) == 1
        assert 's behind the images' in values['last_error']
        # It comes 0.1 s late, after the image: waited for.
        base.stand(stamp_of(late + 1) - 100_000_000, 0.05)
        settled(rig, node, 'odom', stamp_of(late + 1) - 100_000_000)
        before = len(rig.boxes)
        rig.send(late + 1)
        base.stand(stamp_of(late + 1) + PERIOD_NS, 0.06)
        rig.wait(lambda: len(rig.boxes) > before)
        rig.wait(lambda: len(rig.positions) == 2, what='the position that waited')
        assert stamp(rig.positions[-1]) == stamp_of(late + 1)


def test_stamps_that_tf_has_forgotten_pause(rig: Rig) -> None:
    base = Base(rig)
    with running_node(rig, queue_policy='all', init_box=box_text(), target_frame='odom') as node:
        base.listened()
        base.mount()
        base.stand(stamp_of(0) + 20_000_000_000)
        base.stand(stamp_of(0) + 21_000_000_000)
        settled(rig, node, 'odom', stamp_of(0) + 21_000_000_000)
        rig.play(range(3))
        assert rig.positions == []
        values = rig.fresh_values()
        assert int(values['tf_old']) == 3
        assert 'older than what TF remembers' in values['last_error']


@pytest.mark.parametrize(
    ('start_ns', 'why'), [(0, 'images have no stamp'), (-5_000_000_000, 'of this stamp')]
)
def test_stamps_that_are_none_pause_and_are_answered(rig: Rig, start_ns: int, why: str) -> None:
    """To TF, zero is the newest."""
    base = Base(rig)
    with running_node(rig, queue_policy='all', init_box=box_text(), target_frame='odom') as node:
        base.listened()
        base.mount()
        base.stand(stamp_of(0))
        settled(rig, node, 'odom', stamp_of(0))
        rig.send(0, stamp_ns=start_ns)
        rig.wait(lambda: bool(rig.boxes), what='an answer')
        values = rig.fresh_values()
        assert rig.box().iou(scene(0)[2]) > 0.6
        assert rig.positions == []
        assert int(values['tf_missing']) == 1
        assert why in values['last_error']


def test_tf_that_jumps_is_left_out_where_it_jumps(rig: Rig) -> None:
    base = Base(rig)
    with running_node(rig, queue_policy='all', init_box=box_text(), target_frame='odom') as node:
        base.listened()
        base.mount()
        for index in range(10):
            base.stand(stamp_of(index), x=0.01 * index + (3.0 if index >= 5 else 0.0))
        settled(rig, node, 'odom', stamp_of(9))
        rig.play(range(10))
        rig.wait(lambda: stamp(rig.positions[-1]) == stamp_of(9))
    assert [stamp(p) for p in rig.positions] == [stamp_of(i) for i in range(10) if i != 5]
    assert rig.positions[4].point.x == pytest.approx(2.14, abs=0.05)
    assert rig.positions[5].point.x == pytest.approx(5.16, abs=0.05)
    assert len(rig.boxes) == 10


def test_tf_that_is_farther_than_any_robot_pauses(rig: Rig) -> None:
    """It overflowed: an internal error, with each image."""
    base = Base(rig)
    with running_node(
        rig, queue_policy='all', init_box=box_text(), target_frame='odom', fixed_frame='odom'
    ) as node:
        base.listened()
        base.mount()
        for index in range(5):
            base.stand(stamp_of(index), x=1.7e308, turn=30.0 * index)
        settled(rig, node, 'odom', stamp_of(4))
        rig.play(range(5))
        assert rig.positions == []
        assert rig.box().iou(scene(4)[2]) > 0.6
        values = rig.fresh_values()
        assert int(values['tf_missing']) == 5
        assert 'is farther than 1e+09 m' in values['last_error']
        assert 'internal_errors' not in values


@pytest.mark.parametrize(('scenario', 'stuck'), [('camera_motion', True), ('normal', False)])
def test_a_camera_that_moves_while_tf_stands_still_is_noticed(
    rig: Rig, scenario: str, stuck: bool
) -> None:
    base = Base(rig)
    size = (320, 180)
    k = kinect2_intrinsics(size)
    with running_node(
        rig, queue_policy='all', target_frame='odom', fixed_frame='odom', depth_wait=2.0
    ) as node:
        base.listened()
        base.mount()
        base.stand(START_NS)
        base.stand(START_NS + 100_000_000_000)
        settled(rig, node, 'odom', START_NS + 100_000_000_000)
        for index, moment in enumerate(simulate(scenario, seed=1, rate_hz=15, size=size)):
            if index == 45:
                break
            info = CameraInfo(header=rig.header(2 * index), width=size[0], height=size[1])
            info.k = [k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0]
            rig.info.publish(info)
            if index == 1:
                box = moment.visible
                rig.init.publish(
                    RegionOfInterest(
                        x_offset=int(box.x), y_offset=int(box.y),
                        width=int(box.width), height=int(box.height),
                    )
                )  # fmt: skip
                rig.wait(lambda: node._session.following or node._session.due)
            rig.send_images(2 * index, moment.frame.color, moment.frame.depth)
        values = rig.fresh_values()
    assert ('tf_stands_still' in values) == stuck
    if stuck:
        assert "stands still in 'odom'" in values['last_error']
        assert stamp(rig.positions[-1]) < stamp(rig.boxes[-1])
        assert any(len(box.polygon.points) for box in rig.boxes[-10:])


def test_targets_are_frames(rig: Rig) -> None:
    heard: list[TransformStamped] = []
    base = Base(rig)
    rig.node.create_subscription(TF_MESSAGE, '/tf', lambda m: heard.extend(unpacked(m)), 100)
    add = rig.node.create_publisher(RegionOfInterest, '/tracker/add', 10)
    with running_node(
        rig, queue_policy='all', init_box=box_text(), target_frame='base_link', publish_tf='all',
        tf_name='person', pose_prediction=0.1,
    ) as node:  # fmt: skip
        base.listened()
        base.mount()
        settled(rig, node, 'base_link')
        rig.wait(lambda: add.get_subscription_count() > 0)
        rig.play(range(3))
        add.publish(RegionOfInterest(x_offset=240, y_offset=60, width=60, height=60))
        rig.wait(lambda: len(node._session.others) == 1)
        rig.play(range(3, 5))
        rig.wait(lambda: len(heard) >= 7, what='frames')
        assert [t.child_frame_id for t in heard[-2:]] == ['person', 'person_2']
        last = heard[-2]
        assert last.header == rig.positions[-1].header
        at = rig.positions[-1].point
        shift = last.transform.translation
        assert (shift.x, shift.y, shift.z) == (at.x, at.y, at.z)
        node._session.reset()
        count = len(heard)
        rig.play(range(5, 7))
        assert len(heard) == count
        publishers = rig.node.count_publishers('/tf')
        for _ in range(2):  # a cycle leaves no publisher behind
            node.trigger_deactivate()
            node.trigger_cleanup()
            node.trigger_configure()
            node.trigger_activate()
        rig.wait(lambda: rig.node.count_publishers('/tf') == publishers)


@pytest.mark.parametrize('name', ['', 'base_link', 'odom'])
def test_a_target_has_a_frame_of_its_own_name(name: str) -> None:
    frames = {'target_frame': 'base_link', 'fixed_frame': 'odom', 'tf_name': name}
    NodeParameters(**frames)
    with pytest.raises(ParameterError, match=f"tf_name is '{name}': give"):
        NodeParameters(**frames, publish_tf='all')


def test_no_target_takes_the_frame_of_the_images(
    rig: Rig, capfd: pytest.CaptureFixture[str]
) -> None:
    heard: list[TransformStamped] = []
    rig.node.create_subscription(TF_MESSAGE, '/tf', lambda m: heard.extend(unpacked(m)), 100)
    with running_node(
        rig, queue_policy='all', init_box=box_text(), publish_tf='target', tf_name=FRAME_ID
    ):
        rig.wait(lambda: rig.node.count_publishers('/tf') > 0)
        rig.play(range(5))
        rig.wait(lambda: len(rig.positions) >= 5)
    assert not heard
    assert capfd.readouterr().err.count('is the frame of the images') == 1


@pytest.mark.skipif(REAL, reason='tf2_ros is installed')
@pytest.mark.parametrize(
    'parameter', ['target_frame:=base_link', 'fixed_frame:=odom', 'publish_tf:=target']
)
def test_without_tf2_the_node_says_what_to_install(parameter: str) -> None:
    done = subprocess.run(
        [sys.executable, '-m', 'rgbd_kcf_tracker.ros.tracker_main', '--ros-args', '-p', parameter],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    name = parameter.partition(':')[0]
    assert f'parameter {name} needs tf2_ros' in done.stderr
    assert 'apt install ros-jazzy-tf2-ros-py' in done.stderr
    assert 'Traceback' not in done.stderr
