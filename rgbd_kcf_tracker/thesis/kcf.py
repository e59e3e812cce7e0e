# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The colour-only Kernelized Correlation Filter tracker (thesis chapters 2 and 3).

The tracker of Henriques et al., "High-Speed Tracking with Kernelized Correlation Filters" (PAMI
2015), with its published parameters. Beyond the reference: the box that is reported lies at the
peak between cells, where the reference moves by whole cells; and targets smaller than the reference
could take still have a window. Looking and learning keep to whole cells, as in the reference: with
the sub-cell part fed back, other sequences are lost than the reference loses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.features.hog import CELL_SIZE, HogExtractor
from rgbd_kcf_tracker.features.labels import gaussian_labels
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import Parameters, parameter
from rgbd_kcf_tracker.thesis.correlation import (
    GAUSSIAN,
    KERNELS,
    CorrelationFilter,
    Sample,
    cosine_window,
    peak,
)
from rgbd_kcf_tracker.thesis.window import gray_window
from rgbd_kcf_tracker.track import Track, TrackState, require_inside

_REFERENCE = 'Henriques et al. 2015'

# Fewest cells a window has on a side: below, the cosine window leaves nothing of the target.
_LEAST_CELLS = 5

# Most pixels that a window may have: four times a 640x480 image.
_MOST_PIXELS = 1.2e6


@dataclass(frozen=True)
class KcfParameters(Parameters):
    """Parameters of the ``kcf`` variant; the defaults are the published ones for fHOG."""

    padding: float = parameter(
        1.5,
        'Search window beyond the target, as a share of its width and height.',
        minimum=0.1,
        maximum=10.0,
        source=_REFERENCE,
    )
    regularization: float = parameter(
        1e-4,
        'Lambda of the ridge regression.',
        minimum=1e-8,
        maximum=10.0,
        source=_REFERENCE,
    )
    label_sigma: float = parameter(
        0.1,
        "Bandwidth of the Gaussian labels, as a share of the target's mean side.",
        minimum=0.001,
        maximum=1.0,
        source=_REFERENCE,
    )
    kernel: str = parameter(
        GAUSSIAN, 'Kernel of the regression.', choices=KERNELS, source=_REFERENCE
    )
    kernel_sigma: float = parameter(
        0.5,
        'Bandwidth of the Gaussian kernel.',
        minimum=0.01,
        maximum=10.0,
        source=_REFERENCE,
    )
    learning_rate: float = parameter(
        0.02,
        'Share of the newest frame in the model.',
        minimum=0.0,
        maximum=1.0,
        source=_REFERENCE,
    )
    halve_above: float = parameter(
        100.0,
        'Targets whose mean side, sqrt(width * height), reaches this are seen at half resolution.',
        unit='px',
        minimum=8.0,
        maximum=10000.0,
        source=_REFERENCE,
    )
    max_halvings: int = parameter(
        2,
        'How often a large target may be halved. The reference halves once; what is larger than '
        'twice halve_above, as people near a camera of 1920x1080, then costs more with its size.',
        minimum=0,
        maximum=6,
    )


@dataclass(frozen=True, slots=True)
class WindowGeometry:
    """Sizes that follow from the target's, fixed at the start.

    Attributes:
        source: width and height of the window in image pixels.
        window: width and height of the window that features are taken of.
        cells: rows and columns of the features.
        label_sigma: bandwidth of the labels in cells.
    """

    source: tuple[int, int]
    window: tuple[int, int]
    cells: tuple[int, int]
    label_sigma: float

    @property
    def cell(self) -> tuple[float, float]:
        """Width and height of a cell in image pixels."""
        return (
            CELL_SIZE * self.source[0] / self.window[0],
            CELL_SIZE * self.source[1] / self.window[1],
        )

    @classmethod
    def of(cls, width: float, height: float, parameters: KcfParameters) -> WindowGeometry:
        """The window of a target of ``width`` x ``height`` image pixels."""
        reduction = 1
        for _ in range(parameters.max_halvings):
            if math.sqrt(width * height) / reduction < parameters.halve_above:
                break
            reduction *= 2
        pixels = math.prod(max(side * (1 + parameters.padding), 1.0) for side in (width, height))
        while pixels > _MOST_PIXELS * reduction**2:
            reduction *= 2
        # Whole pixels, rounded down, as in the reference.
        inner = [max(math.floor(side / reduction), 1) for side in (width, height)]
        least = _LEAST_CELLS * CELL_SIZE
        window = [max(math.floor(side * (1 + parameters.padding)), least) for side in inner]
        return cls(
            source=(window[0] * reduction, window[1] * reduction),
            window=(window[0], window[1]),
            cells=(window[1] // CELL_SIZE, window[0] // CELL_SIZE),
            label_sigma=math.sqrt(inner[0] * inner[1]) * parameters.label_sigma / CELL_SIZE,
        )


class Detection(NamedTuple):
    """Where a filter finds its target, in image pixels.

    Attributes:
        cx, cy: centre of the highest cell: where to look and to learn next.
        fine_cx, fine_cy: the centre between cells: what to report.
        response: at the highest cell.
    """

    cx: float
    cy: float
    fine_cx: float
    fine_cy: float
    response: float


class KcfModel:
    """What ``kcf`` knows of a target: its window and the filter trained on it.

    The other thesis trackers are built on it too. Positions are centres in image pixels.

    Attributes:
        geometry: sizes of the window.
        filter: learns with every :meth:`train`.
        first: what the filter was after the first frame, for comparison with the first template.
        taper: cosine window over the features.
    """

    def __init__(self, width: float, height: float, parameters: KcfParameters) -> None:
        self.geometry = WindowGeometry.of(width, height, parameters)
        self.filter = CorrelationFilter(
            gaussian_labels(self.geometry.cells, self.geometry.label_sigma),
            regularization=parameters.regularization,
            kernel=parameters.kernel,
            kernel_sigma=parameters.kernel_sigma,
        )
        self._rate = parameters.learning_rate
        self.first = self.filter
        self.taper = cosine_window(self.geometry.cells)
        self._hog = HogExtractor(self.geometry.window[1], self.geometry.window[0])

    def sample(self, frame: Frame, cx: float, cy: float) -> Sample:
        """Windowed features about a centre, ready for the filter (thesis section 2.3.3)."""
        gray = gray_window(frame.color, cx, cy, self.geometry.source, self.geometry.window)
        features = self._hog(gray)
        features *= self.taper
        return Sample.of(features)

    def train(self, frame: Frame, cx: float, cy: float, trust: float = 1.0) -> None:
        """Learn the target at a centre; the first time whole, then by interpolation.

        Args:
            frame: where the target is seen.
            cx: column of its centre.
            cy: row of its centre.
            trust: share of the learning rate, 0 to 1.
        """
        fresh = not self.filter.trained
        self.filter.learn(self.sample(frame, cx, cy), self._rate * trust)
        if fresh:
            self.first = self.filter.copy()

    def detect(self, frame: Frame, cx: float, cy: float) -> Detection:
        """Look about a centre (thesis section 2.3.4)."""
        return self.place(self.filter.respond(self.sample(frame, cx, cy)), cx, cy)

    def place(self, response: npt.NDArray[np.float64], cx: float, cy: float) -> Detection:
        """Where in the image the peak of a response lies.

        Args:
            response: ``(rows, cols)`` of the window's cells; element 0, 0 is no shift.
            cx: column of the window's middle in pixels of the image.
            cy: row of it.
        """
        found = peak(response)
        across, down = self.geometry.cell
        return Detection(
            cx=cx + found.col * across,
            cy=cy + found.row * down,
            fine_cx=cx + found.fine_col * across,
            fine_cy=cy + found.fine_row * down,
            response=found.value,
        )

    def rescale(self, across: float, down: float) -> None:
        """See the same scene in an image whose sides are that many times as long."""
        width, height = self.geometry.source
        source = (max(round(width * across), 1), max(round(height * down), 1))
        self.geometry = replace(self.geometry, source=source)


class KcfTracker:
    """Follows a target of fixed size by its look alone; it never says that the target is absent.

    Attributes:
        response: the filter's highest in the last frame.
    """

    def __init__(self, parameters: KcfParameters) -> None:
        self._parameters = parameters
        self.response: float | None = None
        self._model: KcfModel | None = None
        self._box = Box(0, 0, 1, 1)
        self._image_size = (0, 0)

    def start(self, frame: Frame, box: Box) -> Track:
        """Take the target in ``box``; see :class:`~rgbd_kcf_tracker.track.Tracker`.

        Raises:
            BoxError: where the box lies wholly outside the image.
        """
        require_inside(box, frame)
        self._box, self.response = box, None
        self._image_size = (frame.width, frame.height)
        self._model = KcfModel(box.width, box.height, self._parameters)
        self._model.train(frame, box.cx, box.cy)
        return Track(box, TrackState.TRACKING, 1.0)

    def update(self, frame: Frame) -> Track:
        """Follow the target into ``frame``."""
        if self._model is None:
            return Track(None, TrackState.IDLE)
        if (frame.width, frame.height) != self._image_size:
            self._rescale(frame)
        box = self._box
        found = self._model.detect(frame, box.cx, box.cy)
        self.response = found.response
        self._box = Box.from_center(found.cx, found.cy, box.width, box.height)
        self._model.train(frame, found.cx, found.cy)
        reported = Box.from_center(found.fine_cx, found.fine_cy, box.width, box.height)
        return Track(reported, TrackState.TRACKING, min(max(found.response, 0.0), 1.0))

    def _rescale(self, frame: Frame) -> None:
        """Carry the target over to a stream whose image size has changed."""
        across = frame.width / self._image_size[0]
        down = frame.height / self._image_size[1]
        self._box = self._box.stretched(across, down)
        self._image_size = (frame.width, frame.height)
        if self._model is not None:
            self._model.rescale(across, down)
