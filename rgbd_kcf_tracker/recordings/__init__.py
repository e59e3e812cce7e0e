# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Recorded frames in, results out: bags, sequence folders, image codecs, CSV, video."""

from __future__ import annotations

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
    from typing import Any

    from rgbd_kcf_tracker.recordings.bag_writer import (
        GENERIC,
        KINECT2_HD,
        KINECT2_QHD,
        KINECT2_SD,
        BagWriter,
        CameraTopics,
    )
    from rgbd_kcf_tracker.recordings.images import (
        decode_color,
        decode_compressed_color,
        decode_compressed_depth,
        decode_depth,
    )
    from rgbd_kcf_tracker.recordings.mot import MotWriter, Sightings, read_mot
    from rgbd_kcf_tracker.recordings.opening import open_recording
    from rgbd_kcf_tracker.recordings.overlay import draw_track
    from rgbd_kcf_tracker.recordings.pairing import Pair, PairingCounts, StampPairer
    from rgbd_kcf_tracker.recordings.recording import (
        ReadOptions,
        Recording,
        RecordingInfo,
        StreamInfo,
    )
    from rgbd_kcf_tracker.recordings.results import TrackCsvWriter, TracksCsvWriter
    from rgbd_kcf_tracker.recordings.sequence_writer import SequenceWriter
    from rgbd_kcf_tracker.recordings.video import VideoWriter

__all__ = [
    'GENERIC',
    'KINECT2_HD',
    'KINECT2_QHD',
    'KINECT2_SD',
    'BagWriter',
    'CameraTopics',
    'MotWriter',
    'Pair',
    'PairingCounts',
    'ReadOptions',
    'Recording',
    'RecordingInfo',
    'SequenceWriter',
    'Sightings',
    'StampPairer',
    'StreamInfo',
    'TrackCsvWriter',
    'TracksCsvWriter',
    'VideoWriter',
    'decode_color',
    'decode_compressed_color',
    'decode_compressed_depth',
    'decode_depth',
    'draw_track',
    'open_recording',
    'read_mot',
]

BAG_LIBRARIES = ('rosbags', 'mcap', 'mcap_ros2', 'lz4', 'zstandard')
"""Not in apt, and so not on every robot: the tracker node does without."""
HOW_TO_GET_THEM = (
    'pip install rosbags mcap mcap-ros2-support, on Ubuntu with --user --break-system-packages '
    '(docs/install.md)'
)

_HOMES = {
    'BagWriter': 'bag_writer',
    'CameraTopics': 'bag_writer',
    'GENERIC': 'bag_writer',
    'KINECT2_HD': 'bag_writer',
    'KINECT2_QHD': 'bag_writer',
    'KINECT2_SD': 'bag_writer',
    'MotWriter': 'mot',
    'Pair': 'pairing',
    'PairingCounts': 'pairing',
    'ReadOptions': 'recording',
    'Recording': 'recording',
    'RecordingInfo': 'recording',
    'SequenceWriter': 'sequence_writer',
    'Sightings': 'mot',
    'StampPairer': 'pairing',
    'StreamInfo': 'recording',
    'TrackCsvWriter': 'results',
    'TracksCsvWriter': 'results',
    'VideoWriter': 'video',
    'decode_color': 'images',
    'decode_compressed_color': 'images',
    'decode_compressed_depth': 'images',
    'decode_depth': 'images',
    'draw_track': 'overlay',
    'open_recording': 'opening',
    'read_mot': 'mot',
}


def __getattr__(name: str) -> Any:
    """Import what is used when it is used: a node that decodes images needs no library for bags."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(import_module(f'{__name__}.{_HOMES[name]}'), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
