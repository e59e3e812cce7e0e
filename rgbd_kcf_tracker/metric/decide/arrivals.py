# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Is who comes somebody new, or somebody who was here before? As it was with those so far."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

RETURN, GONE = 1.5, 4.0
"""Log-odds against somebody who is away coming back rather than somebody new, while nothing is
known of who comes, and the seconds after which two thirds of that hold: who was missed for a moment
is not away."""
KNOWN = 1.0
"""Returns by which that counts as known from the start: one, so that what is seen soon outweighs
it."""


def away(gone: float) -> float:
    """How surely somebody is away who was last seen ``gone`` seconds ago, 0 to 1."""
    return 1.0 - math.exp(-gone / GONE)


def bounded(probability: float, against: float) -> float:
    """A probability of even chances, where there were log-odds against it from the start."""
    return probability / (probability + (1.0 - probability) * math.exp(against))


@dataclass
class Arrivals:
    """Counts who came back.

    Attributes:
        returns: how often somebody did, each as surely as he had been away.
        forgotten: people who came and are not remembered any more.
    """

    returns: float = 0.0
    forgotten: int = 0

    def returned(self, gone: float) -> None:
        """Take somebody who came back after ``gone`` seconds."""
        self.returns += away(gone)

    def against(self, gone: Iterable[float]) -> float:
        """Log-odds against any one who is away coming next rather than somebody new, at least 0.

        That the next is new has the odds of those who were, by the rule of succession (Laplace);
        who comes back is any of those who are away.

        Args:
            gone: for all who are known the seconds since they were last seen.
        """
        shares = [away(each) for each in gone]
        new = len(shares) + self.forgotten + KNOWN * math.exp(RETURN)
        any_of = max(1.0, sum(shares))
        return max(0.0, math.log(any_of * new / (self.returns + KNOWN)))
