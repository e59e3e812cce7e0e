# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The tracker's parameters as ROS parameters: declared, described, checked, and settable live.

A plain node dies with a traceback when a double is given as an integer or an override is out of its
range, and ignores a name that it does not know. Here an integer is taken for a double, and all that
is wrong with what a node was started with is said in one error.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node
from rclpy.parameter import Parameter

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.live.settings import (
    READ_ONLY,
    NodeParameters,
    all_parameters,
    auto_init_range,
    parse_box,
)
from rgbd_kcf_tracker.parameters import ParameterInfo, Parameters, Scalar, checked, describe
from rgbd_kcf_tracker.targets import TargetSet
from rgbd_kcf_tracker.variants import VARIANTS

ROS_NAMES = ('use_sim_time', 'start_type_description_service', 'qos_overrides.')
"""Parameters that rclpy itself declares: an override of these is none of ours."""


DECLARE_OVERRIDES: Any = {'automatically_declare_parameters_from_overrides': True}
"""Options of a node whose overrides :func:`declare_all` reads: rclpy has no other public view."""


def declare_all(
    node: Node, infos: Mapping[str, ParameterInfo], read_only: Callable[[str], bool]
) -> None:
    """Declare parameters with the values that the node was started with.

    Args:
        node: made with :data:`DECLARE_OVERRIDES`.
        infos: the parameters by their names.
        read_only: whether a parameter can be set at start alone.

    Raises:
        ParameterError: naming everything that is unknown, of the wrong type or out of range.
    """
    names = [name for name in node.get_parameters_by_prefix('') if not name.startswith(ROS_NAMES)]
    given = {name: node.get_parameter(name).value for name in names}
    values: dict[str, Scalar] = {}
    problems = []
    if not isinstance(node.get_parameter('use_sim_time').value, bool):
        problems.append('parameter use_sim_time must be true or false')
    for name, value in given.items():
        node.undeclare_parameter(name)
        if name not in infos:
            problems.append(unknown(name, infos))
            continue
        try:
            values[name] = coerced(infos[name], value)
        except ParameterError as error:
            problems.append(str(error))
    if problems:
        raise ParameterError('; '.join(problems))
    for name, info in infos.items():
        described = descriptor(info)
        described.read_only = read_only(name)
        node.declare_parameter(
            name, values.get(name, info.default), described, ignore_override=True
        )


def unknown(name: str, infos: Collection[str]) -> str:
    """That nobody reads this parameter, and what may have been meant."""
    near = difflib.get_close_matches(name, infos, n=1)
    known = f'did you mean {near[0]!r}?' if near else f'known are {", ".join(infos)}'
    return f'unknown parameter {name!r}: {known}'


class ParameterServer:
    """Declares all parameters on a node and hands out checked dataclasses.

    Args:
        node: the node to declare on, made with :data:`DECLARE_OVERRIDES`.
        changed: called with the names after parameters were set while running.

    Raises:
        ParameterError: where the node was started with what is no value of its parameters.
    """

    def __init__(self, node: Node, changed: Callable[[frozenset[str]], None]) -> None:
        self._node = node
        self._changed = changed
        self._infos = {info.name: info for info in all_parameters()}
        declare_all(node, self._infos, READ_ONLY.__contains__)
        auto_init_range(self.node_parameters())  # each may be right alone, and not beside another
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

    def _before_set(self, parameters: Sequence[Parameter]) -> list[Parameter]:
        """Take an integer for a double and a list for a box, before rclpy compares the types.

        What it then is, in range or not, is refused with its reason: by _on_set, or by rclpy, which
        of what nobody declared does not say the name.
        """
        taken = []
        for given in parameters:
            info = self._infos.get(given.name)
            if info is None and not self._node.has_parameter(given.name):
                raise ParameterNotDeclaredException(unknown(given.name, self._infos))
            value = given.value if info is None else _of_type(info, given.value)
            if value is not given.value:
                given = Parameter(given.name, value=value)
            taken.append(given)
        return taken

    def _on_set(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        own = self._values('', NodeParameters)
        values: dict[str, Scalar] = {}
        try:
            for given in parameters:
                info = self._infos.get(given.name)
                if info is not None:
                    values[given.name] = coerced(info, given.value)
            NodeParameters(**(own | {name: values[name] for name in own if name in values}))
            self._read_files(values)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _read_files(self, values: Mapping[str, Scalar]) -> None:
        """Read what new values name: a file that cannot be used would stop every later change.

        Raises:
            ParameterError: where one cannot be used.
        """
        for name, value in values.items():
            if not self._infos[name].file or value in ('', self._node.get_parameter(name).value):
                continue
            variant = name.partition('.')[0]
            cls, prefix = VARIANTS[variant].parameters, f'{variant}.'
            given = {n.removeprefix(prefix): v for n, v in values.items() if n.startswith(prefix)}
            TargetSet(variant, cls(**(self._values(prefix, cls) | given)))

    def _after_set(self, parameters: Sequence[Parameter]) -> None:
        names = frozenset(p.name for p in parameters if p.name in self._infos)
        if names:
            self._changed(names)


def coerced(info: ParameterInfo, value: object) -> Scalar:
    """``value`` as the parameter's type, checked.

    Raises:
        ParameterError: where it is no such value or out of range.
    """
    taken = checked(info, _of_type(info, value))
    if info.name == 'init_box':
        parse_box(str(taken))
    return taken


def _of_type(info: ParameterInfo, value: Any) -> Any:
    """``value`` where it has another type that ROS users write for the parameter's."""
    # Both name several things: as lists, too.
    if info.name in ('init_box', 'topics') and not isinstance(value, str):
        return ','.join(map(str, value)) if isinstance(value, Iterable) else value
    is_integer = isinstance(value, int) and not isinstance(value, bool)
    return float(value) if info.type is float and is_integer else value


def descriptor(info: ParameterInfo) -> ParameterDescriptor:
    """What `ros2 param describe` shows of a parameter."""
    unit = f' [{info.unit}]' if info.unit else ''
    described = ParameterDescriptor(
        name=info.name,
        description=info.description + unit,
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
