# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Text files beside recordings: boxes per line, stamps, intrinsics, and how files are ordered."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

from rgbd_kcf_tracker.errors import RecordingError, RgbdKcfError
from rgbd_kcf_tracker.geometry import Box, Intrinsics

# ROS stamps hold 32 bits of seconds.
_LAST_STAMP_NS = (1 << 31) * 1_000_000_000


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Sorts ``10.png`` after ``9.png``."""
    return tuple(
        (0, int(part), '') if part.isdigit() else (1, 0, part)
        for part in re.split(r'(\d+)', name)
        if part
    )


def read_boxes(path: Path) -> list[Box | None]:
    """Boxes of a ground-truth file, one ``x,y,width,height`` per line.

    Numbers may be parted by commas, semicolons, tabs or blanks. A line of ``nan``, or a box without
    size, is None: the target is absent.

    Raises:
        RecordingError: naming the line that is none of this.
    """
    boxes: list[Box | None] = []
    for number, line in enumerate(read_lines(path), start=1):
        fields = re.split(r'[,;\s]+', line.strip().strip(',;'))
        try:
            if len(fields) < 4:
                raise ValueError
            x, y, width, height = (float(field) for field in fields[:4])
        except ValueError:
            raise RecordingError(
                f'{path}, line {number}: {line.strip()[:60]!r} is no box: '
                'write x,y,width,height (nan,nan,nan,nan where absent)'
            ) from None
        values = (x, y, width, height)
        absent = not all(math.isfinite(v) for v in values) or width <= 0 or height <= 0
        boxes.append(None if absent else Box(*values))
    return boxes


def known(boxes: list[Box | None] | None) -> list[Box | None] | None:
    """``boxes``, or None where not one is there: then nobody measured them."""
    return boxes if boxes is not None and any(b is not None for b in boxes) else None


def format_box(box: Box | None) -> str:
    """``box`` as a line of a ground-truth file, in thousandths of a pixel.

    Polygon messages hold float32, which keeps thousandths: so a folder and a bag made from the
    same boxes give the same numbers.
    """
    if box is None:
        return 'nan,nan,nan,nan'
    return ','.join(f'{value:.3f}'.rstrip('0').rstrip('.') for value in box.as_tuple())


def read_stamps(path: Path) -> list[int]:
    """Nanoseconds, one whole number per line.

    Raises:
        RecordingError: naming the line that is no whole number.
    """
    stamps = []
    for number, line in enumerate(read_lines(path), start=1):
        try:
            stamp = int(line)
            if not 0 <= stamp < _LAST_STAMP_NS:
                raise ValueError
            stamps.append(stamp)
        except ValueError:
            raise RecordingError(
                f'{path}, line {number}: {line.strip()[:60]!r} is no stamp: '
                'write whole nanoseconds, one per image'
            ) from None
    return stamps


def read_intrinsics(path: Path) -> Intrinsics:
    """``fx fy cx cy`` of a JSON file.

    Raises:
        RecordingError: where one is missing or no number.
    """
    try:
        values = json.loads(path.read_text(encoding='utf-8'))
        return Intrinsics(*(float(values[key]) for key in ('fx', 'fy', 'cx', 'cy')))
    except OSError as error:
        raise RecordingError(f'{path} cannot be read: {error.strerror or error}') from None
    except (ValueError, TypeError, KeyError, RgbdKcfError) as error:
        raise RecordingError(
            f'{path} holds no intrinsics ({error}): '
            'write {"fx": .., "fy": .., "cx": .., "cy": ..}'
        ) from None


def read_lines(path: Path) -> list[str]:
    """The lines of a text file, without empty ones at its end.

    Raises:
        RecordingError: where it cannot be read as text.
    """
    try:
        lines = path.read_text(encoding='utf-8-sig').splitlines()
    except OSError as error:
        raise RecordingError(f'{path} cannot be read: {error.strerror or error}') from None
    except UnicodeDecodeError:
        raise RecordingError(f'{path} is not a text file') from None
    while lines and not lines[-1].strip():
        lines.pop()
    return lines
