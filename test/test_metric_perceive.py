# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a frame shows: the room, the light, the camera's motion, people and figures."""

from __future__ import annotations

import dataclasses
from typing import Any

import cv2
import numpy as np
import pytest
from people_rig import BLUE, CAMERA, COLS, ROWS, TOP, WALL, Someone, images, picture, texture

from rgbd_kcf_tracker import Box, Frame, Intrinsics
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView, part_in
from rgbd_kcf_tracker.metric.perceive.ego_motion import EgoMotion, Lost, stands, upper_median
from rgbd_kcf_tracker.metric.perceive.figures import find_figures
from rgbd_kcf_tracker.metric.perceive.light import Light
from rgbd_kcf_tracker.metric.perceive.room import REACH, SETTLE, GoingOn, Room
from rgbd_kcf_tracker.metric.perceive.scene import Scene, SceneReader
from rgbd_kcf_tracker.metric.perceive.silhouette import Rim, Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import Sizes, surfaces_in
from rgbd_kcf_tracker.metric.perceive.upright import Shapes, child, flat, rounded, upright
from rgbd_kcf_tracker.pose import Pose

NOBODY = np.zeros((ROWS, COLS), bool)
NONE_EXPECTED = np.zeros((0, 2))
THING = (slice(40, 100), slice(60, 90))


def wall(z: float = WALL) -> np.ndarray:
    return np.full((ROWS, COLS), z, np.float32)


def with_thing(z: float = 2.0) -> np.ndarray:
    depth = wall()
    depth[THING] = z
    return depth


# -- the room -------------------------------------------------------------------------------------


def see(
    room: Room,
    depth: np.ndarray,
    seconds: float,
    somebody: np.ndarray | None,
    undecided: np.ndarray | None = None,
) -> None:
    surfaces = surfaces_in(depth, depth > 0, 0.04, 0.03)
    room.update(depth, seconds, somebody, surfaces, undecided=undecided)


def known_room(depth: np.ndarray) -> Room:
    room = Room()
    room.restart(depth, NOBODY)
    for _ in range(4):
        see(room, depth, 0.1, None)
    return room


def test_what_comes_before_the_room_is_told_from_it():
    room = known_room(wall())
    see(room, with_thing(), 0.1, None)
    assert room.before[THING].all()
    assert room.before.sum() == 60 * 30
    assert (room.depth == WALL).all()


def test_a_farther_place_that_is_revealed_becomes_the_room_when_seen_twice():
    room = known_room(with_thing())
    see(room, wall(), 0.1, None)
    assert room.depth[50, 70] == pytest.approx(2.0), 'one reading may be noise'
    see(room, wall(), 0.1, None)
    assert room.depth[THING] == pytest.approx(WALL)
    see(room, with_thing(), 0.1, None)
    assert room.before[THING].all(), 'and what comes back there is before it'


def test_where_somebody_stood_from_the_first_frame_the_room_goes_on():
    first = wall(3.2)
    first[THING] = 2.0
    room = known_room(first)
    chosen = np.zeros((ROWS, COLS), bool)
    chosen[THING] = True
    room.open(chosen, first)
    see(room, first, 0.1, chosen)
    assert room.before[THING].all(), 'who was chosen stands before the room'
    # A second later he has gone; the wall is no farther than he might have stepped back.
    see(room, wall(3.2), 1.0, None)
    assert not room.before.any()


def test_who_moves_is_not_cut_along_where_his_outline_had_no_reading_at_first():
    """What was read there for the first time, which was he, passed for the room."""
    first, theirs = with_thing(), NOBODY.copy()
    theirs[THING] = True
    edge = cv2.dilate(theirs.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    first[edge & ~theirs] = 0.0
    room = Room()
    room.restart(first, theirs)
    moved = np.roll(with_thing(), 6, axis=1)
    see(room, moved, 0.1, None)
    assert (room.before == (moved < WALL)).all(), 'all of him, and what he has left is room'


@pytest.mark.parametrize(('gap', 'known'), [(0.5, True), (3.0, False)])
def test_of_what_is_close_behind_somebody_it_stays_known_where_it_is(gap: float, known: bool):
    """Nothing else tells a cupboard from him who walks past it half a metre before it."""
    room = known_room(wall())
    here = with_thing(WALL - gap)
    see(room, here, 0.1, None)
    chosen = NOBODY.copy()
    chosen[THING] = True
    room.open(chosen, here)
    see(room, here, 0.1, chosen)
    assert room.before[THING].all()
    assert (room.depth[THING] > 0).all() == known
    assert room.vacant[THING].any() == known, 'what shows there when nobody does'
    see(room, wall(), 0.1, chosen)
    assert not room.before.any()


def test_what_is_put_down_becomes_the_room_after_a_while_unless_it_is_somebody():
    for somebody in (False, True):
        room = known_room(wall())
        claimed = NOBODY.copy()
        claimed[THING] = somebody
        for _ in range(int((SETTLE - 0.5) / 0.1)):
            see(room, with_thing(), 0.1, claimed)
        assert room.before[THING].all(), 'not yet'
        for _ in range(15):
            see(room, with_thing(), 0.1, claimed)
        assert room.before[THING].all() == somebody


def test_the_clock_of_what_is_put_down_is_the_stamp_not_the_frame():
    room = known_room(wall())
    for _ in range(5):
        see(room, with_thing(), 1.0, None)
    assert not room.before.any()


def test_who_comes_where_somebody_stood_before_has_only_come_now():
    """After frames that were more than SETTLE apart he was taken for the room at once."""
    room = known_room(wall())
    for _ in range(3):
        see(room, with_thing(), 0.1, None)
    for _ in range(3):
        see(room, wall(), 0.1, None)
    see(room, with_thing(), SETTLE + 0.5, None)
    assert room.before[THING].all()


def test_pixels_that_somebody_left_become_room():
    claimed = NOBODY.copy()
    claimed[THING] = True
    room = Room()
    room.restart(with_thing(), claimed)
    assert room.before[THING].all()
    see(room, with_thing(), 0.1, claimed)
    assert room.before[THING].all(), 'he is not the room while he stands there'
    see(room, wall(), 0.1, claimed)
    assert not room.before.any()
    see(room, wall(), 0.1, None)
    assert room.depth[THING] == pytest.approx(WALL)


@pytest.mark.parametrize('blank', [2, 8])
def test_a_place_that_has_no_reading_any_more_was_somebody(blank: int):
    # He stood in a doorway, beyond which depth sees nothing, before anybody was looked for.
    room = known_room(with_thing(4.0))
    hole = wall()
    hole[THING] = 0.0
    for _ in range(blank):  # where there never was a reading, a few are missing for a moment
        see(room, hole, 0.1, None)
    see(room, with_thing(4.0), 0.1, None)
    assert room.before[THING].all() == (blank > 2)


@pytest.mark.parametrize('share', [0.2, 0.6, 1.0])
def test_a_wall_that_was_not_seen_for_a_while_is_still_the_room(share: float):
    # Somebody who is too near for a reading, or a camera that sends empty images for a moment.
    room = known_room(wall())
    blank = wall()
    blank[:, : round(share * COLS)] = 0.0
    for _ in range(10):
        see(room, blank, 0.1, None)
    see(room, wall(), 0.1, None)
    assert not room.before.any()


def test_a_camera_that_begins_with_empty_images_shows_a_room_and_nobody():
    room = known_room(np.zeros((ROWS, COLS), np.float32))
    for _ in range(3):
        see(room, wall(), 0.1, None)
    assert not room.before.any()
    assert (room.depth == WALL).all()


def test_who_comes_farther_off_where_another_has_gone_out_of_sight_is_before_the_room():
    hole = wall()
    hole[THING] = 0.0
    room = known_room(hole)
    for seen in [hole] * 10 + [with_thing(1.5)] * 3 + [hole] * 10 + [with_thing(4.0)] * 3:
        see(room, seen, 0.1, None)
    assert room.before[THING].all()


@pytest.mark.parametrize('where', ['goes on as the room', 'goes on before it', 'stands alone'])
def test_what_shows_behind_who_has_gone_is_the_room_where_it_goes_on_as_the_room(where: str):
    """A second later: who was hidden may have come nearer, or have been behind him all along."""
    hidden = NOBODY.copy()
    hidden[:, 70:140] = True
    behind = wall()
    behind[40:100, 75 if where == 'stands alone' else 60 : 120] = 2.5
    first = np.where(hidden, np.float32(1.2), behind if where == 'goes on as the room' else wall())
    room = Room()
    room.restart(first, hidden)
    see(room, behind, 1.0, None)
    assert room.before[45:95, 80:115].any() == (where != 'goes on as the room')
    assert not room.before[:35].any(), 'the wall behind is farther than he can have stepped back'


def test_who_stood_there_before_another_passed_is_not_the_room_though_some_of_him_is():
    """Readings that he lacked at first passed for the room; with one step he has left others."""
    first = with_thing(3.0)
    somebody = first == 3.0
    somebody[40:100, 72:75] = False
    room = Room()
    room.restart(first, somebody)
    stepped, passer = wall(), wall()
    stepped[40:100, 52:82] = 3.0
    passer[35:120, 50:100] = 2.4
    for seen in (stepped, passer, stepped, stepped):
        see(room, seen, 1.0, None)
    assert room.before[40:100, 52:72].all()


def test_who_stands_shows_whole_again_when_another_has_passed_close_before_him():
    """Who passed less than a step before him took his place, and he was what is behind."""
    room = Room()
    room.restart(with_thing(2.5), with_thing(2.5) == 2.5)
    passes = [2.5] * 4 + [2.1, 1.95, 1.95, 1.95]
    for z in (*passes, 2.5, 2.5):
        see(room, with_thing(z), 0.1, None)
    assert room.before[THING].all()
    for z in (*passes, 2.8, 2.8):  # he has gone meanwhile, and a chair stands behind
        see(room, with_thing(z), 0.1, None)
    assert not room.before[THING].any()


def test_who_steps_back_to_a_far_wall_does_not_become_the_wall():
    first = wall(4.45)
    first[THING] = 4.0
    room = Room()
    room.restart(first, first == 4.0)
    for z in (4.3, 4.35):
        stepped = wall(4.45)
        stepped[THING] = z
        see(room, stepped, 0.2, None)
        assert room.before[THING].all()


def test_pixels_that_turn_out_to_be_somebody_are_taken_out_of_the_room():
    room = known_room(with_thing())
    claimed = NOBODY.copy()
    claimed[THING] = True
    room.open(claimed, with_thing())
    see(room, with_thing(), 0.1, None)
    assert room.before[THING].all()
    assert room.before.sum() == 60 * 30


def test_the_room_is_seen_from_where_the_camera_has_moved_to():
    room = known_room(with_thing())
    # The camera goes 0.1 m to the right: all moves to the left, at 2 m by 10 pixels, at 5 m by 4.
    unknown = room.moved(Pose(np.eye(3), np.array([-0.1, 0.0, 0.0])), CAMERA)
    depth = wall()
    depth[40:100, 50:80] = 2.0
    inner = np.s_[:, 5 : COLS - 10]
    agreeing = (np.abs(room.depth - depth) < 0.05) | unknown
    assert agreeing[inner].mean() > 0.99
    assert unknown[:, -3:].all(), 'what comes into view is not known'
    see(room, depth, 0.1, None)
    assert room.before.mean() < 0.01


def goes_on(room: Room, depth: np.ndarray, large: bool = False) -> GoingOn:
    surfaces = surfaces_in(depth, depth > 0, 0.04, 0.03)
    return room.going_on(depth, surfaces, np.full(len(surfaces), large), CAMERA, 0.1)


AHEAD = Pose(np.eye(3), np.array([0.0, 0.0, -0.05]))


def test_a_reading_unlike_all_about_it_is_not_learned_before_a_camera_that_moves():
    """What is nearest is seen of the room: a speck of noise hid what was behind it for good."""
    room = known_room(wall())
    room.depth[:, 200:] = 0
    room.moved(AHEAD, CAMERA)
    noisy = wall(WALL - 0.05)
    noisy[80, 220] = 0.9
    see(room, noisy, 0.1, None, NOBODY)
    assert room.depth[80, 220] == 0
    assert (room.depth[60:100, 202:218] == noisy[60:100, 202:218]).all()


def test_what_turns_out_to_be_farther_is_learned_before_a_camera_that_moves():
    """It was asked of each frame alone, and what was hidden never became the room."""
    room = known_room(with_thing())
    for i in range(1, 5):
        room.moved(AHEAD, CAMERA)
        see(room, wall(WALL - 0.05 * i), 0.1, None)
    assert room.depth[60:80, 70:80] == pytest.approx(WALL - 0.2, abs=0.05)
    assert not room.before.any()


def test_who_passed_for_the_room_is_told_by_his_shape_unless_he_stands_before_it():
    room = known_room(with_thing())
    people = NOBODY.copy()
    people[THING] = True
    surfaces = surfaces_in(with_thing(), with_thing() > 0, 0.04, 0.03)
    assert (room.passing(people, with_thing(), surfaces) == people).all()
    assert not known_room(wall()).passing(people, with_thing(), surfaces).any()


def test_what_goes_on_from_somebody_as_one_surface_is_somebody():
    """Before a camera that moves, half of whom somebody else hid was taken for the room."""
    room = known_room(wall())
    half = with_thing()
    half[:, 80:] = WALL
    see(room, half, 0.1, None)
    room.depth[:, 80:] = 0  # somebody nearer has hidden all that is there
    depth = with_thing()
    going_on = goes_on(room, depth).somebody
    assert (going_on == (depth < WALL)).all(), 'and the wall behind goes on as the wall'
    room.depth[:, 65:] = 0
    few = goes_on(room, depth).somebody
    assert not few.any(), 'a few pixels tell nothing of the rest'


def test_who_touches_a_desk_before_a_camera_that_moves_is_not_the_desk():
    """A man's hand joined a desk that came into view: the chair behind it was a person for good."""
    room = known_room(wall())
    person, desk = NOBODY.copy(), NOBODY.copy()
    person[20:150, 10:50] = True
    desk[90:110, 50:156] = True
    depth = np.where(person | desk, np.float32(2.0), wall()).astype(np.float32)
    room.depth[:, 60:] = 0  # this has come into view
    alone = goes_on(room, depth)
    assert (alone.somebody == (person | desk)).all()
    assert not alone.beyond.any()
    touched = goes_on(room, depth, large=True)
    assert not (touched.somebody & touched.beyond).any()
    assert (touched.somebody | touched.beyond)[person | desk].all()
    columns = np.flatnonzero(touched.somebody.any(axis=0))
    assert columns[0] == 10
    reached = (columns[-1] - 30) * 2.0 / CAMERA.fx
    assert REACH - 0.1 < reached < REACH + 0.1


def test_who_walks_into_the_view_of_a_camera_that_turns_is_somebody():
    """He stood for the room: less than a quarter of him was within the last view."""
    room = known_room(wall())
    depth = wall()
    depth[20:150, 100:] = 2.0
    room.depth[:, 110:] = 0
    assert (goes_on(room, depth).somebody == (depth < WALL)).all()


def test_what_shows_far_behind_somebody_who_has_gone_is_not_he():
    """A cupboard was a person for good, as it was first seen where one had stood."""
    somebody = NOBODY.copy()
    somebody[THING] = True
    room = Room()
    room.restart(with_thing(1.5), somebody)
    stepped, cupboard = with_thing(1.6), with_thing(4.0)
    assert (goes_on(room, stepped).somebody == somebody).all()
    assert not goes_on(room, cupboard).somebody.any()


@pytest.mark.parametrize('large', [True, False])
def test_a_strip_of_a_wall_that_passed_for_somebody_is_taken_into_the_room(large: bool):
    """A camera that turned saw a strip of a wall first, and it was somebody for good."""
    strip, person = NOBODY.copy(), NOBODY.copy()
    strip[20:150, 100:130] = True
    person[40:150, 30:60] = True
    depth = np.where(person, np.float32(3.0), wall()).astype(np.float32)
    room = Room()
    room.restart(depth, strip | person)
    see(room, depth, 0.2, None)
    surfaces = surfaces_in(depth, depth > 0, 0.04, 0.03)
    assert not room.goes_on(person, depth, surfaces, np.ones(len(surfaces), bool))
    assert room.goes_on(strip, depth, surfaces, np.full(len(surfaces), large)) == large
    assert room.before[strip].any() != large
    see(room, depth, 0.2, None)
    assert room.before[strip].any() != large
    assert room.before[person].all()


def test_a_room_elsewhere_does_not_agree():
    room = known_room(with_thing())
    assert room.agrees(with_thing())
    assert not room.agrees(wall(3.0))
    assert not room.agrees(np.full((10, 10), 2.0, np.float32))


# -- the light ------------------------------------------------------------------------------------


@pytest.mark.parametrize('gain', [(1.4, 1.4, 1.4), (0.6, 0.6, 0.6), (1.3, 1.0, 0.8)])
def test_exposure_and_white_balance_are_undone(gain: tuple[float, float, float]):
    image = texture(1)
    light = Light()
    still = ~NOBODY
    assert light.steadied(image, still) is image
    changed = np.clip(image * np.array(gain), 0, 255).astype(np.uint8)
    back = light.steadied(changed, still)
    assert light.gain == pytest.approx(1 / np.array(gain), rel=0.03)
    unsaturated = changed.max(axis=2) < 250
    assert np.abs(back.astype(int) - image)[unsaturated].mean() < 3
    assert np.abs(changed.astype(int) - image)[unsaturated].mean() > 10


def test_the_light_is_told_from_what_stands_still_alone():
    image = texture(1)
    light = Light()
    light.steadied(image, ~NOBODY)
    changed = image.copy()
    changed[:, 40:] = BLUE
    still = ~NOBODY
    still[:, 40:] = False
    assert light.steadied(changed, still) is changed
    assert light.gain == pytest.approx(np.ones(3), abs=0.02)


@pytest.mark.parametrize(('gain', 'told'), [(0.8, True), (0.99, False)])
def test_a_sudden_change_of_light_is_told_between_two_measures(gain: float, told: bool):
    light, image = Light(), texture(3)
    light.steadied(image, ~NOBODY)
    changed = np.clip(image * gain, 0, 255).astype(np.uint8)
    light.steadied(changed, ~NOBODY, learns=False)
    assert (light.gain == 1).all() != told
    light.steadied(changed, ~NOBODY)
    assert light.gain == pytest.approx(np.full(3, 1 / gain), abs=0.02)


def test_the_light_is_kept_when_the_camera_looks_elsewhere():
    light = Light()
    light.steadied(texture(1), ~NOBODY)
    light.steadied((texture(1) * 0.6).astype(np.uint8), ~NOBODY)
    light.restart()
    other = (texture(2) * 0.6).astype(np.uint8)
    back = light.steadied(other, ~NOBODY)
    assert np.abs(back.astype(int) - texture(2)).mean() < 4


# -- the camera's own motion ----------------------------------------------------------------------


def seen_by(motion: Pose, slope: float = 0.004) -> tuple[np.ndarray, DepthView]:
    """A textured slanted wall as seen by a camera, ``motion`` the first camera's pose in its frame.

    In the first camera's frame the wall is the plane ``z = 3 + a x``.
    """
    a = slope * CAMERA.fx
    v, u = np.mgrid[0:ROWS, 0:COLS].astype(np.float64)
    rays = np.stack(((u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones_like(u)), -1)
    back = motion.inverse
    turned = rays @ back.rotation.T
    # z0 + s rz = 3 + a (x0 + s rx)
    origin = back.translation
    s = (3 + a * origin[0] - origin[2]) / (turned[..., 2] - a * turned[..., 0])
    points = origin + turned * s[..., None]
    wide = texture(3, (400, 600))
    columns = (points[..., 0] * 60 + 300).astype(np.float32)
    rows = (points[..., 1] * 60 + 200).astype(np.float32)
    image = cv2.remap(wide, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return image, DepthView(s.astype(np.float32), 1, CAMERA)


def turned(x: float, y: float, z: float, *shift: float) -> Pose:
    rotation, _ = cv2.Rodrigues(np.radians([x, y, z]))
    return Pose(rotation, np.array(shift))


STILL = Pose(np.eye(3), np.zeros(3))


@pytest.mark.parametrize(
    'motion',
    [
        turned(0, 4, 0, 0, 0, 0),
        turned(1.5, 0, 1, 0, 0, 0),
        turned(0, 0, 0, 0.12, 0.0, 0.0),
        turned(0.5, -2, 0, 0.03, -0.02, -0.1),
        turned(0, 6, 2, 0, 0, 0),
        turned(0, -7.5, 2, 0, 0, 0),
    ],
)
def test_the_cameras_motion_is_recovered(motion: Pose):
    ego = EgoMotion()
    assert ego.update(*seen_by(STILL), NOBODY, 0.1) is None
    found = ego.update(*seen_by(motion), NOBODY, 0.1)
    assert isinstance(found, Pose)
    between = motion.after(found.inverse)
    angle = np.degrees(np.linalg.norm(cv2.Rodrigues(between.rotation)[0]))
    assert angle < 0.3
    assert np.linalg.norm(found.of(np.array([0, 0, 3.0])) - motion.of(np.array([0, 0, 3.0]))) < 0.03


@pytest.mark.parametrize(('seconds', 'metres'), [(0.1, 0.012), (0.033, 0.006)])
def test_a_camera_that_creeps_is_told_of_all_the_time_since_it_stood(seconds: float, metres: float):
    """A robot drove through a hall as if it stood: its far wall became a row of people."""
    ego, been, told = EgoMotion(), STILL, []
    step = turned(0, 0, 0, 0.0, 0.0, -metres)
    camera = STILL
    for _ in range(25 if seconds > 0.05 else 50):
        found = ego.update(*seen_by(camera), NOBODY, seconds)
        ego.settle()
        camera = step.after(camera)
        assert not isinstance(found, Lost)
        told.append(found is not None)
        been = been if found is None else found.after(been)
    assert 3 < sum(told) < 20, 'by a part of a pixel a frame nothing can be told'
    assert been.translation == pytest.approx([0.0, 0.0, -metres * (len(told) - 1)], abs=0.03)


def test_who_walks_before_a_camera_that_stands_does_not_make_it_creep():
    ego = EgoMotion()
    image, view = seen_by(STILL)
    for i in range(20):
        walks = image.copy()
        walks[30:140, 5 * i : 5 * i + 40] = texture(4)[30:140, 10:50]
        assert ego.update(walks, view, NOBODY, 0.1) is None
        ego.settle()


@pytest.mark.parametrize('seed', range(5))
def test_the_median_of_bytes_is_counted(seed: int):
    rng = np.random.default_rng(seed)
    values = rng.integers(0, rng.integers(2, 256), (7, 9), dtype=np.uint8)
    assert upper_median(values) == int(np.median(values))


def test_a_camera_that_stands_still_has_not_moved_whoever_walks():
    ego = EgoMotion()
    image, view = seen_by(STILL)
    ego.update(image, view, NOBODY, 0.1)
    noisy = np.clip(image + np.random.default_rng(0).normal(0, 3, image.shape), 0, 255)
    assert ego.update(noisy.astype(np.uint8), view, NOBODY, 0.1) is None
    walked = image.copy()
    walked[20:150, 60:130] = BLUE
    assert ego.update(walked, view, NOBODY, 0.1) is None


def test_a_change_of_light_is_no_motion():
    ego = EgoMotion()
    image, view = seen_by(STILL)
    ego.update(image, view, NOBODY, 0.1)
    assert (
        ego.update(np.clip(image.astype(int) + 30, 0, 255).astype(np.uint8), view, NOBODY, 0.1)
        is None
    )


def test_a_camera_of_which_no_corner_is_found_again_does_not_stand_still():
    """All corners were lost from one frame to the next, and following none of them was an error."""
    image, none = texture(0)[..., 0], np.zeros((0, 2), np.float32)
    assert not stands(image, 255 - image, none, none)


@pytest.mark.parametrize('seed', range(8))
def test_who_steps_before_a_camera_and_changes_its_exposure_does_not_move_it(seed: int):
    rng = np.random.default_rng(seed)
    ego = EgoMotion()
    image, view = seen_by(STILL)
    ego.update(image, view, NOBODY, 0.1)
    covered = image.copy()
    left = rng.integers(0, COLS // 2)
    covered[:, left : left + COLS // 3] = texture(20 + seed)[:, : COLS // 3]
    covered = np.clip(covered * 1.15 + rng.normal(0, 4, covered.shape), 0, 255).astype(np.uint8)
    assert not isinstance(ego.update(covered, view, NOBODY, 0.1), Pose)


@pytest.mark.parametrize('seed', range(6))
def test_a_shirt_with_more_corners_than_the_wall_is_not_the_camera(seed: int):
    """Most corners were on somebody whom nothing told from the wall, and the room went with him."""
    ego, wall = EgoMotion(), 128 + 0.4 * (texture(3).astype(float) - 128)
    _, view = seen_by(STILL)
    for frame in range(8):
        image, left = wall.astype(np.uint8), 30 + 3 * frame
        image[25:-25, left : left + 40] = texture(40 + seed)[50:, :40]
        assert ego.update(image, view, NOBODY, 0.1) is None
        ego.settle()


def test_the_outlines_of_those_who_walk_are_no_corners_of_the_room():
    ego, wall = EgoMotion(), 128 + 0.15 * (texture(3).astype(float) - 128)
    _, view = seen_by(STILL)
    others = NOBODY
    stripes = np.where(np.arange(ROWS - 40) // 6 % 2, 70, 30)[:, None, None]
    for frame in range(8):
        image, now = wall.astype(np.uint8), NOBODY.copy()
        for left in (30 + 4 * frame, 100 - 3 * frame, 150 + 5 * frame):
            image[20:-20, left : left + 25], now[20:-20, left : left + 25] = stripes, True
        assert ego.update(image, view, others, 0.1) is None
        ego.settle()
        others = now


def test_a_cut_to_something_else_is_said_to_be_lost():
    ego = EgoMotion()
    image, view = seen_by(STILL)
    ego.update(image, view, NOBODY, 0.1)
    assert isinstance(ego.update(texture(9), view, NOBODY, 0.1), Lost)
    ego = EgoMotion()
    ego.update(np.full_like(image, 40), view, NOBODY, 0.1)
    assert isinstance(ego.update(image, view, NOBODY, 0.1), Lost), 'nothing to follow'


def test_poses_that_are_given_are_taken_before_what_seems():
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    reader.read(picture([], 0.0, pose=STILL), 0.0)
    # In the fixed frame the camera went 0.2 m ahead: what it saw comes 0.2 m nearer.
    ahead = Pose(np.eye(3), np.array([0.0, 0.0, 0.2]))
    scene = reader.read(picture([], 0.1, pose=ahead), 0.1)
    assert scene is not None
    assert isinstance(scene.motion, Pose)
    assert scene.motion.of(np.array([0, 0, 3.0])) == pytest.approx([0, 0, 2.8])


def test_a_camera_whose_poses_stand_still_stands_still_and_creeping_adds_up():
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    reader.read(picture([], 0.0, pose=STILL), 0.0)
    motions = []
    for i in range(1, 9):
        creeping = Pose(np.eye(3), np.array([0.0, 0.0, 0.001 * i]))
        scene = reader.read(picture([], 0.1 * i, pose=creeping), 0.1)
        assert scene is not None
        motions.append(scene.motion)
    moved = [motion for motion in motions if motion is not None]
    assert motions[:2] == [None, None]
    assert all(isinstance(motion, Pose) for motion in moved)
    assert len(moved) == 2
    assert sum(float(motion.translation[2]) for motion in moved) == pytest.approx(-0.006)


# -- how often what lasts is learned --------------------------------------------------------------


@pytest.mark.parametrize(
    ('rate', 'room', 'looks'),
    [
        (60, [6, 12], [7, 13]),
        (30, [3, 6, 9], [4, 7, 10]),
        (20, [1, 2, 3, 4], [1, 2, 3, 4]),
        (15, [1, 2, 3, 4], [1, 2, 3, 4]),
        (10, [1, 2, 3, 4], [1, 2, 3, 4]),
        (5, [1, 2], [1, 2]),
    ],
)
def test_what_lasts_is_learned_ten_times_a_second_where_frames_come_fast(
    rate: int, room: list[int], looks: list[int], monkeypatch: pytest.MonkeyPatch
):
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    learned, since = [], {}
    update = reader.room.update

    def noticed(*given: Any) -> None:
        learned.append(given[4])
        update(*given)

    monkeypatch.setattr(reader.room, 'update', noticed)
    for i in range(max(looks) + 1):
        scene = reader.read(picture([], i / rate), 1 / rate if i else 0.0)
        assert scene is not None
        if scene.since is not None:
            since[i] = scene.since
    assert [i for i, learns in enumerate(learned, 1) if learns] == room
    assert since.pop(0) > 0, 'the first frame teaches'
    assert list(since) == looks
    assert list(since.values()) == pytest.approx(np.diff([0, *looks]) / rate)


def test_frames_without_depth_are_a_pause_to_what_depth_shows(monkeypatch: pytest.MonkeyPatch):
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    passed: list[float] = []
    update = reader.room.update

    def noticed(*given: Any) -> None:
        passed.append(given[1])
        update(*given)

    monkeypatch.setattr(reader.room, 'update', noticed)
    for i in range(10):
        frame = picture([], i / 30)
        if i % 3:
            frame = dataclasses.replace(frame, depth=None)
        assert (reader.read(frame, 1 / 30 if i else 0.0) is None) == bool(i % 3)
    assert passed == pytest.approx([0.1, 0.1, 0.1])


@pytest.mark.parametrize(
    ('box', 'rows', 'cols'),
    [
        (Box(10, 20, 10, 5), (20, 25), (10, 20)),
        (Box(10.5, 20.2, 9, 5), (20, 26), (10, 20)),
        (Box(10.2, 20.9, 0.5, 0.05), (20, 21), (10, 11)),
        (Box(-5, -5, 1000, 1000), (0, 40), (0, 60)),
        (Box(-10, 0, 10, 10), (0, 10), (0, 0)),
        (Box(60, 40, 10, 10), (40, 40), (60, 60)),
    ],
)
def test_a_box_has_the_pixels_that_it_touches(
    box: Box, rows: tuple[int, int], cols: tuple[int, int]
):
    assert part_in((40, 60, 3), box) == (slice(*rows), slice(*cols))


def test_places_of_a_view_are_counted_from_its_edges_and_metres_from_the_middles_of_pixels():
    view = DepthView(np.ones((40, 60), np.float32), 1, Intrinsics(100, 100, 29.5, 19.5))
    assert view.metres(30, 20, 2.0) == (0.0, 0.0, 2.0), 'the middle of all of it'
    left, top, depth = view.metres(10, 5, 2.0)
    assert view.place(left, top, depth) == pytest.approx((10, 5))
    whole = Silhouette.of(view, 0, 0, np.ones((40, 60), bool), 0, Rim())
    assert whole.metres == pytest.approx((-0.3, -0.2, 0.3, 0.2))


def test_a_camera_that_moves_learns_from_every_frame():
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    since = []
    for i in range(6):
        pose = Pose(np.eye(3), np.array([0.0, 0.0, 0.05 * i]))
        scene = reader.read(picture([], i / 30, pose=pose), 1 / 30 if i else 0.0)
        assert scene is not None
        since.append(scene.since)
    assert None not in since[2:], 'that it moves is known from the second frame on'


def test_a_room_that_is_only_compared_is_as_it_was():
    room = known_room(wall())
    depth = with_thing()
    see(room, depth, 0.1, None)
    depth[:20] = WALL + 0.05
    for _ in range(40):
        room.update(depth, 0.1, None, surfaces_in(depth, depth > 0, 0.04, 0.03), learns=False)
        assert room.before[THING].all()
        assert room.before.sum() == 60 * 30
    assert (room.depth == WALL).all()
    # The time counts: the thing has stood there all the while.
    see(room, depth, 0.1, None)
    assert not room.before.any()
    assert room.depth[:20].max() > WALL


# -- people who have not moved yet ----------------------------------------------------------------


def silhouette(depth: np.ndarray) -> Silhouette:
    mask = depth < WALL
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    crop = mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
    view = DepthView(depth, 1, CAMERA)
    return Silhouette.of(view, int(cols[0]), int(rows[0]), crop, 1, Rim())


def test_head_and_shoulders_are_a_person_and_a_box_is_not():
    _, depth = images([Someone(0.0, 3.0)])
    assert upright(silhouette(depth), CAMERA, 1.6)
    assert upright(silhouette(depth), CAMERA, None)
    assert upright(silhouette(depth), CAMERA, 1.1), 'as of somebody who sits and stoops'
    assert not upright(silhouette(depth), CAMERA, 0.92), 'the back of a chair above its seat'
    assert not upright(silhouette(depth), CAMERA, 0.5), 'no person ends at half a metre'
    box = wall()
    seen = Someone(0.0, 3.0).box
    box[int(seen.y) : int(seen.bottom), int(seen.x) : int(seen.right)] = 3.0
    assert not upright(silhouette(box), CAMERA, 1.6)


@pytest.mark.parametrize(
    ('rows', 'person'),
    [
        (((0.2, 0.19), (0.28, 0.1), (0.9, 0.25), (1.6, 0.18)), True),  # from the side
        (((0.2, 0.19), (0.28, 0.1), (0.5, 0.22), (0.6, 0.7), (1.6, 0.18)), True),  # an arm ahead
        (((0.06, 0.19), (0.09, 0.28), (0.2, 0.19), (0.28, 0.1), (1.6, 0.18)), True),  # a brim
        (((1.6, 0.2),), False),  # a post
        (((0.3, 0.3), (1.6, 0.05)), False),  # a lamp
        (((0.2, 0.2), (0.28, 0.18), (1.6, 0.22)), False),  # a post with a groove
        (((0.2, 0.2), (0.28, 0.1), (1.0, 0.26)), False),  # a chair with a head rest
    ],
)
def test_whoever_is_tall_and_has_a_neck_is_a_person(
    rows: tuple[tuple[float, float], ...], person: bool
):
    depth, top = wall(), 0.0
    for bottom, wide in rows:
        v0, v1 = (round((TOP + y) * CAMERA.fy / 2.5 + CAMERA.cy) for y in (top, bottom))
        # An arm is ahead on one side.
        u0 = round(-0.13 * CAMERA.fx / 2.5 + CAMERA.cx)
        depth[max(v0, 0) : v1, u0 : u0 + round(wide * CAMERA.fx / 2.5)] = 2.5
        top = bottom
    assert upright(silhouette(depth), CAMERA, None) == person


@pytest.mark.parametrize(
    ('bulge', 'turned', 'round_'),
    [(0.0, 0.0, False), (0.0, 0.3, False), (0.12, 0.0, True), (0.12, 0.1, True)],
)
def test_a_body_is_told_from_a_plane(bulge: float, turned: float, round_: bool):
    """Half a cylinder as thick as a trunk, and a board, square to the camera or turned."""
    u = np.linspace(-1, 1, 40, dtype=np.float32)
    depth = np.zeros((120, 160), np.float32)
    rng = np.random.default_rng(1)
    trunk = 3.0 - bulge * np.sqrt(1 - 0.95 * u**2) + turned * u
    depth[20:100, 60:100] = trunk + rng.normal(0, 0.012, (80, 40))
    view = DepthView(depth, 1, Intrinsics.guess(160, 120))
    seen = Silhouette.of(view, 60, 20, np.ones((80, 40), np.bool_), 0, Rim())
    assert rounded(view, seen) is round_
    half, few = np.ones((80, 40), np.bool_), np.ones((30, 40), np.bool_)
    half[::2, 1:-1] = False
    part = Silhouette.of(view, 60, 20, half, 0, Rim(left=60))
    for walks in (False, True):
        assert flat(view, None, seen, walks) is not round_
        assert flat(view, None, Silhouette.of(view, 60, 20, half, 0, Rim()), walks) is not round_
        assert flat(view, None, Silhouette.of(view, 60, 20, few, 0, Rim()), walks) is None
    assert flat(view, None, part, walks=False) is not round_
    assert flat(view, None, part, walks=True) is (False if round_ else None), 'as a body fills it'


@pytest.mark.parametrize(
    ('height', 'top', 'is_child'),
    [(1.0, 1.0, True), (1.0, 1.2, True), (0.7, 0.75, False), (1.0, 1.35, False), (1.4, 1.4, False)],
)
def test_a_child_shows_whole_and_stands_on_the_floor(height: float, top: float, is_child: bool):
    rows = round(height * CAMERA.fy / 2.0)
    depth = wall()
    depth[10 : 10 + rows, 100:115] = 2.0
    seen = silhouette(depth)
    assert child(seen, top) is is_child
    assert not child(seen, None)
    depth[10 + rows - 4 :] = 1.0
    assert not child(silhouette(depth), top), 'something nearer hides its feet'


@pytest.mark.parametrize(('high', 'people'), [(0, True), (55, False)])
def test_two_people_who_touch_in_the_first_frame_are_not_the_room_and_two_chairs_are(
    high: int, people: bool
):
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    pair = [Someone(-0.205, 3.0), Someone(0.205, 3.0)]
    color, depth = images(pair)
    if high:  # nothing but heads and shoulders, on the floor
        depth[int(pair[0].box.y) + high :] = WALL
    scene = reader.read(Frame(color, depth, 0, CAMERA), 0.0)
    assert scene is not None
    for one in pair:
        assert scene.before[int(one.box.y) + 25, int(one.box.cx)] == people


def test_a_person_who_stands_in_the_first_frame_is_not_the_room():
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    one = Someone(0.0, 3.0)
    scene = reader.read(picture([one], 0.0), 0.0)
    assert scene is not None
    middle = int(one.box.cy), int(one.box.cx)
    assert scene.before[middle]
    depth = wall()
    depth[40:100, 20:80] = 3.0
    thing = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(texture(0), depth, 0, CAMERA), 0.0)
    assert thing is not None
    assert not thing.before.any()


def test_what_a_turning_camera_sees_of_a_part_is_nobody_until_both_its_sides_show():
    """A strip of a window had a person's shape, and was somebody from then on."""
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    shown = []
    for i in range(26):
        at = 0.1 * i
        one = Someone(2.4 - at, 2.5)
        color, depth = images([one])
        depth[depth == WALL] = np.nan  # nothing that he could stand before
        pose = Pose(np.eye(3), np.array([at, 0.0, 0.0]))
        scene = reader.read(Frame(color, depth, round(1e8 * i), CAMERA, pose), 0.1)
        assert scene is not None
        left, right = max(int(one.box.x) + 2, 0), min(int(one.box.right) - 2, COLS)
        if right - left > 4:
            part = np.s_[int(one.box.y) + 4 : 140, left:right]
            shown.append((one.box.right < COLS - 2, scene.before[part].mean() > 0.5))
            assert (reader.room.depth[part] > 0).mean() < 0.2, 'nor is he room'
    assert {whole for whole, _ in shown} == {False, True}
    assert all(told == whole for whole, told in shown), shown


# -- figures --------------------------------------------------------------------------------------


def scene_of(people: list[Someone], change=lambda depth: depth) -> Scene:
    """The scene of people who came into a room that is known."""
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    for i in range(4):
        reader.read(picture([], 0.1 * i), 0.1)
    color, depth = images(people)
    scene = reader.read(Frame(color, change(depth), 400_000_000, CAMERA), 0.1)
    assert scene is not None
    return scene


def outline(seen: Silhouette) -> Box:
    return Box(seen.left, seen.top, seen.mask.shape[1], seen.mask.shape[0])


def test_pieces_above_each_other_are_one_figure():
    one = Someone(0.3, 3.0)

    def seam(depth: np.ndarray) -> np.ndarray:
        row = int(one.box.cy)
        depth[row : row + 4] = np.nan
        return depth

    figures = find_figures(scene_of([one], seam), NONE_EXPECTED)
    assert len(figures) == 1
    assert outline(figures[0].seen).iou(one.box) > 0.9
    assert not figures[0].parted
    assert figures[0].place == pytest.approx([0.3, 3.0], abs=0.03)


@pytest.mark.parametrize(
    ('ahead', 'floor', 'his'),
    [(0.42, 0.85, True), (0.7, 0.85, False), (0.42, 1.3, False), (0.42, None, False)],
)
def test_the_legs_of_who_sits_are_nearer_by_a_thigh(ahead: float, floor: float | None, his: bool):
    """Of one who sat down, facing the camera, the box ended at the chair's seat.

    Who comes in before somebody, at the picture's lower end, is nobody's legs: he is higher up.
    """
    one = Someone(0.3, 3.0)
    hips, knees = (round((TOP + y) * CAMERA.fy / one.z + CAMERA.cy) for y in (0.85, 1.1))

    def seated(depth: np.ndarray) -> np.ndarray:
        legs = depth[hips:] == one.z
        depth[hips:knees][legs[: knees - hips]] = WALL
        depth[knees:][legs[knees - hips :]] = one.z - ahead
        return depth

    scene = scene_of([one], seated)
    if floor is not None:  # metres below the camera
        down = (np.arange(ROWS, dtype=np.float32)[:, None] - CAMERA.cy) / CAMERA.fy
        scene = dataclasses.replace(scene, elevation=np.float32(floor) - down * scene.view.depth)
    figures = find_figures(scene, NONE_EXPECTED)
    ends = [figure.seen.top + figure.seen.mask.shape[0] for figure in figures]
    assert (len(figures) == 1 and ends[0] == pytest.approx(one.box.bottom, abs=2)) == his


def test_pieces_at_other_depths_or_beside_are_other_figures():
    people = [Someone(-0.8, 3.0), Someone(0.4, 3.0), Someone(0.6, 2.0)]
    figures = find_figures(scene_of(people), NONE_EXPECTED)
    assert len(figures) == 3
    assert not any(figure.parted for figure in figures)


@pytest.mark.parametrize('expected', [NONE_EXPECTED, np.array([[-0.25, 3.0], [0.25, 3.0]])])
@pytest.mark.parametrize('half', [0.225, 0.205])
def test_two_people_who_touch_are_parted(expected: np.ndarray, half: float):
    # Their trunks, 0.46 m wide, overlap by a pixel or two; their heads do not.
    people = [Someone(-half, 3.0), Someone(half, 3.0)]
    figures = find_figures(scene_of(people), expected)
    assert len(figures) == 2
    assert all(figure.parted for figure in figures)
    found = sorted(figures, key=lambda figure: figure.place[0])
    for figure, one in zip(found, people, strict=True):
        assert outline(figure.seen).iou(one.box) > 0.85


def test_of_three_who_touch_the_two_who_cannot_be_told_apart_are_one_beside_the_third():
    """All three were one figure for as long as the two were expected at one place."""
    people = [Someone(-0.225, 3.0), Someone(0.225, 3.0)]
    expected = np.array([[-0.25, 3.0], [0.2, 3.0], [0.3, 3.05]])
    figures = find_figures(scene_of(people), expected)
    assert len(figures) == 2
    found = sorted(figures, key=lambda figure: figure.place[0])
    for figure, one in zip(found, people, strict=True):
        assert outline(figure.seen).iou(one.box) > 0.85


def test_who_stands_half_behind_another_is_not_joined_with_him():
    """Within an arm's reach in depth, and too close for two heads side by side."""
    people = [Someone(-0.13, 3.0), Someone(0.13, 3.28)]
    figures = find_figures(scene_of(people), NONE_EXPECTED)
    assert len(figures) == 2
    left, right = sorted(figures, key=lambda figure: figure.place[0])
    assert outline(left.seen).iou(people[0].box) > 0.9
    assert not right.seen.ends.any
    assert not left.parted


@pytest.mark.parametrize(('z', 'two'), [(2.5, True), (2.25, False)])
def test_who_comes_out_from_behind_another_and_touches_him_is_told_by_depth(z: float, two: bool):
    """Nobody is expected there, and no two heads show side by side: they were one figure."""
    people = [Someone(-0.1, 2.0), Someone(0.16, z)]
    left, right = (round(x) for x in (people[0].box.right, people[1].box.right))

    def touch(depth: np.ndarray) -> np.ndarray:
        # An arm leads from one to the other.
        row = round(people[0].box.cy)
        depth[row : row + 4, left:right] = np.linspace(2.0, z, right - left)
        return depth

    figures = find_figures(scene_of(people, touch), NONE_EXPECTED)
    assert len(figures) == 1 + two
    if two:
        nearer, farther = sorted(figures, key=lambda figure: figure.place[1])
        assert outline(nearer.seen).iou(people[0].box) > 0.8
        assert farther.place[1] == pytest.approx(z, abs=0.05)
        assert farther.parted


def test_a_table_that_leads_from_near_to_far_is_not_two():
    one = Someone(0.0, 3.0)

    def side(depth: np.ndarray) -> np.ndarray:
        rows, cols = slice(int(one.box.y), int(one.box.bottom)), slice(100, 130)
        depth[rows, cols] = np.linspace(2.6, 3.2, 30)
        return depth

    assert len(find_figures(scene_of([], side), NONE_EXPECTED)) == 1


def test_somebody_who_waves_is_one():
    one = Someone(0.0, 3.0)
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    for i in range(6):
        color, depth = images([one] if i > 4 else [])
        if i > 4:
            left, top = round(0.23 / 3.0 * CAMERA.fx + CAMERA.cx), int(one.box.y)
            depth[top + 15 : top + 22, left - 1 : left + 18] = 3.0  # the arm
            depth[top : top + 22, left + 12 : left + 18] = 3.0  # and the hand beside the head
        scene = reader.read(Frame(color, depth, round(1e8 * i), CAMERA), 0.1)
    assert scene is not None
    (figure,) = find_figures(scene, NONE_EXPECTED)
    assert outline(figure.seen).iou(one.box) > 0.6


def test_a_piece_of_the_ceiling_is_no_figure():
    scene = scene_of([Someone(0.0, 3.0)])
    row = np.arange(ROWS, dtype=np.float32)[:, None] + np.zeros((1, COLS), np.float32)
    for floor, people in ((1.3, 1), (3.5, 0)):
        elevation = np.float32(floor) - (row - CAMERA.cy) * 3.0 / CAMERA.fy
        above = dataclasses.replace(scene, elevation=elevation.astype(np.float32))
        assert len(find_figures(above, NONE_EXPECTED)) == people


def test_the_tall_are_told_apart_from_those_whose_shape_alone_says_so():
    reader = SceneReader(COLS, 0.04, 0.03, 0.0)
    scene = reader.read(picture([Someone(0.0, 3.0)], 0.0), 0.0)
    assert scene is not None
    for above, tall in ((2.0, True), (1.25, False)):
        elevation = np.full((ROWS, COLS), above, np.float32)
        shapes = Shapes(
            scene.view,
            scene.surfaces,
            scene.sizes,
            elevation,
            scene.forward,
            scene.axes[0],
            Rim(),
        )
        found = shapes.upright()
        assert found.mask.any()
        assert found.tall.any() == tall


STANDS = Someone(0.0, 3.0).box


@pytest.mark.parametrize(
    ('moved', 'covered', 'somebody'),
    [
        (np.s_[90:130, :110], False, True),  # an arm
        (np.s_[:, :], False, False),  # he has come
        (np.s_[:100, :], False, False),  # with what stands below, as behind a chair
        (np.s_[90:130, :110], True, False),  # more of it may be hidden, as of a wall
    ],
)
def test_what_has_a_persons_shape_is_somebody_once_something_of_it_moves(
    moved: tuple[slice, slice], covered: bool, somebody: bool
):
    _, depth = images([Someone(0.0, 3.0)])
    mask = depth < WALL
    if covered:
        depth[int(STANDS.y) : int(STANDS.bottom), int(STANDS.right) :] = 1.0
    view, surfaces = DepthView(depth, 1, CAMERA), surfaces_in(depth, depth > 0, 0.04, 0.03)
    sizes, axes = Sizes.of(surfaces, CAMERA), np.eye(3)
    shapes = Shapes(view, surfaces, sizes, None, depth, axes[0], Rim())
    before = np.zeros_like(mask)
    before[moved] = mask[moved]
    of_it = np.bincount(surfaces.labels[before], minlength=len(surfaces)) > 0
    assert np.array_equal(shapes.stirring(of_it, before), mask & somebody)


def test_what_is_too_small_for_anybody_is_no_figure():
    def crumb(depth: np.ndarray) -> np.ndarray:
        depth[80:90, 100:110] = 3.0
        return depth

    assert find_figures(scene_of([], crumb), NONE_EXPECTED) == []
    assert find_figures(scene_of([]), NONE_EXPECTED) == []
