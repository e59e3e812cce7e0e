# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf convert``: any recording as an mcap file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from rgbd_kcf_tracker.cli.common import (
    SOURCE_HELP,
    Warnings,
    add_reading_options,
    progress,
    read_options,
    warn,
)
from rgbd_kcf_tracker.errors import RecordingError

NAME = 'convert'
HELP = 'write any recording as an mcap file; mends a bag that was cut off'
CAMERAS = ('generic', 'kinect2_hd', 'kinect2_qhd', 'kinect2_sd')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument('source', metavar='SOURCE', help=SOURCE_HELP)
    parser.add_argument('dest', metavar='DEST.mcap', help='the file to write')
    parser.add_argument(
        '--compression',
        choices=('none', 'lz4', 'zstd'),
        default='none',
        help='of the chunks (default none: fastest to read)',
    )
    parser.add_argument(
        '--camera',
        choices=CAMERAS,
        default='generic',
        help="topic names for a folder: the tracker node's own (generic, the default) or "
        "kinect2_bridge's; a bag keeps its names",
    )
    add_reading_options(parser)


def run(args: argparse.Namespace) -> int:
    """Convert and print what was written."""
    from rgbd_kcf_tracker.recordings import (
        GENERIC,
        KINECT2_HD,
        KINECT2_QHD,
        KINECT2_SD,
        open_recording,
    )
    from rgbd_kcf_tracker.recordings.copying import copy_bag, write_recording
    from rgbd_kcf_tracker.recordings.rawbag import RawBag
    from rgbd_kcf_tracker.recordings.sequences import is_sequence_folder

    source, dest = Path(args.source), Path(args.dest)
    if dest.suffix != '.mcap':
        raise RecordingError(f'{dest} must end in .mcap: that is the format written')
    if not source.exists():
        raise RecordingError(f'{source} does not exist')
    if dest.resolve() == source.resolve() or source.resolve() in dest.resolve().parents:
        raise RecordingError(f'{dest} is part of the source: give another name')

    def shown(items: Any, total: int) -> Any:
        return progress(items, total, NAME)

    if is_sequence_folder(source):
        names = dict(zip(CAMERAS, (GENERIC, KINECT2_HD, KINECT2_QHD, KINECT2_SD), strict=True))
        with open_recording(source, read_options(args)) as recording:
            warnings = Warnings(recording.warnings)
            count = write_recording(
                recording,
                dest,
                topics=names[args.camera],
                compression=args.compression,
                progress=shown,
            )
            warnings.show()
        print(f'{dest}: {count} frames')
        return 0
    bag = RawBag(source)
    try:
        Warnings(bag.warnings).show()
        count, problems = copy_bag(bag, dest, compression=args.compression, progress=shown)
        for problem in problems[:20]:
            warn(problem)
        if len(problems) > 20:
            warn(f'and {len(problems) - 20} more')
        topics = sum(1 for topic in bag.topics.values() if len(topic))
        print(f'{dest}: {count} messages of {topics} topics')
    finally:
        bag.close()
    return 0
