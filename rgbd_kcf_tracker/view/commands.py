# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a browser may ask for, checked before anything is done with it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from rgbd_kcf_tracker.errors import ParameterError

LARGEST_MESSAGE = 4096
"""Bytes of a message: a box, a name or a parameter takes a few hundred."""
LONGEST_NAME = 40
MOST_COMMANDS = 64
"""Requests that wait to be carried out; a further one is refused."""
_FARTHEST = 2**53
"""Largest number: up to it integers and floats are the same."""

# What each command takes, and of which type.
_FIELDS: dict[str, dict[str, type]] = {
    'ack': {},
    'play': {},
    'pause': {},
    'step': {'by': int},
    'seek': {'frame': int},
    'speed': {'value': float},
    'box': {'x': float, 'y': float, 'width': float, 'height': float, 'frame': int},
    'point': {'x': float, 'y': float, 'frame': int},
    'follow': {'id': int, 'frame': int},
    'everyone': {'value': bool},
    'remove': {'id': int},
    'rename': {'id': int, 'name': str},
    'variant': {'name': str},
    'parameter': {'name': str, 'value': object},
    'defaults': {},
}


@dataclass(frozen=True, slots=True)
class Command:
    """A checked request.

    Attributes:
        do: its name.
        values: its fields.
    """

    do: str
    values: dict[str, Any]


def parse(text: str) -> Command:
    """A message from a browser as a command.

    Raises:
        ParameterError: where it is none.
    """
    if len(text) > LARGEST_MESSAGE:
        raise ParameterError(f'message of {len(text)} characters: at most {LARGEST_MESSAGE}')
    try:
        message = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise ParameterError('message is no JSON') from None
    if not isinstance(message, dict) or not isinstance(message.get('do'), str):
        raise ParameterError('message names no command')
    do = message['do']
    fields = _FIELDS.get(do)
    if fields is None:
        raise ParameterError(f'unknown command {do[:LONGEST_NAME]!r}')
    if set(message) - {'do'} != set(fields):
        raise ParameterError(f'command {do} takes {", ".join(fields) or "nothing"}')
    return Command(do, {name: _checked(do, name, message[name], fields[name]) for name in fields})


def _refuse(constant: str) -> float:
    raise ValueError(constant)


def _checked(do: str, name: str, value: Any, kind: Any) -> Any:
    if kind in (int, float) and type(value) in (int, float):
        if abs(value) > _FARTHEST:  # an integer may be too large for a float, and 1e999 is infinite
            raise ParameterError(f'{do}: {name} is out of range')
        value = float(value) if kind is float else value
    if kind is object:
        if type(value) in (bool, int, float, str) and len(str(value)) <= 200:
            return value
    elif type(value) is kind:
        return value.strip()[:LONGEST_NAME] if kind is str and name == 'name' else value
    raise ParameterError(f'{do}: {name} must be of type {kind.__name__}')
