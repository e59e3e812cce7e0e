# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the node makes of the graph round it: topics, QoS, clocks, neighbours, clicks."""

from __future__ import annotations

import signal
import time
from itertools import count, islice

import cv2
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

import rclpy
from geometry_msgs.msg import Point, PointStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from ros_rig import FOCAL, Rig, box_text, running_node, scene, stamp_of, tracker_process
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from visualization_msgs.msg import Marker

from rgbd_kcf_tracker.recordings.images import decode_color
from rgbd_kcf_tracker.ros.messages import stamp_from_ns, stamp_to_ns
from rgbd_kcf_tracker.simulation import simulate
from rgbd_kcf_tracker.variants import VARIANTS

pytestmark = pytest.mark.ros


def test_a_click_chooses_the_surface(rig: Rig) -> None:
    with running_node(rig, queue_policy='all') as node:
        rig.play([0])
        truth = scene(0)[2]
        rig.init_point.publish(PointStamped(point=Point(x=truth.cx, y=truth.cy)))
        rig.await_request(node)
        rig.play(range(1, 5))
        assert rig.box().iou(scene(4)[2]) > 0.6
        rig.init_point.publish(PointStamped(point=Point(x=5.0, y=230.0)))
        rig.wait(lambda: 'fills the image' in rig.values().get('last_error', ''))
        rig.play(range(5, 7))
        assert rig.box().iou(scene(6)[2]) > 0.6


def test_the_nearest_person_is_chosen_by_itself(rig: Rig) -> None:
    with running_node(rig, queue_policy='all', auto_init=True, depth_wait=0.5):
        overlaps = []
        for index, moment in enumerate(
            islice(simulate('normal', seed=1, rate_hz=10, size=(640, 360)), 40)
        ):
            rig.send_info(index)
            rig.send_images(10 * index, moment.frame.color, moment.frame.depth)
            if rig.box() is not None and moment.visible is not None:
                overlaps.append(rig.box().iou(moment.visible))
                if len(overlaps) == 3:
                    break
        assert overlaps
        assert overlaps[0] > 0.5


def test_position_marker_and_picture(rig: Rig) -> None:
    variants = [name for name, variant in VARIANTS.items() if variant.uses_depth]
    markers: list[Marker] = []
    pictures: list[Image] = []
    rig.node.create_subscription(Marker, '/tracker/marker', markers.append, 10)
    with running_node(rig, queue_policy='all', init_box=box_text(), **_variant(variants)) as node:
        rig.play(range(5))
        assert not node._outputs.image_wanted
        rig.node.create_subscription(Image, '/tracker/image_annotated', pictures.append, 10)
        rig.wait(lambda: node._outputs.image_wanted)
        time.sleep(0.2)
        rig.play(range(5, 10))
        rig.wait(lambda: len(pictures) >= 4)
    drawn = decode_color(pictures[-1])
    plain = scene(9)[0]
    assert drawn.shape == plain.shape
    assert 0.001 < (drawn != plain).any(axis=2).mean() < 0.3
    assert stamp_to_ns(pictures[-1].header.stamp) == stamp_of(9)
    if variants:
        truth, at = scene(9)[2], rig.positions[-1]
        assert at.header == rig.boxes[-1].header
        assert at.point.z == pytest.approx(2.0, abs=0.1)
        assert at.point.x == pytest.approx((truth.cx - 159.5) * 2.0 / FOCAL, abs=0.1)
        assert markers[-1].action == Marker.ADD
        assert markers[-1].scale.y == pytest.approx(60 * 2.0 / FOCAL, rel=0.3)


def _variant(names: list[str]) -> dict[str, str]:
    return {'variant': names[-1]} if names else {}


@pytest.mark.parametrize('depth_format', ['png', 'tiff'])
def test_kinect2_bridge_compressed(rig: Rig, depth_format: str) -> None:
    """Bare PNG or TIFF depth beside JPEG colour, under the remapped base topics."""
    remaps = []
    for name, topic in (('color', 'image_color_rect'), ('depth', 'image_depth_rect')):
        remaps += [
            '-r',
            f'{name}/image:=/kinect2/qhd/{topic}',
            '-p',
            f'{name}_transport:=compressed',
        ]
    with tracker_process(*remaps, '-p', f'init_box:={box_text()}', '-p', 'queue_policy:=all'):
        name = '/tracker: tracker'
        rig.wait(lambda: any(d.name == name for d in rig.diagnostics), what='the tracker')
        for index in range(4):
            color, depth, _ = scene(index)
            header = rig.header(index)
            jpeg = cv2.imencode('.jpg', color, (cv2.IMWRITE_JPEG_QUALITY, 98))[1].tobytes()
            packed = cv2.imencode(f'.{depth_format}', depth)[1].tobytes()
            rig.send_compressed(
                '/kinect2/qhd/image_color_rect/compressed',
                CompressedImage(header=header, format='bgr8; jpeg compressed bgr8', data=jpeg),
            )
            rig.send_compressed(
                '/kinect2/qhd/image_depth_rect/compressed',
                CompressedImage(
                    header=header, format=f'16UC1; {depth_format} compressed', data=packed
                ),
            )
            rig.wait(lambda index=index: len(rig.boxes) == index + 1)
        assert rig.box().iou(scene(3)[2]) > 0.6
        values = rig.fresh_values()
        assert 'bad_depth' not in values
        assert int(values.get('color_without_depth', 0)) <= 1


@pytest.mark.parametrize('reliability', ['best_effort', 'reliable'])
def test_publishers_of_either_reliability_are_heard(rig: Rig, reliability: str) -> None:
    qos = QoSProfile(depth=10, reliability=ReliabilityPolicy[reliability.upper()])
    for publisher in (rig.color, rig.depth, rig.info):
        rig.node.destroy_publisher(publisher)
    rig.color = rig.node.create_publisher(Image, 'color/image', qos)
    rig.depth = rig.node.create_publisher(Image, 'depth/image', qos)
    rig.info = rig.node.create_publisher(CameraInfo, 'color/camera_info', qos)
    with running_node(rig, init_box=box_text()):
        rig.play_until_heard(0)
        rig.play(range(1, 10))
        assert rig.box().iou(scene(9)[2]) > 0.6


def test_publishers_that_cannot_be_heard_are_told(rig: Rig) -> None:
    """Each once on the log with what mends it, and in diagnostics for as long as it is so.

    The tracker is a process of its own: within one, Fast DDS has once in some hundred runs kept a
    publisher from another context that was made just before.
    """
    best_effort = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    for publisher in (rig.color, rig.depth, rig.init):
        rig.node.destroy_publisher(publisher)
    rig.color = rig.node.create_publisher(Image, 'color/image', best_effort)
    context = rclpy.Context()  # of its own: Fast DDS has one type for a topic in each
    rclpy.init(context=context)
    other = Node('other', context=context)
    other.create_publisher(CompressedImage, 'depth/image', 10)
    rig.node.create_publisher(RegionOfInterest, '/tracker/init', best_effort)
    color = (
        '/rig publishes best effort on /color/image, where reliable is asked for: '
        'set reliability:=best_effort'
    )
    depth = (
        '/other publishes sensor_msgs/msg/CompressedImage on /depth/image, not '
        'sensor_msgs/msg/Image: remap depth/image, or set depth_transport'
    )
    init = (
        '/rig publishes best effort on /tracker/init, where reliable is asked for: '
        'publish it reliable'
    )
    with tracker_process('-p', 'reliability:=reliable') as process:
        silent = f'no image on /color/image yet: {color}'
        rig.wait(lambda: rig.values().get('message') == silent, 20, 'why')
        rig.fresh_values()  # it is on the log when it was so twice
        rig.node.destroy_publisher(rig.color)
        rig.color = rig.node.create_publisher(Image, 'color/image', 10)
        indices = count()

        def told() -> bool:
            rig.send_info()
            rig.send_color(next(indices))
            time.sleep(0.02)
            message = rig.values()['message']
            return f'no depth image on /depth/image: {depth}' in message and init in message

        rig.wait(told, 20, 'the others')
        assert rig.values()['level'] == '1'
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=20)[0]
    other.destroy_node()
    rclpy.shutdown(context=context)
    assert [said.count(words) for words in (color, depth, init)] == [1, 1, 1]


def test_qos_can_be_overridden_by_ros_own_parameters(rig: Rig) -> None:
    with tracker_process(
        *('-p', 'qos_overrides./color/image.subscription.reliability:=reliable'),
        *('-p', 'qos_overrides./color/image.subscription.depth:=2'),
    ):
        rig.await_listener()
        (info,) = rig.node.get_subscriptions_info_by_topic('/color/image')
        assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE
        (info,) = rig.node.get_subscriptions_info_by_topic('/depth/image')
        assert info.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT, 'of one topic alone'
        assert 'bad_parameters' not in rig.fresh_values()


@pytest.mark.parametrize(
    ('rest', 'meant'),
    [
        ('/colour/image.subscription.reliability', '/color/image.subscription.reliability'),
        ('/color/image.subscription.dept', '/color/image.subscription.depth'),
        ('/clock.subscription.depth', None),
    ],
)
def test_a_qos_override_that_nobody_reads_is_told(
    rest: str, meant: str | None, rig: Rig, capfd: pytest.CaptureFixture[str]
) -> None:
    with running_node(rig, **{f'qos_overrides.{rest}': 'reliable'}):
        pass
    told = f"unknown parameter 'qos_overrides.{rest}': did you mean 'qos_overrides.{meant}'?"
    assert (told in capfd.readouterr().err) == (meant is not None)


def test_recorded_time(rig: Rig) -> None:
    """With use_sim_time, ages are told in the clock of the recording, through its loop too."""
    clock = rig.node.create_publisher(Clock, '/clock', 10)
    with running_node(rig, use_sim_time=True, queue_policy='all', init_box=box_text()):
        rig.wait(lambda: clock.get_subscription_count() > 0)
        for index in [*range(200, 206), *range(6)]:
            clock.publish(Clock(clock=stamp_from_ns(stamp_of(index))))
            time.sleep(0.02)
            rig.play([index])
        values = rig.fresh_values()
    assert abs(float(values['latency_median_ms'])) < 200
    assert values['time_jumps'] == '1'


def test_two_nodes_side_by_side(rig: Rig) -> None:
    other = Rig(namespace='/right', tracker='/right/tracker')
    try:
        with (
            tracker_process('-p', f'init_box:={box_text()}', '-p', 'queue_policy:=all'),
            tracker_process(
                *('-p', f'init_box:={box_text(30)}', '-p', 'queue_policy:=all'),
                *('-r', '__ns:=/right'),
            ),
        ):
            rig.await_listener()
            other.await_listener()
            for step in range(5):
                rig.play([step])
                other.play([30 + step])
            assert len(rig.boxes) == len(other.boxes) == 5
            assert rig.box().iou(scene(4)[2]) > 0.6
            assert other.box().iou(scene(34)[2]) > 0.6
            rig.wait(
                lambda: (
                    {d.name for d in rig.diagnostics}
                    == {'/tracker: tracker', '/right/tracker: tracker'}
                )
            )
    finally:
        other.close()
