# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How a network describes people, for whoever has one: vectors that are near for one person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats, Image
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
        """What ``n`` boxes of a frame show, ``(n, d)``; 0 or no numbers where nothing is said."""
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
        ParameterError: where OpenCV cannot read it, or run it on such pictures.
    """

    def __init__(self, path: str, even: float, steepness: float) -> None:
        self.even, self.steepness = even, steepness
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
