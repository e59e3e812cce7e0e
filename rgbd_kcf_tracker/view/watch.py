# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Looking into functions while they run, without a line in them.

What is explained must be what the tracker computed, not what somebody computed beside it, and a
tracker must not pay for being explained. So the interpreter's profiling hook is asked to tell of
chosen functions: what they were given, what their variables held at the end, what they returned.

>>> with Watch(peak) as seen:
...     tracker.update(frame)
>>> seen.last(peak).value  # doctest: +SKIP
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import CodeType, FrameType, TracebackType
from typing import Any

import numpy as np

PACKAGE = 'rgbd_kcf_tracker.'

Function = Callable[..., Any]


@dataclass(frozen=True, slots=True, eq=False)
class Call:
    """One run of a watched function.

    Attributes:
        function: as in :func:`name_of`.
        given: its arguments as they were when it was called; ``self`` as a mapping of attributes.
        found: its local variables as they were when it returned, ``self`` likewise.
        value: what it returned.
    """

    function: str
    given: Mapping[str, Any]
    found: Mapping[str, Any]
    value: Any


def name_of(function: Function) -> str:
    """Module below the package and object, parted by a colon, as ``docs/thesis.md`` writes it."""
    return f'{function.__module__.removeprefix(PACKAGE)}:{function.__qualname__}'


class Watch:
    """Keeps the calls of functions that are made by this thread inside a ``with`` block.

    Args:
        functions: plain Python functions and methods, in any number.
    """

    def __init__(self, *functions: Function) -> None:
        self._names: dict[CodeType, str] = {}
        for function in functions:
            plain = getattr(function, '__func__', function)
            self._names[plain.__code__] = name_of(plain)
        self._open: dict[int, dict[str, Any]] = {}
        self._calls: list[Call] = []
        self._before: Any = None

    def __enter__(self) -> Watch:
        self._before = sys.getprofile()
        sys.setprofile(self._profile)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        sys.setprofile(self._before)
        self._open.clear()

    def clear(self) -> None:
        """Forget the calls so far."""
        self._calls.clear()

    def of(self, function: Function) -> list[Call]:
        """The calls of a function, in the order in which they returned."""
        name = name_of(getattr(function, '__func__', function))
        return [call for call in self._calls if call.function == name]

    def by_function(self) -> dict[str, list[Call]]:
        """All calls, by the name of their function."""
        calls: dict[str, list[Call]] = {}
        for call in self._calls:
            calls.setdefault(call.function, []).append(call)
        return calls

    def last(self, function: Function) -> Call:
        """The call of a function that returned last.

        Raises:
            LookupError: where it was not called.
        """
        calls = self.of(function)
        if not calls:
            raise LookupError(f'{name_of(function)} was not called')
        return calls[-1]

    def _profile(self, frame: FrameType, event: str, value: Any) -> None:
        name = self._names.get(frame.f_code)
        if name is None:
            return
        if event == 'call':
            self._open[id(frame)] = _kept(frame.f_locals)
        elif event == 'return' and (given := self._open.pop(id(frame), None)) is not None:
            self._calls.append(Call(name, given, _kept(frame.f_locals), _copied(value)))


def _kept(variables: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: _attributes(value) if name == 'self' else _copied(value)
        for name, value in variables.items()
    }


def _attributes(thing: object) -> Mapping[str, Any]:
    own = getattr(thing, '__dict__', {})
    return {name: _copied(value) for name, value in own.items()}


def _copied(value: Any) -> Any:
    """What a later step may write into is copied; all else is left as it is."""
    return value.copy() if isinstance(value, np.ndarray) else value
