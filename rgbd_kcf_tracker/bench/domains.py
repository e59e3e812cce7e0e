# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A ROS domain for oneself: what runs at the same time on this machine is not heard."""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from rgbd_kcf_tracker.errors import RgbdKcfError

DOMAINS = (*range(1, 102), *range(215, 233))
"""Between those the ports of a domain fall into the range that Linux gives to others."""


@contextmanager
def reserved_domain() -> Iterator[int]:
    """A ROS domain id that nobody else of this user who asks here has, in whatever process.

    A file lock marks the domain as taken; the kernel releases it when the process dies. The one in
    ``ROS_DOMAIN_ID`` is left to the robot that may be in it.

    Raises:
        RgbdKcfError: where all are taken, or no lock can be made.
    """
    folder = Path(tempfile.gettempdir()) / f'rgbd_kcf_tracker_domains_{os.getuid()}'
    given = os.environ.get('ROS_DOMAIN_ID')
    # Each process starts at another place, so that a domain is not reused at once.
    start = os.getpid() * 8
    for offset in range(len(DOMAINS)):
        domain = DOMAINS[(start + offset) % len(DOMAINS)]
        if str(domain) == given:
            continue
        try:
            folder.mkdir(exist_ok=True)
            lock = (folder / str(domain)).open('a')
        except OSError as error:
            raise RgbdKcfError(
                f'no ROS domain can be reserved in {folder}: {error.strerror or error}; '
                'set TMPDIR to a folder that can be written'
            ) from None
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield domain
            return
    raise RgbdKcfError(f'all {len(DOMAINS)} ROS domains are taken by what runs on this machine')


@contextmanager
def kept_to_this_machine(log_folder: Path | None = None) -> Iterator[None]:
    """Set this process's ROS environment, which its children take over, until the block ends.

    A domain of its own, and this host only, found without multicast too (containers often have
    none): what is published here is heard by no robot. To be entered before ``rclpy.init``.

    Args:
        log_folder: of the nodes' logs, instead of the home folder; None for that of
            ``ROS_LOG_DIR``, or else one that is removed at the end.

    Raises:
        RgbdKcfError: where there is no domain, see :func:`reserved_domain`.
    """
    with ExitStack() as held:
        domain = held.enter_context(reserved_domain())
        logs = os.environ.get('ROS_LOG_DIR', '') if log_folder is None else str(log_folder)
        if not logs:
            logs = held.enter_context(
                tempfile.TemporaryDirectory(prefix='rgbd_kcf_log_', ignore_cleanup_errors=True)
            )
        set_here: dict[str, str | None] = {
            'ROS_DOMAIN_ID': str(domain),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
            'ROS_STATIC_PEERS': '127.0.0.1',
            'ROS_LOG_DIR': logs,
            'ROS_LOCALHOST_ONLY': None,
        }
        before = {name: os.environ.get(name) for name in set_here}
        _set(set_here)
        try:
            yield
        finally:
            _set(before)


def _set(variables: dict[str, str | None]) -> None:
    for name, value in variables.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value
