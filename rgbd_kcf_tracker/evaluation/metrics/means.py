# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The mean of several results of one kind."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterable
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np


class Result(Protocol):
    """A dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


M = TypeVar('M', bound=Result)


def mean_of(kind: type[M], measures: Iterable[M]) -> M:
    """Field by field, each result counting once; a NaN does not count.

    Args:
        kind: a dataclass of floats.
        measures: results of that kind; of none of them every mean is NaN.
    """
    rows = np.array([dataclasses.astuple(m) for m in measures], np.float64)
    if not len(rows):
        return kind(*[math.nan] * len(dataclasses.fields(kind)))
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', RuntimeWarning)  # a measure that none of them has
        return kind(*[float(v) for v in np.nanmean(rows, axis=0)])
