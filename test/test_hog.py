# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from rgbd_kcf_tracker.features.hog import CHANNELS, HogExtractor, fhog


def texture(height: int, width: int, seed: int = 0) -> npt.NDArray[np.uint8]:
    noise = np.random.default_rng(seed).integers(0, 256, (height, width), dtype=np.uint8)
    smooth = cv2.GaussianBlur(noise, (0, 0), 1.5)
    return np.asarray(cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX), np.uint8)


def slow_fhog(gray: npt.NDArray[np.uint8], cell: int = 4) -> npt.NDArray[np.float64]:
    """The definition, pixel by pixel."""
    image = gray.astype(np.float64) / 255
    height, width = image.shape
    dy, dx = np.zeros_like(image), np.zeros_like(image)
    dx[:, 1:-1] = (image[:, 2:] - image[:, :-2]) / 2
    dx[:, 0], dx[:, -1] = image[:, 1] - image[:, 0], image[:, -1] - image[:, -2]
    dy[1:-1] = (image[2:] - image[:-2]) / 2
    dy[0], dy[-1] = image[1] - image[0], image[-1] - image[-2]
    magnitude = np.hypot(dx, dy)
    angle = np.mod(np.arctan2(dy, dx), 2 * np.pi)
    rows, cols = height // cell, width // cell
    signed = np.zeros((18, rows, cols))
    for y in range(rows * cell):
        for x in range(cols * cell):
            bin_ = int(angle[y, x] * 18 / (2 * np.pi) + 0.5) % 18
            fy, fx = (y + 0.5) / cell - 0.5, (x + 0.5) / cell - 0.5
            y0, x0 = int(np.floor(fy)), int(np.floor(fx))
            for row, wy in ((y0, y0 + 1 - fy), (y0 + 1, fy - y0)):
                for col, wx in ((x0, x0 + 1 - fx), (x0 + 1, fx - x0)):
                    if 0 <= row < rows and 0 <= col < cols:
                        signed[bin_, row, col] += magnitude[y, x] * wy * wx / cell**2
    for edge in (np.s_[:, 0], np.s_[:, -1], np.s_[:, :, 0], np.s_[:, :, -1]):
        signed[edge] *= 8 / 7
    unsigned = signed[:9] + signed[9:]
    energy = (unsigned**2).sum(0)
    norm = np.zeros((rows + 1, cols + 1))
    for row in range(rows - 1):
        for col in range(cols - 1):
            block = energy[row : row + 2, col : col + 2].sum()
            norm[row + 1, col + 1] = 1 / np.sqrt(block + 1e-4 / 4 / cell**4)
    norm[0], norm[-1] = norm[1], norm[-2]
    norm[:, 0], norm[:, -1] = norm[:, 1], norm[:, -2]
    out = np.zeros((31, rows, cols))
    for index, (down, right) in enumerate(((1, 1), (0, 1), (1, 0), (0, 0))):
        scale = norm[down : down + rows, right : right + cols]
        clipped = np.minimum(signed * scale, 0.2)
        out[:18] += clipped / 2
        out[18:27] += np.minimum(unsigned * scale, 0.2) / 2
        out[27 + index] = clipped.sum(0) * 0.2357
    return out


@pytest.mark.parametrize(('height', 'width'), [(32, 24), (45, 38), (8, 60)])
def test_equals_the_definition_pixel_by_pixel(height: int, width: int) -> None:
    gray = texture(height, width)
    features = fhog(gray)
    assert features.dtype == np.float32
    assert features.shape == (CHANNELS, height // 4, width // 4)
    np.testing.assert_allclose(features, slow_fhog(gray), atol=2e-6)


def test_extractor_gives_the_same_every_time() -> None:
    extractor = HogExtractor(40, 36)
    first, other = texture(40, 36, 1), texture(40, 36, 2)
    expected = fhog(first)
    extractor(other)
    np.testing.assert_array_equal(extractor(first), expected)


def test_a_flat_image_has_no_features() -> None:
    assert not fhog(np.full((24, 24), 77, np.uint8)).any()


def test_a_vertical_edge_falls_into_the_horizontal_orientation() -> None:
    gray = np.zeros((32, 32), np.uint8)
    gray[:, 16:] = 200
    middle = fhog(gray)[:18, 4, 3]
    assert middle.argmax() == 0
    assert fhog(gray[:, ::-1].copy())[:18, 4, 4].argmax() == 9


def test_contrast_hardly_matters() -> None:
    # A gain of two; only the constant in the norm sees it.
    gray = texture(48, 48) // 2
    np.testing.assert_allclose(fhog(gray), fhog(gray * 2), atol=0.02)


@pytest.mark.parametrize(('height', 'width'), [(4, 4), (4, 20), (7, 5)])
def test_a_single_row_of_cells_works(height: int, width: int) -> None:
    features = fhog(texture(height, width))
    assert features.shape == (CHANNELS, height // 4, width // 4)
    assert np.isfinite(features).all()


def test_refuses_wrong_sizes() -> None:
    with pytest.raises(ValueError, match='no cell'):
        fhog(np.zeros((3, 40), np.uint8))
    with pytest.raises(ValueError, match='extractor is for'):
        HogExtractor(20, 20)(np.zeros((20, 24), np.uint8))
