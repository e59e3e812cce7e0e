# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The pictures as one self-contained page, and as files."""

from __future__ import annotations

import base64
import io
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from matplotlib import rc_context
from matplotlib.mathtext import math_to_image

import rgbd_kcf_tracker
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.outputs import OutputFolder, cannot_write
from rgbd_kcf_tracker.variants import VARIANTS
from rgbd_kcf_tracker.view.explain.picture import Picture

PAGE = 'index.html'
VALUES = 'values.npz'
_TEMPLATE = 'explain.html.j2'


@dataclass(frozen=True, slots=True)
class Chapter:
    """A part of the page: a title, an introduction, pictures; and what is missing, if anything."""

    key: str
    title: str
    words: str
    pictures: Sequence[Picture]
    missing: str = ''


def write_page(
    folder: Path, title: str, command: str, chapters: Sequence[Chapter], overwrite: bool = False
) -> list[Path]:
    """Write ``index.html``, a PNG per picture and the values shown as ``values.npz``.

    Args:
        folder: to write into.
        title: of the page.
        command: that made it, or ''.
        chapters: of the page.
        overwrite: replace the pictures of another frame that are there.

    Returns:
        The files written.

    Raises:
        RecordingError: where they cannot be written, or something is there already.
    """
    ours = (PAGE, VALUES, *(f'{name}_*.png' for name in VARIANTS))
    output = OutputFolder(folder, ours, overwrite)
    try:
        names = _write_all(output.place, render(title, command, chapters), chapters)
    except BaseException as error:
        output.end(whole=False, anything=False)
        if isinstance(error, OSError):
            raise RecordingError(cannot_write(folder, error)) from None
        raise
    output.end(whole=True, anything=True)
    return [folder / name for name in names]


def _write_all(folder: Path, page: str, chapters: Sequence[Chapter]) -> list[str]:
    names = []
    values: dict[str, Any] = {}
    for chapter in chapters:
        for picture in chapter.pictures:
            names.append(f'{chapter.key}_{picture.name}.png')
            (folder / names[-1]).write_bytes(picture.png)
            for name, value in picture.values.items():
                values[f'{chapter.key}_{picture.name}/{name}'] = np.asarray(value)
    np.savez_compressed(folder / VALUES, **values)
    (folder / PAGE).write_bytes(page.encode('utf-8', 'backslashreplace'))
    return [*names, VALUES, PAGE]


def render(title: str, command: str, chapters: Sequence[Chapter]) -> str:
    """The page as HTML, with the pictures in it."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader('rgbd_kcf_tracker.view.explain'),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters['math'] = equation
    environment.filters['png'] = _data
    environment.globals['size'] = _size
    return environment.get_template(_TEMPLATE).render(
        title=title,
        command=command,
        chapters=chapters,
        version=rgbd_kcf_tracker.__version__,
    )


def equation(mathtext: str) -> str:
    """An equation as a picture that takes the colour of the text around it."""
    buffer = io.BytesIO()
    with rc_context({'svg.fonttype': 'path', 'mathtext.fontset': 'cm', 'svg.hashsalt': mathtext}):
        math_to_image(f'${mathtext}$', buffer, format='svg', dpi=72)
    svg = buffer.getvalue().decode()
    svg = svg[svg.index('<svg') :]
    svg = re.sub(r'<metadata>.*?</metadata>', '', svg, flags=re.DOTALL)
    # The white sheet behind it goes; the glyphs take the page's colour. They lean out of it.
    svg = re.sub(r'<g id="patch_1">.*?</g>', '', svg, flags=re.DOTALL)
    return svg.replace('<svg', '<svg role="img" fill="currentColor" overflow="visible"', 1)


def _data(png: bytes) -> str:
    return 'data:image/png;base64,' + base64.b64encode(png).decode()


def _size(png: bytes) -> tuple[int, int]:
    """Width and height in pixels, from the file's first chunk."""
    width, height = struct.unpack('>II', png[16:24])
    return int(width), int(height)
