# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Measure the live node: a camera in one process, the tracker in another, a listener in a third.

    python -m rgbd_kcf_tracker.bench.live --sizes qhd hd --seconds 20

Latency is from the stamp, set just before the images go out, to the box's arrival at the listener.
"""

from __future__ import annotations

import argparse
import json
import socket
import sys
import time
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.bench.camera import NAMESPACE, SCENARIO, SEED, SIZES, START
from rgbd_kcf_tracker.bench.rig import Listener, child, cpu_seconds, environment
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS

WARM_UP = 30
"""Pairs at the start that count as processed but not for latency: caches, pages, discovery."""
SETTLE_S = 4.0
"""Seconds in which a viewer and its browsers find each other."""
EDGES_MS = (0, 2, 4, 6, 8, 10, 12, 15, 20, 25, 33, 50, 100, 200)


@dataclass(frozen=True, slots=True)
class Result:
    """One run's figures.

    Attributes:
        variant, size, rate_hz: what was run.
        sent, received, processed, dropped, boxes: pairs; colour images that reached the node;
            answers; pairs passed over for newer ones; answers with a box.
        median_ms, p95_ms, p99_ms, max_ms: stamp to box at the listener.
        cpu_cores: processor time of the tracker's process per second.
        histogram: answers per bin of latency, bins as in EDGES_MS and one beyond.
    """

    variant: str
    size: str
    rate_hz: float
    sent: int
    received: int
    processed: int
    dropped: int
    boxes: int
    median_ms: float
    p95_ms: float
    p99_ms: float
    max_ms: float
    cpu_cores: float
    histogram: tuple[int, ...]


def measure(
    variant: str, size: str, rate: float, seconds: float, with_profile: bool, browsers: int = 0
) -> Result:
    """Run one case, with a viewer beside it where browsers are to look.

    Raises:
        RuntimeError: where the tracker answers nothing.
    """
    count = round(seconds * rate) + WARM_UP
    env = environment(with_profile)
    namespace = ('--ros-args', '-r', f'__ns:={NAMESPACE}')
    tracker_arguments = (
        *namespace,
        *('-p', f'variant:={variant}', '-p', f'init_box:={first_box(size)}'),
    )
    camera_arguments = ('--size', size, '--rate', str(rate), '--count', str(count))
    listener = Listener()
    try:
        with ExitStack() as children:
            tracker = children.enter_context(
                child('rgbd_kcf_tracker.ros.tracker_main', *tracker_arguments, env=env)
            )
            listener.await_tracker(tracker)
            if browsers:
                _look(children, namespace, browsers, env)
            camera = children.enter_context(
                child('rgbd_kcf_tracker.bench.camera', *camera_arguments, env=env)
            )
            begin: tuple[float, float] | None = None
            end = (0.0, 0.0)
            while camera.poll() is None and tracker.poll() is None:
                listener.spin(0.2)
                if len(listener.arrivals) >= WARM_UP and begin is None:
                    begin = time.monotonic(), cpu_seconds(tracker.pid)
                if len(listener.arrivals) < count and tracker.poll() is None:
                    end = time.monotonic(), cpu_seconds(tracker.pid)
            if begin is None:
                raise RuntimeError('the tracker answered nothing')
            still = time.monotonic() + 2.5  # for the last diagnostics
            while time.monotonic() < still:
                listener.spin(0.2)
    finally:
        listener.close()
    arrivals = listener.arrivals
    latency = np.array([(came - stamp) / 1e6 for stamp, came, _ in arrivals[WARM_UP:]])
    bins = np.histogram(latency, (*EDGES_MS, np.inf))[0]
    median, p95, p99 = np.percentile(latency, (50, 95, 99))
    return Result(
        variant=variant,
        size=size,
        rate_hz=rate,
        sent=count,
        received=int(listener.diagnostics.get('color_received', 0)),
        processed=len(arrivals),
        dropped=int(listener.diagnostics.get('dropped', 0)),
        boxes=sum(has_box for _, _, has_box in arrivals),
        median_ms=float(median),
        p95_ms=float(p95),
        p99_ms=float(p99),
        max_ms=float(latency.max()),
        cpu_cores=(end[1] - begin[1]) / max(end[0] - begin[0], 1e-9),
        histogram=tuple(int(n) for n in bins),
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
    """The figures as a Markdown table."""
    lines = [
        '| variant | images | rate, Hz | sent | received | processed | dropped | with box '
        '| median, ms | p95, ms | p99, ms | max, ms | node CPU, cores |',
        '|---|---|---|---|---|---|---|---|---|---|---|---|---|',
    ]
    for r in results:
        width, height = SIZES[r.size]
        lines.append(
            f'| `{r.variant}` | {r.size} {width}x{height} | {r.rate_hz:g} | {r.sent} '
            f'| {r.received} | {r.processed} | {r.dropped} | {r.boxes} | {r.median_ms:.1f} '
            f'| {r.p95_ms:.1f} | {r.p99_ms:.1f} | {r.max_ms:.1f} | {r.cpu_cores:.2f} |'
        )
    return '\n'.join(lines)


def histogram(result: Result) -> str:
    """Latency as bars of text."""
    most = max(*result.histogram, 1)
    lines = [f'{result.variant}, {result.size}: stamp to box']
    for index, number in enumerate(result.histogram):
        low = EDGES_MS[index]
        high = f'{EDGES_MS[index + 1]}' if index + 1 < len(EDGES_MS) else ''
        lines.append(f'{low:4d} to {high:>3} ms {number:6d} {"#" * round(40 * number / most)}')
    return '\n'.join(lines)


def main(args: list[str] | None = None) -> int:
    """Measure, print the table and the histograms; status 1 where a pair was not processed."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.live',
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
    parser.add_argument('--output', type=Path, help='JSON file for the figures')
    options = parser.parse_args(args)
    results = []
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
                return 2
    print(table(results))
    for result in results:
        print('\n' + histogram(result))
    if options.output is not None:
        options.output.write_text(
            json.dumps([asdict(r) for r in results], indent=1), encoding='utf-8'
        )
    return 0 if all(r.processed == r.sent for r in results) else 1


if __name__ == '__main__':
    sys.exit(main())
