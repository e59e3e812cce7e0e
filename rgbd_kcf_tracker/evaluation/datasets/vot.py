# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""VOT, and CDTB and DepthTrack, which share its folders: ``color/``, ``depth/``, groundtruth.txt.

Source: the VOT toolkit's data sets. Boxes are ``x,y,width,height``, rotated ones four corners,
masks ``mX,Y,WIDTH,HEIGHT,run,run,...``; ``nan`` or ``0`` where the target is absent. The file
``sequence`` names folders and rate; older data sets have the images beside the ground truth.
"""

from __future__ import annotations

import math
import re
from functools import partial
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.datasets.base import Opened, Sequence
from rgbd_kcf_tracker.evaluation.datasets.images import (
    check_lengths,
    with_truth,
)
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.files import is_there
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames, even_stamps, image_files
from rgbd_kcf_tracker.recordings.messages import LARGEST
from rgbd_kcf_tracker.recordings.recording import MAX_FPS, MIN_FPS
from rgbd_kcf_tracker.recordings.textfiles import box_of_region, read_lines


def is_sequence(path: Path) -> bool:
    """Whether a folder is a VOT sequence."""
    if not (path / 'groundtruth.txt').exists():
        return False
    return (
        (path / 'sequence').is_file()
        or (path / 'color').is_dir()
        or (path / '00000001.jpg').exists()
    )


def listed(path: Path) -> list[Path]:
    """The sequence folders that ``list.txt`` of a data set names, in its order."""
    return [path / line.strip() for line in read_lines(path / 'list.txt') if line.strip()]


def find(path: Path, fps: float) -> Sequence:
    """One sequence folder."""
    return Sequence(
        name=path.name,
        scenario=path.parent.name or 'vot',
        kind='vot',
        open=partial(load, path, fps),
        identity=f'vot:{fps}',
        content=(path,),
        path=path,
    )


def load(path: Path, fps: float) -> Opened:
    """Open a sequence.

    Raises:
        DatasetError: where images are missing, numbers differ, or a line is no region.
    """
    settings = _settings(path / 'sequence')
    color_folder, color_files = _channel(path, settings, 'color')
    depth_folder, depth_files = _channel(path, settings, 'depth')
    if color_folder is None:
        color_folder, color_files = path, image_files(path)
    truth_path = path / settings.get('groundtruth', 'groundtruth.txt')
    boxes = read_regions(truth_path)
    check_lengths(truth_path, len(boxes), color_files, color_folder)
    if depth_folder is not None:
        check_lengths(truth_path, len(boxes), depth_files, depth_folder)
    if not any(box is not None for box in boxes):
        raise DatasetError(f'{truth_path}: no line holds a box to start from')
    try:
        rate = float(settings.get('fps', fps))
    except ValueError:
        rate = math.nan
    if not MIN_FPS <= rate <= MAX_FPS:
        raise DatasetError(
            f'{path / "sequence"}: fps is {settings.get("fps", fps)!r}: give a number from '
            f'{MIN_FPS:g} to {MAX_FPS:g}'
        )
    frames = ImageFrames(color_files, depth_files, even_stamps(len(color_files), rate))
    return Opened(with_truth(frames, boxes), len(boxes))


def read_regions(path: Path) -> list[Box | None]:
    """One region per line, each as its upright bounding box, None where the target is absent.

    Raises:
        DatasetError: naming the line that is no region.
    """
    result: list[Box | None] = []
    for number, line in enumerate(read_lines(path), start=1):
        try:
            result.append(parse_region(line.strip()))
        except (ValueError, OverflowError):
            raise DatasetError(
                f'{path}, line {number}: {line.strip()[:60]!r} is no region: write '
                f'x,y,width,height, a polygon, a mask, or nan,nan,nan,nan, at most {LARGEST:.0f} '
                'pixels'
            ) from None
    return result


def parse_region(text: str) -> Box | None:
    """The bounding box of one region.

    Raises:
        ValueError: where the text is none.
    """
    if text.startswith('m'):
        return _mask_bounds([int(v) for v in text[1:].split(',')])
    values = [float(v) for v in re.split(r'[,;\s]+', text)]
    if len(values) == 1:
        return None  # a code: 0 unknown, 1 start, 2 failure
    return box_of_region(values)


def _mask_bounds(values: list[int]) -> Box | None:
    if len(values) < 4:
        raise ValueError('mask')
    x, y, width, height = values[:4]
    runs = np.asarray(values[4:], np.int64)
    if (runs < 0).any() or runs.sum() > width * height:
        raise ValueError('mask')
    # Runs of outside and inside pixels in turn, row by row, the first outside.
    ends = np.cumsum(runs)
    pairs = zip(ends[0::2].tolist(), ends[1::2].tolist(), strict=False)
    inside = [(a, b) for a, b in pairs if b > a]
    if not inside:
        return None
    top = min(a // width for a, _ in inside)
    bottom = max((b - 1) // width for _, b in inside)
    left = min(0 if a // width != (b - 1) // width else a % width for a, b in inside)
    right = max(width - 1 if a // width != (b - 1) // width else (b - 1) % width for a, b in inside)
    return box_of_region([x + left, y + top, right - left + 1, bottom - top + 1])


def _settings(path: Path) -> dict[str, str]:
    if not is_there(path):
        return {}
    pairs = (line.split('=', 1) for line in read_lines(path) if '=' in line)
    return {key.strip(): value.strip() for key, value in pairs}


def _channel(
    path: Path, settings: dict[str, str], name: str
) -> tuple[Path | None, tuple[Path, ...]]:
    pattern = settings.get(f'channels.{name}', '')
    folder = path / pattern if '%' not in pattern else (path / pattern).parent
    if not pattern:
        folder = path / name
        if not folder.is_dir():
            return None, ()
    return folder, image_files(folder)
