# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""A table: rows and columns once, for the page, the CSV files, the JSON and the terminal alike."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass

Cell = str | float | int | None


@dataclass(frozen=True, slots=True)
class Table:
    """A table.

    Attributes:
        key: short name, the CSV file's.
        title: heading.
        columns: names; the first is the rows' label.
        rows: one cell per column; None or NaN where there is no value.
        digits: decimals of numbers.
        note: what to know of it.
        best: 'max' or 'min' of each number column is set in bold, or '' for none.
        quoted: rows whose label begins so are printed by others and never bold.
    """

    key: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    digits: int = 1
    note: str = ''
    best: str = ''
    quoted: str = 'thesis'

    def csv(self) -> str:
        """As CSV: numbers in full, empty cells where there is no value."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator='\n')
        writer.writerow(self.columns)
        for row in self.rows:
            writer.writerow(
                ['' if _absent(v) else f'{v:.6g}' if isinstance(v, float) else v for v in row]
            )
        return text.getvalue()

    def cells(self) -> list[list[str]]:
        """Rows as people read them, the heading first."""
        return [list(self.columns), *([self._cell(v) for v in row] for row in self.rows)]

    def text(self) -> str:
        """For a terminal."""
        cells = self.cells()
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        lines = [self.title]
        for first, *rest in cells:
            numbers = (cell.rjust(w) for cell, w in zip(rest, widths[1:], strict=True))
            lines.append('  '.join([first.ljust(widths[0]), *numbers]).rstrip())
        return '\n'.join(lines)

    def markdown(self) -> str:
        """For a page of documentation."""
        head, *rows = self.cells()
        bar = ['---', *['---:'] * (len(head) - 1)]
        lines = [[cell.replace('|', '\\|') for cell in row] for row in [head, bar, *rows]]
        return '\n'.join('| ' + ' | '.join(line) + ' |' for line in lines)

    def is_best(self, row: tuple[Cell, ...], column: int) -> bool:
        """Whether a cell is the best of its column."""
        value = row[column]
        if not self.best or column == 0 or not isinstance(value, float):
            return False
        others = [
            v
            for r in self.rows
            if isinstance(v := r[column], float)
            and not (_absent(v) or str(r[0]).startswith(self.quoted))
        ]
        return len(others) > 1 and value == (max if self.best == 'max' else min)(others)

    def _cell(self, value: Cell) -> str:
        if _absent(value):
            return '-'
        return f'{value:.{self.digits}f}' if isinstance(value, float) else str(value)


def _absent(value: Cell) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value))
