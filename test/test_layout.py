# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Imports go one way, and each layer uses only the libraries it may."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rgbd_kcf_tracker.errors import MissingExtraError
from rgbd_kcf_tracker.extras import EXTRAS, require

PACKAGE = 'rgbd_kcf_tracker'
ROOT = Path(__file__).resolve().parent.parent
SOURCES = sorted((ROOT / PACKAGE).rglob('*.py'))

# A layer imports from its own and from those below it; what stands beside another in one layer does
# not know of it, but for SIDEWAYS.
LAYERS = (
    ('arrays', 'errors', 'lazy'),
    ('extras', 'parameters', 'lens', 'pose'),
    ('geometry',),
    ('frame',),
    ('track',),
    ('features',),
    ('metric', 'thesis'),
    ('variants',),
    ('targets',),
    ('insight',),
    ('recordings', 'simulation', 'cameras'),
    ('batch',),
    ('live', 'evaluation'),
    ('ros', 'cli', 'view', 'bench'),
)
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}
SIDEWAYS = {
    ('simulation', 'recordings'),
    ('bench', 'ros'),
    ('bench', 'cli'),
    ('cli', 'view'),
    ('bench', 'view'),
    ('ros', 'view'),  # the viewer node, which is the page over a running tracker
}
# Within metric/, what stands in none of the folders being the last.
METRIC = ('perceive', 'identity', 'decide')
# The package's front door shows what users need and belongs to no layer.
FRONT = '__init__'

ROS_MODULES = {
    'rclpy', 'rosidl_runtime_py', 'ament_index_python', 'launch', 'launch_ros', 'sensor_msgs',
    'std_msgs', 'geometry_msgs', 'std_srvs', 'diagnostic_msgs', 'visualization_msgs', 'vision_msgs',
    'lifecycle_msgs', 'rosgraph_msgs', 'rcl_interfaces', 'builtin_interfaces',
}  # fmt: skip
LEAN = {
    'arrays', 'errors', 'lazy', 'parameters', 'lens', 'geometry', 'frame', 'track',
    'features', 'metric', 'thesis', 'variants', 'targets', 'insight',
}  # fmt: skip
# bench/ is made of nodes too: a camera, a listener, a recorder.
WITH_ROS = {'ros', 'bench'}
LEAN_MODULES = {'numpy', 'scipy', 'cv2'} | set(sys.stdlib_module_names)


def layer_of(path: Path) -> str:
    parts = path.relative_to(ROOT / PACKAGE).parts
    return parts[0].removesuffix('.py')


def imports_of(path: Path) -> Iterator[tuple[int, str]]:
    """Line and dotted name of every import, those inside functions included."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}:{node.lineno}: write the import in full'
            assert node.module is not None
            yield node.lineno, node.module
            if node.module == PACKAGE:
                for alias in node.names:
                    yield node.lineno, f'{PACKAGE}.{alias.name}'


def inner_layer(name: str) -> str | None:
    parts = name.split('.')
    if parts[0] != PACKAGE or len(parts) < 2:
        return None
    return parts[1] if parts[1] in LEVEL else None


@pytest.mark.parametrize('path', SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_go_one_way(path: Path) -> None:
    layer = layer_of(path)
    if layer in (FRONT, '__main__'):
        return
    assert layer in LEVEL, f'{layer} has no place among the layers: see ../shared/DESIGN.md'
    for line, name in imports_of(path):
        other = inner_layer(name)
        if other is None or other == layer:
            continue
        allowed = LEVEL[other] < LEVEL[layer] or (layer, other) in SIDEWAYS
        assert allowed, f'{path.relative_to(ROOT)}:{line}: {layer} must not import {other}'


def metric_level(parts: tuple[str, ...]) -> int:
    return METRIC.index(parts[0]) if parts and parts[0] in METRIC else len(METRIC)


@pytest.mark.parametrize('path', SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_metric_perceives_then_remembers_then_decides(path: Path) -> None:
    parts = path.relative_to(ROOT / PACKAGE).parts
    if parts[0] != 'metric':
        return
    level = metric_level(parts[1:-1])
    for line, name in imports_of(path):
        other = name.split('.')
        if other[:2] == [PACKAGE, 'metric'] and len(other) > 2:
            allowed = metric_level(tuple(other[2:])) <= level
            assert allowed, f'{path.relative_to(ROOT)}:{line}: must not import {name}'


@pytest.mark.parametrize('path', SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_libraries_of_each_layer(path: Path) -> None:
    layer = layer_of(path)
    for line, name in imports_of(path):
        top = name.split('.')[0]
        where = f'{path.relative_to(ROOT)}:{line}'
        if layer not in WITH_ROS:
            assert top not in ROS_MODULES, f'{where}: {top} belongs in ros/'
        if layer in LEAN and top != PACKAGE:
            assert top in LEAN_MODULES, f'{where}: {layer} must not need {top}'


def test_every_library_is_declared() -> None:
    """What the code imports is in setup.py, and in package.xml as a rosdep key."""
    distributions = {
        'numpy': ('numpy', 'python3-numpy'),
        'scipy': ('scipy', 'python3-scipy'),
        'cv2': ('opencv-python-headless', 'python3-opencv'),
        # Not in apt, and rosdep would stop at keys for pip: docs/install.md says how to get them.
        'rosbags': ('rosbags', None),
        'mcap': ('mcap', None),
        'mcap_ros2': ('mcap-ros2-support', None),
        'lz4': ('lz4', None),  # comes with mcap
        'zstandard': ('zstandard', None),
        'yaml': ('PyYAML', 'python3-yaml'),
        'tqdm': ('tqdm', 'python3-tqdm'),
        'matplotlib': ('matplotlib', 'python3-matplotlib'),
        'jinja2': ('jinja2', 'python3-jinja2'),
        'aiohttp': ('aiohttp', 'python3-aiohttp'),
        'imageio_ffmpeg': ('imageio-ffmpeg', 'ffmpeg'),
        'psutil': ('psutil', 'python3-psutil'),
        # Of clusters and benches, where pip is at hand; rosdep has no key for them.
        'distributed': ('distributed', None),
        'pyarrow': ('pyarrow', None),
        'threadpoolctl': ('threadpoolctl', None),
    }
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    manifest = (ROOT / 'package.xml').read_text(encoding='utf-8')
    for path in SOURCES:
        for line, name in imports_of(path):
            top = name.split('.')[0]
            where = f'{path.relative_to(ROOT)}:{line}'
            if top == PACKAGE or top in sys.stdlib_module_names:
                continue
            if top in ROS_MODULES:
                assert f'>{top}</exec_depend>' in manifest, f'{where}: {top} not in package.xml'
                continue
            assert top in distributions, f'{where}: {top} is declared nowhere'
            distribution, key = distributions[top]
            assert re.search(rf"'{re.escape(distribution)}\b", setup), f'{where}: not in setup.py'
            assert key is None or f'>{key}</' in manifest, f'{where}: {key} not in package.xml'


def test_engine_loads_without_ros() -> None:
    """A plain script that uses the tracker brings in no ROS and no recording library."""
    code = (
        'import sys, rgbd_kcf_tracker\n'
        'assert "numpy" not in sys.modules\n'
        'rgbd_kcf_tracker.create_tracker()\n'
        'assert set(rgbd_kcf_tracker.__all__) <= set(dir(rgbd_kcf_tracker))\n'
        'heavy = {"rclpy", "rosbags", "mcap", "matplotlib", "jinja2"} & set(sys.modules)\n'
        'assert not heavy, heavy\n'
    )
    subprocess.run([sys.executable, '-c', code], check=True, cwd=ROOT, timeout=60)


def test_the_command_line_starts_with_the_standard_library_alone() -> None:
    """What the commands need is imported when they run: help and mistakes are told at once."""
    code = (
        'import sys\n'
        'from rgbd_kcf_tracker.cli import main\n'
        'early = {"argparse", "typing", "logging"} & set(sys.modules) - before\n'
        'assert not early, early\n'
        'try:\n'
        '    main.main(["track", "--help"])\n'
        'except SystemExit:\n'
        '    pass\n'
        'heavy = {"numpy", "scipy", "cv2", "mcap", "rosbags", "yaml"} & set(sys.modules)\n'
        'assert not heavy, heavy\n'
    )
    code = f'import sys; before = set(sys.modules)\n{code}'
    done = subprocess.run(
        [sys.executable, '-c', code], cwd=ROOT, timeout=60, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_extras_are_those_of_the_installation() -> None:
    """Each module of an extra is imported only where the extra was asked for."""
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    names = {'imageio_ffmpeg': 'imageio-ffmpeg'}
    for extra, (modules, _) in EXTRAS.items():
        line = re.search(rf'^{extra.upper()} = \[(.*)\]$', setup, re.MULTILINE)
        assert line is not None
        for module in modules:
            assert f"'{names.get(module, module)}" in line[1], f'{module} is not in {extra}'


def test_an_extra_that_does_not_fit_is_told_before_it_is_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As pyarrow 26 beside NumPy 1.26."""
    (tmp_path / 'pyarrow.py').write_text("raise ImportError('pyarrow requires NumPy 2.0')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, 'pyarrow', raising=False)
    with pytest.raises(MissingExtraError, match=r'requires NumPy 2\.0.*_tracker\[parquet\]'):
        require('parquet', '--table parquet')


WITHOUT = """
import json, sys
for name in ('matplotlib', 'jinja2', 'imageio_ffmpeg', 'tqdm', 'psutil', 'aiohttp'):
    sys.modules[name] = None
from rgbd_kcf_tracker.cli.main import main
for words in json.loads(sys.argv[1]):
    print(f'|{main(words)}|', end='', file=sys.stderr)
"""


def test_the_commands_of_a_robot_need_no_extra(tmp_path: Path) -> None:
    done = (
        ('simulate', 'walk', '--size', '160x90', '--rate', '5', '--duration', '1'),
        ('info', 'walk'),
        ('convert', 'walk', 'walk.mcap'),
        ('track', 'walk.mcap', '--output', 'a.csv', '--bag', 'a.mcap', '--variant', 'kcf'),
        ('bench', '--sizes', '64x64:32', '--frames', '20', '--variants', 'kcf'),
    )
    refused = (
        ('[report]', 'evaluate', 'walk', '--report', 'report'),
        ('[video]', 'track', 'walk', '--video', 'a.mp4'),
        ('[tools]', 'bench', '--soak', '20', '--variants', 'kcf'),
        ('[view]', 'view', 'walk'),
        ('[report]', 'explain', 'walk', '--output', 'explained'),
    )
    commands = [*done, *(words for _, *words in refused)]
    ran = subprocess.run(
        [sys.executable, '-c', WITHOUT, json.dumps(commands)], cwd=tmp_path, text=True, timeout=120,
        capture_output=True, check=False,
        env=os.environ | {'PYTHONPATH': str(ROOT), 'PATH': str(tmp_path)},
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    said = ran.stderr.split('|')
    assert said[1::2] == ['0'] * len(done) + ['2'] * len(refused), ran.stderr
    assert 'Traceback' not in ran.stderr
    for (extra, *_), error in zip(refused, said[2 * len(done) : -1 : 2], strict=True):
        assert f"pip install 'rgbd_kcf_tracker{extra}', or on Ubuntu: " in error
    assert sorted(p.name for p in tmp_path.iterdir()) == ['a.csv', 'a.mcap', 'walk', 'walk.mcap']


@pytest.mark.parametrize('path', SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_file_states_its_licence(path: Path) -> None:
    lines = path.read_text(encoding='utf-8').splitlines()
    if path.name.startswith('_version') or not lines:
        return
    assert lines[:2] == [
        '# Copyright 2026 The rgbd_kcf_tracker authors',
        '# SPDX-License-Identifier: Apache-2.0',
    ]


def told(path: Path) -> Iterator[tuple[str, bool]]:
    """Each constant of a module, and whether a docstring stands below it or its group."""
    body = ast.parse(path.read_text(encoding='utf-8')).body
    group: list[str] = []
    for node, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(node, ast.Assign):
            targets = node.targets
        elif isinstance(node, ast.AnnAssign):
            targets = [node.target]
        else:
            continue
        names = (n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name))
        group += [name for name in names if name.isupper() and not name.startswith('_')]
        below = after is not None and after.lineno == (node.end_lineno or 0) + 1
        if below and isinstance(after, ast.Assign | ast.AnnAssign):
            continue  # one docstring after the last of them is enough
        text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        said = text and below and isinstance(after.value.value, str)
        yield from ((name, said) for name in group)
        group = []


@pytest.mark.parametrize(
    'path',
    [p for p in SOURCES if p.relative_to(ROOT / PACKAGE).parts[0] == 'metric'],
    ids=lambda p: str(p.relative_to(ROOT)),
)
def test_every_constant_of_the_metric_path_is_explained(path: Path) -> None:
    """What it is, in which unit, and why it has its value: the last only a reader can check."""
    silent = [name for name, said in told(path) if not said]
    assert not silent, f'{path.relative_to(ROOT)}: no docstring below {", ".join(silent)}'


@pytest.mark.parametrize(
    ('source', 'silent'),
    [
        ('A = 1\n"""Metres."""\nB, C = 2, 3\n"""Seconds."""\n', set()),
        ('A = 1\nB = 2\n"""Metres, and seconds."""\n', set()),
        ('A: int = 1\n\n"""No longer its docstring."""\n', {'A'}),
        ('A = 1\n"""Metres."""\nB = 2\n\nC = 3\n"""Seconds."""\n', {'B'}),
        ('A = 1\nfile = open(A)\n_B = 2\n', {'A'}),
        ('A = 1\n5\n', {'A'}),
    ],
)
def test_silent_constants_are_found(tmp_path: Path, source: str, silent: set[str]) -> None:
    path = tmp_path / 'module.py'
    path.write_text(source, encoding='utf-8')
    assert {name for name, said in told(path) if not said} == silent
