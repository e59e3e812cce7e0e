# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The grey window that Henriques' code looks at."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.features.windows import bordered


def gray_window(
    color: npt.NDArray[np.uint8],
    cx: float,
    cy: float,
    source: tuple[int, int],
    target: tuple[int, int],
) -> npt.NDArray[np.uint8]:
    """A grey window about ``cx, cy``, resampled to a fixed size.

    The window lies where Henriques' code, which counts pixels from 1, puts it: up to one and a half
    pixels right of and below the middle. The tracker moves by whole cells, so this is what decides
    whether it takes the same path as the reference; it is the same in training and detection.

    Args:
        color: ``(H, W, 3)`` uint8, BGR.
        cx: column of the target's centre.
        cy: row of the target's centre.
        source: width and height of the window in pixels of the image.
        target: width and height of the result; equal to ``source`` means no resampling.

    Returns:
        ``(target height, target width)`` uint8.
    """
    halves = source == (2 * target[0], 2 * target[1])
    step, margin = (2, _HALVING_REACH) if halves else (1, 0)
    left, top = (
        (int(np.floor(center)) + 1) // step * step - side // (2 * step) * step - margin
        for center, side in ((cx, source[0]), (cy, source[1]))
    )
    if not halves and source[0] * source[1] > _MOST_AT_ONCE:
        return _sampled(color, left, top, source, target)
    cropped = bordered(color, left, top, source[0] + 2 * margin, source[1] + 2 * margin)
    gray: npt.NDArray[np.uint8] = cv2.cvtColor(np.ascontiguousarray(cropped), cv2.COLOR_BGR2GRAY)
    if halves:
        return _halved(gray)
    if source == target:
        return gray
    # Averaging when shrinking, so that nothing aliases; linear when growing.
    how = cv2.INTER_AREA if target[0] < source[0] else cv2.INTER_LINEAR
    resampled: npt.NDArray[np.uint8] = cv2.resize(gray, target, interpolation=how)
    return resampled


# Windows of more pixels than this are sampled, not averaged.
_MOST_AT_ONCE = 16_000_000


def _sampled(
    color: npt.NDArray[np.uint8],
    left: int,
    top: int,
    source: tuple[int, int],
    target: tuple[int, int],
) -> npt.NDArray[np.uint8]:
    """A window far larger than the image, at the middle of each of its pixels."""
    rows = top + ((np.arange(target[1]) + 0.5) * source[1] / target[1]).astype(np.int64)
    cols = left + ((np.arange(target[0]) + 0.5) * source[0] / target[0]).astype(np.int64)
    row = np.clip(rows, 0, color.shape[0] - 1)
    col = np.clip(cols, 0, color.shape[1] - 1)
    gray: npt.NDArray[np.uint8] = cv2.cvtColor(color[row[:, None], col], cv2.COLOR_BGR2GRAY)
    return gray


# Keys' cubic (a = -1/2) stretched to twice its width, at half-pixel distances: the antialiased
# bicubic halving that the reference was published with.
_HALVING_TAPS = np.array([-3, -9, 29, 111, 111, 29, -9, -3], np.float32) / 256
# Pixels that the taps reach beyond the window, made even.
_HALVING_REACH = 4


def _halved(gray: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Half the size, without the reach on each side."""
    smooth = cv2.sepFilter2D(gray, -1, _HALVING_TAPS, _HALVING_TAPS, anchor=(3, 3))
    inside = slice(_HALVING_REACH, -_HALVING_REACH, 2)
    return np.ascontiguousarray(smooth[inside, inside])
