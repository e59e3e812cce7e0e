# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The self-adjusting depth patch: has the depth at the target's centre changed?

Thesis section 4.1.3. Centre patches of two frames are subtracted. Where the target's silhouette has
shifted, background enters at an edge of the patch: edge columns and rows of high difference are
trimmed away, up to a bound. An occluder covers more than the bound allows, so what is left still
differs, and that is what decides (figures 4.3 to 4.5).

Three things the thesis leaves open are decided here. A pixel without a reading in either patch
never counts. The patch is compared with the last one that surely showed the target, not with the
frame before: an occluder that slides in slowly changes little from frame to frame, and one that
stands still changes nothing. And a target may walk towards the camera: the shift that all pixels
share is taken for its motion, as far as a walking person can have come, sped up or slowed down in
the time between two frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.thesis.centre_patch import Depth

# Unevenness of a body and noise of the camera, metres.
_NOISE = 0.2
# What a walking person gathers or loses of speed, metres per second squared.
_ACCELERATION = 3.0
# By how much a walking body sways between two frames, metres.
_JITTER = 0.03
# Time over which the speed in depth is averaged.
_SETTLING_S = 0.3
# Half of what a body measures along the line of sight, arms included, metres.
_BODY = 0.5
# Share of the patch that must be left of a target for its motion to be read from it.
_OWN_SHARE = 0.2
# Share of a patch that must have a reading to be remembered: the few readings about a target that
# swallows the infrared are the background's.
_LEAST_SEEN = 0.3
# Quantile of the depths in a first box that is taken for the target's.
_NEARER_PART = 0.3


@dataclass(frozen=True, slots=True)
class DepthDifference:
    """What the comparison of two centre patches says.

    Attributes:
        value: the thesis's D_diff: mean absolute difference of the pixels that are left, in metres.
        nearer: the part of it that came nearer, in metres: what an occluder does.
        farther: share of the pixels that show something farther than the target.
        distance: median depth in metres of the new patch where the remembered one is the target's.
        motion: shift in metres that was taken for the target's own motion.
        rows, cols: what the trimming left of the patch.
    """

    value: float
    nearer: float
    farther: float
    distance: float
    motion: float
    rows: slice
    cols: slice


def trim(high: npt.NDArray[np.bool_], bound: int) -> slice:
    """What is left of an axis whose edge entries are high.

    Args:
        high: which columns (or rows) have a high difference.
        bound: most entries to take off at either end.
    """
    before = after = 0
    while before < bound and high[before]:
        before += 1
    while after < bound and high[-1 - after]:
        after += 1
    return slice(before, len(high) - after)


class DepthPatch:
    """Remembers the depth patch of a target that was seen, and compares others with it.

    Args:
        trim_above: metres; an edge column or row that differs by more on average is trimmed.
        most_trim: share of the patch that may be trimmed at each edge, below 0.5.
        walking_speed: metres per second that a target may come nearer or go away.
        cap: metres that one pixel can differ at most.
        least_valid: share of the patch that must have a reading in both patches.
    """

    def __init__(
        self,
        trim_above: float,
        most_trim: float,
        walking_speed: float,
        cap: float,
        least_valid: float = 0.1,
    ) -> None:
        self._cap = np.float32(cap)
        self._trim_above = trim_above
        self._most_trim = most_trim
        self._speed = walking_speed
        self._least_valid = least_valid
        self._patch: Depth | None = None
        self._depth: float | None = None
        self._velocity: float | None = None

    @property
    def depth(self) -> float | None:
        """Distance of the target in metres when it was last followed; None where unknown."""
        return self._depth

    def remember(self, patch: Depth, interval: float | None = None) -> None:
        """Take the patch of a target that is surely seen.

        Args:
            patch: metres, of the newest frame.
            interval: seconds since the frame before; None where the target was not seen in it.
        """
        seen = patch[np.isfinite(patch)]
        if len(seen) < _LEAST_SEEN * patch.size:
            return
        depth = self._depth
        if depth is None or np.mean(np.abs(seen - depth) <= _BODY) < _OWN_SHARE:
            # The target is the nearer of what a box shows, even where it is the lesser part.
            # A reading, for between two surfaces there is none.
            depth = float(np.quantile(seen, _NEARER_PART, method='lower'))
        own = np.abs(patch - np.float32(depth)) <= _BODY
        before, self._depth = self._depth, float(np.median(patch[own]))
        self._learn_velocity(None if before is None else self._depth - before, interval)
        # Background between the limbs is not the target's: it is not compared. What lies outside
        # the image is: if it comes in, it comes at this depth.
        self._patch = np.where(own, patch, np.float32(np.nan))
        self._patch[np.isinf(patch)] = self._depth

    def follow(self, difference: DepthDifference, interval: float) -> None:
        """Let the remembered depth go with the target's own motion over ``interval`` seconds."""
        if self._patch is not None and self._depth is not None:
            self._patch = self._patch + np.float32(difference.motion)
            self._depth += difference.motion
            self._learn_velocity(difference.motion, interval)

    def lose_velocity(self) -> None:
        """Forget how fast the target moves in depth: it is not seen any more."""
        self._velocity = None

    def _learn_velocity(self, motion: float | None, interval: float | None) -> None:
        if motion is None or not interval:
            self._velocity = None
            return
        measured = float(np.clip(motion / interval, -self._speed, self._speed))
        if self._velocity is None:
            self._velocity = measured
            return
        self._velocity += (1 - np.exp(-interval / _SETTLING_S)) * (measured - self._velocity)

    def diff_at_centre(self, patch: Depth, interval: float) -> DepthDifference | None:
        """Compare a patch with the remembered one (the thesis's ``diff_at_centre``).

        Args:
            patch: from :func:`~rgbd_kcf_tracker.thesis.centre_patch.centre_patch`, metres.
            interval: seconds in which the target may have moved by itself.

        Returns:
            None where too few pixels have a reading in both patches.
        """
        if self._patch is None:
            return None
        change = patch - self._patch
        valid = ~np.isnan(change)
        least = self._least_valid * change.size
        if np.count_nonzero(valid) < least:
            return None
        low, high = self._reach(interval)
        motion = self._motion(change[valid], low, high)
        change = np.where(valid, change - np.float32(motion), 0)
        # One pixel counts for so much and no more: what decides is how many there are.
        change = np.clip(change, -self._cap, self._cap)
        size = np.abs(change)
        # Columns first, then rows of what is left: the figures' order.
        bounds = [int(self._most_trim * side) for side in size.shape]
        cols = trim(self._high(size, valid, 0), bounds[1])
        rows = trim(self._high(size[:, cols], valid[:, cols], 1), bounds[0])
        count = np.count_nonzero(valid[rows, cols])
        if count < least / 2:
            return None
        left = change[rows, cols]
        return DepthDifference(
            value=float(np.abs(left).sum() / count),
            nearer=float(-np.minimum(left, 0).sum() / count),
            farther=np.count_nonzero(left > self._trim_above) / count,
            distance=float(np.median(patch[valid])),
            motion=motion,
            rows=rows,
            cols=cols,
        )

    def _reach(self, interval: float) -> tuple[float, float]:
        """Least and greatest motion in depth that the target can have made, metres."""
        walk = self._speed * interval
        if self._velocity is None or interval == 0:
            return -walk, walk
        expected = self._velocity * interval
        slack = _ACCELERATION * interval**2 + _JITTER
        return max(expected - slack, -walk), min(expected + slack, walk)

    def _motion(self, change: Depth, low: float, high: float) -> float:
        """The shift that the target's own pixels share: those that it can have moved.

        Taken over all pixels it would be the background's, or an occluder's, as soon as they are
        the most, and then the target itself would seem to differ.
        """
        own = change[(change >= low - _NOISE) & (change <= high + _NOISE)]
        if len(own) < _OWN_SHARE * len(change):
            return float(np.clip(0.0, low, high))
        return float(np.clip(np.median(own), low, high))

    def _high(
        self, size: npt.NDArray[np.float32], valid: npt.NDArray[np.bool_], axis: int
    ) -> npt.NDArray[np.bool_]:
        counts = np.count_nonzero(valid, axis=axis)
        means = size.sum(axis=axis) / np.maximum(counts, 1)
        high: npt.NDArray[np.bool_] = means > self._trim_above
        return high
