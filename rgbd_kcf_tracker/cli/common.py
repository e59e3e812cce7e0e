# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Options and messages that several subcommands share."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from rgbd_kcf_tracker.cli.interrupts import interrupts
from rgbd_kcf_tracker.errors import BoxError, ParameterError, RecordingError
from rgbd_kcf_tracker.geometry import Box, Intrinsics

if TYPE_CHECKING:
    from rgbd_kcf_tracker.parameters import Parameters
    from rgbd_kcf_tracker.recordings import ReadOptions, Recording

T = TypeVar('T')
_MOST_WARNINGS = 20

SOURCE_HELP = (
    'a recording: an .mcap file, a rosbag2 folder (mcap or sqlite3), a ROS 1 .bag, or a sequence '
    'folder with rgb/ and, if there is depth, depth/'
)


def add_topic_options(group: argparse._ArgumentGroup) -> None:
    """Declare the options that name the topics of a bag's camera."""
    group.add_argument(
        '--color-topic', metavar='TOPIC', help='colour topic of a bag (found if left out)'
    )
    group.add_argument(
        '--depth-topic',
        metavar='TOPIC',
        help="depth topic of a bag (found if left out); 'none' reads colour alone",
    )
    group.add_argument(
        '--info-topic', metavar='TOPIC', help='CameraInfo topic of a bag (found if left out)'
    )


def add_reading_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options that say how a recording is read."""
    group = parser.add_argument_group('reading')
    add_topic_options(group)
    group.add_argument(
        '--tolerance',
        metavar='SECONDS',
        type=float,
        help='largest distance of stamps in a colour and depth pair (default 0.02; more, with a '
        'warning, where no pair is that near)',
    )
    group.add_argument(
        '--fps',
        metavar='F',
        type=float,
        default=30.0,
        help='frames per second of a folder without timestamps.txt (default 30)',
    )
    group.add_argument(
        '--intrinsics',
        metavar='FX,FY,CX,CY',
        help="camera in pixels, instead of the recording's own",
    )
    group.add_argument(
        '--rectified',
        choices=('auto', 'yes', 'no'),
        default='auto',
        help="whether a bag's colour images are rectified, so that P of CameraInfo is their camera "
        '(default auto: by the name of their topic)',
    )
    group.add_argument(
        '--max-pixels',
        metavar='N',
        type=int,
        default=1 << 24,
        help='largest image that is read (default 16777216: 4096x4096)',
    )


def add_tracker_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options that choose the tracker and where it begins."""
    parser.add_argument(
        '--variant', metavar='NAME', help='tracker: kcf, rgbd, rgbd_pf or metric (the default)'
    )
    parser.add_argument(
        '--param',
        metavar='KEY=VALUE',
        nargs='+',
        action='extend',
        default=[],
        help='parameters of the tracker; an unknown name lists those there are',
    )
    parser.add_argument('--start', metavar='N', type=int, default=0, help='first frame (default 0)')


def add_scene_options(parser: argparse.ArgumentParser, seed: int = 0) -> None:
    """Declare the options that choose a simulated scene where no recording is named."""
    group = parser.add_argument_group('simulated scene, where no SOURCE is named')
    group.add_argument(
        '--scenario',
        metavar='NAME',
        help='what happens (default: occlusion; rgbd-kcf simulate --list names all)',
    )
    group.add_argument(
        '--seed',
        metavar='N',
        type=int,
        help=f'of everything random (default {seed})',
    )
    parser.set_defaults(usual_seed=seed)


def refuse(
    args: argparse.Namespace,
    where: str,
    names: Sequence[str],
    cure: str = 'leave one of them out',
    usual: Mapping[str, object] | None = None,
) -> None:
    """Options that mean nothing somewhere, rather than leaving them out silently.

    Args:
        args: all options.
        where: they mean nothing, in words.
        names: of these options.
        cure: what to do.
        usual: what options are that were not given, where that is not nothing.

    Raises:
        ParameterError: for one that was given.
    """
    for name in names:
        value = getattr(args, name)
        if usual is not None and value == usual.get(name):
            continue
        if value not in (None, [], '') and value is not False:  # 0 was given, too
            option = '--' + name.replace('_', '-')
            raise ParameterError(f'{option} means nothing {where}: {cure}')


def open_source(args: argparse.Namespace) -> Recording:
    """The recording that was named, or the simulated scene.

    Raises:
        RecordingError: where it cannot be opened.
        ParameterError: for an unknown scene, a value that cannot be, or an option of the other.
    """
    if args.source is None:
        from rgbd_kcf_tracker.view.sources import SimulatedRecording

        refuse_reading(args, 'without a SOURCE: give one, or leave it out')
        seed = args.usual_seed if args.seed is None else args.seed
        return SimulatedRecording(args.scenario or 'occlusion', seed)
    from rgbd_kcf_tracker.recordings import open_recording

    refuse(args, 'with a SOURCE', ('scenario', 'seed'))
    return open_recording(args.source, read_options(args))


def read_options(args: argparse.Namespace) -> ReadOptions:
    """The options of :func:`add_reading_options` as the readers take them.

    Raises:
        ParameterError: for a value that cannot be.
    """
    from rgbd_kcf_tracker.recordings import ReadOptions

    return ReadOptions(
        color_topic=args.color_topic,
        depth_topic=args.depth_topic,
        info_topic=args.info_topic,
        tolerance_s=args.tolerance,
        fps=args.fps,
        intrinsics=None if args.intrinsics is None else parse_intrinsics(args.intrinsics),
        rectified=args.rectified,
        max_pixels=args.max_pixels,
    )


def refuse_reading(args: argparse.Namespace, why: str) -> None:
    """Refuse the options of :func:`add_reading_options` where they mean nothing.

    Raises:
        ParameterError: for one that is given.
    """
    from rgbd_kcf_tracker.recordings import ReadOptions

    given, usual = read_options(args), ReadOptions()
    for field in dataclasses.fields(usual):
        if getattr(given, field.name) != getattr(usual, field.name):
            option = '--' + field.name.removesuffix('_s').replace('_', '-')
            raise ParameterError(f'{option} means nothing {why}')


def parse_box(text: str) -> Box:
    """``X,Y,W,H`` as a box.

    Raises:
        BoxError: where it is none.
    """
    numbers = _numbers(text, 4)
    if numbers is None:
        raise BoxError(
            f'--init {text!r} is no box: write X,Y,W,H in pixels, such as 300,120,80,200'
        )
    try:
        return Box(*numbers)
    except BoxError as error:
        raise BoxError(f'--init {text!r}: {error}') from None


def parse_size(text: str) -> tuple[int, int]:
    """``960x540`` as width and height.

    Raises:
        ParameterError: for anything else.
    """
    found = re.fullmatch(r'\s*([0-9]{1,6})\s*[xX]\s*([0-9]{1,6})\s*', text)
    if found is None:
        raise ParameterError(f'--size is {text[:60]!r}: give WIDTHxHEIGHT, such as 960x540')
    return int(found[1]), int(found[2])


def parse_intrinsics(text: str) -> Intrinsics:
    """``FX,FY,CX,CY`` as intrinsics.

    Raises:
        ParameterError: where it is none.
    """
    numbers = _numbers(text, 4)
    if numbers is None:
        raise ParameterError(
            f'--intrinsics {text!r} is no camera: '
            'write FX,FY,CX,CY in pixels, such as 525,525,320,240'
        )
    return Intrinsics(*numbers)


def parse_assignments(items: Sequence[str]) -> dict[str, str]:
    """``key=value`` words as a mapping.

    Raises:
        ParameterError: for a word without ``=``.
    """
    values: dict[str, str] = {}
    for item in items:
        key, equals, value = item.partition('=')
        if not equals or not key:
            raise ParameterError(
                f'--param {item!r}: write key=value, and what is no parameter before --param'
            )
        values[key.strip()] = value.strip()
    return values


def tracker_parameters(args: argparse.Namespace, variant: str) -> Parameters:
    """The parameters of one tracker by ``--param``; a key may name it, as where there are several.

    Raises:
        ParameterError: for an unknown variant or parameter, a bad value, or one of another tracker.
    """
    from rgbd_kcf_tracker.parameters import with_overrides
    from rgbd_kcf_tracker.variants import default_parameters

    given: dict[str, str] = {}
    for key, value in parse_assignments(args.param).items():
        owner, dot, name = key.rpartition('.')
        if dot and owner != variant:
            raise ParameterError(f'--param {key}: the tracker is {variant}, not {owner!r}')
        given[name] = value
    return with_overrides(default_parameters(variant), given)


def require_mcap(path: str, option: str = '') -> None:
    """Refuse a bag to be written whose name says another format.

    Args:
        path: of the bag.
        option: that names it, with a space behind; empty for a plain argument.

    Raises:
        RecordingError: where it does not end in .mcap.
    """
    if Path(path).suffix != '.mcap':
        raise RecordingError(f'{option}{path} must end in .mcap: that is the format written')


def add_overwrite_option(parser: argparse._ActionsContainer, what: str) -> None:
    """Declare ``--overwrite``, which is the same for every command that writes."""
    parser.add_argument(
        '--overwrite', action='store_true', help=f'replace {what}; the source never is'
    )


def progress(items: Iterable[T], total: int | None, label: str) -> Iterator[T]:
    """``items``, with a bar if standard error is a terminal; Ctrl-C ends it between two of them.

    The bar is tqdm's, of the extra ``tools``; without it there is none.
    """
    if sys.stderr.isatty() and find_spec('tqdm') is not None:
        from tqdm import tqdm

        items = tqdm(items, total=total, desc=label, unit='frame', leave=False)
    with interrupts.held():
        interrupts.check()  # it may have come up where a library swallowed it
        for item in items:
            yield item
            interrupts.check()


@contextlib.contextmanager
def counter(total: int, unit: str) -> Iterator[Callable[[int, str], None]]:
    """A function that counts what is done, with a bar as :func:`progress` has it."""
    if not sys.stderr.isatty() or find_spec('tqdm') is None:
        yield lambda done, name: None
        return
    from tqdm import tqdm

    with tqdm(total=total, unit=unit, leave=False, smoothing=0.05) as bar:

        def count(done: int, name: str) -> None:
            bar.set_postfix_str(name, refresh=False)
            bar.update(done)

        yield count


def escaped(text: str) -> str:
    r"""``text`` for a terminal: control characters, as names in a file may hold, as ``\x1b``."""
    return re.sub(r'[\x00-\x1f\x7f-\x9f]', lambda found: repr(found.group())[1:-1], text)


def warn(text: str) -> None:
    """A warning on standard error."""
    print(f'warning: {escaped(text)}', file=sys.stderr)


class Warnings:
    """Prints the warnings of a recording, each once, as they come up."""

    def __init__(self, warnings: list[str]) -> None:
        self._warnings = warnings
        self._shown = 0

    def show(self) -> None:
        """Print those that are new."""
        for number in range(self._shown, len(self._warnings)):
            if number < _MOST_WARNINGS:
                warn(self._warnings[number])
            elif number == _MOST_WARNINGS:
                warn('further warnings are not shown: rgbd-kcf info --check lists all')
        self._shown = len(self._warnings)


def _numbers(text: str, count: int) -> tuple[float, ...] | None:
    try:
        numbers = tuple(float(word) for word in text.replace(' ', ',').split(',') if word)
    except ValueError:
        return None
    return numbers if len(numbers) == count else None
