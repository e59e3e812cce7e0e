# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Faults of cameras, networks and users, each injected into the real node over DDS.

One node lives through them all, one after the other: that it still tracks at the end of each is
part of every test.
"""

from __future__ import annotations

import array
import math
import os
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import cv2
import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

import rclpy
from geometry_msgs.msg import Point, PointStamped
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from ros_rig import FRAME_ID, HEIGHT, WIDTH, Rig, running_node, scene, stamp_of
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from std_msgs.msg import UInt32
from std_srvs.srv import Trigger

from rgbd_kcf_tracker.bench.rig import resident_mb
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.live.intake import Intake
from rgbd_kcf_tracker.ros.messages import image_message, stamp_to_ns

pytestmark = pytest.mark.ros

SECOND = 1_000_000_000
LENGTH = 9_990
"""Frames between the starts of two tests: five minutes, so that each begins with a jump ahead.

106 times the sway, so that the target moves at each start and no picture equals the last."""


PATIENCE = 40
"""Frames, a tenth of a second apart, within which a request has its turn."""


class Live:
    """A rig with a node that is taken from test to test."""

    def __init__(self, rig: Rig, node: Any) -> None:
        self.rig, self.node = rig, node
        self.first = 0
        self.reset = rig.node.create_client(Trigger, '/tracker/reset')
        self.known: dict[str, int] = {}

    def begin(self) -> int:
        """A fresh target in fresh time; returns the first index."""
        self.first += LENGTH
        rig = self.rig
        answer = self.reset.call_async(Trigger.Request())
        rig.wait(answer.done, what='reset')
        rig.play([self.first])
        rig.send_init(scene(self.first)[2])
        # Where earlier starts took long, on a busy machine, the request waits for its turn.
        for index in range(self.first + 1, self.first + 1 + PATIENCE):
            time.sleep(0.1)
            rig.play([index])
            if rig.box() is not None:
                self.known = self.counts()
                return index + 1
        raise AssertionError(f'no target after {PATIENCE} frames')

    def counts(self) -> dict[str, int]:
        return dict(self.node.statistics.snapshot().counts)

    def added(self, name: str) -> int:
        return self.counts().get(name, 0) - self.known.get(name, 0)

    def send(self, index: int, **header: Any) -> None:
        """A frame at about the camera's rate, its answer not waited for."""
        self.rig.send(index, **header)
        time.sleep(0.02)

    def answered(self, since: int, number: int) -> list[int]:
        """Stamps of the answers since, when there are so many and no more come."""
        self.rig.wait(lambda: len(self.rig.boxes) >= since + number, what=f'{number} boxes')
        time.sleep(0.15)
        assert len(self.rig.boxes) == since + number
        return [stamp_to_ns(m.header.stamp) for m in self.rig.boxes[since:]]

    def refuses(self, number: int) -> None:
        """So many requests are refused; images may overtake them on the way."""
        self.rig.wait(lambda: self.added('rejected_requests') >= number, what='a refusal')

    def goes_on(self, index: int, **header: Any) -> None:
        """The target is tracked in three more good frames."""
        self.rig.play(range(index, index + 3), **header)
        assert self.rig.box() is not None
        assert self.rig.box().iou(scene(index + 2)[2]) > 0.5

    def says(self, name: str, words: str) -> None:
        """The fault was counted, and its words stand in the diagnostics that go out."""
        assert self.added(name) >= 1
        self.rig.wait(lambda: words in self.rig.values().get('last_error', ''), what=f'{words!r}')


@pytest.fixture(scope='module')
def live(module_ros_domain: int) -> Iterator[Live]:
    rig = Rig()
    # Every pair counts in most of these tests, so that they need not keep time.
    with running_node(rig, queue_policy='all') as node:
        # The intake of the default policy: it must not wait a second for what was dropped.
        node._intake = Intake(
            node.statistics,
            tolerance_s=node.settings.pair_tolerance,
            depth_wait_s=node.settings.depth_wait,
            camera_info_wait_s=node.settings.camera_info_wait,
            patient=False,
        )
        yield Live(rig, node)
    rig.close()


def test_frames_dropped(live: Live) -> None:
    first = live.begin()
    since = len(live.rig.boxes)
    kept = [first + i for i in range(20) if i % 5 not in (1, 2)]
    for index in kept:
        live.send(index)
    assert live.answered(since, len(kept)) == [stamp_of(i) for i in kept]
    live.goes_on(first + 20)


def test_depth_late_but_in_time(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    first = live.begin()
    rig, since = live.rig, len(live.rig.boxes)
    monkeypatch.setattr(live.node._intake, '_first_wait_ns', 5 * SECOND)
    for index in range(first, first + 4):
        rig.send_color(index)
        time.sleep(0.1)
        rig.send_depth(index)
    live.answered(since, 4)
    assert live.added('color_without_depth') == 0
    live.goes_on(first + 4)


def test_depth_too_late(live: Live) -> None:
    first = live.begin()
    rig, since = live.rig, len(live.rig.boxes)
    for index in range(first, first + 2):
        rig.send_color(index)
        time.sleep(0.2)
        rig.send_depth(index)
    live.answered(since, 2)
    assert live.added('color_without_depth') == 2
    live.goes_on(first + 2)


@pytest.mark.parametrize('fault', ['an hour off', '300 ms late'])
def test_depth_that_never_fits_delays_nothing(live: Live, fault: str) -> None:
    first = live.begin()
    rig, since = live.rig, len(live.rig.boxes)
    waiting: list[int] = []
    for index in range(first, first + 40):
        rig.send_color(index)
        if fault == 'an hour off':
            rig.send_depth(index, stamp_ns=stamp_of(index) - 3600 * SECOND)
        elif index >= first + 9:
            rig.send_depth(index - 9)
        time.sleep(1 / 30)
        waiting.append(len(live.node._intake._arrivals))
    live.answered(since, 40)
    assert live.added('color_without_depth') == 40
    assert max(waiting[-20:]) == 0
    words = 'from those of colour' if fault == 'an hour off' else 'after its colour image'
    rig.wait(lambda: words in rig.values()['message'], 5.0, words)
    live.goes_on(first + 40)
    live.known = live.counts()
    rig.play(range(first + 43, first + 46))
    assert live.added('color_without_depth') == 0


def test_out_of_order(live: Live) -> None:
    first = live.begin()
    since = len(live.rig.boxes)
    for offset in (0, 2, 1, 3, 5, 4, 6):
        live.send(first + offset)
    stamps = live.answered(since, 5)
    assert stamps == sorted(stamps)
    assert live.added('late') == 2
    live.goes_on(first + 7)


def test_duplicated(live: Live) -> None:
    first = live.begin()
    since = len(live.rig.boxes)
    for index in range(first, first + 8):
        live.send(index)
        live.send(index)
    assert live.answered(since, 8) == [stamp_of(i) for i in range(first, first + 8)]
    live.goes_on(first + 8)


def test_colour_without_depth_for_seconds(live: Live) -> None:
    first = live.begin()
    since = len(live.rig.boxes)
    for index in range(first, first + 70):
        live.rig.send_color(index)
        time.sleep(0.03)
    assert live.answered(since, 70) == [stamp_of(i) for i in range(first, first + 70)]
    assert live.added('color_without_depth') == 70
    live.goes_on(first + 70)


def test_depth_without_colour_for_seconds(live: Live) -> None:
    first = live.begin()
    since = len(live.rig.boxes)
    sway = 94  # then the target is back where it was
    for index in range(first, first + sway):
        live.rig.send_depth(index)
        time.sleep(0.01)
    time.sleep(0.2)
    assert len(live.rig.boxes) == since
    live.goes_on(first + sway)
    assert live.added('depth_without_color') >= sway - 30


def test_stamps_all_zero(live: Live) -> None:
    first = live.begin()
    since = len(live.rig.boxes)
    for index in range(first, first + 10):
        live.send(index, stamp_ns=0)
    assert live.answered(since, 10) == [0] * 10
    live.goes_on(first + 10)


def test_stamps_all_equal(live: Live) -> None:
    first = live.begin()
    since = len(live.rig.boxes)
    for index in range(first, first + 10):
        live.send(index, stamp_ns=stamp_of(first))
    assert live.answered(since, 10) == [stamp_of(first)] * 10
    live.goes_on(first + 10)


def test_stamps_jump_back(live: Live) -> None:
    first = live.begin()
    rig = live.rig
    rig.play(range(first + 300, first + 303))
    since = len(rig.boxes)
    for index in range(first, first + 10):
        live.send(index)
    live.answered(since, 10)
    assert live.added('restarts') == 1
    live.goes_on(first + 10)


def test_a_bag_that_loops_is_no_fault_for_ever(live: Live) -> None:
    first = live.begin()
    since = len(live.rig.boxes)
    for _ in range(4):
        for index in range(first, first + 40):
            live.send(index)
    live.answered(since, 160)
    # The jump ahead of begin() and those of earlier tests have been; of three loops one is said.
    assert live.added('restarts') == 3
    assert live.added('time_jumps') <= 1
    live.goes_on(first + 40)


def test_stamp_far_in_the_future(live: Live) -> None:
    first = live.begin()
    since = len(live.rig.boxes)
    for index in range(first, first + 10):
        future = stamp_of(index) + 10**8 * SECOND
        live.send(index, stamp_ns=future if index == first + 4 else None)
    stamps = live.answered(since, 10)
    assert stamps[4] == stamp_of(first + 4) + 10**8 * SECOND
    live.goes_on(first + 10)


def test_frame_id_changes(live: Live) -> None:
    first = live.begin()
    live.rig.play(range(first, first + 3), frame_id='other_camera')
    assert live.rig.boxes[-1].header.frame_id == 'other_camera'
    live.says('frame_id_changes', "from 'camera_optical_frame' to 'other_camera'")
    live.goes_on(first + 3)


def test_size_changes(live: Live) -> None:
    first = live.begin()
    rig = live.rig
    for index in range(first, first + 4):
        color, depth, _ = scene(index)
        before = len(rig.boxes)
        rig.color.publish(image_message(rig.header(index), color[::2, ::2], 'bgr8'))
        rig.depth.publish(image_message(rig.header(index), depth[::2, ::2], '16UC1'))
        rig.wait(lambda before=before: len(rig.boxes) > before)
    live.says('bad_camera_info', 'for 320x240 images but these are 160x120')
    rig.play(range(first + 4, first + 8))
    rig.send_init(scene(first + 7)[2])
    time.sleep(0.1)
    live.goes_on(first + 8)


def after_depth(live: Live, count: int, message: Callable[[np.ndarray], tuple]) -> int:
    """Play pairs, each answered, with depth made of the scene's millimetres; the next index."""
    first = live.begin()
    rig, since = live.rig, len(live.rig.boxes)
    live.node._processor._depth_wanted = lambda: True
    for index in range(first, first + count):
        rig.send_color(index)
        rig.depth.publish(image_message(rig.header(index), *message(scene(index)[1])))
        time.sleep(0.03)
    live.answered(since, count)
    return first + count


def test_depth_of_another_size(live: Live) -> None:
    index = after_depth(live, 4, lambda depth: (depth[:200, :300], '16UC1'))
    live.says('bad_depth', 'register the depth')
    assert live.added('bad_depth') == 4
    live.goes_on(index)


ENCODED: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    'rgb8': lambda c: c[:, :, ::-1],
    'bgra8': lambda c: np.dstack((c, np.full(c.shape[:2], 255, np.uint8))),
    'mono8': lambda c: c[:, :, 1],
}


def test_encoding_changes(live: Live) -> None:
    first = live.begin()
    rig = live.rig
    live.node._processor._depth_wanted = lambda: True
    index = first
    for encoding, encode in ENCODED.items():
        for _ in range(3):
            color, depth, truth = scene(index)
            before = len(rig.boxes)
            rig.color.publish(image_message(rig.header(index), encode(color), encoding))
            rig.depth.publish(
                image_message(rig.header(index), (depth / 1000).astype(np.float32), '32FC1')
            )
            rig.wait(lambda before=before: len(rig.boxes) > before)
            assert rig.box() is not None or encoding == 'mono8'
            index += 1
        if encoding != 'mono8':
            assert rig.box().iou(truth) > 0.5
    assert live.added('bad_color') == live.added('bad_depth') == 0
    live.goes_on(index)


def test_unknown_encoding(live: Live) -> None:
    first = live.begin()
    rig, since = live.rig, len(live.rig.boxes)
    for index in range(first, first + 3):
        rig.color.publish(image_message(rig.header(index), scene(index)[0], 'bayer_magic'))
        rig.send_depth(index)
    live.answered(since, 3)
    assert rig.box() is None
    said = "/color/image: colour image cannot be read: unknown colour encoding 'bayer_magic'"
    live.says('bad_color', said)
    rig.color.publish(image_message(rig.header(first + 3), scene(0)[0], 'bayer_' + 'x' * 100_000))
    rig.send_depth(first + 3)
    live.answered(since, 4)
    live.says('bad_color', "unknown colour encoding 'bayer_xxx")
    assert len(live.node.statistics.snapshot().last_error) < 1000
    live.goes_on(first + 4)


@pytest.mark.parametrize(
    ('empty', 'encoding'),
    [
        (np.zeros((HEIGHT, WIDTH), np.uint16), '16UC1'),
        (np.full((HEIGHT, WIDTH), np.nan, np.float32), '32FC1'),
    ],
    ids=['zero', 'nan'],
)
def test_depth_without_a_reading(live: Live, empty: np.ndarray, encoding: str) -> None:
    index = after_depth(live, 5, lambda depth: (empty, encoding))
    live.says('empty_depth', 'no reading at all')
    live.goes_on(index)


def test_depth_with_numbers_that_are_no_metres(live: Live) -> None:
    """They were taken as no reading, and nobody was told."""

    def odd(depth: np.ndarray) -> tuple[np.ndarray, str]:
        metres = (depth / 1000).astype(np.float32)
        metres[:32] = 3e9
        return metres, '32FC1'

    index = after_depth(live, 5, odd)
    live.says('odd_depth', 'not between 0.001 and 65.535 metres')
    assert live.added('odd_depth') == 5
    assert live.added('empty_depth') == live.added('bad_depth') == 0
    assert live.rig.box().iou(scene(index - 1)[2]) > 0.5
    live.goes_on(index)


def cut(message: Image) -> None:
    message.data = message.data[: len(message.data) // 2]


def huge(message: Image) -> None:
    message.width = 4_000_000_000


def tiny_step(message: Image) -> None:
    message.step = 1


def no_pixels(message: Image) -> None:
    message.height = message.width = message.step = 0
    message.data = array.array('B')


@pytest.mark.parametrize('lie', [cut, huge, tiny_step, no_pixels])
def test_lying_images(live: Live, lie: Callable[[Image], None]) -> None:
    first = live.begin()
    rig, since = live.rig, len(live.rig.boxes)
    live.node._processor._depth_wanted = lambda: True
    for index in range(first, first + 4):
        color = image_message(rig.header(index), scene(index)[0], 'bgr8')
        depth = image_message(rig.header(index), scene(index)[1], '16UC1')
        lie(color if index % 2 else depth)
        rig.color.publish(color)
        rig.depth.publish(depth)
        time.sleep(0.02)
    live.answered(since, 4)
    assert live.added('bad_color') == live.added('bad_depth') == 2
    live.goes_on(first + 4)


def test_strings_that_are_no_text(live: Live) -> None:
    """An encoding that is no UTF-8 raises inside rclpy, before any callback."""
    first = live.begin()
    rig = live.rig
    raw = bytes(serialize_message(image_message(rig.header(first), scene(first)[0], 'bgr8')))
    rig.color.publish(raw.replace(b'bgr8', b'\xff\xfe\xfd\xfc'))
    rig.color.publish(raw[:100])
    time.sleep(0.2)
    live.goes_on(first + 1)


def test_camera_info_that_is_no_camera(live: Live) -> None:
    first = live.begin()
    rig = live.rig
    for focal in (-500.0, float('nan'), float('inf')):
        info = CameraInfo(header=rig.header(first), width=WIDTH, height=HEIGHT)
        info.k = [focal, 0.0, 160.0, 0.0, focal, 120.0, 0.0, 0.0, 1.0]
        rig.info.publish(info)
    rig.wait(lambda: live.added('bad_camera_info') == 3)
    live.says('bad_camera_info', 'camera_info')
    live.goes_on(first)


def test_camera_info_of_a_lens_that_is_not_known(live: Live) -> None:
    first = live.begin()
    rig = live.rig
    info = CameraInfo(header=rig.header(first), width=WIDTH, height=HEIGHT)
    info.k = [300.0, 0.0, 160.0, 0.0, 300.0, 120.0, 0.0, 0.0, 1.0]
    info.distortion_model, info.d = 'thin_prism', [0.1] * 6
    rig.info.publish(info)
    rig.wait(lambda: live.added('bad_camera_info') == 1)
    live.says('bad_camera_info', "the model 'thin_prism', which is not known: use rectified images")
    live.goes_on(first)


def test_requests_at_any_rate(live: Live) -> None:
    first = live.begin()
    rig, since = live.rig, len(live.rig.boxes)
    stop = threading.Event()

    def storm() -> None:
        rng = np.random.default_rng(3)
        while not stop.is_set():
            x, y, width, height = (int(v) for v in rng.integers(0, 400, 4))
            roi = RegionOfInterest(x_offset=x, y_offset=y, width=width, height=height)
            rig.init.publish(roi)
            live.reset.call_async(Trigger.Request())
            time.sleep(0.002)

    thread = threading.Thread(target=storm)
    thread.start()
    for index in range(first, first + 40):
        live.send(index)
    stop.set()
    thread.join()
    live.answered(since, 40)
    assert live.added('internal_errors') == 0
    time.sleep(0.2)
    rig.send_init(scene(first + 39)[2])
    time.sleep(0.2)
    live.goes_on(first + 40)


def test_boxes_that_nobody_means(live: Live) -> None:
    """By topic, parameter and click: refused at once, and the target is kept."""
    first = live.begin()
    rig = live.rig
    before = resident_mb(os.getpid())
    cast = 2**32 - 50
    for x, y, width, height in (
        (10, 10, cast, 60),
        (cast, cast, cast, cast),
        (10, 10, 60, cast),
        (10, 10, 0, 0),
    ):
        rejected = live.added('rejected_requests')
        rig.init.publish(RegionOfInterest(x_offset=x, y_offset=y, width=width, height=height))
        live.refuses(rejected + 1)
        live.goes_on(first)
        first += 3
        assert live.added('rejected_requests') == rejected + 1
    for u, v in ((math.nan, 5.0), (math.inf, -math.inf), (1e300, 1e300), (-1.0, -1.0)):
        rejected = live.added('rejected_requests')
        rig.init_point.publish(PointStamped(point=Point(x=u, y=v)))
        live.refuses(rejected + 1)
        live.goes_on(first)
        first += 3
        assert live.added('rejected_requests') == rejected + 1
    for text in ('10,10,4294967246,60', '-1e300,0,1e300,60', '1e308,1e308,1,1'):
        live.node.set_parameters([Parameter('init_box', value=text)])
        live.goes_on(first)
        first += 3
    assert live.added('rejected_requests') == 11
    assert live.added('internal_errors') == 0
    assert resident_mb(os.getpid()) - before < 100


@contextmanager
def asked_meanwhile(
    live: Live, first: int, rate: float, ask: Callable[[Box], None]
) -> Iterator[None]:
    """Images at 30 Hz are all answered while something is asked of each target's box.

    Args:
        live: the rig.
        first: of 45 images.
        rate: Hz at which is asked, on within the context.
        ask: called with the box of the newest image.
    """
    rig, since = live.rig, len(live.rig.boxes)
    stop = threading.Event()
    asked = [scene(first)[2]]

    def go_on() -> None:
        while not stop.wait(1 / rate):
            ask(asked[0])

    thread = threading.Thread(target=go_on)
    thread.start()
    try:
        for index in range(first, first + 45):
            asked[0] = scene(index)[2]
            rig.send(index)
            time.sleep(1 / 30)
        live.answered(since, 45)
        yield
    finally:
        stop.set()
        thread.join()


@pytest.mark.parametrize('rate', [15, 60])
def test_requests_do_not_starve_images(live: Live, rate: int) -> None:
    first = live.begin()
    with asked_meanwhile(live, first, rate, live.rig.send_init):
        pass
    live.goes_on(first + 45)


@pytest.mark.parametrize('how', ['again', 'anywhere', 'and remove'])
def test_additions_at_any_rate_do_not_starve_images(live: Live, how: str) -> None:
    first = live.begin()
    rig = live.rig
    add = rig.node.create_publisher(RegionOfInterest, '/tracker/add', 10)
    remove = rig.node.create_publisher(UInt32, '/tracker/remove', 10)
    rig.wait(lambda: add.get_subscription_count() and remove.get_subscription_count())
    time.sleep(0.2)  # discovery is one-sided
    rng = np.random.default_rng(4)

    def ask(box: Box) -> None:
        x, y, width, height = (round(v) for v in box.as_tuple())
        if how != 'again':
            x, y = int(rng.integers(0, WIDTH - width)), int(rng.integers(0, HEIGHT - height))
        add.publish(RegionOfInterest(x_offset=x, y_offset=y, width=width, height=height))
        if how == 'and remove':
            for track in live.node._session.others:
                remove.publish(UInt32(data=track.id))

    live.node.set_parameters([Parameter('max_targets', value=3)])
    with asked_meanwhile(live, first, 60, ask):
        assert 1 <= len(live.node._session.asked_for) <= 3
    if how == 'again':
        assert live.node._session.others == ()
        live.says('rejected_requests', 'is followed already, as target')
    elif how == 'anywhere':
        live.says('rejected_requests', '3 targets are followed')
    live.node.set_parameters([Parameter('max_targets', value=8)])
    live.goes_on(first + 45)


def test_slow_subscriber(live: Live) -> None:
    """Who reads an image in half a second does not hold up the answers to others."""
    first = live.begin()
    rig, since = live.rig, len(live.rig.boxes)
    context = rclpy.Context()
    rclpy.init(context=context)
    slow = Node('slow', context=context)
    slow.create_subscription(Image, '/tracker/image_annotated', lambda _: None, 10)
    rig.wait(lambda: live.node._outputs.image_wanted, what='the slow subscriber')
    begun = time.monotonic()
    for index in range(first, first + 40):
        live.send(index)
    live.answered(since, 40)
    assert time.monotonic() - begun < 4
    slow.destroy_node()
    rclpy.shutdown(context=context)
    live.goes_on(first + 40)


def test_publisher_dies_and_returns(live: Live) -> None:
    first = live.begin()
    rig = live.rig
    for publisher in (rig.color, rig.depth, rig.info):
        rig.node.destroy_publisher(publisher)
    rig.wait(lambda: 'nobody publishes' in rig.values()['message'], what='the silence')
    assert rig.values()['level'] == '2'
    rig.color = rig.node.create_publisher(Image, 'color/image', 200)
    rig.depth = rig.node.create_publisher(Image, 'depth/image', 200)
    rig.info = rig.node.create_publisher(CameraInfo, 'color/camera_info', 200)
    rig.await_listener(live.node)
    live.goes_on(first)
    rig.wait(lambda: rig.values()['level'] != '2')


def bomb(width: int, height: int) -> bytes:
    """A small PNG that claims a large image."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        check = zlib.crc32(kind + body)
        return len(body).to_bytes(4, 'big') + kind + body + check.to_bytes(4, 'big')

    size = width.to_bytes(4, 'big') + height.to_bytes(4, 'big')
    head = chunk(b'IHDR', size + bytes((8, 2, 0, 0, 0)))
    body = chunk(b'IDAT', zlib.compress(bytes(100_000)))
    return b'\x89PNG\r\n\x1a\n' + head + body + chunk(b'IEND', b'')


@pytest.fixture
def packed(module_ros_domain: int) -> Iterator[Rig]:
    rig = Rig(namespace='/packed', tracker='/packed/tracker')
    yield rig
    rig.close()


def test_hostile_compressed_images(packed: Rig) -> None:
    rig = packed
    options = {
        'color_transport': 'compressed',
        'depth_transport': 'compressedDepth',
        'queue_policy': 'all',
    }
    with running_node(rig, namespace='/packed', wait=False, **options) as node:

        def send(index: int, color: bytes, depth: bytes) -> None:
            header = rig.header(index)
            rig.send_compressed(
                'color/image/compressed',
                CompressedImage(header=header, format='bgr8; jpeg compressed bgr8', data=color),
            )
            rig.send_compressed(
                'depth/image/compressedDepth',
                CompressedImage(header=header, format='16UC1; compressedDepth png', data=depth),
            )

        def good(index: int) -> tuple[bytes, bytes]:
            color, depth, _ = scene(index)
            return (
                cv2.imencode('.jpg', color)[1].tobytes(),
                bytes(12) + cv2.imencode('.png', depth)[1].tobytes(),
            )

        node._processor._depth_wanted = lambda: True
        rig.wait(lambda: rig.init.get_subscription_count() > 0)
        rig.send_init(scene(0)[2])
        send(0, *good(0))
        rig.wait(lambda: len(rig.boxes) == 1)
        assert rig.box() is not None
        before = resident_mb(os.getpid())
        jpeg, png = good(1)
        hostile = (
            (bomb(60_000, 60_000), bytes(12) + bomb(60_000, 60_000)),
            (bomb(20_000, 20_000), b''),
            (jpeg[: len(jpeg) // 2], png[: len(png) // 2]),
            (b'', bytes(12)),
            (bytes(range(256)) * 10, bytes(range(256)) * 10),
        )
        for index, (color, depth) in enumerate(hostile, 1):
            send(2 * index, color, png)
            send(2 * index + 1, jpeg, depth)
            rig.wait(lambda index=index: len(rig.boxes) == 2 * index + 1)
        assert resident_mb(os.getpid()) - before < 200
        counts = node.statistics.snapshot().counts
        assert counts['bad_color'] == counts['bad_depth'] == 5
        send(20, *good(20))
        rig.wait(lambda: len(rig.boxes) == 12)
        assert rig.boxes[-1].header.frame_id == FRAME_ID
