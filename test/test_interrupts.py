# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Ctrl-C at any moment: no traceback, no hang, and nothing lost of what was done."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from rgbd_kcf_tracker.batch import environment as code
from rgbd_kcf_tracker.cli import bench
from rgbd_kcf_tracker.cli.common import progress
from rgbd_kcf_tracker.cli.interrupts import interrupts
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.evaluation import jobs, report, runner, speed
from rgbd_kcf_tracker.live.stopping import Stop
from rgbd_kcf_tracker.recordings import mcap_writer, open_recording

SMALL = ['--size', '160x90', '--duration', '1']

pytestmark = pytest.mark.timeout(120)


@pytest.fixture(autouse=True)
def _ours() -> Iterator[None]:
    """As in a program of its own, whatever pytest or a shell in the background did."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def environment() -> dict[str, str]:
    return os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)}


STOP_AT_IMPORT = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
wanted = sys.argv.pop(1)
class Stop:
    def find_spec(self, name, *rest):
        if name == wanted:
            sys.meta_path.remove(self)
            try:
                os.kill(os.getpid(), signal.SIGINT)
            except KeyboardInterrupt as error:  # as NumPy's compiled parts do
                raise ImportError('initialization failed') from error
sys.meta_path.insert(0, Stop())
from rgbd_kcf_tracker.cli.main import main
sys.exit(main())
"""


@pytest.fixture(scope='module')
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp('walk') / 'walk.mcap'
    assert main(['simulate', str(path), *SMALL, '--rate', '5']) == 0
    return path


@pytest.mark.parametrize('module', ['argparse', 'numpy', 'cv2', 'scipy.fft', 'mcap', 'rosbags'])
def test_while_the_program_starts(module: str, walk: Path, tmp_path: Path) -> None:
    shutil.copy(walk, tmp_path / 'a.mcap')
    words = ['track', 'a.mcap', '--output', 'a.csv', '--bag', 'out.mcap']
    done = subprocess.run(
        [sys.executable, '-c', STOP_AT_IMPORT, module, *words], cwd=tmp_path,
        capture_output=True, text=True, env=environment(), timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 130, done.stderr
    assert done.stderr == 'rgbd-kcf: interrupted\n'
    left = {p.name for p in tmp_path.iterdir()}
    assert {'a.mcap'} <= left <= {'a.mcap', 'a.csv', 'out.mcap'}, 'whole rows, if any'


def test_the_first_waits_for_the_step_and_the_second_does_not() -> None:
    done = []

    def steps(presses: int) -> None:
        done.clear()
        with interrupts.handled():
            for number in progress(range(5), 5, 'steps'):
                if number == 2:
                    for _ in range(presses):
                        signal.raise_signal(signal.SIGINT)
                done.append(number)

    with pytest.raises(KeyboardInterrupt):
        steps(1)
    assert done == [0, 1, 2]
    with pytest.raises(KeyboardInterrupt):
        steps(2)
    assert done == [0, 1]
    steps(0)
    assert done == [0, 1, 2, 3, 4]


def test_one_that_a_library_swallows_is_not_forgotten() -> None:
    with interrupts.handled():
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            next(iter(progress(range(5), 5, 'steps')))


def test_one_in_a_callback_of_the_interpreter_comes_again(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Python would print it with its traceback and go on. What waits does not wait on."""

    def work() -> None:
        thing: set[int] = set()
        kept = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
        del thing
        assert kept() is None
        time.sleep(10)

    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt), interrupts.handled():
        work()
    assert time.monotonic() - begin < 9
    assert capsys.readouterr().err == ''


def test_one_that_comes_again_before_the_callback_has_ended_is_not_lost(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The thread that sends it may be faster than the one that starts it."""
    start, early = threading.Timer.start, iter([True])

    def started(timer: threading.Timer) -> None:
        if next(early, False):
            signal.raise_signal(signal.SIGINT)
        start(timer)

    monkeypatch.setattr(threading.Timer, 'start', started)
    test_one_in_a_callback_of_the_interpreter_comes_again(capsys)


def test_what_was_to_come_again_does_not_come_once_all_has_ended(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It ended the next command of the same process."""
    timers: list[threading.Timer] = []
    monkeypatch.setattr(threading.Timer, 'start', lambda timer: timers.append(timer))
    with interrupts.handled():
        thing: set[int] = set()
        kept = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
        del thing
        assert kept() is None
    assert len(timers) == 1
    with interrupts.handled():
        timers[0].function()
        time.sleep(0.01)


def test_a_signal_that_is_ignored_stays_so() -> None:
    """As for programs that a shell starts in the background."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interrupts.handled():
        signal.raise_signal(signal.SIGINT)
        assert list(progress(range(3), 3, 'steps')) == [0, 1, 2]


@pytest.mark.usefixtures('_process')
def test_a_node_hears_that_its_terminal_closes_unless_it_is_to_live_on() -> None:
    """Else ``follow`` would leave a robot driving."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    stop = Stop()
    signal.raise_signal(signal.SIGHUP)
    assert stop.is_set()
    stop.ignore()
    signal.raise_signal(signal.SIGHUP)
    unhurt = Stop()  # as under nohup
    signal.raise_signal(signal.SIGHUP)
    assert not unhurt.is_set()


@pytest.mark.parametrize('command', ['track', 'convert', 'simulate'])
def test_what_was_written_is_whole(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """Ctrl-C in the middle of a frame: that frame is finished, and the files are closed."""
    source = tmp_path / 'walk'
    assert main(['simulate', str(source), *SMALL, '--rate', '10']) == 0
    from rgbd_kcf_tracker.recordings import bag_writer

    real, count = bag_writer.BagWriter._write_image, iter(range(100))

    def stopping(self: Any, *words: Any) -> None:
        real(self, *words)
        if next(count) == 6:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(bag_writer.BagWriter, '_write_image', stopping)
    out = tmp_path / 'out.mcap'
    words = {
        'track': ['track', str(source), '--variant', 'kcf', '--bag', str(out)],
        'convert': ['convert', str(source), str(out)],
        'simulate': ['simulate', str(out), *SMALL, '--rate', '10'],
    }[command]
    capsys.readouterr()
    assert main(words) == 130
    assert capsys.readouterr().err.endswith('rgbd-kcf: interrupted\n')
    with open_recording(out) as recording:
        assert [f.depth is not None for f in recording.frames()] == [True] * 4
        assert recording.warnings == []


# -- evaluate, bench ---------------------------------------------------------------------------


EVALUATE = ['evaluate', 'sim:normal,behind_box,crowd', '--size', '160x90', '--duration', '0.5',
            '--variants', 'kcf', '--report']  # fmt: skip


def test_evaluate_finishes_the_run_under_way_and_reports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real, begun = jobs.run_job, []

    def stopping(job: jobs.Job) -> list[jobs.Failure]:
        begun.append(job.sequence.name)
        if len(begun) == 2:
            signal.raise_signal(signal.SIGINT)
        return real(job)

    monkeypatch.setattr(runner, 'run_job', stopping)
    report = str(tmp_path / 'report')
    assert main([*EVALUATE, report, '--jobs', '1']) == 130
    said = capsys.readouterr()
    assert 'the runs under way are finished, then it stops' in said.err
    assert 'the same command goes on from here' in said.err
    assert 'report:' in said.out
    assert begun == ['normal/1', 'behind_box/1']
    table = (tmp_path / 'report' / 'per_frame.csv').read_text()
    assert 'kcf,behind_box/1,14,' in table
    assert main([*EVALUATE, report, '--jobs', '1']) == 0
    assert begun[2:] == ['crowd/1']


def test_a_part_that_was_stopped_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = runner.run_job

    def stopping(job: jobs.Job) -> Any:
        signal.raise_signal(signal.SIGINT)
        return real(job)

    folder = tmp_path / 'report'
    words = [*EVALUATE, str(folder), '--jobs', '1', '--shard', '1/1']
    with monkeypatch.context() as patch:
        patch.setattr(runner, 'run_job', stopping)
        assert main(words) == 130
    assert (folder / 'results').exists()
    assert not (folder / 'parts').exists()
    assert main(words) == 0
    assert (folder / 'parts' / '1_of_1.json').exists()


def test_evaluate_finishes_the_report_that_it_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = report._write_failures

    def stopping(*words: Any) -> None:
        signal.raise_signal(signal.SIGINT)
        real(*words)

    monkeypatch.setattr(report, '_write_failures', stopping)
    folder = tmp_path / 'report'
    assert main([*EVALUATE, str(folder), '--jobs', '1']) == 130
    said = capsys.readouterr()
    assert 'the report is written, then it stops' in said.err
    assert f'report: {folder / report.PAGE}' in said.out
    assert (folder / report.PAGE).stat().st_size > 1000


def test_evaluate_stopped_before_the_first_run_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = runner.run_job

    def stopping(job: jobs.Job) -> list[jobs.Failure]:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        return real(job)

    monkeypatch.setattr(runner, 'run_job', stopping)
    assert main([*EVALUATE, str(tmp_path / 'report'), '--jobs', '1']) == 130
    assert capsys.readouterr().err.endswith('rgbd-kcf: interrupted\n')
    assert not (tmp_path / 'report' / 'results').exists()


@pytest.mark.slow
@pytest.mark.parametrize('presses', [1, 2])
def test_evaluate_with_processes(presses: int, tmp_path: Path) -> None:
    words = ['evaluate', 'sim:all:1-9', *SMALL, '--variants', 'kcf', '--jobs', '2']
    process = subprocess.Popen(
        [sys.executable, '-m', 'rgbd_kcf_tracker.cli.main', *words, '--report', 'report'],
        cwd=tmp_path, env=environment(), start_new_session=True, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        # a child of a shell's background job has it ignored
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    results = tmp_path / 'report' / 'results' / 'kcf'
    while process.poll() is None and not (results.exists() and list(results.glob('*.json'))):
        time.sleep(0.05)
    for _ in range(presses):
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all processes
        time.sleep(0.3)
    out, err = process.communicate(timeout=90)
    assert process.returncode == 130, err
    assert 'Traceback' not in err
    done = len(list(results.glob('*.json')))
    assert done >= 1
    if presses == 1:
        assert 'report:' in out
        assert (tmp_path / 'report' / 'index.html').stat().st_size > 1000
        assert 'the same command goes on from here' in err


def test_bench_prints_what_it_has(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real, count = speed.SpeedScene.frame, iter(range(1000))

    def stopping(self: Any, index: int) -> Any:
        if next(count) == 30:
            signal.raise_signal(signal.SIGINT)
        return real(self, index)

    monkeypatch.setattr(speed.SpeedScene, 'frame', stopping)
    monkeypatch.setattr(bench, 'THREADS', ())
    words = ['bench', '--sizes', '64x64:32,128x128:64,96x96:48', '--frames', '20']
    assert main([*words, '--variants', 'kcf']) == 130
    out = capsys.readouterr().out
    assert '64x64' in out
    assert '128x128' in out
    assert '96x96' not in out


# -- what is done stays done, but not longer than it holds -------------------------------------


def test_results_are_kept_as_long_as_what_makes_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = tmp_path / 'package'
    shutil.copytree(
        code.ROOT, root,
        ignore=shutil.ignore_patterns('__pycache__'),
    )  # fmt: skip
    before = code.code_digest(root)
    for name, kept in (
        ('evaluation/datasets/folder.py', False),
        ('evaluation/datasets/base.py', False),
        ('evaluation/passes.py', False),
        ('recordings/textfiles.py', False),
        ('metric/targets.py', False),
        ('geometry.py', False),
        ('evaluation/plots.py', True),
        ('cli/track.py', True),
        ('ros/tracker_node.py', True),
    ):
        old = (root / name).read_text()
        (root / name).write_text(old + '\n# changed\n')
        assert (code.code_digest(root) == before) == kept, name
        (root / name).write_text(old)


@pytest.mark.parametrize('library', ['numpy', 'scipy', 'opencv', 'python'])
def test_results_are_kept_as_long_as_the_libraries(
    library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = code.environment()
    version = code.importlib.metadata.version
    with monkeypatch.context() as patch:
        if library == 'opencv':
            patch.setattr('cv2.__version__', '99.0')
        elif library == 'python':
            patch.setattr(code.platform, 'python_version_tuple', lambda: ('3', '99', '0'))
        else:
            patch.setattr(
                code.importlib.metadata, 'version',
                lambda name: '99.0' if name == library else version(name),
            )  # fmt: skip
        code.environment.cache_clear()
        assert code.environment().digest != before.digest
    code.environment.cache_clear()
    assert code.environment() == before


def test_ctrl_c_while_a_bag_is_begun_leaves_no_empty_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """What came up while the writer's libraries were imported comes again there."""

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(mcap_writer, 'Writer', interrupted)
    with pytest.raises(KeyboardInterrupt):
        mcap_writer.McapWriter(tmp_path / 'a.mcap')
    assert not list(tmp_path.iterdir())
