# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A run as one HTML file that plays by itself: to send to somebody who has nothing installed."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import Parameters
from rgbd_kcf_tracker.recordings import Recording
from rgbd_kcf_tracker.recordings.outputs import write_file
from rgbd_kcf_tracker.view.player import Player
from rgbd_kcf_tracker.view.server import STATIC, static_file
from rgbd_kcf_tracker.view.showing import Detail, pack, show

MOST_MOMENTS = 300
"""Moments in a file; of longer runs every second, third and so on is shown."""
_POLICY = (
    '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
    "script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src blob: data:\">"
)
SMALL = Detail(width=640, points=5000, quality=70)


def export(
    recording: Recording,
    path: Path,
    variant: str,
    parameters: Parameters,
    start: int,
    end: int,
    box: Box | None,
    progress: Callable[[int], None] = lambda _: None,
    overwrite: bool = False,
    everyone: bool = False,
) -> int:
    """Track a recording and write what the page shows of it into one file.

    Args:
        recording: of frames.
        path: of the file.
        variant: of the tracker.
        parameters: of the variant.
        start: the frame of the box.
        end: the frame to stop before.
        box: the target, pixels; None where only everyone is followed.
        progress: told of each frame.
        overwrite: replace a file that is there.
        everyone: whether people whom nobody chose are followed too.

    Returns:
        The number of moments in the file.

    Raises:
        RecordingError: where the file cannot be written, or is there already.
        BoxError: where the box lies outside the image.
    """
    player = Player(recording, variant, parameters, start=start, box=box, everyone=everyone)
    every = max(1, -(-(end - start) // MOST_MOMENTS))
    moments: list[str] = []
    entries: list[dict[str, Any]] = []
    for number, seen, entry in player.straight_through(end):
        progress(number)
        entries.append(entry)
        if (number - start) % every and number != end - 1:
            continue
        header, blobs = show(seen, SMALL)
        packet = pack({**header, 'entries': entries, 'anew': number == start}, blobs)
        moments.append(base64.b64encode(packet).decode())
        entries = []
    page = assemble(player.description(), moments)
    write_file(path, page.encode('utf-8', 'backslashreplace'), overwrite)
    return len(moments)


def assemble(description: dict[str, Any], moments: list[str]) -> str:
    """The page with styles, scripts and moments in it."""
    page = static_file('page.html').decode()
    for name in STATIC:
        text = static_file(name).decode()
        link, script = f'<link rel="stylesheet" href="{name}">', f'<script src="{name}"></script>'
        page = page.replace(link, f'<style>{text}</style>')
        page = page.replace(script, f'<script>{text}</script>')
    page = page.replace('<meta charset="utf-8">', f'<meta charset="utf-8">\n{_POLICY}', 1)
    # What comes from a recording, its name above all, must not end the script.
    content = json.dumps({'hello': description, 'moments': moments}).replace('<', '\\u003c')
    stored = f'<script type="application/json" id="stored">{content}</script>'
    return page.replace('<!-- stored -->', stored)
