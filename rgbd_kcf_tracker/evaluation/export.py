# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The results of a run, written again as a benchmark takes them."""

from __future__ import annotations

from collections.abc import Sequence as Items
from pathlib import Path

import numpy as np

from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import Sequence
from rgbd_kcf_tracker.evaluation.jobs import RunOptions, is_done, meta_path, tracks_path
from rgbd_kcf_tracker.evaluation.store import read_json, read_tracks, slug
from rgbd_kcf_tracker.evaluation.submissions import write_princeton, write_vot
from rgbd_kcf_tracker.evaluation.times import read_times


def export(
    folder: Path,
    sequences: Items[Sequence],
    contenders: Items[Contender],
    options: RunOptions,
    form: str,
) -> None:
    """Write ``submission/FORM/TRACKER/...`` for every run that was made.

    Boxes are in the data set's own pixel coordinates, scores those that the tracker published.

    Args:
        folder: of the run.
        sequences: that were run.
        contenders: that were run.
        options: how they were run.
        form: 'princeton' or 'vot'.
    """
    for contender in contenders:
        place = folder / 'submission' / form / slug(contender.name)
        for sequence in sequences:
            path = tracks_path(folder, contender.name, sequence.name)
            if not is_done(folder, sequence, contender, options):
                continue
            tracks = read_tracks(path)
            boxes = tracks.boxes + np.array([sequence.origin, sequence.origin, 0, 0])
            name = slug(sequence.name)
            if form == 'princeton':
                write_princeton(place / f'{name}.txt', boxes)
                continue
            meta = read_json(meta_path(path))
            ms = read_times(folder, contender.name, sequence.name) or [0.0] * len(boxes)
            write_vot(place / 'longterm', name, boxes, tracks.scores, ms)
            if 'short_term' in meta:
                run = meta['short_term']
                again = np.array([b or [np.nan] * 4 for b in run['boxes']], np.float64)
                again[:, :2] += sequence.origin
                write_vot(place / 'baseline', name, again, np.ones(len(again)), ms, run['codes'])
