# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What decides a result beside its input: the code and the libraries that it runs on."""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import rgbd_kcf_tracker

ROOT = Path(rgbd_kcf_tracker.__file__).parent

# What makes no frame, no track and no truth. All else is part of the digest, also what will be
# added.
ELSEWHERE = ('batch', 'bench', 'cli', 'live', 'ros', 'view')
MEASURING = 'evaluation'
RUNNING = (
    'boxfiles.py', 'contenders.py', 'datasets', 'everyone.py', 'jobs.py', 'metrics', 'passes.py',
    'store.py',
)  # fmt: skip
"""What of the evaluation makes frames, tracks and truth; the rest measures and shows them."""

LIBRARIES = ('numpy', 'scipy', 'rosbags', 'mcap', 'mcap-ros2-support', 'lz4', 'zstandard')
"""Distributions whose versions count, beside Python and OpenCV."""


@dataclass(frozen=True, slots=True)
class Environment:
    """Versions of everything that a result depends on.

    Attributes:
        version: of the package.
        code: digest of its code.
        libraries: names and versions, Python's and OpenCV's among them.
    """

    version: str
    code: str
    libraries: tuple[tuple[str, str], ...]

    @property
    def digest(self) -> str:
        """All of it as one short text."""
        return hashlib.sha256(repr(self).encode()).hexdigest()[:16]

    def differences(self, other: Environment) -> list[str]:
        """How ``other`` is different, in words; empty where it is not."""
        if other == self:
            return []
        if other.version != self.version:
            return [f'rgbd_kcf_tracker {other.version}, here {self.version}']
        found = []
        if other.code != self.code:
            found.append(
                f'other code of rgbd_kcf_tracker {other.version} ({other.code}, here {self.code})'
            )
        own, theirs = dict(self.libraries), dict(other.libraries)
        for name in sorted({*own, *theirs}):
            if own.get(name) != theirs.get(name):
                found.append(f'{name} {theirs.get(name, "missing")}, here {own.get(name, "none")}')
        return found


@cache
def environment() -> Environment:
    """Of this process."""
    import cv2  # its distribution goes by several names

    libraries = [('python', '.'.join(platform.python_version_tuple()[:2]))]
    libraries.append(('opencv', cv2.__version__))
    for name in LIBRARIES:
        try:
            libraries.append((name, importlib.metadata.version(name)))
        except importlib.metadata.PackageNotFoundError:
            libraries.append((name, 'none'))
    return Environment(rgbd_kcf_tracker.__version__, code_digest(), tuple(libraries))


def code_files(root: Path = ROOT) -> list[Path]:
    """The files of the package that decide what comes out of a run."""
    found = []
    for path in sorted(root.rglob('*.py')):
        parts = path.relative_to(root).parts
        if parts[0] in ELSEWHERE or (parts[0] == MEASURING and parts[1] not in RUNNING):
            continue
        found.append(path)
    return found


def code_digest(root: Path = ROOT) -> str:
    """Digest of :func:`code_files`."""
    digest = hashlib.sha256()
    for path in code_files(root):
        data = path.read_bytes()
        digest.update(f'{path.relative_to(root).as_posix()}:{len(data)}:'.encode())
        digest.update(data)
    return digest.hexdigest()[:16]
