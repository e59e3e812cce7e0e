# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The executable ``replay``."""

from __future__ import annotations

import sys

from rgbd_kcf_tracker.live.stopping import Stop

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
    from rclpy.executors import Executor

    from rgbd_kcf_tracker.ros.replay_node import ReplayNode


def main(arguments: list[str] | None = None) -> int:
    """Replay a recording; 0 at its end or when told to stop, 2 for what the user can mend."""
    stop = Stop()  # first of all: what follows takes a second
    import threading

    from rgbd_kcf_tracker.live.memory import keep_large_blocks
    from rgbd_kcf_tracker.recordings import BAG_LIBRARIES, HOW_TO_GET_THEM
    from rgbd_kcf_tracker.ros.process import ends_at_once, node_parser, run, spin
    from rgbd_kcf_tracker.ros.transport import ensure_image_transport

    parser = node_parser(
        'replay',
        'Publish a recording as if its camera were there (a ROS 2 node).',
        'replay --ros-args -p bag:=walk.mcap -p lockstep:=true',
    )
    if (status := ends_at_once(parser, arguments)) is not None:
        return status
    keep_large_blocks()  # before NumPy and ROS allocate
    ensure_image_transport()  # before Fast DDS reads its settings
    try:
        from rgbd_kcf_tracker.ros.replay_node import ReplayNode
    except ModuleNotFoundError as error:
        if error.name not in BAG_LIBRARIES:
            raise
        print(f'replay: {error.name} is missing: {HOW_TO_GET_THEM}', file=sys.stderr)
        return 2

    def live(executor: Executor, node: ReplayNode) -> None:
        ended = threading.Event()
        spinning = threading.Thread(
            target=spin, args=(executor, node, ended.is_set), name='spin', daemon=True
        )
        spinning.start()
        try:
            node.run(stop)
        finally:
            ended.set()
            spinning.join(timeout=1.0)

    return run(parser, ReplayNode, live, stop, arguments)


if __name__ == '__main__':
    sys.exit(main())
