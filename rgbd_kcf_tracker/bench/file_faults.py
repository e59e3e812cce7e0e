# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Small recordings of every kind, and what can befall them, what is written, and what is typed."""

from __future__ import annotations

import os
import shutil
import socket
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import GENERIC, BagWriter, SequenceWriter
from rgbd_kcf_tracker.recordings.rawbag import RawBag, typestore
from rgbd_kcf_tracker.simulation import simulate

SIZE = (160, 90)
FRAMES = 12
RATE = 12.0


@dataclass(slots=True)
class Trial:
    """One run of a command: what it is given, and what befell it.

    Attributes:
        rng: of everything that is drawn.
        source: the recording that is read, a copy of its own.
        out: an empty folder to write into, outside of the source.
        box: of the target in the first frame, as ``--init`` takes it.
        words: further arguments.
        outputs: what the command shall write, by option.
        fault: what befell it, in words.
        file_limit: bytes after which a written file meets a full disk.
        signal_after: share of the time that it takes undisturbed after which it is signalled.
        signal: which one, 0 for none.
        without_rights: whether the rights of files hold for it, also where it is run by root.
    """

    rng: np.random.Generator
    source: Path
    out: Path
    box: str
    words: list[str] = field(default_factory=list)
    outputs: dict[str, Path] = field(default_factory=dict)
    fault: str = 'none'
    file_limit: int | None = None
    signal_after: float = 0.0
    signal: int = 0
    without_rights: bool = False

    def files(self) -> list[Path]:
        """The files of the source."""
        if not self.source.is_dir():
            return [self.source]
        return sorted(p for p in self.source.rglob('*') if p.is_file())

    def any_file(self) -> Path:
        """One of them, text files as often as images."""
        files = self.files()
        groups = sorted({p.parent if p.parent != self.source else p for p in files})
        chosen = groups[int(self.rng.integers(len(groups)))]
        among = [p for p in files if p == chosen or p.parent == chosen]
        return among[int(self.rng.integers(len(among)))]


Fault = Callable[[Trial], None]


def materials(folder: Path) -> tuple[dict[str, Path], str]:
    """A recording of every kind that is read, by its kind, and the target's box in all of them."""
    scene = simulate('occlusion', seed=3, rate_hz=RATE, duration_s=FRAMES / RATE, size=SIZE)
    made = {'folder': folder / 'folder', 'mcap': folder / 'a.mcap', 'plain': folder / 'plain.mcap'}
    first: Box | None = None
    with (
        SequenceWriter(made['folder']) as images,
        BagWriter(made['mcap'], GENERIC) as packed,
        BagWriter(made['plain'], GENERIC, compression='none') as plain,
    ):
        for moment in scene:
            first = first or moment.visible
            images.write(moment.frame, moment.visible, moment.body, moment.visible_fraction)
            for bag in (packed, plain):
                bag.write_frame(moment.frame)
                bag.write_truth(moment.frame, moment.visible, moment.body)
    made |= _by_rosbags(made['plain'], folder)
    assert first is not None
    return made, ','.join(f'{value:g}' for value in first.as_tuple())


def _by_rosbags(source: Path, folder: Path) -> dict[str, Path]:
    """The same messages in the formats that we read and do not write."""
    from rosbags.rosbag1 import Writer as Ros1Writer
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Ros2Writer

    store = typestore()
    places = {'rosbag2': folder / 'rosbag2', 'sqlite': folder / 'sqlite', 'ros1': folder / 'a.bag'}
    bag = RawBag(source)
    with (
        Ros2Writer(places['rosbag2'], version=9, storage_plugin=StoragePlugin.MCAP) as mcap,
        Ros2Writer(places['sqlite'], version=9, storage_plugin=StoragePlugin.SQLITE3) as sqlite,
        Ros1Writer(places['ros1']) as old,
    ):
        topics = {
            t.name: (
                mcap.add_connection(t.name, t.type, typestore=store),
                sqlite.add_connection(t.name, t.type, typestore=store),
                old.add_connection(t.name, t.type, typestore=typestore(ros1=True)),
            )
            for t in bag.topics.values()
        }
        for topic, index in bag.in_order():
            data, stamp = bag.read(topic, index), topic.log_ns[index]
            ours = topics[topic.name]
            mcap.write(ours[0], stamp, data)
            sqlite.write(ours[1], stamp, data)
            old.write(ours[2], stamp, bytes(store.cdr_to_ros1(data, topic.type)))
    bag.close()
    return places


# -- of the source -----------------------------------------------------------------------------


def _truncated(trial: Trial) -> None:
    path = trial.any_file()
    os.truncate(path, int(trial.rng.integers(path.stat().st_size + 1)))


def _flipped(trial: Trial) -> None:
    path = trial.any_file()
    data = np.fromfile(path, np.uint8)
    if len(data):
        places = trial.rng.integers(len(data), size=int(trial.rng.integers(1, 20)))
        data[places] ^= trial.rng.integers(1, 256, len(places)).astype(np.uint8)
        path.write_bytes(data.tobytes())


def _zeroed(trial: Trial) -> None:
    path = trial.any_file()
    data = bytearray(path.read_bytes())
    at = int(trial.rng.integers(len(data) + 1))
    length = min(4096, len(data) - at)
    data[at : at + length] = bytes(length)
    path.write_bytes(data)


def _grown(trial: Trial) -> None:
    with trial.any_file().open('ab') as file:
        file.write(trial.rng.bytes(int(trial.rng.integers(1, 5000))))


def _noise(trial: Trial) -> None:
    path = trial.any_file()
    head = path.read_bytes()[:16]
    path.write_bytes(head + trial.rng.bytes(int(trial.rng.integers(20_000))))


def _emptied(trial: Trial) -> None:
    os.truncate(trial.any_file(), 0)


def _removed(trial: Trial) -> None:
    trial.any_file().unlink()


def _exchanged(trial: Trial) -> None:
    """One file in the place of another; a single one loses its first half."""
    path = trial.any_file()
    others = [p for p in trial.files() if p != path]
    if others:
        data = others[int(trial.rng.integers(len(others)))].read_bytes()
    else:
        data = path.read_bytes()[path.stat().st_size // 2 :]
    path.write_bytes(data)


NUMBERS = (
    'nan', 'inf', '-inf', '1e308', '-1e308', '-5', '0', '4294967246', '1e-300', '', 'x', '9' * 400,
)  # fmt: skip


def _odd_number(trial: Trial) -> None:
    """A number of a text file replaced; a byte flipped where there is no text file."""
    texts = [p for p in trial.files() if p.suffix in ('.txt', '.json', '.yaml')]
    if not texts:
        return _flipped(trial)
    path = texts[int(trial.rng.integers(len(texts)))]
    lines = path.read_text().splitlines()
    at = int(trial.rng.integers(len(lines)))
    cells = lines[at].split(',')
    number = NUMBERS[int(trial.rng.integers(len(NUMBERS)))]
    cells[int(trial.rng.integers(len(cells)))] = number
    lines[at] = ','.join(cells)
    path.write_text('\n'.join(lines))
    return None


COLUMNS = {
    'messages': ('topic_id', 'timestamp', 'data'),
    'topics': ('id', 'name', 'type', 'serialization_format'),
}
CELLS = (
    'NULL', "'text'", "''", '1.5', '1e300', "x'00ff'", '0', '-5', '9223372036854775807',
    '-9223372036854775808',
)  # fmt: skip


def _odd_cell(trial: Trial) -> None:
    """A value of another type, or far from any, in rows of a database; else a byte flipped."""
    databases = [p for p in trial.files() if p.suffix == '.db3']
    if not databases:
        return _flipped(trial)
    table = sorted(COLUMNS)[int(trial.rng.integers(len(COLUMNS)))]
    column = COLUMNS[table][int(trial.rng.integers(len(COLUMNS[table])))]
    cell = CELLS[int(trial.rng.integers(len(CELLS)))]
    with closing(sqlite3.connect(databases[0])) as database, database:
        # A copy takes anything: the columns of rosbag2's own must not be NULL.
        database.execute(f'ALTER TABLE {table} RENAME TO old')
        database.execute(f'CREATE TABLE {table} AS SELECT * FROM old')
        database.execute('DROP TABLE old')
        every = int(trial.rng.integers(1, 8))
        database.execute(f'UPDATE {table} SET {column} = {cell} WHERE rowid % {every} = 0')
    return None


def _pipe(trial: Trial) -> None:
    path = trial.any_file()
    path.unlink()
    os.mkfifo(path)


def _socket(trial: Trial) -> None:
    path = trial.any_file()
    path.unlink()
    here = Path.cwd()
    os.chdir(path.parent)  # the path of a socket must be short
    try:
        with closing(socket.socket(socket.AF_UNIX)) as server:
            server.bind(path.name[-90:])
    finally:
        os.chdir(here)


def _device(trial: Trial) -> None:
    path = trial.any_file()
    path.unlink()
    path.symlink_to(('/dev/zero', '/dev/full', '/dev/tty')[int(trial.rng.integers(3))])


def _loop(trial: Trial) -> None:
    path = trial.any_file()
    path.unlink()
    path.symlink_to(path)


def _link_to_nothing(trial: Trial) -> None:
    path = trial.any_file()
    path.unlink()
    path.symlink_to(path.with_name('nothing'))


def _folder_for_file(trial: Trial) -> None:
    path = trial.any_file()
    path.unlink()
    path.mkdir()


def _folder_in_a_circle(trial: Trial) -> None:
    (trial.source / 'again').symlink_to(trial.source)


def _unreadable(trial: Trial) -> None:
    place = trial.source if trial.rng.random() < 0.3 else trial.any_file()
    place.chmod(0)
    trial.without_rights = True


def _odd_name(trial: Trial) -> None:
    other = trial.source.with_name(os.fsdecode(b'caf\xe9 \n\xff') + trial.source.suffix)
    trial.source = trial.source.rename(other)


def _hidden_beside(trial: Trial) -> None:
    """What macOS leaves beside the files that it copies to a foreign disk."""
    for path in trial.files():
        path.with_name(f'._{path.name}').write_bytes(trial.rng.bytes(int(trial.rng.integers(200))))


def _line_ends(trial: Trial) -> None:
    """Text files as an editor on another system writes them."""
    for path in [p for p in trial.files() if p.suffix in ('.txt', '.json', '.yaml')]:
        path.write_bytes(b'\xef\xbb\xbf' + path.read_bytes().replace(b'\n', b'\r\n'))


SOURCE_FAULTS: dict[str, Fault] = {
    'truncated': _truncated,
    'bytes flipped': _flipped,
    'a block zeroed': _zeroed,
    'grown': _grown,
    'noise': _noise,
    'emptied': _emptied,
    'removed': _removed,
    'exchanged': _exchanged,
    'an odd number': _odd_number,
    'an odd cell': _odd_cell,
    'a pipe': _pipe,
    'a socket': _socket,
    'a device': _device,
    'a link to itself': _loop,
    'a link to nothing': _link_to_nothing,
    'a folder for a file': _folder_for_file,
    'a folder in a circle': _folder_in_a_circle,
    'not readable': _unreadable,
    'a name that is no UTF-8': _odd_name,
    'hidden files beside': _hidden_beside,
    'line ends of another system': _line_ends,
}


OF_FOLDERS = ('a folder in a circle',)
"""What befalls no source that is a single file."""


# -- of what is written ------------------------------------------------------------------------


def _any_option(trial: Trial) -> str:
    options = sorted(trial.outputs)
    return options[int(trial.rng.integers(len(options)))]


def _full_disk(trial: Trial) -> None:
    trial.file_limit = int(10 ** trial.rng.uniform(0, 6))


def _onto_the_source(trial: Trial) -> None:
    trial.outputs[_any_option(trial)] = trial.any_file()
    trial.words.append('--overwrite')


def _into_the_source(trial: Trial) -> None:
    option = _any_option(trial)
    place = trial.source if trial.source.is_dir() else trial.source / 'inside'
    trial.outputs[option] = place / trial.outputs[option].name


def _onto_a_link_to_the_source(trial: Trial) -> None:
    option = _any_option(trial)
    path = trial.outputs[option]
    target = trial.any_file()
    (os.link if trial.rng.random() < 0.5 else os.symlink)(target, path)
    trial.words.append('--overwrite')


def _there_already(trial: Trial) -> None:
    for path in trial.outputs.values():
        path.write_text('years of work')
    if trial.rng.random() < 0.5:
        trial.words.append('--overwrite')


def _the_same(trial: Trial) -> None:
    first = trial.outputs[sorted(trial.outputs)[0]]
    for option in trial.outputs:
        trial.outputs[option] = first


def _no_folder(trial: Trial) -> None:
    option = _any_option(trial)
    trial.outputs[option] = trial.out / 'none' / trial.outputs[option].name


def _no_right_to_write(trial: Trial) -> None:
    trial.out.chmod(0o500)
    trial.without_rights = True


def _special_output(trial: Trial) -> None:
    path = trial.outputs[_any_option(trial)]
    kind = int(trial.rng.integers(4))
    if kind == 0:
        os.mkfifo(path)
    elif kind == 1:
        path.symlink_to(path)
    elif kind == 2:
        path.symlink_to('/dev/full')
    else:
        path.mkdir()
    if trial.rng.random() < 0.5:
        trial.words.append('--overwrite')


OUTPUT_FAULTS: dict[str, Fault] = {
    'a full disk': _full_disk,
    'onto the source': _onto_the_source,
    'into the source': _into_the_source,
    'onto a link to the source': _onto_a_link_to_the_source,
    'there already': _there_already,
    'outputs are one': _the_same,
    'no folder': _no_folder,
    'no right to write': _no_right_to_write,
    'a pipe, link, device or folder as output': _special_output,
}


# -- of what is typed --------------------------------------------------------------------------

READING_OPTIONS = {
    '--fps': 1, '--tolerance': 1, '--intrinsics': 4, '--max-pixels': 1, '--color-topic': 1,
    '--depth-topic': 1, '--rectified': 1,
}  # fmt: skip
TRACK_OPTIONS = {'--init': 4, '--start': 1, '--end': 1, '--param': 1}


def odd_option(trial: Trial, options: dict[str, int]) -> None:
    """A value that is none, or far from any that is meant."""
    names = sorted(options)
    option = names[int(trial.rng.integers(len(names)))]
    usual = trial.box.split(',') if options[option] == 4 else ['30']
    numbers = [
        NUMBERS[int(trial.rng.integers(len(NUMBERS)))] if trial.rng.random() < 0.5 else value
        for value in usual
    ]
    value = ','.join(numbers)
    if option == '--param':
        name = ('padding', 'learning_rate', 'kernel', 'none')[int(trial.rng.integers(4))]
        value = f'{name}={value}'
    if option == '--fps' and trial.source.is_dir():
        (trial.source / 'timestamps.txt').unlink(missing_ok=True)  # or nothing asks for it
    if option == '--init':
        trial.box = value
    else:
        trial.words += [option, value]


def copied(source: Path, folder: Path) -> Path:
    """A copy of a recording that may be damaged."""
    target = folder / source.name
    if source.is_dir():
        shutil.copytree(source, target)
    else:
        shutil.copy(source, target)
    return target


def readable(path: Path) -> str:
    """Why a file that was written cannot be read, or ''."""
    if not path.exists():
        return f'{path.name} is not there'
    if path.is_dir():
        return '' if (path / 'index.html').exists() else f'{path.name} holds no report'
    if not path.stat().st_size:
        return f'{path.name} is empty'
    if path.suffix == '.csv':
        rows = path.read_text().splitlines()
        return '' if len(rows) > 1 and rows[0].startswith('frame,') else f'{path.name} has no row'
    if path.suffix == '.mcap':
        bag = RawBag(path)
        read = sum(bag.message(topic, index) is not None for topic, index in bag.in_order())
        bag.close()
        return '' if read and not bag.warnings else f'{path.name}: {read} messages, {bag.warnings}'
    return ''
