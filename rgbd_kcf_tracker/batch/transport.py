# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Files that a job makes, brought to the process that asked for it, wherever the job ran."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Generic, TypeVar

from rgbd_kcf_tracker.recordings.outputs import write_atomically

R = TypeVar('R')

LAST = '.json'
"""Files that vouch for others are written after them."""


@dataclass(frozen=True, slots=True)
class Packed(Generic[R]):
    """What a job returned, and the files that it made, by their places in the folder."""

    result: R
    files: tuple[tuple[str, bytes], ...]


def packed(work: Callable[[Path], R]) -> Packed[R]:
    """Do ``work`` in an empty folder, and pack what is in it then."""
    with TemporaryDirectory(prefix='rgbd_kcf_') as name:
        result = work(Path(name))
        files = sorted(p for p in Path(name).rglob('*') if p.is_file())
        return Packed(
            result, tuple((p.relative_to(name).as_posix(), p.read_bytes()) for p in files)
        )


def unpack(parcel: Packed[R], folder: Path) -> R:
    """Write the files into ``folder``, those that vouch for others last.

    Raises:
        ValueError: for a file that would lie outside of the folder.
        RecordingError: where one cannot be written.
    """
    for name, data in sorted(parcel.files, key=lambda item: item[0].endswith(LAST)):
        if os.path.isabs(name) or '..' in name.split('/'):
            raise ValueError(f'{name!r} lies outside of the folder')
        write_atomically(folder / name, data)
    return parcel.result
