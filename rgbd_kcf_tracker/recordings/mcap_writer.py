# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""MCAP files of CDR messages, readable by ROS 2, Foxglove and ourselves, even after kill -9."""

from __future__ import annotations

import os
from typing import Any, cast

from mcap.writer import CompressionType, Writer

from rgbd_kcf_tracker.errors import ParameterError, RecordingError
from rgbd_kcf_tracker.recordings.outputs import FrameWriter, OutputFile, cannot_write
from rgbd_kcf_tracker.recordings.rawbag import typestore
from rgbd_kcf_tracker.recordings.storage import Definition

COMPRESSIONS = ('none', 'lz4', 'zstd')
DEFAULT_COMPRESSION = 'zstd'

# Large enough for the index to stay small, small enough that a kill loses little: an image fills a
# chunk by itself.
_CHUNK = 256 * 1024


class McapWriter(FrameWriter):
    """Writes messages as they come.

    Args:
        path: the file.
        compression: of the chunks: none, lz4 or zstd.
        overwrite: replace a file that is there.

    Attributes:
        output: the file.

    Raises:
        RecordingError: where it cannot be written, or is there already.
        ParameterError: for another compression.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        compression: str = DEFAULT_COMPRESSION,
        overwrite: bool = False,
    ) -> None:
        if compression not in COMPRESSIONS:
            raise ParameterError(
                f'compression is {compression!r}: choose one of {", ".join(COMPRESSIONS)}'
            )
        self.output = OutputFile(path, overwrite)
        self.path = self.output.path
        self._file = self.output.file
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        try:
            self._writer = Writer(
                cast(Any, self._file),
                chunk_size=_CHUNK,
                compression=CompressionType[compression.upper()],
            )
            self._writer.start(profile='ros2', library='rgbd_kcf_tracker')
            self._file.flush()
        except OSError as error:
            self.output.end(whole=False, anything=False)
            raise RecordingError(cannot_write(self.path, error)) from None
        except BaseException:  # Ctrl-C, and nobody else knows of the file yet
            self.output.end(whole=False, anything=False)
            raise

    def write(self, topic: str, message: Any, log_ns: int) -> None:
        """Write a message of rosbags' ROS 2 typestore.

        Raises:
            RecordingError: where it cannot be written.
        """
        kind = message.__msgtype__
        self.write_raw(topic, kind, typestore().serialize_cdr(message, kind), log_ns)

    def write_raw(
        self,
        topic: str,
        kind: str,
        data: bytes | memoryview,
        log_ns: int,
        definition: Definition | None = None,
        qos: str = '',
    ) -> None:
        """Write a message that is CDR already.

        Args:
            topic: where to.
            kind: its type, ``package/msg/Name``.
            data: the serialised message.
            log_ns: time of recording; MCAP has none before 1970, and takes 1970 for it.
            definition: text of the type; needed for types that ROS 2 Jazzy does not bring.
            qos: profiles of the topic's publishers as rosbag2 writes them, for whoever replays it;
                the first message's count.

        Raises:
            RecordingError: where it cannot be written.
        """
        log_ns = max(log_ns, 0)
        if self._file.closed:
            raise RecordingError(f'{self.path} is closed: nothing more can be written to it')
        try:
            channel = self._channels.get(topic)
            if channel is None:
                channel = self._register(topic, kind, definition, qos)
            number = self._counts[topic] = self._counts.get(topic, -1) + 1
            self._writer.add_message(
                channel, log_ns, cast(bytes, data), publish_time=log_ns, sequence=number
            )
            self._file.flush()
        except OSError as error:
            raise RecordingError(cannot_write(self.path, error)) from None

    def flush(self) -> None:
        """Hand all that was written to the system: from here on a kill loses none of it.

        Raises:
            RecordingError: where it cannot be written.
        """
        try:
            cast(Any, self._writer).flush()
        except OSError as error:
            raise RecordingError(cannot_write(self.path, error)) from None

    def close(self, whole: bool = True) -> None:
        """Write the index and close the file; one without a message is removed.

        Args:
            whole: all messages are written: only then does it replace another.

        Raises:
            RecordingError: where it cannot be written.
        """
        if self._file.closed:
            return
        try:
            cast(Any, self._writer).finish()
            self._file.flush()
        except OSError as error:
            self.output.end(whole=False, anything=bool(self._counts))
            raise RecordingError(cannot_write(self.path, error)) from None
        self.output.end(whole=whole, anything=bool(self._counts))

    def _register(self, topic: str, kind: str, definition: Definition | None, qos: str) -> int:
        if definition is None or definition.encoding == 'ros1msg':
            definition = Definition('ros2msg', definition_text(kind))
        schema = self._writer.register_schema(kind, definition.encoding, definition.text.encode())
        channel = self._writer.register_channel(
            topic, 'cdr', schema, metadata={'offered_qos_profiles': qos}
        )
        self._channels[topic] = channel
        return channel


def definition_text(kind: str) -> str:
    """Text of a message type and of those in it, as mcap's ``ros2msg`` schemas want it."""
    text, _ = typestore().generate_msgdef(kind, ros_version=2)
    return str(text)
