# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The parameters of the ``metric`` tracker."""

from __future__ import annotations

from dataclasses import dataclass

from rgbd_kcf_tracker.parameters import Parameters, parameter


@dataclass(frozen=True)
class MetricParameters(Parameters):
    """Parameters of ``metric``; one set of defaults serves every camera and target."""

    view_width: int = parameter(
        240,
        'Columns at which the depth image is cut into surfaces.',
        unit='px',
        minimum=64,
        maximum=1024,
    )
    jump: float = parameter(
        0.04, 'Depth step between two surfaces.', unit='m', minimum=0.001, maximum=1.0
    )
    jump_per_metre: float = parameter(
        0.03, 'Growth of the step with each metre of depth.', unit='m/m', minimum=0.0, maximum=1.0
    )
    floor_margin: float = parameter(
        0.05,
        'Elevation up to which a pixel is floor; 0 leaves the floor in.',
        unit='m',
        minimum=0.0,
        maximum=0.5,
    )
    acceleration: float = parameter(
        4.0, 'Process noise of the motion.', unit='m/s^2', minimum=0.1, maximum=100.0
    )
    speed: float = parameter(
        1.5,
        'Deviation of the velocity that is not known yet.',
        unit='m/s',
        minimum=0.01,
        maximum=20.0,
    )
    acceptance: float = parameter(
        0.45,
        'Probability from which a candidate is taken for the target.',
        minimum=0.01,
        maximum=0.99,
    )
    recognition: float = parameter(
        0.55,
        'The same after an absence of a second or more: a stranger is worse than no box.',
        minimum=0.01,
        maximum=0.99,
    )
    least_visible: float = parameter(
        0.17,
        'Share of the body below which it counts as hidden.',
        minimum=0.0,
        maximum=1.0,
        source='ground truth says absent below a fifth',
    )
    lost_after: float = parameter(
        2.0,
        'Time after which a hidden target is lost and looked for everywhere.',
        unit='s',
        minimum=0.0,
        maximum=3600.0,
    )
    predict_for: float = parameter(
        2.0,
        'Time for which it is said where a hidden target is believed to be.',
        unit='s',
        minimum=0.0,
        maximum=60.0,
    )
    most_candidates: int = parameter(
        10, 'Largest number of surfaces examined in a frame.', minimum=1, maximum=100
    )
    particles: int = parameter(
        256, 'Number of particles while the target is hidden.', minimum=16, maximum=10000
    )
    seed: int = parameter(1, 'Seed of the particles.', minimum=0, maximum=2**31 - 1)
    use_particles: bool = parameter(
        True, 'Carry particles while hidden, else the motion filter alone.'
    )
    use_others: bool = parameter(True, 'Refuse what is better explained as somebody else.')
    use_room: bool = parameter(True, 'Refuse what stood still while the target was elsewhere.')
    use_color: bool = parameter(True, 'Compare the colours of candidates.')
    use_surfaces: bool = parameter(True, 'Follow surfaces in depth, else the look alone.')
    use_look: bool = parameter(
        True, 'Fall back on the correlation filter where depth says nothing of the target.'
    )
    use_mask: bool = parameter(True, 'Hold the correlation filter to the target by colour.')
    cells: int = parameter(48, 'Cells along a side of the search window.', minimum=16, maximum=128)
    padding: float = parameter(
        3.0,
        'Search window beyond the target, in units of its root area.',
        minimum=0.5,
        maximum=8.0,
        source='Lukezic et al. 2017',
    )
    label_sigma: float = parameter(
        1.8,
        'Width of the wanted response, in sixteenths of the root area.',
        minimum=0.1,
        maximum=10.0,
    )
    learning_rate: float = parameter(
        0.02,
        'Share of a new sample in the filter, for each thirtieth of a second.',
        minimum=0.0,
        maximum=1.0,
        source='Lukezic et al. 2017',
    )
    color_share: float = parameter(
        0.1, "Weight of colour beside the filter's response.", minimum=0.0, maximum=1.0
    )
    hidden_ratio: float = parameter(
        0.45,
        'Response against its own mean below which a target followed by its look is hidden.',
        minimum=0.0,
        maximum=1.0,
    )
    seen_ratio: float = parameter(
        0.65, 'Response against its own mean from which it is seen again.', minimum=0.0, maximum=2.0
    )
    embedding: str = parameter(
        '',
        'ONNX file of a network that describes people by pictures of 128 x 256 pixels; empty for '
        'none.',
        file=True,
    )
    embedding_even: float = parameter(
        0.56,
        'Cosine of its vectors at which two are as often of one person as of two.',
        minimum=-1.0,
        maximum=1.0,
        source='fitted to OSNet x0.25 (MSMT17) on real people',
    )
    embedding_steepness: float = parameter(
        12.0,
        'Log-odds of being one person for each unit of the cosine.',
        minimum=0.0,
        maximum=1000.0,
        source='likewise',
    )
