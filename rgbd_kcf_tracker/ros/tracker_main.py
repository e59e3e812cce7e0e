# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The executable ``tracker``."""

from __future__ import annotations

import sys

from rgbd_kcf_tracker.live.memory import keep_large_blocks
from rgbd_kcf_tracker.ros.transport import ensure_image_transport


def main(args: list[str] | None = None) -> int:
    """Run the tracker node until SIGINT or SIGTERM."""
    keep_large_blocks()  # before NumPy, OpenCV and ROS allocate
    ensure_image_transport()  # before Fast DDS reads its settings
    from rgbd_kcf_tracker.ros.process import run
    from rgbd_kcf_tracker.ros.tracker_node import TrackerNode

    def make() -> TrackerNode:
        node = TrackerNode()
        if node.settings.autostart:
            node.autostart()
        return node

    return run(make, args)


if __name__ == '__main__':
    sys.exit(main())
