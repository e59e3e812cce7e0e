# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A camera, listeners and the real tracker node for tests, over real DDS."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, PolygonStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from std_msgs.msg import Bool, Header

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.messages import box_from_polygon
from rgbd_kcf_tracker.ros.messages import image_message, stamp_from_ns
from rgbd_kcf_tracker.ros.process import spin
from rgbd_kcf_tracker.ros.tracker_node import TrackerNode

WIDTH, HEIGHT = 320, 240
FOCAL = 290.0
START_NS = 1_700_000_000_000_000_000
PERIOD_NS = 33_333_333
FRAME_ID = 'camera_optical_frame'


@lru_cache(maxsize=1)
def _textures() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    wall = cv2.resize(rng.integers(60, 200, (24, 32, 3), np.uint8), (WIDTH, HEIGHT))
    target = cv2.resize(rng.integers(0, 255, (10, 6, 3), np.uint8), (36, 60))
    return wall, target


def scene(index: int) -> tuple[np.ndarray, np.ndarray, Box]:
    """Frame ``index`` of a textured upright thing at 2 m that sways before a wall at 4 m."""
    wall, target = _textures()
    color, depth = wall.copy(), np.full((HEIGHT, WIDTH), 60.0, np.uint16)
    x, y = round(140 + 50 * np.sin(index / 15)), 90
    color[y : y + 60, x : x + 36] = target
    depth[y : y + 60, x : x + 36] = 2000
    depth[:4] = 0
    return color, depth, Box(x, y, 36, 60)


def box_text(index: int = 0) -> str:
    """The target in a frame of :func:`scene`, as the parameter ``init_box`` takes it."""
    return ','.join(f'{v:g}' for v in scene(index)[2].as_tuple())


def stamp_of(index: int) -> int:
    return START_NS + index * PERIOD_NS


class Rig:
    """Publishes a camera's topics and keeps what the tracker says."""

    def __init__(self, namespace: str = '', tracker: str = '/tracker') -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=int(os.environ['ROS_DOMAIN_ID']))
        self.node = Node('rig', namespace=namespace, context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.tracker = tracker
        self.boxes: list[PolygonStamped] = []
        self.occluded: list[bool] = []
        self.rois: list[RegionOfInterest] = []
        self.positions: list[PointStamped] = []
        self.diagnostics: list[Any] = []
        qos = QoSProfile(depth=200)
        self.color = self.node.create_publisher(Image, 'color/image', qos)
        self.depth = self.node.create_publisher(Image, 'depth/image', qos)
        self.info = self.node.create_publisher(CameraInfo, 'color/camera_info', qos)
        self.init = self.node.create_publisher(RegionOfInterest, f'{tracker}/init', qos)
        self.init_point = self.node.create_publisher(PointStamped, f'{tracker}/init_point', qos)
        self.compressed: dict[str, Any] = {}

        def listen(kind: Any, topic: str, keep: Callable[[Any], None]) -> None:
            self.node.create_subscription(kind, topic, keep, qos)

        # The box is sent last, and is what is waited for: it is kept when all that has come with it
        # is, which the executor would take in the order of subscriptions.
        listen(
            PolygonStamped,
            f'{tracker}/box',
            lambda m: self.executor.create_task(self.boxes.append, m),
        )
        listen(Bool, f'{tracker}/occluded', lambda m: self.occluded.append(m.data))
        listen(RegionOfInterest, f'{tracker}/roi', self.rois.append)
        listen(PointStamped, f'{tracker}/position', self.positions.append)
        listen(DiagnosticArray, '/diagnostics', lambda m: self.diagnostics.append(m.status[0]))
        self._stopping = False
        self._thread = threading.Thread(
            target=spin, args=(self.executor, self.node, lambda: self._stopping), daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        self._stopping = True
        self._thread.join(5)
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)

    # --- the camera ---

    def header(self, index: int, stamp_ns: int | None = None, frame_id: str = FRAME_ID) -> Header:
        stamp = stamp_of(index) if stamp_ns is None else stamp_ns
        return Header(stamp=stamp_from_ns(stamp), frame_id=frame_id)

    def send_color(self, index: int, **header: Any) -> Image:
        message = image_message(self.header(index, **header), scene(index)[0], 'bgr8')
        self.color.publish(message)
        return message

    def send_depth(self, index: int, **header: Any) -> Image:
        message = image_message(self.header(index, **header), scene(index)[1], '16UC1')
        self.depth.publish(message)
        return message

    def send_info(self, index: int = 0, **header: Any) -> None:
        info = CameraInfo(header=self.header(index, **header), width=WIDTH, height=HEIGHT)
        info.k = [FOCAL, 0.0, 159.5, 0.0, FOCAL, 119.5, 0.0, 0.0, 1.0]
        self.info.publish(info)

    def send(self, index: int, **header: Any) -> None:
        """A whole frame, in the order in which kinect2_bridge publishes one."""
        self.send_info(index, **header)
        self.send_color(index, **header)
        self.send_depth(index, **header)

    def send_images(self, index: int, color: np.ndarray, depth_m: np.ndarray) -> None:
        """Any pictures, and the answer to them awaited."""
        before = len(self.boxes)
        header = self.header(index)
        self.color.publish(image_message(header, color, 'bgr8'))
        millimetres = np.nan_to_num(depth_m * 1000).astype(np.uint16)
        self.depth.publish(image_message(header, millimetres, '16UC1'))
        self.wait(lambda: len(self.boxes) > before, what=f'box of frame {index}')

    def send_compressed(self, topic: str, message: CompressedImage) -> None:
        if topic not in self.compressed:
            publisher = self.node.create_publisher(CompressedImage, topic, QoSProfile(depth=50))
            self.compressed[topic] = publisher
            self.wait(lambda: publisher.get_subscription_count() > 0)
            time.sleep(0.2)  # discovery is one-sided
        self.compressed[topic].publish(message)

    def play(self, indices: Any, **header: Any) -> None:
        """Frames in lock-step: each is answered before the next is sent."""
        for index in indices:
            before = len(self.boxes)
            self.send(index, **header)
            self.wait(lambda before=before: len(self.boxes) > before, what=f'box of frame {index}')

    def play_until_heard(self, index: int) -> None:
        """A frame, again and again until it is answered.

        Publishers that were made a moment ago may see a subscription that does not see them yet
        (discovery is one-sided), and a message that is sent into that gap is for nobody.
        """
        for _ in range(12):
            self.send(index)
            with contextlib.suppress(AssertionError):
                self.wait(lambda: len(self.boxes) > 0, timeout=5.0)
                return
        raise AssertionError(f'frame {index} is not answered, however often it is sent')

    def send_init(self, box: Box) -> None:
        x, y, width, height = (round(v) for v in box.as_tuple())
        self.init.publish(RegionOfInterest(x_offset=x, y_offset=y, width=width, height=height))

    def await_request(self, tracker: TrackerNode) -> None:
        """Until a tracker in this process has its first target, or waits for an image with it."""
        session = tracker._session
        self.wait(lambda: session._choice is not None or bool(session.asked_for), what='a request')

    # --- what came back ---

    def wait(self, condition: Callable[[], bool], timeout: float = 60.0, what: str = '') -> None:
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                raise AssertionError(
                    f'waited {timeout} s in vain for {what or condition}: {len(self.boxes)} boxes, '
                    f'last diagnostics {self.values() if self.diagnostics else None}'
                )
            time.sleep(0.002)

    def box(self, at: int = -1) -> Box | None:
        return box_from_polygon(self.boxes[at].polygon.points)

    def values(self) -> dict[str, str]:
        """Key values of the last diagnostics, with its sentence and level."""
        if not self.diagnostics:
            return {}
        status = self.diagnostics[-1]
        found = {pair.key: pair.value for pair in status.values}
        return found | {'message': status.message, 'level': str(status.level[0])}

    def fresh_values(self) -> dict[str, str]:
        """The diagnostics after everything that happened so far."""
        seen = len(self.diagnostics)
        self.wait(lambda: len(self.diagnostics) > seen + 1, what='diagnostics')
        return self.values()

    def await_listener(self, tracker: TrackerNode | None = None) -> None:
        """Until the tracker hears the camera, and its answers and requests find their way.

        Discovery is one-sided. The tracker's side is asked where it runs in this process; another
        process has seen the listeners of its answers when its diagnostics arrive, for their
        listener was announced last.
        """
        topics = (self.color, self.depth, self.info, self.init, self.init_point)
        self.wait(lambda: all(p.get_subscription_count() for p in topics), 60.0, 'the tracker')
        if tracker is not None:
            # Both ways: what is sent before the tracker sees its publisher too is for nobody.
            sent = {p.topic_name for p in topics}
            listeners = [s for s in tracker.subscriptions if s.topic_name in sent]
            self.wait(
                lambda: all(s.get_publisher_count() for s in listeners),
                60.0,
                'its sight of the camera',
            )
            outputs, heard = tracker._outputs, ('box', 'occluded', 'roi', 'position')
            self.wait(lambda: all(map(outputs.wanted, heard)), 60.0, 'its answers')
            return
        name = f'{self.tracker}: tracker'
        self.wait(lambda: any(d.name == name for d in self.diagnostics), 60.0, 'diagnostics')


def play_hidden(rig: Rig, indices: range) -> None:
    """The scene's target behind a panel that stands nearer."""
    for index in indices:
        color, depth, box = scene(index)
        x, y = int(box.x) - 40, int(box.y) - 40
        color[y : y + 160, x : x + 120] = (40, 90, 140)
        depth[y : y + 160, x : x + 120] = 1000
        rig.send_info(index)
        rig.send_images(index, color, depth / 1000)


def overrides(values: dict[str, Any]) -> list[Parameter]:
    return [Parameter(name, value=value) for name, value in values.items()]


@contextmanager
def spinning(*nodes: Node) -> Iterator[None]:
    """Nodes of one context in an executor and a thread of their own, as processes spin them."""
    executor = SingleThreadedExecutor(context=nodes[0].context)
    for node in nodes:
        executor.add_node(node)
    stop = threading.Event()
    told = (executor, nodes[0], stop.is_set)
    thread = threading.Thread(target=spin, args=told, daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(5)


@contextmanager
def running_node(
    rig: Rig, namespace: str = '', wait: bool = True, **values: Any
) -> Iterator[TrackerNode]:
    """The node in this process, in an executor and context of its own.

    Parameters of a variant are given with two underscores: ``kcf__padding=2.0``.
    """
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(os.environ['ROS_DOMAIN_ID']))
    names = {name.replace('__', '.'): value for name, value in values.items()}
    node = TrackerNode(context=context, namespace=namespace, parameter_overrides=overrides(names))
    if node.settings.autostart:
        node.autostart()
    try:
        with spinning(node):
            if node.settings.autostart and wait:
                rig.await_listener(node)
            yield node
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


@contextmanager
def tracker_process(*arguments: str, **popen: Any) -> Iterator[subprocess.Popen[str]]:
    """The node as its executable runs it; ended by SIGINT if the test has not."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'rgbd_kcf_tracker.ros.tracker_main', '--ros-args', *arguments],
        stderr=subprocess.STDOUT,
        stdout=subprocess.PIPE,
        text=True,
        **popen,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
        if process.stdout is not None and not process.stdout.closed:
            process.stdout.close()
        process.wait(20)
