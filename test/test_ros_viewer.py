# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The viewer node beside a real tracker node, over real DDS and a real socket."""

from __future__ import annotations

import asyncio
import json
import os
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")
pytest.importorskip('aiohttp', reason="the page needs aiohttp: pip install '.[view]'")

import aiohttp
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from ros_rig import Rig, overrides, running_node, scene

from rgbd_kcf_tracker import Box, Frame, Track, TrackState
from rgbd_kcf_tracker.errors import BoxError, ParameterError
from rgbd_kcf_tracker.insight import Insight
from rgbd_kcf_tracker.recordings.evidence_messages import TargetEvidence
from rgbd_kcf_tracker.ros.process import spin
from rgbd_kcf_tracker.ros.viewer_node import ViewerNode
from rgbd_kcf_tracker.view.commands import Command
from rgbd_kcf_tracker.view.live_page import LivePage, node_parameter
from rgbd_kcf_tracker.view.server import Server

pytestmark = [pytest.mark.ros, pytest.mark.timeout(180)]


@contextmanager
def running_viewer(**values: Any) -> Iterator[tuple[ViewerNode, Server]]:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(os.environ['ROS_DOMAIN_ID']))
    node = ViewerNode(context=context, parameter_overrides=overrides({'rate': 60.0, **values}))
    server = Server(node.page, port=0)
    server.start()
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    stop = threading.Event()
    thread = threading.Thread(target=spin, args=(executor, node, stop.is_set), daemon=True)
    thread.start()
    try:
        yield node, server
    finally:
        server.stop()
        stop.set()
        thread.join(5)
        node.destroy_node()
        rclpy.shutdown(context=context)


class Look:
    """A browser's socket in a thread: the newest header, and what it asks."""

    def __init__(self, server: Server) -> None:
        self.headers: list[dict[str, Any]] = []
        self._url = server.url
        self._loop = asyncio.new_event_loop()
        self._socket: Any = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        self._loop.run_until_complete(self._main())

    async def _main(self) -> None:
        async with aiohttp.ClientSession() as session:
            self._socket = await session.ws_connect(
                self._url + 'socket', origin=self._url.rstrip('/'), max_msg_size=0
            )
            async for message in self._socket:
                if message.type is not aiohttp.WSMsgType.BINARY:
                    continue
                (length,) = struct.unpack_from('<I', message.data)
                self.headers.append(json.loads(message.data[4 : 4 + length]))
                await self._socket.send_json({'do': 'ack'})

    def ask(self, **message: Any) -> None:
        asyncio.run_coroutine_threadsafe(self._socket.send_json(message), self._loop).result(10)

    def close(self) -> None:
        asyncio.run_coroutine_threadsafe(self._socket.close(), self._loop).result(10)
        self._thread.join(10)


def until(rig: Rig, condition: Callable[[], Any], seconds: float = 60) -> None:
    """Frames go on until a condition holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, condition
        rig.index = getattr(rig, 'index', -1) + 1  # type: ignore[attr-defined]
        rig.send(rig.index)  # type: ignore[attr-defined]
        time.sleep(0.03)


def test_a_box_from_the_page_starts_the_tracker_and_is_shown(rig: Rig) -> None:
    with running_node(rig), running_viewer() as (node, server):
        assert rig.color.get_subscription_count() == 1  # nobody looks: the images are not asked for
        look = Look(server)
        until(rig, lambda: look.headers and 'points' in look.headers[-1]['blobs'])
        header = look.headers[-1]
        assert header['size'] == [320, 240]
        assert header['camera'][0] == 290
        assert header['targets'] == []
        box = scene(rig.index)[2]  # type: ignore[attr-defined]
        look.ask(do='box', x=box.x, y=box.y, width=box.width, height=box.height, frame=0)
        until(rig, lambda: look.headers[-1]['targets'] and look.headers[-1]['targets'][0]['box'])
        target = look.headers[-1]['targets'][0]
        assert target['state'] == 'tracking'
        assert Box(*target['box']).iou(scene(rig.index)[2]) > 0.4  # type: ignore[attr-defined]
        assert target['position'] is not None
        assert 0 < target['score'] <= 1
        until(rig, lambda: look.headers[-1].get('values', {}).get('acceptance'))

        look.ask(do='parameter', name='acceptance', value=0.6)
        until(rig, lambda: look.headers[-1]['values'].get('acceptance') == 0.6)
        assert 'acceptance: 0.6' in node.page.parameters_yaml()
        look.ask(do='parameter', name='acceptance', value=7.0)
        until(rig, lambda: any('between' in h['word'] for h in look.headers))
        look.ask(do='step', by=1)
        until(rig, lambda: any('recordings' in h['word'] for h in look.headers))

        look.ask(do='remove', id=target['id'])
        until(rig, lambda: look.headers[-1]['targets'] == [])
        box = scene(rig.index)[2]  # type: ignore[attr-defined]
        look.ask(do='point', x=box.cx, y=box.cy, frame=0)
        until(rig, lambda: look.headers[-1]['targets'])
        assert node.page.boxes_csv().count('tracking') > 2
        look.close()
        until(rig, lambda: rig.color.get_subscription_count() == 1)


def test_several_targets_live_with_names_scores_and_trails(rig: Rig) -> None:
    with running_node(rig, init_box='140,90,36,60'), running_viewer() as (node, server):
        look = Look(server)
        until(rig, lambda: look.headers and look.headers[-1]['targets'])
        first = look.headers[-1]['targets'][0]['id']
        look.ask(do='box', x=20.0, y=100.0, width=40.0, height=60.0, frame=0)
        until(rig, lambda: len(look.headers[-1]['targets']) == 2)
        ids = [t['id'] for t in look.headers[-1]['targets']]
        assert ids[0] == first
        assert all(t['chosen'] for t in look.headers[-1]['targets'])
        look.ask(do='rename', id=ids[1], name='Anna')
        until(rig, lambda: 'Anna' in [t['name'] for t in look.headers[-1]['targets']])
        # Each answer has all of them, with scores and places: the page's trails are made of these.
        entries = [e for h in look.headers for e in h['entries'] if len(e['targets']) == 2]
        assert {t[0] for e in entries for t in e['targets']} == set(ids)
        assert any(t[2] > 0.3 and t[6] is not None for e in entries for t in e['targets'])
        assert all(row.split(',')[0] in map(str, ids) for row in rows(node.page.boxes_csv()))

        until(rig, lambda: 'acceptance' in look.headers[-1]['values'])
        look.ask(do='everyone', value=True)
        until(rig, lambda: look.headers[-1]['everyone'])
        # Who was added stays one who was asked for, also beside everyone.
        until(rig, lambda: [t['chosen'] for t in look.headers[-1]['targets']][:2] == [True, True])
        look.ask(do='follow', id=10**6, frame=0)
        until(rig, lambda: any('not in sight' in h['word'] for h in look.headers))
        look.ask(do='remove', id=first)
        until(rig, lambda: first not in [t['id'] for t in look.headers[-1]['targets']])
        look.close()


def rows(text: str) -> list[str]:
    return text.splitlines()[1:]


def test_the_tracker_goes_on_when_the_viewer_ends(rig: Rig) -> None:
    with running_node(rig, init_box='140,90,36,60'):
        with running_viewer() as (_, server):
            look = Look(server)
            until(rig, lambda: len(look.headers) > 2)
        before = len(rig.boxes)
        until(rig, lambda: len(rig.boxes) > before + 3)


def test_executable_says_where_the_page_is_and_needs_a_token_elsewhere() -> None:
    command = [sys.executable, '-m', 'rgbd_kcf_tracker.ros.viewer_main', '--ros-args', '-p']
    process = subprocess.Popen(
        [*command, 'port:=0'], stderr=subprocess.STDOUT, stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        assert 'open http://127.0.0.1:' in process.stdout.readline()
        process.terminate()
        assert process.wait(30) == 0
    finally:
        process.kill()
        process.wait(10)
    refused = subprocess.run(
        [*command, 'host:=0.0.0.0'], capture_output=True, text=True, timeout=60
    )
    assert refused.returncode == 2
    assert 'ssh -L' in refused.stderr


def test_what_a_command_sets() -> None:
    command = Command('parameter', {'name': 'padding', 'value': 2})
    assert node_parameter(command, 'kcf') == ('kcf.padding', 2.0)
    assert node_parameter(Command('variant', {'name': 'rgbd'}), 'kcf') == ('variant', 'rgbd')
    for bad in (
        Command('variant', {'name': 'mosse'}),
        Command('parameter', {'name': 'padding', 'value': 'wide'}),
        Command('parameter', {'name': 'colour', 'value': 1}),
    ):
        with pytest.raises(ParameterError):
            node_parameter(bad, 'kcf')


def test_states_of_the_answers() -> None:
    page = LivePage('tracker', 10)
    page.answer(1_000_000_000, [Track(None, TrackState.IDLE)])
    page.answer(2_000_000_000, [Track(Box(0, 0, 5, 5), TrackState.TRACKING, 0.9, id=3)])
    page.figures({'track_median_ms': 'nan', 'transport_median_ms': '4.5', 'dropped': '2'})
    page.answer(3_000_000_000, [Track(None, TrackState.OCCLUDED, id=3)])
    page.figures({'dropped': '5'})
    page.answer(4_000_000_000, [Track(None, TrackState.LOST, id=3)])
    page.board.show({}, {})
    entries = page.board.take((-1, 0))[2]['entries']
    assert [e['targets'][0][1] if e['targets'] else '' for e in entries] == [
        '', 'tracking', 'occluded', 'lost',
    ]  # fmt: skip
    assert [e['t'] for e in entries] == [0, 1, 2, 3]
    assert [e.get('dropped', 0) for e in entries] == [0, 0, 0, 3]
    assert [e['transport'] for e in entries] == [0, 0, 4.5, 0]
    assert entries[2]['track'] == 0
    # A looping bag: stamps go back, and the last minute begins anew.
    page.answer(500_000_000, [])
    assert len(page.board.take((-1, 0))[2]['entries']) == 1


def test_a_hidden_target_has_its_ellipse() -> None:
    page = LivePage('tracker', 10)
    hidden = Track(None, TrackState.OCCLUDED, id=3, predicted=(0.5, 0.2, 2.0))
    page.answer(1_000_000_000, [hidden])
    spread = (0.04, 0, 0, 0, 0.01, 0, 0, 0, 0.25)
    page.evidence(1_000_000_000, {3: TargetEvidence(Insight(), covariance=spread)})
    page.image(Frame(np.zeros((24, 32, 3), np.uint8), stamp_ns=1_000_000_000), 1_000_000_000)
    (target,) = page.board.take((-1, 0))[2]['targets']
    x, z, major, minor, _, level = target['ellipse']
    assert (x, z, level) == (0.5, 2.0, 0.2)
    assert (major, minor) == pytest.approx((2.4477 * 0.5, 2.4477 * 0.2), abs=1e-3)
    with pytest.raises(BoxError, match='not in sight'):
        page.box_of(3)
