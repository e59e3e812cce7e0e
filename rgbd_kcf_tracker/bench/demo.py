# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The whole system at work, without a camera: ``python -m rgbd_kcf_tracker.bench.demo DEST``.

Simulates a recording of a Kinect V2, has the real replay node send it over DDS to the real tracker
node, records what comes back, and leaves bag, boxes, video and pictures in a folder. The nodes run
twice: in lock-step, where every frame counts, and at the camera's rate, for what it takes.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tqdm import tqdm

from rgbd_kcf_tracker.bench.demo_nodes import DemoError, last_line, node
from rgbd_kcf_tracker.bench.domains import kept_to_this_machine
from rgbd_kcf_tracker.cli.common import add_overwrite_option
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.outputs import check_outputs
from rgbd_kcf_tracker.track import Track
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS

if TYPE_CHECKING:
    from rgbd_kcf_tracker.simulation.sequence import SimulatedSequence

SCENARIO, SEED = 'occlusion', 4
STARTUP_S = 60.0
STALL_S = 60.0


@dataclass(frozen=True, slots=True)
class Truth:
    """What is known of the simulated frames, one element per frame."""

    stamps: list[int]
    visible: list[Box | None]
    body: list[Box | None]


@dataclass(frozen=True, slots=True)
class Run:
    """One run of the nodes: answers by stamp, and replay's figures."""

    tracks: dict[int, Track]
    figures: dict[str, Any]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the demo; 0 when it came to its end."""
    options = _parse(arguments)
    began = time.monotonic()
    try:
        _demo(options)
    except RgbdKcfError as error:
        print(f'demo: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print('demo: stopped', file=sys.stderr)
        return 130
    print(f'\nDone in {time.monotonic() - began:.0f} s.')
    return 0


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog='demo', description='Show replay and tracker at work.')
    parser.add_argument('dest', type=Path, help='folder for the results')
    parser.add_argument('--variant', choices=tuple(VARIANTS), default=DEFAULT_VARIANT)
    parser.add_argument('--scenario', default=SCENARIO, help='see rgbd-kcf simulate --list')
    parser.add_argument('--seed', type=int, default=SEED)
    parser.add_argument('--seconds', type=float, default=10.0, help='length of the recording')
    parser.add_argument('--rate', type=float, default=30.0, help='frames per second')
    parser.add_argument('--size', default='960x540', metavar='WxH', help='of the images')
    add_overwrite_option(parser, 'the results of an earlier run')
    return parser.parse_args(arguments)


def _demo(options: argparse.Namespace) -> None:
    dest: Path = options.dest
    logs = dest / 'log'
    check_outputs({'DEST': dest}, overwrite=options.overwrite, folders=('DEST',))
    sequence = _sequence(options)  # before anything is made: what is refused leaves nothing
    try:
        logs.mkdir(parents=True, exist_ok=True)
        for old in logs.glob('*.log'):
            old.unlink()
    except OSError as error:
        raise DemoError(f'{dest} cannot be written: {error.strerror or error}') from None
    bag = dest / 'recording.mcap'
    with kept_to_this_machine(logs):
        truth = _simulate(sequence, bag)
        lockstep = _run(options, truth, bag, logs, lockstep=True, record=dest / 'tracker.mcap')
        live = _run(options, truth, bag, logs, lockstep=False, record=None)
    ordered = [lockstep.tracks.get(stamp) for stamp in truth.stamps]
    _write_results(options, truth, ordered, bag, dest)
    _print_table(options, truth, lockstep, live)
    print()
    for name, words in (
        ('recording.mcap', 'the simulated camera: images and ground truth'),
        ('tracker.mcap', "the tracker's topics, as recorded"),
        ('boxes.csv', 'a row per frame'),
        ('tracked.mp4', 'green: the tracker; thin white line: the truth'),
        ('contact_sheet.png', 'the run on one page'),
    ):
        print(f'  {dest / name!s:28} {words}')
    command = Path(sys.executable).with_name('rgbd-kcf')
    here = Path.cwd()
    shown = command.relative_to(here) if command.is_relative_to(here) else command
    print(f'\nSee it in a browser: {shown} view {bag} --variant {options.variant}')


def _sequence(options: argparse.Namespace) -> SimulatedSequence:
    """What is to be rendered.

    Raises:
        RgbdKcfError: for options of which no recording is made.
    """
    from rgbd_kcf_tracker.cli.common import parse_size
    from rgbd_kcf_tracker.errors import ParameterError
    from rgbd_kcf_tracker.simulation import simulate

    try:
        width, height = parse_size(options.size)
    except ParameterError as error:
        raise DemoError(str(error)) from None
    sequence = simulate(
        options.scenario, options.seed, options.rate, options.seconds, (width, height)
    )
    if sequence[0].visible is None:
        raise DemoError(
            f'seed {options.seed} of {options.scenario} begins with the target hidden: '
            'choose another'
        )
    return sequence


def _simulate(sequence: SimulatedSequence, bag: Path) -> Truth:
    from rgbd_kcf_tracker.recordings import KINECT2_QHD, BagWriter

    truth = Truth([], [], [])
    with BagWriter(bag, KINECT2_QHD, overwrite=True) as writer:
        for made in _progress(sequence, len(sequence), '1/4 simulate a Kinect V2'):
            writer.write_frame(made.frame)
            writer.write_truth(made.frame, made.visible, made.body)
            truth.stamps.append(made.frame.stamp_ns)
            truth.visible.append(made.visible)
            truth.body.append(made.body)
    return truth


def _run(
    options: argparse.Namespace,
    truth: Truth,
    bag: Path,
    logs: Path,
    *,
    lockstep: bool,
    record: Path | None,
) -> Run:
    """Both nodes over the recording, and what the tracker published."""
    from rgbd_kcf_tracker.bench.demo_recorder import Recorder
    from rgbd_kcf_tracker.recordings import KINECT2_QHD as TOPICS

    first = truth.visible[0]
    assert first is not None
    report = logs / 'replay.json'
    report.unlink(missing_ok=True)
    tracker_parameters = {
        'variant': options.variant,
        'init_box': ','.join(f'{v:g}' for v in first.as_tuple()),
        'queue_policy': 'all' if lockstep else 'newest',
    }
    remaps = {
        'color/image': TOPICS.color,
        'depth/image': TOPICS.depth,
        'color/camera_info': TOPICS.info,
    }
    replay_parameters = {'bag': str(bag), 'lockstep': lockstep, 'report': str(report)}
    step = '2/4 track, in lock-step' if lockstep else f'3/4 track live, {options.rate:g} Hz'
    with Recorder() as recorder:
        with node('tracker', tracker_parameters, remaps, logs) as tracker:
            _await(lambda: recorder.hears_tracker, [tracker], 'the tracker', logs / 'tracker.log')
            with node('replay', replay_parameters, {}, logs) as replay:
                _follow(recorder, replay, tracker, len(truth.stamps), step, logs)
        tracks = recorder.tracks()
        if record is not None:
            recorder.write(record)
    if not report.exists():
        raise DemoError(f'replay left no report: {last_line(logs / "replay.log")}')
    return Run(tracks, json.loads(report.read_text(encoding='utf-8')))


def _await(condition: Any, processes: Sequence[Any], what: str, log: Path) -> None:
    end = time.monotonic() + STARTUP_S
    while not condition():
        if any(p.poll() is not None for p in processes) or time.monotonic() > end:
            raise DemoError(f'{what} did not come up: {last_line(log)}')
        time.sleep(0.02)


def _follow(recorder: Any, replay: Any, tracker: Any, count: int, step: str, logs: Path) -> None:
    """Show the answers as they come, until replay has ended."""
    with _bar(count, step) as bar:
        moved = time.monotonic()
        while replay.poll() is None:
            seen = recorder.count
            if seen > bar.n:
                moved = time.monotonic()
                bar.update(seen - bar.n)
            if tracker.poll() is not None:
                raise DemoError(f'the tracker ended: {last_line(logs / "tracker.log")}')
            if time.monotonic() - moved > STALL_S:
                raise DemoError(f'no answers for {STALL_S:g} s: {last_line(logs / "replay.log")}')
            time.sleep(0.05)
        time.sleep(0.2)  # the last answers may still be on their way here
        bar.update(recorder.count - bar.n)


def _write_results(
    options: argparse.Namespace,
    truth: Truth,
    tracks: Sequence[Track | None],
    bag: Path,
    dest: Path,
) -> None:
    import cv2

    from rgbd_kcf_tracker.bench.demo_pictures import chosen, contact_sheet, thumbnail
    from rgbd_kcf_tracker.recordings import TrackCsvWriter, VideoWriter, open_recording
    from rgbd_kcf_tracker.track import TrackState

    nothing = Track(None, TrackState.IDLE)
    shown = set(chosen(len(tracks)))
    cells = []
    with (
        open_recording(bag) as recording,
        TrackCsvWriter(dest / 'boxes.csv', overwrite=True) as table,
        VideoWriter(dest / 'tracked.mp4', options.rate, overwrite=True) as video,
    ):
        frames = _progress(recording.frames(), len(tracks), '4/4 draw')
        for number, frame in enumerate(frames):
            track = tracks[number] or nothing
            table.write_track(number, frame.stamp_ns, track)
            caption = f'frame {number}   {number / options.rate:.1f} s'
            box = truth.visible[number]
            video.write_track(frame, track, box, caption)
            if number in shown:
                cells.append(thumbnail(frame.color, track, box, caption))
    page = contact_sheet(
        cells,
        f'{options.variant} on simulated Kinect V2 frames: {options.scenario}, seed {options.seed}',
        f'{len(tracks)} frames of {options.size} at {options.rate:g} Hz through the replay and '
        'tracker nodes in lock-step; coloured box: the tracker, thin white box: the truth',
        tracks,
        truth.visible,
        options.rate,
    )
    if not cv2.imwrite(str(dest / 'contact_sheet.png'), page):
        raise DemoError(f'{dest / "contact_sheet.png"} cannot be written')


def _print_table(options: argparse.Namespace, truth: Truth, lockstep: Run, live: Run) -> None:
    from rgbd_kcf_tracker.evaluation.metrics import measure_boxes

    print(f'\nTracker {options.variant}, {options.size}, against the exact ground truth:\n')
    print(f'{"":24} {"lock-step":>10} {f"live {options.rate:g} Hz":>12}')
    columns = []
    for run in (lockstep, live):
        boxes = [_box_of(run.tracks.get(stamp)) for stamp in truth.stamps]
        measures = measure_boxes(boxes, truth.visible, truth.body)
        latency = run.figures['latency_ms'] or {'median': float('nan'), 'p99': float('nan')}
        columns.append(
            {
                'frames sent': f'{run.figures["color_images"]}',
                'frames answered': f'{len(run.tracks)}',
                'boxes': f'{sum(box is not None for box in boxes)}',
                'success, IoU > 0.5': f'{100 * measures.success:.1f} %',
                'mean IoU when visible': f'{100 * measures.iou:.1f} %',
                'recall of absence': f'{100 * measures.recall_of_absence:.1f} %',
                'strangers': f'{100 * measures.strangers:.1f} %',
                'frame rate': f'{run.figures["rate_hz"]:.1f} Hz',
                'latency, median': f'{latency["median"]:.1f} ms',
                'latency, p99': f'{latency["p99"]:.1f} ms',
            }
        )
    for name in columns[0]:
        print(f'{name:24} {columns[0][name]:>10} {columns[1][name]:>12}')
    visible = sum(box is not None for box in truth.visible)
    print(f'\nThe target is in sight in {visible} of {len(truth.visible)} frames.')


def _box_of(track: Track | None) -> Box | None:
    return None if track is None else track.box


def _bar(total: int, step: str) -> Any:
    return _progress(None, total, step)


def _progress(items: Any, total: int, step: str) -> Any:
    seldom = 0.2 if sys.stderr.isatty() else 5.0  # a log file wants few lines
    return tqdm(
        items,
        total=total,
        desc=f'{step:26}',
        unit='frame',
        ascii=True,
        dynamic_ncols=True,
        mininterval=seldom,
    )


if __name__ == '__main__':
    sys.exit(main())
