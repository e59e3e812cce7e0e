# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Replay a recording and track in it.

    ros2 launch rgbd_kcf_tracker replay.launch.py bag:=walk.mcap init_box:=430,120,90,280

Every pair is processed, in lock-step unless told otherwise; the time is that of the recording.
"""

from launch.actions import IncludeLaunchDescription, Shutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription
from rgbd_kcf_tracker.ros.launching import CONFIG, declared

ARGUMENTS = {
    'bag': (None, 'The recording: .mcap, rosbag2 folder, ROS 1 .bag or sequence folder.'),
    'camera': ('kinect2_qhd', 'Profile of config/cameras.yaml: what the recorded topics are.'),
    'color_topic': ('', "Recorded colour topic, instead of the profile's."),
    'depth_topic': ('', "Recorded depth topic, instead of the profile's."),
    'info_topic': ('', "Recorded CameraInfo topic, instead of the profile's."),
    'init_box': ('', 'Target in the first image, x,y,width,height.'),
    'variant': ('', 'Which tracker; empty for the default.'),
    'params_file': (str(CONFIG / 'replayed.yaml'), 'Parameters of the tracker node.'),
    'rate': ('1.0', 'Speed, without lock-step.'),
    'loop': ('false', 'Begin again at the end.'),
    'lockstep': ('true', 'Wait for the answer to each frame.'),
}


def generate_launch_description() -> LaunchDescription:
    """Both nodes."""
    passed = ('camera', 'color_topic', 'depth_topic', 'info_topic', 'init_box', 'variant')
    tracker = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(CONFIG.parent / 'launch' / 'tracker.launch.py')),
        launch_arguments=[
            *((name, LaunchConfiguration(name)) for name in passed),
            ('params_file', LaunchConfiguration('params_file')),
            ('use_sim_time', 'true'),
        ],
    )
    replay = Node(
        package='rgbd_kcf_tracker',
        executable='replay',
        parameters=[
            {
                'bag': ParameterValue(LaunchConfiguration('bag'), value_type=str),
                'rate': ParameterValue(LaunchConfiguration('rate'), value_type=float),
                'loop': ParameterValue(LaunchConfiguration('loop'), value_type=bool),
                'lockstep': ParameterValue(LaunchConfiguration('lockstep'), value_type=bool),
            }
        ],
        output='screen',
        on_exit=Shutdown(reason='the recording has ended'),
    )
    return LaunchDescription([*declared(ARGUMENTS), tracker, replay])
