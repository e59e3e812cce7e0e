# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Start the tracker on a camera.

    ros2 launch rgbd_kcf_tracker tracker.launch.py camera:=kinect2_qhd auto_init:=true

The camera's own driver is started by its own launch file. To follow several targets or to use
several cameras, include this file once for each, with a ``namespace`` of its own.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchContext, LaunchDescription
from rgbd_kcf_tracker.live.camera_profiles import camera_profile, load_cameras
from rgbd_kcf_tracker.live.settings import RAW

CONFIG = Path(get_package_share_directory('rgbd_kcf_tracker'), 'config')
ARGUMENTS = {
    'camera': ('kinect2_qhd', 'Profile of config/cameras.yaml: where the driver publishes.'),
    'cameras_file': (str(CONFIG / 'cameras.yaml'), 'The file of profiles.'),
    'color_topic': ('', "Colour topic, instead of the profile's."),
    'depth_topic': ('', "Depth topic, registered to colour, instead of the profile's."),
    'info_topic': ('', "CameraInfo topic, instead of the profile's."),
    'compressed': ('false', 'Subscribe to compressed images (several machines).'),
    'params_file': (str(CONFIG / 'tracker.yaml'), 'Parameters of the tracker node.'),
    'variant': ('', 'Which tracker; empty for that of params_file.'),
    'init_box': ('', 'Target to start on, x,y,width,height; empty to wait for ~/init.'),
    'auto_init': ('', 'true: choose the nearest person; empty for params_file.'),
    'autostart': ('true', 'false: wait for a lifecycle manager.'),
    'namespace': ('', 'Namespace of the node.'),
    'name': ('tracker', 'Name of the node.'),
    'use_sim_time': ('false', 'Take the time from /clock.'),
    'fastdds_profile': (
        '',
        "A Fast DDS profile; empty for the environment's, or else the package's own, which the "
        'node fits to the size of /dev/shm.',
    ),
    'log_level': ('info', 'debug, info, warn, error.'),
}


def start(context: LaunchContext) -> list:
    """The node, once the arguments are known."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    profile = camera_profile(Path(given['cameras_file']), given['camera'])
    remappings = dict(profile.remappings())
    for name, topic in (
        ('color/image', given['color_topic']),
        ('depth/image', given['depth_topic']),
        ('color/camera_info', given['info_topic']),
    ):
        if topic:
            remappings[name] = topic
    parameters = {
        'use_sim_time': is_true(given['use_sim_time']),
        'autostart': is_true(given['autostart']),
    }
    # Raw is not said, so that a file of parameters may say otherwise.
    transports = profile.transports(is_true(given['compressed']))
    parameters |= {name: how for name, how in transports.items() if how != RAW}
    if given['variant']:
        parameters['variant'] = given['variant']
    if given['init_box']:
        parameters['init_box'] = ParameterValue(given['init_box'], value_type=str)
    if given['auto_init']:
        parameters['auto_init'] = is_true(given['auto_init'])
    actions = []
    if given['fastdds_profile']:
        actions.append(
            SetEnvironmentVariable('FASTRTPS_DEFAULT_PROFILES_FILE', given['fastdds_profile'])
        )
    actions.append(
        Node(
            package='rgbd_kcf_tracker',
            executable='tracker',
            name=given['name'],
            namespace=given['namespace'],
            parameters=[given['params_file'], parameters],
            remappings=list(remappings.items()),
            arguments=['--ros-args', '--log-level', f'{given["name"]}:={given["log_level"]}'],
            output='screen',
        )
    )
    return actions


def is_true(text: str) -> bool:
    """Whether an argument says yes."""
    return text.strip().lower() in ('true', '1', 'yes', 'on')


def generate_launch_description() -> LaunchDescription:
    """The arguments and the node."""
    names = ', '.join(load_cameras(CONFIG / 'cameras.yaml'))
    declared = [
        DeclareLaunchArgument(
            name,
            default_value=default,
            description=f'{text} One of: {names}.' if name == 'camera' else text,
        )
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])
