# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The executable ``viewer``: the page over a running tracker."""

from __future__ import annotations

import sys

from rgbd_kcf_tracker.live.stopping import Stop

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
    from rclpy.executors import Executor

    from rgbd_kcf_tracker.ros.viewer_node import ViewerNode

GIVE_WAY = 10
"""Lower priority by so much, as ``nice`` counts."""


def main(arguments: list[str] | None = None) -> int:
    """Serve the page until SIGINT, SIGTERM or SIGHUP."""
    stop = Stop()  # first of all: what follows takes a second
    import contextlib
    import os

    from rgbd_kcf_tracker.errors import MissingExtraError
    from rgbd_kcf_tracker.extras import require
    from rgbd_kcf_tracker.live.memory import keep_large_blocks
    from rgbd_kcf_tracker.ros.process import USER_MISTAKE, ends_at_once, node_parser, run, spin
    from rgbd_kcf_tracker.ros.transport import ensure_image_transport

    parser = node_parser(
        'viewer',
        'Show a running tracker in a browser, and pick its target there (a ROS 2 node).',
        'viewer --ros-args -p port:=9000 -r color/image:=/camera/color/image_raw',
    )
    if (status := ends_at_once(parser, arguments)) is not None:
        return status
    # Where there are few cores it gives way to the tracker.
    with contextlib.suppress(OSError):
        os.nice(GIVE_WAY)
    keep_large_blocks()  # before NumPy, OpenCV and ROS allocate
    ensure_image_transport()  # before Fast DDS reads its settings
    try:
        require('view', 'the page')
    except MissingExtraError as error:
        print(f'viewer: {error}', file=sys.stderr)
        return USER_MISTAKE
    from rgbd_kcf_tracker.ros.viewer_node import ViewerNode
    from rgbd_kcf_tracker.view import TOKEN_VARIABLE
    from rgbd_kcf_tracker.view.server import serving

    def live(executor: Executor, node: ViewerNode) -> None:
        settings = node.settings
        token = settings.token or os.environ.get(TOKEN_VARIABLE, '')
        with serving(node.page, settings.host, settings.port, token) as server:
            node.get_logger().info(f'open {server.url} in a browser')
            spin(executor, node, stop.is_set)

    return run(parser, ViewerNode, live, stop, arguments)


if __name__ == '__main__':
    sys.exit(main())
