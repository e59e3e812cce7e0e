# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Following a target by its surface: a thing with a place, a size and colours, in metres."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.decide.account import MISSES, SMALL, Account, absent
from rgbd_kcf_tracker.metric.decide.cues import Cue, weighed
from rgbd_kcf_tracker.metric.decide.evidence import (
    FADE,
    WHERE_IT_STOOD,
    Evidence,
    Said,
    probability,
)
from rgbd_kcf_tracker.metric.decide.expected_body import ExpectedBody
from rgbd_kcf_tracker.metric.decide.neighbours import Neighbours
from rgbd_kcf_tracker.metric.decide.parts import FIRST
from rgbd_kcf_tracker.metric.decide.proposals import (
    MIXED,
    MOST_SHARE,
    Expectation,
    gathered,
    propose,
)
from rgbd_kcf_tracker.metric.decide.sighting import has_come
from rgbd_kcf_tracker.metric.decide.visible_box import box_about, visible_box
from rgbd_kcf_tracker.metric.identity.body import Body, Placed
from rgbd_kcf_tracker.metric.identity.hidden_cloud import HiddenCloud
from rgbd_kcf_tracker.metric.identity.middle import Belief, MiddleFilter
from rgbd_kcf_tracker.metric.identity.motion import MotionFilter
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.identity.stood import Stood
from rgbd_kcf_tracker.metric.identity.tally import logit
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.pose import Pose

FIRST_SIGMA = 0.05
"""Metres by which the first place is unsure: the target was shown, so it is no more than the body's
own relief near the camera, which is :data:`~.identity.body.DEPTH_SIGMA`."""
HIDDEN_NOISE = 0.5
"""Process noise of a hidden target's motion against a visible one's."""
STRIDE = 0.5
STRIDE_PER_SECOND = 2.0
"""Metres, and metres a second, that a target may also have moved at will, against what its motion
tells: a step to either side, and a brisk walk in any direction (people mostly walk at 1.4 m/s)."""
SLOWING = np.array([1.0, 0.25, 1.0])
"""Seconds, across, down and ahead, in which the velocity of a target that is not found falls to a
third: it may stop or turn, and up and down nobody goes on for long, as for the particles
(:data:`~.identity.hidden_cloud.TURN_TIME`)."""
GROWN, SHRUNK = 0.3, 0.35
"""Spread of the log size of a body about what is known of it: arms or a bag make somebody larger by
a third, a side view or what hides him smaller by as much."""
PLACED_MIDDLE = 0.4
"""Share of the body's height from its upper end down to where the camera must see past a particle:
the belly, which is broad and which a table hides less often than legs."""
BY_SIZE = 0.2
"""Share of a depth that is told by the size of a box by which it is unsure: two steps of the filter
over scale, or a side that something hides."""
ANY_HEIGHT = np.array([0.0, 10.0, 0.0])
"""Metres by which a place is unsure where its height tells nothing."""
END_ON = 0.25
"""Share of a body that shows of one who lies, seen along his body: his breadth by his depth."""
LEARN_FRACTION = 0.6
"""Visible share from which a body of which nothing is cut off is learned from: more than half, as a
smaller part has not all of its colours."""
STANDING = 0.5
"""Share of a candidate that is somebody else's, or stood there while the target was elsewhere, from
which it is not the target: the greater part of it, for everybody touches something or somebody."""
APART = 0.5
"""Distance between two candidates, in widths of the body, from which they are not parts of one.
Two who stand side by side are a width apart, and halves of one body half a width."""
LEAVING = 0.5
"""Seconds after the last sight in which a target is seen to leave the image: at a walk (1.4 m/s) he
is out of it then with all of his breadth."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A silhouette, what it would mean for the body, and what speaks for it."""

    seen: Silhouette
    placed: Placed
    evidence: Evidence
    probability: float


class BySurface:
    """Follows one target from scene to scene.

    Args:
        account: of the first frame.
        first: the target's silhouette in it.
        person: the target as one of the crowd.
        parameters: of the tracker.
        cues: further ones for the verdict.
        stood: where the target stands, where it was followed before; None where that is not known.

    Attributes:
        person: the target.
        candidates: of the last frame, for looking at what the tracker saw.
        hidden_for: seconds since the target was last seen.
        was_away: whether it was absent for so long, before the last frame, that its place says
            little.
        contested: how likely the target is another candidate of the last frame than the best.
    """

    def __init__(
        self,
        account: Account,
        first: Silhouette,
        person: Person,
        parameters: MetricParameters,
        cues: Sequence[Cue] = (),
        stood: Stood | None = None,
    ) -> None:
        self._parameters, self._cues = parameters, cues
        self.person = person
        scene = account.scene
        self.body = Body(first)
        left, top, right, _ = first.metres
        here = np.array([(left + right) / 2, top, first.depth])
        placed = self.body.place(first, here)
        self.motion = self._motion_from(placed)
        self._neighbours: Neighbours | None = Neighbours(parameters.speed, parameters.acceleration)
        self._middle = MiddleFilter()
        self._middle.seen(scene.view, first, placed, self.body)
        if stood is None:
            stood = Stood(placed.position, placed.sigma, self.body.width)
        else:
            stood.point(placed.position, placed.sigma, self.body.width)
        self._stood, self._dt = stood, 0.0
        self._cloud: HiddenCloud | None = None
        self._rng = np.random.default_rng(parameters.seed)
        self.hidden_for = self._gone = 0.0
        self._misses, self.was_away = 0, False
        self._lay = False
        self.contested = 0.0
        self.candidates: list[Candidate] = []
        self.body.learn_colors(first, scene, float(placed.position[1]), 0.0)
        self._learn_around(scene, first, None)

    # -- one frame --------------------------------------------------------------------------------

    def step(self, account: Account, frame: Frame, dt: float) -> Candidate | None:
        """Look for the target in the next ``frame``, ``dt`` seconds later.

        Returns:
            What is most likely the target, or None where nothing is. What follows from it is only
            taken in by :meth:`take`, :meth:`seen_elsewhere`, :meth:`miss` or :meth:`disown`, one of
            which must be called.
        """
        scene = account.scene
        self.was_away = absent(self.hidden_for + dt, self._misses)
        self.contested = 0.0
        self._dt = dt
        if self.person.figure:  # who is told from others by the account, and moves by himself
            self._stood.moves()
            self._neighbours = None
        self._stood.carried(scene.way, dt)
        self._predict(dt, scene.motion if isinstance(scene.motion, Pose) else None)
        if self._cloud is not None:
            self._cloud.weigh(dt, scene.view, PLACED_MIDDLE * self.body.height)
        expected = self.expected(dt)
        missing = self.expected_body.visible(scene) > 0.6
        others = account.others(self.person, self._parameters.use_room)
        found = propose(scene, self.body, expected, others, self._parameters.most_candidates)
        # Where his own figure is known, what holds somebody else besides is no proposal.
        most = STANDING if self.person not in account.in_view else MIXED
        free = [seen for seen in found if others.share(seen) < most]
        free += [
            sight.seen
            for kind, sight in enumerate(account.sights, FIRST)
            if not others.theirs[kind]
            and sight.seen.area < MOST_SHARE * self.body.area
            and not any(sight.seen.same(other) for other in free)
        ]
        self.candidates = [
            c
            for c in self._weighed(account, frame, free, dt, missing)
            if c.evidence.room < STANDING
        ]
        self._leave_out_neighbours(account, dt)
        self.candidates.sort(key=lambda c: -c.probability)
        if not self.candidates:
            return None
        first = self.candidates[0]
        whole = gathered(scene, self.body, first.seen, first.placed, others)
        if whole is not None:
            (more,) = self._weighed(account, frame, [whole], dt, missing)
            if logit(more.probability) > logit(first.probability) - 1.0:
                self.candidates.insert(0, more)
        best = self.candidates[0] = self._alone(account, self.candidates)
        parameters = self._parameters
        if best.probability < (parameters.recognition if self.was_away else parameters.acceptance):
            return None
        return best if best.placed.fraction >= parameters.least_visible else None

    def _alone(self, account: Account, candidates: list[Candidate]) -> Candidate:
        """The best candidate with its probability beside all others: the target is one of them."""
        best, *others = candidates
        rivals = self._beside(account, best, others)
        if not rivals:
            return best
        mine = best.probability / (1 - best.probability)
        theirs = sum(each.probability / (1 - each.probability) for each in rivals)
        self.contested = theirs / (1 + mine + theirs)
        return dataclasses.replace(best, probability=mine / (1 + mine + theirs))

    def _beside(
        self, account: Account, found: Candidate, others: list[Candidate]
    ) -> list[Candidate]:
        """Those of the others that are no part of what was found, nor of each other."""
        beside: list[Candidate] = []
        for other in others:
            if all(self._apart(account, other, each) for each in (found, *beside)):
                beside.append(other)
        return beside

    def _apart(self, account: Account, one: Candidate, other: Candidate) -> bool:
        """Whether two candidates are not parts of one."""
        index = account.sight_of(one.seen)
        return (
            math.dist(one.placed.floor, other.placed.floor) > APART * self.body.width
            and (index < 0 or index != account.sight_of(other.seen))
            and not one.seen.meets(other.seen)
        )

    def _leave_out_neighbours(self, account: Account, dt: float) -> None:
        """Drop the candidates that are what was beside a thing that is followed."""
        if self._neighbours is None:
            return
        places = [c.placed for c in self.candidates]
        found = self._neighbours.find(places, self.motion.position, dt)
        theirs = [self.candidates[index] for index in found]
        self.candidates = [
            c for c in self.candidates if all(self._apart(account, c, each) for each in theirs)
        ]

    def _meet_neighbours(self, account: Account, found: Candidate) -> None:
        """Remember what else there is, beside a thing that was surely found and is not held."""
        if self._neighbours is None or self.person.area < SMALL:
            return
        beside = self._beside(account, found, self.candidates)
        self._neighbours.meet(each.placed for each in beside)

    def belief(self) -> Belief | None:
        """Where the target is believed to be now: by the particles while it is hidden."""
        if self._cloud is None or self.hidden_for == 0.0:
            return self._middle.belief()
        return self._middle.hidden(self._cloud)

    def glimpse(self, scene: Scene, found: Candidate) -> Belief | None:
        """Where a candidate is that may be the target, of which nothing else is known."""
        middle = MiddleFilter()
        middle.seen(scene.view, found.seen, found.placed, self.body)
        return middle.belief()

    def drift(self, dt: float) -> None:
        """Go on by ``dt`` seconds without a picture of depth."""
        self.was_away = absent(self.hidden_for + dt, self._misses)
        self._predict(dt, None)

    def resume(self, found: Candidate) -> None:
        """Forget where the target went: it has come back elsewhere."""
        self.motion = self._motion_from(found.placed)
        self._middle.forget()

    def disown(self, gone: float) -> None:
        """Who was followed is somebody else: the target has been away for ``gone`` seconds."""
        self.hidden_for, self._misses = gone, MISSES

    def take(self, account: Account, found: Candidate, sure: bool) -> Box:
        """Go on from where the target was found, and learn from it what can be learned.

        Args:
            account: of the frame.
            found: what was found.
            sure: whether it is surely the target: else nothing but its place is learned.

        Returns:
            The box of its visible part in pixels of the image.
        """
        self.hidden_for = self._gone = 0.0
        self._misses = 0
        scene, seen, placed = account.scene, found.seen, found.placed
        self._lay = not self.person.gallery.stands(scene.top(seen))
        self.motion.correct(placed.position, placed.sigma)
        if not seen.cut.any:
            self._stood.seen(placed.position, placed.sigma, self._dt)
        if sure:
            self.body.grow(seen)
            self._meet_neighbours(account, found)
        self._middle.seen(scene.view, seen, placed, self.body)
        since = scene.since
        if sure and since is not None and not seen.cut.any and placed.fraction > LEARN_FRACTION:
            top = float(placed.position[1])
            self.body.learn_colors(seen, scene, top, since)
            self._learn_around(scene, seen, since)
            self.body.learn_size(seen, since)
        return self.box(scene, found)

    def miss(self, scene: Scene | None, dt: float) -> None:
        """Go on without having found the target."""
        if scene is not None and self.hidden_for < LEAVING:
            self._gone = max(self._gone, self.expected_body.outside(scene))
        self.hidden_for += dt
        # Where a frame has no depth, nothing was looked for.
        self._misses += scene is not None
        self.motion.velocity = self.motion.velocity * np.exp(-dt / SLOWING)

    def seen_elsewhere(self, view: DepthView, box: Box, depth: float | None = None) -> None:
        """Take a box of the image that was found by other means.

        Args:
            view: the last depth.
            box: in pixels of the image.
            depth: metres, as its size tells; None where it tells all but the depth.
        """
        place, sigma = self._at(view, box, depth)
        self.motion.correct(place, sigma)
        self._middle.placed(place, sigma)
        self.hidden_for = self._gone = 0.0
        self._misses = 0

    @property
    def middle(self) -> FloatArray:
        """Where the middle of the target is, ``(3,)`` metres in the camera's frame."""
        x, top, z = self.motion.position.tolist()
        return np.array([x, top + self.body.height / 2, z])

    @property
    def expected_body(self) -> ExpectedBody:
        """All of the target where it is expected."""
        return ExpectedBody(self.motion.position, self.body.width, self.body.height)

    def stood_at(self, view: DepthView, box: Box) -> float:
        """Log-odds, by where it stood, that the target is in a box of the image."""
        return self._stood.log_odds(*self._at(view, box))

    def _at(
        self, view: DepthView, box: Box, depth: float | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Where the target would be in a box of the image, and how surely, ``(3,)`` metres each."""
        z = float(self.motion.position[2]) if depth is None else depth
        place = view.metres(box.cx / view.step, box.y / view.step, z)
        return np.array(place), np.array([0.1, 0.1, 10.0 if depth is None else BY_SIZE * depth])

    # -- parts ------------------------------------------------------------------------------------

    def expected(self, dt: float) -> Expectation:
        """Where the target is expected now, ``dt`` seconds after the frame before."""
        sigma = self.motion.sigma
        reach = 3.0 * np.minimum(sigma, 1.5) + 0.2 + 1.5 * STRIDE_PER_SECOND * min(dt, 0.3)
        if self.hidden_for > self._parameters.lost_after:
            reach = reach + 10.0
        return Expectation(self.motion.position, sigma, reach)

    def _motion_from(self, placed: Placed) -> MotionFilter:
        parameters = self._parameters
        return MotionFilter(placed.position, FIRST_SIGMA, parameters.speed, parameters.acceleration)

    def _predict(self, dt: float, moved: Pose | None) -> None:
        """Go on by ``dt`` seconds, with particles while the target is hidden.

        ``moved`` is the last camera's pose in that of now, None where it stood.
        """
        motion, hidden = self.motion, self.hidden_for > 0
        if moved is not None:
            motion.carried(moved)
            if self._cloud is not None:
                self._cloud.carried(moved)
        motion.predict(dt, HIDDEN_NOISE if hidden else 1.0)
        if self._neighbours is not None:
            self._neighbours.predict(dt, moved)
        self._middle.predict(dt, moved)
        if not hidden or not self._parameters.use_particles:
            self._cloud = None
            return
        if self._cloud is None:
            self._cloud = HiddenCloud(
                motion.position,
                motion.velocity,
                motion.sigma,
                motion.speed_sigma,
                self._parameters.particles,
                self._rng,
            )
        self._cloud.move(dt)

    def _weighed(
        self, account: Account, frame: Frame, found: list[Silhouette], dt: float, missing: bool
    ) -> list[Candidate]:
        boxes = [box_about(account.scene, seen) for seen in found] if self._cues else []
        said = [
            [Said(cue.name, value, cue.weight) for value in values.tolist()]
            for cue in self._cues
            for values in [weighed(cue, frame, boxes, self.person.number)]
        ]
        more = list(zip(*said, strict=True)) if said else [()] * len(found)
        return [
            self._candidate(account, seen, dt, missing, each)
            for seen, each in zip(found, more, strict=True)
        ]

    def _candidate(
        self,
        account: Account,
        seen: Silhouette,
        dt: float,
        missing: bool,
        more: tuple[Said, ...],
    ) -> Candidate:
        scene, body, motion = account.scene, self.body, self.motion
        claim = account.claim(self.person, seen)
        sigma = motion.sigma
        stands = not self.person.lies(scene.top(seen), account.time)
        placed = body.place(seen, motion.position)
        variance = np.square(sigma) + np.square(placed.sigma)
        away = np.square(placed.position - motion.position)
        unsure = placed.sigma
        fraction = placed.fraction
        mine = claim.mine if self._parameters.use_others else 0.0
        if not stands and mine > 0 and self._has_fallen(scene, seen):
            # He falls as fast as nobody walks, and shows less, seen along his body.
            away[1], unsure = 0.0, placed.sigma + ANY_HEIGHT
            fraction = max(fraction, min(1.0, fraction / END_ON))
        if self._cloud is not None:
            step = self._cloud.distance(placed.position, unsure)
        else:
            step = float((away / variance).sum())
        at_will = (STRIDE + STRIDE_PER_SECOND * dt) ** 2
        came_in = self._came_in(account, seen)
        gone = self.hidden_for + dt
        if self._stood.known:
            stood = self._stood.log_odds(placed.position, placed.sigma)
            # That it is where it was is known of one that is followed.
            share = 1.0 if stood < 0 else 1.0 - math.exp(-gone / FADE)
            more = (Said(WHERE_IT_STOOD, stood, share), *more)
        evidence = Evidence(
            step=step,
            stride=float((away / (variance + at_will)).sum()),
            fraction=fraction,
            height=_misfit(
                seen.height,
                body.height,
                seen.cut.top or seen.cut.bottom or not stands,
                body.height_known,
            ),
            gone=gone,
            missing=missing,
            inland=0.0 if came_in else self._gone,
            emerged=not came_in,
            look=claim.look if self._parameters.use_color else 0.0,
            mine=mine,
            rival=claim.rival if self._parameters.use_others else 0.0,
            assigned=claim.assigned if self._parameters.use_others else 0,
            room=claim.room if self._parameters.use_room else 0.0,
            more=more,
        )
        return Candidate(seen, placed, evidence, probability(evidence))

    def _has_fallen(self, scene: Scene, seen: Silhouette) -> bool:
        """Whether what is too low for one who stands has come there.

        At the image's side a leg is the last that shows of who walks out: there he must have lain
        in the frame before.
        """
        beside = seen.ends.left or seen.ends.right
        return (self._lay or not beside) and has_come(scene, seen)

    def _came_in(self, account: Account, seen: Silhouette) -> bool:
        """Whether a candidate is at the edge of what the camera sees, or came in there."""
        if seen.ends.any:
            return True
        stranger = account.stranger(self.person, account.sight_of(seen))
        return stranger is not None and stranger.entered

    def _learn_around(self, scene: Scene, seen: Silhouette, dt: float | None) -> None:
        """Learn the colours beside the target."""
        left, top, right, bottom = self.expected_body.sides(scene.view)
        rows, cols = scene.view.shape
        wide = right - left
        x0 = int(min(max(left - wide, 0), cols - 2))
        x1 = int(min(max(right + wide, x0 + 1), cols))
        y0 = int(min(max(top, 0), rows - 2))
        y1 = int(min(max(bottom, y0 + 1), rows))
        part = slice(y0, y1), slice(x0, x1)
        self.body.learn_around(seen, scene, part, dt)

    def box(self, scene: Scene, found: Candidate) -> Box:
        """The box that a candidate would give, in pixels of the image."""
        return visible_box(scene, self.body, found.seen, float(found.placed.position[1]))


def _misfit(size: float, expected: float, cut: bool, known: bool) -> float:
    """Squared-error term of a size; 0 where it is explained by what cannot be seen."""
    ratio = float(np.log(size / expected))
    if (ratio < 0 and cut) or (ratio > 0 and not known):
        return 0.0
    return -0.5 * (ratio / (SHRUNK if ratio < 0 else GROWN)) ** 2
