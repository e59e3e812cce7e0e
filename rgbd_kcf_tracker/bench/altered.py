# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the commands that write altered copies of recordings have in common."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats, Image
from rgbd_kcf_tracker.cli.common import parse_intrinsics
from rgbd_kcf_tracker.errors import ParameterError, RecordingError, RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets import everyone
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.recordings.encoding import millimetres
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames
from rgbd_kcf_tracker.recordings.mot import MOT_FILE, Sightings, mot_text
from rgbd_kcf_tracker.recordings.outputs import cannot_write, check_outputs, make_folder
from rgbd_kcf_tracker.recordings.textfiles import INTRINSICS, format_box


def parser_of(command: str, doc: str | None) -> argparse.ArgumentParser:
    """The parser of a command, with the arguments that say what is copied, and where to.

    Args:
        command: name of its module.
        doc: the module's docstring, of which the first line describes it.
    """
    parser = argparse.ArgumentParser(
        prog=f'python -m rgbd_kcf_tracker.bench.{command}', description=(doc or '').split('\n')[0]
    )
    parser.add_argument('folders', nargs='+', type=Path, metavar='FOLDER', help='recordings')
    parser.add_argument('--out', type=Path, required=True, help='folder of the copies')
    return parser


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Add what tells of recordings what they do not tell themselves; see :func:`camera_of`."""
    parser.add_argument('--fps', type=float, default=30.0, help='of recordings without stamps')
    parser.add_argument('--intrinsics', metavar='FX,FY,CX,CY', help='of recordings without')


def camera_of(args: argparse.Namespace, parser: argparse.ArgumentParser) -> Intrinsics | None:
    """The intrinsics given, if any; ends the command where they or the frames per second are none.

    Args:
        args: of the command line.
        parser: of it, see :func:`add_reading`.
    """
    if not 0 < args.fps < math.inf:
        parser.error('--fps must be a number above 0')
    try:
        return None if args.intrinsics is None else parse_intrinsics(args.intrinsics)
    except ParameterError as error:
        parser.error(str(error))


def names_of(folders: Iterable[Path], parser: argparse.ArgumentParser) -> list[str]:
    """What the copies are named after; ends the command where two are the same."""
    names = [folder.resolve().name for folder in folders]
    if len(set(names)) < len(names):
        parser.error(f'two of {", ".join(names)} have the same name: their copies would, too')
    return names


def write_copies(out: Path, folders: list[Path], write: Callable[[], Iterable[str]]) -> int:
    """Write copies, saying of each what it is.

    Args:
        out: folder of the copies.
        folders: what is copied, in none of which anything is written.
        write: writes one copy after the other, and gives a line for each.

    Returns:
        The exit status: 2 where one cannot be made.
    """
    try:
        check_outputs({'--out': out}, folders, overwrite=True, folders=('--out',))
        for line in write():
            print(line)
    except RgbdKcfError as error:
        print(error, file=sys.stderr)
        return 2
    except OSError as error:
        print(f'{out} cannot be written: {error.strerror or error}', file=sys.stderr)
        return 2
    return 0


@contextmanager
def new_copy(out: Path, *parts: str) -> Iterator[None]:
    """Make the folders of a copy, which is written in the ``with`` block.

    Where that fails it is removed: half of one would be in the way of the next run.

    Args:
        out: the copy, which must not be there; the folder that it lies in is made.
        parts: the folders in it.

    Raises:
        RgbdKcfError: where it is there, or they cannot be made.
    """
    if out.exists():
        raise RecordingError(f'{out} is there already: give another --out')
    try:
        for part in (out.parent, out, *(out / name for name in parts)):
            make_folder(part)
        yield
    except BaseException:
        shutil.rmtree(out, ignore_errors=True)
        raise


def write_image(path: Path, image: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]) -> None:
    """Write an image of a copy, without loss.

    Raises:
        RecordingError: where it cannot be written.
    """
    try:
        path.write_bytes(cv2.imencode('.png', image)[1].tobytes())
    except OSError as error:
        raise RecordingError(cannot_write(path, error)) from None


def write_pair(out: Path, number: int, color: Image, depth: Floats) -> None:
    """Write the colours and the depth of one frame of a copy that has the folders for it.

    Args:
        out: the copy.
        number: of the frame, from 1.
        color: ``(H, W, 3)`` BGR.
        depth: ``(H, W)`` metres.

    Raises:
        RecordingError: where they cannot be written.
    """
    write_image(out / 'rgb' / f'{number:06d}.png', np.ascontiguousarray(color))
    write_image(out / 'depth' / f'{number:06d}.png', millimetres(depth))


def write_camera(out: Path, camera: Intrinsics | None) -> None:
    """Write by what camera a copy was taken, where that is known."""
    if camera is not None:
        values = {'fx': camera.fx, 'fy': camera.fy, 'cx': camera.cx, 'cy': camera.cy}
        (out / INTRINSICS).write_text(json.dumps(values, indent=2) + '\n')


def read_with_depth(
    folder: Path, fps: float, camera: Intrinsics | None
) -> tuple[ImageFrames, everyone.People]:
    """A recording of which copies are made, and who is in it.

    Args:
        folder: the recording.
        fps: frames per second, where it has no stamps.
        camera: intrinsics, where it has none.

    Raises:
        RecordingError: where a frame has no depth, or it is seen through a lens.
    """
    frames, people = everyone.read(folder, fps)
    if not frames.depths or None in frames.depths:
        raise RecordingError(f'{folder} holds frames without depth: nobody is known there')
    if frames.intrinsics is not None and frames.intrinsics.lens is not None:
        raise RecordingError(f'{folder} is seen through a lens: rectify its images first')
    if frames.intrinsics is None:
        frames = dataclasses.replace(frames, intrinsics=camera)
    return frames, people


def write_truth(
    out: Path, stamps_ns: Sequence[int], people: Sequence[Sequence[Annotation]]
) -> None:
    """Write when the frames of a copy were taken, and who is in them, whole bodies where known.

    Args:
        out: the copy.
        stamps_ns: of its frames.
        people: in each of them.

    Raises:
        RecordingError: where nobody is.
    """
    if not any(people):
        raise RecordingError(f'{out}: nobody is left in its frames')
    rows = [
        (number, person.id, person.box.as_tuple(), float(person.counts))
        for number, there in enumerate(people)
        for person in there
    ]
    (out / 'timestamps.txt').write_text(''.join(f'{stamp}\n' for stamp in stamps_ns))
    (out / MOT_FILE).write_text(mot_text(Sightings.of(*zip(*rows, strict=True))))
    for who in {person.id for there in people for person in there if person.body is not None}:
        bodies = [next((p.body for p in there if p.id == who), None) for there in people]
        text = ''.join(f'{format_box(body)}\n' for body in bodies)
        (out / f'body_{who}.txt').write_text(text)
