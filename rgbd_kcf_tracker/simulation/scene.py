# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A scene (room, actors, camera, light) and the sequence of frames a camera records of it."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.simulation.motion import CameraMotion
from rgbd_kcf_tracker.simulation.room import Room, draw_face
from rgbd_kcf_tracker.simulation.sensor import Sensor, SensorOptions
from rgbd_kcf_tracker.simulation.solids import Layer, Lighting, render

Vector = npt.NDArray[np.float64]
Gain = tuple[float, float, float]
EPOCH_NS = 1_700_000_000_000_000_000
TARGET = 255
HIDDEN_BELOW = 0.2


@dataclass(frozen=True, slots=True)
class View:
    """The camera at one moment."""

    camera: Intrinsics
    rotation: Vector
    place: Vector
    light: Lighting


class Actor(Protocol):
    """Something that moves."""

    def draw(
        self, t: float, view: View, window: tuple[int, int, int, int], shade: bool
    ) -> Layer | None:
        """The actor alone at ``t`` seconds, in the window ``left, top, right, bottom``."""

    def centre(self, t: float) -> Vector:
        """A point in its middle, world frame, metres."""

    def shadow(self, t: float) -> float:
        """Radius of its shadow on the floor in metres, 0 for none."""


def steady_light(_: float) -> Gain:
    """Light that never changes."""
    return 1.0, 1.0, 1.0


@dataclass
class Scene:
    """All there is to record.

    Attributes:
        room: what stands still.
        actors: what moves, the target first.
        camera: its motion.
        duration_s: natural length.
        sensor: the camera's flaws.
        light: BGR gain at a time in seconds, the automatic exposure included.
        sun: direction to the light, world frame.
    """

    room: Room
    actors: list[Actor]
    camera: CameraMotion
    duration_s: float
    sensor: SensorOptions = field(default_factory=SensorOptions)
    light: Callable[[float], Gain] = steady_light
    sun: Vector = field(default_factory=lambda: np.array([-0.4, -0.8, -0.45]))


@dataclass(frozen=True, slots=True)
class Truth:
    """Where the target is at one moment.

    Attributes:
        visible: box of the target's visible part; None where less than a fifth of it shows.
        body: box of the whole target, hidden parts and those beyond the image's border included;
            None where it is wholly outside the image.
        visible_fraction: visible share of the whole target's area, 0 to 1; what lies beyond the
            border counts as hidden.
        distance: of the target's middle along the optical axis, metres.
    """

    visible: Box | None
    body: Box | None
    visible_fraction: float
    distance: float


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedFrame:
    """A frame and the truth about it.

    Attributes:
        frame: what the camera recorded.
        truth: where the target is.
    """

    frame: Frame
    truth: Truth

    @property
    def visible(self) -> Box | None:
        """See `Truth`."""
        return self.truth.visible

    @property
    def body(self) -> Box | None:
        """See `Truth`."""
        return self.truth.body

    @property
    def visible_fraction(self) -> float:
        """See `Truth`."""
        return self.truth.visible_fraction

    @property
    def distance(self) -> float:
        """See `Truth`."""
        return self.truth.distance


class SimulatedSequence:
    """A recorded scene; frames are rendered when asked for.

    ``len()``, indexing and iteration give `SimulatedFrame`; any order gives the same frames.

    Args:
        scene: what happens.
        scenario: its name.
        seed: of the camera's noise.
        rate_hz: frames per second.
        offsets_ns: of each frame from the start of the scene.
        size: width and height of the picture.
        intrinsics: of the camera.
    """

    def __init__(
        self, scene: Scene, scenario: str, seed: int, rate_hz: float, offsets_ns: Sequence[int],
        size: tuple[int, int], intrinsics: Intrinsics,
    ) -> None:  # fmt: skip
        self.scene, self.scenario, self.seed, self.rate_hz = scene, scenario, seed, rate_hz
        self.size, self.intrinsics = size, intrinsics
        self._offsets_ns = tuple(offsets_ns)
        self._key = [seed, zlib.crc32(scenario.encode())]
        self._sensor = Sensor(
            scene.sensor, intrinsics, size, np.random.default_rng([*self._key, 7])
        )
        self._still: tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]] | None = None

    def __len__(self) -> int:
        """Number of frames."""
        return len(self._offsets_ns)

    def __iter__(self) -> Iterator[SimulatedFrame]:
        """Frames in order."""
        return (self[i] for i in range(len(self)))

    def __getitem__(self, index: int) -> SimulatedFrame:
        """Render one frame."""
        offset_ns = self._offsets_ns[index]
        t = offset_ns * 1e-9
        rng = np.random.default_rng([*self._key, offset_ns // 1000])
        picture = _Picture(self, t)
        options = self.scene.sensor
        color = self._sensor.color(picture.color, self.scene.light(t), rng)
        depth = None
        if options.has_depth:
            later = picture if options.delay_s == 0 else _Picture(self, t + options.delay_s, False)
            blind = any(a <= t < b for a, b in options.no_target_depth)
            depth = self._sensor.depth(
                later.depth, picture.color, later.target_mask if blind else None, rng
            )
        frame = Frame(color, depth, self.stamp_ns(index), self.intrinsics)
        return SimulatedFrame(frame, picture.truth())

    def stamp_ns(self, index: int) -> int:
        """Stamp of a frame without rendering it."""
        return EPOCH_NS + self._offsets_ns[index]

    def truth(self, index: int) -> Truth:
        """The truth about one frame alone, several times faster than the frame."""
        return _Picture(self, self._offsets_ns[index] * 1e-9, shade=False).truth()

    def background(self, view: View) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """The empty room; drawn once where the camera is fixed."""
        if self._still is None or not self.scene.camera.fixed:
            w, h = self.size
            color = np.zeros((h, w, 3), np.uint8)
            depth = np.full((h, w), np.inf, np.float32)
            for f in self.scene.room.faces:
                draw_face(f.moved(view.rotation, view.place), view.camera, color, depth)
            for solids, atlas in self.scene.room.plants:
                layer = render(solids.moved(view.rotation, view.place), atlas, view.camera,
                               (0, 0, w, h), view.light)  # fmt: skip
                if layer is not None:
                    window = np.s_[layer.y0 : layer.y0 + layer.z.shape[0],
                                   layer.x0 : layer.x0 + layer.z.shape[1]]  # fmt: skip
                    nearer = layer.z < depth[window]
                    color[window][nearer] = layer.color[nearer]
                    np.copyto(depth[window], layer.z, where=nearer)
            self._still = color, depth
        return self._still


class _Picture:
    """One ideal picture: colour, depth, and which pixels are the target's."""

    def __init__(self, sequence: SimulatedSequence, t: float, shade: bool = True) -> None:
        self.scene, self.camera, self.t = sequence.scene, sequence.intrinsics, t
        self.width, self.height = sequence.size
        self.view = self._view(t)
        still_color, still_depth = sequence.background(self.view)
        self.color, self.depth = still_color.copy(), still_depth.copy()
        self.owner = np.zeros(self.depth.shape, np.uint8)
        exposure = self.scene.sensor.exposure_s
        self._before = self._view(t - exposure / 2)
        self._after = self._view(t + exposure / 2)
        if shade and not self.scene.camera.fixed:
            middle = self.view.place + self.view.rotation.T @ np.array([0, 0, 3.0])
            self.color = _blurred(self.color, *self._streak(middle, middle))
        self.body: Layer | None = None
        w, h = self.width, self.height
        layers: list[tuple[float, int, Layer]] = []
        for i, actor in enumerate(self.scene.actors):
            window = (-w, -h, 2 * w, 2 * h) if i == 0 else (0, 0, w, h)
            layer = actor.draw(t, self.view, window, shade)
            if i == 0:
                self.body = layer
            if layer is not None:
                middle = self.view.rotation @ (actor.centre(t) - self.view.place)
                layers.append((float(middle[2]), i, layer))
        if shade:
            for _, i, _ in layers:
                self._cast_shadow(self.scene.actors[i])
        for distance, i, layer in sorted(layers, key=lambda item: -item[0]):
            self._place(layer, i, distance, shade)

    def _view(self, t: float) -> View:
        rotation, place = self.scene.camera.at(t)
        sun = self.scene.sun / np.linalg.norm(self.scene.sun)
        return View(self.camera, rotation, place, Lighting(rotation @ sun))

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
        front = (behind > distance)[..., None]
        alpha = blurred[..., 3:] * np.float32(1 / 255) * front
        window = self.color[y0:y1, x0:x1]
        window[:] = np.minimum(window * (1 - alpha) + blurred[..., :3] * front, 255)

    @property
    def target_mask(self) -> npt.NDArray[np.bool_]:
        """Pixels in which the target is seen."""
        return np.asarray(self.owner == TARGET)

    def truth(self) -> Truth:
        """The exact boxes."""
        centre = self.scene.actors[0].centre(self.t)
        distance = float((self.view.rotation @ (centre - self.view.place))[2])
        if self.body is None:
            return Truth(None, None, 0.0, distance)
        whole = int(np.count_nonzero(self.body.mask))
        body = Box(self.body.x0, self.body.y0, self.body.z.shape[1], self.body.z.shape[0])
        mask = self.target_mask
        fraction = int(np.count_nonzero(mask)) / max(whole, 1)
        visible = mask_box(mask) if fraction >= HIDDEN_BELOW else None
        inside = body.clipped(self.width, self.height) is not None
        return Truth(visible, body if inside else None, fraction, distance)


def mask_box(mask: npt.NDArray[np.bool_]) -> Box | None:
    """The smallest box around the set pixels."""
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if rows.size == 0:
        return None
    return Box.from_corners(float(cols[0]), float(rows[0]), cols[-1] + 1.0, rows[-1] + 1.0)


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
