# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How a network describes people, for whoever has one: vectors that are near for one person."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray, Floats, Image
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.perceive.depth_view import part_in

WIDTH, HEIGHT = 128, 256
"""Pixels of a picture as networks for people take it (Zhou et al., "Omni-Scale Feature Learning for
Person Re-Identification", 2019, and most since)."""
MEAN = np.array((0.485, 0.456, 0.406), np.float32)
DEVIATION = np.array((0.229, 0.224, 0.225), np.float32)
"""Of red, green and blue from 0 to 1 in ImageNet, which such networks are trained on first."""
FRESH = 0.5
"""Seconds for which who stands alone is not described again: he is followed, and hardly turns."""
ALONE = 1.0
"""Metres to the next from which somebody stands alone: closer, one may be taken for the other."""


class Embedding(Protocol):
    """Describes people as vectors, which point much the same way for one person."""

    @property
    def even(self) -> float:
        """Cosine of two vectors at which they are as often of one person as of two."""
        ...

    @property
    def steepness(self) -> float:
        """Log-odds of being one person for each unit of the cosine."""
        ...

    def describe(self, frame: Frame, boxes: Sequence[Box]) -> npt.ArrayLike:
        """What ``n`` boxes of a frame show, ``(n, d)``, of any length but 0."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Described:
    """How one person looked.

    Attributes:
        vector: ``(d,)`` float32 of length 1.
        even, steepness: see :class:`Embedding`.
    """

    vector: Floats
    even: float
    steepness: float


class Onnx:
    """A network from a file, run by OpenCV on pictures of 128 by 256 pixels.

    Args:
        path: an ONNX file whose input is ``(1, 3, 256, 128)``, red first, with ImageNet's mean and
            deviation taken out, and whose output is ``(1, d)``.
        even, steepness: see :class:`Embedding`.

    Raises:
        ParameterError: where there is no such file, or OpenCV cannot run it on such pictures.
    """

    def __init__(self, path: str, even: float, steepness: float) -> None:
        self.even, self.steepness = even, steepness
        if not os.path.isfile(path):
            raise ParameterError(f'parameter embedding: there is no file {path!r}')
        try:
            self._net = cv2.dnn.readNetFromONNX(path)
            self._run(np.zeros((HEIGHT, WIDTH, 3), np.uint8))
        except (cv2.error, ValueError) as error:
            said = getattr(error, 'err', str(error))
            raise ParameterError(
                f'parameter embedding: OpenCV {cv2.__version__} cannot run {path!r} on pictures of '
                f'(1, 3, {HEIGHT}, {WIDTH}): {said}'
            ) from None

    def describe(self, frame: Frame, boxes: Sequence[Box]) -> npt.ArrayLike:
        """See :class:`Embedding`."""
        return np.stack([self._run(frame.color[part_in(frame.color.shape, b)]) for b in boxes])

    def _run(self, picture: Image) -> Floats:
        small = min(picture.shape[:2]) < WIDTH
        how = cv2.INTER_LINEAR if small else cv2.INTER_AREA
        resized = cv2.resize(picture, (WIDTH, HEIGHT), interpolation=how)
        blob = (resized[..., ::-1] / np.float32(255) - MEAN) / DEVIATION
        self._net.setInput(np.ascontiguousarray(blob.transpose(2, 0, 1)[None], np.float32))
        return np.asarray(self._net.forward(), np.float32).ravel()


class Describer:
    """Has everybody described who may be mistaken, and who stands alone now and then.

    Args:
        embedding: the network.

    Attributes:
        frame: the one that it is asked about.
    """

    def __init__(self, embedding: Embedding) -> None:
        self.frame: Frame | None = None
        self._embedding = embedding
        self._places: FloatArray = np.zeros((0, 2))
        self._known: list[tuple[float, Described]] = []

    def describe(self, boxes: Sequence[Box]) -> list[Described]:
        """What each of some boxes of the frame shows.

        Raises:
            ParameterError: where the network gives no vector for each.
        """
        assert self.frame is not None
        found = np.asarray(self._embedding.describe(self.frame, boxes), np.float32)
        length = np.linalg.norm(found, axis=1, keepdims=True) if found.ndim == 2 else np.zeros(1)
        if len(found) != len(boxes) or not (np.isfinite(length).all() and (length > 0).all()):
            raise ParameterError(
                f'an embedding must give a finite vector, not 0, for each of {len(boxes)} boxes: '
                f'({len(boxes)}, d) numbers, not {found.shape}'
            )
        even, steepness = self._embedding.even, self._embedding.steepness
        return [Described(vector, even, steepness) for vector in found / length]

    def describe_all(
        self, boxes: Sequence[Box], places: FloatArray, time: float
    ) -> list[Described]:
        """Those in view; who stands alone as a moment ago is not looked at again.

        Args:
            boxes: about ``n`` of them.
            places: ``(n, 2)`` metres, where they are.
            time: seconds.

        Raises:
            ParameterError: see :meth:`describe`.
        """
        known = [self._still(place, places, time) for place in places]
        asked = [n for n, each in enumerate(known) if each is None]
        if asked:
            found = self.describe([boxes[n] for n in asked])
            for n, described in zip(asked, found, strict=True):
                known[n] = time, described
        self._places, self._known = places, [each for each in known if each is not None]
        return [described for _, described in self._known]

    def _still(
        self, place: FloatArray, places: FloatArray, time: float
    ) -> tuple[float, Described] | None:
        """What is known of who is at a place, if that is one of the last frame who stands alone."""
        if np.count_nonzero(_near(place, places)) > 1:  # everybody is near himself
            return None
        (before,) = np.nonzero(_near(place, self._places))
        if len(before) != 1:
            return None
        known = self._known[before[0]]
        return known if time - known[0] < FRESH else None


def _near(place: FloatArray, places: FloatArray) -> npt.NDArray[np.bool_]:
    near: npt.NDArray[np.bool_] = np.hypot(*(places - place).T) < ALONE
    return near
