# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Follow people and things in colour and depth, and say truthfully when they are hidden."""

from __future__ import annotations

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
    from typing import Any

    from rgbd_kcf_tracker.errors import RgbdKcfError
    from rgbd_kcf_tracker.frame import Frame
    from rgbd_kcf_tracker.geometry import Box, Intrinsics
    from rgbd_kcf_tracker.pose import Pose
    from rgbd_kcf_tracker.targets import TargetSet
    from rgbd_kcf_tracker.track import Track, Tracker, TrackState
    from rgbd_kcf_tracker.variants import create_tracker

__version__ = '0.1.0'
__all__ = [
    'Box',
    'Frame',
    'Intrinsics',
    'Pose',
    'RgbdKcfError',
    'TargetSet',
    'Track',
    'TrackState',
    'Tracker',
    'create_tracker',
]

_HOMES = {
    'Box': 'geometry',
    'Frame': 'frame',
    'Intrinsics': 'geometry',
    'Pose': 'pose',
    'RgbdKcfError': 'errors',
    'TargetSet': 'targets',
    'Track': 'track',
    'TrackState': 'track',
    'Tracker': 'track',
    'create_tracker': 'variants',
}


def __getattr__(name: str) -> Any:
    """Import what is used when it is used: the command line starts without the trackers."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(import_module(f'{__name__}.{_HOMES[name]}'), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
