# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""From what is seen of a candidate to the probability that it is the target.

A logistic regression over a dozen measurements. Its weights were fitted to candidates that the
tracker met in simulated scenes and are checked on real recordings (docs/figures.md tells how to fit
them again); so the probability is calibrated, and the decision needs no thresholds of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rgbd_kcf_tracker.arrays import FloatArray
from rgbd_kcf_tracker.metric.identity.tally import SUREST

FADE = 1.0
"""Seconds after which a hidden target's last place says a third of what it said: within one a
walker may have gone farther in any direction than a body is broad. :data:`WEIGHTS` are fitted with
it."""
AWAY = 0.5
"""Seconds after which two thirds of what holds for a target that is followed no longer holds: some
frames at 5 Hz, as who was missed in one is mostly still there. Fitted with it likewise."""

MOST_ALIKE = 3.0
"""Log-odds of a look at most in what :data:`WEIGHTS` were fitted to: beyond it they would say more
than was measured."""


@dataclass(frozen=True, slots=True)
class Said:
    """What a further cue says of a candidate, see :class:`~.cues.Cue`."""

    name: str
    value: float
    weight: float

    @property
    def share(self) -> float:
        """In the log-odds that the candidate is the target."""
        return self.weight * self.value


@dataclass(frozen=True, slots=True)
class Evidence:
    """What speaks for and against a candidate.

    Attributes:
        step: squared Mahalanobis distance from where the target was expected.
        stride: the same for a target that may also have moved at will.
        fraction: of the body that shows; above 1 where more shows than is known of.
        height: squared-error term of its height, at most 0; 0 where it fits or is cut off.
        gone: seconds since the target was last seen, the step to this frame included.
        missing: True where the target should be in sight at the place where it is expected.
        inland: share of the body that was outside the image when it was last seen, 0 to 1, for a
            candidate that does not touch the image's edge; 0 for one that does.
        emerged: True where the candidate was first seen away from the image's edge: whoever does
            not come in from there was here before.
        look: log-odds that its look is the target's.
        mine: log-odds, place and look together, that the figure which it is part of is the target;
            0 where it is part of none.
        rival: log-odds that it is somebody else who was seen beside the target, at least 0:
            somebody new is always possible.
        assigned: by the joint explanation of the frame, 1 where its figure is the target, -1 where
            it is somebody else, 0 where it is somebody new or no figure; 1 for a target that was no
            figure when it was last seen: nothing then objects.
        room: share of its pixels that stood still while the target was seen elsewhere, 0 to 1.
        more: what further cues say.
    """

    step: float
    stride: float
    fraction: float
    height: float
    gone: float
    missing: bool
    inland: float
    emerged: bool
    look: float
    mine: float
    rival: float
    assigned: int
    room: float
    more: tuple[Said, ...] = ()

    @property
    def behind(self) -> float:
        """By how much somebody else explains the figure better than the target does, log-odds."""
        return max(0.0, self.rival - max(self.mine, 0.0))

    def features(self) -> FloatArray:
        """The regression's inputs, ``(len(WEIGHTS),)``, the last of them 1."""
        near = math.exp(-self.gone / FADE)
        away = 1.0 - math.exp(-self.gone / AWAY)
        look = min(max(self.look, -6.0), MOST_ALIKE)
        mine = min(max(self.mine, -6.0), 8.0)
        behind = min(self.behind, 8.0)
        log_fraction = math.log(max(self.fraction, 1e-3))
        less, more = min(max(-log_fraction, 0.0), 2.5), min(max(log_fraction, 0.0), 1.5)
        return np.array(
            (
                math.log1p(self.step) * near,
                math.log1p(self.stride) * near,
                min(self.step, 20.0) * near,
                more**2,
                less,
                max(self.height, -8.0),
                away,
                math.log1p(self.gone),
                away * less,
                float(self.missing),
                away * self.inland,
                away * float(self.emerged),
                look,
                away * look,
                mine,
                away * mine,
                behind,
                away * behind,
                float(self.assigned),
                away * float(self.assigned),
                1.0,
            )
        )


WEIGHTS = np.array(
    (
        -0.41, -1.83, 0.03, -2.60, -3.11, 0.20, 0.59, -0.31, 1.95, -0.55, -1.88, 0.29,
        1.01, -0.09, 0.07, 0.33, -0.29, -0.67, 4.58, -3.73, -0.71,
    )
)  # fmt: skip
"""Log-odds that the candidate is the target for each unit of :meth:`Evidence.features`, in their
order. They come from a logistic regression on proposals that the tracker met on simulated and real
people, each right or wrong by the truth; ``evaluation.evidence_fit`` fits them again, and
docs/figures.md says on what these were fitted. Hand-set ones were as good, but not calibrated."""

CUES = (
    ('place', (0, 1, 2)),
    ('look', (12, 13)),
    ('who stands there', (14, 15)),
    ('somebody else', (16, 17)),
    ('explained together', (18, 19)),
    ('size', (3, 4, 5, 8)),
    ('time hidden', (6, 7)),
    ('should be in sight', (9,)),
    ('left the image', (10,)),
    ('came from behind', (11,)),
    ('to begin with', (20,)),
)
"""What the regression's inputs are about, by their places in it."""

WHERE_IT_STOOD = 'where it stood'
"""What the place says of a thing that has always stood still, see
:class:`~rgbd_kcf_tracker.metric.identity.stood.Stood`."""
OTHER_PLACES = 'other places'
"""What the likeliest candidate loses to the others; the regression does not know of them."""
SOMEBODY_NEW = 'somebody new'
"""What it loses while it may be somebody who was never seen before, or another who was."""
KNOWN_BEFORE = 'known before'
"""What it loses after an absence to what the target was known by before, see
:class:`~rgbd_kcf_tracker.metric.identity.comeback.Comeback`."""

CUE_WORDS = {
    'place': 'how far it is from where the target was expected',
    'look': 'how alike its colours are to those that the target is known by',
    'who stands there': 'how likely the person of whom it is part is the target, by place and look',
    'somebody else': 'how likely that person is somebody else who was seen beside the target',
    'explained together': 'whether the frame as a whole is explained best where this is the target',
    'size': 'how well its height and visible part fit the body of the target',
    'time hidden': 'how long the target has been away: what comes back is less surely it',
    'should be in sight': 'nothing covers the place where the target was expected',
    'left the image': 'the target left at the edge of the image, but this did not come in there',
    'came from behind': 'it was first seen away from the image edge, so it was here before',
    'to begin with': 'where all other cues say nothing',
    WHERE_IT_STOOD: 'a thing that stood still is there again when the camera looks back',
    OTHER_PLACES: 'the target is at one place only: what the likeliest loses to the others',
    SOMEBODY_NEW: 'who comes may be somebody new, or another who is known, instead of the target',
    KNOWN_BEFORE: 'after an absence: how alike it is to the target before, and to others as well',
}
"""What each of :data:`CUES` says, and of those that only the likeliest has."""


def probability(evidence: Evidence) -> float:
    """Probability that a candidate is the target, 0 to 1."""
    odds = float(WEIGHTS @ evidence.features()) + sum(said.share for said in evidence.more)
    return 1.0 / (1.0 + math.exp(-min(max(odds, -SUREST), SUREST)))
