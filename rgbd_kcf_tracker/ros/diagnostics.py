# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What ``/diagnostics`` says of the node: one status, a sentence first, the figures after it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from rgbd_kcf_tracker.live.statistics import Snapshot
from rgbd_kcf_tracker.ros.subscriptions import COLOR, DEPTH
from rgbd_kcf_tracker.track import TrackState

RECENT_ERROR_S = 5.0
ALARMING_SHARE = 0.1
"""A tenth of the images dropped, late, without partner or frozen is worth a warning."""
LATENCY_NAMES = ('mean', 'median', 'p99', 'max')


@dataclass(frozen=True, slots=True)
class NodeState:
    """What the node knows of itself beside the counts.

    Attributes:
        name: of the node, with its namespace.
        lifecycle: label of the lifecycle state, 'active' when it works.
        variant: of the tracker; empty before it is configured.
        track: state of the target.
        topic, depth_topic: where the images come from.
        publishers, depth_publishers: how many publish there.
        stale_after: seconds without images that make a silent camera.
        uses_depth: whether the variant wants depth at all.
        depth_fault: why no depth fits, in words; empty where it does.
        auto_init_fault: why nobody can be chosen by itself, likewise.
        unheard: by input, why one who publishes there is not heard, and what mends it; by output,
            who else publishes there.
    """

    name: str
    lifecycle: str
    variant: str = ''
    track: TrackState = TrackState.IDLE
    topic: str = ''
    depth_topic: str = ''
    publishers: int = 0
    depth_publishers: int = 0
    stale_after: float = 2.0
    uses_depth: bool = True
    depth_fault: str = ''
    auto_init_fault: str = ''
    unheard: Mapping[str, str] = field(default_factory=dict)


def judge(state: NodeState, snapshot: Snapshot) -> tuple[bytes, str]:
    """Level and sentence: the worst of what is wrong, in words that say what to do."""
    if state.lifecycle != 'active':
        return DiagnosticStatus.OK, state.lifecycle
    silent = _silence(state, snapshot)
    if silent:
        return DiagnosticStatus.ERROR, silent
    age = snapshot.error_age_s
    error = snapshot.last_error if age is not None and age < RECENT_ERROR_S else ''
    came = max(snapshot.recent.get('color_received', 0), 1)
    wrong = [
        error,
        state.auto_init_fault,
        # Images that wait for a depth that never comes are dropped too: the cause is said first.
        _without_depth(state, snapshot, came),
        _dropped(snapshot, came),
        _late(state, snapshot, came),
        _frozen(state, snapshot, came),
    ]
    wrong += [why for name, why in state.unheard.items() if name not in (COLOR, DEPTH)]
    if any(wrong):
        return DiagnosticStatus.WARN, '; '.join(text for text in dict.fromkeys(wrong) if text)
    return DiagnosticStatus.OK, state.track.name


def _silence(state: NodeState, snapshot: Snapshot) -> str:
    age = snapshot.image_age_s
    if age is not None and age <= state.stale_after:
        return ''
    if state.publishers == 0:
        return f'nobody publishes {state.topic}: is the camera running, is the topic remapped?'
    since = 'yet' if age is None else f'for {age:.1f} s'
    if COLOR in state.unheard:
        return f'no image on {state.topic} {since}: {state.unheard[COLOR]}'
    return (
        f'no image on {state.topic} {since}, though it has a publisher: is the driver working, '
        'are images lost on the way?'
    )


def _dropped(snapshot: Snapshot, came: int) -> str:
    dropped = snapshot.recent.get('dropped', 0)
    if dropped <= ALARMING_SHARE * came:
        return ''
    return f'tracking is slower than the camera: {dropped} of {came} images dropped'


def _late(state: NodeState, snapshot: Snapshot, came: int) -> str:
    late = snapshot.recent.get('late', 0)
    if late <= ALARMING_SHARE * came:
        return ''
    return (
        f'{late} of {came} images on {state.topic} came after a newer one and were passed over: '
        'do two publish there, or does the clock of the camera go back?'
    )


def _frozen(state: NodeState, snapshot: Snapshot, came: int) -> str:
    if snapshot.recent.get('frozen_color', 0) <= ALARMING_SHARE * came:
        return ''
    return (
        f'the picture on {state.topic} has not changed by a single bit for seconds: restart the '
        'camera driver, unless it is a simulator in which nothing moves'
    )


def _without_depth(state: NodeState, snapshot: Snapshot, came: int) -> str:
    alone = snapshot.recent.get('color_without_depth', 0)
    if not state.uses_depth or alone <= ALARMING_SHARE * came:
        return ''
    if state.depth_publishers == 0:
        return f'nobody publishes {state.depth_topic}: tracking on colour alone'
    age = snapshot.depth_age_s
    if age is None or age > state.stale_after:
        why = state.unheard.get(DEPTH, 'tracking on colour alone')
        return f'no depth image on {state.depth_topic}: {why}'
    if state.depth_fault:
        return f'tracking on colour alone: {state.depth_fault}'
    return (
        f'{alone} of {came} colour images found no depth of their time: are the streams '
        'synchronised (see pair_tolerance)?'
    )


def diagnostics_message(stamp: Time, state: NodeState, snapshot: Snapshot) -> DiagnosticArray:
    """The whole message."""
    level, sentence = judge(state, snapshot)
    values = {
        'lifecycle': state.lifecycle,
        'variant': state.variant,
        'state': state.track.name,
        'rate_hz': f'{snapshot.recent.get("processed", 0) / snapshot.seconds:.1f}',
        'input_rate_hz': f'{snapshot.recent.get("color_received", 0) / snapshot.seconds:.1f}',
    }
    for what, summary in snapshot.times_ms.items():
        for name, value in zip(LATENCY_NAMES, summary, strict=False):
            values[f'{what}_{name}_ms'] = f'{value:.2f}'
    values |= {name: str(number) for name, number in sorted(snapshot.counts.items())}
    values['last_error'] = snapshot.last_error
    if snapshot.error_age_s is not None:
        values['last_error_age_s'] = f'{snapshot.error_age_s:.1f}'
    status = DiagnosticStatus(
        level=level,
        name=f'{state.name}: tracker',
        message=sentence,
        hardware_id=state.topic,
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
    message = DiagnosticArray(status=[status])
    message.header.stamp = stamp
    return message
