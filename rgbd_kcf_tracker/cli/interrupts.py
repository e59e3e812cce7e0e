# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Ctrl-C: at once while nothing is written, between two steps while something is.

An exception that comes up anywhere can come up in a record that is half written, or in a callback
of a library that swallows it. So while work is under way the first Ctrl-C is only noted, and the
work asks for it between its steps; the second one does not wait. What comes up while a module is
imported can become an ``ImportError``, and what comes up in a callback of a weak reference is lost:
such a one comes again a moment later.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

EXIT_INTERRUPTED = 130
_LATER_S, _LATER_TIMES = 0.002, 1000


class Interrupts:
    """What came of Ctrl-C in this process."""

    def __init__(self) -> None:
        self.asked = False
        """Whether it was pressed."""
        self._held = False
        self._notice = ''
        self._later = 0
        self._coming: threading.Timer | None = None

    @contextmanager
    def handled(self) -> Iterator[None]:
        """Take care of the signal inside; where it is ignored or another's, leave it so."""
        before = signal.getsignal(signal.SIGINT)
        ours = (
            threading.current_thread() is threading.main_thread()
            and before is signal.default_int_handler
        )
        self.asked = False
        self._later = _LATER_TIMES
        tell = sys.unraisablehook

        def lost(told: sys.UnraisableHookArgs) -> None:
            if issubclass(told.exc_type, KeyboardInterrupt):
                self._come_again()
            else:
                tell(told)

        if ours:
            signal.signal(signal.SIGINT, self._handle)
            sys.unraisablehook = lost
        try:
            yield
        finally:
            self._later, self._coming = 0, None
            if ours:
                signal.signal(signal.SIGINT, before)
                sys.unraisablehook = tell

    @contextmanager
    def held(self, notice: str = '') -> Iterator[None]:
        """Note the first Ctrl-C inside, for :meth:`check`, and print ``notice`` for it."""
        before = self._held, self._notice
        self._held, self._notice = True, notice
        try:
            yield
        finally:
            self._held, self._notice = before

    def check(self) -> None:
        """Stop here where Ctrl-C was pressed.

        Raises:
            KeyboardInterrupt: where it was.
        """
        if self.asked:
            raise KeyboardInterrupt

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if (self.asked or not self._held) and self._later and _is_lost(frame):
            self._come_again()
            return
        again, self.asked = self.asked, True
        if again or not self._held:
            raise KeyboardInterrupt
        if self._notice:
            print(self._notice, file=sys.stderr, flush=True)

    def _come_again(self) -> None:
        if self._coming is not None or self._later <= 0:
            return  # one is on its way
        self._later -= 1
        main = threading.main_thread().ident

        def again() -> None:
            if self._coming is timer and main is not None:  # else all has ended meanwhile
                self._coming = None
                signal.pthread_kill(main, signal.SIGINT)  # also out of what it waits for

        timer = self._coming = threading.Timer(_LATER_S, again)
        timer.start()


def _is_lost(frame: FrameType | None) -> bool:
    """Whether what comes up there is lost: in an import, or where a lost one is told."""
    while frame is not None:
        code = frame.f_code
        if code.co_filename.startswith('<frozen importlib') or code is _COMES_AGAIN:
            return True
        frame = frame.f_back
    return False


_COMES_AGAIN = Interrupts._come_again.__code__

interrupts = Interrupts()
"""The one of this process: it has one signal."""
