# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Readers of every benchmark's folders, on small folders in the true format, and on real data."""

from __future__ import annotations

import pickle
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.io import savemat

from rgbd_kcf_tracker.batch.content import files_digest
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import DatasetError, RecordingError, RgbdKcfError
from rgbd_kcf_tracker.evaluation.datasets import DatasetOptions, open_dataset
from rgbd_kcf_tracker.evaluation.datasets.base import (
    Sample,
    at_rate,
    from_first_view,
    with_intrinsics,
    without_depth,
)
from rgbd_kcf_tracker.evaluation.datasets.images import unrotate
from rgbd_kcf_tracker.evaluation.datasets.simulated import find, parse_seeds
from rgbd_kcf_tracker.evaluation.datasets.vot import parse_region
from rgbd_kcf_tracker.evaluation.runner import identify
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings import BagWriter, SequenceWriter, open_recording

WIDTH, HEIGHT = 64, 48


def write_images(folder: Path, names: list[str], depth_mm: int | None = None) -> None:
    """Colour images whose blue tells their number, or flat 16-bit depth images."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, name in enumerate(names):
        if depth_mm is None:
            image = np.full((HEIGHT, WIDTH, 3), (10 * number, 100, 100), np.uint8)
        else:
            image = np.full((HEIGHT, WIDTH), depth_mm + number, np.uint16)
            image[0, 0] = 0
        assert cv2.imwrite(str(folder / name), image)


def numbered(count: int, digits: int, suffix: str, start: int = 1) -> list[str]:
    return [f'{i:0{digits}d}{suffix}' for i in range(start, start + count)]


def only(path: Path, **options) -> list[Sample]:
    (sequence,) = open_dataset(str(path), DatasetOptions(**options))
    assert pickle.loads(pickle.dumps(sequence)) == sequence, 'it is sent to another process'
    opened = sequence.open()
    samples = list(opened.samples)
    assert opened.length == len(samples)
    return samples


def error_of(path: Path, **options) -> str:
    with pytest.raises(RgbdKcfError) as caught:
        only(path, **options)
    return str(caught.value)


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Our layout: 4 frames at a rate that only the stamps tell."""
    path = tmp_path / 'walk'
    write_images(path / 'rgb', numbered(4, 6, '.png'))
    write_images(path / 'depth', numbered(4, 6, '.png'), 1500)
    (path / 'groundtruth.txt').write_text('1,2,10,20\n2,2,10,20\nnan,nan,nan,nan\n4,2,10,20\n')
    (path / 'timestamps.txt').write_text('100\n200\n300\n500\n')
    (path / 'intrinsics.json').write_text('{"fx": 50, "fy": 51, "cx": 32, "cy": 24}')
    return path


def test_our_layout(own: Path):
    samples = only(own)
    assert [s.visible for s in samples] == [Box(1, 2, 10, 20), Box(2, 2, 10, 20), None,
                                            Box(4, 2, 10, 20)]  # fmt: skip
    assert [s.frame.stamp_ns for s in samples] == [100, 200, 300, 500]
    frame = samples[1].frame
    assert frame.color[0, 0].tolist() == [10, 100, 100]
    assert frame.depth[5, 5] == pytest.approx(1.501)
    assert np.isnan(frame.depth[0, 0]), 'depth 0 is no reading'
    assert frame.intrinsics.fy == 51


def test_our_layout_starts_where_the_target_is_clearly_in_view(own: Path):
    (own / 'visible.txt').write_text('0.3,1000\n0.6,1000\n0,0\n1,1000\n')
    (own / 'groundtruth_body.txt').write_text('1,2,10,30\n' * 4)
    samples = only(own)
    assert len(samples) == 3
    assert samples[0].visible == Box(2, 2, 10, 20)
    assert samples[0].fraction == 0.6
    assert samples[0].body == Box(1, 2, 10, 30)


@pytest.mark.parametrize('name', ['visible.txt', 'groundtruth_body.txt', 'timestamps.txt'])
def test_a_file_that_was_not_fetched_is_not_passed_over(own: Path, name: str):
    (own / name).unlink(missing_ok=True)
    (own / name).symlink_to(own / 'elsewhere')
    assert f'{name} leads to nothing' in error_of(own)


@pytest.mark.parametrize('share', ['-0.1', '1.01', '1000', 'nan'])
def test_a_visible_share_that_cannot_be_is_named(own: Path, share: str):
    (own / 'visible.txt').write_text(f'1\n{share}\n0\n1\n')
    assert f'visible.txt, line 2: {share!r}: write the visible share, 0 to 1' in error_of(own)


def test_a_sequence_is_another_one_when_its_files_change(own: Path):
    digests = []
    for change in (lambda: None, lambda: write_images(own / 'rgb', ['000005.png']),
                   lambda: (own / 'groundtruth.txt').write_text('1,2,10,20\n' * 4)):  # fmt: skip
        change()
        (sequence,), _ = identify(open_dataset(str(own)), [])
        assert sequence.digest == files_digest(sequence.content)
        digests.append(sequence.digest)
    assert len(set(digests)) == 3


def test_several_people_in_one_folder(tmp_path: Path):
    path = tmp_path / 'room'
    write_images(path / 'rgb', numbered(40, 6, '.png'))
    absent = 'nan,nan,nan,nan\n'
    (path / 'groundtruth.txt').write_text('1,1,9,9\n' * 40)
    (path / 'groundtruth_ann.txt').write_text(absent * 2 + '1,1,9,9\n' * 8 + absent * 30)
    (path / 'groundtruth_bob.txt').write_text('2,2,9,9\n' * 40)
    (path / 'visible_ann.txt').write_text('0\n' * 2 + '0.2\n' + '0.9\n' * 7 + '0\n' * 30)
    ann, bob = open_dataset(str(path))
    assert [ann.name, bob.name] == ['room/ann', 'room/bob']
    assert ann.scenario == 'room'
    opened = ann.open()
    samples = list(opened.samples)
    # clear in frame 3, last seen in frame 9, 15 more
    assert (opened.start, len(samples), opened.total) == (3, 9 + 15 - 3 + 1, 40)
    assert samples[0].frame.color[0, 0, 0] == 30
    assert len(list(bob.open().samples)) == 40
    assert not opened.has_body
    (ann, bob), _ = identify([ann, bob], [])
    (path / 'body_ann.txt').write_text('0,0,19,29\n' * 40)
    (with_body, bob_again), _ = identify(open_dataset(str(path)), [])
    assert with_body.digest != ann.digest
    assert bob_again.digest == bob.digest
    opened = with_body.open()
    assert opened.has_body
    assert {s.body for s in opened.samples} == {Box(0, 0, 19, 29)}


def test_scenes_that_simulate_wrote_are_grouped_by_scenario(own: Path):
    target = own.rename(own.parent / 'long_occlusion_12')
    (sequence,) = open_dataset(str(target.parent))
    assert (sequence.name, sequence.scenario) == ('long_occlusion_12', 'long_occlusion')


def test_where_a_recording_that_was_named_lies_says_nothing(own: Path):
    target = own.rename(own.parent / 'face')  # a scenario whose target is no person
    bag = target.parent / 'walk.mcap'
    bag.write_bytes(b'')
    everyone = DatasetOptions(everyone=True)
    for path, options in ((target, None), (bag, None), (target, everyone)):
        if options:
            (path / 'groundtruth.txt').rename(path / 'groundtruth_1.txt')
        (named,) = open_dataset(str(path), options)
        found = [s for s in open_dataset(str(path.parent), options) if s.path == path]
        assert [named.scenario, *(s.scenario for s in found)] == ['-', path.parent.name]
    numbered = target.rename(target.with_name('walk_1'))
    (numbered / 'groundtruth_1.txt').rename(numbered / 'groundtruth.txt')
    assert [s.scenario for s in open_dataset(str(numbered))] == ['walk'], 'its own name tells'


@pytest.mark.parametrize('delimiter', [',', '\t', ' ', ', ', ';'])
def test_otb_boxes_are_1_based_whatever_parts_them(tmp_path: Path, delimiter: str):
    path = tmp_path / 'Car'
    write_images(path / 'img', numbered(3, 4, '.jpg'))
    lines = [
        delimiter.join(map(str, box)) for box in ((1, 1, 10, 20), (2, 3, 10, 20), (3, 5, 9, 9))
    ]
    (path / 'groundtruth_rect.txt').write_text('\r\n'.join(lines) + '\r\n')
    samples = only(path)
    assert [s.visible for s in samples] == [Box(0, 0, 10, 20), Box(1, 2, 10, 20), Box(2, 4, 9, 9)]
    assert samples[0].frame.depth is None


def test_otb_sequence_with_two_targets(tmp_path: Path):
    path = tmp_path / 'Jogging'
    write_images(path / 'img', numbered(2, 4, '.jpg'))
    for target in (1, 2):
        (path / f'groundtruth_rect.{target}.txt').write_text(f'{target},1,5,5\n' * 2)
    names = [s.name for s in open_dataset(str(tmp_path))]
    assert names == ['Jogging-1', 'Jogging-2']


def test_otb_sequence_annotated_in_part(tmp_path: Path):
    path = tmp_path / 'BlurCar3'  # annotated are images 3 to 359
    write_images(path / 'img', numbered(359, 4, '.png'))
    (path / 'groundtruth_rect.txt').write_text(''.join(f'{i},1,5,5\n' for i in range(1, 358)))
    (sequence,) = open_dataset(str(path))
    opened = sequence.open()
    first = next(iter(opened.samples))
    assert opened.length == 357
    assert first.frame.color[0, 0, 0] == 20, 'image 3'
    assert first.visible == Box(0, 0, 5, 5)


def test_otb_annotations_and_images_of_different_number(tmp_path: Path):
    path = tmp_path / 'Car'
    write_images(path / 'img', ['0001.jpg', '0002.jpg', '0004.jpg'])
    truth = path / 'groundtruth_rect.txt'
    truth.write_text('1,1,5,5\n' * 4)
    message = error_of(path)
    assert f'{truth}, line 4' in message
    assert 'img/0003.jpg is missing' in message
    truth.write_text('1,1,5,5\n' * 2)
    assert f'{truth}, line 2: the file ends here' in error_of(path)
    (path / 'img' / '0002.jpg').rename(path / 'img' / 'two.jpg')
    truth.write_text('1,1,5,5\n' * 3)
    assert 'two.jpg has no number in its name, as other images there have' in error_of(path)


def test_a_line_that_is_no_box_is_named(tmp_path: Path):
    path = tmp_path / 'Car'
    write_images(path / 'img', numbered(2, 4, '.jpg'))
    (path / 'groundtruth_rect.txt').write_text('1,1,5,5\n1,x,5,5\n')
    assert 'groundtruth_rect.txt, line 2' in error_of(path)


@pytest.mark.parametrize('kind', ['auto', 'vot', 'cdtb', 'depthtrack'])
def test_vot_cdtb_and_depthtrack_folders(tmp_path: Path, kind: str):
    path = tmp_path / 'cup01'
    write_images(path / 'color', numbered(3, 8, '.jpg'))
    write_images(path / 'depth', numbered(3, 8, '.png'), 2000)
    (path / 'groundtruth.txt').write_text('5.5,6.5,10,20\nnan,nan,nan,nan\n7,8,10,20\n')
    (path / 'sequence').write_text(
        'channels.color=color/%08d.jpg\nchannels.depth=depth/%08d.png\nfps=10\nname=cup01\n'
    )
    samples = only(path, kind=kind)
    assert [s.visible for s in samples] == [Box(5.5, 6.5, 10, 20), None, Box(7, 8, 10, 20)]
    assert samples[2].frame.depth[3, 3] == pytest.approx(2.002)
    assert samples[1].frame.stamp_ns == 100_000_000


def test_old_vot_folder_with_images_beside_the_truth(tmp_path: Path):
    path = tmp_path / 'bag'
    write_images(path, numbered(2, 8, '.jpg'))
    (path / 'groundtruth.txt').write_text('10,10,30,10,30,20,10,20\n12,10,32,10,32,20,12,20\n')
    assert [s.visible for s in only(path)] == [Box(10, 10, 20, 10), Box(12, 10, 20, 10)]


def test_vot_regions():
    assert parse_region('1,2,3,4') == Box(1, 2, 3, 4)
    assert parse_region('0') is None
    assert parse_region('nan,nan,nan,nan') is None
    assert parse_region('5,0,10,5,5,10,0,5') == Box(0, 0, 10, 10)
    # a 4x3 mask at 10,20: 5 outside, 2 inside (row 1, columns 1 and 2), 5 outside
    assert parse_region('m10,20,4,3,5,2,5') == Box(11, 21, 2, 1)
    # 2 outside, then 6 inside run over the row's end: the whole width
    assert parse_region('m0,0,4,3,2,6,4') == Box(0, 0, 4, 2)
    for bad in ('1,2,3', 'm1,2', 'words', '1,2,3,4,5'):
        with pytest.raises(ValueError):
            parse_region(bad)


@pytest.mark.parametrize('fps', ['0', 'nan', '-30', 'inf', '1e-9', 'many'])
def test_a_vot_rate_that_cannot_be_is_named(tmp_path: Path, fps: str):
    path = tmp_path / 'cup01'
    write_images(path / 'color', numbered(2, 8, '.jpg'))
    (path / 'groundtruth.txt').write_text('5,6,10,20\n' * 2)
    (path / 'sequence').write_text(f'fps={fps}\n')
    assert f'{path / "sequence"}: fps is {fps!r}: give a number from 0.001' in error_of(path)


def test_vot_depth_images_missing(tmp_path: Path):
    path = tmp_path / 'cup01'
    write_images(path / 'color', numbered(3, 8, '.jpg'))
    write_images(path / 'depth', numbered(2, 8, '.png'), 2000)
    (path / 'groundtruth.txt').write_text('5,6,10,20\n' * 3)
    assert str(path / 'depth') in error_of(path)


def rotated(millimetres: int) -> int:
    """As Princeton stores depth."""
    return ((millimetres << 3) | (millimetres >> 13)) & 0xFFFF


@pytest.mark.parametrize('millimetres', [0, 1, 1234, 8191, 8192, 65535])
def test_princeton_depth_is_rotated_back(millimetres: int):
    stored = np.array([[rotated(millimetres)]], np.uint16)
    assert unrotate(stored).tolist() == [[millimetres]]
    assert unrotate(stored).dtype == np.uint16


@pytest.fixture
def princeton(tmp_path: Path) -> Path:
    path = tmp_path / 'bear_front'
    stamps, ids = [1000, 34000, 67000], [1, 2, 4]
    depth_stamps, depth_ids = [900, 33900, 66900], [2, 3, 5]
    for folder in ('rgb', 'depth'):
        (path / folder).mkdir(parents=True)
    for n, (stamp, number) in enumerate(zip(stamps, ids, strict=True)):
        image = np.full((HEIGHT, WIDTH, 3), (10 * n, 1, 1), np.uint8)
        cv2.imwrite(str(path / 'rgb' / f'r-{stamp}-{number}.png'), image)
    for stamp, number in zip(depth_stamps, depth_ids, strict=True):
        image = np.full((HEIGHT, WIDTH), rotated(2500), np.uint16)
        cv2.imwrite(str(path / 'depth' / f'd-{stamp}-{number}.png'), image)
    savemat(path / 'frames.mat', {'frames': {
        'length': 3, 'K': np.array([[575.8, 0, 320], [0, 575.8, 240], [0, 0, 1.0]]),
        'imageTimestamp': stamps, 'imageFrameID': ids,
        'depthTimestamp': depth_stamps, 'depthFrameID': depth_ids,
    }})  # fmt: skip
    (path / 'bear_front.txt').write_text('10,11,20,30,0\nNaN,NaN,NaN,NaN,1\n12,11,20,30,0\n')
    (path / 'init.txt').write_text('10,11,20,30\n')
    return path


def test_princeton_folder(princeton: Path):
    samples = only(princeton)
    assert [s.visible for s in samples] == [Box(10, 11, 20, 30), None, Box(12, 11, 20, 30)]
    assert [s.frame.stamp_ns for s in samples] == [1_000_000, 34_000_000, 67_000_000]
    assert samples[2].frame.color[0, 0, 0] == 20
    assert samples[0].frame.depth[9, 9] == pytest.approx(2.5)
    assert samples[0].frame.intrinsics.fx == 575.8


def test_princeton_test_set_has_only_its_first_box(princeton: Path):
    (princeton / 'bear_front.txt').unlink()
    (sequence,) = open_dataset(str(princeton))
    opened = sequence.open()
    assert not opened.annotated
    assert next(iter(opened.samples)).visible == Box(10, 11, 20, 30)


def test_princeton_categories(princeton: Path):
    table = princeton.parent / 'categories.csv'
    head = 'sequence,target type,target size,movement,occlusion,motion type\n'
    table.write_text(head + 'bear_front,rigid,large,slow,yes,passive\n')
    (sequence,) = open_dataset(str(princeton.parent))
    assert sequence.categories['occlusion'] == 'yes'
    table.write_text(head + 'bear_front,rigid,huge,slow,yes,passive\n')
    with pytest.raises(DatasetError, match=r"categories.csv, line 2: target size is 'huge'"):
        open_dataset(str(princeton.parent))


def test_princeton_images_missing(princeton: Path):
    (princeton / 'depth' / 'd-33900-3.png').unlink()
    assert 'depth/d-33900-3.png is missing' in error_of(princeton)


def test_princeton_frames_mat_broken(princeton: Path):
    (princeton / 'frames.mat').write_bytes(b'not a mat file')
    assert 'frames.mat cannot be read' in error_of(princeton)
    savemat(princeton / 'frames.mat', {'frames': {'length': 3}})
    assert 'imageTimestamp' in error_of(princeton)


def test_a_princeton_stamp_that_is_no_number_is_told(princeton: Path):
    savemat(princeton / 'frames.mat', {'frames': {
        'imageTimestamp': [1000, np.nan, 67000], 'imageFrameID': [1, 2, 4],
        'depthTimestamp': [900, 33900, 66900], 'depthFrameID': [2, 3, 5],
    }})  # fmt: skip
    assert 'a stamp or number of a frame is none' in error_of(princeton)


def test_our_layout_with_lines_and_frames_of_different_number(own: Path):
    truth = own / 'groundtruth.txt'
    truth.write_text('1,2,10,20\n' * 5)
    assert f'{truth}, line 5: 5 lines for the 4 images' in error_of(own)
    truth.write_text('1,2,10,20\n' * 3)
    assert f'{truth}, line 3: the file ends here' in error_of(own)


def test_our_layout_is_read_as_track_reads_it(own: Path):
    """A frame without depth, and stamps that stand still: the same frames, the same warnings."""
    (own / 'depth' / '000003.png').unlink()
    (own / 'timestamps.txt').write_text('100\n200\n200\n500\n')
    (sequence,) = open_dataset(str(own))
    opened = sequence.open()
    with open_recording(own) as recording:
        assert opened.warnings == tuple(recording.warnings)
        for sample, frame in zip(opened.samples, recording.frames(), strict=True):
            assert sample.frame.stamp_ns == frame.stamp_ns
            assert (sample.frame.depth is None) == (frame.depth is None)
    assert '1 of 4 colour images have no depth image' in opened.warnings[0]
    assert '1 stamps do not come after the one before' in opened.warnings[1]


@pytest.mark.parametrize('beside', ['timestamps.txt', 'intrinsics.json', None])
def test_our_layout_with_another_name_of_the_colour_folder(own: Path, beside: str | None):
    """One that VOT has, too: ours where a file says so, or where it is asked for."""
    (own / 'rgb').rename(own / 'color')
    for name in ('timestamps.txt', 'intrinsics.json'):
        if name != beside:
            (own / name).unlink()
    (sequence,) = open_dataset(str(own))
    assert sequence.kind == ('folder' if beside else 'vot')
    (asked,) = open_dataset(str(own), DatasetOptions(kind='folder'))
    assert asked.kind == 'folder'
    assert own / 'color' in asked.content
    first = next(iter(asked.open().samples)).frame
    assert (first.stamp_ns == 100) == (beside == 'timestamps.txt')
    assert (first.intrinsics is not None) == (beside == 'intrinsics.json')
    assert open_dataset(str(own), DatasetOptions(kind='vot'))[0].kind == 'vot'
    (own / 'sequence').write_text('fps=15\n')  # VOT's own file, whatever is beside it
    assert open_dataset(str(own))[0].kind == 'vot'


def test_our_layout_with_an_image_that_is_none(own: Path):
    (own / 'rgb' / '000002.png').write_bytes(b'nothing')
    assert 'rgb/000002.png' in error_of(own)


def test_our_layout_without_truth_or_target(own: Path):
    (own / 'groundtruth.txt').write_text('nan,nan,nan,nan\n' * 4)
    assert 'never clearly in view' in error_of(own)
    (own / 'groundtruth.txt').unlink()
    assert 'has no groundtruth.txt' in error_of(own)


def test_unreadable_and_empty_folders(tmp_path: Path, own: Path, monkeypatch: pytest.MonkeyPatch):
    with pytest.raises(DatasetError, match='does not exist'):
        open_dataset(str(tmp_path / 'nowhere'))
    (tmp_path / 'empty').mkdir()
    with pytest.raises(DatasetError, match='holds no sequence'):
        open_dataset(str(tmp_path / 'empty'))

    def refuse(self):
        raise PermissionError(13, 'Permission denied')

    monkeypatch.setattr(Path, 'iterdir', refuse)
    with pytest.raises(DatasetError, match='cannot be read: Permission denied'):
        open_dataset(str(tmp_path))


def test_one_unreadable_folder_among_good_ones_fails_alone(
    own: Path, monkeypatch: pytest.MonkeyPatch
):
    (own.parent / 'locked').mkdir()
    read = Path.iterdir

    def refuse(self):
        if self.name == 'locked':
            raise PermissionError(13, 'Permission denied')
        return read(self)

    monkeypatch.setattr(Path, 'iterdir', refuse)
    locked, good = open_dataset(str(own.parent))
    assert good.open().length == 4
    with pytest.raises(DatasetError, match='locked cannot be read: Permission denied'):
        locked.open()


def test_unknown_kind():
    with pytest.raises(DatasetError, match="unknown kind 'kitti'"):
        DatasetOptions(kind='kitti')


def test_simulated_scenes_by_name():
    options = DatasetOptions(seeds=(7, 8))
    assert [s.name for s in open_dataset('sim:normal', options)] == ['normal/7', 'normal/8']
    assert [s.name for s in open_dataset('sim:normal,crowd:2-3')] == [
        'normal/2', 'normal/3', 'crowd/2', 'crowd/3',
    ]  # fmt: skip
    every = open_dataset('sim:all', DatasetOptions(scenarios=('occlusion', 'motion')))
    assert {s.scenario for s in every} == {'occlusion', 'motion'}
    people = {s.scenario for s in open_dataset('sim:people')}
    assert {'comers', 'reunion'} <= people
    assert not people & {s.scenario for s in open_dataset('sim:all')}
    with pytest.raises(DatasetError, match="unknown scenario 'nothing'"):
        open_dataset('sim:nothing')


def test_simulated_scene_gives_both_truths():
    (sequence,) = open_dataset(
        'sim:normal:4', DatasetOptions(duration_s=0.2, size=(160, 90), rate_hz=15.0)
    )
    opened = pickle.loads(pickle.dumps(sequence)).open()
    samples = list(opened.samples)
    assert opened.has_body
    assert len(samples) == 3
    assert samples[0].frame.color.shape == (90, 160, 3)
    assert samples[0].visible is not None
    assert samples[0].body is not None
    assert samples[0].fraction == pytest.approx(1, abs=0.2)


def test_seeds():
    assert parse_seeds('3') == [3]
    assert parse_seeds('1-3,7,2') == [1, 2, 3, 7]
    for bad in ('', 'x', '5-1', '1-'):
        with pytest.raises(DatasetError, match=r"^--seeds '.*': give numbers like 3, 1-5"):
            parse_seeds(bad)


@pytest.mark.timeout(20)
@pytest.mark.parametrize('text', ['1-100000000000', '1-9999,5-10004', f'0-{10**30}'])
def test_seeds_without_end_are_refused_by_the_name_of_the_option(text: str) -> None:
    """So many were said to be no numbers, and a hundred thousand were made scenes of."""
    for find_them, name in (
        (lambda: parse_seeds(text), '--seeds'),
        (lambda: find(f'sim:all:{text}', ()), f'sim:all:{text}: seeds'),
    ):
        with pytest.raises(DatasetError) as raised:
            find_them()
        assert str(raised.value) == f'{name} {text!r}: give no more than 10000 seeds'
    assert len(parse_seeds('1-10000')) == 10_000


def sample(stamp_ms: int, box: Box | None = None) -> Sample:
    color = np.zeros((4, 4, 3), np.uint8)
    return Sample(Frame(color, np.ones((4, 4), np.float32), stamp_ms * 1_000_000), box)


def test_thinning_out_keeps_the_asked_rate():
    stamps = [round(i * 1000 / 30) for i in range(90)]
    for rate, kept in ((5.0, 15), (15.0, 45), (30.0, 90), (60.0, 90), (20.0, 60)):
        assert len(list(at_rate(map(sample, stamps), rate))) == pytest.approx(kept, abs=1)
    assert [s.frame.stamp_ns for s in at_rate(map(sample, [0, 900, 950, 2000]), 10)] == [
        0, 900_000_000, 2_000_000_000,
    ]  # fmt: skip
    jumps = [8000, 8040, 8100, 2000, 2040, 2100]
    kept = [s.frame.stamp_ns // 1_000_000 for s in at_rate(map(sample, jumps), 10)]
    assert kept == [8000, 8100, 2000, 2100], 'time jumped back: it does not wait until it is again'


def test_dropping_depth_and_starting_at_the_first_box():
    samples = [sample(0), sample(1, Box(0, 0, 2, 2)), sample(2)]
    assert all(s.frame.depth is None for s in without_depth(samples))
    camera = Intrinsics(5, 5, 2, 2)
    assert all(s.frame.intrinsics == camera for s in with_intrinsics(samples, camera))
    assert [s.frame.stamp_ns for s in from_first_view(samples)] == [1_000_000, 2_000_000]


def test_a_scene_measures_the_same_as_bag_and_as_folder(tmp_path: Path):
    options = DatasetOptions(duration_s=0.5, size=(160, 90))
    (scene,) = open_dataset('sim:normal:4', options)
    bag, folder = tmp_path / 'normal_4.mcap', tmp_path / 'folders' / 'normal_4'
    folder.parent.mkdir()
    with BagWriter(bag) as writer, SequenceWriter(folder) as images:
        for s in scene.open().samples:
            writer.write_frame(s.frame)
            writer.write_truth(s.frame, s.visible, s.body)
            images.write(s.frame, s.visible, s.body, s.fraction)
    (recorded,) = open_dataset(str(bag))
    (stored,) = open_dataset(str(folder))
    assert [q.scenario for q in (scene, recorded, stored)] == ['normal'] * 3
    lists = [list(q.open().samples) for q in (scene, recorded, stored)]
    assert len(lists[0]) == 15
    for one, two, three in zip(*lists, strict=True):
        assert one.visible == two.visible == three.visible
        assert one.body == two.body == three.body
        assert one.frame.stamp_ns == two.frame.stamp_ns == three.frame.stamp_ns
        assert np.array_equal(one.frame.color, two.frame.color)
        assert np.array_equal(one.frame.color, three.frame.color)
        np.testing.assert_allclose(one.frame.depth, two.frame.depth, atol=0.001)
        np.testing.assert_allclose(one.frame.depth, three.frame.depth, atol=0.001)


def test_files_of_one_bag_are_one_sequence_and_bags_of_other_names_are_each_one(tmp_path: Path):
    folder = tmp_path / 'walk'
    folder.mkdir()
    for name in ('walk_0.mcap', 'walk_1.mcap'):
        (folder / name).write_bytes(b'\x89MCAP0\r\n')
    (sequence,) = open_dataset(str(folder))
    assert (sequence.name, sequence.path) == ('walk', folder)
    assert [s.name for s in open_dataset(str(tmp_path))] == ['walk']
    (folder / 'other.mcap').write_bytes(b'\x89MCAP0\r\n')
    assert [s.name for s in open_dataset(str(folder))] == ['other', 'walk_0', 'walk_1']


def test_a_bag_that_is_named_goes_by_its_first_bytes(tmp_path: Path):
    bag = tmp_path / 'walk.of.monday'
    bag.write_bytes(b'\x89MCAP0\r\n')
    (sequence,) = open_dataset(str(bag))
    assert (sequence.path, sequence.kind) == (bag, 'recording')
    with pytest.raises(DatasetError, match='holds no sequence'):
        open_dataset(str(tmp_path))
    bag.write_bytes(b'words')
    with pytest.raises(DatasetError, match='holds no sequence'):
        open_dataset(str(bag))


def test_real_people_walking_past_each_other(shared_data: Path):
    sequences = open_dataset(str(shared_data / 'rgbd' / 'filinha'), DatasetOptions(fps=5.0))
    assert len(sequences) == 6
    for sequence in sequences:
        opened = sequence.open()
        first = next(iter(opened.samples))
        assert first.fraction >= 0.5
        assert first.frame.depth.shape == (480, 640)
        assert opened.start + opened.length <= 108
    purple = sequences[-1].open()
    assert purple.start + purple.length == 108, 'seen until frame 101: 15 more pass the end'


def test_real_folders(shared_data: Path):
    expected = set()
    for path in (shared_data / 'rgbd').iterdir():
        people = [p.stem.removeprefix('groundtruth_') for p in path.glob('groundtruth_*.txt')]
        if not people and not (path / 'groundtruth.txt').exists():
            people = [line.split(',')[1] for line in (path / 'mot.txt').read_text().splitlines()]
        expected |= {f'{path.name}/{person}' for person in people} or {path.name}
    assert {s.name for s in open_dataset(str(shared_data / 'rgbd'))} == expected
    assert {'filinha/F_purple', 'group_cam1/1', 'redkitchen'} <= expected
    otb = {s.name: s for s in open_dataset(str(shared_data / 'otb'), DatasetOptions(kind='otb'))}
    lengths = {'Basketball': 725, 'Couple': 140, 'Crossing': 120, 'Football1': 74}
    assert {name: otb[name].open().length for name in lengths} == lengths
    first = next(iter(otb['Crossing'].open().samples))
    assert first.visible == Box(204, 150, 17, 50), 'published 205,151 from 1'


def test_a_bag_without_truth_says_so(tmp_path: Path, shared_data: Path):
    bag = shared_data / 'bags' / 'hero' / 'bags' / '2019-05-03-12-41-38.bag'
    (sequence,) = open_dataset(str(bag))
    with pytest.raises((DatasetError, RecordingError), match='2019-05-03'):
        sequence.open()


def test_the_camera_of_a_bag_can_be_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As the reader's messages say: it finds none, or several."""
    bag = tmp_path / 'normal_4.mcap'
    assert main(['simulate', str(bag), '--size', '160x90', '--duration', '0.3']) == 0
    found, without = (
        open_dataset(str(bag), DatasetOptions(depth_topic=topic))[0] for topic in (None, 'none')
    )
    assert all(sample.frame.depth is not None for sample in found.open().samples)
    assert all(sample.frame.depth is None for sample in without.open().samples)
    assert found.identity != without.identity  # or a result of one would stand for the other
    words = ['evaluate', str(bag), '--variants', 'kcf', '--jobs', '1', '--color-topic', '/other']
    capsys.readouterr()
    assert main([*words, '--report', str(tmp_path / 'report')]) == 2
    assert 'has no topic /other: give another as --color-topic' in capsys.readouterr().err


@pytest.mark.parametrize('role', ['color', 'depth', 'info'])
def test_a_topic_named_for_what_is_no_bag_is_refused(tmp_path: Path, role: str) -> None:
    """It was passed over, and the figures were of another camera than the command said."""
    folder = tmp_path / 'walk'
    assert main(['simulate', str(folder), '--size', '160x90', '--duration', '0.2']) == 0
    options = DatasetOptions(**{f'{role}_topic': '/other'})
    for source in ('sim:normal', str(folder)):
        with pytest.raises(DatasetError, match=f'leave --{role}-topic /other out'):
            open_dataset(source, options)
