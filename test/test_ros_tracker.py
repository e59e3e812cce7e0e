# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The tracker node over real DDS: results, requests, headers, start and end of its process."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from ros_rig import (
    FOCAL,
    FRAME_ID,
    HEIGHT,
    PERIOD_NS,
    WIDTH,
    Rig,
    running_node,
    scene,
    stamp_of,
    tracker_process,
)
from std_srvs.srv import Trigger

from rgbd_kcf_tracker import Frame, Intrinsics, create_tracker
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.images import metres_from_mm
from rgbd_kcf_tracker.ros.messages import stamp_to_ns
from rgbd_kcf_tracker.variants import VARIANTS

pytestmark = pytest.mark.ros

INTRINSICS = Intrinsics(FOCAL, FOCAL, 159.5, 119.5)


def offline(variant: str, count: int) -> list[Box | None]:
    """What the tracker says without ROS, as the wire's float32 carry it."""
    tracker = create_tracker(variant)
    boxes = []
    for index in range(count):
        color, depth, truth = scene(index)
        frame = Frame(
            color, metres_from_mm(depth), stamp_of(index), Intrinsics(290, 290, 159.5, 119.5)
        )
        boxes.append((tracker.update(frame) if index else tracker.start(frame, truth)).box)
    return boxes


def corners(box: Box | None) -> list[float]:
    if box is None:
        return []
    return [float(np.float32(v)) for v in (box.x, box.y, box.right, box.bottom)]


def seen_corners(message) -> list[float]:
    points = message.polygon.points
    return [points[0].x, points[0].y, points[2].x, points[2].y] if points else []


def box_text(box: Box) -> str:
    return ','.join(f'{v:g}' for v in box.as_tuple())


@pytest.mark.parametrize('variant', list(VARIANTS))
def test_process_answers_each_pair_as_offline(rig: Rig, variant: str) -> None:
    """In lock-step with the process: one answer per pair, bit for bit that of the engine."""
    count = 40
    with tracker_process(
        *('-p', f'init_box:={box_text(scene(0)[2])}', '-p', 'queue_policy:=all'),
        *('-p', f'variant:={variant}'),
    ):
        rig.await_listener()
        rig.play(range(count))
    assert [stamp_to_ns(m.header.stamp) for m in rig.boxes] == [stamp_of(i) for i in range(count)]
    assert {m.header.frame_id for m in rig.boxes} == {FRAME_ID}
    assert [seen_corners(m) for m in rig.boxes] == [corners(b) for b in offline(variant, count)]
    assert rig.box().iou(scene(count - 1)[2]) > 0.5
    rig.wait(lambda: len(rig.occluded) == count)
    assert not any(rig.occluded)
    assert len(rig.rois) == count
    assert rig.rois[0].width == 36


def slowness() -> float:
    """How much longer than on an idle machine things take now; 1 there."""
    begun = time.monotonic()
    subprocess.run([sys.executable, '-S', '-c', 'sum(range(10**6))'], check=True)
    return max((time.monotonic() - begun) / 0.05, 1.0)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_process_ends_cleanly_within_a_second(rig: Rig, number: signal.Signals) -> None:
    with tracker_process() as process:
        rig.await_listener()
        rig.send(0)
        started = time.monotonic()
        process.send_signal(number)
        time.sleep(0.05)
        process.send_signal(number)  # ros2 launch and the terminal both send one
        assert process.wait(20) == 0
        assert time.monotonic() - started < 1.0 * slowness()
        output = process.stdout.read()
    assert 'Traceback' not in output


def test_init_reset_and_init_again(rig: Rig) -> None:
    with running_node(rig, queue_policy='all') as node:
        rig.play(range(3))
        assert [rig.box(i) for i in range(3)] == [None] * 3
        rig.send_init(scene(2)[2])
        rig.await_request(node)
        rig.play(range(3, 12))
        assert rig.box().iou(scene(11)[2]) > 0.6
        client = rig.node.create_client(Trigger, '/tracker/reset')
        assert client.wait_for_service(20)
        answer = client.call_async(Trigger.Request())
        rig.wait(answer.done)
        assert answer.result().success
        rig.play(range(12, 14))
        assert rig.box() is None
        rig.send_init(scene(13)[2])
        rig.await_request(node)
        rig.play(range(14, 20))
        assert rig.box().iou(scene(19)[2]) > 0.6


def test_init_before_the_first_image_waits_for_it(rig: Rig) -> None:
    with running_node(rig, queue_policy='all') as node:
        rig.send_init(scene(0)[2])
        rig.await_request(node)
        rig.play(range(5))
        assert corners(rig.box(0)) == corners(scene(0)[2])
        assert rig.box().iou(scene(4)[2]) > 0.6


def test_init_outside_the_image_keeps_the_target(rig: Rig) -> None:
    with running_node(rig, init_box=box_text(scene(0)[2]), queue_policy='all'):
        rig.play(range(3))
        rig.send_init(Box(WIDTH + 50, HEIGHT + 50, 20, 20))
        rig.wait(lambda: rig.values().get('last_error', ''), what='a refusal')
        rig.play(range(3, 6))
        assert rig.box().iou(scene(5)[2]) > 0.6
        values = rig.fresh_values()
        assert int(values['rejected_requests']) == 1
        assert 'outside the 320x240 image' in values['last_error']


def test_every_pair_at_30_hz(rig: Rig) -> None:
    """Free running, as a camera does it: order is kept, and nothing is lost or passed over."""
    count = 60
    # Best effort may lose an image on its way, which says nothing of the node.
    quality = {'reliability': 'reliable', 'qos_depth': count}
    with running_node(rig, init_box=box_text(scene(0)[2]), **quality) as node:
        begun = time.monotonic()
        for index in range(count):
            rig.send(index)
            time.sleep(max(begun + (index + 1) / 30 - time.monotonic(), 0))

        def done() -> int:
            counts = node.statistics.snapshot().counts
            return counts.get('processed', 0) + counts.get('dropped', 0)

        rig.wait(lambda: done() == count, what='all pairs')
        counts = node.statistics.snapshot().counts
        rig.wait(lambda: len(rig.boxes) == counts['processed'], what='all boxes')
        slow = node.statistics.snapshot().times_ms['work'][-1] > 30
    stamps = [stamp_to_ns(m.header.stamp) for m in rig.boxes]
    assert stamps == sorted(set(stamps))
    assert set(stamps) <= {stamp_of(i) for i in range(count)}
    # On a machine so busy that a frame takes longer than the camera's period, some are dropped.
    assert slow or counts['processed'] == count
    numbers = [round((stamp - stamp_of(0)) / PERIOD_NS) for stamp in stamps]
    overlaps = [rig.box(i).iou(scene(n)[2]) if rig.box(i) else 0 for i, n in enumerate(numbers)]
    assert np.mean(overlaps) > (0.4 if slow else 0.7)
