# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Digests of many recordings at once, read where they are quickest to read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rgbd_kcf_tracker.batch.content import MISSING, files_digest
from rgbd_kcf_tracker.batch.loop import run_all
from rgbd_kcf_tracker.batch.workers import Given, Workers


def digests(
    content: Mapping[str, tuple[Path, ...]],
    workers: Workers | None = None,
    report: Callable[[str], None] = lambda name: None,
) -> dict[str, str]:
    """Digests of what is in files and folders, by name.

    Args:
        content: files and folders by name.
        workers: those of many machines read faster than one; None for threads of this process,
            which wait for the disk and not for each other.
        report: is told each name that was read through.
    """
    if workers is None:
        with ThreadPoolExecutor(thread_name_prefix='digest') as pool:
            return digests(content, Given(pool), report)
    found = {}
    for done in run_all(_digest, content.items(), workers):
        name = done.item[0]
        found[name] = done.result or MISSING
        report(name)
    return found


def _digest(item: tuple[str, tuple[Path, ...]]) -> str:
    return files_digest(item[1])
