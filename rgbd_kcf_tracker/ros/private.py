# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the nodes need of rclpy that it does not make public; without it they run on."""

from __future__ import annotations

from rclpy.lifecycle import LifecycleNode


def release_lifecycle_services(node: LifecycleNode) -> None:
    """Have the lifecycle services of a destroyed node go at once.

    rclpy leaves them to DDS until the node is garbage. While they go by and by, a node of the same
    name that is there has more ends of a service than others, and whoever counts them
    (rmw_fastrtps) never finds it.
    """
    machine = getattr(node, '_state_machine', None)
    if machine is not None:
        machine.destroy_when_not_in_use()
