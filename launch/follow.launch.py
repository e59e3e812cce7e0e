# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Have a robot follow a person: the tracker, Nav2's Following Server, and who asks it to follow.

    ros2 launch rgbd_kcf_tracker follow.launch.py camera:=realsense auto_init:=true

Needs opennav_following and nav2_lifecycle_manager, a robot that takes cmd_vel and publishes odom,
and TF from the camera to odom. Arguments that are not here are those of tracker.launch.py.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription

SHARE = Path(get_package_share_directory('rgbd_kcf_tracker'))
ARGUMENTS = {
    'follow_file': (
        str(SHARE / 'config' / 'follow.yaml'),
        'Parameters of the Following Server and of the node that asks it.',
    ),
    'cmd_vel': ('cmd_vel', 'Topic of the velocities that the Following Server sends.'),
    'automatic': ('true', 'false: wait for ~/start before the robot moves.'),
    'server': ('true', 'false: a Following Server runs already, say with the rest of Nav2.'),
    'namespace': ('', 'Namespace of all nodes.'),
    'name': ('tracker', 'Name of the tracker node.'),
    'use_sim_time': ('false', 'Take the time from /clock.'),
}
YES = ('true', '1', 'yes', 'on')


def start(context: LaunchContext) -> list:
    """The nodes, once the arguments are known."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    common = {'use_sim_time': given['use_sim_time'].strip().lower() in YES}
    namespace, file = given['namespace'], given['follow_file']
    actions = [
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(str(SHARE / 'launch' / 'tracker.launch.py')),
            launch_arguments=[
                (name, given[name]) for name in ('namespace', 'name', 'use_sim_time')
            ],
        ),
        Node(
            package='rgbd_kcf_tracker',
            executable='follow',
            name='follow',
            namespace=namespace,
            parameters=[
                file,
                {
                    **common,
                    'tracker': given['name'],
                    'automatic': given['automatic'].strip().lower() in YES,
                },
            ],
            output='screen',
        ),
    ]
    if given['server'].strip().lower() in YES:
        actions += [
            Node(
                package='opennav_following',
                executable='opennav_following',
                name='following_server',
                namespace=namespace,
                parameters=[file, common],
                remappings=[('cmd_vel', given['cmd_vel'])],
                output='screen',
            ),
            Node(
                package='nav2_lifecycle_manager',
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
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])
