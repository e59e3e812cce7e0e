# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings in which the camera pauses: who is whom afterwards only the looks tell.

    python -m rgbd_kcf_tracker.bench.paused filinha/ --fps 5 --keep 12 --cut 25 --out paused/

writes ``paused/000_filinha``, ``paused/006_filinha`` and so on: each begins some frames later,
goes on for 12, leaves out 25, and says of what then follows that it was seen 30 seconds later.
Recordings in which somebody comes back are rare; here all who were seen are away at once, and
some come back, most do not, and others come in their stead. With ``--anywhere`` what follows are 12
frames from anywhere else in the recording, earlier ones too: a copy for each pair of beginnings.
"""

from __future__ import annotations

import argparse
import math
import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from rgbd_kcf_tracker.bench.altered import (
    names_of,
    new_copy,
    parser_of,
    write_copies,
    write_truth,
)
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.evaluation.datasets import everyone
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames
from rgbd_kcf_tracker.recordings.textfiles import CAMERA_INFO, INTRINSICS


def pause(
    frames: ImageFrames, people: everyone.People, kept: Sequence[int], out: Path, shift_ns: int
) -> None:
    """Write a copy of some frames of a recording.

    Args:
        frames: all of the recording, each with depth.
        people: who is in them.
        kept: indices of the frames that the copy has.
        out: is made.
        shift_ns: nanoseconds by which whatever follows the first frame left out is later; frames
            that were earlier come so much after the one before them.

    Raises:
        RgbdKcfError: where it is there, or cannot be made.
    """
    with new_copy(out, 'rgb', 'depth'):
        stamps: list[int] = []
        late = 0
        for number, index in enumerate(kept):
            for source, part in ((frames.colors[index], 'rgb'), (frames.depths[index], 'depth')):
                assert source is not None
                shutil.copyfile(source, out / part / f'{number + 1:06d}{source.suffix}')
            if number and index > kept[number - 1] + 1:
                late = shift_ns
            elif number and index < kept[number - 1]:
                late = stamps[-1] + shift_ns - frames.stamps_ns[index]
            stamps.append(frames.stamps_ns[index] + late)
        write_truth(out, stamps, [people.get(index, ()) for index in kept])
        for name in (INTRINSICS, CAMERA_INFO):
            beside = frames.colors[0].parent.parent / name
            if beside.is_file():
                shutil.copyfile(beside, out / name)


def _stretches(start: int, count: int, args: argparse.Namespace) -> Iterator[tuple[str, list[int]]]:
    """The frames before a pause, from ``start`` on, with those after it, and what to call them."""
    keep, after = args.keep, args.keep + args.cut
    before = range(start, start + keep)
    if not args.anywhere:
        yield f'{start:03d}', [*before, *range(start + after, count)]
        return
    for then in range(0, count - keep + 1, args.step):
        if then + after <= start or then >= start + after:
            yield f'{start:03d}_{then:03d}', [*before, *range(then, then + keep)]


def main(argv: Sequence[str] | None = None) -> int:
    """Write the copies; status 2 where one cannot be made."""
    parser = parser_of('paused', __doc__)
    parser.add_argument('--fps', type=float, default=30.0, help='of recordings without stamps')
    parser.add_argument('--keep', type=int, default=12, help='frames before the pause')
    parser.add_argument('--cut', type=int, default=25, help='frames left out')
    parser.add_argument('--step', type=int, default=6, help='frames from one beginning to the next')
    parser.add_argument(
        '--anywhere', action='store_true', help='frames from anywhere else follow, earlier ones too'
    )
    parser.add_argument('--seconds', type=float, default=30.0, help='of pause')
    args = parser.parse_args(argv)
    if not (0 < args.fps < math.inf and 0 <= args.seconds < 1e6):
        parser.error('--fps must be a number above 0, and --seconds from 0 to a million')
    if min(args.keep, args.cut, args.step) < 1:
        parser.error('--keep, --cut and --step must be 1 or more')
    names = names_of(args.folders, parser)

    def copies() -> Iterator[str]:
        for folder, name in zip(args.folders, names, strict=True):
            frames, people = everyone.read(folder, args.fps)
            if not frames.depths:
                raise RecordingError(f'{folder} holds no depth images: nobody is known there')
            after = args.keep + args.cut
            last = len(frames) - (args.keep - 1 if args.anywhere else after)
            stretches = {
                called: kept
                for start in range(0, last, args.step)
                if any(p.counts for n in range(args.keep) for p in people.get(start + n, ()))
                for called, kept in _stretches(start, len(frames), args)
            }
            if not stretches:
                raise RecordingError(
                    f'{folder}: of {len(frames)} frames no {args.keep} show somebody with '
                    f'{args.cut} between them and what follows: give a smaller --keep, --cut or '
                    '--step'
                )
            for called, kept in stretches.items():
                out = args.out / f'{called}_{name}'
                pause(frames, people, kept, out, int(args.seconds * 1e9))
                yield f'{out}: {len(kept)} pairs'

    return write_copies(args.out, args.folders, copies)


if __name__ == '__main__':
    sys.exit(main())
