# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What stands behind the page: a recording that is played, or a tracker that runs live."""

from __future__ import annotations

from typing import Any, Protocol

from rgbd_kcf_tracker.parameters import ParameterInfo, Parameters, describe
from rgbd_kcf_tracker.variants import VARIANTS
from rgbd_kcf_tracker.view.board import Board
from rgbd_kcf_tracker.view.commands import Command
from rgbd_kcf_tracker.view.targets import follows_everyone


class Controller(Protocol):
    """The page's other side.

    Attributes:
        board: where it puts up what is to be seen.
    """

    board: Board

    def do(self, command: Command) -> None:
        """Take a request; returns at once. What comes of it is seen on the board."""
        ...

    def description(self) -> dict[str, Any]:
        """What does not change with every moment: title, whether live, variants, parameters."""
        ...

    def boxes_csv(self) -> str:
        """All boxes so far, as ``rgbd-kcf track --output`` writes them, with ids."""
        ...

    def parameters_yaml(self) -> str:
        """The parameters at work, as the tracker node reads them."""
        ...


def describe_variants() -> list[dict[str, Any]]:
    """Every variant with its parameters and their ranges."""
    return [
        {
            'name': variant.name,
            'summary': variant.summary,
            'everyone': follows_everyone(variant.name),
            'parameters': [_described(info) for info in describe(variant.parameters)],
        }
        for variant in VARIANTS.values()
    ]


def _described(info: ParameterInfo) -> dict[str, Any]:
    return {
        'name': info.name,
        'type': info.type.__name__,
        'default': info.default,
        'description': info.description,
        'unit': info.unit,
        'minimum': info.minimum,
        'maximum': info.maximum,
        'choices': list(info.choices),
        'file': info.file,
    }


def yaml_of(variant: str, parameters: Parameters) -> str:
    """Variant and parameters as a file for ``--params-file``."""
    import yaml

    values = {info.name: getattr(parameters, info.name) for info in describe(type(parameters))}
    content = {'/**': {'ros__parameters': {'variant': variant, variant: values}}}
    text: str = yaml.safe_dump(content, sort_keys=False, default_flow_style=False)
    return text
