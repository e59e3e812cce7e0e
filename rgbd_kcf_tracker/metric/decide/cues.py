# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Further cues of whoever has some, beside how people look."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box


class Cue(Protocol):
    """Says of all candidates of a frame at once how much they are like a target, a number each."""

    @property
    def name(self) -> str:
        """Under which its share in the verdict is shown."""
        ...

    @property
    def weight(self) -> float:
        """Of its numbers in the log-odds that a candidate is the target.

        ``python -m rgbd_kcf_tracker.evaluation.evidence_fit --cue`` fits it with all others.
        """
        ...

    def start(self, frame: Frame, box: Box, target: int) -> None:
        """A target was chosen: ``box`` of ``frame``. Its number is never given again."""
        ...

    def weigh(self, frame: Frame, boxes: Sequence[Box], target: int) -> npt.ArrayLike:
        """How alike each of ``n`` boxes of a frame is to a target, ``(n,)``; 0 says nothing."""
        ...

    def learn(self, frame: Frame, box: Box, target: int) -> None:
        """The target was surely found in a box of a frame."""
        ...


def weighed(cue: Cue, frame: Frame, boxes: Sequence[Box], target: int) -> FloatArray:
    """What a cue says, ``(n,)``.

    Raises:
        ParameterError: where it does not give one finite number for each box.
    """
    values = np.asarray(cue.weigh(frame, boxes, target), np.float64)
    if values.shape != (len(boxes),) or not np.isfinite(values).all():
        raise ParameterError(
            f'the cue {cue.name!r} must give a finite number for each of {len(boxes)} boxes, '
            f'not {values.shape} of {values.dtype}'
        )
    return values
