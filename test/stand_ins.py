# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Plain Python in place of ROS packages that are not on the package index."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from types import ModuleType
from typing import Any

import geometry_msgs.msg
import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseWithCovariance, TransformStamped, Vector3
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from rgbd_kcf_tracker.pose import Pose


def message(**defaults: Callable[[], Any]) -> type:
    """A class with these fields alone, each made by its default."""

    def init(self: Any, **values: Any) -> None:
        for name, make in defaults.items():
            setattr(self, name, values.pop(name) if name in values else make())
        assert not values, values

    return type('Message', (), {'__init__': init, '__slots__': tuple(defaults)})


def vision_messages() -> ModuleType:
    """``vision_msgs.msg`` of vision_msgs 4 (Jazzy)."""
    module = ModuleType('vision_msgs.msg')

    def define(name: str, **fields: Callable[[], Any]) -> type:
        made = message(**fields)
        setattr(module, name, made)
        return made

    point = define('Point2D', x=float, y=float)
    pose = define('Pose2D', position=point, theta=float)
    box = define('BoundingBox2D', center=pose, size_x=float, size_y=float)
    box3 = define('BoundingBox3D', center=geometry_msgs.msg.Pose, size=Vector3)
    hypothesis = define('ObjectHypothesis', class_id=str, score=float)
    define('ObjectHypothesisWithPose', hypothesis=hypothesis, pose=PoseWithCovariance)
    define('Detection2D', header=Header, results=list, bbox=box, id=str)
    define('Detection3D', header=Header, results=list, bbox=box3, id=str)
    define('Detection2DArray', header=Header, detections=list)
    define('Detection3DArray', header=Header, detections=list)
    return module


def foxglove_messages() -> ModuleType:
    """``foxglove_msgs.msg``, of a release that has fields which we do not fill."""
    module = ModuleType('foxglove_msgs.msg')

    def define(name: str, **fields: Callable[[], Any]) -> type:
        made = message(**fields)
        setattr(module, name, made)
        return made

    color = define('Color', r=float, g=float, b=float, a=float)
    point = define('Point2', x=float, y=float)
    line = define(
        'PointsAnnotation', timestamp=Time, type=int, points=list, outline_color=color,
        outline_colors=list, fill_color=color, thickness=float, metadata=list,
    )  # fmt: skip
    line.LINE_LOOP = 2  # type: ignore[attr-defined]
    define(
        'TextAnnotation', timestamp=Time, position=point, text=str, font_size=float,
        text_color=color, background_color=color, metadata=list,
    )  # fmt: skip
    define('ImageAnnotations', timestamp=Time, circles=list, points=list, texts=list, metadata=list)
    return module


def tf2_ros() -> ModuleType:
    """As much of tf2_ros as the node uses, over single transforms instead of tf2_msgs."""
    module = ModuleType('tf2_ros')

    class TransformException(Exception):
        pass

    class LookupException(TransformException):
        pass

    class ExtrapolationException(TransformException):
        pass

    class Buffer:
        """Edges of a tree by child; interpolates between the samples of one."""

        def __init__(self) -> None:
            self.parents: dict[str, str] = {}
            self.samples: dict[str, list[tuple[int, Pose]]] = {}
            self.still: set[str] = set()
            self.cleared = 0

        def clear(self) -> None:
            self.cleared += 1
            for child in set(self.samples) - self.still:
                self.samples[child].clear()

        def add(self, transform: TransformStamped, still: bool) -> None:
            child, at = transform.child_frame_id, transform.header.stamp
            turn, shift = transform.transform.rotation, transform.transform.translation
            rotation = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
            pose = Pose(rotation, np.array([shift.x, shift.y, shift.z]))
            self.parents[child] = transform.header.frame_id
            self.samples.setdefault(child, []).append((at.sec * 10**9 + at.nanosec, pose))
            if still:
                self.still.add(child)

        def _chain(self, frame: str) -> list[str]:
            chain = [frame]
            while chain[-1] in self.parents:
                chain.append(self.parents[chain[-1]])
            if len(chain) == 1 and frame not in self.parents.values():
                raise LookupException(f'"{frame}" passed to lookupTransform does not exist. ')
            return chain

        def _edge(self, child: str, stamp: int) -> Pose:
            samples = list(self.samples[child])
            if child in self.still or (stamp == samples[-1][0]):
                return samples[-1][1]
            for (first, start), (second, end) in pairwise(samples):
                if first <= stamp <= second:
                    share = (stamp - first) / max(second - first, 1)
                    between = start.translation * (1 - share) + end.translation * share
                    return Pose((start if share < 0.5 else end).rotation, between)
            side = 'past' if samples and stamp < samples[0][0] else 'future'
            raise ExtrapolationException(f'Lookup would require extrapolation into the {side}. ')

        def lookup_transform_core(self, target: str, source: str, time: Any) -> TransformStamped:
            there, here = self._chain(target), self._chain(source)
            if there[-1] != here[-1]:
                raise LookupException('Tried to connect two trees. ')
            common = next(frame for frame in here if frame in there)
            edges = [f for chain in (here, there) for f in chain[: chain.index(common)]]
            moving = [edge for edge in edges if edge not in self.still]
            stamp = time.nanoseconds
            if stamp == 0 and moving:
                stamp = min(self.samples[edge][-1][0] for edge in moving)

            def up(chain: list[str]) -> Pose:
                pose = Pose(np.eye(3), np.zeros(3))
                for edge in chain[: chain.index(common)]:
                    pose = pose.after(self._edge(edge, stamp))
                return pose

            pose = up(here).after(up(there).inverse)
            answer = TransformStamped()
            answer.header.stamp.sec, answer.header.stamp.nanosec = divmod(stamp, 10**9)
            shift, turn = answer.transform.translation, answer.transform.rotation
            shift.x, shift.y, shift.z = (float(v) for v in pose.translation)
            turn.x, turn.y, turn.z, turn.w = pose.quaternion
            return answer

    class TransformListener:
        def __init__(self, buffer: Buffer, node: Any, *, spin_thread: bool = False) -> None:
            assert not spin_thread
            self._node = node
            self._all = [
                node.create_subscription(
                    TransformStamped, topic, partial(buffer.add, still=still), 100
                )
                for topic, still in (('/tf', False), ('/tf_static', True))
            ]

        def unregister(self) -> None:
            for subscription in self._all:
                self._node.destroy_subscription(subscription)

    class TransformBroadcaster:
        def __init__(self, node: Any) -> None:
            self.pub_tf = node.create_publisher(TransformStamped, '/tf', 100)

        def sendTransform(self, transforms: list[TransformStamped]) -> None:
            for transform in transforms:
                self.pub_tf.publish(transform)

    for made in (
        Buffer, TransformListener, TransformBroadcaster,
        TransformException, LookupException, ExtrapolationException,
    ):  # fmt: skip
        setattr(module, made.__name__, made)
    return module
