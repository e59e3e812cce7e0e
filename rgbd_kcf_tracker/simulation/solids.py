# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Ellipsoids and tapered elliptic cylinders, ray-cast exactly within their bounding boxes.

A solid has a local frame ``p = origin + frame @ q``. An ellipsoid is ``|q| = 1``; a limb is
``qx^2 + qz^2 = (1 + taper * qy)^2`` for ``0 <= qy <= 1``. With a pixel's ray ``p = z * d``,
``d = (x, y, 1)``, both are a quadratic in ``z`` whose coefficients are polynomials in the pixel's
column and row, so that a whole bounding box takes a dozen array operations. Shading is deferred:
each pixel remembers which solid it shows, and all of them are lit and textured at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.simulation.textures import Texture

Vector = npt.NDArray[np.float64]
NEAR = 0.15  # metres: nothing nearer is drawn


class Atlas:
    """Textures of one actor in a flat array, so that one gather reads them all.

    Args:
        textures: ``(h, w, 3)`` uint8 each; a solid's ``texture`` is an index into them. Columns go
            once around the local y axis with the front (-z) in the middle, rows from the local
            start (or the top of an ellipsoid) to the end.
    """

    def __init__(self, textures: Sequence[Texture]) -> None:
        sizes = np.array([t.shape[:2] for t in textures], np.int64)
        self.texels = np.concatenate([t.reshape(-1, 3) for t in textures]).astype(np.float32)
        self.heights = sizes[:, 0].astype(np.int32)
        self.widths = sizes[:, 1].astype(np.int32)
        self.offsets = np.concatenate([[0], np.cumsum(sizes.prod(axis=1))[:-1]]).astype(np.int32)


@dataclass(frozen=True, slots=True)
class Solids:
    """``n`` solids that belong together, in one coordinate frame.

    Attributes:
        origin: ``(n, 3)`` metres.
        frame: ``(n, 3, 3)``, columns are the local axes scaled to metres.
        taper: ``(n,)``, relative change of radius from start to end; 0 for ellipsoids.
        ellipsoid: ``(n,)`` bool.
        texture: ``(n,)`` index into the atlas.
    """

    origin: npt.NDArray[np.float64]
    frame: npt.NDArray[np.float64]
    taper: npt.NDArray[np.float64]
    ellipsoid: npt.NDArray[np.bool_]
    texture: npt.NDArray[np.int32]

    def moved(self, rotation: npt.NDArray[np.float64], offset: npt.NDArray[np.float64]) -> Solids:
        """The same solids after ``p -> rotation @ (p - offset)``.

        Args:
            rotation: ``(3, 3)``.
            offset: ``(3,)`` metres.
        """
        return Solids(
            (self.origin - offset) @ rotation.T, rotation @ self.frame, self.taper,
            self.ellipsoid, self.texture,
        )  # fmt: skip


class SolidList:
    """Collects solids one by one and packs them with vectorised geometry."""

    def __init__(self) -> None:
        self._start: list[npt.NDArray[np.float64]] = []
        self._end: list[npt.NDArray[np.float64]] = []
        self._hint: list[npt.NDArray[np.float64]] = []
        self._size: list[tuple[float, float, float, bool, int]] = []

    def limb(
        self, start: npt.NDArray[np.float64], end: npt.NDArray[np.float64], radius: float,
        end_radius: float, texture: int, side: npt.NDArray[np.float64], flat: float = 1.0,
    ) -> None:  # fmt: skip
        """A tapered cylinder; ``side`` is its local x, ``flat`` its thickness over its width."""
        self._start.append(start)
        self._end.append(end)
        self._hint.append(side)
        self._size.append((radius, radius * flat, end_radius / radius - 1, False, texture))

    def ellipsoid(
        self, centre: npt.NDArray[np.float64], down: npt.NDArray[np.float64], width: float,
        thickness: float, texture: int, side: npt.NDArray[np.float64],
    ) -> None:  # fmt: skip
        """An ellipsoid: ``down`` is its half axis to the lower end, the others metres."""
        self._start.append(centre)
        self._end.append(centre + down)
        self._hint.append(side)
        self._size.append((width, thickness, 0.0, True, texture))

    def pack(self) -> Solids:
        """All of them as arrays."""
        start, end, hint = np.array(self._start), np.array(self._end), np.array(self._hint)
        wide, thick, taper, ellipsoid, texture = (
            np.array(c) for c in zip(*self._size, strict=True)
        )
        axis = end - start
        length = np.linalg.norm(axis, axis=1, keepdims=True)
        unit = axis / np.maximum(length, 1e-9)
        back = np.cross(hint, unit)
        back /= np.maximum(np.linalg.norm(back, axis=1, keepdims=True), 1e-9)
        side = np.cross(unit, back)
        frame = np.stack([side * wide[:, None], axis, back * thick[:, None]], axis=2)
        return Solids(start, frame, taper, ellipsoid.astype(bool), texture.astype(np.int32))


@dataclass(slots=True)
class Layer:
    """One actor alone, cut out: the picture coordinates of its window and what each pixel shows.

    Attributes:
        x0: first column of the window in the picture (may be negative).
        y0: first row.
        z: ``(h, w)`` metres, inf where the actor is not.
        color: ``(h, w, 3)`` uint8, 0 where the actor is not.
    """

    x0: int
    y0: int
    z: Floats
    color: npt.NDArray[np.uint8]

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Where the actor is, ``(h, w)`` bool."""
        return np.isfinite(self.z)


@dataclass(frozen=True, slots=True)
class Lighting:
    """A directional light in the camera's frame plus an even one."""

    direction: npt.NDArray[np.float64]
    ambient: float = 0.55
    diffuse: float = 0.6


def _bounds(
    solids: Solids, camera: Intrinsics, window: tuple[int, int, int, int]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """Each solid's box ``x0 y0 x1 y1`` in pixels, cut to the window, and whether to draw it."""
    spread = np.where(solids.ellipsoid, 1.0, np.maximum(1.0, 1 + solids.taper))
    low = np.where(solids.ellipsoid, -1.0, 0.0)
    corner = np.array([(i, j, k) for i in (-1, 1) for j in (0, 1) for k in (-1, 1)], float)
    q = np.empty((len(low), 8, 3))
    q[:, :, 0] = corner[:, 0] * spread[:, None]
    q[:, :, 1] = low[:, None] + (1 - low[:, None]) * corner[:, 1]
    q[:, :, 2] = corner[:, 2] * spread[:, None]
    p = solids.origin[:, None] + q @ solids.frame.transpose(0, 2, 1)
    z = np.maximum(p[..., 2], NEAR)
    u, v = camera.fx * p[..., 0] / z + camera.cx, camera.fy * p[..., 1] / z + camera.cy
    box = np.stack([u.min(1), v.min(1), u.max(1) + 2, v.max(1) + 2], axis=1)
    left, top, right, bottom = window
    box = np.clip(box, [left, top, left, top], [right, bottom, right, bottom]).astype(np.int64)
    draw = (box[:, 2] > box[:, 0]) & (box[:, 3] > box[:, 1]) & (p[..., 2].min(1) > NEAR)
    return box, draw


def render(
    solids: Solids, atlas: Atlas, camera: Intrinsics, window: tuple[int, int, int, int],
    light: Lighting, shade: bool = True,
) -> Layer | None:  # fmt: skip
    """Draw solids given in the camera's frame.

    Args:
        solids: in the camera's optical frame, metres.
        atlas: their textures.
        camera: pinhole camera.
        window: ``left, top, right, bottom`` pixels beyond which nothing is drawn.
        light: light in the camera's frame.
        shade: False leaves colour black, for where depth alone is wanted.

    Returns:
        The layer, or None where nothing falls into the window.
    """
    boxes, draw = _bounds(solids, camera, window)
    if not draw.any():
        return None
    x0, y0 = (int(v) for v in boxes[draw, :2].min(0))
    x1, y1 = (int(v) for v in boxes[draw, 2:].max(0))
    x = ((np.arange(x0, x1) - camera.cx) / camera.fx).astype(np.float32)
    y = ((np.arange(y0, y1) - camera.cy) / camera.fy).astype(np.float32)[:, None]

    inverse = np.asarray(np.linalg.inv(solids.frame), np.float64)
    b = -np.einsum('nij,nj->ni', inverse, solids.origin)
    k = solids.taper
    sign = np.ones((len(k), 3))
    sign[:, 1] = np.where(solids.ellipsoid, 1.0, -k * k)
    quad = np.einsum('nki,nk,nkj->nij', inverse, sign, inverse)
    offset = sign * b
    offset[:, 1] -= np.where(solids.ellipsoid, 0.0, k)
    half = np.einsum('ni,nij->nj', offset, inverse)
    const = (offset * b).sum(1) - np.where(solids.ellipsoid, 1.0, 1 + k * b[:, 1])

    depth = np.full((y1 - y0, x1 - x0), np.inf, np.float32)
    which = np.full(depth.shape, -1, np.int16)
    # the discriminant, half^2 - const * quad, is a quadratic form of the ray (x, y, 1)
    form = half[:, :, None] * half[:, None, :] - const[:, None, None] * quad
    form32, half32, along32 = (v.astype(np.float32) for v in (form, half, inverse[:, 1]))
    with np.errstate(invalid='ignore', divide='ignore'):  # where a ray misses, z is NaN
        for i in np.flatnonzero(draw & (const > 0)):  # else the camera is inside
            c0, r0, c1, r1 = boxes[i]
            cols, rows = slice(c0 - x0, c1 - x0), slice(r0 - y0, r1 - y0)
            xs, ys = x[cols], y[rows]
            e, h, n = form32[i], half32[i], along32[i]
            z = (2 * e[0, 1]) * ys * xs
            z += (e[0, 0] * xs + 2 * e[0, 2]) * xs + e[2, 2]
            z += (e[1, 1] * ys + 2 * e[1, 2]) * ys
            np.sqrt(z, out=z)
            z -= h[0] * xs + (h[1] * ys + h[2])
            np.divide(np.float32(const[i]), z, out=z)  # the nearer root
            hit = z < depth[rows, cols]
            hit &= z > 0
            if not solids.ellipsoid[i]:
                along = n[0] * xs + (n[1] * ys + n[2])
                along *= z
                low = np.float32(-b[i, 1])
                hit &= along >= low
                hit &= along <= low + 1
            np.copyto(depth[rows, cols], z, where=hit)
            np.copyto(which[rows, cols], np.int16(i), where=hit)
    rows_hit = np.flatnonzero((which >= 0).any(1))
    cols_hit = np.flatnonzero((which >= 0).any(0))
    if rows_hit.size == 0:
        return None
    top, bottom, left, right = rows_hit[0], rows_hit[-1] + 1, cols_hit[0], cols_hit[-1] + 1
    depth, which = depth[top:bottom, left:right], which[top:bottom, left:right]
    color = np.zeros((*depth.shape, 3), np.uint8)
    if shade:
        _shade(
            color, depth, which, x[left:right], y[top:bottom, 0], solids, inverse, b, atlas, light
        )
    return Layer(x0 + int(left), y0 + int(top), depth, color)


def _shade(
    color: npt.NDArray[np.uint8], depth: Floats, which: npt.NDArray[np.int16], x: Floats,
    y: Floats, solids: Solids, inverse: npt.NDArray[np.float64], b: npt.NDArray[np.float64],
    atlas: Atlas, light: Lighting,
) -> None:  # fmt: skip
    """Texture and light every pixel that shows a solid."""
    shown = which.ravel()
    flat = np.argsort(shown, kind='stable')  # radix sort: each solid's pixels lie together
    counts = np.bincount(shown + 1, minlength=len(b) + 1)
    flat = flat[counts[0] :]
    counts = counts[1:]
    row, col = np.divmod(flat.astype(np.int32), np.int32(which.shape[1]))
    point = np.empty((3, len(flat)), np.float32)
    np.take(depth.ravel(), flat, out=point[2])
    np.multiply(x[col], point[2], out=point[0])
    np.multiply(y[row], point[2], out=point[1])
    matrices, offsets = inverse.astype(np.float32), b.astype(np.float32)[:, :, None]
    tapers = solids.taper.astype(np.float32)
    around, along = np.empty((2, len(flat)), np.float32)
    normal = np.empty_like(point)
    end = 0
    for i in np.flatnonzero(counts):
        start, end = end, end + int(counts[i])
        q = matrices[i] @ point[:, start:end]
        q += offsets[i]
        around[start:end] = cv2.phase(-q[2], q[0]).ravel()  # a vector or a column, by version
        if solids.ellipsoid[i]:
            along[start:end] = q[1] * np.float32(0.5) + np.float32(0.5)
        else:
            along[start:end] = q[1]
            q[1] = -tapers[i] * (1 + tapers[i] * q[1])  # now the gradient
        normal[:, start:end] = matrices[i].T @ q
    around *= np.float32(1 / (2 * np.pi))
    around += np.float32(0.5)
    around -= np.floor(around)  # the front (-z) in the middle
    texture = np.repeat(solids.texture, counts)
    w, h = atlas.widths[texture], atlas.heights[texture]
    u = np.clip((around * w).astype(np.int32), 0, w - 1)
    v = np.clip((along * h).astype(np.int32), 0, h - 1)
    texel = atlas.texels[atlas.offsets[texture] + v * w + u]
    size = np.sqrt(np.einsum('jm,jm->m', normal, normal)) + np.float32(1e-9)
    lit = light.direction.astype(np.float32) @ normal
    lit /= size
    lit *= np.float32(light.diffuse * 0.5)
    lit += np.float32(light.ambient + light.diffuse * 0.5)
    texel *= lit[:, None]
    color.reshape(-1, 3)[flat] = np.clip(texel, 0, 255, out=texel).astype(np.uint8)
