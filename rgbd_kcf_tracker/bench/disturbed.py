# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Disturbed copies of recordings: how far a figure on a few frames hangs on their last digit.

    python -m rgbd_kcf_tracker.bench.disturbed group_cam1/ group_cam2/ --copies 8 --out disturbed/

writes ``disturbed/1_group_cam1`` to ``disturbed/8_group_cam2``: the same people before the same
camera, in light a little stronger or weaker, bluer or redder, and with the noise of both sensors
once more. The truth stays as it is. A tracker that has understood a recording follows them as well.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.bench.altered import (
    names_of,
    new_copy,
    parser_of,
    write_copies,
    write_image,
)
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.evaluation.datasets.everyone import CHALLENGE_FILE, image_folder
from rgbd_kcf_tracker.evaluation.datasets.folder import read_frames
from rgbd_kcf_tracker.recordings.encoding import millimetres
from rgbd_kcf_tracker.recordings.imagefiles import image_files

STRONGER, TINTED = 0.15, 0.05
"""Deviation of the logarithm of the light, and of that of blue and of red against green."""
COLOR_NOISE = 3.0
"""Levels of 255."""
DEPTH_NOISE = 0.0015
"""Metres at one metre; grows with the square of depth (Khoshelham and Elberink 2012)."""


def disturb(folder: Path, out: Path, rng: np.random.Generator) -> int:
    """Write a disturbed copy of a recording, and return how many pairs it has.

    Args:
        folder: with a folder of colour images, and ``depth``.
        out: is made.
        rng: of all that is random.

    Raises:
        RgbdKcfError: where the folder holds no pairs, one cannot be read, or none can be written.
    """
    colors = image_folder(folder)
    if colors is None or not (folder / 'depth').is_dir():
        raise RecordingError(f'{folder} holds no folders of colour and depth images')
    frames = read_frames(folder, image_files(colors), fps=1.0)
    files = [p for p in (*folder.iterdir(), folder / CHALLENGE_FILE) if p.is_file()]
    beside = {p.parent.name for p in files if p.parent != folder}
    with new_copy(out, colors.name, 'depth', *beside):
        for path in files:
            shutil.copyfile(path, out / path.relative_to(folder))
        green = STRONGER * rng.standard_normal()
        blue, red = green + TINTED * rng.standard_normal(2)
        gain = np.exp([blue, green, red])
        for index, path in enumerate(frames.colors):
            frame = frames.frame(index)
            assert frame.depth is not None
            color = frame.color * gain + COLOR_NOISE * rng.standard_normal(frame.color.shape)
            noise = DEPTH_NOISE * np.square(frame.depth) * rng.standard_normal(frame.depth.shape)
            levels = np.clip(np.rint(color), 0, 255).astype(np.uint8)
            write_image(out / colors.name / f'{path.stem}.png', levels)
            write_image(out / 'depth' / f'{path.stem}.png', millimetres(frame.depth + noise))
    return len(frames)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the copies; status 2 where one cannot be made."""
    parser = parser_of('disturbed', __doc__)
    parser.add_argument('--copies', type=int, default=8, help='of each recording')
    parser.add_argument('--seed', type=int, default=1)
    args = parser.parse_args(argv)
    if args.copies < 1 or args.seed < 0:
        parser.error('--copies must be 1 or more, and --seed 0 or more')
    names = names_of(args.folders, parser)

    def copies() -> Iterator[str]:
        for copy in range(1, args.copies + 1):
            for index, (folder, name) in enumerate(zip(args.folders, names, strict=True)):
                out = args.out / f'{copy}_{name}'
                # By its place on the line, as the documented copies were: two calls share draws.
                rng = np.random.default_rng([args.seed, copy, index])
                yield f'{out}: {disturb(folder, out, rng)} pairs'

    return write_copies(args.out, args.folders, copies)


if __name__ == '__main__':
    sys.exit(main())
