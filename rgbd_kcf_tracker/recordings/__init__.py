# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Recorded frames in, results out: bags, sequence folders, image codecs, CSV, video."""

from __future__ import annotations

from rgbd_kcf_tracker.lazy import lazily

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
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
    from rgbd_kcf_tracker.recordings.overlay import draw_track, draw_tracks
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
    'draw_tracks',
    'open_recording',
    'read_mot',
]

BAG_LIBRARIES = ('rosbags', 'mcap', 'mcap_ros2', 'lz4', 'zstandard')
"""Not in apt, and so not on every robot: the tracker node does without."""
HOW_TO_GET_THEM = (
    'pip install rosbags mcap mcap-ros2-support, on Ubuntu with --user --break-system-packages '
    '(docs/install.md)'
)

__getattr__, __dir__ = lazily(
    __name__,
    {
        'bag_writer': 'BagWriter CameraTopics GENERIC KINECT2_HD KINECT2_QHD KINECT2_SD',
        'images': 'decode_color decode_compressed_color decode_compressed_depth decode_depth',
        'mot': 'MotWriter Sightings read_mot',
        'opening': 'open_recording',
        'overlay': 'draw_track draw_tracks',
        'pairing': 'Pair PairingCounts StampPairer',
        'recording': 'ReadOptions Recording RecordingInfo StreamInfo',
        'results': 'TrackCsvWriter TracksCsvWriter',
        'sequence_writer': 'SequenceWriter',
        'video': 'VideoWriter',
    },
)
