# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What the thesis's two RGB-D trackers share: the occlusion status from depth at the centre."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.parameters import parameter
from rgbd_kcf_tracker.thesis.centre_patch import centre_patch
from rgbd_kcf_tracker.thesis.depth_patch import DepthDifference, DepthPatch
from rgbd_kcf_tracker.thesis.kcf import Detection, KcfModel, KcfParameters
from rgbd_kcf_tracker.track import Track, TrackState, require_inside

# Response at which a patch surely shows the target (thesis Algorithm 1, step 10).
_DETECTED = 0.5
# A pause longer than this says nothing about how far the target went: it is taken for this long.
_LONGEST_INTERVAL_S = 1.0


@dataclass(frozen=True)
class DepthParameters(KcfParameters):
    """What ``rgbd`` and ``rgbd_pf`` share beyond the correlation filter."""

    depth_threshold: float = parameter(
        0.15,
        "Difference of the centre depth patches above which the target is hidden (the thesis's "
        'threshold, theta).',
        unit='m',
        minimum=0.01,
        maximum=10.0,
    )
    center_share: float = parameter(
        0.5,
        "Share of the target's width and height that the centre depth patch covers.",
        minimum=0.1,
        maximum=1.0,
    )
    trim_above: float = parameter(
        0.2,
        'Mean difference above which an edge column or row of the depth patch is trimmed away.',
        unit='m',
        minimum=0.01,
        maximum=10.0,
    )
    most_trim: float = parameter(
        0.25,
        'Share of the depth patch that may be trimmed away at each edge.',
        minimum=0.0,
        maximum=0.45,
    )
    depth_cap: float = parameter(
        0.5,
        'Most that one pixel of the depth patch can differ.',
        unit='m',
        minimum=0.01,
        maximum=20.0,
    )
    gone_share: float = parameter(
        0.75,
        'Share of the depth patch farther than the target above which the target is not there.',
        minimum=0.0,
        maximum=1.0,
    )
    depth_change: float = parameter(
        0.35,
        'Share by which the distance of a target found again may differ from the last one.',
        minimum=0.0,
        maximum=10.0,
    )
    walking_speed: float = parameter(
        2.0,
        'Speed at which a target may come nearer or go away without counting as hidden.',
        unit='m/s',
        minimum=0.0,
        maximum=20.0,
    )
    lost_after: float = parameter(
        4.0,
        'Time hidden after which the target counts as lost and is looked for everywhere.',
        unit='s',
        minimum=0.0,
        maximum=3600.0,
    )


class DepthAwareTracker(ABC):
    """A correlation filter that knows from depth when its target is hidden.

    Args:
        parameters: of the depth test and the filter.
        low: response at and below which a target without depth to ask about counts as hidden.
        high: response from which the target is surely seen.

    Attributes:
        response: the filter's highest in the last frame.
    """

    def __init__(self, parameters: DepthParameters, low: float, high: float) -> None:
        self._depth_parameters = parameters
        self._low, self._high = low, max(high, low + 1e-6)
        self._model: KcfModel | None = None
        self.response: float | None = None

    def start(self, frame: Frame, box: Box) -> Track:
        """Take the target in ``box``; see :class:`~rgbd_kcf_tracker.track.Tracker`.

        Raises:
            BoxError: where the box lies wholly outside the image.
        """
        require_inside(box, frame)
        p = self._depth_parameters
        self._box, self.response = box, None
        self._image_size = (frame.width, frame.height)
        self._stamp_ns, self._unseen_ns = frame.stamp_ns, 0
        self._hidden = False
        self._model = KcfModel(box.width, box.height, p)
        self._model.train(frame, box.cx, box.cy)
        self._depth_patch = DepthPatch(p.trim_above, p.most_trim, p.walking_speed, p.depth_cap)
        if frame.depth is not None:
            self._depth_patch.remember(centre_patch(frame.depth, box, p.center_share))
        self._begin(frame)
        return self._track(frame, Detection(box.cx, box.cy, box.cx, box.cy, 1.0))

    def update(self, frame: Frame) -> Track:
        """Follow the target into ``frame``, or look for it while it is hidden."""
        if self._model is None:
            return Track(None, TrackState.IDLE)
        if (frame.width, frame.height) != self._image_size:
            self._rescale(frame, self._model)
        interval = frame.seconds_since(self._stamp_ns, 0.0, _LONGEST_INTERVAL_S)
        # Stamps may go back, as in a loop.
        self._unseen_ns += max(frame.stamp_ns - self._stamp_ns, 0)
        self._stamp_ns = frame.stamp_ns
        found = self._follow(frame, self._model, interval)
        if found is not None:
            return self._track(frame, found)
        lost = self._hidden_s() > self._depth_parameters.lost_after
        return Track(None, TrackState.LOST if lost else TrackState.OCCLUDED)

    @abstractmethod
    def _begin(self, frame: Frame) -> None:
        """What a variant sets up when it is given a target."""

    @abstractmethod
    def _follow(self, frame: Frame, model: KcfModel, interval: float) -> Detection | None:
        """One step of the variant's algorithm: where the target is, None while it is hidden."""

    def _diff_at_centre(self, frame: Frame, box: Box, interval: float) -> DepthDifference | None:
        """The difference of depths at the target's centre; None where there is no depth.

        Args:
            frame: the newest.
            box: the target's in it.
            interval: seconds in which the target may have come nearer by itself.
        """
        if frame.depth is None:
            return None
        patch = centre_patch(frame.depth, box, self._depth_parameters.center_share)
        return self._depth_patch.diff_at_centre(patch, interval)

    def _occlusion_status(self, difference: DepthDifference | None, response: float) -> bool:
        """Whether the target is hidden.

        A target that was seen is hidden when something nearer covers it, or when nothing is there
        any more; background that only entered the patch at a side hides nothing. A target that was
        hidden is seen again when the depth is its own, without difference to either side. Where
        depth says nothing the response is all there is: a target that was seen is hidden when
        the response falls to what the thesis measured of full occlusion (figure 4.11).
        """
        p = self._depth_parameters
        if difference is None:
            return self._hidden or response < self._low
        if self._hidden:
            return difference.value >= p.depth_threshold
        return difference.farther > p.gone_share or difference.nearer >= p.depth_threshold

    def _plausible(self, frame: Frame, found: Detection) -> bool:
        """Whether what responds could be the target found again, by its depth.

        The template has one size, so what looks like it at another distance is not the target; and
        where the frame has depth but none there, as beyond the depth camera's view, it may be
        anything.
        """
        depth = self._depth_patch.depth
        if frame.depth is None or depth is None:
            return True
        difference = self._diff_at_centre(frame, self._box_at(found), 0.0)
        if difference is None:
            return False
        return abs(difference.distance / depth - 1) <= self._depth_parameters.depth_change

    def _see(
        self,
        frame: Frame,
        model: KcfModel,
        found: Detection,
        difference: DepthDifference | None,
        interval: float,
    ) -> None:
        """Take the target's position; learn its look and depth there as far as they are its own.

        A response can still be high, or the depth not yet too different, when an occluder covers a
        part of the centre: the less is learned, the more the depth differs.
        """
        again = self._hidden
        trust = 1.0 if again else self._trust(difference, found.response)
        self._hidden = False
        self._unseen_ns = 0
        self._box = self._box_at(found)
        model.train(frame, self._box.cx, self._box.cy, trust)
        if frame.depth is None:
            return
        if again or (trust >= 0.5 and found.response >= _DETECTED):
            patch = centre_patch(frame.depth, self._box, self._depth_parameters.center_share)
            self._depth_patch.remember(patch, None if again else interval)
        elif difference is not None:
            self._depth_patch.follow(difference, interval)

    def _hide(self) -> None:
        """Step 17, and 19 of Algorithm 2: the target is hidden; its position is kept."""
        self._hidden = True
        self._depth_patch.lose_velocity()

    def _trust(self, difference: DepthDifference | None, response: float) -> float:
        """How much of a frame to learn: less, the more the depth, or else the response, differs."""
        if difference is None:
            return min(max((response - self._low) / (self._high - self._low), 0.0), 1.0)
        p = self._depth_parameters
        near = min(difference.nearer / p.depth_threshold, 1.0)
        return (1 - near) * (1 - min(difference.farther / max(p.gone_share, 1e-6), 1.0))

    def _box_at(self, found: Detection) -> Box:
        return Box.from_center(found.cx, found.cy, self._box.width, self._box.height)

    def _hidden_s(self) -> float:
        """Seconds since the target was last seen; 0 while it is."""
        return self._unseen_ns * 1e-9 if self._hidden else 0.0

    def _track(self, frame: Frame, found: Detection) -> Track:
        box = Box.from_center(found.fine_cx, found.fine_cy, self._box.width, self._box.height)
        score = min(max(found.response, 0.0), 1.0)
        depth = self._depth_patch.depth if frame.depth is not None else None
        return Track(box, TrackState.TRACKING, score, depth, frame.position(box, depth))

    def _rescale(self, frame: Frame, model: KcfModel) -> None:
        """Carry the target over to a stream whose image size has changed."""
        across = frame.width / self._image_size[0]
        down = frame.height / self._image_size[1]
        self._box = self._box.stretched(across, down)
        self._image_size = (frame.width, frame.height)
        model.rescale(across, down)
