# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A recording that is played, stepped and sought while it is tracked.

Every frame up to the farthest one reached is tracked once and remembered; going back shows what was
said there. A new target, or another parameter, has the run go on from the frame that is shown.
"""

from __future__ import annotations

import io
import itertools
import logging
import queue
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from rgbd_kcf_tracker.errors import BoxError, ParameterError, RecordingError, RgbdKcfError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.insight import Insight
from rgbd_kcf_tracker.metric.pointing import target_at
from rgbd_kcf_tracker.parameters import Parameters, checked, describe
from rgbd_kcf_tracker.recordings import Recording
from rgbd_kcf_tracker.recordings.results import HEADER, row
from rgbd_kcf_tracker.track import Track
from rgbd_kcf_tracker.variants import VARIANTS, default_parameters
from rgbd_kcf_tracker.view.board import HISTORY_S, Board
from rgbd_kcf_tracker.view.commands import MOST_COMMANDS, Command
from rgbd_kcf_tracker.view.controller import describe_variants, yaml_of
from rgbd_kcf_tracker.view.known import Known, known_by
from rgbd_kcf_tracker.view.showing import Detail, Seen, figures, show
from rgbd_kcf_tracker.view.targets import PageTargets, follows_everyone

SPEEDS = (0.1, 8.0)
SHOWN_HZ = 20.0
"""Moments put up each second at most; every frame is tracked all the same."""
BUSY_S = 0.5
"""Between two words about how far it is where many frames are tracked at once."""
STAGES = ('read', 'track', 'show')
"""What a moment takes its time for."""
WARM_UP = 30
"""Frames before the one shown from which a run that follows everyone goes on: who stands before a
room is known when the room is."""
_LOG = logging.getLogger(__name__)
_IDLE_S = 0.2


@dataclass
class Passed:
    """What is remembered of a frame that was tracked.

    Attributes:
        stamp_ns: of the frame.
        tracks: by id.
        chosen: ids of those who were asked for.
        entry: its figures for the time line.
    """

    stamp_ns: int
    tracks: dict[int, Track]
    chosen: frozenset[int] = frozenset()
    entry: dict[str, Any] = field(default_factory=dict)


class Player:
    """Plays a recording for the page; see :class:`~rgbd_kcf_tracker.view.controller.Controller`.

    Args:
        recording: of frames; read by this player alone.
        variant: of the tracker.
        parameters: of the variant; None for the released defaults.
        start: the frame shown first.
        box: the target in it; None to have it picked in the page.
        everyone: whether people whom nobody chose are followed too.
        detail: of what is sent.

    Raises:
        RecordingError: where there is no such frame.
        ParameterError: where everyone is to be followed and the variant cannot.
    """

    def __init__(
        self,
        recording: Recording,
        variant: str,
        parameters: Parameters | None = None,
        *,
        start: int = 0,
        box: Box | None = None,
        everyone: bool = False,
        detail: Detail | None = None,
    ) -> None:
        if not 0 <= start < len(recording):
            raise RecordingError(f'{recording.path} has no frame {start} to show')
        self.board = Board()
        self._recording = recording
        self._variant = variant
        self._parameters = default_parameters(variant) if parameters is None else parameters
        self._detail = detail
        self._first, self._first_box = start, box
        self._commands: queue.Queue[Command] = queue.Queue(MOST_COMMANDS)
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

        self._passed: dict[int, Passed] = {}
        self._everyone = everyone
        self._numbers = itertools.count(1)
        self._targets = PageTargets(variant, self._parameters, everyone, self._numbers)
        self._names: dict[int, str] = {}
        self._front = start - 1  # the last frame that the trackers have seen
        self._shown = start
        self._frame: Frame | None = None
        self._insights: dict[int, Insight] = {}
        self._known: dict[int, tuple[Known, ...]] = {}
        self._reader: Iterator[Frame] | None = None
        self._next = start
        self._origin_ns = 0
        self._playing = False
        self._speed = 1.0
        self._due = 0.0
        self._put_up = 0.0
        self._word = ''
        self._busy = ''
        self._told = 0.0
        self._timing: dict[str, float] = {}

    # -- what the page asks -----------------------------------------------------------------------

    def do(self, command: Command) -> None:
        """Take a request; it is carried out in the player's thread, those beyond reason are not."""
        try:
            self._commands.put_nowait(command)
        except queue.Full:
            return

    def description(self) -> dict[str, Any]:
        """What does not change with every moment."""
        return {
            'title': self._recording.name,
            'live': False,
            'frames': len(self._recording),
            'variants': describe_variants(),
            'several': True,
            'stages': STAGES,
        }

    def boxes_csv(self) -> str:
        """All boxes of the run, with ids; a row per frame and target."""
        out = io.StringIO()
        out.write(','.join(('id', *HEADER)) + '\n')
        for number, passed in sorted(self._passed.copy().items()):
            for key, track in passed.tracks.items():
                out.write(f'{key},{row(number, passed.stamp_ns, track)}\n')
        return out.getvalue()

    def parameters_yaml(self) -> str:
        """The parameters at work."""
        return yaml_of(self._variant, self._parameters)

    def straight_through(self, end: int) -> Iterator[tuple[int, Seen, dict[str, Any]]]:
        """Track to the frame before ``end`` in this thread, giving what is seen of each."""
        self._open()
        while True:
            yield self._shown, self._seen(), self._passed[self._shown].entry
            if self._shown + 1 >= end:
                return
            self._go_to(self._shown + 1, show_it=False)

    # -- the thread -------------------------------------------------------------------------------

    def start(self) -> None:
        """Begin, in a thread of its own."""
        self._thread = threading.Thread(target=self.run, name='player', daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join(10)

    def run(self) -> None:
        """Carry out requests and play until :meth:`stop`."""
        self._guarded(self._open)
        was_watched = False
        while not self._stopping.is_set():
            wait = _IDLE_S
            if self._playing:
                wait = min(max(self._due - time.monotonic(), 0.0), _IDLE_S)
            try:
                command = self._commands.get(timeout=wait) if wait > 0 else None
                command = self._commands.get_nowait() if wait <= 0 else command
                assert command is not None
                self._guarded(lambda command=command: self._carry_out(command))  # type: ignore[misc]
            except queue.Empty:
                pass
            if self._playing and time.monotonic() >= self._due:
                self._guarded(self._play_on)
            if self.board.watched and not was_watched:
                self._show()
            was_watched = self.board.watched

    def _guarded(self, action: Any) -> None:
        """Do it; what cannot be done is said on the page, and nothing ends."""
        try:
            action()
        except RgbdKcfError as error:
            self._playing = False
            self._say(str(error))
        except Exception as error:  # a bug must not leave a page that does not answer any more
            _LOG.exception('the player could not go on')
            self._playing = False
            self._say(f'internal error: {type(error).__name__}: {error}')

    def _say(self, word: str) -> None:
        self._word, self._busy = word, ''
        self._show()
        self._word = ''

    def _open(self) -> None:
        self._go_to(self._first)
        if self._first_box is not None:
            self._add(self._first_box)
        self._show()

    def _carry_out(self, command: Command) -> None:
        values = command.values
        if command.do == 'play':
            if self._shown >= len(self._recording) - 1:
                self._go_to(self._first)
            self._playing, self._due = True, time.monotonic()
        elif command.do == 'pause':
            self._playing = False
        elif command.do == 'step':
            self._playing = False
            self._go_to(self._shown + max(-1000, min(values['by'], 1000)))
        elif command.do == 'seek':
            self._go_to(values['frame'])
        elif command.do == 'speed':
            self._speed = min(max(values['value'], SPEEDS[0]), SPEEDS[1])
        elif command.do == 'box':
            self._pick(values['frame'], lambda _: Box(*(values[n] for n in _BOX)))
        elif command.do == 'point':
            self._pick(values['frame'], lambda frame: target_at(frame, values['x'], values['y']))
        elif command.do == 'follow':
            self._pick(values['frame'], lambda _: self._box_of(values['id']))
        elif command.do == 'everyone':
            self._follow_everyone(values['value'])
        elif command.do == 'remove':
            self._remove(values['id'])
        elif command.do == 'rename':
            passed = self._passed.get(self._shown)
            if values['name'] and passed is not None and values['id'] in passed.tracks:
                self._names[values['id']] = values['name']
        elif command.do == 'variant':
            if values['name'] not in VARIANTS:
                raise ParameterError(f'unknown variant {values["name"]!r}')
            self._reconfigure(values['name'], default_parameters(values['name']))
        elif command.do == 'parameter':
            self._set(values['name'], values['value'])
        elif command.do == 'defaults':
            self._reconfigure(self._variant, default_parameters(self._variant))
        self._show()

    # -- playing ----------------------------------------------------------------------------------

    def _play_on(self) -> None:
        if self._shown >= len(self._recording) - 1:
            self._playing = False
            self._show()
            return
        before = self._passed[self._shown].stamp_ns if self._shown in self._passed else None
        self._go_to(self._shown + 1, show_it=False)
        after = self._passed[self._shown].stamp_ns
        interval = (after - before) * 1e-9 if before is not None else 0.0
        now = time.monotonic()
        # What was late is not made up for: the run goes on at its pace.
        self._due = max(self._due + min(max(interval, 0.0), 5.0) / self._speed, now)
        if now - self._put_up >= 1 / SHOWN_HZ or self._shown >= len(self._recording) - 1:
            self._show()

    def _go_to(self, wanted: int, show_it: bool = True) -> None:
        """Show a frame; those between it and the last one tracked are tracked first."""
        wanted = min(max(wanted, 0), len(self._recording) - 1)
        anew = wanted != self._shown + 1
        if (len(self._targets) or self._everyone) and wanted > self._front:
            self._told = time.monotonic()
            for number in range(self._front + 1, wanted + 1):
                self._track(number, self._read(number))
                if self._told_of(number, wanted) and self._interrupted():
                    wanted = number
                    break
            self._busy = ''
            self._shown = wanted
        else:
            frame = self._read(wanted)
            self._shown = wanted
            self._insights = {}
            if wanted not in self._passed:
                self._passed[wanted] = Passed(frame.stamp_ns, {})
                self._entry(wanted)
        if anew and show_it:
            self.board.rewind(self._history())
        elif self._shown in self._passed:
            self.board.note(self._passed[self._shown].entry)

    def _told_of(self, number: int, wanted: int) -> bool:
        """Show now and then a frame on the way to another; whether it was shown now."""
        # The last one is shown when its figures are on the board too.
        if number >= wanted or time.monotonic() - self._told <= BUSY_S:
            return False
        self._told = time.monotonic()
        self._busy = f'tracking up to frame {wanted}: at {number}'
        self._shown = number
        self._show()
        return True

    def _interrupted(self) -> bool:
        return self._stopping.is_set() or not self._commands.empty()

    def _read(self, number: int) -> Frame:
        begun = time.perf_counter()
        if self._reader is None or number != self._next:
            self._reader = iter(self._recording.frames(number))
        frame = next(self._reader, None)
        if frame is None:
            raise RecordingError(f'{self._recording.path} ends before frame {number}')
        if not self._passed and not self._origin_ns:
            self._origin_ns = frame.stamp_ns
        self._next = number + 1
        self._frame = frame
        self._timing['read'] = 1000 * (time.perf_counter() - begun)
        return frame

    def _track(self, number: int, frame: Frame) -> None:
        begun = time.perf_counter()
        tracks = self._targets.update(frame)
        self._timing['track'] = 1000 * (time.perf_counter() - begun)
        self._insights = dict(self._targets.insights())
        self._passed[number] = Passed(frame.stamp_ns, tracks, self._targets.chosen)
        self._front = number
        self._entry(number)
        self._remember(frame, tracks)

    def _entry(self, number: int) -> None:
        """The figures of a frame for the time line."""
        passed = self._passed[number]
        passed.entry = {
            't': round((passed.stamp_ns - self._origin_ns) * 1e-9, 4),
            'frame': number,
            'targets': [
                figures(key, passed.tracks, self._insights.get(key)) for key in passed.tracks
            ],
            **{stage: round(self._timing.get(stage, 0.0), 2) for stage in STAGES},
        }

    def _history(self) -> list[dict[str, Any]]:
        """The figures of the last minute before the frame that is shown."""
        if self._shown not in self._passed:
            return []
        end = self._passed[self._shown].stamp_ns
        recent = [
            passed.entry
            for number, passed in sorted(self._passed.items())
            if number <= self._shown and passed.stamp_ns >= end - HISTORY_S * 1e9
        ]
        return [entry for entry in recent if entry]

    def _remember(self, frame: Frame, tracks: dict[int, Track]) -> None:
        """Keep a picture of each view that a target is known by from this frame on."""
        for number, insight in self._insights.items():
            track = tracks.get(number)
            box = None if track is None else track.box
            before = self._known.get(number, ())
            self._known[number] = known_by(insight.gallery, before, frame, box)

    def _box_of(self, key: int) -> Box:
        passed = self._passed.get(self._shown)
        track = None if passed is None else passed.tracks.get(key)
        if track is None or track.box is None:
            raise BoxError(f'{self._name(key)} is not in sight here: go to a frame where it is')
        return track.box

    def _name(self, key: int) -> str:
        return self._names.get(key, f'person {key}')

    def _follow_everyone(self, value: bool) -> None:
        """Follow people whom nobody chose too, or no more, from the frame that is shown."""
        self._targets.everyone = value
        self._everyone = value
        self._again(self._shown)

    # -- targets and parameters -------------------------------------------------------------------

    def _pick(self, number: int, box_in: Any) -> None:
        """Follow what is in a box of the frame that the browser showed."""
        if number != self._shown or self._frame is None:
            self._go_to(number)
        assert self._frame is not None
        self._add(box_in(self._frame))

    def _add(self, box: Box) -> None:
        assert self._frame is not None
        if self._shown < self._front:
            self._again(self._shown)
        key, track = self._targets.add(self._frame, box)
        self._names.setdefault(key, f'target {key}')
        self._forget_after(self._shown)
        passed = self._passed.setdefault(self._shown, Passed(self._frame.stamp_ns, {}))
        passed.tracks[key] = track
        passed.chosen = self._targets.chosen
        self._front = self._shown
        self._insights = dict(self._targets.insights())
        self._entry(self._shown)
        self._remember(self._frame, passed.tracks)
        self.board.rewind(self._history())

    def _remove(self, key: int) -> None:
        if key not in self._targets:
            return
        if self._shown < self._front:
            self._again(self._shown)
        self._targets.remove(key)
        self._forget_after(self._shown)
        if not self._everyone:
            self._insights.pop(key, None)
            self._known.pop(key, None)
        if self._shown in self._passed:
            passed = self._passed[self._shown]
            passed.chosen = self._targets.chosen
            if not self._everyone:
                passed.tracks.pop(key, None)
            self._entry(self._shown)
        self.board.rewind(self._history())

    def _forget_after(self, number: int) -> None:
        for later in [n for n in self._passed if n > number]:
            del self._passed[later]

    def _set(self, name: str, value: Any) -> None:
        info = next((i for i in describe(type(self._parameters)) if i.name == name), None)
        if info is None:
            raise ParameterError(f'{self._variant} has no parameter {name!r}')
        if info.file:  # whoever sees the page is not to read what lies on this machine
            raise ParameterError(f'{name}: name a file where the page is started: --param {name}=')
        self._reconfigure(self._variant, self._parameters.replace(**{name: checked(info, value)}))

    def _reconfigure(self, variant: str, parameters: Parameters) -> None:
        """Go on from the frame that is shown with another tracker, or others of its parameters."""
        self._variant, self._parameters = variant, parameters
        self._everyone = self._everyone and follows_everyone(variant)
        self._again(self._shown)

    def _again(self, number: int) -> None:
        """Trackers that stand at a frame: each starts where its target was last seen up to it.

        Where frames before that are gone through for everyone, it starts as long before: who is
        chosen at a moment at which he stands before another may be taken for both.
        """
        keys = self._passed[number].chosen if number in self._passed else ()
        starts: dict[int, int] = {}
        warm = max(0, number - WARM_UP) if self._everyone else number
        for key in keys:
            for earlier in range(number, -1, -1):
                passed = self._passed.get(earlier)
                if passed is None or key not in passed.tracks:
                    break
                if passed.tracks[key].box is not None:
                    starts[key] = earlier
                if key in starts and earlier <= warm:
                    break
        self._targets = PageTargets(self._variant, self._parameters, self._everyone, self._numbers)
        self._forget_after(number)
        self._known.clear()
        begin = min([warm, *starts.values()])
        tracks: dict[int, Track] = {}
        self._told = time.monotonic()
        for at in range(begin, number + 1) if starts or self._everyone else ():
            frame = self._read(at)
            tracks = self._targets.update(frame)
            for key, first in starts.items():
                box = self._passed[at].tracks[key].box if first == at else None
                if box is not None:
                    tracks[key] = self._targets.add(frame, box, key)[1]
            if at in self._passed:
                tracks = self._targets.resume(tracks, self._passed[at].tracks)
                self._passed[at].tracks.update(tracks)
            self._insights = dict(self._targets.insights())
            self._remember(frame, tracks)
            if self._told_of(at, number) and self._stopping.is_set():
                return
        self._busy, self._shown = '', number
        if number in self._passed:
            passed = self._passed[number]
            passed.tracks, passed.chosen = tracks, self._targets.chosen
        self._insights = dict(self._targets.insights())
        self._front = number
        if number in self._passed:
            self._entry(number)
        self.board.rewind(self._history())

    # -- showing ----------------------------------------------------------------------------------

    def _show(self) -> None:
        if self._frame is None or not self.board.watched:
            return
        begun = time.perf_counter()
        header, blobs = show(self._seen(), self._detail)
        self.board.show(header, blobs)
        self._put_up = time.monotonic()
        self._timing['show'] = 1000 * (time.perf_counter() - begun)

    def _seen(self) -> Seen:
        assert self._frame is not None
        passed = self._passed.get(self._shown)
        truth = self._recording.groundtruth
        known = truth is not None and self._shown < len(truth)
        current = self._insights if self._shown == self._front else {}
        return Seen(
            self._frame,
            passed.tracks if passed is not None else {},
            {key: self._name(key) for key in (passed.tracks if passed is not None else ())},
            passed.chosen if passed is not None else frozenset(),
            current,
            self._known,
            truth[self._shown] if truth is not None and known else None,
            {
                'everyone': self._everyone,
                'frame': self._shown,
                'stamp_ns': str(self._frame.stamp_ns),
                'time': round((self._frame.stamp_ns - self._origin_ns) * 1e-9, 3),
                'front': self._front,
                'playing': self._playing,
                'speed': self._speed,
                'busy': self._busy,
                'word': self._word,
                'variant': self._variant,
                'values': {
                    i.name: getattr(self._parameters, i.name)
                    for i in describe(type(self._parameters))
                },
            },
        )


_BOX = ('x', 'y', 'width', 'height')
