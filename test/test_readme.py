# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the README and docs/ point to exists."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from rgbd_kcf_tracker import recordings
from rgbd_kcf_tracker.bench.demo import SCENARIO, SEED
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.recordings.recording import Closing
from rgbd_kcf_tracker.simulation import simulate
from rgbd_kcf_tracker.variants import VARIANTS

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / 'README.md', ROOT / 'QUALITY_DECLARATION.md', *sorted((ROOT / 'docs').glob('*.md'))]


@pytest.mark.parametrize('page', PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r'\]\(([^)\s]+)\)', page.read_text(encoding='utf-8')):
        if re.match(r'[a-z]+:', target) or target.startswith('#'):
            continue
        name, _, anchor = target.partition('#')
        assert (page.parent / name).exists(), f'{page.name}: {target}'
        if anchor:
            headings = re.findall(r'^#+ (.*)$', (page.parent / name).read_text('utf-8'), re.M)
            assert anchor in map(slug, headings), f'{page.name}: {target}'


def slug(heading: str) -> str:
    """A heading as links name it."""
    return re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-')


def test_make_has_the_targets_that_the_readme_names() -> None:
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    readme = (ROOT / 'README.md').read_text(encoding='utf-8')
    for target in {'demo', 'test'} | set(re.findall(r'`make (\w+)', readme)):
        assert re.search(rf'^{target}:', makefile, re.MULTILINE), f'make {target}'
    assert 'make test' in (ROOT / '.ci' / 'run').read_text(encoding='utf-8')


def test_readme_names_every_variant_and_command() -> None:
    from rgbd_kcf_tracker.cli import main

    readme = (ROOT / 'README.md').read_text(encoding='utf-8')
    for variant in VARIANTS:
        assert f'| `{variant}` |' in readme
    for name in main.SUBCOMMANDS:
        assert f'`rgbd-kcf {name}' in readme


class Demo(Closing):
    """The first frames of the demo's recording."""

    def __init__(self, path: str) -> None:
        assert path == 'demo/recording.mcap'

    def frames(self) -> Iterator[Frame]:
        scene = simulate(SCENARIO, SEED, duration_s=10.0)
        return (scene[index].frame for index in range(4))

    def close(self) -> None:
        pass


def test_the_programs_of_the_readme_run_on_the_demo(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(recordings, 'open_recording', Demo)
    readme = (ROOT / 'README.md').read_text(encoding='utf-8')
    one, several = re.findall(r'^```python\n(.*?)^```', readme, re.M | re.S)
    for program, targets in ((one, 1), (several, 2)):
        exec(program, {})
        said = capsys.readouterr().out.splitlines()
        assert len(said) == 3 * targets
        assert all(' tracking Box(' in line for line in said)
