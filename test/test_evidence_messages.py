# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""``~/evidence``: what is written is read again, and what nobody sane writes is refused."""

from __future__ import annotations

import copy
import random
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rgbd_kcf_tracker import Box, Frame, RgbdKcfError, Track, TrackState
from rgbd_kcf_tracker.insight import Considered, Insight, KnownView
from rgbd_kcf_tracker.recordings import evidence_messages
from rgbd_kcf_tracker.recordings.bag_types import BAG_TYPES
from rgbd_kcf_tracker.recordings.evidence_messages import evidence_array, evidence_of
from rgbd_kcf_tracker.recordings.rawbag import typestore
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages
from rgbd_kcf_tracker.view.showing import Seen, pack, show

HEADER = TrackMessages(BAG_TYPES).header(1_700_000_000_123_456_789, 'camera')
ARRAY = 'diagnostic_msgs/msg/DiagnosticArray'


def known() -> tuple[tuple[Track, ...], dict[int, Insight]]:
    """A hidden target, one that is seen, somebody whom nobody chose, and one of another tracker."""
    rng = np.random.default_rng(3)
    views = (
        KnownView(((0.0, 0.2, 1.0), None, (0.4, 0.6, 0.8)), 1.78),
        KnownView((None, (1.0, 1.0, 1.0)), None),
    )
    weights = rng.random(50)
    hidden = Track(
        None,
        TrackState.OCCLUDED,
        id=7,
        predicted=(0.1, 0.2, 3.0),
        velocity=(0.5, 0.0, -1.25),
        covariance=(0.04, 0, 0.001, 0, 0.01, 0, 0.001, 0, 0.25),
    )
    seen = Track(Box(10, 20, 30, 60), TrackState.TRACKING, 0.9, id=3)
    person = Track(None, TrackState.OCCLUDED, id=4)
    pixels = Track(Box(1, 2, 3, 4), TrackState.TRACKING, 0.5, id=9)
    return (hidden, seen, person, pixels), {
        7: Insight(
            considered=(
                Considered(Box(10.25, 20, 30, 60), 0.8125, {'look': 1.5, 'who stands there': -3.0}),
                Considered(Box(-5, 0, 8, 9), 0.0625, {'look': -2.0}, np.ones((4, 5), bool)),
            ),
            particles=rng.normal((0, 0, 3), 0.5, (50, 3)),
            weights=weights / weights.sum(),
            floor=(0.0, 0.004, -0.25),
            step=2,
            gallery=views,
            response=0.75,
        ),
        3: Insight(gallery=views),
        4: Insight(gallery=views),
        9: Insight(
            particle_pixels=rng.normal(100, 9, (50, 2)), weights=np.full(50, 0.02), response=0.25
        ),
    }


def written() -> Any:
    tracks, insights = known()
    return evidence_array(BAG_TYPES, HEADER, tracks, insights, {7, 3, 9})


def test_what_is_written_is_read_again() -> None:
    (hidden, *_), insights = known()
    # Through the bytes of the wire, as everybody else reads it.
    data = typestore().serialize_cdr(written(), ARRAY)
    message = typestore().deserialize_cdr(data, ARRAY)
    assert message.header.stamp.nanosec == 123_456_789
    told = evidence_of(message)
    assert list(told) == [7, 3, 4, 9]
    first, original = told[7], insights[7]
    assert (first.velocity, first.covariance) == (hidden.velocity, hidden.covariance)
    assert first.asked_for
    assert [(c.box, c.probability, c.cues) for c in first.insight.considered] == [
        (c.box, c.probability, c.cues) for c in original.considered
    ]
    assert first.insight.response == 0.75
    # In whole pixels of the image: of the view there is nothing on the wire.
    assert (first.insight.floor, first.insight.step) == ((0.0, 0.002, -0.25), 1)
    np.testing.assert_allclose(first.insight.particles, original.particles, atol=0.0051)
    np.testing.assert_allclose(first.insight.weights, original.weights, atol=1e-3)
    assert float(first.insight.weights.sum()) == pytest.approx(1)
    assert first.insight.gallery == original.gallery
    assert told[9].insight.response == 0.25
    np.testing.assert_allclose(
        told[9].insight.particle_pixels, insights[9].particle_pixels, atol=0.051
    )
    # Of those whom nobody asked for one view is enough.
    assert not told[4].asked_for
    assert told[4].insight.gallery == original.gallery[:1]
    assert told[3].insight.particles is None
    assert told[3].velocity is None


def test_particles_of_one_who_is_seen_are_nobodys_business() -> None:
    insights = known()[1]
    seen = Track(Box(1, 2, 3, 4), TrackState.TRACKING, 0.9, id=7)
    told = evidence_of(evidence_array(BAG_TYPES, HEADER, [seen], insights, ()))
    assert told[7].insight.particles is None
    assert told[7].insight.weights is None


def test_size_is_bounded_whatever_the_tracker_knows() -> None:
    rng = np.random.default_rng(0)
    view = KnownView(((0.5, 0.5, 0.5),) * 9, 1.8)
    much = Insight(
        considered=tuple(
            Considered(Box(1, 2, 3, 4), 0.5, {f'cue {n}': 1.0 for n in range(11)})
            for _ in range(40)
        ),
        particles=rng.normal(size=(5000, 3)),
        weights=np.full(5000, 1 / 5000),
        gallery=(view,) * 40,
    )
    tracks = [Track(None, TrackState.OCCLUDED, id=n) for n in range(1, 101)]
    insights = dict.fromkeys(range(1, 101), much)
    message = evidence_array(BAG_TYPES, HEADER, tracks, insights, range(1, 101))
    assert len(typestore().serialize_cdr(message, ARRAY)) < 64 * 16_000
    told = evidence_of(message)
    assert len(told) == evidence_messages.MOST_TARGETS
    first = told[1].insight
    assert len(first.considered) == evidence_messages.MOST_CONSIDERED
    assert len(first.gallery) == evidence_messages.MOST_VIEWS
    assert first.particles is not None
    assert 200 < len(first.particles) <= evidence_messages.MOST_PARTICLES


def with_value(row: int, key: str, value: str) -> Any:
    """The message with another value under a key of one of its statuses."""
    message = written()
    (pair,) = (pair for pair in message.status[row].values if pair.key == key)
    pair.value = value
    return message


@pytest.mark.parametrize(
    ('row', 'key', 'value'),
    [
        (0, 'id', 'seven'),
        (0, 'id', ''),
        (0, 'response', 'nan'),
        (0, 'floor', '1 2'),
        (0, 'floor', '0 0 inf'),
        (0, 'velocity', '1 2 3 4'),
        (0, 'covariance', '1 0 0 0 1 0 0 0 1e300'),
        (0, 'covariance', '1'),
        (0, 'particles', ''),
        (0, 'particles', '1 2 3'),
        (0, 'particles', '1 2 3 4 5'),
        (0, 'particles', '1 2 nan 1'),
        (0, 'particles', '1 2 3 0'),
        (0, 'particles', '1 2 3 -1 1 2 3 2'),
        (0, 'particles', '1 2 3 1 ' * 301),
        (0, 'particles', '1' * 100_000),
        (0, 'view_1', '1.8 url(//example.org/x)'),
        (0, 'view_1', '1.8 #12345'),
        (0, 'view_1', '1.8 #ffffff;x:y'),
        (0, 'view_1', 'inf #ffffff'),
        (0, 'view_1', ''),
        (0, 'view_1', '1.8' + ' -' * 33),
        (1, 'id', '8'),
        (1, 'probability', '1.5'),
        (1, 'probability', 'nan'),
        (1, 'x', 'nan'),
        (1, 'width', '-3'),
        (1, 'height', '1e300'),
        (1, 'cue look', 'inf'),
    ],
)
def test_what_is_no_evidence_is_refused(row: int, key: str, value: str) -> None:
    with pytest.raises(RgbdKcfError, match=r"'target( candidate_1)?' is no evidence of a target"):
        evidence_of(with_value(row, key, value))


def test_too_much_of_anything_is_refused() -> None:
    message = written()
    message.status += [message.status[1]] * 7
    with pytest.raises(RgbdKcfError, match='more than 6 candidates'):
        evidence_of(message)
    message = written()
    message.status.append(message.status[0])
    with pytest.raises(RgbdKcfError, match='comes twice'):
        evidence_of(message)
    message = written()
    message.status = message.status[:1] * 10_000
    with pytest.raises(RgbdKcfError, match='more than an evidence has'):
        evidence_of(message)
    message = written()
    message.status[1].values *= 9
    with pytest.raises(RgbdKcfError, match='values'):
        evidence_of(message)
    message = written()
    message.status[0].values += [SimpleNamespace(key='particle_pixels', value='1 2 3')]
    with pytest.raises(RgbdKcfError, match='in metres and in pixels'):
        evidence_of(message)


def test_whatever_is_not_refused_can_be_shown() -> None:
    """Values that are swapped, cut, doubled and made up end as a page or as our own error."""
    rng = random.Random(5)
    junk = ('', '-', 'nan', '-inf', '1e309', '0', '-1', '1 2 3', '7', '#000000', '\x00', '9' * 9000)
    tracks = {track.id: track for track in known()[0]}
    frame = Frame(np.zeros((40, 60, 3), np.uint8))
    shown = 0
    for _ in range(400):
        message = copy.deepcopy(written())
        for _ in range(rng.randint(1, 3)):
            status = rng.choice(message.status)
            pair, other = rng.choice(status.values), rng.choice(status.values)
            how = rng.randrange(5)
            if how == 0:
                pair.value = rng.choice(junk)
            elif how == 1:
                pair.key, other.key = other.key, pair.key
            elif how == 2:
                pair.value = pair.value[: rng.randint(0, len(pair.value))]
            elif how == 3:
                status.values.remove(pair)
            else:
                rng.shuffle(message.status)
            if not status.values:
                break
        try:
            told = evidence_of(message)
        except RgbdKcfError:
            continue
        insights = {number: each.insight for number, each in told.items()}
        pack(*show(Seen(frame, tracks, insights=insights)))
        shown += 1
    assert 20 < shown < 400
