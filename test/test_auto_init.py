# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Choosing somebody without being told: people are, furniture and pictures are not."""

from __future__ import annotations

import dataclasses
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from rgbd_kcf_tracker import Box, Frame
from rgbd_kcf_tracker.bench import auto_init as bench
from rgbd_kcf_tracker.evaluation.datasets.base import Annotation, Sample
from rgbd_kcf_tracker.live.auto_init import AutoInit
from rgbd_kcf_tracker.live.settings import NodeParameters
from rgbd_kcf_tracker.recordings import SequenceWriter

SETTINGS = NodeParameters(auto_init=True)


@pytest.mark.parametrize('scenario', ['normal', 'crossing', 'turning', 'comers'])
def test_people_are_chosen(scenario: str) -> None:
    tally = bench.judge(bench.rendered(scenario, 7, 'people'), SETTINGS)
    assert tally.choices >= 0.3 * tally.looks > 3
    assert tally.wrong == 0
    assert tally.first == 1


@pytest.mark.parametrize(
    ('scenario', 'change'),
    [
        ('clutter', 'empty'),
        ('lookaround', 'empty'),
        ('behind_box', 'things'),
        ('small_animal', 'things'),
        ('normal', 'pictures'),
        ('camera_motion', 'pictures'),
    ],
)
def test_nothing_else_is_chosen(scenario: str, change: str) -> None:
    samples = list(bench.rendered(scenario, 7, change))
    assert not any(s.people for s in samples)
    tally = bench.judge(samples, SETTINGS)
    assert (tally.scenes, tally.choices) == (1, 0)


def test_people_beside_their_pictures_are_chosen() -> None:
    tally = bench.judge(bench.rendered('normal', 8, 'pictures'), SETTINGS)
    assert tally.choices > 10
    assert tally.wrong == 0


def test_only_who_is_in_range_is_chosen() -> None:
    samples = list(bench.rendered('approach', 7, 'people'))
    far = bench.judge(samples, NodeParameters(auto_init_far=1.0))
    assert far.choices == 0
    choose = AutoInit(NodeParameters(auto_init_near=2.5, auto_init_far=4.0))
    depths = []
    for sample in samples:
        box = choose(sample.frame)
        if box is not None:
            x, y = round(box.cx), round(box.y + 0.4 * box.height)
            depths.append(float(np.nanmedian(sample.frame.depth[y - 4 : y + 4, x - 4 : x + 4])))
    assert len(depths) >= 3
    assert 2.3 < min(depths) <= max(depths) < 4.2


def test_nobody_is_found_without_depth_or_more_often_than_need_be() -> None:
    choose = AutoInit(SETTINGS)
    color = np.zeros((120, 160, 3), np.uint8)
    assert choose(Frame(color)) is None
    found = 0
    for step, sample in enumerate(bench.rendered('normal', 7, 'people')):
        # Each picture twice, a thirtieth of a second apart: the second is not looked at.
        frame = sample.frame
        found += choose(frame) is not None
        again = Frame(frame.color, frame.depth, frame.stamp_ns + 33_000_000, frame.intrinsics)
        assert choose(again) is None
        if step == 12:
            break
    assert found > 0


@pytest.mark.parametrize(
    ('given', 'said'),
    [
        (['--seeds', 'abc'], 'give numbers like'),
        (['--seeds', '', '--people', '/nowhere'], '/nowhere does not exist'),
        (['--intrinsics', '1,2'], 'FX,FY,CX,CY'),
    ],
)
def test_wrong_arguments_of_the_measurement_are_answered_in_a_sentence(
    given: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert bench.main(given) == 2
    assert said in capsys.readouterr().err


def test_who_is_not_chosen_is_not_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cupboard beside somebody was somebody found, and at once."""
    person, cupboard = Box(20, 10, 20, 60), Box(100, 10, 20, 60)
    frame = Frame(np.zeros((120, 160, 3), np.uint8), np.full((120, 160), 2.0, np.float32))
    samples = [
        Sample(dataclasses.replace(frame, stamp_ns=second * 10**9), None, people=people)
        for second, people in enumerate([(Annotation(1, person),)] * 4)
    ]
    boxes = iter([cupboard, None, person, person])
    monkeypatch.setattr(bench, 'AutoInit', lambda _: lambda _: next(boxes))
    tally = bench.judge(samples, SETTINGS)
    assert (tally.choices, tally.wrong, tally.first, tally.first_wrong) == (3, 1, 1, 1)
    assert (tally.looks, tally.found) == (4, 2)
    assert tally.seconds == [2.0]


def test_all_recordings_count_and_empty_ones_need_no_truth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a folder the first alone was looked at."""
    one = tmp_path / 'people' / 'one'
    one.parent.mkdir()
    with SequenceWriter(one) as writer:
        for sample in bench.rendered('normal', 7, 'people'):
            writer.write(sample.frame, sample.people[0].box if sample.people else None)
            if sample.number == 3:
                break
    (one / 'groundtruth.txt').rename(one / 'groundtruth_1.txt')
    shutil.copytree(one, tmp_path / 'people' / 'two')
    shutil.copytree(one, tmp_path / 'empty')
    (tmp_path / 'empty' / 'groundtruth_1.txt').unlink()
    bench.main(['--seeds', '', '--people', str(one.parent), '--empty', str(tmp_path / 'empty')])
    rows = [re.split(' {2,}', row) for row in capsys.readouterr().out.splitlines()[2:]]
    scenes = {row[0]: row[1] for row in rows}
    assert scenes == {'recorded people': '2', 'recorded, empty': '1', 'all': '3'}


@pytest.mark.parametrize('fps', ['0', 'nan', '-1'])
def test_no_frames_a_second_are_refused(fps: str) -> None:
    with pytest.raises(SystemExit, match='2'):
        bench.main(['--seeds', '', '--fps', fps])
