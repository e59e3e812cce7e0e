# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Replay a recording and track in it.

    ros2 launch rgbd_kcf_tracker replay.launch.py bag:=walk.mcap init_box:=430,120,90,280

Every pair is processed, in lock-step unless told otherwise; the time is that of the recording.
"""

from pathlib import Path

from launch.actions import IncludeLaunchDescription, OpaqueFunction, Shutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchContext, LaunchDescription
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.live.camera_profiles import NO_CAMERA
from rgbd_kcf_tracker.live.replay_source import FOLDER_TOPICS
from rgbd_kcf_tracker.recordings.sequences import is_sequence_folder
from rgbd_kcf_tracker.ros.launching import (
    CAMERA,
    CONFIG,
    chosen_camera,
    declared,
    full_name,
    given,
    is_true,
    number,
)

ARGUMENTS = {
    'bag': (None, 'The recording: .mcap, rosbag2 folder, ROS 1 .bag or sequence folder.'),
    **CAMERA,
    'camera': (
        '',
        'Profile of config/cameras.yaml: what the recorded topics are; empty for kinect2_qhd, or '
        'none where the recording is a folder of images.',
    ),
    'init_box': ('', 'Target in the first image, x,y,width,height.'),
    'variant': ('', 'Which tracker; empty for the default.'),
    'params_file': (str(CONFIG / 'replayed.yaml'), 'Parameters of the tracker node.'),
    'namespace': ('', 'Namespace of the tracker.'),
    'name': ('tracker', 'Name of the tracker node.'),
    'rate': ('', 'Speed, which takes it out of lock-step; empty for 1 where it is out already.'),
    'loop': ('false', 'Begin again at the end.'),
    'lockstep': ('', 'Wait for the answer to each frame; empty for true, unless rate is given.'),
}
TRACKER = (*CAMERA, 'init_box', 'variant', 'params_file', 'namespace', 'name')


def start(context: LaunchContext) -> list:
    """Both nodes, once the arguments are known."""
    values = given(ARGUMENTS, context)
    folder = is_sequence_folder(Path(values['bag']))
    if not values['camera']:
        values['camera'] = NO_CAMERA if folder else CAMERA['camera'][0]
    lockstep = is_true(values, 'lockstep') if values['lockstep'] else not values['rate']
    if lockstep and values['rate']:
        raise ParameterError(
            'launch arguments rate and lockstep: in lock-step the tracker sets the pace, give one'
        )
    _, remappings = chosen_camera(values)
    topics = dict(remappings)
    parameters = {
        'bag': ParameterValue(values['bag'], value_type=str),
        'rate': number(values, 'rate', float) if values['rate'] else 1.0,
        'loop': is_true(values, 'loop'),
        'lockstep': lockstep,
        'answer_topic': f'{full_name(context, values)}/box',
    }
    if folder:
        # Its images have these names; the tracker's own are others in a namespace.
        values |= {
            'color_topic': FOLDER_TOPICS.color,
            'depth_topic': FOLDER_TOPICS.depth,
            'info_topic': FOLDER_TOPICS.info,
        }
    else:
        # One camera of several that were recorded; a recording without it says so at once. Depth
        # and CameraInfo of a profile are found beside the colour, where they were recorded.
        named = {name: values[name] for name in ('depth_topic', 'info_topic')}
        named['color_topic'] = topics.get('color/image', '')
        parameters |= {name: topic for name, topic in named.items() if topic}
    tracker = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(CONFIG.parent / 'launch' / 'tracker.launch.py')),
        launch_arguments=[
            *((name, values[name]) for name in TRACKER),
            ('use_sim_time', 'true'),
        ],
    )
    replay = Node(
        package='rgbd_kcf_tracker',
        executable='replay',
        parameters=[parameters],
        output='screen',
        on_exit=Shutdown(reason='the recording has ended'),
    )
    return [tracker, replay]


def generate_launch_description() -> LaunchDescription:
    """The arguments and both nodes."""
    return LaunchDescription([*declared(ARGUMENTS), OpaqueFunction(function=start)])
