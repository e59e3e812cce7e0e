# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt
import pytest

from rgbd_kcf_tracker.features.labels import gaussian_labels
from rgbd_kcf_tracker.thesis.correlation import (
    CorrelationFilter,
    Sample,
    cosine_window,
    gaussian_correlation,
    linear_correlation,
    peak,
)

Array = npt.NDArray[np.float64]
SHAPES = [(1, 6, 8), (3, 5, 7), (4, 6, 7), (2, 7, 4), (31, 5, 6)]


def shifts(shape: tuple[int, ...]) -> list[tuple[int, int]]:
    return list(itertools.product(range(shape[-2]), range(shape[-1])))


def shifted(patch: Array, by: tuple[int, int]) -> Array:
    return np.roll(patch, by, axis=(-2, -1))


def kernel(x: Array, z: Array, name: str, sigma: float) -> float:
    """Kernel of two patches, by its definition."""
    if name == 'linear':
        return float((x * z).mean())
    return float(np.exp(-((x - z) ** 2).mean() / sigma**2))


def patches(shape: tuple[int, int, int], dtype: type = np.float64) -> tuple[Array, Array]:
    rng = np.random.default_rng(sum(shape))
    return rng.standard_normal(shape).astype(dtype), rng.standard_normal(shape).astype(dtype)


def dense_coefficients(x: Array, labels: Array, lam: float, name: str, sigma: float) -> Array:
    """alpha = (K + lambda I)^-1 y over all cyclic shifts of x: thesis equations 18 to 20."""
    rolled = [shifted(x, s) for s in shifts(x.shape)]
    gram = np.array([[kernel(a, b, name, sigma) for b in rolled] for a in rolled])
    alpha = np.linalg.solve(gram + lam * np.eye(len(gram)), labels.ravel())
    return alpha


def dense_response(x: Array, z: Array, alpha: Array, name: str, sigma: float) -> Array:
    """f(z) = sum_i alpha_i k(x_i, z): thesis equations 22 and 25, at every shift of the window.

    Shift ``s`` of the window over z sees what z moved back by s shows.
    """
    rolled = [shifted(x, s) for s in shifts(x.shape)]
    values = []
    for by in shifts(z.shape):
        seen = shifted(z, (-by[0], -by[1]))
        k = np.array([kernel(a, seen, name, sigma) for a in rolled])
        values.append(float(alpha @ k))
    return np.array(values).reshape(x.shape[-2:])


@pytest.mark.parametrize('shape', SHAPES)
def test_gaussian_correlation_is_the_brute_force_kernel(shape: tuple[int, int, int]) -> None:
    x, z = patches(shape)
    fast = gaussian_correlation(x, z, 0.7)
    slow = [kernel(x, shifted(z, (-by[0], -by[1])), 'gaussian', 0.7) for by in shifts(shape)]
    np.testing.assert_allclose(fast, np.reshape(slow, shape[-2:]), rtol=1e-10)


@pytest.mark.parametrize('shape', SHAPES)
def test_linear_correlation_is_the_brute_force_product(shape: tuple[int, int, int]) -> None:
    x, z = patches(shape)
    slow = [kernel(x, shifted(z, (-by[0], -by[1])), 'linear', 1.0) for by in shifts(shape)]
    np.testing.assert_allclose(linear_correlation(x, z), np.reshape(slow, shape[-2:]), atol=1e-12)


@pytest.mark.parametrize('name', ['gaussian', 'linear'])
@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('lam', [1e-4, 0.1])
def test_fourier_training_and_response_equal_dense_ridge_regression(
    shape: tuple[int, int, int], name: str, lam: float
) -> None:
    x, z = patches(shape)
    labels = gaussian_labels(shape[1:], 0.8)
    fourier = CorrelationFilter(labels, regularization=lam, kernel=name, kernel_sigma=0.9)
    fourier.learn(Sample.of(x))
    alpha = dense_coefficients(x, labels, lam, name, 0.9)
    # On its own sample: the regression's fitted values, K alpha.
    own = dense_response(x, x, alpha, name, 0.9)
    np.testing.assert_allclose(fourier.respond(Sample.of(x)), own, atol=1e-8)
    other = dense_response(x, z, alpha, name, 0.9)
    np.testing.assert_allclose(fourier.respond(Sample.of(z)), other, atol=1e-7)


def test_single_precision_features_keep_the_published_regularisation_meaningful() -> None:
    x, z = patches((31, 24, 17), np.float32)
    labels = gaussian_labels((24, 17), 1.2)
    single, double = CorrelationFilter(labels), CorrelationFilter(labels)
    single.learn(Sample.of(x))
    double.learn(Sample.of(x.astype(np.float64)))
    np.testing.assert_allclose(
        single.respond(Sample.of(z)), double.respond(Sample.of(z.astype(np.float64))), atol=1e-4
    )


def test_a_stack_of_patches_gives_each_ones_response() -> None:
    x, z = patches((5, 9, 8), np.float32)
    filter_ = CorrelationFilter(gaussian_labels((9, 8), 1.0))
    filter_.learn(Sample.of(x))
    batch = filter_.respond(Sample.of(np.stack([x, z, x + z])))
    assert batch.shape == (3, 9, 8)
    for one, patch in zip(batch, (x, z, x + z), strict=True):
        np.testing.assert_allclose(one, filter_.respond(Sample.of(patch)), atol=1e-6)


@pytest.mark.parametrize('shape', [(1, 8, 8), (3, 9, 7), (2, 7, 10)])
def test_learning_interpolates_coefficients_and_template(shape: tuple[int, int, int]) -> None:
    x, z = patches(shape)
    labels = gaussian_labels(shape[1:], 1.0)
    both = CorrelationFilter(labels)
    both.learn(Sample.of(x))
    both.learn(Sample.of(z), rate=0.25)

    def coefficients(patch: Array) -> npt.NDArray[np.complex128]:
        k = gaussian_correlation(patch, patch, 0.5)
        return np.fft.fft2(labels) / (np.fft.fft2(k) + 1e-4)

    alpha = 0.75 * coefficients(x) + 0.25 * coefficients(z)
    template = 0.75 * x + 0.25 * z
    k = gaussian_correlation(template, x, 0.5)
    expected = np.fft.ifft2(np.fft.fft2(k) * alpha).real
    np.testing.assert_allclose(both.respond(Sample.of(x)), expected, atol=1e-9)


def test_a_rate_of_one_forgets_and_a_copy_goes_its_own_way() -> None:
    x, z = patches((2, 6, 6))
    labels = gaussian_labels((6, 6), 1.0)
    fresh = CorrelationFilter(labels)
    fresh.learn(Sample.of(z))
    used = CorrelationFilter(labels)
    used.learn(Sample.of(x))
    kept = used.copy()
    before = used.respond(Sample.of(x))
    used.learn(Sample.of(z), rate=1.0)
    np.testing.assert_array_equal(used.respond(Sample.of(x)), fresh.respond(Sample.of(x)))
    np.testing.assert_array_equal(kept.respond(Sample.of(x)), before)


@pytest.mark.parametrize('shape', [(8, 8), (9, 7), (6, 11)])
def test_the_peak_says_how_far_the_target_moved(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(5)
    x = rng.standard_normal((4, *shape))
    filter_ = CorrelationFilter(gaussian_labels(shape, 0.8))
    filter_.learn(Sample.of(x))
    for move in [(0, 0), (2, -3), (-2, 2), (1, 1)]:
        found = peak(filter_.respond(Sample.of(shifted(x, move))))
        assert (found.row, found.col) == move
        assert found.value == pytest.approx(1.0, abs=0.01)


def test_the_fine_peak_lies_between_cells() -> None:
    rows, cols = np.mgrid[0:15, 0:12].astype(float)
    response = np.exp(-0.5 * ((rows - 4.3) ** 2 + (cols - 6.8 + 3) ** 2) / 4)
    found = peak(response)
    assert (found.row, found.col) == (4, 4)
    assert found.fine_row == pytest.approx(4.3, abs=0.02)
    assert found.fine_col == pytest.approx(3.8, abs=0.02)


def test_a_flat_response_stays_where_it_is() -> None:
    assert peak(np.zeros((5, 6))) == (0, 0, 0.0, 0.0, 0.0)


def test_labels_and_window() -> None:
    for shape in [(6, 9), (5, 4)]:
        labels = gaussian_labels(shape, 1.5)
        assert labels[0, 0] == 1.0
        assert labels[1, 0] == labels[-1, 0] == pytest.approx(np.exp(-0.5 / 1.5**2))
        window = cosine_window(shape)
        assert window.dtype == np.float32
        assert window[0].max() == window[:, -1].max() == 0
    np.testing.assert_allclose(cosine_window((5, 3))[:, 1], [0, 0.5, 1, 0.5, 0], atol=1e-7)


def test_misuse_is_refused() -> None:
    labels = gaussian_labels((4, 4), 1.0)
    with pytest.raises(ValueError, match='unknown kernel'):
        CorrelationFilter(labels, kernel='cubic')
    with pytest.raises(ValueError, match='learned nothing'):
        CorrelationFilter(labels).respond(Sample.of(np.zeros((1, 4, 4))))
