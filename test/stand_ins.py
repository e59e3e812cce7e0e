# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Plain Python in place of ROS packages that are not on the package index."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

from geometry_msgs.msg import Pose, PoseWithCovariance, Vector3
from std_msgs.msg import Header


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
    box3 = define('BoundingBox3D', center=Pose, size=Vector3)
    hypothesis = define('ObjectHypothesis', class_id=str, score=float)
    define('ObjectHypothesisWithPose', hypothesis=hypothesis, pose=PoseWithCovariance)
    define('Detection2D', header=Header, results=list, bbox=box, id=str)
    define('Detection3D', header=Header, results=list, bbox=box3, id=str)
    define('Detection2DArray', header=Header, detections=list)
    define('Detection3DArray', header=Header, detections=list)
    return module
