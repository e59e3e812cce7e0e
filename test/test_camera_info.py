# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The target's metres: a camera with a lens, a window and binning, against where a board is.

The pictures are drawn with OpenCV's own projection, which the package does not use for it.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from bag_rig import (
    CAMERA,
    SIZE,
    Sent,
    camera_info,
    camera_messages,
    header,
    image,
    make_frames,
    write_mcap,
    write_ros1,
)

from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import ImageError, ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import CAMERA_PX, Box, Intrinsics
from rgbd_kcf_tracker.lens import Lens
from rgbd_kcf_tracker.live.processor import Capture, Processor
from rgbd_kcf_tracker.live.session import Session
from rgbd_kcf_tracker.live.statistics import Statistics
from rgbd_kcf_tracker.recordings import ReadOptions, open_recording
from rgbd_kcf_tracker.recordings.camera_info import camera_from_info, is_rectified
from rgbd_kcf_tracker.recordings.copying import output_topics, write_recording
from rgbd_kcf_tracker.recordings.encoding import encode_color, encode_depth
from rgbd_kcf_tracker.recordings.sequence_writer import SequenceWriter
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS, create_tracker, default_parameters

RAW, RECT, INFO = '/camera/color/image_raw', '/camera/color/image_rect', '/camera/color/camera_info'
DEPTH = '/camera/aligned_depth_to_color/image_raw'
FULL = (960, 540)
K = np.array([[541.0, 0, 470.0], [0, 543.0, 265.0], [0, 0, 1]])
P = np.array([[460.0, 0, 481.0], [0, 462.0, 272.0], [0, 0, 1]])
"""Of the rectified picture: clearly another camera, as with a wide lens."""
LENSES = {
    'none': ('plumb_bob', ()),
    'plumb_bob': ('plumb_bob', (-0.28, 0.09, 0.001, -0.0012, -0.012)),
    'rational_polynomial': (
        'rational_polynomial', (0.45, -2.5, 0.0005, -0.0002, 1.5, 0.33, -2.35, 1.43),
    ),
    'equidistant': ('equidistant', (-0.02, 0.006, -0.004, 0.0008)),
}  # fmt: skip
WINDOWS = {
    'whole': ((0, 0, 0, 0), 1),
    'window': ((180, 60, 640, 420), 1),
    'binned': ((0, 0, 0, 0), 2),
    'window, binned': ((180, 60, 640, 420), 2),
}
BOARD = (0.6, 0.7)
"""Metres: a thing, whose middle is half way down; a person's is higher."""
AHEAD = 3.0
PLACES = [(0.7 + 0.05 * i, 0.12, AHEAD) for i in range(4)]
"""Of the board's middle, metres: beside the middle of the picture, where a lens tells."""
CLOSE = 0.02


@dataclass(frozen=True)
class Sensor:
    """A camera with everything that CameraInfo speaks of."""

    lens: str = 'plumb_bob'
    window: str = 'whole'
    rectified: bool = False

    def info(self, stamp_ns: int = 0) -> Any:
        model, coefficients = LENSES[self.lens]
        (x, y, width, height), binning = WINDOWS[self.window]
        message = camera_info(header(stamp_ns, 'optical'), *FULL, Intrinsics(1, 1, 0, 0))
        message.distortion_model, message.d = model, np.array(coefficients, np.float64)
        message.k = K.reshape(-1)
        message.p = np.column_stack([P, np.zeros(3)]).reshape(-1)
        message.binning_x = message.binning_y = 0 if binning == 1 else binning
        message.roi = replace(
            message.roi, x_offset=x, y_offset=y, width=width, height=height, do_rectify=width > 0
        )
        return message

    def pixels(self, points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Where points ``(n, 3)`` are in the pictures that arrive."""
        still = np.zeros(3)
        coefficients = np.array(LENSES[self.lens][1])
        if self.rectified or not len(coefficients):
            shown, _ = cv2.projectPoints(points, still, still, P if self.rectified else K, None)
        elif self.lens == 'equidistant':
            shown, _ = cv2.fisheye.projectPoints(points[None], still, still, K, coefficients)
        else:
            shown, _ = cv2.projectPoints(points, still, still, K, coefficients)
        (x, y, _, _), binning = WINDOWS[self.window]
        return (np.asarray(shown).reshape(-1, 2) - (x, y)) / binning

    @property
    def size(self) -> tuple[int, int]:
        (_, _, width, height), binning = WINDOWS[self.window]
        return (width or FULL[0]) // binning, (height or FULL[1]) // binning

    def shot(self, place: tuple[float, float, float], number: int) -> tuple[Frame, Box]:
        """A picture of the board before a wall, without a camera, and the board's box in it."""
        width, height = self.size
        rng = np.random.default_rng(3)
        color = rng.integers(90, 120, (height, width, 3), np.uint8)
        depth = np.full((height, width), 5.0, np.float32)
        x, y, z = place
        across, down = np.array([-0.5, 0.5]) * BOARD[0] + x, np.array([-0.5, 0.5]) * BOARD[1] + y
        s = np.linspace(0, 1, 40)
        sides = [
            np.column_stack([a + (c - a) * s, b + (d - b) * s])
            for (a, b), (c, d) in zip(
                [(across[0], down[0]), (across[1], down[0]), (across[1], down[1]),
                 (across[0], down[1])],
                [(across[1], down[0]), (across[1], down[1]), (across[0], down[1]),
                 (across[0], down[0])],
                strict=True,
            )
        ]  # fmt: skip
        outline = np.vstack(sides)
        corners = self.pixels(np.column_stack([outline, np.full(len(outline), z)]))
        mask = np.zeros((height, width), np.uint8)
        cv2.fillPoly(mask, [np.round(corners * 16).astype(np.int32)], 1, shift=4)
        inside = mask > 0
        color[inside] = (40, 60, 200)
        depth[inside] = z
        left, top = corners.min(axis=0)
        right, bottom = corners.max(axis=0)
        box = Box.from_corners(left, top, right + 1, bottom + 1)
        return Frame(color, depth, number * 100_000_000), box


def errors(found: list[tuple[float, float, float] | None]) -> list[float]:
    assert all(position is not None for position in found)
    return [float(np.linalg.norm(np.subtract(a, b))) for a, b in zip(found, PLACES, strict=True)]


def followed(frames: list[Frame], box: Box) -> list[tuple[float, float, float] | None]:
    tracker = create_tracker(DEFAULT_VARIANT)
    first = tracker.start(frames[0], box)
    return [first.position, *(tracker.update(frame).position for frame in frames[1:])]


CAMERAS = [
    pytest.param(Sensor(lens, window, rectified), id=f'{lens}, {window}, {word}')
    for lens in LENSES
    for window in WINDOWS
    for rectified, word in ((False, 'raw'), (True, 'rectified'))
    if lens != 'none' or rectified
]


@pytest.mark.parametrize('sensor', CAMERAS)
def test_positions_are_within_two_centimetres_at_three_metres(sensor: Sensor) -> None:
    shots = [sensor.shot(place, number) for number, place in enumerate(PLACES)]
    camera = camera_from_info(sensor.info(), RECT if sensor.rectified else RAW)
    assert camera is not None
    assert camera.misfit(*sensor.size) == ''
    frames = [replace(frame, intrinsics=camera.intrinsics) for frame, _ in shots]
    boxes = [box for _, box in shots]
    exact = [f.position(box, AHEAD) for f, box in zip(frames, boxes, strict=True)]
    assert max(errors(exact)) < CLOSE
    assert max(errors(followed(frames, boxes[0]))) < CLOSE


def test_without_the_rule_they_are_not() -> None:
    """K of a rectified picture, and a lens left in: what the rule is there for."""
    for sensor, wrong in (
        (Sensor(rectified=True), Intrinsics(K[0, 0], K[1, 1], K[0, 2], K[1, 2])),
        (Sensor('plumb_bob'), Intrinsics(K[0, 0], K[1, 1], K[0, 2], K[1, 2])),
        (Sensor('none', 'window'), Intrinsics(K[0, 0], K[1, 1], K[0, 2], K[1, 2])),
    ):
        frame, box = sensor.shot(PLACES[-1], 0)
        position = replace(frame, intrinsics=wrong).position(box, AHEAD)
        assert position is not None
        assert np.linalg.norm(np.subtract(position, PLACES[-1])) > CLOSE


def messages(sensor: Sensor) -> tuple[list[Sent], Box]:
    """A bag of the board."""
    shots = [sensor.shot(place, number) for number, place in enumerate(PLACES)]
    topic = RECT if sensor.rectified else RAW
    sent = camera_messages([frame for frame, _ in shots], color=topic, depth=DEPTH, info=None)
    return [*sent, *(Sent(INFO, s.log_ns, sensor.info()) for s in sent[:1])], shots[0][1]


@pytest.mark.parametrize('kind', ['mcap', 'ROS 1'])
@pytest.mark.parametrize('rectified', [False, True])
def test_a_bag_is_read_by_the_same_rule(kind: str, rectified: bool, tmp_path: Path) -> None:
    sensor = Sensor(window='window, binned', rectified=rectified)
    sent, box = messages(sensor)
    if kind == 'mcap':
        path = write_mcap(tmp_path / 'a.mcap', sent)
    else:
        path = write_ros1(tmp_path / 'a.bag', sent)
    with open_recording(path) as recording:
        assert not recording.warnings
        frames = list(recording.frames())
    assert frames[0].intrinsics is not None
    assert (frames[0].intrinsics.lens is None) == rectified
    assert max(errors(followed(frames, box))) < CLOSE
    with open_recording(path, ReadOptions(rectified='no' if rectified else 'yes')) as recording:
        other = recording.intrinsics
    assert other is not None
    assert (other.lens is None) != rectified


def test_converted_and_written_as_a_folder_the_lens_stays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sent, _ = messages(Sensor(window='window, binned'))
    path = write_mcap(tmp_path / 'a.mcap', sent)
    with open_recording(path) as recording:
        frames, camera = list(recording.frames()), recording.intrinsics
    assert camera is not None
    with SequenceWriter(tmp_path / 'folder') as writer:
        for frame in frames:
            writer.write(frame, None)
    copies = ['folder']
    for names in ('generic', 'kinect2_hd', 'kinect2_sd'):
        copies.append(f'{names}.mcap')
        options = [str(tmp_path / 'folder'), str(tmp_path / copies[-1]), '--camera', names]
        assert main(['convert', *options]) == 0
    for copy in copies:
        with open_recording(tmp_path / copy) as recording:
            assert recording.intrinsics == camera
    capsys.readouterr()
    assert main(['info', str(path)]) == 0
    assert 'distortion    plumb_bob -0.28 0.09' in capsys.readouterr().out
    assert main(['info', str(path), '--json']) == 0
    told = json.loads(capsys.readouterr().out)['intrinsics']
    assert (told['distortion_model'], len(told['d'])) == ('plumb_bob', 5)


@pytest.mark.parametrize(
    ('name', 'raw'),
    [
        ('/kinect2/qhd/image_color_rect', '/kinect2/qhd/image_color'),
        ('/rgb/image_rect_color', '/rgb/image_color'),
        ('/left/rect/image', '/left/image'),
        ('/left/rect_image', '/left/image'),
        (RAW, RAW),
        ('/direct/image', '/direct/image'),
    ],
)
def test_what_is_no_rectified_picture_is_not_written_as_one(
    name: str, raw: str, tmp_path: Path
) -> None:
    """Also where the source says so by a wrong name, and the user has put it right."""
    frame, _ = Sensor().shot(PLACES[0], 0)
    sent = camera_messages([frame], color=name, depth=DEPTH, info=None)
    sent += [Sent(INFO, s.log_ns, Sensor().info()) for s in sent[:1]]
    with open_recording(
        write_mcap(tmp_path / 'a.mcap', sent), ReadOptions(info_topic=INFO, rectified='no')
    ) as recording:
        camera, (topics, _) = recording.intrinsics, output_topics(recording)
        write_recording(recording, tmp_path / 'b.mcap', topics=topics)
    assert camera is not None
    assert camera.lens is not None
    assert (topics.color, topics.depth) == (raw, DEPTH)
    with open_recording(tmp_path / 'b.mcap') as recording:
        assert recording.intrinsics == camera


def test_live_messages_are_read_by_the_same_rule() -> None:
    faults: list[str] = []
    published: list[Any] = []
    session = Session(DEFAULT_VARIANT, default_parameters(DEFAULT_VARIANT), faults.append)
    processor = Processor(
        session,
        SimpleNamespace(
            image_wanted=False,
            publish=lambda answer: published.append(answer.track.position),
            publish_extras=lambda answer: None,
        ),
        Statistics(),
        lambda: 0,
        lambda _, text: faults.append(text),
    )
    sensor = Sensor('equidistant', 'window, binned')
    camera = camera_from_info(sensor.info(), RAW)
    for number, place in enumerate(PLACES):
        frame, box = sensor.shot(place, number)
        if number == 0:
            session.choose(lambda _, box=box: box)
        stamp = 1 + number * 100_000_000
        assert frame.depth is not None
        processor(
            Capture(
                image(stamp, encode_color(frame.color)),
                image(stamp, encode_depth(frame.depth)),
                camera,
                stamp,
            )
        )
    assert not faults
    assert max(errors(published)) < CLOSE
    # no point of the plane shows there through this lens
    strange = replace(camera.intrinsics, lens=Lens((1e10,) * 5))
    session.reset()
    session.choose(lambda _: box)
    processor(
        Capture(
            image(10**9, encode_color(frame.color)),
            image(10**9, encode_depth(frame.depth)),
            camera._replace(intrinsics=strange),
            10**9,
        )
    )
    assert published[-1] is None
    assert 'lens of camera_info cannot be taken out at the target' in faults.pop()
    # the whole sensor's picture is not this camera's
    whole, _ = Sensor('equidistant').shot(PLACES[0], 9)
    capture = Capture(image(10**9, encode_color(whole.color)), None, camera, 10**9)
    frame_of = processor.frame(capture, 10**9)
    assert frame_of is not None
    assert frame_of.intrinsics is None
    assert (
        'is for 320x210 images (by roi and binning, of 960x540) but these are 960x540' in faults[0]
    )


@pytest.mark.parametrize(
    ('topic', 'rectified'),
    [
        ('/camera/image_raw', False),
        ('/camera/image_color', False),
        ('/camera/image', False),
        ('/camera/image_rect', True),
        ('/camera/image_rect_color', True),
        ('/camera/camera/infra1/image_rect_raw', True),
        ('/kinect2/qhd/image_color_rect', True),
        ('/rectified/image', True),
        ('/direct/correct/image', False),
        ('/rectangle/image', False),
    ],
)
def test_the_name_of_a_topic_says_whether_it_is_rectified(topic: str, rectified: bool) -> None:
    assert is_rectified(topic) == rectified


def changed(**fields: Any) -> Any:
    message = Sensor().info()
    roi = fields.pop('roi', None)
    for name, value in fields.items():
        setattr(message, name, value)
    if roi is not None:
        message.roi = replace(message.roi, **roi)
    return message


@pytest.mark.parametrize(
    ('fields', 'words'),
    [
        ({'k': np.full(9, np.nan)}, 'no camera'),
        ({'k': np.full(9, -5.0)}, 'no camera'),
        ({'k': np.diag([1e-300, 500.0, 1.0]).ravel()}, 'no camera'),
        ({'k': np.diag([1e300, 500.0, 1.0]).ravel()}, 'no camera'),
        ({'k': np.diag([1e-4, 500.0, 1.0]).ravel()}, 'no camera: it states fx=0.0001'),
        ({'k': np.zeros(4)}, 'no 3x3 K'),
        ({'p': np.zeros(9)}, 'no 3x3 K'),
        ({'d': np.array([np.nan, 0, 0, 0, 0])}, 'not finite'),
        ({'d': np.array([0.1, 0.2])}, '2 distortion coefficients: give 4 or 5'),
        ({'distortion_model': 'equidistant'}, '5 distortion coefficients: give 4'),
        ({'distortion_model': 'thin_prism'}, "the model 'thin_prism', which is not known"),
        ({'distortion_model': ''}, 'which is not known'),
        ({'roi': {'x_offset': 900, 'width': 100, 'height': 10}}, 'not on its 960x540 sensor'),
        ({'roi': {'x_offset': 960}}, 'not on its 960x540 sensor'),
        ({'binning_x': 1000, 'binning_y': 1}, 'a binning of 1000x1 of 960x540'),
    ],
)
def test_a_camera_info_that_is_no_camera_is_refused_with_a_word(
    fields: dict[str, Any], words: str
) -> None:
    with pytest.raises(ImageError, match=words):
        camera_from_info(changed(**fields), RAW)


@pytest.mark.parametrize('focal', [0.0, 1e-300, 1e300, float('nan')])
def test_intrinsics_that_cannot_be_reckoned_with_are_refused(focal: float) -> None:
    with pytest.raises(ParameterError, match='intrinsics fx'):
        Intrinsics(focal, 500.0, 320.0, 240.0)


@pytest.mark.parametrize('variant', VARIANTS)
@pytest.mark.parametrize('focal', CAMERA_PX)
def test_a_camera_that_is_taken_ends_no_tracker(variant: str, focal: float) -> None:
    """Whatever is not refused can be reckoned with, as wrong as it is, in reduced images too."""
    color = np.random.default_rng(1).integers(0, 255, (360, 480, 3), np.uint8)
    depth = np.full((360, 480), 4.0, np.float32)
    depth[90:270, 180:300] = 2.0
    tracker = create_tracker(variant)
    found = camera_from_info(changed(k=np.diag([focal, focal, 1.0]).ravel()), RAW)
    assert found is not None
    camera = found.intrinsics
    tracker.start(Frame(color, depth, 0, camera), Box(180, 90, 120, 180))
    for number in range(1, 4):
        track = tracker.update(Frame(color, depth, number * 33_000_000, camera))
        assert track.position is None or np.isfinite(track.position).all()


def test_what_is_left_out_of_a_camera_info() -> None:
    assert camera_from_info(changed(k=np.zeros(9), p=np.zeros(12)), RAW) is None
    only_p = camera_from_info(changed(k=np.zeros(9)), RAW)
    assert only_p is not None
    assert only_p.intrinsics.fx == P[0, 0]
    only_k = camera_from_info(changed(p=np.zeros(12)), RECT)
    assert only_k is not None
    assert only_k.intrinsics == Intrinsics(K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    unsized = camera_from_info(changed(width=0, height=0), RAW)
    assert unsized is not None
    assert unsized.misfit(123, 45) == ''
    # a rectified picture is none of the lens's business
    assert camera_from_info(changed(distortion_model='thin_prism'), RECT) is not None


@pytest.mark.parametrize('lens', ['plumb_bob', 'rational_polynomial', 'equidistant'])
def test_a_lens_is_taken_out_of_what_it_shows(lens: str) -> None:
    model, coefficients = LENSES[lens]
    one = Lens(coefficients, model == 'equidistant')
    points = np.random.default_rng(5).uniform(-0.8, 0.8, (50, 2))
    assert np.allclose(one.straightened(one.bent(points)), points, atol=1e-6)
    camera = Intrinsics(500, 500, 320, 240, lens=one)
    assert np.allclose(camera.deproject(*camera.project(0.5, -0.4, 2.0), 2.0), (0.5, -0.4, 2.0))


def test_where_a_lens_shows_nothing_there_is_no_position() -> None:
    """Barrel distortion folds back: no ray falls far out."""
    camera = Intrinsics(500, 500, 320, 240, lens=Lens((-0.3, 0.0, 0.0, 0.0, 0.0)))
    assert np.isnan(camera.deproject(2000, 240, 3.0)[:2]).all()
    color, depth = np.zeros((480, 2200, 3), np.uint8), np.full((480, 2200), 3.0, np.float32)
    frame = Frame(color, depth, 0, camera)
    assert frame.position(Box(1990, 230, 20, 20), 3.0) is None
    tracker = create_tracker(DEFAULT_VARIANT)
    assert tracker.start(frame, Box(1990, 230, 20, 20)).position is None
    assert tracker.update(frame).position is None


def test_a_lens_of_wrong_numbers_is_refused() -> None:
    for coefficients in ((), (1.0,), (0.0, 0.0, 0.0, float('inf'))):
        with pytest.raises(ParameterError):
            Lens(coefficients)


@pytest.mark.parametrize('lens', [Lens((-0.2, 0.05, 0, 0, 0)), Lens((0.1, 0, 0, 0), fisheye=True)])
def test_no_points_are_bent_to_no_points(lens: Lens) -> None:
    assert lens.bent(np.zeros((0, 2))).shape == (0, 2)
    assert lens.straightened(np.zeros((0, 2))).shape == (0, 2)


def test_zeros_after_a_change_of_the_camera_are_passed_over(tmp_path: Path) -> None:
    """The camera of before the change came back for as long as a driver sent none."""
    frames = make_frames(9)
    sent = camera_messages([replace(f, intrinsics=None) for f in frames], info=None)
    for f, fx in zip(frames, (50, 50, 50, 80, 80, 80, 0, 0, 80), strict=True):
        told = camera_info(header(f.stamp_ns, 'optical'), *SIZE, replace(CAMERA, fx=fx or 1.0))
        if not fx:
            told.k, told.p = np.zeros(9), np.zeros(12)
        sent.append(Sent(INFO, f.stamp_ns - 1_000_000, told))
    path = write_mcap(tmp_path / 'a.mcap', sorted(sent, key=lambda s: s.log_ns))
    with open_recording(path) as recording:
        for start in (0, 7):
            seen = [f.intrinsics.fx for f in recording.frames(start) if f.intrinsics is not None]
            assert seen == [50, 50, 50, 80, 80, 80, 80, 80, 80][start:]
