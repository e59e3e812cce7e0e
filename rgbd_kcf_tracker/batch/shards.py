# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A part of the work, for machines that do not know of each other (SLURM arrays, CI matrices)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from rgbd_kcf_tracker.errors import ParameterError

T = TypeVar('T')


@dataclass(frozen=True, slots=True)
class Shard:
    """The part ``index`` of ``count`` equal parts, counted from 1.

    Raises:
        ParameterError: where there is no such part.
    """

    index: int
    count: int

    def __post_init__(self) -> None:
        if not 1 <= self.index <= self.count:
            raise ParameterError(
                f'--shard {self}: parts are counted from 1/{self.count} to '
                f'{self.count}/{self.count}'
            )

    @classmethod
    def parse(cls, text: str) -> Shard:
        """``I/N``, as it is typed.

        Raises:
            ParameterError: where the text is not so.
        """
        match = re.fullmatch(r'([0-9]{1,9})/([0-9]{1,9})', text.strip())
        if match is None:
            raise ParameterError(f'--shard {text!r}: give I/N, such as 3/16')
        return cls(int(match[1]), int(match[2]))

    def of(self, items: Sequence[T]) -> list[T]:
        """Every ``count``-th item: neighbours, which are often alike, go to different parts."""
        return list(items[self.index - 1 :: self.count])

    def __str__(self) -> str:
        return f'{self.index}/{self.count}'
