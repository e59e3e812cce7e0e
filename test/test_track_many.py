# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``rgbd-kcf track`` over many recordings: what is asked for, a file each, and a table of all."""

from __future__ import annotations

import csv
import json
import os
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from onnx_files import average_pool

from rgbd_kcf_tracker.batch.workers import LocalPool
from rgbd_kcf_tracker.cli import track, track_many
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.cli.workers import record
from rgbd_kcf_tracker.errors import ParameterError, RecordingError
from rgbd_kcf_tracker.recordings.results import HEADER
from rgbd_kcf_tracker.recordings.rowfiles import join_csv

WORDS = ['--variant', 'kcf', '--jobs', '1']


@pytest.fixture(scope='module')
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three scenes, one of them a bag, and a folder without images."""
    folder = tmp_path_factory.mktemp('data')
    scene = ['--duration', '0.5', '--rate', '10', '--size', '320x180']
    assert main(['simulate', str(folder), '--count', '2', *scene]) == 0
    assert main(['simulate', str(folder / 'walk.mcap'), '--scenario', 'occlusion', *scene]) == 0
    (folder / 'broken' / 'rgb').mkdir(parents=True)
    return folder


def results(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob('*'))
        if path.is_file() and path.name != 'runs.jsonl'
    }


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.open()))


@pytest.fixture(scope='module')
def tracked(recordings: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp('tracked') / 'out'
    words = ['track', f'{recordings}/normal_*', str(recordings / 'walk.mcap'), *WORDS]
    assert main([*words, '--output', str(output)]) == 0
    return output


def test_each_recording_has_its_file_and_all_are_in_one_table(recordings: Path, tracked: Path):
    names = ['normal_0', 'normal_1', 'walk']
    assert sorted(p.stem for p in (tracked / 'tracks').iterdir()) == names
    alone = tracked.parent / 'alone.csv'
    assert main(['track', str(recordings / 'normal_1'), '--variant', 'kcf',
                 '--output', str(alone)]) == 0  # fmt: skip
    assert alone.read_bytes() == (tracked / 'tracks' / 'normal_1.csv').read_bytes()
    table = rows_of(tracked / 'tracks.csv')
    assert [r['source'] for r in table] == [n for n in names for _ in range(5)]
    own = [{k: v for k, v in r.items() if k != 'source'} for r in table[5:10]]
    assert own == rows_of(alone)
    sources = rows_of(tracked / 'sources.csv')
    assert [(r['name'], r['frames'], r['tracking'], r['error']) for r in sources] == [
        (name, '5', '5', '') for name in names
    ]
    assert 0 < float(sources[0]['iou']) <= 1


def test_a_pool_parts_and_a_cluster_give_the_same_bytes(
    recordings: Path, tracked: Path, tmp_path: Path
):
    distributed = pytest.importorskip('distributed', reason="needs the extra 'cluster'")
    words = ['track', f'{recordings}/normal_*', str(recordings / 'walk.mcap'), '--variant', 'kcf']
    assert main([*words, '--jobs', '2', '--output', str(tmp_path / 'pool')]) == 0
    assert results(tmp_path / 'pool') == results(tracked)
    for part in ('2/2', '1/2'):
        told = ['--jobs', '1', '--shard', part, '--output', str(tmp_path / 'parts')]
        assert main([*words, *told]) == 0
        assert not (tmp_path / 'parts' / 'tracks.csv').exists()
    assert main([*words, '--jobs', '1', '--output', str(tmp_path / 'parts')]) == 0
    assert results(tmp_path / 'parts') == results(tracked)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=':0'
    ) as cluster:
        told = ['--cluster', cluster.scheduler_address, '--output', str(tmp_path / 'cluster')]
        assert main([*words, *told]) == 0
    assert results(tmp_path / 'cluster') == results(tracked)


def test_one_that_fails_is_a_row_and_ends_no_other(recordings: Path, tmp_path: Path, capsys):
    words = ['track', str(recordings / 'broken'), str(recordings / 'normal_0'), *WORDS]
    assert main([*words, '--output', str(tmp_path / 'o')]) == track_many.EXIT_FAILURES
    broken, good = rows_of(tmp_path / 'o' / 'sources.csv')
    assert 'broken' in broken['error']
    assert (broken['frames'], good['error'], good['frames']) == ('', '', '5')
    assert {r['source'] for r in rows_of(tmp_path / 'o' / 'tracks.csv')} == {'normal_0'}
    assert not list((tmp_path / 'o' / 'tracks').glob('.*')), 'nothing half is left'
    assert 'broken: ' in capsys.readouterr().err


def test_a_name_too_long_for_the_files_beside_is_told_as_any_error(
    recordings: Path, tmp_path: Path, capsys
):
    long = tmp_path / ('n' * 250)
    shutil.copytree(recordings / 'normal_0', long)
    words = ['track', str(long), str(recordings / 'normal_1'), *WORDS]
    assert main([*words, '--output', str(tmp_path / 'out')]) == 1
    told = capsys.readouterr().err
    assert 'File name too long' in told
    assert 'OSError' not in told
    assert 'Errno' not in told


def test_what_is_done_is_not_done_again_elsewhere_either(
    recordings: Path, tracked: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    shutil.copytree(tracked, tmp_path / 'out')
    shutil.copytree(recordings, tmp_path / 'data')
    (tmp_path / 'out' / 'tracks' / 'walk.csv').unlink()
    followed = []
    follow = track.follow
    monkeypatch.setattr(track, 'follow', lambda args, watched: followed.append(args.source) or
                        follow(args, watched))  # fmt: skip
    words = ['track', f'{tmp_path}/data/normal_*', f'{tmp_path}/data/walk.mcap', *WORDS]
    assert main([*words, '--output', str(tmp_path / 'out')]) == 0
    assert followed == [f'{tmp_path}/data/walk.mcap']
    assert results(tmp_path / 'out')['tracks.csv'] == results(tracked)['tracks.csv']


def test_results_of_other_options_are_not_replaced_unasked(
    recordings: Path, tracked: Path, tmp_path: Path, capsys
):
    shutil.copytree(tracked, tmp_path / 'out')
    words = ['track', f'{recordings}/normal_*', *WORDS, '--param', 'padding=2.0']
    before = results(tmp_path / 'out')
    assert main([*words, '--output', str(tmp_path / 'out')]) == 2
    assert 'normal_0.csv and 3 more would be replaced' in capsys.readouterr().err
    assert results(tmp_path / 'out') == before


def test_results_of_another_network_of_the_same_name_are_not_taken_for_ones_own(
    recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
):
    monkeypatch.chdir(tmp_path)
    Path('net.onnx').write_bytes(average_pool(cell=64))
    words = ['track', f'{recordings}/normal_*', '--end', '3', '--output', 'out', '--param']
    for name in ('net.onnx', './net.onnx'):
        assert main([*words, f'embedding={name}']) == 0
    Path('net.onnx').write_bytes(average_pool(cell=32))
    assert main([*words, 'embedding=net.onnx']) == 2
    assert 'normal_0.csv and 1 more would be replaced' in capsys.readouterr().err


def test_a_recording_in_which_nobody_is_seen_has_a_file_of_no_rows(tmp_path: Path, capsys):
    """Its file was not there, so that it failed; of one recording it was said to be written."""
    for name in ('wall', 'door'):
        (tmp_path / name / 'rgb').mkdir(parents=True)
        cv2.imwrite(str(tmp_path / name / 'rgb' / '0.png'), np.full((90, 120, 3), 90, np.uint8))
    words = ['track', '--all', str(tmp_path / 'wall')]
    assert main([*words, '--output', str(tmp_path / 'one.csv')]) == 0
    assert 'nobody' in capsys.readouterr().out
    assert main([*words, str(tmp_path / 'door'), '--output', str(tmp_path / 'out')]) == 0
    for path in (tmp_path / 'one.csv', tmp_path / 'out' / 'tracks' / 'wall.csv'):
        assert path.read_text() == ','.join(('id', *HEADER)) + '\n'
    assert len(rows_of(tmp_path / 'out' / 'sources.csv')) == 2


def test_lists_globs_and_repeats(recordings: Path, tmp_path: Path, monkeypatch):
    listed = tmp_path / 'bags.txt'
    listed.write_text(f'# of Monday\n{recordings}/walk.mcap\n\n  {recordings}/normal_1 \n')
    monkeypatch.chdir(recordings)
    output = str(tmp_path / 'o')
    assert main(['track', 'normal_1', '--list', str(listed), *WORDS, '--output', output]) == 0
    names = [r['name'] for r in rows_of(tmp_path / 'o' / 'sources.csv')]
    assert names == ['normal_1', 'walk'], 'each once, in the order given'


def test_videos_and_mot_text_lie_in_folders_of_their_own(recordings: Path, tmp_path: Path):
    words = ['track', f'{recordings}/normal_*', *WORDS, '--output', str(tmp_path / 'o')]
    places = ['--mot', str(tmp_path / 'mot'), '--video', str(tmp_path / 'v'),
              '--bag', str(tmp_path / 'b')]  # fmt: skip
    assert main([*words, *places]) == 0
    for folder, suffix in (('mot', '.txt'), ('v', '.mp4'), ('b', '.mcap')):
        assert sorted(p.name for p in (tmp_path / folder).iterdir()) == [
            f'normal_0{suffix}', f'normal_1{suffix}'
        ]  # fmt: skip


def test_the_table_as_parquet_has_the_same_values(tracked: Path, recordings: Path, tmp_path: Path):
    parquet = pytest.importorskip('pyarrow.parquet', reason="needs the extra 'parquet'")
    shutil.copytree(tracked, tmp_path / 'out')
    words = ['track', f'{recordings}/normal_*', str(recordings / 'walk.mcap'), *WORDS]
    assert main([*words, '--table', 'parquet', '--output', str(tmp_path / 'out')]) == 0
    table = parquet.read_table(tmp_path / 'out' / 'tracks.parquet')
    expected = rows_of(tracked / 'tracks.csv')
    assert table.column_names == list(expected[0])
    assert [str(t) for t in table.schema.types] == [
        'string', 'int64', 'int64', *['double'] * 4, 'string', 'double', 'double'
    ]  # fmt: skip
    for own, row in zip(table.to_pylist(), expected, strict=True):
        texts = {k: '' if v is None else v for k, v in own.items()}
        assert texts['source'] == row['source']
        assert str(texts['stamp_ns']) == row['stamp_ns']
        assert (texts['x'] == '') == (row['x'] == '')
        assert texts['x'] == '' or texts['x'] == float(row['x'])


def test_tables_of_different_columns_are_not_joined(tmp_path: Path):
    (tmp_path / 'a.csv').write_text('frame,x\n0,1\n')
    (tmp_path / 'b.csv').write_text('id,frame,x\n1,0,1\n')
    with pytest.raises(RecordingError, match=r'b.csv, line 1: the columns id,frame,x are not'):
        join_csv({n: tmp_path / f'{n}.csv' for n in 'ab'}, tmp_path / 'all.csv')
    assert not (tmp_path / 'all.csv').exists()
    join_csv({}, tmp_path / 'none.csv')
    assert (tmp_path / 'none.csv').read_text() == 'source\n'


def test_names_tell_recordings_apart():
    names = track_many._names
    assert names(['/d/a.mcap', '/d/b.mcap']) == ['a', 'b']
    assert names(['/d/mon/bag.mcap', '/d/tue/bag.mcap', '/d/c']) == ['mon_bag', 'tue_bag', 'c']
    assert names(['/d/walk', '/d/walk.mcap']) == ['d_walk', 'd_walk.mcap']
    assert len(set(names(['/a/b_c', '/a_b/c', '/x/c']))) == 3
    assert names(['/d/日本.mcap', '/d/中国.mcap']) == ['日本', '中国']
    with pytest.raises(ParameterError, match='rename one'):
        names(['/d/a b', '/d/a_b'])
    assert names(['/', '/d/a.mcap', '/.mcap']) == ['recording', 'a', 'mcap']


def contents(*folders: Path) -> dict[Path, bytes]:
    return {p: p.read_bytes() for f in folders for p in f.rglob('*') if p.is_file()}


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Sources of which no output needs to be made: they are refused before anything is read."""
    for name in (
        'd/a.mcap',
        'd/b.mcap',
        'd/seq/rgb/000000.png',
        'bag/metadata.yaml',
        'bag/x_0.mcap',
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f'years of work: {name}')
    (tmp_path / 'o').mkdir()
    (tmp_path / 'o' / 'tracks.csv').write_text(f'{tmp_path}/d/a.mcap')
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize('overwrite', [[], ['--overwrite']])
@pytest.mark.parametrize(
    'words',
    [
        ['d/a.mcap', 'd/b.mcap', '--output', 'new', '--bag', 'd'],
        ['d/a.mcap', '--output', 'new', '--bag', 'd'],
        ['d/a.mcap', '--output', 'new', '--bag', 'links'],
        ['d/a.mcap', '--output', 'links'],
        ['d/seq', 'd/a.mcap', '--output', 'd/seq'],
        ['d/seq', 'd/a.mcap', '--output', 'new', '--mot', 'd/seq/new'],
        ['bag/x_0.mcap', '--output', 'bag'],
        ['--list', 'o/tracks.csv', '--output', 'o'],
    ],
)
def test_no_source_is_written_to(places: Path, words: list[str], overwrite: list[str], capsys):
    (places / 'links').mkdir()
    (places / 'links' / 'a.mcap').symlink_to(places / 'd' / 'a.mcap')
    (places / 'links' / 'runs.jsonl').hardlink_to(places / 'd' / 'a.mcap')
    before = contents(places)
    assert main(['track', *words, *WORDS, *overwrite]) == 2
    error = capsys.readouterr().err
    assert 'is the source itself' in error or 'lies inside the source' in error
    assert contents(places) == before


def test_tables_of_something_else_are_not_replaced_unasked(
    recordings: Path, tmp_path: Path, capsys
):
    words = ['track', str(recordings / 'walk.mcap'), *WORDS, '--output', str(tmp_path)]
    for name in ('tracks.csv', 'sources.csv'):
        (tmp_path / name).write_text('years of work')
    before = contents(tmp_path)
    for part in ([], ['--shard', '1/1']):
        assert main([*words, *part]) == 2
        assert 'sources.csv and 1 more would be replaced' in capsys.readouterr().err
    assert contents(tmp_path) == before
    assert main([*words, '--overwrite']) == 0
    assert main(words) == 0, 'its own are gone on with'
    assert len(rows_of(tmp_path / 'tracks.csv')) == 5


def test_tables_of_other_recordings_are_not_replaced_unasked(
    recordings: Path, tracked: Path, tmp_path: Path, capsys
):
    out = tmp_path / 'out'
    shutil.copytree(tracked, out)
    before = results(out)
    walk = ['track', str(recordings / 'walk.mcap')]
    words = [*WORDS, '--output', str(out)]
    assert main([*walk, *words]) == 2
    assert 'sources.csv and 1 more would be replaced' in capsys.readouterr().err
    assert results(out) == before
    assert main([*walk, *words, '--overwrite']) == 0
    assert main([*walk, str(recordings / 'normal_0'), *words]) == 0, 'one more loses nothing'
    assert [r['name'] for r in rows_of(out / 'sources.csv')] == ['walk', 'normal_0']


def test_a_run_that_a_full_disk_ended_is_gone_on_with(
    recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
):
    """The file of a recording has its name, and the note that it is done did not fit."""
    places = ['--mot', str(tmp_path / 'mot'), '--output', str(tmp_path / 'o')]
    words = ['track', str(recordings / 'normal_0'), *WORDS, *places]

    def full(*_: object) -> None:
        raise RecordingError('No space left on device')

    with monkeypatch.context() as patch:
        patch.setattr(track_many, '_keep', full)
        assert main(words) == 2
    made = contents(tmp_path / 'o' / 'tracks', tmp_path / 'mot')
    assert len(made) == 2
    assert main([*words, '--param', 'padding=2.0']) == 2
    assert 'would be replaced' in capsys.readouterr().err
    assert main(words) == 0
    assert contents(tmp_path / 'o' / 'tracks', tmp_path / 'mot') == made


def test_a_list_that_is_a_pipe_is_not_waited_for(tmp_path: Path, capsys):
    os.mkfifo(tmp_path / 'pipe')
    words = ['track', '--list', str(tmp_path / 'pipe'), '--output', str(tmp_path / 'o')]
    assert main(words) == 2
    assert 'pipe is a named pipe' in capsys.readouterr().err


def test_names_that_are_no_utf8(recordings: Path, tmp_path: Path):
    sources = [tmp_path / os.fsdecode(name) for name in (b'a\xff.mcap', b'b\xff.mcap')]
    for source in sources:
        shutil.copy(recordings / 'walk.mcap', source)
    words = ['track', *map(str, sources), *WORDS, '--output', str(tmp_path / 'o')]
    assert main(words) == 0
    rows = rows_of(tmp_path / 'o' / 'sources.csv')
    assert [row['source'] for row in rows] == [f'{tmp_path}/{n}\\udcff.mcap' for n in 'ab']
    shutil.copy(recordings / 'normal_0' / 'groundtruth.txt', sources[0])
    assert main([*words, '--overwrite']) == track_many.EXIT_FAILURES, 'another content is seen'


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (['normal_0', 'normal_1'], 'give the folder for their files as --output'),
        (['normal_0', 'nothing', '--output', 'o'], 'nothing does not exist'),
        (['none_*', '--output', 'o'], 'none_* matches nothing'),
        (['--output', 'o'], 'no recordings'),
        # --param takes all words behind it
        (['--output', 'o', '--param', 'acceptance=0.6', 'normal_0'], "--param 'normal_0': write k"),
        (['--list', 'none.txt', '--output', 'o'], 'none.txt does not exist'),
        (['normal_*', '--output', 'o', '--variant', 'deep'], "unknown variant 'deep'"),
        (['normal_*', '--output', 'o', '--param', 'padding=x'], 'padding'),
        (['normal_*', '--output', 'o', '--init', '1,2'], 'is no box'),
        (['normal_*', '--output', 'o', '--shard', '3/2'], '--shard 3/2'),
        (['normal_*', '--output', 'o', '--cluster', 'none.json'], 'none.json does not exist'),
        (['normal_*', '--output', 'o', '--jobs', '0', '--mot', 'o2'], '--jobs is 0'),
        (['normal_0', '--output', 'o.csv', '--jobs', '4'], '--output o.csv would be a folder'),
    ],
)
def test_mistakes_are_told_before_any_work(
    recordings: Path, monkeypatch: pytest.MonkeyPatch, capsys, words, message: str
):
    monkeypatch.chdir(recordings)
    assert main(['track', *words]) == 2
    assert message in capsys.readouterr().err
    assert not list(recordings.glob('o*')), 'nor is an empty folder left'


def test_a_record_that_a_full_disk_does_not_take_is_not_left_empty(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    real = Path.open

    def full(path: Path, *given: Any, **more: Any) -> Any:
        real(path, *given, **more).close()
        return open('/dev/full', 'w', encoding='utf-8')

    monkeypatch.setattr(Path, 'open', full)
    with pytest.raises(RecordingError, match=r'runs\.jsonl cannot be written: No space'):
        record(tmp_path, 'one process')
    assert not list(tmp_path.iterdir())


def test_the_same_command_beside_itself_harms_neither(
    recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    words = ['track', str(recordings / 'normal_0'), *WORDS, '--output', str(tmp_path / 'o')]
    follow, ends = track.follow, list[int]()

    def beside(*given: Any, **more: Any) -> track.Outcome:
        done = follow(*given, **more)
        ends.append(0)
        if len(ends) == 1:  # the other ends before this one has given its file its name
            ends.append(main(words))
        return done

    monkeypatch.setattr(track, 'follow', beside)
    assert main(words) == 0
    assert ends == [0, 0, 0], 'each followed once, and the other ended well'
    assert [p.name for p in (tmp_path / 'o' / 'tracks').iterdir()] == ['normal_0.csv']


def test_rows_are_joined_whatever_their_files_are_called(tmp_path: Path) -> None:
    (tmp_path / 'a.csv').write_text('x\n1\n')
    join_csv({'a\udcff': tmp_path / 'a.csv'}, tmp_path / 'all.csv')
    assert (tmp_path / 'all.csv').read_text().splitlines()[1] == 'a\\udcff,1'


def test_a_worker_that_dies_leaves_nothing_half(recordings: Path, tmp_path: Path):
    """The name of a file is given when it is whole; what a dead worker left is cleared away."""
    output = tmp_path / 'o' / 'tracks'
    output.mkdir(parents=True)
    dead, alive = (output / f'.part-{token}-normal_0.csv' for token in ('0123abcd', '4567ef01'))
    for path in (dead, alive):
        path.write_text('half')
    os.utime(dead, (0, 0))
    words = ['track', f'{recordings}/normal_*', '--variant', 'kcf', '--output', str(output.parent)]
    assert main([*words, '--jobs', '2']) == 0
    assert sorted(p.name for p in output.iterdir()) == [alive.name, 'normal_0.csv', 'normal_1.csv']
    (line,) = (output.parent / 'runs.jsonl').read_text().splitlines()
    assert json.loads(line)['workers'] == LocalPool(2).describe()
