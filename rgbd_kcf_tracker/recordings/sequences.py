# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Sequence folders: numbered images in ``rgb/`` and ``depth/`` with text files beside them."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

from rgbd_kcf_tracker.errors import ImageError, RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.files import is_there
from rgbd_kcf_tracker.recordings.imagefiles import (
    ImageFrames,
    depths_beside,
    even_stamps,
    head_of,
    image_files,
    missing_number,
    size_of,
    unnumbered,
)
from rgbd_kcf_tracker.recordings.mot import MOT_FILE, REGION_ID, read_mot
from rgbd_kcf_tracker.recordings.pairing import rising
from rgbd_kcf_tracker.recordings.recording import (
    NO_DEPTH,
    Closing,
    ReadOptions,
    RecordingInfo,
    StreamInfo,
    once,
)
from rgbd_kcf_tracker.recordings.refused import RefusedReadings
from rgbd_kcf_tracker.recordings.textfiles import (
    folder_intrinsics,
    known,
    read_boxes,
    read_stamps,
)

COLOR_FOLDERS = ('rgb', 'color', 'img')
DEPTH_FOLDER = 'depth'


def is_sequence_folder(path: Path) -> bool:
    """Whether ``path`` is a folder with a folder of colour images in it."""
    return color_folder(path) is not None


def color_folder(path: Path) -> Path | None:
    """The folder of colour images in a folder, None where none is."""
    return next((path / name for name in COLOR_FOLDERS if (path / name).is_dir()), None)


def folder_depths(
    path: Path, colors: tuple[Path, ...], warn: Callable[[str], None]
) -> tuple[Path | None, ...]:
    """The depth image of each colour image of a folder, None where it has none; empty: none has.

    Raises:
        RecordingError: where ``depth/`` holds none for any, or cannot be read.
    """
    folder = path / DEPTH_FOLDER
    if not folder.is_dir():
        if is_there(folder):
            warn(f'{folder} is no folder of images: read as colour alone')
        return ()
    depths = depths_beside(colors, folder)
    missing = depths.count(None)
    if missing == len(depths):
        raise RecordingError(
            f'no image in {folder} has the name of one in {colors[0].parent}: '
            'give colour and depth of a frame the same number'
        )
    if missing:
        warn(f'{missing} of {len(depths)} colour images have no depth image')
    return depths


def folder_stamps(
    path: Path, colors: tuple[Path, ...], fps: float, warn: Callable[[str], None]
) -> tuple[int, ...]:
    """The stamp of each colour image of a folder, ns: of ``timestamps.txt``, else at ``fps``.

    Raises:
        RecordingError: where its lines are not those of the images.
    """
    path = path / 'timestamps.txt'
    if not is_there(path):
        return even_stamps(len(colors), fps)
    if lost := unnumbered(colors):
        raise RecordingError(f'{lost}: which line of {path} is its? Number it, or take it out')
    stamps = tuple(read_stamps(path))
    if len(stamps) != len(colors):
        gap = missing_number(colors, len(stamps))
        hint = f', and {gap} is missing' if gap else ''
        raise RecordingError(
            f'{path} has {len(stamps)} lines for {len(colors)} images{hint}: write one per image'
        )
    back = sum(b <= a for a, b in pairwise(stamps))
    if back:
        warn(
            f'{path.name}: {back} stamps do not come after the one before; unless time jumps '
            'back by a second there, they are taken to be a nanosecond later'
        )
    return rising(stamps)


def _refuse_topics(path: Path, options: ReadOptions) -> None:
    depth = None if options.depth_topic == NO_DEPTH else options.depth_topic
    named = {'color': options.color_topic, 'depth': depth, 'info': options.info_topic}
    for kind, topic in named.items():
        if topic is not None:
            raise RecordingError(
                f'{path} is a folder of images, without topics: leave --{kind}-topic {topic} out '
                '(its camera is in intrinsics.json or camera_info.json, or given as --intrinsics)'
            )


class SequenceFolder(Closing):
    """A :class:`Recording` of a folder with ``rgb/``.

    Read where they are there: ``depth/``, ``groundtruth.txt``,
    ``groundtruth_body.txt``, ``timestamps.txt``, ``intrinsics.json`` and ``camera_info.json``.

    A depth image belongs to the colour image of the same name (without suffix).

    Raises:
        RecordingError: where the folder or one of its files is not as it should be.
    """

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self.path = path
        self.name = path.resolve().name
        self.warnings: list[str] = []
        _refuse_topics(path, options)
        colors = image_files(color_folder(path) or path / COLOR_FOLDERS[0])
        warn, no_depth = self.warnings.append, options.depth_topic == NO_DEPTH
        self._files = ImageFrames(
            colors,
            () if no_depth else folder_depths(path, colors, warn),
            folder_stamps(path, colors, options.fps, warn),
            options.intrinsics or folder_intrinsics(path, lambda: size_of(colors[0]), warn),
            options.max_pixels,
        )
        self.intrinsics: Intrinsics | None = self._files.intrinsics
        self.groundtruth = self._read_truth('groundtruth.txt')
        self.groundtruth_body = known(self._read_truth('groundtruth_body.txt'))
        self._warn = once(self.warnings)

    def __len__(self) -> int:
        return len(self._files)

    def frames(self, start: int = 0, end: int | None = None) -> Iterator[Frame]:
        """See :meth:`Recording.frames`."""
        odd = RefusedReadings()
        try:
            for index in range(max(start, 0), min(len(self), len(self) if end is None else end)):
                yield self._files.frame(index, self._warn, odd)
        finally:
            odd.tell(self._warn)

    def info(self) -> RecordingInfo:
        """See :meth:`Recording.info`."""
        stamps = self._files.stamps_ns
        gaps = [b - a for a, b in pairwise(stamps) if b > a]
        rate = 1e9 / statistics.median(gaps) if gaps else None
        depths = [p for p in self._files.depths if p is not None]
        streams = [_stream(self._files.colors[0].parent.name, self._files.colors, rate, 'color')]
        if depths:
            streams.append(_stream(DEPTH_FOLDER, depths, rate, 'depth'))
        for name, boxes in (
            ('groundtruth.txt', self.groundtruth),
            ('groundtruth_body.txt', self.groundtruth_body),
        ):
            if boxes is not None:
                streams.append(StreamInfo(name, 'boxes', len(boxes), role='truth'))
        truth, warnings = self.groundtruth, list(self.warnings)
        shown = None if truth is None else sum(box is not None for box in truth)
        several = self.path / MOT_FILE
        if truth is None and is_there(several):
            try:
                rows = read_mot(several, len(self), regions=True)
                streams.append(StreamInfo(MOT_FILE, 'people', len(rows.ids), role='truth'))
                shown = len(set(rows.frames[rows.ids != REGION_ID].tolist()))
            except RecordingError as error:
                warnings.append(str(error))
        return RecordingInfo(
            path=self.path,
            kind='sequence folder',
            frames=len(self),
            frames_with_depth=len(depths),
            duration_s=(stamps[-1] - stamps[0]) / 1e9,
            rate_hz=rate,
            streams=tuple(streams),
            intrinsics=self.intrinsics,
            truth_frames=shown,
            warnings=tuple(warnings),
        )

    def close(self) -> None:
        """Nothing stays open."""

    def _read_truth(self, name: str) -> list[Box | None] | None:
        path = self.path / name
        if not is_there(path):
            return None
        boxes = read_boxes(path)
        if fault := self._out_of_step(len(boxes)):
            self.warnings.append(f'{name} is left out, as its lines are of other images: {fault}')
            return None
        if len(boxes) > len(self):
            self.warnings.append(
                f'{name} has {len(boxes)} lines for {len(self)} images: the last are left out'
            )
        elif len(boxes) < len(self):
            self.warnings.append(
                f'{name} has {len(boxes)} lines for {len(self)} images: '
                'the last images are taken as not annotated'
            )
        return boxes[: len(self)]

    def _out_of_step(self, lines: int) -> str:
        """Why a line of a text file is not of the image of the same count; '' where it may be."""
        colors = self._files.colors
        if lost := unnumbered(colors):
            return lost
        gap = missing_number(colors, lines) if lines > len(colors) else None
        return (
            f'it has {lines}, there are {len(colors)} images, and {gap} is missing' if gap else ''
        )


def _stream(name: str, paths: Sequence[Path], rate: float | None, role: str) -> StreamInfo:
    try:
        head = head_of(paths[0])
    except ImageError as error:
        return StreamInfo(name, 'images', len(paths), rate, None, str(error), role)
    encoding = f'{head.name} {head.channels}x{head.bits} bit'
    return StreamInfo(name, 'images', len(paths), rate, (head.width, head.height), encoding, role)
