# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""ROS domains: nobody who runs on this machine gets one that another has."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

import pytest

from rgbd_kcf_tracker.bench.domains import DOMAINS, kept_to_this_machine, reserved_domain
from rgbd_kcf_tracker.errors import RgbdKcfError

HOLD = """
from rgbd_kcf_tracker.bench.domains import reserved_domain
with reserved_domain() as domain:
    print(domain, flush=True)
    input()
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    monkeypatch.setenv('TMPDIR', str(tmp_path))
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)
    return tmp_path


def test_all_that_are_held_differ_and_then_it_says_so() -> None:
    with ExitStack() as held:
        given = [held.enter_context(reserved_domain()) for _ in DOMAINS]
        assert sorted(given) == sorted(DOMAINS)
        with pytest.raises(RgbdKcfError, match='all 119 ROS domains are taken'), reserved_domain():
            pass
    with reserved_domain() as again:
        assert again == given[0]


def test_another_process_gets_another(monkeypatch: pytest.MonkeyPatch) -> None:
    holder = subprocess.Popen(
        [sys.executable, '-c', HOLD], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None
    theirs = int(holder.stdout.readline())
    # Even who would begin to seek there.
    monkeypatch.setattr(os, 'getpid', lambda: DOMAINS.index(theirs) * pow(8, -1, 119))
    with reserved_domain() as mine:
        assert mine == DOMAINS[(DOMAINS.index(theirs) + 1) % len(DOMAINS)]
    holder.communicate('\n')
    with reserved_domain() as freed:
        assert freed == theirs


def test_a_robots_own_domain_is_left_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    with reserved_domain() as first:
        pass
    monkeypatch.setenv('ROS_DOMAIN_ID', str(first))
    with reserved_domain() as other:
        assert other != first


def test_the_demo_holds_its_domain(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """It took one at random, and heard a test's camera beside its own."""
    for name in ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS', 'ROS_LOG_DIR'):
        monkeypatch.setenv(name, '')
    monkeypatch.setenv('ROS_DOMAIN_ID', '0')
    with kept_to_this_machine(tmp_path), ExitStack() as held:
        given = {held.enter_context(reserved_domain()) for _ in DOMAINS[1:]}
        assert int(os.environ['ROS_DOMAIN_ID']) not in given


def test_where_no_lock_can_be_made_it_names_the_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / 'file').touch()
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path / 'file'))
    with pytest.raises(RgbdKcfError, match=r'in .*file.*set TMPDIR'), reserved_domain():
        pass
