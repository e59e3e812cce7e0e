# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the live page keeps of a tracker node's topics; knows no ROS, only what messages say."""

from __future__ import annotations

import dataclasses
import io
import math
import queue
import time
from collections import OrderedDict, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rgbd_kcf_tracker.errors import BoxError, ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.insight import Insight, KnownView
from rgbd_kcf_tracker.live.settings import COMPRESSED, COMPRESSED_DEPTH, RAW
from rgbd_kcf_tracker.live.timeline import Timeline
from rgbd_kcf_tracker.parameters import Parameters, parameter
from rgbd_kcf_tracker.recordings.camera_info import AUTO, RECTIFIED
from rgbd_kcf_tracker.recordings.evidence_messages import TargetEvidence
from rgbd_kcf_tracker.recordings.results import HEADER, row
from rgbd_kcf_tracker.track import Track, TrackState
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS, default_parameters
from rgbd_kcf_tracker.view.board import Board
from rgbd_kcf_tracker.view.commands import MOST_COMMANDS, Command
from rgbd_kcf_tracker.view.controller import describe_variants, yaml_of
from rgbd_kcf_tracker.view.known import Known, known_by
from rgbd_kcf_tracker.view.showing import Detail, Seen, figures, show

EVERYONE = 'follow_everyone'
"""The node's parameter that has it follow people whom nobody chose."""
STAGES = ('transport', 'waiting', 'decode', 'track', 'publish')
"""What an answer takes its time for, as the node's diagnostics tell, each a median."""
EXPECTED_S = 1.0
"""Seconds after the last message for which the next of its kind is waited for."""
SILENT_S = 2.0
"""Seconds after the last answer from which a tracker is silent, and what it said is old."""
NEW_NS = 500_000_000
"""Nanoseconds after which an image no longer shows what a view was taken from."""
_ANSWERS = 64
_MOST_ROWS = 200_000
_MOST_NAMES = 200
_MOST_PEOPLE = 200


@dataclass(frozen=True)
class ViewerParameters(Parameters):
    """Parameters of the viewer node."""

    tracker: str = parameter('tracker', 'Name of the tracker node, with its namespace.')
    host: str = parameter(
        '127.0.0.1', 'Address to listen on; any but a loopback address needs a token.'
    )
    port: int = parameter(8080, 'TCP port of the page.', minimum=0, maximum=65535)
    token: str = parameter(
        '', 'Asked for before anything is shown; better in the environment variable RGBD_KCF_TOKEN.'
    )
    rate: float = parameter(
        10.0, 'Moments shown each second, at most.', unit='Hz', minimum=0.2, maximum=60.0
    )
    color_transport: str = parameter(
        RAW, 'How colour images arrive.', choices=(RAW, COMPRESSED), source='image_transport'
    )
    depth_transport: str = parameter(
        RAW,
        'How depth images arrive.',
        choices=(RAW, COMPRESSED, COMPRESSED_DEPTH),
        source='image_transport',
    )
    color_rectified: str = parameter(
        AUTO,
        'Whether the colour images are rectified: what the tracker is told, or the room and clicks '
        'in it are of another camera.',
        choices=RECTIFIED,
        source='sensor_msgs/CameraInfo',
    )


@dataclass(slots=True)
class _Answer:
    """What the node said of a frame: who is where, and, where it came, why.

    Attributes:
        time_ns: of the frame, from the first of the last minute on; it rises whatever stamps do.
    """

    tracks: dict[int, Track]
    time_ns: int = 0
    evidence: Mapping[int, TargetEvidence] | None = None


@dataclass(slots=True)
class _Looks:
    """What is remembered of how one looks.

    Attributes:
        since_ns: stamp from which answers tell of it; None where it was there before us.
        told: whether evidence has told of it.
        born: stamps from which views are known, None of those that were there before us.
        known: the views with their pictures.
    """

    since_ns: int | None = None
    told: bool = False
    born: dict[KnownView, int | None] = field(default_factory=dict)
    known: tuple[Known, ...] = ()


class LivePage:
    """Answers and images of a tracker node, put together by their stamps.

    Args:
        title: of the page.
        rate_hz: moments put up each second at most.
        detail: of what is sent.
    """

    def __init__(self, title: str, rate_hz: float, detail: Detail | None = None) -> None:
        self.board = Board()
        self.commands: queue.Queue[Command] = queue.Queue(MOST_COMMANDS)
        self.values: dict[str, Any] = {}
        self._title, self._period = title, 1 / rate_hz
        self._detail = detail
        self._answers: OrderedDict[int, _Answer] = OrderedDict()
        self._pending: tuple[int, dict[str, Any]] | None = None
        self._early: tuple[int, Mapping[int, TargetEvidence]] | None = None
        self._answered_at = self._explained_at = -math.inf
        self._looks: OrderedDict[int, _Looks] = OrderedDict()
        self._rows: deque[tuple[int, int, Track]] = deque(maxlen=_MOST_ROWS)
        self._count = 0
        self._origin_ns: int | None = None  # in the timeline's time
        self._ahead_ns: int | None = None  # of its stamp, the time of the last answer
        self._timeline = Timeline()
        self._frame: Frame | None = None
        self._figures: dict[str, str] = {}
        self._lately = 0
        self._word = ''
        self._said = 0.0
        self._due_at = 0.0
        self._names: OrderedDict[int, str] = OrderedDict()

    # -- what the page asks -----------------------------------------------------------------------

    def do(self, command: Command) -> None:
        """Take a request, for the node to carry out."""
        try:
            self.commands.put_nowait(command)
        except queue.Full:
            return

    def description(self) -> dict[str, Any]:
        """What does not change with every moment."""
        return {
            'title': self._title,
            'live': True,
            'frames': 0,
            'period': self._period,
            'variants': describe_variants(),
            'several': True,
            'stages': STAGES,
        }

    def boxes_csv(self) -> str:
        """The boxes since the page was started, up to the last two hundred thousand."""
        out = io.StringIO()
        out.write(','.join(('id', *HEADER)) + '\n')
        for number, stamp_ns, track in list(self._rows):
            out.write(f'{track.id},{row(number, stamp_ns, track)}\n')
        return out.getvalue()

    def parameters_yaml(self) -> str:
        """The parameters of the node's variant, as far as it has told them."""
        variant = self.variant
        known = {
            name.partition('.')[2]: value
            for name, value in self.values.items()
            if name.startswith(f'{variant}.')
        }
        return yaml_of(variant, default_parameters(variant).replace(**known))

    @property
    def everyone(self) -> bool:
        """Whether the node follows people whom nobody chose, as far as it has told."""
        return bool(self.values.get(EVERYONE, False))

    @property
    def frame(self) -> Frame | None:
        """The frame that was put up last."""
        return self._frame

    @property
    def variant(self) -> str:
        """The node's, the default before it has told."""
        name = self.values.get('variant', DEFAULT_VARIANT)
        return name if name in VARIANTS else DEFAULT_VARIANT

    # -- what the node says -----------------------------------------------------------------------

    def rename(self, number: int, name: str) -> None:
        """Call a target by a name, in this page alone; the last two hundred named are kept."""
        if name:
            self._names[number] = name
            self._names.move_to_end(number)
            while len(self._names) > _MOST_NAMES:
                self._names.popitem(last=False)

    def begin_anew(self) -> None:
        """The tracker was started anew: its ids begin again, and are of others."""
        self._names.clear()
        self._looks.clear()
        self._answers.clear()
        self._pending = self._early = None
        self._origin_ns, self._timeline = None, Timeline()

    def box_of(self, number: int) -> Box:
        """Where a target was in the last answer.

        Raises:
            BoxError: where it has no box.
        """
        track = self._latest().tracks.get(number)
        if track is None or track.box is None:
            raise BoxError('not in sight now: try again when it is')
        return track.box

    def _latest(self) -> _Answer:
        return next(reversed(self._answers.values()), _Answer({}))

    def figures(self, values: Mapping[str, str]) -> None:
        """What ``/diagnostics`` says of the node."""
        dropped = _number(values.get('dropped'))  # which the node counts from the first on
        if self._figures:
            self._lately += max(0, int(dropped - _number(self._figures.get('dropped'))))
        self._figures = dict(values)

    def answer(self, stamp_ns: int, tracks: Sequence[Track]) -> None:
        """``~/state``: the answer to a frame, the chosen target first."""
        self._settle()
        before = self._latest().tracks
        instant = self._timeline.advance(stamp_ns, time.monotonic_ns())
        if instant.restarted:  # the same stamps come again, with other answers
            self._answers.clear()
        if self._origin_ns is None or instant.restarted:
            self._origin_ns = instant.time_ns
            self.board.rewind([])
        time_ns = instant.time_ns - self._origin_ns
        self._ahead_ns = time_ns - stamp_ns
        found = {track.id: track for track in tracks if track.state is not TrackState.IDLE}
        self._answers[stamp_ns] = _Answer(found, time_ns)
        while len(self._answers) > _ANSWERS:
            self._answers.popitem(last=False)
        now = time.monotonic()
        listened, self._answered_at = now - self._answered_at < EXPECTED_S, now
        for number in found:
            looks = self._looks.setdefault(number, _Looks())
            self._looks.move_to_end(number)
            if number not in before:  # or back, or of a tracker that was started anew
                looks.since_ns = stamp_ns if listened else None
                looks.known = tuple(known for known in looks.known if known.view is not None)
        while len(self._looks) > _MOST_PEOPLE:
            self._looks.popitem(last=False)
        self._count += 1
        self._rows.extend((self._count - 1, stamp_ns, track) for track in found.values())
        entry: dict[str, Any] = {
            't': round(time_ns * 1e-9, 3),
            **{stage: _number(self._figures.get(f'{stage}_median_ms')) for stage in STAGES},
        }
        if self._lately:
            entry['dropped'], self._lately = self._lately, 0
        self._pending = stamp_ns, entry
        if self._early is not None and self._early[0] == stamp_ns:
            self._answers[stamp_ns].evidence = self._early[1]
        if self.complete(stamp_ns):
            self._settle()

    def evidence(self, stamp_ns: int, evidence: Mapping[int, TargetEvidence]) -> None:
        """``~/evidence``: why, a moment after the answer to the same frame, or before it."""
        now = time.monotonic()
        listened, self._explained_at = now - self._explained_at < EXPECTED_S, now
        for number, told in evidence.items():
            looks = self._looks.get(number)
            if looks is None:
                continue
            new = looks.since_ns is not None and stamp_ns - looks.since_ns < NEW_NS
            born = stamp_ns if new or (listened and looks.told) else None
            looks.told = True
            looks.born = {view: looks.born.get(view, born) for view in told.insight.gallery}
        answer = self._answers.get(stamp_ns)
        if answer is None:
            self._early = stamp_ns, evidence
            return
        answer.evidence = evidence
        if self._pending is not None and self._pending[0] == stamp_ns:
            self._settle()

    def _settle(self) -> None:
        """Put the figures of the last answer into the last minute, with its evidence if it came."""
        if self._pending is None:
            return
        (stamp_ns, entry), self._pending = self._pending, None
        answer = self._answers[stamp_ns]
        insights = _insights(answer)
        entry['targets'] = [figures(n, answer.tracks, insights.get(n)) for n in answer.tracks]
        self.board.note(entry)

    @property
    def answering(self) -> bool:
        """Whether the tracker has answered a moment ago."""
        return time.monotonic() - self._answered_at < EXPECTED_S

    def complete(self, stamp_ns: int) -> bool:
        """Whether all that is to be expected of a frame is there."""
        answer = self._answers.get(stamp_ns)
        if answer is None:
            return False
        explaining = time.monotonic() - self._explained_at < EXPECTED_S
        return not answer.tracks or answer.evidence is not None or not explaining

    def due(self) -> bool:
        """Whether somebody looks and the next moment may be put up."""
        return self.board.watched and time.monotonic() >= self._due_at

    def image(self, frame: Frame, stamp_ns: int) -> None:
        """Put up an image with the answer to it, or the last one before."""
        # What came late delays the next no more, or only halves, thirds of a rate were reached.
        self._due_at = max(self._due_at + self._period, time.monotonic())
        self._frame = frame
        if self._pending is not None and self._pending[0] <= stamp_ns:
            self._settle()
        silent = time.monotonic() - self._answered_at > SILENT_S
        answer = _Answer({}) if silent else self._answers.get(stamp_ns, self._latest())
        evidence = answer.evidence or {}
        tracks = {
            number: dataclasses.replace(
                track, velocity=evidence[number].velocity, covariance=evidence[number].covariance
            )
            if number in evidence
            else track
            for number, track in answer.tracks.items()
        }
        if stamp_ns in self._answers and not silent:
            self._remember(frame, stamp_ns, answer)
        chosen = frozenset(number for number in tracks if self._asked_for(number, answer))
        names = {
            key: self._names.get(key, f'{"target" if key in chosen else "person"} {key}')
            for key in tracks
        }
        if stamp_ns in self._answers:
            time_ns = self._answers[stamp_ns].time_ns
        else:
            time_ns = 0 if self._ahead_ns is None else stamp_ns + self._ahead_ns
        variant = self.variant
        prefix = f'{variant}.'
        status = {
            'time': round(time_ns * 1e-9, 3),
            'playing': True,
            'silent': silent,
            'everyone': self.everyone,
            'busy': '',
            'word': self._word if time.monotonic() - self._said < 1.0 else '',
            'variant': variant,
            'values': {
                name.removeprefix(prefix): value
                for name, value in self.values.items()
                if name.startswith(prefix)
            },
        }
        if 'latency_median_ms' in self._figures:
            status['latency'] = round(_number(self._figures['latency_median_ms']), 1)
        if self._figures:
            status['dropped'] = int(_number(self._figures.get('dropped')))
        known = {number: looks.known for number, looks in self._looks.items()}
        seen = Seen(frame, tracks, names, chosen, _insights(answer), known, status=status)
        self.board.show(*show(seen, self._detail))

    def _asked_for(self, number: int, answer: _Answer) -> bool:
        if answer.evidence is not None and number in answer.evidence:
            return answer.evidence[number].asked_for
        # Beside everyone the chosen one alone was, as far as the answer itself tells.
        return not self.everyone or number == next(iter(answer.tracks), None)

    def _remember(self, frame: Frame, stamp_ns: int, answer: _Answer) -> None:
        """Keep a picture of each view that has come up about when this image was taken."""

        def before(born: int | None) -> bool:
            return born is None or abs(stamp_ns - born) > NEW_NS

        for number, told in (answer.evidence or {}).items():
            looks, track = self._looks.get(number), answer.tracks.get(number)
            if looks is None or track is None:
                continue
            gallery = told.insight.gallery
            first = bool(gallery) or not before(looks.since_ns)
            older = [view for view in gallery if before(looks.born.get(view))]
            box = track.box if first else None
            looks.known = known_by(gallery, looks.known, frame, box, older)

    def say(self, word: str) -> None:
        """Words for the page, with the next moment."""
        self._word, self._said = word, time.monotonic()


def _insights(answer: _Answer) -> dict[int, Insight]:
    return {number: told.insight for number, told in (answer.evidence or {}).items()}


def _number(text: str | None) -> float:
    try:
        value = float(text or 0)
    except ValueError:
        return 0.0
    return value if value == value and abs(value) < 1e12 else 0.0


def node_parameter(command: Command, variant: str) -> tuple[str, Any]:
    """The ROS parameter that a command sets: its name with the variant's prefix, its value.

    Raises:
        ParameterError: where there is no such parameter.
    """
    if command.do == 'variant':
        if command.values['name'] not in VARIANTS:
            raise ParameterError(f'unknown variant {command.values["name"]!r}')
        return 'variant', command.values['name']
    name, value = command.values['name'], command.values['value']
    # Checked here too, so that what is refused is said in our words.
    parameters = default_parameters(variant).replace(**{name: value})
    return f'{variant}.{name}', getattr(parameters, name)
