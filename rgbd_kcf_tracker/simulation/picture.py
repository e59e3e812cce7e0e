# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One ideal picture of a scene: what the camera would see without flaws, and the exact truth."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats, Image
from rgbd_kcf_tracker.geometry import Box, Intrinsics, mask_box
from rgbd_kcf_tracker.simulation.room import draw_face
from rgbd_kcf_tracker.simulation.solids import Layer, Lighting, Vector, render
from rgbd_kcf_tracker.simulation.world import Actor, Viewpoint, World

TARGET = 255
HIDDEN_BELOW = 0.2


@dataclass(frozen=True, slots=True)
class Truth:
    """Where the target, or another person, is at one moment.

    Attributes:
        shown: box of all that shows of it, however little; None where nothing does.
        body: box of the whole target, hidden parts and those beyond the image's border included,
            up to the longer side of the image beyond each; None where it is wholly outside it.
        visible_fraction: visible share of the whole target's area, 0 to 1; what lies beyond the
            border counts as hidden.
        position: of the target's middle in the camera's optical frame (right, down, forward),
            metres. Of one of several people who is away it is where they left, or will enter
            first, though nobody is there; ``body`` is None then.
    """

    shown: Box | None
    body: Box | None
    visible_fraction: float
    position: tuple[float, float, float]

    @property
    def visible(self) -> Box | None:
        """Box of the visible part; None where less than a fifth of the target shows."""
        return self.shown if self.visible_fraction >= HIDDEN_BELOW else None

    @property
    def distance(self) -> float:
        """Of the target's middle along the optical axis, metres; see ``position``."""
        return self.position[2]


class Backdrop:
    """The empty room; drawn once where the camera is fixed.

    Args:
        scene: with the room.
        camera: pinhole camera.
        size: width and height of the picture.
    """

    def __init__(self, scene: World, camera: Intrinsics, size: tuple[int, int]) -> None:
        self.scene, self.camera, self.size = scene, camera, size
        self._still: tuple[Image, Floats] | None = None

    def view(self, t: float) -> Viewpoint:
        """The camera and the light at ``t`` seconds."""
        rotation, place = self.scene.camera.at(t)
        sun = self.scene.sun / np.linalg.norm(self.scene.sun)
        return Viewpoint(self.camera, rotation, place, Lighting(rotation @ sun))

    def draw(self, view: Viewpoint) -> tuple[Image, Floats]:
        """Colour and depth, for the caller to draw into.

        Returns:
            ``(h, w, 3)`` uint8 BGR, and ``(h, w)`` float32 metres, inf where nothing is.
        """
        if self._still is None or not self.scene.camera.fixed:
            self._still = self._draw(view)
        color, depth = self._still
        return color.copy(), depth.copy()

    def _draw(self, view: Viewpoint) -> tuple[Image, Floats]:
        w, h = self.size
        color = np.zeros((h, w, 3), np.uint8)
        depth = np.full((h, w), np.inf, np.float32)
        for f in self.scene.room.faces:
            draw_face(f.moved(view.rotation, view.place), view.camera, color, depth)
        for solids, atlas in self.scene.room.plants:
            moved = solids.moved(view.rotation, view.place)
            layer = render(moved, atlas, view.camera, (0, 0, w, h), view.light)
            if layer is not None:
                rows, cols = layer.z.shape
                window = np.s_[layer.y0 : layer.y0 + rows, layer.x0 : layer.x0 + cols]
                nearer = layer.z < depth[window]
                color[window][nearer] = layer.color[nearer]
                np.copyto(depth[window], layer.z, where=nearer)
        return color, depth


class Picture:
    """One ideal picture: colour, depth, and which pixels are the target's.

    Args:
        backdrop: the empty room, and the scene.
        t: seconds.
        shade: False leaves the colour out, for where depth or truth alone are wanted.
    """

    def __init__(self, backdrop: Backdrop, t: float, shade: bool = True) -> None:
        self.scene, self.camera, self.t = backdrop.scene, backdrop.camera, t
        self.width, self.height = backdrop.size
        self.view = backdrop.view(t)
        self.color, self.depth = backdrop.draw(self.view)
        self.owner = np.zeros(self.depth.shape, np.uint8)
        exposure = self.scene.sensor.exposure_s
        self._before = backdrop.view(t - exposure / 2)
        self._after = backdrop.view(t + exposure / 2)
        if shade and not self.scene.camera.fixed:
            middle = self.view.place + self.view.rotation.T @ np.array([0, 0, 3.0])
            self.color = _blurred(self.color, *self._streak(middle, middle))
        self._alone: dict[int, Layer] = {}
        w, h = self.width, self.height
        beyond = max(w, h)  # on every side, so that nobody who is near is cut off below
        layers: list[tuple[float, int, Layer]] = []
        for i, actor in enumerate(self.scene.actors):
            told = i in self.scene.people
            window = (-beyond, -beyond, w + beyond, h + beyond) if told else (0, 0, w, h)
            layer = actor.draw(t, self.view, window, shade)
            if layer is not None:
                if told:
                    self._alone[i] = layer
                middle = self.view.rotation @ (actor.centre(t) - self.view.place)
                layers.append((float(middle[2]), i, layer))
        if shade:
            for _, i, _ in layers:
                self._cast_shadow(self.scene.actors[i])
        for distance, i, layer in sorted(layers, key=lambda item: -item[0]):
            self._place(layer, i, distance, shade)

    def _streak(self, before: Vector, after: Vector) -> tuple[float, float]:
        """How far a point moves in the picture during the exposure, pixels."""
        ends = []
        for view, point in ((self._before, before), (self._after, after)):
            p = view.rotation @ (point - view.place)
            z = max(float(p[2]), 0.3)
            ends.append(self.camera.project(float(p[0]), float(p[1]), z))
        return ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]

    def _cast_shadow(self, actor: Actor) -> None:
        """Darken the floor under an actor that stands on it."""
        foot = actor.centre(self.t).copy()
        radius = actor.shadow(self.t)
        foot[1] = 0.0
        p = self.view.rotation @ (foot - self.view.place)
        if p[2] < 0.6 or radius <= 0:
            return
        u, v = self.camera.project(*(float(c) for c in p))
        rx = radius * self.camera.fx / p[2]
        ry = rx * float(np.clip(-self.view.place[1] / p[2], 0.15, 0.8))
        x0, x1 = int(max(0, u - rx)), int(min(self.width, u + rx + 1))
        y0, y1 = int(max(0, v - ry)), int(min(self.height, v + ry + 1))
        if x1 - x0 < 2 or y1 - y0 < 2:
            return
        dx = ((np.arange(x0, x1) - u) / rx).astype(np.float32)
        dy = ((np.arange(y0, y1) - v) / ry).astype(np.float32)[:, None]
        gain = 1 - np.float32(0.55) * np.clip(1 - dx * dx - dy * dy, 0, 1)
        floor = self.depth[y0:y1, x0:x1] > p[2] * 0.8
        gain[~floor] = 1
        window = self.color[y0:y1, x0:x1]
        window[:] = window * gain[..., None]

    def _place(self, layer: Layer, index: int, distance: float, shade: bool) -> None:
        """Composite a layer, nearer over farther."""
        h, w = layer.z.shape
        x0, y0 = max(layer.x0, 0), max(layer.y0, 0)
        x1, y1 = min(layer.x0 + w, self.width), min(layer.y0 + h, self.height)
        if x1 <= x0 or y1 <= y0:
            return
        window = np.s_[y0:y1, x0:x1]
        part = np.s_[y0 - layer.y0 : y1 - layer.y0, x0 - layer.x0 : x1 - layer.x0]
        z = layer.z[part]
        nearer = z < self.depth[window]
        if shade:
            actor = self.scene.actors[index]
            half = self.scene.sensor.exposure_s / 2
            dx, dy = self._streak(actor.centre(self.t - half), actor.centre(self.t + half))
            if max(abs(dx), abs(dy)) > 2:
                self._smear(layer, distance, (dx, dy))
            else:
                cv2.copyTo(layer.color[part], nearer.view(np.uint8), self.color[window])
        np.copyto(self.depth[window], z, where=nearer)
        self.owner[window][nearer] = TARGET if index == 0 else index

    def _smear(self, layer: Layer, distance: float, streak: tuple[float, float]) -> None:
        """Composite a moving layer's colour, blurred along its way."""
        reach = int(max(abs(streak[0]), abs(streak[1])) / 2) + 2
        h, w = layer.z.shape
        x0, y0 = max(layer.x0 - reach, 0), max(layer.y0 - reach, 0)
        x1, y1 = min(layer.x0 + w + reach, self.width), min(layer.y0 + h + reach, self.height)
        behind = self.depth[y0:y1, x0:x1]
        cover = np.zeros((y1 - y0, x1 - x0, 4), np.uint8)
        left, top = max(layer.x0, x0), max(layer.y0, y0)
        right, bottom = min(layer.x0 + w, x1), min(layer.y0 + h, y1)
        if right <= left or bottom <= top:
            return
        source = np.s_[top - layer.y0 : bottom - layer.y0, left - layer.x0 : right - layer.x0]
        place = np.s_[top - y0 : bottom - y0, left - x0 : right - x0]
        cover[place][..., :3] = layer.color[source]
        cover[place][..., 3] = np.where(layer.mask[source], 255, 0)
        blurred = _blurred(cover, *streak).astype(np.float32)
        # feet may be nearer than the middle, and the floor behind them is, too
        near = np.full(behind.shape, distance, np.float32)
        np.copyto(near[place], layer.z[source], where=layer.mask[source])
        front = (behind > near)[..., None]
        alpha = blurred[..., 3:] * np.float32(1 / 255) * front
        window = self.color[y0:y1, x0:x1]
        window[:] = np.minimum(window * (1 - alpha) + blurred[..., :3] * front, 255)

    @property
    def target_mask(self) -> npt.NDArray[np.bool_]:
        """Pixels in which the target is seen."""
        return np.asarray(self.owner == TARGET)

    def truths(self) -> dict[int, Truth]:
        """The exact boxes of everybody who has an id, the target first."""
        return {person: self._truth(i) for person, i in enumerate(self.scene.people, 1)}

    def _truth(self, index: int) -> Truth:
        centre = self.scene.actors[index].centre(self.t)
        x, y, z = (float(c) for c in self.view.rotation @ (centre - self.view.place))
        alone = self._alone.get(index)
        if alone is None:
            return Truth(None, None, 0.0, (x, y, z))
        whole = int(np.count_nonzero(alone.mask))
        rows, cols = alone.z.shape
        body = Box(alone.x0, alone.y0, cols, rows)
        if body.clipped(self.width, self.height) is None:
            return Truth(None, None, 0.0, (x, y, z))
        top, left = max(alone.y0, 0), max(alone.x0, 0)
        label = TARGET if index == 0 else index
        mask = self.owner[top : max(alone.y0 + rows, 0), left : max(alone.x0 + cols, 0)] == label
        shown = mask_box(mask)
        fraction = int(np.count_nonzero(mask)) / max(whole, 1)
        return Truth(shown and shown.moved(left, top), body, fraction, (x, y, z))


def _blurred(image: npt.NDArray[np.uint8], dx: float, dy: float) -> npt.NDArray[np.uint8]:
    """Blur along a line of ``dx, dy`` pixels."""
    length = max(abs(dx), abs(dy))
    if length < 1.5:
        return image
    reach = int(length / 2 + 1)
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    steps = np.linspace(-0.5, 0.5, int(length * 2) + 2)
    for s in steps:
        kernel[reach + round(float(s) * dy), reach + round(float(s) * dx)] += 1
    if abs(dy) < 0.5:
        kernel = kernel.sum(axis=0, keepdims=True)
    return np.asarray(
        cv2.filter2D(image, -1, kernel / kernel.sum(), borderType=cv2.BORDER_REPLICATE), np.uint8
    )
