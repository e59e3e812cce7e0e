# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whom a network is asked about, and when: it takes longer than all else that a frame needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.identity.embedding import Described, Embedding
from rgbd_kcf_tracker.metric.identity.gallery import NOVEL, Looks, View, similarity

FRESH = 0.5
"""Seconds for which who stands alone, and looks as he did, is not described again."""
ALONE = 1.0
"""Metres to the next from which somebody stands alone: closer, one may be taken for the other."""


class Describer:
    """Adds to views how a network describes them.

    Args:
        embedding: the network.

    Attributes:
        frame: the one that it is asked about.
    """

    def __init__(self, embedding: Embedding) -> None:
        self.frame: Frame | None = None
        self._embedding = embedding
        self._size: int | None = None
        self._places: FloatArray = np.zeros((0, 2))
        self._last: list[tuple[float, View]] = []

    def forget(self) -> None:
        """Who is where the last frame showed somebody may be anybody.

        The camera has moved, or that frame showed nobody.
        """
        self._places, self._last = np.zeros((0, 2)), []

    def described(self, views: Sequence[View], boxes: Sequence[Box]) -> list[View]:
        """Views of the frame with what the network says of their boxes.

        Raises:
            ParameterError: where that is not a vector for each, as long as the others were.
        """
        assert self.frame is not None
        found = np.asarray(self._embedding.describe(self.frame, boxes), np.float32)
        self._size = found.shape[-1] if self._size is None and found.ndim == 2 else self._size
        if found.shape != (len(boxes), self._size) or not self._size:
            raise ParameterError(
                f'an embedding must give a vector for each of {len(boxes)} boxes, always of one '
                f'length: ({len(boxes)}, {self._size or "d"}) numbers, not {found.shape}'
            )
        even, steepness = self._embedding.even, self._embedding.steepness
        told = list(views)
        for n, vector in enumerate(found):
            length = np.linalg.norm(vector)
            if np.isfinite(length) and length > 0:  # else nothing is said
                told[n] = replace(told[n], described=Described(vector / length, even, steepness))
        return told

    def everybody(
        self, views: Sequence[View], boxes: Sequence[Box], places: FloatArray, time: float
    ) -> list[View]:
        """Those in view; the network is not asked of who stands alone and looks as a moment ago.

        Args:
            views: of ``n`` of them.
            boxes: about each.
            places: ``(n, 2)`` metres, where they are.
            time: seconds.

        Raises:
            ParameterError: see :meth:`described`.
        """
        known = [
            self._still(view, place, places, time)
            for view, place in zip(views, places, strict=True)
        ]
        asked = [n for n, each in enumerate(known) if each is None]
        if asked:
            found = self.described([views[n] for n in asked], [boxes[n] for n in asked])
            for n, view in zip(asked, found, strict=True):
                known[n] = time, view
        self._places, self._last = places, [each for each in known if each is not None]
        return [
            replace(view, described=last.described)
            for view, (_, last) in zip(views, self._last, strict=True)
        ]

    def _still(
        self, view: View, place: FloatArray, places: FloatArray, time: float
    ) -> tuple[float, View] | None:
        """Who was described at a place, and when, if that is he who stands there now, alone."""
        if np.count_nonzero(_near(place, places)) > 1:  # everybody is near himself
            return None
        (before,) = np.nonzero(_near(place, self._places))
        if len(before) != 1:
            return None
        since, last = self._last[before[0]]
        alike = similarity(view, Looks.of([last]))[0] > NOVEL  # nor where that is not known
        return (since, last) if alike and time - since < FRESH else None


def _near(place: FloatArray, places: FloatArray) -> Mask:
    near: Mask = np.hypot(*(places - place).T) < ALONE
    return near
