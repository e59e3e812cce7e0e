# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One job: a sequence by the trackers that have not run on it yet, and what it leaves on disk."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Iterator
from collections.abc import Sequence as Items
from dataclasses import astuple, dataclass, field, replace
from pathlib import Path
from typing import Any

import rgbd_kcf_tracker
from rgbd_kcf_tracker.batch.content import MISSING, files_digest
from rgbd_kcf_tracker.batch.environment import environment
from rgbd_kcf_tracker.batch.transport import Packed, packed
from rgbd_kcf_tracker.errors import RgbdKcfError, WorkersError
from rgbd_kcf_tracker.evaluation import boxfiles, everyone
from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import (
    EVERYONE,
    Opened,
    Sample,
    Sequence,
    at_rate,
    from_first_view,
    with_intrinsics,
    without_depth,
)
from rgbd_kcf_tracker.evaluation.metrics.ellipsoids import place_of
from rgbd_kcf_tracker.evaluation.metrics.presence import STRANGER_IOU
from rgbd_kcf_tracker.evaluation.passes import Notes, OnePass, Thumbnails, WithRestarts, run, trace
from rgbd_kcf_tracker.evaluation.store import (
    slug,
    was_made_as,
    write_json,
    write_tracks,
    write_truth,
)
from rgbd_kcf_tracker.evaluation.times import write_times
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.parameters import files_named
from rgbd_kcf_tracker.recordings.outputs import write_atomically
from rgbd_kcf_tracker.track import Track


def _environment_digest() -> str:
    return environment().digest


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How sequences are run.

    Attributes:
        rate_hz: thin recordings out to this rate; None leaves them.
        use_depth: False drops the depth images.
        short_term: also run VOT's protocol with re-initialisation.
        fresh: run again what is already there.
        intrinsics: of recordings, instead of their own; None leaves them.
        code: digest of code and libraries; part of every run's key, the same in all processes of
            a run.
    """

    rate_hz: float | None = None
    use_depth: bool = True
    short_term: bool = False
    fresh: bool = False
    intrinsics: Intrinsics | None = None
    code: str = field(default_factory=_environment_digest)


@dataclass(frozen=True, slots=True)
class Failure:
    """A sequence that could not be run, for one tracker or (empty) for all."""

    sequence: str
    tracker: str
    reason: str


def why_nothing(failures: Items[Failure]) -> str:
    """Why a run measured nothing, in words."""
    if failures:
        each = dict.fromkeys(f'{f.sequence}: {f.reason}' for f in failures)
        return f'nothing was measured: {"; ".join(each)}'
    return 'nothing was measured: none of the sequences has ground truth'


@dataclass(frozen=True, slots=True)
class Job:
    """One sequence and the trackers that have not run on it yet.

    Attributes:
        sequence: opened where the job runs.
        contenders: that run on it.
        options: how.
        folder: where it runs, for what it makes.
    """

    sequence: Sequence
    contenders: tuple[Contender, ...]
    options: RunOptions
    folder: Path = Path()


def truth_path(folder: Path, sequence: str, key: str) -> Path:
    """Where the truth of a sequence lies; see :func:`truth_key`."""
    return folder / 'truth' / f'{slug(sequence)}.{key}.csv'


def tracks_path(folder: Path, tracker: str, sequence: str) -> Path:
    """Where a tracker's tracks of a sequence lie."""
    return folder / 'results' / slug(tracker) / f'{slug(sequence)}.csv'


def meta_path(tracks: Path) -> Path:
    """Key and the short-term run beside a file of tracks; written last, so it vouches."""
    return tracks.with_suffix('.json')


def thumbnails_path(folder: Path, sequence: str, key: str) -> Path:
    """Where the small pictures of a sequence lie, all in one file; see :func:`truth_key`."""
    return folder / 'thumbs' / f'{slug(sequence)}.{key}.zip'


def truth_key(sequence: Sequence, options: RunOptions) -> str:
    """What decides a sequence's truth and pictures, as a short text that their names end in.

    So runs of one sequence at several sizes or rates do not take each other's.
    """
    parts = [*_source(sequence), options.code, options.rate_hz]
    return _digest(parts)[:12]


def run_key(sequence: Sequence, contender: Contender, options: RunOptions) -> str:
    """What decides the outcome of a run, as a short text."""
    extra = ''
    if contender.kind == 'boxes':
        extra = dict(contender.files).get(sequence.name) or boxes_digest(sequence, contender)
    elif contender.kind == 'variant':
        files = files_named(contender.parameters())
        extra = files_digest([Path(file) for file in files.values()]) if files else ''
    parts = [
        *_source(sequence), contender.identity, extra, options.code,
        options.rate_hz, options.use_depth, options.short_term,
        repr(options.intrinsics),
    ]  # fmt: skip
    return _digest(parts)[:24]


def _source(sequence: Sequence) -> tuple[str, str]:
    return sequence.identity, sequence.digest or files_digest(sequence.content)


def _digest(parts: Items[object]) -> str:
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def boxes_digest(sequence: Sequence, contender: Contender) -> str:
    """Of the file that holds a contender's boxes."""
    try:
        return files_digest([boxfiles.find_file(contender.target, sequence)])
    except RgbdKcfError:
        return MISSING


def is_done(folder: Path, sequence: Sequence, contender: Contender, options: RunOptions) -> bool:
    """Whether the same run has been made: same frames, parameters, code and options."""
    key, truth = run_key(sequence, contender, options), truth_key(sequence, options)
    if sequence.kind == EVERYONE:
        return everyone.is_done(folder, sequence, contender.name, key, truth)
    tracks = tracks_path(folder, contender.name, sequence.name)
    if not (tracks.is_file() and truth_path(folder, sequence.name, truth).is_file()):
        return False
    return was_made_as(meta_path(tracks), key)


def run_job(job: Job) -> Packed[list[Failure]]:
    """Run one sequence; whatever goes wrong is returned, not raised."""
    return packed(lambda folder: _run_safely(replace(job, folder=folder)))


def _run_safely(job: Job) -> list[Failure]:
    try:
        own = environment()
        if job.options.code != own.digest:  # of a worker that came later, say
            raise WorkersError(
                f'{platform.node()} has another rgbd_kcf_tracker ({own.version}) or other '
                'libraries than this run: install the same on every machine'
            )
        return _run_sequence(job)
    except RgbdKcfError as error:
        return [Failure(job.sequence.name, '', str(error))]
    except Exception:
        return [Failure(job.sequence.name, '', trace())]


def _run_sequence(job: Job) -> list[Failure]:
    sequence, options = job.sequence, job.options
    opened = sequence.open()
    if sequence.kind == EVERYONE:
        return _run_everyone(job, opened)
    passes: dict[str, OnePass] = {}
    restarts: dict[str, WithRestarts] = {}
    for contender in job.contenders:
        if contender.kind != 'boxes':
            passes[contender.name] = OnePass(contender.make())
            if options.short_term and opened.annotated:
                restarts[contender.name] = WithRestarts(contender.make())
    thumbnails, truth = Thumbnails(), Notes()
    samples = as_asked(from_first_view(opened.samples), sequence, options)
    run(samples, truth, thumbnails, *passes.values(), *restarts.values())
    stamps = truth.stamps_ns
    if not stamps:
        raise RgbdKcfError(f'{sequence.name}: the target is never clearly in view')
    key = truth_key(sequence, options)
    write_truth(
        truth_path(job.folder, sequence.name, key), stamps, truth.visible,
        truth.bodies if opened.has_body else None, truth.fractions, truth.judged,
    )  # fmt: skip
    write_atomically(thumbnails_path(job.folder, sequence.name, key), thumbnails.archive())

    failures = []
    for contender in job.contenders:
        one = passes.get(contender.name) or _from_file(contender, sequence, opened, truth.numbers)
        restart = restarts.get(contender.name)
        reason = one.error or (restart.error if restart else '')
        if reason:
            failures.append(Failure(sequence.name, contender.name, reason))
            continue
        target = tracks_path(job.folder, contender.name, sequence.name)
        write_tracks(target, stamps, one.tracks)
        write_json(
            meta_path(target),
            _meta(job, contender, one, restart, opened)
            | {'image_size': truth.size, 'thumbnail_scale': thumbnails.scale}
            | {'places': _places(one.tracks, truth)},
        )
        write_times(job.folder, contender.name, sequence.name, one.milliseconds)
    return failures


def _run_everyone(job: Job, opened: Opened) -> list[Failure]:
    sequence, options = job.sequence, job.options
    samples = as_asked(opened.samples, sequence, options)
    keys = {c.name: run_key(sequence, c, options) for c in job.contenders}
    truth = truth_key(sequence, options)
    failed = everyone.run(sequence, job.contenders, job.folder, samples, keys, truth, opened.length)
    return [Failure(sequence.name, tracker, reason) for tracker, reason in failed]


def _from_file(
    contender: Contender, sequence: Sequence, opened: Opened, numbers: Items[int]
) -> OnePass:
    try:
        path = boxfiles.find_file(contender.target, sequence)
        return OnePass(None, tracks=boxfiles.read(path, sequence, opened, numbers))
    except RgbdKcfError as error:
        return OnePass(None, error=str(error))


def _meta(
    job: Job,
    contender: Contender,
    one: OnePass,
    restart: WithRestarts | None,
    opened: Opened,
) -> dict[str, Any]:
    sequence = job.sequence
    meta: dict[str, Any] = {
        'key': run_key(sequence, contender, job.options),
        'tracker': contender.name,
        'sequence': sequence.name,
        'scenario': sequence.scenario,
        'kind': sequence.kind,
        'origin': sequence.origin,
        'annotated': opened.annotated,
        'categories': dict(sequence.categories),
        'version': rgbd_kcf_tracker.__version__,
        'warnings': list(opened.warnings),
    }
    if restart is not None:
        counted = restart.run()
        meta['short_term'] = {
            'codes': [int(c) for c in restart.codes],
            'boxes': [list(t.box.as_tuple()) if t.box else None for t in restart.tracks],
            'run_codes': counted.codes.tolist(),
            'run_overlaps': counted.overlaps.tolist(),
        }
    return meta


def _places(tracks: list[Track], truth: Notes) -> list[tuple[float, ...]]:
    """Places against the truth, from the second frame on."""
    found, astray = [], False
    for index in range(1, len(tracks)):
        box = tracks[index].box
        if box is not None:
            true = (truth.visible[index], truth.bodies[index])
            astray = max((box.iou(b) for b in true if b is not None), default=0.0) < STRANGER_IOU
        place = place_of(tracks[index], truth.positions[index], truth.velocities[index], astray)
        if place is not None:
            found.append(astuple(place))
    return found


def as_asked(
    samples: Iterable[Sample], sequence: Sequence, options: RunOptions
) -> Iterator[Sample]:
    """The samples at the rate, with the camera, and with the depth or not, that were asked for."""
    # Scenes are rendered at their rate, by their own camera.
    recorded = sequence.kind != 'sim' and (sequence.kind != EVERYONE or sequence.path is not None)
    if options.rate_hz is not None and recorded:
        samples = at_rate(samples, options.rate_hz)
    if options.intrinsics is not None and recorded:
        samples = with_intrinsics(samples, options.intrinsics)
    if not options.use_depth:
        samples = without_depth(samples)
    yield from samples
