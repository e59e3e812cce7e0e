# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Procedural textures of people: cloth, skin, hair, heads. All ``(h, w, 3)`` uint8 BGR."""

from __future__ import annotations

import colorsys

import cv2
import numpy as np
import numpy.typing as npt

Texture = npt.NDArray[np.uint8]
Color = tuple[float, float, float]

SKIN: tuple[Color, ...] = (
    (150, 180, 224), (125, 160, 212), (100, 138, 196), (75, 108, 165), (52, 78, 122), (38, 55, 90),
)  # fmt: skip
HAIR: tuple[Color, ...] = (
    (22, 22, 26), (28, 38, 58), (40, 62, 96), (70, 120, 170), (110, 170, 205), (150, 150, 155),
    (30, 50, 110),
)  # fmt: skip


def smooth_noise(rng: np.random.Generator, h: int, w: int, cells: float) -> npt.NDArray[np.float32]:
    """Smooth noise, ``(h, w)`` float32 in about [-1, 1].

    Args:
        rng: source of it.
        h: rows.
        w: columns.
        cells: bumps along the longer side.
    """
    step = max(h, w) / max(cells, 1.0)
    coarse = rng.uniform(-1, 1, (int(h / step) + 3, int(w / step) + 3)).astype(np.float32)
    fine = cv2.resize(coarse, (w, h), interpolation=cv2.INTER_CUBIC)
    return np.asarray(fine, np.float32)


def random_color(
    rng: np.random.Generator, saturation: tuple[float, float] = (0.1, 0.9),
    value: tuple[float, float] = (0.15, 0.9),
) -> Color:  # fmt: skip
    """A random colour, blue, green and red from 0 to 255.

    Args:
        rng: source of it.
        saturation: its least and its most, 0 to 1.
        value: likewise of its brightness.
    """
    r, g, b = colorsys.hsv_to_rgb(rng.uniform(), rng.uniform(*saturation), rng.uniform(*value))
    return b * 255, g * 255, r * 255


def filled(h: int, w: int, color: Color) -> npt.NDArray[np.float32]:
    """One colour, ``(h, w, 3)`` float32 BGR from 0 to 255 to work on."""
    return np.full((h, w, 3), color, np.float32)


def finished(image: npt.NDArray[np.float32]) -> Texture:
    """Back from ``(h, w, 3)`` float32 BGR to uint8, cut off at 0 and 255; ``image`` is used up."""
    return np.clip(image, 0, 255, out=image).astype(np.uint8)


def shaded(
    rng: np.random.Generator, image: npt.NDArray[np.float32], broad: float, grain: float
) -> Texture:
    """Multiply in broad folds or stains and a fine grain.

    Args:
        rng: source of them.
        image: ``(h, w, 3)`` float32 BGR from 0 to 255; used up.
        broad: share by which folds are about lighter or darker.
        grain: deviation of each pixel's, as a share.
    """
    h, w = image.shape[:2]
    gain = 1 + broad * smooth_noise(rng, h, w, 6) + broad * 0.6 * smooth_noise(rng, h, w, 17)
    gain += grain * rng.standard_normal((h, w), dtype=np.float32)
    image *= gain[..., None]
    return finished(image)


def cloth(
    rng: np.random.Generator, h: int, w: int, kind: str, colors: tuple[Color, Color, Color]
) -> Texture:
    """A garment's cloth wrapped once around a limb or torso.

    Args:
        rng: source of the details.
        h: rows, from the top of the garment to its lower end.
        w: columns, once around; the front is in the middle.
        kind: one of `CLOTH_KINDS`.
        colors: ground, pattern and accent colour.
    """
    base, second, third = colors
    image = filled(h, w, base)
    rows, cols = np.mgrid[0:h, 0:w].astype(np.float32)
    if kind == 'stripes':
        period = h / rng.integers(4, 12)
        image[(rows % period) < period * rng.uniform(0.25, 0.6)] = second
    elif kind == 'pinstripes':
        period = w / rng.integers(14, 40)
        image[(cols % period) < period * rng.uniform(0.2, 0.5)] = second
    elif kind == 'checks':
        period_x, period_y = w / rng.integers(8, 20), h / rng.integers(4, 10)
        across = (cols % period_x) < period_x * 0.4
        down = (rows % period_y) < period_y * 0.4
        image[across] = 0.5 * image[across] + 0.5 * np.array(second, np.float32)
        image[down] = 0.5 * image[down] + 0.5 * np.array(third, np.float32)
    elif kind == 'dots':
        pitch = max(8.0, w / rng.integers(12, 26))
        dx = (cols + (rows // pitch % 2) * pitch / 2) % pitch - pitch / 2
        dy = rows % pitch - pitch / 2
        image[dx * dx + dy * dy < (pitch * rng.uniform(0.2, 0.33)) ** 2] = second
    elif kind == 'two_tone':
        image[int(h * rng.uniform(0.35, 0.65)) :] = second
    elif kind == 'camouflage':
        field = smooth_noise(rng, h, w, 14)
        image[field > 0.15] = second
        image[field < -0.3] = third
    elif kind == 'panels':
        side = np.abs(cols / w - 0.5)
        image[(side > 0.2) & (side < 0.3)] = second
    elif kind == 'jacket':
        image[np.abs(cols / w - 0.5) < rng.uniform(0.02, 0.07)] = second
        image[: int(h * 0.08)] = third
    if kind in ('logo', 'jacket') or rng.uniform() < 0.15:
        _print_logo(rng, image, second, third)
    return shaded(rng, image, broad=0.10, grain=0.045)


CLOTH_KINDS = (
    'plain', 'logo', 'stripes', 'pinstripes', 'checks', 'dots', 'two_tone', 'camouflage', 'panels',
    'jacket',
)  # fmt: skip


def print_letters(
    image: npt.NDArray[np.float32], letters: str, at: tuple[int, int], scale: float, color: Color,
    thickness: int,
) -> None:  # fmt: skip
    """Print on a float image; OpenCV 5 draws letters on 8-bit images alone.

    Args:
        image: ``(h, w, 3)`` float32 BGR from 0 to 255, printed on.
        letters: what to print.
        at: column and row of the lower left corner in pixels.
        scale: of OpenCV's font.
        color: blue, green and red from 0 to 255.
        thickness: of the strokes in pixels.
    """
    mask = np.zeros(image.shape[:2], np.uint8)
    cv2.putText(mask, letters, at, cv2.FONT_HERSHEY_DUPLEX, scale, 255, thickness, cv2.LINE_AA)
    cover = mask[..., None].astype(np.float32) / 255
    image += cover * (np.asarray(color, np.float32) - image)


def _print_logo(
    rng: np.random.Generator, image: npt.NDArray[np.float32], first: Color, second: Color
) -> None:
    """Print a shape or a line of letters on the front, and often a bigger one on the back."""
    h, w = image.shape[:2]
    for centre, likely in ((0.5, 1.0), (0.0, 0.5)):
        if rng.uniform() > likely:
            continue
        patch = np.ascontiguousarray(np.roll(image, int((0.5 - centre) * w), axis=1))
        x, y, r = w // 2, int(h * rng.uniform(0.25, 0.5)), int(w * rng.uniform(0.04, 0.09))
        style = rng.integers(4)
        if style == 0:
            cv2.circle(patch, (x, y), r, first, -1, cv2.LINE_AA)
            cv2.circle(patch, (x, y), r // 2, second, -1, cv2.LINE_AA)
        elif style == 1:
            cv2.rectangle(patch, (x - 2 * r, y - r // 2), (x + 2 * r, y + r // 2), first, -1)
        elif style == 2:
            letters = ''.join(
                chr(65 + int(k)) for k in rng.integers(0, 26, int(rng.integers(1, 5)))
            )
            scale = r / 14
            width = cv2.getTextSize(letters, cv2.FONT_HERSHEY_DUPLEX, scale, 3)[0][0]
            print_letters(patch, letters, (x - width // 2, y + r), scale, first, 3)
        else:
            star = [
                (x + r * f * np.sin(a), y - r * f * np.cos(a))
                for a, f in zip(np.arange(10) * np.pi / 5, [1.2, 0.5] * 5, strict=True)
            ]
            cv2.fillPoly(patch, [np.array(star, np.int32)], first, cv2.LINE_AA)
        image[:] = np.roll(patch, -int((0.5 - centre) * w), axis=1)


def skin(rng: np.random.Generator, h: int, w: int, color: Color) -> Texture:
    """Bare skin, ``(h, w, 3)``, of about a colour."""
    return shaded(rng, filled(h, w, color), broad=0.06, grain=0.02)


def hair(rng: np.random.Generator, h: int, w: int, color: Color) -> Texture:
    """Hair, ``(h, w, 3)``, of about a colour: strands that run down."""
    strands = cv2.GaussianBlur(
        rng.standard_normal((h, w), dtype=np.float32), (0, 0), sigmaX=0.8, sigmaY=h / 10
    )
    strands /= float(strands.std()) + 1e-6
    return finished(filled(h, w, color) * (1 + 0.18 * strands[..., None]))


def head(rng: np.random.Generator, h: int, w: int, skin_color: Color, hair_color: Color) -> Texture:
    """A head unrolled from crown to chin, ``(h, w, 3)``, the face in the middle.

    Args:
        rng: source of the details.
        h: rows, from the crown to the chin.
        w: columns, once around.
        skin_color: blue, green and red from 0 to 255.
        hair_color: likewise.
    """
    image = skin(rng, h, w, skin_color)
    tone = np.array(skin_color, np.float64)
    x = w // 2
    eye_y, eye_dx = int(h * 0.47), int(w * 0.055)
    for side in (-1, 1):
        eye = (x + side * eye_dx, eye_y)
        cv2.ellipse(image, eye, (w // 40, h // 40), 0, 0, 360, (225, 230, 235), -1, cv2.LINE_AA)
        cv2.circle(image, eye, max(1, w // 70), (40, 45, 50), -1, cv2.LINE_AA)
        cv2.line(
            image, (eye[0] - w // 34, eye_y - h // 18), (eye[0] + w // 34, eye_y - h // 17),
            tuple(float(c) * 0.8 for c in hair_color), max(2, h // 50), cv2.LINE_AA,
        )  # fmt: skip
    shade = tuple(float(c) for c in tone * 0.72)
    cv2.line(image, (x, eye_y + h // 30), (x, int(h * 0.62)), shade, max(2, w // 70), cv2.LINE_AA)
    cv2.ellipse(image, (x, int(h * 0.63)), (w // 36, h // 50), 0, 0, 360, shade, -1, cv2.LINE_AA)
    lips = (float(tone[0] * 0.65), float(tone[1] * 0.55), float(tone[2] * 0.85))
    cv2.ellipse(image, (x, int(h * 0.73)), (w // 24, h // 55), 0, 0, 360, lips, -1, cv2.LINE_AA)
    extras = rng.uniform(size=3)
    if extras[0] < 0.25:  # beard
        rows, cols = np.mgrid[0:h, 0:w]
        beard = (rows > h * 0.68) & (np.abs(cols - x) < w * 0.19)
        beard &= ~((np.abs(rows - h * 0.73) < h * 0.02) & (np.abs(cols - x) < w * 0.045))
        image[beard] = hair(rng, h, w, hair_color)[beard]
    if extras[1] < 0.3:  # glasses
        for side in (-1, 1):
            cv2.ellipse(
                image, (x + side * eye_dx, eye_y), (w // 26, h // 20), 0, 0, 360, (30, 30, 30), 2
            )
    rows, cols = np.mgrid[0:h, 0:w].astype(np.float32)
    side_angle = np.abs(cols / w - 0.5)
    line = 0.27 + 0.05 * np.cos(cols / w * 40) + 0.9 * np.clip(side_angle - 0.17, 0, 1) * 4
    if extras[2] > 0.06:  # else bald
        hairy = rows / h < np.clip(line, 0, 0.8)
        image[hairy] = hair(rng, h, w, hair_color)[hairy]
    return image
