# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Who is who: views and galleries, one person, and everyone explained together."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Sequence

import cv2
import numpy as np
import pytest
from people_rig import (
    BLACK,
    BLUE,
    CAMERA,
    COLS,
    DARK_RED,
    GREEN,
    GREY,
    RED,
    ROWS,
    TOP,
    WALL,
    Someone,
    images,
    picture,
    texture,
)

from rgbd_kcf_tracker import Box, Frame, create_tracker
from rgbd_kcf_tracker.arrays import Image
from rgbd_kcf_tracker.insight import of_metric
from rgbd_kcf_tracker.metric import follower
from rgbd_kcf_tracker.metric.by_look import ByLook, Look
from rgbd_kcf_tracker.metric.by_surface import BySurface
from rgbd_kcf_tracker.metric.decide import evidence
from rgbd_kcf_tracker.metric.decide.account import REUNION, SMALL, Account, look_of
from rgbd_kcf_tracker.metric.decide.arrivals import (
    GONE,
    RETURN,
    Arrival,
    Arrivals,
    away,
    bounded,
    is_new,
)
from rgbd_kcf_tracker.metric.decide.association import NEW
from rgbd_kcf_tracker.metric.decide.crowd import MOST_PEOPLE, NEW_AREA, Crowd
from rgbd_kcf_tracker.metric.decide.mix_ups import HIDDEN_FOR, Followed, MixUps
from rgbd_kcf_tracker.metric.decide.visible_box import box_about
from rgbd_kcf_tracker.metric.drawn import Drawn, view_in
from rgbd_kcf_tracker.metric.gated_look import ELSEWHERE
from rgbd_kcf_tracker.metric.identity.appearance import Appearance
from rgbd_kcf_tracker.metric.identity.calm import Calm
from rgbd_kcf_tracker.metric.identity.comeback import BORNE_OUT, EVEN, Comeback
from rgbd_kcf_tracker.metric.identity.embedding import Described
from rgbd_kcf_tracker.metric.identity.gallery import (
    ALL_SIDES,
    MOST_VIEWS,
    SLICES,
    SUREST_OTHER,
    SUREST_PART,
    SUREST_SAME,
    WHOLE_AREA,
    Compared,
    Gallery,
    Looks,
    View,
    _Learned,
    look_log_odds,
    same_person,
    similarity,
)
from rgbd_kcf_tracker.metric.identity.person import COAST, VELOCITY_TIME, Person
from rgbd_kcf_tracker.metric.identity.relief import Relief
from rgbd_kcf_tracker.metric.identity.stature import (
    LEVEL,
    NEWEST,
    TOLD,
    UPRIGHT,
    Height,
    Stature,
    Tilt,
    height_log_odds,
)
from rgbd_kcf_tracker.metric.identity.stood import (
    CARRIED_OFF,
    CHOSEN_MOVING,
    GAIN,
    SUDDENLY,
    Stood,
)
from rgbd_kcf_tracker.metric.identity.tally import SUREST, Heard, logit
from rgbd_kcf_tracker.metric.initialisation import surface_of
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.perceive.colors import (
    CODES,
    LIGHTNESS,
    TINTS,
    ColorCodes,
    color_codes,
    palette,
)
from rgbd_kcf_tracker.metric.perceive.depth_view import DepthView
from rgbd_kcf_tracker.metric.perceive.ego_motion import Lost
from rgbd_kcf_tracker.metric.perceive.figures import find_figures
from rgbd_kcf_tracker.metric.perceive.scene import Scene, SceneReader
from rgbd_kcf_tracker.metric.perceive.silhouette import Rim, Sides, Silhouette
from rgbd_kcf_tracker.metric.perceive.upright import person_sized
from rgbd_kcf_tracker.metric.targets import MetricTargets
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.targets import TargetSet
from rgbd_kcf_tracker.track import Track, TrackState

# -- looks ----------------------------------------------------------------------------------------


def without_colors(color: Image, quality: int = 95) -> Image:
    """A picture as a camera of infrared light gives it, through JPEG."""
    grey = cv2.cvtColor(cv2.cvtColor(color, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    return cv2.imdecode(cv2.imencode('.jpg', grey, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 1)


def look(
    shirt,
    trousers=BLACK,
    z: float = 2.5,
    top: float | None = None,
    rows: float = 1.0,
    grey: bool = False,
) -> View:
    """The view of somebody at ``z``; ``rows`` is the share from the top that is not hidden."""
    color, depth = images([Someone(0.0, z, shirt, trousers)])
    color = without_colors(color) if grey else color
    mask = depth < WALL
    y, x = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    bottom = y[0] + round(rows * (y[-1] + 1 - y[0]))
    crop = mask[y[0] : bottom, x[0] : x[-1] + 1]
    view = DepthView(depth, 1, CAMERA)
    seen = Silhouette.of(view, int(x[0]), int(y[0]), crop, 1, Rim())
    return View.of(view, ColorCodes(color), seen, top)


def alike(first: View, second: View) -> float:
    return float(similarity(first, Looks.of([second]))[0])


def test_stronger_light_moves_lightness_and_leaves_the_tint():
    color = np.full((4, 4, 3), (80, 90, 120), np.uint8)
    dark, bright = color_codes(color)[0, 0], color_codes(2 * color)[0, 0]
    assert bright % (TINTS * TINTS) == dark % (TINTS * TINTS)
    assert 2 <= bright // (TINTS * TINTS) - dark // (TINTS * TINTS) <= 3


def test_the_palette_shows_each_code_in_a_colour_that_has_it():
    colors = palette()
    inside = ((colors > 0) & (colors < 255)).all(axis=1)
    # Codes that no colour of 8 bits has are shown by what is nearest.
    codes = color_codes(np.rint(colors[None]).astype(np.uint8))[0]
    assert np.mean(codes[inside] == np.flatnonzero(inside)) > 0.9
    assert len(colors) == CODES


def test_a_view_is_wholly_like_itself_and_unlike_other_colours():
    red = look(RED)
    assert alike(red, red) == pytest.approx(1.0, abs=1e-5)
    assert alike(red, look(GREEN, GREY)) < 0.4
    assert same_person(red, red) > 0.9
    assert same_person(red, look(GREEN, GREY)) < 0.2


def test_a_view_does_not_depend_on_distance():
    assert alike(look(RED, z=2.0), look(RED, z=4.0)) > 0.9
    assert alike(look(RED, z=2.0), look(RED, z=4.0)) > alike(look(RED), look(BLUE)) + 0.2


def test_the_same_shirt_in_the_shade_is_still_the_same():
    red, shade, other = look(RED), look(DARK_RED), look(BLUE)
    assert alike(red, shade) > alike(red, other) + 0.2
    assert same_person(red, shade) > 0.5


def test_parts_are_compared_with_the_same_parts():
    whole, upper = look(RED, GREEN), look(RED, GREEN, rows=0.5)
    assert upper.total < 0.7 * whole.total
    assert alike(upper, whole) > 0.95
    # The other way round: red trousers are no red shirt.
    assert alike(look(RED, GREEN), look(GREEN, RED)) < 0.5


@pytest.mark.parametrize('floor', [True, False])
def test_who_stands_before_the_pictures_upper_end_is_compared_from_where_his_head_is(floor: bool):
    def seen(z: float) -> View:
        reader = SceneReader(COLS, 0.04, 0.03, 0.0)
        for i in range(5):
            scene = reader.read(picture([Someone(0.0, z)] if i > 3 else [], 0.1 * i), 0.1)
        assert scene is not None
        if floor:  # 1.65 m below the head
            rows = np.arange(ROWS, dtype=np.float32)[:, None]
            above = 0.9 - (rows - CAMERA.cy) * scene.view.depth / CAMERA.fy
            scene = dataclasses.replace(scene, elevation=above.astype(np.float32))
        (figure,) = find_figures(scene, np.zeros((0, 2)))
        return look_of(scene, figure.seen)

    far, near = seen(3.0), seen(1.0)
    assert near.top is None
    assert (alike(near, far) > 0.95) == floor


@pytest.mark.parametrize('head', [True, False])
def test_who_shows_beside_the_end_of_depth_is_compared_from_where_his_head_is(head: bool):
    """Of who comes in, a shoulder is the first that is read; it is no head."""

    def seen(end: float) -> tuple[View, float]:
        reader, one = SceneReader(COLS, 0.04, 0.03, 0.0), Someone(0.0, 2.6, RED, GREEN)
        for i in range(5):
            color, depth = images([one] if i > 3 else [])
            depth[:, round(end * CAMERA.fx / 2.6 + CAMERA.cx) :] = np.nan
            frame = Frame(color, depth, round(1e8 * i), CAMERA)
            scene = reader.read(frame, 0.1)
        assert scene is not None
        rows = np.arange(ROWS, dtype=np.float32)[:, None]
        above = 0.9 - (rows - CAMERA.cy) * scene.view.depth / CAMERA.fy
        scene = dataclasses.replace(scene, elevation=above.astype(np.float32))
        (figure,) = find_figures(scene, np.zeros((0, 2)))
        return look_of(scene, figure.seen), figure.seen.width

    whole, _ = seen(1.0)
    beside, wide = seen(0.02 if head else -0.12)
    assert wide < 0.3
    assert beside.top is None  # there may be more of him beyond
    assert whole.top is not None
    assert alike(beside, whole) > 0.95


def test_who_is_chosen_with_his_head_hidden_is_known_from_where_the_box_begins():
    one = Someone(0.0, 3.0, RED, GREEN)
    views = []
    for board in (None, Box(90, 20, 60, 32)):
        targets = TargetSet('metric')
        color, depth = images([one], board)
        number = targets.add(Frame(color, depth, 0, CAMERA), one.box)
        assert targets.metric is not None
        (view,) = targets.metric.person(number).gallery.views
        views.append(view)
    whole, hidden = views
    assert hidden.total < 0.9 * whole.total
    assert alike(hidden, whole) > 0.95


def part_of(view: View, slices: slice) -> View:
    """A view of which only some slices show."""
    area = np.zeros_like(view.area)
    area[slices] = view.area[slices]
    return dataclasses.replace(view, area=area)


@pytest.mark.filterwarnings('error')
def test_views_without_common_parts_say_nothing():
    """Of whom only the upper half had been seen, his legs were held to be somebody else's."""
    view = look(RED, GREEN)
    assert view.roots.shape[0] == SLICES
    head, legs, empty = (part_of(view, rows) for rows in (np.s_[:3], np.s_[4:], np.s_[:0]))
    for one, other in ((head, legs), (legs, head), (view, empty), (empty, view)):
        assert same_person(one, other) == 0.5
        gallery = Gallery.of(one, 0.0)
        assert gallery.looks is not None
        before = gallery.log_odds_before(1.0, other, Compared.of(other, gallery.looks).likeness)
        assert gallery.log_odds(other) == before == 0.0
        assert math.isnan(alike(one, other))
        gallery.learn(other, 0.0)
        assert gallery.views == [one, other], 'it shows what was not known'
        before = gallery.log_odds_before(1.0, other, Compared.of(other, gallery.looks).likeness)
        assert before is not None
        assert (before == 0.0) if other is empty else (before > 1)
    gallery = Gallery()
    views = [look(GREY), head, legs, look(BLUE), look(BLUE)]
    gallery._set_learned([_Learned(each, 0.0) for each in views])
    assert gallery._most_redundant() == 3, 'it says the same as the next'
    gallery._set_learned([_Learned(each, n, -1.0 * (n == 1)) for n, each in enumerate(views)])
    assert gallery._most_redundant() == 1, 'it is the least trusted'


def test_many_views_are_compared_as_each_is_alone():
    rng = np.random.default_rng(0)
    paints = rng.integers(20, 220, (2, 90, 3)).tolist()
    views = [look(tuple(a), tuple(b)) for a, b in zip(*paints, strict=True)]
    together = Compared.of(views[0], Looks.of(views)).alike
    alone = [Compared.of(views[0], Looks.of([each])).alike[0] for each in views]
    np.testing.assert_allclose(together, alone, atol=1e-6)


def test_log_odds_of_a_look_rise_with_likeness_and_are_bounded():
    odds = [look_log_odds(a, 1.0, 5) for a in np.linspace(0, 1, 21)]
    assert odds == sorted(odds)
    assert odds[0] == pytest.approx(SUREST_OTHER)
    assert odds[-1] <= SUREST_SAME
    # One view leaves another side open, and the best of many is more alike whosever they are.
    assert look_log_odds(0.0, 1.0, 1) > SUREST_OTHER
    assert look_log_odds(0.8, 1.0, 14) < look_log_odds(0.8, 1.0, 1)
    # A head and shoulders speak for somebody as all of him does, but less against him: they are
    # mixed with what hides the rest. Of what fits in the hands little shows either way.
    assert look_log_odds(0.7, 0.1) == look_log_odds(0.7, 0.5) > look_log_odds(0.7, 0.01) > 0
    assert look_log_odds(1.0, 0.1) == SUREST_SAME > 2 * look_log_odds(1.0, 0.01)
    assert look_log_odds(1.0, 0.0) < SUREST_PART < SUREST_SAME
    assert look_log_odds(0.3, 0.5) < look_log_odds(0.3, 0.1) < look_log_odds(0.3, 0.01) < 0


def test_height_speaks_for_the_same_and_against_another():
    assert height_log_odds(None, 1.7) == height_log_odds(1.7, None) == 0.0
    assert height_log_odds(1.72, 1.72) > height_log_odds(1.72, 1.75) > 0
    assert height_log_odds(1.55, 1.85) < -0.3
    # Most people are about as tall, so that it says little for somebody.
    people = np.random.default_rng(0).normal(1.7, 0.1, (2, 20_000))
    odds = [height_log_odds(float(a), float(b)) for a, b in people.T]
    assert float(np.mean(np.exp(odds))) == pytest.approx(1.0, abs=0.1)
    # Somebody may sit down, and that says little; a chair that is no higher than a desk is not he.
    assert height_log_odds(1.3, 1.8) > -0.5
    assert -4 < height_log_odds(0.95, 1.8) < -2.5


def walked(top: float, count: int = 10, distance: float = 3.0, start: float = 0.0) -> Stature:
    """Of somebody who has walked for so many steps."""
    stature = Stature()
    for n in range(count):
        stature.learn(Height(top, distance, start + 0.1 * n, walks=True))
    return stature


def test_nobody_is_taller_than_he_walks_and_who_walks_is_as_tall():
    known = walked(1.7)
    assert known.log_odds(None, 3.0).odds == 0.0
    # Most people are about as tall: a height that fits says as little as before.
    for walks in (1.7, None):
        assert known.log_odds(1.7, 3.0, walks).odds == height_log_odds(1.7, 1.7)
    assert known.log_odds(1.85, 3.0).odds < -2.5
    assert known.log_odds(1.85, 3.0, 1.85).odds < -2.5
    assert known.log_odds(1.55, 3.0, 1.55).odds < -2.5
    # Who has not walked may have bent down, or sit.
    assert known.log_odds(1.55, 3.0).odds == height_log_odds(1.55, 1.7) > -0.5
    # Nor does who walks change; but his head may be hidden.
    assert -2.5 < known.log_odds(1.55, 3.0, 1.7).odds < -2.0
    assert known.log_odds(1.65, 3.0, 1.7).odds == height_log_odds(1.65, 1.7)


def test_how_tall_somebody_walks_is_known_after_some_steps_and_better_after_more():
    few = walked(1.7, TOLD - 1)
    assert few.log_odds(1.85, 3.0).odds == height_log_odds(1.85, 1.7)
    some, many = (walked(1.7, n).log_odds(1.85, 3.0).odds for n in (TOLD, 20))
    assert many < some < height_log_odds(1.85, 1.7)
    # Heights within a tenth of a second are of one step.
    quick = Stature()
    for n in range(TOLD * 2):
        quick.learn(Height(1.7, 3.0, n / 30, walks=True))
    assert quick.log_odds(1.85, 3.0).odds == height_log_odds(1.85, 1.7)
    assert quick.walking_top(0.2) is None
    assert walked(1.7).walking_top(1.0) == 1.7
    assert walked(1.7).walking_top(3.0) is None


def test_a_floor_out_of_true_makes_heights_at_another_distance_say_less():
    known = walked(1.7)
    near, far = (known.log_odds(1.85, distance).odds for distance in (3.0, 5.0))
    assert near < -2.5
    assert far > -1
    known.take(walked(1.7, distance=5.0, start=9.0))
    assert known.log_odds(1.85, 5.0).odds < -2.5
    # What is known of it there is what is held against.
    sloping = walked(1.7)
    sloping.take(walked(1.85, distance=5.0, start=9.0))
    assert sloping.log_odds(1.85, 5.0).odds > 0
    assert sloping.log_odds(1.85, 3.0).odds < -2.5


def test_who_is_higher_than_anybody_sits_is_upright_and_a_hidden_head_is_not_asked():
    standing, sitting = Stature(), Stature()
    for n in range(20):
        standing.learn(Height(1.7, 3.0, 0.1 * n))
        sitting.learn(Height(1.3, 3.0, 0.1 * n))
    assert standing.log_odds(1.85, 3.0).odds < -2.5
    assert standing.walking_top(2.0) is None, 'he has not walked'
    # Who sits may get up.
    assert sitting.log_odds(1.7, 3.0).odds == height_log_odds(1.7, 1.3)
    touching = Stature()
    for n in range(20):
        touching.learn(Height(1.7, 3.0, 0.1 * n, walks=True), alone=False)
    assert touching.log_odds(1.85, 3.0).odds == height_log_odds(1.85, 1.7), 'it may be of another'
    # Farther off than all others he was half hidden.
    hidden = walked(1.7)
    hidden.take(walked(1.4, distance=3.2, start=9.0, count=7))
    assert hidden.log_odds(1.7, 4.0).odds > 0


@pytest.mark.parametrize('slope', [-0.06, 0.0, 0.06])
def test_who_walks_near_and_far_tells_how_far_the_floor_is_out_of_true(slope: float):
    rng = np.random.default_rng(1)
    people = [Stature() for _ in range(3)]
    assert Tilt.told_by(people) == Tilt.told_by([]) == LEVEL
    for height, stature in zip((1.6, 1.7, 1.8), people, strict=True):
        for n, distance in enumerate(np.linspace(2.0, 5.0, 40)):
            top = height + slope * distance + rng.normal(0, 0.02)
            stature.learn(Height(top, float(distance), 0.1 * n, walks=True))
    tilt = Tilt.told_by(people)
    assert tilt.slope == pytest.approx(slope, abs=0.01)
    assert tilt.sigma < LEVEL.sigma / 4
    # Where the floor is known, heights at another distance say as much as at the same.
    near = walked(1.7, 20, distance=2.0)
    far = 1.7 + 3 * slope
    same = near.log_odds(far, 5.0, tilt=tilt).tall
    assert same is not None
    assert same > 1
    assert near.log_odds(far + 0.15, 5.0, tilt=tilt).odds < -2 < near.log_odds(1.85, 5.0).odds


def test_heights_are_bounded_and_a_mistake_of_some_seconds_does_not_replace_them():
    stature = walked(1.7, UPRIGHT * 2)
    for n in range(UPRIGHT * 2):
        stature.learn(Height(1.5, 3.0, 100 + 0.1 * n, walks=True))
    assert len(stature._upright) == UPRIGHT
    assert len(stature._newest) == NEWEST
    assert stature.top == 1.5
    assert stature.log_odds(1.85, 3.0, before=100.0).odds < -2.5
    late = stature.taken_back(100.0)
    assert (stature.top, late.top) == (None, 1.5)
    assert (
        stature.log_odds(1.5, 3.0, walking_top=1.5).odds
        < -2.5
        < late.log_odds(1.5, 3.0, walking_top=1.5).odds
    )


def test_what_one_view_does_not_show_is_as_in_the_others():
    """Who was seen above a desk has not the trousers of anybody, if they are known."""
    upper, whole = look(RED, BLUE, rows=0.5), look(DARK_RED, BLUE)
    looks = Looks.of([upper, whole])
    for trousers in (BLUE, GREEN):
        seen = look(RED, trousers)
        compared = Compared.of(seen, looks)
        assert compared.similarity() == pytest.approx([alike(seen, v) for v in (upper, whole)])
        assert compared.similarity()[0] > 0.95
        assert (compared.of_each([0])[0, 0] > 0.95) == (trousers == BLUE)
    # Each is compared with what is known of himself alone.
    both = Compared.of(look(RED, GREEN), Looks.of([upper, whole, look(RED, GREEN)]))
    assert both.of_each([0, 2])[:, 0] == pytest.approx([compared.of_each([0])[0, 0], 1], abs=1e-4)
    # Where nothing is known of his trousers, they say nothing.
    assert Compared.of(look(RED, GREEN), Looks.of([upper])).of_each([0])[0, 0] > 0.95


def test_a_gallery_learns_what_is_new_keeps_the_first_and_is_bounded():
    gallery = Gallery()
    assert gallery.log_odds(look(RED)) == 0.0
    first = look(RED)
    gallery.learn(first, 0.0)
    gallery.learn(look(RED), 1.0)
    assert len(gallery.views) == 1, 'the same view again adds nothing'
    assert gallery.log_odds(look(GREEN, GREY)) < 0 < gallery.log_odds(look(RED))
    gallery.learn(look(BLUE, GREY), 2.0)
    assert gallery.log_odds(look(BLUE, GREY)) > 0, 'the other side of the jacket'
    hues = cv2.cvtColor(
        np.array([[[12 * i, 220, 200] for i in range(15)]], np.uint8), cv2.COLOR_HSV2BGR
    )[0]
    for shirt in hues:
        for trousers in (BLACK, tuple(int(c) for c in hues[7]), (200, 200, 200)):
            gallery.learn(look(tuple(int(c) for c in shirt), trousers), 3.0)
    assert len(gallery.views) == MOST_VIEWS
    assert gallery.views[0] is first
    assert gallery.looks is not None
    assert len(gallery.looks) == MOST_VIEWS


def test_a_view_of_all_of_him_takes_the_place_of_a_part_that_looks_the_same():
    """The first sliver of somebody stayed his only view, and said of everybody that he was he."""
    all_of_him = look(RED, GREEN)
    part = part_of(all_of_him, np.s_[:4])
    assert part.total < WHOLE_AREA <= all_of_him.total
    for trust, views in ((math.inf, [all_of_him]), (1.0, [all_of_him]), (0.9, [part])):
        gallery = Gallery()
        gallery.learn(part, 0.0, 1.0)
        gallery.learn(all_of_him, 1.0, trust)
        assert gallery.views == views, 'one less sure of him takes no place'
    gallery = Gallery.of(all_of_him, 0.0)
    gallery.learn(part, 1.0)
    assert gallery.views == [all_of_him]
    gallery = Gallery.of(part, 0.0)
    gallery.learn(all_of_him, 5.0)
    assert gallery.taken_back(4.0).views == [all_of_him]
    assert gallery.views == [part], 'it had nothing but what was another'


def test_a_view_that_has_taken_the_place_of_several_gives_all_of_them_back():
    """The last of them alone came back."""
    roots = look(RED, GREEN).roots
    several = [
        dataclasses.replace(look(RED, GREEN), roots=_turned(roots, angle)) for angle in (-25, 25, 0)
    ]
    gallery = Gallery()
    for time, view in enumerate(several):
        gallery.learn(view, float(time), 0.0 if time < 2 else math.inf)
    assert gallery.views == several[2:]
    gallery.taken_back(2.0)
    assert gallery.views == several[:2]


def _turned(roots: np.ndarray, angle: float) -> np.ndarray:
    """Square roots of a histogram, so many degrees away from those of another."""
    other = np.roll(roots, 7 if angle > 0 else 9, axis=2)
    cos, sin = math.cos(math.radians(angle)), abs(math.sin(math.radians(angle)))
    turned = cos * roots + sin * other
    length = np.sqrt(np.square(turned).sum(axis=(1, 2), keepdims=True))
    return np.where(length > 0, turned / np.maximum(length, 1e-6), 0).astype(np.float32)


def test_a_copy_of_a_gallery_learns_for_itself():
    gallery = Gallery()
    gallery.learn(look(RED), 0.0)
    gallery.stature.learn(Height(1.7, 2.0, 0.0))
    same = gallery.copy()
    gallery.learn(look(GREEN), 1.0)
    gallery.stature.learn(Height(1.9, 2.0, 1.0))
    assert (len(same.views), same.stature.top) == (1, 1.7)
    assert (len(gallery.views), gallery.stature.top) == (2, pytest.approx(1.8))
    assert same.log_odds(look(GREEN)) < gallery.log_odds(look(GREEN))


def test_the_height_of_a_gallery_is_a_median_of_the_newest():
    gallery = Gallery()
    assert gallery.stature.top is None
    for time, top in enumerate([1.1, 1.1, *[1.8] * 40, *[1.5] * 40]):
        gallery.stature.learn(Height(top, 2.0, time))
        if time == 41:
            assert gallery.stature.top == pytest.approx(1.8)
    assert gallery.stature.top == pytest.approx(1.5)


def test_what_a_gallery_learned_of_somebody_else_is_taken_back_and_given_to_him():
    gallery, other = Gallery(), Gallery()
    for time, shirt, top in ((0.0, RED, 1.6), (1.0, BLUE, 1.6), (2.0, GREEN, 1.9)):
        gallery.learn(look(shirt), time)
        gallery.stature.learn(Height(top, 2.0, time))
    green = look(GREEN)
    assert gallery.looks is not None
    alike = Compared.of(green, gallery.looks).likeness
    before = gallery.log_odds_before(2.0, green, alike)
    assert before is not None
    assert before < 0 < gallery.log_odds(green)
    assert gallery.log_odds_before(0.0, green, alike) is None

    other.take(gallery.taken_back(2.0))
    assert len(gallery.views) == 2
    assert gallery.log_odds(green) == pytest.approx(before)
    assert gallery.stature.top == pytest.approx(1.6)
    assert len(other.views) == 1
    assert other.log_odds(green) > 0
    assert other.stature.top == pytest.approx(1.9)
    assert Gallery().taken_back(0.0).looks is None


def test_who_is_like_a_doubtful_view_is_no_surer_the_person_than_the_view_is():
    """A stranger in a black sweater was taken for another at 0.7, the next time at 0.98.

    Of the other only the sweater had been seen, and so the stranger's trousers were his.
    """
    gallery, stranger = Gallery(), look(BLACK, GREY)
    gallery.learn(look(BLACK, BLUE), 0.0)
    part = dataclasses.replace(gallery.views[0], area=gallery.views[0].area.copy())
    part.area[4:] = 0  # of the first frame of another walk
    gallery.learn(part, 1.0)
    gallery.learn(stranger, 2.0)
    other = gallery.log_odds(stranger)
    same = gallery.log_odds(look(BLACK, BLUE))
    gallery.doubt(2.0, -1.0)
    told = gallery.log_odds(stranger)
    assert told < min(other, 1.0)
    assert gallery.log_odds(look(BLACK, BLUE)) == pytest.approx(same)
    gallery.doubt(2.0, 3.0)
    assert gallery.log_odds(stranger) == told, 'a doubt stays'
    assert gallery.copy().log_odds(stranger) == told
    # Nor does another become surer by it; but as soon as he is seen so surely, it counts.
    he = Gallery()
    he.take(gallery)
    assert he.log_odds(stranger) == pytest.approx(told, abs=0.05)
    views = len(gallery.views)
    gallery.learn(look(BLACK, GREY), 3.0)
    assert len(gallery.views) == views
    assert gallery.log_odds(stranger) > 2.5
    # A network tells it as little.
    vector = np.array([1.0, 0.0], np.float32)
    described = dataclasses.replace(stranger, described=Described(vector, 0.5, 10.0))
    known = Looks.of([described], [-2.0])
    assert Compared.of(described, known).network[0] == -2
    assert look_log_odds(*known_by(described, known)) < -2


def known_by(view: View, known: Looks) -> tuple[float, float, int, bool, float]:
    """The arguments of ``look_log_odds`` for a view and those of somebody."""
    alike, network = Compared.of(view, known).of_each([0])[0].tolist()
    return alike, view.total, len(known), view.grey, network


def test_the_views_of_a_return_take_the_place_of_none_that_was_known_before():
    """Sixty views of a stranger left one of ten."""
    rng = np.random.default_rng(3)
    paints = rng.integers(20, 230, (2, 40, 3)).tolist()
    looks = [look(tuple(a), tuple(b)) for a, b in zip(*paints, strict=True)]
    crowd = Crowd()
    person = crowd.welcome(np.zeros(2), 0.0, chosen=True)
    for time, view in enumerate(looks[:8]):
        person.gallery.learn(view, 0.1 * time)
    known = list(person.gallery.views)
    assert len(known) > 4
    comeback = Comeback(person, 10.0, 0.0)
    for time, view in enumerate(looks[8:]):
        person.gallery.learn(view, 10.0 + 0.1 * time)
    comeback.hear(look(GREEN), {}, 0.0, 20.0)
    comeback.settle(person)
    doubted = len(person.gallery.views)
    for _ in range(20):  # the same once more
        person.gallery.learn(person.gallery.views[-1], 21.0)
    assert len(person.gallery.views) == doubted
    person.gallery.restore(comeback.known)
    assert all(view in person.gallery.views for view in known)
    assert len(person.gallery.views) <= MOST_VIEWS
    crowd.disown(person, comeback)
    assert person.gallery.views == known
    assert all(each.trust == math.inf for each in crowd.people[-1].gallery._learned)


# -- one person -----------------------------------------------------------------------------------


def test_a_person_goes_on_as_before_for_a_moment():
    one = Person(1, np.array([0.0, 3.0]), 0.0)
    for i in range(1, 30):
        one.moved_to(np.array([0.1 * i, 3.0]), 0.1 * i)
    assert one.velocity == pytest.approx([1.0, 0.0], abs=0.02)
    assert one.expected(2.9 + 0.3) == pytest.approx([3.2, 3.0], abs=0.01)
    assert one.expected(2.9 + 60) == pytest.approx([2.9 + COAST, 3.0], abs=0.02)
    assert one.travelled == pytest.approx(2.9)


def test_two_sights_a_second_apart_tell_where_a_walker_will_be():
    one = Person(1, np.array([0.0, 3.0]), 0.0)
    one.moved_to(np.array([1.2, 3.0]), 1.0)
    assert one.expected(2.0) == pytest.approx([2.4, 3.0], abs=0.1)
    ahead, where_he_was = one.place_log_odds(np.array([[2.4, 3.0], [1.2, 3.0]]), 2.0)
    assert ahead > where_he_was + 0.7


def test_who_stands_is_where_he_stood_rather_than_beside_it():
    walks, stands = (Person(i, np.array([0.0, 3.0]), 0.0) for i in (1, 2))
    for i in range(1, 5):
        walks.moved_to(np.array([1.0 * i, 3.0]), 1.0 * i)
        stands.moved_to(np.array([4.0 + 0.05 * (i % 2), 3.0]), 1.0 * i)
    margins = []
    for one in (walks, stands):
        there = one.expected(5.0)
        beside = there + np.array([0.8, 0.0])
        here, beside = one.place_log_odds(np.stack((there, beside)), 5.0)
        margins.append(here - beside)
    assert margins[1] > margins[0] + 0.3


@pytest.mark.parametrize('missed', [False, True])
def test_who_was_hidden_may_have_turned_round_meanwhile(missed: bool):
    """He was expected farther on alone, so that somebody new came out where he had gone."""
    one = Person(1, np.array([0.0, 3.0]), 0.0)
    for i in range(1, 6):
        one.moved_to(np.array([0.28 * i, 3.0]), 0.2 * i)
    if missed:  # behind somebody who is nearer than he was
        sight = Watched().see(Someone(0.0, 3.0)).sights[0].seen
        one.last = sight
        one.missed(np.full((ROWS, COLS), sight.depth - 1.0, np.float32))
    ahead, back = one.place_log_odds(np.array([one.expected(1.8), [1.4, 3.0]]), 1.8)
    assert (ahead - back < 1) == missed
    assert (back > 0) == missed, 'he rather than anybody'


def test_who_was_followed_where_depth_shows_nothing_may_have_turned_round_there():
    """He was sought where he had gone on to, and was somebody new when he came back."""
    one = Person(1, np.array([0.0, 3.0]), 0.0, chosen=True)
    one.velocity = np.array([1.2, 0.0])
    nothing = np.zeros((ROWS, COLS), np.float32)
    places = []
    for by_look in (False, True):
        if by_look:
            one.placed(np.array([0.0, 3.0]), 0.0)
        else:
            one.hidden = False  # the camera has seen past where depth showed him last
        one.missed(nothing)
        assert one.hidden == by_look
        places.append(one.place_log_odds(np.array([[0.0, 3.0], [1.2, 3.0]]), 1.0))
    (back, on), (back_by_look, on_by_look) = places
    assert back < on - 1.0
    assert back_by_look == pytest.approx(on_by_look, abs=0.7)


def test_the_place_says_less_the_longer_somebody_is_away():
    one = Person(1, np.array([0.0, 3.0]), 0.0)
    places = np.array([[0.1, 3.0], [2.5, 3.0]])
    now, later, long_after = (one.place_log_odds(places, t) for t in (0.2, 2.0, 60.0))
    assert now[0] > 2
    assert now[1] < -3
    assert now[0] - now[1] > later[0] - later[1] > long_after[0] - long_after[1]
    assert long_after == pytest.approx([0.0, 0.0], abs=0.1)


@pytest.mark.parametrize(('behind', 'stays'), [(0.0, True), (-1.0, True), (1.0, False)])
def test_who_stood_stands_there_still_unless_the_camera_sees_past_his_place(
    behind: float, stays: bool
):
    account = Watched().see(Someone(0.0, 3.0))
    sight = account.sights[0].seen
    one = Person(1, np.array([0.0, 3.0]), 0.0)
    for i in range(1, 5):
        one.moved_to(np.array([0.0, 3.0]), 0.5 * i)
    one.last = sight
    one.calm = Calm(sight, account.scene.view, account.scene.image, 0.0)
    depth = np.full((ROWS, COLS), sight.depth + behind, np.float32)
    one.missed(depth)
    one.missed(np.zeros_like(depth))  # no reading there: that shows nothing
    there, beside = one.place_log_odds(np.array([[0.0, 3.0], [1.0, 3.0]]), 4.0)
    assert one.hidden == stays
    assert (one.calm is not None) == stays, 'what goes away is no furniture'
    assert (there - beside > 0.8) == stays


def test_a_thing_that_was_moved_is_nobody_until_it_walks_or_stands_upright():
    thing = Person(1, np.array([0.0, 3.0]), 0.0)
    thing.moved_to(np.array([0.1, 3.0]), 0.1)
    assert not thing.alive
    thing.moved_to(np.array([0.8, 3.0]), 1.0)
    assert thing.alive
    assert Person(2, np.zeros(2), 0.0, chosen=True).alive


@pytest.mark.parametrize('cut_off', ['', 'left', 'top', 'right', 'bottom'])
def test_what_is_short_has_a_persons_size_where_a_side_of_it_is_cut_off(cut_off: str):
    sight = Watched().see(Someone(0.0, 3.0)).sights[0].seen
    short = sight.mask[: round(0.6 * len(sight.mask))]  # as who sits
    sides = Sides(*(side == cut_off for side in ('left', 'top', 'right', 'bottom')))
    left, top, right, bottom = sight.metres
    metres = (left, top, right, top + 0.6 * (bottom - top))
    seen = dataclasses.replace(sight, mask=short, cut=sides, metres=metres)
    assert 0.8 < seen.height < 1.2
    assert person_sized(seen, 1.2) == bool(cut_off)


@pytest.mark.parametrize(
    ('top', 'cut_off', 'sized'),
    [
        (1.7, {'bottom'}, True),
        (1.1, {'bottom'}, False),  # a monitor on a desk
        (2.4, {'bottom'}, False),  # a lamp
        (None, {'bottom'}, False),
        (1.7, {'bottom', 'left'}, False),
        (1.7, set(), False),
    ],
)
def test_a_head_and_shoulders_above_the_images_end_are_somebody_near(
    top: float | None, cut_off: set[str], sized: bool
):
    """Who passed close to the camera was nobody for half a second."""
    sight = Watched().see(Someone(0.0, 3.0)).sights[0].seen
    share = 0.5 / sight.height
    mask = sight.mask[: round(share * len(sight.mask))]
    sides = Sides(*(side in cut_off for side in ('left', 'top', 'right', 'bottom')))
    left, upper, right, _ = sight.metres
    seen = dataclasses.replace(
        sight, mask=mask, cut=sides, metres=(left, upper, right, upper + 0.5)
    )
    assert person_sized(seen, top) == sized


@pytest.mark.parametrize(
    ('moves', 'top', 'told'), [(False, 0.95, True), (True, 0.95, False), (True, 1.7, True)]
)
def test_what_is_of_a_persons_size_has_come_there_unless_a_camera_that_moves_sees_it_anew(
    moves: bool, top: float, told: bool
):
    """A pillar and a chair were people as a camera turned and they came out from behind one."""
    reader, crowd = SceneReader(COLS, 0.04, 0.03, 0.0), Crowd()
    for i in range(1, 8):
        color, depth = images([])
        if i > 5:
            depth[60:150, :30] = 2.0  # as high as a desk, and cut off at the side
        scene = reader.read(Frame(color, depth, round(1e8 * i), CAMERA), 0.1)
        assert scene is not None
        rows = np.arange(ROWS, dtype=np.float32)[:, None] - 60
        elevation = np.float32(top) - rows * 2 / CAMERA.fy + np.zeros((1, COLS), np.float32)
        stood_for = 0.5 if moves else 5.0
        scene = dataclasses.replace(scene, elevation=elevation, stood_for=stood_for)
        account = crowd.explain(scene, 0.1 * i)
        crowd.learn(account, {})
    assert who(account, 0).upright == told


@pytest.mark.parametrize(
    ('stood_for', 'top', 'cut_off', 'walks'),
    [
        (0.5, 1.7, False, True),
        (0.5, 1.7, True, False),
        (0.5, 1.0, False, False),
        (5.0, 1.7, True, True),
        (5.0, 1.0, False, True),
    ],
)
def test_what_a_camera_that_moves_sees_more_and_more_of_does_not_walk(
    stood_for: float, top: float, cut_off: bool, walks: bool
):
    """A table that came out from behind one seemed to go a metre, and was somebody."""
    reader, crowd = SceneReader(COLS, 0.04, 0.03, 0.0), Crowd()
    for i in range(1, 14):
        color, depth = images([])
        right = 50 + 10 * max(i - 6, 0)
        if i > 5:
            depth[60:150, 0 if cut_off else right - 40 : right] = 2.0
        scene = reader.read(Frame(color, depth, round(1e8 * i), CAMERA), 0.1)
        assert scene is not None
        rows = np.arange(ROWS, dtype=np.float32)[:, None] - 60
        elevation = np.float32(top) - rows * 2 / CAMERA.fy + np.zeros((1, COLS), np.float32)
        scene = dataclasses.replace(scene, elevation=elevation, stood_for=stood_for)
        account = crowd.explain(scene, 0.1 * i)
        crowd.learn(account, {})
    assert (who(account, 0).travelled > 0.3) == walks


@pytest.mark.parametrize(
    ('moves', 'known', 'may_be'), [(True, 1.4, False), (True, 1.2, True), (False, 1.4, True)]
)
def test_whom_a_camera_that_moves_has_lost_does_not_come_back_as_a_desk(
    moves: bool, known: float, may_be: bool
):
    """Who had gone out of view was taken for a table before which nobody stood any more."""
    reader, crowd = SceneReader(COLS, 0.04, 0.03, 0.0), Crowd()
    person = crowd.welcome(np.array([-1.1, 2.0]), 0.0)
    person.gallery.stature.learn(Height(known, 2.0, 0.0))
    for i in range(1, 9):
        color, depth = images([])
        if i > 7:
            depth[60:150, :30] = 2.0
        scene = reader.read(Frame(color, depth, round(1e8 * i), CAMERA), 0.1)
        assert scene is not None
        rows = np.arange(ROWS, dtype=np.float32)[:, None] - 60
        elevation = 0.9 - rows * 2 / CAMERA.fy + np.zeros((1, COLS), np.float32)
        stood_for = 0.5 if moves else 5.0
        scene = dataclasses.replace(scene, elevation=elevation, stood_for=stood_for)
        account = crowd.explain(scene, 0.1 * i)
        odds = account.odds.copy()
        crowd.learn(account, {})
    assert (odds[0, 0] > NEW) == may_be


@pytest.mark.parametrize(
    'why', ['stayed', 'looks otherwise', 'stood elsewhere', 'nobody chose him', 'the camera stands']
)
def test_who_stood_there_is_no_part_of_the_room_when_the_camera_turns_back(why: str):
    """Above a desk he had no person's shape: what was seen anew was room, and he was lost."""
    reader, crowd, one = SceneReader(COLS, 0.04, 0.03, 0.0), Crowd(), Someone(0.2, 2.0)
    color, depth = images([one])
    color[60:], depth[60:] = GREY, 1.0  # a desk
    scene = reader.read(Frame(color, depth, 0, CAMERA), 0.1)
    assert scene is not None
    assert not scene.before.any(), 'it is the first that is seen'
    scene = dataclasses.replace(scene, stood_for=5.0 if why == 'the camera stands' else 0.5)
    place = np.array([1.2 if why == 'stood elsewhere' else 0.2, 2.0])
    person = crowd.welcome(place, 0.0, chosen=why != 'nobody chose him')
    person.misses, person.upright = 3, True
    colors = np.full_like(color, 200) if why == 'looks otherwise' else color
    before = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(colors, depth, 0, CAMERA), 0.1)
    assert before is not None
    seen = before.silhouette(int(before.surfaces.labels[40, round(one.box.cx)]))
    person.gallery.learn(look_of(before, seen), 0.0)
    account = crowd.explain(scene, 1.0, reader.is_somebody)
    assert len(account.sights) == (why == 'stayed')
    if why == 'stayed':
        assert box_about(scene, account.sights[0].seen).iou(one.box.clipped(COLS, 60)) > 0.8


def test_a_person_stays_in_the_world_while_the_camera_turns():
    one = Person(1, np.array([0.0, 3.0]), 0.0)
    one.moved_to(np.array([0.1, 3.0]), 0.1)
    # The camera turns left by 90 degrees: what was ahead is now to the right.
    rotation, _ = cv2.Rodrigues(np.array([0.0, np.pi / 2, 0.0]))
    axes = np.eye(3)[::2]
    one.carried(Pose(rotation, np.zeros(3)), axes, axes)
    assert one.place == pytest.approx([3.0, -0.1], abs=1e-9)
    assert one.first_place == pytest.approx([3.0, 0.0], abs=1e-9)
    assert np.hypot(*one.velocity) == pytest.approx(1 - np.exp(-0.1 / VELOCITY_TIME))
    assert one.last is None


@pytest.mark.parametrize('roll', [0.0, 0.2])
def test_who_stands_does_not_travel_before_a_camera_that_is_tilted_and_turns(roll: float):
    """Axes that were not at right angles to each other drew places out with each frame."""
    down = np.array([np.sin(roll), np.cos(roll) * np.cos(0.4), np.cos(roll) * np.sin(0.4)])
    ahead = np.array([0.0, 0.0, 1.0]) - down[2] * down
    ahead /= np.linalg.norm(ahead)
    axes = np.stack((np.cross(down, ahead), ahead))
    where = np.array([0.4, 0.3, 4.0])  # a point, in the camera's frame
    one = Person(1, axes @ where, 0.0)
    for frame in range(1, 40):
        turn, _ = cv2.Rodrigues(np.array([0.02, 0.06, -0.03]) * np.cos(frame / 3))
        motion = Pose(turn, np.array([0.02, 0.0, 0.01]) * np.sin(frame / 5))
        was = axes
        down, where = turn @ down, motion.of(where[None])[0]
        ahead = np.array([0.0, 0.0, 1.0]) - down[2] * down
        ahead /= np.linalg.norm(ahead)
        axes = np.stack((np.cross(down, ahead), ahead))
        one.carried(motion, was, axes)
        assert one.place == pytest.approx(axes @ where, abs=0.01)
        one.moved_to(axes @ where, 0.1 * frame)
    assert one.travelled < 0.1


def resemble(one: Person, number: int, odds: float, weight: float, time: float = 0.0) -> None:
    """Somebody resembles another by so much, and shows as the weight says, without his head."""
    area = np.zeros(SLICES, np.float32)
    area[0] = WHOLE_AREA * math.sqrt(weight)
    roots = np.zeros((SLICES, LIGHTNESS, TINTS * TINTS), np.float32)
    view = View(roots, area, np.ones(SLICES, np.float32), None)
    one.resembled(Person(number, np.zeros(2), 0.0), odds, view, time)


@pytest.mark.parametrize('rate', [1, 2, 5, 10, 30])
def test_who_is_slim_is_recognised_however_often_the_camera_looks(rate: int):
    """Of late alone, what is seen of him from the side would never be enough at 5 Hz and below."""
    one, sightings = Person(1, np.zeros(2), 0.0), 20
    for n in range(sightings):
        resemble(one, 7, 4.0, 0.12, n / rate)
        resemble(one, 8, 4.0, 0.01, n / rate)
    assert one.resembles(7) > 0
    assert one.resembles(8) == 0.0, 'of which so little shows may be anybody'
    assert one.resembles(8, surely=False) == pytest.approx(4.0)


def test_resemblance_is_the_mean_over_the_sightings_of_late_by_what_they_show():
    one = Person(1, np.zeros(2), 0.0)
    assert one.resemblance(7) is None
    for odds in (3.0, -1.0, 1.0):
        resemble(one, 7, odds, 1.0, 0.0)
    assert one.resemblance(7) == pytest.approx(1.0)
    resemble(one, 7, -100.0, 0.0, 0.0)
    assert one.resemblance(7) == pytest.approx(1.0)
    # More sightings say more, but by far not as many times more.
    assert 1.0 < one.resembles(7) < 2.0
    assert one.resembles(8) == 0.0
    resemble(one, 9, 2.0, 0.5, 0.0)
    assert one.resembles(9) == 0.0, 'half a sighting is too little to go by for good'
    assert one.resembles(9, surely=False) == pytest.approx(2.0)
    # What was seen long ago, when little of him showed, says no more who he is.
    for time in (20.0, 20.5, 21.0):
        resemble(one, 7, -2.0, 1.0, time)
    assert one.resemblance(7) == pytest.approx(-2.0, abs=0.01)


def test_how_tall_somebody_turns_out_to_be_counts_for_what_was_seen_of_him_before():
    heard = Heard()
    assert heard.mean is None
    for n in range(5):  # he comes in, and may have bent down
        heard.hear(3.6, 1.0, 0.2 * n, height=-0.4, told=False)
    assert heard.mean == pytest.approx(3.6)
    heard.hear(-0.4, 1.0, 1.0, height=-4.4, told=True)
    assert heard.mean == pytest.approx(-0.4)
    # Who stands still after that is no taller for it; who is as tall after all is heard.
    for n in range(6, 10):
        heard.hear(3.6, 1.0, 0.2 * n, height=-0.4, told=False)
    assert heard.mean == pytest.approx(-0.4)
    for n in range(10, 30):
        heard.hear(4.2, 1.0, 0.2 * n, height=0.2, told=True)
    assert heard.mean == pytest.approx(4.2, abs=0.2)


def test_somebody_is_any_of_those_he_is_like_but_none_whom_he_met_and_none_of_them_twice():
    one = Person(1, np.zeros(2), 0.0)
    assert one.seen_before({7: 1.0}) == -np.inf, 'he was compared with nobody'
    resemble(one, 7, 3.0, 1.0, 0.0)
    resemble(one, 8, 3.0, 1.0, 0.0)
    assert one.seen_before({7: 1.0}) == pytest.approx(3.0)
    assert one.seen_before({7: 1.0, 8: 1.0}) == pytest.approx(3.0 + np.log(2))
    assert one.seen_before({7: 1.0, 8: 0.0}) == pytest.approx(3.0), 'the one is the other'
    one.met.add(7)
    assert one.seen_before({7: 1.0, 8: 0.5}) == pytest.approx(3.0 - np.log(2))
    resemble(one, 9, 3.0, 0.1, 0.0)
    assert one.seen_before({9: 1.0}) < 1.0, 'a tenth of somebody says little of who he is'


def test_who_is_known_twice_stays_where_he_was_seen_last():
    old, late = Person(1, np.zeros(2), 0.0), Person(2, np.ones(2), 5.0)
    old.moved_to(np.array([3.0, 3.0]), 9.0)
    old.become(late)
    assert old.place == pytest.approx([3.0, 3.0])
    assert old.seen_at == 9.0
    newer = Person(3, np.array([4.0, 4.0]), 20.0)
    old.become(newer)
    assert old.place == pytest.approx([4.0, 4.0])
    assert old.seen_at == 20.0


# -- who comes ------------------------------------------------------------------------------------


def test_nobody_known_comes_back_before_anybody_has_come():
    assert Arrivals().against([]) == pytest.approx(RETURN)


def test_the_more_were_new_the_less_likely_somebody_comes_back_and_the_other_way_round():
    street, home = Arrivals(), Arrivals()
    for _ in range(20):
        home.returned(100.0)
    gone = [Arrival(0.0), Arrival(0.0), Arrival(100.0)]
    assert street.against(gone[1:]) < street.against(gone)
    assert home.against(gone) < RETURN < street.against(gone)
    assert home.against(gone[2:]) == 0.0, 'that nobody is new is never taken for granted'
    street.forgotten = 100
    assert street.against(gone) > RETURN + 2


def test_each_of_those_who_are_away_is_as_likely_as_the_other():
    arrivals = Arrivals()
    here, gone = Arrival(0.0), Arrival(1e6)
    one, four = arrivals.against([here] * 3 + [gone]), arrivals.against([gone] * 4)
    assert four - one == pytest.approx(np.log(4))


def test_who_is_as_likely_new_as_not_counts_as_half_of_both():
    assert is_new(-np.inf, 2.0) == 1.0
    assert is_new(2.0, 2.0) == 0.5
    assert is_new(1e6, 2.0) == pytest.approx(0.0)
    # Five came, one of whom is as likely one of the others; none is away.
    came = [Arrival(0.0)] * 4 + [Arrival(0.0, again=RETURN)]
    assert Arrivals().against(came) == pytest.approx(np.log((4.5 + np.exp(RETURN)) / 1.5))


def test_those_who_came_back_unrecognised_tell_that_people_come_back():
    """Each would have been one more who is new, and nobody would ever have been recognised."""
    arrivals = Arrivals()
    six = [Arrival(100.0)] * 6
    first = arrivals.against(six)
    again = six + [Arrival(100.0, again=first - 0.3)] * 12
    odds = [arrivals.against(again) for _ in range(20)]
    assert all(later <= before + 1e-9 for before, later in itertools.pairwise(odds))
    assert odds[-1] < first - 1.0
    # That they are neither of those who went leaves it as it was: they are twelve more.
    assert Arrivals().against(six + [Arrival(100.0, again=-20.0)] * 12) > first + 1.0


def test_who_was_missed_for_a_moment_is_not_away():
    arrivals = Arrivals()
    for _ in range(100):
        arrivals.returned(0.01)
    assert arrivals.returns < 1
    assert away(0.0) == 0
    assert away(GONE) == pytest.approx(2 / 3, abs=0.05)


def test_odds_against_it_make_a_probability_less_and_leave_what_is_sure():
    assert bounded(0.5, np.log(3)) == pytest.approx(0.25)
    assert bounded(0.9, 0.0) == pytest.approx(0.9)
    assert bounded(1.0, 5.0) == 1.0
    assert bounded(0.0, 5.0) == 0.0


# -- what stood still ---------------------------------------------------------------------------

TURNED = Pose(cv2.Rodrigues(np.array([0.0, 0.3, 0.0]))[0], np.array([0.05, 0.0, 0.0]))


NARROW = np.full(3, 0.05)


def stood(seconds: float = 3.0, width: float = 0.5) -> tuple[Stood, np.ndarray]:
    """A thing seen two metres ahead for some time, before the camera turned; where it is now."""
    place = np.array([0.2, 0.0, 2.0])
    thing = Stood(place, NARROW, width)
    for _ in range(round(seconds * 10)):
        thing.seen(place, NARROW, 0.1)
    assert not thing.known, 'a camera that stands sees what moves'
    thing.carried(None, 0.1)
    thing.carried(TURNED, 0.1)
    return thing, TURNED.of(place)


def test_what_stood_still_is_where_it_stood_when_the_camera_has_turned():
    thing, here = stood()
    assert thing.known
    there = thing.log_odds(here, NARROW)
    beside = thing.log_odds(here + np.array([0.3, 0.0, 0.0]), NARROW)
    elsewhere = thing.log_odds(here + np.array([2.0, 0.0, 0.0]), NARROW)
    assert GAIN - 0.1 < there < GAIN
    assert there > beside > 0 > elsewhere > np.log(SUDDENLY) - 0.01
    # The longer the camera goes on, the less surely.
    for motion in (TURNED, TURNED.inverse) * 3:
        thing.carried(motion, 0.1)
    off = np.array([1.0, 0.0, 0.0])
    assert 0 > thing.log_odds(here + off, NARROW) > stood()[0].log_odds(here + off, NARROW) + 0.5


def test_somebody_may_have_moved_it_while_nobody_looked_but_not_between_two_frames():
    thing, here = stood()
    far = here + np.array([2.0, 0.0, 0.0])
    at_once = thing.log_odds(far, NARROW)
    thing.carried(None, 60.0)
    assert at_once < ELSEWHERE
    assert thing.log_odds(far, NARROW) == pytest.approx(np.log(CARRIED_OFF), abs=0.01)
    assert at_once < thing.log_odds(far, NARROW) - 1
    thing.seen(here, NARROW, 0.1)
    assert thing.log_odds(far, NARROW) < at_once + 0.5, 'it was seen there just now'


def test_a_hand_beside_a_mug_is_something_else_but_within_a_chair_is_the_chair():
    beside = np.array([0.4, 0.0, 0.0])
    mug, here = stood(width=0.1)
    chair, _ = stood(width=0.8)
    assert mug.log_odds(here + beside, NARROW) < ELSEWHERE
    assert chair.log_odds(here + beside, NARROW) > 0


def test_what_is_elsewhere_does_not_draw_the_place_after_it():
    """A second chair half a metre off became the place of the first."""
    thing, here = stood(width=0.4)
    off = here + np.array([0.5, 0.0, 0.0])
    before = thing.log_odds(off, NARROW)
    for _ in range(20):
        thing.seen(off, NARROW, 0.1)
    assert thing.known
    assert thing.log_odds(off, NARROW) < before + 0.5
    near = here + np.array([0.1, 0.0, 0.0])
    for _ in range(20):
        thing.seen(near, NARROW, 0.1)
    assert thing.log_odds(near, NARROW) > GAIN - 0.1, 'another side of it is'


def test_a_place_that_is_vague_says_little():
    place, vague = np.array([0.2, 0.0, 2.0]), np.array([0.1, 0.1, 0.4])
    off = np.array([0.5, 0.0, 0.0])
    odds = []
    for sigma in (NARROW, vague):
        thing = Stood(place, sigma, 0.1)
        for _ in range(20):
            thing.seen(place, sigma, 0.1)
        thing.carried(TURNED, 0.1)
        odds.append(thing.log_odds(TURNED.of(place) + off, NARROW))
    assert odds[0] < ELSEWHERE < odds[1]


def test_whether_he_stands_of_whom_the_wall_behind_alone_is_read_is_not_known():
    """Who walked in beside the depth image stood there for good, and was nobody as he came on."""
    beyond, vague = np.array([2.0, 0.0, 5.0]), np.array([0.3, 0.1, 1.2])
    comer = Stood(beyond, vague, 0.6)
    comer.seen(beyond - np.array([0.3, 0.0, 0.0]), vague, 0.1)
    comer.carried(TURNED, 0.1)
    assert not comer.known
    assert comer.log_odds(np.array([1.0, 0.0, 3.0]), NARROW) == 0.0


def test_the_longer_a_thing_has_stood_still_the_more_that_says():
    far = np.array([3.0, 0.0, 0.0])
    odds = [stood(seconds)[0].log_odds(far, NARROW) for seconds in (0.0, 0.3, 3.0)]
    assert odds[0] == pytest.approx(np.log(CHOSEN_MOVING), abs=0.01)
    assert odds[0] > odds[1] + 0.3 > odds[2] + 0.6


@pytest.mark.parametrize('why', ['moved', 'lost', 'somebody'])
def test_of_what_moves_or_may_have_moved_no_place_is_known(why: str):
    thing, here = stood()
    if why == 'moved':
        thing.seen(here + np.array([1.0, 0.0, 0.0]), NARROW, 0.1)
    elif why == 'lost':
        thing.carried(Lost(), 0.1)
    else:
        thing.moves()
    assert not thing.known
    assert thing.log_odds(here, NARROW) == 0


# -- a camera without colours ---------------------------------------------------------------------


@pytest.mark.parametrize('quality', [20, 95])
def test_a_camera_without_colours_is_known_by_its_pictures(quality: int):
    picture_of_one, _ = images([Someone(0.0, 3.0)])
    assert ColorCodes(without_colors(picture_of_one, quality)).grey
    assert not ColorCodes(picture_of_one).grey
    assert look(RED, grey=True).grey
    assert not look(RED).grey


def test_without_colours_those_who_are_no_more_alike_than_most_are_not_the_same():
    """Who wears a lighter shirt and trousers was he, by 50 to 1."""
    one, same = look(RED, grey=True), look(RED, z=3.0, grey=True)
    other = look((170, 170, 170), (85, 85, 85), grey=True)
    gallery = Gallery()
    gallery.learn(one, 0.0)
    assert gallery.log_odds(same) > 2
    assert gallery.log_odds(other) < 0
    alike = float(similarity(other, Looks.of([one]))[0])
    assert look_log_odds(alike, 1.0) > 3 > 0 > look_log_odds(alike, 1.0, grey=True)


# -- who came back --------------------------------------------------------------------------------


def returned(*views: View) -> tuple[Person, Comeback]:
    """Somebody known by some views, who is back after ten seconds."""
    person = Person(1, np.zeros(2), 0.0, chosen=True)
    for view in views:
        person.gallery.learn(view, 0.0)
    person.met.add(7)
    return person, Comeback(person, 10.0, 0.0)


def test_a_return_is_as_likely_as_its_looks_say_by_what_was_known_before():
    red, green = look(RED), look(GREEN)
    person, comeback = returned(red)
    assert (comeback.left, comeback.since, comeback.met) == (0.0, 10.0, {7})
    odds = person.gallery.log_odds(red)
    likely = comeback.hear(red, {}, 0.0, 10.0)
    assert likely.looks == likely.score == pytest.approx(1 / (1 + np.exp(-odds)))
    assert comeback.borne_out == (odds > BORNE_OUT)
    # What is learned of him since does not bear it out, nor does that he goes on to look the same.
    person.gallery.learn(green, 11.0)
    for i in range(20):
        last = comeback.hear(green, {}, 0.0, 12.0 + 0.1 * i)
    assert last.looks < 0.5
    assert not comeback.borne_out
    assert comeback.known.log_odds(green) < 0 < person.gallery.log_odds(green)


def test_who_came_back_is_less_likely_the_target_beside_another_who_is_as_like_it():
    red, green = look(RED), look(GREEN)
    _, alone = returned(red)
    _, beside = returned(red)
    odds = alone.known.log_odds(red)
    alone.hear(red, {2: green}, 0.0, 10.0)
    assert alone.hear(red, {2: green}, 0.0, 10.1).looks == pytest.approx(1 / (1 + np.exp(-odds)))
    # Both may be it, or neither.
    expected = np.exp(odds) / (1 + 2 * np.exp(odds))
    assert beside.hear(red, {2: red}, 0.0, 10.0).looks == pytest.approx(expected)
    # Of one who has left nothing more is heard.
    assert beside.hear(red, {}, 0.0, 10.1).looks == pytest.approx(1 / (1 + np.exp(-odds)))


def test_another_in_view_is_heard_once_enough_was_seen_of_him_also_when_nobody_else_is():
    red, green = look(RED), look(GREEN)
    person, comeback = returned(red)
    comeback.hear(green, {2: red}, 0.0, 10.0)
    assert comeback.likely is not None
    assert comeback.likely.rival == 0.0
    likely = comeback.hear(None, {2: red}, 0.0, 10.5)
    odds, mine = np.exp(person.gallery.log_odds(red)), np.exp(person.gallery.log_odds(green))
    assert likely.rival == pytest.approx(odds / (1 + odds + mine))
    assert likely.looks == pytest.approx(mine / (1 + odds + mine))
    # He is followed himself, or has left: nobody's rival.
    assert comeback.hear(None, {2: red}, 0.0, 10.6, followed={2}).rival == 0.0
    assert comeback.hear(None, {}, 0.0, 10.6).rival == 0.0


@pytest.mark.parametrize(('seen', 'against'), [(RED, 0), (RED, 2), (GREEN, 0), (RED, 6)])
def test_what_was_learned_since_a_return_is_his_as_surely_as_it_was_he_who_came_back(
    seen, against: float
):
    person, _ = returned(look(RED))
    before, sure = (person.gallery.log_odds(look(each)) for each in (BLUE, RED))
    comeback = Comeback(person, 10.0, against)
    person.gallery.learn(look(BLUE), 10.5)
    assert person.gallery.log_odds(look(BLUE)) > 3
    comeback.settle(person)
    assert person.gallery.log_odds(look(BLUE)) > 3, 'nothing was heard yet'
    likely = comeback.hear(look(seen), {}, 0.0, 11.0)
    comeback.settle(person)
    expected = max(logit(likely.score), before)
    assert person.gallery.log_odds(look(BLUE)) == pytest.approx(expected, abs=0.05)
    assert person.gallery.log_odds(look(RED)) == pytest.approx(sure, abs=0.7), 'one view more'


def test_the_score_of_a_return_counts_how_seldom_anybody_comes_back_and_who_else_is_known():
    """Once a few sightings bore him out, his looks alone said how likely he was: 0.95 always."""
    red = look(RED)
    person, _ = returned(red)
    odds, against, known = np.exp(person.gallery.log_odds(red)), 1.7, 20.0
    likely = Comeback(person, 10.0, against).hear(red, {}, known, 10.0)
    assert likely.looks == pytest.approx(odds / (1 + known + odds))
    assert likely.score == pytest.approx(odds / (np.exp(against) + known + odds))


@pytest.mark.parametrize('place', [False, True])
def test_who_was_hidden_for_a_moment_is_somebody_else_where_place_and_looks_together_say_so(
    place: bool,
):
    """By looks alone a covered chair, much like the target, was it at scores of 0.1 for good."""
    red = look(RED)
    person, _ = returned(red)
    even = person.gallery.log_odds(red)
    for odds in (-1.0, -1.2):  # a quarter is a little less than one to three
        comeback = Comeback(person, 10.0, even - odds, place)
        assert not comeback.denied, 'nothing was heard yet'
        assert comeback.hear(red, {}, 0.0, 10.0).looks > 0.9
        assert comeback.denied == (place and odds < -1.1)


@pytest.mark.parametrize('odds', [-0.35, -0.45])
def test_of_who_came_back_no_box_is_shown_by_three_to_two_against_him(odds: float):
    red = look(RED)
    person, _ = returned(red)
    comeback = Comeback(person, 10.0, person.gallery.log_odds(red) - odds)
    assert not comeback.doubted, 'nothing was heard yet'
    comeback.hear(red, {}, 0.0, 10.0)
    assert comeback.doubted == (odds < -0.4)  # log(2/3) is -0.405
    assert not comeback.denied


# -- everyone together ----------------------------------------------------------------------------


class Watched:
    """A crowd before a camera that has seen the empty room."""

    def __init__(self, frames: int = 6) -> None:
        self.crowd = Crowd()
        self.time = 0.0
        self._reader = SceneReader(COLS, 0.04, 0.03, 0.0)
        for _ in range(frames):
            self.see()

    def see(self, *people: Someone, dt: float = 0.1, targets=None, unsure=()) -> Account:
        account = self.explain(*people, dt=dt)
        self.crowd.learn(account, targets(account) if targets else {}, unsure)
        self._reader.somebody = account.somebody()
        return account

    def explain(self, *people: Someone, dt: float = 0.1) -> Account:
        self.time += dt
        scene = self._reader.read(picture(list(people), self.time), dt)
        assert scene is not None
        return self.crowd.explain(scene, self.time)

    def walk(self, first: float, last: float, z: float, shirt, trousers=BLACK) -> Person:
        """Somebody walks across at 1 m/s; who he is taken for in the end."""
        account = None
        for x in np.arange(first, last, 0.1 if last > first else -0.1):
            account = self.see(Someone(float(x), z, shirt, trousers))
        assert account is not None
        return who(account, 0)

    def beside(self, left, right) -> tuple[Account, list[int]]:
        """Two who walk beside each other; the last account, and their sights from the left."""
        for i in range(10):
            account = self.see(
                Someone(-0.9 + 0.05 * i, 3.0, left), Someone(0.9 - 0.03 * i, 3.0, right)
            )
        return account, sorted(range(2), key=lambda c: account.sights[c].place[0])

    def leaves(self, person: Person) -> Callable[[Account], dict[int, None]]:
        """He is chosen and goes away; what the one who follows him says of each frame since."""
        person.chosen = True

        def hidden(_: Account) -> dict[int, None]:
            return {person.number: None}

        for _ in range(round(3 * REUNION / 0.5)):
            self.see(dt=0.5, targets=hidden)
        return hidden

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.5)):
            self.see(dt=0.5)


def know_more(person: Person, views: int) -> None:
    """He was seen from some more sides, each of another colour."""
    for shirt in ((200, 60, 60), (60, 200, 200), (200, 60, 200), (60, 120, 240))[:views]:
        person.gallery.learn(look(shirt, shirt), 0.0)


def who(account: Account, column: int) -> Person:
    assert account.owner[column] >= 0
    return account.people[account.owner[column]]


def test_an_empty_room_holds_nobody():
    watched = Watched()
    watched.wait(3)
    assert watched.crowd.people == []


def test_an_identity_is_kept_from_frame_to_frame_and_after_an_absence():
    watched = Watched()
    first = watched.walk(-1.0, 1.0, 3.0, RED)
    assert len(watched.crowd.people) == 1
    assert first.mobile
    assert first.alive
    watched.wait(20)
    back = watched.walk(1.0, -0.5, 2.5, RED)
    assert back is first


def test_who_walks_before_the_room_is_known_is_none_of_what_stands_still():
    watched = Watched(frames=0)
    for x in (-1.0, 0.0):
        account = watched.see(Someone(x, 3.0, RED), dt=1.0)
    assert not account.settled
    assert who(account, 0).mobile


@pytest.mark.parametrize(
    ('top', 'beside', 'parted', 'somebody'),
    [
        (1.3, False, False, True),
        (0.9, False, False, False),
        (2.3, False, False, False),
        (None, False, False, False),
        (1.3, True, False, False),
        (1.3, False, True, False),
    ],
)
def test_little_of_somebody_is_somebody_where_it_reaches_up_to_where_heads_are(
    top: float | None,
    beside: bool,
    parted: bool,
    somebody: bool,
    monkeypatch: pytest.MonkeyPatch,
):
    """Who sits behind a monitor, of whom no more shows than a head and a shoulder, was nobody."""
    watched = Watched()
    people = [Someone(1.93, 3.0, RED)] + ([Someone(1.35, 3.2, BLUE)] if beside else [])
    account = watched.explain(*people)
    small = min(range(len(account.sights)), key=lambda n: account.sights[n].seen.area)
    sight = account.sights[small]
    assert sight.seen.area < NEW_AREA
    account.sights[small] = dataclasses.replace(sight, parted=parted)
    monkeypatch.setattr(Scene, 'top', lambda scene, seen: top)
    watched.crowd.learn(account, {})
    assert (account.owner[small] >= 0) == somebody


def test_a_stranger_is_not_taken_for_who_has_left():
    watched = Watched()
    first = watched.walk(-1.0, 1.0, 3.0, RED)
    watched.wait(20)
    other = watched.walk(-1.0, 1.0, 3.0, GREEN, GREY)
    assert other is not first
    assert other.number != first.number
    watched.wait(20)
    assert watched.walk(-1.0, 1.0, 3.0, RED) is first


def test_who_comes_back_is_known_again_though_many_were_new_before_him():
    """Once six had come, nobody was recognised any more: each return was one more who is new.

    Then the first who came back needed more than looks could say, however alike they were.
    """
    watched = Watched()
    shirts = (RED, GREEN, BLUE, (40, 200, 220), (200, 60, 200), (200, 200, 60), (235, 235, 235))
    rounds: list[list[int]] = []
    for _ in range(4):
        rounds.append([])
        for shirt in shirts:
            for x in (-0.9, 0.0, 0.9):
                account = watched.see(Someone(x, 3.0, shirt), dt=1.0)
            rounds[-1].append(who(account, 0).number)
            for _ in range(4):
                watched.see(dt=1.0)
    assert len(set(rounds[0])) == len(shirts), 'they look like nobody else'
    assert rounds[1:] == rounds[:1] * 3


def test_nobody_becomes_one_who_has_just_become_another():
    """He would have gone with him: who is seen is known under no number then."""
    watched = Watched()
    one, two = (watched.crowd.welcome(np.full(2, float(n)), 0.1 * n) for n in (1, 2))
    account = watched.see(Someone(0.0, 3.0, RED))
    three = who(account, 0)
    for later, earlier in ((two, one), (three, two)):
        later.first_seen = earlier.seen_at + 1.0
        later.again = 30.0
        for _ in range(3):
            resemble(later, earlier.number, 29.0, 1.0, watched.time)
    account.people = [one, two, three]
    account.owner = [2]
    watched.crowd._reunite(account)
    assert two not in watched.crowd.people, 'the second is the first'
    assert who(account, 0) in watched.crowd.people


@pytest.mark.parametrize(('odds', 'same'), [(1.2, False), (2.5, True)])
def test_even_where_all_come_back_nobody_is_given_a_number_by_less_than_seven_to_one(odds, same):
    """Of one who stood half hidden for 20 s it was given to another, by looks of four to one."""
    watched = Watched()
    one = watched.crowd.welcome(np.full(2, 1.0), 0.1)
    account = watched.see(Someone(0.0, 3.0, RED))
    newcomer = who(account, 0)
    newcomer.first_seen, newcomer.again, account.against = one.seen_at + 1.0, odds, 0.0
    for _ in range(3):
        resemble(newcomer, one.number, odds, 1.0, watched.time)
    account.people = [one, newcomer]
    account.owner = [1]
    watched.crowd._reunite(account)
    assert (who(account, 0) is one) == same


def test_two_who_change_places_keep_who_they_are():
    watched = Watched()
    left = right = None
    for i in range(24):
        x = -0.9 + 0.075 * i
        account = watched.see(Someone(x, 2.5, RED), Someone(-x, 3.5, GREEN, GREY))
        by_depth = sorted(range(len(account.sights)), key=lambda c: account.sights[c].place[1])
        if len(by_depth) == 2 and left is None and i > 3:
            left, right = (who(account, c) for c in by_depth)
    assert left is not None
    assert left is not right
    assert who(account, by_depth[0]) is left
    assert who(account, by_depth[1]) is right
    assert right.number in left.met
    assert left.number in right.met


def test_two_who_were_seen_together_are_never_made_one():
    for together in (True, False):
        watched = Watched()
        for i in range(8):
            x = 0.05 * i
            one = [Someone(x - 1.0, 3.0, RED)] if together or i < 4 else []
            two = [Someone(x + 0.6, 3.0, RED)] if together or i >= 4 else []
            account = watched.see(*one, *two)
        chosen, other = watched.crowd.people[0], watched.crowd.people[-1]
        if not together:
            other = watched.crowd.welcome(np.array([1.0, 3.0]), watched.time)
            account = watched.see(Someone(1.0, 3.0, RED))
        column = max(range(len(account.sights)), key=lambda c: account.sights[c].place[0])
        account.owner[column] = account.people.index(other)
        # What follows the target says that it is where the other one is.
        watched.crowd.learn(account, {chosen.number: account.sights[column].seen})
        assert (other in watched.crowd.people) == together


def test_a_chosen_one_comes_back_as_a_stranger_who_resembles_him():
    watched = Watched()
    chosen = watched.walk(-1.0, 0.6, 3.0, RED)
    hidden = watched.leaves(chosen)
    for shirt, trousers, same in ((GREEN, GREY, False), (RED, BLACK, True)):
        for i in range(6):
            account = watched.see(Someone(-0.8 + 0.1 * i, 2.5, shirt, trousers), targets=hidden)
        stranger = account.stranger(chosen, 0)
        assert stranger is not None
        assert stranger is not chosen
        resemblance = stranger.resemblance(chosen.number)
        assert resemblance is not None
        assert (resemblance > 1) == same
        watched.wait(3)


def test_who_comes_back_is_explained_as_himself_from_the_first_sight_on_and_others_are_not():
    watched = Watched()
    chosen = watched.walk(-1.0, 0.6, 3.0, RED)
    hidden = watched.leaves(chosen)
    for shirt, said in ((GREEN, {0, -1}), (RED, {1})):
        claims = []
        for i in range(6):
            account = watched.see(Someone(-0.8 + 0.1 * i, 2.5, shirt), targets=hidden)
            seen = account.sights[0].seen
            claims.append(account.claim(chosen, seen).assigned)
        # Before, the number that he got with his first sight explained him from the second on.
        assert set(claims) <= said
        watched.wait(3)


@pytest.mark.parametrize(('seconds', 'possible'), [(0.4, False), (2.0, True)])
def test_nobody_is_who_cannot_have_walked_there(seconds: float, possible: bool):
    watched = Watched()
    one = watched.walk(-1.2, -0.6, 3.0, RED)
    watched.see(dt=seconds - 0.1)
    account = watched.see(Someone(1.6, 4.0, RED))
    if possible:
        assert who(account, 0) is one or one.number not in who(account, 0).met
    else:
        assert one.number in who(account, 0).met


def test_who_comes_back_is_not_taken_for_one_who_was_seen_beside_him():
    watched = Watched()
    account, columns = watched.beside(RED, DARK_RED)
    chosen, other = (who(account, c) for c in columns)
    hidden = watched.leaves(chosen)
    # Away for longer than a moment he is a stranger at first, and nobody who was with him, though
    # that one is known as well and of a like look.
    account = watched.see(Someone(0.4, 3.0, RED), targets=hidden)
    assert account.people[account.verdict[0]] is chosen
    assert account.odds[account.people.index(other), 0] > 0
    assert who(account, 0) is account.stranger(chosen, 0) is not other


@pytest.mark.parametrize('sure', [True, False])
def test_the_body_is_learned_only_of_who_is_surely_the_target(
    sure: bool, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(follower, 'LEARNED', 0.6 if sure else 1.1)
    targets, number, _ = followed()
    surface = targets._followers[number]._surface
    assert surface is not None
    x, known = float(surface.motion.position[0]), surface.body.area
    for i in range(8):
        one = Someone(x + 0.02 * i, 3.0)
        frame = picture([one], 1.3 + 0.1 * i)
        bag = np.s_[int(one.box.cy) : int(one.box.cy) + 40, int(one.box.x) - 12 : int(one.box.cx)]
        frame.color[bag], frame.depth[bag] = RED, 3.0
        track = targets.update(frame)[number]
        assert track.box is not None
    assert (surface.body.area > 1.02 * known) == sure
    assert surface.motion.position[0] - x > 0.03, 'where he is is told all the same'


@pytest.mark.parametrize('sure', [True, False])
def test_nothing_but_the_place_is_learned_of_who_may_be_somebody_else(sure: bool):
    watched = Watched()
    one = watched.walk(-1.0, 0.0, 3.0, RED)
    views = len(one.gallery.views)

    def found(account: Account):
        return {one.number: account.sights[0].seen}

    unsure = () if sure else {one.number}
    for i in range(3):
        x = 0.1 * i
        watched.see(Someone(x, 3.0, GREEN), targets=found, unsure=unsure)
    assert one.place[0] == pytest.approx(x, abs=0.02)
    assert (len(one.gallery.views) == views) == (not sure)


@pytest.mark.parametrize(('views', 'learned'), [(0, True), (4, False)])
def test_who_is_cut_off_at_a_side_is_not_learned_once_he_is_known(views: int, learned: bool):
    watched = Watched()
    one = watched.walk(-1.0, 0.0, 3.0, RED)
    know_more(one, views)
    known = len(one.gallery.views)
    for _ in range(3):
        watched.see(Someone(0.0, 3.0, DARK_RED, GREY), Someone(0.3, 2.4, BLUE))
    assert (len(one.gallery.views) > known) == learned


@pytest.mark.parametrize(
    ('mine', 'chosen', 'learned'),
    [(0.4, False, False), (0.7, False, True), (0.7, True, False), (1.7, True, True)],
)
def test_of_others_the_likeliest_is_learned_but_not_what_may_be_the_chosen_one(
    mine: float, chosen: bool, learned: bool
):
    watched = Watched()
    account, (column, _) = watched.beside(RED, BLUE)
    one, other = who(account, 0), who(account, 1)
    one, other = (one, other) if column == 0 else (other, one)
    other.chosen = chosen
    account.odds[account.people.index(one), column] = mine
    account.odds[account.people.index(other), column] = 0.5
    account.sights[column] = dataclasses.replace(account.sights[column], view=look(GREEN, GREY))
    known = len(one.gallery.views)
    watched.crowd.learn(account, {})
    assert (len(one.gallery.views) > known) == learned


def test_of_what_is_too_small_for_a_figure_no_figure_is_asked():
    """Of whom little showed at the image's side, all that showed later was refused."""
    watched = Watched()
    watched.see(Someone(0.0, 3.0, RED), Someone(1.2, 3.0, BLUE))
    account = watched.see(Someone(0.0, 3.0, RED), Someone(1.2, 3.0, BLUE))
    one, seen = who(account, 0), account.sights[1].seen
    assert account.claim(one, seen).assigned == -1
    one.area = 0.5 * SMALL
    assert account.claim(one, seen).assigned == 1


def test_what_belongs_to_one_who_was_met_cannot_be_claimed():
    watched = Watched()
    account, columns = watched.beside(RED, BLUE)
    one = who(account, columns[0])
    others = account.others(one)
    mine, theirs = (account.sights[c].seen for c in columns)
    assert others.share(theirs) == 1
    assert others.share(mine) == 0
    assert others.within(theirs.rows, theirs.cols)[theirs.mask].all()
    assert account.stranger(one, columns[1]) is None
    claim, wrong = account.claim(one, mine), account.claim(one, theirs)
    assert claim.mine > 0
    assert claim.rival < claim.mine
    assert wrong.rival > wrong.mine
    assert account.probability(one, columns[0]) > 0.9
    assert account.probability(one, columns[1]) < 0.1


@pytest.mark.parametrize('away', [True, False])
def test_a_view_that_is_rather_one_of_somebody_who_is_away_is_not_learned(away: bool):
    watched = Watched()
    one = watched.walk(-1.0, 0.0, 3.0, RED)
    know_more(one, ALL_SIDES)
    if away:
        other = watched.crowd.welcome(np.array([2.0, 6.0]), watched.time - 0.5)
        other.gallery.learn(look(RED, GREY), watched.time - 0.5)
    known = len(one.gallery.views)
    for _ in range(3):  # he is where he was, and looks as the other one did
        account = watched.see(Someone(0.0, 3.0, RED, GREY))
        assert who(account, 0) is one
    assert (len(one.gallery.views) > known) == (not away)


def met(number: int, place: tuple[float, float], learned: View) -> Person:
    """Somebody who was known by one view long ago."""
    person = Person(number, np.array(place), 0.0)
    person.gallery.learn(learned, 0.0)
    return person


def held(people: Sequence[Person], seen: Sequence[View], away: Sequence[Person] = ()):
    """Those in view, of whom some are seen, and those who are away."""
    everyone = [*people, *away]
    looks = Looks.joined([p.gallery.looks for p in everyone if p.gallery.looks is not None])
    ends = itertools.accumulate((len(p.gallery.views) for p in everyone), initial=0)
    his = list(itertools.starmap(slice, itertools.pairwise(ends)))
    here = [
        Followed(person, person.place, view, Compared.of(view, looks), mine)
        for person, view, mine in zip(people, seen, his, strict=False)
    ]
    return here, list(zip(away, his[len(people) :], strict=True))


@pytest.mark.parametrize('chosen', [True, False])
def test_what_was_learned_in_a_return_that_is_not_borne_out_tells_nobody(chosen):
    """By one sight a stranger was taken for who had gone, and both were learned as one for good."""
    watched = Watched()
    one = watched.walk(-1.0, 0.0, 3.0, RED)
    views = len(one.gallery.views)
    watched.crowd._comebacks.add(one, watched.time, against=10.0)
    one.gallery.learn(look(BLUE, GREY), watched.time + 0.05)
    one.chosen = chosen
    account = watched.see(Someone(0.05, 3.0))
    assert who(account, 0) is one
    assert len(one.gallery.views) == views + 1, 'more of him may show'
    for _ in range(4):
        watched.see(Someone(0.05, 3.0), dt=0.2)
    # What is learned of him from now on is as doubtful, until he is chosen or is somebody else.
    comebacks = watched.crowd._comebacks
    assert comebacks.trust(one) == (math.inf if chosen else pytest.approx(-10, abs=6))
    one.chosen = True
    assert comebacks.trust(one) == math.inf
    one.chosen = chosen
    # Who was chosen is asked for elsewhere whether he is the one who came back.
    assert (one.gallery.log_odds(look(BLUE, GREY)) > 0) == chosen


@pytest.mark.parametrize(
    ('looks', 'hidden', 'gone', 'found'),
    [
        (GREEN, GREEN, 2.0, True),
        (RED, GREEN, 2.0, False),  # he is still the one
        (BLUE, GREEN, 2.0, False),  # turned round
        (RED, RED, 2.0, False),  # twins
        (GREEN, GREEN, 2.0 * HIDDEN_FOR, False),
    ],
)
@pytest.mark.parametrize('chosen', [False, True])
def test_who_came_out_beside_another_and_has_his_number_is_who_was_hidden(
    looks, hidden, gone, found, chosen
):
    """In a group one came out behind another who was hidden then, and was he from then on."""
    views = look(looks, looks), look(GREY, GREY)
    known = look(RED, RED), look(GREY, GREY)
    people = [met(n, (0.5 * n, 3.0), known[n]) for n in range(2)]
    other = met(2, (0.0, 3.5), look(hidden, hidden))
    other.chosen = chosen
    here, missing = held(people, views, [other])
    watch = MixUps()
    times = [10.0 + 0.1 * i for i in range(8)]
    other.seen_at = times[0] - gone
    said = [watch.watch(here, missing, time) for time in times]
    assert said[0] is None, 'one sighting is too little'
    if not found:
        assert not any(said)
        return
    first = next(each for each in said if each is not None)
    # Who was chosen is recognised by who follows him: there stands somebody new.
    assert first == (here[0].person, None if chosen else other, other.seen_at)


@pytest.mark.parametrize(
    ('new', 'own', 'beside', 'found'),
    [
        (RED, GREEN, 0.4, True),
        (GREEN, RED, 0.4, False),  # he is still the one
        (RED, RED, 0.4, False),  # twins
        (GREEN, GREEN, 0.4, False),  # turned round, beside something that looks like that side
        (RED, GREEN, 2.0, False),  # nobody's figure held them both
    ],
)
def test_of_one_figure_that_turns_out_to_be_two_he_is_who_looks_as_he_did_before(
    new, own, beside, found
):
    """Both were learned as he while they were one, and his number went with either."""
    views = look(own, GREY), look(new, GREY)
    one = Person(0, np.array([0.0, 4.8]), 0.0, chosen=True)
    one.gallery.learn(look(RED, GREY), 0.0)
    one.gallery.learn(look(GREEN, GREY), 9.8)
    newcomer = Person(1, np.array([beside, 4.8]), 10.0)
    watch, said = MixUps(), []
    for time in (10.0 + 0.1 * i for i in range(7)):
        here = [who for who in (one, newcomer) if who.first_seen < time]
        said.append(watch.watch(*held(here, views), time))
        one.seen_at = newcomer.seen_at = time
    assert not any(said[:3]), 'one sighting is too little'
    if found:
        mixed_up = next(each for each in said if each is not None)
        assert mixed_up[:2] == (one, newcomer)
        assert 8.5 < mixed_up.since < 9.8
    else:
        assert not any(said)


@pytest.mark.parametrize(
    ('left', 'lies', 'another'), [(0.05, False, True), (0.3, False, False), (0.05, True, False)]
)
def test_who_comes_in_just_where_another_goes_out_is_somebody_else_if_he_looks_otherwise(
    left: float, lies: bool, another: bool
):
    """No frame showed nobody: of the one a leg was left in the image when the other came in.

    In who lies nothing is where it was in who stood, so that his looks say nothing.
    """
    stands = look(GREEN, GREEN)
    views = (dataclasses.replace(stands, top=0.4) if lies else stands,)
    one = met(0, (0.0, 3.0), look(RED, RED))
    one.gallery.stature.learn(Height(1.7, 3.0, 0.0, False))
    view = DepthView(np.full((60, 80), 3.0, np.float32), 1, CAMERA)
    leg = Silhouette.trimmed(view, 0, 40, np.ones((20, 10), bool), Rim())
    watch, said = MixUps(), []
    watch.watch([], [], 9.9)
    one.seen_at, area = 9.9, left
    for time in (10.0 + 0.1 * i for i in range(8)):
        one.last = dataclasses.replace(leg, area=area)
        said.append(watch.watch(*held([one], views), time))
        one.seen_at, area = time, 0.5
    assert any(said) == another


@pytest.mark.parametrize('lost', [True, False])
def test_who_comes_where_another_was_lost_is_somebody_new_if_he_looks_otherwise(lost: bool):
    watched = Watched()
    one = watched.walk(-1.0, 0.0, 3.0, RED)
    know_more(one, ALL_SIDES)
    for _ in range(2 * lost):
        watched.see()
    views = list(one.gallery.views)
    taken_for = [who(watched.see(Someone(0.0, 3.0, (40, 80, 190), (90, 60, 60))), 0)]
    for _ in range(7):
        account = watched.see(Someone(0.0, 3.0, (40, 80, 190), (90, 60, 60)))
        taken_for.append(who(account, 0))
    assert taken_for[0] is one, 'by his place he may be he'
    assert (taken_for[-1] is one) == (not lost)  # nobody changes clothes before the camera
    if lost:
        assert one.gallery.views == views, 'what was learned is taken back'
        assert account.time - one.seen_at > 0.6
        assert taken_for[-1].number != one.number


def test_two_who_were_taken_for_one_another_go_on_as_each_other_with_what_was_learned_since():
    one, other = (Person(n, np.array([n, 3.0]), 0.0) for n in range(2))
    for person, before, since in ((one, RED, GREEN), (other, GREEN, RED)):
        person.gallery.learn(look(before), 0.0)
        person.gallery.learn(look(since, BLUE), 5.0)
        person.moved_to(person.place + 0.1, 5.0 + person.number)
    one.exchange(other, 4.0)
    assert (one.place[0], one.seen_at) == (1.1, 6.0)
    assert (other.place[0], other.seen_at) == (0.1, 5.0)
    for person, shirt, others in ((one, RED, GREEN), (other, GREEN, RED)):
        assert len(person.gallery.views) == 2
        assert person.gallery.log_odds(look(others, BLUE)) < 0
        assert person.gallery.log_odds(look(shirt, BLUE)) > 0


def test_who_came_beside_one_who_had_his_number_can_be_given_it_back():
    """He had been seen beside his own number, and so was somebody else for good."""
    crowd = Crowd()
    taken, beside, newcomer, before = (crowd.welcome(np.zeros(2), t) for t in (0.0, 0.0, 5.0, 0.0))
    for each in (beside, newcomer):
        each.meet(taken)
    before.meet(newcomer)
    crowd._comebacks.add(taken, 4.0, 0.0)
    crowd._exchange(taken, None, 4.0)
    assert crowd._comebacks.trust(taken) == math.inf
    stranger = crowd.people[-1]
    assert stranger.met == {newcomer.number}
    assert newcomer.met == {stranger.number, before.number}
    assert taken.met == {beside.number}
    assert beside.met == {taken.number}


def test_the_crowd_is_bounded_and_forgets_no_one_who_was_chosen():
    crowd = Crowd()
    chosen = crowd.welcome(np.zeros(2), 0.0, chosen=True)
    walker = crowd.welcome(np.zeros(2), 0.5)
    walker.travelled = 2.0
    for i in range(3 * MOST_PEOPLE):
        one = crowd.welcome(np.zeros(2), 1.0 + i)
        one.meet(chosen)
        resemble(chosen, one.number, 1.0, 1.0, 1.0 + i)
    assert len(crowd.people) == MOST_PEOPLE + 1
    assert chosen.met == {person.number for person in crowd.people} - {1, 2}
    assert set(chosen._resembles) == chosen.met, 'nothing grows with who came and went'
    assert chosen in crowd.people
    assert walker in crowd.people, 'things that were moved are forgotten before people'
    numbers = [person.number for person in crowd.people]
    assert len(set(numbers)) == len(numbers)


# -- the chosen one -------------------------------------------------------------------------------


def test_surface_of_a_box_is_the_one_it_is_drawn_about():
    watched = Watched()
    left, right = Someone(-0.6, 3.0, RED), Someone(0.6, 3.0, BLUE)
    account = watched.see(left, right)
    for one in (left, right):
        seen = surface_of(account, one.box, MetricParameters())
        assert seen is not None
        assert box_about(account.scene, seen).iou(one.box) > 0.9
    assert surface_of(account, Box(5, 5, 20, 20), MetricParameters()) is None


@pytest.mark.parametrize(
    ('left', 'wide', 'taken'),
    [(-1.0, 2.3, True), (0.4, 1.2, True), (0.8, 1.2, False)],
)
def test_a_figure_that_lies_in_the_box_is_the_target_though_limbs_are_missing(left, wide, taken):
    watched = Watched()
    one = Someone(0.0, 3.0, RED)
    account = watched.see(one)
    x, y, width, height = one.box.as_tuple()
    drawn = Box(x + left * width, y, wide * width, height)
    assert one.box.iou(drawn) < 0.5
    assert (surface_of(account, drawn, MetricParameters()) is not None) == taken


@pytest.mark.parametrize('shows', [True, False])
def test_who_is_half_hidden_is_chosen_by_the_box_about_what_shows_of_him(shows: bool):
    """Who is nearer fills more of the box and overlaps it by half, but sticks out of it."""
    nearer = Someone(0.0, 2.6)
    color, depth = images([nearer])
    b = nearer.box
    drawn = Box(b.x - 12, b.y + 5, b.width + 16, 0.75 * b.height)
    assert drawn.iou(b) > 0.5
    if shows:
        part = depth[round(drawn.y) : round(drawn.bottom), round(drawn.x) : round(drawn.right)]
        part[part == WALL] = 3.2
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    seen = surface_of(Crowd().explain(scene, 0.0), drawn, MetricParameters())
    assert seen is not None
    assert seen.depth == pytest.approx(3.2 if shows else nearer.z, abs=0.05)


@pytest.mark.parametrize('shows', [0.35, 0.1])
def test_where_the_depth_image_ends_the_rest_of_the_box_tells_what_it_is_about(shows):
    one = Someone(0.0, 3.0)
    color, depth = images([one])
    depth[:, : round(one.box.right - shows * one.box.width)] = np.nan
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    seen = surface_of(Crowd().explain(scene, 0.0), one.box, MetricParameters())
    assert (seen is not None) == (shows == 0.35)


def test_what_sticks_out_of_the_given_box_is_not_the_target():
    watched = Watched()
    one = Someone(0.0, 3.0, RED)
    account = watched.see(one)
    upper = Box(one.box.x, one.box.y, one.box.width, 0.7 * one.box.height)
    seen = surface_of(account, upper, MetricParameters())
    assert seen is not None
    assert box_about(account.scene, seen).iou(upper) > 0.85


@pytest.mark.parametrize(
    ('part', 'whole'),
    [
        ((0.0, 0.0, 1.0, 0.4), True),  # head and trunk
        ((0.2, 0.2, 0.6, 0.3), True),  # the trunk alone
        ((0.3, 0.0, 0.4, 0.16), False),  # a face
        ((0.7, 0.3, 0.2, 0.2), False),  # a thing in his hand
    ],
)
def test_who_is_drawn_by_half_is_followed_as_a_whole(part, whole: bool):
    one = Someone(0.0, 2.5, RED)
    x, y, width, height = part
    b = one.box
    drawn = Box(b.x + x * b.width, b.y + y * b.height, width * b.width, height * b.height)
    targets = TargetSet('metric')
    number = targets.add(picture([one], 0.0), drawn)
    assert targets.metric is not None
    known = targets.metric.person(number)
    assert (known is not None) == whole
    for i in range(1, 4):
        one = Someone(0.3 * i, 2.5, RED)
        track = targets.update(picture([one], 0.5 * i))[number]
        if whole:
            assert track.box is not None
            assert track.box.iou(one.box) > 0.7


@pytest.mark.parametrize('read', [True, False])
def test_a_box_half_beside_somebody_means_him_where_nothing_else_is_there(read: bool):
    one = Someone(0.0, 2.5)
    color, depth = images([one])
    b = one.box
    if not read:  # who stands there beyond depth's reach
        depth[20:, round(b.x) - 30 : round(b.x)] = np.nan
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    drawn = b.moved(-0.5 * b.width, 0.2 * b.height)
    seen = surface_of(Crowd().explain(scene, 0.0), drawn, MetricParameters())
    assert (seen is not None) == read
    assert seen is None or box_about(scene, seen).iou(b) > 0.9


@pytest.mark.parametrize('other', ['nobody', 'behind', 'aside'])
def test_a_box_that_holds_a_side_of_somebody_means_him_unless_it_shows_somebody_behind_him(
    other: str,
):
    one = Someone(0.0, 2.5)
    b = one.box
    drawn = b.moved(-0.6 * b.width, 0)
    people = {'nobody': [], 'behind': [Someone(-0.3, 3.5)], 'aside': [Someone(-0.52, 2.0)]}
    color, depth = images([one, *people[other]])
    above = depth[: round(b.cy) - 20]
    above[above == 3.5] = WALL  # only the middle of who is behind shows
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    seen = surface_of(Crowd().explain(scene, 0.0), drawn, MetricParameters())
    assert (seen is not None and box_about(scene, seen).iou(b) > 0.9) == (other != 'behind')


def test_who_shows_at_the_end_of_depth_is_not_meant_by_a_box_that_lies_mostly_beyond_it():
    """In the columns that depth reaches nobody else was there."""
    one = Someone(0.0, 2.5)
    color, depth = images([one])
    b = one.box
    depth[:, : round(b.x) - 5] = np.nan
    drawn = Box(b.x - 53, b.y, 67, b.height)
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    assert drawn.iou(b) > 0.15
    assert surface_of(Crowd().explain(scene, 0.0), drawn, MetricParameters()) is None


def test_of_whom_depth_shows_an_arm_and_a_leg_where_it_ends_colour_tells_the_rest():
    """By what showed of him nobody was he, himself among them, and he was lost for good."""
    one = Someone(0.5, 2.5)
    color, depth = images([one])
    left, hips = round(one.box.x), round((TOP + 0.95) * CAMERA.fy / one.z + CAMERA.cy)
    depth[:, left + 19 :] = np.nan
    trunk = depth[:hips, left + 2 :]
    trunk[trunk == one.z] = np.nan
    targets = MetricTargets(MetricParameters())
    number = targets.add(Frame(color, depth, 0, CAMERA), one.box)
    assert targets._followers[number].seen is not None
    person = targets.person(number)
    assert person is not None
    for shirt in (RED, BLUE):
        reader = SceneReader(COLS, 0.04, 0.03, 0.0)
        for i in range(4):  # then he shows above a desk
            reader.read(picture([], 0.1 * i, DESK), 0.1)
        scene = reader.read(picture([Someone(0.0, 2.5, shirt)], 0.4, DESK), 0.1)
        assert scene is not None
        (sight,) = Crowd().explain(scene, 0.4).sights
        assert (person.gallery.log_odds(sight.view) > 0) == (shirt == RED)


@pytest.mark.parametrize(('told', 'taken'), [(20, False), (34, True)])
def test_what_shows_in_less_than_half_of_a_box_where_depth_ends_is_not_what_it_is_about(
    told: int, taken: bool
):
    """A strip of who stood behind, in the third of the box that depth reached, was the target."""
    color, depth = images([])
    box = Box(40, 30, 60, 100)
    depth[:, : 100 - told] = np.nan
    depth[50:130, 100 - told : 100] = 3.2
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    seen = surface_of(Crowd().explain(scene, 0.0), box, MetricParameters())
    assert (seen is not None) == taken


@pytest.mark.parametrize('broad', [True, False])
def test_what_has_no_shape_of_a_person_is_not_followed_whole_for_a_part_of_it(broad: bool):
    depth = np.full((ROWS, COLS), WALL, np.float32)
    depth[40:130, 60 if broad else 90 : 180 if broad else 135] = 2.5  # a cupboard, or a post
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(
        Frame(np.full((ROWS, COLS, 3), 90, np.uint8), depth, 0, CAMERA), 0.1
    )
    assert scene is not None
    drawn = Box(92, 42, 40, 34)
    assert surface_of(Crowd().explain(scene, 0.0), drawn, MetricParameters()) is None


def test_the_room_that_shows_where_a_target_was_from_the_first_frame_on_is_not_the_target():
    """Nothing was known of the room when it was chosen, as part of a large surface."""
    rng = np.random.default_rng(5)
    pattern = cv2.resize(rng.integers(0, 255, (20, 30, 3), np.uint8), (COLS, ROWS))
    targets = TargetSet('metric')

    def frame(i: int, there: bool) -> Frame:
        depth = np.full((ROWS, COLS), 2.8, np.float32)
        depth[30:140, 20:220] = 2.5 if there else 2.8
        return Frame(pattern.copy(), depth, round(5e8 * i), CAMERA)

    number = targets.add(frame(0, True), Box(90, 60, 50, 50))
    for i in range(1, 14):
        track = targets.update(frame(i, i < 8))[number]
        if i < 8:
            assert track.box is not None
        if i > 9:
            assert track.box is None


def test_who_passes_before_a_half_hidden_target_is_not_taken_for_it():
    target, board = Someone(0.0, 3.5), Box(80, 0, 33, 160)
    tracker = create_tracker('metric')
    for i in range(8):
        passer = Someone(0.2 + 0.05 * i, 3.3, GREEN, GREY)
        frame = picture([target, passer], 0.1 * i, board)
        track = tracker.start(frame, target.box) if i == 0 else tracker.update(frame)
        assert track.box is not None
        # All of him by his look, or the part that shows beside the board, once that is a figure.
        assert track.box.iou(target.box) > 0.4
        assert track.box.iou(passer.box) < 0.5
        assert track.depth is None or track.depth > 3.4


def test_a_target_of_whom_depth_has_few_readings_is_followed_by_them():
    """As far off in a doorway: a fifth of the pixels, and none of what is behind."""
    rng = np.random.default_rng(1)
    tracker = create_tracker('metric')
    for i in range(8):
        one = Someone(-0.2 + 0.05 * i, 3.0)
        color, depth = images([one])
        if i < 3:
            box = one.box
            door = slice(int(box.y) - 3, int(box.bottom) + 3), slice(50, 190)
            gone = (depth[door] > one.z) | (rng.random(depth[door].shape) > 0.2)
            depth[door][gone] = np.nan
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
        assert track.box is not None
        assert track.box.iou(one.box) > 0.9
        if i == 0 or i > 2:
            assert track.depth == pytest.approx(one.z, abs=0.05)


@pytest.mark.parametrize(
    ('share', 'rows', 'cols', 'found'),
    [
        (0.2, (0.4, 0.6), (0.1, 1.3), True),
        (0.4, (0.0, 0.6), (0.2, 1.3), False),  # it fits the box as well
    ],
)
def test_few_readings_are_followed_unless_what_is_nearer_may_be_meant_as_well(
    share: float, rows: tuple[float, float], cols: tuple[float, float], found: bool
):
    """An arm before the middle of his box was enough for nobody to be there."""
    one = Someone(0.0, 3.0)
    color, depth = images([one])
    box = one.box
    door = slice(int(box.y) - 3, int(box.bottom) + 3), slice(50, 190)
    unread = np.random.default_rng(1).random(depth[door].shape) > share
    depth[door][(depth[door] > one.z) | unread] = np.nan
    top, bottom = (round(box.y + row * box.height) for row in rows)
    left, right = (round(box.x + col * box.width) for col in cols)
    color[top:bottom, left:right], depth[top:bottom, left:right] = GREY, 2.0
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    seen = surface_of(Crowd().explain(scene, 0.0), box, MetricParameters())
    assert (seen is not None) == found
    if seen is not None:
        assert seen.depth == pytest.approx(one.z, abs=0.05)


def test_what_shows_behind_a_target_that_touches_a_door_frame_is_not_the_target():
    one = Someone(0.0, 3.0)
    color, depth = images([one])
    x0, x1 = round(one.box.x), round(one.box.right)
    depth[:, :x0] = depth[:, x1:] = one.z + 0.05  # all but the door
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    seen = surface_of(Crowd().explain(scene, 0.0), one.box, MetricParameters())
    assert seen is None or seen.depth == pytest.approx(one.z, abs=0.1)


def test_a_target_that_shows_in_a_gap_between_two_who_are_nearer_is_not_they():
    color, depth = images([Someone(0.0, 3.5), Someone(-0.37, 2.0), Someone(0.37, 2.0)])
    box = Box(100, 45, 40, 70)
    strip = depth[45:115, 106:134]
    strip[(strip > 3.5) | (np.random.default_rng(1).random(strip.shape) > 0.3)] = np.nan
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    seen = surface_of(Crowd().explain(scene, 0.0), box, MetricParameters())
    assert seen is not None
    assert seen.depth == pytest.approx(3.5, abs=0.1)


def test_a_cupboard_behind_somebody_who_has_no_reading_is_not_he():
    one = Someone(0.0, 3.0)
    color, depth = images([one])
    b = one.box
    behind = np.s_[round(b.y) + 10 : round(b.bottom) - 10, round(b.x) : round(b.right)]
    depth[behind] = np.where(depth[behind] == one.z, np.nan, np.float32(4.6))
    depth[depth == one.z] = np.nan
    depth[:, round(b.cx) - 9 : round(b.cx) + 9] = np.nan  # nor do his arms show
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(Frame(color, depth, 0, CAMERA), 0.1)
    assert surface_of(Crowd().explain(scene, 0.0), b, MetricParameters()) is None


@pytest.mark.parametrize('above', [True, False])
def test_what_shows_through_a_door_and_above_the_box_is_not_whom_it_is_about(above: bool):
    depth = np.full((ROWS, COLS), 3.0, np.float32)
    drawn = Box(100, 50, 30, 80)
    door = depth[25 if above else 50 : 130, 95:135]
    door[...], door[::3] = 4.5, np.nan  # strips that do not hang together
    depth[50:130, 119:135] = 2.9  # somebody who is one surface with the wall
    frame = Frame(texture(0), depth, 0, CAMERA)
    scene = SceneReader(COLS, 0.04, 0.03, 0.0).read(frame, 0.1)
    seen = surface_of(Crowd().explain(scene, 0.0), drawn, MetricParameters())
    assert (seen is None) == above


def test_who_touches_a_cupboard_of_his_depth_is_chosen_without_it():
    """He and it are one surface, nearly twice as wide as what shows of him beside a post."""
    targets, post = TargetSet('metric'), Box(80, 0, 28, ROWS)
    for i in range(10):
        one = Someone(0.0, 3.0 - 0.12 * max(i - 4, 0))
        color, depth = images([one], post)
        cupboard = np.s_[31:137, 134:158]
        before = depth[cupboard] > 3.0
        color[cupboard][before], depth[cupboard][before] = GREY, 3.0
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        b = one.box
        shows = Box.from_corners(post.right, b.y, b.right, b.bottom)
        if i == 0:
            number = targets.add(frame, Box(shows.x, shows.y, shows.width, ROWS - shows.y))
            continue
        track = targets.update(frame)[number]
        assert track.box is not None
        assert track.box.iou(shows) > 0.7


def finds(look: Look | None):
    """A step of a look that finds just that."""

    def step(by_look: ByLook, frame: Frame, dt: float, *args: object) -> Look | None:
        by_look.unseen += dt
        return look

    return step


@pytest.mark.parametrize('own', [False, True])
def test_who_comes_in_where_a_strip_was_chosen_is_the_target_if_he_has_its_colours(
    own: bool, monkeypatch: pytest.MonkeyPatch
):
    """At the side of the image there is no depth; more of him shows than was chosen."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    tracker = create_tracker('metric')
    for i in range(8):
        paint = {} if own or i == 0 else {'shirt': GREEN, 'trousers': BLUE}
        one = Someone(-1.35 + 0.2 * i, 2.2, **paint)
        color, depth = images([one])
        depth[:, :30] = np.nan
        frame, shown = Frame(color, depth, round(1e8 * i), CAMERA), one.box.clipped(COLS, ROWS)
        assert shown is not None
        track = tracker.start(frame, shown) if i == 0 else tracker.update(frame)
    assert (track.box is not None) == own
    if track.box is not None:
        assert track.box.iou(one.box) > 0.9


@pytest.mark.parametrize('near', [False, True])
def test_who_comes_in_far_larger_than_who_was_chosen_passes_before_the_target(
    near: bool, monkeypatch: pytest.MonkeyPatch
):
    """A passer at a metre, in colours like the target's at four, was the target at 0.99."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    tracker = create_tracker('metric')
    chosen = Someone(-2.3, 4.4)
    for i in range(8):
        z = 1.6 if near else 4.4
        one = chosen if i == 0 else Someone((20.0 * i - 120.0) * z / CAMERA.fx, z)
        color, depth = images([one])
        depth[:, :30] = np.nan
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        track = tracker.start(frame, chosen.box) if i == 0 else tracker.update(frame)
        if track.box is not None and i:
            break
    assert (track.box is None) == near


@pytest.mark.parametrize('walked', [True, False])
def test_who_was_chosen_far_off_may_have_come_near_since(
    walked: bool, monkeypatch: pytest.MonkeyPatch
):
    """He is three times as high: a frame a second, he has walked for three; else he passes."""
    look = Look(Someone(-2.1, 4.4).box, 0.95, 0.95, None)
    monkeypatch.setattr(ByLook, 'step', finds(look))
    tracker = create_tracker('metric')
    for i in range(4):
        one = Someone(-0.58, 1.3) if i == 3 else Someone(-2.1, 4.4)
        color, depth = images([one])
        depth[:, :40] = np.nan
        stamp = round((1.0 if walked else 0.1) * 1e9 * i)
        frame = Frame(color, depth, stamp, CAMERA)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    shown = one.box.clipped(COLS, ROWS)
    assert track.box is not None
    assert shown is not None
    assert (track.box.iou(shown) > 0.8) == walked


@pytest.mark.parametrize(('pace', 'own'), [(1.2, True), (1.2, False), (5.0, True)])
def test_who_has_taken_a_step_before_depth_shows_him_is_the_target(
    pace: float, own: bool, monkeypatch: pytest.MonkeyPatch
):
    """He was chosen where depth sees nothing, and his look was lost; nobody runs at 5 m/s."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    tracker = create_tracker('metric')
    for i in range(8):
        paint = {} if own or i == 0 else {'shirt': GREEN, 'trousers': BLUE}
        one = Someone(-0.5 + 0.1 * pace * i, 3.0, **paint)
        unread = one if i < 4 else None
        frame = picture([one], 0.1 * i, unread=unread)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
        assert i == 0 or i > 3 or track.box is None
    assert (track.box is not None) == (own and pace < 2)
    if track.box is not None:
        assert track.box.iou(one.box) > 0.9


@pytest.mark.parametrize('ratio', [0.65, 0.95])
def test_what_the_target_stood_before_is_not_it_where_who_has_come_from_there_may_be(
    ratio: float, monkeypatch: pytest.MonkeyPatch
):
    """A frame a second: the wall at the image's side was the target for a minute, at 0.9."""
    monkeypatch.setattr(Drawn, 'of', lambda *args: None)  # as where not all of him is drawn
    tracker = create_tracker('metric')
    for i in range(2):
        one = Someone(-0.7 + 0.6 * i, 3.0)
        unread = one if i == 0 else None
        frame = picture([one], 1.0 * i, unread=unread)
        if i == 0:
            chosen = one.box
            tracker.start(frame, chosen)
            look = Look(chosen, ratio, ratio, None)
            monkeypatch.setattr(ByLook, 'step', finds(look))
        track = tracker.update(frame)
    assert track.box is not None
    assert track.box.iou(one.box if ratio < 0.7 else chosen) > 0.9


@pytest.mark.parametrize('gone', [True, False])
def test_the_wall_that_somebody_stood_before_where_depth_ends_is_not_he(
    gone: bool, monkeypatch: pytest.MonkeyPatch
):
    """The look had gone over to the frame of the door in which he had stood, at 0.9."""
    tracker = create_tracker('metric')
    one = Someone(0.2, 4.4)
    for i in range(4):
        color, depth = images([one] if i == 0 or not gone else [])
        depth[depth > 4] = np.nan
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        if i == 0:
            tracker.start(frame, one.box)
            look = Look(one.box, 0.95, 0.95, None)
            monkeypatch.setattr(ByLook, 'step', finds(look))
        else:
            track = tracker.update(frame)
            assert (track.box is None) == gone


@pytest.mark.parametrize('gone', [True, False])
def test_the_wall_where_somebody_walked_out_of_reach_of_depth_is_not_he(
    gone: bool, monkeypatch: pytest.MonkeyPatch
):
    """Before a camera that reads up to 4.5 m walls were those who had walked there, at 0.9."""
    looked = []

    def glance(self: ByLook, frame: Frame, box: Box, *args: object, **named: object) -> Look:
        looked.append(box)
        return Look(box, 0.95, 0.95, None)

    monkeypatch.setattr(ByLook, 'glance', glance)
    tracker = create_tracker('metric')
    for i in range(14):
        one = Someone(0.2, 3.4 + 0.1 * i)
        color, depth = images([one] if i < 10 or not gone else [])
        depth[depth > 4.25] = np.nan
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    assert looked
    assert (track.box is None) == gone


def test_of_whom_depth_reads_no_more_the_room_beside_him_is_not_how_he_looks(
    monkeypatch: pytest.MonkeyPatch,
):
    """Where his colours are the wall's, too, he seemed to look as that does, and was hidden."""
    own = np.ones((ROWS, COLS), np.float32)  # colours tell him from nothing
    monkeypatch.setattr(ByLook, 'own', lambda self, image: own[: len(image), : image.shape[1]])
    reader, one = SceneReader(COLS, 0.04, 0.03, 0.0), Someone(0.2, 2.6)
    for i in range(4):
        frame = picture([one], 0.1 * i)
        scene = reader.read(frame, 0.1)
    assert scene is not None
    (figure,) = find_figures(scene, np.zeros((0, 2)))
    gallery = Gallery()
    gallery.learn(look_of(scene, figure.seen), 0.3)
    by_look = ByLook(frame, one.box, MetricParameters())
    # The box of a look is as broad as his longest stride.
    stride = Box(one.box.cx - 2 * one.box.width, one.box.y, 4 * one.box.width, one.box.height)
    unread = reader.read(picture([one], 0.4, unread=one), 0.1)
    assert unread is not None
    seen = view_in(unread, stride, by_look, one.z)
    assert seen is not None
    assert gallery.log_odds(seen) > 3
    # Where nobody is left the box shows nothing of him.
    gone = reader.read(picture([], 0.5), 0.1)
    assert gone is not None
    assert view_in(gone, stride, by_look, one.z) is None


@pytest.mark.parametrize('x', [None, 0.45, 1.4])
def test_of_whom_another_hides_a_part_not_all_was_drawn(
    x: float | None, monkeypatch: pytest.MonkeyPatch
):
    """What showed of him behind another was all that he looked like: he was never known again."""
    own = np.ones((ROWS, COLS), np.float32)
    monkeypatch.setattr(ByLook, 'own', lambda self, image: own[: len(image), : image.shape[1]])
    reader, one = SceneReader(COLS, 0.04, 0.03, 0.0), Someone(0.2, 2.6)
    beside = [] if x is None else [Someone(x, 2.0, GREEN, GREY)]
    for i in range(4):
        reader.read(picture([], 0.1 * i), 0.1)
    frame = picture([one, *beside], 0.4, unread=one)
    scene = reader.read(frame, 0.1)
    assert scene is not None
    account = Crowd().explain(scene, 0.4)
    drawn = Drawn.of(account, one.box, ByLook(frame, one.box, MetricParameters()))
    assert drawn is not None
    assert drawn.whole == (x != 0.45)


def test_whoever_has_passed_beside_who_has_no_reading_is_not_he(
    monkeypatch: pytest.MonkeyPatch,
):
    """The look of a man whom depth does not show went along with the legs of one who passed."""
    tracker = create_tracker('metric')
    for i in range(14):
        one, passer = Someone(0.0, 3.0), Someone(1.4 - 0.1 * i, 2.0)  # in the same
        frame = picture([one, passer], 0.1 * i, unread=one)
        if i == 0:
            tracker.start(frame, one.box)
            continue
        beside = passer.box.intersection(one.box) == 0
        found = Look(one.box, 0.9, 0.9, None) if beside else Look(passer.box, 0.9, 0.9, passer.z)
        monkeypatch.setattr(ByLook, 'step', finds(found))
        track = tracker.update(frame)
        assert (track.box is not None) == beside
    assert not beside


def test_who_passes_before_who_has_no_reading_and_looks_unlike_him_is_not_he(
    monkeypatch: pytest.MonkeyPatch,
):
    """The look went along with one in purple for 18 frames, at 0.9, who was never beside him."""
    tracker = create_tracker('metric')
    for i in range(6):
        one, passer = Someone(0.0, 3.0), Someone(0.1 * i - 0.3, 2.0, GREEN, BLUE)
        passes = i > 3
        frame = picture([one, passer] if passes else [one], 0.1 * i, unread=one)
        found = Look(passer.box, 0.9, 0.9, 2.0) if passes else Look(one.box, 0.9, 0.9, None)
        monkeypatch.setattr(ByLook, 'step', finds(found))
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
        assert (track.box is None) == passes


@pytest.mark.parametrize('own', [True, False])
def test_who_comes_where_somebody_was_drawn_looks_as_he_did(
    own: bool, monkeypatch: pytest.MonkeyPatch
):
    """By colours alone one in a green shirt was he who was drawn in a white one, at 0.99."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    monkeypatch.setattr(
        ByLook, 'own', lambda look, image: np.full(image.shape[:2], 0.9, np.float32)
    )
    tracker = create_tracker('metric')
    for i in range(8):
        paint = {} if own or i == 0 else {'shirt': GREEN, 'trousers': BLUE}
        one = Someone(-0.1 + 0.02 * i, 3.0, **paint)
        unread = one if i == 0 else None
        frame = picture([one] if i == 0 or i > 4 else [], 0.1 * i, unread=unread)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    assert (track.box is not None) == own


@pytest.mark.parametrize('own', [True, False])
def test_who_was_drawn_where_depth_shows_nothing_is_known_when_he_comes_back(
    own: bool, monkeypatch: pytest.MonkeyPatch
):
    """He was lost for the rest of the recording, as nothing but his look had been known."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    tracker = create_tracker('metric')
    for i in range(12):
        paint = {} if own or i == 0 else {'shirt': GREEN, 'trousers': BLUE}
        one = Someone(0.8 - 0.15 * max(i - 4, 0), 4.4 if i == 0 else 2.8, **paint)
        color, depth = images([one] if i in (0, *range(4, 12)) else [])
        depth[depth > 4] = np.nan
        frame = Frame(color, depth, round(1e9 * i), CAMERA)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    assert (track.box is not None) == own
    if track.box is not None:
        assert track.box.iou(one.box) > 0.8


def test_who_is_known_again_is_followed_once_more_than_a_strip_of_him_shows(
    monkeypatch: pytest.MonkeyPatch,
):
    """A strip past somebody else was all of him from then on, and he was lost in full view."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    tracker = create_tracker('metric')
    for i in range(14):
        one = Someone(0.8 - 0.15 * max(i - 4, 0), 4.4 if i == 0 else 2.8)
        color, depth = images([one] if i in (0, *range(4, 14)) else [])
        depth[depth == WALL] = 3.9
        if i == 7:  # in the frame in which enough is known, what is nearer leaves one leg of him
            x, y = round(one.box.x) + 12, round(one.box.y) + 70
            color[:y], color[:, x:], depth[:y], depth[:, x:] = GREY, GREY, 1.5, 1.5
        depth[depth > 4] = np.nan
        frame = Frame(color, depth, round(1e9 * i), CAMERA)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    assert track.box is not None
    assert track.box.iou(one.box) > 0.8


def test_of_two_who_come_where_the_target_was_it_is_the_one_in_its_colours(
    monkeypatch: pytest.MonkeyPatch,
):
    """A frame a second: who came past the doorway it stood in covered more of its box, at 0.99."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    tracker = create_tracker('metric')
    target, other = Someone(0.0, 4.4), Someone(-0.1, 3.2, (60, 60, 170), BLACK)
    tracker.start(picture([target], 0.0, unread=target), target.box)
    target = Someone(0.45, 4.2)
    track = tracker.update(Frame(*images([target, other]), round(1e9), CAMERA))
    assert track.box is not None
    assert track.box.iou(target.box) > 0.8


def test_a_strip_that_shows_where_somebody_was_followed_by_his_look_is_not_he(
    monkeypatch: pytest.MonkeyPatch,
):
    """A piece of the wall, a tenth of his box, was he for the rest of the scene."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    tracker = create_tracker('metric')
    one = Someone(0.0, 2.5)
    x, y = round(one.box.cx), round(one.box.cy)
    for i in range(8):
        color, depth = images([one])
        depth[depth == one.z] = np.nan
        if i > 3:
            depth[y - 22 : y + 22, x - 4 : x + 4] = 4.2
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    assert track.box is None


@pytest.mark.parametrize(('silent', 'found'), [(2, True), (4, False)])
def test_who_comes_between_two_frames_came_in_time_if_the_first_was_in_time(
    silent: int, found: bool, monkeypatch: pytest.MonkeyPatch
):
    """A frame a second: the look is lost in the second, depth shows him in the third."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    tracker = create_tracker('metric')
    for i in range(silent + 1):
        one = Someone(-0.5 + 0.1 * i, 3.0)
        unread = one if i < silent else None
        frame = picture([one], 1.0 * i, unread=unread)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    assert (track.box is not None) == found


@pytest.mark.parametrize('own', [True, False])
def test_who_has_the_number_but_not_the_look_of_one_who_stood_beside_may_be_the_target(
    own: bool, monkeypatch: pytest.MonkeyPatch
):
    """Depth showed another; in the next frame he has gone and the target stands where he did."""
    monkeypatch.setattr(ByLook, 'step', finds(None))
    monkeypatch.setattr(
        ByLook, 'own', lambda look, image: np.full(image.shape[:2], 0.9, np.float32)
    )
    tracker = create_tracker('metric')
    beside = Someone(0.15, 3.1, GREEN, BLUE)
    for i in range(2):
        one = Someone(-0.5 + 0.55 * i, 3.0)
        unread = one if i == 0 else None
        frame = picture(
            [one, beside] if i == 0 else [one] if own else [beside], 0.5 * i, unread=unread
        )
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    assert (track.box is not None) == own
    if track.box is not None:
        assert track.box.iou(one.box) > 0.9


def test_who_stands_beside_the_target_when_it_is_chosen_has_met_it():
    """They are two, whatever they look like when they come back; a thing is no figure yet."""
    targets = TargetSet('metric')
    thing, other = Box(60, 90, 30, 40), Someone(0.6, 3.0)
    color, depth = images([other])
    depth[90:130, 60:90] = 3.0
    number = targets.add(Frame(color, depth, 0, CAMERA), thing)
    assert targets.metric is not None
    person = targets.metric.person(number)
    assert person is not None
    assert len(person.met) == 1


@pytest.mark.parametrize('side', [-1, 1])
def test_of_whom_depth_shows_a_part_colour_shows_the_rest_though_nobody_chose_him(side: int):
    """A registered depth image often covers less than the colour image."""
    targets = TargetSet('metric')
    targets.everyone = True
    for i in range(12):
        one = Someone(side * (0.2 + 0.1 * i), 3.0)
        color, depth = images([one])
        depth[:, :30] = depth[:, -30:] = np.nan
        tracks = targets.update(Frame(color, depth, round(1e8 * i), CAMERA))
    (track,) = tracks.values()
    assert track.box is not None
    assert track.box.iou(one.box) > 0.9


def test_of_two_who_touch_in_the_first_frame_one_is_chosen_alone():
    """Wider than a person, they are no part of the room, and not one."""
    tracker = create_tracker('metric')
    for i in range(4):
        # The other stays; the target has gone.
        pair = [Someone(-0.205, 3.0), Someone(0.205, 3.0, GREEN, BLUE)]
        wide = dataclasses.replace(pair[0].box, width=1.6 * pair[0].box.width)
        frame = picture(pair if i == 0 else pair[1:], 1.0 * i)
        track = tracker.start(frame, wide) if i == 0 else tracker.update(frame)
        assert (track.box is None) == (i > 0)


def test_a_look_does_not_go_over_to_who_stood_beside_in_the_first_frame(
    monkeypatch: pytest.MonkeyPatch,
):
    """Depth shows nothing of the target, but of him, who is somebody else."""
    one, other = Someone(-0.8, 3.5), Someone(0.7, 2.5)
    monkeypatch.setattr(ByLook, 'step', finds(Look(other.box, 1.0, 1.0, other.z)))
    tracker = create_tracker('metric')
    for i in range(6):
        frame = picture([one, other], 0.1 * i, unread=one)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
        assert i == 0 or track.box is None


@pytest.mark.parametrize('side', [-1, 1])
def test_of_two_who_are_one_figure_at_first_the_one_that_was_drawn_about_is_the_target(side: int):
    """Their heads are too close to be told apart; the box says where the target ends."""
    tracker = create_tracker('metric')
    for i in range(14):
        one = Someone(-0.16 * side, 3.0)
        # He stays for a while and goes away.
        other = Someone((0.16 + 0.08 * max(i - 7, 0)) * side, 3.06, trousers=BLUE)
        frame = picture([one, other], 0.1 * i)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
        assert track.box is not None
        assert track.box.iou(one.box) > 0.75


@pytest.mark.parametrize('behind', [0.12, 0.1])
def test_of_two_who_part_the_one_who_is_where_the_box_was_drawn_is_the_target(behind: float):
    """He steps aside as well, so that the box is about him no more than by half."""
    tracker = create_tracker('metric')
    for i in range(8):
        one, other = Someone(-behind - 0.05 * i, 3.0), Someone(0.15 * i, 2.94, GREEN, BLUE)
        frame = picture([one, other], 0.1 * i)
        drawn = Box.from_corners(one.box.x, one.box.y, other.box.x + 4, one.box.bottom)
        track = tracker.start(frame, drawn) if i == 0 else tracker.update(frame)
    assert track.box is not None
    assert track.box.iou(one.box) > 0.8


def test_both_of_two_who_are_one_figure_may_be_chosen():
    targets, numbers = TargetSet('metric'), []
    for i in range(14):
        step = 0.08 * max(i - 7, 0)
        pair = Someone(-0.16 - step, 3.0), Someone(0.16 + step, 3.06, GREEN, BLUE)
        frame = picture(list(pair), 0.1 * i)
        if i == 0:
            # Of the farther one the nearer hides a part.
            b = pair[1].box
            right = Box.from_corners(pair[0].box.right, b.y, b.right, b.bottom)
            numbers = [targets.add(frame, pair[0].box), targets.add(frame, right)]
            assert numbers[0] != numbers[1]
            continue
        tracks = targets.update(frame)
    for number, one in zip(numbers, pair, strict=True):
        box = tracks[number].box
        assert box is not None
        assert box.iou(one.box) > 0.75


@pytest.mark.parametrize('twin', [False, True])
def test_a_target_is_at_one_place_only(twin: bool):
    """Of two alike who come in, each alone would be the target; of both neither surely is."""
    one, covered = Someone(0.0, 3.0), Box(0, 0, COLS, ROWS)
    tracker = create_tracker('metric')
    tracker.start(picture([one], 0.0), one.box)
    for i in range(1, 20):
        tracker.update(picture([one], 0.1 * i, covered if i > 5 else None))
    here = [Someone(-0.5, 3.0), Someone(0.5, 3.0)][: 1 + twin]
    for i in range(20, 23):
        track = tracker.update(picture(here, 0.1 * i))
    assert (track.box is None) == twin


def turned(i: int, half: bool) -> tuple[Frame, Box, Box]:
    """Somebody whose one side is 0.15 m farther, and hidden if ``half``; what shows, and all."""
    one = Someone(0.0, 3.0)
    middle = round(one.box.cx)
    color, depth = images([one])
    depth[:, middle:][depth[:, middle:] == one.z] += 0.15
    if half:
        color[:, middle:], depth[:, middle:] = GREY, 1.0
    near = Box(one.box.x, one.box.y, middle - one.box.x, one.box.height)
    return Frame(color, depth, round(1e8 * i), CAMERA), near, one.box


def test_who_was_half_hidden_when_he_was_chosen_is_followed_whole_once_he_shows():
    targets = TargetSet('metric')
    targets.everyone = True
    for i in range(6):
        targets.update(picture([], 0.1 * i))
    for i in range(6, 11):
        frame, near, _ = turned(i, half=True)
        targets.update(frame)
        if i == 6:
            number = targets.add(frame, near)
    assert targets.metric is not None
    person = targets.metric.person(number)
    assert person is not None
    halves = list(person.gallery.views)
    assert halves
    for i in range(11, 14):
        frame, _, whole = turned(i, half=False)
        track = targets.update(frame)[number]
        assert track.box is not None
        assert track.box.iou(whole) > 0.9
        # His two sides are two surfaces, but no two places where he may be.
        assert track.score > 0.9
    assert targets.metric.person(number) is person
    assert not any(view is half for view in person.gallery.views for half in halves)


def test_who_once_showed_whole_is_not_taken_for_a_part_when_he_is_half_hidden_again():
    """What was known of her was dropped for a strip of her, and she was lost in full view."""
    targets = MetricTargets(MetricParameters())
    one = Someone(-0.1, 3.0)
    beside = Box(one.box.cx, 0, 60, ROWS)
    for i in range(8):
        frame = picture([one], 0.1 * i, beside if i == 0 else None)
        if i == 0:
            half = Box.from_corners(one.box.x, one.box.y, beside.x, one.box.bottom)
            number = targets.add(frame, half)
        else:
            targets.update(frame)
    followed, account = targets._followers[number], targets.account
    assert account is not None
    whole = account.sights[0].seen
    mask = whole.mask.copy()
    mask[:, mask.shape[1] // 3 :] = False
    part = dataclasses.replace(whole, mask=mask, area=whole.area / 3)
    assert followed.person is not None
    followed._partial = True
    assert followed._whole(account, followed.person, part) is None
    followed._shown = part.area
    assert followed._whole(account, followed.person, part) is whole


@pytest.mark.parametrize('camera', ['noisy', 'noisy and stirs', 'repeats itself'])
def test_what_does_not_stir_is_not_somebody_who_walked(camera: str):
    """At 1 Hz a covered chair came to light a metre beside him, and was he from then on."""
    targets = TargetSet('metric')
    assert targets.metric is not None
    rng = np.random.default_rng(1)
    one, chair = Someone(-0.3, 3.0), Someone(0.65, 2.7)
    number = targets.add(picture([one, chair], 0.0, Box(140, 0, 60, ROWS)), one.box)
    person = targets.metric.person(number)
    assert person is not None
    boxes = []
    for i in range(1, 7):
        x = chair.x + 0.04 * (i % 2) * (camera == 'noisy and stirs')
        # Who passes before it in the first of them hides some of it.
        passes = Box(176, 0, 30, ROWS) if i == 1 else None
        frame = picture([dataclasses.replace(chair, x=x)], float(i), passes)
        if camera != 'repeats itself':
            noise = rng.normal(0, 3, frame.color.shape)
            color = np.clip(frame.color + noise, 0, 255).astype(np.uint8)
            frame = dataclasses.replace(frame, color=color)
        boxes.append(targets.update(frame)[number].box)
    stays = camera != 'noisy'
    assert all(box is not None for box in boxes[:3])
    assert all((box is not None) == stays for box in boxes[3:])
    assert (person.seen_at > 1.0) == stays
    if not stays:  # nothing of it is known as his, and he may come back
        assert len(person.gallery.views) == 1
        back = Someone(-1.2, 3.2)
        for i in range(7, 12):
            track = targets.update(picture([chair, back], float(i)))[number]
        assert track.box is not None
        assert track.box.iou(back.box) > 0.8


@pytest.mark.parametrize('chosen', ['thing', 'stays'])
def test_things_and_who_stays_where_he_was_chosen_need_not_stir(chosen: str):
    targets = TargetSet('metric')
    one = Someone(0.0, 3.0)
    box = one.box if chosen == 'stays' else Box(110, 60, 30, 30)

    def frame(i: int, left: int = 0) -> Frame:
        color, depth = images([one] if chosen == 'stays' else [])
        if chosen == 'thing':
            rows, cols = slice(60, 90), slice(110 + left, 140 + left)
            color[rows, cols], depth[rows, cols] = RED, 2.0
        return Frame(color, depth, i * 10**9, CAMERA)

    number = targets.add(frame(0), box)
    for i in range(1, 12):
        track = targets.update(frame(i, 24 if i > 3 else 0))[number]
        assert track.box is not None, i


def test_who_turns_out_to_be_somebody_else_has_been_away_since_the_target_was_last_seen(
    monkeypatch: pytest.MonkeyPatch,
):
    """The step in which he was disowned counted twice: at 1 Hz a second too many."""
    monkeypatch.setattr(Comeback, 'denied', property(lambda comeback: True))
    one = Someone(0.0, 2.4)
    targets = TargetSet('metric')
    number = targets.add(picture([one], 0.0), one.box)
    for time in np.arange(1, 16) / 10:
        track = targets.update(picture([one] if time < 0.9 or time > 1.3 else [], time))[number]
    assert track.box is None
    assert targets.metric is not None
    followed = targets.metric._followers[number]
    assert followed._surface is not None
    assert followed._hidden_for == pytest.approx(0.7)
    assert followed._surface.hidden_for == pytest.approx(0.7)


@pytest.mark.parametrize(('behind', 'whole'), [(0.1, True), (0.45, False)])
def test_who_comes_out_from_behind_a_half_hidden_target_is_no_part_of_it(
    monkeypatch: pytest.MonkeyPatch, behind: float, whole: bool
):
    """They touched, and for a moment were one figure: the target became both, then the other."""
    started = []
    anew = follower.Follower._anew

    def watched(self, account, person, seen):
        started.append(seen)
        return anew(self, account, person, seen)

    monkeypatch.setattr(follower.Follower, '_anew', watched)
    targets = TargetSet('metric')
    targets.everyone = True
    for i in range(6):
        targets.update(picture([], 0.1 * i))
    one = Someone(0.0, 2.4)
    middle = round(one.box.cx)
    for i in range(6, 10):
        color, depth = images([one])
        if i < 9:
            color[:, middle:], depth[:, middle:] = GREY, 1.0  # hides his other half
        else:
            right = depth[:, middle:]
            farther = right == one.z
            ramp = one.z + np.minimum(behind, 0.08 * np.arange(1, right.shape[1] + 1))
            depth[:, middle:] = np.where(farther, ramp, right)
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        targets.update(frame)
        if i == 6:
            half = Box(one.box.x, one.box.y, middle - one.box.x, one.box.height)
            targets.add(frame, half)
    assert bool(started) == whole


@pytest.mark.parametrize(('read', 'whole'), [(3.0, True), (1.5, False), (None, False)])
def test_who_was_too_far_to_be_read_when_a_part_of_him_was_chosen_is_followed_whole_once_he_is(
    monkeypatch: pytest.MonkeyPatch, read: float | None, whole: bool
):
    """The look went on on a strip of him, with a score of 0.9, until he stood before the camera."""
    one = Someone(0.0, 3.0)
    strip = Box(one.box.x, one.box.y, 0.35 * one.box.width, one.box.height)
    targets = TargetSet('metric')
    for i in range(16):
        color, depth = images([one])
        if i < 8:
            depth[depth == one.z] = np.nan
        look = Look(strip, 1.0, 1.0, read if i >= 8 else None)
        monkeypatch.setattr(ByLook, 'step', finds(look))
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        if i == 0:
            number = targets.add(frame, strip)
            continue
        track = targets.update(frame)[number]
        assert track.box is not None
        if not 8 <= i <= 10:
            assert track.box.iou(one.box if whole and i > 10 else strip) > 0.8, i
    assert targets.metric is not None
    account = targets.metric.account
    assert account is not None
    people = [each for each in account.people if each.seen_at == account.time]
    assert len(people) == 1, 'he is nobody else besides'


def test_a_target_that_may_be_his_twin_has_not_met_him():
    targets = TargetSet('metric', MetricParameters(use_others=False))
    assert targets.metric is not None
    one, board = Someone(0.0, 3.0), Box(100, 0, 40, ROWS)
    number = targets.add(picture([one], 0.0), one.box)
    for i in range(1, 9):
        targets.update(picture([one], 0.1 * i, board if i > 5 else None))
    nearer, other = Someone(-0.6, 3.0), Someone(0.7, 3.0)
    track = targets.update(picture([nearer, other], 0.9, board))[number]
    assert track.box is not None
    assert track.score < 0.6
    target = targets.metric.person(number)
    assert target is not None
    assert target.place[0] == pytest.approx(nearer.x, abs=0.05)
    account = targets.metric.account
    assert account is not None
    # Nobody but the board, which came up at 1 m where he had been seen at 3 m a moment before.
    assert target.met == {p.number for p in account.people if p.place[1] < 1.5}


def holed(depth: np.ndarray, box: Box) -> None:
    """Take the readings in and closely about a box."""
    depth[int(box.y) - 4 : int(box.bottom) + 4, int(box.x) - 4 : int(box.right) + 4] = np.nan


@pytest.mark.parametrize(
    ('off', 'leaps', 'found'), [(0.25, False, True), (0.4, False, False), (1.2, True, False)]
)
def test_what_is_like_a_picture_is_another_one_where_that_did_not_hang(
    monkeypatch: pytest.MonkeyPatch, off: float, leaps: bool, found: bool
):
    """Found again, or in one leap: another chair was the first, and it was known as that."""
    hung = Someone(-0.6, WALL).box
    other = hung.moved(off * CAMERA.fx / WALL, 0)
    tracker = create_tracker('metric')
    for i in range(21):
        box = other if i == 20 else hung
        look = Look(box, 0.9, 1.0, WALL) if leaps or not 15 <= i < 20 else None
        monkeypatch.setattr(ByLook, 'step', finds(look))
        color, depth = images([])
        # A wall straight ahead looks the same to a camera that moves along it, but for a little.
        pose = Pose(np.eye(3), np.array([0.005 * max(i - 5, 0), 0.0, 0.0]))
        frame = Frame(color, depth, round(1e8 * i), CAMERA, pose)
        track = tracker.start(frame, hung) if i == 0 else tracker.update(frame)
        assert (track.box is not None) == (found if i == 20 else look is not None)


@pytest.mark.parametrize(
    ('raised', 'step', 'found'), [(False, 0.0, False), (True, 0.0, True), (False, 0.02, True)]
)
def test_a_look_found_elsewhere_is_taken_where_depth_shows_a_figure_or_the_camera_has_moved(
    raised: bool, step: float, found: bool
):
    """Depth is silent of the target; once it has gone, something that looks so is elsewhere."""
    alike = Someone(0.6, 3.0)
    tracker = create_tracker('metric')
    for i in range(10):
        # Before a camera that moves what has never moved would be where it stood.
        first = Someone(-0.6 - (0.2 * max(4 - i, 0) if step > 0 else 0.0), 3.0)
        color, depth = images([first] if i < 6 else [alike] if i > 7 else [])
        if not (raised and i > 7):
            depth[:] = WALL
        holed(depth, first.box)
        pose = None
        if step > 0:
            # A wall straight ahead looks the same to a camera that moves along it.
            pose = Pose(np.eye(3), np.array([step * max(i - 5, 0), 0.0, 0.0]))
        frame = Frame(color, depth, round(1e8 * i), CAMERA, pose)
        track = tracker.start(frame, first.box) if i == 0 else tracker.update(frame)
        if i < 6:
            assert track.box is not None
            assert track.box.iou(first.box) > 0.8
        elif i < 8:
            assert track.box is None
    assert (track.box is not None) == found
    if track.box is not None:
        assert track.box.iou(alike.box) > 0.8


@pytest.mark.parametrize('before', [False, True])
def test_what_was_there_while_the_target_was_elsewhere_is_not_it(before: bool):
    """Where depth is silent ahead of the target it appears when it has gone, or was ``before``."""
    ahead = Someone(0.75, 3.0)
    tracker = create_tracker('metric')
    for i in range(16):
        one = Someone(-0.6 + 0.08 * i, 3.0)
        color, depth = images([ahead] if before or i > 12 else [])
        depth[:] = WALL
        holed(depth, ahead.box)
        if i < 13:
            walking, near = images([one])
            color[near < WALL], depth[near < WALL] = walking[near < WALL], one.z
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
        if i < 13:
            assert track.box is not None
            assert track.box.iou(one.box) > 0.8
    assert (track.box is None) == before
    if track.box is not None:
        assert track.box.iou(ahead.box) > 0.8


def test_a_look_is_not_taken_where_depth_shows_the_room():
    """Ahead of the target, where depth is silent of a part, a picture of it hangs on the wall."""
    ahead = Someone(0.75, 3.0)
    silent = dataclasses.replace(ahead.box, width=0.25 * ahead.box.width)
    tracker = create_tracker('metric')
    for i in range(16):
        one = Someone(-0.6 + 0.08 * i, 3.0)
        color, depth = images([ahead] if i > 12 else [])
        depth[:] = WALL
        holed(depth, silent)
        if i < 13:
            walking, near = images([one])
            color[near < WALL], depth[near < WALL] = walking[near < WALL], one.z
        frame = Frame(color, depth, round(1e8 * i), CAMERA)
        track = tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
        assert (track.box is not None) == (i < 13)


def followed() -> tuple[MetricTargets, int, Person]:
    """A set that has followed somebody for eight tenths of a second, the target's id, and who."""
    targets = MetricTargets(MetricParameters())
    for i in range(8):
        one = Someone(-0.3 + 0.05 * i, 3.0)
        frame = picture([one], 0.1 * (i + 1))
        if i == 0:
            number = targets.add(frame, one.box)
        else:
            targets.update(frame)
    person = targets.person(number)
    assert person is not None
    return targets, number, person


def test_what_is_no_figure_is_not_the_target_for_good_after_an_absence(
    monkeypatch: pytest.MonkeyPatch,
):
    targets, number, person = followed()
    last, seen_at = 0.8, person.seen_at
    for i in range(6):
        targets.update(picture([], last + 0.5 * (i + 1)))
    # As where a desk leaves a piece of him that is too small for a figure.
    monkeypatch.setattr(Account, 'sight_of', lambda *_: -1)
    boxes = 0
    for i in range(5):
        track = targets.update(picture([Someone(0.4, 3.0)], last + 3.1 + 0.1 * i))
        boxes += track[number].box is not None
    assert boxes, 'it is published with its probability'
    assert person.seen_at == seen_at, 'and nothing is learned from it'


@pytest.mark.parametrize('step', [0.9, 0.97, 1.0, 1.03, 1.2])
def test_a_slow_camera_misses_nobody(step: float):
    """What comes once a second or so is no absence, nor is a frame in which somebody is missed."""
    targets, against = MetricTargets(MetricParameters()), set()
    for i in range(1, 9):
        one = Someone(-0.6 + 0.15 * i, 3.0)
        frame = picture([] if i == 6 else [one], i * step)
        if i == 1:
            person = targets.person(targets.add(frame, one.box))
            continue
        targets.update(frame)
        assert targets.account is not None
        assert person is not None
        assert person.seen_at == pytest.approx((4 if i == 6 else i - 1) * step)
        if i < 6:
            against.add(round(targets.account.against, 6))
    assert len(against) == 1, 'nobody counts as one who came back'


def test_after_a_pause_nobody_is_the_target_at_once():
    """However alike: all may have gone and others come; some sightings must bear it out."""
    targets, number, person = followed()
    known, taken = person.seen_at, []
    for i in range(12):
        targets.update(picture([Someone(0.05 * i, 3.0)], 30.0 + 0.1 * i))
        if i == 0:  # that anybody may have come was not asked of the first frame
            assert targets._followers[number].doubts[evidence.SOMEBODY_NEW] < -0.5
        taken.append(person.seen_at > known)
    assert not any(taken[:3])
    assert taken[-1]


def test_who_is_rather_somebody_else_is_followed_without_a_box_until_his_looks_bear_him_out():
    """Strangers who came where the target had left were shown with scores of 0.2 for seconds."""
    targets, number, person = followed()
    comeback, now = Comeback(person, 0.8, 0.0), 0.8
    targets._followers[number]._comeback = comeback
    for against, shown in ((0.0, True), (6.0, False), (0.0, True)):
        comeback._new = math.exp(against)
        for _ in range(3):
            now += 0.1
            track = targets.update(picture([Someone(0.0, 3.0)], now))[number]
            assert (track.box is not None) == shown
            assert person.seen_at == pytest.approx(now - 0.1), 'he is followed on'
        if not shown:
            assert track.state is TrackState.OCCLUDED
            assert track.predicted is None, 'where he is, the target is hardly'


def back_again(*shown: tuple[list[Someone], Box | None]) -> list[Track]:
    """Tracks of a target in red and black that was away for five seconds, ten frames a second."""
    targets, number, _ = followed()
    for i in range(10):
        targets.update(picture([], 1.3 + 0.5 * i))
    return [
        targets.update(picture(people, 6.3 + 0.1 * i, board))[number]
        for i, (people, board) in enumerate(shown)
    ]


def test_who_is_more_likely_somebody_else_has_no_box(monkeypatch: pytest.MonkeyPatch):
    """Who came back was shown as the target at any probability: 0.12 was a box on a stranger."""
    back = [([Someone(0.0, 3.0)], None)]
    shown = back_again(*back)[0]
    assert shown.box is not None
    assert shown.score >= EVEN
    for odds, has_box in ((EVEN - 0.01, False), (EVEN + 0.01, True)):
        monkeypatch.setattr(follower, 'bounded', lambda *_, odds=odds: odds)
        track = back_again(*back)[0]
        assert (track.box is not None) == has_box
        assert track.score == pytest.approx(odds if has_box else 0.0)


@pytest.mark.parametrize('before', [0, 1])
def test_who_is_known_himself_is_less_likely_the_target(before: int):
    """He was weighed as the target or somebody new alone, however well he was known."""
    targets, number, person = followed()
    for i in range(10):
        targets.update(picture([], 1.3 + 0.5 * i))
    for visit in range(before + 1):
        start = 6.3 + 8.0 * visit
        for i in range(2 - visit):
            one = Someone(-0.6 + 0.4 * visit + 0.05 * i, 2.8, RED, GREY)
            track = targets.update(picture([one], start + 0.1 * i))[number]
        account = targets.account
        assert account is not None
        (row,) = account.owner
        other = account.people[row]
        assert other is not person, 'he is not known well enough'
        known = account.as_others(person, 0)
        for i in range(8):
            targets.update(picture([], start + 1.0 + 0.5 * i))
    assert account.as_others(person, -1) == 0
    if before:
        alike = other.resemblance(person.number)
        assert alike is not None
        sure = 1 - 1 / (1 + np.exp(account.against - alike))
        assert known == pytest.approx(np.exp(SUREST_SAME) * sure, rel=0.05)
        assert track.score < 0.6
    else:
        assert known == 0, 'nobody was known before he came'
        assert track.score > 0.8


@pytest.mark.parametrize('trousers', [BLACK, GREY])
def test_the_score_of_whom_nobody_chose_says_how_surely_he_is_who_went(
    trousers: tuple[int, int, int],
):
    """A tenth of a second after he had come back it was 1.0, in whatever trousers."""
    targets = MetricTargets(MetricParameters())
    targets.everyone = True
    for i in range(6):
        targets.update(picture([], 0.1 * (i + 1)))
    for i in range(10):
        first = targets.update(picture([Someone(-0.6 + 0.05 * i, 3.0)], 0.7 + 0.1 * i))
    for i in range(12):
        targets.update(picture([], 1.7 + 0.5 * i))
    for i in range(24):
        one = Someone(-0.6 + 0.05 * i, 2.8, RED, trousers)
        tracks = targets.update(picture([one], 8.0 + 0.1 * i))
        assert list(tracks) == list(first)
        (track,) = tracks.values()
        assert track.box is not None
        assert (track.score > 0.85) == (trousers == BLACK)


def test_what_somebody_stood_before_in_the_first_frame_is_not_somebody_who_has_come():
    """Boxes that he touched stayed people until the end once another had hidden a side of them."""
    targets, z, shown = MetricTargets(MetricParameters()), 3.05, set[int]()
    targets.everyone = True
    rows, cols = (
        slice(*(round(metres * CAMERA.fx / z + middle) for metres in ends))
        for ends, middle in (((-0.05, 0.85), CAMERA.cy), ((-0.62, -0.1), CAMERA.cx))
    )
    for i in range(19):
        walks, passes = Someone(0.04 * max(i - 5, 0), 3.0), Someone(-1.6 + 0.06 * i, 2.0, BLUE)
        color, depth = images([walks, passes])
        behind = depth[rows, cols] > z
        color[rows, cols][behind], depth[rows, cols][behind] = GREY, z
        shown |= set(targets.update(Frame(color, depth, i * 10**8, CAMERA)))
    assert shown == {1, 2}


def test_who_comes_where_depth_shows_nothing_is_somebody_without_a_head():
    """As one who sits down before a window: what is behind him never was somebody."""
    targets, shown = MetricTargets(MetricParameters()), set[int]()
    targets.everyone = True
    for i in range(12):
        color, depth = images([])
        depth[:, 90:150] = 0.0
        if i > 7:
            color[55:, 105:135], depth[55:, 105:135] = RED, 3.0
        color[110:], depth[110:] = GREY, 1.5
        shown |= set(targets.update(Frame(color, depth, i * 10**8, CAMERA)))
    assert shown == {1}


DESK = Box(0, 95, COLS, ROWS - 95)
"""It hides the legs of whoever stands behind it."""


@pytest.mark.parametrize('trousers', [BLACK, GREEN])
def test_the_score_of_who_came_back_falls_when_more_of_him_shows_that_is_not_the_targets(
    trousers: tuple[int, int, int],
):
    """Where he was a moment ago, and what was learned of him since, do not bear him out."""
    came = [Someone(-0.8 + 0.03 * i, 2.6, RED, trousers) for i in range(26)]
    tracks = back_again(*(([one], DESK if i < 14 else None) for i, one in enumerate(came)))
    assert tracks[13].score > 0.9, 'all that shows of him is the same'
    assert tracks[-1].box is not None
    assert tracks[-1].box.iou(came[-1].box) > 0.9
    assert (tracks[-1].score > 0.9) == (trousers == BLACK)


def test_who_came_back_is_somebody_else_once_the_target_shows():
    shown = []
    for i in range(40):
        people = [Someone(-0.8 + 0.03 * i, 2.6, RED, GREEN)]
        if i >= 26:
            people.append(Someone(0.9 - 0.02 * (i - 26), 3.4))
        shown.append((people, DESK if i < 14 else None))
    tracks = back_again(*shown)
    for (people, _), track in list(zip(shown, tracks, strict=True))[30:34]:
        assert track.box is not None
        assert track.box.iou(people[1].box) > 0.8


@pytest.mark.parametrize('trousers', [BLACK, GREY, GREEN])
def test_who_comes_out_where_the_target_was_hidden_is_it_until_that_shows(
    trousers: tuple[int, int, int],
):
    """Within a second he was the target for good, at 1.0, and it stood beside him as nobody."""
    targets, number, person = followed()
    screen = Box(90, 0, 50, ROWS)
    for i in range(3):
        targets.update(picture([Someone(-0.1, 3.0)], 1.0 + 0.2 * i, screen))
    for i in range(20):
        people = [Someone(0.4 + 0.05 * i, 2.8, RED, trousers)]
        if i >= 8 and trousers != BLACK:
            people.append(Someone(-0.55 - 0.02 * (i - 8), 3.0))
        track = targets.update(picture(people, 1.6 + 0.1 * i, screen))[number]
        if 1 < i < 8:
            assert track.box is not None
            assert track.box.iou(people[0].box) > 0.8
            assert (track.score > 0.9) == (trousers != GREEN)
    assert targets.person(number) is person
    assert track.box is not None
    assert track.box.iou(people[-1].box) > 0.8
    assert track.score > 0.8


def test_what_lowers_the_score_of_who_came_back_is_among_its_cues():
    """What was shown of him was his probability before he was held against what was known."""
    targets, number, _ = followed()
    for i in range(10):
        targets.update(picture([], 1.3 + 0.5 * i))
    said, given_up = {evidence.SOMEBODY_NEW: [], evidence.KNOWN_BEFORE: []}, []
    for i in range(40):
        shown = targets._followers[number].track.box is not None
        people = [Someone(-0.8 + 0.03 * i, 2.6, RED, GREEN)]
        if i >= 26:
            people.append(Someone(0.9 - 0.02 * (i - 26), 3.4))
        track = targets.update(picture(people, 6.3 + 0.1 * i, DESK if i < 14 else None))[number]
        considered = of_metric(targets, number).considered
        for one in considered:
            odds = min(max(sum(one.cues.values()), -SUREST), SUREST)
            assert 1 / (1 + np.exp(-odds)) == pytest.approx(one.probability, abs=1e-3)
        assert all(one.cues[cue] == 0 for one in considered[1:] for cue in said)
        if track.box is not None:
            assert considered[0].probability == pytest.approx(track.score)
        for cue, values in said.items():
            values.append(considered[0].cues[cue] if considered else 0.0)
        if shown and track.box is None:
            given_up.append(said[evidence.KNOWN_BEFORE][-1])
    assert given_up, 'he is not the target after all'
    assert max(given_up) < -1, 'and that is why'
    new, known = said.values()
    assert new[0] < 0, 'anybody may come'
    assert min(known) < -3, 'his trousers are not the ones that were known'
    assert all(first == 0 or second == 0 for first, second in zip(new, known, strict=True))


def test_what_was_learned_of_a_return_that_is_not_borne_out_tells_nobody():
    targets, number, person = followed()
    known = list(person.gallery.views)
    other = look(RED, GREEN)
    for i in range(10):
        targets.update(picture([], 1.3 + 0.5 * i))
    for i in range(26):
        people = [Someone(-0.8 + 0.03 * i, 2.6, RED, GREEN)]
        if i >= 10:
            people.append(Someone(1.1 - 0.02 * (i - 10), 3.4, BLUE, GREY))
        targets.update(picture(people, 6.3 + 0.1 * i, DESK if i < 14 else None))
    assert len(person.gallery.views) > len(known)
    sure = person.gallery.log_odds(other)
    assert person.met, 'the one in blue was seen beside him'
    for i in range(4):
        targets.update(picture([], 9.5 + 0.5 * i))
    # With nobody in view nothing is asked; it is when somebody else comes in.
    targets.update(picture([Someone(0.0, 3.0, BLUE, GREY)], 12.0))
    assert targets.person(number) is person
    assert person.gallery.log_odds(other) < min(sure, BORNE_OUT)
    # Had it been somebody else, the one in blue may be the target.
    assert not person.met
    assert all(person.number not in each.met for each in targets._crowd.people)


@pytest.mark.parametrize(('pause', 'found'), [(0.1, True), (30.0, False)])
def test_what_looks_like_the_target_where_depth_is_blind_is_it_unless_it_was_away(
    pause: float, found: bool
):
    one = Someone(0.0, 3.0)
    tracker = create_tracker('metric')
    for i in range(8):
        frame = picture([one], 0.1 * i)
        tracker.start(frame, one.box) if i == 0 else tracker.update(frame)
    for i in range(4):
        frame = picture([one], 0.7 + pause + 0.1 * i)
        blind = frame.depth.copy()
        blind[:, int(one.box.x) - 6 : int(one.box.right) + 6] = np.nan
        track = tracker.update(dataclasses.replace(frame, depth=blind))
        assert (track.box is not None) == found


def test_every_step_is_taken_in_once(monkeypatch: pytest.MonkeyPatch):
    """What follows from a step is a take, a miss, or a place told by the look: one of them."""
    calls: list[str] = []

    def watch(name: str) -> None:
        call = getattr(BySurface, name)

        def noted(*args, **more):
            calls.append(name)
            return call(*args, **more)

        monkeypatch.setattr(BySurface, name, noted)

    for name in ('step', 'take', 'miss', 'seen_elsewhere'):
        watch(name)
    tracker = create_tracker('metric')
    board = Box(120, 0, 60, 160)
    outcomes = set()
    for i in range(36):
        one = Someone(-0.9 + 0.05 * i, 3.0)
        frame = picture([one], 0.1 * i, board if i > 12 else None)
        if 6 <= i < 9:
            rows = slice(int(one.box.y) - 2, int(one.box.bottom) + 2)
            cols = slice(int(one.box.x) - 6, int(one.box.right) + 6)
            blind = frame.depth.copy()
            blind[rows, cols] = np.nan
            frame = dataclasses.replace(frame, depth=blind)
        if 10 <= i < 12:
            frame = dataclasses.replace(frame, depth=None)
        if i == 0:
            tracker.start(frame, one.box)
            continue
        calls.clear()
        tracker.update(frame)
        after = [call for call in calls if call != 'step']
        assert len(after) == 1, f'frame {i}: {calls}'
        assert calls.index(after[0]) == len(calls) - 1
        outcomes.update(after)
    assert outcomes == {'take', 'miss', 'seen_elsewhere'}


@pytest.mark.parametrize('cells', [47, 48])
@pytest.mark.parametrize('color_share', [0.0, 0.1, 1.0])
def test_a_look_is_found_where_it_was_learned_whatever_its_colours_count(
    cells: int, color_share: float
) -> None:
    random, box = np.random.default_rng(3), Box(290, 160, 60, 160)
    color = cv2.GaussianBlur(random.integers(60, 120, (480, 640, 3)).astype(np.uint8), (0, 0), 3)
    color[160:320, 290:350] += np.array([0, 0, 100], np.uint8)
    look = Appearance(
        color, box, cells=cells, padding=3.0, sigma=1.8, rate=0.02, color_share=color_share
    )
    found = look.look(color, box.cx, box.cy, 1.0)
    assert (found.cx, found.cy) == pytest.approx((box.cx, box.cy), abs=0.5)  # a cell is 8 pixels


def test_a_thing_stands_out_before_what_is_beside_it():
    """By a table 0.3 m behind on its left, and what gives no reading on its right."""
    depth = np.full((40, 60), 2.0, np.float32)
    depth[:, 40:] = np.nan
    table = Frame(np.zeros((40, 60, 3), np.uint8), depth.copy())
    depth[10:30, 20:40] = 1.7
    thing, box = dataclasses.replace(table, depth=depth), Box(20, 10, 20, 20)
    known = Relief.of(thing, box)
    assert known.sides == pytest.approx([0.3, np.nan], abs=1e-6, nan_ok=True)
    assert known.left_in(known) is True
    assert known.left_in(Relief.of(table, box)) is False
    assert known.left_in(Relief.of(thing, Box(36, 10, 20, 20))) is None  # no reading in its middle
    assert Relief.of(table, box).left_in(known) is None  # what never stood out
    colour_alone = dataclasses.replace(thing, depth=None)
    assert known.left_in(Relief.of(colour_alone, box)) is None
