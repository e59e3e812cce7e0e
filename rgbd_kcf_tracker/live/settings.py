# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the tracker node can be told, as data: no ROS is needed to read it.

The variants bring their own parameters; the node shows them as ``<variant>.<name>``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from rgbd_kcf_tracker.errors import BoxError, ParameterError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import ParameterInfo, Parameters, describe, parameter
from rgbd_kcf_tracker.recordings import camera_info
from rgbd_kcf_tracker.recordings.containers import MAX_PIXELS, MAX_SIDE
from rgbd_kcf_tracker.recordings.pairing import DEFAULT_TOLERANCE_S
from rgbd_kcf_tracker.recordings.whereabouts import POSE_PREDICTION_S
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS

NEWEST, ALL = 'newest', 'all'
RAW, COMPRESSED, COMPRESSED_DEPTH = 'raw', 'compressed', 'compressedDepth'
AUTO, BEST_EFFORT, RELIABLE = 'auto', 'best_effort', 'reliable'
KEEP, RESTART = 'keep', 'restart'
OFF, TARGET = 'off', 'target'
MOST_TARGETS = 8
"""At worst, where boxes hold nobody, each takes 13 ms of a frame with metric, 3 to 10 with another
variant (320x240, one core): a tenth of a second for all, so that images go on at 8 Hz."""


@dataclass(frozen=True)
class NodeParameters(Parameters):
    """Parameters of the tracker node itself."""

    variant: str = parameter(
        DEFAULT_VARIANT,
        'Which tracker follows the target; a change takes over the target at the next box.',
        choices=tuple(VARIANTS),
    )
    init_box: str = parameter(
        '',
        'Target to start on in the next image, as x,y,width,height in pixels of the colour image '
        '(a list of four numbers is taken too); empty for none.',
        unit='px',
    )
    auto_init: bool = parameter(
        False,
        'Choose the target without being told: the nearest person in range, by depth and motion.',
    )
    auto_init_again: bool = parameter(
        False, 'With auto_init: choose again when the target is lost, instead of searching on.'
    )
    auto_init_near: float = parameter(
        0.5, 'Nearest distance at which auto_init looks.', unit='m', minimum=0.1, maximum=20.0
    )
    auto_init_far: float = parameter(
        4.5, 'Farthest distance at which auto_init looks.', unit='m', minimum=0.2, maximum=20.0
    )
    follow_everyone: bool = parameter(
        False,
        'Follow everyone in view beside the chosen target, each with an id (variant metric).',
    )
    max_targets: int = parameter(
        MOST_TARGETS,
        'Targets that were chosen or added and are followed at once, at most: ~/add is refused '
        'beyond.',
        unit='targets',
        minimum=1,
        maximum=64,
    )
    on_time_jump: str = parameter(
        KEEP,
        'When stamps jump back (a bag that loops): keep the target, or restart from init_box or '
        'auto_init, where one of them is set.',
        choices=(KEEP, RESTART),
    )
    pair_tolerance: float = parameter(
        DEFAULT_TOLERANCE_S,
        'Largest difference between the stamps of a colour image and its depth image.',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )
    depth_wait: float = parameter(
        0.1,
        'How long a colour image waits for its depth image before it is used without.',
        unit='s',
        minimum=0.0,
        maximum=5.0,
    )
    camera_info_wait: float = parameter(
        1.0,
        'How long the first image waits for a camera_info that somebody publishes.',
        unit='s',
        minimum=0.0,
        maximum=10.0,
    )
    pose_prediction: float = parameter(
        POSE_PREDICTION_S,
        'How long ~/pose goes on with where a hidden target is believed to be; 0 for only while it '
        'is seen.',
        unit='s',
        minimum=0.0,
        maximum=60.0,
    )
    target_frame: str = parameter(
        '',
        'Frame in which positions, poses, velocities, markers and 3D detections go out, by TF '
        "(base_link, map); empty for the camera's own.",
    )
    fixed_frame: str = parameter(
        '',
        'Frame that does not move, by TF (odom), in which a moving camera keeps the targets in '
        "mind; empty for what the picture tells of the camera's motion.",
    )
    tf_wait: float = parameter(
        0.1,
        'How long a pair waits for TF that is a little behind it.',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )
    publish_tf: str = parameter(
        OFF,
        'Whom to publish as a TF frame: the chosen target, or all.',
        choices=(OFF, TARGET, ALL),
    )
    tf_name: str = parameter(
        'target', "Name of the chosen target's TF frame; the others' is it with _<id>."
    )
    jpeg_quality: int = parameter(
        80, 'Quality of ~/image_annotated/compressed.', unit='%', minimum=1, maximum=100
    )
    stale_after: float = parameter(
        2.0,
        'Time without images after which diagnostics report the camera as silent.',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )
    queue_policy: str = parameter(
        NEWEST,
        'When tracking is slower than the camera: take the newest pair and count the others as '
        'dropped, or process all pairs in order (recordings, lock-step).',
        choices=(NEWEST, ALL),
    )
    queue_size: int = parameter(
        60,
        'With queue_policy all: pairs kept waiting at most; the oldest is dropped beyond.',
        unit='pairs',
        minimum=1,
        maximum=1000,
    )
    color_transport: str = parameter(
        RAW, 'How colour images arrive.', choices=(RAW, COMPRESSED), source='image_transport'
    )
    depth_transport: str = parameter(
        RAW,
        'How depth images arrive; compressed is the bare PNG or TIFF of kinect2_bridge.',
        choices=(RAW, COMPRESSED, COMPRESSED_DEPTH),
        source='image_transport',
    )
    color_rectified: str = parameter(
        camera_info.AUTO,
        'Whether the colour images are rectified, so that P of camera_info is their camera and not '
        'K with the lens: auto goes by the name of the topic, which has the word rect in it then.',
        choices=camera_info.RECTIFIED,
        source='sensor_msgs/CameraInfo',
    )
    reliability: str = parameter(
        AUTO,
        'QoS of the image subscriptions. Best effort hears every driver; auto is best effort, and '
        'reliable with queue_policy all.',
        choices=(AUTO, BEST_EFFORT, RELIABLE),
    )
    qos_depth: int = parameter(
        5, 'QoS history depth of the image subscriptions.', unit='messages', minimum=1, maximum=1000
    )
    max_pixels: int = parameter(
        MAX_PIXELS,
        'Pixels of the largest image that is read: a few kB of PNG can claim an image that takes '
        'seconds to unpack.',
        unit='px',
        minimum=1,
        maximum=MAX_SIDE * MAX_SIDE,
    )
    autostart: bool = parameter(
        True, 'Configure and activate at once; false waits for a lifecycle manager.'
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.publish_tf != OFF and self.tf_name in ('', self.target_frame, self.fixed_frame):
            raise ParameterError(
                f"parameter tf_name is {self.tf_name!r}: give the target's frame a name of its "
                'own, other than target_frame and fixed_frame'
            )


def auto_init_range(settings: NodeParameters) -> tuple[float, float]:
    """Between which distances ``auto_init`` looks.

    Each is set by itself, also by ``ros2 param load``: what is between two of them is no fault yet.

    Raises:
        ParameterError: where nobody can be between them.
    """
    near, far = settings.auto_init_near, settings.auto_init_far
    if near >= far:
        raise ParameterError(
            f'parameter auto_init_near is {near:g} and auto_init_far {far:g}: nobody is '
            'between them: the first must be the smaller'
        )
    return near, far


READ_ONLY = frozenset(
    {
        'queue_policy',
        'queue_size',
        'color_transport',
        'depth_transport',
        'reliability',
        'qos_depth',
        'max_pixels',
        'autostart',
        'target_frame',
        'fixed_frame',
        'tf_wait',
        'publish_tf',
        'tf_name',
    }
)
"""Node parameters that are fixed at start: they decide how the node is wired."""


def all_parameters() -> Iterator[ParameterInfo]:
    """Every ROS parameter of the tracker node: its own, then each variant's with its prefix."""
    yield from describe(NodeParameters)
    for name, variant in VARIANTS.items():
        for info in describe(variant.parameters):
            yield replace(info, name=f'{name}.{info.name}')


def parse_box(text: str) -> Box | None:
    """The box that ``x,y,width,height`` names, None for an empty text.

    Raises:
        ParameterError: where the text is not four numbers or the box has no size.
    """
    text = text.strip().strip('[]()')
    if not text:
        return None
    try:
        x, y, width, height = (float(part) for part in text.split(','))
        return Box(x, y, width, height)
    except (ValueError, BoxError) as error:
        reason = error if isinstance(error, BoxError) else f'{text!r} is not four numbers'
        raise ParameterError(f'parameter init_box: {reason}: give x,y,width,height') from None
