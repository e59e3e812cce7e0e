# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The colour and depth messages of a bag as pairs, from the index of their stamps alone."""

from __future__ import annotations

from array import array
from bisect import bisect_right

from rgbd_kcf_tracker.recordings.pairing import (
    DEFAULT_TOLERANCE_S,
    JUMP_BACK_S,
    Pair,
    PairingCounts,
    StampPairer,
    patient_pairer,
)
from rgbd_kcf_tracker.recordings.storage import Topic

FramePair = Pair[int, int]
"""Numbers of a colour and a depth message within their topics."""
_Event = tuple[int, bool, int]
"""Stamp, whether it is colour, and number of a message."""

_WIDEST_S = 0.5
_TOGETHER_NS = 1_000_000_000
"""Between the times of recording of colour and depth up to which both jumped back together."""
_JUMP_NS = round(JUMP_BACK_S * 1e9)


def pair_topics(
    color: Topic, depth: Topic | None, tolerance_s: float | None
) -> tuple[list[FramePair], list[str]]:
    """Every colour message with the depth that belongs to it, in time order.

    Args:
        color: the colour topic.
        depth: the depth topic, None for colour alone.
        tolerance_s: see :class:`ReadOptions`; None widens it where nothing is near enough.

    Returns:
        The pairs, and warnings about what was odd.
    """
    warnings: list[str] = []
    nothing = array('q')
    color_stamps = _stamps(color, warnings)
    depth_stamps = nothing if depth is None else _stamps(depth, warnings)
    # Both by one clock.
    if depth is not None and (color_stamps is color.log_ns) != (depth_stamps is depth.log_ns):
        color_stamps, depth_stamps = color.log_ns, depth.log_ns
    logged = nothing if depth is None else depth.log_ns
    rounds = _rounds((color_stamps, color.log_ns), (depth_stamps, logged))
    tolerance = DEFAULT_TOLERANCE_S if tolerance_s is None else tolerance_s
    pairs, counts = _run_pairer(rounds, tolerance)
    if tolerance_s is None and depth_stamps and all(p.depth is None for p in pairs):
        wider, wider_counts = _run_pairer(rounds, _WIDEST_S)
        distances = [
            abs(p.depth_stamp_ns - p.stamp_ns) for p in wider if p.depth_stamp_ns is not None
        ]
        if distances:
            pairs, counts = wider, wider_counts
            warnings.append(
                f'no depth image is within {tolerance * 1e3:g} ms of a colour image: paired '
                f'up to {max(distances) / 1e6:.0f} ms apart (set the limit with --tolerance)'
            )
    for topic, stamps in ((color, color_stamps), (depth, depth_stamps)):
        swapped = _overtaken(stamps)
        if topic is not None and swapped:
            warnings.append(
                f'{topic.name}: {swapped} images were recorded after later ones: put in order'
            )
    return pairs, warnings + _oddities(color, depth, pairs, counts)


def _stamps(topic: Topic, warnings: list[str]) -> array[int]:
    """Stamps of the headers, or the times of recording where those say nothing."""
    stamps = topic.stamp_ns
    if stamps == topic.log_ns or (any(stamps) and (len(stamps) == 1 or len(set(stamps)) > 1)):
        return stamps
    warnings.append(
        f'{topic.name}: all stamps are {stamps[0] if stamps else 0}: the time of recording is taken'
    )
    return topic.log_ns


def _oddities(
    color: Topic, depth: Topic | None, pairs: list[FramePair], counts: PairingCounts
) -> list[str]:
    out = []
    if counts.jumps_back:
        out.append(
            f'time jumps back {counts.jumps_back} times in {color.name}: '
            'frames stay in the order of recording there'
        )
    if counts.duplicates:
        out.append(
            f'{counts.duplicates} images have a stamp that was there before and are left out'
        )
    if depth is None:
        return out
    alone = sum(p.depth is None for p in pairs)
    if alone:
        out.append(
            f'{alone} of {len(pairs)} colour images have no depth image near enough '
            'and are read without depth'
        )
    if counts.depth_alone:
        out.append(f'{counts.depth_alone} depth images belong to no colour image')
    return out


def _run_pairer(
    rounds: list[list[_Event]], tolerance_s: float
) -> tuple[list[FramePair], PairingCounts]:
    pairer: StampPairer[int, int] = patient_pairer(tolerance_s)
    pairs: list[FramePair] = []
    for events in rounds:
        for stamp, is_color, index in events:
            pairs += pairer.add_color(stamp, index) if is_color else pairer.add_depth(stamp, index)
        pairs += pairer.flush()
    return pairs, pairer.counts


def _rounds(
    color: tuple[array[int], array[int]], depth: tuple[array[int], array[int]]
) -> list[list[_Event]]:
    """Both streams by stamp, from one jump back of time to the next.

    Messages that changed places while they were recorded are put right; where time jumps back (a
    bag of a bag that looped) what comes after stays after.

    Args:
        color: its stamps and times of recording.
        depth: the same.
    """
    colors, depths = _segments(color[0]), _segments(depth[0])
    count = max(colors, default=0) + 1
    starts = [color[1][colors.index(n)] for n in range(1, count)]
    others = [depth[1][depths.index(n)] for n in range(1, max(depths, default=0) + 1)]
    together = len(starts) == len(others) and all(
        abs(a - b) < _TOGETHER_NS for a, b in zip(starts, others, strict=True)
    )
    if depths and not together:
        # Depth that is missing about a jump does not show it, and a stray stamp is one in one
        # stream alone, but when they were recorded tells.
        depths = [bisect_right(starts, logged) for logged in depth[1]]
    rounds: list[list[_Event]] = [[] for _ in range(count)]
    for is_color, segments, stamps in ((True, colors, color[0]), (False, depths, depth[0])):
        for index, (segment, stamp) in enumerate(zip(segments, stamps, strict=True)):
            rounds[segment].append((stamp, is_color, index))
    return [sorted(events) for events in rounds]


def _overtaken(stamps: array[int]) -> int:
    """How many come after one that is later, where time does not jump back."""
    back = 0
    newest: int | None = None
    for stamp in stamps:
        if newest is not None and newest - _JUMP_NS <= stamp < newest:
            back += 1
        else:
            newest = stamp
    return back


def _segments(stamps: array[int]) -> list[int]:
    segment, newest = 0, -(1 << 62)
    out = []
    for stamp in stamps:
        if stamp < newest - _JUMP_NS:
            segment += 1
            newest = stamp
        newest = max(newest, stamp)
        out.append(segment)
    return out
