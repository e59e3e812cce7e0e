# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A real headless Chromium for tests, driven over its own protocol (CDP)."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import itertools
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import aiohttp

NAMES = ('chromium', 'chromium-browser', 'google-chrome')


def chromium() -> str | None:
    """The browser, where one is installed; ``RGBD_KCF_CHROMIUM`` names another."""
    named = os.environ.get('RGBD_KCF_CHROMIUM')
    return named or next(filter(None, map(shutil.which, NAMES)), None)


class Page:
    """One tab."""

    def __init__(self, loop: asyncio.AbstractEventLoop, socket: Any, session: Any) -> None:
        self._loop, self._socket, self._session = loop, socket, session
        self._numbers = itertools.count(1)
        self.errors: list[str] = []

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        return self._loop.run_until_complete(self._call(method, parameters))

    async def _call(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        number = next(self._numbers)
        await self._socket.send_json({'id': number, 'method': method, 'params': parameters})
        while True:
            message = json.loads((await asyncio.wait_for(self._socket.receive(), 60)).data)
            if message.get('method') == 'Runtime.exceptionThrown':
                detail = message['params']['exceptionDetails']
                self.errors.append(detail.get('exception', detail).get('description', str(detail)))
            if message.get('method') == 'Log.entryAdded':
                entry = message['params']['entry']
                if entry['level'] == 'error':
                    self.errors.append(f'{entry["text"]} {entry.get("url", "")}')
            if message.get('id') == number:
                if 'error' in message:
                    raise RuntimeError(f'{method}: {message["error"]}')
                return dict(message['result'])

    def open(self, url: str) -> None:
        self.call('Page.navigate', url=url)

    def size(self, width: int, height: int, *, dark: bool = False, phone: bool = False) -> None:
        self.call(
            'Emulation.setDeviceMetricsOverride', width=width, height=height,
            deviceScaleFactor=2 if phone else 1, mobile=phone,
        )  # fmt: skip
        self.call('Emulation.setTouchEmulationEnabled', enabled=phone)
        scheme = {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}
        self.call('Emulation.setEmulatedMedia', features=[scheme])

    def value(self, script: str) -> Any:
        """What a JavaScript expression gives; promises are waited for."""
        result = self.call(
            'Runtime.evaluate', expression=script, returnByValue=True, awaitPromise=True
        )
        if 'exceptionDetails' in result:
            raise RuntimeError(f'{script}: {result["exceptionDetails"]}')
        return result['result'].get('value')

    def until(self, script: str, seconds: float = 30) -> None:
        """Wait until an expression gives something true."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            with contextlib.suppress(RuntimeError):
                if self.value(f'Boolean({script})'):
                    return
            time.sleep(0.05)
        words = self.value('document.body && document.body.innerText')
        raise AssertionError(f'{script} stayed false; the page says: {words}; errors {self.errors}')

    def mouse(self, kind: str, x: float, y: float, buttons: int = 1) -> None:
        self.call(
            'Input.dispatchMouseEvent', type=kind, x=x, y=y, button='left', buttons=buttons,
            clickCount=1,
        )  # fmt: skip

    def drag(self, start: tuple[float, float], stop: tuple[float, float]) -> None:
        self.mouse('mouseMoved', *start, 0)
        self.mouse('mousePressed', *start)
        for step in (0.3, 0.7, 1.0):
            self.mouse(
                'mouseMoved', *(a + step * (b - a) for a, b in zip(start, stop, strict=True))
            )
        self.mouse('mouseReleased', *stop, 0)

    def click(self, x: float, y: float) -> None:
        self.mouse('mouseMoved', x, y, 0)
        self.mouse('mousePressed', x, y)
        self.mouse('mouseReleased', x, y, 0)

    def press(self, selector: str, seconds: float = 30) -> None:
        """Click on an element once it lies still and nothing covers it, scrolled into view.

        What comes to the page meanwhile may move an element between the look and the click.
        """
        still = (
            f'(async () => {{ const e = document.querySelector({json.dumps(selector)}); '
            "if (!e) return null; e.scrollIntoView({block: 'center'}); let last = ''; "
            'for (let same = 0; same < 3;) { await new Promise(requestAnimationFrame); '
            'const b = e.getBoundingClientRect(), x = b.x + b.width / 2, y = b.y + b.height / 2; '
            'if (!b.width || !e.contains(document.elementFromPoint(x, y))) return null; '
            'same = last === `${x} ${y}` ? same + 1 : 0; last = `${x} ${y}`; '
            'if (same === 2) return [x, y]; } })()'
        )
        end = time.monotonic() + seconds
        while (place := self.value(still)) is None:
            if time.monotonic() > end:
                raise AssertionError(f'{selector} cannot be clicked')
            time.sleep(0.05)
        self.click(*place)

    def picture(self, path: Path, *, whole: bool = True) -> None:
        data = self.call('Page.captureScreenshot', format='png', captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(data['data']))


class Browser:
    """A running Chromium with a profile of its own."""

    def __init__(self, port: int) -> None:
        self._address = f'http://127.0.0.1:{port}'
        self._loop = asyncio.new_event_loop()
        self._sessions: list[Any] = []

    def page(self, url: str = 'about:blank') -> Page:
        return self._loop.run_until_complete(self._page(url))

    async def _page(self, url: str) -> Page:
        session = aiohttp.ClientSession()
        self._sessions.append(session)
        async with session.put(f'{self._address}/json/new?{url}') as answer:
            target = await answer.json(content_type=None)
        socket = await session.ws_connect(target['webSocketDebuggerUrl'], max_msg_size=0)
        page = Page(self._loop, socket, session)
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            await page._call(f'{domain}.enable', {})
        return page

    def close(self) -> None:
        for session in self._sessions:
            self._loop.run_until_complete(session.close())
        self._loop.close()


@contextlib.contextmanager
def browser() -> Iterator[Browser]:
    """Start Chromium, and end it with all that it started."""
    program = chromium()
    assert program is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen(
            [
                program, '--headless=new', '--no-sandbox', '--remote-debugging-port=0',
                '--remote-allow-origins=*', f'--user-data-dir={profile}', '--no-first-run',
                '--disable-dev-shm-usage', '--enable-unsafe-swiftshader', '--use-gl=angle',
                '--use-angle=swiftshader', '--disable-background-networking',
                '--disable-background-timer-throttling', '--disable-renderer-backgrounding',
                '--disable-backgrounding-occluded-windows', '--window-size=1400,900', 'about:blank',
            ],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        try:
            told = Path(profile, 'DevToolsActivePort')
            end = time.monotonic() + 60
            while not (told.exists() and told.read_text().strip()):
                assert process.poll() is None, 'Chromium ended at once'
                assert time.monotonic() < end, 'Chromium does not start'
                time.sleep(0.05)
            opened = Browser(int(told.read_text().splitlines()[0]))
            yield opened
            opened.close()
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait(10)
