# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A recording that is played, sought and tracked for the page, without a browser."""

from __future__ import annotations

import csv
import io
import struct
import time
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

pytest.importorskip('aiohttp', reason="the page needs aiohttp: pip install '.[view]'")

from rgbd_kcf_tracker import Box, Frame, Intrinsics, Track, TrackState, create_tracker
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.insight import Insight, insight_of
from rgbd_kcf_tracker.metric.decide.evidence import OTHER_PLACES
from rgbd_kcf_tracker.metric.identity.tally import SUREST
from rgbd_kcf_tracker.targets import TargetSet
from rgbd_kcf_tracker.variants import default_parameters
from rgbd_kcf_tracker.view import player as module
from rgbd_kcf_tracker.view.commands import Command
from rgbd_kcf_tracker.view.export import export
from rgbd_kcf_tracker.view.player import Player
from rgbd_kcf_tracker.view.showing import (
    Detail,
    Seen,
    depth_picture,
    ellipse,
    ellipse_of,
    rival,
    room_points,
    show,
)  # fmt: skip
from rgbd_kcf_tracker.view.sources import SimulatedRecording, first_box

SIZE = (320, 180)


@lru_cache(maxsize=1)
def recording() -> SimulatedRecording:
    return SimulatedRecording('occlusion', 3, 15.0, SIZE, 2.0)


def tracked(variant: str = 'metric', frames: int | None = None) -> list[Track]:
    """What the tracker says when it is run by itself."""
    start, box = first_box(recording(), None)
    tracker = create_tracker(variant)
    images = recording().frames(start, frames)
    return [tracker.start(next(images), box), *map(tracker.update, images)]


class Rig:
    """A player whose thread is this one."""

    def __init__(
        self,
        box: bool = True,
        variant: str = 'metric',
        scene: SimulatedRecording | None = None,
        everyone: bool = False,
    ) -> None:
        scene = recording() if scene is None else scene
        start, first = first_box(scene, None)
        self.player = Player(
            scene, variant, start=start, box=first if box else None, everyone=everyone
        )
        self.player.board.watch(lambda: None)
        self.player._guarded(self.player._open)

    def ask(self, do: str, **values: Any) -> dict[str, Any]:
        self.player._guarded(lambda: self.player._carry_out(Command(do, values)))
        return self.seen

    @property
    def seen(self) -> dict[str, Any]:
        return dict(self.player.board.take((-1, 0))[2])


def assert_same(target: dict[str, Any], track: Track) -> None:
    assert target['state'] == track.state.value
    assert (target['box'] is None) == (track.box is None)
    if track.box is not None:
        assert target['box'] == [round(v, 2) for v in track.box.as_tuple()]
    assert target['score'] == pytest.approx(track.score, abs=1e-4)
    assert target['depth'] == (
        None if track.depth is None else pytest.approx(track.depth, abs=1e-3)
    )
    for shown, known in (('position', track.position), ('predicted', track.predicted)):
        assert target.get(shown) == (None if known is None else pytest.approx(known, abs=1e-3))


def test_a_simulated_scene_makes_the_truth_that_is_asked_for() -> None:
    scene, other = (SimulatedRecording('occlusion', 3, 15.0, SIZE, 1.0) for _ in range(2))
    start, _ = first_box(scene, None)
    assert set(scene._truths) == set(range(start + 1))
    assert len(list(other.frames())) == len(scene)
    for boxes, same in (
        (scene.groundtruth, other.groundtruth),
        (scene.groundtruth_body, other.groundtruth_body),
    ):
        assert boxes[:] == same[:]
        assert boxes[0] is not None


def test_seeking_shows_what_the_tracker_says_of_that_frame() -> None:
    rig = Rig()
    expected = tracked()
    for frame in (12, 3, 20, 0, 29):
        seen = rig.ask('seek', frame=frame)
        assert seen['frame'] == frame
        assert_same(seen['targets'][0], expected[frame])
    assert rig.ask('seek', frame=10_000)['frame'] == len(recording()) - 1


def test_candidates_particles_and_ellipse_are_those_of_the_tracker() -> None:
    scene = SimulatedRecording('occlusion', 3, 15.0, SIZE, 5.0)
    start, box = first_box(scene, None)
    tracker = create_tracker('metric')
    frames = scene.frames(start)
    track = tracker.start(next(frames), box)
    seen, hidden = None, None
    for number, frame in enumerate(frames, start=start + 1):
        track = tracker.update(frame)
        insight = insight_of(tracker)
        if track.box is not None and insight.considered and seen is None:
            seen = (number, insight)
        if track.box is None and insight.particles is not None and track.covariance is not None:
            hidden = (number, insight, track)
            break
    assert seen is not None
    assert hidden is not None
    rig = Rig(scene=scene)
    (target,) = rig.ask('seek', frame=seen[0])['targets']
    shown = [(c['box'], c['probability'], c['cues']) for c in target['considered']]
    assert shown == [
        (
            [round(v, 2) for v in c.box.as_tuple()],
            round(c.probability, 4),
            {name: round(value, 2) for name, value in c.cues.items()},
        )
        for c in seen[1].considered[: len(shown)]
    ]
    (target,) = rig.ask('seek', frame=hidden[0])['targets']
    assert_same(target, hidden[2])
    places = [p[:3] for p in target['particles']]
    np.testing.assert_allclose(places, hidden[1].particles, atol=0.006)
    spread = np.reshape(hidden[2].covariance, (3, 3))[::2, ::2]
    mean = np.array(hidden[2].predicted)[::2]
    assert target['ellipse'][:5] == ellipse_of(mean, spread)


def test_cues_add_up_to_the_verdict_also_beside_others() -> None:
    """What the likeliest loses to candidates elsewhere was in the score and not among the cues."""
    lost = 0
    for seed in (3, 5, 1):
        if lost:
            break
        scene = SimulatedRecording('crowd', seed, 10.0, (480, 270), 10.0)
        start, box = first_box(scene, None)
        tracker = create_tracker('metric')
        frames = scene.frames(start)
        tracker.start(next(frames), box)
        for frame in islice(frames, 50):
            track = tracker.update(frame)
            considered = insight_of(tracker).considered
            for one in considered:
                odds = min(max(sum(one.cues.values()), -SUREST), SUREST)
                assert 1 / (1 + np.exp(-odds)) == pytest.approx(one.probability, abs=1e-3)
            assert all(one.cues[OTHER_PLACES] == 0 for one in considered[1:])
            if considered and considered[0].cues[OTHER_PLACES]:
                lost += 1
                if track.box is not None:
                    assert considered[0].probability == track.score
    assert lost


def test_stepping_goes_both_ways() -> None:
    rig = Rig()
    assert rig.ask('step', by=1)['frame'] == 1
    assert rig.ask('step', by=-1)['frame'] == 0
    assert rig.ask('step', by=-1)['frame'] == 0


def test_playing_reaches_the_end_and_stops() -> None:
    player = Player(recording(), 'kcf', start=0, box=first_box(recording(), None)[1])
    player.board.watch(lambda: None)
    player.start()
    player.do(Command('speed', {'value': 8.0}))
    player.do(Command('play', {}))
    wait(lambda: player._shown == len(recording()) - 1 and not player._playing)
    player.stop()
    rows = list(csv.DictReader(io.StringIO(player.boxes_csv())))
    assert len(rows) == len(recording())
    expected = tracked('kcf')
    for row, track in zip(rows, expected, strict=True):
        assert track.box is not None
        assert float(row['x']) == pytest.approx(track.box.x, abs=1e-4)
        assert (row['id'], row['state']) == ('1', 'tracking')


def wait(condition: Callable[[], bool], seconds: float = 30) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_another_target_is_added_where_it_is_picked() -> None:
    rig = Rig()
    rig.ask('seek', frame=6)
    seen = rig.ask('box', x=20.0, y=60.0, width=30.0, height=40.0, frame=4)
    assert seen['frame'] == 4
    assert [t['id'] for t in seen['targets']] == [1, 2]
    assert seen['targets'][1]['box'] == [20, 60, 30, 40]
    # The first is started anew where it was, and both go on.
    box = tracked()[4].box
    assert box is not None
    assert seen['targets'][0]['box'] == [round(v, 2) for v in box.as_tuple()]
    later = rig.ask('seek', frame=8)
    assert [t['id'] for t in later['targets']] == [1, 2]
    rig.ask('rename', id=2, name='chair')
    rig.ask('rename', id=77, name='nobody')
    assert set(rig.player._names) == {1, 2}
    assert rig.ask('remove', id=1)['targets'][0]['name'] == 'chair'


@lru_cache(maxsize=1)
def crowd() -> SimulatedRecording:
    return SimulatedRecording('crowd', 3, 15.0, SIZE, 3.0)


def boxes_of(seen: dict[str, Any]) -> dict[int, Any]:
    return {t['id']: t['box'] for t in seen['targets']}


def test_everyone_in_view_is_what_the_set_says_of_the_frame() -> None:
    rig = Rig(scene=crowd(), everyone=True)
    start, first = first_box(crowd(), None)
    targets = TargetSet('metric')
    targets.everyone = True
    frames = crowd().frames(start, 36)
    frame = next(frames)
    targets.update(frame)
    chosen = targets.add(frame, first)
    tracks = [targets.update(frame) for frame in frames][-1]
    seen = rig.ask('seek', frame=35)
    assert len(tracks) > 2
    expected = [[round(v, 2) for v in t.box.as_tuple()] if t.box else None for t in tracks.values()]
    assert list(boxes_of(seen).values()) == expected
    assert [t['chosen'] for t in seen['targets']] == [number == chosen for number in tracks]
    names = {t['id']: t['name'] for t in seen['targets']}
    assert names == {key: f'{"target" if key == chosen else "person"} {key}' for key in names}
    rows = list(csv.DictReader(io.StringIO(rig.player.boxes_csv())))
    assert {row['id'] for row in rows} >= {str(t['id']) for t in seen['targets']}


def test_one_of_everyone_is_followed_renamed_and_let_go() -> None:
    rig = Rig(scene=crowd(), everyone=True)
    seen = rig.ask('seek', frame=35)
    first = next(t for t in seen['targets'] if t['chosen'])
    other = next(t for t in seen['targets'] if not t['chosen'] and t['box'])
    seen = rig.ask('follow', id=other['id'], frame=35)
    assert {t['id'] for t in seen['targets'] if t['chosen']} == {first['id'], other['id']}
    rig.ask('rename', id=other['id'], name='Anna')
    seen = rig.ask('seek', frame=38)
    assert next(t for t in seen['targets'] if t['id'] == other['id'])['considered']
    seen = rig.ask('remove', id=other['id'])
    assert {t['id'] for t in seen['targets'] if t['chosen']} == {first['id']}
    # Without being chosen she goes on under her name.
    seen = rig.ask('seek', frame=40)
    assert 'Anna' in [t['name'] for t in seen['targets'] if not t['chosen']]
    hidden = next((t['id'] for t in seen['targets'] if not t['box']), 99)
    assert 'not in sight' in rig.ask('follow', id=hidden, frame=40)['word']


def test_everyone_may_be_asked_for_later_and_keeps_the_ids_when_the_run_goes_on() -> None:
    rig = Rig(scene=crowd(), everyone=False)
    assert len(rig.ask('seek', frame=35)['targets']) == 1
    seen = rig.ask('everyone', value=True)
    assert seen['everyone']
    before = boxes_of(seen)
    assert len(before) > 1
    after = boxes_of(rig.ask('parameter', name='acceptance', value=0.6))
    assert after.keys() == before.keys()
    # Only metric can: another variant goes on with those who were chosen.
    seen = rig.ask('variant', name='kcf')
    assert not seen['everyone']
    assert [t['id'] for t in seen['targets']] == [1]
    assert 'use metric' in rig.ask('everyone', value=True)['word']


@pytest.mark.parametrize('frame', [28, 29, 30])
def test_everyone_asked_for_where_the_target_touches_another_are_two(frame: int) -> None:
    """Chosen anew in that very frame, the target was taken for both, and they for one."""
    rig = Rig(scene=crowd(), everyone=False)
    (alone,) = rig.ask('seek', frame=frame)['targets']
    seen = rig.ask('everyone', value=True)
    (target,) = (t for t in seen['targets'] if t['chosen'])
    assert Box(*target['box']).iou(Box(*alone['box'])) > 0.9
    others = [t['id'] for t in seen['targets'] if not t['chosen'] and t['box']]
    assert others
    for count, other in enumerate(others, 2):
        seen = rig.ask('follow', id=other, frame=frame)
        assert sum(t['chosen'] for t in seen['targets']) == count


def test_views_are_the_trackers_own_with_the_pictures_that_they_are_of() -> None:
    rig = Rig()
    rig.ask('seek', frame=14)
    views = rig.player._insights[1].gallery
    known = rig.player._known[1]
    assert [k.view for k in known] == list(views)
    assert all(k.picture.startswith(b'\xff\xd8') and len(k.colors) == 9 for k in known)
    assert rig.seen['targets'][0]['colors'] == [k.colors for k in known]
    rig.ask('variant', name='kcf')
    rig.ask('seek', frame=20)
    assert len(rig.player._known[1]) == 1


@pytest.mark.parametrize('variant', ['kcf', 'rgbd', 'rgbd_pf'])
def test_the_last_minute_has_the_response_also_while_hidden(variant: str) -> None:
    rig = Rig(variant=variant)
    entries = rig.ask('seek', frame=29)['entries']
    responses = [e['targets'][0][5] for e in entries[1:]]
    assert all(0 < r < 1.2 for r in responses)
    expected = tracked(variant)
    for entry, track in zip(entries[1:], expected[1:], strict=True):
        if track.box is not None and variant == 'kcf':
            assert entry['targets'][0][5] == pytest.approx(track.score, abs=1e-3)


def test_a_click_takes_the_surface_there() -> None:
    rig = Rig(box=False)
    assert rig.seen['targets'] == []
    start, truth = first_box(recording(), None)
    seen = rig.ask('point', x=truth.cx, y=truth.cy, frame=start)
    assert Box(*seen['targets'][0]['box']).iou(truth) > 0.5


def test_what_cannot_be_done_is_said_and_nothing_ends() -> None:
    rig = Rig()
    assert 'outside' in rig.ask('box', x=900.0, y=0.0, width=5.0, height=5.0, frame=0)['word']
    assert 'outside' in rig.ask('point', x=-4.0, y=0.0, frame=0)['word']
    assert 'nothing' in rig.ask('parameter', name='nothing', value=1)['word']
    assert 'between' in rig.ask('parameter', name='acceptance', value=7.0)['word']
    # Who sees the page is not to have files of this machine opened.
    told = rig.ask('parameter', name='embedding', value='/etc/hostname')['word']
    assert 'name a file where the page is started: --param embedding=' in told
    assert 'unknown variant' in rig.ask('variant', name='mosse')['word']
    assert rig.ask('box', x=0.0, y=0.0, width=0.0, height=5.0, frame=0)['word']
    assert rig.ask('seek', frame=5)['targets'][0]['state'] == 'tracking'


def test_a_parameter_makes_the_run_go_on_from_the_frame_shown() -> None:
    rig = Rig()
    rig.ask('seek', frame=10)
    seen = rig.ask('parameter', name='acceptance', value=0.6)
    assert seen['frame'] == seen['front'] == 10
    assert seen['values']['acceptance'] == 0.6
    content = yaml.safe_load(rig.player.parameters_yaml())['/**']['ros__parameters']
    assert content['variant'] == 'metric'
    assert content['metric']['acceptance'] == 0.6
    seen = rig.ask('variant', name='rgbd')
    assert seen['variant'] == 'rgbd'
    assert seen['targets'][0]['box'] is not None
    # As if it had been started there by hand.
    tracker = create_tracker('rgbd')
    box = tracked(frames=11)[10].box
    frames = recording().frames(10, 13)
    assert box is not None
    tracker.start(next(frames), box)
    last = [tracker.update(frame) for frame in frames][-1]
    assert_same(rig.ask('seek', frame=12)['targets'][0], last)
    assert rig.ask('defaults')['values']['depth_threshold'] == 0.15


def test_a_parameter_of_a_hidden_target_tells_how_far_it_is_and_holds_no_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(variant='kcf')
    rig.ask('seek', frame=12)

    def hide() -> None:
        for number in range(4, 13):
            tracks = rig.player._passed[number].tracks
            tracks.update({key: replace(track, box=None) for key, track in tracks.items()})

    hide()
    monkeypatch.setattr(module, 'BUSY_S', -1.0)
    told: list[tuple[int, str]] = []
    monkeypatch.setattr(
        rig.player, '_show', lambda: told.append((rig.player._shown, rig.player._busy))
    )
    rig.ask('parameter', name='padding', value=1.0)
    assert told == [(at, f'tracking up to frame 12: at {at}') for at in range(3, 12)] + [(12, '')]
    told.clear()
    hide()
    rig.player.stop()
    rig.ask('parameter', name='padding', value=1.5)
    assert len(told) == 2


def test_the_last_minute_ends_at_the_frame_shown() -> None:
    rig = Rig()
    entries = rig.ask('seek', frame=12)['entries']
    assert [e['frame'] for e in entries] == list(range(13))
    assert all(e['targets'][0][1] == 'tracking' for e in entries[:5])
    assert [e['frame'] for e in rig.ask('seek', frame=4)['entries']] == list(range(5))


def test_a_shown_moment_has_all_pictures() -> None:
    rig = Rig()
    rig.ask('seek', frame=5)
    _, _, header, blobs = rig.player.board.take((-1, 0))
    assert set(blobs) >= {'color', 'depth', 'points', 'view_1_0'}
    for name in ('color', 'depth', 'view_1_0'):
        assert blobs[name].startswith(b'\xff\xd8')
    assert header['targets'][0]['considered'][0]['probability'] > 0.5
    assert header['floor'] is not None


def test_points_are_where_the_camera_sees_them() -> None:
    depth = np.full((40, 60), np.nan, np.float32)
    depth[20, 30] = depth[8, 8] = 2.0
    depth[9, 9] = 100.0
    color = np.zeros((40, 60, 3), np.uint8)
    color[20, 30] = (1, 2, 3)
    data = room_points(Frame(color, depth), Intrinsics(50, 50, 30, 20), 100_000)
    count = len(data) // 9
    assert count == 2
    places = struct.unpack_from('<6h', data)
    assert places[3:] == (0, 0, 2000)
    assert tuple(data[6 * count + 3 :]) == (3, 2, 1)


def test_fewer_points_than_asked_for() -> None:
    frame = next(recording().frames(0, 1))
    k = recording().intrinsics
    assert k is not None
    assert 500 < len(room_points(frame, k, 1000)) // 9 <= 1000


def test_depth_is_brighter_the_farther_also_in_grey() -> None:
    depth = np.tile(np.linspace(0.5, 8, 64, dtype=np.float32), (16, 1))
    depth[0, 0] = np.nan
    picture, far = depth_picture(depth, 1000)
    assert far == 8
    grey = picture[8].astype(int) @ (11, 59, 30)
    assert (np.diff(grey) >= 0).all()
    assert tuple(picture[0, 0]) == (224, 219, 216)
    empty, far = depth_picture(np.full((8, 8), np.nan, np.float32), 1000)
    assert (empty == (224, 219, 216)).all()
    assert far == 1


def test_the_ellipse_holds_what_it_says() -> None:
    rng = np.random.default_rng(0)
    places = rng.normal(size=(4000, 3)) * (0.9, 0.1, 0.3)
    turned = places @ np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]) + (1, 0, 4)
    x, z, major, minor, angle = ellipse(turned, np.full(4000, 1 / 4000))
    away = turned[:, [0, 2]] - (x, z)
    along = away @ (np.cos(angle), np.sin(angle)) / major
    across = away @ (-np.sin(angle), np.cos(angle)) / minor
    assert np.mean(along**2 + across**2 < 1) == pytest.approx(0.95, abs=0.01)


def test_confusion_is_of_what_was_not_taken() -> None:
    from rgbd_kcf_tracker.insight import Considered

    here, there = Box(0, 0, 10, 10), Box(50, 0, 10, 10)
    insight = Insight((Considered(here, 0.9, {}), Considered(there, 0.4, {})))
    assert rival(Track(here, TrackState.TRACKING), insight) is insight.considered[1]
    assert rival(Track(None, TrackState.OCCLUDED), insight) is insight.considered[0]
    assert rival(Track(here, TrackState.TRACKING), None) is None


def test_a_frame_without_depth_is_shown_without() -> None:
    color = np.zeros((20, 30, 3), np.uint8)
    header, blobs = show(Seen(Frame(color)), Detail())
    assert set(blobs) == {'color'}
    assert header['guessed']


def test_no_frame_to_show_is_an_error() -> None:
    with pytest.raises(RecordingError, match='no frame 99'):
        Player(recording(), 'metric', start=99)


def test_export_is_one_file_with_every_moment(tmp_path: Path) -> None:
    start, box = first_box(recording(), None)
    path = tmp_path / 'run.html'
    count = export(recording(), path, 'metric', default_parameters('metric'), start, 12, box)
    text = path.read_text(encoding='utf-8')
    assert count == 12
    assert '</script><script>' not in text.split('id="stored"')[1].split('</script>')[0]
    assert 'src="' not in text
    assert '<link rel="stylesheet"' not in text
    assert "default-src 'none'" in text


def test_command_exports_and_refuses_to_replace(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'run.html'
    command = ['view', '--seed', '3', '--end', '4', '--export', str(path)]
    assert main(command) == 0
    assert '4 moments' in capsys.readouterr().out
    assert main(command) == 2
    assert '--overwrite' in capsys.readouterr().err
    assert main(['view', str(tmp_path / 'none.mcap'), '--host', '0.0.0.0']) == 2, 'at once'
    assert 'ssh -L' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        ('walk.mcap --scenario foo --export q.html', '--scenario means nothing with a SOURCE'),
        ('walk.mcap --seed 0 --export q.html', '--seed means nothing with a SOURCE'),
        ('--end 5', '--end means nothing without --export'),
        ('--export q.html --port 80', '--port means nothing with --export'),
        ('--export q.html --tolerance 1', '--tolerance means nothing without a SOURCE'),
    ],
)
def test_options_that_mean_nothing_are_refused(
    words: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(['view', *words.split()]) == 2
    assert message in capsys.readouterr().err
