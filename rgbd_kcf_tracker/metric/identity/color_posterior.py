# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How likely each pixel's colour makes it the target rather than what surrounds it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats, Image, Mask

Codes = npt.NDArray[np.int32]

CODES = 4096
"""Colours that are told apart: 16 levels of each channel, as in the histograms of Lukezic et al.
(CVPR 2017). Of a target there are some thousand pixels, too few to fill finer ones."""
PRIOR = 2e-5
"""Share of pixels that is added to each colour inside and outside: a colour that was seen in
neither has even odds, while one pixel, which is thirty times as much of a target, tells nearly
all."""


def rgb_codes(color: Image) -> Codes:
    """Code 0 to 4095 of each pixel, ``(h, w)``: 16 levels a channel of ``(h, w, 3)`` uint8."""
    levels = (color >> 4).astype(np.int32)
    return (levels[:, :, 0] << 8) + (levels[:, :, 1] << 4) + levels[:, :, 2]


class ColorPosterior:
    """Colour histograms of target and surroundings, learned over time.

    The posterior is Bayes' rule with even odds (Bertinetto et al., "Staple", CVPR 2016, section
    3.3, uses the like for its histogram scores).
    """

    def __init__(self) -> None:
        self._target, self._around = np.zeros((2, CODES), np.float32)
        self._posterior = np.full(CODES, 0.5, np.float32)

    def learn(self, codes: Codes, target: Mask, around: Mask, rate: float) -> None:
        """Take one sample, pixels of the target and those about it; ``rate`` is 1 for the first."""
        inside = np.bincount(codes[target], minlength=CODES).astype(np.float32)
        outside = np.bincount(codes[around], minlength=CODES).astype(np.float32)
        inside /= max(float(inside.sum()), 1.0)
        outside /= max(float(outside.sum()), 1.0)
        self._target += np.float32(rate) * (inside - self._target)
        self._around += np.float32(rate) * (outside - self._around)
        prior = np.float32(PRIOR)
        self._posterior = (self._target + prior) / (self._target + self._around + 2 * prior)

    def of(self, codes: Codes) -> Floats:
        """Posterior of each pixel, 0 to 1, in the shape of ``codes``."""
        return self._posterior[codes]
