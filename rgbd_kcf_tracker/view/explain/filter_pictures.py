# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The correlation filter step by step: the thesis's figures 2.1 to 2.5 and 2.8 to 2.16."""

from __future__ import annotations

from typing import Any

import numpy as np

from rgbd_kcf_tracker.evaluation import plot_style
from rgbd_kcf_tracker.features.hog import CELL_SIZE, HogExtractor
from rgbd_kcf_tracker.features.labels import gaussian_labels
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.thesis import correlation, window
from rgbd_kcf_tracker.thesis.correlation import CorrelationFilter, linear_correlation
from rgbd_kcf_tracker.thesis.kcf import KcfModel, KcfParameters, KcfTracker, WindowGeometry
from rgbd_kcf_tracker.view.explain.circulant import (
    block_circulant,
    circulant,
    permutation,
    samples,
)
from rgbd_kcf_tracker.view.explain.moments import GAUSSIAN, FilterMoments, Moment
from rgbd_kcf_tracker.view.explain.picture import (
    GIVEN,
    OTHER,
    SEEN,
    Array,
    Picture,
    around,
    centred,
    draw_box,
    legend,
    rgb,
    show_heat,
    show_image,
    show_mesh,
    signs,
)
from rgbd_kcf_tracker.view.watch import Function, name_of

_SHORT = 8
_PATCH = 30
_CELLS = 7
GAUSSIAN_SIGNS: tuple[str | tuple[str, str], ...] = (
    'k', 'x', 'z', (r'\Vert x\Vert^2', 'the sum of the squares of its numbers'),
    (r'\sigma', f'{KcfParameters().kernel_sigma:g}: how fast likeness falls off with difference'),
    ('N', 'how many numbers x has: features times cells'),
    'hat', 'star', 'times', 'F',
)  # fmt: skip
"""Of the equation of the Gaussian kernel."""
_GRAY = {'cmap': 'gray', 'vmin': 0, 'vmax': 255}


def filter_pictures(moments: FilterMoments) -> list[Picture]:
    """The pictures of chapter 2."""
    first, asked = moments.first, moments.asked
    pictures = [
        *_preparing(moments),
        *_circulants(first),
        _labels(first),
        _features(first, '2.11', 'features', 'Features of the target'),
        _training(first),
        _trained_position(moments),
    ]
    if asked.number == first.number:
        return pictures
    return [*pictures, *_detecting(moments)]


def _calls(moment: Moment, function: Function) -> list[Any]:
    return moment.of(name_of(function))


def _named(*functions: Function) -> tuple[str, ...]:
    return tuple(name_of(function) for function in functions)


def _window_box(moments: FilterMoments, cx: float, cy: float) -> Box:
    width, height = moments.geometry.source
    return Box.from_center(cx, cy, width, height)


def _preparing(moments: FilterMoments) -> list[Picture]:
    first, box = moments.first, moments.box
    gray = _calls(first, window.gray_window)[0].value
    around_target = _window_box(moments, box.cx, box.cy)
    figure = plot_style.figure(9.5, 4.2)
    axes = figure.subplots(1, 2, width_ratios=(1.7, 1))
    show_image(axes[0], rgb(first.frame), f'frame {first.number}')
    draw_box(axes[0], box, GIVEN, f'target, {box.width:.0f} x {box.height:.0f} px')
    draw_box(
        axes[0], around_target, SEEN,
        f'window, {around_target.width:.0f} x {around_target.height:.0f} px', '--',
    )  # fmt: skip
    legend(axes[0])
    show_image(
        axes[1],
        gray,
        f'window as the filter sees it, {gray.shape[1]} x {gray.shape[0]} px',
        **_GRAY,
    )
    return [
        Picture(
            '2.7, 2.8, 2.10', 'window', 'Target and window',
            'The box is the target as it was given; the dashed window about it is larger by the '
            'padding, so that the filter also learns what the target is not. The window is cut '
            'out and made grey, a target of more than '
            f'{KcfParameters().halve_above:g} pixels across is halved to save time, and what lies '
            'outside the frame repeats its border.',
            r'\mathrm{window} = (1 + p) \cdot \mathrm{target}',
            _named(WindowGeometry.of, window.gray_window),
            plot_style.png(figure), {'gray': gray, 'box': box.as_tuple()},
            (('p', f'padding: {KcfParameters().padding:g} targets more, across and down'),),
        )
    ]  # fmt: skip


def _circulants(first: Moment) -> list[Picture]:
    gray = _calls(first, window.gray_window)[0].value
    hog = _calls(first, HogExtractor.__call__)[0].value
    row, col = gray.shape[0] // 2, gray.shape[1] // 2
    short = gray[row, col - _SHORT // 2 : col + _SHORT // 2].astype(int)
    side = min(_PATCH, *gray.shape)
    patch = gray[row - side // 2 : row - side // 2 + side, col - side // 2 : col - side // 2 + side]
    cells = min(_CELLS, hog.shape[1], hog.shape[2])
    top, left = (hog.shape[1] - cells) // 2, (hog.shape[2] - cells) // 2
    inner = hog[:, top : top + cells, left : left + cells]
    channel = int(np.argmax(inner[:27].std(axis=(1, 2))))
    return [
        _numbers(short),
        _line(short),
        _blocks(patch[side // 2 : side // 2 + 4, side // 2 : side // 2 + 3]),
        _shifts(
            patch, '2.4', 'block_circulant_patch', 'A patch and all its shifts',
            f'Four of the {side * side} shifts of the {side} x {side} pixels in the middle of the '
            'target, and the matrix that has every shift as one row. Blocks repeat along the '
            'diagonals, and so do the pixels within each block: the whole matrix is known from '
            'its first row.',
            'grey value', _named(window.gray_window, block_circulant),
        ),
        _shifts(
            inner[channel], '2.5', 'block_circulant_hog', 'Cells of HOG and all their shifts',
            f'The same for one of the {len(hog)} features (number {channel}: how strong the edges '
            f'of one direction are) in the {cells} x {cells} cells in the middle of the target. '
            'This is what the filter learns from: every shift of the features, each an example '
            'at no cost.',
            'feature', _named(HogExtractor.__call__, block_circulant),
        ),
    ]  # fmt: skip


def _numbers(short: Array) -> Picture:
    matrix = circulant(short)
    shift = permutation(len(short))
    figure = plot_style.figure(9.5, 4.4)
    axes = figure.subplots(1, 2)
    for one, values, title in (
        (axes[0], shift, 'permutation matrix P'),
        (axes[1], matrix, 'C(x): row u is the signal moved by u'),
    ):
        one.imshow(values, cmap=plot_style.HEAT, interpolation='nearest')
        dark = values < (values.min() + values.max()) / 2
        for (i, j), value in np.ndenumerate(values):
            one.text(
                j, i, str(value), ha='center', va='center', fontsize=8,
                color='white' if dark[i, j] else 'black',
            )  # fmt: skip
        one.set_title(title, fontsize=9)
        one.set_xticks([])
        one.set_yticks([])
    return Picture(
        '2.1', 'circulant_numbers', 'A circulant matrix in numbers',
        f'{len(short)} neighbouring grey values of the target, and below them the same values '
        'moved on one by one, what leaves at the right coming back at the left: each row is one '
        'shift. The trackers never build such a matrix, but what they compute stands for it, as '
        'the next picture shows; this page has built it from the values that they cut out.',
        r'C(x) = [\,x,\ Px,\ P^2x,\ \ldots,\ P^{n-1}x\,]^T',
        _named(window.gray_window, permutation, circulant),
        plot_style.png(figure), {'signal': short, 'matrix': matrix, 'permutation': shift},
        signs(
            ('x', f'a signal: here {len(short)} grey values, 0 is black and 255 white'),
            ('P', 'the matrix that moves a signal on by one'),
            ('C(x)', 'the circulant matrix: all shifts of the signal'),
            ('n', f'length of the signal: {len(short)}'),
            (r'[\ ]^T', 'one row for each entry'),
        ),
    )  # fmt: skip


def _line(short: Array) -> Picture:
    matrix = circulant(short).astype(float)
    by_hand = matrix @ short / len(short)
    signal = short[None, None, :].astype(float)
    by_filter = linear_correlation(signal, signal)[0]
    figure = plot_style.figure(9.5, 3.6)
    axes = figure.subplots(1, 2)
    show_heat(axes[0], matrix, 'C(x)', 'grey value')
    axes[0].set(xlabel='sample', ylabel='shift')
    places = np.arange(len(short))
    axes[1].bar(places - 0.2, by_hand, 0.4, color=SEEN, label='with the matrix: C(x) x / n')
    axes[1].bar(
        places + 0.2,
        by_filter,
        0.4,
        color=OTHER,
        hatch='//',
        label='as the filter does it, without',
    )
    axes[1].set(xlabel='shift (samples)', ylabel='correlation (grey value²)')
    axes[1].legend(fontsize=8, frameon=False, loc='upper center', bbox_to_anchor=(0.5, -0.2))
    plot_style.tidy(axes[1])
    return Picture(
        '2.2', 'circulant_signal', 'The same matrix as a picture, and why it need not be built',
        'Along each diagonal of the matrix there is one value. The matrix times a signal is the '
        'likeness (correlation) of the two at every shift, and comes out the same where their '
        'Fourier transforms are multiplied, which is much faster: the bars are pairwise equal.',
        r'\frac{1}{n}\,C(x)\,z = \frac{1}{n}\,F^{-1}(\hat{x}^* \odot \hat{z})',
        _named(circulant, linear_correlation),
        plot_style.png(figure), {'matrix': matrix, 'product': by_hand, 'correlation': by_filter},
        signs(
            ('C(x)', 'the matrix of the picture before'),
            ('x,\\ z', 'two signals; here z is x itself'), ('n', 'their length'),
            'hat', 'star', 'times', 'F',
        ),
    )  # fmt: skip


def _blocks(patch: Array) -> Picture:
    matrix = block_circulant(patch)
    figure = plot_style.figure(9.5, 4.6)
    axes = figure.subplots(1, 2, width_ratios=(1, 2.4))
    show_heat(axes[0], patch, f'{patch.shape[0]} x {patch.shape[1]} pixels', 'grey value')
    axes[0].set_xticks([])
    axes[0].set_yticks([])
    show_heat(axes[1], matrix, 'every shift, one per row', 'grey value')
    rows, cols = patch.shape
    for edge in range(1, rows):
        axes[1].axhline(edge * cols - 0.5, color='white', lw=1.2)
        axes[1].axvline(edge * cols - 0.5, color='white', lw=1.2)
    axes[1].set(xlabel='pixel', ylabel='shift')
    return Picture(
        '2.3', 'block_circulant', 'A block-circulant matrix',
        'A patch is shifted both ways, so its matrix is a circulant of blocks (between the white '
        'lines) that are circulants themselves. Each block is one row of the patch, and the '
        'blocks move on along the diagonal as the pixels within them do.',
        r'X = \left[\,C_1\ C_2 \ldots C_m\,;\ C_m\ C_1 \ldots C_{m-1}\,;\ \ldots\,\right]',
        _named(window.gray_window, block_circulant),
        plot_style.png(figure), {'patch': patch, 'matrix': matrix},
        signs(
            ('X', 'the matrix: a row for each shift of the patch'),
            ('C_1', 'the circulant matrix of the first row of the patch, and so on'),
            ('m', f'rows of the patch: {rows}'), (';', 'ends a row of blocks'),
        ),
    )  # fmt: skip


def _shifts(
    patch: Array, number: str, name: str, title: str, words: str, unit: str,
    functions: tuple[str, ...],
) -> Picture:  # fmt: skip
    matrix = block_circulant(patch)
    figure = plot_style.figure(9.5, 4.6)
    parts: Any = figure.subfigures(1, 2, width_ratios=(1, 1.25))
    left, right = parts
    low, high = float(patch.min()), float(patch.max())
    for axes, (label, shifted) in zip(left.subplots(2, 2).flat, samples(patch), strict=True):
        show_image(axes, shifted, label, cmap=plot_style.HEAT, vmin=low, vmax=high)
    axes = right.subplots()
    drawn = axes.imshow(matrix, cmap=plot_style.HEAT, interpolation='nearest')
    bar = right.colorbar(drawn, ax=axes, shrink=0.85)
    bar.set_label(unit, fontsize=8)
    bar.ax.tick_params(labelsize=7)
    axes.set_title(f'{matrix.shape[0]} shifts', fontsize=9)
    axes.set(xlabel='entry', ylabel='shift')
    axes.tick_params(labelsize=7)
    return Picture(
        number, name, title, words, r'X = C(x)', functions, plot_style.png(figure),
        {'patch': patch, 'matrix': matrix},
        signs(
            ('x', f'the {patch.shape[0]} x {patch.shape[1]} values, row after row'),
            ('C(x)', 'their block-circulant matrix, as above'), ('X', 'all that is learned from'),
        ),
    )  # fmt: skip


def _labels(first: Moment) -> Picture:
    call = _calls(first, gaussian_labels)[0]
    labels = centred(call.value)
    figure = plot_style.figure(9.5, 4.2)
    show_mesh(figure, (1, 2, 1), labels, 'from the side', 'label', low=0, high=1)
    axes = figure.add_subplot(1, 2, 2)
    show_heat(axes, labels, 'from above', 'label (1 is the target)', low=0, high=1)
    axes.set(xlabel='x (cells)', ylabel='y (cells)')
    return Picture(
        '2.9', 'labels', 'What the filter is taught to answer',
        'For every shift of the window there is a wanted answer: 1 where the target is in the '
        'middle, falling off to 0 with the distance. A filter that has learned this answers with a '
        'hill, and the top of the hill is the target.',
        r'y = \exp\left(-\frac{\Delta x^2 + \Delta y^2}{2\sigma^2}\right)',
        _named(gaussian_labels), plot_style.png(figure),
        {'labels': call.value, 'sigma': call.given['sigma']},
        signs(
            ('y', 'the wanted answer (label) for a shift'),
            (r'\Delta x,\ \Delta y', 'the shift, in cells; here 0 is drawn in the middle'),
            (r'\sigma', f'width of the hill: {call.given["sigma"]:.2f} cells'),
        ),
    )  # fmt: skip


def _features(moment: Moment, number: str, name: str, title: str) -> Picture:
    gray = _calls(moment, window.gray_window)[0].value
    sample = _calls(moment, KcfModel.sample)[0]
    hog = _calls(moment, HogExtractor.__call__)[0].value
    tapered = sample.found['features']
    taper = sample.given['self']['taper']
    sign = 'x' if name == 'features' else 'z'
    words = (
        f'Each cell of {CELL_SIZE} x {CELL_SIZE} pixels is described by {hog.shape[0]} numbers '
        'that say which way the edges in it run and how strong they are. The cosine window fades '
        'them out towards the border, where the shifts of the window wrap round; drawn is the sum '
        'of 9 of the numbers, bright where there are strong edges.'
        if name == 'features'
        else f'The window of frame {moment.number}, cut out where the target was in frame '
        f'{moment.number - 1}: it stands a little beside the middle, by as much as it has moved. '
        'Features and cosine window are made, and drawn, as for the first frame.'
    )
    # The unsigned orientations, 18 to 26: one picture of the edges, brightest where strong.
    figure = plot_style.figure(9.5, 3.4)
    axes = figure.subplots(1, 4)
    show_image(axes[0], gray, f'window of frame {moment.number}', **_GRAY)
    show_heat(axes[1], hog[18:27].sum(axis=0), 'fHOG, 9 orientations summed', 'feature')
    show_heat(axes[2], taper, 'cosine window', 'weight', low=0, high=1)
    show_heat(axes[3], tapered[18:27].sum(axis=0), 'features, windowed', 'feature')
    for one in axes[1:]:
        one.set_xticks([])
        one.set_yticks([])
    return Picture(
        number, name, title, words,
        rf"{sign} = \mathrm{{fHOG}}(\mathrm{{window}}) \odot (h\,h'^T),\quad "
        r'h_i = \frac{1}{2}(1 - \cos\frac{2\pi i}{n-1})',
        _named(HogExtractor.__call__, correlation.cosine_window, KcfModel.sample),
        plot_style.png(figure),
        {'gray': gray, 'hog': hog, 'taper': taper, 'features': tapered},
        signs(
            (sign, 'the windowed features'),
            (r'\mathrm{fHOG}', 'histograms of the directions of edges (gradients) in each cell'),
            'times',
            (r"h\,h'^T", 'the fading down times the fading across, in every cell'),
            ('h_i', 'the fading at cell i'),
            ('i', 'the cell, from 0'), ('n', 'the number of cells down, or across'),
        ),
    )  # fmt: skip


def _training(first: Moment) -> Picture:
    learned = _calls(first, CorrelationFilter.learn)[0]
    kernel, alpha = learned.found['kernel'], learned.found['alpha']
    figure = plot_style.figure(9.5, 4.2)
    show_mesh(
        figure, (1, 2, 1), centred(kernel), 'auto-correlation of the features', 'kernel',
        low=float(kernel.min()),
    )  # fmt: skip
    axes = figure.add_subplot(1, 2, 2)
    show_heat(
        axes, np.log10(np.abs(np.fft.fftshift(alpha, axes=0)) + 1e-12),
        'coefficients, by frequency', 'log10 of magnitude',
    )  # fmt: skip
    axes.set(xlabel='frequency across', ylabel='frequency down (middle is 0)')
    return Picture(
        '', 'training', 'Training',
        'At the left how alike the window is to itself at every shift (the kernel): 1 for no '
        'shift, less everywhere else. What is learned is one coefficient for each shift, such that '
        'the likenesses times the coefficients add up to the labels (kernel ridge regression); as '
        'the matrix of all likenesses is circulant, that is one division per frequency, with the '
        'result at the right (a step of 1 is ten times as much; of the frequencies across half are '
        'kept, as the others mirror them).',
        r'(C(k^{xx}) + \lambda I)\,\alpha = y,\quad '
        r'\hat{\alpha} = \frac{\hat{y}}{\hat{k}^{xx} + \lambda}',
        _named(CorrelationFilter.learn, GAUSSIAN), plot_style.png(figure),
        {'kernel': kernel, 'alpha': alpha},
        signs(
            (r'\alpha', "the filter's coefficients, one for each shift of the window"),
            (r'k^{xx}', 'the likeness of the window to itself at every shift'),
            (r'C(k^{xx})', 'its circulant matrix: how alike any two shifts are'),
            ('I', 'the identity matrix: 1 along the diagonal, else 0'),
            ('y', 'the labels: the wanted answer for each shift'),
            (r'\hat{\alpha},\ \hat{y},\ \hat{k}^{xx}', 'their Fourier transforms'),
            (
                r'\lambda',
                f'{learned.given["self"]["_regularization"]:g}: keeps the coefficients small, at '
                'the price of small errors',
            ),
        ),
    )  # fmt: skip


def _trained_position(moments: FilterMoments) -> Picture:
    first = moments.first
    box = first.track.box
    assert box is not None
    figure = plot_style.figure(6.5, 4.2)
    axes = figure.subplots()
    show_image(axes, rgb(first.frame), f'frame {first.number}: learned here')
    draw_box(axes, box, SEEN, 'target')
    legend(axes)
    return Picture(
        '2.12', 'trained', 'Where it was trained',
        f'The filter was first trained in frame {first.number}, with the target in the middle of '
        'this box. In each frame since it has looked where the target was in the frame before, '
        f'and has taken over {100 * KcfParameters().learning_rate:g} % of what it found there.',
        '', _named(KcfModel.train), plot_style.png(figure), {'box': box.as_tuple()},
    )  # fmt: skip


def _detecting(moments: FilterMoments) -> list[Picture]:
    asked = moments.asked
    kernel = _calls(asked, GAUSSIAN)[0].value
    response = _calls(asked, CorrelationFilter.respond)[0].value
    placed = _calls(asked, KcfModel.place)[0]
    found, cx, cy = placed.value, placed.given['cx'], placed.given['cy']
    box = asked.track.box
    assert box is not None
    looked = Box.from_center(cx, cy, moments.box.width, moments.box.height)

    figure = plot_style.figure(9.5, 4.2)
    show_mesh(
        figure, (1, 2, 1), centred(kernel), 'from the side', 'kernel',
        low=float(kernel.min()),
    )  # fmt: skip
    axes = figure.add_subplot(1, 2, 2)
    show_heat(axes, centred(kernel), 'from above', 'kernel')
    axes.set(xlabel='x (cells)', ylabel='y (cells)')
    cross = Picture(
        '2.14', 'cross_correlation', 'Cross-correlation with what was learned',
        'How alike the new window, at every shift, is to the features that the filter has '
        'learned: 1 would be the same picture. It is highest near the target, but only a little.',
        r'k^{xz} = \exp\left(-\frac{1}{\sigma^2 N}\left(\Vert x\Vert^2 + \Vert z\Vert^2'
        r' - 2F^{-1}(\hat{x}^* \odot \hat{z})\right)\right)',
        _named(GAUSSIAN), plot_style.png(figure), {'kernel': kernel},
        signs(*GAUSSIAN_SIGNS),
    )  # fmt: skip

    figure = plot_style.figure(9.5, 4.2)
    show_mesh(figure, (1, 2, 1), centred(response), 'from the side', 'response')
    axes = figure.add_subplot(1, 2, 2)
    rows, cols = response.shape
    across, down = moments.geometry.cell
    extent = (
        (-(cols // 2) - 0.5) * across, (cols - cols // 2 - 0.5) * across,
        (rows - rows // 2 - 0.5) * down, (-(rows // 2) - 0.5) * down,
    )  # fmt: skip
    show_heat(axes, centred(response), 'from above', 'response', extent=extent)
    axes.plot(found.fine_cx - cx, found.fine_cy - cy, '+', color='white', ms=14, mew=3)
    axes.plot(found.fine_cx - cx, found.fine_cy - cy, '+', color=GIVEN, ms=12, mew=1.6)
    axes.set(xlabel='shift to the right (px)', ylabel='shift downwards (px)')
    answer = Picture(
        '2.15', 'response', 'The response, and its peak',
        'The coefficients sharpen the cross-correlation into the hill that the labels asked for. '
        f'Its top, {found.response:.3f} (the cross), lies {found.fine_cx - cx:+.1f} px across and '
        f'{found.fine_cy - cy:+.1f} px down from where the filter looked, which is 0, 0: so far '
        'the target has moved.',
        r'f(z) = F^{-1}(\hat{k}^{xz} \odot \hat{\alpha})',
        _named(CorrelationFilter.respond, correlation.peak), plot_style.png(figure),
        {'response': response, 'peak': found.response},
        signs(
            'f', 'F', (r'\hat{k}^{xz}', 'the Fourier transform of the cross-correlation'),
            'times', 'alpha',
        ),
    )  # fmt: skip

    figure = plot_style.figure(9.5, 4.2)
    pair = figure.subplots(1, 2, width_ratios=(1.7, 1))
    show_image(pair[0], rgb(asked.frame), f'frame {asked.number}')
    show_image(pair[1], rgb(asked.frame), 'about the target')
    for one in pair:
        draw_box(one, looked, OTHER, 'looked here', '--')
        draw_box(one, box, SEEN, 'found')
    around(pair[1], asked.frame, box, 1.8)
    legend(pair[0])
    result = Picture(
        '2.16', 'found', 'The target found',
        'The dashed box is where the target was in the frame before; the full box is moved by the '
        'peak. The filter is trained again here, mixed with what it knew, and goes on to the '
        'next frame.',
        r'(u, v)_{\mathrm{new}} = (u, v) + \arg\max f(z)',
        _named(KcfModel.place, KcfTracker.update),
        plot_style.png(figure), {'box': box.as_tuple(), 'looked': looked.as_tuple()},
        signs(
            ('u,\\ v', 'middle of the box in the frame, pixels across and down'),
            (r'\arg\max', 'the shift at which the response is highest'), 'f',
        ),
    )  # fmt: skip
    patch = _features(asked, '2.13', 'new_features', 'The same window in the new frame')
    return [patch, cross, answer, result]
