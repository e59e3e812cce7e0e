# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The targets and who follows them: what was asked of the tracker, applied at the right frame.

Plain Python, one thread: the node's worker calls it; tests call it directly.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.insight import Insight, insight_in
from rgbd_kcf_tracker.live.settings import MOST_TARGETS
from rgbd_kcf_tracker.live.story import Story, taken
from rgbd_kcf_tracker.metric.targets import SAME_BOX
from rgbd_kcf_tracker.parameters import Parameters
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.recordings.storage import NANOSECONDS
from rgbd_kcf_tracker.targets import TargetSet
from rgbd_kcf_tracker.track import Track, TrackState
from rgbd_kcf_tracker.variants import create_tracker

Choice = Callable[[Frame], 'Box | None']
"""Finds the target in a frame: None to look again in the next. May raise an RgbdKcfError."""

IDLE = Track(None, TrackState.IDLE)
REQUESTS_SHARE = 0.2
"""Share of the time that may go into starting on targets: a storm of requests leaves the rest."""
REQUESTS_CREDIT_S = 0.3
"""So much of it is saved up: a few requests in a row are met at once."""
MOST_ADDITIONS = 50
"""Targets that wait to be added at most."""
HIDDEN_WAIT_NS = 10 * NANOSECONDS
"""So long a change of variant or parameters waits for those who were added and are hidden."""
_ALREADY = 'what is in that box is followed already, as target {}'

_warm: set[str] = set()


def warm_up(variant: str) -> None:
    """Have a variant run once, so that its lazy imports and caches do not delay a live frame."""
    if variant in _warm:
        return
    _warm.add(variant)
    rng = np.random.default_rng(0)
    color = rng.integers(0, 255, (120, 160, 3), np.uint8)
    depth = np.full((120, 160), 3.0, np.float32)
    depth[40:90, 60:90] = 2.0
    tracker = create_tracker(variant)
    camera = Intrinsics.guess(160, 120)
    tracker.start(Frame(color, depth, 0, camera), Box(60, 40, 30, 50))
    for step in range(1, 4):
        tracker.update(Frame(color, depth, step * 33_333_333, camera))


class Session:
    """The targets, who follows them, and what waits for the next frame.

    One target is the chosen one. Others may be followed beside it: those that were added, and, with
    :attr:`everyone`, whoever is in view. An id is never given twice while the session lives.

    Args:
        variant: name of the tracker.
        parameters: of that variant.
        report: told what went wrong with a request, in words for the user.
        now: the wall clock in seconds, monotonic.
        tell: told what happened to the targets, in words for the user.

    Attributes:
        track: of the chosen target.
        others: tracks of the others.
        most: targets that are chosen or added and followed at once.
    """

    def __init__(
        self,
        variant: str,
        parameters: Parameters,
        report: Callable[[str], None],
        now: Callable[[], float] = time.monotonic,
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._variant, self._parameters = variant, parameters
        self._wanted = (variant, parameters)
        self._waits_from: int | None = None
        self._seen_ns: dict[int, int] = {}
        self._targets = self._empty = TargetSet(variant, parameters)
        self._everyone = False
        self._chosen: int | None = None
        self._added: list[int] = []
        self._ids: dict[int, int] = {}
        self._last_id = 0
        self._report, self._tell = report, tell
        self._story = Story(tell)
        self._choice: Choice | None = None
        self._additions: deque[Choice] = deque(maxlen=MOST_ADDITIONS)
        self._auto: Choice | None = None
        self._auto_again = False
        self._now = now
        self._credit_s, self._credited = REQUESTS_CREDIT_S, now()
        self.track = IDLE
        self.others: tuple[Track, ...] = ()
        self.most = MOST_TARGETS

    @property
    def variant(self) -> str:
        """Name of the tracker at work."""
        return self._variant

    @property
    def following(self) -> bool:
        """Whether anybody is followed."""
        return self._chosen is not None or bool(self._added) or self._targets.everyone

    @property
    def camera_motion(self) -> Pose | None:
        """How the camera seems to have moved in the last frame; None for not at all, or unknown."""
        return None if self._targets.metric is None else self._targets.metric.camera_motion

    @property
    def asked_for(self) -> frozenset[int]:
        """Ids of those who were chosen or added, not of those who are followed with everyone."""
        return frozenset(self._known() | {self.track.id}) - {IDLE.id}

    def insights(self) -> dict[int, Insight]:
        """What is known by id of each who is followed, after the last frame; computed now."""
        told = {track.id for track in (self.track, *self.others)}
        return {
            number: insight_in(self._targets, inner)
            for inner, number in self._ids.items()
            if number in told
        }

    @property
    def needs_frame(self) -> bool:
        """Whether the next frame's pixels matter: a target is followed or to be chosen."""
        return self.choosing or self.following

    @property
    def choosing(self) -> bool:
        """Whether a target is to be chosen in the next frame."""
        return self.due or self._auto_due()

    @property
    def due(self) -> bool:
        """Whether a target was asked for, and its turn has come."""
        if self._choice is None and not self._additions:
            return False
        return self._credit() > 0

    def _credit(self) -> float:
        """Seconds that requests may take now."""
        saved = self._credit_s + (self._now() - self._credited) * REQUESTS_SHARE
        return min(saved, REQUESTS_CREDIT_S)

    # -- what is asked ----------------------------------------------------------------------------

    def choose_by_itself(self, auto: Choice | None, again: bool = False) -> None:
        """Ask ``auto`` for a target whenever there is none.

        Args:
            auto: None: wait to be told.
            again: also when the target is lost.
        """
        self._auto, self._auto_again = auto, again

    def _auto_due(self) -> bool:
        state = self.track.state
        lost = state is TrackState.LOST and self._auto_again
        return self._auto is not None and (state is TrackState.IDLE or lost)

    def choose(self, choice: Choice) -> None:
        """Take the target that ``choice`` finds, from the next frame on, for what was asked before.

        Where requests come so fast that starting takes more than :data:`REQUESTS_SHARE` of the
        time, the newest waits for its turn.
        """
        self._choice = choice

    def add(self, choice: Choice) -> None:
        """Follow what ``choice`` finds beside the others; the chosen one where there is none."""
        if len(self._additions) == MOST_ADDITIONS:
            self._report(f'{MOST_ADDITIONS} targets wait to be added: the oldest is dropped')
        self._additions.append(choice)

    def remove(self, number: int) -> None:
        """No longer follow the target of that id."""
        for inner in (self._chosen, *self._added):
            if inner is not None and self._ids.get(inner) == number:
                break
        else:
            chosen = (self._chosen, *self._added)
            known = sorted(self._ids[i] for i in chosen if i is not None)
            listed = ', '.join(map(str, known)) or 'none'
            self._report(f'no target {number} was chosen or added: those are {listed}')
            return
        self._targets.remove(inner)
        if inner == self._chosen:
            self._chosen, self.track = None, IDLE
            self._story.restart()
        else:
            self._added.remove(inner)
        self.others = tuple(track for track in self.others if track.id != number)
        self._tell(f'target {number} removed')

    @property
    def everyone(self) -> bool:
        """Whether whoever is in view is followed too; only ``metric`` can."""
        return self._everyone

    @everyone.setter
    def everyone(self, value: bool) -> None:
        self._everyone = value
        self._apply_everyone()

    def _apply_everyone(self) -> None:
        able = self._targets.metric is not None
        if self._everyone and not able:
            self._report(f'variant {self._variant} follows chosen targets only, not everyone')
        if able:
            self._targets.everyone = self._everyone
        if not self._everyone:
            self.others = tuple(t for t in self.others if t.id in self._known())

    def _known(self) -> set[int]:
        return {self._ids[i] for i in self._added}

    def reset(self) -> None:
        """Drop all targets and whatever was asked."""
        if self.track.state is not TrackState.IDLE or self._added:
            self._tell('all targets dropped' if self._added else 'target dropped')
        self._choice = None
        self._additions.clear()
        self._renew()

    def _renew(self) -> None:
        """Begin anew with what is wanted."""
        self.track = IDLE
        self._replace(self._empty.anew())
        self._story.restart()

    def configure(self, variant: str, parameters: Parameters) -> None:
        """Use another tracker or other parameters, as soon as no hidden target would be lost.

        Where that cannot be, it is said, and the last goes on.
        """
        if self._wanted == (variant, parameters):
            return
        try:
            self._empty = TargetSet(variant, parameters)
        except RgbdKcfError as error:
            self._report(str(error))
            return
        self._wanted, self._waits_from = (variant, parameters), None
        if not self.following:
            self._renew()

    # -- starting ---------------------------------------------------------------------------------

    def start_as_asked(self, frame: Frame) -> bool:
        """Start on this frame what is :attr:`due`; True where there is a new chosen target."""
        with self.charged():
            started = self._chosen_as_asked(frame)
        # One at least: the chosen one may be asked for again and again.
        for _ in range(len(self._additions)):
            with self.charged():
                self._added_as_asked(frame, self._additions.popleft())
            if self._credit() <= 0:
                break
        return started

    @contextmanager
    def charged(self) -> Iterator[None]:
        """Count what is done within as time that went into requests."""
        begun = self._now()
        self._credit_s, self._credited = self._credit(), begun
        try:
            yield
        finally:
            self._credit_s -= self._now() - begun

    def _chosen_as_asked(self, frame: Frame) -> bool:
        choice, self._choice = self._choice, None
        if choice is None:
            return False
        try:
            box = choice(frame)
        except RgbdKcfError as error:
            self._report(str(error))
            return False
        if box is None:
            self._choice = choice
        return box is not None and self.start(frame, box)

    def _added_as_asked(self, frame: Frame, choice: Choice) -> None:
        try:
            box = choice(frame)
            if box is None:
                self._additions.append(choice)
            elif (number := self._shown_in(box)) is not None:
                self._report(_ALREADY.format(number))
            elif len(self._added) + (self._chosen is not None) >= self.most:
                self._report(
                    f'{self.most} targets are followed, as many as max_targets allows: remove one '
                    'before another is added'
                )
            elif self._chosen is None:
                self.start(frame, box)
            else:
                self._add(frame, box)
        except RgbdKcfError as error:
            self._report(str(error))

    def _shown_in(self, box: Box) -> int | None:
        """The id of the target that was chosen or added, and that a box shows best."""
        known = self.asked_for
        shown = [
            (track.box.iou(box), track.id)
            for track in (self.track, *self.others)
            if track.id in known and track.box is not None
        ]
        overlap, number = max(shown, default=(0.0, 0))
        return number if overlap >= SAME_BOX else None

    def _add(self, frame: Frame, box: Box) -> None:
        inner = self._targets.add(frame, box)
        track = self._named(self._targets.started(inner))
        if inner == self._chosen or inner in self._added:
            self._report(_ALREADY.format(track.id))
            return
        self._added.append(inner)
        self.others = (*(t for t in self.others if t.id != track.id), track)
        self._tell(taken(track, 'added'))

    def start(self, frame: Frame, box: Box) -> bool:
        """Take this target; where that fails, the one that is followed is kept, and it is said.

        Alone, it starts with nothing remembered; among others, with what is known of all: who was
        chosen or added keeps his id, and is followed once.
        """
        among = self._added or self._targets.everyone
        targets = self._targets if among else self._empty.anew()
        shown = self._shown_in(box)
        try:
            inner = targets.add(frame, box)
        except RgbdKcfError as error:
            self._report(str(error))
            return False
        if not among:
            self._replace(targets)
        elif self._chosen is not None and self._chosen != inner:
            self._targets.remove(self._chosen)
        if inner in self._added:
            self._added.remove(inner)
        # With metric the same person has the same id in the set; otherwise a start has a new one.
        old = next((i for i, number in self._ids.items() if number == shown), None)
        if targets.metric is None and old is not None:
            if old in self._added:
                targets.remove(old)
                self._added.remove(old)
            self._ids[inner] = self._ids.pop(old)
        self._chosen = inner
        self.track = self._named(targets.started(inner))
        self.others = tuple(t for t in self.others if t.id != self.track.id)
        self._tell(taken(self.track))
        self._story.restart(self.track)
        return True

    @property
    def _current(self) -> bool:
        return self._wanted == (self._variant, self._parameters)

    def _replace(self, targets: TargetSet) -> None:
        """Go on with another set, in which ids of the last one mean nothing."""
        if self._variant != self._wanted[0]:
            self._tell(f'variant {self._wanted[0]} instead of {self._variant}')
        self._variant, self._parameters = self._wanted
        self._targets, self._chosen, self._added, self._ids = targets, None, [], {}
        self.others = ()
        self._apply_everyone()

    def _named(self, track: Track) -> Track:
        """The track with an id of the session for that of the set."""
        if track.id not in self._ids:
            self._forget()
            self._last_id += 1
            self._ids[track.id] = self._last_id
        return replace(track, id=self._ids[track.id])

    def _forget(self) -> None:
        """Drop the ids of whom the set has forgotten: it gives them to nobody again."""
        metric, asked = self._targets.metric, {self._chosen, *self._added}
        self._ids = {
            inner: number
            for inner, number in self._ids.items()
            if inner in asked or (metric is not None and metric.person(inner) is not None)
        }

    # -- following --------------------------------------------------------------------------------

    def process(self, frame: Frame) -> Track:
        """Follow the targets into the next frame, or start on it; the chosen one's track."""
        # What is to be added is compared with where the others are in this frame.
        others = bool(self._added or self._additions) or self._targets.everyone
        if others:
            self._update(frame)
        if self.due and self.start_as_asked(frame):
            return self.track
        if self._choice is None and self._auto is not None and self._auto_due():
            found = self._auto(frame)
            if found is not None and self.start(frame, found):
                return self.track
        if not others and self.track.state is not TrackState.IDLE:
            self._update(frame)
        if self.following:
            self._take_over(frame)
        return self.track

    def settle(self) -> None:
        """Do what could wait until the answer was out; from then on it does wait."""
        if self._targets.metric is not None:
            self._targets.metric.settle()
            self._targets.metric.puts_off = True

    def _update(self, frame: Frame) -> None:
        tracks = self._targets.update(frame)
        chosen = None if self._chosen is None else tracks.pop(self._chosen)
        self.track = IDLE if chosen is None else self._named(chosen)
        self.others = tuple(self._named(track) for track in tracks.values())
        asked = self.asked_for
        self._seen_ns = {i: seen for i, seen in self._seen_ns.items() if i in asked}
        for track in (self.track, *self.others):
            if track.id in asked and _shown(track, frame):
                self._seen_ns[track.id] = frame.stamp_ns
        self._story.follow(self.track, frame.stamp_ns)

    def _take_over(self, frame: Frame) -> None:
        """Go over to what is wanted, once all are seen who were chosen or added.

        The chosen one is waited for however long, and so is the last one left where none was
        chosen; the others for :data:`HIDDEN_WAIT_NS` since the change was asked for, and who of
        them is hidden then is dropped. Where all are hidden, the one who was seen last is left.
        """
        if self._current:
            return
        if self._waits_from is None:
            self._waits_from = frame.stamp_ns
        asked = self.asked_for
        hidden = [
            track.id
            for track in (self.track, *self.others)
            if track.id in asked and not _shown(track, frame)
        ]
        long = frame.stamp_ns - self._waits_from >= HIDDEN_WAIT_NS
        if hidden and (self.track.id in hidden or not long):
            return
        if hidden and len(hidden) == len(asked):
            left = max(hidden, key=lambda number: (self._seen_ns.get(number, 0), number))
            self._drop_hidden([number for number in hidden if number != left])
            return
        targets = self._empty.anew()
        everyone = self._everyone and targets.metric is not None
        ids: dict[int, int] = {}
        try:
            for track in (self.track, *self.others):
                wanted = everyone or track.id in asked
                if wanted and track.box is not None and _shown(track, frame):
                    ids.setdefault(targets.add(frame, track.box), track.id)
        except RgbdKcfError as error:
            self._report(str(error))
            self._wanted = (self._variant, self._parameters)
            self._empty = self._targets
            return
        self._drop_hidden(hidden)
        for inner, number in ids.items():
            if number not in asked:  # known from now on, by that id, and followed with everyone
                targets.remove(inner)
        track, others = self.track, self.others
        chosen = self._chosen is not None
        self._replace(targets)
        self._ids = ids
        kept = [inner for inner, number in ids.items() if number in asked]
        self._chosen, self._added = (kept[0], kept[1:]) if chosen else (None, kept)
        self.track, self.others = track, others

    def _drop_hidden(self, numbers: list[int]) -> None:
        """Drop those of these ids who were added, and say so."""
        for number in numbers:
            self._report(
                f'target {number} is hidden, also {HIDDEN_WAIT_NS // NANOSECONDS} s after variant '
                'or parameters were changed: it is dropped'
            )
        for inner in [i for i in self._added if self._ids[i] in numbers]:
            self._targets.remove(inner)
            self._added.remove(inner)
        self.others = tuple(track for track in self.others if track.id not in numbers)


def _shown(track: Track, frame: Frame) -> bool:
    """Whether a track has a box that can be started on."""
    return track.box is not None and track.box.clipped(frame.width, frame.height) is not None
