# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A node that does nothing but answer pairs: what the wire itself costs, for the live benchmark.

It hears the camera as the tracker does and answers each pair on ``wire/box`` from the callback that
completes it. Started by the benchmark, not by people.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

from rgbd_kcf_tracker.bench.camera import WIRE
from rgbd_kcf_tracker.live.memory import keep_large_blocks


def main() -> int:
    """Answer until a signal comes."""
    keep_large_blocks()
    import rclpy
    from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

    rclpy.init()
    node = make()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


def make() -> Any:
    """The node; it listens once somebody listens to it."""
    from geometry_msgs.msg import PolygonStamped
    from rclpy.node import Node
    from sensor_msgs.msg import CameraInfo, Image

    from rgbd_kcf_tracker.live.settings import NodeParameters
    from rgbd_kcf_tracker.ros.publishers import RESULT_DEPTH
    from rgbd_kcf_tracker.ros.subscriptions import CAMERA_INFO, COLOR, DEPTH, image_qos

    node = Node('wire', namespace=WIRE)
    answers = node.create_publisher(PolygonStamped, 'box', RESULT_DEPTH)
    waiting: dict[str, Any] = {}

    def came(topic: str, message: Any) -> None:
        waiting[topic] = message
        if len(waiting) == 2 and waiting[COLOR].header.stamp == waiting[DEPTH].header.stamp:
            answers.publish(PolygonStamped(header=waiting[COLOR].header))
            waiting.clear()

    def listen() -> None:
        if answers.get_subscription_count():
            timer.cancel()
            qos = image_qos(NodeParameters())
            for topic in (COLOR, DEPTH):
                node.create_subscription(Image, topic, partial(came, topic), qos)
            node.create_subscription(CameraInfo, CAMERA_INFO, lambda _: None, qos)

    timer = node.create_timer(0.05, listen)
    return node


if __name__ == '__main__':
    sys.exit(main())
