# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Whether things that stand still are followed by a camera that moves, and how honest scores are.

    python -m rgbd_kcf_tracker.bench.things KITCHEN --things things.csv --fps 30 --strides 1 3 6
    python -m rgbd_kcf_tracker.bench.things --seeds 1-5

exits with 1 where of the boxes with scores of 0.9 and more fewer than 97 % are on the thing.

``things.csv`` says what to follow, a thing per line: ``name,frame,x,y,width,height``, frames
counted from 0, the box in pixels. Each is followed by itself, forwards and backwards in time, at
every frame, every third and so on.

**Truth of a recording** is where the thing stood in the world: the middle of its box, at the median
depth there, carried along with the camera; it holds only for what nobody moves. The camera's motion
is that of the recording's poses where its frames have them, else the sum of what the picture tells
over tenths of a second (by :mod:`~rgbd_kcf_tracker.metric.perceive.ego_motion`, which the tracker
uses too, at other steps and a lower resolution). Summed over fifths of a second it is another
estimate; where the two put a thing further apart than :data:`APART`, nothing is judged. A box is on
the thing by its middle alone: how well its sides fit this does not say.

**Truth of simulated rooms** is exact.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker import create_tracker
from rgbd_kcf_tracker.bench.things_room import furnished
from rgbd_kcf_tracker.cli.common import parse_intrinsics
from rgbd_kcf_tracker.errors import RecordingError, RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets.simulated import parse_seeds
from rgbd_kcf_tracker.evaluation.table import Cell, Table
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.perceive.colors import view_image
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.ego_motion import EgoMotion, Lost
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.recordings import ReadOptions, Recording, open_recording
from rgbd_kcf_tracker.recordings.files import read_text
from rgbd_kcf_tracker.recordings.storage import NANOSECONDS
from rgbd_kcf_tracker.simulation.picture import Truth as SimulatedTruth

SURE, HONEST = 0.9, 0.97
"""Score from which a box is a sure one, and the share of these that are to be on the thing."""
STEP_S = 0.1
"""Seconds over which the camera's motion is told for the truth: at 30 Hz a slow motion is none."""
APART = 0.15
"""Metres between two estimates of where a thing is from which nothing is judged: wider than the few
centimetres by which the motion is off, so that what is judged is not their error."""
MIDDLE = 0.2
"""Share of a box about its middle in which the depth of a thing is read."""
NEAR, NEAR_M = 0.6, 0.06
"""Share of a thing's width or height, and metres, by which a box's middle may be off its own: half
of it, as only a side may show, with a tenth and the centimetres by which the truth is off."""
WITHIN = 0.1
"""Share of a thing's width and height that may lie outside of the image while it is still to be
found: of less, a tracker may say that it is gone."""
VIEW = 320
"""Columns of the image in which the camera's motion is told: more than the tracker's."""
LEAST_M = 0.2
"""Metres before the camera from which anything is seen: what is nearer or behind is out of view."""
HIDES = 0.2
"""Metres by which what is read where a thing is expected is nearer, from which it hides it."""
LEAST = 10
"""Frames of a track at the least: shorter ones say little and would count as many."""
FOUND = 0.5
"""Share of a simulated thing from which it is to be found."""
BEGIN, LEAST_PIXELS = 0.9, 16
"""Share of one from which it can be chosen, and pixels of its sides at the least."""


@dataclass(frozen=True, slots=True)
class Thing:
    """What to follow.

    Attributes:
        name: of it.
        frame: in which it is chosen, from 0.
        box: of it there, pixels.
    """

    name: str
    frame: int
    box: Box


@dataclass(frozen=True, slots=True)
class Where:
    """Where a thing is in a frame.

    Attributes:
        box: about all of it, also what lies outside of the image; None behind the camera.
        shows: whether a tracker is to find it.
        slack: pixels by which the box may be off.
        hidden: whether something nearer is before its middle: a box there is not judged, as nobody
            knows what of the thing it is about, if anything.
    """

    box: Box | None
    shows: bool
    slack: float = 0.0
    hidden: bool = False

    def holds(self, box: Box) -> bool:
        """Whether another box is on the thing, by its middle."""
        mine = self.box
        if mine is None:
            return False
        return (
            abs(box.cx - mine.cx) <= NEAR * mine.width + self.slack
            and abs(box.cy - mine.cy) <= NEAR * mine.height + self.slack
        )


@dataclass(slots=True)
class Tracked:
    """What came of some tracks.

    Attributes:
        tracks: how many.
        frames: that were judged.
        right, wrong: boxes on the thing, and on something else.
        missed: frames without a box that show it.
        sure, sure_wrong: boxes with scores of :data:`SURE` and more; of those that are wrong.
    """

    tracks: int = 0
    frames: int = 0
    right: int = 0
    wrong: int = 0
    missed: int = 0
    sure: int = 0
    sure_wrong: int = 0

    def add(self, other: Tracked) -> None:
        """Count another one's tracks too."""
        for field in dataclasses.fields(self):
            total = getattr(self, field.name) + getattr(other, field.name)
            setattr(self, field.name, total)

    @property
    def honest(self) -> bool:
        """Whether sure boxes are on the thing."""
        return self.sure - self.sure_wrong >= HONEST * self.sure

    def row(self, name: str) -> tuple[Cell, ...]:
        """A row of the table."""
        share = 100 * (1 - self.sure_wrong / self.sure) if self.sure else None
        return (
            name, self.tracks, self.frames, self.right, self.missed, self.wrong, self.sure,
            self.sure_wrong, share,
        )  # fmt: skip


COLUMNS = (
    'things', 'tracks', 'frames', 'on it', 'missed', 'on something else', 'sure', 'sure, wrong',
    'of the sure on it, %',
)  # fmt: skip


def follow(frames: Iterable[Frame], wheres: Sequence[Where | None], box: Box) -> Tracked:
    """Follow what a box shows in the first frame through the others.

    Args:
        frames: in the order in which they are shown, their stamps rising.
        wheres: the truth about each; None where nothing is judged.
        box: of the thing, pixels.
    """
    tally, tracker = Tracked(tracks=1), create_tracker('metric')
    left = iter(frames)
    tracker.start(next(left), box)
    for frame, where in zip(left, wheres[1:], strict=True):
        track = tracker.update(frame)
        if where is None:
            continue
        right = track.box is not None and where.holds(track.box)
        if right and where.hidden:
            continue
        tally.frames += 1
        if track.box is None:
            tally.missed += where.shows
            continue
        sure = track.score >= SURE
        tally.right += right
        tally.wrong += not right
        tally.sure += sure
        tally.sure_wrong += sure and not right
    return tally


def both_ways(
    frames: Sequence[Frame], wheres: Sequence[Where | None], thing: Thing, stride: int
) -> Iterator[tuple[str, Tracked]]:
    """Follow a thing forwards and backwards in time; of each direction its name and what came."""
    ends = {'forwards': range(thing.frame, len(frames), stride),
            'backwards': range(thing.frame, -1, -stride)}  # fmt: skip
    first = frames[thing.frame].stamp_ns
    for name, order in ends.items():
        if len(order) < LEAST:
            continue
        shown = (
            dataclasses.replace(frame, stamp_ns=abs(frame.stamp_ns - first))
            for frame in map(frames.__getitem__, order)
        )
        yield name, follow(shown, [wheres[i] for i in order], thing.box)


# --- recordings --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """How a camera stood in one frame.

    Attributes:
        stretch: counts the stretches of frames through which its motion is known.
        pose: of the first frame's camera of that stretch in this one's.
    """

    stretch: int
    pose: Pose


def stands(frames: Sequence[Frame], step: int) -> list[Stand | None]:
    """How the camera stood in each frame, None where nothing tells.

    Args:
        frames: with depth and intrinsics.
        step: frames over which a motion is told; those between are each told from the one before
            them at such a step.
    """
    found: list[Stand | None] = []
    key, before, at = 0, frames[0], Stand(0, Pose(np.eye(3), np.zeros(3)))
    for index, frame in enumerate(frames):
        motion = _motion(before, frame) if index else Pose(np.eye(3), np.zeros(3))
        now = None if motion is None else Stand(at.stretch, at.pose.after(motion))
        if index - key == step:
            key, before = index, frame
            at = now or Stand(at.stretch + 1, Pose(np.eye(3), np.zeros(3)))
            now = at
        found.append(now)
    return found


def _motion(first: Frame, then: Frame) -> Pose | None:
    """The pose of one frame's camera in that of another, None where nothing tells it."""
    if first.pose is not None and then.pose is not None:
        return first.pose.after(then.pose.inverse)
    told, motion = EgoMotion(), None
    seconds = abs(then.stamp_ns - first.stamp_ns) * 1e-9
    for frame in (first, then):
        view = DepthView.of(frame, VIEW)
        assert view is not None
        image = view_image(frame.color, view.step)
        motion = told.update(image, view, np.zeros(view.shape, np.bool_), seconds)
    return None if isinstance(motion, Lost) else motion or Pose(np.eye(3), np.zeros(3))


def places(
    frames: Sequence[Frame], thing: Thing, estimates: Sequence[Sequence[Stand | None]]
) -> list[Where | None]:
    """Where a thing that stands still is in each frame, None where that is not known.

    Args:
        frames: with depth and intrinsics.
        thing: what was chosen.
        estimates: of how the camera stood, the first the best; see :func:`stands`.

    Raises:
        RecordingError: where the middle of the thing's box has no depth.
    """
    frame, box = frames[thing.frame], thing.box
    depth = _depth(frame, box.scaled(2 * MIDDLE))
    if depth is None or frame.intrinsics is None:
        raise RecordingError(
            f'{thing.name}: no depth in the middle of {box} in frame {thing.frame}: choose another'
        )
    here = np.array(frame.intrinsics.deproject(box.cx, box.cy, depth))
    found: list[Where | None] = []
    for index, now in enumerate(frames):
        points = []
        for estimate in estimates:
            begun, stand = estimate[thing.frame], estimate[index]
            if begun is not None and stand is not None and begun.stretch == stand.stretch:
                points.append(begun.pose.inverse.after(stand.pose).of(here))
        sure = len(points) == len(estimates) and np.ptp(points, axis=0).max() < APART
        found.append(_where(now, points[0], box, depth) if sure else None)
    return found


def _where(frame: Frame, point: npt.NDArray[np.float64], box: Box, depth: float) -> Where:
    k = frame.intrinsics
    assert k is not None
    x, y, z = point.tolist()
    if z < LEAST_M:
        return Where(None, False)
    size = depth / z
    whole = Box.from_center(
        x * k.fx / z + k.cx, y * k.fy / z + k.cy, box.width * size, box.height * size
    )
    inside = whole.clipped(frame.width, frame.height)
    if inside is None or inside.area < (1 - WITHIN) ** 2 * whole.area:
        return Where(whole, False, NEAR_M * k.fx / z)
    read = _depth(frame, whole.scaled(2 * MIDDLE))
    hidden = read is not None and read <= z - HIDES
    return Where(whole, not hidden, NEAR_M * k.fx / z, hidden)


def _depth(frame: Frame, box: Box) -> float | None:
    """Median depth in a box in metres, None where there is no reading."""
    assert frame.depth is not None
    inside = box.clipped(frame.width, frame.height)
    if inside is None:
        return None
    rows = slice(int(inside.y), math.ceil(inside.bottom))
    depth = frame.depth[rows, int(inside.x) : math.ceil(inside.right)]
    depth = depth[depth > 0]
    return float(np.median(depth)) if depth.size else None


def read_things(path: Path) -> list[Thing]:
    """The things of a file, see above.

    Raises:
        RecordingError: naming the line that says none.
    """
    things = []
    for number, line in enumerate(csv.reader(read_text(path).splitlines()), start=1):
        if not line or line[0].startswith('#') or line[0] == 'name':
            continue
        try:
            name, frame, *sides = line
            x, y, width, height = (float(side) for side in sides)
            if int(frame) < 0:
                raise ValueError
            things.append(Thing(name, int(frame), Box(x, y, width, height)))
        except (ValueError, RgbdKcfError):
            raise RecordingError(
                f'{path}, line {number}: {",".join(line)[:60]!r} is no thing: '
                'write name,frame,x,y,width,height'
            ) from None
    if not things:
        raise RecordingError(f'{path} names no thing: write name,frame,x,y,width,height')
    return things


class Recorded(Sequence[Frame]):
    """The frames of a recording, each read when it is asked for: together they may be many GB.

    Raises:
        RgbdKcfError: for one that cannot be read, or has no depth or camera.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording

    def __len__(self) -> int:
        return len(self._recording)

    def __getitem__(self, index: Any) -> Any:
        frame = next(self._recording.frames(index), None)
        if frame is None:
            raise IndexError
        if frame.depth is None or frame.intrinsics is None:
            raise RecordingError(
                f'{self._recording.path}: each image needs depth and a camera: give --intrinsics'
            )
        return frame


def recorded(
    frames: Sequence[Frame], folder: str, things: Sequence[Thing]
) -> list[list[Where | None]]:
    """Where each thing is in a recording's frames.

    Raises:
        RgbdKcfError: where they cannot be read, or end before a thing.
    """
    for thing in things:
        if thing.frame >= len(frames):
            raise RecordingError(
                f'{folder} has {len(frames)} frames, of which {thing.name} begins in {thing.frame}'
            )
    periods = np.diff([frame.stamp_ns for frame in frames])
    period = float(np.median(periods)) if len(periods) else 0.0
    # Of stamps that stand still each frame is a step.
    step = max(1, round(STEP_S * NANOSECONDS / period)) if period > 0 else 1
    estimates = [stands(frames, step), stands(frames, 2 * step)]
    return [places(frames, thing, estimates) for thing in things]


# --- simulated rooms ---------------------------------------------------------------------------


def simulated(seed: int) -> tuple[list[Frame], list[tuple[Thing, list[Where | None]]]]:
    """A furnished room's frames, and of each thing where it is in them."""
    moments = list(furnished(seed))
    things = []
    for number in moments[0].truths:
        truths = [moment.truths[number] for moment in moments]
        clear = (i for i, truth in enumerate(truths) if truth.visible_fraction >= BEGIN)
        first = next(clear, None)
        shown = None if first is None else truths[first].shown
        if first is None or shown is None or min(shown.width, shown.height) < LEAST_PIXELS:
            continue
        wheres: list[Where | None] = [exact(truth) for truth in truths]
        things.append((Thing(str(number), first, shown), wheres))
    return [moment.frame for moment in moments], things


def exact(truth: SimulatedTruth) -> Where:
    """Where a simulated thing is."""
    box = truth.body if truth.shown is not None else None
    return Where(box, truth.visible_fraction >= FOUND)


# --- the command -------------------------------------------------------------------------------


def measured(args: argparse.Namespace) -> tuple[Tracked, list[tuple[Cell, ...]]]:
    """What came of all, and a row for each stride."""
    things = read_things(args.things) if args.recording else []
    camera = None if args.intrinsics is None else parse_intrinsics(args.intrinsics)
    tallies = {stride: Tracked() for stride in args.strides}

    def count(frames: Sequence[Frame], thing: Thing, wheres: list[Where | None], name: str) -> None:
        for stride, total in tallies.items():
            for way, tally in both_ways(frames, wheres, thing, stride):
                total.add(tally)
                if tally.wrong:
                    print(
                        f'{name} {thing.name}, {way}, every {stride}: {tally.wrong} boxes on '
                        f'something else, of these {tally.sure_wrong} sure',
                        file=sys.stderr,
                    )

    if args.recording:
        options = ReadOptions(fps=args.fps, intrinsics=camera)
        with open_recording(args.recording, options) as recording:
            frames = Recorded(recording)
            wheres = recorded(frames, args.recording, things)
            for thing, where in zip(things, wheres, strict=True):
                count(frames, thing, where, args.recording)
        if not any(tally.frames for tally in tallies.values()):
            raise RecordingError(
                f'{args.recording}: nothing is judged: its tracks have fewer than {LEAST} frames, '
                "or the camera's motion is not known; give smaller --strides, or poses"
            )
    for seed in parse_seeds(args.seeds) if args.seeds else []:
        rendered, found = simulated(seed)
        for thing, where in found:
            count(rendered, thing, where, f'room {seed}')
    all_ = Tracked()
    for tally in tallies.values():
        all_.add(tally)
    if not all_.frames:
        raise RecordingError(f'--seeds {args.seeds}: nothing is judged: give smaller --strides')
    rows = [tally.row(f'every {stride}') for stride, tally in tallies.items()]
    return all_, [*rows, all_.row('all')]


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and print a table; status 1 where sure boxes are not on the things."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.things',
        description=(__doc__ or '').split('\n')[0],
    )
    parser.add_argument(
        'recording', nargs='?', metavar='RECORDING', help='in which nobody moves anything'
    )
    parser.add_argument('--things', type=Path, metavar='FILE', help='what to follow in it')
    parser.add_argument('--fps', type=float, default=30.0, help='of a recording without stamps')
    parser.add_argument('--intrinsics', metavar='FX,FY,CX,CY', help="the recording's camera")
    parser.add_argument('--seeds', default='', help='of simulated rooms, as 1-5')
    parser.add_argument(
        '--strides', nargs='+', type=int, default=[1], metavar='N', help='every so many frames'
    )
    args = parser.parse_args(argv)
    if not (args.recording or args.seeds):
        parser.error('give a RECORDING, or --seeds')
    if bool(args.recording) != bool(args.things):
        parser.error('a RECORDING and its --things go together')
    if min(args.strides) < 1:
        parser.error('--strides must be 1 or more')
    if not 0 < args.fps < math.inf:
        parser.error('--fps must be a number above 0')
    try:
        total, rows = measured(args)
    except RgbdKcfError as error:
        print(error, file=sys.stderr)
        return 2
    print(Table('things', 'Things before a camera that moves', COLUMNS, tuple(rows)).text())
    return 0 if total.honest else 1


if __name__ == '__main__':
    sys.exit(main())
