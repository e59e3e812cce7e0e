# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A real Dask cluster of processes, and parts: the same report, byte for byte, as one process."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from itertools import count
from pathlib import Path

import pytest

import rgbd_kcf_tracker
import rgbd_kcf_tracker.batch.cluster
from rgbd_kcf_tracker.batch.cluster import Cluster
from rgbd_kcf_tracker.batch.environment import environment
from rgbd_kcf_tracker.batch.loop import run_all
from rgbd_kcf_tracker.batch.shards import Shard
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import DatasetError, WorkersError
from rgbd_kcf_tracker.evaluation import runner
from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets import Opened, Sequence, open_dataset
from rgbd_kcf_tracker.evaluation.jobs import Failure, RunOptions
from rgbd_kcf_tracker.evaluation.parts import Whole, join, write_part
from rgbd_kcf_tracker.evaluation.report import Heading

distributed = pytest.importorskip(
    'distributed', reason="needs Dask: pip install 'rgbd_kcf_tracker[cluster]'"
)
dask = pytest.importorskip('dask')

SCENES = [
    'sim:normal,occlusion', '--seeds', '1-2', '--duration', '0.5', '--rate', '10',
    '--size', '320x180', '--variants', 'kcf,rgbd',
]  # fmt: skip
OF_A_MACHINE = ('times', 'times.csv', 'runs.jsonl', 'parts')
KCF = Contender('kcf', 'variant', 'kcf')


def results(folder: Path) -> dict[str, bytes]:
    """All that a run left, but for what tells when and where it was made."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob('*')
        if path.is_file() and path.relative_to(folder).parts[0] not in OF_A_MACHINE
    }


def assert_same(one: Path, other: Path) -> None:
    left, right = results(one), results(other)
    assert len(left) > 20
    assert {k for k in {*left, *right} if left.get(k) != right.get(k)} == set()


@contextmanager
def local_cluster(**options) -> Iterator:
    with (
        # Where a worker is away 15 s after one died, Dask gives it up; on a busy machine that may
        # be another one, which died meanwhile.
        dask.config.set({'distributed.deploy.lost-worker-timeout': '1h'}),
        distributed.LocalCluster(
            processes=True, dashboard_address=':0', **{'threads_per_worker': 1, **options}
        ) as cluster,
    ):
        yield cluster


@pytest.fixture(scope='module')
def cluster() -> Iterator:
    with local_cluster(n_workers=2) as made:
        yield made


@pytest.fixture(scope='module')
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('serial') / 'report'
    assert main(['evaluate', *SCENES, '--jobs', '1', '--report', str(folder)]) == 0
    return folder


# --- the same bytes


def test_a_pool_of_processes_gives_the_same_bytes(serial: Path, tmp_path: Path):
    assert main(['evaluate', *SCENES, '--jobs', '2', '--report', str(tmp_path / 'r')]) == 0
    assert_same(serial, tmp_path / 'r')


def test_a_cluster_gives_the_same_bytes(cluster, serial: Path, tmp_path: Path):
    address = cluster.scheduler_address
    assert main(['evaluate', *SCENES, '--cluster', address, '--report', str(tmp_path / 'r')]) == 0
    assert_same(serial, tmp_path / 'r')
    (line,) = (tmp_path / 'r' / 'runs.jsonl').read_text().splitlines()
    assert json.loads(line)['workers'] == f'Dask cluster at {address}'


def test_parts_joined_give_the_same_bytes(serial: Path, tmp_path: Path, capsys):
    for i in (1, 2, 3):
        words = [*SCENES, '--jobs', '1', '--shard', f'{i}/3', '--report', str(tmp_path / f'{i}')]
        assert main(['evaluate', *words]) == 0
    parts = [str(tmp_path / f'{i}') for i in (3, 1, 2)]
    assert main(['evaluate', '--merge', *parts[:2], '--report', str(tmp_path / 'r')]) == 2
    assert '1 of 3 parts are missing: run --shard 2/3' in capsys.readouterr().err
    assert main(['evaluate', '--merge', *parts, '--report', str(tmp_path / 'r')]) == 0
    assert_same(serial, tmp_path / 'r')


def test_what_a_part_lacks_is_named_where_parts_are_joined(tmp_path: Path, capsys):
    words = [*SCENES, '--jobs', '1', '--report', str(tmp_path / 'r')]
    for part in ('1/2', '2/2'):
        assert main(['evaluate', *words, '--shard', part]) == 0
    (tmp_path / 'r' / 'results' / 'rgbd' / 'normal_2.csv').unlink()
    join_it = ['evaluate', '--merge', str(tmp_path / 'r'), '--report', str(tmp_path / 'r')]
    capsys.readouterr()
    assert main(join_it) == 2
    said = '1 runs are missing: normal/2 (rgbd): run --shard 2/2 again'
    assert said in capsys.readouterr().err
    assert main(['evaluate', *words, '--shard', '2/2']) == 0
    assert main(join_it) == 0


def test_a_run_that_failed_is_not_missing_where_parts_are_joined(tmp_path: Path):
    sequences = [Sequence(name, 's', 'folder', broken, name) for name in ('a', 'b')]
    lost = [Failure('a', '', 'gone'), Failure('b', 'kcf', 'gone')]
    own = Whole(sequences, [KCF], RunOptions(code='x'), Heading(('data',)), lost)
    write_part(tmp_path / '1', Shard(1, 1), sequences, own)
    assert join([tmp_path / '1'], tmp_path / 'r').failures == lost


def test_a_report_that_is_joined_writes_into_no_part_by_a_link(tmp_path: Path, capsys):
    for i in (1, 2):
        words = [*SCENES, '--jobs', '1', '--shard', f'{i}/2', '--report', str(tmp_path / f'{i}')]
        assert main(['evaluate', *words]) == 0
    whole = tmp_path / 'r'
    whole.mkdir()
    (whole / 'runs.jsonl').symlink_to(tmp_path / '1' / 'runs.jsonl')
    before = (tmp_path / '1' / 'runs.jsonl').read_bytes()
    parts = [str(tmp_path / '1'), str(tmp_path / '2')]
    capsys.readouterr()
    assert main(['evaluate', '--merge', *parts, '--report', str(whole)]) == 2
    assert 'runs.jsonl leads into the source' in capsys.readouterr().err
    assert (tmp_path / '1' / 'runs.jsonl').read_bytes() == before
    (whole / 'runs.jsonl').unlink()
    assert main(['evaluate', '--merge', *parts, '--report', str(whole)]) == 0
    assert (tmp_path / '1' / 'runs.jsonl').read_bytes() == before


def test_parts_in_one_shared_folder_are_joined_in_place(serial: Path, tmp_path: Path):
    shared = str(tmp_path / 'r')
    for part in ('2/2', '1/2'):
        assert main(['evaluate', *SCENES, '--jobs', '1', '--shard', part, '--report', shared]) == 0
    assert main(['evaluate', '--merge', shared, '--report', shared]) == 0
    assert_same(serial, tmp_path / 'r')


def test_boxes_in_files_are_joined_without_the_files(serial: Path, tmp_path: Path):
    shutil.copytree(serial / 'results' / 'kcf', tmp_path / 'peer')
    words = [*SCENES[:-1], 'kcf', '--boxes', f'peer={tmp_path / "peer"}', '--jobs', '1']
    assert main(['evaluate', *words, '--report', str(tmp_path / 'one')]) == 0
    for part in ('1/2', '2/2'):
        assert main(['evaluate', *words, '--shard', part, '--report', str(tmp_path / 'r')]) == 0
    shutil.rmtree(tmp_path / 'peer')
    assert main(['evaluate', '--merge', str(tmp_path / 'r'), '--report', str(tmp_path / 'r')]) == 0
    assert_same(tmp_path / 'one', tmp_path / 'r')


def test_people_of_one_recording_are_known_as_such_where_parts_are_joined(tmp_path: Path):
    for part, place in ((1, '/here'), (2, '/there')):  # the same data on two machines
        sequences = [
            Sequence(name, 's', 'folder', broken, name, path=Path(place, name[0]))
            for name in ('a/ann', 'a/bob', 'b')
        ]
        shard = Shard(part, 2)
        own = Whole(shard.of(sequences), [], RunOptions(code='x'), Heading(('data',)), [])
        write_part(tmp_path / str(part), shard, sequences, own)
    whole = join([tmp_path / '1', tmp_path / '2'], tmp_path / 'r')
    assert [s.recording for s in whole.sequences] == ['a/ann', 'a/ann', 'b']
    (old,) = (tmp_path / '2').glob('**/2_of_2.json')
    old.write_text(old.read_text().replace('"recording":', '"of":'))
    with pytest.raises(DatasetError, match='written by another version: run all parts again'):
        join([tmp_path / '1', tmp_path / '2'], tmp_path / 'r')


def test_any_executor_gives_the_same_bytes(tmp_path: Path):
    sequences = [small('1'), small('2')]
    with ThreadPoolExecutor(2) as executor:
        assert not runner.run(sequences, [KCF], tmp_path / 'a', RunOptions(), workers=executor)
    runner.run(sequences, [KCF], tmp_path / 'b', RunOptions())
    assert results(tmp_path / 'a') == results(tmp_path / 'b') != {}


def test_parts_of_different_runs_are_not_joined(tmp_path: Path, capsys):
    for i, variants in ((1, 'kcf'), (2, 'rgbd')):
        words = [*SCENES[:-1], variants, '--jobs', '1', '--shard', f'{i}/2']
        assert main(['evaluate', *words, '--report', str(tmp_path / f'{i}')]) == 0
    parts = [str(tmp_path / '1'), str(tmp_path / '2')]
    assert main(['evaluate', '--merge', *parts, '--report', str(tmp_path / 'r')]) == 2
    assert 'parts of different runs: their contenders differ' in capsys.readouterr().err
    same = ['--jobs', '1', '--shard', '1/2', '--report', str(tmp_path / 'again')]
    assert main(['evaluate', *SCENES[:-1], 'kcf', *same]) == 0
    (part,) = (tmp_path / 'again').glob('**/1_of_2.json')
    part.write_text(part.read_text().replace('"part": 1', '"more": 0, "part": 1'))
    twice = [str(tmp_path / '1'), str(tmp_path / 'again')]
    assert main(['evaluate', '--merge', *twice, '--report', str(tmp_path / 'r')]) == 2
    assert 'are the same part with other results' in capsys.readouterr().err
    assert main(['evaluate', '--merge', str(tmp_path), '--report', str(tmp_path / 'r')]) == 2
    assert 'holds no part' in capsys.readouterr().err
    (tmp_path / 'circle').symlink_to('circle')
    circle = str(tmp_path / 'circle')
    assert main(['evaluate', '--merge', circle, '--report', str(tmp_path / 'r')]) == 2
    assert 'circle holds no part' in capsys.readouterr().err


def test_a_run_goes_on_in_another_place_where_it_was(
    serial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """As on another machine: folder and data lie elsewhere, and every file is new."""
    data = tmp_path / 'here' / 'data'
    data.parent.mkdir()
    words = ['--scenario', 'normal', '--duration', '0.5', '--rate', '10', '--size', '320x180']
    assert main(['simulate', str(data), *words, '--count', '2']) == 0
    told = ['--variants', 'kcf', '--jobs', '1', '--shard', '1/2']
    assert main(['evaluate', str(data), *told, '--report', str(tmp_path / 'one')]) == 0
    shutil.copytree(tmp_path / 'here', tmp_path / 'there')
    shutil.copytree(tmp_path / 'one', tmp_path / 'two')
    shutil.rmtree(tmp_path / 'here')
    shutil.rmtree(tmp_path / 'one')
    ran = []
    run_job = runner.run_job
    monkeypatch.setattr(runner, 'run_job', lambda job: ran.append(job) or run_job(job))
    assert main(['evaluate', str(tmp_path / 'there' / 'data'), *told[:-2], '--report',
                 str(tmp_path / 'two')]) == 0  # fmt: skip
    assert [job.sequence.name for job in ran] == ['normal_1'], 'normal_0 was done'


# --- workers that die


def waits(folder: Path, name: str) -> Opened:
    """A sequence that says which process runs it, and waits there for the first time."""
    marker = folder / name
    if not marker.exists():
        marker.write_text(f'{os.getpid()}')
        time.sleep(60)
    (opened,) = open_dataset('sim:normal:1')[:1]
    from rgbd_kcf_tracker.evaluation.datasets import simulated

    assert opened.kind == 'sim'
    return simulated.load('normal', 1, 10.0, 0.5, (320, 180))


def kills() -> Opened:
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


def broken() -> Opened:
    raise DatasetError('rgb/000003.png cannot be read')


def small(name: str) -> Sequence:
    (sequence,) = open_dataset(f'sim:normal:{name}')
    from rgbd_kcf_tracker.evaluation.datasets import simulated

    opener = partial(simulated.load, 'normal', int(name), 10.0, 0.5, (320, 180))
    return Sequence(name, 'normal', 'sim', opener, sequence.identity)


def test_a_worker_killed_in_mid_run_changes_no_byte(cluster, tmp_path: Path):
    waiting = Sequence('waiting', 'normal', 'sim', partial(waits, tmp_path, 'waiting'), 'waiting')
    sequences = [small('1'), waiting, small('2'), small('3')]
    killed = []

    def kill() -> None:
        marker = tmp_path / 'waiting'
        while not (marker.exists() and marker.read_text()):
            time.sleep(0.02)
        killed.append(int(marker.read_text()))
        os.kill(killed[0], signal.SIGKILL)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    with Cluster(cluster.scheduler_address) as workers:
        failures = runner.run(sequences, [KCF], tmp_path / 'cluster', RunOptions(), workers=workers)
    thread.join(10)
    assert failures == []
    assert killed
    runner.run(sequences, [KCF], tmp_path / 'serial', RunOptions())
    one, other = results(tmp_path / 'cluster'), results(tmp_path / 'serial')
    assert len(one) == 4 * 4
    assert one == other


@pytest.fixture(scope='module')
def fragile() -> Iterator:
    """A cluster that gives a job up when one worker died of it."""
    with (
        dask.config.set({'distributed.scheduler.allowed-failures': 0}),
        local_cluster(n_workers=1) as made,
    ):
        yield made


def test_a_job_that_kills_every_worker_and_one_that_fails_are_rows(fragile, tmp_path: Path):
    sequences = [
        small('1'),
        Sequence('kills', 'normal', 'sim', kills, 'kills'),
        Sequence('broken', 'normal', 'sim', broken, 'broken'),
        small('2'),
    ]
    with Cluster(fragile.scheduler_address) as workers:
        failures = runner.run(sequences, [KCF], tmp_path, RunOptions(), workers=workers)
    assert [f.sequence for f in failures] == ['kills', 'broken']
    assert 'worker died each time' in failures[0].reason
    assert 'rgb/000003.png cannot be read' in failures[1].reason
    assert {p.stem for p in (tmp_path / 'results' / 'kcf').glob('*.csv')} == {'1', '2'}


class Lost:
    """A result that kills its worker when it is fetched for the first time."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple:
        marker = self.folder / 'fetched'
        if not marker.exists():
            marker.touch()
            kills()
        return str, ('found again',)


def lost(folder: Path, number: int) -> Lost:
    """Runs, is lost, kills the worker that runs it for what was lost, and runs once more."""
    before = len(list(folder.glob('run*')))
    (folder / f'run{before}').touch()
    if before == 1:
        kills()
    return Lost(folder)


def test_a_job_whose_result_is_lost_and_that_then_kills_its_worker_runs_again(
    fragile, tmp_path: Path
):
    with Cluster(fragile.scheduler_address) as workers:
        (done,) = run_all(partial(lost, tmp_path), [1], workers)
    assert (done.result, done.error) == ('found again', None)


class Unreadable:
    def __reduce__(self) -> tuple:
        return int, ('no number',)


def unreadable(number: int) -> Unreadable:
    return Unreadable()


def test_a_result_that_cannot_be_read_here_is_an_error(cluster):
    with Cluster(cluster.scheduler_address) as workers:
        (done,) = run_all(unreadable, [1], workers)
    assert isinstance(done.error, ValueError)


def test_where_no_worker_is_left_it_is_said(monkeypatch: pytest.MonkeyPatch):
    for name, value in (('NO_WORKER_S', 0.2), ('_COUNT_AGAIN_S', 0.05)):
        monkeypatch.setattr(rgbd_kcf_tracker.batch.cluster, name, value)
    monkeypatch.setattr(rgbd_kcf_tracker.batch.loop, 'LOOK_AGAIN_S', 0.05)
    with local_cluster(n_workers=1) as made, Cluster(made.scheduler_address) as workers:
        jobs = run_all(str, count(), workers)
        assert next(jobs).error is None
        made.scale(0)
        with pytest.raises(WorkersError, match=r'no workers for 0\.2 s: what is done is kept'):
            list(jobs)


def test_a_scheduler_that_goes_away_is_one_error_and_what_is_done_is_kept(tmp_path: Path):
    with local_cluster(n_workers=1) as cluster:
        ended = []

        def report(done: int, name: str, found: bool) -> None:
            if done and not ended:
                ended.append(True)
                cluster.close(timeout=5)

        with (
            # For so long the client looks for the scheduler anew.
            Cluster(cluster.scheduler_address, timeout_s=5.0) as workers,
            pytest.raises(WorkersError, match='what is done is kept'),
        ):
            runner.run(
                [small(f'{i}') for i in range(1, 30)], [KCF], tmp_path, RunOptions(), report,
                workers,
            )  # fmt: skip
    assert len(list((tmp_path / 'results' / 'kcf').glob('*.csv'))) >= 1


# --- one clear error before any work


def refused(where: str, **more) -> str:
    with pytest.raises(WorkersError) as caught:
        Cluster(where, **{'timeout_s': 2.0, **more})
    return str(caught.value)


def test_no_scheduler(tmp_path: Path, capsys):
    assert 'no Dask scheduler answers at tcp://127.0.0.1:9' in refused('tcp://127.0.0.1:9')
    assert 'no Dask scheduler answers at localhost:x' in refused('localhost:x')
    assert 'none.json does not exist' in refused(str(tmp_path / 'none.json'))
    (tmp_path / 'some.json').write_text('{}')
    assert 'is no scheduler file' in refused(str(tmp_path / 'some.json'))
    words = [*SCENES, '--cluster', str(tmp_path / 'none.json'), '--report', str(tmp_path / 'r')]
    assert main(['evaluate', *words]) == 2
    assert main(['evaluate', *words, '--jobs', '2']) == 2
    assert 'leave it out with --cluster' in capsys.readouterr().err
    assert not (tmp_path / 'r').exists()


def test_a_scheduler_file_leads_to_the_scheduler(cluster, tmp_path: Path):
    path = tmp_path / 'scheduler.json'
    path.write_text(json.dumps({'address': cluster.scheduler_address}))
    with Cluster(str(path)) as workers:
        assert workers.slots() >= 2


def test_no_workers():
    with local_cluster(n_workers=0) as cluster:
        assert 'has no workers: start some' in refused(cluster.scheduler_address)


def test_workers_of_several_threads():
    with local_cluster(n_workers=1, threads_per_worker=2) as cluster:
        message = refused(cluster.scheduler_address)
    assert '(2 threads)' in message
    assert '--nthreads 1' in message


def test_workers_without_the_data_or_the_output_folder(cluster, tmp_path: Path):
    address = cluster.scheduler_address
    message = refused(address, needs=[tmp_path, tmp_path / 'data'])
    assert f'({tmp_path / "data"})' in message
    assert 'do not have the data' in message
    message = refused(address, writes=[tmp_path / 'out'])
    assert 'cannot write the output folder' in message


@contextmanager
def worker_of(package: Path, address: str) -> Iterator[None]:
    """A worker whose package is another one."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'distributed.cli.dask_worker', address, '--nthreads', '1',
         '--no-nanny', '--no-dashboard'],
        env={**os.environ, 'PYTHONPATH': str(package.parent)}, cwd=package.parent,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        yield
    finally:
        process.kill()
        process.wait(10)


@pytest.mark.parametrize('missing', [False, True])
def test_workers_with_another_package(tmp_path: Path, missing: bool):
    package = tmp_path / 'rgbd_kcf_tracker'
    shutil.copytree(
        Path(rgbd_kcf_tracker.__file__).parent, package,
        ignore=shutil.ignore_patterns('__pycache__'),
    )  # fmt: skip
    if missing:
        # A folder left out would be found in the checkout where that is installed editable.
        (package / 'batch' / '__init__.py').write_text('raise ModuleNotFoundError(__name__)\n')
    init = package / '__init__.py'
    version = rgbd_kcf_tracker.__version__
    init.write_text(init.read_text().replace(f"'{version}'", "'9.9.9'"))
    with local_cluster(n_workers=0) as cluster, worker_of(package, cluster.scheduler_address):
        message = refused(cluster.scheduler_address, timeout_s=20.0)
    if missing:
        assert f'cannot import this rgbd_kcf_tracker ({version})' in message
    else:
        assert f'rgbd_kcf_tracker 9.9.9, here {version}' in message
        assert 'install the same versions on every machine' in message


def test_a_worker_that_comes_later_with_other_code_gives_no_results(tmp_path: Path):
    options = RunOptions(code='another')
    (failure,) = runner.run([small('1')], [KCF], tmp_path, options)
    assert environment().version in failure.reason
    assert 'install the same' in failure.reason
    assert not (tmp_path / 'results').exists()
