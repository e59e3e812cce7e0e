# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Colour and depth brought together: exact, near, lost, doubled, late, and time that jumps."""

from __future__ import annotations

from array import array
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rgbd_kcf_tracker.recordings.bag_pairing import pair_topics
from rgbd_kcf_tracker.recordings.pairing import Pair, StampPairer, patient_pairer
from rgbd_kcf_tracker.recordings.storage import Topic

MS = 1_000_000


def feed(
    pairer: StampPairer[str, str], *events: str, flush: bool = True
) -> list[tuple[str, str | None]]:
    """Events such as ``c33`` and ``d40``: stream and stamp in ms, which are the message too."""
    out: list[Pair[str, str]] = []
    for event in events:
        stamp = int(event[1:].split('/')[0]) * MS
        out += pairer.add_color(stamp, event) if event[0] == 'c' else pairer.add_depth(stamp, event)
    if flush:
        out += pairer.flush()
    return [(p.color, p.depth) for p in out]


def test_equal_stamps_pair_at_once_in_either_order() -> None:
    pairer: StampPairer[str, str] = StampPairer()
    assert feed(pairer, 'c0', 'd0', flush=False) == [('c0', 'd0')]
    assert feed(pairer, 'd33', 'c33', flush=False) == [('c33', 'd33')]
    assert pairer.counts.exact == 2
    assert pairer.waiting == (0, 0)


def test_nearest_within_the_tolerance() -> None:
    pairer: StampPairer[str, str] = StampPairer(0.02)
    found = feed(pairer, 'c0', 'd5', 'c33', 'd38', 'c66', 'd90')
    assert found == [('c0', 'd5'), ('c33', 'd38'), ('c66', None)]
    assert pairer.counts.nearest == 2
    assert pairer.counts.color_alone == 1
    assert pairer.counts.depth_alone == 1


def test_tolerance_zero_pairs_equal_stamps_only() -> None:
    assert feed(StampPairer(0.0), 'c0', 'd1', 'c33', 'd33') == [('c0', None), ('c33', 'd33')]


def test_a_near_pair_is_not_held_back_at_a_steady_rate() -> None:
    """Depth 5 ms after colour: waiting for the next colour would cost a frame's time."""
    pairer: StampPairer[str, str] = StampPairer(0.02)
    feed(pairer, 'c0', 'd5', 'c33', 'd38', 'c66', flush=False)
    assert feed(pairer, 'd71', flush=False) == [('c66', 'd71')]
    assert feed(pairer, 'd94', 'c99', flush=False) == [('c99', 'd94')]


def test_where_nothing_waits_the_nearest_is_the_nearest_whatever_the_rate() -> None:
    """Depth 11 ms early, the next 9 ms late: at the rate seen so far it would have come later."""
    steady = [e for i in range(6) for e in (f'd{33 * i + 19}', f'c{33 * i + 33}')]
    events = [*steady, 'd220', 'c231', 'd240', 'c264']
    assert dict(feed(StampPairer(0.02), *events))['c231'] == 'd220'
    assert dict(feed(patient_pairer(0.02), *events))['c231'] == 'd240'


def test_exact_goes_before_near() -> None:
    """The depth at 10 belongs to the colour at 10, though that at 0 is near enough and earlier."""
    pairer: StampPairer[str, str] = StampPairer(0.02)
    assert feed(pairer, 'c0', 'c10', 'd10') == [('c0', None), ('c10', 'd10')]


def test_depth_goes_to_the_nearer_colour() -> None:
    pairer: StampPairer[str, str] = StampPairer(0.02)
    assert feed(pairer, 'c0', 'c33', 'd18', 'd60') == [('c0', None), ('c33', 'd18')]


def test_a_lost_depth_costs_its_own_frame_only() -> None:
    pairer: StampPairer[str, str] = StampPairer()
    events = ['c0', 'd0', 'c33', 'c66', 'd66']
    assert feed(pairer, *events, flush=False) == [('c0', 'd0'), ('c33', None), ('c66', 'd66')]


def test_patience_waits_for_messages_that_changed_places() -> None:
    events = ['c0', 'd33', 'c33', 'd0']
    assert feed(StampPairer(), *events) == [('c0', None), ('c33', 'd33')]
    patient: StampPairer[str, str] = StampPairer(patience_s=0.05)
    assert feed(patient, *events) == [('c0', 'd0'), ('c33', 'd33')]


def test_duplicates_and_late_colour_are_dropped_and_counted() -> None:
    pairer: StampPairer[str, str] = StampPairer()
    found = feed(pairer, 'c0', 'd0', 'c0', 'd0', 'c33', 'c33', 'd33', 'd33', 'c10', 'd66', 'd66')
    assert found == [('c0', 'd0'), ('c33', 'd33')]
    assert pairer.counts.duplicates == 5
    assert pairer.counts.late == 1


def test_different_rates() -> None:
    """Colour at 30 Hz, depth at 15 Hz: every second frame has depth, none is lost."""
    pairer: StampPairer[str, str] = StampPairer()
    events = [e for i in range(10) for e in ([f'c{33 * i}'] + [f'd{33 * i}'] * (i % 2 == 0))]
    found = feed(pairer, *events)
    assert [c for c, _ in found] == [f'c{33 * i}' for i in range(10)]
    assert [d is not None for _, d in found] == [True, False] * 5
    assert pairer.counts.depth_alone == 0


def test_colour_alone_for_seconds_is_not_held_for_ever() -> None:
    pairer: StampPairer[str, str] = StampPairer(max_wait_s=0.1)
    found = feed(pairer, *(f'c{33 * i}' for i in range(60)), flush=False)
    assert len(found) >= 55
    assert pairer.waiting[0] <= 5


def test_buffers_are_bounded() -> None:
    pairer: StampPairer[str, str] = StampPairer(capacity=10, max_wait_s=1e6)
    feed(pairer, *(f'd{33 * i}' for i in range(100)), flush=False)
    assert pairer.waiting == (0, 10)
    assert pairer.counts.overflow == 90
    pairer = StampPairer(capacity=10, max_wait_s=1e6)
    assert len(feed(pairer, *(f'c{33 * i}' for i in range(100)), flush=False)) == 90
    assert pairer.waiting == (10, 0)


def test_depth_has_bounds_of_its_own_where_its_images_are_held() -> None:
    """A recording that is read holds numbers of images, and as many as it needs."""
    depths = [f'd{33 * i}' for i in range(1100)]
    for pairer, most in ((patient_pairer(), 1000), (patient_pairer(depth_capacity=60), 60)):
        feed(pairer, *depths, flush=False)
        assert pairer.waiting == (0, most)
    pairer = patient_pairer(depth_capacity=60)
    feed(pairer, *(f'c{33 * i}' for i in range(200)), flush=False)
    assert pairer.waiting == (200, 0)


def test_time_jumps_back_as_when_a_bag_loops() -> None:
    pairer: StampPairer[str, str] = StampPairer()
    first = [e for i in range(60) for e in (f'c{33 * i}', f'd{33 * i}')]
    once = feed(pairer, *first, flush=False)
    pairs = []
    for event in first:
        stamp = int(event[1:]) * MS
        pairs += (
            pairer.add_color(stamp, event) if event[0] == 'c' else pairer.add_depth(stamp, event)
        )
    assert [(p.color, p.depth) for p in pairs] == once
    assert [p.restarted for p in pairs] == [True] + [False] * 59
    assert pairer.counts.jumps_back == 1
    assert pairer.counts.exact == 120


def test_a_straggler_from_before_the_jump_costs_no_pair() -> None:
    """Colour jumps back first, one old depth follows, then depth jumps, too."""
    pairer: StampPairer[str, str] = StampPairer()
    found = feed(pairer, 'c9000', 'd9000', 'c9033', 'c0', 'd9033', 'd0', 'c33', 'd33', 'c66', 'd66')
    assert found[-3:] == [('c0', 'd0'), ('c33', 'd33'), ('c66', 'd66')]


def test_one_stamp_far_in_the_future_costs_one_frame() -> None:
    for wild in ('c900000', 'd900000'):
        pairer: StampPairer[str, str] = StampPairer()
        good = [e for i in range(40) for e in (f'c{33 * i}', f'd{33 * i}')]
        found = feed(pairer, *good[:20], wild, *good[20:])
        pairs = [(f'c{33 * i}', f'd{33 * i}') for i in range(40)]
        assert [f for f in found if f in pairs] == pairs


def test_release_gives_out_what_waits() -> None:
    pairer: StampPairer[str, str] = StampPairer()
    feed(pairer, 'c0', 'c10', 'c20', flush=False)
    assert [p.color for p in pairer.release(10 * MS)] == ['c0', 'c10']
    assert pairer.waiting == (1, 0)


@settings(max_examples=300, deadline=None)
@given(
    st.lists(
        st.tuples(st.booleans(), st.integers(0, 40), st.sampled_from([0, 0, 0, 5000])), max_size=80
    ),
    st.sampled_from([0.0, 0.003, 0.02]),
    st.integers(1, 6),
)
def test_whatever_comes_in_comes_out_once_and_in_order(
    events: list[tuple[bool, int, int]], tolerance: float, capacity: int
) -> None:
    """Any stamps in any order: nothing raises, nothing doubles, nothing is held beyond bounds."""
    pairer: StampPairer[int, int] = StampPairer(tolerance, capacity=capacity)
    pairs: list[Pair[int, int]] = []
    for number, (is_color, stamp, far) in enumerate(events):
        add = pairer.add_color if is_color else pairer.add_depth
        pairs += add((stamp * 5 + far) * MS, number)
        assert max(pairer.waiting) <= capacity
    pairs += pairer.flush()
    assert pairer.waiting == (0, 0)
    counts = pairer.counts
    colors = [p.color for p in pairs]
    depths = [p.depth for p in pairs if p.depth is not None]
    assert len(set(colors)) == len(colors)
    assert len(set(depths)) == len(depths)
    for pair in pairs:
        if pair.depth_stamp_ns is not None:
            assert abs(pair.depth_stamp_ns - pair.stamp_ns) <= tolerance * 1e9
    for before, after in pairwise(pairs):
        assert after.stamp_ns > before.stamp_ns or after.restarted
    assert len(pairs) == counts.exact + counts.nearest + counts.color_alone
    total = counts.color + counts.depth
    assert total == len(events)
    given_out = len(colors) + len(depths)
    assert given_out + counts.depth_alone + counts.duplicates + counts.late == total


@pytest.mark.parametrize('stray', [5 * 10**9, None])
def test_a_stray_stamp_on_either_stream_costs_its_own_frame_alone(stray: int | None) -> None:
    """Both streams jumped back once, at other places: all depth between them was lost."""
    stamps = [10**12 + i * 33_333_333 for i in range(300)]
    topics = []
    for name, at in (('color', 50), ('depth', 250)):
        topic = Topic(name, 'x')
        told = list(stamps)
        told[at] = 0 if stray is None else told[at] + stray
        topic.stamp_ns, topic.log_ns = array('q', told), array('q', stamps)
        topics.append(topic)
    pairs, _ = pair_topics(*topics, None)
    assert sum(pair.depth is not None for pair in pairs) >= 297
