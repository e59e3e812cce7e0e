# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Is who comes somebody new, or somebody who was here before? As it was with those so far.

How often people come back is learned from all who came, and each of them counts as what he seems
to be, not as what he was taken for: who is like somebody, but not by enough, counts as half a
return. Else, where many new ones came first, nobody who came back later would ever have been
recognised, and each would have been one more who is new. Counting so, and weighing what was heard
of each by the count, is expectation maximisation (Dempster et al., 1977), a step in each frame.
"""

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


def is_new(again: float, against: float) -> float:
    """How likely somebody was new when he came, 0 to 1.

    Args:
        again: see :attr:`Arrival.again`.
        against: log-odds against anybody's coming back.
    """
    return 1.0 / (1.0 + math.exp(min(again - against, 30.0)))


@dataclass(frozen=True, slots=True)
class Arrival:
    """Somebody who came.

    Attributes:
        gone: seconds since he was last seen.
        again: log-odds, before it is asked how often anybody comes back, that he is one of those
            who had gone before he came rather than somebody new; minus infinity where nothing says
            so.
    """

    gone: float
    again: float = -math.inf


@dataclass
class Arrivals:
    """Counts who came back.

    Attributes:
        returns: how often somebody did, each as surely as he had been away.
        forgotten: people who came and are not remembered any more, each as surely as he was new.
        last: log-odds against anybody's coming back, as they were in the last frame.
    """

    returns: float = 0.0
    forgotten: float = 0.0
    last: float = RETURN

    def returned(self, gone: float) -> None:
        """Take somebody who came back after ``gone`` seconds."""
        self.returns += away(gone)

    def against(self, came: Iterable[Arrival]) -> float:
        """Log-odds against any one who is away coming next rather than somebody new, at least 0.

        That the next is new has the odds of those who were, by the rule of succession (Laplace);
        who comes back is any of those who are away.

        Args:
            came: all who are known.
        """
        new, any_of, again = 0.0, 0.0, 0.0
        for each in came:
            share = is_new(each.again, self.last)
            new += share
            again += 1.0 - share
            any_of += share * away(each.gone)
        new += self.forgotten + KNOWN * math.exp(RETURN)
        odds = max(1.0, any_of) * new / (self.returns + again + KNOWN)
        self.last = max(0.0, math.log(odds))
        return self.last
