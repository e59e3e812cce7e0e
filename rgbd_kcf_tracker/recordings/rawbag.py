# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A bag of any format as an index of topics and a way to read each message."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from heapq import merge
from pathlib import Path
from typing import Any, cast

import yaml

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.compression import unpack, unpack_file
from rgbd_kcf_tracker.recordings.files import listing, open_file, read_text
from rgbd_kcf_tracker.recordings.mcap_storage import McapStorage
from rgbd_kcf_tracker.recordings.ros1_storage import Ros1Storage
from rgbd_kcf_tracker.recordings.sqlite_storage import SqliteStorage
from rgbd_kcf_tracker.recordings.storage import (
    BAG_SUFFIXES,
    Definition,
    Storage,
    Topic,
    header_stamp,
)
from rgbd_kcf_tracker.recordings.textfiles import natural_key

_PARTS = 'relative_file_paths'
_STORAGES: dict[bytes, Callable[[Path], Storage]] = {
    b'\x89MCAP': McapStorage,
    b'#ROSBAG': Ros1Storage,
    b'SQLite': SqliteStorage,
}
"""By the first bytes of a file."""


class RawBag:
    """All messages of a bag, still serialised.

    Args:
        path: an ``.mcap``, ``.db3`` or ROS 1 ``.bag`` file, or a folder of rosbag2, with or without
            its ``metadata.yaml``.

    Attributes:
        kind: what it is, for people.
        topics: by name, in the order of names.
        definitions: texts of message types, as far as the bag holds them.
        ros1: the messages are in ROS 1 serialisation.
        left_out: name to serialisation of topics that are not read.
        qos: name to the profiles of its publishers, as rosbag2 writes them, where known.
        warnings: what was odd.

    Raises:
        RecordingError: where it is no bag or cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.left_out: dict[str, str] = {}
        self.qos: dict[str, str] = {}
        self.warnings: list[str] = []
        self.definitions: dict[str, Definition] = {}
        self._temporary: tempfile.TemporaryDirectory[str] | None = None
        self._storages: list[Storage] = []
        self._message_method = ''
        try:
            files = self._files_of_folder() if path.is_dir() else [path]
            for file in files:
                self._storages.append(_open_storage(file))
            self.ros1 = any(s.ros1 for s in self._storages)
            self.kind = self._describe()
            self.topics = self._scan()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close all files."""
        for storage in self._storages:
            storage.close()
        if self._temporary is not None:
            self._temporary.cleanup()
            self._temporary = None

    def read(self, topic: Topic, index: int) -> bytes:
        """The serialised message number ``index`` of a topic.

        Raises:
            RecordingError: where it cannot be read.
        """
        file, *where = topic.places[4 * index : 4 * index + 4]
        data = self._storages[file].read((where[0], where[1], where[2]))
        try:
            return unpack(self._message_method, data)
        except RecordingError as error:
            raise RecordingError(f'{self.path}: message {index} of {topic.name}: {error}') from None

    def message(self, topic: Topic, index: int) -> Any:
        """The message number ``index`` of a topic, with its fields.

        Raises:
            RecordingError: where it cannot be read, or its bytes are not of the topic's type.
        """
        return self.deserialize(topic, self.read(topic, index), index)

    def deserialize(self, topic: Topic, data: bytes, index: int) -> Any:
        """Serialised bytes of a topic as a message with its fields; see :meth:`message`."""
        store = typestore(self.ros1)
        try:
            if self.ros1:
                return store.deserialize_ros1(data, topic.type)
            return store.deserialize_cdr(data, topic.type)
        except Exception as error:  # a hostile message makes the library raise anything
            raise RecordingError(
                f'{self.path}: message {index} of {topic.name} is no {topic.type}: '
                f'{error or type(error).__name__}'
            ) from None

    def in_order(self, names: Collection[str] | None = None) -> Iterator[tuple[Topic, int]]:
        """Messages by time of recording, those of one time by their place in the file.

        Args:
            names: of the topics wanted; None for all.

        Yields:
            Topic, and number of the message in it.
        """
        chosen = [t for t in self.topics.values() if names is None or t.name in names]
        for _, _, number, index in merge(*(_by_time(n, t) for n, t in enumerate(chosen))):
            yield chosen[number], index

    def _scan(self) -> dict[str, Topic]:
        topics: dict[str, Topic] = {}
        others: Counter[str] = Counter()
        for number, storage in enumerate(self._storages):
            for message in storage.scan():
                topic = topics.get(message.topic)
                if topic is None:
                    topic = topics[message.topic] = Topic(message.topic, message.type)
                if topic.type != message.type:
                    others[topic.name] += 1
                    continue
                topic.add(number, message, storage.ros1)
                if self._message_method:
                    try:
                        head = unpack(self._message_method, storage.read(message.where))
                        topic.stamp_ns[-1] = header_stamp(head, storage.ros1)
                    except RecordingError:  # whoever reads it is told
                        topic.stamp_ns[-1] = message.log_ns
            for name, kind in storage.topics.items():
                topics.setdefault(name, Topic(name, kind))
            self.definitions.update(storage.definitions)
            self.left_out |= storage.left_out
            self.qos |= storage.qos
            self.warnings += storage.warnings
            if storage.unusable:
                self.warnings.append(
                    f'{storage.path}: {storage.unusable} messages are left out: '
                    'they are damaged, or of no topic that it holds'
                )
        for name, count in others.items():
            self.warnings.append(
                f'{self.path}: {count} messages of {name} are left out: '
                f'they are of another type than its first, {topics[name].type}'
            )
        for topic in topics.values():
            topic.sort()
        return dict(sorted(topics.items()))

    def _files_of_folder(self) -> list[Path]:
        metadata = self._metadata()
        names: list[str] = []
        if metadata:
            names = [Path(str(name)).name for name in metadata.get(_PARTS) or ()]
            mode = str(metadata.get('compression_mode') or '').lower()
            if mode == 'message':
                self._message_method = str(metadata.get('compression_format') or 'zstd')
        inside = sorted(listing(self.path), key=lambda p: natural_key(p.name))
        present = {p.name: p for p in inside if p.name.removesuffix('.zstd').endswith(BAG_SUFFIXES)}
        missing = [name for name in names if name not in present]
        if missing:
            shown = ', '.join(missing[:5]) + (' ...' if len(missing) > 5 else '')
            if not present:
                raise RecordingError(
                    f'{self.path} holds none of the files that its metadata.yaml names: {shown}'
                )
            self.warnings.append(f'{self.path}: metadata.yaml names {shown}, which is not there')
        found = [present[n] for n in names if n in present] + [
            p for n, p in present.items() if n not in names
        ]
        kinds = {p.name.removesuffix('.zstd').rpartition('.')[2] for p in found}
        if not found:
            raise RecordingError(
                f'{self.path} is no recording: it holds neither .mcap, .db3 nor .bag files, nor a '
                'folder rgb with images'
            )
        if len(kinds) > 1 or kinds == {'bag'}:
            raise RecordingError(
                f'{self.path} holds several recordings ({", ".join(p.name for p in found[:5])}): '
                'name one of them'
            )
        if not metadata:
            self.warnings.append(
                f'{self.path} has no metadata.yaml: all its {kinds.pop()} files are read as one bag'
            )
        return [self._unzipped(p) if p.suffix == '.zstd' else p for p in found]

    def _metadata(self) -> dict[str, Any]:
        path = self.path / 'metadata.yaml'
        if not path.exists():
            return {}
        try:
            content = yaml.safe_load(read_text(path))
            information = dict(content['rosbag2_bagfile_information'])
            if not isinstance(information.get(_PARTS, []), list | None):
                raise TypeError(_PARTS)
            return information
        except (RecordingError, RecursionError, ValueError, TypeError, KeyError, yaml.YAMLError):
            self.warnings.append(f'{path} cannot be understood: it is left out')
            return {}

    def _unzipped(self, path: Path) -> Path:
        if self._temporary is None:
            self._temporary = tempfile.TemporaryDirectory(prefix='rgbd_kcf_')
        target = Path(self._temporary.name) / path.name.removesuffix('.zstd')
        unpack_file(path, target)
        return target

    def _describe(self) -> str:
        kind = {McapStorage: 'mcap', SqliteStorage: 'sqlite3', Ros1Storage: 'ROS 1 bag'}[
            cast(Any, type(self._storages[0]))
        ]
        return f'rosbag2 folder ({kind})' if self.path.is_dir() else kind


def _by_time(number: int, topic: Topic) -> Iterator[tuple[int, tuple[int, ...], int, int]]:
    for index, log_ns in enumerate(topic.log_ns):
        yield log_ns, tuple(topic.places[4 * index : 4 * index + 3]), number, index


def _open_storage(path: Path) -> Storage:
    """The storage for a file, by its first bytes; its name is only asked for the message."""
    with open_file(path) as file:
        head = file.read(16)
    if not head:
        raise RecordingError(f'{path} is empty: nothing was recorded')
    for begin, storage in _STORAGES.items():
        if head.startswith(begin):
            return storage(path)
    raise RecordingError(
        f'{path} is no recording: it is neither an MCAP file, a rosbag2 database nor a ROS 1 bag'
    )


def is_bag_file(path: Path) -> bool:
    """Whether a file is one of a bag, by its first bytes.

    Raises:
        RecordingError: where it cannot be read.
    """
    with open_file(path) as file:
        return file.read(16).startswith(tuple(_STORAGES))


_TYPESTORES: dict[bool, Any] = {}


def typestore(ros1: bool = False) -> Any:
    """The message types of ROS 2 Jazzy or, for old bags, ROS 1 Noetic (rosbags' typestore)."""
    if ros1 not in _TYPESTORES:
        from rosbags.typesys import Stores, get_typestore

        _TYPESTORES[ros1] = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_JAZZY)
    return _TYPESTORES[ros1]
