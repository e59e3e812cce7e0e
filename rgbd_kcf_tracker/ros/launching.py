# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the launch files have in common: arguments that choose the camera, and what they mean."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration

from rgbd_kcf_tracker.live.camera_profiles import CameraProfile, camera_profile, load_cameras

CONFIG = Path(get_package_share_directory('rgbd_kcf_tracker'), 'config')
Arguments = Mapping[str, 'tuple[str | None, str]']
"""Default and description of each argument; None: it must be given."""

CAMERA: Arguments = {
    'camera': ('kinect2_qhd', 'Profile of config/cameras.yaml: where the driver publishes.'),
    'cameras_file': (str(CONFIG / 'cameras.yaml'), 'The file of profiles.'),
    'color_topic': ('', "Colour topic, instead of the profile's."),
    'depth_topic': ('', "Depth topic, registered to colour, instead of the profile's."),
    'info_topic': ('', "CameraInfo topic, instead of the profile's."),
    'compressed': ('false', 'Subscribe to compressed images (several machines).'),
}
"""Arguments of a node that listens to a camera."""


def declared(arguments: Arguments) -> list[DeclareLaunchArgument]:
    """The arguments as a launch description takes them; that of the camera names the profiles."""
    names = ', '.join(load_cameras(CONFIG / 'cameras.yaml'))
    return [
        DeclareLaunchArgument(
            name,
            default_value=default,
            description=f'{text} One of: {names}.' if name == 'camera' else text,
        )
        for name, (default, text) in arguments.items()
    ]


def given(arguments: Arguments, context: Any) -> dict[str, str]:
    """What was given for each argument."""
    return {name: LaunchConfiguration(name).perform(context) for name in arguments}


def chosen_camera(values: Mapping[str, str]) -> tuple[CameraProfile, list[tuple[str, str]]]:
    """The camera's profile, and the remappings of a node to its topics or those that were given."""
    profile = camera_profile(Path(values['cameras_file']), values['camera'])
    remappings = dict(profile.remappings())
    for name, argument in (
        ('color/image', 'color_topic'),
        ('depth/image', 'depth_topic'),
        ('color/camera_info', 'info_topic'),
    ):
        if values[argument]:
            remappings[name] = values[argument]
    return profile, list(remappings.items())


def is_true(text: str) -> bool:
    """Whether an argument says yes."""
    return text.strip().lower() in ('true', '1', 'yes', 'on')
