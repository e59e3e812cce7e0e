# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""MOT Challenge text: what is read, what is refused, and what is written."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.mot import MotWriter, Sightings, mot_text, read_mot
from rgbd_kcf_tracker.track import Track, TrackState


def wrote(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_rows_come_in_the_order_of_frames_and_ids(tmp_path: Path):
    rows = read_mot(wrote(tmp_path / 'a.txt', '3,1,5,6,7,8,0.5,-1,-1,-1\n1,9,1,2,3,4,1,0.5,-1,2\n'
                                              '1,2,1.5,2,3,4,0,-1,-1,-1\n'))  # fmt: skip
    assert rows.frames.tolist() == [0, 0, 2]
    assert rows.ids.tolist() == [2, 9, 1]
    assert rows.box(0) == Box(1.5, 2, 3, 4)
    assert rows.scores.tolist() == [0, 1, 0.5]
    assert rows.positions[1].tolist() == [0.5, -1, 2], 'minus one is a place where others are known'
    assert np.isnan(rows.positions[[0, 2]]).all()


def test_ground_truth_of_mot16_and_later_has_class_and_visible_share(tmp_path: Path):
    rows = read_mot(wrote(tmp_path / 'gt.txt', '1,1,5,6,7,8,1,1,0.75\n1,2,5,6,7,8,1,7,0.5\n'))
    assert rows.shares.tolist() == [0.75, 0.5]
    assert rows.scores.tolist() == [1, 0], 'somebody who is no pedestrian does not count'


@pytest.mark.parametrize(
    ('line', 'message'),
    [
        ('1,2,3', "line 2: '1,2,3' is no sighting: write frame,id,x,y,width,height,score"),
        ('1,a,3,4,5,6,1,-1,-1,-1', 'line 2: .* is no sighting'),
        ('1,2,nan,4,5,6,1,-1,-1,-1', 'line 2: .* not finite'),
        ('0,2,3,4,5,6,1,-1,-1,-1', 'line 2: frame 0: write whole numbers from 1'),
        ('1.5,2,3,4,5,6,1,-1,-1,-1', 'line 2: frame 1.5'),
        ('1e300,2,3,4,5,6,1,-1,-1,-1', 'line 2: frame 1e300: write whole numbers from 1 to 9007'),
        ('1,2.5,3,4,5,6,1,-1,-1,-1', 'line 2: id 2.5'),
        ('1,-1,3,4,5,6,1,-1,-1,-1', 'line 2: id -1: these are detections'),
        ('1,2,3,4,0,6,1,-1,-1,-1', 'line 2: a box of 0 x 6 pixels'),
        ('1,2,3,1e300,5,6,1,-1,-1,-1', 'line 2: .* the box is beyond 9007'),
        ('1,1,3,4,5,6,1,-1,-1,-1', 'line 2: id 1 is in frame 1 already, by line 1'),
        ('8,1,3,4,5,6,1,-1,-1,-1', 'line 2: frame 8, but the recording has 7 frames'),
        ('', 'line 2: .* is no sighting'),
    ],
)
def test_a_bad_line_is_named(line: str, message: str, tmp_path: Path):
    path = wrote(tmp_path / 'mot.txt', f'1,1,3,4,5,6,1,-1,-1,-1\n{line}\n2,1,3,4,5,6,1\n')
    with pytest.raises(RecordingError, match=f'mot.txt, {message}'):
        read_mot(path, 7)


def test_a_file_that_is_not_there_is_named(tmp_path: Path):
    with pytest.raises(RecordingError, match=r'mot\.txt does not exist'):
        read_mot(tmp_path / 'mot.txt')


def test_an_empty_file_is_a_tracker_that_never_said_anything(tmp_path: Path):
    rows = read_mot(wrote(tmp_path / 'mot.txt', ''))
    assert len(rows) == 0
    assert rows.boxes.shape == (0, 4)


def test_tracks_are_written_with_minus_one_where_something_is_unknown(tmp_path: Path):
    with MotWriter(tmp_path / 'out.txt') as writer:
        writer.write_tracks(0, {
            7: Track(Box(1.25, 2, 3, 4), TrackState.TRACKING, 0.9, 2.0, (0.1, -0.2, 2.0)),
            2: Track(Box(10, 20, 30, 40), TrackState.TRACKING, math.nan),
            3: Track(None, TrackState.OCCLUDED),
        })  # fmt: skip
        writer.write_tracks(1, {})
        writer.write_tracks(2, {7: Track(Box(1, 2, 3, 4), TrackState.TRACKING, 1.0)})
    assert (tmp_path / 'out.txt').read_text() == (
        '1,2,10,20,30,40,-1,-1,-1,-1\n1,7,1.25,2,3,4,0.9,0.1,-0.2,2\n3,7,1,2,3,4,1,-1,-1,-1\n'
    )


def test_a_box_that_is_nearly_nothing_is_written_so_that_it_can_be_read(tmp_path: Path):
    box = (3.0, 4.0, 1e-9, 20.0)
    with MotWriter(tmp_path / 'out.txt') as writer:
        writer.write_tracks(0, {7: Track(Box(*box), TrackState.TRACKING, 0.9)})
    (tmp_path / 'all.txt').write_text(mot_text(Sightings.of([0], [7], [box])))
    for name in ('out.txt', 'all.txt'):
        assert read_mot(tmp_path / name).boxes.tolist() == [list(box)]


def test_what_cannot_be_written_is_named(tmp_path: Path):
    (tmp_path / 'file').touch()
    with pytest.raises(RecordingError, match=r'file/out\.txt cannot be written'):
        MotWriter(tmp_path / 'file' / 'out.txt')


NUMBER = st.integers(-3000, 3000).map(lambda n: n / 8)
ROW = st.tuples(
    st.integers(0, 50), st.integers(0, 9), NUMBER, NUMBER,
    st.integers(1, 800).map(lambda n: n / 8), st.integers(1, 800).map(lambda n: n / 8),
)  # fmt: skip


@given(rows=st.lists(ROW, max_size=20, unique_by=lambda r: r[:2]))
def test_what_is_written_is_read_back(rows, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / 'round.txt'
    table = np.array(rows, np.float64).reshape(len(rows), 6)
    sightings = Sightings.of(table[:, 0], table[:, 1], table[:, 2:])
    path.write_text(mot_text(sightings))
    back = read_mot(path)
    for name in ('frames', 'ids', 'boxes', 'scores'):
        assert np.array_equal(getattr(back, name), getattr(sightings, name)), name
