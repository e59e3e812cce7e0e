# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The demo's nodes as processes of their own."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from rgbd_kcf_tracker.errors import RgbdKcfError

STOP_S = 20.0


class DemoError(RgbdKcfError):
    """A step of the demo failed."""


@contextmanager
def node(
    executable: str,
    parameters: Mapping[str, object],
    remaps: Mapping[str, str],
    folder: Path,
) -> Iterator[subprocess.Popen[bytes]]:
    """A node of this package; told to stop, and waited for, at the end of the ``with`` block.

    Args:
        executable: 'tracker' or 'replay'.
        parameters: its ROS parameters.
        remaps: topic names, from and to.
        folder: for its parameter file and its output.

    Raises:
        DemoError: where it ends with an error.
    """
    settings = folder / f'{executable}.yaml'
    lines = [f'    {name}: {json.dumps(value)}' for name, value in parameters.items()]
    settings.write_text('\n'.join(['/**:', '  ros__parameters:', *lines]) + '\n', encoding='utf-8')
    command = [sys.executable, '-m', f'rgbd_kcf_tracker.ros.{executable}_main', '--ros-args']
    command += ['--params-file', str(settings)]
    for old, new in remaps.items():
        command += ['-r', f'{old}:={new}']
    output = folder / f'{executable}.log'
    with output.open('ab') as log:
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
    try:
        yield process
    finally:
        stop(process)
    if process.returncode != 0:
        raise DemoError(f'{executable} ended with status {process.returncode}: {last_line(output)}')


def stop(process: subprocess.Popen[bytes]) -> None:
    """End a node as Ctrl-C would, and by force if that does not help."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def last_line(path: Path) -> str:
    """The last line of a log, for an error message."""
    lines = path.read_text(encoding='utf-8', errors='replace').strip().splitlines()
    return lines[-1] if lines else f'{path} is empty'
