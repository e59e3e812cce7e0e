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
    add_overwrite_option,
    add_reading_options,
    escaped,
    progress,
    read_options,
    refuse,
    refuse_reading,
    require_mcap,
    warn,
)
from rgbd_kcf_tracker.errors import RecordingError

NAME = 'convert'
HELP = 'write any recording as an mcap file; mends a bag that was cut off'
CAMERAS = ('generic', 'kinect2_hd', 'kinect2_qhd', 'kinect2_sd')
USUAL = {'camera': CAMERAS[0]}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument('source', metavar='SOURCE', help=SOURCE_HELP)
    parser.add_argument('dest', metavar='DEST.mcap', help='the file to write')
    parser.add_argument(
        '--compression',
        choices=('none', 'lz4', 'zstd'),
        default='zstd',
        help='of the chunks (default zstd; none is fastest to read)',
    )
    parser.add_argument(
        '--camera',
        choices=CAMERAS,
        default=USUAL['camera'],
        help="topic names for a folder: the tracker node's own (generic, the default) or "
        "kinect2_bridge's; a bag keeps its names",
    )
    add_overwrite_option(parser, 'the file if it is there')
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
    from rgbd_kcf_tracker.recordings.files import require_source
    from rgbd_kcf_tracker.recordings.outputs import check_outputs
    from rgbd_kcf_tracker.recordings.rawbag import RawBag
    from rgbd_kcf_tracker.recordings.sequences import is_sequence_folder

    source, dest = Path(args.source), Path(args.dest)
    require_mcap(args.dest)
    require_source(source)
    check_outputs({'DEST': dest}, [source], args.overwrite)

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
                overwrite=args.overwrite,
            )
            warnings.show()
        print(escaped(f'{dest}: {count} frames'))
        return 0
    refuse(args, 'for a bag, which keeps its names', ('camera',), 'leave it out', USUAL)
    refuse_reading(args, 'for a bag, of which every message is copied: leave it out')
    bag = RawBag(source)
    try:
        Warnings(bag.warnings).show()
        count, problems = copy_bag(
            bag,
            dest,
            compression=args.compression,
            progress=shown,
            overwrite=args.overwrite,
        )
        for problem in problems[:20]:
            warn(problem)
        if len(problems) > 20:
            warn(f'and {len(problems) - 20} more')
        if not count:
            raise RecordingError(f'{source} holds no message that can be read: nothing is written')
        topics = sum(1 for topic in bag.topics.values() if len(topic))
        print(escaped(f'{dest}: {count} messages of {topics} topics'))
    finally:
        bag.close()
    return 0
