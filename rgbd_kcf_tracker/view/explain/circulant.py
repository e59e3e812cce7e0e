# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The data matrices that a correlation filter never builds: every cyclic shift of a sample.

The filter works on spectra, which is the point of it; the matrices show what that stands for.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def permutation(size: int) -> Array:
    """The matrix that moves a signal on by one, the last entry to the front (thesis eq. 4)."""
    return np.roll(np.eye(size, dtype=int), 1, axis=0)


def circulant(signal: Array) -> Array:
    """All cyclic shifts of a signal, one per row, the signal itself first (thesis eq. 6)."""
    size = len(signal)
    index = (np.arange(size)[None, :] - np.arange(size)[:, None]) % size
    shifts: Array = np.asarray(signal)[index]
    return shifts


def block_circulant(patch: Array) -> Array:
    """All cyclic shifts of a patch, down and across, each as one row (thesis eq. 9 to 11).

    Returns:
        ``(rows * cols, rows * cols)``: blocks of ``cols`` x ``cols``, each circulant, which are
        themselves arranged in a circulant.
    """
    rows, cols = patch.shape
    down = (np.arange(rows)[None, :] - np.arange(rows)[:, None]) % rows
    across = (np.arange(cols)[None, :] - np.arange(cols)[:, None]) % cols
    every = np.asarray(patch)[down[:, None, :, None], across[None, :, None, :]]
    matrix: Array = every.reshape(rows * cols, rows * cols)
    return matrix


def samples(patch: Array) -> list[tuple[str, Array]]:
    """The patch and three of its shifts, to look at."""
    rows, cols = patch.shape
    return [
        ('as it is', patch),
        (f'{rows // 3} down', np.roll(patch, rows // 3, axis=0)),
        (f'{cols // 3} right', np.roll(patch, cols // 3, axis=1)),
        ('both', np.roll(patch, (rows // 3, cols // 3), axis=(0, 1))),
    ]
