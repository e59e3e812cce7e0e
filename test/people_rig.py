# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""People of flat parts before a textured wall: small exact scenes for the tests of ``metric``."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from rgbd_kcf_tracker import Box, Frame, Intrinsics
from rgbd_kcf_tracker.metric.decide.evidence import Evidence
from rgbd_kcf_tracker.pose import Pose

GOOD = Evidence(
    step=0.5,
    stride=0.1,
    fraction=1.0,
    height=0.0,
    gone=0.1,
    missing=False,
    inland=0.0,
    emerged=False,
    look=3.0,
    mine=5.0,
    rival=0.0,
    assigned=1,
    room=0.0,
)
"""What a candidate that fits in every respect is judged by."""

CAMERA = Intrinsics(200.0, 200.0, 120.0, 80.0)
ROWS, COLS = 160, 240
WALL = 5.0
TOP = -0.75
"""Row in metres of every head's top: the camera is at the height of the chest."""
PARTS = ((0.0, 0.22, 0.18), (0.22, 0.85, 0.46), (0.85, 1.6, 0.34))
"""Metres down from the top between which head, trunk and legs reach, and how wide they are."""
SKIN = (120, 150, 190)
RED, GREEN, BLUE = (40, 40, 190), (60, 170, 50), (190, 70, 40)
DARK_RED, BLACK, GREY = (28, 28, 135), (30, 30, 30), (110, 110, 110)


@dataclass(frozen=True)
class Someone:
    """A person at ``x`` metres across and ``z`` metres deep, in two colours."""

    x: float
    z: float
    shirt: tuple[int, int, int] = RED
    trousers: tuple[int, int, int] = BLACK

    @property
    def box(self) -> Box:
        """In pixels, as it is drawn."""
        half = PARTS[1][2] / 2
        top, bottom = _row(TOP, self.z), _row(TOP + PARTS[-1][1], self.z)
        left, right = _col(self.x - half, self.z), _col(self.x + half, self.z)
        return Box.from_corners(left, top, right, bottom)


def _row(y: float, z: float) -> int:
    return round(y * CAMERA.fy / z + CAMERA.cy)


def _col(x: float, z: float) -> int:
    return round(x * CAMERA.fx / z + CAMERA.cx)


def texture(seed: int, shape: tuple[int, int] = (ROWS, COLS), fine: float = 2.5) -> np.ndarray:
    """Soft blobs of grey-brown, ``(h, w, 3)`` uint8, with corners to follow."""
    noise = np.random.default_rng(seed).normal(0, 1, (*shape, 3)).astype(np.float32)
    noise = cv2.GaussianBlur(noise, (0, 0), fine)
    return np.clip(noise / noise.std() * 25 + (100, 110, 120), 15, 240).astype(np.uint8)


def images(people: list[Someone], board: Box | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Colour and depth of people, the nearest in front; ``board`` is a wall in the way at 1 m."""
    color, depth = texture(0), np.full((ROWS, COLS), WALL, np.float32)
    for one in sorted(people, key=lambda p: -p.z):
        for (top, bottom, wide), paint in zip(PARTS, (SKIN, one.shirt, one.trousers), strict=True):
            rows = slice(max(_row(TOP + top, one.z), 0), max(_row(TOP + bottom, one.z), 0))
            cols = slice(
                max(_col(one.x - wide / 2, one.z), 0), max(_col(one.x + wide / 2, one.z), 0)
            )
            color[rows, cols], depth[rows, cols] = paint, one.z
    if board is not None:
        rows, cols = slice(int(board.y), int(board.bottom)), slice(int(board.x), int(board.right))
        color[rows, cols], depth[rows, cols] = GREY, 1.0
    return color, depth


def picture(
    people: list[Someone],
    seconds: float,
    board: Box | None = None,
    pose: Pose | None = None,
    unread: Someone | None = None,
) -> Frame:
    """A frame of people at a time; depth shows nothing of ``unread``."""
    color, depth = images(people, board)
    if unread is not None:
        depth[depth == unread.z] = np.nan
    return Frame(color, depth, round(seconds * 1e9), CAMERA, pose)
