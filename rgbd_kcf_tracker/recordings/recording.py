# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What every source of recorded frames offers, and how to choose what is read."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, TypeVar

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.camera_info import AUTO, RECTIFIED
from rgbd_kcf_tracker.recordings.containers import MAX_PIXELS

C = TypeVar('C', bound='Closing')

MIN_FPS, MAX_FPS = 1e-3, 1e6

NO_DEPTH = 'none'
"""As ``depth_topic``: read colour alone."""
WITHOUT_DEPTH = 'read without depth'
"""In the warning of a frame whose depth image is damaged: by it who checks a recording counts."""


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """How a recording is read.

    Attributes:
        color_topic: the colour topic of a bag, or None to find it.
        depth_topic: the depth topic of a bag, None to find it, ``'none'`` to read colour alone.
        info_topic: the CameraInfo topic of a bag, or None to find it.
        tolerance_s: largest distance of stamps, in seconds, within a colour and depth pair; 0 pairs
            equal stamps only. None: 20 ms, or up to half a second, with a warning, where not one
            pair is as near as that (single shots, slow cameras).
        fps: frames per second of a sequence folder without ``timestamps.txt``.
        intrinsics: used instead of the recording's own.
        rectified: whether the colour images of a bag are rectified, so that ``P`` of CameraInfo is
            their camera: ``yes``, ``no``, or ``auto`` to go by the topic's name.
        max_pixels: of the largest image that is read.

    Raises:
        ParameterError: for a negative tolerance, a rate out of its range, or a limit that is not
            above 0, or another word for ``rectified``.
    """

    color_topic: str | None = None
    depth_topic: str | None = None
    info_topic: str | None = None
    tolerance_s: float | None = None
    fps: float = 30.0
    intrinsics: Intrinsics | None = None
    rectified: str = AUTO
    max_pixels: int = MAX_PIXELS

    def __post_init__(self) -> None:
        if not MIN_FPS <= self.fps <= MAX_FPS:
            raise ParameterError(
                f'fps is {self.fps:g}: it must be between {MIN_FPS:g} and {MAX_FPS:g}'
            )
        if self.tolerance_s is not None and not 0 <= self.tolerance_s <= 3600:
            raise ParameterError(f'tolerance is {self.tolerance_s:g} s: give 0 to 3600')
        if self.rectified not in RECTIFIED:
            raise ParameterError(
                f'rectified is {self.rectified!r}: choose one of {", ".join(RECTIFIED)}'
            )
        if self.max_pixels < 1:
            raise ParameterError(f'max_pixels is {self.max_pixels}: it must be above 0')


@dataclass(frozen=True, slots=True)
class StreamInfo:
    """One topic, folder or file of a recording, for people to read.

    Attributes:
        name: topic, or name of the folder or file.
        type: message type, or kind of file.
        count: messages or files.
        rate_hz: of the stamps, median; None where unknown.
        size: ``(width, height)`` of the first image, None where it is none.
        encoding: of the first image, as in the message or the file's kind.
        role: 'color', 'depth', 'info' or 'truth' for what is used, else ''.
    """

    name: str
    type: str
    count: int
    rate_hz: float | None = None
    size: tuple[int, int] | None = None
    encoding: str = ''
    role: str = ''


@dataclass(frozen=True, slots=True)
class RecordingInfo:
    """What is in a recording; made by :meth:`Recording.info`.

    Attributes:
        path: where it lies.
        kind: for instance 'mcap', 'rosbag2 folder (sqlite3)', 'ROS 1 bag', 'sequence folder'.
        frames: how many frames it gives.
        frames_with_depth: how many of them have depth.
        duration_s: between the first and the last stamp.
        rate_hz: median rate of the frames; None below two frames.
        streams: all topics or folders.
        intrinsics: of the colour camera, None where unknown.
        truth_frames: frames with a ground-truth box; None without ground truth.
        problem: why no frames can be read (as the error says it), or ''.
        warnings: what was odd.
    """

    path: Path
    kind: str
    frames: int
    frames_with_depth: int
    duration_s: float
    rate_hz: float | None
    streams: tuple[StreamInfo, ...]
    intrinsics: Intrinsics | None = None
    truth_frames: int | None = None
    problem: str = ''
    warnings: tuple[str, ...] = field(default=())


def once(warnings: list[str]) -> Callable[[str], None]:
    """Adds to a list of warnings what is not in it."""
    told = set(warnings)

    def tell(text: str) -> None:
        if text not in told:
            told.add(text)
            warnings.append(text)

    return tell


class Closing(ABC):
    """What is closed at the end of its ``with`` block."""

    @abstractmethod
    def close(self) -> None:
        """Close the files."""

    def __enter__(self: C) -> C:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Recording(Protocol):
    """A source of frames in time order. Use it in a ``with`` block, or :meth:`close` it.

    Attributes:
        name: short name, without folders and suffix.
        path: where it lies.
        intrinsics: of the colour camera, or None.
        warnings: what was odd, in whole sentences; grows while frames are read.
    """

    name: str
    path: Path
    intrinsics: Intrinsics | None
    warnings: list[str]

    @property
    def groundtruth(self) -> Sequence[Box | None] | None:
        """Box of the visible part per frame, None where absent; None: no ground truth.

        It may be shorter than the recording: frames after its end are not annotated.
        """
        ...

    @property
    def groundtruth_body(self) -> Sequence[Box | None] | None:
        """The same for the whole body, None where not given."""
        ...

    def __len__(self) -> int:
        """Number of frames."""
        ...

    def frames(self, start: int = 0, end: int | None = None) -> Iterator[Frame]:
        """The frames from ``start`` up to and without ``end``, in time order.

        Raises:
            RecordingError: where the recording cannot be read on.
            ImageError: for a colour image that cannot be decoded, naming it.
        """
        ...

    def info(self) -> RecordingInfo:
        """What is in the recording."""
        ...

    def close(self) -> None:
        """Close the files."""
        ...

    def __enter__(self) -> Recording: ...

    def __exit__(self, *_: object) -> None: ...
