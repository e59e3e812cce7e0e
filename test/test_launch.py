# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Launch files and camera profiles.

launch is not on the package index: where it is not installed (apt's ROS 2 has it), the files run
against stand-ins that only remember what they were given.
"""

from __future__ import annotations

import re
import runpy
import sys
from dataclasses import fields
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

from rgbd_kcf_tracker.errors import ParameterError, RgbdKcfError
from rgbd_kcf_tracker.live.camera_profiles import CameraProfile, camera_profile, load_cameras
from rgbd_kcf_tracker.live.settings import NodeParameters

PROJECT = Path(__file__).resolve().parent.parent
CAMERAS = PROJECT / 'config' / 'cameras.yaml'


class Remembered:
    """Stands for any class of launch: keeps its arguments."""

    def __init__(self, *values: Any, **named: Any) -> None:
        self.values, self.named = values, named

    def perform(self, context: Any) -> str:
        return context.launch_configurations[self.values[0]]


@pytest.fixture
def launch_modules(monkeypatch: pytest.MonkeyPatch) -> None:
    contents = {
        'launch': ('LaunchContext', 'LaunchDescription'),
        'launch.actions': (
            'DeclareLaunchArgument',
            'IncludeLaunchDescription',
            'OpaqueFunction',
            'SetEnvironmentVariable',
            'Shutdown',
        ),
        'launch.launch_description_sources': ('PythonLaunchDescriptionSource',),
        'launch.substitutions': ('LaunchConfiguration',),
        'launch_ros': (),
        'launch_ros.actions': ('Node',),
        'launch_ros.parameter_descriptions': ('ParameterValue',),
    }
    for name, classes in contents.items():
        module = ModuleType(name)
        for kind in classes:
            setattr(module, kind, type(kind, (Remembered,), {}))
        monkeypatch.setitem(sys.modules, name, module)
    packages = SimpleNamespace(
        get_package_share_directory=lambda _: str(PROJECT),
        get_packages_with_prefixes=lambda: dict.fromkeys(
            ('opennav_following', 'nav2_lifecycle_manager'), '/opt/ros/jazzy'
        ),
    )
    monkeypatch.setitem(sys.modules, 'ament_index_python', ModuleType('ament_index_python'))
    monkeypatch.setitem(sys.modules, 'ament_index_python.packages', packages)
    # It may have been imported with others.
    monkeypatch.delitem(sys.modules, 'rgbd_kcf_tracker.ros.launching', raising=False)


def started(file: str, **given: str) -> list[Any]:
    """What a launch file starts with these arguments (and ``ros_namespace``, as pushed by one)."""
    found = runpy.run_path(str(PROJECT / 'launch' / file))
    unknown = set(given) - set(found['ARGUMENTS']) - {'ros_namespace'}
    assert not unknown
    defaults = {name: default for name, (default, _) in found['ARGUMENTS'].items()}
    return found['start'](SimpleNamespace(launch_configurations=defaults | given))


def start_tracker(**given: str) -> tuple[Any, list[Any]]:
    """The node that tracker.launch.py starts with these arguments, and all its actions."""
    actions = started('tracker.launch.py', **given)
    (node,) = (a for a in actions if type(a).__name__ == 'Node')
    return node, actions


def start_replay(**given: str) -> tuple[dict[str, Any], dict[str, str]]:
    """The parameters of replay.launch.py's replay node, and the arguments of its tracker."""
    included, node = started('replay.launch.py', **given)
    return node.named['parameters'][0], dict(included.named['launch_arguments'])


@pytest.mark.parametrize('camera', list(load_cameras(CAMERAS)))
@pytest.mark.parametrize('compressed', ['false', 'true'])
def test_each_camera_is_remapped(launch_modules: None, camera: str, compressed: str) -> None:
    node, _ = start_tracker(camera=camera, compressed=compressed)
    profile = load_cameras(CAMERAS)[camera]
    remapped = dict(node.named['remappings'])
    if camera == 'none':
        assert remapped == {}
    else:
        assert remapped == {
            'color/image': profile.color,
            'depth/image': profile.depth,
            'color/camera_info': profile.info,
        }
    file, parameters = node.named['parameters']
    assert Path(file).is_file()
    assert parameters.get('color_transport') == ('compressed' if compressed == 'true' else None)
    transports = {'color_transport', 'depth_transport'} & set(parameters)
    NodeParameters(**{name: parameters[name] for name in transports})


def test_arguments_reach_the_node(launch_modules: None) -> None:
    node, actions = start_tracker(
        camera='orbbec',
        depth_topic='/my/depth',
        variant='kcf',
        init_box='1,2,3,4',
        auto_init='True',
        autostart='false',
        use_sim_time='true',
        namespace='left',
        name='watcher',
    )
    assert dict(node.named['remappings'])['depth/image'] == '/my/depth'
    assert dict(node.named['remappings'])['color/image'] == '/camera/color/image_raw'
    parameters = node.named['parameters'][1]
    assert parameters['init_box'].values == ('1,2,3,4',)
    assert parameters['variant'] == 'kcf'
    assert (parameters['auto_init'], parameters['autostart']) == (True, False)
    assert parameters['use_sim_time'] is True
    assert (node.named['namespace'], node.named['name']) == ('left', 'watcher')
    # The node itself sizes the transport to the machine: no variable stands in its way.
    assert len(actions) == 1
    profile = str(PROJECT / 'config' / 'fastdds.xml')
    _, with_profile = start_tracker(fastdds_profile=profile)
    assert with_profile[0].values == ('FASTRTPS_DEFAULT_PROFILES_FILE', profile)


@pytest.mark.parametrize(
    ('namespace', 'outer', 'logger'),
    [
        ('', '', 'tracker'),
        ('left', '', 'left.tracker'),
        ('/left/eye', '', 'left.eye.tracker'),
        ('left', '/robot', 'robot.left.tracker'),
        ('/left', '/robot', 'left.tracker'),
    ],
)
def test_the_log_level_is_that_of_the_node_in_its_namespace(
    launch_modules: None, namespace: str, outer: str, logger: str
) -> None:
    node, _ = start_tracker(namespace=namespace, ros_namespace=outer, log_level='debug')
    assert node.named['arguments'][-1] == f'{logger}:=debug'


@pytest.mark.parametrize(
    ('file', 'given', 'words'),
    [
        ('tracker', {'params_file': 'none.yaml'}, "params_file is 'none.yaml': there is no such"),
        ('tracker', {'fastdds_profile': 'none.xml'}, "fastdds_profile is 'none.xml': there is no"),
        ('tracker', {'auto_init': 'ja'}, "auto_init is 'ja': give true or false"),
        ('tracker', {'compressed': 'ture'}, "compressed is 'ture': give true or false"),
        ('replay', {'bag': 'a.mcap', 'rate': 'x'}, "rate is 'x': give a number"),
        ('viewer', {'port': '80.5'}, "port is '80.5': give a number"),
        ('follow', {'follow_file': 'none.yaml'}, "follow_file is 'none.yaml': there is no such"),
        ('follow', {'automatic': 'flase'}, "automatic is 'flase': give true or false"),
    ],
)
def test_a_mistyped_argument_starts_nothing(
    launch_modules: None, file: str, given: dict[str, str], words: str
) -> None:
    with pytest.raises(RgbdKcfError, match=f'launch argument {words}'):
        started(f'{file}.launch.py', **given)


def test_a_misspelt_argument_is_told(
    launch_modules: None, caplog: pytest.LogCaptureFixture
) -> None:
    """Not refused: it may be one of a launch file that includes this one."""
    found = runpy.run_path(str(PROJECT / 'launch' / 'tracker.launch.py'))
    given = {name: default for name, (default, _) in found['ARGUMENTS'].items()}
    given |= {'variatn': 'kcf', 'ros_namespace': '', 'bag': 'walk.mcap'}
    found['start'](SimpleNamespace(launch_configurations=given))
    assert [record.msg for record in caplog.records] == [
        'launch argument variatn is none of ours: did you mean variant?'
    ]


def test_a_profile_may_say_how_its_images_arrive(launch_modules: None, tmp_path: Path) -> None:
    path = tmp_path / 'cameras.yaml'
    path.write_text(
        'far: {color: /c, depth: /d, info: /i, color_transport: compressed, '
        'depth_transport: compressedDepth}',
        encoding='utf-8',
    )
    for file in ('tracker', 'viewer'):
        (node,) = started(f'{file}.launch.py', camera='far', cameras_file=str(path))
        parameters = node.named['parameters'][-1]
        assert parameters['color_transport'] == 'compressed'
        assert parameters['depth_transport'] == 'compressedDepth'


def test_what_is_not_given_stays_as_the_file_has_it(launch_modules: None) -> None:
    """Above all that a robot waits for ~/start; the dictionary comes after the file and wins."""
    fixed = {'automatic', 'autostart', 'auto_init', 'use_sim_time'}
    for file in ('tracker', 'follow'):
        for action in started(f'{file}.launch.py'):
            for given in action.named.get('parameters', [])[1:]:
                assert not fixed & set(given)
            passed = dict(action.named.get('launch_arguments', []))
            assert not any(passed[name] for name in fixed & set(passed))


def test_what_the_shipped_file_documents_is_taken(tmp_path: Path) -> None:
    head = CAMERAS.read_text(encoding='utf-8').partition('kinect2_hd:')[0]
    names = re.findall(r'^#   ([a-z_]+(?:, [a-z_]+)*)  ', head, re.MULTILINE)
    keys = {key for group in names for key in group.split(', ')}
    assert keys | {'description'} == {field.name for field in fields(CameraProfile)}


def test_arguments_are_declared_with_their_meaning(launch_modules: None) -> None:
    for file in ('tracker', 'replay', 'viewer', 'follow'):
        found = runpy.run_path(str(PROJECT / 'launch' / f'{file}.launch.py'))
        (entities,) = found['generate_launch_description']().values
        declared = [e for e in entities if type(e).__name__ == 'DeclareLaunchArgument']
        assert [d.values[0] for d in declared] == list(found['ARGUMENTS'])
        assert all(d.named['description'] for d in declared)


def test_the_viewer_looks_at_the_camera_of_the_tracker(launch_modules: None) -> None:
    from rgbd_kcf_tracker.view.live_page import ViewerParameters

    given = {'camera': 'orbbec', 'compressed': 'true', 'port': '9000', 'info_topic': '/my/info'}
    (node,) = started('viewer.launch.py', namespace='robot1', **given)
    assert node.named['namespace'] == 'robot1'
    tracker, _ = start_tracker(camera='orbbec', compressed='true', info_topic='/my/info')
    assert node.named['remappings'] == tracker.named['remappings']
    (parameters,) = node.named['parameters']
    settings = ViewerParameters(**parameters)
    assert (settings.port, settings.host, settings.color_transport) == (
        9000, '127.0.0.1', 'compressed',
    )  # fmt: skip


def test_replay_passes_only_what_the_tracker_takes(launch_modules: None) -> None:
    tracker = runpy.run_path(str(PROJECT / 'launch' / 'tracker.launch.py'))
    parameters, passed = start_replay(bag='walk.mcap', depth_topic='/my/depth')
    assert set(passed) <= set(tracker['ARGUMENTS'])
    from rgbd_kcf_tracker.live.replay_settings import ReplayParameters

    assert set(parameters) <= set(ReplayParameters.__dataclass_fields__)
    settings = yaml.safe_load((PROJECT / 'config' / 'replayed.yaml').read_text(encoding='utf-8'))
    NodeParameters(**settings['/**']['ros__parameters'])


def test_a_rate_that_is_given_is_the_pace(launch_modules: None) -> None:
    """In lock-step, the default, nobody would see it."""

    def pace(**given: str) -> tuple[float, bool]:
        parameters, _ = start_replay(bag='walk.mcap', **given)
        return parameters['rate'], parameters['lockstep']

    assert pace() == (1.0, True)
    assert pace(rate='0.5') == (0.5, False)
    assert pace(lockstep='no') == (1.0, False)
    with pytest.raises(ParameterError, match='in lock-step the tracker sets the pace'):
        pace(rate='2', lockstep='true')


def test_replay_plays_the_camera_that_the_tracker_hears(launch_modules: None) -> None:
    """One of several in the recording, in lock-step with a tracker in a namespace."""
    parameters, passed = start_replay(bag='walk.mcap', camera='kinect2_hd', namespace='left')
    hd = load_cameras(CAMERAS)['kinect2_hd']
    assert (parameters['color_topic'], parameters['answer_topic']) == (
        hd.color, '/left/tracker/box',
    )  # fmt: skip
    # Colour alone, and recordings without CameraInfo, are replayed too.
    assert not {'depth_topic', 'info_topic'} & set(parameters)
    assert (passed['camera'], passed['namespace']) == ('kinect2_hd', 'left')
    named, _ = start_replay(bag='walk.mcap', color_topic='/c', depth_topic='/d', info_topic='/i')
    assert [named[f'{kind}_topic'] for kind in ('color', 'depth', 'info')] == ['/c', '/d', '/i']
    assert start_replay(bag='walk.mcap')[1]['camera'] == 'kinect2_qhd'


@pytest.mark.parametrize('given', [{}, {'namespace': 'left'}, {'ros_namespace': '/robot'}])
def test_a_folder_is_heard_in_any_namespace(
    launch_modules: None, tmp_path: Path, given: dict[str, str]
) -> None:
    """Replay sends its images on names that no namespace changes."""
    from rgbd_kcf_tracker.live.replay_settings import ReplayParameters
    from rgbd_kcf_tracker.live.replay_source import ReplaySource

    (tmp_path / 'rgb').mkdir()
    (tmp_path / 'depth').mkdir()
    cv2.imwrite(str(tmp_path / 'rgb' / '0.png'), np.zeros((48, 64, 3), np.uint8))
    cv2.imwrite(str(tmp_path / 'depth' / '0.png'), np.full((48, 64), 2000, np.uint16))
    (tmp_path / 'intrinsics.json').write_text('{"fx": 50, "fy": 50, "cx": 32, "cy": 24}')
    parameters, passed = start_replay(bag=str(tmp_path), **given)
    assert 'color_topic' not in parameters
    assert passed['camera'] == 'none'
    tracker, _ = start_tracker(**passed)
    with ReplaySource(tmp_path, ReplayParameters()) as source:
        assert dict(tracker.named['remappings']) == {
            'color/image': source.color_topic,
            'depth/image': source.depth_topic,
            'color/camera_info': source.info_topic,
        }
        assert all(topic.name.startswith('/') for topic in source.topics)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('mine: {color: /a, depth: /b}', 'camera mine has no info'),
        ('mine: {color: /a, depth: /b, info: /c, colour: /d}', 'unknown colour'),
        ('mine: [', 'cannot be read'),
        ('mine: /a', 'names with entries'),
        (
            'mine: {color: /a, depth: /b, info: /c, color_transport: theora}',
            'color_transport is .theora.: choose one of raw, compressed',
        ),
    ],
)
def test_bad_profiles_say_what_is_wrong(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / 'cameras.yaml'
    path.write_text(text, encoding='utf-8')
    with pytest.raises(ParameterError, match=words):
        load_cameras(path)


def test_unknown_camera_lists_the_known() -> None:
    with pytest.raises(ParameterError, match='choose one of none, kinect2_hd'):
        camera_profile(CAMERAS, 'webcam')


def test_fastdds_profile_is_well_formed() -> None:
    from xml.etree import ElementTree

    root = ElementTree.parse(PROJECT / 'config' / 'fastdds.xml').getroot()
    space = {'p': root.tag.partition('}')[0].strip('{')}
    sizes = root.findall('.//p:segment_size', space)
    assert int(sizes[0].text) >= 16 << 20
    assert root.find('.//p:useBuiltinTransports', space).text == 'false'
