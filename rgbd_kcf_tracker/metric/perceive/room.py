# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What stands still: the farthest that was seen steadily along each pixel, and what is before it.

Whatever is nearer than the room is somebody, or something that was moved. The room is learned while
it is used: a place that turns out to be farther was hidden by somebody, and what comes to stand
still and belongs to nobody becomes part of the room.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats, Mask
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.metric.perceive.depth_view import NEAREST, closed
from rgbd_kcf_tracker.metric.perceive.surfaces import Surfaces
from rgbd_kcf_tracker.pose import Pose

NOISE = 0.08
NOISE_PER_SQUARE_METRE = 0.012
"""Metres by which readings of the same place differ: three deviations of a structured-light
camera's noise, which grows with the square of depth (Khoshelham and Elberink 2012), and the shift
of outlines between depth and colour."""
CLOSER = 0.35
"""Share of that which is enough where something else says that it is not the room: one deviation,
beside the shift of outlines."""
BLIND_FRAMES = 3
"""Frames without a reading after which a pixel is known to have none: a reading there is new."""
GONE_FRAMES = 2 * BLIND_FRAMES
"""Frames without a reading after which whatever was known of a pixel is not there any more."""
_ANY_NUMBER = np.uint8(255 - BLIND_FRAMES)
BLEND = 0.1
"""Share of a new reading in the room's depth: the mean of some twenty, whose noise is a quarter of
one's."""
SETTLE = 3.0
"""Seconds for which something that is nobody's must have stood still to become part of the room."""
AGREEING = 0.5
"""Share of readings where they were from which the camera stands where it stood, and of the room
that has readings from which a view tells what has none any more."""
AT_HAND = 1.2
"""Metres from the camera within which somebody hides most of the room: who is 0.6 m wide fills half
of a view of 60 degrees from there."""
TELLS = 0.05
"""Share of the room that must show, at the least, to tell that it is another: who is so close that
he gives no reading leaves some at his outline."""
MOST = 0.5
"""Share of where a part of a surface that was hidden meets what is known, along which it goes on as
the room, from which that part is room, too; and of somebody's pixels, from which they are his."""
GOES_ON = 0.25
"""Share of a surface that must be known to stand before the room for the rest of it to be somebody
too, if no more of it is room or it has a person's shape."""
GOES_ON_AREA = 0.06
"""Square metres of it that are enough whatever its size, about a head and a shoulder: who walks
into the view of a camera that turns shows more beyond its last end than within."""
ALL = 0.9
"""Share of it before the room from which nothing of it is the room: some rim is always left."""
REACH = 0.5
"""Metres from the middle of somebody as far as which a surface that is larger than anybody may
still be he: half of someone with arms half spread. Who touches a desk is not the desk."""
LEAP, LEAP_PER_SECOND = 0.2, 1.5
"""Metres by which the depth of a person goes up from one frame to the next at the most; where it
goes up by more he has gone, and what shows is the room behind him."""
CLOSE = 1.0
"""Metres behind a person up to which the room stays known: he may walk up to it in a second, and
when it shows again only that tells it from him."""
BEHIND = 0.4
"""Metres behind a person from which what shows in his place, and goes on as the room, is the room:
he himself may have stepped back by less (at 5 Hz by 0.3), and touch a far wall."""
SEAM = 5
"""Pixels, two to each side, as far as which there often is no reading about somebody, as two depths
mix there. What is read there first, when he moves, would be the room, and cut him in two."""


def tolerance(depth: Floats) -> Floats:
    """Metres by which a reading may differ from another of the same place, ``(h, w)``."""
    allowed: Floats = np.square(depth)
    allowed *= np.float32(NOISE_PER_SQUARE_METRE)
    allowed += np.float32(NOISE)
    return allowed


def _leap(dt: float, noise: Floats) -> Floats:
    """Metres by which the depth of somebody may have gone up, given the noise of each reading."""
    leap: Floats = np.float32(LEAP + LEAP_PER_SECOND * min(dt, 1.0)) + noise
    return leap


def _seen_from(depth: Floats, motion: Pose, k: Intrinsics) -> Floats:
    """A depth image as the moved camera sees it, ``(h, w)``, 0 where nothing is known."""
    rows, cols = depth.shape
    v, u = np.nonzero(depth)
    z = depth[v, u]
    points = np.stack(((u - k.cx) * z / k.fx, (v - k.cy) * z / k.fy, z), axis=1)
    x, y, ahead = (points @ motion.rotation.T + motion.translation).astype(np.float32).T
    inside = ahead > NEAREST
    x, y, ahead = x[inside], y[inside], ahead[inside]
    column = np.rint(x * np.float32(k.fx) / ahead + np.float32(k.cx)).astype(np.int32)
    row = np.rint(y * np.float32(k.fy) / ahead + np.float32(k.cy)).astype(np.int32)
    inside = (column >= 0) & (column < cols) & (row >= 0) & (row < rows)
    place, ahead = row[inside] * cols + column[inside], ahead[inside]
    # The nearest of those that fall on one pixel is written last.
    order = np.argsort(-ahead)
    seen = np.zeros(rows * cols, np.float32)
    seen[place[order]] = ahead[order]
    seen = seen.reshape(rows, cols)
    # Where the view is spread, single pixels stay empty between two of the same surface.
    for axis, side, ends in ((1, (1, 3), np.s_[:, (0, -1)]), (0, (3, 1), np.s_[(0, -1), :])):
        beside = cv2.dilate(seen, np.ones(side, np.uint8))
        hole = (seen == 0) & (np.roll(seen, 1, axis) > 0) & (np.roll(seen, -1, axis) > 0)
        hole[ends] = False
        seen[hole] = beside[hole]
    return seen


def _continues_room(part: Mask, known: Mask, nearer: Mask, surfaces: Surfaces) -> Mask:
    """Surfaces, ``(n,)`` bool, that are the room where a part of them meets what is known.

    They do not stand before it more than they are of it, either.

    Args:
        part: ``(h, w)`` bool, the part.
        known: ``(h, w)`` bool, pixels with a reading where the room is known.
        nearer: ``(h, w)`` bool, those of them that show something before it.
        surfaces: of the view.
    """
    before, of_it = (
        np.bincount(surfaces.labels[each], minlength=len(surfaces))
        for each in (nearer, known & ~nearer)
    )
    left, top, width, height = cv2.boundingRect(part.view(np.uint8))
    about = slice(max(top - 1, 0), top + height + 1), slice(max(left - 1, 0), left + width + 1)
    part, known, labels = part[about], known[about], surfaces.labels[about]
    room = known & ~nearer[about]
    meets, goes_on = np.zeros((2, len(surfaces)), np.intp)
    first, last = np.s_[:-1], np.s_[1:]
    for here, there in (
        (np.s_[:, first], np.s_[:, last]),
        (np.s_[:, last], np.s_[:, first]),
        (np.s_[first, :], np.s_[last, :]),
        (np.s_[last, :], np.s_[first, :]),
    ):
        ends = np.nonzero(part[here] & known[there])
        mine = labels[here][ends]
        same = room[there][ends] & (mine == labels[there][ends])
        meets += np.bincount(mine, minlength=len(meets))
        goes_on += np.bincount(mine[same], minlength=len(meets))
    result: Mask = (goes_on > MOST * meets) & (before <= of_it)
    result[0] = False
    return result


def _enough(before: npt.NDArray[np.intp], surfaces: Surfaces, k: Intrinsics) -> Mask:
    """Surfaces, ``(n,)`` bool, of which enough stands before the room for all to be somebody.

    ``before`` is ``(n,)``, how many of their pixels do, and ``k`` of the view.
    """
    share = before / np.maximum(surfaces.pixels, 1)
    enough: Mask = (share > GOES_ON) | (share * surfaces.areas(k) > GOES_ON_AREA)
    enough[0] = False
    return enough


def _about(somebody: Mask, depth: Floats) -> Floats:
    """Depth of somebody in his pixels and in the seam without a reading about them, 0 elsewhere."""
    front: Floats = np.where(somebody, depth, np.float32(0))
    if front.size:
        read = depth > 0
        beside = cv2.dilate(front, np.ones((SEAM, SEAM), np.uint8))
        np.copyto(front, beside, where=closed(read, SEAM) & ~read)
    return front


@dataclass(frozen=True, slots=True, eq=False)
class GoingOn:
    """What goes on from somebody as one surface: pixels of a view.

    Attributes:
        somebody: ``(h, w)`` bool, what may be he.
        beyond: ``(h, w)`` bool, what is farther from his middle than anybody reaches: something, or
            somebody else, that he touches.
    """

    somebody: Mask
    beyond: Mask


class Room:
    """The room as one view sees it.

    Attributes:
        depth: ``(h, w)`` float32 metres of the room, 0 where it is not known.
        before: ``(h, w)`` bool, the pixels of the last frame that show something before the room.
        still: ``(h, w)`` bool, those that show the room where it was in the frames before.
        vacant: ``(h, w)`` bool, where these have shown what is there when nobody is, be it nothing.
        known_for: ``(h, w)`` float32 seconds since something left that had been before it; infinite
            where nothing has, where the camera moved since, and where nobody was found in it.
    """

    def __init__(self) -> None:
        self.restart(np.zeros((0, 0), np.float32), np.zeros((0, 0), np.bool_))

    def restart(self, depth: Floats, somebody: Mask) -> None:
        """Take a first view, ``(h, w)`` metres, all of which is room but ``somebody``."""
        self.depth = np.where(somebody, np.float32(0), depth)
        self.before = somebody & (depth > 0)
        self.still = np.zeros(depth.shape, np.bool_)
        self.vacant = ~self.before
        self.known_for = np.full_like(depth, np.inf)
        self._farther = np.zeros_like(depth)
        front = _about(somebody, depth)
        self._blind = np.where(front > 0, np.uint8(BLIND_FRAMES), np.uint8(0))
        self._still, self._still_for = np.zeros_like(depth), np.zeros_like(depth)
        self._front = front
        self._stood, self._stood_at = np.zeros_like(depth), np.zeros_like(depth)
        self._time = self._unlearned = 0.0

    def open(self, somebody: Mask, depth: Floats) -> None:
        """Take pixels, ``(h, w)`` bool, out of the room: they turned out to be somebody.

        What is known to be close behind them stays so: when it shows again, only that tells it from
        them. Of what is farther the leap in depth does, and says where it is by then.
        """
        self.before |= somebody & (depth > 0)
        self.vacant &= ~somebody
        somebody = somebody & ~(self._nearer(depth) & (self.depth < depth + np.float32(CLOSE)))
        self.depth[somebody] = 0
        self._blind[somebody] = BLIND_FRAMES
        self._front[somebody] = depth[somebody]

    def close(self, part: Mask, depth: Floats) -> None:
        """Take pixels, ``(h, w)`` bool, into the room: they turned out to be part of it."""
        self.depth[part] = depth[part]
        self.known_for[part] = np.inf
        self._blind[part] = 0
        self.before &= ~part

    def passing(self, people: Mask, depth: Floats, surfaces: Surfaces) -> Mask:
        """Those of people's pixels, ``(h, w)`` bool, whose surface does not stand before the room.

        They passed for the room as they were first seen. ``depth`` is ``(h, w)`` metres.
        """
        nearer = people & self._nearer(depth)
        theirs, before = (
            np.bincount(surfaces.labels[each], minlength=len(surfaces)) for each in (people, nearer)
        )
        return people & (before < MOST * theirs)[surfaces.labels]

    def _nearer(self, depth: Floats) -> Mask:
        """Pixels, ``(h, w)`` bool, that show something before the room as far as it is known."""
        return (depth > 0) & (self.depth > 0) & (self.depth - depth > tolerance(depth))

    def hardly(self, depth: Floats, part: tuple[slice, slice]) -> Mask:
        """Pixels of a part of a view, bool, nearer than the room by less than tells them from it.

        Args:
            depth: ``(h, w)`` metres, of the whole view.
            part: its rows and columns.
        """
        depth, room = depth[part], self.depth[part]
        nearer, allowed = room - depth, tolerance(depth)
        near: Mask = (nearer > np.float32(CLOSER) * allowed) & (nearer <= allowed)
        return near

    def agrees(self, depth: Floats, surely: bool = True) -> bool:
        """Whether a view, ``(h, w)`` metres, mostly shows the room where it was.

        Args:
            depth: the view.
            surely: False where nothing else says that the camera has moved: then what is close
                before the room is somebody, who hides it, and the rest tells, if there is any; a
                later view will. Else he would be the room from then on, and what is behind him
                somebody.
        """
        if depth.shape != self.depth.shape:
            return False
        both = (depth > 0) & (self.depth > 0)
        if not surely:
            both &= ~((depth < np.float32(AT_HAND)) & self._nearer(depth))
            if np.count_nonzero(both) < TELLS * np.count_nonzero(self.depth):
                return bool(self.depth.any())
        same = np.abs(depth - self.depth)[both] <= 0.5 * tolerance(depth)[both]
        return bool(same.size and same.mean() > AGREEING)

    def moved(self, motion: Pose, k: Intrinsics) -> Mask:
        """See the room from where the camera is now.

        Args:
            motion: the pose of the last camera's frame in that of now.
            k: of the view.

        Returns:
            ``(h, w)`` bool, the pixels of which nothing is known any more.
        """
        front = np.where((self.depth == 0) & (self._blind >= BLIND_FRAMES), self._front, 0)
        self.depth = _seen_from(self.depth, motion, k)
        self._front = _seen_from(front.astype(np.float32), motion, k)
        unknown = self.depth == 0
        opened = unknown & (self._front > 0)
        self._blind = np.where(opened, np.uint8(BLIND_FRAMES), np.uint8(0))
        self._farther = _seen_from(self._farther, motion, k)
        self._still_for = np.zeros_like(self.depth)
        self._stood = np.zeros_like(self.depth)
        self.known_for = np.full_like(self.depth, np.inf)
        self.vacant = ~unknown
        lost: Mask = unknown & ~opened
        return lost

    def goes_on(self, somebody: Mask, depth: Floats, surfaces: Surfaces, large: Mask) -> bool:
        """Whether somebody, ``(h, w)`` bool, goes on as the room along most of where he meets it.

        Then he is part of it, and is taken into it.

        Args:
            somebody: his pixels.
            depth: ``(h, w)`` metres of the last view.
            surfaces: of it.
            large: ``(n,)`` bool, those of them that nobody can be.
        """
        known = (depth > 0) & (self.depth > 0) & ~somebody
        nearer = known & self._nearer(depth)
        room = large & _continues_room(somebody, known, nearer, surfaces)
        part = somebody & room[surfaces.labels]
        if np.count_nonzero(part) <= MOST * np.count_nonzero(somebody):
            return False
        self.close(part, depth)
        return True

    def going_on(
        self, depth: Floats, surfaces: Surfaces, large: Mask, k: Intrinsics, dt: float
    ) -> GoingOn:
        """What may be somebody as it goes on as one surface from what stands before the room.

        Args:
            depth: ``(h, w)`` metres of a view.
            surfaces: of it.
            large: ``(n,)`` bool, those of them that nobody can be.
            k: of the view.
            dt: seconds since the last.
        """
        valid, known, count = depth > 0, self.depth > 0, len(surfaces)
        # Where somebody stood, what is far behind him is not he.
        gone = (self._front > 0) & (depth > self._front + _leap(dt, tolerance(depth)))
        nearer = self._nearer(depth)
        nearer |= ~known & (self._blind >= BLIND_FRAMES) & ~gone
        nearer &= valid
        theirs = surfaces.labels[nearer]
        before = np.bincount(theirs, minlength=count)
        room = np.bincount(surfaces.labels[valid & known & ~nearer], minlength=count)
        whose = (before > room) & _enough(before, surfaces, k)
        somebody: Mask = whose[surfaces.labels]
        rows, columns = np.nonzero(somebody)
        label = surfaces.labels[rows, columns]
        middle = np.bincount(theirs, np.nonzero(nearer)[1], count) / np.maximum(before, 1)
        far = large[label] & (np.abs(columns - middle[label]) * depth[rows, columns] > REACH * k.fx)
        beyond = np.zeros_like(somebody)
        beyond[rows[far], columns[far]] = True
        return GoingOn(somebody & ~beyond, beyond)

    def moved_part_of(self, surfaces: Surfaces, k: Intrinsics) -> Mask:
        """Surfaces of the last view, ``(n,)`` bool, of which some is not where the room was.

        Those are left out that stand before it as a whole. ``k`` is of the view.
        """
        before, moved = (
            np.bincount(surfaces.labels[each], minlength=len(surfaces))
            for each in (self.before, self.before | (self._farther > 0))
        )
        return _enough(moved, surfaces, k) & (before < ALL * surfaces.pixels)

    def update(
        self,
        depth: Floats,
        dt: float,
        somebody: Mask | None,
        surfaces: Surfaces,
        learns: bool = True,
        undecided: Mask | None = None,
        closer: Mask | None = None,
    ) -> None:
        """Compare the next view with the room and learn from it.

        Args:
            depth: ``(h, w)`` metres, 0 where there is no reading; of the size of the first.
            dt: seconds since the last.
            somebody: ``(h, w)`` bool, pixels that belonged to somebody in the last view, who may
                stand still for as long as he likes; None for nobody.
            surfaces: of the view.
            learns: whether the room is learned from it, or only compared.
            undecided: ``(h, w)`` bool, pixels that are not taken for room where it is not known;
                None for none.
            closer: ``(h, w)`` bool, pixels that show something before it however little nearer they
                are; None for none.
        """
        self._time += dt
        self.known_for += np.float32(dt)
        valid = depth > 0
        known = self.depth > 0
        allowed = tolerance(depth)
        nearer = self.depth - depth
        both = valid & known
        before = both & (nearer > allowed)
        if closer is not None:
            before |= both & closer & (nearer > np.float32(CLOSER) * allowed)
        same = both & (np.abs(nearer) <= allowed) & ~before
        farther = both & ~(before | same) if learns else None
        new = valid & ~known
        open_ = np.flatnonzero(new & (self._blind >= BLIND_FRAMES))
        if len(open_):
            np.put(before, open_, self._taken(open_, depth, dt, allowed, both, before, surfaces))
        self.before, self.still = before, same
        self.vacant |= known
        new &= ~before
        if undecided is not None:
            new &= ~undecided
            # A reading unlike all about it is noise, and would hide what is behind it from then on.
            new &= np.abs(depth - cv2.medianBlur(depth, 3)) <= allowed
        np.copyto(self.depth, depth, where=new)
        self._blind *= ~both
        missing = (~valid).view(np.uint8)
        np.minimum(self._blind, missing * _ANY_NUMBER + BLIND_FRAMES, out=self._blind)
        # A view of which most is missing says nothing of the place.
        if valid.any() and np.count_nonzero(both) >= AGREEING * np.count_nonzero(known):
            cv2.add(self._blind, missing, self._blind)  # stays at the highest
            # What was known of a pixel that has no reading any more was somebody, who has gone.
            gone = self._blind >= GONE_FRAMES
            np.copyto(self.depth, 0, where=gone)
            np.copyto(self._front, 0, where=gone)
            self.vacant |= gone
        self._unlearned += dt
        if farther is None:
            return
        nearer *= same if closer is None else same & ~closer  # nor is who hardly shows learned
        nearer *= np.float32(BLEND)
        self.depth -= nearer
        again = farther & (np.abs(depth - self._farther) <= allowed)
        np.copyto(self.depth, depth, where=again)
        np.copyto(self.known_for, np.float32(0), where=again)
        self._farther = depth * farther
        self._settle(depth, self._unlearned, allowed, somebody)
        self._unlearned = 0.0

    def _taken(
        self,
        open_: npt.NDArray[np.intp],
        depth: Floats,
        dt: float,
        allowed: Floats,
        known: Mask,
        nearer: Mask,
        surfaces: Surfaces,
    ) -> Mask:
        """Which of the places where the room is not known show somebody, ``(n,)`` bool.

        Args:
            open_: their indices, ``(n,)``.
            depth: of the view.
            dt: seconds since the last.
            allowed: of the depth, see :func:`tolerance`.
            known: ``(h, w)`` bool, the places where it is known that have a reading.
            nearer: ``(h, w)`` bool, those of them that show something before the room.
            surfaces: of the view.
        """
        now, front = np.take(depth, open_), np.take(self._front, open_)
        noise = np.take(allowed, open_)
        leap = _leap(dt, noise)
        left = (front > 0) & (now > front + leap)
        # What is farther than who stood there, and goes on as the room, is the room.
        behind = ~left & (now > front + np.float32(BEHIND))
        if behind.any():
            hidden = np.zeros(depth.shape, np.bool_)
            np.put(hidden, open_[behind], True)
            room = _continues_room(hidden, known, nearer, surfaces)
            left |= behind & room[np.take(surfaces.labels, open_)]
        # Who stood there shows again when another has passed before him.
        stood = np.take(self._stood, open_)
        lately = self._time - np.take(self._stood_at, open_) < SETTLE
        left &= ~(lately & (now < stood + noise))
        np.put(self._blind, open_[left], 0)
        np.put(self.known_for, open_[left], 0)
        # Who passes before somebody does not take his place.
        taken: Mask = ~left
        stands = taken & (np.abs(now - front) < 0.5 * noise) & ~(lately & (now < stood - noise))
        np.put(self._stood, open_[stands], now[stands])
        np.put(self._stood_at, open_[stands], self._time)
        stays = taken & (now > front - leap)
        np.put(self._front, open_[stays], now[stays])
        return taken

    def _settle(self, depth: Floats, dt: float, allowed: Floats, somebody: Mask | None) -> None:
        still = self.before & (np.abs(depth - self._still) <= np.float32(0.5) * allowed)
        if somebody is not None:
            still &= ~somebody
        # What comes where something stood before it left has only come now.
        np.copyto(self._still, depth * self.before, where=~still)
        self._still_for += np.float32(dt)
        self._still_for *= still
        settled = self._still_for > SETTLE
        if settled.any():
            self.depth[settled] = depth[settled]
            self.known_for[settled] = np.inf
            self.before &= ~settled
