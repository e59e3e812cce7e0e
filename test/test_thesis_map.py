# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from rgbd_kcf_tracker.parameters import describe
from rgbd_kcf_tracker.thesis.rgbd import RgbdParameters
from rgbd_kcf_tracker.thesis.rgbd_pf import RgbdPfParameters

PAGE = Path(__file__).resolve().parent.parent / 'docs' / 'thesis.md'


def test_every_name_on_the_thesis_page_exists() -> None:
    if not PAGE.exists():
        pytest.skip('runs in a checkout, where docs/ is')
    text = PAGE.read_text(encoding='utf-8')
    names = set(re.findall(r'`([a-z_.]+):([A-Za-z_.]+)`', text))
    assert len(names) > 40
    for module, path in names:
        found: object = importlib.import_module(f'rgbd_kcf_tracker.{module}')
        for part in path.split('.'):
            assert hasattr(found, part), f'{module}:{path}'
            found = getattr(found, part)


def test_every_step_of_both_algorithms_is_mapped() -> None:
    if not PAGE.exists():
        pytest.skip('runs in a checkout, where docs/ is')
    text = PAGE.read_text(encoding='utf-8')
    for name, last in (('Algorithm 1 (', 17), ('Algorithm 2 (', 21)):
        table = text.split(name)[1].split('Decided:')[0]
        steps: set[int] = set()
        for cell in re.findall(r'^\| ([0-9][^|]*)\|', table, re.MULTILINE):
            for part in cell.split('fig.')[0].split(','):
                ends = [int(n) for n in re.findall(r'[0-9]+', part)]
                steps.update(range(ends[0], ends[-1] + 1) if ends else ())
        # The printed Algorithm 2 has no step 20; 5 and 18 only loop.
        assert steps | {5, 18, 20} >= set(range(1, last + 1)), name


def test_defaults_named_on_the_page_are_the_released_ones() -> None:
    if not PAGE.exists():
        pytest.skip('runs in a checkout, where docs/ is')
    text = PAGE.read_text(encoding='utf-8')
    values = {
        info.name: info.default
        for cls in (RgbdParameters, RgbdPfParameters)
        for info in describe(cls)
    }
    named = re.findall(r'`([a-z_]+)`[, (]+([0-9.]+) m\b', text)
    assert {name for name, _ in named} >= {'depth_threshold', 'depth_cap'}
    for name, value in named:
        assert values[name] == float(value), name
