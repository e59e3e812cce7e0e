# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Benchmark sequences out of folders, bags and simulated scenes.

One module per format; :func:`open_dataset` finds out which it is.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from rgbd_kcf_tracker.errors import DatasetError, RecordingError
from rgbd_kcf_tracker.evaluation.datasets import (
    everyone,
    folder,
    otb,
    princeton,
    recorded,
    simulated,
    vot,
)
from rgbd_kcf_tracker.evaluation.datasets.base import (
    BROKEN,
    Opened,
    Sample,
    Sequence,
    UnreadableError,
    broken,
    entries,
)
from rgbd_kcf_tracker.recordings.files import require_source
from rgbd_kcf_tracker.recordings.recording import ReadOptions
from rgbd_kcf_tracker.recordings.textfiles import natural_key

__all__ = ['KINDS', 'DatasetOptions', 'Opened', 'Sample', 'Sequence', 'open_dataset']

KINDS = ('auto', 'folder', 'otb', 'vot', 'cdtb', 'depthtrack', 'princeton', 'recording', 'sim')
"""Formats; cdtb and depthtrack are vot's folders by another name."""

_SAME_AS_VOT = ('vot', 'cdtb', 'depthtrack')
_DEPTH = 3
"""How many folders deep sequences are looked for."""


@dataclass(frozen=True, slots=True)
class DatasetOptions:
    """How data sets are found and read.

    Attributes:
        kind: format, or 'auto' to find it out for each folder.
        fps: rate of image folders that do not state theirs.
        seeds: of simulated scenes.
        scenarios: of simulated scenes: leave out all others; empty for none.
        rate_hz: at which scenes are rendered; recordings are thinned out by the runner.
        duration_s: of simulated scenes, None for their own.
        size: of simulated images.
        names: leave out sequences whose name holds none of these texts; empty for none.
        everyone: recordings in which everyone is followed, instead of one target each.
        color_topic, depth_topic, info_topic: of the camera in bags; None to find them.
    """

    kind: str = 'auto'
    fps: float = 30.0
    seeds: tuple[int, ...] = (1,)
    scenarios: tuple[str, ...] = ()
    rate_hz: float | None = None
    duration_s: float | None = None
    size: tuple[int, int] = (960, 540)
    names: tuple[str, ...] = ()
    everyone: bool = False
    color_topic: str | None = None
    depth_topic: str | None = None
    info_topic: str | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise DatasetError(f'unknown kind {self.kind!r}: choose one of {", ".join(KINDS)}')


def open_dataset(text: str, options: DatasetOptions | None = None) -> list[Sequence]:
    """The sequences of a data set, not opened yet.

    Args:
        text: a sequence folder, a folder of them (up to three deep), a bag, a folder of bags, or
            simulated scenes as ``sim:all``, ``sim:occlusion:1-5``.
        options: how to read it.

    Raises:
        DatasetError: where there is nothing to measure.
    """
    chosen = options or DatasetOptions()
    if text.startswith(simulated.PREFIX) or chosen.kind == 'sim':
        found = simulated.find(
            text,
            chosen.seeds,
            chosen.scenarios,
            chosen.rate_hz or 30.0,
            chosen.duration_s,
            chosen.size,
            chosen.everyone,
        )
    else:
        path = Path(os.path.abspath(text))  # workers elsewhere stand in other folders
        try:
            require_source(text)
        except RecordingError as error:
            raise DatasetError(f'{error} (folders, bags, or simulated scenes as sim:all)') from None
        found = _walk(path, chosen, _DEPTH)
        if not found and chosen.everyone:
            raise DatasetError(
                f'{text} holds no recording in which people have ids: expected images in rgb/ or '
                'img1/ with mot.txt, gt/gt.txt (MOT Challenge) or groundtruth_PERSON.txt for each'
            )
        if not found:
            raise DatasetError(
                f'{text} holds no sequence: expected rgb/ with groundtruth.txt, img/ with '
                'groundtruth_rect.txt (OTB), color/ with groundtruth.txt (VOT, CDTB, DepthTrack), '
                'frames.mat (Princeton) or bags'
            )
    _refuse_topics(found, chosen)
    if chosen.names:
        found = [s for s in found if any(name in s.name for name in chosen.names)]
        if not found:
            raise DatasetError(f'{text} holds no sequence named {" or ".join(chosen.names)}')
    return found


def _refuse_topics(found: list[Sequence], options: DatasetOptions) -> None:
    for role in ('color', 'depth', 'info'):
        topic = getattr(options, f'{role}_topic')
        for sequence in found:
            if topic is not None and sequence.kind not in (recorded.RECORDING, BROKEN):
                raise DatasetError(
                    f'{sequence.name} is no bag and has no topics: leave --{role}-topic {topic} '
                    'out (--no-depth gives colour alone)'
                )


def _walk(path: Path, options: DatasetOptions, depth: int) -> list[Sequence]:
    try:
        here = _sequences_at(path, options, depth == _DEPTH)
        if here or depth == 0 or not path.is_dir():
            return here
        children = sorted(entries(path), key=lambda p: natural_key(p.name))
    except (OSError, UnreadableError) as error:
        if depth == _DEPTH:
            raise DatasetError(str(error)) from None
        return [broken(path, str(error))]
    return [sequence for child in children for sequence in _walk(child, options, depth - 1)]


def _sequences_at(path: Path, options: DatasetOptions, asked: bool) -> list[Sequence]:
    kind = options.kind
    if options.everyone:
        return everyone.find(path, options.fps, asked) if everyone.is_sequence(path) else []
    read = ReadOptions(
        fps=options.fps,
        color_topic=options.color_topic,
        depth_topic=options.depth_topic,
        info_topic=options.info_topic,
    )
    bag = recorded.is_sequence(path) or (asked and recorded.is_named(path))
    if bag and kind in ('auto', recorded.RECORDING):
        return [recorded.find(path, read, asked)]
    if not path.is_dir():
        return []
    if kind == 'otb':
        named = otb.is_sequence(path) or (path / 'groundtruth.txt').is_file()
        return otb.find(path, options.fps) if named else []
    if kind == 'auto' and otb.is_sequence(path):
        return otb.find(path, options.fps)
    if princeton.is_sequence(path) and kind in ('auto', 'princeton'):
        table = path.parent / princeton.CATEGORIES_FILE
        return [princeton.find(path, princeton.read_categories(table))]
    if kind in ('auto', 'folder') and folder.is_sequence(path, kind == 'folder'):
        return folder.find(path, options.fps, asked)
    if vot.is_sequence(path) and kind in ('auto', *_SAME_AS_VOT):
        return [vot.find(path, options.fps)]
    return []
