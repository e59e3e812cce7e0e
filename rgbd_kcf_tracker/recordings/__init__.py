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
