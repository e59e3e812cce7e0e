# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A run on one page: a dozen frames, and below them the whole of it as a strip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import draw_track
from rgbd_kcf_tracker.track import Track

Picture = npt.NDArray[np.uint8]
Color = tuple[int, int, int]

COLUMNS, ROWS = 4, 3
CELL_WIDTH = 480
_MARGIN, _GAP = 24, 10
_FONT = cv2.FONT_HERSHEY_DUPLEX
_PAPER: Color = (250, 250, 250)
_INK: Color = (40, 40, 40)
_FAINT: Color = (130, 130, 130)
_VISIBLE: Color = (190, 150, 90)
_RIGHT: Color = (90, 190, 80)
_WRONG: Color = (70, 70, 230)
_HIDDEN: Color = (60, 175, 250)
_ABSENT: Color = (225, 225, 225)


def chosen(count: int) -> list[int]:
    """Numbers of the frames to show: evenly over the run, first and last among them."""
    cells = min(COLUMNS * ROWS, count)
    return [round(i) for i in np.linspace(0, count - 1, cells)]


def thumbnail(picture: Picture, track: Track, truth: Box | None, caption: str) -> Picture:
    """A frame in the size of a cell, drawn on after scaling so that lines stay crisp."""
    factor = CELL_WIDTH / picture.shape[1]
    size = CELL_WIDTH, round(picture.shape[0] * factor)
    small = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    scaled = replace(track, box=_scaled(track.box, factor))
    return draw_track(small, scaled, truth=_scaled(truth, factor), caption=caption)


def _scaled(box: Box | None, factor: float) -> Box | None:
    return None if box is None else box.stretched(factor, factor)


def contact_sheet(
    cells: Sequence[Picture],
    title: str,
    subtitle: str,
    tracks: Sequence[Track | None],
    truth: Sequence[Box | None],
    rate_hz: float,
) -> Picture:
    """The page.

    Args:
        cells: thumbnails, in reading order, all of one size.
        title: large words at the top.
        subtitle: small words below them.
        tracks: the answer to every frame, None where there was none.
        truth: the visible box of every frame.
        rate_hz: frames per second, for the strip's axis.
    """
    height, width = cells[0].shape[:2]
    rows = -(-len(cells) // COLUMNS)
    top = 92
    strip_top = top + rows * (height + _GAP) + 18
    page_width = 2 * _MARGIN + COLUMNS * width + (COLUMNS - 1) * _GAP
    page = np.full((strip_top + 150, page_width, 3), _PAPER, np.uint8)
    _write(page, title, (_MARGIN, 44), 1.0, _INK)
    _write(page, subtitle, (_MARGIN, 76), 0.6, _FAINT)
    for number, cell in enumerate(cells):
        x = _MARGIN + number % COLUMNS * (width + _GAP)
        y = top + number // COLUMNS * (height + _GAP)
        page[y : y + height, x : x + width] = cell
    _strip(page, strip_top, tracks, truth, rate_hz)
    return page


def _strip(
    page: Picture,
    top: int,
    tracks: Sequence[Track | None],
    truth: Sequence[Box | None],
    rate_hz: float,
) -> None:
    left, right = _MARGIN + 92, page.shape[1] - _MARGIN
    count = len(truth)
    edges = np.linspace(left, right, count + 1).round().astype(int)
    for row, (name, colors) in enumerate(
        (
            ('target', [_ABSENT if box is None else _VISIBLE for box in truth]),
            ('tracker', [_judged(t, b) for t, b in zip(tracks, truth, strict=True)]),
        )
    ):
        y = top + row * 34
        _write(page, name, (_MARGIN, y + 19), 0.55, _INK)
        for number, color in enumerate(colors):
            page[y : y + 26, edges[number] : edges[number + 1]] = color
    base = top + 72
    for second in range(int(count / rate_hz) + 1):
        x = left + round((right - left) * second * rate_hz / count)
        cv2.line(page, (x, base), (x, base + 6), _FAINT, 1)
        if x + 30 < right:
            _write(page, f'{second} s', (x + 4, base + 14), 0.42, _FAINT)
    x = left
    for color, words in (
        (_VISIBLE, 'target in sight'),
        (_ABSENT, 'less than a fifth in sight'),
        (_RIGHT, 'box, IoU above 0.5'),
        (_HIDDEN, 'said to be hidden'),
        (_WRONG, 'wrong box'),
    ):
        cv2.rectangle(page, (x, base + 36), (x + 18, base + 52), color, -1)
        _write(page, words, (x + 26, base + 50), 0.5, _INK)
        (length, _), _ = cv2.getTextSize(words, _FONT, 0.5, 1)
        x += length + 60


def _judged(track: Track | None, truth: Box | None) -> Color:
    if track is None:
        return _ABSENT
    if track.box is None:
        return _HIDDEN
    return _RIGHT if truth is not None and track.box.iou(truth) > 0.5 else _WRONG


def _write(page: Picture, words: str, at: tuple[int, int], scale: float, color: Color) -> None:
    cv2.putText(page, words, at, _FONT, scale, color, 1, cv2.LINE_AA)
