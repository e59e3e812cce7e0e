# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whose each pixel of a frame is, counted once for all who are followed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Mask
from rgbd_kcf_tracker.metric.perceive.room import tolerance
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette

Kinds = npt.NDArray[np.uint16]

NOTHING, ROOM, FIRST = 0, 1, 2
"""Kinds of pixels: of nothing known, of the room, of the first of the figures and so on."""
OUTSIDE = 3
"""Pixels of the view beyond an outline at which it is asked what goes on there: one beyond the two
that a seam between two surfaces is wide."""
NO_STEP = 0.6
"""Of the tolerance of the room up to which depth goes on beyond an outline: two deviations."""
LEAST_OUTLINE = 15
"""Places along an outline that tell of it at the least: fewer are one corner of it."""


class Parts:
    """What the pixels of a frame belong to: a figure, the room, or nothing known.

    Args:
        scene: of the frame.
        figures: silhouettes that do not overlap.

    Attributes:
        kinds: ``(h, w)``, see :data:`FIRST`.
        length: number of kinds.
    """

    def __init__(self, scene: Scene, figures: Sequence[Silhouette]) -> None:
        self.kinds: Kinds = scene.still.astype(np.uint16)
        self.length = FIRST + len(figures)
        self._scene = scene
        for kind, seen in enumerate(figures, FIRST):
            self.kinds[seen.rows, seen.cols][seen.mask] = kind
        self._counts: dict[Silhouette, list[int]] = {}

    @cached_property
    def joined(self) -> list[float | None]:
        """For each figure the share of its outline where it is joined to something large.

        Somebody ends where what is farther shows beside him; a piece of a wall is one surface with
        the rest of it, which is larger than anybody. Whatever else is beside him tells nothing, and
        a share is None where hardly anything does.
        """
        scene, elsewhere = self._scene, self.kinds < FIRST
        asked = elsewhere & scene.standing
        large = np.where(scene.large, np.arange(len(scene.surfaces)), 0)[scene.surfaces.labels]
        goes_on, ends = np.zeros((2, self.length), np.intp)
        images = scene.view.depth, self.kinds, elsewhere, asked, large
        for turned in (np.asarray, np.fliplr, np.transpose, lambda image: np.fliplr(image.T)):
            depth, kinds, outside, beyond, surface = (turned(image) for image in images)
            here, next_, there = np.s_[:, :-OUTSIDE], np.s_[:, 1 : 1 - OUTSIDE], np.s_[:, OUTSIDE:]
            at = np.nonzero((kinds[here] >= FIRST) & outside[next_] & beyond[there])
            inside, kind = depth[here][at], kinds[here][at]
            step, noise = depth[there][at] - inside, NO_STEP * tolerance(inside)
            same = surface[here][at]
            on = (np.abs(step) <= noise) & (same > 0) & (same == surface[there][at])
            goes_on += np.bincount(kind[on], minlength=self.length)
            ends += np.bincount(kind[step > noise], minlength=self.length)
        told = goes_on + ends
        return [
            float(on / of) if of >= LEAST_OUTLINE else None
            for on, of in zip(goes_on[FIRST:], told[FIRST:], strict=True)
        ]

    def counts(self, seen: Silhouette) -> list[int]:
        """How many of a silhouette's pixels are of each kind."""
        counts = self._counts.get(seen)
        if counts is None:
            counts = self.counted(seen.pixels(self.kinds))
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

    def within(self, rows: slice, cols: slice) -> Mask:
        """Those in a part of the view, bool."""
        return np.array(self.theirs)[self.parts.kinds[rows, cols]]

    def share(self, seen: Silhouette) -> float:
        """Share of a silhouette's pixels, 0 to 1."""
        counts = self.parts.counts(seen)
        return sum(compress(counts, self.theirs)) / sum(counts)
