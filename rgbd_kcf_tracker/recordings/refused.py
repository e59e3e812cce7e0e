# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Numbers in float depth that are no readings, counted and told once."""

from __future__ import annotations

from collections.abc import Callable

from rgbd_kcf_tracker.frame import FARTHEST_M, NEAREST_M

NO_METRES = f'not between {NEAREST_M:g} and {FARTHEST_M:g} metres: taken as no reading'
"""What such numbers are, for people."""


class RefusedReadings:
    """Counts what the depth images of a recording hold that no depth camera measures."""

    def __init__(self) -> None:
        self._counts: list[int] = []
        self._first = ''

    def of(self, image: str) -> Callable[[int], None]:
        """What a decoder tells how many numbers of an image it refused.

        Args:
            image: its name, for people.
        """

        def count(values: int) -> None:
            self._first = self._first or image
            self._counts.append(values)

        return count

    def tell(self, warn: Callable[[str], None]) -> None:
        """Warn of what was counted, if anything was, and begin anew."""
        if self._counts:
            warn(
                f'{sum(self._counts)} numbers in {len(self._counts)} depth images, first in '
                f'{self._first}, are {NO_METRES}'
            )
        self._counts, self._first = [], ''
