# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf info``: what is in a recording."""

from __future__ import annotations

import argparse
import json
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
    """Print it; the exit code is 1 where ``--check`` finds damaged images, else 0."""
    from rgbd_kcf_tracker.recordings.opening import describe_recording

    options = read_options(args)
    info = describe_recording(args.source, options)
    if not args.json:
        print(_as_text(info))
    check = _check(args.source, options) if args.check and not info.problem else None
    if args.json:
        checked = {} if check is None else {'check': check}
        print(json.dumps(_as_dict(info) | checked, indent=2))
    elif check is not None:
        for kind in ('damaged', 'warnings'):
            for text in check[kind]:
                print(f'{kind.removesuffix("s")}: {escaped(text)}')
        print(
            f'checked       {check["frames"]} frames, {len(check["damaged"])} damaged, '
            f'{check["frames_per_s"]:.0f} frames/s'
        )
    return 1 if check is not None and check['damaged'] else 0


def _check(source: str, options: ReadOptions) -> dict[str, Any]:
    """Decode each frame by itself, so that one that is damaged does not hide the next."""
    from rgbd_kcf_tracker.recordings import open_recording
    from rgbd_kcf_tracker.recordings.recording import WITHOUT_DEPTH

    damaged: list[str] = []
    with open_recording(source, options) as recording:
        told = len(recording.warnings)
        begun = time.perf_counter()
        for number in progress(range(len(recording)), len(recording), 'check'):
            try:
                for _ in recording.frames(number, number + 1):
                    pass
            except RgbdKcfError as error:
                damaged.append(str(error))
        spent = time.perf_counter() - begun
        lost = [text for text in recording.warnings[told:] if WITHOUT_DEPTH in text]
        return {
            'frames': len(recording),
            'damaged': damaged + lost,
            'warnings': [text for text in recording.warnings[told:] if text not in lost],
            'frames_per_s': len(recording) / spent if spent else 0.0,
        }


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
