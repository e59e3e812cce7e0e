# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Libraries that a robot does without, and what to install where one is missing."""

from __future__ import annotations

from importlib import import_module

from rgbd_kcf_tracker.errors import MissingExtraError

EXTRAS: dict[str, tuple[tuple[str, ...], str]] = {
    'batch': (('threadpoolctl',), 'python3-threadpoolctl'),
    'report': (
        ('matplotlib', 'jinja2', 'threadpoolctl'),
        'python3-matplotlib python3-jinja2 python3-threadpoolctl',
    ),
    'cluster': (('distributed', 'threadpoolctl'), 'python3-distributed python3-threadpoolctl'),
    'parquet': (('pyarrow',), ''),
    'video': (('imageio_ffmpeg',), 'ffmpeg'),
    'view': (('aiohttp',), 'python3-aiohttp'),
    'tools': (('tqdm', 'psutil'), 'python3-tqdm python3-psutil'),
}
"""Extras of the installation: their modules, and Ubuntu's packages with the same, if any."""


def require(extra: str, purpose: str) -> None:
    """Make sure that the libraries of an extra are there and fit the others that are installed.

    Args:
        extra: its name.
        purpose: what needs it, as the message begins.

    Raises:
        MissingExtraError: saying what to install.
    """
    missing = []
    for name in EXTRAS[extra][0]:
        try:
            import_module(name)
        except ModuleNotFoundError:
            missing.append(name)
        except ImportError as error:  # as of a pyarrow that wants another NumPy
            raise MissingExtraError(
                f'{purpose}: {name} cannot be imported ({error}): {how_to_get(extra)}'
            ) from None
    if missing:
        raise MissingExtraError(f'{purpose} needs {", ".join(missing)}: {how_to_get(extra)}')


def how_to_get(extra: str) -> str:
    """What to type to install an extra."""
    packages = EXTRAS[extra][1]
    ubuntu = f', or on Ubuntu: sudo apt install {packages}' if packages else ''
    return f"pip install 'rgbd_kcf_tracker[{extra}]'{ubuntu}"
