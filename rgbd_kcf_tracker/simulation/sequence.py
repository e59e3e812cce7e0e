# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The sequence of frames that a camera records of a scene, with the truth about each."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.simulation.actors import VisitorActor, velocity_of
from rgbd_kcf_tracker.simulation.picture import Backdrop, Picture, Truth
from rgbd_kcf_tracker.simulation.sensor import Sensor
from rgbd_kcf_tracker.simulation.solids import Vector
from rgbd_kcf_tracker.simulation.world import World

EPOCH_NS = 1_700_000_000_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedFrame:
    """A frame and the truth about it.

    Attributes:
        frame: what the camera recorded.
        truths: where everybody with an id is, by id; the target is 1.
    """

    frame: Frame
    truths: Mapping[int, Truth]

    @property
    def truth(self) -> Truth:
        """Where the target is."""
        return self.truths[1]

    @property
    def visible(self) -> Box | None:
        """See `Truth`."""
        return self.truth.visible

    @property
    def body(self) -> Box | None:
        """See `Truth`."""
        return self.truth.body

    @property
    def visible_fraction(self) -> float:
        """See `Truth`."""
        return self.truth.visible_fraction

    @property
    def distance(self) -> float:
        """See `Truth`: of a target that is away, where it left."""
        return self.truth.distance


class SimulatedSequence:
    """A recorded scene; frames are rendered when asked for.

    ``len()``, indexing and iteration give `SimulatedFrame`; any order gives the same frames.

    Args:
        scene: what happens.
        scenario: its name.
        seed: of the camera's noise.
        rate_hz: frames per second.
        offsets_ns: of each frame from the start of the scene.
        size: width and height of the picture.
        intrinsics: of the camera.
    """

    def __init__(
        self, scene: World, scenario: str, seed: int, rate_hz: float, offsets_ns: Sequence[int],
        size: tuple[int, int], intrinsics: Intrinsics,
    ) -> None:  # fmt: skip
        self.scene, self.scenario, self.seed, self.rate_hz = scene, scenario, seed, rate_hz
        self.size, self.intrinsics = size, intrinsics
        self._offsets_ns = tuple(offsets_ns)
        self._key = [seed, zlib.crc32(scenario.encode())]
        self._sensor = Sensor(
            scene.sensor, intrinsics, size, np.random.default_rng([*self._key, 7])
        )
        self._backdrop = Backdrop(scene, intrinsics, size)

    def __len__(self) -> int:
        """Number of frames."""
        return len(self._offsets_ns)

    def __iter__(self) -> Iterator[SimulatedFrame]:
        """Frames in order."""
        return (self[i] for i in range(len(self)))

    def __getitem__(self, index: int) -> SimulatedFrame:
        """Render one frame."""
        if isinstance(index, slice):
            raise TypeError(
                'a frame is rendered when it is asked for: ask for one, not for a slice'
            )
        offset_ns = self._offsets_ns[index]
        t = offset_ns * 1e-9
        rng = np.random.default_rng([*self._key, offset_ns // 1000])
        picture = Picture(self._backdrop, t)
        options = self.scene.sensor
        color = self._sensor.color(picture.color, self.scene.light(t), rng)
        depth = None
        if options.has_depth:
            later = (
                picture
                if options.delay_s == 0
                else Picture(self._backdrop, t + options.delay_s, False)
            )
            blind = any(a <= t < b for a, b in options.no_target_depth)
            depth = self._sensor.depth(
                later.depth, picture.color, later.target_mask if blind else None, rng
            )
        frame = Frame(color, depth, self.stamp_ns(index), self.intrinsics)
        return SimulatedFrame(frame, picture.truths())

    def stamp_ns(self, index: int) -> int:
        """Stamp of a frame without rendering it."""
        return EPOCH_NS + self._offsets_ns[index]

    def truth(self, index: int) -> Truth:
        """The truth about the target in one frame, several times faster than the frame."""
        return self.truths(index)[1]

    def truths(self, index: int) -> dict[int, Truth]:
        """The truth about everybody with an id in one frame, without rendering its colours."""
        return Picture(self._backdrop, self._offsets_ns[index] * 1e-9, shade=False).truths()

    def camera_pose(self, index: int) -> tuple[Vector, Vector]:
        """The camera's rotation ``(3, 3)`` and place ``(3,)`` in metres at one frame.

        A point of the optical frame is at ``rotation @ point + place`` in the room, whose axes are
        right, down and forward, with the floor at 0 below the camera's first place.
        """
        rotation, place = self.scene.camera.at(self._offsets_ns[index] * 1e-9)
        return rotation.T, place

    def velocity(self, index: int) -> tuple[float, float, float]:
        """The target's over the ground at one frame, metres per second in the optical frame.

        Of a target that is away it means nothing, nor does its position: see `Truth`.
        """
        t = self._offsets_ns[index] * 1e-9
        target = self.scene.actors[self.scene.people[0]]
        if isinstance(target, VisitorActor):
            moved = target.velocity(t)
        else:
            moved = velocity_of(target.centre, t)
        rotation, _ = self.scene.camera.at(t)
        x, y, z = (float(v) for v in rotation @ moved)
        return x, y, z

    @property
    def people(self) -> tuple[int, ...]:
        """The ids of those whose truth is told: 1 is the target."""
        return tuple(range(1, len(self.scene.people) + 1))
