# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The trackers that users choose by name, and the way to make one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.metric.parameters import MetricParameters
from rgbd_kcf_tracker.metric.targets import MetricTracker
from rgbd_kcf_tracker.parameters import Parameters
from rgbd_kcf_tracker.thesis.kcf import KcfParameters, KcfTracker
from rgbd_kcf_tracker.thesis.rgbd import RgbdParameters, RgbdTracker
from rgbd_kcf_tracker.thesis.rgbd_pf import RgbdPfParameters, RgbdPfTracker
from rgbd_kcf_tracker.track import Tracker

__all__ = [
    'VARIANTS',
    'Variant',
    'create_tracker',
    'default_parameters',
]


@dataclass(frozen=True, slots=True)
class Variant:
    """A tracker that users choose by name: its parameters' class and how to make it from them.

    ``uses_depth`` says whether it looks at depth at all: where not, a source need not decode it.
    """

    name: str
    summary: str
    parameters: type[Parameters]
    make: Callable[..., Tracker]
    uses_depth: bool = True


VARIANTS: dict[str, Variant] = {
    v.name: v
    for v in (
        Variant(
            'kcf',
            'colour-only kernelized correlation filter',
            KcfParameters,
            KcfTracker,
            uses_depth=False,
        ),
        Variant(
            'rgbd',
            'kcf with an occlusion test by depth and sliding-window re-detection',
            RgbdParameters,
            RgbdTracker,
        ),
        Variant(
            'rgbd_pf',
            'kcf with a depth-first occlusion test and a particle filter',
            RgbdPfParameters,
            RgbdPfTracker,
        ),
        Variant(
            'metric',
            'surfaces in metres, with a correlation filter where depth says nothing',
            MetricParameters,
            MetricTracker,
        ),
    )
}
DEFAULT_VARIANT = 'metric'


def _variant(name: str) -> Variant:
    if name not in VARIANTS:
        raise ParameterError(f'unknown variant {name!r}: choose one of {", ".join(VARIANTS)}')
    return VARIANTS[name]


def default_parameters(name: str) -> Parameters:
    """The released defaults of a variant.

    Raises:
        ParameterError: for an unknown variant.
    """
    return _variant(name).parameters()


def fitting_parameters(variant: str, parameters: Parameters | None) -> Parameters:
    """The given parameters, or the released defaults of a variant.

    Raises:
        ParameterError: for an unknown variant, or parameters of another one.
    """
    chosen = _variant(variant)
    if parameters is None:
        return chosen.parameters()
    if not isinstance(parameters, chosen.parameters):
        raise ParameterError(
            f'variant {variant} takes {chosen.parameters.__name__}, not {type(parameters).__name__}'
        )
    return parameters


def create_tracker(variant: str = DEFAULT_VARIANT, parameters: Parameters | None = None) -> Tracker:
    """A tracker by its variant's name, with the released defaults or the given parameters.

    Raises:
        ParameterError: for an unknown variant, parameters of another one, or a network that they
            name and that cannot be run.
    """
    return _variant(variant).make(fitting_parameters(variant, parameters))
