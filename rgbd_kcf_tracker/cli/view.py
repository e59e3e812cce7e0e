# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf view``: play a recording in a browser while it is tracked."""

from __future__ import annotations

import argparse
import contextlib
import signal
import threading
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

from rgbd_kcf_tracker.cli.common import (
    SOURCE_HELP,
    Warnings,
    add_overwrite_option,
    add_reading_options,
    add_scene_options,
    add_tracker_options,
    counter,
    escaped,
    open_source,
    parse_box,
    refuse,
    tracker_parameters,
)
from rgbd_kcf_tracker.errors import BoxError, ParameterError
from rgbd_kcf_tracker.extras import require
from rgbd_kcf_tracker.view import TOKEN_VARIABLE

if TYPE_CHECKING:
    from rgbd_kcf_tracker.geometry import Box
    from rgbd_kcf_tracker.recordings import Recording

NAME = 'view'
HELP = 'pick and watch the target of a recording in a browser'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        'source', metavar='SOURCE', nargs='?', help=f'{SOURCE_HELP}; a simulated scene if left out'
    )
    parser.add_argument(
        '--init',
        metavar='X,Y,W,H',
        help="the target's box in the first frame shown (default: the first ground-truth box, "
        'else it is picked in the page)',
    )
    add_tracker_options(parser)
    parser.add_argument(
        '--all', action='store_true', help='follow everyone in view too; only metric can'
    )
    page = parser.add_argument_group('page')
    page.add_argument('--port', metavar='P', type=int, help='TCP port (default 8080)')
    page.add_argument(
        '--host',
        metavar='ADDRESS',
        help='address to listen on (default 127.0.0.1: this machine alone); others need a token',
    )
    page.add_argument(
        '--token',
        metavar='WORD',
        help='asked for before anything is shown; better given in the environment variable '
        f'{TOKEN_VARIABLE}, which other users of the machine do not see',
    )
    page.add_argument('--open', action='store_true', help='open the page in a browser here')
    export = parser.add_argument_group('one file instead of a page')
    export.add_argument(
        '--export', metavar='FILE.html', help='track to the end and write what the page shows'
    )
    export.add_argument('--end', metavar='N', type=int, help='frame to stop before (default: all)')
    add_overwrite_option(export, 'FILE.html')
    add_scene_options(parser)
    add_reading_options(parser)


def run(args: argparse.Namespace) -> int:
    """Serve the page until it is interrupted, or write the file."""
    from rgbd_kcf_tracker.variants import DEFAULT_VARIANT

    require('view', 'the page')
    _check_export(args)
    variant = args.variant or DEFAULT_VARIANT
    parameters = tracker_parameters(args, variant)
    host = '127.0.0.1' if args.host is None else args.host
    token = _token(args)
    if args.export is None:
        from rgbd_kcf_tracker.view.server import check_access

        check_access(host, token)  # before a long recording is opened
    with open_source(args) as recording:
        warnings = Warnings(recording.warnings)
        warnings.show()
        start, box = _start(args, recording)
        if args.export is not None:
            return _export(args, recording, variant, parameters, start, box)
        from rgbd_kcf_tracker.view.player import Player

        player = Player(recording, variant, parameters, start=start, box=box, everyone=args.all)
        port = 8080 if args.port is None else args.port
        serve(player, host, port, token, args.open)
    return 0


def serve(player: object, host: str, port: int, token: str, open_it: bool) -> None:
    """Serve the page of a player until SIGINT or SIGTERM."""
    from rgbd_kcf_tracker.view.player import Player
    from rgbd_kcf_tracker.view.server import serving

    assert isinstance(player, Player)
    stopped = threading.Event()
    with contextlib.suppress(ValueError):  # not the main thread
        signal.signal(signal.SIGTERM, lambda *_: stopped.set())
    with serving(player, host, port, token) as server:
        player.start()
        print(f'open {server.url} in a browser; Ctrl-C ends it', flush=True)
        if open_it:
            webbrowser.open(server.url)
        try:
            # A wait without end could not be interrupted on every system.
            while not stopped.wait(1.0):
                pass
        finally:
            player.stop()


def _check_export(args: argparse.Namespace) -> None:
    """Refuse what must not be written before anything is read."""
    if args.export is None:
        refuse(args, 'without --export', ('end', 'overwrite'), 'add it, or leave this out')
        return
    refuse(args, 'with --export', ('port', 'host', 'token', 'open'))
    from rgbd_kcf_tracker.recordings.outputs import check_outputs

    sources = [] if args.source is None else [args.source]
    check_outputs({'--export': args.export}, sources, args.overwrite)


def _token(args: argparse.Namespace) -> str:
    import os

    return args.token or os.environ.get(TOKEN_VARIABLE, '')


def _start(args: argparse.Namespace, recording: Recording) -> tuple[int, Box | None]:
    from rgbd_kcf_tracker.view.sources import first_box

    given = None if args.init is None else parse_box(args.init)
    try:
        return first_box(recording, given, args.start)
    except BoxError:
        if args.export is not None and not args.all:
            raise
        return args.start, None


def _export(
    args: argparse.Namespace,
    recording: Recording,
    variant: str,
    parameters: object,
    start: int,
    box: Box | None,
) -> int:
    from rgbd_kcf_tracker.parameters import Parameters
    from rgbd_kcf_tracker.view.export import export

    path = Path(args.export)
    end = len(recording) if args.end is None else min(args.end, len(recording))
    if end <= start:
        raise ParameterError(f'--end {args.end}: it must be above {start}, where the target is')
    assert isinstance(parameters, Parameters)
    with counter(end - start, 'frame') as done:
        count = export(
            recording, path, variant, parameters, start, end, box,
            lambda number: done(1, ''), args.overwrite, args.all,
        )  # fmt: skip
    size = path.stat().st_size / 1e6
    print(
        escaped(
            f'{recording.name}: {count} moments of frames {start} to {end - 1} in {path}, '
            f'{size:.1f} MB'
        )
    )
    return 0
