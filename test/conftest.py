# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What every test may use: the recorded data, where it lies, and a ROS domain of its own."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from rgbd_kcf_tracker.bench.domains import reserved_domain
from rgbd_kcf_tracker.ros.transport import PROFILE_VARIABLE

if TYPE_CHECKING:
    from ros_rig import Rig

# Field checks are off by default in Jazzy; without them a wrong type serialises garbage silently.
# rclpy's generated messages read this when they are imported, so it is set before any of them is.
os.environ.setdefault('ROS_PYTHON_CHECK_FIELDS', '1')
# Pictures are drawn into files only.
os.environ.setdefault('MPLBACKEND', 'Agg')

# A suite started in a shell's background inherits that Ctrl-C is ignored, and so would the programs
# under test, which are to be interrupted by it. A handler of Python's own is not inherited.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

PROJECT = Path(__file__).resolve().parent.parent


@contextmanager
def ros_environment(log_folder: Path) -> Iterator[int]:
    """Keep the nodes that a test starts, in and out of its process, apart from all others."""
    with reserved_domain() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_DOMAIN_ID', str(domain))
        patch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        patch.setenv('ROS_PYTHON_CHECK_FIELDS', '1')
        patch.setenv('ROS_LOG_DIR', str(log_folder))
        # Found without multicast too, as in many containers.
        patch.setenv('ROS_STATIC_PEERS', '127.0.0.1')
        patch.delenv('ROS_LOCALHOST_ONLY', raising=False)
        yield domain


@pytest.fixture(scope='module')
def module_ros_domain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """One domain for the whole module: for nodes that live through several tests."""
    with ros_environment(tmp_path_factory.mktemp('ros_log')) as domain:
        yield domain


@pytest.fixture(autouse=True)
def _own_ros_domain(request: pytest.FixtureRequest) -> Iterator[None]:
    if request.node.get_closest_marker('ros') is None:
        yield
        return
    pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")
    if 'module_ros_domain' in request.fixturenames:
        yield
        return
    folder = request.getfixturevalue('tmp_path_factory').mktemp('ros_log')
    with ros_environment(folder):
        yield


@pytest.fixture
def _process(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What a main program changes in its process, put back."""
    monkeypatch.setenv(PROFILE_VARIABLE, '')
    monkeypatch.setattr(os, 'nice', lambda _: None)  # that of the tests stays
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.getsignal(number) for number in numbers}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def rig() -> Iterator[Rig]:
    """A camera, and a listener to what a tracker says (only for tests marked ``ros``)."""
    from ros_rig import Rig  # needs ROS 2

    made = Rig()
    yield made
    made.close()


@pytest.fixture
def ros_domain() -> int:
    """The domain id that this test has for itself (only for tests marked ``ros``)."""
    return int(os.environ['ROS_DOMAIN_ID'])


def _find_shared_data() -> Path | None:
    named = os.environ.get('RGBD_KCF_DATA')
    if named is not None:
        return Path(named) if Path(named).is_dir() else None
    beside = PROJECT.parent / 'shared' / 'data'
    return beside if beside.is_dir() else None


@pytest.fixture(scope='session')
def shared_data() -> Path:
    """The folder of recorded data, read-only; the test is skipped where there is none."""
    folder = _find_shared_data()
    if folder is None:
        pytest.skip('no recorded data: name its folder in RGBD_KCF_DATA, or have ../shared/data')
    return folder
