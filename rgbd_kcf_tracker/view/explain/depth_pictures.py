# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Depth and re-detection step by step: the thesis's figures 4.2 to 4.5 and 4.8 to 4.11."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.evaluation import plot_style
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.thesis import centre_patch, depth_patch, sliding_window
from rgbd_kcf_tracker.thesis.correlation import CorrelationFilter
from rgbd_kcf_tracker.thesis.depth_aware import DepthAwareTracker
from rgbd_kcf_tracker.thesis.depth_patch import DepthDifference, DepthPatch
from rgbd_kcf_tracker.thesis.rgbd import RgbdParameters, RgbdTracker
from rgbd_kcf_tracker.track import TrackState
from rgbd_kcf_tracker.view.explain.filter_pictures import GAUSSIAN_SIGNS
from rgbd_kcf_tracker.view.explain.moments import DepthMoments, Moment
from rgbd_kcf_tracker.view.explain.picture import (
    GIVEN,
    OTHER,
    SEEN,
    Array,
    Picture,
    centred,
    draw_box,
    legend,
    rgb,
    show_heat,
    show_image,
    show_mesh,
    signs,
)
from rgbd_kcf_tracker.view.watch import Call, name_of

_DEFAULTS = RgbdParameters()
_DIFFERENCE = name_of(DepthPatch.diff_at_centre)
_SEARCH = name_of(RgbdTracker._search)
_PATCH = name_of(centre_patch.centre_patch)


def depth_pictures(moments: DepthMoments) -> list[Picture]:
    """The pictures of chapter 4, as far as the recording has what they show."""
    pictures: list[Picture] = []
    compared = _compared(moments.seen)
    if compared is not None and moments.seen is not None:
        pictures.append(_patches(moments.seen, compared))
        adjusted = moments.adjusted or moments.seen
        pictures.append(_adjusting(adjusted, _compared(adjusted) or compared))
        pictures.append(_difference(moments.seen, compared, '4.4', 'without'))
    hiding = _compared(moments.hiding)
    if hiding is not None and moments.hiding is not None:
        pictures.append(_difference(moments.hiding, hiding, '4.5', 'with'))
    if moments.seen is not None:
        pictures.append(_search_space(moments.seen, moments.hidden))
        pictures.append(_correlations(moments.seen))
    shown = [
        (word, moment)
        for word, moment in (
            ('visible', moments.seen),
            ('partly hidden', moments.partly),
            ('hidden', moments.hidden),
        )
        if moment is not None and moment.of(_SEARCH)
    ]
    if shown:
        pictures.append(_responses(shown))
    if moments.readings:
        pictures.append(_over_time(moments))
    return pictures


def _compared(moment: Moment | None) -> Call | None:
    """The comparison of depths that decided in a frame: the last that came to a result."""
    if moment is None:
        return None
    calls = [call for call in moment.of(_DIFFERENCE) if call.value is not None]
    return calls[-1] if calls else None


def that_gave(calls: Sequence[Call], image: npt.NDArray[Any]) -> Call:
    """The last of some calls that returned an image; the first of all where none did."""
    same = (call for call in calls[::-1] if np.array_equal(call.value, image, equal_nan=True))
    return next(same, calls[0])


def _patches(moment: Moment, call: Call) -> Picture:
    depth = moment.frame.depth
    assert depth is not None
    remembered, patch = call.given['self']['_patch'], call.given['patch']
    cut = that_gave(moment.of(_PATCH), patch)
    box, share = cut.given['box'], cut.given['share']
    low, high = _range(remembered, patch)
    figure = plot_style.figure(9.5, 6.4)
    axes = figure.subplots(2, 2, height_ratios=(1, 1.1))
    show_image(axes[0, 0], rgb(moment.frame), f'frame {moment.number}')
    show_heat(axes[0, 1], np.where(depth > 0, depth, np.nan), 'depth', 'depth (m)')
    for one in axes[0]:
        draw_box(one, box, SEEN, 'target')
        middle = Box.from_center(box.cx, box.cy, box.width * share, box.height * share)
        draw_box(one, middle, GIVEN, 'centre patch')
        one.set_xticks([])
        one.set_yticks([])
    legend(axes[0, 0])
    show_heat(axes[1, 0], remembered, 'centre patch, remembered', 'depth (m)', low=low, high=high)
    show_heat(axes[1, 1], patch, 'centre patch, new', 'depth (m)', low=low, high=high)
    for one in axes[1]:
        one.set(xlabel='x (samples)', ylabel='y (samples)')
    return Picture(
        '4.2', 'centre_patch', 'The depth about the centre of the target',
        f'Only the middle of the box is looked at ({100 * share:.0f} % of its width and height), '
        'because at its edges there is background: below at the left this patch of the last frame '
        'that surely showed the target, at the right of this frame, both on '
        f'{patch.shape[1]} x {patch.shape[0]} samples, whatever the size of the box. Light grey '
        'means no reading, or in the remembered one: not the target.',
        '', (_PATCH, name_of(DepthPatch.remember)), plot_style.png(figure),
        {'remembered': remembered, 'patch': patch, 'box': box.as_tuple()},
    )  # fmt: skip


def _range(*patches: Array) -> tuple[float, float]:
    values = np.concatenate([p[np.isfinite(p)].ravel() for p in patches])
    if not values.size:
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    return low, max(high, low + 0.01)


_DIFFERENCE_SIGNS = signs(
    ('D', 'the difference at each sample, in metres'),
    ('d', "the new patch's depth there"),
    ('r', "the remembered patch's"),
    ('m', 'how far the target has come or gone by itself since, in metres'),
    ('c', f'{_DEFAULTS.depth_cap:g} m: no sample counts for more'),
)


def _adjusting(moment: Moment, call: Call) -> Picture:
    size, result = call.found['size'], call.value
    figure = plot_style.figure(9.5, 4.2)
    high = max(float(size.max()), 0.05)
    show_mesh(
        figure, (1, 2, 1), size, f'frame {moment.number}, before adjusting', 'difference (m)',
        low=0, high=high, axes_label='samples',
    )  # fmt: skip
    show_mesh(
        figure, (1, 2, 2), size[result.rows, result.cols],
        f'after: {_cut(size, result)}', 'difference (m)',
        low=0, high=high, axes_label='samples',
    )  # fmt: skip
    return Picture(
        '4.3', 'adjusting', 'The patch adjusts itself',
        f'The difference of the two patches, here of frame {moment.number}, where most had to be '
        'cut: where the target has shifted in its box, background stands at the edge like a wall. '
        f'Edge columns and rows that differ by more than {_DEFAULTS.trim_above:g} m on average '
        f'are cut away, {100 * _DEFAULTS.most_trim:.0f} % of the patch at most at each edge.',
        r'D = \min\left(\vert d - (r + m)\vert,\ c\right)',
        (_DIFFERENCE, name_of(depth_patch.trim)), plot_style.png(figure),
        {'before': size, 'after': size[result.rows, result.cols]}, _DIFFERENCE_SIGNS,
    )  # fmt: skip


def _cut(size: Array, result: DepthDifference) -> str:
    rows = size.shape[0] - (result.rows.stop - result.rows.start)
    cols = size.shape[1] - (result.cols.stop - result.cols.start)
    return f'{rows} rows and {cols} columns cut away'


def _difference(moment: Moment, call: Call, number: str, word: str) -> Picture:
    result, size = call.value, call.found['size']
    remembered, patch = call.given['self']['_patch'], call.given['patch']
    left = size[result.rows, result.cols]
    low, high = _range(remembered, patch)
    figure = plot_style.figure(9.8, 3.9)
    for place, values, title in (
        (1, remembered, 'remembered'),
        (2, patch, f'frame {moment.number}'),
    ):
        axes = figure.add_subplot(1, 3, place)
        show_heat(axes, values, title, 'depth (m)', low=low, high=high)
        axes.set(xlabel='x (samples)', ylabel='y (samples)')
    show_mesh(
        figure, (1, 3, 3), left, f'difference: {result.value:.3f} m', '(m)',
        low=0, high=0.5, axes_label='samples',
    )  # fmt: skip
    hidden = moment.track.state is not TrackState.TRACKING
    threshold = _DEFAULTS.depth_threshold
    what = (
        f'After adjusting, a difference of {result.value:.3f} m is left on average, of which '
        f'{abs(result.nearer):.3f} m is nearer than the target was; the threshold is '
        f'{threshold:g} m.'
    )
    verdict = 'What is left is flat: nothing has come in front, and the target counts as seen.'
    if not hidden and (result.nearer >= threshold or result.farther > _DEFAULTS.gone_share):
        verdict = 'By its depth it would be hidden, but the response says that it is the target.'
    elif not hidden and result.value >= threshold:
        verdict = (
            'What is left lies farther away, which hides nothing: nothing has come in front, and '
            'the target counts as seen.'
        )
    elif hidden and result.nearer >= threshold:
        verdict = (
            'The difference reaches the middle of the patch, which no cutting at the edges '
            'removes: something has come in front, and there is no box.'
        )
    elif hidden:
        verdict = (
            f'{100 * result.farther:.0f} % of the patch shows something farther away than the '
            'target: it is not there any more, and there is no box.'
        )
    return Picture(
        number, f'difference_{word}', f'The difference {word} an occluder',
        f'{what} {verdict}', r'D_{\mathrm{diff}} = \mathrm{mean}\ D',
        (_DIFFERENCE, name_of(DepthAwareTracker._occlusion_status)), plot_style.png(figure),
        {
            'remembered': remembered, 'patch': patch, 'difference': left,
            'D_diff': result.value, 'nearer': result.nearer,
        },
        signs(
            (
                r'D_{\mathrm{diff}}',
                'the mean difference, in metres; what of it is nearer hides a target that was '
                'seen, and all of it keeps a hidden one hidden',
            ),
            ('D', 'the difference at each sample, as in the adjusting above, where both patches '
             'have a reading and nothing was cut away'),
        ),
    )  # fmt: skip


def _reach(moment: Moment) -> tuple[Box, Array, float]:
    """The box looked about, the centres of all windows, and the span, in one frame."""
    search = moment.of(_SEARCH)[0]
    box = search.given['self']['_box']
    span = moment.of(name_of(sliding_window.search_span))[0].value
    return box, search.found['cx'], span


def _search_space(moment: Moment, hidden: Moment | None) -> Picture:
    shown = [moment] if hidden is None else [moment, hidden]
    figure = plot_style.figure(9.5, 3.6 if len(shown) > 1 else 5.0)
    values: dict[str, Any] = {}
    for index, one in enumerate(shown):
        axes = figure.add_subplot(1, len(shown), index + 1)
        box, centres, span = _reach(one)
        show_image(
            axes, rgb(one.frame), f'frame {one.number}, {one.track.state.value}: '
            f'{len(centres)} windows, ±{span:.0f} px',
        )  # fmt: skip
        space = Box.from_corners(
            box.cx - span - box.width / 2, box.y, box.cx + span + box.width / 2, box.bottom
        ).clipped(one.frame.width, one.frame.height)
        if space is not None:
            draw_box(axes, space, OTHER, 'search space', '--')
        draw_box(axes, box, SEEN, 'last position')
        axes.plot(centres, np.full(len(centres), box.cy), '|', color='white', ms=12, mew=3)
        axes.plot(
            centres, np.full(len(centres), box.cy), '|', color=GIVEN, ms=12, mew=1.5,
            label='middles of windows',
        )  # fmt: skip
        axes.set_xlim(-0.5, one.frame.width - 0.5)
        axes.set_ylim(one.frame.height - 0.5, -0.5)
        legend(axes)
        values[f'centres_{one.number}'] = centres
        values[f'span_{one.number}'] = span
    return Picture(
        '4.8, 4.9', 'search_space', 'The search space',
        'The window slides along the horizontal, because people do not fly; how far grows with the '
        "target's width, so that a near target is not lost and a far one costs no more. While it "
        'is hidden (occluded) the space grows with every moment, until the whole image is '
        'searched.',
        r'\mathrm{span} = (s + \lceil v\,t \rceil) \cdot w',
        (name_of(sliding_window.search_span), _SEARCH), plot_style.png(figure), values,
        signs(
            (r'\mathrm{span}', 'how far the window slides to either side, in pixels'),
            ('s', f'{_DEFAULTS.search_span:g}: target widths while it is seen'),
            ('v', f'{_DEFAULTS.search_speed:g}: target widths more for each second hidden'),
            ('t', 'seconds for which it has been hidden'), ('w', "the target's width in pixels"),
            (r'\lceil\ \rceil', 'rounded up'),
        ),
    )  # fmt: skip


def _kernels(moment: Moment) -> Array:
    """``(n, rows, cols)``: how alike each window is to what was learned, at all shifts."""
    stacks = [c.value for c in moment.of('thesis.correlation:_gaussian') if c.value.ndim == 3]
    # Each batch of windows is asked of the filter that goes on learning, then of the first.
    kernels: Array = np.concatenate(stacks[::2])
    return kernels


def _correlations(moment: Moment) -> Picture:
    search = moment.of(_SEARCH)[0]
    kernels = _kernels(moment)
    index = search.found['index']
    kernel = kernels[index]
    figure = plot_style.figure(9.5, 4.2)
    show_mesh(
        figure, (1, 2, 1), centred(kernel), 'the best of all windows', 'kernel',
        low=float(kernel.min()),
    )  # fmt: skip
    axes = figure.add_subplot(1, 2, 2)
    best = kernels.max(axis=(1, 2))
    axes.plot(search.found['cx'], best, 'o-', color=SEEN, ms=4)
    axes.plot(search.found['cx'][index], best[index], 's', color=GIVEN, ms=8, label='the best')
    axes.set(xlabel='centre of the window (px)', ylabel='highest kernel value')
    axes.legend(fontsize=8, frameon=False)
    plot_style.tidy(axes)
    return Picture(
        '4.10', 'correlations', 'Correlation with every patch of the search space',
        'The features of every window are compared with those learned, many windows at once. '
        'At the right the highest likeness of each window, at the left that of the best one at all '
        'its shifts.',
        r'k^{xz} = \exp\left(-\frac{1}{\sigma^2 N}\left(\Vert x\Vert^2 + \Vert z\Vert^2'
        r' - 2F^{-1}(\hat{x}^* \odot \hat{z})\right)\right)',
        ('thesis.correlation:_gaussian', _SEARCH), plot_style.png(figure),
        {'kernel': kernel, 'best': best}, signs(*GAUSSIAN_SIGNS),
    )  # fmt: skip


def _responses(shown: list[tuple[str, Moment]]) -> Picture:
    figure = plot_style.figure(3.3 * len(shown), 5.6)
    values: dict[str, Any] = {}
    peaks: list[float] = []
    for index, (word, moment) in enumerate(shown):
        search = moment.of(_SEARCH)[0]
        response = search.found['response']
        best = search.value[0]
        axes = figure.add_subplot(2, len(shown), index + 1)
        show_image(axes, rgb(moment.frame), f'{word}: frame {moment.number}')
        if moment.track.box is not None:
            draw_box(axes, moment.track.box, SEEN)
        looked = Box.from_center(
            best.cx, best.cy, search.given['self']['_box'].width,
            search.given['self']['_box'].height,
        )  # fmt: skip
        draw_box(axes, looked, OTHER, style='--')
        show_mesh(
            figure, (2, len(shown), len(shown) + index + 1), centred(response),
            f'highest response {best.response:.2f}', 'response', low=min(0.0, response.min()),
            high=1.0,
        )  # fmt: skip
        values[f'response_{word.replace(" ", "_")}'] = response
        peaks.append(round(float(best.response), 2))  # as it is shown
    words = ', '.join(
        f'{peak:.2f} when {word}' for peak, (word, _) in zip(peaks, shown, strict=True)
    )
    return Picture(
        '4.11', 'responses', 'The response of a target that is visible, partly hidden, and hidden',
        f'The highest response is {words}{_of_the_hills(peaks)}. '
        'The dashed box is where the best patch lies; above '
        f'{_DEFAULTS.detect_threshold:g} it is the target whatever the depth says, below that '
        'the depth is asked.',
        r'f(z) = F^{-1}(\hat{k}^{xz} \odot \hat{\alpha})',
        (name_of(CorrelationFilter.respond), _SEARCH), plot_style.png(figure), values,
        signs(
            ('f(z)', 'the response; the higher of what two filters say: the one that goes on '
             'learning, and the one of the first frame'),
            'F', (r'\hat{k}^{xz}', 'the Fourier transform of the likeness at every shift'), 'times',
            'alpha',
        ),
    )  # fmt: skip


def _of_the_hills(peaks: list[float]) -> str:
    """What the heights tell of how much is hidden, the least hidden first."""
    if len(peaks) < 2:
        return ''
    if all(a > b for a, b in itertools.pairwise(peaks)):
        return ': the more is hidden, the lower the hill'
    return ': here the height of the hill does not say how much is hidden'


def _over_time(moments: DepthMoments) -> Picture:
    numbers = np.array([r[0] for r in moments.readings])
    states = np.array([r[1] for r in moments.readings])
    response = np.array([r[2] for r in moments.readings])
    difference = np.array([r[3] for r in moments.readings])
    figure = plot_style.figure(9.5, 4.0)
    top, low = figure.subplots(2, 1, sharex=True)
    top.plot(numbers, response, color=SEEN, lw=1.5, label='response')
    again = (_DEFAULTS.detect_threshold + _DEFAULTS.hidden_response) / 2
    for level, style, words in (
        (_DEFAULTS.detect_threshold, '--', 'the target'),
        (again, ':', 'the target again, by depth'),
    ):  # fmt: skip
        top.axhline(level, color='#555555', lw=1, ls=style, label=f'above {level:g}: {words}')
    top.legend(fontsize=8, frameon=False, loc='upper right', ncols=3)
    top.set(ylabel='response', ylim=(0, max(1.0, float(response.max()) * 1.05)))
    low.plot(numbers, difference, color=GIVEN, lw=1.5, label='depth difference')
    low.axhline(
        _DEFAULTS.depth_threshold, color='#555555', lw=1, ls='--',
        label=f'nearer by {_DEFAULTS.depth_threshold:g} m: hidden',
    )  # fmt: skip
    low.legend(fontsize=8, frameon=False, loc='upper left', ncols=2)
    low.set(ylabel='D_diff (m)', xlabel='frame')
    for axes in (top, low):
        plot_style.tidy(axes)
        for start, stop in _spells(states != TrackState.TRACKING.value):
            axes.axvspan(numbers[start] - 0.5, numbers[stop - 1] + 0.5, color='#c9ccd1', lw=0)
        for moment, mark in ((moments.seen, 'v'), (moments.partly, 's'), (moments.hidden, 'x')):
            if moment is not None:
                row = int(np.searchsorted(numbers, moment.number))
                ys = response if axes is top else difference
                if row < len(ys) and math.isfinite(ys[row]):
                    axes.plot(numbers[row], ys[row], mark, color='black', ms=7)
    return Picture(
        '', 'over_time', 'Response and depth over time',
        'The two readings that Algorithm 1 decides by, with their thresholds; grey is where the '
        'target counted as hidden, and it is taken back only where both say so, or the response '
        f'is high. The difference never goes beyond {_DEFAULTS.depth_cap:g} m, for which each '
        'sample counts at most; the marks are the frames shown above: visible (triangle), partly '
        'hidden (square), hidden (cross).',
        '', (_SEARCH, _DIFFERENCE), plot_style.png(figure),
        {'frames': numbers, 'response': response, 'D_diff': difference},
    )  # fmt: skip


def _spells(mask: Array) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
