# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What users get from ``pip install .`` and from ``colcon build``."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from rgbd_kcf_tracker.extras import EXTRAS
from rgbd_kcf_tracker.recordings import GENERIC, BagWriter
from rgbd_kcf_tracker.simulation import simulate

ROOT = Path(__file__).resolve().parent.parent
NAME = 'rgbd_kcf_tracker'
EXECUTABLES = ('rgbd-kcf', 'replay', 'viewer', 'follow', 'tracker')
NOT_ON_A_ROBOT = (
    *('rosbags', 'mcap', 'mcap_ros2', 'lz4', 'zstandard'),
    *('matplotlib', 'jinja2', 'imageio_ffmpeg', 'tqdm', 'psutil', 'threadpoolctl'),
)


def clean_environment() -> dict[str, str]:
    """The environment without what the ROS wheels or a ROS installation put into it."""
    environment = dict(os.environ)
    for name in ('LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'PYTHONPATH',
                 'AMENT_PREFIX_PATH', 'COLCON_PREFIX_PATH'):  # fmt: skip
        environment.pop(name, None)
    return environment


def run(*command: str | Path, cwd: Path, timeout: float = 120) -> str:
    done = subprocess.run(
        [str(part) for part in command], cwd=cwd, env=clean_environment(), text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f'{" ".join(map(str, command))}\n{done.stdout}'
    return done.stdout


@pytest.fixture(scope='module')
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what belongs to the package, so that no build leaves traces in the checkout."""
    copy = tmp_path_factory.mktemp('source') / NAME
    copy.mkdir()
    for folder in (NAME, 'config', 'launch', 'resource'):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns('__pycache__'))
    for file in ('setup.py', 'setup.cfg', 'pyproject.toml', 'package.xml', 'README.md', 'LICENSE'):
        shutil.copy(ROOT / file, copy / file)
    return copy


def assert_share_is_complete(share: Path) -> None:
    assert (share / 'package.xml').is_file()
    for folder in ('config', 'launch'):
        wanted = {p.name for p in (ROOT / folder).iterdir() if p.is_file()}
        assert wanted, f'{folder}/ is empty'
        assert {p.name for p in (share / folder).iterdir() if p.is_file()} == wanted


def test_pip_install(source: Path, tmp_path: Path) -> None:
    prefix = tmp_path / 'prefix'
    environment_before = sorted(Path(sysconfig.get_path('purelib')).iterdir())
    run(sys.executable, '-m', 'pip', 'install', '--quiet', '--no-deps', '--no-build-isolation',
        '--ignore-installed', '--prefix', prefix, source, cwd=tmp_path)  # fmt: skip
    # Else pip takes the package that this suite runs from out of its environment.
    assert sorted(Path(sysconfig.get_path('purelib')).iterdir()) == environment_before
    version = f'python{sys.version_info.major}.{sys.version_info.minor}'
    packages = prefix / 'lib' / version / 'site-packages'
    assert (packages / NAME / 'py.typed').is_file()
    for path in (ROOT / NAME).rglob('*.*'):
        if '__pycache__' in path.parts or path.is_dir():
            continue
        assert (packages / path.relative_to(ROOT)).is_file(), f'{path} is not installed'
    for name in EXECUTABLES:
        assert os.access(prefix / 'bin' / name, os.X_OK)
        # Where `ros2 run` looks: it finds what pip installed.
        assert os.access(prefix / 'lib' / NAME / name, os.X_OK)
    environment = f'PYTHONPATH={packages}'
    said = run('env', environment, prefix / 'lib' / NAME / 'tracker', '--help', cwd=tmp_path)
    assert said.startswith('usage: tracker')
    assert_share_is_complete(prefix / 'share' / NAME)
    assert (prefix / 'share/ament_index/resource_index/packages' / NAME).is_file()
    (metadata,) = packages.glob(f'{NAME}-*.dist-info/METADATA')
    required = re.findall(r'^Requires-Dist: ([\w-]+)[^;\n]*$', metadata.read_text('utf-8'), re.M)
    assert set(EXTRAS['batch'][0]) <= set(required), 'several recordings need no extra'


def test_the_sdist_holds_what_wheels_and_tests_are_made_of(tmp_path: Path) -> None:
    folders = (NAME, 'config', 'docs', 'launch', 'resource', 'test')
    copy = tmp_path / 'source'
    for folder in folders:
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns('__pycache__'))
    for path in (*(p for p in ROOT.iterdir() if p.is_file()), ROOT / '.ci' / 'run'):
        (copy / path.relative_to(ROOT)).parent.mkdir(exist_ok=True)
        shutil.copy(path, copy / path.relative_to(ROOT))
    wanted = {str(p.relative_to(copy)) for p in copy.rglob('*') if p.is_file()}
    wanted = {name for name in wanted if name == '.ci/run' or not name.startswith('.')}
    run(sys.executable, 'setup.py', '-q', 'sdist', '-d', tmp_path, cwd=copy)
    (made,) = tmp_path.glob('*.tar.gz')
    with tarfile.open(made) as archive:
        held = {name.partition('/')[2] for name in archive.getnames()}
    assert not wanted - held


@pytest.mark.ros
@pytest.mark.slow
def test_colcon_build(source: Path, tmp_path: Path) -> None:
    """Built and sourced, the nodes are where ``ros2 run`` looks for them, and they start."""
    colcon = Path(sys.executable).parent / 'colcon'
    if not colcon.exists():
        pytest.skip("needs colcon beside this Python: pip install '.[test]'")
    run(colcon, '--log-base', tmp_path / 'log', 'build', '--base-paths', source,
        '--build-base', tmp_path / 'build', '--install-base', tmp_path / 'install',
        cwd=tmp_path)  # fmt: skip
    prefix = tmp_path / 'install' / NAME
    assert_share_is_complete(prefix / 'share' / NAME)
    for name in EXECUTABLES:
        assert os.access(prefix / 'lib' / NAME / name, os.X_OK)

    setup = tmp_path / 'install' / 'setup.sh'
    where = run(
        'sh', '-c',
        f'. {setup} && python3 -c "from ament_index_python.packages import '
        f'get_package_share_directory as find; print(find(\'{NAME}\'))"'.replace(
            'python3', sys.executable),
        cwd=tmp_path,
    )  # fmt: skip
    assert Path(where.strip()) == prefix / 'share' / NAME
    run('sh', '-c', f'. {setup} && {prefix}/lib/{NAME}/rgbd-kcf --help', cwd=tmp_path)
    made = simulate('occlusion', seed=4, size=(160, 120))
    with BagWriter(tmp_path / 'walk.mcap', GENERIC) as bag:
        for index in range(20):
            bag.write_frame(made[index].frame)
    first = made[0].visible
    assert first is not None
    lib = prefix / 'lib' / NAME
    box = ','.join(f'{v:g}' for v in first.as_tuple())
    (tmp_path / 'tracker.yaml').write_text(
        f'/**:\n  ros__parameters:\n    init_box: "{box}"\n    queue_policy: all\n'
    )
    tracker = subprocess.Popen(
        ['sh', '-c', f'. {setup} && exec {lib}/tracker --ros-args --params-file tracker.yaml'],
        cwd=tmp_path, env=clean_environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True,
    )  # fmt: skip
    try:
        said = run(
            'sh', '-c',
            f'. {setup} && exec {lib}/replay --ros-args -p bag:=walk.mcap -p lockstep:=true '
            '-p wait_for_subscribers:=60.0',
            cwd=tmp_path,
        )  # fmt: skip
        assert '20 of 20 answered' in said
        tracker.terminate()
        output, _ = tracker.communicate(timeout=10)
        assert tracker.returncode == 0, output
        assert 'Traceback' not in output
    finally:
        tracker.kill()


def test_the_manifest_can_be_released() -> None:
    """What bloom checks before it makes Debian packages, as far as that goes offline."""
    package_xml = pytest.importorskip('catkin_pkg.package', reason='needs catkin_pkg (colcon)')
    warnings: list[str] = []
    package = package_xml.parse_package(ROOT / 'package.xml', warnings=warnings)
    assert warnings == []
    package.validate(warnings=warnings)
    assert warnings == []
    assert package.get_build_type() == 'ament_python'
    assert all(maintainer.email for maintainer in package.maintainers)
    assert (ROOT / package.licenses[0].file).is_file()
    # catkin_prepare_release puts the version where this word stands.
    log = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')
    assert re.search(rf'^(Forthcoming\n-+|{re.escape(package.version)} \()', log, re.MULTILINE)


def test_rosdep_needs_apt_alone() -> None:
    """rosdep stops where a key is for pip: Ubuntu's Python is not pip's to change (PEP 668)."""
    manifest = ET.parse(ROOT / 'package.xml').getroot()
    keys = {e.text for e in manifest if e.tag.endswith('depend')}
    assert not {key for key in keys if key.endswith('-pip')}
    assert not keys & {'mcap-ros2-support'}


def test_the_page_names_what_apt_has_of_the_extras() -> None:
    page = (ROOT / 'docs' / 'install.md').read_text(encoding='utf-8')
    for extra in ('batch', 'report', 'video'):
        for name in EXTRAS[extra][1].split():
            assert f'`{name}`' in page, f'{name} of {extra}'


WITHOUT = f"""
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in {NOT_ON_A_ROBOT!r}:
            raise ModuleNotFoundError(f'No module named {{name!r}}', name=name)
sys.meta_path.insert(0, Absent())
"""


def test_the_nodes_of_a_robot_need_nothing_that_apt_lacks() -> None:
    pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")
    code = f"""{WITHOUT}
import rgbd_kcf_tracker.ros.tracker_node, rgbd_kcf_tracker.live.auto_init
import rgbd_kcf_tracker.ros.viewer_node, rgbd_kcf_tracker.view.server
from rgbd_kcf_tracker.live.session import warm_up
from rgbd_kcf_tracker.variants import VARIANTS
for variant in VARIANTS:
    warm_up(variant)
print('works')
"""
    assert run(sys.executable, '-c', code, cwd=ROOT).endswith('works\n')


@pytest.mark.parametrize(
    ('main', 'arguments'),
    [
        ('rgbd_kcf_tracker.cli.main', ['info', 'walk.mcap']),
        ('rgbd_kcf_tracker.ros.replay_main', ['--ros-args', '-p', 'bag:=walk.mcap']),
    ],
)
def test_what_reads_bags_says_what_is_missing(
    main: str, arguments: list[str], tmp_path: Path
) -> None:
    if 'ros' in main.split('.'):
        pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")
    (tmp_path / 'walk.mcap').write_bytes(b'nothing')
    code = f'{WITHOUT}\nfrom {main} import main\nsys.exit(main({arguments!r}))'
    done = subprocess.run(
        [sys.executable, '-c', code], cwd=tmp_path, text=True, capture_output=True, timeout=120,
        env=clean_environment() | {'PYTHONPATH': str(ROOT)}, check=False,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert 'is missing: pip install rosbags' in done.stderr
    assert 'Traceback' not in done.stderr


@pytest.mark.parametrize('name', [name for name in EXECUTABLES if name != 'rgbd-kcf'])
def test_a_node_without_ros_says_what_is_missing(name: str) -> None:
    code = (
        "import sys; sys.modules['rclpy'] = None\n"
        f'from rgbd_kcf_tracker.ros.{name}_main import main\nsys.exit(main([]))'
    )
    done = subprocess.run(
        [sys.executable, '-c', code], cwd=ROOT, text=True, capture_output=True, timeout=120,
        env=clean_environment() | {'PYTHONPATH': str(ROOT)}, check=False,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith(f'{name}: rclpy is missing: source ROS 2')
    assert done.stderr.count('\n') == 1


def test_the_image_is_made_of_files_that_are_there() -> None:
    text = (ROOT / 'Dockerfile').read_text(encoding='utf-8').replace('\\\n', ' ')
    copied = [line.split()[1:-1] for line in text.splitlines() if line.startswith('COPY')]
    names = {name for names in copied for name in names}
    assert names
    assert all((ROOT / name).exists() for name in names)


def test_manifest_and_setup_agree() -> None:
    manifest = ET.parse(ROOT / 'package.xml').getroot()
    assert manifest.get('format') == '3'
    assert manifest.findtext('name') == NAME
    assert manifest.findtext('export/build_type') == 'ament_python'
    stated = run(sys.executable, 'setup.py', '--version', cwd=ROOT).split()[-1]
    assert manifest.findtext('version') == stated
    assert 'Apache License' in (ROOT / 'LICENSE').read_text(encoding='utf-8')[:200]
