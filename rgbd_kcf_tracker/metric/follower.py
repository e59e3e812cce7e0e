# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Following one chosen target: by its surface, and by its look where depth says nothing of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.by_look import ByLook, Look
from rgbd_kcf_tracker.metric.by_surface import BySurface, Candidate
from rgbd_kcf_tracker.metric.dark import Dark
from rgbd_kcf_tracker.metric.decide.account import REUNION, SMALL, Account
from rgbd_kcf_tracker.metric.decide.arrivals import bounded
from rgbd_kcf_tracker.metric.decide.crowd import Crowd
from rgbd_kcf_tracker.metric.decide.cues import Cue
from rgbd_kcf_tracker.metric.decide.evidence import KNOWN_BEFORE, SOMEBODY_NEW
from rgbd_kcf_tracker.metric.decide.sighting import WHOLE
from rgbd_kcf_tracker.metric.decide.visible_box import box_about, outline_box
from rgbd_kcf_tracker.metric.drawn import UNLIKE, unlike, view_in
from rgbd_kcf_tracker.metric.gated_look import ELSEWHERE, IS_ROOM, NEWCOMER, GatedLook, room_share
from rgbd_kcf_tracker.metric.identity.comeback import EVEN, Comeback, Likely
from rgbd_kcf_tracker.metric.identity.elsewhere import Elsewhere
from rgbd_kcf_tracker.metric.identity.gallery import SUREST_PART, Gallery, View
from rgbd_kcf_tracker.metric.identity.middle import (
    Belief,
    in_metres,
    row_by_row,
    triple,
)
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.identity.stood import Stood
from rgbd_kcf_tracker.metric.identity.tally import logit
from rgbd_kcf_tracker.metric.initialisation import LOCK_IOU, fits, surface_of
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.colors import view_image
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.figures import depth_step
from rgbd_kcf_tracker.metric.perceive.scene import Scene
from rgbd_kcf_tracker.metric.perceive.silhouette import Silhouette
from rgbd_kcf_tracker.metric.perceive.upright import HEIGHT, WIDTH
from rgbd_kcf_tracker.track import Track, TrackState

LEARNED = 0.6
"""Score from which a target's look is learned from where it was found: below, it may well be
somebody else, who would be the target from then on."""
ATTEND = 1.0
"""Seconds after which the look of a target followed by its surface is learned again: it is needed
only where depth fails, and learning it takes time."""
BLIND = 0.25
"""Share of the expected body without a reading from which depth says nothing of it: what is covered
has the readings of what covers it, and only sun, glass and distance leave this much without."""
AS_DEEP = 0.5
"""Share of a small thing's place that is as deep as it from which it is still there, as a part of
whatever is: most of it, and what hides it is nearer."""
PART_SEEN = 0.8
"""Score of who is told by what moves where he was and looks unlike himself: of such boxes four of
five are right on simulated scenes, and most of the others are on the little that shows of him."""
SUREST_LOOK = 0.9
"""Score of a box found by look at full response: on colour alone about nine of ten are right."""
RECOGNISED_SIGHTINGS, RECOGNISED_AFTER, RECOGNISED_ODDS = 3, 0.5, 1.0
"""Sightings of a returning target, and seconds of them, after which it is the target for good, and
the mean log-odds of its look that it takes: at 1 Hz three seconds, at 30 Hz half a second, as
sightings in a row show the same. With 2 instead of 1 it was 0.8 worse on the disturbed copies
(docs/experiments.md)."""
MENDING, MORE = 2.0, 1.6
"""Seconds in which a target of which a part was hidden when it was chosen becomes the figure that
it is a part of, and how much larger that is at the least: half as large again may be an arm, or
somebody who touches it."""
LEAST_KNOWN = 0.2
"""Share of a box that a surface fills, at the least, to be known by it where depth's view ends:
half a person fills a quarter, and by an arm and a leg nobody is known again."""
SOON = 0.25
"""Seconds after which nobody is where a box was drawn about him: at a walk (1.4 m/s) he is half a
body farther."""
TALL, TALLER = 0.9, 1.2
"""Metres of height of an upright part of somebody, half of him seen past a corner, and of somebody:
no chair's back reaches as high as the latter."""
LONG_STEP, CONTESTED = 0.5, 0.05
"""Seconds between two frames in which two people can change places, half a metre each, and how
likely the target is then another than the one it is taken for, from which that is asked on: what is
nearly sure in one frame is not in twenty."""
NEW_SCORE = 0.8
"""Score of a box when the target has just been found to be a newcomer: place and colours fit, but
nothing has borne it out yet."""
HIDDEN = 0.1, 0.8
"""Metres of whom something hides above, from which that is no chance of where the box was drawn,
and up to which it is a part of him: half a slice, and more than his head and chest."""


class Follower:
    """Follows one target from frame to frame.

    Args:
        frame: the first.
        account: of the first frame, None where it has no depth.
        crowd: everyone, of whom the target is one.
        box: the target.
        parameters: of the tracker.
        cues: further ones for the verdict, see :class:`~.cues.Cue`.

    Attributes:
        person: the target as one of the crowd, None while depth says nothing of it.
        first, track: of the frame in which it was chosen, and of the last.
        seen: its silhouette in the last frame, None where it has none.
        glimpsed: that of somebody who is rather the target than somebody new, while that is open.
        doubts: log-odds that the first of :meth:`weighed` lost in the last frame to what is asked
            of it alone, by cue.
        response: the filter's in the last frame against its own recent mean, None where it was not
            asked.
    """

    def __init__(
        self,
        frame: Frame,
        account: Account | None,
        crowd: Crowd,
        box: Box,
        parameters: MetricParameters,
        cues: Sequence[Cue],
    ) -> None:
        self._parameters, self._cues = parameters, cues
        self._crowd = crowd
        self._surface: BySurface | None = None
        self._account: Account | None = None
        self._hidden_for = self._unread_for = 0.0
        self._partial, self._shown = False, 0.0
        self._since = crowd.time
        self._elsewhere = Elsewhere()
        self._dark = Dark(crowd.time, parameters)
        self._comeback: Comeback | None = None
        self.person: Person | None = None
        self.seen: Silhouette | None = None
        self.glimpsed: Silhouette | None = None
        self.doubts: dict[str, float] = {}
        self.response: float | None = None
        if account is not None:
            box = self._lock(frame, account, box)
        self._drawn = box
        self._look: ByLook | None = None
        self._gated: GatedLook | None = None
        if parameters.use_look or self._surface is None:
            self._look = ByLook(frame, box, parameters)
            if self._surface is None:
                self._gated = GatedLook(
                    self._look, account, box, self._since, parameters.seen_ratio
                )
            elif account is not None:
                self._know_as_drawn(account, box, self._look)
        depth = None if self.seen is None else self.seen.depth
        if depth is not None:
            self._dark.seen(frame, box, depth, 1.0)
        self.first = self.track = self._told(frame, box, 1.0, depth, self._believed(0.0))

    def weighed(self) -> list[tuple[Candidate, Box]]:
        """What was weighed in the last frame, best first, and the box each would have given.

        Empty while the target is followed by its look.
        """
        if self._surface is None or self._account is None:
            return []
        scene = self._account.scene
        return [(c, self._surface.box(scene, c)) for c in self._surface.candidates]

    def settle(self) -> None:
        """Do what no answer waits for; after each :meth:`step`, before the next."""
        if self._look is not None:
            self._look.settle()
        self._dark.settle()

    def lose(self, gone: float) -> None:
        """Who was followed is not the target, which has been away for ``gone`` seconds."""
        self._hidden_for = gone
        if self._surface is not None:
            self._surface.disown(gone)
        self._comeback = None

    def by_look(self, depth: bool) -> bool:
        """Whether it is followed by its look in a frame with or without ``depth``."""
        return self._surface is None or (not depth and self._dark.ready)

    def step(
        self, frame: Frame, account: Account | None, view: DepthView | None, dt: float, turn: bool
    ) -> Track:
        """Follow the target into the next frame, ``dt`` seconds later.

        Args:
            frame: the frame.
            account: what it shows, None where it has no depth.
            view: the last depth there was, None where there never was any.
            dt: seconds.
            turn: whether a target followed by its look may be searched for and learned from.
        """
        self._account = account
        self.seen = self.glimpsed = None
        self.doubts = {}
        if account is not None and account.scene.motion is not None:
            self._elsewhere.forget()
        if self._look is not None:
            self._look.response = None
        if self._surface is None:
            track = self._by_look(frame, account, dt, turn)
        else:
            track = self._by_surface(frame, account, view, dt, turn, self._surface)
        self.response = None if self._look is None else self._look.response
        if account is None and self._dark.runs:
            self.response = self._dark.response
        self._hidden_for = 0.0 if track.box is not None else self._hidden_for + dt
        self._unread_for = 0.0 if track.depth is not None else self._unread_for + dt
        self.track = track
        return track

    # -- by surface -------------------------------------------------------------------------------

    def _lock(self, frame: Frame, account: Account, box: Box, stood: Stood | None = None) -> Box:
        """Follow what a box is about by its surface, if it has one; the box of that."""
        seen = surface_of(account, box, self._parameters)
        if seen is None:
            return box
        self.seen = seen
        outline = outline_box(account.scene, seen)
        if not fits(outline, box):
            box = outline  # who was drawn by half is followed as a whole
        if self.person is None:
            self.person = self._crowd.chosen(account, seen, self._since)
            if account.time == self._since:
                self._count_from(account, box, seen, self.person)
        for cue in self._cues:
            cue.start(frame, box, self.person.number)
        self._surface = BySurface(account, seen, self.person, self._parameters, self._cues, stood)
        self._partial = seen.cut.any or (SMALL < seen.area < WHOLE and seen.height > TALL)
        return box

    def _count_from(self, account: Account, box: Box, seen: Silhouette, person: Person) -> None:
        """Count what is known of whom something hides above from where the box begins.

        Depth may not reach his head, or it is behind something; who drew the box saw it.
        """
        view = account.scene.view
        above = (seen.top - box.y / view.step) * seen.depth / view.intrinsics.fy
        # Hair that gives no reading is missing from every view alike.
        cut = seen.cut.top or seen.cut.left or seen.cut.right
        hidden = cut and person.gallery.stature.top is None
        if hidden and len(person.gallery.views) == 1 and HIDDEN[0] < above < HIDDEN[1]:
            known = View.of(view, account.scene.codes, seen, None, above)
            person.gallery = Gallery.of(account.described(known, box), account.time)

    def _know_as_drawn(self, account: Account, box: Box, look: ByLook) -> None:
        """Know by his box, too, of whom depth shows little where its view ends."""
        seen, person = self.seen, self.person
        if seen is None or person is None or not account.scene.ends(box).any:
            return
        if np.count_nonzero(seen.mask) > LEAST_KNOWN * box.over(account.scene.view.step).area:
            return
        known = view_in(account.scene, box, look, seen.depth)
        if known is None or len(person.gallery.views) != 1:
            return
        known = account.described(known, box)
        person.gallery.learn(known, account.time)
        if len(person.gallery.views) == 1:  # they say the same, and the box says more
            person.gallery = Gallery.of(known, account.time)

    def _by_surface(
        self,
        frame: Frame,
        account: Account | None,
        view: DepthView | None,
        dt: float,
        turn: bool,
        surface: BySurface,
    ) -> Track:
        if account is None:
            surface.drift(dt)
            return self._in_the_dark(frame, view, dt, turn, surface)
        self._dark.forget()
        found = surface.step(account, frame, dt)
        if found is not None and self._passes(account, surface, found):
            found = None
        if surface.was_away:
            self._settle_comeback(surface.person)
            if found is not None:
                unsure = self._returned(frame, account, dt, surface, found)
                if unsure is not None:
                    return unsure
        comeback = self._comeback
        score = self._score(account, dt, surface, found)
        if comeback is not None and comeback.denied:
            self._crowd.disown(surface.person, comeback)
            self.lose(account.time - comeback.left)
            self._hidden_for -= dt  # which the step adds
            return self._hidden(frame, dt)
        if found is None:
            return self._glance(frame, account, view, dt, surface)
        whole = self._whole(account, surface.person, found.seen)
        whole = whole or self._as_drawn(account, found.seen)
        if whole is not None:
            self._anew(account, surface.person, whole)
            return self._locked(frame, account, score)
        box = surface.take(account, found, score >= LEARNED)
        self.seen = found.seen
        self._shown = max(self._shown, found.seen.area)
        if self._comeback is not None and self._comeback.doubted:
            return Track(None, self._unseen(dt))  # a box on a stranger is worse than none
        outline = box_about(account.scene, found.seen)
        self._elsewhere.keep(account.scene.image, outline.over(account.scene.view.step))
        if score >= LEARNED:
            for cue in self._cues:
                cue.learn(frame, box, surface.person.number)
            if self._look is not None and not found.seen.cut.any:
                self._look.attend(frame, box, dt, ATTEND)
        self._dark.seen(frame, box, found.seen.depth, score)
        return self._told(frame, box, score, found.seen.depth, surface.belief())

    def _passes(self, account: Account, surface: BySurface, found: Candidate) -> bool:
        """Whether what depth shows looks unlike the target, beside where only its look was found.

        Of a target at the end of what depth sees it shows nothing, but of who passes it does.
        """
        last = self.track.box
        if self._unread_for == 0 or last is None:
            return False
        if box_about(account.scene, found.seen).iou(last) >= LOCK_IOU:
            return False
        return surface.person.gallery.log_odds(account.look(found.seen)) < UNLIKE

    def _returned(
        self, frame: Frame, account: Account, dt: float, surface: BySurface, found: Candidate
    ) -> Track | None:
        """The track of what may be the target that was away; None where it is taken to be it."""
        person, index = surface.person, account.sight_of(found.seen)
        stranger = account.stranger(person, index)
        # A part of somebody, where all of the target is a figure, tells not for good who it is;
        # but a thing that was in view until the camera paused is hardly another one.
        part = person.figure and surface.hidden_for > 0
        new = account.owner[index] < 0 if index >= 0 else part
        against = account.against_chosen(person)
        if new or (stranger is not None and not _recognised(stranger, person, account.time)):
            box = surface.box(account.scene, found)
            belief = surface.glimpse(account.scene, found)
            others = math.exp(against) + account.as_others(person, index)
            score = bounded(found.probability, math.log(others))
            self.glimpsed = found.seen if score >= EVEN else None
            self._doubt(SOMEBODY_NEW, found, score)
            surface.miss(account.scene, dt)
            if score < EVEN:  # a box on a stranger is worse than none
                return self._hidden(frame, dt)
            return self._told(frame, box, score, found.seen.depth, belief)
        if person.figure and person.gallery.views:
            self._comeback = Comeback(person, account.time, against)
        surface.resume(found)
        return None

    def _score(
        self, account: Account, dt: float, surface: BySurface, found: Candidate | None
    ) -> float:
        """How surely what was found is the target, after a return beside what it was known by."""
        score = 0.0 if found is None else found.probability
        if found is not None and self._comeback is None and self._seen_again(surface, dt):
            # His chances are those of this frame, and only his looks change them from here on.
            looks = surface.person.gallery.log_odds(account.look(found.seen))
            against = min(looks - logit(score), SUREST_PART)  # they can say no more than that
            self._comeback = Comeback(surface.person, account.time, against, place=True)
            _likely(self._comeback, account, surface.person, found)
        elif self._comeback is not None:
            likely = _likely(self._comeback, account, surface.person, found)
            if found is not None:
                score *= likely.score
                self._doubt(KNOWN_BEFORE, found, score)
        return score

    def _doubt(self, cue: str, found: Candidate, score: float) -> None:
        self.doubts[cue] = logit(score) - logit(found.probability)

    def _seen_again(self, surface: BySurface, dt: float) -> bool:
        """Whether the target was not seen for a while, and somebody else may be taken for it now.

        He is held against what was known of it before, if that is more than a part: most of one of
        whom only a part is known looks otherwise. Where two may have changed places between two
        frames of a slow camera, though, either is held against whatever is known.
        """
        person = surface.person
        if not person.figure:
            return False
        if dt > LONG_STEP and surface.contested > CONTESTED:
            return bool(person.gallery.views)
        return (surface.hidden_for > 0 or dt > REUNION) and person.gallery.whole

    def _settle_comeback(self, person: Person) -> None:
        """The target has gone again: say what was learned since it came back."""
        if self._comeback is not None:
            self._comeback.settle(person)
            person.gallery.restore(self._comeback.known)
            if not self._comeback.borne_out:
                self._crowd.unmeet(person, self._comeback)
        self._comeback = None

    def _whole(self, account: Account, person: Person, seen: Silhouette) -> Silhouette | None:
        """All of somebody of whom something hid a part when he was chosen, as soon as it shows.

        Who once showed that much is not a part, though he may be half hidden again.
        """
        if not self._partial or account.time - self._since > MENDING:
            return None
        index = account.sight_of(seen)
        if index < 0:
            return None
        sight, owner = account.sights[index], account.owner_of(index)
        if sight.parted or sight.seen.area < MORE * max(seen.area, self._shown):
            return None
        if not TALLER < sight.seen.height < HEIGHT[1] or sight.seen.width > WIDTH[1]:
            return None
        if owner is not None and owner is not person:
            return None
        return sight.seen if _as_deep(account, sight.seen, seen) else None

    def _as_drawn(self, account: Account, seen: Silhouette) -> Silhouette | None:
        """Who is where a box was drawn a moment ago, if what was taken for the target is not.

        Two who were one figure then, of whom one was meant, are two now.
        """
        if account.time - self._since > SOON:
            return None
        scene = account.scene
        if box_about(scene, seen).iou(self._drawn) >= LOCK_IOU:
            return None
        for sight, owner in zip(account.sights, account.owner, strict=True):
            if owner < 0 and box_about(scene, sight.seen).iou(self._drawn) >= LOCK_IOU:
                return sight.seen
        return None

    def _anew(self, account: Account, person: Person, whole: Silhouette) -> None:
        """Follow what somebody turned out to be as if it had been chosen now."""
        person.gallery = Gallery()
        self._surface = BySurface(account, whole, person, self._parameters, self._cues)
        self._partial, self._shown = whole.cut.any, whole.area
        self.seen = whole

    def _in_the_dark(
        self, frame: Frame, view: DepthView | None, dt: float, turn: bool, surface: BySurface
    ) -> Track:
        """Go on by the look while depth fails, from where depth showed the target last."""
        look = self._dark.step(frame, dt, turn) if self._look is not None else None
        if look is None and not self._dark.runs:
            return self._glance(frame, None, view, dt, surface)
        unchanged = (
            look is not None
            and view is not None
            and self._stood_there(frame, None, view, surface.person, look.box)
        )
        if look is None or unchanged:
            if unchanged:  # it has wandered on to what was there before
                self._dark.forget()
            surface.miss(None, dt)
            return self._hidden(frame, dt)
        if view is not None:
            surface.seen_elsewhere(view, look.box, self._dark.depth(frame, look.box))
        score = min(_score(look, 0.0), self._dark.most)
        return self._told(frame, look.box, score, None, self._believed(self._unread_for + dt))

    def _glance(
        self,
        frame: Frame,
        account: Account | None,
        view: DepthView | None,
        dt: float,
        surface: BySurface,
    ) -> Track:
        """Where depth shows nothing of the target, see whether its look is where it should be."""
        scene = None if account is None else account.scene
        if self._look is not None and view is not None:
            box = surface.expected_body.box(view)
            blind = (
                scene is None
                or surface.expected_body.unread(scene) > BLIND
                or _held(scene, surface)
            )
            # Who was away need not be where he was expected: what is like him may be anything.
            near = blind and not surface.was_away
            if near and box is not None and box.clipped(frame.width, frame.height) is not None:
                look = self._look.glance(frame, box, dt, goes_on=self._hidden_for == 0)
                stood = 0.0 if look is None else surface.stood_at(view, look.box)
                if (
                    look is not None
                    and stood >= ELSEWHERE
                    and not self._stood_there(frame, account, view, surface.person, look.box)
                    and not self._unlike(account, surface, look)
                ):
                    surface.seen_elsewhere(view, look.box)
                    if account is not None:
                        place = account.scene.axes @ surface.middle
                        surface.person.placed(place, account.time)
                    # What is not read is believed for as long as where who is hidden is.
                    unread = 0.0 if look.depth is not None else self._unread_for + dt
                    score, belief = _score(look, stood), self._believed(unread)
                    return self._told(frame, look.box, score, look.depth, belief)
        surface.miss(scene, dt)
        return self._hidden(frame, dt)

    def _stood_there(
        self, frame: Frame, account: Account | None, view: DepthView, person: Person, box: Box
    ) -> bool:
        """Whether a box shows what was there when the target was seen elsewhere, or the room."""
        image = view_image(frame.color, view.step) if account is None else account.scene.image
        if self._elsewhere.unchanged(image, box.over(view.step)):
            return True
        return account is not None and person.mobile and room_share(account, box) > IS_ROOM

    def _unlike(self, account: Account | None, surface: BySurface, look: Look) -> bool:
        """Whether what the look has found looks unlike the person who is followed."""
        if account is None or self._look is None:
            return False
        depth = float(surface.middle[2])
        return unlike(surface.person.gallery, account.scene, look.box, self._look, depth)

    # -- by look ----------------------------------------------------------------------------------

    def _by_look(self, frame: Frame, account: Account | None, dt: float, turn: bool) -> Track:
        assert self._gated is not None
        said = self._gated.step(frame, account, dt, turn)
        if self.person is not None and (said.look is not None or said.onto is not None):
            self._crowd.forget(self.person)
            self.person = None
        if account is not None and said.onto is not None:
            self._lock(frame, account, said.onto, self._gated.stood)
            if self._surface is not None:
                return self._locked(frame, account, NEW_SCORE)
        if account is not None and said.look is None and self._gated.unseen >= NEWCOMER:
            known = self._known_by_box(account, self._gated)
            if known is not None:
                seen, score = known
                self._lock(frame, account, box_about(account.scene, seen))
                if self._surface is not None:
                    return self._locked(frame, account, score)
        if said.look is None:
            return self._hidden(frame, dt)
        score = _score(said.look, said.stood)
        return self._told(frame, said.look.box, score, said.look.depth)

    def _locked(self, frame: Frame, account: Account, score: float) -> Track:
        """The track of the frame from which on the target is followed by its surface."""
        assert self.seen is not None
        box = outline_box(account.scene, self.seen)
        self._dark.seen(frame, box, self.seen.depth, score)
        return self._told(frame, box, score, self.seen.depth, self._believed(0.0))

    def _known_by_box(self, account: Account, gated: GatedLook) -> tuple[Silhouette, float] | None:
        """Who has come and looks as what was drawn did, and how surely it is he."""
        if self.person is None:
            if gated.drawn is not None:
                self.person = self._crowd.chosen_unseen(
                    gated.drawn.gallery,
                    gated.drawn.place,
                    account.time - gated.unseen,
                    gated.others(account),
                )
            return None
        person = self.person
        likely: dict[int, tuple[float, Person]] = {}
        for index in range(len(account.sights)):
            stranger = account.stranger(person, index)
            alike = None if stranger is None else stranger.resemblance(person.number)
            if stranger is not None and alike is not None:
                likely[index] = math.exp(alike), stranger
        if not likely:
            return None
        index = max(likely, key=lambda each: likely[each][0])
        mine, stranger = likely[index]
        sight = account.sights[index]
        against = account.against_chosen(person)
        others = math.exp(against) + account.as_others(person, index)
        score = mine / (sum(odds for odds, _ in likely.values()) + others)
        # Nor is of a fragment seen past somebody else known how large he is, who is to be followed.
        enough = _recognised(stranger, person, account.time) and stranger.upright
        enough = enough and not sight.seen.cut.top
        if not enough or sight.parted or score < EVEN:
            return None
        self._comeback = Comeback(person, account.time, against)
        return sight.seen, score

    # -- answers ----------------------------------------------------------------------------------

    def _unseen(self, dt: float) -> TrackState:
        gone = self._hidden_for + dt
        return TrackState.LOST if gone > self._parameters.lost_after else TrackState.OCCLUDED

    def _believed(self, untold: float) -> Belief | None:
        """Where the target is believed to be for which nothing has told that for some seconds."""
        if self._surface is None or untold > self._parameters.predict_for:
            return None
        return self._surface.belief()

    def _hidden(self, frame: Frame, dt: float) -> Track:
        belief = self._believed(self._hidden_for + dt)
        return self._told(frame, None, 0.0, None, belief, self._unseen(dt))

    def _told(
        self,
        frame: Frame,
        box: Box | None,
        score: float,
        depth: float | None,
        belief: Belief | None = None,
        state: TrackState = TrackState.TRACKING,
    ) -> Track:
        belief = in_metres(belief, frame)
        if belief is None:
            place = None if box is None else frame.position(box, depth)
            return Track(box, state, score, depth, place)
        place = triple(belief.position)
        return Track(
            box,
            state,
            score,
            depth,
            None if depth is None else place,
            velocity=triple(belief.velocity),
            covariance=row_by_row(belief.covariance),
            predicted=place if depth is None else None,
            velocity_covariance=row_by_row(belief.velocity_covariance),
        )


def _likely(
    comeback: Comeback, account: Account, person: Person, found: Candidate | None
) -> Likely:
    """Whether a returned target is the target, by what was known before it left."""
    mine = -1 if found is None else account.sight_of(found.seen)
    look = None if found is None else account.look(found.seen)
    others = {
        other.number: account.sights[index].view
        for other, index in account.in_view.items()
        if index != mine and other is not person and other.number not in comeback.met
    }
    known = account.as_others(person, mine)
    followed = {person.number for person in account.in_view if person.chosen}
    return comeback.hear(look, others, known, account.time, followed)


def _recognised(stranger: Person, person: Person, time: float) -> bool:
    """Whether enough was seen of somebody to say for good that he is the target."""
    alike = stranger.resemblance(person.number)
    if alike is None or stranger.sightings < RECOGNISED_SIGHTINGS:
        return False
    return time - stranger.first_seen >= RECOGNISED_AFTER and alike > RECOGNISED_ODDS


def _held(scene: Scene, surface: BySurface) -> bool:
    """Whether a small thing is one surface with what is where it is: the hand that holds it."""
    return surface.person.area <= SMALL and surface.expected_body.as_deep(scene) > AS_DEEP


def _as_deep(account: Account, whole: Silhouette, part: Silhouette) -> bool:
    """Whether the rest of somebody is as far along the floor as a part of him, as limbs may be.

    Else it is who comes out from behind the part, and touches it.
    """
    rest = whole.mask & ~part.common(whole)
    ahead = account.scene.forward[whole.rows, whole.cols][rest]
    here = float(account.place(part)[1])
    return abs(float(ahead.mean()) - here) < depth_step(here)


def _score(look: Look, stood: float) -> float:
    """Probability that a box found by look is right, from the response against its mean.

    Args:
        look: that found it.
        stood: log-odds of its place, which only speak against it: what stood there is there too.
    """
    ratio = PART_SEEN if look.moved else float(min(max(look.ratio, 0.0), SUREST_LOOK))
    return ratio if stood >= 0 else 1 / (1 + math.exp(-logit(ratio) - stood))
