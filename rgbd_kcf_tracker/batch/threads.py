# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One thread a job: jobs share the cores already, and a sum is the same on every machine."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import cv2
from threadpoolctl import threadpool_limits

# The limits are the process's: where jobs run in threads beside each other, the first sets them and
# the last takes them away.
_lock = threading.Lock()
_limits = ExitStack()
_inside = 0


@contextmanager
def one_thread() -> Iterator[None]:
    """OpenCV and the BLAS of NumPy and SciPy stay in the calling thread inside."""
    global _inside
    with _lock:
        if not _inside:
            _limits.enter_context(threadpool_limits(1))
            _limits.callback(cv2.setNumThreads, cv2.getNumThreads())
            cv2.setNumThreads(1)
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if not _inside:
                _limits.close()
