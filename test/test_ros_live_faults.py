# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The injector of live faults, shortened: every kind once, and what is not survived is noticed."""

from __future__ import annotations

import signal

import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from rgbd_kcf_tracker.bench.live_faults import FAULTS, FaultFound, Target, inject

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
