# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The processes of a live measurement: camera, tracker, and what is read from the outside."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from rgbd_kcf_tracker.bench.camera import NAMESPACE, WIRE
from rgbd_kcf_tracker.ros.transport import PROFILE_VARIABLE, fitting_profile


def environment(with_profile: bool = True) -> dict[str, str]:
    """For the children: that of this process, and the profile."""
    variables = dict(os.environ)
    path = fitting_profile()
    if with_profile and path is not None:
        variables.setdefault(PROFILE_VARIABLE, str(path))
    return variables


@contextmanager
def child(module: str, *arguments: str, env: dict[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    """A module run as a process; ended by SIGINT, or by force if it does not heed that."""
    process = subprocess.Popen([sys.executable, '-m', module, *arguments], env=env)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def cpu_seconds(pid: int) -> float:
    """Processor time that a process has used, all threads, user and system."""
    fields = Path(f'/proc/{pid}/stat').read_text(encoding='ascii').rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def resident_mb(pid: int) -> float:
    """Memory of a process that is in use, in MB."""
    pages = int(Path(f'/proc/{pid}/statm').read_text(encoding='ascii').split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 1e6


class Listener:
    """Hears the tracker's boxes and diagnostics: what a consumer would see."""

    def __init__(self) -> None:
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PolygonStamped
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        from rclpy.qos import QoSProfile

        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = Node('listener', namespace=NAMESPACE, context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self.arrivals: list[tuple[int, int, bool]] = []
        """For each box message: stamp and arrival in nanoseconds, and whether it has a box."""
        self.wire: list[tuple[int, int, bool]] = []
        """The same of the node that only answers."""
        self.diagnostics: dict[str, str] = {}
        for topic, kept in (('tracker/box', self.arrivals), (f'{WIRE}/box', self.wire)):
            self.node.create_subscription(
                PolygonStamped, topic, partial(self._on_box, kept), QoSProfile(depth=1000)
            )
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)

    def _on_box(self, kept: list[tuple[int, int, bool]], message: Any) -> None:
        from rgbd_kcf_tracker.ros.messages import stamp_to_ns

        stamp = stamp_to_ns(message.header.stamp)
        kept.append((stamp, time.time_ns(), bool(message.polygon.points)))

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if status.name.startswith(NAMESPACE):
                self.diagnostics = {pair.key: pair.value for pair in status.values}

    def await_tracker(self, process: subprocess.Popen[bytes], timeout_s: float = 60.0) -> None:
        """Until the tracker knows this listener: its diagnostics, listened to last, have come.

        Raises:
            RuntimeError: where the process ends or says nothing.
        """
        end = time.monotonic() + timeout_s
        while not self.diagnostics:
            if process.poll() is not None or time.monotonic() > end:
                raise RuntimeError('the tracker did not start')
            self.spin(0.2)

    def spin(self, seconds: float) -> None:
        """Listen for at most that long."""
        self._executor.spin_once(timeout_sec=seconds)

    def close(self) -> None:
        """Leave ROS."""
        import rclpy

        self.node.destroy_node()
        rclpy.shutdown(context=self.context)
