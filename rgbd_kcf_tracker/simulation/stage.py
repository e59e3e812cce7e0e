# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What scenario writers work with: a random room, camera and cast, and ways through the room."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.simulation import materials
from rgbd_kcf_tracker.simulation.actors import FacesActor, PersonActor
from rgbd_kcf_tracker.simulation.motion import CameraMotion, Keys, Motion, hand_waves
from rgbd_kcf_tracker.simulation.people import Person, random_person
from rgbd_kcf_tracker.simulation.room import Face, Room, box_faces, random_room
from rgbd_kcf_tracker.simulation.sensor import SensorOptions
from rgbd_kcf_tracker.simulation.wardrobe import Wardrobe
from rgbd_kcf_tracker.simulation.world import Actor, Gain, World

Point = tuple[float, float]
Timed = list[tuple[float, float, float]]


@dataclass(frozen=True)
class Scenario:
    """A kind of scene.

    Attributes:
        name: what the user types.
        description: one line.
        build: makes a scene on a stage.
        several: whether several people have ids, instead of one target.
    """

    name: str
    description: str
    build: Callable[[Stage], World]
    several: bool = False


SCENARIOS: dict[str, Scenario] = {}
ALL, PEOPLE = 'all', 'people'


def scenario(
    description: str, several: bool = False
) -> Callable[[Callable[[Stage], World]], Callable[[Stage], World]]:
    """Register the function under its own name."""

    def register(build: Callable[[Stage], World]) -> Callable[[Stage], World]:
        SCENARIOS[build.__name__] = Scenario(build.__name__, description, build, several)
        return build

    return register


def expand_names(names: Iterable[str]) -> list[str]:
    """Names of scenarios, each once, with the groups among them spelt out.

    ``'all'`` stands for every scenario of one target, ``'people'`` for those of several people.
    """
    groups = {
        name: [s.name for s in SCENARIOS.values() if s.several == several]
        for name, several in ((ALL, False), (PEOPLE, True))
    }
    return list(dict.fromkeys(one for name in names for one in groups.get(name, [name])))


class Stage:
    """A random room and camera for one seed, and helpers to fill them.

    Args:
        rng: source of all randomness.
        camera: of the colour image; decides how far out the picture reaches.
        size: width and height of the picture.
    """

    def __init__(self, rng: np.random.Generator, camera: Intrinsics, size: tuple[int, int]) -> None:
        self.rng = rng
        self.half_tan = size[0] / 2 / camera.fx
        self.depth = float(rng.uniform(5.0, 7.5))
        self.half_width = float(rng.uniform(0.62, 0.95) * self.depth)
        self.camera_height = self.pitch = 0.0
        self.place_camera(0.75, 1.6)
        self.cast: list[Wardrobe] = []

    def uniform(self, low: float, high: float) -> float:
        """A number between two bounds."""
        return float(self.rng.uniform(low, high))

    def place_camera(self, low: float, high: float) -> None:
        """Choose the camera's height, and a pitch that shows a person at 3 m from head to foot."""
        self.camera_height = self.uniform(low, high)
        self.pitch = math.atan((self.camera_height - 0.95) / 3.2) + self.uniform(-0.05, 0.07)

    def sign(self) -> int:
        """Left (-1) or right (1)."""
        return int(self.rng.choice([-1, 1]))

    def x(self, share: float, z: float) -> float:
        """Metres to the right at distance ``z`` of a share of the half picture (1: its border)."""
        return share * z * self.half_tan

    def shown_from(self, height: float) -> float:
        """Metres ahead from which a picture of 16:9 shows what is so high above the floor, if any.

        Of the size that is recorded, the world would depend on it.
        """
        edge = math.atan(self.half_tan * 9 / 16) - self.pitch
        return (height - self.camera_height) / math.tan(edge) if edge > 0 else math.inf

    def person(self, like: Wardrobe | None = None, child: bool = False) -> Person:
        """Somebody new, whose clothes differ clearly from the cast's unless given."""
        if like is None:
            like = Wardrobe.random(self.rng)
            for _ in range(8):
                if all(_differ(like, other) for other in self.cast):
                    break
                like = Wardrobe.random(self.rng)
            self.cast.append(like)
        return random_person(self.rng, like, child)[0]

    def tall_person(self) -> Person:
        """Somebody new who can hide others."""
        person = self.person()
        return replace(person, height=max(person.height, self.uniform(1.72, 1.8)))

    def walk(
        self, person: Person, points: Timed, heading: Keys | None = None,
        channels: Mapping[str, Keys] | None = None,
    ) -> PersonActor:  # fmt: skip
        """A person along timed points."""
        stride = 0.8 * person.height * self.uniform(0.92, 1.1)
        return PersonActor(person, Motion(
            points, heading=heading, stride=stride, phase=self.uniform(0, 6.28), channels=channels
        ))  # fmt: skip

    def bystander(self, z: tuple[float, float], share: tuple[float, float]) -> PersonActor:
        """Somebody who stands about."""
        far = self.uniform(*z)
        return self.walk(self.person(), [(0, self.x(self.uniform(*share), far), far)],
                         heading=[(0, self.uniform(-3, 3))])  # fmt: skip

    def extras(self, likely: float = 0.4) -> list[Actor]:
        """Perhaps one or two people who stand in the background."""
        if self.rng.uniform() > likely:
            return []
        count = int(self.rng.integers(1, 3))
        return [self.bystander((4.2, self.depth - 0.6), (-0.85, 0.85)) for _ in range(count)]

    def pushed_box(
        self, points: Timed, size: tuple[float, float, float], skin: str = 'cupboard'
    ) -> FacesActor:
        """A box on wheels along timed points."""
        return FacesActor(tuple(self.box_faces((0, 0), size, skin)), Motion(points), size[1])

    def box_faces(
        self, spot: Point, size: tuple[float, float, float], skin: str = 'cupboard',
        turn: float | None = None,
    ) -> list[Face]:  # fmt: skip
        """The faces of a box that stands at ``(x, z)``."""
        rng = self.rng
        make = {'cupboard': materials.cabinet, 'shelf': materials.bookshelf,
                'cardboard': materials.cardboard, 'wood': materials.wood}[skin]  # fmt: skip
        texture = make(rng, 384, max(96, int(384 * size[0] / size[1])))
        top = materials.wood(rng, 128, 128)
        turn = float(rng.normal(0, 0.12)) if turn is None else turn
        return box_faces(np.array([spot[0], 0.0, spot[1]]), size, turn, [texture, top])

    def occluder(self, room: Room, x: float, z: float, width: float, height: float) -> None:
        """Stand a cupboard, shelf, pile of boxes or partition in the room."""
        kind = str(self.rng.choice(['cupboard', 'shelf', 'cardboard', 'wood']))
        room.faces += self.box_faces((x, z), (width, height, self.uniform(0.25, 0.45)), kind)

    def room(self, clutter: tuple[int, int] = (2, 6)) -> Room:
        """The room with some furniture along its walls."""
        pieces = int(self.rng.integers(*clutter))
        return random_room(self.rng, self.depth, self.half_width, pieces)

    def scene(
        self, actors: Sequence[Actor], duration_s: float, *, room: Room | None = None,
        camera: CameraMotion | None = None, sensor: SensorOptions | None = None,
        light: Callable[[float], Gain] | None = None,
    ) -> World:  # fmt: skip
        """Put everything together; what is not given is random."""
        rng = self.rng
        sun = np.array([self.uniform(-1, 1), -1.0, self.uniform(-1.0, 0.2)])
        scene = World(
            room=room if room is not None else self.room(), actors=list(actors),
            camera=camera or CameraMotion(self.camera_height, self.pitch),
            duration_s=duration_s, sensor=sensor or self.sensor(), sun=sun,
        )  # fmt: skip
        brightness, warmth = rng.uniform(0.75, 1.1), rng.uniform(-0.07, 0.07)
        base = (brightness * (1 - warmth), brightness, brightness * (1 + warmth))
        over_time = light or self.flicker()

        def gain(t: float) -> Gain:
            b, g, r = over_time(t)
            return base[0] * b, base[1] * g, base[2] * r

        scene.light = gain
        return scene

    def flicker(self) -> Callable[[float], Gain]:
        """The automatic exposure's slow wander."""
        amount, rate, phase = self.uniform(0, 0.04), self.uniform(0.1, 0.5), self.uniform(0, 6)

        def gain(t: float) -> Gain:
            g = 1 + amount * math.sin(2 * math.pi * rate * t + phase)
            return g, g, g

        return gain

    def sensor(self, **changes: object) -> SensorOptions:
        """A camera with everyday flaws."""
        rng = self.rng
        shift = tuple(int(v) for v in rng.integers(-2, 3, 2)) if rng.uniform() < 0.3 else (0, 0)
        options = SensorOptions(
            color_noise=self.uniform(1.5, 5), softness=self.uniform(0.4, 1.0),
            depth_noise=self.uniform(0.7, 1.5), holes=self.uniform(0.0, 0.012),
            shift=(shift[0], shift[1]), narrow=bool(rng.uniform() < 0.3),
            exposure_s=self.uniform(0.006, 0.02),
        )  # fmt: skip
        return replace(options, **changes)  # type: ignore[arg-type]

    def hand_held(self, amount: float) -> CameraMotion:
        """A camera in a hand; ``amount`` in radians, 0.01 is calm."""
        return CameraMotion(self.camera_height, self.pitch, shake=amount,
                            waves=hand_waves(self.rng))  # fmt: skip


def _differ(a: Wardrobe, b: Wardrobe) -> bool:
    shirt = np.abs(np.subtract(a.colors[0], b.colors[0])).max()
    return bool(shirt > 60)


def route(points: Sequence[Point], speed: float, start: float = 0.0) -> Timed:
    """Way points with the times at which a walker of constant speed passes them.

    A point given twice in a row is a pause of half a second.
    """
    t = start
    timed = [(t, *points[0])]
    for (x0, z0), (x1, z1) in pairwise(points):
        length = math.hypot(x1 - x0, z1 - z0)
        t += length / speed if length > 1e-6 else 0.5
        timed.append((t, x1, z1))
    return timed
