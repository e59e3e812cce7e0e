# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The executable ``tracker``."""

from __future__ import annotations

import sys

from rgbd_kcf_tracker.live.stopping import Stop

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
    from rclpy.executors import Executor

SWITCH_INTERVAL_S = 0.0005
"""Seconds that one of the executor's and the worker's threads holds the interpreter while the other
waits for it: a tenth of Python's default (docs/live.md)."""


def main(arguments: list[str] | None = None) -> int:
    """Run the tracker node until SIGINT, SIGTERM or SIGHUP."""
    stop = Stop()  # first of all: what follows takes a second
    from rgbd_kcf_tracker.live.memory import keep_large_blocks, set_objects_aside
    from rgbd_kcf_tracker.ros.process import ends_at_once, node_parser, run, spin
    from rgbd_kcf_tracker.ros.transport import ensure_image_transport

    parser = node_parser(
        'tracker',
        'Follow one target in the colour and depth images of a camera (a managed ROS 2 node).',
        'tracker --ros-args -p variant:=kcf -r color/image:=/camera/color/image_raw',
    )
    if (status := ends_at_once(parser, arguments)) is not None:
        return status
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    keep_large_blocks()  # before NumPy, OpenCV and ROS allocate
    ensure_image_transport()  # before Fast DDS reads its settings
    import cv2

    from rgbd_kcf_tracker.ros.tracker_node import TrackerNode

    # Its second thread takes a millisecond of processor time a pair, and no pair comes sooner.
    cv2.setNumThreads(1)

    def live(executor: Executor, node: TrackerNode) -> None:
        if node.settings.autostart:
            node.autostart()
        set_objects_aside()
        spin(executor, node, stop.is_set)

    return run(parser, TrackerNode, live, stop, arguments)


if __name__ == '__main__':
    sys.exit(main())
