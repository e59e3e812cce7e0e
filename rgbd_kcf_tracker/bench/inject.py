# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Faults of files, disks and signals, tried on every command that reads or writes.

    python -m rgbd_kcf_tracker.bench.inject --count 1000 --seed 1

Every trial draws a recording of some kind, a command, and what befalls it: damage to a file of the
source, an output that cannot or must not be written, an odd option, a full disk, a signal. The
command runs in a process of its own, and whatever it does, it must end in time, say what is wrong
in one line and without a traceback, leave its source as it was to the byte, and leave no file that
is empty, half, or in place of one that it was not asked to replace.

A trial is repeated with ``--first N --count 1`` and the same seed. The exit code is 1 where a trial
failed.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import multiprocessing
import os
import re
import resource
import shutil
import signal
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.bench.file_faults import (
    OF_FOLDERS,
    OUTPUT_FAULTS,
    READING_OPTIONS,
    SOURCE_FAULTS,
    TRACK_OPTIONS,
    Trial,
    copied,
    materials,
    odd_option,
    readable,
)
from rgbd_kcf_tracker.errors import RgbdKcfError

LIMIT_S = 60.0
"""Seconds after which a command hangs; they take a tenth of a second, and two on a busy machine."""
MOST_MEMORY = 6 << 30
"""Bytes of address space: what is sized by damaged input runs into it."""
SIGNALS = (signal.SIGINT, signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
CODES = (0, 1, 2)
HARMLESS = ('hidden files beside', 'line ends of another system')
"""What must not keep a command from its work."""
_PRELOADED = [
    'rgbd_kcf_tracker.cli.main',
    'rgbd_kcf_tracker.evaluation.report',
    'rgbd_kcf_tracker.evaluation.runner',
    'rgbd_kcf_tracker.recordings.copying',
    'rgbd_kcf_tracker.variants',
]
_CAPSET_VERSION = 0x20080522
_RIGHTS_OF_ROOT = (1 << 1) | (1 << 2)  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a trial.

    Attributes:
        number: of the trial.
        command: that was run.
        fault: what befell it.
        code: its exit code, negative for a signal.
        seconds: that it took.
        problems: what must not be; empty where all is well.
        said: the end of what it printed on standard error.
        late: whether a signal was to come, and it had ended before.
    """

    number: int
    command: tuple[str, ...]
    fault: str
    code: int | None
    seconds: float
    problems: tuple[str, ...]
    said: str
    late: bool = False


class Injector:
    """Runs trials.

    Args:
        folder: to work in; each trial leaves nothing behind but where it failed.
        seed: of all that is drawn.
    """

    def __init__(self, folder: Path, seed: int) -> None:
        self._folder, self._seed = folder, seed
        place = folder / 'materials'
        place.mkdir()
        self._materials, self._box = materials(place)
        self._context = multiprocessing.get_context('forkserver')
        self._context.set_forkserver_preload(_PRELOADED)

    def trials(self, first: int, count: int) -> Iterator[Outcome]:
        """The outcomes of trials ``first`` to ``first + count - 1``."""
        for number in range(first, first + count):
            yield self.trial(number)

    def trial(self, number: int) -> Outcome:
        """Draw trial ``number``, run it, and look at what it left."""
        rng = np.random.default_rng([self._seed, number])
        place = self._folder / f'trial_{number}'
        (place / 'source').mkdir(parents=True)
        (place / 'out').mkdir()
        kinds = sorted(self._materials)
        kind = kinds[int(rng.integers(len(kinds)))]
        source = copied(self._materials[kind], place / 'source')
        trial = Trial(rng, source, place / 'out', self._box)
        command = _draw(trial, kind)
        before = _looked_at(place / 'source')
        old = {p: p.read_bytes() for p in trial.outputs.values() if p.is_file()}
        words = [*command, *trial.words]
        for option, path in trial.outputs.items():
            words += [option, str(path)] if option.startswith('--') else [str(path)]
        try:
            if trial.signal:
                trial.signal_after *= self._usual_time(words, trial, place)
            code, seconds, said, late = self._run(words, trial, place)
            after = _looked_at(place / 'source')  # with the rights with which it was looked at
        finally:
            _give_rights_back(place)
        problems = [
            *_of_the_end(trial, code, seconds, said),
            *_of_the_source(before, after),
            *_of_the_outputs(trial, code, old),
        ]
        if not problems:
            shutil.rmtree(place)
        return Outcome(
            number, tuple(words), trial.fault, code, seconds, tuple(problems), said[-2000:], late
        )

    def _usual_time(self, words: list[str], trial: Trial, place: Path) -> float:
        """Seconds that a command takes that is left alone, here and now; it leaves nothing."""
        _, seconds, _, _ = self._run(words, dataclasses.replace(trial, signal=0), place)
        shutil.rmtree(trial.out)
        trial.out.mkdir()
        (place / 'said').unlink(missing_ok=True)
        return seconds

    def _run(
        self, words: list[str], trial: Trial, place: Path
    ) -> tuple[int | None, float, str, bool]:
        """Its exit code, None where it hung; seconds; what it said; whether a signal was late."""
        log = place / 'said'
        process = self._context.Process(
            target=_command, args=(words, log, trial.file_limit, trial.without_rights)
        )
        process.start()
        while process.is_alive() and not log.exists():
            time.sleep(0.005)  # until it is the command
        begun = time.monotonic()
        late = False
        if trial.signal:
            process.join(trial.signal_after)
            late = not _sent(process.pid if process.is_alive() else None, trial.signal)
        process.join(LIMIT_S)
        hung = process.is_alive()
        if hung:
            process.kill()
            process.join()
        # Nobody outlives this one: whoever has a code of his own was ending when it came.
        late |= trial.signal == signal.SIGKILL and not hung and process.exitcode != -signal.SIGKILL
        said = log.read_bytes().decode('utf-8', 'replace') if log.exists() else ''
        return (None if hung else process.exitcode), time.monotonic() - begun, said, late


def _sent(pid: int | None, number: int) -> bool:
    """Signal a process; False where it is gone."""
    if pid is None:
        return False
    try:
        os.kill(pid, number)
    except ProcessLookupError:  # it ended in this moment
        return False
    return True


def _draw(trial: Trial, kind: str) -> list[str]:
    """Choose a command, and what befalls it."""
    rng, out = trial.rng, trial.out
    variant = ('kcf', 'metric')[int(rng.integers(2))]
    command = ('info', 'check', 'track', 'convert', 'evaluate')[
        int(rng.choice(5, p=(0.1, 0.15, 0.4, 0.25, 0.1)))
    ]
    if command == 'track':
        trial.outputs = {'--output': out / 'a.csv', '--bag': out / 'a.mcap'}
        if rng.random() < 0.2:
            trial.outputs['--video'] = out / 'a.mp4'
    elif command == 'convert':
        trial.outputs = {'DEST': out / 'b.mcap'}
    elif command == 'evaluate':
        trial.outputs = {'--report': out / 'report'}
    folder = trial.source.is_dir()
    faults = {name: f for name, f in SOURCE_FAULTS.items() if folder or name not in OF_FOLDERS}
    if command in ('track', 'convert'):
        faults |= OUTPUT_FAULTS
    options = READING_OPTIONS if command != 'evaluate' else {'--fps': 1, '--intrinsics': 4}
    options = options | (TRACK_OPTIONS if command == 'track' else {})
    faults |= dict.fromkeys(
        ('an odd option', 'another odd option'), lambda trial: odd_option(trial, options)
    )
    names = [*faults, 'a signal'] if trial.outputs else [*faults]
    trial.fault = names[int(rng.integers(len(names)))]
    if trial.fault == 'a signal':
        trial.signal = int(SIGNALS[int(rng.integers(len(SIGNALS)))])
        trial.signal_after = float(rng.uniform(0, 0.9))
    else:
        faults[trial.fault](trial)
    trial.fault = f'{kind}: {trial.fault}'
    source = str(trial.source)
    return {
        'info': ['info', source],
        'check': ['info', source, '--check'],
        'track': ['track', source, '--variant', variant, '--init', trial.box],
        'convert': ['convert', source],
        'evaluate': ['evaluate', source, '--variants', variant, '--jobs', '1'],
    }[command]


# -- in the process of the command -------------------------------------------------------------


def _command(words: list[str], log: Path, file_limit: int | None, without_rights: bool) -> None:
    """Be the program ``rgbd-kcf``."""
    with log.open('wb') as file:
        os.dup2(file.fileno(), 2)
    os.dup2(os.open(os.devnull, os.O_RDWR), 1)
    sys.stdout = os.fdopen(1, 'w', closefd=False)
    sys.stderr = os.fdopen(2, 'w', errors='backslashreplace', buffering=1, closefd=False)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    if file_limit is not None:
        _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
        # What it says is no part of the trial.
        resource.setrlimit(resource.RLIMIT_FSIZE, (max(file_limit, 4096), most))
    if without_rights:
        _drop_rights_of_root()
    from rgbd_kcf_tracker.cli.main import main

    code = main(words)
    sys.stderr.flush()
    os._exit(code)


def _drop_rights_of_root() -> None:
    """Have the rights of files hold for this process, also where root runs it."""
    if os.geteuid() != 0:
        return
    import ctypes

    libc = ctypes.CDLL(None, use_errno=True)
    header = (ctypes.c_uint32 * 2)(_CAPSET_VERSION, 0)
    sets = (ctypes.c_uint32 * 6)()
    if libc.capget(header, sets) == 0:
        for index in (0, 1, 2):  # effective, permitted, inheritable: the low words
            sets[index] &= ~_RIGHTS_OF_ROOT & 0xFFFFFFFF
        libc.capset(header, sets)


# -- what must not be --------------------------------------------------------------------------


def _of_the_end(trial: Trial, code: int | None, seconds: float, said: str) -> Iterator[str]:
    if code is None:
        yield f'hangs: killed after {seconds:.0f} s'
        return
    for word in ('Traceback', 'Exception ignored', 'Fatal Python error', 'Error in sys'):
        if word in said:
            yield f'prints {word!r}'
    allowed = {*CODES}
    if trial.signal:
        allowed |= {130} if trial.signal == signal.SIGINT else {-trial.signal}
    if code not in allowed:
        yield f'ends with {code}'
    errors = [line for line in said.splitlines() if re.match(r'rgbd-kcf( \w+)?: error: ', line)]
    if code == 2 and (len(errors) != 1 or len(errors[0]) < 30):
        yield f'ends with 2 and {len(errors)} errors'
    if code == 0 and errors:
        yield 'ends with 0 after an error'
    if code and trial.fault.endswith(HARMLESS):
        yield 'ends with an error though nothing is wrong'


def _of_the_source(before: dict[str, str], after: dict[str, str]) -> Iterator[str]:
    for name in sorted({*before, *after}):
        if before.get(name) != after.get(name):
            yield f'the source is changed: {name!r}'


def _of_the_outputs(trial: Trial, code: int | None, old: dict[Path, bytes]) -> Iterator[str]:
    for path, data in old.items():
        if code != 0 and (not path.is_file() or path.read_bytes() != data):
            yield f'{path.name} was there and is lost'
    if '--overwrite' not in trial.words and old and code == 0:
        yield 'replaces a file unasked'
    for path in trial.out.rglob('*'):
        if path.is_file() and not path.stat().st_size and path not in old:
            if trial.signal in (signal.SIGKILL, signal.SIGTERM):
                continue  # which leave no time to put it away
            yield f'{path.name} is left empty'
    if code == 0:
        for path in set(trial.outputs.values()):
            try:
                reason = readable(path)
            except RgbdKcfError as error:
                reason = str(error)
            if reason:
                yield reason


def _looked_at(place: Path) -> dict[str, str]:
    """Every name below a folder with a sum of what is there."""
    found = {}
    for path in sorted(place.rglob('*')):
        there = path.lstat()
        held = ''
        if stat.S_ISREG(there.st_mode):
            mode = stat.S_IMODE(there.st_mode)
            if mode & 0o400 == 0:  # of a trial, and read by nobody
                continue
            held = hashlib.sha256(path.read_bytes()).hexdigest()
        elif stat.S_ISLNK(there.st_mode):
            held = os.readlink(path)
        found[str(path.relative_to(place))] = f'{stat.S_IFMT(there.st_mode):o} {held}'
    return found


def _give_rights_back(place: Path) -> None:
    """So that all of a trial can be removed, also by who is not root."""
    for path in (place / 'out', *place.joinpath('source').iterdir()):
        if path.is_dir() and not path.is_symlink():
            path.chmod(0o700)


# -- the command -------------------------------------------------------------------------------


def main(argv: list[str] | None = None) -> int:
    """Run trials and print those that failed; status 1 where one did, 130 where interrupted."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.inject',
        description='Try faults of files, disks and signals on every command.',
    )
    parser.add_argument('--count', type=int, default=300, metavar='N', help='trials (default 300)')
    parser.add_argument('--first', type=int, default=0, metavar='N', help='number of the first')
    parser.add_argument('--seed', type=int, default=1, metavar='N', help='(default 1)')
    parser.add_argument(
        '--keep', type=Path, metavar='DIR', help='keep what failed there (default: thrown away)'
    )
    options = parser.parse_args(argv)
    if options.count < 1 or min(options.first, options.seed) < 0:
        parser.error('--count must be 1 or more, --first and --seed 0 or more')
    try:
        if options.keep is not None:
            options.keep.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix='inject_', dir=options.keep))
    except OSError as error:
        parser.error(f'{options.keep or tempfile.gettempdir()}: {error.strerror or error}')
    failed = late = 0
    interrupted = False
    slowest = 0.0
    codes: dict[int | None, int] = {}
    try:
        for outcome in Injector(folder, options.seed).trials(options.first, options.count):
            codes[outcome.code] = codes.get(outcome.code, 0) + 1
            slowest = max(slowest, outcome.seconds)
            late += outcome.late
            if not outcome.problems:
                continue
            failed += 1
            print(f'trial {outcome.number} ({outcome.fault}): {"; ".join(outcome.problems)}')
            print(f'  rgbd-kcf {" ".join(outcome.command)!r}')
            for line in outcome.said.splitlines()[-6:]:
                print(f'  | {line}')
            sys.stdout.flush()
    except KeyboardInterrupt:
        print('interrupted', file=sys.stderr)
        interrupted = True
    finally:
        if options.keep is None or not failed:
            with suppress(OSError):
                shutil.rmtree(folder)
    ends = ', '.join(f'{count} with {code}' for code, count in sorted(codes.items(), key=str))
    print(f'{sum(codes.values())} trials, {failed} failed; ended {ends}; slowest {slowest:.1f} s')
    if late:
        print(f'{late} signals came when the command had ended, and tried nothing')
    if interrupted:
        return 130
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main())
