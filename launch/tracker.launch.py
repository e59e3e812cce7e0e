# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Start the tracker on a camera.

    ros2 launch rgbd_kcf_tracker tracker.launch.py camera:=kinect2_qhd auto_init:=true

The camera's own driver is started by its own launch file. To follow several targets or to use
several cameras, include this file once for each, with a ``namespace`` of its own.
"""

from typing import Any

from launch.actions import OpaqueFunction, SetEnvironmentVariable
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchContext, LaunchDescription
from rgbd_kcf_tracker.live.settings import RAW
from rgbd_kcf_tracker.ros.launching import (
    CAMERA,
    CONFIG,
    a_file,
    chosen_camera,
    declared,
    full_name,
    given,
    is_true,
    switches,
)

ARGUMENTS = {
    **CAMERA,
    'params_file': (str(CONFIG / 'tracker.yaml'), 'Parameters of the tracker node.'),
    'variant': ('', 'Which tracker; empty for that of params_file.'),
    'init_box': ('', 'Target to start on, x,y,width,height; empty to wait for ~/init.'),
    'auto_init': ('', 'true: choose the nearest person; empty for params_file.'),
    'autostart': ('', 'false: wait for a lifecycle manager; empty for params_file.'),
    'namespace': ('', 'Namespace of the node.'),
    'name': ('tracker', 'Name of the node.'),
    'use_sim_time': ('', 'true: take the time from /clock; empty for params_file.'),
    'fastdds_profile': (
        '',
        "A Fast DDS profile; empty for the environment's, or else the package's own, which the "
        'node fits to the size of /dev/shm.',
    ),
    'log_level': ('info', 'debug, info, warn, error.'),
}


def start(context: LaunchContext) -> list:
    """The node, once the arguments are known."""
    values = given(ARGUMENTS, context)
    profile, remappings = chosen_camera(values)
    parameters: dict[str, Any] = switches(values, 'use_sim_time', 'autostart', 'auto_init')
    # Raw is not said, so that a file of parameters may say otherwise.
    transports = profile.transports(is_true(values, 'compressed'))
    parameters |= {name: how for name, how in transports.items() if how != RAW}
    if values['variant']:
        parameters['variant'] = values['variant']
    if values['init_box']:
        parameters['init_box'] = ParameterValue(values['init_box'], value_type=str)
    actions = []
    if values['fastdds_profile']:
        dds = a_file(values, 'fastdds_profile')
        actions.append(SetEnvironmentVariable('FASTRTPS_DEFAULT_PROFILES_FILE', dds))
    # What rcl calls the node's logger.
    logger = full_name(context, values)[1:].replace('/', '.')
    actions.append(
        Node(
            package='rgbd_kcf_tracker',
            executable='tracker',
            name=values['name'],
            namespace=values['namespace'],
            parameters=[a_file(values, 'params_file'), parameters],
            remappings=remappings,
            arguments=['--ros-args', '--log-level', f'{logger}:={values["log_level"]}'],
            output='screen',
        )
    )
    return actions


def generate_launch_description() -> LaunchDescription:
    """The arguments and the node."""
    return LaunchDescription([*declared(ARGUMENTS), OpaqueFunction(function=start)])
