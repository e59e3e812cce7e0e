# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""First boxes that nobody means: what they cost does not depend on their size."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from rgbd_kcf_tracker import Box, Frame, Intrinsics, create_tracker
from rgbd_kcf_tracker.errors import BoxError
from rgbd_kcf_tracker.track import require_inside
from rgbd_kcf_tracker.variants import VARIANTS

WIDTH, HEIGHT = 320, 240
# A width of -50 pixels, cast by a program that sends it as the unsigned number of the message.
CAST = float(2**32 - 50)


def frame(index: int) -> Frame:
    color = np.random.default_rng(index).integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8)
    depth = np.full((HEIGHT, WIDTH), 3, np.float32)
    depth[60:180, 100:160] = 2
    camera = Intrinsics.guess(WIDTH, HEIGHT)
    return Frame(color, depth, 1_000_000_000 + index * 33_333_333, camera)


FRAMES = [frame(index) for index in range(3)]


@pytest.mark.parametrize('variant', VARIANTS)
@pytest.mark.parametrize(
    'box',
    [
        Box(100, 60, CAST, 120),
        Box(100, 60, 60, CAST),
        Box(-1e9, -1e9, 2e9 + 200, 2e9 + 200),
        Box(-1e308, 0, 1.5e308, 100),
        Box(-CAST, 60, CAST + 5, 3),
    ],
    ids=str,
)
def test_a_box_that_reaches_far_out_of_the_image_is_refused(variant: str, box: Box) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(BoxError, match='too far out of the 320x240 image'):
            create_tracker(variant).start(FRAMES[0], box)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 1 << 20


@pytest.mark.parametrize('variant', VARIANTS)
@pytest.mark.parametrize(
    'box',
    [
        Box(-WIDTH / 2, -HEIGHT / 2, 2 * WIDTH, 2 * HEIGHT),
        Box(100, -HEIGHT / 2, 1, 2 * HEIGHT),
        Box(-WIDTH / 2, 100, 2 * WIDTH, 1),
        Box(0, 0, 1, 1),
        Box(WIDTH - 1, HEIGHT - 1, WIDTH, HEIGHT),
    ],
    ids=str,
)
def test_any_other_box_is_taken_and_costs_no_more_than_the_image(variant: str, box: Box) -> None:
    tracker = create_tracker(variant)
    tracemalloc.start()
    try:
        assert tracker.start(FRAMES[0], box).box is not None
        for later in FRAMES[1:]:
            tracker.update(later)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 128 << 20


def test_the_limit_is_an_image_on_either_side() -> None:
    require_inside(Box(-WIDTH, -10, 3 * WIDTH, 20), FRAMES[0])
    for box in (Box(-WIDTH - 1, 0, WIDTH + 50, 20), Box(0, 10, 20, 2 * HEIGHT)):
        with pytest.raises(BoxError, match='too far out'):
            require_inside(box, FRAMES[0])
    with pytest.raises(BoxError, match='outside'):
        require_inside(Box(CAST, 0, CAST, 20), FRAMES[0])
