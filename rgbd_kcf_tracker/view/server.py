# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The page over HTTP and a WebSocket, and who may see it.

On a loopback address the machine's own users may; a request is answered only where it was sent to
that address by name, so that no other site can reach the page through a browser (DNS rebinding),
and a socket is opened only for the page itself (its origin). On any other address a token is asked
for before anything is shown.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import hmac
import ipaddress
import logging
import math
import secrets
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator
from importlib import resources
from typing import Any
from urllib.parse import SplitResult, urlsplit

from aiohttp import WSMsgType, web

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.view import TOKEN_VARIABLE
from rgbd_kcf_tracker.view.commands import LARGEST_MESSAGE, parse
from rgbd_kcf_tracker.view.controller import Controller
from rgbd_kcf_tracker.view.showing import pack

LOOPBACK = ('127.0.0.1', 'localhost', '::1')
MOST_BROWSERS = 16
SHORTEST_TOKEN = 8
WRONG_TOKEN_S = 1.0
"""Wait after a wrong token, in which no other is looked at: guessing is slow for everybody."""
FORM_S = 5.0
"""Longest wait for the rest of a form: who sends none of it would hold a connection for ever."""
QUIET_S = 15.0
"""Longest life of a connection since it was opened or asked something, before the token is given:
anybody who reaches the port could hold as many as files may be open. Twice what a login takes."""
ROUND_S = 1.0
"""Between two looks for such connections."""
COMMANDS_S = 60
"""Requests that one browser may make each second; beyond, its socket is closed."""
ACK_S = 10.0
"""Longest wait for a browser to have drawn a moment; one that sleeps longer is let go."""
CLOSE_S = 1.0
"""Longest wait at the end for browsers to close their sockets, which those that sleep never do, and
for what is being answered."""
COMPLAINT_S = 60.0
"""Between two words about the same trouble in the log."""
COOKIE = 'rgbd_kcf_view'
"""Begins the name of the cookie; see :func:`_cookie`."""
STATIC = ('page.css', 'page.js', 'draw.js', 'room.js')

_HEADERS = {
    'Content-Security-Policy': (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
        "connect-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
    ),
    'X-Content-Type-Options': 'nosniff',
    'Referrer-Policy': 'same-origin',  # with none a form would name no origin
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Cache-Control': 'no-store',
}
_TYPES = {'.css': 'text/css', '.js': 'text/javascript', '.html': 'text/html'}
_LOG = logging.getLogger(__name__)
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches an address."""
    if host == 'localhost':
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def static_file(name: str) -> bytes:
    """One of the page's files."""
    return resources.files('rgbd_kcf_tracker.view').joinpath('static').joinpath(name).read_bytes()


def check_access(host: str, token: str) -> None:
    """Refuse what would let strangers in.

    Raises:
        ParameterError: for an address that is no loopback one without a token, or a short token.
    """
    if not token and not is_loopback(host):
        raise ParameterError(
            f'{host} is reachable from other machines: give a token in '
            f'{TOKEN_VARIABLE}, or listen on '
            '127.0.0.1 and reach it through an SSH tunnel (ssh -L 8080:127.0.0.1:8080 HOST)'
        )
    if token and len(token) < SHORTEST_TOKEN:
        raise ParameterError(f'the token is too short: give at least {SHORTEST_TOKEN} signs')


class Server:
    """Serves the page of a controller, in a thread of its own.

    Args:
        controller: what stands behind it.
        host: address to listen on.
        port: TCP port; 0 for any that is free.
        token: asked for before anything is shown; needed on every address but a loopback one.

    Attributes:
        url: where the page is, once :meth:`start` has returned.

    Raises:
        ParameterError: for an address that is no loopback one without a token, or a short token.
    """

    def __init__(
        self, controller: Controller, host: str = '127.0.0.1', port: int = 8080, token: str = ''
    ) -> None:
        check_access(host, token)
        self._controller, self._board = controller, controller.board
        self._host, self._port, self._token = host, port, token
        # What is kept in the browser is not the token itself, and ends with this server.
        self._session = secrets.token_urlsafe(32)
        self._loop = asyncio.new_event_loop()
        self._thread: threading.Thread | None = None
        self._sockets: set[web.WebSocketResponse] = set()
        self._until: dict[web.RequestHandler, float] = {}  # when each connection is to end
        self._wrong = asyncio.Lock()
        self.url = ''

    # -- life -------------------------------------------------------------------------------------

    def start(self) -> None:
        """Listen, and return when the page can be asked for.

        Raises:
            ParameterError: where the address cannot be listened on.
        """
        listening = _bound(self._host, self._port)
        host, port = listening.getsockname()[:2]
        shown = 'localhost' if host in ('0.0.0.0', '::') else host
        self.url = f'http://{f"[{shown}]" if ":" in shown else shown}:{port}/'
        ready = threading.Event()
        self._thread = threading.Thread(
            target=self._run, args=(listening, ready), name='viewer', daemon=True
        )
        self._thread.start()
        ready.wait(10)

    def stop(self) -> None:
        """Close all sockets and end the thread."""
        if self._thread is None or not self._loop.is_running():
            return
        asyncio.run_coroutine_threadsafe(self._close(), self._loop).result(10)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10)

    def _run(self, listening: socket.socket, ready: threading.Event) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.set_exception_handler(_Complaints())
        logging.getLogger('aiohttp.server').setLevel(logging.CRITICAL)
        self._loop.run_until_complete(self._open(listening))
        ready.set()
        try:
            self._loop.run_forever()
        finally:
            self._loop.close()

    async def _open(self, listening: socket.socket) -> None:
        @web.middleware
        async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
            return await self._guard(request, handler)

        app = web.Application(middlewares=[guard], client_max_size=LARGEST_MESSAGE)
        app.add_routes(
            [
                web.get('/', self._page),
                web.post('/login', self._login),
                web.get('/socket', self._socket),
                web.get('/boxes.csv', self._csv),
                web.get('/parameters.yaml', self._yaml),
                *(web.get(f'/{name}', self._static) for name in STATIC),
            ]
        )
        # Between two requests; for the first one, older versions of aiohttp wait for ever.
        self._runner = web.AppRunner(app, access_log=None, keepalive_timeout=15)
        await self._runner.setup()
        self._rounds = self._loop.create_task(self._let_strangers_go(self._runner))
        await web.SockSite(self._runner, listening).start()

    async def _let_strangers_go(self, runner: web.AppRunner) -> None:
        """End the connections whose time is over, for as long as the server lives."""
        while runner.server is not None:
            now = self._loop.time()
            # Of those that have ended nothing is kept.
            self._until = {c: self._until.get(c, now + QUIET_S) for c in runner.server.connections}
            for connection, until in self._until.items():
                if now >= until and connection.transport is not None:
                    connection.transport.abort()
            await asyncio.sleep(ROUND_S)

    async def _close(self) -> None:
        closing = asyncio.gather(*(c.close() for c in self._sockets), return_exceptions=True)
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(closing, CLOSE_S)
        assert self._runner.server is not None
        # Of those that sleep, read slowly, or have not sent all of a form.
        for connection in self._runner.server.connections:
            if connection.transport is not None:
                connection.transport.abort()
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._runner.cleanup(), CLOSE_S)
        left = asyncio.all_tasks() - {asyncio.current_task()}
        for task in left:
            task.cancel()
        await asyncio.gather(*left, return_exceptions=True)

    # -- who may ----------------------------------------------------------------------------------

    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Every request passes here before anything else is done with it."""
        refusal = self._refusal(request)
        known = refusal is None and self._known(request)
        self._until[request.protocol] = math.inf if known else self._loop.time() + QUIET_S
        if refusal is not None:
            response: web.StreamResponse = web.Response(status=403, text=refusal)
        elif not known and request.path != '/login':
            # Styles are no secret, and the form should not be ugly.
            if request.path == '/page.css':
                response = await handler(request)
            elif request.path == '/':
                response = _html(_form(''), 401)
            else:
                response = web.Response(status=401, text='a token is needed: open the page first')
        else:
            try:
                response = await handler(request)
            except web.HTTPException as error:
                response = web.Response(status=error.status, text=error.reason)
        if not response.prepared:
            response.headers.update(_HEADERS)
        return response

    def _refusal(self, request: web.Request) -> str | None:
        host = request.headers.get('Host', '')
        name = _parts(f'//{host}').hostname or ''
        if not self._token and name not in LOOPBACK and not is_loopback(name):
            return f'this viewer answers to 127.0.0.1 and localhost alone, not to {name[:80]!r}'
        origin = request.headers.get('Origin')
        # Every browser names the origin of a socket and of a form.
        if origin is None:
            needed = request.path in ('/socket', '/login')
            return 'no origin is named' if needed else None
        parts = _parts(origin)
        if parts.scheme not in ('http', 'https') or parts.netloc != host:
            return f'the page of {origin[:80]!r} may not use this viewer'
        return None

    def _known(self, request: web.Request) -> bool:
        if not self._token:
            return True
        return _equal(request.cookies.get(_cookie(request), ''), self._session)

    async def _login(self, request: web.Request) -> web.StreamResponse:
        try:
            form = await asyncio.wait_for(request.post(), FORM_S)
        except asyncio.TimeoutError:
            raise web.HTTPRequestTimeout from None
        # A RuntimeError: a transfer encoding that aiohttp does not know.
        except (ValueError, LookupError, RuntimeError, web.RequestPayloadError):
            raise web.HTTPBadRequest from None
        if self._wrong.locked():  # or who asks often enough at once would not have to wait
            raise web.HTTPTooManyRequests(text='A wrong token was just given: try again')
        given = form.get('token')
        said = given if isinstance(given, str) else ''
        if not self._token or _equal(said, self._token):
            response = web.Response(status=303, headers={'Location': '/'})
            response.set_cookie(
                _cookie(request), self._session, httponly=True, samesite='Strict', path='/',
                secure=request.secure,
            )  # fmt: skip
            return response
        async with self._wrong:
            await asyncio.sleep(WRONG_TOKEN_S)
        return _html(_form('That is not the token.'), 401)

    # -- what is there ----------------------------------------------------------------------------

    async def _page(self, _: web.Request) -> web.StreamResponse:
        return _html(static_file('page.html').decode())

    async def _static(self, request: web.Request) -> web.StreamResponse:
        name = request.path.lstrip('/')
        kind = _TYPES['.' + name.rpartition('.')[2]]
        return web.Response(body=static_file(name), content_type=kind, charset='utf-8')

    async def _csv(self, _: web.Request) -> web.StreamResponse:
        return _download('boxes.csv', 'text/csv', self._controller.boxes_csv())

    async def _yaml(self, _: web.Request) -> web.StreamResponse:
        return _download('parameters.yaml', 'text/yaml', self._controller.parameters_yaml())

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        if len(self._sockets) >= MOST_BROWSERS:
            return web.Response(status=503, text=f'{MOST_BROWSERS} browsers look already')
        connected = web.WebSocketResponse(
            max_msg_size=LARGEST_MESSAGE, heartbeat=20, compress=False
        )
        self._sockets.add(connected)
        try:
            await connected.prepare(request)
            await self._converse(connected)
        finally:
            self._sockets.discard(connected)
        return connected

    async def _converse(self, connected: web.WebSocketResponse) -> None:
        news, drawn = asyncio.Event(), asyncio.Event()
        wake = _waker(self._loop, news)
        self._board.watch(wake)
        sender = asyncio.ensure_future(self._send(connected, news, drawn))
        try:
            await self._receive(connected, drawn)
        finally:
            self._board.unwatch(wake)
            sender.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionError):
                await sender

    async def _send(
        self, connected: web.WebSocketResponse, news: asyncio.Event, drawn: asyncio.Event
    ) -> None:
        """Send the newest moment, and the next only when that one is drawn."""
        try:
            await self._send_moments(connected, news, drawn)
        except Exception:
            await connected.close(code=1011, message=b'internal error')  # or the page would freeze
            raise

    async def _send_moments(
        self, connected: web.WebSocketResponse, news: asyncio.Event, drawn: asyncio.Event
    ) -> None:
        await connected.send_json({'hello': self._controller.description()})
        number, since = 0, (-1, 0)
        while not connected.closed:
            if self._board.newer(number) is None:
                await news.wait()
                news.clear()
                continue
            number, since, header, blobs = self._board.take(since)
            drawn.clear()
            try:
                await connected.send_bytes(pack(header, blobs))
                await asyncio.wait_for(drawn.wait(), ACK_S)
            except (asyncio.TimeoutError, ConnectionError):
                await connected.close(code=1013, message=b'too slow')
                return

    async def _receive(self, connected: web.WebSocketResponse, drawn: asyncio.Event) -> None:
        begun, count = self._loop.time(), 0
        async for message in connected:
            if message.type is not WSMsgType.TEXT:
                await connected.close(code=1003, message=b'only text is understood')
                return
            if self._loop.time() - begun > 1:
                begun, count = self._loop.time(), 0
            count += 1
            if count > COMMANDS_S:
                await connected.close(code=1008, message=b'too many requests')
                return
            try:
                command = parse(message.data)
            except ParameterError as error:
                await connected.send_json({'refused': str(error)})
                continue
            if command.do == 'ack':
                drawn.set()
            else:
                self._controller.do(command)


def _equal(given: str, secret: str) -> bool:
    """Whether a secret was given, in a time that does not tell how much of it."""
    return hmac.compare_digest(given.encode('utf-8', 'surrogateescape'), secret.encode())


def _parts(url: str) -> SplitResult:
    """The parts of an address that somebody else wrote; none where it is no address."""
    try:
        parts = urlsplit(url)
        _ = parts.hostname, parts.netloc, parts.port
    except ValueError:
        return urlsplit('')
    return parts


def _cookie(request: web.Request) -> str:
    """The cookie's name, with the port that the browser asked.

    Cookies ignore ports: two viewers on one host, or behind two tunnels, would share one.
    """
    return f'{COOKIE}_{_parts("//" + request.headers.get("Host", "")).port}'


class _Complaints:
    """Says what goes wrong beside all requests, such as more connections than files may be open.

    asyncio tries a hundred times a second, and would tell each with its traceback.
    """

    def __init__(self) -> None:
        self._next = 0.0

    def __call__(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """See :meth:`asyncio.loop.set_exception_handler`."""
        if loop.time() < self._next:
            return
        self._next = loop.time() + COMPLAINT_S
        _LOG.warning('viewer: %s: %s', context['message'], context.get('exception', ''))


def _waker(loop: asyncio.AbstractEventLoop, news: asyncio.Event) -> Callable[[], None]:
    def wake() -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(news.set)

    return wake


def _bound(host: str, port: int) -> socket.socket:
    try:
        family = socket.AF_INET6 if ':' in host else socket.AF_INET
        listening = socket.socket(family, socket.SOCK_STREAM)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((host, port))
    except (UnicodeError, socket.gaierror):
        raise ParameterError(
            f'{host!r} is no name or address of this machine: give another host'
        ) from None
    except (OSError, OverflowError) as error:
        reason = getattr(error, 'strerror', None) or str(error).rstrip('.')
        wrong = 'host' if getattr(error, 'errno', None) == errno.EADDRNOTAVAIL else 'port'
        raise ParameterError(
            f'{host}:{port} cannot be listened on: {reason}; name another {wrong}'
        ) from None
    return listening


def _html(text: str, status: int = 200) -> web.Response:
    return web.Response(text=text, content_type='text/html', status=status)


def _download(name: str, kind: str, text: str) -> web.Response:
    return web.Response(
        text=text,
        content_type=kind,
        headers={'Content-Disposition': f'attachment; filename="{name}"'},
    )


def _form(problem: str) -> str:
    note = f'<p role="alert">{problem}</p>' if problem else ''
    return static_file('token.html').decode().replace('<!-- problem -->', note)


@contextlib.contextmanager
def serving(controller: Controller, host: str, port: int, token: str) -> Iterator[Server]:
    """A server that is started, and stopped at the end of the block."""
    server = Server(controller, host, port, token)
    server.start()
    try:
        yield server
    finally:
        server.stop()
