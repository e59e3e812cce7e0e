# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Messages of rosbags' ROS 2 Jazzy typestore by the names of their types, for bags."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.recordings.rawbag import typestore


class BagTypes:
    """Messages of rosbags' ROS 2 Jazzy typestore, which :class:`McapWriter` writes."""

    def make(self, kind: str, /, **fields: Any) -> Any:
        """See :class:`~rgbd_kcf_tracker.recordings.message_types.MessageTypes`."""
        missing = {name: empty() for name, empty in _empty_fields(kind) if name not in fields}
        return typestore().types[kind](**fields, **missing)

    def octets(self, data: npt.NDArray[np.uint8]) -> Any:
        """See :class:`~rgbd_kcf_tracker.recordings.message_types.MessageTypes`."""
        return data


BAG_TYPES = BagTypes()


def register(definitions: Mapping[str, str]) -> None:
    """Let :data:`BAG_TYPES` make messages of further types, by name and text."""
    new = {kind: text for kind, text in definitions.items() if kind not in typestore().types}
    if new:
        from rosbags.typesys import get_types_from_msg

        found = {}
        for kind, text in new.items():
            found.update(get_types_from_msg(text, kind))
        typestore().register(found)


@cache
def _empty_fields(kind: str) -> tuple[tuple[str, Callable[[], Any]], ...]:
    return tuple((name, _empty(how)) for name, how in typestore().fielddefs[kind][1])


def _empty(description: Any) -> Callable[[], Any]:
    """What makes the empty value of a field, from rosbags' description of it."""
    node, what = description
    if node.name == 'BASE':
        return {'string': str, 'bool': bool}.get(what[0], float if 'float' in what[0] else int)
    if node.name == 'NAME':
        return lambda: BAG_TYPES.make(what)
    (element, name), length = what
    if element.name == 'BASE' and name[0] != 'string':
        return lambda: np.zeros(length, 'uint8' if name[0] in ('byte', 'char') else name[0])
    single = _empty((element, name))
    return lambda: [single() for _ in range(length)]
