# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Several targets: ids, comings and goings, and that one does not disturb another."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from itertools import islice, permutations
from typing import Any

import cv2
import numpy as np
import people_rig
import pytest
from people_rig import BLACK, BLUE, CAMERA, COLS, GREEN, GREY, RED, ROWS, Someone, picture

from rgbd_kcf_tracker import Box, Frame, Intrinsics, TrackState, create_tracker
from rgbd_kcf_tracker.errors import BoxError, ImageError, ParameterError
from rgbd_kcf_tracker.insight import insight_in
from rgbd_kcf_tracker.metric.by_look import ByLook
from rgbd_kcf_tracker.metric.decide.crowd import MOST_PEOPLE
from rgbd_kcf_tracker.metric.identity.appearance import Appearance
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.newcomers import Newcomers
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.targets import MetricTargets, MetricTracker
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.simulation import simulate
from rgbd_kcf_tracker.targets import TargetSet
from rgbd_kcf_tracker.variants import default_parameters

STEP = 0.1


def left(i: int) -> Someone:
    return Someone(-1.0 + 0.02 * i, 3.0, RED, BLACK)


def right(i: int) -> Someone:
    return Someone(1.1 - 0.02 * i, 3.2, GREEN, GREY)


def both(i: int) -> Frame:
    return picture([left(i), right(i)], STEP * i)


def follow(targets: TargetSet, frames: range, scene=both) -> dict[int, list]:
    tracks: dict[int, list] = {}
    for i in frames:
        for number, track in targets.update(scene(i)).items():
            assert track.id == number
            tracks.setdefault(number, []).append(track)
    return tracks


def without_depth(i: int) -> Frame:
    return dataclasses.replace(both(i), depth=None)


@pytest.mark.parametrize('scene', [both, without_depth])
def test_what_is_put_off_until_the_answer_is_out_changes_no_answer(scene):
    answers = []
    for settles in (None, True, False):
        targets = TargetSet('metric', MetricParameters())
        assert targets.metric is not None
        targets.metric.puts_off = settles is not None
        numbers = [targets.add(scene(0), one(0).box) for one in (left, right)]
        seen, waited = [], 0
        for i in range(1, 26):
            seen.append(targets.update(scene(i)))
            looks = [targets.metric._followers[n]._look for n in numbers]
            waited += any(look._put_off is not None for look in looks)
            if settles:
                targets.metric.settle()
                assert all(look._put_off is None for look in looks)
        assert (waited > 0) == (settles is not None)
        # At the end depth is silent, and the look that was learned is asked.
        answers.append([seen, [targets.update(without_depth(i)) for i in range(26, 30)]])
    assert answers[0] == answers[1] == answers[2]


def test_what_was_put_off_is_done_before_somebody_is_added_in_a_new_frame(
    monkeypatch: pytest.MonkeyPatch,
):
    """The question whether the camera had crept was dropped."""
    targets = TargetSet('metric')
    assert targets.metric is not None
    targets.everyone = targets.metric.puts_off = True
    for i in range(3):
        targets.update(both(i))
    reader, settled = targets.metric._reader, []
    last = reader.last_view
    monkeypatch.setattr(reader, 'settle', lambda: settled.append(reader.last_view))
    targets.add(both(3), left(3).box)
    assert settled[0] is last


@pytest.mark.parametrize(('rate', 'turns'), [(30, 1), (10, 3), (5, 4)])
def test_targets_followed_by_their_look_take_turns_at_learning_and_at_being_searched_for(
    rate: int, turns: int, monkeypatch: pytest.MonkeyPatch
):
    """What all cost in a frame is then bounded, and none waits for longer than the others."""
    learned: list[float] = []
    searched: list[object] = []
    learn, search = Appearance.learn, ByLook._searched

    def learning(appearance, color, cx, cy, scale, seconds):
        learned.append(seconds)
        learn(appearance, color, cx, cy, scale, seconds)

    def searching(look, *args):
        searched.append(look)
        return search(look, *args)

    monkeypatch.setattr(Appearance, 'learn', learning)
    monkeypatch.setattr(ByLook, '_searched', searching)
    shown, hidden = np.zeros((ROWS, COLS, 3), np.uint8), np.zeros((ROWS, COLS, 3), np.uint8)
    boxes = [Box(20 + 60 * k, 60, 20, 30) for k in range(4)]
    for k in range(4):
        paint = np.random.default_rng(k).integers(0, 256, (6, 4, 3), np.uint8)
        shown[60:90, 20 + 60 * k : 40 + 60 * k] = np.kron(paint, np.ones((5, 5, 1), np.uint8))
    targets = TargetSet('metric')
    numbers = [targets.add(Frame(shown, None, 0), box) for box in boxes]
    learned.clear()
    for i in range(1, 13):
        tracks = targets.update(Frame(shown, None, round(1e9 * i / rate)))
        for number, box in zip(numbers, boxes, strict=True):
            assert tracks[number].box is not None
            assert tracks[number].box.iou(box) > 0.9
        assert len(learned) == turns * i
    assert not searched
    # All the time since a target was last learned from is in the weight of the next sample.
    assert sum(learned) == pytest.approx(12 / rate * 4, rel=0.15)
    for i in range(13, 26):
        tracks = targets.update(Frame(hidden, None, round(1e9 * i / rate)))
        assert all(track.box is None for track in tracks.values())
    searched.clear()
    for i in range(26, 38):
        targets.update(Frame(hidden, None, round(1e9 * i / rate)))
    assert len(searched) == 12 * turns
    assert len(set(searched)) == 4
    assert all(searched.count(look) == 3 * turns for look in searched)
    for i in range(38, 42):
        tracks = targets.update(Frame(shown, None, round(1e9 * i / rate)))
    assert all(track.box is not None for track in tracks.values())


# -- further cues ---------------------------------------------------------------------------------


class Likes:
    """A cue that likes what is on one side of the picture."""

    name, weight = 'side', 2.0

    def __init__(self, value: float) -> None:
        self.value = value
        self.started: list[tuple[int, Box]] = []
        self.learned: list[Box] = []
        self.asked: list[int] = []

    def start(self, frame: Frame, box: Box, target: int) -> None:
        self.started.append((target, box))

    def weigh(self, frame: Frame, boxes: list[Box], target: int) -> np.ndarray:
        self.asked.append(len(boxes))
        return np.full(len(boxes), self.value)

    def learn(self, frame: Frame, box: Box, target: int) -> None:
        self.learned.append(box)


def test_a_further_cue_is_asked_of_all_candidates_and_decides_with_the_others():
    for value, there in ((0.5, True), (-20.0, False)):
        cue = Likes(value)
        targets = TargetSet('metric', cues=[cue])
        number = targets.add(both(0), left(0).box)
        last = follow(targets, range(1, 5))[number][-1]
        assert (last.box is not None) == there
        assert [box for _, box in cue.started] == [left(0).box]
        assert bool(cue.learned) == there
        assert len(cue.asked) == 4, 'once a frame, of all candidates'
        considered = insight_in(targets, number).considered[0]
        assert considered.cues['side'] == pytest.approx(2.0 * value)


def test_cues_that_cannot_be_are_refused():
    with pytest.raises(ParameterError, match='kcf knows no cues'):
        TargetSet('kcf', cues=[Likes(1.0)])
    targets = TargetSet('metric', cues=[Likes(float('nan'))])
    targets.add(both(0), left(0).box)
    with pytest.raises(ParameterError, match="the cue 'side' must give a finite number for each"):
        targets.update(both(1))


# -- ids ------------------------------------------------------------------------------------------


@pytest.mark.parametrize('variant', ['metric', 'kcf'])
def test_each_target_keeps_its_id_and_its_box(variant: str):
    targets = TargetSet(variant)
    assert len(targets) == 0
    assert targets.update(both(0)) == {}
    frame = both(1)
    numbers = [targets.add(frame, one(1).box) for one in (left, right)]
    assert len(set(numbers)) == len(targets) == 2
    for number, one in zip(numbers, (left, right), strict=True):
        assert targets.started(number).box == one(1).box
        assert targets.started(number).id == number
    tracks = follow(targets, range(2, 8))
    assert set(tracks) == set(numbers)
    for number, one in zip(numbers, (left, right), strict=True):
        assert len(tracks[number]) == 6
        assert tracks[number][-1].box.iou(one(7).box) > 0.6


@pytest.mark.parametrize('variant', ['metric', 'kcf'])
def test_a_removed_target_has_no_track_and_its_id_does_not_go_to_another(variant: str):
    targets = TargetSet(variant)
    frame = both(0)
    first, second = targets.add(frame, left(0).box), targets.add(frame, right(0).box)
    follow(targets, range(1, 4))
    targets.remove(first)
    assert len(targets) == 1
    assert set(targets.update(both(4))) == {second}
    with pytest.raises(KeyError):
        targets.remove(first)
    frame = both(5)
    targets.update(frame)
    third = targets.add(frame, Box(5, 5, 30, 30))
    assert third not in (first, second)


@pytest.mark.parametrize('every', [1, 2])
def test_who_is_added_in_the_next_frame_leaves_others_where_they_are_in_it(every: int):
    """They were learned from where they had been; in an image of another size that was nowhere."""
    targets = TargetSet('metric')
    first = targets.add(both(0), left(0).box)
    follow(targets, range(1, 8))
    frame = both(20)
    assert frame.depth is not None
    camera = Intrinsics(CAMERA.fx / every, CAMERA.fy / every, CAMERA.cx / every, CAMERA.cy / every)
    color, depth = frame.color[::every, ::every], frame.depth[::every, ::every]
    box = right(20).box.over(every)
    second = targets.add(Frame(color, depth, frame.stamp_ns, camera), box)
    assert targets.metric is not None
    person = targets.metric.person(first)
    assert person is not None
    assert person.place[0] == pytest.approx(left(20).x, abs=0.1)
    assert second != first


def test_a_target_may_be_added_at_any_time():
    targets = TargetSet('metric')
    first = targets.add(both(0), left(0).box)
    follow(targets, range(1, 8))
    frame = both(8)
    targets.update(frame)
    second = targets.add(frame, right(8).box)
    tracks = follow(targets, range(9, 16))
    assert set(tracks) == {first, second}
    assert tracks[first][-1].box.iou(left(15).box) > 0.7
    assert tracks[second][-1].box.iou(right(15).box) > 0.7


def test_targets_that_do_not_meet_are_followed_as_each_alone():
    frame = both(0)
    together = TargetSet('metric')
    numbers = [together.add(frame, one(0).box) for one in (left, right)]
    tracks = follow(together, range(1, 15))
    for number, one in zip(numbers, (left, right), strict=True):
        alone = TargetSet('metric')
        alone.add(frame, one(0).box)
        (single,) = follow(alone, range(1, 15)).values()
        assert [t.box for t in tracks[number]] == [t.box for t in single]


def test_a_tracker_is_a_set_of_one():
    targets, tracker = TargetSet('metric'), create_tracker('metric')
    number = targets.add(both(0), left(0).box)
    tracker.start(both(0), left(0).box)
    for i in range(1, 10):
        track = tracker.update(both(i))
        assert dataclasses.replace(targets.update(both(i))[number], id=track.id) == track


def test_refusals_say_what_to_do():
    with pytest.raises(ParameterError, match='variant'):
        TargetSet('nothing')
    with pytest.raises(ParameterError):
        TargetSet('metric', default_parameters('kcf'))
    with pytest.raises(BoxError, match='outside'):
        TargetSet('metric').add(both(0), Box(900, 10, 20, 20))
    with pytest.raises(ParameterError, match='use metric'):
        TargetSet('kcf').everyone = True
    colour = TargetSet('kcf')
    colour.everyone = False
    assert not colour.everyone
    assert colour.metric is None


def test_a_point_chooses_what_is_seen_there():
    targets = TargetSet('metric')
    number = targets.add_point(both(0), left(0).box.cx, left(0).box.cy)
    assert targets.started(number).box.iou(left(0).box) > 0.7
    assert follow(targets, range(1, 6))[number][-1].box.iou(left(5).box) > 0.7
    with pytest.raises(BoxError):
        targets.add_point(Frame(both(0).color), 20, 20)


# -- everyone -------------------------------------------------------------------------------------


def comers(i: int) -> Frame:
    """An empty room, then one comes, then another beside him; both leave, the second returns."""
    people = []
    if 5 <= i < 45:
        people.append(Someone(-1.3 + 0.05 * (i - 5), 3.0, RED))
    if 15 <= i < 45:
        people.append(Someone(1.5 - 0.04 * (i - 15), 3.8, GREEN, GREY))
    if i >= 80:
        people.append(Someone(-1.2 + 0.08 * (i - 80), 3.0, GREEN, GREY))
    return picture(people, STEP * i)


def test_everyone_gets_an_id_without_being_chosen_and_it_comes_back():
    targets = TargetSet('metric')
    targets.everyone = True
    history = [targets.update(comers(i)) for i in range(96)]
    assert all(not tracks for tracks in history[:5])
    seen = [{n for n, t in tracks.items() if t.box is not None} for tracks in history]
    assert len(seen[12]) == 1
    assert len(seen[30]) == 2
    (first,) = seen[12]
    assert first in seen[30]
    (second,) = seen[30] - {first}
    assert not seen[60]
    assert seen[95] == {second}
    track = history[30][first]
    assert track.box.iou(Someone(-0.05, 3.0).box) > 0.7
    assert track.position[2] == pytest.approx(3.0, abs=0.05)
    assert len(targets) == 0, 'nobody was chosen'


def test_pieces_of_a_wall_are_nobody_to_a_camera_that_moves():
    """A robot drives towards a bare wall, and strips of it, tall and narrow, stood before it.

    There were 131 boxes on them in these six seconds, most with scores beyond 0.9. While the robot
    turns before the wall nothing tells that it moves: then there were still 23.
    """
    targets, wrong, right = TargetSet('metric'), 0, 0
    targets.everyone = True
    samples = simulate('following', seed=112, rate_hz=10.0, size=(640, 480))
    for sample in islice(samples, 90, 150):
        bodies = [truth.body for truth in sample.truths.values() if truth.body is not None]
        for track in targets.update(sample.frame).values():
            if track.box is not None:
                on = any(track.box.intersection(body) > 0 for body in bodies)
                wrong, right = wrong + (not on), right + on
    assert wrong <= 5
    assert right > 110


def test_who_has_an_id_keeps_it_where_a_frame_has_no_depth():
    targets = TargetSet('metric')
    targets.everyone = True
    for i in range(30):
        before = targets.update(comers(i))
    assert len(before) == 2
    without = targets.update(dataclasses.replace(comers(30), depth=None))
    assert {n: track.state for n, track in without.items()} == dict.fromkeys(
        before, TrackState.OCCLUDED
    )
    after = targets.update(comers(31))
    assert {n for n, track in after.items() if track.box is not None} == set(before)


def test_a_thing_that_is_chosen_twice_in_a_frame_is_one_target():
    """The second was something else at the same place, which then was not seen again."""
    box = Box(110, 40, 50, 60)
    frame = picture([], 0.0, box)
    targets = TargetSet('metric')
    first, second = (targets.add(frame, box) for _ in range(2))
    assert first == second
    assert len(targets) == 1
    assert targets.update(picture([], STEP, box))[first].box is not None


@pytest.mark.parametrize('order', list(permutations(range(3))))
@pytest.mark.parametrize(('z', 'apart'), [(2.5, 0.34), (2.5, 0.38), (3.0, 0.34)])
def test_of_three_arm_in_arm_each_is_a_target(z: float, apart: float, order: tuple[int, ...]):
    """They are two figures, of which the middle one has half of each: the third had his id."""
    paints = (RED, BLACK), (GREEN, GREY), (BLUE, BLACK)
    people = [Someone((i - 1) * apart, z + 0.05 * i, *paint) for i, paint in enumerate(paints)]
    targets = TargetSet('metric')
    frame = picture(people, 0.0)
    assert len({targets.add(frame, people[i].box) for i in order}) == 3


def test_who_was_a_figure_once_has_no_neighbours():
    """In a frame in which he was in none he met who stood beside him, and was not known there."""
    targets = TargetSet('metric')
    number = targets.add(both(0), left(0).box)
    metric = targets.metric
    assert metric is not None
    targets.update(both(1))
    surface = metric._followers[number]._surface
    assert surface is not None
    assert surface.person.figure
    surface.person.figure = False
    targets.update(both(2))
    assert surface._neighbours is None


def test_a_chosen_target_is_not_told_twice():
    targets = TargetSet('metric')
    targets.everyone = True
    for i in range(30):
        targets.update(comers(i))
    frame = comers(30)
    before = targets.update(frame)
    one = Someone(-0.05, 3.0)
    number = targets.add(frame, one.box)
    assert number in before, 'who had an id already keeps it'
    tracks = targets.update(comers(31))
    assert set(tracks) == set(before)
    assert tracks[number].velocity is not None, 'the track is that of who follows it with care'
    boxes = [t.box for t in tracks.values() if t.box is not None]
    assert boxes[0].iou(boxes[1]) < 0.1


@pytest.mark.parametrize('late', [1, 4])
def test_targets_are_followed_on_when_the_intrinsics_come_after_the_first_images(late: int):
    """A busy machine heard camera_info after the first image: the target was lost for good."""
    narrow = dataclasses.replace(CAMERA, fx=CAMERA.fx / 1.6, fy=CAMERA.fy / 1.6)
    targets = TargetSet('metric')

    def scene(i: int) -> Frame:
        return dataclasses.replace(both(i), intrinsics=None if i < late else narrow)

    numbers = [targets.add(scene(0), one(0).box) for one in (left, right)]
    for i in range(1, 20):
        tracks = targets.update(scene(i))
        assert list(tracks) == numbers
        for number, one in zip(numbers, (left, right), strict=True):
            assert tracks[number].id == number
            assert tracks[number].box is not None
            assert tracks[number].box.iou(one(i).box) > 0.6
    # The parts of people are painted as seen by another camera.
    x, _, z = tracks[numbers[0]].position
    assert z == pytest.approx(3.0, abs=0.2)
    assert x == pytest.approx(1.6 * left(19).x, abs=0.2)


def test_intrinsics_that_are_left_out_once_are_no_other_camera():
    targets = TargetSet('metric')
    number = targets.add(both(0), left(0).box)
    assert targets.metric is not None
    crowd = targets.metric._crowd
    for i in range(1, 8):
        frame = both(i)
        targets.update(dataclasses.replace(frame, intrinsics=None) if i == 4 else frame)
    assert targets.metric._crowd is crowd
    assert number in targets.update(both(8))


# -- while hidden ---------------------------------------------------------------------------------

BOARD = Box(110, 0, 50, ROWS)


def behind_board(i: int) -> Frame:
    return picture([Someone(-0.9 + 0.05 * i, 3.0)], STEP * i, BOARD if i > 0 else None)


def test_a_hidden_target_is_predicted_and_has_no_box():
    tracker = create_tracker('metric')
    tracker.start(behind_board(0), Someone(-0.9, 3.0).box)
    hidden = []
    for i in range(1, 24):
        track = tracker.update(behind_board(i))
        box = Someone(-0.9 + 0.05 * i, 3.0).box
        if track.box is not None:
            assert track.predicted is None
            assert track.position is not None
            assert len(track.covariance) == 9
            assert len(track.velocity) == 3
        if box.x > BOARD.x and box.right < BOARD.right:
            hidden.append((i, track))
    assert len(hidden) >= 4
    for i, track in hidden:
        assert track.state is TrackState.OCCLUDED
        assert track.box is None
        assert track.occluded
        x, y, z = track.predicted
        assert abs(x - (-0.9 + 0.05 * i)) < 0.5
        assert y == pytest.approx(0.05, abs=0.3)
        assert abs(z - 3.0) < 0.5
        spread = np.array(track.covariance).reshape(3, 3)
        assert (np.linalg.eigvalsh(spread) > 0).all()


def test_a_walking_target_has_a_velocity():
    tracker = create_tracker('metric')
    tracker.start(both(0), left(0).box)
    for i in range(1, 20):
        track = tracker.update(both(i))
    assert track.velocity == pytest.approx((0.2, 0.0, 0.0), abs=0.1)


@pytest.mark.parametrize('variant', ['metric', 'kcf'])
def test_a_target_is_told_as_it_started_until_it_is_removed(variant: str):
    targets = TargetSet(variant)
    number = targets.add(both(0), left(0).box)
    follow(targets, range(1, 8))
    assert targets.started(number).box == left(0).box
    targets.remove(number)
    with pytest.raises(KeyError):
        targets.started(number)


def test_who_comes_back_is_not_told_as_the_target_and_as_somebody_new():
    """Until it is decided who he is, both had his box, with scores of 0.9."""
    targets = TargetSet('metric')
    targets.everyone = True
    number = targets.add(picture([left(0)], 0.0), left(0).box)
    for i in range(1, 10):
        targets.update(picture([left(i)], STEP * i))
    for i in range(10):
        targets.update(picture([], 1.0 + 0.5 * i))
    found = 0
    for i in range(12):
        one = Someone(-0.8 + 0.03 * i, 2.6, RED, BLACK)
        tracks = targets.update(picture([one], 6.0 + STEP * i))
        boxes = {n: track.box for n, track in tracks.items() if track.box is not None}
        assert len(boxes) <= 1
        found += number in boxes
    assert found > 8


# -- another size of image ------------------------------------------------------------------------


def resized(frame: Frame, factor: int, depth: bool) -> Frame:
    """The frame at ``factor`` times its size, as after a change of the camera's mode."""
    color = frame.color.repeat(factor, 0).repeat(factor, 1)
    metres = frame.depth.repeat(factor, 0).repeat(factor, 1) if depth else None
    return Frame(color, metres, frame.stamp_ns)


@pytest.mark.parametrize(('depth', 'surfaces'), [(False, True), (True, True), (True, False)])
def test_a_target_is_kept_when_the_image_size_changes(depth: bool, surfaces: bool):
    tracker = create_tracker('metric', MetricParameters(use_surfaces=surfaces))
    tracker.start(resized(both(0), 2, depth), _times(left(0).box, 2))
    for i, factor in enumerate((2, 2, 1, 1, 3, 3, 2), start=1):
        track = tracker.update(resized(both(i), factor, depth))
        assert track.box is not None, f'{i}: lost at {factor} times the size'
        assert track.box.iou(_times(left(i).box, factor)) > 0.6


@pytest.mark.parametrize('every', [1, 2, 3])
def test_the_image_size_may_change_while_somebody_is_hidden(every: int):
    """Where he was last seen is asked for in the pixels of now."""
    targets, seen, hidden = TargetSet('metric'), [], 0
    targets.everyone = True
    for i in range(34):
        walker = Someone(-1.2 + 0.08 * i, 3.4, RED, BLACK)
        frame = picture([walker, Someone(0.2, 2.4, GREEN, GREY)], 0.1 * i)
        if i % (2 * every) >= every:
            color, depth = frame.color[::2, ::2].copy(), frame.depth[::2, ::2].copy()
            frame = Frame(color, depth, frame.stamp_ns)
        tracks = targets.update(frame)
        seen.append(sum(track.box is not None for track in tracks.values()))
        hidden += any(person.hidden for person in targets.metric._crowd.people)
    assert hidden
    assert min(seen[12:]) == 1
    assert seen[-1] == 2


def _times(box: Box, factor: float) -> Box:
    return Box(box.x * factor, box.y * factor, box.width * factor, box.height * factor)


# -- poses ----------------------------------------------------------------------------------------

QUARTER = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def test_a_pose_moves_points_and_its_inverse_moves_them_back():
    pose = Pose(QUARTER, np.array([1.0, 2.0, 3.0]))
    point = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    assert pose.of(point) == pytest.approx(np.array([[2.0, 2.0, 3.0], [1.0, 2.0, 2.0]]))
    assert pose.inverse.of(pose.of(point)) == pytest.approx(point)
    other = Pose(np.eye(3), np.array([0.0, 0.0, -1.0]))
    assert pose.after(other).of(point) == pytest.approx(other.of(pose.of(point)))


@pytest.mark.parametrize(
    ('rotation', 'translation', 'says'),
    [
        (np.eye(3) * 2, np.zeros(3), 'no rotation'),
        (np.diag([1.0, 1.0, -1.0]), np.zeros(3), 'no rotation'),
        (np.eye(4), np.zeros(3), r'\(4, 4\)'),
        (np.eye(3), np.zeros((3, 1)), r'\(3, 1\)'),
        (np.full((3, 3), np.nan), np.zeros(3), 'not finite'),
        (np.eye(3), np.array([0, np.inf, 0]), 'not finite'),
    ],
)
def test_what_is_no_pose_is_refused(rotation: np.ndarray, translation: np.ndarray, says: str):
    with pytest.raises(ParameterError, match=says):
        Pose(rotation, translation)


def test_a_frame_carries_its_pose_and_its_camera():
    frame = both(0)
    assert frame.pose is None
    assert frame.camera == ''
    pose = Pose(QUARTER, np.zeros(3))
    there = dataclasses.replace(frame, pose=pose, camera='door')
    assert there.pose is pose
    assert there.camera == 'door'
    with pytest.raises(ImageError):
        dataclasses.replace(there, depth=np.zeros((3, 3), np.float32))


def test_an_image_that_is_masked_or_of_another_kind_is_taken_for_what_it_shows():
    frame = both(0)
    hidden = np.zeros(frame.depth.shape, bool)
    hidden[:10] = True
    masked = Frame(frame.color, np.ma.masked_array(frame.depth, hidden))
    assert type(masked.depth) is np.ndarray
    assert (np.isnan(masked.depth) == hidden).all()
    assert type(Frame(frame.color, np.asmatrix(frame.depth)).depth) is np.ndarray
    assert type(Frame(np.ma.masked_array(frame.color, False)).color) is np.ndarray


@pytest.mark.parametrize(
    ('color', 'depth', 'stamp', 'says'),
    [
        ([[1]], None, 0, 'colour image is a list: give an array'),
        (None, None, 0, 'colour image is a NoneType'),
        (np.zeros((2, 2, 3), np.uint8), [[1.0]], 0, 'depth image is a list'),
        (np.zeros((2, 2, 3), np.uint8), None, 1.5, 'stamp_ns is 1.5: give whole nanoseconds'),
        (np.zeros((2, 2, 3), np.uint8), None, float('nan'), 'stamp_ns is nan'),
    ],
)
def test_what_is_no_image_or_no_stamp_is_refused(color: Any, depth: Any, stamp: Any, says: str):
    with pytest.raises(ImageError, match=says):
        Frame(color, depth, stamp)


def test_a_target_is_kept_in_the_world_by_the_poses_of_a_moving_camera():
    """The camera makes a step to the side while the target is hidden: the prediction goes along."""
    predicted = []
    for step in (0.0, 0.3):
        tracker = create_tracker('metric', MetricParameters())
        still = Pose(np.eye(3), np.zeros(3))
        moved = Pose(np.eye(3), np.array([step, 0.0, 0.0]))
        one = Someone(0.1, 3.0)
        for i in range(4):
            frame = picture([one], STEP * i, pose=still)
            track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
            assert track.box is not None
        # All is covered by something near, so that nothing but the pose tells of the motion.
        near = np.full((ROWS, COLS), 0.8, np.float32)
        covered = Frame(np.full((ROWS, COLS, 3), 90, np.uint8), near, 400_000_000, CAMERA, moved)
        track = tracker.update(covered)
        assert track.box is None
        predicted.append(track.predicted)
    assert predicted[1][0] - predicted[0][0] == pytest.approx(-0.3, abs=0.1)


def test_numbers_beyond_floats_are_refused_and_boxes_without_an_area_overlap_nothing():
    with pytest.raises(ParameterError, match='jump'):
        MetricParameters().replace(jump=10**400)
    least = Box(0, 0, 1e-170, 1e-170)
    assert least.iou(least) == 0.0


def seldom(i: int) -> Frame:
    return both(i) if i % 2 else without_depth(i)


@pytest.mark.parametrize('blind', [1, 3])
def test_several_who_were_chosen_before_depth_came_are_followed_by_it(blind: int):
    """In one frame one becomes somebody, whom the other's look had not been compared with."""
    targets = TargetSet('metric')
    numbers = [targets.add(without_depth(0), one(0).box) for one in (left, right)]
    assert targets.metric is not None
    for i in range(1, 16):
        tracks = targets.update(without_depth(i) if i < blind else both(i))
        assert list(tracks) == numbers
    for number, one in zip(numbers, (left, right), strict=True):
        assert tracks[number].box is not None
        assert tracks[number].box.iou(one(15).box) > 0.8
        assert targets.metric.person(number) is not None
        assert targets.add(both(15), one(15).box) == number
    for number, one in zip(numbers, (left, right), strict=True):
        targets.remove(number)
        assert targets.add(both(16), one(16).box) == number


def test_a_thing_that_is_drawn_again_keeps_its_id():
    mug, frame = Box(100, 70, 10, 12), both(0)
    targets = TargetSet('metric')
    number = targets.add(frame, mug)
    assert targets.add(frame, mug) == number
    targets.update(both(1))
    assert targets.add(both(2), mug.moved(1, 0)) == number
    assert len(targets) == 1


def test_who_is_chosen_again_while_it_is_open_whether_he_has_come_back_keeps_his_id():
    def scene(i: int) -> Frame:
        here = [Someone(-0.5, 3.0)] if i < 20 else [Someone(1.0, 3.4)] if i >= 50 else []
        return picture(here, STEP * i)

    targets = TargetSet('metric')
    number = targets.add(scene(0), Someone(-0.5, 3.0).box)
    assert targets.metric is not None
    i = 0
    while not (i > 50 and targets.metric._followers[number].glimpsed is not None):
        i += 1
        assert i < 60
        tracks = targets.update(scene(i))
    assert tracks[number].box is not None
    assert targets.add(scene(i), tracks[number].box) == number
    for j in range(i + 1, i + 30):
        tracks = targets.update(scene(j))
        assert list(tracks) == [number]
        assert tracks[number].box is not None
        assert tracks[number].box.iou(Someone(1.0, 3.4).box) > 0.8


def late(scene: Callable[[int], Frame], i: int) -> Frame:
    """A frame of a camera whose intrinsics come with the one of index 8."""
    frame = scene(i)
    return frame if i >= 8 else dataclasses.replace(frame, intrinsics=None)


def test_a_camera_whose_intrinsics_stop_coming_is_the_same_camera():
    answers = []
    wide = dataclasses.replace(CAMERA, fx=160.0, fy=160.0)
    for stop in (99, 8):
        targets = TargetSet('metric')
        number = targets.add(dataclasses.replace(both(0), intrinsics=wide), left(0).box)
        assert targets.metric is not None
        for i in range(1, 20):
            frame = dataclasses.replace(both(i), intrinsics=wide if i < stop else None)
            box = targets.update(frame)[number].box
        person = targets.metric.person(number)
        assert person is not None
        answers.append((box, person.place.tolist()))
    assert answers[0] == answers[1]


@pytest.mark.parametrize('scene', [both, seldom])
def test_intrinsics_that_come_late_start_all_over_at_the_first_depth_with_all_in_view(
    scene, monkeypatch: pytest.MonkeyPatch
):
    """Also where depth comes in every other frame; and not a second time."""
    restarts = []
    whole = MetricTargets._start_over
    monkeypatch.setattr(
        MetricTargets,
        '_start_over',
        lambda self, frame: (restarts.append(frame), whole(self, frame))[1],
    )
    targets = TargetSet('metric')
    for i in range(20):
        frame = late(scene, i)
        if i == 0:
            number = targets.add(frame, left(0).box)
        else:
            tracks = targets.update(frame)
    assert [frame.stamp_ns for frame in restarts] == [scene(8 if scene is both else 9).stamp_ns]
    assert tracks[number].box is not None
    assert tracks[number].box.iou(left(19).box) > 0.8


def test_all_does_not_start_over_long_after_the_intrinsics_have_come(
    monkeypatch: pytest.MonkeyPatch,
):
    """One of two is hidden when they come, and for long: what was seen meanwhile is kept."""
    restarts = []
    monkeypatch.setattr(MetricTargets, '_start_over', lambda self, frame: restarts.append(frame))

    def scene(i: int) -> Frame:
        there = [left(0)] if 5 <= i < 60 else [left(0), right(0)]
        return picture(there, STEP * i)

    targets = TargetSet('metric')
    for i in range(70):
        frame = late(scene, i)
        if i == 0:
            for one in (left(0), right(0)):
                targets.add(frame, one.box)
        else:
            targets.update(frame)
    assert restarts == []


def test_how_long_the_intrinsics_are_known_counts_from_the_images_of_that_size(
    monkeypatch: pytest.MonkeyPatch,
):
    """The target is hidden when the first come, and the camera then sends larger images."""
    restarts = []
    monkeypatch.setattr(MetricTargets, '_start_over', lambda self, frame: restarts.append(frame))

    def scene(i: int) -> Frame:
        frame = picture([] if 3 <= i < 10 else [left(0)], STEP * i)
        k = 1 if i < 10 else 2
        numbers = (k * each for each in (CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy))
        told = 5 <= i < 10 or i >= 50
        return Frame(
            frame.color.repeat(k, 0).repeat(k, 1),
            frame.depth.repeat(k, 0).repeat(k, 1),
            frame.stamp_ns,
            Intrinsics(*numbers) if told else None,
        )

    targets = TargetSet('metric')
    targets.add(scene(0), left(0).box)
    for i in range(1, 52):
        targets.update(scene(i))
    assert [frame.stamp_ns for frame in restarts] == [scene(i).stamp_ns for i in (50, 51)]


def test_everybody_keeps_his_id_when_all_starts_over():
    targets = TargetSet('metric')
    targets.everyone = True
    ids = []
    for i in range(14):
        frame = late(both, i)
        ids.append({n for n, track in targets.update(frame).items() if track.box is not None})
    assert len(ids[-1]) == 2
    assert ids[7:] == [ids[7]] * 7


def test_two_whose_boxes_overlap_are_two_when_all_starts_over():
    one = Someone(0.0, 3.0)
    targets = TargetSet('metric')
    frame = picture([one], 0.0)
    first = targets.add(frame, one.box)
    assert targets.metric is not None
    targets.metric._followers[2] = targets.metric._followers[first]  # as if both were there
    other = dataclasses.replace(
        picture([one], STEP), intrinsics=dataclasses.replace(CAMERA, fx=1.1 * CAMERA.fx)
    )
    tracks = targets.update(other)
    assert list(tracks) == [first, 2]
    people = [each.person for each in targets.metric._followers.values()]
    assert people[0] is not None
    assert people[0] is not people[1]


def test_one_target_alone_has_no_id():
    tracker = create_tracker('metric')
    assert tracker.start(both(0), left(0).box).id == 0
    assert tracker.update(both(1)).id == 0


def seen_of(targets: TargetSet, frame: Frame) -> int:
    return sum(track.box is not None for track in targets.update(frame).values())


def test_people_are_told_from_the_room_by_the_first_image_that_shows_anything():
    """A camera that warms up sends images without readings, and both were room to the end."""
    targets = TargetSet('metric')
    targets.everyone = True
    people = [Someone(-0.7, 3.0), Someone(0.8, 2.5, GREEN)]
    for i in range(6):
        frame = picture(people, STEP * i)
        empty = Frame(frame.color, np.full_like(frame.depth, np.nan), frame.stamp_ns, CAMERA)
        assert seen_of(targets, frame if i else empty) == (2 if i else 0)


@pytest.mark.parametrize('empty', [0, 3])
def test_where_depth_ends_is_known_although_an_image_was_empty(empty: int):
    targets = TargetSet('metric')
    targets.everyone = True
    for i in range(8):
        frame = picture([], STEP * i)
        depth = frame.depth.copy()
        depth[:, :40] = depth[:, -40:] = np.nan
        if i == empty:
            depth[:] = np.nan
        targets.update(Frame(frame.color, depth, frame.stamp_ns, CAMERA))
    assert targets.metric is not None
    rim = targets.metric.account.scene.rim
    assert (rim.left, rim.right) == (40, 40)


@pytest.mark.parametrize('away', [1, 3])
def test_depth_without_a_single_reading_for_a_moment_is_as_none(away: int):
    """The room began anew with the next image, and who stood there was a part of it."""
    boxes, rooms = [], []
    for blank in (True, False):
        targets = TargetSet('metric')
        targets.everyone = True
        shown = []
        for i in range(40):
            frame = picture([left(min(i, 20)), right(i)] if i > 3 else [], STEP * i)
            if 25 <= i < 25 + away:
                depth = np.full_like(frame.depth, np.nan) if blank else None
                # So much changes in the picture that the camera may have moved.
                noise = np.random.default_rng(i).integers(0, 40, frame.color.shape, np.uint8)
                frame = dataclasses.replace(frame, color=frame.color // 2 + noise, depth=depth)
            shown.append({n: track.box for n, track in targets.update(frame).items()})
        boxes.append(shown)
        assert targets.metric is not None
        rooms.append(targets.metric._reader.room.depth)
    np.testing.assert_array_equal(*rooms)
    assert boxes[0] == boxes[1]
    assert all(box is not None for box in boxes[0][-1].values())
    assert len(boxes[0][-1]) == 2


@pytest.mark.parametrize('reading', [None, 0.0, np.nan])
def test_a_target_is_found_in_images_of_another_size_whose_depth_reads_nothing(reading):
    """It was sought in the pixels of the old size."""
    targets = TargetSet('metric')
    for i in range(12):
        targets.update(picture([left(i)] if i > 3 else [], STEP * i))
        if i == 6:
            number = targets.add(picture([left(i)], STEP * i), left(i).box)
    for i in range(12, 18):
        frame = larger(picture([left(i)], STEP * i), 2, reading is not None)
        if reading is not None:
            frame.depth[:] = reading
        box = targets.update(frame)[number].box
        assert box is not None
        assert box.iou(left(i).box.stretched(2, 2)) > 0.5


def test_who_is_chosen_in_an_image_without_depth_is_he_who_was_followed_with_everyone():
    """He got another id, and as somebody who had been there before he was refused by it."""
    targets = TargetSet('metric')
    targets.everyone = True
    for i in range(20):
        tracks = targets.update(picture([left(i), right(i)] if i > 3 else [], STEP * i))
    (his,) = (n for n, track in tracks.items() if track.box.iou(left(19).box) > 0.5)
    frame = without_depth(20)
    targets.update(frame)
    number = targets.add(frame, left(20).box)
    assert number == his
    for i in range(21, 30):
        tracks = targets.update(both(i))
        assert tracks[number].box.iou(left(i).box) > 0.5
        assert len(tracks) == 2
    # After a while it is not known any more who stood there.
    for i in range(30, 40):
        targets.update(without_depth(i))
    targets.remove(number)
    assert targets.add(without_depth(40), left(40).box) != his


def test_the_feet_of_who_is_near_are_not_below_the_image():
    targets = TargetSet('metric')
    targets.everyone = True
    height, low = 270, 0
    for one in islice(simulate('group_crossing', seed=1, rate_hz=5.0, size=(480, height)), 40):
        for track in targets.update(one.frame).values():
            if track.box is not None:
                assert track.box.bottom <= height
                low += track.box.bottom > height - 1
    assert low > 5


def test_two_of_whom_only_looks_are_known_are_not_both_the_one_who_comes_in():
    """Both went over to him in one frame, and neither had a box from then on."""
    targets, one, other = TargetSet('metric'), Someone(-0.35, 2.5), Someone(0.35, 2.5)
    frame = picture([one, other], 0.0, unread=one)
    first, second = (targets.add(frame, each.box) for each in (one, other))
    for i in range(1, 10):
        targets.update(picture([one, other], STEP * i, unread=one))
    for i in range(10, 16):
        targets.update(picture([], STEP * i))
    for i in range(16, 40):
        comes = Someone(0.03 * min(i - 16, 15), 2.5)
        tracks = targets.update(picture([comes], STEP * i))
        boxes = [tracks[n].box for n in (first, second)]
        assert boxes[0] is not None, i
        assert boxes[0].iou(comes.box) > 0.8
        assert boxes[1] is None or boxes[1].iou(boxes[0]) < 0.6
    assert boxes[1] is None


def test_targets_that_were_removed_are_forgotten_as_others_are():
    targets = TargetSet('metric')
    for i in range(MOST_PEOPLE + 20):
        frame = picture([Someone(-0.8 + 0.02 * (i % 80), 3.0)], STEP * i)
        targets.update(frame)
        assert targets.metric is not None
        crowd = targets.metric._crowd
        crowd.welcome(np.array([0.1 * i, 9.0]), crowd.time, chosen=True)
    for person in crowd.people:
        person.chosen = False
    crowd.welcome(np.zeros(2), crowd.time)
    assert len(crowd.people) == MOST_PEOPLE


def test_who_comes_while_as_many_are_remembered_as_can_be_is_not_forgotten_at_once():
    """Two who came together above a counter forgot each other in every frame."""
    shown = []
    for remembered in (0, MOST_PEOPLE):
        targets = TargetSet('metric')
        targets.everyone = True
        frames = 0
        for i in range(60):
            people = [Someone(-1 + 0.04 * i, 3.0), Someone(1.2 - 0.03 * i, 2.4, GREEN)]
            frame = picture(people if i > 9 else [], STEP * i)
            frame.color[60:], frame.depth[60:] = GREY, 1.5
            frames += seen_of(targets, frame) == 2
            assert targets.metric is not None
            if i == 8:
                for _ in range(remembered):
                    crowd = targets.metric._crowd
                    person = crowd.welcome(np.array([50.0, 50.0]), crowd.time)
                    person.upright, person.seen_at = True, crowd.time - 5
        shown.append(frames)
    assert shown[1] >= shown[0] > 10


def larger(frame: Frame, times: float, depth: bool = True) -> Frame:
    def grown(image: np.ndarray) -> np.ndarray:
        return cv2.resize(image, None, fx=times, fy=times, interpolation=cv2.INTER_NEAREST)

    k, middle = CAMERA, (times - 1) / 2
    camera = Intrinsics(times * k.fx, times * k.fy, times * k.cx + middle, times * k.cy + middle)
    read = grown(frame.depth) if depth else None
    return Frame(grown(frame.color), read, frame.stamp_ns, camera)


def test_a_target_without_a_persons_shape_is_followed_into_images_of_another_size(
    monkeypatch: pytest.MonkeyPatch,
):
    """As in the first frame, all that has no person's shape is room then, and so it was refused."""
    monkeypatch.setattr(people_rig, 'PARTS', ((0.0, 0.5, 0.5), (0.5, 0.7, 0.5), (0.7, 1.0, 0.5)))
    tracker = create_tracker('metric')
    for i in range(40):
        one = Someone(-0.6 + 0.05 * min(i, 14), 2.6)
        frame, drawn = picture([one], STEP * i), one.box
        if i > 24:
            frame, drawn = larger(frame, 1.25), drawn.stretched(1.25, 1.25)
        track = tracker.start(frame, drawn) if i == 0 else tracker.update(frame)
        assert track.box is not None, i
    assert track.box.iou(drawn) > 0.8


def test_frames_without_depth_and_of_another_size_are_looked_at_in_their_own_pixels():
    tracker = create_tracker('metric')
    for i in range(20):
        one = Someone(-0.6 + 0.02 * i, 3.0)
        frame, drawn = picture([one], STEP * i), one.box
        if i > 14:
            frame, drawn = larger(frame, 2, depth=False), drawn.stretched(2, 2)
        track = tracker.start(frame, drawn) if i == 0 else tracker.update(frame)
        assert track.box is not None, i
        assert track.box.iou(drawn) > 0.7, i


@pytest.mark.parametrize('times', [1, 2])
def test_how_high_a_newcomer_may_be_is_told_in_the_pixels_of_the_image(times: int):
    one, accounts = Someone(0.0, 4.5), []
    for size in (1, times):
        targets = TargetSet('metric')
        targets.everyone = True
        targets.update(larger(picture([one], 0.0), size))
        assert targets.metric is not None
        accounts.append(dataclasses.replace(targets.metric.account, time=1.0))
    newcomers = Newcomers(accounts[0], one.box, 0.0, frozenset())
    assert newcomers._grown(accounts[1]) == pytest.approx(times * newcomers._grown(accounts[0]))


@pytest.mark.parametrize('about', [True, False])
def test_of_whom_something_was_in_the_box_is_not_refused_as_one_who_was_there(about: bool):
    """Nothing else had been seen before the box was drawn, so that he was where it mattered not."""
    person = Person(3, np.zeros(2), 0.0)
    newcomers = Newcomers(None, left(0).box, 1.0, frozenset({3} if about else ()))
    assert newcomers.was_there(person) == (not about)


def test_frames_without_depth_are_no_misses():
    """Nothing is looked for in them: who was followed all along had been away."""
    tracker = create_tracker('metric', MetricParameters(use_look=False))
    for i in range(45):
        one = Someone(-0.6 + 0.01 * i, 3.0)
        frame = picture([one], STEP * i)
        if i % 11:
            frame = Frame(frame.color, None, frame.stamp_ns, CAMERA)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
        if i % 11 == 0:
            assert track.box is not None
            assert track.score > 0.98, i


def test_no_number_that_a_cue_was_told_is_given_again():
    told: list[int] = []

    class Told:
        name, weight = 'told', 0.0

        def start(self, frame: Frame, box: Box, target: int) -> None:
            told.append(target)

        def weigh(self, frame: Frame, boxes: Any, target: int) -> Any:
            return np.zeros(len(boxes))

        def learn(self, frame: Frame, box: Box, target: int) -> None:
            pass

    tracker = MetricTracker(MetricParameters(), [Told()])
    for i in range(3):
        one = Someone(0.0, 3.0)
        tracker.start(picture([one], STEP * i), one.box)
    assert len(told) == len(set(told)) == 3
