# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Simulated scenes: the same for a seed, exact in their truth, and true to their names."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.simulation import SCENARIOS, SimulatedSequence, kinect2_intrinsics, simulate
from rgbd_kcf_tracker.simulation.actors import FacesActor, PersonActor, ball
from rgbd_kcf_tracker.simulation.build import check_request
from rgbd_kcf_tracker.simulation.motion import CameraMotion, Motion
from rgbd_kcf_tracker.simulation.people import Stance, random_person
from rgbd_kcf_tracker.simulation.picture import TARGET, Backdrop, Picture
from rgbd_kcf_tracker.simulation.room import Room, box_faces, face
from rgbd_kcf_tracker.simulation.sensor import Sensor, SensorOptions
from rgbd_kcf_tracker.simulation.solids import Atlas, Lighting, SolidList, render
from rgbd_kcf_tracker.simulation.world import World

SMALL = (320, 180)
HIDING = (
    'occlusion', 'turn_back', 'long_occlusion', 'early_occlusion', 'crossing', 'behind_box',
    'behind_chair', 'behind_person', 'out_of_view', 'other_edge', 'decoy',
)  # fmt: skip
CLEAN = SensorOptions(color_noise=0, softness=0, depth_noise=0, holes=0, exposure_s=0)
GREY = np.full((32, 32, 3), 128, np.uint8)


def wall(z: float) -> Room:
    """An empty world with a wall across the view."""
    corner = np.array([-20.0, -20.0, z])
    return Room([face(corner, np.array([40.0, 0, 0]), np.array([0, 40.0, 0]), GREY)])


def ball_scene(*, sensor: SensorOptions = CLEAN, x: float = 0.2, z: float = 2.0) -> World:
    """A ball of 0.3 m radius hanging at eye level before a wall at 4 m."""
    motion = Motion([(0, x, z)], channels={'lift': [(0, 0.7)]})  # its middle is 1 m up
    actor = ball(np.random.default_rng(0), motion, 0.3)
    return World(wall(4.0), [actor], CameraMotion(1.0, 0.0), 1.0, sensor)


def record(scene: World, size: tuple[int, int] = (960, 540)) -> SimulatedSequence:
    offsets = [round(k * 1e9 / 30) for k in range(30)]
    return SimulatedSequence(scene, 'test', 0, 30.0, offsets, size, kinect2_intrinsics(size))


def sphere_box(x: float, z: float, radius: float, size: tuple[int, int]) -> Box:
    """The outline of a sphere at eye level, from the tangents of its horizontal section."""
    camera = kinect2_intrinsics(size)
    angle, half = math.atan2(x, z), math.asin(radius / math.hypot(x, z))
    left, right = (camera.fx * math.tan(angle + s * half) + camera.cx for s in (-1, 1))
    # above and below, the tangent plane holds the camera's x axis
    half = math.asin(radius / z)
    top, bottom = (camera.fy * math.tan(s * half) + camera.cy for s in (-1, 1))
    return Box.from_corners(left, top, right, bottom)


def test_ball_is_drawn_where_geometry_puts_it() -> None:
    simulated = record(ball_scene())[0]
    expected = sphere_box(0.2, 2.0, 0.3, (960, 540))
    assert simulated.visible is not None
    assert simulated.visible == simulated.body
    assert simulated.visible_fraction == 1.0
    # a pixel belongs to the ball if its centre does: within a pixel on each side
    assert np.abs(np.subtract(simulated.visible.as_tuple(), expected.as_tuple())).max() < 1.6


def test_depth_is_the_distance_of_the_surface() -> None:
    simulated = record(ball_scene(x=0.0))[0]
    depth = simulated.frame.depth
    assert depth is not None
    assert depth[270, 480] == pytest.approx(1.7, abs=0.003)
    assert depth[20, 480] == pytest.approx(4.0, abs=0.003)
    assert simulated.distance == pytest.approx(2.0)


@pytest.mark.parametrize('size', [(1920, 1080), (960, 540), (640, 480), (512, 424), (480, 270)])
@pytest.mark.parametrize('axis', [0, 1])
def test_depth_lies_where_the_colour_does(size: tuple[int, int], axis: int) -> None:
    """All depth lay up to two pixels to the right and below, from resizing by rounding down."""
    sensor = Sensor(CLEAN, kinect2_intrinsics(size), size, np.random.default_rng(0))
    length = size[1 - axis]
    ramp = 1 + 3 / length * np.indices((size[1], size[0]))[axis].astype(np.float32)
    grey = np.full((size[1], size[0], 3), 128, np.uint8)
    depth = sensor.depth(ramp.astype(np.float32), grey, None, np.random.default_rng(1))
    moved = (depth - ramp) * length / 3  # pixels from where each reading was taken
    assert abs(float(np.nanmean(moved))) < 0.1


def test_what_gives_no_reading_lies_where_the_target_does() -> None:
    size = (1920, 1080)
    sensor = Sensor(CLEAN, kinect2_intrinsics(size), size, np.random.default_rng(0))
    flat, target = np.full((1080, 1920), 3, np.float32), np.zeros((1080, 1920), bool)
    target[400:700, 900:1300] = True
    grey = np.full((1080, 1920, 3), 128, np.uint8)
    depth = sensor.depth(flat, grey, target, np.random.default_rng(1))
    rows, cols = np.nonzero(np.isnan(depth))
    assert (rows.min() + rows.max()) / 2 == pytest.approx(549.5, abs=1.5)
    assert (cols.min() + cols.max()) / 2 == pytest.approx(1099.5, abs=1.5)


def test_depth_noise_grows_with_distance() -> None:
    spread = []
    for z in (1.0, 2.0, 4.0):
        scene = World(wall(z), ball_scene().actors, CameraMotion(1.0, 0.0), 1.0, SensorOptions())
        depth = record(scene)[0].frame.depth
        assert depth is not None
        part = depth[:60, :400]
        spread.append(float(np.nanstd(part)))
        assert np.nanmean(part) == pytest.approx(z, abs=0.003)
    assert 0.001 < spread[0] < spread[1] < spread[2] < 0.04


def test_out_of_range_gives_no_reading() -> None:
    """What is beyond 8 m; the noise alone reads up to 8.5 m."""
    for z in (0.4, 8.05, 9.0):
        scene = World(wall(z), ball_scene(z=20.0).actors, CameraMotion(1.0, 0.0), 1.0, CLEAN)
        depth = record(scene)[0].frame.depth
        assert depth is not None
        assert np.isnan(depth).all()


def test_shadow_lies_on_one_side_and_is_as_wide_as_the_baseline_says() -> None:
    simulated = record(ball_scene(x=0.0, z=1.5))[0]
    depth, box = simulated.frame.depth, simulated.visible
    assert depth is not None
    assert box is not None
    row = np.isnan(depth[270])
    left = int(row[int(box.x) - 60 : int(box.x)].sum())
    right = int(row[int(box.right) : int(box.right) + 60].sum())
    # at the rim, where the ball is about 1.44 m away, before a wall at 4 m
    expected = 0.052 * 540.68 * (1 / 1.44 - 1 / 4.0)
    assert right <= 4
    assert left == pytest.approx(expected, abs=5)


def test_box_before_the_ball_hides_exactly_what_it_covers() -> None:
    scene = ball_scene(x=0.0)
    panel = box_faces(np.array([0.5, 0.0, 1.5]), (1.0, 3.0, 0.02), 0.0, [GREY])
    for actor in (None, FacesActor(tuple(panel), Motion([(0, 0, 0)]), 3.0)):
        scene = ball_scene(x=0.0)
        if actor is None:
            scene.room.faces += panel  # as furniture
        else:
            scene.actors.append(actor)  # as something that moves
        simulated = record(scene)[0]
        assert simulated.visible is not None
        assert simulated.body is not None
        # the panel covers everything to the right of the picture's middle
        assert simulated.visible.right == pytest.approx(480, abs=1)
        assert simulated.visible.x == simulated.body.x
        assert simulated.visible_fraction == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize('share', [0.5, 0.6, 0.7, 0.8])
def test_less_than_a_fifth_is_absent(share: float) -> None:
    scene = ball_scene(x=0.0)
    # covered from the left up to this share of the ball's width
    edge = 0.3 * (2 * share - 1) * 1.5 / 2.0
    panel = box_faces(np.array([edge - 1.0, 0.0, 1.5]), (2.0, 3.0, 0.002), 0.0, [GREY])
    scene.room.faces += panel
    truth = record(scene).truth(0)
    assert truth.body is not None
    # the segment of a circle to the right of the edge
    half = math.acos(2 * share - 1)
    segment = (half - math.sin(half) * math.cos(half)) / math.pi
    assert truth.visible_fraction == pytest.approx(segment, abs=0.015)
    assert (truth.visible is None) == (segment < 0.2)


def test_leaving_the_view_counts_as_hidden() -> None:
    # perspective stretches the outer half of a ball at the border: less than half is inside
    half_width = 2.0 * 480 / 540.68
    for x, fraction in ((half_width, 0.44), (half_width + 0.25, 0.10), (half_width + 2, 0.0)):
        truth = record(ball_scene(x=x)).truth(0)
        assert truth.visible_fraction == pytest.approx(fraction, abs=0.04)
        assert (truth.visible is None) == (fraction < 0.2)
        assert (truth.body is None) == (fraction == 0)
        if truth.visible is not None:
            assert truth.visible.right == 960
            assert truth.body is not None
            assert truth.body.right > 1000


def test_solids_meet_their_equations() -> None:
    """Every drawn pixel of a tilted, flat, tapered limb lies on its surface."""
    camera = kinect2_intrinsics((320, 180))
    out = SolidList()
    start, end = np.array([-0.4, -0.3, 2.0]), np.array([0.3, 0.4, 2.6])
    out.limb(start, end, 0.2, 0.1, 0, np.array([1.0, 0, 0.2]), 0.6)
    solids = out.pack()
    layer = render(solids, Atlas([GREY]), camera, (0, 0, 320, 180), Lighting(np.array([0, -1, 0])))
    assert layer is not None
    rows, cols = np.nonzero(layer.mask)
    z = layer.z[rows, cols].astype(float)
    u, v = cols + layer.x0, rows + layer.y0
    p = np.stack([(u - camera.cx) * z / camera.fx, (v - camera.cy) * z / camera.fy, z], axis=1)
    q = (p - solids.origin[0]) @ np.linalg.inv(solids.frame[0]).T
    assert ((q[:, 1] > -0.01) & (q[:, 1] < 1.01)).all()
    radius = np.hypot(q[:, 0], q[:, 2]) / (1 + solids.taper[0] * q[:, 1])
    assert np.abs(radius - 1).max() < 0.01
    assert len(z) > 500


def test_person_stands_on_the_floor_and_is_as_tall_as_they_are() -> None:
    person, _ = random_person(np.random.default_rng(1))
    for pose in (Stance(0, 3), Stance(0, 3, phase=1.0, effort=1.0), Stance(0, 3, crouch=1.0)):
        solids = person.solids(pose)
        low = solids.origin[:, 1] + np.abs(solids.frame[:, 1]).max(axis=1)
        assert -0.08 < low.max() < 0.12  # y is down, the floor is 0
    height = -person.solids(Stance(0, 3)).origin[:, 1].min()
    assert 0.85 * person.height < height < 1.02 * person.height
    crouched = -person.solids(Stance(0, 3, crouch=1.0)).origin[:, 1].min()
    assert crouched < 0.65 * person.height


def test_same_seed_same_frames_in_any_order() -> None:
    one = simulate('crowd', seed=5, size=SMALL)
    two = simulate('crowd', seed=5, size=SMALL)
    later = two[40]
    for index in (0, 40):
        a, b = one[index], later if index == 40 else two[index]
        assert np.array_equal(a.frame.color, b.frame.color)
        assert a.frame.depth is not None
        assert b.frame.depth is not None
        assert np.array_equal(a.frame.depth, b.frame.depth, equal_nan=True)
        assert a.truth == b.truth
    other = simulate('crowd', seed=6, size=SMALL)[0]
    assert not np.array_equal(other.frame.color, one[0].frame.color)


@pytest.mark.parametrize(
    'name', ['camera_motion', 'light_change', 'missing_depth', 'lookaround', 'following']
)
def test_rates_sample_the_same_world(name: str) -> None:
    fast = simulate(name, seed=2, rate_hz=30, size=SMALL)
    slow = simulate(name, seed=2, rate_hz=5, size=SMALL)
    assert len(slow) == pytest.approx(len(fast) / 6, abs=1)
    for index in (0, 3, 10):
        a, b = slow[index], fast[6 * index]
        assert a.frame.stamp_ns == b.frame.stamp_ns
        assert np.array_equal(a.frame.color, b.frame.color)
        assert a.truth == b.truth
    stamps = [slow[i].frame.stamp_ns for i in range(3)]
    assert np.diff(stamps).tolist() == [200_000_000, 200_000_000]


@pytest.mark.parametrize('name', SCENARIOS)
def test_every_scenario_renders_with_truth_that_agrees(name: str) -> None:
    several = SCENARIOS[name].several
    rate = 0.5 if several else 2
    sequence = simulate(name, seed=1, rate_hz=rate, size=SMALL)
    assert 3.0 <= len(sequence) / rate <= (65.0 if several else 14.0)
    truths = []
    for simulated in sequence:
        frame, visible, body = simulated.frame, simulated.visible, simulated.body
        assert frame.color.shape == (180, 320, 3)
        assert frame.color.std() > 8
        assert frame.intrinsics == sequence.intrinsics
        assert (frame.depth is None) == (name == 'no_depth')
        if frame.depth is not None:
            read = frame.depth[~np.isnan(frame.depth)]
            assert read.size > 0.3 * frame.depth.size
            assert read.min() > 0.4
            assert read.max() < 8.5
        assert (visible is None) == (simulated.visible_fraction < 0.2)
        if visible is not None:
            assert body is not None
            assert visible.x >= max(body.x, 0)
            assert visible.y >= max(body.y, 0)
            assert visible.right <= min(body.right, 320)
            assert visible.bottom <= min(body.bottom, 180)
        truths.append(simulated.truth)
    assert truths[0].visible is not None
    assert truths[0].visible_fraction > 0.5
    seen = 0.2 if name == 'reunion' else 0.3  # away for 30 s
    assert sum(t.visible is not None for t in truths) > seen * len(truths)
    assert sequence.truth(1) == truths[1]


@pytest.mark.parametrize('seed', [92, 146])
def test_what_a_tall_person_carries_is_in_view(seed: int) -> None:
    """Not above a low camera's picture, where there would be nothing to follow."""
    scene = simulate('carried_mug', seed=seed, rate_hz=2, size=SMALL)
    assert scene[0].visible_fraction > 0.5


@pytest.mark.timeout(20)
def test_a_picture_too_low_to_show_what_is_carried_is_made_all_the_same() -> None:
    """He went on for ever in search of a place where a camera that looks down would show it."""
    assert simulate('carried_mug', seed=92, rate_hz=2, size=(640, 100))[0].visible_fraction < 0.5


@pytest.mark.parametrize('name', HIDING)
@pytest.mark.parametrize('seed', [7])
def test_occlusion_scenarios_hide_the_target_and_show_it_again(name: str, seed: int) -> None:
    sequence = simulate(name, seed=seed, rate_hz=6, size=(160, 90))
    seen = np.array([sequence.truth(i).visible is not None for i in range(len(sequence))])
    assert seen[0]
    assert 0.1 < (~seen).sum() / 6 < 7.0
    assert seen[np.flatnonzero(~seen)[-1] + 1 :].any()


def test_target_distance_is_what_the_depth_says() -> None:
    sequence = simulate('approach', seed=4, rate_hz=2, size=(480, 270))
    for simulated in list(sequence)[:6]:
        depth, box = simulated.frame.depth, simulated.visible
        assert depth is not None
        assert box is not None
        row, col = int(box.y + box.height * 0.3), int(box.cx)
        patch = depth[row - 2 : row + 3, col - 2 : col + 3]
        # the chest is a little nearer than the middle of the body
        assert -0.05 < simulated.distance - float(np.nanmedian(patch)) < 0.4


def test_missing_depth_is_missing_on_the_target_only() -> None:
    scene = ball_scene(sensor=SensorOptions(no_target_depth=((0.0, 0.5),)))
    blind, seeing = record(scene)[0], record(scene)[20]
    for simulated, none in ((blind, True), (seeing, False)):
        box, depth = simulated.visible, simulated.frame.depth
        assert box is not None
        assert depth is not None
        inner = depth[int(box.cy) - 20 : int(box.cy) + 20, int(box.cx) - 20 : int(box.cx) + 20]
        assert np.isnan(inner).all() == none
        assert np.isfinite(depth[5:100, 5:100]).mean() > 0.9


def test_depth_that_is_shifted_ends_at_the_side_that_it_leaves() -> None:
    """What left the picture at one side came in again at the other."""
    motion = Motion([(0, -1.0, 2.0), (1, 1.0, 2.0)], corner_s=0, channels={'lift': [(0, 0.7)]})
    actor = ball(np.random.default_rng(0), motion, 0.3)
    for shift in ((6, 0), (-6, 0), (0, 5), (0, -5)):
        options = SensorOptions(0, 0, 0, 0, shift=shift)
        world = World(wall(4.0), [actor], CameraMotion(1.0, 0.0), 1.0, options)
        depth = record(world)[0].frame.depth
        assert depth is not None
        right, down = shift
        gone = np.zeros(depth.shape, bool)
        gone[:, :right] |= right > 0
        gone[:, right:] |= right < 0
        gone[:down] |= down > 0
        gone[down:] |= down < 0
        assert np.isnan(depth[gone]).all()
        assert np.isfinite(depth[~gone]).any()


def test_late_and_shifted_depth_lie_beside_the_colour() -> None:
    motion = Motion([(0, -1.0, 2.0), (1, 1.0, 2.0)], corner_s=0, channels={'lift': [(0, 0.7)]})
    actor = ball(np.random.default_rng(0), motion, 0.3)
    for options, shift in (
        (SensorOptions(0, 0, 0, 0, delay_s=0.05), 0.05 * 2 * 540.68 / 2),
        (SensorOptions(0, 0, 0, 0, shift=(-6, 0)), -6),
    ):
        scene = World(wall(4.0), [actor], CameraMotion(1.0, 0.0), 1.0, options)
        simulated = record(scene)[15]
        depth, box = simulated.frame.depth, simulated.visible
        assert depth is not None
        assert box is not None
        near = np.flatnonzero(depth[270] < 2.2)
        middle = (near[0] + near[-1] + 1) / 2
        assert middle - box.cx == pytest.approx(shift, abs=3)


def test_motion_blur_grows_with_exposure() -> None:
    motion = Motion([(0, -1.5, 2.0), (1, 1.5, 2.0)], corner_s=0, channels={'lift': [(0, 0.7)]})
    actor = ball(np.random.default_rng(0), motion, 0.3)
    sharpness = []
    for exposure in (0.0, 0.03):
        options = SensorOptions(0, 0, exposure_s=exposure)
        scene = World(wall(4.0), [actor], CameraMotion(1.0, 0.0), 1.0, options)
        row = record(scene)[15].frame.color[270].astype(int).sum(axis=1)
        sharpness.append(np.abs(np.diff(row)).max())
    assert sharpness[1] < 0.5 * sharpness[0]


def test_feet_that_move_are_painted_as_far_as_they_are_the_targets() -> None:
    """A foot ahead of the middle lay under the floor, which is nearer than the middle there."""
    red = np.full((32, 32, 3), (0, 0, 255), np.uint8)
    right, ahead = np.array([40.0, 0, 0]), np.array([0, 0, 6.0])
    room = wall(4.0)
    room.faces = [face(room.faces[0].corner, right, np.array([0, 40.0, 0]), red),
                  face(np.array([-20.0, 0, -1]), right, ahead, red)]  # fmt: skip
    person, _ = random_person(np.random.default_rng(1))
    actor = PersonActor(person, Motion([(0, -1.5, 2.5), (1, 1.5, 2.5)], heading=[(0, 0.0)]))
    sensor = SensorOptions(0, 0, 0, 0, exposure_s=0.02)
    world = World(room, [actor], CameraMotion(1.6, 0.25), 1.0, sensor)
    backdrop = Backdrop(world, kinect2_intrinsics((640, 360)), (640, 360))
    bare = all_ = 0
    for t in np.arange(0.25, 0.76, 0.05):
        picture = Picture(backdrop, float(t))
        rows, cols = np.nonzero(picture.owner == TARGET)
        low = rows > rows.max() - 0.1 * np.ptp(rows)
        painted = picture.color[rows[low], cols[low]]
        bare += int((painted[:, :2].max(axis=1) == 0).sum())  # the room's red, in a shadow too
        all_ += len(painted)
    assert bare <= 0.005 * all_


def test_the_whole_body_of_somebody_near_is_told() -> None:
    """It ended at a picture's height below the picture, but at a picture's width beside it."""
    person, _ = random_person(np.random.default_rng(1))
    actor = PersonActor(person, Motion([(0, 0.0, 1.0)]))
    truth = record(World(wall(4.0), [actor], CameraMotion(1.6, 0.0), 1.0, CLEAN)).truth(0)
    assert truth.body is not None
    ankles = 269.5 + 540.68 * 1.6 / 1.0
    assert ankles < truth.body.bottom < 540 + 960


def test_keys_later_than_the_way_are_kept() -> None:
    """The table ended two seconds after the last way point."""
    keys = {'spread': [(0.0, 0.0), (2.5, 0.0), (3.0, 0.35), (4.0, 0.0)]}
    still = Motion([(0, 1, 3)], heading=[(0, 0.8), (3, 0.8), (4, -0.8)], channels=keys)
    assert still.value('heading', 2.5) == pytest.approx(0.8, abs=0.01)
    assert still.value('heading', 4.6) == pytest.approx(-0.8, abs=0.01)
    assert still.value('spread', 3.0) > 0.25
    assert still.value('spread', 4.6) == pytest.approx(0.0, abs=0.01)
    assert (still.value('x', 9.0), still.value('z', 9.0)) == pytest.approx((1, 3))


@pytest.mark.parametrize('seed', [0, 92])
def test_the_world_is_the_same_at_any_size(seed: int) -> None:
    """Somebody who carries a mug stood farther away in a low picture."""
    centres = [
        [float(v) for actor in simulate('carried_mug', seed, size=size).scene.actors
         for t in (0.0, 2.0) for v in actor.centre(t)]
        for size in ((640, 360), (640, 480), (640, 200))
    ]  # fmt: skip
    assert centres[1] == pytest.approx(centres[0])
    assert centres[2] == pytest.approx(centres[0])


def test_nobody_in_the_crowd_walks_through_a_wall() -> None:
    for seed in range(8):
        scene = simulate('crowd', seed, size=SMALL).scene
        half_width = -float(scene.room.faces[1].corner[0])
        far = max(abs(float(actor.centre(t)[0])) for actor in scene.actors for t in range(12))
        assert far < half_width - 0.3


def test_a_camera_that_turns_about_sees_walls_all_round() -> None:
    sequence = simulate('mug_hand_held', seed=1, rate_hz=5, size=SMALL)
    backdrop = Backdrop(sequence.scene, sequence.intrinsics, SMALL)
    for t in (0.0, 3.6, 3.9, 4.2):
        assert np.isfinite(backdrop.draw(backdrop.view(t))[1]).all()


def test_sensor_noise_has_the_asked_strength() -> None:
    size = (320, 180)
    sensor = Sensor(SensorOptions(color_noise=4, softness=0), kinect2_intrinsics(size), size,
                    np.random.default_rng(0))  # fmt: skip
    flat = np.full((180, 320, 3), 120, np.uint8)
    noisy = sensor.color(flat, (1, 1, 1), np.random.default_rng(1)).astype(float)
    assert noisy.std() == pytest.approx(4, rel=0.15)
    assert noisy.mean() == pytest.approx(120, abs=0.5)
    assert sensor.color(flat, (0.5, 1, 1), np.random.default_rng(1))[..., 0].mean() < 62


def test_irregular_stamps_show_the_same_world() -> None:
    regular = simulate('crossing', seed=3, size=SMALL)
    sequence = simulate('crossing', seed=3, size=SMALL, irregular=True)
    stamps = np.array([sequence.stamp_ns(i) for i in range(len(sequence))])
    steps = np.diff(stamps) * 30e-9
    assert 0.7 * len(regular) < len(sequence) < len(regular)
    assert steps.min() > 0.4
    assert steps.max() > 5  # a gap
    assert 0.05 < np.std(steps[steps < 1.5]) < 0.4
    assert sequence[0].truth == regular[0].truth
    again = simulate('crossing', seed=3, size=SMALL, irregular=True)
    assert [again.stamp_ns(i) for i in range(len(again))] == stamps.tolist()
    later = int(np.argmax(steps)) + 1
    near = int(np.argmin([abs(regular.stamp_ns(i) - stamps[later]) for i in range(len(regular))]))
    box, other = sequence.truth(later).body, regular.truth(near).body
    assert box is not None
    assert other is not None
    assert box.iou(other) > 0.8


def test_each_scenario_loses_other_frames() -> None:
    one, other = (
        simulate(name, 3, 30.0, 3.0, SMALL, irregular=True) for name in ('normal', 'crossing')
    )
    assert [one.stamp_ns(i) for i in range(30)] != [other.stamp_ns(i) for i in range(30)]


def test_one_frame_at_the_least() -> None:
    for irregular in (False, True):
        sequence = simulate('normal', 0, 0.1, 0.1, SMALL, irregular)
        assert len(sequence) == 1
        assert sequence[0].visible is not None


def test_indexing() -> None:
    sequence = simulate('normal', rate_hz=5, duration_s=1.0, size=SMALL)
    assert len(sequence) == 5
    assert sequence[-1].frame.stamp_ns == sequence[4].frame.stamp_ns
    with pytest.raises(IndexError):
        sequence[5]
    with pytest.raises(TypeError, match='not for a slice'):
        sequence[0:2]  # type: ignore[index]


@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'scenario': 'ocean'}, 'unknown scenario'),
        ({'seed': -1}, 'seed'),
        ({'rate_hz': 0.0}, 'rate'),
        ({'rate_hz': math.nan}, 'rate'),
        ({'duration_s': -1.0}, 'duration'),
        ({'size': (10, 10)}, 'size'),
        ({'seed': 1.5}, 'seed is 1.5: give a whole number'),
        ({'rate_hz': '30'}, "rate is '30': give a number"),
        ({'size': (960.0, 540.0)}, 'whole pixels'),
        ({'size': (960, 540, 3)}, 'width and height'),
    ],
)
def test_bad_requests(changes: dict[str, object], words: str) -> None:
    request: dict[str, object] = {
        'scenario': 'normal', 'seed': 0, 'rate_hz': 30.0, 'duration_s': None, 'size': SMALL
    }  # fmt: skip
    with pytest.raises(ParameterError, match=words):
        check_request(**(request | changes))  # type: ignore[arg-type]


def test_asked_scenarios_are_there() -> None:
    asked = {
        'normal', 'clutter', 'deformation', 'motion', 'occlusion', 'out_of_view', 'crossing',
        'passer_by', 'behind_box', 'behind_chair', 'behind_person', 'fast_motion', 'approach',
        'recede', 'lookalike', 'crowd', 'turn_back', 'long_occlusion', 'light_change',
    }  # fmt: skip
    assert asked <= set(SCENARIOS)
    assert all(s.description and s.name == name for name, s in SCENARIOS.items())


def test_every_scenario_is_documented() -> None:
    page = (Path(__file__).parent.parent / 'docs' / 'simulation.md').read_text()
    for name, scenario in SCENARIOS.items():
        assert f'| `{name}` | {scenario.description} |' in page


@pytest.mark.parametrize('name', ['turn_back', 'decoy'])
def test_the_table_tells_of_the_seeds_that_it_names(name: str) -> None:
    page = (Path(__file__).parent.parent / 'docs' / 'simulation.md').read_text()
    row = next(line for line in page.splitlines() if line.startswith(f'| `{name}` |'))
    seconds, hidden = (float(cell) for cell in row.split('|')[3:5])
    scenes = [simulate(name, seed, 10.0, size=(160, 90)) for seed in (21, 31)]
    seen = [scene.truth(i).visible is not None for scene in scenes for i in range(len(scene))]
    assert seconds == pytest.approx(sum(s.scene.duration_s for s in scenes) / 2, abs=0.1)
    assert hidden == pytest.approx(100 - 100 * float(np.mean(seen)), abs=2.5)
