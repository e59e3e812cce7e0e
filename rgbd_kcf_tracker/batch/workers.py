# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where jobs run: any executor, and pools of processes that are replaced when they break."""

from __future__ import annotations

import os
import signal
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from types import TracebackType
from typing import TypeVar

from rgbd_kcf_tracker.errors import WorkersError

T = TypeVar('T')
R = TypeVar('R')


class Workers(ABC):
    """Where jobs run. To be used in a ``with`` block, which ends them.

    Attributes:
        LOST: what to say where none is left.
    """

    LOST = 'the workers were taken away: what is done is kept, and the same command goes on'

    @abstractmethod
    def slots(self) -> int:
        """How many jobs are to be handed out at a time, now."""

    @abstractmethod
    def submit(self, function: Callable[[T], R], item: T) -> Future[R]:
        """Hand out one job.

        Raises:
            BrokenExecutor: where nothing can be handed out until :meth:`renew`.
        """

    def renew(self) -> None:
        """Make workers in place of those that broke.

        Raises:
            WorkersError: where that cannot be.
        """
        raise WorkersError(self.LOST)

    def died(self, error: BaseException) -> bool:
        """Whether an error says that workers died of the job, or of one beside it."""
        return isinstance(error, BrokenExecutor)

    def describe(self) -> str:
        """In words, for the record."""
        return type(self).__name__

    def close(self, abort: bool) -> None:  # noqa: B027 (most have nothing to end)
        """End the workers; ``abort`` does not wait for what they do."""

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close(error is not None)


class InProcess(Workers):
    """The process itself, one job after the other."""

    def slots(self) -> int:
        """One."""
        return 1

    def submit(self, function: Callable[[T], R], item: T) -> Future[R]:
        """Run the job at once."""
        future: Future[R] = Future()
        try:
            future.set_result(function(item))
        except Exception as error:
            future.set_exception(error)
        return future

    def describe(self) -> str:
        """In words."""
        return 'one process'


class Given(Workers):
    """An executor that somebody else made and ends.

    Args:
        executor: any; one that cannot share memory must be able to import the package.
        slots: jobs at a time; as many as the executor has workers where it says so, else cores.
    """

    LOST = 'the executor broke: what is done is kept; run again with a new one'

    def __init__(self, executor: Executor, slots: int | None = None) -> None:
        self._executor = executor
        known = getattr(executor, '_max_workers', None)
        self._slots = slots or (known if isinstance(known, int) else None) or cores()

    def slots(self) -> int:
        """As many as given."""
        return self._slots

    def submit(self, function: Callable[[T], R], item: T) -> Future[R]:
        """Hand out one job."""
        return self._executor.submit(function, item)

    def describe(self) -> str:
        """In words."""
        return type(self._executor).__name__


class LocalPool(Workers):
    """Processes of this machine, started when the first job comes.

    Args:
        count: of processes.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._pool: ProcessPoolExecutor | None = None

    def slots(self) -> int:
        """One job a process, so that none waits in a process that dies."""
        return self._count

    def submit(self, function: Callable[[T], R], item: T) -> Future[R]:
        """Hand out one job."""
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self._count, mp_context=get_context('spawn'), initializer=_end_with_parent
            )
        with _interrupts_for_us():
            return self._pool.submit(function, item)

    def renew(self) -> None:
        """Leave the broken pool behind; the next job starts another."""
        self.close(abort=True)

    def describe(self) -> str:
        """In words."""
        return f'{self._count} process{"" if self._count == 1 else "es"}'

    def close(self, abort: bool) -> None:
        """End the processes."""
        pool, self._pool = self._pool, None
        if pool is None:
            return
        if abort:
            for process in list((pool._processes or {}).values()):
                process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)


def local(count: int) -> Workers:
    """``count`` jobs at a time on this machine."""
    return InProcess() if count == 1 else LocalPool(count)


def as_workers(workers: Workers | Executor | None) -> Workers:
    """What callers may hand in: nothing for this process, an executor, or workers."""
    if workers is None:
        return InProcess()
    return workers if isinstance(workers, Workers) else Given(workers)


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on this system
        return os.cpu_count() or 1


def _end_with_parent() -> None:
    """End this process when the one that started it is gone, be it killed.

    A worker waits for its next job on a pipe that the workers beside it hold open, too: it would
    wait for ever, and so would whoever reads the output that it has inherited. What it was writing
    is as after a crash: whole under its name, or a part that the next run clears away.
    """
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, name='parent', daemon=True).start()


@contextmanager
def _interrupts_for_us() -> Iterator[None]:
    """Processes started inside are never reached by Ctrl-C, which is the parent's to handle."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
