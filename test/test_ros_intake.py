# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the node is made of, piece by piece and without DDS: intake, timeline, worker, session."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from rgbd_kcf_tracker import Box, Frame, Intrinsics, Track, TrackState
from rgbd_kcf_tracker.live.intake import PATIENT_DEPTHS, Intake
from rgbd_kcf_tracker.live.processor import Capture, Processor
from rgbd_kcf_tracker.live.session import Session
from rgbd_kcf_tracker.live.settings import NodeParameters
from rgbd_kcf_tracker.live.statistics import Statistics, Times
from rgbd_kcf_tracker.live.timeline import StampRepair, Timeline
from rgbd_kcf_tracker.live.worker import Worker
from rgbd_kcf_tracker.recordings.camera_info import Camera
from rgbd_kcf_tracker.ros.diagnostics import NodeState, judge
from rgbd_kcf_tracker.ros.requests import Requests, auto_init_fault
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, default_parameters

MS = 1_000_000
BASE = 1_700_000_000 * 1000 * MS
CAMERA = Camera(Intrinsics(500, 500, 160, 120), 0, 0)


def message(stamp_ns: int, data: bytes = b'') -> SimpleNamespace:
    stamp = SimpleNamespace(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return SimpleNamespace(
        header=SimpleNamespace(stamp=stamp, frame_id='camera'), data=data or str(stamp_ns).encode()
    )


def intake(patient: bool = False, camera: bool = True, **values) -> Intake:
    settings = {'tolerance_s': 0.02, 'depth_wait_s': 0.1, 'camera_info_wait_s': 1.0}
    made = Intake(Statistics(), patient=patient, **(settings | values))
    if camera:
        made.camera_info(CAMERA, 0)
    return made


def test_equal_stamps_pair_at_once() -> None:
    made = intake()
    color, depth = message(BASE), message(BASE)
    assert made.color(color, 0) == []
    (capture,) = made.depth(depth, 5 * MS)
    assert capture.color is color
    assert capture.depth is depth
    assert capture.camera is CAMERA
    assert made.idle


def test_colour_waits_for_depth_only_so_long() -> None:
    made = intake()
    assert made.color(message(BASE), 0) == []
    assert made.poll(99 * MS) == []
    (capture,) = made.poll(100 * MS)
    assert capture.depth is None


def test_without_depth_nothing_waits_after_a_few_misses_until_depth_returns() -> None:
    made = intake()
    for index in range(3):
        now = index * 200 * MS
        assert made.color(message(BASE + now), now) == []
        assert len(made.poll(now + 100 * MS)) == 1
    late = 700 * MS
    assert len(made.color(message(BASE + late), late)) == 1
    made.depth(message(BASE + late), late + 5 * MS)
    assert made.color(message(BASE + 800 * MS), 800 * MS) == []
    assert len(made.depth(message(BASE + 800 * MS), 805 * MS)) == 1


@pytest.mark.parametrize(
    ('stamps_off_ms', 'late_ms', 'words'),
    [(3_600_000, 5, 'from those of colour'), (0, 300, 'depth comes 0.30 s after')],
)
def test_depth_that_never_fits_is_waited_for_no_more(
    stamps_off_ms: int, late_ms: int, words: str
) -> None:
    made = intake()
    events = []
    for index in range(60):
        at = index * 33
        events.append((at, 'color', at))
        events.append((at + late_ms, 'depth', at - stamps_off_ms))
    events += [(at, 'poll', 0) for at in range(0, 2400, 25)]
    waited = {}
    for at, what, stamp in sorted(events):
        if what == 'poll':
            captures = made.poll(at * MS)
        elif what == 'color':
            captures = made.color(message(BASE + stamp * MS), at * MS)
        else:
            captures = made.depth(message(BASE + stamp * MS), at * MS)
        for capture in captures:
            assert capture.depth is None
            came = capture.color.header.stamp
            stamp = came.sec * 1000 + came.nanosec // MS - BASE // MS
            waited[stamp // 33] = at - stamp
    assert len(waited) == 60
    assert max(waited.values()) <= 125
    assert {waited[index] for index in range(10, 60)} == {0}
    assert words in made.fit.fault


@pytest.mark.parametrize('every', [2, 4])
@pytest.mark.parametrize('late_ms', [12, 45])
def test_where_depth_comes_with_every_few_images_the_others_do_not_wait(
    every: int, late_ms: int
) -> None:
    """Nor is any depth lost; and where it comes at the full rate again, two images' at most."""
    made = intake()
    events = []
    for index in range(120):
        events.append((index * 33, 'color', index))
        if index % every == 0 or index >= 90:
            events.append((index * 33 + late_ms, 'depth', index))
    events += [(at, 'poll', 0) for at in range(0, 4200, 25)]
    waited, paired = {}, set()
    for at, what, index in sorted(events):
        stamp = BASE + index * 33 * MS
        if what == 'poll':
            captures = made.poll(at * MS)
        else:
            captures = getattr(made, what)(message(stamp), at * MS)
        for capture in captures:
            came = capture.color.header.stamp
            index = (came.sec * 10**9 + came.nanosec - BASE) // (33 * MS)
            waited[index] = at - index * 33
            if capture.depth is not None:
                paired.add(index)
    assert len(waited) == 120
    settled = range(10 * every, 120)
    assert max(waited[index] for index in settled) <= late_ms
    if late_ms < 33:
        assert {waited[index] for index in settled if index not in paired} == {0}
    assert {index for index in settled if index % every == 0 and index < 90} <= paired
    assert len(set(range(90, 120)) - paired) <= 2


def test_depth_that_was_passed_over_in_time_is_waited_for_again() -> None:
    made = intake()
    for index in range(5):
        now = index * 200 * MS
        made.color(message(BASE + now), now)
        made.poll(now + 150 * MS)
    assert made.fit.hopeless
    now = 2000 * MS
    assert len(made.color(message(BASE + now), now)) == 1
    assert made.depth(message(BASE + now), now + 20 * MS) == []
    assert not made.fit.hopeless
    assert made.fit.fault == ''
    now = 2033 * MS
    assert made.color(message(BASE + now), now) == []
    (capture,) = made.depth(message(BASE + now), now + 20 * MS)
    assert capture.depth is not None


def test_nobody_publishes_depth_so_nothing_waits() -> None:
    made = intake()
    made.depth_expected = False
    assert len(made.color(message(BASE), 0)) == 1


def test_patient_waits_longer() -> None:
    made = intake(patient=True)
    made.color(message(BASE), 0)
    assert made.poll(900 * MS) == []
    assert len(made.poll(1000 * MS)) == 1


def test_first_captures_wait_for_camera_info() -> None:
    made = intake(camera=False)
    made.color(message(BASE), 0)
    assert made.depth(message(BASE), MS) == []
    (capture,) = made.camera_info(CAMERA, 10 * MS)
    assert capture.camera is CAMERA
    made.color(message(BASE + 33 * MS), 33 * MS)
    assert len(made.depth(message(BASE + 33 * MS), 34 * MS)) == 1


def test_camera_info_that_never_comes_is_waited_for_once() -> None:
    made = intake(camera=False, patient=True)
    for index in range(3):
        made.color(message(BASE + index * 33 * MS), index * 33 * MS)
        assert made.depth(message(BASE + index * 33 * MS), index * 33 * MS) == []
    captures = made.poll(1000 * MS)
    assert [c.camera for c in captures] == [None] * 3
    assert [c.arrival_ns for c in captures] == [1000 * MS] * 3
    made.color(message(BASE + 1100 * MS), 1100 * MS)
    assert len(made.depth(message(BASE + 1100 * MS), 1100 * MS)) == 1


def test_no_camera_info_publisher_no_wait() -> None:
    made = intake(camera=False)
    made.info_expected = False
    made.color(message(BASE), 0)
    (capture,) = made.depth(message(BASE), MS)
    assert capture.camera is None


@pytest.mark.parametrize('stamp', [0, BASE])
def test_stamps_that_never_change_still_pair(stamp: int) -> None:
    made = intake()
    captures = []
    for index in range(10):
        now = BASE + index * 33 * MS
        captures += made.color(message(stamp, b'c%d' % index), now)
        captures += made.depth(message(stamp, b'd%d' % index), now + 4 * MS)
        captures += made.poll(now + 10 * MS)
    captures += made.poll(BASE + 2000 * MS)
    assert [c.color.data for c in captures] == [b'c%d' % i for i in range(10)]
    assert [c.depth.data for c in captures if c.depth] == [b'd%d' % i for i in range(10)]


@pytest.mark.parametrize('patient', [False, True])
@pytest.mark.parametrize('stamp', [0, BASE])
@pytest.mark.parametrize(
    ('late', 'first'), [('depth', 1), ('depth', 2), ('depth', 15), ('color', 2)]
)
def test_stamps_that_never_change_pair_where_one_stream_begins_later(
    late: str, first: int, stamp: int, patient: bool
) -> None:
    made = intake(patient)
    events = [(at, 'poll', 0) for at in range(0, 4000, 25)]
    for index in range(60):
        for what, after_ms in (('color', 0), ('depth', 5)):
            if index >= first or what != late:
                events.append((index * 33 + after_ms, what, index))
    captures = []
    for at, what, index in sorted(events):
        now = BASE + at * MS
        if what == 'poll':
            captures += made.poll(now)
        else:
            captures += getattr(made, what)(message(stamp, b'%d %s' % (index, what.encode())), now)
    colors = [int(c.color.data.split()[0]) for c in captures]
    paired = {
        int(c.color.data.split()[0]): int(c.depth.data.split()[0]) for c in captures if c.depth
    }
    assert colors == list(range(first if late == 'color' else 0, 60))
    assert all(color == depth for color, depth in paired.items())
    assert set(range(first + 1, 60)) <= set(paired)


@pytest.mark.parametrize('late_ms', [0, 5, 25, 400])
def test_stamps_of_a_clock_are_kept(late_ms: int) -> None:
    """Also those of a coarse one, where two images now and then have one stamp."""
    standing: dict[int, int] = {}
    color, depth = StampRepair(standing), StampRepair(standing)
    for coarse in (1, 50):
        arrivals = [index * 33 for index in range(60)]
        stamps = [BASE + at // coarse * coarse * MS for at in arrivals]
        repaired: dict[StampRepair, list[int]] = {color: [], depth: []}
        events = [(at, 0, stamp) for at, stamp in zip(arrivals, stamps, strict=True)]
        # Depth begins later, too: what it missed changes nothing.
        events += [(at + late_ms, 1, stamp) for at, _, stamp in events[4:]]
        for at, which, stamp in sorted(events):
            repair = depth if which else color
            told = repair(stamp, BASE + at * MS, b'%d' % at)
            assert told is not None
            repaired[repair].append(told)
            assert len(standing) <= 2
        wanted = [
            stamp if stamp != before else stamp + 33 * MS
            for before, stamp in zip([0, *stamps], stamps, strict=False)
        ]
        assert repaired[color] == wanted
        assert repaired[depth] == wanted[4:]
        color, depth = StampRepair(standing), StampRepair(standing)
        standing.clear()


def test_repaired_stamps_rise_where_the_last_of_one_stamp_comes_late() -> None:
    repair = StampRepair({})
    told = [
        repair(BASE + stamp * MS, BASE + arrival * MS, b'%d' % arrival)
        for stamp, arrival in ((0, 0), (50, 50), (50, 110), (100, 111), (150, 150))
    ]
    assert told == [BASE + ns for ns in (0, 50 * MS, 110 * MS, 110 * MS + 1, 150 * MS)]


def test_the_same_message_again_is_dropped_and_counted() -> None:
    made = intake()
    captures = []
    for _ in range(2):
        captures += made.color(message(BASE), 0)
    for _ in range(2):
        captures += made.depth(message(BASE), 0)
    assert len(captures) == 1
    counts = made._statistics.snapshot().counts
    assert counts['duplicates'] == 2


@pytest.mark.parametrize('stamp', [0, BASE])
def test_a_picture_that_stands_still_without_a_clock_is_answered(stamp: int) -> None:
    made = intake()
    captures = []
    for index in range(60):
        now = BASE + index * 33 * MS
        captures += made.color(message(stamp, b'c'), now)
        captures += made.depth(message(stamp, b'd'), now + 4 * MS)
        captures += made.poll(now + 10 * MS)
    assert len(captures) > 50
    assert all(c.depth is not None for c in captures)


def test_copies_are_dropped_for_as_long_as_stamps_go_on() -> None:
    made = intake()
    captures = []
    for index in range(30):
        now = BASE + index * 33 * MS
        for late in (0, 20 * MS):
            captures += made.color(message(now), now + late)
            captures += made.depth(message(now), now + late + MS)
    assert len(captures) == 30


@pytest.mark.parametrize('gaps', [(205, 200, 200), (205, 1, 1, 1, 1), (20, 20, 200)])
def test_an_image_that_is_sent_again_until_it_is_answered_is_one(gaps: tuple[int, ...]) -> None:
    """As by a replay in lock-step; the frames after it, which come at once, are not late."""
    made = intake()
    now, captures = BASE, []
    for gap in (0, *gaps):
        now += gap * MS
        captures += made.color(message(BASE, b'c'), now)
        captures += made.depth(message(BASE, b'd'), now)
    for index in range(1, 10):
        stamp, now = BASE + index * 33 * MS, now + 10 * MS
        captures += made.color(message(stamp, b'%d' % index), now)
        captures += made.depth(message(stamp, b'%d' % index), now)
    assert len(captures) == 10


def test_counts_go_on_when_the_node_is_activated_again() -> None:
    statistics = Statistics()
    for activation in (0, 1):
        made = Intake(
            statistics, tolerance_s=0.02, depth_wait_s=0.1, camera_info_wait_s=0.0, patient=False
        )
        for index in (10, 11, 12, 5, 6, 13):
            stamp = BASE + (activation * 100 + index) * 33 * MS
            made.color(message(stamp), stamp)
            made.depth(message(stamp), stamp)
        assert statistics.snapshot().counts['late'] == 2 * activation + 2


@pytest.mark.parametrize(('latency', 'told'), [(-500, True), (-2000, False), (3.6e6, False)])
def test_a_latency_by_clocks_that_differ_is_left_out(latency: float, told: bool) -> None:
    statistics = Statistics()
    statistics.processed(Times(latency, 9.0, latency - 9.0, 1.0, 1.0, 6.0, 1.0))
    times = statistics.snapshot().times_ms
    assert bool(times['latency']) == bool(times['transport']) == told
    assert times['work'] == (9.0, 9.0, 9.0, 9.0)


def test_a_stamp_far_in_the_future_loses_no_other_image() -> None:
    made = intake()
    captures = []
    for index in range(10):
        stamp = BASE + index * 33 * MS + (10**9 * 86400 * 365 if index == 5 else 0)
        captures += made.color(message(stamp), index * 33 * MS)
        captures += made.depth(message(stamp), index * 33 * MS + MS)
        captures += made.poll(index * 33 * MS + 2 * MS)
    captures += made.poll(10**9)
    assert len(captures) == 10
    assert sum(c.depth is not None for c in captures) == 10


def test_a_loop_goes_on_with_pairs() -> None:
    made = intake()
    captures = []
    for index in range(60):
        stamp = BASE + (index % 20) * 133 * MS
        captures += made.color(message(stamp), index * 133 * MS)
        captures += made.depth(message(stamp), index * 133 * MS + MS)
    assert len(captures) == 60
    assert all(c.depth is not None for c in captures)


@pytest.mark.parametrize(('patient', 'most'), [(False, 30), (True, PATIENT_DEPTHS)])
def test_depth_without_colour_is_bounded(patient: bool, most: int) -> None:
    made = intake(patient)
    for index in range(500):
        made.depth(message(BASE + index * 33 * MS), index * 33 * MS)
    assert made._pairer.waiting[1] == most <= 60
    assert made._statistics.snapshot().counts['depth_without_color'] == 500 - most


def test_what_waits_for_camera_info_fits_the_queue() -> None:
    """Of a source as fast as it can be, so that no pair pushes all the others out at once."""
    made = intake(patient=True, camera=False, queue_size=20)
    gate = threading.Event()
    worker = Worker(lambda _: gate.wait(30), pytest.fail, keep=20)
    dropped, held = [], 0
    for index in range(60):
        now = index * 3 * MS
        captures = made.color(message(BASE + index * 33 * MS), now)
        captures += made.depth(message(BASE + index * 33 * MS), now)
        dropped.append(worker.submit(*captures) if captures else 0)
        held = max(held, len(made._held))
    gate.set()
    assert worker.stop()
    assert held == 19
    assert max(dropped) == 1


@pytest.mark.parametrize('patient', [False, True])
@pytest.mark.parametrize(
    ('every', 'off_ms', 'alarmed'),
    [(1, 0, False), (2, 0, False), (8, 0, False), (1, 16, True), (2, 16, True)],
)
def test_a_lower_rate_of_depth_is_no_alarm_and_other_stamps_are(
    every: int, off_ms: int, alarmed: bool, patient: bool
) -> None:
    made = intake(patient, tolerance_s=0.005)
    statistics = made._statistics
    for index in range(220):
        now = index * 33 * MS
        made.color(message(BASE + now), now)
        if index % every == 0:
            made.depth(message(BASE + now + off_ms * MS), now + 5 * MS)
        made.poll(now + 10 * MS)
        if index == 100:
            statistics.snapshot()
    snapshot = statistics.snapshot()
    state = NodeState('tracker', 'active', publishers=1, depth_publishers=1)
    level, sentence = judge(state, snapshot)
    assert (level != b'\0') == alarmed, sentence
    assert ('are the streams synchronised' in sentence) == alarmed
    between, alone = (
        snapshot.recent.get(f'color_{what}_depth', 0) for what in ('between', 'without')
    )
    if alarmed:
        assert between == 0
        assert alone > 100
    else:
        assert between == pytest.approx(119 * (1 - 1 / every), abs=8)
        assert alone == 0


@pytest.mark.parametrize('patient', [False, True])
def test_depth_that_is_lost_on_the_way_is_an_alarm(patient: bool) -> None:
    made = intake(patient)
    rng = np.random.default_rng(3)
    for index in range(180):
        now = index * 33 * MS
        stamp = BASE + now + int(rng.integers(-MS, MS))
        made.color(message(stamp), now)
        if index < 60 or rng.random() > 0.3:
            made.depth(message(stamp), now + 5 * MS)
        made.poll(now + 10 * MS)
        if index == 60:
            made._statistics.snapshot()
    snapshot = made._statistics.snapshot()
    assert snapshot.recent['color_without_depth'] > 20
    assert 'color_between_depth' not in snapshot.recent
    state = NodeState('tracker', 'active', publishers=1, depth_publishers=1)
    assert 'found no depth of their time' in judge(state, snapshot)[1]


@pytest.mark.parametrize(
    ('stamps_ms', 'late'),
    [
        ([at - 400 * (at // 33 % 2) for at in range(0, 3300, 33)], '50 of 100'),  # two publish
        ([-at // 20 for at in range(0, 3300, 33)], '99 of 100'),  # the clock goes back
        ([at - 40 * (at % 627 == 0) for at in range(0, 3300, 33)], ''),  # a few change places
    ],
)
def test_images_that_are_passed_over_for_newer_ones_are_an_alarm(
    stamps_ms: list[int], late: str
) -> None:
    made = intake()
    made.depth_expected = False
    for index, stamp in enumerate(stamps_ms):
        made.color(message(BASE + stamp * MS), index * 33 * MS)
    state = NodeState('tracker', 'active', topic='/color/image', publishers=1, uses_depth=False)
    snapshot = made._statistics.snapshot()
    assert snapshot.counts['late'] > 3
    level, sentence = judge(state, snapshot)
    assert (level != b'\0') == bool(late), sentence
    assert sentence == 'IDLE' or f'{late} images on /color/image came after a newer' in sentence


def test_a_range_in_which_nobody_can_be_is_told_for_as_long_as_it_is_asked_for() -> None:
    settings = NodeParameters(auto_init=True, auto_init_near=2.0, auto_init_far=1.0)
    assert auto_init_fault(settings.replace(auto_init=False)) == ''
    assert auto_init_fault(settings.replace(auto_init_near=0.5)) == ''
    fault = auto_init_fault(settings)
    state = NodeState('tracker', 'active', publishers=1, auto_init_fault=fault)
    statistics = Statistics()
    statistics.image_came()
    statistics.error('rejected_requests', fault)
    for ago in (0, 60):  # at first it is the last error, too: said once
        statistics._error_time -= ago
        level, sentence = judge(state, statistics.snapshot())
        assert (level, sentence) == (b'\1', fault)
    assert 'nobody is between them' in fault


def test_ages_are_counted_from_when_the_node_listens_again() -> None:
    statistics = Statistics()
    statistics.listening()
    assert statistics.snapshot().image_age_s is None
    statistics.image_came()
    statistics.depth_came()
    statistics._image_time -= 60
    statistics._depth_time -= 60
    assert statistics.snapshot().image_age_s >= 60
    statistics.listening()
    snapshot = statistics.snapshot()
    assert snapshot.image_age_s < 30
    assert snapshot.depth_age_s < 30


def test_timeline_is_the_stamp_while_stamps_behave() -> None:
    line = Timeline()
    stamps = BASE + np.cumsum(np.random.default_rng(1).integers(1, 500, 50)) * MS
    moments = [line.advance(int(s), i * 33 * MS) for i, s in enumerate(stamps)]
    assert [m.time_ns for m in moments] == stamps.tolist()
    assert not any(m.jumped for m in moments)


@pytest.mark.parametrize(
    ('steps_ms', 'jumps', 'restarts'),
    [
        ((33, 33, -5000, 33, 33), 1, 1),  # a loop
        ((33, 86_400_000, -86_399_967, 33), 2, 0),  # one stamp a day ahead
        ((33, 86_400_000, 33, 33), 1, 0),  # a clock that was set
        ((0, 0, 0), 0, 0),
        ((33, 0, 33), 0, 0),
    ],
)
def test_timeline_rises_whatever_the_stamps_do(
    steps_ms: tuple[int, ...], jumps: int, restarts: int
) -> None:
    line = Timeline()
    stamp, moments = BASE, [line.advance(BASE, 0)]
    for index, step in enumerate(steps_ms, 1):
        stamp += step * MS
        moments.append(line.advance(stamp, index * 33 * MS))
    steps = np.diff([m.time_ns for m in moments])
    assert (steps > 0).all()
    assert (steps <= 60 * 10**9).all()
    assert sum(m.jumped for m in moments) == jumps
    assert sum(m.restarted for m in moments) == restarts


@pytest.mark.parametrize('pause_s', [61, 3600])
def test_a_camera_that_pauses_is_no_jump(pause_s: int) -> None:
    """And goes on at the time that it is; while a clock that was set meanwhile is one."""
    for set_s, jumped in ((0, False), (-2, False), (61, True), (-pause_s - 1, True)):
        line = Timeline()
        line.advance(BASE, 0)
        moment = line.advance(BASE + (pause_s + set_s) * 1000 * MS, pause_s * 1000 * MS)
        assert moment.jumped == jumped
        if not jumped:
            assert moment.time_ns == BASE + (pause_s + set_s) * 1000 * MS


@pytest.mark.parametrize('pauses_s', [(0, 100), (100, 0), (100, 100)])
def test_a_wrong_stamp_about_a_pause_is_no_loop(pauses_s: tuple[int, int]) -> None:
    for set_s, restarted in ((0, False), (59, False), (61, True), (-sum(pauses_s) - 1, True)):
        line = Timeline()
        line.advance(BASE, 0)
        arrival = pauses_s[0] * 1000 * MS + 33 * MS
        assert line.advance(BASE + 86_400_000 * MS, arrival).jumped
        arrival += pauses_s[1] * 1000 * MS + 33 * MS
        moment = line.advance(BASE + arrival + set_s * 1000 * MS, arrival)
        assert (moment.jumped, moment.restarted) == (True, restarted)


def test_restarts_are_counted_over_all_configurations() -> None:
    statistics = Statistics()
    publishers = SimpleNamespace(
        image_wanted=False, publish=lambda _: None, publish_extras=lambda _: None
    )
    for loops, sum_of_restarts in ((4, 3), (2, 4)):
        process = Processor(session()[0], publishers, statistics, time.time_ns, statistics.error)
        for index in range(loops * 30):
            image = message(BASE + index % 30 * 33 * MS)
            process(Capture(image, None, None, index * 33 * MS))
        assert statistics.snapshot().counts['restarts'] == sum_of_restarts


@pytest.mark.parametrize(('apart_s', 'begun_anew'), [(0, 0), (5, 1)])
def test_two_publishers_are_no_bag_that_loops(apart_s: int, begun_anew: int) -> None:
    """Each second image went back, and with each the target was dropped."""
    silent = SimpleNamespace(
        image_wanted=False, publish=lambda _: None, publish_extras=lambda _: None
    )
    statistics, anew = Statistics(), []
    process = Processor(session()[0], silent, statistics, time.time_ns, statistics.error)
    process.on_restart = lambda: anew.append(1)
    for index in range(80):
        other = apart_s * 10**9 if index > 20 and index % 2 else 0
        image = message(BASE + index * 33 * MS - other)
        process(Capture(image, None, None, index * 33 * MS))
    assert len(anew) == begun_anew


@pytest.mark.parametrize(
    ('values', 'kept'),
    [
        ({'on_time_jump': 'restart'}, True),  # nothing would choose him again
        ({'on_time_jump': 'restart', 'auto_init': True}, False),
        (
            {'on_time_jump': 'restart', 'auto_init': True, 'auto_init_near': 5.0},
            True,
        ),  # nobody is between
        ({'on_time_jump': 'restart', 'init_box': '1,2,30,40'}, False),
        ({'init_box': '1,2,30,40'}, True),
    ],
)
def test_a_loop_drops_nobody_where_nothing_would_choose_him_again(
    values: dict[str, object], kept: bool
) -> None:
    made, _ = session()
    process = Processor(made, SimpleNamespace(), Statistics(), time.time_ns, pytest.fail)
    Requests(process, lambda: NodeParameters(**values), pytest.fail, pytest.fail)
    made.start(frame(), Box(60, 40, 30, 40))
    process.on_restart()
    assert made.following == kept
    assert made.choosing == ('init_box' in values and not kept)


def image(array: np.ndarray, encoding: str) -> SimpleNamespace:
    """A message of an image, without ROS."""
    made = message(BASE, array.tobytes())
    made.height, made.width = array.shape[:2]
    made.step, made.encoding, made.is_bigendian = array.strides[0], encoding, 0
    return made


@pytest.mark.parametrize(
    ('what', 'used', 'counted'),
    [
        ('walks', 16, {'frozen_depth': 24}),  # half a second
        ('noise', 40, {}),  # depth that stands still is right where nothing moves
        ('stands', 40, {}),
        ('darker', 40, {}),  # nor is the light a change, as of a day that goes
        ('exposed', 40, {}),
        ('covered', 40, {'empty_depth': 40}),
    ],
)
def test_depth_that_hangs_is_left_out_and_told(
    what: str, used: int, counted: dict[str, int]
) -> None:
    statistics = Statistics()
    silent = SimpleNamespace(image_wanted=True)
    process = Processor(session()[0], silent, statistics, time.time_ns, statistics.error)
    rng = np.random.default_rng(4)
    picture = rng.integers(80, 160, (240, 320, 3), np.uint8)
    picture[:, 200:] //= 4  # a dark side
    depth = np.full((240, 320), 0 if what == 'covered' else 2000, np.uint16)

    def has_depth(index: int, depth: np.ndarray) -> bool:
        color = picture.copy()
        if what in ('walks', 'covered'):
            color[60:180, 100 + 2 * index : 140 + 2 * index] = (20, 40, 200)
        elif what == 'noise':
            color += rng.integers(0, 16, color.shape, np.uint8)
        elif what == 'darker':
            color = (color * (1 - index / 80)).astype(np.uint8)
        elif what == 'exposed':
            color += np.uint8(2 * index)
        capture = Capture(image(color, 'bgr8'), image(depth, '16UC1'), None, 0)
        return process.frame(capture, BASE + index * 33 * MS).depth is not None

    seen = [has_depth(index, depth) for index in range(40)]
    assert seen == [True] * used + [False] * (40 - used)
    assert statistics.snapshot().counts == counted
    if what == 'walks':
        assert 'repeats one image: restart it' in statistics.snapshot().last_error
        depth[5, 5] += 1
        assert has_depth(40, depth)


def test_depth_that_stood_still_is_used_again_once_the_picture_is_as_before() -> None:
    process = Processor(
        session()[0],
        SimpleNamespace(image_wanted=True),
        Statistics(),
        time.time_ns,
        lambda *_: None,
    )
    picture = np.random.default_rng(4).integers(80, 160, (240, 320, 3), np.uint8)
    depth = np.full((240, 320), 2000, np.uint16)
    used = []
    for index in range(60):
        color = picture.copy()
        if 20 <= index < 40:  # as a screen that is on meanwhile
            color[60:120, 100:140] = 255
        capture = Capture(image(color, 'bgr8'), image(depth, '16UC1'), None, 0)
        used.append(process.frame(capture, BASE + index * 33 * MS).depth is not None)
    assert used == [True] * 20 + [False] * 20 + [True] * 20


def test_a_picture_that_stands_still_for_seconds_is_told_and_used() -> None:
    statistics = Statistics()
    silent = SimpleNamespace(image_wanted=True)
    process = Processor(session()[0], silent, statistics, time.time_ns, statistics.error)
    state = NodeState('tracker', 'active', topic='/color/image', publishers=1)
    words = {}
    for index in range(240):
        color = image(np.full((24, 32, 3), index == 200, np.uint8), 'bgr8')
        statistics.image_came()
        assert process.frame(Capture(color, None, None, 0), BASE + index * 33 * MS) is not None
        if index in (150, 199, 239):
            words[index] = judge(state, statistics.snapshot())[1]
    assert words[150] == words[239] == 'IDLE'
    assert 'has not changed by a single bit' in words[199]
    assert '/color/image' in words[199]


def test_a_frozen_picture_that_is_started_on_is_counted_once() -> None:
    statistics = Statistics()
    publishers = SimpleNamespace(
        image_wanted=True, publish=lambda _: None, publish_extras=lambda _: None
    )
    process = Processor(session()[0], publishers, statistics, time.time_ns, pytest.fail)
    for index in range(7):
        color = image(np.zeros((24, 32, 3), np.uint8), 'bgr8')
        color.header.stamp.sec += index
        process(Capture(color, None, None, time.monotonic_ns()))
    before = statistics.snapshot().counts['frozen_color']
    process.choose(lambda _: Box(4, 4, 12, 12), 60.0)
    assert process.session.following
    assert statistics.snapshot().counts['frozen_color'] == before == 2


def until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.002)


def test_worker_takes_the_newest_and_counts_the_others() -> None:
    begun, done, gate = [], [], threading.Event()

    def work(item: int) -> None:
        begun.append(item)
        gate.wait(30)
        done.append(item)

    worker = Worker(work, pytest.fail)
    worker.submit(0)
    until(lambda: begun)
    dropped = sum(worker.submit(item) for item in range(1, 6))
    gate.set()
    until(lambda: done[-1:] == [5])
    assert worker.stop()
    assert done == [0, 5]
    assert dropped == 4


def test_what_comes_at_once_does_not_displace_each_other() -> None:
    begun: list[int] = []
    done: list[int] = []
    gate = threading.Event()

    def work(item: int) -> None:
        begun.append(item)
        gate.wait(30)
        done.append(item)

    worker = Worker(work, pytest.fail)
    worker.submit(0)
    until(lambda: begun)
    assert worker.submit(1) == 0
    assert worker.submit(2, 3, 4) == 1
    gate.set()
    until(lambda: done[-1:] == [4])
    assert worker.stop()
    assert done == [0, 2, 3, 4]


def test_worker_takes_all_in_order_and_outlives_errors() -> None:
    done, errors = [], []

    def work(item: int) -> None:
        if item % 3 == 0:
            raise ValueError(item)
        done.append(item)

    worker = Worker(work, errors.append, keep=100)
    for item in range(20):
        assert worker.submit(item) == 0
    worker.call('mark', lambda: done.append('call'))
    until(lambda: 19 in done and 'call' in done)
    assert worker.stop()
    assert [d for d in done if d != 'call'] == [i for i in range(20) if i % 3]
    assert 'call' in done
    assert len(errors) == 7
    assert worker.submit(1) == 0


@pytest.mark.parametrize(('work_s', 'kept'), [(0.0, 4), (0.03, 1)], ids=['fast', 'slow'])
def test_a_fast_worker_that_was_held_up_catches_up(work_s: float, kept: int) -> None:
    """And a slow one takes the newest: it never would."""
    begun, done, gate = [], [], threading.Event()

    def work(item: int) -> None:
        begun.append(item)
        time.sleep(work_s)
        if item == 100:
            gate.wait(30)
        done.append(item)

    worker = Worker(work, pytest.fail, catch_up=3)
    for item in range(20):
        worker.submit(item)
        time.sleep(0.02)
    until(lambda: done[-1:] == [19])
    worker.submit(100)
    until(lambda: begun[-1] == 100)
    dropped = 0
    for item in range(101, 107):
        dropped += worker.submit(item)
        time.sleep(0.02)
    assert dropped == 6 - kept
    gate.set()
    until(lambda: done[-1] == 106)
    assert worker.stop()
    assert done[-kept - 1 :] == [100, *range(107 - kept, 107)]


def test_nothing_is_dropped_while_the_first_item_takes_longest() -> None:
    done: list[int] = []

    def work(item: int) -> None:
        time.sleep(0.15 if item == 0 else 0.001)
        done.append(item)

    worker = Worker(work, pytest.fail, catch_up=3)
    dropped = 0
    for item in range(8):
        dropped += worker.submit(item)
        time.sleep(0.04)
    until(lambda: done[-1:] == [7])
    assert worker.stop()
    assert dropped == 0
    assert done == list(range(8))


def test_worker_ends_while_at_work() -> None:
    worker = Worker(lambda _: time.sleep(0.05), pytest.fail, keep=100)
    for item in range(100):
        worker.submit(item)
    begun = time.monotonic()
    assert worker.stop()
    assert time.monotonic() - begun < 1


def test_a_worker_that_stops_does_what_was_asked_before() -> None:
    begun: list[int] = []
    done: list[object] = []
    gate = threading.Event()

    def work(item: int) -> None:
        begun.append(item)
        gate.wait(30)
        done.append(item)

    worker = Worker(work, pytest.fail, keep=100)
    worker.submit(0, 1, 2)
    until(lambda: begun)
    worker.call('reset', lambda: done.append('reset'))
    assert not worker.stop(0.05)
    assert not worker.ended
    worker.call('configure', lambda: done.append('configure'))  # still in the worker's thread
    assert done == []
    gate.set()
    assert worker.stop()
    worker.call('late', lambda: done.append(threading.current_thread() is threading.main_thread()))
    assert done == [0, 'reset', 'configure', True]


def test_of_calls_of_one_kind_the_last_counts_and_items_go_on() -> None:
    begun: list[str] = []
    done: list[str] = []
    gate, enough = threading.Event(), threading.Event()

    def work(item: str) -> None:
        begun.append(item)
        gate.wait(30)
        done.append(item)

    worker = Worker(work, pytest.fail, keep=100)
    worker.submit('first')
    until(lambda: begun)
    for number in range(100):
        worker.call('choice', lambda number=number: done.append(f'choice {number}'))
        worker.call('reset', lambda number=number: done.append(f'reset {number}'))
    worker.call('choice', lambda: done.append('choice'))

    def again() -> None:
        if not enough.is_set():
            worker.call('endless', again)

    worker.call('endless', again)  # asks for itself for ever: items still have their turn
    worker.submit('second')
    gate.set()
    until(lambda: 'second' in done)
    enough.set()
    assert worker.stop()
    assert done == ['first', 'reset 99', 'choice', 'second']


def frame(index: int = 0) -> Frame:
    rng = np.random.default_rng(2)
    color = rng.integers(0, 255, (120, 160, 3), np.uint8)
    depth = np.full((120, 160), 3.0, np.float32)
    depth[40:80, 60:90] = 2.0
    return Frame(color, depth, BASE + index * 33 * MS, CAMERA.intrinsics)


def session() -> tuple[Session, list[str]]:
    said: list[str] = []
    return Session(DEFAULT_VARIANT, default_parameters(DEFAULT_VARIANT), said.append), said


def test_session_choice_that_fails_keeps_the_target() -> None:
    made, said = session()
    assert made.start(frame(), Box(60, 40, 30, 40))
    made.choose(lambda _: Box(500, 500, 10, 10))
    assert made.process(frame(1)).state is TrackState.TRACKING
    assert len(said) == 1
    assert not made.choosing


def test_requests_take_only_a_share_of_the_time_and_the_newest_counts() -> None:
    clock = [0.0]

    def now() -> float:
        clock[0] += 0.02  # a start takes so long, in this clock
        return clock[0]

    made = Session('kcf', default_parameters('kcf'), pytest.fail, now)
    starts, start = [], made.start
    made.start = lambda seen, box: starts.append(box.x) or start(seen, box)
    for index in range(200):
        x = 40 + index % 40
        made.choose(lambda _, x=x: Box(x, 40, 30, 40))
        assert made.process(frame(index)).state is TrackState.TRACKING
    assert 5 < len(starts) < 200 * 0.6
    clock[0] += 10
    made.process(frame(200))
    assert starts[-1] == 40 + 199 % 40
    assert not made.choosing


def test_session_takes_new_parameters_on_the_present_box() -> None:
    made, _ = session()
    made.start(frame(), Box(60, 40, 30, 40))
    made.process(frame(1))
    made.configure('kcf', default_parameters('kcf').replace(padding=2.0))
    track = made.process(frame(2))
    assert track.box is not None
    assert made.variant == 'kcf'
    assert made.process(frame(3)).box.iou(Box(60, 40, 30, 40)) > 0.7


def test_session_reset_forgets_target_and_wishes() -> None:
    made, _ = session()
    made.start(frame(), Box(60, 40, 30, 40))
    made.choose(lambda _: Box(1, 1, 30, 40))
    made.reset()
    assert not made.needs_frame
    assert made.process(frame(1)).state is TrackState.IDLE


def test_session_chooses_by_itself_and_again_when_lost() -> None:
    made, _ = session()
    looked: list[int] = []

    def auto(seen: Frame) -> Box | None:
        looked.append(seen.stamp_ns)
        return Box(60, 40, 30, 40) if len(looked) > 2 else None

    made.choose_by_itself(auto)
    assert made.needs_frame
    states = [made.process(frame(i)).state for i in range(5)]
    assert states == [TrackState.IDLE] * 2 + [TrackState.TRACKING] * 3
    assert len(looked) == 3
    made.track = Track(None, TrackState.LOST)
    made.process(frame(5))
    assert len(looked) == 3
    made.track = Track(None, TrackState.LOST)
    made.choose_by_itself(auto, again=True)
    assert made.process(frame(6)).state is TrackState.TRACKING
    assert len(looked) == 4
    made.choose_by_itself(None)
    made.reset()
    assert not made.needs_frame
