# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Picture strips: a row of small frames of a sequence with every tracker's box drawn in."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.evaluation.passes import read_thumbnails
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.images import decode_color_bytes
from rgbd_kcf_tracker.recordings.overlay import draw_box

FRAMES = 8
COLUMNS = 4
ENLARGED = 1.5
"""Pictures are drawn larger than they were kept, so that lines and letters are fine."""
_TRUTH = (255, 255, 255)
_SHADOW = (0, 0, 0)
_FONT = cv2.FONT_HERSHEY_SIMPLEX

Picture = npt.NDArray[np.uint8]


def strip(
    pictures_path: Path,
    scale: float,
    truth: FloatArray,
    boxes: Mapping[str, FloatArray],
    palette: Mapping[str, str],
    main: str,
    interesting: npt.NDArray[np.bool_],
) -> bytes | None:
    """A strip as JPEG; None where no picture was kept.

    Args:
        pictures_path: file of the pictures that were kept.
        scale: of these.
        truth: ``(N, 4)`` visible part, drawn dashed in black and white.
        boxes: per tracker ``(N, 4)``, drawn in the tracker's colour.
        palette: colours as ``#rrggbb``.
        main: the tracker drawn on top of the others.
        interesting: ``(N,)`` frames that should be among those shown (occlusion, errors).
    """
    pictures = read_thumbnails(pictures_path)
    indices = np.array([i for i in pictures if i < len(truth)], np.int64)
    if not len(indices):
        return None
    scale = scale * ENLARGED
    tiles = []
    for i in choose(indices, interesting):
        try:
            picture = decode_color_bytes(memoryview(pictures[i]))
        except RgbdKcfError:
            continue
        size = (round(picture.shape[1] * ENLARGED), round(picture.shape[0] * ENLARGED))
        image: Picture = np.asarray(cv2.resize(picture, size), np.uint8)
        _dashed(image, truth[i] * scale)
        missing = []
        for name in sorted(boxes, key=lambda name: name == main):
            box = boxes[name][i]
            if np.isnan(box[0]):
                missing.append(name)
            else:  # the main tracker's line is thin, on top: a box below it shows as a rim
                thickness = 2 if name == main else 4
                draw_box(image, Box(*(box * scale)), _bgr(palette[name]), thickness)
        _label(image, f'{i}', missing, palette, np.isnan(truth[i, 0]))
        tiles.append(image)
    if not tiles:
        return None
    done, data = cv2.imencode('.jpg', _montage(tiles), [cv2.IMWRITE_JPEG_QUALITY, 82])
    return data.tobytes() if done else None


def choose(
    indices: npt.NDArray[np.int64], interesting: npt.NDArray[np.bool_], count: int = FRAMES
) -> list[int]:
    """Up to ``count`` of the kept frames: half evenly spread, half from the interesting ones.

    Args:
        indices: ``(K,)`` frames that may be chosen, ascending.
        interesting: ``(N,)`` bool, of all frames.
        count: of frames at the most.

    Returns:
        Their indices, ascending.
    """
    if len(indices) <= count:
        return [int(i) for i in indices]
    special = indices[interesting[indices]]
    wanted = set(_spread(indices, count - min(len(special), count // 2)))
    rest = [i for i in special if int(i) not in wanted]
    wanted |= set(_spread(np.array(rest, np.int64), count - len(wanted)))
    others = [int(i) for i in indices if int(i) not in wanted]
    wanted |= set(_spread(np.array(others, np.int64), count - len(wanted)))
    return sorted(wanted)


def _spread(values: npt.NDArray[np.int64], count: int) -> list[int]:
    if not len(values) or count <= 0:
        return []
    places = np.linspace(0, len(values) - 1, min(count, len(values))).round().astype(np.int64)
    return [int(v) for v in values[places]]


def _montage(tiles: list[Picture]) -> Picture:
    # Pictures of one recording may differ in size.
    height, width = (max(tile.shape[axis] for tile in tiles) for axis in (0, 1))
    rows = -(-len(tiles) // COLUMNS)
    gap = 4
    across = min(COLUMNS, len(tiles))
    sheet = np.full((rows * (height + gap) - gap, across * (width + gap) - gap, 3), 255, np.uint8)
    for n, tile in enumerate(tiles):
        y, x = (n // COLUMNS) * (height + gap), (n % COLUMNS) * (width + gap)
        sheet[y : y + tile.shape[0], x : x + tile.shape[1]] = tile
    return sheet


def _dashed(image: Picture, box: FloatArray) -> None:
    if np.isnan(box[0]):
        return
    # Far outside the image OpenCV's coordinates would overflow, and dashes would never end.
    size = np.array(image.shape[1::-1], np.float64)
    left, top = np.clip(box[:2], -size, 2 * size).astype(int).tolist()
    right, bottom = np.clip(box[:2] + box[2:], -size, 2 * size).astype(int).tolist()
    cv2.rectangle(image, (left, top), (right, bottom), _SHADOW, 1)  # seen on bright pictures too
    for x in range(left, right, 8):
        for y in (top, bottom):
            cv2.line(image, (x, y), (min(x + 4, right), y), _TRUTH, 1)
    for y in range(top, bottom, 8):
        for x in (left, right):
            cv2.line(image, (x, y), (x, min(y + 4, bottom)), _TRUTH, 1)


def _label(
    image: Picture, text: str, missing: list[str], palette: Mapping[str, str], absent: bool
) -> None:
    """Frame number, 'absent' where the target is, a dot for each tracker without a box."""
    words = f'{text}  absent' if absent else text
    (width, height), _ = cv2.getTextSize(words, _FONT, 0.55, 1)
    cv2.rectangle(image, (0, 0), (width + 10 + 16 * len(missing), height + 8), (40, 40, 40), -1)
    cv2.putText(image, words, (4, height + 3), _FONT, 0.55, (255, 255, 255), 1, cv2.LINE_AA)
    for n, name in enumerate(missing):
        center = (width + 15 + 16 * n, (height + 8) // 2)
        cv2.circle(image, center, 6, _bgr(palette[name]), -1, cv2.LINE_AA)


def _bgr(color: str) -> tuple[int, int, int]:
    return int(color[5:7], 16), int(color[3:5], 16), int(color[1:3], 16)
