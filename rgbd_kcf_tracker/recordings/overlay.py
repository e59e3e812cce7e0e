# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The tracker's answer drawn into the picture."""

from __future__ import annotations

import math
from collections.abc import Mapping

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.track import Track, TrackState

STATE_COLORS: dict[TrackState, tuple[int, int, int]] = {
    TrackState.IDLE: (170, 170, 170),
    TrackState.TRACKING: (96, 222, 74),
    TrackState.OCCLUDED: (40, 170, 255),
    TrackState.LOST: (70, 70, 240),
}
"""BGR: grey, green, amber, red."""
TRUTH_COLOR = (255, 255, 255)

_FONT = cv2.FONT_HERSHEY_DUPLEX
# Multiples of it, modulo 1, lie as far from each other as can be.
_GOLDEN = (math.sqrt(5) - 1) / 2
_BAR = 0.55  # how much of the picture the bar behind the words takes away


def draw_track(
    image: npt.NDArray[np.uint8],
    track: Track,
    *,
    truth: Box | None = None,
    caption: str = '',
) -> npt.NDArray[np.uint8]:
    """A copy of a picture with box, state, score and depth, and the true box as a thin line.

    Args:
        image: ``(H, W, 3)`` uint8 BGR; left as it is.
        track: what the tracker says.
        truth: the true box, where known.
        caption: words at the right of the bar, such as the frame's number.

    Returns:
        ``(H, W, 3)`` uint8 BGR.
    """
    out = np.array(image, order='C')
    color = STATE_COLORS[track.state]
    scale, thickness = _sizes(out)
    if truth is not None:
        draw_box(out, truth, (0, 0, 0), 3)
        draw_box(out, truth, TRUTH_COLOR, 1)
    if track.box is not None:
        draw_box(out, track.box, (0, 0, 0), thickness + 2)
        draw_box(out, track.box, color, thickness)
    _bar(out, _words(track), caption, scale, color)
    return out


def draw_tracks(
    image: npt.NDArray[np.uint8], tracks: Mapping[int, Track], *, caption: str = ''
) -> npt.NDArray[np.uint8]:
    """A copy of a picture with the box and the id of each target, a colour for each id.

    Args:
        image: ``(H, W, 3)`` uint8 BGR; left as it is.
        tracks: what the tracker says, by id.
        caption: words at the right of the bar, such as the frame's number.

    Returns:
        ``(H, W, 3)`` uint8 BGR.
    """
    out = np.array(image, order='C')
    scale, thickness = _sizes(out)
    seen = 0
    for who, track in sorted(tracks.items()):
        if track.box is None:
            continue
        seen += 1
        color = id_color(who)
        draw_box(out, track.box, (0, 0, 0), thickness + 2)
        draw_box(out, track.box, color, thickness)
        _label(out, str(who), track.box, color, scale, thickness)
    state = TrackState.TRACKING if seen else TrackState.OCCLUDED
    words = f'{seen} in view' + (f', {len(tracks) - seen} not' if seen < len(tracks) else '')
    _bar(out, words, caption, scale, STATE_COLORS[state])
    return out


def id_color(who: int) -> tuple[int, int, int]:
    """A bright BGR colour for an id; neighbours differ most."""
    hue = round(180 * (who * _GOLDEN % 1.0)) % 180
    pixel = cv2.cvtColor(np.array([[[hue, 190, 255]]], np.uint8), cv2.COLOR_HSV2BGR)[0, 0]
    return int(pixel[0]), int(pixel[1]), int(pixel[2])


def _label(
    image: npt.NDArray[np.uint8],
    words: str,
    box: Box,
    color: tuple[int, int, int],
    scale: float,
    thickness: int,
) -> None:
    """Words on a patch of the colour, at the upper left of what shows of the box below the bar."""
    shown = box.clipped(image.shape[1], image.shape[0])
    if shown is None:
        return
    (width, height), _ = cv2.getTextSize(words, _FONT, scale, 1)
    left, top = round(shown.x), max(round(shown.y), _bar_height(image, scale))
    right, bottom = left + width + 2 * thickness + 2, top + height + 2 * thickness + 4
    cv2.rectangle(image, (left, top), (right, bottom), color, -1)
    at = left + thickness + 1, bottom - thickness - 2
    cv2.putText(image, words, at, _FONT, scale, (0, 0, 0), 1, cv2.LINE_AA)


def _sizes(image: npt.NDArray[np.uint8]) -> tuple[float, int]:
    """Scale of words and thickness of lines that go with a picture's size."""
    scale = max(0.42, min(image.shape[0] / 900, image.shape[1] / 1100))
    # Video keeps one colour for two by two pixels: a thinner line has none of its own there.
    return scale, max(3, round(3.2 * scale))


def _words(track: Track) -> str:
    words = track.state.value
    if track.box is not None and not math.isnan(track.score):  # NaN: nobody said it
        words += f'   score {track.score:.2f}'
    if track.depth is not None:
        words += f'   {track.depth:.2f} m'
    return words


def _bar_height(image: npt.NDArray[np.uint8], scale: float) -> int:
    (_, text_height), _ = cv2.getTextSize('Ag', _FONT, scale, _weight(scale))
    return int(min(round(text_height * 2.1), image.shape[0]))


def _weight(scale: float) -> int:
    return 2 if scale > 0.8 else 1


def _bar(
    image: npt.NDArray[np.uint8],
    words: str,
    caption: str,
    scale: float,
    color: tuple[int, int, int],
) -> None:
    weight = _weight(scale)
    (_, text_height), _ = cv2.getTextSize('Ag', _FONT, scale, weight)
    height = _bar_height(image, scale)
    bar = image[:height]
    np.multiply(bar, 1 - _BAR, out=bar, casting='unsafe')
    baseline = round((height + text_height) / 2)
    pad = round(text_height * 0.8)
    cv2.circle(
        image, (pad + text_height // 2, height // 2), text_height // 2, color, -1, cv2.LINE_AA
    )
    _text(image, words, (2 * pad + text_height, baseline), scale, weight)
    (width, _), _ = cv2.getTextSize(words, _FONT, scale, weight)
    (right, _), _ = cv2.getTextSize(caption, _FONT, scale, weight)
    at = image.shape[1] - pad - right
    if caption and at > 3 * pad + text_height + width:
        _text(image, caption, (at, baseline), scale, weight)


def _text(
    image: npt.NDArray[np.uint8], words: str, at: tuple[int, int], scale: float, weight: int
) -> None:
    cv2.putText(image, words, at, _FONT, scale, (255, 255, 255), weight, cv2.LINE_AA)


def draw_box(
    image: npt.NDArray[np.uint8], box: Box, color: tuple[int, int, int], thickness: int
) -> None:
    """Draw the outline of a box into a picture, wherever it lies.

    Args:
        image: ``(H, W, 3)`` uint8 BGR, drawn into.
        box: in its pixels.
        color: blue, green and red, 0 to 255 each.
        thickness: of the line in pixels.
    """
    # Far outside the image OpenCV's fixed-point coordinates would overflow.
    height, width = image.shape[:2]
    shown = Box(box.x + width, box.y + height, box.width, box.height).clipped(3 * width, 3 * height)
    if shown is None:
        return
    left, top = round(shown.x - width), round(shown.y - height)
    right, bottom = round(shown.right - width) - 1, round(shown.bottom - height) - 1
    cv2.rectangle(image, (left, top), (max(right, left), max(bottom, top)), color, thickness)
