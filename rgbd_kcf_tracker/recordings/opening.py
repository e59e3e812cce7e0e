# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The one way to open any recording."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.frame import unregistered
from rgbd_kcf_tracker.recordings.files import require_source
from rgbd_kcf_tracker.recordings.recording import ReadOptions, Recording, RecordingInfo
from rgbd_kcf_tracker.recordings.sequences import SequenceFolder, is_sequence_folder


def open_recording(path: str | os.PathLike[str], options: ReadOptions | None = None) -> Recording:
    """Open a bag (``.mcap``, rosbag2 folder, ``.db3``, ROS 1 ``.bag``) or a sequence folder.

    Args:
        path: the file or folder.
        options: how to read it; the defaults find topics and intrinsics by themselves.

    Raises:
        RecordingError: where it is no recording, cannot be read, or its topics are not clear.
    """
    options = ReadOptions() if options is None else options
    where = Path(path)
    require_source(where)
    if where.is_dir() and is_sequence_folder(where):
        return SequenceFolder(where, options)
    # The bag formats bring libraries that a sequence folder does without.
    from rgbd_kcf_tracker.recordings.bags import BagRecording

    return BagRecording(where, options)


def describe_recording(
    path: str | os.PathLike[str], options: ReadOptions | None = None
) -> RecordingInfo:
    """What is in a recording, also where its topics are not clear enough to give frames.

    Raises:
        RecordingError: where it is no recording or cannot be read.
    """
    require_source(path)
    try:
        with open_recording(path, options) as recording:
            return _with_odd_sizes(recording.info())
    except RecordingError as error:
        if is_sequence_folder(Path(path)):
            raise
        from rgbd_kcf_tracker.recordings.bags import describe_bag

        return describe_bag(Path(path), str(error))


def _with_odd_sizes(info: RecordingInfo) -> RecordingInfo:
    """The same, with a warning where depth does not fit colour, which no frame can be made of."""
    sizes = {stream.role: stream.size for stream in info.streams if stream.size is not None}
    depth, color = sizes.get('depth'), sizes.get('color')
    if depth is None or color is None or depth == color:
        return info
    return replace(info, warnings=(*info.warnings, unregistered(depth, color)))
