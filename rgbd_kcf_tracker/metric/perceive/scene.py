# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""All that one frame shows to a tracker of surfaces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Image, Mask
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.perceive.colors import ColorCodes, view_image
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView, grown
from rgbd_kcf_tracker.metric.perceive.ego_motion import EgoMotion, Lost
from rgbd_kcf_tracker.metric.perceive.fading import ABOUT, STEP, Lately, around, fading
from rgbd_kcf_tracker.metric.perceive.floor import Floor, FloorFinder
from rgbd_kcf_tracker.metric.perceive.light import Light
from rgbd_kcf_tracker.metric.perceive.paint import Paint
from rgbd_kcf_tracker.metric.perceive.room import Room
from rgbd_kcf_tracker.metric.perceive.silhouette import Rim, Sides, Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import Sizes, Surfaces, standing, surfaces_in
from rgbd_kcf_tracker.metric.perceive.upright import HEIGHT, WIDTH, Shapes
from rgbd_kcf_tracker.pose import Pose

STILL, STILL_TURN = 0.003, 0.001
"""Metres and radians, a fifth of a pixel of the view, up to which a camera with poses stands."""
LEARNING_STEP = 0.09
"""Seconds after which what lasts (room, floor, looks, colours) is learned again while the
camera stands and frames come faster than twice as often: at 30 Hz from every third frame, and at
20 Hz and less from each."""
SHOWS = 0.2
"""Share of a view that has readings from which it tells where depth ends: of less, as where only
somebody before the camera is near enough, his outline would be that end."""
CAMERA_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""The axes along which places are told where no floor is known."""


@dataclass(frozen=True, eq=False)
class Scene:
    """One frame's depth, surfaces and colours at the resolution of the view.

    Attributes:
        view: the depth.
        floor: the floor, or None where none was found.
        elevation: ``(h, w)`` float32 metres above the floor, or None likewise.
        forward: ``(h, w)`` float32 metres along the floor, or along the optical axis where no floor
            is known.
        axes: ``(2, 3)`` unit vectors along the floor in the camera's frame, to the right and ahead;
            the camera's own where no floor is known.
        standing: ``(h, w)`` bool, pixels with a reading that are not floor.
        before: ``(h, w)`` bool, pixels that show something before the room.
        still: ``(h, w)`` bool, pixels that show the room where it was in the frames before.
        vacant: ``(h, w)`` bool, where the frames before have shown what is there when nobody is.
        known_for: ``(h, w)`` float32, see :attr:`Room.known_for`.
        surfaces: what stands on it.
        sizes: places and sizes of these.
        shapes: the same with their silhouettes.
        rim: columns and rows of the view that never have a reading.
        image: ``(h, w, 3)`` BGR, in the light of the first frame.
        codes: of its colours.
        motion: the pose of the last frame's camera in that of now; None where it stood still, Lost
            where it has moved and nothing tells how.
        way: the same for a place that is kept in the world: Lost also where depth shows what it
            showed before, as of a wall along which a camera turns, and only the picture does not.
        stood_for: seconds for which the camera has stood still, 0 while it moves.
        since: seconds since the last one from which looks and sizes were learned; None where
            nothing is to be learned from this one but where everybody is, see
            :data:`LEARNING_STEP`.
        lately: where those were a moment ago who may still be there.
    """

    view: DepthView
    floor: Floor | None
    elevation: Floats | None
    forward: Floats
    axes: FloatArray
    standing: Mask
    before: Mask
    still: Mask
    vacant: Mask
    known_for: Floats
    surfaces: Surfaces
    sizes: Sizes
    shapes: Shapes
    rim: Rim
    image: Image
    codes: ColorCodes
    motion: Pose | Lost | None
    way: Pose | Lost | None
    stood_for: float
    since: float | None
    lately: Sequence[Silhouette]

    @cached_property
    def large(self) -> Mask:
        """For each surface whether it is larger than anybody."""
        return larger_than_anybody(self.sizes)

    def ends(self, box: Box) -> Sides:
        """The sides at which a box of the image reaches the end of what depth sees."""
        b = box.over(self.view.step)
        return self.rim.reached(b.x, b.y, b.right, b.bottom, self.view)

    def top(self, seen: Silhouette) -> float | None:
        """Metres above the floor of a silhouette's upper end; None where it is cut off there.

        None where no floor is known, too.
        """
        return None if seen.cut.top else seen.highest(self.elevation)

    def silhouette(self, label: int) -> Silhouette:
        """One surface as a silhouette; the same for whoever asks."""
        return self.shapes.silhouette(label)


class SceneReader:
    """Reads frames of one stream; what does not change between them is remembered.

    Attributes:
        room: what stands still.
        somebody: ``(h, w)`` bool, pixels of the last view that belong to somebody, who may stand
            still without becoming part of the room; to be set by who decides. None for nobody.
        lately: who may still be where he was in the last view; to be set likewise.
        last_view: the depth of the last frame that had any.
        stood_for: seconds for which the camera has stood still, 0 while it moves.
        seems: how the camera seems to have moved to the last frame, by the picture: the pose of the
            frame before in that of now; None where nothing tells of a motion.

    Args:
        width: columns of the view.
        jump: metres of a depth step between two surfaces at no distance.
        jump_per_metre: by how much that grows with each metre.
        floor_margin: metres above the floor up to which a pixel is floor; 0 leaves the floor in.
    """

    def __init__(self, width: int, jump: float, jump_per_metre: float, floor_margin: float) -> None:
        self._width = width
        self._jump = jump
        self._jump_per_metre = jump_per_metre
        self._floor_margin = floor_margin
        self._floors = FloorFinder()
        self._level: Floor | None = None
        self._rim: Rim | None = None
        self._begun = False
        self._light = Light()
        self._paint = Paint()
        self._ego = EgoMotion()
        self._pose: Pose | None = None
        self._learned = self._taught = LEARNING_STEP
        self.seems: Pose | None = None
        self.room = Room()
        self.somebody: Mask | None = None
        self.lately: Sequence[Lately] = ()
        self.last_view: DepthView | None = None
        self.stood_for = math.inf
        self._unread = 0.0

    def read(self, frame: Frame, seconds: float) -> Scene | None:
        """The scene of a frame ``seconds`` after the last, or None where it has no depth."""
        self.seems = None
        self._unread += seconds
        view = DepthView.of(frame, self._width)
        # Where the room was read and now nothing is, the camera has failed for a moment.
        if view is None or (not view.depth.any() and self.room.depth.any()):
            return None
        # To what depth shows the frames without it are a pause.
        seconds, self._unread = self._unread, 0.0
        self.last_view = view
        if view.shape != self.room.depth.shape:
            self._rim, self._floors, self._level = None, FloorFinder(), None
        unlearned, since = self._due(seconds)
        learns = unlearned is not None
        image = view_image(frame.color, view.step)
        motion = way = self._move(image, view, frame.pose, seconds)
        if isinstance(way, Lost) and self.room.agrees(view.depth, way.surely):
            motion, way = None, way if way.surely else None
        floor = (
            self._floors.update(view, seconds, learns, motion) if self._floor_margin > 0 else None
        )
        elevation = floor.elevation(view.depth) if floor is not None else None
        forward, axes = view.depth, CAMERA_AXES
        level = self._level_after(floor, view, motion)
        if level is not None:
            above = level.elevation(view.depth) if elevation is None else elevation
            forward = level.forward(view.depth, above)
            axes = level.axes(view.intrinsics)
        mask = standing(view, elevation, self._floor_margin)
        surfaces = surfaces_in(view.depth, mask, self._jump, self._jump_per_metre)
        sizes = Sizes.of(surfaces, view.intrinsics)
        rim = self._rim_of(view, learns)
        self.stood_for = self.stood_for + seconds if motion is None else 0.0
        shapes = Shapes(view, surfaces, sizes, elevation, forward, axes[0], rim)

        stands = way is None and view.shape == self.room.depth.shape
        lately = self.lately if stands and seconds <= STEP else ()
        if not stands:
            self._paint.restart()
        closer = self._closer(image, view, lately)
        self._see_room(shapes, motion, seconds, learns, closer)
        before = self.room.before
        image = self._light.steadied(image, ~before, learns)
        if unlearned is not None:
            still = self.room.still if closer is None else self.room.still & ~closer
            self._paint.learn(image, still, unlearned)
        return Scene(
            view=view,
            floor=floor,
            elevation=elevation,
            forward=forward,
            axes=axes,
            standing=mask,
            before=before,
            still=self.room.still,
            vacant=self.room.vacant,
            known_for=self.room.known_for,
            surfaces=surfaces,
            sizes=sizes,
            shapes=shapes,
            rim=rim,
            image=image,
            codes=ColorCodes(image),
            motion=motion,
            way=way,
            stood_for=self.stood_for,
            since=since,
            lately=[each.seen for each in lately],
        )

    def _closer(self, image: Image, view: DepthView, lately: Sequence[Lately]) -> Mask | None:
        """See :meth:`Room.update`: what shows about those who fade, unlike the room."""
        if not lately:
            return None
        part = around(lately)
        unlike = self._paint.differs(self._light.as_before(image[part]), part)
        if unlike is None:
            return None
        hardly = np.zeros(view.shape, np.bool_)
        hardly[part] = unlike & self.room.hardly(view.depth, part)
        faded = fading(lately, hardly)
        if faded is None:
            return None
        closer = grown(faded, ABOUT)
        closer[part] &= unlike  # nor is there any of it elsewhere
        return closer

    def _level_after(
        self, floor: Floor | None, view: DepthView, motion: Pose | Lost | None
    ) -> Floor | None:
        """Along what places are told: the floor, or where it was while nothing shows of it.

        A floor that goes out of sight, hidden by somebody near, moves nobody.
        """
        if isinstance(motion, Lost):
            self._level = None
        elif isinstance(motion, Pose) and self._level is not None:
            self._level = self._level.carried(motion, view.intrinsics)
        self._level = floor or self._level
        return self._level

    def _rim_of(self, view: DepthView, learns: bool) -> Rim:
        """Where depth ends, by this view and those before."""
        if self._rim is None:
            shows = np.count_nonzero(view.depth) > SHOWS * view.depth.size
            self._rim = Rim.of(view) if shows else None
        elif learns:
            self._rim = Rim.of(view).common(self._rim)
        return self._rim or Rim()

    def _due(self, seconds: float) -> tuple[float | None, float | None]:
        """Seconds since the room, and looks, were last learned; None where not from this frame."""
        self._learned += seconds
        self._taught += seconds
        moves = self.stood_for == 0.0
        fast = not moves and 0 < seconds < LEARNING_STEP / 2
        learns = not fast or self._learned >= LEARNING_STEP
        # Where frames come fast, looks are learned from another one than the room: none takes long.
        teaches = not fast or (self._taught >= LEARNING_STEP and not learns)
        unlearned = self._learned if learns else None
        since = self._taught if teaches else None
        if learns:
            self._learned = 0.0
        if teaches:
            self._taught = 0.0
        return unlearned, since

    def _see_room(
        self,
        shapes: Shapes,
        motion: Pose | Lost | None,
        seconds: float,
        learns: bool,
        closer: Mask | None,
    ) -> None:
        """Show the room a view; ``shapes`` tells who in it is a person by his shape alone."""
        view, surfaces = shapes.view, shapes.surfaces
        begins = self.room.depth.shape != view.shape or isinstance(motion, Lost)
        if begins or not self._begun:
            # A camera that warms up sends images without readings: people come with the first.
            self._begun = bool(view.depth.any())
            self.room.restart(view.depth, shapes.upright().mask)
            self._light.restart()
            return
        somebody, undecided = self.somebody, None
        if isinstance(motion, Pose):
            unknown = self.room.moved(motion, view.intrinsics)
            people = shapes.upright(whole=True)
            large = larger_than_anybody(shapes.sizes)
            going_on = self.room.going_on(view.depth, surfaces, large, view.intrinsics, seconds)
            opened = (people.mask | going_on.somebody) & unknown
            opened |= self.room.passing(people.tall, view.depth, surfaces)
            self.room.open(opened, view.depth)
            # Whose other side comes into view next may be somebody or something, and so may
            # be what somebody touches.
            undecided = _at_side(view, surfaces, shapes.rim, large) | going_on.beyond
            self._light.restart()
            somebody = None
        self.room.update(view.depth, seconds, somebody, surfaces, learns, undecided, closer)
        if motion is None and learns:
            moved = self.room.moved_part_of(surfaces, view.intrinsics)
            if moved.any():
                self.room.open(shapes.stirring(moved, self.room.before), view.depth)

    def settle(self) -> None:
        """Do what an answer need not wait for."""
        self._ego.settle()

    def is_somebody(self, seen: Silhouette) -> None:
        """Take the pixels of a silhouette of the last scene out of what stands still."""
        if self.last_view is not None:
            self.room.open(seen.in_view(self.last_view.shape), self.last_view.depth)

    def is_furniture(self, seen: Silhouette) -> None:
        """Take the pixels of a silhouette of the last scene into what stands still."""
        if self.last_view is not None:
            self.room.close(seen.in_view(self.last_view.shape), self.last_view.depth)

    def is_room(self, seen: Silhouette, scene: Scene) -> bool:
        """Whether a silhouette of the last scene turns out to be part of the room it stands before.

        It is taken into it then.
        """
        mask = seen.in_view(scene.view.shape)
        return self.room.goes_on(mask, scene.view.depth, scene.surfaces, scene.large)

    def _move(
        self, image: Image, view: DepthView, now: Pose | None, seconds: float
    ) -> Pose | Lost | None:
        """How the camera has moved: by its poses where both frames have one, else as it seems."""
        last = self._pose
        before = self.room.before
        if before.shape != view.shape:
            before = np.zeros(view.shape, np.bool_)
        seems = self._ego.update(image, view, before, seconds)
        self.seems = seems if isinstance(seems, Pose) else None
        if last is None or now is None:  # a pose after one that is missing may be of another map
            self._pose = now
            return seems
        moved = last.after(now.inverse)
        if moved.turn < STILL_TURN and moved.shift < STILL:
            return None  # what it creeps counts from where it stood
        self._pose = now
        return moved


def _at_side(view: DepthView, surfaces: Surfaces, rim: Rim, large: Mask) -> Mask:
    """Pixels, ``(h, w)`` bool, of surfaces that are not ``large`` and go on beside the view."""
    left, width = surfaces.boxes[:, 0], surfaces.boxes[:, 2]
    beyond = (left <= 1 + rim.left) | (left + width >= view.shape[1] - 1 - rim.right)
    beyond &= ~large
    beyond[0] = False
    return beyond[surfaces.labels]


def larger_than_anybody(sizes: Sizes) -> Mask:
    """Which surfaces are, ``(n,)`` bool."""
    return (sizes.width > WIDTH[1]) | (sizes.height > HEIGHT[1])
