# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the live page keeps of a tracker node's topics; knows no ROS, only what messages say."""

from __future__ import annotations

import dataclasses
import io
import queue
import time
from collections import OrderedDict, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rgbd_kcf_tracker.errors import BoxError, ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.live.settings import COMPRESSED, COMPRESSED_DEPTH, RAW
from rgbd_kcf_tracker.parameters import Parameters, parameter
from rgbd_kcf_tracker.recordings.results import HEADER, row
from rgbd_kcf_tracker.track import Track, TrackState
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS, default_parameters
from rgbd_kcf_tracker.view.board import Board
from rgbd_kcf_tracker.view.commands import Command
from rgbd_kcf_tracker.view.controller import describe_variants, yaml_of
from rgbd_kcf_tracker.view.showing import Detail, Seen, show

EVERYONE = 'follow_everyone'
"""The node's parameter that has it follow people whom nobody chose."""
STAGES = ('transport', 'waiting', 'decode', 'track', 'publish')
"""What an answer takes its time for, as the node's diagnostics tell, each a median."""
_ANSWERS = 64
_MOST_ROWS = 200_000
_MOST_COMMANDS = 64
_MOST_NAMES = 200


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


class LivePage:
    """Answers and images of a tracker node, put together by their stamps.

    Args:
        title: of the page.
        rate_hz: moments put up each second at most.
        detail: of what is sent.
    """

    def __init__(self, title: str, rate_hz: float, detail: Detail | None = None) -> None:
        self.board = Board()
        self.commands: queue.Queue[Command] = queue.Queue(_MOST_COMMANDS)
        self.values: dict[str, Any] = {}
        self._title, self._period = title, 1 / rate_hz
        self._detail = detail
        self._answers: OrderedDict[int, tuple[Track, ...]] = OrderedDict()
        self._rows: deque[tuple[int, int, Track]] = deque(maxlen=_MOST_ROWS)
        self._count = 0
        self._origin_ns: int | None = None
        self._covariance: tuple[int, tuple[float, ...]] | None = None
        self._frame: Frame | None = None
        self._figures: dict[str, str] = {}
        self._lately = 0
        self._word = ''
        self._said = 0.0
        self._shown_at = 0.0
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

    def covariance(self, stamp_ns: int, values: tuple[float, ...]) -> None:
        """Of the chosen target's position, ``(3, 3)`` row by row, from ``~/pose_with_covariance``.

        It comes a moment after the ``~/state`` of the same frame.
        """
        self._covariance = (stamp_ns, values)

    def rename(self, number: int, name: str) -> None:
        """Call a target by a name, in this page alone; the first two hundred are kept."""
        if name:
            self._names[number] = name
            while len(self._names) > _MOST_NAMES:
                self._names.popitem(last=False)

    def box_of(self, number: int) -> Box:
        """Where a target was in the last answer.

        Raises:
            BoxError: where it has no box.
        """
        tracks = next(reversed(self._answers.values()), ())
        box = next((track.box for track in tracks if track.id == number), None)
        if box is None:
            raise BoxError('not in sight now: try again when it is')
        return box

    def figures(self, values: Mapping[str, str]) -> None:
        """What ``/diagnostics`` says of the node."""
        before = _number(self._figures.get('dropped', values.get('dropped')))
        self._lately += max(0, int(_number(values.get('dropped')) - before))
        self._figures = dict(values)

    def answer(self, stamp_ns: int, tracks: Sequence[Track]) -> None:
        """``~/state``: the answer to a frame, the chosen target first."""
        tracks = tuple(track for track in tracks if track.state is not TrackState.IDLE)
        self._answers[stamp_ns] = tracks
        while len(self._answers) > _ANSWERS:
            self._answers.popitem(last=False)
        if self._origin_ns is None or stamp_ns < self._origin_ns:
            self._origin_ns = stamp_ns
            self.board.rewind([])
        self._count += 1
        self._rows.extend((self._count - 1, stamp_ns, track) for track in tracks)
        entry = {
            't': round((stamp_ns - self._origin_ns) * 1e-9, 3),
            'targets': [
                (t.id, t.state.value, t.score if t.box else None, 0, None, None, t.position)
                for t in tracks
            ],
            **{stage: _number(self._figures.get(f'{stage}_median_ms')) for stage in STAGES},
        }
        if self._lately:
            entry['dropped'], self._lately = self._lately, 0
        self.board.note(entry)

    def due(self) -> bool:
        """Whether somebody looks and the next moment may be put up."""
        return self.board.watched and time.monotonic() - self._shown_at >= self._period

    def image(self, frame: Frame, stamp_ns: int) -> None:
        """Put up an image with the answer to it, or the last one before."""
        self._shown_at = time.monotonic()
        self._frame = frame
        latest = next(reversed(self._answers.values()), ())
        answer = self._answers.get(stamp_ns, latest)
        tracks = {track.id: track for track in answer}
        if answer and self._covariance is not None and not answer[0].box:
            first = dataclasses.replace(answer[0], covariance=self._covariance[1])
            tracks[first.id] = first
        # Beside everyone the chosen one alone was asked for, as far as the wire tells.
        chosen = frozenset(list(tracks)[:1] if self.everyone else tracks)
        names = {
            key: self._names.get(key, f'{"target" if key in chosen else "person"} {key}')
            for key in tracks
        }
        origin = stamp_ns if self._origin_ns is None else self._origin_ns
        variant = self.variant
        prefix = f'{variant}.'
        status = {
            'time': round((stamp_ns - origin) * 1e-9, 3),
            'playing': True,
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
        if 'dropped' in self._figures:
            status['dropped'] = int(_number(self._figures['dropped']))
        header, blobs = show(Seen(frame, tracks, names, chosen, status=status), self._detail)
        self.board.show(header, blobs)

    def say(self, word: str) -> None:
        """Words for the page, with the next moment."""
        self._word, self._said = word, time.monotonic()


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
