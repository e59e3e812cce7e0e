# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One picture of the page: what it shows, in words, as an equation, and where it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from rgbd_kcf_tracker.evaluation import plot_style
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box

Array = npt.NDArray[Any]

SEEN, GIVEN, OTHER = plot_style.PALETTE[0], plot_style.PALETTE[1], plot_style.PALETTE[4]
"""Colours of what the tracker found, what it was given, and what it looked at besides."""
_MOST_MESH = 100
"""Cells of a surface drawn in perspective; of larger ones the highest of some neighbours."""

SIGNS = {
    'F': (r'F^{-1}', 'the inverse Fourier transform: from frequencies back to places'),
    'hat': (r'\hat{x}', 'the Fourier transform of x, so its share of each frequency'),
    'star': (r'\hat{x}^*', 'the same with the sign of its imaginary part turned'),
    'times': (r'\odot', 'entry by entry multiplied'),
    'x': ('x', 'the features that the filter has learned'),
    'z': ('z', 'the features of the window that is looked at'),
    'k': (r'k^{xz}', 'the likeness of z, at every shift, to x: 0 to 1, 1 is the same'),
    'alpha': (r'\hat{\alpha}', "the filter's coefficients, one for each frequency"),
    'f': ('f(z)', 'the response: the answer for each shift of the window'),
}
"""Signs that more than one equation has."""


def signs(*names: str | tuple[str, str]) -> tuple[tuple[str, str], ...]:
    """Signs by their names in :data:`SIGNS`, others as they are."""
    return tuple(SIGNS[name] if isinstance(name, str) else name for name in names)


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture and what is said of it.

    Attributes:
        figure: of the thesis, such as '2.9'; empty for what the thesis does not show.
        name: of the PNG file, without suffix.
        title: a few words.
        words: two sentences that say what is seen.
        equation: in mathtext, without dollars; empty where there is none.
        functions: that computed it, as :func:`~rgbd_kcf_tracker.view.watch.name_of` writes them.
        png: the picture.
        values: the arrays and numbers shown, by name.
        signs: each sign of the equation, in mathtext, and what it stands for.
    """

    figure: str
    name: str
    title: str
    words: str
    equation: str
    functions: tuple[str, ...]
    png: bytes = field(repr=False)
    values: Mapping[str, Any] = field(repr=False)
    signs: tuple[tuple[str, str], ...] = ()


def rgb(frame: Frame) -> Array:
    """The colour image as matplotlib takes it, ``(H, W, 3)`` uint8 RGB."""
    return frame.color[:, :, ::-1]


def show_image(axes: Axes, image: Array, title: str, **options: Any) -> None:
    """An image in its own pixels, without axes."""
    axes.imshow(image, **options)
    axes.set_title(title, fontsize=9)
    axes.set_xticks([])
    axes.set_yticks([])


def show_heat(
    axes: Axes,
    values: Array,
    title: str,
    label: str,
    *,
    low: float | None = None,
    high: float | None = None,
    extent: tuple[float, float, float, float] | None = None,
) -> None:
    """Values as brightness with a labelled bar; grey where there is none."""
    axes.set_facecolor(plot_style.NOTHING)
    shown = np.ma.masked_invalid(values)
    drawn = axes.imshow(
        shown,
        cmap=plot_style.HEAT,
        vmin=low,
        vmax=high,
        extent=extent,
        interpolation='nearest',
        aspect='equal',
    )
    figure = axes.figure
    assert isinstance(figure, Figure)
    bar = figure.colorbar(drawn, ax=axes, shrink=0.85)
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=7)
    axes.set_title(title, fontsize=9)
    axes.tick_params(labelsize=7)
    width, height = np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())
    # The labels of a narrow picture would run into each other.
    for axis, most in ((axes.xaxis, 3 if width < height / 2 else 6), (axes.yaxis, 6)):
        axis.set_major_locator(MaxNLocator(most, integer=True))


def show_mesh(
    figure: Figure, place: tuple[int, int, int], values: Array, title: str, label: str,
    *, low: float | None = None, high: float | None = None, axes_label: str = 'cells',
) -> None:  # fmt: skip
    """Values as a surface over the plane, as the thesis draws them; y grows downwards."""
    axes: Any = figure.add_subplot(*place, projection='3d')
    step = max(1, int(np.ceil(max(values.shape) / _MOST_MESH)))
    whole = np.nan_to_num(np.asarray(values, float))
    edges = [range(0, side, step) for side in whole.shape]
    thin = np.maximum.reduceat(np.maximum.reduceat(whole, edges[0], axis=0), edges[1], axis=1)
    rows, cols = thin.shape
    y, x = np.mgrid[:rows, :cols] * step
    top = high if high is not None else float(max(thin.max(), 1e-6))
    base = low if low is not None else float(min(thin.min(), 0.0))
    axes.plot_surface(
        x, y, thin, cmap=plot_style.HEAT, vmin=base, vmax=top, rstride=1, cstride=1,
        linewidth=0.15, edgecolor='#33333355', antialiased=True,
    )  # fmt: skip
    axes.set_zlim(base, top)
    axes.invert_yaxis()
    axes.view_init(elev=32, azim=-60)
    axes.set_xlabel(f'x ({axes_label})', fontsize=8)
    axes.set_ylabel(f'y ({axes_label})', fontsize=8)
    axes.set_zlabel(label, fontsize=8, rotation=90, labelpad=8)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=7)
    axes.set_title(title, fontsize=9)
    axes.set_box_aspect(None, zoom=0.85)


def draw_box(axes: Axes, box: Box, color: str, label: str = '', style: str = '-') -> None:
    """The outline of a box with a dark rim, so that it shows on any ground."""
    for width, edge in ((3.4, 'black'), (1.8, color)):
        axes.add_patch(
            Rectangle(
                (box.x - 0.5, box.y - 0.5), box.width, box.height, fill=False, lw=width,
                ec=edge, ls=style, label=label if edge == color else None,
            )
        )  # fmt: skip


def legend(axes: Axes) -> None:
    """A legend under the axes, where it covers nothing."""
    axes.legend(fontsize=8, frameon=False, loc='upper center', bbox_to_anchor=(0.5, -0.02), ncols=3)


def centred(response: Array) -> Array:
    """A response, ``(..., rows, cols)``, with no shift in the middle, as the thesis draws it."""
    return np.fft.fftshift(response, axes=(-2, -1))


def around(axes: Axes, frame: Frame, box: Box, factor: float = 2.0) -> None:
    """Show only what lies about a box."""
    wide = box.scaled(factor)
    axes.set_xlim(max(wide.x, 0) - 0.5, min(wide.right, frame.width) - 0.5)
    axes.set_ylim(min(wide.bottom, frame.height) - 0.5, max(wide.y, 0) - 0.5)
