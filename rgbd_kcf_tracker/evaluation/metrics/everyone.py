# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Several people at once: HOTA, MOTA, IDF1, id switches, boxes on strangers, returns with one's id.

Sources: Bernardin and Stiefelhagen, "Evaluating Multiple Object Tracking Performance: The CLEAR MOT
Metrics", 2008 (MOTA, switches; a pair of the frame before stays a pair while it overlaps, as in the
MOT Challenge's devkit); Ristani et al., "Performance Measures and a Data Set for Multi-Target,
Multi-Camera Tracking", 2016 (IDF1); Luiten et al., "HOTA: A Higher Order Metric for Evaluating
Multi-Object Tracking", 2021 (HOTA); Milan et al., "MOT16", 2016 (what does not count).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from rgbd_kcf_tracker.arrays import FloatArray, Mask
from rgbd_kcf_tracker.evaluation.metrics.calibration import SURE
from rgbd_kcf_tracker.evaluation.metrics.confusion import HIT_IOU
from rgbd_kcf_tracker.evaluation.metrics.means import mean_of
from rgbd_kcf_tracker.evaluation.metrics.presence import (
    HIT_SHARE,
    JUDGED_FROM,
    RETURN_FRAMES,
    STRANGER_IOU,
    runs,
)
from rgbd_kcf_tracker.recordings.mot import REGION_ID, Sightings

Integers = npt.NDArray[np.int64]

ALPHAS: FloatArray = np.arange(1, 20) / 20
"""Overlaps over which HOTA is averaged: 0.05, 0.10, ..., 0.95 (Luiten et al. 2021)."""

REGION_SHARE = 0.5
"""A box lies in a region where nothing is judged if half of it does, as KITTI's devkit has it."""

_TINY = float(np.finfo(np.float64).eps)
# Above any sum of overlaps in a frame: a pair that was one in the frame before goes first.
_KEPT = 1e3


@dataclass(frozen=True, slots=True)
class Everyone:
    """One recording, or the mean of several; shares from 0 to 1 (MOTA may be negative).

    Attributes:
        hota: higher order tracking accuracy, mean over overlaps from 0.05 to 0.95.
        det_a: its part of detection.
        ass_a: its part of association.
        idf1: F1 of the boxes that bear the right id, under the best matching of ids to people.
        mota: 1 minus misses, false boxes and switches per person and frame.
        strangers: of all boxes, the share on something else (IoU < 0.1, or nobody there) than the
            person that their id was first on; an id that never was on anybody has all of its boxes
            on something else.
        sure: of the boxes with a score of :data:`~.calibration.SURE` and more, the share that is
            not on something else.
        returns: of the times a person was back for five frames or more, the share in which at least
            half of the frames from the third on were hit by the id that they had before.
        recall: of the people who count, the share that has a box on it.
        precision: of the boxes, the share that is on a person.
        switches: how often a person's id changed.
        misses: people without a box.
        false_boxes: boxes on nobody.
        people: sightings of the ground truth that count.
        boxes: the tracker's boxes that count.
    """

    hota: float
    det_a: float
    ass_a: float
    idf1: float
    mota: float
    strangers: float
    sure: float
    returns: float
    recall: float
    precision: float
    switches: float
    misses: float
    false_boxes: float
    people: float
    boxes: float


def score(truth: Sightings, tracks: Sightings, bodies: FloatArray | None = None) -> Everyone:
    """All measures of one recording.

    Rows of the ground truth with a score of 0 are neither hit nor miss: as in the MOT Challenge,
    each box that an assignment of all people to all boxes (IoU >= 0.5) gives to one of them is left
    out. So is a box on nobody of which half or more lies in a region where nothing is judged.

    On simulated scenes a box is held against the visible part and the whole body, and the better
    counts.

    Args:
        truth: of every frame.
        tracks: of every frame; frames as in ``truth``.
        bodies: ``(N, 4)`` boxes of the whole bodies, a row for each of ``truth``, NaN where not
            known; None where none is.
    """
    agreement = _Agreement(truth, tracks, bodies)
    moments = _judge(agreement)
    people, person_ids = _numbers(truth, moments, 'truth')
    boxes, track_ids = _numbers(tracks, moments, 'tracks')
    sizes = len(person_ids), len(track_ids)
    n, m = len(people), len(boxes)
    clear = _clear(moments, truth, tracks)
    identity = _identity(moments, people, boxes, sizes)
    hota, det_a, ass_a = _hota(moments, people, boxes, sizes)
    hits = int((clear.matched >= 0).sum())
    own, scores = _on_own(moments, agreement, clear)
    sure = scores >= SURE
    return Everyone(
        hota=hota,
        det_a=det_a,
        ass_a=ass_a,
        idf1=_ratio(2 * identity, n + m),
        mota=_ratio(n - (n - hits) - (m - hits) - clear.switches, n),
        strangers=_ratio(int(np.count_nonzero(~own)), m),
        sure=_ratio(int(np.count_nonzero(own & sure)), int(np.count_nonzero(sure))),
        returns=_returns(truth, clear),
        recall=_ratio(hits, n),
        precision=_ratio(hits, m),
        switches=clear.switches,
        misses=n - hits,
        false_boxes=m - hits,
        people=n,
        boxes=m,
    )


def mean(scores: Iterable[Everyone]) -> Everyone:
    """Mean over recordings, each counting once; a NaN does not count."""
    return mean_of(Everyone, scores)


def overlaps(a: FloatArray, b: FloatArray) -> FloatArray:
    """``(N, M)`` IoU of ``(N, 4)`` and ``(M, 4)`` boxes."""
    common = _common(a, b)
    union = np.prod(a[:, 2:], axis=1)[:, None] + np.prod(b[:, 2:], axis=1)[None] - common
    result: FloatArray = common / union
    return result


@dataclass(frozen=True, slots=True, eq=False)
class _Moment:
    """One frame: rows of truth and of tracks that count, and their ``(N, M)`` IoU."""

    frame: int
    truth: Integers
    tracks: Integers
    iou: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Clear:
    """The CLEAR pairs: of each row of truth the id that is on it (-1: none)."""

    matched: Integers
    switches: int
    first_person: dict[int, int]


class _Agreement:
    """IoU of rows of the truth with rows of the tracks."""

    def __init__(self, truth: Sightings, tracks: Sightings, bodies: FloatArray | None) -> None:
        self.truth, self.tracks, self._bodies = truth, tracks, bodies

    def __call__(self, people: Integers, boxes: Integers) -> FloatArray:
        iou = overlaps(self.truth.boxes[people], self.tracks.boxes[boxes])
        if self._bodies is None:
            return iou
        whole: FloatArray = np.fmax(iou, overlaps(self._bodies[people], self.tracks.boxes[boxes]))
        return whole


def _judge(agreement: _Agreement) -> list[_Moment]:
    truth, tracks = agreement.truth, agreement.tracks
    counts = (truth.scores > 0) & (truth.ids != REGION_ID)
    region = truth.ids == REGION_ID
    moments = []
    for frame, own, theirs in _by_frame(truth, tracks):
        people = own[~region[own]]
        iou = agreement(people, theirs)
        rows, columns = _assign(np.where(iou >= HIT_IOU - _TINY, iou, 0.0))
        kept = np.ones(len(theirs), np.bool_)
        kept[columns[~counts[people[rows]]]] = False
        kept &= ~_in_region(truth.boxes[own[region[own]]], tracks.boxes[theirs]) | _in(
            len(theirs), columns
        )
        judged = counts[people]
        moments.append(_Moment(frame, people[judged], theirs[kept], iou[np.ix_(judged, kept)]))
    return moments


def _clear(moments: list[_Moment], truth: Sightings, tracks: Sightings) -> _Clear:
    matched = np.full(len(truth), -1, np.int64)
    last: dict[int, int] = {}
    before: dict[int, int] = {}
    before_frame = -2
    first_person: dict[int, int] = {}
    switches = 0
    for moment in moments:
        people, ids = truth.ids[moment.truth], tracks.ids[moment.tracks]
        if moment.frame != before_frame + 1:
            before = {}
        stay = np.array([before.get(int(p), -1) for p in people], np.int64)
        kept = (stay[:, None] == ids[None]) & (stay[:, None] >= 0)
        value = np.where(moment.iou >= HIT_IOU - _TINY, moment.iou + _KEPT * kept, 0.0)
        rows, columns = _assign(value)
        now = {int(people[r]): int(ids[c]) for r, c in zip(rows, columns, strict=True)}
        switches += sum(last.get(person, who) != who for person, who in now.items())
        for person, who in now.items():
            first_person.setdefault(who, person)
        matched[moment.truth[rows]] = ids[columns]
        last |= now
        before, before_frame = now, moment.frame
    return _Clear(matched, switches, first_person)


def _identity(
    moments: list[_Moment], people: Integers, boxes: Integers, sizes: tuple[int, int]
) -> int:
    """Boxes with the right id under the one-to-one matching of ids to people with most of them."""
    together = np.zeros(sizes)
    for _, p, b, iou in _walk(moments, people, boxes):
        together[np.ix_(p, b)] += iou >= HIT_IOU - _TINY
    rows, columns = _assign(together)
    return round(float(together[rows, columns].sum()))


def _hota(
    moments: list[_Moment], people: Integers, boxes: Integers, sizes: tuple[int, int]
) -> tuple[float, float, float]:
    n, m = len(people), len(boxes)
    if n + m == 0:
        return math.nan, math.nan, math.nan
    # How well each id goes with each person over the whole recording: what decides the pairs.
    alignment = np.zeros(sizes)
    for _, p, b, iou in _walk(moments, people, boxes):
        rest = iou.sum(0)[None] + iou.sum(1)[:, None] - iou
        alignment[np.ix_(p, b)] += np.where(rest > _TINY, iou / np.maximum(rest, _TINY), 0.0)
    of_person = np.bincount(people, minlength=sizes[0])
    of_id = np.bincount(boxes, minlength=sizes[1])
    alignment /= np.maximum(of_person[:, None] + of_id[None] - alignment, _TINY)
    pairs, found = [np.zeros((0, 2), np.int64)], [np.zeros(0)]
    for _, p, b, iou in _walk(moments, people, boxes):
        rows, columns = _assign(alignment[np.ix_(p, b)] * iou)
        pairs.append(np.stack((p[rows], b[columns]), axis=1))
        found.append(iou[rows, columns])
    pair, overlap = np.concatenate(pairs), np.concatenate(found)
    kinds, kind = np.unique(pair, axis=0, return_inverse=True)
    kind = kind.reshape(-1)  # NumPy 2.0 alone gives it two dimensions
    either = of_person[kinds[:, 0]] + of_id[kinds[:, 1]]
    values = []
    for alpha in ALPHAS:
        hit = overlap >= alpha - _TINY
        tp = int(hit.sum())
        per_pair = np.bincount(kind[hit], minlength=len(kinds))
        ass_a = float(np.sum(per_pair * per_pair / np.maximum(either - per_pair, 1))) / max(tp, 1)
        det_a = tp / (n + m - tp)
        values.append((math.sqrt(det_a * ass_a), det_a, ass_a))
    hota, det_a, ass_a = np.mean(values, axis=0)
    return float(hota), float(det_a), float(ass_a)


def _on_own(
    moments: list[_Moment], agreement: _Agreement, clear: _Clear
) -> tuple[Mask, FloatArray]:
    """Of each box whether it is on the person that its id was first on, and its score."""
    truth, tracks = agreement.truth, agreement.tracks
    where = {
        (int(f), int(i)): row
        for row, (f, i) in enumerate(zip(truth.frames, truth.ids, strict=True))
        if i != REGION_ID
    }
    found, scores = [], []
    for moment in moments:
        for row in moment.tracks:
            person = clear.first_person.get(int(tracks.ids[row]))
            own = None if person is None else where.get((moment.frame, person))
            found.append(
                own is not None
                and agreement(np.array([own]), np.array([row]))[0, 0] >= STRANGER_IOU
            )
            scores.append(tracks.scores[row])
    return np.array(found, np.bool_), np.array(scores, np.float64)


def _returns(truth: Sightings, clear: _Clear) -> float:
    found = total = 0
    counts = truth.scores > 0
    for person in np.unique(truth.ids[truth.ids != REGION_ID]):
        rows = np.flatnonzero(truth.ids == person)
        known = -1
        for number, (start, stop) in enumerate(runs(np.diff(truth.frames[rows]) > 1)):
            span = rows[start:stop]
            ids = clear.matched[span[counts[span]]]
            if number and len(ids) >= RETURN_FRAMES:
                total += 1
                rest = ids[JUDGED_FROM:]
                found += known >= 0 and float(np.mean(rest == known)) >= HIT_SHARE
            if (ids >= 0).any():
                known = int(ids[ids >= 0][-1])
    return _ratio(found, total)


def _numbers(side: Sightings, moments: list[_Moment], name: str) -> tuple[Integers, Integers]:
    """Ids of a side's rows that count, as numbers from 0 in the order of frames, and the ids."""
    rows = [getattr(moment, name) for moment in moments]
    chosen = side.ids[np.concatenate(rows)] if rows else np.zeros(0, np.int64)
    ids, numbers = np.unique(chosen, return_inverse=True)
    return numbers.reshape(-1), ids


def _walk(
    moments: list[_Moment], people: Integers, boxes: Integers
) -> Iterable[tuple[int, Integers, Integers, FloatArray]]:
    """Frame, numbers of the people and of the ids in it, and their IoU."""
    i = j = 0
    for moment in moments:
        n, m = moment.iou.shape
        yield moment.frame, people[i : i + n], boxes[j : j + m], moment.iou
        i, j = i + n, j + m


def _by_frame(truth: Sightings, tracks: Sightings) -> Iterable[tuple[int, Integers, Integers]]:
    """Every frame in which there is anything, with the rows of both sides."""
    for frame in np.union1d(truth.frames, tracks.frames):
        own = np.arange(*np.searchsorted(truth.frames, (frame, frame + 1)))
        theirs = np.arange(*np.searchsorted(tracks.frames, (frame, frame + 1)))
        yield int(frame), own, theirs


def _assign(value: FloatArray) -> tuple[Integers, Integers]:
    """The one-to-one pairs with the greatest sum; pairs without value are none."""
    rows, columns = linear_sum_assignment(-value)
    some = value[rows, columns] > 0
    return rows[some], columns[some]


def _in_region(regions: FloatArray, boxes: FloatArray) -> Mask:
    """``(M,)`` boxes that lie in a region by :data:`REGION_SHARE` or more."""
    inside = _common(regions, boxes) / np.prod(boxes[:, 2:], axis=1)[None]
    result: Mask = (inside >= REGION_SHARE).any(axis=0)
    return result


def _in(count: int, chosen: Integers) -> Mask:
    mask = np.zeros(count, np.bool_)
    mask[chosen] = True
    return mask


def _common(a: FloatArray, b: FloatArray) -> FloatArray:
    """``(N, M)`` area that two boxes share."""
    near = np.maximum(a[:, None, :2], b[None, :, :2])
    far = np.minimum(a[:, None, :2] + a[:, None, 2:], b[None, :, :2] + b[None, :, 2:])
    area: FloatArray = np.prod(np.maximum(far - near, 0.0), axis=2)
    return area


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else math.nan
