# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The commands that measure the live node, shortened; what is asserted holds on busy machines."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from rgbd_kcf_tracker.bench import latency, soak

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
