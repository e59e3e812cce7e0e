# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Simulated Kinect V2 recordings of people and things, with exact ground truth.

>>> from rgbd_kcf_tracker.simulation import simulate
>>> sequence = simulate('occlusion', seed=3)
>>> for simulated in sequence:
...     use(simulated.frame, simulated.visible)  # doctest: +SKIP

Scenes of several people tell the truth about each of them, by id:

>>> for simulated in simulate('comers', seed=3, rate_hz=10.0):
...     use(simulated.frame, simulated.truths)  # doctest: +SKIP
"""

from rgbd_kcf_tracker.simulation.build import check_request, kinect2_intrinsics, simulate
from rgbd_kcf_tracker.simulation.picture import Truth
from rgbd_kcf_tracker.simulation.sequence import SimulatedFrame, SimulatedSequence
from rgbd_kcf_tracker.simulation.stage import SCENARIOS, Scenario, expand_names

__all__ = [
    'SCENARIOS',
    'Scenario',
    'SimulatedFrame',
    'SimulatedSequence',
    'Truth',
    'check_request',
    'expand_names',
    'kinect2_intrinsics',
    'simulate',
]
