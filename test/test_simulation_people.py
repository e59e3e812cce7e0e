# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Scenes of several people: ids, exact truth for each, and what their names promise."""

from __future__ import annotations

import math
from itertools import combinations, pairwise

import numpy as np
import pytest

from rgbd_kcf_tracker.simulation import SCENARIOS, SimulatedSequence, expand_names, simulate
from rgbd_kcf_tracker.simulation.actors import VisitorActor
from rgbd_kcf_tracker.simulation.driving import Robot, drive_behind
from rgbd_kcf_tracker.simulation.floorplan import FloorPlan, Footprint
from rgbd_kcf_tracker.simulation.people import Stance, random_person
from rgbd_kcf_tracker.simulation.walking import Away, Go, Stay, Walker, rehearse

SMALL = (160, 120)
PEOPLE = expand_names(['people'])
COMERS = ('comers', 'comers_twins', 'comers_dusk')


def cast(sequence: SimulatedSequence) -> list[VisitorActor]:
    actors = [sequence.scene.actors[i] for i in sequence.scene.people]
    assert all(isinstance(actor, VisitorActor) for actor in actors)
    return actors  # type: ignore[return-value]


def test_groups_of_scenarios() -> None:
    alone = expand_names(['all'])
    assert set(PEOPLE) == {
        *('comers', 'comers_twins', 'comers_dusk', 'reunion'),
        *('group_crossing', 'at_home', 'lookaround', 'following'),
    }
    assert set(alone) | set(PEOPLE) == set(SCENARIOS)
    assert not set(alone) & set(PEOPLE)
    assert expand_names(['comers', 'people', 'comers'])[0] == 'comers'
    assert len(expand_names(['comers', 'people', 'comers'])) == len(PEOPLE)


@pytest.mark.parametrize('name', PEOPLE)
def test_truth_of_everybody(name: str) -> None:
    sequence = simulate(name, seed=2, rate_hz=0.4, size=(320, 240))
    assert 3 <= len(sequence.people) <= 6
    agree = total = 0
    for index, simulated in enumerate(sequence):
        assert tuple(simulated.truths) == sequence.people
        assert simulated.truth == simulated.truths[1]
        depth = simulated.frame.depth
        assert depth is not None
        if index % 5 == 0:
            assert sequence.truths(index) == simulated.truths
        for truth in simulated.truths.values():
            assert 0 <= truth.visible_fraction <= 1
            assert (truth.shown is None) == (truth.visible_fraction == 0)
            assert truth.distance == truth.position[2]
            if truth.shown is None:
                continue
            assert truth.body is not None
            assert truth.body.intersection(truth.shown) == truth.shown.area
            if truth.visible_fraction < 0.95 or truth.distance > 4.2:
                continue
            # in the box of somebody who is fully seen, the surface lies about their middle
            b = truth.shown
            patch = depth[int(b.y) : int(b.bottom), int(b.x) : int(b.right)]
            near = np.abs(patch - truth.distance) < 0.45
            total += 1
            agree += bool(near.mean() > 0.25)
            u, v = sequence.intrinsics.project(*truth.position)
            assert truth.body.x < u < truth.body.right
            assert truth.body.y < v < truth.body.bottom
    assert total > 5
    assert total - agree <= max(1, 0.05 * total)


@pytest.mark.parametrize(('name', 'seed'), [*((name, 5) for name in PEOPLE), ('comers_twins', 119)])
def test_nobody_appears_or_vanishes_in_view(name: str, seed: int) -> None:
    scene = simulate(name, seed=seed, rate_hz=1, size=SMALL)
    for person, actor in enumerate(cast(scene), 1):
        edges = [v.start for v in actor.visits if v.start > 0]
        edges += [v.end for v in actor.visits if not v.stays]
        for t in edges:
            one = SimulatedSequence(scene.scene, name, 0, 1, [round(t * 1e9)], SMALL,
                                    scene.intrinsics)  # fmt: skip
            assert one.truths(0)[person].visible_fraction == 0, (person, t)


@pytest.mark.parametrize('name', COMERS)
def test_comers_are_away_for_6_to_25_s_and_come_back_elsewhere(name: str) -> None:
    sequence = simulate(name, seed=1, rate_hz=2, size=SMALL)
    assert len(sequence) == 90
    assert 4 <= len(sequence.people) <= 6
    truths = [sequence.truths(i) for i in range(len(sequence))]
    assert truths[0][1].visible_fraction > 0.7
    assert sum(t.visible is not None for t in truths[0].values()) in (2, 3)
    returns = 0
    for person, actor in zip(sequence.people, cast(sequence), strict=True):
        away = [(a.end, b.start) for a, b in pairwise(actor.visits) if b.start < 40]
        returns += bool(away)
        for gone, back in away:
            seen = [i for i, t in enumerate(truths) if t[person].visible is not None]
            before = max(i for i in seen if i / 2 <= gone)
            after = min(i for i in seen if i / 2 >= back)
            assert 5 < (after - before) / 2 < 28
            places = [truths[i][person].position for i in (before, after)]
            assert math.dist(*places) > 1.0
    assert returns >= len(sequence.people) - 1


def test_twins_differ_in_height_and_build_alone() -> None:
    for seed in range(3):
        people = [actor.person for actor in cast(simulate('comers_twins', seed=seed, size=SMALL))]
        twins = [p for p in people if p.atlas is people[0].atlas]
        assert len(twins) == 2
        assert abs(twins[0].height - twins[1].height) > 0.1
        assert abs(twins[0].build - twins[1].build) > 0.05
        for field in ('skirt', 'long_hair', 'hat', 'backpack', 'bag'):
            assert getattr(twins[0], field) == getattr(twins[1], field)


def test_dusk_falls_while_the_target_is_away() -> None:
    for seed in range(4):
        sequence = simulate('comers_dusk', seed=seed, size=SMALL)
        visits, light = cast(sequence)[0].visits, sequence.scene.light
        before, after = (np.array([light(t) for t in ts]) for ts in (
            np.arange(0, visits[0].end, 0.5), np.arange(visits[1].start, 45, 0.5),
        ))  # fmt: skip
        for part in (before, after):  # but for the slow wander of the exposure
            assert (part.max(axis=0) / part.min(axis=0)).max() < 1.1
        change = np.log(after.mean(axis=0) / before.mean(axis=0))
        assert np.abs(change).max() > 0.08
        assert change.max() < 0.4


@pytest.mark.parametrize(
    ('name', 'seed'), [('reunion', 10), ('reunion', 17), ('lookaround', 5), ('lookaround', 48)]
)
def test_the_target_is_well_in_view_at_first(name: str, seed: int) -> None:
    """Somebody for whom no free place was found stood before it."""
    assert simulate(name, seed=seed, rate_hz=1, size=SMALL).truth(0).visible_fraction > 0.75


def test_reunion_is_after_30_s() -> None:
    sequence = simulate('reunion', seed=4, rate_hz=4, size=SMALL)
    truths = [sequence.truths(i) for i in range(len(sequence))]
    seen = np.flatnonzero([t[1].visible is not None for t in truths])
    gap = int(np.argmax(np.diff(seen)))
    assert 29 < (seen[gap + 1] - seen[gap]) / 4 < 34
    places = [truths[seen[i]][1].position for i in (gap, gap + 1)]
    assert math.dist(*places) > 1.0
    others = [
        sum(t.visible is not None for person, t in truths[i].items() if person != 1)
        for i in range(seen[gap], seen[gap + 1])
    ]
    assert min(others) > 0


def test_group_stands_shoulder_to_shoulder() -> None:
    actors = cast(simulate('group_crossing', seed=1, size=SMALL))
    closest = max(
        sum(math.dist(a.centre(t)[::2], b.centre(t)[::2]) < 0.6 for a, b in combinations(actors, 2))
        for t in np.arange(6, 16, 0.5)
    )
    assert closest >= len(actors) - 1


def test_people_make_way_for_another() -> None:
    for name in ('comers', 'group_crossing'):
        actors = cast(simulate(name, seed=1, size=SMALL))
        for t in np.arange(0, 30, 0.1):
            here = [actor.centre(t)[::2] for actor in actors if actor.here(t)]
            assert all(math.dist(a, b) > 0.3 for a, b in combinations(here, 2))


def test_lookaround_turns_at_23_degrees_a_second() -> None:
    sequence = simulate('lookaround', seed=3, rate_hz=10, size=SMALL)
    poses = [sequence.camera_pose(i) for i in range(len(sequence))]
    speed = [
        math.degrees(math.acos(min(1.0, (np.trace(a.T @ b) - 1) / 2))) * 10
        for (a, _), (b, _) in pairwise(poses)
    ]
    assert 20 < np.quantile(speed, 0.9) < 27
    # the pose takes a person's place in the picture to their place in the room
    for i in (0, 40, 110):
        rotation, place = poses[i]
        for actor, truth in zip(cast(sequence), sequence.truths(i).values(), strict=True):
            assert rotation @ truth.position + place == pytest.approx(actor.centre(i / 10))


def test_a_robot_keeps_its_distance_and_the_target_in_view() -> None:
    sequence = simulate('following', seed=3, rate_hz=5, size=SMALL)
    poses = [sequence.camera_pose(i) for i in range(len(sequence))]
    target, *others = cast(sequence)
    gaps, bearings = [], []
    for i, (rotation, place) in enumerate(poses):
        x, _, z = rotation.T @ (target.centre(i / 5) - place)
        gaps.append(math.hypot(x, z))
        bearings.append(math.atan2(x, z))
        for other in others:
            if other.here(i / 5):
                assert math.dist(other.centre(i / 5)[::2], place[::2]) > 0.5, 'nobody is run over'
    assert poses[-1][1][2] > 7.0, 'it has driven through the hall'
    assert 1.5 < min(gaps) <= max(gaps) < 3.5
    assert max(map(abs, bearings)) < 0.5
    speeds = [math.dist(a[1], b[1]) * 5 for a, b in pairwise(poses)]
    assert max(speeds) < 1.4


def test_a_robot_drives_as_it_can() -> None:
    way = drive_behind(lambda t: (3.0, 4.0 + 0.5 * t), 2.0, 30.0, Robot(speed=1.0, turn=0.6))
    step = np.diff(way[:, 0])
    speed = np.hypot(*np.diff(way[:, 1:3], axis=0).T) / step
    turn = np.diff(way[:, 3]) / step
    assert speed.max() <= 1.0 + 1e-9
    assert np.abs(turn).max() <= 0.6 + 1e-9
    assert np.abs(np.diff(speed)).max() <= 1.5 * 0.02 + 1e-9
    # At the end it is as fast as the target, behind it, too far away by what makes it as fast.
    assert speed[-1] == pytest.approx(0.5, abs=0.02)
    assert math.hypot(3.0 - way[-1, 1], 4.0 + 0.5 * way[-1, 0] - way[-1, 2]) == pytest.approx(
        2.0 + 0.5 / 1.5, abs=0.05
    )


def test_target_alone_is_person_1() -> None:
    sequence = simulate('crowd', seed=1, rate_hz=2, size=SMALL)
    assert sequence.people == (1,)
    assert sequence[0].truths == {1: sequence[0].truth}


def test_sitting_is_at_the_height_of_a_chair() -> None:
    person, _ = random_person(np.random.default_rng(3))
    standing, sitting = (person.solids(Stance(0, 3, sit=s)) for s in (0.0, 1.0))
    top = [-float(s.origin[:, 1].min()) for s in (standing, sitting)]
    assert 0.65 * top[0] < top[1] < 0.82 * top[0]
    low = sitting.origin[:, 1] + np.abs(sitting.frame[:, 1]).max(axis=1)
    assert -0.08 < low.max() < 0.12
    # the trunk is behind the feet, by a thigh's length
    assert 0.3 < sitting.origin[:, 2].max() - 3 < 0.6


def test_way_leads_around_furniture() -> None:
    plan = FloorPlan([Footprint(-1, 2, 1, 3), Footprint(1, 2, 9, 3)])
    way = plan.way((0, 1), (0, 4))
    assert way[-1] == (0, 4)
    assert len(way) == 3  # round the free end on the left
    assert all(x < -1.3 for x, _ in way[:-1])
    for a, b in pairwise([(0, 1), *way]):
        assert not any(f.cut_by(a, b) for f in plan.footprints)
    assert plan.way((0, 1), (3, 1)) == [(3, 1)]
    assert not plan.free(0, 3.2)
    assert plan.free(0, 3.4)


def test_walkers_keep_their_plans_and_their_distance() -> None:
    plan = FloorPlan([Footprint(-0.5, 2.5, 0.5, 3.5)])
    walkers = [
        Walker((-2, 2), 0.0, (Go((2, 2)), Stay(1.0, facing=1.0)), 1.2, 1.4),
        Walker((2, 2), 0.0, (Go((-2, 2)), Away(3.0, (5, 5)), Go((3, 5))), 1.2, 1.4),
        Walker((0, 1), 0.0, (Go((0, 5)),), 1.0, 1.4),
    ]
    first, second, third = rehearse(walkers, plan, 12.0)
    assert len(first) == len(third) == 1
    assert [v.stays for v in second] == [False, True]
    assert second[1].start - second[0].end == pytest.approx(3.0, abs=0.11)
    assert 3.0 < second[0].end < 7.0
    end = first[0].motion.stance(11.0)
    assert math.dist((end.x, end.z), (2, 2)) < 0.15
    assert end.heading == pytest.approx(1.0, abs=0.2)
    last = third[0].motion.stance(11.0)
    assert math.dist((last.x, last.z), (0, 5)) < 0.15
    for t in np.arange(0, 12, 0.05):
        poses = [v.motion.stance(t) for each in (first, second, third) for v in each
                 if v.start <= t <= v.end]  # fmt: skip
        for a, b in combinations(poses, 2):
            assert math.dist((a.x, a.z), (b.x, b.z)) > 0.33
        assert all(plan.free(p.x, p.z, 0.2) for p in poses)


def test_two_who_block_a_doorway_squeeze_through() -> None:
    plan = FloorPlan([Footprint(-9, 3, -0.4, 3.1), Footprint(0.4, 3, 9, 3.1)])
    walkers = [
        Walker((0, 1), 0.0, (Go((0, 5)),), 1.0, 1.4),
        Walker((0, 5), 0.0, (Go((0, 1)),), 1.0, 1.4),
    ]
    one, other = rehearse(walkers, plan, 20.0)
    assert one[0].motion.stance(19.9).z == pytest.approx(5, abs=0.15)
    assert other[0].motion.stance(19.9).z == pytest.approx(1, abs=0.15)


def test_nobody_flies_in_when_he_comes_back() -> None:
    """The truth had 280 m/s in the frame in which a visit begins."""
    scene = simulate('comers', seed=2, rate_hz=10.0)
    speeds = [float(np.linalg.norm(scene.velocity(index))) for index in range(len(scene))]
    assert 0.5 < max(speeds) < 3.0


@pytest.mark.parametrize('heading', [0.0, 1.0, -2.5])
def test_who_lies_is_on_the_back_where_they_fell(heading: float) -> None:
    person = simulate('at_home', seed=1, size=SMALL).scene.actors[0].person
    feet, high = np.array([0.4, 0.0, 2.5]), 0.2
    standing, lying = (
        person.solids(Stance(feet[0], feet[2], heading, lie=lie, on=high)).origin
        for lie in (0.0, 1.0)
    )
    up, ahead = np.array([0.0, -1.0, 0.0]), np.array([math.sin(heading), 0, -math.cos(heading)])
    assert (standing @ up).max() > 0.9 * person.height
    # As long as they were tall, from the feet backwards, and on what they lie on.
    assert np.allclose((lying - feet) @ -ahead, standing @ up, atol=1e-6)
    assert ((lying @ up) - high).min() > 0.0
    assert ((lying @ up) - high).max() < 0.25 * person.height


def test_people_at_home_sit_and_lie() -> None:
    lies = sits = 0
    for seed in range(3):
        sequence = simulate('at_home', seed=seed, rate_hz=2, size=SMALL)
        for index in range(len(sequence)):
            t = index / 2
            for actor, truth in zip(cast(sequence), sequence.truths(index).values(), strict=True):
                if not actor.here(t) or truth.body is None:
                    continue
                stance = actor._motion(t).stance(t)
                lies += stance.lie > 0.99
                sits += stance.sit > 0.99
                if stance.lie > 0.99:
                    assert -actor.centre(t)[1] < 0.5
    assert lies > 20
    assert sits > 10
