# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How the C library and the interpreter keep memory."""

from __future__ import annotations

import contextlib
import ctypes
import gc

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3


def keep_large_blocks() -> None:
    """Have malloc keep freed image buffers instead of returning their pages to the system.

    The page faults cost 6 ms for each pair at 1920x1080. To be called before anything is imported
    that allocates much; does nothing where the C library has no mallopt.
    """
    with contextlib.suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, 32 << 20)
        library.mallopt(_M_TRIM_THRESHOLD, 256 << 20)


def set_objects_aside() -> None:
    """Leave all objects there are out of later garbage collections.

    To be called once all is imported: most of those stay for good, and to look for cycles among the
    engine's 59,000 alone takes 33 ms in which no pair is answered.
    """
    gc.collect()
    gc.freeze()
