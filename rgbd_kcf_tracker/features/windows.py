# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Windows of an image, whatever part of them lies outside."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[Any]


def bordered(image: Image, left: int, top: int, width: int, height: int) -> Image:
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
    result: Image = cv2.copyMakeBorder(
        image[y0:y1, x0:x1],
        above,
        height - above - (y1 - y0),
        before,
        width - before - (x1 - x0),
        cv2.BORDER_REPLICATE,
    )
    return result


def _inside(start: int, size: int, limit: int) -> tuple[int, int]:
    first = min(max(start, 0), limit - 1)
    last = min(max(start + size, first + 1), limit)
    return first, last


def resampled(color: Image, cx: float, cy: float, side: float, size: int) -> Image:
    """The square of ``side`` pixels about ``cx, cy``, resampled to ``(size, size, channels)``.

    Pixels outside the image repeat the nearest inside. Where the window is shrunk the image is
    averaged, so that a far larger window neither aliases nor costs more than reading it once.
    """
    scale = size / side
    if scale < 0.67:
        # Average down by a whole factor first: warping alone would skip pixels.
        factor = int(1 / scale)
        color, left, top = _shown(color, cx, cy, side, factor)
        height, width = max(1, color.shape[0] // factor), max(1, color.shape[1] // factor)
        # OpenCV averages whole pixels three to fifteen times faster than parts of them.
        color = color[: height * factor, : width * factor]
        rx, ry = width / color.shape[1], height / color.shape[0]
        color = cv2.resize(color, (width, height), interpolation=cv2.INTER_AREA)
        cx, cy = (cx - left) * rx, (cy - top) * ry
        sx, sy = scale / rx, scale / ry
    else:
        sx = sy = scale
    return sampled(color, cx, cy, (sx, sy), (size, size))


def sampled(
    image: Image, cx: float, cy: float, scale: tuple[float, float], size: tuple[int, int]
) -> Image:
    """A window about ``cx, cy``, interpolated between the pixels without averaging.

    Pixels outside the image repeat the nearest inside.

    Args:
        image: ``(H, W)`` or ``(H, W, channels)``.
        cx: column of the middle; a pixel's own is half a pixel from its edges.
        cy: row of the middle.
        scale: pixels of the window for one of the image, across and down.
        size: width and height of the window.
    """
    (sx, sy), (cols, rows) = scale, size
    move = np.array(
        [
            [sx, 0, cols / 2 - 0.5 - sx * (cx - 0.5)],
            [0, sy, rows / 2 - 0.5 - sy * (cy - 0.5)],
        ]
    )
    result: Image = cv2.warpAffine(
        image, move, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return result


def _shown(color: Image, cx: float, cy: float, side: float, margin: int) -> tuple[Image, int, int]:
    """The part of the image that a window shows, at least one pixel, and its top-left corner.

    Where the image goes on there, ``margin`` more pixels are shown to the right and below.
    """
    rows, cols = color.shape[:2]
    left = int(np.clip(np.floor(cx - side / 2) - 1, 0, cols - 1))
    top = int(np.clip(np.floor(cy - side / 2) - 1, 0, rows - 1))
    right = int(np.clip(np.ceil(cx + side / 2) + margin, left + 1, cols))
    bottom = int(np.clip(np.ceil(cy + side / 2) + margin, top + 1, rows))
    return color[top:bottom, left:right], left, top
