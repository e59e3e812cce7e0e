# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Runs over many sequences: parallel, interrupted, failing; and what they leave behind."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest
from onnx_files import average_pool

from rgbd_kcf_tracker.batch.workers import LocalPool
from rgbd_kcf_tracker.errors import DatasetError, ParameterError
from rgbd_kcf_tracker.evaluation import boxfiles, contenders, runner
from rgbd_kcf_tracker.evaluation.contenders import Contender, OpenCvTracker
from rgbd_kcf_tracker.evaluation.datasets import Opened, Sample, Sequence
from rgbd_kcf_tracker.evaluation.export import export
from rgbd_kcf_tracker.evaluation.jobs import (
    RunOptions,
    is_done,
    meta_path,
    run_key,
    thumbnails_path,
    tracks_path,
    truth_key,
    truth_path,
)
from rgbd_kcf_tracker.evaluation.metrics import vot
from rgbd_kcf_tracker.evaluation.passes import OnePass, Thumbnails, WithRestarts, read_thumbnails
from rgbd_kcf_tracker.evaluation.perframe import collect
from rgbd_kcf_tracker.evaluation.store import read_tracks, slug, was_made_as, write_tracks
from rgbd_kcf_tracker.evaluation.submissions import write_princeton, write_vot
from rgbd_kcf_tracker.evaluation.times import read_times, times_path, times_table
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.track import Track, TrackState

KCF = Contender('kcf', 'variant', 'kcf')


def textured(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return cv2.resize(rng.integers(0, 255, (12, 16, 3), np.uint8), (160, 120))


def moving_samples(count: int, seed: int, broken_at: int | None = None) -> Iterator[Sample]:
    """A patch that moves two pixels per frame over a textured wall."""
    wall, patch = textured(seed), textured(seed + 100)[:40, :30]
    for i in range(count):
        if i == broken_at:
            raise DatasetError(f'rgb/{i:06d}.png cannot be read: no such file')
        image = wall.copy()
        x = min(20 + 2 * i, 130)
        image[50:90, x : x + 30] = patch
        yield Sample(Frame(image, None, i * 33_000_000), Box(x, 50, 30, 40))


def load(count: int, seed: int, broken_at: int | None = None) -> Opened:
    return Opened(moving_samples(count, seed, broken_at), count)


def die() -> Opened:
    os._exit(9)


def sequence(name: str, count: int = 8, seed: int = 1, broken_at: int | None = None) -> Sequence:
    opener = partial(load, count, seed, broken_at)
    return Sequence(name, 'moving', 'folder', opener, f'{name}:{count}:{seed}:{broken_at}')


class Scripted:
    """Gives the tracks it was made with, one per call, and counts its starts."""

    def __init__(self, boxes):
        self.boxes = list(boxes)
        self.starts = []

    def start(self, frame, box):
        self.starts.append(box)
        return Track(box, TrackState.TRACKING, 1.0)

    def update(self, frame):
        box = self.boxes.pop(0)
        if isinstance(box, Exception):
            raise box
        return Track(box, TrackState.TRACKING if box else TrackState.OCCLUDED, 0.5)


def test_one_pass_starts_on_the_truth_and_then_only_updates():
    one = OnePass(Scripted([Box(1, 1, 5, 5), None]))
    for sample in moving_samples(3, 1):
        one.feed(sample)
    assert [t.box for t in one.tracks] == [Box(20, 50, 30, 40), Box(1, 1, 5, 5), None]
    assert len(one.milliseconds) == 3


def test_a_tracker_that_raises_is_stopped_and_named_with_its_frame():
    one = OnePass(Scripted([Box(1, 1, 5, 5), ZeroDivisionError('bang')]))
    for sample in moving_samples(5, 1):
        one.feed(sample)
    assert one.error.startswith('frame 2: ')
    assert 'bang' in one.error


def test_short_term_protocol_restarts_five_frames_after_a_failure():
    away = Box(130, 5, 10, 10)
    script = [Box(22, 50, 30, 40), away, Box(38, 50, 30, 40), away]
    one = WithRestarts(Scripted(script))
    for sample in moving_samples(10, 1):
        one.feed(sample)
    c = vot.Code
    assert one.codes == [c.START, c.TRACKED, c.FAILURE, *[c.SKIPPED] * 4, c.START, c.TRACKED,
                         c.FAILURE]  # fmt: skip
    assert one.tracker.starts == [Box(20, 50, 30, 40), Box(34, 50, 30, 40)]
    assert vot.failures(one.run()) == 2


def test_short_term_protocol_does_not_count_frames_without_the_target():
    samples = list(moving_samples(4, 1))
    samples[1] = Sample(samples[1].frame, None)
    one = WithRestarts(Scripted([None, Box(24, 50, 30, 40), None]))
    for sample in samples:
        one.feed(sample)
    run = one.run()
    assert run.codes.tolist() == [vot.Code.START, vot.Code.TRACKED, vot.Code.FAILURE]


def test_thumbnails_stay_few_and_evenly_spread():
    thumbnails = Thumbnails(most=5)
    for sample in moving_samples(60, 1):
        thumbnails.feed(sample)
    indices = sorted(thumbnails.pictures)
    assert 5 <= len(indices) <= 10
    assert indices[0] == 0
    assert len(set(np.diff(indices))) == 1


@pytest.mark.parametrize('shape', [(1, 1700), (1700, 1)])
def test_a_picture_of_any_shape_has_a_thumbnail(shape: tuple[int, int]):
    thumbnails = Thumbnails()
    thumbnails.feed(Sample(Frame(np.zeros((*shape, 3), np.uint8), None, 0), None))
    assert list(thumbnails.pictures) == [0]


def test_a_run_leaves_tracks_and_is_not_made_twice(tmp_path: Path):
    sequences, calls = [sequence('a'), sequence('b', seed=5)], []
    options = RunOptions()
    assert (
        runner.run(sequences, [KCF], tmp_path, options, lambda n, s, found: calls.append(n)) == []
    )
    assert sum(calls) == 2
    path = tracks_path(tmp_path, 'kcf', 'a')
    assert path.read_text().splitlines()[0] == (
        'frame,stamp_ns,x,y,width,height,state,score,depth_m'
    )
    assert len(read_tracks(path).boxes) == 8
    before = path.stat().st_mtime_ns
    calls.clear()
    runner.run(sequences, [KCF], tmp_path, options, lambda n, s, found: calls.append(n))
    assert sum(calls) == 2, 'what is done counts as progress'
    assert path.stat().st_mtime_ns == before
    runner.run(sequences, [KCF], tmp_path, RunOptions(fresh=True))
    assert path.stat().st_mtime_ns > before


@pytest.mark.parametrize(
    'change',
    [
        {'sequence': sequence('a', seed=9)},
        {'contender': Contender('kcf', 'variant', 'kcf', (('padding', '2.0'),))},
        {'options': RunOptions(use_depth=False)},
        {'options': RunOptions(rate_hz=5.0)},
        {'options': RunOptions(intrinsics=Intrinsics(500, 500, 80, 60))},
        {'options': RunOptions(code='another version')},
    ],
)
def test_a_run_is_made_again_when_anything_that_decides_it_changes(tmp_path: Path, change):
    runner.run([sequence('a')], [KCF], tmp_path, RunOptions())
    same = {'sequence': sequence('a'), 'contender': KCF, 'options': RunOptions()}
    assert is_done(tmp_path, **same)
    assert not is_done(tmp_path, **{**same, **change})


def test_pictures_of_another_rate_do_not_stay(tmp_path: Path):
    for count, kept in ((8, 8), (3, 3)):
        one = sequence('a', count)
        runner.run([one], [KCF], tmp_path, RunOptions())
        path = thumbnails_path(tmp_path, 'a', truth_key(one, RunOptions()))
        assert len(read_thumbnails(path)) == kept


def test_a_run_is_made_again_when_a_file_that_its_parameters_name_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    Path('one.onnx').write_bytes(average_pool(cell=64))

    def key(path: str) -> str:
        given = contenders.variant('metric', {'embedding': path})
        assert dict(given.overrides)['embedding'] == os.path.abspath(path), 'runs go on elsewhere'
        assert given.name == f'metric embedding={path}'
        return run_key(sequence('a'), given, RunOptions())

    before = key('one.onnx')
    assert key('./one.onnx') == before
    Path('one.onnx').write_bytes(average_pool(cell=32))
    assert key('one.onnx') != before


def test_runs_of_one_name_in_one_folder_are_each_held_against_their_own_truth(tmp_path: Path):
    seen = {}
    wide = Contender('wide', 'variant', 'kcf', (('padding', '2.0'),))
    for tracker, count in ((KCF, 8), (wide, 6), (KCF, 8), (wide, 6)):
        one, options = sequence('a', count), RunOptions()
        if (tracker, count) in seen:
            assert is_done(tmp_path, one, tracker, options)
        runner.run([one], [tracker], tmp_path, options)
        (found,) = collect(tmp_path, [one], [tracker], options).results
        assert len(found.frames) == count
        assert seen.setdefault((tracker, count), found.measures()) == found.measures()


def test_a_run_that_was_cut_off_is_made_again(tmp_path: Path):
    runner.run([sequence('a')], [KCF], tmp_path, RunOptions())
    meta_path(tracks_path(tmp_path, 'kcf', 'a')).write_text('{"key": ')
    assert not is_done(tmp_path, sequence('a'), KCF, RunOptions())


def test_what_a_run_left_and_is_damaged_is_named_with_what_mends_it(tmp_path: Path):
    moving, options = sequence('moving'), RunOptions()
    runner.run([moving], [KCF], tmp_path, options)
    truth = truth_path(tmp_path, 'moving', truth_key(moving, options))
    tracks = tracks_path(tmp_path, 'kcf', 'moving')
    times = times_path(tmp_path, 'kcf', 'moving')

    def read() -> None:
        collect(tmp_path, [moving], [KCF], options)
        times_table(tmp_path, [('kcf', 'moving')])

    def error(path: Path, data: bytes) -> str:
        before = path.read_bytes()
        path.write_bytes(data)
        with pytest.raises(DatasetError) as raised:
            read()
        path.write_bytes(before)
        assert str(raised.value).startswith(f'{path}'), raised.value
        assert str(raised.value).endswith(': delete the file and run again')
        return str(raised.value)

    for path in (truth, tracks):
        lines = path.read_bytes().splitlines(keepends=True)
        assert 'was cut off' in error(path, b''.join(lines[:5]))
        assert 'a cell is no number' in error(path, b''.join(lines[:5]) + b'4,x,x,x')
    lines = truth.read_bytes().splitlines(keepends=True)
    error(truth, b''.join(lines[:-1]) + b'7')
    assert 'is no JSON' in error(times, b'{"milli')
    assert len(collect(tmp_path, [moving], [KCF], options).results) == 1


def test_a_failing_sequence_does_not_end_the_run(tmp_path: Path):
    sequences = [sequence('good'), sequence('bad', broken_at=3), sequence('last')]
    (failure,) = runner.run(sequences, [KCF], tmp_path, RunOptions())
    assert (failure.sequence, failure.tracker) == ('bad', '')
    assert 'rgb/000003.png cannot be read' in failure.reason
    assert is_done(tmp_path, sequences[2], KCF, RunOptions())
    assert not is_done(tmp_path, sequences[1], KCF, RunOptions())


def test_parallel_runs_give_the_same_and_survive_a_dying_process(tmp_path: Path):
    dying = Sequence('dying', 'moving', 'folder', die, 'dying')
    sequences = [sequence('a'), dying, sequence('b', seed=5), sequence('bad', broken_at=0)]
    with LocalPool(2) as pool:
        failures = runner.run(sequences, [KCF], tmp_path / 'two', RunOptions(), workers=pool)
    assert sorted(f.sequence for f in failures) == ['bad', 'dying']
    assert 'worker died' in next(f.reason for f in failures if f.sequence == 'dying')
    runner.run([sequences[0], sequences[2]], [KCF], tmp_path / 'one', RunOptions())
    for name in ('a', 'b'):
        texts = [tracks_path(tmp_path / k, 'kcf', name).read_text() for k in ('one', 'two')]
        assert texts[0] == texts[1]


def test_names_become_file_names():
    assert slug('filinha/A_bald') == 'filinha_A_bald'
    assert slug('metric without color') == 'metric_without_color'
    assert slug('../..') == '_'
    assert slug('a _/b\udcff') == 'a_b'
    assert (slug('日本/5'), slug('中国'), slug('Zoë')) == ('日本_5', '中国', 'Zoë')
    assert slug('हि') != slug('हु'), 'vowels are marks'


# --- boxes in files


def opened(count: int, start: int = 0, total: int | None = None) -> Opened:
    return Opened((), count, start, total)


def named(kind: str = 'folder', origin: int = 0) -> Sequence:
    return Sequence('room/ann', 's', kind, die, 'x', origin=origin)


def boxes_of(path: Path, seq: Sequence, frames: int, **place) -> list[Box | None]:
    start = place.get('start', 0)
    numbers = range(start, start + frames)
    return [t.box for t in boxfiles.read(path, seq, opened(frames, **place), numbers)]


def test_plain_boxes_with_scores_and_absences(tmp_path: Path):
    path = tmp_path / 'boxes.txt'
    path.write_text('1,2,3,4,0.9\nnan,nan,nan,nan,nan\n0 0 0 0\n5\t6\t7\t8\n')
    tracks = boxfiles.read(path, named(), opened(4), range(4))
    assert [t.box for t in tracks] == [Box(1, 2, 3, 4), None, None, Box(5, 6, 7, 8)]
    assert tracks[0].score == 0.9
    path.write_text('1,2,3,4,nan\n')
    assert boxfiles.read(path, named(), opened(1), range(1))[0].score == 1, 'as one without'


def test_boxes_of_otb_results_are_1_based(tmp_path: Path):
    path = tmp_path / 'boxes.txt'
    path.write_text('1,1,10,20\n2.5,3,10,20,0.4\n')
    assert boxes_of(path, named('otb', 1), 2) == [Box(0, 0, 10, 20), Box(1.5, 2, 10, 20)]


def test_boxes_of_princeton_results_are_corners(tmp_path: Path):
    path = tmp_path / 'boxes.txt'
    path.write_text('10,20,40,60,0\nNaN,NaN,NaN,NaN,1\n')
    assert boxes_of(path, named('princeton'), 2) == [Box(10, 20, 30, 40), None]


def test_boxes_of_vot_results_have_codes_and_scores_beside(tmp_path: Path):
    folder = tmp_path / 'room_ann'
    folder.mkdir()
    path = folder / 'room_ann_001.txt'
    path.write_text('1\n5,6,7,8\n0\n')
    (folder / 'room_ann_001_confidence.value').write_text('\n0.25\n0\n')
    assert boxfiles.find_file(str(tmp_path), named()) == path
    tracks = boxfiles.read(path, named('vot'), opened(3), range(3))
    assert [t.box for t in tracks] == [None, Box(5, 6, 7, 8), None]
    assert tracks[1].score == 0.25
    (folder / 'room_ann_001_confidence.value').write_text('1\n')
    with pytest.raises(DatasetError, match=r'confidence.value, line 2: 1 scores for the 3 lines'):
        boxfiles.read(path, named('vot'), opened(3), range(3))


def test_our_own_csv_is_read_back(tmp_path: Path):
    path = tmp_path / 'tracks.csv'
    tracks = [
        Track(Box(1.5, 2, 3, 4), TrackState.TRACKING, 0.75, 1.25),
        Track(None, TrackState.OCCLUDED),
    ]
    write_tracks(path, [10, 20], tracks)
    assert boxes_of(path, named(), 2) == [Box(1.5, 2, 3, 4), None]
    assert read_tracks(path).states == ('tracking', 'occluded')


def test_boxes_of_the_whole_recording_are_cut_to_the_frames_measured(tmp_path: Path):
    path = tmp_path / 'boxes.txt'
    path.write_text(''.join(f'{i},0,5,5\n' for i in range(10)))
    assert boxes_of(path, named(), 3, start=4, total=10) == [Box(i, 0, 5, 5) for i in (4, 5, 6)]


def test_boxes_of_the_whole_recording_are_those_of_the_frames_measured_at_a_rate(tmp_path: Path):
    path = tmp_path / 'boxes.txt'
    path.write_text(''.join(f'{i},0,5,5\n' for i in range(10)))
    tracks = boxfiles.read(path, named(), opened(10), (0, 3, 6, 9))
    assert [t.box for t in tracks] == [Box(i, 0, 5, 5) for i in (0, 3, 6, 9)]


def test_samples_have_the_numbers_of_their_frames():
    samples = list(moving_samples(4, 1))
    assert [s.number for s in Opened(samples, 4, 7).samples] == [7, 8, 9, 10]


def test_what_lies_beside_a_result_and_is_damaged_vouches_for_nothing(tmp_path: Path):
    path = tmp_path / 'a.json'
    assert not was_made_as(path, 'k')
    for text in ('[]', '{', '{"key": "other"}', '[' * 100_000):
        path.write_text(text)
        assert not was_made_as(path, 'k')
    path.write_text('{"key": "k"}')
    assert was_made_as(path, 'k')


def test_a_cell_that_is_no_number_of_any_kind_is_an_error_of_the_file(tmp_path: Path):
    path = tmp_path / 'tracks.csv'
    write_tracks(path, [10], [Track(Box(1, 2, 3, 4), TrackState.TRACKING)])
    path.write_text(path.read_text() + '1' * 200_000 + '\n')
    with pytest.raises(DatasetError, match=r'tracks.csv is no CSV'):
        read_tracks(path)


@pytest.mark.parametrize(('rows', 'line'), [(2, 3), (5, 4)])
def test_a_result_file_with_the_wrong_number_of_rows_is_named(tmp_path: Path, rows, line):
    path = tmp_path / 'boxes.txt'
    path.write_text('1,2,3,4\n' * rows)
    with pytest.raises(DatasetError) as caught:
        boxfiles.read(path, named(), opened(3), range(3))
    assert f'{path}, line {line}: {rows} boxes for room/ann, which has 3 frames' in str(
        caught.value
    )


def test_a_result_line_that_is_no_box_is_named(tmp_path: Path):
    path = tmp_path / 'boxes.txt'
    path.write_text('1,2,3,4\n1,2,3\n')
    with pytest.raises(DatasetError, match=r'boxes.txt, line 2'):
        boxfiles.read(path, named(), opened(2), range(2))


def test_missing_result_files_are_named_with_what_was_tried(tmp_path: Path):
    tried = r'no boxes for room/ann: tried .*room/ann/kcf.txt.* a path with {sequence} in it'
    with pytest.raises(DatasetError, match=tried):
        boxfiles.find_file(str(tmp_path / '{sequence}' / 'kcf.txt'), named())


def test_boxes_in_files_are_measured_like_trackers(tmp_path: Path):
    (tmp_path / 'good.txt').write_text(''.join(f'{20 + 2 * i},50,30,40\n' for i in range(8)))
    (tmp_path / 'short.txt').write_text('20,50,30,40\n' * 7)
    peer = contenders.boxes(f'peer={tmp_path}')
    failures = runner.run([sequence('good'), sequence('short')], [peer], tmp_path, RunOptions())
    assert [(f.sequence, f.tracker) for f in failures] == [('short', 'peer')]
    assert 'short.txt, line 8: 7 boxes' in failures[0].reason
    assert read_tracks(tracks_path(tmp_path, 'peer', 'good')).boxes[7].tolist() == [34, 50, 30, 40]


# --- submissions


def test_princeton_submission(tmp_path: Path):
    path = tmp_path / 'bear.txt'
    write_princeton(path, np.array([[10, 20, 30, 40], [np.nan] * 4]))
    assert path.read_text() == '10.000,20.000,40.000,60.000,0\nNaN,NaN,NaN,NaN,1\n'
    assert boxes_of(path, named('princeton'), 2) == [Box(10, 20, 30, 40), None]


def test_vot_submission(tmp_path: Path):
    boxes = np.array([[1, 2, 3, 4], [5, 6, 7, 8], [np.nan] * 4])
    write_vot(tmp_path, 'cup', boxes, np.array([1, 0.5, np.nan]), [10, 20, 30])
    place = tmp_path / 'cup'
    assert (place / 'cup_001.txt').read_text() == '1\n5.000,6.000,7.000,8.000\n0\n'
    assert (place / 'cup_001_confidence.value').read_text() == '1.000000\n0.500000\n0.000000\n'
    assert (place / 'cup_001_time.value').read_text() == '0.010000\n0.020000\n0.030000\n'
    write_vot(tmp_path, 'cup', boxes, np.ones(3), [1, 1, 1], codes=[1, 2, 0])
    assert (place / 'cup_001.txt').read_text() == '1\n2\n0\n'


def test_export_of_a_run(tmp_path: Path):
    seq, options = sequence('a'), RunOptions(short_term=True)
    runner.run([seq], [KCF], tmp_path, options)
    for form in ('princeton', 'vot'):
        export(tmp_path, [seq], [KCF], options, form)
    place = tmp_path / 'submission'
    assert len((place / 'princeton' / 'kcf' / 'a.txt').read_text().splitlines()) == 8
    for protocol in ('longterm', 'baseline'):
        lines = (place / 'vot' / 'kcf' / protocol / 'a' / 'a_001.txt').read_text().splitlines()
        assert lines[0] == '1'
        assert len(lines) == 8


# --- who can be measured


def test_opencv_trackers_that_are_missing_say_what_to_install(monkeypatch: pytest.MonkeyPatch):
    for name in ('TrackerKCF', 'TrackerKCF_create'):
        monkeypatch.delattr(cv2, name, raising=False)
    monkeypatch.delattr(cv2, 'legacy', raising=False)
    with pytest.raises(ParameterError, match='install opencv-contrib-python-headless'):
        contenders.variant('opencv:kcf')
    with pytest.raises(ParameterError, match='unknown OpenCV tracker'):
        contenders.variant('opencv:siamese')


@pytest.mark.parametrize('name', ['kcf', 'csrt', 'mil'])
def test_opencv_trackers_follow_a_moving_patch(name: str):
    try:
        tracker = OpenCvTracker(name)
    except ParameterError as error:
        pytest.skip(str(error))
    assert tracker.update(Frame(textured(1))).state is TrackState.IDLE
    one = OnePass(tracker)
    for sample in moving_samples(6, 1):
        one.feed(sample)
    assert one.error == ''
    assert one.tracks[-1].box.iou(Box(30, 50, 30, 40)) > 0.5


def test_opencv_tracker_that_lost_the_target_gives_no_box():
    class Lost:
        def init(self, image, box):
            pass

        def update(self, image):
            return False, (0, 0, 0, 0)

    tracker = OpenCvTracker.__new__(OpenCvTracker)
    tracker._factory, tracker._tracker = Lost, None
    tracker.start(Frame(textured(1)), Box(10, 10, 20, 20))
    track = tracker.update(Frame(textured(1)))
    assert (track.box, track.state) == (None, TrackState.OCCLUDED)


def test_contenders_have_names_of_their_own():
    assert contenders.variant('kcf', {'padding': '2.0'}).name == 'kcf padding=2.0'
    with pytest.raises(ParameterError, match='unknown variant'):
        contenders.variant('deep')
    with pytest.raises(ParameterError, match='give NAME=FOLDER'):
        contenders.boxes('peer')
    with pytest.raises(ParameterError, match="two trackers are named 'a' and 'a'"):
        contenders.unique([Contender('a', 'boxes', 'x'), Contender('a', 'boxes', 'y')])
    assert contenders.unique([KCF, KCF]) == [KCF]


def test_meta_tells_of_the_run(tmp_path: Path):
    runner.run([sequence('a')], [KCF], tmp_path, RunOptions())
    meta = json.loads(meta_path(tracks_path(tmp_path, 'kcf', 'a')).read_text())
    assert meta['image_size'] == [160, 120]
    assert len(read_times(tmp_path, 'kcf', 'a')) == 8
