# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""One job: a sequence by the trackers that have not run on it yet, and what it leaves on disk."""

from __future__ import annotations

import hashlib
import json
import traceback
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import scipy

import rgbd_kcf_tracker
from rgbd_kcf_tracker.errors import RgbdKcfError
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
from rgbd_kcf_tracker.evaluation.passes import OnePass, Thumbnails, WithRestarts
from rgbd_kcf_tracker.evaluation.store import (
    slug,
    write_json,
    write_tracks,
    write_truth,
)
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.recordings.outputs import write_atomically

_FORMAT = 2
"""Of what a run leaves; another one is not read, but run again."""

# What makes no frame and no track. All else is part of the digest, also what will be added.
_ELSEWHERE = ('bench', 'cli', 'live', 'ros', 'view')
_MEASURING = 'evaluation'
_RUNNING = ('datasets', 'boxfiles.py', 'contenders.py', 'everyone.py', 'jobs.py', 'passes.py')
"""What of the evaluation makes frames and tracks; the rest measures and shows them."""


@cache
def code_digest(root: Path = Path(rgbd_kcf_tracker.__file__).parent) -> str:
    """Digest of the code that makes frames and tracks, and of the libraries that it calls."""
    versions = rgbd_kcf_tracker.__version__, np.__version__, scipy.__version__, cv2.__version__
    digest = hashlib.sha256(' '.join(versions).encode())
    for path in sorted(root.rglob('*.py')):
        parts = path.relative_to(root).parts
        if parts[0] in _ELSEWHERE or (parts[0] == _MEASURING and parts[1] not in _RUNNING):
            continue
        digest.update('/'.join(parts).encode() + b'\0' + path.read_bytes())
    return digest.hexdigest()[:16]


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How sequences are run.

    Attributes:
        rate_hz: thin recordings out to this rate; None leaves them.
        use_depth: False drops the depth images.
        short_term: also run VOT's protocol with re-initialisation.
        jobs: parallel processes.
        fresh: run again what is already there.
        intrinsics: of recordings, instead of their own; None leaves them.
        code: digest of the code; part of every run's key, the same in all processes of a run.
    """

    rate_hz: float | None = None
    use_depth: bool = True
    short_term: bool = False
    jobs: int = 1
    fresh: bool = False
    intrinsics: Intrinsics | None = None
    code: str = field(default_factory=code_digest)


@dataclass(frozen=True, slots=True)
class Failure:
    """A sequence that could not be run, for one tracker or (empty) for all."""

    sequence: str
    tracker: str
    reason: str


@dataclass(frozen=True, slots=True)
class Job:
    """One sequence and the trackers that have not run on it yet."""

    sequence: Sequence
    contenders: tuple[Contender, ...]
    folder: Path
    options: RunOptions


def truth_path(folder: Path, sequence: str) -> Path:
    """Where the truth of a sequence lies."""
    return folder / 'truth' / f'{slug(sequence)}.csv'


def tracks_path(folder: Path, tracker: str, sequence: str) -> Path:
    """Where a tracker's tracks of a sequence lie."""
    return folder / 'results' / slug(tracker) / f'{slug(sequence)}.csv'


def meta_path(tracks: Path) -> Path:
    """Key, times and the short-term run beside a file of tracks; written last, so it vouches."""
    return tracks.with_suffix('.json')


def run_key(sequence: Sequence, contender: Contender, options: RunOptions) -> str:
    """What decides the outcome of a run, as a short text."""
    extra = ''
    if contender.kind == 'boxes':
        try:
            stat = boxfiles.find_file(contender.target, sequence).stat()
            extra = f'{stat.st_size}:{stat.st_mtime_ns}'
        except RgbdKcfError:
            extra = 'missing'
    parts = [
        sequence.identity, contender.identity, extra, options.code,
        options.rate_hz, options.use_depth, options.short_term,
        repr(options.intrinsics), _FORMAT,
    ]  # fmt: skip
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:24]


def is_done(folder: Path, sequence: Sequence, contender: Contender, options: RunOptions) -> bool:
    """Whether the same run has been made: same frames, parameters, code and options."""
    if sequence.kind == EVERYONE:
        return everyone.is_done(
            folder, sequence, contender.name, run_key(sequence, contender, options)
        )
    tracks = tracks_path(folder, contender.name, sequence.name)
    if not (tracks.is_file() and truth_path(folder, sequence.name).is_file()):
        return False
    try:
        meta = json.loads(meta_path(tracks).read_text(encoding='utf-8'))
    except (OSError, ValueError):
        return False
    return bool(meta.get('key') == run_key(sequence, contender, options))


def run_job(job: Job) -> list[Failure]:
    """Run one sequence; whatever goes wrong is returned, not raised."""
    try:
        return _run_sequence(job)
    except RgbdKcfError as error:
        return [Failure(job.sequence.name, '', str(error))]
    except Exception:
        return [Failure(job.sequence.name, '', traceback.format_exc().strip())]


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
    thumbnails, samples, size = Thumbnails(), [], (0, 0)
    for sample in _samples(opened, sequence, options):
        size = sample.frame.width, sample.frame.height
        samples.append(
            (sample.frame.stamp_ns, sample.visible, sample.body, sample.fraction, sample.judged)
        )
        thumbnails.feed(sample.frame)
        for one in (*passes.values(), *restarts.values()):
            one.feed(sample)
    if not samples:
        raise RgbdKcfError(f'{sequence.name}: the target is never clearly in view')
    stamps = [s[0] for s in samples]
    body = [s[2] for s in samples] if opened.has_body else None
    write_truth(
        truth_path(job.folder, sequence.name),
        stamps, [s[1] for s in samples], body, [s[3] for s in samples], [s[4] for s in samples],
    )  # fmt: skip
    _write_thumbnails(job.folder / 'thumbs' / slug(sequence.name), thumbnails)

    failures = []
    for contender in job.contenders:
        one = passes.get(contender.name) or _from_file(contender, sequence, opened, len(samples))
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
            | {'image_size': size, 'thumbnail_scale': thumbnails.scale},
        )
    return failures


def _run_everyone(job: Job, opened: Opened) -> list[Failure]:
    sequence, options = job.sequence, job.options
    samples = as_asked(opened.samples, sequence, options)
    keys = {c.name: run_key(sequence, c, options) for c in job.contenders}
    failed = everyone.run(sequence, job.contenders, job.folder, samples, keys, opened.length)
    return [Failure(sequence.name, tracker, reason) for tracker, reason in failed]


def _write_thumbnails(folder: Path, thumbnails: Thumbnails) -> None:
    pictures = {f'{index:06d}.jpg': data for index, data in thumbnails.pictures.items()}
    for old in folder.glob('*.jpg'):  # of the same sequence at another rate, say
        if old.name not in pictures:
            old.unlink(missing_ok=True)
    for name, data in pictures.items():
        write_atomically(folder / name, data)


def _from_file(contender: Contender, sequence: Sequence, opened: Opened, frames: int) -> OnePass:
    try:
        path = boxfiles.find_file(contender.target, sequence)
        return OnePass(None, tracks=boxfiles.read(path, sequence, opened, frames))
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
        'milliseconds': [round(ms, 3) for ms in one.milliseconds],
    }
    if restart is not None:
        run = restart.run()
        meta['short_term'] = {
            'codes': [int(c) for c in restart.codes],
            'boxes': [list(t.box.as_tuple()) if t.box else None for t in restart.tracks],
            'run_codes': run.codes.tolist(),
            'run_overlaps': run.overlaps.tolist(),
        }
    return meta


def _samples(opened: Opened, sequence: Sequence, options: RunOptions) -> Iterator[Sample]:
    yield from as_asked(from_first_view(opened.samples), sequence, options)


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
