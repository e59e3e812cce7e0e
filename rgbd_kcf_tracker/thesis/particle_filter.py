# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The particle filter over the thesis's state ``{x, y, vx, vy, Hx, Hy, alpha}`` (section 5.3.1).

Particles are propagated by a constant-velocity model with random noise, weighted by a normal
likelihood, resampled when few of them carry the weight, and averaged. The thesis counts in frames;
here velocities and noise are per second, so that the camera's rate makes no difference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.features.sampling import effective_size, systematic_resample
from rgbd_kcf_tracker.geometry import Box

Float = npt.NDArray[np.floating[Any]]

X, Y, VX, VY, WIDTH, HEIGHT, ALPHA = range(7)
STATE_SIZE = 7


def normal_likelihood(distance: Float, sigma: float) -> Float:
    """Density of the normal distribution at a distance: large where the distance is small."""
    density: Float = np.exp(-0.5 * (distance / sigma) ** 2) / (np.sqrt(2 * np.pi) * sigma)
    return density


@dataclass(frozen=True, slots=True)
class ProcessNoise:
    """Standard deviations of the random walks, per square root of a second (Sigma_R).

    Attributes:
        position: pixels.
        velocity: pixels per second.
        size: pixels.
        alpha: scale rate, per second.
    """

    position: float
    velocity: float
    size: float
    alpha: float


class ParticleFilter:
    """A cloud of particles and their weights.

    Args:
        count: number of particles.
        noise: of the prediction.
        rng: of everything random.

    Attributes:
        states: ``(count, 7)``.
        weights: ``(count,)``, summing to 1.
    """

    def __init__(self, count: int, noise: ProcessNoise, rng: np.random.Generator) -> None:
        self._noise = noise
        self._rng = rng
        self.states = np.zeros((count, STATE_SIZE))
        self.weights = np.full(count, 1 / count)

    def initialise(self, box: Box, position: float, velocity: float) -> None:
        """Start around a box with equal weights.

        Args:
            box: of the target.
            position: standard deviation of the corner, pixels.
            velocity: standard deviation of the velocity, pixels per second.
        """
        count = len(self.states)
        self.states[:] = (box.x, box.y, 0, 0, box.width, box.height, 0)
        self.states[:, [X, Y]] += self._rng.normal(0, position, (count, 2))
        self.states[:, [VX, VY]] += self._rng.normal(0, velocity, (count, 2))
        self.weights[:] = 1 / count

    def scatter(self, box: Box, image: tuple[int, int], share: float) -> None:
        """Throw a share of the particles anywhere in the image (figure 5.1), standing still.

        Args:
            box: whose size they take.
            image: width and height.
            share: of the particles, 0 to 1.
        """
        count = round(share * len(self.states))
        corner = self._rng.random((count, 2)) * image - (box.width / 2, box.height / 2)
        # Any: resampling leaves the offspring of what was thrown last time beside each other.
        thrown = self._rng.choice(len(self.states), count, replace=False)
        self.states[thrown] = 0
        self.states[thrown[:, None], [X, Y]] = corner
        self.states[thrown[:, None], [WIDTH, HEIGHT]] = box.width, box.height
        self.weights[:] = 1 / len(self.weights)

    def rescale(self, across: float, down: float, noise: ProcessNoise) -> None:
        """See the same scene in an image whose sides are that many times as long."""
        self.states[:, [X, VX, WIDTH]] *= across
        self.states[:, [Y, VY, HEIGHT]] *= down
        self._noise = noise

    def predict(self, interval: float) -> None:
        """Propagate every particle by the prediction model.

        Args:
            interval: seconds.
        """
        s, n = self.states, self._noise
        walk = np.sqrt(interval)
        random = self._rng.standard_normal((len(s), STATE_SIZE)) * walk
        s[:, [X, Y]] += s[:, [VX, VY]] * interval + random[:, [X, Y]] * n.position
        s[:, [VX, VY]] += random[:, [VX, VY]] * n.velocity
        growth = 1 + s[:, [ALPHA]] * interval
        # The box grows about its centre: the state's corner moves with it.
        before = s[:, [WIDTH, HEIGHT]].copy()
        after = np.maximum(before * growth + random[:, [WIDTH, HEIGHT]] * n.size, 2.0)
        s[:, [WIDTH, HEIGHT]] = after
        s[:, [X, Y]] -= (after - before) / 2
        s[:, ALPHA] += random[:, ALPHA] * n.alpha

    def update(self, likelihood: Float) -> None:
        """Multiply the weights by each particle's likelihood and normalise them.

        Where no particle is likely at all, the observation says nothing and weights stay.
        """
        weights = self.weights * likelihood
        total = weights.sum()
        if np.isfinite(total) and total > 0:
            self.weights = weights / total

    def resample(self, below: float) -> bool:
        """Resample where the effective size has dropped below a share of the particles.

        Returns:
            Whether it was done.
        """
        if effective_size(self.weights) >= below * len(self.weights):
            return False
        self.states = self.states[systematic_resample(self.weights, self._rng)]
        self.weights = np.full(len(self.weights), 1 / len(self.weights))
        return True

    def estimate(self) -> npt.NDArray[np.float64]:
        """Weighted mean of the states, ``(7,)`` (the posterior state s_E)."""
        mean: npt.NDArray[np.float64] = self.weights @ self.states
        return mean
