# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One moment as the page shows it: a few kilobytes of JSON and the pictures as bytes.

Made only while somebody looks, and off the tracker's process where it runs live.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.frame import Frame, is_reading
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.insight import Considered, Insight
from rgbd_kcf_tracker.recordings.evidence_messages import (
    MOST_CONSIDERED,
    MOST_OF_OTHERS,
    thinned,
)
from rgbd_kcf_tracker.track import Track, TrackState
from rgbd_kcf_tracker.view.known import Known
from rgbd_kcf_tracker.view.targets import SAME

QUALITY = 80
DEEPEST_M = 30.0
"""Points beyond are not drawn: nearer ones fit the wire's 16 bits of millimetres."""
_NO_DEPTH = (224, 219, 216)
# Of two independent normal variables, 95 % lie within sqrt(-2 ln 0.05) deviations.
_HOLDS_95 = 2.4477
_STRANGER_AT = 0.02
MOST_VIEWS = 8
"""Views shown of those who are followed, the first and the newest."""


@dataclass(frozen=True, slots=True)
class Detail:
    """How much of a moment is sent.

    Attributes:
        width: of the pictures in pixels, at most.
        points: of the room, at most.
        quality: of the JPEG files, 1 to 100.
    """

    width: int = 960
    points: int = 12000
    quality: int = QUALITY


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What there is to show of one moment.

    Attributes:
        frame: the images.
        tracks: answers by id.
        names: of the targets.
        chosen: ids of those who were asked for; None for all.
        insights: what each tracker knows.
        known: what each is known by, oldest first.
        truth: the true box where known.
        status: what else the page shows: numbers, words.
    """

    frame: Frame
    tracks: Mapping[int, Track] = field(default_factory=dict)
    names: Mapping[int, str] = field(default_factory=dict)
    chosen: frozenset[int] | None = None
    insights: Mapping[int, Insight] = field(default_factory=dict)
    known: Mapping[int, tuple[Known, ...]] = field(default_factory=dict)
    truth: Box | None = None
    status: Mapping[str, Any] = field(default_factory=dict)


def pack(header: Mapping[str, Any], blobs: Mapping[str, bytes]) -> bytes:
    """A message: the length of the JSON, the JSON, the blobs that it places by offset and length.

    Offsets count from the end of the JSON, which is padded so that they are multiples of 8.
    """
    places, parts, offset = {}, [], 0
    for name, blob in blobs.items():
        places[name] = (offset, len(blob))
        padding = -len(blob) % 8
        parts += [blob, b'\0' * padding]
        offset += len(blob) + padding
    text = json.dumps({**header, 'blobs': places}, separators=(',', ':'), allow_nan=False).encode()
    text += b' ' * (-(len(text) + 4) % 8)
    return b''.join((struct.pack('<I', len(text)), text, *parts))


def show(seen: Seen, detail: Detail | None = None) -> tuple[dict[str, Any], dict[str, bytes]]:
    """The JSON and the blobs of a moment."""
    detail = Detail() if detail is None else detail
    frame = seen.frame
    k = frame.intrinsics or Intrinsics.guess(frame.width, frame.height)
    header: dict[str, Any] = {
        'size': (frame.width, frame.height),
        'camera': (k.fx, k.fy, k.cx, k.cy),
        'guessed': frame.intrinsics is None,
        'targets': [_target(number, track, seen) for number, track in seen.tracks.items()],
        'truth': _corners(seen.truth),
        **seen.status,
    }
    floors = (_floor(insight, k) for insight in seen.insights.values())
    header['floor'] = next((floor for floor in floors if floor is not None), None)
    blobs = {'color': _jpeg(frame.color, detail)}
    if frame.depth is not None:
        picture, far = depth_picture(frame.depth, detail.width)
        blobs['depth'] = _encoded(picture, detail.quality)
        header['far'] = far
        blobs['points'] = room_points(frame, k, detail.points)
    for number in seen.tracks:
        for index, known in enumerate(_shown_of(number, seen)):
            if known.picture:
                blobs[f'view_{number}_{index}'] = known.picture
    return header, blobs


def _shown_of(number: int, seen: Seen) -> tuple[Known, ...]:
    known = seen.known.get(number, ())
    most = MOST_VIEWS if seen.chosen is None or number in seen.chosen else MOST_OF_OTHERS
    return known if len(known) <= most else known[:1] + known[len(known) - most + 1 :]


def _target(number: int, track: Track, seen: Seen) -> dict[str, Any]:
    insight = seen.insights.get(number)
    target: dict[str, Any] = {
        'id': number,
        'name': seen.names.get(number) or f'target {number}',
        'chosen': seen.chosen is None or number in seen.chosen,
        'state': track.state.value,
        'score': round(float(track.score), 4) if track.score == track.score else None,
        'box': _corners(track.box),
        'depth': None if track.depth is None else round(track.depth, 3),
        'position': None if track.position is None else [round(v, 3) for v in track.position],
    }
    if track.velocity is not None:
        target['speed'] = round(float(np.linalg.norm(track.velocity)), 2)
    colors = [known.colors for known in _shown_of(number, seen)]
    if any(colors):
        target['colors'] = colors
    if track.predicted is not None:
        target['predicted'] = [round(v, 3) for v in track.predicted]
        if track.covariance is not None:
            x, y, z = track.predicted
            spread = np.array(track.covariance).reshape(3, 3)[::2, ::2]
            target['ellipse'] = [*ellipse_of(np.array((x, z)), spread), round(y, 3)]
    if insight is None:
        return target
    target['considered'] = [
        {
            'box': _corners(c.box),
            'probability': round(c.probability, 4),
            'cues': {name: round(value, 2) for name, value in c.cues.items()},
        }
        for c in insight.considered[:MOST_CONSIDERED]
    ]
    hidden = track.state is not TrackState.TRACKING
    if insight.particles is not None and insight.weights is not None and hidden:
        target['particles'] = _particles(insight.particles, insight.weights)
        middle = round(float(insight.weights @ insight.particles[:, 1]), 3)
        target.setdefault('ellipse', [*ellipse(insight.particles, insight.weights), middle])
    if insight.particle_pixels is not None and insight.weights is not None:
        target['pixels'] = _particles(insight.particle_pixels, insight.weights, 1)
    return target


def rival(track: Track, insight: Insight | None) -> Considered | None:
    """The likeliest candidate that was not taken: what the target may be confused with."""
    if insight is None:
        return None
    others = [
        c for c in insight.considered if track.box is None or c.box.iou(track.box) < _STRANGER_AT
    ]
    return max(others, key=lambda c: c.probability, default=None)


def figures(number: int, tracks: Mapping[int, Track], insight: Insight | None) -> tuple[Any, ...]:
    """One of the targets in the time line.

    Its id, state, score, the probability of its rival, who that is, the filter's response, and its
    position; None for what is not known.
    """
    track = tracks[number]
    other = rival(track, insight)
    who = None
    if other is not None:
        boxes = ((k, t.box) for k, t in tracks.items() if k != number and t.box is not None)
        who = next((k for k, box in boxes if box.iou(other.box) > SAME), None)
    response = None if insight is None else insight.response
    return (
        number,
        track.state.value,
        round(float(track.score), 3) if track.box is not None else None,
        0.0 if other is None else round(other.probability, 3),
        who,
        None if response is None else round(response, 3),
        None if track.position is None else [round(v, 2) for v in track.position],
    )


def _corners(box: Box | None) -> list[float] | None:
    return None if box is None else [round(v, 2) for v in box.as_tuple()]


def _particles(places: npt.NDArray[Any], weights: npt.NDArray[Any], digits: int = 2) -> Any:
    places, weights = thinned(places, weights)
    shares = (weights / weights.max()).round(2)
    return np.column_stack((places.round(digits), shares)).tolist()


def ellipse(particles: npt.NDArray[Any], weights: npt.NDArray[Any]) -> list[float]:
    """The ellipse about particles from above, see :func:`ellipse_of`.

    Args:
        particles: ``(n, 3)`` metres in the camera's frame.
        weights: ``(n,)`` whose sum is 1.
    """
    places = particles[:, [0, 2]]
    mean = weights @ places
    away = places - mean
    spread = (weights[:, None] * away).T @ away
    return ellipse_of(mean, spread)


def ellipse_of(mean: npt.NDArray[Any], spread: npt.NDArray[Any]) -> list[float]:
    """The ellipse that holds 95 % of a normal spread: x, z, both half axes, angle.

    Metres and radians, the angle from x towards z.

    Args:
        mean: ``(2,)`` metres, x and z.
        spread: ``(2, 2)`` square metres, its covariance.
    """
    values, vectors = np.linalg.eigh(spread)
    major, minor = (_HOLDS_95 * float(np.sqrt(max(v, 0.0))) for v in (values[1], values[0]))
    angle = float(np.arctan2(vectors[1, 1], vectors[0, 1]))
    return [round(v, 3) for v in (float(mean[0]), float(mean[1]), major, minor, angle)]


def _floor(insight: Insight, k: Intrinsics) -> list[float] | None:
    """The floor as ``a x + b y + c z = 1`` in metres of the camera's frame."""
    if insight.floor is None:
        return None
    a, b, c = insight.floor
    step = insight.step
    # 1/z = a u + b v + c with u = (fx x / z + cx) / step, so multiplied by z:
    across, down = a * k.fx / step, b * k.fy / step
    ahead = c + a * k.cx / step + b * k.cy / step
    return [round(v, 5) for v in (across, down, ahead)]


def _scaled(image: npt.NDArray[Any], width: int, how: int) -> npt.NDArray[Any]:
    if image.shape[1] <= width:
        return image
    height = max(1, round(image.shape[0] * width / image.shape[1]))
    scaled: npt.NDArray[Any] = cv2.resize(image, (width, height), interpolation=how)
    return scaled


def _jpeg(image: npt.NDArray[np.uint8], detail: Detail) -> bytes:
    return _encoded(_scaled(image, detail.width, cv2.INTER_AREA), detail.quality)


def _encoded(image: npt.NDArray[Any], quality: int) -> bytes:
    data = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    encoded: bytes = data.tobytes()
    return encoded


def depth_picture(
    depth: npt.NDArray[np.float32], width: int
) -> tuple[npt.NDArray[np.uint8], float]:
    """Depth in a map whose lightness grows with the distance, and the distance of its bright end.

    Returns:
        ``(h, w, 3)`` uint8 BGR, light grey where there is no reading, and metres.
    """
    small = _scaled(depth, width, cv2.INTER_NEAREST)
    valid = is_reading(small)
    some = small[::8, ::8][valid[::8, ::8]]
    # Whole metres, so that colours do not flicker with every frame.
    far = float(np.ceil(np.quantile(some, 0.95))) if some.size else 1.0
    level = np.where(valid, np.clip(small / far, 0, 1) * 255, 0).astype(np.uint8)
    picture: npt.NDArray[np.uint8] = cv2.applyColorMap(level, cv2.COLORMAP_CIVIDIS)
    picture[~valid] = _NO_DEPTH
    return picture, far


def room_points(frame: Frame, k: Intrinsics, most: int) -> bytes:
    """Points of the room, thinned evenly over the image.

    Returns:
        ``3 n`` int16 of millimetres in the camera's frame, then ``3 n`` uint8 of RGB.
    """
    assert frame.depth is not None
    step = max(1, int(np.ceil(np.sqrt(frame.width * frame.height / most))))
    z = frame.depth[step // 2 :: step, step // 2 :: step]
    rows, cols = np.nonzero((z > 0) & (z < DEEPEST_M))
    depth = z[rows, cols]
    v, u = rows * step + step // 2, cols * step + step // 2
    places = np.stack(((u - k.cx) * depth / k.fx, (v - k.cy) * depth / k.fy, depth), axis=1)
    millimetres = np.clip(places * 1000, -32000, 32000).astype('<i2')
    colors = frame.color[v, u, ::-1]
    packed: bytes = millimetres.tobytes() + np.ascontiguousarray(colors).tobytes()
    return packed
