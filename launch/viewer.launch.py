# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Watch a running tracker in a browser, on http://127.0.0.1:8080/.

    ros2 launch rgbd_kcf_tracker viewer.launch.py camera:=kinect2_qhd

The camera is that of the tracker; any other host than 127.0.0.1 needs RGBD_KCF_TOKEN to be set.
"""

from launch.actions import OpaqueFunction
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription
from rgbd_kcf_tracker.ros.launching import CAMERA, chosen_camera, declared, given, is_true, number

ARGUMENTS = {
    **CAMERA,
    'namespace': ('', 'Namespace of the node; the tracker, too, is looked for in it.'),
    'tracker': ('tracker', 'Name of the tracker node; with a slash before it, with its namespace.'),
    'host': ('127.0.0.1', 'Address to listen on.'),
    'port': ('8080', 'TCP port of the page.'),
    'rate': ('10.0', 'Moments shown each second, at most.'),
}


def start(context: LaunchContext) -> list:
    """The node, once the arguments are known."""
    values = given(ARGUMENTS, context)
    profile, remappings = chosen_camera(values)
    parameters = {
        'tracker': values['tracker'],
        'host': values['host'],
        'port': number(values, 'port', int),
        'rate': number(values, 'rate', float),
        **profile.transports(is_true(values, 'compressed')),
    }
    return [
        Node(
            package='rgbd_kcf_tracker',
            executable='viewer',
            name='viewer',
            namespace=values['namespace'],
            parameters=[parameters],
            remappings=remappings,
            output='screen',
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """The arguments and the node."""
    return LaunchDescription([*declared(ARGUMENTS), OpaqueFunction(function=start)])
