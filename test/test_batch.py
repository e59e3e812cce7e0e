# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Jobs on any executor: the loop, parts, digests of content, and what a key is made of."""

from __future__ import annotations

import ast
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path

import cv2
import pytest
from threadpoolctl import threadpool_info

import rgbd_kcf_tracker
from rgbd_kcf_tracker.batch import transport
from rgbd_kcf_tracker.batch.content import files_digest
from rgbd_kcf_tracker.batch.environment import Environment, code_files, environment
from rgbd_kcf_tracker.batch.loop import run_all
from rgbd_kcf_tracker.batch.shards import Shard
from rgbd_kcf_tracker.batch.transport import Packed, packed, unpack
from rgbd_kcf_tracker.batch.workers import Given, InProcess, LocalPool, Workers
from rgbd_kcf_tracker.errors import ParameterError, WorkersError

PACKAGE = Path(rgbd_kcf_tracker.__file__).parent


def double(number: int) -> int:
    return 2 * number


def odd_fails(number: int) -> int:
    if number % 2:
        raise ValueError(f'{number} is odd')
    return number


def dies(folder: Path, number: int) -> int:
    """Number 3 always kills its process, number 5 the first time, before number 3 does."""
    marker = folder / f'{number}'
    while number == 3 and not (folder / '5').exists():
        time.sleep(0.01)
    if number == 3 or (number == 5 and not marker.exists()):
        marker.touch()
        os._exit(9)
    time.sleep(0.02)
    return number


def second_time(folder: Path, number: int) -> int:
    marker = folder / f'{number}'
    if not marker.exists():
        marker.touch()
        raise OSError('not yet')
    return number


def threads(number: int) -> tuple[int, int]:
    time.sleep(0.02 * number)  # jobs that began together end one after the other
    blas = [library['num_threads'] for library in threadpool_info()]
    return cv2.getNumThreads(), max(blas, default=1)


@pytest.fixture(params=['process', 'threads', 'pool'])
def workers(request: pytest.FixtureRequest) -> Iterator[Workers]:
    if request.param == 'process':
        yield InProcess()
    elif request.param == 'threads':
        with ThreadPoolExecutor(3) as executor:
            yield Given(executor)
    else:
        with LocalPool(2) as pool:
            yield pool


# --- the loop


def test_every_item_is_done_once_on_every_kind_of_workers(workers: Workers):
    done = list(run_all(double, range(20), workers))
    assert sorted(d.item for d in done) == list(range(20))
    assert all(d.result == 2 * d.item and d.error is None for d in done)


def test_what_fails_is_tried_again_and_then_given_with_its_error(tmp_path: Path):
    done = {d.item: d for d in run_all(odd_fails, range(4), InProcess())}
    assert [d.result for d in done.values() if d.error is None] == [0, 2]
    assert str(done[3].error) == '3 is odd'
    again = list(run_all(partial(second_time, tmp_path), range(3), InProcess()))
    assert sorted(d.result for d in again) == [0, 1, 2]


def test_the_part_of_a_job_that_failed_is_tried_again():
    def again(item: tuple[int, ...], result: list[int]) -> tuple[int, ...] | None:
        return tuple(i for i in item if i % 2) or None

    first, second = run_all(list, [(1, 2, 3)], InProcess(), again)
    assert (first.result, first.rest) == ([1, 2, 3], (1, 3))
    assert (second.item, second.result, second.rest) == ((1, 3), [1, 3], None)


def test_no_more_is_begun_once_it_is_to_stop(workers: Workers):
    done = []
    for one in run_all(double, range(50), workers, stopped=lambda: bool(done)):
        done.append(one.item)
    assert 1 <= len(done) <= workers.slots()


def test_few_items_are_taken_ahead():
    taken = []

    def items() -> Iterator[int]:
        for number in range(100):
            taken.append(number)
            yield number

    with ThreadPoolExecutor(2) as executor:
        jobs = run_all(double, items(), Given(executor))
        next(jobs)
        assert len(taken) <= 5
        jobs.close()


def test_a_job_that_kills_its_process_fails_alone_and_only_after_another_try(tmp_path: Path):
    with LocalPool(2) as pool:
        done = {d.item: d for d in run_all(partial(dies, tmp_path), (5, *range(5), 6, 7), pool)}
    assert sorted(done) == list(range(8))
    assert 'worker died each time' in str(done[3].error)
    assert [n for n, d in done.items() if d.error is not None] == [3]
    assert done[5].result == 5


BUSY_AND_IDLE = """
import time
from rgbd_kcf_tracker.batch.workers import LocalPool
pool = LocalPool(2)
pool.submit(time.sleep, 600)
pool.submit(abs, 1).result()
print('both are there', flush=True)
time.sleep(600)
"""


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_the_process_that_started_them(number: int):
    with subprocess.Popen(
        [sys.executable, '-c', BUSY_AND_IDLE], stdout=subprocess.PIPE, start_new_session=True,
        env=os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)},
    ) as process:  # fmt: skip
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == b'both are there\n'
            process.send_signal(number)
            process.communicate(timeout=20)  # they hold the same pipe
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == -number


def test_an_executor_that_breaks_and_cannot_be_replaced_ends_the_run_with_one_error():
    class Breaking(Executor):
        def __init__(self) -> None:
            self.count = 0

        def submit(self, function, *args) -> Future:
            future: Future = Future()
            self.count += 1
            if self.count > 2:
                future.set_exception(BrokenExecutor('gone'))
            else:
                future.set_result(function(*args))
            return future

    jobs = run_all(double, range(9), Given(Breaking(), 3))
    assert sorted([next(jobs).result, next(jobs).result]) == [0, 2], 'what came back counts'
    with pytest.raises(WorkersError, match='what is done is kept'):
        next(jobs)


def test_jobs_have_one_thread_each(workers: Workers):
    before = cv2.getNumThreads()
    assert {d.result for d in run_all(threads, range(3), workers)} == {(1, 1)}
    assert cv2.getNumThreads() == before


# --- parts


def test_parts_hold_everything_once():
    items = list(range(23))
    parts = [Shard(i, 4).of(items) for i in range(1, 5)]
    assert sorted(item for part in parts for item in part) == items
    assert {len(p) for p in parts} <= {5, 6}
    assert Shard.parse('3/16') == Shard(3, 16)


@pytest.mark.parametrize('text', ['0/4', '5/4', '4', 'a/b', '1/0', '-1/3', '1/2/3', ''])
def test_a_part_that_cannot_be_is_refused(text: str):
    with pytest.raises(ParameterError, match='--shard'):
        Shard.parse(text)


# --- what jobs leave


def make(folder: Path) -> str:
    (folder / 'results').mkdir()
    (folder / 'results' / 'a.json').write_text('key')
    (folder / 'results' / 'a.txt').write_text('data')
    (folder / 'z.txt').write_text('more')
    return 'made'


def test_files_come_back_with_those_that_vouch_last(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    written = []

    def write(path: Path, data: bytes) -> None:
        written.append((path.relative_to(tmp_path).as_posix(), data))

    monkeypatch.setattr(transport, 'write_atomically', write)
    assert unpack(packed(make), tmp_path) == 'made'
    assert written == [('results/a.txt', b'data'), ('z.txt', b'more'), ('results/a.json', b'key')]


@pytest.mark.parametrize('name', ['../a', '/etc/a', 'b/../../a'])
def test_no_file_is_written_outside_of_the_folder(tmp_path: Path, name: str):
    with pytest.raises(ValueError, match='outside'):
        unpack(Packed(None, ((name, b''),)), tmp_path)


# --- content


@pytest.fixture
def recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    folder = tmp_path / 'here' / 'walk'
    (folder / 'rgb').mkdir(parents=True)
    for i in range(3):
        (folder / 'rgb' / f'{i}.png').write_bytes(bytes([i]) * 1000)
    (folder / 'groundtruth.txt').write_text('1,2,3,4\n')
    return folder


def test_the_same_content_elsewhere_has_the_same_digest(recorded: Path, tmp_path: Path):
    before = files_digest([recorded])
    copy = tmp_path / 'there' / 'walk'
    shutil.copytree(recorded, copy)
    for path in copy.rglob('*'):
        os.utime(path, (1, 1))
    assert files_digest([copy]) == before
    (copy / '.hidden').write_text('an editor')
    assert files_digest([copy]) == before


@pytest.mark.parametrize('change', ['content', 'name', 'missing', 'more'])
def test_other_content_has_another_digest(recorded: Path, change: str):
    before = files_digest([recorded])
    first = recorded / 'rgb' / '0.png'
    if change == 'content':
        first.write_bytes(bytes([7]) * 1000)  # of the same size
    elif change == 'name':
        first.rename(recorded / 'rgb' / '9.png')
    elif change == 'missing':
        first.unlink()
    else:
        (recorded / 'rgb' / '3.png').touch()
    assert files_digest([recorded]) != before


def test_what_a_linked_folder_holds_is_part_of_the_digest(recorded: Path, tmp_path: Path):
    (recorded / 'rgb').rename(tmp_path / 'elsewhere')
    (recorded / 'rgb').symlink_to(tmp_path / 'elsewhere')
    (tmp_path / 'elsewhere' / 'circle').symlink_to(recorded)
    before = files_digest([recorded])
    (tmp_path / 'elsewhere' / '0.png').write_bytes(bytes([7]) * 999)
    assert files_digest([recorded]) != before


def test_digests_are_kept_until_a_file_changes(recorded: Path, monkeypatch: pytest.MonkeyPatch):
    from rgbd_kcf_tracker.batch import content

    before = files_digest([recorded])
    assert not list((recorded.parents[1]).glob('cache/**/*.json')), 'too fresh to be relied on'
    monkeypatch.setattr(content, '_SETTLED_S', -1.0)
    files_digest([recorded])
    read = []
    monkeypatch.setattr(content, '_file_digest', lambda path: read.append(path) or 'x')
    assert files_digest([recorded]) == before
    assert not read
    (recorded / 'groundtruth.txt').write_text('1,2,3,5\n')
    assert files_digest([recorded]) != before
    assert len(read) == 4


def test_a_missing_file_is_part_of_the_digest(tmp_path: Path):
    missing = files_digest([tmp_path / 'truth.txt'])
    (tmp_path / 'truth.txt').touch()
    assert len({missing, files_digest([tmp_path / 'truth.txt']), files_digest([])}) == 3


def test_one_file_that_cannot_be_read_hides_no_change_of_others(
    recorded: Path, monkeypatch: pytest.MonkeyPatch
):
    from rgbd_kcf_tracker.batch import content

    whole, real = files_digest([recorded]), content._file_digest

    def fail(path: Path) -> str:
        if path.name == '1.png':
            raise PermissionError(13, 'Permission denied', str(path))
        return real(path)

    monkeypatch.setattr(content, '_SETTLED_S', -1.0)
    with monkeypatch.context() as patch:
        patch.setattr(content, '_file_digest', fail)
        before = files_digest([recorded])
        assert before != whole
    assert files_digest([recorded]) == whole, 'nothing was kept of what could not be read'
    monkeypatch.setattr(content, '_file_digest', fail)
    (recorded / 'groundtruth.txt').write_text('1,2,3,5\n')
    assert files_digest([recorded]) != before


def test_the_log_of_a_database_is_part_of_its_digest(tmp_path: Path):
    bag = tmp_path / 'walk.db3'
    bag.write_bytes(b'SQLite format 3')
    before = files_digest([bag])
    (tmp_path / 'walk.db3-wal').write_bytes(b'more frames')
    longer = files_digest([bag])
    (tmp_path / 'walk.db3-wal').write_bytes(b'other frames')
    assert len({before, longer, files_digest([bag])}) == 3


# --- code and libraries


def test_environments_say_how_they_differ():
    own = environment()
    assert own.differences(own) == []
    assert dict(own.libraries)['opencv'] == cv2.__version__
    other = Environment('9.9', 'x', ())
    assert own.differences(other) == [f'rgbd_kcf_tracker 9.9, here {own.version}']
    libraries = tuple((n, '0' if n == 'numpy' else v) for n, v in own.libraries)
    (text,) = own.differences(Environment(own.version, own.code, libraries))
    assert text.startswith('numpy 0, here ')
    assert Environment(own.version, own.code, libraries).digest != own.digest


def imported(path: Path) -> Iterator[Path]:
    """Files of the package that a file imports, those that run by being in a package included."""
    names = []
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f'{node.module}.{alias.name}' for alias in node.names)]
    for name in names:
        parts = name.split('.')
        if parts[0] != PACKAGE.name:
            continue
        place = PACKAGE.joinpath(*parts[1:])
        if place.with_suffix('.py').is_file():
            yield place.with_suffix('.py')
        elif place != PACKAGE and (place / '__init__.py').is_file():
            yield place / '__init__.py'


def test_the_digest_of_code_covers_all_that_a_run_imports():
    todo, seen = [PACKAGE / 'evaluation' / 'jobs.py'], set()
    while todo:
        path = todo.pop()
        if path not in seen:
            seen.add(path)
            todo += imported(path)
    # What runs jobs and says how long they took decides nothing about what comes out.
    apart = {PACKAGE / 'batch', PACKAGE / 'evaluation' / 'times.py'}
    apart |= {PACKAGE / 'evaluation' / name for name in ('__init__.py', 'table.py')}
    left = {p for p in seen - set(code_files()) if not apart & {p, *p.parents}}
    assert not left


# --- progress


def test_a_log_gets_a_line_now_and_then_with_rate_and_time_left(monkeypatch, capsys):
    from rgbd_kcf_tracker.cli import workers as cli

    clock = [100.0]
    monkeypatch.setattr(cli.time, 'monotonic', lambda: clock[0])
    with cli.Progress(1000, 'run') as progress:
        progress.report(400, 'done before', found=True)
        for _ in range(10):
            clock[0] += 10.0
            progress.report(20, 'walk')
        assert progress.line(clock[0]) == '600 of 1000 runs, 2 runs/s, 0:03:20 left'
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        '480 of 1000 runs, 2 runs/s, 0:04:20 left', '560 of 1000 runs, 2 runs/s, 0:03:40 left'
    ]  # fmt: skip
