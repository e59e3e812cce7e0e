# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf track``: follow one target, several, or everyone through a recording."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rgbd_kcf_tracker.cli import track_many
from rgbd_kcf_tracker.cli.common import (
    SOURCE_HELP,
    Warnings,
    add_overwrite_option,
    add_reading_options,
    add_tracker_options,
    escaped,
    parse_box,
    progress,
    read_options,
    require_mcap,
    tracker_parameters,
)
from rgbd_kcf_tracker.errors import BoxError, ParameterError, RecordingError

if TYPE_CHECKING:
    from rgbd_kcf_tracker.evaluation.metrics import Measures
    from rgbd_kcf_tracker.frame import Frame
    from rgbd_kcf_tracker.geometry import Box
    from rgbd_kcf_tracker.recordings import Recording
    from rgbd_kcf_tracker.track import Track, Tracker

NAME = 'track'
HELP = 'follow one target, several, or everyone through a recording, and write where they are'
_SAME_TARGET_IOU = 0.5

ONLY = 1
"""The id of a target that is followed alone, where one is written."""

_OTHER_VIDEOS = ('.avi', '.webm')
"""How names of videos end that are not written: text in such a file is a mistake, too."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = track_many.EPILOG
    parser.add_argument(
        'source', nargs='*', metavar='SOURCE', help=f'{SOURCE_HELP}; several, and globs, see below'
    )
    parser.add_argument(
        '--init',
        metavar='X,Y,W,H',
        action='append',
        default=[],
        help="a target's box in the first frame read, in pixels from the top left corner; may be "
        'given again, for several targets (default: the first ground-truth box)',
    )
    parser.add_argument(
        '--all',
        action='store_true',
        help='follow every person that appears, without being told',
    )
    add_tracker_options(parser)
    parser.add_argument('--end', metavar='N', type=int, help='frame to stop before (default: all)')
    output = parser.add_argument_group('output')
    output.add_argument(
        '--output',
        metavar='FILE.csv',
        help='a row per frame, or per frame and target; - for standard output',
    )
    output.add_argument(
        '--mot', metavar='FILE.txt', help='boxes with ids, as MOT Challenge text: frames from 1'
    )
    output.add_argument('--video', metavar='FILE.mp4', help='the frames with the box drawn on them')
    output.add_argument(
        '--bag', metavar='FILE.mcap', help="the frames with the tracker's topics beside them"
    )
    add_overwrite_option(output, 'files that are there')
    track_many.add_options(parser)
    add_reading_options(parser)


def run(args: argparse.Namespace) -> int:
    """Track, write, and print a summary."""
    if track_many.is_asked(args):
        return track_many.run(args)
    (args.source,) = args.source
    print(escaped(str(follow(args))), file=sys.stderr if args.output == '-' else sys.stdout)
    return 0


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came out of one recording.

    Attributes:
        recording: its name.
        variant: the tracker.
        frames: that were read.
        targets: ids that were given; None where one target is followed.
        states: frames (and targets) by state.
        measures: against the ground truth, None where that is of nobody or somebody else.
        rate: frames a second.
        written: files.
        warnings: what was odd.
    """

    recording: str
    variant: str
    frames: int
    targets: int | None
    states: Mapping[str, int]
    measures: Measures | None
    rate: float
    written: tuple[str, ...]
    warnings: tuple[str, ...]

    def __str__(self) -> str:
        states = ', '.join(f'{count} {state}' for state, count in self.states.items())
        line = f'{self.recording}: {self.frames} frames with {self.variant}: '
        if self.targets is not None:
            line += f'{self.targets} targets: '
        line += states or 'nobody'
        if self.measures is not None:
            m = self.measures
            line += f'; success {m.success:.3f}, IoU {m.iou:.3f}, strangers {m.strangers:.3f} '
            line += 'against the ground truth'
        line += f'; {self.rate:.0f} frames/s'
        return f'{line}; wrote {", ".join(self.written)}' if self.written else line


def follow(args: argparse.Namespace, watched: bool = True) -> Outcome:
    """Follow targets through one recording.

    Args:
        args: the options, ``source`` being one path.
        watched: show a bar and warnings as they come.
    """
    from rgbd_kcf_tracker.recordings import open_recording
    from rgbd_kcf_tracker.track import require_inside

    _check_outputs(args)
    follower = make_follower(args)
    given = [parse_box(text) for text in args.init]
    with open_recording(args.source, read_options(args)) as recording:
        start, end = _frame_range(args, recording)
        warnings = Warnings(recording.warnings)
        if watched:
            warnings.show()
        given, first = _first_boxes(args, given, recording, start, end)
        counts: Counter[str] = Counter()
        boxes: list[Box | None] = []
        ids: set[int] = set()
        read = 0
        spent = 0.0
        sinks: _Sinks | None = None
        with ExitStack() as stack:
            frames: Iterable[Frame] = recording.frames(start, end)
            if watched:
                frames = progress(frames, end - start, NAME)
            for number, frame in enumerate(frames, start=start):
                if sinks is None:
                    for box in given if number == first else ():
                        require_inside(box, frame)
                    # Opened only now, so that a box outside the image leaves no empty files.
                    sinks = _Sinks(args, recording, stack)
                begun = time.perf_counter()
                tracks = follower.follow(frame, given if number == first else ())
                spent += time.perf_counter() - begun
                counts.update(track.state.value for track in tracks.values())
                ids.update(tracks)
                read += 1
                if not follower.several:
                    boxes.append(tracks[ONLY].box)
                sinks.write(number, frame, tracks)
                if watched:
                    warnings.show()
            if watched:
                warnings.show()
        measures = None
        if not follower.several:
            measures = _measures(boxes[first - start :], recording, first, given[0])
        return Outcome(
            recording.name,
            follower.variant,
            read,
            len(ids) if follower.several else None,
            dict(counts),
            measures,
            read / spent if spent > 0 else 0.0,
            tuple(sinks.written) if sinks is not None else (),
            tuple(recording.warnings),
        )


def _measures(
    boxes: list[Box | None], recording: Recording, first: int, start: Box
) -> Measures | None:
    """How the boxes compare with the ground truth, if that is of the same target."""
    if recording.groundtruth is None:
        return None
    truth = recording.groundtruth[first : first + len(boxes)]
    if len(truth) < 2 or truth[0] is None or truth[0].iou(start) < _SAME_TARGET_IOU:
        return None
    from rgbd_kcf_tracker.evaluation.metrics import measure_boxes

    body = recording.groundtruth_body
    bodies = None if body is None else body[first : first + len(truth)]
    if bodies is not None and len(bodies) < len(truth):
        bodies = None
    return measure_boxes(boxes[: len(truth)], truth, bodies)


class _Sinks:
    """The outputs that were asked for, closed with ``stack``."""

    def __init__(self, args: argparse.Namespace, recording: Recording, stack: ExitStack) -> None:
        from rgbd_kcf_tracker.recordings import (
            BagWriter,
            MotWriter,
            TrackCsvWriter,
            TracksCsvWriter,
            VideoWriter,
        )
        from rgbd_kcf_tracker.recordings.copying import output_topics

        self.several = _several(args)
        self.truth = recording.groundtruth
        self.body = recording.groundtruth_body
        self.written = [p for p in (args.output, args.mot, args.video, args.bag) if p and p != '-']
        self.csv = self.table = self.mot = self.video = self.bag = None
        if args.output and self.several:
            self.table = TracksCsvWriter(args.output, args.overwrite)
            stack.enter_context(self.table)
        elif args.output:
            self.csv = stack.enter_context(TrackCsvWriter(args.output, args.overwrite))
        if args.mot:
            self.mot = stack.enter_context(MotWriter(args.mot, args.overwrite))
        if args.video:
            rate = recording.info().rate_hz or args.fps
            self.video = stack.enter_context(VideoWriter(args.video, rate, args.overwrite))
        if args.bag:
            topics, depth_encoding = output_topics(recording)
            self.bag = stack.enter_context(
                BagWriter(
                    args.bag,
                    topics,
                    depth_encoding=depth_encoding,
                    annotate=True,
                    overwrite=args.overwrite,
                )
            )

    def write(self, number: int, frame: Frame, tracks: Mapping[int, Track]) -> None:
        if self.mot is not None:
            self.mot.write_tracks(number, tracks)
        if self.several:
            if self.table is not None:
                self.table.write_tracks(number, frame.stamp_ns, tracks)
            if self.video is not None:
                self.video.write_tracks(frame, tracks, f'frame {number}')
            return
        track = tracks[ONLY]
        annotated = self.truth is not None and number < len(self.truth)
        truth = self.truth[number] if self.truth is not None and annotated else None
        if self.csv is not None:
            self.csv.write_track(number, frame.stamp_ns, track)
        if self.video is not None:
            words = ('' if truth is None else 'truth white   ') + f'frame {number}'
            self.video.write_track(frame, track, truth, words)
        if self.bag is not None:
            self.bag.write_frame(frame)
            if annotated:
                body = self.body[number] if self.body and number < len(self.body) else None
                self.bag.write_truth(frame, truth, body)
            self.bag.write_track(frame, track)


class _One:
    """One target, whose id is :data:`ONLY`."""

    several = False

    def __init__(self, tracker: Tracker, variant: str) -> None:
        self._tracker, self.variant = tracker, variant

    def follow(self, frame: Frame, boxes: Sequence[Box]) -> Mapping[int, Track]:
        """The track in ``frame``; boxes where the target is given."""
        if boxes:
            return {ONLY: self._tracker.start(frame, boxes[0])}
        return {ONLY: self._tracker.update(frame)}


class _Several:
    """Several targets, or everyone."""

    several = True

    def __init__(self, targets: Any, variant: str, everyone: bool) -> None:
        self._targets, self.variant = targets, variant
        targets.everyone = everyone

    def follow(self, frame: Frame, boxes: Sequence[Box]) -> Mapping[int, Track]:
        """The tracks in ``frame`` by id; boxes where targets are given."""
        tracks: dict[int, Track] = {}
        if self._targets.everyone or not boxes:
            tracks.update(self._targets.update(frame))
        for box in boxes:
            who = self._targets.add(frame, box)
            tracks[who] = self._targets.started(who)
        return tracks


def _several(args: argparse.Namespace) -> bool:
    return bool(args.all) or len(args.init) > 1


def make_follower(args: argparse.Namespace) -> _One | _Several:
    """What follows the targets that were asked for.

    Raises:
        ParameterError: for an unknown variant or parameter, or options that do not go together.
    """
    import rgbd_kcf_tracker
    from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, create_tracker

    variant = args.variant or DEFAULT_VARIANT
    parameters = tracker_parameters(args, variant)
    if not _several(args):
        return _One(create_tracker(variant, parameters), variant)
    if args.bag:
        raise ParameterError('--bag holds one target: leave it out, or give one --init')
    targets = rgbd_kcf_tracker.TargetSet(variant, parameters)  # type: ignore[attr-defined]
    return _Several(targets, variant, args.all)


def _check_outputs(args: argparse.Namespace) -> None:
    """Refuse outputs that cannot be written, or must not, before anything is done."""
    from rgbd_kcf_tracker.recordings.files import require_source
    from rgbd_kcf_tracker.recordings.outputs import check_outputs
    from rgbd_kcf_tracker.recordings.storage import BAG_SUFFIXES
    from rgbd_kcf_tracker.recordings.video import SUFFIXES, require_video

    require_source(args.source)
    if args.output and args.output.endswith('.parquet'):
        raise ParameterError(
            f'--output {args.output} would be CSV: Parquet is written into a folder, '
            'by --table parquet --output FOLDER'
        )
    if args.output == '-' and sys.__stdout__ is None:
        raise ParameterError('--output - is standard output, which is closed: give a file')
    outputs = {f'--{name}': getattr(args, name) for name in ('output', 'mot', 'video', 'bag')}
    if outputs['--output'] == '-':
        del outputs['--output']
    written = {option: path for option, path in outputs.items() if path}
    check_outputs(written, [args.source], args.overwrite)
    for option, form in (('--output', 'CSV'), ('--mot', 'MOT Challenge text')):
        path = written.get(option, '')
        if path.lower().endswith((*SUFFIXES, *_OTHER_VIDEOS, *BAG_SUFFIXES)):
            raise ParameterError(
                f'{option} {path} would be {form}: by its name it is a video or a bag, which '
                '--video and --bag write'
            )
    if args.bag:
        require_mcap(args.bag, '--bag ')
    if args.video:
        require_video(args.video)


def _frame_range(args: argparse.Namespace, recording: Recording) -> tuple[int, int]:
    count = len(recording)
    if count == 0:
        raise RecordingError(f'{recording.path} holds no frames: nothing to track')
    end = count if args.end is None else min(args.end, count)
    if not 0 <= args.start < count:
        raise ParameterError(f'--start {args.start}: the recording has frames 0 to {count - 1}')
    if end <= args.start:
        raise ParameterError(f'--end {args.end}: it must be above --start {args.start}')
    return args.start, end


def _first_boxes(
    args: argparse.Namespace, given: list[Box], recording: Recording, start: int, end: int
) -> tuple[list[Box], int]:
    """The boxes to start on, and the frame they are for."""
    if given or args.all:
        return given, start
    truth = recording.groundtruth
    if truth is None:
        raise BoxError(
            f'{recording.path} has no ground truth: give the target as --init X,Y,W,H '
            f'(pixels in frame {start}), or --all for every person'
        )
    for number in range(start, min(end, len(truth))):
        box = truth[number]
        if box is not None:
            return [box], number
    raise BoxError(
        f'the ground truth has no box from frame {start} to {end - 1}: '
        'give the target as --init X,Y,W,H, or another range'
    )
