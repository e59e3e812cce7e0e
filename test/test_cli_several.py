# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf track`` of several targets and of everyone: what it asks for and what it writes."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

import rgbd_kcf_tracker
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import read_mot
from rgbd_kcf_tracker.recordings.overlay import draw_tracks, id_color
from rgbd_kcf_tracker.track import Track, TrackState


class Fake:
    """Boxes that were given move one pixel a frame; with everyone, one more comes at the third."""

    made: list[Fake]

    def __init__(self, variant, parameters=None) -> None:
        self.variant, self.parameters, self.everyone = variant, parameters, False
        self.boxes: dict[int, Box] = {}
        self.updates = 0
        self.made.append(self)

    def add(self, frame, box) -> int:
        self.boxes[10 + len(self.boxes)] = box
        return 9 + len(self.boxes)

    def started(self, number: int) -> Track:
        return Track(self.boxes[number], TrackState.TRACKING, 1.0, 2.0, (0.25, 0.5, 2.0))

    def update(self, frame):
        self.updates += 1
        self.boxes = {who: box.moved(1, 0) for who, box in self.boxes.items()}
        tracks = {
            who: Track(box, TrackState.TRACKING, 0.5, 2.0, (0.25, 0.5, 2.0))
            for who, box in self.boxes.items()
        }
        if self.everyone and self.updates >= 3:
            tracks[99] = Track(None, TrackState.OCCLUDED)
        return tracks


@pytest.fixture
def fake(monkeypatch) -> type[Fake]:
    monkeypatch.setattr(rgbd_kcf_tracker, 'TargetSet', Fake, raising=False)
    monkeypatch.setattr(Fake, 'made', [], raising=False)
    return Fake


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / 'walk' / 'rgb'
    path.mkdir(parents=True)
    for number in range(4):
        image = np.full((120, 160, 3), 60 + number, np.uint8)
        image[40:80, 30 + number : 50 + number] = 200
        cv2.imwrite(str(path / f'{number}.png'), image)
    return path.parent


def test_several_boxes_are_several_targets(folder: Path, tmp_path: Path, fake, capsys):
    table, text, video = tmp_path / 'a.csv', tmp_path / 'a.txt', tmp_path / 'a.mp4'
    boxes = ('--init', '10,20,30,40', '--init', '50,60,20,20')
    words = ('--output', table, '--mot', text, '--video', video, '--start', '1')
    assert main(['track', str(folder), *boxes, *map(str, words)]) == 0
    lines = table.read_text().splitlines()
    assert lines[0] == 'id,frame,stamp_ns,x,y,width,height,state,score,depth_m'
    assert lines[1] == '10,1,33333333,10.0000,20.0000,30.0000,40.0000,tracking,1.0000,2.0000'
    assert [line.split(',')[:2] for line in lines[1:]] == [
        ['10', '1'], ['11', '1'], ['10', '2'], ['11', '2'], ['10', '3'], ['11', '3']]  # fmt: skip
    assert text.read_text().splitlines()[:3] == [
        '2,10,10,20,30,40,1,0.25,0.5,2',
        '2,11,50,60,20,20,1,0.25,0.5,2',
        '3,10,11,20,30,40,0.5,0.25,0.5,2',
    ]
    assert cv2.VideoCapture(str(video)).get(cv2.CAP_PROP_FRAME_COUNT) == 3
    assert '3 frames with metric: 2 targets: 6 tracking' in capsys.readouterr().out
    assert not fake.made[0].everyone


def test_everyone_needs_no_box(folder: Path, tmp_path: Path, fake, capsys):
    table = tmp_path / 'a.csv'
    assert main(['track', str(folder), '--all', '--output', str(table)]) == 0
    assert fake.made[0].everyone
    assert [line.split(',')[:2] for line in table.read_text().splitlines()[1:]] == [
        ['99', '2'], ['99', '3']]  # fmt: skip
    assert '1 targets: 2 occluded' in capsys.readouterr().out


def test_everyone_and_some_who_are_given(folder: Path, tmp_path: Path, fake):
    text = tmp_path / 'a.txt'
    words = ('--all', '--init', '10,20,30,40', '--mot', str(text))
    assert main(['track', str(folder), *words]) == 0
    rows = read_mot(text)
    assert rows.ids.tolist() == [10] * 4
    assert rows.frames.tolist() == [0, 1, 2, 3]
    assert fake.made[0].updates == 4, 'others may be in the first frame too'


def test_one_target_as_mot_text(folder: Path, tmp_path: Path):
    text = tmp_path / 'a.txt'
    words = ('--init', '30,40,20,40', '--variant', 'kcf', '--mot', str(text))
    assert main(['track', str(folder), *words]) == 0
    rows = read_mot(text)
    assert rows.ids.tolist() == [1] * 4
    assert rows.box(0) == Box(30, 40, 20, 40)
    assert np.isnan(rows.positions).all()


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (['--all', '--bag', 'a.mcap'], '--bag holds one target'),
        (['--init', '1,2,3,4', '--init', '1,2,3'], 'X,Y,W,H'),
        (['--init', '1,2,3,4', '--init', '900,2,30,40'], 'lies outside'),
        ([], 'or --all for every person'),
    ],
)
def test_what_is_refused(words, message, folder: Path, fake, capsys):
    assert main(['track', str(folder), *words]) == 2
    assert message in capsys.readouterr().err


def test_the_source_is_not_written(folder: Path, fake, capsys):
    assert main(['track', str(folder), '--all', '--mot', str(folder)]) == 2
    assert '--mot' in capsys.readouterr().err


def test_boxes_are_drawn_with_a_colour_for_each_id():
    image = np.zeros((480, 640, 3), np.uint8)
    tracks = {
        1: Track(Box(100, 100, 50, 80), TrackState.TRACKING, 1.0),
        2: Track(Box(-500, 300, 50, 80), TrackState.TRACKING, 1.0),
        3: Track(None, TrackState.LOST),
    }
    drawn = draw_tracks(image, tracks, caption='frame 7')
    assert tuple(drawn[180 - 1, 130]) == id_color(1)
    assert not image.any(), 'the picture is left as it is'
    assert len({id_color(who) for who in range(20)}) == 20


def test_an_id_at_the_top_edge_stands_below_the_bar():
    image = np.full((480, 640, 3), 90, np.uint8)
    drawn = draw_tracks(image, {5: Track(Box(300, -20, 90, 200), TrackState.TRACKING, 1.0)})
    colored = (drawn[:, 310] == id_color(5)).all(axis=1)
    assert np.count_nonzero(colored) > 10, 'the patch of the id, as bright as it was drawn'
