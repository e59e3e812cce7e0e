# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The colours of the room: what looks unlike them stands before it, however little nearer it is.

Who leans back into a sofa or lies down is nearer than these by less than depth is uncertain by, but
in other colours.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import Image, Mask
from rgbd_kcf_tracker.metric.perceive.room import SETTLE

DIFFERS = 30
"""Levels of 255 by which a channel differs from the room's for a pixel to show something else: six
deviations of a camera's noise, of about 5 levels."""


class Paint:
    """What the room of one stream looks like, pixel by pixel, while its camera stands."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget all: the camera has moved."""
        self._colors = np.zeros((0, 0, 3), np.float32)
        self._known = np.zeros((0, 0), np.bool_)

    def differs(self, image: Image, part: tuple[slice, slice] = np.s_[:, :]) -> Mask | None:
        """Where an image looks unlike the room, ``(h, w)`` bool; None where nothing is known.

        Args:
            image: ``(h, w, 3)`` uint8 BGR, in the light of those before.
            part: rows and columns of the view that it shows.
        """
        known = self._known[part]
        if known.shape != image.shape[:2]:
            return None
        room = cv2.convertScaleAbs(self._colors[part])
        blue, green, red = cv2.split(cv2.absdiff(image, room))
        unlike: Mask = cv2.max(cv2.max(blue, green), red) > DIFFERS
        unlike &= known
        return unlike

    def learn(self, image: Image, still: Mask, dt: float) -> None:
        """Take the colours of what an image shows of the room.

        Where it looks otherwise from some time on, two thirds of that are known after the time in
        which what stands still becomes part of it (:data:`~.room.SETTLE`).

        Args:
            image: ``(h, w, 3)`` uint8 BGR, in the light of those before.
            still: ``(h, w)`` bool, the pixels that show it.
            dt: seconds since the last that was learned.
        """
        if self._known.shape != still.shape:
            self._colors, self._known = image.astype(np.float32), still.copy()
            return
        new = still & ~self._known
        if new.any():
            np.copyto(self._colors, image, where=new[:, :, None])
            self._known |= new
        share = 1.0 - math.exp(-dt / SETTLE)
        cv2.accumulateWeighted(image, self._colors, share, still.view(np.uint8))
