# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Text files beside recordings: boxes per line, stamps, intrinsics, and how files are ordered."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from rgbd_kcf_tracker.errors import RecordingError, RgbdKcfError
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.camera_info import NO, YES, camera_from_info
from rgbd_kcf_tracker.recordings.files import is_there, read_text
from rgbd_kcf_tracker.recordings.messages import LARGEST
from rgbd_kcf_tracker.recordings.storage import NANOSECONDS

INTRINSICS, CAMERA_INFO = 'intrinsics.json', 'camera_info.json'

LAST_STAMP_NS = (1 << 31) * NANOSECONDS
"""Nanoseconds that no stamp reaches: ROS's hold 32 bits of seconds."""


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Sorts ``10.png`` after ``9.png``."""
    return tuple(
        (0, int(part), '') if part.isdecimal() else (1, 0, part)
        for part in re.split(r'(\d+)', name)
        if part
    )


def read_boxes(path: Path, flags: int = 0) -> list[Box | None]:
    """Boxes of a ground-truth file, one ``x,y,width,height`` or polygon per line.

    Numbers may be parted by commas, semicolons, tabs or blanks. A line of four ``nan``, or a box
    without size, is None: the target is absent. A polygon ``x1,y1,x2,y2,x3,y3,...`` is its upright
    bounding box.

    Args:
        path: the file.
        flags: how many numbers may follow a box that say something else of it.

    Raises:
        RecordingError: naming the line that is none of this.
    """
    boxes: list[Box | None] = []
    for number, line in enumerate(read_lines(path), start=1):
        fields = re.split(r'\s*[,;]\s*|\s+', line.strip().rstrip(',;'))
        try:
            values = [float(field) for field in fields]
            boxes.append(box_of_region(values[:4] if len(values) <= 4 + flags else values))
        except ValueError:
            raise RecordingError(
                f'{path}, line {number}: {line.strip()[:60]!r} is no box: '
                'write x,y,width,height (nan,nan,nan,nan where absent), '
                f'at most {LARGEST:.0f} pixels'
            ) from None
    return boxes


def box_of_region(values: Sequence[float]) -> Box | None:
    """The upright bounding box of ``x, y, width, height`` or of a polygon's corners.

    Raises:
        ValueError: where it is neither, or half of it, see :func:`box_or_none`, or beyond reason.
    """
    if any(abs(value) > LARGEST for value in values):
        raise ValueError(f'{values}')
    if len(values) == 4:
        return box_or_none(*values)
    if len(values) < 6 or len(values) % 2:
        raise ValueError(f'{len(values)} numbers')
    if all(map(math.isnan, values)):
        return None
    if not all(map(math.isfinite, values)):
        raise ValueError(f'{values}')
    xs, ys = values[0::2], values[1::2]
    return box_or_none(min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys))


def box_or_none(x: float, y: float, width: float, height: float) -> Box | None:
    """The box, or None where the target is absent: four NaN, or no size.

    Raises:
        ValueError: where some numbers are finite and some are not, or the size is negative: a
            mistake, and no absence.
    """
    values = (x, y, width, height)
    if all(map(math.isnan, values)):
        return None
    if not all(map(math.isfinite, values)) or width < 0 or height < 0:
        raise ValueError(f'{x},{y},{width},{height}')
    return None if width == 0 or height == 0 else Box(*values)


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
            if not 0 <= stamp < LAST_STAMP_NS:
                raise ValueError
            stamps.append(stamp)
        except ValueError:
            raise RecordingError(
                f'{path}, line {number}: {line.strip()[:60]!r} is no stamp: write whole '
                f'nanoseconds, one per image, from 0 to {LAST_STAMP_NS - 1} as ROS has them'
            ) from None
    return stamps


def read_intrinsics(path: Path) -> Intrinsics:
    """``fx fy cx cy`` of a JSON file.

    Raises:
        RecordingError: where one is missing or no number.
    """
    text = read_text(path)
    try:
        values = _json_object(text)
        return Intrinsics(*(_json_number(values, key) for key in ('fx', 'fy', 'cx', 'cy')))
    except RgbdKcfError as error:
        raise RecordingError(
            f'{path} holds no intrinsics ({error}): '
            'write {"fx": .., "fy": .., "cx": .., "cy": ..}'
        ) from None


def _json_object(text: str) -> dict[str, Any]:
    """A JSON object; what is wrong with one is said in our words, as Python's are about Python.

    Raises:
        RecordingError: where the text is none.
    """
    try:
        value = json.loads(text)
    except json.JSONDecodeError as error:
        raise RecordingError(f'line {error.lineno} is no JSON') from None
    except RecursionError:
        raise RecordingError('it is nested too deeply') from None
    except ValueError:
        raise RecordingError('a number has thousands of digits') from None
    if not isinstance(value, dict):
        raise RecordingError('it is no JSON object')
    return value


def _json_number(values: Mapping[str, Any], key: str) -> float:
    if key not in values:
        raise RecordingError(f'{key} is missing')
    try:
        return float(values[key])
    except (OverflowError, TypeError, ValueError):
        raise RecordingError(f'{key} is {str(values[key])[:20]!r}, no number of pixels') from None


def folder_intrinsics(
    folder: Path,
    size: Callable[[], tuple[int, int] | None],
    warn: Callable[[str], None] | None = None,
) -> Intrinsics | None:
    """The camera of a sequence folder, None where it states none.

    It is in ``intrinsics.json``, or else in ``camera_info.json``: the fields of
    ``sensor_msgs/CameraInfo``, ``D``, ``K`` and ``P`` in small or capital letters, and
    ``rectified``, true where the images are.

    Args:
        folder: the folder.
        size: looks up width and height of its images; None where they cannot be known.
        warn: is told in words where the camera is one for images of another size, and left out.

    Raises:
        RecordingError: where a file holds no camera.
    """
    if is_there(folder / INTRINSICS):
        return read_intrinsics(folder / INTRINSICS)
    path = folder / CAMERA_INFO
    if not is_there(path):
        return None
    text = read_text(path)
    try:
        fields = {name.lower(): value for name, value in _json_object(text).items()}
        roi = fields.pop('roi', None) or {}
        rectified = fields.pop('rectified', False)
        if not isinstance(rectified, bool):
            raise RecordingError(f'rectified is {rectified!r}, neither true nor false')
        if 'k' not in fields:
            raise RecordingError('K is missing')
        if not isinstance(roi, dict):
            raise RecordingError('roi is no JSON object')
        told = SimpleNamespace(**({'p': [0.0] * 12} | fields | {'roi': SimpleNamespace(**roi)}))
        found = camera_from_info(told, rectified=YES if rectified else NO)
    except RgbdKcfError as error:
        raise RecordingError(
            f'{path} holds no camera ({error}): write the fields of CameraInfo, or {INTRINSICS}'
        ) from None
    shown = size()
    misfit = '' if found is None or shown is None else found.misfit(*shown)
    if misfit and warn is not None:
        warn(f'{path.name} {misfit}: left out')
    return None if found is None or misfit else found.intrinsics


def read_lines(path: Path) -> list[str]:
    """The lines of a text file, without empty ones at its end.

    Raises:
        RecordingError: where it cannot be read as text.
    """
    lines = read_text(path).splitlines()
    while lines and not lines[-1].strip():
        lines.pop()
    return lines
