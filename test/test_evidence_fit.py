# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Fitting the weights: from candidates to a regression that decides them rightly."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from people_rig import GOOD

from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.evidence_fit import (
    OTHER_LOOK,
    Examples,
    fit,
    joined,
    left_out,
    main,
    probabilities,
    with_other_looks,
)
from rgbd_kcf_tracker.metric.decide.evidence import WEIGHTS, Said


def met(count: int = 200) -> Examples:
    """Targets, and as many other things that stand elsewhere and look alike."""
    rng = np.random.default_rng(0)
    evidence, labels = [], []
    for i in range(count):
        good = i % 2 == 0
        step = rng.uniform(0, 2) if good else rng.uniform(30, 60)
        evidence.append(dataclasses.replace(GOOD, step=step, stride=step / 4))
        labels.append(int(good))
    groups = np.array([f'scene{i // 2 % 4}' for i in range(count)])
    return Examples(np.array(evidence, np.object_), np.array(labels), np.ones(count), groups)


def test_fitted_weights_tell_the_target_from_what_stands_elsewhere():
    examples = met()
    assert examples.features.shape == (200, len(WEIGHTS))
    weights = fit(examples)
    assert weights.shape == WEIGHTS.shape
    chance = probabilities(examples.features, weights)
    assert ((chance > 0.5) == (examples.labels == 1)).mean() > 0.99
    assert min(left_out(examples)) > 0.95


def test_the_weight_of_a_further_cue_is_fitted_with_the_others():
    examples = met()
    rng = np.random.default_rng(1)
    told = [
        dataclasses.replace(GOOD, more=(Said('net', (1.0 if label else -1.0) + noise, 1.0),))
        for label, noise in zip(examples.labels, 0.3 * rng.standard_normal(200), strict=True)
    ]
    alike = dataclasses.replace(examples, evidence=np.array(told, np.object_))
    assert alike.features.shape == (200, len(WEIGHTS) + 1)
    weights = fit(alike)
    assert weights[-2] > 1.0, 'before that of the constant'
    chance = probabilities(alike.features, weights)
    assert ((chance > 0.5) == (examples.labels == 1)).mean() > 0.95


def test_a_cue_that_cannot_be_made_is_told_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / 'a_cue.py').write_text('def make():\n    raise RuntimeError("no net.onnx here")\n')
    monkeypatch.syspath_prepend(tmp_path)
    for cue, words in (('a_cue:make', 'no net.onnx here'), ('nowhere:make', 'nowhere')):
        monkeypatch.setattr('sys.argv', ['evidence_fit', 'sim:border', '--cue', cue])
        assert main() == 2
        said = capsys.readouterr().err
        assert f'--cue {cue}: ' in said
        assert words in said


@pytest.mark.parametrize(
    ('option', 'value', 'kind'),
    [
        ('--intrinsics', '1,2', 'camera'),
        ('--intrinsics', '-1,1,1,1', 'camera'),
        ('--rates', '5,a', 'rates'),
    ],
)
def test_what_is_no_camera_or_rate_is_told_in_a_sentence(
    option: str, value: str, kind: str,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
):  # fmt: skip
    monkeypatch.setattr('sys.argv', ['evidence_fit', 'sim:border', f'{option}={value}'])
    with pytest.raises(SystemExit):
        main()
    assert f"argument {option}: invalid {kind} value: '{value}'" in capsys.readouterr().err


def test_a_thing_of_wholly_other_look_at_the_targets_place_does_not_pass():
    examples = met()
    more = with_other_looks(examples)
    other = more.where(np.arange(len(more.labels)) >= len(examples.labels))
    assert len(other.labels) == 100, 'one for each target'
    assert not other.labels.any()
    assert all(evidence.look == OTHER_LOOK for evidence in other.evidence)
    assert other.evidence[0].mine == pytest.approx(5.0 - (3.0 - OTHER_LOOK))
    heavy = dataclasses.replace(more, weights=np.ones(len(more.labels)))
    assert probabilities(other.features, fit(heavy)).max() < 0.5
    assert probabilities(other.features, fit(examples)).max() > 0.5, 'nothing else says so'


def test_a_target_that_is_part_of_no_figure_stays_so():
    alone = dataclasses.replace(
        met(), evidence=np.array([dataclasses.replace(GOOD, mine=0.0)] * 200)
    )
    assert with_other_looks(alone).evidence[-1].mine == 0


def test_runs_that_met_one_kind_alone_cannot_be_fitted():
    examples = met()
    with pytest.raises(DatasetError, match='give more sequences'):
        joined([examples.where(examples.labels == 1)])
