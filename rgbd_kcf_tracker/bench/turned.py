# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings in a mirror and backwards: the same people, who come and go another way.

    python -m rgbd_kcf_tracker.bench.turned filinha/ --fps 5 --intrinsics FX,FY,CX,CY --out turned/

writes ``turned/mirror_filinha``, ``turned/back_filinha`` and ``turned/mirror_back_filinha``. What a
tracker owes to how things happened to fall in a recording, in which part of the picture or in which
order, it has not in these: whoever sat down at the end sits there from the first frame on. With
``--every 2`` each second frame is left out as well, as by a camera that gives half as many, in a
copy that begins with the first and one with the second.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from rgbd_kcf_tracker.bench.altered import (
    add_reading,
    camera_of,
    names_of,
    new_copy,
    parser_of,
    read_with_depth,
    write_camera,
    write_copies,
    write_pair,
    write_truth,
)
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.evaluation.datasets import everyone
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames

WAYS = {
    'same': (False, False),
    'mirror': (True, False),
    'back': (False, True),
    'mirror_back': (True, True),
}
"""Copies by name: whether in a mirror, and whether backwards. Whether the first is one of its own
depends on ``--every``."""


def turn(
    frames: ImageFrames, people: everyone.People, kept: Sequence[int], out: Path, mirror: bool
) -> None:
    """Write a copy of some frames of a recording.

    Args:
        frames: all of the recording, each with depth, and freed of the lens.
        people: who is in them.
        kept: indices of the frames that the copy has, forwards or backwards.
        out: is made.
        mirror: whether left and right change places.

    Raises:
        RgbdKcfError: where it is there, or cannot be made.
    """
    with new_copy(out, 'rgb', 'depth'):
        truth: list[list[Annotation]] = []
        width = 0
        for number, index in enumerate(kept, start=1):
            frame = frames.frame(index)
            assert frame.depth is not None
            width = frame.width
            side = slice(None, None, -1 if mirror else 1)
            write_pair(out, number, frame.color[:, side], frame.depth[:, side])
            there = people.get(index, [])
            truth.append([_mirrored(each, width) for each in there] if mirror else there)
        first = frames.stamps_ns[kept[0]]
        write_truth(out, [abs(frames.stamps_ns[index] - first) for index in kept], truth)
        camera = frames.intrinsics
        if camera is not None and mirror:
            camera = dataclasses.replace(camera, cx=width - 1 - camera.cx)
        write_camera(out, camera)


def _mirrored(one: Annotation, width: int) -> Annotation:
    def turned(box: Box) -> Box:
        return Box(width - box.right, box.y, box.width, box.height)

    body = None if one.body is None else turned(one.body)
    return dataclasses.replace(one, box=turned(one.box), body=body)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the copies; status 2 where one cannot be made."""
    parser = parser_of('turned', __doc__)
    add_reading(parser)
    parser.add_argument('--every', type=int, default=1, help='frames of which the copies have one')
    args = parser.parse_args(argv)
    if args.every < 1:
        parser.error('--every must be 1 or more')
    camera = camera_of(args, parser)
    names = names_of(args.folders, parser)

    def copies() -> Iterator[str]:
        for folder, name in zip(args.folders, names, strict=True):
            frames, people = read_with_depth(folder, args.fps, camera)
            for way, (mirror, back) in WAYS.items():
                if way == 'same' and args.every == 1:
                    continue
                order = range(len(frames))[:: -1 if back else 1]
                for phase in range(args.every):
                    kept = order[phase :: args.every]
                    if not any(people.get(index) for index in kept):
                        raise RecordingError(
                            f'{folder}: of every {args.every} frames nobody is left'
                        )
                    out = args.out / (
                        f'{way}_{name}' if args.every == 1 else f'{way}_{phase}_{name}'
                    )
                    turn(frames, people, kept, out, mirror)
                    yield f'{out}: {len(kept)} pairs'

    return write_copies(args.out, args.folders, copies)


if __name__ == '__main__':
    sys.exit(main())
