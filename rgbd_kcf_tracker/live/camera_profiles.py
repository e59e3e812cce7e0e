# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The camera profiles of ``config/cameras.yaml``, for the launch files. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import yaml

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.live.settings import COMPRESSED, COMPRESSED_DEPTH, RAW

NO_CAMERA = 'none'
"""As a profile's name: nothing is remapped."""
TRANSPORTS = {
    'color_transport': (RAW, COMPRESSED),
    'depth_transport': (RAW, COMPRESSED, COMPRESSED_DEPTH),
    'packed_depth_transport': (COMPRESSED, COMPRESSED_DEPTH),
}


@dataclass(frozen=True, slots=True)
class CameraProfile:
    """Where a driver publishes.

    Attributes:
        color, depth, info: topics.
        description, encodings, needs: for people to read.
        color_transport, depth_transport: how its images arrive.
        packed_depth_transport: the depth transport that this driver offers beside raw.
    """

    color: str
    depth: str
    info: str
    description: str = ''
    encodings: str = ''
    needs: str = ''
    color_transport: str = RAW
    depth_transport: str = RAW
    packed_depth_transport: str = COMPRESSED_DEPTH

    def remappings(self) -> list[tuple[str, str]]:
        """The tracker's inputs and what they are called here; topics left empty stay."""
        pairs = (
            ('color/image', self.color),
            ('depth/image', self.depth),
            ('color/camera_info', self.info),
        )
        return [(name, topic) for name, topic in pairs if topic]

    def transports(self, compressed: bool) -> dict[str, str]:
        """The tracker's parameters for images as they arrive, or for compressed ones."""
        if not compressed:
            return {
                'color_transport': self.color_transport,
                'depth_transport': self.depth_transport,
            }
        return {
            'color_transport': COMPRESSED,
            'depth_transport': self.packed_depth_transport,
        }


def load_cameras(path: Path) -> dict[str, CameraProfile]:
    """The profiles of a file, by name.

    Raises:
        ParameterError: where the file cannot be read or a profile is not as it should be.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8'))
    except (OSError, yaml.YAMLError) as error:
        raise ParameterError(f'{path}: camera profiles cannot be read: {error}') from None
    known = {field.name for field in fields(CameraProfile)}
    profiles = {NO_CAMERA: CameraProfile('', '', '', 'topics as the tracker names them')}
    content = {} if content is None else content
    if not isinstance(content, dict) or not all(isinstance(v, dict) for v in content.values()):
        raise ParameterError(
            f'{path}: camera profiles are names with entries: see the shipped file'
        )
    for name, values in content.items():
        unknown = sorted(set(values) - known)
        missing = sorted({'color', 'depth', 'info'} - set(values))
        if unknown or missing:
            wrong = f'unknown {", ".join(unknown)}' if unknown else f'no {", ".join(missing)}'
            raise ParameterError(f'{path}: camera {name} has {wrong}: known are {sorted(known)}')
        profile = CameraProfile(**{k: str(v) for k, v in values.items()})
        for key, choices in TRANSPORTS.items():
            given = getattr(profile, key)
            if given not in choices:
                raise ParameterError(
                    f'{path}: camera {name}: {key} is {given!r}: choose one of {", ".join(choices)}'
                )
        profiles[str(name)] = profile
    return profiles


def camera_profile(path: Path, name: str) -> CameraProfile:
    """The profile of that name.

    Raises:
        ParameterError: for an unknown name.
    """
    profiles = load_cameras(path)
    if name not in profiles:
        raise ParameterError(f'unknown camera {name!r}: choose one of {", ".join(profiles)}')
    return profiles[name]
