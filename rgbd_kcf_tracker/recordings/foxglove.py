# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Boxes and names over a picture as Foxglove draws them: ``foxglove_msgs/ImageAnnotations``.

Our bags bring the types along, so that nobody needs foxglove_msgs to read or to write them. The
fields are those that all of its releases share (github.com/foxglove/foxglove-sdk, schemas/ros2).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rgbd_kcf_tracker.recordings.message_types import MessageTypes
from rgbd_kcf_tracker.recordings.overlay import id_color
from rgbd_kcf_tracker.track import Track

ANNOTATIONS = 'foxglove_msgs/msg/ImageAnnotations'
DEFINITIONS = {
    'foxglove_msgs/msg/Point2': 'float64 x\nfloat64 y\n',
    'foxglove_msgs/msg/Color': 'float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n',
    'foxglove_msgs/msg/CircleAnnotation': (
        'builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nfloat64 diameter\n'
        'float64 thickness\nfoxglove_msgs/Color fill_color\nfoxglove_msgs/Color outline_color\n'
    ),
    'foxglove_msgs/msg/PointsAnnotation': (
        'uint8 LINE_LOOP=2\n'
        'builtin_interfaces/Time timestamp\nuint8 type\nfoxglove_msgs/Point2[] points\n'
        'foxglove_msgs/Color outline_color\nfoxglove_msgs/Color[] outline_colors\n'
        'foxglove_msgs/Color fill_color\nfloat64 thickness\n'
    ),
    'foxglove_msgs/msg/TextAnnotation': (
        'builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nstring text\n'
        'float64 font_size\nfoxglove_msgs/Color text_color\nfoxglove_msgs/Color background_color\n'
    ),
    ANNOTATIONS: (
        'foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n'
        'foxglove_msgs/TextAnnotation[] texts\n'
    ),
}
LINE, LETTERS = 3.0, 16.0
"""Pixels of the lines' width and the letters' height."""


def image_annotations(types: MessageTypes, header: Any, tracks: Iterable[Track]) -> Any:
    """The boxes of the targets that are seen, each with id, state and score."""
    make, message = types.make, types.make(ANNOTATIONS)
    stamp = header.stamp
    for track in tracks:
        if track.box is None:
            continue
        box = track.box
        blue, green, red = (channel / 255 for channel in id_color(track.id))
        color = make('foxglove_msgs/msg/Color', r=red, g=green, b=blue, a=1.0)
        corners = [
            make('foxglove_msgs/msg/Point2', x=x, y=y)
            for x, y in (
                (box.x, box.y),
                (box.right, box.y),
                (box.right, box.bottom),
                (box.x, box.bottom),
            )
        ]
        line = make(
            'foxglove_msgs/msg/PointsAnnotation',
            timestamp=stamp,
            points=corners,
            outline_color=color,
            thickness=LINE,
        )
        line.type = line.LINE_LOOP
        message.points.append(line)
        message.texts.append(
            make(
                'foxglove_msgs/msg/TextAnnotation',
                timestamp=stamp,
                position=corners[0],
                text=f'{track.id} {track.state.value} {track.score:.2f}',
                font_size=LETTERS,
                text_color=make('foxglove_msgs/msg/Color', r=0.0, g=0.0, b=0.0, a=1.0),
                background_color=color,
            )
        )
    return message
