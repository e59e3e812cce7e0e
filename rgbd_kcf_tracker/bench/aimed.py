# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings as a narrower camera would have taken them, that looks aside or turns.

    python -m rgbd_kcf_tracker.bench.aimed filinha/ --fps 5 --intrinsics FX,FY,CX,CY --out aimed/

writes ``aimed/left_filinha``, ``aimed/right_filinha`` and ``aimed/turning_filinha``, in which the
camera turns to and fro, and nods and rolls a little, as in a hand or on a robot. A camera that only
turns sees what the same pixels show, in other places (Hartley and Zisserman, Multiple View
Geometry, 8.4.2), so colours, depth and truth stay those of the recording. People leave the picture
and come back to it who never did before.
"""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Image
from rgbd_kcf_tracker.bench.altered import (
    add_reading,
    camera_of,
    names_of,
    new_copy,
    parser_of,
    read_with_depth,
    write_camera,
    write_copies,
    write_pair,
    write_truth,
)
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.evaluation.datasets import everyone
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames

WIDTH, HEIGHT = 0.62, 0.88
"""Size of the copies, as shares of the recording's: narrow enough to look aside, and high enough to
show people from head to feet. Where the camera rolls, corners show what was not recorded."""
SHOWS = 0.1
"""Who shows by no more than this share of what showed before is out of view, and by no more than
three times as much may be found or not."""

Aim = tuple[float, float, float]
"""Where a camera looks: to the right, down, and how it rolls, in radians."""


def turning(share: float, reach: float) -> Aim:
    """To and fro, with a nod and a roll of periods of their own that keep within 0.02.

    Args:
        share: of the way to and fro and to again, in turns of 2 pi.
        reach: how far to the sides, in radians.
    """
    at = 2 * math.pi * share
    return reach * math.sin(at), 0.02 * math.sin(2.3 * at), 0.02 * math.sin(1.7 * at)


def rotation(aim: Aim) -> FloatArray:
    """``(3, 3)`` from rays of a camera that looks there to rays of the recording's."""
    right, down, roll = aim
    turns = [np.array([0.0, right, 0.0]), np.array([-down, 0.0, 0.0]), np.array([0.0, 0.0, roll])]
    yaw, pitch, rolled = (cv2.Rodrigues(turn)[0] for turn in turns)
    turned: FloatArray = yaw @ pitch @ rolled
    return turned


class View:
    """What a camera shows that looks elsewhere from the same place.

    Args:
        camera: of the recording.
        size: width and height of the recording's images.
        aim: where it looks.
    """

    def __init__(self, camera: Intrinsics, size: tuple[int, int], aim: Aim) -> None:
        width, height = size
        self.width, self.height = round(WIDTH * width), round(HEIGHT * height)
        self.camera = dataclasses.replace(
            camera,
            cx=camera.cx - (width - self.width) / 2,
            cy=camera.cy - (height - self.height) / 2,
        )
        self._of = camera
        self._turn = rotation(aim)

    def shown(self, color: Image, depth: Floats) -> tuple[Image, Floats]:
        """The recording's colours and depth as it shows them.

        Args:
            color: ``(H, W, 3)`` BGR; beyond its end it is black.
            depth: ``(H, W)`` metres, which become distance ahead; NaN where unknown.
        """
        columns, rows = np.meshgrid(np.arange(1.0 * self.width), np.arange(1.0 * self.height))
        there, farther = _through(columns, rows, self.camera, self._of, self._turn)
        at = there.astype(np.float32)
        nearest = cv2.remap(depth, at, None, cv2.INTER_NEAREST, borderValue=math.nan)
        return cv2.remap(color, at, None, cv2.INTER_LINEAR), nearest / farther.astype(np.float32)

    def seen(self, one: Annotation) -> Annotation | None:
        """Somebody as it shows them, None where it does not."""
        whole = self._moved(one.box)
        part = None if whole is None else whole.clipped(self.width, self.height)
        if whole is None or part is None:
            return None
        share = part.area / whole.area
        if share <= SHOWS:
            return None
        body = None if one.body is None else self._moved(one.body)
        counts = one.counts and share > 3 * SHOWS
        return dataclasses.replace(one, box=part, counts=counts, body=body)

    def _moved(self, box: Box) -> Box | None:
        middle = box.x + box.width / 2, box.y + box.height / 2
        columns = np.array([box.x, box.right, middle[0], middle[0]])
        rows = np.array([middle[1], middle[1], box.y, box.bottom])
        at, ahead = _through(columns, rows, self._of, self.camera, self._turn.T)
        if (ahead <= 0).any():  # beside the camera, or behind it
            return None
        return Box.from_corners(at[0, 0], at[2, 1], at[1, 0], at[3, 1])


def _through(
    columns: FloatArray,
    rows: FloatArray,
    seen_by: Intrinsics,
    shown_by: Intrinsics,
    turn: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Where pixels of one camera are in another's image.

    Args:
        columns: of the pixels, of any shape.
        rows: of the same shape.
        seen_by: the one camera.
        shown_by: the other.
        turn: ``(3, 3)`` from rays of the one to rays of the other.

    Returns:
        Column and row, ``(..., 2)``, and depth there for each metre of depth here.
    """
    x, y = (columns - seen_by.cx) / seen_by.fx, (rows - seen_by.cy) / seen_by.fy
    rays = np.stack((x, y, np.ones(np.shape(x))), axis=-1) @ turn.T
    ahead = rays[..., 2]
    x, y = rays[..., 0] / ahead, rays[..., 1] / ahead
    at = (x * shown_by.fx + shown_by.cx, y * shown_by.fy + shown_by.cy)
    return np.stack(at, axis=-1), ahead


def aim(frames: ImageFrames, people: everyone.People, out: Path, views: Sequence[View]) -> bool:
    """Write a copy of a recording as a camera would have taken it that looks elsewhere.

    Args:
        frames: all of the recording, each with depth and all by one camera without a lens.
        people: who is in them.
        out: is made.
        views: what the camera shows, frame by frame.

    Returns:
        False where it would show nobody, and nothing is written.

    Raises:
        RgbdKcfError: where it is there, or cannot be made.
    """
    truth = [
        [seen for each in people.get(index, []) if (seen := view.seen(each)) is not None]
        for index, view in enumerate(views)
    ]
    if not any(truth):
        return False
    with new_copy(out, 'rgb', 'depth'):
        for index, view in enumerate(views):
            frame = frames.frame(index)
            assert frame.depth is not None
            write_pair(out, index + 1, *view.shown(frame.color, frame.depth))
        write_truth(out, frames.stamps_ns, truth)
        write_camera(out, views[0].camera)
    return True


def main(argv: Sequence[str] | None = None) -> int:
    """Write the copies; status 2 where one cannot be made."""
    parser = parser_of('aimed', __doc__)
    add_reading(parser)
    parser.add_argument('--period', type=float, default=20.0, help='frames of once to and fro')
    args = parser.parse_args(argv)
    if not 2 < args.period < math.inf:
        parser.error('--period must be a number above 2')
    camera = camera_of(args, parser)
    names = names_of(args.folders, parser)

    def copies() -> Iterator[str]:
        for folder, name in zip(args.folders, names, strict=True):
            frames, people = read_with_depth(folder, args.fps, camera)
            if frames.intrinsics is None:
                raise RecordingError(f'{folder} does not say by what camera: give --intrinsics')
            first = frames.frame(0)
            half = first.width / 2 / frames.intrinsics.fx
            reach = math.atan(half) - math.atan(WIDTH * half)
            shares = [index / args.period for index in range(len(frames))]
            ways = {
                'left': [(-reach, 0.0, 0.0)] * len(frames),
                'right': [(reach, 0.0, 0.0)] * len(frames),
                'turning': [turning(share, reach) for share in shares],
            }
            written = 0
            for way, aims in ways.items():
                out = args.out / f'{way}_{name}'
                size = first.width, first.height
                views = [View(frames.intrinsics, size, where) for where in aims]
                if aim(frames, people, out, views):
                    written += 1
                    yield f'{out}: {len(frames)} pairs'
                else:
                    yield f'{out}: left out, as nobody shows there'
            if not written:
                raise RecordingError(
                    f'{folder} shows nobody to any of these cameras: check its ground truth and '
                    'the intrinsics'
                )

    return write_copies(args.out, args.folders, copies)


if __name__ == '__main__':
    sys.exit(main())
