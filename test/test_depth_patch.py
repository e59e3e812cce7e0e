# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from rgbd_kcf_tracker import Box
from rgbd_kcf_tracker.thesis.centre_patch import GRID, centre_patch
from rgbd_kcf_tracker.thesis.depth_aware import DepthParameters
from rgbd_kcf_tracker.thesis.depth_patch import DepthDifference, DepthPatch, trim

Depth = npt.NDArray[np.float32]

TARGET, WALL, OCCLUDER = 3.0, 5.0, 2.0
BOX = Box(100, 60, 64, 160)
PARAMETERS = DepthParameters()


def scene(target: float = TARGET, shift: int = 0) -> Depth:
    """A person-shaped plane before a wall, with a little noise."""
    depth = np.full((300, 320), WALL, np.float32)
    left, top = int(BOX.x) + shift, int(BOX.y)
    # The silhouette fills the middle half of its box.
    depth[top : top + int(BOX.height), left + 16 : left + 48] = target
    noise = np.random.default_rng(4).normal(0, 0.01, depth.shape)
    return (depth + noise).astype(np.float32)


def memory(depth: Depth | None = None) -> DepthPatch:
    p = PARAMETERS
    patch = DepthPatch(p.trim_above, p.most_trim, p.walking_speed, p.depth_cap)
    patch.remember(centre_patch(scene() if depth is None else depth, BOX, p.center_share))
    return patch


def difference(
    patch: DepthPatch, depth: Depth, interval: float = 1 / 30, box: Box = BOX
) -> DepthDifference:
    result = patch.diff_at_centre(centre_patch(depth, box, PARAMETERS.center_share), interval)
    assert result is not None
    return result


def occluded(found: DepthDifference) -> bool:
    return found.nearer >= PARAMETERS.depth_threshold or found.farther > PARAMETERS.gone_share


def test_the_grid_samples_the_middle_of_the_box() -> None:
    depth = np.arange(40 * 60, dtype=np.float32).reshape(40, 60) / 64 + 1
    patch = centre_patch(depth, Box(10, 4, 32, 32), 0.5)
    assert patch.shape == GRID
    # Rows 12 to 27 and columns 18 to 33 are the middle half.
    assert patch[0, 0] == depth[12, 18]
    assert patch[-1, -1] == depth[27, 33]


def test_no_reading_is_nan_and_outside_is_far() -> None:
    depth = np.full((40, 60), 2.0, np.float32)
    depth[10:20] = 0
    depth[20:22] = np.nan
    patch = centre_patch(depth, Box(-20, 0, 40, 40), 1.0)
    assert np.isinf(patch[:, :8]).all()
    assert np.isnan(patch[7:12, 8:]).all()
    assert (patch[14:, 8:] == 2).all()
    assert np.isinf(centre_patch(depth, Box(500, 500, 40, 40), 1.0)).all()


def test_trimming_is_bounded_and_starts_at_the_edges() -> None:
    high = np.array([1, 1, 0, 1, 0, 0, 1, 1, 1, 1], bool)
    assert trim(high, 3) == slice(2, 7)
    assert trim(high, 1) == slice(1, 9)
    assert trim(np.ones(10, bool), 4) == slice(4, 6)
    assert trim(np.zeros(10, bool), 4) == slice(0, 10)


def test_the_same_scene_does_not_differ() -> None:
    found = difference(memory(), scene())
    assert found.value < 0.01
    assert (found.rows, found.cols) == (slice(0, GRID[0]), slice(0, GRID[1]))


@pytest.mark.parametrize('shift', [-7, -4, 4, 7])
def test_a_shifted_silhouette_is_trimmed_and_hides_nothing(shift: int) -> None:
    # Figure 4.3: background enters at one edge of the patch, and is cut away there.
    found = difference(memory(), scene(shift=shift))
    assert found.value < 0.02
    assert not occluded(found)
    if shift > 0:
        assert found.cols.start > 0
        assert found.cols.stop == GRID[1]
    else:
        assert found.cols.start == 0
        assert found.cols.stop < GRID[1]


@pytest.mark.parametrize('side', ['left', 'right', 'top', 'bottom'])
@pytest.mark.parametrize('hz', [5, 30])
def test_an_occluder_that_enters_from_a_side_hides_the_target(side: str, hz: int) -> None:
    patch = memory()
    hidden_at = None
    width, height = int(BOX.width), int(BOX.height)
    for percent in range(0, 101, 4):
        depth = scene()
        across, down = width * percent // 100, height * percent // 100
        area = {
            'left': np.s_[60 : 60 + height, 100 : 100 + across],
            'right': np.s_[60 : 60 + height, 100 + width - across : 100 + width],
            'top': np.s_[60 : 60 + down, 100 : 100 + width],
            'bottom': np.s_[60 + height - down : 60 + height, 100 : 100 + width],
        }[side]
        depth[area] = OCCLUDER
        found = difference(patch, depth, 1 / hz)
        if occluded(found):
            hidden_at = percent
            break
        # As the trackers do while they go on: the target's own motion, or what looks like it.
        patch.follow(found, 1 / hz)
    assert hidden_at is not None
    assert 40 <= hidden_at <= 80


@pytest.mark.parametrize('hz', [5, 15, 30])
@pytest.mark.parametrize('speed', [-1.5, 1.5])
@pytest.mark.parametrize('remembers', [True, False])
def test_a_target_that_walks_in_depth_is_not_hidden(hz: int, speed: float, remembers: bool) -> None:
    patch = memory()
    for step in range(1, hz + 1):
        depth = scene(TARGET - speed * step / hz)
        found = difference(patch, depth, 1 / hz)
        assert not occluded(found), step
        assert found.value < 0.05
        if remembers:
            patch.remember(centre_patch(depth, BOX, PARAMETERS.center_share), 1 / hz)
        else:
            patch.follow(found, 1 / hz)
    assert patch.depth == pytest.approx(TARGET - speed, abs=0.03)


def test_a_standing_target_does_not_leap() -> None:
    # At 5 Hz a walker could have come the 0.4 m; somebody who stood still could not.
    patch = memory()
    for _ in range(4):
        patch.remember(centre_patch(scene(), BOX, PARAMETERS.center_share), 0.2)
    depth = scene()
    depth[60:220, 100:164] = TARGET - 0.4
    assert occluded(difference(patch, depth, 0.2))


def test_something_that_appears_all_at_once_is_no_walk() -> None:
    depth = scene()
    depth[60:220, 100:164] = OCCLUDER
    assert occluded(difference(memory(), depth, 1 / 30))


def test_background_in_the_first_box_is_not_the_targets() -> None:
    # More than half of the patch shows the wall: it neither hides the target nor is it missed.
    wide = Box(BOX.x - 64, BOX.y, 192, BOX.height)
    depth = scene()
    patch = DepthPatch(0.2, 0.25, 2.0, 0.5)
    patch.remember(centre_patch(depth, wide, 0.5))
    assert patch.depth == pytest.approx(TARGET, abs=0.05)
    nearer_wall = scene()
    nearer_wall[nearer_wall > 4] = 2.0
    assert not occluded(difference(patch, nearer_wall, box=wide))
    assert occluded(difference(patch, np.full((300, 320), WALL, np.float32), box=wide))


def test_a_target_that_went_away_is_not_there() -> None:
    empty = np.full((300, 320), WALL, np.float32)
    assert occluded(difference(memory(), empty))
    assert occluded(difference(memory(), empty, box=Box(900, 60, 64, 160)))


@pytest.mark.parametrize('hole', [0.0, np.nan])
def test_holes_never_count(hole: float) -> None:
    holes = np.random.default_rng(1).random((300, 320)) < 0.6
    depth = scene()
    depth[holes] = hole
    assert difference(memory(), depth).value < 0.02
    assert difference(memory(depth), scene()).value < 0.02
    # An occluder is seen between them.
    hidden = scene()
    hidden[60:220, 100:164] = OCCLUDER
    hidden[holes] = hole
    assert occluded(difference(memory(), hidden))


def test_without_readings_depth_says_nothing() -> None:
    nothing = np.full((300, 320), np.nan, np.float32)
    patch = memory()
    empty = centre_patch(nothing, BOX, PARAMETERS.center_share)
    assert patch.diff_at_centre(empty, 0.1) is None
    patch.remember(empty)
    assert difference(patch, scene()).value < 0.01
    fresh = DepthPatch(0.2, 0.25, 2.0, 0.5)
    assert fresh.depth is None
    assert fresh.diff_at_centre(centre_patch(scene(), BOX, 0.5), 0.1) is None


def test_one_pixel_cannot_decide() -> None:
    depth = scene()
    depth[130:134, 130:134] = 0.3
    assert difference(memory(), depth).value < 0.05


@pytest.mark.parametrize('near', range(1, 20))
def test_a_target_has_a_distance_whatever_part_of_its_box_is_nearer(near: int) -> None:
    """Between two surfaces there is no reading."""
    depth = np.full((5, 4), WALL, np.float32)
    depth.flat[:near] = OCCLUDER
    patch = DepthPatch(trim_above=0.2, most_trim=0.25, walking_speed=2.0, cap=0.5)
    patch.remember(depth)
    assert patch.depth in (OCCLUDER, WALL)
