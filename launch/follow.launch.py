# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Have a robot follow a person: the tracker, Nav2's Following Server, and who asks it to follow.

    ros2 launch rgbd_kcf_tracker follow.launch.py camera:=realsense auto_init:=true

Needs opennav_following and nav2_lifecycle_manager, a robot that takes cmd_vel and publishes odom,
and TF from the camera to odom. Arguments that are not here are those of tracker.launch.py.
"""

from launch.actions import IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription
from rgbd_kcf_tracker.ros.launching import CONFIG, a_file, declared, given, is_true, need, switches

ARGUMENTS = {
    'follow_file': (
        str(CONFIG / 'follow.yaml'),
        'Parameters of the Following Server and of the node that asks it.',
    ),
    'cmd_vel': ('cmd_vel', 'Topic of the velocities that the Following Server sends.'),
    'automatic': ('', 'false: wait for ~/start before the robot moves; empty for follow_file.'),
    'server': ('true', 'false: a Following Server runs already, say with the rest of Nav2.'),
    'namespace': ('', 'Namespace of all nodes.'),
    'name': ('tracker', 'Name of the tracker node.'),
    'use_sim_time': ('', 'true: take the time from /clock; empty for the files of parameters.'),
}
SERVER = ('opennav_following', 'nav2_lifecycle_manager')


def start(context: LaunchContext) -> list:
    """The nodes, once the arguments are known."""
    values = given(ARGUMENTS, context)
    common = switches(values, 'use_sim_time')
    namespace, file = values['namespace'], a_file(values, 'follow_file')
    server = is_true(values, 'server')
    if server:
        need(SERVER, 'give server:=false where a Following Server runs already')
    actions = [
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(str(CONFIG.parent / 'launch' / 'tracker.launch.py')),
            launch_arguments=[
                (name, values[name]) for name in ('namespace', 'name', 'use_sim_time')
            ],
        ),
        Node(
            package='rgbd_kcf_tracker',
            executable='follow',
            name='follow',
            namespace=namespace,
            parameters=[
                file,
                {'tracker': values['name'], **common, **switches(values, 'automatic')},
            ],
            output='screen',
        ),
    ]
    if server:
        actions += [
            Node(
                package=SERVER[0],
                executable='opennav_following',
                name='following_server',
                namespace=namespace,
                parameters=[file, common],
                remappings=[('cmd_vel', values['cmd_vel'])],
                output='screen',
            ),
            Node(
                package=SERVER[1],
                executable='lifecycle_manager',
                name='lifecycle_manager_following',
                namespace=namespace,
                parameters=[file, common],
                output='screen',
            ),
        ]
    return actions


def generate_launch_description() -> LaunchDescription:
    """The arguments and the nodes."""
    return LaunchDescription([*declared(ARGUMENTS), OpaqueFunction(function=start)])
