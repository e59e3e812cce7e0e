# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whose each pixel of a frame is, counted once for all who are followed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette

Kinds = npt.NDArray[np.uint16]

NOTHING, ROOM, FIRST = 0, 1, 2
"""Kinds of pixels: of nothing known, of the room, of the first of the figures and so on."""


class Parts:
    """What the pixels of a frame belong to: a figure, the room, or nothing known.

    Args:
        scene: of the frame.
        figures: silhouettes that do not overlap.

    Attributes:
        surfaces: of the scene.
        kinds: ``(h, w)``, see :data:`FIRST`.
        length: number of kinds.
    """

    def __init__(self, scene: Scene, figures: Sequence[Silhouette]) -> None:
        self.kinds: Kinds = scene.still.astype(np.uint16)
        self.length = FIRST + len(figures)
        for kind, seen in enumerate(figures, FIRST):
            self.kinds[seen.rows, seen.cols][seen.mask] = kind
        self._counts: dict[Silhouette, list[int]] = {}

    def counts(self, seen: Silhouette) -> list[int]:
        """How many of a silhouette's pixels are of each kind."""
        counts = self._counts.get(seen)
        if counts is None:
            counts = self.counted(self.kinds[seen.rows, seen.cols][seen.mask])
            self._counts[seen] = counts
        return counts

    def counted(self, kinds: Kinds) -> list[int]:
        """How many of some pixels ``(n,)`` are of each kind."""
        counts: list[int] = np.bincount(kinds, minlength=self.length).tolist()
        return counts


@dataclass(frozen=True, eq=False)
class Others:
    """The pixels that are surely not a person's.

    Attributes:
        parts: of the frame.
        theirs: for each kind whether its pixels are of these.
    """

    parts: Parts
    theirs: list[bool]

    def within(self, rows: slice, cols: slice) -> npt.NDArray[np.bool_]:
        """Those in a part of the view, bool."""
        return np.array(self.theirs)[self.parts.kinds[rows, cols]]

    def share(self, seen: Silhouette) -> float:
        """Share of a silhouette's pixels, 0 to 1."""
        counts = self.parts.counts(seen)
        return sum(compress(counts, self.theirs)) / sum(counts)
