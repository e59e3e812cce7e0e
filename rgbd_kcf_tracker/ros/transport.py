# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Fast DDS made fit for images, before ROS starts in this process.

With the default shared-memory segment an image is cut into pieces, some are lost, and a reliable
writer repeats them three seconds later. On one host only the publisher's segment matters.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.outputs import write_atomically

PROFILE_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
SHM = Path('/dev/shm')
_MEGABYTE = 1 << 20
_LARGEST, _SMALLEST = 32 * _MEGABYTE, 4 * _MEGABYTE


def profile_path() -> Path | None:
    """The Fast DDS profile for images, in an installation or in the checkout."""
    with suppress(Exception):
        from ament_index_python.packages import get_package_share_directory

        installed = Path(get_package_share_directory('rgbd_kcf_tracker'), 'config', 'fastdds.xml')
        if installed.is_file():
            return installed
    prefix = Path(sys.prefix, 'share', 'rgbd_kcf_tracker', 'config', 'fastdds.xml')
    checkout = Path(__file__).resolve().parents[2] / 'config' / 'fastdds.xml'
    return next((path for path in (checkout, prefix) if path.is_file()), None)


def segment_size(free: int) -> int:
    """Bytes for this process's segment where ``free`` bytes of shared memory are left.

    A quarter of it: others publish too, and a segment that does not fit fails without a word.
    """
    return max(_SMALLEST, min(_LARGEST, free // 4 // _MEGABYTE * _MEGABYTE))


def ensure_image_transport() -> None:
    """Use the package's Fast DDS profile, unless the user names one or another middleware."""
    if os.environ.get(PROFILE_VARIABLE):
        return
    if os.environ.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp') != 'rmw_fastrtps_cpp':
        return
    profile = fitting_profile()
    if profile is not None:
        os.environ[PROFILE_VARIABLE] = str(profile)


def fitting_profile() -> Path | None:
    """The package's profile, its segment made smaller where shared memory is small (containers)."""
    profile = profile_path()
    if profile is None:
        return None
    try:
        space = os.statvfs(SHM)
        size = segment_size(space.f_bavail * space.f_frsize)
    except OSError:
        size = _SMALLEST
    return profile if size == _LARGEST else _resized(profile, size)


def _resized(profile: Path, size: int) -> Path:
    """A copy of the profile with another segment size, kept for the processes that follow.

    The profile itself where nothing can be written, as in a container that is read-only.
    """
    text = profile.read_text(encoding='utf-8')
    text = re.sub(r'(<segment_size>)\d+(</segment_size>)', rf'\g<1>{size}\g<2>', text)
    try:
        folder = Path(tempfile.gettempdir())
        copy = folder / f'rgbd_kcf_tracker_fastdds_{size // _MEGABYTE}mb_{os.getuid()}.xml'
        write_atomically(copy, text)
    except (OSError, RecordingError):
        return profile
    return copy
