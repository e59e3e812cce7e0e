# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The executable ``viewer``: the page over a running tracker."""

from __future__ import annotations

import contextlib
import os
import sys

from rgbd_kcf_tracker.live.memory import keep_large_blocks
from rgbd_kcf_tracker.ros.transport import ensure_image_transport

GIVE_WAY = 10
"""Lower priority by so much, as ``nice`` counts."""
TOKEN_VARIABLE = 'RGBD_KCF_TOKEN'


def main(args: list[str] | None = None) -> int:
    """Serve the page until SIGINT or SIGTERM."""
    # Where there are few cores it gives way to the tracker.
    with contextlib.suppress(OSError):
        os.nice(GIVE_WAY)
    keep_large_blocks()  # before NumPy, OpenCV and ROS allocate
    ensure_image_transport()  # before Fast DDS reads its settings
    try:
        import aiohttp  # noqa: F401
    except ImportError:
        print(
            "viewer: the page needs aiohttp: pip install 'rgbd_kcf_tracker[view]', or on Debian "
            'and Ubuntu apt install python3-aiohttp',
            file=sys.stderr,
        )
        return 1
    from rgbd_kcf_tracker.ros.process import run
    from rgbd_kcf_tracker.ros.viewer_node import ViewerNode
    from rgbd_kcf_tracker.view.server import Server

    servers: list[Server] = []

    def make() -> ViewerNode:
        node = ViewerNode()
        settings = node.settings
        token = settings.token or os.environ.get(TOKEN_VARIABLE, '')
        server = Server(node.page, settings.host, settings.port, token)
        server.start()
        servers.append(server)
        node.get_logger().info(f'open {server.url} in a browser')
        return node

    try:
        return run(make, args)
    finally:
        for server in servers:
            server.stop()


if __name__ == '__main__':
    sys.exit(main())
