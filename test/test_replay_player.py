# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Order, time and lock-step of a replay, without ROS."""

from __future__ import annotations

import itertools
import queue
import threading
import time
from collections.abc import Iterator

import pytest

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.live import replay_lockstep
from rgbd_kcf_tracker.live.prefetch import prefetched
from rgbd_kcf_tracker.live.replay_lockstep import AHEAD, Answers
from rgbd_kcf_tracker.live.replay_message import Message, Role
from rgbd_kcf_tracker.live.replay_pacing import Pacer
from rgbd_kcf_tracker.live.replay_player import Player
from rgbd_kcf_tracker.recordings.pairing import patient_pairer

MS = 1_000_000


class HandClock:
    """A wall clock that moves when it is told to."""

    def __init__(self) -> None:
        self.time = 100.0

    def __call__(self) -> float:
        return self.time


def recording(pairs: int, step_ms: int = 33, skew_ms: int = 0) -> Iterator[Message]:
    for i in range(pairs):
        at = (1000 + i * step_ms) * MS
        yield Message('/color', at, b'c', Role.COLOR, at)
        yield Message('/depth', at + MS, b'd', Role.DEPTH, at + skew_ms * MS)
        yield Message('/info', at + 2 * MS, b'i')


def test_pacer_keeps_recorded_gaps_times_rate() -> None:
    clock = HandClock()
    pacer = Pacer(2.0, now=clock)
    assert pacer.due(5_000 * MS) == 100.0
    assert pacer.due(5_100 * MS) == pytest.approx(100.05)
    clock.time = 100.02
    assert pacer.due(5_200 * MS) == pytest.approx(100.1)  # the delay does not add up
    assert pacer.recorded() == pytest.approx(5_040 * MS)


def test_pacer_starts_anew_when_far_behind() -> None:
    clock = HandClock()
    pacer = Pacer(1.0, patience_s=1.0, now=clock)
    pacer.due(0)
    clock.time = 103.0
    assert pacer.due(1_000 * MS) == 103.0
    assert pacer.restarts == 1
    assert pacer.due(1_100 * MS) == pytest.approx(103.1)


def test_pacer_at_rate_zero_never_waits() -> None:
    clock = HandClock()
    pacer = Pacer(0.0, now=clock)
    assert [pacer.due(t) for t in (0, 10**12, 5)] == [100.0] * 3


def test_pacer_survives_time_jumping_back() -> None:
    clock = HandClock()
    pacer = Pacer(1.0, now=clock)
    pacer.due(1_000_000 * MS)
    assert pacer.due(0) == clock.time


@pytest.mark.parametrize(('pairs', 'period_s'), [(1, 1 / 30), (2, 0.04)])
def test_a_round_begins_a_frame_after_the_last_one(pairs: int, period_s: float) -> None:
    clock = HandClock()
    pacer = Pacer(2.0, now=clock)
    player = Player(lambda _: None, pacer, Answers(True))
    due: list[float] = []

    def arrive(time_ns: int, *_: object) -> bool:
        clock.time = pacer.due(time_ns)
        due.append(clock.time)
        return True

    pacer.wait = arrive  # type: ignore[method-assign]
    for _ in range(3):
        assert player.play(recording(pairs, step_ms=40), threading.Event())
    a_round = 3 * pairs
    assert due[0] == 100.0
    for begun in (a_round, 2 * a_round):
        assert due[begun] - due[begun - 1] == pytest.approx(period_s / 2)


def test_pacer_wait_ticks_and_stops() -> None:
    pacer = Pacer(1.0)
    stop = threading.Event()
    ticks: list[int] = []
    assert pacer.wait(0, stop)
    assert pacer.wait(60 * MS, stop, ticks.append)
    assert 2 <= len(ticks) <= 8
    assert ticks == sorted(ticks)
    assert ticks[-1] <= 60 * MS
    threading.Timer(0.05, stop.set).start()
    began = time.monotonic()
    assert not pacer.wait(10_000 * MS, stop)
    assert time.monotonic() - began < 5.0


def test_answers_of_exact_pairs() -> None:
    clock = HandClock()
    answers = Answers(has_depth=True, now=clock)
    answers.sent_color(10)
    assert answers.wait(0.0, threading.Event())  # no pair yet, nothing due
    answers.sent_depth(10)
    assert not answers.wait(0.0, threading.Event())
    clock.time += 0.25
    answers.answered(10)
    assert answers.wait(0.0, threading.Event())
    assert list(answers.latencies_s) == [pytest.approx(0.25)]
    assert (answers.pairs, answers.unanswered) == (1, 0)


def test_answer_is_due_only_when_the_tracker_can_know_the_pair() -> None:
    """Depth 18 ms later at 30 Hz: only the next colour image shows whose depth it is."""
    answers = Answers(has_depth=True)
    stop = threading.Event()
    answers.sent_color(1000 * MS)
    answers.sent_depth(1018 * MS)
    assert answers.wait(0.0, stop)
    # The depth of 1018 is nearer to it than to the one before, which goes out alone.
    answers.sent_color(1033 * MS)
    assert not answers.wait(0.0, stop)
    answers.answered(1000 * MS)
    assert answers.wait(0.0, stop)
    answers.sent_depth(1051 * MS)
    assert not answers.wait(0.0, stop)
    answers.answered(1033 * MS)
    answers.sent_color(1066 * MS)
    assert answers.wait(0.0, stop)
    answers.sent_all()
    assert not answers.wait(0.0, stop)
    answers.answered(1066 * MS)
    assert answers.wait(0.0, stop)
    assert answers.pairs == len(answers.latencies_s) == 3


def test_answers_without_a_depth_topic_and_given_up() -> None:
    answers = Answers(has_depth=False)
    for stamp in (1, 2, 3):
        answers.sent_color(stamp)
    answers.answered(2)
    assert answers.give_up() == [3]  # 1 was passed over
    assert answers.unanswered == 2
    assert answers.wait(0.0, threading.Event())


def test_late_answers_are_waited_for_as_long_as_they_come() -> None:
    answers = Answers(has_depth=False)
    stop = threading.Event()
    for stamp in range(6):
        answers.sent_color(stamp)

    def slow_tracker() -> None:
        for stamp in range(4):
            time.sleep(0.1)
            answers.answered(stamp)

    thread = threading.Thread(target=slow_tracker)
    thread.start()
    assert not answers.drain(0.3, stop)  # the last two were dropped
    thread.join()
    assert len(answers.latencies_s) == 4
    answers.answered(4)
    answers.answered(5)
    assert answers.drain(0.3, stop)


def test_foreign_and_early_answers_do_no_harm() -> None:
    answers = Answers(has_depth=True)
    for stamp in range(5000):
        answers.answered(stamp * MS + 1)
    answers.sent_color(10 * MS)
    answers.answered(10 * MS)  # the tracker used it without its depth
    answers.sent_depth(10 * MS)
    assert answers.wait(0.0, threading.Event())
    assert len(answers.latencies_s) == 1


def test_time_that_jumps_back_onto_a_stamp_that_waits() -> None:
    """The image that waited is decided on, the new one of its stamp waits in its place."""
    answers = Answers(has_depth=True)
    for stamp in (3000, 4000, 5000, 5500, 6000, 6500, 7000, 5000):
        answers.sent_color(stamp * MS)
    assert answers.pairs == 7
    assert answers._undecided.keys() == {5000 * MS}
    assert len(answers.give_up()) == 7
    assert answers.wait(0.0, threading.Event())
    answers.sent_depth(5000 * MS)
    assert answers.give_up() == [5000 * MS]
    assert not answers._undecided


def test_a_replay_that_loops_keeps_so_many_latencies(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay_lockstep, 'LATENCIES', 10)
    clock = HandClock()
    answers = Answers(has_depth=False, now=clock)
    for stamp in range(25):
        answers.sent_color(stamp)
        clock.time += stamp
        answers.answered(stamp)
    assert answers.heard == answers.pairs == 25
    assert list(answers.latencies_s) == pytest.approx(range(15, 25))


def test_player_sends_everything_in_order() -> None:
    sent: list[Message] = []
    player = Player(sent.append, Pacer(0.0), Answers(has_depth=True))
    assert player.play(recording(4), threading.Event())
    assert sent == list(recording(4))
    assert (player.progress.colors, player.progress.depths, player.progress.messages) == (4, 4, 12)


@pytest.mark.parametrize('skew_ms', [0, 4, 18])
def test_lockstep_never_runs_ahead_of_the_tracker(skew_ms: int) -> None:
    """A tracker slower than the camera answers each pair before the next is complete.

    One thread answers, as in a tracker: a timer for each image may, on a busy machine, answer the
    second of two before the first, which then rightly counts as passed over.
    """
    answers = Answers(has_depth=True)
    waiting: list[int] = []
    arrived: queue.SimpleQueue[int | None] = queue.SimpleQueue()
    most = 0

    def send(message: Message) -> None:
        nonlocal most
        if message.role is Role.COLOR:
            waiting.append(message.stamp_ns)
            most = max(most, len(waiting))
            arrived.put(message.stamp_ns)

    def track() -> None:
        while (stamp := arrived.get()) is not None:
            time.sleep(0.01)
            waiting.remove(stamp)
            answers.answered(stamp)

    tracker = threading.Thread(target=track)
    tracker.start()
    try:
        player = Player(send, Pacer(0.0), answers, lockstep=True)
        assert player.play(recording(10, skew_ms=skew_ms), threading.Event())
    finally:
        arrived.put(None)
        tracker.join()
    assert answers.pairs == len(answers.latencies_s) == 10
    assert most <= (1 if skew_ms == 0 else 2)


def test_an_answer_that_overtakes_another_passes_it_over() -> None:
    """The overtaken one is not waited for, and its late answer is not counted as one."""
    answers = Answers(has_depth=False)
    for stamp in (1, 2):
        answers.sent_color(stamp)
    answers.answered(2)
    answers.answered(1)
    assert answers.wait(0.0, threading.Event())
    assert (answers.pairs, len(answers.latencies_s), answers.unanswered) == (2, 1, 1)


def test_depth_far_behind_is_paired_as_the_tracker_pairs_it() -> None:
    """Depth 600 ms late: the tracker waits for it, and so must lock-step."""
    answers = Answers(has_depth=True)
    tracker = patient_pairer()
    stamps = range(0, 2000 * MS, 33 * MS)
    messages = [Message('/color', at, b'', Role.COLOR, at) for at in stamps]
    messages += [Message('/depth', at + 600 * MS, b'', Role.DEPTH, at) for at in stamps]
    paired = []
    for message in sorted(messages, key=lambda m: m.time_ns):
        if message.role is Role.COLOR:
            answers.sent_color(message.stamp_ns)
            pairs = tracker.add_color(message.stamp_ns, None)
        else:
            answers.sent_depth(message.stamp_ns)
            pairs = tracker.add_depth(message.stamp_ns, None)
        paired += pairs
        # What is due is exactly what the tracker has been able to answer.
        assert set(answers._due) == {pair.stamp_ns for pair in pairs}
        for pair in pairs:
            answers.answered(pair.stamp_ns)
    assert len(answers.latencies_s) == len(paired) == len(stamps)
    assert all(pair.depth_stamp_ns == pair.stamp_ns for pair in paired)


def test_what_a_tracker_has_passed_over_is_not_waited_for() -> None:
    """Depth 900 ms late, and a tracker that does not wait for it and takes the newest image."""
    clock = itertools.count()
    answers = Answers(has_depth=True, now=lambda: float(next(clock)))
    stamps = range(0, 3000 * MS, 33 * MS)
    messages = [(at, Role.COLOR, at) for at in stamps]
    messages += [(at + 900 * MS, Role.DEPTH, at) for at in stamps]
    for number, (_, role, stamp) in enumerate(sorted(messages)):
        if role is Role.COLOR:
            answers.sent_color(stamp)
            if number % 3 != 1:
                answers.answered(stamp)
        else:
            answers.sent_depth(stamp)
        assert len(answers._due) <= 1
    answers.sent_all()
    answers.answered(stamps[-1])
    assert not answers._due
    assert not answers._undecided
    assert answers.unanswered > 10
    assert answers.unanswered + len(answers.latencies_s) == len(stamps)
    # Answered out of turn are those alone that were sent later.
    answers = Answers(has_depth=False)
    for stamp in (1, 2, 3):
        answers.sent_color(stamp)
    answers.answered(2)
    assert list(answers._due) == [3]
    assert answers.unanswered == 1


def test_where_depth_has_stopped_lockstep_does_not_run_away() -> None:
    answers = Answers(has_depth=True)
    answers.sent_depth(0)
    under_way: list[int] = []
    most = 0
    lock = threading.Lock()

    def answer_next() -> None:
        with lock:
            answers.answered(under_way.pop(0))

    for index in range(200):
        answers.sent_color(index * 33 * MS)
        with lock:
            under_way.append(index * 33 * MS)
            most = max(most, len(under_way))
        # As a tracker that has stopped waiting for depth.
        threading.Timer(0.02, answer_next).start()
        assert answers.wait(5.0, threading.Event())
    assert most <= AHEAD + 2
    answers.sent_all()
    assert answers.wait(5.0, threading.Event())
    assert len(answers.latencies_s) == 200


def test_lockstep_sends_again_what_was_lost_then_gives_up() -> None:
    answers = Answers(has_depth=True)
    sent: list[Message] = []
    warnings: list[str] = []

    def send(message: Message) -> None:
        sent.append(message)
        # The first pair is lost once; the second is never answered.
        again = message.role is Role.DEPTH and sum(m == message for m in sent) == 2
        if again and message.stamp_ns == 1000 * MS:
            answers.answered(message.stamp_ns)

    player = Player(
        send, Pacer(0.0), answers, lockstep=True, answer_timeout_s=0.05, warn=warnings.append
    )
    assert player.play(recording(2), threading.Event())
    assert answers.unanswered == 1
    assert player.progress.repeated > 0
    assert any('again' in w for w in warnings)
    assert any('going on without' in w for w in warnings)


def test_an_answer_that_comes_as_it_is_given_up_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = Answers(has_depth=False)
    warnings: list[str] = []
    give_up = answers.give_up
    monkeypatch.setattr(answers, 'give_up', lambda: answers.answered(1000 * MS) or give_up())
    player = Player(
        lambda m: None,
        Pacer(0.0),
        answers,
        lockstep=True,
        answer_timeout_s=0.02,
        warn=warnings.append,
    )
    image = next(recording(1))
    assert player.play([image], threading.Event())
    assert (answers.heard, answers.unanswered) == (1, 0)
    assert not any('going on without' in words for words in warnings)


def test_lockstep_says_that_it_cannot_tell_answers_of_one_stamp_apart() -> None:
    warnings: list[str] = []
    answers = Answers(has_depth=False)
    player = Player(
        lambda m: answers.answered(m.stamp_ns),
        Pacer(0.0),
        answers,
        lockstep=True,
        answer_timeout_s=0.05,
        warn=warnings.append,
    )
    images = [m for m in recording(4, step_ms=0) if m.role is Role.COLOR]
    assert player.play(images, threading.Event())
    assert [w for w in warnings if 'cannot tell their answers apart' in w] == warnings[:1]


def test_stop_ends_a_player_that_waits() -> None:
    stop = threading.Event()
    threading.Timer(0.1, stop.set).start()
    player = Player(
        lambda m: None, Pacer(0.0), Answers(has_depth=True), lockstep=True, answer_timeout_s=60
    )
    began = time.monotonic()
    assert not player.play(recording(3), stop)
    assert time.monotonic() - began < 5.0


@pytest.mark.parametrize('rate', [0.0, 2.0])
def test_a_gap_in_the_recording_is_told(rate: float) -> None:
    """A message of 1970 before the others: it seemed to hang, and would have for 54 years."""
    stop, told = threading.Event(), list[str]()

    def warn(text: str) -> None:
        told.append(text)
        stop.set()

    threading.Timer(10.0, stop.set).start()
    player = Player(lambda m: None, Pacer(rate), Answers(has_depth=True), warn=warn)
    messages = [Message('/info', 0, b'i'), *recording(1, 0), Message('/info', 1_700 * 10**9, b'i')]
    assert player.play(messages, stop) == (rate == 0)
    assert player.progress.messages == (5 if rate == 0 else 4)
    assert len(told) == (rate > 0)
    assert all(text.startswith('the next message, of /info, is due in 849 s: ') for text in told)


def test_prefetch_hands_over_items_then_the_error() -> None:
    def broken() -> Iterator[int]:
        yield 1
        yield 2
        raise RecordingError('cut off')

    with prefetched(broken()) as items:
        assert [next(items), next(items)] == [1, 2]
        with pytest.raises(RecordingError, match='cut off'):
            next(items)


def test_prefetch_ends_its_thread_when_left_early() -> None:
    def endless() -> Iterator[int]:
        n = 0
        while True:
            yield n
            n += 1

    with prefetched(endless(), ahead=2) as items:
        assert next(items) == 0
    assert not any(t.name == 'prefetch' for t in threading.enumerate())
