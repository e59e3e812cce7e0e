# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Things that stand still before a camera that moves, and the bench that follows them."""

from __future__ import annotations

import dataclasses
import gc
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker import Frame, Tracker, create_tracker
from rgbd_kcf_tracker.bench import things as bench
from rgbd_kcf_tracker.bench.things_room import furnished
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.metric.perceive.colors import view_image
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.ego_motion import EgoMotion, Lost
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.simulation.sequence import SimulatedFrame, SimulatedSequence

SIZE, RATE_HZ = (320, 240), 5.0
Moments = tuple[SimulatedSequence, list[SimulatedFrame]]


@pytest.fixture(scope='module')
def turns() -> Moments:
    """Eight seconds in which the camera turns to one side, to the other, and back."""
    sequence = furnished(1, SIZE, RATE_HZ, 8.0)
    return sequence, list(sequence)


@pytest.fixture(scope='module')
def room(turns: Moments) -> Moments:
    """The first four of them."""
    sequence, moments = turns
    return sequence, moments[: len(moments) // 2]


def test_what_the_camera_turns_away_from_is_nothing_else(turns: Moments):
    """Its neighbours and the table were the thing, half of the time with scores of 0.9 and more."""
    moments, total = turns[1], bench.Tracked()
    for number in moments[0].truths:
        truths = [moment.truths[number] for moment in moments]
        clear = (i for i, truth in enumerate(truths) if truth.visible_fraction >= bench.BEGIN)
        first = next(clear, None)
        shown = None if first is None else truths[first].shown
        if shown is not None:
            frames = [moment.frame for moment in moments[first:]]
            wheres = [bench.exact(truth) for truth in truths[first:]]
            total.add(bench.follow(frames, wheres, shown))
    assert total.tracks > 4
    assert total.right > 50
    assert total.wrong == 0


def followed(seed: int, number: int, frames: range) -> bench.Tracked:
    """What comes of a thing of a room that is chosen in the first of some frames."""
    sequence = furnished(seed)
    moments = [sequence[i] for i in frames]
    truths = [moment.truths[number] for moment in moments]
    assert truths[0].shown is not None
    wheres = [bench.exact(truth) for truth in truths]
    return bench.follow([moment.frame for moment in moments], wheres, truths[0].shown)


def test_a_thing_is_looked_for_where_it_stands_in_the_world():
    """The camera turned by more than its width in the first step: it was not seen for 29 frames."""
    mug = followed(21, 1, range(47, 79))
    assert (mug.right, mug.wrong, mug.missed) == (mug.frames, 0, 0)


@pytest.mark.parametrize('number', [1, 4])
def test_a_thing_is_kept_when_the_image_size_changes(number: int):
    """Where it was last was asked for in the pixels of before: it was hidden, for good."""
    sequence = furnished(21, SIZE)
    start = next(m for m in sequence if m.truths[number].visible_fraction > 0.95)
    frame, shown = start.frame, start.truths[number].shown
    assert shown is not None
    assert frame.depth is not None
    assert frame.intrinsics is not None
    k = frame.intrinsics
    color, depth = (each.repeat(2, 0).repeat(2, 1) for each in (frame.color, frame.depth))
    larger = Frame(color, depth, 0, Intrinsics(2 * k.fx, 2 * k.fy, 2 * k.cx, 2 * k.cy))
    tracker = create_tracker('metric')
    tracker.start(frame, shown)
    for i in range(1, 8):
        now = frame if i < 4 else larger
        found = tracker.update(dataclasses.replace(now, stamp_ns=frame.stamp_ns + i * 100_000_000))
        times = 1 if i < 4 else 2
        assert found.box is not None
        assert found.box.iou(shown.stretched(times, times)) > 0.7


@pytest.mark.parametrize(('seed', 'frames'), [(25, range(14)), (32, range(1, 12))])
def test_a_thing_that_stands_on_a_table_is_nobody(seed: int, frames: range):
    """A box at the image's side was the table as well, of a person's size and cut off there."""
    box = followed(seed, 7, frames)
    assert (box.right, box.wrong) == (box.frames, 0)


@pytest.mark.parametrize('gone', [False, True])
def test_a_thing_that_was_taken_away_is_not_where_it_stood(gone: bool):
    """Though a table looks about as much like a mug there as the mug in a blurred picture."""
    whole, bare = furnished(21), furnished(21)
    bare.scene.actors = [
        actor for number, actor in enumerate(bare.scene.actors, start=1) if number != 4
    ]
    bare.scene.people = range(len(bare.scene.actors))
    moments = [whole[i] for i in range(60)]
    assert moments[0].truths[4].shown is not None
    away = [i for i, m in enumerate(moments) if m.truths[4].visible_fraction == 0]
    tracker, back = create_tracker('metric'), 0
    tracker.start(moments[0].frame, moments[0].truths[4].shown)
    for i, moment in enumerate(moments[1:], start=1):
        taken = gone and i > away[2]
        found = tracker.update(bare[i].frame if taken else moment.frame)
        back += i > away[2] and found.box is not None
    shown = sum(m.truths[4].visible_fraction > 0.5 for m in moments[away[2] :])
    assert back == 0 if gone else back > 0.8 * shown > 10


AHEAD = np.array([0.0, 0.0, 2.0])


def motions(sequence: SimulatedSequence, frames: range, beyond: float) -> list[Pose | Lost | None]:
    """What is told of the camera's motion in some frames by what is so many metres away."""
    ego, told = EgoMotion(), []
    near: np.ndarray | None = None
    for i in frames:
        frame = sequence[i].frame
        view = DepthView.of(frame, 240)
        assert view is not None
        near = (view.depth > 0) & (view.depth < beyond) if near is None else near
        image = view_image(frame.color, view.step)
        told.append(ego.update(image, view, near, 1 / sequence.rate_hz))
        ego.settle()
    return told


def true_motion(sequence: SimulatedSequence, first: int, then: int) -> Pose:
    poses = (Pose(*sequence.camera_pose(i)) for i in (first, then))
    return next(poses).after(next(poses).inverse)


def test_before_a_far_wall_the_camera_turns_and_does_not_step_aside():
    """What corners it has are a wall's, of which a step of 0.37 m showed as much as the turn."""
    sequence = furnished(24)
    _, motion = motions(sequence, range(70, 72), 3.0)
    assert isinstance(motion, Pose)
    assert motion.of(AHEAD) == pytest.approx(true_motion(sequence, 70, 71).of(AHEAD), abs=0.1)


def test_a_camera_that_turns_is_noticed_though_no_frame_differs_much_from_the_last():
    """At 30 Hz it was after 0.3 s, and what stood still had moved for good by then."""
    sequence = furnished(42, rate_hz=30.0)
    told = motions(sequence, range(47, 53), 0.0)
    first = next(i for i, motion in enumerate(told) if motion is not None)
    assert first < 5
    since = told[first]
    assert isinstance(since, Pose)
    assert all(isinstance(motion, Pose) for motion in told[first:])
    true = true_motion(sequence, 47, 47 + first)
    assert since.of(AHEAD) == pytest.approx(true.of(AHEAD), abs=0.05)


def chosen(moments: Sequence[SimulatedFrame], number: int) -> bench.Thing:
    truth = moments[0].truths[number]
    assert truth.shown is not None
    return bench.Thing(str(number), 0, truth.shown)


def in_clear_view(moments: Sequence[SimulatedFrame]) -> list[int]:
    return [n for n, truth in moments[0].truths.items() if truth.visible_fraction > 0.95]


@pytest.mark.parametrize('posed', [True, False])
def test_the_truth_of_a_recording_is_where_the_thing_is(room: Moments, posed: bool):
    """By the camera's poses, and without any by what the picture tells."""
    sequence, moments = room
    frames = [moment.frame for moment in moments]
    if posed:
        frames = [
            dataclasses.replace(frame, pose=Pose(*sequence.camera_pose(i)))
            for i, frame in enumerate(frames)
        ]
    estimates = [bench.stands(frames, step) for step in (1, 2)]
    judged = out = 0
    for number in in_clear_view(moments):
        wheres = bench.places(frames, chosen(moments, number), estimates)
        for where, moment in zip(wheres, moments, strict=True):
            truth = moment.truths[number]
            if where is None:
                assert not posed, 'poses are known throughout'
            elif truth.shown is not None and truth.visible_fraction > 0.9:
                judged += 1
                assert where.holds(truth.shown)
            elif truth.shown is None:
                out += 1
                assert not where.shows
    assert judged > 30
    assert out


def test_nothing_is_judged_once_the_camera_is_lost(room: Moments):
    frames = [moment.frame for moment in room[1]]
    dark = dataclasses.replace(frames[6], color=np.zeros_like(frames[6].color))
    frames[6] = dark
    stands = bench.stands(frames, 1)
    wheres = bench.places(frames, chosen(room[1], in_clear_view(room[1])[0]), [stands])
    assert all(where is not None for where in wheres[:6])
    assert all(where is None for where in wheres[6:])


def test_where_two_estimates_disagree_nothing_is_judged(room: Moments):
    frames = [moment.frame for moment in room[1]]
    stands = bench.stands(frames, 1)
    off = Pose(np.eye(3), np.array([1.5 * bench.APART, 0.0, 0.0]))
    others = [
        *stands[:4],
        *(s and dataclasses.replace(s, pose=s.pose.after(off)) for s in stands[4:]),
    ]
    wheres = bench.places(frames, chosen(room[1], in_clear_view(room[1])[0]), [stands, others])
    assert [where is not None for where in wheres] == [i < 4 for i in range(len(frames))]


def test_what_hides_a_thing_is_no_miss(room: Moments):
    frames = [moment.frame for moment in room[1][:2]]
    thing = chosen(room[1], in_clear_view(room[1])[0])
    depth = np.full(SIZE[::-1], 0.5, np.float32)
    covered = [frames[0], dataclasses.replace(frames[1], depth=depth)]
    still = [bench.Stand(0, Pose(np.eye(3), np.zeros(3)))] * 2
    for shown, shows in ((frames, True), (covered, False)):
        where = bench.places(shown, thing, [still])[1]
        assert where is not None
        assert (where.shows, where.hidden) == (shows, not shows)


def test_boxes_are_counted_by_where_the_thing_is(room: Moments):
    """The same boxes are right by the truth, and wrong by that of another thing."""
    moments = room[1][:8]
    frames = [moment.frame for moment in moments]
    number, *_ = in_clear_view(moments)
    thing = chosen(moments, number)
    wheres = [bench.Where(moment.truths[number].body, True) for moment in moments]
    right = bench.follow(frames, wheres, thing.box)
    assert right.right > 4
    assert (right.frames, right.wrong, right.sure_wrong) == (len(frames) - 1, 0, 0)
    assert right.right + right.missed == right.frames
    assert right.honest
    other = bench.follow(frames, [bench.Where(None, False)] * len(frames), thing.box)
    assert (other.wrong, other.right, other.missed) == (right.right, 0, 0)
    assert other.sure_wrong == other.sure == right.sure > 0
    assert not other.honest
    # Of a box at its place nobody knows what it is about while something nearer is before it.
    hidden = [dataclasses.replace(where, shows=False, hidden=True) for where in wheres]
    behind = bench.follow(frames, hidden, thing.box)
    assert (behind.right, behind.wrong, behind.missed, behind.sure) == (0, 0, 0, 0)
    assert behind.frames == right.missed
    away = bench.Where(Box(0, 0, 1, 1), False, hidden=True)
    assert bench.follow(frames, [away] * len(frames), thing.box).wrong == right.right
    nothing = bench.follow(frames, [None] * len(frames), thing.box)
    assert (nothing.frames, nothing.right, nothing.wrong) == (0, 0, 0)


def test_a_thing_is_followed_both_ways_in_time(room: Moments, monkeypatch: pytest.MonkeyPatch):
    frames = [moment.frame for moment in room[1]]
    seen: list[list[int]] = []

    def follow(shown: Sequence[Frame], wheres: Sequence[object], box: Box) -> bench.Tracked:
        seen.append([frame.stamp_ns for frame in shown])
        return bench.Tracked(tracks=1)

    monkeypatch.setattr(bench, 'follow', follow)
    thing = bench.Thing('mug', 12, Box(0, 0, 10, 10))
    ways = [way for way, _ in bench.both_ways(frames, [None] * len(frames), thing, 1)]
    assert ways == ['backwards'], 'eight frames are too few'
    assert seen == [[round(i * 1e9 / RATE_HZ) for i in range(13)]]


@pytest.fixture
def folder(room: Moments, tmp_path: Path) -> Path:
    """The room as a folder of images, and what to follow in it."""
    moments = room[1]
    where = tmp_path / 'room'
    for part in ('rgb', 'depth'):
        (where / part).mkdir(parents=True)
    for i, moment in enumerate(moments):
        assert moment.frame.depth is not None
        depth = np.nan_to_num(1000 * moment.frame.depth).astype(np.uint16)
        cv2.imwrite(str(where / 'rgb' / f'{i:03d}.png'), moment.frame.color)
        cv2.imwrite(str(where / 'depth' / f'{i:03d}.png'), depth)
    lines = ['name,frame,x,y,width,height']
    for number in in_clear_view(moments)[:2]:
        sides = ','.join(f'{side:g}' for side in chosen(moments, number).box.as_tuple())
        lines.append(f'{number},0,{sides}')
    (tmp_path / 'things.csv').write_text('\n'.join(lines))
    return where


def test_the_command_counts_the_things_of_a_recording(
    room: Moments, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    def frames() -> int:
        return sum(isinstance(thing, Frame) for thing in gc.get_objects())

    def tracker(variant: str) -> Tracker:
        most.append(frames())
        return create_tracker(variant)

    before, most = frames(), list[int]()
    monkeypatch.setattr(bench, 'create_tracker', tracker)
    k = room[0].intrinsics
    camera = f'{k.fx},{k.fy},{k.cx},{k.cy}'
    line = [str(folder), '--things', str(folder.parent / 'things.csv'), '--fps', '5']
    assert bench.main([*line, '--intrinsics', camera]) == 0
    _, head, *rows = capsys.readouterr().out.splitlines()
    assert head.split()[:2] == ['things', 'tracks']
    assert [row.split()[-8] for row in rows] == ['2', '2'], 'tracks: forwards, of two'
    assert max(most) < before + 4, 'the recording was held in memory'
    assert bench.main([*line, '--strides', '2']) == 2
    assert 'give --intrinsics' in capsys.readouterr().err


@pytest.mark.parametrize(('hz', 'step'), [(5, 1), (30, 3)])
def test_the_steps_of_the_truth_are_those_of_the_stamps(
    hz: int, step: int, folder: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):  # fmt: skip
    stamps = [round(i * 1e9 / hz) for i in range(20)]
    (folder / 'timestamps.txt').write_text(''.join(f'{stamp}\n' for stamp in stamps))
    steps = []

    def stands(frames: Sequence[Frame], step: int) -> list[None]:
        steps.append(step)
        return [None] * len(frames)

    monkeypatch.setattr(bench, 'stands', stands)
    line = [str(folder), '--things', str(folder.parent / 'things.csv')]
    assert bench.main([*line, '--intrinsics', '262,262,160,120', '--fps', '7']) == 2
    assert 'room: nothing is judged' in capsys.readouterr().err
    assert steps == [step, 2 * step]


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('', 'names no thing'),
        ('mug,0,1,2,3', "line 1: 'mug,0,1,2,3' is no thing"),
        ('name,frame,x,y,width,height\nmug,0,1,2,3,no', 'line 2'),
        ('mug,-1,1,2,3,4', 'line 1'),
        ('mug,0,1,2,-3,4', 'line 1'),
    ],
)
def test_what_names_no_thing_is_said(tmp_path: Path, text: str, said: str):
    path = tmp_path / 'things.csv'
    path.write_text(text)
    with pytest.raises(RecordingError, match=said):
        bench.read_things(path)


def test_what_cannot_be_followed_is_said(folder: Path, capsys: pytest.CaptureFixture[str]):
    things = folder.parent / 'things.csv'
    line = [str(folder), '--things', str(things), '--intrinsics', '262,262,160,120']
    things.write_text('mug,20,1,1,20,20')
    assert bench.main(line) == 2
    assert 'has 20 frames, of which mug begins in 20' in capsys.readouterr().err
    for path in (folder / 'depth').iterdir():
        cv2.imwrite(str(path), np.zeros(SIZE[::-1], np.uint16))
    things.write_text('mug,0,1,1,20,20')
    assert bench.main(line) == 2
    assert 'mug: no depth in the middle of' in capsys.readouterr().err
    assert bench.main([str(folder), '--things', str(folder.parent / 'none.csv')]) == 2
    for wrong in ([], [str(folder)], [*line, '--strides', '0'], [*line, '--fps', 'nan']):
        with pytest.raises(SystemExit):
            bench.main(wrong)
