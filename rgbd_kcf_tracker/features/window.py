# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Cutting a window out of an image, whatever part of it lies outside."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[Any]


def cut(image: Image, left: int, top: int, width: int, height: int) -> Image:
    """The ``height`` x ``width`` window whose top-left pixel is ``left, top``.

    Pixels outside the image repeat the nearest one inside. The result is a view of ``image`` where
    the window lies inside, else a new array.
    """
    rows, cols = image.shape[:2]
    if left >= 0 and top >= 0 and left + width <= cols and top + height <= rows:
        return image[top : top + height, left : left + width]
    # The part inside, at least one pixel of it: what a window far outside repeats.
    x0, x1 = _inside(left, width, cols)
    y0, y1 = _inside(top, height, rows)
    above, before = min(max(y0 - top, 0), height - 1), min(max(x0 - left, 0), width - 1)
    bordered: Image = cv2.copyMakeBorder(
        image[y0:y1, x0:x1],
        above,
        height - above - (y1 - y0),
        before,
        width - before - (x1 - x0),
        cv2.BORDER_REPLICATE,
    )
    return bordered


def _inside(start: int, size: int, limit: int) -> tuple[int, int]:
    first = min(max(start, 0), limit - 1)
    last = min(max(start + size, first + 1), limit)
    return first, last


def gray_window(
    color: npt.NDArray[np.uint8],
    cx: float,
    cy: float,
    source: tuple[int, int],
    target: tuple[int, int],
) -> npt.NDArray[np.uint8]:
    """A grey window about ``cx, cy``, resampled to a fixed size.

    Args:
        color: ``(H, W, 3)`` uint8, BGR.
        cx: column of the window's middle, rounded down to a whole pixel as in the reference.
        cy: row of the window's middle, likewise.
        source: width and height of the window in pixels of the image.
        target: width and height of the result; equal to ``source`` means no resampling.

    Returns:
        ``(target height, target width)`` uint8.
    """
    width, height = source
    left = int(np.floor(cx)) - width // 2
    top = int(np.floor(cy)) - height // 2
    gray: npt.NDArray[np.uint8] = cv2.cvtColor(
        np.ascontiguousarray(cut(color, left, top, width, height)), cv2.COLOR_BGR2GRAY
    )
    if source == target:
        return gray
    # Averaging when shrinking, so that halving does not alias; linear when growing.
    shrinks = target[0] < width
    how = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    resampled: npt.NDArray[np.uint8] = cv2.resize(gray, target, interpolation=how)
    return resampled
