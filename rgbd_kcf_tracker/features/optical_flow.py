# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Points of one image found again in the next (Lucas and Kanade 1981, in pyramids)."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

Gray = npt.NDArray[np.uint8]
Points = npt.NDArray[np.float32]

WINDOW, LEVELS = 11, 3
"""Pixels of the window of the flow, and halvings: together they follow 40 pixels a frame."""


def followed(last: Gray, now: Gray, points: Points) -> tuple[Points, npt.NDArray[np.bool_]]:
    """Where points of one image are in another.

    Args:
        last: ``(h, w)`` uint8, the image that they are of.
        now: the other, of that size.
        points: ``(n, 2)`` float32 columns and rows.

    Returns:
        ``(n, 2)`` float32 where they are, and ``(n,)`` bool which of them were found.
    """
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        last, now, points, None, winSize=(WINDOW, WINDOW), maxLevel=LEVELS
    )
    return found, status.ravel() > 0
