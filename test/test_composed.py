# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""New recordings of a room, into which the recorded people come in another order and again."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import cv2
import numpy as np
import pytest

from rgbd_kcf_tracker.bench import composed
from rgbd_kcf_tracker.bench.composed import Room, Sprite, Visit, Wish
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, Sample, open_dataset
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics

CAMERA = Intrinsics(150.0, 150.0, 99.5, 74.5)
WIDTH, HEIGHT = 200, 150
WALL = 4.0
PEOPLE = {1: (2.0, (30, 30, 220)), 2: (1.5, (40, 200, 40)), 3: (3.0, (220, 60, 30))}
"""How far from the camera, and of what colour."""
WALKS = {1: range(2, 7), 2: range(8, 13), 3: range(14, 18)}
"""In which frames of the recording, counted from 1; they come from the left."""
LINE = ('--fps', '1', '--intrinsics', '150,150,99.5,74.5', '--length', '50')


def box_of(who: int, frame: int) -> tuple[int, int, int, int]:
    return 10 + 35 * (frame - WALKS[who][0]), 40, 30, 80


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A wall, as bright as it is far to the right, and three people before it one by one."""
    folder = tmp_path / 'room'
    for part in ('rgb', 'depth'):
        (folder / part).mkdir(parents=True)
    lines = []
    for number in range(1, 19):
        color = np.empty((HEIGHT, WIDTH, 3), np.uint8)
        color[:] = np.arange(WIDTH)[None, :, None]
        depth = np.full((HEIGHT, WIDTH), round(1000 * WALL), np.uint16)
        for who, (away, paint) in PEOPLE.items():
            if number in WALKS[who]:
                x, y, width, height = box_of(who, number)
                color[y : y + height, x : x + width] = paint
                depth[y : y + height, x : x + width] = round(1000 * away)
                lines.append(f'{number},{who},{x},{y},{width},{height},1,0,0,{away}\n')
        cv2.imwrite(str(folder / 'rgb' / f'{number:02d}.png'), color)
        cv2.imwrite(str(folder / 'depth' / f'{number:02d}.png'), depth)
    (folder / 'mot.txt').write_text(''.join(lines))
    return folder


def samples_of(copy: Path) -> list[Sample]:
    (sequence,) = open_dataset(str(copy), DatasetOptions(everyone=True))
    return list(sequence.open().samples)


def bytes_of(copy: Path) -> dict[str, bytes]:
    files = sorted(path for path in copy.rglob('*') if path.is_file())
    return {str(path.relative_to(copy)): path.read_bytes() for path in files}


def frames_of(samples: list[Sample]) -> dict[int, list[int]]:
    """In which frames each of them is."""
    return {
        who: [s.number for s in samples if any(p.id == who for p in s.people)] for who in PEOPLE
    }


def test_the_room_is_empty_and_people_stand_in_it_as_they_were_recorded(
    recording: Path, tmp_path: Path
):
    source = composed.read_source(recording, 1.0, CAMERA, 1)
    assert (source.room.depth == np.float32(WALL)).all()
    assert (source.room.color == np.arange(WIDTH)[None, :, None]).all()
    assert {who: [len(walk) for walk in some] for who, some in source.walks.items()} == {
        who: [len(WALKS[who])] for who in PEOPLE
    }
    out = tmp_path / 'out'
    assert composed.main([str(recording), *LINE, '--seeds', '4', '--out', str(out)]) == 0
    samples = samples_of(out / 'room_x1_4')
    assert len(samples) == 50
    assert [sample.frame.stamp_ns for sample in samples[:3]] == [0, 10**9, 2 * 10**9]
    assert samples[0].frame.intrinsics == CAMERA
    assert not samples[0].people, 'it begins with the room'
    assert {person.id for sample in samples for person in sample.people} == set(PEOPLE)
    recorded = {(who, box_of(who, n)) for who, there in WALKS.items() for n in there}
    for sample in samples:
        depth = sample.frame.depth
        assert depth is not None
        true = np.full(depth.shape, WALL)
        for person in sorted(sample.people, key=lambda one: -PEOPLE[one.id][0]):
            away, paint = PEOPLE[person.id]
            x, y, width, height = map(int, person.box.as_tuple())
            true[y : y + height, x : x + width] = away
            if len(sample.people) == 1:
                assert (person.id, (x, y, width, height)) in recorded
                shown = sample.frame.color[y : y + height, x : x + width].mean((0, 1))
                assert shown == pytest.approx(paint, abs=1.0)
        if len(sample.people) < 2:
            error = depth - true
            assert np.abs(error).max() < 6 * composed.NOISE_DEPTH * WALL**2
            assert error.std() > 0.5 * composed.NOISE_DEPTH * WALL**2, 'there is noise'


def test_who_never_leaves_a_pixel_is_seen_through_where_it_was_farthest():
    color = np.zeros((4, HEIGHT, WIDTH, 3), np.uint8)
    depth = np.full((4, HEIGHT, WIDTH), WALL, np.float32)
    for index in range(4):
        color[index] = 10 * index
        depth[index, 40:120, 50:80] = (1.0, 1.2, 3.0, 1.1)[index]
    frames = [Frame(color[index], depth[index], index, CAMERA) for index in range(len(color))]
    one = Annotation(1, Box(50.0, 40.0, 30.0, 80.0))
    room = composed.empty_room(frames, {index: [one] for index in range(4)})
    assert (room.depth[40:120, 50:80] == 3.0).all()
    assert (room.color[40:120, 50:80] == 20).all(), 'of the same frame'
    assert (room.color[:30, :40] == 10).all(), 'the lower median elsewhere'


def test_the_same_seed_gives_the_same_bytes_and_another_does_not(recording: Path, tmp_path: Path):
    for name, seeds in (('a', ['1', '2']), ('b', ['2-2'])):
        line = [str(recording), *LINE, '--seeds', *seeds, '--out', str(tmp_path / name)]
        assert composed.main(line) == 0
    assert sorted(path.name for path in (tmp_path / 'a').iterdir()) == ['room_x1_1', 'room_x1_2']
    again = bytes_of(tmp_path / 'b' / 'room_x1_2')
    assert len(again) == 2 * 50 + 3
    assert again == bytes_of(tmp_path / 'a' / 'room_x1_2')
    other = bytes_of(tmp_path / 'a' / 'room_x1_1')
    assert other['mot.txt'] != again['mot.txt']
    assert other['depth/000001.png'] != again['depth/000001.png']


def sprite(who: int, x: int, away: float, size: tuple[int, int] = (80, 30)) -> Sprite:
    place = ((x + size[1] / 2 - CAMERA.cx) / CAMERA.fx * away, away)
    color = np.full((*size, 3), 50 * who, np.uint8)
    depth = np.full(size, away, np.float32)
    return Sprite(who, x, 40, np.ones(size, bool), color, depth, away, place)


def empty(depth: float = WALL) -> Room:
    room = np.full((HEIGHT, WIDTH), depth, np.float32)
    return Room(np.zeros((HEIGHT, WIDTH, 3), np.uint8), room)


@pytest.mark.parametrize('order', [1, -1])
def test_the_nearer_hides_the_farther_and_the_box_is_of_what_shows(order: int):
    near = sprite(2, 60, 1.5)
    # Of the farther, columns 60 to 90 are hidden.
    for x, left, width, counts in (
        (75, 90, 15, True),
        (72, 90, 12, False),
        (42, 42, 18, True),
        (52, 52, 8, False),
    ):
        there = [sprite(1, x, 3.0), near][::order]
        shown = {one.id: one for one in composed.truth_of(empty(), there)}
        assert shown[2].box == Box(60.0, 40.0, 30.0, 80.0)
        assert shown[2].counts
        assert shown[1].box == Box(left, 40.0, width, 80.0)
        assert shown[1].counts == counts, f'{width} of 30'
        color, depth = composed.picture(empty(), there, np.random.default_rng(1))
        assert color[40:120, 60:90].mean() == pytest.approx(100, abs=1)
        assert depth[40:120, 60:90].mean() == pytest.approx(1.5, abs=0.01)
        farther = depth[40:120, left : left + width].mean()
        assert farther == pytest.approx(3.0, abs=0.01)
    behind = composed.truth_of(empty(), [sprite(1, 62, 3.0), near][::order])
    assert [one.id for one in behind] == [2], 'a fifteenth shows'


def test_the_room_hides_people_too():
    room = empty()
    room.depth[90:] = 1.0
    (one,) = composed.truth_of(room, [sprite(1, 60, 3.0)])
    assert one.box == Box(60.0, 40.0, 30.0, 50.0)
    assert one.counts
    room.depth[60:] = 1.0
    (one,) = composed.truth_of(room, [sprite(1, 60, 3.0)])
    assert not one.counts, 'a quarter shows'


def test_somebody_comes_again_after_an_absence(recording: Path, tmp_path: Path):
    out = tmp_path / 'out'
    line = [str(recording), *LINE, '--absence', '4', '6', '--together', '1', '--seeds', '1']
    assert composed.main([*line, '--out', str(out)]) == 0
    samples = samples_of(out / 'room_x1_1')
    assert max(len(sample.people) for sample in samples) == 1
    gaps = [
        later - earlier - 1
        for there in frames_of(samples).values()
        for earlier, later in itertools.pairwise(there)
        if later > earlier + 1
    ]
    assert gaps
    assert min(gaps) >= 4


def test_every_second_frame_gives_walks_of_both_phases(recording: Path, tmp_path: Path):
    source = composed.read_source(recording, 1.0, CAMERA, 2)
    assert [[one.x for one in walk] for walk in source.walks[1]] == [
        [box_of(1, n)[0] - composed.MARGIN for n in phase] for phase in ((2, 4, 6), (3, 5))
    ]
    out = tmp_path / 'out'
    line = [str(recording), *LINE, '--every', '2', '--seeds', '1', '--out', str(out)]
    assert composed.main(line) == 0
    assert (out / 'room_x2_1' / 'timestamps.txt').read_text().split()[1] == '2000000000'


def test_who_is_half_hidden_is_not_cut_out(recording: Path):
    frames, people = composed.read_with_depth(recording, 1.0, CAMERA)
    first = [frames.frame(index) for index in range(len(frames))]
    room = composed.empty_room(first, people)
    x, y, width, height = box_of(1, 4)
    color, depth = first[3].color.copy(), first[3].depth
    assert depth is not None
    depth = depth.copy()
    depth[y : y + height, x + 15 : x + 45] = 1.2
    both = [*people[3], Annotation(9, Box(x + 15.0, y, width, height))]
    frame = dataclasses.replace(first[3], color=color, depth=depth)
    assert set(composed.cut_outs([frame], {0: both}, room, CAMERA)) == {9}
    # Boxes are of what shows: that of somebody without legs ends where the other begins.
    depth[y : y + height, x + 15 : x + 45] = WALL
    depth[y + 40 : y + 100, x : x + width] = 1.2
    halves = [Annotation(1, Box(x, y, width, 40.0)), Annotation(9, Box(x, y + 40.0, width, 60.0))]
    frame = dataclasses.replace(frame, depth=depth)
    assert set(composed.cut_outs([frame], {0: halves}, room, CAMERA)) == {9}
    ignored = [people[3][0], Annotation(-1, both[1].box)]
    assert set(composed.cut_outs([first[3]], {0: ignored}, room, CAMERA)) == {1}


def test_who_goes_on_where_depth_ends_is_cut_out_to_the_edge():
    room = empty()
    room.depth[:, :20] = room.depth[HEIGHT - 10 :] = np.nan
    depth = room.depth.copy()
    depth[40 : HEIGHT - 10, 20:45] = 2.0
    frame = Frame(np.zeros((HEIGHT, WIDTH, 3), np.uint8), depth, 0, CAMERA)
    cut = composed.cut_out(frame, Annotation(1, Box(0.0, 40.0, 45.0, 110.0)), room, CAMERA)
    assert cut is not None
    whole = np.zeros((HEIGHT, WIDTH), bool)
    whole[cut.within] = cut.mask
    expected = np.zeros_like(whole)
    expected[40:, :45] = True
    assert (whole == expected).all()
    (one,) = composed.truth_of(room, [cut])
    assert one.box == Box(0.0, 40.0, 45.0, 110.0)
    other = np.zeros((3, 60), bool)
    other[:, 50:] = True
    blind = np.zeros_like(other)
    blind[0, :50] = blind[1, 5:50] = True
    composed._go_on(other, blind)
    assert other[:, :50].sum() == 0, 'too far, or something is between'


def crowd() -> dict[int, list[tuple[Sprite, ...]]]:
    """Five people who walk to and fro in the same few metres."""
    return {
        who: [
            tuple(sprite(who, x, away) for x in range(begin, 160, step))
            for begin, step in ((5, 20), (25, 30), (60, 25))
        ]
        for who, away in zip(range(1, 6), (2.0, 2.2, 2.5, 2.9, 3.4), strict=True)
    }


@pytest.mark.parametrize('step_s', [1.0, 0.2])
def test_nobody_stands_in_another_or_becomes_another(step_s: float):
    wish = Wish(length=80, absence=(3, 9), together=3, step_s=step_s)
    came, backwards, most = 0, 0, 0
    for seed in range(20):
        visits = composed.plan(crowd(), wish, np.random.default_rng(seed))
        came += len(visits)
        backwards += sum(visit.walk[0].x > visit.walk[-1].x for visit in visits)
        assert min(visit.start for visit in visits) >= composed.FIRST
        assert max(visit.last for visit in visits) < wish.length
        seen: dict[int, tuple[int, Sprite]] = {}
        for frame in range(wish.length):
            there = [one for visit in visits if (one := visit.at(frame)) is not None]
            most = max(most, len(there))
            for one, other in itertools.combinations(there, 2):
                assert one.id != other.id
                assert np.hypot(*np.subtract(one.place, other.place)) >= 0.7
            for one in there:
                if seen.get(one.id, (-9, one))[0] == frame - 1:
                    continue
                if one.id in seen:
                    assert frame - seen[one.id][0] - 1 >= 3, 'the least absence'
                for who, (when, other) in seen.items():
                    gone = all(each.id != who for each in there)
                    if who != one.id and gone and (frame - when) * step_s < 2.0:
                        assert np.hypot(*np.subtract(one.place, other.place)) >= 1.5
            seen.update({one.id: (frame, one) for one in there})
    assert came > 20 * 5, 'some come again'
    assert 0.2 < backwards / came < 0.8
    assert most == 3


def test_the_rules_hold_for_visits_before_and_after():
    wish = Wish(length=30, absence=(3, 9), together=3, step_s=1.0)
    there = Visit(10, (sprite(1, 10, 2.0), sprite(1, 40, 2.0)))  # in frames 10 and 11

    def fit(start: int, x: int, away: float = 2.0) -> bool:
        walk = (sprite(2, x, away), sprite(2, x, away))
        return composed.fits(Visit(start, walk), [there], wish)

    assert not fit(12, 60), 'comes where another has just gone'
    assert fit(13, 60), 'two seconds after'
    assert fit(12, 60, 3.6), 'or elsewhere'
    assert not fit(8, 10), 'goes just before another comes there'
    assert fit(7, 10)
    assert not fit(10, 20), 'stands in another'
    assert fit(10, 20, 3.6)
    assert not fit(29, 60, 3.6), 'does not end'
    alone = dataclasses.replace(wish, together=1)
    walk = (sprite(2, 20, 3.6), sprite(2, 20, 3.6))
    assert not composed.fits(Visit(10, walk), [there], alone)


def test_what_cannot_be_composed_is_said(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = tmp_path / 'out'
    to = ['--out', str(out)]
    assert composed.main([str(recording), '--fps', '1', *to]) == 2
    assert 'give --intrinsics' in capsys.readouterr().err
    assert composed.main([str(recording), *LINE, '--every', '5', *to]) == 2
    assert 'no two after each other' in capsys.readouterr().err
    truth = (recording / 'mot.txt').read_text()
    (recording / 'mot.txt').write_text('1,7,10,40,30,80,1,0,0,3\n2,7,150,40,30,80,1,0,0,3\n')
    assert composed.main([str(recording), *LINE, *to]) == 2
    assert 'walks freely' in capsys.readouterr().err, 'nobody is before the wall'
    (recording / 'mot.txt').write_text(truth)
    for wrong in (
        ['--every', '0'],
        ['--length', '9'],
        ['--absence', '0', '3'],
        ['--absence', '5', '3'],
        ['--together', '0'],
        ['--seeds', '-1'],
        ['--seeds', '1', '1'],
        ['--seeds', '3-1'],
        ['--fps', '0'],
        ['--intrinsics', '1,2'],
    ):
        with pytest.raises(SystemExit, match='2'):
            composed.main([str(recording), *LINE, *wrong, *to])
        assert wrong[0] in capsys.readouterr().err or wrong[0] == '--intrinsics'
    assert not out.exists()
    (out / 'room_x1_2').mkdir(parents=True)
    assert composed.main([str(recording), *LINE, *to]) == 2
    assert 'room_x1_2 is there already' in capsys.readouterr().err
    assert [path.name for path in out.rglob('*')] == ['room_x1_2'], 'the first is not written'
