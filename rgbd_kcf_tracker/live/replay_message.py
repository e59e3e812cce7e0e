# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One message on its way from a recording to the wire."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Role(Enum):
    """What a message is to a tracker."""

    COLOR = 'color'
    DEPTH = 'depth'
    OTHER = 'other'


@dataclass(frozen=True, slots=True)
class Message:
    """A serialised message of a recording.

    Attributes:
        topic: where it was recorded.
        time_ns: when it was recorded, nanoseconds.
        data: CDR, as it goes on the wire.
        role: what it is to a tracker.
        stamp_ns: stamp of its header, for colour and depth images.
    """

    topic: str
    time_ns: int
    data: bytes
    role: Role = Role.OTHER
    stamp_ns: int = 0
