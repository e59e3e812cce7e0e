# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""SIGINT, SIGTERM and SIGHUP as something to ask for; to be set up before other imports."""

from __future__ import annotations

import signal
import time

TYPE_CHECKING = False  # that of typing costs an import
if TYPE_CHECKING:
    from typing import Any, Protocol
else:
    Protocol = object

_NAP_S = 0.01


class Stopping(Protocol):
    """Says whether to stop: a :class:`Stop`, or a :class:`threading.Event`."""

    def is_set(self) -> bool:
        """Whether to stop."""
        ...

    def wait(self, timeout: float) -> bool:
        """Wait for it, so many seconds at most; says whether to stop."""
        ...


class Stop:
    """Notes the signals that ask a process to end, from now on and however often they come.

    SIGHUP comes when a terminal closes; under nohup it is ignored, and stays so.

    No :class:`threading.Event`: a signal that comes while its lock is held would wait for itself.
    """

    def __init__(self) -> None:
        self._asked = False
        self._signals = [signal.SIGINT, signal.SIGTERM]
        if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
            self._signals.append(signal.SIGHUP)
        for number in self._signals:
            signal.signal(number, self._note)

    def is_set(self) -> bool:
        """Whether one has come."""
        return self._asked

    def wait(self, timeout: float) -> bool:
        """Wait for one, so many seconds at most; says whether it has come."""
        end = time.monotonic() + timeout
        while not self._asked and (left := end - time.monotonic()) > 0:
            time.sleep(min(left, _NAP_S))
        return self._asked

    def ignore(self) -> None:
        """Hear them no more: nothing may interrupt the clean-up.

        ``ros2 launch`` sends SIGINT too, beside the terminal's.
        """
        for number in self._signals:
            signal.signal(number, signal.SIG_IGN)

    def _note(self, *_: Any) -> None:
        self._asked = True
