# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Parameters as data: one frozen dataclass per variant, each field with unit, range and source.

The ROS parameter descriptors, the YAML in ``config/``, the command line's ``--param`` and the
tables in ``docs/`` are all made from these dataclasses, so a parameter is written once.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar, cast

from rgbd_kcf_tracker.errors import ParameterError

Scalar = bool | int | float | str
T = TypeVar('T')


_KINDS: dict[type, str] = {
    bool: 'true or false',
    int: 'a whole number',
    float: 'a number',
    str: 'text',
}


@dataclass(frozen=True, slots=True)
class ParameterInfo:
    """What is known of one parameter beyond its value.

    Attributes:
        name: the field's name, and the parameter's everywhere.
        type: bool, int, float or str.
        default: its value when nothing is said.
        description: one sentence.
        unit: of the value; empty for pure numbers.
        minimum, maximum: inclusive range of a number, None where open.
        choices: allowed values of a string, empty where any is.
        source: where the default comes from (thesis section, paper, or 'ours').
        file: whether a text is the path of a file, or empty for none; of a command line it is made
            absolute, as a run may go on elsewhere.
    """

    name: str
    type: type
    default: Scalar
    description: str
    unit: str = ''
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    source: str = 'ours'
    file: bool = False


def parameter(
    default: Any,
    description: str,
    *,
    unit: str = '',
    minimum: float | None = None,
    maximum: float | None = None,
    choices: tuple[str, ...] = (),
    source: str = 'ours',
    file: bool = False,
) -> Any:
    """A dataclass field that carries its :class:`ParameterInfo`."""
    return field(
        default=default,
        metadata={
            'description': description,
            'unit': unit,
            'minimum': minimum,
            'maximum': maximum,
            'choices': choices,
            'source': source,
            'file': file,
        },
    )


@dataclass(frozen=True)
class Parameters:
    """Base of every parameters dataclass: checks each value against its field's type and range.

    Raises:
        ParameterError: for a value of the wrong type or out of range.
    """

    def __post_init__(self) -> None:
        for info in describe(type(self)):
            object.__setattr__(self, info.name, checked(info, getattr(self, info.name)))

    def replace(self: T, /, **changes: Scalar) -> T:
        """A copy with some values changed, checked again.

        Raises:
            ParameterError: for an unknown name or a bad value.
        """
        known = {info.name for info in describe(type(self))}
        for name in changes:
            if name not in known:
                raise ParameterError(_unknown(name, known))
        return cast(T, dataclasses.replace(cast(Any, self), **changes))


def describe(cls: type) -> tuple[ParameterInfo, ...]:
    """The parameters of a dataclass made with :func:`parameter`, in order of declaration."""
    infos = []
    for f in dataclasses.fields(cls):
        if 'description' not in f.metadata:
            continue
        infos.append(
            ParameterInfo(
                name=f.name, type=type(f.default), default=cast(Scalar, f.default), **f.metadata
            )
        )
    return tuple(infos)


def files_named(parameters: Parameters) -> dict[str, str]:
    """Paths of the files that parameters name, by their names."""
    named = {i.name: getattr(parameters, i.name) for i in describe(type(parameters)) if i.file}
    return {name: path for name, path in named.items() if path}


def checked(info: ParameterInfo, value: object) -> Scalar:
    """``value`` as the parameter's type.

    An integer is taken for a float (``1`` for ``1.0``); nothing else is converted.

    Raises:
        ParameterError: for the wrong type, a number out of range, a string that is no choice, or a
            file that is not there.
    """
    if info.type is float and isinstance(value, int) and not isinstance(value, bool):
        try:
            value = float(value)
        except OverflowError:
            value = math.inf
    if type(value) is not info.type:
        raise ParameterError(f'parameter {info.name} is {value!r}: it must be {_kind_text(info)}')
    if isinstance(value, float) and not math.isfinite(value):
        raise ParameterError(f'parameter {info.name} is {value}: it must be finite')
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        low, high = info.minimum, info.maximum
        if (low is not None and value < low) or (high is not None and value > high):
            raise ParameterError(
                f'parameter {info.name} is {value}: it must be {_range_text(info)}'
            )
    if info.choices and value not in info.choices:
        raise ParameterError(
            f'parameter {info.name} is {value!r}: choose one of {", ".join(info.choices)}'
        )
    if info.file and value and not os.path.isfile(cast(str, value)):
        raise ParameterError(f'parameter {info.name}: there is no file {value!r}')
    return cast(Scalar, value)


def parsed(info: ParameterInfo, text: Scalar) -> Scalar:
    """The value that ``text`` (from a command line) gives the parameter; no text is checked alone.

    Raises:
        ParameterError: where the text is no such value.
    """
    if not isinstance(text, str):
        return checked(info, text)
    if info.file and text:
        text = os.path.abspath(text)
    if info.type is bool:
        lowered = text.strip().lower()
        if lowered not in ('true', 'false'):
            raise ParameterError(f'parameter {info.name} is {text!r}: give true or false')
        return lowered == 'true'
    try:
        return checked(info, info.type(text))
    except ParameterError:
        raise
    except ValueError:
        raise ParameterError(
            f'parameter {info.name} is {text!r}: it must be {_kind_text(info)}'
        ) from None


def with_overrides(parameters: T, overrides: Mapping[str, Scalar]) -> T:
    """A copy of ``parameters`` with values given, as text too, as in ``--param key=value``.

    Raises:
        ParameterError: for an unknown name or a bad value.
    """
    infos = {info.name: info for info in describe(type(parameters))}
    changes: dict[str, Scalar] = {}
    for name, text in overrides.items():
        if name not in infos:
            raise ParameterError(_unknown(name, set(infos)))
        changes[name] = parsed(infos[name], text)
    return cast(T, dataclasses.replace(cast(Any, parameters), **changes))


def _unknown(name: str, known: set[str]) -> str:
    return f'unknown parameter {name!r}: choose from {", ".join(sorted(known))}'


def _kind_text(info: ParameterInfo) -> str:
    """What a value must be, in words, with its range where it has one."""
    kind = _KINDS[info.type]
    if info.minimum is None and info.maximum is None:
        return kind
    return f'{kind}, {_range_text(info)}'


def _range_text(info: ParameterInfo) -> str:
    unit = f' {info.unit}' if info.unit else ''
    if info.minimum is None:
        return f'at most {info.maximum:g}{unit}'
    if info.maximum is None:
        return f'at least {info.minimum:g}{unit}'
    return f'between {info.minimum:g} and {info.maximum:g}{unit}'
