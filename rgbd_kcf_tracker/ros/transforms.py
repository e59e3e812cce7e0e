# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Camera poses from TF, and the targets as TF frames. Needs tf2_ros, which not every ROS 2 has.

A result is placed by the transform at its image's own stamp or not at all: never by the newest one,
by none that jumped, and by none that stands still while the picture moves.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterable
from typing import Any

from rclpy.lifecycle import LifecycleNode
from rclpy.time import Time

from rgbd_kcf_tracker.errors import ParameterError, RgbdKcfError
from rgbd_kcf_tracker.live.places import Places, PoseWatch, Standstill
from rgbd_kcf_tracker.live.settings import NodeParameters
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.recordings.messages import header_stamp, stamp_of
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages
from rgbd_kcf_tracker.recordings.whereabouts import Whereabouts

ASK_AGAIN_S = 0.002
"""Between two looks at the buffer while a transform is waited for, which is mostly soon there."""
WARN_AGAIN_S = 5.0
CARRIED_SHIFT, CARRIED_TURN = 0.002, 0.005
"""Metres and radians within which a camera stands still in a frame that moves with it."""
MOVED = 0.02
"""Metres or radians by which it must have moved in the fixed frame for that to be told."""


def tf2(parameter: str) -> Any:
    """The module tf2_ros.

    Args:
        parameter: that needs it, for the error.

    Raises:
        ParameterError: where it is not installed.
    """
    try:
        return importlib.import_module('tf2_ros')
    except ImportError as error:
        raise ParameterError(
            f'parameter {parameter} needs tf2_ros ({error}): install it (apt install '
            'ros-jazzy-tf2-ros-py), or leave the parameter at its default'
        ) from None


class Unplaced(RgbdKcfError):
    """There is no transform that fits.

    Args:
        kind: of the fault, a counter's name.
        text: in words.
    """

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


class Transforms:
    """Asks TF where the camera is.

    Args:
        node: that listens to /tf and /tf_static.
        settings: the frames.
        fault: told of what is wrong, by kind and in words.

    Raises:
        ParameterError: where tf2_ros is not installed.
    """

    def __init__(
        self, node: LifecycleNode, settings: NodeParameters, fault: Callable[[str, str], None]
    ) -> None:
        self._tf2 = tf2('target_frame' if settings.target_frame else 'fixed_frame')
        self._target, self._fixed = settings.target_frame, settings.fixed_frame
        self._wait_s, self._fault = settings.tf_wait, fault
        self._buffer = self._tf2.Buffer()
        self._listener = self._tf2.TransformListener(self._buffer, node, spin_thread=False)
        self._watches: dict[str, PoseWatch] = {}
        self._standstill = Standstill()
        self._travelled: tuple[Pose, Pose] | None = None
        self._carried = False

    def at(self, header: Any) -> Places:
        """See :class:`~rgbd_kcf_tracker.live.places.CameraPlaces`."""
        end = time.monotonic() + self._wait_s
        fixed = self._pose(self._fixed, header, end) if self._fixed else None
        if self._target in ('', header.frame_id):
            return Places(fixed)
        if self._target == self._fixed:
            return Places(fixed, fixed)
        return Places(fixed, self._pose(self._target, header, end))

    def judged(self, places: Places, seems: Pose | None) -> Places:
        """See :class:`~rgbd_kcf_tracker.live.places.CameraPlaces`."""
        if not self._fixed:
            return places
        self._learn_carried(places)
        if not self._standstill.update(places.fixed, seems):
            return places
        self._fault(
            'tf_stands_still',
            f'the camera moves in the picture, but stands still in {self._fixed!r}: is odometry '
            'running? Outputs in fixed frames pause',
        )
        return Places(None, places.target if self._carried else None)

    def _learn_carried(self, places: Places) -> None:
        """Notice that the target frame goes where the camera goes, as a base does."""
        if places.fixed is None or places.target is None or self._target == self._fixed:
            return
        if self._travelled is None:
            self._travelled = (places.fixed, places.target)
            return
        fixed, target = self._travelled
        moved = fixed.after(places.fixed.inverse)
        if max(moved.shift, moved.turn) < MOVED:
            return
        beside = target.after(places.target.inverse)
        self._carried = beside.shift < CARRIED_SHIFT and beside.turn < CARRIED_TURN
        self._travelled = (places.fixed, places.target)

    def forget(self) -> None:
        """See :class:`~rgbd_kcf_tracker.live.places.CameraPlaces`."""
        self._buffer.clear()
        self._watches.clear()
        self._standstill = Standstill()

    def destroy(self) -> None:
        """Listen no more."""
        self._listener.unregister()

    def _pose(self, frame: str, header: Any, end: float) -> Pose | None:
        try:
            pose = self._looked_up(frame, header, end)
            jump = self._watches.setdefault(frame, PoseWatch()).jump(pose, header_stamp(header))
            if jump:
                raise Unplaced('tf_jumps', f'{header.frame_id!r} {jump} in {frame!r}')
        except Unplaced as unplaced:
            self._fault(unplaced.kind, f'{unplaced}; outputs in {frame!r} pause')
            return None
        return pose

    def _looked_up(self, frame: str, header: Any, end: float) -> Pose:
        if not header.frame_id:
            raise Unplaced('tf_missing', 'images have no frame_id, so TF cannot place them')
        try:
            stamp = Time.from_msg(header.stamp)
        except (ValueError, OverflowError) as error:
            raise Unplaced('tf_missing', f'TF cannot place images of this stamp: {error}') from None
        if stamp.nanoseconds == 0:  # to TF that is the newest
            raise Unplaced('tf_missing', 'images have no stamp, so TF cannot place them')
        while True:
            try:
                return self._asked(frame, header.frame_id, stamp)
            except self._tf2.ExtrapolationException as error:
                self._late(frame, header, end, error)
            except self._tf2.TransformException as error:
                raise Unplaced('tf_missing', f'TF cannot place images: {_words(error)}') from None
            time.sleep(ASK_AGAIN_S)

    def _late(self, frame: str, header: Any, end: float, error: Exception) -> None:
        """Whether it is worth waiting; raises where it is not."""
        try:
            newest = self._buffer.lookup_transform_core(frame, header.frame_id, Time())
        except self._tf2.TransformException:
            raise Unplaced('tf_missing', f'TF cannot place images: {_words(error)}') from None
        behind_s = (header_stamp(header) - stamp_of(newest)) * 1e-9
        if behind_s < 0:
            raise Unplaced('tf_old', f'images are older than what TF remembers: {_words(error)}')
        if behind_s <= self._wait_s and time.monotonic() < end:
            return
        raise Unplaced(
            'tf_late',
            f'TF of {header.frame_id!r} is {behind_s:.2f} s behind the images, which is more than '
            'tf_wait',
        )

    def _asked(self, frame: str, camera: str, stamp: Time) -> Pose:
        found = self._buffer.lookup_transform_core(frame, camera, stamp).transform
        turn, shift = found.rotation, found.translation
        try:
            return Pose.from_quaternion(
                (turn.x, turn.y, turn.z, turn.w), (shift.x, shift.y, shift.z)
            )
        except ParameterError as error:
            raise Unplaced('tf_missing', f'TF has no usable transform: {error}') from None


class TargetFrames:
    """Publishes targets as TF frames.

    Args:
        node: that publishes on /tf.
        settings: the frames' name, and of whom there are any.

    Raises:
        ParameterError: where tf2_ros is not installed.
    """

    def __init__(self, node: LifecycleNode, settings: NodeParameters) -> None:
        self._node, self._name = node, settings.tf_name
        self._broadcaster = tf2('publish_tf').TransformBroadcaster(node)

    def send(
        self,
        make: TrackMessages,
        header: Any,
        wheres: Iterable[Whereabouts],
        chosen: int,
        camera: str,
    ) -> None:
        """Send a frame for each target: its name for the chosen one, name_id for the others.

        None that is called as the camera's own: it would tear that one out of its place.
        """
        sent = []
        for where in wheres:
            name = self._name if where.track.id == chosen else f'{self._name}_{where.track.id}'
            if name != camera:
                sent.append(make.transform(header, name, where))
                continue
            self._node.get_logger().warning(
                f'no TF frame for the target: {name!r} is the frame of the images; give another '
                'tf_name',
                throttle_duration_sec=WARN_AGAIN_S,
            )
        if sent:
            self._broadcaster.sendTransform(sent)

    def destroy(self) -> None:
        """Send no more; tf2_ros has no way of its own to end a broadcaster."""
        publisher = getattr(self._broadcaster, 'pub_tf', None)
        if publisher is not None:
            self._node.destroy_lifecycle_publisher(publisher)


def _words(error: Exception) -> str:
    return ' '.join(str(error).split()) or type(error).__name__
