# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the launch files have in common: arguments that choose the camera, and what they mean."""

from __future__ import annotations

import difflib
import logging
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from ament_index_python.packages import (
    get_package_share_directory,
    get_packages_with_prefixes,
)
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.live.camera_profiles import CameraProfile, camera_profile, load_cameras

_LOG = logging.getLogger('launch')  # launch's own
N = TypeVar('N', int, float)
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
    """What was given for each argument; one that looks misspelt is told, for launch ignores it.

    It may be of a launch file around this one, so it is no error.
    """
    for name in set(context.launch_configurations) - set(arguments):
        near = difflib.get_close_matches(name, arguments, n=1, cutoff=0.85)
        if near:
            # launch shows the message as it stands, without arguments put in.
            _LOG.warning(f'launch argument {name} is none of ours: did you mean {near[0]}?')
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


def is_true(values: Mapping[str, str], name: str) -> bool:
    """Whether an argument says yes.

    Raises:
        ParameterError: where it says neither yes nor no.
    """
    word = values[name].strip().lower()
    if word in ('true', '1', 'yes', 'on'):
        return True
    if word in ('false', '0', 'no', 'off'):
        return False
    raise ParameterError(f'launch argument {name} is {values[name]!r}: give true or false')


def switches(values: Mapping[str, str], *names: str) -> dict[str, bool]:
    """The yes/no parameters that were given: one left empty is as a file or the node has it.

    Raises:
        ParameterError: where one says neither yes nor no.
    """
    return {name: is_true(values, name) for name in names if values[name]}


def number(values: Mapping[str, str], name: str, kind: type[N]) -> N:
    """The number that an argument gives, ``kind`` being int or float.

    Raises:
        ParameterError: where it is none.
    """
    try:
        return kind(values[name])
    except ValueError:
        raise ParameterError(
            f'launch argument {name} is {values[name]!r}: give a number ({kind.__name__})'
        ) from None


def a_file(values: Mapping[str, str], name: str) -> str:
    """The file that an argument names; launch itself would go on without one that is not there.

    Raises:
        ParameterError: where there is no such file.
    """
    if not Path(values[name]).is_file():
        raise ParameterError(f'launch argument {name} is {values[name]!r}: there is no such file')
    return values[name]


def need(packages: Sequence[str], otherwise: str) -> None:
    """See that packages are installed, before anything is started.

    Launch itself would notice when other nodes run already, and end without them.

    Args:
        packages: by their names in ROS.
        otherwise: what to do without them.

    Raises:
        ParameterError: where one is missing.
    """
    missing = [name for name in packages if name not in get_packages_with_prefixes()]
    if missing:
        start = f'ros-{os.environ.get("ROS_DISTRO", "jazzy")}-'
        apt = ' '.join(start + name.replace('_', '-') for name in missing)
        raise ParameterError(
            f'{" and ".join(missing)} not found: sudo apt install {apt}, or {otherwise}'
        )


def full_name(context: Any, values: Mapping[str, str]) -> str:
    """The name of a node with its namespaces, also those that a launch file around it pushes."""
    outer = context.launch_configurations.get('ros_namespace', '')
    namespace = values['namespace']
    inside = namespace if namespace.startswith('/') else f'{outer}/{namespace}'
    return '/' + '/'.join(part for part in (*inside.split('/'), values['name']) if part)
