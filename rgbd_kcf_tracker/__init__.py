# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Follow people and things in colour and depth, and say truthfully when they are hidden."""

from __future__ import annotations

from rgbd_kcf_tracker.lazy import lazily

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
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

__getattr__, __dir__ = lazily(
    __name__,
    {
        'errors': 'RgbdKcfError',
        'frame': 'Frame',
        'geometry': 'Box Intrinsics',
        'pose': 'Pose',
        'targets': 'TargetSet',
        'track': 'Track TrackState Tracker',
        'variants': 'create_tracker',
    },
)
