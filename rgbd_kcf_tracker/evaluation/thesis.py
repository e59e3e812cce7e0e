# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the thesis prints, to stand beside our tables; measured on its own recordings."""

from __future__ import annotations

PRECISION_BY_SCENARIO: dict[str, float] = {
    'clutter': 0.9038,
    'deformation': 0.7544,
    'motion': 0.9213,
    'normal': 0.9911,
    'occlusion': 0.7008,
    'out_of_view': 0.8393,
}
"""Table 3.2, averages of KCF over four data sets."""

PRINCETON: dict[str, tuple[float, ...]] = {
    'thesis: RGB-D KCF': (41, 37, 42, 46, 40, 56, 35, 47, 51, 52, 46),
    'thesis: KCF': (39.7, 49.4, 54.6, 40.1, 52.5, 57.8, 42.9, 35.2, 63.6, 56.4, 43.7),
    'thesis: Dhog': (43.3, 48.3, 55.9, 47.2, 50.3, 52.7, 47.5, 38.4, 63.5, 54.3, 46.9),
}
"""Table 4.1, success rate in percent on the 95 sequences of the benchmark: human, animal, rigid,
large, small, slow, fast, occluded, not occluded, passive, active."""

AVERAGE_PRECISION: dict[str, float] = {'thesis: RGB-D KCF': 66.35, 'thesis: KCF': 39.99}
"""Table 4.5, in percent."""

KINECT_CONFUSION: dict[str, tuple[float | None, ...]] = {
    'thesis: RGB-D KCF': (92.50, 7.50, 47.3, 52.7),
    'thesis: KCF': (32.54, 67.46, None, None),
}
"""Figure 4.14: TP, FP, FN, TN in percent by method 2 (FP and FN from the rows' sums of 100)."""

OCCLUSION_CONFUSION: dict[str, tuple[float | None, ...]] = {
    'thesis: RGB-D-PF': (74.07, 25.93, 41.67, 58.33),
    'thesis: KCF': (39.39, 60.61, None, None),
}
"""Table 5.1: TP, FP, FN, TN in percent by method 2, occlusion."""

FAST_CONFUSION: dict[str, tuple[float | None, ...]] = {
    'thesis: RGB-D-PF': (40.00, 60.00, 71.43, 28.57),
    'thesis: RGB-D': (10.53, 89.47, None, None),
    'thesis: KCF': (26.32, 73.68, None, None),
}
"""Table 5.2: TP, FP, FN, TN in percent by method 2, very fast target."""
