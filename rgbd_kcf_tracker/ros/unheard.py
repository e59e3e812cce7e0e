# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Publishers of a topic that a subscription cannot hear: of another type, or with less QoS.

DDS joins neither, and says nothing of the first. Asking the graph takes a twentieth of a
millisecond, and adds nothing to each message, as event handlers would.
"""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSCompatibility, ReliabilityPolicy, qos_check_compatible

UNKNOWN = '_NODE_NAME_UNKNOWN_'
"""The name of a publisher's node until it is discovered, and of what is no ROS node."""


def unheard(node: Node, subscription: Any, cure_type: str, cure_reliability: str) -> str:
    """Why a publisher of a topic is not heard, and what mends it; empty where there is none such.

    Args:
        node: that listens.
        subscription: whose topic it is.
        cure_type: what to do where the publisher sends another type.
        cure_reliability: what to do where it is best effort, and reliable is asked for.
    """
    topic, wanted = subscription.topic_name, subscription.qos_profile
    kind = _type_name(subscription.msg_type)
    for publisher in node.get_publishers_info_by_topic(topic):
        who = f'{publisher.node_namespace.rstrip("/")}/{publisher.node_name}'
        if publisher.node_name == UNKNOWN:
            who = 'somebody'
        if publisher.topic_type != kind:
            return f'{who} publishes {publisher.topic_type} on {topic}, not {kind}: {cure_type}'
        offered = publisher.qos_profile
        fits, why = qos_check_compatible(offered, wanted)
        if fits != QoSCompatibility.ERROR:
            continue
        reliable = ReliabilityPolicy.RELIABLE
        if offered.reliability != reliable and wanted.reliability == reliable:
            return (
                f'{who} publishes best effort on {topic}, where reliable is asked for: '
                f'{cure_reliability}'
            )
        reason = why.removeprefix('ERROR: ').rstrip('; ')
        return f'the QoS of {who} on {topic} does not fit ({reason}): see qos_overrides'
    return ''


def _type_name(kind: Any) -> str:
    """As the graph names a message's type: sensor_msgs/msg/Image."""
    package, interface, *_ = kind.__module__.split('.')
    return f'{package}/{interface}/{kind.__name__}'
