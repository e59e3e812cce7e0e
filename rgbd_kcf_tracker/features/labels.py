# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a correlation filter is taught to answer at each shift."""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np
import numpy.typing as npt

Float = npt.NDArray[np.floating[Any]]


def gaussian_labels(
    shape: tuple[int, ...], sigma: float, dtype: npt.DTypeLike = np.float64
) -> Float:
    """Regression targets: 1 at the zero shift ``[0, ...]``, falling off with the cyclic distance.

    Args:
        shape: length of each axis, in cells or steps.
        sigma: bandwidth, in the same unit.
        dtype: of the result, which it is computed in.
    """
    lines = []
    for size in shape:
        distance = np.minimum(np.arange(size), size - np.arange(size)).astype(dtype)
        lines.append(np.exp(-0.5 * (distance / sigma) ** 2))
    labels: Float = reduce(np.multiply.outer, lines)
    return labels
