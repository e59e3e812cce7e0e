# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a node's process needs around the node: arguments, signals, and a loop that holds."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, TypeVar

from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.live.stopping import Stop

if TYPE_CHECKING:
    from rclpy.executors import Executor
    from rclpy.node import Node

N = TypeVar('N', bound='Node')

USER_MISTAKE, FAILURE = 2, 1
_SPIN_PERIOD_S = 0.25
SAY_AGAIN_S = 5.0
"""A clock of negative seconds, a thousand times a second, would fill the disk with its error."""


def spin(executor: Executor, node: Node, stopped: Callable[[], bool]) -> None:
    """Run callbacks until ``stopped`` or the context ends; what a callback raises is logged.

    A message whose strings are no UTF-8, or a lifecycle request that does not fit the state, raises
    inside rclpy: it must not end the node, nor fill the log.
    """
    from rclpy.executors import ExternalShutdownException, ShutdownException

    while not stopped() and executor.context.ok():
        try:
            executor.spin_once(timeout_sec=_SPIN_PERIOD_S)
        except (ExternalShutdownException, ShutdownException):
            break
        except Exception as error:
            node.get_logger().error(
                f'{type(error).__name__}: {error}', throttle_duration_sec=SAY_AGAIN_S
            )


def ends_at_once(parser: argparse.ArgumentParser, arguments: Sequence[str] | None) -> int | None:
    """Print the help where it is asked for, wherever among ROS's arguments, or that ROS is missing.

    Returns:
        The exit status; None where the node can be made.
    """
    given = sys.argv[1:] if arguments is None else arguments
    if {'-h', '--help'} & set(given):
        parser.print_help()
        return 0
    if find_spec('rclpy') is None:
        print(
            f'{parser.prog}: rclpy is missing: source ROS 2 (. /opt/ros/jazzy/setup.bash), or '
            "pip install 'rgbd_kcf_tracker[ros]'",
            file=sys.stderr,
        )
        return USER_MISTAKE
    return None


def node_parser(program: str, description: str, example: str) -> argparse.ArgumentParser:
    """The command line of a node's executable: it takes ROS's arguments alone."""
    return argparse.ArgumentParser(
        prog=program,
        usage=f'{program} [-h] [--ros-args [-p NAME:=VALUE] [-r FROM:=TO] [--params-file FILE]]',
        description=description,
        epilog=f'Example: {example}. Parameters: docs/parameters.md, or `ros2 param list`.',
    )


def run(
    parser: argparse.ArgumentParser,
    make: Callable[[], N],
    live: Callable[[Executor, N], None],
    stop: Stop,
    arguments: Sequence[str] | None = None,
) -> int:
    """Start ROS, make a node and let it live; returns the exit status.

    Args:
        parser: of the executable.
        make: makes the node.
        live: returns when the node's time is over.
        stop: asked between the steps of starting.
        arguments: the command line without the program, that of the process where None.

    Returns:
        0 at the end or when told to stop, 2 for what the user can mend, 1 for any other failure.
    """
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions
    from rclpy.utilities import remove_ros_args

    argv = [parser.prog, *(sys.argv[1:] if arguments is None else arguments)]
    if stop.is_set():
        return 0
    try:
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # rclpy has no common class for arguments that it cannot use
        return _failed(parser, error, USER_MISTAKE)
    node: N | None = None
    executor: Executor | None = None
    try:
        # After rclpy's own check, which knows what belongs to ROS.
        unknown = remove_ros_args(argv)[1:]
        if unknown:
            raise RgbdKcfError(
                f'unknown argument {unknown[0]!r}: give parameters as --ros-args -p name:=value'
            )
        executor = SingleThreadedExecutor()
        if not stop.is_set():
            node = make()
            executor.add_node(node)
            live(executor, node)
        return 0
    except RgbdKcfError as error:
        return _failed(parser, error, USER_MISTAKE)
    except Exception as error:  # also rclpy's: a node name, a namespace, a domain that is taken
        if 'PARAMETER_NOT_SET' in str(error):  # rclpy does not say which
            return _failed(parser, RgbdKcfError(_empty_list(argv)), USER_MISTAKE)
        return _failed(parser, error, FAILURE)
    finally:
        stop.ignore()
        if executor is not None:
            executor.shutdown(timeout_sec=0.5)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


def _empty_list(argv: Sequence[str]) -> str:
    named = [word.removesuffix(':=[]') for word in argv if word.endswith(':=[]')]
    which = f'parameter {named[0]}' if named else 'a parameter of the params file'
    return f'{which} is an empty list, which has no type to ROS: leave it out'


def _failed(parser: argparse.ArgumentParser, error: Exception, status: int) -> int:
    # Where in rcl's sources it was noticed helps nobody.
    text = re.sub(r',? at [^ ]+\.[ch]pp:\d+|,? at [^ ]+\.c:\d+', '', ' '.join(str(error).split()))
    if not text or text.startswith('['):
        text = f'{type(error).__name__} {text}'
    print(f'{parser.prog}: {text}', file=sys.stderr)
    return status
