# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf simulate``: what it writes can be read, and is what was simulated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import ReadOptions, open_recording
from rgbd_kcf_tracker.recordings.textfiles import read_boxes
from rgbd_kcf_tracker.simulation import SCENARIOS, simulate

SMALL = ['--size', '160x90', '--rate', '2']


def run(*words: object) -> int:
    return main(['simulate', *map(str, words)])


@pytest.mark.parametrize('name', ['walk.mcap', 'walk'])
def test_what_is_written_is_what_was_simulated(tmp_path: Path, name: str) -> None:
    dest = tmp_path / name
    assert run(dest, '--scenario', 'behind_box', '--seed', 3, *SMALL) == 0
    expected = list(simulate('behind_box', 3, 2.0, size=(160, 90)))
    with open_recording(dest, ReadOptions()) as recording:
        frames = list(recording.frames())
        visible, body = recording.groundtruth, recording.groundtruth_body
    assert len(frames) == len(expected)
    assert visible is not None
    assert body is not None
    for frame, box, whole, simulated in zip(frames, visible, body, expected, strict=True):
        assert np.array_equal(frame.color, simulated.frame.color)
        assert frame.stamp_ns == simulated.frame.stamp_ns
        assert frame.intrinsics == simulated.frame.intrinsics
        assert frame.depth is not None
        assert simulated.frame.depth is not None
        assert np.allclose(frame.depth, simulated.frame.depth, atol=6e-4, equal_nan=True)
        assert_same_box(box, simulated.visible)
        assert_same_box(whole, simulated.body)
    assert any(box is None for box in visible)


def assert_same_box(a: Box | None, b: Box | None) -> None:
    if a is None or b is None:
        assert a is b
    else:
        assert np.allclose(a.as_tuple(), b.as_tuple(), atol=0.01)


def test_several_people_are_written_with_ids(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dest = tmp_path / 'room'
    assert run(dest, '--scenario', 'comers', '--seed', 4, '--duration', 12, *SMALL) == 0
    expected = list(simulate('comers', 4, 2.0, 12.0, size=(160, 90)))
    people = list(expected[0].truths)
    assert f'{len(people)} people' in capsys.readouterr().out
    rows = [
        [float(cell) for cell in line.split(',')]
        for line in (dest / 'mot.txt').read_text().splitlines()
    ]
    wanted = [
        (number, person, truth)
        for number, simulated in enumerate(expected, 1)
        for person, truth in simulated.truths.items()
        if truth.shown is not None
    ]
    assert len(rows) == len(wanted)
    for row, (number, person, truth) in zip(rows, wanted, strict=True):
        assert row[:2] == [number, person]
        assert truth.shown is not None
        assert row[2:6] == pytest.approx(truth.shown.as_tuple(), abs=0.01)
        assert row[6] == (truth.visible_fraction >= 0.4)
        assert row[7:] == pytest.approx(truth.position, abs=0.001)
    assert {row[6] for row in rows} == {0.0, 1.0}
    for person in people:
        files = [dest / f'{kind}_{person}.txt' for kind in ('groundtruth', 'body', 'visible')]
        boxes, bodies = read_boxes(files[0]), read_boxes(files[1])
        shares = [float(line.split(',')[0]) for line in files[2].read_text().splitlines()]
        for box, body, share, simulated in zip(boxes, bodies, shares, expected, strict=True):
            truth = simulated.truths[person]
            assert_same_box(box, truth.visible)
            assert_same_box(body, truth.body)
            assert share == pytest.approx(truth.visible_fraction, abs=1e-4)
    with open_recording(dest, ReadOptions()) as recording:  # the target's is that of person 1
        assert recording.groundtruth == read_boxes(dest / 'groundtruth_1.txt')


def test_kinect2_topics(tmp_path: Path) -> None:
    from rosbags.highlevel import AnyReader

    run(tmp_path / 'a.mcap', '--duration', 1, *SMALL)
    with AnyReader([tmp_path / 'a.mcap']) as reader:
        topics = set(reader.topics)
    assert {'/kinect2/qhd/image_color_rect', '/kinect2/qhd/image_depth_rect'} <= topics
    assert {'/kinect2/qhd/camera_info', '/groundtruth/visible', '/groundtruth/body'} <= topics


def test_several_scenes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenes = ['--scenario', 'normal', '--scenario', 'no_depth', '--count', 2, '--seed', 5]
    assert run(tmp_path / 's', *scenes, '--duration', 1, *SMALL) == 0
    names = sorted(path.name for path in (tmp_path / 's').iterdir())
    assert names == ['no_depth_5', 'no_depth_6', 'normal_5', 'normal_6']
    assert not (tmp_path / 's' / 'no_depth_5' / 'depth').exists()
    assert capsys.readouterr().out.count('2 frames at 2 Hz') == 4


def test_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert run('--list') == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(SCENARIOS)
    assert all(len(line.split()) > 3 for line in lines)


def test_nothing_is_overwritten_unasked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    short = ['--duration', 1, *SMALL]
    for dest in (tmp_path / 'a.mcap', tmp_path / 'a'):
        assert run(dest, *short) == 0
        assert run(dest, *short) == 2
        assert '--overwrite' in capsys.readouterr().err
        assert run(dest, *short, '--overwrite', '--scenario', 'no_depth') == 0
        with open_recording(dest, ReadOptions(depth_topic='none')) as recording:
            assert all(frame.depth is None for frame in recording.frames())
    other = tmp_path / 'mine'
    other.mkdir()
    (other / 'thesis.txt').write_text('years of work')
    assert run(other, *short, '--overwrite') == 2
    assert (other / 'thesis.txt').exists()


def test_what_is_not_ours_is_seen_before_the_first_scene(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The scenes before it were rendered and written."""
    words = [tmp_path, '--scenario', 'normal', '--count', 2, '--duration', 1, *SMALL]
    assert run(*words) == 0
    (tmp_path / 'normal_1' / 'thesis.txt').write_text('years of work')
    before = sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob('*'))
    assert run(*words, '--overwrite') == 2
    assert 'thesis.txt' in capsys.readouterr().err
    assert sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob('*')) == before
    (tmp_path / 'normal_1' / 'thesis.txt').unlink()
    assert run(*words, '--overwrite') == 0


@pytest.mark.parametrize('name', ['walk.mcap', 'walk'])
def test_one_frame_is_a_recording(tmp_path: Path, name: str) -> None:
    dest = tmp_path / name
    assert run(dest, '--size', '160x90', '--rate', '0.1', '--duration', '0.1') == 0
    with open_recording(dest, ReadOptions()) as recording:
        assert len(list(recording.frames())) == 1
        assert recording.groundtruth is not None
        assert len(recording.groundtruth) == 1


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (['x.mcap', '--scenario', 'ocean'], 'unknown scenario'),
        (['x.mcap', '--rate', '0'], 'rate'),
        (['x.mcap', '--size', 'big'], '--size'),
        (['x.mcap', '--size', '0x0'], 'size'),
        (['x.mcap', '--duration', '-1'], 'duration'),
        (['x.mcap', '--count', '0'], '--count'),
        (['x', '--count', '999999999999'], '--count is 999999999999: give 1 to 10000'),
        (
            ['x', '--count', '10000', '--scenario', 'normal', '--scenario', 'crowd'],
            'give 1 to 5000',
        ),
        (['--contact-sheet', 'x.jpg', '--count', '1001'], 'give 1 to 1000'),
        (['x.mcap', '--count', '2'], 'name a folder'),
        (['x', '--format', 'mcap'], '.mcap'),
        (['x.bag'], 'bags are written as .mcap'),
        (['x.MCAP'], 'bags are written as .mcap'),
        (['x.db3', '--count', '2'], 'bags are written as .mcap'),
        (['x.mcap', '--color-format', 'png'], '--color-format means nothing for an mcap file'),
        (
            ['x', '--count', '2', '--format', 'mcap', '--color-format', 'jpg'],
            '--color-format means nothing for an mcap file',
        ),
        (['x', '--compression', 'lz4'], '--compression means nothing for a sequence folder'),
        (['--contact-sheet', 'x.jpg', '--format', 'mcap'], '--format means nothing'),
        (['--contact-sheet', 'x.jpg', '--color-format', 'jpg'], '--color-format means nothing'),
        (['--contact-sheet', 'x.jpg', '--compression', 'none'], '--compression means nothing'),
        ([], 'DEST'),
    ],
)
def test_mistakes_are_explained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    words: list[str], message: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert run(*words) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_contact_sheet(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    import cv2

    path = tmp_path / 'sheet.png'
    scenes = ['--scenario', 'behind_box', '--scenario', 'missing_depth', '--scenario', 'no_depth']
    assert run('--contact-sheet', path, *scenes, *SMALL) == 0
    assert 'unsupported' not in capfd.readouterr().err, "OpenCV was given a JPEG's quality"
    sheet = cv2.imread(str(path))
    assert sheet is not None
    height, width = sheet.shape[:2]
    assert width > 3 * 3 * 192
    # green boxes of the visible part are drawn in every scene, in colour and in depth
    green = np.all(sheet == (60, 230, 60), axis=2)
    for tile in range(9):
        assert green[:, tile * width // 9 : (tile + 1) * width // 9].any(), tile
    assert height < 200
    # of several people, the others' boxes are red
    assert run('--contact-sheet', path, '--overwrite', '--scenario', 'group_crossing', *SMALL) == 0
    assert np.all(cv2.imread(str(path)) == (80, 80, 240), axis=2).any()
    assert run('--contact-sheet', tmp_path / 'sheet.gif', *SMALL) == 2


def test_people_and_ids_are_read_back_and_may_be_replaced(tmp_path: Path) -> None:
    words = ['--scenario', 'reunion', '--duration', '1', '--rate', '5', '--size', '160x120']
    dest = tmp_path / 'reunion'
    assert main(['simulate', str(dest), *words]) == 0
    assert main(['simulate', str(dest), *words, '--overwrite']) == 0
    from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, open_dataset

    (written,) = open_dataset(str(dest), DatasetOptions(everyone=True))
    size, rate = (160, 120), 5.0
    options = DatasetOptions(everyone=True, seeds=(0,), rate_hz=rate, duration_s=1.0, size=size)
    (rendered,) = open_dataset('sim:reunion', options)
    for one, other in zip(written.open().samples, rendered.open().samples, strict=True):
        assert [p.id for p in one.people] == [p.id for p in other.people]
        for a, b in zip(one.people, other.people, strict=True):
            assert a.box.iou(b.box) > 0.99
            assert a.counts == b.counts
            assert a.body is not None
            assert b.body is not None
            assert a.body.iou(b.body) > 0.99
