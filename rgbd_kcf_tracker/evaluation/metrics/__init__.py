# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Every measure as a pure function: arrays or boxes in, numbers out.

:func:`measure_boxes` gives all of a sequence's numbers at once; the modules hold the parts, one
idea each: ``boxes`` (overlap, centre error), ``princeton``, ``otb``, ``confusion``,
``presence`` (strangers, returns), ``vot`` (short-term), ``longterm``, ``calibration``; and
``everyone`` for several people at once.
"""

from rgbd_kcf_tracker.evaluation.metrics.comparison import Comparison, compare
from rgbd_kcf_tracker.evaluation.metrics.summary import (
    Measures,
    mean,
    measure,
    measure_boxes,
)

__all__ = [
    'Comparison',
    'Measures',
    'compare',
    'mean',
    'measure',
    'measure_boxes',
]
