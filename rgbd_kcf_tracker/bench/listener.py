# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A consumer of the tracker's boxes for the live measurements, as a process of its own.

Prints 'listening' once it hears the tracker, and one line of JSON when the boxes have stopped
coming. Started by the measurements.
"""

from __future__ import annotations

import argparse
import json
import sys
import time

import numpy as np

from rgbd_kcf_tracker.bench.rig import Listener


def main(args: list[str] | None = None) -> int:
    """Listen until nothing has come for a while after the first box, or time is up."""
    parser = argparse.ArgumentParser()
    parser.add_argument('--timeout', type=float, default=60.0, help='seconds')
    parser.add_argument('--silence', type=float, default=2.0, help='seconds that end it')
    options = parser.parse_args(args)
    listener = Listener()
    end = time.monotonic() + options.timeout
    heard, last = 0, time.monotonic()
    known = False
    while time.monotonic() < end and not (heard and time.monotonic() - last > options.silence):
        listener.spin(0.2)
        if listener.diagnostics and not known:
            # Whoever starts the camera waits for this line: boxes sent before it may be missed.
            known = True
            print('listening', flush=True)
        if len(listener.arrivals) > heard:
            heard, last = len(listener.arrivals), time.monotonic()
    listener.close()
    latency = [(came - stamp) / 1e6 for stamp, came, _ in listener.arrivals] or [0.0]
    gaps = np.diff([came for _, came, _ in listener.arrivals], prepend=0)[1:] / 1e9
    longest = int(gaps.argmax()) if len(gaps) else 0
    figures = {
        'answers': heard,
        'boxes': sum(has_box for _, _, has_box in listener.arrivals),
        'median_ms': float(np.median(latency)),
        'p99_ms': float(np.percentile(latency, 99)),
        'longest_gap_s': float(gaps[longest]) if len(gaps) else 0.0,
        'after_gap': len(gaps) - longest,
        'diagnostics': listener.diagnostics,
    }
    print(json.dumps(figures), flush=True)
    return 0 if heard else 1


if __name__ == '__main__':
    sys.exit(main())
