# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Histograms of oriented gradients as the KCF tracker uses them: 31 channels per cell.

The descriptor is that of Felzenszwalb et al., "Object Detection with Discriminatively Trained
Part-Based Models" (PAMI 2010), with the conventions of Dollar's toolbox, which Henriques et al.
(PAMI 2015) built on: bilinear weights in space, the nearest of 18 signed orientations, gradients
one-sided at the border, border cells weighted by 8/7. Channels 0 to 17 are the signed orientations,
18 to 26 the unsigned ones, 27 to 30 the gradient energy under the four block normalisations.

The gradients of an 8-bit image are small integers, so magnitude and orientation come from a table;
spreading the pixels over cells and orientations is one product with a sparse matrix whose weights
never change, only the rows that they go to.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt
from scipy import sparse

Gray = npt.NDArray[np.uint8]
Features = npt.NDArray[np.float32]

CELL_SIZE = 4
ORIENTATIONS = 9
CHANNELS = 3 * ORIENTATIONS + 4

_SIGNED = 2 * ORIENTATIONS
_CLIP = 0.2
# 1 / sqrt(18): the energy channels sum 18 orientations.
_ENERGY_SCALE = 0.2357
_BORDER_GAIN = 8.0 / 7.0
# Twice the one-sided difference of an 8-bit image spans -510..510.
_REACH = 510
_SIDE = 2 * _REACH + 1


@lru_cache(maxsize=1)
def _gradient_tables() -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int32]]:
    """Magnitude (image scaled to 0..1) and signed orientation bin of every doubled gradient."""
    step = np.arange(-_REACH, _REACH + 1, dtype=np.float64)
    dy, dx = step[:, None], step[None, :]
    magnitude = np.hypot(dy, dx) / (2 * 255)
    angle = np.mod(np.arctan2(dy, dx), 2 * np.pi)
    orientation = np.floor(angle * (_SIGNED / (2 * np.pi)) + 0.5).astype(np.int32) % _SIGNED
    return magnitude.astype(np.float32).ravel(), orientation.ravel()


def _axis_weights(size: int) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float64]]:
    """For each pixel of one axis the two cells that share it, ``(size, 2)``, and their weights."""
    cells = size // CELL_SIZE
    place = (np.arange(size) + 0.5) / CELL_SIZE - 0.5
    first = np.floor(place).astype(np.int32)
    cell = np.stack([first, first + 1], axis=1)
    weight = np.stack([1 - (place - first), place - first], axis=1)
    gain = np.ones(cells)
    gain[0] *= _BORDER_GAIN
    gain[-1] *= _BORDER_GAIN
    outside = (cell < 0) | (cell >= cells)
    cell[outside] = 0
    weight = weight * gain[cell]
    weight[outside] = 0
    return cell, weight


class HogExtractor:
    """fHOG of grey images of one size. Not to be shared between threads.

    Args:
        height: rows of the images; at least one cell.
        width: columns of the images; at least one cell.

    Attributes:
        shape: ``(31, height // 4, width // 4)``, the features' shape.

    Raises:
        ValueError: where the image holds no whole cell.
    """

    def __init__(self, height: int, width: int) -> None:
        rows, cols = height // CELL_SIZE, width // CELL_SIZE
        if rows < 1 or cols < 1:
            raise ValueError(f'{width}x{height} pixels hold no cell of {CELL_SIZE}')
        self.shape = (CHANNELS, rows, cols)
        self._image_shape = (height, width)
        self._used = (rows * CELL_SIZE, cols * CELL_SIZE)
        self._cells = rows * cols
        row_cell, row_weight = _axis_weights(self._used[0])
        col_cell, col_weight = _axis_weights(self._used[1])
        target = row_cell[:, None, :, None] * cols + col_cell[None, :, None, :]
        weight = row_weight[:, None, :, None] * col_weight[None, :, None, :]
        pixels = self._used[0] * self._used[1]
        self._target = np.ascontiguousarray(target.reshape(pixels, 4).astype(np.int32))
        self._spread = sparse.csc_matrix(
            (
                (weight / CELL_SIZE**2).reshape(-1).astype(np.float32),
                self._target.ravel().copy(),
                np.arange(0, 4 * pixels + 1, 4, dtype=np.int32),
            ),
            shape=(_SIGNED * self._cells, pixels),
        )

    def __call__(self, gray: Gray) -> Features:
        """The features of ``gray`` (height, width) uint8, as ``(31, rows, cols)`` float32.

        Raises:
            ValueError: for an image of another size.
        """
        if gray.shape != self._image_shape:
            raise ValueError(f'image is {gray.shape}, the extractor is for {self._image_shape}')
        signed = self._signed_histograms(gray)
        unsigned = signed[:ORIENTATIONS] + signed[ORIENTATIONS:]
        out = np.empty(self.shape, np.float32)
        first, second = out[:_SIGNED], out[_SIGNED : _SIGNED + ORIENTATIONS]
        scratch = np.empty_like(signed)
        half = scratch[:ORIENTATIONS]
        clip = np.float32(_CLIP)
        for block, norm in enumerate(_block_norms(unsigned)):
            np.multiply(signed, norm, out=scratch)
            np.minimum(scratch, clip, out=scratch)
            np.add.reduce(scratch, axis=0, out=out[_SIGNED + ORIENTATIONS + block])
            if block == 0:
                first[:] = scratch
            else:
                first += scratch
            np.multiply(unsigned, norm, out=half)
            np.minimum(half, clip, out=half)
            if block == 0:
                second[:] = half
            else:
                second += half
        out[: _SIGNED + ORIENTATIONS] *= np.float32(0.5)
        out[_SIGNED + ORIENTATIONS :] *= np.float32(_ENERGY_SCALE)
        return out

    def _signed_histograms(self, gray: Gray) -> Features:
        """Gradient energy per signed orientation and cell, ``(18, rows, cols)``."""
        dx = cv2.Sobel(gray, cv2.CV_16S, 1, 0, ksize=1, borderType=cv2.BORDER_REPLICATE)
        dy = cv2.Sobel(gray, cv2.CV_16S, 0, 1, ksize=1, borderType=cv2.BORDER_REPLICATE)
        # Doubled gradients throughout: the one-sided differences at the border count in full.
        dx[:, 0] *= 2
        dx[:, -1] *= 2
        dy[0] *= 2
        dy[-1] *= 2
        rows, cols = self._used
        key = dy[:rows, :cols].astype(np.int32)
        key *= _SIDE
        key += dx[:rows, :cols]
        key += _REACH * _SIDE + _REACH
        magnitudes, orientations = _gradient_tables()
        flat = key.ravel()
        magnitude = magnitudes.take(flat)
        row = orientations.take(flat)
        row *= self._cells
        # A channel of a (pixels, 1, 4) image per entry of a column; cv2 interleaves fastest.
        indices = self._spread.indices
        column = row[:, None]  # OpenCV 5 would take a vector for one dimension less
        np.add(self._target, cv2.merge([column] * 4)[:, 0, :], out=indices.reshape(-1, 4))
        histograms: Features = self._spread @ magnitude
        return histograms.reshape(_SIGNED, self.shape[1], self.shape[2])


def _block_norms(unsigned: Features) -> list[Features]:
    """Inverse norms of the four 2x2 blocks about each cell, each ``(rows, cols)``."""
    energy = np.einsum('crx,crx->rx', unsigned, unsigned)
    padded = np.pad(energy, 1, mode='edge') if min(energy.shape) < 2 else energy
    block = padded[:-1] + padded[1:]
    block = block[:, :-1] + block[:, 1:]
    inverse = 1 / np.sqrt(block + np.float32(1e-4 / 4 / CELL_SIZE**4))
    rows, cols = energy.shape
    # Blocks that stick out over the border take the value of the nearest whole one.
    row = np.clip(np.arange(-1, rows), 0, inverse.shape[0] - 1)
    col = np.clip(np.arange(-1, cols), 0, inverse.shape[1] - 1)
    full = inverse[row[:, None], col]
    return [full[1:, 1:], full[:-1, 1:], full[1:, :-1], full[:-1, :-1]]


def fhog(gray: Gray) -> Features:
    """FHOG of one image, ``(31, height // 4, width // 4)`` float32.

    For many images of one size keep a :class:`HogExtractor`.

    Raises:
        ValueError: where the image holds no whole cell.
    """
    return HogExtractor(gray.shape[0], gray.shape[1])(gray)
