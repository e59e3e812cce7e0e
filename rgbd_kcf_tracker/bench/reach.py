# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings as a camera sees them whose depth ends at some metres.

    python -m rgbd_kcf_tracker.bench.reach filinha/ --fps 5 --intrinsics FX,FY,CX,CY --out reach/

writes ``reach/filinha``, where nothing farther than 4.5 m is read: so far a Kinect v2 measures by
its specification, and libfreenect2 leaves out what is farther unless it is told otherwise
(``Freenect2Device::Config``). Walls are gone then, and who walks there is seen in colour alone.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.bench.altered import (
    add_reading,
    camera_of,
    make_copy,
    names_of,
    parser_of,
    read_with_depth,
    write_camera,
    write_copies,
    write_pair,
    write_truth,
)
from rgbd_kcf_tracker.evaluation.datasets import everyone
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames

REACH = 4.5
"""Metres, of a Kinect v2."""


def bounded(frames: ImageFrames, people: everyone.People, reach: float, out: Path) -> None:
    """Write a copy of a recording without the readings beyond ``reach`` metres.

    Args:
        frames: of the recording, each with depth.
        people: who is in them.
        reach: metres.
        out: is made.

    Raises:
        RgbdKcfError: where it is there, or cannot be made.
    """
    make_copy(out, 'rgb', 'depth')
    for index in range(len(frames)):
        frame = frames.frame(index)
        assert frame.depth is not None
        depth = frame.depth.astype(np.float32, copy=True)
        depth[depth > reach] = np.nan
        write_pair(out, index + 1, frame.color, depth)
    write_truth(out, frames.stamps_ns, [people.get(index, []) for index in range(len(frames))])
    write_camera(out, frames.intrinsics)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the copies; status 2 where one cannot be made."""
    parser = parser_of('reach', __doc__)
    add_reading(parser)
    parser.add_argument(
        '--reach', type=float, default=REACH, help='metres (default: those of a Kinect v2)'
    )
    args = parser.parse_args(argv)
    if not 0 < args.reach < math.inf:
        parser.error('--reach must be a number above 0')
    camera = camera_of(args, parser)
    names = names_of(args.folders, parser)

    def copies() -> Iterator[str]:
        for folder, name in zip(args.folders, names, strict=True):
            frames, people = read_with_depth(folder, args.fps, camera)
            bounded(frames, people, args.reach, args.out / name)
            yield f'{args.out / name}: {len(frames)} pairs'

    return write_copies(args.out, args.folders, copies)


if __name__ == '__main__':
    sys.exit(main())
