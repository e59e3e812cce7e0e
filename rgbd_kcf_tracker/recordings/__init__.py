# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Recorded frames in, results out: bags, sequence folders, image codecs, CSV, video."""

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
from rgbd_kcf_tracker.recordings.opening import open_recording
from rgbd_kcf_tracker.recordings.overlay import draw_track
from rgbd_kcf_tracker.recordings.pairing import Pair, PairingCounts, StampPairer
from rgbd_kcf_tracker.recordings.recording import (
    ReadOptions,
    Recording,
    RecordingInfo,
    StreamInfo,
)
from rgbd_kcf_tracker.recordings.results import TrackCsvWriter
from rgbd_kcf_tracker.recordings.sequence_writer import SequenceWriter
from rgbd_kcf_tracker.recordings.video import VideoWriter

__all__ = [
    'GENERIC',
    'KINECT2_HD',
    'KINECT2_QHD',
    'KINECT2_SD',
    'BagWriter',
    'CameraTopics',
    'Pair',
    'PairingCounts',
    'ReadOptions',
    'Recording',
    'RecordingInfo',
    'SequenceWriter',
    'StampPairer',
    'StreamInfo',
    'TrackCsvWriter',
    'VideoWriter',
    'decode_color',
    'decode_compressed_color',
    'decode_compressed_depth',
    'decode_depth',
    'draw_track',
    'open_recording',
]
