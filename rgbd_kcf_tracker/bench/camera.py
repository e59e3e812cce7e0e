# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A camera for the live benchmark and the soak run: a process of its own that publishes pairs.

Started by them, not by people. Frames are rendered beforehand and played there and back, so that
publishing costs what it costs a driver.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections.abc import Iterator
from typing import Any

from rgbd_kcf_tracker.live.memory import keep_large_blocks

SIZES = {'hd': (1920, 1080), 'qhd': (960, 540), 'sd': (512, 424), 'small': (320, 240)}
SCENARIO, SEED = 'normal', 1
START = 30
"""First frame of the scene that is played: the person is whole in view from there."""
NAMESPACE = '/rgbd_kcf_benchmark'
WIRE = f'{NAMESPACE}/wire'
"""Namespace of the node that only answers, and of the topics that it is sent."""
BLOCK = 60
"""Pairs to the tracker, then as many to the wire: so both are measured on the same machine at the
same time, and neither waits for the other's processor."""
FRAME_ID = 'kinect2_rgb_optical_frame'
MATCH_TIMEOUT_S = 30.0
ANSWER_TIMEOUT_S = 20.0
SETTLE_S = 0.5


def main(args: list[str] | None = None) -> int:
    """Publish as the arguments say; the exit status is 1 where nobody listened."""
    parser = argparse.ArgumentParser()
    parser.add_argument('--size', choices=SIZES, default='qhd')
    parser.add_argument('--rate', type=float, default=30.0, help='0: as answers allow')
    parser.add_argument('--count', type=int, default=300)
    parser.add_argument('--frames', type=int, default=20, help='different frames to play')
    parser.add_argument('--ahead', type=int, default=3, help='with rate 0: pairs under way at most')
    parser.add_argument('--wire', action='store_true', help='send as many pairs to the wire')
    parser.add_argument('--compressed', action='store_true', help='JPEG and compressedDepth PNG')
    options = parser.parse_args(args)
    keep_large_blocks()
    import rclpy
    from rclpy.executors import ExternalShutdownException

    rclpy.init()
    camera = CameraNode(
        options.size, options.frames, options.compressed, options.wire, answered=options.rate <= 0
    )
    try:
        if not camera.await_listener(MATCH_TIMEOUT_S):
            return 1
        if options.rate > 0:
            camera.play(options.count, options.rate)
        else:
            camera.play_answered(options.count, options.ahead)
        camera.await_delivery()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        camera.node.destroy_node()
        rclpy.try_shutdown()
    return 0


class CameraNode:
    """Publishers of a colour, a depth and a camera_info topic, and what they send."""

    def __init__(
        self,
        size: str,
        frames: int,
        compressed: bool,
        wire: bool = False,
        answered: bool = False,
    ) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PolygonStamped
        from rclpy.node import Node
        from rclpy.qos import QoSProfile
        from sensor_msgs.msg import CameraInfo, CompressedImage, Image

        self.node = Node('camera', namespace=NAMESPACE)
        qos = QoSProfile(depth=5)
        kind: Any = CompressedImage if compressed else Image
        color, depth = ('/compressed', '/compressedDepth') if compressed else ('', '')
        self._publishers = [
            (
                self.node.create_publisher(CameraInfo, f'{where}/color/camera_info', qos),
                self.node.create_publisher(kind, f'{where}/color/image{color}', qos),
                self.node.create_publisher(kind, f'{where}/depth/image{depth}', qos),
            )
            for where in (NAMESPACE, *([WIRE] if wire else []))
        ]
        self._answers = self._stamp_ns = 0
        self._known = False
        if answered:  # else each answer would wake one more than the wire's
            self.node.create_subscription(
                PolygonStamped, 'tracker/box', self._answered, QoSProfile(depth=100)
            )
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._heard, 10)
        messages = _messages(SIZES[size], frames)
        self._messages = [_packed(m) for m in messages] if compressed else list(messages)

    def _answered(self, _: Any) -> None:
        self._answers += 1

    def _heard(self, message: Any) -> None:
        """The tracker knows this node: its answers will come here."""
        self._known |= any(status.name.startswith(NAMESPACE) for status in message.status)

    def await_listener(self, timeout_s: float) -> bool:
        """Until all topics have their listener and the tracker's answers come here."""
        import rclpy

        end = time.monotonic() + timeout_s
        topics = [publisher for each in self._publishers for publisher in each]
        while not (self._known and all(p.get_subscription_count() for p in topics)):
            if time.monotonic() > end:
                return False
            rclpy.spin_once(self.node, timeout_sec=0.01)
        time.sleep(SETTLE_S)
        return True

    def play(self, count: int, rate: float) -> None:
        """Send each listener so many pairs at a rate, each stamped when it goes out."""
        orders = [self._order() for _ in self._publishers]
        begin = time.monotonic()
        sent = 0
        for first in range(0, count, BLOCK):
            for to, order in enumerate(orders):
                for _ in range(first, min(first + BLOCK, count)):
                    time.sleep(max(begin + sent / rate - time.monotonic(), 0.0))
                    self._send(next(order), to)
                    sent += 1

    def play_answered(self, count: int, ahead: int) -> None:
        """Send pairs as fast as they are answered."""
        import rclpy

        order = self._order()
        for index in range(count):
            end = time.monotonic() + ANSWER_TIMEOUT_S
            while index - self._answers >= ahead and time.monotonic() < end:
                rclpy.spin_once(self.node, timeout_sec=0.5)
            if index - self._answers >= ahead:
                raise SystemExit(f'no answer to pair {index} within {ANSWER_TIMEOUT_S:g} s')
            self._send(next(order))

    def await_delivery(self) -> None:
        """Stay until what was sent last has been read."""
        time.sleep(SETTLE_S)

    def _order(self) -> Iterator[tuple[Any, Any, Any]]:
        there_and_back = self._messages + self._messages[-2:0:-1]
        return itertools.cycle(there_and_back)

    def _send(self, messages: tuple[Any, Any, Any], to: int = 0) -> None:
        from rgbd_kcf_tracker.ros.messages import stamp_from_ns

        color, depth, info = messages
        # A clock that is set back would make an image late, which is not answered.
        self._stamp_ns = max(time.time_ns(), self._stamp_ns + 1)
        stamp = stamp_from_ns(self._stamp_ns)
        color.header.stamp = depth.header.stamp = info.header.stamp = stamp
        for publisher, message in zip(self._publishers[to], (info, color, depth), strict=True):
            publisher.publish(message)


def _messages(size: tuple[int, int], frames: int) -> Iterator[tuple[Any, Any, Any]]:
    import numpy as np
    from sensor_msgs.msg import CameraInfo
    from std_msgs.msg import Header

    from rgbd_kcf_tracker.ros.messages import image_message
    from rgbd_kcf_tracker.simulation import simulate

    scene = simulate(SCENARIO, seed=SEED, size=size)
    for simulated in itertools.islice(scene, START, START + frames):
        frame = simulated.frame
        header = Header(frame_id=FRAME_ID)
        assert frame.depth is not None
        assert frame.intrinsics is not None
        millimetres = np.nan_to_num(frame.depth * 1000).astype(np.uint16)
        camera = frame.intrinsics
        info = CameraInfo(header=header, width=size[0], height=size[1])
        info.k = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0]
        yield (
            image_message(header, frame.color, 'bgr8'),
            image_message(header, millimetres, '16UC1'),
            info,
        )


def _packed(messages: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """The same as image_transport's plugins would send it."""
    import array

    import cv2
    import numpy as np
    from sensor_msgs.msg import CompressedImage

    color, depth, info = messages
    shape = color.height, color.width
    picture = np.frombuffer(color.data, np.uint8).reshape(*shape, 3)
    millimetres = np.frombuffer(depth.data, np.uint16).reshape(shape)
    jpeg = cv2.imencode('.jpg', picture, (cv2.IMWRITE_JPEG_QUALITY, 95))[1].tobytes()
    png = bytes(12) + cv2.imencode('.png', millimetres)[1].tobytes()
    return (
        CompressedImage(format='bgr8; jpeg compressed bgr8', data=array.array('B', jpeg)),
        CompressedImage(format='16UC1; compressedDepth png', data=array.array('B', png)),
        info,
    )


if __name__ == '__main__':
    sys.exit(main())
