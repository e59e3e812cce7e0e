# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""New recordings of a room, into which the recorded people come in another order and again.

    python -m rgbd_kcf_tracker.bench.composed filinha/ --fps 5 --intrinsics FX,FY,CX,CY --out new/

writes ``new/filinha_x1_1`` to ``new/filinha_x1_3``, one for each of ``--seeds``. The camera must
have stood still: the empty room is what each pixel showed while nobody was there. People are cut
out by their depth where nobody nearer hid them, and walk in as they were recorded, forwards or
backwards, each several times with absences between; the nearer hides the farther. Truth is what
shows of them then. Who comes back, and after whom, is drawn, so that what a tracker owes to the
order of one recording it has not in these. With ``--every 5`` they have each fifth frame, and 1 Hz
where the recording has 5. Who never leaves the recording stays in the room.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Image, Mask
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
from rgbd_kcf_tracker.errors import DatasetError, RecordingError
from rgbd_kcf_tracker.evaluation.datasets import everyone
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation
from rgbd_kcf_tracker.evaluation.datasets.simulated import parse_seeds
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics, mask_box
from rgbd_kcf_tracker.recordings.mot import BARELY_VISIBLE, REGION_ID

STRIP = 16
"""Rows of which medians are taken at once: all rows of a long recording would fill the memory."""
AROUND = 8
"""Pixels about a box in which its person may still be: boxes are by hand, and shadows fall."""
FREE = 3
"""Frames in which nobody is at a pixel, that tell what is behind: fewer may be of a box too small,
and the farthest reading is trusted instead."""
READ = 0.3
"""Share of these that must have depth: at edges and on glass the others are chance."""

MARGIN = 6
"""Pixels about a box that are cut out with it, for hands and feet that reach out of it."""
NEARER, NEARER_SHARE = 0.05, 0.012
"""Metres, and share of the room's depth, by which somebody is before the room: beyond the noise."""
REACH = 0.55
"""Metres from the middle of a person to what is still theirs: a step, or an arm held out."""
PIECE = 0.08
"""Pieces of less than this share of the largest are no part of a person."""
INSIDE, WHOLE = 200, 300
"""Pixels before the room that a box, and somebody cut out, must have to be a person."""
BLIND = 32
"""Pixels at the picture's edge, at most, that depth from beside the colour camera does not reach:
who goes on there is cut out to the edge."""
HIDDEN, BEFORE = 0.1, 0.15
"""Somebody is half hidden where this share of their box is also another's who is not this many
metres behind."""
ENDS = 0.5
"""Or where it is so along this share of the lower edge, or of a side: boxes are of what shows, and
end where another hides the rest."""

GAP_S = 0.4
"""Seconds for which somebody may be lost in the recording and still walk on."""
WALK_S = 1.0
"""Seconds of the shortest walk: less shows how somebody looks, and not where they go."""
FIRST = 3
"""Frames of the empty room at the beginning, by which a tracker learns it."""
BEGIN = 3
"""Everyone comes first in the first such part of a recording, so that they can come again."""
SHORTEST = 10
"""Frames of the shortest recording: the empty room, somebody, and their absence."""
APART = 0.7
"""Metres between the middles of any two: people do not stand in one another."""
FAR, QUIET_S = 1.5, 2.0
"""Nobody comes this close, in metres, to where another was last seen less than these seconds ago:
in a room nobody vanishes and is then another."""

NOISE_DEPTH = 0.0015
"""Metres at one metre; grows with the square of depth (Khoshelham and Elberink 2012)."""
NOISE_COLOR = 2.0
"""Levels of 255."""
TOUCH = 0.03
"""Metres by which somebody may be behind what they are cut out before, for the noise of both."""
RIM = np.ones((5, 5), np.uint8)
"""Two pixels about somebody show their colours, too: depth ends before colour does."""
SPECK = np.ones((3, 3), np.uint8)
"""What shows of somebody and is thinner than this gets no box: it is a rim, or noise."""
GONE, GONE_PX = 0.08, 150
"""Of whom a smaller share shows, or fewer pixels, is out of view."""


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """What a camera sees where nobody is.

    Attributes:
        color: ``(H, W, 3)`` BGR.
        depth: ``(H, W)`` metres, NaN where unknown.
    """

    color: Image
    depth: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Sprite:
    """Somebody cut out of a frame.

    Attributes:
        id: who.
        x, y: column and row of the cut's first pixel in the image.
        mask: ``(h, w)`` what of the cut is theirs.
        color: ``(h, w, 3)`` BGR.
        depth: ``(h, w)`` metres, NaN where unknown.
        away: metres to their middle.
        place: metres to the right of the camera, and ahead.
    """

    id: int
    x: int
    y: int
    mask: Mask
    color: Image
    depth: Floats
    away: float
    place: tuple[float, float]

    @property
    def within(self) -> tuple[slice, slice]:
        """Rows and columns of the image that the cut covers."""
        height, width = self.mask.shape
        return slice(self.y, self.y + height), slice(self.x, self.x + width)


Walk = tuple[Sprite, ...]
"""Somebody in frame after frame."""


@dataclass(frozen=True, slots=True, eq=False)
class Visit:
    """A walk through a composed recording.

    Attributes:
        start: index of its first frame there.
        walk: who comes, and how.
    """

    start: int
    walk: Walk

    @property
    def last(self) -> int:
        """Index of its last frame."""
        return self.start + len(self.walk) - 1

    def at(self, frame: int) -> Sprite | None:
        """Who is there in a frame, None: nobody."""
        return self.walk[frame - self.start] if self.start <= frame <= self.last else None


@dataclass(frozen=True, slots=True)
class Wish:
    """What composed recordings are like.

    Attributes:
        length: frames.
        absence: least and most frames between two visits of somebody.
        together: people at once, at most.
        step_s: seconds from frame to frame.
    """

    length: int
    absence: tuple[int, int]
    together: int
    step_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """What new recordings are composed of.

    Attributes:
        room: without anybody.
        walks: of each person, by id.
        camera: that saw them.
        step_ns: nanoseconds from frame to frame of a walk.
    """

    room: Room
    walks: Mapping[int, Sequence[Walk]]
    camera: Intrinsics
    step_ns: int


def empty_room(frames: Sequence[Frame], people: everyone.People) -> Room:
    """The room without people: the median of what each pixel showed while nobody was there.

    Where somebody always was, it is as in the frame with the farthest reading.

    Args:
        frames: all of a recording, each with depth and all of one size.
        people: who is in them.
    """
    height, width = frames[0].height, frames[0].width
    free = np.ones((len(frames), height, width), bool)
    for index in range(len(frames)):
        for one in _persons(people, index):
            free[index][_window(one.box, AROUND, width, height)] = False
    room = Room(np.empty((height, width, 3), np.uint8), np.empty((height, width), np.float32))
    for top in range(0, height, STRIP):
        rows = slice(top, top + STRIP)
        there = free[:, rows]
        depth = np.stack([_depth_of(frame)[rows] for frame in frames])
        color = np.stack([frame.color[rows] for frame in frames]).astype(np.float32)
        count = there.sum(0)
        read = (there & np.isfinite(depth)).sum(0)
        behind = _median(np.where(there, depth, np.nan), read)
        behind[read < READ * count] = np.nan
        hue = _median(np.where(there[..., None], color, np.nan), count[..., None])
        farthest = np.where(np.isfinite(depth), depth, -1.0).argmax(0)[None]
        known = count >= min(FREE, len(frames))
        room.depth[rows] = np.where(known, behind, np.take_along_axis(depth, farthest, 0)[0])
        alone = np.take_along_axis(color, farthest[..., None], 0)[0]
        room.color[rows] = np.where(known[..., None], hue, alone).astype(np.uint8)
    return room


def _median(values: Floats, count: npt.NDArray[np.int64]) -> Floats:
    """The lower median along the first axis, of which so many are numbers; NaN of none."""
    middle = np.broadcast_to(np.maximum(count - 1, 0) // 2, values.shape[1:])
    taken: Floats = np.take_along_axis(np.sort(values, axis=0), middle[None], 0)[0]
    return taken


def _persons(people: everyone.People, index: int) -> list[Annotation]:
    return [one for one in people.get(index, []) if one.id != REGION_ID]


def _depth_of(frame: Frame) -> Floats:
    assert frame.depth is not None  # read_with_depth has seen to it
    return frame.depth


def _window(box: Box, around: int, width: int, height: int) -> tuple[slice, slice]:
    """Rows and columns of an image that a box covers, and so many pixels about it."""
    rows = slice(max(0, int(box.y - around)), max(0, min(height, math.ceil(box.bottom + around))))
    columns = slice(max(0, int(box.x - around)), max(0, min(width, math.ceil(box.right + around))))
    return rows, columns


def cut_out(frame: Frame, one: Annotation, room: Room, camera: Intrinsics) -> Sprite | None:
    """Somebody as they show in a frame, by what is before the room; None: too little is."""
    rows, columns = _window(one.box, MARGIN, frame.width, frame.height)
    depth, behind = _depth_of(frame)[rows, columns], room.depth[rows, columns]
    before = np.isfinite(depth)
    before &= np.isnan(behind) | (depth < behind - (NEARER + NEARER_SHARE * behind))
    inside = np.zeros_like(before)
    inside[MARGIN:-MARGIN, MARGIN:-MARGIN] = before[MARGIN:-MARGIN, MARGIN:-MARGIN]
    if inside.sum() < INSIDE:
        return None
    away = float(np.median(depth[inside]))
    near = before & (np.abs(depth - away) < REACH)
    closed = cv2.morphologyEx(near.astype(np.uint8), cv2.MORPH_CLOSE, RIM)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=8)
    sizes = stats[:, cv2.CC_STAT_AREA].copy()
    sizes[0] = 0  # the background
    theirs = (sizes > PIECE * sizes.max())[labels]
    mask = theirs & (near | np.isnan(depth))
    blind = np.isnan(depth) & ~mask
    if columns.start == 0:
        _go_on(mask, blind)
    if columns.stop == frame.width:
        _go_on(mask[:, ::-1], blind[:, ::-1])
    if rows.start == 0:
        _go_on(mask.T, blind.T)
    if rows.stop == frame.height:
        _go_on(mask[::-1].T, blind[::-1].T)
    if mask.sum() < WHOLE:
        return None
    middle = columns.start + mask.shape[1] / 2
    place = ((middle - camera.cx) / camera.fx * away, away)
    color = frame.color[rows, columns].copy()
    return Sprite(one.id, columns.start, rows.start, mask, color, depth.copy(), away, place)


def _go_on(mask: Mask, blind: Mask) -> None:
    """Let somebody go on, row by row, to the picture's edge at column 0, where no depth is.

    Args:
        mask: ``(h, w)`` what is theirs, and more of it then.
        blind: ``(h, w)`` where no depth is, and nobody; less of it then.
    """
    open_end = np.logical_and.accumulate(blind, axis=1)
    count = open_end.sum(1)
    first = np.minimum(count, mask.shape[1] - 1)
    theirs = mask[np.arange(len(mask)), first] & (count <= BLIND)
    mask |= open_end & theirs[:, None]
    blind &= ~mask


def cut_outs(
    frames: Sequence[Frame], people: everyone.People, room: Room, camera: Intrinsics
) -> dict[int, dict[int, Sprite]]:
    """Everyone who shows freely, by id and by index of the frame."""
    found: dict[int, dict[int, Sprite]] = {}
    for index, frame in enumerate(frames):
        there = [(one, cut_out(frame, one, room, camera)) for one in _persons(people, index)]
        for one, sprite in there:
            if sprite is None or not one.counts:
                continue
            others = [(other.box, cut) for other, cut in there if other is not one]
            if not any(_hides(box, cut, one.box, sprite) for box, cut in others):
                found.setdefault(one.id, {})[index] = sprite
    return found


def _hides(box: Box, cut: Sprite | None, behind: Box, sprite: Sprite) -> bool:
    """Whether one hides another, or begins where the box of what shows of the other ends."""
    if cut is not None and cut.away >= sprite.away + BEFORE:
        return False
    beside = (
        Box(behind.x, behind.bottom, behind.width, AROUND),
        Box(behind.x - AROUND, behind.y, AROUND, behind.height),
        Box(behind.right, behind.y, AROUND, behind.height),
    )
    return box.intersection(behind) > HIDDEN * behind.area or any(
        box.intersection(side) > ENDS * side.area for side in beside
    )


def walks_of(sprites: Mapping[int, Sprite], period_s: float, every: int) -> list[Walk]:
    """The walks of somebody.

    Args:
        sprites: of them, by index of the frame.
        period_s: seconds from frame to frame of the recording.
        every: frames of which a walk has one; each phase is a walk of its own.
    """
    gap = max(1, round(GAP_S / period_s))
    least = max(2, round(WALK_S / period_s))
    runs: list[list[int]] = []
    for index in sorted(sprites):
        if runs and index - runs[-1][-1] <= gap:
            runs[-1].append(index)
        else:
            runs.append([index])
    parts = [
        run[phase::every]
        for run in runs
        if len(run) >= least
        for phase in range(min(every, len(run)))
    ]
    return [tuple(sprites[index] for index in part) for part in parts if len(part) >= 2]


def plan(walks: Mapping[int, Sequence[Walk]], wish: Wish, rng: np.random.Generator) -> list[Visit]:
    """Who comes when, by chance, within the rules of :func:`fits`."""
    visits: list[Visit] = []
    for who in rng.permutation(sorted(walks)):
        begin = max(FIRST, wish.length // BEGIN)
        start = int(rng.integers(FIRST, begin + 1))
        while start < wish.length:
            walk = walks[who][int(rng.integers(len(walks[who])))]
            visit = Visit(start, walk[:: -1 if rng.random() < 0.5 else 1])
            if fits(visit, visits, wish):
                visits.append(visit)
                least, most = wish.absence
                start = visit.last + 1 + int(rng.integers(least, most + 1))
            else:
                start += 1
    return visits


def fits(visit: Visit, others: Sequence[Visit], wish: Wish) -> bool:
    """Whether a visit of somebody can be among those of others, and theirs of before.

    It ends with the recording, no more than ``together`` are there at once, nobody stands within
    :data:`APART` of another, and nobody comes within :data:`FAR` of where another was last seen
    less than :data:`QUIET_S` ago.
    """
    if visit.last >= wish.length:
        return False
    for frame, one in enumerate(visit.walk, visit.start):
        there = [each for other in others if (each := other.at(frame)) is not None]
        if len(there) >= wish.together or any(_between(one, each) < APART for each in there):
            return False
    strangers = [other for other in others if other.walk[0].id != visit.walk[0].id]
    return not any(
        _becomes(visit, other, wish.step_s) or _becomes(other, visit, wish.step_s)
        for other in strangers
    )


def _becomes(gone: Visit, come: Visit, step_s: float) -> bool:
    """Whether one comes so soon, and so near to where the other went, that they might be one."""
    soon = 0 <= (come.start - gone.last) * step_s < QUIET_S
    return soon and _between(gone.walk[-1], come.walk[0]) < FAR


def _between(one: Sprite, other: Sprite) -> float:
    return math.dist(one.place, other.place)


def who_shows(room: Room, there: Sequence[Sprite]) -> list[Mask]:
    """What of everyone shows who is in a room, as ``(h, w)`` of each cut."""
    nearest = np.where(np.isfinite(room.depth), room.depth, np.inf)
    shown = np.full(room.depth.shape, -1)
    for number in _far_to_near(there):
        one = there[number]
        depth = np.where(np.isfinite(one.depth), one.depth, one.away)
        mask = one.mask & (depth < nearest[one.within] + TOUCH)
        nearest[one.within][mask] = depth[mask]
        shown[one.within][mask] = number
    return [shown[one.within] == number for number, one in enumerate(there)]


def _far_to_near(there: Sequence[Sprite]) -> list[int]:
    return sorted(range(len(there)), key=lambda number: -there[number].away)


def truth_of(room: Room, there: Sequence[Sprite]) -> list[Annotation]:
    """Who is in view, and where."""
    truth: list[Annotation] = []
    for one, shows in zip(there, who_shows(room, there), strict=True):
        count = int(shows.sum())
        share = count / int(one.mask.sum())
        opened = cv2.morphologyEx(shows.astype(np.uint8), cv2.MORPH_OPEN, SPECK)
        box = mask_box(opened > 0)
        if count >= GONE_PX and share >= GONE and box is not None:
            counts = share > BARELY_VISIBLE
            truth.append(Annotation(one.id, box.moved(one.x, one.y), counts))
    return truth


def picture(room: Room, there: Sequence[Sprite], rng: np.random.Generator) -> tuple[Image, Floats]:
    """Colours and depth of a room with people in it, with the noise of both sensors."""
    color, depth = room.color.copy(), room.depth.copy()
    masks = who_shows(room, there)
    for number in _far_to_near(there):
        one, mask = there[number], masks[number]
        seen = depth[one.within]
        rim = cv2.dilate(mask.astype(np.uint8), RIM) > 0
        rim &= mask | ~(seen <= one.away)
        color[one.within][rim] = one.color[rim]
        seen[mask | (rim & ~one.mask & np.isnan(one.depth))] = np.nan
        read = mask & np.isfinite(one.depth)
        seen[read] = one.depth[read]
    depth += NOISE_DEPTH * rng.standard_normal(depth.shape, np.float32) * depth**2
    noisy = color + NOISE_COLOR * rng.standard_normal(color.shape, np.float32)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8), depth


def read_source(folder: Path, fps: float, camera: Intrinsics | None, every: int) -> Source:
    """What a recording has to compose others of.

    Args:
        folder: the recording.
        fps: frames per second, where it has no stamps.
        camera: intrinsics, where it has none.
        every: frames of which the new recordings have one.

    Raises:
        RgbdKcfError: where it cannot be read, no camera is known, or nobody walks freely.
    """
    files, people = read_with_depth(folder, fps, camera)
    if files.intrinsics is None:
        raise RecordingError(f'{folder} does not say by what camera: give --intrinsics')
    frames = [files.frame(index) for index in range(len(files))]
    if len({(frame.width, frame.height) for frame in frames}) > 1:
        raise RecordingError(f'{folder} holds frames of several sizes: they show no one room')
    room = empty_room(frames, people)
    stamps: FloatArray = np.diff(np.array(files.stamps_ns, np.float64))
    period_ns = float(np.median(stamps)) if len(stamps) else 1e9 / fps
    found = cut_outs(frames, people, room, files.intrinsics)
    walks = {who: walks_of(of, period_ns / 1e9, every) for who, of in found.items()}
    walks = {who: some for who, some in walks.items() if some}
    if not walks:
        raise RecordingError(
            f'{folder}: of every {every} frames there are no two after each other in which '
            'anybody walks freely before the room: check its ground truth'
        )
    return Source(room, walks, files.intrinsics, round(period_ns * every))


def compose(source: Source, wish: Wish, seed: int, out: Path) -> int:
    """Write a new recording, and return how often somebody comes in it.

    Args:
        source: what it is composed of.
        wish: what it is like.
        seed: of all that is random.
        out: is made.

    Raises:
        RgbdKcfError: where nobody comes, or it is there or cannot be made.
    """
    rng = np.random.default_rng(seed)
    visits = plan(source.walks, wish, rng)
    there = [
        [one for visit in visits if (one := visit.at(frame)) is not None]
        for frame in range(wish.length)
    ]
    truth = [truth_of(source.room, some) for some in there]
    if not any(truth):
        raise RecordingError(f'{out}: nobody comes in {wish.length} frames: give more as --length')
    with new_copy(out, 'rgb', 'depth'):
        for number, some in enumerate(there, start=1):
            write_pair(out, number, *picture(source.room, some, rng))
        write_truth(out, [frame * source.step_ns for frame in range(wish.length)], truth)
        write_camera(out, source.camera)
    return len(visits)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the recordings; status 2 where one cannot be made."""
    parser = parser_of('composed', __doc__)
    add_reading(parser)
    parser.add_argument(
        '--seeds', nargs='+', default=['1-3'], help='a recording for each: 1-3, or 1 2 3'
    )
    parser.add_argument('--every', type=int, default=1, help='frames of which they have one')
    parser.add_argument('--length', type=int, default=80, help='frames of each')
    parser.add_argument(
        '--absence', type=int, nargs=2, default=[5, 20], metavar=('LEAST', 'MOST'),
        help='frames until somebody comes again',
    )  # fmt: skip
    parser.add_argument('--together', type=int, default=3, help='people at once, at most')
    args = parser.parse_args(argv)
    _check(args, parser)
    camera = camera_of(args, parser)
    names = names_of(args.folders, parser)

    def copies() -> Iterator[str]:
        outs = {
            (folder, seed): args.out / f'{name}_x{args.every}_{seed}'
            for folder, name in zip(args.folders, names, strict=True)
            for seed in args.seeds
        }
        for out in outs.values():
            if out.exists():
                raise RecordingError(f'{out} is there already: give another --out')
        sources = {
            folder: read_source(folder, args.fps, camera, args.every) for folder in args.folders
        }
        for (folder, seed), out in outs.items():
            source = sources[folder]
            least, most = args.absence
            wish = Wish(args.length, (least, most), args.together, source.step_ns / 1e9)
            visits = compose(source, wish, seed, out)
            yield f'{out}: {args.length} pairs, {visits} visits of {len(source.walks)} people'

    return write_copies(args.out, args.folders, copies)


def _check(args: argparse.Namespace, parser: argparse.ArgumentParser) -> None:
    """Read the seeds, and end the command where a number makes no recording."""
    if args.every < 1:
        parser.error('--every must be 1 or more')
    if args.length < SHORTEST:
        parser.error(f'--length must be {SHORTEST} or more')
    if not 1 <= args.absence[0] <= args.absence[1]:
        parser.error('--absence must be two numbers from 1, the least first')
    if args.together < 1:
        parser.error('--together must be 1 or more')
    try:
        args.seeds = [seed for word in args.seeds for seed in parse_seeds(word)]
    except DatasetError as error:
        parser.error(str(error))
    if len(set(args.seeds)) < len(args.seeds):
        parser.error('--seeds must name each of them once')


if __name__ == '__main__':
    sys.exit(main())
