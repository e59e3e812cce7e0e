# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Some trials of the injector (``make inject`` runs more), and that it sees what it looks for."""

from __future__ import annotations

import signal
from collections import Counter
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
