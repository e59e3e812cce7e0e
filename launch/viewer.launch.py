# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Watch a running tracker in a browser, on http://127.0.0.1:8080/.

    ros2 launch rgbd_kcf_tracker viewer.launch.py camera:=kinect2_qhd

The camera is that of the tracker; any other host than 127.0.0.1 needs RGBD_KCF_TOKEN to be set.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription
from rgbd_kcf_tracker.live.camera_profiles import camera_profile, load_cameras

CONFIG = Path(get_package_share_directory('rgbd_kcf_tracker'), 'config')
ARGUMENTS = {
    'camera': ('kinect2_qhd', 'Profile of config/cameras.yaml: where the driver publishes.'),
    'cameras_file': (str(CONFIG / 'cameras.yaml'), 'The file of profiles.'),
    'color_topic': ('', "Colour topic, instead of the profile's."),
    'depth_topic': ('', "Depth topic, registered to colour, instead of the profile's."),
    'info_topic': ('', "CameraInfo topic, instead of the profile's."),
    'compressed': ('false', 'Subscribe to compressed images (several machines).'),
    'tracker': ('tracker', 'Name of the tracker node, with its namespace.'),
    'host': ('127.0.0.1', 'Address to listen on.'),
    'port': ('8080', 'TCP port of the page.'),
    'rate': ('10.0', 'Moments shown each second, at most.'),
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
        'tracker': given['tracker'],
        'host': given['host'],
        'port': int(given['port']),
        'rate': float(given['rate']),
    }
    if given['compressed'].strip().lower() in ('true', '1', 'yes', 'on'):
        parameters |= profile.transports(compressed=True)
    return [
        Node(
            package='rgbd_kcf_tracker',
            executable='viewer',
            name='viewer',
            parameters=[parameters],
            remappings=list(remappings.items()),
            output='screen',
        )
    ]


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
