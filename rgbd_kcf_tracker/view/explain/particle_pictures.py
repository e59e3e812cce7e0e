# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The particle filter step by step: the thesis's figures 5.1, 5.2 and D.1."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rgbd_kcf_tracker.evaluation import plot_style
from rgbd_kcf_tracker.features.sampling import systematic_resample
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.thesis import rgbd_pf
from rgbd_kcf_tracker.thesis.color_histogram import ColorHistogram, bhattacharyya_distance
from rgbd_kcf_tracker.thesis.particle_filter import (
    HEIGHT,
    WIDTH,
    ParticleFilter,
    X,
    Y,
    normal_likelihood,
)
from rgbd_kcf_tracker.thesis.rgbd_pf import RgbdPfParameters
from rgbd_kcf_tracker.view.explain.moments import Moment, ParticleMoments
from rgbd_kcf_tracker.view.explain.picture import (
    GIVEN,
    SEEN,
    Array,
    Picture,
    around,
    draw_box,
    legend,
    rgb,
    show_image,
    signs,
)
from rgbd_kcf_tracker.view.watch import Call, name_of

_CHANNELS = (('blue', '#0072B2', '-'), ('green', '#009E73', '--'), ('red', '#D55E00', ':'))


def particle_pictures(moments: ParticleMoments) -> list[Picture]:
    """The pictures of chapter 5."""
    pictures = [_initial(moments.first)]
    asked = moments.asked
    if asked.of(name_of(ParticleFilter.update)):
        pictures.append(_steps(asked))
    pictures.append(_histogram(moments))
    return pictures


def _scatter_plot(axes: Axes, states: Array, weights: Array | None = None) -> None:
    x = states[:, X] + states[:, WIDTH] / 2
    y = states[:, Y] + states[:, HEIGHT] / 2
    share = np.full(len(x), 0.2) if weights is None else weights / weights.max()
    axes.scatter(
        x, y, s=2 + 24 * share, c=GIVEN, lw=0.3, edgecolors='white', alpha=0.8, label='particles'
    )


def _box(state: Array) -> Box:
    return Box(*(float(state[i]) for i in (X, Y, WIDTH, HEIGHT)))


def _initial(first: Moment) -> Picture:
    call = first.of(name_of(ParticleFilter.initialise))[0]
    states = call.found['self']['states']
    box = call.given['box']
    figure = plot_style.figure(9.5, 3.8)
    axes = figure.subplots(1, 2, width_ratios=(1.7, 1))
    for one, title in ((axes[0], f'frame {first.number}'), (axes[1], 'about the target')):
        show_image(one, rgb(first.frame), title)
        _scatter_plot(one, states)
        draw_box(one, box, SEEN, 'target')
    axes[0].set_xlim(-0.5, first.frame.width - 0.5)
    axes[0].set_ylim(first.frame.height - 0.5, -0.5)
    around(axes[1], first.frame, box, 1.6)
    legend(axes[0])
    return Picture(
        '5.1', 'particles_first', 'Particles at the start',
        f'{len(states)} particles, each a guess at place, velocity, size and growth of the '
        'target, all of equal weight; a dot is the middle of one guess. They start about the given '
        'box, and start there again wherever a hidden target is found.',
        r's = \{x, y, \dot{x}, \dot{y}, H_x, H_y, \alpha\}',
        (name_of(ParticleFilter.initialise),), plot_style.png(figure),
        {'states': states, 'box': box.as_tuple()},
        signs(
            ('s', 'a particle'), ('x,\\ y', 'its place: the corner of its box, pixels'),
            (r'\dot{x},\ \dot{y}', 'its velocity, pixels a second'),
            ('H_x,\\ H_y', 'width and height of its box, pixels'),
            (r'\alpha', 'by how much its box grows each second'),
        ),
    )  # fmt: skip


def _steps(asked: Moment) -> Picture:
    spread = asked.of(name_of(ParticleFilter.predict))[0].found['self']
    weighed = asked.of(name_of(ParticleFilter.update))[0]
    weights = weighed.found['self']['weights']
    estimates = asked.of(name_of(ParticleFilter.estimate))
    estimate = _after(estimates, weighed)
    resampled = next(
        (c for c in asked.of(name_of(ParticleFilter.resample)) if c.value),
        asked.of(name_of(ParticleFilter.resample))[-1],
    )
    after = resampled.found['self']['states']
    mean = _box(weights @ spread['states'] if estimate is None else estimate.value)
    figure = plot_style.figure(9.8, 4.2)
    axes = figure.subplots(1, 3)
    for one, title, states, shown in (
        (axes[0], 'spread by the prediction', spread['states'], None),
        (axes[1], 'weighted by colour', spread['states'], weights),
        (axes[2], 'resampled' if resampled.value else 'not resampled: still diverse', after, None),
    ):
        show_image(one, rgb(asked.frame), f'frame {asked.number}: {title}')
        _scatter_plot(one, states, shown)
        if one is axes[1]:
            draw_box(one, mean, SEEN, 'their estimate')
            legend(one)
        around(one, asked.frame, _cloud(spread['states']), 1.5)
    return Picture(
        '5.2', 'particles_steps', 'Spread, weighted, resampled',
        'Each particle moves on by its own velocity and some chance; then it is the heavier (the '
        'larger dot), the more the colours in its box are those of the target. The weighted mean '
        'is the estimate (box), and when few particles carry nearly all the weight (an effective '
        f'number below {100 * RgbdPfParameters().resample_below:.0f} %) the light ones are '
        'replaced by copies of the heavy ones.',
        r'w_i \propto w_i \cdot \frac{1}{\sqrt{2\pi}\,\sigma}\exp\left(-\frac{d_i^2}{2\sigma^2}'
        r'\right),\quad s_E = \sum_i w_i s_i',
        tuple(
            name_of(f)
            for f in (
                ParticleFilter.predict, ParticleFilter.update, normal_likelihood,
                ParticleFilter.estimate, systematic_resample,
            )
        ),
        plot_style.png(figure),
        {
            'spread': spread['states'], 'weights': weights, 'resampled': after,
            'estimate': mean.as_tuple(),
        },
        signs(
            ('w_i', 'the weight of particle i; all together are 1'),
            (r'\propto', 'but for a factor, which makes them so'),
            (
                'd_i',
                "how unlike the colours in its box are to the target's (see the next picture), at "
                f'most {rgbd_pf._UNLIKE:g}',
            ),
            (r'\sigma', f'{RgbdPfParameters().color_sigma:g}: how fast weight falls off with that'),
            ('s_i', 'the particle'), ('s_E', 'the estimate: the weighted mean'),
        ),
    )  # fmt: skip


def _after(estimates: list[Call], weighed: Call) -> Call | None:
    """The estimate that was made of these weights."""
    weights = weighed.found['self']['weights']
    return next((e for e in estimates if np.array_equal(e.given['self']['weights'], weights)), None)


def _cloud(states: Array) -> Box:
    left, top = states[:, X].min(), states[:, Y].min()
    right = (states[:, X] + states[:, WIDTH]).max()
    bottom = (states[:, Y] + states[:, HEIGHT]).max()
    return Box.from_corners(float(left), float(top), float(right), float(bottom))


def _histogram(moments: ParticleMoments) -> Picture:
    histogram = name_of(ColorHistogram.__call__)
    target = moments.first.of(histogram)[0].value[0]
    bins = round(len(target) ** (1 / 3))
    shown: list[tuple[str, Array]] = [('the target', target)]
    values: dict[str, Any] = {'target': target}
    words = ''
    distances = moments.asked.of(name_of(bhattacharyya_distance))
    every = moments.asked.of(histogram)
    if distances and every:
        # A batch of particles a call.
        d, p = (np.concatenate([call.value for call in calls]) for calls in (distances, every))
        nearest, farthest = int(np.argmin(d)), int(np.argmax(d))
        shown.append((f'most alike particle, d = {d[nearest]:.2f}', p[nearest]))
        shown.append((f'least alike particle, d = {d[farthest]:.2f}', p[farthest]))
        values |= {'distance': d, 'histograms': p}
        words = (
            ' Beside it the particle whose box is the most alike in colours, and the least alike: '
            f'the distances are {d[nearest]:.2f} and {d[farthest]:.2f}.'
        )
    figure = plot_style.figure(9.5, 3.2)
    axes = figure.subplots(1, 3, sharey=True)
    edges = np.arange(bins + 1) * 256 / bins
    top = 0.0
    for one, (title, values_of) in zip(axes, shown, strict=False):
        cube = values_of.reshape(bins, bins, bins)
        for axis, (name, color, style) in enumerate(_CHANNELS):
            others = tuple(i for i in range(3) if i != axis)
            marginal = cube.sum(axis=others)
            top = max(top, float(marginal.max()))
            one.stairs(marginal, edges, color=color, ls=style, lw=1.8, label=name)
        one.set(xlabel='channel value (0 to 255)', title=title)
        one.title.set_fontsize(9)
        plot_style.tidy(one)
    for one in axes[len(shown) :]:
        one.set_visible(False)
    axes[0].set_ylabel('share of the pixels')
    axes[0].set_ylim(0, top * 1.1)
    axes[0].legend(fontsize=8, frameon=False)
    return Picture(
        'D.1', 'histogram', 'Colour histograms',
        'How many of the pixels fall into each bin of colour, those in the middle of the box '
        f'counting more; {bins} bins a channel, {bins**3} in all, drawn by channel.{words}',
        r'd(p, q) = \sqrt{1 - \sum_u \sqrt{p_u q_u}}',
        (histogram, name_of(bhattacharyya_distance)), plot_style.png(figure), values,
        signs(
            ('d', 'the Bhattacharyya distance: 0 for the same colours, 1 for none in common'),
            ('p,\\ q', 'two histograms: shares of the pixels'), ('u', 'a bin of colour'),
        ),
    )  # fmt: skip
