# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Measure the live node: camera, tracker and listener as processes, and the wire beside them.

    python -m rgbd_kcf_tracker.bench.latency --sizes qhd hd --seconds 20

Latency is from the stamp, set just before the images go out, to the answer's arrival at the
listener. The camera sends to the tracker and to a node that does nothing but answer by turns: what
the tracker has on top of that means something on any machine, however busy.
"""

from __future__ import annotations

import argparse
import math
import socket
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass

import numpy as np

from rgbd_kcf_tracker.bench.camera import BLOCK, NAMESPACE, SCENARIO, SEED, SIZES, START
from rgbd_kcf_tracker.bench.domains import kept_to_this_machine
from rgbd_kcf_tracker.bench.figures import add_output_options, check_output, write_output
from rgbd_kcf_tracker.bench.rig import Listener, child, cpu_seconds, environment
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS

WARM_UP = 30
"""Pairs at the start that count as processed but not for latency: caches, pages, discovery."""
SETTLE_S = 4.0
"""Seconds in which a viewer and its browsers find each other."""
EDGES_MS = (0, 2, 4, 6, 8, 10, 12, 15, 20, 25, 33, 50, 100, 200)


@dataclass(frozen=True, slots=True)
class Figures:
    """How a node answered.

    Attributes:
        answered, boxes: pairs answered; with a box.
        median_ms, p95_ms, p99_ms, max_ms: stamp to answer at the listener.
        cpu_ms: processor time of the node's process for each pair that was sent to it.
        histogram: answers per bin of latency, bins as in EDGES_MS and one beyond.
    """

    answered: int
    boxes: int
    median_ms: float
    p95_ms: float
    p99_ms: float
    max_ms: float
    cpu_ms: float
    histogram: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Result:
    """One run's figures.

    Attributes:
        variant, size, rate_hz: what was run.
        sent: pairs to each of the two nodes.
        received, dropped: colour images that reached the tracker; pairs passed over for newer ones.
        tracker: of the tracker.
        wire: of a node that does nothing but answer.
        stages: what the tracker's diagnostics say of where the time goes.
    """

    variant: str
    size: str
    rate_hz: float
    sent: int
    received: int
    dropped: int
    tracker: Figures
    wire: Figures
    stages: dict[str, float]

    @property
    def extra_cpu(self) -> float:
        """The tracker's processor time on top of the wire's, in units of the wire's."""
        return self.tracker.cpu_ms / self.wire.cpu_ms - 1 if self.wire.cpu_ms else math.nan


def measure(
    variant: str, size: str, rate: float, seconds: float, with_profile: bool, browsers: int = 0
) -> Result:
    """Run one case, with a viewer beside it where browsers are to look.

    Raises:
        RuntimeError: where one of the nodes answers nothing, or ends.
    """
    count = round(seconds * rate) + WARM_UP
    env = environment(with_profile)
    namespace = ('--ros-args', '-r', f'__ns:={NAMESPACE}')
    tracker_arguments = (
        *namespace,
        *('-p', f'variant:={variant}', '-p', f'init_box:={first_box(size)}'),
    )
    camera_arguments = ('--size', size, '--rate', str(rate), '--count', str(count), '--wire')
    listener = Listener()
    try:
        with ExitStack() as children:
            tracker = children.enter_context(
                child('rgbd_kcf_tracker.ros.tracker_main', *tracker_arguments, env=env)
            )
            wire = children.enter_context(child('rgbd_kcf_tracker.bench.wire', env=env))
            listener.await_tracker(tracker)
            if browsers:
                _look(children, namespace, browsers, env)
            camera = children.enter_context(
                child('rgbd_kcf_tracker.bench.camera', *camera_arguments, env=env)
            )
            begin: tuple[float, float] | None = None
            nodes = {'tracker': tracker, 'wire': wire}
            while camera.poll() is None and not _ended(nodes):
                listener.spin(0.2)
                if begin is None and listener.arrivals and listener.wire:
                    begin = cpu_seconds(tracker.pid), cpu_seconds(wire.pid)
            still = time.monotonic() + 2.5  # for the last diagnostics
            while time.monotonic() < still and not _ended(nodes):
                listener.spin(0.2)
            if ended := _ended(nodes):
                raise RuntimeError(ended)
            if begin is None:
                raise RuntimeError('the tracker or the wire answered nothing')
            end = cpu_seconds(tracker.pid), cpu_seconds(wire.pid)
    finally:
        listener.close()
    diagnostics = listener.diagnostics
    spent = [(after - before) * 1e3 for before, after in zip(begin, end, strict=True)]
    # The first block has gone to the tracker when the wire answers for the first time.
    return Result(
        variant=variant,
        size=size,
        rate_hz=rate,
        sent=count,
        received=int(diagnostics.get('color_received', 0)),
        dropped=int(diagnostics.get('dropped', 0)),
        tracker=_figures(listener.arrivals, spent[0] / max(count - BLOCK, 1)),
        wire=_figures(listener.wire, spent[1] / count),
        stages={
            name: float(value)
            for name, value in diagnostics.items()
            if name.endswith(('_median_ms', '_p99_ms'))
        },
    )


def _ended(nodes: Mapping[str, subprocess.Popen[bytes]]) -> str:
    """What to say of nodes that are no more; '' while all are there."""
    return ', '.join(
        f'the {name} ended with status {node.returncode}'
        for name, node in nodes.items()
        if node.poll() is not None
    )


def _figures(arrivals: list[tuple[int, int, bool]], cpu_ms: float) -> Figures:
    latency = np.array([(came - stamp) / 1e6 for stamp, came, _ in arrivals[WARM_UP:]])
    median, p95, p99 = np.percentile(latency, (50, 95, 99)) if len(latency) else (math.nan,) * 3
    return Figures(
        answered=len(arrivals),
        boxes=sum(has_box for _, _, has_box in arrivals),
        median_ms=float(median),
        p95_ms=float(p95),
        p99_ms=float(p99),
        max_ms=float(latency.max()) if len(latency) else math.nan,
        cpu_ms=cpu_ms,
        histogram=tuple(int(n) for n in np.histogram(latency, (*EDGES_MS, np.inf))[0]),
    )


def _look(
    children: ExitStack, namespace: tuple[str, ...], browsers: int, env: dict[str, str]
) -> None:
    """Start a viewer and those who look at its page."""
    with socket.socket() as free:
        free.bind(('127.0.0.1', 0))
        port = free.getsockname()[1]
    viewer = (*namespace, '-p', f'port:={port}')
    children.enter_context(child('rgbd_kcf_tracker.ros.viewer_main', *viewer, env=env))
    for _ in range(browsers):
        children.enter_context(
            child('rgbd_kcf_tracker.bench.looker', f'http://127.0.0.1:{port}/', env=env)
        )
    time.sleep(SETTLE_S)


def first_box(size: str) -> str:
    """The target in the camera's first frame, as the tracker's init_box."""
    import itertools

    from rgbd_kcf_tracker.simulation import simulate

    scene = simulate(SCENARIO, seed=SEED, size=SIZES[size])
    box = next(itertools.islice(scene, START, None)).visible
    assert box is not None
    return ','.join(f'{v:g}' for v in box.as_tuple())


def table(results: list[Result]) -> str:
    """The figures as a Markdown table: a row for the tracker, one for the wire beside it."""
    lines = [
        '| node | images | rate, Hz | sent | answered | dropped | with box '
        '| median, ms | p95, ms | p99, ms | max, ms | CPU per pair, ms |',
        '|---|---|---|---|---|---|---|---|---|---|---|---|',
    ]
    for r in results:
        width, height = SIZES[r.size]
        for name, f in ((f'`{r.variant}`', r.tracker), ('the wire', r.wire)):
            dropped, boxes = (r.dropped, f.boxes) if f is r.tracker else ('', '')
            lines.append(
                f'| {name} | {r.size} {width}x{height} | {r.rate_hz:g} | {r.sent} '
                f'| {f.answered} | {dropped} | {boxes} | {f.median_ms:.1f} '
                f'| {f.p95_ms:.1f} | {f.p99_ms:.1f} | {f.max_ms:.1f} | {f.cpu_ms:.1f} |'
            )
    return '\n'.join(lines)


def histogram(result: Result) -> str:
    """Latencies of tracker and wire as bars of text, and what one has on top of the other."""
    lines = [f'{result.variant}, {result.size}: stamp to answer, tracker # and wire o']
    most = max(*result.tracker.histogram, *result.wire.histogram, 1)
    for index, (ours, wires) in enumerate(
        zip(result.tracker.histogram, result.wire.histogram, strict=True)
    ):
        low = EDGES_MS[index]
        high = f'{EDGES_MS[index + 1]}' if index + 1 < len(EDGES_MS) else ''
        bars = [
            f'{number:6d} {mark * round(30 * number / most):30}'
            for number, mark in ((ours, '#'), (wires, 'o'))
        ]
        lines.append(f'{low:4d} to {high:>3} ms {bars[0]} {bars[1]}'.rstrip())
    lines.append(
        f'on top of the wire: median {result.tracker.median_ms - result.wire.median_ms:.1f} ms, '
        f'processor {result.extra_cpu:.1f} times its own'
    )
    lines += [f'{name}: {value:.1f}' for name, value in result.stages.items()]
    return '\n'.join(lines)


def _measured(options: argparse.Namespace, results: list[Result]) -> bool:
    """Add each case that was asked for to the results; False where one cannot be measured."""
    for variant in options.variants:
        for size in options.sizes:
            print(f'{variant} at {size}, {options.seconds:g} s ...', file=sys.stderr)
            try:
                results.append(
                    measure(
                        variant,
                        size,
                        options.rate,
                        options.seconds,
                        not options.no_profile,
                        options.browsers,
                    )
                )
            except RuntimeError as error:
                print(f'{variant} at {size}: {error}', file=sys.stderr)
                return False
    return True


def main(args: list[str] | None = None) -> int:
    """Measure, print the table and the histograms.

    Returns:
        The exit status: 1 where a pair was not answered, 2 where a node ended or none was.
    """
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.latency',
        description=(__doc__ or '').split('\n')[0],
    )
    parser.add_argument('--variants', nargs='+', choices=VARIANTS, default=[DEFAULT_VARIANT])
    parser.add_argument('--sizes', nargs='+', choices=SIZES, default=['sd', 'qhd', 'hd'])
    parser.add_argument('--rate', type=float, default=30.0, help='pairs per second')
    parser.add_argument('--seconds', type=float, default=10.0, help='of each case')
    parser.add_argument(
        '--browsers',
        type=int,
        default=0,
        help='that look at a viewer meanwhile (default: no viewer)',
    )
    parser.add_argument('--no-profile', action='store_true', help="use DDS's default transports")
    add_output_options(parser)
    options = parser.parse_args(args)
    # Processor time is counted from the second block on: in the first the nodes still start up.
    least = BLOCK - WARM_UP + 1
    if not (0 < options.rate < math.inf and least <= options.seconds * options.rate < math.inf):
        parser.error(f'--seconds and --rate must be numbers that give {least} pairs or more')
    results: list[Result] = []
    failed = False
    try:
        check_output(options)
        with kept_to_this_machine():
            failed = not _measured(options, results)
        if results:
            print(table(results))
        for result in results:
            print('\n' + histogram(result))
        write_output(options, [asdict(r) for r in results])
    except RgbdKcfError as error:
        parser.error(str(error))
    if failed:
        return 2
    return 0 if all(r.tracker.answered == r.sent for r in results) else 1


if __name__ == '__main__':
    sys.exit(main())
