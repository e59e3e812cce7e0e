# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The site made of these pages: ``make docs``, strict, without a request to any other host."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import rgbd_kcf_tracker

ROOT = Path(__file__).resolve().parent.parent

project = 'rgbd_kcf_tracker'
author = 'The rgbd_kcf_tracker authors'
copyright = '2026, The rgbd_kcf_tracker authors'
release = version = rgbd_kcf_tracker.__version__

extensions = ['myst_parser', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon', 'sphinx.ext.viewcode']
myst_heading_anchors = 3
napoleon_numpy_docstring = False
napoleon_use_ivar = True
autodoc_member_order = 'bysource'
autodoc_typehints = 'signature'
autodoc_typehints_format = 'short'

html_theme = 'furo'
html_title = 'rgbd_kcf_tracker'
html_static_path: list[str] = []
html_show_sphinx = False
exclude_patterns = ['_build']
# Pages are rendered from Markdown as it lies here; nothing is fetched.
html_theme_options = {'source_edit_link': '', 'top_of_page_buttons': []}

_OUTSIDE = re.compile(r'\[([^\]]+)\]\(\.\./([^)#\s]+)(#[^)]*)?\)')


def _name_files(app: Any, page: str, source: list[str]) -> None:
    """Turn links to files of the checkout, which the site does not hold, into their names."""

    def named(match: re.Match[str]) -> str:
        words, path = match[1], match[2]
        if not (ROOT / path).exists():
            raise FileNotFoundError(f'docs/{page}.md links to {path}, which is not there')
        return f'{words} (`{path}`)' if words.strip('`') != path else f'`{path}`'

    source[0] = _OUTSIDE.sub(named, source[0])


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect('source-read', _name_files)
