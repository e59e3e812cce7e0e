# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The executable ``follow``: has Nav2's Following Server follow the tracker's target."""

from __future__ import annotations

import sys

from rgbd_kcf_tracker.live.stopping import Stop

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
    from rclpy.executors import Executor

    from rgbd_kcf_tracker.ros.follow_node import FollowNode


def main(arguments: list[str] | None = None) -> int:
    """Ask for following and for stopping until SIGINT, SIGTERM or SIGHUP."""
    stop = Stop()  # first of all: what follows takes a second
    from rgbd_kcf_tracker.ros.process import ends_at_once, node_parser, run, spin

    parser = node_parser(
        'follow',
        "Have Nav2's Following Server follow the tracker's target (a ROS 2 node).",
        'follow --ros-args -p tracker:=tracker -p give_up_after:=5.0',
    )
    if (status := ends_at_once(parser, arguments)) is not None:
        return status
    from rgbd_kcf_tracker.ros.follow_node import FollowNode

    def live(executor: Executor, node: FollowNode) -> None:
        spin(executor, node, stop.is_set)

    return run(parser, FollowNode, live, stop, arguments)


if __name__ == '__main__':
    sys.exit(main())
