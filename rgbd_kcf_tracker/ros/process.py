# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a node's process needs around the node: signals, and a loop that holds.

SIGINT and SIGTERM end the loop; a second SIGINT (``ros2 launch`` sends one too, beside the
terminal's) cannot interrupt the clean-up.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.executors import (
    Executor,
    ExternalShutdownException,
    ShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from rgbd_kcf_tracker.live.memory import keep_large_blocks

__all__ = ['keep_large_blocks', 'run', 'spin']

_SPIN_PERIOD_S = 0.1


def spin(executor: Executor, node: Node, stopped: Callable[[], bool]) -> None:
    """Run callbacks until ``stopped`` or the context ends; what a callback raises is logged.

    A message whose strings are no UTF-8, or a lifecycle request that does not fit the state, raises
    inside rclpy: it must not end the node.
    """
    while not stopped() and executor.context.ok():
        try:
            executor.spin_once(timeout_sec=_SPIN_PERIOD_S)
        except (ExternalShutdownException, ShutdownException):
            break
        except Exception as error:
            node.get_logger().error(f'{type(error).__name__}: {error}')


def run(make: Callable[[], Node], args: list[str] | None = None) -> int:
    """Start ROS, make a node, and let it live until a signal; returns the exit status.

    Args:
        make: makes the node; an error that it raises is printed, and the status is 1.
        args: the command line, sys.argv where None.
    """
    stop: list[int] = []

    def on_signal(number: int, _: Any) -> None:
        stop.append(number)

    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    executor = SingleThreadedExecutor()
    node: Node | None = None
    try:
        node = make()
        executor.add_node(node)
        spin(executor, node, lambda: bool(stop))
        return 0
    except Exception as error:
        print(f'cannot start: {error}', file=sys.stderr)
        return 1
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
        if node is not None:
            executor.remove_node(node)
            node.destroy_node()
        executor.shutdown(timeout_sec=0.5)
        rclpy.try_shutdown()
