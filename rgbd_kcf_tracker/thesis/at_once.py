# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How much of what there is many of is computed at once."""

from __future__ import annotations

from collections.abc import Iterator

MOST_AT_ONCE = 1 << 18
"""Numbers that are made at once: as many as a processor's cache holds. The default number of
particles with the default bins of colour are half of it; the most of both, 20000 of 32768 numbers,
were 15 GB, and took 15 times as long."""


def batches(count: int, size: int) -> Iterator[slice]:
    """The parts, in order, in which ``count`` things of ``size`` numbers each are computed."""
    step = max(1, MOST_AT_ONCE // max(size, 1))
    for start in range(0, count, step):
        yield slice(start, min(start + step, count))
