# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf simulate``: record simulated scenes as bags or sequence folders."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from rgbd_kcf_tracker.cli.common import (
    add_overwrite_option,
    escaped,
    parse_size,
    progress,
    refuse,
)
from rgbd_kcf_tracker.errors import ParameterError, RecordingError

if TYPE_CHECKING:
    from rgbd_kcf_tracker.simulation import SimulatedFrame, SimulatedSequence

WriteFrame: TypeAlias = 'Callable[[SimulatedFrame], None]'
WriterContext: TypeAlias = AbstractContextManager[WriteFrame]

NAME = 'simulate'
HELP = 'record simulated scenes with exact ground truth'
MOST_SCENES, MOST_DRAWN = 10_000, 1000
"""Scenes that are recorded, or drawn into one picture, at the most. All places are looked at before
the first scene is rendered, and more than these are a mistake: 10000 scenes as they are by default
take a terabyte, and a JPEG file holds 65500 rows."""
_EPILOG = """\
examples:
  rgbd-kcf simulate --list
  rgbd-kcf simulate walk.mcap --scenario occlusion --seed 3
  rgbd-kcf simulate walk/ --scenario fast_motion --rate 5
  rgbd-kcf simulate scenes/ --scenario all --seed 100 --count 2
  rgbd-kcf simulate people/ --scenario people --rate 10 --size 640x480 --color-format jpg
  rgbd-kcf simulate --contact-sheet scenes.jpg --scenario all --rate 5
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = _EPILOG
    parser.add_argument(
        'dest',
        nargs='?',
        type=Path,
        metavar='DEST',
        help='a file that ends in .mcap, or a sequence folder; with several scenes, the folder in '
        'which each gets its own (SCENARIO_SEED)',
    )
    parser.add_argument(
        '--scenario',
        action='append',
        metavar='NAME',
        help="what happens (default: normal); may be given again; 'all' for every "
        "scenario of one target, 'people' for those of several people with ids",
    )
    parser.add_argument(
        '--seed', type=int, default=0, metavar='N', help='of everything random (default: 0)'
    )
    parser.add_argument(
        '--count',
        type=int,
        default=1,
        metavar='N',
        help='record this many seeds, counted up from --seed (default: 1)',
    )
    parser.add_argument(
        '--rate', type=float, default=30.0, metavar='HZ', help='frames per second (default: 30)'
    )
    parser.add_argument(
        '--duration',
        type=float,
        metavar='S',
        help="seconds (default: the scene's own length, 4 to 13, or up to 60 with several people)",
    )
    parser.add_argument(
        '--size',
        default='960x540',
        metavar='WxH',
        help='of the colour image (default: 960x540, the qhd of kinect2_bridge)',
    )
    parser.add_argument(
        '--format',
        choices=('mcap', 'folder'),
        help='of each scene when there are several (default: folder)',
    )
    parser.add_argument(
        '--contact-sheet',
        type=Path,
        metavar='FILE',
        help='draw the scenes into one picture (.jpg or .png) instead of recording them',
    )
    parser.add_argument(
        '--irregular',
        action='store_true',
        help='stamps that vary, lost frames and gaps, as of a camera on a busy machine',
    )
    add_overwrite_option(parser, 'what is at DEST')
    parser.add_argument('--list', action='store_true', help='list the scenarios and stop')
    parser.add_argument(
        '--color-format',
        choices=('png', 'jpg'),
        help='of the colour images of a folder (default: png; jpg takes a tenth of the space)',
    )
    parser.add_argument(
        '--compression',
        choices=('none', 'lz4', 'zstd'),
        help='of the chunks of an mcap file (default: zstd)',
    )


def run(args: argparse.Namespace) -> int:
    """Record what was asked for."""
    from rgbd_kcf_tracker.simulation import SCENARIOS, check_request, expand_names, simulate

    if args.list:
        width = max(map(len, SCENARIOS))
        for scenario in SCENARIOS.values():
            print(f'{scenario.name:{width}}  {scenario.description}')
        return 0
    if (args.dest is None) == (args.contact_sheet is None):
        raise ParameterError(
            'name DEST, an .mcap file or a folder to write, or --contact-sheet FILE'
        )
    names = expand_names(args.scenario or ['normal'])
    most = (MOST_SCENES if args.contact_sheet is None else MOST_DRAWN) // len(names)
    if not 1 <= args.count <= most:
        of = f' of {len(names)} scenarios' if len(names) > 1 else ''
        raise ParameterError(f'--count is {args.count}: give 1 to {most}{of}')
    size = parse_size(args.size)
    for name in names:  # find every mistake before anything is written
        check_request(name, args.seed, args.rate, args.duration, size)
    jobs = [(name, seed) for name in names for seed in range(args.seed, args.seed + args.count)]
    if args.contact_sheet is not None:
        refuse(args, 'with --contact-sheet', ('format', 'color_format', 'compression'))
        _draw_sheet(args, jobs, size)
        return 0
    destinations = _destinations(args, jobs)
    packed, images = args.compression or 'zstd', args.color_format or 'png'
    for dest, (name, seed) in zip(destinations, jobs, strict=True):
        sequence = simulate(name, seed, args.rate, args.duration, size, args.irregular)
        if dest.suffix == '.mcap':
            _record(sequence, dest, lambda path: _bag(path, size, packed, args.overwrite))
        else:
            _record(sequence, dest, lambda path: _folder(path, images, args.overwrite))
    return 0


def _draw_sheet(
    args: argparse.Namespace, jobs: list[tuple[str, int]], size: tuple[int, int]
) -> None:
    import cv2

    from rgbd_kcf_tracker.recordings.outputs import check_outputs, write_file
    from rgbd_kcf_tracker.simulation import simulate
    from rgbd_kcf_tracker.simulation.contact_sheet import contact_sheet

    path: Path = args.contact_sheet
    if path.suffix not in ('.jpg', '.png'):
        raise ParameterError(f'{path} must end in .jpg or .png')
    check_outputs({'--contact-sheet': path}, overwrite=args.overwrite)
    scenes = (
        simulate(name, seed, args.rate, args.duration, size, args.irregular) for name, seed in jobs
    )
    sheet = contact_sheet(progress(scenes, len(jobs), 'contact sheet'))
    quality = [int(cv2.IMWRITE_JPEG_QUALITY), 78] if path.suffix == '.jpg' else []
    done, data = cv2.imencode(path.suffix, sheet, quality)
    if not done:
        raise RecordingError(f'{path} cannot be encoded: fewer scenes make a smaller picture')
    write_file(path, data.tobytes(), args.overwrite)
    print(escaped(f'{path}: {len(jobs)} scenes'))


def _destinations(args: argparse.Namespace, jobs: list[tuple[str, int]]) -> list[Path]:
    """Where each scene goes; all are looked at before the first is rendered."""
    from rgbd_kcf_tracker.recordings.outputs import check_outputs, make_folder
    from rgbd_kcf_tracker.recordings.storage import BAG_SUFFIXES

    dest: Path = args.dest
    if dest.suffix != '.mcap' and dest.suffix.lower() in BAG_SUFFIXES:
        raise ParameterError(f'{dest}: bags are written as .mcap: name such a file, or a folder')
    if dest.suffix == '.mcap' or args.format == 'mcap':
        refuse(args, 'for an mcap file', ('color_format',), 'leave it out')
    else:
        refuse(args, 'for a sequence folder', ('compression',), 'leave it out')
    if len(jobs) == 1:
        if args.format == 'mcap' and dest.suffix != '.mcap':
            raise ParameterError(f'--format mcap, but {dest} does not end in .mcap')
        if args.format == 'folder' and dest.suffix == '.mcap':
            raise ParameterError(f'--format folder, but {dest} ends in .mcap')
        folders = () if dest.suffix == '.mcap' else ('DEST',)
        check_outputs({'DEST': dest}, overwrite=args.overwrite, folders=folders)
        return [dest]
    if dest.suffix == '.mcap':
        raise ParameterError(f'{dest} is one file for {len(jobs)} scenes: name a folder')
    suffix = '.mcap' if args.format == 'mcap' else ''
    make_folder(dest)
    found = [dest / f'{name}_{seed}{suffix}' for name, seed in jobs]
    named = {path.name: path for path in found}
    check_outputs(named, overwrite=args.overwrite, folders=() if suffix else named)
    if not suffix and args.overwrite:
        for path in found:
            _check_ours(path)
    return found


def _check_ours(folder: Path) -> None:
    """Refuse a folder that holds what we did not write, as its writer would in its turn."""
    from rgbd_kcf_tracker.recordings import SequenceWriter

    if folder.is_dir() and any(folder.iterdir()):
        SequenceWriter(folder, overwrite=True).close(whole=False)  # leaves all as it was


def _record(
    sequence: SimulatedSequence, dest: Path, open_writer: Callable[[Path], WriterContext]
) -> None:
    """Render a sequence and write it, frame by frame."""
    title = f'{sequence.scenario}, seed {sequence.seed}'
    hidden = 0
    with open_writer(dest) as write:
        for simulated in progress(sequence, len(sequence), title):
            write(simulated)
            hidden += simulated.visible is None
    people = f'{len(sequence.people)} people, ' if len(sequence.people) > 1 else ''
    print(
        f'{escaped(str(dest))}: {title}: {len(sequence)} frames at {sequence.rate_hz:g} Hz, '
        f'{people}the target hidden in {hidden}',
        flush=True,
    )


@contextmanager
def _bag(
    dest: Path, size: tuple[int, int], compression: str, overwrite: bool
) -> Iterator[WriteFrame]:
    from rgbd_kcf_tracker.recordings import KINECT2_HD, KINECT2_QHD, KINECT2_SD, BagWriter

    topics = {(1920, 1080): KINECT2_HD, (512, 424): KINECT2_SD}.get(size, KINECT2_QHD)
    with BagWriter(dest, topics, compression=compression, overwrite=overwrite) as bag:

        def write(simulated: SimulatedFrame) -> None:
            bag.write_frame(simulated.frame)
            bag.write_truth(simulated.frame, simulated.visible, simulated.body)

        yield write


@contextmanager
def _folder(dest: Path, color_format: str, overwrite: bool) -> Iterator[WriteFrame]:
    from rgbd_kcf_tracker.recordings import SequenceWriter

    with SequenceWriter(dest, color_format, overwrite) as folder:

        def write(simulated: SimulatedFrame) -> None:
            folder.write(
                simulated.frame,
                simulated.visible,
                simulated.body,
                simulated.visible_fraction,
                simulated.truths if len(simulated.truths) > 1 else None,
            )

        yield write
