# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Colour of a silhouette, band by band from its top to its bottom."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

BANDS = 4
"""Horizontal bands of a body: about head, chest, hips and legs of a person."""
LEVELS = 8
CODES = LEVELS**3
"""Colour codes: the cube of 8 levels a channel."""


CHROMA_GAIN = 0.08
"""Steepness of the chroma quantisation: clothes have little chroma, so the levels lie close about
grey. Of eight codings compared on real people this told them apart best (docs/metric.md)."""

_LIGHTNESS = (np.arange(256) >> 5).astype(np.uint16)
_CHROMA = np.clip(
    np.floor(4 + 4 * np.tanh((np.arange(256) - 128.0) * CHROMA_GAIN)), 0, LEVELS - 1
).astype(np.uint16)


def view_image(
    color: npt.NDArray[np.uint8], step: int, shape: tuple[int, int]
) -> npt.NDArray[np.uint8]:
    """Every ``step``-th pixel of a ``(H, W, 3)`` uint8 BGR image.

    Args:
        color: the image.
        step: as of the :class:`~rgbd_kcf_tracker.metric.perceive.depth_view.DepthView`.
        shape: rows and columns of the result.

    Returns:
        ``shape + (3,)`` uint8.
    """
    half = step // 2
    return np.ascontiguousarray(color[half::step, half::step][: shape[0], : shape[1]])


def view_lab(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """CIE Lab of an image, ``(h, w, 3)`` uint8 BGR."""
    lab: npt.NDArray[np.uint8] = cv2.cvtColor(image, cv2.COLOR_BGR2LAB)
    return lab


def color_codes(lab: npt.NDArray[np.uint8]) -> npt.NDArray[np.int32]:
    """Code 0 to 511 of each pixel: 64 times lightness plus 8 times red-green plus blue-yellow.

    Args:
        lab: ``(h, w, 3)`` uint8 CIE Lab.
    """
    codes = (_LIGHTNESS[lab[:, :, 0]] << 6) + (_CHROMA[lab[:, :, 1]] << 3) + _CHROMA[lab[:, :, 2]]
    result: npt.NDArray[np.int32] = codes.astype(np.int32)
    return result


def band_histograms(
    codes: npt.NDArray[np.int32], mask: npt.NDArray[np.bool_], top: float, height: float
) -> npt.NDArray[np.float32]:
    """Smoothed counts of colour codes in each band, ``(BANDS, CODES)`` float32.

    Args:
        codes: ``(h, w)`` of the crop around the silhouette.
        mask: ``(h, w)`` bool, the silhouette.
        top: row of the crop in which the whole body begins (may be outside the crop).
        height: rows of the whole body.
    """
    band = bands_of_rows(codes.shape[0], top, height)
    index = (codes + (band * CODES)[:, None])[mask]
    counts = np.bincount(index, minlength=BANDS * CODES).astype(np.float32)
    return smoothed(counts.reshape(BANDS, CODES))


def bands_of_rows(count: int, top: float, height: float) -> npt.NDArray[np.int32]:
    """Band of each of ``count`` rows of a crop in which a body begins at row ``top``."""
    rows = np.arange(count, dtype=np.float32) + 0.5 - top
    band: npt.NDArray[np.int32] = np.clip(rows * (BANDS / max(height, 1.0)), 0, BANDS - 1).astype(
        np.int32
    )
    return band


def smoothed(counts: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Each code's count shared with its neighbours in the cube: 1/4, 1/2, 1/4 along each channel.

    A small change of light then does not move a colour out of its bin.
    """
    cube = counts.reshape(-1, LEVELS, LEVELS, LEVELS)
    for axis in (1, 2, 3):
        moved = np.moveaxis(cube, axis, 0)
        out = moved * np.float32(0.5)
        out[1:] += np.float32(0.25) * moved[:-1]
        out[:-1] += np.float32(0.25) * moved[1:]
        out[0] += np.float32(0.25) * moved[0]
        out[-1] += np.float32(0.25) * moved[-1]
        cube = np.moveaxis(out, 0, axis)
    result: npt.NDArray[np.float32] = cube.reshape(counts.shape)
    return result


def band_similarity(counts: npt.NDArray[np.float32], model: npt.NDArray[np.float32]) -> float:
    """Bhattacharyya coefficient of the bands, weighted by how many pixels ``counts`` has in each.

    Args:
        counts: ``(BANDS, CODES)`` of a candidate.
        model: ``(BANDS, CODES)`` of the target, each row summing to 1 (or 0 where never seen).

    Returns:
        0 to 1; 0 where no band of the candidate has been seen on the target.
    """
    total = counts.sum(axis=1)
    known = (total > 0) & (model.sum(axis=1) > 0)
    if not known.any():
        return 0.0
    common = np.sqrt(counts[known] * model[known]).sum(axis=1) / np.sqrt(total[known])
    return float((common * total[known]).sum() / total[known].sum())
