# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Boxes of any size: refused, or followed in memory that the image bounds and not the box."""

from __future__ import annotations

import tracemalloc
from contextlib import suppress
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rgbd_kcf_tracker.errors import BoxError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.live.session import Session
from rgbd_kcf_tracker.metric.by_look import ByLook
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.track import TrackState, require_inside
from rgbd_kcf_tracker.variants import VARIANTS, create_tracker

WIDTH, HEIGHT = 160, 120
MOST_BYTES = 48 << 20
"""Of a run on one image; the trackers need a tenth of it, and the defect took more than 1 GiB."""


def make_frames(count: int, depth: bool) -> list[Frame]:
    rng = np.random.default_rng(2)
    color = rng.integers(0, 256, (HEIGHT, WIDTH, 3)).astype(np.uint8)
    metres = np.full((HEIGHT, WIDTH), 3.0, np.float32)
    metres[30:90, 50:90] = 1.5
    camera = Intrinsics.guess(WIDTH, HEIGHT)
    return [
        Frame(np.roll(color, 2 * n, 1), metres if depth else None, n * 33_333_333, camera)
        for n in range(count)
    ]


REFUSED = {
    'a width of -50 cast': Box(10, 10, 4294967246, 100),
    'huge': Box(-1e9, -1e9, 2e9, 2e9),
    'as large as a number can be': Box(0, 0, 1e308, 1e308),
    'tall': Box(50, -1e6, 20, 2e6),
    'outside': Box(500, 10, 20, 20),
    'less than a pixel': Box(10, 10, 0.25, 50),
    'a pixel of it inside': Box(-1e6, 10, 1e6 + 1, 50),
}
TAKEN = {
    'the image': Box(0, 0, WIDTH, HEIGHT),
    'a line': Box(80, 0, 1, HEIGHT),
    'a lying line': Box(0, 60, WIDTH, 1),
    'a pixel': Box(80, 60, 1, 1),
    'the largest': Box(-WIDTH, -HEIGHT, 3 * WIDTH, 3 * HEIGHT),
    'the thinnest': Box(80, -HEIGHT, 1, 3 * HEIGHT),
    'the flattest': Box(-WIDTH, 60, 3 * WIDTH, 1),
    'half outside': Box(-20, 30, 40, 60),
}


@pytest.mark.parametrize('variant', list(VARIANTS))
@pytest.mark.parametrize('box', REFUSED.values(), ids=REFUSED)
def test_boxes_that_are_none_are_refused_at_once(variant: str, box: Box) -> None:
    frame = make_frames(1, True)[0]
    tracker = create_tracker(variant)
    tracemalloc.start()
    try:
        with pytest.raises(BoxError, match='160x120 image: give x,y,width,height'):
            tracker.start(frame, box)
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()
    assert tracker.update(frame).state is TrackState.IDLE


@pytest.mark.parametrize('depth', [True, False])
@pytest.mark.parametrize('variant', list(VARIANTS))
@pytest.mark.parametrize('box', TAKEN.values(), ids=TAKEN)
def test_strange_boxes_are_followed_in_bounded_memory(variant: str, box: Box, depth: bool) -> None:
    frames = make_frames(6, depth)
    tracker = create_tracker(variant)
    tracemalloc.start()
    try:
        tracker.start(frames[0], box)
        for frame in frames[1:]:
            tracker.update(frame)
        assert tracemalloc.get_traced_memory()[1] < MOST_BYTES
    finally:
        tracemalloc.stop()


@given(
    x=st.floats(-1e10, 1e10), y=st.floats(-1e10, 1e10),
    width=st.floats(1e-6, 1e10), height=st.floats(1e-6, 1e10),
)  # fmt: skip
@settings(max_examples=200, deadline=None)
def test_what_passes_is_bounded_by_the_image(
    x: float, y: float, width: float, height: float
) -> None:
    frame = Frame(np.zeros((HEIGHT, WIDTH, 3), np.uint8), None, 0)
    box = Box(x, y, width, height)
    with suppress(BoxError):
        require_inside(box, frame)
        assert 1 <= box.width <= 3 * WIDTH + 1e-3
        assert 1 <= box.height <= 3 * HEIGHT + 1e-3


def test_the_search_for_a_large_target_is_bounded_by_the_image(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The scale may grow tenfold after the start: the windows of the search do not with it."""
    frames = make_frames(2, False)
    look = ByLook(frames[0], Box(-WIDTH, -HEIGHT, 3 * WIDTH, 3 * HEIGHT), MetricParameters())
    look._scale, look._hidden = 10.0, True
    look._parameters = look._parameters.replace(seen_ratio=1.0)
    asked: list[tuple[int, int]] = []
    real = cv2.boxFilter

    def noting(image: Any, depth: int, size: tuple[int, int], **options: Any) -> Any:
        asked.append(size)
        return real(image, depth, size, **options)

    monkeypatch.setattr(cv2, 'boxFilter', noting)
    look.step(frames[1], 1 / 30)
    assert len(asked) > 2
    assert all(width <= 2 * WIDTH + 1 and height <= 2 * HEIGHT + 1 for width, height in asked)


def test_a_request_that_is_refused_leaves_the_target_and_the_images_go_on() -> None:
    """What came in on ``~/init`` with a width of -50, which is 4294967246 there."""
    told: list[str] = []
    session = Session('metric', VARIANTS['metric'].parameters(), told.append)
    frames = make_frames(4, True)
    session.choose(lambda frame: Box(50, 30, 40, 60))
    assert session.process(frames[0]).state is TrackState.TRACKING
    session.choose(lambda frame: Box(10, 10, 4294967246, 100))
    for frame in frames[1:]:
        assert session.process(frame).box is not None
    (text,) = told
    assert 'reaches too far out of the 160x120 image' in text
