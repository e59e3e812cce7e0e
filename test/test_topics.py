# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Which topics are the camera: known names, other names, named ones, and questions to the user."""

from __future__ import annotations

import pytest

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.bag_topics import role_by_name
from rgbd_kcf_tracker.recordings.topics import ChosenTopics, ImageTopic, base_name, choose_topics


def choose(
    colors: str,
    depths: str,
    infos: str = '',
    *,
    color: str | None = None,
    depth: str | None = None,
    info: str | None = None,
    sizes: dict[str, tuple[int, int]] | None = None,
) -> ChosenTopics:
    """Choose among topics that are given as words."""
    sizes = sizes or {}
    images = [ImageTopic(n, 'color', sizes.get(n)) for n in colors.split()]
    images += [ImageTopic(n, 'depth', sizes.get(n)) for n in depths.split()]
    described = {i.name: 'sensor_msgs/msg/Image, 9 messages' for i in images}
    described |= dict.fromkeys(infos.split(), 'sensor_msgs/msg/CameraInfo, 9 messages')
    described['/tf'] = 'tf2_msgs/msg/TFMessage, 3 messages'
    return choose_topics(images, infos.split(), described, 'a.mcap', color, depth, info)


@pytest.mark.parametrize(
    ('colors', 'depths', 'info', 'expected'),
    [
        # kinect2_bridge, with all it sends at one resolution
        (
            '/kinect2/qhd/image_color /kinect2/qhd/image_color_rect /kinect2/qhd/image_mono '
            '/kinect2/qhd/image_mono_rect',
            '/kinect2/qhd/image_depth_rect',
            '/kinect2/qhd/camera_info',
            ('/kinect2/qhd/image_color_rect', '/kinect2/qhd/image_depth_rect'),
        ),
        (
            '/kinect2/sd/image_color_rect',
            '/kinect2/sd/image_depth_rect /kinect2/sd/image_depth /kinect2/sd/image_ir '
            '/kinect2/sd/image_ir_rect',
            '/kinect2/sd/camera_info',
            ('/kinect2/sd/image_color_rect', '/kinect2/sd/image_depth_rect'),
        ),
        # RealSense: the aligned depth, not the depth camera's own
        (
            '/camera/camera/color/image_raw /camera/camera/infra1/image_rect_raw',
            '/camera/camera/depth/image_rect_raw /camera/camera/aligned_depth_to_color/image_raw',
            '/camera/camera/color/camera_info',
            ('/camera/camera/color/image_raw', '/camera/camera/aligned_depth_to_color/image_raw'),
        ),
        # Orbbec
        (
            '/camera/color/image_raw /camera/ir/image_raw',
            '/camera/depth/image_raw',
            '/camera/color/camera_info',
            ('/camera/color/image_raw', '/camera/depth/image_raw'),
        ),
        # Azure Kinect, which also sends colour registered to depth
        (
            '/rgb/image_raw /rgb_to_depth/image_raw',
            '/depth/image_raw /depth_to_rgb/image_raw /ir/image_raw',
            '/rgb/camera_info',
            ('/rgb/image_raw', '/depth_to_rgb/image_raw'),
        ),
        # OpenNI and a robot's head
        (
            '/hero/head_rgbd_sensor/rgb/image_raw',
            '/hero/head_rgbd_sensor/depth_registered/image',
            '/hero/head_rgbd_sensor/rgb/camera_info',
            (
                '/hero/head_rgbd_sensor/rgb/image_raw',
                '/hero/head_rgbd_sensor/depth_registered/image',
            ),
        ),
        # ours
        ('/color/image', '/depth/image', '/color/camera_info', ('/color/image', '/depth/image')),
        # names that nobody knows
        ('/left', '/right', '', ('/left', '/right')),
        # what a tracker drew beside what a camera sent
        (
            '/cam/color/image_raw /tracker/image_annotated/compressed',
            '/cam/depth/image_raw',
            '/cam/color/camera_info',
            ('/cam/color/image_raw', '/cam/depth/image_raw'),
        ),
    ],
)
def test_known_cameras(colors: str, depths: str, info: str, expected: tuple[str, str]) -> None:
    chosen = choose(colors, depths, f'{info} /other/depth/camera_info')
    assert (chosen.color, chosen.depth) == expected
    assert chosen.info == (info or None)


def test_raw_goes_before_compressed_and_compressed_alone_will_do() -> None:
    chosen = choose(
        '/c/color/image_raw /c/color/image_raw/compressed',
        '/c/depth/image_raw/compressed /c/depth/image_raw/compressedDepth',
        '/c/color/camera_info',
    )
    assert chosen.color == '/c/color/image_raw'
    assert chosen.depth == '/c/depth/image_raw/compressedDepth'
    assert chosen.info == '/c/color/camera_info'
    chosen = choose('/kinect2/hd/image_color/compressed', '/kinect2/hd/image_depth_rect/compressed')
    assert chosen.color == '/kinect2/hd/image_color/compressed'


def test_two_cameras_ask_and_say_how_to_answer() -> None:
    names = (
        '/kinect2/hd/image_color_rect /kinect2/qhd/image_color_rect',
        '/kinect2/hd/image_depth_rect /kinect2/qhd/image_depth_rect',
    )
    with pytest.raises(RecordingError, match=r'2 cameras') as caught:
        choose(*names)
    assert (
        '--color-topic /kinect2/hd/image_color_rect --depth-topic /kinect2/hd/image_depth_rect'
    ) in str(caught.value)
    chosen = choose(*names, color='/kinect2/qhd/image_color_rect')
    assert chosen.depth == '/kinect2/qhd/image_depth_rect'
    chosen = choose(*names, depth='/kinect2/hd/image_depth_rect')
    assert chosen.color == '/kinect2/hd/image_color_rect'


def test_two_unknown_candidates_ask() -> None:
    with pytest.raises(RecordingError, match=r'2 colour topics that fit: /a, /b.*--color-topic /a'):
        choose('/a /b', '/d')
    with pytest.raises(RecordingError, match=r'2 depth topics that fit: /d, /e.*--depth-topic /d'):
        choose('/a', '/d /e')


def test_sizes_decide_where_names_do_not() -> None:
    sizes = {'/a': (640, 480), '/d': (320, 240), '/e': (640, 480)}
    assert choose('/a', '/d /e', sizes=sizes).depth == '/e'


def test_named_topics() -> None:
    names = ('/a /b', '/d /e', '/i /j')
    chosen = choose(*names, color='b', depth='/e', info='j')
    assert chosen == ChosenTopics('/b', '/e', '/j')
    assert choose('/a/compressed', '/d', color='/a').color == '/a/compressed'
    for option in ('color', 'depth', 'info'):
        with pytest.raises(RecordingError, match=rf'/nothing.*--{option}-topic.*/tf \(tf2_msgs'):
            choose('/a', '/d', '/i', **{option: '/nothing'})  # type: ignore[arg-type]
    with pytest.raises(RecordingError, match='holds no images'):
        choose('/a', '/d', color='/tf')
    for depth in (None, '/d'):
        with pytest.raises(
            RecordingError, match=r'/d cannot be both .*--color-topic or as --depth'
        ):
            choose('/a', '/d', color='/d', depth=depth)


def test_nothing_that_fits_lists_the_topics() -> None:
    # Depth that was announced and never came is no colour alone.
    with pytest.raises(RecordingError, match=r'no depth topic.*none to read colour alone.*/a '):
        choose('/a', '', '/depth/camera_info')
    with pytest.raises(RecordingError, match=r'no colour topic.*--color-topic.*/d '):
        choose('', '/d')


def test_colour_alone_when_asked() -> None:
    assert choose('/a', '', depth='none') == ChosenTopics('/a', None, None)
    assert choose('/a', '/d', depth='none').depth is None
    both = '/kinect2/qhd/image_color /kinect2/qhd/image_color_rect'
    for depth in ('none', None):  # not asked for: where no depth was recorded
        chosen = choose(both, '', '/kinect2/qhd/camera_info', depth=depth)
        assert (chosen.color, chosen.depth) == ('/kinect2/qhd/image_color_rect', None)
        assert chosen.info == '/kinect2/qhd/camera_info'
    with pytest.raises(RecordingError, match='2 colour topics'):
        choose('/a /b', '', depth='none')


def test_transports_are_taken_off() -> None:
    assert base_name('/a/image/compressedDepth') == '/a/image'
    assert base_name('/a/image/compressed') == '/a/image'
    assert base_name('/a/image') == '/a/image'


@pytest.mark.parametrize(
    ('name', 'role'),
    [
        ('/depth_cam/color/image_raw/compressed', 'color'),
        ('/depth_cam/rgb/image_raw', 'color'),
        ('/depth_cam/depth/image_raw', 'depth'),
        ('/camera/aligned_depth_to_color/image_raw/compressedDepth', 'depth'),
        ('/kinect2/hd/image_depth_rect', 'depth'),
        ('/camera/depth_registered/hw_registered/image_rect_raw', 'depth'),
        ('/camera/image_raw', 'color'),
    ],
)
def test_colour_below_a_camera_that_is_called_after_depth_is_colour(name: str, role: str) -> None:
    assert role_by_name(name) == role
