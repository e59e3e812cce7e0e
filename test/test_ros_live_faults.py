# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The injector of live faults, shortened: every kind once, and what is not survived is noticed."""

from __future__ import annotations

import os
import signal
import subprocess
from collections import Counter
from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from rgbd_kcf_tracker.bench import live_faults
from rgbd_kcf_tracker.bench.live_faults import FAULTS, FaultFound, Target, corrupt_bytes, inject

pytestmark = [pytest.mark.ros, pytest.mark.timeout(240)]


def test_every_kind_of_fault_is_survived() -> None:
    outcome = inject(len(FAULTS), seed=11)
    assert outcome.found == []
    assert set(outcome.done) == {fault.__name__ for fault in FAULTS}


def test_a_node_that_does_not_survive_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    target = Target(np.random.default_rng(1))
    try:
        target.start()
        monkeypatch.setattr('rgbd_kcf_tracker.bench.live_faults.PATIENCE_S', 2.0)
        target.process.send_signal(signal.SIGSTOP)  # hangs
        with pytest.raises(FaultFound, match='a good pair was not answered'):
            target.check()
        with pytest.raises(FaultFound, match='did not end on signal'):
            target.stop(signal.SIGINT)
        with pytest.raises(FaultFound, match='ended by itself'):
            target.check()
    finally:
        target.close()


INTERNAL = '[WARN] [1.0] [tracker]: internal error: KeyError: 3\n'


@pytest.fixture
def target() -> Iterator[Target]:
    """One whose process does nothing."""
    made = Target(np.random.default_rng(1))
    made.process = subprocess.Popen(['sleep', '60'])
    try:
        yield made
    finally:
        made.close()


def test_an_internal_error_is_noticed_that_no_diagnostics_tell(
    target: Target, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They come once a second: of what goes wrong just before an end only the log tells."""

    class Answered(Counter[int]):
        def __missing__(self, stamp: int) -> int:
            return 1

    monkeypatch.setattr(target, 'answers', Answered())
    target.check()
    target._log.write_text(INTERNAL)
    with pytest.raises(FaultFound, match='internal error: KeyError: 3'):
        target.check()
    with pytest.raises(FaultFound, match='internal error: KeyError: 3'):
        target.stop(signal.SIGKILL)


def test_corrupt_messages_reach_the_node_too(
    target: Target, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All were cut off, so that its middleware read none of them."""
    sent: list[bytes] = []
    for publisher in (target.color, target.depth):
        monkeypatch.setattr(publisher, 'publish', sent.append)
    for _ in range(20):
        corrupt_bytes(target)
    for of_one in (sent[::2], sent[1::2]):  # colour, depth
        longest = max(map(len, of_one))
        assert 5 < sum(len(message) == longest for message in of_one) < 15


def test_faults_are_injected_in_no_robots_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def injected(*_: object) -> live_faults.Injection:
        seen.append((os.environ['ROS_DOMAIN_ID'], os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE']))
        return live_faults.Injection()

    monkeypatch.setattr(live_faults, 'inject', injected)
    monkeypatch.setenv('ROS_DOMAIN_ID', '17')
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    assert live_faults.main(['--faults', '1']) == 0
    ((domain, reach),) = seen
    assert domain != '17'
    assert reach == 'LOCALHOST'
    assert os.environ['ROS_DOMAIN_ID'] == '17'
    assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'SUBNET'


@pytest.mark.parametrize('words', [['--faults', '0'], ['--seed', '-1']])
def test_no_faults_are_refused(words: list[str]) -> None:
    with pytest.raises(SystemExit, match='2'):
        live_faults.main(words)
