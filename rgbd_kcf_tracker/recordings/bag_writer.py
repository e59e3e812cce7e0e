# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Frames, tracks and truth as a bag that RViz, Foxglove and our own nodes read."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Any

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box, Intrinsics
from rgbd_kcf_tracker.recordings.bag_types import BAG_TYPES, register
from rgbd_kcf_tracker.recordings.camera_info import unrectified
from rgbd_kcf_tracker.recordings.encoding import (
    encode_color,
    encode_compressed_color,
    encode_depth,
)
from rgbd_kcf_tracker.recordings.foxglove import DEFINITIONS, image_annotations
from rgbd_kcf_tracker.recordings.mcap_writer import DEFAULT_COMPRESSION, McapWriter
from rgbd_kcf_tracker.recordings.outputs import FrameWriter
from rgbd_kcf_tracker.recordings.overlay import draw_track
from rgbd_kcf_tracker.recordings.track_markers import TrackMarkers
from rgbd_kcf_tracker.recordings.track_messages import TrackMessages
from rgbd_kcf_tracker.recordings.whereabouts import POSE_PREDICTION_S, Walks
from rgbd_kcf_tracker.track import Track

TRUTH_VISIBLE, TRUTH_BODY = '/groundtruth/visible', '/groundtruth/body'


@dataclass(frozen=True, slots=True)
class CameraTopics:
    """Names under which a camera's images are written.

    Attributes:
        color, depth, info: topics of colour image, depth image and CameraInfo.
        frame_id: coordinate frame of the images.
    """

    color: str
    depth: str
    info: str
    frame_id: str

    @classmethod
    def kinect2(cls, resolution: str) -> CameraTopics:
        """kinect2_bridge's names; resolution 'hd', 'qhd' or 'sd'."""
        base = f'/kinect2/{resolution}'
        kind = 'ir' if resolution == 'sd' else 'rgb'
        return cls(
            f'{base}/image_color_rect',
            f'{base}/image_depth_rect',
            f'{base}/camera_info',
            f'kinect2_{kind}_optical_frame',
        )

    def showing(self, intrinsics: Intrinsics | None) -> CameraTopics:
        """The names for images of a camera: one with a lens is not read from ``rect`` ones."""
        if intrinsics is None or intrinsics.lens is None:
            return self
        return replace(self, color=unrectified(self.color), depth=unrectified(self.depth))


KINECT2_HD = CameraTopics.kinect2('hd')
KINECT2_QHD = CameraTopics.kinect2('qhd')
KINECT2_SD = CameraTopics.kinect2('sd')
GENERIC = CameraTopics('/color/image', '/depth/image', '/color/camera_info', 'camera_optical_frame')
"""The tracker node's own names: a bag with these needs no remapping."""


class BagWriter(FrameWriter):
    """Writes mcap: images as a camera sends them, and the tracker's topics beside them.

    Every message's time of recording is its frame's stamp; where stamps go back, it goes on from
    there by their steps, as readers sort by it. When a ``write`` returns, the system has what it
    wrote: an interruption, kill -9 included, leaves a file without index that is read up to there,
    and that ``convert`` mends.

    Args:
        path: the file.
        topics: names of the images.
        tracker: prefix of the tracker's topics.
        depth_encoding: 16UC1 (millimetres) or 32FC1 (metres).
        compression: of the chunks: none, lz4 or zstd.
        annotate: write ``image_annotated/compressed`` with each track, too.
        overwrite: replace a file that is there.

    Attributes:
        output: the file.

    Raises:
        RecordingError: where it cannot be written, or is there already.
        ParameterError: for an unknown compression or depth encoding.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        topics: CameraTopics = KINECT2_QHD,
        *,
        tracker: str = '/tracker',
        depth_encoding: str = '16UC1',
        compression: str = DEFAULT_COMPRESSION,
        annotate: bool = False,
        overwrite: bool = False,
    ) -> None:
        if depth_encoding not in ('16UC1', '32FC1'):
            raise ParameterError(f'depth encoding is {depth_encoding!r}: choose 16UC1 or 32FC1')
        self.topics = topics
        self._tracker = tracker.rstrip('/')
        self._depth_encoding = depth_encoding
        self._annotate = annotate
        self._stamp_ns: int | None = None
        self._log_ns = 0
        register(DEFINITIONS)
        self._make = TrackMessages(BAG_TYPES)
        self._walks = Walks()
        self._markers = TrackMarkers(self._make)
        self._writer = McapWriter(path, compression, overwrite)
        self.output = self._writer.output

    def write_frame(self, frame: Frame) -> None:
        """Write colour, depth where there is, and CameraInfo where intrinsics are known."""
        header = self._header(frame)
        if frame.intrinsics is not None:
            info = self._make.camera_info(header, frame.width, frame.height, frame.intrinsics)
            self._writer.write(self.topics.info, info, self._logged(frame))
        self._write_image(self.topics.color, header, frame, encode_color(frame.color))
        if frame.depth is not None:
            image = encode_depth(frame.depth, self._depth_encoding)
            self._write_image(self.topics.depth, header, frame, image)
        self._writer.flush()

    def write_track(self, frame: Frame, track: Track) -> None:
        """Write what the tracker node publishes of the target; in space as far as that is known."""
        header, stamp, make = self._header(frame), self._logged(frame), self._make
        wheres = self._walks.update([track], frame.stamp_ns, frame.intrinsics, frame.pose)
        where = wheres.get(track.id)
        self._write_tracker('state', make.state(header, [track]), stamp)
        self._write_tracker('box', make.polygon(header, track.box), stamp)
        self._write_tracker('occluded', make.occluded(track), stamp)
        self._write_tracker('roi', make.region(track.box, frame.width, frame.height), stamp)
        self._write_tracker('position', make.position(header, where), stamp)
        self._write_tracker('marker', make.marker(header, where), stamp)
        overlay = image_annotations(BAG_TYPES, header, [track])
        self._write_tracker('annotations', overlay, stamp)
        self._write_tracker('markers', self._markers.array(header, wheres.values()), stamp)
        if where is not None:
            if where.hidden_s <= POSE_PREDICTION_S:
                self._write_tracker('pose', make.pose(header, where), stamp)
            covariance = make.pose_with_covariance(header, where)
            self._write_tracker('pose_with_covariance', covariance, stamp)
            self._write_tracker('twist', make.twist(header, where), stamp)
        if frame.intrinsics is not None:
            info = make.camera_info(header, frame.width, frame.height, frame.intrinsics)
            self._write_tracker('camera_info', info, stamp)
        if self._annotate:
            packed = encode_compressed_color(draw_track(frame.color, track), quality=80)
            image = make.compressed_image(header, packed)
            self._write_tracker('image_annotated/compressed', image, stamp)
        self._writer.flush()

    def write_truth(self, frame: Frame, visible: Box | None, body: Box | None = None) -> None:
        """Write the true box of the visible part, and the whole body's where there is one.

        A message without points says that the target is absent.
        """
        header, stamp = self._header(frame), self._logged(frame)
        self._writer.write(TRUTH_VISIBLE, self._make.polygon(header, visible), stamp)
        self._writer.write(TRUTH_BODY, self._make.polygon(header, body), stamp)
        self._writer.flush()

    def close(self, whole: bool = True) -> None:
        """Write the index and close the file; see :meth:`McapWriter.close`."""
        self._writer.close(whole)

    def _header(self, frame: Frame) -> Any:
        return self._make.header(frame.stamp_ns, self.topics.frame_id)

    def _logged(self, frame: Frame) -> int:
        """Time of recording of what is written of a frame, ns: never before that of another."""
        if self._stamp_ns is None:
            self._log_ns = max(frame.stamp_ns, 0)  # MCAP has none before 1970
        elif frame.stamp_ns != self._stamp_ns:
            self._log_ns += max(frame.stamp_ns - self._stamp_ns, 1)
        self._stamp_ns = frame.stamp_ns
        return self._log_ns

    def _write_tracker(self, name: str, message: Any | None, stamp: int) -> None:
        if message is not None:
            self._writer.write(f'{self._tracker}/{name}', message, stamp)

    def _write_image(self, topic: str, header: Any, frame: Frame, image: Any) -> None:
        message = self._make.image(header, image)
        self._writer.write(topic, message, self._logged(frame))
