# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""People in one frame: upright person-sized surfaces, confirmed in the colour image."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.floor import FloorFinder
from rgbd_kcf_tracker.metric.perceive.surfaces import cut, standing

VIEW_WIDTH = 240
JUMP_M, JUMP_SHARE = 0.06, 0.03
FLOOR_MARGIN_M = 0.06
HEIGHT_M = (0.9, 2.2)
"""A child to a tall man, standing."""
CUT_HEIGHT_M = 0.55
"""Least height of one whose feet or head are outside the picture."""
WIDTH_M = (0.2, 1.1)
LEAST_ASPECT = 1.15
LEAST_FILL = 0.3
"""Share of the box that the surface fills: a frame of furniture fills less."""
WINDOW_HEIGHT = 128
PERSON_IN_WINDOW = 96
"""OpenCV's detector was trained on people 96 pixels tall in windows of 64 x 128."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """An upright person-sized surface.

    Attributes:
        box: in pixels of the colour image.
        depth: in metres.
        height, width: in metres.
    """

    box: Box
    depth: float
    height: float
    width: float


class PersonFinder:
    """Finds people by depth first and looks at their picture second.

    Args:
        near, far: range in metres in which to look.
        confirm: ask OpenCV's HOG people detector about each candidate, where OpenCV has it: 5 has
            moved it into its contributed modules.
        seed: of the search for the floor.

    Attributes:
        confirms: whether candidates are confirmed.
    """

    def __init__(
        self, near: float = 0.5, far: float = 4.5, confirm: bool = True, seed: int = 0
    ) -> None:
        self._near, self._far = near, far
        self.confirms = confirm and hasattr(cv2, 'HOGDescriptor')
        self._floor = FloorFinder(seed)
        if self.confirms:
            self._detector = cv2.HOGDescriptor()
            self._detector.setSVMDetector(cv2.HOGDescriptor_getDefaultPeopleDetector())

    def nearest(self, frame: Frame) -> Box | None:
        """The nearest person, None where none is found or the frame has no depth."""
        for candidate in self.candidates(frame):
            if not self.confirms or self.confirmed(frame, candidate.box):
                return candidate.box
        return None

    def candidates(self, frame: Frame) -> list[Candidate]:
        """Upright person-sized surfaces in range, nearest first."""
        view = DepthView.of(frame, VIEW_WIDTH)
        if view is None:
            return []
        floor = self._floor.update(view)
        elevation = None if floor is None else floor.elevation(view.depth)
        mask = standing(view, elevation, FLOOR_MARGIN_M)
        mask &= (view.depth > self._near) & (view.depth < self._far)
        surfaces = cut(view.depth, mask, JUMP_M, JUMP_SHARE)
        rows = view.shape[0]
        found = []
        for label in range(1, len(surfaces)):
            left, top, width, height = (int(s) for s in surfaces.boxes[label])
            pixels, depth = int(surfaces.pixels[label]), float(surfaces.depth[label])
            if height < LEAST_ASPECT * width or pixels < LEAST_FILL * width * height:
                continue
            tall = height * depth / view.intrinsics.fy
            wide = width * depth / view.intrinsics.fx
            is_cut = top <= 1 or top + height >= rows - 1
            least = CUT_HEIGHT_M if is_cut else HEIGHT_M[0]
            if not (least <= tall <= HEIGHT_M[1] and WIDTH_M[0] <= wide <= WIDTH_M[1]):
                continue
            box = Box(*(float(s * view.step) for s in (left, top, width, height)))
            inside = box.clipped(frame.width, frame.height)
            if inside is not None:
                found.append(Candidate(inside, depth, tall, wide))
        return sorted(found, key=lambda c: c.depth)

    def confirmed(self, frame: Frame, box: Box) -> bool:
        """Whether OpenCV's people detector sees a person in and round a box."""
        scale = PERSON_IN_WINDOW / box.height
        half_height = WINDOW_HEIGHT * 0.7 / scale
        half_width = max(half_height * 0.6, box.width)
        left, right = round(box.cx - half_width), round(box.cx + half_width)
        top, bottom = round(box.cy - half_height), round(box.cy + half_height)
        inside = frame.color[
            max(top, 0) : min(bottom, frame.height), max(left, 0) : min(right, frame.width)
        ]
        # Someone at the picture's edge still needs a window round them.
        patch = cv2.copyMakeBorder(
            inside,
            max(-top, 0),
            max(bottom - frame.height, 0),
            max(-left, 0),
            max(right - frame.width, 0),
            cv2.BORDER_REPLICATE,
        )
        size = max(round(patch.shape[1] * scale), 64), max(round(patch.shape[0] * scale), 128)
        small = cv2.resize(patch, size, interpolation=cv2.INTER_AREA)
        boxes, _ = self._detector.detectMultiScale(small, winStride=(4, 4), scale=1.06)
        for x, y, width, height in np.asarray(boxes).reshape(-1, 4):
            if abs(x + width / 2 - size[0] / 2) < 24 and abs(y + height / 2 - size[1] / 2) < 32:
                return True
        return False
