# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Start and end of the executables: what they are told, and when they are told to stop."""

from __future__ import annotations

import ast
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node

from rgbd_kcf_tracker.ros import (
    follow_main,
    follow_node,
    replay_main,
    replay_node,
    tracker_main,
    tracker_node,
    viewer_main,
)
from rgbd_kcf_tracker.ros.process import spin

pytestmark = pytest.mark.ros

DOCS = Path(__file__).resolve().parent.parent / 'docs'
MAINS = {
    'tracker': tracker_main.main,
    'replay': replay_main.main,
    'follow': follow_main.main,
}
if find_spec('aiohttp') is not None:
    MAINS['viewer'] = viewer_main.main


@pytest.mark.usefixtures('_process')
@pytest.mark.parametrize('program', MAINS)
@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        ('--ros-args --params-file /nowhere.yaml', 'Error opening YAML file'),
        ('--ros-args -r __node:=bad/name', "Couldn't parse remap rule"),
        ('--ros-args -r __ns:=bad', "Couldn't parse remap rule"),
        ('--ros-args -r nothing', "Couldn't parse remap rule"),
        ('--ros-args -p bag:=', "Couldn't parse parameter override rule"),
        ('--ros-args --log-level loud', "Couldn't parse log level"),
        ('--ros-args --magic', "['--magic']"),
        ('walk.mcap', "unknown argument 'walk.mcap'"),
        ('--ros-args -p use_sim_time:=5', 'use_sim_time must be true or false'),
        ('--ros-args -p speed:=1.0 -p zzz:=1', "unknown parameter 'speed'"),
    ],
)
def test_what_cannot_be_understood_is_refused(
    program: str, arguments: str, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert MAINS[program](arguments.split()) == 2
    said = capfd.readouterr().err
    (line,) = [line for line in said.splitlines() if line.startswith(f'{program}: ')]
    assert words in line
    assert 'Traceback' not in said
    assert '/src/' not in line


@pytest.mark.usefixtures('_process')
@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        ('variatn:=kcf', "unknown parameter 'variatn': did you mean 'variant'?"),
        ('kcf.padding_:=1.0', "did you mean 'kcf.padding'?"),
        ('kcf.learning_rate:=7.5', 'learning_rate is 7.5: it must be between 0 and 1'),
        ('pair_tolerance:="soon"', 'pair_tolerance'),
        ('variant:=3', 'variant'),
        ('metric.embedding:=/none.onnx', "metric.embedding: there is no file '/none.onnx'"),
        ('variant:=[]', 'parameter variant is an empty list'),
        ('auto_init_far:=0.3', 'auto_init_near is 0.5 and auto_init_far 0.3: nobody is between'),
        ('init_box:="1,2,3"', 'give x,y,width,height'),
        ('init_box:="nan,2,3,4"', 'box x is nan: it must be finite: give x,y,width,height'),
        (
            'qos_overrides./color/image.subscription.reliability:=magic',
            "/color/image.subscription.reliability is 'magic': choose one of system_default, ",
        ),
        (
            'qos_overrides./depth/image.subscription.reliability:=1',
            '/depth/image.subscription.reliability is 1: it must be text',
        ),
        (
            'qos_overrides./color/camera_info.subscription.history:=keep_some',
            "history is 'keep_some': choose one of system_default, keep_last, keep_all",
        ),
        (
            'qos_overrides./color/image.subscription.depth:=ten',
            "subscription.depth is 'ten': it must be a whole number, between 1 and 1000",
        ),
        (
            'qos_overrides./depth/image.subscription.depth:=3000000000',
            'subscription.depth is 3000000000: it must be between 1 and 1000',
        ),
    ],
)
def test_a_tracker_refuses_wrong_parameters(
    arguments: str, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert tracker_main.main(['--ros-args', '-p', arguments]) == 2
    assert words in capfd.readouterr().err


@pytest.mark.usefixtures('_process')
@pytest.mark.parametrize(
    ('said', 'told'), [('', 'ValueError'), ('no such thing\nbut these:\n1. a', 'no such thing')]
)
def test_why_it_cannot_start_is_one_line_and_not_none(
    said: str, told: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rgbd_kcf_tracker.ros import tracker_node

    def broken(*_: object, **__: object) -> None:
        raise ValueError(said)

    monkeypatch.setattr(tracker_node, 'Subscriptions', broken)
    assert tracker_main.main(['--ros-args']) == 2
    assert capfd.readouterr().err.splitlines()[-1] == f'tracker: cannot activate: {told}'


@pytest.mark.usefixtures('_process')
def test_colour_and_depth_on_one_topic_are_refused(capfd: pytest.CaptureFixture[str]) -> None:
    assert tracker_main.main(['--ros-args', '-r', 'color/image:=depth/image']) == 2
    line = capfd.readouterr().err.splitlines()[-1]
    assert 'color/image and depth/image are both /depth/image: remap each' in line


@pytest.mark.usefixtures('_process')
@pytest.mark.parametrize(
    ('program', 'name', 'value'),
    [
        ('viewer', 'tracker', "'bad name!'"),
        ('viewer', 'tracker', "''"),
        ('viewer', 'tracker', '/'),
        ('follow', 'tracker', "'bad name'"),
        ('follow', 'pose_topic', "'/pose/'"),
        ('follow', 'action', "'9x y'"),
        ('replay', 'answer_topic', "'9x y'"),
    ],
)
def test_what_is_no_name_is_refused(
    program: str, name: str, value: str, capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    if program not in MAINS:
        pytest.skip("needs pip install '.[view]'")
    monkeypatch.setattr('rgbd_kcf_tracker.ros.process.spin', pytest.fail)
    monkeypatch.setattr(follow_node, 'action_type', lambda: None)
    assert MAINS[program](['--ros-args', '-p', f'{name}:={value}']) == 2
    (line,) = capfd.readouterr().err.splitlines()
    text = value.strip("'")
    begin = f'{program}: parameter {name} is {text!r}, which is no name in ROS (must not '
    assert line.startswith(begin)
    assert ': give one such as /' in line


@pytest.mark.usefixtures('_process')
def test_the_manual_quotes_what_is_said(capfd: pytest.CaptureFixture[str]) -> None:
    manual = (DOCS / 'troubleshooting.md').read_text(encoding='utf-8')
    for arguments in ('variatn:=kcf', 'kcf.learning_rate:=7.5'):
        assert tracker_main.main(['--ros-args', '-p', arguments]) == 2
        line = capfd.readouterr().err.splitlines()[-1]
        assert f'`{line.removeprefix("tracker: ")}`' in manual


@pytest.mark.usefixtures('_process')
def test_all_that_is_wrong_is_said_at_once(capfd: pytest.CaptureFixture[str]) -> None:
    wrong = ['-p', 'variatn:=kcf', '-p', 'qos_depth:=0', '-p', 'autostart:=7']
    assert tracker_main.main(['--ros-args', *wrong]) == 2
    line = capfd.readouterr().err.splitlines()[-1]
    assert all(name in line for name in ('variatn', 'qos_depth', 'autostart'))


@pytest.mark.usefixtures('_process')
@pytest.mark.parametrize('program', MAINS)
@pytest.mark.parametrize(
    'arguments', ['--help', '-h', '--ros-args -h', '--ros-args -p x:=1 --help']
)
def test_help_starts_nothing(
    program: str,
    arguments: str,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(rclpy, 'init', pytest.fail)
    assert MAINS[program](arguments.split()) == 0
    said = capfd.readouterr()
    assert said.out.startswith(f'usage: {program}')
    assert said.err == ''


def stop_after(seconds: float, wait: Callable[[subprocess.Popen[str]], None]) -> tuple[int, str]:
    process = subprocess.Popen(
        [sys.executable, '-m', 'rgbd_kcf_tracker.ros.tracker_main'],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    wait(process)
    time.sleep(seconds)
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    return process.returncode, output


def maps(pid: int) -> str:
    return Path(f'/proc/{pid}/maps').read_text(encoding='utf-8')


@pytest.mark.parametrize('library', ['multiarray', 'cv2', '_rclpy_pybind11', 'librmw_fastrtps_cpp'])
def test_interrupted_while_it_starts_it_ends_without_a_word(library: str) -> None:
    """At the moments when it has just loaded one library or another."""

    def loaded(process: subprocess.Popen[str]) -> None:
        end = time.monotonic() + 60
        while library not in maps(process.pid):
            assert process.poll() is None
            assert time.monotonic() < end
            time.sleep(0.002)

    status, output = stop_after(0.0, loaded)
    assert status == 0, output
    assert 'Traceback' not in output


def test_what_raises_at_any_rate_is_logged_now_and_then(capfd: pytest.CaptureFixture[str]) -> None:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(os.environ['ROS_DOMAIN_ID']))
    node, executor = Node('raises', context=context), SingleThreadedExecutor(context=context)
    raised: list[ValueError] = []

    def wrong() -> None:
        raised.append(ValueError('wrong'))
        raise raised[-1]

    node.create_timer(0.001, wrong)
    executor.add_node(node)
    spin(executor, node, lambda: len(raised) > 50)
    node.destroy_node()
    rclpy.shutdown(context=context)
    assert capfd.readouterr().err.count('ValueError: wrong') == 1


def test_nodes_use_only_what_rclpy_makes_public() -> None:
    """A private member that another release names otherwise would stop the node."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(os.environ['ROS_DOMAIN_ID']))
    bare = LifecycleNode('bare', context=context)
    theirs = {name for name in dir(bare) if name.startswith('_') and not name.startswith('__')}
    bare.destroy_node()
    rclpy.shutdown(context=context)
    for module in (tracker_node, replay_node):
        tree = ast.parse(Path(module.__file__).read_text(encoding='utf-8'))
        used = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        assert not used & theirs
        assert not any(
            isinstance(node, ast.Constant) and node.value in theirs for node in ast.walk(tree)
        )
