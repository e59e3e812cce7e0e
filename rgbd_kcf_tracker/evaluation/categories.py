# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Princeton's categories for sequences that nobody has sorted: our own criteria, stated here.

Princeton does not publish its criteria; these are ours, and reports say where they were used.
"""

from __future__ import annotations

import numpy as np

from rgbd_kcf_tracker.evaluation.store import Truth

LARGE_SHARE = 0.04
"""A target is large where its median box covers at least this share of the image."""

FAST_SIZES_PER_S = 2.0
"""A target is fast that in a tenth of its frames moves more than two of its sizes per second."""

HIDDEN_FRACTION = 0.5
"""A target is occluded that is absent in some frame, or of which less than half shows."""

_ANIMALS = frozenset({'small_animal'})
_RIGID = frozenset({'mug_hand_held', 'carried_mug', 'ball_game', 'face'})
_PASSIVE = frozenset({'mug_hand_held', 'carried_mug', 'ball_game'})


def derive(truth: Truth, image_size: tuple[int, int], scenario: str) -> dict[str, str]:
    """The five splits of one sequence.

    Args:
        truth: of the sequence.
        image_size: width and height in pixels.
        scenario: simulated scenes know what their target is; everything else counts as a person who
            moves by themselves.
    """
    boxes = truth.visible
    there = ~np.isnan(boxes[:, 0])
    area = boxes[there, 2] * boxes[there, 3]
    large = len(area) > 0 and np.median(area) >= LARGE_SHARE * image_size[0] * image_size[1]
    hidden = bool((~there).any() or (truth.fraction[there] < HIDDEN_FRACTION).any())
    kind = 'animal' if scenario in _ANIMALS else 'rigid' if scenario in _RIGID else 'human'
    return {
        'target type': kind,
        'target size': 'large' if large else 'small',
        'movement': 'fast' if _is_fast(truth) else 'slow',
        'occlusion': 'yes' if hidden else 'no',
        'motion type': 'passive' if scenario in _PASSIVE else 'active',
    }


def _is_fast(truth: Truth) -> bool:
    boxes = truth.body if truth.body is not None else truth.visible
    if len(boxes) < 2:
        return False
    centers = boxes[:, :2] + boxes[:, 2:] / 2
    size = np.sqrt(boxes[1:, 2] * boxes[1:, 3])
    seconds = np.diff(np.array(truth.stamps_ns, np.float64)) / 1e9
    with np.errstate(divide='ignore', invalid='ignore'):
        speed = np.hypot(*np.diff(centers, axis=0).T) / size / seconds
    speed = speed[np.isfinite(speed)]
    return len(speed) > 0 and float(np.percentile(speed, 90)) > FAST_SIZES_PER_S
