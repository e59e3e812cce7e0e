# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The camera of each frame of a bag, by the newest CameraInfo that was recorded before it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable

from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.recordings.camera_info import Camera, camera_from_info
from rgbd_kcf_tracker.recordings.rawbag import RawBag
from rgbd_kcf_tracker.recordings.storage import Topic

LOOKED_AT = 100
"""CameraInfos, some seconds of them, among which the first that holds a camera is looked for: a
driver may send zeros before it has read its calibration, and one without any sends nothing else."""
_STAMPED = 12
"""Bytes of a message up to the end of its stamp, which alone differs from one to the next."""


class BagCameras:
    """Reads the CameraInfos of a topic as they are needed.

    Args:
        bag: read from.
        topic: of the CameraInfos.
        pictures: name of the topic whose camera it is.
        rectified: see :func:`~rgbd_kcf_tracker.recordings.camera_info.camera_from_info`.
        warn: told in words what is odd.

    Attributes:
        first: the camera of the first frames; None where no CameraInfo up to :data:`LOOKED_AT`
            holds one.
    """

    def __init__(
        self, bag: RawBag, topic: Topic, pictures: str, rectified: str, warn: Callable[[str], None]
    ) -> None:
        self._bag, self._topic = bag, topic
        self._pictures, self._rectified, self._warn = pictures, rectified, warn
        self._last: tuple[bytes, Camera | None] = b'', None
        self._newest_up_to: tuple[int, Camera | None] = -1, None
        self._changed = False
        self._fault = ''
        self.first: Camera | None = None
        number = 0
        while self.first is None and number < min(len(topic), LOOKED_AT):
            self.first = self._camera(number)
            number += 1
        if self._fault:
            taken = '' if self.first is None else f': that of message {number - 1} is taken'
            warn(f'{topic.name}{self._fault}{taken}')

    def of(self, log_ns: int, size: tuple[int, int], number: int) -> Intrinsics | None:
        """The camera of a picture: the newest that a CameraInfo held, or else the first.

        Args:
            log_ns: when the picture was recorded.
            size: its width and height.
            number: of the frame, for what is told.

        Returns:
            None where it is not known, or is one for pictures of another size.
        """
        index = bisect_right(self._topic.log_ns, log_ns) - 1
        camera = self._newest(index) or self.first
        if camera is None:
            return None
        first = self.first or camera
        if camera.intrinsics != first.intrinsics and not self._changed:
            self._changed = True
            was, now = first.intrinsics, camera.intrinsics
            self._warn(
                f'{self._topic.name}: the camera changes, at frame {number} from fx={was.fx:g} '
                f'fy={was.fy:g} to fx={now.fx:g} fy={now.fy:g}: each frame has its own'
            )
        return self._fitting(camera, size)

    def first_for(self, size: tuple[int, int] | None) -> Intrinsics | None:
        """That of the first frames, if it is for pictures of that size; None where any will do."""
        if self.first is None or size is None:
            return None if self.first is None else self.first.intrinsics
        return self._fitting(self.first, size)

    def _fitting(self, camera: Camera, size: tuple[int, int]) -> Intrinsics | None:
        misfit = camera.misfit(*size)
        if misfit:
            self._warn(f'{self._topic.name} {misfit}: left out')
            return None
        return camera.intrinsics

    def _newest(self, index: int) -> Camera | None:
        """What the newest messages up to one hold, zeros passed over."""
        known, camera = self._newest_up_to
        for number in range(index, max(index - LOOKED_AT, -1), -1):
            found = camera if number == known else self._camera(number)
            if found is not None or number == known:
                self._newest_up_to = index, found
                return found
        return None

    def _camera(self, index: int) -> Camera | None:
        """What a message holds, None where that is no camera."""
        try:
            data = self._bag.read(self._topic, index)
            said, camera = self._last
            if data[_STAMPED:] == said:
                return camera
            self._last = data[_STAMPED:], None
            message = self._bag.deserialize(self._topic, data, index)
            camera = camera_from_info(message, self._pictures, self._rectified)
        except RgbdKcfError as error:
            self._fault = self._fault or f': {error}'
            return None
        if camera is None:
            self._fault = self._fault or ' holds zeros: the camera is not calibrated'
        self._last = data[_STAMPED:], camera
        return camera
