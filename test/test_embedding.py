# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A network that describes people: how it is run, asked, weighed, and what it changes."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from onnx_files import average_pool
from people_rig import GREEN, RED, Someone, picture

from rgbd_kcf_tracker import Box, Frame
from rgbd_kcf_tracker.errors import DatasetError, ParameterError
from rgbd_kcf_tracker.evaluation import embedding_fit
from rgbd_kcf_tracker.evaluation.embedding_fit import Told, fit
from rgbd_kcf_tracker.evaluation.identity import Seen, Sighting, Views, pair
from rgbd_kcf_tracker.metric.identity.describer import ALONE, FRESH, Describer
from rgbd_kcf_tracker.metric.identity.embedding import DEVIATION, MEAN, Described, Onnx
from rgbd_kcf_tracker.metric.identity.gallery import (
    BESIDE_NETWORK,
    EVEN,
    EVEN_PER_VIEW,
    NETWORK_PER_VIEW,
    NETWORK_SAME,
    STEEPNESS,
    Compared,
    Gallery,
    Looks,
    View,
    look_log_odds,
)
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.targets import MetricTracker
from rgbd_kcf_tracker.parameters import files_named, with_overrides
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.targets import TargetSet

BOX = Box(10, 20, 40, 80)


@pytest.fixture
def network(tmp_path: Path) -> str:
    path = tmp_path / 'means.onnx'
    path.write_bytes(average_pool())
    return str(path)


def plain(color: tuple[int, int, int]) -> Frame:
    return Frame(np.full((120, 160, 3), color, np.uint8), None, 0)


class Fixed:
    """Gives the vectors that it was given, and remembers what it was asked."""

    even, steepness = 0.5, 12.0

    def __init__(self, vectors: object) -> None:
        self.vectors = vectors
        self.asked: list[list[Box]] = []

    def describe(self, frame: Frame, boxes: Sequence[Box]) -> object:
        self.asked.append(list(boxes))
        return self.vectors if self.vectors is not None else np.ones((len(boxes), 3))


# -- running a network ----------------------------------------------------------------------------


def test_a_network_is_given_what_is_in_a_box_red_first_and_as_imagenet_is(network: str):
    """The network of the test gives the mean of each square of 64 pixels, channel by channel."""
    frame = plain((0, 0, 0))
    frame.color[20:100, 10:50] = 30, 60, 210
    (found,) = np.asarray(Onnx(network, 0.5, 12.0).describe(frame, [BOX]))
    wanted = (np.array([210, 60, 30]) / 255 - MEAN) / DEVIATION
    assert found.reshape(3, 8) == pytest.approx(np.repeat(wanted[:, None], 8, axis=1), abs=1e-4)


def test_a_network_sees_the_box_from_top_to_bottom(network: str):
    frame = plain((0, 0, 0))
    frame.color[20:40, 10:50] = 255  # the upper quarter of the box
    (found,) = np.asarray(Onnx(network, 0.5, 12.0).describe(frame, [BOX]))
    rows = found.reshape(3, 4, 2).mean(axis=(0, 2))
    assert rows[0] > 2 > -1 > rows[1]
    assert rows[1:] == pytest.approx(np.full(3, np.mean(-MEAN / DEVIATION)), abs=0.05)


@pytest.mark.parametrize('box', [Box(-30, -30, 45, 200), Box(159, 119, 1, 1), Box(0, 0, 160, 1)])
def test_boxes_at_the_images_sides_and_of_one_pixel_are_described(network: str, box: Box):
    found = np.asarray(Onnx(network, 0.5, 12.0).describe(plain((1, 2, 3)), [box, BOX]))
    assert found.shape == (2, 24)
    assert found[0] == pytest.approx(found[1], abs=1e-4)


def test_a_file_that_is_no_network_for_pictures_of_people_is_refused_by_its_name(tmp_path: Path):
    text = tmp_path / 'text.onnx'
    text.write_text('no network')
    for parameters in (MetricParameters(embedding=str(text)),):
        for make in (MetricTracker, lambda p: TargetSet('metric', p)):
            with pytest.raises(
                ParameterError, match=r"embedding: OpenCV .* cannot run '.*text\.onnx"
            ):
                make(parameters)


def test_a_network_that_is_not_there_is_no_parameter(tmp_path: Path, monkeypatch):
    with pytest.raises(
        ParameterError, match=r"parameter embedding: there is no file '/none\.onnx'"
    ):
        MetricParameters(embedding='/none.onnx')
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ParameterError, match='there is no file'):
        with_overrides(MetricParameters(), {'embedding': 'means.onnx'})
    (tmp_path / 'means.onnx').write_bytes(average_pool())
    given = with_overrides(MetricParameters(), {'embedding': 'means.onnx'})
    assert given.embedding == str(tmp_path / 'means.onnx'), 'a run may go on in another folder'
    assert files_named(given) == {'embedding': given.embedding}
    assert files_named(MetricParameters()) == {}


def test_a_set_that_begins_anew_does_not_read_its_network_again(network: str):
    targets = TargetSet('metric', MetricParameters(embedding=network))
    Path(network).unlink()
    again = targets.anew()
    again.everyone = True
    for i in range(8):
        again.update(picture([Someone(-0.9 + 0.1 * i, 3.0)] if i > 2 else [], 0.1 * i))
    assert again.metric is not None
    (person,) = again.metric._crowd.people
    assert person.gallery.views[0].described is not None


def test_only_metric_takes_an_embedding():
    with pytest.raises(ParameterError, match='kcf knows no cues and no embedding'):
        TargetSet('kcf', embedding=Fixed(None))


# -- asking it ------------------------------------------------------------------------------------


def test_who_stands_alone_is_described_now_and_then_and_who_may_be_mistaken_in_each_frame():
    embedding = Fixed(None)
    describer = Describer(embedding)
    describer.frame = plain((0, 0, 0))
    red, green = view_of(Someone(0.0, 3.0, RED), None), view_of(Someone(0.0, 3.0, GREEN), None)

    def asked(time: float, *places: float, first: View = red) -> int:
        embedding.asked.clear()
        at = np.array([[place, 3.0] for place in places])
        views = [first] + [red] * (len(at) - 1)
        told = describer.everybody(views, [BOX] * len(at), at, time)
        assert [view.described is not None for view in told] == [True] * len(at)
        assert all(a.roots is b.roots for a, b in zip(told, views, strict=True))
        return sum(len(each) for each in embedding.asked)

    assert asked(0.0, 0.0, 3.0) == 2
    assert asked(0.1, 0.05, 2.95) == 0, 'both go on alone'
    assert asked(0.2, 0.05, 0.05 + 0.9 * ALONE) == 2, 'each may be the other'
    assert asked(0.3, 0.05, 3.0) == 2, 'they were beside each other a moment ago'
    assert asked(0.4, 0.05, 3.0, -2.0) == 1, 'somebody comes'
    assert asked(0.3 + FRESH, 0.05, 3.0, -2.0) == 2
    assert asked(0.3 + 3 * FRESH, 0.05, 3.0) == 2
    assert asked(0.4 + 3 * FRESH, 0.05, 3.0, first=green) == 1, (
        'who stands there now looks otherwise'
    )
    describer.forget()
    assert asked(0.5 + 3 * FRESH, 0.05, 3.0, first=green) == 2


def test_before_a_camera_that_moves_everybody_is_described_in_each_frame():
    """Who was at a place of the last picture is elsewhere in this one."""
    asked = {}
    for turn in (0.0, 0.05):
        embedding = Fixed(None)
        targets = TargetSet('metric', embedding=embedding)
        targets.everyone = True
        one = Someone(0.0, 3.0)
        for i in range(12):
            rotation = np.array(
                [
                    [np.cos(turn * i), 0, np.sin(turn * i)],
                    [0, 1, 0],
                    [-np.sin(turn * i), 0, np.cos(turn * i)],
                ]
            )
            pose = Pose(rotation, np.zeros(3))
            targets.update(picture([one] if i > 3 else [], 0.1 * i, pose=pose))
        asked[turn] = len(embedding.asked)
    assert asked[0.05] > asked[0.0] > 0


def test_who_comes_after_a_frame_without_anybody_is_described(monkeypatch: pytest.MonkeyPatch):
    """Where somebody was half a second ago, and nobody since, stands whoever comes."""
    forgotten = []
    monkeypatch.setattr(Describer, 'forget', lambda self: forgotten.append(True))
    targets = TargetSet('metric', embedding=Fixed(None))
    targets.everyone = True
    for i in range(8):
        targets.update(picture([Someone(0.0, 3.0)] if i in (4, 5) else [], 0.1 * i))
    assert len(forgotten) == 6


def test_vectors_have_length_one_whatever_the_network_gives():
    describer = Describer(Fixed([[3.0, 4.0], [0.0, 1e-3]]))
    describer.frame = plain((0, 0, 0))
    view = view_of(Someone(0.0, 3.0), None)
    one, other = describer.described([view, view], [BOX, BOX])
    assert one.described is not None
    assert other.described is not None
    assert one.described.vector == pytest.approx([0.6, 0.8])
    assert other.described.vector == pytest.approx([0.0, 1.0])
    assert (one.described.even, one.described.steepness) == (0.5, 12.0)


@pytest.mark.parametrize('nothing', [0.0, np.nan, np.inf])
def test_a_network_may_say_nothing_of_somebody(nothing: float):
    """As one whose last step cuts off what is negative does of a dark picture."""
    describer = Describer(Fixed([[nothing, nothing], [1.0, 0.0]]))
    describer.frame = plain((0, 0, 0))
    view = view_of(Someone(0.0, 3.0), None)
    one, other = describer.everybody([view, view], [BOX, BOX], np.array([[0, 3.0], [2, 3.0]]), 0.0)
    assert one.described is None
    assert other.described is not None


@pytest.mark.parametrize('bad', [np.ones(3), np.ones((1, 3)), np.ones((2, 0)), np.ones((2, 4))])
def test_an_embedding_that_gives_no_vector_for_each_box_is_refused(bad: np.ndarray):
    embedding = Fixed(np.ones((2, 3)))
    describer = Describer(embedding)
    describer.frame = plain((0, 0, 0))
    view = view_of(Someone(0.0, 3.0), None)
    describer.described([view, view], [BOX, BOX])
    embedding.vectors = bad
    with pytest.raises(ParameterError, match=r'a vector for each of 2 boxes, .*: \(2, 3\) numbers'):
        describer.described([view, view], [BOX, BOX])


# -- weighing it ----------------------------------------------------------------------------------


def view_of(one: Someone, vector: Sequence[float] | None) -> View:
    """How somebody is known who was chosen in a first picture, with a vector or without."""
    tracker = MetricTracker(MetricParameters())
    tracker.start(picture([one], 0.0), one.box)
    assert tracker._targets is not None
    person = tracker._targets.person(tracker._number)
    assert person is not None
    (view,) = person.gallery.views
    if vector is None:
        return view
    unit = np.array(vector, np.float32) / np.float32(np.linalg.norm(vector))
    return dataclasses.replace(view, described=Described(unit, 0.5, 12.0))


def test_what_a_network_says_is_a_line_in_the_cosine_and_at_most_so_much_for_somebody():
    for alike, views in ((0.7, 1), (0.5, 1), (0.7, 4)):
        colors = STEEPNESS * (alike - EVEN - EVEN_PER_VIEW * np.log2(views))
        assert look_log_odds(alike, 1.0, views) == pytest.approx(colors)
        for said in (-0.5, 0.3, 9.0):
            shared = said - NETWORK_PER_VIEW * np.log2(views)
            wanted = BESIDE_NETWORK * colors + min(shared, NETWORK_SAME)
            assert look_log_odds(alike, 1.0, views, network=said) == pytest.approx(wanted)


def test_views_with_and_without_a_vector_are_compared_together():
    one = Someone(0.0, 3.0)
    seen = view_of(one, (1, 0))
    several = Looks.joined(
        [Looks.of([view_of(one, None)]), Looks.of([view_of(one, (1, 1)), view_of(one, (0, 1))])]
    )
    compared = Compared.of(seen, several)
    said = 12.0 * (np.array([np.nan, np.sqrt(0.5), 0.0]) - 0.5)
    assert compared.network == pytest.approx(said, nan_ok=True, abs=1e-5)
    assert compared.likeness[:, 1] == pytest.approx(said, nan_ok=True, abs=1e-5)
    assert compared.of_each([0, 1])[:, 1] == pytest.approx(
        [np.nan, said[1]], nan_ok=True, abs=1e-5
    ), 'by the nearest of his views, as by colours'
    without = Compared.of(view_of(one, None), several)
    assert np.isnan(without.network).all()
    assert without.similarity() == pytest.approx(compared.similarity())


def test_a_network_tells_two_apart_who_wear_the_same_and_what_is_new_is_told_by_colours():
    one = Someone(0.0, 3.0)
    gallery = Gallery.of(view_of(one, (1, 0)), 0.0)
    mine, other, unknown = (gallery.log_odds(view_of(one, v)) for v in ((1, 0), (0, 1), None))
    assert other < 0 < unknown
    assert mine > 3
    gallery.learn(view_of(one, (0, 1)), 1.0)
    assert len(gallery.views) == 1, 'it looks the same, whatever a network says'
    before = gallery.log_odds_before(
        1.0, view_of(one, (0, 1)), Compared.of(view_of(one, (0, 1)), gallery.looks).likeness
    )
    assert before == pytest.approx(other)


# -- following with it ----------------------------------------------------------------------------


class Truth:
    """Knows who is where at each time."""

    even, steepness = 0.5, 12.0

    def __init__(self) -> None:
        self.names: dict[int, list[tuple[str, Box]]] = {}

    def describe(self, frame: Frame, boxes: Sequence[Box]) -> np.ndarray:
        return np.stack([self._vector(frame, box) for box in boxes])

    def _vector(self, frame: Frame, box: Box) -> np.ndarray:
        there = [(shown.iou(box), name) for name, shown in self.names[frame.stamp_ns]]
        iou, name = max(there, default=(0.0, ''))
        return np.eye(3)[('a', 'b').index(name) if iou > 0.3 else 2]


class Walks:
    """Two in the same clothes who come, go, and come again, ten times a second."""

    def __init__(self) -> None:
        self.truth = Truth()
        self.time = 0.0

    def __call__(self, name: str = '', start: float = 0.0, end: float = 0.0, count: int = 15):
        for x in np.linspace(start, end, count):
            self.time += 0.1
            one = Someone(float(x), 3.0, RED)
            frame = picture([one] if name else [], self.time)
            self.truth.names[frame.stamp_ns] = [(name, one.box)] if name else []
            yield frame, one.box


@pytest.mark.parametrize('knows', [False, True])
def test_of_two_in_the_same_clothes_a_network_that_tells_them_apart_follows_the_right_one(
    knows: bool,
):
    walks = Walks()
    targets = TargetSet('metric', embedding=walks.truth if knows else None)
    targets.everyone = True
    for frame, _ in walks(count=4):
        targets.update(frame)
    number = 0
    for k, (frame, box) in enumerate(walks('a', -0.9, 0.9)):
        if k == 3:
            number = targets.add(frame, box)
        else:
            targets.update(frame)
    for _ in range(100):
        for frame, _ in walks(count=1):
            targets.update(frame)
    shown = [targets.update(frame)[number].box for frame, _ in walks('b', 0.9, -0.9)]
    assert any(box is not None for box in shown) != knows, 'the other is a stranger'
    for _ in range(100):
        for frame, _ in walks(count=1):
            targets.update(frame)
    if knows:
        last = [targets.update(frame)[number] for frame, _ in walks('a', -0.9, 0.9)][-1]
        assert last.box is not None
        assert last.score > 0.8


def test_everybody_keeps_a_number_of_his_own_by_a_network_though_all_wear_the_same():
    for knows, count in ((False, 1), (True, 2)):
        walks = Walks()
        targets = TargetSet('metric', embedding=walks.truth if knows else None)
        targets.everyone = True
        for frame, _ in walks(count=4):
            targets.update(frame)
        numbers: dict[str, set[int]] = {'a': set(), 'b': set()}
        for name in ('a', 'b', 'a', 'b'):
            tracks: dict[int, object] = {}
            for frame, _ in walks(name, -0.9, 0.9):
                tracks = {n: t for n, t in targets.update(frame).items() if t.box is not None}
            numbers[name] |= set(tracks)
            for frame, _ in walks(count=60):
                targets.update(frame)
        assert len(numbers['a'] | numbers['b']) == count
        assert len(numbers['a']) == len(numbers['b']) == 1


def test_a_network_named_by_a_parameter_is_asked_and_the_boxes_of_one_alone_are_the_same(
    network: str,
):
    answers = []
    for path in ('', network):
        walks = Walks()
        tracker = MetricTracker(MetricParameters(embedding=path))
        tracks = []
        for k, (frame, box) in enumerate(walks('a', -0.9, 0.9)):
            tracks.append(tracker.update(frame) if k else tracker.start(frame, box))
        assert tracker._targets is not None
        person = tracker._targets.person(tracker._number)
        assert person is not None
        assert all((view.described is not None) == bool(path) for view in person.gallery.views)
        answers.append([track.box for track in tracks])
    assert answers[0] == answers[1]


def test_a_part_of_somebody_is_judged_by_what_the_network_says_of_all_of_him():
    """By its colours alone it was the target at 4 log-odds, he himself at less than even ones."""
    walks = Walks()
    targets = TargetSet('metric', embedding=walks.truth)
    targets.everyone = True
    for frame, _ in walks(count=4):
        targets.update(frame)
    for frame, _ in walks('a', -0.9, 0.9):
        targets.update(frame)
    assert targets.metric is not None
    for _ in range(30):
        for frame, _ in walks(count=1):
            targets.update(frame)
    for frame, _ in walks('b', 0.9, 0.0):
        targets.update(frame)
    account = targets.metric.account
    assert account is not None
    (sight,) = account.sights
    seen = sight.seen
    upper = dataclasses.replace(seen, mask=seen.mask[: int(0.6 * len(seen.mask))])
    first = min(targets.metric._crowd.people, key=lambda person: person.number)
    assert first.gallery.log_odds(account.look(upper)) < 0
    assert first.gallery.log_odds(account.look(seen)) < 0


# -- fitting it -----------------------------------------------------------------------------------


def told(even: float, steepness: float, count: int = 4000) -> Told:
    """Pairs whose cosines say what they are by a line, and whose colours say nothing."""
    rng = np.random.default_rng(0)
    cosine = rng.uniform(0, 1, count)
    same = rng.random(count) < 1 / (1 + np.exp(-steepness * (cosine - even)))
    ones = np.ones(count)
    return Told(cosine, np.full(count, np.nan), ones, same, ones)


def test_the_line_by_which_pairs_were_drawn_is_found_again():
    assert fit(told(0.55, 14.0)) == pytest.approx((0.55, 14.0), rel=0.08)
    assert told(0.55, 14.0).bits(told(0.55, 14.0).odds()) == pytest.approx(1.0), 'nothing is known'


@pytest.mark.parametrize('steepness', [0.0, -14.0])
def test_a_network_that_tells_nothing_is_not_fitted(steepness: float):
    with pytest.raises(DatasetError, match='the network tells nothing of these people'):
        fit(told(0.5, steepness))


def seen_again(count: int, apart: float = 4.0) -> Seen:
    """Two in the same clothes, each seen so often; a network tells them apart."""
    views = [view_of(Someone(0.0, 3.0), vector) for vector in ((1, 0.1), (0.1, 1))]
    sightings = [
        Sighting(person, 2 * n + person, round(apart * (2 * n + person) * 1e9), views[person])
        for n in range(count)
        for person in (0, 1)
    ]
    return Seen('hall', 2 * count, 2 * count, tuple(sightings))


def test_pairs_of_one_and_of_two_weigh_the_same_and_few_are_refused():
    alone = Views(lambda frame, box: None, lambda first, second: 0.5)
    pairs = Told.of([pair(seen_again(7), None, alone)])
    assert np.count_nonzero(pairs.same) == 2 * 21
    assert pairs.weight[pairs.same].sum() == pytest.approx(pairs.weight[~pairs.same].sum())
    assert pairs.cosine[pairs.same] == pytest.approx(np.ones(42))
    assert (pairs.cosine[~pairs.same] < 0.3).all()
    assert pairs.alike == pytest.approx(np.ones(len(pairs.same)), abs=1e-5)
    with pytest.raises(DatasetError, match=r'2 pairs of sightings are of one person.*30 are'):
        Told.of([pair(seen_again(2), None, alone)])


def test_the_command_prints_the_parameters_for_a_network(network: str, monkeypatch, capsys):
    seen = seen_again(8)
    monkeypatch.setattr(embedding_fit, 'open_dataset', lambda name, options: [name])
    monkeypatch.setattr(embedding_fit, '_seen', lambda sequence, parameters, camera: seen)
    monkeypatch.setattr('sys.argv', ['embedding_fit', 'hall/', '--embedding', network])
    assert embedding_fit.main() == 0
    first, second = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r'embedding_even: 0\.\d\d, embedding_steepness: [\d.]+', first)
    assert '120 pairs, 56 of them of one person' in second
    monkeypatch.setattr('sys.argv', ['embedding_fit', 'hall/', '--embedding', '/none.onnx'])
    assert embedding_fit.main() == 2
    assert "embedding_fit: error: parameter embedding: there is no file '/none.onnx'" in (
        capsys.readouterr().err
    )
