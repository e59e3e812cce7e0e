# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The real replay and tracker nodes as processes, and a listener in this one."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import PolygonStamped
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, Image

from rgbd_kcf_tracker import Box
from rgbd_kcf_tracker.recordings import GENERIC, BagWriter
from rgbd_kcf_tracker.ros.messages import stamp_to_ns
from rgbd_kcf_tracker.simulation import SimulatedFrame, simulate

SIZE = (320, 180)
BAG, TRACKER = 'replay_main', 'tracker_main'


@lru_cache(maxsize=1)
def frames(count: int = 45) -> tuple[SimulatedFrame, ...]:
    """A person who walks behind something, small and quick to make."""
    sequence = simulate('occlusion', seed=4, size=SIZE)
    return tuple(sequence[i] for i in range(count))


def write_bag(path: Path, **options: Any) -> Path:
    with BagWriter(path, GENERIC, **options) as bag:
        for made in frames():
            bag.write_frame(made.frame)
            bag.write_truth(made.frame, made.visible, made.body)
    return path


def first_box() -> Box:
    box = frames()[0].visible
    assert box is not None
    return box


def box_text(box: Box) -> str:
    return ','.join(repr(v) for v in box.as_tuple())


def told(module: str, folder: Path, parameters: dict[str, Any]) -> list[str]:
    """The arguments that tell a node its parameters, by a file."""
    lines = ['/**:', '  ros__parameters:']
    lines += [f'    {name}: {json.dumps(value)}' for name, value in parameters.items()]
    file = folder / f'{module}.yaml'
    file.write_text('\n'.join(lines) + '\n', encoding='utf-8')
    return ['--ros-args', '--params-file', str(file)]


def start(module: str, *, folder: Path, **parameters: Any) -> subprocess.Popen[str]:
    """A node of this package as its own process."""
    command = [sys.executable, '-m', f'rgbd_kcf_tracker.ros.{module}']
    command += told(module, folder, parameters)
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=dict(os.environ)
    )


@contextmanager
def running_tracker(folder: Path, **parameters: Any) -> Iterator[subprocess.Popen[str]]:
    process = start('tracker_main', folder=folder, **parameters)
    try:
        yield process
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=10)
        assert process.returncode == 0, output
        assert 'Traceback' not in output, output
    finally:
        process.kill()


def run_replay(folder: Path, timeout: float = 60.0, **parameters: Any) -> tuple[int, str]:
    """Replay to the end; returns exit status and what it said."""
    process = start('replay_main', folder=folder, **parameters)
    try:
        output, _ = process.communicate(timeout=timeout)
    finally:
        process.kill()
    assert 'Traceback' not in output, output
    return process.returncode, output


class Listener:
    """Keeps the messages of a topic or two."""

    def __init__(
        self, images: bool = False, clock: bool = False, tracker: str = '/tracker'
    ) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = Node('listener', context=self.context)
        self.boxes: list[PolygonStamped] = []
        self.colors: list[Image] = []
        self.depths: list[Image] = []
        self.infos: list[CameraInfo] = []
        self.clock: list[int] = []
        qos = QoSProfile(depth=500)

        def listen(kind: Any, topic: str, keep: Any) -> Any:
            return self.node.create_subscription(kind, topic, keep, qos)

        self._box = listen(PolygonStamped, '/tracker/box', self.boxes.append)
        if images:
            listen(Image, '/color/image', self.colors.append)
            listen(Image, '/depth/image', self.depths.append)
            listen(CameraInfo, '/color/camera_info', self.infos.append)
        if clock:
            from rclpy.qos import ReliabilityPolicy
            from rosgraph_msgs.msg import Clock

            self.node.create_subscription(
                Clock, '/clock', lambda m: self.clock.append(stamp_to_ns(m.clock)),
                QoSProfile(depth=500, reliability=ReliabilityPolicy.BEST_EFFORT),
            )  # fmt: skip
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def await_tracker(self, timeout: float = 30.0) -> None:
        """Until the tracker's answers find their way here."""
        end = time.monotonic() + timeout
        while not self._box.get_publisher_count():
            assert time.monotonic() < end, 'the tracker did not come up'
            time.sleep(0.02)
        time.sleep(0.3)  # discovery is one-sided

    def await_each(self, count: int, *kept: list[Any], timeout: float = 20.0) -> None:
        """Until so many of each have come, or time is up."""
        end = time.monotonic() + timeout
        while min(map(len, kept)) < count and time.monotonic() < end:
            time.sleep(0.02)

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self.executor.spin()

    def __enter__(self) -> Listener:
        return self

    def __exit__(self, *_: object) -> None:
        self.executor.shutdown(timeout_sec=2.0)
        self._thread.join(2.0)
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)
