# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""KCF with a depth-first occlusion test and a particle filter (thesis chapter 5).

Algorithm 2: the depth at the target's centre is looked at first. While it is the target's,
particles with a colour likelihood and the correlation filter locate it together; once it is not,
there is no box, nothing is learned, and the particles carry on with the target's velocity until the
filter responds at one of the places that they suggest. ``docs/thesis.md`` maps the algorithm's
steps to the methods below and says what was decided where the thesis is silent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import parameter
from rgbd_kcf_tracker.thesis.at_once import batches
from rgbd_kcf_tracker.thesis.color_histogram import ColorHistogram, bhattacharyya_distance
from rgbd_kcf_tracker.thesis.depth_aware import DepthAwareTracker, DepthParameters
from rgbd_kcf_tracker.thesis.kcf import Detection, KcfModel
from rgbd_kcf_tracker.thesis.particle_filter import (
    HEIGHT,
    WIDTH,
    ParticleFilter,
    ProcessNoise,
    X,
    Y,
    normal_likelihood,
)

_THESIS = 'thesis Algorithm 2'

# A region that looks nothing like the target says nothing of where a hidden one is: likelihoods do
# not fall below that of this colour distance.
_UNLIKE = 0.7
# Share of the particles thrown anywhere in each frame while the target is lost.
_SCATTER = 0.5
# Standard deviation of a position that the filter found, in target widths.
_FOUND_SIGMA = 0.15
# Seconds of walking by which a target found again may have changed its depth unseen.
_UNSEEN_S = 0.15


@dataclass(frozen=True)
class RgbdPfParameters(DepthParameters):
    """Parameters of the ``rgbd_pf`` variant."""

    accept_threshold: float = parameter(
        0.6,
        "Response at the particles' estimate above which it is the target's position.",
        minimum=0.0,
        maximum=1.0,
        source=_THESIS,
    )
    hold_threshold: float = parameter(
        0.3,
        'Response below which the position of the last frame is held.',
        minimum=0.0,
        maximum=1.0,
        source=_THESIS,
    )
    reacquire_threshold: float = parameter(
        0.4,
        'Response above which a hidden target is found again where the depth is its own.',
        minimum=0.0,
        maximum=1.0,
        source='between 0.3 and 0.6 of thesis Algorithm 2',
    )
    particles: int = parameter(200, 'Number of particles.', minimum=10, maximum=20000)
    color_bins: int = parameter(
        8, 'Bins per colour channel of the histogram.', minimum=2, maximum=32
    )
    color_sigma: float = parameter(
        0.2,
        'Standard deviation of the colour distance in the likelihood.',
        minimum=0.01,
        maximum=2.0,
    )
    position_noise: float = parameter(
        0.3,
        'Random walk of the position, in target widths.',
        unit='1/sqrt(s)',
        minimum=0.0,
        maximum=20.0,
    )
    velocity_noise: float = parameter(
        2.0,
        'Random walk of the velocity, in target widths per second.',
        unit='1/s/sqrt(s)',
        minimum=0.0,
        maximum=100.0,
    )
    size_noise: float = parameter(
        0.05,
        'Random walk of width and height, in target widths.',
        unit='1/sqrt(s)',
        minimum=0.0,
        maximum=5.0,
    )
    scale_noise: float = parameter(
        0.05,
        'Random walk of the scale rate alpha.',
        unit='1/s/sqrt(s)',
        minimum=0.0,
        maximum=5.0,
    )
    resample_below: float = parameter(
        0.5,
        'Resample when the effective sample size is below this share of the particles.',
        minimum=0.0,
        maximum=1.0,
    )
    seed: int = parameter(0, 'Seed of everything random.', minimum=0, maximum=2**31 - 1)


class RgbdPfTracker(DepthAwareTracker):
    """Algorithm 2 of the thesis."""

    def __init__(self, parameters: RgbdPfParameters) -> None:
        super().__init__(parameters, parameters.hold_threshold, parameters.accept_threshold)
        self._parameters = parameters
        self._histogram = ColorHistogram(parameters.color_bins)

    def _begin(self, frame: Frame) -> None:
        p, box = self._parameters, self._box
        self._particles = ParticleFilter(p.particles, self._noise(), np.random.default_rng(p.seed))
        self._initiate_particles(box)
        self._target_colors = self._histogram(frame.color, np.array([box.as_tuple()]))[0]

    def _noise(self) -> ProcessNoise:
        p, width = self._parameters, self._box.width
        return ProcessNoise(
            position=p.position_noise * width,
            velocity=p.velocity_noise * width,
            size=p.size_noise * width,
            alpha=p.scale_noise,
        )

    def _rescale(self, frame: Frame, model: KcfModel) -> None:
        """Carry the particles over too."""
        before = self._box
        super()._rescale(frame, model)
        self._particles.rescale(
            self._box.width / before.width, self._box.height / before.height, self._noise()
        )

    def _follow(self, frame: Frame, model: KcfModel, interval: float) -> Detection | None:
        """Steps 6 to 21 of Algorithm 2; :meth:`_see` is step 4 for the next frame."""
        self._particles.predict(interval)
        if self._hidden:
            return self._look_for_hidden(frame, model)
        here = self._expect(frame, model)
        self.response = here.response
        difference = self._diff_at_centre(frame, self._box_at(here), interval)
        if self._occlusion_status(difference, here.response):
            # Step 19: the position is kept, nothing is learned, and no box is drawn.
            self._hide()
            return None
        estimate = self._estimate(frame)
        there = self._detect_at(frame, model, [estimate])[0]
        found = self._decide(here, there)
        if found is None:
            return self._hold(frame, here.response)
        if found is there:
            difference = self._diff_at_centre(frame, self._box_at(there), interval)
        self._see(frame, model, found, difference, interval)
        self._observe(found)
        return found

    def _expect(self, frame: Frame, model: KcfModel) -> Detection:
        """Step 6: found about the position that the particles predict, or about the last one."""
        predicted = self._center_of(self._particles.estimate())
        ahead = model.detect(frame, *predicted)
        behind = model.detect(frame, self._box.cx, self._box.cy)
        return ahead if ahead.response >= behind.response else behind

    def _decide(self, here: Detection, there: Detection) -> Detection | None:
        """Steps 13 to 16: which position the responses speak for; None for that of the last frame.

        Args:
            here: found about the position expected from the last frame (pos'_i).
            there: found about the particles' estimate (pos'_pf).
        """
        p = self._parameters
        if there.response > p.accept_threshold and there.response >= here.response:
            return there
        if max(here.response, there.response) >= p.hold_threshold:
            return here
        return None

    def _hold(self, frame: Frame, response: float) -> Detection:
        """Step 16: keep the last position, start the particles there again, learn nothing."""
        self._seen_ns = frame.stamp_ns
        self._initiate_particles(self._box)
        cx, cy = self._box.cx, self._box.cy
        return Detection(cx, cy, cx, cy, response)

    def _estimate(self, frame: Frame) -> tuple[float, float]:
        """Steps 10 and 11: weigh the particles by colour; the centre of their mean."""
        self._weigh(frame)
        mean = self._particles.estimate()
        self._particles.resample(self._parameters.resample_below)
        return self._center_of(mean)

    @staticmethod
    def _center_of(state: npt.NDArray[np.float64]) -> tuple[float, float]:
        return float(state[X] + state[WIDTH] / 2), float(state[Y] + state[HEIGHT] / 2)

    def _weigh(self, frame: Frame) -> None:
        """Likelihood of each particle by the colours of its region."""
        sigma = self._parameters.color_sigma
        regions = self._particles.states[:, [X, Y, WIDTH, HEIGHT]]
        parts = batches(len(regions), self._target_colors.size)
        distance = np.concatenate(
            [
                bhattacharyya_distance(
                    self._histogram(frame.color, regions[part]), self._target_colors
                )
                for part in parts
            ]
        )
        self._particles.update(normal_likelihood(np.minimum(distance, _UNLIKE), sigma))

    def _observe(self, found: Detection) -> None:
        """Weigh the particles by the position found, so that they learn the target's velocity."""
        states = self._particles.states
        distance = np.hypot(
            states[:, X] + states[:, WIDTH] / 2 - found.cx,
            states[:, Y] + states[:, HEIGHT] / 2 - found.cy,
        )
        self._particles.update(normal_likelihood(distance, self._box.width * _FOUND_SIGMA))
        self._particles.resample(self._parameters.resample_below)

    def _look_for_hidden(self, frame: Frame, model: KcfModel) -> Detection | None:
        """Steps 10 to 19 while the target is hidden.

        The filter looks at the particles' estimate, at the likeliest particle and at the position
        that was kept. What it finds is the target if the depth there is the target's.
        """
        lost = self._hidden_s() > self._depth_parameters.lost_after
        if lost:
            self._particles.scatter(self._box, self._image_size, _SCATTER)
        self._weigh(frame)
        weights, states = self._particles.weights, self._particles.states
        heaviest = states[int(np.argmax(weights))]
        places = [self._center_of(state) for state in (self._particles.estimate(), heaviest)]
        self._particles.resample(self._parameters.resample_below)
        places.append((self._box.cx, self._box.cy))
        candidates = self._detect_at(frame, model, places)
        self.response = max(each.response for each in candidates)
        for found in sorted(candidates, key=lambda each: each.response, reverse=True):
            if self._is_target(frame, found):
                return self._found_again(frame, model, found)
        return None

    def _is_target(self, frame: Frame, found: Detection) -> bool:
        """Whether what the filter found is the hidden target come out again."""
        if found.response < self._parameters.reacquire_threshold:
            return False
        if not self._plausible(frame, found):
            return False
        if found.response >= self._parameters.accept_threshold:
            return True
        if frame.depth is None or self._depth_patch.depth is None:
            return found.response >= (self._low + self._high) / 2
        difference = self._diff_at_centre(frame, self._box_at(found), _UNSEEN_S)
        return not self._occlusion_status(difference, found.response)

    def _found_again(self, frame: Frame, model: KcfModel, found: Detection) -> Detection:
        self._see(frame, model, found, None, 0.0)
        self._initiate_particles(self._box)
        return found

    def _detect_at(
        self, frame: Frame, model: KcfModel, places: list[tuple[float, float]]
    ) -> list[Detection]:
        """Step 12: what the filter, or the first template, finds about each of some centres."""
        found = []
        for cx, cy in places:
            sample = model.sample(frame, cx, cy)
            response = np.maximum(model.filter.respond(sample), model.first.respond(sample))
            found.append(model.place(response, cx, cy))
        return found

    def _initiate_particles(self, box: Box) -> None:
        """Step 10: particles about a position, in any direction at a walk."""
        p = self._parameters
        self._particles.initialise(box, 0.1 * box.width, p.velocity_noise * box.width / 2)
