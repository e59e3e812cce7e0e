# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The default tracker: the thesis's ideas carried out in metres, for one target or several.

A frame is perceived once for all (:mod:`~rgbd_kcf_tracker.metric.perceive.scene`): depth cuts it
into surfaces, and what stands before the room is somebody. Everyone is accounted for together
(:mod:`~rgbd_kcf_tracker.metric.decide.crowd`), so that what belongs to one cannot be claimed by
another; then each chosen target is followed with care (:mod:`~rgbd_kcf_tracker.metric.follower`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.metric.by_surface import Candidate
from rgbd_kcf_tracker.metric.decide.account import RECENT, Account
from rgbd_kcf_tracker.metric.decide.crowd import Crowd
from rgbd_kcf_tracker.metric.decide.cues import Cue
from rgbd_kcf_tracker.metric.decide.visible_box import outline_box
from rgbd_kcf_tracker.metric.follower import LEARNED, Follower
from rgbd_kcf_tracker.metric.identity.describer import Describer
from rgbd_kcf_tracker.metric.identity.embedding import Embedding, Onnx
from rgbd_kcf_tracker.metric.identity.middle import in_metres, row_by_row, sighted, triple
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.figures import makes_figure
from rgbd_kcf_tracker.metric.perceive.room import SETTLE
from rgbd_kcf_tracker.metric.perceive.scene import SceneReader
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.track import Track, TrackState, require_inside

SHORTEST_STEP = 1e-3
LONGEST_STEP = 5.0
"""Seconds between two frames; stamps that stand still or jump are taken as these."""
SAME_CAMERA = 0.02
"""Share by which the focal length of one camera may be told otherwise: more than calibrations of it
differ by, and less than anybody's height is known to."""
SAME_BOX = 0.5
"""Overlap (intersection over union) with a target's box from which a box shows that target, as is
common for matching boxes: of two of one size, each then holds two thirds of the other."""
TURNS = 30.0
"""Times a second, of all targets together, that one followed by its look is searched for or learned
from: each of a camera's 30 frames a second has time for one of them, whatever else it shows. One
target has a turn in every frame, eight have one in a quarter of a second each, in which a look
hardly changes; at 5 Hz six have theirs in every frame."""


class MetricTargets:
    """Follows the targets that were chosen, and, where asked to, everyone else.

    Args:
        parameters: see :class:`MetricParameters`.
        cues: further ones for the verdict.
        first: the number by which cues know the first person.
        embedding: describes people, instead of the network that the parameters name.

    Raises:
        ParameterError: where the network that the parameters name cannot be run.

    Attributes:
        everyone: whether people whom nobody chose get tracks too.
        puts_off: whether what can wait until an answer is out waits for :meth:`settle`, or else for
            the next frame: the answers are the same, if a frame's images stay as they were so long.
        account: how the last frame was explained; None where it had no depth.
        embedding: what describes people; None where nothing does.
    """

    def __init__(
        self,
        parameters: MetricParameters,
        cues: Sequence[Cue] = (),
        first: int = 1,
        embedding: Embedding | None = None,
    ) -> None:
        self._parameters = parameters
        self._cues = cues
        self.embedding = _network_of(parameters) if embedding is None else embedding
        self.everyone = self.puts_off = self._unlearned = False
        self.account: Account | None = None
        self._last_account: Account | None = None
        self._reader, self._crowd = self._new_memory(first)
        self._followers: dict[int, Follower] = {}
        self._waiting: list[int] = []
        self._names: dict[int, int] = {}
        self._next = 1
        self._stamp_ns: int | None = None
        self._time = 0.0
        self._frame: Frame | None = None
        self._camera: Intrinsics | None = None
        self._metres: Intrinsics | None = None
        self._told_at: float | None = None
        self._size = 0, 0

    def __len__(self) -> int:
        return len(self._followers)

    def add(self, frame: Frame, box: Box) -> int:
        """Follow what is in ``box`` of ``frame``, the last that was given or the next.

        Returns:
            Its id, which is kept as long as the set lives.

        Raises:
            BoxError: where no whole pixel of the box lies inside the frame.
        """
        require_inside(box, frame)
        self.settle()
        if self._frame is not frame:
            if self._followers:  # where they were in the last frame, others stand in this
                self.update(frame)
            else:
                self._perceive(frame)
                self._unlearned = True
            self._learn()
        follower = self._follower(frame, box)
        number = self._shown_in(box, follower)
        if number is None:
            number = self._name(follower.person)
        elif follower.person is None and self._followers[number].person is not None:
            return number  # it is followed by more than its look already
        else:
            self._replaced(number, follower)
        self._followers[number] = follower
        return number

    @property
    def next_person(self) -> int:
        """The number by which cues will know who is new."""
        return self._crowd.next

    @property
    def camera_motion(self) -> Pose | None:
        """How the camera seems to have moved in the last frame, by the picture, not by its poses.

        The pose of the last frame's camera in that of now; None where nothing tells of a motion.
        """
        return self._reader.seems

    def remove(self, number: int) -> None:
        """No longer follow the target of that id.

        Raises:
            KeyError: where there is none.
        """
        self._learn()
        follower = self._followers.pop(number)
        if follower.person is not None:
            follower.person.chosen = False

    def update(self, frame: Frame) -> dict[int, Track]:
        """The tracks of the next frame by id. Never raises for what the picture shows."""
        if not self._followers and not self.everyone:
            self._frame = None
            return {}
        self.settle()
        if self._in_other_metres(frame):
            self._start_over(frame)
            tracks = {number: each.track for number, each in self._followers.items()}
            return {**tracks, **self._others(frame)} if self.everyone else tracks
        dt = self._perceive(frame)
        turns = self._turns(dt)
        view = self._reader.last_view
        if view is not None and self.account is None:  # the image may have another size by now
            view = view.at(frame, self._parameters.view_width)
        tracks = {
            number: dataclasses.replace(
                follower.step(frame, self.account, view, dt, number in turns), id=number
            )
            for number, follower in self._followers.items()
        }
        # Of whom depth shows nothing at first it is not known for a while who he is.
        self._names |= {f.person.number: n for n, f in self._followers.items() if f.person}
        self._unlearned = True
        if self.everyone:
            self._learn()
            tracks.update(self._others(frame))
        if not self.puts_off:
            self.settle()
        return tracks

    def settle(self) -> None:
        """Do what was put off, see :attr:`puts_off`."""
        self._learn()
        self._reader.settle()
        for follower in self._followers.values():
            follower.settle()

    def weighed(self, number: int) -> list[tuple[Candidate, Box]]:
        """What was weighed for a target in the last frame, see :meth:`Follower.weighed`."""
        return self._followers[number].weighed()

    def started(self, number: int) -> Track:
        """The track of the frame in which a target was added."""
        return dataclasses.replace(self._followers[number].first, id=number)

    def person(self, number: int) -> Person | None:
        """Whom an id belongs to, None where that is not known or forgotten."""
        for person in self._crowd.people:
            if self._names.get(person.number) == number:
                return person
        return None

    # -- parts ------------------------------------------------------------------------------------

    def _new_memory(self, first: int) -> tuple[SceneReader, Crowd]:
        p = self._parameters
        reader = SceneReader(p.view_width, p.jump, p.jump_per_metre, p.floor_margin)
        self._describer = None if self.embedding is None else Describer(self.embedding)
        return reader, Crowd(first, self._describer)

    def _follower(self, frame: Frame, box: Box) -> Follower:
        """Whoever is in a box of the frame that was perceived."""
        account = self._lately
        follower = Follower(frame, account, self._crowd, box, self._parameters, self._cues)
        if account is not None and follower.seen is not None:
            # Whoever stood there from the first frame on was taken for a part of the room.
            self._reader.is_somebody(follower.seen)
            if follower.person is not None:
                follower.person.figure |= makes_figure(account.scene, follower.seen)
        return follower

    @property
    def _lately(self) -> Account | None:
        """The account of the last frame, or of the one before that if only that one had depth."""
        before = self._last_account
        if self.account is None and before is not None and self._time - before.time < RECENT:
            return before
        return self.account

    @property
    def _chosen(self) -> dict[int, Follower]:
        """Who follows whom: by the numbers of those of whom it is known who they are."""
        return {f.person.number: f for f in self._followers.values() if f.person is not None}

    def _in_other_metres(self, frame: Frame) -> bool:
        """Whether the camera turns out to be another than was taken so far, and all are seen.

        So it is where the first images come before the intrinsics do: whatever is remembered is in
        metres that were a guess. While somebody is hidden, that is all that is known of him.
        """
        taken = self._metres
        if taken is None or frame.intrinsics is None or frame.depth is None:
            return False
        if self._size != (frame.width, frame.height):
            return False
        if abs(frame.intrinsics.fx / taken.fx - 1) < SAME_CAMERA:
            self._told_at = None
            return False
        if self._told_at is None:
            self._told_at = self._time
        elif self._time - self._told_at > SETTLE:  # by now most is remembered in the right ones
            self._metres = frame.intrinsics
            return False
        return all(f.track.box is not None for f in self._followers.values())

    def _start_over(self, frame: Frame) -> None:
        """Start on all where they were a frame ago: what was remembered is in other metres."""
        before = {number: each.track for number, each in self._followers.items()}
        others = self._others(frame) if self.everyone else {}
        self._reader, self._crowd = self._new_memory(self._crowd.next)
        self._names, self._followers, self._metres = {}, {}, None
        self._perceive(frame)
        self._unlearned = True
        self._learn()
        for number, track in before.items():
            assert track.box is not None
            follower = self._follower(frame, track.box)
            if follower.person is not None and follower.person.number in self._names:
                # Of two whose boxes overlap one is the surface: the other is known by his look.
                follower = Follower(
                    frame, None, self._crowd, track.box, self._parameters, self._cues
                )
            self._followers[number] = follower
            follower.track = dataclasses.replace(follower.first, id=number, score=track.score)
            if follower.person is not None:
                self._names[follower.person.number] = number
        if others and self.account is not None:
            self._names |= self._names_again(self.account, others)

    def _names_again(self, account: Account, before: dict[int, Track]) -> dict[int, int]:
        """The ids of those whom nobody chose and who are where they were a frame ago."""
        names: dict[int, int] = {}
        for person, index in account.in_view.items():
            if person.number in self._names:
                continue
            box = outline_box(account.scene, account.sights[index].seen)
            for name, track in before.items():
                near = track.box is not None and track.box.iou(box) >= SAME_BOX
                if near and name not in names.values():
                    names[person.number] = name
                    break
        return names

    def _perceive(self, frame: Frame) -> float:
        dt = 0.0
        if self._stamp_ns is not None:
            dt = frame.seconds_since(self._stamp_ns, SHORTEST_STEP, LONGEST_STEP)
        self._stamp_ns = frame.stamp_ns
        self._time += dt
        self._frame = frame
        size = frame.width, frame.height
        if size != self._size:
            self._size, self._camera, self._metres = size, None, None
            self._last_account = None
        self._camera = frame.intrinsics or self._camera
        if frame.intrinsics is None and self._camera is not None:
            # A guess would put the room and everybody elsewhere.
            frame = dataclasses.replace(frame, intrinsics=self._camera)
        if frame.depth is not None and self._metres is None:
            self._metres, self._told_at = self._camera or Intrinsics.guess(*size), None
        scene = self._reader.read(frame, dt) if self._parameters.use_surfaces else None
        self.account = None
        if self._describer is not None:
            self._describer.frame = frame
        if scene is not None:
            self.account = self._crowd.explain(scene, self._time, self._reader.is_somebody)
            self._last_account = self.account
        return dt

    def _turns(self, dt: float) -> list[int]:
        """Which targets followed by their look have their turn: who has waited longest."""
        depth = self.account is not None
        numbers = [number for number, each in self._followers.items() if each.by_look(depth)]
        waiting = [number for number in self._waiting if number in numbers]
        waiting += [number for number in numbers if number not in waiting]
        count = max(1, round(TURNS * dt))
        self._waiting = waiting[count:] + waiting[:count]
        return waiting[:count]

    def _learn(self) -> None:
        """Learn from the last frame, once."""
        if self.account is None or not self._unlearned:
            return
        self._unlearned = False
        chosen = self._chosen
        targets = {number: each.seen for number, each in chosen.items()}
        unsure = {number for number, each in chosen.items() if each.track.score < LEARNED}
        self._crowd.learn(self.account, targets, unsure)
        surely = [
            each for number, each in targets.items() if each is not None and number not in unsure
        ]
        self._reader.somebody = self.account.somebody(surely)
        for person, calm, silhouette in self.account.calm:
            self._reader.is_furniture(silhouette)
            self._crowd.is_furniture(person, calm)
            for follower in self._followers.values():
                if follower.person is person:
                    follower.lose(self._time - calm.since)
        self._reader.lately = self.account.lately()
        # What a camera that moves sees for the first time, behind something, passes for the room.
        if self._reader.stood_for < SETTLE:
            for seen in surely:
                self._reader.is_somebody(seen)
            # And what had somebody's shape while only a part of it was in view may be room.
            for person, seen in self.account.unmoved:
                if self._reader.is_room(seen, self.account.scene):
                    person.upright = False

    def _shown_in(self, box: Box, follower: Follower) -> int | None:
        """The id of the target that a box of the last frame is about, None for nobody's.

        ``follower`` is one that would follow what is in it.
        """
        mine = follower.person
        for number, each in self._followers.items():
            if mine is not None and each.person is mine:
                return number
        for number, each in self._followers.items():
            unsure = mine is None or each.person is None or each.glimpsed is not None
            shown = each.track.box
            if unsure and shown is not None and shown.iou(box) >= SAME_BOX:
                return number
        return None

    def _replaced(self, number: int, follower: Follower) -> None:
        """Take whom a follower has found for who had an id until now."""
        before, now = self._followers[number].person, follower.person
        if before is not None and before is not now:
            self._crowd.forget(before)
        if now is not None:
            self._names[now.number] = number

    def _name(self, person: Person | None) -> int:
        """The id of a person, or a new one."""
        if person is not None and person.number in self._names:
            return self._names[person.number]
        name = self._next
        self._next += 1
        if person is not None:
            self._names[person.number] = name
        return name

    def _others(self, frame: Frame) -> dict[int, Track]:
        """Tracks of those whom nobody chose, as far as they are in view or were a moment ago."""
        chosen = set(self._chosen)
        numbers = {person.number for person in self._crowd.people}
        self._names = {n: name for n, name in self._names.items() if n in numbers}
        tracks = {} if self.account is None else self._in_view(frame, self.account)
        for person in self._crowd.people:
            gone = self._time - person.seen_at
            if person.number in self._names and person.number not in chosen and gone > 0:
                name = self._names[person.number]
                if gone < self._parameters.lost_after and name not in tracks:
                    tracks[name] = Track(None, TrackState.OCCLUDED, id=name)
        return tracks

    def _in_view(self, frame: Frame, account: Account) -> dict[int, Track]:
        """Tracks of those in view whom nobody chose."""
        tracks: dict[int, Track] = {}
        # Who is followed as a target may to the account still be somebody new.
        shown = {
            account.sight_of(seen)
            for f in self._followers.values()
            for seen in (f.seen, f.glimpsed)
            if seen is not None
        }
        for person, index in account.in_view.items():
            if index in shown or not person.alive:
                continue
            seen = account.sights[index].seen
            box = outline_box(account.scene, seen)
            belief = in_metres(sighted(account.scene.view, seen), frame)
            tracks[self._name(person)] = Track(
                box,
                TrackState.TRACKING,
                account.probability(person, index),
                seen.depth,
                None if belief is None else triple(belief.position),
                id=self._name(person),
                covariance=None if belief is None else row_by_row(belief.covariance),
            )
        return tracks


def _network_of(parameters: MetricParameters) -> Embedding | None:
    """The network that parameters name, if they do.

    Raises:
        ParameterError: where it cannot be run.
    """
    p = parameters
    if not p.embedding:
        return None
    return Onnx(p.embedding, p.embedding_even, p.embedding_steepness)


class MetricTracker:
    """One target: the same as :class:`MetricTargets` with one.

    Args:
        parameters: see :class:`MetricParameters`.
        cues: further ones for the verdict.

    Raises:
        ParameterError: see :class:`MetricTargets`.
    """

    def __init__(self, parameters: MetricParameters, cues: Sequence[Cue] = ()) -> None:
        self._parameters, self._cues = parameters, cues
        self._embedding = _network_of(parameters)
        self._targets: MetricTargets | None = None
        self._number = 0

    def weighed(self) -> list[tuple[Candidate, Box]]:
        """What was weighed in the last frame, see :meth:`Follower.weighed`."""
        return [] if self._targets is None else self._targets.weighed(self._number)

    def start(self, frame: Frame, box: Box) -> Track:
        """See :meth:`~rgbd_kcf_tracker.track.Tracker.start`."""
        require_inside(box, frame)
        first = 1 if self._targets is None else self._targets.next_person
        self._targets = MetricTargets(self._parameters, self._cues, first, self._embedding)
        self._number = self._targets.add(frame, box)
        return dataclasses.replace(self._targets.started(self._number), id=0)

    def update(self, frame: Frame) -> Track:
        """See :meth:`~rgbd_kcf_tracker.track.Tracker.update`."""
        if self._targets is None:
            return Track(None, TrackState.IDLE)
        return dataclasses.replace(self._targets.update(frame)[self._number], id=0)
