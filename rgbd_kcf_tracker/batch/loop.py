# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The loop that hands out jobs: few at a time, again where a worker is lost or a job fails."""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from dataclasses import dataclass
from typing import Generic, TypeVar

from rgbd_kcf_tracker.batch.threads import one_thread
from rgbd_kcf_tracker.batch.workers import Workers
from rgbd_kcf_tracker.errors import WorkersError

T = TypeVar('T')
R = TypeVar('R')

TRIES = 2
"""How often a job is tried that fails: a disk or a network may have hiccups."""

LOOK_AGAIN_S = 5.0
"""How often the number of workers is asked for, which may grow and shrink."""


class LostError(Exception):
    """The worker died each time."""

    def __init__(self) -> None:
        super().__init__('the worker died each time that it ran this: out of memory, or a crash')


@dataclass(frozen=True, slots=True)
class Done(Generic[T, R]):
    """A job that came back, or is given up.

    Attributes:
        item: what was asked for.
        result: of the last try; None where that raised.
        error: what the last try raised; None where it did not.
        rest: the part of it that is tried again, and comes as another one; None where it is none.
    """

    item: T
    result: R | None
    error: Exception | None = None
    rest: T | None = None


@dataclass(slots=True)
class _Ticket(Generic[T]):
    item: T
    tries: int = 0
    suspect: bool = False
    """It ran when a worker died, perhaps not by its own fault: it runs again with nothing beside
    it, so that it is known."""


def run_all(
    function: Callable[[T], R],
    items: Iterable[T],
    workers: Workers,
    again: Callable[[T, R], T | None] = lambda item, result: None,
    tries: int = TRIES,
    stopped: Callable[[], bool] = lambda: False,
) -> Iterator[Done[T, R]]:
    """Run ``function`` on every item, and give each as it is done, in any order.

    Args:
        function: of a module, or a ``functools.partial`` of one; must be able to be sent.
        items: what it is called with; few are taken ahead.
        workers: where it runs.
        again: what of a job has failed though it returned, as a job to be tried again; else None.
        tries: of a job that fails.
        stopped: is asked before each job whether to begin no more; those under way are finished.

    Raises:
        WorkersError: where no worker is left to do the rest; what was given stays good.
    """
    waiting = map(_Ticket[T], items)
    repeats: deque[_Ticket[T]] = deque()
    suspects: deque[_Ticket[T]] = deque()
    running: dict[Future[R], _Ticket[T]] = {}
    call = functools.partial(_in_one_thread, function)

    def following() -> _Ticket[T] | None:
        if stopped():
            return None
        ticket = next(waiting, None)
        if ticket is None and repeats:  # at the end: what went wrong may be over by then
            return repeats.popleft()
        return suspects.popleft() if ticket is None and suspects and not running else ticket

    try:
        while True:
            while len(running) < workers.slots():
                ticket = following()
                if ticket is None:
                    break
                ticket.tries += 1
                try:
                    running[workers.submit(call, ticket.item)] = ticket
                except BrokenExecutor:  # those that ran say so themselves
                    ticket.tries -= 1
                    repeats.appendleft(ticket)
                    if not running:
                        workers.renew()
                    break
                if ticket.suspect:
                    break
            if not running:
                if stopped() or not (repeats or suspects):
                    return
                continue
            finished, _ = wait(running, LOOK_AGAIN_S, FIRST_COMPLETED)
            broken = any(isinstance(_raised(f), BrokenExecutor) for f in finished)
            if broken:
                finished, _ = wait(running)  # all that ran are lost with it
            for future in finished:
                ticket = running.pop(future)
                error = _raised(future)
                if isinstance(error, CancelledError):
                    raise WorkersError(workers.LOST) from None
                if error is not None and workers.died(error):
                    if ticket.suspect:
                        yield Done(ticket.item, None, LostError())
                    else:
                        ticket.suspect = True
                        suspects.append(ticket)
                elif error is not None and not isinstance(error, Exception):
                    raise error
                else:
                    yield from _settled(future, error, ticket, again, tries, repeats)
            if broken:
                workers.renew()
    finally:
        for future in running:
            future.cancel()


def _settled(
    future: Future[R],
    error: Exception | None,
    ticket: _Ticket[T],
    again: Callable[[T, R], T | None],
    tries: int,
    repeats: deque[_Ticket[T]],
) -> Iterator[Done[T, R]]:
    """What a job that came back gives: itself, or nothing yet where it is tried again."""
    if error is not None:
        if ticket.tries < tries:
            repeats.append(ticket)
        else:
            yield Done(ticket.item, None, error)
        return
    result = future.result()
    rest = again(ticket.item, result) if ticket.tries < tries else None
    if rest is not None:
        repeats.append(_Ticket(rest, ticket.tries))
    yield Done(ticket.item, result, rest=rest)


def _raised(future: Future[R]) -> BaseException | None:
    try:
        return future.exception()
    except CancelledError as error:
        return error


def _in_one_thread(function: Callable[[T], R], item: T) -> R:
    with one_thread():
        return function(item)
