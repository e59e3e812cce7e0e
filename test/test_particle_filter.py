# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

from __future__ import annotations

import numpy as np
import pytest

from rgbd_kcf_tracker import Box
from rgbd_kcf_tracker.features.sampling import effective_size, systematic_resample
from rgbd_kcf_tracker.thesis.color_histogram import (
    ColorHistogram,
    bhattacharyya_distance,
    epanechnikov,
)
from rgbd_kcf_tracker.thesis.particle_filter import (
    ALPHA,
    HEIGHT,
    VX,
    VY,
    WIDTH,
    ParticleFilter,
    ProcessNoise,
    X,
    Y,
    normal_likelihood,
)

STILL = ProcessNoise(0, 0, 0, 0)


def cloud(count: int, noise: ProcessNoise, seed: int = 0) -> ParticleFilter:
    return ParticleFilter(count, noise, np.random.default_rng(seed))


def test_a_linear_gaussian_case_agrees_with_the_kalman_filter() -> None:
    noise = ProcessNoise(position=3.0, velocity=8.0, size=0, alpha=0)
    first_position, first_velocity, sigma, dt = 5.0, 10.0, 4.0, 0.2
    particles = cloud(40000, noise)
    particles.initialise(Box(0, 0, 20, 20), first_position, first_velocity)
    mean = np.zeros(2)
    covariance = np.diag([first_position**2, first_velocity**2])
    move = np.array([[1, dt], [0, 1]])
    process = np.diag([noise.position**2 * dt, noise.velocity**2 * dt])
    seen = np.array([[1.0, 0.0]])
    rng = np.random.default_rng(7)
    for step in range(1, 16):
        measured = 12 * step * dt + rng.normal(0, sigma)
        mean = move @ mean
        covariance = move @ covariance @ move.T + process
        gain = covariance @ seen.T / (seen @ covariance @ seen.T + sigma**2)
        mean = mean + gain[:, 0] * (measured - mean[0])
        covariance = (np.eye(2) - gain @ seen) @ covariance

        particles.predict(dt)
        particles.update(normal_likelihood(particles.states[:, X] - measured, sigma))
        estimate = particles.estimate()
        spread = np.sqrt(particles.weights @ (particles.states[:, X] - estimate[X]) ** 2)
        assert estimate[X] == pytest.approx(mean[0], abs=0.25)
        assert estimate[VX] == pytest.approx(mean[1], abs=0.7)
        assert spread == pytest.approx(np.sqrt(covariance[0, 0]), rel=0.08)
        particles.resample(0.5)
    assert estimate[VX] == pytest.approx(12, abs=4)


def test_the_prediction_model_without_noise() -> None:
    particles = cloud(3, STILL)
    particles.initialise(Box(10, 20, 30, 60), 0, 0)
    particles.states[:, [VX, VY, ALPHA]] = (8, -4, 0.5)
    particles.predict(0.5)
    state = particles.estimate()
    # Half a second at alpha = 0.5: a quarter larger about the moved centre.
    assert state[[WIDTH, HEIGHT]] == pytest.approx([37.5, 75])
    assert state[X] + state[WIDTH] / 2 == pytest.approx(25 + 4)
    assert state[Y] + state[HEIGHT] / 2 == pytest.approx(50 - 2)
    assert state[[VX, VY, ALPHA]] == pytest.approx([8, -4, 0.5])


@pytest.mark.parametrize('hz', [5, 15, 30])
def test_noise_does_not_depend_on_the_rate(hz: int) -> None:
    particles = cloud(20000, ProcessNoise(position=6, velocity=20, size=2, alpha=0.1))
    particles.initialise(Box(0, 0, 1000, 1000), 0, 0)
    for _ in range(2 * hz):
        particles.predict(1 / hz)
    assert particles.states[:, VX].std() == pytest.approx(20 * np.sqrt(2), rel=0.03)
    # A random walk and the integral of another: sigma^2 t + sigma_v^2 t^3 / 3.
    expected = np.sqrt(6**2 * 2 + 20**2 * 2**3 / 3)
    center = particles.states[:, X] + particles.states[:, WIDTH] / 2
    assert center.std() == pytest.approx(expected, rel=0.1)
    assert particles.states[:, ALPHA].std() == pytest.approx(0.1 * np.sqrt(2), rel=0.03)


def test_weights_are_products_of_likelihoods() -> None:
    particles = cloud(3, STILL)
    particles.update(np.array([1.0, 2.0, 1.0]))
    particles.update(np.array([0.0, 3.0, 2.0]))
    assert particles.weights == pytest.approx([0, 0.75, 0.25])
    particles.update(np.zeros(3))
    assert particles.weights == pytest.approx([0, 0.75, 0.25])
    particles.states[:, X] = (100, 4, 8)
    assert particles.estimate()[X] == pytest.approx(5)


def test_the_likelihood_is_the_normal_density() -> None:
    sigma = 0.3
    assert normal_likelihood(np.array([0.0]), sigma)[0] == pytest.approx(
        1 / np.sqrt(2 * np.pi * sigma**2)
    )
    ratio = normal_likelihood(np.array([sigma, 0.0]), sigma)
    assert ratio[0] / ratio[1] == pytest.approx(np.exp(-0.5))
    grid = np.linspace(-3, 3, 20001)
    assert normal_likelihood(grid, sigma).sum() * (grid[1] - grid[0]) == pytest.approx(1)


def test_effective_size() -> None:
    assert effective_size(np.full(50, 1 / 50)) == pytest.approx(50)
    assert effective_size(np.array([1.0, 0, 0])) == 1
    assert effective_size(np.array([0.5, 0.5, 0, 0])) == 2


def test_systematic_resampling_is_unbiased_and_even() -> None:
    rng = np.random.default_rng(3)
    weights = rng.random(40) ** 3
    weights /= weights.sum()
    runs = 4000
    counts = np.zeros((runs, 40))
    for run in range(runs):
        counts[run] = np.bincount(systematic_resample(weights, rng), minlength=40)
    assert (counts.sum(axis=1) == 40).all()
    # Each count is the floor or the ceiling of its expectation, and that on average.
    assert (np.abs(counts - 40 * weights) < 1).all()
    np.testing.assert_allclose(counts.mean(axis=0), 40 * weights, atol=0.04)


def test_resampling_keeps_the_mean_and_happens_only_when_needed() -> None:
    particles = cloud(5000, STILL)
    particles.initialise(Box(0, 0, 10, 10), 30, 10)
    assert not particles.resample(0.5)
    particles.update(normal_likelihood(particles.states[:, X] - 40, 6))
    before = particles.estimate()
    assert particles.resample(0.5)
    assert effective_size(particles.weights) == pytest.approx(5000)
    assert particles.estimate()[X] == pytest.approx(before[X], abs=0.2)


def test_scatter_reaches_the_whole_image() -> None:
    particles = cloud(2000, STILL)
    particles.initialise(Box(0, 0, 20, 40), 0, 0)
    particles.scatter(Box(0, 0, 20, 40), (640, 480), 0.5)
    thrown = (particles.states[:, [X, Y]] != 0).any(axis=1)
    assert np.count_nonzero(thrown) == 1000
    center = particles.states[thrown][:, [X, Y]] + (10, 20)
    assert center.min() >= 0
    assert (center.max(axis=0) > (600, 450)).all()
    # Any of them: resampled in order, the first half were those that had just found the target.
    assert 400 < np.count_nonzero(thrown[:1000]) < 600


def test_the_same_seed_gives_the_same_particles() -> None:
    runs = []
    for _ in range(2):
        particles = cloud(50, ProcessNoise(1, 2, 3, 0.1), seed=5)
        particles.initialise(Box(0, 0, 9, 9), 2, 3)
        particles.predict(0.1)
        runs.append(particles.states.copy())
    np.testing.assert_array_equal(runs[0], runs[1])


def test_the_epanechnikov_profile() -> None:
    r = np.array([0.0, 0.5, 0.999, 1.0, 2.0])
    assert epanechnikov(r) == pytest.approx([1, 0.75, 0.001999, 0, 0])


def test_bhattacharyya_is_small_for_what_is_alike() -> None:
    p = np.array([[0.5, 0.5, 0], [1, 0, 0], [0, 0, 1]])
    distance = bhattacharyya_distance(p, p[0])
    assert distance[0] == pytest.approx(0, abs=1e-7)
    assert distance[1] == pytest.approx(np.sqrt(1 - np.sqrt(0.5)))
    assert distance[2] == pytest.approx(1)


def test_histograms_of_many_regions() -> None:
    color = np.zeros((100, 200, 3), np.uint8)
    color[:, :100] = (255, 0, 0)
    color[:, 100:] = (0, 255, 0)
    histogram = ColorHistogram(4)
    regions = np.array([[10, 10, 40, 60], [110, 10, 40, 60], [80, 10, 40, 60], [-20, 10, 40, 60]])
    found = histogram(color, regions)
    assert found.shape == (4, 64)
    blue, green = 3 * 16, 3 * 4
    assert found[0, blue] == pytest.approx(1)
    assert found[1, green] == pytest.approx(1)
    assert found[2, [blue, green]] == pytest.approx([0.5, 0.5])
    # What lies outside the image counts for no colour.
    assert found[3].sum() == pytest.approx(0.5)
    np.testing.assert_array_equal(histogram(color, regions[1:2])[0], found[1])


def test_the_middle_of_a_region_counts_most() -> None:
    color = np.zeros((80, 80, 3), np.uint8)
    color[20:60, 20:60] = 255
    found = ColorHistogram(2)(color, np.array([[0, 0, 80, 80]]))[0]
    # The middle quarter of the area carries well over a quarter of the weight.
    assert found[-1] > 0.45
