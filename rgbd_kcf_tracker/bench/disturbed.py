# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Disturbed copies of recordings: how far a figure on a few frames hangs on their last digit.

    python -m rgbd_kcf_tracker.bench.disturbed group_cam1/ group_cam2/ --copies 8 --out disturbed/

writes ``disturbed/1_group_cam1`` to ``disturbed/8_group_cam2``: the same people before the same
camera, in light a little stronger or weaker, bluer or redder, and with the noise of both sensors
once more. The truth stays as it is. A tracker that has understood a recording follows them as well.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.errors import RecordingError, RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets.everyone import IMAGE_FOLDERS

STRONGER, TINTED = 0.15, 0.05
"""Deviation of the logarithm of the light, and of that of blue and of red against green."""
COLOR_NOISE = 3.0
"""Levels of 255."""
DEPTH_NOISE = 0.0015
"""Metres at one metre; grows with the square of depth (Khoshelham and Elberink 2012)."""

Image = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]


def disturb(folder: Path, out: Path, rng: np.random.Generator) -> int:
    """Write a disturbed copy of a folder of images, and return how many pairs it has.

    Args:
        folder: with a folder of colour images, and ``depth`` of 16 bits in millimetres.
        out: is made.
        rng: of all that is random.

    Raises:
        RecordingError: where the folder holds no such images or one cannot be read.
        OSError: where the copy cannot be written.
    """
    colors = next((folder / name for name in IMAGE_FOLDERS if (folder / name).is_dir()), None)
    if colors is None or not (folder / 'depth').is_dir():
        raise RecordingError(f'{folder} holds no folders of colour and depth images')
    out.mkdir(parents=True)
    for part in (colors.name, 'depth'):
        (out / part).mkdir()
    for path in folder.iterdir():
        if path.is_file():
            shutil.copyfile(path, out / path.name)
    green = STRONGER * rng.standard_normal()
    blue, red = green + TINTED * rng.standard_normal(2)
    gain = np.exp([blue, green, red])
    count = 0
    for path in sorted(colors.iterdir()):
        image = _read(path, cv2.IMREAD_COLOR)
        noisy = image * gain + COLOR_NOISE * rng.standard_normal(image.shape)
        _write(out / colors.name / f'{path.stem}.png', np.clip(noisy, 0, 255).astype(np.uint8))
        count += 1
    for path in sorted((folder / 'depth').iterdir()):
        depth = _read(path, cv2.IMREAD_UNCHANGED)
        metres = depth / 1000.0
        noise = DEPTH_NOISE * np.square(metres) * rng.standard_normal(depth.shape)
        noisy = np.where(depth > 0, np.rint(1000 * (metres + noise)), 0)
        _write(out / 'depth' / f'{path.stem}.png', np.clip(noisy, 0, 65535).astype(np.uint16))
    return count


def _read(path: Path, flags: int) -> Image:
    image: Any = cv2.imread(str(path), flags)
    if image is None:
        raise RecordingError(f'{path} cannot be read as an image')
    return image  # type: ignore[no-any-return]


def _write(path: Path, image: Image) -> None:
    if not cv2.imwrite(str(path), image):
        raise OSError(f'{path} cannot be written')


def main(argv: Sequence[str] | None = None) -> int:
    """Write the copies; status 2 where one cannot be made."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.disturbed',
        description=(__doc__ or '').split('\n')[0],
    )
    parser.add_argument('folders', nargs='+', type=Path, metavar='FOLDER', help='recordings')
    parser.add_argument('--out', type=Path, required=True, help='folder of the copies')
    parser.add_argument('--copies', type=int, default=8, help='of each recording')
    parser.add_argument('--seed', type=int, default=1)
    args = parser.parse_args(argv)
    try:
        for copy in range(1, args.copies + 1):
            for index, folder in enumerate(args.folders):
                out = args.out / f'{copy}_{folder.resolve().name}'
                rng = np.random.default_rng([args.seed, copy, index])
                print(f'{out}: {disturb(folder, out, rng)} pairs')
    except (RgbdKcfError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == '__main__':
    sys.exit(main())
