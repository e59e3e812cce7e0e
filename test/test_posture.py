# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Who sits down, leans back or lies is in view, and himself, though he is hardly before the room.

Of two real people at home, in 1,500 frames at 10 Hz, neither had been followed on a sofa or a
mattress.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from people_rig import BLACK, CAMERA, COLS, RED, ROWS, SKIN, WALL, Someone, images, texture

from rgbd_kcf_tracker import Box, Frame, TrackState, create_tracker
from rgbd_kcf_tracker.metric.identity.gallery import View
from rgbd_kcf_tracker.metric.identity.person import Person
from rgbd_kcf_tracker.metric.identity.stature import Height
from rgbd_kcf_tracker.metric.perceive.colors import ColorCodes
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView, grown
from rgbd_kcf_tracker.metric.perceive.fading import ABOUT, Lately, around, fading
from rgbd_kcf_tracker.metric.perceive.figures import Figure, _low
from rgbd_kcf_tracker.metric.perceive.paint import DIFFERS, Paint
from rgbd_kcf_tracker.metric.perceive.room import SETTLE, Room, tolerance
from rgbd_kcf_tracker.metric.perceive.scene import SceneReader
from rgbd_kcf_tracker.metric.perceive.silhouette import Rim, Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import surfaces_in
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.targets import TargetSet

STEP = 0.1
FLOOR = 0.85
"""Metres below the camera, where the feet of everybody are."""
SOFA = 3.12
"""Metres to its back: a chest's thickness behind who sits, as a camera sees it."""


def shown(color: np.ndarray, depth: np.ndarray, i: int, pose: Pose | None = None) -> Frame:
    """A frame in which wall and floor are behind what was drawn, with a camera's noise."""
    rows = np.arange(ROWS)[:, None]
    with np.errstate(divide='ignore'):
        floor = np.where(rows > CAMERA.cy, FLOOR * CAMERA.fy / (rows - CAMERA.cy), np.inf)
    depth = np.where(depth == WALL, np.minimum(WALL, floor), depth)
    noise = np.random.default_rng(i).normal(0, 1, depth.shape)
    depth = depth + 0.0015 * depth**2 * noise
    return Frame(color, depth.astype(np.float32), round(1e9 * STEP * i), CAMERA, pose)


def part(z: float, x: tuple[float, float], y: tuple[float, float]) -> tuple[slice, slice]:
    """Rows and columns between some metres across, and above the floor."""
    u = [round(each * CAMERA.fx / z + CAMERA.cx) for each in x]
    v = [round((FLOOR - each) * CAMERA.fy / z + CAMERA.cy) for each in y]
    return slice(v[1], v[0]), slice(u[0], u[1])


def on_a_sofa(i: int, leaves: int = 85, pose: Pose | None = None) -> tuple[Frame, Someone | None]:
    """Somebody comes in before a brown sofa, sits down, leans back for four seconds, and leaves."""
    color, depth = images([])
    back = part(SOFA, (-0.2, 1.2), (0.0, 1.0))
    color[back], depth[back] = (70, 110, 140), SOFA
    one = None
    if 5 <= i < leaves + 15:
        x = min(-1.4 + 0.08 * (i - 5), 0.5)
        ahead = min(max(0.06 * (i - 32), 0.0), 0.42)  # metres by which he has gone back
        if i >= leaves:
            x, ahead = 0.5 - 0.08 * (i - leaves), 0.0
        one = Someone(x, SOFA - 0.1 - 0.42 + ahead)
        person, there = images([one])
        his = there == one.z
        color[his], depth[his] = person[his], one.z
    return shown(color, depth, i, pose), one


def on_the_floor(i: int) -> tuple[Frame, Box | None]:
    """Somebody comes in, falls, lies on the floor for four seconds, and gets up again."""
    if i < 5:
        return shown(*images([]), i), None
    z = 2.8
    x = min(-1.2 + 0.08 * (i - 5), 0.0)
    one = Someone(x, z, RED, BLACK)
    if not 25 <= i < 70:
        return shown(*images([one]), i), one.box
    color, depth = images([])
    # On his knees and hands, then down.
    high = {25: 1.2, 26: 0.9, 69: 0.9, 68: 0.6}.get(i, 0.36)
    long = {25: 0.6, 26: 0.8, 69: 0.8, 68: 1.1}.get(i, 1.5)
    for a, b, paint in ((0.0, 0.15, SKIN), (0.15, 0.55, RED), (0.55, 1.0, BLACK)):
        pixels = part(z, (x + long * (a - 0.5), x + long * (b - 0.5)), (0.02, high))
        color[pixels], depth[pixels] = paint, z
    rows, cols = part(z, (x - long / 2, x + long / 2), (0.02, high))
    box = Box(cols.start, rows.start, cols.stop - cols.start, rows.stop - rows.start)
    return shown(color, depth, i), box


def followed(scene: Iterator[tuple[Frame, Box | None]], single: bool) -> list[tuple[int, float]]:
    """For each frame with somebody from the tenth on the id that is told and how well it fits."""
    targets, told = TargetSet('metric'), []
    targets.everyone = not single
    tracker = create_tracker('metric')
    for i, (frame, box) in enumerate(scene):
        if single and i < 12:
            continue
        if single:
            track = tracker.start(frame, box) if i == 12 else tracker.update(frame)
            tracks = {1: track}
        else:
            tracks = targets.update(frame)
        if i < 12 or box is None:
            continue
        fits = [(n, t.box.iou(box)) for n, t in tracks.items() if t.box is not None]
        assert len(fits) <= 1, 'nobody else is there'
        told.append(fits[0] if fits else (0, 0.0))
    return told


@pytest.mark.parametrize('single', [True, False])
def test_who_leans_back_into_a_sofa_is_followed(single: bool):
    told = followed(((frame, one and one.box) for frame, one in map(on_a_sofa, range(100))), single)
    assert {number for number, _ in told} <= {1, 0}
    seen = [fit > 0.5 for _, fit in told]
    assert np.mean(seen) > 0.95, [i + 12 for i, each in enumerate(seen) if not each]


@pytest.mark.parametrize('single', [True, False])
def test_who_falls_is_followed_where_he_lies(single: bool):
    told = followed(map(on_the_floor, range(90)), single)
    assert {number for number, _ in told} <= {1, 0}
    seen = [fit > 0.5 for _, fit in told]
    assert np.mean(seen) > 0.95, [i + 12 for i, each in enumerate(seen) if not each]


def test_who_falls_towards_the_camera_is_followed_where_he_lies():
    """Seen along his body he is little of what he was; his size had spoken against him."""
    tracker, seen = create_tracker('metric'), []
    for i in range(12, 70):
        z, wide, high = 2.9, 0.5, {30: 1.15, 31: 0.7}.get(i, 0.36)
        one = Someone(min(-1.2 + 0.1 * (i - 5), 0.0), z, RED, BLACK)
        frame, box = shown(*images([one]), i), one.box
        if i >= 30:
            z = max(z - 0.25 * (i - 29), 2.3)
            color, depth = images([])
            for low, top, paint in ((0.02, 0.7 * high, RED), (0.7 * high, high, SKIN)):
                pixels = part(z, (-wide / 2, wide / 2), (low, top))
                color[pixels], depth[pixels] = paint, z
            rows, cols = part(z, (-wide / 2, wide / 2), (0.02, high))
            box = Box(cols.start, rows.start, cols.stop - cols.start, rows.stop - rows.start)
            frame = shown(color, depth, i)
        track = tracker.start(frame, box) if i == 12 else tracker.update(frame)
        seen.append(track.box is not None and track.box.iou(box) > 0.5)
    assert np.mean(seen) > 0.9, [i + 12 for i, each in enumerate(seen) if not each]


def test_a_table_beside_which_he_was_chosen_is_not_he_lying():
    """As who comes into view beside it and is gone in the next frame, at 5 Hz (real people)."""
    tracker, track = create_tracker('metric'), None
    for i in range(20):
        color, depth = images([])
        table = part(2.75, (-0.6, -0.25), (0.0, 0.75))
        if i < 6:
            one = Someone(-0.1 * (5 - i), 2.8, RED, BLACK)
            color, depth = images([one])
        color[table], depth[table] = (210, 215, 215), 2.75
        frame = shown(color, depth, 2 * i)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    assert track.box is None


def test_who_sits_there_for_long_is_no_part_of_the_sofa():
    """Pixels that hardly showed for a frame were learned as the room, and more in the next."""
    told = followed(
        ((f, one and one.box) for f, one in (on_a_sofa(i, leaves=400) for i in range(350))), False
    )
    assert np.mean([fit > 0.5 for _, fit in told[-100:]]) > 0.95


def test_a_camera_that_has_moved_long_ago_stands():
    """Who leant back was a piece of the sofa to it, for ever."""
    poses = [Pose(np.eye(3), np.array([0.01 * min(i, 4), 0.0, 0.0])) for i in range(110)]
    scene = (on_a_sofa(i, leaves=100, pose=poses[i]) for i in range(110))
    told = followed(((frame, one and one.box) for frame, one in scene), False)
    assert np.mean([fit > 0.5 for _, fit in told]) > 0.95


def test_of_a_chosen_thing_that_was_hidden_nothing_is_made_a_person():
    """A box on the floor was one from the second frame on, and hardly known later."""
    targets, track = TargetSet('metric'), None
    pixels = part(2.5, (-0.3, 0.3), (0.05, 0.45))
    for i in range(70):
        color, depth = images([])
        if i < 40 or i > 60:
            color[pixels], depth[pixels] = (40, 160, 200), 2.5
        if i == 0:
            rows, cols = pixels
            box = Box(cols.start, rows.start, cols.stop - cols.start, rows.stop - rows.start)
            number = targets.add(shown(color, depth, i), box)
        else:
            track = targets.update(shown(color, depth, i))[number]
    assert track is not None
    assert track.box is not None
    assert track.score > 0.9


@pytest.mark.parametrize('after', [6, 50])
def test_a_dog_where_somebody_was_is_nobody(after: int):
    """He went in a moment, as behind a curtain that is just behind him; a dog passes there then."""
    targets, gone = TargetSet('metric'), 30
    targets.everyone = True
    wide = ((0.0, 0.22, 0.18), (0.22, 0.85, 0.75), (0.85, 1.6, 0.5))
    for i in range(gone + after + 45):
        color, depth = images([])
        cloth = part(3.15, (-0.7, 0.7), (0.0, 1.8))
        color[cloth], depth[cloth] = (90, 90, 140), 3.15
        if 5 <= i < gone:
            for top, bottom, across in wide:
                x = min(-1.4 + 0.1 * (i - 5), 0.0)
                pixels = part(3.0, (x - across / 2, x + across / 2), (1.6 - bottom, 1.6 - top))
                color[pixels], depth[pixels] = RED, 3.0
        dog = None
        if i >= gone + after:
            x = -0.9 + 0.05 * (i - gone - after)
            dog = part(2.8, (x - 0.3, x + 0.3), (0.03, 0.53))
            color[dog], depth[dog] = BLACK, 2.8
        tracks = targets.update(shown(color, depth, i))
        if dog is not None:
            rows, cols = dog
            box = Box(cols.start, rows.start, cols.stop - cols.start, rows.stop - rows.start)
            on = [n for n, t in tracks.items() if t.box is not None and t.box.iou(box) > 0.3]
            assert not on, i


def test_who_has_left_a_sofa_is_not_there():
    tracker = create_tracker('metric')
    track = None
    for i in range(12, 120):
        frame, one = on_a_sofa(i)
        track = tracker.update(frame) if track is not None else tracker.start(frame, one.box)
    assert track.state in (TrackState.OCCLUDED, TrackState.LOST)
    assert track.box is None


# -- its parts ------------------------------------------------------------------------------------


def silhouette(depth: np.ndarray, left: int, top: int, mask: np.ndarray) -> Silhouette:
    return Silhouette.of(DepthView(depth, 1, CAMERA), left, top, mask, 0, Rim())


def test_of_several_low_ones_he_is_the_one_that_is_most_where_he_was_or_below():
    """As beside who steps over him, of whom a part is taken for a figure."""
    depth = np.full((ROWS, COLS), 2.0, np.float32)

    def figure(left: int, top: int, wide: int, high: int) -> Figure:
        seen = silhouette(depth, left, top, np.ones((high, wide), np.bool_))
        return Figure(seen, np.zeros(2), False)

    scene = SimpleNamespace(lately=[figure(40, 60, 60, 30).seen])
    over, lies = figure(70, 40, 30, 50), figure(35, 70, 60, 30)
    assert _low(scene, [over], [lies]) == [lies], 'less of who steps over him is there'
    assert _low(scene, [figure(40, 62, 60, 30)], [lies]) == [], 'he is a figure'
    assert _low(scene, [], [figure(35, 88, 60, 20)]), 'he has fallen on'
    assert _low(scene, [], [figure(110, 70, 60, 30)]) == [], 'beside'


def test_who_lies_shows_whole_where_his_legs_alone_did_and_falls_no_deeper():
    """As when the other has gone who walked over him, of whom his legs were told apart."""
    depth = np.full((ROWS, COLS), 2.0, np.float32)
    left, top, wide, high = 90, 90, 20, 10
    legs = silhouette(depth, left, top, np.ones((high, wide), np.bool_))
    seen = silhouette(depth, 40, 86, np.ones((14, 70), np.bool_))
    whole = Figure(seen, np.zeros(2), False)
    assert _low(SimpleNamespace(lately=[legs]), [], [whole]) == [whole]


def test_the_colours_of_the_room_are_learned_where_it_shows_and_what_differs_is_told():
    paint, image = Paint(), texture(3)
    assert paint.differs(image) is None
    still = np.ones(image.shape[:2], np.bool_)
    still[:, :40] = False
    paint.learn(image, still, STEP)
    other = np.clip(image.astype(int) + DIFFERS + 1, 0, 255).astype(np.uint8)
    bright = (image < 255 - DIFFERS).any(axis=2)
    assert not paint.differs(image).any()
    assert np.array_equal(paint.differs(other), still & bright)
    # What shows there now is the room from some time on, and nothing elsewhere.
    part = np.zeros_like(still)
    part[:50] = True
    for _ in range(round(3 * SETTLE / STEP)):
        paint.learn(other, part, STEP)
    unlike = paint.differs(other)
    assert not unlike[:50].any()
    assert np.array_equal(unlike[50:], (still & bright)[50:])
    assert paint.differs(image[::2]) is None, 'of another size'
    paint.restart()
    assert paint.differs(image) is None, 'the camera has moved'


def test_a_third_of_the_tolerance_is_enough_where_colours_say_that_it_is_not_the_room():
    wall = np.full((ROWS, COLS), 3.0, np.float32)
    surfaces = surfaces_in(wall, wall > 0, 0.04, 0.03)
    allowed = float(tolerance(wall)[0, 0])
    unlike = np.zeros(wall.shape, np.bool_)
    unlike[:, :120] = True
    for share, told in ((0.2, 0.0), (0.5, 0.5), (1.2, 1.0)):
        room = Room()
        room.restart(wall, np.zeros_like(unlike))
        now = wall - np.float32(share * allowed)
        part = np.s_[10:30, 100:140]
        assert room.hardly(now, part).shape == (20, 40)
        assert room.hardly(now, part).mean() == (0.35 < share < 1.0)
        room.update(now, STEP, None, surfaces, closer=unlike)
        assert room.before.mean() == pytest.approx(told)
        assert room.still.mean() == pytest.approx(1.0 - told)


@pytest.mark.parametrize(
    ('area', 'missed', 'hard', 'fades'),
    [
        (1.0, False, 0.2, False),
        (0.7, False, 0.0, True),
        (1.0, True, 0.0, True),
        (1.0, False, 0.3, True),
    ],
)
def test_who_shows_less_than_before_fades(area: float, missed: bool, hard: float, fades: bool):
    depth = np.full((ROWS, COLS), 3.0, np.float32)
    seen = silhouette(depth, 50, 20, np.ones((100, 40), np.bool_))
    hardly = np.zeros(depth.shape, np.bool_)
    hardly[20 : 20 + round(100 * hard)] = True
    lately = Lately(seen, seen.area / area, missed)
    assert lately.fades(hardly) == fades
    where = fading([lately], hardly)
    if not fades:
        assert where is None
    else:
        assert np.array_equal(where, seen.in_view(depth.shape))
        assert around([lately]) == np.s_[18:122, 48:92]
        assert grown(where, ABOUT).sum() == 104 * 44


def test_who_is_half_as_high_as_he_stands_is_not_compared_with_that():
    color, depth = images([Someone(0.0, 2.8, RED, BLACK)])
    standing = silhouette(depth, *_cropped(depth == np.float32(2.8)))
    frame, box = on_the_floor(40)
    mask = np.ones((int(box.height), int(box.width)), np.bool_)
    lying = silhouette(frame.depth, int(box.x), int(box.y), mask)
    view = View.of(DepthView(depth, 1, CAMERA), ColorCodes(color), standing, 1.6)
    down = View.of(DepthView(frame.depth, 1, CAMERA), ColorCodes(frame.color), lying, 0.36)
    one = Person(1, np.zeros(2), 0.0)
    one.gallery.learn(view, 0.0)
    assert one.log_odds(down, 0.1) != 0, 'while it is not known how tall he is'
    one.gallery.stature.learn(Height(1.6, 2.0, 0.0))
    assert one.log_odds(view, 0.1) > 2
    assert one.log_odds(down, 0.1) == 0
    assert [one.lies(top, 0.1) for top in (None, 1.2, 0.9, 0.8)] == [False, False, False, True]
    leaning = dataclasses.replace(view, top=None, leans=True)
    assert one.log_odds(leaning, 0.1) == 0, 'his head is out of the image'
    unknown = Person(2, np.zeros(2), 0.0)
    unknown.gallery.learn(leaning, 0.0)
    assert unknown.log_odds(leaning, 0.1) > 2, 'who was never seen but so is known so'
    assert one.log_odds(down, 5.0) == one.gallery.log_odds(down), (
        'what comes later is no part of him'
    )


def _cropped(mask: np.ndarray) -> tuple[int, int, np.ndarray]:
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return int(cols[0]), int(rows[0]), mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]


@pytest.mark.parametrize('rate', [10, 30])
def test_the_colours_of_the_room_are_learned_in_the_same_time_at_any_rate(rate: int):
    """At 30 Hz, where not every frame is learned from, it took three times as long."""
    reader, (color, depth) = SceneReader(COLS, 0.04, 0.03, 0.02), images([])
    painted = color.copy()
    painted[:40] = 255 - painted[:40]
    step, seen = 1 / rate, []
    for i in range(round((1.0 + 4 * SETTLE) * rate)):
        now = color if i < rate else painted
        assert reader.read(Frame(now, depth, round(1e9 * step * i), CAMERA), step) is not None
        unlike = reader._paint.differs(now)
        seen.append(0.0 if unlike is None else float(unlike.mean()))
    assert max(seen[:rate]) == 0.0
    assert seen[rate] > 0.1
    assert seen[-1] < 0.01
