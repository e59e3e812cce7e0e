# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How every plot of the package looks: colours, axes, and the bytes of the picture.

Lines are told apart by colour and, where there are many, by their marker; surfaces use one map
whose lightness grows with the value, so that a print in grey still says the same.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

# Okabe and Ito's colours, which people with any colour vision can tell apart.
PALETTE = (
    '#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00',
    '#56B4E9', '#7F3C8D', '#444444', '#A5AA99',
)  # fmt: skip
HEAT = 'cividis'
"""Colour map of values: dark is low and bright is high, also in grey and to any colour vision."""
NOTHING = '#d8dbe0'
"""Where there is no value, as no depth."""
DPI = 110


def colors(names: Sequence[str]) -> dict[str, str]:
    """One colour per name, the same in every plot."""
    return {name: PALETTE[i % len(PALETTE)] for i, name in enumerate(names)}


# Solid first; each further line also by its dashes, so that a print in grey tells them apart.
_DASHES = ('-', '--', '-.', ':', (0, (6, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 3)), (0, (3, 3)))
_MARKERS = 'osD^vPX*'


def strokes(names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """How to draw the line of each name: colour and dashes, as keywords of ``plot``."""
    return {
        name: {'color': PALETTE[i % len(PALETTE)], 'ls': _DASHES[i % len(_DASHES)]}
        for i, name in enumerate(names)
    }


def markers(names: Sequence[str]) -> dict[str, str]:
    """The marker of each name, for dots without a line."""
    return {name: _MARKERS[i % len(_MARKERS)] for i, name in enumerate(names)}


def figure(width: float, height: float) -> Figure:
    """An empty figure, sides in inches, on which nothing is clipped."""
    made = Figure(figsize=(width, height), layout='constrained')
    FigureCanvasAgg(made)
    return made


def tidy(axes: Axes) -> None:
    """Quiet axes: no frame at the top and right, a light grid behind the data."""
    axes.spines[['top', 'right']].set_visible(False)
    axes.grid(color='#e3e5e8', lw=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8)


def png(made: Figure, dpi: int = DPI) -> bytes:
    """The figure as a PNG file."""
    buffer = io.BytesIO()
    made.set_dpi(dpi)
    # Lays out and draws; savefig draws once more before.
    FigureCanvasAgg(made).print_png(buffer)  # type: ignore[no-untyped-call]
    return buffer.getvalue()
