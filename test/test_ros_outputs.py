# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the node says beyond the box: state, pose, velocity, markers, over real DDS."""

from __future__ import annotations

import signal
import sys
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import (
    PoseStamped,
    PoseWithCovarianceStamped,
    TwistWithCovarianceStamped,
)
from rclpy.lifecycle import LifecycleNode
from ros_rig import Rig, box_text, play_hidden, running_node, scene, tracker_process
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, CompressedImage, RegionOfInterest
from stand_ins import foxglove_messages, vision_messages
from std_msgs.msg import UInt32
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray

from rgbd_kcf_tracker import Box, RgbdKcfError, TargetSet, TrackState
from rgbd_kcf_tracker.insight import Insight, insight_in
from rgbd_kcf_tracker.recordings.evidence_messages import evidence_of
from rgbd_kcf_tracker.recordings.images import decode_compressed_color
from rgbd_kcf_tracker.recordings.messages import box_from_polygon, tracks_of_state
from rgbd_kcf_tracker.ros.messages import RosTypes, stamp_to_ns

pytestmark = pytest.mark.ros


def listen(rig: Rig, kind: Any, topic: str) -> list[Any]:
    """Messages of one of the tracker's topics; to be called before the tracker is up."""
    heard: list[Any] = []
    rig.node.create_subscription(kind, f'{rig.tracker}/{topic}', heard.append, 200)
    return heard


def test_one_stamped_answer_for_each_pair(rig: Rig) -> None:
    """State, box and position of a moment in one message, with the image's own header."""
    states = listen(rig, DiagnosticArray, 'state')
    with running_node(rig, queue_policy='all', init_box=box_text(2)) as node:
        rig.wait(lambda: node._outputs.wanted('state'))
        rig.play(range(2, 8))
        play_hidden(rig, range(8, 30))
        node._session.reset()
        rig.play([30])
        rig.wait(lambda: len(states) == len(rig.boxes) == len(rig.occluded))
    tracks = [tracks_of_state(state) for state in states]
    assert all(len(each) == 1 for each in tracks)
    assert [state.header for state in states] == [box.header for box in rig.boxes]
    for (track,), box, occluded in zip(tracks, rig.boxes, rig.occluded, strict=True):
        assert track.box == box_from_polygon(box.polygon.points)
        assert track.occluded == occluded
    ((seen,), (hidden,), (idle,)) = tracks[5], tracks[-2], tracks[-1]
    assert seen.state is TrackState.TRACKING
    assert 0.5 < seen.score <= 1
    at = next(p.point for p in rig.positions if p.header == states[5].header)
    assert seen.position == pytest.approx((at.x, at.y, at.z), abs=1e-3)
    assert states[5].status[0].name == 'target'
    assert hidden.state in (TrackState.OCCLUDED, TrackState.LOST)
    assert hidden.predicted is not None
    assert (idle.state, idle.box, idle.position) == (TrackState.IDLE, None, None)


@pytest.mark.parametrize(
    ('message', 'values'),
    [
        ('somewhere', {'id': '1', 'score': '0.5'}),
        ('tracking', {'id': '1'}),
        ('tracking', {'id': 'one', 'score': '0.5'}),
        ('tracking', {'id': '1', 'score': 'nan'}),
        (
            'occluded',
            {
                'id': '1',
                'score': '0',
                'position_x': 'nan',
                'position_y': '1',
                'position_z': '1e300',
            },
        ),
        ('tracking', {'id': '1', 'score': '0.5', 'x': '1', 'y': '2', 'width': '3'}),
        ('tracking', {'id': '1', 'score': '1', 'x': '1', 'y': '2', 'width': '-3', 'height': '4'}),
    ],
)
def test_what_is_no_state_is_refused(message: str, values: dict[str, str]) -> None:
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    state = DiagnosticArray(status=[DiagnosticStatus(name='a', message=message, values=pairs)])
    with pytest.raises(RgbdKcfError, match="'a' is no state of a target"):
        tracks_of_state(state)


def test_pose_and_twist_follow_the_walk_and_go_on_while_hidden(rig: Rig) -> None:
    poses = listen(rig, PoseStamped, 'pose')
    uncertain = listen(rig, PoseWithCovarianceStamped, 'pose_with_covariance')
    twists = listen(rig, TwistWithCovarianceStamped, 'twist')
    with running_node(rig, queue_policy='all', init_box=box_text(), pose_prediction=0.3) as node:
        rig.wait(lambda: node._outputs.wanted('pose') and node._outputs.wanted('twist'))
        rig.play(range(15))
        # The box is sent last, but topics may overtake each other on the way.
        last = rig.boxes[-1].header
        for heard in (poses, uncertain, twists, rig.positions):
            rig.wait(lambda heard=heard: heard and heard[-1].header == last, what='the last pose')
        assert len(poses) >= 14
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
        seen_at = stamp_to_ns(rig.positions[-1].header.stamp)
        after = [stamp_to_ns(p.header.stamp) - seen_at for p in poses]
        assert 0 < max(after) <= 0.3e9
        rig.wait(lambda: stamp_to_ns(twists[-1].header.stamp) - seen_at > 0.5e9)


@pytest.mark.parametrize('variant', ['kcf', 'rgbd_pf', 'metric'])
def test_evidence_is_computed_while_somebody_subscribes_and_never_else(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, variant: str
) -> None:
    asked: list[int] = []

    def counting(targets: TargetSet, number: int) -> Insight:
        asked.append(number)
        return insight_in(targets, number)

    monkeypatch.setattr('rgbd_kcf_tracker.live.session.insight_in', counting)
    heard: list[DiagnosticArray] = []
    with running_node(rig, queue_policy='all', init_box=box_text(), variant=variant) as node:
        rig.play(range(4))
        assert not asked
        subscription = rig.node.create_subscription(
            DiagnosticArray, '/tracker/evidence', heard.append, 200
        )
        rig.wait(lambda: node._outputs.wanted('evidence'))
        rig.play(range(4, 8))
        play_hidden(rig, range(8, 30))
        rig.wait(lambda: heard and heard[-1].header == rig.boxes[-1].header)
        assert len(asked) >= len(heard) >= 24
        # Evidence begins with frame 4, or with the one before that if it was due.
        told = {message.header.stamp.nanosec: evidence_of(message)[1] for message in heard}
        at_6, at_29 = (told[rig.boxes[at].header.stamp.nanosec] for at in (6, 29))
        seen, hidden = at_6.insight, at_29.insight
        rig.node.destroy_subscription(subscription)
        rig.wait(lambda: not node._outputs.wanted('evidence'))
        # Of the frame before, evidence may have been due when the subscription came.
        before = len(asked)
        assert before in (26, 27)
        rig.play(range(30, 34))
        assert len(asked) == before
    assert all(each.asked_for for each in told.values())
    if variant == 'metric':
        assert seen.considered[0].probability > 0.5
        assert seen.considered[0].box.iou(rig.box(6)) > 0.9
        assert {'place', 'look'} <= seen.considered[0].cues.keys()
        assert seen.gallery
        assert hidden.particles is not None
        assert at_29.covariance is not None
        return
    assert 0.3 < seen.response < 1.2
    assert not seen.considered
    assert (hidden.particle_pixels is not None) == (variant == 'rgbd_pf')


def test_markers_show_every_target_and_go_with_it(rig: Rig) -> None:
    arrays = listen(rig, MarkerArray, 'markers')
    states = listen(rig, DiagnosticArray, 'state')
    add = rig.node.create_publisher(RegionOfInterest, '/tracker/add', 10)
    remove = rig.node.create_publisher(UInt32, '/tracker/remove', 10)
    with running_node(rig, queue_policy='all', init_box=box_text()) as node:
        rig.wait(lambda: node._outputs.wanted('markers') and node._outputs.wanted('state'))
        rig.wait(lambda: add.get_subscription_count() and remove.get_subscription_count())
        rig.play(range(10))
        add.publish(RegionOfInterest(x_offset=240, y_offset=60, width=60, height=60))
        rig.wait(lambda: len(node._session.others) == 1)
        rig.play(range(10, 14))
        remove.publish(UInt32(data=2))
        rig.wait(lambda: not node._session.others)
        rig.play(range(14, 16))
        rig.wait(lambda: arrays[-1].markers[0].header == rig.boxes[-1].header)
    assert [status.name for status in states[13].status] == ['target', 'target_2']
    assert [status.name for status in states[-1].status] == ['target']
    first = {marker.ns: marker for marker in arrays[9].markers}
    assert set(first) == {'box', 'name', 'trail', 'velocity', 'covariance'}
    assert {marker.id for marker in arrays[9].markers} == {1}
    assert first['box'].type == Marker.CUBE
    assert first['name'].text == '1 tracking'
    assert first['trail'].type == Marker.LINE_STRIP
    assert len(first['trail'].points) >= 3
    assert first['velocity'].points[1].x > first['velocity'].points[0].x
    assert first['covariance'].type == Marker.SPHERE
    assert all(m.lifetime.nanosec for m in arrays[9].markers)
    both = {marker.id for marker in arrays[13].markers}
    assert both == {1, 2}
    assert any(m.id == 2 and m.action == Marker.DELETE for m in arrays[14].markers)
    assert {marker.id for marker in arrays[15].markers} == {1}


def test_the_log_says_what_happens_and_answers_every_wrong_request(rig: Rig) -> None:
    with tracker_process('-p', 'queue_policy:=all', '-p', f'init_box:={box_text()}') as process:
        rig.await_listener()
        reset = rig.node.create_client(Trigger, '/tracker/reset')
        rig.play(range(10))
        play_hidden(rig, range(10, 40))
        rig.play(range(40, 60))
        for x in (1000, 2000, 3000):
            rig.send_init(Box(x, 10, 30, 40))
            # Where the machine is slow, the newest image is too old by now and the next is asked.
            rig.play([60 + x // 1000])
            rejected = f'{x // 1000}'
            rig.wait(lambda n=rejected: rig.values().get('rejected_requests') == n)
        assert reset.wait_for_service(20)
        for words in ('target dropped', 'there was no target'):
            answer = reset.call_async(Trigger.Request())
            rig.wait(answer.done)
            assert answer.result().message == words
            rig.wait(lambda: rig.values()['state'] == 'IDLE')
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=30)[0]
    lines = [line.partition('[tracker]: ')[2] for line in said.splitlines()]
    x, y, width, height = (f'{v:.0f}' for v in scene(0)[2].as_tuple())
    assert f'target 1 taken: box {x},{y},{width},{height}, 2.0 m away' in lines
    assert 'target 1 occluded' in lines
    assert 'target 1 found again, 2.0 m away' in lines
    assert 'target dropped' in lines
    for x in (1000, 2000, 3000):
        assert sum(f'box {x},10,30,40 lies outside' in line for line in lines) == 1
    assert len(lines) < 20


def test_pictures_are_made_while_somebody_looks(rig: Rig) -> None:
    with running_node(rig, queue_policy='all', init_box=box_text(), jpeg_quality=60) as node:
        rig.play(range(2))
        assert not node._outputs.image_wanted
        packed = listen(rig, CompressedImage, 'image_annotated/compressed')
        cameras = listen(rig, CameraInfo, 'camera_info')
        rig.wait(lambda: node._outputs.wanted('image_annotated/compressed', 'camera_info'))
        rig.wait(lambda: node._outputs.image_wanted and node._outputs.wanted('camera_info'))
        assert not node._outputs.wanted('image_annotated')
        rig.play(range(2, 6))
        rig.wait(lambda: packed and packed[-1].header == rig.boxes[-1].header)
    drawn = decode_compressed_color(packed[-1])
    plain = scene(5)[0]
    assert drawn.shape == plain.shape
    assert packed[-1].format == 'bgr8; jpeg compressed bgr8'
    outside = np.abs(drawn[150:].astype(int) - plain[150:]).mean()
    assert 0 < outside < 12
    assert len(packed[-1].data) < plain.size / 4
    assert cameras[-1].header == packed[-1].header
    assert (cameras[-1].width, cameras[-1].k[0]) == (320, 290.0)


def test_foxglove_and_vision_messages_where_they_are_installed(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Messages of packages that are not here, as the node would send them."""
    sent: dict[str, list[Any]] = {}
    original = LifecycleNode.create_lifecycle_publisher

    def create(node: Any, kind: Any, topic: str, *rest: Any, **named: Any) -> Any:
        if kind.__module__.startswith('stand_ins'):
            kept = sent.setdefault(topic, [])
            return SimpleNamespace(publish=kept.append, get_subscription_count=lambda: 1)
        return original(node, kind, topic, *rest, **named)

    monkeypatch.setattr(LifecycleNode, 'create_lifecycle_publisher', create)
    monkeypatch.setattr(LifecycleNode, 'destroy_lifecycle_publisher', lambda *_: None)
    for name, module in (
        ('vision_msgs', vision_messages()),
        ('foxglove_msgs', foxglove_messages()),
    ):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
        monkeypatch.setitem(sys.modules, f'{name}.msg', module)
    monkeypatch.setattr('rgbd_kcf_tracker.ros.publishers.ROS_TYPES', RosTypes())
    with running_node(rig, queue_policy='all', init_box=box_text()):
        rig.play(range(4))
        rig.wait(lambda: len(sent['~/annotations']) == 4)
    (flat,) = sent['~/detections'][-1].detections
    (solid,) = sent['~/detections3d'][-1].detections
    overlay = sent['~/annotations'][-1]
    box, at = rig.box(), rig.positions[-1].point
    assert flat.id == solid.id == '1'
    assert flat.bbox.center.position.x == pytest.approx(box.cx, abs=0.01)
    assert solid.bbox.center.position == at
    assert np.reshape(solid.results[0].pose.covariance, (6, 6))[0, 0] > 0
    assert overlay.points[0].points[0].x == pytest.approx(box.x, abs=0.01)
    assert overlay.points[0].type == 2


def test_a_broken_package_is_left_out_with_a_word(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Found by a package whose generated library could not be loaded: the node did not start."""
    monkeypatch.setitem(sys.modules, 'vision_msgs', ModuleType('vision_msgs'))
    monkeypatch.setitem(sys.modules, 'vision_msgs.msg', vision_messages())
    monkeypatch.setattr('rgbd_kcf_tracker.ros.publishers.ROS_TYPES', RosTypes())
    with running_node(rig, queue_policy='all', init_box=box_text()) as node:
        rig.play(range(2))
        assert not node._outputs.wanted('detections')


@pytest.mark.skipif(find_spec('vision_msgs') is None, reason='vision_msgs is not installed')
def test_detections_over_the_wire(rig: Rig) -> None:
    types = import_module('vision_msgs.msg')
    flat = listen(rig, types.Detection2DArray, 'detections')
    solid = listen(rig, types.Detection3DArray, 'detections3d')
    with running_node(rig, queue_policy='all', init_box=box_text()) as node:
        rig.wait(
            lambda: node._outputs.wanted('detections') and node._outputs.wanted('detections3d')
        )
        rig.play(range(4))
        play_hidden(rig, range(4, 12))
        rig.wait(lambda: len(flat) == len(solid) == len(rig.boxes))
    (detection,) = flat[3].detections
    (body,) = solid[3].detections
    at = next(p.point for p in rig.positions if p.header == flat[3].header)
    assert detection.id == body.id == '1'
    assert detection.bbox.size_x == pytest.approx(rig.box(3).width, abs=0.01)
    assert body.bbox.center.position == body.results[0].pose.pose.position == at
    assert body.bbox.size.y == pytest.approx(60 * 2 / 290, rel=0.3)
    assert len(flat[-1].detections) == len(solid[-1].detections) == 0


@pytest.mark.skipif(find_spec('foxglove_msgs') is None, reason='foxglove_msgs is not installed')
def test_annotations_over_the_wire(rig: Rig) -> None:
    heard = listen(rig, import_module('foxglove_msgs.msg').ImageAnnotations, 'annotations')
    with running_node(rig, queue_policy='all', init_box=box_text()) as node:
        rig.wait(lambda: node._outputs.wanted('annotations'))
        rig.play(range(4))
        rig.wait(lambda: len(heard) == 4)
    corner = heard[-1].points[0].points[0]
    assert (corner.x, corner.y) == pytest.approx((rig.box().x, rig.box().y), abs=0.01)
    assert heard[-1].texts[0].text.startswith('1 tracking')
