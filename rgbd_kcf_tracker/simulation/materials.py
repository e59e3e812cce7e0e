# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Procedural textures of rooms: walls, floors, furniture. All ``(h, w, 3)`` uint8 BGR."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from rgbd_kcf_tracker.simulation.textures import (
    Color,
    Texture,
    filled,
    print_letters,
    random_color,
    shaded,
    smooth_noise,
)


def paint(rng: np.random.Generator, h: int, w: int, color: Color) -> Texture:
    """A painted surface with stains and roughness."""
    return shaded(rng, filled(h, w, color), broad=0.05, grain=0.015)


def wallpaper(rng: np.random.Generator, h: int, w: int) -> Texture:
    """A wall: paint, stripes, bricks or panels."""
    color = random_color(rng, (0.02, 0.35), (0.45, 0.9))
    image = filled(h, w, color)
    kind = rng.choice(['paint', 'paint', 'stripes', 'bricks', 'panels', 'wainscot'])
    rows, cols = np.mgrid[0:h, 0:w].astype(np.float32)
    other = tuple(float(c * rng.uniform(0.75, 1.15)) for c in color)
    if kind == 'stripes':
        period = w / rng.integers(12, 50)
        image[(cols % period) < period * 0.5] = other
    elif kind == 'bricks':
        bh, bw = h / rng.integers(16, 30), w / rng.integers(16, 34)
        row = np.floor(rows / bh)
        col = np.floor(cols / bw + 0.5 * (row % 2))
        tint = rng.uniform(0.8, 1.12, (64, 64)).astype(np.float32)
        image = image * tint[row.astype(int) % 64, col.astype(int) % 64][..., None]
        mortar = (rows % bh < 3) | ((cols + 0.5 * bw * (row % 2)) % bw < 3)
        image[mortar] = 170
    elif kind == 'panels':
        period = w / rng.integers(5, 10)
        image[(cols % period) < 4] = np.array(color, np.float32) * 0.6
    elif kind == 'wainscot':
        image[int(h * 0.6) :] = other
        image[int(h * 0.6) : int(h * 0.62)] = np.array(color, np.float32) * 0.5
    image[int(h * 0.965) :] = random_color(rng, (0.1, 0.4), (0.2, 0.8))
    return shaded(rng, image, broad=0.05, grain=0.02)


def ceiling(rng: np.random.Generator, h: int, w: int) -> Texture:
    """A pale ceiling: plaster, or panels with lamps among them."""
    grey = rng.uniform(205, 240)
    image = filled(h, w, (grey, grey, grey * 0.99))
    if rng.uniform() < 0.6:
        pitch = w // int(rng.integers(8, 16))
        image[::pitch] *= 0.88
        image[:, ::pitch] *= 0.88
        for row in range(pitch, h - pitch, 3 * pitch):
            for col in range(pitch, w - pitch, 3 * pitch):
                image[row + 2 : row + pitch - 1, col + 2 : col + pitch - 1] = 255
    return shaded(rng, image, broad=0.012, grain=0.01)


def floor(rng: np.random.Generator, h: int, w: int) -> Texture:
    """A floor: planks, tiles or carpet."""
    kind = rng.choice(['planks', 'tiles', 'carpet', 'concrete'])
    rows, cols = np.arange(h, dtype=np.float32)[:, None], np.arange(w, dtype=np.float32)[None]
    if kind == 'planks':
        color = (rng.uniform(40, 110), rng.uniform(80, 140), rng.uniform(120, 190))
        count = rng.integers(20, 40)
        ph, pw = h / count, w / rng.integers(4, 9)
        row = np.floor(rows / ph)
        col = np.floor(cols / pw + 0.37 * row)
        tint = rng.uniform(0.75, 1.15, (64, 64)).astype(np.float32)
        image = filled(h, w, color) * tint[row.astype(int) % 64, col.astype(int) % 64][..., None]
        grain = cv2.resize(rng.standard_normal((h, max(1, w // 24)), dtype=np.float32), (w, h))
        image *= 1 + 0.07 * grain[..., None]
        image[rows[:, 0] % ph < 1.5] *= 0.6
    elif kind == 'tiles':
        color = random_color(rng, (0.02, 0.3), (0.45, 0.85))
        image = filled(h, w, color)
        size = w / rng.integers(14, 30)
        odd = (np.floor(rows / size) + np.floor(cols / size)) % 2 > 0
        image[odd] *= rng.uniform(0.55, 1.0)
        image[(rows % size < 2) | (cols % size < 2)] *= 0.65
    elif kind == 'carpet':
        image = filled(h, w, random_color(rng, (0.1, 0.6), (0.25, 0.6)))
        image *= 1 + 0.12 * rng.standard_normal((h, w, 1), dtype=np.float32)
    else:
        image = filled(h, w, random_color(rng, (0.0, 0.1), (0.35, 0.7)))
    return shaded(rng, image, broad=0.08, grain=0.03)


def wood(rng: np.random.Generator, h: int, w: int) -> Texture:
    """Wooden furniture with vertical grain."""
    color = (rng.uniform(30, 130), rng.uniform(60, 160), rng.uniform(90, 200))
    grain = cv2.resize(rng.standard_normal((max(1, h // 16), w), dtype=np.float32), (w, h))
    return shaded(rng, filled(h, w, color) * (1 + 0.08 * grain[..., None]), 0.06, 0.02)


def cardboard(rng: np.random.Generator, h: int, w: int) -> Texture:
    """A box with tape and print."""
    color = (rng.uniform(70, 110), rng.uniform(120, 150), rng.uniform(165, 195))
    image = filled(h, w, color)
    image[:, int(w * 0.45) : int(w * 0.55)] *= 1.15
    if rng.uniform() < 0.7:
        x, y = int(w * rng.uniform(0.05, 0.5)), int(h * rng.uniform(0.1, 0.6))
        cv2.rectangle(image, (x, y), (x + w // 3, y + h // 5), (60, 60, 70), 3)
        print_letters(image, 'FRAGILE', (x + 4, y + h // 7), w / 400, (50, 50, 60), 2)
    return shaded(rng, image, broad=0.06, grain=0.03)


def cabinet(rng: np.random.Generator, h: int, w: int) -> Texture:
    """Doors or drawers with handles."""
    image = wood(rng, h, w) if rng.uniform() < 0.6 else paint(
        rng, h, w, random_color(rng, (0.0, 0.4), (0.3, 0.9))
    )  # fmt: skip
    rows, cols = int(rng.integers(1, 5)), int(rng.integers(1, 3))
    for r in range(rows):
        for c in range(cols):
            x0, y0 = c * w // cols, r * h // rows
            x1, y1 = (c + 1) * w // cols - 1, (r + 1) * h // rows - 1
            cv2.rectangle(image, (x0 + 3, y0 + 3), (x1 - 3, y1 - 3), (40, 45, 50), 2)
            cx, cy = (x0 + x1) // 2, (y0 + y1) // 2
            cv2.line(image, (cx - w // 20, cy), (cx + w // 20, cy), (60, 60, 60), 4)
    return image


def bookshelf(rng: np.random.Generator, h: int, w: int) -> Texture:
    """Rows of books."""
    image = wood(rng, h, w)
    shelves = int(rng.integers(3, 6))
    for s in range(shelves):
        top, bottom = s * h // shelves + 8, (s + 1) * h // shelves - 6
        image[top:bottom, 8 : w - 8] = 30
        x = 10
        while x < w - 24:
            width = int(rng.integers(7, 22))
            tall = int((bottom - top) * rng.uniform(0.6, 0.95))
            if rng.uniform() < 0.92:
                color = random_color(rng)
                cv2.rectangle(image, (x, bottom - tall), (x + width - 2, bottom), color, -1)
                stripe = bottom - int(tall * 0.7)
                cv2.rectangle(image, (x, stripe), (x + width - 2, stripe + 4), (200, 200, 190), -1)
            x += width
    return image


def poster(rng: np.random.Generator, h: int, w: int) -> Texture:
    """A picture, window, door or board for a wall."""
    kind = rng.choice(['art', 'art', 'window', 'door', 'board', 'screen'])
    if kind == 'window':
        image = filled(h, w, (235, 225, 205)) + 25 * smooth_noise(rng, h, w, 8)[..., None]
        image[int(h * 0.6) :] *= (0.6, 0.75, 0.65)
        image[:, w // 2 - 6 : w // 2 + 6] = 210
        image[h // 2 - 6 : h // 2 + 6] = 210
        frame: Color = (215, 215, 215)
    elif kind == 'door':
        return cabinet(rng, h, w)
    elif kind == 'board':
        image = filled(h, w, (235, 238, 235))
        for _ in range(int(rng.integers(3, 9))):
            points = np.cumsum(rng.uniform(-w / 20, w / 16, (20, 2)), axis=0)
            points += rng.uniform(0.2, 0.6, 2) * (w, h)
            cv2.polylines(image, [points.astype(np.int32)], False, random_color(rng, (0.5, 1)), 2)
        frame = (120, 120, 120)
    elif kind == 'screen':
        image = filled(h, w, (35, 32, 30))
        frame = (20, 20, 20)
    else:
        image = filled(h, w, random_color(rng))
        for _ in range(int(rng.integers(3, 12))):
            centre = (int(rng.uniform(0, w)), int(rng.uniform(0, h)))
            axes = (int(rng.uniform(w / 20, w / 3)), int(rng.uniform(h / 20, h / 3)))
            cv2.ellipse(image, centre, axes, float(rng.uniform(0, 180)), 0, 360,
                        random_color(rng), -1, cv2.LINE_AA)  # fmt: skip
        frame = random_color(rng, (0, 0.4), (0.1, 0.6))
    cv2.rectangle(image, (0, 0), (w - 1, h - 1), frame, max(4, w // 30))
    return shaded(rng, image, broad=0.03, grain=0.02)


FURNITURE: tuple[Callable[[np.random.Generator, int, int], Texture], ...] = (cabinet, bookshelf)
