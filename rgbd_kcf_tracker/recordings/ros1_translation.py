# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""ROS 1 messages put into ROS 2's types and serialisation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosbags.convert import converter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.rawbag import RawBag
from rgbd_kcf_tracker.recordings.storage import Definition

_RENAMED = {'tf/msg/tfMessage': 'tf2_msgs/msg/TFMessage'}

Convert = Callable[[bytes], 'bytes | memoryview']


class Ros1Translator:
    """Turns messages of a ROS 1 bag into CDR of the ROS 2 type of the same name.

    Types that ROS 2 Jazzy does not have are taken over with the definition in the bag; of those
    that changed, new fields are filled with defaults.
    """

    def __init__(self, bag: RawBag) -> None:
        self._from: Any = get_typestore(Stores.EMPTY)
        self._to: Any = get_typestore(Stores.ROS2_JAZZY)
        self._found: dict[str, tuple[str, Definition, Convert] | None] = {}
        types: dict[str, Any] = {}
        for kind, definition in bag.definitions.items():
            try:
                types.update(get_types_from_msg(definition.text, kind))
            except (
                Exception
            ):  # a hostile text makes the parser raise anything; its topic is left out
                continue
        self._from.register(types)
        self._cache: dict[str, object] = {}

    def type_of(self, kind: str) -> tuple[str, Definition] | None:
        """ROS 2 type and its text for a type of the bag; None where it cannot be translated."""
        if kind not in self._found:
            try:
                self._found[kind] = self._prepare(kind)
            except Exception:  # the library raises anything for types that lack their parts
                self._found[kind] = None
        found = self._found[kind]
        return None if found is None else found[:2]

    def data(self, kind: str, data: bytes) -> bytes | memoryview:
        """A message in CDR.

        Raises:
            RecordingError: where it is damaged.
        """
        found = self._found[kind]
        assert found is not None
        try:
            return found[2](data)
        except Exception as error:  # a hostile message makes the library raise anything
            raise RecordingError(f'it is no {kind}: {error or type(error).__name__}') from None

    def checked(self, kind: str, data: bytes) -> bytes | memoryview:
        """The same, where a reader of ROS 2 takes it: text goes over as it is, also if no UTF-8.

        Raises:
            RecordingError: where it is damaged, or no reader would take it.
        """
        translated, found = self.data(kind, data), self.type_of(kind)
        assert found is not None
        try:
            self._to.deserialize_cdr(translated, found[0])
        except Exception as error:  # as above
            raise RecordingError(f'it is no {found[0]}: {error or type(error).__name__}') from None
        return translated

    def _prepare(self, kind: str) -> tuple[str, Definition, Convert]:
        target = _RENAMED.get(kind, kind)
        if target not in self._to.types:
            missing = {
                name: fields
                for name, fields in self._from.fielddefs.items()
                if name not in self._to.fielddefs
            }
            self._to.register(missing)
        text, _ = self._to.generate_msgdef(target, ros_version=2)
        definition = Definition('ros2msg', str(text))
        if converter.is_same_wireformat(self._from, self._to, kind, target):
            return target, definition, lambda data: self._to.ros1_to_cdr(data, target)

        def migrate(data: bytes) -> memoryview:
            return converter.migrate_bytes(
                self._from, self._to, kind, target, self._cache, data, src_is2=False, dst_is2=True
            )

        return target, definition, migrate
