# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Some trials of the injector (``make inject`` runs more), and that it sees what it looks for."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from rgbd_kcf_tracker.bench import inject
from rgbd_kcf_tracker.bench.file_faults import OUTPUT_FAULTS, SOURCE_FAULTS, Fault, Trial, materials
from rgbd_kcf_tracker.recordings import open_recording

TRIALS = 24


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_every_command_survives_what_befalls_files(tmp_path: Path) -> None:
    outcomes = list(inject.Injector(tmp_path, seed=20).trials(0, TRIALS))
    failed = [o for o in outcomes if o.problems]
    assert not failed, failed
    assert len({o.command[0] for o in outcomes}) == 4
    assert len({o.fault for o in outcomes}) > TRIALS // 2
    codes = Counter(o.code for o in outcomes)
    assert codes[0] >= 3, codes
    assert codes[2] >= 3, codes


def test_the_materials_are_sound(tmp_path: Path) -> None:
    made, box = materials(tmp_path)
    assert len(made) == 6
    assert len(box.split(',')) == 4
    for path in made.values():
        with open_recording(path) as recording:
            frames = list(recording.frames())
            assert len(frames) == 12, path
            assert all(frame.depth is not None for frame in frames)
            assert recording.warnings == []


@pytest.mark.parametrize('fault', [*SOURCE_FAULTS.values(), *OUTPUT_FAULTS.values()])
def test_every_fault_befalls_something(fault: Fault, tmp_path: Path) -> None:
    (tmp_path / 'source').mkdir()
    (tmp_path / 'out').mkdir()
    for name in ('groundtruth.txt', 'a.bin'):
        (tmp_path / 'source' / name).write_text(f'1,2,3,{len(name)}\n' * 50)
    trial = Trial(np.random.default_rng(1), tmp_path / 'source', tmp_path / 'out', '1,2,3,4')
    trial.outputs = {'--output': tmp_path / 'out' / 'a.csv', '--bag': tmp_path / 'out' / 'a.mcap'}

    def state() -> object:
        return (
            inject._looked_at(tmp_path), sorted(trial.outputs.items()), trial.words, trial.source,
            trial.file_limit, trial.without_rights,
        )  # fmt: skip

    before = repr(state())
    fault(trial)
    assert repr(state()) != before


@pytest.mark.parametrize('seed', range(12))
def test_an_odd_cell_is_in_the_database(seed: int, tmp_path: Path) -> None:
    made, _ = materials(tmp_path)
    (path,) = made['sqlite'].glob('*.db3')
    before = path.read_bytes()
    SOURCE_FAULTS['an odd cell'](
        Trial(np.random.default_rng(seed), made['sqlite'], tmp_path, '1,2,3,4')
    )
    assert path.read_bytes() != before
    with closing(sqlite3.connect(path)) as database:
        assert database.execute('PRAGMA integrity_check').fetchall() == [('ok',)]


def test_it_sees_what_must_not_be(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    out.mkdir()
    trial = Trial(np.random.default_rng(1), tmp_path, out, '1,2,3,4')
    good = 'rgbd-kcf: error: a.mcap is no recording at all'

    def end(code: int | None, said: str = '') -> list[str]:
        return list(inject._of_the_end(trial, code, 1.0, said))

    assert end(2, good) == end(0) == end(1) == []
    assert end(None) == ['hangs: killed after 1 s']
    assert end(1, 'Traceback (most recent call last):') == ["prints 'Traceback'"]
    assert end(-11) == ['ends with -11']
    assert end(130) == ['ends with 130']
    assert end(2) == ['ends with 2 and 0 errors']
    assert end(2, f'{good}\n{good}') == ['ends with 2 and 2 errors']
    assert end(0, good) == ['ends with 0 after an error']
    trial.signal = signal.SIGINT
    assert end(130) == []
    assert list(inject._of_the_source({'a': '1', 'b': '2'}, {'a': '1', 'c': '3'})) == [
        "the source is changed: 'b'",
        "the source is changed: 'c'",
    ]
    trial.signal = 0
    path = out / 'a.csv'
    path.write_text('')
    assert list(inject._of_the_outputs(trial, 2, {})) == ['a.csv is left empty']
    path.write_text('new')
    assert list(inject._of_the_outputs(trial, 2, {path: b'old'})) == ['a.csv was there and is lost']
    assert list(inject._of_the_outputs(trial, 0, {path: b'old'})) == ['replaces a file unasked']
    trial.outputs = {'--output': path}
    assert list(inject._of_the_outputs(trial, 0, {})) == ['a.csv has no row']
    path.with_suffix('.mcap').write_bytes(b'noise')
    trial.outputs = {'--bag': path.with_suffix('.mcap')}
    (problem,) = inject._of_the_outputs(trial, 0, {})
    assert 'is no recording' in problem


@pytest.fixture(scope='module')
def injector(tmp_path_factory: pytest.TempPathFactory) -> inject.Injector:
    return inject.Injector(tmp_path_factory.mktemp('inject'), seed=1)


def signalled(trial: Trial, kind: str) -> list[str]:
    """A command that is soon over, and a signal in its midst."""
    trial.signal, trial.signal_after, trial.fault = signal.SIGKILL, 0.4, f'{kind}: a signal'
    trial.outputs = {'DEST': trial.out / 'b.mcap'}
    return ['convert', str(trial.source)]


def test_a_signal_comes_while_the_command_runs(
    injector: inject.Injector, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A third of them came when it had ended."""
    monkeypatch.setattr(inject, '_draw', signalled)
    outcomes = list(injector.trials(0, 6))
    assert sum(o.code == -signal.SIGKILL for o in outcomes) >= 3, outcomes
    assert all((o.code == -signal.SIGKILL) != o.late for o in outcomes)


def test_a_signal_to_who_is_just_ending_is_late(
    injector: inject.Injector, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was sent, and tried nothing: once in some hundred runs."""
    monkeypatch.setattr(inject, '_draw', signalled)
    monkeypatch.setattr(inject, '_sent', lambda *_: True)
    (outcome,) = injector.trials(0, 1)
    assert outcome.code == 0
    assert outcome.late


def test_a_signal_to_who_has_just_ended_is_late() -> None:
    process = subprocess.Popen(['true'])
    process.wait()
    assert not inject._sent(process.pid, signal.SIGINT)


def test_a_circle_is_tried_in_folders_alone(tmp_path: Path) -> None:
    (tmp_path / 'a.mcap').write_bytes(b'1')
    seen = Counter[str]()
    for seed in range(300):
        trial = Trial(np.random.default_rng(seed), tmp_path / 'a.mcap', tmp_path, '1,2,3,4')
        with pytest.MonkeyPatch.context() as patch:
            for faults in (inject.SOURCE_FAULTS, inject.OUTPUT_FAULTS):
                for name in faults:
                    patch.setitem(faults, name, lambda _: None)
            inject._draw(trial, 'mcap')
        seen[trial.fault] += 1
    assert seen['mcap: a link to itself']
    assert not seen['mcap: a folder in a circle'], 'it does nothing there'


def test_what_nobody_may_read_is_removed_afterwards(tmp_path: Path) -> None:
    """By who is not root it could not be, and the run ended with a traceback."""
    (tmp_path / 'out').mkdir()
    source = tmp_path / 'source' / 'recording'
    source.mkdir(parents=True)
    (source / 'a.txt').write_text('1')
    source.chmod(0)
    inject._give_rights_back(tmp_path)
    assert source.stat().st_mode & 0o777 == 0o700


def test_an_interrupted_run_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def trials(*_: object) -> Iterator[inject.Outcome]:
        yield inject.Outcome(0, ('info',), 'a signal', 0, 0.1, (), '', late=True)
        raise KeyboardInterrupt

    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    monkeypatch.setattr(inject, 'materials', lambda _: ({}, ''))
    monkeypatch.setattr(inject.Injector, 'trials', trials)
    assert inject.main([]) == 130
    told = capsys.readouterr().out
    assert told.startswith('1 trials, 0 failed')
    assert '1 signals came when the command had ended' in told
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    'words', [['--keep', __file__], ['--seed', '-1'], ['--first', '-1'], ['--count', '0']]
)
def test_wrong_arguments_are_refused(words: list[str]) -> None:
    with pytest.raises(SystemExit, match='2'):
        inject.main(words)
