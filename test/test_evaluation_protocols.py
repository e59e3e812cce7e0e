# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""VOT short-term, long-term and calibration measures against examples worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rgbd_kcf_tracker.evaluation.metrics import calibration, longterm, vot
from rgbd_kcf_tracker.geometry import Box


def run(codes, overlaps=None):
    codes = np.array(codes)
    values = np.full(len(codes), 0.5) if overlaps is None else np.array(overlaps, float)
    return vot.ShortTermRun(codes, values)


# start, two frames, failure, one skipped frame, start, three frames
FAILED = run([1, 3, 3, 2, 0, 1, 3, 3, 3], [1, 0.8, 0.4, 0, 0, 1, 0.6, 0.9, 0.3])


def test_accuracy_leaves_out_starts_failures_skips_and_the_burn_in():
    assert vot.accuracy(FAILED, burn_in=1) == pytest.approx((0.8 + 0.4 + 0.6 + 0.9 + 0.3) / 5)
    assert vot.accuracy(FAILED, burn_in=2) == pytest.approx((0.4 + 0.9 + 0.3) / 3)
    assert math.isnan(vot.accuracy(FAILED, burn_in=10))


def test_robustness_is_the_mean_number_of_failures():
    assert vot.failures(FAILED) == 1
    assert vot.mean_robustness([FAILED, run([1, 3, 3])]) == 0.5
    assert vot.reliability([FAILED], 9) == pytest.approx(math.exp(-1))
    assert math.isnan(vot.mean_robustness([]))
    assert math.isnan(vot.reliability([]))


def test_accuracy_over_sequences_is_weighted_by_length():
    other = run([1, 3, 3], [1, 0.2, 0.2])
    own = (0.8 + 0.4 + 0.6 + 0.9 + 0.3) / 5
    assert vot.mean_accuracy([FAILED, other], 1) == pytest.approx((9 * own + 3 * 0.2) / 12)
    assert math.isnan(vot.mean_accuracy([run([1])]))


def test_fragments_are_cut_at_failures():
    first, second = vot.fragments(FAILED)
    assert first.overlaps.tolist() == [0.8, 0.4]
    assert first.failed
    assert second.overlaps.tolist() == [0.6, 0.9, 0.3]
    assert not second.failed


def test_expected_overlap_draws_failures_out_with_zeros():
    curve = vot.expected_overlap_curve([FAILED], 4)
    failed = [0.8, 0.6, 0.4, 0.3]  # running mean of .8 .4 0 0
    lasted = [0.6, 0.75, 0.6]  # of .6 .9 .3; says nothing of a fourth frame
    assert curve == pytest.approx([0.7, 0.675, 0.5, 0.3])
    assert curve[:3] == pytest.approx(np.mean([failed[:3], lasted], axis=0))
    assert vot.expected_average_overlap([FAILED], 2, 4) == pytest.approx((0.675 + 0.5 + 0.3) / 3)
    assert math.isnan(vot.expected_average_overlap([]))


def test_lengths_that_no_fragment_reaches_have_no_expectation():
    curve = vot.expected_overlap_curve([run([1, 3, 3])], 3)
    assert curve[:2] == pytest.approx([0.5, 0.5])
    assert math.isnan(curve[2])


def test_typical_lengths_hold_half_of_the_sequences_about_the_commonest():
    assert vot.typical_lengths([50, 50]) == (50, 50)
    lengths = [100] * 20 + [110] * 20 + [120] * 20 + [500]
    low, high = vot.typical_lengths(lengths)
    assert 90 < low <= 110 <= high < 135
    with pytest.raises(ValueError, match='no lengths'):
        vot.typical_lengths([])


A, B = Box(0, 0, 10, 10), Box(5, 0, 10, 10)  # IoU 1/3


def test_long_term_precision_recall_and_f_by_hand():
    # visible in 3 of 4 frames; boxes: perfect at .9, a third at .5, false at .4, none
    one = longterm.scored([A, B, A, None], np.array([0.9, 0.5, 0.4, 0.8]), [A, A, None, A])
    assert one.visible == 3
    assert np.isnan(one.scores[3]), 'a score without a box is no claim'
    result = longterm.evaluate([one])
    assert result.thresholds.tolist() == [np.inf, 0.9, 0.5, 0.4, -np.inf]
    both = 1 + 1 / 3
    assert result.precisions == pytest.approx([1, 1, both / 2, both / 3, both / 3])
    assert result.recalls == pytest.approx([0, 1 / 3, both / 3, both / 3, both / 3])
    f = [0, 1 / 2, 2 * (2 / 3) * (4 / 9) / (2 / 3 + 4 / 9)]
    assert result.f_score == pytest.approx(max(f))
    assert (result.precision, result.recall) == pytest.approx((2 / 3, 4 / 9))


def test_long_term_means_are_over_sequences_at_common_thresholds():
    good = longterm.scored([A] * 4, np.full(4, 0.8), [A] * 4)
    bad = longterm.scored([B], np.array([0.8]), [A])
    result = longterm.evaluate([good, bad])
    assert result.precision == pytest.approx((1 + 1 / 3) / 2)
    assert result.recall == pytest.approx((1 + 1 / 3) / 2)


def test_long_term_without_boxes_or_sequences():
    silent = longterm.scored([None, None], np.zeros(2), [A, None])
    assert longterm.evaluate([silent]).f_score == 0
    assert math.isnan(longterm.evaluate([]).f_score)


def test_long_term_leaves_out_where_the_target_never_shows():
    good = longterm.scored([A] * 4, np.full(4, 0.8), [A] * 4)
    nobody = longterm.scored([None, A], np.array([0.0, 0.9]), [None, None])
    result = longterm.evaluate([good, nobody])
    assert (result.precision, result.recall, result.f_score) == (1, 1, 1)
    assert math.isnan(longterm.evaluate([nobody]).f_score)


def test_many_scores_give_at_most_a_hundred_thresholds():
    thresholds = longterm.score_thresholds(np.linspace(0, 1, 5000))
    assert len(thresholds) == 100
    assert thresholds[1] == 1
    assert thresholds[-2] == 0
    assert (np.diff(thresholds) < 0).all()


def test_reliability_by_hand():
    scores = np.array([0.05, 0.1, 0.95, 1.0, 0.9, np.nan])
    hits = np.array([False, True, True, True, False, True])
    table = calibration.reliability(scores, hits)
    assert table.counts.tolist() == [2, 0, 0, 0, 0, 0, 0, 0, 1, 2], 'a bin holds its upper edge'
    assert table.hit_rate[0] == 0.5
    assert table.mean_score[0] == pytest.approx(0.075)
    assert math.isnan(table.hit_rate[1])
    gaps = 2 * abs(0.075 - 0.5) + abs(0.9 - 0) + 2 * abs(0.975 - 1)
    assert table.expected_error == pytest.approx(gaps / 5)
    assert table.brier == pytest.approx((0.05**2 + 0.9**2 + 0.05**2 + 0 + 0.9**2) / 5)


def test_reliability_without_boxes():
    table = calibration.reliability(np.zeros(0), np.zeros(0, bool))
    assert math.isnan(table.expected_error)
    assert table.counts.sum() == 0


def test_perfectly_calibrated_scores_have_no_error():
    rng = np.random.default_rng(1)
    scores = rng.uniform(size=20000)
    hits = rng.uniform(size=20000) < scores
    assert calibration.reliability(scores, hits).expected_error < 0.02


def test_honesty_by_hand():
    scores = np.array([0.2, 0.5, 0.9, 0.95, 1.0, np.nan])
    good = np.array([False, True, True, False, True, True])
    found = calibration.honesty(scores, good, np.array([0.0, 0.5, 0.9, 0.96, 1.1]))
    assert found.shares[:4] == pytest.approx([3 / 5, 3 / 4, 2 / 3, 1])
    assert math.isnan(found.shares[4])
    assert (found.sure, found.sure_share) == (3, pytest.approx(2 / 3))


def test_honesty_of_a_tracker_that_is_never_sure():
    found = calibration.honesty(np.array([0.1]), np.array([True]))
    assert found.sure == 0
    assert math.isnan(found.sure_share)
    assert math.isnan(calibration.honesty(np.zeros(0), np.zeros(0, bool)).sure_share)
