# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Run the live node at full speed for long, and see whether memory stays flat and speed stays up.

    python -m rgbd_kcf_tracker.bench.soak --frames 100000

The camera sends a pair as soon as an earlier one is answered; both are processes of their own.
"""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import ExitStack
from dataclasses import asdict, dataclass

import numpy as np

from rgbd_kcf_tracker.bench.camera import NAMESPACE, SIZES
from rgbd_kcf_tracker.bench.domains import kept_to_this_machine
from rgbd_kcf_tracker.bench.figures import add_output_options, check_output, write_output
from rgbd_kcf_tracker.bench.latency import first_box
from rgbd_kcf_tracker.bench.rig import Listener, child, environment, resident_mb
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS

SAMPLES = 100
SETTLED = 0.2
"""Share of the run after which memory must not grow any more."""
GROWTH_MB = 20.0
SLOWING = 0.85


@dataclass(frozen=True, slots=True)
class Soak:
    """The figures of a run.

    Attributes:
        sent, answered, boxes: pairs, answers, answers with a box.
        seconds: from the first answer to the last.
        first_hz, last_hz: answers per second in the first and last quarter.
        settled_mb, end_mb, peak_mb: memory of the node after a fifth of the run, at the end, and
            the most.
    """

    sent: int
    answered: int
    boxes: int
    seconds: float
    first_hz: float
    last_hz: float
    settled_mb: float
    end_mb: float
    peak_mb: float

    @property
    def sound(self) -> bool:
        """Nothing lost, memory flat, no slowing."""
        return (
            self.answered == self.sent
            and self.end_mb - self.settled_mb < GROWTH_MB
            and self.last_hz > SLOWING * self.first_hz
        )


def run(frames: int, size: str, variant: str) -> Soak:
    """Send ``frames`` pairs and watch.

    Raises:
        RuntimeError: where the node stops answering.
    """
    env = environment()
    tracker_arguments = (
        *('--ros-args', '-r', f'__ns:={NAMESPACE}', '-p', f'variant:={variant}'),
        *('-p', f'init_box:={first_box(size)}', '-p', 'queue_policy:=all'),
    )
    camera_arguments = ('--size', size, '--rate', '0', '--count', str(frames))
    samples: list[tuple[int, float, float]] = []
    listener = Listener()
    try:
        with ExitStack() as children:
            tracker = children.enter_context(
                child('rgbd_kcf_tracker.ros.tracker_main', *tracker_arguments, env=env)
            )
            listener.await_tracker(tracker)
            camera = children.enter_context(
                child('rgbd_kcf_tracker.bench.camera', *camera_arguments, env=env)
            )
            while camera.poll() is None and tracker.poll() is None:
                listener.spin(0.2)
                done = len(listener.arrivals)
                if done and done >= len(samples) * frames / SAMPLES:
                    samples.append((done, time.monotonic(), resident_mb(tracker.pid)))
            if tracker.poll() is not None or not samples:
                raise RuntimeError(f'the tracker stopped after {len(listener.arrivals)} answers')
            samples.append((len(listener.arrivals), time.monotonic(), resident_mb(tracker.pid)))
            if len(listener.arrivals) < frames:
                print(f'diagnostics at the end: {listener.diagnostics}', file=sys.stderr)
    finally:
        listener.close()
    arrived = np.array([came for _, came, _ in listener.arrivals], dtype=np.int64)
    quarter = max(len(arrived) // 4, 2)
    memory = [mb for done, _, mb in samples if done >= SETTLED * frames]
    if not memory or len(arrived) < 2:
        raise RuntimeError(f'only {len(arrived)} of {frames} pairs were answered')
    return Soak(
        sent=frames,
        answered=len(arrived),
        boxes=sum(has_box for _, _, has_box in listener.arrivals),
        seconds=float(arrived[-1] - arrived[0]) / 1e9,
        first_hz=_rate(arrived[:quarter]),
        last_hz=_rate(arrived[-quarter:]),
        settled_mb=memory[0],
        end_mb=memory[-1],
        peak_mb=max(mb for _, _, mb in samples),
    )


def _rate(arrived: np.ndarray[tuple[int], np.dtype[np.int64]]) -> float:
    return (len(arrived) - 1) / max(float(arrived[-1] - arrived[0]) / 1e9, 1e-9)


def main(args: list[str] | None = None) -> int:
    """Run and report; status 1 where memory grew, speed fell or an answer was lost."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.soak', description=(__doc__ or '').split('\n')[0]
    )
    parser.add_argument('--frames', type=int, default=100_000)
    parser.add_argument('--size', choices=SIZES, default='small')
    parser.add_argument('--variant', choices=VARIANTS, default=DEFAULT_VARIANT)
    add_output_options(parser)
    options = parser.parse_args(args)
    try:
        check_output(options)
        with kept_to_this_machine():
            soak = run(options.frames, options.size, options.variant)
    except RgbdKcfError as error:
        parser.error(str(error))
    except RuntimeError as error:
        print(f'{parser.prog}: {error}', file=sys.stderr)
        return 2
    print(
        f'{soak.answered} of {soak.sent} pairs answered, {soak.boxes} with a box, in '
        f'{soak.seconds:.0f} s\n'
        f'rate    {soak.first_hz:.0f} Hz in the first quarter, {soak.last_hz:.0f} Hz in the last\n'
        f'memory  {soak.settled_mb:.1f} MB settled, {soak.end_mb:.1f} MB at the end, '
        f'{soak.peak_mb:.1f} MB at most\n'
        f'{"sound" if soak.sound else "NOT SOUND"}'
    )
    write_output(options, asdict(soak))
    return 0 if soak.sound else 1


if __name__ == '__main__':
    sys.exit(main())
