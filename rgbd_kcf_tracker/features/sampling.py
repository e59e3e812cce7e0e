# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What particles have in common, whatever their state: how many still count, and drawing anew."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Float = npt.NDArray[np.floating[Any]]


def effective_size(weights: Float) -> float:
    """How many equally weighted particles normalised weights are worth, 1 to n."""
    return float(1 / np.sum(weights**2))


def systematic_resample(weights: Float, rng: np.random.Generator) -> npt.NDArray[np.intp]:
    """Which particles survive, and how often: evenly spaced draws with one random offset.

    Args:
        weights: ``(n,)``, summing to 1.
        rng: of the one random number.

    Returns:
        ``(n,)`` indices; particle i is drawn floor or ceil of ``n * weights[i]`` times, on average
        exactly that.
    """
    count = len(weights)
    places = (np.arange(count) + rng.random()) / count
    edges = np.cumsum(weights)
    # Rounding must leave no draw beyond the last edge.
    edges[-1] = 1.0
    return np.searchsorted(edges, places, side='right').clip(0, count - 1)
