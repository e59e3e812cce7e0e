# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Who is answered, and with what: the viewer's server over real HTTP and WebSockets."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import struct
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip('aiohttp', reason="the page needs aiohttp: pip install '.[view]'")
import aiohttp

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.view import server as module
from rgbd_kcf_tracker.view.board import Board
from rgbd_kcf_tracker.view.commands import Command, parse
from rgbd_kcf_tracker.view.server import COOKIE, Server, is_loopback
from rgbd_kcf_tracker.view.showing import pack

TOKEN = 'correct horse'


class Stub:
    """A controller that keeps what it is asked."""

    def __init__(self) -> None:
        self.board = Board()
        self.asked: list[Command] = []

    def do(self, command: Command) -> None:
        self.asked.append(command)

    def description(self) -> dict[str, Any]:
        return {'title': 'stub', 'live': False, 'frames': 3, 'variants': [], 'several': True}

    def boxes_csv(self) -> str:
        return 'id,frame\n'

    def parameters_yaml(self) -> str:
        return 'a: 1\n'


@pytest.fixture
def stub() -> Stub:
    return Stub()


@pytest.fixture
def server(stub: Stub, request: pytest.FixtureRequest) -> Iterator[Server]:
    token = getattr(request, 'param', '')
    made = Server(stub, port=0, token=token)
    made.start()
    yield made
    made.stop()


def run(action: Callable[[aiohttp.ClientSession], Awaitable[Any]]) -> Any:
    async def main() -> Any:
        jar = aiohttp.CookieJar(unsafe=True)
        async with aiohttp.ClientSession(cookie_jar=jar) as session:
            return await asyncio.wait_for(action(session), 30)

    return asyncio.run(main())


def within(seconds: float, condition: Callable[[], Any]) -> bool:
    """Whether a condition comes to hold in that time."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def header_of(packet: bytes) -> dict[str, Any]:
    (length,) = struct.unpack_from('<I', packet)
    return dict(json.loads(packet[4 : 4 + length]))


def origin(server: Server) -> str:
    return server.url.rstrip('/')


def test_page_is_served_with_headers_that_keep_others_out(server: Server) -> None:
    async def ask(session: aiohttp.ClientSession) -> None:
        for path, kind in (
            ('', 'text/html'),
            ('page.js', 'text/javascript'),
            ('page.css', 'text/css'),
        ):
            async with session.get(server.url + path) as answer:
                assert answer.status == 200
                assert answer.content_type == kind
                assert "frame-ancestors 'none'" in answer.headers['Content-Security-Policy']
                assert answer.headers['X-Content-Type-Options'] == 'nosniff'
        async with session.get(server.url + 'boxes.csv') as answer:
            assert 'attachment' in answer.headers['Content-Disposition']
        async with session.get(server.url + '../setup.py') as answer:
            assert answer.status == 404

    run(ask)


@pytest.mark.parametrize('host', ['evil.example', 'evil.example:8080', '10.0.0.7', ''])
def test_another_name_for_this_machine_is_refused(server: Server, host: str) -> None:
    """DNS rebinding: the browser is told that evil.example is 127.0.0.1."""

    async def ask(session: aiohttp.ClientSession) -> None:
        async with session.get(server.url, headers={'Host': host}) as answer:
            assert answer.status in (400, 403)
            assert '<canvas' not in await answer.text()

    run(ask)


@pytest.mark.parametrize(
    'origin', ['http://evil.example', 'null', 'http://127.0.0.1:1', 'file://', None]
)
def test_a_socket_opens_only_for_the_page_itself(server: Server, origin: str | None) -> None:
    async def ask(session: aiohttp.ClientSession) -> None:
        headers = {} if origin is None else {'Origin': origin}
        with pytest.raises(aiohttp.WSServerHandshakeError, match='403'):
            await session.ws_connect(server.url + 'socket', headers=headers)

    run(ask)


def test_newest_moment_comes_only_when_the_last_is_drawn(server: Server, stub: Stub) -> None:
    async def ask(session: aiohttp.ClientSession) -> list[dict[str, Any]]:
        socket = await session.ws_connect(server.url + 'socket', origin=origin(server))
        assert (await socket.receive_json())['hello']['title'] == 'stub'
        for frame in range(5):
            stub.board.note({'t': frame / 10, 'frame': frame})
            stub.board.show({'frame': frame}, {})
            await asyncio.sleep(0.02)
        came = [header_of((await socket.receive()).data)]
        with pytest.raises(asyncio.TimeoutError):
            await socket.receive(timeout=0.2)
        await socket.send_json({'do': 'ack'})
        came.append(header_of((await socket.receive()).data))
        return came

    first, second = run(ask)
    # What lay between is not queued, but its figures are not lost either.
    assert second['frame'] == 4
    entries = [e['frame'] for e in first['entries'] + second['entries']]
    assert entries == [0, 1, 2, 3, 4]
    assert (first['anew'], second['anew']) == (True, False)


def test_two_browsers_see_the_same_and_one_that_sleeps_holds_nobody(
    server: Server, stub: Stub
) -> None:
    async def ask(session: aiohttp.ClientSession) -> int:
        asleep = await session.ws_connect(server.url + 'socket', origin=origin(server))
        awake = await session.ws_connect(server.url + 'socket', origin=origin(server))
        await awake.receive_json()
        last = -1
        for frame in range(20):
            begun = time.monotonic()
            stub.board.show({'frame': frame}, {'color': b'x' * 200_000})
            assert time.monotonic() - begun < 0.5  # nobody who looks can hold the tracker up
            last = header_of((await awake.receive()).data)['frame']
            await awake.send_json({'do': 'ack'})
        await asleep.close()
        return last

    assert run(ask) == 19
    deadline = time.monotonic() + 5
    while stub.board.watched and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not stub.board.watched


@pytest.mark.parametrize(
    'message',
    [
        '', 'not json', '[]', '{}', '{"do": 1}', '{"do": "rm -rf"}', '{"do": "seek"}',
        '{"do": "seek", "frame": "1"}', '{"do": "seek", "frame": 1, "more": 2}',
        '{"do": "seek", "frame": 1e999}', '{"do": "seek", "frame": true}',
        '{"do": "box", "x": NaN, "y": 0, "width": 1, "height": 1, "frame": 0}',
        '{"do": "box", "x": 1e400, "y": 0, "width": 1, "height": 1, "frame": 0}',
        '{"do": "parameter", "name": "cells", "value": [1]}',
        '{"do": "parameter", "name": "cells", "value": {"a": 1}}',
        '[' * 2000 + ']' * 2000,
    ],
)  # fmt: skip
def test_hostile_messages_are_refused_and_nothing_ends(
    server: Server, stub: Stub, message: str
) -> None:
    async def ask(session: aiohttp.ClientSession) -> None:
        socket = await session.ws_connect(server.url + 'socket', origin=origin(server))
        await socket.receive_json()
        await socket.send_str(message)
        assert 'refused' in await socket.receive_json()
        await socket.send_json({'do': 'pause'})
        await socket.send_json({'do': 'seek', 'frame': 2})
        for _ in range(100):
            if len(stub.asked) == 2:
                break
            await asyncio.sleep(0.02)

    run(ask)
    assert [c.do for c in stub.asked] == ['pause', 'seek']


def test_large_binary_and_too_many_messages_end_only_their_own_socket(
    server: Server, stub: Stub
) -> None:
    async def ask(session: aiohttp.ClientSession) -> list[int | None]:
        codes = []
        for send in (
            lambda s: s.send_str('x' * 100_000),
            lambda s: s.send_bytes(b'\0' * 10),
        ):
            socket = await session.ws_connect(server.url + 'socket', origin=origin(server))
            await socket.receive_json()
            await send(socket)
            while not socket.closed:
                await socket.receive(timeout=5)
            codes.append(socket.close_code)
        socket = await session.ws_connect(server.url + 'socket', origin=origin(server))
        for _ in range(200):
            if socket.closed:
                break
            await socket.send_json({'do': 'pause'})
        while not socket.closed:
            await socket.receive(timeout=5)
        codes.append(socket.close_code)
        async with session.get(server.url) as answer:
            assert answer.status == 200
        return codes

    assert run(ask) == [1009, 1003, 1008]


def test_only_so_many_browsers(server: Server) -> None:
    async def ask(session: aiohttp.ClientSession) -> None:
        held = [
            await session.ws_connect(server.url + 'socket', origin=origin(server))
            for _ in range(16)
        ]
        with pytest.raises(aiohttp.WSServerHandshakeError, match='503'):
            await session.ws_connect(server.url + 'socket', origin=origin(server))
        await held[0].close()
        for _ in range(1000):  # until the server has seen it
            with contextlib.suppress(aiohttp.WSServerHandshakeError):
                await session.ws_connect(server.url + 'socket', origin=origin(server))
                return
            await asyncio.sleep(0.01)
        pytest.fail('nobody is let in where somebody left')

    run(ask)


@pytest.mark.parametrize('server', [TOKEN], indirect=True)
def test_nothing_is_shown_before_the_token_is_given(server: Server, stub: Stub) -> None:
    stub.board.show({'frame': 0}, {})

    async def ask(session: aiohttp.ClientSession) -> None:
        named = {'Origin': origin(server)}
        async with session.get(server.url) as answer:
            assert answer.status == 401
            assert '<canvas' not in await answer.text()
        for path in ('boxes.csv', 'parameters.yaml', 'page.js', 'room.js'):
            async with session.get(server.url + path) as answer:
                assert answer.status == 401
        with pytest.raises(aiohttp.WSServerHandshakeError, match='401'):
            await session.ws_connect(server.url + 'socket', headers=named)
        begun = time.monotonic()
        async with session.post(
            server.url + 'login', data={'token': 'wrong horse'}, headers=named
        ) as answer:
            assert answer.status == 401
            assert 'not the token' in await answer.text()
        assert time.monotonic() - begun >= 0.9
        async with session.post(server.url + 'login', data={'token': TOKEN}) as answer:
            assert answer.status == 403  # a form of nobody knows where
        async with session.post(
            server.url + 'login', data={'token': TOKEN}, headers=named
        ) as answer:
            assert answer.status == 200
            assert '<canvas' in await answer.text()
        (cookie,) = (c for c in session.cookie_jar if c.key.startswith(COOKIE))
        assert cookie['httponly']
        assert cookie['samesite'] == 'Strict'
        assert TOKEN not in cookie.value
        socket = await session.ws_connect(server.url + 'socket', headers=named)
        assert 'hello' in await socket.receive_json()

    run(ask)


@pytest.mark.parametrize('server', [TOKEN], indirect=True)
def test_guessing_many_tokens_at_once_is_no_faster(server: Server) -> None:
    async def ask(session: aiohttp.ClientSession) -> None:
        async def guess(token: str) -> int:
            async with session.post(
                server.url + 'login', data={'token': token}, headers={'Origin': origin(server)}
            ) as answer:
                return answer.status

        first = asyncio.ensure_future(guess('wrong horse'))
        await asyncio.sleep(0.3)
        guesses = await asyncio.gather(*(guess(f'horse {i}') for i in range(20)), guess(TOKEN))
        assert set(guesses) == {429}
        assert await first == 401
        assert await guess(TOKEN) == 200

    run(ask)


@pytest.mark.parametrize('server', [TOKEN], indirect=True)
def test_a_login_too_large_is_refused(server: Server) -> None:
    async def ask(session: aiohttp.ClientSession) -> None:
        async with session.post(
            server.url + 'login', data={'token': 'x' * 10_000}, headers={'Origin': origin(server)}
        ) as answer:
            assert answer.status == 413

    run(ask)


def answer_to(server: Server, request: bytes) -> bytes:
    """The first line of what comes back, or b'' where the connection is closed."""
    host, _, port = server.url.split('/')[2].rpartition(':')
    place = f'{host}:{port}'.encode()
    with socket.create_connection((host, int(port)), timeout=20) as connection:
        connection.sendall(request.replace(b'HERE', place).replace(b'PORT', port.encode()))
        with connection.makefile('rb') as lines:
            return lines.readline()


FORM = b'POST /login HTTP/1.1\r\nHost: HERE\r\nOrigin: http://HERE\r\n'


@pytest.mark.parametrize('server', [TOKEN], indirect=True)
@pytest.mark.parametrize(
    'request_',
    [
        b'GET / HTTP/1.1\r\nHost: [::1\r\n\r\n',
        b'GET / HTTP/1.1\r\nHost: 127.0.0.1:99999\r\n\r\n',
        b'GET / HTTP/1.1\r\nHost: HERE\r\nOrigin: http://[::1\r\n\r\n',
        b'GET /boxes.csv HTTP/1.1\r\nHost: HERE\r\nOrigin: http://HERE/\r\n'
        b'Cookie: rgbd_kcf_view_PORT=\xff\xfe\r\n\r\n',
        FORM + b'Content-Type: multipart/form-data\r\nContent-Length: 5\r\n\r\nhello',
        FORM + b'Content-Type: multipart/form-data; boundary=x\r\nContent-Length: 5\r\n\r\nhello',
        FORM + b'Content-Type: application/x-www-form-urlencoded; charset=none\r\n'
        b'Content-Length: 7\r\n\r\ntoken=x',
        FORM + b'Content-Type: application/x-www-form-urlencoded\r\nContent-Encoding: gzip\r\n'
        b'Content-Length: 7\r\n\r\ntoken=x',
        FORM + b'Content-Type: multipart/form-data; boundary=x\r\nContent-Length: 95\r\n\r\n--x\r\n'
        b'Content-Disposition: form-data; name="token"\r\nContent-Transfer-Encoding: odd\r\n\r\n'
        b'a\r\n--x--\r\n',
    ],
)
def test_a_request_that_is_garbage_is_no_error_of_ours(server: Server, request_: bytes) -> None:
    assert answer_to(server, request_).split()[1].startswith(b'4')


def test_a_form_that_never_ends_holds_no_connection(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, 'FORM_S', 0.1)
    kind = b'Content-Type: application/x-www-form-urlencoded\r\nContent-Length: 1000\r\n\r\n'
    assert b' 408 ' in answer_to(server, FORM + kind + b'token=')


@pytest.mark.parametrize('server', [TOKEN], indirect=True)
@pytest.mark.parametrize(
    'words',
    [b'', b'GET / HTTP/1.1\r\nX-Half: ', b'GET /page.css HTTP/1.1\r\nHost: HERE\r\n\r\n' * 2000],
    ids=['silent', 'half a header', 'reads no answer'],
)
def test_a_stranger_holds_no_connection(
    server: Server, words: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As many as files may be open would keep everybody else out."""
    monkeypatch.setattr(module, 'QUIET_S', 0.5)
    host, _, port = server.url.split('/')[2].partition(':')
    with socket.create_connection((host, int(port)), 20) as stranger:
        stranger.sendall(words)
        assert within(5, lambda: server._runner.server.connections)
        assert within(5, lambda: not server._runner.server.connections)


@pytest.mark.parametrize('server', [TOKEN], indirect=True)
def test_who_gave_the_token_stays(
    server: Server, stub: Stub, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, 'QUIET_S', 0.1)

    async def ask(session: aiohttp.ClientSession) -> None:
        named = {'Origin': origin(server)}
        await session.post(server.url + 'login', data={'token': TOKEN}, headers=named)
        looking = await session.ws_connect(server.url + 'socket', headers=named)
        await looking.receive_json()
        await asyncio.sleep(2.5 * module.ROUND_S)
        stub.board.show({'frame': 7}, {})
        assert header_of((await looking.receive()).data)['frame'] == 7

    run(ask)


@pytest.mark.parametrize('server', [TOKEN], indirect=True)
def test_two_viewers_on_one_host_log_nobody_out(server: Server) -> None:
    async def ask(session: aiohttp.ClientSession) -> None:
        for at, token in ((server, TOKEN), (other, 'another horse')):
            named = {'Origin': origin(at)}
            await session.post(at.url + 'login', data={'token': token}, headers=named)
        for at in (server, other):
            async with session.get(at.url + 'boxes.csv') as answer:
                assert answer.status == 200
        # Of two tunnels to the same port elsewhere the browser's own ports tell.
        named = {'Host': 'localhost:9001', 'Origin': 'http://localhost:9001'}
        async with session.post(
            server.url + 'login', data={'token': TOKEN}, headers=named, allow_redirects=False
        ) as answer:
            assert list(answer.cookies) == [f'{COOKIE}_9001']

    with module.serving(Stub(), '127.0.0.1', 0, 'another horse') as other:
        run(ask)


def test_the_end_waits_for_no_browser_that_sleeps(server: Server) -> None:
    """As one that was let go for being too slow: it does not answer that, either."""
    host, _, port = server.url.split('/')[2].partition(':')
    words = (
        f'GET /socket HTTP/1.1\r\nHost: {host}:{port}\r\nOrigin: {origin(server)}\r\n'
        'Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n'
        'Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n'
    )
    with socket.create_connection((host, int(port)), 20) as asleep:
        asleep.sendall(words.encode())
        assert b' 101 ' in asleep.recv(4096)
        asleep.sendall(b'\x82\x81\0\0\0\0x')  # binary: it is let go
        while b'only text' not in asleep.recv(4096):
            pass
        begun = time.monotonic()
        server.stop()
        assert time.monotonic() - begun < 8  # not the ten seconds that aiohttp would wait


def test_the_end_waits_for_nobody_who_reads_slowly_or_sends_half_a_form(
    server: Server, stub: Stub, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stub, 'boxes_csv', lambda: 'id,frame\n' * 2_000_000)
    host, _, port = server.url.split('/')[2].partition(':')
    place = f'{host}:{port}'.encode()
    kind = b'Content-Type: application/x-www-form-urlencoded\r\nContent-Length: 1000\r\n\r\n'
    with (
        socket.create_connection((host, int(port)), 20) as slow,
        socket.create_connection((host, int(port)), 20) as half,
    ):
        slow.sendall(b'GET /boxes.csv HTTP/1.1\r\nHost: HERE\r\n\r\n'.replace(b'HERE', place))
        assert b' 200 ' in slow.recv(100)
        half.sendall((FORM + kind + b'token=').replace(b'HERE', place))
        time.sleep(0.2)  # until it is being read
        begun = time.monotonic()
        server.stop()
        assert time.monotonic() - begun < 3
        assert not asyncio.all_tasks(server._loop)


def test_the_same_trouble_is_told_once(server: Server, caplog: pytest.LogCaptureFixture) -> None:
    """asyncio has much to say where there are more connections than files may be open."""
    told = threading.Event()
    for _ in range(100):
        trouble = {'message': 'out of files', 'exception': OSError(24, 'Too many open files')}
        server._loop.call_soon_threadsafe(server._loop.call_exception_handler, trouble)
    server._loop.call_soon_threadsafe(told.set)
    assert told.wait(20)
    # The garbage collector may have something to say of another test's tasks meanwhile.
    told_of = [text for text in caplog.messages if 'out of files' in text]
    assert told_of == ['viewer: out of files: [Errno 24] Too many open files']
    assert caplog.records[0].exc_info is None


def test_other_addresses_need_a_token_that_is_long_enough(stub: Stub) -> None:
    for host in ('0.0.0.0', '192.168.1.5', '::', 'robot.local'):
        with pytest.raises(ParameterError, match=r'a token in RGBD_KCF_TOKEN.*ssh -L'):
            Server(stub, host=host)
    with pytest.raises(ParameterError, match='too short'):
        Server(stub, host='0.0.0.0', token='1234')
    assert is_loopback('127.0.0.9')
    assert not is_loopback('127.0.0.1.evil.example')


def test_a_port_that_is_taken_is_said(server: Server, stub: Stub) -> None:
    port = int(server.url.rsplit(':', 1)[1].strip('/'))
    with pytest.raises(ParameterError, match='name another port'):
        Server(stub, port=port).start()
    with pytest.raises(ParameterError, match=r'must be 0-65535; name another port'):
        Server(stub, port=99999).start()


@pytest.mark.parametrize('host', ['nope.invalid', 'a' * 80])
def test_a_host_that_is_none_is_said(stub: Stub, host: str) -> None:
    with pytest.raises(ParameterError, match=f"'{host}' is no name .* another host"):
        Server(stub, host=host, token='long enough').start()


@pytest.mark.parametrize('width', [2**32 - 50, 4294967246.0])
def test_a_number_is_taken_however_it_is_written(width: float) -> None:
    box = {'do': 'box', 'x': 1, 'y': 2, 'width': width, 'height': 3, 'frame': 0}
    assert parse(json.dumps(box)).values['width'] == 4294967246.0


@pytest.mark.parametrize('width', ['9' * 400, '-1' + '0' * 17, '1e17', '1e999'])
def test_a_number_out_of_range_is_called_so(width: str) -> None:
    box = f'{{"do": "box", "x": 1, "y": 2, "width": {width}, "height": 3, "frame": 0}}'
    with pytest.raises(ParameterError, match='box: width is out of range'):
        parse(box)


def test_commands_are_typed() -> None:
    box = '{"do": "box", "x": 1, "y": 2.5, "width": 3, "height": 4, "frame": 7}'
    assert parse(box).values == {'x': 1.0, 'y': 2.5, 'width': 3.0, 'height': 4.0, 'frame': 7}
    assert parse('{"do": "rename", "id": 1, "name": "  Ada  "}').values['name'] == 'Ada'
    long = json.dumps({'do': 'rename', 'id': 1, 'name': 'x' * 1000})
    assert len(parse(long).values['name']) == 40


def test_board_keeps_a_minute_and_begins_anew_when_rewound() -> None:
    board = Board()
    for second in range(100):
        board.note({'t': float(second)})
    board.show({}, {})
    _, since, header, _ = board.take((-1, 0))
    assert [e['t'] for e in header['entries']] == [float(t) for t in range(39, 100)]
    board.rewind([{'t': 5.0}])
    _, since, header, _ = board.take(since)
    assert (header['anew'], header['entries']) == (True, [{'t': 5.0}])
    assert board.take(since)[2]['entries'] == []


def test_board_from_many_threads() -> None:
    board = Board()
    board.show({}, {})

    def write() -> None:
        for i in range(200):
            board.note({'t': float(i)})
            board.show({'n': i}, {})

    threads = [threading.Thread(target=write) for _ in range(4)]
    for thread in threads:
        thread.start()
    while any(t.is_alive() for t in threads):
        number, _, header, _ = board.take((-1, 0))
        assert number >= 1
        assert isinstance(header['entries'], list)
    assert board.newer(800) == 801


def test_packets_place_their_blobs_on_eight_bytes() -> None:
    packet = pack({'a': 1}, {'one': b'12345', 'two': np.arange(4, dtype='<i2').tobytes()})
    (length,) = struct.unpack_from('<I', packet)
    header = header_of(packet)
    assert (4 + length) % 8 == 0
    offset, size = header['blobs']['two']
    assert offset % 8 == 0
    start = 4 + length + offset
    np.testing.assert_array_equal(np.frombuffer(packet[start : start + size], '<i2'), range(4))
