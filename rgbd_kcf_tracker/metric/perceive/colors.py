# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Colours as codes that a change of light only shifts.

Lightness and tint are taken from logarithms of the channels: light that is twice as strong then
adds the same to all three, so that it moves lightness by a level or two and leaves the tint, the
differences between channels, as it is (log-chromaticity; Finlayson and Hordley, "Color constancy at
a pixel", 2001). In CIE Lab, where a colour's chroma grows with its lightness, somebody who comes
from a dark doorway to the window becomes somebody else.
"""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats, Image
from rgbd_kcf_tracker.metric.perceive.light import STRIDE

Codes = npt.NDArray[np.int32]

LIGHTNESS, TINTS = 10, 7
"""Levels of lightness, and of red and blue against green each: with 8 to 14 and 7 to 13 of them
people are told apart alike (docs/experiments.md), and few are fast."""
CODES = LIGHTNESS * TINTS * TINTS
"""Colours that are told apart, which follows from these."""

DARKEST = 20.0
"""Added to each channel before the logarithm: what is darker than this is mostly noise."""
STEEPNESS = 3.0
"""Of the tint levels: clothes have little tint, so the levels lie close about grey."""
COLORLESS = 3
"""Levels of 255 by which the channels of a picture without colours differ at the most, where JPEG
has rounded them."""
_STEPS = 32
"""Steps of the logarithm for each factor of e: finer than the levels by far."""

_LOG = np.rint(_STEPS * np.log((np.arange(256) + DARKEST) / DARKEST)).astype(np.uint8)
_TOP = int(_LOG[-1])
# Tables of 256, of which those of a tint begin at the largest negative difference.
_LEVEL = (np.arange(256) * LIGHTNESS // (_TOP + 1)).astype(np.int32) * (TINTS * TINTS)
_TINT = np.minimum(
    TINTS / 2 * (1 + np.tanh((np.arange(256) - _TOP) * (STEEPNESS / _STEPS))), TINTS - 1
).astype(np.int32)
_TINT_OF_RED = _TINT * TINTS


def _blur(levels: int) -> Floats:
    """The symmetric matrix that shares each of ``levels`` counts with its neighbours."""
    beside = np.eye(levels, k=1) + np.eye(levels, k=-1)
    beside[0, 0] = beside[-1, -1] = 1.0
    return (0.5 * np.eye(levels) + 0.25 * beside).astype(np.float32)


_BLUR_LEVEL, _BLUR_TINTS = _blur(LIGHTNESS), np.kron(_blur(TINTS), _blur(TINTS))
_LUMA = np.array([0.114, 0.587, 0.299])
"""Shares of blue, green and red in lightness, which are OpenCV's (ITU-R BT.601)."""


def view_image(color: Image, step: int) -> Image:
    """Every ``step``-th pixel of a ``(H, W, 3)`` uint8 BGR image, each from the middle of a step.

    Args:
        color: the image.
        step: as of the :class:`~rgbd_kcf_tracker.metric.perceive.depth_view.DepthView`.

    Returns:
        ``(h, w, 3)`` uint8, of the view's size.
    """
    # The exact nearest neighbours of OpenCV 4.6 are others at even steps.
    first = step // 2
    taken = color[first::step, first::step]
    image = np.empty(taken.shape, np.uint8)
    for channel in range(3):  # a third of the time of three bytes at once
        image[..., channel] = taken[..., channel]
    return image


def color_codes(image: Image) -> Codes:
    """Code 0 to ``CODES - 1`` of each pixel, ``(h, w)``, of an image ``(h, w, 3)`` uint8 BGR.

    Lightness counts ``TINTS ** 2``, red against green ``TINTS``, blue against green 1.
    """
    logs = cv2.LUT(image, _LOG)
    blue, green, red = cv2.split(logs)
    codes: Codes = cv2.LUT(cv2.cvtColor(logs, cv2.COLOR_BGR2GRAY), _LEVEL)
    offset = _TOP - green  # may wrap, as its sums with the others then do: they lie in 0 to 2 _TOP
    codes += cv2.LUT(red + offset, _TINT_OF_RED)
    codes += cv2.LUT(blue + offset, _TINT)
    return codes


class ColorCodes:
    """The colour codes of a view's image, made where they are looked at.

    Only those of people and of what stands beside them ever are: a small part of most views.

    Args:
        image: ``(h, w, 3)`` uint8 BGR.
    """

    def __init__(self, image: Image) -> None:
        self._image = image
        self._made: dict[tuple[int, int, int, int], Codes] = {}

    @cached_property
    def grey(self) -> bool:
        """Whether the camera sees no colours, as one of infrared light."""
        blue, green, red = cv2.split(self._image[::STRIDE, ::STRIDE])
        apart = max(cv2.norm(green, other, cv2.NORM_INF) for other in (blue, red))
        return bool(apart <= COLORLESS)

    def __getitem__(self, part: tuple[slice, slice]) -> Codes:
        """Those of some rows and columns, ``(h, w)``; the same array for whoever asks."""
        rows, cols = part
        key = rows.start, rows.stop, cols.start, cols.stop
        codes = self._made.get(key)
        if codes is None:
            codes = self._made[key] = color_codes(self._image[part])
        return codes


def smoothed(counts: Floats) -> Floats:
    """Each code's count shared with its neighbours: 1/4, 1/2, 1/4 along each of the three axes.

    A small change of light then does not move a colour out of its bin.

    Args:
        counts: ``(n, CODES)``.

    Returns:
        The same shape.
    """
    tinted = counts.reshape(-1, TINTS * TINTS) @ _BLUR_TINTS
    result: Floats = _BLUR_LEVEL @ tinted.reshape(-1, LIGHTNESS, TINTS * TINTS)
    return result.reshape(counts.shape)


def palette() -> Floats:
    """A colour for each code, for showing what a histogram holds, ``(CODES, 3)`` BGR 0 to 255."""
    level = (np.arange(LIGHTNESS) + 0.5) * (_TOP / LIGHTNESS / _STEPS)
    tint = np.arctanh(2 * (np.arange(TINTS) + 0.5) / TINTS - 1) / STEEPNESS
    y, red, blue = np.meshgrid(level, tint, tint, indexing='ij')
    green = y - _LUMA[0] * blue - _LUMA[2] * red
    logs = np.stack((green + blue, green, green + red), axis=-1).reshape(CODES, 3)
    colors: Floats = np.clip(DARKEST * np.expm1(logs), 0, 255).astype(np.float32)
    return colors
