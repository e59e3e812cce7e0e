# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the pages call by name is there: commands and options, modules, files, identifiers."""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import re
from functools import cache, lru_cache
from pathlib import Path

import pytest

import rgbd_kcf_tracker
from rgbd_kcf_tracker import recordings
from rgbd_kcf_tracker.cli.main import SUBCOMMANDS

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / 'README.md', *sorted((ROOT / 'docs').glob('*.md'))]
SOURCES = ('rgbd_kcf_tracker', 'launch', 'config', 'test')
SUFFIXES = {'.py', '.yaml', '.xml', '.js', '.html', '.j2'}

# Names of others' programs and data.
ELSEWHERE = {
    'depth_image_proc',
    'register_node',
    'rqt_runtime_monitor',
    'group_cam2',
    'kernel_correlation',
}
OTHERS_PAGES = {'kinect-v2-setup.md'}  # of drivers, not of this package


def words(page: Path) -> list[str]:
    """The spans of code of a page."""
    text = re.sub(r'^```.*?^```', '', page.read_text(encoding='utf-8'), flags=re.M | re.S)
    return re.findall(r'`([^`\n]+)`', text)


def commands(page: Path) -> list[str]:
    """The commands of a page, lines that are continued as one."""
    text = page.read_text(encoding='utf-8').replace('\\\n', ' ')
    blocks = re.findall(r'^```(?:sh|bash)?\n(.*?)^```', text, flags=re.M | re.S)
    lines = [line.partition(' #')[0] for block in blocks for line in block.splitlines()]
    return [line for line in [*lines, *words(page)] if 'rgbd-kcf ' in line]


@lru_cache(maxsize=1)
def source() -> str:
    """All that the package, its files and its tests say."""
    files = (path for folder in SOURCES for path in sorted((ROOT / folder).rglob('*')))
    return '\n'.join(
        path.read_text(encoding='utf-8', errors='replace')
        for path in files
        if path.suffix in SUFFIXES and path.name != Path(__file__).name
    )


@cache
def options(command: str) -> frozenset[str]:
    """What a subcommand takes, its own subcommands' included."""
    parser = argparse.ArgumentParser()
    importlib.import_module(f'rgbd_kcf_tracker.cli.{command}').add_arguments(parser)
    found: set[str] = set()
    waiting = [parser]
    while waiting:
        for action in waiting.pop()._actions:
            found.update(action.option_strings)
            if isinstance(action, argparse._SubParsersAction):
                waiting += action.choices.values()
    return frozenset(found)


@pytest.mark.parametrize('page', PAGES, ids=lambda p: p.name)
def test_commands_and_their_options_are_there(page: Path) -> None:
    for line in commands(page):
        for part in line.split('rgbd-kcf ')[1:]:
            command = part.split()[0].strip('`,.;)')
            if not command.islower() or command.startswith('-'):
                continue  # a placeholder, or the options of all
            assert command in SUBCOMMANDS, line
            for option in re.findall(r'(?<!\S)--[a-z][a-z-]*', part.split('|')[0]):
                assert option in options(command), f'{page.name}: {line.strip()}'


@pytest.mark.parametrize('page', PAGES, ids=lambda p: p.name)
def test_rows_belong_to_a_table(page: Path) -> None:
    """A row without a heading above it, or with other columns, is text with bars in it."""
    text = re.sub(r'^```.*?^```', '', page.read_text(encoding='utf-8'), flags=re.M | re.S)
    for table in re.findall(r'(?:^\|.*\n?)+', text, flags=re.M):
        heading, ruler, *rows = table.splitlines()
        assert re.fullmatch(r'(?:\| ?:?-+:? ?)+\|', ruler), heading
        columns = {len(re.findall(r'(?<!\\)\|', row)) for row in (heading, ruler, *rows)}
        assert len(columns) == 1, f'{page.name}: {heading}'


def test_what_is_used_from_python_is_exported() -> None:
    text = (ROOT / 'docs' / 'recordings.md').read_text(encoding='utf-8')
    told = re.search(r'^From Python: (.*?)\n\n', text, re.M | re.S)
    assert told is not None
    names = set(re.findall(r'`(\w+)`', told[1]))
    assert len(names) > 5
    assert names <= set(recordings.__all__)
    assert all(hasattr(recordings, name) for name in names)


@pytest.mark.parametrize('page', PAGES, ids=lambda p: p.name)
def test_modules_are_there(page: Path) -> None:
    text = page.read_text(encoding='utf-8')
    for name in re.findall(r'\brgbd_kcf_tracker\.[a-z_.]+[a-z_]', text):
        parts = name.split('.')
        found: object = rgbd_kcf_tracker
        for index, part in enumerate(parts[1:], start=2):
            module = '.'.join(parts[:index])
            if not hasattr(found, part) and importlib.util.find_spec(module) is not None:
                found = importlib.import_module(module)
            else:
                found = getattr(found, part)


@pytest.mark.parametrize(
    'page', [p for p in PAGES if p.name not in OTHERS_PAGES], ids=lambda p: p.name
)
def test_identifiers_and_files_are_there(page: Path) -> None:
    """A name that the code does not know any more has been left behind by a change."""
    missing = []
    for word in words(page):
        path = re.fullmatch(r'(?:config|launch|docs|test|rgbd_kcf_tracker)/[\w./-]+', word)
        if path and not re.search('[A-Z]{3}', word) and not (ROOT / word).exists():
            missing.append(word)
        name = re.fullmatch(r'(?:[A-Za-z]\w*\.)*([A-Za-z_]\w*)(?:\(\))?', word)
        if name is None or word in ELSEWHERE:
            continue
        last = name[1]
        telling = '_' in last.strip('_') or re.search(r'[a-z][A-Z]', last)
        if telling and not re.search(rf'\b{re.escape(last)}\b', source()):
            missing.append(word)
    assert missing == []


def test_the_python_interface_is_told_in_full() -> None:
    page = (ROOT / 'docs' / 'api.md').read_text(encoding='utf-8')
    told = set(re.findall(rf'^\.\. auto\w+:: {rgbd_kcf_tracker.__name__}\.(\w+)$', page, re.M))
    assert set(rgbd_kcf_tracker.__all__) - {'RgbdKcfError'} <= told  # with the other errors
