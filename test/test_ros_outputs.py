# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the node says beyond the box: state, pose, velocity, markers, over real DDS."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from geometry_msgs.msg import (
    PoseStamped,
    PoseWithCovarianceStamped,
    TwistWithCovarianceStamped,
)
from ros_rig import Rig, running_node, scene
from scipy.spatial.transform import Rotation

from rgbd_kcf_tracker.ros.messages import stamp_to_ns

pytestmark = pytest.mark.ros


@pytest.fixture
def rig() -> Iterator[Rig]:
    made = Rig()
    yield made
    made.close()


def box_text(index: int = 0) -> str:
    return ','.join(f'{v:g}' for v in scene(index)[2].as_tuple())


def listen(rig: Rig, kind: Any, topic: str) -> list[Any]:
    """Messages of one of the tracker's topics; to be called before the tracker is up."""
    heard: list[Any] = []
    rig.node.create_subscription(kind, f'{rig.tracker}/{topic}', heard.append, 200)
    return heard


def play_hidden(rig: Rig, indices: range) -> None:
    """The scene's target behind a panel that stands nearer."""
    for index in indices:
        color, depth, box = scene(index)
        x, y = int(box.x) - 40, int(box.y) - 40
        color[y : y + 160, x : x + 120] = (40, 90, 140)
        depth[y : y + 160, x : x + 120] = 1000
        rig.send_info(index)
        rig.send_images(index, color, depth / 1000)


def test_pose_and_twist_follow_the_walk_and_go_on_while_hidden(rig: Rig) -> None:
    poses = listen(rig, PoseStamped, 'pose')
    uncertain = listen(rig, PoseWithCovarianceStamped, 'pose_with_covariance')
    twists = listen(rig, TwistWithCovarianceStamped, 'twist')
    with running_node(rig, queue_policy='all', init_box=box_text(), pose_prediction=0.3) as node:
        rig.wait(lambda: node._outputs.wanted('pose') and node._outputs.wanted('twist'))
        rig.play(range(15))
        assert len(poses) >= 14
        assert poses[-1].header == rig.boxes[-1].header
        at, turn = poses[-1].pose.position, poses[-1].pose.orientation
        assert at == rig.positions[-1].point
        axes = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
        assert axes[:, 2] == pytest.approx((0, -1, 0), abs=1e-6)
        assert axes[0, 0] > 0.9  # it sways to the right
        linear = twists[-1].twist.twist.linear
        assert linear.x == pytest.approx(50 / 15 * 30 * 2 / 290 * np.cos(14 / 15), rel=0.5)
        seen = np.trace(np.reshape(uncertain[-1].pose.covariance, (6, 6))[:3, :3])
        play_hidden(rig, range(15, 45))
        rig.wait(
            lambda: (
                stamp_to_ns(uncertain[-1].header.stamp) == stamp_to_ns(rig.boxes[-1].header.stamp)
            )
        )
        assert rig.occluded[-1]
        hidden = np.trace(np.reshape(uncertain[-1].pose.covariance, (6, 6))[:3, :3])
        assert hidden > seen
        last = stamp_to_ns(rig.positions[-1].header.stamp)
        after = [stamp_to_ns(p.header.stamp) - last for p in poses]
        assert 0 < max(after) <= 0.3e9
        assert stamp_to_ns(twists[-1].header.stamp) - last > 0.5e9
