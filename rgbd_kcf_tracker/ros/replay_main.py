# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The executable ``replay``."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from types import FrameType
from typing import Any

from rgbd_kcf_tracker.live.memory import keep_large_blocks


def main(args: list[str] | None = None) -> int:
    """Replay a recording; 0 at its end or when told to stop, 2 for what the user can mend."""
    keep_large_blocks()  # before NumPy and ROS allocate
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    from rgbd_kcf_tracker.errors import RgbdKcfError
    from rgbd_kcf_tracker.ros.replay_node import ReplayNode
    from rgbd_kcf_tracker.ros.transport import ensure_image_transport

    stop = _stop_on_signals()
    ensure_image_transport()
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # rclpy has no common class for arguments that it cannot parse
        print(f'replay: {error}', file=sys.stderr)
        return 2
    node: ReplayNode | None = None
    executor = SingleThreadedExecutor()
    spinning = threading.Thread(target=_spin, args=(executor,), name='spin', daemon=True)
    try:
        node = ReplayNode()
        executor.add_node(node)
        spinning.start()
        node.run(stop)
    except RgbdKcfError as error:
        if node is None:
            print(f'replay: {error}', file=sys.stderr)
        else:
            node.get_logger().fatal(str(error))
        return 2
    finally:
        executor.shutdown(timeout_sec=1.0)
        if spinning.is_alive():
            spinning.join(timeout=1.0)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _spin(executor: Any) -> None:
    from rclpy.executors import ExternalShutdownException

    with contextlib.suppress(ExternalShutdownException):
        executor.spin()


def _stop_on_signals() -> threading.Event:
    """An event that SIGINT and SIGTERM set, however often they come."""
    stop = threading.Event()

    def handler(number: int, frame: FrameType | None) -> None:
        stop.set()

    signal.signal(signal.SIGINT, handler)
    signal.signal(signal.SIGTERM, handler)
    return stop


if __name__ == '__main__':
    sys.exit(main())
