# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the replay node can be told, as data: no ROS is needed to read it."""

from __future__ import annotations

from dataclasses import dataclass

from rgbd_kcf_tracker.parameters import Parameters, parameter
from rgbd_kcf_tracker.recordings.pairing import DEFAULT_TOLERANCE_S


@dataclass(frozen=True)
class ReplayParameters(Parameters):
    """Parameters of the replay node. All are read at start."""

    bag: str = parameter(
        '',
        'The recording: an .mcap file, a rosbag2 folder, a ROS 1 .bag or a sequence folder.',
    )
    rate: float = parameter(
        1.0,
        'Speed: 2 is twice as fast as recorded, 0 as fast as possible. In lock-step the tracker '
        'sets the pace.',
        minimum=0.0,
        maximum=1000.0,
    )
    loop: bool = parameter(False, 'Begin again at the end, with the recorded stamps.')
    start: float = parameter(
        0.0,
        'Where to begin, from the first message of the recording; earlier /tf_static and the last '
        'camera_info before it go ahead.',
        unit='s',
        minimum=0.0,
    )
    clock: bool = parameter(
        True, 'Publish the recorded time on /clock, for nodes with use_sim_time.'
    )
    lockstep: bool = parameter(
        False, "Hold the next frame back until the tracker's answer to the last has come."
    )
    topics: str = parameter(
        '',
        'Recorded topics to publish, separated by commas; empty for all but the answers of a '
        'tracker that was recorded too.',
    )
    color_topic: str = parameter(
        '', 'The recorded colour topic that a tracker answers; empty to find it.'
    )
    depth_topic: str = parameter('', 'The recorded depth topic; empty to find it.')
    info_topic: str = parameter('', 'The recorded CameraInfo topic; empty to find it.')
    fps: float = parameter(
        30.0,
        'Frame rate of a sequence folder that stores no stamps.',
        unit='Hz',
        minimum=0.1,
        maximum=1000.0,
    )
    answer_topic: str = parameter(
        '/tracker/box', "The tracker's ~/box, by which lock-step and the report know its answers."
    )
    answer_timeout: float = parameter(
        5.0,
        'In lock-step: how long to wait for an answer before the images are sent again, and then '
        'given up.',
        unit='s',
        minimum=0.05,
        maximum=3600.0,
    )
    pair_tolerance: float = parameter(
        DEFAULT_TOLERANCE_S,
        "Largest difference between the stamps of a pair: the tracker's pair_tolerance.",
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )
    wait_for_subscribers: float = parameter(
        10.0,
        'How long to wait for somebody to listen before the first image goes out; in lock-step it '
        'is an error when nobody comes.',
        unit='s',
        minimum=0.0,
        maximum=3600.0,
    )
    reliability: str = parameter(
        'reliable',
        'QoS of the publishers. Reliable reaches best-effort subscriptions too.',
        choices=('reliable', 'best_effort'),
    )
    qos_depth: int = parameter(
        10, 'QoS history depth of the publishers.', unit='messages', minimum=1, maximum=1000
    )
    report: str = parameter(
        '', 'A JSON file for the figures of the run: images sent, answers, rate, latency.'
    )
    overwrite: bool = parameter(False, 'Replace the report if it is there; the recording never is.')

    def topic_list(self) -> tuple[str, ...]:
        """The names in ``topics``."""
        return tuple(name.strip() for name in self.topics.split(',') if name.strip())
