# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The picture with the tracker's answer drawn on it."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.track import Track, TrackState

COLORS = {
    TrackState.IDLE: (160, 160, 160),
    TrackState.TRACKING: (80, 220, 60),
    TrackState.OCCLUDED: (0, 170, 255),
    TrackState.LOST: (60, 60, 235),
}
"""BGR, by state: grey, green, amber, red."""


def annotated(image: npt.NDArray[np.uint8], track: Track) -> npt.NDArray[np.uint8]:
    """A copy of a ``(H, W, 3)`` BGR image with the box and a line of words on it."""
    out = np.array(image, order='C')
    height, width = out.shape[:2]
    color = COLORS[track.state]
    scale = max(height / 540, 0.4)
    thick = max(round(2 * scale), 1)
    if track.box is not None:
        shown = track.box.clipped(width, height)
        if shown is not None:
            corners = [round(v) for v in (shown.x, shown.y, shown.right, shown.bottom)]
            cv2.rectangle(out, corners[:2], corners[2:], color, thick, cv2.LINE_AA)
    words = track.state.name
    if track.box is not None:
        words += f'  {track.score:.2f}'
    if track.depth is not None:
        words += f'  {track.depth:.2f} m'
    place = round(12 * scale), round(28 * scale)
    font = cv2.FONT_HERSHEY_SIMPLEX
    cv2.putText(out, words, place, font, 0.8 * scale, (0, 0, 0), thick + 2, cv2.LINE_AA)
    cv2.putText(out, words, place, font, 0.8 * scale, color, thick, cv2.LINE_AA)
    return out
