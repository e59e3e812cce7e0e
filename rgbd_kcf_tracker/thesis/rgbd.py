# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""KCF with depth-aware occlusion status and sliding-window re-detection (thesis chapter 4).

Algorithm 1: the response is looked at first; where it is low, the depth at the target's centre says
whether the target is hidden. While it is hidden there is no box and nothing is learned, and the
window slides over a search space that grows with the time since it was seen. ``docs/thesis.md``
maps the algorithm's steps to the methods below and says what was decided where the thesis is
silent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.features.hog import CELL_SIZE, CHANNELS, HogExtractor
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.parameters import parameter
from rgbd_kcf_tracker.thesis.at_once import batches
from rgbd_kcf_tracker.thesis.depth_aware import DepthAwareTracker, DepthParameters
from rgbd_kcf_tracker.thesis.depth_patch import DepthDifference
from rgbd_kcf_tracker.thesis.kcf import Detection, KcfModel
from rgbd_kcf_tracker.thesis.sliding_window import (
    search_span,
    step_in_cells,
    window_starts,
    windows,
)
from rgbd_kcf_tracker.thesis.window import gray_window

_THESIS = 'thesis Algorithm 1'


@dataclass(frozen=True)
class RgbdParameters(DepthParameters):
    """Parameters of the ``rgbd`` variant."""

    detect_threshold: float = parameter(
        0.5,
        'Response above which the target is detected, and found again after it was hidden.',
        minimum=0.0,
        maximum=1.0,
        source=_THESIS,
    )
    hidden_response: float = parameter(
        0.3,
        'Response below which the target counts as hidden where there is no depth to ask.',
        minimum=0.0,
        maximum=1.0,
        source='thesis figure 4.11',
    )
    search_span: float = parameter(
        1.0,
        'Search space to either side of the target while it is seen, in target widths.',
        minimum=0.0,
        maximum=20.0,
        source='thesis figure 4.8 (grows with the width)',
    )
    search_step: float = parameter(
        0.5,
        'Shift of the sliding window, in target widths.',
        minimum=0.02,
        maximum=2.0,
    )
    search_speed: float = parameter(
        3.0,
        'How fast the search space grows to either side while the target is hidden, in target '
        'widths per second.',
        unit='1/s',
        minimum=0.0,
        maximum=100.0,
    )


class RgbdTracker(DepthAwareTracker):
    """Algorithm 1 of the thesis."""

    def __init__(self, parameters: RgbdParameters) -> None:
        super().__init__(parameters, parameters.hidden_response, parameters.detect_threshold)
        self._parameters = parameters

    def _begin(self, frame: Frame) -> None:
        self._strips: dict[tuple[int, int], HogExtractor] = {}

    def _follow(self, frame: Frame, model: KcfModel, interval: float) -> Detection | None:
        """Steps 5 to 17 of Algorithm 1; :meth:`_see` is steps 3 and 4 for the next frame."""
        best, here = self._search(frame, model)
        self.response = best.response
        if not self._plausible(frame, best):
            best = here
        if best.response > self._parameters.detect_threshold and (
            not self._hidden or self._plausible(frame, best)
        ):
            return self._detected(frame, model, best, interval)
        reach = 0.0 if self._hidden else interval
        for found, least in ((best, (self._low + self._high) / 2), (here, self._low)):
            if self._hidden and found.response < least:
                continue
            difference = self._diff_at_centre(frame, self._box_at(found), reach)
            if not self._occlusion_status(difference, found.response):
                return self._partly_visible(frame, model, found, difference, interval)
        self._hide()
        return None

    def _search(self, frame: Frame, model: KcfModel) -> tuple[Detection, Detection]:
        """Steps 5 to 9: slide the window, respond to all patches at once, keep the best.

        Returns:
            The best of all patches, and that of the patch at the last position.
        """
        p = self._parameters
        cell = model.geometry.cell[0]
        span = search_span(
            self._box.width, p.search_span, self._hidden_s(), p.search_speed, frame.width
        )
        offsets = window_starts(
            round(span / cell), step_in_cells(p.search_step * self._box.width, cell)
        )
        cx = self._box.cx + offsets * cell
        inside = ((cx >= 0) & (cx <= frame.width)) | (offsets == 0)
        strip = self._strip(frame, model, offsets)
        offsets, cx = offsets[inside], cx[inside]
        middle = int(np.flatnonzero(offsets == 0)[0])
        index, highest = -1, -np.inf
        for part in batches(len(offsets), CHANNELS * model.taper.size):
            stack = windows(strip, model.taper, offsets[part])
            # The first template beside the model: nothing learned by mistake has touched it.
            responses = np.maximum(model.filter.respond(stack), model.first.respond(stack))
            tops = responses.max(axis=(1, 2))
            first = int(np.argmax(tops))
            if index < 0 or tops[first] > highest:
                index, highest, response = part.start + first, tops[first], responses[first]
            if part.start <= middle < part.stop:
                here = responses[middle - part.start]
        best = model.place(response, float(cx[index]), self._box.cy)
        return best, model.place(here, self._box.cx, self._box.cy)

    def _strip(
        self, frame: Frame, model: KcfModel, offsets: npt.NDArray[np.int64]
    ) -> npt.NDArray[np.float32]:
        """Features of the whole search space, the middle window in its middle."""
        extra = int(offsets[-1] - offsets[0])
        geometry = model.geometry
        window = (geometry.window[0] + extra * CELL_SIZE, geometry.window[1])
        source = (
            geometry.source[0] + round(extra * geometry.cell[0]),
            geometry.source[1],
        )
        if window not in self._strips:
            # Sizes change while the search space grows; two are in use while it does not.
            if len(self._strips) > 1:
                self._strips.clear()
            self._strips[window] = HogExtractor(window[1], window[0])
        gray = gray_window(frame.color, self._box.cx, self._box.cy, source, window)
        return self._strips[window](gray)

    def _detected(
        self, frame: Frame, model: KcfModel, best: Detection, interval: float
    ) -> Detection:
        """Steps 11 to 13: a response above the threshold is the target, whatever the depth."""
        difference = self._diff_at_centre(frame, self._box_at(best), interval)
        self._see(frame, model, best, difference, interval)
        return best

    def _partly_visible(
        self,
        frame: Frame,
        model: KcfModel,
        found: Detection,
        difference: DepthDifference | None,
        interval: float,
    ) -> Detection:
        """Step 16: the depth is still the target's, so go on at the updated position."""
        self._see(frame, model, found, difference, interval)
        return found
