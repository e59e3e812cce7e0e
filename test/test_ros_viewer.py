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
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")
pytest.importorskip('aiohttp', reason="the page needs aiohttp: pip install '.[view]'")

import aiohttp
import browser as browsers
import numpy as np
import rclpy
from ros_rig import Rig, overrides, play_hidden, running_node, scene, spinning
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from rgbd_kcf_tracker import Box, Frame, Track, TrackState
from rgbd_kcf_tracker.errors import BoxError, ParameterError
from rgbd_kcf_tracker.insight import Considered, Insight, KnownView
from rgbd_kcf_tracker.recordings.evidence_messages import TargetEvidence
from rgbd_kcf_tracker.recordings.messages import stamp_of
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages
from rgbd_kcf_tracker.ros.messages import ROS_TYPES, image_message, stamp_from_ns
from rgbd_kcf_tracker.ros.viewer_node import HELD, ViewerNode
from rgbd_kcf_tracker.view import live_page
from rgbd_kcf_tracker.view.commands import Command
from rgbd_kcf_tracker.view.live_page import LivePage, node_parameter
from rgbd_kcf_tracker.view.server import Server

pytestmark = [pytest.mark.ros, pytest.mark.timeout(180)]


@contextmanager
def made_viewer(**values: Any) -> Iterator[ViewerNode]:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(os.environ['ROS_DOMAIN_ID']))
    node = ViewerNode(context=context, parameter_overrides=overrides({'rate': 60.0, **values}))
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


@contextmanager
def running_viewer(**values: Any) -> Iterator[tuple[ViewerNode, Server]]:
    with made_viewer(**values) as node:
        server = Server(node.page, port=0)
        server.start()
        with spinning(node):
            try:
                yield node, server
            finally:
                server.stop()


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


def until(
    rig: Rig,
    condition: Callable[[], Any],
    seconds: float = 60,
    ask: Callable[[], None] | None = None,
) -> None:
    """Frames go on until a condition holds; asks again every few seconds.

    Discovery is one-sided for a moment: a request may be sent before the tracker hears of it.
    """
    start = asked = time.monotonic()
    if ask is not None:
        ask()
    while not condition():
        now = time.monotonic()
        assert now < start + seconds, condition
        if ask is not None and now > asked + 5:
            ask()
            asked = now
        rig.index = getattr(rig, 'index', -1) + 1  # type: ignore[attr-defined]
        rig.send(rig.index)  # type: ignore[attr-defined]
        time.sleep(0.03)


def test_a_box_from_the_page_starts_the_tracker_and_is_shown(rig: Rig) -> None:
    with running_node(rig), running_viewer() as (node, server):
        assert rig.color.get_subscription_count() == 1  # nobody looks: the images are not asked for
        look = Look(server)
        until(rig, lambda: look.headers and 'points' in look.headers[-1]['blobs'])
        # The first pictures may come before the camera's words, and are seen by a usual one.
        until(rig, lambda: look.headers[-1]['camera'][0] == 290)
        header = look.headers[-1]
        assert header['size'] == [320, 240]
        assert header['targets'] == []

        def drag() -> None:
            box = scene(rig.index)[2]  # type: ignore[attr-defined]
            look.ask(do='box', x=box.x, y=box.y, width=box.width, height=box.height, frame=0)

        until(rig, lambda: look.headers[-1]['targets'], ask=drag)
        until(rig, lambda: look.headers[-1]['targets'][0]['box'])
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

        def click() -> None:
            box = scene(rig.index)[2]  # type: ignore[attr-defined]
            look.ask(do='point', x=box.cx, y=box.cy, frame=0)

        until(rig, lambda: look.headers[-1]['targets'], ask=click)
        assert node.page.boxes_csv().count('tracking') > 2
        look.close()
        until(rig, lambda: rig.color.get_subscription_count() == 1)


def test_several_targets_live_with_names_scores_and_trails(rig: Rig) -> None:
    with running_node(rig, init_box='140,90,36,60'), running_viewer() as (node, server):
        look = Look(server)
        until(rig, lambda: look.headers and look.headers[-1]['targets'])
        first = look.headers[-1]['targets'][0]['id']

        def drag() -> None:
            look.ask(do='box', x=20.0, y=100.0, width=40.0, height=60.0, frame=0)

        until(rig, lambda: len(look.headers[-1]['targets']) == 2, ask=drag)
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


@pytest.mark.skipif(
    browsers.chromium() is None,
    reason='no Chromium: apt-get install chromium (Debian), or name one in RGBD_KCF_CHROMIUM',
)
def test_the_live_page_shows_why_and_where_a_hidden_target_may_be(rig: Rig) -> None:
    """In a real browser, over DDS: candidates with cues, views, rivals, particles, the ellipse."""
    with (
        running_node(rig, queue_policy='all') as node,
        running_viewer() as (_, server),
        browsers.browser() as chromium,
    ):
        assert not node._outputs.wanted('evidence')  # nobody looks
        page = chromium.page()
        page.size(1400, 1000)
        page.open(server.url)
        until(rig, lambda: page.value('typeof page !== "undefined" && page.drawn > 1'))
        until(rig, lambda: node._outputs.wanted('evidence'))

        def choose() -> None:
            box = scene(rig.index)[2]  # type: ignore[attr-defined]
            # Who is followed already is not added again.
            page.value("page.shown.targets.forEach(t => send({do: 'remove', id: t.id}))")
            page.value(
                f"send({{do: 'box', x: {box.x}, y: {box.y}, width: 36, height: 60, frame: 0}})"
            )

        # The view that the target is known by has a picture where its very frame was heard of; the
        # first may not be, for the tracker may know of the viewer before the viewer of it.
        found = '[".candidate", ".views img"].every(e => document.querySelector(e))'
        until(rig, lambda: page.value(found), ask=choose)
        assert node._outputs.wanted('evidence')
        # All of it from one frame: what was taken lies where the box is.
        words, cues = page.value(
            "(() => { const c = document.querySelector('.candidate'); return [c.innerText, "
            "[...c.querySelectorAll('.cue span:first-child')].map(e => e.innerText)]; })()"
        )
        assert 'log-odds' in words
        assert 'look' in cues
        # One that was asked for last may just begin: of its first frame nothing was considered.
        both: list[Any] = []
        weighed = (
            '(t => t && t.box && t.considered?.length ? [t.considered[0].box, t.box] : null)'
            '(page.shown.targets[0])'
        )
        until(rig, lambda: both.append(page.value(weighed)) or both[-1] is not None)
        candidate, target = both[-1]
        assert candidate == pytest.approx(target, abs=0.02)
        assert page.value("document.querySelectorAll('.views b i').length") >= 9
        assert page.value('page.shown.floor') is None  # the scene has none
        page.value(
            'window.sent = []; window.really = send; '
            "send = m => { sent.push(m.do); if (m.do === 'ack') really(m); }"
        )
        x, y = page.value(
            "(b => [b.x, b.y])(document.getElementById('picture').getBoundingClientRect())"
        )
        page.drag((x + 20, y + 20), (x + 60, y + 80))
        assert [kind for kind in page.value('sent') if kind != 'ack'] == ['box']
        page.value('send = really')
        at = rig.index + 1  # type: ignore[attr-defined]
        play_hidden(rig, range(at, at + 20))
        # In the very first hidden frame there are none yet.
        page.until('(page.shown.targets[0].particles || []).length > 50')
        assert page.value('page.shown.targets[0].state') != 'tracking'
        assert page.value('page.shown.targets[0].ellipse.length') == 6
        confused = page.value('page.entries.map(e => e.targets[0] ? e.targets[0][3] : 0)')
        assert all(0 <= share <= 1 for share in confused)
        # No pictures any more: the page says so, until they come again.
        page.until("document.getElementById('banner').innerText.includes('No picture for')")
        assert page.value("document.getElementById('state').innerText") == 'no pictures'
        said = page.value("document.getElementById('no-targets').innerText")
        assert said == 'The pictures have stopped.'
        assert page.value('page.shown.targets.length') == 0
        assert page.value("document.querySelectorAll('#targets li').length") == 0
        play_hidden(rig, range(at + 20, at + 23))
        page.until("document.getElementById('banner').hidden")
        assert page.value("document.getElementById('state').innerText") != 'no pictures'
        assert page.errors == []
        page.open('about:blank')
        rig.wait(lambda: not node._outputs.wanted('evidence'))


def rows(text: str) -> list[str]:
    return text.splitlines()[1:]


@pytest.mark.usefixtures('rig')
def test_of_a_box_from_the_page_the_part_in_the_picture_is_asked_for() -> None:
    with running_viewer() as (node, _):
        asked: list[Any] = []
        node._add.publish = asked.append
        node._add.get_subscription_count = lambda: 1

        def box(*values: float) -> Command:
            return Command('box', dict(zip(('x', 'y', 'width', 'height'), values, strict=True)))

        with pytest.raises(ParameterError, match='no picture has come yet'):
            node._carry_out(box(10, 10, 20, 20))
        node.page.image(Frame(np.zeros((240, 320, 3), np.uint8)), 1)
        for values in ((-30, 10, 50, 40), (300, 200, 2**32, 2**32), (5, 6, 7, 8)):
            node._carry_out(box(*values))
        assert [(r.x_offset, r.y_offset, r.width, r.height) for r in asked] == [
            (0, 10, 20, 40), (300, 200, 20, 40), (5, 6, 7, 8),
        ]  # fmt: skip
        for values in ((-30, 10, 20, 40), (400, 10, 20, 40)):
            with pytest.raises(ParameterError, match='outside the picture'):
                node._carry_out(box(*values))


@pytest.mark.usefixtures('rig')
def test_what_no_tracker_hears_is_said() -> None:
    with made_viewer(tracker='nobody') as node:
        node.page.image(Frame(np.zeros((240, 320, 3), np.uint8)), 1)
        node.page.answer(1, [Track(Box(5, 6, 7, 8), TrackState.TRACKING, id=1)])
        for command in (
            Command('box', {'x': 5, 'y': 6, 'width': 7, 'height': 8}),
            Command('follow', {'id': 1}),
            Command('remove', {'id': 1}),
            Command('everyone', {'value': True}),
        ):
            with pytest.raises(ParameterError, match='/nobody does not answer: is it running'):
                node._carry_out(command)


@pytest.mark.usefixtures('rig')
@pytest.mark.parametrize(('rectified', 'focal'), [('auto', 300.0), ('yes', 280.0)])
def test_the_room_has_the_camera_that_the_tracker_is_told_of(rectified: str, focal: float) -> None:
    k = [300.0, 0.0, 160.0, 0.0, 300.0, 120.0, 0.0, 0.0, 1.0]
    p = [280.0, 0.0, 160.0, 0.0, 0.0, 280.0, 120.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    with made_viewer(color_rectified=rectified) as node:
        node._on_info(CameraInfo(width=320, height=240, k=k, p=p))
        assert node._camera is not None
        assert node._camera.intrinsics.fx == focal


def shown_by(node: ViewerNode, monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, bool]]:
    """Stamps of the images that a watched page is given from now on, and whether with depth."""
    node.page.board.watch(lambda: None)
    shown: list[tuple[int, bool]] = []
    monkeypatch.setattr(  # due at any time
        node.page, 'image', lambda frame, stamp: shown.append((stamp, frame.depth is not None))
    )
    return shown


@pytest.mark.usefixtures('rig')
@pytest.mark.parametrize('answers_after', [None, 0, 1, 3])
def test_images_are_shown_as_they_come(
    answers_after: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With nobody who answers, and with a tracker that answers so many images later."""
    with made_viewer() as node:
        shown = shown_by(node, monkeypatch)
        color, depth, _ = scene(0)
        headers = [Header(stamp=stamp_from_ns(number * 16_000_000)) for number in range(1, 21)]
        for number, header in enumerate(headers):
            node._on_color(image_message(header, color, 'bgr8'))
            node._on_depth(image_message(header, depth, '16UC1'))
            if answers_after is not None and number >= answers_after:
                answer = TrackMessages(ROS_TYPES).state(headers[number - answers_after], [])
                node._on_state(answer, {'publication_sequence_number': None})
        stamps = [stamp_of(SimpleNamespace(header=header)) for header in headers]
        answered = stamps[: len(stamps) - (answers_after or 0)]
        assert shown[-15:] == [(stamp, True) for stamp in answered][-15:]


@pytest.mark.usefixtures('rig')
def test_images_go_on_at_the_rate_of_the_camera_when_depth_stops(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Those that would wait for it wait once; when it comes again it is shown again."""
    with made_viewer() as node:
        shown = shown_by(node, monkeypatch)
        color, depth, _ = scene(0)
        for number in range(40):
            header = Header(stamp=stamp_from_ns(number * 33_000_000))
            node._on_color(image_message(header, color, 'bgr8'))
            if number == 9 + HELD:
                node._show_what_is_due()  # as the timer does
            if not 10 <= number < 30:
                node._on_depth(image_message(header, depth, '16UC1'))
        numbers = [(stamp // 33_000_000, deep) for stamp, deep in shown]
        # Before the first depth comes nothing waits.
        assert numbers[:10] == [(0, False), *((n, True) for n in range(1, 10))]
        assert numbers[10:-10] == [(n, False) for n in range(9 + HELD, 31)]
        assert numbers[-10:] == [(n, True) for n in range(30, 40)]


@pytest.mark.parametrize(('rate', 'expected'), [(10, 10), (20, 20), (60, 30)])
def test_the_rate_that_is_asked_for_is_reached(
    rate: float, expected: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, shown = [1000.0], 0
    monkeypatch.setattr(live_page.time, 'monotonic', lambda: clock[0])
    page = LivePage('tracker', rate)
    page.board.watch(lambda: None)
    for number in range(300):  # ten seconds of a camera at 30 Hz, not quite in time
        clock[0] = 1000 + number / 30 - (0.003 if number % 2 else 0)
        if page.due():
            page.image(Frame(np.zeros((12, 16, 3), np.uint8)), number)
            shown += 1
    assert abs(shown - 10 * expected) <= 2


def test_a_tracker_that_is_configured_anew_follows_others(rig: Rig) -> None:
    """Its ids begin at 1 again: nobody has the name of who was there before."""
    with running_node(rig, init_box='140,90,36,60') as tracker, running_viewer() as (_, server):
        look = Look(server)

        def name() -> str:
            return look.headers[-1]['targets'][0]['name'] if answered() else ''

        def answered() -> bool:
            return bool(look.headers and look.headers[-1]['targets'])

        until(rig, answered)
        look.ask(do='rename', id=1, name='Anna')
        until(rig, lambda: name() == 'Anna')
        tracker.trigger_deactivate()
        tracker.trigger_activate()
        seen = len(look.headers)
        until(rig, lambda: len(look.headers) > seen + 5 and answered())
        assert name() == 'Anna'
        tracker.trigger_deactivate()
        tracker.trigger_cleanup()
        tracker.autostart()
        until(rig, lambda: name() == 'target 1')
        look.close()


def test_the_tracker_goes_on_when_the_viewer_ends(rig: Rig) -> None:
    with running_node(rig, init_box='140,90,36,60'):
        with running_viewer() as (_, server):
            look = Look(server)
            until(rig, lambda: len(look.headers) > 2)
        before = len(rig.boxes)
        until(rig, lambda: len(rig.boxes) > before + 3)


def test_a_silent_tracker_is_said_and_its_last_box_taken_away(rig: Rig) -> None:
    with running_viewer() as (_, server):
        look = Look(server)
        with running_node(rig, init_box='140,90,36,60'):
            until(rig, lambda: look.headers and look.headers[-1]['targets'])
            assert not look.headers[-1]['silent']
        until(rig, lambda: look.headers[-1]['silent'])
        assert look.headers[-1]['targets'] == []
        with running_node(rig, init_box='140,90,36,60'):
            until(rig, lambda: look.headers[-1]['targets'])
        look.close()


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
        Command('parameter', {'name': 'self', 'value': 1}),
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
    # The node says nothing of what has not happened: the first that is dropped counts.
    page.figures({'track_median_ms': '1'})
    page.figures({'track_median_ms': '1', 'dropped': '2'})
    page.answer(5_000_000_000, [])
    page.board.show({}, {})
    assert page.board.take((-1, 0))[2]['entries'][-1]['dropped'] == 2
    # A looping bag: stamps go back, and the last minute begins anew.
    page.answer(500_000_000, [])
    assert len(page.board.take((-1, 0))[2]['entries']) == 1


@pytest.mark.parametrize('stamp', [0, 10**18])
def test_without_a_clock_the_last_minute_is_told_by_arrival(
    stamp: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or the page would keep all there ever was, and trails would never end."""
    now_ns = [10**15]
    monkeypatch.setattr(live_page.time, 'monotonic_ns', lambda: now_ns[0])
    page = LivePage('tracker', 10)
    for _ in range(1000):
        now_ns[0] += 250_000_000
        page.answer(stamp, [Track(Box(0, 0, 5, 5), TrackState.TRACKING, 0.9, id=3)])
    page.image(frame_at(stamp), stamp)
    header = page.board.take((-1, 0))[2]
    assert [e['t'] for e in header['entries']] == [n / 4 for n in range(759, 1000)]
    assert header['time'] == 249.75


def test_an_image_has_the_time_of_its_answer_or_goes_on_from_the_last() -> None:
    page = LivePage('tracker', 10)

    def time_of(stamp: int) -> float:
        page.image(frame_at(stamp), stamp)
        return float(page.board.take((-1, 0))[2]['time'])

    assert time_of(5 * 10**9) == 0  # nobody has answered yet
    for stamp in (10**9, 2 * 10**9, 10**9, 2 * 10**9):  # a bag that loops
        page.answer(stamp, [])
    assert time_of(2 * 10**9) == 1
    assert time_of(4 * 10**9) == 3


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


def looks(view: int, **more: Any) -> dict[int, TargetEvidence]:
    """Evidence of target 3, whose gallery has so many views."""
    views = tuple(KnownView(((0.1 * n, 0.5, 0.5),), 1.8) for n in range(view))
    return {3: TargetEvidence(Insight(gallery=views, **more))}


def frame_at(stamp: int) -> Frame:
    return Frame(np.full((60, 80, 3), 90, np.uint8), stamp_ns=stamp)


def test_evidence_and_answer_make_one_entry_whichever_comes_first() -> None:
    page = LivePage('tracker', 10)
    here, there = Box(0, 0, 20, 40), Box(50, 0, 20, 40)
    tracks = [
        Track(here, TrackState.TRACKING, 0.9, id=3),
        Track(there, TrackState.TRACKING, 0.8, id=5),
    ]
    weighed = (Considered(here, 0.9, {'look': 2.0}), Considered(there, 0.4, {'look': -0.4}))
    evidence = looks(1, considered=weighed, response=0.7)
    page.answer(1, tracks)  # nothing is known of evidence yet: noted at once
    page.evidence(1, evidence)
    page.answer(2, tracks)
    page.evidence(2, evidence)
    page.evidence(3, evidence)
    assert not page.complete(3)
    page.answer(3, tracks)
    page.answer(4, tracks)  # its evidence is lost
    assert not page.complete(4)
    page.answer(5, tracks)
    page.evidence(5, evidence)
    assert page.complete(5)
    page.board.show({}, {})
    entries = page.board.take((-1, 0))[2]['entries']
    assert [e['targets'][0][3:6] for e in entries] == [
        (0.0, None, None), (0.4, 5, 0.7), (0.4, 5, 0.7), (0.0, None, None), (0.4, 5, 0.7),
    ]  # fmt: skip
    page.image(frame_at(5), 5)
    first, second = page.board.take((-1, 0))[2]['targets']
    assert [c['cues'] for c in first['considered']] == [{'look': 2.0}, {'look': -0.4}]
    assert 'considered' not in second


def test_a_recording_that_starts_anew_starts_the_last_minute_anew() -> None:
    """Also where it starts with the very stamp that the page saw first."""
    page = LivePage('tracker', 10)
    for stamp in (0, 10**9, 2 * 10**9, 0):
        page.answer(stamp, [Track(Box(0, 0, 20, 40), TrackState.TRACKING, 0.9, id=3)])
    page.answer(10**9, [Track(None, TrackState.OCCLUDED, id=3)])
    page.board.show({}, {})
    assert [e['t'] for e in page.board.take((-1, 0))[2]['entries']] == [0.0, 1.0]
    with pytest.raises(BoxError, match='not in sight'):
        page.box_of(3)


def test_views_have_the_pictures_that_they_are_of_or_none() -> None:
    """Whoever opens the page late sees by what a target is known, but no picture of another day."""
    page = LivePage('tracker', 10)

    def moment(stamp: int, views: int) -> list[bool]:
        page.answer(stamp, [Track(Box(10, 10, 20, 40), TrackState.TRACKING, 0.9, id=3)])
        page.evidence(stamp, looks(views))
        page.image(frame_at(stamp), stamp)
        shown = page.board.take((-1, 0))[2]['targets'][0]['colors']
        assert len(shown) == views
        blobs = page.board.take((-1, 0))[3]
        return [f'view_3_{n}' in blobs for n in range(views)]

    assert moment(10**9, 2) == [False, False]
    assert moment(2 * 10**9, 3) == [False, False, True]
    fresh = LivePage('tracker', 10)
    fresh.answer(1, [])
    page = fresh
    assert moment(2, 1) == [True]
    # An image from long after a view came up is no picture of it.
    page.answer(7, [Track(Box(10, 10, 20, 40), TrackState.TRACKING, 0.9, id=3)])
    page.evidence(7, looks(2))
    assert moment(10**10, 2) == [True, False]


def test_the_first_sight_is_shown_of_a_tracker_that_keeps_no_views() -> None:
    page = LivePage('tracker', 10)

    def moment(stamp: int) -> bytes | None:
        page.answer(stamp, [Track(Box(10, 10, 20, 40), TrackState.TRACKING, 0.9, id=1)])
        page.evidence(stamp, {1: TargetEvidence(Insight(response=0.5))})
        picture = frame_at(stamp)
        picture.color[:] = stamp % 251
        page.image(picture, stamp)
        blob = page.board.take((-1, 0))[3].get('view_1_0')
        return None if blob is None else bytes(blob)

    assert moment(10**9) is None  # it was there before us
    page.answer(2 * 10**9, [])
    first = moment(3 * 10**9)
    assert first is not None
    assert moment(5 * 10**9 + 100) == first
    # The tracker was started anew: its target 1 is somebody else.
    page.answer(6 * 10**9, [])
    assert moment(7 * 10**9 + 50) not in (None, first)
