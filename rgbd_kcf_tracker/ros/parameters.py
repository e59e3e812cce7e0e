# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The tracker's parameters as ROS parameters: declared, described, checked, and settable live.

A plain node dies with a traceback when a double is given as an integer or an override is out of its
range. Here an integer is taken for a double, and a bad override leaves the default and a message.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.live.settings import READ_ONLY, NodeParameters, all_parameters, parse_box
from rgbd_kcf_tracker.parameters import ParameterInfo, Parameters, Scalar, checked, describe
from rgbd_kcf_tracker.variants import VARIANTS

ROS_NAMES = ('use_sim_time', 'start_type_description_service', 'qos_overrides.')
"""Parameters that rclpy itself declares: an override of these is none of ours."""


class ParameterServer:
    """Declares all parameters on a node and hands out checked dataclasses.

    Args:
        node: the node to declare on.
        changed: called with the names after parameters were set while running.

    Attributes:
        problems: what was wrong with the overrides that the node was started with.
    """

    def __init__(self, node: Node, changed: Callable[[frozenset[str]], None]) -> None:
        self._node = node
        self._changed = changed
        self._infos = {info.name: info for info in all_parameters()}
        self.problems: list[str] = []
        # rclpy offers no public view of the overrides that belong to undeclared parameters.
        overrides: Mapping[str, Parameter] = getattr(node, '_parameter_overrides', {})
        for info in self._infos.values():
            value = info.default
            if info.name in overrides:
                try:
                    value = coerced(info, overrides[info.name].value)
                except ParameterError as error:
                    self.problems.append(f'{error}; using {info.default!r}')
            node.declare_parameter(info.name, value, descriptor(info), ignore_override=True)
        self._note_unknown(overrides)
        node.add_pre_set_parameters_callback(self._before_set)
        node.add_on_set_parameters_callback(self._on_set)
        node.add_post_set_parameters_callback(self._after_set)

    def node_parameters(self) -> NodeParameters:
        """The node's own parameters as they stand."""
        return NodeParameters(**self._values('', NodeParameters))

    def variant_parameters(self, variant: str) -> Parameters:
        """The parameters of a variant as they stand."""
        cls = VARIANTS[variant].parameters
        return cls(**self._values(f'{variant}.', cls))

    def _values(self, prefix: str, cls: type[Parameters]) -> dict[str, Any]:
        return {
            info.name: self._node.get_parameter(prefix + info.name).value for info in describe(cls)
        }

    def _note_unknown(self, overrides: Mapping[str, Parameter]) -> None:
        for name in overrides:
            if name not in self._infos and not name.startswith(ROS_NAMES):
                self.problems.append(
                    f'unknown parameter {name!r} is ignored: see `ros2 param list` for the names'
                )

    def _before_set(self, parameters: Sequence[Parameter]) -> list[Parameter]:
        """Take an integer for a double and a list for a box, before rclpy compares the types."""
        taken = []
        for given in parameters:
            info = self._infos.get(given.name)
            if info is not None:
                # What cannot be taken is refused in _on_set with its reason, or by rclpy.
                with contextlib.suppress(ParameterError):
                    given = Parameter(given.name, value=coerced(info, given.value))
            taken.append(given)
        return taken

    def _on_set(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        for given in parameters:
            info = self._infos.get(given.name)
            if info is None:
                continue
            try:
                coerced(info, given.value)
            except ParameterError as error:
                return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _after_set(self, parameters: Sequence[Parameter]) -> None:
        names = frozenset(p.name for p in parameters if p.name in self._infos)
        if names:
            self._changed(names)


def coerced(info: ParameterInfo, value: object) -> Scalar:
    """``value`` as the parameter's type, checked.

    Raises:
        ParameterError: where it is no such value or out of range.
    """
    if info.name == 'init_box':
        if not isinstance(value, str) and isinstance(value, Iterable):
            value = ','.join(repr(v) for v in value)
        value = checked(info, value)
        parse_box(str(value))
        return value
    return checked(info, value)


def descriptor(info: ParameterInfo) -> ParameterDescriptor:
    """What `ros2 param describe` shows of a parameter."""
    unit = f' [{info.unit}]' if info.unit else ''
    described = ParameterDescriptor(
        name=info.name,
        description=info.description + unit,
        read_only=info.name in READ_ONLY,
    )
    if info.choices:
        described.additional_constraints = f'one of: {", ".join(info.choices)}'
    if info.minimum is None and info.maximum is None:
        return described
    if info.type is float:
        low = -sys.float_info.max if info.minimum is None else float(info.minimum)
        high = sys.float_info.max if info.maximum is None else float(info.maximum)
        described.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    elif info.type is int:
        first = -(2**63) if info.minimum is None else int(info.minimum)
        last = 2**63 - 1 if info.maximum is None else int(info.maximum)
        described.integer_range = [IntegerRange(from_value=first, to_value=last, step=1)]
    return described
