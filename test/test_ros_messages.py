# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Between messages and our types, for any input that the wire can carry."""

from __future__ import annotations

import array
import sys
import time
from types import ModuleType, SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip('rclpy', reason="needs ROS 2: pip install '.[ros]'")

from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from stand_ins import vision_messages
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from rgbd_kcf_tracker import Box, Frame, Intrinsics, RgbdKcfError, Track, TrackState
from rgbd_kcf_tracker.live.places import Places
from rgbd_kcf_tracker.live.processor import Capture, Processor, in_picture
from rgbd_kcf_tracker.live.session import Session
from rgbd_kcf_tracker.live.statistics import Statistics
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.recordings.camera_info import Camera, camera_from_info
from rgbd_kcf_tracker.recordings.images import decode_color, decode_depth
from rgbd_kcf_tracker.recordings.messages import box_from_polygon
from rgbd_kcf_tracker.recordings.overlay import draw_track
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages
from rgbd_kcf_tracker.recordings.whereabouts import Walks
from rgbd_kcf_tracker.ros.messages import (
    ROS_TYPES,
    RosTypes,
    box_from_roi,
    image_message,
    stamp_from_ns,
    stamp_to_ns,
)
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, default_parameters

many = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
uint32 = st.integers(0, 2**32 - 1)
pixel = st.floats(-5000, 5000, width=32)
side = st.floats(0.5, 5000, width=32)
boxes = st.builds(Box, pixel, pixel, side, side)
MAKE = TrackMessages(ROS_TYPES)
HEADER = Header(stamp=stamp_from_ns(1_700_000_000_123_456_789), frame_id='camera')


def wire(message: Any) -> Any:
    """The message after a way over the wire; a wrong type or range fails here."""
    return deserialize_message(serialize_message(message), type(message))


@many
@given(st.integers(0, (2**31 - 1) * 10**9))
def test_stamps_there_and_back(stamp_ns: int) -> None:
    assert stamp_to_ns(stamp_from_ns(stamp_ns)) == stamp_ns


@many
@given(uint32, uint32, uint32, uint32)
def test_any_region_is_a_box_or_refused(x: int, y: int, width: int, height: int) -> None:
    roi = RegionOfInterest(x_offset=x, y_offset=y, width=width, height=height)
    if width and height:
        assert box_from_roi(roi).as_tuple() == (x, y, width, height)
    else:
        with pytest.raises(RgbdKcfError, match='no size'):
            box_from_roi(roi)


@many
@given(boxes, st.integers(1, 4000), st.integers(1, 4000))
def test_any_box_is_a_region_inside_the_image_or_none(box: Box, width: int, height: int) -> None:
    roi = MAKE.region(box, width, height)
    inside = box.clipped(width, height)
    if inside is None:
        assert roi is None
        return
    roi = wire(roi)
    assert 1 <= roi.width <= width - roi.x_offset
    assert 1 <= roi.height <= height - roi.y_offset
    assert roi.x_offset <= inside.x
    assert roi.x_offset + roi.width >= inside.right


@many
@given(boxes)
def test_a_polygon_is_the_box_again(box: Box) -> None:
    message = wire(MAKE.polygon(HEADER, box))
    assert message.header == HEADER
    assert len(message.polygon.points) == 4
    again = box_from_polygon(message.polygon.points)
    assert np.allclose(again.as_tuple(), box.as_tuple(), atol=2e-3)
    assert wire(MAKE.polygon(HEADER, None)).polygon.points == []


@many
@given(
    boxes,
    st.one_of(st.none(), st.tuples(*[st.floats() for _ in range(3)])),
    st.floats(0, 1),
)
def test_positions_and_markers_fit_the_wire(
    box: Box, position: tuple[float, float, float] | None, score: float
) -> None:
    track = Track(box, TrackState.TRACKING, score, None, position)
    where = Walks().update([track], 0, Intrinsics(500, 500, 160, 120)).get(track.id)
    point = MAKE.position(HEADER, where)
    finite = position is not None and bool(np.all(np.isfinite(position)))
    assert (point is not None) == finite
    marker = wire(MAKE.marker(HEADER, where))
    assert marker.action == (Marker.ADD if finite else Marker.DELETE)
    assert marker.header == HEADER


@pytest.mark.parametrize('shape', [(7, 5, 3), (7, 5), (1, 1, 3)])
def test_images_there_and_back(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    if len(shape) == 3:
        image = rng.integers(0, 255, shape, np.uint8)
        assert np.array_equal(decode_color(wire(image_message(HEADER, image, 'bgr8'))), image)
        flipped = image[:, ::-1]
        assert np.array_equal(decode_color(image_message(HEADER, flipped, 'bgr8')), flipped)
    else:
        depth = rng.integers(1, 9000, shape, np.uint16)
        metres = decode_depth(wire(image_message(HEADER, depth, '16UC1')))
        assert np.allclose(metres, depth / 1000)


def test_detections(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'vision_msgs', ModuleType('vision_msgs'))
    monkeypatch.setitem(sys.modules, 'vision_msgs.msg', vision_messages())
    make = TrackMessages(RosTypes())
    tracks = [
        Track(Box(10, 20, 30, 40), TrackState.TRACKING, 0.7, 2.0, (0.1, 0.2, 2.0), 3),
        Track(None, TrackState.OCCLUDED, id=4, predicted=(1.0, 0.0, 3.0)),
    ]
    message = make.detections(HEADER, tracks)
    (detection,) = message.detections
    center = detection.bbox.center.position
    assert detection.id == '3'
    assert (center.x, center.y, detection.bbox.size_x, detection.bbox.size_y) == (25, 40, 30, 40)
    assert detection.results[0].hypothesis.score == 0.7
    assert message.header == detection.header == HEADER
    wheres = Walks().update(tracks, 0, Intrinsics(100, 100, 30, 40))
    message = make.detections3d(HEADER, wheres.values())
    (detection,) = message.detections
    assert detection.id == '3'
    assert detection.results[0].pose.pose.position.z == 2.0
    size, center = detection.bbox.size, detection.bbox.center
    assert (size.x, size.y, size.z) == pytest.approx((0.6, 0.8, 0.5))
    assert (center.position.x, center.orientation.w) == (0.1, 1.0)
    assert message.header == detection.header == HEADER


@pytest.mark.parametrize('state', list(TrackState))
def test_an_annotated_picture_is_a_copy_with_something_on_it(state: TrackState) -> None:
    image = np.full((120, 160, 3), 90, np.uint8)
    box = Box(-20, 10, 60, 200) if state is TrackState.TRACKING else None
    out = draw_track(image, Track(box, state, 0.5, 1.5))
    assert (image == 90).all()
    assert (out != 90).any()
    assert out.shape == image.shape


def processor(faults: list[str], **options: Any) -> Processor:
    session = Session(DEFAULT_VARIANT, default_parameters(DEFAULT_VARIANT), faults.append)
    session.choose(lambda _: None)
    silent = SimpleNamespace(
        image_wanted=False, publish=lambda _: None, publish_extras=lambda _: None
    )
    return Processor(
        session, silent, Statistics(), lambda: 0, lambda _, text: faults.append(text), **options
    )


@pytest.mark.parametrize('transport', ['raw', 'compressed'])
def test_an_image_beyond_max_pixels_is_refused(transport: str) -> None:
    picture = np.full((48, 64, 3), 90, np.uint8)
    color: Any = image_message(HEADER, picture, 'bgr8')
    if transport == 'compressed':
        color = CompressedImage(header=HEADER, data=cv2.imencode('.png', picture)[1].tobytes())
    for limit in (64 * 48, 64 * 48 - 1):
        faults: list[str] = []
        made = processor(faults, color_transport=transport, max_pixels=limit)
        frame = made.frame(Capture(color, None, None, 0), 0)
        assert (frame is None) == (limit < 64 * 48) == bool(faults)
    assert 'max_pixels sets the limit' in faults[0]


encodings = st.sampled_from(
    ['bgr8', 'rgb8', 'mono8', 'bgra8', '16UC1', '32FC1', '', 'jpeg', '8UC3']
)
raw_images = st.builds(
    lambda encoding, height, width, step, big, data: Image(
        header=HEADER,
        encoding=encoding,
        height=height,
        width=width,
        step=step,
        is_bigendian=big,
        data=array.array('B', data),
    ),
    encodings,
    st.one_of(st.integers(0, 12), uint32),
    st.one_of(st.integers(0, 12), uint32),
    st.one_of(st.integers(0, 48), uint32),
    st.integers(0, 255),
    st.binary(max_size=600),
)
packed_images = st.builds(
    lambda text, data: CompressedImage(header=HEADER, format=text, data=array.array('B', data)),
    st.one_of(
        st.sampled_from(['16UC1; compressedDepth png', '32FC1; compressedDepth rvl', 'jpeg']),
        st.text(max_size=20),
    ),
    st.one_of(
        st.binary(max_size=300),
        st.binary(max_size=200).map(lambda b: b'\x89PNG\r\n\x1a\n' + b),
        st.binary(max_size=200).map(lambda b: bytes(12) + b'\x89PNG\r\n\x1a\n' + b),
        st.binary(max_size=200).map(lambda b: b'\xff\xd8\xff' + b),
    ),
)


@many
@given(raw_images, st.one_of(st.none(), raw_images))
def test_any_pair_of_images_is_a_frame_or_a_fault(color: Image, depth: Image | None) -> None:
    faults: list[str] = []
    made = processor(faults)
    frame = made.frame(Capture(color, depth, Camera(Intrinsics(1, 1, 0, 0), 0, 0), 0), 0)
    assert isinstance(frame, Frame) or faults
    made(Capture(color, depth, None, 0))


@many
@given(packed_images, packed_images)
def test_any_pair_of_compressed_images_is_a_frame_or_a_fault(
    color: CompressedImage, depth: CompressedImage
) -> None:
    faults: list[str] = []
    session = Session(DEFAULT_VARIANT, default_parameters(DEFAULT_VARIANT), faults.append)
    session.choose(lambda _: None)
    made = Processor(
        session,
        SimpleNamespace(image_wanted=True, publish=print, publish_extras=print),
        Statistics(),
        lambda: 0,
        lambda _, text: faults.append(text),
        color_transport='compressed',
        depth_transport='compressedDepth',
    )
    assert isinstance(made.frame(Capture(color, depth, None, 0), 0), Frame) or faults


@many
@given(st.lists(st.floats(width=64), min_size=9, max_size=9), st.integers(0, 2**32 - 1))
def test_any_camera_info_is_a_camera_or_refused(values: list[float], width: int) -> None:
    info = wire(CameraInfo(header=HEADER, width=width, k=values))
    try:
        camera = camera_from_info(info)
    except RgbdKcfError:
        return
    assert camera is None or (camera.intrinsics.fx > 0 and camera.intrinsics.fy > 0)


def test_a_bug_in_a_tracker_leaves_no_pair_unanswered() -> None:
    faults: list[str] = []
    made = processor(faults)
    answers: list[Track] = []
    made._publishers.publish = lambda answer: answers.append(answer.track)
    image = image_message(HEADER, np.zeros((60, 80, 3), np.uint8), 'bgr8')
    made.session.start(Frame(np.zeros((60, 80, 3), np.uint8)), Box(20, 20, 20, 20))

    def broken(_: Frame) -> Track:
        raise ZeroDivisionError('broken')

    made.session._targets.update = broken
    made(Capture(image, None, None, 0))
    assert [track.state for track in answers] == [TrackState.OCCLUDED]
    assert faults == ['internal error: ZeroDivisionError: broken']


@pytest.mark.parametrize('step', ['at', 'judged'])
def test_a_bug_in_what_places_the_camera_leaves_no_pair_unanswered(step: str) -> None:
    def broken(*_: Any) -> Places:
        raise ZeroDivisionError('broken')

    here = Places(Pose(np.eye(3), np.zeros(3)))
    told = {'at': lambda _: here, 'judged': lambda places, _: places}
    faults: list[str] = []
    made = processor(faults, places=SimpleNamespace(**told | {step: broken}))
    answers: list[Any] = []
    made._publishers.publish = answers.append
    image = image_message(HEADER, np.zeros((60, 80, 3), np.uint8), 'bgr8')
    made(Capture(image, None, None, 0))
    assert [answer.frame.pose for answer in answers] == [None]
    assert faults == ['internal error: ZeroDivisionError: broken']


@pytest.mark.parametrize(
    ('box', 'shown'),
    [
        (Box(10.25, 20, 30, 40), Box(10.25, 20, 30, 40)),
        (Box(-10, 20, 30, 40), Box(0, 20, 20, 40)),
        (Box(70, 50, 30.5, 40), Box(70, 50, 10, 10)),
        (Box(90, 20, 30, 40), None),
    ],
)
def test_boxes_are_of_what_lies_in_the_picture(box: Box, shown: Box | None) -> None:
    frame = Frame(np.zeros((60, 80, 3), np.uint8))
    track = in_picture(Track(box, TrackState.TRACKING, 0.7, 2.0), frame)
    assert track.box == shown
    assert track.state is (TrackState.OCCLUDED if shown is None else TrackState.TRACKING)


def test_who_is_chosen_on_the_newest_image_is_chosen_where_the_camera_was() -> None:
    here = Pose(np.eye(3), np.array([0.5, 0.0, 0.0]))
    told = SimpleNamespace(at=lambda _: Places(here), judged=lambda places, _: places)
    faults: list[str] = []
    made = processor(faults, places=told)
    color: Any = image_message(HEADER, np.full((48, 64, 3), 90, np.uint8), 'bgr8')
    made(Capture(color, None, None, time.monotonic_ns()))
    started: list[Frame] = []
    made.session.start_as_asked = started.append  # type: ignore[method-assign]
    made.choose(lambda _: Box(10, 10, 20, 20), 1.0)
    assert [frame.pose for frame in started] == [here]
    assert not faults
