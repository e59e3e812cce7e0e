# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Recorded frames in, results out: bags, sequence folders, image codecs, CSV, video."""

from rgbd_kcf_tracker.recordings.images import (
    decode_color,
    decode_compressed_color,
    decode_compressed_depth,
    decode_depth,
)
from rgbd_kcf_tracker.recordings.opening import open_recording
from rgbd_kcf_tracker.recordings.pairing import Pair, PairingCounts, StampPairer
from rgbd_kcf_tracker.recordings.recording import (
    ReadOptions,
    Recording,
    RecordingInfo,
    StreamInfo,
)

__all__ = [
    'Pair',
    'PairingCounts',
    'ReadOptions',
    'Recording',
    'RecordingInfo',
    'StampPairer',
    'StreamInfo',
    'decode_color',
    'decode_compressed_color',
    'decode_compressed_depth',
    'decode_depth',
    'open_recording',
]
