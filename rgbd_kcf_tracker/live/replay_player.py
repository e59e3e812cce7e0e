# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The way of a recorded message from the source to the wire: order, time, lock-step."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from rgbd_kcf_tracker.live.prefetch import prefetched
from rgbd_kcf_tracker.live.replay_lockstep import Answers
from rgbd_kcf_tracker.live.replay_message import Message, Role
from rgbd_kcf_tracker.live.replay_pacing import Pacer
from rgbd_kcf_tracker.live.stopping import Stopping

ATTEMPTS = 3
"""How often images are sent in lock-step before their answer is given up."""
FIRST_PERIOD_S = 0.2
"""After which images are sent again until the first answer: discovery takes some tenths of a
second."""
RECENT = 8
"""Images that are kept for sending again."""
FRAME_NS = 33_333_333
"""Between two rounds of a single image."""
GAP_S = 10.0
"""Seconds without a message of which a person is told: one that waits for years seems to hang."""
LONGEST_NS = 1_000_000_000
"""Between two rounds, at most: the last images may be far from each other."""


@dataclass(slots=True)
class Progress:
    """What a player has done so far."""

    messages: int = 0
    colors: int = 0
    depths: int = 0
    repeated: int = 0
    rounds: int = 0
    started: float = field(default_factory=time.monotonic)


class Player:
    """Sends the messages of a recording at their time, and in lock-step waits for the answers.

    Args:
        send: puts a message on the wire.
        pacer: says when each message is due.
        answers: what the tracker must answer.
        lockstep: hold the next message back until nothing is left to answer.
        answer_timeout_s: see :class:`ReplayParameters`.
        info: the camera's CameraInfo, which in lock-step goes ahead of the images.
        tick: told the recorded time while waiting and before each message.
        warn: told what a person should know.
    """

    def __init__(
        self,
        send: Callable[[Message], None],
        pacer: Pacer,
        answers: Answers,
        *,
        lockstep: bool = False,
        answer_timeout_s: float = 5.0,
        info: Message | None = None,
        tick: Callable[[int], None] = lambda time_ns: None,
        warn: Callable[[str], None] = lambda text: None,
    ) -> None:
        self._send = send
        self._pacer = pacer
        self._answers = answers
        self._lockstep = lockstep
        self._timeout_s = answer_timeout_s
        self._info = info
        self._tick = tick
        self._warn = warn
        self._recent: deque[Message] = deque(maxlen=RECENT)
        self._last_stamp_ns: int | None = None
        self._period_ns = FRAME_NS
        self._same_told = False
        self.progress = Progress()

    def play(self, messages: Iterable[Message], stop: Stopping) -> bool:
        """Send all messages once; False when ``stop`` was set before the end.

        Another round begins one period of the colour images after the last.
        """
        self._pacer.reset(self._period_ns if self.progress.rounds else 0)
        with prefetched(messages) as ahead:
            for message in ahead:
                if (left := self._pacer.left(message.time_ns)) > GAP_S:
                    self._warn(
                        f'the next message, of {message.topic}, is due in {left:.0f} s: the '
                        'recording has a gap there. Begin behind it (start:=SECONDS), or do not '
                        'wait (rate:=0.0)'
                    )
                if not self._pacer.wait(message.time_ns, stop, self._tick):
                    return False
                self._tick(message.time_ns)
                self._announce(message)
                self._send(message)
                self.progress.messages += 1
                if self._lockstep and not self._await_answers(message, stop):
                    return False
        self._answers.sent_all()
        if self._lockstep and not self._await_answers(None, stop):
            return False
        self.progress.rounds += 1
        return not stop.is_set()

    def _announce(self, message: Message) -> None:
        if message.role is Role.COLOR:
            self.progress.colors += 1
            if self._last_stamp_ns is not None and message.stamp_ns > self._last_stamp_ns:
                self._period_ns = min(message.stamp_ns - self._last_stamp_ns, LONGEST_NS)
            if self._lockstep and message.stamp_ns == self._last_stamp_ns and not self._same_told:
                self._same_told = True
                self._warn(
                    f'images have one stamp, {message.stamp_ns * 1e-9:.3f} s: lock-step cannot '
                    'tell their answers apart, and some may be passed over (lockstep:=false)'
                )
            self._last_stamp_ns = message.stamp_ns
            self._answers.sent_color(message.stamp_ns)
        elif message.role is Role.DEPTH:
            self.progress.depths += 1
            self._answers.sent_depth(message.stamp_ns)

    def _await_answers(self, message: Message | None, stop: Stopping) -> bool:
        """Wait for what is due; images may be lost on the way and are sent again then."""
        if message is not None and message.role in (Role.COLOR, Role.DEPTH):
            self._recent.append(message)
        for attempt in range(ATTEMPTS):
            if self._wait(stop):
                return True
            if stop.is_set():
                return False
            if attempt < ATTEMPTS - 1:
                self._repeat()
        stamps = self._answers.give_up()
        if not stamps:  # the last answer came just now
            return True
        self._warn(
            f'no answer to {len(stamps)} colour image(s), the first of stamp '
            f'{stamps[0] * 1e-9:.3f} s: going on without'
        )
        return True

    def _wait(self, stop: Stopping) -> bool:
        """Wait for what is due, and until the first answer send what was sent again and again.

        Of two sides that discover each other one is first. A tracker that does not yet know each
        topic's publisher would start on a picture without its depth or intrinsics.
        """
        left = self._timeout_s
        while not self._answers.heard and left > 0:
            if self._answers.wait(min(FIRST_PERIOD_S, left), stop):
                return True
            if stop.is_set():
                return False
            left -= FIRST_PERIOD_S
            for message in (self._info, *self._recent):
                if message is not None:
                    self._send(message)
        return self._answers.wait(max(left, 0.0), stop)

    def _repeat(self) -> None:
        """Send the last images again; a tracker drops those that it knows by their stamps."""
        self._warn(
            f'no answer for {self._timeout_s:g} s: sending the last {len(self._recent)} image(s) '
            'again. Does the tracker hear these topics, and does answer_topic name its ~/box?'
        )
        for image in self._recent:
            self._send(image)
            self.progress.repeated += 1
