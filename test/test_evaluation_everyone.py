# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Several people at once: the measures by hand and by brute force, the data, the command."""

from __future__ import annotations

import csv
import itertools
import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

import rgbd_kcf_tracker
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import DatasetError, RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, open_dataset
from rgbd_kcf_tracker.evaluation.everyone import follow
from rgbd_kcf_tracker.evaluation.metrics.everyone import ALPHAS, mean, overlaps, score
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings.mot import Sightings
from rgbd_kcf_tracker.recordings.textfiles import CAMERA_INFO, INTRINSICS
from rgbd_kcf_tracker.track import Track, TrackState

A, B, C = (0, 0, 10, 10), (100, 0, 10, 10), (200, 0, 10, 10)
A_HALF = (0, 0, 10, 5)
A_TENTH = (0, 9, 10, 10)  # IoU 10 / 190


def rows(*entries: tuple[int, int, tuple[float, ...]], scores=None) -> Sightings:
    """Sightings of ``(frame, id, box)``."""
    boxes = np.array([e[2] for e in entries], np.float64).reshape(len(entries), 4)
    return Sightings.of([e[0] for e in entries], [e[1] for e in entries], boxes, scores)


def walk(who: int, box, frames) -> list[tuple[int, int, tuple[float, ...]]]:
    return [(frame, who, box) for frame in frames]


def test_a_tracker_that_is_right_throughout():
    truth = rows(*walk(1, A, range(4)), *walk(2, B, range(2, 6)))
    result = score(truth, truth)
    assert (result.hota, result.idf1, result.mota, result.switches) == (1, 1, 1, 0)
    assert (result.strangers, result.recall, result.precision) == (0, 1, 1)
    assert (result.people, result.boxes) == (8, 8)


def test_misses_false_boxes_and_a_switch_by_hand():
    # A in frames 0 to 9. Id 1 is on A in 0 to 3, nobody in 4, id 2 in 5 to 9; id 3 on nobody in 0.
    truth = rows(*walk(1, A, range(10)))
    tracks = rows(*walk(1, A, range(4)), *walk(2, A, range(5, 10)), (0, 3, C))
    result = score(truth, tracks)
    assert (result.misses, result.false_boxes, result.switches) == (1, 1, 1)
    assert result.mota == pytest.approx(1 - 3 / 10)
    assert result.idf1 == pytest.approx(2 * 5 / (10 + 10)), 'id 2 stands for A: five boxes right'
    # Nine pairs: four with id 1, 4 / (10 + 4 - 4), five with id 2, 5 / (10 + 5 - 5).
    assert result.ass_a == pytest.approx((4 * 4 / 10 + 5 * 5 / 10) / 9)
    assert result.det_a == pytest.approx(9 / 11)
    assert result.hota == pytest.approx(math.sqrt(9 / 11 * 4.1 / 9))
    assert result.strangers == pytest.approx(1 / 10), 'the box on nobody'


def test_hota_is_the_mean_over_overlaps_and_the_others_are_at_one_half():
    truth, tracks = rows(*walk(1, A, range(3))), rows(*walk(5, A_HALF, range(3)))
    result = score(truth, tracks)
    assert result.mota == 1, 'an IoU of exactly one half is a hit'
    assert result.hota == pytest.approx(10 / 19), 'right at 0.05 to 0.50, nothing above'


def test_an_id_that_goes_over_to_somebody_else_is_on_a_stranger():
    # Id 1 is on A, then on B; id 2 is on B, then on A's place when A has left.
    truth = rows(*walk(1, A, range(4)), *walk(2, B, range(8)))
    tracks = rows(*walk(1, A, range(4)), *walk(1, B, range(4, 8)), *walk(2, B, range(4)))
    result = score(truth, tracks)
    assert result.strangers == pytest.approx(4 / 12)
    assert result.switches == 1


def test_of_boxes_that_are_sure_those_on_the_person_of_their_id_are_told():
    truth = rows(*walk(1, A, range(4)), *walk(2, B, range(8)))
    # Id 1 is on B from frame 4 on, and says in two of four frames that it is not sure.
    scores = [0.95] * 6 + [0.5] * 2 + [0.9] * 4
    entries = (*walk(1, A, range(4)), *walk(1, B, range(4, 8)), *walk(2, B, range(4)))
    result = score(truth, rows(*entries, scores=scores))
    assert result.sure == pytest.approx(8 / 10)
    assert result.strangers == pytest.approx(4 / 12)
    assert math.isnan(score(truth, rows(*entries, scores=[0.8] * 12)).sure)


def test_a_box_that_still_touches_its_person_is_on_nobody_else():
    truth = rows(*walk(1, A, range(3)))
    near, off = (0, 5, 10, 10), A_TENTH  # IoU 1/3 and 1/19
    assert score(truth, rows((0, 1, A), (1, 1, near), (2, 1, off))).strangers == pytest.approx(
        1 / 3
    )


def test_barely_visible_people_are_neither_hit_nor_miss():
    truth = rows(*walk(1, A, range(4)), *walk(2, B, range(4)), scores=[1, 1, 1, 1, 0, 0, 0, 0])
    silent = score(truth, rows(*walk(1, A, range(4))))
    told = score(truth, rows(*walk(1, A, range(4)), *walk(2, B, range(4))))
    assert silent == told
    assert (told.mota, told.people, told.boxes) == (1, 4, 4)


def test_somebody_who_counts_is_matched_before_a_box_is_left_out():
    # Two boxes on two people at one place: the one that counts must not lose its box.
    nearly = (0, 1, 10, 10)
    truth = rows((0, 1, A), (0, 2, nearly), scores=[1, 0])
    assert score(truth, rows((0, 7, nearly))).misses == 1, 'it is the box of the other'
    both = score(truth, rows((0, 7, nearly), (0, 8, A)))
    assert (both.misses, both.false_boxes) == (0, 0)


def test_in_a_region_nothing_is_judged():
    region = (90, 0, 100, 100)
    truth = rows((0, 1, A), (0, -1, region), (0, 2, C), scores=[1, 0, 1])
    inside, outside = (95, 50, 10, 10), (300, 50, 10, 10)
    result = score(truth, rows((0, 1, A), (0, 2, C), (0, 5, inside), (0, 6, outside)))
    assert (result.false_boxes, result.misses) == (1, 0)


def test_somebody_in_a_region_who_counts_is_still_found_or_missed():
    truth = rows((0, 1, A), (0, -1, (0, 0, 50, 50)), scores=[1, 0])
    assert score(truth, rows((0, 3, A))).mota == 1
    assert score(truth, rows()).misses == 1


def test_the_whole_body_is_as_good_as_what_shows_of_it():
    truth, body = rows(*walk(1, A_HALF, range(2))), np.array([A, (0, 0, 10, 20)], np.float64)
    tracks = rows(*walk(1, A, range(2)))
    assert score(truth, tracks).hota == pytest.approx(10 / 19)
    # The first is exact; the second, half of the body, is no hit above 0.5: 1 / 3 in nine of 19.
    assert score(truth, tracks, body).det_a == pytest.approx((10 + 9 / 3) / 19)
    nothing = np.full((2, 4), np.nan)
    assert score(truth, tracks, nothing) == score(truth, tracks)


def test_returns_need_the_id_from_before():
    seen = [*range(5), *range(10, 16)]  # away for five frames, back for six
    truth = rows(*walk(1, A, seen))
    same = rows(*walk(4, A, [0, 1, 12, 13, 14]))
    late = rows(*walk(4, A, [0, 1, 15]))
    other = rows(*walk(4, A, range(5)), *walk(5, A, range(10, 16)))
    assert score(truth, same).returns == 1, 'two frames to recognise, then three of four hit'
    assert score(truth, late).returns == 0
    assert score(truth, other).returns == 0
    assert math.isnan(score(rows(*walk(1, A, range(9))), same).returns), 'never away'
    short = rows(*walk(1, A, [*range(5), *range(10, 14)]))
    assert math.isnan(score(short, same).returns), 'back for four frames only'


def test_a_pair_stays_one_while_it_overlaps():
    # Id 2 comes nearer to A than id 1, which still overlaps by more than half: no switch.
    a_bit = (0, 2, 10, 10)  # IoU 80 / 120
    truth = rows(*walk(1, A, range(3)))
    tracks = rows((0, 1, A), (1, 1, a_bit), (1, 2, A), (2, 1, a_bit), (2, 2, A))
    assert score(truth, tracks).switches == 0
    # After a frame in which it was not a pair, the nearer one takes over.
    tracks = rows((0, 1, A), (2, 1, a_bit), (2, 2, A))
    assert score(truth, tracks).switches == 1


def test_nothing_said_and_nobody_there():
    truth = rows(*walk(1, A, range(3)))
    silent = score(truth, rows())
    assert (silent.hota, silent.idf1, silent.mota, silent.misses) == (0, 0, 0, 3)
    assert math.isnan(silent.strangers)
    empty = score(rows(), rows(*walk(1, A, range(3))))
    assert math.isnan(empty.mota)
    assert (empty.hota, empty.idf1, empty.false_boxes, empty.strangers) == (0, 0, 3, 1)
    nothing = score(rows(), rows())
    assert math.isnan(nothing.hota)
    assert math.isnan(nothing.idf1)


def test_mean_counts_each_recording_once():
    one, two = rows(*walk(1, A, range(2))), rows(*walk(1, A, range(8)))
    both = mean([score(one, one), score(two, rows())])
    assert both.mota == pytest.approx(0.5)
    assert math.isnan(mean([]).mota)


def crowd(seed: int) -> tuple[Sightings, Sightings]:
    """Up to three people and three ids about one place in four frames: all can be tried out."""
    rng = np.random.default_rng(seed)
    sides = []
    for _ in range(2):
        there = [(f, who) for f in range(4) for who in range(3) if rng.random() < 0.7]
        boxes = (tuple(rng.uniform((0, 0, 8, 8), (8, 8, 12, 12))) for _ in there)
        sides.append(rows(*((f, who, box) for (f, who), box in zip(there, boxes, strict=True))))
    return sides[0], sides[1]


def pairings(n: int, m: int):
    """All ways to pair some of ``n`` with some of ``m``."""
    for k in range(min(n, m) + 1):
        for left in itertools.combinations(range(n), k):
            for right in itertools.permutations(range(m), k):
                yield list(zip(left, right, strict=True))


@pytest.mark.parametrize('seed', range(20))
def test_idf1_is_the_best_of_all_ways_to_give_ids_to_people(seed: int):
    truth, tracks = crowd(seed)
    iou = overlaps(truth.boxes, tracks.boxes)
    iou[truth.frames[:, None] != tracks.frames[None]] = 0
    best = max(
        sum(
            int((iou[np.ix_(truth.ids == p, tracks.ids == t)] >= 0.5).any(axis=1).sum())
            for p, t in pairing
        )
        for pairing in pairings(3, 3)
    )
    assert score(truth, tracks).idf1 == pytest.approx(2 * best / (len(truth) + len(tracks)))


def hota_by_its_formulas(truth: Sightings, tracks: Sightings) -> float:
    """HOTA with loops, pairs found by trying all: Luiten et al. 2021, equations 8 to 12 and 22."""
    frames = range(4)
    iou = {
        (f, p, t): overlaps(truth.boxes[[i]], tracks.boxes[[j]])[0, 0]
        for i, (f, p) in enumerate(zip(truth.frames.tolist(), truth.ids.tolist(), strict=True))
        for j, (g, t) in enumerate(zip(tracks.frames.tolist(), tracks.ids.tolist(), strict=True))
        if f == g
    }
    of_p = {p: int((truth.ids == p).sum()) for p in range(3)}
    of_t = {t: int((tracks.ids == t).sum()) for t in range(3)}
    align = {}
    for p, t in itertools.product(range(3), range(3)):
        soft = 0.0
        for f in frames:
            own = iou.get((f, p, t), 0)
            if own:
                around = sum(v for (g, q, u), v in iou.items() if g == f and (q == p or u == t))
                soft += own / around
        align[p, t] = soft / (of_p[p] + of_t[t] - soft) if of_p[p] + of_t[t] else 0.0
    pairs = []
    for f in frames:
        best = max(
            pairings(3, 3),
            key=lambda pairing: sum(align[p, t] * iou.get((f, p, t), 0) for p, t in pairing),
        )
        pairs += [(p, t, iou[f, p, t]) for p, t in best if iou.get((f, p, t), 0) > 0]
    values = []
    for alpha in ALPHAS:
        hits = [(p, t) for p, t, v in pairs if v >= alpha - 1e-12]
        total = 0.0
        for p, t in hits:
            tpa = hits.count((p, t))
            total += tpa / (of_p[p] + of_t[t] - tpa)
        values.append(math.sqrt(total / (len(truth) + len(tracks) - len(hits))))
    return float(np.mean(values))


@pytest.mark.parametrize('seed', range(20))
def test_hota_is_what_its_formulas_say(seed: int):
    truth, tracks = crowd(seed)
    value = hota_by_its_formulas(truth, tracks)
    assert score(truth, tracks).hota == pytest.approx(value, abs=1e-9)
    assert value > 0


def test_mota_and_switches_agree_with_all_that_was_said_and_missed():
    for seed in range(20):
        truth, tracks = crowd(seed)
        result = score(truth, tracks)
        wrong = result.misses + result.false_boxes + result.switches
        assert result.mota == pytest.approx(1 - wrong / len(truth))
        assert len(truth) - result.misses == len(tracks) - result.false_boxes


# --- data sets


def images(folder: Path, count: int) -> None:
    folder.mkdir(parents=True)
    for number in range(1, count + 1):
        cv2.imwrite(str(folder / f'{number:06d}.png'), np.full((48, 64, 3), 10 * number, np.uint8))


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    """Two people for eight frames; in frame 3 the second is barely visible, in 5 to 6 away."""
    path = tmp_path / 'lab'
    images(path / 'rgb', 8)
    lines = [f'{frame},1,{frame},5,10,20,1,-1,-1,-1' for frame in range(1, 9)]
    lines += [
        f'{frame},7,{30 + frame},5,10,20,{int(frame != 3)},-1,-1,-1' for frame in (1, 2, 3, 4, 7, 8)
    ]
    write(path / 'mot.txt', '\n'.join(lines))
    return path


def opened(path: Path, **options):
    (sequence,) = open_dataset(str(path), DatasetOptions(everyone=True, **options))
    return sequence, list(sequence.open().samples)


def test_a_recording_with_mot_text(pair: Path):
    sequence, samples = opened(pair)
    assert (sequence.name, sequence.kind, len(samples)) == ('lab', 'everyone', 8)
    assert {pair / INTRINSICS, pair / CAMERA_INFO} <= set(sequence.content), 'they are read'
    assert [p.id for p in samples[0].people] == [1, 7]
    assert samples[1].people[1].box == Box(32, 5, 10, 20)
    assert [p.counts for p in samples[2].people] == [True, False]
    assert [len(s.people) for s in samples] == [2, 2, 2, 2, 1, 1, 2, 2]
    assert [s.number for s in samples] == list(range(8))


@pytest.mark.parametrize('name', ['mot.txt', 'seqinfo.ini'])
def test_a_file_that_was_not_fetched_is_not_passed_over(pair: Path, name: str):
    (pair / name).unlink(missing_ok=True)
    (pair / name).symlink_to(pair / 'elsewhere')
    with pytest.raises(RgbdKcfError, match=f'{name} leads to nothing'):
        opened(pair)


def test_a_depth_image_that_is_missing_makes_a_frame_without_as_for_one_target(pair: Path):
    (pair / 'depth').mkdir()
    for number in (1, 2, 4, 5, 6, 7, 8):
        cv2.imwrite(str(pair / 'depth' / f'{number:06d}.png'), np.full((48, 64), 2000, np.uint16))
    sequence, samples = opened(pair)
    assert [s.frame.depth is None for s in samples] == [n == 2 for n in range(8)]
    assert '1 of 8 colour images have no depth image' in sequence.open().warnings[0]


def test_a_file_for_each_person(tmp_path: Path):
    path = tmp_path / 'hall'
    images(path / 'rgb', 3)
    write(path / 'groundtruth_Ann.txt', '1,2,3,4\nnan,nan,nan,nan\n5,2,3,4\n')
    write(path / 'groundtruth_Ben.txt', '1,9,3,4\n2,9,3,4\n3,9,3,4\n')
    write(path / 'visible_Ben.txt', '0.9,1\n0.39,1\n0.40,1\n')
    _, samples = opened(path)
    assert [[p.id for p in s.people] for s in samples] == [[1, 2], [2], [1, 2]]
    assert [s.people[-1].counts for s in samples] == [True, False, True], 'below 0.4 no longer'
    write(path / 'visible_Ben.txt', '0.9,1\n0.39,1\n')
    with pytest.raises(DatasetError, match=r'visible_Ben\.txt, line 2'):
        opened(path)


def test_whole_bodies_lie_beside_either(pair: Path, tmp_path: Path):
    bodies = [Box(30 + n, 0, 12, 40) for n in range(8)]
    write(pair / 'body_7.txt', ''.join(f'{b.x},{b.y},{b.width},{b.height}\n' for b in bodies))
    sequence, samples = opened(pair)
    assert sequence.open().has_body
    assert [p.body for p in samples[1].people] == [None, bodies[1]]
    told = {1: samples[0].people[0].box, 7: bodies[0]}
    followed = follow(Fixed(told), samples[:1])
    assert followed.score().mota == 1, 'the whole body is as good'
    hall = tmp_path / 'hall'
    images(hall / 'rgb', 2)
    write(hall / 'groundtruth_3.txt', '1,2,3,4\n2,2,3,4\n')
    write(hall / 'groundtruth_12.txt', '1,9,3,4\n2,9,3,4\n')
    write(hall / 'body_12.txt', '1,9,3,8\nnan,nan,nan,nan\n')
    _, samples = opened(hall)
    assert {p.id: p.body for p in samples[0].people} == {3: None, 12: Box(1, 9, 3, 8)}
    write(hall / 'body_12.txt', '1,9,3,8\n')
    with pytest.raises(DatasetError, match=r'body_12\.txt, line 1'):
        opened(hall)


class Fixed:
    """Always says the same boxes."""

    everyone = False

    def __init__(self, boxes: dict[int, Box]) -> None:
        self.boxes = boxes

    def update(self, frame):
        return {who: Track(box, TrackState.TRACKING, 1.0) for who, box in self.boxes.items()}


def test_the_challenges_own_folders(tmp_path: Path):
    path = tmp_path / 'train' / 'MOT17-02'
    images(path / 'img1', 3)
    write(path / 'gt' / 'gt.txt', '1,1,5,6,7,8,1,1,0.2\n2,1,5,6,7,8,0,1,1\n2,4,5,6,7,8,1,3,1\n')
    write(path / 'seqinfo.ini', '[Sequence]\nname=MOT17-02\nframeRate=25\n')
    _, samples = opened(tmp_path, fps=5)
    assert [s.frame.stamp_ns for s in samples] == [0, 40_000_000, 80_000_000]
    assert [[p.counts for p in s.people] for s in samples] == [[True], [False, False], []]
    assert samples[0].people[0].share == 0.2
    write(path / 'seqinfo.ini', '[Sequence]\nframeRate=fast\n')
    with pytest.raises(DatasetError, match=r'seqinfo\.ini: no frameRate'):
        opened(tmp_path)


def test_what_is_wrong_with_a_recording_is_told(pair: Path, tmp_path: Path):
    (sequence,) = open_dataset(str(pair), DatasetOptions(everyone=True))
    write(pair / 'mot.txt', '9,1,1,1,1,1,1\n')
    with pytest.raises(rgbd_kcf_tracker.RgbdKcfError, match='line 1: frame 9, but the recording'):
        sequence.open()
    write(pair / 'mot.txt', '')
    with pytest.raises(DatasetError, match='nobody is ever in view'):
        sequence.open()
    images(tmp_path / 'bare' / 'rgb', 2)
    with pytest.raises(DatasetError, match='no recording in which people have ids'):
        opened(tmp_path / 'bare')


def test_each_person_of_mot_text_is_a_target_too(pair: Path):
    one, seven = open_dataset(str(pair), DatasetOptions())
    assert (one.name, seven.name) == ('lab/1', 'lab/7')
    samples = list(seven.open().samples)
    assert [s.visible is None for s in samples] == [False] * 4 + [True] * 2 + [False] * 2
    assert [s.judged for s in samples] == [True, True, False, True, True, True, True, True]
    write(pair / 'mot.txt', '1,1,1,1,1,1,1\n1,x\n')
    (broken,) = open_dataset(str(pair), DatasetOptions())
    with pytest.raises(DatasetError, match=r'mot\.txt, line 2'):
        broken.open()


# --- following everyone, and the report


class Fake:
    """Follows as :attr:`script` says: by frame, the box of each id."""

    script: dict[int, dict[int, tuple[float, ...] | None]]

    def __init__(self, variant, parameters=None) -> None:
        self.variant, self.everyone, self.count = variant, False, 0

    def update(self, frame):
        assert self.everyone, 'it is told to follow everyone before the first frame'
        answer = self.script.get(self.count, {})
        self.count += 1
        if isinstance(answer, Exception):
            raise answer
        return {
            who: Track(Box(*box), TrackState.TRACKING, 0.9, 2.0, (0.0, 0.5, 2.0))
            if box
            else Track(None, TrackState.OCCLUDED)
            for who, box in answer.items()
        }


@pytest.fixture
def fake(monkeypatch) -> type[Fake]:
    """Finds both of ``pair``, whenever they are there and count."""
    script = {
        f: {3: (f + 1, 5, 10, 20), 4: (f + 31, 5, 10, 20) if f in (0, 1, 3, 6, 7) else None}
        for f in range(8)
    }
    monkeypatch.setattr(rgbd_kcf_tracker, 'TargetSet', Fake, raising=False)
    monkeypatch.setattr(Fake, 'script', script, raising=False)
    return Fake


def test_follow_in_python(pair: Path, fake):
    (sequence,) = open_dataset(str(pair), DatasetOptions(everyone=True))
    followed = follow(fake('metric'), sequence.open().samples)
    assert followed.score().mota == 1
    assert followed.tracks.positions[0].tolist() == [0, 0.5, 2]
    assert len(followed.milliseconds) == 8


def table_of(report: Path, name: str) -> list[dict[str, str]]:
    with (report / 'tables' / f'{name}.csv').open() as file:
        return list(csv.DictReader(file))


def evaluate(*words: object) -> int:
    return main(['evaluate', *map(str, words), '--jobs', '1'])


def test_the_command_reports_everyone(pair: Path, tmp_path: Path, fake, capsys):
    del fake.script[5][3]
    report = tmp_path / 'report'
    assert evaluate(pair, '--everyone', '--report', report) == 0
    assert 'HOTA %' in capsys.readouterr().out
    (row,) = table_of(report, 'everyone')
    assert float(row['MOTA %']) == pytest.approx(100 * (1 - 1 / 13), abs=1e-3)
    assert (row['id switches'], row['misses'], row['people']) == ('0', '1', '13')
    assert row['returns %'] == '', 'nobody was back for five frames'
    tracks = (report / 'results/metric/everyone/lab.txt').read_text()
    assert tracks.startswith('1,3,1,5,10,20,0.9,0,0.5,2\n1,4,31,5,10,20,0.9,0,0.5,2\n')
    page = (report / 'index.html').read_text()
    assert 'Everyone: every recording' in page
    assert 'id="overview"' not in page
    numbers = json.loads((report / 'report.json').read_text())
    assert numbers['sequences']['lab']['kind'] == 'everyone'


def test_a_run_is_not_repeated_and_others_are_added(pair: Path, tmp_path: Path, fake):
    report = tmp_path / 'report'
    assert evaluate(pair, '--everyone', '--report', report) == 0
    fake.script.clear()  # would now say nothing
    own = (report / 'results/metric/everyone/lab.txt').read_text()
    write(tmp_path / 'other' / 'lab.txt', own.replace(',3,', ',30,'))
    words = ('--variants', 'metric', '--boxes', f'other={tmp_path / "other"}')
    assert evaluate(pair, '--everyone', *words, '--report', report) == 0
    first, second = table_of(report, 'everyone')
    assert (first['tracker'], second['tracker']) == ('metric', 'other')
    assert first['MOTA %'] == second['MOTA %'] == '100'


def test_a_run_whose_bodies_are_gone_is_made_again(pair: Path, tmp_path: Path, fake):
    write(pair / 'body_7.txt', '0,0,10,40\n' * 8)
    report = tmp_path / 'report'
    assert evaluate(pair, '--everyone', '--report', report) == 0
    (bodies,) = (report / 'truth' / 'everyone').glob('*.body.txt')
    bodies.unlink()
    assert evaluate(pair, '--everyone', '--report', report) == 0
    assert bodies.is_file()


def test_a_truth_that_was_edited_and_is_as_before_is_the_one_measured_against(
    pair: Path, tmp_path: Path, fake
):
    report, truth = tmp_path / 'report', (pair / 'mot.txt').read_text()
    assert evaluate(pair, '--everyone', '--report', report) == 0
    write(tmp_path / 'other' / 'lab.txt', (report / 'results/metric/everyone/lab.txt').read_text())
    write(pair / 'mot.txt', truth.splitlines()[0])
    words = ('--boxes', f'other={tmp_path / "other"}')
    assert evaluate(pair, '--everyone', *words, '--report', report) == 0
    write(pair / 'mot.txt', truth)
    assert evaluate(pair, '--everyone', '--report', report) == 0
    (row,) = table_of(report, 'everyone')
    assert (row['people'], row['MOTA %']) == ('13', '100')


def test_boxes_of_others_at_another_rate(pair: Path, tmp_path: Path):
    lines = (f'{f},1,{f},5,10,20,1,-1,-1,-1\n' for f in range(1, 9))
    write(tmp_path / 'other' / 'lab.txt', ''.join(lines))
    report = tmp_path / 'report'
    words = ('--fps', 10, '--rate', 5, '--boxes', f'other={tmp_path / "other"}')
    assert evaluate(pair, '--everyone', *words, '--report', report) == 0
    (row,) = table_of(report, 'everyone')
    assert (row['people'], row['misses'], row['false boxes']) == ('6', '2', '0')


def test_what_fails_is_listed_and_the_rest_measured(pair: Path, tmp_path: Path, fake, capsys):
    write(tmp_path / 'bad' / 'lab.txt', '1,1,0,0,0,0,1\n')
    fake.script[2] = DatasetError('the tracker is in trouble')
    report = tmp_path / 'report'
    words = ('--variants', 'metric', '--boxes', f'bad={tmp_path / "bad"}')
    assert evaluate(pair, '--everyone', *words, '--report', report) == 2
    error = capsys.readouterr().err
    assert 'nothing was measured: lab: frame 2: the tracker is in trouble' in error
    del fake.script[2]
    assert evaluate(pair, '--everyone', *words, '--report', report) == 1
    assert 'lab.txt, line 1: a box of 0 x 0 pixels' in (report / 'failures.txt').read_text()
    assert len(table_of(report, 'everyone')) == 1


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (['--short-term'], '--short-term means nothing with --everyone'),
        (['--export', 'vot'], '--export means nothing with --everyone'),
        (['--kind', 'otb'], '--kind means nothing with --everyone'),
        (['--variants', 'opencv:mil'], 'opencv:mil follows one target'),
    ],
)
def test_what_does_not_go_with_everyone(words, message, pair: Path, tmp_path: Path, fake, capsys):
    assert evaluate(pair, '--everyone', *words, '--report', tmp_path / 'report') == 2
    assert message in capsys.readouterr().err


def test_a_variant_that_cannot_follow_everyone_is_told_before_anything_is_run(
    pair: Path, tmp_path: Path, capsys
):
    words = ('--variants', 'metric,kcf', '--report', tmp_path / 'report')
    assert evaluate(pair, '--everyone', *words) == 2
    assert 'variant kcf follows chosen targets only' in capsys.readouterr().err
    assert not (tmp_path / 'report').exists()
