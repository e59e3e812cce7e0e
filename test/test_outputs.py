# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""No command writes to its source, replaces a file unasked, or leaves half of one."""

from __future__ import annotations

import errno
import hashlib
import logging
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_rig import camera_messages, make_frames, write_mcap, write_rosbag2

from rgbd_kcf_tracker.bench import moving_picture
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import (
    BagWriter,
    SequenceWriter,
    TrackCsvWriter,
    VideoWriter,
    open_recording,
    outputs,
)
from rgbd_kcf_tracker.recordings.outputs import OutputFile, OutputFolder, check_held, check_outputs
from rgbd_kcf_tracker.track import Track, TrackState

FRAMES = make_frames(4)
SEEN = Track(Box(10, 8, 20, 30), TrackState.TRACKING, 0.9, 2.5)
INIT = ['--init', '10,8,20,30']


def digest(place: Path) -> dict[str, str]:
    """Every file below a place with a sum of what is in it."""
    return {
        str(p.relative_to(place)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(place.rglob('*'))
        if p.is_file()
    }


def write_folder(path: Path) -> Path:
    with SequenceWriter(path) as writer:
        for frame in FRAMES:
            writer.write(frame, Box(10, 8, 20, 30))
    return path


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert main([str(w) for w in words]) == 2
    error = capsys.readouterr().err
    assert error.startswith('rgbd-kcf: error: ')
    assert error.count('\n') == 1
    return error


# -- sources -----------------------------------------------------------------------------------


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return write_rosbag2(tmp_path / 'bag', camera_messages(FRAMES))


@pytest.mark.parametrize('overwrite', [[], ['--overwrite']])
def test_no_output_goes_into_a_bag_folder(
    overwrite: list[str], bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (storage,) = bag.glob('*.mcap')
    before = digest(bag)
    for name in (storage.name, 'metadata.yaml', 'new.mcap'):
        words = ['track', bag, *INIT, '--bag', bag / name, *overwrite]
        assert 'source' in refused(capsys, *words)
    assert 'source' in refused(capsys, 'convert', bag, storage, *overwrite)
    assert 'source' in refused(capsys, 'convert', bag, bag / 'new.mcap', *overwrite)
    assert digest(bag) == before


@pytest.mark.parametrize('overwrite', [[], ['--overwrite']])
def test_no_output_goes_into_the_folder_of_a_bag_whose_file_is_the_source(
    overwrite: list[str], bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (storage,) = bag.glob('*.mcap')
    (tmp_path / 'way.mcap').symlink_to(storage)
    os.link(bag / 'metadata.yaml', tmp_path / 'other.yaml')
    before = digest(bag)
    for source in (storage, tmp_path / 'way.mcap'):
        for option, place in (
            ('--output', bag / 'metadata.yaml'), ('--output', tmp_path / 'other.yaml'),
            ('--bag', bag / 'y.mcap'),
        ):  # fmt: skip
            assert 'source' in refused(capsys, 'track', source, *INIT, option, place, *overwrite)
        assert 'source' in refused(capsys, 'convert', source, bag / 'y.mcap', *overwrite)
    assert digest(bag) == before
    assert main(['track', str(storage), *INIT, '--output', str(tmp_path / 'a.csv')]) == 0


@pytest.mark.parametrize('overwrite', [[], ['--overwrite']])
def test_no_output_goes_into_a_sequence_folder(
    overwrite: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_folder(tmp_path / 'seq')
    before = digest(source)
    for option, name in (
        ('--output', 'groundtruth.txt'), ('--output', 'rgb/boxes.csv'),
        ('--video', 'rgb/000003.png'), ('--video', 'rgb/a.mp4'), ('--bag', 'a.mcap'),
    ):  # fmt: skip
        words = ['track', source, option, source / name, *overwrite]
        error = refused(capsys, *words)
        assert 'is the source itself' in error or 'lies inside the source' in error
    # by another way to the same place
    (tmp_path / 'way').symlink_to(source / 'rgb')
    assert 'inside' in refused(capsys, 'track', source, '--output', tmp_path / 'way' / 'a.csv')
    assert 'inside' in refused(
        capsys, 'track', source / 'rgb' / '..', '--output', source / 'a.csv', *overwrite
    )
    assert 'inside' in refused(
        capsys, 'evaluate', source, '--variants', 'kcf', '--report', source / 'report', *overwrite
    )
    assert 'source itself' in refused(
        capsys, 'evaluate', source, '--variants', 'kcf', '--report', source, *overwrite
    )
    assert digest(source) == before


@pytest.mark.parametrize('link', [os.link, os.symlink])
def test_another_name_of_the_source_is_the_source(
    link: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_mcap(tmp_path / 'a.mcap', camera_messages(FRAMES))
    other = tmp_path / 'b.mcap'
    link(source, other)
    before = digest(tmp_path)
    for words in (
        ['track', source, *INIT, '--bag', other],
        ['track', source, *INIT, '--output', other],
        ['convert', source, other],
        ['convert', other, source],
    ):
        assert 'is the source itself' in refused(capsys, *words, '--overwrite')
    assert digest(tmp_path) == before


def test_a_linked_image_of_a_sequence_is_the_source(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The folder holds links alone: what they lead to is read all the same."""
    images = write_folder(tmp_path / 'images')
    source = tmp_path / 'seq'
    source.mkdir()
    (source / 'rgb').symlink_to(images / 'rgb')
    (source / 'loop').symlink_to(source)
    before = digest(images)
    error = refused(
        capsys, 'track', source, *INIT, '--output', images / 'rgb' / '000002.png', '--overwrite'
    )
    assert 'is the source itself' in error
    assert digest(images) == before


@pytest.mark.parametrize('command', ['evaluate', 'sweep'])
def test_no_link_in_a_report_leads_into_its_source(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_folder(tmp_path / 'seq')
    report = tmp_path / 'report'
    (report / 'results' / 'kcf').mkdir(parents=True)
    (report / 'runs.jsonl').touch()
    # A source and a larger disk may lie there; of the former, too, a file may have two names.
    (tmp_path / 'disk' / 'here').mkdir(parents=True)
    (report / 'thumbs').symlink_to(tmp_path / 'disk')
    before = digest(source)
    more = ['--param', 'kcf.padding=1,2'] if command == 'sweep' else ['--variants', 'kcf']
    for name, link, to, words in (
        ('runs.jsonl', os.link, 'groundtruth.txt', 'the source itself'),
        ('runs.jsonl', os.symlink, 'rgb/new.txt', 'leads into the source'),
        ('truth', os.symlink, '', 'the source itself'),
        ('results/kcf', os.symlink, 'rgb', 'leads into the source'),
        ('thumbs/here', os.symlink, 'depth', 'leads into the source'),
        ('.write', os.symlink, 'rgb/000001.png', 'leads into the source'),
    ):
        place = report / name
        if place.is_dir():
            place.rmdir()
        place.unlink(missing_ok=True)
        link(source / to, place)
        error = refused(capsys, command, source, *more, '--report', report)
        assert f'{place} ' in error
        assert words in error
        assert digest(source) == before
        place.unlink()
        if name == 'runs.jsonl':
            place.touch()


def test_a_report_may_be_linked_elsewhere_and_lie_beside_its_source(tmp_path: Path) -> None:
    source = write_folder(tmp_path / 'seq')
    os.link(source / 'groundtruth.txt', source / 'other.txt')
    (tmp_path / 'disk').mkdir()
    (tmp_path / 'thumbs').symlink_to(tmp_path / 'disk')
    (tmp_path / 'loop').symlink_to(tmp_path)
    check_held(tmp_path, [source])
    check_held(tmp_path / 'none', [source])


def test_what_sqlite_keeps_beside_a_database_is_the_source(tmp_path: Path) -> None:
    for name in ('a.db3', 'a.db3-wal'):
        (tmp_path / name).write_bytes(b'data')
    with pytest.raises(RecordingError, match='is the source itself'):
        check_outputs({'--output': tmp_path / 'a.db3-wal'}, [tmp_path / 'a.db3'], overwrite=True)


def test_two_outputs_cannot_be_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write_mcap(tmp_path / 'a.mcap', camera_messages(FRAMES))
    (tmp_path / 'way').symlink_to(tmp_path)
    same = tmp_path / 'same.mcap'
    words = ['track', source, *INIT, '--output', same, '--bag']
    assert f'--bag {same} is --output {same}, too' in refused(capsys, *words, same)
    assert 'is --output' in refused(capsys, *words, tmp_path / 'way' / 'same.mcap')
    assert not same.exists()
    same.write_text('old')
    os.link(same, tmp_path / 'other.mcap')
    assert 'is --output' in refused(capsys, *words, tmp_path / 'other.mcap', '--overwrite')
    assert same.read_text() == 'old'


# -- what is there already ---------------------------------------------------------------------


def test_one_rule_for_every_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write_folder(tmp_path / 'seq')
    short = ['--size', '160x90', '--rate', 2, '--duration', 1]
    commands = {
        'a.csv': ['track', source, '--variant', 'kcf', '--output'],
        'a.mp4': ['track', source, '--variant', 'kcf', '--video'],
        'a.mcap': ['track', source, '--variant', 'kcf', '--bag'],
        'b.mcap': ['convert', source],
        'c.mcap': ['simulate', *short],
        'walk': ['simulate', *short],
        'sheet.png': ['simulate', *short, '--contact-sheet'],
        'report': ['evaluate', source, '--variants', 'kcf', '--jobs', 1, '--report'],
    }
    for name, words in commands.items():
        place = tmp_path / name
        if '.' in name:
            place.write_text('old')
        else:
            (place / 'rgb').mkdir(parents=True)
            (place / 'groundtruth.txt').write_text('old')
        before = digest(place) if place.is_dir() else place.read_text()
        assert '--overwrite' in refused(capsys, *words, place), name
        assert (digest(place) if place.is_dir() else place.read_text()) == before, name
        assert main([*map(str, words), str(place), '--overwrite']) == 0, name
        if place.is_file():
            assert place.stat().st_size > 20, name
    assert not list(tmp_path.glob('*.part*'))
    # A report that was begun is gone on with, without being asked.
    assert main([*map(str, commands['report']), str(tmp_path / 'report')]) == 0


def test_a_page_that_is_no_report_of_ours_is_not_replaced_unasked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not even where a folder beside it is named as one of ours."""
    words = ['evaluate', write_folder(tmp_path / 'seq'), '--variants', 'kcf', '--jobs', '1']
    words += ['--report', tmp_path / 'mine']
    (tmp_path / 'mine' / 'results').mkdir(parents=True)
    (tmp_path / 'mine' / 'index.html').write_text('years of work')
    assert 'is no report' in refused(capsys, *words)
    assert (tmp_path / 'mine' / 'index.html').read_text() == 'years of work'
    assert main([*map(str, words), '--overwrite']) == 0
    assert main([*map(str, words)]) == 0, 'our own is gone on with'


def test_the_moving_picture_replaces_nothing_unasked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip('imageio_ffmpeg', reason="needs the extra 'video'")
    monkeypatch.setattr(moving_picture, 'pictures', lambda *_: [np.zeros((8, 16, 3), np.uint8)])
    picture = tmp_path / 'a.gif'
    picture.write_text('years of work')
    with pytest.raises(SystemExit) as ended:
        moving_picture.main([str(picture)])
    assert ended.value.code == 2
    assert '--overwrite' in capsys.readouterr().err
    assert picture.read_text() == 'years of work'
    assert moving_picture.main([str(picture), '--overwrite']) == 0
    assert picture.read_bytes().startswith(b'GIF8')


@pytest.mark.parametrize('last', ['10', '20'])
def test_a_moving_picture_of_no_frames_is_refused(
    last: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip('imageio_ffmpeg', reason="needs the extra 'video'")
    with pytest.raises(SystemExit, match='2'):
        moving_picture.main([str(tmp_path / 'a.gif'), '--first', '20', '--last', last])
    assert '--last above it' in capsys.readouterr().err


def test_a_report_on_a_full_disk_is_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_folder(tmp_path / 'seq')
    words = ['evaluate', source, '--variants', 'kcf', '--jobs', '1', '--report', tmp_path / 'r']
    real = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if path.is_relative_to(tmp_path / 'r') and '.csv' in path.name:
            raise OSError(errno.ENOSPC, 'No space left on device')
        return real(path, data)

    with monkeypatch.context() as patch:
        patch.setattr(Path, 'write_bytes', full)
        assert f'{tmp_path / "r"}' in refused(capsys, *words)
    assert not list((tmp_path / 'r').rglob('.*'))
    assert main([*map(str, words)]) == 0


def test_nothing_is_left_where_nothing_was_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    noise = tmp_path / 'noise.mcap'
    noise.write_bytes(b'\x89MCAP0\r\n' + np.random.default_rng(1).bytes(5000))
    assert main(['convert', str(noise), str(tmp_path / 'new.mcap')]) == 2
    assert 'holds no message that can be read' in capsys.readouterr().err
    (tmp_path / 'old.mcap').write_text('years of work')
    assert main(['convert', str(noise), str(tmp_path / 'old.mcap'), '--overwrite']) == 2
    assert (tmp_path / 'old.mcap').read_text() == 'years of work'
    assert sorted(p.name for p in tmp_path.iterdir()) == ['noise.mcap', 'old.mcap']


def test_outputs_that_cannot_be_are_refused_before_anything_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_folder(tmp_path / 'seq')
    os.mkfifo(tmp_path / 'pipe')
    (tmp_path / 'loop').symlink_to(tmp_path / 'loop')
    before = sorted(tmp_path.rglob('*'))
    track = ('track', source, '--overwrite')
    error = refused(capsys, *track, '--output', tmp_path / 'nodir' / 'b.csv')
    assert f'there is no folder {tmp_path / "nodir"}: make it first' in error
    assert 'is a named pipe' in refused(capsys, *track, '--output', tmp_path / 'pipe')
    assert 'is a device' in refused(capsys, *track, '--output', '/dev/null')
    assert 'as --output -: give the name' in refused(capsys, *track, '--output', '/dev/stdout')
    for kind in ('mot', 'video', 'bag'):
        for more in ((), ('--jobs', 1, '--output', tmp_path / 'new')):
            error = refused(capsys, *track, f'--{kind}', '-', *more)
            assert f'--{kind} - would be standard output' in error
    assert 'lead in a circle' in refused(capsys, *track, '--output', tmp_path / 'loop')
    assert 'lead in a circle' in refused(capsys, *track, '--bag', tmp_path / 'loop' / 'a.mcap')
    assert 'must end in .mp4' in refused(capsys, *track, '--video', tmp_path / 'b.xyz')
    assert 'is a folder' in refused(capsys, *track, '--output', tmp_path)
    assert 'make it first' in refused(
        capsys, 'simulate', tmp_path / 'nodir' / 'walk', '--size', '160x90'
    )
    assert 'make it first' in refused(
        capsys, 'evaluate', source, '--variants', 'kcf', '--report', tmp_path / 'no' / 'report'
    )
    assert sorted(tmp_path.rglob('*')) == before


# -- the writers -------------------------------------------------------------------------------


def write_one(path: Path, count: int = 3, stop: bool = False, **options: Any) -> None:
    """``count`` frames by the writer for the name, which an error may stop."""
    color = np.full((48, 64, 3), 90, np.uint8)
    frames = [Frame(color, None, n) for n in range(count)]
    if path.suffix == '.csv':
        with TrackCsvWriter(path, **options) as table:
            for frame in frames:
                table.write_track(frame.stamp_ns, frame.stamp_ns, SEEN)
            assert not stop, 'stopped'
    elif path.suffix == '.mp4':
        with VideoWriter(path, **options) as video:
            for frame in frames:
                video.write(frame.color)
            assert not stop, 'stopped'
    elif path.suffix == '.mcap':
        with BagWriter(path, **options) as bag:
            for frame in frames:
                bag.write_frame(frame)
            assert not stop, 'stopped'
    else:
        with SequenceWriter(path, **options) as folder:
            for frame in frames:
                folder.write(frame)
            assert not stop, 'stopped'


KINDS = ['a.csv', 'a.mp4', 'a.mcap', 'a']


@pytest.mark.parametrize('name', KINDS)
def test_the_old_stays_until_the_new_is_whole(
    name: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / name
    write_one(path)
    old = digest(tmp_path)
    with pytest.raises(RecordingError, match='is there already'):
        write_one(path)
    with pytest.raises(AssertionError, match='stopped'), caplog.at_level(logging.WARNING):
        write_one(path, 5, stop=True, overwrite=True)
    part = tmp_path / f'{path.stem}.part{path.suffix}'
    assert f'{path} is left as it was; what was written of the new one is {part}' in caplog.text
    assert {k: v for k, v in digest(tmp_path).items() if '.part' not in k} == old
    assert part.exists()
    if name == 'a':
        with open_recording(part) as recording:
            assert len(recording) == 5
    kept = digest(tmp_path)
    write_one(path, 7, overwrite=True)
    now = digest(tmp_path)
    assert {k: v for k, v in now.items() if '.part' in k} == {
        k: v for k, v in kept.items() if '.part' in k
    }, 'what an interruption left is nobody else to replace'
    assert now != kept
    assert not list(tmp_path.glob('*.part2*'))


@pytest.mark.parametrize('name', KINDS)
def test_a_new_output_keeps_what_was_written_and_no_empty_one(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    write_one(path, 0)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(AssertionError):
        write_one(path, 0, stop=True)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(AssertionError):
        write_one(path, 2, stop=True)
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_an_empty_folder_may_be_filled_and_stays_where_nothing_came(tmp_path: Path) -> None:
    (tmp_path / 'a').mkdir()
    write_one(tmp_path / 'a', 0)
    assert list(tmp_path.rglob('*')) == [tmp_path / 'a']
    write_one(tmp_path / 'a', 2)
    assert len(list((tmp_path / 'a' / 'rgb').iterdir())) == 2


def test_a_replaced_file_keeps_its_permissions_and_its_other_names(tmp_path: Path) -> None:
    (tmp_path / 'a.csv').write_text('old')
    (tmp_path / 'a.csv').chmod(0o640)
    os.link(tmp_path / 'a.csv', tmp_path / 'b.csv')
    (tmp_path / 'c.csv').symlink_to('a.csv')
    write_one(tmp_path / 'c.csv', overwrite=True)
    assert (tmp_path / 'c.csv').is_symlink()
    assert (tmp_path / 'a.csv').read_text().startswith('frame,')
    assert (tmp_path / 'a.csv').stat().st_mode & 0o777 == 0o640
    assert (tmp_path / 'b.csv').read_text() == 'old'


def test_a_file_that_comes_up_meanwhile_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between the look at the name and the making of the file, somebody else makes it."""
    path = tmp_path / 'a.csv'

    def nothing(place: Path) -> None:
        place.write_text("another program's")

    monkeypatch.setattr(outputs, '_stat', nothing)
    with pytest.raises(RecordingError, match='is there already'):
        OutputFile(path)
    assert path.read_text() == "another program's"


def test_a_folder_with_other_things_is_never_replaced(tmp_path: Path) -> None:
    write_one(tmp_path / 'a')
    (tmp_path / 'a' / 'thesis.txt').write_text('years of work')
    before = digest(tmp_path)
    with pytest.raises(RecordingError, match=r'holds thesis\.txt'):
        write_one(tmp_path / 'a', overwrite=True)
    with pytest.raises(RecordingError, match='is a file'):
        OutputFolder(tmp_path / 'a' / 'thesis.txt', ())
    assert digest(tmp_path) == before


def test_what_is_put_into_a_folder_while_its_successor_is_made_is_not_lost(tmp_path: Path) -> None:
    path = tmp_path / 'a'
    write_one(path)
    old = digest(path)
    folder = SequenceWriter(path, overwrite=True)
    folder.write(Frame(np.full((48, 64, 3), 90, np.uint8), None, 0))
    (path / 'notes.txt').write_text('precious')
    with pytest.raises(RecordingError, match=r'holds notes\.txt'):
        folder.close()
    assert (path / 'notes.txt').read_text() == 'precious'
    assert digest(path).items() >= old.items()
    assert len(open_recording(tmp_path / 'a.part')) == 1


def test_a_file_that_is_removed_while_it_is_written_is_told(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    table = TrackCsvWriter(path)
    table.write_track(0, 0, SEEN)
    path.unlink()
    with pytest.raises(RecordingError, match='was removed while it was written'):
        table.close()


def test_the_name_of_a_folder_is_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(RecordingError, match='is the name of a folder'):
        OutputFile(f'{tmp_path}/a.csv/')
    source = write_mcap(tmp_path / 'a.mcap', camera_messages(FRAMES))
    new = f'{tmp_path}/new/'
    assert main(['track', str(source), *INIT, '--output', new]) == 2
    assert f'{new} is the name of a folder' in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ['a.mcap']


def test_names_are_shown_without_their_control_characters(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / 'a\x1b[31m.mcap'
    write_mcap(source, camera_messages(FRAMES))
    new = f'{tmp_path}/b\x1b[32m\n.csv'
    assert main(['track', str(source), *INIT, '--variant', 'kcf', '--output', new]) == 0
    assert main(['convert', str(source), f'{tmp_path}/c\x07.mcap']) == 0
    said = capsys.readouterr().out
    assert '\\x1b[31m' in said
    assert '\\x1b[32m\\n.csv' in said
    assert 'c\\x07.mcap' in said
    assert not {'\x1b', '\x07'} & set(said)


@pytest.mark.parametrize('stamp', [-1, 1 << 62])
def test_a_stamp_that_cannot_be_read_again_is_not_written(tmp_path: Path, stamp: int) -> None:
    frame = Frame(np.full((48, 64, 3), 90, np.uint8), None, stamp)
    with SequenceWriter(tmp_path / 'a') as folder:
        with pytest.raises(RecordingError, match=f'the stamp {stamp} ns'):
            folder.write(frame)
        folder.write(Frame(frame.color, None, 5))
    with pytest.raises(RecordingError, match='is closed'):
        folder.write(Frame(frame.color, None, 6))
    if stamp > 0:
        with (
            BagWriter(tmp_path / 'a.mcap') as bag,
            pytest.raises(RecordingError, match=f'the stamp {stamp} ns'),
        ):
            bag.write_frame(frame)


def test_a_folder_whose_stamps_stand_still_gives_a_bag_with_every_frame(tmp_path: Path) -> None:
    write_one(tmp_path / 'a')
    (tmp_path / 'a' / 'timestamps.txt').write_text('5\n5\n4\n')
    assert main(['convert', str(tmp_path / 'a'), str(tmp_path / 'a.mcap')]) == 0
    with open_recording(tmp_path / 'a.mcap') as recording:
        assert [frame.stamp_ns for frame in recording.frames()] == [5, 6, 7]


def test_a_folder_that_replaced_another_may_be_closed_twice(tmp_path: Path) -> None:
    write_one(tmp_path / 'a')
    with SequenceWriter(tmp_path / 'a', overwrite=True) as folder:
        folder.write(Frame(np.full((48, 64, 3), 90, np.uint8), None, 0))
        folder.close()
    with open_recording(tmp_path / 'a') as recording:
        assert len(recording) == 1
    assert [path.name for path in tmp_path.iterdir()] == ['a']
