# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Names of topics and nodes that are given as parameters: refused by the parameter's name."""

from __future__ import annotations

import re

from rclpy.node import Node

from rgbd_kcf_tracker.errors import ParameterError


def full_name(node: Node, parameter: str, name: str, example: str) -> str:
    """A name in full, after remapping.

    Args:
        node: in whose namespace a relative name is.
        parameter: that holds it.
        name: of a topic, an action or a node.
        example: of a good one.

    Raises:
        ParameterError: where it can be no name in ROS.
    """
    try:
        return str(node.resolve_topic_name(name))
    except Exception as error:  # RCLError, which rclpy does not export
        # "failed to resolve name: topic name must not ..., at <where in rcl's sources>"
        reason = re.search(r'must not .*?(?=, at /|$)', str(error))
        why = f' ({reason.group()})' if reason else ''
        raise ParameterError(
            f'parameter {parameter} is {name!r}, which is no name in ROS{why}: '
            f'give one such as {example}'
        ) from None


def tracker_topics(node: Node, tracker: str) -> str:
    """What the topics of the node that the parameter ``tracker`` names begin with.

    Raises:
        ParameterError: where it can be no node.
    """
    base = tracker.rstrip('/') or tracker
    full_name(node, 'tracker', base, '/tracker')
    return base
