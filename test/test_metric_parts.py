# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The parts of the metric tracker, each against what it should do exactly."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest
from people_rig import GOOD

from rgbd_kcf_tracker import Box, Frame, Intrinsics
from rgbd_kcf_tracker.features.windows import resampled
from rgbd_kcf_tracker.metric.by_look import ByLook
from rgbd_kcf_tracker.metric.decide.evidence import WEIGHTS, probability
from rgbd_kcf_tracker.metric.decide.parts import Others, Parts
from rgbd_kcf_tracker.metric.identity.body import BANDS, Body, band_histograms
from rgbd_kcf_tracker.metric.identity.color_posterior import ColorPosterior, rgb_codes
from rgbd_kcf_tracker.metric.identity.elsewhere import Elsewhere
from rgbd_kcf_tracker.metric.identity.flow import TextureFlow
from rgbd_kcf_tracker.metric.identity.hidden_cloud import TURN_TIME, HiddenCloud
from rgbd_kcf_tracker.metric.identity.masked_filter import MaskedFilter, Spectrum, spectrum_of
from rgbd_kcf_tracker.metric.identity.motion import MotionFilter
from rgbd_kcf_tracker.metric.identity.patch import PatchFeatures
from rgbd_kcf_tracker.metric.identity.scale_filter import ScaleFilter
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.colors import (
    CODES,
    TINTS,
    ColorCodes,
    color_codes,
    view_image,
)
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.ego_motion import Lost
from rgbd_kcf_tracker.metric.perceive.floor import FloorFinder
from rgbd_kcf_tracker.metric.perceive.scene import SceneReader
from rgbd_kcf_tracker.metric.perceive.silhouette import Rim, Silhouette
from rgbd_kcf_tracker.metric.perceive.surfaces import surfaces_in
from rgbd_kcf_tracker.pose import Pose

CAMERA = Intrinsics(200, 200, 120, 80)


def view_of(depth: np.ndarray) -> DepthView:
    return DepthView(depth.astype(np.float32), 1, CAMERA)


def wall(z: float = 4.0) -> np.ndarray:
    return np.full((160, 240), z, np.float32)


def blobs(seed: int, size: int = 200) -> np.ndarray:
    noise = np.random.default_rng(seed).integers(0, 256, (size, size, 3), dtype=np.uint8)
    return cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 4), None, 0, 255, cv2.NORM_MINMAX)


# -- depth and surfaces ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('size', 'step'), [((540, 960), 4), ((1080, 1920), 8), ((424, 512), 2), ((480, 640), 3)]
)
def test_the_view_of_an_image_is_every_step_th_pixel_as_that_of_its_depth(
    size: tuple[int, int], step: int
):
    image = np.random.default_rng(0).integers(0, 256, (*size, 3), dtype=np.uint8)
    depth = image[..., 0].astype(np.float32) / 8 + 1
    view = DepthView.of(Frame(image, depth, 0), size[1] // step)
    assert view is not None
    assert view.step == step
    small = view_image(image, step)
    assert np.array_equal(small, image[step // 2 :: step, step // 2 :: step])
    assert np.array_equal(small[..., 0] / 8 + 1.0, view.depth)


def test_the_share_of_a_surface_that_is_others_is_that_of_its_pixels():
    rng = np.random.default_rng(3)
    depth = np.repeat(rng.integers(1, 5, (8, 6)), 20, axis=0).repeat(40, axis=1).astype(np.float32)
    scene = SceneReader(240, 0.04, 0.03, 0.0).read(
        Frame(np.zeros((160, 240, 3), np.uint8), depth, 0, CAMERA), 0.0
    )
    assert scene is not None
    masks = [(slice(10, 50), slice(20, 70)), (slice(60, 100), slice(100, 180))]
    figures = [
        Silhouette.of(
            scene.view, part[1].start, part[0].start, np.ones((40, width), bool), 0, Rim()
        )
        for part, width in zip(masks, (50, 80), strict=True)
    ]
    others = Others(Parts(scene, figures), [False, False, True, False])
    theirs = np.zeros((160, 240), bool)
    theirs[masks[0]] = True
    labels = scene.surfaces.labels
    assert len(scene.surfaces) > 5
    for label in range(1, len(scene.surfaces)):
        share = theirs[labels == label].mean()
        assert others.share(scene.silhouette(label)) == pytest.approx(share)


def test_a_piece_of_something_large_is_joined_to_it_and_neither_somebody_nor_a_chair_is():
    """Of two figures that touch, of what is nearer and of what is too small nothing is told."""
    depth = wall()
    depth[30:130, 20:40] = 3.0  # somebody before the wall
    depth[60:100, 70:100] = 3.0  # a chair with somebody on it
    depth[:, 180:] = 3.5  # something nearer beside a piece of the wall
    scene = SceneReader(240, 0.04, 0.03, 0.0).read(
        Frame(np.zeros((160, 240, 3), np.uint8), depth, 0, CAMERA), 0.0
    )
    assert scene is not None
    boxes = [(20, 30, 20, 100), (70, 60, 15, 40), (130, 20, 25, 100), (155, 20, 25, 100)]
    boxes.append((210, 20, 2, 2))
    figures = [
        Silhouette.of(scene.view, left, top, np.ones((height, width), bool), 0, Rim())
        for left, top, width, height in boxes
    ]
    somebody, seated, piece, beside, speck = Parts(scene, figures).joined
    assert somebody == 0.0
    assert seated == 0.0, 'the chair is no larger than he'
    assert piece == 1.0
    assert beside == 1.0
    assert speck is None


def test_view_takes_every_step_and_fills_single_holes():
    depth = np.full((480, 640), 2.0, np.float32)
    depth[4::8, 4::8] = np.nan
    color = np.zeros((480, 640, 3), np.uint8)
    view = DepthView.of(Frame(color, depth, 0, Intrinsics(525, 525, 320, 240)), 80)
    assert view.step == 8
    assert view.shape == (60, 80)
    assert (view.depth == 2.0).all()
    assert view.intrinsics.fx == pytest.approx(525 / 8)


def test_holes_are_zero_and_no_depth_is_no_view():
    color = np.zeros((48, 64, 3), np.uint8)
    view = DepthView.of(Frame(color, np.full((48, 64), np.nan, np.float32)), 64)
    assert not view.depth.any()
    assert DepthView.of(Frame(color), 64) is None


def floor_scene(height: float = 1.2) -> np.ndarray:
    rows = np.arange(160, dtype=np.float64)[:, None]
    down = (rows - CAMERA.cy) / CAMERA.fy
    z = np.where(down > 1e-6, height / np.maximum(down, 1e-6), 1e9)
    return np.minimum(np.broadcast_to(z, (160, 240)), 5.0).astype(np.float32)


def test_floor_is_found_and_what_stands_on_it_is_above():
    depth = floor_scene()
    depth[40:150, 100:130] = 2.0
    floor = FloorFinder().update(view_of(depth))
    assert floor is not None
    # The foot of the wall behind does not tilt it.
    assert floor.height == pytest.approx(1.2, abs=1e-3)
    elevation = floor.elevation(depth)
    assert np.abs(elevation[150:, 10:60]).max() < 0.02
    # A point 30 rows below the middle at 2 m is 0.3 m below the camera.
    assert elevation[110, 110] == pytest.approx(0.9, abs=0.06)
    assert floor.row_at(110, 2.0) == pytest.approx(80 + 200 * 1.2 / 2.0, abs=2)


def tilted_floor(down: np.ndarray, height: float) -> np.ndarray:
    """A floor ``height`` metres below a camera whose frame ``down`` points down in, and a wall."""
    rows, columns = np.mgrid[:160, :240]
    rays = np.stack(
        ((columns - CAMERA.cx) / CAMERA.fx, (rows - CAMERA.cy) / CAMERA.fy, np.ones((160, 240)))
    )
    below = np.tensordot(down, rays, 1)
    depth = np.where(below > 1e-3, height / np.maximum(below, 1e-3), 6.0)
    return np.minimum(depth, 6.0).astype(np.float32)


@pytest.mark.parametrize('roll', [0.0, 0.2, -0.35])
def test_places_on_the_floor_have_axes_at_right_angles_however_the_camera_rolls(roll: float):
    tilt, height = 0.3, 1.4
    down = np.array([np.sin(roll), np.cos(roll) * np.cos(tilt), np.cos(roll) * np.sin(tilt)])
    floor = FloorFinder().update(view_of(tilted_floor(down, height)))
    assert floor is not None
    across, ahead = floor.axes(CAMERA)
    assert np.stack((across, down, ahead)) @ np.stack((across, down, ahead)).T == pytest.approx(
        np.eye(3), abs=1e-3
    )
    assert across[0] > 0
    assert ahead[2] > 0
    assert across[2] == pytest.approx(0.0, abs=1e-9), 'to the right of where the camera looks'


def test_a_floor_of_which_hardly_any_shows_is_where_it_was_however_the_camera_moves():
    """It was none, and somebody who came near was one surface with all around him."""
    down = np.array([0.0, np.cos(0.3), np.sin(0.3)])
    turn, _ = cv2.Rodrigues(np.array([0.05, -0.2, 0.1]))
    motion = Pose(turn, np.array([0.1, -0.2, 0.3]))
    finder = FloorFinder()
    assert finder.update(view_of(tilted_floor(down, 1.4))) is not None
    near = np.full((160, 240), 0.8, np.float32)
    floor = finder.update(view_of(near), motion=motion)
    assert floor is not None
    after = turn @ down
    height = 1.4 + after @ motion.translation
    assert floor.height == pytest.approx(height, abs=0.01)
    assert floor.height * floor.plane(CAMERA) == pytest.approx(after, abs=0.01)
    assert finder.update(view_of(np.zeros((160, 240), np.float32))) is floor
    again = finder.update(view_of(tilted_floor(after, height)), 0.2)
    assert again is not None
    assert again.height == pytest.approx(height, abs=0.005)
    kept = [finder.update(view_of(near), 0.2) is not None for _ in range(8)]
    assert kept == [True] * 6 + [False] * 2, 'while somebody passes, and not for good'


@pytest.mark.parametrize('down', [-1.4, -1.399999, -1.3, 1.0, 3.0, 1e9])
def test_a_camera_that_leaps_below_the_floor_or_far_above_it_has_none(down: float):
    """Poses that are given may be anything."""
    finder = FloorFinder()
    assert finder.update(view_of(tilted_floor(np.array([0.0, 1.0, 0.0]), 1.4))) is not None
    leap = Pose(np.eye(3), np.array([0.0, down, 0.0]))
    floor = finder.update(view_of(np.full((160, 240), 0.8, np.float32)), 0.1, motion=leap)
    assert (floor is not None) == (down == 1.0)
    assert floor is None or floor.height == pytest.approx(1.4 + down, abs=0.01)


def test_a_floor_below_which_something_lies_or_that_is_lost_is_none():
    down = np.array([0.0, 1.0, 0.0])
    for motion, nearer in ((Lost(), 0.8), (None, 5.0)):
        finder = FloorFinder()
        assert finder.update(view_of(tilted_floor(down, 1.4))) is not None
        assert finder.update(view_of(wall(nearer)), motion=motion) is None


def test_a_floor_that_is_lost_between_two_fits_is_not_the_one_from_before():
    """Two of three frames at 30 Hz fit none: people were then sought by the height they had."""
    down = np.array([0.0, np.cos(0.3), np.sin(0.3)])
    finder = FloorFinder()
    assert finder.update(view_of(tilted_floor(np.array([0.0, 1.0, 0.0]), 1.4))) is not None
    floor = finder.update(view_of(tilted_floor(down, 2.2)), 0.03, learns=False, motion=Lost())
    assert floor is None or floor.height == pytest.approx(2.2, abs=0.02)


def test_places_stay_where_they_are_while_the_floor_is_out_of_sight():
    """Told along the camera's own axes, what stood still had gone half a metre: somebody."""
    down = np.array([0.0, np.cos(0.5), np.sin(0.5)])
    reader = SceneReader(240, 0.04, 0.03, 0.05)
    color = np.random.default_rng(1).integers(0, 255, (160, 240, 3), np.uint8)
    covered = np.where(tilted_floor(down, 2.0) < 3.0, np.float32(0), np.float32(3.5))
    scenes = []
    for i in range(12):
        depth = covered if i > 2 else tilted_floor(down, 2.0)
        scene = reader.read(Frame(color, depth, i * 500_000_000, CAMERA), 0.5)
        assert scene is not None
        scenes.append(scene)
    assert scenes[2].floor is not None
    assert scenes[-1].floor is None
    assert scenes[-1].axes == pytest.approx(scenes[2].axes, abs=0.01)
    ray = np.array([0.0, (20 - CAMERA.cy) / CAMERA.fy, 1.0])
    assert scenes[-1].forward[20, 120] == pytest.approx(3.5 * scenes[2].axes[1] @ ray, abs=0.02)


def desks(rng: np.random.Generator) -> np.ndarray:
    """A room of whose floor furniture, with level tops, leaves gaps: a fifth of the lower part."""
    depth = floor_scene(1.1)
    down = (np.arange(160)[:, None] - CAMERA.cy) / CAMERA.fy
    shown = np.zeros((160, 240), bool)
    while np.count_nonzero(shown) < 0.08 * 0.5 * shown.size:
        row, column = rng.integers(132, 152), rng.integers(0, 220)
        shown[row : row + 10, column : column + 22] = True
    for _ in range(40):
        left, near = rng.integers(0, 220), rng.uniform(1.0, 3.5)
        part = np.broadcast_to(down, depth.shape)[:, left : left + 30]
        top, front = 0.4 / np.maximum(part, 1e-6), np.full(part.shape, near)
        piece = np.where((top > near) & (top < near + 0.5), top, front)
        piece = np.where((top < near) | (part < 0), np.inf, piece)  # above its top
        depth[:, left : left + 30] = np.where(
            shown[:, left : left + 30],
            depth[:, left : left + 30],
            np.minimum(depth[:, left : left + 30], piece),
        )
    depth += rng.normal(0, 1, depth.shape) * 0.0015 * depth**2
    return depth.astype(np.float32)


def test_floor_is_found_between_furniture_whatever_the_chance():
    heights = []
    for seed in range(20):
        floor = FloorFinder().update(view_of(desks(np.random.default_rng(seed))))
        heights.append(np.nan if floor is None else floor.height)
    assert np.abs(np.array(heights) - 1.1).max() < 0.02, heights


def test_a_view_too_small_for_a_floor_has_none():
    for size in ((1, 240), (11, 240), (20, 9)):
        assert FloorFinder().update(view_of(floor_scene()[: size[0], : size[1]])) is None


def test_a_wall_is_no_floor():
    assert FloorFinder().update(view_of(wall(2.0))) is None


def test_a_known_floor_is_fitted_again_only_where_it_is_to_be_learned():
    finder, view = FloorFinder(), view_of(floor_scene())
    first = finder.update(view)
    assert first is not None
    assert finder.update(view, learns=False) is first
    assert finder.update(view) is not first


def test_surfaces_part_where_depth_jumps_and_slopes_hold_together():
    depth = wall()
    depth[30:120, 60:100] = 2.0
    depth[30:120, 150:200] = np.linspace(2, 3, 50)
    surfaces = surfaces_in(depth, depth > 0, 0.04, 0.03)
    front, slope, back = (surfaces.labels[r, c] for r, c in ((60, 80), (60, 170), (5, 5)))
    assert len({front, slope, back}) == 3
    assert surfaces.pixels[front] == 90 * 40
    assert surfaces.depth[front] == pytest.approx(2.0)
    assert tuple(surfaces.boxes[front]) == (60, 30, 40, 90)


def test_a_mean_over_each_surface_is_that_of_its_pixels():
    depth = wall()
    depth[30:120, 60:100] = 2.0
    depth[50:60, 90:240] = 1.0  # ends at the image's edge, and the next row begins with the wall
    depth[::7, ::5] = 0
    surfaces = surfaces_in(depth, depth > 0, 0.04, 0.03)
    values = np.random.default_rng(0).random(depth.shape, np.float32)
    wanted = [values[surfaces.labels == label].mean() for label in range(len(surfaces))]
    assert len(surfaces) > 3
    np.testing.assert_allclose(surfaces.means(values), wanted, rtol=1e-5)


def test_silhouette_knows_what_cuts_it_off():
    depth = wall()
    depth[40:120, 80:110] = 2.5
    depth[100:160, 60:130] = 1.5
    mask = depth[40:100, 80:110] == 2.5
    seen = Silhouette.of(view_of(depth), 80, 40, mask, 1, Rim())
    assert seen.cut == (False, False, False, True)
    assert seen.depth == pytest.approx(2.5)
    assert seen.width == pytest.approx(30 * 2.5 / 200)
    assert seen.area == pytest.approx(30 * 60 * 2.5**2 / 200**2)


def test_silhouette_is_cut_by_the_image_and_by_the_rim():
    depth = wall()
    mask = np.ones((50, 20), bool)
    assert Silhouette.of(view_of(depth), 0, 40, mask, 1, Rim()).cut.left
    assert not Silhouette.of(view_of(depth), 30, 40, mask, 1, Rim()).cut.any
    assert Silhouette.of(view_of(depth), 30, 40, mask, 1, Rim(left=29)).cut.left
    depth[:, :29] = 0
    assert Rim.of(view_of(depth)) == Rim(left=29)


# -- colour ---------------------------------------------------------------------------------------


def test_bands_of_a_part_are_those_of_the_whole():
    color = np.zeros((80, 40, 3), np.uint8)
    color[:40] = (200, 30, 30)
    color[40:] = (30, 30, 200)
    codes = color_codes(color)
    mask = np.ones((80, 40), bool)
    counts = band_histograms(codes, mask, 0, 80)
    assert counts.shape == (BANDS, CODES)
    assert counts.sum() == pytest.approx(80 * 40)
    lower = band_histograms(codes[40:], mask[40:], -40, 80)
    assert not lower[: BANDS // 2].any()
    assert lower[BANDS // 2 :] == pytest.approx(counts[BANDS // 2 :], abs=1e-3)


def test_colour_codes_of_a_part_are_those_of_the_whole():
    image = np.random.default_rng(3).integers(0, 256, (160, 240, 3), dtype=np.uint8)
    codes, part = ColorCodes(image), (slice(20, 90), slice(100, 141))
    np.testing.assert_array_equal(codes[part], color_codes(image)[part])
    assert codes[part] is codes[part]


def test_colours_compare_before_and_after_a_change_of_light():
    rng = np.random.default_rng(0)
    depth = wall()
    dark = cv2.GaussianBlur(rng.integers(0, 140, (160, 240, 3), dtype=np.uint8), (0, 0), 5)
    reader = SceneReader(240, 0.04, 0.03, 0.0)
    whole = slice(0, 160), slice(0, 240)
    before = reader.read(Frame(dark, depth, 0, CAMERA), 0.0).codes[whole]
    # Every pixel 1.5 times as bright, from one frame to the next.
    light = np.clip(dark * 1.5, 0, 255).astype(np.uint8)
    after = reader.read(Frame(light, depth, 1, CAMERA), 0.033).codes[whole]
    lightness = TINTS * TINTS
    assert np.mean(after // lightness == before // lightness) > 0.8
    other = SceneReader(240, 0.04, 0.03, 0.0)
    still = other.read(Frame(light, depth, 1, CAMERA), 0.0).codes[whole]
    assert np.mean(still // lightness == before // lightness) < 0.5


def test_posterior_is_bayes_with_even_odds():
    posterior = ColorPosterior()
    codes = np.array([[1, 1, 1, 2], [2, 2, 2, 1]])
    target = np.array([[True] * 4, [False] * 4])
    posterior.learn(codes, target, ~target, 1.0)
    assert posterior.of(np.array([1, 2, 7])) == pytest.approx([0.75, 0.25, 0.5], abs=1e-3)


# -- motion ---------------------------------------------------------------------------------------


def test_motion_filter_is_the_textbook_kalman_filter():
    rng = np.random.default_rng(0)
    sigma, noise = 0.1, 2.0
    ours = MotionFilter(np.zeros(3), 0.5, 1.0, np.full(3, noise))
    x, p = np.zeros(2), np.diag([0.25, 1.0])
    h = np.array([[1.0, 0.0]])
    for _ in range(20):
        dt, z = rng.uniform(0.01, 0.3), rng.normal()
        f = np.array([[1, dt], [0, 1]])
        q = noise**2 * np.array([[dt**4 / 4, dt**3 / 2], [dt**3 / 2, dt**2]])
        x, p = f @ x, f @ p @ f.T + q
        ours.predict(dt)
        gain = p @ h.T / (h @ p @ h.T + sigma**2)
        x, p = x + gain[:, 0] * (z - x[0]), (np.eye(2) - gain @ h) @ p
        ours.correct(np.array([z, 0, 0]), np.full(3, sigma))
        assert ours.position[0] == pytest.approx(x[0])
        assert ours.velocity[0] == pytest.approx(x[1])
        assert ours.sigma[0] == pytest.approx(np.sqrt(p[0, 0]))
        assert ours.speed_sigma[0] == pytest.approx(np.sqrt(p[1, 1]))


def cloud(count: int = 500) -> HiddenCloud:
    rng = np.random.default_rng(1)
    still = np.zeros(3)
    return HiddenCloud(np.array([0, -0.5, 2.5]), still, np.full(3, 0.2), still + 0.1, count, rng)


def test_particles_die_where_the_camera_sees_past_them():
    depth = wall(5.0)
    depth[:, 120:] = 1.5  # a board over the right half: what is left of the target is behind it
    hidden = cloud()
    for _ in range(30):
        hidden.move(1 / 30)
        hidden.weigh(1 / 30, view_of(depth), 0.5)
    assert hidden.believed[0][0] > 0.1
    left = hidden.distance(np.array([-0.3, -0.5, 2.5]), np.full(3, 0.05))
    right = hidden.distance(np.array([0.3, -0.5, 2.5]), np.full(3, 0.05))
    assert left > right + 1.0


def test_particles_spread_with_time_not_with_frames():
    depth = wall(1.0)
    spreads = []
    for rate in (5, 30):
        hidden = cloud(4000)
        for _ in range(rate):
            hidden.move(1 / rate)
            hidden.weigh(1 / rate, view_of(depth), 0.5)
        spreads.append(hidden.believed[1][0, 0] ** 0.5)
    assert spreads[0] == pytest.approx(spreads[1], rel=0.2)


@pytest.mark.parametrize('rate', [1, 2, 5, 30])
def test_who_is_hidden_goes_on_as_far_at_any_rate(rate: int):
    """Two seconds after a walk of 1.4 m/s: at 1 Hz he was half a metre short of it."""
    rng, still = np.random.default_rng(1), np.zeros(3)
    walk = np.array([1.4, 0.0, 0.0])
    hidden = HiddenCloud(np.array([0.0, 0.0, 3.0]), walk, still, still, 20000, rng)
    for _ in range(2 * rate):
        hidden.move(1 / rate)
    keeps = TURN_TIME[0] * (1 - np.exp(-2 / TURN_TIME[0]))
    assert hidden.believed[0][0] == pytest.approx(1.4 * keeps, abs=0.03)
    assert hidden.believed[1][0, 0] ** 0.5 == pytest.approx(1.14, abs=0.1)


def test_what_is_seen_past_a_particle_is_the_pixel_nearest_to_it():
    view = view_of(wall(5.0))
    view.depth[:, 100] = 1.5  # a pole
    k = view.intrinsics
    still = np.zeros(3)
    for column, seen in ((99.6, False), (100.4, False), (99.4, True), (100.6, True), (-0.6, False)):
        place = np.array([(column - k.cx) * 2.0 / k.fx, 0.0, 2.0])
        one = HiddenCloud(place, still, still, still, 1, np.random.default_rng(1))
        assert one._seen_empty(view, 0.0).tolist() == [seen]


def test_who_is_hidden_behind_a_camera_that_turned_away_is_where_he_was():
    """He was put before the camera, wherever it looked, and there he was when it turned back."""
    hidden = cloud()
    there, _ = hidden.believed
    half, _ = cv2.Rodrigues(np.array([0.0, np.pi, 0.0]))
    turn = Pose(half, np.zeros(3))
    hidden.carried(turn)
    for _ in range(5):
        hidden.move(0.01)
        hidden.weigh(0.01, view_of(wall(5.0)), 0.5)
    assert hidden.believed[0][2] < -2.0
    hidden.carried(turn)
    assert hidden.believed[0] == pytest.approx(there, abs=0.1)


# -- the body -------------------------------------------------------------------------------------


def placed(cut_bottom: bool) -> tuple[Body, np.ndarray]:
    depth = wall()
    depth[40:120, 100:130] = 2.0
    view = view_of(depth)
    body = Body(Silhouette.of(view, 100, 40, depth[40:120, 100:130] == 2.0, 1, Rim()))
    bottom = 120
    if cut_bottom:
        depth[80:, 60:180] = 1.0
        bottom = 80
    mask = depth[40:bottom, 100:130] == 2.0
    seen = Silhouette.of(view_of(depth), 100, 40, mask, 1, Rim())
    result = body.place(seen, np.array([-0.05, -0.4, 2.0]))
    return body, np.array([*result.position, result.fraction])


def test_body_is_placed_by_the_sides_that_show():
    body, whole = placed(cut_bottom=False)
    assert body.height == pytest.approx(0.8)
    assert whole == pytest.approx([-0.055, -0.405, 2.0, 1.0], abs=1e-6)
    _, half = placed(cut_bottom=True)
    assert half[:3] == pytest.approx(whole[:3], abs=1e-6)
    assert half[3] == pytest.approx(0.5)


def test_body_does_not_grow_into_its_neighbour():
    depth = wall()
    depth[40:120, 100:130] = 2.0
    first = Silhouette.of(view_of(depth), 100, 40, depth[40:120, 100:130] == 2.0, 1, Rim())
    body = Body(first)
    depth[40:120, 100:220] = 2.0
    merged = Silhouette.of(view_of(depth), 100, 40, depth[40:120, 100:220] == 2.0, 1, Rim())
    for _ in range(30):
        body.learn_size(merged, 1 / 30)
    assert body.area < 2 * first.area


# -- the look -------------------------------------------------------------------------------------


def test_masked_filter_answers_with_the_shift():
    image, features = blobs(1, 400), PatchFeatures(32)

    def read(x: float, y: float) -> Spectrum:
        return spectrum_of(features(resampled(image, x, y, 128, 128)))

    learned = MaskedFilter(32, 1.2)
    mask = np.zeros((32, 32), np.float32)
    mask[10:22, 12:20] = 1
    learned.learn(read(200, 200), mask, 1.0)
    for dx, dy in ((0, 0), (8, -4), (-12, 20)):
        response = learned.response(read(200 + dx, 200 + dy))
        row, col = np.unravel_index(int(np.argmax(response)), response.shape)
        found = ((col + 16) % 32 - 16) * 4, ((row + 16) % 32 - 16) * 4
        assert found == (-dx, -dy)


@pytest.mark.parametrize('factor', [0.96, 1.0, 1.05])
def test_scale_filter_finds_the_factor(factor: float):
    image = blobs(2, 300)
    scales = ScaleFilter(60, 90)
    scales.learn(image, 150, 150, 60, 90, 1.0)
    larger = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_LINEAR)
    found = scales.factor(larger, 150 * factor, 150 * factor, 60, 90)
    assert found == pytest.approx(factor, rel=0.03)


def beside(middle: np.ndarray, width: int, height: int, cx: float, cy: float) -> np.ndarray:
    """An image in which a patch is drawn at that size, before a wall of another texture."""
    image = blobs(8, 320) // 2
    drawn = cv2.resize(middle, (width, height), interpolation=cv2.INTER_LINEAR)
    left, top = round(cx - width / 2), round(cy - height / 2)
    image[top : top + height, left : left + width] = drawn
    return image


@pytest.mark.parametrize(
    ('width', 'height', 'growth'), [(84, 108, 1.2), (56, 72, 0.8), (70, 80, 1.0), (70, 90, 1.0)]
)
def test_flow_tells_shift_and_growth_but_not_a_crouch(width: int, height: int, growth: float):
    patch = blobs(3, 160)
    flow = TextureFlow()
    assert flow.since(patch) is None
    first = beside(patch, 70, 90, 150, 150)
    flow.keep(first, 150, 150, 70, 90, lambda image: np.ones(image.shape[:2], np.float32))
    told = flow.since(beside(patch, width, height, 160, 144))
    assert told is not None
    assert told.growth == pytest.approx(growth, abs=0.03)
    assert (told.dx, told.dy) == pytest.approx((10, -6), abs=2.5)
    assert flow.since(blobs(11, 320)) is None
    flow.forget()
    assert flow.since(beside(patch, width, height, 160, 144)) is None


def test_a_target_that_comes_fast_is_followed_on_colour_alone():
    """At 10 Hz and 22 % a frame it grows by more than the filter over scale covers."""
    patch, sizes = blobs(3, 240), [40 * 1.22**n for n in range(9)]
    frames = [
        Frame(beside(patch, round(s), round(1.2 * s), 150, 150), None, n * 100_000_000)
        for n, s in enumerate(sizes[:8])
    ]
    look = ByLook(frames[0], Box.from_center(150, 150, 40, 48), MetricParameters())
    for frame, size in zip(frames[1:], sizes[1:], strict=False):
        found = look.step(frame, 0.1)
        assert found is not None
        look.take(frame, found, 0.1)
        look.settle()
        assert found.box.iou(Box.from_center(150, 150, size, 1.2 * size)) > 0.6


def test_a_place_is_unchanged_where_it_looks_as_it_did_while_the_target_was_elsewhere():
    wall, target = np.full((60, 80, 3), 90, np.uint8), np.full((30, 10, 3), 200, np.uint8)

    def at(column: int) -> tuple[np.ndarray, Box]:
        image = wall.copy()
        image[20:50, column : column + 10] = target
        return image, Box(column, 20, 10, 30)

    elsewhere = Elsewhere()
    assert not elsewhere.unchanged(*at(10))
    elsewhere.keep(*at(10))
    assert not elsewhere.unchanged(*at(10))
    assert not elsewhere.unchanged(*at(50))
    assert elsewhere.unchanged(at(50)[0], at(30)[1])
    assert not elsewhere.unchanged(at(50)[0], at(10)[1])  # what he covered is not known
    for column in (20, 70):
        elsewhere.keep(*at(column))
    assert elsewhere.unchanged(at(50)[0], at(10)[1])  # by the last
    assert elsewhere.unchanged(at(50)[0], at(70)[1])  # by the first
    assert not elsewhere.unchanged(np.roll(at(50)[0], 9, 2), Box(200, 200, 5, 5))
    assert not elsewhere.unchanged(at(50)[0][:, :70], at(30)[1])
    elsewhere.forget()
    assert not elsewhere.unchanged(at(50)[0], at(30)[1])
    elsewhere.refuse(at(50)[0], at(30)[1])
    assert elsewhere.unchanged(at(70)[0], at(30)[1])
    assert not elsewhere.unchanged(*at(30))  # it has come there
    assert not elsewhere.unchanged(at(70)[0], at(10)[1])  # nothing was said of that place
    elsewhere.keep(*at(50))
    elsewhere.keep(*at(30))
    assert not elsewhere.unchanged(*at(30))


def test_on_colour_alone_what_always_stood_there_is_not_the_target():
    """Its picture hangs on the wall; when it has gone, that is the likest there is."""
    patch, wall = blobs(3, 60), blobs(8, 320) // 2
    wall[40:100, 220:280] = patch

    def at(i: int, shown: bool) -> Frame:
        image = wall.copy()
        if shown:
            image[200:260, 30 + 4 * i : 90 + 4 * i] = patch
        return Frame(image, None, i * 100_000_000)

    look = ByLook(at(0, True), Box(30, 200, 60, 60), MetricParameters())
    for i in range(1, 16):
        found = look.step(at(i, i < 10), 0.1)
        assert (found is not None) == (i < 10)
        if found is not None:
            look.take(at(i, True), found, 0.1)
            look.settle()
    found = look.step(at(16, True), 0.1)
    assert found is not None
    assert found.box.iou(Box(94, 200, 60, 60)) > 0.7


def test_nothing_is_learned_of_what_is_refused_and_it_is_not_found_again_until_it_changes():
    """Where the target was shows something nearly as likely, which depth says is not it."""
    patch, wall, box = blobs(3, 60), blobs(8, 320) // 2, Box(130, 130, 60, 60)
    alike = cv2.addWeighted(patch, 0.7, blobs(21, 60), 0.3, 0)

    def at(i: int, what: np.ndarray) -> Frame:
        image = wall.copy()
        image[130:190, 130:190] = what
        return Frame(image, None, i * 1_000_000_000)

    look = ByLook(at(0, patch), box, MetricParameters())
    before = look.glance(at(0, patch), box, 1.0, goes_on=True)
    found = look.step(at(1, alike), 1.0)
    assert before is not None
    assert found is not None
    assert found.ratio > MetricParameters().seen_ratio
    look.refuse(at(1, alike), found)
    for i in (2, 3):
        assert look.step(at(i, alike), 1.0) is None
    found = look.step(at(4, patch), 1.0)
    assert found is not None
    assert found.box.iou(box) > 0.9
    assert found.ratio == pytest.approx(before.ratio, rel=0.05)


def test_what_was_refused_is_not_where_the_target_is_sought_from_then_on(
    monkeypatch: pytest.MonkeyPatch,
):
    """It was sought about the stranger that depth had told from it, and not where it was lost."""
    patch = blobs(20, 60)

    def at(i: int, x: int) -> Frame:
        image = np.full((300, 300, 3), 90, np.uint8)
        image[130:190, x : x + 60] = patch
        return Frame(image, None, i * 100_000_000)

    look = ByLook(at(0, 130), Box(130, 130, 60, 60), MetricParameters())
    found = look.step(at(1, 155), 0.1)
    assert found is not None
    assert found.box.x == pytest.approx(155, abs=3)
    look.refuse(at(1, 155), found)
    asked, look_at = [], ByLook._look_at

    def watched(self: ByLook, frame: Frame, cx: float, cy: float):
        asked.append((cx, cy))
        return look_at(self, frame, cx, cy)

    monkeypatch.setattr(ByLook, '_look_at', watched)
    look.step(at(2, 155), 0.1)
    assert asked[0] == (160, 160)


def test_who_asks_for_colours_gets_what_was_put_off_as_well():
    wall, box, mask = np.full((300, 300, 3), 90, np.uint8), Box(130, 130, 60, 60), np.ones((60, 60))
    frames = []
    for i, grey in enumerate((60, 80)):  # another of the levels that are told apart
        image = wall.copy()
        image[130:190, 130:190] = blobs(3, 60) // 2
        image[150:170, 150:170] = grey
        frames.append(Frame(image, None, round(1e9 * i)))
    likely = []
    for settles in (True, False):
        look = ByLook(frames[0], box, MetricParameters())
        asked = np.full((60, 60, 3), 80, np.uint8)
        before = float(look.own(asked)[mask > 0].mean())
        found = look.step(frames[1], 1.0)
        assert found is not None
        look.take(frames[1], found, 1.0)
        if settles:
            look.settle()
        likely.append(float(look.own(asked)[mask > 0].mean()))
        assert likely[-1] > before
    assert likely[0] == likely[1]


def test_windows_reach_outside_the_image_and_shrink_large_ones():
    image = blobs(3, 200)
    for cx, cy, side in ((0, 0, 64), (500, -300, 64), (100, 100, 900), (100, 100, 10)):
        assert resampled(image, cx, cy, side, 96).shape == (96, 96, 3)
    whole = resampled(image, 100, 100, 100, 100)
    assert np.abs(whole.astype(int) - image[50:150, 50:150]).max() <= 1
    assert rgb_codes(whole).max() < 4096


def test_a_look_that_is_hidden_while_the_images_change_their_size_is_found_again():
    """It was sought at the size in pixels that it had in the images before."""
    rng = np.random.default_rng(0)
    room = cv2.resize(rng.integers(90, 130, (24, 32, 3), np.uint8), (640, 480))
    thing = np.kron(rng.integers(0, 255, (6, 6, 3), np.uint8), np.ones((10, 10, 1), np.uint8))
    box = Box(290, 210, 60, 60)

    def at(step: int, shows: bool, half: bool = False) -> Frame:
        color, depth = room.copy(), np.full((480, 640), 3.0, np.float32)
        if shows:
            color[210:270, 290:350], depth[210:270, 290:350] = thing, 2.0
        if half:
            color = cv2.resize(color, (320, 240), interpolation=cv2.INTER_AREA)
            depth = depth[::2, ::2]
        return Frame(color, depth, step * 10**8)

    tracker = ByLook(at(0, True), box, MetricParameters())
    for step in range(1, 4):
        look = tracker.step(at(step, True), 0.1)
        assert look is not None
        tracker.take(at(step, True), look, 0.1)
        tracker.settle()
    assert tracker.step(at(4, False, half=True), 0.1) is None
    look = tracker.step(at(5, True, half=True), 0.1)
    assert look is not None
    assert look.box.iou(Box(145, 105, 30, 30)) > 0.9


def test_a_glance_finds_the_target_and_learns_nothing():
    image, box = blobs(4, 300), Box(120, 110, 50, 70)
    first = Frame(image, None, 0)
    look = ByLook(first, box, MetricParameters())
    before = look.glance(first, box, 0.03, goes_on=False)
    assert before is not None
    assert before.box.iou(box) > 0.9
    faded = cv2.addWeighted(image, 0.6, blobs(5, 300), 0.4, 0)
    for i in range(1, 20):
        assert look.glance(Frame(faded, None, i), box, 0.1, goes_on=False) is not None
    assert look.glance(first, box, 0.03, goes_on=False) == before


def test_who_is_looked_at_may_turn_round_before_the_eyes_but_not_meanwhile():
    """He was lost as he turned, a hundredth below what somebody is found again by."""
    image, box = blobs(4, 300), Box(120, 110, 50, 70)
    look = ByLook(Frame(image, None, 0), box, MetricParameters())
    turned = Frame(cv2.addWeighted(image, 0.3, blobs(5, 300), 0.7, 0), None, 1)
    assert look.glance(turned, box, 0.1, goes_on=False) is None
    ratio, parameters = look.response, MetricParameters()
    assert ratio is not None
    assert parameters.hidden_ratio < ratio < parameters.seen_ratio
    assert look.glance(turned, box, 0.1, goes_on=True) is not None


# -- the verdict ----------------------------------------------------------------------------------


def test_evidence_speaks_for_what_fits_and_against_what_does_not():
    assert len(GOOD.features()) == len(WEIGHTS)
    assert probability(GOOD) > 0.95
    for worse in (
        {'step': 60.0, 'stride': 12.0, 'assigned': 0},
        {'look': -4.0, 'mine': -4.0, 'gone': 3.0, 'assigned': 0},
        {'look': -4.0, 'mine': -4.0, 'rival': 6.0, 'assigned': -1},
        {'fraction': 0.05, 'look': 0.0, 'mine': 0.0, 'assigned': 0},
        {'gone': 4.0, 'look': -2.0, 'mine': -2.0, 'rival': 4.0, 'assigned': -1},
    ):
        assert probability(dataclasses.replace(GOOD, **worse)) < 0.5, worse


def test_looks_say_no_more_than_in_what_the_weights_were_fitted_to():
    """A mug that is carried was lost to something else of its colours, at 5 Hz."""
    doubtful = dataclasses.replace(GOOD, step=60.0, stride=12.0, assigned=0)
    chances = [probability(dataclasses.replace(doubtful, look=look)) for look in (2.0, 3.0, 4.0)]
    assert chances[0] < chances[1] == chances[2]


def test_a_rival_counts_only_as_far_as_he_explains_better():
    assert GOOD.behind == 0
    assert dataclasses.replace(GOOD, rival=4.0).behind == 0
    assert dataclasses.replace(GOOD, rival=8.0).behind == pytest.approx(3.0)
    assert dataclasses.replace(GOOD, mine=-2.0, rival=1.0).behind == pytest.approx(1.0)
