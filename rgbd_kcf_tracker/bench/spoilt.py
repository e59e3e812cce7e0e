# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings as a worse camera or hand gives them: what of a figure hangs on good ones.

    python -m rgbd_kcf_tracker.bench.spoilt hall/ --how reach --out spoilt/

writes ``spoilt/hall``, where nothing farther than 4.5 m is read: so far a Kinect v2 measures by
its specification, and libfreenect2 leaves out what is farther unless it is told otherwise
(``Freenect2Device::Config``). ``--help`` lists the other ways and the usual amount of each;
``--how lost=0.5`` gives another.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import os
import sys
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from rgbd_kcf_tracker.arrays import Floats, Image
from rgbd_kcf_tracker.bench.altered import (
    add_reading,
    camera_of,
    names_of,
    new_copy,
    parser_of,
    read_with_depth,
    write_camera,
    write_copies,
    write_pair,
    write_truth,
)
from rgbd_kcf_tracker.evaluation.datasets import everyone
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.imagefiles import ImageFrames

HOLE = 12
"""Pixels across of a hole in depth: about a hand at two metres."""


@dataclass(frozen=True, slots=True)
class Way:
    """One way to spoil a recording.

    Attributes:
        says: what it does, with ``{}`` for the amount.
        usual: the amount where none is given.
        most: the largest.
        spoil: makes a frame's colours, ``(H, W, 3)`` BGR, and depth, ``(H, W)`` metres and 0 where
            nothing is read, into those of the copy; None where the frame is left out.
        draw: makes the first box of somebody, by which a target is given, into that of the copy.
        whole: whether the amount is a whole number.
    """

    says: str
    usual: float
    most: float
    spoil: Callable[[Image, Floats, float, np.random.Generator], tuple[Image, Floats] | None]
    draw: Callable[[Box, float, np.random.Generator], Box] | None = None
    whole: bool = False

    def told(self, amount: float) -> str:
        """What an amount of it does."""
        return self.says.format(f'{amount:g}')


def _reach(
    color: Image, depth: Floats, metres: float, _: np.random.Generator
) -> tuple[Image, Floats]:
    return color, np.where(depth > metres, np.float32(0), depth)


def _grey(
    color: Image, depth: Floats, share: float, _: np.random.Generator
) -> tuple[Image, Floats]:
    grey = cv2.cvtColor(cv2.cvtColor(color, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    return cv2.addWeighted(color, 1 - share, grey, share, 0), depth


def _lost(
    color: Image, depth: Floats, share: float, rng: np.random.Generator
) -> tuple[Image, Floats] | None:
    return None if rng.random() < share else (color, depth)


def _holes(
    color: Image, depth: Floats, share: float, rng: np.random.Generator
) -> tuple[Image, Floats]:
    rows, cols = depth.shape
    coarse = rng.random((rows // HOLE + 1, cols // HOLE + 1), np.float32)
    chance = cv2.resize(coarse, (cols, rows))
    return color, np.where(chance < np.quantile(chance, share), np.float32(0), depth)


def _dark(
    color: Image, depth: Floats, level: float, _: np.random.Generator
) -> tuple[Image, Floats]:
    return color, np.where(cv2.blur(color.max(axis=2), (3, 3)) < level, np.float32(0), depth)


def _fringe(
    color: Image, depth: Floats, pixels: float, _: np.random.Generator
) -> tuple[Image, Floats]:
    far = np.where(depth > 0, depth, np.float32(np.inf))
    side = int(pixels) + 1  # a window of one pixel leaves all as it is
    near = cv2.erode(far, np.ones((side, side), np.uint8))
    return color, np.where(np.isfinite(near), near, np.float32(0))


def _shift(
    color: Image, depth: Floats, pixels: float, _: np.random.Generator
) -> tuple[Image, Floats]:
    moved = np.array([[1, 0, pixels], [0, 1, pixels / 2]], np.float32)
    return color, cv2.warpAffine(depth, moved, depth.shape[::-1], flags=cv2.INTER_NEAREST)


def _same(color: Image, depth: Floats, _: float, __: np.random.Generator) -> tuple[Image, Floats]:
    return color, depth


def _upper(box: Box, share: float, _: np.random.Generator) -> Box:
    return dataclasses.replace(box, height=share * box.height)


def _inner(box: Box, share: float, _: np.random.Generator) -> Box:
    return box.scaled(share)


def drawn_badly(box: Box, share: float, rng: np.random.Generator) -> Box:
    """A box whose middle and size deviate by a share of its size."""
    right, down, broader, taller = (share * rng.standard_normal(4)).tolist()
    cx, cy = box.cx + right * box.width, box.cy + down * box.height
    return Box.from_center(cx, cy, box.width * math.exp(broader), box.height * math.exp(taller))


WAYS = {
    'reach': Way('depth ends at {} metres', 4.5, 100.0, _reach),
    'grey': Way('{} of all colour is gone, as in infrared light', 1.0, 1.0, _grey),
    'lost': Way('{} of the frames after the first are lost', 0.35, 0.99, _lost),
    'holes': Way('depth has holes over {} of the picture, others in each frame', 0.25, 1.0, _holes),
    'dark': Way('what is darker than {} of 255 gives no reading', 25.0, 255.0, _dark),
    'fringe': Way('what is nearer is {} pixels broader in depth', 8.0, 98.0, _fringe, whole=True),
    'shift': Way('depth lies {} pixels beside the colours', 6.0, 99.0, _shift),
    'upper': Way("targets' first boxes show the upper {} of them", 0.5, 1.0, _same, _upper),
    'inner': Way("targets' first boxes are {} of their size", 0.5, 9.0, _same, _inner),
    'drawn': Way("targets' first boxes are off by {} of their size", 0.1, 1.0, _same, drawn_badly),
}


def _way(text: str) -> tuple[Way, float]:
    """What was asked for, and how much of it."""
    name, _, amount = text.partition('=')
    way = WAYS.get(name)
    if way is None:
        raise argparse.ArgumentTypeError(f'{name!r} is none of {", ".join(WAYS)}')
    try:
        value = float(amount) if amount else way.usual
    except ValueError:
        value = math.nan
    if not 0 < value <= way.most:
        raise argparse.ArgumentTypeError(
            f'{text!r}: the amount must be above 0, and {way.most:g} at the most'
        )
    if way.whole and value != round(value):
        raise argparse.ArgumentTypeError(f'{text!r}: the amount must be a whole number')
    return way, value


def _redrawn(
    person: Annotation,
    draw: Callable[[Box, float, np.random.Generator], Box],
    amount: float,
    rng: np.random.Generator,
    frame: Frame,
) -> Annotation:
    """Somebody with another box, as far as that lies in the picture."""
    box = draw(person.box, amount, rng).clipped(frame.width, frame.height)
    return person if box is None else dataclasses.replace(person, box=box)


def spoil(
    frames: ImageFrames,
    people: everyone.People,
    out: Path,
    way: Way,
    amount: float,
    rng: np.random.Generator,
) -> int:
    """Write a spoilt copy of a recording, and return how many pairs it has.

    Args:
        frames: all of the recording, each with depth.
        people: who is in them.
        out: is made.
        way: how it is spoilt.
        amount: how much of that.
        rng: of all that is random.

    Raises:
        RgbdKcfError: where it is there, cannot be made, or nobody is left in it.
    """
    kept: list[int] = []
    truth: list[list[Annotation]] = []
    given: set[int] = set()
    with new_copy(out, 'rgb', 'depth'):
        for index in range(len(frames)):
            frame = frames.frame(index)
            assert frame.depth is not None
            depth = np.nan_to_num(frame.depth.astype(np.float32), posinf=0.0)
            spoilt = way.spoil(frame.color, depth, amount, rng)
            if spoilt is None and kept:
                continue
            kept.append(index)
            write_pair(out, len(kept), *(spoilt or (frame.color, depth)))
            there = people.get(index, [])
            if way.draw is not None:
                there = [
                    each if each.id in given else _redrawn(each, way.draw, amount, rng, frame)
                    for each in there
                ]
                given.update(each.id for each in there if each.counts)
            truth.append(there)
        write_truth(out, [frames.stamps_ns[index] for index in kept], truth)
        write_camera(out, frames.intrinsics)
    return len(kept)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the copies; status 2 where one cannot be made."""
    parser = parser_of('spoilt', __doc__)
    add_reading(parser)
    ways = (f'{name}={way.usual:g}: {way.told(way.usual)}' for name, way in WAYS.items())
    parser.add_argument(
        '--how', type=_way, required=True, metavar='WAY[=AMOUNT]', help='; '.join(ways)
    )
    parser.add_argument('--seed', type=int, default=1)
    args = parser.parse_args(argv)
    if args.seed < 0:
        parser.error('--seed must be 0 or more')
    camera = camera_of(args, parser)
    names = names_of(args.folders, parser)
    way, amount = args.how

    def copies() -> Iterator[str]:
        for folder, name in zip(args.folders, names, strict=True):
            frames, people = read_with_depth(folder, args.fps, camera)
            # By its name: whatever else is copied, and in whichever order, its draws are the same.
            rng = np.random.default_rng([args.seed, zlib.crc32(os.fsencode(name))])
            out = args.out / name
            count = spoil(frames, people, out, way, amount, rng)
            yield f'{out}: {count} pairs, {way.told(amount)}'

    return write_copies(args.out, args.folders, copies)


if __name__ == '__main__':
    sys.exit(main())
