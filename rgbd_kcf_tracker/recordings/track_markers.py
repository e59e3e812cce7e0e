# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Targets as markers for RViz and Foxglove: box, name, trail, velocity, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.pose import Pose
from rgbd_kcf_tracker.recordings.overlay import id_color
from rgbd_kcf_tracker.recordings.track_messages import MARKER_LIFETIME_NS, TrackMessages
from rgbd_kcf_tracker.recordings.whereabouts import Whereabouts

ELLIPSOID = math.sqrt(7.814728)
"""Standard deviations of the ellipsoid that holds 95 % (chi-square of three dimensions)."""
ARROW = (0.04, 0.1, 0.12)
"""Metres of an arrow's shaft and head across, and of its head's length."""
LINE, LETTERS = 0.03, 0.2
"""Metres of a trail's width and of a name's height."""
ABOVE = 0.25
"""Metres of a name above the top of the box."""
SLOWEST = 0.1
"""Metres per second below which no arrow is drawn."""


class TrackMarkers:
    """Makes the ``visualization_msgs/MarkerArray`` of one frame after the other.

    What was there in the last frame and is no more is taken away, and all goes by itself when no
    array comes for half a second.

    Args:
        make: makes the messages.
    """

    def __init__(self, make: TrackMessages) -> None:
        self._make = make
        self._shown: set[tuple[str, int]] = set()

    def array(self, header: Any, wheres: Iterable[Whereabouts]) -> Any:
        """The markers of all targets.

        Each is in one of the namespaces ``box``, ``name``, ``trail``, ``velocity`` and
        ``covariance``, with the target's id as its own.
        """
        markers = [marker for where in wheres for marker in self._of(header, where)]
        shown = {(marker.ns, marker.id) for marker in markers}
        for namespace, number in sorted(self._shown - shown):
            gone = self._new(header, namespace, number)
            gone.action = gone.DELETE
            markers.append(gone)
        self._shown = shown
        return self._make.types.make('visualization_msgs/msg/MarkerArray', markers=markers)

    def _of(self, header: Any, where: Whereabouts) -> Iterator[Any]:
        make, number = self._make, where.track.id
        still = Pose(np.eye(3), np.zeros(3))
        half = 0.0
        if where.size is not None:
            half = float(where.size[1]) / 2
            box = self._new(header, 'box', number, 0.45)
            box.type = box.CUBE
            box.pose = make.pose_of(Pose(where.camera.rotation, where.position))
            box.scale = make.vector(where.size)
            yield box
        name = self._new(header, 'name', number, 1.0)
        name.type = name.TEXT_VIEW_FACING
        name.pose = make.pose_of(Pose(still.rotation, where.position + (half + ABOVE) * where.up))
        name.scale.z = LETTERS
        name.text = f'{number} {where.track.state.value}'
        yield name
        if len(where.trail) > 1:
            trail = self._new(header, 'trail', number, 0.8)
            trail.type = trail.LINE_STRIP
            trail.scale.x = LINE
            trail.points = [make.point(point) for point in where.trail]
            yield trail
        if where.velocity is not None and float(np.linalg.norm(where.velocity)) > SLOWEST:
            arrow = self._new(header, 'velocity', number, 1.0)
            arrow.type = arrow.ARROW
            arrow.points = [
                make.point(p) for p in (where.position, where.position + where.velocity)
            ]
            arrow.scale = make.vector(np.array(ARROW))
            yield arrow
        if where.covariance is not None:
            yield self._ellipsoid(header, where, where.covariance)

    def _ellipsoid(self, header: Any, where: Whereabouts, covariance: FloatArray) -> Any:
        variances, axes = np.linalg.eigh(covariance)
        if np.linalg.det(axes) < 0:
            axes[:, 0] = -axes[:, 0]
        sphere = self._new(header, 'covariance', where.track.id, 0.25)
        sphere.type = sphere.SPHERE
        sphere.pose = self._make.pose_of(Pose(axes, where.position))
        radii = ELLIPSOID * np.sqrt(np.maximum(variances, 1e-6))
        sphere.scale = self._make.vector(2 * radii)
        return sphere

    def _new(self, header: Any, namespace: str, number: int, alpha: float = 0.0) -> Any:
        make = self._make.types.make
        blue, green, red = (channel / 255 for channel in id_color(number))
        marker = make(
            'visualization_msgs/msg/Marker',
            header=header,
            ns=namespace,
            id=number,
            color=make('std_msgs/msg/ColorRGBA', r=red, g=green, b=blue, a=alpha),
            lifetime=make('builtin_interfaces/msg/Duration', nanosec=MARKER_LIFETIME_NS),
        )
        marker.pose.orientation.w = 1.0
        return marker
