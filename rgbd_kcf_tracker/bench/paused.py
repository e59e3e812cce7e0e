# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings in which the camera pauses: who is whom afterwards only the looks tell.

    python -m rgbd_kcf_tracker.bench.paused filinha/ --fps 5 --keep 12 --cut 25 --out paused/

writes ``paused/000_filinha``, ``paused/006_filinha`` and so on: each begins some frames later,
goes on for 12, leaves out 25, and says of what then follows that it was seen 30 seconds later.
Recordings in which somebody comes back are rare; here all who were seen are away at once, and
some come back, most do not, and others come in their stead.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from rgbd_kcf_tracker.bench.altered import add_folders, make_copy, names_of, write_copies
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.evaluation.datasets import everyone
from rgbd_kcf_tracker.evaluation.datasets.base import Sample
from rgbd_kcf_tracker.recordings.imagefiles import image_files
from rgbd_kcf_tracker.recordings.mot import Sightings, mot_text
from rgbd_kcf_tracker.recordings.textfiles import CAMERA_INFO, INTRINSICS


def pause(
    folder: Path, samples: Sequence[Sample], kept: Sequence[int], out: Path, shift_ns: int
) -> None:
    """Write a copy of some frames of a recording.

    Args:
        folder: the recording.
        samples: all of it, with everyone in each.
        kept: indices of the frames that the copy has.
        out: is made.
        shift_ns: nanoseconds by which whatever follows the first frame left out is later.

    Raises:
        RgbdKcfError: where it is there, or cannot be written.
    """
    colors = everyone.image_folder(folder)
    assert colors is not None
    make_copy(out, 'rgb', 'depth')
    images, depths = image_files(colors), image_files(folder / 'depth')
    stamps, late = [], 0
    rows: list[tuple[int, int, tuple[float, ...], float]] = []
    for number, index in enumerate(kept):
        for source, part in ((images[index], 'rgb'), (depths[index], 'depth')):
            shutil.copyfile(source, out / part / f'{number + 1:06d}{source.suffix}')
        late = shift_ns if number and index > kept[number - 1] + 1 else late
        stamps.append(samples[index].frame.stamp_ns + late)
        for person in samples[index].people:
            rows.append((number, person.id, person.box.as_tuple(), float(person.counts)))
    (out / 'timestamps.txt').write_text(''.join(f'{stamp}\n' for stamp in stamps))
    (out / 'mot.txt').write_text(mot_text(Sightings.of(*zip(*rows, strict=True))))
    for name in (INTRINSICS, CAMERA_INFO):
        if (folder / name).is_file():
            shutil.copyfile(folder / name, out / name)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the copies; status 2 where one cannot be made."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.paused',
        description=(__doc__ or '').split('\n')[0],
    )
    add_folders(parser)
    parser.add_argument('--fps', type=float, default=30.0, help='of recordings without stamps')
    parser.add_argument('--keep', type=int, default=12, help='frames before the pause')
    parser.add_argument('--cut', type=int, default=25, help='frames left out')
    parser.add_argument('--step', type=int, default=6, help='frames from one beginning to the next')
    parser.add_argument('--seconds', type=float, default=30.0, help='of pause')
    args = parser.parse_args(argv)
    if not (args.fps > 0 and 0 <= args.seconds < 1e6):
        parser.error('--fps must be above 0, and --seconds from 0 to a million')
    if min(args.keep, args.cut, args.step) < 1:
        parser.error('--keep, --cut and --step must be 1 or more')
    names = names_of(args.folders, parser)

    def copies() -> Iterator[str]:
        for folder, name in zip(args.folders, names, strict=True):
            samples = list(everyone.load(folder, args.fps).samples)
            if any(sample.frame.depth is None for sample in samples):
                raise RecordingError(f'{folder} holds no depth images: nobody is known there')
            for start in range(0, len(samples) - args.keep - args.cut, args.step):
                first = range(start, start + args.keep)
                if not any(p.counts for index in first for p in samples[index].people):
                    continue
                out = args.out / f'{start:03d}_{name}'
                kept = [*first, *range(start + args.keep + args.cut, len(samples))]
                pause(folder, samples, kept, out, int(args.seconds * 1e9))
                yield f'{out}: {len(kept)} pairs'

    return write_copies(args.out, args.folders, copies)


if __name__ == '__main__':
    sys.exit(main())
