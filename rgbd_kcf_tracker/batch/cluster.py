# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Workers of a Dask cluster that somebody started, checked before any of them gets a job.

Start one with ``dask scheduler`` and, on every machine, ``dask worker tcp://HOST:8786 --nthreads 1
--nworkers auto``; or with ``dask-jobqueue``, ``dask-kubernetes`` and the like. Needs the extra
``cluster``.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from rgbd_kcf_tracker.batch.environment import Environment, environment
from rgbd_kcf_tracker.batch.workers import Workers
from rgbd_kcf_tracker.errors import RecordingError, WorkersError
from rgbd_kcf_tracker.extras import require
from rgbd_kcf_tracker.recordings.files import read_text

T = TypeVar('T')
R = TypeVar('R')

AHEAD = 2
"""Jobs handed out for each thread, so that none waits for the next."""

NO_WORKER_S = 300.0
"""How long jobs wait for a worker where none is left. A worker that died comes back in seconds,
unless what started it has given it up: then none ever comes."""

_COUNT_AGAIN_S = 5.0
_MOST_NAMED = 5
_START = 'dask worker {} --nthreads 1 --nworkers auto'


@dataclass(frozen=True, slots=True)
class Probe:
    """What a worker says of itself.

    Attributes:
        environment: its code and libraries.
        missing: paths that it does not have.
        locked: folders that it cannot write.
    """

    environment: Environment
    missing: tuple[str, ...]
    locked: tuple[str, ...]


def probe(needs: Sequence[str], writes: Sequence[str]) -> Probe:
    """What this process can say of itself; runs on the workers."""
    return Probe(
        environment(),
        tuple(p for p in needs if not os.path.exists(p)),
        tuple(p for p in writes if not (os.path.isdir(p) and os.access(p, os.W_OK | os.X_OK))),
    )


class Cluster(Workers):
    """A Dask cluster.

    Args:
        where: address of the scheduler (``tcp://HOST:PORT``, ``HOST:PORT``), or path of the file
            that ``dask scheduler --scheduler-file`` writes.
        needs: paths that every worker must have.
        writes: folders that every worker must be able to write.
        timeout_s: how long to wait for the scheduler, and for the first worker.

    Raises:
        WorkersError: where no scheduler answers, it has no workers, or one of them lacks the data,
            has other code or libraries, or runs several threads.
    """

    LOST = (
        'the connection to the scheduler is lost: what is done is kept, and the same command goes '
        'on once there is a scheduler'
    )

    def __init__(
        self,
        where: str,
        needs: Sequence[Path] = (),
        writes: Sequence[Path] = (),
        timeout_s: float = 20.0,
    ) -> None:
        require('cluster', 'a Dask cluster')
        import distributed
        from distributed.comm import get_address_host_port

        self._killed = distributed.KilledWorker
        self._where = where
        address = _address(where)
        logging.getLogger('distributed').setLevel(logging.ERROR)  # we say it ourselves, and once
        try:
            get_address_host_port(address, strict=True)  # a client would stumble on being ended
            self._client = distributed.Client(address, timeout=timeout_s, set_as_default=False)
        except (OSError, ValueError) as error:
            raise WorkersError(
                f'no Dask scheduler answers at {where} ({_first_line(error)}): start one with '
                "'dask scheduler', and give the address that it prints"
            ) from None
        try:
            self._check(needs, writes, timeout_s)
        except BaseException:
            self._client.close()
            raise
        self._counted = 0.0
        self._manned = time.monotonic()
        self._slots = 1

    def slots(self) -> int:
        """Some for each thread there is now; workers may come and go.

        Raises:
            WorkersError: where there has been none for :data:`NO_WORKER_S`.
        """
        now = time.monotonic()
        if now - self._counted > _COUNT_AGAIN_S:
            threads = sum(self._threads().values())
            if threads:
                self._manned = now
            elif now - self._manned > NO_WORKER_S:
                raise WorkersError(
                    f'the scheduler at {self._where} has had no workers for {NO_WORKER_S:g} s: '
                    'what is done is kept, and the same command goes on once some are started with '
                    f"'{_START.format(self._where)}'"
                )
            self._slots = max(1, AHEAD * threads)
            self._counted = now
        return self._slots

    def submit(self, function: Callable[[T], R], item: T) -> Future[R]:
        """Hand out one job."""
        ours: Future[R] = Future()
        try:
            theirs = self._client.submit(function, item, pure=False)
            self._client.loop.add_callback(_settle, theirs, ours)
        except (OSError, RuntimeError) as error:
            raise WorkersError(f'{self.LOST} ({_first_line(error)})') from None
        return ours

    def died(self, error: BaseException) -> bool:
        """Whether the scheduler saw several workers die that had the job."""
        return isinstance(error, self._killed)

    def describe(self) -> str:
        """In words."""
        return f'Dask cluster at {self._where}'

    def close(self, abort: bool) -> None:
        """Part from the cluster; what it still does for us is called off."""
        self._client.close()

    def _threads(self) -> Mapping[str, int]:
        """Threads of each worker, by address."""
        try:
            threads: Mapping[str, int] = self._client.nthreads()
        except (OSError, RuntimeError, ValueError) as error:
            raise WorkersError(f'{self.LOST} ({_first_line(error)})') from None
        return threads

    def _check(self, needs: Sequence[Path], writes: Sequence[Path], timeout_s: float) -> None:
        try:
            self._client.wait_for_workers(1, timeout=timeout_s)
        except (OSError, TimeoutError):
            raise WorkersError(
                f'the scheduler at {self._where} has no workers: start some with '
                f"'{_START.format(self._where)}'"
            ) from None
        several = {a: f'{n} threads' for a, n in self._threads().items() if n != 1}
        _refuse(
            several,
            'run several threads, which would wait for each other: start them with '
            f"'{_START.format(self._where)}'",
        )
        answers: Mapping[str, Any] = self._client.run(
            probe, [str(p) for p in needs], [str(p) for p in writes], on_error='return'
        )
        unable = {a: _first_line(p) for a, p in answers.items() if isinstance(p, BaseException)}
        _refuse(
            unable,
            f'cannot import this rgbd_kcf_tracker ({environment().version}): install the same on '
            'every machine',
        )
        own = environment()
        other = {a: '; '.join(own.differences(p.environment)) for a, p in answers.items()}
        _refuse(
            {a: text for a, text in other.items() if text},
            'would give other results: install the same versions on every machine',
        )
        _refuse(
            {a: ', '.join(p.missing) for a, p in answers.items() if p.missing},
            'do not have the data: give a path that leads to it on every machine',
        )
        _refuse(
            {a: ', '.join(p.locked) for a, p in answers.items() if p.locked},
            'cannot write the output folder: give one that all machines share',
        )


async def _settle(theirs: Any, ours: Future[Any]) -> None:
    """Put what becomes of a future of Dask's into one of ours, whatever that is.

    Dask's own executor waits for ever for a result that was there, was lost with its worker before
    it was fetched, and then came to nothing; and for one that cannot be read here.
    """
    try:
        result = await theirs.client.gather(theirs, asynchronous=True)
    except BaseException as error:
        if theirs.cancelled() or isinstance(error, asyncio.CancelledError):
            ours.cancel()
        if ours.set_running_or_notify_cancel():
            ours.set_exception(error)
    else:
        if ours.set_running_or_notify_cancel():
            ours.set_result(result)


def _refuse(workers: Mapping[str, str], why: str) -> None:
    """One error for all workers that something is wrong with."""
    if not workers:
        return
    named = [f'{address} ({text})' for address, text in sorted(workers.items())[:_MOST_NAMED]]
    more = f' and {len(workers) - len(named)} more' if len(workers) > len(named) else ''
    raise WorkersError(f'{", ".join(named)}{more}: these workers {why}')


def _address(where: str) -> str:
    """The scheduler's address, out of its file where a file is given."""
    path = Path(where)
    if '://' in where or (not path.exists() and ':' in where and os.sep not in where):
        return where
    try:
        return str(json.loads(read_text(path))['address'])
    except RecordingError as error:
        raise WorkersError(
            f'{error}: give tcp://HOST:PORT, or the file that '
            "'dask scheduler --scheduler-file' wrote"
        ) from None
    except (RecursionError, ValueError, KeyError, TypeError):
        raise WorkersError(
            f"{where} is no scheduler file: give the one that 'dask scheduler --scheduler-file' "
            'wrote'
        ) from None


def _first_line(error: BaseException) -> str:
    text = str(error).strip() or type(error).__name__
    return text.splitlines()[0]
