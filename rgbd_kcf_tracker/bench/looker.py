# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A browser's socket without the browser: takes every moment that the viewer shows.

python -m rgbd_kcf_tracker.bench.looker http://127.0.0.1:8080/
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys

import aiohttp

RETRY_S = 0.2


async def look(url: str) -> int:
    """Take moments until the task is cancelled; returns how many came."""
    count = 0
    with contextlib.suppress(asyncio.CancelledError):
        async with aiohttp.ClientSession() as session:
            while True:
                try:
                    connected = await session.ws_connect(
                        f'{url}socket', origin=url.rstrip('/'), max_msg_size=0
                    )
                except aiohttp.ClientError:
                    await asyncio.sleep(RETRY_S)
                    continue
                async for message in connected:
                    if message.type is aiohttp.WSMsgType.BINARY:
                        count += 1
                        await connected.send_json({'do': 'ack'})
    return count


def main(args: list[str] | None = None) -> int:
    """Look until SIGINT or SIGTERM, then say how many moments came."""
    (url,) = sys.argv[1:] if args is None else args
    os.nice(10)  # a browser runs on another machine

    async def until_told() -> int:
        looking = asyncio.ensure_future(look(url))
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, looking.cancel)
        return await looking

    print(f'{asyncio.run(until_told())} moments seen', file=sys.stderr)
    return 0


if __name__ == '__main__':
    sys.exit(main())
