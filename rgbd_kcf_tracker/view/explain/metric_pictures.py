# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What ``metric`` sees: surfaces, silhouettes, candidates with their odds, particles from above."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rgbd_kcf_tracker.evaluation import plot_style
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.insight import COMPUTED_BY, Insight, insight_of
from rgbd_kcf_tracker.metric.decide.account import REUNION
from rgbd_kcf_tracker.metric.decide.evidence import CUE_WORDS
from rgbd_kcf_tracker.metric.identity import gallery, hidden_cloud, person
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.track import Track
from rgbd_kcf_tracker.variants import create_tracker
from rgbd_kcf_tracker.view.explain.moments import MOST_AHEAD
from rgbd_kcf_tracker.view.explain.page import Chapter
from rgbd_kcf_tracker.view.explain.picture import (
    GIVEN,
    OTHER,
    SEEN,
    Array,
    Picture,
    draw_box,
    legend,
    rgb,
    show_image,
    signs,
)
from rgbd_kcf_tracker.view.watch import name_of

_DEFAULTS = MetricParameters()
_SHOWN = 4
"""Candidates whose odds are drawn."""
_REST_S = 0.4
"""Seconds hidden after which the particles have spread."""

_Seen = tuple[int, Frame, Track, Insight]


def metric_chapter(frames: Iterable[tuple[int, Frame]], box: Box, asked: int) -> Chapter:
    """Run ``metric`` to the frame asked for, and on until the target has been hidden."""
    tracker = create_tracker('metric')
    at: _Seen | None = None
    hidden: _Seen | None = None
    hidden_since: int | None = None
    started = False
    for number, frame in frames:
        track = tracker.update(frame) if started else tracker.start(frame, box)
        started = True
        if number == asked:
            at = (number, frame, track, insight_of(tracker))
        if track.box is not None:
            hidden_since = None
        else:
            hidden_since = frame.stamp_ns if hidden_since is None else hidden_since
            insight = insight_of(tracker)
            if insight.particles is not None and (
                hidden is None or (frame.stamp_ns - hidden_since) * 1e-9 <= _REST_S
            ):
                hidden = (number, frame, track, insight)
        over = hidden is not None and track.box is not None
        if number >= asked and (over or number > asked + MOST_AHEAD):
            break
    pictures = []
    missing = ''
    if at is not None and at[3].surfaces is not None:
        pictures += [_surfaces(at), _candidates(at)]
        if at[3].gallery:
            pictures.append(_gallery(at))
    else:
        missing = 'Without depth metric follows the look alone, of which nothing is drawn here. '
    if hidden is not None:
        pictures.append(_from_above(hidden))
    elif at is not None and at[3].surfaces is not None:
        missing += 'The target is never hidden behind a surface here: no particles are needed.'
    return Chapter(
        'metric', 'Surfaces in metres (metric)',
        'The default tracker cuts the depth image into surfaces and asks of each whether it is the '
        'target. What it measures of a surface adds up to log-odds: 0 is even, +3 is 20 to 1 for '
        f'it, -3 is 20 to 1 against. The best one is taken from {_DEFAULTS.acceptance:g} of '
        f'probability on ({_DEFAULTS.recognition:g} where it was away for more than '
        f'{REUNION:g} s), and if {100 * _DEFAULTS.least_visible:.0f} % of the body or more shows; '
        'else the target is hidden: no box is given, and particles carry '
        'on where it may be, by which the place of what comes into view is then judged. Of two '
        'people the look tells who is who, as long as they look different, and the frame as a '
        'whole: everyone in view is somebody who was seen before or somebody new, nobody is '
        'two at once, and of all ways to deal out who is who the one with the highest sum of '
        'log-odds (of place, look and height) explains the frame. This speaks for a candidate '
        'that is the target in it, and against one that is somebody else (explained together). '
        'One that was first seen away from the edge of the image came from behind something, as a '
        'hidden target does. The '
        'correlation filter is asked only where depth says nothing of the target.',
        pictures, missing.strip(),
    )  # fmt: skip


def _surfaces(seen: _Seen) -> Picture:
    number, frame, _, insight = seen
    labels, depth = insight.surfaces, insight.view_depth
    assert labels is not None
    assert depth is not None
    figure = plot_style.figure(9.5, 2.3)
    axes = figure.subplots(1, 3)
    show_image(axes[0], rgb(frame), f'frame {number}')
    show_image(
        axes[1], np.where(depth > 0, depth, np.nan), 'depth (dark is near)', cmap=plot_style.HEAT
    )
    axes[1].set_facecolor(plot_style.NOTHING)
    show_image(axes[2], _tinted(labels), f'{len(np.unique(labels)) - 1} surfaces')
    return Picture(
        '', 'surfaces', 'Depth cut into surfaces',
        'Neighbouring pixels belong together where the depth between them does not jump. The floor '
        'is taken out first, so that what stands on it comes apart; white is floor or no reading, '
        'and the colours only tell neighbours apart.',
        r'\vert z_i - z_j\vert \leq j_0 + j_1 z_i', tuple(map(name_of, COMPUTED_BY['surfaces'])),
        plot_style.png(figure), {'labels': labels, 'depth': depth},
        signs(
            ('z_i,\\ z_j', 'depth of two neighbouring pixels, metres'),
            (
                'j_0,\\ j_1',
                f'the jump allowed: {_DEFAULTS.jump:g} m, and {_DEFAULTS.jump_per_metre:g} m more '
                'for each metre of distance',
            ),
        ),
    )  # fmt: skip


def _tinted(labels: Array) -> Array:
    """One grey or colour per surface, neighbours told apart also in grey."""
    count = int(labels.max()) + 1
    order = (np.arange(count) * 7919) % max(count, 1)
    shade = 0.2 + 0.65 * ((order * 0.618034) % 1.0)
    hue = (order * 0.381966) % 1.0
    colors = np.stack(
        [shade * (0.75 + 0.25 * np.cos(2 * math.pi * (hue + k / 3))) for k in range(3)], axis=1
    )
    colors[0] = 1.0
    tinted: Array = colors[labels]
    return tinted


def _candidates(seen: _Seen) -> Picture:
    number, frame, track, insight = seen
    shown = insight.considered[:_SHOWN]
    figure = plot_style.figure(*((9.5, 4.4) if shown else (5.2, 3.3)))
    axes = figure.subplots(1, 2, width_ratios=(1.2, 1)) if shown else [figure.subplots()]
    show_image(
        axes[0], rgb(frame), f'frame {number}: {_count(len(insight.considered), "candidate")}'
    )
    palette = plot_style.PALETTE
    for index, one in enumerate(shown):
        if one.mask is not None:
            _overlay(axes[0], one.mask, insight.step, palette[index % len(palette)], frame)
        draw_box(axes[0], one.box, palette[index % len(palette)], f'{index + 1}: {_percent(one)}')
    axes[0].set_xlim(-0.5, frame.width - 0.5)
    axes[0].set_ylim(frame.height - 0.5, -0.5)
    values: dict[str, Any] = {'probability': [c.probability for c in insight.considered]}
    shown_cues: list[str] = []
    if shown:
        legend(axes[0])
        names = shown_cues = [
            name for name in shown[0].cues if any(abs(c.cues[name]) > 0.005 for c in shown)
        ]
        places = np.arange(len(names))
        for index, one in enumerate(shown):
            values[f'cues_{index + 1}'] = [one.cues[name] for name in one.cues]
            axes[1].barh(
                places + 0.8 * (index - (len(shown) - 1) / 2) / len(shown),
                [one.cues[name] for name in names],
                0.8 / len(shown),
                color=palette[index % len(palette)],
                hatch=('', '//', '..', 'xx')[index % 4],
                label=f'{index + 1}: sum {sum(one.cues.values()):+.1f}',
            )
        axes[1].set_yticks(places, names)
        axes[1].invert_yaxis()
        axes[1].axvline(0, color='#444444', lw=0.8)
        axes[1].set_xlabel('log-odds that it is the target')
        axes[1].legend(
            fontsize=8, frameon=False, loc='upper center', bbox_to_anchor=(0.5, -0.14), ncols=2
        )
        plot_style.tidy(axes[1])
    if not shown:
        verdict = (
            'No box is given, and the target counts as hidden.'
            if track.box is None
            else 'The box is that of the look alone.'
        )
        return Picture(
            '', 'candidates', 'No silhouette that could be the target',
            'Every silhouette of this frame is surely somebody else or the room, so there is none '
            f'to weigh. {verdict}',
            '', tuple(map(name_of, COMPUTED_BY['considered'])), plot_style.png(figure), values,
        )  # fmt: skip
    verdict = 'nothing was taken' if track.box is None else 'the first was taken'
    return Picture(
        '', 'candidates', 'Silhouettes, and what speaks for each',
        'The silhouettes (surfaces, whole or in part, or gathered to one body) that could be the '
        'target (what is surely somebody else or the room is '
        f'not among them), with the box that each would give; {verdict}. '
        'Bars to the right speak for a candidate and bars to the left against it, and their sum '
        'is its log-odds; place and size are about 0 where they fit, and the bars of time hidden, '
        'should be in sight and to begin with are the same for all candidates, so they only say '
        'whether any is good enough.',
        r'\ln\frac{p}{1-p} = \sum_i w_i f_i', tuple(map(name_of, COMPUTED_BY['considered'])),
        plot_style.png(figure), values,
        signs(
            ('p', 'the probability that the candidate is the target'),
            (r'\ln', 'the natural logarithm; of p / (1 - p) it is the log-odds'),
            ('f_i', 'what was measured of it'),
            ('w_i', 'how much that counts, fitted once to many frames'),
            *((_in_words(name), CUE_WORDS[name]) for name in shown_cues),
        ),
    )  # fmt: skip


def _in_words(name: str) -> str:
    return r'\mathrm{' + name.replace(' ', '\\ ') + '}'


def _count(number: int, word: str) -> str:
    return f'{number} {word}' + ('' if number == 1 else 's')


def _percent(one: Any) -> str:
    return f'{100 * one.probability:.0f} %'


def _overlay(axes: Axes, mask: Array, step: int, color: str, frame: Frame) -> None:
    red, green, blue = (int(color[i : i + 2], 16) / 255 for i in (1, 3, 5))
    layer = np.zeros((*mask.shape, 4))
    layer[mask] = (red, green, blue, 0.5)
    rows, cols = mask.shape
    axes.imshow(
        layer, extent=(-0.5, cols * step - 0.5, rows * step - 0.5, -0.5), interpolation='nearest'
    )
    axes.set_xlim(-0.5, frame.width - 0.5)
    axes.set_ylim(frame.height - 0.5, -0.5)


def _gallery(seen: _Seen) -> Picture:
    number, frame, track, insight = seen
    figure = plot_style.figure(9.5, 3.2)
    axes = figure.subplots(1, 2, width_ratios=(1.7, 1))
    show_image(axes[0], rgb(frame), f'frame {number}')
    if track.box is not None:
        draw_box(axes[0], track.box, SEEN)
    nothing = (np.nan,) * 3
    stripes = np.stack([[c or nothing for c in view.colors] for view in insight.gallery], axis=1)
    slices = len(stripes)
    axes[1].set_facecolor(plot_style.NOTHING)
    axes[1].imshow(np.ma.masked_invalid(stripes).filled(0.85), interpolation='nearest')
    axes[1].set_xticks(range(len(insight.gallery)))
    axes[1].set_yticks([-0.5, slices - 0.5], ['head', 'feet'])
    axes[1].set_xlabel('view')
    axes[1].set_title('mean colour of each slice', fontsize=9)
    axes[1].set_aspect('auto')
    return Picture(
        '', 'gallery', 'The gallery by which it is known',
        'The gallery holds a few views of the target, of when it surely was seen and showed '
        'something new; of each the body is cut into slices of '
        f'{100 * gallery.SLICE:.0f} cm, and each keeps how often every colour shows in it; drawn '
        'is the mean. A candidate is compared with all views, slice by slice (what a view does not '
        'show is taken from the others), and the most alike one says how likely it is the same '
        'person (the cue "look"; everybody else in view has a gallery too).',
        r's = \max_v \sum_k a_k \sum_u \sqrt{p_{k,u}\ q^v_{k,u}}',
        (*map(name_of, COMPUTED_BY['gallery']), name_of(gallery.Compared.of_each)),
        plot_style.png(figure), {'colors': stripes},
        signs(
            (
                's',
                'the likeness: 1 for the same colours at the same heights; with one view '
                f'{gallery.EVEN:g} is even, log-odds 0',
            ),
            ('v', 'a view of the gallery'), ('k', 'a slice, from head to feet'),
            ('a_k', 'how much it counts: the more of it shows, the more colourful it is'),
            ('u', 'a colour'),
            ('p_{k,u}', "its share of the candidate's slice"),
            ('q^v_{k,u}', "its share of the view's"),
        ),
    )  # fmt: skip


def _from_above(seen: _Seen) -> Picture:
    number, frame, _, insight = seen
    particles, weights = insight.particles, insight.weights
    labels, depth = insight.surfaces, insight.view_depth
    assert particles is not None
    assert weights is not None
    assert labels is not None
    assert depth is not None
    k = frame.intrinsics or Intrinsics.guess(frame.width, frame.height)
    rows, cols = np.nonzero(labels > 0)
    z = depth[rows, cols]
    x = (cols * insight.step - k.cx) * z / k.fx
    figure = plot_style.figure(9.5, 4.4)
    axes = figure.subplots(1, 2)
    show_image(axes[0], rgb(frame), f'frame {number}: the target is hidden')
    axes[1].plot(x, z, '.', ms=1, color='#888888', label='what the camera sees')
    axes[1].scatter(
        particles[:, 0], particles[:, 2], s=1 + 10 * weights / weights.max(), c=GIVEN, lw=0,
        label='particles', zorder=3,
    )  # fmt: skip
    axes[1].plot(0, 0, '^', color=SEEN, ms=10, label='camera')
    reach = 1.1 * float(max(particles[:, 2].max(), np.quantile(z, 0.98)))
    edge = reach * (frame.width / 2) / k.fx
    axes[1].plot([-edge, 0, edge], [reach, 0, reach], '--', color=OTHER, lw=1, label='its view')
    axes[1].set(
        xlabel='x (m), to the right of the camera', ylabel='z (m), away from it',
        ylim=(-0.3, reach), xlim=(-edge, edge), aspect='equal', title='from above',
    )  # fmt: skip
    axes[1].title.set_fontsize(9)
    plot_style.tidy(axes[1])
    axes[1].legend(
        fontsize=8, frameon=False, loc='upper center', bbox_to_anchor=(0.5, -0.16), ncols=2,
        markerscale=1.5,
    )  # fmt: skip
    return Picture(
        '', 'particles_above', 'Where a hidden target may be, from above',
        'Particles go on in metres with the velocity that the target had, and spread with time. '
        'Where the camera sees past a particle nobody stands, so it fades: what is left lies '
        'behind something.',
        r'w_i \propto w_i\,e^{-t/\tau}\ \ \mathrm{where}\ \ z > z_i + m',
        tuple(map(name_of, COMPUTED_BY['particles'])),
        plot_style.png(figure), {'particles': particles, 'weights': weights},
        signs(
            ('w_i', 'the weight of particle i; all together are 1'),
            (r'\propto', 'but for a factor, which makes them so'),
            ('t', 'seconds since the frame before'),
            (r'\tau', f'{hidden_cloud.EMPTY_TIME:g} s, in which a weight falls to a third'),
            ('z', 'depth that the camera measures where the particle would be seen, metres'),
            ('z_i', "the particle's own"),
            ('m', f'{person.BEYOND:g} m, to be sure'), ('e', '2.718…'),
        ),
    )  # fmt: skip
