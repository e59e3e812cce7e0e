# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the storage formats of bags have in common: a scan over all messages, and random access.

A bag is scanned once when it is opened. The scan needs no index and reads whatever whole messages
there are, so a bag that was cut off, or never closed, opens like any other, with a warning.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

Where = tuple[int, int, int]
"""Place of a message in its storage; only the storage knows what the numbers mean."""

NANOSECONDS = 1_000_000_000
"""Of a second."""
BAG_SUFFIXES = ('.mcap', '.db3', '.bag')
"""How the names of bags end."""
HEAD = 12
"""Bytes of a message that the scan looks at: enough for the stamp of its header."""
CACHED_CHUNKS = 4
"""Chunks of a bag that are kept unpacked: those that the messages of a few topics lie in."""


@dataclass(frozen=True, slots=True)
class Scanned:
    """One message as the scan sees it.

    Attributes:
        topic, type: where it was sent, and its type in the ROS 2 form ``package/msg/Name``.
        log_ns: when it was recorded.
        head: its first bytes, up to :data:`HEAD`.
        where: for :meth:`Storage.read`.
    """

    topic: str
    type: str
    log_ns: int
    head: bytes
    where: Where


@dataclass(frozen=True, slots=True)
class Definition:
    """Text that defines a message type: ``encoding`` is 'ros2msg', 'ros2idl' or 'ros1msg'."""

    encoding: str
    text: str


class Storage(Protocol):
    """One file of a bag.

    Attributes:
        path: the file.
        ros1: messages are in ROS 1 serialisation, not CDR.
        topics: name to type of all topics, also those without messages; filled by :meth:`scan`.
        definitions: by type, as far as the file holds them; filled by :meth:`scan`.
        left_out: name to serialisation of topics that are not read; filled by :meth:`scan`.
        qos: name to the profiles of its publishers, as rosbag2 writes them (YAML), as far as the
            file holds them; filled by :meth:`scan`.
        unusable: how many messages are damaged, or of no topic that it holds; filled by
            :meth:`scan`.
        warnings: what else was odd; filled by :meth:`scan`.
    """

    path: Path
    ros1: bool
    topics: dict[str, str]
    definitions: dict[str, Definition]
    left_out: dict[str, str]
    qos: dict[str, str]
    unusable: int
    warnings: list[str]

    def scan(self) -> Iterator[Scanned]:
        """All whole messages, in the order of the file."""
        ...

    def read(self, where: Where) -> bytes:
        """The message at a place that :meth:`scan` gave."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...


@dataclass(slots=True)
class Topic:
    """Index of one topic: parallel arrays, one element per message, in the order of recording.

    Attributes:
        log_ns: when each was recorded.
        stamp_ns: stamp of each one's header; meaningful for types that begin with one.
        places: file number and :data:`Where`, four numbers a message.
    """

    name: str
    type: str
    log_ns: array[int] = field(default_factory=lambda: array('q'))
    stamp_ns: array[int] = field(default_factory=lambda: array('q'))
    places: array[int] = field(default_factory=lambda: array('q'))

    def __len__(self) -> int:
        return len(self.log_ns)

    def add(self, file: int, message: Scanned, ros1: bool) -> None:
        """Append a message of the scan."""
        self.log_ns.append(min(message.log_ns, (1 << 63) - 1))
        self.stamp_ns.append(header_stamp(message.head, ros1))
        self.places.extend((file, *message.where))

    def sort(self) -> None:
        """Put the messages in the order of recording time, where the file has another."""
        order = sorted(range(len(self)), key=self.log_ns.__getitem__)
        if order == list(range(len(self))):
            return
        self.log_ns = array('q', (self.log_ns[i] for i in order))
        self.stamp_ns = array('q', (self.stamp_ns[i] for i in order))
        self.places = array('q', (n for i in order for n in self.places[4 * i : 4 * i + 4]))


def header_stamp(head: bytes, ros1: bool) -> int:
    """Stamp in nanoseconds of a serialised message that begins with ``std_msgs/Header``.

    ROS 1 puts a sequence number before the stamp, CDR its own four bytes of encapsulation, the
    second of which tells the byte order. 0 where the bytes are too few.
    """
    if len(head) < HEAD:
        return 0
    if ros1:
        seconds, nanoseconds = struct.unpack_from('<II', head, 4)
    else:
        order = '<' if head[1] & 1 else '>'
        seconds, nanoseconds = struct.unpack_from(order + 'iI', head, 4)
    return int(seconds) * NANOSECONDS + int(nanoseconds)


def ros2_type(name: str) -> str:
    """``package/Name`` of ROS 1 as ``package/msg/Name``; the ROS 2 form unchanged."""
    package, _, rest = name.partition('/')
    return name if '/' in rest or not rest else f'{package}/msg/{rest}'
