# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the target looks like: a masked correlation filter and its colours, learned together."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from scipy import fft

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Image, Mask
from rgbd_kcf_tracker.features.windows import resampled
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.identity.color_posterior import Codes, ColorPosterior, rgb_codes
from rgbd_kcf_tracker.metric.identity.masked_filter import MaskedFilter, Spectrum, spectrum_of
from rgbd_kcf_tracker.metric.identity.patch import PatchFeatures

FRAME = 1 / 30
"""Seconds to which the learning rates refer: a frame of the videos for which they were
published."""
MAX_RATE = 0.15
"""Share of a new sample at the most, however long ago the last was: at the default rate from 0.27
seconds on. One picture, which may show a turned or half hidden target, is not to be most of what is
known."""
COLOR_RATE = 2.0
"""How much faster than the filter the colours are learned: light and the side that shows change
them sooner than the shape."""
MEAN_TIME = 0.7
"""Seconds over which the mean peak is taken: some frames at 5 Hz, so that no single one says what
is usual."""
FIRST_PEAK = 0.6
"""What later peaks are of the first, which is that of the very sample just learned."""
MIN_MASK = 0.2
"""Share of the box that looks like the target, at the least, for the filter to be held to these
pixels: a body fills more of its box, so below this its colours are those around it, and the whole
box is taken."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """Where the target is most likely within a window.

    Attributes:
        cx, cy: its centre in pixels of the image.
        peak: the filter's response there.
        ratio: ``peak`` against its own recent mean while the target was seen.
    """

    cx: float
    cy: float
    peak: float
    ratio: float


@dataclass(frozen=True, slots=True, eq=False)
class _Reading:
    """What a window about ``cx, cy`` shows: to the filter, and codes of its colours."""

    cx: float
    cy: float
    scale: float
    spectrum: Spectrum
    codes: Codes


class Appearance:
    """The look of one target at a fixed number of cells, whatever its size in the image.

    Args:
        color: ``(H, W, 3)`` uint8 BGR, the first image.
        box: the target in it.
        cells: along a side of the search window.
        padding: the window is the target's mean side plus this many times its root area.
        sigma: width of the wanted response, in sixteenths of the target's root area.
        rate: share of a new sample in the filter, for each thirtieth of a second.
        color_share: weight of the colour posterior beside the filter's response, 0 to 1.
        masked: hold the filter to the pixels of the target's colours, else to its box.
    """

    def __init__(
        self,
        color: Image,
        box: Box,
        *,
        cells: int,
        padding: float,
        sigma: float,
        rate: float,
        color_share: float,
        masked: bool = True,
    ) -> None:
        self.width, self.height = box.width, box.height
        root = float(np.sqrt(box.area))
        self._base = (box.width + box.height) / 2 + padding * root
        self._features = PatchFeatures(cells)
        self._cells = cells
        self._pixels = self._features.pixels
        scale = self._pixels / self._base
        self._target = (box.width * scale, box.height * scale)
        width = sigma * np.sqrt(self._target[0] * self._target[1]) / 16 / (self._pixels / cells)
        self._filter = MaskedFilter(cells, max(0.6, float(width)))
        self._colors = ColorPosterior()
        self._rate = rate
        self._masked = masked
        self._share = np.float32(color_share)
        self._inner, self._outer, self._near = (
            self._boxed(self._pixels, factor) for factor in (0.85, 1.15, 2.0)
        )
        self._core, self._reach = (self._boxed(cells, factor, 2.0) for factor in (1.0, 1.1))
        self.mean_peak = 0.0
        self.learn(color, box.cx, box.cy, 1.0, None)
        self.mean_peak = FIRST_PEAK * self.look(color, box.cx, box.cy, 1.0).peak

    def _boxed(self, count: int, factor: float, least: float = 0.0) -> Mask:
        """The target in a window of ``(count, count)``, ``least`` pixels to each side or more."""
        place = np.abs(np.arange(count) + 0.5 - count / 2) * (self._pixels / count)
        across, down = (place <= max(side * factor / 2, least) for side in self._target)
        inside: Mask = down[:, None] & across[None, :]
        return inside

    def _read(self, color: Image, cx: float, cy: float, scale: float) -> _Reading:
        window = resampled(color, cx, cy, self._base * scale, self._pixels)
        spectrum = spectrum_of(self._features(window))
        return _Reading(cx, cy, scale, spectrum, rgb_codes(window))

    def posterior(self, color: Image) -> Floats:
        """How likely each pixel of an image is the target's by its colour, ``(h, w)`` 0 to 1."""
        return self._colors.of(rgb_codes(color))

    def cells(self, cx: float, cy: float, scale: float) -> tuple[FloatArray, FloatArray]:
        """Columns and rows, ``(cells,)`` pixels, where a window about ``cx, cy`` is asked."""
        n = self._cells
        place = (np.arange(n, dtype=np.float64) - n // 2) * (self._base * scale / n)
        return cx + place, cy + place

    def look(
        self, color: Image, cx: float, cy: float, scale: float, possible: Mask | None = None
    ) -> Sighting:
        """Look for the target in the window about ``cx, cy``.

        Args:
            color: ``(H, W, 3)`` uint8 BGR.
            cx: column of the window's middle in pixels.
            cy: row of the window's middle.
            scale: the target's size against its first one.
            possible: ``(cells, cells)``, where its middle may be; None for anywhere.
        """
        return self._sighted(self._read(color, cx, cy, scale), possible)

    def _sighted(self, read: _Reading, possible: Mask | None = None) -> Sighting:
        response = self._filter.response(read.spectrum)
        total = response
        if self._share > 0:
            posterior = self._colors.of(read.codes)
            size = (int(self._target[0]) | 1, int(self._target[1]) | 1)
            mean = cv2.boxFilter(posterior, -1, size, borderType=cv2.BORDER_REPLICATE)
            mean = cv2.resize(mean, (self._cells, self._cells), interpolation=cv2.INTER_AREA)
            if self._cells % 2 == 0:  # the response is that of the corners between four cells
                mean = cv2.blur(mean, (2, 2), borderType=cv2.BORDER_REPLICATE)
            total = (1 - self._share) * response + self._share * fft.ifftshift(mean)
        if possible is not None:
            possible = fft.ifftshift(possible)
            response, total = response * possible, total * possible
        n = self._cells
        i, j = (int(k) for k in np.unravel_index(int(np.argmax(total)), total.shape))
        dy = _vertex(total[(i - 1) % n, j], total[i, j], total[(i + 1) % n, j])
        dx = _vertex(total[i, (j - 1) % n], total[i, j], total[i, (j + 1) % n])
        pixel = self._base * read.scale / n
        peak = float(response[i, j])
        return Sighting(
            read.cx + ((j + n // 2) % n - n // 2 + dx) * pixel,
            read.cy + ((i + n // 2) % n - n // 2 + dy) * pixel,
            peak,
            peak / max(self.mean_peak, 1e-6),
        )

    def remember_peak(self, peak: float, dt: float) -> None:
        """Take a peak at which the target was surely seen into the mean."""
        self.mean_peak += (1 - np.exp(-dt / MEAN_TIME)) * (peak - self.mean_peak)

    def learn(self, color: Image, cx: float, cy: float, scale: float, dt: float | None) -> None:
        """Take the target at ``cx, cy`` as a sample, ``dt`` seconds after the last (None: none)."""
        self._learned(self._read(color, cx, cy, scale), dt)

    def attend(self, color: Image, cx: float, cy: float, scale: float, dt: float) -> None:
        """Take the target, which is surely at ``cx, cy``, ``dt`` seconds after the last sample."""
        read = self._read(color, cx, cy, scale)
        self.remember_peak(self._sighted(read).peak, dt)
        self._learned(read, dt)

    def _learned(self, read: _Reading, dt: float | None) -> None:
        if dt is None:
            rate = color_rate = 1.0
        else:
            rate = share_after(self._rate, dt)
            color_rate = min(MAX_RATE, COLOR_RATE * rate)
        self._colors.learn(read.codes, self._inner, self._near & ~self._outer, color_rate)
        self._filter.learn(read.spectrum, self._mask(read.codes), rate)

    def _mask(self, codes: Codes) -> Floats:
        """Where in the window the filter may look: the pixels of the target's colours."""
        if not self._masked:
            return self._core.astype(np.float32)
        posterior = self._colors.of(codes)
        n = self._cells
        posterior = cv2.resize(posterior, (n, n), interpolation=cv2.INTER_AREA)
        posterior = cv2.GaussianBlur(posterior, (3, 3), 0)
        mask = ((posterior > 0.5) & self._reach).astype(np.float32)
        if mask[self._core].mean() < MIN_MASK:
            return self._core.astype(np.float32)
        mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
        result: Floats = np.maximum(mask, np.float32(0.3) * self._core)
        return result


def share_after(rate: float, seconds: float) -> float:
    """Share of a new sample after so many seconds, where it is ``rate`` for each :data:`FRAME`."""
    return min(MAX_RATE, 1 - math.pow(1 - rate, seconds / FRAME))


def _vertex(before: float, peak: float, after: float) -> float:
    """Offset of a parabola's top from its middle sample, at most half a sample."""
    bend = before + after - 2 * peak
    if bend > -1e-9:
        return 0.0
    return float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5))
