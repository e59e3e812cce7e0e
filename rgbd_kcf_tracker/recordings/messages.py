# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What other messages than images and cameras mean: boxes, stamps; from rclpy or from rosbags."""

from __future__ import annotations

from typing import Any

from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.storage import NANOSECONDS
from rgbd_kcf_tracker.track import Track, TrackState


def box_from_polygon(points: Any) -> Box | None:
    """The box around the points of a ``geometry_msgs/Polygon``; None without points.

    Points are float32, so the box is rounded to thousandths of a pixel, which they hold exactly.
    """
    if not len(points):
        return None
    xs = [round(float(p.x), 3) for p in points]
    ys = [round(float(p.y), 3) for p in points]
    width, height = round(max(xs) - min(xs), 3), round(max(ys) - min(ys), 3)
    return Box(min(xs), min(ys), width, height)


BOX_KEYS = ('x', 'y', 'width', 'height')
POSITION_KEYS = ('position_x', 'position_y', 'position_z')
PREDICTED_KEY = 'predicted'


LARGEST = 1e9
"""Of any number that is read: pixels, metres and log-odds stay far below."""


def target_name(place: int, track: Track) -> str:
    """How a status is named that tells of the target at a place of the answer, from 0."""
    return 'target' if place == 0 else f'target_{track.id}'


def number(text: str) -> float:
    """The number that is written.

    Raises:
        ValueError: where it is none, not finite, or beyond reason.
    """
    value = float(text)
    if not abs(value) <= LARGEST:  # nor is NaN
        raise ValueError(f'{text[:40]} is no number that can be')
    return value


def numbers(text: str, count: int) -> tuple[float, ...]:
    """The numbers that are written, apart by spaces.

    Raises:
        ValueError: where they are not so many, or one is none, see :func:`number`.
    """
    found = tuple(map(number, text.split()))
    if len(found) != count:
        raise ValueError(f'{len(found)} numbers where {count} belong')
    return found


def tracks_of_state(msg: Any) -> list[Track]:
    """The targets of a ``~/state``, the chosen one first.

    Raises:
        RgbdKcfError: where it is no such message.
    """
    return [_track_of(status) for status in msg.status]


def _track_of(status: Any) -> Track:
    values = {pair.key: pair.value for pair in status.values}
    try:
        box = place = None
        if BOX_KEYS[0] in values:
            box = Box(*(number(values[name]) for name in BOX_KEYS))
        if POSITION_KEYS[0] in values:
            x, y, z = (number(values[name]) for name in POSITION_KEYS)
            place = (x, y, z)
        predicted = values.get(PREDICTED_KEY) == 'true'
        return Track(
            box,
            TrackState(status.message),
            number(values['score']),
            None if place is None or predicted else place[2],
            None if predicted else place,
            int(values['id']),
            predicted=place if predicted else None,
        )
    except (KeyError, ValueError, RgbdKcfError) as error:
        raise RgbdKcfError(f'{status.name!r} is no state of a target: {error}') from None


def stamp_of(msg: Any) -> int:
    """Nanoseconds of a message's header."""
    return header_stamp(msg.header)


def header_stamp(header: Any) -> int:
    """Nanoseconds of a header."""
    stamp = header.stamp
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)
