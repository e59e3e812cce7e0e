# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

from __future__ import annotations

import numpy as np
import pytest

from rgbd_kcf_tracker.features.hog import fhog
from rgbd_kcf_tracker.features.labels import gaussian_labels
from rgbd_kcf_tracker.thesis.correlation import (
    CorrelationFilter,
    Sample,
    cosine_window,
)
from rgbd_kcf_tracker.thesis.sliding_window import (
    search_span,
    step_in_cells,
    window_starts,
    windows,
)


def test_the_span_grows_with_the_targets_width_and_the_time_hidden() -> None:
    assert search_span(40, 1.5, 0.0, 3.0, 900) == 60
    assert search_span(80, 1.5, 0.0, 3.0, 900) == 120
    assert search_span(40, 1.5, 2.0, 3.0, 900) == 60 + 240
    assert search_span(40, 1.5, 0.1, 3.0, 900) == 60 + 40
    assert search_span(40, 1.5, 60.0, 3.0, 900) == 900


def test_the_windows_lie_symmetric_and_whole_steps_apart() -> None:
    assert window_starts(10, 3).tolist() == [-9, -6, -3, 0, 3, 6, 9]
    assert window_starts(2, 3).tolist() == [0]
    assert step_in_cells(10, 4) == 3
    assert step_in_cells(0.5, 4) == 1


def test_one_batch_answers_as_each_patch_alone() -> None:
    rng = np.random.default_rng(2)
    gray = rng.integers(0, 256, (48, 200), dtype=np.uint8)
    taper = cosine_window((12, 14))
    filter_ = CorrelationFilter(gaussian_labels((12, 14), 1.2))
    filter_.learn(Sample.of(fhog(gray[:, 72:128]) * taper))
    offsets = window_starts(12, 4)
    strip = fhog(gray)
    batch = filter_.respond(windows(strip, taper, offsets))
    assert batch.shape == (len(offsets), 12, 14)
    for response, offset in zip(batch, offsets, strict=True):
        alone = strip[:, :, 18 + offset : 32 + offset] * taper
        np.testing.assert_allclose(response, filter_.respond(Sample.of(alone)), atol=1e-6)
        # The features of a window cut out by itself differ only where the taper hides it.
        cut = fhog(np.ascontiguousarray(gray[:, 72 + 4 * offset : 128 + 4 * offset])) * taper
        np.testing.assert_allclose(response, filter_.respond(Sample.of(cut)), atol=0.05)
    assert batch[len(offsets) // 2].max() == pytest.approx(1, abs=0.02)
    assert batch.max(axis=(1, 2)).argmax() == len(offsets) // 2
