# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The target as a body: its size in metres and the colours of its parts from top to bottom."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Mask
from rgbd_kcf_tracker.metric.perceive.colors import CODES, Codes, smoothed
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette

BANDS = 4
"""Horizontal bands of a body: about head, chest, hips and legs of a person."""
GROW_TIME = 0.4
SHRINK_TIME = 4.0
"""Seconds in which the size follows what is seen: arms go out fast and a side view does not make a
body smaller for long."""
USUAL_TIME = 20.0
"""Seconds over which the usual area is taken: longer than two who walk together mostly are one
figure."""
MOST_GROWTH = 1.7
"""Area against the usual one from which a body has more likely run together with another."""
COLOR_TIME = 1.0
"""Seconds in which the colours follow: who turns round takes about as long."""
ANCHOR = 0.03
ANCHOR_PER_METRE = 0.01
"""Metres, and metres for each of depth, by which the side of an outline that is not cut off is
unsure: hair and folds of clothes, and two pixels of the view, each half a centimetre at a metre."""
FILLED = 0.4
"""Share of its outline that a body fills, at the least, with arms and legs apart; of one that fills
less, readings are missing."""
WOBBLE = 0.06
"""Metres by which limbs move the outline of a body about its place: half of what an arm that swings
adds to one side."""
DEPTH_SIGMA = 0.05
DEPTH_SIGMA_PER_METRE = 0.02
"""Metres, and metres for each of depth, by which the median depth of a silhouette differs from the
body's: half a chest is 0.11 m deep, and which part of it shows changes as somebody turns. That is
far more than the readings' noise, on purpose: what looks for the target may be wide, but is not to
miss it. Where it is says :mod:`.middle`."""
ODDS_FLOOR = 1e-3
"""Share of pixels that is added to that of each colour, half of what all colours alike would have:
a colour that was never seen says nothing."""
ODDS_LIMIT = 3.0
"""Log-odds (20 to 1) that the colour of one pixel says at the most: neighbours have the same colour
and say it again."""


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A silhouette taken as the visible part of the body.

    Attributes:
        position: ``(3,)`` metres: the middle of the body across, its top, its depth.
        sigma: ``(3,)`` metres, how sure that is; large where the side that tells it is cut off.
        fraction: of the body that shows; above 1 where more shows than is known of.
    """

    position: FloatArray
    sigma: FloatArray
    fraction: float

    @property
    def floor(self) -> tuple[float, float]:
        """The place on the floor: metres across and ahead."""
        x, _, z = self.position.tolist()
        return x, z


class Body:
    """Size and colours of the target.

    The reference point is the middle of its upper edge: feet are often hidden or cut off by the
    image, the head seldom.

    Attributes:
        width, height: metres.
        area: square metres seen from the camera.
        width_known, height_known: False until both of its ends have been seen.
    """

    def __init__(self, first: Silhouette) -> None:
        self.width, self.height = first.width, first.height
        self.area = max(first.area, FILLED * first.width * first.height)
        self.width_known = not (first.cut.left or first.cut.right)
        self.height_known = not (first.cut.top or first.cut.bottom)
        self._usual_area = self.area
        self._colors = np.zeros((BANDS, CODES), np.float32)
        self._around = np.full(CODES, 1 / CODES, np.float32)
        self._odds: Floats | None = None

    # -- where a silhouette puts the body ---------------------------------------------------------

    def place(self, seen: Silhouette, expected: FloatArray) -> Placed:
        """Take a silhouette as the visible part of the body.

        Its reference point is ``expected`` at ``(3,)`` metres.
        """
        x, x_sigma = self._across(seen, expected[0])
        y, y_sigma = self._top(seen, expected[1])
        z = seen.depth
        z_sigma = DEPTH_SIGMA + DEPTH_SIGMA_PER_METRE * z
        sigma = np.hypot(WOBBLE, np.array([x_sigma, y_sigma, z_sigma]))
        return Placed(np.array([x, y, z]), sigma, self._fraction(seen))

    def _fraction(self, seen: Silhouette) -> float:
        extent = seen.width * seen.height / (self.width * self.height)
        # A body seen from its side has less area than its outline suggests.
        return max(seen.area / self.area, 0.8 * min(extent, 1.0))

    def _across(self, seen: Silhouette, expected: float) -> tuple[float, float]:
        left, _, right, _ = seen.metres
        sure = ANCHOR + ANCHOR_PER_METRE * seen.depth
        if seen.cut.left and seen.cut.right:
            low, high = sorted((right - self.width / 2, left + self.width / 2))
            return float(np.clip(expected, low, high)), sure + 0.25 * self.width
        if right - left >= self.width or not (seen.cut.left or seen.cut.right):
            return (left + right) / 2, sure
        if seen.cut.left:
            return right - self.width / 2, sure + 0.1 * self.width
        return left + self.width / 2, sure + 0.1 * self.width

    def _top(self, seen: Silhouette, expected: float) -> tuple[float, float]:
        _, top, _, bottom = seen.metres
        sure = ANCHOR + ANCHOR_PER_METRE * seen.depth
        if not seen.cut.top or bottom - top > self.height:
            return top, sure
        if not seen.cut.bottom:
            return bottom - self.height, sure + 0.1 * self.height
        return float(np.clip(expected, bottom - self.height, top)), sure + 0.25 * self.height

    # -- colours ----------------------------------------------------------------------------------

    def _rows(self, seen: Silhouette, view: DepthView, top: float) -> tuple[float, float]:
        """First row of the body within the silhouette's crop, and its number of rows."""
        _, row = view.place(0.0, top, seen.depth)
        return row - seen.top, self.height * view.intrinsics.fy / seen.depth

    def odds_of(self, codes: Codes, seen: Silhouette, view: DepthView, top: float) -> Floats:
        """Log odds that pixels in the rows of a silhouette are the body's, by their colours.

        ``codes`` are ``(h, n)`` with the silhouette's rows; the body's upper edge is at ``top``
        metres.
        """
        band = _bands_of_rows(len(codes), *self._rows(seen, view, top))
        if self._odds is None:
            floor = np.float32(ODDS_FLOOR)
            odds = np.log((self._colors + floor) / (self._around + floor))
            self._odds = np.clip(odds, -ODDS_LIMIT, ODDS_LIMIT)
        return self._odds[band[:, None], codes]

    # -- learning ---------------------------------------------------------------------------------

    def learn_size(self, seen: Silhouette, dt: float) -> None:
        """Follow the size of a silhouette of which nothing is cut off."""
        grow, shrink = 1 - np.exp(-dt / GROW_TIME), 1 - np.exp(-dt / SHRINK_TIME)

        def eased(old: float, new: float) -> float:
            return float(old * (new / old) ** (grow if new > old else shrink))

        self._usual_area *= (seen.area / self._usual_area) ** (1 - np.exp(-dt / USUAL_TIME))
        self.area = min(eased(self.area, seen.area), MOST_GROWTH * self._usual_area)
        self.width = eased(self.width, seen.width)
        self.height = eased(self.height, seen.height)

    def grow(self, seen: Silhouette) -> None:
        """Take in more of a body that was cut off wherever it has been seen so far."""
        if not self.height_known:
            self._enlarge(seen.height / self.height)
            self.height = max(self.height, seen.height)
            self.height_known = not (seen.cut.top or seen.cut.bottom)
        if not self.width_known:
            self._enlarge(seen.width / self.width)
            self.width = max(self.width, seen.width)
            self.width_known = not (seen.cut.left or seen.cut.right)

    def _enlarge(self, factor: float) -> None:
        self.area *= max(1.0, factor)
        self._usual_area *= max(1.0, factor)

    def learn_colors(self, seen: Silhouette, scene: Scene, top: float, dt: float) -> None:
        """Follow the colours of a silhouette, ``dt`` seconds since the last time.

        Those of a band that was not seen before are taken as they are. The body's upper edge is at
        ``top`` metres.
        """
        codes = scene.codes[seen.rows, seen.cols]
        counts = band_histograms(codes, seen.mask, *self._rows(seen, scene.view, top))
        rate = 1 - float(np.exp(-dt / COLOR_TIME))
        total = counts.sum(axis=1)
        rates = np.where(self._colors.sum(axis=1) == 0, 1.0, rate)
        rates[total <= 8] = 0.0
        r = rates[:, None].astype(np.float32)
        self._colors = (1 - r) * self._colors + r * (counts / np.maximum(total, 1)[:, None])
        self._odds = None

    def learn_around(
        self, seen: Silhouette, scene: Scene, part: tuple[slice, slice], dt: float | None
    ) -> None:
        """Follow the colours of what stands beside a silhouette, in a part of the view about it.

        What has no reading is left out. It is ``dt`` seconds since the last time, None at first.
        """
        beside = scene.view.depth > 0
        beside[seen.rows, seen.cols] &= ~seen.mask
        rate = np.float32(0.7 if dt is None else 1 - np.exp(-dt / COLOR_TIME))
        counts = np.bincount(scene.codes[part][beside[part]], minlength=CODES).astype(np.float32)
        counts = smoothed(counts[None])[0]
        total = counts.sum()
        if total > 20:
            self._around = (1 - rate) * self._around + rate * counts / total
        self._odds = None


def band_histograms(codes: Codes, mask: Mask, top: float, height: float) -> Floats:
    """Smoothed counts of colour codes in each band, ``(BANDS, CODES)``.

    Args:
        codes: ``(h, w)`` of the crop around the silhouette.
        mask: ``(h, w)`` bool, the silhouette.
        top: row of the crop in which the whole body begins (may be outside the crop).
        height: rows of the whole body.
    """
    index = (codes + (_bands_of_rows(len(codes), top, height) * CODES)[:, None])[mask]
    counts = np.bincount(index, minlength=BANDS * CODES).astype(np.float32)
    return smoothed(counts.reshape(BANDS, CODES))


def _bands_of_rows(count: int, top: float, height: float) -> Codes:
    """Band of each of ``count`` rows of a crop in which a body begins at row ``top``."""
    rows = np.arange(count, dtype=np.float32) + 0.5 - top
    bands = np.clip(rows * (BANDS / max(height, 1.0)), 0, BANDS - 1)
    return np.asarray(bands, np.int32)
