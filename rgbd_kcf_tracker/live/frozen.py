# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a camera still sends what it sees: a driver that hangs may repeat its last image.

Each time with a new stamp, so that it looks like any other. What a sensor measures is never twice
the same to the last bit; what a simulator without noise shows is, for as long as nothing moves.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.live.timeline import same_bytes
from rgbd_kcf_tracker.recordings.images import ColorImage
from rgbd_kcf_tracker.recordings.storage import NANOSECONDS

DEPTH_AFTER_NS, LEAST_IMAGES = NANOSECONDS // 2, 4
"""Depth that was the same for so long, in so many images, hangs where the picture has changed."""
COLOR_AFTER_NS = 5 * NANOSECONDS
"""A picture that was the same for so long may hang; of a simulator it may be right."""
COARSE = 64, 48
"""Fields of a picture, whose mean colours tell a change from noise."""
CHANGED, LEAST_FIELDS = 6, 3
"""Levels by which so many fields differ where something has moved, beside the light."""


class Repeated:
    """How often, and for how long, one stream has sent the same bytes."""

    def __init__(self) -> None:
        self._data: Any = None
        self._since_ns = 0
        self.images = 0
        self.lasted_ns = 0

    def take(self, data: Any, time_ns: int) -> bool:
        """The next image; the last one over again, as the same object, says nothing: False."""
        if data is self._data:
            return False
        if self._data is None or not same_bytes(data, self._data):
            self._since_ns, self.images = time_ns, 0
        self._data = data
        self.images += 1
        self.lasted_ns = time_ns - self._since_ns
        return True


class FrozenDepth:
    """Whether depth stands still while the picture beside it goes on."""

    def __init__(self) -> None:
        self._repeated = Repeated()
        self._before: npt.NDArray[np.float32] | None = None

    def __call__(self, data: Any, color: ColorImage, time_ns: int) -> bool:
        """Take in a pair.

        A change of the picture counts, for as long as it is there; not its noise, nor the light of
        all of it: that of a simulator may be noise alone, and where nothing moves, depth that
        stands still is right.

        Args:
            data: bytes of the depth message.
            color: the picture.
            time_ns: of the pair, rising.
        """
        self._repeated.take(data, time_ns)
        if self._repeated.images < 2:
            self._before = None
            return False
        if self._before is None:
            self._before = _coarse(color)
        long = self._repeated.lasted_ns >= DEPTH_AFTER_NS
        many = self._repeated.images >= LEAST_IMAGES
        return long and many and _changed(self._before, _coarse(color))


def _coarse(color: ColorImage) -> npt.NDArray[np.float32]:
    """The mean colours of its fields."""
    means = cv2.resize(color, COARSE, interpolation=cv2.INTER_AREA)
    return np.asarray(means, np.float32)


def _changed(before: npt.NDArray[np.float32], now: npt.NDArray[np.float32]) -> bool:
    """Whether more is another than the light, which adds as much everywhere, or scales all."""
    if not _differ(before, now):
        return False
    added = np.median(now - before, axis=(0, 1))
    scale = np.median((now + 1) / (before + 1), axis=(0, 1))
    return _differ(before + added, now) and _differ(before * scale, now)


def _differ(one: npt.NDArray[np.float32], other: npt.NDArray[np.float32]) -> bool:
    by = np.abs(one - other).max(axis=2)
    return int(np.count_nonzero(by > CHANGED)) >= LEAST_FIELDS
