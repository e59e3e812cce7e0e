# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The session behind the node: several targets, ids that last, and what is told of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from onnx_files import average_pool
from people_rig import BLUE, GREEN, Someone, picture

from rgbd_kcf_tracker import Box, Track, TrackState
from rgbd_kcf_tracker.live.session import Session
from rgbd_kcf_tracker.live.story import Allowance, Story
from rgbd_kcf_tracker.variants import default_parameters

FIRST, SECOND, THIRD = Someone(-1.0, 3.0), Someone(0.2, 3.5, GREEN), Someone(1.2, 3.2, BLUE)
ALL = [FIRST, SECOND, THIRD]


def session(variant: str = 'metric') -> tuple[Session, list[str], list[str]]:
    refused: list[str] = []
    told: list[str] = []
    # The clock stands still: how long starting takes here, on a busy machine, delays no request.
    made = Session(variant, default_parameters(variant), refused.append, lambda: 0.0, told.append)
    return made, refused, told


def run(made: Session, first: int, count: int, people: list[Someone] | None = None) -> None:
    for number in range(first, first + count):
        made.process(picture(people if people is not None else ALL, number / 10))


def ids(made: Session) -> list[int]:
    return sorted(track.id for track in (made.track, *made.others) if track.id)


def test_targets_are_added_and_removed_beside_the_chosen_one() -> None:
    for variant in ('metric', 'kcf'):
        made, refused, told = session(variant)
        made.choose(lambda _: FIRST.box)
        run(made, 0, 2)
        assert (made.track.id, made.others) == (1, ())
        made.add(lambda _: SECOND.box)
        made.add(lambda _: THIRD.box)
        run(made, 2, 3)
        assert ids(made) == [1, 2, 3]
        boxes = {track.id: track.box for track in made.others}
        assert boxes[2].iou(SECOND.box) > 0.6
        assert boxes[3].iou(THIRD.box) > 0.6
        made.remove(2)
        made.remove(7)
        run(made, 5, 2)
        assert ids(made) == [1, 3]
        assert refused == ['no target 7 was chosen or added: those are 1, 3']
        made.remove(1)
        run(made, 7, 1)
        assert (made.track.state, ids(made)) == (TrackState.IDLE, [3])
        made.reset()
        assert not made.following
        assert [words.split(':')[0] for words in told] == [
            'target 1 taken', 'target 2 added', 'target 3 added',
            'target 2 removed', 'target 1 removed', 'all targets dropped',
        ]  # fmt: skip


def test_the_first_that_is_added_is_the_chosen_one() -> None:
    made, _, _ = session()
    made.add(lambda _: SECOND.box)
    run(made, 0, 1)
    assert made.track.box is not None
    assert made.others == ()


def test_who_is_followed_already_is_not_added_again() -> None:
    made, refused, _ = session()
    made.choose(lambda _: FIRST.box)
    run(made, 0, 3)
    made.add(lambda _: FIRST.box)
    run(made, 3, 2)
    assert ids(made) == [1]
    assert refused == ['what is in that box is followed already, as target 1']


def test_a_box_of_what_is_followed_adds_nothing_with_any_variant() -> None:
    for variant in ('metric', 'kcf'):
        made, refused, _ = session(variant)
        made.choose(lambda _: FIRST.box)
        made.add(lambda _: SECOND.box)
        run(made, 0, 2)
        for person in (FIRST, SECOND):
            made.add(lambda _, person=person: person.box.moved(6, 4))
        run(made, 2, 2)
        assert ids(made) == [1, 2]
        assert len(made._targets) == 2
        assert refused == [
            'what is in that box is followed already, as target 1',
            'what is in that box is followed already, as target 2',
        ]


@pytest.mark.parametrize('variant', ['kcf', 'rgbd', 'rgbd_pf', 'metric'])
def test_who_was_added_and_is_chosen_keeps_his_id_and_is_followed_once(variant: str) -> None:
    made, refused, _ = session(variant)
    made.choose(lambda _: FIRST.box)
    made.add(lambda _: SECOND.box)
    made.add(lambda _: THIRD.box)
    run(made, 0, 3)
    made.choose(lambda _: SECOND.box.moved(3, 2))
    run(made, 3, 3)
    assert (made.track.id, ids(made), len(made._targets)) == (2, [2, 3], 2)
    assert made.track.box.iou(SECOND.box) > 0.5
    made.remove(2)
    run(made, 6, 1)
    assert (ids(made), len(made._targets), refused) == ([3], 1, [])


@pytest.mark.parametrize('variant', ['kcf', 'rgbd', 'rgbd_pf', 'metric'])
def test_who_is_chosen_again_beside_others_keeps_his_id(variant: str) -> None:
    made, refused, _ = session(variant)
    made.choose(lambda _: FIRST.box)
    made.add(lambda _: SECOND.box)
    run(made, 0, 3)
    for first in (3, 6):  # and again
        made.choose(lambda _: FIRST.box.moved(3, 2))
        run(made, first, 3)
        assert (made.track.id, ids(made), len(made._targets)) == (1, [1, 2], 2)
    made.choose(lambda _: THIRD.box)
    run(made, 9, 3)
    assert (made.track.id, ids(made), len(made._targets)) == (3, [2, 3], 2)
    made.choose(lambda _: FIRST.box)  # dropped meanwhile; metric knows him
    run(made, 12, 3)
    assert made.track.id == (1 if variant == 'metric' else 4)
    made.remove(2)
    run(made, 15, 1)
    assert (len(made._targets), refused) == (1, [])


def test_so_many_are_followed_at_once_and_no_more() -> None:
    made, refused, _ = session('kcf')
    made.most = 2
    for person in ALL:
        made.add(lambda _, box=person.box: box)
    run(made, 0, 2)
    assert ids(made) == [1, 2]
    (words,) = refused
    assert words.startswith('2 targets are followed, as many as max_targets allows')
    made.remove(1)
    made.add(lambda _: THIRD.box)
    run(made, 2, 2)
    assert ids(made) == [2, 3]
    made.choose(lambda _: FIRST.box)  # takes the place of the chosen one
    run(made, 4, 1)
    assert ids(made) == [2, 4]
    assert len(refused) == 1


def test_many_that_are_added_at_once_take_only_a_share_of_the_time() -> None:
    clock = [0.0]
    made = Session('kcf', default_parameters('kcf'), lambda _: None, lambda: clock[0])
    looked: list[int] = []

    def look(number: int) -> Box:
        looked.append(number)
        clock[0] += 0.2
        return ALL[number % 3].box

    for number in range(9):
        made.add(lambda _, number=number: look(number))
    made.process(picture(ALL, 0.0))
    assert looked == [0, 1]
    made.process(picture(ALL, 0.1))
    assert looked == [0, 1]
    clock[0] += 2
    made.process(picture(ALL, 0.2))
    assert looked[:3] == [0, 1, 2]


def test_another_target_has_another_id_and_ids_outlive_resets() -> None:
    made, _, _ = session()
    for number, person in enumerate(ALL, 1):
        made.choose(lambda _, person=person: person.box)
        run(made, number, 1)
        assert made.track.id == number
    made.reset()
    made.choose(lambda _: FIRST.box)
    run(made, 9, 1)
    assert made.track.id == 4


def test_who_is_added_again_has_his_id_while_others_are_followed_and_a_new_one_alone() -> None:
    made, _, _ = session()
    made.choose(lambda _: FIRST.box)
    made.add(lambda _: SECOND.box)
    run(made, 0, 3)
    for number, known in ((2, [1, 2]), (1, [1, 2]), (2, [1, 2])):
        made.remove(number)
        run(made, 3, 1)
        made.add(lambda _, box=(FIRST, SECOND)[number - 1].box: box)
        run(made, 4, 2)
        assert ids(made) == known
    made.remove(1)
    made.remove(2)
    run(made, 6, 1)
    made.add(lambda _: FIRST.box)
    run(made, 7, 2)
    assert ids(made) == [3]


def test_everyone_is_followed_beside_the_chosen_one() -> None:
    made, refused, _ = session()
    made.everyone = True
    assert made.needs_frame
    run(made, 0, 3, [])
    run(made, 3, 6)
    assert made.track.state is TrackState.IDLE
    assert len(made.others) == 3
    known = {track.id: track.box for track in made.others}
    made.choose(lambda _: SECOND.box)
    run(made, 9, 3)
    assert made.track.box.iou(SECOND.box) > 0.6
    assert known[made.track.id].iou(SECOND.box) > 0.6  # the same id as before it was chosen
    assert ids(made) == sorted(known)
    made.everyone = False
    assert made.others == ()
    run(made, 12, 1)
    assert ids(made) == [made.track.id]
    assert not refused


def test_ids_of_whom_nobody_remembers_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    made, _, _ = session()
    made.everyone = True
    run(made, 0, 3, [])
    run(made, 3, 6)
    made.choose(lambda _: FIRST.box)
    run(made, 9, 2)
    known = {track.id: track.box for track in (made.track, *made.others)}
    assert len(known) == 3
    with monkeypatch.context() as patched:
        for inner in range(1000, 1500):  # passers-by, whom the set has forgotten a frame later
            passing = {1: made.track, inner: Track(FIRST.box, TrackState.TRACKING, id=inner)}
            passing[made._chosen] = replace(made.track, id=made._chosen)
            patched.setattr(made._targets, 'update', lambda _, tracks=passing: dict(tracks))
            made.process(picture(ALL, 1.1))
            assert len(made._ids) <= 4
    run(made, 12, 2)
    assert ids(made) == sorted(known)
    tracks = (made.track, *made.others)
    assert all(track.box.iou(known[track.id]) > 0.6 for track in tracks)


def test_everyone_is_refused_where_the_variant_cannot() -> None:
    made, refused, _ = session('kcf')
    made.everyone = True
    assert refused == ['variant kcf follows chosen targets only, not everyone']
    made.configure('metric', default_parameters('metric'))
    assert made.needs_frame


def test_ids_stay_when_the_variant_changes() -> None:
    made, _, told = session()
    made.choose(lambda _: FIRST.box)
    made.add(lambda _: SECOND.box)
    run(made, 0, 3)
    made.configure('kcf', default_parameters('kcf'))
    run(made, 3, 3)
    assert made.variant == 'kcf'
    assert made.track.box.iou(FIRST.box) > 0.5
    assert ids(made) == [1, 2]
    assert told[-1] == 'variant kcf instead of metric'
    assert made.others[0].box.iou(SECOND.box) > 0.5


def with_one_hidden() -> tuple[Session, list[str]]:
    """Two targets, of whom the second is out of sight after ten frames; and what was refused."""
    made, refused, _ = session()
    made.choose(lambda _: FIRST.box)
    made.add(lambda _: SECOND.box)
    run(made, 0, 5)
    run(made, 5, 5, [FIRST, THIRD])
    return made, refused


def test_a_change_waits_for_the_hidden_and_drops_only_with_words() -> None:
    made, refused = with_one_hidden()
    assert made.others[0].box is None
    made.configure('metric', default_parameters('metric').replace(lost_after=5.0))
    run(made, 10, 5, [FIRST, THIRD])
    assert made.asked_for == {1, 2}
    at_work = made._targets
    run(made, 15, 10)
    assert made._targets is not at_work
    assert ids(made) == [1, 2]
    assert made.others[0].box.iou(SECOND.box) > 0.6
    # Where he does not come back, the change is not put off for ever, nor he dropped silently.
    run(made, 25, 5, [FIRST, THIRD])
    made.configure('kcf', default_parameters('kcf'))
    run(made, 30, 99, [FIRST, THIRD])
    assert (made.variant, made.asked_for, refused) == ('metric', {1, 2}, [])
    run(made, 129, 3, [FIRST, THIRD])
    assert (made.variant, made.asked_for) == ('kcf', {1})
    assert [words[:18] for words in refused] == ['target 2 is hidden']


def test_who_is_dropped_for_a_change_goes_out_no_more() -> None:
    made, refused = with_one_hidden()
    made.configure('kcf', default_parameters('kcf'))
    for number in range(10, 115):
        run(made, number, 1, [FIRST, THIRD])
        assert ids(made) == sorted(made.asked_for)
    assert (made.variant, ids(made), len(refused)) == ('kcf', [1], 1)


def test_of_several_added_who_are_all_hidden_a_change_waits_for_the_one_seen_last() -> None:
    made, refused, _ = session()
    made.choose(lambda _: FIRST.box)
    made.add(lambda _: SECOND.box)
    made.add(lambda _: THIRD.box)
    run(made, 0, 5)
    made.remove(1)
    run(made, 5, 3, [SECOND])
    run(made, 8, 3, [])
    made.configure('rgbd', default_parameters('rgbd'))
    for number in range(11, 111, 3):
        run(made, number, 1, [])
    assert (made.asked_for, refused) == ({2, 3}, [])
    for number in range(111, 400, 10):
        run(made, number, 1, [])
    assert (made.variant, made.asked_for, ids(made)) == ('metric', {2}, [2])
    assert [words[:18] for words in refused] == ['target 3 is hidden']
    run(made, 400, 10)
    assert (made.variant, ids(made), len(refused)) == ('rgbd', [2], 1)
    assert made.others[0].box.iou(SECOND.box) > 0.5


def test_a_change_waits_for_the_only_one_left_however_long() -> None:
    made, refused, _ = session()
    made.choose(lambda _: FIRST.box)
    made.add(lambda _: SECOND.box)
    run(made, 0, 5)
    made.remove(1)
    run(made, 5, 5, [FIRST, THIRD])
    made.configure('rgbd', default_parameters('rgbd'))
    for number in range(10, 400, 10):
        run(made, number, 1, [FIRST, THIRD])
    assert (made.variant, made.asked_for) == ('metric', {2})
    run(made, 400, 10)
    assert (made.variant, ids(made), refused) == ('rgbd', [2], [])


def test_everyone_keeps_his_id_when_parameters_change() -> None:
    made, refused, _ = session()
    made.everyone = True
    run(made, 0, 3, [])
    run(made, 3, 6)
    known = {track.id: track.box for track in made.others}
    assert len(known) == 3
    at_work = made._targets
    made.configure('metric', default_parameters('metric'))  # as one of another variant was set
    run(made, 9, 1)
    assert made._targets is at_work
    made.configure('metric', default_parameters('metric').replace(lost_after=5.0))
    run(made, 10, 4)
    assert made._targets is not at_work
    assert (made.track.state, ids(made)) == (TrackState.IDLE, sorted(known))
    assert all(track.box.iou(known[track.id]) > 0.6 for track in made.others)
    assert not made.asked_for
    made.choose(lambda _: SECOND.box)
    made.configure('metric', default_parameters('metric'))
    run(made, 14, 4)
    assert ids(made) == sorted(known)
    assert made.asked_for == {made.track.id}
    assert not refused


def test_a_bad_box_to_add_is_refused_and_the_rest_goes_on() -> None:
    made, refused, _ = session()
    made.choose(lambda _: FIRST.box)
    made.add(lambda _: Box(5000, 0, 10, 10))
    run(made, 0, 2)
    assert ids(made) == [1]
    assert len(refused) == 1
    assert 'lies outside' in refused[0]
    assert not made.choosing


# -- the story ------------------------------------------------------------------------------------


def test_turns_are_told_once_and_flicker_is_not() -> None:
    told: list[str] = []
    story = Story(told.append)
    seen = Track(Box(1, 2, 3, 4), TrackState.TRACKING, 1.0, 2.34, id=5)
    hidden, lost = (Track(None, state, id=5) for state in (TrackState.OCCLUDED, TrackState.LOST))
    story.restart(seen)
    moments = [seen, hidden] * 5 + [seen] * 10 + [hidden] * 60 + [lost] * 30 + [seen] * 30
    for number, track in enumerate(moments):
        story.follow(track, number * 33_000_000)
    assert told == [
        'target 5 occluded',
        'target 5 lost: searched for everywhere',
        'target 5 found again, 2.3 m away',
    ]


def test_an_allowance_lets_some_through_at_once_and_then_a_trickle() -> None:
    clock = [0.0]
    allowance = Allowance(10, 2.0, lambda: clock[0])
    assert [allowance.allowed() for _ in range(12)] == [True] * 10 + [False] * 2
    clock[0] += 0.6
    assert [allowance.allowed() for _ in range(2)] == [True, False]
    clock[0] += 1000
    assert sum(allowance.allowed() for _ in range(100)) == 10


def test_parameters_that_cannot_be_are_said_and_the_last_go_on(tmp_path: Path) -> None:
    """Each frame ended in an error from then on, and nobody was followed."""
    made, refused, _ = session()
    made.choose(lambda _: FIRST.box)
    run(made, 0, 3)
    network = tmp_path / 'text.onnx'
    network.write_text('no network')
    made.configure('metric', default_parameters('metric').replace(embedding=str(network)))
    assert [str(network) in said for said in refused] == [True]
    run(made, 3, 3)
    assert made.track.box.iou(FIRST.box) > 0.5
    made.reset()
    made.choose(lambda _: SECOND.box)
    run(made, 6, 2)
    assert made.track.box.iou(SECOND.box) > 0.5
    assert len(refused) == 1


def test_a_network_is_read_once_however_often_one_begins_anew(tmp_path: Path) -> None:
    network = tmp_path / 'means.onnx'
    network.write_bytes(average_pool())
    made, refused, _ = session()
    made.configure('metric', default_parameters('metric').replace(embedding=str(network)))
    network.unlink()
    for box in (FIRST.box, SECOND.box):
        made.choose(lambda _, box=box: box)
        run(made, 0, 2)
        assert made.track.box.iou(box) > 0.5
        made.reset()
    assert not refused
