# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Camera, tracker and consumer on three machines: network namespaces joined by a bridge.

Each has a network and a /dev/shm of its own, so that images really go over UDP. Run with ``-s`` to
see what it costs in bandwidth.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from rgbd_kcf_tracker.bench.camera import NAMESPACE
from rgbd_kcf_tracker.bench.latency import first_box
from rgbd_kcf_tracker.bench.rig import environment

pytestmark = pytest.mark.ros

HOSTS = ('camera', 'tracker', 'consumer')
PROJECT = Path(__file__).resolve().parent.parent


class Network:
    """Three hosts on one switch, with addresses 10.77.0.1 to 10.77.0.3."""

    def __init__(self) -> None:
        self.tag = f'rk{os.getpid() % 100_000}'
        self.hub = f'{self.tag}-hub'

    def name(self, host: str) -> str:
        return f'{self.tag}-{host}'

    def address(self, host: str) -> str:
        return f'10.77.0.{HOSTS.index(host) + 1}'

    def up(self) -> None:
        ip('netns', 'add', self.hub)
        ip('-n', self.hub, 'link', 'add', 'switch', 'type', 'bridge', 'mcast_snooping', '0')
        ip('-n', self.hub, 'link', 'set', 'switch', 'up')
        for number, host in enumerate(HOSTS):
            space, port = self.name(host), f'port{number}'
            ip('netns', 'add', space)
            ip('-n', self.hub, 'link', 'add', port, 'type', 'veth', 'peer', 'eth0', 'netns', space)
            ip('-n', self.hub, 'link', 'set', port, 'master', 'switch', 'up')
            ip('-n', space, 'address', 'add', f'{self.address(host)}/24', 'dev', 'eth0')
            ip('-n', space, 'link', 'set', 'lo', 'up')
            ip('-n', space, 'link', 'set', 'eth0', 'up')
            ip('-n', space, 'route', 'add', '224.0.0.0/4', 'dev', 'eth0')

    def down(self) -> None:
        for space in (*(self.name(host) for host in HOSTS), self.hub):
            with suppress(subprocess.CalledProcessError):
                ip('netns', 'delete', space)

    def without_multicast(self) -> None:
        """As in many company and university networks: the switch passes no multicast."""
        for host in HOSTS:
            space = self.name(host)
            ip('-n', space, 'route', 'delete', '224.0.0.0/4', 'dev', 'eth0')
            ip('-n', space, 'link', 'set', 'eth0', 'multicast', 'off')

    def start(self, host: str, module: str, *arguments: str, **variables: str) -> Any:
        command = 'mount -t tmpfs tmpfs /dev/shm && exec "$0" -m "$@"'  # shared memory of its own
        env = environment() | {
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
            'PYTHONPATH': os.pathsep.join((str(PROJECT), os.environ.get('PYTHONPATH', ''))),
            **variables,
        }
        return subprocess.Popen(
            [
                *('ip', 'netns', 'exec', self.name(host), 'sh', '-c', command),
                *(sys.executable, module, *arguments),
            ],
            env=env,
            stdout=subprocess.PIPE,
            text=True,
        )

    def plug(self, host: str, plugged: bool) -> None:
        """Pull a host's cable out of the switch, or put it in."""
        port = f'port{HOSTS.index(host)}'
        ip('-n', self.hub, 'link', 'set', port, 'up' if plugged else 'down')

    def disturb(self, host: str, *netem: str) -> None:
        """Loss and delay on all that a host sends."""
        tc('-n', self.name(host), 'qdisc', 'add', 'dev', 'eth0', 'root', 'netem', *netem)

    def sent_bytes(self, host: str) -> int:
        text = ip('-n', self.name(host), '-s', '-j', 'link', 'show', 'eth0')
        return int(json.loads(text)[0]['stats64']['tx']['bytes'])


def ip(*arguments: str) -> str:
    done = subprocess.run(['ip', *arguments], check=True, capture_output=True, text=True)
    return done.stdout


def tc(*arguments: str) -> None:
    subprocess.run(['tc', *arguments], check=True, capture_output=True, text=True)


@pytest.fixture
def network() -> Iterator[Network]:
    if shutil.which('ip') is None:
        pytest.skip('needs the command ip (iproute2) to make network namespaces')
    made = Network()
    try:
        made.up()
    except subprocess.CalledProcessError as error:
        made.down()
        pytest.skip(f'no right to make network namespaces: {error.stderr.strip()}')
    yield made
    made.down()


@pytest.mark.parametrize(
    ('multicast', 'compressed'), [(True, False), (False, True)], ids=['raw', 'static_compressed']
)
def test_three_machines(network: Network, multicast: bool, compressed: bool) -> None:
    count, variables = 60, {}
    if not multicast:
        network.without_multicast()
        # Named on one side is enough: the tracker knows both others.
        peers = f'{network.address("camera")};{network.address("consumer")}'
        variables['ROS_STATIC_PEERS'] = peers
    transports = ()
    if compressed:
        transports = (
            *('-p', 'color_transport:=compressed'),
            *('-p', 'depth_transport:=compressedDepth'),
        )
    processes = []
    try:
        consumer = network.start('consumer', 'rgbd_kcf_tracker.bench.listener', '--timeout', '60')
        tracker = network.start(
            'tracker',
            'rgbd_kcf_tracker.ros.tracker_main',
            *('--ros-args', '-r', f'__ns:={NAMESPACE}', *transports),
            *('-p', f'init_box:={first_box("qhd")}'),
            # UDP may lose an image; nothing else is to be missing, however busy the machine is.
            *('-p', 'queue_policy:=all', '-p', 'reliability:=best_effort'),
            **variables,
        )
        # The consumer must know the tracker before there is anything to miss.
        assert consumer.stdout.readline() == 'listening\n'
        before = network.sent_bytes('camera')
        camera = network.start(
            'camera',
            'rgbd_kcf_tracker.bench.camera',
            *('--size', 'qhd', '--count', str(count), '--rate', '15'),
            *(['--compressed'] if compressed else []),
        )
        processes = [consumer, tracker, camera]
        assert camera.wait(60) == 0, 'the camera found nobody who listens'
        sent = network.sent_bytes('camera') - before
        figures = json.loads(consumer.communicate(timeout=60)[0].splitlines()[-1])
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(10)
            process.stdout.close()
    print(f'\nqhd, compressed {compressed}: {sent / count / 1e3:.0f} kB a pair, {figures}')
    assert figures['answers'] >= 0.8 * count
    assert figures['boxes'] >= 0.9 * figures['answers']
    raw = 960 * 540 * 5
    assert sent / count < (0.5 if compressed else 1.3) * raw
    if not compressed:
        assert sent / count > 0.9 * raw


COMPRESSED = (
    *('-p', 'color_transport:=compressed'),
    *('-p', 'depth_transport:=compressedDepth'),
)


def run_disturbed(network: Network, count: int, disturb: Callable[[], None]) -> dict[str, Any]:
    """Compressed images at 15 Hz over three hosts, and what befalls the network meanwhile."""
    processes = []
    try:
        consumer = network.start(
            'consumer',
            'rgbd_kcf_tracker.bench.listener',
            *('--timeout', '90', '--silence', '6'),
        )
        tracker = network.start(
            'tracker',
            'rgbd_kcf_tracker.ros.tracker_main',
            *('--ros-args', '-r', f'__ns:={NAMESPACE}', *COMPRESSED),
            *('-p', f'init_box:={first_box("sd")}'),
        )
        processes = [consumer, tracker]
        assert consumer.stdout.readline() == 'listening\n'
        camera = network.start(
            'camera',
            'rgbd_kcf_tracker.bench.camera',
            *('--size', 'sd', '--count', str(count), '--rate', '15', '--compressed'),
        )
        processes.append(camera)
        disturb()
        assert camera.wait(90) == 0, 'the camera found nobody who listens'
        figures: dict[str, Any] = json.loads(consumer.communicate(timeout=90)[0].splitlines()[-1])
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            assert process.wait(20) in (0, 1)
            process.stdout.close()
    print(f'\n{figures}')
    return figures


def test_links_that_go_down_come_back(network: Network) -> None:
    """Nothing need be started again: images and answers go on where they can."""
    count = 150

    def disturb() -> None:
        # Not before images go: on a busy machine the camera starts after seconds.
        before, end = network.sent_bytes('camera'), time.monotonic() + 60
        while network.sent_bytes('camera') < before + 1_000_000:
            assert time.monotonic() < end, 'the camera sends nothing'
            time.sleep(0.05)
        for host in ('camera', 'consumer'):
            network.plug(host, False)
            time.sleep(2)
            network.plug(host, True)
            time.sleep(3)

    figures = run_disturbed(network, count, disturb)
    assert figures['longest_gap_s'] > 1.5
    assert figures['after_gap'] > 10
    assert figures['boxes'] >= 0.8 * figures['answers']


def test_loss_and_delay(network: Network) -> None:
    """As over Wi-Fi: what is lost is lost, and everything else is answered."""
    try:
        for host in HOSTS:
            network.disturb(host, 'delay', '15ms', '5ms', 'loss', '1%')
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f'no netem in this kernel: {getattr(error, "stderr", error)}')
    figures = run_disturbed(network, 90, lambda: None)
    assert figures['answers'] > 20
    assert figures['longest_gap_s'] < 5
