# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf info``: what is in a recording."""

from __future__ import annotations

import argparse
import json
import sys
import time
from typing import TYPE_CHECKING, Any

from rgbd_kcf_tracker.cli.common import (
    SOURCE_HELP,
    add_reading_options,
    escaped,
    progress,
    read_options,
)
from rgbd_kcf_tracker.errors import RgbdKcfError

if TYPE_CHECKING:
    from rgbd_kcf_tracker.recordings import ReadOptions, RecordingInfo, StreamInfo

NAME = 'info'
HELP = 'say what is in a recording: topics, rates, sizes, encodings, camera, ground truth'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument('source', metavar='SOURCE', help=SOURCE_HELP)
    parser.add_argument('--json', action='store_true', help='for programs')
    parser.add_argument(
        '--check',
        action='store_true',
        help='decode every frame: what is damaged, and how fast it is',
    )
    add_reading_options(parser)


def run(args: argparse.Namespace) -> int:
    """Print it; the exit code is 1 where ``--check`` finds frames that cannot be read, else 0."""
    from rgbd_kcf_tracker.recordings.opening import describe_recording

    options = read_options(args)
    info = describe_recording(args.source, options)
    print(json.dumps(_as_dict(info), indent=2) if args.json else _as_text(info))
    return _check(args, options) if args.check and not info.problem else 0


def _check(args: argparse.Namespace, options: ReadOptions) -> int:
    """Decode each frame by itself, so that one that is damaged does not hide the next."""
    from rgbd_kcf_tracker.recordings import open_recording

    out = sys.stderr if args.json else sys.stdout
    damaged = 0
    with open_recording(args.source, options) as recording:
        told = len(recording.warnings)
        begun = time.perf_counter()
        for number in progress(range(len(recording)), len(recording), 'check'):
            try:
                for _ in recording.frames(number, number + 1):
                    pass
            except RgbdKcfError as error:
                damaged += 1
                print(f'damaged: {escaped(str(error))}', file=out)
        spent = time.perf_counter() - begun
        for warning in recording.warnings[told:]:
            print(f'warning: {escaped(warning)}', file=out)
        rate = len(recording) / spent if spent else 0.0
        print(
            f'checked       {len(recording)} frames, {damaged} damaged, {rate:.0f} frames/s',
            file=out,
        )
    return 1 if damaged else 0


def _as_text(info: RecordingInfo) -> str:
    rate = '' if info.rate_hz is None else f', {info.rate_hz:.1f} Hz'
    lines = [
        f'{info.path}: {info.kind}',
        f'frames        {info.frames} ({info.frames_with_depth} with depth), '
        f'{info.duration_s:.1f} s{rate}',
    ]
    if info.intrinsics is None:
        lines.append('intrinsics    unknown (give --intrinsics FX,FY,CX,CY)')
    else:
        c = info.intrinsics
        lines.append(f'intrinsics    fx {c.fx:.2f}  fy {c.fy:.2f}  cx {c.cx:.2f}  cy {c.cy:.2f}')
        if c.lens is not None:
            from rgbd_kcf_tracker.recordings.camera_info import model_of

            model, coefficients = model_of(c.lens)
            numbers = ' '.join(f'{value:.4g}' for value in coefficients)
            lines.append(f'distortion    {model} {numbers}')
    if info.truth_frames is None:
        lines.append('ground truth  none')
    else:
        lines.append(f'ground truth  {info.truth_frames} frames with a box')
    if info.streams:
        lines += ['', *_table([_row(s) for s in info.streams])]
    if info.problem:
        lines += ['', f'cannot be tracked as it is: {info.problem}']
    lines += [f'warning: {text}' for text in info.warnings]
    return '\n'.join(map(escaped, lines))


def _row(stream: StreamInfo) -> tuple[str, ...]:
    size = '' if stream.size is None else f'{stream.size[0]}x{stream.size[1]}'
    rate = '' if stream.rate_hz is None else f'{stream.rate_hz:.1f} Hz'
    return stream.role, stream.name, stream.type, str(stream.count), rate, size, stream.encoding


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    head = ('use', 'topic', 'type', 'count', 'rate', 'size', 'encoding')
    cells = [head, *rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(head))]
    right = {3, 4}
    return [
        '  '.join(
            cell.rjust(width) if i in right else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in cells
    ]


def _as_dict(info: RecordingInfo) -> dict[str, Any]:
    from rgbd_kcf_tracker.recordings.camera_info import model_of

    camera = info.intrinsics
    return {
        'path': str(info.path),
        'kind': info.kind,
        'frames': info.frames,
        'frames_with_depth': info.frames_with_depth,
        'duration_s': info.duration_s,
        'rate_hz': info.rate_hz,
        'intrinsics': None
        if camera is None
        else {
            'fx': camera.fx,
            'fy': camera.fy,
            'cx': camera.cx,
            'cy': camera.cy,
            'distortion_model': model_of(camera.lens)[0],
            'd': model_of(camera.lens)[1],
        },
        'truth_frames': info.truth_frames,
        'problem': info.problem,
        'warnings': list(info.warnings),
        'streams': [
            {
                'name': s.name,
                'type': s.type,
                'count': s.count,
                'rate_hz': s.rate_hz,
                'size': s.size,
                'encoding': s.encoding,
                'role': s.role,
            }
            for s in info.streams
        ],
    }
