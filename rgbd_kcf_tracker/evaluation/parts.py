# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Parts of a run that were made apart from each other, and how they are joined.

A part lies in a folder as any results do, with one file beside them that says what it is a part of.
Joining needs neither the data nor the trackers.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence as Items
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from rgbd_kcf_tracker.batch.shards import Shard
from rgbd_kcf_tracker.errors import DatasetError
from rgbd_kcf_tracker.evaluation.contenders import Contender
from rgbd_kcf_tracker.evaluation.datasets.base import Opened, Sequence
from rgbd_kcf_tracker.evaluation.jobs import Failure, RunOptions, is_done
from rgbd_kcf_tracker.evaluation.report import Heading
from rgbd_kcf_tracker.evaluation.store import read_json
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.recordings.outputs import moved_into_place, write_atomically

FOLDER = 'parts'


@dataclass(frozen=True, slots=True)
class Whole:
    """A run as a report needs it.

    Attributes:
        sequences: in the order of the report, digests known.
        contenders: in the order of the report, digests known.
        options: how they were run.
        heading: of the report.
        failures: what failed.
        exports: forms in which results are written again.
        everyone: whether everyone is followed, instead of one target each.
    """

    sequences: list[Sequence]
    contenders: list[Contender]
    options: RunOptions
    heading: Heading
    failures: list[Failure]
    exports: tuple[str, ...] = ()
    everyone: bool = False


def write_part(folder: Path, shard: Shard, sequences: Items[Sequence], part: Whole) -> Path:
    """Say what the results in ``folder`` are a part of.

    Args:
        folder: of the results.
        shard: which part it is.
        sequences: all of them, those of the other parts included.
        part: this part.
    """
    path = folder / FOLDER / f'{shard.index}_of_{shard.count}.json'
    known = {s.name: place for place, s in enumerate(sequences)}
    # Where a recording lies is of a machine: it is named by the first sequence that is of it.
    first = {s.recording: s.name for s in reversed(sequences)}
    content = {
        'part': shard.index,
        'parts': shard.count,
        'whole': {
            'sequences': list(known),
            'contenders': [_contender(c) for c in part.contenders],
            'options': _options(part.options),
            'heading': asdict(part.heading),
            'exports': part.exports,
            'everyone': part.everyone,
        },
        'sequences': [_sequence(s) | {'recording': first[s.recording]} for s in part.sequences],
        'places': [known[s.name] for s in part.sequences],
        'files': {c.name: dict(c.files) for c in part.contenders if c.files},
        'failures': [asdict(f) for f in part.failures],
    }
    # Numbers as they are: keys are made of them.
    write_atomically(path, json.dumps(content, indent=1) + '\n')
    return path


def join(folders: Items[Path], folder: Path) -> Whole:
    """Bring the results of all parts into ``folder``.

    Args:
        folders: with one part each, or several.
        folder: of the report; may be one of them.

    Raises:
        DatasetError: where a part is missing, is not whole, is there twice with other results, or
            is of another run.
    """
    found: dict[int, tuple[Path, dict[str, Any]]] = {}
    for place in folders:
        files = sorted((place / FOLDER).glob('*_of_*.json'))
        if not files:
            raise DatasetError(
                f'{place} holds no part: give folders that --shard wrote, with {FOLDER}/ in them'
            )
        for path in files:
            _take(path, read_json(path), found)
    count = next(iter(found.values()))[1]['parts'] if found else 0
    missing = [f'{i}/{count}' for i in range(1, count + 1) if i not in found]
    if missing:
        raise DatasetError(
            f'{len(missing)} of {count} parts are missing: run --shard {", ".join(missing[:8])}'
            f'{", ..." if len(missing) > 8 else ""}, or give their folders'
        )
    parts = [found[i] for i in sorted(found)]
    for place in dict.fromkeys(path.parent.parent for path, _ in parts):
        if place.resolve() != folder.resolve():
            _copy(place, folder)
    whole = _whole([content for _, content in parts])
    _check_done(folder, whole, count)
    return whole


def _check_done(folder: Path, whole: Whole, count: int) -> None:
    """Every run is there or is known to have failed: a report of some would look like all."""
    failed = {(f.sequence, f.tracker) for f in whole.failures}
    missing, shards = [], set()
    for place, sequence in enumerate(whole.sequences):
        for contender in whole.contenders:
            if {(sequence.name, ''), (sequence.name, contender.name)} & failed:
                continue
            if not is_done(folder, sequence, contender, whole.options):
                missing.append(f'{sequence.name} ({contender.name})')
                shards.add(place % count + 1)
    if missing:
        raise DatasetError(
            f'{len(missing)} runs are missing: {", ".join(missing[:8])}'
            f'{", ..." if len(missing) > 8 else ""}: run '
            f'{", ".join(f"--shard {i}/{count}" for i in sorted(shards)[:8])}'
            f'{", ..." if len(shards) > 8 else ""} again'
        )


def _take(
    path: Path, content: dict[str, Any], found: dict[int, tuple[Path, dict[str, Any]]]
) -> None:
    try:
        index, first = content['part'], next(iter(found.values()), None)
        if first is not None:
            for what in ('parts', 'whole'):
                if content[what] != first[1][what]:
                    differ = _difference(content[what], first[1][what])
                    raise DatasetError(
                        f'{path} and {first[0]} are parts of different runs: {differ}: run all '
                        'parts with the same command and versions'
                    )
        known = found.setdefault(index, (path, content))
        if known[1] != content:
            raise DatasetError(f'{path} and {known[0]} are the same part with other results')
    except (KeyError, TypeError):
        raise DatasetError(f'{path} is no part that --shard wrote') from None


def _difference(one: Any, other: Any) -> str:
    if isinstance(one, dict) and isinstance(other, dict):
        keys = [k for k in one if one[k] != other.get(k)]
        return f'their {" and ".join(keys)} differ'
    return f'of {one} and of {other} parts'


def _copy(place: Path, folder: Path) -> None:
    """Copy results; what vouches for others last."""
    files = [p for p in place.rglob('*') if p.is_file() and not p.name.startswith('.')]
    for path in sorted(files, key=lambda p: (p.suffix == '.json', p)):
        relative = path.relative_to(place)
        if relative.parts[0] in ('results', 'truth', 'thumbs', 'times'):
            with moved_into_place(folder / relative) as temporary:
                shutil.copyfile(path, temporary)


def _whole(parts: list[dict[str, Any]]) -> Whole:
    whole = parts[0]['whole']
    try:
        placed: dict[int, Sequence] = {}
        files: dict[str, dict[str, str]] = {}
        for part in parts:
            for place, sequence in zip(part['places'], part['sequences'], strict=True):
                placed[place] = _sequence_of(sequence)
            for name, digests in part['files'].items():
                files.setdefault(name, {}).update(digests)
        sequences = [placed[i] for i in sorted(placed)]
        if len(sequences) != len(whole['sequences']):
            raise DatasetError(
                f'the parts hold {len(sequences)} of {len(whole["sequences"])} sequences: run all '
                'parts on the same data'
            )
        contenders = [
            Contender(
                c['name'], c['kind'], c['target'], tuple((k, v) for k, v in c['overrides']),
                tuple(files.get(c['name'], {}).items()),
            )
            for c in whole['contenders']
        ]  # fmt: skip
        failures = [Failure(**f) for part in parts for f in part['failures']]
        order = {s.name: i for i, s in enumerate(sequences)}
        failures.sort(key=lambda f: order[f.sequence])
        heading = whole['heading']
        lengths = heading['eao_lengths']
        return Whole(
            sequences,
            contenders,
            _options_of(whole['options']),
            Heading(
                tuple(heading['datasets']), heading['options'], tuple(heading['ablated']),
                None if lengths is None else (lengths[0], lengths[1]),
            ),
            failures,
            tuple(whole['exports']),
            bool(whole['everyone']),
        )  # fmt: skip
    except (KeyError, TypeError, ValueError) as error:
        raise DatasetError(f'a part is not as --shard writes it: {error}') from None


def _sequence(sequence: Sequence) -> dict[str, Any]:
    return {
        'name': sequence.name,
        'scenario': sequence.scenario,
        'kind': sequence.kind,
        'identity': sequence.identity,
        'digest': sequence.digest,
        'categories': dict(sequence.categories),
        'origin': sequence.origin,
    }


def _sequence_of(content: dict[str, Any]) -> Sequence:
    if 'recording' not in content:  # nor are the results of an older version where they are now
        raise DatasetError('a part was written by another version: run all parts again')
    return Sequence(open=partial(_elsewhere, content['name']), **content)


def _elsewhere(name: str) -> Opened:
    raise DatasetError(f'{name} was run elsewhere: run its part again')


def _contender(contender: Contender) -> dict[str, Any]:
    return {
        'name': contender.name,
        'kind': contender.kind,
        'target': contender.source,
        'overrides': [list(pair) for pair in contender.overrides],
    }


def _options(options: RunOptions) -> dict[str, Any]:
    return asdict(replace(options, fresh=False))


def _options_of(content: dict[str, Any]) -> RunOptions:
    camera = content['intrinsics']
    intrinsics = None if camera is None else Intrinsics(**camera)
    return RunOptions(**{**content, 'intrinsics': intrinsics})
