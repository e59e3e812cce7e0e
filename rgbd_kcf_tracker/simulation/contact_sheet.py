# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One picture of many scenes: first frame, a telling one, and its depth, with the true boxes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Image
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.overlay import draw_box
from rgbd_kcf_tracker.simulation.sequence import SimulatedFrame, SimulatedSequence

VISIBLE: tuple[int, int, int] = (60, 230, 60)
BODY: tuple[int, int, int] = (255, 200, 60)
OTHERS: tuple[int, int, int] = (80, 80, 240)
_LABEL = 20
_GAP = 8


def contact_sheet(
    sequences: Iterable[SimulatedSequence], columns: int = 3, tile: int = 192
) -> Image:
    """Show each scene as three tiles: start, telling moment, depth of that moment.

    Args:
        sequences: the scenes, at any rate; a few hertz are enough to find the moment.
        columns: scenes beside each other.
        tile: width of a tile in pixels.

    Returns:
        ``(H, W, 3)`` uint8 BGR. The visible part's box is green, the whole body's blue; those of
        other people with ids are red.
    """
    cells = [_cell(sequence, tile) for sequence in sequences]
    height = max(cell.shape[0] for cell in cells)
    width = cells[0].shape[1]
    rows = -(-len(cells) // columns)
    sheet = np.full(
        (rows * (height + _GAP) + _GAP, columns * (width + _GAP) + _GAP, 3), 255, np.uint8
    )
    for i, cell in enumerate(cells):
        top = _GAP + i // columns * (height + _GAP)
        left = _GAP + i % columns * (width + _GAP)
        sheet[top : top + cell.shape[0], left : left + width] = cell
    return sheet


def telling_moment(sequence: SimulatedSequence) -> int:
    """The frame that shows best what the scene is about.

    The target half hidden; else depth missing on it; else another light, shape or place.
    """
    truths = [sequence.truth(i) for i in range(len(sequence))]
    first, light = truths[0].visible, sequence.scene.light
    best, best_value = 0, -np.inf
    for i, truth in enumerate(truths[1:], 1):
        box = truth.visible
        if box is None or first is None:
            continue
        t = (sequence.stamp_ns(i) - sequence.stamp_ns(0)) * 1e-9
        value = 0.5 * abs(np.log(light(t)[1] / light(0)[1])) + 0.1 * (1 - first.iou(box))
        value += 1 - first.iou(Box.from_center(first.cx, first.cy, box.width, box.height))
        if any(a <= t < b for a, b in sequence.scene.sensor.no_target_depth):
            value += 4
        if truth.visible_fraction < 0.75:
            value += 2 - abs(truth.visible_fraction - 0.55)
        if value > best_value:
            best, best_value = i, value
    return best


def draw_truth(image: Image, simulated: SimulatedFrame) -> Image:
    """A copy of the image with the true boxes; its size may differ from the frame's."""
    out: Image = image.copy()
    scale = image.shape[1] / simulated.frame.width
    others = [(truth.visible, OTHERS) for id_, truth in simulated.truths.items() if id_ != 1]
    for box, color in (*others, (simulated.body, BODY), (simulated.visible, VISIBLE)):
        if box is not None:
            draw_box(out, box.stretched(scale, scale), color, 1)
    return out


def depth_picture(
    depth: npt.NDArray[np.float32] | None, size: tuple[int, int], span: Sequence[float] = (0.5, 7.0)
) -> Image:
    """Depth in colours, near red to far blue, black where there is no reading."""
    width, height = size
    if depth is None:
        return np.zeros((height, width, 3), np.uint8)
    small = cv2.resize(depth, size, interpolation=cv2.INTER_NEAREST)
    level = (small - span[0]) / (span[1] - span[0])
    level = np.nan_to_num(1 - np.clip(level, 0, 1))
    colors = cv2.applyColorMap((level * 255).astype(np.uint8), cv2.COLORMAP_TURBO)
    colors[np.isnan(small)] = 0
    return np.asarray(colors, np.uint8)


def _cell(sequence: SimulatedSequence, tile: int) -> Image:
    width, height = sequence.size
    size = (tile, round(tile * height / width))
    moment = telling_moment(sequence)
    pictures: list[Image] = []
    for index in (0, moment):
        simulated = sequence[index]
        small = cv2.resize(simulated.frame.color, size, interpolation=cv2.INTER_AREA)
        pictures.append(draw_truth(np.asarray(small, np.uint8), simulated))
    pictures.append(draw_truth(depth_picture(simulated.frame.depth, size), simulated))
    if simulated.frame.depth is None:
        cv2.putText(pictures[-1], 'no depth', (tile // 3, size[1] // 2), cv2.FONT_HERSHEY_SIMPLEX,
                    0.45, (200, 200, 200), 1, cv2.LINE_AA)  # fmt: skip
    label = np.full((_LABEL, 3 * tile, 3), 255, np.uint8)
    begun, ended = sequence.stamp_ns(0), sequence.stamp_ns(len(sequence) - 1)
    at, length = (sequence.stamp_ns(moment) - begun) * 1e-9, (ended - begun) * 1e-9
    text = f'{sequence.scenario}: start, and {at:.1f} s of {length:.1f} s'
    cv2.putText(label, text, (2, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (30, 30, 30), 1, cv2.LINE_AA)
    return np.concatenate([label, np.concatenate(pictures, axis=1)])
