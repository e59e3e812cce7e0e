# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Every measure against an example worked out by hand."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.metrics import (
    compare,
    confusion,
    mean,
    measure_boxes,
    otb,
    presence,
    princeton,
)
from rgbd_kcf_tracker.evaluation.metrics.boxes import (
    as_array,
    center_error,
    center_offset,
    iou,
    present,
)
from rgbd_kcf_tracker.geometry import Box

TRUTH = Box(10, 10, 20, 20)
HALF = Box(10, 10, 20, 10)  # covers the upper half: IoU 1/2
THIRD = Box(20, 10, 20, 20)  # shifted by half: 200 / 600
AWAY = Box(100, 100, 20, 20)


def test_boxes_become_rows_and_none_becomes_nan():
    rows = as_array([TRUTH, None])
    assert rows[0].tolist() == [10, 10, 20, 20]
    assert np.isnan(rows[1]).all()
    assert present([TRUTH, None]).tolist() == [True, False]


def test_rows_without_size_or_not_finite_are_no_box():
    rows = np.array(
        [[0, 0, 0, 0], [1, 1, -3, 4], [1, 1, np.nan, 4], [1, 1, np.inf, 4], [1, 2, 3, 4]]
    )
    assert present(rows).tolist() == [False, False, False, False, True]
    assert rows[0].tolist() == [0, 0, 0, 0], 'the caller keeps his array'


def test_boxes_of_another_shape_are_refused():
    with pytest.raises(DatasetError, match=r'\(3, 5\)'):
        as_array(np.zeros((3, 5)))


def test_iou_by_hand():
    values = iou([TRUTH, HALF, THIRD, AWAY, None], [TRUTH] * 5)
    assert values[:4] == pytest.approx([1, 1 / 2, 1 / 3, 0])
    assert math.isnan(values[4])


@given(*[st.tuples(*[st.floats(-50, 50)] * 2, *[st.floats(0.5, 60)] * 2)] * 2)
def test_iou_agrees_with_the_box_type(a, b):
    one, two = Box(*a), Box(*b)
    assert iou([one], [two])[0] == pytest.approx(one.iou(two), abs=1e-9)


def test_different_numbers_of_frames_are_refused():
    with pytest.raises(DatasetError, match='2 predicted boxes against 1'):
        iou([TRUTH, TRUTH], [TRUTH])


def test_center_error_and_its_parts_are_prediction_minus_truth():
    moved = TRUTH.moved(-3, 4)
    assert center_offset([moved, None], [TRUTH, TRUTH])[0].tolist() == [-3, 4]
    errors = center_error([moved, None], [TRUTH, TRUTH])
    assert errors[0] == 5
    assert math.isnan(errors[1])


def test_princeton_ratio_rewards_absence_told_truly_and_punishes_the_rest():
    c = compare([THIRD, None, None, TRUTH], [TRUTH, None, TRUTH, None], skip=0)
    assert c.ratio == pytest.approx([1 / 3, 1, -1, -1])


def test_princeton_success_is_strictly_above_the_threshold():
    ratios = np.array([0.5, 0.51, 1.0, -1.0])
    assert princeton.success_rate(ratios, 0.5) == 0.5
    assert math.isnan(princeton.success_rate(np.zeros(0)))


def test_princeton_curve_over_all_thresholds():
    ratios = np.array([1.0, 0.52, 0.0, -1.0])
    curve = princeton.success_curve(ratios)
    # above 0: two frames; from 0.55 on: one; above 1: none
    assert curve[:11].tolist() == [0.5] * 11
    assert curve[11:20].tolist() == [0.25] * 9
    assert curve[20] == 0


SPLITS = ('target type', 'target size', 'movement', 'occlusion', 'motion type')


@pytest.fixture
def two_sequences():
    a = dict(zip(SPLITS, ('human', 'large', 'slow', 'yes', 'active'), strict=True))
    b = dict(zip(SPLITS, ('rigid', 'large', 'fast', 'no', 'active'), strict=True))
    return {'a': a, 'b': b}


def test_eleven_categories(two_sequences):
    assert sum(len(names) for names in princeton.CATEGORIES.values()) == 11
    table = princeton.by_category({'a': 0.2, 'b': 0.6}, two_sequences)
    assert table['target type'] == {'human': 0.2, 'animal': pytest.approx(math.nan, nan_ok=True),
                                    'rigid': 0.6}  # fmt: skip
    assert table['target size']['large'] == pytest.approx(0.4)
    assert table['occlusion'] == {'yes': 0.2, 'no': 0.6}
    assert table['all']['all'] == pytest.approx(0.4)


@given(st.lists(st.tuples(st.floats(0, 1), *[st.integers(0, 2)] * 5), min_size=1, max_size=20))
def test_every_split_agrees_with_the_overall(rows):
    """The thesis's own row fails this: its splits give overall rates from 40.6 to 48.7."""
    names = list(princeton.CATEGORIES.values())
    rates, categories = {}, {}
    for i, (rate, *kinds) in enumerate(rows):
        rates[str(i)] = rate
        categories[str(i)] = {
            split: names[s][kind % len(names[s])]
            for s, (split, kind) in enumerate(zip(SPLITS, kinds, strict=True))
        }
    table = princeton.by_category(rates, categories)
    for split in SPLITS:
        weighted = sum(
            value * sum(categories[s][split] == name for s in rates)
            for name, value in table[split].items()
            if not math.isnan(value)
        )
        assert weighted / len(rates) == pytest.approx(table['all']['all'])


def test_a_sequence_without_its_category_is_named(two_sequences):
    two_sequences['b']['movement'] = 'quick'
    with pytest.raises(DatasetError, match=r"sequence b: movement is 'quick': give one of slow"):
        princeton.by_category({'a': 0.2, 'b': 0.6}, two_sequences)


def test_otb_success_counts_above_and_precision_counts_up_to():
    success = otb.success_curve(np.array([0.5, 1.0, 0.0, np.nan]))
    assert success[0] == 0.5, 'an overlap of 0 is not above 0'
    assert success[9] == 0.5
    assert success[10] == 0.25, '0.5 is not above 0.5'
    assert success[20] == 0, 'nothing is above 1'
    assert len(success) == 21
    assert otb.area_under_curve(success) == pytest.approx((10 * 0.5 + 10 * 0.25) / 21)

    precision = otb.precision_curve(np.array([0.0, 20.0, 20.5, np.nan]))
    assert len(precision) == 51
    assert precision[0] == 0.25
    assert precision[19] == 0.25
    assert precision[20] == 0.5, '20 is within 20'
    assert precision[50] == 0.75
    assert otb.precision_at_20(precision) == 0.5


def test_otb_curves_without_frames_have_no_value():
    assert np.isnan(otb.success_curve(np.zeros(0))).all()
    assert np.isnan(otb.precision_curve(np.zeros(0))).all()


@pytest.mark.parametrize('sequence', ['Basketball', 'Couple', 'Crossing', 'Football1'])
def test_published_otb_values_come_out(shared_data: Path, sequence: str):
    """Precision and AUC of published boxes; the benchmark counts the first frame too."""
    folder = shared_data / 'otb' / sequence
    truth = np.loadtxt(folder / 'groundtruth.txt', delimiter=',')
    published = {
        row['tracker']: row
        for row in csv.DictReader((shared_data / 'otb-results-summary.csv').open())
        if row['sequence'] == sequence.lower()
    }
    checked = 0
    for path in sorted((folder / 'results').glob('*.txt')):
        boxes = np.loadtxt(path, delimiter=',')
        precision = otb.precision_at_20(otb.precision_curve(center_error(boxes, truth)))
        auc = otb.area_under_curve(otb.success_curve(iou(boxes, truth)))
        row = published[path.stem]
        assert precision == pytest.approx(float(row['precision20']), abs=0.002), path.stem
        assert auc == pytest.approx(float(row['success_auc21']), abs=0.002), path.stem
        checked += 1
    assert checked >= 10


# Ten frames: 4 hits, 1 box beside the target, 1 box on an absent target, 3 absences told, 1 missed.
SAID = [TRUTH, TRUTH, HALF, TRUTH, AWAY, AWAY, None, None, None, None]
THERE = [TRUTH, TRUTH, TRUTH, TRUTH, TRUTH, None, None, None, None, TRUTH]


def test_counts():
    assert confusion.count(SAID, THERE) == confusion.Counts(tp=4, fp=2, tn=3, fn=1)
    assert confusion.count(SAID, THERE).total == 10


def test_a_hit_is_an_overlap_of_at_least_half():
    assert confusion.count([HALF], [TRUTH]).tp == 1
    assert confusion.count([THIRD], [TRUTH]).fp == 1


def test_confusion_by_method_1_is_over_all_frames():
    matrix = confusion.confusion_by_total(confusion.count(SAID, THERE))
    assert matrix == confusion.Confusion(tp=0.4, fp=0.2, tn=0.3, fn=0.1)


def test_confusion_by_method_2_is_over_what_was_said():
    matrix = confusion.confusion_by_prediction(confusion.count(SAID, THERE))
    assert matrix == confusion.Confusion(tp=4 / 6, fp=2 / 6, tn=3 / 4, fn=1 / 4)


def test_thesis_table_4_4():
    """Twenty absences, all told, of 100 and of 200 frames: 20 % and 10 %, but 100 % by method 2."""
    for frames, share in ((100, 0.2), (200, 0.1)):
        counts = confusion.Counts(tp=frames - 20, tn=20)
        assert confusion.confusion_by_total(counts).tn == pytest.approx(share)
        assert confusion.confusion_by_prediction(counts).tn == 1.0


def test_a_tracker_that_never_says_absent_has_no_tn_and_fn():
    counts = confusion.count([TRUTH, AWAY, AWAY], [TRUTH, TRUTH, None])
    assert confusion.confusion_by_total(counts) == confusion.Confusion(1 / 3, 2 / 3, None, None)
    assert confusion.confusion_by_prediction(counts) == confusion.Confusion(
        1 / 3, 2 / 3, None, None
    )


def test_a_tracker_that_never_gives_a_box_has_no_tp_and_fp():
    counts = confusion.count([None, None], [TRUTH, None])
    assert confusion.confusion_by_prediction(counts) == confusion.Confusion(None, None, 0.5, 0.5)
    assert math.isnan(confusion.precision(counts))
    assert confusion.confusion_by_total(confusion.Counts()).tp is None


def test_average_precision():
    scenes = [confusion.Counts(tp=3, fp=1), confusion.Counts(tp=100), confusion.Counts(tn=5)]
    assert confusion.average_precision(scenes) == pytest.approx((0.75 + 1) / 2)
    assert math.isnan(confusion.average_precision([]))


def test_the_first_frame_is_never_counted():
    assert len(compare(SAID, THERE)) == 9
    assert measure_boxes([TRUTH, AWAY], [TRUTH, TRUTH]).success == 0


def test_all_measures_of_one_sequence_by_hand():
    said = [TRUTH, TRUTH.moved(3, -4), HALF, AWAY, None, None, AWAY]
    there = [TRUTH, TRUTH, TRUTH, TRUTH, TRUTH, None, None]
    m = measure_boxes(said, there)
    shifted = (17 * 16) / (800 - 17 * 16)  # 0.515
    assert m.iou == pytest.approx((shifted + 0.5 + 0 + 0) / 4)
    # r = 0.515, 0.5, 0, -1, 1, -1: above 0.5 are the first and the fifth
    assert m.success == pytest.approx(2 / 6)
    assert m.recall_of_absence == 0.5
    assert (m.tp, m.fp) == pytest.approx((2 / 4, 2 / 4))
    assert (m.tn, m.fn) == pytest.approx((1 / 2, 1 / 2))
    assert m.precision == pytest.approx(0.5)
    assert m.precision_20px == pytest.approx(2 / 4)
    far = math.hypot(90, 90)
    assert m.center_error == pytest.approx((5 + 5 + far) / 3)
    assert m.center_error_x == pytest.approx((3 + 0 + 90) / 3)
    assert m.center_error_y == pytest.approx((4 + 5 + 90) / 3)
    # IoU curve: 3 boxes on a visible target and one miss; 0.515 > 0..0.5, 0.5 > 0..0.45
    assert m.otb_auc == pytest.approx((11 + 10) / 4 / 21)
    # R curve: the frame told absent passes all but 1.0
    assert m.success_auc == pytest.approx((11 + 10 + 20) / 6 / 21)


def test_a_body_box_counts_where_it_fits_better_but_never_makes_the_target_present():
    body = Box(10, 10, 20, 40)
    visible = Box(10, 10, 20, 10)
    c = compare([body, visible, body], [visible, visible, None], body=[body, body, body], skip=0)
    assert c.overlap[:2].tolist() == [1, 1]
    assert c.error[:2].tolist() == [0, 0]
    assert c.ratio.tolist() == [1, 1, -1]


def test_mean_is_over_sequences_and_skips_what_a_sequence_does_not_have():
    short = measure_boxes([TRUTH, TRUTH], [TRUTH, TRUTH])
    long = measure_boxes([TRUTH] + [AWAY] * 100 + [None], [TRUTH] * 101 + [None])
    both = mean([short, long])
    assert both.iou == pytest.approx((1 + 0) / 2)
    assert math.isnan(short.recall_of_absence)
    assert both.recall_of_absence == 1
    assert math.isnan(mean([]).success)
    assert math.isnan(mean([short]).tn)


def present_as(pattern: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Overlap, box given, target there of a run of letters.

    H a hit, m a box that overlaps by 0.3, s one that overlaps by 0.05, n no box; capitals X and O
    are of an absent target: a box, no box.
    """
    overlap = np.array([{'H': 0.8, 'm': 0.3, 's': 0.05}.get(c, np.nan) for c in pattern])
    said = np.array([c in 'HmsX' for c in pattern])
    there = np.array([c in 'Hmsn' for c in pattern])
    return overlap, said, there


def test_strangers_are_boxes_on_something_else_of_all_frames():
    assert presence.strangers(*present_as('HmsnXO')) == pytest.approx(2 / 6)
    assert presence.strangers(*present_as('HHHn')) == 0
    assert math.isnan(presence.strangers(*present_as('')))


@pytest.mark.parametrize(
    ('pattern', 'value'),
    [
        ('HHHHHHHH', math.nan),  # never away
        ('HHOOnnHHn', 1),  # two frames to recognise; of the other three, two are hit
        ('HHOOHHHnn', 0),  # hit at first, then lost: one of three
        ('HHOOHHHH', math.nan),  # back for four frames only
        ('HHOHHHHH', 1),  # away for one frame
        ('HOnnHHHOnnnnnO', 0.5),  # back twice, found once
        ('OOHHHHH', 1),  # given, and away from the first frame that counts
        ('HXXmmmmm', 0),  # there, but not hit
        ('', math.nan),
    ],
)
def test_returns_are_found_from_the_third_frame_on(pattern: str, value: float):
    assert presence.returns(*present_as(pattern)) == pytest.approx(value, nan_ok=True)


def test_strangers_and_returns_are_among_the_measures():
    truth = [TRUTH, None, *[TRUTH] * 5]
    m = measure_boxes([TRUTH, AWAY, *[TRUTH] * 5], truth)
    assert (m.strangers, m.returns) == (pytest.approx(1 / 6), 1)
    assert measure_boxes([TRUTH, None, *[AWAY] * 5], truth).strangers == pytest.approx(5 / 6)
