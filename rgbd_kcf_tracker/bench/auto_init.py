# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How often ``auto_init`` chooses what is no person, and how soon it chooses somebody.

    python -m rgbd_kcf_tracker.bench.auto_init --seeds 1-10
    python -m rgbd_kcf_tracker.bench.auto_init --seeds '' --people ROOM --empty KITCHEN --fps 5

exits with 1 where one choice in fifty or more was wrong.

Simulated: people; the same rooms without people; things that move in them; and life-size pictures
of people, on the walls and standing free. Recorded: folders with the truth about everyone in view,
and folders in which nobody is. After each choice the finder is asked for the next, as the node asks
it after a reset.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.cli.common import parse_intrinsics
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, open_dataset
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation, Sample, with_intrinsics
from rgbd_kcf_tracker.evaluation.datasets.base import Sequence as DatasetSequence
from rgbd_kcf_tracker.evaluation.datasets.simulated import parse_seeds
from rgbd_kcf_tracker.evaluation.table import Cell, Table
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.live.auto_init import AutoInit
from rgbd_kcf_tracker.live.settings import NodeParameters
from rgbd_kcf_tracker.recordings import ReadOptions, open_recording
from rgbd_kcf_tracker.recordings.recording import MAX_FPS, MIN_FPS
from rgbd_kcf_tracker.simulation import simulate
from rgbd_kcf_tracker.simulation.actors import PersonActor, VisitorActor
from rgbd_kcf_tracker.simulation.materials import wallpaper
from rgbd_kcf_tracker.simulation.motion import Motion
from rgbd_kcf_tracker.simulation.people import random_person
from rgbd_kcf_tracker.simulation.room import Face, face
from rgbd_kcf_tracker.simulation.sequence import SimulatedSequence
from rgbd_kcf_tracker.simulation.solids import Lighting
from rgbd_kcf_tracker.simulation.textures import Texture
from rgbd_kcf_tracker.simulation.wardrobe import Wardrobe
from rgbd_kcf_tracker.simulation.world import Viewpoint, World

RATE_HZ = 5.0
"""At which auto_init looks."""
SIZE = (640, 360)
RIGHT = 0.5
"""IoU with somebody's visible part from which a choice is right."""
CLEAR = 0.5
"""Share of a person that shows from which auto_init may be expected to find them."""

PEOPLE = (
    'normal', 'clutter', 'deformation', 'motion', 'crowd', 'lookalike', 'camera_motion', 'border',
    'crossing', 'passer_by', 'occlusion', 'behind_box', 'behind_chair', 'touching', 'holes',
    'misregistered', 'turning', 'comers', 'group_crossing', 'lookaround',
)  # fmt: skip
EMPTY = ('clutter', 'occlusion', 'camera_motion', 'comers', 'lookaround')
THINGS = ('behind_box', 'small_animal')
PICTURES = ('normal', 'clutter', 'camera_motion')
DURATION_S = 8.0


@dataclass(slots=True)
class Chosen:
    """What came of one kind of scenes.

    Attributes:
        scenes: how many.
        choices, wrong: boxes that were chosen; of those that are nobody's.
        first, first_wrong: the same of the first choice of each scene.
        looks, found: frames with somebody in range and in clear view, and of those with a choice
            that is right.
        seconds: until the first choice that is right, from the first such frame, of each scene that
            had both, in this order.
    """

    scenes: int = 0
    choices: int = 0
    wrong: int = 0
    first: int = 0
    first_wrong: int = 0
    looks: int = 0
    found: int = 0
    seconds: list[float] = dataclasses.field(default_factory=list)

    def add(self, other: Chosen) -> None:
        """Count another one's scenes too."""
        for field in dataclasses.fields(self):
            total = getattr(self, field.name) + getattr(other, field.name)
            setattr(self, field.name, total)

    def row(self, name: str) -> tuple[Cell, ...]:
        """A row of the table."""
        return (
            name,
            self.scenes,
            self.choices,
            self.wrong,
            100 * self.wrong / self.choices if self.choices else None,
            self.first,
            self.first_wrong,
            100 * self.found / self.looks if self.looks else None,
            float(np.median(self.seconds)) if self.seconds else None,
        )


COLUMNS = (
    'scenes', 'n', 'choices', 'wrong', 'wrong, %', 'first choices', 'wrong',
    'somebody found, %', 'seconds to it',
)  # fmt: skip


def judge(samples: Iterable[Sample], settings: NodeParameters) -> Chosen:
    """Let auto_init choose from frame to frame, and hold each choice against the truth."""
    tally, choose = Chosen(scenes=1), AutoInit(settings)
    begun: int | None = None
    waiting = seeking = True
    for sample in samples:
        frame = sample.frame
        clear = any(_in_range(p, frame, settings) for p in sample.people)
        if clear and begun is None:
            begun = frame.stamp_ns
        box = choose(frame)
        if box is not None and any(_ignored(box, p) for p in sample.people):
            continue
        tally.looks += clear
        if box is None:
            continue
        right = any(box.iou(p.box) >= RIGHT for p in sample.people if p.id >= 0)
        tally.choices += 1
        tally.wrong += not right
        tally.found += clear and right
        if waiting:
            waiting = False
            tally.first, tally.first_wrong = 1, int(not right)
        if seeking and right:
            seeking = False
            if begun is not None:
                tally.seconds.append((frame.stamp_ns - begun) * 1e-9)
    return tally


def _ignored(box: Box, person: Annotation) -> bool:
    """Whether a choice lies in a region, or on somebody, of whom the truth says nothing."""
    if person.id >= 0:
        return not person.counts and box.iou(person.box) >= RIGHT / 2
    return (
        person.box.x <= box.cx <= person.box.right and person.box.y <= box.cy <= person.box.bottom
    )


def _in_range(person: Annotation, frame: Frame, settings: NodeParameters) -> bool:
    if person.id < 0 or not person.counts or (person.share or 1.0) < CLEAR:
        return False
    inside = person.box.clipped(frame.width, frame.height)
    if inside is None or frame.depth is None:
        return False
    rows = slice(int(inside.y), int(np.ceil(inside.bottom)))
    cols = slice(int(inside.x), int(np.ceil(inside.right)))
    depth = frame.depth[rows, cols]
    depth = depth[np.isfinite(depth)]
    near, far = settings.auto_init_near, settings.auto_init_far
    return bool(depth.size) and bool(near < np.median(depth) < far)


# --- simulated scenes --------------------------------------------------------------------------


def rendered(scenario: str, seed: int, change: str) -> Iterator[Sample]:
    """A scene with the truth about everyone, changed: see the functions below."""
    made = simulate(scenario, seed=seed, rate_hz=RATE_HZ, size=SIZE)
    scene = made.scene
    rng = np.random.default_rng([seed, 77])
    if change in ('empty', 'things'):
        keep = [a for a in scene.actors if not isinstance(a, PersonActor | VisitorActor)]
        scene.actors = keep if change == 'things' else []
    elif change == 'pictures':
        if seed % 2:
            scene.actors = []
        scene.room.faces += _pictures(scene, rng, made.intrinsics)
    people = [i for i, a in enumerate(scene.actors) if isinstance(a, PersonActor | VisitorActor)]
    scene.people = tuple(people)
    count = round(min(scene.duration_s, DURATION_S) * RATE_HZ)
    offsets = [round(k * 1e9 / RATE_HZ) for k in range(count)]
    sequence = SimulatedSequence(
        scene, scenario, seed, RATE_HZ, offsets, made.size, made.intrinsics
    )
    for number, moment in enumerate(sequence):
        present = tuple(
            Annotation(who, truth.shown, body=truth.body, share=truth.visible_fraction)
            for who, truth in moment.truths.items()
            if truth.shown is not None
        )
        yield Sample(moment.frame, None, people=present, number=number)


def _pictures(scene: World, rng: np.random.Generator, camera: Intrinsics) -> list[Face]:
    """Life-size pictures of people: two on the back wall, one on a stand in the room."""
    wall = max(f.corner[2] for f in scene.room.faces)
    places = [
        (float(rng.uniform(-1.6, -0.5)), wall - 0.04),
        (float(rng.uniform(0.5, 1.6)), wall - 0.04),
    ]
    z = float(rng.uniform(2.0, 3.8))
    places.append((float(rng.uniform(-0.3, 0.3)) * z, z))
    faces = []
    for x, z in places:
        wide, high = float(rng.uniform(0.75, 1.0)), float(rng.uniform(1.85, 2.05))
        print_ = _print(rng, wide, high, camera)
        above = float(rng.uniform(0.0, 0.3)) if z > wall - 0.1 else 0.03
        corner = np.array([x - wide / 2, -high - above, z])
        faces.append(face(corner, np.array([wide, 0, 0]), np.array([0, high, 0]), print_))
    return faces


def _print(rng: np.random.Generator, wide: float, high: float, camera: Intrinsics) -> Texture:
    """Somebody who stands before a plain wall, as large as life, 200 pixels a metre."""
    rows, cols = round(high * 200), round(wide * 200)
    paper = wallpaper(rng, rows, cols)[:rows, :cols]
    person, _ = random_person(rng, Wardrobe.random(rng), False)
    actor = PersonActor(
        person, Motion([(0, 0.0, 4.0)], heading=[(0, float(rng.uniform(-0.5, 0.5)))])
    )
    focal = 200 * 4.0
    lens = Intrinsics(focal, focal, cols / 2, rows - 0.05 * 200)
    sun = np.array([0.3, -0.8, -0.5])
    view = Viewpoint(lens, np.eye(3), np.zeros(3), Lighting(sun / np.linalg.norm(sun)))
    layer = actor.draw(0.0, view, (0, 0, cols, rows), True)
    out: Texture = paper.copy()
    if layer is not None:
        h, w = layer.z.shape
        part = out[layer.y0 : layer.y0 + h, layer.x0 : layer.x0 + w]
        part[layer.mask] = layer.color[layer.mask]
    return out


# --- recordings --------------------------------------------------------------------------------


def recorded_people(
    text: str, fps: float, camera: Intrinsics | None
) -> Iterator[tuple[str, Iterator[Sample]]]:
    """The recordings of a folder, each with its name and the truth about everyone."""
    for sequence in open_dataset(text, DatasetOptions(fps=fps, everyone=True)):
        yield sequence.name, _samples(sequence, camera)


def _samples(sequence: DatasetSequence, camera: Intrinsics | None) -> Iterator[Sample]:
    samples = sequence.open().samples  # only when they are asked for: there may be many
    yield from samples if camera is None else with_intrinsics(samples, camera)


def recorded_empty(text: str, fps: float, camera: Intrinsics | None) -> Iterator[Sample]:
    """A recording in which nobody is, which needs no truth."""
    with open_recording(text, ReadOptions(fps=fps, intrinsics=camera)) as recording:
        for number, frame in enumerate(recording.frames()):
            yield Sample(frame, None, number=number)


# --- the command -------------------------------------------------------------------------------


def measured(args: argparse.Namespace) -> tuple[Chosen, list[tuple[Cell, ...]]]:
    """What was chosen in all, and a row for each kind of scene."""
    settings = NodeParameters(auto_init=True)
    seeds = parse_seeds(args.seeds) if args.seeds else []
    camera = None if args.intrinsics is None else parse_intrinsics(args.intrinsics)
    kinds: dict[str, list[tuple[str, Iterator[Sample]]]] = {}
    for kind, scenarios in (
        ('people', PEOPLE), ('empty', EMPTY), ('things', THINGS), ('pictures', PICTURES)
    ):  # fmt: skip
        kinds[kind] = [
            (f'{scenario}/{seed}', rendered(scenario, seed, kind))
            for scenario in scenarios
            for seed in seeds
        ]
    kinds['recorded people'] = [
        scene for f in args.people for scene in recorded_people(f, args.fps, camera)
    ]
    kinds['recorded, empty'] = [(f, recorded_empty(f, args.fps, camera)) for f in args.empty]
    total, rows = Chosen(), []
    for kind, scenes in kinds.items():
        tally = Chosen()
        for name, samples in scenes:
            one = judge(samples, settings)
            tally.add(one)
            if one.wrong:
                print(f'{kind} {name}: {one.wrong} of {one.choices} wrong', file=sys.stderr)
        if scenes:
            rows.append(tally.row(kind))
        total.add(tally)
    return total, rows


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and print a table; status 1 where a choice in fifty or more was wrong."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.auto_init',
        description=(__doc__ or '').split('\n')[0],
    )
    parser.add_argument('--seeds', default='1-5', help='of the simulated scenes; empty for none')
    parser.add_argument(
        '--people', nargs='*', default=[], metavar='FOLDER',
        help='recordings with the truth about everyone (mot.txt or groundtruth_PERSON.txt)',
    )  # fmt: skip
    parser.add_argument(
        '--empty', nargs='*', default=[], metavar='FOLDER', help='recordings in which nobody is'
    )
    parser.add_argument('--fps', type=float, default=5.0, help='of the recordings')
    parser.add_argument('--intrinsics', metavar='FX,FY,CX,CY', help="the recordings' camera")
    args = parser.parse_args(argv)
    if not MIN_FPS <= args.fps <= MAX_FPS:
        parser.error(f'--fps must be a number from {MIN_FPS:g} to {MAX_FPS:g}')
    try:
        total, rows = measured(args)
    except RgbdKcfError as error:
        print(error, file=sys.stderr)
        return 2
    rows.append(total.row('all'))
    print(Table('auto_init', 'What auto_init chooses', COLUMNS, tuple(rows)).text())
    return 0 if total.wrong < 0.02 * total.choices or not total.choices else 1


if __name__ == '__main__':
    sys.exit(main())
