# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Sequence folders in and out, and the text files beside the images."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from bag_rig import CAMERA, assert_same_frames, make_frames

from rgbd_kcf_tracker.errors import ImageError, ParameterError, RecordingError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import ReadOptions, SequenceWriter, open_recording
from rgbd_kcf_tracker.recordings.textfiles import format_box, natural_key, read_boxes

FRAMES = make_frames(4)


def folder(path: Path, count: int = 3, depth: bool = True, suffix: str = '.png') -> Path:
    """A folder of images and nothing else."""
    for frame, number in zip(FRAMES, range(1, count + 1), strict=False):
        for name, image in (('rgb', frame.color), ('depth', frame.depth)):
            if name == 'depth' and not depth:
                continue
            (path / name).mkdir(parents=True, exist_ok=True)
            values: Any = image if name == 'rgb' else np.nan_to_num(image * 1000).astype(np.uint16)
            end = suffix if name == 'rgb' else '.png'
            cv2.imwrite(str(path / name / f'{number:06d}{end}'), values)
    return path


def test_what_is_written_comes_back(tmp_path: Path) -> None:
    with SequenceWriter(tmp_path / 'a') as writer:
        for frame in FRAMES:
            writer.write(frame, Box(1.5, 2.25, 3, 4), None, 0.75)
    with open_recording(tmp_path / 'a') as recording:
        assert_same_frames(list(recording.frames()), FRAMES)
        assert recording.groundtruth == [Box(1.5, 2.25, 3, 4)] * 4
        assert recording.groundtruth_body is None
        assert recording.intrinsics == CAMERA
        assert recording.name == 'a'
    assert (tmp_path / 'a' / 'visible.txt').read_text() == '0.7500\n' * 4


@dataclass(frozen=True)
class Someone:
    """One of several people, as a simulated scene tells of them."""

    shown: Box | None
    visible: Box | None
    body: Box | None
    visible_fraction: float
    position: tuple[float, float, float]


def test_a_frame_is_written_with_its_people_or_not_at_all(tmp_path: Path) -> None:
    clear = Someone(Box(1, 2, 3, 4), Box(1, 2, 3, 4), Box(1, 2, 6, 8), 0.4, (0.5, 0.25, 2))
    scarce = replace(clear, visible=None, visible_fraction=0.1)
    hidden = Someone(None, None, Box(5, 5, 5, 5), 0.0, (0, 0, 3))
    with SequenceWriter(tmp_path / 'a') as writer:
        (writer.output.place / 'body_9.txt').mkdir()
        with pytest.raises(RecordingError, match=r'body_9\.txt cannot be written'):
            writer.write(FRAMES[0], people={7: clear, 8: hidden, 9: scarce})
        (writer.output.place / 'body_9.txt').rmdir()
        for frame in FRAMES:
            writer.write(frame, people={7: clear, 8: hidden, 9: scarce})
    with open_recording(tmp_path / 'a') as recording:
        assert_same_frames(list(recording.frames()), FRAMES)
    for name in ('groundtruth', 'body', 'visible'):
        files = [tmp_path / 'a' / f'{name}_{who}.txt' for who in (7, 8, 9)]
        assert [len(file.read_text().splitlines()) for file in files] == [4] * 3
    assert (tmp_path / 'a' / 'visible_7.txt').read_text() == '0.4000,2000\n' * 4
    assert (tmp_path / 'a' / 'visible_8.txt').read_text() == '0.0000,0\n' * 4
    assert (tmp_path / 'a' / 'mot.txt').read_text().splitlines()[:3] == [
        '1,7,1,2,3,4,1,0.5,0.25,2',
        '1,9,1,2,3,4,0,0.5,0.25,2',
        '2,7,1,2,3,4,1,0.5,0.25,2',
    ]


def test_a_written_folder_is_not_overwritten(tmp_path: Path) -> None:
    with SequenceWriter(tmp_path) as writer:
        writer.write(FRAMES[0])
    with pytest.raises(RecordingError, match='is there already'):
        SequenceWriter(tmp_path)
    (tmp_path / 'thesis.txt').write_text('years of work')
    with pytest.raises(RecordingError, match=r'holds thesis\.txt, which we did not write'):
        SequenceWriter(tmp_path, overwrite=True)
    with pytest.raises(ParameterError, match='png or jpg'):
        SequenceWriter(tmp_path / 'b', 'gif')


def test_colour_alone(tmp_path: Path) -> None:
    with open_recording(folder(tmp_path, depth=False, suffix='.jpg')) as recording:
        frames = list(recording.frames())
        assert [f.depth for f in frames] == [None] * 3
        assert recording.info().frames_with_depth == 0


def test_a_depth_that_is_no_folder_is_told(tmp_path: Path) -> None:
    folder(tmp_path, depth=False)
    (tmp_path / 'depth').write_text('')
    with open_recording(tmp_path) as recording:
        assert recording.warnings == [
            f'{tmp_path / "depth"} is no folder of images: read as colour alone'
        ]


def test_stamps_from_the_rate_from_a_file_and_given_intrinsics(tmp_path: Path) -> None:
    folder(tmp_path)
    with open_recording(tmp_path, ReadOptions(fps=5, intrinsics=CAMERA)) as recording:
        frames = list(recording.frames())
        assert [f.stamp_ns for f in frames] == [0, 200_000_000, 400_000_000]
        assert frames[0].intrinsics == CAMERA
        assert recording.info().rate_hz == pytest.approx(5)
    (tmp_path / 'timestamps.txt').write_text('10\n20\n15\n')
    with open_recording(tmp_path) as recording:
        assert [f.stamp_ns for f in recording.frames()] == [10, 20, 21]
        assert any('1 stamps do not come after' in w for w in recording.warnings)


@pytest.mark.parametrize('fps', [0, -1, float('nan'), float('inf')])
def test_rates_that_cannot_be(fps: float) -> None:
    with pytest.raises(ParameterError, match='fps'):
        ReadOptions(fps=fps)


def test_depth_by_name_and_missing_depth(tmp_path: Path) -> None:
    folder(tmp_path)
    (tmp_path / 'depth' / '000002.png').unlink()
    with open_recording(tmp_path) as recording:
        assert [f.depth is None for f in recording.frames()] == [False, True, False]
        assert any('1 of 3 colour images have no depth' in w for w in recording.warnings)
    with open_recording(tmp_path, ReadOptions(depth_topic='none')) as recording:
        assert all(f.depth is None for f in recording.frames())
    for number, path in enumerate(sorted((tmp_path / 'depth').iterdir())):
        path.rename(path.with_name(f'depth{number}.png'))
    with pytest.raises(RecordingError, match=r'no image in .*depth has the name'):
        open_recording(tmp_path)


@pytest.mark.parametrize('kind', ['color', 'depth', 'info'])
def test_a_folder_has_no_topic_that_could_be_named(tmp_path: Path, kind: str) -> None:
    options = ReadOptions(**{f'{kind}_topic': '/mine'})
    with pytest.raises(RecordingError, match=f'without topics: leave --{kind}-topic /mine out'):
        open_recording(folder(tmp_path), options)


def test_bad_images_are_named(tmp_path: Path) -> None:
    folder(tmp_path)
    (tmp_path / 'depth' / '000002.png').write_bytes(b'\x89PNG\r\n\x1a\nrubbish')
    with open_recording(tmp_path) as recording:
        assert [f.depth is None for f in recording.frames()] == [False, True, False]
        assert any('000002.png' in w for w in recording.warnings)
    (tmp_path / 'rgb' / '000003.png').write_bytes(b'')
    with open_recording(tmp_path) as recording, pytest.raises(ImageError, match=r'000003\.png'):
        list(recording.frames())
    (tmp_path / 'rgb' / '000003.png').unlink()
    cv2.imwrite(str(tmp_path / 'depth' / '000001.png'), np.ones((5, 6), np.uint16))
    with (
        open_recording(tmp_path) as recording,
        pytest.raises(ImageError, match=r'000001\.png: depth is 6x5 but colour is 64x48'),
    ):
        list(recording.frames())


def test_depth_of_eight_bits_is_no_depth(tmp_path: Path) -> None:
    """An error at once, as all images will be like that, not a warning for each."""
    folder(tmp_path)
    cv2.imwrite(str(tmp_path / 'depth' / '000001.png'), np.ones((48, 64), np.uint8))
    with (
        open_recording(tmp_path) as recording,
        pytest.raises(ImageError, match=r'000001\.png: depth PNG has 1 channels of 8 bits'),
    ):
        list(recording.frames())


def test_damage_to_a_depth_image_is_not_taken_for_another_form(tmp_path: Path) -> None:
    """A message's RVL has no mark of its own, so that any bytes could be it; no file is."""
    folder(tmp_path)
    path = tmp_path / 'depth' / '000002.png'
    path.write_bytes(b'\0' + path.read_bytes()[1:])
    with open_recording(tmp_path) as recording:
        assert [f.depth is None for f in recording.frames()] == [False, True, False]
        (warning,) = recording.warnings
    assert '000002.png' in warning
    assert 'neither JPEG, PNG nor TIFF' in warning


@pytest.mark.parametrize('name', ['timestamps.txt', 'groundtruth.txt', 'camera_info.json'])
def test_a_file_that_was_not_fetched_is_not_guessed(name: str, tmp_path: Path) -> None:
    """A link that leads to nothing, as of a file that is kept elsewhere."""
    (folder(tmp_path) / name).symlink_to(tmp_path / 'elsewhere' / name)
    with pytest.raises(RecordingError, match=f'{name} leads to nothing: it is a link'):
        open_recording(tmp_path)


def test_no_images(tmp_path: Path) -> None:
    (tmp_path / 'rgb').mkdir()
    with pytest.raises(RecordingError, match='holds no images'):
        open_recording(tmp_path)


@pytest.mark.parametrize(
    ('name', 'text', 'words'),
    [
        ('timestamps.txt', '1\n2\n', 'has 2 lines for 3 images'),
        ('timestamps.txt', '1\nx\n3\n', r'timestamps.txt, line 2'),
        ('timestamps.txt', '1\n\n3\n', r'timestamps.txt, line 2'),
        ('timestamps.txt', '-1\n2\n3\n', r'timestamps.txt, line 1'),
        ('timestamps.txt', f'1\n2\n{10**30}\n', r'timestamps.txt, line 3'),
        ('groundtruth.txt', '1,2,3,4\n1,2,3\n', 'groundtruth.txt, line 2.*is no box'),
        ('groundtruth.txt', 'a,b,c,d\n', 'line 1'),
        ('groundtruth.txt', '\xff\xfe', 'not a text file'),
        ('intrinsics.json', '{"fx": 1}', r'holds no intrinsics \(fy is missing\): write'),
        ('intrinsics.json', '[1, 2]', r'holds no intrinsics \(it is no JSON object\): write'),
        ('intrinsics.json', f'{{"fx": 1{"0" * 400}}}', "fx is '1000.*', no number of pixels"),
        ('intrinsics.json', f'{{"fx": 1{"0" * 5000}}}', 'a number has thousands of digits'),
        ('intrinsics.json', '{"fx": -5, "fy": 1, "cx": 1, "cy": 1}', 'focal lengths'),
        ('intrinsics.json', 'nothing', r'holds no intrinsics \(line 1 is no JSON\): write'),
    ],
)
def test_bad_text_files_are_named(name: str, text: str, words: str, tmp_path: Path) -> None:
    folder(tmp_path)
    (tmp_path / name).write_bytes(text.encode('latin-1'))
    with pytest.raises(RecordingError, match=words):
        open_recording(tmp_path)


def test_ground_truth_in_any_common_form(tmp_path: Path) -> None:
    text = '1,2,3,4\n1\t2\t3\t4\r\n1 2 3 4\n1; 2; 3; 4\nnan,nan,nan,nan\n0,0,0,0\nNaN NaN NaN NaN\n'
    (tmp_path / 'a.txt').write_text('\ufeff' + text + '\n\n', encoding='utf-8')
    box = Box(1, 2, 3, 4)
    assert read_boxes(tmp_path / 'a.txt') == [box, box, box, box, None, None, None]


def test_a_polygon_is_its_upright_box(tmp_path: Path) -> None:
    (tmp_path / 'a.txt').write_text('5,0,10,5,5,10,0,5\n1,2,9,2,5,8\n' + ','.join(['nan'] * 8))
    assert read_boxes(tmp_path / 'a.txt') == [Box(0, 0, 10, 10), Box(1, 2, 8, 6), None]


def test_ground_truth_of_another_length(tmp_path: Path) -> None:
    folder(tmp_path)
    (tmp_path / 'groundtruth.txt').write_text('1,2,3,4\n')
    with open_recording(tmp_path) as recording:
        assert recording.groundtruth == [Box(1, 2, 3, 4)]
        assert any('taken as not annotated' in w for w in recording.warnings)
    (tmp_path / 'groundtruth.txt').write_text('1,2,3,4\n' * 5)
    with open_recording(tmp_path) as recording:
        assert recording.groundtruth == [Box(1, 2, 3, 4)] * 3
        assert any('5 lines for 3 images' in w for w in recording.warnings)


@pytest.mark.parametrize('lost', [1, 2, 3])
def test_truth_by_number_is_left_out_where_an_image_is_missing(lost: int, tmp_path: Path) -> None:
    folder(tmp_path, count=4)
    boxes = ''.join(f'{number},2,3,4\n' for number in range(1, 5))
    for name in ('groundtruth.txt', 'groundtruth_body.txt'):
        (tmp_path / name).write_text(boxes)
    missing = tmp_path / 'rgb' / f'{lost:06d}.png'
    missing.unlink()
    with open_recording(tmp_path) as recording:
        assert recording.groundtruth is None
        assert recording.groundtruth_body is None
        told = [w for w in recording.warnings if f'{missing} is missing' in w]
        assert [w.split()[0] for w in told] == ['groundtruth.txt', 'groundtruth_body.txt']
    (tmp_path / 'timestamps.txt').write_text('1\n2\n3\n4\n')
    with pytest.raises(RecordingError, match=f'000{lost:03d}.png is missing'):
        open_recording(tmp_path)


def test_what_is_missing_at_the_end_shifts_no_truth(tmp_path: Path) -> None:
    folder(tmp_path, count=4)
    (tmp_path / 'groundtruth.txt').write_text('1,2,3,4\n' * 4)
    (tmp_path / 'rgb' / '000004.png').unlink()
    with open_recording(tmp_path) as recording:
        assert recording.groundtruth == [Box(1, 2, 3, 4)] * 3


def test_an_image_without_a_number_among_others_has_no_line(tmp_path: Path) -> None:
    folder(tmp_path)
    (tmp_path / 'rgb' / '000002.png').rename(tmp_path / 'rgb' / 'second.png')
    (tmp_path / 'groundtruth.txt').write_text('1,2,3,4\n' * 3)
    with open_recording(tmp_path) as recording:
        assert recording.groundtruth is None
        assert any('second.png has no number in its name' in w for w in recording.warnings)
    (tmp_path / 'timestamps.txt').write_text('1\n2\n3\n')
    with pytest.raises(RecordingError, match=r'second\.png has no number'):
        open_recording(tmp_path)


def test_boxes_are_written_to_a_thousandth() -> None:
    assert format_box(Box(367.8, 1234.5678, 33.8, 4)) == '367.8,1234.568,33.8,4'
    assert format_box(None) == 'nan,nan,nan,nan'


def test_numbers_are_sorted_as_numbers() -> None:
    names = ['10.png', '9.png', 'a10', 'a9', '0009.png', 'b']
    assert sorted(names, key=natural_key) == ['9.png', '0009.png', '10.png', 'a9', 'a10', 'b']


def test_every_shared_sequence_reads(shared_data: Path) -> None:
    paths = sorted(path.parent for path in shared_data.glob('*/*/rgb'))
    assert {'rgbd', 'otb'} <= {path.parent.name for path in paths}
    for path in paths:
        with open_recording(path) as recording:
            truth = recording.groundtruth
            assert (truth is not None) == (path / 'groundtruth.txt').is_file(), path
            assert truth is None or len(truth) == len(recording), path
            frame = next(recording.frames())
            assert (frame.depth is not None) == (path / 'depth').is_dir(), path


def test_a_warning_of_a_frame_is_told_once_however_often_it_is_read(tmp_path: Path) -> None:
    folder(tmp_path)
    (tmp_path / 'depth' / '000002.png').write_bytes(b'no image')
    with open_recording(tmp_path) as recording:
        for _ in range(3):
            list(recording.frames())
        assert len(recording.warnings) == 1


def test_names_with_digits_that_are_no_numbers_are_sorted() -> None:
    names = ['1\u00b23.png', '2.png', '10.png', '1.png']
    assert sorted(names, key=natural_key)[-2:] == ['2.png', '10.png']
