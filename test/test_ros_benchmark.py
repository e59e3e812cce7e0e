# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The commands that measure the live node, shortened; what is asserted holds on busy machines."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from rgbd_kcf_tracker.bench import latency, soak
from rgbd_kcf_tracker.bench.rig import environment

pytestmark = pytest.mark.ros


def test_benchmark_measures_a_live_camera(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / 'live.json'
    # At 15 Hz the topics' history of five holds out a third of a second without the processor.
    rate = ('--rate', '15', '--seconds', '4')
    latency.main(['--sizes', 'qhd', *rate, '--output', str(output)])
    (result,) = json.loads(output.read_text())
    assert result['sent'] == 90
    assert result['received'] >= 85
    tracker, wire = result['tracker'], result['wire']
    assert tracker['answered'] + result['dropped'] == result['received']
    assert tracker['boxes'] >= 0.9 * tracker['answered'] > 0
    assert wire['boxes'] == 0
    for figures in (tracker, wire):
        latencies = [figures[name] for name in ('median_ms', 'p95_ms', 'p99_ms', 'max_ms')]
        assert latencies[0] > 0
        assert latencies == sorted(latencies)
        assert sum(figures['histogram']) == figures['answered'] - latency.WARM_UP
        assert 0 < figures['cpu_ms'] < 500
    assert result['stages']['work_median_ms'] > 0
    printed = capsys.readouterr().out
    assert '| qhd 960x540 | 15 | 90 |' in printed
    assert 'on top of the wire' in printed


def test_soak_shortened(tmp_path: Path) -> None:
    output = tmp_path / 'soak.json'
    soak.main(['--frames', '500', '--output', str(output)])
    result = json.loads(output.read_text())
    assert result['answered'] == result['sent'] == 500
    assert result['boxes'] > 450
    assert result['end_mb'] - result['settled_mb'] < soak.GROWTH_MB


@pytest.mark.parametrize('command', [latency.main, soak.main])
def test_figures_of_an_earlier_run_are_kept(
    command: Callable[[list[str]], int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    earlier = tmp_path / 'earlier.json'
    earlier.write_text('[]')
    with pytest.raises(SystemExit, match='2'):
        command(['--output', str(earlier)])
    assert '--overwrite' in capsys.readouterr().err
    assert earlier.read_text() == '[]'
    with pytest.raises(SystemExit, match='2'):
        command(['--output', str(tmp_path / 'nowhere' / 'a.json')])
    assert 'nowhere' in capsys.readouterr().err


def test_a_soak_that_cannot_go_on_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: object) -> None:
        raise RuntimeError('the tracker stopped after 3 answers')

    monkeypatch.setattr(soak, 'run', stopped)
    assert soak.main(['--frames', '10']) == 2
    assert 'stopped after 3 answers' in capsys.readouterr().err


FIGURES = latency.Figures(60, 60, 5.0, 6.0, 7.0, 8.0, 3.0, (60,) + (0,) * 13)
RESULT = latency.Result('kcf', 'sd', 30.0, 60, 60, 0, FIGURES, FIGURES, {})


def test_what_was_measured_before_a_tracker_ended_is_printed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def measured(variant: str, size: str, *_: object) -> latency.Result:
        if size == 'hd':
            raise RuntimeError('the tracker ended with status -9')
        return RESULT

    monkeypatch.setattr(latency, 'measure', measured)
    assert latency.main(['--sizes', 'sd', 'hd']) == 2
    told = capsys.readouterr()
    assert '| `kcf` | sd 512x424 |' in told.out
    assert 'metric at hd: the tracker ended with status -9' in told.err


def test_a_tracker_that_ends_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    class Heard:
        arrivals = wire = ((1, 2, True),)

        def await_tracker(self, _: object) -> None: ...
        def close(self) -> None: ...
        def spin(self, seconds: float) -> None:
            os.waitid(os.P_PID, tracker.pid, os.WEXITED | os.WNOWAIT)

    @contextmanager
    def child(module: str, *_: str, env: dict[str, str]) -> Iterator[subprocess.Popen[bytes]]:
        nonlocal tracker
        ends = 'import sys; sys.exit(3)' if 'tracker_main' in module else 'input()'
        made = subprocess.Popen([sys.executable, '-c', ends], stdin=subprocess.PIPE)
        tracker = made if 'tracker_main' in module else tracker
        yield made
        made.communicate(b'\n')

    tracker = subprocess.Popen(['true'])
    monkeypatch.setattr(latency, 'Listener', Heard)
    monkeypatch.setattr(latency, 'child', child)
    with pytest.raises(RuntimeError, match='the tracker ended with status 3'):
        latency.measure('kcf', 'small', 30.0, 2.0, False)


@pytest.mark.parametrize(
    'words',
    [['--rate', 'nan'], ['--seconds', 'inf'], ['--rate', '-5'], ['--rate', '30', '--seconds', '1']],
)
def test_what_gives_no_figures_is_refused(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one block all processor time of the start was that of one pair."""
    monkeypatch.setattr(latency, 'measure', lambda *_: RESULT)
    with pytest.raises(SystemExit, match='2'):
        latency.main(words)
    assert '31 pairs or more' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('bench', 'measures'), [(latency, 'measure'), (soak, 'run')], ids=['latency', 'soak']
)
def test_a_measurement_has_a_domain_and_logs_of_its_own(
    bench: Any, measures: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    seen: dict[str, str] = {}

    def measured(*_: object) -> object:
        seen.update(environment())
        assert Path(seen['ROS_LOG_DIR']).is_dir()
        raise RuntimeError('seen')

    monkeypatch.setattr(bench, measures, measured)
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    monkeypatch.setenv('ROS_DOMAIN_ID', '17')
    monkeypatch.delenv('ROS_LOG_DIR')
    assert bench.main([]) == 2
    assert seen['ROS_DOMAIN_ID'] != '17'
    assert Path(seen['ROS_LOG_DIR']).parent == tmp_path
    assert not Path(seen['ROS_LOG_DIR']).exists()
    assert os.environ['ROS_DOMAIN_ID'] == '17'
